/* Moving walls. */
#ifndef PRBM_WALLS_H
#define PRBM_WALLS_H

#include "hybrid/state.h"

PRBM void start_walls(Simulation *sim);
PRBM bool join_walls(Simulation *sim, double time);
PRBM double jump_allowed(const Simulation *sim, int i);
PRBM void turn_walls(Simulation *sim);
PRBM double push_wall(Simulation *sim, int i, double P);
PRBM double follow_cubics(Simulation *sim);
PRBM bool follow_walls(Simulation *sim, bool drifted, double time, Problem *problem);

#endif
