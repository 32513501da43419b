/* The coordinates that the loops determine.
 *
 * The r loop equations are solved for r of the n coordinates.  The other n - r coordinates, chosen
 * by mechanics/independent.py, are states of model exchange.  A solver that does not support
 * constraints can therefore integrate them without opening the loops. */
#include <math.h>

#include "hybrid/access.h"
#include "dependents.h"

/* List the coordinates that are not independent, in ascending order. */
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

PRBM int coordinate_slot(const Mechanism *m, int j, bool rate) {
    const Coordinate *c = &m->coordinates[j];
    if (c->strain >= 0) {
        int quantity = rate ? STRETCH_STRAIN_RATE : STRETCH_STRAIN;
        return m->slots.stretches + PER_STRETCH * c->strain + quantity;
    }
    if (c->link >= 0) {
        return m->slots.links + PER_LINK * c->link + (rate ? LINK_OMEGA : LINK_ANGLE);
    }
    const int values[] = {BODY_X, BODY_Y, BODY_ANGLE}, rates[] = {BODY_VX, BODY_VY, BODY_OMEGA};
    int quantity = c->axis < 0 ? SHIFTS_EACH : c->axis;
    return m->slots.bodies + PER_BODY * (c->body - 1) + (rate ? rates : values)[quantity];
}

static const char *coordinate_name(const Mechanism *m, int j) {
    int slot = coordinate_slot(m, j, false);
    for (int i = 0; i < m->variable_count; i++) {
        if (m->variables[i].slot == slot) {
            return m->variables[i].name;
        }
    }
    return "an angle";
}

PRBM bool singular_choice(const Simulation *sim, const int *dependent, Problem *problem) {
    return fail(problem,
                "the states of model exchange do not determine the other coordinates (%s and %d "
                "more) at t = %.9g s: the shape is too far from the initial shape, or the solver's "
                "error is too large; shorten the solver's steps, or use co-simulation",
                coordinate_name(sim->configuration.mechanism, dependent[0]),
                system_of(sim)->r - 1, sim->state.time);
}

PRBM bool factor_dependents(const Simulation *sim, Loops *loops) {
    int r = system_of(sim)->r, n = system_of(sim)->n;
    double *a = loops->a;
    double least = HUGE_VAL, most = largest(r * n, loops->rows);
    for (int i = 0; i < r; i++) {
        for (int k = 0; k < r; k++) {
            a[i * r + k] = loops->rows[i * n + loops->dependent[k]];
        }
    }
    if (!lu_factor(r, a, loops->pivot)) {
        return false;
    }
    for (int i = 0; i < r; i++) {
        least = lesser(least, 1.0 / fabs(a[i * r + i])); /* lu_factor stores 1/diagonal. */
    }
    return least > DEPENDENT_PIVOT_RTOL * most;
}

PRBM Loops take_loops(const Simulation *sim, Scratch *scratch) {
    int r = system_of(sim)->r, n = system_of(sim)->n;
    Loops loops = {take_integers(scratch, r), take_integers(scratch, r),
                   take_matrix(scratch, r, n), take_matrix(scratch, r, r),
                   take(scratch, (size_t)r)};
    dependents(sim->configuration.mechanism, loops.dependent);
    return loops;
}

/* Solve the loops for the dependent angles; the angles in q are the first guess. */
static bool complete_angles(const Simulation *sim, Loops *x, double *q, Scratch scratch) {
    const System *system = system_of(sim);
    int r = system->r;
    double best = HUGE_VAL, length = system->length;
    bool closed = false, regular = true;
    Rows loops = loop_rows(system);
    Complex *e = take_complex(&scratch, system->d, 1);
    for (int step = 0; step < CONSTRAINT_ITERATIONS_MAX && regular && !closed; step++) {
        directions(system, q, e);
        scalars(&loops, e, x->s);
        double error = largest(r, x->s);
        closed = error <= CONSTRAINT_RTOL * length ||
                 (CONSTRAINT_STALLED_RTOL * length >= best && best <= error);
        best = lesser(best, error);
        jacobian(&loops, e, x->rows);
        regular = factor_dependents(sim, x);
        if (regular && !closed) {
            lu_solve(r, x->a, x->pivot, x->s);
            for (int k = 0; k < r; k++) {
                q[x->dependent[k]] -= x->s[k];
            }
        }
    }
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

/* Solve the loops for the dependent angles and rates; the angles in q are the first guess. */
PRBM bool complete(Simulation *sim, double *q, double *v, Problem *problem) {
    Scratch scratch = sim->scratch;
    Loops loops = take_loops(sim, &scratch);
    bool ok = complete_angles(sim, &loops, q, scratch);
    if (ok) {
        complete_rates(sim, &loops, v);
    }
    return ok || (system_of(sim)->r > 0
                      ? singular_choice(sim, loops.dependent, problem)
                      : fail(problem, "the states are not finite numbers"));
}

PRBM void states_of(const Simulation *sim, const double *y, double *x) {
    const Mechanism *m = sim->configuration.mechanism;
    int n = m->coordinate_count, count = m->independent_count;
    for (int k = 0; k < count; k++) {
        double unit_of = coordinate_unit(system_of(sim), m->independent[k]);
        x[k] = y[m->independent[k]] * unit_of;
        x[count + k] = y[n + m->independent[k]] * unit_of;
    }
    copy(2, y + 2 * n, x + 2 * count);
    for (int c = 0; c < m->compliant_count; c++) {
        const double *extra = extra_states(sim, y) + EXTRA_STATES * c;
        copy(EXCHANGED_STATES, extra + EXTRA_IMPULSE, x + 2 * count + 2 + EXCHANGED_STATES * c);
    }
}

PRBM void load_states(const Simulation *sim, const double *x, double *y) {
    const Mechanism *m = sim->configuration.mechanism;
    int n = m->coordinate_count, count = m->independent_count;
    for (int k = 0; k < count; k++) {
        double unit_of = coordinate_unit(system_of(sim), m->independent[k]);
        y[m->independent[k]] = x[k] / unit_of;
        y[n + m->independent[k]] = x[count + k] / unit_of;
    }
    copy(2, x + 2 * count, y + 2 * n);
    for (int c = 0; c < m->compliant_count; c++) {
        double *extra = y + m->first_extra + EXTRA_STATES * c;
        extra[EXTRA_RECOIL] = extra[EXTRA_RECOIL_RATE] = 0.0;
        copy(EXCHANGED_STATES, x + 2 * count + 2 + EXCHANGED_STATES * c, extra + EXTRA_IMPULSE);
    }
}
