/* Blocks of directions: their map from the coordinates, and their mass. */
#include <string.h>

#include "core/block_map.h"
#include "core/matrix.h"
#include "core/vectors.h"

/* --- set-up ----------------------------------------------------------------------------------- */

PRBM void place_maps(System *system, Memory *memory) {
    const Mechanism *m = system->mechanism;
    size_t n = (size_t)system->n, d = system->mapped ? (size_t)system->d : 0;
    BlockMap first = {0};
    system->maps = place(memory, d, sizeof *system->maps);
    first.coordinate = place(memory, d > 0 ? (size_t)m->map.count : 0, sizeof(int));
    first.change = place(memory, 2 * d * n, sizeof(double));
    first.H.re = place(memory, d * (d + 1), sizeof(double));
    first.H.im = place(memory, d * (d + 1), sizeof(double));
    first.products = place(memory, BEAM_DIRECTIONS_MAX * BEAM_ENTRIES * d / 2, sizeof(double));
    if (memory->base && d > 0) {
        system->maps[0] = first;
    }
}

/* Set the coordinates that the directions of a block depend on; return their number. */
static int collect_coordinates(const System *system, const BlockMap *block, bool *used) {
    const DirectionMap *map = &system->mechanism->map;
    int count = 0;
    memset(used, 0, (size_t)system->n * sizeof *used);
    for (int k = map->first[block->start]; k < map->first[block->start + block->size]; k++) {
        used[map->coordinate[k]] = true;
    }
    for (int j = 0; j < system->n; j++) {
        if (used[j]) {
            block->coordinate[count++] = j;
        }
    }
    return count;
}

/* Set the changes of the directions of a block with its coordinates. */
static void set_changes(const System *system, const BlockMap *block) {
    const DirectionMap *map = &system->mechanism->map;
    zeros(block->count * block->even, block->change);
    for (int i = 0; i < block->size; i++) {
        int j = block->start + i;
        for (int k = map->first[j]; k < map->first[j + 1]; k++) {
            int c = 0;
            while (block->coordinate[c] != map->coordinate[k]) {
                c++;
            }
            block->change[c * block->even + i] = system->factors[k];
        }
    }
}

/* Set the coupling of a block below its diagonal. */
static void set_coupling(const System *system, const BlockMap *block) {
    int even = block->even;
    zeros(block->size * even, block->H.re);
    zeros(block->size * even, block->H.im);
    for (int i = 0; i < block->size; i++) {
        for (int j = 0; j < i; j++) {
            Complex h = system->H[(block->start + i) * system->d + block->start + j];
            block->H.re[i * even + j] = h.re;
            block->H.im[i * even + j] = h.im;
        }
    }
}

/* Set the place of the mass matrix of the coordinates of a block in those of all mass blocks. */
static void find_mass_block(const System *system, BlockMap *block) {
    int k = 0, offset = 0;
    const Block *mass = system->mass_blocks;
    while (mass[k].start + mass[k].size <= block->coordinate[0]) {
        offset += mass[k].size * mass[k].size;
        k++;
    }
    block->mass_size = mass[k].size;
    block->mass_first = offset - mass[k].start * (mass[k].size + 1);
}

/* Return the index of the mass of the coordinates a and b <= a of a block, above the diagonal. */
static int mass_index(const BlockMap *block, int a, int b) {
    return block->mass_first + block->coordinate[b] * block->mass_size + block->coordinate[a];
}

/* Whether the last direction of a block is its last coordinate, the rotation of a body. */
static bool has_body(const BlockMap *block) {
    for (int c = 0; c < block->count; c++) {
        double wanted = c == block->count - 1 ? 1.0 : 0.0;
        if (block->change[c * block->even + block->size - 1] != wanted) {
            return false;
        }
    }
    return true;
}

/* Return the kind of the beam of a block.  The coupling of its nodes is real. */
static BeamKind beam_kind(const System *system, const BlockMap *block, bool body) {
    const int nodes = block->size - body;
    for (int k = 0; k < system->stretch_count; k++) {
        int j = system->stretches[k] - block->start;
        if (j >= 0 && j < block->size) {
            return NO_BEAM;
        }
    }
    for (int k = 0; k < nodes * block->even; k++) {
        if (block->H.im[k] != 0.0) {
            return NO_BEAM;
        }
    }
    if (block->count != BEAM_COORDINATES) {
        return NO_BEAM;
    }
    switch (nodes) {
    case 5: return body ? BEAM_5_BODY : BEAM_5;
    case 6: return body ? BEAM_6_BODY : BEAM_6;
    default: return NO_BEAM;
    }
}

/* Rows and columns of the entries of a symmetric matrix of the coordinates.  The first entries are
 * pairs of neighbours in a row. */
static const int BEAM_ENTRY[BEAM_ENTRIES][2] = {
    {1, 0}, {1, 1}, {2, 0}, {2, 1}, {3, 0}, {3, 1}, {3, 2}, {3, 3}, {0, 0}, {2, 2},
};

static bool consecutive(const BlockMap *block) {
    for (int c = 1; c < block->count; c++) {
        if (block->coordinate[c] != block->coordinate[0] + c) {
            return false;
        }
    }
    return true;
}

/* Set one entry of the mass matrices of the coordinates: its place, the part of the diagonal, and
 * the product for each pair of nodes. */
static void set_entry(const System *system, int nodes, int k, BlockMap *block) {
    const int a = BEAM_ENTRY[k][0], b = BEAM_ENTRY[k][1], even = block->even;
    const double *x = block->change + a * even, *y = block->change + b * even;
    double *next = block->products + k;
    block->place[k] = mass_index(block, a, b);
    block->constant[k] = 0.0;
    for (int i = 0; i < block->size; i++) {
        block->constant[k] += system->own[block->start + i] * x[i] * y[i];
    }
    for (int i = 0; i < nodes; i++) {
        for (int j = 0; j < i; j++) {
            *next = block->H.re[i * even + j] * (x[i] * y[j] + x[j] * y[i]);
            next += BEAM_ENTRIES;
        }
    }
}

/* Set the members of a block that are used for beams only. */
static void set_products(const System *system, int nodes, BlockMap *block) {
    block->together = consecutive(block);
    for (int i = 0; i < block->size; i++) {
        for (int a = 0; a < BEAM_COORDINATES; a++) {
            block->rows[i * BEAM_COORDINATES + a] = block->change[a * block->even + i];
        }
    }
    for (int k = 0; k < BEAM_ENTRIES; k++) {
        set_entry(system, nodes, k, block);
    }
}

PRBM void set_block_maps(System *system, Scratch *scratch) {
    size_t mark = scratch->used;
    bool *used = (bool *)take(scratch, (size_t)system->n);
    for (int k = 0; system->mapped && k < system->block_count; k++) {
        BlockMap *map = &system->maps[k], next;
        map->start = system->blocks[k].start;
        map->size = system->blocks[k].size;
        map->even = even_length(map->size);
        map->count = collect_coordinates(system, map, used);
        set_changes(system, map);
        set_coupling(system, map);
        find_mass_block(system, map);
        bool body = has_body(map);
        map->beam = beam_kind(system, map, body);
        if (map->beam != NO_BEAM) {
            set_products(system, map->size - body, map);
        }
        next = *map;
        next.coordinate += map->count;
        next.change += map->count * map->even;
        next.H.re += map->size * map->even;
        next.H.im += map->size * map->even;
        next.products += map->beam != NO_BEAM ? map->size * (map->size - 1) / 2 * BEAM_ENTRIES : 0;
        if (k + 1 < system->block_count) {
            system->maps[k + 1] = next;
        }
    }
    scratch->used = mark;
}

/* --- directions and derivatives --------------------------------------------------------------- */

/* Compute the directions out of the coordinates x of a beam.  A last direction without a pair is
 * stored alone, because the next number belongs to the next block. */
SIZED void map_beam(int nodes, bool body, const double *change, const double *RESTRICT x,
                    double *RESTRICT out) {
    const int size = nodes + body, even = even_length(size), paired = size - size % PAIR;
    const int computed = body ? paired : even;
    Lanes sum[BEAM_DIRECTIONS_MAX + 1];
    UNROLLED
    for (int c = 0; c < BEAM_COORDINATES; c++) {
        Lanes each = all_lanes(x[c]);
        UNROLLED
        for (int i = 0; i < computed; i += LANES) {
            Lanes term = each * aligned_lanes(change + c * even + i);
            sum[i] = c == 0 ? term : sum[i] + term;
        }
    }
    UNROLLED
    for (int i = 0; i < paired; i += LANES) {
        set_lanes(out + i, sum[i]);
    }
    if (paired < size) {
        out[paired] = body ? x[BEAM_COORDINATES - 1] : LANE(sum[paired], 0);
    }
}

/* Compute the directions and their rates for a beam. */
SIZED void map_beam_motion(int nodes, bool body, const BlockMap *map, Kinematics *at) {
    const double *angle = at->angle + map->coordinate[0];
    const double *speed = at->speed + map->coordinate[0];
    double angles[BEAM_COORDINATES], speeds[BEAM_COORDINATES];
    if (!map->together) {
        for (int c = 0; c < BEAM_COORDINATES; c++) {
            angles[c] = at->angle[map->coordinate[c]];
            speeds[c] = at->speed[map->coordinate[c]];
        }
        angle = angles;
        speed = speeds;
    }
    map_beam(nodes, body, map->change, angle, at->theta + map->start);
    map_beam(nodes, body, map->change, speed, at->turn + map->start);
}

NOINLINE void map_block(const BlockMap *map, const double *x, double *out) {
    for (int i = 0; i < map->size; i += LANES) {
        Lanes sum = NO_LANES;
        for (int c = 0; c < map->count; c++) {
            sum += x[map->coordinate[c]] * aligned_lanes(map->change + c * map->even + i);
        }
        if (i + LANES <= map->size) {
            set_lanes(out + map->start + i, sum);
        } else {
            out[map->start + i] = LANE(sum, 0);
        }
    }
}

PRBM void map_directions(const System *system, const double *x, double *out) {
    for (int k = 0; k < system->block_count; k++) {
        map_block(&system->maps[k], x, out);
    }
}

PRBM void map_motion(const System *system, Kinematics *at) {
    for (int k = 0; k < system->block_count; k++) {
        const BlockMap *map = &system->maps[k];
        switch (map->beam) {
        case BEAM_5: map_beam_motion(5, false, map, at); break;
        case BEAM_5_BODY: map_beam_motion(5, true, map, at); break;
        case BEAM_6: map_beam_motion(6, false, map, at); break;
        case BEAM_6_BODY: map_beam_motion(6, true, map, at); break;
        case NO_BEAM:
            map_block(map, at->angle, at->theta);
            map_block(map, at->speed, at->turn);
        }
    }
}

NOINLINE void pull_block(const BlockMap *map, const double *x, double *out) {
    const int paired = map->size - map->size % PAIR;
    x += map->start;
    for (int c = 0; c < map->count; c++) {
        const double *change = map->change + c * map->even;
        Lanes sum[SUMS] = {NO_LANES};
        for (int i = 0; i < paired; i += LANES) {
            sum[SUM_OF(i)] += lanes_at(x + i) * aligned_lanes(change + i);
        }
        double last = paired < map->size ? x[paired] * change[paired] : 0.0;
        out[map->coordinate[c]] += total(sum) + last;
    }
}

/* Compute the derivatives by the coordinates out of those by the directions at the nodes. */
SIZED void pull_nodes(int nodes, const BlockMap *map, const double *RESTRICT x,
                      Lanes *RESTRICT sum) {
    UNROLLED
    for (int c = 0; c < BEAM_COORDINATES; c += LANES) {
        sum[c / LANES] = x[0] * lanes_at(map->rows + c);
    }
    UNROLLED
    for (int i = 1; i < nodes; i++) {
        Lanes each = all_lanes(x[i]);
        UNROLLED
        for (int c = 0; c < BEAM_COORDINATES; c += LANES) {
            sum[c / LANES] += each * lanes_at(map->rows + i * BEAM_COORDINATES + c);
        }
    }
}

/* Add the derivatives by the directions of a beam, pulled back to the coordinates, to out. */
SIZED void pull_beam(int nodes, bool body, const BlockMap *map, const double *RESTRICT x,
                     double *RESTRICT out) {
    Lanes sum[BEAM_COORDINATES / LANES];
    double entries[BEAM_COORDINATES];
    pull_nodes(nodes, map, x + map->start, sum);
    if (body) {
        Lanes rotation = NO_LANES;
        LANE(rotation, LANES - 1) = x[map->start + nodes];
        sum[BEAM_COORDINATES / LANES - 1] += rotation;
    }
    if (map->together) {
        out += map->coordinate[0];
        UNROLLED
        for (int c = 0; c < BEAM_COORDINATES; c += LANES) {
            set_lanes(out + c, lanes_at(out + c) + sum[c / LANES]);
        }
        return;
    }
    UNROLLED
    for (int c = 0; c < BEAM_COORDINATES; c += LANES) {
        set_lanes(entries + c, sum[c / LANES]);
    }
    UNROLLED
    for (int c = 0; c < BEAM_COORDINATES; c++) {
        out[map->coordinate[c]] += entries[c];
    }
}

static void pull_rows(const System *system, const BlockMap *map, int r, const double *x,
                      double *out) {
    for (int row = 0; row < r; row++) {
        pull_block(map, x + row * system->wide, out + row * system->even);
    }
}

PRBM void pull_directions(const System *system, int r, const double *x, double *out) {
    for (int k = 0; k < system->block_count; k++) {
        pull_rows(system, &system->maps[k], r, x, out);
    }
}

/* --- mass ------------------------------------------------------------------------------------- */

/* Compute the mass matrix M (size, even) of the directions of a block below its diagonal, and
 * add the quadratic velocity terms to the loads x.  The rows of the nodes of a beam are not
 * multiplied by H, which its products contain. */
SIZED void couple_block(int size, int nodes, Parts H, Parts e, const double *RESTRICT squares,
                        double *RESTRICT M, double *RESTRICT x) {
    const int even = even_length(size);
    UNROLLED
    for (int i = 1; i < size; i++) {
        Lanes own_re = all_lanes(e.re[i]), own_im = all_lanes(e.im[i]);
        Lanes square = all_lanes(squares[i]), sum[SUMS] = {NO_LANES};
        const int columns = nodes > 0 ? even : even_length(i);
        const bool real = i < nodes;
        UNROLLED
        for (int j = 0; j < columns; j += LANES) {
            if (j < even_length(i)) {
                Lanes e_re = lanes_at(e.re + j), e_im = lanes_at(e.im + j);
                Lanes re = own_re * e_re + own_im * e_im, im = own_re * e_im - own_im * e_re;
                Lanes h_re = aligned_lanes(H.re + i * even + j), mass = re, turned = h_re * im;
                if (!real) {
                    Lanes h_im = aligned_lanes(H.im + i * even + j);
                    mass = h_re * re - h_im * im;
                    turned += h_im * re;
                }
                set_lanes(M + i * even + j, mass);
                Lanes term = turned * lanes_at(squares + j);
                sum[SUM_OF(j)] = j < PAIR ? term : sum[SUM_OF(j)] + term;
                set_lanes(x + j, lanes_at(x + j) - turned * square);
            }
        }
        x[i] += total(sum);
    }
}

/* Add the mass matrix of a beam, M below its diagonal, to that of the coordinates.  The row of the
 * body is pulled back as a vector, because the direction of the body is a coordinate. */
SIZED void pull_beam_mass(int nodes, bool body, const BlockMap *map, const double *RESTRICT M,
                          double *RESTRICT mass) {
    static const double TIMES[BEAM_COORDINATES] = {1.0, 1.0, 1.0, 2.0};
    const int even = even_length(nodes + body);
    const double *product = map->products;
    Lanes sum[BEAM_ENTRIES / LANES];
    double entries[BEAM_ENTRIES];
    UNROLLED
    for (int k = 0; k < BEAM_ENTRIES; k += LANES) {
        sum[k / LANES] = lanes_at(map->constant + k);
    }
    UNROLLED
    for (int i = 1; i < nodes; i++) {
        UNROLLED
        for (int j = 0; j < nodes; j++) {
            if (j < i) {
                Lanes each = all_lanes(M[i * even + j]);
                UNROLLED
                for (int k = 0; k < BEAM_ENTRIES; k += LANES) {
                    sum[k / LANES] += each * aligned_lanes(product + k);
                }
                product += BEAM_ENTRIES;
            }
        }
    }
    if (body) {
        Lanes row[BEAM_COORDINATES / LANES];
        pull_nodes(nodes, map, M + nodes * even, row);
        UNROLLED
        for (int c = 0; c < BEAM_COORDINATES; c += LANES) {
            sum[(BEAM_BODY + c) / LANES] += row[c / LANES] * lanes_at(TIMES + c);
        }
    }
    const int paired = 0;
    UNROLLED
    for (int k = 0; k < BEAM_ENTRIES; k += LANES) {
        if (k < paired) {
            double *place = mass + map->place[k];
            set_lanes(place, lanes_at(place) + sum[k / LANES]);
        } else {
            set_lanes(entries + k, sum[k / LANES]);
        }
    }
    for (int k = paired; k < BEAM_ENTRIES; k++) {
        mass[map->place[k]] += entries[k];
    }
}

SIZED void add_beam_terms(int nodes, bool body, const System *system, const BlockMap *map, int r,
                          Evaluation *result) {
    const Kinematics *at = &result->at;
    const int start = map->start, size = nodes + body;
    couple_block(size, nodes, map->H, parts_from(at->e_parts, start), at->squares + start,
                 result->block, result->load + start);
    pull_beam_mass(nodes, body, map, result->block, result->mass);
    pull_beam(nodes, body, map, result->load, result->a);
    for (int row = 0; row < r; row++) {
        pull_beam(nodes, body, map, result->rows + row * system->wide,
                  result->factors.Z + row * system->even);
    }
}

/* Complete the mass matrix M (size, even) of the directions of a block. */
static void complete_mass(const BlockMap *map, const double *own, double *M) {
    for (int i = 0; i < map->size; i++) {
        M[i * map->even + i] = own[i];
        for (int j = 0; j < i; j++) {
            M[j * map->even + i] = M[i * map->even + j];
        }
    }
}

/* Add the loads of the shift of the rates of a block. */
static void pull_shift(const BlockMap *map, const double *M, const double *shift, double *x) {
    for (int i = 0; i < map->size; i++) {
        for (int j = 0; j < map->size; j++) {
            x[i] += M[i * map->even + j] * shift[j];
        }
    }
}

/* Add the mass matrix M of the directions of a block to that of the coordinates.  turned (even,) is
 * working memory. */
static void pull_any_mass(const BlockMap *map, const double *M, double *turned, double *mass) {
    int even = map->even;
    turned[even - 1] = 0.0;
    for (int a = 0; a < map->count; a++) {
        for (int i = 0; i < map->size; i++) {
            turned[i] = even_dot(even, M + i * even, map->change + a * even);
        }
        for (int b = 0; b <= a; b++) {
            mass[mass_index(map, a, b)] += even_dot(even, map->change + b * even, turned);
        }
    }
}

/* Add the terms of a block that is not a beam; own (d,) and shift (wide,) are those of all
 * blocks. */
NOINLINE void add_any_terms(const System *system, const BlockMap *map, const double *own, int r,
                            Evaluation *result) {
    const Kinematics *at = &result->at;
    const int start = map->start;
    double *M = result->block, *x = result->load + start;
    couple_block(map->size, 0, map->H, parts_from(at->e_parts, start), at->squares + start, M, x);
    complete_mass(map, own + start, M);
    if (system->stretch_count > 0) {
        pull_shift(map, M, result->shift + start, x);
    }
    pull_any_mass(map, M, result->turned, result->mass);
    pull_block(map, result->load, result->a);
    pull_rows(system, map, r, result->rows, result->factors.Z);
}

PRBM void add_block_terms(const System *system, const BlockMap *map, const double *own, int r,
                          Evaluation *result) {
    switch (map->beam) {
    case BEAM_5: add_beam_terms(5, false, system, map, r, result); break;
    case BEAM_5_BODY: add_beam_terms(5, true, system, map, r, result); break;
    case BEAM_6: add_beam_terms(6, false, system, map, r, result); break;
    case BEAM_6_BODY: add_beam_terms(6, true, system, map, r, result); break;
    case NO_BEAM: add_any_terms(system, map, own, r, result);
    }
}
