/* The mass matrix, the quadratic velocity terms, and the map to the directions, branch by branch. */
#ifndef PRBM_BRANCH_TERMS_H
#define PRBM_BRANCH_TERMS_H

#include "core/evaluated.h"

/* Compute the directions theta (d,) of the coordinates x (n,). */
PRBM void map_directions(const System *system, const double *x, double *theta);
/* Compute the directions and their rates from the coordinates and their rates. */
PRBM void map_motion(const System *system, Kinematics *at);
/* Add the derivatives x (r, wide) by the directions of a branch, pulled back to the coordinates, to
 * out (r, even). */
PRBM void branch_to_coordinates(const System *system, const Branch *branch, int r, const double *x,
                                double *out);
/* Compute the mass matrix of the coordinates.  Add the quadratic velocity terms to the loads, and
 * pull the loads back to the coordinates.  own (d,) is the diagonal of the mass matrix of the
 * directions. */
PRBM void branch_terms(const System *system, const double *own, Evaluation *result);

#endif
