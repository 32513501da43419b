/* Forces, moments and stress in the sections of flexures: the twin of mechanics/sections.py and
 * mechanics/stress.py. */
#include <math.h>
#include <string.h>

#include "core/elements.h"
#include "core/friction.h"
#include "core/matrix.h"
#include "core/sections.h"
#include "core/vectors.h"

/* --- loads ------------------------------------------------------------------------------------ */

/* Compute gravity, inertia and mass-proportional damping of all mass points. */
static void point_loads_at(const Equations *eq, const Complex *e, const double *v, const double *a,
                           Complex *loads, Scratch scratch) {
    const System *system = eq->system;
    int d = system->d;
    Complex field = minus(system->gravity, eq->inputs.base);
    Complex *bend = take_complex(&scratch, d, 1), *p = take_complex(&scratch, d, 1);
    arm_accelerations(system, e, v, a, bend, scratch);
    if (eq->mass_damping != 0.0) {
        swings(system, e, v, p);
        for (int j = 0; j < d; j++) {
            bend[j] = plus(bend[j], scaled(eq->mass_damping, complex_of(-p[j].im, p[j].re)));
        }
    }
    for (int i = 0; i < system->p; i++) {
        Complex change = minus(field, along_arms(d, system->A + i * d, bend));
        loads[i] = scaled(system->m[i], change);
    }
}

static void pull_body(Complex *on, int body, Complex force) {
    on[body] = plus(on[body], force);
}

/* The friction force of a contact along its direction. */
static double rubbing_force(const Equations *eq, const Complex *e, const Evaluation *found,
                            int contact) {
    return eq->contacts.modes[contact] == CONTACT_STICK ? stick_force(eq, found->lam, contact)
                                                       : slip_force(eq, e, found, contact);
}

/* Let a closed stop push and rub its bodies. */
static void pull_stop(const Equations *eq, const Complex *e, int i, double force, double along,
                      Complex *on) {
    const System *system = eq->system;
    const Stop *stop = &system->mechanism->stops[i];
    Complex u = unit(stop->direction);
    u = system->on[i] == FIXED ? u : product(u, e[system->on[i]]);
    Complex pull = product(u, complex_of(-force, along));
    pull_body(on, stop->body, pull);
    pull_body(on, stop->on, scaled(-1.0, pull));
}

PRBM void add_contact_pulls(const Equations *eq, const Complex *e, const Evaluation *found,
                            Complex *on) {
    const System *system = eq->system;
    const Mechanism *m = system->mechanism;
    const double *lam = found->lam;
    for (int k = 0; k < eq->held_count; k++) {
        int i = eq->held[k];
        pull_stop(eq, e, i, stop_force(eq, lam, i), rubbing_force(eq, e, found, i), on);
    }
    for (int k = 0; k < eq->pressed_count; k++) {
        int i = eq->pressed[k];
        pull_stop(eq, e, i, found->pressure[i], rubbing_force(eq, e, found, i), on);
    }
    for (int i = 0; i < m->friction_count; i++) {
        const Friction *friction = &m->frictions[i];
        double size = rubbing_force(eq, e, found, system->s + i);
        Complex pull = scaled(size, unit(friction->direction));
        pull_body(on, friction->body, pull);
        pull_body(on, GROUND, scaled(-1.0, pull));
    }
}

/* Let springs pull their bodies and the ground. */
static void add_spring_pulls(const Equations *eq, const Complex *e, const double *v, Complex *on,
                             Scratch scratch) {
    const System *system = eq->system;
    double *row = take(&scratch, (size_t)system->n);
    for (int k = 0; k < system->coil_count; k++) {
        const Connection *c = &system->mechanism->coils[k].between;
        SpringState now = spring_state(system, k, e, 1.0);
        length_gradient(system, k, e, row);
        double force = coil_force(&system->laws[k], &now, dot(system->n, row, v),
                                  coil_phase(system, eq->contacts.coils, k));
        Complex pull = scaled(force / now.length, now.along);
        pull_body(on, c->start, pull);
        pull_body(on, c->end, scaled(-1.0, pull));
    }
}

/* Let guides push and rub their bodies. */
static void add_guide_pulls(const Equations *eq, const Complex *e, const Evaluation *found,
                            Complex *on) {
    const System *system = eq->system;
    const Mechanism *m = system->mechanism;
    int contact = system->s + m->friction_count;
    for (int i = 0; i < m->guide_count; i++) {
        const GuideRows *guide = &system->guided[i];
        int carrier = system->loops_on[guide->across];
        double along = m->guides[i].rubs ? rubbing_force(eq, e, found, contact++) : 0.0;
        Complex pull = product(complex_of(found->lam[guide->across], -along), guide->normal);
        pull = carrier == FIXED ? pull : product(pull, e[carrier]);
        pull_body(on, m->guides[i].between.start, pull);
        pull_body(on, m->guides[i].between.end, scaled(-1.0, pull));
    }
}

/* Return the sum of the loads of mass points i to end - 1. */
static Complex sum_loads(const Complex *loads, int i, int end) {
    Complex sum = {0.0, 0.0};
    for (; i < end; i++) {
        sum = plus(sum, loads[i]);
    }
    return sum;
}

/* Let a step, at whose far end a force acts, load its bodies. */
static void load_bodies(const System *system, const Step *step, Complex far, SectionState *at) {
    Complex own = {0.0, 0.0};
    if (step->flexure) {
        int i = (int)(step->flexure - system->mechanism->flexures);
        const FreeBody *body = &system->free_bodies[i];
        own = sum_loads(at->loads, body->first, body->first + body->count);
        at->far[i] = far;
    }
    pull_body(at->on, step->backwards ? step->between->end : step->between->start, plus(far, own));
}

PRBM void transmit(const System *system, const double *lam, SectionState *at) {
    const Mechanism *m = system->mechanism;
    int row = 0;
    for (int k = 0; k < m->step_count; k++) {
        const Step *step = &m->steps[k];
        if (step->closes) {
            Complex far = complex_of(lam[row], lam[row + 1]);
            if (step->flexure) {
                const FreeBody *body = &system->free_bodies[step->flexure - m->flexures];
                int end = body->first + body->count;
                far = minus(far, sum_loads(at->loads, end - body->stub, end));
            }
            int reached = step->backwards ? step->between->start : step->between->end;
            pull_body(at->on, reached, scaled(-1.0, far));
            load_bodies(system, step, far, at);
            row += 2;
        }
    }
    for (int k = m->step_count - 1; k >= 0; k--) {
        const Step *step = &m->steps[k];
        if (!step->closes && step->between) {
            int reached = step->backwards ? step->between->start : step->between->end;
            load_bodies(system, step, at->on[reached], at);
        }
    }
}

PRBM SectionState section_state(const Equations *eq, const Complex *e, const double *angle,
                                const double *v, const Evaluation *found, Scratch *scratch) {
    const System *system = eq->system;
    const Mechanism *m = system->mechanism;
    double *strained = take(scratch, (size_t)system->n);
    SectionState at = {e, angle, strained, take_complex(scratch, system->p, 1),
                       take_complex(scratch, system->b + 1, 1),
                       take_complex(scratch, m->flexure_count, 1)};
    for (int j = 0; j < system->n; j++) {
        strained[j] = angle[j] - system->rest[j] + eq->beta * v[j];
    }
    point_loads_at(eq, e, v, found->a, at.loads, *scratch);
    at.on[GROUND] = complex_of(0.0, 0.0);
    for (int body = 1; body <= system->b; body++) {
        at.on[body] = at.loads[system->body_masses[body - 1]];
    }
    for (int i = 0; i < m->force_count; i++) {
        const double *given = eq->inputs.forces + LOADS * i;
        pull_body(at.on, m->forces[i].body, complex_of(given[0], given[1]));
    }
    add_contact_pulls(eq, e, found, at.on);
    add_spring_pulls(eq, e, v, at.on, *scratch);
    add_guide_pulls(eq, e, found, at.on);
    transmit(system, found->lam, &at);
    return at;
}

/* --- sections --------------------------------------------------------------------------------- */

/* Work of the loads in the virtual rotation of an end: side 0 is the near end.  ground: the arm of
 * the ground, 1, or its change, 0. */
static double end_work(const FreeBody *body, int side, const Complex *e, Complex ground,
                       const Complex *loads, Complex far) {
    int k = body->arm_count;
    double sum = 0.0;
    for (int j = 0; j < k; j++) {
        double turn = body->turning[side * k + j];
        if (turn != 0.0) {
            Complex arm = body->arms[j] == FIXED ? ground : e[body->arms[j]];
            Complex pulled = product(conjugate(far), body->levers[body->count * k + j]);
            for (int i = 0; i < body->count; i++) {
                Complex load = conjugate(loads[body->first + i]);
                pulled = plus(pulled, product(load, body->levers[i * k + j]));
            }
            sum -= turn * product(pulled, arm).im;
        }
    }
    return sum;
}

static double strain_at(const double *strained, int j) {
    return j == FIXED ? 0.0 : strained[j];
}

/* Torque of the springs in the direction from near to far: at pivot i of links, or the part of the
 * polynomial of a beam that its ends contribute. */
static double torque_at(const FreeBody *body, int i, const double *strained) {
    bool beam = body->order > 0;
    int a = beam ? body->angles[0] : body->angles[i];
    int b = beam ? body->angles[1] : body->angles[i + 1];
    double torque = body->rates[beam ? 0 : i] * (strain_at(strained, b) - strain_at(strained, a));
    return beam && !body->forwards ? -torque : torque;
}

/* Bending moment between the ends at section k, positive from start to end. */
static double bending_between(const FreeBody *body, int k, const double *strained) {
    double sign = body->forwards ? 1.0 : -1.0, sum = 0.0;
    if (body->order == 0) {
        return sign * torque_at(body, k - 1, strained);
    }
    int cut = body->forwards ? k : body->sections - 1 - k;
    for (int l = 1; l <= body->order; l++) {
        double P = body->moments[cut * (body->order + 1) + l];
        sum += P * strained[body->angles[2] + l - 1];
    }
    return sign * torque_at(body, 0, strained) + body->rates[0] * sum;
}

/* Bending moment at an end without the work of the loads, and its sign: side 0 is the near end. */
static double end_bending(const FreeBody *body, int side, const double *strained, double work) {
    int last = body->order > 0 ? 0 : body->sections - 3;
    double torque = torque_at(body, side == 0 ? 0 : last, strained);
    double moment = (side == 0 ? -torque : torque) - work;
    bool at_start = (side == 0) == body->forwards;
    return at_start ? -moment : moment;
}

/* Force that the part of a flexure beyond section k transmits. */
static Complex force_through(const FreeBody *body, int k, const Complex *loads, Complex far) {
    Complex sum = far;
    for (int i = 0; i < body->count; i++) {
        double apart = body->ranks[i] - body->section_ranks[k];
        if (apart >= 0.0) {
            sum = plus(sum, scaled(apart == 0.0 ? 0.5 : 1.0, loads[body->first + i]));
        }
    }
    return sum;
}

static Complex tangent_arm(const Complex *e, const double *angle, int j) {
    Complex arm = {1.0, 0.0};
    if (j <= TURNED) {
        unit_vectors(1, angle + (TURNED - j), &arm);
        return arm;
    }
    return j == FIXED ? arm : e[j];
}

/* Sum of the two arms of the tangent of section k. */
static Complex tangent_at(const FreeBody *body, int k, const SectionState *at) {
    int a = body->tangents[2 * k], b = body->tangents[2 * k + 1];
    Complex first = product(body->drawn[2 * k], tangent_arm(at->e, at->q, a));
    return plus(first, product(body->drawn[2 * k + 1], tangent_arm(at->e, at->q, b)));
}

static int flexure_of(const System *system, const FreeBody *body) {
    return (int)(body - system->free_bodies);
}

/* Store the stress of both faces at section k from normal force and bending moment. */
static void store_faces(const FreeBody *body, int k, double tension, double bending, double *left,
                        double *right) {
    int i = body->forwards ? k : body->sections - 1 - k;
    double pulled = tension / body->area[k], bent = bending / body->modulus[k];
    left[i] = pulled - bent;
    right[i] = pulled + bent;
}

PRBM void face_stresses(const System *system, const FreeBody *body, const SectionState *at,
                        double *left, double *right) {
    int last = body->sections - 1;
    Complex far = at->far[flexure_of(system, body)];
    for (int k = 0; k <= last; k++) {
        double bending;
        if (k == 0 || k == last) {
            double work = end_work(body, k != 0, at->e, complex_of(1.0, 0.0), at->loads, far);
            bending = end_bending(body, k != 0, at->strained, work);
        } else {
            bending = bending_between(body, k, at->strained);
        }
        Complex tangent = tangent_at(body, k, at);
        Complex through = force_through(body, k, at->loads, far);
        double tension = product(conjugate(through), tangent).re / modulus(tangent);
        store_faces(body, k, tension, bending, left, right);
    }
}

PRBM void differences(int m, const double *x, double *c) {
    for (int k = 1; k < m; k++) {
        for (int i = m - 1; i >= k; i--) {
            c[i] = (c[i] - c[i - 1]) / (x[i] - x[i - k]);
        }
    }
}

PRBM Jet polynomial(int m, const double *x, const double *c, double s) {
    Jet at = {0.0, 0.0, 0.0};
    for (int i = m - 1; i >= 0; i--) {
        double apart = s - x[i];
        at.bend = at.bend * apart + 2.0 * at.slope;
        at.slope = at.slope * apart + at.value;
        at.value = at.value * apart + c[i];
    }
    return at;
}

PRBM bool summit(int m, const double *x, const double *c, double sign, double low, double high,
                 double *s) {
    double rise = polynomial(m, x, c, low).slope, fall;
    if (!(sign * rise > 0.0) || !(sign * (fall = polynomial(m, x, c, high).slope) < 0.0)) {
        return false;
    }
    *s = low + rise / (rise - fall) * (high - low);
    for (int step = 0; step < SUMMIT_STEPS; step++) {
        Jet at = polynomial(m, x, c, *s);
        if (!(sign * at.bend < 0.0)) {
            return true;
        }
        *s = lesser(greater(*s - at.slope / at.bend, low), high);
    }
    return true;
}

/* Position of section k, counted from the start. */
static double section_position(const FreeBody *body, int k) {
    return body->position[body->forwards ? k : body->sections - 1 - k];
}

/* Set the positions x and the divided differences c of a face at the nodes. */
static void set_polynomial(const FreeBody *body, const double *face, double *x, double *c) {
    for (int i = 0; i < body->smooth_count; i++) {
        x[i] = section_position(body, body->smooth + i);
        c[i] = face[body->smooth + i];
    }
    differences(body->smooth_count, x, c);
}

/* Raise the largest stress to that of a face between the nodes.  side: the sign of its place. */
static void raise_between(const FreeBody *body, const double *face, double side, double least,
                          Stress *found) {
    double x[NODES_MAX], c[NODES_MAX], s;
    int m = 0; /* none are set */
    for (int k = body->smooth; k < body->smooth + body->smooth_count; k++) {
        if (fabs(face[k]) < least) {
            continue;
        }
        if (m == 0) {
            m = body->smooth_count;
            set_polynomial(body, face, x, c);
        }
        double sign = face[k] < 0.0 ? -1.0 : 1.0;
        double low = section_position(body, k - 1), high = section_position(body, k + 1);
        if (summit(m, x, c, sign, low, high, &s)) {
            double size = sign * polynomial(m, x, c, s).value;
            if (size > (1.0 + STRESS_TIE_RTOL) * found->largest) {
                found->largest = size;
                found->place = side * (k + 1);
                found->position = s;
            }
        }
    }
}

PRBM Stress stress_in(const FreeBody *body, const double *left, const double *right) {
    int m = body->sections, k = 0;
    double most = 0.0;
    for (int i = 0; i < m; i++) {
        most = greater(most, greater(fabs(left[i]), fabs(right[i])));
    }
    double enough = (1.0 - STRESS_TIE_RTOL) * most;
    while (k < m - 1 && greater(fabs(left[k]), fabs(right[k])) < enough) {
        k++;
    }
    bool on_left = fabs(left[k]) >= (1.0 - STRESS_TIE_RTOL) * fabs(right[k]);
    Stress found = {left[0], left[m - 1], most, on_left ? k + 1 : -(k + 1),
                    section_position(body, k)};
    raise_between(body, left, 1.0, SUMMIT_SHARE_MIN * most, &found);
    raise_between(body, right, -1.0, SUMMIT_SHARE_MIN * most, &found);
    return found;
}

PRBM double stress_at(const FreeBody *body, const double *left, const double *right,
                      const Stress *found) {
    double x[NODES_MAX], c[NODES_MAX];
    const double *face = found->place > 0.0 ? left : right;
    int k = (int)fabs(found->place) - 1;
    if (found->position == section_position(body, k)) {
        return face[k];
    }
    set_polynomial(body, face, x, c);
    return polynomial(body->smooth_count, x, c, found->position).value;
}

PRBM Stress *take_stresses(Scratch *scratch, int count) {
    return (Stress *)take_matrix(scratch, count, sizeof(Stress) / sizeof(double));
}

PRBM void stresses(const Equations *eq, const Complex *e, const double *angle, const double *v,
                   const Evaluation *evaluation, Stress *found, Scratch scratch) {
    const System *system = eq->system;
    const Mechanism *m = system->mechanism;
    SectionState at = section_state(eq, e, angle, v, evaluation, &scratch);
    for (int i = 0, k = 0; i < m->flexure_count; i++) {
        if (has_stress(m, i)) {
            const FreeBody *body = &system->free_bodies[i];
            Scratch inner = scratch;
            size_t count = (size_t)body->sections;
            double *left = take(&inner, count), *right = take(&inner, count);
            face_stresses(system, body, &at, left, right);
            found[k++] = stress_in(body, left, right);
        }
    }
}

/* --- changes ---------------------------------------------------------------------------------- */

/* Change of the angle of the tangent of section k. */
static double tangent_change(const FreeBody *body, int k, const SectionState *at,
                             const SectionState *change) {
    Complex sum = tangent_at(body, k, at), moved = {0.0, 0.0};
    for (int side = 0; side < 2; side++) {
        int j = body->tangents[2 * k + side];
        Complex arm = {0.0, 0.0};
        if (j <= TURNED) {
            double dq = change->q[TURNED - j];
            Complex turned = tangent_arm(at->e, at->q, j);
            arm = complex_of(-turned.im * dq, turned.re * dq);
        } else if (j != FIXED) {
            arm = change->e[j];
        }
        moved = plus(moved, product(body->drawn[2 * k + side], arm));
    }
    double size = modulus(sum);
    return product(conjugate(sum), moved).im / (size * size);
}

PRBM void face_changes(const System *system, const FreeBody *body, const SectionState *at,
                       const SectionState *change, double *left, double *right) {
    int i = flexure_of(system, body), last = body->sections - 1;
    Complex far = at->far[i], dfar = change->far[i];
    for (int k = 0; k <= last; k++) {
        double bending;
        if (k == 0 || k == last) {
            Complex none = {0.0, 0.0}, one = {1.0, 0.0};
            double work = end_work(body, k != 0, change->e, none, at->loads, far) +
                          end_work(body, k != 0, at->e, one, change->loads, dfar);
            bending = end_bending(body, k != 0, change->strained, work);
        } else {
            bending = bending_between(body, k, change->strained);
        }
        Complex tangent = tangent_at(body, k, at);
        tangent = scaled(1.0 / modulus(tangent), tangent);
        double turn = tangent_change(body, k, at, change);
        Complex through = force_through(body, k, at->loads, far);
        Complex dthrough = force_through(body, k, change->loads, dfar);
        double tension = product(conjugate(dthrough), tangent).re -
                         turn * product(conjugate(through), tangent).im;
        store_faces(body, k, tension, bending, left, right);
    }
}
