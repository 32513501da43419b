/* Directional derivatives of flexures, joints and springs. */
#include "core/dynamics.h"
#include "core/elements.h"
#include "tangent_elements.h"

/* A spring with its damper, and its changes: the unit vector u along it, its length and rate, and its
 * force, positive in tension. */
typedef struct {
    Complex u, du;
    double rate, tension, force; /* tension: without the damper */
    double dlength, drate, dtension, dforce;
} SpringMotion;

static SpringMotion spring_motion(const Tangent *t, int k) {
    const System *system = t->eq->system;
    const Complex *A = system->spans + k * system->d;
    const SpringLaw *law = &system->laws[k];
    SpringPhase phase = coil_phase(system, t->eq->contacts.coils, k);
    SpringLaw both = two_sided(law);
    SpringState now = spring_state(system, k, t->e, 1.0);
    Complex moved = along_arms(system->d, A, t->dE);
    Complex speed = times_i(along_arms(system->d, A, t->swing));
    Complex dspeed = times_i(along_arms(system->d, A, t->dswing));
    SpringMotion x = {scaled(1.0 / now.length, now.along), {0.0, 0.0}, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
    x.rate = product(conjugate(x.u), speed).re;
    x.tension = coil_elastic(law, &now, phase);
    x.force = coil_force(law, &now, x.rate, phase);
    x.dlength = product(conjugate(x.u), moved).re;
    x.du = scaled(1.0 / now.length, minus(moved, scaled(x.dlength, x.u)));
    x.drate = product(conjugate(x.du), speed).re + product(conjugate(x.u), dspeed).re;
    x.dtension = phase == COIL_SLACK ? 0.0 : spring_slope(&both, now.elongation) * x.dlength;
    x.dforce = phase == COIL_ACTING ? x.dtension + law->damping * x.drate : 0.0;
    return x;
}

/* The force on the end of a spring, and its change. */
static Complex end_force(const SpringMotion *x) {
    return scaled(-x->force, x->u);
}

static Complex end_force_change(const SpringMotion *x) {
    return scaled(-1.0, plus(scaled(x->dforce, x->u), scaled(x->force, x->du)));
}

PRBM void element_change(const Tangent *t) {
    const Equations *eq = t->eq;
    const System *system = eq->system;
    Scratch scratch = t->scratch;
    int n = system->n, d = system->d;
    double *row = take(&scratch, (size_t)n);
    Complex *B = take_complex(&scratch, d, 1);
    for (int i = 0; i < n; i++) {
        for (int j = 0; j < n; j++) {
            t->dx[i] -= system->K[i * n + j] * (t->dq[j] + eq->beta * t->dv[j]);
        }
    }
    for (int k = 0; k < system->torsion_count; k++) {
        const Torsion *torsion = &system->torsions[k];
        double damping = eq->beta * torsion->stiffness + torsion->damping;
        double change = torsion->stiffness * turn_of(torsion, t->dq) + damping * turn_of(torsion, t->dv);
        turn_back(torsion, change, t->dx);
    }
    for (int k = 0; k < system->coil_count; k++) {
        SpringMotion x = spring_motion(t, k);
        Complex force = conjugate(end_force(&x));
        for (int j = 0; j < d; j++) {
            B[j] = product(force, system->spans[k * d + j]);
        }
        Rows rows = plain_rows(system, 1, B, NULL);
        add_pull(t, &rows, 0, 1.0);
        span_gradient(system, k, end_force_change(&x), t->e, row);
        add_scaled(n, 1.0, row, t->dx);
    }
}

PRBM double element_energy_change(const Tangent *t) {
    const System *system = t->eq->system;
    int n = system->n;
    double sum = 0.0;
    for (int i = 0; i < n; i++) {
        for (int j = 0; j < n; j++) {
            sum += (t->y[i] - system->rest[i]) * system->K[i * n + j] * t->dq[j];
        }
    }
    for (int k = 0; k < system->torsion_count; k++) {
        const Torsion *torsion = &system->torsions[k];
        double twist = twist_of(system, torsion, t->y, 1.0);
        sum += torsion->stiffness * twist * turn_of(torsion, t->dq);
    }
    for (int k = 0; k < system->coil_count; k++) {
        sum += spring_state(system, k, t->e, 1.0).tension * spring_motion(t, k).dlength;
    }
    return sum;
}

PRBM double element_loss_change(const Tangent *t) {
    const System *system = t->eq->system;
    int n = system->n;
    double sum = 0.0;
    for (int i = 0; i < n; i++) {
        for (int j = 0; j < n; j++) {
            sum += 2.0 * t->eq->beta * t->v[i] * system->K[i * n + j] * t->dv[j];
        }
    }
    for (int k = 0; k < system->torsion_count; k++) {
        const Torsion *torsion = &system->torsions[k];
        double damping = t->eq->beta * torsion->stiffness + torsion->damping;
        sum += 2.0 * damping * turn_of(torsion, t->v) * turn_of(torsion, t->dv);
    }
    for (int k = 0; k < system->coil_count; k++) {
        SpringMotion x = spring_motion(t, k);
        sum += (x.dforce - x.dtension) * x.rate + (x.force - x.tension) * x.drate;
    }
    return sum;
}

PRBM CoilChange coil_change(const Tangent *t, int k) {
    const SpringLaw *law = &t->eq->system->laws[k];
    SpringLaw both = two_sided(law);
    SpringState now = spring_state(t->eq->system, k, t->e, 1.0);
    SpringMotion x = spring_motion(t, k);
    double dforce = spring_slope(&both, now.elongation) * x.dlength + law->damping * x.drate;
    CoilChange change = {law->side * x.dlength, law->side * x.drate, law->side * dforce};
    return change;
}

PRBM void spring_changes(const Tangent *t, double *out) {
    for (int k = 0; k < t->eq->system->coil_count; k++) {
        SpringMotion x = spring_motion(t, k);
        double *d = out + PER_SPRING * k;
        d[SPRING_FORCE] = x.dforce;
        d[SPRING_LENGTH] = x.dlength;
        d[SPRING_LENGTH_RATE] = x.drate;
    }
}

PRBM void spring_pull_changes(const Tangent *t, Complex *on) {
    const System *system = t->eq->system;
    for (int k = 0; k < system->coil_count; k++) {
        const Connection *c = &system->mechanism->coils[k].between;
        SpringMotion x = spring_motion(t, k);
        Complex change = end_force_change(&x);
        on[c->end] = plus(on[c->end], change);
        on[c->start] = minus(on[c->start], change);
    }
}
