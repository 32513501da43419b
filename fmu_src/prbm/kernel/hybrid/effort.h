/* The number of integration steps of a communication step. */
#ifndef PRBM_EFFORT_H
#define PRBM_EFFORT_H

#include "hybrid/state.h"

/* Count one more step to the target time [s]; fail if there are more than EFFORT_MAX in all, or too
 * many within EVENT_WINDOW_RTOL of the period. */
PRBM bool count_step(Simulation *sim, double time, Effort *effort, Problem *problem);

#endif
