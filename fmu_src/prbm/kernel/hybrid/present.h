/* The present moment, and the record of the present quantities that are up to date. */
#ifndef PRBM_PRESENT_H
#define PRBM_PRESENT_H

#include "hybrid/guards.h"

/* A state, its rates (ny,) and its evaluation. */
typedef struct {
    Instant at;
    const double *rates;
    const Evaluation *evaluation;
} Moment;

/* Evaluate the rates of the present state y, unless they are up to date. */
PRBM bool moment_at(Simulation *sim, const double *y, Moment *now, Problem *problem);

#endif
