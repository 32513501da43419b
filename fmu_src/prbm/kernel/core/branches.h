/* Branches: what the steps of the assembly add, from the ground outwards. */
#ifndef PRBM_BRANCHES_H
#define PRBM_BRANCHES_H

#include "core/collection.h"

/* Place the memory for all branches. */
PRBM void place_branches(System *system, Memory *memory);
/* Return the number of complex numbers for the motion of all roots. */
PRBM size_t root_count(const System *system);
PRBM void clear_branches(System *system);
/* Begin the branch of a step of the assembly, unless it adds no directions.  Systems without a map
 * have no branches. */
PRBM void begin_branch(System *system, int step);
/* Set the constants of all branches from the factors and masses of the system. */
PRBM void set_branches(System *system, Scratch scratch);

#endif
