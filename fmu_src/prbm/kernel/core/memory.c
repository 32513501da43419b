/* Memory: blocks that are laid out once, and scratch that is taken and released. */
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "core/memory.h"


PRBM bool fail(Problem *problem, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    (void)vsnprintf(problem->text, sizeof problem->text, format, arguments);
    va_end(arguments);
    return false;
}

PRBM bool fail_further(Problem *problem, const char *format, ...) {
    size_t length = strlen(problem->text);
    va_list arguments;
    (void)snprintf(problem->text + length, sizeof problem->text - length, "; ");
    length = strlen(problem->text);
    va_start(arguments, format);
    (void)vsnprintf(problem->text + length, sizeof problem->text - length, format, arguments);
    va_end(arguments);
    return false;
}

/* Return the next part of a block, aligned for every type, or NULL if only bytes are counted.  If
 * the size of the block exceeds size_t, it becomes SIZE_MAX, which cannot be allocated. */
PRBM void *place(Memory *memory, size_t count, size_t size) {
    size_t start = memory->used;
    size_t room = SIZE_MAX - start;
    if (room < ALIGNMENT || (size > 0 && count > (room - ALIGNMENT) / size)) {
        memory->used = SIZE_MAX;
        return NULL;
    }
    memory->used += (count * size + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT;
    return memory->base == NULL ? NULL : memory->base + start;
}

/* Requests beyond the size are counted, too: most becomes a size that is sufficient. */
PRBM double *take(Scratch *scratch, size_t count) {
    ScratchBlock *block = scratch->block;
    double *taken = block->base + scratch->used;
    bool enough = scratch->used <= block->size && count <= block->size - scratch->used;
    if (!enough) {
        taken = block->spare;
        block->exceeded = true;
    }
    scratch->used += count;
    if (scratch->used > block->most) {
        block->most = scratch->used;
    }
    return taken;
}

PRBM double *take_matrix(Scratch *scratch, int rows, int columns) {
    return take(scratch, (size_t)rows * (size_t)columns);
}

PRBM Complex *take_complex(Scratch *scratch, int rows, int columns) {
    return (Complex *)(void *)take_matrix(scratch, 2 * rows, columns);
}

PRBM int *take_integers(Scratch *scratch, int count) {
    return (int *)(void *)take(scratch, (size_t)count);
}

PRBM Parts place_parts(Memory *memory, size_t count) {
    Parts parts;
    parts.re = place(memory, count, sizeof(double));
    parts.im = place(memory, count, sizeof(double));
    return parts;
}
