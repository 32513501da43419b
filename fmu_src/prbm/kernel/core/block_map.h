/* The map from coordinates to directions, block by block. */
#ifndef PRBM_BLOCK_MAP_H
#define PRBM_BLOCK_MAP_H

#include "core/system.h"

/* Set the maps of all blocks of directions from the factors of the system. */
PRBM void set_block_maps(System *system, Scratch *scratch);
/* Compute the directions, or their rates, out (d,) of coordinates or rates x (n,).  local (even,) is
 * working memory. */
PRBM void map_directions(const System *system, const double *x, double *local, double *out);
/* Add the derivatives by directions x (d,), pulled back to the coordinates, to out (n,). */
PRBM void pull_directions(const System *system, const double *x, double *local, double *out);
/* Add the symmetric mass matrix of a block of directions, of which the lower triangle is given, pulled
 * back to the coordinates, to the lower triangle of M (n, n).  local (size + 1, even) is working
 * memory. */
PRBM void pull_mass(const System *system, const BlockMap *map, const double *block, double *local,
                    double *M);

#endif
