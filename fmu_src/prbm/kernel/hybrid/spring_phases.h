/* Phases of springs that act on one side. */
#ifndef PRBM_SPRING_PHASES_H
#define PRBM_SPRING_PHASES_H

#include "hybrid/state.h"

/* Set the phase of a spring after its guard has fallen; contact: its number after the contacts. */
PRBM void switch_coil(Simulation *sim, int contact);
/* Set the phases at the start of a motion; return true. */
PRBM bool begin_coils(Simulation *sim);
/* Set the phases of damped springs for rates that have jumped.  A spring that has switched keeps its
 * phase: its force is round-off.  switched: its number after the contacts, or -1. */
PRBM void rephase_coils(Simulation *sim, int switched);

#endif
