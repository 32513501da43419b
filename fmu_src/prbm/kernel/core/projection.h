/* Projection of a state onto the active constraints. */
#ifndef PRBM_PROJECTION_H
#define PRBM_PROJECTION_H

#include "core/equations.h"

PRBM bool project(Equations *equations, double t, double *y, Scratch *scratch, Problem *problem);
PRBM bool project_from_here(Equations *equations, double t, double *y, Scratch *scratch,
                            Problem *problem);

#endif
