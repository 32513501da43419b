/* The latest step and its dense output. */
#ifndef PRBM_ARC_H
#define PRBM_ARC_H

#include "hybrid/state.h"

PRBM void arc_at(const Simulation *sim, double t, double *y);
/* The state y at the present time, on the constraints; near is set to a reference near it, and the
 * evaluation is working memory. */
PRBM bool arc_state(Simulation *sim, double *y, Reference *near, Evaluation *evaluation,
                    Problem *problem);

#endif
