/* The map from coordinates to directions, block by block. */
#include <string.h>

#include "core/block_map.h"
#include "core/matrix.h"
#include "core/vectors.h"

/* Set the coordinates that the directions of a block depend on; return their number. */
static int collect_coordinates(const System *system, const Block *block, bool *used,
                               int *coordinate) {
    const DirectionMap *map = &system->mechanism->map;
    int count = 0;
    memset(used, 0, (size_t)system->n * sizeof *used);
    for (int k = map->first[block->start]; k < map->first[block->start + block->size]; k++) {
        used[map->coordinate[k]] = true;
    }
    for (int j = 0; j < system->n; j++) {
        if (used[j]) {
            coordinate[count++] = j;
        }
    }
    return count;
}

/* Set the changes of the directions of a block with its coordinates. */
static void set_changes(const System *system, BlockMap *block) {
    const DirectionMap *map = &system->mechanism->map;
    zeros(block->size * block->even, block->change);
    for (int i = 0; i < block->size; i++) {
        int j = block->start + i;
        for (int k = map->first[j]; k < map->first[j + 1]; k++) {
            int c = 0;
            while (block->coordinate[c] != map->coordinate[k]) {
                c++;
            }
            block->change[i * block->even + c] = system->factors[k];
        }
    }
}

PRBM void set_block_maps(System *system, Scratch *scratch) {
    size_t mark = scratch->used;
    bool *used = (bool *)take(scratch, (size_t)system->n);
    int *coordinate = system->maps[0].coordinate;
    double *change = system->maps[0].change;
    for (int k = 0; system->mapped && k < system->block_count; k++) {
        BlockMap map = {system->blocks[k].start, system->blocks[k].size, 0, 0, coordinate, change};
        map.count = collect_coordinates(system, &system->blocks[k], used, coordinate);
        map.even = even_length(map.count);
        set_changes(system, &map);
        system->maps[k] = map;
        coordinate += map.count;
        change += map.size * map.even;
    }
    scratch->used = mark;
}

/* Copy the coordinates of a block from x to local, padded by zeros. */
SIZED void gather(int even, const BlockMap *map, const double *x, double *local) {
    local[even - 1] = 0.0;
    for (int c = 0; c < map->count; c++) {
        local[c] = x[map->coordinate[c]];
    }
}

SIZED void map_block(int even, int size, const BlockMap *map, const double *x,
                     double *ALONE local, double *ALONE out) {
    gather(even, map, x, local);
    UNROLLED
    for (int i = 0; i < size; i++) {
        const double *change = map->change + i * even;
        Lanes sum[SUMS] = {NO_LANES};
        UNROLLED_BY_LANES
        for (int c = 0; c < even; c += LANES) {
            sum[SUM_OF(c)] += lanes_at(change + c) * lanes_at(local + c);
        }
        out[map->start + i] = total(sum);
    }
}

/* Return the size of a block of up to four coordinates whose code is compiled separately: that of a beam
 * of the order 3 with 5 or 6 nodes, with or without a body; 0 for other blocks. */
static int kind_of_block(const BlockMap *map) {
    return map->even == 4 && map->size >= 5 && map->size <= 7 ? map->size : 0;
}

PRBM void map_directions(const System *system, const double *x, double *local, double *out) {
    for (int k = 0; k < system->block_count; k++) {
        const BlockMap *map = &system->maps[k];
        switch (kind_of_block(map)) {
        case 5: map_block(4, 5, map, x, local, out); break;
        case 6: map_block(4, 6, map, x, local, out); break;
        case 7: map_block(4, 7, map, x, local, out); break;
        default: map_block(map->even, map->size, map, x, local, out);
        }
    }
}

/* Set out to the sum of x_i times row i of the changes. */
SIZED void sum_changes(int even, int size, const double *change, const double *ALONE x,
                   double *ALONE out) {
    UNROLLED_BY_LANES
    for (int c = 0; c < even; c += LANES) {
        Lanes sum = NO_LANES;
        UNROLLED
        for (int i = 0; i < size; i++) {
            sum += x[i] * lanes_at(change + i * even + c);
        }
        set_lanes(out + c, sum);
    }
}

SIZED void pull_block(int even, int size, const BlockMap *map, const double *x, double *local,
                      double *out) {
    sum_changes(even, size, map->change, x + map->start, local);
    for (int c = 0; c < map->count; c++) {
        out[map->coordinate[c]] += local[c];
    }
}

PRBM void pull_directions(const System *system, const double *x, double *local, double *out) {
    for (int k = 0; k < system->block_count; k++) {
        const BlockMap *map = &system->maps[k];
        switch (kind_of_block(map)) {
        case 5: pull_block(4, 5, map, x, local, out); break;
        case 6: pull_block(4, 6, map, x, local, out); break;
        case 7: pull_block(4, 7, map, x, local, out); break;
        default: pull_block(map->even, map->size, map, x, local, out);
        }
    }
}

/* Set turned (size, even) to the mass matrix of a block times the changes. */
SIZED void turn_mass(int even, int size, const double *change, const double *ALONE block,
                     double *ALONE turned) {
    UNROLLED
    for (int i = 0; i < size; i++) {
        UNROLLED_BY_LANES
        for (int c = 0; c < even; c += LANES) {
            Lanes own = lanes_at(change + i * even + c), sum = block[i * size + i] * own;
            for (int j = 0; j < i; j++) {
                double mass = block[i * size + j];
                sum += mass * lanes_at(change + j * even + c);
                double *other = turned + j * even + c;
                set_lanes(other, lanes_at(other) + mass * own);
            }
            set_lanes(turned + i * even + c, sum);
        }
    }
}

SIZED void pull_mass_of_size(int even, int size, int n, const BlockMap *map, const double *block,
                             double *ALONE local, double *ALONE M) {
    double *turned = local + even;
    turn_mass(even, size, map->change, block, turned);
    for (int a = 0; a < map->count; a++) {
        UNROLLED_BY_LANES
        for (int c = 0; c < even; c += LANES) {
            Lanes sum = NO_LANES;
            UNROLLED
            for (int i = 0; i < size; i++) {
                sum += map->change[i * even + a] * lanes_at(turned + i * even + c);
            }
            set_lanes(local + c, sum);
        }
        for (int c = 0; c <= a; c++) {
            M[map->coordinate[a] * n + map->coordinate[c]] += local[c];
        }
    }
}

PRBM void pull_mass(const System *system, const BlockMap *map, const double *block, double *local,
                    double *M) {
    int n = system->n;
    switch (kind_of_block(map)) {
    case 5: pull_mass_of_size(4, 5, n, map, block, local, M); break;
    case 6: pull_mass_of_size(4, 6, n, map, block, local, M); break;
    case 7: pull_mass_of_size(4, 7, n, map, block, local, M); break;
    default: pull_mass_of_size(map->even, map->size, n, map, block, local, M);
    }
}
