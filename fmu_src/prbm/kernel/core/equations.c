/* The equations of motion in one discrete state, with their rows, laws, loads and workspace: the
 * twin of Equations in mechanics/dynamics.py. */
#include <string.h>

#include "core/equations.h"
#include "core/forces.h"
#include "core/matrix.h"
#include "core/vectors.h"

PRBM void equations_place(Equations *equations, const System *system, Memory *memory) {
    size_t s = (size_t)system->s, f = (size_t)system->f;
    size_t r = (size_t)system->r + 2 * s + f, d = (size_t)system->d, wide = (size_t)system->wide;
    Equations q = {0};
    q.system = system;
    q.contacts.modes = place(memory, s + f, sizeof(ContactMode));
    q.contacts.touching = place(memory, s, sizeof(Touching));
    q.held = place(memory, s, sizeof(int));
    q.pressed = place(memory, s, sizeof(int));
    q.laws = place(memory, s, sizeof(ComplianceLaw));
    q.restitutions = place(memory, s, sizeof(double));
    q.sticking = place(memory, s + f, sizeof(int));
    q.slipping = place(memory, s + f, sizeof(int));
    q.stop_friction = place(memory, s, sizeof(double));
    q.rub_law = place(memory, 3 * f, sizeof(double));
    q.B = place(memory, r * d, sizeof(Complex));
    q.z = place(memory, r, sizeof(Complex));
    q.c = place(memory, r, sizeof(double));
    q.on = place(memory, r, sizeof(int));
    q.carried = place(memory, r, sizeof(int));
    q.w = place(memory, d, sizeof(Complex));
    q.w_input = place(memory, d, sizeof(Complex));
    q.moment = place(memory, wide, sizeof(double));
    q.B_conjugate = place_parts(memory, r * wide);
    q.w_parts = place_parts(memory, wide);
    *equations = q;
}

/* --- contacts --------------------------------------------------------------------------------- */

/* Append row i of some rows to the active rows, with the constant c. */
static void add_row(Equations *q, const Rows *rows, int i, double c) {
    int d = q->system->d, on = seen_from(rows, i);
    memcpy(q->B + q->r * d, rows->B + i * d, (size_t)d * sizeof *rows->B);
    q->c[q->r] = c;
    q->on[q->r] = on;
    if (on != FIXED) {
        q->z[q->r] = rows->z[i];
        q->carried[q->carried_count++] = q->r;
    }
    q->r++;
}

PRBM double friction_coefficient(const Equations *q, int contact) {
    return is_stop(q->system, contact) ? q->stop_friction[contact]
                                       : q->rub_law[3 * (contact - q->system->s)];
}

/* List the contacts that slip: held stops, then pressed stops and friction points. */
static void list_slipping(Equations *q) {
    const ContactMode *modes = q->contacts.modes;
    int s = q->system->s;
    q->slipping_count = 0;
    for (int k = 0; k < q->held_count; k++) {
        if (slip_sign(modes[q->held[k]]) != 0) {
            q->slipping[q->slipping_count++] = q->held[k];
        }
    }
    q->slipping_stops = q->slipping_count;
    for (int contact = 0; contact < s + q->system->f; contact++) {
        bool held = contact < s && is_held(&q->contacts, contact);
        if (!held && slip_sign(modes[contact]) != 0 && friction_coefficient(q, contact) > 0.0) {
            q->slipping[q->slipping_count++] = contact;
        }
    }
}

/* Set the active rows: those of the loops, of held stops and of sticking contacts. */
static void set_rows(Equations *q) {
    const System *system = q->system;
    Rows loops = plain_rows(system, system->r, system->loops, system->loops_c);
    Rows gaps = gap_rows(system), walls = slide_rows(system), rubs = rub_rows(system);
    q->r = q->carried_count = 0;
    for (int k = 0; k < system->r; k++) {
        add_row(q, &loops, k, system->loops_c[k]);
    }
    q->first_hold = q->r;
    q->held_count = q->sticking_count = q->pressed_count = 0;
    for (int i = 0; i < system->s; i++) {
        const Touching *touching = &q->contacts.touching[i];
        if (is_held(&q->contacts, i)) {
            double depth = touching->phase == PHASE_SETTLED ? touching->depth : 0.0;
            q->held[q->held_count++] = i;
            add_row(q, &gaps, i, system->gaps_c[i] + q->inputs.walls[i].position + depth);
        } else if (is_pressed(touching)) {
            q->pressed[q->pressed_count++] = i;
        }
    }
    q->first_stick = q->r;
    for (int contact = 0; contact < system->s + system->f; contact++) {
        int point = contact - system->s;
        if (q->contacts.modes[contact] == CONTACT_STICK) {
            q->sticking[q->sticking_count++] = contact;
            add_row(q, point < 0 ? &walls : &rubs, point < 0 ? contact : point, 0.0);
        }
    }
    list_slipping(q);
    Rows active = {system, q->r, q->B, q->c, q->z, q->on};
    q->active = active;
}

/* Set the real and imaginary parts of the rows, with columns for stretches, padded. */
static void set_row_parts(Equations *q) {
    int d = q->system->d, wide = q->system->wide;
    for (int k = 0; k < q->r; k++) {
        spread(q->system, 1, q->B + k * d, q->w); /* w is free memory here. */
        pad_parts(d, q->w, parts_from(q->B_conjugate, k * wide));
    }
    for (int i = 0; i < q->r * wide; i++) {
        q->B_conjugate.im[i] = -q->B_conjugate.im[i];
    }
}

/* Return the position of an index in a list that contains it. */
PRBM int place_in(const int *list, int index) {
    int k = 0;
    while (list[k] != index) {
        k++;
    }
    return k;
}

/* Return the position of a held stop in the list of held stops. */
PRBM int held_at(const Equations *q, int stop) {
    return place_in(q->held, stop);
}

static void set_laws(Equations *q) {
    const Mechanism *m = q->system->mechanism;
    const double *values = q->system->values;
    q->beta = values[m->damping_beta];
    q->mass_damping = 2.0 * values[m->damping_zeta] * q->omega;
    for (int i = 0; i < m->stop_count; i++) {
        const Stop *stop = &m->stops[i];
        q->stop_friction[i] = evaluate(stop->friction, values);
        if (stop->compliant) {
            q->laws[i].stiffness = evaluate(stop->stiffness, values);
            q->laws[i].exponent = evaluate(stop->exponent, values);
            double restitution = evaluate(stop->restitution, values);
            if (restitution != q->restitutions[i]) {
                q->laws[i].damping = damping_factor(restitution);
                q->restitutions[i] = restitution;
            }
        }
    }
    for (int i = 0; i < m->friction_count; i++) {
        q->rub_law[3 * i] = evaluate(m->frictions[i].coefficient, values);
        q->rub_law[3 * i + 1] = evaluate(m->frictions[i].normal_force, values);
        q->rub_law[3 * i + 2] = evaluate(m->frictions[i].normal_stiffness, values);
    }
}

static void set_loads(Equations *q) {
    const System *system = q->system;
    const Mechanism *m = system->mechanism;
    int d = system->d;
    zeros(system->wide, q->moment);
    field_row(d, system->S, scaled(-1.0, q->inputs.base), q->w_input);
    for (int i = 0; i < m->force_count; i++) {
        const BodyFrame *frame = &system->pushed[i];
        const double *given = q->inputs.forces + LOADS * i;
        force_row(d, frame->A, complex_of(given[0], given[1]), q->w);
        for (int j = 0; j < d; j++) {
            q->w_input[j] = plus(q->w_input[j], q->w[j]);
        }
        q->moment[frame->arm] += given[2];
    }
    spread(system, 1, q->w_input, q->w_input);
    field_row(d, system->S, system->gravity, q->w);
    spread(system, 1, q->w, q->w);
    q->driven = false;
    for (int j = 0; j < d; j++) {
        q->w[j] = plus(q->w_input[j], q->w[j]);
        q->driven = q->driven || q->w_input[j].re != 0.0 || q->w_input[j].im != 0.0 ||
                    q->moment[j] != 0.0;
    }
    pad_parts(d, q->w, q->w_parts);
    q->walls_move = false;
    for (int i = 0; i < system->s; i++) {
        const Wall *wall = &q->inputs.walls[i];
        q->walls_move = q->walls_move || wall->rate != 0.0 || wall->span > 0.0;
    }
    q->walls_give = false;
    for (int i = 0; m->compliant_count > 0 && i < system->s; i++) {
        bool gives = m->stops[i].compliant && q->inputs.mobilities[i] > 0.0;
        q->walls_give = q->walls_give || gives;
    }
    q->driven = q->driven || q->walls_move || m->compliant_count > 0;
    q->more_powers = q->driven || q->slipping_count > 0 || q->mass_damping != 0.0;
    q->contacts_or_walls = q->walls_move || q->slipping_count > 0 || q->pressed_count > 0;
}

PRBM void set_equations(Equations *equations, const Inputs *inputs,
                        const ContactState *contacts, double omega) {
    Equations *q = equations;
    size_t count = (size_t)(q->system->s + q->system->f);
    q->inputs = *inputs;
    q->omega = omega;
    memmove(q->contacts.modes, contacts->modes, count * sizeof(ContactMode));
    memmove(q->contacts.touching, contacts->touching, (size_t)q->system->s * sizeof(Touching));
    set_laws(q);
    set_rows(q);
    set_row_parts(q);
    set_loads(q);
}

/* --- walls ------------------------------------------------------------------------------------ */

/* With s = (t - since) / span:
 *     x = reference + (1 - s)^2 (offset + (2 offset + excess span) s).
 * At the end of the cubic the wall is to be replaced by its reference. */
PRBM WallMotion wall_motion(const Wall *wall, double t) {
    double tau = t - wall->since, T = wall->span, x = wall->position + wall->rate * tau;
    if (T == 0.0) {
        return (WallMotion){x, wall->rate, 0.0};
    }
    double s = tau / T, left = 1.0 - s, slope = 2.0 * wall->offset + wall->excess * T;
    double ahead = wall->offset + slope * s;
    double v = wall->rate + left * (left * slope - 2.0 * ahead) / T;
    return (WallMotion){x + left * left * ahead, v, (2.0 * ahead - 4.0 * left * slope) / (T * T)};
}

PRBM bool held_stop(const Equations *equations, int contact) {
    return is_stop(equations->system, contact) && is_held(&equations->contacts, contact);
}
