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
    q.contacts.touching = place(memory, s, sizeof(ContactPhase));
    q.contacts.sides = place(memory, f, sizeof(int));
    q.contacts.coils = place(memory, (size_t)phased_coils(system->mechanism), sizeof(SpringPhase));
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
    q.intervals = place_intervals(system, r, memory);
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
static void add_row(Equations *eq, const Rows *rows, int i, double c) {
    int d = eq->system->d, on = seen_from(rows, i);
    memcpy(eq->B + eq->r * d, rows->B + i * d, (size_t)d * sizeof *rows->B);
    eq->c[eq->r] = c;
    eq->on[eq->r] = on;
    if (on != FIXED) {
        eq->z[eq->r] = rows->z[i];
        eq->carried[eq->carried_count++] = eq->r;
    }
    eq->r++;
}

PRBM double friction_coefficient(const Equations *eq, int contact) {
    return is_stop(eq->system, contact) ? eq->stop_friction[contact]
                                       : eq->rub_law[3 * (contact - eq->system->s)];
}

/* List the contacts that slip: held stops, guides, then pressed stops and friction points. */
static void list_slipping(Equations *eq) {
    const ContactMode *modes = eq->contacts.modes;
    int s = eq->system->s;
    eq->slipping_count = 0;
    for (int k = 0; k < eq->held_count; k++) {
        if (slip_sign(modes[eq->held[k]]) != 0) {
            eq->slipping[eq->slipping_count++] = eq->held[k];
        }
    }
    int stops = eq->slipping_count;
    for (int contact = s; contact < s + eq->system->f; contact++) {
        if (is_guide(eq->system, contact) && slip_sign(modes[contact]) != 0) {
            eq->slipping[eq->slipping_count++] = contact;
        }
    }
    eq->slipping_rows = eq->slipping_count;
    eq->slipping_guides = eq->slipping_rows - stops;
    for (int contact = 0; contact < s + eq->system->f; contact++) {
        bool held = contact < s ? is_held(&eq->contacts, contact) : is_guide(eq->system, contact);
        if (!held && slip_sign(modes[contact]) != 0 && friction_coefficient(eq, contact) > 0.0) {
            eq->slipping[eq->slipping_count++] = contact;
        }
    }
}

/* Set the active rows: those of the loops, of held stops and of sticking contacts. */
static void set_rows(Equations *eq) {
    const System *system = eq->system;
    Rows loops = loop_rows(system);
    Rows gaps = gap_rows(system), walls = slide_rows(system), rubs = rub_rows(system);
    eq->r = eq->carried_count = 0;
    for (int k = 0; k < system->r; k++) {
        add_row(eq, &loops, k, system->loops_c[k]);
    }
    eq->first_hold = eq->r;
    eq->held_count = eq->sticking_count = eq->pressed_count = 0;
    for (int i = 0; i < system->s; i++) {
        const ContactPhase *touching = &eq->contacts.touching[i];
        if (is_held(&eq->contacts, i)) {
            double depth = touching->phase == PHASE_FROZEN ? touching->depth : 0.0;
            eq->held[eq->held_count++] = i;
            add_row(eq, &gaps, i, system->gaps_c[i] + eq->inputs.walls[i].position + depth);
        } else if (is_pressed(touching)) {
            eq->pressed[eq->pressed_count++] = i;
        }
    }
    eq->first_stick = eq->r;
    for (int contact = 0; contact < system->s + system->f; contact++) {
        int point = contact - system->s;
        if (eq->contacts.modes[contact] == CONTACT_STICK) {
            eq->sticking[eq->sticking_count++] = contact;
            add_row(eq, point < 0 ? &walls : &rubs, point < 0 ? contact : point, 0.0);
        }
    }
    list_slipping(eq);
    Rows active = {system, eq->r, eq->B, eq->c, eq->z, eq->on};
    eq->active = active;
    eq->dense = eq->r <= SMALL || eq->slipping_rows > 0;
    set_intervals(&active, eq->dense, &eq->intervals);
}

/* Set the real and imaginary parts of the rows, with columns for stretches, padded. */
static void set_row_parts(Equations *eq) {
    int d = eq->system->d, wide = eq->system->wide;
    for (int k = 0; k < eq->r; k++) {
        repeat_columns(eq->system, 1, eq->B + k * d, eq->w); /* w is free memory here. */
        pad_parts(d, eq->w, parts_from(eq->B_conjugate, k * wide));
    }
    for (int i = 0; i < eq->r * wide; i++) {
        eq->B_conjugate.im[i] = -eq->B_conjugate.im[i];
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
PRBM int held_at(const Equations *eq, int stop) {
    return place_in(eq->held, stop);
}

PRBM int normal_row(const Equations *eq, int contact) {
    return is_stop(eq->system, contact) ? eq->first_hold + held_at(eq, contact)
                                        : eq->system->normals[contact - eq->system->s];
}

static void set_laws(Equations *eq) {
    const Mechanism *m = eq->system->mechanism;
    const double *values = eq->system->values;
    eq->beta = values[m->damping_beta];
    eq->mass_damping = 2.0 * values[m->damping_zeta] * eq->omega;
    for (int i = 0; i < m->stop_count; i++) {
        const Stop *stop = &m->stops[i];
        eq->stop_friction[i] = evaluate(stop->friction, values);
        if (stop->compliant) {
            eq->laws[i].stiffness = evaluate(stop->stiffness, values);
            eq->laws[i].exponent = evaluate(stop->exponent, values);
            double restitution = evaluate(stop->restitution, values);
            if (restitution != eq->restitutions[i]) {
                eq->laws[i].damping = damping_factor(restitution);
                eq->restitutions[i] = restitution;
            }
        }
    }
    for (int i = 0; i < m->friction_count; i++) {
        eq->rub_law[3 * i] = evaluate(m->frictions[i].coefficient, values);
        eq->rub_law[3 * i + 1] = evaluate(m->frictions[i].normal_force, values);
        eq->rub_law[3 * i + 2] = evaluate(m->frictions[i].normal_stiffness, values);
    }
    for (int i = 0, k = m->friction_count; i < m->guide_count; i++) {
        if (m->guides[i].rubs) {
            double *law = eq->rub_law + 3 * k++;
            law[0] = evaluate(m->guides[i].friction, values);
            law[1] = law[2] = 0.0;
        }
    }
}

static void set_loads(Equations *eq) {
    const System *system = eq->system;
    const Mechanism *m = system->mechanism;
    int d = system->d;
    zeros(system->wide, eq->moment);
    field_row(d, system->S, scaled(-1.0, eq->inputs.base), eq->w_input);
    for (int i = 0; i < m->force_count; i++) {
        const BodyFrame *frame = &system->pushed[i];
        const double *given = eq->inputs.forces + LOADS * i;
        force_row(d, frame->A, complex_of(given[0], given[1]), eq->w);
        for (int j = 0; j < d; j++) {
            eq->w_input[j] = plus(eq->w_input[j], eq->w[j]);
        }
        eq->moment[frame->arm] += given[2];
    }
    repeat_columns(system, 1, eq->w_input, eq->w_input);
    field_row(d, system->S, system->gravity, eq->w);
    repeat_columns(system, 1, eq->w, eq->w);
    eq->driven = false;
    for (int j = 0; j < d; j++) {
        eq->w[j] = plus(eq->w_input[j], eq->w[j]);
        eq->driven = eq->driven || eq->w_input[j].re != 0.0 || eq->w_input[j].im != 0.0 ||
                    eq->moment[j] != 0.0;
    }
    pad_parts(d, eq->w, eq->w_parts);
    eq->walls_move = false;
    for (int i = 0; i < system->s; i++) {
        const Wall *wall = &eq->inputs.walls[i];
        eq->walls_move = eq->walls_move || wall->rate != 0.0 || wall->span > 0.0;
    }
    eq->walls_recoil = false;
    for (int i = 0; m->compliant_count > 0 && i < system->s; i++) {
        bool recoils = m->stops[i].compliant && eq->inputs.mobilities[i] > 0.0;
        eq->walls_recoil = eq->walls_recoil || recoils;
    }
    eq->driven = eq->driven || eq->walls_move || m->compliant_count > 0;
    eq->more_powers = eq->driven || eq->slipping_count > 0 || eq->mass_damping != 0.0;
    eq->contacts_or_walls = eq->walls_move || eq->slipping_count > 0 || eq->pressed_count > 0;
}

PRBM void set_equations(Equations *equations, const Inputs *inputs,
                        const ContactState *contacts, double omega) {
    Equations *eq = equations;
    size_t count = (size_t)(eq->system->s + eq->system->f);
    eq->inputs = *inputs;
    eq->omega = omega;
    memmove(eq->contacts.modes, contacts->modes, count * sizeof(ContactMode));
    memmove(eq->contacts.touching, contacts->touching, (size_t)eq->system->s * sizeof(ContactPhase));
    memmove(eq->contacts.sides, contacts->sides, (size_t)eq->system->f * sizeof(int));
    if (eq->system->mechanism->one_sided_count > 0) {
        memmove(eq->contacts.coils, contacts->coils,
                (size_t)eq->system->coil_count * sizeof(SpringPhase));
    }
    set_laws(eq);
    set_rows(eq);
    set_row_parts(eq);
    set_loads(eq);
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
