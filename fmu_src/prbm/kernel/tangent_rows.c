/* Changes of rows, gaps and rates along a tangent. */
#include "core/friction.h"
#include "tangent_rows.h"

PRBM Complex times_i(Complex z) {
    return complex_of(-z.im, z.re);
}

PRBM Arm arm_at(const Tangent *t, int j) {
    Complex none = {0.0, 0.0}, one = {1.0, 0.0};
    Arm fixed = {one, none, none, none, none};
    if (j == FIXED) {
        return fixed;
    }
    Arm arm = {t->e[j], t->w[j], t->alpha[j], t->dphi[j], t->dw[j]};
    return arm;
}

/* Compute term j of row i: f B_j E_j for j < d, f z for j = d, with f = conj(E) of the body that
 * carries the wall, or f = 1 on the ground.  Return false if the term is zero. */
static bool relative_term(const Tangent *t, const Rows *rows, int i, int j, Arm *seen) {
    int d = rows->system->d, on = seen_from(rows, i);
    Complex size = {0.0, 0.0};
    if (j < d && is_float(rows->system, j)) {
        return false; /* See float_changes. */
    }
    if (j < d) {
        size = rows->B[i * d + j];
    } else if (on != FIXED) {
        size = rows->z[i];
    }
    Arm arm = arm_at(t, j < d ? j : FIXED), body = arm_at(t, on);
    seen->E = product(product(conjugate(body.E), arm.E), size);
    seen->w = minus(arm.w, body.w);
    seen->alpha = minus(arm.alpha, body.alpha);
    seen->dphi = minus(arm.dphi, body.dphi);
    seen->dw = minus(arm.dw, body.dw);
    return size.re != 0.0 || size.im != 0.0;
}

PRBM Complex swing_change(const Arm *arm) {
    return product(arm->E, plus(times_i(product(arm->dphi, arm->w)), arm->dw));
}

PRBM Complex bend_of(const Arm *arm) {
    return minus(times_i(arm->alpha), product(arm->w, arm->w));
}

PRBM Complex bend_change(const Arm *arm) {
    Complex turned = times_i(product(arm->dphi, bend_of(arm)));
    return product(arm->E, minus(turned, scaled(2.0, product(arm->w, arm->dw))));
}

/* Changes of f B E for an arm that floats, of f B, and of the time derivatives of f B E, the second
 * one at constant accelerations. */
typedef struct {
    Complex value, lever, rate, second;
} FloatChanges;

static FloatChanges float_changes(const Tangent *t, const Rows *rows, int i, int j) {
    const Arm body = arm_at(t, seen_from(rows, i));
    const double turn = body.w.re, dphi = body.dphi.re, dturn = body.dw.re;
    const Complex f = product(conjugate(body.E), rows->B[i * rows->system->d + j]);
    const Complex E = t->e[j], speed = times_i(t->swing[j]), dspeed = times_i(t->dswing[j]);
    const Complex bent = complex_of(turn * turn, body.alpha.re);
    Complex rate = minus(speed, scaled(turn, times_i(E)));
    Complex second = minus(minus(t->bend[j], scaled(2.0 * turn, times_i(speed))), product(bent, E));
    Complex drate = minus(minus(dspeed, scaled(turn, times_i(t->dE[j]))), scaled(dturn, times_i(E)));
    Complex dsecond = scaled(-2.0, times_i(plus(scaled(dturn, speed), scaled(turn, dspeed))));
    dsecond = minus(dsecond, plus(product(bent, t->dE[j]), scaled(2.0 * turn * dturn, E)));
    FloatChanges result = {
        product(f, minus(t->dE[j], scaled(dphi, times_i(E)))),
        scaled(-dphi, times_i(f)),
        product(f, minus(drate, scaled(dphi, times_i(rate)))),
        product(f, minus(dsecond, scaled(dphi, times_i(second)))),
    };
    return result;
}

/* Return the changes of the arms that float, summed over a row; the term of lever is not. */
static FloatChanges all_floats(const Tangent *t, const Rows *rows, int i) {
    const Complex none = {0.0, 0.0};
    FloatChanges sum = {none, none, none, none};
    for (int k = 0; k < rows->system->shift_count; k += SHIFTS_EACH) {
        int arm = arm_of(rows->system, rows->system->shifts[k]);
        FloatChanges each = float_changes(t, rows, i, arm);
        sum.value = plus(sum.value, each.value);
        sum.rate = plus(sum.rate, each.rate);
        sum.second = plus(sum.second, each.second);
    }
    return sum;
}

static double value_change(const Tangent *t, const Rows *rows, int i) {
    double sum = all_floats(t, rows, i).value.re;
    Arm part;
    for (int j = 0; j <= rows->system->d; j++) {
        sum -= relative_term(t, rows, i, j, &part) ? product(part.E, part.dphi).im : 0.0;
    }
    return sum;
}

PRBM double rate_change(const Tangent *t, const Rows *rows, int i) {
    double sum = all_floats(t, rows, i).rate.re;
    Arm part;
    for (int j = 0; j <= rows->system->d; j++) {
        sum -= relative_term(t, rows, i, j, &part) ? swing_change(&part).im : 0.0;
    }
    return sum;
}

PRBM double second_change(const Tangent *t, const Rows *rows, int i) {
    double sum = all_floats(t, rows, i).second.re;
    Arm part;
    for (int j = 0; j <= rows->system->d; j++) {
        sum += relative_term(t, rows, i, j, &part) ? bend_change(&part).re : 0.0;
    }
    return sum;
}

PRBM void add_pull(const Tangent *t, const Rows *rows, int i, double force) {
    int d = rows->system->d, on = seen_from(rows, i);
    Arm part;
    for (int j = 0; j <= d; j++) {
        if (relative_term(t, rows, i, j, &part)) {
            Complex change = scaled(force, product(part.E, part.dphi));
            if (j < d) {
                t->pull[j] = minus(t->pull[j], change);
            }
            if (on != FIXED) {
                t->pull[on] = plus(t->pull[on], change);
            }
        }
    }
    for (int k = 0; k < rows->system->shift_count; k += SHIFTS_EACH) {
        int arm = arm_of(rows->system, rows->system->shifts[k]);
        FloatChanges each = float_changes(t, rows, i, arm);
        t->pull[arm] = plus(t->pull[arm], scaled(force, times_i(each.lever)));
        if (on != FIXED) {
            t->pull[on] = minus(t->pull[on], scaled(force, times_i(each.value)));
        }
    }
}

static double lift_change(const Tangent *t, int i) {
    const System *system = t->eq->system;
    int points = system->mechanism->friction_count;
    Rows lifts = plain_rows(system, points, system->lifts, system->lifts_c);
    return value_change(t, &lifts, i);
}

PRBM double limit_change(const Tangent *t, int contact) {
    if (is_stop(t->eq->system, contact)) {
        bool presses = t->evaluation->pressure[contact] > 0.0;
        return presses ? t->eq->stop_friction[contact] * t->dpressure[contact] : 0.0;
    }
    int i = contact - t->eq->system->s;
    const double *law = t->eq->rub_law + 3 * i;
    return rub_limit(t->eq, i, t->e) > 0.0 ? law[0] * law[2] * lift_change(t, i) : 0.0;
}

PRBM double slip_force_change(const Tangent *t, int contact) {
    const Equations *eq = t->eq;
    double limit = is_guide(eq->system, contact) ? side_force(eq, t->dlam, contact)
                   : held_stop(eq, contact)      ? stop_force(eq, t->dlam, contact)
                                                 : limit_change(t, contact);
    bool carried = is_guide(eq->system, contact) || held_stop(eq, contact);
    double mu = carried ? friction_coefficient(eq, contact) : 1.0;
    return -sliding_sign(t, contact) * mu * limit;
}

PRBM int sliding_sign(const Tangent *t, int contact) {
    return slip_sign(t->eq->contacts.modes[contact]);
}

PRBM double gap_change(const Tangent *t, int i) {
    const System *system = t->eq->system;
    Rows gaps = gap_rows(system);
    return value_change(t, &gaps, i) + wall_inputs(system->mechanism, t->du, i)[0];
}

PRBM double gap_rate_change(const Tangent *t, int i) {
    const System *system = t->eq->system;
    Rows gaps = gap_rows(system);
    return rate_change(t, &gaps, i) + wall_inputs(system->mechanism, t->du, i)[1];
}
