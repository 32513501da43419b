/* Steps of variable size. */
#ifndef PRBM_STEPPING_H
#define PRBM_STEPPING_H

#include "hybrid/state.h"

PRBM double longest_step(const Simulation *sim);
PRBM double rounded_step(double h);
PRBM bool take_step(Simulation *sim, Problem *problem);
/* Compute the latest step again up to a time in it, which becomes the front: with the error of a
 * step, which is below that of the dense output. */
PRBM bool end_step(Simulation *sim, double t, Problem *problem);

/* Return the difference of the solution of lower order at the end of the latest step, relative to
 * the state. */
PRBM double embedded_error(Simulation *sim);
/* Return the root mean square of the difference of two states, relative to the larger of them. */
PRBM double difference(Simulation *sim, const double *y, const double *z);
/* Fail if a projection at time t has changed a state y too much. */
PRBM bool check_projection(Simulation *sim, double t, const double *y, const double *projected,
                           Problem *problem);

#endif
