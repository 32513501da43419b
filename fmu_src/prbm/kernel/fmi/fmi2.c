/* The functions of FMI 2.0. */
#if !defined(PRBM_FMI) || PRBM_FMI == 2

#include <string.h>

#include "fmi/fmu.h"
#include "fmi/types2.h"

/* --- the state machine of the standard -------------------------------------------------------- */

enum {
    ANY2 = IN_ANY_BUT_UPDATE,
    MAY_BE_SET2 = IN_INSTANTIATED | IN_INITIALIZATION | IN_EVENT | IN_STEP,
    /* The standard does not mention getting values in Instantiated; importers read start values. */
    MAY_BE_READ2 = MAY_BE_SET2 | IN_CONTINUOUS | IN_TERMINATED,
    EVALUATES2 = IN_INITIALIZATION | IN_EVENT | IN_CONTINUOUS | IN_TERMINATED
};

/* Functions and the modes in which model exchange and co-simulation allow them; FMI 2.0, sections
 * 3.2.3 and 4.2.4. */
#define FMI2_RULES(RULE)                                                        \
    RULE(SetDebugLogging, ANY2, ANY2)                                           \
    RULE(SetupExperiment, IN_INSTANTIATED, IN_INSTANTIATED)                     \
    RULE(EnterInitializationMode, IN_INSTANTIATED, IN_INSTANTIATED)             \
    RULE(ExitInitializationMode, IN_INITIALIZATION, IN_INITIALIZATION)          \
    RULE(Terminate, ANY2, ANY2)                                                 \
    RULE(Reset, ANY2, ANY2)                                                     \
    RULE(GetReal, MAY_BE_READ2, MAY_BE_READ2)                                   \
    RULE(GetInteger, MAY_BE_READ2, MAY_BE_READ2)                                \
    RULE(GetBoolean, MAY_BE_READ2, MAY_BE_READ2)                                \
    RULE(GetString, MAY_BE_READ2, MAY_BE_READ2)                                 \
    RULE(SetReal, MAY_BE_SET2 | IN_CONTINUOUS, MAY_BE_SET2)                     \
    RULE(SetInteger, MAY_BE_SET2, MAY_BE_SET2)                                  \
    RULE(SetBoolean, MAY_BE_SET2, MAY_BE_SET2)                                  \
    RULE(SetString, MAY_BE_SET2, MAY_BE_SET2)                                   \
    RULE(GetFMUstate, ANY2, ANY2)                                               \
    RULE(SetFMUstate, ANY2, ANY2)                                               \
    RULE(FreeFMUstate, ANY2, ANY2)                                              \
    RULE(SerializedFMUstateSize, ANY2, ANY2)                                    \
    RULE(SerializeFMUstate, ANY2, ANY2)                                         \
    RULE(DeSerializeFMUstate, ANY2, ANY2)                                       \
    RULE(GetDirectionalDerivative, EVALUATES2, IN_NONE)                         \
    RULE(EnterEventMode, IN_EVENT | IN_CONTINUOUS, IN_NONE)                     \
    RULE(NewDiscreteStates, IN_EVENT, IN_NONE)                                  \
    RULE(EnterContinuousTimeMode, IN_EVENT, IN_NONE)                            \
    RULE(CompletedIntegratorStep, IN_CONTINUOUS, IN_NONE)                       \
    RULE(SetTime, IN_EVENT | IN_CONTINUOUS, IN_NONE)                            \
    RULE(SetContinuousStates, IN_CONTINUOUS, IN_NONE)                           \
    RULE(GetDerivatives, EVALUATES2, IN_NONE)                                   \
    RULE(GetEventIndicators, EVALUATES2, IN_NONE)                               \
    RULE(GetContinuousStates, EVALUATES2, IN_NONE)                              \
    RULE(GetNominalsOfContinuousStates, EVALUATES2 | IN_INSTANTIATED, IN_NONE)  \
    RULE(SetRealInputDerivatives, IN_NONE, ANY2)                                \
    RULE(GetRealOutputDerivatives, IN_NONE, ANY2)                               \
    RULE(DoStep, IN_NONE, IN_STEP)                                              \
    RULE(CancelStep, IN_NONE, ANY2)                                             \
    RULE(GetStatus, IN_NONE, IN_STEP | IN_TERMINATED)                           \
    RULE(GetRealStatus, IN_NONE, IN_STEP | IN_TERMINATED)                       \
    RULE(GetIntegerStatus, IN_NONE, IN_STEP | IN_TERMINATED)                    \
    RULE(GetBooleanStatus, IN_NONE, IN_STEP | IN_TERMINATED)                    \
    RULE(GetStringStatus, IN_NONE, IN_STEP | IN_TERMINATED)

#define FMI2_NUMBER(name, exchange, simulation) RULE2_##name,
#define FMI2_ENTRY(name, exchange, simulation) {"fmi2" #name, {exchange, simulation}},

enum { FMI2_RULES(FMI2_NUMBER) RULES2 };

static const Rule FMI2[RULES2] = {FMI2_RULES(FMI2_ENTRY)};

static const Standard STANDARD2 = {
    2,
    "fmi2",
    {"Real", "Integer", "Boolean", "Clock"},
    {"the state instantiated", "Initialization Mode", "Event Mode", "Continuous-Time Mode",
     "the state stepComplete", "an intermediate update", "the state terminated"},
    {{{"fmi2EnterInitializationMode", MODE_INITIALIZATION},
      {"fmi2ExitInitializationMode", MODE_EVENT},
      {"fmi2EnterContinuousTimeMode", MODE_CONTINUOUS},
      {"fmi2EnterEventMode", MODE_EVENT},
      {NULL, MODE_STEP},
      {NULL, MODE_INTERMEDIATE},
      {"fmi2Reset", MODE_INSTANTIATED}},
     {{"fmi2EnterInitializationMode", MODE_INITIALIZATION},
      {"fmi2ExitInitializationMode", MODE_STEP},
      {NULL, MODE_EVENT},
      {NULL, MODE_CONTINUOUS},
      {NULL, MODE_STEP},
      {NULL, MODE_INTERMEDIATE},
      {"fmi2Reset", MODE_INSTANTIATED}}},
};

/* Return the instance if the call is allowed in its mode and the pointer is valid; else NULL. */
static Instance *called2(fmi2Component c, int rule, size_t count, const void *pointer) {
    Instance *instance = allowed(c, &FMI2[rule]);
    return instance && given(instance, &FMI2[rule], count, pointer) ? instance : NULL;
}

static fmi2Status worse2(fmi2Status status, int another) {
    return another > (int)status ? (fmi2Status)another : status;
}

/* --- versions and messages -------------------------------------------------------------------- */

EXPORTED const char *FMI2(GetTypesPlatform)(void) {
    return FMI2_TYPES_PLATFORM;
}

EXPORTED const char *FMI2(GetVersion)(void) {
    return FMI2_VERSION;
}

/* Pass the message as the format itself, for loggers without variable arguments. */
static void send2(const Journal *journal, int status, const char *category, const char *text) {
    fmi2CallbackLogger logger = (fmi2CallbackLogger)journal->callback;
    logger(journal->environment, journal->instance, (fmi2Status)status, category, text);
}

EXPORTED fmi2Status FMI2(SetDebugLogging)(fmi2Component c, fmi2Boolean loggingOn,
                                          size_t nCategories, const fmi2String categories[]) {
    Instance *instance = called2(c, RULE2_SetDebugLogging, nCategories, categories);
    return instance ? (fmi2Status)choose_categories(instance, &FMI2[RULE2_SetDebugLogging],
                                                    loggingOn != fmi2False, nCategories,
                                                    categories)
                    : fmi2Error;
}

/* --- creation and initialization -------------------------------------------------------------- */

/* Create an instance.  Errors are logged even if loggingOn is false, as FMI 2.0 requires. */
EXPORTED fmi2Component FMI2(Instantiate)(fmi2String instanceName, fmi2Type fmuType,
                                         fmi2String fmuGUID, fmi2String fmuResourceLocation,
                                         const fmi2CallbackFunctions *functions,
                                         fmi2Boolean visible, fmi2Boolean loggingOn) {
    Request request = {0};
    (void)visible; /* The FMU has no graphical interface. */
    request.standard = &STANDARD2;
    request.kind = fmuType == fmi2ModelExchange ? MODEL_EXCHANGE : CO_SIMULATION;
    request.token = fmuGUID;
    request.resources = fmuResourceLocation;
    request.journal.instance = instanceName ? instanceName : "";
    request.journal.send = send2;
    request.journal.special = "#%";
    request.journal.categories = loggingOn ? LOG_EVERYTHING : LOG_ERROR | LOG_FATAL;
    if (functions) {
        request.journal.callback = (Callback *)functions->logger;
        request.journal.environment = functions->componentEnvironment;
    }
    if (fmuType != fmi2ModelExchange && fmuType != fmi2CoSimulation) {
        report(&request.journal, FMU_ERROR, "fmi2Instantiate: unknown FMU type %d",
               (int)fmuType);
        return NULL;
    }
    return instance_open(&request);
}

EXPORTED void FMI2(FreeInstance)(fmi2Component c) {
    instance_close(c);
}

EXPORTED fmi2Status FMI2(SetupExperiment)(fmi2Component c, fmi2Boolean toleranceDefined,
                                          fmi2Real tolerance, fmi2Real startTime,
                                          fmi2Boolean stopTimeDefined, fmi2Real stopTime) {
    Instance *instance = called2(c, RULE2_SetupExperiment, 0, NULL);
    return instance ? (fmi2Status)set_up(instance, toleranceDefined != fmi2False, tolerance,
                                         startTime, stopTimeDefined != fmi2False, stopTime)
                    : fmi2Error;
}

EXPORTED fmi2Status FMI2(EnterInitializationMode)(fmi2Component c) {
    Instance *instance = called2(c, RULE2_EnterInitializationMode, 0, NULL);
    if (!instance) {
        return fmi2Error;
    }
    if (!instance->experiment || instance->experiment_refused) {
        return (fmi2Status)refuse(instance, FMU_ERROR,
                                  "fmi2EnterInitializationMode: call fmi2SetupExperiment first%s",
                                  instance->experiment ? ", with valid values" : "");
    }
    instance->mode = MODE_INITIALIZATION;
    return fmi2OK;
}

EXPORTED fmi2Status FMI2(ExitInitializationMode)(fmi2Component c) {
    Instance *instance = called2(c, RULE2_ExitInitializationMode, 0, NULL);
    return instance ? (fmi2Status)exit_initialization(instance) : fmi2Error;
}

EXPORTED fmi2Status FMI2(Terminate)(fmi2Component c) {
    Instance *instance = called2(c, RULE2_Terminate, 0, NULL);
    return instance ? (fmi2Status)end_run(instance) : fmi2Error;
}

EXPORTED fmi2Status FMI2(Reset)(fmi2Component c) {
    Instance *instance = called2(c, RULE2_Reset, 0, NULL);
    return instance ? (fmi2Status)reset(instance) : fmi2Error;
}

/* --- values ----------------------------------------------------------------------------------- */

/* Return the instance if a get or set is allowed and both of its arrays are valid; else NULL. */
static Instance *accessed2(fmi2Component c, int rule, const fmi2ValueReference vr[], size_t nvr,
                           const void *value) {
    Instance *instance = called2(c, rule, nvr, vr);
    return instance && given(instance, &FMI2[rule], nvr, value) ? instance : NULL;
}

EXPORTED fmi2Status FMI2(GetReal)(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                  fmi2Real value[]) {
    Instance *instance = accessed2(c, RULE2_GetReal, vr, nvr, value);
    fmi2Status status = instance ? fmi2OK : fmi2Error;
    for (size_t i = 0; i < nvr && status == fmi2OK; i++) {
        status = (fmi2Status)read_value(instance, vr[i], REAL, &value[i]);
    }
    return status;
}

EXPORTED fmi2Status FMI2(GetInteger)(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                     fmi2Integer value[]) {
    Instance *instance = accessed2(c, RULE2_GetInteger, vr, nvr, value);
    fmi2Status status = instance ? fmi2OK : fmi2Error;
    for (size_t i = 0; i < nvr && status == fmi2OK; i++) {
        double x = 0.0;
        status = (fmi2Status)read_value(instance, vr[i], INTEGER, &x);
        value[i] = (fmi2Integer)x;
    }
    return status;
}

EXPORTED fmi2Status FMI2(GetBoolean)(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                     fmi2Boolean value[]) {
    Instance *instance = accessed2(c, RULE2_GetBoolean, vr, nvr, value);
    fmi2Status status = instance ? fmi2OK : fmi2Error;
    for (size_t i = 0; i < nvr && status == fmi2OK; i++) {
        double x = 0.0;
        status = (fmi2Status)read_value(instance, vr[i], BOOLEAN, &x);
        value[i] = x != 0.0 ? fmi2True : fmi2False;
    }
    return status;
}

/* Reject the get, with the type of each variable: no variable is a String. */
EXPORTED fmi2Status FMI2(GetString)(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                    fmi2String value[]) {
    Instance *instance = accessed2(c, RULE2_GetString, vr, nvr, value);
    fmi2Status status = instance ? fmi2OK : fmi2Error;
    for (size_t i = 0; i < nvr && instance; i++) {
        double x;
        value[i] = "";
        status = worse2(status, read_value(instance, vr[i], NO_TYPE, &x));
    }
    return status;
}

EXPORTED fmi2Status FMI2(SetReal)(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                  const fmi2Real value[]) {
    Instance *instance = accessed2(c, RULE2_SetReal, vr, nvr, value);
    fmi2Status status = instance ? fmi2OK : fmi2Error;
    for (size_t i = 0; i < nvr && instance; i++) {
        status = worse2(status, write_value(instance, vr[i], REAL, value[i]));
    }
    return status;
}

EXPORTED fmi2Status FMI2(SetInteger)(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                     const fmi2Integer value[]) {
    Instance *instance = accessed2(c, RULE2_SetInteger, vr, nvr, value);
    fmi2Status status = instance ? fmi2OK : fmi2Error;
    for (size_t i = 0; i < nvr && instance; i++) {
        status = worse2(status, write_value(instance, vr[i], INTEGER, value[i]));
    }
    return status;
}

EXPORTED fmi2Status FMI2(SetBoolean)(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                     const fmi2Boolean value[]) {
    Instance *instance = accessed2(c, RULE2_SetBoolean, vr, nvr, value);
    fmi2Status status = instance ? fmi2OK : fmi2Error;
    for (size_t i = 0; i < nvr && instance; i++) {
        status = worse2(status, write_value(instance, vr[i], BOOLEAN, value[i] != fmi2False));
    }
    return status;
}

EXPORTED fmi2Status FMI2(SetString)(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                    const fmi2String value[]) {
    Instance *instance = accessed2(c, RULE2_SetString, vr, nvr, value);
    fmi2Status status = instance ? fmi2OK : fmi2Error;
    for (size_t i = 0; i < nvr && instance; i++) {
        status = worse2(status, write_value(instance, vr[i], NO_TYPE, 0.0));
    }
    return status;
}

EXPORTED fmi2Status FMI2(GetDirectionalDerivative)(fmi2Component c,
                                                   const fmi2ValueReference vUnknown_ref[],
                                                   size_t nUnknown,
                                                   const fmi2ValueReference vKnown_ref[],
                                                   size_t nKnown, const fmi2Real dvKnown[],
                                                   fmi2Real dvUnknown[]) {
    const Rule *rule = &FMI2[RULE2_GetDirectionalDerivative];
    Instance *instance = accessed2(c, RULE2_GetDirectionalDerivative, vUnknown_ref, nUnknown,
                                   dvUnknown);
    if (!instance || !given(instance, rule, nKnown, vKnown_ref) ||
        !given(instance, rule, nKnown, dvKnown)) {
        return fmi2Error;
    }
    return (fmi2Status)directional_derivative(instance, vUnknown_ref, nUnknown, vKnown_ref, nKnown,
                                              dvKnown, dvUnknown);
}

/* --- saved states ----------------------------------------------------------------------------- */

EXPORTED fmi2Status FMI2(GetFMUstate)(fmi2Component c, fmi2FMUstate *FMUstate) {
    Instance *instance = called2(c, RULE2_GetFMUstate, 1, FMUstate);
    return instance ? (fmi2Status)save_state(instance, FMUstate) : fmi2Error;
}

EXPORTED fmi2Status FMI2(SetFMUstate)(fmi2Component c, fmi2FMUstate FMUstate) {
    Instance *instance = called2(c, RULE2_SetFMUstate, 1, FMUstate);
    return instance ? (fmi2Status)restore_state(instance, FMUstate) : fmi2Error;
}

EXPORTED fmi2Status FMI2(FreeFMUstate)(fmi2Component c, fmi2FMUstate *FMUstate) {
    Instance *instance = called2(c, RULE2_FreeFMUstate, 0, NULL);
    if (instance && FMUstate) {
        free_state(FMUstate);
    }
    return instance ? fmi2OK : fmi2Error;
}

EXPORTED fmi2Status FMI2(SerializedFMUstateSize)(fmi2Component c, fmi2FMUstate FMUstate,
                                                 size_t *size) {
    const Rule *rule = &FMI2[RULE2_SerializedFMUstateSize];
    Instance *instance = called2(c, RULE2_SerializedFMUstateSize, 1, FMUstate);
    if (!instance || !given(instance, rule, 1, size)) {
        return fmi2Error;
    }
    *size = ((const Saved *)FMUstate)->size;
    return fmi2OK;
}

EXPORTED fmi2Status FMI2(SerializeFMUstate)(fmi2Component c, fmi2FMUstate FMUstate,
                                            fmi2Byte serializedState[], size_t size) {
    const Rule *rule = &FMI2[RULE2_SerializeFMUstate];
    Instance *instance = called2(c, RULE2_SerializeFMUstate, 1, FMUstate);
    if (!instance || !given(instance, rule, 1, serializedState)) {
        return fmi2Error;
    }
    return (fmi2Status)serialize(instance, FMUstate, (unsigned char *)serializedState, size);
}

EXPORTED fmi2Status FMI2(DeSerializeFMUstate)(fmi2Component c, const fmi2Byte serializedState[],
                                              size_t size, fmi2FMUstate *FMUstate) {
    const Rule *rule = &FMI2[RULE2_DeSerializeFMUstate];
    Instance *instance = called2(c, RULE2_DeSerializeFMUstate, 1, serializedState);
    if (!instance || !given(instance, rule, 1, FMUstate)) {
        return fmi2Error;
    }
    return (fmi2Status)deserialize(instance, (const unsigned char *)serializedState, size,
                                   FMUstate);
}

/* --- model exchange --------------------------------------------------------------------------- */

EXPORTED fmi2Status FMI2(EnterEventMode)(fmi2Component c) {
    Instance *instance = called2(c, RULE2_EnterEventMode, 0, NULL);
    return instance ? (fmi2Status)enter_event_mode(instance) : fmi2Error;
}

EXPORTED fmi2Status FMI2(NewDiscreteStates)(fmi2Component c, fmi2EventInfo *eventInfo) {
    Instance *instance = called2(c, RULE2_NewDiscreteStates, 1, eventInfo);
    bool again = false, changed = false;
    if (!instance) {
        return fmi2Error;
    }
    fmi2Status status = (fmi2Status)update_discrete_states(instance, &again, &changed);
    eventInfo->newDiscreteStatesNeeded = again ? fmi2True : fmi2False;
    eventInfo->terminateSimulation = fmi2False;
    eventInfo->nominalsOfContinuousStatesChanged = fmi2False;
    eventInfo->valuesOfContinuousStatesChanged = changed ? fmi2True : fmi2False;
    eventInfo->nextEventTimeDefined = fmi2False;
    eventInfo->nextEventTime = 0.0;
    return status;
}

EXPORTED fmi2Status FMI2(EnterContinuousTimeMode)(fmi2Component c) {
    Instance *instance = called2(c, RULE2_EnterContinuousTimeMode, 0, NULL);
    return instance ? (fmi2Status)leave_event_mode(instance, &FMI2[RULE2_EnterContinuousTimeMode],
                                                   MODE_CONTINUOUS)
                    : fmi2Error;
}

EXPORTED fmi2Status FMI2(CompletedIntegratorStep)(fmi2Component c,
                                                  fmi2Boolean noSetFMUStatePriorToCurrentPoint,
                                                  fmi2Boolean *enterEventMode,
                                                  fmi2Boolean *terminateSimulation) {
    const Rule *rule = &FMI2[RULE2_CompletedIntegratorStep];
    Instance *instance = called2(c, RULE2_CompletedIntegratorStep, 1, enterEventMode);
    bool event = false;
    (void)noSetFMUStatePriorToCurrentPoint; /* The FMU keeps no earlier state. */
    if (!instance || !given(instance, rule, 1, terminateSimulation)) {
        return fmi2Error;
    }
    fmi2Status status = (fmi2Status)completed_step(instance, &event);
    *enterEventMode = event ? fmi2True : fmi2False;
    *terminateSimulation = fmi2False;
    return status;
}

EXPORTED fmi2Status FMI2(SetTime)(fmi2Component c, fmi2Real time) {
    Instance *instance = called2(c, RULE2_SetTime, 0, NULL);
    return instance ? (fmi2Status)set_time(instance, time) : fmi2Error;
}

EXPORTED fmi2Status FMI2(SetContinuousStates)(fmi2Component c, const fmi2Real x[], size_t nx) {
    Instance *instance = called2(c, RULE2_SetContinuousStates, nx, x);
    return instance ? (fmi2Status)set_states(instance, x, nx) : fmi2Error;
}

EXPORTED fmi2Status FMI2(GetDerivatives)(fmi2Component c, fmi2Real derivatives[], size_t nx) {
    Instance *instance = called2(c, RULE2_GetDerivatives, nx, derivatives);
    return instance ? (fmi2Status)get_derivatives(instance, derivatives, nx) : fmi2Error;
}

EXPORTED fmi2Status FMI2(GetEventIndicators)(fmi2Component c, fmi2Real eventIndicators[],
                                             size_t ni) {
    Instance *instance = called2(c, RULE2_GetEventIndicators, ni, eventIndicators);
    return instance ? (fmi2Status)get_indicators(instance, eventIndicators, ni) : fmi2Error;
}

EXPORTED fmi2Status FMI2(GetContinuousStates)(fmi2Component c, fmi2Real x[], size_t nx) {
    Instance *instance = called2(c, RULE2_GetContinuousStates, nx, x);
    return instance ? (fmi2Status)get_states(instance, x, nx) : fmi2Error;
}

EXPORTED fmi2Status FMI2(GetNominalsOfContinuousStates)(fmi2Component c, fmi2Real x_nominal[],
                                                        size_t nx) {
    Instance *instance = called2(c, RULE2_GetNominalsOfContinuousStates, nx, x_nominal);
    return instance ? (fmi2Status)get_nominals(instance, x_nominal, nx) : fmi2Error;
}

/* --- co-simulation ---------------------------------------------------------------------------- */

EXPORTED fmi2Status FMI2(SetRealInputDerivatives)(fmi2Component c, const fmi2ValueReference vr[],
                                                  size_t nvr, const fmi2Integer order[],
                                                  const fmi2Real value[]) {
    Instance *instance = called2(c, RULE2_SetRealInputDerivatives, 0, NULL);
    (void)vr, (void)nvr, (void)order, (void)value;
    if (instance) {
        refuse(instance, FMU_ERROR, "fmi2SetRealInputDerivatives: inputs are constant within a "
                                    "step (canInterpolateInputs = false); make shorter steps");
    }
    return fmi2Error;
}

EXPORTED fmi2Status FMI2(GetRealOutputDerivatives)(fmi2Component c, const fmi2ValueReference vr[],
                                                   size_t nvr, const fmi2Integer order[],
                                                   fmi2Real value[]) {
    Instance *instance = called2(c, RULE2_GetRealOutputDerivatives, 0, NULL);
    (void)vr, (void)nvr, (void)order, (void)value;
    if (instance) {
        refuse(instance, FMU_ERROR, "fmi2GetRealOutputDerivatives: there are no derivatives of "
                                    "outputs (maxOutputDerivativeOrder = 0)");
    }
    return fmi2Error;
}

EXPORTED fmi2Status FMI2(DoStep)(fmi2Component c, fmi2Real currentCommunicationPoint,
                                 fmi2Real communicationStepSize,
                                 fmi2Boolean noSetFMUStatePriorToCurrentPoint) {
    Instance *instance = called2(c, RULE2_DoStep, 0, NULL);
    Outcome outcome;
    (void)noSetFMUStatePriorToCurrentPoint; /* The FMU keeps no earlier state. */
    return instance ? (fmi2Status)make_step(instance, currentCommunicationPoint,
                                            communicationStepSize, &outcome)
                    : fmi2Error;
}

EXPORTED fmi2Status FMI2(CancelStep)(fmi2Component c) {
    Instance *instance = called2(c, RULE2_CancelStep, 0, NULL);
    if (instance) {
        refuse(instance, FMU_ERROR, "fmi2CancelStep: fmi2DoStep returns when it is done, so there "
                                    "is no step to cancel (canRunAsynchronuously = false)");
    }
    return fmi2Error;
}

/* Discard a request for a status that the FMU does not provide, as the standard requires. */
static fmi2Status no_status2(const Instance *instance, int rule, fmi2StatusKind kind) {
    static const char *const names[] = {"fmi2DoStepStatus", "fmi2PendingStatus",
                                        "fmi2LastSuccessfulTime", "fmi2Terminated"};
    bool known = (int)kind >= 0 && (int)kind < 4;
    return (fmi2Status)refuse(instance, FMU_DISCARD, "%s does not provide %s", FMI2[rule].function,
                              known ? names[(int)kind] : "this status");
}

EXPORTED fmi2Status FMI2(GetStatus)(fmi2Component c, const fmi2StatusKind s, fmi2Status *value) {
    Instance *instance = called2(c, RULE2_GetStatus, 1, value);
    if (!instance) {
        return fmi2Error;
    }
    if (s != fmi2DoStepStatus) {
        return no_status2(instance, RULE2_GetStatus, s);
    }
    *value = (fmi2Status)instance->last_step;
    return fmi2OK;
}

EXPORTED fmi2Status FMI2(GetRealStatus)(fmi2Component c, const fmi2StatusKind s, fmi2Real *value) {
    Instance *instance = called2(c, RULE2_GetRealStatus, 1, value);
    if (!instance) {
        return fmi2Error;
    }
    if (s != fmi2LastSuccessfulTime) {
        return no_status2(instance, RULE2_GetRealStatus, s);
    }
    *value = simulation_time(instance->simulation);
    return fmi2OK;
}

EXPORTED fmi2Status FMI2(GetIntegerStatus)(fmi2Component c, const fmi2StatusKind s,
                                           fmi2Integer *value) {
    Instance *instance = called2(c, RULE2_GetIntegerStatus, 1, value);
    return instance ? no_status2(instance, RULE2_GetIntegerStatus, s) : fmi2Error;
}

/* Request the end of the simulation after a rejected step, so that importers do not repeat it
 * forever. */
EXPORTED fmi2Status FMI2(GetBooleanStatus)(fmi2Component c, const fmi2StatusKind s,
                                           fmi2Boolean *value) {
    Instance *instance = called2(c, RULE2_GetBooleanStatus, 1, value);
    if (!instance) {
        return fmi2Error;
    }
    if (s != fmi2Terminated) {
        return no_status2(instance, RULE2_GetBooleanStatus, s);
    }
    *value = instance->last_step == FMU_OK ? fmi2False : fmi2True;
    return fmi2OK;
}

EXPORTED fmi2Status FMI2(GetStringStatus)(fmi2Component c, const fmi2StatusKind s,
                                          fmi2String *value) {
    Instance *instance = called2(c, RULE2_GetStringStatus, 1, value);
    if (!instance) {
        return fmi2Error;
    }
    if (s != fmi2PendingStatus) {
        return no_status2(instance, RULE2_GetStringStatus, s);
    }
    *value = "no step is pending: fmi2DoStep returns when it is done";
    return fmi2OK;
}

#endif
