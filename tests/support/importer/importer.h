/* A small importer of FMUs for the tests: FMI 2.0 and 3.0, co-simulation with and without event
 * mode, model exchange.
 *
 * It reads no XML.  A job file, written by tests/support/c_importer.py, lists the library, the
 * values to set, the communication points and the variables to record.  Numbers are read and
 * written as the 16 hexadecimal digits of their bits, so that runs of all platforms can be compared
 * bit by bit.
 */
#ifndef IMPORTER_H
#define IMPORTER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "fmi2FunctionTypes.h"
#include "fmi2TypesPlatform.h"
#include "fmi3FunctionTypes.h"
#include "fmi3PlatformTypes.h"

/* --- job.c ------------------------------------------------------------------------------------ */

enum { REAL_ITEM = 'r', INTEGER_ITEM = 'i', BOOLEAN_ITEM = 'b' };

typedef struct {
    uint32_t reference;
    char type;
    double value;
    size_t point; /* for a change: index of the communication point at which it is set */
} Item;

typedef enum { CO_SIMULATION, WITH_EVENTS, MODEL_EXCHANGE } Kind;

typedef struct {
    char *text; /* content of the file; the strings point into it */
    int version;
    Kind kind;
    const char *library, *resources, *name, *token;
    bool has_tolerance, has_stop;
    double tolerance, start, stop;
    double substep; /* of the integration in model exchange [s] */
    size_t state_count, indicator_count;
    Item *sets, *records, *changes; /* start values; recorded; set at communication points */
    size_t set_count, record_count, change_count;
    double *points;
    size_t point_count;
} Job;

bool job_read(Job *job, const char *path);
void job_free(Job *job);
double bits_to_number(uint64_t bits);
uint64_t number_to_bits(double number);

/* --- library.c -------------------------------------------------------------------------------- */

#define FMI2_FUNCTIONS(X)                                                                          \
    X(GetTypesPlatform) X(GetVersion) X(SetDebugLogging) X(Instantiate) X(FreeInstance)            \
    X(SetupExperiment) X(EnterInitializationMode) X(ExitInitializationMode) X(Terminate) X(Reset)  \
    X(GetReal) X(GetInteger) X(GetBoolean) X(GetString)                                            \
    X(SetReal) X(SetInteger) X(SetBoolean) X(SetString)                                            \
    X(GetFMUstate) X(SetFMUstate) X(FreeFMUstate)                                                  \
    X(SerializedFMUstateSize) X(SerializeFMUstate) X(DeSerializeFMUstate)                          \
    X(GetDirectionalDerivative)                                                                    \
    X(EnterEventMode) X(NewDiscreteStates) X(EnterContinuousTimeMode) X(CompletedIntegratorStep)   \
    X(SetTime) X(SetContinuousStates) X(GetDerivatives) X(GetEventIndicators)                      \
    X(GetContinuousStates) X(GetNominalsOfContinuousStates)                                        \
    X(SetRealInputDerivatives) X(GetRealOutputDerivatives) X(DoStep) X(CancelStep)                 \
    X(GetStatus) X(GetRealStatus) X(GetIntegerStatus) X(GetBooleanStatus) X(GetStringStatus)

/* The types whose functions have the same signature except for the type. */
#define FMI3_TYPES(X)                                                                              \
    X(Float32) X(Float64) X(Int8) X(UInt8) X(Int16) X(UInt16) X(Int32) X(UInt32) X(Int64)          \
    X(UInt64) X(Boolean) X(String)

#define FMI3_FUNCTIONS(X)                                                                          \
    X(GetVersion) X(SetDebugLogging) X(InstantiateModelExchange) X(InstantiateCoSimulation)        \
    X(InstantiateScheduledExecution) X(FreeInstance) X(EnterInitializationMode)                    \
    X(ExitInitializationMode) X(EnterEventMode) X(Terminate) X(Reset)                              \
    X(GetFloat32) X(GetFloat64) X(GetInt8) X(GetUInt8) X(GetInt16) X(GetUInt16) X(GetInt32)        \
    X(GetUInt32) X(GetInt64) X(GetUInt64) X(GetBoolean) X(GetString) X(GetBinary) X(GetClock)      \
    X(SetFloat32) X(SetFloat64) X(SetInt8) X(SetUInt8) X(SetInt16) X(SetUInt16) X(SetInt32)        \
    X(SetUInt32) X(SetInt64) X(SetUInt64) X(SetBoolean) X(SetString) X(SetBinary) X(SetClock)      \
    X(GetNumberOfVariableDependencies) X(GetVariableDependencies)                                  \
    X(GetFMUState) X(SetFMUState) X(FreeFMUState)                                                  \
    X(SerializedFMUStateSize) X(SerializeFMUState) X(DeserializeFMUState)                          \
    X(GetDirectionalDerivative) X(GetAdjointDerivative)                                            \
    X(EnterConfigurationMode) X(ExitConfigurationMode)                                             \
    X(GetIntervalDecimal) X(GetIntervalFraction) X(GetShiftDecimal) X(GetShiftFraction)            \
    X(SetIntervalDecimal) X(SetIntervalFraction) X(SetShiftDecimal) X(SetShiftFraction)            \
    X(EvaluateDiscreteStates) X(UpdateDiscreteStates)                                              \
    X(EnterContinuousTimeMode) X(CompletedIntegratorStep) X(SetTime) X(SetContinuousStates)        \
    X(GetContinuousStateDerivatives) X(GetEventIndicators) X(GetContinuousStates)                  \
    X(GetNominalsOfContinuousStates) X(GetNumberOfEventIndicators) X(GetNumberOfContinuousStates)  \
    X(EnterStepMode) X(GetOutputDerivatives) X(DoStep) X(ActivateModelPartition)

typedef struct {
#define MEMBER(name) fmi2##name##TYPE *name;
    FMI2_FUNCTIONS(MEMBER)
#undef MEMBER
} Functions2;

typedef struct {
#define MEMBER(name) fmi3##name##TYPE *name;
    FMI3_FUNCTIONS(MEMBER)
#undef MEMBER
} Functions3;

typedef struct {
    int version;
    void *handle;
    Functions2 f2;
    Functions3 f3;
} Library;

/* Load a library and all functions of a version of FMI.  Print missing functions to stderr. */
bool library_open(Library *library, const char *path, int version);
void library_close(Library *library);

/* --- instance.c: one interface to both versions ----------------------------------------------- */

enum { MESSAGE_LENGTH = 1024 };

typedef struct {
    const Library *library;
    const Job *job;
    void *component;
    fmi2CallbackFunctions callbacks;
    bool failed;
    char message[MESSAGE_LENGTH]; /* the last logged message */
} Instance;

/* The result of an update of the discrete states. */
typedef struct {
    bool again, terminate, next_event_defined;
    double next_event;
} Update;

/* All functions print a failure to the standard error stream and return false. */
bool instance_open(Instance *instance, const Library *library, const Job *job);
void instance_close(Instance *instance);
bool instance_initialize(Instance *instance);
bool instance_terminate(Instance *instance);
bool instance_set(Instance *instance, const Item *item);
bool instance_get(Instance *instance, const Item *item, double *value);
bool instance_step(Instance *instance, double time, double size, double *reached, bool *event);
bool instance_event_mode(Instance *instance);
bool instance_update(Instance *instance, Update *update);
bool instance_leave_event_mode(Instance *instance);
bool instance_set_time(Instance *instance, double time);
bool instance_set_states(Instance *instance, const double *x);
bool instance_get_states(Instance *instance, double *x);
bool instance_derivatives(Instance *instance, double *dx);
bool instance_indicators(Instance *instance, double *z);
bool instance_completed(Instance *instance, bool *event);
bool instance_save(Instance *instance, void **state);
bool instance_restore(Instance *instance, void *state);
bool instance_forget(Instance *instance, void **state);
/* Return the bytes of a state, to be freed by the caller; NULL after a failure. */
uint8_t *instance_serialize(Instance *instance, void *state, size_t *size);
bool instance_deserialize(Instance *instance, const uint8_t *bytes, size_t size, void **state);
/* Callbacks for messages of FMI 2.0 and 3.0; the environment is an Instance or NULL. */
void logger2(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status,
             fmi2String category, fmi2String message, ...);
void logger3(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category,
             fmi3String message);

/* --- motion.c --------------------------------------------------------------------------------- */

/* Recorded rows.  A row has a mark, the time and the value of each item. */
typedef struct {
    double *numbers;
    size_t width, count, room; /* in rows */
} Rows;

enum { AT_POINT = 'p', BEFORE_EVENT = 'b', AFTER_EVENT = 'a' };

bool rows_add(Rows *rows, Instance *instance, char mark, double time);
void rows_print(const Rows *rows);
void rows_free(Rows *rows);

/* The progress of an instance between communication points. */
typedef struct {
    Instance *instance;
    Rows *rows;
    size_t point;
    double time;
    double *x, *k, *z, *work; /* model exchange: states, slopes, indicators, trial states */
    bool next_event_defined;
    double next_event;
} Motion;

bool motion_open(Motion *motion, Instance *instance, Rows *rows);
void motion_close(Motion *motion);
bool motion_start(Motion *motion);
/* Advance to the communication point with an index. */
bool motion_continue(Motion *motion, size_t point);

/* --- calls.c ---------------------------------------------------------------------------------- */

/* Source of random choices: bytes until they are used up, or a generator if there are none. */
typedef struct {
    const uint8_t *bytes;
    size_t size, used;
    uint64_t seed;
} Source;

/* Call functions in arbitrary order with arbitrary arguments, valid and invalid. */
void arbitrary_calls(const Library *library, const Job *job, Source *source, size_t count);

#endif
