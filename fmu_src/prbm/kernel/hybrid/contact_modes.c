/* The choice of the contact state: the twin of hybrid/contact_modes.py. */
#include <math.h>
#include <string.h>

#include "core/friction.h"
#include "core/gaps.h"
#include "hybrid/access.h"
#include "hybrid/configuration.h"
#include "hybrid/contact_modes.h"
#include "hybrid/contact_names.h"
#include "hybrid/phases.h"
#include "hybrid/rest.h"
#include "hybrid/spring_phases.h"

/* The modes change with each projection. */
static const ContactFailure UNDECIDED = {
    "the choice of closed contacts does not converge",
    "the forces of the contacts are round-off; separate the stops, or change the load",
};

/* --- trial equations -------------------------------------------------------------------------- */

/* Set up the trial equations in a contact state. */
static void try_contacts(Simulation *sim, const ContactMode *modes) {
    memmove(sim->trial.contacts.modes, modes, (size_t)contact_count(sim) * sizeof *modes);
    memmove(sim->trial.contacts.touching, sim->state.touching,
            (size_t)system_of(sim)->s * sizeof *sim->state.touching);
    memmove(sim->trial.contacts.sides, sim->state.sides,
            (size_t)system_of(sim)->f * sizeof *sim->state.sides);
    sim->trial.contacts.coils = sim->state.coils;
    set_equations(&sim->trial.equations, &sim->equations.inputs, &sim->trial.contacts,
                  sim->configuration.omega);
}

/* Return the slip mode for a sliding velocity, or CONTACT_FRICTIONLESS if that is round-off. */
static ContactMode slip_mode(const Simulation *sim, double speed) {
    return fabs(speed) <= zero_speed(&sim->configuration) ? CONTACT_FRICTIONLESS
                                                          : slipping_mode(speed);
}

static double friction_of(const Simulation *sim, int contact) {
    return friction_coefficient(&sim->equations, contact);
}

/* Whether a contact is a compliant stop that is pressed. */
static bool presses(const Simulation *sim, int contact) {
    return is_stop(system_of(sim), contact) && is_pressed(&sim->state.touching[contact]);
}

/* The contact state in which a set of stops is held, and closed contacts and friction points slip
 * if they have a velocity and friction. */
static void modes_holding(Simulation *sim, const HoldingSet *holding, const double *q,
                          const double *v, ContactMode *modes) {
    Scratch scratch = sim->scratch;
    const System *system = system_of(sim);
    Complex *e = directions_at(sim, q, &scratch);
    for (int contact = 0; contact < contact_count(sim); contact++) {
        bool open = is_stop(system, contact) && !presses(sim, contact) &&
                    !has_contact(holding->count, holding->stops, contact);
        modes[contact] = open ? CONTACT_OPEN : CONTACT_FRICTIONLESS;
        if (!open && friction_of(sim, contact) > 0.0) {
            modes[contact] = slip_mode(sim, sliding_velocity(system, contact, e, v));
        }
    }
}

PRBM const Equations *equations_holding(Simulation *sim, const HoldingSet *holding,
                                        const double *q, const double *v) {
    ContactMode modes[CONTACTS_MAX];
    modes_holding(sim, holding, q, v, modes);
    try_contacts(sim, modes);
    return &sim->trial.equations;
}

/* Whether a contact at rest satisfies its law in the trial equations.  A friction force may exceed
 * its limit by slack [N]. */
static bool obeys_coulomb(Simulation *sim, int contact, double slack, const Complex *e,
                          const double *v, double *row) {
    const System *system = system_of(sim);
    const Equations *equations = &sim->trial.equations;
    const Evaluation *tried = &sim->trial.evaluation;
    ContactMode mode = sim->trial.contacts.modes[contact];
    if (mode == CONTACT_STICK) {
        double limit = friction_limit(equations, e, tried, contact);
        return fabs(stick_force(equations, tried->lam, contact)) <=
               limit + greater(FRICTION_EXCESS_RTOL * limit, slack);
    }
    tangential_row(system, contact, e, row);
    double slide = dot(system->n, row, tried->a) - tangential_convective(system, contact, e, v);
    return !(slip_sign(mode) * slide < -zero_acceleration(&sim->configuration));
}

/* Whether the modes of the trial equations satisfy the laws of all contacts, up to round-off. */
static bool modes_agree(Simulation *sim, const double *q, const double *v,
                        const HoldingSet *touching, const RestContacts *rest,
                        const RestForces *found, bool *result, Problem *problem) {
    Scratch scratch = sim->scratch;
    const Equations *equations = &sim->trial.equations;
    const Evaluation *tried = &sim->trial.evaluation;
    double *row = take(&scratch, (size_t)system_of(sim)->n);
    double zero = zero_acceleration(&sim->configuration);
    Complex *e = directions_at(sim, q, &scratch);
    bool ok = evaluate_equations(equations, sim->state.front_time, q, v,
                                 extra_states(sim, sim->state.front), NULL,
                                 &sim->trial.evaluation, problem);
    *result = ok;
    for (int k = 0; *result && k < touching->count; k++) {
        int i = touching->stops[k];
        *result = is_held(&sim->trial.contacts, i)
                      ? stop_force(equations, tried->lam, i) > 0.0
                      : !(gap_acceleration(equations, i, sim->state.front_time, e, v, tried) <
                          -zero);
    }
    for (int j = 0; *result && j < rest->count; j++) {
        *result = obeys_coulomb(sim, rest->contacts[j], zero / found->mobility[j], e, v, row);
    }
    return ok;
}

/* --- stops ------------------------------------------------------------------------------------ */

/* Return the acceleration of a gap by its normal force above which a stop holds [m/s^2].  A stop
 * that was released because its force was round-off, and then penetrated, was pressed. */
static double least_pressing(Simulation *sim, int stop, const double *q) {
    Scratch scratch = sim->scratch;
    double distance = gap(&sim->equations, stop, sim->state.front_time,
                          directions_at(sim, q, &scratch), extra_states(sim, sim->state.front));
    const Configuration *configuration = &sim->configuration;
    const ContactPhase *touching = &sim->state.touching[stop];
    distance += touching->phase == PHASE_FROZEN ? touching->depth : 0.0;
    return distance > -closing_depth(configuration) / 2.0 ? zero_acceleration(configuration) : 0.0;
}

/* Return the candidates, each once, in the order of the stops. */
static HoldingSet in_order(const Simulation *sim, int count, const int *candidates, bool found) {
    HoldingSet every = {0, {0}, found};
    for (int i = 0; i < system_of(sim)->s; i++) {
        if (has_contact(count, candidates, i)) {
            every.stops[every.count++] = i;
        }
    }
    return every;
}

/* Find the stops at rest that hold: these are pressed, and the others open.  In this search
 * contacts with a sliding velocity slip, and contacts at rest are frictionless.  If stops can move
 * only together, a subset with independent rows holds. */
PRBM bool find_holding_stops(Simulation *sim, int count, const int *candidates, const double *q,
                             const double *v, HoldingSet *holding, Problem *problem) {
    HoldingSet every = in_order(sim, count, candidates, false), none = {0, {0}, true};
    ContactMode modes[CONTACTS_MAX];
    RestContacts rest;
    RestForces found;
    *holding = none;
    if (every.count == 0) {
        return true;
    }
    modes_holding(sim, &every, q, v, modes);
    rest.stop_count = every.count;
    rest.count = 0;
    for (int k = 0; k < every.count; k++) {
        rest.stops[k] = every.stops[k];
        rest.slips[k] = slip_sign(modes[every.stops[k]]);
    }
    equations_holding(sim, &none, q, v);
    if (!rest_forces(sim, q, v, &rest, &found, problem)) {
        return false;
    }
    for (int k = 0; found.solved && k < every.count; k++) {
        if (found.normal[k] > least_pressing(sim, every.stops[k], q)) {
            holding->stops[holding->count++] = every.stops[k];
        }
    }
    holding->found = found.solved;
    if (!found.solved || every.count == 1) {
        return true; /* Only the rows of several stops may be dependent: check these. */
    }
    equations_holding(sim, holding, q, v);
    return modes_agree(sim, q, v, &every, &rest, &found, &holding->found, problem);
}

/* --- friction --------------------------------------------------------------------------------- */

/* A slip (slips is true) or reversal at a contact; contact is -1 without such an event.  After a
 * reversal, sliding speeds of the contact up to slow [m/s] count as zero; rate is its sliding
 * acceleration.  turned: a guide that has changed its side, whose force is round-off and does not change
 * it back; -1: none. */
typedef struct {
    int contact;
    bool slips;
    double slow, rate;
    int turned;
} FrictionEvent;

/* Whether a contact can slide while all other held and sticking contacts rest. */
static bool is_mobile(Simulation *sim, int contact, const ContactMode *modes, bool *result,
                      Problem *problem) {
    Scratch scratch = sim->scratch;
    size_t bytes = (size_t)contact_count(sim) * sizeof *modes;
    const System *system = system_of(sim);
    const Equations *eq = &sim->trial.equations;
    double *row = take(&scratch, (size_t)system->n);
    ContactMode others[CONTACTS_MAX];
    ContactProblem *at = contact_problem_at(sim, sim->state.front, scratch);
    memcpy(others, modes, bytes);
    if (others[contact] != CONTACT_OPEN) {
        others[contact] = CONTACT_FRICTIONLESS;
    }
    try_contacts(sim, others);
    tangential_row(system, contact, at->e, row);
    double *held = take_matrix(&scratch, eq->r, system->n);
    jacobian(&eq->active, at->e, held);
    return independent(at, eq->r, held, row, result, scratch, problem);
}

/* Return the slip mode of a contact.  Return CONTACT_FRICTIONLESS if its speed is zero within the
 * round-off of the event. */
static ContactMode sliding_mode(Simulation *sim, int contact, const FrictionEvent *event) {
    Scratch scratch = sim->scratch;
    const double *q = sim->state.front, *v = q + system_of(sim)->n;
    double speed = sliding_velocity(system_of(sim), contact, directions_at(sim, q, &scratch), v);
    double slow = event->contact == contact ? event->slow : 0.0;
    return fabs(speed) > slow ? slip_mode(sim, speed) : CONTACT_FRICTIONLESS;
}

/* Return the mode of a contact at rest that cannot move independently.  After a reversal it slides
 * if the other parts impose the motion, as where the links of a loop form a straight line. */
static ContactMode turning_mode(const Simulation *sim, int contact, const FrictionEvent *event) {
    bool slides = event->contact == contact && !event->slips &&
                  fabs(event->rate) > zero_acceleration(&sim->configuration);
    return slides ? slipping_mode(event->rate) : CONTACT_FRICTIONLESS;
}

/* List the contacts at rest that may stick: those with friction below its limit first, then those
 * without friction, those that have slipped, and the others.  Return their number. */
static int order_resting(const RestContacts *rest, const RestForces *found, double zero,
                         const bool *leaves, const ContactMode *modes, int *order) {
    enum { BELOW_LIMIT, NO_FRICTION, SLIPPED, AT_LIMIT };
    int count = 0;
    for (int turn = BELOW_LIMIT; turn <= AT_LIMIT; turn++) {
        for (int j = 0; j < rest->count; j++) {
            bool none = fabs(found->friction[j]) <= zero / found->mobility[j];
            int full = leaves[j] ? SLIPPED : AT_LIMIT, free = none ? NO_FRICTION : BELOW_LIMIT;
            order[count] = j;
            count += (at_limit(found, j, zero) ? full : free) == turn &&
                     modes[rest->contacts[j]] != CONTACT_OPEN && !(fabs(found->slide[j]) > zero);
        }
    }
    return count;
}

/* Choose the modes of contacts at rest by their forces.  If contacts can stick only together, those
 * with friction below its limit stick, because they are independent of each other; the others have
 * friction at its limit, or none.  If all of them are at their limits and one of them has slipped,
 * they slip together.  A contact without a normal force has no friction in either direction of slip,
 * and changes it as soon as it moves.  If yielding, no contact sticks at its limit. */
static void stick_or_slip(Simulation *sim, const RestContacts *rest, RestForces *found,
                          const bool *holds, const FrictionEvent *event, bool yielding,
                          ContactMode *modes) {
    double zero = zero_acceleration(&sim->configuration);
    bool sticks[CONTACTS_MAX], leaves[CONTACTS_MAX];
    int order[CONTACTS_MAX];
    for (int j = 0; j < rest->count; j++) {
        leaves[j] = yielding || (event->slips && event->contact == rest->contacts[j]);
    }
    int count = order_resting(rest, found, zero, leaves, modes, order);
    choose_sticking(rest, found, holds, count, order, leaves, zero, sticks, sim->scratch);
    for (int j = 0; j < rest->count; j++) {
        ContactMode *mode = &modes[rest->contacts[j]];
        ContactMode kept = at_limit(found, j, zero) ? slipping_mode(-found->friction[j])
                                                    : CONTACT_FRICTIONLESS;
        bool slides = fabs(found->slide[j]) > zero;
        if (*mode != CONTACT_OPEN) {
            *mode = slides ? slipping_mode(found->slide[j]) : sticks[j] ? CONTACT_STICK : kept;
        }
    }
}

/* Whether a compliant stop is pressed and not free of force. */
static bool rubs_pressed(const Simulation *sim, int contact) {
    return presses(sim, contact) && sim->state.touching[contact].phase != PHASE_FREE;
}

/* Choose the mode of a contact with friction if it slides or cannot move independently, and add it
 * to the contacts at rest otherwise. */
static bool sort_rubbing(Simulation *sim, int contact, const FrictionEvent *event,
                         const ContactMode *modes, RestContacts *rest, ContactMode *sliding,
                         Problem *problem) {
    bool mobile = false;
    *sliding = sliding_mode(sim, contact, event);
    if (*sliding != CONTACT_FRICTIONLESS) {
        return true;
    }
    if (!is_mobile(sim, contact, modes, &mobile, problem)) {
        return false;
    }
    if (mobile) {
        rest->contacts[rest->count++] = contact;
    } else {
        *sliding = turning_mode(sim, contact, event);
    }
    return true;
}

/* Collect the given stops, and the contacts with friction at rest, pressed stops among them.
 * Contacts that cannot move independently are left out: loops and held stops carry their load.
 * sliding: the modes of the contacts with friction that slide. */
static bool find_rest(Simulation *sim, const HoldingSet *stops, const FrictionEvent *event,
                      const ContactMode *modes, RestContacts *rest,
                      ContactMode *sliding, Problem *problem) {
    bool ok = true;
    rest->stop_count = rest->count = 0;
    for (int contact = 0; ok && contact < contact_count(sim); contact++) {
        bool held = has_contact(stops->count, stops->stops, contact);
        bool takes_part = held || !is_stop(system_of(sim), contact) || rubs_pressed(sim, contact);
        sliding[contact] = CONTACT_FRICTIONLESS;
        if (takes_part && friction_of(sim, contact) > 0.0) {
            ok = sort_rubbing(sim, contact, event, modes, rest, &sliding[contact], problem);
        }
        if (held) {
            rest->stops[rest->stop_count] = contact;
            rest->slips[rest->stop_count++] = slip_sign(sliding[contact]);
        }
    }
    return ok;
}

static bool friction_jams(Simulation *sim, const HoldingSet *touching, Problem *problem) {
    int all[CONTACTS_MAX], count = 0;
    for (int contact = 0; contact < contact_count(sim); contact++) {
        bool stop = is_stop(system_of(sim), contact);
        bool rough = friction_of(sim, contact) > 0.0;
        all[count] = contact;
        count += stop ? has_contact(touching->count, touching->stops, contact) ||
                            (rough && rubs_pressed(sim, contact))
                      : rough;
    }
    return contacts_jam(sim, count, all, problem);
}

/* Set the modes of the contacts with friction that are closed, and those that slide. */
static void set_sliding(const Simulation *sim, const ContactMode *sliding, ContactMode *modes) {
    for (int contact = 0; contact < contact_count(sim); contact++) {
        bool rubs = modes[contact] != CONTACT_OPEN && friction_of(sim, contact) > 0.0;
        modes[contact] = rubs ? sliding[contact] : modes[contact];
    }
}

/* Close the stops whose force presses, and open the others. */
static void hold_pressed(Simulation *sim, const RestContacts *rest, const RestForces *found,
                         const ContactMode *sliding, ContactMode *modes, bool *holds) {
    for (int k = 0; k < rest->stop_count; k++) {
        int i = rest->stops[k];
        ContactMode closed = friction_of(sim, i) > 0.0 ? sliding[i] : CONTACT_FRICTIONLESS;
        holds[k] = found->normal[k] > least_pressing(sim, i, sim->state.front);
        modes[i] = holds[k] ? closed : CONTACT_OPEN;
    }
}

/* Set the sides to which the guides at rest push. */
static void set_sides(Simulation *sim, const RestContacts *rest, const RestForces *found) {
    const System *system = system_of(sim);
    for (int j = 0; j < rest->count; j++) {
        if (is_guide(system, rest->contacts[j])) {
            sim->state.sides[rest->contacts[j] - system->s] = found->pushing[j] < 0.0 ? -1 : 1;
        }
    }
}

/* Compute the forces of the contacts at rest with all rigid stops open. */
static bool forces_at_rest(Simulation *sim, const RestContacts *rest, ContactMode *modes,
                           RestForces *found, Problem *problem) {
    const double *q = sim->state.front;
    for (int i = 0; i < system_of(sim)->s; i++) {
        modes[i] = presses(sim, i) ? modes[i] : CONTACT_OPEN;
    }
    try_contacts(sim, modes);
    return rest_forces(sim, q, q + system_of(sim)->n, rest, found, problem);
}

/* Choose the modes by the forces of some stops and of the contacts with friction.  *agree is false
 * if no forces satisfy their laws, or if another stop that touches would close. */
static bool modes_by_forces(Simulation *sim, const HoldingSet *stops, const HoldingSet *touching,
                            const FrictionEvent *event, bool yielding, ContactMode *modes,
                            bool *agree, Problem *problem) {
    const double *q = sim->state.front, *v = q + system_of(sim)->n;
    ContactMode sliding[CONTACTS_MAX];
    bool holds[STOPS_MAX];
    RestContacts rest;
    RestForces found;
    if (!find_rest(sim, stops, event, modes, &rest, sliding, problem)) {
        return false;
    }
    set_sliding(sim, sliding, modes);
    *agree = rest.count == 0;
    if (*agree) {
        return true;
    }
    bool ok = forces_at_rest(sim, &rest, modes, &found, problem);
    if (ok && found.solved) {
        hold_pressed(sim, &rest, &found, sliding, modes, holds);
        stick_or_slip(sim, &rest, &found, holds, event, yielding, modes);
        set_sides(sim, &rest, &found);
        try_contacts(sim, modes);
        ok = modes_agree(sim, q, v, touching, &rest, &found, agree, problem);
    }
    return ok;
}

/* Choose the modes of all contacts with friction: first with the stops that hold if contacts at
 * rest are frictionless; if that fails, with all stops that touch.  A contact at its limit sticks if
 * it can; the forces of contacts that can hardly move against each other may then exceed their
 * limits, which they do not if it slips. */
static bool choose_slips(Simulation *sim, const HoldingSet *holding, const HoldingSet *touching,
                         const FrictionEvent *event, ContactMode *modes, bool *jams,
                         Problem *problem) {
    ContactMode first[CONTACTS_MAX];
    size_t bytes = (size_t)contact_count(sim) * sizeof *modes;
    bool agree = false;
    memcpy(first, modes, bytes);
    for (int turn = 0; !agree && turn < 4; turn++) {
        const HoldingSet *stops = turn % 2 == 0 ? holding : touching;
        memcpy(modes, first, bytes);
        if ((turn % 2 == 0 || holding->count < touching->count) &&
            !modes_by_forces(sim, stops, touching, event, turn >= 2, modes, &agree, problem)) {
            return false;
        }
    }
    *jams = !agree;
    return agree || friction_jams(sim, touching, problem);
}

/* Whether the force of a slipping guide, with its friction, resists an acceleration of its point to the
 * left of its line. */
static bool resists(Simulation *sim, int contact, bool *result, Problem *problem) {
    const Equations *eq = &sim->equations;
    const double *q = sim->state.front, *v = q + eq->system->n;
    Scratch scratch = sim->scratch;
    double *x = take(&scratch, (size_t)eq->system->even), *lam = take(&scratch, (size_t)eq->r);
    if (!evaluate_equations(eq, sim->state.front_time, q, v, extra_states(sim, q), NULL,
                            &sim->at_front, problem)) {
        return false;
    }
    zeros(eq->system->even, x);
    zeros(eq->r, lam);
    lam[normal_row(eq, contact)] = 1.0;
    solve_again(&sim->at_front.factors, x, lam);
    *result = lam[normal_row(eq, contact)] > 0.0;
    return true;
}

PRBM bool change_side(Simulation *sim, int contact, Problem *problem) {
    bool before = false, after = false;
    bool ok = resists(sim, contact, &before, problem);
    sim->state.sides[contact - system_of(sim)->s] *= -1;
    set_contacts(sim, sim->state.modes);
    ok = ok && resists(sim, contact, &after, problem);
    return ok && ((before && after) || contacts_jam(sim, 1, &contact, problem));
}

/* --- all contacts ----------------------------------------------------------------------------- */

/* The error of the time of an event [s]. */
static double time_resolution(const Simulation *sim, double time) {
    double located = EVENT_TIME_RTOL * STEP_MAX_RTOL * sim->configuration.scales.time;
    return EVENT_TIME_FACTOR * located + EVENT_TIME_ULPS * spacing(time);
}

/* Compute the sliding acceleration of a contact in its present mode [m/s^2]. */
static bool slide_acceleration(Simulation *sim, int contact, double *result, Problem *problem) {
    Scratch scratch = sim->scratch;
    const System *system = system_of(sim);
    Evaluation *evaluation = &sim->at_front;
    const double *q = sim->state.front, *v = q + system->n;
    if (!evaluate_equations(&sim->equations, sim->state.front_time, q, v, extra_states(sim, q),
                            NULL, evaluation, problem)) {
        return false;
    }
    double *row = take(&scratch, (size_t)system->n);
    Complex *e = directions_at(sim, q, &scratch);
    tangential_row(system, contact, e, row);
    *result = dot(system->n, row, evaluation->a) - tangential_convective(system, contact, e, v);
    return true;
}

static bool friction_event(Simulation *sim, const Event *event, FrictionEvent *result,
                           Problem *problem) {
    FrictionEvent none = {-1, false, 0.0, 0.0, -1};
    *result = none;
    if (!event || event->kind == EVENT_ACTION) {
        return true;
    }
    if (event->kind == EVENT_SIDE) {
        result->turned = event->contact;
        return true;
    }
    result->contact = event->contact;
    result->slips = event->kind == EVENT_SLIP;
    bool ok = result->slips ||
              slide_acceleration(sim, event->contact, &result->rate, problem);
    result->slow = fabs(result->rate) * time_resolution(sim, sim->state.front_time);
    return ok;
}

/* List the closed stops, and the open stops in touching whose gaps are zero and do not open. */
static int resting_candidates(Simulation *sim, const int *touching, int touching_count,
                              int *candidates) {
    Scratch scratch = sim->scratch;
    const System *system = system_of(sim);
    const double *v = sim->state.front + system->n;
    double near = TOUCHING_RTOL * system->length + release_penetration(&sim->configuration);
    double bound = zero_speed(&sim->configuration), t = sim->state.front_time;
    int count = 0;
    Complex *e = directions_at(sim, sim->state.front, &scratch);
    for (int i = 0; i < system->s; i++) {
        if (held_stop(&sim->equations, i)) {
            candidates[count++] = i;
        }
    }
    for (int k = 0; k < touching_count; k++) {
        int i = touching[k];
        if (sim->state.modes[i] == CONTACT_OPEN && gap(&sim->equations, i, t, e, NULL) <= near &&
            gap_rate(&sim->equations, i, t, e, v, NULL) <= bound) {
            candidates[count++] = i;
        }
    }
    return count;
}

/* Find the first slipping guide that does not push to the side of its friction in the trial
 * equations, except for the guide that has just turned; -1: none. */
static bool find_wrong_side(Simulation *sim, const ContactMode *modes, int turned, int *wrong,
                            Problem *problem) {
    const Equations *eq = &sim->trial.equations;
    const double *q = sim->state.front, *v = q + system_of(sim)->n;
    *wrong = -1;
    if (system_of(sim)->f == sim->configuration.mechanism->friction_count) {
        return true;
    }
    try_contacts(sim, modes);
    if (eq->slipping_guides == 0) {
        return true;
    }
    bool ok = evaluate_equations(eq, sim->state.front_time, q, v, extra_states(sim, q), NULL,
                                 &sim->trial.evaluation, problem);
    for (int k = 0; ok && *wrong < 0 && k < eq->slipping_rows; k++) {
        int c = eq->slipping[k];
        bool changed = is_guide(eq->system, c) && c != turned && side_force(eq, sim->trial.evaluation.lam, c) <
                                                      -zero_force(&sim->configuration);
        *wrong = changed ? c : -1;
    }
    return ok;
}

/* Choose the modes of all contacts by their forces at the front, for the sides of the guides.  *jams:
 * whether no forces satisfy the laws on these sides. */
static bool choose_by_forces(Simulation *sim, const HoldingSet *touching, const FrictionEvent *event,
                             ContactMode *modes, bool *jams, Problem *problem) {
    const System *system = system_of(sim);
    const double *q = sim->state.front, *v = q + system->n;
    HoldingSet holding;
    bool ok = find_holding_stops(sim, touching->count, touching->stops, q, v, &holding, problem);
    *jams = ok && !holding.found;
    if (!ok || *jams) {
        return ok && contacts_jam(sim, touching->count, touching->stops, problem);
    }
    for (int contact = 0; contact < contact_count(sim); contact++) {
        bool open = is_stop(system, contact) && !presses(sim, contact) &&
                    !has_contact(holding.count, holding.stops, contact);
        modes[contact] = open ? CONTACT_OPEN : CONTACT_FRICTIONLESS;
    }
    return choose_slips(sim, &holding, touching, event, modes, jams, problem);
}

/* Choose the modes of all contacts by their forces at the front.  The friction of a guide that slips
 * depends on the side to which it pushes: the side of the first wrong one at a time is changed. */
static bool change_sides(Simulation *sim, const HoldingSet *touching, const FrictionEvent *event,
                         ContactMode *modes, bool *jams, Problem *problem) {
    HoldingSet failed = *touching;
    for (int k = 0; k < MODE_ITERATIONS_MAX; k++) {
        int wrong;
        if (!choose_by_forces(sim, touching, event, modes, jams, problem) ||
            !find_wrong_side(sim, modes, event->turned, &wrong, problem)) {
            return false;
        }
        if (wrong < 0) {
            return true;
        }
        sim->state.sides[wrong - system_of(sim)->s] *= -1;
        failed.stops[touching->count] = wrong;
    }
    *jams = true;
    return contacts_jam(sim, touching->count + 1, failed.stops, problem);
}

/* Choose the modes for any combination of the sides of the guides, except for the guide that has just
 * turned.  *jams: whether none has a solution; then the problem stays as it is, except that it has the
 * limit if there are too many combinations. */
static bool choose_on_any_sides(Simulation *sim, const HoldingSet *touching,
                                const FrictionEvent *event, ContactMode *modes, bool *jams,
                                Problem *problem) {
    const System *system = system_of(sim);
    int count = 0, combinations = 1, guides[PLACES_MAX];
    Problem other;
    for (int i = 0; i < system->f; i++) {
        if (is_guide(system, system->s + i) && system->s + i != event->turned) {
            guides[count++] = i;
            combinations *= combinations <= SIDES_TRIED_MAX ? 2 : 1;
        }
    }
    if (combinations > SIDES_TRIED_MAX) {
        return fail_further(problem, "%d guides have more than the %d combinations of sides that are "
                                     "tried", count, SIDES_TRIED_MAX);
    }
    for (int sides = 0; count > 0 && *jams && sides < combinations; sides++) {
        int wrong = -1;
        for (int k = 0; k < count; k++) {
            sim->state.sides[guides[k]] = sides >> k & 1 ? -1 : 1;
        }
        bool ok = choose_by_forces(sim, touching, event, modes, jams, &other);
        if (!*jams && !(ok && find_wrong_side(sim, modes, event->turned, &wrong, &other))) {
            return fail(problem, "%s", other.text);
        }
        *jams = *jams || wrong >= 0;
    }
    return !*jams;
}

/* Choose the modes of all contacts by their forces at the front: by changes of one side at a time or,
 * if no forces satisfy the laws, for any combination of sides. */
static bool choose_all_modes(Simulation *sim, const HoldingSet *touching, const FrictionEvent *event,
                             ContactMode *modes, Problem *problem) {
    bool jams = false;
    return change_sides(sim, touching, event, modes, &jams, problem) ||
           (jams && choose_on_any_sides(sim, touching, event, modes, &jams, problem));
}

/* Remove the compliant stops that are pressed: they are no constraints. */
static void remove_pressed(const Simulation *sim, HoldingSet *stops) {
    int count = 0;
    for (int k = 0; k < stops->count; k++) {
        int i = stops->stops[k];
        stops->stops[count] = i;
        count += !is_pressed(&sim->state.touching[i]);
    }
    stops->count = count;
}

/* Choose the contact state at the front from its positions and velocities.  The projection closes
 * gaps of round-off, which changes the forces of stiff flexures: the modes are chosen again until
 * they stay the same.
 *
 * touching: open stops that touch and neither close nor open
 * event: a slip, a reversal, a change of side or an action of a spring that has just occurred, or NULL */
PRBM bool choose_modes(Simulation *sim, const int *touching, int touching_count, const Event *event,
                 Problem *problem) {
    FrictionEvent friction;
    int candidates[2 * STOPS_MAX];
    ContactMode modes[CONTACTS_MAX];
    size_t bytes = (size_t)contact_count(sim) * sizeof *modes;
    rephase_coils(sim, event && event->kind == EVENT_ACTION ? event->contact : -1);
    if (!friction_event(sim, event, &friction, problem)) {
        return false;
    }
    int count = resting_candidates(sim, touching, touching_count, candidates);
    HoldingSet all = in_order(sim, count, candidates, true);
    for (int k = 0; k < MODE_ITERATIONS_MAX; k++) {
        if (!choose_all_modes(sim, &all, &friction, modes, problem)) {
            return false;
        }
        bool same = k > 0 && memcmp(modes, sim->state.modes, bytes) == 0;
        set_contacts(sim, modes);
        if (press_released(sim)) {
            remove_pressed(sim, &all);
        }
        if (same || sim->equations.held_count == 0) {
            return true;
        }
        if (!project(&sim->equations, sim->state.front_time, sim->state.front, sim->scratch,
                     problem)) {
            return false;
        }
    }
    return contacts_fail(sim, &UNDECIDED, count, candidates, problem);
}
