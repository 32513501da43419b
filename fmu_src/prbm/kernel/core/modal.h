/* Small vibrations about a static shape. */
#ifndef PRBM_MODAL_H
#define PRBM_MODAL_H

#include "core/statics.h"

/* Return the number k of modes: free bodies do not move. */
PRBM int mode_count(const System *system);
/* Compute frequencies [Hz] (k,) and mass-normalised modes (n, k). */
PRBM bool modes(const System *system, const Equilibrium *shape, double *frequency, double *phi,
                Scratch scratch, Problem *problem);
/* Return the number of unstable directions of a shape with these frequencies (k,): under dead loads
 * if along is NULL, or with a displacement held that the modes change by along (k,). */
PRBM int unstable_directions(int k, const double *frequency, const double *along);
/* Compute the displacement of the released body by modes phi (n, k); 0 if it is round-off. */
PRBM void moved_by(const System *system, const double *q, const double *phi, double *moved,
                   Scratch scratch);
PRBM bool fundamental_frequency(const System *system, double *frequency, Scratch scratch,
                                Problem *problem);
/* Compute the rates [rad/s] of a mechanism without a fundamental frequency: the scales of velocities
 * and of times. */
PRBM bool slow_rates(const System *system, double *rate, double *fast, Scratch scratch,
                     Problem *problem);
/* Compute the fundamental mode phi (n,) and the mass matrix M (n, n) at a shape. */
PRBM bool fundamental_at(const System *system, const double *q, double *phi, double *M,
                         Scratch scratch, Problem *problem);
PRBM double simulated_restitution(int n, const double *phi, const double *M, const double *before,
                                  const double *after);

#endif
