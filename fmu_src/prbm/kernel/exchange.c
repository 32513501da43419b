/* Model exchange: somebody else integrates the independent angles and rates.
 *
 * The loops tie the n coordinates together; r of them are solved from the other n - r, so that a
 * solver that knows nothing of constraints stays on them (prbm/exchange.py says how they are
 * chosen).  A stop that holds is a constraint of the accelerations; what a solver's errors let it
 * drift is taken back in an event.
 */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "hybrid.h"

#define DRIFT 1e-8        /* of the size, and with the frequency of the velocity: worth an event */
#define UNDRIFTED 1e-12   /* of these: left alone in an event */
#define DEEP 1e-2         /* of the size: a solver that overshoots takes nothing so far into a wall */
#define FLOOR 1e-12       /* of the size: how far below zero a gap closes, more than a rounding */
#define FORESIGHT 0.01    /* of the period: an opening rate keeps the indicator off zero by so much */
#define DEFINITE 1e-7     /* of the largest pivot: a smaller one says that the choice is singular */

/* --- independent and dependent coordinates ---------------------------------------------------- */

PRBM int exchange_states(const Simulation *simulation) {
    return 2 * simulation->mechanism->independent_count + 2;
}

PRBM int exchange_indicators(const Simulation *simulation) {
    const Mechanism *m = simulation->mechanism;
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
        return m->slots.stretches + PER_STRETCH * k + rate;
    }
    if (coordinate->link >= 0) {
        return m->slots.links + PER_LINK * coordinate->link + rate;
    }
    return m->slots.bodies + PER_BODY * (coordinate->body - 1) + (rate ? 5 : 2);
}

PRBM int exchange_slot(const Simulation *simulation, int k) {
    const Mechanism *m = simulation->mechanism;
    int count = m->independent_count;
    if (k >= 2 * count) {
        return m->slots.energies + 3 + (k - 2 * count);
    }
    return slot_of(m, m->independent[k % count], k >= count);
}

static const char *coordinate_name(const Mechanism *m, int j, char *text, size_t size) {
    const Coordinate *coordinate = &m->coordinates[j];
    if (coordinate->link >= 0) {
        const char *what = coordinate->arm == j ? "angle" : "strain";
        (void)snprintf(text, size, "link[%d].%s", coordinate->link + 1, what);
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
                coordinate_name(sim->mechanism, dependent[0], name, sizeof name), sim->system.r - 1,
                sim->now->time);
}

/* The loops' Jacobian in the dependent coordinates, factored. */
static bool factor_dependents(const Simulation *sim, const double *rows, const int *dependent,
                              double *a, int *pivot) {
    int r = sim->system.r, n = sim->system.n;
    double least = HUGE_VAL, most = 0.0;
    for (int i = 0; i < r; i++) {
        for (int k = 0; k < r; k++) {
            a[i * r + k] = rows[i * n + dependent[k]];
        }
    }
    most = largest(r * n, rows);
    if (!lu_factor(r, a, pivot)) {
        return false;
    }
    for (int i = 0; i < r; i++) {
        least = lesser(least, 1.0 / fabs(a[i * r + i])); /* its diagonal is inverted */
    }
    return least > DEFINITE * most;
}

/* Solve the loops for the dependent angles and rates, from the angles of the last step. */
static bool complete(Simulation *sim, double *q, double *v, Problem *problem) {
    size_t mark = sim->scratch.used;
    const System *system = &sim->system;
    int n = system->n, r = system->r;
    int *dependent = take_integers(&sim->scratch, r), *pivot = take_integers(&sim->scratch, r);
    double *rows = take_matrix(&sim->scratch, r, n), *a = take_matrix(&sim->scratch, r, r);
    double *s = take(&sim->scratch, (size_t)r), best = HUGE_VAL;
    Rows loops = plain_rows(system, r, system->loops, system->loops_c);
    bool closed = false, regular = true;
    dependents(sim->mechanism, dependent);
    for (int step = 0; step < CONSTRAINT_ITERATIONS_MAX && regular && !closed; step++) {
        directions(system, q, sim->e);
        scalars(&loops, sim->e, s);
        double error = largest(r, s), length = system->length;
        closed = error <= CONSTRAINT_RTOL * length || (CONSTRAINT_STALLED_RTOL * length >= best && best <= error);
        best = lesser(best, error);
        jacobian(&loops, sim->e, rows);
        regular = factor_dependents(sim, rows, dependent, a, pivot);
        if (regular && !closed) {
            lu_solve(r, a, pivot, s);
            for (int k = 0; k < r; k++) {
                q[dependent[k]] -= s[k];
            }
        }
    }
    if (closed && regular) {
        for (int k = 0; k < r; k++) {
            v[dependent[k]] = 0.0;
        }
        for (int i = 0; i < r; i++) {
            s[i] = -dot(n, rows + i * n, v);
        }
        lu_solve(r, a, pivot, s);
        for (int k = 0; k < r; k++) {
            v[dependent[k]] = s[k];
        }
    }
    sim->scratch.used = mark;
    return (closed && regular) || (r > 0 ? singular_choice(sim, dependent, problem)
                                         : fail(problem, "the states are not finite numbers"));
}

/* The independent part of y = (q, v, dissipated energy, work). */
static void states_of(const Simulation *sim, const double *y, double *x) {
    const Mechanism *m = sim->mechanism;
    int n = m->coordinate_count, count = m->independent_count;
    for (int k = 0; k < count; k++) {
        x[k] = y[m->independent[k]];
        x[count + k] = y[n + m->independent[k]];
    }
    x[2 * count] = y[2 * n];
    x[2 * count + 1] = y[2 * n + 1];
}

/* --- time, states, inputs --------------------------------------------------------------------- */

/* In model exchange the displacement of a wall is used as it is. */
static void place_walls(Simulation *sim) {
    const Mechanism *m = sim->mechanism;
    for (int i = 0; i < m->stop_count; i++) {
        Wall wall = {wall_target(sim, i, 0.0), wall_inputs(m, sim->given, i)[1], sim->now->time};
        sim->walls[i] = wall;
    }
}

/* Bring the equations and the state y, in sim->front, up to date with time, states and inputs. */
PRBM bool exchange_refresh(Simulation *sim, Problem *problem) {
    const Mechanism *m = sim->mechanism;
    int n = sim->system.n, count = m->independent_count;
    if (!sim->stale) {
        return true;
    }
    size_t np = (size_t)m->parameter_count * sizeof(double);
    bool known = sim->assembled && memcmp(sim->values, sim->acting_values, np) == 0;
    if (!known && !take_values(sim, problem)) {
        return false;
    }
    copy(m->input_count, sim->given, sim->acting_given);
    place_walls(sim);
    sim->now->front_time = sim->now->time;
    set_inputs(sim);
    copy(n, sim->arc_y, sim->front); /* angles of the last step: the shape to look near */
    for (int k = 0; k < count; k++) {
        sim->front[m->independent[k]] = sim->states[k];
        sim->front[n + m->independent[k]] = sim->states[count + k];
    }
    sim->front[2 * n] = sim->states[2 * count];
    sim->front[2 * n + 1] = sim->states[2 * count + 1];
    if (!complete(sim, sim->front, sim->front + n, problem)) {
        return false;
    }
    sim->stale = sim->evaluated = false;
    sim->fresh = NOTHING;
    return true;
}

/* Accelerations and multipliers at the present state, in sim->equations; its rates. */
static bool evaluate_motion(Simulation *sim, Problem *problem) {
    if (sim->now->exchange == 0.0) {
        sim->at = sim->y;
        sim->evaluated = false;
        if (!update_outputs(sim, PLACES, problem)) {
            return false;
        }
    } else {
        sim->at = sim->front;
        if (!exchange_refresh(sim, problem)) {
            return false;
        }
    }
    if (!sim->evaluated) {
        sim->evaluated = rate(&sim->equations, sim->now->time, sim->at, sim->rates, problem);
    }
    return sim->evaluated;
}

PRBM void exchange_set_time(Simulation *simulation, double time) {
    if (time != simulation->now->time) {
        simulation->now->time = time;
        simulation->stale = true;
        simulation->fresh = NOTHING;
    }
}

PRBM void exchange_set(Simulation *simulation, const double *x) {
    copy(exchange_states(simulation), x, simulation->states);
    simulation->stale = true;
    simulation->fresh = NOTHING;
}

PRBM void exchange_get(const Simulation *simulation, double *x) {
    copy(exchange_states(simulation), simulation->states, x);
}

/* The next power of ten that is not below: what modelDescription.xml has for a nominal.  A solver's
 * absolute tolerance goes with it; one below the scale of the motion would have it count roundings. */
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
    int count = simulation->mechanism->independent_count;
    double rate = next_power_of_ten(omega_scale(simulation));
    for (int k = 0; k < count; k++) {
        x[k] = 1.0;
        x[count + k] = rate;
    }
    x[2 * count] = x[2 * count + 1] = next_power_of_ten(simulation->energy_scale);
}

PRBM bool exchange_derivatives(Simulation *simulation, double *dx, Problem *problem) {
    if (!evaluate_motion(simulation, problem)) {
        return false;
    }
    states_of(simulation, simulation->rates, dx);
    return true;
}

/* --- event indicators ------------------------------------------------------------------------- */

static double force_scale(const Simulation *sim) {
    return sim->energy_scale / sim->system.length;
}

static double speed_scale(const Simulation *sim) {
    return omega_scale(sim) * sim->system.length;
}

/* How much the velocity of a wall may change under what rests on it before that is an event: the
 * wall's acceleration is not known, and a slower strike than rest_speed ends in rest. */
static double turn_allowed(const Simulation *sim, int i) {
    double rest_speed = evaluate(sim->mechanism->stops[i].rest_speed, sim->acting_values);
    return greater(0.5 * rest_speed, 10.0 * still(sim));
}

static double wall_turn(const Simulation *sim, int i) {
    return sim->walls[i].rate - sim->held_rates[i];
}

/* Positive while a stop that holds is pressed and its wall keeps its velocity. */
static double release_indicator(const Simulation *sim, int k) {
    int i = sim->equations.held[k];
    double pressed = margin_release(sim, k) / force_scale(sim);
    double steady = (turn_allowed(sim, i) - fabs(wall_turn(sim, i))) / speed_scale(sim);
    return lesser(pressed, steady);
}

/* Positive while an open gap stays open.  What opens keeps it off zero, so that it is positive
 * right after an impact, whose gap is zero up to a rounding. */
static double impact_indicator(const Simulation *sim, int i) {
    const Equations *q = &sim->equations;
    if (sim->holds[i] != 0.0) {
        return 1.0;
    }
    double speed = gap_rate(q, i, q->e, sim->at + sim->system.n);
    double ahead = FORESIGHT * period(sim) * greater(speed, 0.0);
    return (gap(q, i, sim->now->time, q->e) + sim->floors[i] + ahead) / sim->system.length;
}

/* Falls through zero as what slides has come to rest, up to what counts as rest. */
static double slip_speed(const Simulation *sim, const Rows *rows, int i, int sign) {
    const double *v = sim->at + sim->system.n;
    return sign * row_rate(rows, i, sim->equations.e, v) + 0.5 * still(sim);
}

static void friction_indicators(const Simulation *sim, double *z) {
    const Equations *q = &sim->equations;
    Rows walls = slide_rows(&sim->system), points = rub_rows(&sim->system);
    double *rubs = z + STOP_INDICATORS * sim->system.s;
    for (int k = 0; k < q->stuck_count; k++) {
        z[STOP_INDICATORS * q->stuck[k] + 2] = margin_stick(sim, k) / force_scale(sim);
    }
    for (int k = 0; k < q->sliding_count; k++) {
        int i = q->sliding[k];
        double speed = slip_speed(sim, &walls, i, q->discrete.slides[i]);
        z[STOP_INDICATORS * i + 2] = speed / speed_scale(sim);
    }
    for (int k = 0; k < q->rubbing_count; k++) {
        rubs[q->rubbing[k]] = margin_rub(sim, k) / force_scale(sim);
    }
    for (int k = 0; k < q->rub_slide_count; k++) {
        int i = q->rub_slides[k];
        double speed = slip_speed(sim, &points, i, q->discrete.rubs[i]);
        rubs[i] = speed / speed_scale(sim);
    }
}

PRBM bool exchange_event_indicators(Simulation *simulation, double *z, Problem *problem) {
    Simulation *sim = simulation;
    if (!evaluate_motion(sim, problem)) {
        return false;
    }
    for (int i = 0; i < exchange_indicators(sim); i++) {
        z[i] = 1.0;
    }
    for (int i = 0; i < sim->system.s; i++) {
        z[STOP_INDICATORS * i] = impact_indicator(sim, i);
    }
    for (int k = 0; k < sim->equations.held_count; k++) {
        z[STOP_INDICATORS * sim->equations.held[k] + 1] = release_indicator(sim, k);
    }
    friction_indicators(sim, z);
    return true;
}

/* --- events ----------------------------------------------------------------------------------- */

/* How far a stop that holds is off its wall and off the velocity at which it was held, in units of
 * size and speed.  While the wall changes its velocity the place is the wall's matter. */
static double drift_of_held(const Simulation *sim, int i) {
    const Equations *q = &sim->equations;
    double turn = wall_turn(sim, i);
    double off = fabs(gap(q, i, sim->now->time, q->e)) / sim->system.length;
    double speed = fabs(gap_rate(q, i, q->e, sim->front + sim->system.n) - turn);
    return greater(fabs(turn) > still(sim) ? 0.0 : off, speed / speed_scale(sim));
}

/* The largest drift of what holds and what sticks. */
static double drift(const Simulation *sim) {
    const Equations *q = &sim->equations;
    int n = sim->system.n;
    double most = 0.0;
    for (int k = 0; k < q->held_count; k++) {
        most = greater(most, drift_of_held(sim, q->held[k]));
    }
    for (int k = q->first_stick; k < q->r; k++) {
        double speed = fabs(row_rate(&q->active, k, q->e, sim->front + n));
        most = greater(most, speed / speed_scale(sim));
    }
    return most;
}

PRBM bool exchange_completed_step(Simulation *simulation, bool *event, Problem *problem) {
    Simulation *sim = simulation;
    *event = false;
    if (!evaluate_motion(sim, problem)) {
        return false;
    }
    copy(state_size(sim), sim->front, sim->arc_y);
    *event = drift(sim) > DRIFT;
    return true;
}

/* What has been changed at the front is there to be evaluated again. */
static void changed_front(Simulation *sim) {
    sim->evaluated = false;
    sim->fresh = NOTHING;
}

/* Whether an impulse on a held stop pulls more than it was pressed since the last event: then its
 * wall has retreated faster than the body could follow. */
static bool left_behind(const Simulation *sim, int k, double P) {
    double since = sim->now->time - sim->held_times[sim->equations.held[k]];
    return -P > greater(margin_release(sim, k), 0.0) * since;
}

/* Give what holds the present velocities of its walls, if what was pressed meanwhile bears the
 * change.  The impulses, which may pull a little, are booked as at an impact. */
static bool follow(Simulation *sim, bool *followed, Problem *problem) {
    size_t mark = sim->scratch.used;
    const Equations *q = &sim->equations;
    int n = sim->system.n, r = q->r, size = n + r;
    double *y = sim->front, *v = y + n, *rows = take_matrix(&sim->scratch, r, n);
    double *M = take_matrix(&sim->scratch, n, n), *C = take_matrix(&sim->scratch, n, n);
    double *kkt = take_matrix(&sim->scratch, size, size), *x = take(&sim->scratch, (size_t)size);
    jacobian(&q->active, q->e, rows);
    inertia(n, sim->system.H, sim->system.J, q->e, M, C);
    saddle(n, r, M, rows, rows, kkt);
    zeros(n, x);
    for (int k = 0; k < r; k++) {
        x[n + k] = -(dot(n, rows + k * n, v) + prescribed(q, k));
    }
    bool right = solve(size, kkt, x, &sim->scratch, problem);
    *followed = right;
    for (int k = 0; right && k < q->held_count; k++) {
        bool turned = fabs(wall_turn(sim, q->held[k])) > still(sim);
        *followed = *followed && !(turned && left_behind(sim, k, -x[n + q->first_hold + k]));
    }
    for (int k = 0; *followed && k < q->held_count; k++) {
        int i = q->held[k], row = q->first_hold + k;
        double P = -x[n + row], wall = sim->walls[i].rate;
        double before = dot(n, rows + row * n, v) + wall;
        y[2 * n] -= P * before / 2; /* and nothing after */
        y[2 * n + 1] -= P * wall;
    }
    add_scaled(*followed ? n : 0, 1.0, x, v);
    sim->scratch.used = mark;
    return right && (!*followed ||
                     project(&sim->equations, sim->now->time, y, &sim->scratch, problem));
}

/* Let go of what rests on walls that have changed their velocity, or have them strike. */
static bool break_away(Simulation *sim, Problem *problem) {
    int struck = unsettled(sim);
    if (struck >= 0) {
        return impact(sim, struck, problem);
    }
    return project(&sim->equations, sim->now->time, sim->front, &sim->scratch, problem) &&
           settle(sim, NULL, 0, NULL, problem);
}

/* Bring held stops back onto their walls, let them go or strike where a wall has changed its
 * velocity at once; bring what sticks back to rest. */
static bool follow_walls(Simulation *sim, Problem *problem) {
    bool turned = false, jumped = false, drifted = drift(sim) > UNDRIFTED;
    for (int k = 0; k < sim->equations.held_count; k++) {
        int i = sim->equations.held[k];
        double turn = fabs(wall_turn(sim, i));
        turned = turned || turn > still(sim);
        jumped = jumped || turn > 2.0 * turn_allowed(sim, i);
    }
    bool followed = false;
    if (!jumped && (turned || drifted) && !follow(sim, &followed, problem)) {
        return false;
    }
    if (turned || drifted) {
        changed_front(sim);
    }
    return followed || !turned || break_away(sim, problem);
}

/* What has stopped sliding is at rest: a solver overshoots by its own resolution of time, which
 * must not look like sliding back. */
static void stop_sliding(Simulation *sim, const Event *event) {
    Rows rows = rows_of(sim, event->kind);
    const double *v = sim->front + sim->system.n;
    double speed = row_rate(&rows, event->index, sim->equations.e, v);
    if (fabs(speed) <= DRIFT * speed_scale(sim)) {
        Problem ignored; /* held and stuck at once may be one constraint too many: then it stays */
        with_slide(sim, event->kind, event->index, STICKS);
        set_discrete(sim, &sim->other);
        (void)project(&sim->equations, sim->now->time, sim->front, &sim->scratch, &ignored);
    }
}

/* The next event that is due at the front: releases and slips first, then impacts. */
static Event due_here(const Simulation *sim, bool *struck) {
    const Equations *q = &sim->equations;
    const System *system = &sim->system;
    Rows walls = slide_rows(system), points = rub_rows(system);
    double near = TOUCHING * system->length, bound = still(sim);
    Event event = {NO_EVENT, 0, sim->now->time};
    for (int k = 0; k < q->held_count; k++) {
        if (margin_release(sim, k) <= 0.0) {
            event.kind = RELEASE;
            event.index = q->held[k];
            return event;
        }
    }
    for (int k = 0; k < q->stuck_count; k++) {
        if (margin_stick(sim, k) <= 0.0) {
            event.kind = SLIP_SLIDE;
            event.index = q->stuck[k];
            return event;
        }
    }
    for (int k = 0; k < q->rubbing_count; k++) {
        if (margin_rub(sim, k) <= 0.0) {
            event.kind = SLIP_RUB;
            event.index = q->rubbing[k];
            return event;
        }
    }
    for (int k = 0; k < q->sliding_count; k++) {
        int i = q->sliding[k];
        if (slip_speed(sim, &walls, i, q->discrete.slides[i]) <= 0.0) {
            event.kind = SLIDE;
            event.index = i;
            return event;
        }
    }
    for (int k = 0; k < q->rub_slide_count; k++) {
        int i = q->rub_slides[k];
        if (slip_speed(sim, &points, i, q->discrete.rubs[i]) <= 0.0) {
            event.kind = RUB;
            event.index = i;
            return event;
        }
    }
    for (int i = 0; i < system->s; i++) {
        double distance = gap(q, i, sim->now->time, q->e);
        double speed = gap_rate(q, i, q->e, sim->front + system->n);
        bool closes = sim->holds[i] == 0.0 && !struck[i] &&
                      ((distance <= near && speed < -bound) ||
                       (distance + sim->floors[i] <= 0.0 && speed < 0.0));
        if (closes) {
            struck[i] = true;
            event.kind = IMPACT;
            event.index = i;
            return event;
        }
    }
    return event;
}

/* After an event: where gaps close from here on, and how fast the walls that hold move. */
static void arm(Simulation *sim) {
    const Equations *q = &sim->equations;
    for (int i = 0; i < sim->system.s; i++) {
        sim->floors[i] = FLOOR * sim->system.length;
        if (sim->holds[i] == 0.0) {
            sim->floors[i] += greater(0.0, -gap(q, i, sim->now->time, q->e));
        }
        sim->held_rates[i] = sim->walls[i].rate;
        sim->held_times[i] = sim->now->time;
    }
}

static bool let_all_happen(Simulation *sim, Problem *problem) {
    enum { MOST_AT_ONCE = 16 };
    bool struck[STOPS_MAX] = {false};
    bool thrown = impulses_changed(sim);
    if (!evaluate_motion(sim, problem) || !receive_impulses(sim, problem)) {
        return false;
    }
    if (thrown) {
        changed_front(sim);
    }
    if (!(thrown ? evaluate_motion(sim, problem) && break_away(sim, problem)
                 : follow_walls(sim, problem))) {
        return false;
    }
    for (int i = 0; i < MOST_AT_ONCE; i++) {
        if (!evaluate_motion(sim, problem)) {
            return false;
        }
        Event event = due_here(sim, struck);
        if (event.kind == NO_EVENT) {
            break;
        }
        changed_front(sim);
        if (event.kind == SLIDE || event.kind == RUB) {
            stop_sliding(sim, &event);
        }
        if (!happen(sim, &event, problem)) {
            return false;
        }
    }
    return evaluate_motion(sim, problem);
}

PRBM bool exchange_event(Simulation *simulation, bool *changed, Problem *problem) {
    Simulation *sim = simulation;
    size_t mark = sim->scratch.used;
    int nx = exchange_states(sim);
    double *before = take(&sim->scratch, (size_t)nx);
    *changed = false;
    copy(nx, sim->states, before);
    keep_backup(sim);
    bool right = let_all_happen(sim, problem);
    if (right) {
        arm(sim);
        copy(state_size(sim), sim->front, sim->arc_y);
        states_of(sim, sim->front, sim->states);
        *changed = memcmp(before, sim->states, (size_t)nx * sizeof *before) != 0;
    }
    sim->scratch.used = mark;
    right = attempt(sim, right, problem);
    sim->stale = !right;
    return right;
}

/* The stop that the state is deepest in, if it is more than a mark of a solver's; or NULL. */
PRBM const char *exchange_deepest(Simulation *simulation, double *depth) {
    Simulation *sim = simulation;
    const char *found = NULL;
    Problem ignored;
    *depth = DEEP * sim->system.length;
    if (!evaluate_motion(sim, &ignored)) {
        return NULL;
    }
    for (int i = 0; i < sim->system.s; i++) {
        double inside = -gap(&sim->equations, i, sim->now->time, sim->equations.e);
        if (inside > *depth) {
            *depth = inside;
            found = sim->mechanism->stops[i].name;
        }
    }
    return found;
}

PRBM void exchange_begin(Simulation *sim) {
    Problem ignored;
    copy(state_size(sim), sim->front, sim->arc_y);
    states_of(sim, sim->front, sim->states);
    sim->stale = true;
    if (evaluate_motion(sim, &ignored)) {
        arm(sim);
    }
    sim->stale = true;
}

/* --- directional derivatives ------------------------------------------------------------------ */

/* A change of everything with the states and inputs: dq, dv, da, dlam.  With the complex changes
 * dphi = dtheta - i ds of an arm E, and dw of its rate, dE = i E dphi, d(E w) = E (i dphi w + dw), and
 * so on: what is written for an angle holds for a stretch, too. */
typedef struct {
    Simulation *sim;
    const Equations *q;
    const Complex *e;
    const double *y, *v, *a, *du;
    double *dq, *dv, *dx, *dlam;    /* (n,), (n,), (even,) = da, (r,) */
    Complex *w, *alpha, *dphi, *dw; /* (n,) of the arms: rates, accelerations, changes */
    Complex *dE;                    /* (n,) i E dphi */
    Complex *swing, *dswing;        /* (n,) E w */
    Complex *bend, *dbend;          /* (n,) E (i w' - w^2); at first without the change of w' */
    Complex *pull;                  /* (n,) torques on the arms and, -i times, forces along them */
} Tangent;

static Complex times_i(Complex z) {
    return complex_of(-z.im, z.re);
}

static double multiplier(const Tangent *t, int k) {
    return t->q->lam[k];
}

static double multiplier_change(const Tangent *t, int k) {
    return t->dlam[k];
}

/* --- of rows --- */

/* A vector that turns, and its motion. */
typedef struct {
    Complex E, w, alpha, dphi, dw;
} Arm;

static Arm arm_at(const Tangent *t, int j) {
    Complex none = {0.0, 0.0}, one = {1.0, 0.0};
    Arm still_one = {one, none, none, none, none};
    if (j == FIXED) {
        return still_one;
    }
    Arm arm = {t->e[j], t->w[j], t->alpha[j], t->dphi[j], t->dw[j]};
    return arm;
}

/* A part of a row as it is seen from where the row is: f B_j E_j, and f z for j = n; false if it has
 * no such part. */
static bool seen_part(const Tangent *t, const Rows *rows, int i, int j, Arm *seen) {
    int n = rows->system->n, on = seen_from(rows, i);
    Complex size = {0.0, 0.0};
    if (j < n) {
        size = rows->B[i * n + j];
    } else if (on != FIXED) {
        size = rows->z[i];
    }
    Arm arm = arm_at(t, j < n ? j : FIXED), body = arm_at(t, on);
    seen->E = product(product(conjugate(body.E), arm.E), size);
    seen->w = minus(arm.w, body.w);
    seen->alpha = minus(arm.alpha, body.alpha);
    seen->dphi = minus(arm.dphi, body.dphi);
    seen->dw = minus(arm.dw, body.dw);
    return size.re != 0.0 || size.im != 0.0;
}

/* E (i dphi w + dw) */
static Complex swing_change(const Arm *arm) {
    return product(arm->E, plus(times_i(product(arm->dphi, arm->w)), arm->dw));
}

/* i w' - w^2 */
static Complex bend_of(const Arm *arm) {
    return minus(times_i(arm->alpha), product(arm->w, arm->w));
}

/* E (i dphi (i w' - w^2) - 2 w dw) */
static Complex bend_change(const Arm *arm) {
    Complex turned = times_i(product(arm->dphi, bend_of(arm)));
    return product(arm->E, minus(turned, scaled(2.0, product(arm->w, arm->dw))));
}

static double value_change(const Tangent *t, const Rows *rows, int i) {
    double sum = 0.0;
    Arm part;
    for (int j = 0; j <= rows->system->n; j++) {
        sum -= seen_part(t, rows, i, j, &part) ? product(part.E, part.dphi).im : 0.0;
    }
    return sum;
}

static double rate_change(const Tangent *t, const Rows *rows, int i) {
    double sum = 0.0;
    Arm part;
    for (int j = 0; j <= rows->system->n; j++) {
        sum -= seen_part(t, rows, i, j, &part) ? swing_change(&part).im : 0.0;
    }
    return sum;
}

/* Of the second derivative, as far as it is not one of the accelerations. */
static double second_change(const Tangent *t, const Rows *rows, int i) {
    double sum = 0.0;
    Arm part;
    for (int j = 0; j <= rows->system->n; j++) {
        sum += seen_part(t, rows, i, j, &part) ? bend_change(&part).re : 0.0;
    }
    return sum;
}

/* A force along a row, whose gradient i f B E turns; what the arms take, the body of the wall gives. */
static void add_pull(const Tangent *t, const Rows *rows, int i, double force) {
    int n = rows->system->n, on = seen_from(rows, i);
    Arm part;
    for (int j = 0; j <= n; j++) {
        if (seen_part(t, rows, i, j, &part)) {
            Complex change = scaled(force, product(part.E, part.dphi));
            if (j < n) {
                t->pull[j] = minus(t->pull[j], change);
            }
            if (on != FIXED) {
                t->pull[on] = plus(t->pull[on], change);
            }
        }
    }
}

/* --- of coordinates --- */

/* What follows for the arms from dq and dv. */
static void move_arms(const Tangent *t) {
    const System *system = t->q->system;
    turning(system, t->dq, t->dphi);
    turning(system, t->dv, t->dw);
    for (int j = 0; j < system->n; j++) {
        Arm arm = arm_at(t, j);
        t->dE[j] = times_i(product(arm.E, arm.dphi));
        t->swing[j] = product(arm.E, arm.w);
        t->dswing[j] = swing_change(&arm);
        t->bend[j] = product(arm.E, bend_of(&arm));
        t->dbend[j] = bend_change(&arm);
    }
}

/* dq and dv from the changes of the independent ones: the loops and their rates do not change. */
static bool tangent_coordinates(Tangent *t, const double *dx, Problem *problem) {
    Simulation *sim = t->sim;
    const Mechanism *m = sim->mechanism;
    const System *system = &sim->system;
    int n = system->n, r = system->r, count = m->independent_count;
    int *dependent = take_integers(&sim->scratch, r), *pivot = take_integers(&sim->scratch, r);
    double *rows = take_matrix(&sim->scratch, r, n), *a = take_matrix(&sim->scratch, r, r);
    double *s = take(&sim->scratch, (size_t)r);
    Rows loops = plain_rows(system, r, system->loops, system->loops_c);
    dependents(m, dependent);
    jacobian(&loops, t->e, rows);
    if (!factor_dependents(sim, rows, dependent, a, pivot)) {
        return singular_choice(sim, dependent, problem);
    }
    zeros(n, t->dq);
    zeros(n, t->dv);
    for (int k = 0; k < count; k++) {
        t->dq[m->independent[k]] = dx[k];
        t->dv[m->independent[k]] = dx[count + k];
    }
    for (int i = 0; i < r; i++) {
        s[i] = -dot(n, rows + i * n, t->dq);
    }
    lu_solve(r, a, pivot, s);
    for (int k = 0; k < r; k++) {
        t->dq[dependent[k]] = s[k];
    }
    move_arms(t);
    for (int i = 0; i < r; i++) {
        s[i] = -rate_change(t, &loops, i);
    }
    lu_solve(r, a, pivot, s);
    for (int k = 0; k < r; k++) {
        t->dv[dependent[k]] = s[k];
    }
    move_arms(t);
    return true;
}

/* --- of loads --- */

/* (H x)_i over the arms */
static Complex through_mass(const Tangent *t, int i, const Complex *x) {
    int n = t->q->system->n;
    return along_arms(n, t->q->system->H + i * n, x);
}

/* Change of the row of loads of the inputs. */
static void load_row_change(const Tangent *t, Complex *dw, double *dmoment) {
    const System *system = t->q->system;
    const Mechanism *m = system->mechanism;
    const double *base = t->du + m->input.base;
    int n = system->n;
    size_t mark = t->sim->scratch.used;
    Complex *one = take_complex(&t->sim->scratch, n, 1);
    field_row(n, system->S, complex_of(-base[0], -base[1]), dw);
    zeros(n, dmoment);
    for (int i = 0; i < m->force_count; i++) {
        const BodyFrame *frame = &system->pushed[i];
        const double *given = t->du + LOADS * i;
        force_row(n, frame->A, complex_of(given[0], given[1]), one);
        for (int j = 0; j < n; j++) {
            dw[j] = plus(dw[j], one[j]);
        }
        dmoment[frame->j] += given[2];
    }
    t->sim->scratch.used = mark;
}

/* Momentum of an arm, E conj(H (E w)), and its change. */
static Complex momentum_change(const Tangent *t, int j) {
    Complex momentum = product(t->e[j], conjugate(through_mass(t, j, t->swing)));
    Complex turned = times_i(product(t->dphi[j], momentum));
    return plus(turned, product(t->e[j], conjugate(through_mass(t, j, t->dswing))));
}

/* Change of the inertial load -i E conj(H bend) of an arm. */
static Complex inertial_change(const Tangent *t, int j) {
    Complex load = product(t->e[j], conjugate(through_mass(t, j, t->bend)));
    Complex turned = times_i(product(t->dphi[j], load));
    Complex change = plus(turned, product(t->e[j], conjugate(through_mass(t, j, t->dbend))));
    return scaled(-1.0, times_i(change));
}

/* Loads, inertia and damping in proportion to mass: change of the pull on the arms. */
static void arm_load_change(const Tangent *t, const Complex *dw) {
    const Equations *q = t->q;
    for (int j = 0; j < q->system->n; j++) {
        if (arm_of(q->system, j) == j) {
            Complex load = plus(product(dw[j], t->e[j]), product(q->w[j], t->dE[j]));
            Complex lost = scaled(-q->mass_damping, momentum_change(t, j));
            t->pull[j] = plus(plus(load, inertial_change(t, j)), lost);
        }
    }
}

/* Springs, moments and damping of the bodies' own inertia. */
static void coordinate_load_change(const Tangent *t, const double *dmoment) {
    const Equations *q = t->q;
    const System *system = q->system;
    int n = system->n;
    for (int i = 0; i < n; i++) {
        double sum = dmoment[i] - q->mass_damping * system->J[i] * t->dv[i];
        for (int j = 0; j < n; j++) {
            sum -= system->K[i * n + j] * (t->dq[j] + q->beta * t->dv[j]);
        }
        t->dx[i] += sum;
    }
}

static double lift_change(const Tangent *t, int i) {
    const System *system = t->q->system;
    Rows lifts = plain_rows(system, system->f, system->lifts, system->lifts_c);
    return value_change(t, &lifts, i);
}

/* Change of the limit of friction of a friction point. */
static double limit_change(const Tangent *t, int i) {
    const double *law = t->q->rub_law + 3 * i;
    return rub_limit(t->q, i, t->e) > 0.0 ? law[0] * law[2] * lift_change(t, i) : 0.0;
}

static void rub_change(const Tangent *t) {
    const Equations *q = t->q;
    Scratch *scratch = &t->sim->scratch;
    size_t mark = scratch->used;
    double *row = take(scratch, (size_t)q->system->n);
    Rows rubs = rub_rows(q->system);
    for (int k = 0; k < q->rub_slide_count; k++) {
        int i = q->rub_slides[k];
        row_jacobian(&rubs, i, t->e, row);
        add_scaled(q->system->n, -q->discrete.rubs[i] * limit_change(t, i), row, t->dx);
        add_pull(t, &rubs, i, rub_force(q, i));
    }
    scratch->used = mark;
}

/* Rows and columns: change of the right side by dR^T lam, -dR a and what convects. */
static void row_change(const Tangent *t) {
    const Equations *q = t->q;
    Rows walls = slide_rows(q->system);
    for (int k = 0; k < q->r; k++) {
        add_pull(t, &q->active, k, multiplier(t, k));
        t->dlam[k] = -second_change(t, &q->active, k);
    }
    for (int k = 0; k < q->sliding_count; k++) {
        int i = q->sliding[k];
        double share = -q->stop_friction[i] * q->discrete.slides[i];
        add_pull(t, &walls, i, share * multiplier(t, q->first_hold + held_at(q, i)));
    }
}

/* The pull on an arm is a torque; -i times it, along a stretch. */
static void apply_pull(const Tangent *t) {
    const System *system = t->q->system;
    for (int j = 0; j < system->n; j++) {
        int a = arm_of(system, j);
        t->dx[j] += a == j ? t->pull[j].re : t->pull[a].im;
    }
}

/* --- their outputs --- */

static void point_changes(const Tangent *t, const BodyFrame *frame, Complex *moved,
                          Complex *speed) {
    int n = t->q->system->n;
    *moved = along_arms(n, frame->A, t->dE);
    *speed = times_i(along_arms(n, frame->A, t->dswing));
}

static void body_changes(const Tangent *t, double *out) {
    for (int i = 0; i < t->q->system->b; i++) {
        const BodyFrame *frame = &t->q->system->bodies[i];
        double *d = out + PER_BODY * i;
        Complex moved, speed;
        point_changes(t, frame, &moved, &speed);
        d[0] = moved.re;
        d[1] = moved.im;
        d[2] = t->dq[frame->j];
        d[3] = speed.re;
        d[4] = speed.im;
        d[5] = t->dv[frame->j];
    }
}

static void probe_changes(const Tangent *t, double *out) {
    for (int i = 0; i < t->sim->mechanism->probe_count; i++) {
        double *d = out + PER_PROBE * i;
        Complex moved, speed;
        point_changes(t, &t->q->system->probes[i], &moved, &speed);
        d[0] = moved.re;
        d[1] = moved.im;
        d[2] = speed.re;
        d[3] = speed.im;
    }
}

static void link_changes(const Tangent *t, double *links, double *stretches_out) {
    const Mechanism *m = t->sim->mechanism;
    for (int k = 0; k < m->link_count; k++) {
        links[PER_LINK * k] = t->dq[m->links[k]];
        links[PER_LINK * k + 1] = t->dv[m->links[k]];
    }
    for (int k = 0; k < m->stretch_count; k++) {
        stretches_out[PER_STRETCH * k] = t->dq[m->stretches[k]];
        stretches_out[PER_STRETCH * k + 1] = t->dv[m->stretches[k]];
    }
}

/* Changes of displacement and velocity of a wall. */
static const double *wall_change(const Tangent *t, int i) {
    return wall_inputs(t->q->system->mechanism, t->du, i);
}

static double gap_change(const Tangent *t, int i) {
    const System *system = t->q->system;
    Rows gaps = gap_rows(system);
    return value_change(t, &gaps, i) + wall_change(t, i)[0];
}

static double gap_rate_change(const Tangent *t, int i) {
    const System *system = t->q->system;
    Rows gaps = gap_rows(system);
    return rate_change(t, &gaps, i) + wall_change(t, i)[1];
}

static void stop_changes(const Tangent *t, double *out) {
    for (int i = 0; i < t->q->system->s; i++) {
        out[PER_STOP * i] = gap_change(t, i);
        out[PER_STOP * i + 1] = gap_rate_change(t, i);
    }
    for (int k = 0; k < t->q->held_count; k++) {
        out[PER_STOP * t->q->held[k] + 2] = multiplier_change(t, t->q->first_hold + k);
    }
    for (int i = 0; i < t->q->system->s; i++) {
        const double *wall = wall_change(t, i);
        out[PER_STOP * i + 3] = wall[0] - out[PER_STOP * i];
        out[PER_STOP * i + 4] = wall[1] - out[PER_STOP * i + 1];
    }
}

/* dbend, complete with the change of the accelerations. */
static void bend_arms(const Tangent *t) {
    Complex *dalpha = t->pull; /* which has been applied */
    turning(t->q->system, t->dx, dalpha);
    for (int j = 0; j < t->q->system->n; j++) {
        t->dbend[j] = plus(t->dbend[j], times_i(product(t->e[j], dalpha[j])));
    }
}

static void base_changes(const Tangent *t, double *out) {
    const System *system = t->q->system;
    const Mechanism *m = system->mechanism;
    int n = system->n;
    const double *base = t->du + m->input.base, *given = t->q->inputs.forces;
    Complex field = minus(system->gravity, t->q->inputs.base), force = {0.0, 0.0};
    double moment = 0.0;
    for (int i = 0; i < system->p; i++) {
        const Complex *A = system->A + i * n;
        Complex z = plus(along_arms(n, A, t->e), minus(system->c[i], system->anchor));
        Complex dz = along_arms(n, A, t->dE), dbend = along_arms(n, A, t->dbend);
        Complex load = scaled(system->m[i], minus(field, along_arms(n, A, t->bend)));
        Complex change = scaled(-system->m[i], plus(complex_of(base[0], base[1]), dbend));
        force = plus(force, change);
        moment += product(conjugate(dz), load).im + product(conjugate(z), change).im;
    }
    for (int j = 0; j < n; j++) {
        moment -= system->J[j] * t->dx[j];
    }
    for (int i = 0; i < m->force_count; i++) {
        const BodyFrame *frame = &system->pushed[i];
        const double *df = t->du + LOADS * i, *f = given + LOADS * i;
        Complex z = plus(along_arms(n, frame->A, t->e), minus(frame->c, system->anchor));
        Complex dz = along_arms(n, frame->A, t->dE);
        force = plus(force, complex_of(df[0], df[1]));
        moment += product(conjugate(dz), complex_of(f[0], f[1])).im +
                  product(conjugate(z), complex_of(df[0], df[1])).im + df[2];
    }
    out[0] = force.re;
    out[1] = force.im;
    out[2] = moment;
}

/* Change of the kinetic energy, Re(d(E w)^H H (E w)) and what the bodies' own inertia adds. */
static double kinetic_change(const Tangent *t) {
    double sum = 0.0;
    for (int i = 0; i < t->q->system->n; i++) {
        sum += product(conjugate(t->dswing[i]), through_mass(t, i, t->swing)).re;
        sum += t->q->system->J[i] * t->v[i] * t->dv[i];
    }
    return sum;
}

static void energy_changes(const Tangent *t, const double *dx, double *out) {
    const System *system = t->q->system;
    int n = system->n, count = system->mechanism->independent_count;
    out[0] = kinetic_change(t);
    for (int i = 0; i < n; i++) {
        for (int j = 0; j < n; j++) {
            out[1] += (t->y[i] - system->q0[i]) * system->K[i * n + j] * t->dq[j];
        }
    }
    out[2] = -product(conjugate(system->gravity), along_arms(n, system->S, t->dE)).re;
    out[3] = dx[2 * count];
    out[4] = dx[2 * count + 1];
}

/* The same arms, which move at the rates x (n,) that do not change. */
static Tangent at_rates(const Tangent *t, const double *x) {
    Scratch *scratch = &t->sim->scratch;
    int n = t->q->system->n;
    Tangent u = *t;
    Complex **arrays[] = {&u.w, &u.dw, &u.swing, &u.dswing};
    for (size_t i = 0; i < sizeof arrays / sizeof *arrays; i++) {
        *arrays[i] = take_complex(scratch, n, 1);
    }
    u.v = x;
    u.dv = take(scratch, (size_t)n);
    zeros(n, u.dv);
    turning(t->q->system, x, u.w);
    turning(t->q->system, u.dv, u.dw);
    for (int j = 0; j < n; j++) {
        Arm arm = arm_at(&u, j);
        u.swing[j] = product(arm.E, arm.w);
        u.dswing[j] = swing_change(&arm);
    }
    return u;
}

/* Change of the mobility G X of a hit point, M X + R^T mu = G^T, R X = 0 with the rows R of the
 * loops: 2 dG X - X^T dM X - 2 mu^T dR X. */
static bool mobility_change(const Tangent *t, int i, double *result, Problem *problem) {
    Simulation *sim = t->sim;
    const System *system = &sim->system;
    size_t mark = sim->scratch.used;
    int n = system->n, r = system->r, size = n + r;
    double *kkt = take_matrix(&sim->scratch, size, size), *x = take(&sim->scratch, (size_t)size);
    Rows gaps = gap_rows(system), loops = plain_rows(system, r, system->loops, system->loops_c);
    Here here = mass_and_loops(sim, t->y);
    row_jacobian(&gaps, i, here.e, x);
    zeros(r, x + n);
    saddle(n, r, here.M, here.loops, here.loops, kkt);
    bool right = solve(size, kkt, x, &sim->scratch, problem);
    if (right) {
        Tangent u = at_rates(t, x);
        double change = rate_change(&u, &gaps, i) - kinetic_change(&u);
        for (int k = 0; k < r; k++) {
            change -= x[n + k] * rate_change(&u, &loops, k);
        }
        *result = 2.0 * change;
    }
    sim->scratch.used = mark;
    return right;
}

static double dissipation_change(const Tangent *t) {
    const Equations *q = t->q;
    const System *system = q->system;
    Rows walls = slide_rows(system), rubs = rub_rows(system);
    int n = system->n;
    double sum = 2.0 * q->mass_damping * kinetic_change(t);
    for (int i = 0; i < n; i++) {
        for (int j = 0; j < n; j++) {
            sum += 2.0 * q->beta * t->v[i] * system->K[i * n + j] * t->dv[j];
        }
    }
    for (int k = 0; k < q->rub_slide_count; k++) {
        int i = q->rub_slides[k];
        double change = -q->discrete.rubs[i] * limit_change(t, i);
        sum -= change * row_rate(&rubs, i, t->e, t->v) + rub_force(q, i) * rate_change(t, &rubs, i);
    }
    for (int k = 0; k < q->sliding_count; k++) {
        int i = q->sliding[k], h = q->first_hold + held_at(q, i);
        sum += q->stop_friction[i] * q->discrete.slides[i] *
               (multiplier_change(t, h) * row_rate(&walls, i, t->e, t->v) +
                multiplier(t, h) * rate_change(t, &walls, i));
    }
    return sum;
}

static double power_change(const Tangent *t, const Complex *dw, const double *dmoment) {
    const Equations *q = t->q;
    const System *system = q->system;
    int n = system->n;
    double sum = along_arms(n, dw, t->swing).re + along_arms(n, q->w_input, t->dswing).re;
    for (int j = 0; j < n; j++) {
        sum += dmoment[j] * t->v[j] + q->moment[j] * t->dv[j];
    }
    for (int k = 0; k < q->held_count; k++) {
        int i = q->held[k], h = q->first_hold + k;
        double velocity = wall_change(t, i)[1];
        sum -= multiplier_change(t, h) * q->inputs.walls[i].rate + multiplier(t, h) * velocity;
    }
    return sum;
}

/* Change of |x|; at zero, where it has two, their mean. */
static double sign_times(double x, double change) {
    return x < 0.0 ? -change : x > 0.0 ? change : 0.0;
}

static void indicator_changes(const Tangent *t, double *out) {
    const Simulation *sim = t->sim;
    const Equations *q = t->q;
    const System *system = q->system;
    Rows walls = slide_rows(system), points = rub_rows(system);
    double *rubs = out + STOP_INDICATORS * system->s;
    for (int i = 0; i < system->s; i++) {
        if (sim->holds[i] == 0.0) {
            bool opens = gap_rate(q, i, t->e, t->v) > 0.0;
            double ahead = opens ? FORESIGHT * period(sim) * gap_rate_change(t, i) : 0.0;
            out[STOP_INDICATORS * i] = (gap_change(t, i) + ahead) / system->length;
        }
    }
    for (int k = 0; k < q->held_count; k++) {
        int i = q->held[k];
        double velocity = wall_change(t, i)[1];
        bool pressed = margin_release(sim, k) / force_scale(sim) <= release_indicator(sim, k);
        out[STOP_INDICATORS * i + 1] =
            pressed ? multiplier_change(t, q->first_hold + k) / force_scale(sim)
                    : -sign_times(wall_turn(sim, i), velocity) / speed_scale(sim);
    }
    for (int k = 0; k < q->stuck_count; k++) {
        int i = q->stuck[k], h = q->first_hold + held_at(q, i), s = q->first_stick + k;
        double limit = (1.0 + SLACK) * (q->stop_friction[i] * multiplier_change(t, h));
        double friction = sign_times(multiplier(t, s), multiplier_change(t, s));
        out[STOP_INDICATORS * i + 2] = (limit - friction) / force_scale(sim);
    }
    for (int k = 0; k < q->sliding_count; k++) {
        int i = q->sliding[k];
        double change = rate_change(t, &walls, i);
        out[STOP_INDICATORS * i + 2] = q->discrete.slides[i] * change / speed_scale(sim);
    }
    for (int k = 0; k < q->rubbing_count; k++) {
        int i = q->rubbing[k], s = q->first_rub + k;
        double friction = sign_times(multiplier(t, s), multiplier_change(t, s));
        rubs[i] = ((1.0 + SLACK) * limit_change(t, i) - friction) / force_scale(sim);
    }
    for (int k = 0; k < q->rub_slide_count; k++) {
        int i = q->rub_slides[k];
        double change = rate_change(t, &points, i);
        rubs[i] = q->discrete.rubs[i] * change / speed_scale(sim);
    }
}

static void all_changes(const Tangent *t, const double *dx, const Complex *dw,
                        const double *dmoment, double *out) {
    const Mechanism *m = t->sim->mechanism;
    const Slots *slots = &m->slots;
    zeros(slots->count, out);
    copy(m->input_count, t->du, out + slots->inputs);
    body_changes(t, out + slots->bodies);
    probe_changes(t, out + slots->probes);
    link_changes(t, out + slots->links, out + slots->stretches);
    stop_changes(t, out + slots->stops);
    base_changes(t, out + slots->base);
    energy_changes(t, dx, out + slots->energies);
    for (int k = 0; k < m->independent_count; k++) {
        out[slots->derivatives + k] = t->dx[m->independent[k]];
    }
    double *powers = out + slots->derivatives + m->independent_count;
    powers[0] = dissipation_change(t);
    powers[1] = power_change(t, dw, dmoment);
    indicator_changes(t, out + slots->indicators);
}

/* Room for the changes, and what they are changes of. */
static Tangent begin_tangent(Simulation *sim, const double *du) {
    const Equations *q = &sim->equations;
    Scratch *scratch = &sim->scratch;
    int n = sim->system.n;
    Tangent t = {sim, q, q->e, sim->at, sim->at + n, q->x, du, NULL, NULL, NULL, NULL,
                 NULL, NULL, NULL, NULL, NULL, NULL, NULL, NULL, NULL, NULL};
    Complex **arrays[] = {&t.w, &t.alpha, &t.dphi, &t.dw, &t.dE,
                          &t.swing, &t.dswing, &t.bend, &t.dbend, &t.pull};
    for (size_t i = 0; i < sizeof arrays / sizeof *arrays; i++) {
        *arrays[i] = take_complex(scratch, n, 1);
    }
    t.dq = take(scratch, (size_t)n);
    t.dv = take(scratch, (size_t)n);
    t.dx = take(scratch, (size_t)sim->system.even);
    t.dlam = take(scratch, (size_t)q->r);
    zeros(sim->system.even, t.dx);
    memset(t.pull, 0, (size_t)n * sizeof *t.pull);
    turning(&sim->system, t.v, t.w);
    turning(&sim->system, t.a, t.alpha);
    return t;
}

PRBM bool exchange_directional(Simulation *simulation, const double *dx, const double *du,
                               double *dvalues, Problem *problem) {
    Simulation *sim = simulation;
    size_t mark = sim->scratch.used;
    if (!evaluate_motion(sim, problem)) {
        return false;
    }
    Tangent t = begin_tangent(sim, du);
    double *dmoment = take(&sim->scratch, (size_t)sim->system.n);
    Complex *dw = take_complex(&sim->scratch, sim->system.n, 1);
    bool right = tangent_coordinates(&t, dx, problem);
    if (right) {
        load_row_change(&t, dw, dmoment);
        arm_load_change(&t, dw);
        coordinate_load_change(&t, dmoment);
        rub_change(&t);
        row_change(&t);
        apply_pull(&t);
        solve_again(&t.q->factors, t.dx, t.dlam);
        bend_arms(&t);
        all_changes(&t, dx, dw, dmoment, dvalues);
    }
    for (int i = 0; right && i < sim->system.s; i++) {
        right = mobility_change(&t, i, dvalues + sim->mechanism->slots.stops + PER_STOP * i + 5,
                                problem);
    }
    sim->scratch.used = mark;
    return right;
}

/* --- values ----------------------------------------------------------------------------------- */

/* A derivative or an indicator by its slot; in co-simulation they are evaluated where it is. */
PRBM bool exchange_value(Simulation *sim, int slot, double *x, Problem *problem) {
    const Mechanism *m = sim->mechanism;
    const Slots *slots = &m->slots;
    size_t mark = sim->scratch.used;
    int n = sim->system.n, count = m->independent_count;
    double *z = take(&sim->scratch, (size_t)exchange_indicators(sim));
    bool right;
    if (slot >= slots->indicators) {
        right = exchange_event_indicators(sim, z, problem);
        *x = right ? z[slot - slots->indicators] : 0.0;
    } else {
        right = evaluate_motion(sim, problem);
        int k = slot - slots->derivatives;
        *x = sim->rates[k < count ? n + m->independent[k] : 2 * n + k - count];
    }
    sim->scratch.used = mark;
    return right;
}
