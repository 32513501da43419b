/* The functions of FMI 3.0. */
#if !defined(PRBM_FMI) || PRBM_FMI == 3

#include <string.h>

#include "fmi/fmi3.h"

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

/* Return the instance if the call is allowed in its mode and the pointer is valid; else NULL. */
PRBM Instance *called3(fmi3Instance handle, int rule, size_t count, const void *pointer) {
    Instance *instance = allowed(handle, &FMI3[rule]);
    return instance && given(instance, &FMI3[rule], count, pointer) ? instance : NULL;
}

/* Like called3, for functions of Event Mode.  In co-simulation they need eventModeUsed = true. */
PRBM Instance *called_for_event3(fmi3Instance handle, int rule) {
    const Instance *instance = handle;
    if (instance && instance->kind == CO_SIMULATION && !instance->event_mode) {
        refuse(instance, FMU_ERROR, "%s is for instances made with eventModeUsed = true; this one "
                                    "handles its events within fmi3DoStep",
               FMI3[rule].function);
        return NULL;
    }
    return called3(handle, rule, 0, NULL);
}

PRBM fmi3Status worse3(fmi3Status status, int another) {
    return another > (int)status ? (fmi3Status)another : status;
}

/* Reject a call of a function that this FMU does not support, with the reason. */
PRBM fmi3Status absent3(fmi3Instance handle, int rule, const char *why) {
    const Instance *instance = handle;
    if (instance) {
        refuse(instance, FMU_ERROR, "%s: %s", FMI3[rule].function, why);
    }
    return fmi3Error;
}

/* --- versions and messages -------------------------------------------------------------------- */

EXPORTED const char *FMI3(GetVersion)(void) {
    return FMI3_VERSION;
}

static void send3(const Journal *journal, int status, const char *category, const char *text) {
    fmi3LogMessageCallback log_message = (fmi3LogMessageCallback)journal->callback;
    log_message(journal->environment, (fmi3Status)status, category, text);
}

EXPORTED fmi3Status FMI3(SetDebugLogging)(fmi3Instance instance, fmi3Boolean loggingOn,
                                          size_t nCategories, const fmi3String categories[]) {
    Instance *it = called3(instance, RULE3_SetDebugLogging, nCategories, categories);
    return it ? (fmi3Status)choose_categories(it, &FMI3[RULE3_SetDebugLogging], loggingOn,
                                              nCategories, categories)
              : fmi3Error;
}

/* --- creation and initialization -------------------------------------------------------------- */

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

EXPORTED fmi3Instance FMI3(InstantiateModelExchange)(fmi3String instanceName,
                                                     fmi3String instantiationToken,
                                                     fmi3String resourcePath, fmi3Boolean visible,
                                                     fmi3Boolean loggingOn,
                                                     fmi3InstanceEnvironment instanceEnvironment,
                                                     fmi3LogMessageCallback logMessage) {
    Request request = request3(MODEL_EXCHANGE, instanceName, instantiationToken, resourcePath,
                               loggingOn, instanceEnvironment, logMessage);
    (void)visible; /* The FMU has no graphical interface. */
    return instance_open(&request);
}

/* Call the importer after an internal step; return whether it requests the end of the step. */
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

EXPORTED fmi3Instance FMI3(InstantiateCoSimulation)(
    fmi3String instanceName, fmi3String instantiationToken, fmi3String resourcePath,
    fmi3Boolean visible, fmi3Boolean loggingOn, fmi3Boolean eventModeUsed,
    fmi3Boolean earlyReturnAllowed, const fmi3ValueReference requiredIntermediateVariables[],
    size_t nRequiredIntermediateVariables, fmi3InstanceEnvironment instanceEnvironment,
    fmi3LogMessageCallback logMessage, fmi3IntermediateUpdateCallback intermediateUpdate) {
    Request request = request3(CO_SIMULATION, instanceName, instantiationToken, resourcePath,
                               loggingOn, instanceEnvironment, logMessage);
    (void)visible; /* The FMU has no graphical interface. */
    request.event_mode = eventModeUsed;
    request.early_return = earlyReturnAllowed;
    request.required = requiredIntermediateVariables;
    request.required_count = nRequiredIntermediateVariables;
    request.intermediate = (Callback *)intermediateUpdate;
    request.update = intermediateUpdate ? update3 : NULL;
    return instance_open(&request);
}

EXPORTED fmi3Instance FMI3(InstantiateScheduledExecution)(
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

EXPORTED void FMI3(FreeInstance)(fmi3Instance instance) {
    instance_close(instance);
}

EXPORTED fmi3Status FMI3(EnterInitializationMode)(fmi3Instance instance,
                                                  fmi3Boolean toleranceDefined,
                                                  fmi3Float64 tolerance, fmi3Float64 startTime,
                                                  fmi3Boolean stopTimeDefined,
                                                  fmi3Float64 stopTime) {
    Instance *it = called3(instance, RULE3_EnterInitializationMode, 0, NULL);
    if (!it || set_up(it, toleranceDefined, tolerance, startTime, stopTimeDefined, stopTime)) {
        return fmi3Error;
    }
    it->mode = MODE_INITIALIZATION;
    return fmi3OK;
}

EXPORTED fmi3Status FMI3(ExitInitializationMode)(fmi3Instance instance) {
    Instance *it = called3(instance, RULE3_ExitInitializationMode, 0, NULL);
    return it ? (fmi3Status)exit_initialization(it) : fmi3Error;
}

EXPORTED fmi3Status FMI3(Terminate)(fmi3Instance instance) {
    Instance *it = called3(instance, RULE3_Terminate, 0, NULL);
    return it ? (fmi3Status)end_run(it) : fmi3Error;
}

EXPORTED fmi3Status FMI3(Reset)(fmi3Instance instance) {
    Instance *it = called3(instance, RULE3_Reset, 0, NULL);
    return it ? (fmi3Status)reset(it) : fmi3Error;
}

EXPORTED fmi3Status FMI3(EnterConfigurationMode)(fmi3Instance instance) {
    return absent3(instance, RULE3_EnterConfigurationMode, "there are no structural parameters");
}

EXPORTED fmi3Status FMI3(ExitConfigurationMode)(fmi3Instance instance) {
    return absent3(instance, RULE3_ExitConfigurationMode, "there are no structural parameters");
}

/* --- saved states ----------------------------------------------------------------------------- */

EXPORTED fmi3Status FMI3(GetFMUState)(fmi3Instance instance, fmi3FMUState *FMUState) {
    Instance *it = called3(instance, RULE3_GetFMUState, 1, FMUState);
    return it ? (fmi3Status)save_state(it, FMUState) : fmi3Error;
}

EXPORTED fmi3Status FMI3(SetFMUState)(fmi3Instance instance, fmi3FMUState FMUState) {
    Instance *it = called3(instance, RULE3_SetFMUState, 1, FMUState);
    return it ? (fmi3Status)restore_state(it, FMUState) : fmi3Error;
}

EXPORTED fmi3Status FMI3(FreeFMUState)(fmi3Instance instance, fmi3FMUState *FMUState) {
    Instance *it = called3(instance, RULE3_FreeFMUState, 0, NULL);
    if (it && FMUState) {
        free_state(FMUState);
    }
    return it ? fmi3OK : fmi3Error;
}

EXPORTED fmi3Status FMI3(SerializedFMUStateSize)(fmi3Instance instance, fmi3FMUState FMUState,
                                                 size_t *size) {
    Instance *it = called3(instance, RULE3_SerializedFMUStateSize, 1, FMUState);
    if (!it || !given(it, &FMI3[RULE3_SerializedFMUStateSize], 1, size)) {
        return fmi3Error;
    }
    *size = ((const Saved *)FMUState)->size;
    return fmi3OK;
}

EXPORTED fmi3Status FMI3(SerializeFMUState)(fmi3Instance instance, fmi3FMUState FMUState,
                                            fmi3Byte serializedState[], size_t size) {
    Instance *it = called3(instance, RULE3_SerializeFMUState, 1, FMUState);
    if (!it || !given(it, &FMI3[RULE3_SerializeFMUState], 1, serializedState)) {
        return fmi3Error;
    }
    return (fmi3Status)serialize(it, FMUState, serializedState, size);
}

EXPORTED fmi3Status FMI3(DeserializeFMUState)(fmi3Instance instance,
                                              const fmi3Byte serializedState[], size_t size,
                                              fmi3FMUState *FMUState) {
    Instance *it = called3(instance, RULE3_DeserializeFMUState, 1, serializedState);
    if (!it || !given(it, &FMI3[RULE3_DeserializeFMUState], 1, FMUState)) {
        return fmi3Error;
    }
    return (fmi3Status)deserialize(it, serializedState, size, FMUState);
}

/* --- events ----------------------------------------------------------------------------------- */

EXPORTED fmi3Status FMI3(EnterEventMode)(fmi3Instance instance) {
    Instance *it = called_for_event3(instance, RULE3_EnterEventMode);
    return it ? (fmi3Status)enter_event_mode(it) : fmi3Error;
}

/* Do nothing: fmi3UpdateDiscreteStates handles events. */
EXPORTED fmi3Status FMI3(EvaluateDiscreteStates)(fmi3Instance instance) {
    return called_for_event3(instance, RULE3_EvaluateDiscreteStates) ? fmi3OK : fmi3Error;
}

EXPORTED fmi3Status FMI3(UpdateDiscreteStates)(
    fmi3Instance instance, fmi3Boolean *discreteStatesNeedUpdate, fmi3Boolean *terminateSimulation,
    fmi3Boolean *nominalsOfContinuousStatesChanged, fmi3Boolean *valuesOfContinuousStatesChanged,
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

EXPORTED fmi3Status FMI3(EnterContinuousTimeMode)(fmi3Instance instance) {
    Instance *it = called3(instance, RULE3_EnterContinuousTimeMode, 0, NULL);
    return it ? (fmi3Status)leave_event_mode(it, &FMI3[RULE3_EnterContinuousTimeMode],
                                             MODE_CONTINUOUS)
              : fmi3Error;
}

EXPORTED fmi3Status FMI3(CompletedIntegratorStep)(fmi3Instance instance,
                                                  fmi3Boolean noSetFMUStatePriorToCurrentPoint,
                                                  fmi3Boolean *enterEventMode,
                                                  fmi3Boolean *terminateSimulation) {
    Instance *it = called3(instance, RULE3_CompletedIntegratorStep, 1, enterEventMode);
    bool event = false;
    (void)noSetFMUStatePriorToCurrentPoint; /* The FMU keeps no earlier state. */
    if (!it || !given(it, &FMI3[RULE3_CompletedIntegratorStep], 1, terminateSimulation)) {
        return fmi3Error;
    }
    fmi3Status status = (fmi3Status)completed_step(it, &event);
    *enterEventMode = event;
    *terminateSimulation = fmi3False;
    return status;
}

EXPORTED fmi3Status FMI3(SetTime)(fmi3Instance instance, fmi3Float64 time) {
    Instance *it = called3(instance, RULE3_SetTime, 0, NULL);
    return it ? (fmi3Status)set_time(it, time) : fmi3Error;
}

EXPORTED fmi3Status FMI3(SetContinuousStates)(fmi3Instance instance,
                                              const fmi3Float64 continuousStates[],
                                              size_t nContinuousStates) {
    Instance *it = called3(instance, RULE3_SetContinuousStates, nContinuousStates,
                           continuousStates);
    return it ? (fmi3Status)set_states(it, continuousStates, nContinuousStates) : fmi3Error;
}

EXPORTED fmi3Status FMI3(GetContinuousStateDerivatives)(fmi3Instance instance,
                                                        fmi3Float64 derivatives[],
                                                        size_t nContinuousStates) {
    Instance *it = called3(instance, RULE3_GetContinuousStateDerivatives, nContinuousStates,
                           derivatives);
    return it ? (fmi3Status)get_derivatives(it, derivatives, nContinuousStates) : fmi3Error;
}

EXPORTED fmi3Status FMI3(GetEventIndicators)(fmi3Instance instance, fmi3Float64 eventIndicators[],
                                             size_t nEventIndicators) {
    Instance *it = called3(instance, RULE3_GetEventIndicators, nEventIndicators, eventIndicators);
    return it ? (fmi3Status)get_indicators(it, eventIndicators, nEventIndicators) : fmi3Error;
}

EXPORTED fmi3Status FMI3(GetContinuousStates)(fmi3Instance instance, fmi3Float64 continuousStates[],
                                              size_t nContinuousStates) {
    Instance *it = called3(instance, RULE3_GetContinuousStates, nContinuousStates,
                           continuousStates);
    return it ? (fmi3Status)get_states(it, continuousStates, nContinuousStates) : fmi3Error;
}

EXPORTED fmi3Status FMI3(GetNominalsOfContinuousStates)(fmi3Instance instance,
                                                        fmi3Float64 nominals[],
                                                        size_t nContinuousStates) {
    Instance *it = called3(instance, RULE3_GetNominalsOfContinuousStates, nContinuousStates,
                           nominals);
    return it ? (fmi3Status)get_nominals(it, nominals, nContinuousStates) : fmi3Error;
}

EXPORTED fmi3Status FMI3(GetNumberOfEventIndicators)(fmi3Instance instance,
                                                     size_t *nEventIndicators) {
    Instance *it = called3(instance, RULE3_GetNumberOfEventIndicators, 1, nEventIndicators);
    if (!it) {
        return fmi3Error;
    }
    *nEventIndicators = (size_t)it->indicators;
    return fmi3OK;
}

EXPORTED fmi3Status FMI3(GetNumberOfContinuousStates)(fmi3Instance instance,
                                                      size_t *nContinuousStates) {
    Instance *it = called3(instance, RULE3_GetNumberOfContinuousStates, 1, nContinuousStates);
    if (!it) {
        return fmi3Error;
    }
    *nContinuousStates = (size_t)it->states;
    return fmi3OK;
}

/* --- co-simulation ---------------------------------------------------------------------------- */

EXPORTED fmi3Status FMI3(EnterStepMode)(fmi3Instance instance) {
    Instance *it = instance;
    bool simulates = it && it->kind == CO_SIMULATION;
    it = simulates ? called_for_event3(instance, RULE3_EnterStepMode)
                   : called3(instance, RULE3_EnterStepMode, 0, NULL);
    return it ? (fmi3Status)leave_event_mode(it, &FMI3[RULE3_EnterStepMode], MODE_STEP)
              : fmi3Error;
}

EXPORTED fmi3Status FMI3(GetOutputDerivatives)(fmi3Instance instance,
                                               const fmi3ValueReference valueReferences[],
                                               size_t nValueReferences, const fmi3Int32 orders[],
                                               fmi3Float64 values[], size_t nValues) {
    (void)valueReferences, (void)nValueReferences, (void)orders, (void)values, (void)nValues;
    return absent3(instance, RULE3_GetOutputDerivatives,
                   "there are no derivatives of outputs (maxOutputDerivativeOrder = 0)");
}

EXPORTED fmi3Status FMI3(DoStep)(fmi3Instance instance, fmi3Float64 currentCommunicationPoint,
                                 fmi3Float64 communicationStepSize,
                                 fmi3Boolean noSetFMUStatePriorToCurrentPoint,
                                 fmi3Boolean *eventHandlingNeeded, fmi3Boolean *terminateSimulation,
                                 fmi3Boolean *earlyReturn, fmi3Float64 *lastSuccessfulTime) {
    Instance *it = called3(instance, RULE3_DoStep, 0, NULL);
    bool all = eventHandlingNeeded && terminateSimulation && earlyReturn && lastSuccessfulTime;
    Outcome outcome;
    (void)noSetFMUStatePriorToCurrentPoint; /* The FMU keeps no earlier state. */
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
