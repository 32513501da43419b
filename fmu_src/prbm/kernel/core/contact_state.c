/* Modes of the contacts and their directions along the walls: the twin of contact_state.py. */
#include "core/contact_state.h"

PRBM int slip_sign(ContactMode mode) {
    return (mode == CONTACT_SLIP_POSITIVE) - (mode == CONTACT_SLIP_NEGATIVE);
}

PRBM ContactMode slipping_mode(double sign) {
    return sign > 0.0 ? CONTACT_SLIP_POSITIVE : CONTACT_SLIP_NEGATIVE;
}

/* Whether the contact is a force, not a constraint. */
PRBM bool is_pressed(const ContactPhase *touching) {
    return touching->phase == PHASE_PRESSED || touching->phase == PHASE_RISING ||
           touching->phase == PHASE_FREE;
}

/* Whether a stop is a constraint. */
PRBM bool is_held(const ContactState *contacts, int stop) {
    return contacts->modes[stop] != CONTACT_OPEN && !is_pressed(&contacts->touching[stop]);
}

PRBM bool is_stop(const System *system, int contact) {
    return contact < system->s;
}

PRBM bool is_guide(const System *system, int contact) {
    return contact >= system->s && system->normals[contact - system->s] != FIXED;
}

/* Return the rows that contain the sliding velocity of a contact; i is its index among them. */
PRBM Rows tangential_rows(const System *system, int contact, int *i) {
    *i = is_stop(system, contact) ? contact : contact - system->s;
    return is_stop(system, contact) ? slide_rows(system) : rub_rows(system);
}

PRBM void tangential_row(const System *system, int contact, const Complex *e, double *row) {
    int i;
    Rows rows = tangential_rows(system, contact, &i);
    row_jacobian(&rows, i, e, row);
}

PRBM double sliding_velocity(const System *system, int contact, const Complex *e,
                             const double *v) {
    int i;
    Rows rows = tangential_rows(system, contact, &i);
    return row_rate(&rows, i, e, v);
}

PRBM double tangential_convective(const System *system, int contact, const Complex *e,
                                  const double *v) {
    int i;
    Rows rows = tangential_rows(system, contact, &i);
    return row_convective(&rows, i, e, v);
}
