/* Moving walls. */
#ifndef PRBM_WALLS_H
#define PRBM_WALLS_H

#include "hybrid/state.h"

PRBM void start_walls(Simulation *sim);
PRBM bool join_walls(Simulation *sim, double time, Wall *joined);
PRBM double jump_allowed(const Simulation *sim, int i);
PRBM bool turn_walls(const Simulation *sim, Wall *turned);
PRBM Wall turned_wall(const Wall *wall, double t, double velocity, double rate);
PRBM double wall_reach(const Wall *wall, double h);
PRBM double follow_cubics(Simulation *sim);
PRBM bool follow_walls(Simulation *sim, bool drifted, double time, Problem *problem);

#endif
