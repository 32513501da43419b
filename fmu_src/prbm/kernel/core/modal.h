/* Small vibrations about a static shape. */
#ifndef PRBM_MODAL_H
#define PRBM_MODAL_H

#include "core/statics.h"

/* Compute frequencies [Hz] (k,) and mass-normalised modes (n, k), k = n - r. */
PRBM bool modes(const System *system, const Equilibrium *shape, double *frequency, double *phi,
                Scratch *scratch, Problem *problem);
PRBM bool fundamental_frequency(const System *system, double *frequency, Scratch *scratch,
                                Problem *problem);
/* Compute the rates [rad/s] of a mechanism without a fundamental frequency: the scales of velocities
 * and of times. */
PRBM bool slow_rates(const System *system, double *rate, double *fast, Scratch *scratch,
                     Problem *problem);
/* Compute the fundamental mode phi (n,) and the mass matrix M (n, n) at a shape. */
PRBM bool fundamental_at(const System *system, const double *q, double *phi, double *M,
                         Scratch *scratch, Problem *problem);
PRBM double simulated_restitution(int n, const double *phi, const double *M, const double *before,
                                  const double *after);

#endif
