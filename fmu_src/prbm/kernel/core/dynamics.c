/* Rates of the state, powers, stops and base reactions: the twin of mechanics/dynamics.py. */
#include <math.h>

#include "core/dynamics.h"
#include "core/forces.h"
#include "core/matrix.h"

/* The power that friction takes out. */
static double rubbing_power(const Equations *q, const double *v) {
    Rows rubs = rub_rows(q->system), walls = slide_rows(q->system);
    double power = 0.0;
    for (int k = 0; k < q->rub_slide_count; k++) {
        int i = q->rub_slides[k];
        power -= rub_force(q, i) * row_rate(&rubs, i, q->e, v);
    }
    for (int k = 0; k < q->sliding_count; k++) {
        int i = q->sliding[k];
        double force = q->lam[q->first_hold + held_at(q, i)];
        double speed = row_rate(&walls, i, q->e, v);
        power += q->stop_friction[i] * force * q->discrete.slides[i] * speed;
    }
    return power;
}

/* The power of the inputs and of the moving walls that hold. */
static double input_power(const Equations *q, const double *v) {
    int n = q->system->n;
    double power = 0.0;
    for (int j = 0; q->driven && j < n; j++) {
        power += (product(q->w_input[j], q->e[j]).re + q->moment[j]) * v[j];
    }
    for (int k = 0; k < q->held_count; k++) {
        power -= q->lam[q->first_hold + k] * q->inputs.walls[q->held[k]].rate;
    }
    return power;
}

static void trace_forces(Equations *q) {
    const double *force = q->lam + q->first_hold;
    for (int k = 0; k < q->held_count; k++) {
        q->least[k] = lesser(force[k], q->least[k]);
        q->most[k] = greater(force[k], q->most[k]);
    }
}

PRBM void begin_trace(Equations *q) {
    for (int k = 0; k < q->held_count; k++) {
        q->least[k] = INFINITY;
        q->most[k] = -INFINITY;
    }
}

SIZED bool rates_of_length(int even, Equations *q, const double *y, bool turned, double *dy) {
    int n = q->system->n;
    pad_of(even, n, y, q->angle);
    pad_second(even, n, y, q->speed);
    if (!motion_of_length(even, q, turned)) {
        return false;
    }
    join(even, n, q->speed, q->x, dy);
    return true;
}

/* The lengths of the guides' vectors are known where they are compiled, so that loops unroll. */
static bool rates_of_motion(Equations *q, const double *y, bool turned, double *dy) {
    int even = q->system->even;
    switch (even) {
    case 4: return rates_of_length(4, q, y, turned, dy);
    case 8: return rates_of_length(8, q, y, turned, dy);
    default: return rates_of_length(even, q, y, turned, dy);
    }
}

/* The rates of y; turned: near the start. */
static bool rates_at(Equations *q, const double *y, bool turned, double *dy, Problem *problem) {
    int n = q->system->n;
    const double *v = y + n;
    if (!rates_of_motion(q, y, turned, dy)) {
        return fail(problem, "%s", SINGULAR);
    }
    trace_forces(q);
    dy[2 * n] = q->spring_loss;
    dy[2 * n + 1] = 0.0;
    if (q->mass_damping != 0.0) {
        dy[2 * n] += 2.0 * q->mass_damping * energy_here(q, v);
    }
    if (q->rub_slide_count > 0 || q->sliding_count > 0) {
        dy[2 * n] += rubbing_power(q, v);
    }
    if (q->driven || q->walls_push) {
        dy[2 * n + 1] = input_power(q, v);
    }
    return true;
}

/* The loads do not depend on the time; a moving wall is a matter of the constraints. */
PRBM bool rate(Equations *equations, double t, const double *y, double *dy, Problem *problem) {
    (void)t;
    return rates_at(equations, y, false, dy, problem);
}

/* --- stops ------------------------------------------------------------------------------------ */

PRBM double gap(const Equations *equations, int i, double t, const Complex *e) {
    Rows rows = gap_rows(equations->system);
    return row_value(&rows, i, e) + rows.c[i] + wall_at(&equations->inputs.walls[i], t);
}

PRBM double gap_rate(const Equations *equations, int i, const Complex *e, const double *v) {
    Rows rows = gap_rows(equations->system);
    return row_rate(&rows, i, e, v) + equations->inputs.walls[i].rate;
}

/* --- reactions -------------------------------------------------------------------------------- */

/* E (i w' - w^2) of the arms: a place accelerates by A times that. */
static void arm_accelerations(const System *system, const Complex *e, const double *v,
                              const double *a, Complex *result, Scratch *scratch) {
    size_t mark = scratch->used;
    int n = system->n;
    Complex *w = take_complex(scratch, n, 1), *dw = take_complex(scratch, n, 1);
    turning(system, v, w);
    turning(system, a, dw);
    for (int j = 0; j < n; j++) {
        Complex change = minus(complex_of(-dw[j].im, dw[j].re), product(w[j], w[j]));
        result[j] = product(e[j], change);
    }
    scratch->used = mark;
}

/* A E */
static Complex along_arms(int n, const Complex *A, const Complex *e) {
    Complex sum = {0.0, 0.0};
    for (int j = 0; j < n; j++) {
        sum = plus(sum, product(A[j], e[j]));
    }
    return sum;
}

PRBM void base_reaction(const Equations *equations, const Complex *e, const double *v,
                        const double *a, Complex *force, double *moment, Scratch *scratch) {
    const System *system = equations->system;
    size_t mark = scratch->used;
    int n = system->n;
    Complex field = minus(system->gravity, equations->inputs.base);
    Complex *bend = take_complex(scratch, n, 1);
    arm_accelerations(system, e, v, a, bend, scratch);
    *force = complex_of(0.0, 0.0);
    *moment = 0.0;
    for (int i = 0; i < system->p; i++) {
        const Complex *A = system->A + i * n;
        Complex z = plus(along_arms(n, A, e), minus(system->c[i], system->anchor));
        Complex load = scaled(system->m[i], minus(field, along_arms(n, A, bend)));
        *force = plus(*force, load);
        *moment += product(conjugate(z), load).im;
    }
    for (int j = 0; j < n; j++) {
        *moment -= system->J[j] * a[j];
    }
    for (int i = 0; i < system->mechanism->force_count; i++) {
        const BodyFrame *frame = &system->pushed[i];
        const double *given = equations->inputs.forces + LOADS * i;
        Complex f = complex_of(given[0], given[1]);
        Complex z = plus(along_arms(n, frame->A, e), minus(frame->c, system->anchor));
        *force = plus(*force, f);
        *moment += product(conjugate(z), f).im + given[2];
    }
    scratch->used = mark;
}
