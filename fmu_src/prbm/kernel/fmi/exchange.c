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

/* Add the seed of a known.  Log an error and return false if it is not an input or a state. */
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
    if (is_input(mechanism, slot)) {
        instance->du[slot - mechanism->slots.inputs] += seed;
    } else if (state >= 0 && instance->mode != MODE_INITIALIZATION) {
        instance->dx[state] += seed;
    } else {
        refuse(instance, FMU_ERROR, "there is no derivative with respect to %s: %s", variable->name,
               state >= 0 ? "only inputs are knowns in Initialization Mode"
                          : "the knowns are inputs and states");
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

PRBM int directional_derivative(Instance *instance, const uint32_t *unknowns, size_t unknown_count,
                                const uint32_t *knowns, size_t known_count, const double *seed,
                                double *sensitivity) {
    Problem problem;
    if (!evaluable(instance)) {
        return FMU_ERROR;
    }
    memset(instance->dx, 0, (size_t)instance->states * sizeof(double));
    memset(instance->du, 0, (size_t)instance->mechanism->input_count * sizeof(double));
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
        const Variable *unknown = find_variable(instance->mechanism, unknowns[i]);
        sensitivity[i] = instance->dvalues[unknown->slot];
        if (!finite_number(sensitivity[i])) {
            return refuse(instance, FMU_DISCARD, "the derivative of %s is not a finite number: the "
                                                 "seed or the states are too large",
                          unknown->name);
        }
    }
    return FMU_OK;
}
