/* The part of model exchange that values.c uses. */
#ifndef PRBM_MODEL_EXCHANGE_H
#define PRBM_MODEL_EXCHANGE_H

#include "hybrid/present.h"

PRBM void exchange_begin(Simulation *sim);
PRBM bool exchange_refresh(Simulation *sim, Problem *problem);
PRBM bool exchange_moment(Simulation *sim, Moment *now, Problem *problem);

#endif
