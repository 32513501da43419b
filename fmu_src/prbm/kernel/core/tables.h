/* The reader of the tables of a mechanism. */
#ifndef PRBM_TABLES_H
#define PRBM_TABLES_H

#include "core/mechanism.h"

/* Read untrusted tables; return NULL and a problem if they are invalid.  The result is one block
 * without pointers to the bytes. */
PRBM Mechanism *mechanism_open(const unsigned char *bytes, size_t size, Problem *problem);
PRBM void mechanism_close(Mechanism *mechanism);
PRBM uint32_t checksum(const unsigned char *bytes, size_t size);

#endif
