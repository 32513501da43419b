/* The number of integration steps of a communication step, and why there are too many. */
#include "hybrid/access.h"
#include "hybrid/compliant.h"
#include "hybrid/contact_names.h"
#include "hybrid/effort.h"
#include "hybrid/stability.h"

/* Find the pressed stop whose damping is the fastest, -1 for none, and its rate [1/s]. */
static bool fastest_damping(Simulation *sim, const double *gaps, int *stop, double *rate,
                            Problem *problem) {
    *stop = -1;
    *rate = 0.0;
    for (int i = 0; i < sim->configuration.mechanism->stop_count; i++) {
        double found;
        if (!is_pressed(&sim->state.touching[i])) {
            continue;
        }
        if (!damping_rate(sim, i, -gaps[i], &found, problem)) {
            return false;
        }
        if (*stop < 0 || found > *rate) {
            *stop = i;
            *rate = found;
        }
    }
    return true;
}

/* Fail, and name why the steps are short, and what to do. */
static bool reject(Simulation *sim, const Effort *effort, int steps, Problem *problem) {
    const State *state = &sim->state;
    double gaps[STOPS_MAX], rates[STOPS_MAX], rate;
    int stop;
    gaps_and_rates(sim, gaps, rates);
    if (!fastest_damping(sim, gaps, &stop, &rate, problem)) {
        return false;
    }
    if (rate * state->step_size > 1.0) {
        return fail(problem,
                    "%d integration steps lead from t = %.9g s only to t = %.9g s: %s is indented "
                    "by %.3g m, and its damping acts within %.3g s: reduce the preload or the "
                    "stiffness",
                    steps, effort->since, state->front_time,
                    contact_name(sim->configuration.mechanism, stop), -gaps[stop], 1.0 / rate);
    }
    return fail(problem,
                "%d integration steps lead from t = %.9g s only to t = %.9g s: the kinetic energy "
                "is %.3g J: reduce impulses, forces and speeds, check units, or make shorter "
                "communication steps",
                steps, effort->since, state->front_time,
                kinetic_energy(sim, state->front + system_of(sim)->n, sim->scratch));
}

PRBM bool count_step(Simulation *sim, double time, Effort *effort, Problem *problem) {
    const State *state = &sim->state;
    double span = EVENT_WINDOW_RTOL * sim->configuration.scales.time;
    if (effort->steps >= EFFORT_MAX) {
        return fail(problem,
                    "t = %.12g s is not reached in %d integration steps, which end at t = %.9g s "
                    "with steps of %.3g s: make shorter communication steps, or check units and "
                    "stiffnesses",
                    time, EFFORT_MAX, state->front_time, state->step_size);
    }
    if (effort->steps == 0 || state->front_time - effort->since > span) {
        effort->since = state->front_time;
        effort->before = effort->steps;
    }
    int here = effort->steps - effort->before;
    effort->steps++;
    return here < BURST_STEPS_MAX ||
           here - BURST_STEPS_MAX < FASTEST_STEPS_FACTOR * span / stable_step(sim) ||
           reject(sim, effort, here, problem);
}
