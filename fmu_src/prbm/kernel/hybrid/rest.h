/* Forces of all contacts at rest together, and their names. */
#ifndef PRBM_REST_H
#define PRBM_REST_H

#include "hybrid/state.h"

enum { CONTACTS_MAX = 2 * STOPS_MAX };

/* stops: stops that touch, with the signs of their sliding velocities.  contacts: those of these
 * stops, of the friction points and of the guides that have friction and do not slide. */
typedef struct {
    int stop_count, stops[STOPS_MAX], slips[STOPS_MAX];
    int count, contacts[CONTACTS_MAX];
} RestContacts;

/* Forces of RestContacts.  normal: acceleration of each gap by its normal force alone; friction and
 * limit: forces; pushing: those of guides to the left of their lines; slide: accelerations of sliding; mobility: their changes by unit forces. */
typedef struct {
    bool solved;
    double normal[STOPS_MAX];
    double friction[CONTACTS_MAX], limit[CONTACTS_MAX], slide[CONTACTS_MAX];
    double mobility[CONTACTS_MAX], pushing[CONTACTS_MAX];
    double *W; /* (k + m, k + m) accelerations of gaps and of sliding by unit forces */
} RestForces;

/* Compute the forces that satisfy the laws of all contacts; solved is false if there are none.  In
 * the trial equations all stops must be open, and friction points at rest without friction.  */
PRBM bool rest_forces(Simulation *sim, const double *q, const double *v,
                      const RestContacts *rest, RestForces *found, Problem *problem);

/* Whether a friction force reaches its limit up to a round-off zero [m/s^2]. */
PRBM bool at_limit(const RestForces *found, int j, double zero);
/* Choose the contacts at rest that stick, independent of each other, see hybrid/rest.py, and change
 * the friction forces accordingly.
 *
 * holds: the stops that hold, (k,)
 * candidates: indices of contacts that may stick, in the order of preference
 * leaves: those which slip if they are at their limits, (m,)
 * sticks: the result, (m,) */
PRBM void choose_sticking(const RestContacts *rest, RestForces *found, const bool *holds, int count,
                          const int *candidates, const bool *leaves, double zero, bool *sticks,
                          Scratch scratch);

#endif
