/* Blocks of directions: their map from the coordinates, and their mass. */
#ifndef PRBM_BLOCK_MAP_H
#define PRBM_BLOCK_MAP_H

#include "core/evaluated.h"

/* Place the memory for the maps of all blocks, which belongs to the first map until it is
 * divided. */
PRBM void place_maps(System *system, Memory *memory);
/* Set the maps of all blocks of directions from the factors and masses of the system. */
PRBM void set_block_maps(System *system, Scratch *scratch);
/* Compute the directions, or their rates, out (d,) of coordinates or rates x (n,). */
PRBM void map_directions(const System *system, const double *x, double *out);
/* Compute the directions and their rates from the coordinates and their rates. */
PRBM void map_motion(const System *system, Kinematics *at);
/* Add the derivatives by directions x (r, wide), pulled back to the coordinates, to out
 * (r, even). */
PRBM void pull_directions(const System *system, int r, const double *x, double *out);
/* Add the mass matrix of a block of directions to that of the coordinates, below its diagonal, and
 * its quadratic velocity terms to the loads of the directions.  Pull its loads and r rows back to
 * the coordinates.  own (d,) is the diagonal of the mass matrix of the directions. */
PRBM void add_block_terms(const System *system, const BlockMap *map, const double *own, int r,
                          Evaluation *result);

#endif
