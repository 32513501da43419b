/* The fastest mode, whose rate limits the steps of an explicit method. */
#ifndef PRBM_STABILITY_H
#define PRBM_STABILITY_H

#include "hybrid/state.h"

/* Find the fastest mode at the front, from an arbitrary direction. */
PRBM bool find_fastest(Simulation *sim, Problem *problem);
/* Improve the fastest mode by one power iteration at the end of the last step. */
PRBM void refine_fastest(Simulation *sim);
/* The longest step at which the integration is stable [s]; infinite without springs. */
PRBM double stable_step(const Simulation *sim);

#endif
