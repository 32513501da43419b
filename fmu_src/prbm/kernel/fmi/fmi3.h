/* The rules of FMI 3.0: which functions may be called when. */
#ifndef PRBM_FMI3_H
#define PRBM_FMI3_H

#include "fmi/fmu.h"
#include "fmi/types3.h"

/* --- the state machine of the standard -------------------------------------------------------- */

enum {
    ANY3 = IN_ANY_BUT_UPDATE,
    REJECTED3 = IN_ANY, /* Functions that are rejected in every mode. */
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

/* Functions and the modes in which model exchange and co-simulation allow them; FMI 3.0, sections
 * 2.3, 3.2 and 4.2.  SetTime in Event Mode is an addition, which importers use as in FMI 2.0. */
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
    RULE(GetNumberOfVariableDependencies, REJECTED3, REJECTED3)                \
    RULE(GetVariableDependencies, REJECTED3, REJECTED3)                        \
    RULE(GetFMUState, ANY3, ANY3)                                              \
    RULE(SetFMUState, ANY3, ANY3)                                              \
    RULE(FreeFMUState, ANY3, ANY3)                                             \
    RULE(SerializedFMUStateSize, ANY3, ANY3)                                   \
    RULE(SerializeFMUState, ANY3, ANY3)                                        \
    RULE(DeserializeFMUState, ANY3, ANY3)                                      \
    RULE(GetDirectionalDerivative, EVALUATES3, IN_NONE)                        \
    RULE(GetAdjointDerivative, REJECTED3, REJECTED3)                           \
    RULE(EnterConfigurationMode, REJECTED3, REJECTED3)                         \
    RULE(ExitConfigurationMode, REJECTED3, REJECTED3)                          \
    RULE(GetIntervalDecimal, REJECTED3, REJECTED3)                             \
    RULE(GetIntervalFraction, REJECTED3, REJECTED3)                            \
    RULE(GetShiftDecimal, REJECTED3, REJECTED3)                                \
    RULE(GetShiftFraction, REJECTED3, REJECTED3)                               \
    RULE(SetIntervalDecimal, REJECTED3, REJECTED3)                             \
    RULE(SetIntervalFraction, REJECTED3, REJECTED3)                            \
    RULE(SetShiftDecimal, REJECTED3, REJECTED3)                                \
    RULE(SetShiftFraction, REJECTED3, REJECTED3)                               \
    RULE(EvaluateDiscreteStates, IN_EVENT, IN_EVENT)                           \
    RULE(UpdateDiscreteStates, IN_EVENT, IN_EVENT)                             \
    RULE(EnterContinuousTimeMode, IN_EVENT, IN_NONE)                           \
    RULE(CompletedIntegratorStep, IN_CONTINUOUS, IN_NONE)                      \
    RULE(SetTime, IN_EVENT | IN_CONTINUOUS, IN_NONE)                           \
    RULE(SetContinuousStates, IN_CONTINUOUS, IN_NONE)                          \
    RULE(GetContinuousStateDerivatives, EVALUATES3, IN_NONE)                   \
    RULE(GetEventIndicators, EVALUATES3, IN_NONE)                              \
    RULE(GetContinuousStates, EVALUATES3, IN_NONE)                             \
    RULE(GetNominalsOfContinuousStates, EVALUATES3, IN_NONE)                   \
    RULE(GetNumberOfEventIndicators, ANY3, IN_NONE)                            \
    RULE(GetNumberOfContinuousStates, ANY3, IN_NONE)                           \
    RULE(EnterStepMode, IN_NONE, IN_EVENT)                                     \
    RULE(GetOutputDerivatives, REJECTED3, REJECTED3)                           \
    RULE(DoStep, IN_NONE, IN_STEP)                                             \
    RULE(ActivateModelPartition, REJECTED3, REJECTED3)

#define FMI3_NUMBER(name, exchange, simulation) RULE3_##name,
#define FMI3_ENTRY(name, exchange, simulation) {"fmi3" #name, {exchange, simulation}},

enum { FMI3_RULES(FMI3_NUMBER) RULES3 };

static const Rule FMI3[RULES3] = {FMI3_RULES(FMI3_ENTRY)};

/* --- fmi3.c ----------------------------------------------------------------------------------- */

PRBM Instance *called3(fmi3Instance handle, int rule, size_t count, const void *pointer);
PRBM Instance *called_for_event3(fmi3Instance handle, int rule);
PRBM fmi3Status worse3(fmi3Status status, int another);
PRBM fmi3Status absent3(fmi3Instance handle, int rule, const char *why);

#endif
