/* The columns in which the rows of constraints may not be zero.  A row of a loop is zero in the
 * columns of flexures that the loop does not contain. */
#ifndef PRBM_INTERVALS_H
#define PRBM_INTERVALS_H

#include "core/constraints.h"

/* The columns from start to end, both even; of directions, with the index of their branch. */
typedef struct {
    int start, end, branch;
} Interval;

/* Row k has the intervals from first[k] to first[k + 1], in the order of their columns. */
typedef struct {
    int *first; /* (count + 1,) */
    Interval *list;
    bool *repeats; /* (count,): whether a row has those of the row before it */
} Intervals;

/* The intervals of the rows by the directions, and of U^-1 rows^T, with the factor U of the mass
 * matrix.  They are the same unless mapped. */
typedef struct {
    Intervals directions, coordinates;
    bool *used; /* (max(n, d),) working memory */
} RowIntervals;

PRBM RowIntervals place_intervals(const System *system, size_t rows, Memory *memory);
/* Set the intervals of rows.  If whole, each row has one, of all columns, without a branch. */
PRBM void set_intervals(const Rows *rows, bool whole, RowIntervals *intervals);
/* Return the product of row k of x, or of D x, with y; D is diagonal. */
PRBM double interval_product(const Intervals *intervals, int k, const double *x, const double *y);
PRBM double scaled_interval_product(const Intervals *intervals, int k, const double *D,
                                    const double *x, const double *y);
/* Compute the row k, -Im(b e), and its convective term Re(b e) v^2, in its intervals.  B is
 * conj(b). */
PRBM void convect_intervals(const Intervals *intervals, int k, Parts B, Parts e,
                            const double *squares, double *row,
                            double *convective);

#endif
