/* Positions and velocities that bodies are given at the start. */
#ifndef PRBM_POSITIONS_H
#define PRBM_POSITIONS_H

#include "core/statics.h"

/* Return whether bodies are given positions at the start. */
PRBM bool has_positions(const System *system);
/* Return the largest velocity at the start, rotations times the size [m/s]. */
PRBM double start_speed(const System *system, Scratch scratch);
/* Compute the shape q (n,) with bodies at their positions. */
PRBM bool positioned(const System *system, const double *values, double *q, Scratch scratch,
                     Problem *problem);
/* Compute the velocities v (n,) at the start: of least kinetic energy with those that are given, by the
 * release or to bodies. */
PRBM bool start_velocity(const System *system, const double *q, const double *values, double *v,
                         Scratch scratch, Problem *problem);
PRBM bool release_velocity(const System *system, const double *q, double speed, double *v,
                           Scratch scratch, Problem *problem);

#endif
