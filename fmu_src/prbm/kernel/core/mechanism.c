/* Values of expressions and parameters, and the list of variables. */
#include "core/mechanism.h"

PRBM bool has_dimension(const FlexureType *kind, int dimension) {
    return (kind->given >> dimension & 1u) != 0u;
}

PRBM int indicator_count(const Mechanism *mechanism) {
    int guides = mechanism->rubbing_count - mechanism->friction_count;
    return STOP_INDICATORS * mechanism->stop_count + mechanism->rubbing_count + guides +
           mechanism->one_sided_count;
}

PRBM bool is_hinge(const FlexureType *kind) {
    return kind->profile == PROFILE_NOTCH && !has_dimension(kind, DIMENSION_WAIST_LENGTH);
}

PRBM const FlexureType *kind_of(const Mechanism *mechanism, const Flexure *flexure) {
    return &mechanism->types[flexure->type];
}

PRBM bool has_stress(const Mechanism *mechanism, int i) {
    return kind_of(mechanism, &mechanism->flexures[i])->stress;
}

PRBM int panel_count(const FlexureType *kind) {
    if (kind->profile != PROFILE_NOTCH) {
        return 1;
    }
    return is_hinge(kind) ? 3 : PANELS_MAX;
}

PRBM int node_count(const FlexureType *kind) {
    if (kind->profile != PROFILE_NOTCH) {
        return kind->nodes;
    }
    return kind->nodes + 2 * THICK_NODES + (is_hinge(kind) ? 0 : 2 * FILLET_NODES);
}

PRBM int phased_coils(const Mechanism *mechanism) {
    return mechanism->one_sided_count > 0 ? mechanism->coil_count : 0;
}

PRBM double evaluate(Expression quantity, const double *values) {
    double result = 0.0;
    for (int i = 0; i < quantity.count; i++) {
        result += quantity.factor[i] * values[quantity.parameter[i]];
    }
    return quantity.constant + result;
}

static bool within(const char *name, const char *unit, double minimum, double maximum, double x,
                   Problem *problem) {
    const char *space = unit[0] ? " " : "";
    if (!finite_number(x)) {
        return fail(problem, "%s = %g%s%s must be a finite number", name, x, space, unit);
    }
    if (x < minimum) {
        return fail(problem, "%s = %.10g%s%s must be at least %g%s%s", name, x, space, unit,
                    minimum, space, unit);
    }
    if (x > maximum) {
        return fail(problem, "%s = %.10g%s%s must be at most %g%s%s", name, x, space, unit,
                    maximum, space, unit);
    }
    return true;
}

PRBM bool check_parameter(const Parameter *parameter, double x, Problem *problem) {
    return within(parameter->name, parameter->unit, parameter->minimum, parameter->maximum, x,
                  problem);
}

PRBM bool check_values(const Mechanism *mechanism, const double *values, Problem *problem) {
    for (int i = 0; i < mechanism->parameter_count; i++) {
        if (!check_parameter(&mechanism->parameters[i], values[i], problem)) {
            return false;
        }
    }
    for (int i = 0; i < mechanism->bound_count; i++) {
        const Bound *b = &mechanism->bounds[i];
        double x = evaluate(b->expression, values);
        if (!within(b->name, b->unit, b->minimum, b->maximum, x, problem)) {
            return false;
        }
    }
    return true;
}

PRBM const Variable *find_variable(const Mechanism *mechanism, uint32_t reference) {
    int low = 0, high = mechanism->variable_count;
    while (low < high) {
        int middle = low + (high - low) / 2;
        if (mechanism->variables[middle].reference < reference) {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    bool found = low < mechanism->variable_count &&
                 mechanism->variables[low].reference == reference;
    return found ? &mechanism->variables[low] : NULL;
}

/* Return the displacement and velocity of a wall in the inputs (input_count,). */
PRBM const double *wall_inputs(const Mechanism *mechanism, const double *inputs, int stop) {
    return inputs + mechanism->input.walls + PER_WALL * stop;
}
