/* Error messages, blocks of memory and scratch. */
#ifndef PRBM_MEMORY_H
#define PRBM_MEMORY_H

#include "core/numbers.h"

enum { PROBLEM_LENGTH = 640 };

typedef struct {
    char text[PROBLEM_LENGTH];
} Problem;

/* Write an error message and return false. */
#if defined(__GNUC__)
PRBM bool fail(Problem *problem, const char *format, ...) __attribute__((format(printf, 2, 3)));
/* Add a sentence to an error message, after a semicolon, and return false. */
PRBM bool fail_further(Problem *problem, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
#else
PRBM bool fail(Problem *problem, const char *format, ...);
PRBM bool fail_further(Problem *problem, const char *format, ...);
#endif

/* A block of memory.  A first layout with base NULL counts its bytes, a second places its parts. */
typedef struct {
    char *base;
    size_t used;
} Memory;

/* Of the parts [B]. */
enum { ALIGNMENT = 16 };

PRBM void *place(Memory *memory, size_t count, size_t size);

/* A block of working memory.  A request that exceeds the rest gets the spare block, which is as
 * large as any single request, and exceeded is set.  The results are then invalid, but no other
 * memory is overwritten. */
typedef struct {
    double *base, *spare;
    size_t size, most;
    bool exceeded;
} ScratchBlock;

/* The rest of a block of working memory, which is taken in order.  A function gets a copy: what it
 * takes is free again when it returns.  It gets a pointer if what it takes is for its caller. */
typedef struct {
    ScratchBlock *block;
    size_t used;
} Scratch;

PRBM double *take(Scratch *scratch, size_t count);

PRBM double *take_matrix(Scratch *scratch, int rows, int columns);
PRBM Complex *take_complex(Scratch *scratch, int rows, int columns);
PRBM int *take_integers(Scratch *scratch, int count);
PRBM Parts place_parts(Memory *memory, size_t count);

#endif
