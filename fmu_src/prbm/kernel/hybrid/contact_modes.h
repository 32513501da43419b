/* The choice of the contact state. */
#ifndef PRBM_CONTACT_MODES_H
#define PRBM_CONTACT_MODES_H

#include "hybrid/state.h"

/* The stops that hold.  found: whether this choice satisfies the laws of contact. */
typedef struct {
    int count, stops[STOPS_MAX];
    bool found;
} HoldingSet;

PRBM bool find_holding_stops(Simulation *sim, int count, const int *candidates, const double *q,
                             const double *v, HoldingSet *holding, Problem *problem);
/* Change the side to which a slipping guide pushes.  Fail if friction reverses the effect of its force on
 * the motion across its line, on either side (Painleve's paradox): it jams. */
PRBM bool change_side(Simulation *sim, int contact, Problem *problem);
/* The trial equations in which a set of stops is closed and all contacts with a velocity slip. */
PRBM const Equations *equations_holding(Simulation *sim, const HoldingSet *holding,
                                        const double *q, const double *v);
PRBM bool choose_modes(Simulation *sim, const int *touching, int touching_count, const Event *event,
                 Problem *problem);

#endif
