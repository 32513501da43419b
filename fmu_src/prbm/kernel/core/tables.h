/* The reader of the tables of a mechanism. */
#ifndef PRBM_TABLES_H
#define PRBM_TABLES_H

#include "core/mechanism.h"

/* Read tables that anybody may have tampered with; NULL and a sentence if they are not sound.
 * The result is one block and keeps nothing of the bytes. */
PRBM Mechanism *mechanism_open(const unsigned char *bytes, size_t size, Problem *problem);
PRBM void mechanism_close(Mechanism *mechanism);

#endif
