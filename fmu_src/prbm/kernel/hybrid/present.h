/* The present moment, and the record of the present quantities that are up to date. */
#ifndef PRBM_PRESENT_H
#define PRBM_PRESENT_H

#include "hybrid/guards.h"

/* A state, its rates (ny,) and the evaluation of the equations that gives them. */
typedef struct {
    Instant at;
    const double *rates;
    const Evaluation *evaluation;
} Moment;

PRBM void forget_present(Simulation *sim); /* time, states, inputs or parameters have been set */
PRBM void forget_outputs(Simulation *sim); /* the front or its equations have changed */
/* The present moment at the present state y. */
PRBM bool moment_at(Simulation *sim, const double *y, Moment *now, Problem *problem);

#endif
