/* The reader of untrusted bytes. */
#ifndef PRBM_READER_H
#define PRBM_READER_H

#include "core/memory.h"

typedef struct {
    const unsigned char *at; /* the next byte */
    size_t left;             /* bytes that are left */
    const char *wrong; /* the first defect of the tables, or NULL */
    Memory memory;
    size_t room; /* bytes of the memory */
} Reader;
/* Return memory of the mechanism for count items of a size, or NULL if there is too little. */
PRBM void *kept(Reader *reader, size_t count, size_t size);
/* At a defect, each function sets reader->wrong and returns the smallest value or an empty text. */
PRBM uint32_t read_u32(Reader *reader);
PRBM double read_bound(Reader *reader);
PRBM double read_finite(Reader *reader);
PRBM const char *read_text(Reader *reader);
PRBM int read_index(Reader *reader, int from, int count);
PRBM bool read_flag(Reader *reader);
PRBM int read_count(Reader *reader, size_t bytes);

#endif
