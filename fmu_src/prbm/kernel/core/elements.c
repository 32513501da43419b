/* Elements with energy: the twin of mechanics/elements.py. */
#include <math.h>
#include <string.h>

#include "core/elements.h"
#include "core/forces.h"
#include "core/matrix.h"

/* --- torsion at joints ------------------------------------------------------------------------ */

PRBM double turn_of(const Torsion *torsion, const double *x) {
    double a = torsion->a == FIXED ? 0.0 : x[torsion->a];
    double b = torsion->b == FIXED ? 0.0 : x[torsion->b];
    return b - a;
}

PRBM double twist_of(const System *system, const Torsion *torsion, const double *q, double share) {
    return turn_of(torsion, q) - turn_of(torsion, system->q0) - share * torsion->free_angle;
}

PRBM void turn_back(const Torsion *torsion, double moment, double *force) {
    if (torsion->a != FIXED) {
        force[torsion->a] += moment;
    }
    if (torsion->b != FIXED) {
        force[torsion->b] -= moment;
    }
}

/* Add the moments of torsion to force (n,), and return the power that they dissipate. */
static double add_torsion_forces(const System *system, double beta, const double *q, const double *v,
                                 double *force) {
    double loss = 0.0;
    for (int k = 0; k < system->torsion_count; k++) {
        const Torsion *torsion = &system->torsions[k];
        double rate = turn_of(torsion, v);
        double damper = (beta * torsion->stiffness + torsion->damping) * rate;
        double twist = twist_of(system, torsion, q, 1.0);
        turn_back(torsion, torsion->stiffness * twist + damper, force);
        loss += damper * rate;
    }
    return loss;
}

/* Add the stiffness of torsion to K (n, n). */
static void add_torsion_stiffness(const System *system, double *K) {
    for (int k = 0; k < system->torsion_count; k++) {
        const Torsion *torsion = &system->torsions[k];
        if (torsion->a != FIXED) {
            turn_back(torsion, torsion->stiffness, K + torsion->a * system->n);
        }
        if (torsion->b != FIXED) {
            turn_back(torsion, -torsion->stiffness, K + torsion->b * system->n);
        }
    }
}

/* --- springs ---------------------------------------------------------------------------------- */

/* Whether a spring has stiffness at an elongation x.  It has at its free length, although round-off
 * may be on the other side. */
static bool acts(const SpringLaw *law, double x) {
    return !(law->side * x < -SPRING_FREE_RTOL * law->drawn_length);
}

PRBM double spring_tension(const SpringLaw *law, double x) {
    if (!acts(law, x)) {
        return 0.0;
    }
    return (law->stiffness + law->cubic_stiffness * (x * x)) * x;
}

PRBM double spring_slope(const SpringLaw *law, double x) {
    if (!acts(law, x)) {
        return 0.0;
    }
    return law->stiffness + 3.0 * law->cubic_stiffness * (x * x);
}

PRBM double spring_energy(const SpringLaw *law, double x) {
    if (!acts(law, x)) {
        return 0.0;
    }
    return (0.5 * law->stiffness + 0.25 * law->cubic_stiffness * (x * x)) * (x * x);
}

PRBM SpringLaw two_sided(const SpringLaw *law) {
    SpringLaw result = *law;
    result.side = 0;
    return result;
}

PRBM double coil_elastic(const SpringLaw *law, const SpringState *now, SpringPhase phase) {
    SpringLaw both = two_sided(law);
    return law->side == 0          ? now->tension
           : phase != COIL_SLACK ? spring_tension(&both, now->elongation)
                                   : 0.0;
}

PRBM double coil_force(const SpringLaw *law, const SpringState *now, double rate, SpringPhase phase) {
    return phase == COIL_ACTING ? coil_elastic(law, now, phase) + law->damping * rate : 0.0;
}

static const Complex *span_of_spring(const System *system, int k) {
    return system->spans + k * system->d;
}

PRBM SpringState spring_state(const System *system, int k, const Complex *e, double share) {
    const SpringLaw *law = &system->laws[k];
    const Complex *A = span_of_spring(system, k);
    double least = SPRING_LENGTH_RTOL * system->length, free_length = law->free_length;
    SpringState now = {system->spans_c[k], 0.0, 0.0, 0.0};
    for (int j = 0; j < system->d; j++) {
        now.along = plus(now.along, product(A[j], e[j]));
    }
    double x = now.along.re, y = now.along.im;
    if (share != 1.0) {
        free_length = law->drawn_length + share * (law->free_length - law->drawn_length);
    }
    now.length = square_root(x * x + y * y + least * least);
    now.elongation = now.length - free_length;
    now.tension = spring_tension(law, now.elongation);
    return now;
}

PRBM void span_gradient(const System *system, int k, Complex u, const Complex *e, double *row) {
    const Complex *A = span_of_spring(system, k);
    zeros(system->n, row);
    for (int j = 0; j < system->d; j++) {
        Complex arm = product(A[arm_of(system, j)], e[j]);
        to_coordinates(system, j, -product(conjugate(u), arm).im, row);
    }
}

PRBM void length_gradient(const System *system, int k, const Complex *e, double *row) {
    SpringState now = spring_state(system, k, e, 1.0);
    span_gradient(system, k, scaled(1.0 / now.length, now.along), e, row);
}

PRBM double length_rate(const System *system, int k, const SpringState *now, const Complex *e,
                        const double *v) {
    const Complex *A = span_of_spring(system, k);
    double sum = 0.0;
    for (int j = 0; j < system->d; j++) {
        Complex arm = product(A[arm_of(system, j)], e[j]);
        sum -= direction_of(system, v, j) * product(conjugate(now->along), arm).im;
    }
    return sum / now->length;
}

PRBM double strain_of(const System *system, int k, const Complex *e) {
    return system->laws[k].side * spring_state(system, k, e, 1.0).elongation;
}

PRBM double strain_rate_of(const System *system, int k, const Complex *e, const double *v) {
    SpringState now = spring_state(system, k, e, 1.0);
    return system->laws[k].side * length_rate(system, k, &now, e, v);
}

PRBM double coil_near(const System *system) {
    return CONSTRAINT_RTOL * system->length;
}

PRBM double coil_slow(const System *system, const double *v) {
    double fastest = 0.0;
    for (int i = 0; i < system->n; i++) {
        fastest = greater(fastest, fabs(v[i]));
    }
    return ZERO_SPEED_RTOL * system->length * fastest;
}

PRBM CoilPull coil_pull(const System *system, int k, const Complex *e, const double *v) {
    const SpringLaw *law = &system->laws[k];
    SpringState now = spring_state(system, k, e, 1.0);
    double elastic = coil_elastic(law, &now, COIL_ACTING);
    double damper = law->damping * length_rate(system, k, &now, e, v);
    double least = law->stiffness * coil_near(system) + law->damping * coil_slow(system, v);
    CoilPull result = {law->side * (elastic + damper),
                       PHASE_RTOL * (fabs(elastic) + fabs(damper)) + least};
    return result;
}

PRBM SpringPhase coil_phase(const System *system, const SpringPhase *phases, int k) {
    return system->laws[k].side != 0 ? phases[k] : COIL_ACTING;
}

/* Add the forces of springs and dampers to force (n,), and return the power that they dissipate. */
static double add_coil_forces(const System *system, const SpringPhase *phases, const Complex *e,
                            const double *v, double *force, double *row) {
    double loss = 0.0;
    for (int k = 0; k < system->coil_count; k++) {
        SpringState now = spring_state(system, k, e, 1.0);
        span_gradient(system, k, scaled(1.0 / now.length, now.along), e, row);
        const SpringLaw *law = &system->laws[k];
        SpringPhase phase = coil_phase(system, phases, k);
        double rate = dot(system->n, row, v);
        double tension = coil_force(law, &now, rate, phase);
        add_scaled(system->n, -tension, row, force);
        loss += law->side == 0 ? law->damping * rate * rate
                               : (tension - coil_elastic(law, &now, phase)) * rate;
    }
    return loss;
}

/* Stiffnesses of a spring along and across it. */
typedef struct {
    double along, across;
} Stiffnesses;

static Stiffnesses stiffnesses(const SpringLaw *law, const SpringState *now) {
    Stiffnesses result = {spring_slope(law, now->elongation), now->tension / now->length};
    return result;
}

/* The same without negative parts.  Slack springs have the stiffness with which they would act. */
static Stiffnesses positive_stiffnesses(const SpringLaw *law, const SpringState *now) {
    SpringLaw both = two_sided(law);
    Stiffnesses own = {spring_slope(&both, now->elongation), now->tension / now->length};
    Stiffnesses result = {greater(own.along, 0.0), greater(own.across, 0.0)};
    return result;
}

/* Add the product of a stiffness and row row^T to K (n, n). */
static void add_outer(int n, double stiffness, const double *row, double *K) {
    for (int i = 0; i < n; i++) {
        add_scaled(n, stiffness * row[i], row, K + i * n);
    }
}

/* Set row (n,) to one of the gradients g, dx/dq and dy/dq of a spring, and return its stiffness: their
 * outer products with these stiffnesses are the stiffness without second derivatives of z. */
static double stiffness_row(const System *system, int k, const SpringState *now, Stiffnesses own,
                            const Complex *e, int which, double *row) {
    Complex along = scaled(1.0 / now->length, now->along);
    Complex u = which == 0 ? along : complex_of(which == 1, which == 2);
    span_gradient(system, k, u, e, row);
    return which == 0 ? own.along - own.across : own.across;
}

enum { STIFFNESS_ROWS = 3 };

/* Add the stiffness of spring k without second derivatives of z to K (n, n). */
static void add_stiffnesses(const System *system, int k, const SpringState *now, Stiffnesses own,
                            const Complex *e, double *K, double *row) {
    for (int i = 0; i < STIFFNESS_ROWS; i++) {
        double stiffness = stiffness_row(system, k, now, own, e, i, row);
        add_outer(system->n, stiffness, row, K);
    }
}

/* --- geometric stiffness ---------------------------------------------------------------------- */

PRBM void stiffen(const System *system, int i, int j, double x, double *K_t) {
    if (system->mapped) {
        both_to_coordinates(system, i, j, x, K_t);
    } else {
        K_t[i * system->n + j] += x;
    }
}

/* Positions are linear in displacements, which have no such stiffness. */
PRBM void add_geometric_stiffness(const System *system, const Complex *pull_of, double *K_t) {
    for (int j = 0; j < system->d; j++) {
        int a = arm_of(system, j);
        if (is_shift(system, j)) {
            continue;
        }
        stiffen(system, j, j, a == j ? pull_of[a].re : -pull_of[a].re, K_t);
        if (a != j) {
            stiffen(system, j, a, pull_of[a].im, K_t);
            stiffen(system, a, j, pull_of[a].im, K_t);
        }
    }
}

/* --- all elements ----------------------------------------------------------------------------- */

PRBM bool element_strained(const System *system) {
    bool found = false;
    for (int j = 0; j < system->n; j++) {
        found = found || system->rest[j] != system->q0[j];
    }
    for (int k = 0; k < system->torsion_count; k++) {
        found = found || system->torsions[k].free_angle != 0.0;
    }
    for (int k = 0; k < system->coil_count; k++) {
        found = found || system->laws[k].free_length != system->laws[k].drawn_length;
    }
    return found;
}

PRBM double add_motion_forces(const System *system, const SpringPhase *phases, double beta,
                              const double *q, const Complex *e, const double *v, double *force,
                              double *row) {
    double loss = add_torsion_forces(system, beta, q, v, force);
    return loss + add_coil_forces(system, phases, e, v, force, row);
}

PRBM int damper_count(const System *system) {
    return system->torsion_count + system->coil_count;
}

PRBM double damper_row(const System *system, int k, const Complex *e, double *row) {
    int coil = k - system->torsion_count;
    if (coil >= 0) {
        length_gradient(system, coil, e, row);
        return system->laws[coil].damping;
    }
    zeros(system->n, row);
    turn_back(&system->torsions[k], -1.0, row);
    return system->torsions[k].damping;
}

/* Set the deflections (n,) of flexures. */
static void deflections(const System *system, const double *q, double share, double *turned) {
    for (int j = 0; j < system->n; j++) {
        double strain = system->rest[j] - system->q0[j];
        turned[j] = share == 1.0 ? q[j] - system->rest[j] : q[j] - system->q0[j] - share * strain;
    }
}

PRBM void element_forces(const System *system, const double *q, const Complex *e, double share,
                         double *force, Scratch scratch) {
    double *row = take(&scratch, (size_t)system->n);
    deflections(system, q, share, row);
    springs(system->n, system->K, row, force);
    for (int k = 0; k < system->torsion_count; k++) {
        const Torsion *torsion = &system->torsions[k];
        double twist = twist_of(system, torsion, q, share);
        turn_back(torsion, torsion->stiffness * twist, force);
    }
    for (int k = 0; k < system->coil_count; k++) {
        SpringState now = spring_state(system, k, e, share);
        span_gradient(system, k, scaled(1.0 / now.length, now.along), e, row);
        add_scaled(system->n, -now.tension, row, force);
    }
}

PRBM void element_tangent(const System *system, const Complex *e, double share, double *K_t,
                          Scratch scratch) {
    int d = system->d;
    double *row = take(&scratch, (size_t)system->n);
    Complex *pulled = take_complex(&scratch, d, 1);
    copy(system->n * system->n, system->K, K_t);
    add_torsion_stiffness(system, K_t);
    for (int k = 0; k < system->coil_count; k++) {
        SpringState now = spring_state(system, k, e, share);
        Stiffnesses own = stiffnesses(&system->laws[k], &now);
        Complex force = scaled(-own.across, conjugate(now.along));
        add_stiffnesses(system, k, &now, own, e, K_t, row);
        for (int j = 0; j < d; j++) {
            pulled[j] = product(force, product(span_of_spring(system, k)[j], e[j]));
        }
        add_geometric_stiffness(system, pulled, K_t);
    }
}

PRBM double element_energy(const System *system, const double *q, const Complex *e,
                           Scratch scratch) {
    double *turned = take(&scratch, (size_t)system->n);
    deflections(system, q, 1.0, turned);
    double energy = elastic_energy(system->n, system->K, turned);
    for (int k = 0; k < system->torsion_count; k++) {
        double twist = twist_of(system, &system->torsions[k], q, 1.0);
        energy += 0.5 * system->torsions[k].stiffness * (twist * twist);
    }
    for (int k = 0; k < system->coil_count; k++) {
        energy += spring_energy(&system->laws[k], spring_state(system, k, e, 1.0).elongation);
    }
    return energy;
}

PRBM void element_stiffness(const System *system, const Complex *e, double *K, Scratch scratch) {
    double *row = take(&scratch, (size_t)system->n);
    copy(system->n * system->n, system->K, K);
    add_torsion_stiffness(system, K);
    for (int k = 0; k < system->coil_count; k++) {
        SpringState now = spring_state(system, k, e, 1.0);
        Stiffnesses own = positive_stiffnesses(&system->laws[k], &now);
        add_stiffnesses(system, k, &now, own, e, K, row);
    }
}

PRBM void element_torques(const System *system, const Complex *e, const double *w, double *torques,
                          double *row) {
    for (int j = 0; j < system->n; j++) {
        torques[j] = system->grounded[j] * w[j];
    }
    for (int k = 0; k < system->spring_count; k++) {
        int a = system->spring[k].a, b = system->spring[k].b;
        double torque = system->spring[k].rate * (w[a] - w[b]);
        torques[a] += torque;
        torques[b] -= torque;
    }
    for (int k = 0; k < system->torsion_count; k++) {
        const Torsion *torsion = &system->torsions[k];
        turn_back(torsion, -torsion->stiffness * turn_of(torsion, w), torques);
    }
    for (int k = 0; k < system->coil_count; k++) {
        SpringState now = spring_state(system, k, e, 1.0);
        Stiffnesses own = positive_stiffnesses(&system->laws[k], &now);
        for (int i = 0; i < STIFFNESS_ROWS; i++) {
            double stiffness = stiffness_row(system, k, &now, own, e, i, row);
            add_scaled(system->n, stiffness * dot(system->n, row, w), row, torques);
        }
    }
}
