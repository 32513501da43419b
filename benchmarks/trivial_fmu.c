/* An FMU without physics, with the interface of FMI 2.0 co-simulation, to measure the overhead of
 * an importer.
 *
 * All variables may be set and read; a step only stores its end time.  The values are in a table of
 * 1024 entries, indexed by the lowest bits of the value reference.  Arguments are not checked.
 */
#include <stdlib.h>

#include "fmi2FunctionTypes.h"
#include "fmi2TypesPlatform.h"

enum { ENTRIES = 1024 };

typedef struct {
    double time, values[ENTRIES];
} Instance;

static double *entry(fmi2Component c, fmi2ValueReference reference) {
    Instance *instance = c;
    return instance->values + reference % ENTRIES;
}

const char *fmi2GetTypesPlatform(void) {
    return "default";
}

const char *fmi2GetVersion(void) {
    return "2.0";
}

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String token, fmi2String location,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible,
                              fmi2Boolean logging) {
    (void)name, (void)type, (void)token, (void)location, (void)functions, (void)visible;
    (void)logging;
    return calloc(1, sizeof(Instance));
}

void fmi2FreeInstance(fmi2Component c) {
    free(c);
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean tolerant, fmi2Real tolerance,
                               fmi2Real start, fmi2Boolean stops, fmi2Real stop) {
    Instance *instance = c;
    (void)tolerant, (void)tolerance, (void)stops, (void)stop;
    instance->time = start;
    return fmi2OK;
}

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference references[], size_t count,
                       fmi2Real values[]) {
    for (size_t i = 0; i < count; i++) {
        values[i] = *entry(c, references[i]);
    }
    return fmi2OK;
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference references[], size_t count,
                       const fmi2Real values[]) {
    for (size_t i = 0; i < count; i++) {
        *entry(c, references[i]) = values[i];
    }
    return fmi2OK;
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real size, fmi2Boolean no_return) {
    Instance *instance = c;
    (void)no_return;
    instance->time = time + size;
    return fmi2OK;
}

/* Functions without effect that an importer calls, and functions that it only looks up. */

#define IDLE(name)                                                                                 \
    fmi2Status name(fmi2Component c) {                                                             \
        (void)c;                                                                                   \
        return fmi2OK;                                                                             \
    }
#define ABSENT(name)                                                                               \
    fmi2Status name(void) {                                                                        \
        return fmi2Error;                                                                          \
    }

IDLE(fmi2EnterInitializationMode)
IDLE(fmi2ExitInitializationMode)
IDLE(fmi2Terminate)
IDLE(fmi2Reset)
ABSENT(fmi2SetDebugLogging)
ABSENT(fmi2GetInteger)
ABSENT(fmi2GetBoolean)
ABSENT(fmi2GetString)
ABSENT(fmi2SetInteger)
ABSENT(fmi2SetBoolean)
ABSENT(fmi2SetString)
ABSENT(fmi2GetFMUstate)
ABSENT(fmi2SetFMUstate)
ABSENT(fmi2FreeFMUstate)
ABSENT(fmi2SerializedFMUstateSize)
ABSENT(fmi2SerializeFMUstate)
ABSENT(fmi2DeSerializeFMUstate)
ABSENT(fmi2GetDirectionalDerivative)
ABSENT(fmi2SetRealInputDerivatives)
ABSENT(fmi2GetRealOutputDerivatives)
ABSENT(fmi2CancelStep)
ABSENT(fmi2GetStatus)
ABSENT(fmi2GetRealStatus)
ABSENT(fmi2GetIntegerStatus)
ABSENT(fmi2GetBooleanStatus)
ABSENT(fmi2GetStringStatus)
