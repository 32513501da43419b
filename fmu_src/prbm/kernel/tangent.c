/* Directional derivatives: exact changes of all values along changes of states and inputs. */
#include <string.h>

#include "core/friction.h"
#include "hybrid/access.h"
#include "hybrid/present.h"
#include "dependents.h"
#include "tangent_contact.h"
#include "tangent_elements.h"
#include "tangent_indicators.h"
#include "tangent_rows.h"
#include "tangent_stress.h"
#include "values.h"

/* --- changes of coordinates --- */

/* Set p of the arms that float for rates v, see swings. */
static void float_swings(const System *system, const double *v, Complex *p) {
    float_velocities(system, v, p);
    for (int k = 0; k < system->shift_count; k += SHIFTS_EACH) {
        Complex *each = &p[arm_of(system, system->shifts[k])];
        *each = complex_of(each->im, -each->re);
    }
}

/* Set the changes of the arms that float, whose accelerations do not depend on place and rates. */
static void move_floats(const Tangent *t) {
    const System *system = t->eq->system;
    float_velocities(system, t->dq, t->dE);
    float_velocities(system, t->a, t->bend);
    float_swings(system, t->v, t->swing);
    float_swings(system, t->dv, t->dswing);
}

/* Compute the changes of the arms from dq and dv. */
static void move_arms(const Tangent *t) {
    const System *system = t->eq->system;
    turning(system, t->dq, t->dphi);
    turning(system, t->dv, t->dw);
    for (int j = 0; j < system->d; j++) {
        Arm arm = arm_at(t, j);
        t->dE[j] = times_i(product(arm.E, arm.dphi));
        t->swing[j] = product(arm.E, arm.w);
        t->dswing[j] = swing_change(&arm);
        t->bend[j] = product(arm.E, bend_of(&arm));
        t->dbend[j] = bend_change(&arm);
    }
    move_floats(t);
}

/* Compute the changes of the dependent coordinates from the loops, with the right side s. */
static void solve_dependents(const Tangent *t, const Loops *loops, double *changes) {
    int r = t->eq->system->r;
    lu_solve(r, loops->a, loops->pivot, loops->s);
    for (int k = 0; k < r; k++) {
        changes[loops->dependent[k]] = loops->s[k];
    }
}

/* Compute dq and dv from the changes of the independent coordinates, with closed loops. */
static bool tangent_coordinates(Tangent *t, const double *dx, Problem *problem) {
    Simulation *sim = t->sim;
    const System *system = system_of(sim);
    const Mechanism *m = system->mechanism;
    int n = system->n, r = system->r, count = m->independent_count;
    Scratch scratch = t->scratch;
    Loops x = take_loops(sim, &scratch);
    Rows loops = loop_rows(system);
    jacobian(&loops, t->e, x.rows);
    if (!factor_dependents(sim, &x)) {
        return singular_choice(sim, x.dependent, problem);
    }
    zeros(n, t->dq);
    zeros(n, t->dv);
    for (int k = 0; k < count; k++) {
        double unit_of = coordinate_unit(system, m->independent[k]);
        t->dq[m->independent[k]] = dx[k] / unit_of;
        t->dv[m->independent[k]] = dx[count + k] / unit_of;
    }
    for (int i = 0; i < r; i++) {
        x.s[i] = -dot(n, x.rows + i * n, t->dq);
    }
    solve_dependents(t, &x, t->dq);
    move_arms(t);
    for (int i = 0; i < r; i++) {
        x.s[i] = -rate_change(t, &loops, i);
    }
    solve_dependents(t, &x, t->dv);
    move_arms(t);
    return true;
}

/* --- changes of loads --- */

/* Element i of the product H x, for x of the arms */
static Complex through_mass(const Tangent *t, int i, const Complex *x) {
    int d = t->eq->system->d;
    return along_arms(d, t->eq->system->H + i * d, x);
}

/* Compute the changes of the loads of the inputs on the arms: dw, and the moments dmoment. */
static void load_row_change(const Tangent *t, Complex *dw, double *dmoment) {
    const System *system = t->eq->system;
    const Mechanism *m = system->mechanism;
    const double *base = t->du + m->input.base;
    int d = system->d;
    Scratch scratch = t->scratch;
    Complex *one = take_complex(&scratch, d, 1);
    field_row(d, system->S, complex_of(-base[0], -base[1]), dw);
    zeros(d, dmoment);
    for (int i = 0; i < m->force_count; i++) {
        const BodyFrame *frame = &system->pushed[i];
        const double *given = t->du + LOADS * i;
        force_row(d, frame->A, complex_of(given[0], given[1]), one);
        for (int j = 0; j < d; j++) {
            dw[j] = plus(dw[j], one[j]);
        }
        dmoment[frame->arm] += given[2];
    }
}

/* Return the factor of the load on an arm in the pull on it: E, or 1 if it floats. */
static Complex lever(const Tangent *t, int j) {
    return is_float(t->eq->system, j) ? complex_of(1.0, 0.0) : t->e[j];
}

/* Change of the momentum E conj(H (E w)) of an arm. */
static Complex momentum_change(const Tangent *t, int j) {
    Complex momentum = product(lever(t, j), conjugate(through_mass(t, j, t->swing)));
    Complex turned = times_i(product(t->dphi[j], momentum));
    return plus(turned, product(lever(t, j), conjugate(through_mass(t, j, t->dswing))));
}

/* Change of the inertial load -i E conj(H E'') of an arm, without the change of w'. */
static Complex inertial_change(const Tangent *t, int j) {
    Complex load = product(lever(t, j), conjugate(through_mass(t, j, t->bend)));
    Complex turned = times_i(product(t->dphi[j], load));
    Complex change = plus(turned, product(lever(t, j), conjugate(through_mass(t, j, t->dbend))));
    return scaled(-1.0, times_i(change));
}

/* Compute the change of the loads on the arms: forces, moments, inertia, damping with the mass. */
static void arm_load_change(const Tangent *t, const Complex *dw, const double *dmoment) {
    const Equations *eq = t->eq;
    for (int j = 0; j < eq->system->d; j++) {
        if (arm_of(eq->system, j) == j) {
            Complex turned = product(eq->w[j], t->dE[j]), none = {0.0, 0.0};
            Complex load = plus(product(dw[j], lever(t, j)),
                                is_float(eq->system, j) ? none : turned);
            load.re += dmoment[j] - eq->mass_damping * eq->system->J[j] * t->dw[j].re;
            Complex lost = scaled(-eq->mass_damping, momentum_change(t, j));
            t->pull[j] = plus(plus(load, inertial_change(t, j)), lost);
        }
    }
}

static void rub_change(const Tangent *t) {
    const Equations *eq = t->eq;
    Scratch scratch = t->scratch;
    double *row = take(&scratch, (size_t)eq->system->n);
    for (int k = eq->slipping_rows; k < eq->slipping_count; k++) {
        int contact = eq->slipping[k], i;
        Rows rows = tangential_rows(eq->system, contact, &i);
        row_jacobian(&rows, i, t->e, row);
        add_scaled(eq->system->n, -sliding_sign(t, contact) * limit_change(t, contact), row, t->dx);
        add_pull(t, &rows, i, slip_force(eq, t->e, t->evaluation, contact));
    }
}

/* Add the changes of the loads of lam along the active rows.  Set dlam to minus the changes of the
 * second time derivatives of these rows at constant accelerations. */
static void row_change(const Tangent *t) {
    const Equations *eq = t->eq;
    for (int k = 0; k < eq->r; k++) {
        add_pull(t, &eq->active, k, t->lam[k]);
        t->dlam[k] = -second_change(t, &eq->active, k);
    }
    for (int k = 0; k < eq->slipping_rows; k++) {
        int i;
        Rows rows = tangential_rows(eq->system, eq->slipping[k], &i);
        add_pull(t, &rows, i, slip_force(eq, t->e, t->evaluation, eq->slipping[k]));
    }
}

/* Add the pull to the loads: its real part for an angle or a displacement along y, its imaginary part
 * for a stretch or a displacement along x. */
static void apply_pull(const Tangent *t) {
    const System *system = t->eq->system;
    for (int j = 0; j < system->d; j++) {
        int a = arm_of(system, j);
        bool along_y = is_shift(system, j) && t->e[j].re != 0.0;
        to_coordinates(system, j, a == j || along_y ? t->pull[a].re : t->pull[a].im, t->dx);
    }
}

/* --- changes of outputs --- */

static void point_changes(const Tangent *t, const BodyFrame *frame, Complex *moved,
                          Complex *speed) {
    int d = t->eq->system->d;
    *moved = along_arms(d, frame->A, t->dE);
    *speed = times_i(along_arms(d, frame->A, t->dswing));
}

static void body_changes(const Tangent *t, double *out) {
    for (int i = 0; i < t->eq->system->b; i++) {
        const BodyFrame *frame = &t->eq->system->bodies[i];
        double *d = out + PER_BODY * i;
        Complex moved, speed;
        point_changes(t, frame, &moved, &speed);
        d[BODY_X] = moved.re;
        d[BODY_Y] = moved.im;
        d[BODY_ANGLE] = t->dq[frame->j];
        d[BODY_VX] = speed.re;
        d[BODY_VY] = speed.im;
        d[BODY_OMEGA] = t->dv[frame->j];
    }
}

static void probe_changes(const Tangent *t, double *out) {
    for (int i = 0; i < t->sim->configuration.mechanism->probe_count; i++) {
        double *d = out + PER_PROBE * i;
        Complex moved, speed;
        point_changes(t, &t->eq->system->probes[i], &moved, &speed);
        d[PROBE_X] = moved.re;
        d[PROBE_Y] = moved.im;
        d[PROBE_VX] = speed.re;
        d[PROBE_VY] = speed.im;
    }
}

static void link_changes(const Tangent *t, double *links, double *stretches_out) {
    const Mechanism *m = t->sim->configuration.mechanism;
    for (int k = 0; k < m->link_count; k++) {
        links[PER_LINK * k + LINK_ANGLE] = t->dq[m->links[k]];
        links[PER_LINK * k + LINK_OMEGA] = t->dv[m->links[k]];
    }
    for (int k = 0; k < m->strain_count; k++) {
        stretches_out[PER_STRETCH * k + STRETCH_STRAIN] = t->dq[m->strains[k]];
        stretches_out[PER_STRETCH * k + STRETCH_STRAIN_RATE] = t->dv[m->strains[k]];
    }
}

static void stop_changes(const Tangent *t, double *out) {
    for (int i = 0; i < t->eq->system->s; i++) {
        const double *wall = wall_inputs(t->eq->system->mechanism, t->du, i);
        double *d = out + PER_STOP * i;
        d[STOP_GAP] = gap_change(t, i);
        d[STOP_GAP_RATE] = gap_rate_change(t, i);
        d[STOP_POINT_DISPLACEMENT] = wall[0] - d[STOP_GAP];
        d[STOP_POINT_VELOCITY] = wall[1] - d[STOP_GAP_RATE];
    }
    for (int k = 0; k < t->eq->held_count; k++) {
        double change = t->dlam[t->eq->first_hold + k];
        out[PER_STOP * t->eq->held[k] + STOP_FORCE] = change;
    }
}

/* Add the change of the accelerations to dbend. */
static void bend_arms(const Tangent *t) {
    Complex *dalpha = t->pull; /* The pull has been applied: reuse its memory. */
    turning(t->eq->system, t->dx, dalpha);
    for (int j = 0; j < t->eq->system->d; j++) {
        t->dbend[j] = plus(t->dbend[j], times_i(product(t->e[j], dalpha[j])));
    }
    float_velocities(t->eq->system, t->dx, t->dbend);
}

static void base_changes(const Tangent *t, double *out) {
    const System *system = t->eq->system;
    const Mechanism *m = system->mechanism;
    int d = system->d;
    const double *base = t->du + m->input.base, *given = t->eq->inputs.forces;
    Complex field = minus(system->gravity, t->eq->inputs.base), force = {0.0, 0.0};
    double moment = 0.0;
    for (int i = 0; i < system->p; i++) {
        const Complex *A = system->A + i * d;
        Complex z = plus(along_arms(d, A, t->e), minus(system->c[i], system->anchor));
        Complex dz = along_arms(d, A, t->dE), dbend = along_arms(d, A, t->dbend);
        Complex load = scaled(system->m[i], minus(field, along_arms(d, A, t->bend)));
        Complex change = scaled(-system->m[i], plus(complex_of(base[0], base[1]), dbend));
        force = plus(force, change);
        moment += product(conjugate(dz), load).im + product(conjugate(z), change).im;
    }
    for (int j = 0; j < d; j++) {
        moment -= system->J[j] * direction_of(system, t->dx, j);
    }
    for (int i = 0; i < m->force_count; i++) {
        const BodyFrame *frame = &system->pushed[i];
        const double *df = t->du + LOADS * i, *f = given + LOADS * i;
        Complex z = plus(along_arms(d, frame->A, t->e), minus(frame->c, system->anchor));
        Complex dz = along_arms(d, frame->A, t->dE);
        force = plus(force, complex_of(df[0], df[1]));
        moment += product(conjugate(dz), complex_of(f[0], f[1])).im +
                  product(conjugate(z), complex_of(df[0], df[1])).im + df[2];
    }
    out[BASE_FORCE_X] = force.re;
    out[BASE_FORCE_Y] = force.im;
    out[BASE_MOMENT] = moment;
}

/* Change of the kinetic energy, Re(d(E w)^H H (E w)), plus that of the rotary inertias J. */
static double kinetic_change(const Tangent *t) {
    double sum = 0.0;
    for (int i = 0; i < t->eq->system->d; i++) {
        sum += product(conjugate(t->dswing[i]), through_mass(t, i, t->swing)).re;
        sum += t->eq->system->J[i] * t->w[i].re * t->dw[i].re;
    }
    return sum;
}

static void energy_changes(const Tangent *t, const double *dx, double *out) {
    const System *system = t->eq->system;
    int count = system->mechanism->independent_count;
    out[ENERGY_KINETIC] = kinetic_change(t);
    Complex moved = along_arms(system->d, system->S, t->dE);
    out[ENERGY_GRAVITATIONAL] = -product(conjugate(system->gravity), moved).re;
    out[ENERGY_ELASTIC] = element_energy_change(t) + contact_energy_change(t);
    out[ENERGY_DISSIPATED] = dx[2 * count];
    out[ENERGY_WORK] = dx[2 * count + 1];
}

/* Return a copy of t whose coordinates have the constant rates x (n,). */
static Tangent at_rates(const Tangent *t, const double *x, Scratch *scratch) {
    int n = t->eq->system->n, d = t->eq->system->d;
    Tangent u = *t;
    Complex **arrays[] = {&u.w, &u.dw, &u.swing, &u.dswing};
    for (size_t i = 0; i < sizeof arrays / sizeof *arrays; i++) {
        *arrays[i] = take_complex(scratch, d, 1);
    }
    u.v = x;
    u.dv = take(scratch, (size_t)n);
    zeros(n, u.dv);
    turning(t->eq->system, x, u.w);
    turning(t->eq->system, u.dv, u.dw);
    for (int j = 0; j < d; j++) {
        Arm arm = arm_at(&u, j);
        u.swing[j] = product(arm.E, arm.w);
        u.dswing[j] = swing_change(&arm);
    }
    float_swings(t->eq->system, x, u.swing);
    float_swings(t->eq->system, u.dv, u.dswing);
    u.scratch = *scratch;
    return u;
}

/* Change 2 dG X - X^T dM X - 2 mu^T dR X of the mobility G X of a hit point.  G is the gradient of
 * the gap and R the Jacobian of the loops; X and mu solve M X + R^T mu = G^T and R X = 0. */
static bool mobility_change(const Tangent *t, int i, double *result, Problem *problem) {
    Simulation *sim = t->sim;
    const System *system = system_of(sim);
    Scratch scratch = t->scratch;
    int n = system->n, r = system->r, size = n + r;
    double *x = take(&scratch, (size_t)size);
    Rows gaps = gap_rows(system), loops = loop_rows(system);
    ContactProblem *at = contact_problem_at(sim, t->y, scratch);
    row_jacobian(&gaps, i, at->e, x);
    zeros(r, x + n);
    bool ok = factor_contacts(at, problem);
    if (ok) {
        solve_saddle(&at->factors, x);
        Tangent u = at_rates(t, x, &scratch);
        double change = rate_change(&u, &gaps, i) - kinetic_change(&u);
        for (int k = 0; k < r; k++) {
            change -= x[n + k] * rate_change(&u, &loops, k);
        }
        *result = 2.0 * change;
    }
    return ok;
}

static double dissipation_change(const Tangent *t) {
    const Equations *eq = t->eq;
    double sum = 2.0 * eq->mass_damping * kinetic_change(t) + element_loss_change(t);
    for (int k = 0; k < eq->slipping_count; k++) {
        int contact = eq->slipping[k], i;
        Rows rows = tangential_rows(eq->system, contact, &i);
        sum -= slip_force_change(t, contact) * row_rate(&rows, i, t->e, t->v) +
               slip_force(eq, t->e, t->evaluation, contact) * rate_change(t, &rows, i);
    }
    for (int k = 0; k < eq->pressed_count; k++) {
        sum += contact_loss_change(t, eq->pressed[k]);
    }
    return sum;
}

static double power_change(const Tangent *t, const Complex *dw, const double *dmoment) {
    const Equations *eq = t->eq;
    const System *system = eq->system;
    int d = system->d;
    double sum = along_arms(d, dw, t->swing).re + along_arms(d, eq->w_input, t->dswing).re;
    for (int j = 0; j < d; j++) {
        sum += dmoment[j] * t->w[j].re + eq->moment[j] * t->dw[j].re;
    }
    for (int k = 0; k < eq->held_count; k++) {
        int i = eq->held[k], h = eq->first_hold + k;
        double velocity = wall_inputs(system->mechanism, t->du, i)[1];
        double w = wall_motion(&eq->inputs.walls[i], t->at->time).v;
        sum -= t->dlam[h] * w + t->lam[h] * velocity;
    }
    for (int k = 0; k < eq->pressed_count; k++) {
        int i = eq->pressed[k];
        double velocity = wall_inputs(system->mechanism, t->du, i)[1];
        double w = wall_motion(&eq->inputs.walls[i], t->at->time).v;
        sum -= t->dpressure[i] * w + t->evaluation->pressure[i] * velocity;
    }
    return sum;
}

static void all_changes(const Tangent *t, const double *dx, const Complex *dw,
                        const double *dmoment, double *out) {
    const Mechanism *m = t->sim->configuration.mechanism;
    const Slots *slots = &m->slots;
    zeros(slots->count, out);
    copy(m->input_count, t->du, out + slots->inputs);
    body_changes(t, out + slots->bodies);
    probe_changes(t, out + slots->probes);
    link_changes(t, out + slots->links, out + slots->stretches);
    stop_changes(t, out + slots->stops);
    spring_changes(t, out + slots->springs);
    guide_loads(t->eq->system, t->dlam, out + slots->guides);
    base_changes(t, out + slots->base);
    energy_changes(t, dx, out + slots->energies);
    stress_changes(t, out + slots->stresses);
    for (int k = 0; k < m->independent_count; k++) {
        int j = m->independent[k];
        out[slots->derivatives + k] = t->dx[j] * coordinate_unit(t->eq->system, j);
    }
    double *powers = out + slots->derivatives + m->independent_count;
    powers[0] = dissipation_change(t);
    powers[1] = power_change(t, dw, dmoment);
    contact_changes(t, dx, out);
    indicator_changes(t, out + slots->indicators);
}

/* Allocate the arrays of changes, and store the present state. */
static Tangent begin_tangent(Simulation *sim, const Moment *now, const double *du) {
    const System *system = system_of(sim);
    const Evaluation *at = now->evaluation;
    int n = system->n, d = system->d;
    Tangent t = {0};
    Scratch *scratch = &t.scratch;
    Complex **arrays[] = {&t.w, &t.alpha, &t.dphi, &t.dw, &t.dE,
                          &t.swing, &t.dswing, &t.bend, &t.dbend, &t.pull};
    t.sim = sim;
    t.scratch = sim->scratch;
    t.eq = &sim->equations;
    t.e = at->at.e;
    t.factors = &at->factors;
    t.evaluation = at;
    t.at = &now->at;
    t.y = now->at.q;
    t.v = now->at.v;
    t.a = at->a;
    t.lam = at->lam;
    t.du = du;
    for (size_t i = 0; i < sizeof arrays / sizeof *arrays; i++) {
        *arrays[i] = take_complex(scratch, d, 1);
    }
    t.dq = take(scratch, (size_t)n);
    t.dv = take(scratch, (size_t)n);
    t.dx = take(scratch, (size_t)system->even);
    t.dlam = take(scratch, (size_t)t.eq->r);
    t.dpressure = take(scratch, (size_t)system->s);
    zeros(system->even, t.dx);
    memset(t.pull, 0, (size_t)d * sizeof *t.pull);
    turning(system, t.v, t.w);
    turning(system, t.a, t.alpha);
    return t;
}

PRBM bool exchange_directional(Simulation *simulation, const double *dx, const double *du,
                               double *dvalues, Problem *problem) {
    Simulation *sim = simulation;
    int stops = sim->configuration.mechanism->slots.stops;
    Moment now;
    if (!present_moment(sim, &now, problem)) {
        return false;
    }
    Tangent t = begin_tangent(sim, &now, du);
    double *dmoment = take(&t.scratch, (size_t)system_of(sim)->d);
    Complex *dw = take_complex(&t.scratch, system_of(sim)->d, 1);
    bool ok = tangent_coordinates(&t, dx, problem);
    if (ok) {
        load_row_change(&t, dw, dmoment);
        arm_load_change(&t, dw, dmoment);
        element_change(&t);
        pressure_changes(&t);
        rub_change(&t);
        row_change(&t);
        apply_pull(&t);
        solve_again(t.factors, t.dx, t.dlam);
        bend_arms(&t);
        all_changes(&t, dx, dw, dmoment, dvalues);
    }
    for (int i = 0; ok && i < system_of(sim)->s; i++) {
        ok = mobility_change(&t, i, dvalues + stops + PER_STOP * i + STOP_POINT_MOBILITY,
                             problem);
    }
    return ok;
}
