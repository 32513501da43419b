/* The largest forces and indentations of contacts at compliant stops. */
#ifndef PRBM_CONTACT_PEAKS_H
#define PRBM_CONTACT_PEAKS_H

#include "hybrid/state.h"

/* Reject an indentation that is larger than the mechanism. */
PRBM bool check_depth(const Simulation *sim, int stop, double depth, double time,
                      Problem *problem);
/* Add force and indentation at the front to the maxima; at: an evaluation there.  If the motion is
 * smooth since the last sample, cubics through both give the maxima between them. */
PRBM bool latch_present(Simulation *sim, const Evaluation *at, bool smooth, Problem *problem);
/* The latest sample of a compliant stop. */
PRBM Dent latest_dent(const Simulation *sim, int stop);
PRBM void store_dent(Simulation *sim, int stop, const Dent *dent);
/* Compute the largest indentation and force of a stop up to a time of the latest step. */
PRBM void peaks_until(Simulation *sim, int stop, double time, double *depth, double *force);
/* Add the maxima up to a time of the latest step to the latched values. */
PRBM bool latch_peaks(Simulation *sim, double time, Problem *problem);

#endif
