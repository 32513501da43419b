/* The values of a simulation in either mode. */
#ifndef PRBM_VALUES_H
#define PRBM_VALUES_H

#include "hybrid/present.h"

/* The vector of outputs with these groups up to date; NULL if they cannot be computed. */
PRBM const double *present_outputs(Simulation *sim, int groups, Problem *problem);
PRBM bool present_moment(Simulation *sim, Moment *now, Problem *problem);

#endif
