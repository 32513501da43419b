/* Branches: what the steps of the assembly add, from the ground outwards. */
#include <string.h>

#include "core/branches.h"
#include "core/matrix.h"
#include "core/vectors.h"

/* --- memory ----------------------------------------------------------------------------------- */

/* Numbers of branches, and of elements of the arrays of all branches. */
typedef struct {
    size_t branches, coordinates, entries, changes, couplings, products;
} BranchSizes;

enum { ARRAYS_PER_BRANCH = 14 };

static size_t triangle(size_t n) {
    return n * (n + 1) / 2;
}

/* Return the number of pairs of directions of a branch, in padded rows: those of each direction
 * with the ones before it and, if arms stretch, of each with itself. */
static size_t pair_count(int size, bool stretching) {
    size_t count = stretching ? (size_t)even_length(size) : 0;
    for (int i = 1; i < size; i++) {
        count += (size_t)even_length(i);
    }
    return count;
}

/* Add the sizes of a branch, whose directions depend on at most some coordinates.  The directions
 * of links and bodies are coordinates, which needs no products. */
static void add_sizes(BranchSizes *sizes, int directions, int coordinates, bool products) {
    size_t even = (size_t)even_length(directions), count = (size_t)coordinates;
    sizes->branches++;
    sizes->coordinates += count;
    sizes->entries += triangle(count);
    sizes->changes += count * even;
    sizes->couplings += (size_t)directions * even;
    sizes->products += products ? triangle(count) * pair_count(directions, true) : 0;
}

/* Return the end of the directions that a step adds. */
static int end_of_step(const Mechanism *m, int step) {
    bool last = step + 1 == m->step_count;
    return last ? m->direction_count : m->steps[step + 1].first_direction;
}

static BranchSizes branch_sizes(const Mechanism *m) {
    BranchSizes sizes = {0};
    for (int i = 0; i < m->step_count; i++) {
        const Step *step = &m->steps[i];
        const FlexureType *kind = step->flexure ? kind_of(m, step->flexure) : NULL;
        int size = end_of_step(m, i) - step->first_direction;
        bool beam = kind && kind->order > 0;
        bool mixed = beam || step->body != GROUND;
        add_sizes(&sizes, size, beam ? kind->order + 3 + kind->axial : size, mixed);
    }
    return sizes;
}

/* Return the bytes that the arrays of all branches need at most. */
static size_t branch_bytes(const System *system) {
    BranchSizes most = branch_sizes(system->mechanism);
    size_t n = (size_t)system->n, d = (size_t)system->d;
    size_t integers = most.coordinates * (n + 1) + 3 * most.branches * n + most.entries;
    size_t moments = 2 * (d + most.branches), levers = 2 * (d + 1) * most.branches;
    size_t numbers = most.changes + 2 * most.couplings + most.products + moments + levers;
    return integers * sizeof(int) + numbers * sizeof(double) +
           most.branches * ARRAYS_PER_BRANCH * ALIGNMENT;
}

PRBM size_t root_count(const System *system) {
    size_t n = (size_t)system->n;
    return system->mapped ? branch_sizes(system->mechanism).branches * (n + 1) : 0;
}

PRBM void place_branches(System *system, Memory *memory) {
    size_t count = system->mapped ? branch_sizes(system->mechanism).branches : 0;
    size_t n = system->mapped ? (size_t)system->n : 0;
    system->branches = place(memory, count, sizeof(Branch));
    system->branch_of = place(memory, (size_t)system->b + 1, sizeof(int));
    system->constant_mass = place(memory, n * n, sizeof(double));
    system->branch_memory.base = place(memory, system->mapped ? branch_bytes(system) : 0, 1);
}

/* --- set-up ----------------------------------------------------------------------------------- */

/* Set the elements of a vector (d,) for the arms of the directions of a branch, padded. */
static void set_parts(const System *system, const Branch *branch, const Complex *z, Parts parts) {
    parts.re[branch->even - 1] = parts.im[branch->even - 1] = 0.0;
    for (int i = 0; i < branch->size; i++) {
        Complex each = z[arm_of(system, branch->start + i)];
        parts.re[i] = each.re;
        parts.im[i] = each.im;
    }
}

PRBM void clear_branches(System *system) {
    system->branch_count = 0;
    system->branch_memory.used = 0;
    system->branch_of[GROUND] = FIXED;
}

PRBM void begin_branch(System *system, int step) {
    const Step *added = &system->mechanism->steps[step];
    const Connection *between = added->between;
    const int near = !between ? GROUND : added->backwards ? between->end : between->start;
    const int far = !between ? added->body : added->backwards ? between->start : between->end;
    const int start = added->first_direction, end = end_of_step(system->mechanism, step);
    Branch *branch = &system->branches[system->branch_count];
    if (!system->mapped || start == end) {
        return;
    }
    branch->step = step;
    branch->start = start;
    branch->size = end - start;
    branch->even = even_length(branch->size);
    branch->parent = system->branch_of[near];
    if (!added->closes) {
        system->branch_of[far] = system->branch_count;
    }
    system->branch_count++;
}

/* Return the index of a number in a list, or count if it does not contain it. */
static int index_in(int count, const int *list, int number) {
    int k = 0;
    while (k < count && list[k] != number) {
        k++;
    }
    return k;
}

/* Set the coordinates that the directions of a branch depend on, and their changes. */
static void set_changes(System *system, Branch *branch, Scratch scratch) {
    const DirectionMap *map = &system->mechanism->map;
    const int first = map->first[branch->start], end = map->first[branch->start + branch->size];
    bool *used = (bool *)take(&scratch, (size_t)system->n);
    memset(used, 0, (size_t)system->n * sizeof *used);
    branch->count = 0;
    for (int k = first; k < end; k++) {
        branch->count += !used[map->coordinate[k]];
        used[map->coordinate[k]] = true;
    }
    branch->coordinate = place(&system->branch_memory, (size_t)branch->count, sizeof(int));
    for (int j = 0, c = 0; j < system->n; j++) {
        if (used[j]) {
            branch->coordinate[c++] = j;
        }
    }
    size_t size = (size_t)branch->count * (size_t)branch->even;
    branch->change = place(&system->branch_memory, size, sizeof(double));
    zeros((int)size, branch->change);
    for (int i = 0; i < branch->size; i++) {
        int j = branch->start + i;
        for (int k = map->first[j]; k < map->first[j + 1]; k++) {
            int c = index_in(branch->count, branch->coordinate, map->coordinate[k]);
            branch->change[c * branch->even + i] = system->factors[k];
        }
    }
}

/* Set the coupling of the directions of a branch, below its diagonal. */
static void set_coupling(System *system, Branch *branch) {
    size_t size = (size_t)branch->size * (size_t)branch->even;
    branch->H.re = place(&system->branch_memory, size, sizeof(double));
    branch->H.im = place(&system->branch_memory, size, sizeof(double));
    branch->real = branch->size;
    zeros((int)size, branch->H.re);
    zeros((int)size, branch->H.im);
    for (int i = 0; i < branch->size; i++) {
        for (int j = 0; j < i; j++) {
            Complex h = system->H[(branch->start + i) * system->d + branch->start + j];
            branch->H.re[i * branch->even + j] = h.re;
            branch->H.im[i * branch->even + j] = h.im;
            branch->real = h.im != 0.0 && i < branch->real ? i : branch->real;
        }
    }
}

/* Return the index of the mass of the coordinates i and j in the blocks of the mass matrix. */
static int mass_index(const System *system, int i, int j) {
    const Block *block = system->mass_blocks;
    int row = i < j ? i : j, column = i < j ? j : i, first = 0;
    while (block->start + block->size <= row) {
        first += block->size * block->size;
        block++;
    }
    return first + (row - block->start) * block->size + column - block->start;
}

/* Set the masses that the directions of a branch add to. */
static void set_own(System *system, Branch *branch) {
    const int count = branch->count;
    branch->own = place(&system->branch_memory, triangle((size_t)count), sizeof(int));
    int *next = branch->own;
    for (int a = 0; a < count; a++) {
        for (int b = 0; b <= a; b++) {
            *next++ = mass_index(system, branch->coordinate[a], branch->coordinate[b]);
        }
    }
}

/* Set the products of the changes of each pair of directions of a leaf, for one mass. */
static void set_leaf_products(const Branch *branch, const double *x, const double *y,
                              double *next) {
    for (int i = 1; i < branch->size; i++) {
        for (int j = 0; j < i; j++) {
            *next = x[i] * y[j] + x[j] * y[i];
            next += LEAF_MASSES;
        }
    }
}

/* The same for any branch. */
static double *set_products(const Branch *branch, const double *x, const double *y,
                            bool stretching, double *next) {
    for (int i = 1; i < branch->size; i++) {
        for (int j = 0; j < even_length(i); j++) {
            *next++ = j < i ? x[i] * y[j] + x[j] * y[i] : 0.0;
        }
    }
    for (int i = 0; stretching && i < branch->even; i++) {
        *next++ = i < branch->size ? x[i] * y[i] : 0.0;
    }
    return next;
}

/* Set the products for all masses of a branch.  If no arm stretches, the diagonal of the mass
 * matrix of the directions, and its part of the mass matrix, are constant. */
static void set_all_products(System *system, Branch *branch) {
    const bool stretching = system->stretch_count > 0;
    size_t entries = triangle((size_t)branch->count);
    branch->pairs = (int)pair_count(branch->size, stretching);
    branch->products = place(&system->branch_memory, entries * (size_t)branch->pairs,
                             sizeof(double));
    double *next = branch->products;
    int entry = 0;
    for (int a = 0; a < branch->count; a++) {
        for (int b = 0; b <= a; b++) {
            const double *x = branch->change + a * branch->even;
            const double *y = branch->change + b * branch->even;
            double *mass = &system->constant_mass[branch->own[entry]];
            for (int i = 0; !stretching && i < branch->size; i++) {
                *mass += system->own[branch->start + i] * x[i] * y[i];
            }
            if (branch->code == ANY_BRANCH) {
                next = set_products(branch, x, y, stretching, next);
            } else {
                set_leaf_products(branch, x, y, branch->products + entry);
            }
            entry++;
        }
    }
}

/* Whether each direction of a branch is the coordinate with its index. */
static bool is_identity(const Branch *branch) {
    bool same = branch->count == branch->size;
    for (int c = 0; same && c < branch->count; c++) {
        for (int i = 0; i < branch->size; i++) {
            same = same && branch->change[c * branch->even + i] == (c == i ? 1.0 : 0.0);
        }
    }
    return same;
}

/* Return the first mass point that moves with a branch; FIXED: there is none. */
static int first_moved(const System *system, const Branch *branch) {
    for (int k = 0; k < system->p; k++) {
        for (int j = branch->start; j < branch->start + branch->size; j++) {
            Complex A = system->A[k * system->d + j];
            if (A.re != 0.0 || A.im != 0.0) {
                return k;
            }
        }
    }
    return FIXED;
}

/* Set the displacement of the root of a branch with the directions of its parent: all mass points
 * that move with the branch have the same. */
static void set_lever(System *system, Branch *branch) {
    const Branch *carrier = &system->branches[branch->parent];
    const int point = first_moved(system, branch);
    branch->lever = place_parts(&system->branch_memory, (size_t)carrier->even);
    zeros(carrier->even, branch->lever.re);
    zeros(carrier->even, branch->lever.im);
    if (point != FIXED) {
        set_parts(system, carrier, system->A + point * system->d, branch->lever);
    }
}

/* Set the coordinates that move the root of a branch, and the masses that they share with those of
 * its directions. */
static void set_path(System *system, Branch *branch) {
    Memory *memory = &system->branch_memory;
    branch->reach = 0;
    if (branch->parent == FIXED) {
        return;
    }
    const Branch *carrier = &system->branches[branch->parent];
    size_t n = (size_t)system->n, count = (size_t)branch->count;
    branch->path = place(memory, n, sizeof(int));
    branch->slot = place(memory, (size_t)carrier->count, sizeof(int));
    for (; branch->reach < carrier->reach; branch->reach++) {
        branch->path[branch->reach] = carrier->path[branch->reach];
    }
    for (int c = 0; c < carrier->count; c++) {
        int slot = index_in(branch->reach, branch->path, carrier->coordinate[c]);
        branch->path[slot] = carrier->coordinate[c];
        branch->reach += slot == branch->reach;
        branch->slot[c] = slot;
    }
    size_t reach = (size_t)branch->reach;
    branch->both = place(memory, reach, sizeof(int));
    branch->coupled = place(memory, reach * count, sizeof(int));
    for (int k = 0; k < branch->reach; k++) {
        int both = index_in(branch->count, branch->coordinate, branch->path[k]);
        branch->both[k] = both < branch->count ? both : FIXED;
        for (int c = 0; c < branch->count; c++) {
            branch->coupled[k * branch->count + c] =
                mass_index(system, branch->path[k], branch->coordinate[c]);
        }
    }
}

/* Whether the last direction of a branch, and of no other, is its last coordinate. */
static bool ends_with_body(const Branch *branch) {
    const double *last = branch->change + branch->size - 1;
    for (int c = 0; c < branch->count; c++) {
        if (last[c * branch->even] != (c == branch->count - 1 ? 1.0 : 0.0)) {
            return false;
        }
    }
    return true;
}

/* Return the code for a branch.  The row of H of a body may be real, too. */
static BranchCode code_of(const System *system, const Branch *branch) {
    const Step *step = &system->mechanism->steps[branch->step];
    const int nodes = step->flexure ? node_count(kind_of(system->mechanism, step->flexure)) : 0;
    const int bodies = !step->closes;
    bool plain = system->stretch_count == 0 && branch->count == LEAF_COORDINATES;
    if (!plain || branch->real < nodes || branch->size != nodes + bodies ||
        (bodies && !ends_with_body(branch))) {
        return ANY_BRANCH;
    }
    switch (nodes) {
    case 5: return bodies ? LEAF_5_BODY : LEAF_5;
    case 6: return bodies ? LEAF_6_BODY : LEAF_6;
    default: return ANY_BRANCH;
    }
}

PRBM void set_branches(System *system, Scratch scratch) {
    int roots = 0;
    system->mass_size = 0;
    for (int k = 0; k < system->mass_block_count; k++) {
        size_t size = (size_t)system->mass_blocks[k].size;
        system->mass_size += size * size;
    }
    zeros(system->mapped ? system->n * system->n : 0, system->constant_mass);
    for (int k = 0; k < system->branch_count; k++) {
        Branch *branch = &system->branches[k];
        set_changes(system, branch, scratch);
        set_coupling(system, branch);
        branch->S = place_parts(&system->branch_memory, (size_t)branch->even);
        set_parts(system, branch, system->S, branch->S);
        set_own(system, branch);
        branch->identity = is_identity(branch);
        branch->code = code_of(system, branch);
        if (!branch->identity) {
            set_all_products(system, branch);
        }
        set_path(system, branch);
        if (branch->parent != FIXED) {
            set_lever(system, branch);
        }
        branch->root = roots;
        roots += branch->reach + 1;
    }
}
