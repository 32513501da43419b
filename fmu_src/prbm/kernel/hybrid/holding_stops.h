/* The stops that hold, and the contact state that is tried. */
#ifndef PRBM_HOLDING_STOPS_H
#define PRBM_HOLDING_STOPS_H

#include "hybrid/state.h"

/* The stops that stay closed, and the acceleration at which the others open; whether there are any
 * that are pressed while the others open. */
typedef struct {
    int count, stops[STOPS_MAX];
    double opening;
    bool found;
} HoldingSet;

PRBM bool find_holding_stops(Simulation *sim, int count, const int *candidates, const double *q,
                             const double *v, HoldingSet *resting, Problem *problem);
PRBM bool holding_stops(Simulation *sim, int count, const int *candidates, const double *q,
                       const double *v, HoldingSet *resting, Problem *problem);
/* The trial equations in which a set of stops is closed; what slides has friction. */
PRBM const Equations *equations_holding(Simulation *sim, const HoldingSet *resting,
                                        const double *q, const double *v);

/* Set up the trial equations in the trial's contact state, and evaluate them. */
PRBM void try_contacts(Simulation *sim);
PRBM bool evaluate_trial(Simulation *sim, const double *q, const double *v, Problem *problem);
/* The mode of a closed contact with a sliding velocity, CONTACT_FRICTIONLESS at round-off. */
PRBM ContactMode slip_mode(const Simulation *sim, double speed);

#endif
