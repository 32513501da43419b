/* Largest stress of flexures so far. */
#ifndef PRBM_PEAKS_H
#define PRBM_PEAKS_H

#include "hybrid/state.h"

/* Whether the stress of a flexure is an output; the other functions do nothing otherwise. */
PRBM bool has_peaks(const Simulation *sim);
/* Clear the peaks. */
PRBM void clear_peaks(Simulation *sim);
/* Count the samples at the front, which the time has reached. */
PRBM void pass_peaks(Simulation *sim);
/* Drop the samples at the front, which the time has not reached. */
PRBM void drop_peaks(Simulation *sim);
/* Count the samples at the front, and those at the present front, from which another motion
 * starts. */
PRBM bool restart_peaks(Simulation *sim, Problem *problem);
/* The same with an evaluation at the front. */
PRBM void restart_peaks_from(Simulation *sim, const Evaluation *at);
/* Store the samples at the end of a step; at: an evaluation there. */
PRBM void step_peaks(Simulation *sim, const Evaluation *at);
/* The same at an event, where the equations have not been evaluated. */
PRBM bool step_peaks_to_event(Simulation *sim, Problem *problem);
/* Compute the outputs of the peaks of a flexure (3,): value, time, position.
 *
 * now: the present stress of the flexure. */
PRBM void peak_outputs(const Simulation *sim, int i, const Stress *now, double *out);

#endif
