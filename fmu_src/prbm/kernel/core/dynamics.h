/* Rates of the state, powers, stops and base reactions. */
#ifndef PRBM_DYNAMICS_H
#define PRBM_DYNAMICS_H

#include "core/evaluation.h"

/* Compute the rates dy of y = (q, v, dissipated energy, work, states of compliant stops) at time
 * t. */
PRBM bool rate(const Equations *equations, double t, const double *y, const Reference *near,
               Evaluation *result, double *dy, Problem *problem);
/* Compute the rates as rate does, with the time and the states of compliant stops stored in
 * the result.  Rates depend on the time only if walls move. */
PRBM bool rate_at_time(const Equations *equations, const double *y, const Reference *near,
                       Evaluation *result, double *dy, Problem *problem);
/* Copy the forces and moments of guides from lam, or their changes, to out. */
PRBM void guide_loads(const System *system, const double *lam, double *out);
PRBM void base_reaction(const Equations *equations, const Complex *e, const double *v,
                        const double *a, Complex *force, double *moment, Scratch scratch);
/* Compute the second derivatives (d,) of the arms. */
PRBM void arm_accelerations(const System *system, const Complex *e, const double *v,
                            const double *a, Complex *result, Scratch scratch);
PRBM Complex along_arms(int n, const Complex *A, const Complex *e);

#endif
