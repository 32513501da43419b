/* Mass matrix, quadratic velocities and kinetic energy. */
#ifndef PRBM_KINETICS_H
#define PRBM_KINETICS_H

#include "core/numbers.h"

PRBM void inertia(int n, const Complex *H, const double *J, const Complex *e, double *M, double *C);
PRBM double kinetic_energy(int n, const double *M, const double *v);

#endif
