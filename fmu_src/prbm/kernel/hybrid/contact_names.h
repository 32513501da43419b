/* Names of contacts in messages. */
#ifndef PRBM_CONTACT_NAMES_H
#define PRBM_CONTACT_NAMES_H

#include "hybrid/state.h"

enum { NAMES_LENGTH = PROBLEM_LENGTH / 2 };

typedef struct {
    char text[NAMES_LENGTH];
} ContactNames;

/* A failure of the choice of contact modes. */
typedef struct {
    const char *cause, *remedy;
} ContactFailure;

PRBM const char *contact_name(const Mechanism *m, int contact);
PRBM bool has_contact(int count, const int *contacts, int contact);
/* List the names of contacts; names that do not fit are replaced by "...". */
PRBM void list_contacts(const Mechanism *m, int count, const int *contacts, ContactNames *names);
/* Set the problem of contacts; return false. */
PRBM bool contacts_fail(const Simulation *sim, const ContactFailure *failure, int count,
                        const int *contacts, Problem *problem);
/* Set the problem of contacts without a solution, with the limit of a search that it ended: if guides
 * are at rest, all modes of the contacts at rest are tried, unless there are too many. */
PRBM bool contacts_jam(Simulation *sim, int count, const int *contacts, Problem *problem);

#endif
