/* The stops that hold: of the twin of hybrid/contact_modes.py. */
#include <math.h>
#include <string.h>

#include "hybrid/configuration.h"
#include "hybrid/holding_stops.h"
#include "hybrid/impacts.h"
#include "hybrid/rest.h"
#include "hybrid/simulation.h"

/* Set up the trial equations in the trial's contact state. */
PRBM void try_contacts(Simulation *sim) {
    set_equations(&sim->trial.equations, &sim->equations.inputs, &sim->trial.contacts,
                  sim->configuration.omega);
}

PRBM bool evaluate_trial(Simulation *sim, const double *q, const double *v, Problem *problem) {
    return evaluate_equations(&sim->trial.equations, sim->state.front_time, q, v, NULL,
                              &sim->trial.evaluation, problem);
}

/* The mode of a closed contact with a sliding velocity, CONTACT_FRICTIONLESS at round-off. */
PRBM ContactMode slip_mode(const Simulation *sim, double speed) {
    return fabs(speed) <= zero_speed(&sim->configuration) ? CONTACT_FRICTIONLESS
                                                          : slipping_mode(speed);
}

/* The stops that touch, and the rows of all gaps. */
typedef struct {
    int count, stops[STOPS_MAX];
    const double *q, *v;
    Inertia at;
    double *G; /* (s, n) */
} Touching;

/* The next of the sets of so many out of k, in lexical order; false after the last. */
static bool next_set(int k, int size, int *members) {
    int i = size - 1;
    while (i >= 0 && members[i] == k - size + i) {
        i--;
    }
    if (i < 0) {
        return false;
    }
    members[i]++;
    for (int j = i + 1; j < size; j++) {
        members[j] = members[j - 1] + 1;
    }
    return true;
}

/* Whether each of the rows keeps a mobility of its own beside the rows before it. */
static bool independent_rows(Simulation *sim, int count, const double *rows, const Inertia *at,
                             bool *result, Problem *problem) {
    size_t mark = sim->scratch.used;
    int n = system_of(sim)->n, r = system_of(sim)->r;
    double *held = take_matrix(&sim->scratch, r + count, n);
    bool right = true;
    *result = true;
    copy(r * n, at->loops, held);
    copy(count * n, rows, held + r * n);
    for (int k = 1; right && *result && k < count; k++) {
        double left, own;
        right = mobility(sim, at, r + k, held, rows + k * n, &left, problem) &&
                mobility(sim, at, r, at->loops, rows + k * n, &own, problem);
        *result = right && left > DEPENDENT_STOP_RTOL * own;
    }
    sim->scratch.used = mark;
    return right;
}

PRBM const Equations *equations_holding(Simulation *sim, const HoldingSet *resting,
                                        const double *q, const double *v) {
    size_t mark = sim->scratch.used;
    const System *system = system_of(sim);
    Complex *e = directions_at(sim, q);
    for (int contact = 0; contact < contact_count(sim); contact++) {
        bool open = is_stop(system, contact) &&
                    !has_contact(resting->count, resting->stops, contact);
        double speed = sliding_velocity(system, contact, e, v);
        sim->trial.contacts.modes[contact] = open ? CONTACT_OPEN : slip_mode(sim, speed);
    }
    sim->scratch.used = mark;
    try_contacts(sim);
    return &sim->trial.equations;
}

/* Whether all stops of a set are pressed, and at which acceleration the other stops open. */
static bool try_set(Simulation *sim, const Touching *touching, HoldingSet *tried, bool *pressed,
                    Problem *problem) {
    size_t mark = sim->scratch.used;
    const Equations *q = &sim->trial.equations;
    const Evaluation *evaluation = &sim->trial.evaluation;
    int n = system_of(sim)->n;
    double *rows = take_matrix(&sim->scratch, tried->count, n);
    bool independent;
    for (int k = 0; k < tried->count; k++) {
        copy(n, touching->G + tried->stops[k] * n, rows + k * n);
    }
    *pressed = false;
    tried->opening = HUGE_VAL;
    bool right = independent_rows(sim, tried->count, rows, &touching->at, &independent, problem);
    sim->scratch.used = mark;
    if (!right || !independent) {
        return right;
    }
    equations_holding(sim, tried, touching->q, touching->v);
    if (!evaluate_trial(sim, touching->q, touching->v, problem)) {
        return false;
    }
    *pressed = true;
    for (int k = 0; k < q->held_count; k++) {
        *pressed = *pressed && evaluation->lam[q->first_hold + k] > 0.0;
    }
    for (int k = 0; k < touching->count; k++) {
        int i = touching->stops[k];
        if (sim->trial.contacts.modes[i] == CONTACT_OPEN) {
            double opening = gap_acceleration(q, i, sim->state.front_time, touching->at.e,
                                              touching->v, evaluation->a);
            tried->opening = lesser(tried->opening, opening);
        }
    }
    tried->opening = tried->count == touching->count ? 0.0 : tried->opening;
    return true;
}

/* The set of a size whose stops are all pressed and whose other stops open fastest; without one its
 * opening is -HUGE_VAL. */
static bool best_set(Simulation *sim, const Touching *touching, int size, HoldingSet *best,
                     Problem *problem) {
    int members[RESTING_SETS_MAX];
    HoldingSet none = {0, {0}, -HUGE_VAL, false}, tried = none;
    bool right = true;
    *best = none;
    for (int k = 0; k < size; k++) {
        members[k] = k;
    }
    do {
        bool pressed;
        tried.count = size;
        for (int k = 0; k < size; k++) {
            tried.stops[k] = touching->stops[members[k]];
        }
        right = try_set(sim, touching, &tried, &pressed, problem);
        if (right && pressed && tried.opening > best->opening) {
            *best = tried;
        }
    } while (right && next_set(touching->count, size, members));
    return right;
}

static void find_touching(Simulation *sim, int count, const int *candidates, Touching *touching) {
    const System *system = system_of(sim);
    Rows gaps = gap_rows(system);
    touching->count = 0;
    for (int i = 0; i < system->s; i++) {
        if (has_contact(count, candidates, i)) {
            touching->stops[touching->count++] = i;
        }
    }
    touching->at = inertia_at(sim, touching->q);
    touching->G = take_matrix(&sim->scratch, system->s, system->n);
    jacobian(&gaps, touching->at.e, touching->G);
}

/* The stops that are pressed where nothing but what slides has friction, as the only set left. */
static bool pressed_stops(Simulation *sim, const Touching *touching, HoldingSet *best,
                          Problem *problem) {
    double zero = zero_acceleration(&sim->configuration);
    HoldingSet every = {touching->count, {0}, 0.0, false}, none = {0, {0}, -HUGE_VAL, false};
    RestContacts rest;
    RestForces found;
    bool pressed = false;
    *best = none;
    rest.stop_count = touching->count;
    rest.count = 0;
    memcpy(every.stops, touching->stops, sizeof every.stops);
    memcpy(rest.stops, touching->stops, sizeof rest.stops);
    equations_holding(sim, &every, touching->q, touching->v);
    for (int k = 0; k < touching->count; k++) {
        rest.slips[k] = slip_sign(sim->trial.contacts.modes[touching->stops[k]]);
    }
    equations_holding(sim, &none, touching->q, touching->v);
    if (!rest_forces(sim, touching->q, touching->v, &rest, &found, problem)) {
        return false;
    }
    for (int k = 0; found.solved && k < touching->count; k++) {
        if (found.normal[k] > zero) {
            best->stops[best->count++] = touching->stops[k];
        }
    }
    bool right = try_set(sim, touching, best, &pressed, problem);
    best->opening = pressed ? best->opening : -HUGE_VAL;
    return right;
}

/* The largest set of the candidates whose stops are pressed while the others open; what slides
 * has friction.  Of stops that can move only together one stays closed: that which keeps the
 * others from closing. */
PRBM bool find_holding_stops(Simulation *sim, int count, const int *candidates, const double *q,
                             const double *v, HoldingSet *resting, Problem *problem) {
    size_t mark = sim->scratch.used;
    double closes = -zero_acceleration(&sim->configuration);
    Touching touching;
    touching.q = q;
    touching.v = v;
    find_touching(sim, count, candidates, &touching);
    HoldingSet none = {0, {0}, 0.0, touching.count == 0};
    int most = touching.count <= RESTING_SETS_MAX ? touching.count : -1;
    bool right = true;
    *resting = none;
    for (int size = most; right && !resting->found && size >= 0; size--) {
        right = best_set(sim, &touching, size, resting, problem);
        resting->found = right && resting->opening >= closes;
    }
    if (right && !resting->found) {
        right = pressed_stops(sim, &touching, resting, problem);
        resting->found = right && resting->opening >= closes;
    }
    sim->scratch.used = mark;
    return right;
}

PRBM bool holding_stops(Simulation *sim, int count, const int *candidates, const double *q,
                       const double *v, HoldingSet *resting, Problem *problem) {
    return find_holding_stops(sim, count, candidates, q, v, resting, problem) &&
           (resting->found || contacts_jammed(sim, count, candidates, problem));
}

