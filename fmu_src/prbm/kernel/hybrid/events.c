/* Kinds of events: their guards and resets, and their count: the twin of hybrid/events.py. */
#include "hybrid/hybrid.h"

enum { FALLING = -1, EVENT_KINDS = EVENT_REVERSAL + 1 };

/* --- resets ----------------------------------------------------------------------------------- */

static bool apply_impact(Simulation *sim, const Event *event, Problem *problem) {
    return impact(sim, event->contact, problem);
}

static bool apply_release(Simulation *sim, const Event *event, Problem *problem) {
    set_mode(sim, event->contact, CONTACT_OPEN);
    return settle(sim, NULL, 0, NULL, problem);
}

/* A slip or a reversal. */
static bool apply_friction(Simulation *sim, const Event *event, Problem *problem) {
    return settle(sim, NULL, 0, event, problem);
}

/* --- the table -------------------------------------------------------------------------------- */

static const Transition TRANSITIONS[EVENT_KINDS] = {
    {"none", NULL, false, 0, NULL},
    {"impact", gap_guard, false, FALLING, apply_impact},
    {"release", release_guard, true, FALLING, apply_release},
    {"slip", slip_guard, true, FALLING, apply_friction},
    {"reversal", reversal_guard, false, FALLING, apply_friction},
};

PRBM const Transition *transition(int kind) {
    return &TRANSITIONS[kind];
}

PRBM bool watched(const Equations *equations, int kind, int contact) {
    const System *system = equations->system;
    int mode = equations->contacts.modes[contact];
    bool stop = is_stop(system, contact);
    switch (kind) {
    case EVENT_IMPACT: return stop && mode == CONTACT_OPEN;
    case EVENT_RELEASE: return stop && mode != CONTACT_OPEN;
    case EVENT_SLIP: return mode == CONTACT_STICK;
    default:
        return slip_sign(mode) != 0 &&
               (stop || equations->rub_law[3 * (contact - system->s)] > 0.0);
    }
}

/* --- applying events -------------------------------------------------------------------------- */

/* Fail at more events than a motion can have in a short time. */
static bool count_event(Simulation *sim, const Event *event, Problem *problem) {
    State *state = &sim->state;
    double window = EVENT_WINDOW_RTOL * sim->configuration.scales.time;
    if (event->time - state->window_since > window) {
        state->window_since = event->time;
        state->window_count = 0;
    }
    state->window_count++;
    if (state->window_count > EVENTS_MAX) {
        return fail(problem,
                    "more than %d events (%s the last) within %.3g s at t = %.9g s: the contact "
                    "chatters; raise rest_speed or damping.beta, lower the restitution, or give "
                    "the body room between its walls",
                    EVENTS_MAX, transition(event->kind)->name, event->time - state->window_since,
                    event->time);
    }
    return true;
}

PRBM bool apply_event(Simulation *sim, const Event *event, Problem *problem) {
    return count_event(sim, event, problem) &&
           transition(event->kind)->reset(sim, event, problem);
}
