/* The functions of FMI 3.0. */
#if !defined(PRBM_FMI) || PRBM_FMI == 3

#include <string.h>

/* the standard's header declares callbacks without prototypes */
#if defined(__clang__)
#pragma clang diagnostic push
#pragma clang diagnostic ignored "-Wstrict-prototypes"
#endif
#include "fmi3Functions.h"
#if defined(__clang__)
#pragma clang diagnostic pop
#endif
#include "fmi/fmu.h"

/* --- what the standard allows when ------------------------------------------------------------ */

enum {
    ANY3 = IN_ANY_BUT_UPDATE,
    EVEN3 = IN_ANY, /* functions that are refused anyway */
    SET_ME3 = IN_INSTANTIATED | IN_INITIALIZATION | IN_EVENT,
    SET_CS3 = SET_ME3 | IN_STEP,
    GET_ME3 = SET_ME3 | IN_CONTINUOUS | IN_TERMINATED,
    GET_CS3 = SET_CS3 | IN_INTERMEDIATE | IN_TERMINATED,
    EVALUATES3 = IN_INITIALIZATION | IN_EVENT | IN_CONTINUOUS | IN_TERMINATED
};

/* Types that no variable has. */
#define FMI3_OTHER_TYPES(TYPE) \
    TYPE(Float32)              \
    TYPE(Int8)                 \
    TYPE(UInt8)                \
    TYPE(Int16)                \
    TYPE(UInt16)               \
    TYPE(UInt32)               \
    TYPE(Int64)                \
    TYPE(UInt64)

/* Function, model exchange, co-simulation: sections 2.3, 3.2 and 4.2. */
#define FMI3_RULES(RULE)                                                       \
    RULE(SetDebugLogging, ANY3, ANY3)                                          \
    RULE(EnterInitializationMode, IN_INSTANTIATED, IN_INSTANTIATED)            \
    RULE(ExitInitializationMode, IN_INITIALIZATION, IN_INITIALIZATION)         \
    RULE(EnterEventMode, IN_CONTINUOUS, IN_STEP)                               \
    RULE(Terminate, ANY3, ANY3)                                                \
    RULE(Reset, ANY3, ANY3)                                                    \
    RULE(GetFloat32, GET_ME3, GET_CS3)                                         \
    RULE(GetFloat64, GET_ME3, GET_CS3)                                         \
    RULE(GetInt8, GET_ME3, GET_CS3)                                            \
    RULE(GetUInt8, GET_ME3, GET_CS3)                                           \
    RULE(GetInt16, GET_ME3, GET_CS3)                                           \
    RULE(GetUInt16, GET_ME3, GET_CS3)                                          \
    RULE(GetInt32, GET_ME3, GET_CS3)                                           \
    RULE(GetUInt32, GET_ME3, GET_CS3)                                          \
    RULE(GetInt64, GET_ME3, GET_CS3)                                           \
    RULE(GetUInt64, GET_ME3, GET_CS3)                                          \
    RULE(GetBoolean, GET_ME3, GET_CS3)                                         \
    RULE(GetString, GET_ME3, GET_CS3)                                          \
    RULE(GetBinary, GET_ME3, GET_CS3)                                          \
    RULE(GetClock, IN_EVENT, IN_EVENT)                                         \
    RULE(SetFloat32, SET_ME3 | IN_CONTINUOUS, SET_CS3)                         \
    RULE(SetFloat64, SET_ME3 | IN_CONTINUOUS, SET_CS3)                         \
    RULE(SetInt8, SET_ME3, SET_CS3)                                            \
    RULE(SetUInt8, SET_ME3, SET_CS3)                                           \
    RULE(SetInt16, SET_ME3, SET_CS3)                                           \
    RULE(SetUInt16, SET_ME3, SET_CS3)                                          \
    RULE(SetInt32, SET_ME3, SET_CS3)                                           \
    RULE(SetUInt32, SET_ME3, SET_CS3)                                          \
    RULE(SetInt64, SET_ME3, SET_CS3)                                           \
    RULE(SetUInt64, SET_ME3, SET_CS3)                                          \
    RULE(SetBoolean, SET_ME3, SET_CS3)                                         \
    RULE(SetString, SET_ME3, SET_CS3)                                          \
    RULE(SetBinary, SET_ME3, SET_CS3)                                          \
    RULE(SetClock, IN_EVENT, IN_EVENT)                                         \
    RULE(GetNumberOfVariableDependencies, EVEN3, EVEN3)                        \
    RULE(GetVariableDependencies, EVEN3, EVEN3)                                \
    RULE(GetFMUState, ANY3, ANY3)                                              \
    RULE(SetFMUState, ANY3, ANY3)                                              \
    RULE(FreeFMUState, ANY3, ANY3)                                             \
    RULE(SerializedFMUStateSize, ANY3, ANY3)                                   \
    RULE(SerializeFMUState, ANY3, ANY3)                                        \
    RULE(DeserializeFMUState, ANY3, ANY3)                                      \
    RULE(GetDirectionalDerivative, EVALUATES3, IN_NONE)                        \
    RULE(GetAdjointDerivative, EVEN3, EVEN3)                                   \
    RULE(EnterConfigurationMode, EVEN3, EVEN3)                                 \
    RULE(ExitConfigurationMode, EVEN3, EVEN3)                                  \
    RULE(GetIntervalDecimal, EVEN3, EVEN3)                                     \
    RULE(GetIntervalFraction, EVEN3, EVEN3)                                    \
    RULE(GetShiftDecimal, EVEN3, EVEN3)                                        \
    RULE(GetShiftFraction, EVEN3, EVEN3)                                       \
    RULE(SetIntervalDecimal, EVEN3, EVEN3)                                     \
    RULE(SetIntervalFraction, EVEN3, EVEN3)                                    \
    RULE(SetShiftDecimal, EVEN3, EVEN3)                                        \
    RULE(SetShiftFraction, EVEN3, EVEN3)                                       \
    RULE(EvaluateDiscreteStates, IN_EVENT, IN_EVENT)                           \
    RULE(UpdateDiscreteStates, IN_EVENT, IN_EVENT)                             \
    RULE(EnterContinuousTimeMode, IN_EVENT, IN_NONE)                           \
    RULE(CompletedIntegratorStep, IN_CONTINUOUS, IN_NONE)                      \
    RULE(SetTime, IN_CONTINUOUS, IN_NONE)                                      \
    RULE(SetContinuousStates, IN_CONTINUOUS, IN_NONE)                          \
    RULE(GetContinuousStateDerivatives, EVALUATES3, IN_NONE)                   \
    RULE(GetEventIndicators, EVALUATES3, IN_NONE)                              \
    RULE(GetContinuousStates, EVALUATES3, IN_NONE)                             \
    RULE(GetNominalsOfContinuousStates, EVALUATES3, IN_NONE)                   \
    RULE(GetNumberOfEventIndicators, ANY3, IN_NONE)                            \
    RULE(GetNumberOfContinuousStates, ANY3, IN_NONE)                           \
    RULE(EnterStepMode, IN_NONE, IN_EVENT)                                     \
    RULE(GetOutputDerivatives, EVEN3, EVEN3)                                   \
    RULE(DoStep, IN_NONE, IN_STEP)                                             \
    RULE(ActivateModelPartition, EVEN3, EVEN3)

#define FMI3_NUMBER(name, exchange, simulation) RULE3_##name,
#define FMI3_ENTRY(name, exchange, simulation) {"fmi3" #name, {exchange, simulation}},

enum { FMI3_RULES(FMI3_NUMBER) RULES3 };

static const Rule FMI3[RULES3] = {FMI3_RULES(FMI3_ENTRY)};

static const Standard STANDARD3 = {
    3,
    "fmi3",
    {"Float64", "Int32", "Boolean", "Clock"},
    {"the state Instantiated", "Initialization Mode", "Event Mode", "Continuous-Time Mode",
     "Step Mode", "Intermediate Update Mode", "the state Terminated"},
    {{{"fmi3EnterInitializationMode", MODE_INITIALIZATION},
      {"fmi3ExitInitializationMode", MODE_EVENT},
      {"fmi3EnterContinuousTimeMode", MODE_CONTINUOUS},
      {"fmi3EnterEventMode", MODE_EVENT},
      {NULL, MODE_STEP},
      {NULL, MODE_INTERMEDIATE},
      {"fmi3Reset", MODE_INSTANTIATED}},
     {{"fmi3EnterInitializationMode", MODE_INITIALIZATION},
      {"fmi3ExitInitializationMode", MODE_EVENT},
      {"fmi3EnterStepMode", MODE_STEP},
      {NULL, MODE_CONTINUOUS},
      {"fmi3EnterEventMode", MODE_EVENT},
      {NULL, MODE_INTERMEDIATE},
      {"fmi3Reset", MODE_INSTANTIATED}}},
};

/* The instance if it may be called now and none of the pointers that it needs is NULL. */
static Instance *called3(fmi3Instance handle, int rule, size_t count, const void *pointer) {
    Instance *instance = allowed(handle, &FMI3[rule]);
    return instance && given(instance, &FMI3[rule], count, pointer) ? instance : NULL;
}

/* The same for the functions around Event Mode. */
static Instance *called_for_event3(fmi3Instance handle, int rule) {
    const Instance *instance = handle;
    if (instance && instance->kind == CO_SIMULATION && !instance->event_mode) {
        refuse(instance, FMU_ERROR, "%s is for instances made with eventModeUsed = true; this one "
                                    "handles its events within fmi3DoStep",
               FMI3[rule].function);
        return NULL;
    }
    return called3(handle, rule, 0, NULL);
}

static fmi3Status worse3(fmi3Status status, int another) {
    return another > (int)status ? (fmi3Status)another : status;
}

/* Refuse a function that this FMU does not have, and say why not. */
static fmi3Status absent3(fmi3Instance handle, int rule, const char *why) {
    const Instance *instance = handle;
    if (instance) {
        refuse(instance, FMU_ERROR, "%s: %s", FMI3[rule].function, why);
    }
    return fmi3Error;
}

/* --- versions and messages -------------------------------------------------------------------- */

const char *fmi3GetVersion(void) {
    return fmi3Version;
}

static void send3(const Journal *journal, int status, const char *category, const char *text) {
    fmi3LogMessageCallback log_message = (fmi3LogMessageCallback)journal->callback;
    log_message(journal->environment, (fmi3Status)status, category, text);
}

fmi3Status fmi3SetDebugLogging(fmi3Instance instance, fmi3Boolean loggingOn, size_t nCategories,
                               const fmi3String categories[]) {
    Instance *it = called3(instance, RULE3_SetDebugLogging, nCategories, categories);
    return it ? (fmi3Status)choose_categories(it, &FMI3[RULE3_SetDebugLogging], loggingOn,
                                              nCategories, categories)
              : fmi3Error;
}

/* --- life ------------------------------------------------------------------------------------- */

static Request request3(Kind kind, fmi3String instanceName, fmi3String instantiationToken,
                        fmi3String resourcePath, fmi3Boolean loggingOn,
                        fmi3InstanceEnvironment environment, fmi3LogMessageCallback logMessage) {
    Request request = {0};
    request.standard = &STANDARD3;
    request.kind = kind;
    request.token = instantiationToken;
    request.resources = resourcePath;
    request.journal.instance = instanceName ? instanceName : "";
    request.journal.environment = environment;
    request.journal.callback = (Callback *)logMessage;
    request.journal.send = send3;
    request.journal.special = "#";
    request.journal.categories = loggingOn ? LOG_EVERYTHING : LOG_NOTHING;
    return request;
}

fmi3Instance fmi3InstantiateModelExchange(fmi3String instanceName, fmi3String instantiationToken,
                                          fmi3String resourcePath, fmi3Boolean visible,
                                          fmi3Boolean loggingOn,
                                          fmi3InstanceEnvironment instanceEnvironment,
                                          fmi3LogMessageCallback logMessage) {
    Request request = request3(MODEL_EXCHANGE, instanceName, instantiationToken, resourcePath,
                               loggingOn, instanceEnvironment, logMessage);
    (void)visible; /* there is nothing to see */
    return instance_open(&request);
}

/* After an internal step the importer may look at variables and ask for the end of the step. */
static bool update3(Instance *instance) {
    fmi3IntermediateUpdateCallback callback =
        (fmi3IntermediateUpdateCallback)instance->intermediate;
    fmi3Boolean wanted = fmi3False;
    fmi3Float64 time = simulation_time(instance->simulation), return_time = time;
    instance->mode = MODE_INTERMEDIATE;
    callback(instance->journal.environment, time, fmi3False, fmi3True, fmi3True,
             instance->early_return, &wanted, &return_time);
    instance->mode = MODE_STEP;
    return wanted && instance->early_return;
}

fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String instanceName, fmi3String instantiationToken, fmi3String resourcePath,
    fmi3Boolean visible, fmi3Boolean loggingOn, fmi3Boolean eventModeUsed,
    fmi3Boolean earlyReturnAllowed, const fmi3ValueReference requiredIntermediateVariables[],
    size_t nRequiredIntermediateVariables, fmi3InstanceEnvironment instanceEnvironment,
    fmi3LogMessageCallback logMessage, fmi3IntermediateUpdateCallback intermediateUpdate) {
    Request request = request3(CO_SIMULATION, instanceName, instantiationToken, resourcePath,
                               loggingOn, instanceEnvironment, logMessage);
    (void)visible; /* there is nothing to see */
    request.event_mode = eventModeUsed;
    request.early_return = earlyReturnAllowed;
    request.required = requiredIntermediateVariables;
    request.required_count = nRequiredIntermediateVariables;
    request.intermediate = (Callback *)intermediateUpdate;
    request.update = intermediateUpdate ? update3 : NULL;
    return instance_open(&request);
}

fmi3Instance fmi3InstantiateScheduledExecution(
    fmi3String instanceName, fmi3String instantiationToken, fmi3String resourcePath,
    fmi3Boolean visible, fmi3Boolean loggingOn, fmi3InstanceEnvironment instanceEnvironment,
    fmi3LogMessageCallback logMessage, fmi3ClockUpdateCallback clockUpdate,
    fmi3LockPreemptionCallback lockPreemption, fmi3UnlockPreemptionCallback unlockPreemption) {
    Request request = request3(CO_SIMULATION, instanceName, instantiationToken, resourcePath,
                               loggingOn, instanceEnvironment, logMessage);
    (void)visible, (void)clockUpdate, (void)lockPreemption, (void)unlockPreemption;
    report(&request.journal, FMU_ERROR, "fmi3InstantiateScheduledExecution: a mechanism moves "
                                        "continuously and has no partitions to schedule; "
                                        "instantiate it for co-simulation or model exchange");
    return NULL;
}

void fmi3FreeInstance(fmi3Instance instance) {
    instance_close(instance);
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, fmi3Boolean toleranceDefined,
                                       fmi3Float64 tolerance, fmi3Float64 startTime,
                                       fmi3Boolean stopTimeDefined, fmi3Float64 stopTime) {
    Instance *it = called3(instance, RULE3_EnterInitializationMode, 0, NULL);
    if (!it || set_up(it, toleranceDefined, tolerance, startTime, stopTimeDefined, stopTime)) {
        return fmi3Error;
    }
    it->mode = MODE_INITIALIZATION;
    return fmi3OK;
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance instance) {
    Instance *it = called3(instance, RULE3_ExitInitializationMode, 0, NULL);
    return it ? (fmi3Status)exit_initialization(it) : fmi3Error;
}

fmi3Status fmi3Terminate(fmi3Instance instance) {
    Instance *it = called3(instance, RULE3_Terminate, 0, NULL);
    return it ? (fmi3Status)end_run(it) : fmi3Error;
}

fmi3Status fmi3Reset(fmi3Instance instance) {
    Instance *it = called3(instance, RULE3_Reset, 0, NULL);
    return it ? (fmi3Status)reset(it) : fmi3Error;
}

fmi3Status fmi3EnterConfigurationMode(fmi3Instance instance) {
    return absent3(instance, RULE3_EnterConfigurationMode, "there are no structural parameters");
}

fmi3Status fmi3ExitConfigurationMode(fmi3Instance instance) {
    return absent3(instance, RULE3_ExitConfigurationMode, "there are no structural parameters");
}

/* --- values ----------------------------------------------------------------------------------- */

/* Both arrays of a get or a set, of as many values as references since all variables are scalar. */
static Instance *accessed3(fmi3Instance handle, int rule, const fmi3ValueReference references[],
                           size_t n, const void *values, size_t count) {
    Instance *instance = called3(handle, rule, n, references);
    if (!instance || !given(instance, &FMI3[rule], n, values)) {
        return NULL;
    }
    if (n != count) {
        refuse(instance, FMU_ERROR, "%s: %lu value references, but %lu values; all variables are "
                                    "scalar",
               FMI3[rule].function, (unsigned long)n, (unsigned long)count);
        return NULL;
    }
    return instance;
}

fmi3Status fmi3GetFloat64(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                          size_t nValueReferences, fmi3Float64 values[], size_t nValues) {
    Instance *it = accessed3(instance, RULE3_GetFloat64, valueReferences, nValueReferences, values,
                             nValues);
    fmi3Status status = it ? fmi3OK : fmi3Error;
    for (size_t i = 0; i < nValues && status == fmi3OK; i++) {
        status = (fmi3Status)read_value(it, valueReferences[i], REAL, &values[i]);
    }
    return status;
}

fmi3Status fmi3GetInt32(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                        size_t nValueReferences, fmi3Int32 values[], size_t nValues) {
    Instance *it = accessed3(instance, RULE3_GetInt32, valueReferences, nValueReferences, values,
                             nValues);
    fmi3Status status = it ? fmi3OK : fmi3Error;
    for (size_t i = 0; i < nValues && status == fmi3OK; i++) {
        double x = 0.0;
        status = (fmi3Status)read_value(it, valueReferences[i], INTEGER, &x);
        values[i] = (fmi3Int32)x;
    }
    return status;
}

fmi3Status fmi3GetBoolean(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                          size_t nValueReferences, fmi3Boolean values[], size_t nValues) {
    Instance *it = accessed3(instance, RULE3_GetBoolean, valueReferences, nValueReferences, values,
                             nValues);
    fmi3Status status = it ? fmi3OK : fmi3Error;
    for (size_t i = 0; i < nValues && status == fmi3OK; i++) {
        double x = 0.0;
        status = (fmi3Status)read_value(it, valueReferences[i], BOOLEAN, &x);
        values[i] = x != 0.0;
    }
    return status;
}

fmi3Status fmi3GetClock(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                        size_t nValueReferences, fmi3Clock values[]) {
    Instance *it = called_for_event3(instance, RULE3_GetClock);
    if (!it || !given(it, &FMI3[RULE3_GetClock], nValueReferences, valueReferences) ||
        !given(it, &FMI3[RULE3_GetClock], nValueReferences, values)) {
        return fmi3Error;
    }
    fmi3Status status = fmi3OK;
    for (size_t i = 0; i < nValueReferences && status == fmi3OK; i++) {
        bool active = false;
        status = (fmi3Status)read_clock(it, valueReferences[i], &active);
        values[i] = active;
    }
    return status;
}

fmi3Status fmi3SetFloat64(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                          size_t nValueReferences, const fmi3Float64 values[], size_t nValues) {
    Instance *it = accessed3(instance, RULE3_SetFloat64, valueReferences, nValueReferences, values,
                             nValues);
    fmi3Status status = it ? fmi3OK : fmi3Error;
    for (size_t i = 0; i < nValues && it; i++) {
        status = worse3(status, write_value(it, valueReferences[i], REAL, values[i]));
    }
    return status;
}

/* Parameters and inputs are all of type Float64: any other set is told what is wrong with it. */
static fmi3Status set_other3(Instance *instance, const fmi3ValueReference references[], size_t n,
                             int type) {
    fmi3Status status = instance ? fmi3OK : fmi3Error;
    for (size_t i = 0; i < n && instance; i++) {
        status = worse3(status, write_value(instance, references[i], type, 0.0));
    }
    return status;
}

/* The same for a get as a type that no variable has. */
static fmi3Status get_other3(Instance *instance, const fmi3ValueReference references[], size_t n) {
    fmi3Status status = instance ? fmi3OK : fmi3Error;
    for (size_t i = 0; i < n && instance; i++) {
        double x;
        status = worse3(status, read_value(instance, references[i], NO_TYPE, &x));
    }
    return status;
}

fmi3Status fmi3SetInt32(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                        size_t nValueReferences, const fmi3Int32 values[], size_t nValues) {
    Instance *it = accessed3(instance, RULE3_SetInt32, valueReferences, nValueReferences, values,
                             nValues);
    return set_other3(it, valueReferences, nValueReferences, INTEGER);
}

fmi3Status fmi3SetBoolean(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                          size_t nValueReferences, const fmi3Boolean values[], size_t nValues) {
    Instance *it = accessed3(instance, RULE3_SetBoolean, valueReferences, nValueReferences, values,
                             nValues);
    return set_other3(it, valueReferences, nValueReferences, BOOLEAN);
}

fmi3Status fmi3SetClock(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                        size_t nValueReferences, const fmi3Clock values[]) {
    Instance *it = called_for_event3(instance, RULE3_SetClock);
    if (!it || !given(it, &FMI3[RULE3_SetClock], nValueReferences, valueReferences) ||
        !given(it, &FMI3[RULE3_SetClock], nValueReferences, values)) {
        return fmi3Error;
    }
    return set_other3(it, valueReferences, nValueReferences, CLOCK);
}

#define FMI3_OTHER_TYPE(type)                                                                  \
    fmi3Status fmi3Get##type(fmi3Instance instance, const fmi3ValueReference valueReferences[], \
                             size_t nValueReferences, fmi3##type values[], size_t nValues) {   \
        Instance *it = accessed3(instance, RULE3_Get##type, valueReferences, nValueReferences, \
                                 values, nValues);                                             \
        return get_other3(it, valueReferences, nValueReferences);                              \
    }                                                                                          \
                                                                                               \
    fmi3Status fmi3Set##type(fmi3Instance instance, const fmi3ValueReference valueReferences[], \
                             size_t nValueReferences, const fmi3##type values[],               \
                             size_t nValues) {                                                 \
        Instance *it = accessed3(instance, RULE3_Set##type, valueReferences, nValueReferences, \
                                 values, nValues);                                             \
        return set_other3(it, valueReferences, nValueReferences, NO_TYPE);                     \
    }

FMI3_OTHER_TYPES(FMI3_OTHER_TYPE)

fmi3Status fmi3GetString(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                         size_t nValueReferences, fmi3String values[], size_t nValues) {
    Instance *it = accessed3(instance, RULE3_GetString, valueReferences, nValueReferences, values,
                             nValues);
    return get_other3(it, valueReferences, nValueReferences);
}

fmi3Status fmi3SetString(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                         size_t nValueReferences, const fmi3String values[], size_t nValues) {
    Instance *it = accessed3(instance, RULE3_SetString, valueReferences, nValueReferences, values,
                             nValues);
    return set_other3(it, valueReferences, nValueReferences, NO_TYPE);
}

fmi3Status fmi3GetBinary(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                         size_t nValueReferences, size_t valueSizes[], fmi3Binary values[],
                         size_t nValues) {
    Instance *it = accessed3(instance, RULE3_GetBinary, valueReferences, nValueReferences, values,
                             nValues);
    (void)valueSizes;
    return get_other3(it, valueReferences, nValueReferences);
}

fmi3Status fmi3SetBinary(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                         size_t nValueReferences, const size_t valueSizes[],
                         const fmi3Binary values[], size_t nValues) {
    Instance *it = accessed3(instance, RULE3_SetBinary, valueReferences, nValueReferences, values,
                             nValues);
    (void)valueSizes;
    return set_other3(it, valueReferences, nValueReferences, NO_TYPE);
}

static const char NO_DEPENDENCIES[] =
    "dependencies are those of modelDescription.xml (providesPerElementDependencies = false)";

fmi3Status fmi3GetNumberOfVariableDependencies(fmi3Instance instance,
                                               fmi3ValueReference valueReference,
                                               size_t *nDependencies) {
    (void)valueReference, (void)nDependencies;
    return absent3(instance, RULE3_GetNumberOfVariableDependencies, NO_DEPENDENCIES);
}

fmi3Status fmi3GetVariableDependencies(fmi3Instance instance, fmi3ValueReference dependent,
                                       size_t elementIndicesOfDependent[],
                                       fmi3ValueReference independents[],
                                       size_t elementIndicesOfIndependents[],
                                       fmi3DependencyKind dependencyKinds[],
                                       size_t nDependencies) {
    (void)dependent, (void)elementIndicesOfDependent, (void)independents;
    (void)elementIndicesOfIndependents, (void)dependencyKinds, (void)nDependencies;
    return absent3(instance, RULE3_GetVariableDependencies, NO_DEPENDENCIES);
}

fmi3Status fmi3GetDirectionalDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[],
                                        size_t nUnknowns, const fmi3ValueReference knowns[],
                                        size_t nKnowns, const fmi3Float64 seed[], size_t nSeed,
                                        fmi3Float64 sensitivity[], size_t nSensitivity) {
    const int rule = RULE3_GetDirectionalDerivative;
    Instance *it = accessed3(instance, rule, unknowns, nUnknowns, sensitivity, nSensitivity);
    if (!it || !accessed3(instance, rule, knowns, nKnowns, seed, nSeed)) {
        return fmi3Error;
    }
    return (fmi3Status)directional_derivative(it, unknowns, nUnknowns, knowns, nKnowns, seed,
                                              sensitivity);
}

fmi3Status fmi3GetAdjointDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[],
                                    size_t nUnknowns, const fmi3ValueReference knowns[],
                                    size_t nKnowns, const fmi3Float64 seed[], size_t nSeed,
                                    fmi3Float64 sensitivity[], size_t nSensitivity) {
    (void)unknowns, (void)nUnknowns, (void)knowns, (void)nKnowns;
    (void)seed, (void)nSeed, (void)sensitivity, (void)nSensitivity;
    return absent3(instance, RULE3_GetAdjointDerivative,
                   "there are no adjoint derivatives (providesAdjointDerivatives = false); "
                   "fmi3GetDirectionalDerivative gives the other product");
}

/* --- saved states ----------------------------------------------------------------------------- */

fmi3Status fmi3GetFMUState(fmi3Instance instance, fmi3FMUState *FMUState) {
    Instance *it = called3(instance, RULE3_GetFMUState, 1, FMUState);
    return it ? (fmi3Status)save_state(it, FMUState) : fmi3Error;
}

fmi3Status fmi3SetFMUState(fmi3Instance instance, fmi3FMUState FMUState) {
    Instance *it = called3(instance, RULE3_SetFMUState, 1, FMUState);
    return it ? (fmi3Status)restore_state(it, FMUState) : fmi3Error;
}

fmi3Status fmi3FreeFMUState(fmi3Instance instance, fmi3FMUState *FMUState) {
    Instance *it = called3(instance, RULE3_FreeFMUState, 0, NULL);
    if (it && FMUState) {
        free_state(FMUState);
    }
    return it ? fmi3OK : fmi3Error;
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance instance, fmi3FMUState FMUState, size_t *size) {
    Instance *it = called3(instance, RULE3_SerializedFMUStateSize, 1, FMUState);
    if (!it || !given(it, &FMI3[RULE3_SerializedFMUStateSize], 1, size)) {
        return fmi3Error;
    }
    *size = ((const Saved *)FMUState)->size;
    return fmi3OK;
}

fmi3Status fmi3SerializeFMUState(fmi3Instance instance, fmi3FMUState FMUState,
                                 fmi3Byte serializedState[], size_t size) {
    Instance *it = called3(instance, RULE3_SerializeFMUState, 1, FMUState);
    if (!it || !given(it, &FMI3[RULE3_SerializeFMUState], 1, serializedState)) {
        return fmi3Error;
    }
    return (fmi3Status)serialize(it, FMUState, serializedState, size);
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance instance, const fmi3Byte serializedState[],
                                   size_t size, fmi3FMUState *FMUState) {
    Instance *it = called3(instance, RULE3_DeserializeFMUState, 1, serializedState);
    if (!it || !given(it, &FMI3[RULE3_DeserializeFMUState], 1, FMUState)) {
        return fmi3Error;
    }
    return (fmi3Status)deserialize(it, serializedState, size, FMUState);
}

/* --- clocks ----------------------------------------------------------------------------------- */

static const char NO_INTERVALS[] =
    "no clock here has an interval or a shift: clocks are triggered by impacts";

fmi3Status fmi3GetIntervalDecimal(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                                  size_t nValueReferences, fmi3Float64 intervals[],
                                  fmi3IntervalQualifier qualifiers[]) {
    (void)valueReferences, (void)nValueReferences, (void)intervals, (void)qualifiers;
    return absent3(instance, RULE3_GetIntervalDecimal, NO_INTERVALS);
}

fmi3Status fmi3GetIntervalFraction(fmi3Instance instance,
                                   const fmi3ValueReference valueReferences[],
                                   size_t nValueReferences, fmi3UInt64 counters[],
                                   fmi3UInt64 resolutions[], fmi3IntervalQualifier qualifiers[]) {
    (void)valueReferences, (void)nValueReferences, (void)counters;
    (void)resolutions, (void)qualifiers;
    return absent3(instance, RULE3_GetIntervalFraction, NO_INTERVALS);
}

fmi3Status fmi3GetShiftDecimal(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                               size_t nValueReferences, fmi3Float64 shifts[]) {
    (void)valueReferences, (void)nValueReferences, (void)shifts;
    return absent3(instance, RULE3_GetShiftDecimal, NO_INTERVALS);
}

fmi3Status fmi3GetShiftFraction(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                                size_t nValueReferences, fmi3UInt64 counters[],
                                fmi3UInt64 resolutions[]) {
    (void)valueReferences, (void)nValueReferences, (void)counters, (void)resolutions;
    return absent3(instance, RULE3_GetShiftFraction, NO_INTERVALS);
}

fmi3Status fmi3SetIntervalDecimal(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                                  size_t nValueReferences, const fmi3Float64 intervals[]) {
    (void)valueReferences, (void)nValueReferences, (void)intervals;
    return absent3(instance, RULE3_SetIntervalDecimal, NO_INTERVALS);
}

fmi3Status fmi3SetIntervalFraction(fmi3Instance instance,
                                   const fmi3ValueReference valueReferences[],
                                   size_t nValueReferences, const fmi3UInt64 counters[],
                                   const fmi3UInt64 resolutions[]) {
    (void)valueReferences, (void)nValueReferences, (void)counters, (void)resolutions;
    return absent3(instance, RULE3_SetIntervalFraction, NO_INTERVALS);
}

fmi3Status fmi3SetShiftDecimal(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                               size_t nValueReferences, const fmi3Float64 shifts[]) {
    (void)valueReferences, (void)nValueReferences, (void)shifts;
    return absent3(instance, RULE3_SetShiftDecimal, NO_INTERVALS);
}

fmi3Status fmi3SetShiftFraction(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                                size_t nValueReferences, const fmi3UInt64 counters[],
                                const fmi3UInt64 resolutions[]) {
    (void)valueReferences, (void)nValueReferences, (void)counters, (void)resolutions;
    return absent3(instance, RULE3_SetShiftFraction, NO_INTERVALS);
}

fmi3Status fmi3ActivateModelPartition(fmi3Instance instance, fmi3ValueReference clockReference,
                                      fmi3Float64 activationTime) {
    (void)clockReference, (void)activationTime;
    return absent3(instance, RULE3_ActivateModelPartition, "there is no scheduled execution");
}

/* --- events ----------------------------------------------------------------------------------- */

fmi3Status fmi3EnterEventMode(fmi3Instance instance) {
    Instance *it = called_for_event3(instance, RULE3_EnterEventMode);
    return it ? (fmi3Status)enter_event_mode(it) : fmi3Error;
}

/* Nothing to do: what is due happens in fmi3UpdateDiscreteStates. */
fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance instance) {
    return called_for_event3(instance, RULE3_EvaluateDiscreteStates) ? fmi3OK : fmi3Error;
}

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance instance, fmi3Boolean *discreteStatesNeedUpdate,
                                    fmi3Boolean *terminateSimulation,
                                    fmi3Boolean *nominalsOfContinuousStatesChanged,
                                    fmi3Boolean *valuesOfContinuousStatesChanged,
                                    fmi3Boolean *nextEventTimeDefined, fmi3Float64 *nextEventTime) {
    Instance *it = called_for_event3(instance, RULE3_UpdateDiscreteStates);
    bool all = discreteStatesNeedUpdate && terminateSimulation &&
               nominalsOfContinuousStatesChanged && valuesOfContinuousStatesChanged &&
               nextEventTimeDefined && nextEventTime;
    bool again = false, changed = false;
    if (!it || !given(it, &FMI3[RULE3_UpdateDiscreteStates], 1, all ? it : NULL)) {
        return fmi3Error;
    }
    fmi3Status status = (fmi3Status)update_discrete_states(it, &again, &changed);
    *discreteStatesNeedUpdate = again;
    *terminateSimulation = fmi3False;
    *nominalsOfContinuousStatesChanged = fmi3False;
    *valuesOfContinuousStatesChanged = changed;
    *nextEventTimeDefined = fmi3False;
    *nextEventTime = 0.0;
    return status;
}

/* --- model exchange --------------------------------------------------------------------------- */

fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance instance) {
    Instance *it = called3(instance, RULE3_EnterContinuousTimeMode, 0, NULL);
    return it ? (fmi3Status)leave_event_mode(it, &FMI3[RULE3_EnterContinuousTimeMode],
                                             MODE_CONTINUOUS)
              : fmi3Error;
}

fmi3Status fmi3CompletedIntegratorStep(fmi3Instance instance,
                                       fmi3Boolean noSetFMUStatePriorToCurrentPoint,
                                       fmi3Boolean *enterEventMode,
                                       fmi3Boolean *terminateSimulation) {
    Instance *it = called3(instance, RULE3_CompletedIntegratorStep, 1, enterEventMode);
    bool event = false;
    (void)noSetFMUStatePriorToCurrentPoint; /* nothing is kept for going back */
    if (!it || !given(it, &FMI3[RULE3_CompletedIntegratorStep], 1, terminateSimulation)) {
        return fmi3Error;
    }
    fmi3Status status = (fmi3Status)completed_step(it, &event);
    *enterEventMode = event;
    *terminateSimulation = fmi3False;
    return status;
}

fmi3Status fmi3SetTime(fmi3Instance instance, fmi3Float64 time) {
    Instance *it = called3(instance, RULE3_SetTime, 0, NULL);
    return it ? (fmi3Status)set_time(it, time) : fmi3Error;
}

fmi3Status fmi3SetContinuousStates(fmi3Instance instance, const fmi3Float64 continuousStates[],
                                   size_t nContinuousStates) {
    Instance *it = called3(instance, RULE3_SetContinuousStates, nContinuousStates,
                           continuousStates);
    return it ? (fmi3Status)set_states(it, continuousStates, nContinuousStates) : fmi3Error;
}

fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance instance, fmi3Float64 derivatives[],
                                             size_t nContinuousStates) {
    Instance *it = called3(instance, RULE3_GetContinuousStateDerivatives, nContinuousStates,
                           derivatives);
    return it ? (fmi3Status)get_derivatives(it, derivatives, nContinuousStates) : fmi3Error;
}

fmi3Status fmi3GetEventIndicators(fmi3Instance instance, fmi3Float64 eventIndicators[],
                                  size_t nEventIndicators) {
    Instance *it = called3(instance, RULE3_GetEventIndicators, nEventIndicators, eventIndicators);
    return it ? (fmi3Status)get_indicators(it, eventIndicators, nEventIndicators) : fmi3Error;
}

fmi3Status fmi3GetContinuousStates(fmi3Instance instance, fmi3Float64 continuousStates[],
                                   size_t nContinuousStates) {
    Instance *it = called3(instance, RULE3_GetContinuousStates, nContinuousStates,
                           continuousStates);
    return it ? (fmi3Status)get_states(it, continuousStates, nContinuousStates) : fmi3Error;
}

fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance instance, fmi3Float64 nominals[],
                                             size_t nContinuousStates) {
    Instance *it = called3(instance, RULE3_GetNominalsOfContinuousStates, nContinuousStates,
                           nominals);
    return it ? (fmi3Status)get_nominals(it, nominals, nContinuousStates) : fmi3Error;
}

fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance instance, size_t *nEventIndicators) {
    Instance *it = called3(instance, RULE3_GetNumberOfEventIndicators, 1, nEventIndicators);
    if (!it) {
        return fmi3Error;
    }
    *nEventIndicators = (size_t)it->indicators;
    return fmi3OK;
}

fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance instance, size_t *nContinuousStates) {
    Instance *it = called3(instance, RULE3_GetNumberOfContinuousStates, 1, nContinuousStates);
    if (!it) {
        return fmi3Error;
    }
    *nContinuousStates = (size_t)it->states;
    return fmi3OK;
}

/* --- co-simulation ---------------------------------------------------------------------------- */

fmi3Status fmi3EnterStepMode(fmi3Instance instance) {
    Instance *it = instance;
    bool simulates = it && it->kind == CO_SIMULATION;
    it = simulates ? called_for_event3(instance, RULE3_EnterStepMode)
                   : called3(instance, RULE3_EnterStepMode, 0, NULL);
    return it ? (fmi3Status)leave_event_mode(it, &FMI3[RULE3_EnterStepMode], MODE_STEP)
              : fmi3Error;
}

fmi3Status fmi3GetOutputDerivatives(fmi3Instance instance,
                                    const fmi3ValueReference valueReferences[],
                                    size_t nValueReferences, const fmi3Int32 orders[],
                                    fmi3Float64 values[], size_t nValues) {
    (void)valueReferences, (void)nValueReferences, (void)orders, (void)values, (void)nValues;
    return absent3(instance, RULE3_GetOutputDerivatives,
                   "there are no derivatives of outputs (maxOutputDerivativeOrder = 0)");
}

fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 currentCommunicationPoint,
                      fmi3Float64 communicationStepSize,
                      fmi3Boolean noSetFMUStatePriorToCurrentPoint,
                      fmi3Boolean *eventHandlingNeeded, fmi3Boolean *terminateSimulation,
                      fmi3Boolean *earlyReturn, fmi3Float64 *lastSuccessfulTime) {
    Instance *it = called3(instance, RULE3_DoStep, 0, NULL);
    bool all = eventHandlingNeeded && terminateSimulation && earlyReturn && lastSuccessfulTime;
    Outcome outcome;
    (void)noSetFMUStatePriorToCurrentPoint; /* nothing is kept for going back */
    if (!it || !given(it, &FMI3[RULE3_DoStep], 1, all ? it : NULL)) {
        return fmi3Error;
    }
    fmi3Status status = (fmi3Status)make_step(it, currentCommunicationPoint, communicationStepSize,
                                              &outcome);
    *eventHandlingNeeded = outcome.event;
    *terminateSimulation = fmi3False;
    *earlyReturn = outcome.early;
    *lastSuccessfulTime = outcome.time;
    return status;
}

#endif
