/* The Runge-Kutta pair 5(4) of Bogacki and Shampine with a quartic dense output. */
#ifndef PRBM_RUNGE_KUTTA_H
#define PRBM_RUNGE_KUTTA_H

#include "core/equations.h"

PRBM bool stages(Equations *equations, int n, double t, const double *y, double h, double *k,
                 double *y1, Problem *problem);
PRBM void error_of(int n, const double *k, double h, double *error);
PRBM void weights(double theta, double *b);
PRBM void interpolate(int n, const double *y, const double *k, double h, double theta,
                      double *result);

#endif
