/* Contacts after the walls or the velocities have changed. */
#ifndef PRBM_MOVED_H
#define PRBM_MOVED_H

#include "hybrid/state.h"

PRBM bool choose_moved_modes(Simulation *sim, Problem *problem); /* after velocities have jumped */
PRBM bool follow_walls(Simulation *sim, const double *lam, double time, Problem *problem);

#endif
