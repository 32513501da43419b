/* Phases of the contacts at compliant stops. */
#ifndef PRBM_PHASES_H
#define PRBM_PHASES_H

#include "hybrid/state.h"

/* Set the phases of all contacts for the present rates. */
PRBM bool rephase(Simulation *sim, Problem *problem);
/* Make frozen stops forces, before impulses act. */
PRBM void unfreeze(Simulation *sim);
/* Make the frozen stops that are open forces; return whether there are any. */
PRBM bool press_released(Simulation *sim);
/* Compute the second derivative of the indentation of a stop at the front. */
PRBM bool indentation_acceleration(Simulation *sim, int stop, double *result, Problem *problem);
/* Set the contact of a stop.  A contact that becomes free, or begins, has no friction. */
PRBM void set_phase(Simulation *sim, int stop, Phase phase, double speed, double depth);

#endif
