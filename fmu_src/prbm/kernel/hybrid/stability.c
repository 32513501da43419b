/* The fastest mode and the longest stable step: the twin of hybrid/stability.py. */
#include <math.h>

#include "core/elements.h"
#include "hybrid/access.h"
#include "hybrid/stability.h"

/* Return a bound of the rate of all dampers: the sum of those of each. */
static double damper_decay(const Simulation *sim) {
    const System *system = system_of(sim);
    const Stepping *stepping = &sim->stepping;
    double *x = stepping->response, *row = stepping->torques, sum = 0.0;
    for (int k = 0; k < damper_count(system); k++) {
        double damping = damper_row(system, k, stepping->evaluation.at.e, row);
        if (damping > 0.0) {
            zeros(system->even, x);
            copy(system->n, row, x);
            zeros(sim->equations.r, stepping->multipliers);
            solve_again(&stepping->evaluation.factors, x, stepping->multipliers);
            sum += damping * dot(system->n, row, x);
        }
    }
    return greater(sum, 0.0);
}

/* Make one power iteration with the factors of the equations.  The new direction is that of the
 * accelerations x by the torques K w of the old direction w; the square of the rate is
 * x.K w / w.K w. */
PRBM void refine_fastest(Simulation *sim) {
    State *state = &sim->state;
    Stepping *stepping = &sim->stepping;
    const System *system = system_of(sim);
    int n = system->n;
    double *x = stepping->response;
    element_torques(system, stepping->evaluation.at.e, state->fastest, stepping->torques, x);
    zeros(system->even, x);
    copy(n, stepping->torques, x);
    zeros(sim->equations.r, stepping->multipliers);
    solve_again(&stepping->evaluation.factors, x, stepping->multipliers);
    double energy = dot(n, state->fastest, stepping->torques);
    double response = dot(n, x, stepping->torques), longest = largest(n, x);
    state->fastest_rate = energy > 0.0 && response > 0.0 ? square_root(response / energy) : 0.0;
    for (int j = 0; j < n && longest > 0.0; j++) {
        state->fastest[j] = x[j] / longest;
    }
    state->fastest_decay = damper_decay(sim);
}

PRBM bool find_fastest(Simulation *sim, Problem *problem) {
    State *state = &sim->state;
    int n = system_of(sim)->n;
    if (!factor_equations(&sim->equations, state->front, state->front + n, NULL,
                          &sim->stepping.evaluation, problem)) {
        return false;
    }
    for (int j = 0; j < n; j++) {
        state->fastest[j] = 1.0 / (1.0 + j);
    }
    double change = HUGE_VAL;
    for (int i = 0; i < FASTEST_ITERATIONS_MAX && change > FASTEST_RATE_RTOL; i++) {
        double last = state->fastest_rate;
        refine_fastest(sim);
        change = fabs(state->fastest_rate - last) / greater(state->fastest_rate, last);
    }
    return true;
}

PRBM bool simulation_check_effort(const Simulation *simulation, Problem *problem) {
    return simulation_check_step(simulation, simulation->configuration.mechanism->default_step,
                                 problem);
}

PRBM bool simulation_check_step(const Simulation *simulation, double step, Problem *problem) {
    double needed = step / stable_step(simulation);
    if (needed > DEFAULT_EFFORT_MAX) {
        return fail(problem,
                    "the fastest mode has %.4g Hz: a communication step of %g s would need %.4g "
                    "integration steps, more than %g; check the units of lengths, stiffnesses, "
                    "masses and damping.beta",
                    simulation->state.fastest_rate / TWO_PI, step, needed, DEFAULT_EFFORT_MAX);
    }
    return true;
}

PRBM double stable_step(const Simulation *sim) {
    double rate = sim->state.fastest_rate;
    double damping = sim->equations.beta * (rate * rate) + sim->equations.mass_damping;
    damping += sim->state.fastest_decay;
    if (damping > 2.0 * rate) {
        rate = 0.5 * (damping + square_root(damping * damping - 4.0 * (rate * rate)));
    }
    return rate > 0.0 ? STABLE_STEP_FACTOR / rate : HUGE_VAL;
}
