/* The start of a motion: the twin of hybrid/release.py. */
#ifndef PRBM_RELEASE_H
#define PRBM_RELEASE_H

#include "hybrid/state.h"

/* Start the motion; the caller keeps a backup for the case of failure. */
PRBM bool start_motion(Simulation *sim, double start_time, double tolerance, SimulationMode mode,
                       Problem *problem);
/* Set the scalars of the state to their values before the start. */
PRBM void clear_progress(State *state, double start_time);
/* Clear the contacts, walls and impacts. */
PRBM void clear_stops(Simulation *sim);

#endif
