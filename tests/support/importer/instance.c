/* An instance of an FMU of FMI 2.0 or 3.0. */
#include "importer.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* --- messages of the FMU --- */

static void keep(void *environment, const char *message) {
    Instance *instance = environment;
    if (instance && message) {
        snprintf(instance->message, sizeof instance->message, "%s", message);
    }
}

void logger2(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status,
             fmi2String category, fmi2String message, ...) {
    char text[MESSAGE_LENGTH];
    va_list arguments;
    (void)name, (void)status, (void)category;
    va_start(arguments, message);
    vsnprintf(text, sizeof text, message, arguments);
    va_end(arguments);
    keep(environment, text);
}

void logger3(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category,
             fmi3String message) {
    (void)status, (void)category;
    keep(environment, message);
}

/* Return whether a status of either version is OK (0) or a warning (1); print any other. */
static bool fine(Instance *instance, int status, const char *call) {
    if (status > 1) {
        instance->failed = true;
        fprintf(stderr, "importer: %s returned %d: %s\n", call, status, instance->message);
    }
    return status <= 1;
}

/* Call the function of the FMU's version.  SAME is for functions with the same name in both. */
#define CALL(instance, name2, arguments2, name3, arguments3)                                       \
    ((instance)->library->version == 2                                                             \
         ? fine((instance), (int)(instance)->library->f2.name2 arguments2, "fmi2" #name2)          \
         : fine((instance), (int)(instance)->library->f3.name3 arguments3, "fmi3" #name3))
#define SAME(instance, name, arguments) CALL(instance, name, arguments, name, arguments)

/* --- instantiation and initialization --- */

static void *instantiate(Instance *instance) {
    const Job *job = instance->job;
    const Functions3 *f3 = &instance->library->f3;
    bool exchange = job->kind == MODEL_EXCHANGE, events = job->kind == WITH_EVENTS;
    if (job->version == 2) {
        return instance->library->f2.Instantiate(
            job->name, exchange ? fmi2ModelExchange : fmi2CoSimulation, job->token, job->resources,
            &instance->callbacks, fmi2False, fmi2True);
    }
    if (exchange) {
        return f3->InstantiateModelExchange(job->name, job->token, job->resources, false, true,
                                            instance, logger3);
    }
    return f3->InstantiateCoSimulation(job->name, job->token, job->resources, false, true, events,
                                       events, NULL, 0, instance, logger3, NULL);
}

bool instance_open(Instance *instance, const Library *library, const Job *job) {
    fmi2CallbackFunctions callbacks = {logger2, calloc, free, NULL, instance};
    memset(instance, 0, sizeof *instance);
    instance->library = library;
    instance->job = job;
    instance->callbacks = callbacks;
    instance->component = instantiate(instance);
    if (!instance->component) {
        fprintf(stderr, "importer: instantiation failed: %s\n", instance->message);
    }
    return instance->component != NULL;
}

void instance_close(Instance *instance) {
    if (instance->component && instance->library->version == 2) {
        instance->library->f2.FreeInstance(instance->component);
    } else if (instance->component) {
        instance->library->f3.FreeInstance(instance->component);
    }
    instance->component = NULL;
}

bool instance_initialize(Instance *instance) {
    const Job *job = instance->job;
    void *c = instance->component;
    for (size_t i = 0; i < job->set_count; i++) {
        if (!instance_set(instance, job->sets + i)) {
            return false;
        }
    }
    if (job->version == 2) {
        fmi2Status status = instance->library->f2.SetupExperiment(
            c, job->has_tolerance, job->tolerance, job->start, job->has_stop, job->stop);
        if (!fine(instance, (int)status, "fmi2SetupExperiment")) {
            return false;
        }
    }
    return CALL(instance, EnterInitializationMode, (c), EnterInitializationMode,
                (c, job->has_tolerance, job->tolerance, job->start, job->has_stop, job->stop)) &&
           SAME(instance, ExitInitializationMode, (c));
}

bool instance_terminate(Instance *instance) {
    return SAME(instance, Terminate, (instance->component));
}

/* --- values --- */

bool instance_set(Instance *instance, const Item *item) {
    void *c = instance->component;
    const uint32_t *reference = &item->reference;
    if (item->type == REAL_ITEM) {
        return CALL(instance, SetReal, (c, reference, 1, &item->value), SetFloat64,
                    (c, reference, 1, &item->value, 1));
    }
    int32_t integer = (int32_t)item->value;
    bool truth = integer != 0;
    if (item->type == INTEGER_ITEM) {
        return CALL(instance, SetInteger, (c, reference, 1, &integer), SetInt32,
                    (c, reference, 1, &integer, 1));
    }
    return CALL(instance, SetBoolean, (c, reference, 1, &integer), SetBoolean,
                (c, reference, 1, &truth, 1));
}

bool instance_get(Instance *instance, const Item *item, double *value) {
    void *c = instance->component;
    const uint32_t *reference = &item->reference;
    if (item->type == REAL_ITEM) {
        return CALL(instance, GetReal, (c, reference, 1, value), GetFloat64,
                    (c, reference, 1, value, 1));
    }
    int32_t integer = 0;
    bool truth = false, good;
    if (item->type == INTEGER_ITEM) {
        good = CALL(instance, GetInteger, (c, reference, 1, &integer), GetInt32,
                    (c, reference, 1, &integer, 1));
    } else {
        good = CALL(instance, GetBoolean, (c, reference, 1, &integer), GetBoolean,
                    (c, reference, 1, &truth, 1));
    }
    *value = truth ? 1.0 : (double)integer;
    return good;
}

/* --- co-simulation --- */

bool instance_step(Instance *instance, double time, double size, double *reached, bool *event) {
    void *c = instance->component;
    bool terminate = false, early = false;
    *reached = time + size;
    *event = false;
    return CALL(instance, DoStep, (c, time, size, fmi2True), DoStep,
                (c, time, size, true, event, &terminate, &early, reached));
}

/* --- events --- */

bool instance_event_mode(Instance *instance) {
    return SAME(instance, EnterEventMode, (instance->component));
}

bool instance_update(Instance *instance, Update *update) {
    bool nominals, states;
    fmi2EventInfo info;
    memset(update, 0, sizeof *update);
    memset(&info, 0, sizeof info);
    bool good = CALL(instance, NewDiscreteStates, (instance->component, &info),
                     UpdateDiscreteStates,
                     (instance->component, &update->again, &update->terminate, &nominals, &states,
                      &update->next_event_defined, &update->next_event));
    if (instance->library->version == 2) {
        update->again = info.newDiscreteStatesNeeded;
        update->terminate = info.terminateSimulation;
        update->next_event_defined = info.nextEventTimeDefined;
        update->next_event = info.nextEventTime;
    }
    return good;
}

bool instance_leave_event_mode(Instance *instance) {
    void *c = instance->component;
    if (instance->job->kind == WITH_EVENTS) {
        return fine(instance, (int)instance->library->f3.EnterStepMode(c), "fmi3EnterStepMode");
    }
    return SAME(instance, EnterContinuousTimeMode, (c));
}

/* --- model exchange --- */

bool instance_set_time(Instance *instance, double time) {
    return SAME(instance, SetTime, (instance->component, time));
}

bool instance_set_states(Instance *instance, const double *x) {
    return SAME(instance, SetContinuousStates,
                (instance->component, x, instance->job->state_count));
}

bool instance_get_states(Instance *instance, double *x) {
    return SAME(instance, GetContinuousStates,
                (instance->component, x, instance->job->state_count));
}

bool instance_derivatives(Instance *instance, double *dx) {
    size_t n = instance->job->state_count;
    return CALL(instance, GetDerivatives, (instance->component, dx, n),
                GetContinuousStateDerivatives, (instance->component, dx, n));
}

bool instance_indicators(Instance *instance, double *z) {
    return SAME(instance, GetEventIndicators,
                (instance->component, z, instance->job->indicator_count));
}

bool instance_completed(Instance *instance, bool *event) {
    void *c = instance->component;
    fmi2Boolean event2 = fmi2False, terminate2 = fmi2False;
    bool terminate = false;
    *event = false;
    bool good = CALL(instance, CompletedIntegratorStep, (c, fmi2True, &event2, &terminate2),
                     CompletedIntegratorStep, (c, true, event, &terminate));
    *event = *event || event2;
    return good;
}

/* --- the state as a whole --- */

bool instance_save(Instance *instance, void **state) {
    void *c = instance->component;
    return CALL(instance, GetFMUstate, (c, state), GetFMUState, (c, state));
}

bool instance_restore(Instance *instance, void *state) {
    void *c = instance->component;
    return CALL(instance, SetFMUstate, (c, state), SetFMUState, (c, state));
}

bool instance_forget(Instance *instance, void **state) {
    void *c = instance->component;
    return CALL(instance, FreeFMUstate, (c, state), FreeFMUState, (c, state));
}

uint8_t *instance_serialize(Instance *instance, void *state, size_t *size) {
    void *c = instance->component;
    if (!CALL(instance, SerializedFMUstateSize, (c, state, size), SerializedFMUStateSize,
              (c, state, size))) {
        return NULL;
    }
    uint8_t *bytes = malloc(*size);
    if (bytes && !CALL(instance, SerializeFMUstate, (c, state, (fmi2Byte *)bytes, *size),
                       SerializeFMUState, (c, state, bytes, *size))) {
        free(bytes);
        bytes = NULL;
    }
    return bytes;
}

bool instance_deserialize(Instance *instance, const uint8_t *bytes, size_t size, void **state) {
    void *c = instance->component;
    return CALL(instance, DeSerializeFMUstate, (c, (const fmi2Byte *)bytes, size, state),
                DeserializeFMUState, (c, bytes, size, state));
}
