/* Model exchange: an importer integrates the independent angles and rates (dependents.c).
 *
 * A closed stop is a constraint on accelerations.  Its drift, caused by the errors of the
 * importer's solver, is corrected in event mode. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "core/gaps.h"
#include "hybrid/access.h"
#include "hybrid/compliant.h"
#include "hybrid/configuration.h"
#include "hybrid/contact_modes.h"
#include "hybrid/contact_names.h"
#include "hybrid/contact_peaks.h"
#include "hybrid/events.h"
#include "hybrid/guards.h"
#include "hybrid/impacts.h"
#include "hybrid/moved.h"
#include "hybrid/peaks.h"
#include "hybrid/present.h"
#include "hybrid/rest.h"
#include "hybrid/snapshot.h"
#include "hybrid/walls.h"
#include "dependents.h"
#include "indicators.h"
#include "model_exchange.h"

/* --- states ----------------------------------------------------------------------------------- */

PRBM int exchange_states(const Simulation *simulation) {
    const Mechanism *m = simulation->configuration.mechanism;
    return 2 * m->independent_count + 2 + EXCHANGED_STATES * m->compliant_count;
}

/* The slot of the k-th state of the compliant stops. */
static int contact_slot(const Mechanism *m, int k) {
    int stop = 0, extra = EXTRA_STATES * (k / EXCHANGED_STATES);
    while (!m->stops[stop].compliant || m->stops[stop].extra != extra) {
        stop++;
    }
    return k % EXCHANGED_STATES == 0
               ? m->slots.latched + PER_LATCHED * stop + LATCHED_IMPULSE_SUM
               : m->slots.compliant + PER_COMPLIANT * (k / EXCHANGED_STATES) +
                     COMPLIANT_CONTACT_LOSS;
}

PRBM int exchange_slot(const Simulation *simulation, int k) {
    const Mechanism *m = simulation->configuration.mechanism;
    int count = m->independent_count;
    if (k >= 2 * count + 2) {
        return contact_slot(m, k - 2 * count - 2);
    }
    if (k >= 2 * count) {
        return m->slots.energies + ENERGY_DISSIPATED + (k - 2 * count);
    }
    return coordinate_slot(m, m->independent[k % count], k >= count);
}

/* --- time, states, inputs --------------------------------------------------------------------- */

/* Bring the front and the equations up to date with time, states and inputs. */
PRBM bool exchange_refresh(Simulation *sim, Problem *problem) {
    const Mechanism *m = sim->configuration.mechanism;
    State *state = &sim->state;
    int n = system_of(sim)->n;
    if (sim->present.fresh & FRONT) {
        return true;
    }
    if ((!sim->configuration.assembled || values_changed(sim)) && !take_values(sim, problem)) {
        return false;
    }
    copy(m->input_count, state->given, state->acting_given);
    place_walls(sim);
    set_inputs(sim);
    copy(n, state->accepted, state->front); /* first guess of the loops */
    load_states(sim, state->states, state->front);
    if (!complete(sim, state->front, state->front + n, problem)) {
        return false;
    }
    sim->present.fresh = FRONT;
    return true;
}

static bool all_finite(int count, const double *x) {
    for (int i = 0; i < count; i++) {
        if (!finite_number(x[i])) {
            return false;
        }
    }
    return true;
}

static bool too_large(const Simulation *sim, Problem *problem) {
    const double *y = sim->state.front;
    int n = system_of(sim)->n;
    return fail(problem,
                "the accelerations at t = %.9g s are not finite numbers (largest angle or strain: "
                "%g, largest rate: %g 1/s): the states are far from every motion of the mechanism; "
                "shorten the steps of the solver",
                sim->state.time, largest(n, y), largest(n, y + n));
}

/* Evaluate the equations at the present time, states and inputs. */
PRBM bool exchange_moment(Simulation *sim, Moment *now, Problem *problem) {
    if (!exchange_refresh(sim, problem) || !moment_at(sim, sim->state.front, now, problem)) {
        return false;
    }
    return all_finite(state_size(sim), now->rates) || too_large(sim, problem);
}

/* Accept the shape of the front, from which later shapes are computed. */
static void accept(Simulation *sim) {
    copy(system_of(sim)->n, sim->state.front, sim->state.accepted);
}

PRBM void exchange_set_time(Simulation *simulation, double time) {
    if (time != simulation->state.time) {
        simulation->state.time = simulation->state.front_time = time;
        forget_present(simulation);
    }
}

PRBM void exchange_set(Simulation *simulation, const double *x) {
    copy(exchange_states(simulation), x, simulation->state.states);
    forget_present(simulation);
}

PRBM void exchange_get(const Simulation *simulation, double *x) {
    copy(exchange_states(simulation), simulation->state.states, x);
}

/* --- nominal values --------------------------------------------------------------------------- */

/* Store the typical angle and energy of a motion that starts with the present state. */
static void measure_motion(Simulation *sim) {
    const System *system = system_of(sim);
    const Mechanism *m = system->mechanism;
    const Scales *scales = &sim->configuration.scales;
    Scratch scratch = sim->scratch;
    int n = system->n;
    const double *q = sim->state.front, *v = q + n;
    double *amplitude = take(&scratch, (size_t)n), energy = 0.0, angle = NOMINAL_ANGLE_MIN;
    for (int j = 0; j < n; j++) {
        amplitude[j] = q[j] - system->q0[j] + v[j] / scales->rate;
        angle = m->coordinates[j].strain < 0 ? greater(angle, fabs(amplitude[j])) : angle;
    }
    for (int j = 0; j < n; j++) {
        energy += amplitude[j] * dot(n, system->stiffness + j * n, amplitude) / 2.0;
    }
    sim->state.angle = angle;
    sim->state.energy = greater(energy, scales->energy * (NOMINAL_ANGLE_MIN * NOMINAL_ANGLE_MIN));
}

/* The strain of a link, if a part of the energy is in the stiffest axial spring. */
static double typical_strain(const Simulation *sim) {
    const System *system = system_of(sim);
    double stiffest = 0.0;
    for (int j = 0; j < system->n; j++) {
        bool stretches = system->mechanism->coordinates[j].strain >= 0;
        stiffest = stretches ? greater(stiffest, system->stiffness[j * system->n + j]) : stiffest;
    }
    return square_root(2.0 * NOMINAL_STRAIN_FACTOR * sim->state.energy / stiffest);
}

/* The power of ten nearest to a value, as the nominal value in modelDescription.xml. */
static double nearest_power_of_ten(double value) {
    double power = 1.0; /* Powers of ten are exact up to 1e22. */
    value /= square_root(10.0);
    if (value <= 1.0) {
        while (value * power * 10.0 <= 1.0) {
            power *= 10.0;
        }
        return 1.0 / power;
    }
    while (power < value && power < DBL_MAX / 10.0) { /* The value may be infinite. */
        power *= 10.0;
    }
    return power;
}

/* Solvers derive their absolute tolerances from the nominal values. */
PRBM void exchange_nominals(const Simulation *simulation, double *x) {
    const Mechanism *m = simulation->configuration.mechanism;
    const State *state = &simulation->state;
    int count = m->independent_count;
    double rate = state->angle * simulation->configuration.scales.rate;
    for (int k = 0; k < count; k++) {
        int j = m->independent[k];
        bool turns = m->coordinates[j].strain < 0;
        double unit_of = coordinate_unit(system_of(simulation), j);
        x[k] = nearest_power_of_ten(turns ? state->angle * unit_of : typical_strain(simulation));
        x[count + k] = nearest_power_of_ten(rate * unit_of);
    }
    x[2 * count] = x[2 * count + 1] = nearest_power_of_ten(state->energy);
    double speed = state->angle * simulation->configuration.scales.rate *
                   simulation->configuration.scales.length;
    for (int k = 2 * count + 2; k < exchange_states(simulation); k += EXCHANGED_STATES) {
        x[k] = nearest_power_of_ten(state->energy / speed);
        x[k + 1] = x[2 * count];
    }
}

PRBM bool exchange_derivatives(Simulation *simulation, double *dx, Problem *problem) {
    Moment now;
    if (!exchange_moment(simulation, &now, problem)) {
        return false;
    }
    states_of(simulation, now.rates, dx);
    return true;
}

/* --- event indicators ------------------------------------------------------------------------- */

PRBM bool exchange_event_indicators(Simulation *simulation, double *z, Problem *problem) {
    Moment now;
    if (!exchange_moment(simulation, &now, problem)) {
        return false;
    }
    event_indicators(simulation, &now.at, z);
    return true;
}

/* --- drift ------------------------------------------------------------------------------------ */

/* The drift of a speed, relative to the scale of speed. */
static double speed_drift(const Simulation *sim, double speed) {
    return fabs(speed) / (DRIFT_SPEED_FACTOR * guard_scale(sim, EVENT_REVERSAL));
}

/* The drift of a closed stop off its wall, relative to the scales of length and speed.  While the
 * wall moves, its acceleration is unknown.  A larger distance is then allowed, and the release
 * indicator limits the speed instead. */
static double stop_drift(const Simulation *sim, const Instant *at, int i) {
    double depth = sim->state.touching[i].depth;
    double off = fabs(gap(&sim->equations, i, at->time, at->e, at->extra) + depth) /
                 system_of(sim)->length;
    return sim->state.walls[i].rate != 0.0
               ? off / MOVING_DRIFT_FACTOR
               : greater(off, speed_drift(sim, leaving_rate(sim, at, i)));
}

/* The largest drift of the closed stops and the sticking contacts.  The limit that requests an
 * event is above the errors of solvers at usual tolerances: an event restarts a solver, whose error
 * in its first steps is large. */
static double drift(const Simulation *sim, const Instant *at) {
    const Equations *eq = &sim->equations;
    double most = 0.0;
    for (int k = 0; k < eq->held_count; k++) {
        most = greater(most, stop_drift(sim, at, eq->held[k]));
    }
    for (int k = eq->first_stick; k < eq->r; k++) {
        most = greater(most, speed_drift(sim, row_rate(&eq->active, k, at->e, at->v)));
    }
    return most;
}

PRBM bool exchange_completed_step(Simulation *simulation, bool *event, Problem *problem) {
    Simulation *sim = simulation;
    Moment now;
    *event = false;
    if (!exchange_moment(sim, &now, problem)) {
        return false;
    }
    accept(sim);
    step_peaks(sim, now.evaluation);
    pass_peaks(sim);
    sim->present.fresh &= ~STRESSES;
    *event = drift(sim, &now.at) > DRIFT_RTOL;
    if (sim->equations.pressed_count == 0) {
        return true;
    }
    sim->present.fresh &= ~PLACES; /* The maxima are outputs. */
    return latch_present(sim, now.evaluation, true, problem) &&
           (*event || freezes_here(sim, event, problem));
}

/* --- events ----------------------------------------------------------------------------------- */

/* Whether the sliding speed of a contact is zero within a solver's error. */
static bool sliding_ends(const Simulation *sim, const Instant *at, int contact) {
    double speed = sliding_velocity(system_of(sim), contact, at->e, at->v);
    return fabs(speed) <= SLIDING_ERROR_RTOL * guard_scale(sim, EVENT_REVERSAL);
}

/* Make a contact stick, so that a solver's error does not count as sliding backwards.  If other
 * constraints keep it from sliding, as at a dead centre, nothing changes. */
static void stop_sliding(Simulation *sim, int contact) {
    Problem ignored;
    Scratch scratch = sim->scratch;
    ContactMode slipping = sim->state.modes[contact];
    double *kept = take(&scratch, (size_t)state_size(sim));
    copy(state_size(sim), sim->state.front, kept);
    set_mode(sim, contact, CONTACT_STICK);
    if (!project(&sim->equations, sim->state.time, sim->state.front, scratch, &ignored)) {
        copy(state_size(sim), kept, sim->state.front);
        set_mode(sim, contact, slipping);
    }
}

/* Whether the gap of an open stop closes at this state. */
static bool closes_here(const Simulation *sim, const Instant *at, int stop) {
    double distance = gap(&sim->equations, stop, at->time, at->e, at->extra);
    double speed = gap_rate(&sim->equations, stop, at->time, at->e, at->v, at->extra);
    bool touches = distance <= TOUCHING_RTOL * system_of(sim)->length;
    return (touches && speed < -zero_speed(&sim->configuration)) ||
           (lifted_guard(sim, at, EVENT_IMPACT, stop) <= 0.0 && speed < 0.0);
}

/* Whether the contact of a compliant stop ends at this state. */
static bool opens_here(const Simulation *sim, const Instant *at, int stop) {
    return lifted_guard(sim, at, EVENT_SEPARATION, stop) <= 0.0 &&
           gap_rate(&sim->equations, stop, at->time, at->e, at->v, at->extra) > 0.0;
}

/* Whether a spring begins or ceases to act at this state. */
static bool acts_here(const Simulation *sim, const Instant *at, int contact) {
    CoilIndicators coil = coil_indicators(sim, at, contact);
    return (coil.strain <= 0.0 && coil.rate < 0.0) || coil.force <= 0.0;
}

/* Whether an event is due at this state.  A stop that has been struck is not struck again. */
static bool due(const Simulation *sim, const Instant *at, const bool *struck, EventKind kind,
                int contact) {
    if (!transition(kind)->watched(&sim->equations, contact)) {
        return false;
    }
    switch (kind) {
    case EVENT_IMPACT: return !struck[contact] && closes_here(sim, at, contact);
    case EVENT_SEPARATION: return opens_here(sim, at, contact);
    case EVENT_ACTION: return acts_here(sim, at, contact);
    default: return lifted_guard(sim, at, kind, contact) <= 0.0;
    }
}

/* Return the first event that is due at a state, in the order of TRANSITIONS. */
static Event due_here(const Simulation *sim, const Instant *at, const bool *struck) {
    Event event = {EVENT_NONE, 0, at->time};
    for (EventKind kind = EVENT_NONE + 1; kind < EVENT_KINDS; kind++) {
        ContactRange range = contacts_of(sim, kind);
        for (int contact = range.first; contact < range.end; contact++) {
            if (due(sim, at, struck, kind, contact)) {
                event.kind = kind;
                event.contact = contact;
                return event;
            }
        }
    }
    return event;
}

/* Store the time of the event mode, and the depths at which the gaps close from then on. */
static void arm(Simulation *sim, const Instant *at) {
    State *state = &sim->state;
    for (int i = 0; i < system_of(sim)->s; i++) {
        state->floors[i] = GAP_CLOSED_RTOL * system_of(sim)->length;
        if (state->modes[i] == CONTACT_OPEN) {
            state->floors[i] += greater(0.0, -gap(&sim->equations, i, at->time, at->e, at->extra));
        }
    }
    state->point = state->time;
}

/* Apply the impulses and the changes of the walls. */
static bool apply_inputs(Simulation *sim, Problem *problem) {
    Moment now;
    if (!exchange_moment(sim, &now, problem)) {
        return false;
    }
    bool ok = true;
    if (impulses_changed(sim)) {
        ok = receive_impulses(sim, problem) && choose_moved_modes(sim, problem);
    } else if (sim->equations.walls_move || drift(sim, &now.at) > DRIFT_CORRECTED_RTOL) {
        ok = follow_walls(sim, now.evaluation->lam, sim->state.time - sim->state.point, problem);
    }
    forget_outputs(sim);
    return ok;
}

static bool too_many_events(const Simulation *sim, const Event *event, Problem *problem) {
    return fail(problem,
                "more than %d events (last: %s of %s) at t = %.9g s: the contact chatters; "
                "raise rest_speed or damping.beta, lower the restitution, or give the body room "
                "between its walls",
                EVENTS_AT_ONCE_MAX * contacts_of(sim, EVENT_ACTION).end, transition(event->kind)->guard.event,
                contact_name(sim->configuration.mechanism, event->contact), sim->state.time);
}

/* Apply all events that are due; now becomes the moment after them. */
static bool apply_due_events(Simulation *sim, Moment *now, Problem *problem) {
    bool struck[STOPS_MAX] = {false};
    for (int i = 0;; i++) {
        if (!exchange_moment(sim, now, problem)) {
            return false;
        }
        Event event = due_here(sim, &now->at, struck);
        if (event.kind == EVENT_NONE) {
            return true;
        }
        if (i == EVENTS_AT_ONCE_MAX * contacts_of(sim, EVENT_ACTION).end) {
            return too_many_events(sim, &event, problem);
        }
        if (event.kind == EVENT_IMPACT) {
            struck[event.contact] = true;
        } else if (event.kind == EVENT_REVERSAL && sliding_ends(sim, &now->at, event.contact)) {
            stop_sliding(sim, event.contact);
        }
        bool ok = apply_event(sim, &event, problem);
        forget_outputs(sim);
        if (!ok) {
            return false;
        }
    }
}

/* Count the stress and the contact forces before an event. */
static bool sample_before(Simulation *sim, Problem *problem) {
    Moment now;
    if (!has_peaks(sim) && sim->equations.pressed_count == 0) {
        return true;
    }
    if (!exchange_moment(sim, &now, problem)) {
        return false;
    }
    step_peaks(sim, now.evaluation);
    return latch_present(sim, now.evaluation, true, problem);
}

/* Settle the contacts that have been calm for a contact time. */
static bool freeze_contacts(Simulation *sim, Problem *problem) {
    if (sim->equations.pressed_count == 0) {
        return true;
    }
    double balances[STOPS_MAX];
    bool ok = freeze_calm(sim, balances, problem);
    forget_outputs(sim);
    return ok;
}

PRBM bool exchange_event(Simulation *simulation, bool *changed, Problem *problem) {
    Simulation *sim = simulation;
    State *state = &sim->state;
    int nx = exchange_states(sim);
    *changed = false;
    copy(nx, state->states, sim->previous);
    keep_backup(sim);
    Moment now;
    bool ok = sample_before(sim, problem) && apply_inputs(sim, problem) &&
              freeze_contacts(sim, problem) && apply_due_events(sim, &now, problem) &&
              (sim->equations.pressed_count == 0 ||
               latch_present(sim, now.evaluation, false, problem));
    if (ok) {
        restart_peaks_from(sim, now.evaluation);
        watch_turns(sim, &now.at);
        arm(sim, &now.at);
        accept(sim);
        states_of(sim, state->front, state->states);
        *changed = memcmp(sim->previous, state->states, (size_t)nx * sizeof(double)) != 0;
    }
    return attempt(sim, ok, problem);
}

PRBM bool exchange_pending(Simulation *simulation, bool *pending, Problem *problem) {
    Simulation *sim = simulation;
    const bool struck[STOPS_MAX] = {false};
    Moment now;
    if (!exchange_moment(sim, &now, problem)) {
        return false;
    }
    Scratch scratch = sim->scratch;
    double *z = take(&scratch, (size_t)exchange_indicators(sim));
    event_indicators(sim, &now.at, z);
    *pending = impulses_changed(sim) || drift(sim, &now.at) > DRIFT_RTOL ||
               due_here(sim, &now.at, struck).kind != EVENT_NONE;
    for (int i = 0; i < exchange_indicators(sim); i++) {
        *pending = *pending || z[i] <= 0.0;
    }
    return true;
}

/* Return the stop with the deepest penetration if it exceeds a solver's errors, else NULL. */
PRBM const char *exchange_deepest(Simulation *simulation, double *depth) {
    Simulation *sim = simulation;
    const char *found = NULL;
    Problem ignored;
    Moment now;
    *depth = PENETRATION_WARNING_RTOL * system_of(sim)->length;
    if (!exchange_moment(sim, &now, &ignored)) {
        return NULL;
    }
    for (int i = 0; i < system_of(sim)->s; i++) {
        double inside = -gap(&sim->equations, i, now.at.time, now.at.e, now.at.extra);
        if (inside > *depth && sim->state.touching[i].phase == PHASE_NONE) {
            *depth = inside;
            found = sim->configuration.mechanism->stops[i].name;
        }
    }
    return found;
}

PRBM void exchange_begin(Simulation *sim) {
    Problem ignored;
    Moment now;
    accept(sim);
    measure_motion(sim);
    states_of(sim, sim->state.front, sim->state.states);
    forget_present(sim);
    if (exchange_moment(sim, &now, &ignored)) {
        watch_turns(sim, &now.at);
        arm(sim, &now.at);
    }
    forget_present(sim);
}
