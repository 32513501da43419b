/* The start of a motion: the twin of hybrid/release.py. */
#include <string.h>

#include "core/gaps.h"
#include "core/positions.h"
#include "core/start.h"
#include "hybrid/access.h"
#include "hybrid/compliant.h"
#include "hybrid/configuration.h"
#include "hybrid/contact_modes.h"
#include "hybrid/impacts.h"
#include "hybrid/peaks.h"
#include "hybrid/phases.h"
#include "hybrid/release.h"
#include "hybrid/spring_phases.h"
#include "hybrid/stability.h"
#include "hybrid/walls.h"

static void free_contacts(Simulation *sim) {
    const Mechanism *m = sim->configuration.mechanism;
    for (int contact = 0; contact < contact_count(sim); contact++) {
        bool stop = contact < m->stop_count;
        sim->state.modes[contact] = stop ? CONTACT_OPEN : CONTACT_FRICTIONLESS;
    }
    for (int i = 0; i < m->rubbing_count; i++) {
        sim->state.sides[i] = 1;
    }
}

PRBM void clear_stops(Simulation *sim) {
    State *state = &sim->state;
    size_t s = (size_t)sim->configuration.mechanism->stop_count;
    memset(state->latched, 0, s * sizeof *state->latched);
    memset(state->touching, 0, s * sizeof *state->touching);
    for (int k = 0; k < phased_coils(sim->configuration.mechanism); k++) {
        state->coils[k] = COIL_ACTING;
    }
    memset(state->touches, 0, s * sizeof *state->touches);
    memset(state->walls, 0, s * sizeof *state->walls);
    memset(state->driven, 0, s * sizeof *state->driven);
    free_contacts(sim);
}

PRBM void clear_progress(State *state, double start_time) {
    const Event none = {EVENT_NONE, 0, 0.0};
    const SimulationMode cosimulation = {false, 0.0};
    state->mode = cosimulation;
    state->started = state->has_k1 = state->arc.valid = state->interrupted = false;
    state->time = state->front_time = state->window_since = start_time;
    state->point = start_time;
    state->longest = state->arc.start = state->arc.h = state->arc.before.time = 0.0;
    state->step_size = state->log_of_error = state->fastest_rate = 0.0;
    state->fastest_decay = 0.0;
    state->tolerance = state->frequency = state->angle = state->energy = 0.0;
    state->window_count = 0;
    state->pending = none;
}

static bool check_tolerance(double x, Problem *problem) {
    if (!(x >= TOLERANCE_MIN && x <= TOLERANCE_MAX)) {
        return fail(problem, "tolerance = %g must lie between %g and %g", x, TOLERANCE_MIN,
                    TOLERANCE_MAX);
    }
    return true;
}

PRBM double simulation_requested(const Simulation *simulation, double tolerance) {
    int parameter = simulation->configuration.mechanism->tolerance;
    return tolerance == 0.0 ? simulation->state.values[parameter] : tolerance;
}

static bool start_state(Simulation *sim, Problem *problem) {
    const System *system = system_of(sim);
    Scratch scratch = sim->scratch;
    size_t n = (size_t)system->n;
    double *front = sim->state.front;
    double *q = take(&scratch, n);
    const double *values = sim->state.acting_values;
    bool ok = start_shape(system, values, q, scratch, problem);
    if (ok) {
        zeros(state_size(sim), front);
        copy((int)n, q, front);
        ok = start_velocity(system, q, values, front + n, scratch, problem);
    }
    return ok;
}

/* Reject a penetrated wall at the start.  Apply the impact if a wall is struck at the start. */
static bool check_walls(Simulation *sim, Problem *problem) {
    int n = system_of(sim)->n, struck = -1;
    const double *front = sim->state.front, t = sim->state.front_time;
    const Complex *e = contact_problem_at(sim, front, sim->scratch)->e;
    for (int i = 0; i < system_of(sim)->s; i++) {
        double distance = gap(&sim->equations, i, t, e, NULL);
        if (sim->configuration.mechanism->stops[i].compliant && distance < 0.0) {
            continue; /* A preload. */
        }
        if (distance < -release_penetration(&sim->configuration)) {
            double wall = sim->state.walls[i].position;
            const char *name = sim->configuration.mechanism->stops[i].name;
            return fail(problem,
                        "the wall %s is penetrated by %.6g m at release: %s.position = %.6g m, "
                        "the hit point is at %.6g m; move the stop or release further back",
                        name, -distance, name, wall, wall - distance);
        }
        if (struck < 0 && distance <= release_penetration(&sim->configuration) &&
            gap_rate(&sim->equations, i, t, e, front + n, NULL) < 0.0) {
            struck = i;
        }
    }
    return preload(sim, problem) && (struck < 0 || impact(sim, struck, problem));
}

/* Set the side of each rough guide to that to which it pushes without friction.  With a large coefficient
 * of friction several sides may satisfy the laws (Painleve's paradox); a motion begins with the one that
 * the force has while the coefficient grows from zero. */
static bool begin_sides(Simulation *sim, Problem *problem) {
    const System *system = system_of(sim);
    const double *y = sim->state.front;
    if (system->f == sim->configuration.mechanism->friction_count) {
        return true;
    }
    if (!evaluate_equations(&sim->equations, sim->state.front_time, y, y + system->n,
                            extra_states(sim, y), NULL, &sim->at_front, problem)) {
        return false;
    }
    for (int c = system->s; c < contact_count(sim); c++) {
        if (is_guide(system, c)) {
            double force = sim->at_front.lam[normal_row(&sim->equations, c)];
            sim->state.sides[c - system->s] = force < 0.0 ? -1 : 1;
        }
    }
    set_inputs(sim);
    return true;
}

/* Release the mechanism in its start shape, and choose the contact state there. */
static bool release_mechanism(Simulation *sim, Problem *problem) {
    int rigid[STOPS_MAX], count = 0;
    State *state = &sim->state;
    for (int i = 0; i < system_of(sim)->s; i++) {
        rigid[count] = i;
        count += !sim->configuration.mechanism->stops[i].compliant;
    }
    clear_stops(sim);
    place_walls(sim);
    copy(LOADS * sim->configuration.mechanism->force_count, given_impulses(sim), state->received);
    set_inputs(sim);
    return start_state(sim, problem) &&
           project(&sim->equations, state->time, state->front, sim->scratch, problem) &&
           begin_coils(sim) && begin_sides(sim, problem) && check_walls(sim, problem) &&
           rephase(sim, problem) && choose_modes(sim, rigid, count, NULL, problem) &&
           find_fastest(sim, problem);
}

PRBM bool start_motion(Simulation *sim, double start_time, double tolerance, SimulationMode mode,
                       Problem *problem) {
    State *state = &sim->state;
    Configuration *configuration = &sim->configuration;
    clear_progress(state, start_time);
    state->tolerance = simulation_requested(sim, tolerance);
    state->mode = mode;
    state->log_of_error = natural_log(STEP_ERROR_MIN);
    if (!check_tolerance(state->tolerance, problem) || !take_values(sim, problem) ||
        !fundamental_frequency(&configuration->system, &state->frequency, sim->scratch,
                               problem)) {
        return false;
    }
    if (!set_scales(configuration, state->frequency, sim->scratch, problem)) {
        return false;
    }
    state->tolerance = lesser(state->tolerance, TOLERANCE_USED_MAX);
    clear_peaks(sim);
    state->started = release_mechanism(sim, problem) && restart_peaks(sim, problem);
    return state->started;
}

PRBM bool simulation_instability(Simulation *simulation, int *rest, int *release,
                                 Problem *problem) {
    return instability(system_of(simulation), simulation->state.acting_values, rest, release,
                       simulation->scratch, problem);
}
