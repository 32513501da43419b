/* Flexures as links or beams, added to the arrays of a mechanism. */
#ifndef PRBM_FLEXURES_H
#define PRBM_FLEXURES_H

#include "core/collection.h"

/* Add a flexure of which at least one body has been reached. */
PRBM bool walk_flexure(System *system, const Step *step, Scratch scratch, Problem *problem);

#endif
