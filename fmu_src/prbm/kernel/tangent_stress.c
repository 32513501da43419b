/* Directional derivatives of the stress of flexures. */
#include <string.h>

#include "core/friction.h"
#include "core/sections.h"
#include "core/vectors.h"
#include "tangent_contact.h"
#include "tangent_elements.h"
#include "tangent_stress.h"

/* Compute the changes of the loads of all mass points. */
static void load_changes(const Tangent *t, Complex *loads, Scratch scratch) {
    const System *system = t->eq->system;
    int d = system->d;
    const double *base = t->du + system->mechanism->input.base;
    Complex *bend = take_complex(&scratch, d, 1);
    for (int j = 0; j < d; j++) {
        Complex rate = scaled(t->eq->mass_damping, t->dswing[j]);
        bend[j] = plus(t->dbend[j], complex_of(-rate.im, rate.re));
    }
    for (int i = 0; i < system->p; i++) {
        Complex moved = along_arms(d, system->A + i * d, bend);
        loads[i] = scaled(-system->m[i], plus(complex_of(base[0], base[1]), moved));
    }
}

static void add_change(Complex *on, int body, Complex change) {
    on[body] = plus(on[body], change);
}

/* Add the changes of the forces of closed stops. */
static void stop_pull_changes(const Tangent *t, Complex *on) {
    const Equations *eq = t->eq;
    const System *system = eq->system;
    for (int k = 0; k < eq->held_count + eq->pressed_count; k++) {
        bool held = k < eq->held_count;
        int i = held ? eq->held[k] : eq->pressed[k - eq->held_count], carrier = system->on[i];
        const Stop *stop = &system->mechanism->stops[i];
        bool sticks = eq->contacts.modes[i] == CONTACT_STICK;
        double force = held ? stop_force(eq, t->lam, i) : t->evaluation->pressure[i];
        double dforce = stop_force_change(t, i);
        double along = sticks ? stick_force(eq, t->lam, i) : slip_force(eq, t->e, t->evaluation, i);
        double dalong = sticks ? stick_force(eq, t->dlam, i) : slip_force_change(t, i);
        Complex change = complex_of(-dforce, dalong);
        if (carrier != FIXED) {
            change = plus(product(t->e[carrier], change),
                          product(t->dE[carrier], complex_of(-force, along)));
        }
        change = product(unit(stop->direction), change);
        add_change(on, stop->body, change);
        add_change(on, stop->on, scaled(-1.0, change));
    }
}

/* Add the changes of the forces of guides and of their friction. */
static void guide_pull_changes(const Tangent *t, Complex *on) {
    const Equations *eq = t->eq;
    const System *system = eq->system;
    const Mechanism *m = system->mechanism;
    int contact = system->s + m->friction_count;
    for (int i = 0; i < m->guide_count; i++) {
        const GuideRows *guide = &system->guided[i];
        int carrier = system->loops_on[guide->across];
        Complex pull = complex_of(t->lam[guide->across], 0.0);
        Complex change = complex_of(t->dlam[guide->across], 0.0);
        if (m->guides[i].rubs) {
            bool sticks = eq->contacts.modes[contact] == CONTACT_STICK;
            pull.im = -(sticks ? stick_force(eq, t->lam, contact)
                               : slip_force(eq, t->e, t->evaluation, contact));
            change.im = -(sticks ? stick_force(eq, t->dlam, contact)
                                 : slip_force_change(t, contact));
            contact++;
        }
        if (carrier != FIXED) {
            change = plus(product(t->e[carrier], change), product(t->dE[carrier], pull));
        }
        change = product(guide->normal, change);
        add_change(on, m->guides[i].between.start, change);
        add_change(on, m->guides[i].between.end, scaled(-1.0, change));
    }
}

/* Add the changes of the forces of friction points and of the inputs. */
static void pull_changes(const Tangent *t, Complex *on) {
    const Equations *eq = t->eq;
    const System *system = eq->system;
    const Mechanism *m = system->mechanism;
    for (int i = 0; i < m->friction_count; i++) {
        int contact = system->s + i;
        bool sticks = eq->contacts.modes[contact] == CONTACT_STICK;
        double size = sticks ? stick_force(eq, t->dlam, contact) : slip_force_change(t, contact);
        Complex change = scaled(size, unit(m->frictions[i].direction));
        add_change(on, m->frictions[i].body, change);
        add_change(on, GROUND, scaled(-1.0, change));
    }
    for (int i = 0; i < m->force_count; i++) {
        const double *given = t->du + LOADS * i;
        add_change(on, m->forces[i].body, complex_of(given[0], given[1]));
    }
}

/* Compute the change of the state at which sections are loaded, in working memory. */
static SectionState state_change(const Tangent *t, Scratch *scratch) {
    const System *system = t->eq->system;
    double *strained = take(scratch, (size_t)system->n);
    SectionState change = {t->dE, t->dq, strained, take_complex(scratch, system->p, 1),
                           take_complex(scratch, system->b + 1, 1),
                           take_complex(scratch, system->mechanism->flexure_count, 1)};
    for (int j = 0; j < system->n; j++) {
        strained[j] = t->dq[j] + t->eq->beta * t->dv[j];
    }
    load_changes(t, change.loads, *scratch);
    change.on[GROUND] = complex_of(0.0, 0.0);
    for (int body = 1; body <= system->b; body++) {
        change.on[body] = change.loads[system->body_masses[body - 1]];
    }
    stop_pull_changes(t, change.on);
    pull_changes(t, change.on);
    spring_pull_changes(t, change.on);
    guide_pull_changes(t, change.on);
    transmit(system, t->dlam, &change);
    return change;
}

/* Compute the changes of the stress of a flexure. */
static void flexure_changes(const Tangent *t, const FreeBody *body, const SectionState *at,
                            const SectionState *change, double *out, Scratch scratch) {
    const System *system = t->eq->system;
    size_t m = (size_t)body->sections;
    double *left = take(&scratch, m), *right = take(&scratch, m);
    double *dleft = take(&scratch, m), *dright = take(&scratch, m);
    face_stresses(system, body, at, left, right);
    face_changes(system, body, at, change, dleft, dright);
    Stress found = stress_in(body, left, right);
    double stress = stress_at(body, left, right, &found);
    double dstress = stress_at(body, dleft, dright, &found);
    out[STRESS_STRESS_START] = dleft[0];
    out[STRESS_STRESS_END] = dleft[m - 1];
    out[STRESS_STRESS] = stress < 0.0 ? -dstress : dstress;
}

PRBM void stress_changes(const Tangent *t, double *out) {
    const System *system = t->eq->system;
    const Mechanism *m = system->mechanism;
    Scratch scratch = t->scratch;
    if (m->stressed_count == 0) {
        return;
    }
    SectionState at = section_state(t->eq, t->e, t->y, t->v, t->evaluation, &scratch);
    SectionState change = state_change(t, &scratch);
    for (int i = 0, k = 0; i < m->flexure_count; i++) {
        if (has_stress(m, i)) {
            flexure_changes(t, &system->free_bodies[i], &at, &change, out + PER_STRESS * k++,
                            scratch);
        }
    }
}
