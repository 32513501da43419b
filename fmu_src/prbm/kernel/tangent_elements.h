/* Changes of the forces, energies and losses of elements with energy along a tangent. */
#ifndef PRBM_TANGENT_ELEMENTS_H
#define PRBM_TANGENT_ELEMENTS_H

#include "tangent_rows.h"

/* Add the changes of the forces of all elements and their damping to the loads. */
PRBM void element_change(const Tangent *t);
PRBM double element_energy_change(const Tangent *t);
/* Change of the power that damping dissipates. */
PRBM double element_loss_change(const Tangent *t);
/* Changes of the strain of a spring that acts on one side, of its rate and of its acting force. */
typedef struct {
    double strain, rate, force;
} CoilChange;
PRBM CoilChange coil_change(const Tangent *t, int k);
/* Set the changes of the outputs of springs. */
PRBM void spring_changes(const Tangent *t, double *out);
/* Add the changes of the forces of springs on the bodies and the ground (b + 1,). */
PRBM void spring_pull_changes(const Tangent *t, Complex *on);

#endif
