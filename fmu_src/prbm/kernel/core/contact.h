/* Rigid impacts in contact space. */
#ifndef PRBM_CONTACT_H
#define PRBM_CONTACT_H

#include "core/constraints.h"

/* Compute the changes of velocity X (n, k) by unit impulses along the rows (k, n).  The rates of
 * the rows in the factored saddle-point matrix do not change. */
PRBM void factored_response(const ScaledFactors *factors, int n, int k, const double *rows,
                            double *X, Scratch scratch);
/* The same, with the rows held (r, n) whose rates do not change.  length: the size of the mechanism
 * [m]. */
PRBM bool response(int n, int r, int k, const double *M, const double *held, const double *rows,
                   double length, double *X, Scratch scratch, Problem *problem);
/* Return the mobility below which no motion along a row (n,) is possible: SINGULAR_RTOL of that
 * without constraints, estimated by the diagonal of M, and at least that of round-off. */
PRBM double least_mobility(int n, const double *M, const double *row, double length);
/* Compute the inverse mass in contact space, W = rows X (k, k), of rows (k, n) and their response X,
 * without the round-off that directions leave in which no motion is possible. */
PRBM void contact_mobility(int n, int k, const double *M, const double *rows, const double *X,
                           double length, double *W);
/* speed: the speed [m/s] relative to which violations of the laws count as round-off. */
PRBM bool newton(int k, const double *W, const double *u, const double *restitution, double speed,
                 double *P, Scratch scratch, Problem *problem);
PRBM bool stronge(const double *W, const double *u, double friction, double restitution,
                  double speed, double *P_n, double *P_t, Problem *problem);
PRBM bool several(int k, const double *W, const double *u, const double *friction,
                  const double *restitution, double speed, double *P, Scratch scratch,
                  Problem *problem);

#endif
