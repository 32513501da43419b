/* The assembled mechanism and the scales of its motion. */
#ifndef PRBM_CONFIGURATION_H
#define PRBM_CONFIGURATION_H

#include "hybrid/state.h"

PRBM bool set_scales(Configuration *configuration, double frequency, Scratch scratch,
                     Problem *problem);
/* Let the values that were set act: copy, check and assemble them. */
PRBM bool take_values(Simulation *sim, Problem *problem);
PRBM bool values_changed(const Simulation *sim);
PRBM bool inputs_changed(const Simulation *sim); /* other than those of walls */
PRBM bool walls_changed(const Simulation *sim);  /* inputs that move walls */
/* The force below which the direction of the force of a guide is round-off. */
PRBM double zero_force(const Configuration *configuration);
PRBM double zero_speed(const Configuration *configuration); /* lower speeds are round-off */
/* Penetration at which a stop that was released too early closes again [m]. */
PRBM double closing_depth(const Configuration *configuration);
PRBM double release_penetration(const Configuration *configuration); /* largest one [m] */
PRBM double zero_acceleration(const Configuration *configuration); /* lower ones are round-off */
PRBM double field_value(const Simulation *sim, Expression field);
PRBM double field_change(const Simulation *sim, Expression field); /* not yet in the field value */

#endif
