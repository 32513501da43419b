/* Functions of FMI 3.0 that this FMU does not support. */
#if !defined(PRBM_FMI) || PRBM_FMI == 3

#include "fmi/fmi3.h"

static const char NO_DEPENDENCIES[] =
    "dependencies are those of modelDescription.xml (providesPerElementDependencies = false)";

EXPORTED fmi3Status FMI3(GetNumberOfVariableDependencies)(fmi3Instance instance,
                                                          fmi3ValueReference valueReference,
                                                          size_t *nDependencies) {
    (void)valueReference, (void)nDependencies;
    return absent3(instance, RULE3_GetNumberOfVariableDependencies, NO_DEPENDENCIES);
}

EXPORTED fmi3Status FMI3(GetVariableDependencies)(
    fmi3Instance instance, fmi3ValueReference dependent, size_t elementIndicesOfDependent[],
    fmi3ValueReference independents[], size_t elementIndicesOfIndependents[],
    fmi3DependencyKind dependencyKinds[], size_t nDependencies) {
    (void)dependent, (void)elementIndicesOfDependent, (void)independents;
    (void)elementIndicesOfIndependents, (void)dependencyKinds, (void)nDependencies;
    return absent3(instance, RULE3_GetVariableDependencies, NO_DEPENDENCIES);
}

EXPORTED fmi3Status FMI3(GetAdjointDerivative)(fmi3Instance instance,
                                               const fmi3ValueReference unknowns[],
                                               size_t nUnknowns, const fmi3ValueReference knowns[],
                                               size_t nKnowns, const fmi3Float64 seed[],
                                               size_t nSeed, fmi3Float64 sensitivity[],
                                               size_t nSensitivity) {
    (void)unknowns, (void)nUnknowns, (void)knowns, (void)nKnowns;
    (void)seed, (void)nSeed, (void)sensitivity, (void)nSensitivity;
    return absent3(instance, RULE3_GetAdjointDerivative,
                   "there are no adjoint derivatives (providesAdjointDerivatives = false); "
                   "use fmi3GetDirectionalDerivative");
}

/* --- clocks ----------------------------------------------------------------------------------- */

static const char NO_INTERVALS[] =
    "clocks have no interval and no shift: they are triggered by impacts";

EXPORTED fmi3Status FMI3(GetIntervalDecimal)(fmi3Instance instance,
                                             const fmi3ValueReference valueReferences[],
                                             size_t nValueReferences, fmi3Float64 intervals[],
                                             fmi3IntervalQualifier qualifiers[]) {
    (void)valueReferences, (void)nValueReferences, (void)intervals, (void)qualifiers;
    return absent3(instance, RULE3_GetIntervalDecimal, NO_INTERVALS);
}

EXPORTED fmi3Status FMI3(GetIntervalFraction)(fmi3Instance instance,
                                              const fmi3ValueReference valueReferences[],
                                              size_t nValueReferences, fmi3UInt64 counters[],
                                              fmi3UInt64 resolutions[],
                                              fmi3IntervalQualifier qualifiers[]) {
    (void)valueReferences, (void)nValueReferences, (void)counters;
    (void)resolutions, (void)qualifiers;
    return absent3(instance, RULE3_GetIntervalFraction, NO_INTERVALS);
}

EXPORTED fmi3Status FMI3(GetShiftDecimal)(fmi3Instance instance,
                                          const fmi3ValueReference valueReferences[],
                                          size_t nValueReferences, fmi3Float64 shifts[]) {
    (void)valueReferences, (void)nValueReferences, (void)shifts;
    return absent3(instance, RULE3_GetShiftDecimal, NO_INTERVALS);
}

EXPORTED fmi3Status FMI3(GetShiftFraction)(fmi3Instance instance,
                                           const fmi3ValueReference valueReferences[],
                                           size_t nValueReferences, fmi3UInt64 counters[],
                                           fmi3UInt64 resolutions[]) {
    (void)valueReferences, (void)nValueReferences, (void)counters, (void)resolutions;
    return absent3(instance, RULE3_GetShiftFraction, NO_INTERVALS);
}

EXPORTED fmi3Status FMI3(SetIntervalDecimal)(fmi3Instance instance,
                                             const fmi3ValueReference valueReferences[],
                                             size_t nValueReferences,
                                             const fmi3Float64 intervals[]) {
    (void)valueReferences, (void)nValueReferences, (void)intervals;
    return absent3(instance, RULE3_SetIntervalDecimal, NO_INTERVALS);
}

EXPORTED fmi3Status FMI3(SetIntervalFraction)(fmi3Instance instance,
                                              const fmi3ValueReference valueReferences[],
                                              size_t nValueReferences, const fmi3UInt64 counters[],
                                              const fmi3UInt64 resolutions[]) {
    (void)valueReferences, (void)nValueReferences, (void)counters, (void)resolutions;
    return absent3(instance, RULE3_SetIntervalFraction, NO_INTERVALS);
}

EXPORTED fmi3Status FMI3(SetShiftDecimal)(fmi3Instance instance,
                                          const fmi3ValueReference valueReferences[],
                                          size_t nValueReferences, const fmi3Float64 shifts[]) {
    (void)valueReferences, (void)nValueReferences, (void)shifts;
    return absent3(instance, RULE3_SetShiftDecimal, NO_INTERVALS);
}

EXPORTED fmi3Status FMI3(SetShiftFraction)(fmi3Instance instance,
                                           const fmi3ValueReference valueReferences[],
                                           size_t nValueReferences, const fmi3UInt64 counters[],
                                           const fmi3UInt64 resolutions[]) {
    (void)valueReferences, (void)nValueReferences, (void)counters, (void)resolutions;
    return absent3(instance, RULE3_SetShiftFraction, NO_INTERVALS);
}

EXPORTED fmi3Status FMI3(ActivateModelPartition)(fmi3Instance instance,
                                                 fmi3ValueReference clockReference,
                                                 fmi3Float64 activationTime) {
    (void)clockReference, (void)activationTime;
    return absent3(instance, RULE3_ActivateModelPartition, "there is no scheduled execution");
}

#endif
