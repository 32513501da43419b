/* The values of a simulation in either mode. */
#ifndef PRBM_VALUES_H
#define PRBM_VALUES_H

#include "hybrid/present.h"

/* Update the given groups of outputs and return the vector of all outputs; NULL on failure. */
PRBM const double *present_outputs(Simulation *sim, int groups, Problem *problem);
PRBM bool present_moment(Simulation *sim, Moment *now, Problem *problem);

#endif
