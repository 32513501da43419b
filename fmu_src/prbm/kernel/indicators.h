/* Event indicators of model exchange. */
#ifndef PRBM_INDICATORS_H
#define PRBM_INDICATORS_H

#include "hybrid/guards.h"

PRBM int indicator_place(const Simulation *sim, EventKind kind, int contact);
PRBM double guard_scale(const Simulation *sim, EventKind kind);
PRBM double lifted_guard(const Simulation *sim, const Instant *at, EventKind kind, int contact);
PRBM double leaving_rate(const Simulation *sim, const Instant *at, int i);
PRBM double release_indicator(const Simulation *sim, const Instant *at, int i);
PRBM void event_indicators(const Simulation *sim, const Instant *at, double *z);

#endif
