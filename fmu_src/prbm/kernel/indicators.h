/* Event indicators of model exchange. */
#ifndef PRBM_INDICATORS_H
#define PRBM_INDICATORS_H

#include "hybrid/guards.h"

/* The indicator of the next extremum of the indentation or the force of a pressed stop.  value: the
 * smaller one of their rates, relative and of the sign after the latest event, plus a margin;
 * of_force: whether it is that of the force; sign: its sign after the latest event. */
typedef struct {
    double value, sign;
    bool of_force;
} Turn;

/* The indicators of a spring by its strain and by its force, 1 if its phase does not end by them, and
 * the rate of the guard of its strain. */
typedef struct {
    double strain, force, rate;
} CoilIndicators;

PRBM CoilIndicators coil_indicators(const Simulation *sim, const Instant *at, int contact);
/* Store the signs of the rates of indentation and force of all pressed stops; at has an evaluation.
 * The next change of a sign is a state event. */
PRBM void watch_turns(Simulation *sim, const Instant *at);
PRBM Turn turn_indicator(const Simulation *sim, const Instant *at, int i);
PRBM int indicator_place(const Simulation *sim, EventKind kind, int contact);
PRBM double guard_scale(const Simulation *sim, EventKind kind);
PRBM double lifted_guard(const Simulation *sim, const Instant *at, EventKind kind, int contact);
PRBM double leaving_rate(const Simulation *sim, const Instant *at, int i);
PRBM double release_indicator(const Simulation *sim, const Instant *at, int i);
PRBM void event_indicators(const Simulation *sim, const Instant *at, double *z);

#endif
