/* Co-simulation: the simulation integrates itself from one communication point to the next. */
#include <math.h>
#include <string.h>

#include "hybrid/hybrid.h"

/* --- communication steps ---------------------------------------------------------------------- */

/* Continue from the present state with the inputs and parameters that have been set. */
static bool restart(Simulation *sim, const Wall *planned, Problem *problem) {
    State *state = &sim->state;
    if (!arc_state(sim, sim->present.y, problem)) {
        return false;
    }
    memcpy(state->walls, planned, (size_t)system_of(sim)->s * sizeof *planned);
    copy(state_size(sim), sim->present.y, state->front);
    state->front_time = state->time;
    state->arc.valid = state->has_k1 = false;
    if (values_changed(sim) && !take_values(sim, problem)) {
        return false;
    }
    copy(sim->configuration.mechanism->input_count, state->given, state->acting_given);
    set_inputs(sim);
    return receive_impulses(sim, problem) && settle_walls(sim, problem);
}

static bool event_due(const State *state, double time) {
    return state->arc.valid && state->pending.kind != EVENT_NONE && state->pending.time <= time;
}

static bool apply_pending(Simulation *sim, Problem *problem) {
    Event event = sim->state.pending;
    sim->state.arc.valid = false;
    sim->state.pending.kind = EVENT_NONE;
    return apply_event(sim, &event, problem);
}

/* Whether this continues an interrupted communication step to the same end, up to the round-off of
 * an importer that adds the rest of the step to the time. */
static bool continues(const Simulation *sim, double time) {
    const State *state = &sim->state;
    double rounding = TIME_SUM_RTOL * (fabs(time) + fabs(state->time));
    return state->interrupted && fabs(state->step_end - time) <= rounding &&
           !values_changed(sim) && !inputs_changed(sim);
}

/* Stop at a time, maybe before the end of the communication step; the walls continue until then. */
static void interrupt(State *state, double time, double end) {
    state->time = time;
    state->interrupted = time < end;
    state->step_end = end;
}

/* Reject a target time in the past or more than STEPS_MAX steps ahead. */
static bool check_time(const Simulation *sim, double time, Problem *problem) {
    double now = sim->state.time;
    if (!finite_number(time) || time < now) {
        return fail(problem, "cannot go from t = %.12g s to t = %.12g s: time only runs on", now,
                    time);
    }
    if (time - now > STEPS_MAX * longest_step(sim)) {
        return fail(problem,
                    "cannot go from t = %.12g s to t = %.12g s at once: that is more than %g "
                    "steps; times are in seconds",
                    now, time, STEPS_MAX);
    }
    return true;
}

/* Begin a communication step: plan the walls and take over changed inputs and parameters. */
static bool begin_step(Simulation *sim, double time, Problem *problem) {
    State *state = &sim->state;
    Wall planned[STOPS_MAX];
    bool walls = plan_walls(sim, time, planned), rest = within_step(sim, time);
    double begins = state->time, due = due_walls(sim);
    if ((walls || values_changed(sim) || inputs_changed(sim)) && !restart(sim, planned, problem)) {
        return false;
    }
    if (!rest) {
        state->due = due;
        state->planned = begins;
    }
    for (int i = 0; i < system_of(sim)->s; i++) {
        state->swift[i] = state->swift[i] || given_velocity(sim, i) != 0.0;
    }
    state->walls_continue = rest && time < state->step_end;
    return true;
}

/* Where to stop before the end of a communication step: after each internal step, before events. */
typedef struct {
    bool steps, events;
} Stops;

static bool advance(Simulation *sim, double time, Stops stops, bool *event, Problem *problem) {
    State *state = &sim->state;
    *event = false;
    if (!continues(sim, time) && !begin_step(sim, time, problem)) {
        return false;
    }
    state->interrupted = false;
    for (bool stepped = false;; stepped = true) {
        if (event_due(state, time)) {
            if (stops.events) {
                *event = true;
                interrupt(state, state->pending.time, time);
                return true;
            }
            if (!apply_pending(sim, problem)) {
                return false;
            }
        }
        if (state->front_time >= time) {
            break;
        }
        if (stops.steps && stepped) {
            interrupt(state, state->front_time, time);
            return true;
        }
        if (!take_step(sim, problem)) {
            return false;
        }
    }
    state->time = time;
    return true;
}

PRBM bool simulation_advance_some(Simulation *simulation, double time, bool each, bool *event,
                                  Problem *problem) {
    Simulation *sim = simulation;
    const Stops stops = {each, true};
    *event = false;
    if (!check_time(sim, time, problem)) {
        return false;
    }
    if (time == sim->state.time) {
        *event = event_due(&sim->state, time);
        return true;
    }
    keep_backup(sim);
    sim->present.fresh = NOTHING;
    return attempt(sim, advance(sim, time, stops, event, problem), problem);
}

PRBM bool simulation_advance(Simulation *simulation, double time, Problem *problem) {
    Simulation *sim = simulation;
    const Stops never = {false, false};
    bool event;
    if (!check_time(sim, time, problem)) {
        return false;
    }
    if (time == sim->state.time) {
        return true;
    }
    keep_backup(sim);
    sim->present.fresh = NOTHING;
    return attempt(sim, advance(sim, time, never, &event, problem), problem);
}

/* --- event mode ------------------------------------------------------------------------------- */

/* Apply the pending event, if any, with the inputs that have been set, and the impulses. */
static bool apply_here(Simulation *sim, bool event, bool inputs, bool impulses, Problem *problem) {
    State *state = &sim->state;
    int s = system_of(sim)->s;
    double acted[STOPS_MAX];
    for (int i = 0; i < s; i++) {
        acted[i] = *acting_velocity(sim, i);
    }
    if (inputs) {
        walls_at_event(sim, acted);
        copy(sim->configuration.mechanism->input_count, state->given, state->acting_given);
        set_inputs(sim);
    }
    bool right = !event || apply_pending(sim, problem);
    if (right && impulses) {
        Wall walls[STOPS_MAX];
        memcpy(walls, state->walls, (size_t)s * sizeof *walls);
        right = restart(sim, walls, problem);
    }
    if (inputs || impulses) {
        for (int i = 0; i < s; i++) {
            *acting_velocity(sim, i) = acted[i];
        }
        state->walls_continue = state->walls_continue || state->interrupted;
        state->interrupted = false;
    }
    return right;
}

PRBM bool simulation_happen(Simulation *simulation, Problem *problem) {
    Simulation *sim = simulation;
    bool event = event_due(&sim->state, sim->state.time), impulses = impulses_changed(sim);
    bool inputs = event && inputs_changed(sim);
    if (!event && !impulses) {
        return true;
    }
    keep_backup(sim);
    sim->present.fresh = NOTHING;
    return attempt(sim, apply_here(sim, event, inputs, impulses, problem), problem);
}
