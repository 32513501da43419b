/* Branches: flexures and bodies, from the ground outwards. */
#ifndef PRBM_BRANCHES_H
#define PRBM_BRANCHES_H

#include "core/system.h"

/* Place the memory for all branches. */
PRBM void place_branches(System *system, Memory *memory);
/* Return the number of complex numbers for the motion of all roots. */
PRBM size_t root_count(const System *system);
/* Begin a branch with the directions from start to end, at a root on the branch parent, or on the
 * ground if parent is FIXED; return its index.  Systems without a map have no branches. */
PRBM int add_branch(System *system, int parent, int start, int end, const Place *root);
/* Set the constants of all branches from the factors and masses of the system. */
PRBM void set_branches(System *system, Scratch *scratch);

#endif
