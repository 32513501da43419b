/* Impacts at the stops and impulses at the forces. */
#ifndef PRBM_IMPACTS_H
#define PRBM_IMPACTS_H

#include "hybrid/state.h"

PRBM bool impact(Simulation *sim, int hit, Problem *problem);
PRBM bool impulses_changed(const Simulation *sim);
PRBM const double *given_impulses(const Simulation *sim);
PRBM bool receive_impulses(Simulation *sim, Problem *problem);

#endif
