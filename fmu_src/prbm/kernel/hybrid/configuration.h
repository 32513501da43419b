/* The assembled mechanism and the scales of its motion. */
#ifndef PRBM_CONFIGURATION_H
#define PRBM_CONFIGURATION_H

#include "hybrid/state.h"

PRBM void set_scales(Configuration *configuration, double frequency);
PRBM bool take_values(Simulation *sim, Problem *problem); /* act on the values set */
PRBM bool values_changed(const Simulation *sim);
PRBM bool inputs_changed(const Simulation *sim); /* except those that move walls */
PRBM double zero_speed(const Configuration *configuration); /* lower speeds are round-off */
PRBM double zero_acceleration(const Configuration *configuration); /* likewise for accelerations */
PRBM double field_value(const Simulation *sim, Expression field);

#endif
