/* Gaps of the stops, their rates and their accelerations: as in mechanics/dynamics.py. */
#include "core/gaps.h"

PRBM double recoil_of(const Equations *eq, int i, const double *extra, CompliantState which) {
    if (extra == NULL) {
        return 0.0;
    }
    const Stop *stop = &eq->system->mechanism->stops[i];
    return stop->compliant ? extra[stop->extra + (int)which] : 0.0;
}

PRBM double gap(const Equations *equations, int i, double t, const Complex *e,
                const double *extra) {
    Rows rows = gap_rows(equations->system);
    return row_value(&rows, i, e) + rows.c[i] + wall_motion(&equations->inputs.walls[i], t).x +
           recoil_of(equations, i, extra, EXTRA_RECOIL);
}

PRBM double gap_rate(const Equations *equations, int i, double t, const Complex *e,
                     const double *v, const double *extra) {
    Rows rows = gap_rows(equations->system);
    return row_rate(&rows, i, e, v) + wall_motion(&equations->inputs.walls[i], t).v +
           recoil_of(equations, i, extra, EXTRA_RECOIL_RATE);
}

PRBM double gap_acceleration(const Equations *equations, int i, double t, const Complex *e,
                             const double *v, const Evaluation *found) {
    const Equations *eq = equations;
    Rows rows = gap_rows(eq->system);
    double result = row_rate(&rows, i, e, found->a) - row_convective(&rows, i, e, v) +
                    wall_motion(&eq->inputs.walls[i], t).a;
    bool pressed = is_pressed(&eq->contacts.touching[i]);
    return pressed ? result + eq->inputs.mobilities[i] * found->pressure[i] : result;
}
