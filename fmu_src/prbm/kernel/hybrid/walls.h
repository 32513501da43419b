/* Moving walls. */
#ifndef PRBM_WALLS_H
#define PRBM_WALLS_H

#include "hybrid/state.h"

PRBM void start_walls(Simulation *sim);
PRBM bool same_walls(const Simulation *sim);
PRBM bool join_walls(Simulation *sim, double time, Wall *joined);
PRBM double jump_allowed(const Simulation *sim, int i);
PRBM bool new_velocity(const Simulation *sim, int i);
PRBM Wall wall_at_event(const Simulation *sim, int i);
PRBM Wall pushed_wall(const Wall *wall, double t, double change);
PRBM double wall_reach(const Wall *wall, double h);
PRBM double longest_wall_step(const Simulation *sim);
PRBM void arrive_walls(Simulation *sim);
PRBM bool follow_walls(Simulation *sim, bool drifted, double time, Problem *problem);

#endif
