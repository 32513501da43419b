/* Model exchange. */
#include <string.h>

#include "fmi/fmu.h"

PRBM int set_time(Instance *instance, double time) {
    if (!finite_number(time)) {
        return refuse(instance, FMU_ERROR, "time = %g s must be a finite number", time);
    }
    exchange_set_time(instance->simulation, time);
    return FMU_OK;
}

/* Check the number of elements of an array; log an error if it is wrong. */
static bool check_count(const Instance *instance, const char *noun, int expected, size_t count) {
    if (count == (size_t)expected) {
        return true;
    }
    refuse(instance, FMU_ERROR, "there are %d %s, not %lu", expected, noun, (unsigned long)count);
    return false;
}

PRBM int set_states(Instance *instance, const double *x, size_t count) {
    if (!check_count(instance, "continuous states", instance->states, count)) {
        return FMU_ERROR;
    }
    for (size_t i = 0; i < count; i++) {
        if (!finite_number(x[i])) {
            int slot = exchange_slot(instance->simulation, (int)i);
            return refuse(instance, FMU_DISCARD, "%s = %g must be a finite number",
                          name_of(instance->mechanism, slot), x[i]);
        }
    }
    exchange_set(instance->simulation, x);
    return FMU_OK;
}

PRBM int get_states(Instance *instance, double *x, size_t count) {
    if (!check_count(instance, "continuous states", instance->states, count) ||
        !started(instance)) {
        return FMU_ERROR;
    }
    exchange_get(instance->simulation, x);
    return FMU_OK;
}

PRBM int get_nominals(Instance *instance, double *x, size_t count) {
    if (!check_count(instance, "continuous states", instance->states, count)) {
        return FMU_ERROR;
    }
    for (size_t i = 0; i < count; i++) {
        x[i] = 1.0; /* The default of both standards, before the start. */
    }
    if (simulation_started(instance->simulation)) {
        exchange_nominals(instance->simulation, x);
    }
    return FMU_OK;
}

/* Return whether the equations can be evaluated; log the reason if not. */
static bool evaluable(Instance *instance) {
    return !has_rejected(instance, FMU_ERROR) && started(instance);
}

PRBM int get_derivatives(Instance *instance, double *dx, size_t count) {
    Problem problem;
    if (!check_count(instance, "continuous states", instance->states, count) ||
        !evaluable(instance)) {
        return FMU_ERROR;
    }
    if (!exchange_derivatives(instance->simulation, dx, &problem)) {
        return refuse(instance, FMU_DISCARD, "%s", problem.text);
    }
    return FMU_OK;
}

PRBM int get_indicators(Instance *instance, double *z, size_t count) {
    Problem problem;
    if (!check_count(instance, "event indicators", instance->indicators, count) ||
        !evaluable(instance)) {
        return FMU_ERROR;
    }
    if (!exchange_event_indicators(instance->simulation, z, &problem)) {
        return refuse(instance, FMU_DISCARD, "%s", problem.text);
    }
    for (size_t i = 0; i < count; i++) {
        if (!finite_number(z[i])) {
            return refuse(instance, FMU_DISCARD, "event indicator %d is not a finite number: the "
                                                 "states are too large; shorten the steps of the "
                                                 "solver",
                          (int)i + 1);
        }
    }
    return FMU_OK;
}

PRBM int completed_step(Instance *instance, bool *event) {
    Problem problem;
    if (!evaluable(instance)) {
        return FMU_ERROR;
    }
    if (!exchange_completed_step(instance->simulation, event, &problem)) {
        return refuse(instance, FMU_ERROR, "%s", problem.text);
    }
    return FMU_OK;
}

/* --- directional derivatives ------------------------------------------------------------------ */

/* Return why there is no derivative with respect to a parameter; NULL if there is one.  It exists in
 * the modes in which the parameter may change. */
static const char *why_constant(const Instance *instance, int slot) {
    if (instance->mode == MODE_INITIALIZATION) {
        return NULL;
    }
    if (instance->mode != MODE_EVENT) {
        return "parameters change in Initialization Mode and, if they are tunable, in Event Mode";
    }
    bool tunable = instance->mechanism->parameters[slot].tunable;
    return tunable ? NULL : "fixed parameters change in Initialization Mode only";
}

/* Add the seed of a known.  Log an error and return false if it is none in this mode. */
static bool seeded(Instance *instance, uint32_t reference, double seed) {
    const Mechanism *mechanism = instance->mechanism;
    const Variable *variable = find_variable(mechanism, reference);
    if (!variable) {
        refuse(instance, FMU_ERROR, "value reference %lu is not in modelDescription.xml: there is "
                                    "no derivative with respect to it",
               (unsigned long)reference);
        return false;
    }
    int slot = variable->slot, state = instance->state_of[slot];
    const char *why = is_parameter(mechanism, slot) ? why_constant(instance, slot) : NULL;
    if (why) {
        refuse(instance, FMU_ERROR, "there is no derivative with respect to %s: %s", variable->name,
               why);
        return false;
    }
    if (is_parameter(mechanism, slot)) {
        instance->dp[slot] += seed;
    } else if (is_input(mechanism, slot)) {
        instance->du[slot - mechanism->slots.inputs] += seed;
    } else if (state >= 0 && instance->mode != MODE_INITIALIZATION) {
        instance->dx[state] += seed;
    } else {
        refuse(instance, FMU_ERROR, "there is no derivative with respect to %s: %s", variable->name,
               state >= 0 ? "states are no knowns in Initialization Mode"
                          : "the knowns are inputs, states and parameters");
        return false;
    }
    return true;
}

/* Return the slot of an unknown.  Log an error and return -1 if it has no derivatives. */
static int differentiable(const Instance *instance, uint32_t reference) {
    const Mechanism *mechanism = instance->mechanism;
    const Variable *variable = find_variable(mechanism, reference);
    if (!variable) {
        refuse(instance, FMU_ERROR, "value reference %lu is not in modelDescription.xml: it has "
                                    "no derivative",
               (unsigned long)reference);
        return -1;
    }
    if (variable->type != REAL || settable(mechanism, variable->slot) ||
        variable->slot == mechanism->slots.time) {
        refuse(instance, FMU_ERROR, "%s has no derivative: the unknowns are outputs and "
                                    "derivatives of states",
               variable->name);
        return -1;
    }
    return variable->slot;
}

/* Change a parameter, from the state that keep has saved. */
static bool shift(Instance *instance, int slot, double x, Problem *problem) {
    go_back(instance);
    if (instance->mode == MODE_INITIALIZATION) {
        simulation_unstart(instance->simulation);
    }
    return simulation_set(instance->simulation, slot, x, problem) &&
           (simulation_started(instance->simulation) || start_instance(instance, problem));
}

/* Compute the unknowns at another value of a parameter, by slot. */
static bool values_at(Instance *instance, int slot, double x, const uint32_t *unknowns,
                      size_t count, double *values, Problem *problem) {
    bool ok = shift(instance, slot, x, problem);
    for (size_t i = 0; ok && i < count; i++) {
        int unknown = find_variable(instance->mechanism, unknowns[i])->slot;
        ok = simulation_get(instance->simulation, unknown, values + unknown, problem);
    }
    return ok;
}

/* Add the derivatives with respect to a parameter, by a difference: a central one, or a one-sided
 * one beside a bound. */
static bool add_difference(Instance *instance, int slot, const uint32_t *unknowns, size_t count,
                           double *sensitivity, Problem *problem) {
    double *high = instance->dvalues, *low = instance->shifted, x = 0.0;
    (void)simulation_get(instance->simulation, slot, &x, problem);
    double step = x != 0.0 ? DIFFERENCE_RTOL * (x < 0.0 ? -x : x) : DIFFERENCE_ATOL;
    double above = step, below = -step;
    bool ok = values_at(instance, slot, x + above, unknowns, count, high, problem);
    if (!ok) {
        above = 0.0;
        ok = values_at(instance, slot, x, unknowns, count, high, problem);
    }
    if (ok && !values_at(instance, slot, x + below, unknowns, count, low, problem)) {
        below = 0.0;
        ok = above > 0.0 && values_at(instance, slot, x, unknowns, count, low, problem);
    }
    go_back(instance);
    for (size_t i = 0; ok && i < count; i++) {
        int unknown = find_variable(instance->mechanism, unknowns[i])->slot;
        sensitivity[i] += instance->dp[slot] * (high[unknown] - low[unknown]) / (above - below);
    }
    return ok;
}

/* Add the derivatives along the change dp of the parameters. */
static bool add_differences(Instance *instance, const uint32_t *unknowns, size_t count,
                            double *sensitivity, Problem *problem) {
    keep(instance);
    for (int p = 0; p < instance->mechanism->parameter_count; p++) {
        if (instance->dp[p] != 0.0 &&
            !add_difference(instance, p, unknowns, count, sensitivity, problem)) {
            return false;
        }
    }
    return true;
}

PRBM int directional_derivative(Instance *instance, const uint32_t *unknowns, size_t unknown_count,
                                const uint32_t *knowns, size_t known_count, const double *seed,
                                double *sensitivity) {
    Problem problem;
    if (!evaluable(instance)) {
        return FMU_ERROR;
    }
    memset(instance->dx, 0, (size_t)instance->states * sizeof(double));
    memset(instance->du, 0, (size_t)instance->mechanism->input_count * sizeof(double));
    memset(instance->dp, 0, (size_t)instance->mechanism->parameter_count * sizeof(double));
    for (size_t i = 0; i < known_count; i++) {
        if (!seeded(instance, knowns[i], seed[i])) {
            return FMU_ERROR;
        }
    }
    for (size_t i = 0; i < unknown_count; i++) {
        if (differentiable(instance, unknowns[i]) < 0) {
            return FMU_ERROR;
        }
    }
    if (!exchange_directional(instance->simulation, instance->dx, instance->du, instance->dvalues,
                              &problem)) {
        return refuse(instance, instance->mode == MODE_INITIALIZATION ? FMU_ERROR : FMU_DISCARD,
                      "%s", problem.text);
    }
    for (size_t i = 0; i < unknown_count; i++) {
        sensitivity[i] = instance->dvalues[find_variable(instance->mechanism, unknowns[i])->slot];
    }
    if (!add_differences(instance, unknowns, unknown_count, sensitivity, &problem)) {
        return refuse(instance, FMU_DISCARD, "%s", problem.text);
    }
    for (size_t i = 0; i < unknown_count; i++) {
        if (!finite_number(sensitivity[i])) {
            return refuse(instance, FMU_DISCARD, "the derivative of %s is not a finite number: the "
                                                 "seed or the states are too large",
                          find_variable(instance->mechanism, unknowns[i])->name);
        }
    }
    return FMU_OK;
}
