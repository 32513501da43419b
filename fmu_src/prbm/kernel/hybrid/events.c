/* Events: the table of guards and resets, the first event of a step, and the limit of the number of
 * events: the twin of hybrid/events.py. */
#include "hybrid/access.h"
#include "hybrid/compliant.h"
#include "hybrid/contact_names.h"
#include "hybrid/contact_modes.h"
#include "hybrid/events.h"
#include "hybrid/guards.h"
#include "hybrid/impacts.h"
#include "hybrid/phases.h"
#include "hybrid/spring_guards.h"
#include "hybrid/spring_phases.h"

/* --- resets ----------------------------------------------------------------------------------- */

static bool apply_impact(Simulation *sim, const Event *event, Problem *problem) {
    return impact(sim, event->contact, problem);
}

static bool apply_release(Simulation *sim, const Event *event, Problem *problem) {
    set_mode(sim, event->contact, CONTACT_OPEN);
    (void)press_released(sim);
    return choose_modes(sim, NULL, 0, NULL, problem);
}

static bool apply_switch(Simulation *sim, const Event *event, Problem *problem) {
    return switch_phase(sim, event->contact, problem);
}

static bool apply_separation(Simulation *sim, const Event *event, Problem *problem) {
    return separate(sim, event->contact, problem);
}

static bool apply_action(Simulation *sim, const Event *event, Problem *problem) {
    switch_coil(sim, event->contact);
    return choose_modes(sim, NULL, 0, event, problem);
}

/* A slip or a reversal. */
static bool apply_friction(Simulation *sim, const Event *event, Problem *problem) {
    return choose_modes(sim, NULL, 0, event, problem);
}

static bool apply_side(Simulation *sim, const Event *event, Problem *problem) {
    return change_side(sim, event->contact, problem) && choose_modes(sim, NULL, 0, event, problem);
}

/* --- the table -------------------------------------------------------------------------------- */

static const Transition TRANSITIONS[EVENT_KINDS] = {
    [EVENT_RELEASE] = {{"release", release_guard, true, NULL}, held_stop, release_near, false,
                       yield_time, apply_release},
    [EVENT_SLIP] = {{"slip", slip_guard, true, NULL}, sticking_contact, slip_near, false, yield_time,
                    apply_friction},
    [EVENT_REVERSAL] = {{"reversal", reversal_guard, false, NULL}, slipping_contact, reversal_near,
                        true, reversal_time, apply_friction},
    [EVENT_SIDE] = {{"change of side", side_guard, true, NULL}, slipping_guide, side_near, false,
                    side_time, apply_side},
    [EVENT_SWITCH] = {{"switch", switching_guard, false, NULL}, pressed_stop, pressed_near, false,
                      switching_time, apply_switch},
    [EVENT_SEPARATION] = {{"separation", indentation_guard, false, indentation_rate_guard},
                          pressed_stop, separation_near, true, closing_time, apply_separation},
    [EVENT_ACTION] = {{"action", action_guard, false, NULL}, one_sided_coil, action_near, true,
                      action_time, apply_action},
    [EVENT_IMPACT] = {{"impact", gap_guard, false, gap_rate_guard}, open_stop, impact_near, true,
                      closing_time, apply_impact},
};

PRBM const Transition *transition(EventKind kind) {
    return &TRANSITIONS[kind];
}

/* --- the first event of a step ---------------------------------------------------------------- */

/* Replace *first by the first event of a kind, if that is earlier. */
static bool find_events(Simulation *sim, EventKind kind, Event *first, Problem *problem) {
    const Transition *row = transition(kind);
    ContactRange range = contacts_of(sim, kind);
    for (int contact = range.first; contact < range.end; contact++) {
        Fall fall = {false, 0.0};
        if (row->watched(&sim->equations, contact) &&
            !row->detect(sim, &row->guard, contact, &fall, problem)) {
            return false;
        }
        if (fall.found && (first->kind == EVENT_NONE || fall.time < first->time)) {
            Event found = {kind, contact, fall.time};
            *first = found;
        }
    }
    return true;
}

/* The first kind of events that the present contacts allow: an open stop has impacts only, after the
 * events of springs. */
static EventKind first_kind(const Equations *eq) {
    bool closed = eq->held_count > 0 || eq->sticking_count > 0 || eq->slipping_count > 0;
    return closed ? EVENT_NONE + 1 : eq->pressed_count > 0 ? EVENT_SWITCH : EVENT_ACTION;
}

PRBM bool first_event(Simulation *sim, Event *first, Problem *problem) {
    const Event none = {EVENT_NONE, 0, 0.0};
    bool near[EVENT_KINDS], any = false, samples = false, ok = true;
    EventKind begin = first_kind(&sim->equations);
    *first = none;
    for (EventKind kind = begin; kind < EVENT_KINDS; kind++) {
        near[kind] = transition(kind)->near(sim);
        any = any || near[kind];
        samples = samples || (near[kind] && transition(kind)->samples);
    }
    if (!any) {
        return true;
    }
    if (samples) {
        sample_arc(sim);
    }
    for (EventKind kind = begin; ok && kind < EVENT_KINDS; kind++) {
        ok = !near[kind] || find_events(sim, kind, first, problem);
    }
    return ok;
}

/* --- applying events -------------------------------------------------------------------------- */

/* Count an event; fail if more than EVENTS_MAX occur within a short time.  A change of the phase of a
 * compliant stop or of a spring does not count: the motion is continuous there, and steps are
 * counted. */
static bool count_event(Simulation *sim, const Event *event, Problem *problem) {
    State *state = &sim->state;
    double window = EVENT_WINDOW_RTOL * sim->configuration.scales.time;
    if (event->kind == EVENT_SWITCH || event->kind == EVENT_ACTION) {
        return true;
    }
    if (event->time - state->window_since > window) {
        state->window_since = event->time;
        state->window_count = 0;
    }
    state->window_count++;
    if (state->window_count <= EVENTS_MAX) {
        return true;
    }
    return fail(problem,
                "more than %d events (last: %s) within %.3g s at t = %.9g s: the contact "
                "chatters; raise rest_speed or damping.beta, lower the restitution, or give "
                "the body room between its walls",
                EVENTS_MAX, transition(event->kind)->guard.event,
                event->time - state->window_since, event->time);
}

PRBM bool apply_event(Simulation *sim, const Event *event, Problem *problem) {
    return count_event(sim, event, problem) &&
           transition(event->kind)->reset(sim, event, problem);
}
