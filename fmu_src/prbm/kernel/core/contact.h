/* Rigid impacts in contact space. */
#ifndef PRBM_CONTACT_H
#define PRBM_CONTACT_H

#include "core/memory.h"

/* Compute the changes of velocity X (n, k) by unit impulses along the rows (k, n).  The rates of
 * the rows held (r, n) do not change. */
PRBM bool response(int n, int r, int k, const double *M, const double *held, const double *rows,
                   double *X, Scratch *scratch, Problem *problem);
/* speed: the speed [m/s] relative to which violations of the laws count as round-off. */
PRBM bool newton(int k, const double *W, const double *u, const double *restitution, double speed,
                 double *P, Scratch *scratch, Problem *problem);
PRBM bool stronge(const double *W, const double *u, double friction, double restitution,
                  double speed, double *P_n, double *P_t, Problem *problem);
PRBM bool several(int k, const double *W, const double *u, const double *friction,
                  const double *restitution, double speed, double *P, Scratch *scratch,
                  Problem *problem);

#endif
