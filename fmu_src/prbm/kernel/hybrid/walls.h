/* Moving walls. */
#ifndef PRBM_WALLS_H
#define PRBM_WALLS_H

#include "hybrid/state.h"

/* Set the position and velocity of each wall to those of its reference. */
PRBM void place_walls(Simulation *sim);
/* Compute the walls (s,) from the present time on, from the present ones. */
PRBM void join_walls(Simulation *sim, double time, bool set, const Wall *present, Wall *joined);
PRBM bool keep_gaps(Simulation *sim, Wall *joined, Problem *problem);
PRBM double jump_allowed(const Simulation *sim, int i);
PRBM void turn_walls(Simulation *sim);
PRBM double push_wall(Simulation *sim, int i, double P);
PRBM double follow_cubics(Simulation *sim);

#endif
