/* Steps of the Runge-Kutta pair, their errors and their dense output. */
#ifndef PRBM_RUNGE_KUTTA_H
#define PRBM_RUNGE_KUTTA_H

#include "core/evaluation.h"

/* Least and largest forces of the closed stops at the stages of a step. */
typedef struct {
    double *least, *largest; /* (held_count,) */
} ForceRange;

enum { NODES = 3 };

/* Compute the stages k (STAGES, n) after the first, which is given, the new state y1 and its
 * evaluation.  The reference becomes that of y. */
PRBM bool stages(const Equations *equations, double t, int n, const double *y, double h,
                 double *k, double *y1, Reference *reference, Evaluation *evaluation,
                 ForceRange *forces, Problem *problem);
/* The differences between the solution and those of orders 5 and 3. */
PRBM void errors_of(int n, const double *k, double h, double *fine, double *coarse);
/* The first of them only. */
PRBM void fine_error_of(int n, const double *k, double h, double *fine);
PRBM void weights(double theta, double *b);
/* Compute the state at the end of a step from its stages. */
PRBM void step_end(int n, const double *y, const double *k, double h, double *end);
PRBM void interpolate(int n, const double *y, const double *k, double h, double theta,
                      double *result);
/* Compute the weights (3, 3) of value, first and second derivative at three nodes in the value at t
 * of a polynomial of degree eight, and in its derivative. */
PRBM void hermite_weights(const double *nodes, double t, double *value, double *rate);
PRBM void furthest(int n, int ny, const double *k, double h, double *distance);

#endif
