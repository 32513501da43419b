/* Normal forces of contacts, and the forces of friction: the twin of their parts in mechanics/dynamics.py. */
#include <math.h>

#include "core/forces.h"
#include "core/friction.h"

PRBM double rub_limit(const Equations *equations, int i, const Complex *e) {
    const System *system = equations->system;
    const double *law = equations->rub_law + 3 * i;
    int points = system->mechanism->friction_count;
    Rows lifts = plain_rows(system, points, system->lifts, system->lifts_c);
    double lift = row_value(&lifts, i, e) + lifts.c[i];
    return law[0] * normal_force(lift, law[1], law[2]);
}

/* The force of a held stop. */
PRBM double stop_force(const Equations *eq, const double *lam, int stop) {
    return lam[normal_row(eq, stop)];
}

/* The force of a guide to its side. */
PRBM double side_force(const Equations *eq, const double *lam, int contact) {
    return eq->contacts.sides[contact - eq->system->s] * lam[normal_row(eq, contact)];
}

/* The friction force of a sticking contact. */
PRBM double stick_force(const Equations *eq, const double *lam, int contact) {
    return lam[eq->first_stick + place_in(eq->sticking, contact)];
}

/* The largest friction force of a contact, by Coulomb's law. */
PRBM double friction_limit(const Equations *eq, const Complex *e, const Evaluation *found,
                           int contact) {
    if (is_guide(eq->system, contact)) {
        double force = fabs(found->lam[normal_row(eq, contact)]);
        return friction_coefficient(eq, contact) * force;
    }
    if (!is_stop(eq->system, contact)) {
        return rub_limit(eq, contact - eq->system->s, e);
    }
    double force = is_held(&eq->contacts, contact) ? stop_force(eq, found->lam, contact)
                                                  : greater(found->pressure[contact], 0.0);
    return eq->stop_friction[contact] * force;
}

/* The friction force of a slipping contact along its direction. */
PRBM double slip_force(const Equations *eq, const Complex *e, const Evaluation *found,
                       int contact) {
    double most = is_guide(eq->system, contact)
                      ? friction_coefficient(eq, contact) * side_force(eq, found->lam, contact)
                      : friction_limit(eq, e, found, contact);
    return -slip_sign(eq->contacts.modes[contact]) * most;
}
