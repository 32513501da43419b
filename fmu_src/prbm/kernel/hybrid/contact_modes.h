/* The choice of the contact state. */
#ifndef PRBM_CONTACT_MODES_H
#define PRBM_CONTACT_MODES_H

#include "hybrid/state.h"

PRBM bool settle(Simulation *sim, const int *touching, int touching_count, const Event *event,
                 Problem *problem);
PRBM bool settle_moved(Simulation *sim, Problem *problem); /* after velocities have jumped */

#endif
