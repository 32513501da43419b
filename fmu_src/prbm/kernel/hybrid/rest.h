/* Forces of all contacts at rest together, and their names. */
#ifndef PRBM_REST_H
#define PRBM_REST_H

#include "hybrid/state.h"

enum { CONTACTS_MAX = 2 * STOPS_MAX, NAMES_LENGTH = PROBLEM_LENGTH / 2 };

/* Stops that touch, with the signs of their sliding velocities; contacts with friction and without
 * a sliding velocity, which are some of these stops, and friction points. */
typedef struct {
    int stop_count, stops[STOPS_MAX], slips[STOPS_MAX];
    int count, contacts[CONTACTS_MAX];
} RestContacts;

/* Their forces and accelerations: the acceleration that each normal force alone gives its gap; the
 * friction and its limits; the accelerations of sliding, and those by unit friction (mobility). */
typedef struct {
    bool solved;
    double normal[STOPS_MAX];
    double friction[CONTACTS_MAX], limit[CONTACTS_MAX], slide[CONTACTS_MAX];
    double mobility[CONTACTS_MAX];
} RestForces;

typedef struct {
    char text[NAMES_LENGTH];
} ContactNames;

/* The forces that satisfy the laws of all contacts; not solved without such forces.  In the trial
 * equations all stops must be open, and friction points at rest have no friction. */
PRBM bool rest_forces(Simulation *sim, const double *q, const double *v,
                      const RestContacts *rest, RestForces *found, Problem *problem);
PRBM const char *contact_name(const Mechanism *m, int contact);
PRBM bool has_contact(int count, const int *contacts, int contact);
/* The names of contacts, or as many of them as there is room for. */
PRBM void list_contacts(const Mechanism *m, int count, const int *contacts, ContactNames *names);
/* Set the problem of contacts whose laws no forces satisfy; return false. */
PRBM bool contacts_jammed(const Simulation *sim, int count, const int *contacts, Problem *problem);
/* Set the problem of contacts whose modes change with each projection; return false. */
PRBM bool contacts_unsettled(const Simulation *sim, int count, const int *contacts,
                             Problem *problem);

#endif
