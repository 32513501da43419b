/* Moving walls. */
#ifndef PRBM_WALLS_H
#define PRBM_WALLS_H

#include "hybrid/state.h"

PRBM void start_walls(Simulation *sim);
PRBM void place_walls(Simulation *sim);
PRBM bool join_walls(Simulation *sim, double time);
PRBM double jump_allowed(const Simulation *sim, int i);
PRBM void turn_walls(Simulation *sim);
PRBM double push_wall(Simulation *sim, int i, double P);
PRBM double follow_cubics(Simulation *sim);
PRBM bool follow_walls(Simulation *sim, bool drifted, double time, Problem *problem);

/* Compute the gaps of all stops at the present time and front, and their rates. */
PRBM void gaps_and_rates(Simulation *sim, double *gaps, double *rates);
/* After a change of stop.offset, move each wall so that its gap and rate are the given ones.  The
 * wall then joins its reference along a cubic. */
PRBM void keep_gaps(Simulation *sim, const double *gaps, const double *rates);

#endif
