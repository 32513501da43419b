/* The memory of the constant arrays of a mechanism. */
#ifndef PRBM_PLACEMENT_H
#define PRBM_PLACEMENT_H

#include "core/system.h"

PRBM void system_place(System *system, const Mechanism *mechanism, Memory *memory);

#endif
