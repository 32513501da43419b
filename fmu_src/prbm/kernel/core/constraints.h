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
/* The loop closures and the guides. */
PRBM Rows loop_rows(const System *system);
/* Rows with the coefficients B (count, d) and the constants c, the first ones of which are the loops; the
 * others are relative to the ground. */
PRBM Rows rows_beside_loops(const System *system, int count, const Complex *B, const double *c,
                            Scratch *scratch);
PRBM Rows gap_rows(const System *system);
PRBM Rows slide_rows(const System *system);
PRBM Rows rub_rows(const System *system);
PRBM double row_value(const Rows *rows, int i, const Complex *e); /* Without c. */
PRBM double row_rate(const Rows *rows, int i, const Complex *e, const double *v);
/* Compute the derivatives of row i by the directions, row (d,). */
PRBM void row_by_direction(const Rows *rows, int i, const Complex *e, double *row);
PRBM void row_jacobian(const Rows *rows, int i, const Complex *e, double *row);
PRBM double row_convective(const Rows *rows, int i, const Complex *e, const double *v);
/* Return f (B E + z) of row i, which a body carries, and f alone, 1 on the ground. */
PRBM Complex seen_value(const Rows *rows, int i, const Complex *e);
PRBM Complex carrier_arm(const Rows *rows, int i, const Complex *e);
PRBM void scalars(const Rows *rows, const Complex *e, double *s);
PRBM void jacobian(const Rows *rows, const Complex *e, double *result); /* (count, n) */
/* Set kkt (n + r, n + r) to [[M, columns^T], [rows, 0]]. */
PRBM void saddle(int n, int r, const double *M, const double *columns, const double *rows,
                 double *kkt);
/* A factored saddle-point matrix P D kkt D = L U, with scales D that make it independent of the
 * units. */
typedef struct {
    int size;
    double *lu, *scale; /* (size, size), (size,) */
    int *pivots;        /* (size,) */
} ScaledFactors;

/* Compute the scales (n + r,) of a saddle-point matrix.  Return false if all elements of a row are
 * round-off in a mechanism of a length [m]. */
PRBM bool scales(int n, int r, const double *kkt, double length, double *scale);
/* Allocate factors of a saddle-point matrix (n + r, n + r) kkt. */
PRBM ScaledFactors take_factors(Scratch *scratch, int size, double *kkt);
/* Factor the matrix that factors->lu contains.  Fail if a row has vanished, or a pivot is
 * round-off. */
PRBM bool factor_saddle(int n, int r, double length, const ScaledFactors *factors,
                        Problem *problem);
/* Replace right (n + r,) by the solution. */
PRBM void solve_saddle(const ScaledFactors *factors, double *right);

/* Return the sign of the determinant of a saddle-point matrix, which is overwritten; 0 if it is
 * singular.  Along a path of equilibria it changes where an odd number of motions become unstable. */
PRBM int determinant_sign(int n, int r, double *kkt, double length, Scratch scratch);
/* Solve a saddle-point system; kkt is overwritten, right (n + r,) replaced by the solution. */
PRBM bool solve(int n, int r, double *kkt, double *right, double length, Scratch scratch,
                Problem *problem);
/* Project q (n,) onto the rows with the constants c (count,), and set e to the directions of q. */
PRBM bool project_positions(const System *system, const Rows *rows, double *q, const double *c,
                            Complex *e, Scratch scratch, Problem *problem);
/* Move v (n,) onto rows v + rates = 0 by impulses along the rows.  The array impulses (r,) may be
 * NULL.  On entry it has the mobilities [1/kg] of the walls: an impulse P changes the rate of its
 * row by mobility times P.  On return it has the impulses [N s]. */
PRBM bool project_velocities(int n, int r, const double *M, const double *rows,
                             const double *rates, double *v, double *impulses, double length,
                             Scratch scratch, Problem *problem);
PRBM int seen_from(const Rows *rows, int i);
PRBM Complex seen_value(const Rows *rows, int i, const Complex *e);
PRBM Complex row_swing(const Rows *rows, int i, const Complex *e, const double *v);

#endif
