/* Access to the parts of a simulation: its system, front, contacts and inputs. */
#ifndef PRBM_ACCESS_H
#define PRBM_ACCESS_H

#include "hybrid/state.h"

PRBM const System *system_of(const Simulation *sim);
PRBM int state_size(const Simulation *sim); /* ny = 2 n + 2 + 4 c */
/* The states of compliant stops in a state y (ny,): 4 of each, see core/dynamics.c. */
PRBM const double *extra_states(const Simulation *sim, const double *y);
PRBM int contact_count(const Simulation *sim);
/* What may have events of a kind: contacts or, numbered after them, springs. */
typedef struct {
    int first, end;
} ContactRange;
PRBM ContactRange contacts_of(const Simulation *sim, EventKind kind);
/* Return the contact problem at the angles q, valid until it is set up for others. */
PRBM ContactProblem *contact_problem_at(Simulation *sim, const double *q, Scratch scratch);
PRBM Complex *directions_at(const Simulation *sim, const double *q, Scratch *scratch);
PRBM void set_inputs(Simulation *sim); /* and the equations of the contacts */
PRBM void set_contacts(Simulation *sim, const ContactMode *modes);
PRBM void set_mode(Simulation *sim, int contact, ContactMode mode);
/* Record the communication step from the present time to another; return the recent
 * longest step. */
PRBM double pass_point(Simulation *sim, double time);
PRBM void forget_present(Simulation *sim); /* after a change of time, states or values */
PRBM void forget_outputs(Simulation *sim); /* after a change of the front or the equations */
/* Compute the gaps of all stops at the front, and their rates. */
PRBM void gaps_and_rates(Simulation *sim, double *gaps, double *rates);
PRBM double *extra_of(const Simulation *sim, double *y, int stop); /* states of a stop in y (ny,) */
PRBM void report_impact(const Simulation *sim, int i, const double *q, const double *v,
                        const double *after);
PRBM const Stop *stop_of(const Simulation *sim, int stop);

#endif
