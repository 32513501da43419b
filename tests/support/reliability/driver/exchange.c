/* Legal and illegal calls of model exchange: a small integrator that locates events. */
#include "driver.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { STAGES = 4, BISECTIONS = 40 };

typedef struct {
    Subject *s;
    size_t n, m;
    double *x, *k, *trial, *z, *z_new;
} Solver;

static bool solver_open(Solver *solver, Subject *s) {
    size_t n = s->job->state_count, m = s->job->indicator_count;
    solver->s = s;
    solver->n = n;
    solver->m = m;
    solver->x = calloc((2 + STAGES) * n + 2 * m + 1, sizeof(double));
    solver->k = solver->x + n;
    solver->trial = solver->k + STAGES * n;
    solver->z = solver->trial + n;
    solver->z_new = solver->z + m;
    return solver->x != NULL;
}

static void check_finite(Subject *s, const double *x, size_t count, const char *noun) {
    for (size_t i = 0; i < count; i++) {
        if (!isfinite(x[i])) {
            violated(s, NOT_FINITE, "%s %lu is %g", noun, (unsigned long)i, x[i]);
            return;
        }
    }
}

static bool derivatives(Solver *solver, double time, const double *x, double *dx) {
    Subject *s = solver->s;
    if (!FINE(BOTH(SetTime, (s->c, time))) ||
        !FINE(BOTH(SetContinuousStates, (s->c, x, solver->n))) ||
        !FINE(EITHER(GetDerivatives, (s->c, dx, solver->n), GetContinuousStateDerivatives,
                     (s->c, dx, solver->n)))) {
        return false;
    }
    check_finite(s, dx, solver->n, "derivative");
    return true;
}

static bool indicators(Solver *solver, double *z) {
    Subject *s = solver->s;
    if (!FINE(BOTH(GetEventIndicators, (s->c, z, solver->m)))) {
        return false;
    }
    check_finite(s, z, solver->m, "event indicator");
    return true;
}

/* Make a step of the classical Runge-Kutta method to the trial states; read the indicators. */
static bool runge_kutta(Solver *solver, double h) {
    static const double fractions[STAGES] = {0.0, 0.5, 0.5, 1.0};
    double time = solver->s->time, *trial = solver->trial, *k = solver->k;
    size_t n = solver->n;
    for (int stage = 0; stage < STAGES; stage++) {
        const double *from = stage ? k + (size_t)(stage - 1) * n : k;
        for (size_t i = 0; i < n; i++) {
            trial[i] = solver->x[i] + fractions[stage] * h * (stage ? from[i] : 0.0);
        }
        if (!derivatives(solver, time + fractions[stage] * h, trial, k + (size_t)stage * n)) {
            return false;
        }
    }
    for (size_t i = 0; i < n; i++) {
        trial[i] = solver->x[i] +
                   h / 6.0 * (k[i] + 2.0 * k[n + i] + 2.0 * k[2 * n + i] + k[3 * n + i]);
    }
    Subject *s = solver->s;
    return FINE(BOTH(SetTime, (s->c, time + h))) &&
           FINE(BOTH(SetContinuousStates, (s->c, trial, n))) && indicators(solver, solver->z_new);
}

static bool crossed(const Solver *solver) {
    for (size_t i = 0; i < solver->m; i++) {
        if ((solver->z[i] > 0.0) != (solver->z_new[i] > 0.0)) {
            return true;
        }
    }
    return false;
}

static bool refresh(Solver *solver) {
    Subject *s = solver->s;
    return FINE(BOTH(GetContinuousStates, (s->c, solver->x, solver->n))) &&
           indicators(solver, solver->z);
}

/* Go through Event Mode; without changes it keeps the energy balance. */
static bool event(Solver *solver, bool changes) {
    Subject *s = solver->s;
    s->counts->events++;
    if (!FINE(BOTH(EnterEventMode, (s->c)))) {
        return false;
    }
    if (changes) {
        change_some(s, chance(&s->random, 3) ? "t" : "u", 3);
    } else {
        subject_new_reference(s);
        subject_observe(s);
    }
    s->judges_energy = !changes;
    if (!FINE(subject_update(s))) {
        return false;
    }
    subject_observe(s);
    s->judges_energy = false;
    return FINE(BOTH(EnterContinuousTimeMode, (s->c))) && refresh(solver);
}

/* Advance by a step or to the first event in it. */
static bool advance(Solver *solver, double h) {
    Subject *s = solver->s;
    bool asked = false, terminate = false;
    fmi2Boolean asked2 = fmi2False, terminate2 = fmi2False;
    s->counts->steps++;
    if (!runge_kutta(solver, h)) {
        return false;
    }
    bool found = crossed(solver);
    if (found) {
        double low = 0.0, high = h;
        for (int i = 0; i < BISECTIONS && high - low > 1e-13; i++) {
            double middle = 0.5 * (low + high);
            if (!runge_kutta(solver, middle)) {
                return false;
            }
            *(crossed(solver) ? &high : &low) = middle;
        }
        h = high;
        if (!runge_kutta(solver, h)) {
            return false;
        }
    }
    s->time += h;
    s->judges_gaps = s->keeps_walls;
    memcpy(solver->x, solver->trial, solver->n * sizeof *solver->x);
    memcpy(solver->z, solver->z_new, solver->m * sizeof *solver->z);
    if (!FINE(EITHER(CompletedIntegratorStep, (s->c, fmi2True, &asked2, &terminate2),
                     CompletedIntegratorStep, (s->c, true, &asked, &terminate)))) {
        return false;
    }
    bool good = found || asked || asked2 ? event(solver, false) : (subject_observe(s), true);
    s->judges_gaps = false;
    return good;
}

static void directional(Solver *solver) {
    Subject *s = solver->s;
    uint32_t known = s->plan->variables[pick(s, "u")].reference;
    uint32_t unknown = s->references[below(&s->random, (unsigned)s->reals)];
    double seed = uniform(&s->random, -1.0, 1.0), result = 0.0;
    int status = EITHER(GetDirectionalDerivative, (s->c, &unknown, 1, &known, 1, &seed, &result),
                        GetDirectionalDerivative,
                        (s->c, &unknown, 1, &known, 1, &seed, 1, &result, 1));
    if (FINE(status)) {
        check_finite(s, &result, 1, "directional derivative");
    }
}

/* Disturb the states as an implicit solver does for its Jacobian, by more at times. */
static void disturb(Solver *solver) {
    Subject *s = solver->s;
    double size = chance(&s->random, 4) ? pow(10.0, uniform(&s->random, 0.0, 12.0)) : 1e-6;
    memcpy(solver->trial, solver->x, solver->n * sizeof *solver->x);
    solver->trial[below(&s->random, (unsigned)solver->n)] += uniform(&s->random, -size, size);
    if (derivatives(solver, s->time, solver->trial, solver->k)) {
        subject_observe(s);
        (void)indicators(solver, solver->z_new);
    }
    (void)BOTH(SetContinuousStates, (s->c, solver->x, solver->n));
}

static bool act(Solver *solver) {
    Subject *s = solver->s;
    switch (below(&s->random, 20)) {
    case 0: directional(solver); return true;
    case 1: disturb(solver); return true;
    case 2: illegal_call(s); return true;
    case 3: return event(solver, chance(&s->random, 2));
    default: return advance(solver, s->job->substep * uniform(&s->random, 0.3, 1.0));
    }
}

void integrated_calls(Subject *s, size_t actions) {
    Solver solver;
    if (!subject_instantiate(s)) {
        return;
    }
    s->keeps_walls = chance(&s->random, 2);
    if (chance(&s->random, 2)) {
        change_some(s, "pt", 3);
    }
    bool good = FINE(subject_enter(s)) && FINE(subject_exit(s)) && solver_open(&solver, s);
    s->counts->outcomes[good ? RAN : REJECTED_AT_START]++;
    if (good) {
        subject_observe(s);
        good = refresh(&solver);
        for (size_t i = 0; good && i < actions; i++) {
            good = act(&solver);
        }
        s->counts->outcomes[REJECTED_LATER] += !good;
        free(solver.x);
    }
    subject_free(s);
}
