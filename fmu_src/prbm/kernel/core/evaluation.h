/* Accelerations and multipliers at a state. */
#ifndef PRBM_EVALUATION_H
#define PRBM_EVALUATION_H

#include "core/equations.h"

/* Accelerations a (n,) and multipliers lam (r,): loops, held stops (> 0 pushes), what sticks. */
PRBM bool accelerations(Equations *equations, const double *q, const double *v, double *a,
                        double *lam, Problem *problem);
PRBM double energy_here(const Equations *equations, const double *v); /* kinetic, of what was
                                                                         evaluated last */
PRBM double rub_limit(const Equations *equations, int i, const Complex *e);

#endif
