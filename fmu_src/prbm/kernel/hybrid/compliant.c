/* Contacts at compliant stops: first touch, switches of the phase, freezing and separation: the
 * twin of hybrid/compliant.py. */
#include <math.h>

#include "core/friction.h"
#include "core/matrix.h"
#include "core/modal.h"
#include "core/vectors.h"
#include "hybrid/access.h"
#include "hybrid/compliant.h"
#include "hybrid/configuration.h"
#include "hybrid/contact_modes.h"
#include "hybrid/contact_peaks.h"
#include "hybrid/errors.h"
#include "hybrid/phases.h"

/* Coordinates, rates and M phi at the first touch of a compliant stop, (3 n,). */
static double *first_state(const Simulation *sim, int stop) {
    return sim->state.first + 3 * system_of(sim)->n * (stop_of(sim, stop)->extra / EXTRA_STATES);
}

static double rest_speed_of(const Simulation *sim, int stop) {
    return field_value(sim, stop_of(sim, stop)->rest_speed);
}

/* --- resets ----------------------------------------------------------------------------------- */

/* Begin a contact with a closing speed. */
static bool begin_contact(Simulation *sim, int stop, double speed, bool counted,
                          Problem *problem) {
    Scratch scratch = sim->scratch;
    const System *system = system_of(sim);
    int n = system->n;
    const double *front = sim->state.front, *extra = extra_of(sim, sim->state.front, stop);
    double least = greater(rest_speed_of(sim, stop), zero_speed(&sim->configuration));
    double *first = first_state(sim, stop);
    ContactStart begun = {
        sim->state.front_time, counted, extra[EXTRA_IMPULSE], extra[EXTRA_LOSS], false, 0.0, 0.0};
    bool ok = true;
    sim->state.touches[stop] = begun;
    copy(2 * n, front, first);
    zeros(n, first + 2 * n);
    if (counted) {
        double *phi = take(&scratch, (size_t)n), *M = take_matrix(&scratch, n, n);
        ok = fundamental_at(system, front, phi, M, scratch, problem);
        for (int j = 0; ok && j < n; j++) {
            first[2 * n + j] = dot(n, M + j * n, phi);
        }
    }
    set_phase(sim, stop, PHASE_PRESSED, greater(speed, least), 0.0);
    return ok;
}

PRBM bool preload(Simulation *sim, Problem *problem) {
    double gaps[STOPS_MAX], rates[STOPS_MAX];
    bool ok = true;
    gaps_and_rates(sim, gaps, rates);
    for (int i = 0; ok && i < system_of(sim)->s; i++) {
        if (stop_of(sim, i)->compliant && gaps[i] < 0.0) {
            ok = check_depth(sim, i, -gaps[i], sim->state.front_time, problem) &&
                 begin_contact(sim, i, 0.0, false, problem);
        }
    }
    return ok;
}

static bool point_mobility(Simulation *sim, int stop, double *result, Problem *problem);

/* Raise the reference speed after first touch to the one that the contact will reach.  Forces that
 * push the body into the stop raise its speed until the force of the contact equals them.  A larger
 * rise is integrated. */
static bool raise_reference(Simulation *sim, int stop, double rate, double inverse_mass,
                            Problem *problem) {
    const ComplianceLaw *law = &sim->equations.laws[stop];
    double speed = sim->state.touching[stop].reference_speed, acceleration;
    if (rate < speed) {
        return true;
    }
    if (!indentation_acceleration(sim, stop, &acceleration, problem)) {
        return false;
    }
    if (acceleration <= 0.0) {
        return true;
    }
    double depth = contact_depth(law, acceleration / (inverse_mass * (1.0 + law->damping)));
    double rise = acceleration * depth * law->exponent / ((law->exponent + 1.0) * speed * speed);
    if (rise <= FIRST_RISE_MAX) {
        set_phase(sim, stop, PHASE_PRESSED, speed * square_root(1.0 + 2.0 * rise), 0.0);
    }
    return true;
}

/* Shorten the first step of a contact to a fraction of the depth of a free hit over its speed. */
static void shorten_step(Simulation *sim, int stop, double inverse_mass);

PRBM bool touch(Simulation *sim, int stop, Problem *problem) {
    double gaps[STOPS_MAX], rates[STOPS_MAX], inverse_mass;
    Latched *latched = &sim->state.latched[stop];
    gaps_and_rates(sim, gaps, rates);
    double speed = -rates[stop];
    bool counted = speed >= rest_speed_of(sim, stop);
    if (!begin_contact(sim, stop, speed, counted, problem)) {
        return false;
    }
    if (counted) {
        Latched fresh = {0};
        fresh.count = latched->count + (latched->count < IMPACT_COUNT_MAX);
        fresh.time = sim->state.front_time;
        fresh.approach_speed = speed;
        *latched = fresh;
    }
    if (!point_mobility(sim, stop, &inverse_mass, problem) ||
        !raise_reference(sim, stop, speed, inverse_mass, problem) || !rephase(sim, problem) ||
        !choose_modes(sim, NULL, 0, NULL, problem)) {
        return false;
    }
    shorten_step(sim, stop, inverse_mass);
    return true;
}

PRBM bool switch_phase(Simulation *sim, int stop, Problem *problem) {
    double gaps[STOPS_MAX], rates[STOPS_MAX];
    ContactPhase touching = sim->state.touching[stop];
    gaps_and_rates(sim, gaps, rates);
    if (touching.phase == PHASE_PRESSED && -rates[stop] > 0.0) {
        if (!rephase(sim, problem)) {
            return false;
        }
        const ContactPhase *now = &sim->state.touching[stop];
        if (now->phase == PHASE_PRESSED && now->reference_speed == touching.reference_speed) {
            /* The rate is below the reference speed only up to the error of the event's time. */
            set_phase(sim, stop, PHASE_RISING, touching.reference_speed, 0.0);
        }
    } else {
        /* At the end of a phase, the rate is that of the other phase only up to round-off. */
        bool rises = touching.phase == PHASE_RISING;
        double speed = touching.reference_speed;
        set_phase(sim, stop, touching.phase == PHASE_PRESSED ? PHASE_FREE : PHASE_PRESSED,
                  rises ? greater(speed, -rates[stop]) : speed, 0.0);
    }
    return choose_modes(sim, NULL, 0, NULL, problem);
}

/* Return -(m^T v+) / (m^T v-) with m = M phi at first touch; 0 if m^T v- is round-off. */
static double modal_ratio(Simulation *sim, int stop) {
    int n = system_of(sim)->n;
    const double *after = sim->state.front + n;
    const double *before = first_state(sim, stop) + n, *momentum = before + n;
    double arriving = dot(n, momentum, before), size = 0.0;
    for (int j = 0; j < n; j++) {
        size += fabs(momentum[j]) * (fabs(before[j]) + fabs(after[j]));
    }
    return fabs(arriving) <= ZERO_MODE_RTOL * size ? 0.0 : -dot(n, momentum, after) / arriving;
}

/* Latch the outputs of an impact that ends, and report it. */
static void end_impact(Simulation *sim, int stop) {
    double gaps[STOPS_MAX], rates[STOPS_MAX];
    int n = system_of(sim)->n;
    ContactStart *begun = &sim->state.touches[stop];
    Latched *latched = &sim->state.latched[stop];
    const double *extra = extra_of(sim, sim->state.front, stop);
    const double *first = first_state(sim, stop);
    if (!begun->counted) {
        return;
    }
    gaps_and_rates(sim, gaps, rates);
    latched->rebound_speed = rates[stop];
    latched->impulse = extra[EXTRA_IMPULSE] - begun->impulse;
    latched->energy_lost = extra[EXTRA_LOSS] - begun->loss;
    latched->contact_duration = sim->state.front_time - begun->time;
    latched->modal_restitution = modal_ratio(sim, stop);
    begun->counted = false;
    report_impact(sim, stop, first, first + n, sim->state.front + n);
}

/* Return to the step size before a contact that ends: it does not shorten the steps after it. */
static void resume_step(Simulation *sim, int stop) {
    sim->state.step_size = greater(sim->state.step_size, sim->state.touches[stop].step);
}

PRBM bool separate(Simulation *sim, int stop, Problem *problem) {
    end_impact(sim, stop);
    resume_step(sim, stop);
    set_phase(sim, stop, PHASE_NONE, 0.0, 0.0);
    return choose_modes(sim, NULL, 0, NULL, problem);
}

/* --- freezing --------------------------------------------------------------------------------- */

/* Compute the inverse effective mass of a hit point at the front, with that of its wall. */
static bool point_mobility(Simulation *sim, int stop, double *result, Problem *problem) {
    Scratch scratch = sim->scratch;
    const System *system = system_of(sim);
    double *G = take(&scratch, (size_t)system->n);
    ContactProblem *at = contact_problem_at(sim, sim->state.front, scratch);
    Rows gaps = gap_rows(system);
    row_jacobian(&gaps, stop, at->e, G);
    bool ok = mobility(at, G, result, scratch, problem);
    *result += sim->equations.inputs.mobilities[stop];
    return ok;
}

PRBM bool damping_rate(Simulation *sim, int stop, double depth, double *rate, Problem *problem) {
    const ComplianceLaw *law = &sim->equations.laws[stop];
    double speed = sim->state.touching[stop].reference_speed;
    bool ok = point_mobility(sim, stop, rate, problem);
    *rate *= law->damping * elastic_force(law, depth) / speed;
    return ok;
}

static void shorten_step(Simulation *sim, int stop, double inverse_mass) {
    const ContactPhase *touching = &sim->state.touching[stop];
    const ComplianceLaw *law = &sim->equations.laws[stop];
    double speed = touching->reference_speed, rise = law->exponent + 1.0;
    if (!is_pressed(touching)) {
        return;
    }
    double work = 0.5 * rise * (speed * speed) / (law->stiffness * inverse_mass);
    double factor = law->exponent == 1.0 ? TOUCH_STEP_FACTOR : TOUCH_STEP_CURVED_FACTOR;
    double h = rounded_step(factor * power(work, 1.0 / rise) / speed);
    sim->state.touches[stop].step = sim->state.step_size;
    sim->state.step_size = lesser(h, sim->state.step_size);
}

PRBM double kinetic_energy(Simulation *sim, const double *v, Scratch scratch) {
    int n = system_of(sim)->n;
    ContactProblem *at = contact_problem_at(sim, sim->state.front, scratch);
    double sum = 0.0;
    for (int j = 0; j < n; j++) {
        sum += 0.5 * v[j] * dot(n, at->M + j * n, v);
    }
    return sum;
}

/* Project the front onto the constraint of a stop that freezes, and book the loss. */
static bool stop_motion(Simulation *sim, int stop, Problem *problem) {
    Scratch scratch = sim->scratch;
    int n = system_of(sim)->n;
    double *front = sim->state.front, *before = take(&scratch, (size_t)n);
    copy(n, front + n, before);
    double loss = kinetic_energy(sim, before, scratch);
    bool ok = project(&sim->equations, sim->state.front_time, front, scratch, problem);
    loss -= kinetic_energy(sim, front + n, scratch);
    front[2 * n] += loss;
    extra_of(sim, front, stop)[EXTRA_LOSS] += loss;
    return ok;
}

/* Whether other constraints, such as its own friction, hold a hit point at rest. */
static bool is_stuck(Simulation *sim, int stop, bool *result, Problem *problem) {
    Scratch scratch = sim->scratch;
    const Equations *eq = &sim->equations;
    int n = eq->system->n;
    *result = false;
    if (eq->r == eq->system->r) {
        return true; /* There are no constraints but the loops. */
    }
    double *G = take(&scratch, (size_t)n), *held = take_matrix(&scratch, eq->r, n);
    ContactProblem *at = contact_problem_at(sim, sim->state.front, scratch);
    Rows gaps = gap_rows(eq->system);
    row_jacobian(&gaps, stop, at->e, G);
    jacobian(&eq->active, at->e, held);
    bool moves = true, ok = independent(at, eq->r, held, G, &moves, scratch, problem);
    *result = !moves;
    return ok;
}

PRBM void fold_recoil(Wall *wall, double t, double *extra) {
    wall->position += extra[EXTRA_RECOIL] - extra[EXTRA_RECOIL_RATE] * (t - wall->since);
    wall->rate += extra[EXTRA_RECOIL_RATE];
    extra[EXTRA_RECOIL] = extra[EXTRA_RECOIL_RATE] = 0.0;
}

PRBM void fold_recoils(Simulation *sim) {
    for (int i = 0; i < system_of(sim)->s; i++) {
        if (stop_of(sim, i)->compliant) {
            double *extra = extra_of(sim, sim->state.front, i);
            fold_recoil(&sim->state.walls[i], sim->state.front_time, extra);
        }
    }
}

/* A contact, its wall and its states before an attempt to freeze it. */
typedef struct {
    ContactPhase touching;
    ContactMode mode;
    Wall wall;
    double recoil, recoil_rate;
    bool has_k1;
} Unfrozen;

/* Make a pressed stop a constraint. */
static Unfrozen hold_contact(Simulation *sim, int stop, double depth) {
    State *state = &sim->state;
    double *extra = extra_of(sim, state->front, stop);
    Unfrozen before = {state->touching[stop], state->modes[stop],     state->walls[stop],
                        extra[EXTRA_RECOIL],     extra[EXTRA_RECOIL_RATE], state->has_k1};
    fold_recoil(&state->walls[stop], state->front_time, extra);
    set_phase(sim, stop, PHASE_FROZEN, before.touching.reference_speed, depth);
    return before;
}

/* Undo hold_contact. */
static void press_again(Simulation *sim, int stop, const Unfrozen *before) {
    State *state = &sim->state;
    double *extra = extra_of(sim, state->front, stop);
    state->walls[stop] = before->wall;
    extra[EXTRA_RECOIL] = before->recoil;
    extra[EXTRA_RECOIL_RATE] = before->recoil_rate;
    state->modes[stop] = before->mode;
    set_phase(sim, stop, before->touching.phase, before->touching.reference_speed, 0.0);
    state->has_k1 = before->has_k1;
}

/* A pressed contact that vibrates slowly: the force of the constraint that would hold it, its
 * elastic force, and the contact time, half the period of small vibrations. */
typedef struct {
    bool calm;
    double force, elastic, time;
} Rest;

/* Compute the force of the constraint that would hold a contact at its indentation. */
static bool holding_force(Simulation *sim, int stop, double depth, double *force,
                          Problem *problem) {
    const double *q = sim->state.front, *v = q + system_of(sim)->n;
    Unfrozen before = hold_contact(sim, stop, depth);
    bool ok = evaluate_equations(&sim->equations, sim->state.front_time, q, v,
                                 extra_states(sim, q), NULL, &sim->at_front, problem);
    *force = ok ? stop_force(&sim->equations, sim->at_front.lam, stop) : 0.0;
    press_again(sim, stop, &before);
    return ok;
}

/* Compute the rest of a contact.  It is calm if it would pass its balance more slowly than
 * rest_speed.  A contact that is stuck does not move: it stays a force. */
static bool rest_of_contact(Simulation *sim, int stop, double depth, double rate, Rest *rest,
                            Problem *problem) {
    const ComplianceLaw *law = &sim->equations.laws[stop];
    double least = rest_speed_of(sim, stop), inverse_mass;
    bool stuck = false;
    rest->calm = false;
    if (sim->state.touching[stop].phase == PHASE_FREE || depth <= 0.0 || fabs(rate) >= least) {
        return true;
    }
    if (!is_stuck(sim, stop, &stuck, problem)) {
        return false;
    }
    if (stuck) {
        return true;
    }
    if (!point_mobility(sim, stop, &inverse_mass, problem) ||
        !holding_force(sim, stop, depth, &rest->force, problem)) {
        return false;
    }
    double stiffness = contact_tangent(law, depth);
    rest->elastic = elastic_force(law, depth);
    rest->time = 0.5 * TWO_PI / square_root(stiffness * inverse_mass);
    double speed = (rest->force - rest->elastic) * square_root(inverse_mass / stiffness);
    rest->calm = rest->force > 0.0 && square_root(rate * rate + speed * speed) < least;
    return true;
}

/* Whether a contact can freeze: the constraint is released at twice this difference. */
static bool is_balanced(const Rest *rest) {
    double limit = FREEZING_FACTOR * FROZEN_FORCE_RTOL * rest->elastic;
    return fabs(rest->force - rest->elastic) <= limit;
}

/* Record since when a contact is calm; *due: whether it has been calm for a contact time. */
static bool watch_contact(Simulation *sim, int stop, double gap_now, double rate, Rest *rest,
                          bool *due, Problem *problem) {
    ContactStart *begun = &sim->state.touches[stop];
    *due = false;
    if (!is_pressed(&sim->state.touching[stop])) {
        return true;
    }
    if (!rest_of_contact(sim, stop, -gap_now, rate, rest, problem)) {
        return false;
    }
    begun->calm_since = !rest->calm ? 0.0 : begun->calm ? begun->calm_since : sim->state.front_time;
    begun->calm = rest->calm;
    *due = rest->calm && sim->state.front_time - begun->calm_since >= rest->time;
    return true;
}

/* Settle a contact; its kinetic energy is a loss. */
static bool freeze_contact(Simulation *sim, int stop, double depth, Problem *problem) {
    (void)hold_contact(sim, stop, depth);
    sim->state.arc.valid = false;
    if (!stop_motion(sim, stop, problem)) {
        return false;
    }
    end_impact(sim, stop);
    sim->state.touches[stop].calm = false;
    sim->state.touches[stop].calm_since = 0.0;
    if (!choose_modes(sim, NULL, 0, NULL, problem)) {
        return false;
    }
    resume_step(sim, stop);
    return true;
}

PRBM bool freeze_calm(Simulation *sim, double *balances, Problem *problem) {
    double gaps[STOPS_MAX], rates[STOPS_MAX];
    if (!latch_peaks(sim, sim->state.front_time, problem)) {
        return false;
    }
    gaps_and_rates(sim, gaps, rates);
    for (int i = 0; i < system_of(sim)->s; i++) {
        Rest rest;
        bool due;
        balances[i] = 0.0;
        if (!watch_contact(sim, i, gaps[i], -rates[i], &rest, &due, problem)) {
            return false;
        }
        if (due && is_balanced(&rest)) {
            if (!freeze_contact(sim, i, -gaps[i], problem)) {
                return false;
            }
        } else if (due) {
            balances[i] = contact_depth(&sim->equations.laws[i], rest.force);
        }
    }
    return true;
}

PRBM bool freezes_here(Simulation *sim, bool *result, Problem *problem) {
    double gaps[STOPS_MAX], rates[STOPS_MAX];
    gaps_and_rates(sim, gaps, rates);
    *result = false;
    for (int i = 0; i < system_of(sim)->s; i++) {
        Rest rest;
        bool due;
        if (!watch_contact(sim, i, gaps[i], -rates[i], &rest, &due, problem)) {
            return false;
        }
        *result = *result || (due && is_balanced(&rest));
    }
    return true;
}
