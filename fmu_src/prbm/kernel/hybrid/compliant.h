/* Contacts at compliant stops. */
#ifndef PRBM_COMPLIANT_H
#define PRBM_COMPLIANT_H

#include "hybrid/state.h"

PRBM bool touch(Simulation *sim, int stop, Problem *problem); /* at first touch */
PRBM bool switch_phase(Simulation *sim, int stop, Problem *problem);
PRBM bool separate(Simulation *sim, int stop, Problem *problem); /* at the end of a contact */
/* Begin the contacts of stops that are penetrated at the start. */
PRBM bool preload(Simulation *sim, Problem *problem);
/* Settle the contacts at the front that have been calm for a contact time.  balances (s,): the
 * indentations at which the other calm contacts would be in balance, 0 for all other stops. */
PRBM bool freeze_calm(Simulation *sim, double *balances, Problem *problem);
/* Whether freeze_calm would freeze a contact in model exchange, where the front is the present. */
PRBM bool freezes_here(Simulation *sim, bool *result, Problem *problem);
/* Let the displacement of a wall by the force of its stop become its motion at time t; extra: the
 * states of the stop. */
PRBM void fold_recoil(Wall *wall, double t, double *extra);
PRBM void fold_recoils(Simulation *sim); /* of all compliant stops at the front */
/* The kinetic energy at the front with the rates v [J]. */
PRBM double kinetic_energy(Simulation *sim, const double *v, Scratch scratch);
/* Compute the rate at which the damping of a pressed contact changes its speed [1/s]. */
PRBM bool damping_rate(Simulation *sim, int stop, double depth, double *rate, Problem *problem);

#endif
