/* Modes of the contacts. */
#ifndef PRBM_CONTACT_STATE_H
#define PRBM_CONTACT_STATE_H

#include "core/constraints.h"

/* Contacts are numbered in one list: the stops, then the friction points and the guides with friction,
 * which are never open.
 * CONTACT_FRICTIONLESS is a closed contact without friction, or a contact that cannot slide
 * independently of other contacts. */
PRBM int slip_sign(ContactMode mode); /* Sign of the sliding velocity: -1, 0 or +1. */

/* A contact at a compliant stop.  Its phase is PHASE_NONE at other stops.  A frozen stop whose
 * mode is CONTACT_OPEN has no force; this occurs only while modes are tried. */
typedef struct {
    Phase phase;
    double reference_speed, depth;
} ContactPhase;

typedef struct {
    ContactMode *modes; /* (s + f,) */
    ContactPhase *touching; /* (s,) */
    int *sides; /* (f,) to which a slipping guide pushes: 1 to the left of its line, or -1 */
    SpringPhase *coils;     /* (coils,) phases of the springs, if one acts on one side */
} ContactState;
PRBM bool is_pressed(const ContactPhase *touching);
PRBM bool is_held(const ContactState *contacts, int stop);
PRBM ContactMode slipping_mode(double sign);
PRBM bool is_stop(const System *system, int contact);
PRBM bool is_guide(const System *system, int contact);
PRBM Rows tangential_rows(const System *system, int contact, int *i);
PRBM void tangential_row(const System *system, int contact, const Complex *e, double *row);
PRBM double sliding_velocity(const System *system, int contact, const Complex *e,
                             const double *v);
PRBM double tangential_convective(const System *system, int contact, const Complex *e,
                                  const double *v);

#endif
