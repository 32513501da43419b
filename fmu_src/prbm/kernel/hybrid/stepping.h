/* Steps of variable size. */
#ifndef PRBM_STEPPING_H
#define PRBM_STEPPING_H

#include "hybrid/state.h"

PRBM double longest_step(const Simulation *sim);
PRBM bool take_step(Simulation *sim, Problem *problem);

#endif
