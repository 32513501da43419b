/* Rates of the state, powers, stops and base reactions: the twin of mechanics/dynamics.py. */
#include "core/dynamics.h"
#include "core/forces.h"
#include "core/friction.h"
#include "core/vectors.h"

/* The power that friction dissipates. */
static double rubbing_power(const Equations *eq, const Evaluation *at, const double *v) {
    double power = 0.0;
    for (int k = 0; k < eq->slipping_count; k++) {
        double speed = sliding_velocity(eq->system, eq->slipping[k], at->at.e, v);
        power -= slip_force(eq, at->at.e, at, eq->slipping[k]) * speed;
    }
    return power;
}

/* The power of the inputs and of the moving walls of closed stops. */
static double input_power(const Equations *eq, const Evaluation *at, const double *v) {
    const System *system = eq->system;
    double power = 0.0;
    for (int j = 0; j < system->d; j++) {
        double load = product(eq->w_input[j], at->at.e[j]).re + eq->moment[j];
        power += load * direction_of(system, v, j);
    }
    for (int k = 0; k < eq->held_count; k++) {
        double velocity = wall_motion(&eq->inputs.walls[eq->held[k]], at->at.time).v;
        power -= at->lam[eq->first_hold + k] * velocity;
    }
    return power;
}

/* Compute the rates of the states of compliant stops.  Add the losses and the work of the walls to
 * the rates of the energies.  The walls of frozen stops do not give way. */
NOINLINE void compliant_rates(const Equations *eq, const Evaluation *at, double *dy) {
    const Mechanism *m = eq->system->mechanism;
    double *energies = dy + 2 * eq->system->n;
    for (int i = 0; i < m->stop_count; i++) {
        if (!m->stops[i].compliant) {
            continue;
        }
        bool pressed = is_pressed(&eq->contacts.touching[i]);
        const double *now = at->at.extra + m->stops[i].extra;
        double *rates = energies + 2 + m->stops[i].extra;
        double force = pressed ? at->pressure[i]
                       : is_held(&eq->contacts, i) ? stop_force(eq, at->lam, i)
                                                  : 0.0;
        rates[EXTRA_RECOIL] = now[EXTRA_RECOIL_RATE];
        rates[EXTRA_RECOIL_RATE] = pressed ? eq->inputs.mobilities[i] * force : 0.0;
        rates[EXTRA_IMPULSE] = force;
        rates[EXTRA_LOSS] = pressed ? at->contact_loss[i] : 0.0;
        if (pressed) {
            double velocity = wall_motion(&eq->inputs.walls[i], at->at.time).v;
            energies[0] += at->contact_loss[i];
            energies[1] -= force * (velocity + now[EXTRA_RECOIL_RATE]);
        }
    }
}

SIZED bool rates_of_length(int even, const Equations *eq, const double *y, const Reference *near,
                           Evaluation *result, double *dy) {
    int n = eq->system->n;
    pad_of(even, n, y, result->at.angle);
    pad_second(even, n, y, result->at.speed);
    if (!motion_of_length(even, eq, near, result)) {
        return false;
    }
    join(even, n, result->at.speed, result->a, dy);
    return true;
}

/* The code for the vector lengths of the guides is compiled separately, so that loops unroll. */
static bool rates_of_motion(const Equations *eq, const double *y, const Reference *near,
                            Evaluation *result, double *dy) {
    int even = eq->system->even;
    switch (even) {
    case 4: return rates_of_length(4, eq, y, near, result, dy);
    case 8: return rates_of_length(8, eq, y, near, result, dy);
    default: return rates_of_length(even, eq, y, near, result, dy);
    }
}

/* Add to the rates of the energies all but the losses of the springs, and compute the rates of the
 * states of compliant stops. */
static void add_powers(const Equations *eq, const Evaluation *result, const double *v, double *dy) {
    int n = eq->system->n;
    if (eq->mass_damping != 0.0) {
        dy[2 * n] += 2.0 * eq->mass_damping * kinetic_energy_of(result);
    }
    if (eq->slipping_count > 0) {
        dy[2 * n] += rubbing_power(eq, result, v);
    }
    if (eq->driven) {
        dy[2 * n + 1] = input_power(eq, result, v);
        compliant_rates(eq, result, dy);
    }
}

PRBM bool rate_at_time(const Equations *equations, const double *y, const Reference *near,
                       Evaluation *result, double *dy, Problem *problem) {
    const Equations *eq = equations;
    int n = eq->system->n;
    if (!rates_of_motion(eq, y, near, result, dy)) {
        return fail(problem, "%s", SINGULAR);
    }
    dy[2 * n] = result->spring_loss;
    dy[2 * n + 1] = 0.0;
    if (eq->more_powers) {
        add_powers(eq, result, y + n, dy);
    }
    return true;
}

PRBM bool rate(const Equations *equations, double t, const double *y, const Reference *near,
               Evaluation *result, double *dy, Problem *problem) {
    result->at.time = t;
    result->at.extra = y + equations->system->mechanism->first_extra;
    return rate_at_time(equations, y, near, result, dy, problem);
}

/* --- reactions -------------------------------------------------------------------------------- */

/* Compute the second derivatives E (i w' - w^2) of the arms.  The acceleration of a point is its
 * row A times these derivatives. */
PRBM void arm_accelerations(const System *system, const Complex *e, const double *v,
                            const double *a, Complex *result, Scratch scratch) {
    int d = system->d;
    Complex *w = take_complex(&scratch, d, 1), *dw = take_complex(&scratch, d, 1);
    turning(system, v, w);
    turning(system, a, dw);
    for (int j = 0; j < d; j++) {
        Complex change = minus(complex_of(-dw[j].im, dw[j].re), product(w[j], w[j]));
        result[j] = product(e[j], change);
    }
    float_velocities(system, a, result);
}

/* Return the product A E of a row of A. */
PRBM Complex along_arms(int d, const Complex *A, const Complex *e) {
    Complex sum = {0.0, 0.0};
    for (int j = 0; j < d; j++) {
        sum = plus(sum, product(A[j], e[j]));
    }
    return sum;
}

PRBM void guide_loads(const System *system, const double *lam, double *out) {
    for (int i = 0; i < system->mechanism->guide_count; i++) {
        const GuideRows *guide = &system->guided[i];
        *out++ = lam[guide->across];
        if (guide->turn != FIXED) {
            *out++ = lam[guide->turn] * system->length;
        }
    }
}

PRBM void base_reaction(const Equations *equations, const Complex *e, const double *v,
                        const double *a, Complex *force, double *moment, Scratch scratch) {
    const System *system = equations->system;
    int d = system->d;
    Complex field = minus(system->gravity, equations->inputs.base);
    Complex *bend = take_complex(&scratch, d, 1);
    arm_accelerations(system, e, v, a, bend, scratch);
    *force = complex_of(0.0, 0.0);
    *moment = 0.0;
    for (int i = 0; i < system->p; i++) {
        const Complex *A = system->A + i * d;
        Complex z = plus(along_arms(d, A, e), minus(system->c[i], system->anchor));
        Complex load = scaled(system->m[i], minus(field, along_arms(d, A, bend)));
        *force = plus(*force, load);
        *moment += product(conjugate(z), load).im;
    }
    for (int j = 0; j < d; j++) {
        *moment -= system->J[j] * direction_of(system, a, j);
    }
    for (int i = 0; i < system->mechanism->force_count; i++) {
        const BodyFrame *frame = &system->pushed[i];
        const double *given = equations->inputs.forces + LOADS * i;
        Complex f = complex_of(given[0], given[1]);
        Complex z = plus(along_arms(d, frame->A, e), minus(frame->c, system->anchor));
        *force = plus(*force, f);
        *moment += product(conjugate(z), f).im + given[2];
    }
}
