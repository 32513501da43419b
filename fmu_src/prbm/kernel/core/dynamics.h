/* Rates of the state, powers, stops and base reactions. */
#ifndef PRBM_DYNAMICS_H
#define PRBM_DYNAMICS_H

#include "core/evaluation.h"

PRBM bool rate(Equations *equations, double t, const double *y, double *dy, Problem *problem);
PRBM void begin_trace(Equations *equations);
PRBM double gap(const Equations *equations, int i, double t, const Complex *e);
PRBM double gap_rate(const Equations *equations, int i, const Complex *e, const double *v);
PRBM void base_reaction(const Equations *equations, const Complex *e, const double *v,
                        const double *a, Complex *force, double *moment, Scratch *scratch);

#endif
