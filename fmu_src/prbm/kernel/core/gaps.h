/* Gaps of the stops, their rates and their accelerations. */
#ifndef PRBM_GAPS_H
#define PRBM_GAPS_H

#include "core/equations.h"
#include "core/evaluated.h"

/* The displacement of a wall by the force of its compliant stop, or its rate.  extra: the states of
 * compliant stops, or NULL for zeros. */
PRBM double recoil_of(const Equations *eq, int i, const double *extra, CompliantState which);
/* The gap of a stop, its rate and its acceleration; extra as above. */
PRBM double gap(const Equations *equations, int i, double t, const Complex *e,
                const double *extra);
PRBM double gap_rate(const Equations *equations, int i, double t, const Complex *e,
                     const double *v, const double *extra);
PRBM double gap_acceleration(const Equations *equations, int i, double t, const Complex *e,
                             const double *v, const Evaluation *found);

#endif
