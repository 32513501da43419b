/* The assembly of the constant arrays from a mechanism and parameter values. */
#ifndef PRBM_ASSEMBLY_H
#define PRBM_ASSEMBLY_H

#include "core/system.h"

PRBM bool assemble(System *system, const double *values, Scratch scratch, Problem *problem);

#endif
