/* Values of FMI 3.0 and their derivatives. */
#if !defined(PRBM_FMI) || PRBM_FMI == 3

#include "fmi/fmi3.h"

/* Return the instance if a get or set is allowed, both of its arrays are valid and have the same
 * length (all variables are scalar); else NULL. */
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

EXPORTED fmi3Status FMI3(GetFloat64)(fmi3Instance instance,
                                     const fmi3ValueReference valueReferences[],
                                     size_t nValueReferences, fmi3Float64 values[],
                                     size_t nValues) {
    Instance *it = accessed3(instance, RULE3_GetFloat64, valueReferences, nValueReferences, values,
                             nValues);
    fmi3Status status = it ? fmi3OK : fmi3Error;
    for (size_t i = 0; i < nValues && status == fmi3OK; i++) {
        status = (fmi3Status)read_value(it, valueReferences[i], REAL, &values[i]);
    }
    return status;
}

EXPORTED fmi3Status FMI3(GetInt32)(fmi3Instance instance,
                                   const fmi3ValueReference valueReferences[],
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

EXPORTED fmi3Status FMI3(GetBoolean)(fmi3Instance instance,
                                     const fmi3ValueReference valueReferences[],
                                     size_t nValueReferences, fmi3Boolean values[],
                                     size_t nValues) {
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

EXPORTED fmi3Status FMI3(GetClock)(fmi3Instance instance,
                                   const fmi3ValueReference valueReferences[],
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

EXPORTED fmi3Status FMI3(SetFloat64)(fmi3Instance instance,
                                     const fmi3ValueReference valueReferences[],
                                     size_t nValueReferences, const fmi3Float64 values[],
                                     size_t nValues) {
    Instance *it = accessed3(instance, RULE3_SetFloat64, valueReferences, nValueReferences, values,
                             nValues);
    fmi3Status status = it ? fmi3OK : fmi3Error;
    for (size_t i = 0; i < nValues && it; i++) {
        status = worse3(status, write_value(it, valueReferences[i], REAL, values[i]));
    }
    return status;
}

/* Reject a set of another type than Float64, which all parameters and inputs have. */
static fmi3Status set_other3(Instance *instance, const fmi3ValueReference references[], size_t n,
                             int type) {
    fmi3Status status = instance ? fmi3OK : fmi3Error;
    for (size_t i = 0; i < n && instance; i++) {
        status = worse3(status, write_value(instance, references[i], type, 0.0));
    }
    return status;
}

/* Reject a get of a type that no variable has. */
static fmi3Status get_other3(Instance *instance, const fmi3ValueReference references[], size_t n) {
    fmi3Status status = instance ? fmi3OK : fmi3Error;
    for (size_t i = 0; i < n && instance; i++) {
        double x;
        status = worse3(status, read_value(instance, references[i], NO_TYPE, &x));
    }
    return status;
}

EXPORTED fmi3Status FMI3(SetInt32)(fmi3Instance instance,
                                   const fmi3ValueReference valueReferences[],
                                   size_t nValueReferences, const fmi3Int32 values[],
                                   size_t nValues) {
    Instance *it = accessed3(instance, RULE3_SetInt32, valueReferences, nValueReferences, values,
                             nValues);
    return set_other3(it, valueReferences, nValueReferences, INTEGER);
}

EXPORTED fmi3Status FMI3(SetBoolean)(fmi3Instance instance,
                                     const fmi3ValueReference valueReferences[],
                                     size_t nValueReferences, const fmi3Boolean values[],
                                     size_t nValues) {
    Instance *it = accessed3(instance, RULE3_SetBoolean, valueReferences, nValueReferences, values,
                             nValues);
    return set_other3(it, valueReferences, nValueReferences, BOOLEAN);
}

EXPORTED fmi3Status FMI3(SetClock)(fmi3Instance instance,
                                   const fmi3ValueReference valueReferences[],
                                   size_t nValueReferences, const fmi3Clock values[]) {
    Instance *it = called_for_event3(instance, RULE3_SetClock);
    if (!it || !given(it, &FMI3[RULE3_SetClock], nValueReferences, valueReferences) ||
        !given(it, &FMI3[RULE3_SetClock], nValueReferences, values)) {
        return fmi3Error;
    }
    return set_other3(it, valueReferences, nValueReferences, CLOCK);
}

#define FMI3_OTHER_TYPE(type)                                                                  \
    EXPORTED fmi3Status FMI3(Get##type)(fmi3Instance instance,                                 \
                                        const fmi3ValueReference valueReferences[],            \
                                        size_t nValueReferences, fmi3##type values[],          \
                                        size_t nValues) {                                      \
        Instance *it = accessed3(instance, RULE3_Get##type, valueReferences, nValueReferences, \
                                 values, nValues);                                             \
        return get_other3(it, valueReferences, nValueReferences);                              \
    }                                                                                          \
                                                                                               \
    EXPORTED fmi3Status FMI3(Set##type)(fmi3Instance instance,                                 \
                                        const fmi3ValueReference valueReferences[],            \
                                        size_t nValueReferences, const fmi3##type values[],    \
                                        size_t nValues) {                                      \
        Instance *it = accessed3(instance, RULE3_Set##type, valueReferences, nValueReferences, \
                                 values, nValues);                                             \
        return set_other3(it, valueReferences, nValueReferences, NO_TYPE);                     \
    }

FMI3_OTHER_TYPES(FMI3_OTHER_TYPE)

EXPORTED fmi3Status FMI3(GetString)(fmi3Instance instance,
                                    const fmi3ValueReference valueReferences[],
                                    size_t nValueReferences, fmi3String values[], size_t nValues) {
    Instance *it = accessed3(instance, RULE3_GetString, valueReferences, nValueReferences, values,
                             nValues);
    return get_other3(it, valueReferences, nValueReferences);
}

EXPORTED fmi3Status FMI3(SetString)(fmi3Instance instance,
                                    const fmi3ValueReference valueReferences[],
                                    size_t nValueReferences, const fmi3String values[],
                                    size_t nValues) {
    Instance *it = accessed3(instance, RULE3_SetString, valueReferences, nValueReferences, values,
                             nValues);
    return set_other3(it, valueReferences, nValueReferences, NO_TYPE);
}

EXPORTED fmi3Status FMI3(GetBinary)(fmi3Instance instance,
                                    const fmi3ValueReference valueReferences[],
                                    size_t nValueReferences, size_t valueSizes[],
                                    fmi3Binary values[], size_t nValues) {
    Instance *it = accessed3(instance, RULE3_GetBinary, valueReferences, nValueReferences, values,
                             nValues);
    (void)valueSizes;
    return get_other3(it, valueReferences, nValueReferences);
}

EXPORTED fmi3Status FMI3(SetBinary)(fmi3Instance instance,
                                    const fmi3ValueReference valueReferences[],
                                    size_t nValueReferences, const size_t valueSizes[],
                                    const fmi3Binary values[], size_t nValues) {
    Instance *it = accessed3(instance, RULE3_SetBinary, valueReferences, nValueReferences, values,
                             nValues);
    (void)valueSizes;
    return set_other3(it, valueReferences, nValueReferences, NO_TYPE);
}

EXPORTED fmi3Status FMI3(GetDirectionalDerivative)(
    fmi3Instance instance, const fmi3ValueReference unknowns[], size_t nUnknowns,
    const fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[], size_t nSeed,
    fmi3Float64 sensitivity[], size_t nSensitivity) {
    const int rule = RULE3_GetDirectionalDerivative;
    Instance *it = accessed3(instance, rule, unknowns, nUnknowns, sensitivity, nSensitivity);
    if (!it || !accessed3(instance, rule, knowns, nKnowns, seed, nSeed)) {
        return fmi3Error;
    }
    return (fmi3Status)directional_derivative(it, unknowns, nUnknowns, knowns, nKnowns, seed,
                                              sensitivity);
}

#endif
