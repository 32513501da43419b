/* Mass matrix and quadratic-velocity matrix. */
#ifndef PRBM_KINETICS_H
#define PRBM_KINETICS_H

#include "core/numbers.h"

PRBM void inertia(int n, const Complex *H, const double *J, const Complex *e, double *M, double *C);

#endif
