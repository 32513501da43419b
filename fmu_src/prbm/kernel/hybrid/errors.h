/* Errors and sizes of integration steps. */
#ifndef PRBM_ERRORS_H
#define PRBM_ERRORS_H

#include "hybrid/state.h"

PRBM double longest_step(const Simulation *sim);
PRBM double rounded_step(double h);
/* Return the difference of the solution of lower order at the end of the latest step, relative to
 * the state. */
PRBM double embedded_error(Simulation *sim);
/* Return the root mean square of the difference of two states, relative to the larger of them. */
PRBM double difference(Simulation *sim, const double *y, const double *z,
                       Scratch scratch);
/* Fail if a projection at time t has changed a state y too much. */
PRBM bool check_projection(Simulation *sim, double t, const double *y, const double *projected,
                           Scratch scratch, Problem *problem);
/* Return the error of the contacts in a step of size h, relative to their scales. */
PRBM double contact_error(Simulation *sim, double h);
/* Return the root mean square of an error x.  That of angles is in rad, that of rates and energies
 * relative to the larger of their sizes in y and y1. */
PRBM double error_norm(const Simulation *sim, const double *x, const double *y, const double *y1);

#endif
