/* Changes of rows, gaps and rates along a tangent. */
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

static double value_change(const Tangent *t, const Rows *rows, int i) {
    double sum = 0.0;
    Arm part;
    for (int j = 0; j <= rows->system->d; j++) {
        sum -= relative_term(t, rows, i, j, &part) ? product(part.E, part.dphi).im : 0.0;
    }
    return sum;
}

PRBM double rate_change(const Tangent *t, const Rows *rows, int i) {
    double sum = 0.0;
    Arm part;
    for (int j = 0; j <= rows->system->d; j++) {
        sum -= relative_term(t, rows, i, j, &part) ? swing_change(&part).im : 0.0;
    }
    return sum;
}

PRBM double second_change(const Tangent *t, const Rows *rows, int i) {
    double sum = 0.0;
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
}

static double lift_change(const Tangent *t, int i) {
    const System *system = t->eq->system;
    Rows lifts = plain_rows(system, system->f, system->lifts, system->lifts_c);
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
