/* Co-simulation: the simulation integrates itself from one communication point to the next. */
#include <limits.h>
#include <math.h>
#include <string.h>

#include "hybrid/access.h"
#include "hybrid/arc.h"
#include "hybrid/compliant.h"
#include "hybrid/configuration.h"
#include "hybrid/contact_modes.h"
#include "hybrid/contact_peaks.h"
#include "hybrid/effort.h"
#include "hybrid/errors.h"
#include "hybrid/events.h"
#include "hybrid/impacts.h"
#include "hybrid/moved.h"
#include "hybrid/peaks.h"
#include "hybrid/snapshot.h"
#include "hybrid/stepping.h"
#include "hybrid/walls.h"

/* --- communication steps ---------------------------------------------------------------------- */

/* Make the present state the front, from which the integration continues.  It is the end of a step,
 * or the state that outputs show, so that impulses conserve the momentum of a coupling exactly. */
static bool leave_arc(Simulation *sim, bool shown, Problem *problem) {
    State *state = &sim->state;
    bool within = state->arc.valid && state->time < state->front_time;
    if (within) {
        drop_peaks(sim);
    }
    bool ok = latch_peaks(sim, state->time, problem);
    if (!ok) {
        return false;
    }
    if (within && !shown) {
        ok = end_step(sim, state->time, problem);
    } else {
        ok = arc_state(sim, state->front, sim->present.e, &sim->present.reference, &sim->at_front,
                       sim->scratch, problem);
        state->front_time = state->time;
    }
    state->arc.valid = state->has_k1 = false;
    return ok;
}

/* Let the inputs act that have been set. */
static void take_inputs(Simulation *sim) {
    copy(sim->configuration.mechanism->input_count, sim->state.given, sim->state.acting_given);
    set_inputs(sim);
}

/* Continue from the front with the inputs that have been set. */
static bool restart(Simulation *sim, Problem *problem) {
    take_inputs(sim);
    return receive_impulses(sim, problem) && choose_moved_modes(sim, problem) &&
           restart_peaks(sim, problem);
}

static bool event_due(const State *state, double time) {
    return state->arc.valid && state->pending.kind != EVENT_NONE && state->pending.time <= time;
}

/* Leave the step that ends at the pending event, and store the event. */
static bool leave_for_event(Simulation *sim, Event *event, Problem *problem) {
    *event = sim->state.pending;
    if (!latch_peaks(sim, event->time, problem)) {
        return false;
    }
    sim->state.arc.valid = false;
    sim->state.pending.kind = EVENT_NONE;
    return true;
}

static bool apply_here(Simulation *sim, const Event *event, Problem *problem) {
    return apply_event(sim, event, problem) && restart_peaks(sim, problem);
}

static bool apply_pending(Simulation *sim, Problem *problem) {
    Event event;
    return leave_for_event(sim, &event, problem) && apply_here(sim, &event, problem);
}

/* Reject a target time in the past or more than STEPS_MAX steps ahead. */
static bool check_time(const Simulation *sim, double time, Problem *problem) {
    double now = sim->state.time;
    if (!finite_number(time) || time < now) {
        return fail(problem,
                    "cannot simulate from t = %.12g s to t = %.12g s: the target time must be "
                    "finite and not before the present time",
                    now, time);
    }
    if (time - now > STEPS_MAX * longest_step(sim)) {
        return fail(problem,
                    "cannot simulate from t = %.12g s to t = %.12g s at once: this takes more than "
                    "%g internal steps; check that both times are in seconds",
                    now, time, STEPS_MAX);
    }
    return true;
}

/* Whether the motion goes on: nothing has been set, and all walls rest on their references. */
static bool goes_on(const Simulation *sim) {
    return sim->untouched && !sim->equations.walls_move && !sim->equations.walls_recoil;
}

/* Compute the walls with the displacements by forces of compliant stops in their motion. */
static bool fold_present(Simulation *sim, Wall *walls, Problem *problem) {
    Scratch scratch = sim->scratch;
    bool ok = true;
    memcpy(walls, sim->state.walls, (size_t)system_of(sim)->s * sizeof(Wall));
    if (sim->equations.walls_recoil) {
        double *y = take(&scratch, (size_t)state_size(sim));
        ok = arc_state(sim, y, sim->present.e, &sim->present.reference, &sim->at_front, scratch,
                       problem);
        for (int i = 0; ok && i < system_of(sim)->s; i++) {
            if (sim->configuration.mechanism->stops[i].compliant) {
                fold_recoil(&walls[i], sim->state.time, extra_of(sim, y, i));
            }
        }
    }
    return ok;
}

/* Begin a communication step: join the walls to their references, and apply changed inputs and
 * parameters.  A step that was interrupted at an event keeps its references, unless an input of a
 * wall or a parameter has changed. */
static bool begin_step(Simulation *sim, double time, Problem *problem) {
    State *state = &sim->state;
    size_t bytes = (size_t)system_of(sim)->s * sizeof(Wall);
    Wall present[STOPS_MAX], joined[STOPS_MAX];
    if (goes_on(sim)) {
        if (!state->interrupted) {
            (void)pass_point(sim, time);
        }
        return true;
    }
    bool set = values_changed(sim);
    if (!fold_present(sim, present, problem)) {
        return false;
    }
    sim->untouched = true;
    if (set || !state->interrupted || walls_changed(sim)) {
        join_walls(sim, time, set, present, joined);
    } else {
        memcpy(joined, present, bytes);
    }
    if (!set && !inputs_changed(sim) && memcmp(joined, state->walls, bytes) == 0) {
        copy(sim->configuration.mechanism->input_count, state->given, state->acting_given);
        return true;
    }
    if (!leave_arc(sim, impulses_changed(sim), problem) ||
        (set && !keep_gaps(sim, joined, problem))) {
        return false;
    }
    fold_recoils(sim); /* They are part of the walls joined. */
    memcpy(state->walls, joined, bytes);
    return restart(sim, problem);
}

/* When to return before the end of a communication step. */
typedef struct {
    bool events; /* at an event */
    int steps;   /* after so many integration steps */
} Stops;

typedef enum { REACHED, AT_EVENT, AFTER_STEPS } Ending;

/* Show the moment before or after an event to the observer, if there is one. */
static bool show(Simulation *sim, double time, bool after, Problem *problem) {
    double now = sim->state.time;
    if (!sim->observe) {
        return true;
    }
    sim->state.time = time;
    bool ok = sim->observe(sim->observer, time, after, problem);
    sim->state.time = now;
    sim->present.fresh = NOTHING;
    return ok;
}

/* Apply the pending event and show it, unless the phase of a contact changes, without a jump. */
static bool apply_shown(Simulation *sim, Problem *problem) {
    double time = sim->state.pending.time;
    if (sim->state.pending.kind == EVENT_SWITCH) {
        return apply_pending(sim, problem);
    }
    return show(sim, time, false, problem) && apply_pending(sim, problem) &&
           show(sim, time, true, problem);
}

/* Continue a communication step that has begun. */
static bool proceed(Simulation *sim, double time, Stops stops, Effort *effort, Ending *ending,
                    Problem *problem) {
    State *state = &sim->state;
    for (int steps = 0;; steps++) {
        if (event_due(state, time)) {
            *ending = AT_EVENT;
            if (stops.events && state->pending.kind != EVENT_SWITCH) {
                return true;
            }
            if (!apply_shown(sim, problem)) {
                return false;
            }
        }
        *ending = state->front_time >= time ? REACHED : AFTER_STEPS;
        if (*ending == REACHED || steps >= stops.steps) {
            return true;
        }
        if (!count_step(sim, time, effort, problem) || !take_step(sim, problem)) {
            return false;
        }
    }
}

/* Set the time at which a call ends that has not reached the end of the communication step. */
static void interrupt(State *state, double now, double time) {
    state->time = now;
    state->interrupted = now < time;
}

static bool advance_some(Simulation *sim, double time, Stops stops, Effort *effort, bool *event,
                         Problem *problem) {
    State *state = &sim->state;
    Ending ending;
    if (!begin_step(sim, time, problem)) {
        return false;
    }
    state->interrupted = false;
    if (!proceed(sim, time, stops, effort, &ending, problem)) {
        return false;
    }
    *event = ending == AT_EVENT;
    switch (ending) {
    case AT_EVENT: interrupt(state, state->pending.time, time); break;
    case AFTER_STEPS: interrupt(state, state->front_time, time); break;
    default: state->time = time;
    }
    return true;
}

/* Prepare a communication step to a time: keep a backup, unless nothing can fail because the time
 * is within the latest integration step, no event is due and nothing has been set. */
static void prepare_step(Simulation *sim, double time) {
    bool known = time <= sim->state.front_time && goes_on(sim) && !event_due(&sim->state, time);
    sim->present.fresh = NOTHING;
    if (!known) {
        keep_backup(sim);
    }
}

PRBM bool simulation_advance_some(Simulation *simulation, double time, bool each, Effort *effort,
                                  bool *event, Problem *problem) {
    Simulation *sim = simulation;
    const Stops stops = {true, each ? 1 : INT_MAX};
    *event = false;
    if (!check_time(sim, time, problem)) {
        return false;
    }
    if (time == sim->state.time) {
        *event = event_due(&sim->state, time);
        return true;
    }
    prepare_step(sim, time);
    return attempt(sim, advance_some(sim, time, stops, effort, event, problem), problem);
}

/* Begin a communication step at its first part, and continue it by a number of steps. */
static bool advance_part(Simulation *sim, double time, int steps, Effort *effort, bool *reached,
                         Problem *problem) {
    State *state = &sim->state;
    Ending ending;
    if (effort->steps == 0) {
        if (!begin_step(sim, time, problem)) {
            return false;
        }
        state->interrupted = false;
    }
    if (!proceed(sim, time, (Stops){false, steps}, effort, &ending, problem)) {
        return false;
    }
    *reached = ending == REACHED;
    if (*reached) {
        state->time = time;
    }
    return true;
}

PRBM bool simulation_advance_part(Simulation *simulation, double time, int steps, Effort *effort,
                                  bool *reached, Problem *problem) {
    Simulation *sim = simulation;
    *reached = false;
    if (effort->steps == 0) {
        if (!check_time(sim, time, problem)) {
            return false;
        }
        if (time == sim->state.time) {
            *reached = true;
            return true;
        }
        prepare_step(sim, time);
    }
    return attempt(sim, advance_part(sim, time, steps, effort, reached, problem), problem);
}

PRBM void simulation_abandon(Simulation *simulation) {
    Problem ignored;
    (void)attempt(simulation, false, &ignored);
}

PRBM bool simulation_advance(Simulation *simulation, double time, Problem *problem) {
    Effort effort = {0, 0, 0.0};
    bool reached;
    return simulation_advance_part(simulation, time, INT_MAX, &effort, &reached, problem);
}

/* --- event mode ------------------------------------------------------------------------------- */

/* Let changed velocities of walls and impulses act, and apply the pending event, if any.  Held
 * stops follow their walls unless impulses act on the body, too. */
static bool apply_changes(Simulation *sim, bool at_event, bool impulses, Problem *problem) {
    bool moved = walls_changed(sim);
    Event event;
    if (!(at_event ? leave_for_event(sim, &event, problem) : leave_arc(sim, true, problem))) {
        return false;
    }
    fold_recoils(sim);
    sim->state.interrupted = sim->state.interrupted && !moved;
    turn_walls(sim);
    take_inputs(sim);
    if (moved && (at_event || !impulses) && !follow_walls(sim, NULL, 0.0, problem)) {
        return false;
    }
    return (!at_event || apply_here(sim, &event, problem)) &&
           ((at_event && !impulses) || restart(sim, problem));
}

PRBM bool simulation_handle_event(Simulation *simulation, Problem *problem) {
    Simulation *sim = simulation;
    bool event = event_due(&sim->state, sim->state.time), impulses = impulses_changed(sim);
    if (!event && !impulses && !walls_changed(sim)) {
        return true;
    }
    keep_backup(sim);
    sim->present.fresh = NOTHING;
    return attempt(sim, apply_changes(sim, event, impulses, problem), problem);
}
