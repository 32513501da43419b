/* Values of variables. */
#include "fmi/fmu.h"

static const char *type_of(const Instance *instance, const Variable *variable) {
    return instance->standard->types[variable->type];
}

static bool required(const Instance *instance, uint32_t reference) {
    for (size_t i = 0; i < instance->required_count; i++) {
        if (instance->required[i] == reference) {
            return true;
        }
    }
    return false;
}

/* Return the variable of a reference if it can be read as a type; otherwise log an error and return
 * NULL. */
static const Variable *readable(const Instance *instance, uint32_t reference, int type) {
    const Variable *variable = find_variable(instance->mechanism, reference);
    if (!variable) {
        refuse(instance, FMU_ERROR, "value reference %lu is not in modelDescription.xml: it has "
                                    "no value",
               (unsigned long)reference);
    } else if (variable->type != type) {
        const char *actual = type_of(instance, variable);
        refuse(instance, FMU_ERROR, "%s is of type %s: get it with %sGet%s", variable->name,
               actual, instance->standard->prefix, actual);
    } else if (instance->mode == MODE_INTERMEDIATE && !required(instance, reference)) {
        refuse(instance, FMU_ERROR, "%s is not among the requiredIntermediateVariables: get it "
                                    "after the step, or list it at instantiation",
               variable->name);
    } else {
        return variable;
    }
    return NULL;
}

PRBM int read_value(Instance *instance, uint32_t reference, int type, double *x) {
    const Mechanism *mechanism = instance->mechanism;
    const Variable *variable = readable(instance, reference, type);
    Problem problem;
    if (!variable) {
        return FMU_ERROR;
    }
    int slot = variable->slot;
    if (slot == mechanism->slots.time && !simulation_started(instance->simulation)) {
        *x = instance->start_time;
        return FMU_OK;
    }
    if (instance->mode == MODE_INITIALIZATION && !settable(mechanism, slot) &&
        !started(instance)) {
        return FMU_ERROR;
    }
    if (!settable(mechanism, slot) && !simulation_started(instance->simulation)) {
        return refuse(instance, FMU_ERROR, "%s has no value before the instance is initialized: "
                                           "get it in Initialization Mode or later",
                      variable->name);
    }
    if (!simulation_get(instance->simulation, slot, x, &problem)) {
        bool shorter = instance->mode == MODE_EVENT || instance->mode == MODE_CONTINUOUS;
        bool discard = shorter && instance->kind == MODEL_EXCHANGE;
        return refuse(instance, discard ? FMU_DISCARD : FMU_ERROR, "%s", problem.text);
    }
    return FMU_OK;
}

/* Mark a variable as rejected until it is set to a valid value. */
static int refuse_set(Instance *instance, int slot) {
    instance->refused[slot] = 1;
    return FMU_ERROR;
}

/* Return the variable of a reference if it can be set as a type; otherwise log an error and return
 * NULL. */
static const Variable *writable(Instance *instance, uint32_t reference, int type) {
    const Variable *variable = find_variable(instance->mechanism, reference);
    if (!variable) {
        refuse(instance, FMU_ERROR, "value reference %lu is not in modelDescription.xml: it "
                                    "cannot be set; " TO_RESET,
               (unsigned long)reference);
        instance->unknown_refused = true;
        instance->unknown = reference;
        return NULL;
    }
    const char *actual = type_of(instance, variable);
    int slot = variable->slot;
    bool state = instance->kind == MODEL_EXCHANGE && instance->state_of[slot] >= 0;
    if (!settable(instance->mechanism, slot) && !state) {
        refuse(instance, FMU_ERROR, "%s is not a parameter or input: it cannot be set; " TO_RESET,
               variable->name);
    } else if (variable->type != type) {
        refuse(instance, FMU_ERROR, "%s is of type %s: set it with %sSet%s", variable->name,
               actual, instance->standard->prefix, actual);
    } else if (state && instance->mode != MODE_CONTINUOUS) {
        refuse(instance, FMU_ERROR, "%s is a state: it can be set in %s only; " TO_RESET,
               variable->name, instance->standard->modes[MODE_CONTINUOUS]);
    } else {
        return variable;
    }
    refuse_set(instance, slot);
    return NULL;
}

static int write_state(Instance *instance, const Variable *variable, double x) {
    if (!finite_number(x)) {
        return refuse(instance, FMU_DISCARD, "%s = %g must be a finite number", variable->name, x);
    }
    exchange_get(instance->simulation, instance->x);
    instance->x[instance->state_of[variable->slot]] = x;
    exchange_set(instance->simulation, instance->x);
    instance->refused[variable->slot] = 0;
    return FMU_OK;
}

/* Return false and log an error for a fixed parameter after the start of the simulation.  Values
 * out of bounds pass, because simulation_set rejects them. */
static bool check_changeable(const Instance *instance, int slot, double x, double present) {
    Problem problem;
    if (!is_parameter(instance->mechanism, slot) || !simulation_started(instance->simulation)) {
        return true;
    }
    const Parameter *parameter = &instance->mechanism->parameters[slot];
    if (parameter->tunable || !check_parameter(parameter, x, &problem)) {
        return true;
    }
    const char *unit = parameter->unit, *space = *unit ? " " : "";
    refuse(instance, FMU_ERROR, "%s = %.10g%s%s rejected: the parameter is fixed once the "
                                "simulation has started; set it back to %.10g%s%s, or reset the "
                                "instance and set it before initialization",
           parameter->name, x, space, unit, present, space, unit);
    return false;
}

/* Return the kind of a variable if the present mode forbids to set it, because it can be set in
 * Event Mode only; otherwise NULL. */
static const char *event_mode_kind(const Instance *instance, int slot) {
    const Mechanism *m = instance->mechanism;
    int impulses = m->slots.inputs + m->input.impulses;
    bool exchange = instance->mode == MODE_CONTINUOUS;
    bool impulse = slot >= impulses && slot < impulses + LOADS * m->force_count;
    if (impulse && (exchange || (instance->mode == MODE_STEP && instance->event_mode))) {
        return "an impulse";
    }
    return exchange && is_parameter(m, slot) ? "a parameter" : NULL;
}

PRBM int write_value(Instance *instance, uint32_t reference, int type, double x) {
    const Variable *variable = writable(instance, reference, type);
    Problem problem;
    if (!variable) {
        return FMU_ERROR;
    }
    int slot = variable->slot;
    if (!settable(instance->mechanism, slot)) {
        return write_state(instance, variable, x);
    }
    double present = 0.0;
    bool known = simulation_get(instance->simulation, slot, &present, &problem);
    if (known && present == x) { /* Corrects a rejected value of a fixed parameter. */
        instance->refused[slot] = 0;
        return FMU_OK;
    }
    const char *discrete = event_mode_kind(instance, slot);
    if (discrete) {
        refuse(instance, FMU_ERROR, "%s is %s: it can be set in %s, not in %s", variable->name,
               discrete, instance->standard->modes[MODE_EVENT],
               instance->standard->modes[instance->mode]);
        return refuse_set(instance, slot);
    }
    if (instance->mode == MODE_INITIALIZATION) {
        simulation_unstart(instance->simulation);
    }
    if (!check_changeable(instance, slot, x, present)) {
        return refuse_set(instance, slot);
    }
    if (!simulation_set(instance->simulation, slot, x, &problem)) {
        refuse(instance, FMU_ERROR, "%s", problem.text);
        return refuse_set(instance, slot);
    }
    instance->refused[slot] = 0;
    return FMU_OK;
}

PRBM bool ticks(const Instance *instance, const Variable *clock) {
    int stop = (clock->slot - instance->mechanism->slots.latched) / PER_LATCHED;
    return impact_count(instance, stop) != instance->acknowledged[stop];
}

/* Read whether a clock ticks in this super-dense instant, because its stop has had an impact. */
PRBM int read_clock(Instance *instance, uint32_t reference, bool *active) {
    const Variable *variable = readable(instance, reference, CLOCK);
    if (!variable) {
        return FMU_ERROR;
    }
    *active = ticks(instance, variable);
    return FMU_OK;
}
