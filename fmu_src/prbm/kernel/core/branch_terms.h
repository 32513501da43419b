/* The mass matrix, the quadratic velocity terms, and the map to the directions, branch by branch. */
#ifndef PRBM_BRANCH_TERMS_H
#define PRBM_BRANCH_TERMS_H

#include "core/evaluated.h"

/* Compute the directions theta (d,) of the coordinates x (n,). */
PRBM void map_directions(const System *system, const double *x, double *theta);
/* Compute the directions and their rates from the coordinates and their rates. */
PRBM void map_motion(const System *system, Kinematics *at);
/* Add the derivatives x (d,) by the directions of a branch, pulled back to the coordinates, to out
 * (n,). */
PRBM void branch_to_coordinates(const Branch *branch, const double *x, double *out);
/* Compute the mass matrix of the coordinates.  Add the quadratic velocity terms to the loads, and
 * add the loads, and the first r rows, pulled back to the coordinates.  own (d,) is the diagonal of
 * the mass matrix of the directions. */
PRBM void branch_terms(const System *system, const double *own, int r, Evaluation *result);

#endif
