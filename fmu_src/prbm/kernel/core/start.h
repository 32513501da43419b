/* The shape from which a mechanism is released. */
#ifndef PRBM_START_H
#define PRBM_START_H

#include "core/system.h"

/* Compute the coordinates q (n,) of the released shape for the values of all parameters. */
PRBM bool start_shape(const System *system, const double *values, double *q, Scratch scratch,
                      Problem *problem);
/* Count the unstable directions of the equilibrium under gravity and, unless the release is along a
 * mode or bodies are given positions, of the shape held at the amount of the release. */
PRBM bool instability(const System *system, const double *values, int *rest, int *release,
                      Scratch scratch, Problem *problem);

#endif
