/* Access to the parts of a simulation, and its start. */
#ifndef PRBM_HYBRID_SIMULATION_H
#define PRBM_HYBRID_SIMULATION_H

#include "hybrid/state.h"

PRBM int state_size(const Simulation *sim); /* ny = 2 n + 2 + 4 c */
/* The states of compliant stops in a state y (ny,): 4 of each, see core/dynamics.c. */
PRBM const double *extra_states(const Simulation *sim, const double *y);
PRBM const System *system_of(const Simulation *sim);
PRBM int contact_count(const Simulation *sim);
PRBM Complex *directions_at(Simulation *sim, const double *q); /* in working memory */
/* Return the contact problem at the angles q, valid until it is set up for others. */
PRBM ContactProblem *contact_problem_at(Simulation *sim, const double *q);
/* Record the communication step from the present time to another; return the recent
 * longest step. */
PRBM double pass_point(Simulation *sim, double time);
PRBM void set_inputs(Simulation *sim); /* and the equations of the contacts */
PRBM void set_contacts(Simulation *sim, const ContactMode *modes);
PRBM void set_mode(Simulation *sim, int contact, ContactMode mode);
/* Start the motion; the caller keeps a backup for the case of failure. */
PRBM bool start_motion(Simulation *sim, double start_time, double tolerance, SimulationMode mode,
                       Problem *problem);

#endif
