/* Directional derivatives of the stress of flexures. */
#ifndef PRBM_TANGENT_STRESS_H
#define PRBM_TANGENT_STRESS_H

#include "tangent_rows.h"

/* Compute the changes of the stress of flexures; those of its peaks are zero. */
PRBM void stress_changes(const Tangent *t, double *out);

#endif
