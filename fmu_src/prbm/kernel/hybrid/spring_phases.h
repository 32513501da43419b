/* Phases of springs that act on one side. */
#ifndef PRBM_SPRING_PHASES_H
#define PRBM_SPRING_PHASES_H

#include "hybrid/state.h"

/* Set the phase of a spring after its guard has fallen; contact: its number after the contacts. */
PRBM void switch_coil(Simulation *sim, int contact);
/* Set the phases at the start of a motion; return true. */
PRBM bool begin_coils(Simulation *sim);
/* Set the phases of damped springs for rates that have jumped. */
PRBM void rephase_coils(Simulation *sim);

#endif
