/* The latest step and its dense output. */
#ifndef PRBM_ARC_H
#define PRBM_ARC_H

#include "hybrid/state.h"

/* Forget the values that were computed from the step; call it when the step has changed. */
PRBM void forget_arc(Simulation *sim);
PRBM void arc_at(const Simulation *sim, double t, double *y);
/* Compute the state by the dense output of the step to the impact that was located last. */
PRBM void arc_located(const Simulation *sim, double t, double *y);
/* Compute a step from the start of the latest step to time t: its stages k (STAGES, ny) and the
 * state y at its end, which is not projected. */
PRBM bool arc_cut(Simulation *sim, double t, double *k, double *y, Problem *problem);
/* Compute the state y at the present time, projected onto the constraints, its arms e (d,), and a
 * reference near it.  The evaluation is working memory. */
PRBM bool arc_state(Simulation *sim, double *y, Complex *e, Reference *near, Evaluation *evaluation,
                    Scratch scratch, Problem *problem);

#endif
