/* Modes of the contacts. */
#ifndef PRBM_CONTACT_STATE_H
#define PRBM_CONTACT_STATE_H

#include "core/constraints.h"

/* Contacts are numbered in one list: the stops, then the friction points, which are never open.
 * CONTACT_FRICTIONLESS is a closed contact without friction, or whose load other contacts carry. */
PRBM int slip_sign(int mode); /* Sign of the sliding velocity: -1, 0 or +1. */

typedef struct {
    int *modes; /* (s + f,) */
} ContactState;

#endif
