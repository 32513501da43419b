/* The order of the assembly, the coordinates, and the positions of inputs and values. */
#ifndef PRBM_LAYOUT_H
#define PRBM_LAYOUT_H

#include "core/mechanism.h"
#include "core/reader.h"

PRBM void count_coordinates(Reader *reader, Mechanism *m);
PRBM void lay_out_coordinates(Reader *reader, Mechanism *m);
PRBM void lay_out_inputs(Mechanism *m);
PRBM void lay_out_slots(Mechanism *m);

#endif
