/* The choice of the contact state: the twin of hybrid/contact_modes.py. */
#include <math.h>
#include <string.h>

#include "hybrid/configuration.h"
#include "hybrid/contact_modes.h"
#include "hybrid/holding_stops.h"
#include "hybrid/impacts.h"
#include "hybrid/rest.h"
#include "hybrid/simulation.h"

/* Set up the trial equations in the present contact state with one mode changed. */
static void try_mode(Simulation *sim, int contact, ContactMode mode) {
    size_t bytes = (size_t)contact_count(sim) * sizeof(ContactMode);
    memcpy(sim->trial.contacts.modes, sim->state.modes, bytes);
    sim->trial.contacts.modes[contact] = mode;
    try_contacts(sim);
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

/* Whether a contact that is at rest and may move sticks, or which way it slips; and whether this
 * fits while all others keep their modes. */
static bool mode_at_rest(Simulation *sim, int contact, const Inertia *at, const double *row,
                         bool slips, ContactMode *mode, bool *fits, Problem *problem) {
    double greatest = 0.0;
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
        double acceleration = sign * (dot(system->n, row, tried->a) - convective);
        if (acceleration > 0.0) {
            *mode = slipping_mode(sign);
            return true;
        }
        greatest = greater(greatest, -acceleration);
    }
    /* where there is as good as no friction, either of these fits */
    *mode = slips ? CONTACT_FRICTIONLESS : CONTACT_STICK;
    *fits = greatest <= zero_acceleration(&sim->configuration);
    return true;
}

/* The mode of a closed contact with friction.  It slips if it moves faster than slow.  At rest it
 * is frictionless where the loops and the closed stops leave it no mobility of its own: they
 * carry all of the load.  Else it sticks as far as Coulomb's law allows, and beyond slips in the
 * direction in which sliding accelerates it. */
static bool choose_mode(Simulation *sim, int contact, const FrictionEvent *event, bool *fits,
                        Problem *problem) {
    size_t mark = sim->scratch.used;
    const System *system = system_of(sim);
    bool this_one = event->contact == contact, mobile = false, right = true;
    double slow = this_one ? event->slow : 0.0, *row = take(&sim->scratch, (size_t)system->n);
    Inertia at = inertia_at(sim, sim->state.front);
    *fits = true;
    tangential_row(system, contact, at.e, row);
    double speed = dot(system->n, row, sim->state.front + system->n);
    ContactMode mode = fabs(speed) > slow ? slip_mode(sim, speed) : CONTACT_FRICTIONLESS;
    if (mode == CONTACT_FRICTIONLESS) {
        right = has_mobility(sim, contact, &at, row, &mobile, problem);
        if (right && mobile) {
            right = mode_at_rest(sim, contact, &at, row, this_one && event->slips, &mode, fits,
                                 problem);
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
    memcpy(sim->trial.contacts.modes, sim->state.modes, (size_t)contact_count(sim) * sizeof(ContactMode));
    try_contacts(sim);
    bool right = evaluate_trial(sim, q, v, problem);
    for (int k = 0; right && *result && k < equations->held_count; k++) {
        *result = tried->lam[equations->first_hold + k] > 0.0;
    }
    for (int k = 0; right && *result && k < count; k++) {
        int contact = contacts[k];
        ContactMode mode = sim->state.modes[contact];
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
    static const ContactMode modes[3] = {CONTACT_STICK, CONTACT_SLIP_POSITIVE,
                                         CONTACT_SLIP_NEGATIVE};
    bool allowed = true;
    for (int k = count - 1, rest = c; k >= 0; k--, rest /= 3) {
        ContactMode mode = modes[rest % 3];
        set_mode(sim, contacts[k], mode);
        allowed = allowed && !(event->slips && event->contact == contacts[k] &&
                               mode == CONTACT_STICK);
    }
    return allowed;
}

/* Choose the modes of the contacts at rest together, if choosing them one by one does not end.  It
 * is the first combination in which sticking needs no more than its friction, slipping accelerates
 * in its direction, and all closed stops are pressed.  None is found with too many at rest. */
static bool settle_together(Simulation *sim, int count, const int *contacts,
                            const FrictionEvent *event, bool *found, Problem *problem) {
    int mobile[CONTACTS_MAX], many, combinations = 1;
    if (!mobile_at_rest(sim, count, contacts, event, &many, mobile, problem)) {
        return false;
    }
    for (int k = 0; k < many && many <= STICKING_SETS_MAX; k++) {
        combinations *= 3;
    }
    for (int c = 0; many <= STICKING_SETS_MAX && !*found && c < combinations; c++) {
        if (set_combination(sim, c, many, mobile, event) &&
            !state_agrees(sim, many, mobile, found, problem)) {
            return false;
        }
    }
    return true;
}

/* The mode of a contact that slides faster than the event leaves; CONTACT_FRICTIONLESS at rest. */
static ContactMode sliding_mode(Simulation *sim, int contact, const FrictionEvent *event) {
    size_t mark = sim->scratch.used;
    const double *q = sim->state.front, *v = q + system_of(sim)->n;
    double speed = sliding_velocity(system_of(sim), contact, directions_at(sim, q), v);
    double slow = event->contact == contact ? event->slow : 0.0;
    sim->scratch.used = mark;
    return fabs(speed) > slow ? slip_mode(sim, speed) : CONTACT_FRICTIONLESS;
}

static double friction_of(const Simulation *sim, int contact) {
    const System *system = system_of(sim);
    return is_stop(system, contact) ? sim->equations.stop_friction[contact]
                                    : sim->equations.rub_law[3 * (contact - system->s)];
}

/* Whether a contact at rest begins to slip, sticks, bears the limit of its friction, or none. */
static bool mode_of_forces(Simulation *sim, const RestForces *found, int j, int contact,
                           bool slipped, Problem *problem) {
    bool mobile = false, at_limit = fabs(found->friction[j]) >= found->limit[j];
    ContactMode mode = CONTACT_FRICTIONLESS;
    if (fabs(found->slide[j]) > zero_acceleration(&sim->configuration)) {
        set_mode(sim, contact, slipping_mode(found->slide[j]));
        return true;
    }
    if (!(at_limit && slipped) && !is_mobile(sim, contact, &mobile, problem)) {
        return false;
    }
    if (mobile) {
        mode = CONTACT_STICK;
    } else if (at_limit && found->limit[j] > 0.0) {
        mode = slipping_mode(-found->friction[j]);
    }
    set_mode(sim, contact, mode);
    return true;
}

/* Choose the modes of contacts at rest by their forces: first of those whose friction is below its
 * limit. */
static bool stick_or_slip(Simulation *sim, const RestContacts *rest, const RestForces *found,
                          const FrictionEvent *event, Problem *problem) {
    bool right = true;
    for (int limited = 0; limited < 2; limited++) {
        for (int j = 0; right && j < rest->count; j++) {
            int contact = rest->contacts[j];
            bool at_limit = fabs(found->friction[j]) >= found->limit[j];
            if (at_limit == (limited == 1) && sim->state.modes[contact] != CONTACT_OPEN) {
                right = mode_of_forces(sim, found, j, contact,
                                       event->slips && event->contact == contact, problem);
            }
        }
    }
    return right;
}

/* Whether a contact at rest satisfies its law in the trial equations, up to round-off. */
static bool obeys_coulomb(Simulation *sim, int contact, const Complex *e, double *row) {
    const System *system = system_of(sim);
    const Equations *equations = &sim->trial.equations;
    const Evaluation *tried = &sim->trial.evaluation;
    const double *v = sim->state.front + system->n;
    ContactMode mode = sim->state.modes[contact];
    if (mode == CONTACT_STICK) {
        return fabs(stick_force(equations, tried->lam, contact)) <=
               (1.0 + FRICTION_EXCESS_RTOL) * friction_limit(equations, e, tried->lam, contact);
    }
    tangential_row(system, contact, e, row);
    double slide = dot(system->n, row, tried->a) - tangential_convective(system, contact, e, v);
    return !(slip_sign(mode) * slide < -zero_acceleration(&sim->configuration));
}

/* Whether the modes satisfy the laws of all contacts, up to round-off. */
static bool modes_agree(Simulation *sim, const RestContacts *rest, bool *result,
                        Problem *problem) {
    size_t mark = sim->scratch.used;
    const System *system = system_of(sim);
    const Equations *equations = &sim->trial.equations;
    const Evaluation *tried = &sim->trial.evaluation;
    const double *q = sim->state.front, *v = q + system->n;
    double *row = take(&sim->scratch, (size_t)system->n);
    Rows gaps = gap_rows(system);
    Complex *e = directions_at(sim, q);
    memcpy(sim->trial.contacts.modes, sim->state.modes, (size_t)contact_count(sim) * sizeof(ContactMode));
    try_contacts(sim);
    bool right = evaluate_trial(sim, q, v, problem);
    *result = right;
    for (int k = 0; *result && k < rest->stop_count; k++) {
        int i = rest->stops[k];
        row_jacobian(&gaps, i, e, row);
        double opening = dot(system->n, row, tried->a) - row_convective(&gaps, i, e, v);
        *result = sim->state.modes[i] != CONTACT_OPEN
                      ? stop_force(equations, tried->lam, i) > 0.0
                      : !(opening < -zero_acceleration(&sim->configuration));
    }
    for (int j = 0; *result && j < rest->count; j++) {
        *result = obeys_coulomb(sim, rest->contacts[j], e, row);
    }
    sim->scratch.used = mark;
    return right;
}

/* The stops that touch and the contacts at rest; the modes of all that slides, stops open. */
static void find_rest(Simulation *sim, int count, const int *touching, const FrictionEvent *event,
                      RestContacts *rest, ContactMode *modes, ContactMode *sliding) {
    const System *system = system_of(sim);
    rest->stop_count = rest->count = 0;
    for (int contact = 0; contact < contact_count(sim); contact++) {
        bool stop = is_stop(system, contact);
        modes[contact] = stop ? CONTACT_OPEN : CONTACT_FRICTIONLESS;
        sliding[contact] = sliding_mode(sim, contact, event);
        if (stop && !has_contact(count, touching, contact)) {
            continue;
        }
        if (stop) {
            rest->stops[rest->stop_count] = contact;
            rest->slips[rest->stop_count++] = slip_sign(sliding[contact]);
        }
        if (friction_of(sim, contact) > 0.0) {
            modes[contact] = stop ? CONTACT_OPEN : sliding[contact];
            if (sliding[contact] == CONTACT_FRICTIONLESS) {
                rest->contacts[rest->count++] = contact;
            }
        }
    }
}

/* Choose the modes of all contacts by the forces that satisfy all laws at once. */
static bool settle_by_forces(Simulation *sim, int count, const int *touching,
                             const FrictionEvent *event, Problem *problem) {
    const System *system = system_of(sim);
    const double *q = sim->state.front;
    ContactMode modes[CONTACTS_MAX], sliding[CONTACTS_MAX];
    int all[CONTACTS_MAX], many = 0;
    size_t bytes = (size_t)contact_count(sim) * sizeof(ContactMode);
    RestContacts rest;
    RestForces found;
    bool agree = false;
    find_rest(sim, count, touching, event, &rest, modes, sliding);
    memcpy(sim->trial.contacts.modes, modes, bytes);
    try_contacts(sim);
    if (!rest_forces(sim, q, q + system->n, &rest, &found, problem)) {
        return false;
    }
    for (int k = 0; found.solved && k < rest.stop_count; k++) {
        int i = rest.stops[k];
        bool pressed = found.normal[k] > zero_acceleration(&sim->configuration);
        modes[i] = pressed ? sliding[i] : CONTACT_OPEN;
    }
    set_contacts(sim, modes);
    if (found.solved && !(stick_or_slip(sim, &rest, &found, event, problem) &&
                          modes_agree(sim, &rest, &agree, problem))) {
        return false;
    }
    for (int contact = 0; contact < contact_count(sim); contact++) {
        bool touches = is_stop(system, contact) ? has_contact(count, touching, contact)
                                                : friction_of(sim, contact) > 0.0;
        all[many] = contact;
        many += touches;
    }
    return agree || contacts_jammed(sim, many, all, problem);
}

/* The closed contacts that have friction. */
static int contacts_with_friction(const Simulation *sim, int *contacts) {
    int count = 0;
    for (int contact = 0; contact < contact_count(sim); contact++) {
        if (sim->state.modes[contact] != CONTACT_OPEN && friction_of(sim, contact) > 0.0) {
            contacts[count++] = contact;
        }
    }
    return count;
}

/* Choose the modes one by one until none changes: one may change the mode of another.  Else choose
 * them all at once. */
static bool settle_friction(Simulation *sim, int touching_count, const int *touching,
                            const FrictionEvent *event, Problem *problem) {
    ContactMode before[CONTACTS_MAX];
    int contacts[CONTACTS_MAX];
    int count = contacts_with_friction(sim, contacts);
    size_t bytes = (size_t)contact_count(sim) * sizeof(ContactMode);
    for (int round = 0; round <= count; round++) {
        bool fits = true;
        memcpy(before, sim->state.modes, bytes);
        for (int k = 0; k < count; k++) {
            bool one_fits;
            if (!choose_mode(sim, contacts[k], event, &one_fits, problem)) {
                return false;
            }
            fits = fits && one_fits;
        }
        if (fits && memcmp(before, sim->state.modes, bytes) == 0) {
            return true;
        }
    }
    bool found = false;
    return settle_together(sim, count, contacts, event, &found, problem) &&
           (found || settle_by_forces(sim, touching_count, touching, event, problem));
}

/* --- all -------------------------------------------------------------------------------------- */

/* The spacing of the numbers around x. */
static double spacing(double x) {
    int exponent;
    (void)frexp(x, &exponent);
    return ldexp(1.0, exponent - 53);
}

/* The error of the time of an event. */
static double time_resolution(double time) {
    return EVENT_TIME_FACTOR * EVENT_TIME_ATOL + EVENT_TIME_ULPS * spacing(time);
}

/* The sliding speed that the resolution of time leaves where sliding ends. */
static bool residual_speed(Simulation *sim, int contact, double *result, Problem *problem) {
    size_t mark = sim->scratch.used;
    const System *system = system_of(sim);
    Evaluation *evaluation = &sim->at_front;
    const double *q = sim->state.front, *v = q + system->n;
    if (!evaluate_equations(&sim->equations, sim->state.front_time, q, v, NULL, evaluation, problem)) {
        return false;
    }
    double *row = take(&sim->scratch, (size_t)system->n);
    Complex *e = directions_at(sim, q);
    tangential_row(system, contact, e, row);
    double rate = dot(system->n, row, evaluation->a) - tangential_convective(system, contact, e, v);
    *result = fabs(rate) * time_resolution(sim->state.front_time);
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
    int candidates[2 * STOPS_MAX];
    ContactMode modes[CONTACTS_MAX];
    if (!friction_event(sim, event, &friction, problem)) {
        return false;
    }
    int count = resting_candidates(sim, touching, touching_count, candidates);
    if (!holding_stops(sim, count, candidates, front, front + system->n, &resting, problem)) {
        return false;
    }
    for (int contact = 0; contact < contact_count(sim); contact++) {
        bool open = is_stop(system, contact) && !has_contact(resting.count, resting.stops, contact);
        modes[contact] = open ? CONTACT_OPEN : CONTACT_FRICTIONLESS;
    }
    set_contacts(sim, modes);
    if (!settle_friction(sim, count, candidates, &friction, problem)) {
        return false;
    }
    return sim->equations.held_count == 0 ||
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
