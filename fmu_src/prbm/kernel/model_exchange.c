/* Model exchange: an importer integrates the independent angles and rates.
 *
 * The loops tie the n coordinates together; r of them are solved from the other n - r, so that a
 * solver without constraints stays on them (mechanics/independent.py chooses them). A stop that
 * is closed is a constraint of the accelerations; its drift by a solver's errors is corrected in
 * events. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "hybrid/hybrid.h"

/* --- independent and dependent coordinates ---------------------------------------------------- */

PRBM int exchange_states(const Simulation *simulation) {
    return 2 * simulation->configuration.mechanism->independent_count + 2;
}

PRBM int exchange_indicators(const Simulation *simulation) {
    const Mechanism *m = simulation->configuration.mechanism;
    return STOP_INDICATORS * m->stop_count + m->friction_count;
}

/* The coordinates that the loops determine, in rising order. */
static void dependents(const Mechanism *m, int *result) {
    int k = 0, count = 0;
    for (int j = 0; j < m->coordinate_count; j++) {
        if (k < m->independent_count && m->independent[k] == j) {
            k++;
        } else {
            result[count++] = j;
        }
    }
}

/* The slot of a coordinate: of its angle or strain, of its rate behind it. */
static int slot_of(const Mechanism *m, int j, bool rate) {
    const Coordinate *coordinate = &m->coordinates[j];
    if (coordinate->arm != j) {
        int k = 0;
        while (m->stretches[k] != j) {
            k++;
        }
        return m->slots.stretches + PER_STRETCH * k + (rate ? STRETCH_STRAIN_RATE : STRETCH_STRAIN);
    }
    if (coordinate->link >= 0) {
        return m->slots.links + PER_LINK * coordinate->link + (rate ? LINK_OMEGA : LINK_ANGLE);
    }
    return m->slots.bodies + PER_BODY * (coordinate->body - 1) + (rate ? BODY_OMEGA : BODY_ANGLE);
}

PRBM int exchange_slot(const Simulation *simulation, int k) {
    const Mechanism *m = simulation->configuration.mechanism;
    int count = m->independent_count;
    if (k >= 2 * count) {
        return m->slots.energies + ENERGY_DISSIPATED + (k - 2 * count);
    }
    return slot_of(m, m->independent[k % count], k >= count);
}

static const char *coordinate_name(const Mechanism *m, int j, char *text, size_t size) {
    const Coordinate *coordinate = &m->coordinates[j];
    if (coordinate->link >= 0) {
        const char *quantity = coordinate->arm == j ? "angle" : "strain";
        (void)snprintf(text, size, "link[%d].%s", coordinate->link + 1, quantity);
    } else {
        (void)snprintf(text, size, "%s.angle", m->bodies[coordinate->body - 1].name);
    }
    return text;
}

static bool singular_choice(const Simulation *sim, const int *dependent, Problem *problem) {
    char name[80] = "";
    return fail(problem,
                "the states of model exchange do not determine the other angles (%s and %d more) "
                "at t = %.9g s: the shape is too far from the one at the start, or the solver has "
                "left it; shorten its steps, or use co-simulation, which has no such limit",
                coordinate_name(sim->configuration.mechanism, dependent[0], name, sizeof name),
                system_of(sim)->r - 1, sim->state.time);
}

/* The loops' Jacobian in the dependent coordinates, factored. */
static bool factor_dependents(const Simulation *sim, const double *rows, const int *dependent,
                              double *a, int *pivot) {
    int r = system_of(sim)->r, n = system_of(sim)->n;
    double least = HUGE_VAL, most = largest(r * n, rows);
    for (int i = 0; i < r; i++) {
        for (int k = 0; k < r; k++) {
            a[i * r + k] = rows[i * n + dependent[k]];
        }
    }
    if (!lu_factor(r, a, pivot)) {
        return false;
    }
    for (int i = 0; i < r; i++) {
        least = lesser(least, 1.0 / fabs(a[i * r + i])); /* its diagonal is inverted */
    }
    return least > DEPENDENT_PIVOT_RTOL * most;
}

/* The loops in the dependent coordinates, in working memory. */
typedef struct {
    int *dependent, *pivot; /* (r,) */
    double *rows, *a, *s;   /* (r, n), (r, r) factored, (r,) residuals */
} Loops;

static Loops take_loops(Simulation *sim) {
    Scratch *scratch = &sim->scratch;
    int r = system_of(sim)->r, n = system_of(sim)->n;
    Loops loops = {take_integers(scratch, r), take_integers(scratch, r),
                   take_matrix(scratch, r, n), take_matrix(scratch, r, r),
                   take(scratch, (size_t)r)};
    dependents(sim->configuration.mechanism, loops.dependent);
    return loops;
}

/* Solve the loops for the dependent angles, from those in q. */
static bool complete_angles(Simulation *sim, Loops *x, double *q) {
    size_t mark = sim->scratch.used;
    const System *system = system_of(sim);
    int r = system->r;
    double best = HUGE_VAL, length = system->length;
    bool closed = false, regular = true;
    Rows loops = plain_rows(system, r, system->loops, system->loops_c);
    Complex *e = take_complex(&sim->scratch, system->n, 1);
    for (int step = 0; step < CONSTRAINT_ITERATIONS_MAX && regular && !closed; step++) {
        directions(system, q, e);
        scalars(&loops, e, x->s);
        double error = largest(r, x->s);
        closed = error <= CONSTRAINT_RTOL * length ||
                 (CONSTRAINT_STALLED_RTOL * length >= best && best <= error);
        best = lesser(best, error);
        jacobian(&loops, e, x->rows);
        regular = factor_dependents(sim, x->rows, x->dependent, x->a, x->pivot);
        if (regular && !closed) {
            lu_solve(r, x->a, x->pivot, x->s);
            for (int k = 0; k < r; k++) {
                q[x->dependent[k]] -= x->s[k];
            }
        }
    }
    sim->scratch.used = mark;
    return closed && regular;
}

/* Solve the loops for the dependent rates. */
static void complete_rates(const Simulation *sim, Loops *x, double *v) {
    int n = system_of(sim)->n, r = system_of(sim)->r;
    for (int k = 0; k < r; k++) {
        v[x->dependent[k]] = 0.0;
    }
    for (int i = 0; i < r; i++) {
        x->s[i] = -dot(n, x->rows + i * n, v);
    }
    lu_solve(r, x->a, x->pivot, x->s);
    for (int k = 0; k < r; k++) {
        v[x->dependent[k]] = x->s[k];
    }
}

/* Solve the loops for the dependent angles and rates, from the angles of the last step. */
static bool complete(Simulation *sim, double *q, double *v, Problem *problem) {
    size_t mark = sim->scratch.used;
    Loops loops = take_loops(sim);
    bool right = complete_angles(sim, &loops, q);
    if (right) {
        complete_rates(sim, &loops, v);
    }
    sim->scratch.used = mark;
    return right || (system_of(sim)->r > 0
                         ? singular_choice(sim, loops.dependent, problem)
                         : fail(problem, "the states are not finite numbers"));
}

/* The independent part of y = (q, v, dissipated energy, work). */
static void states_of(const Simulation *sim, const double *y, double *x) {
    const Mechanism *m = sim->configuration.mechanism;
    int n = m->coordinate_count, count = m->independent_count;
    for (int k = 0; k < count; k++) {
        x[k] = y[m->independent[k]];
        x[count + k] = y[n + m->independent[k]];
    }
    x[2 * count] = y[2 * n];
    x[2 * count + 1] = y[2 * n + 1];
}

/* --- time, states, inputs --------------------------------------------------------------------- */

/* Bring the front and the equations up to date with time, states and inputs. */
PRBM bool exchange_refresh(Simulation *sim, Problem *problem) {
    const Mechanism *m = sim->configuration.mechanism;
    State *state = &sim->state;
    int n = system_of(sim)->n, count = m->independent_count;
    if (!sim->rates.stale) {
        return true;
    }
    if ((!sim->configuration.assembled || values_changed(sim)) && !take_values(sim, problem)) {
        return false;
    }
    copy(m->input_count, state->given, state->acting_given);
    start_walls(sim);
    state->front_time = state->time;
    set_inputs(sim);
    copy(n, state->arc.y, state->front); /* angles of the last step: the shape is near them */
    for (int k = 0; k < count; k++) {
        state->front[m->independent[k]] = state->states[k];
        state->front[n + m->independent[k]] = state->states[count + k];
    }
    state->front[2 * n] = state->states[2 * count];
    state->front[2 * n + 1] = state->states[2 * count + 1];
    if (!complete(sim, state->front, state->front + n, problem)) {
        return false;
    }
    sim->rates.stale = sim->rates.evaluated = false;
    sim->present.fresh = NOTHING;
    return true;
}

/* Bring the rates of the front up to date. */
PRBM bool exchange_rates(Simulation *sim, Problem *problem) {
    PresentRates *rates = &sim->rates;
    if (!exchange_refresh(sim, problem)) {
        return false;
    }
    rates->y = sim->state.front;
    if (!rates->evaluated) {
        rates->evaluated = rate(&sim->equations, sim->state.time, rates->y, NULL, &rates->evaluation, rates->rates,
                                problem);
    }
    return rates->evaluated;
}

PRBM void exchange_set_time(Simulation *simulation, double time) {
    if (time != simulation->state.time) {
        simulation->state.time = time;
        simulation->rates.stale = true;
        simulation->present.fresh = NOTHING;
    }
}

PRBM void exchange_set(Simulation *simulation, const double *x) {
    copy(exchange_states(simulation), x, simulation->state.states);
    simulation->rates.stale = true;
    simulation->present.fresh = NOTHING;
}

PRBM void exchange_get(const Simulation *simulation, double *x) {
    copy(exchange_states(simulation), simulation->state.states, x);
}

/* The next power of ten that is not below: modelDescription.xml has it as nominal value.  A
 * solver's absolute tolerance follows from it; below the scale of the motion it would resolve
 * round-off. */
static double next_power_of_ten(double value) {
    double power = 1.0; /* exact to 1e22 */
    if (value <= 1.0) {
        while (value * power * 10.0 <= 1.0) {
            power *= 10.0;
        }
        return 1.0 / power;
    }
    while (power < value) {
        power *= 10.0;
    }
    return power;
}

PRBM void exchange_nominals(const Simulation *simulation, double *x) {
    const Scales *scales = &simulation->configuration.scales;
    int count = simulation->configuration.mechanism->independent_count;
    double rate = next_power_of_ten(scales->rate);
    for (int k = 0; k < count; k++) {
        x[k] = 1.0;
        x[count + k] = rate;
    }
    x[2 * count] = x[2 * count + 1] = next_power_of_ten(scales->energy);
}

PRBM bool exchange_derivatives(Simulation *simulation, double *dx, Problem *problem) {
    if (!exchange_rates(simulation, problem)) {
        return false;
    }
    states_of(simulation, simulation->rates.rates, dx);
    return true;
}

/* --- event indicators ------------------------------------------------------------------------- */

static double force_scale(const Simulation *sim) {
    return sim->configuration.scales.energy / sim->configuration.scales.length;
}

static double speed_scale(const Simulation *sim) {
    return sim->configuration.scales.rate * sim->configuration.scales.length;
}

/* The unit of the guard of a kind of event. */
static double guard_scale(const Simulation *sim, EventKind kind) {
    switch (kind) {
    case EVENT_IMPACT: return sim->configuration.scales.length;
    case EVENT_REVERSAL: return speed_scale(sim);
    default: return force_scale(sim);
    }
}

/* The indicator that a kind of event has at a contact: three for each stop, then one for each
 * friction point. */
static int indicator_place(const Simulation *sim, EventKind kind, int contact) {
    int s = system_of(sim)->s, offset = kind == EVENT_IMPACT ? 0 : kind == EVENT_RELEASE ? 1 : 2;
    return contact < s ? STOP_INDICATORS * contact + offset
                       : STOP_INDICATORS * s + contact - s;
}

static Instant present_instant(const Simulation *sim) {
    return instant_of(sim, sim->state.time, sim->rates.y, &sim->rates.evaluation);
}

/* A guard, lifted by the value below which its event is due: gaps close a little late, and speeds
 * within round-off have fallen to zero. */
static double lifted_guard(const Simulation *sim, EventKind kind, int contact) {
    Instant at = present_instant(sim);
    double z = transition(kind)->guard.value(&sim->equations, &at, contact);
    if (kind == EVENT_IMPACT) {
        return z + sim->state.floors[contact];
    }
    return kind == EVENT_REVERSAL ? z + 0.5 * zero_speed(&sim->configuration) : z;
}

/* Positive while an open gap stays open.  An opening gap is lifted off zero, so that its indicator
 * is positive right after an impact, where the gap is zero up to round-off. */
static double impact_indicator(const Simulation *sim, int i) {
    Instant at = present_instant(sim);
    double speed = gap_rate(&sim->equations, i, at.time, at.e, at.v);
    double ahead = INDICATOR_LEAD_RTOL * sim->configuration.scales.time * greater(speed, 0.0);
    return (lifted_guard(sim, EVENT_IMPACT, i) + ahead) / sim->configuration.scales.length;
}

/* The rate at which a closed stop leaves its wall, whose acceleration is unknown. */
static double leaving_rate(const Simulation *sim, int i) {
    Instant at = present_instant(sim);
    return gap_rate(&sim->equations, i, at.time, at.e, at.v);
}

/* Positive while a closed stop is pressed and its wall has not changed its velocity by half of what
 * keeps it closed. */
static double release_indicator(const Simulation *sim, int i) {
    double pressed = lifted_guard(sim, EVENT_RELEASE, i) / force_scale(sim);
    double steady = (0.5 * jump_allowed(sim, i) - fabs(leaving_rate(sim, i))) / speed_scale(sim);
    return lesser(pressed, steady);
}

static double indicator(const Simulation *sim, EventKind kind, int contact) {
    switch (kind) {
    case EVENT_IMPACT: return impact_indicator(sim, contact);
    case EVENT_RELEASE: return release_indicator(sim, contact);
    default: return lifted_guard(sim, kind, contact) / guard_scale(sim, kind);
    }
}

/* All indicators at the present rates; 1 where an event is impossible. */
PRBM void event_indicators(const Simulation *sim, double *z) {
    for (int i = 0; i < exchange_indicators(sim); i++) {
        z[i] = 1.0;
    }
    for (EventKind kind = EVENT_NONE + 1; kind < EVENT_KINDS; kind++) {
        for (int contact = 0; contact < contact_count(sim); contact++) {
            if (transition(kind)->watched(&sim->equations, contact)) {
                z[indicator_place(sim, kind, contact)] = indicator(sim, kind, contact);
            }
        }
    }
}

PRBM bool exchange_event_indicators(Simulation *simulation, double *z, Problem *problem) {
    if (!exchange_rates(simulation, problem)) {
        return false;
    }
    event_indicators(simulation, z);
    return true;
}

/* --- drift ------------------------------------------------------------------------------------ */

/* The drift of a closed stop off its wall, in units of size and speed.  While the wall moves, with
 * an unknown acceleration, the indicator watches the speed. */
static double stop_drift(const Simulation *sim, int i) {
    Instant at = present_instant(sim);
    double off = fabs(gap(&sim->equations, i, at.time, at.e)) / system_of(sim)->length;
    double speed = fabs(leaving_rate(sim, i)) / speed_scale(sim);
    return sim->state.walls[i].rate != 0.0 ? off / MOVING_DRIFT_FACTOR : greater(off, speed);
}

/* The largest drift of the closed stops and the sticking contacts. */
static double drift(const Simulation *sim) {
    const Equations *q = &sim->equations;
    Instant at = present_instant(sim);
    double most = 0.0;
    for (int k = 0; k < q->held_count; k++) {
        most = greater(most, stop_drift(sim, q->held[k]));
    }
    for (int k = q->first_stick; k < q->r; k++) {
        double speed = fabs(row_rate(&q->active, k, at.e, at.v));
        most = greater(most, speed / speed_scale(sim));
    }
    return most;
}

PRBM bool exchange_completed_step(Simulation *simulation, bool *event, Problem *problem) {
    Simulation *sim = simulation;
    *event = false;
    if (!exchange_rates(sim, problem)) {
        return false;
    }
    copy(state_size(sim), sim->state.front, sim->state.arc.y);
    *event = drift(sim) > DRIFT_RTOL;
    return true;
}

/* The front has changed: its rates and outputs are no longer up to date. */
static void changed_front(Simulation *sim) {
    sim->rates.evaluated = false;
    sim->present.fresh = NOTHING;
}

/* --- events ----------------------------------------------------------------------------------- */

/* Bring a contact whose sliding has ended to rest: a solver overshoots by its own resolution of
 * time, which must not look like sliding back. */
static void stop_sliding(Simulation *sim, int contact) {
    Instant at = present_instant(sim);
    double speed = sliding_velocity(system_of(sim), contact, at.e, at.v);
    if (fabs(speed) <= DRIFT_RTOL * speed_scale(sim)) {
        Problem ignored; /* closed and sticking may be one constraint too many: then it stays */
        set_mode(sim, contact, CONTACT_STICK);
        (void)project(&sim->equations, sim->state.time, sim->state.front, &sim->scratch,
                      &ignored);
    }
}

/* Whether the gap of an open stop closes here. */
static bool closes_here(const Simulation *sim, int stop) {
    Instant at = present_instant(sim);
    double distance = gap(&sim->equations, stop, at.time, at.e);
    double speed = gap_rate(&sim->equations, stop, at.time, at.e, at.v);
    bool touches = distance <= TOUCHING_RTOL * system_of(sim)->length;
    return (touches && speed < -zero_speed(&sim->configuration)) ||
           (lifted_guard(sim, EVENT_IMPACT, stop) <= 0.0 && speed < 0.0);
}

/* Whether an event is due here; a stop is struck once at most. */
static bool due(const Simulation *sim, const bool *struck, EventKind kind, int contact) {
    if (!transition(kind)->watched(&sim->equations, contact)) {
        return false;
    }
    return kind == EVENT_IMPACT ? !struck[contact] && closes_here(sim, contact)
                                : lifted_guard(sim, kind, contact) <= 0.0;
}

/* The first event that is due at the front. */
static Event due_here(const Simulation *sim, const bool *struck) {
    Event event = {EVENT_NONE, 0, sim->state.time};
    for (EventKind kind = EVENT_NONE + 1; kind < EVENT_KINDS; kind++) {
        for (int contact = 0; contact < contact_count(sim); contact++) {
            if (due(sim, struck, kind, contact)) {
                event.kind = kind;
                event.contact = contact;
                return event;
            }
        }
    }
    return event;
}

/* After an event: the gaps at which stops close from here on. */
static void arm(Simulation *sim) {
    State *state = &sim->state;
    Instant at = present_instant(sim);
    for (int i = 0; i < system_of(sim)->s; i++) {
        state->floors[i] = GAP_CLOSED_RTOL * system_of(sim)->length;
        if (state->modes[i] == CONTACT_OPEN) {
            state->floors[i] += greater(0.0, -gap(&sim->equations, i, at.time, at.e));
        }
    }
    state->point = state->time;
}

/* Apply the impulses and the changes of the walls. */
static bool apply_inputs(Simulation *sim, Problem *problem) {
    bool impulses = impulses_changed(sim);
    if (!exchange_rates(sim, problem) || !receive_impulses(sim, problem)) {
        return false;
    }
    bool drifted = drift(sim) > DRIFT_CORRECTED_RTOL;
    changed_front(sim);
    return impulses ? exchange_rates(sim, problem) && settle_moved(sim, problem)
                    : follow_walls(sim, drifted, sim->state.time - sim->state.point, problem);
}

static bool apply_due_events(Simulation *sim, Problem *problem) {
    enum { EVENTS_AT_ONCE_MAX = 16 };
    bool struck[STOPS_MAX] = {false};
    for (int i = 0; i < EVENTS_AT_ONCE_MAX; i++) {
        if (!exchange_rates(sim, problem)) {
            return false;
        }
        Event event = due_here(sim, struck);
        if (event.kind == EVENT_NONE) {
            break;
        }
        changed_front(sim);
        if (event.kind == EVENT_IMPACT) {
            struck[event.contact] = true;
        } else if (event.kind == EVENT_REVERSAL) {
            stop_sliding(sim, event.contact);
        }
        if (!apply_event(sim, &event, problem)) {
            return false;
        }
    }
    return exchange_rates(sim, problem);
}

PRBM bool exchange_event(Simulation *simulation, bool *changed, Problem *problem) {
    Simulation *sim = simulation;
    State *state = &sim->state;
    size_t mark = sim->scratch.used;
    int nx = exchange_states(sim);
    double *before = take(&sim->scratch, (size_t)nx);
    *changed = false;
    copy(nx, state->states, before);
    keep_backup(sim);
    bool right = apply_inputs(sim, problem) && apply_due_events(sim, problem);
    if (right) {
        arm(sim);
        copy(state_size(sim), state->front, state->arc.y);
        states_of(sim, state->front, state->states);
        *changed = memcmp(before, state->states, (size_t)nx * sizeof *before) != 0;
    }
    sim->scratch.used = mark;
    right = attempt(sim, right, problem);
    sim->rates.stale = !right;
    return right;
}

/* The stop that is penetrated most, if more than by a solver's errors; or NULL. */
PRBM const char *exchange_deepest(Simulation *simulation, double *depth) {
    Simulation *sim = simulation;
    const char *found = NULL;
    Problem ignored;
    *depth = PENETRATION_WARNING_RTOL * system_of(sim)->length;
    if (!exchange_rates(sim, &ignored)) {
        return NULL;
    }
    Instant at = present_instant(sim);
    for (int i = 0; i < system_of(sim)->s; i++) {
        double inside = -gap(&sim->equations, i, at.time, at.e);
        if (inside > *depth) {
            *depth = inside;
            found = sim->configuration.mechanism->stops[i].name;
        }
    }
    return found;
}

PRBM void exchange_begin(Simulation *sim) {
    Problem ignored;
    copy(state_size(sim), sim->state.front, sim->state.arc.y);
    states_of(sim, sim->state.front, sim->state.states);
    sim->rates.stale = true;
    if (exchange_rates(sim, &ignored)) {
        arm(sim);
    }
    sim->rates.stale = true;
}
