/* Co-simulation: the simulation integrates itself from one communication point to the next. */
#include <math.h>
#include <string.h>

#include "hybrid/arc.h"
#include "hybrid/configuration.h"
#include "hybrid/contact_modes.h"
#include "hybrid/events.h"
#include "hybrid/impacts.h"
#include "hybrid/simulation.h"
#include "hybrid/snapshot.h"
#include "hybrid/stepping.h"
#include "hybrid/walls.h"

/* --- communication steps ---------------------------------------------------------------------- */

/* Continue from the present state with the walls, inputs and parameters that have been set.
 * follow: whether held stops may follow jumps of their walls' velocities. */
static bool restart(Simulation *sim, const Wall *walls, bool follow, Problem *problem) {
    State *state = &sim->state;
    if (!arc_state(sim, state->front, &sim->present.reference, &sim->at_front, problem)) {
        return false;
    }
    memmove(state->walls, walls, (size_t)system_of(sim)->s * sizeof *walls);
    state->front_time = state->time;
    state->arc.valid = state->has_k1 = false;
    if (values_changed(sim) && !take_values(sim, problem)) {
        return false;
    }
    copy(sim->configuration.mechanism->input_count, state->given, state->acting_given);
    set_inputs(sim);
    return receive_impulses(sim, problem) &&
           (!follow || follow_walls(sim, false, HUGE_VAL, problem)) && settle_moved(sim, problem);
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

/* Whether the inputs that move walls have not changed since they began to act. */
static bool same_walls(const Simulation *sim) {
    const InputGroups *from = &sim->configuration.mechanism->input;
    size_t bytes = (size_t)(from->impulses - from->walls) * sizeof(double);
    const double *given = sim->state.given + from->walls;
    return memcmp(given, sim->state.acting_given + from->walls, bytes) == 0;
}

/* Begin a communication step: join the walls to their references, and let changed inputs and
 * parameters act.  After an interruption the references do not change, unless an input of a wall or
 * a parameter has changed. */
static bool begin_step(Simulation *sim, double time, Problem *problem) {
    State *state = &sim->state;
    Wall joined[STOPS_MAX];
    bool goes_on = state->interrupted && same_walls(sim) && !values_changed(sim);
    bool walls = !goes_on && join_walls(sim, time, joined);
    if (walls || values_changed(sim) || inputs_changed(sim)) {
        return restart(sim, walls ? joined : state->walls, false, problem);
    }
    copy(sim->configuration.mechanism->input_count, state->given, state->acting_given);
    return true;
}

/* Where to stop before the end of a communication step: after each internal step, before events. */
typedef struct {
    bool steps, events;
} Stops;

/* Reject a target time that has not been reached after the given number of integration steps. */
static bool check_effort(const State *state, double time, int steps, Problem *problem) {
    if (steps < EFFORT_MAX) {
        return true;
    }
    return fail(problem,
                "t = %.12g s is not reached in %d integration steps, which end at t = %.9g s with "
                "steps of %.3g s: make shorter communication steps, or check units and "
                "stiffnesses",
                time, EFFORT_MAX, state->front_time, state->step_size);
}

static bool advance(Simulation *sim, double time, Stops stops, bool *event, Problem *problem) {
    State *state = &sim->state;
    *event = false;
    if (!begin_step(sim, time, problem)) {
        return false;
    }
    state->interrupted = false;
    int effort = 0;
    for (bool stepped = false;; stepped = true) {
        if (event_due(state, time)) {
            if (stops.events) {
                *event = true;
                state->time = state->pending.time;
                state->interrupted = state->time < time;
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
            state->time = state->front_time;
            state->interrupted = true;
            return true;
        }
        if (!check_effort(state, time, effort++, problem) || !take_step(sim, problem)) {
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

/* Let the given walls, the inputs and changed impulses act, and apply the pending event, if any. */
static bool apply_here(Simulation *sim, const Wall *walls, bool event, bool impulses,
                       Problem *problem) {
    State *state = &sim->state;
    state->interrupted = state->interrupted && same_walls(sim);
    if (!event) {
        return restart(sim, walls, !impulses, problem);
    }
    memcpy(state->walls, walls, (size_t)system_of(sim)->s * sizeof *walls);
    copy(sim->configuration.mechanism->input_count, state->given, state->acting_given);
    set_inputs(sim);
    return follow_walls(sim, false, HUGE_VAL, problem) && apply_pending(sim, problem) &&
           (!impulses || restart(sim, state->walls, false, problem));
}

PRBM bool simulation_happen(Simulation *simulation, Problem *problem) {
    Simulation *sim = simulation;
    Wall walls[STOPS_MAX];
    bool event = event_due(&sim->state, sim->state.time), impulses = impulses_changed(sim);
    bool turned = turn_walls(sim, walls);
    if (!event && !impulses && !turned) {
        return true;
    }
    keep_backup(sim);
    sim->present.fresh = NOTHING;
    return attempt(sim, apply_here(sim, walls, event, impulses, problem), problem);
}
