/* Scalar functions of the position, and projection onto constraints. */
#ifndef PRBM_CONSTRAINTS_H
#define PRBM_CONSTRAINTS_H

#include "core/system.h"

/* Scalar functions s = Re(f (B E + z)) + c [m].  f is conj(E) of the body that a row is measured
 * relative to, or 1 for the ground. */
typedef struct {
    const System *system;
    int count;
    const Complex *B;       /* (count, d) */
    const double *c;        /* (count,) */
    const Complex *z;       /* (count,), or NULL if on is NULL */
    const int *on;          /* (count,) directions of the bodies, FIXED: ground; NULL: all FIXED */
} Rows;

/* The message for equations without a unique solution. */
#define SINGULAR \
    "the equations of motion are singular in this shape: two constraints are linearly dependent, " \
    "or a part that can move has no mass"

PRBM Rows plain_rows(const System *system, int count, const Complex *B, const double *c);
PRBM Rows gap_rows(const System *system);
PRBM Rows slide_rows(const System *system);
PRBM Rows rub_rows(const System *system);
PRBM double row_value(const Rows *rows, int i, const Complex *e); /* Without c. */
PRBM double row_rate(const Rows *rows, int i, const Complex *e, const double *v);
/* Compute the derivatives of row i by the directions, row (d,). */
PRBM void row_by_direction(const Rows *rows, int i, const Complex *e, double *row);
PRBM void row_jacobian(const Rows *rows, int i, const Complex *e, double *row);
PRBM double row_convective(const Rows *rows, int i, const Complex *e, const double *v);
PRBM void scalars(const Rows *rows, const Complex *e, double *s);
PRBM void jacobian(const Rows *rows, const Complex *e, double *result); /* (count, n) */
/* Set kkt (n + r, n + r) to [[M, columns^T], [rows, 0]]. */
PRBM void saddle(int n, int r, const double *M, const double *columns, const double *rows,
                 double *kkt);
/* Solve a saddle-point system by LU; right (n + r,) is replaced by the solution. */
PRBM bool solve(int size, double *kkt, double *right, Scratch *scratch, Problem *problem);
/* Project q (n,) onto the rows with the constants c (count,), and set e to the directions of q. */
PRBM bool project_positions(const System *system, const Rows *rows, double *q, const double *c,
                            Complex *e, Scratch *scratch, Problem *problem);
/* Move v (n,) onto rows v + rates = 0 by impulses along the rows.  The array impulses (r,) may be
 * NULL.  On entry it has the mobilities [1/kg] of the walls: an impulse P changes the rate of its
 * row by mobility times P.  On return it has the impulses [N s]. */
PRBM bool project_velocities(int n, int r, const double *M, const double *rows,
                             const double *rates, double *v, double *impulses, Scratch *scratch,
                             Problem *problem);
PRBM int seen_from(const Rows *rows, int i);
PRBM Complex seen_value(const Rows *rows, int i, const Complex *e);
PRBM Complex swing(const Rows *rows, int i, const Complex *e, const double *v);

#endif
