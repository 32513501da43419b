/* Steps of variable size. */
#ifndef PRBM_STEPPING_H
#define PRBM_STEPPING_H

#include "hybrid/state.h"

PRBM bool take_step(Simulation *sim, Problem *problem);
/* Compute the latest step again up to a time in it, which becomes the front: with the error of a
 * step, which is below that of the dense output. */
PRBM bool end_step(Simulation *sim, double t, Problem *problem);

#endif
