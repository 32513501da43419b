/* The coordinates that the loops determine. */
#ifndef PRBM_DEPENDENTS_H
#define PRBM_DEPENDENTS_H

#include "hybrid/state.h"

/* The loops in the dependent coordinates, in working memory. */
typedef struct {
    int *dependent, *pivot; /* (r,) */
    double *rows, *a, *s;   /* (r, n), (r, r) factored, (r,) residuals */
} Loops;

PRBM Loops take_loops(const Simulation *sim, Scratch *scratch);
/* Factor the Jacobian of the loops in the dependent coordinates; false if it is singular. */
PRBM bool factor_dependents(const Simulation *sim, Loops *loops);
PRBM bool singular_choice(const Simulation *sim, const int *dependent, Problem *problem);
PRBM bool complete(Simulation *sim, double *q, double *v, Problem *problem);
/* Copy the states x of model exchange from a state y (ny,), or to it. */
PRBM void states_of(const Simulation *sim, const double *y, double *x);
PRBM void load_states(const Simulation *sim, const double *x, double *y);

/* Return the slot of a coordinate (angle or strain), or of its rate. */
PRBM int coordinate_slot(const Mechanism *m, int j, bool rate);

#endif
