/* Directional derivatives of the contacts at compliant stops. */
#ifndef PRBM_TANGENT_CONTACT_H
#define PRBM_TANGENT_CONTACT_H

#include "tangent_rows.h"

/* Compute the changes of the forces of pressed stops, and add those of their loads. */
PRBM void pressure_changes(const Tangent *t);
/* Change of the force of any stop. */
PRBM double stop_force_change(const Tangent *t, int stop);
/* Change of the power that a pressed stop dissipates without friction. */
PRBM double contact_loss_change(const Tangent *t, int stop);
/* Change of the elastic energy of all contacts. */
PRBM double contact_energy_change(const Tangent *t);
/* Changes of the values that are states of compliant stops (slots.count,), of their derivatives, and
 * of the forces of pressed stops; dx: the changes of the states. */
PRBM void contact_changes(const Tangent *t, const double *dx, double *out);
/* Changes of the indicators of a pressed stop. */
PRBM double separation_indicator_change(const Tangent *t, int stop);
PRBM double switch_indicator_change(const Tangent *t, int stop);

#endif
