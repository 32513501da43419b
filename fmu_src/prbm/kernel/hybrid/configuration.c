/* The assembled mechanism and the scales of its motion: the twin of hybrid/configuration.py. */
#include <math.h>
#include <string.h>

#include "core/modal.h"
#include "hybrid/configuration.h"

PRBM double zero_speed(const Configuration *configuration) {
    const Scales *scales = &configuration->scales;
    return ZERO_RATE_RTOL * scales->rate * scales->length;
}

PRBM double zero_acceleration(const Configuration *configuration) {
    const Scales *scales = &configuration->scales;
    return ZERO_RATE_RTOL * scales->rate * scales->rate * scales->length;
}

PRBM double zero_force(const Configuration *configuration) {
    const Scales *scales = &configuration->scales;
    return ZERO_RATE_RTOL * scales->energy / scales->length;
}

PRBM double closing_depth(const Configuration *configuration) {
    return TOUCHING_RTOL * configuration->scales.length;
}

PRBM double release_penetration(const Configuration *configuration) {
    return RELEASE_PENETRATION_RTOL * configuration->scales.length;
}

/* The scale of rates is the fundamental angular frequency; if it is zero, the rate of a fall or of
 * the initial motion.  The scale of energies is the torque of the stiffest element at one radian,
 * or at a displacement of the size; without elements, the largest inertia times the square of the rate. */
/* Return the length of the arm of a direction in units of inertias: displacements have none. */
static double arm_length(const System *system, int j) {
    return is_float(system, j) || is_shift(system, j) ? system->length : 1.0;
}

PRBM bool set_scales(Configuration *configuration, double frequency, Scratch scratch,
                     Problem *problem) {
    const System *system = &configuration->system;
    Scales *scales = &configuration->scales;
    int n = system->n;
    double torsion = 0.0, heaviest = 0.0;
    const Coordinate *coordinates = system->mechanism->coordinates;
    for (int i = 0; i < n * n; i++) {
        bool turns = coordinates[i / n].strain < 0 && coordinates[i % n].strain < 0;
        torsion = turns ? greater(torsion, fabs(system->stiffness[i])) : torsion;
    }
    for (int i = 0; i < system->d * system->d; i++) {
        double lengths = arm_length(system, i / system->d) * arm_length(system, i % system->d);
        heaviest = greater(heaviest, modulus(system->H[i]) * lengths);
    }
    double fast = configuration->omega = scales->rate = TWO_PI * frequency;
    if (frequency == 0.0 && !slow_rates(system, &scales->rate, &fast, scratch, problem)) {
        return false;
    }
    scales->length = system->length;
    double kinetic = heaviest * (scales->rate * scales->rate);
    scales->energy = torsion <= STIFFNESS_ROUNDING_RTOL * kinetic ? kinetic : torsion;
    scales->time = TWO_PI / fast;
    int first = system->mechanism->first_extra, count = system->mechanism->state_count;
    configuration->controlled = (double)first;
    for (int j = first; j < count; j++) {
        configuration->least[j] = HUGE_VAL; /* The error of these states is not controlled. */
        configuration->share[j] = 0.0;
    }
    for (int j = 0; j < first; j++) {
        bool angle = j < n;
        configuration->least[j] = angle ? 1.0 : j < 2 * n ? scales->rate : scales->energy;
        configuration->share[j] = angle ? 0.0 : 1.0;
    }
    return true;
}

PRBM bool take_values(Simulation *sim, Problem *problem) {
    Configuration *configuration = &sim->configuration;
    const Mechanism *m = configuration->mechanism;
    State *state = &sim->state;
    copy(m->parameter_count, state->values, state->acting_values);
    copy(m->input_count, state->given, state->acting_given);
    configuration->assembled = check_values(m, state->acting_values, problem) &&
                               assemble(&configuration->system, state->acting_values,
                                        sim->scratch, problem);
    return configuration->assembled;
}

PRBM bool values_changed(const Simulation *sim) {
    size_t bytes = (size_t)sim->configuration.mechanism->parameter_count * sizeof(double);
    return memcmp(sim->state.values, sim->state.acting_values, bytes) != 0;
}

/* Whether the inputs from an index up to another have changed since they began to act. */
static bool changed_between(const Simulation *sim, int from, int to) {
    return memcmp(sim->state.given + from, sim->state.acting_given + from,
                  (size_t)(to - from) * sizeof(double)) != 0;
}

PRBM bool inputs_changed(const Simulation *sim) {
    const Mechanism *m = sim->configuration.mechanism;
    return changed_between(sim, 0, m->input.walls) ||
           changed_between(sim, m->input.impulses, m->input_count);
}

PRBM bool walls_changed(const Simulation *sim) {
    const InputGroups *from = &sim->configuration.mechanism->input;
    return changed_between(sim, from->walls, from->impulses);
}

PRBM double field_value(const Simulation *sim, Expression field) {
    return evaluate(field, sim->state.acting_values);
}

PRBM double field_change(const Simulation *sim, Expression field) {
    return evaluate(field, sim->state.values) - evaluate(field, sim->state.acting_values);
}
