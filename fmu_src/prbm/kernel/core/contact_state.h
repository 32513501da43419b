/* Modes of the contacts. */
#ifndef PRBM_CONTACT_STATE_H
#define PRBM_CONTACT_STATE_H

#include "core/constraints.h"

/* Contacts are numbered in one list: the stops, then the friction points, which are never open.
 * CONTACT_FRICTIONLESS is a closed contact without friction, or a contact that cannot slide
 * independently of other contacts. */
PRBM int slip_sign(ContactMode mode); /* Sign of the sliding velocity: -1, 0 or +1. */

typedef struct {
    ContactMode *modes; /* (s + f,) */
} ContactState;
PRBM ContactMode slipping_mode(double sign);
PRBM bool is_stop(const System *system, int contact);
PRBM Rows tangential_rows(const System *system, int contact, int *i);
PRBM void tangential_row(const System *system, int contact, const Complex *e, double *row);
PRBM double sliding_velocity(const System *system, int contact, const Complex *e,
                             const double *v);
PRBM double tangential_convective(const System *system, int contact, const Complex *e,
                                  const double *v);

#endif
