/* The rows of guides, and the independence of loops and guides. */
#ifndef PRBM_GUIDES_H
#define PRBM_GUIDES_H

#include "core/system.h"

/* Add the guides behind the loop closures, those that only bodies that float move last. */
PRBM bool add_guides(System *system, Scratch scratch, Problem *problem);
/* Reject loops and guides that are not independent of each other in the drawn shape with the directions
 * e0. */
PRBM bool check_loops(const System *system, const Complex *e0, Scratch scratch, Problem *problem);

#endif
