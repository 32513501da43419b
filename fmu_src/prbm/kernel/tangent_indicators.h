/* Directional derivatives of the event indicators. */
#ifndef PRBM_TANGENT_INDICATORS_H
#define PRBM_TANGENT_INDICATORS_H

#include "tangent_rows.h"

/* Compute the changes of the indicators of all contacts that are watched. */
PRBM void indicator_changes(const Tangent *t, double *out);

#endif
