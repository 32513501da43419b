/* The outputs at the present state. */
#ifndef PRBM_OUTPUTS_H
#define PRBM_OUTPUTS_H

#include "hybrid/state.h"

PRBM int output_groups(const Simulation *sim, int slot);
PRBM bool compute_outputs(Simulation *sim, int groups, bool near, Problem *problem);

#endif
