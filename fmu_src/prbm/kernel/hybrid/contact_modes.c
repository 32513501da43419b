/* The choice of the contact state: the twin of hybrid/contact_modes.py. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "hybrid/hybrid.h"

enum { CONTACTS_MAX = 2 * STOPS_MAX };

/* Set up the trial equations in the trial's contact state. */
static void try_contacts(Simulation *sim) {
    set_equations(&sim->trial.equations, &sim->equations.inputs, &sim->trial.contacts,
                  sim->configuration.omega);
}

/* Set up the trial equations in the present contact state with one mode changed. */
static void try_mode(Simulation *sim, int contact, int mode) {
    size_t bytes = (size_t)contact_count(sim) * sizeof(int);
    memcpy(sim->trial.contacts.modes, sim->state.modes, bytes);
    sim->trial.contacts.modes[contact] = mode;
    try_contacts(sim);
}

static bool evaluate_trial(Simulation *sim, const double *q, const double *v, Problem *problem) {
    return evaluate_equations(&sim->trial.equations, sim->state.front_time, q, v, NULL, &sim->trial.evaluation, problem);
}

/* The mode of a closed contact with a sliding velocity, CONTACT_FRICTIONLESS at round-off. */
static int slip_mode(const Simulation *sim, double speed) {
    return fabs(speed) <= zero_speed(&sim->configuration) ? CONTACT_FRICTIONLESS
                                                          : slipping_mode(speed);
}

/* --- resting stops ---------------------------------------------------------------------------- */

/* The stops that touch, their rows and convective terms. */
typedef struct {
    int count, stops[RESTING_SETS_MAX];
    const double *q, *v;
    Inertia at;
    double *G, *convective; /* (s, n), (s,) */
} Touching;

static bool has_stop(int count, const int *stops, int stop) {
    for (int k = 0; k < count; k++) {
        if (stops[k] == stop) {
            return true;
        }
    }
    return false;
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

/* Set up the trial equations in which a set of stops is closed; what slides has friction. */
PRBM void equations_holding(Simulation *sim, const HoldingSet *resting, const double *q,
                      const double *v) {
    size_t mark = sim->scratch.used;
    const System *system = system_of(sim);
    Complex *e = directions_at(sim, q);
    for (int contact = 0; contact < contact_count(sim); contact++) {
        bool open = is_stop(system, contact) &&
                    !has_stop(resting->count, resting->stops, contact);
        double speed = sliding_velocity(system, contact, e, v);
        sim->trial.contacts.modes[contact] = open ? CONTACT_OPEN : slip_mode(sim, speed);
    }
    sim->scratch.used = mark;
    try_contacts(sim);
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
            double opening = dot(n, touching->G + i * n, evaluation->a) - touching->convective[i] +
                             wall_motion(&sim->state.walls[i], sim->state.front_time).a;
            tried->opening = lesser(tried->opening, opening);
        }
    }
    tried->opening = tried->count == touching->count ? 0.0 : tried->opening;
    return true;
}

/* The set of a size whose stops are all pressed and whose other stops open fastest; of count 0
 * without one. */
static bool best_set(Simulation *sim, const Touching *touching, int size, HoldingSet *best,
                     Problem *problem) {
    int members[RESTING_SETS_MAX];
    HoldingSet none = {0, {0}, -HUGE_VAL}, tried;
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
        if (right && pressed && (best->count == 0 || tried.opening > best->opening)) {
            *best = tried;
        }
    } while (right && next_set(touching->count, size, members));
    return right;
}

/* The names of stops, or as many of them as there is room for. */
static void list_stops(const Mechanism *m, int count, const int *stops, char *text, size_t size) {
    size_t length = 0;
    text[0] = '\0';
    for (int i = 0; i < m->stop_count; i++) {
        size_t needed = strlen(m->stops[i].name) + sizeof ", " + sizeof ", ...";
        if (!has_stop(count, stops, i)) {
            continue;
        }
        if (length + needed > size) {
            (void)snprintf(text + length, size - length, ", ...");
            return;
        }
        (void)snprintf(text + length, size - length, "%s%s", length > 0 ? ", " : "",
                       m->stops[i].name);
        length = strlen(text);
    }
}

/* Reject more stops than are tried in every combination. */
static bool too_many_resting(const Simulation *sim, int count, const int *stops,
                             Problem *problem) {
    char names[300];
    int many = 0;
    for (int i = 0; i < system_of(sim)->s; i++) {
        many += has_stop(count, stops, i);
    }
    list_stops(sim->configuration.mechanism, count, stops, names, sizeof names);
    return fail(problem,
                "%d stops rest at once at t = %.9g s (%s), more than the %d of which every "
                "combination can be tried; replace stops that touch together by one, or move them "
                "apart",
                many, sim->state.front_time, names, (int)RESTING_SETS_MAX);
}

static bool find_touching(Simulation *sim, int count, const int *candidates, Touching *touching,
                          Problem *problem) {
    const System *system = system_of(sim);
    Rows gaps = gap_rows(system);
    touching->count = 0;
    for (int i = 0; i < system->s; i++) {
        if (has_stop(count, candidates, i)) {
            if (touching->count == RESTING_SETS_MAX) {
                return too_many_resting(sim, count, candidates, problem);
            }
            touching->stops[touching->count++] = i;
        }
    }
    touching->at = inertia_at(sim, touching->q);
    touching->G = take_matrix(&sim->scratch, system->s, system->n);
    touching->convective = take(&sim->scratch, (size_t)system->s);
    jacobian(&gaps, touching->at.e, touching->G);
    for (int i = 0; i < system->s; i++) {
        touching->convective[i] = row_convective(&gaps, i, touching->at.e, touching->v);
    }
    return true;
}

/* The largest set of the candidates whose stops are pressed while the others open; what slides
 * has friction.  Of stops that can move only together one stays closed: that which keeps the
 * others from closing. */
PRBM bool holding_stops(Simulation *sim, int count, const int *candidates, const double *q,
                       const double *v, HoldingSet *resting, Problem *problem) {
    size_t mark = sim->scratch.used;
    const Scales *scales = &sim->configuration.scales;
    double closes = -ZERO_RATE_RTOL * scales->rate * scales->rate * scales->length;
    HoldingSet none = {0, {0}, 0.0}, pressed_only = none, best = none;
    Touching touching;
    touching.q = q;
    touching.v = v;
    bool found = false, right = find_touching(sim, count, candidates, &touching, problem);
    for (int size = right ? touching.count : 0; right && !found && size > 0; size--) {
        right = best_set(sim, &touching, size, &best, problem);
        found = right && best.count > 0 && best.opening >= closes;
        if (right && best.count > 0 && !found && pressed_only.count == 0) {
            pressed_only = best;
        }
    }
    *resting = found ? best : pressed_only;
    sim->scratch.used = mark;
    return right;
}

/* --- friction of one contact ------------------------------------------------------------------ */

/* The contact that an event of friction has, or -1: it slips and cannot stick, or its sliding has
 * ended with no more than a slow speed left. */
typedef struct {
    int contact;
    bool slips;
    double slow;
} FrictionEvent;

/* Whether a contact at rest has a mobility of its own beside the closed and sticking ones. */
static bool has_mobility(Simulation *sim, int contact, const Inertia *at, const double *row,
                         bool *result, Problem *problem) {
    size_t mark = sim->scratch.used;
    const System *system = system_of(sim);
    const Equations *q = &sim->trial.equations;
    double left = 0.0, own = 0.0;
    try_mode(sim, contact, CONTACT_FRICTIONLESS);
    double *held = take_matrix(&sim->scratch, q->r, system->n);
    jacobian(&q->active, at->e, held);
    bool right = mobility(sim, at, q->r, held, row, &left, problem) &&
                 mobility(sim, at, system->r, at->loops, row, &own, problem);
    *result = left > DEPENDENT_FRICTION_RTOL * own;
    sim->scratch.used = mark;
    return right;
}

/* Whether a contact that is at rest and may move sticks, or which way it slips. */
static bool mode_at_rest(Simulation *sim, int contact, const Inertia *at, const double *row,
                         bool slips, int *mode, Problem *problem) {
    const System *system = system_of(sim);
    const Evaluation *tried = &sim->trial.evaluation;
    const double *q = sim->state.front, *v = q + system->n;
    try_mode(sim, contact, CONTACT_STICK);
    if (!evaluate_trial(sim, q, v, problem)) {
        return false;
    }
    double friction = stick_force(&sim->trial.equations, tried->lam, contact);
    double limit = friction_limit(&sim->trial.equations, at->e, tried->lam, contact);
    *mode = CONTACT_STICK;
    if (fabs(friction) <= limit && !slips) {
        return true;
    }
    double convective = tangential_convective(system, contact, at->e, v);
    int first = friction > 0.0 ? -1 : 1;
    for (int attempts = 0; attempts < 2; attempts++) {
        int sign = attempts == 0 ? first : -first;
        try_mode(sim, contact, slipping_mode(sign));
        if (!evaluate_trial(sim, q, v, problem)) {
            return false;
        }
        if (sign * (dot(system->n, row, tried->a) - convective) > 0.0) {
            *mode = slipping_mode(sign);
            return true;
        }
    }
    *mode = slips ? CONTACT_FRICTIONLESS : CONTACT_STICK;
    return true;
}

/* The mode of a closed contact with friction.  It slips if it moves faster than slow.  At rest it
 * is frictionless where the loops and the closed stops leave it no mobility of its own: they
 * carry all of the load.  Else it sticks as far as Coulomb's law allows, and beyond slips in the
 * direction in which sliding accelerates it. */
static bool choose_mode(Simulation *sim, int contact, const FrictionEvent *event,
                        Problem *problem) {
    size_t mark = sim->scratch.used;
    const System *system = system_of(sim);
    bool this_one = event->contact == contact, mobile = false, right = true;
    double slow = this_one ? event->slow : 0.0, *row = take(&sim->scratch, (size_t)system->n);
    Inertia at = inertia_at(sim, sim->state.front);
    tangential_row(system, contact, at.e, row);
    double speed = dot(system->n, row, sim->state.front + system->n);
    int mode = fabs(speed) > slow ? slip_mode(sim, speed) : CONTACT_FRICTIONLESS;
    if (mode == CONTACT_FRICTIONLESS) {
        right = has_mobility(sim, contact, &at, row, &mobile, problem);
        if (right && mobile) {
            right = mode_at_rest(sim, contact, &at, row, this_one && event->slips, &mode, problem);
        }
    }
    sim->scratch.used = mark;
    if (right) {
        set_mode(sim, contact, mode);
    }
    return right;
}

/* --- friction of several contacts ------------------------------------------------------------- */

/* Whether a contact at rest has a mobility of its own beside what is closed and sticks now. */
static bool is_mobile(Simulation *sim, int contact, bool *result, Problem *problem) {
    size_t mark = sim->scratch.used;
    double *row = take(&sim->scratch, (size_t)system_of(sim)->n);
    Inertia at = inertia_at(sim, sim->state.front);
    tangential_row(system_of(sim), contact, at.e, row);
    bool right = has_mobility(sim, contact, &at, row, result, problem);
    sim->scratch.used = mark;
    return right;
}

/* Whether the forces and accelerations in the present contact state agree with its modes. */
static bool forces_agree(Simulation *sim, int count, const int *contacts, bool *result,
                         Problem *problem) {
    size_t mark = sim->scratch.used;
    const System *system = system_of(sim);
    const Equations *equations = &sim->trial.equations;
    const Evaluation *tried = &sim->trial.evaluation;
    const double *q = sim->state.front, *v = q + system->n;
    double *row = take(&sim->scratch, (size_t)system->n);
    Complex *e = directions_at(sim, q);
    memcpy(sim->trial.contacts.modes, sim->state.modes, (size_t)contact_count(sim) * sizeof(int));
    try_contacts(sim);
    bool right = evaluate_trial(sim, q, v, problem);
    for (int k = 0; right && *result && k < equations->held_count; k++) {
        *result = tried->lam[equations->first_hold + k] > 0.0;
    }
    for (int k = 0; right && *result && k < count; k++) {
        int contact = contacts[k], mode = sim->state.modes[contact];
        if (mode == CONTACT_STICK) {
            *result = fabs(stick_force(equations, tried->lam, contact)) <=
                      friction_limit(equations, e, tried->lam, contact);
        } else {
            tangential_row(system, contact, e, row);
            double convective = tangential_convective(system, contact, e, v);
            *result = slip_sign(mode) * (dot(system->n, row, tried->a) - convective) > 0.0;
        }
    }
    sim->scratch.used = mark;
    return right;
}

static bool state_agrees(Simulation *sim, int count, const int *contacts, bool *result,
                         Problem *problem) {
    *result = true;
    for (int k = 0; *result && k < count; k++) {
        if (sim->state.modes[contacts[k]] == CONTACT_STICK &&
            !is_mobile(sim, contacts[k], result, problem)) {
            return false;
        }
    }
    return !*result || forces_agree(sim, count, contacts, result, problem);
}

/* The contacts at rest that have a mobility beside the closed stops; all at rest are left without
 * friction. */
static bool mobile_at_rest(Simulation *sim, int count, const int *contacts,
                           const FrictionEvent *event, int *mobile_count, int *mobile,
                           Problem *problem) {
    size_t mark = sim->scratch.used;
    const System *system = system_of(sim);
    int n = system->n, resting = 0, at_rest[CONTACTS_MAX];
    bool right = true, moves = false;
    double *row = take(&sim->scratch, (size_t)n);
    Complex *e = directions_at(sim, sim->state.front);
    for (int k = 0; k < count; k++) {
        tangential_row(system, contacts[k], e, row);
        double speed = dot(n, row, sim->state.front + n);
        double slow = event->contact == contacts[k] ? event->slow : 0.0;
        if (fabs(speed) <= slow || slip_mode(sim, speed) == CONTACT_FRICTIONLESS) {
            at_rest[resting++] = contacts[k];
        }
    }
    sim->scratch.used = mark;
    for (int k = 0; k < resting; k++) {
        set_mode(sim, at_rest[k], CONTACT_FRICTIONLESS);
    }
    *mobile_count = 0;
    for (int k = 0; right && k < resting; k++) {
        right = is_mobile(sim, at_rest[k], &moves, problem);
        if (right && moves) {
            mobile[(*mobile_count)++] = at_rest[k];
        }
    }
    return right;
}

/* Set the modes of the c-th combination; false if the contact that slips would stick in it. */
static bool set_combination(Simulation *sim, int c, int count, const int *contacts,
                            const FrictionEvent *event) {
    static const int modes[3] = {CONTACT_STICK, CONTACT_SLIP_POSITIVE, CONTACT_SLIP_NEGATIVE};
    bool allowed = true;
    for (int k = count - 1, rest = c; k >= 0; k--, rest /= 3) {
        int mode = modes[rest % 3];
        set_mode(sim, contacts[k], mode);
        allowed = allowed && !(event->slips && event->contact == contacts[k] &&
                               mode == CONTACT_STICK);
    }
    return allowed;
}

/* Choose the modes of the contacts at rest together, if choosing them one by one does not end.  It
 * is the first combination in which sticking needs no more than its friction, slipping accelerates
 * in its direction, and all closed stops are pressed.  Without one, or with too many at rest, the
 * modes stay as they are. */
static bool settle_together(Simulation *sim, int count, const int *contacts,
                            const FrictionEvent *event, Problem *problem) {
    int kept[CONTACTS_MAX], mobile[CONTACTS_MAX], many, combinations = 1;
    size_t bytes = (size_t)contact_count(sim) * sizeof(int);
    bool found = false;
    memcpy(kept, sim->state.modes, bytes);
    if (!mobile_at_rest(sim, count, contacts, event, &many, mobile, problem)) {
        return false;
    }
    for (int k = 0; k < many && many <= STICKING_SETS_MAX; k++) {
        combinations *= 3;
    }
    for (int c = 0; many <= STICKING_SETS_MAX && !found && c < combinations; c++) {
        if (set_combination(sim, c, many, mobile, event) &&
            !state_agrees(sim, many, mobile, &found, problem)) {
            return false;
        }
    }
    if (!found) {
        set_contacts(sim, kept);
    }
    return true;
}

/* The closed contacts that have friction. */
static int contacts_with_friction(const Simulation *sim, int *contacts) {
    const System *system = system_of(sim);
    int count = 0;
    for (int contact = 0; contact < contact_count(sim); contact++) {
        double friction = is_stop(system, contact)
                              ? sim->equations.stop_friction[contact]
                              : sim->equations.rub_law[3 * (contact - system->s)];
        if (sim->state.modes[contact] != CONTACT_OPEN && friction > 0.0) {
            contacts[count++] = contact;
        }
    }
    return count;
}

/* Choose the modes one by one until none changes: one may change the mode of another. */
static bool settle_friction(Simulation *sim, const FrictionEvent *event, Problem *problem) {
    int before[CONTACTS_MAX], contacts[CONTACTS_MAX];
    int count = contacts_with_friction(sim, contacts);
    size_t bytes = (size_t)contact_count(sim) * sizeof(int);
    for (int round = 0; round <= count; round++) {
        memcpy(before, sim->state.modes, bytes);
        for (int k = 0; k < count; k++) {
            if (!choose_mode(sim, contacts[k], event, problem)) {
                return false;
            }
        }
        if (memcmp(before, sim->state.modes, bytes) == 0) {
            return true;
        }
    }
    return settle_together(sim, count, contacts, event, problem);
}

/* --- all -------------------------------------------------------------------------------------- */

/* The spacing of the numbers around x. */
static double spacing(double x) {
    int exponent;
    (void)frexp(x, &exponent);
    return ldexp(1.0, exponent - 53);
}

/* The sliding speed that the resolution of time leaves where sliding ends. */
static bool residual_speed(Simulation *sim, int contact, double *result, Problem *problem) {
    size_t mark = sim->scratch.used;
    const System *system = system_of(sim);
    Evaluation *evaluation = &sim->trial.evaluation;
    const double *q = sim->state.front, *v = q + system->n;
    if (!evaluate_equations(&sim->equations, sim->state.front_time, q, v, NULL, evaluation, problem)) {
        return false;
    }
    double *row = take(&sim->scratch, (size_t)system->n);
    Complex *e = directions_at(sim, q);
    tangential_row(system, contact, e, row);
    double rate = dot(system->n, row, evaluation->a) - tangential_convective(system, contact, e, v);
    *result = fabs(rate) * (2 * EVENT_TIME_ATOL + 8 * spacing(sim->state.front_time));
    sim->scratch.used = mark;
    return true;
}

static bool friction_event(Simulation *sim, const Event *event, FrictionEvent *result,
                           Problem *problem) {
    FrictionEvent none = {-1, false, 0.0};
    *result = none;
    if (!event) {
        return true;
    }
    result->contact = event->contact;
    result->slips = event->kind == EVENT_SLIP;
    return result->slips || residual_speed(sim, event->contact, &result->slow, problem);
}

/* The closed stops, and of the open ones that touch those that are near and do not open. */
static int resting_candidates(Simulation *sim, const int *touching, int touching_count,
                              int *candidates) {
    size_t mark = sim->scratch.used;
    const System *system = system_of(sim);
    const double *v = sim->state.front + system->n;
    double near = TOUCHING_RTOL * system->length + RELEASE_PENETRATION_ATOL;
    double bound = zero_speed(&sim->configuration), t = sim->state.front_time;
    int count = 0;
    Complex *e = directions_at(sim, sim->state.front);
    for (int i = 0; i < system->s; i++) {
        if (sim->state.modes[i] != CONTACT_OPEN) {
            candidates[count++] = i;
        }
    }
    for (int k = 0; k < touching_count; k++) {
        int i = touching[k];
        if (sim->state.modes[i] == CONTACT_OPEN && gap(&sim->equations, i, t, e) <= near &&
            gap_rate(&sim->equations, i, t, e, v) <= bound) {
            candidates[count++] = i;
        }
    }
    sim->scratch.used = mark;
    return count;
}

/* Choose the contact state at the front from its positions and velocities.  touching: open stops
 * that touch without closing or opening; event: a slip or reversal that has just occurred, or
 * NULL. */
PRBM bool settle(Simulation *sim, const int *touching, int touching_count, const Event *event,
                 Problem *problem) {
    const System *system = system_of(sim);
    const double *front = sim->state.front;
    FrictionEvent friction;
    HoldingSet resting;
    int candidates[2 * STOPS_MAX], modes[CONTACTS_MAX];
    if (!friction_event(sim, event, &friction, problem)) {
        return false;
    }
    int count = resting_candidates(sim, touching, touching_count, candidates);
    if (!holding_stops(sim, count, candidates, front, front + system->n, &resting, problem)) {
        return false;
    }
    for (int contact = 0; contact < contact_count(sim); contact++) {
        bool open = is_stop(system, contact) && !has_stop(resting.count, resting.stops, contact);
        modes[contact] = open ? CONTACT_OPEN : CONTACT_FRICTIONLESS;
    }
    set_contacts(sim, modes);
    if (!settle_friction(sim, &friction, problem)) {
        return false;
    }
    return resting.count == 0 ||
           project(&sim->equations, sim->state.front_time, sim->state.front, &sim->scratch,
                   problem);
}

/* Open the closed stops whose gaps change, by a wall's velocity or an impulse: a wall that retreats
 * leaves the body; one that advances strikes, as does a body that is thrown against a wall that it
 * touches.  Returns a stop that is struck, or -1. */
static int release_moving(Simulation *sim) {
    size_t mark = sim->scratch.used;
    const System *system = system_of(sim);
    int struck = -1;
    double gaps[STOPS_MAX], rates[STOPS_MAX], bound = zero_speed(&sim->configuration);
    double t = sim->state.time;
    Complex *e = directions_at(sim, sim->state.front);
    for (int i = 0; i < system->s; i++) {
        gaps[i] = gap(&sim->equations, i, t, e);
        rates[i] = gap_rate(&sim->equations, i, t, e, sim->state.front + system->n);
    }
    sim->scratch.used = mark;
    for (int i = 0; i < system->s; i++) {
        bool closed = sim->state.modes[i] != CONTACT_OPEN;
        if (closed && fabs(rates[i]) > bound) {
            set_mode(sim, i, CONTACT_OPEN);
        } else if (closed || gaps[i] > TOUCHING_RTOL * system->length) {
            continue;
        }
        struck = rates[i] < -bound ? i : struck;
    }
    return struck;
}

/* The contact state after changes of wall velocities or impulses. */
PRBM bool settle_moved(Simulation *sim, Problem *problem) {
    int struck = release_moving(sim);
    if (struck >= 0) {
        return impact(sim, struck, problem);
    }
    return project(&sim->equations, sim->state.time, sim->state.front, &sim->scratch, problem) &&
           settle(sim, NULL, 0, NULL, problem);
}
