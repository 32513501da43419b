/* Accelerations and multipliers, from loads, mass matrix, rows and their factors at a state: the
 * twin of Equations.evaluate in mechanics/dynamics.py. */
#include <string.h>

#include "core/branch_terms.h"
#include "core/branches.h"
#include "core/elements.h"
#include "core/evaluation.h"
#include "core/forces.h"
#include "core/friction.h"
#include "core/gaps.h"
#include "core/kinetics.h"
#include "core/matrix.h"
#include "core/vectors.h"

/* --- memory ----------------------------------------------------------------------------------- */

PRBM void reference_place(Reference *reference, const System *system, Memory *memory) {
    size_t wide = (size_t)system->wide;
    reference->theta = place(memory, wide, sizeof(double));
    reference->e = place(memory, wide, sizeof(Complex));
    reference->e_parts = place_parts(memory, wide);
}

PRBM Kinematics place_kinematics(const System *system, Memory *memory) {
    size_t even = (size_t)system->even, wide = (size_t)system->wide;
    Kinematics at;
    at.time = 0.0;
    at.extra = NULL;
    at.angle = place(memory, even, sizeof(double));
    at.speed = place(memory, even + 2, sizeof(double));
    at.theta = system->mapped ? place(memory, wide, sizeof(double)) : at.angle;
    at.turn = system->mapped ? place(memory, wide, sizeof(double)) : at.speed;
    at.squares = place(memory, wide + PAIR, sizeof(double));
    at.own = place(memory, (size_t)system->d, sizeof(double));
    at.e = place(memory, wide, sizeof(Complex));
    at.e_parts = place_parts(memory, wide + PAIR);
    return at;
}

/* Zero the memory placed since begin.  The padding of vectors and rows must stay zero. */
PRBM void zero_placed(const Memory *memory, size_t begin) {
    if (memory->base != NULL) {
        memset(memory->base + begin, 0, memory->used - begin);
    }
}

PRBM void evaluation_place(Evaluation *evaluation, const System *system, Memory *memory) {
    size_t n = (size_t)system->n, even = (size_t)system->even, wide = (size_t)system->wide;
    size_t begin = memory->used;
    size_t r = (size_t)system->r + 2 * (size_t)system->s + (size_t)system->f;
    Evaluation result = {0};
    result.at = place_kinematics(system, memory);
    result.turns = place(memory, even + 2, sizeof(double));
    result.row = place(memory, even, sizeof(double));
    result.columns = place(memory, r * even, sizeof(double));
    result.a = place(memory, even + 2, sizeof(double));
    result.lam = place(memory, r, sizeof(double));
    result.block = system->block;
    result.pressure = place(memory, (size_t)system->s, sizeof(double));
    result.contact_loss = place(memory, (size_t)system->s, sizeof(double));
    result.factors.n = (int)n;
    result.factors.even = (int)even;
    result.factors.blocks = system->mass_blocks;
    result.factors.last = system->last;
    result.factors.factor_rows = system->factor_rows;
    result.factors.scaled = result.row;
    result.factors.U = place(memory, n * n, sizeof(double));
    result.factors.inverse = place(memory, even, sizeof(double));
    result.factors.Z = place(memory, r * even, sizeof(double));
    result.factors.S = place(memory, 2 * r * r + r, sizeof(double));
    result.factors.pivots = place(memory, r, sizeof(int));
    result.load = system->mapped ? place(memory, wide, sizeof(double)) : result.a;
    result.rows = system->mapped ? place(memory, r * wide, sizeof(double)) : result.factors.Z;
    result.mass = place(memory, system->mapped ? n * n : 0, sizeof(double));
    result.shift = place(memory, system->mapped ? wide + PAIR : 0, sizeof(double));
    result.roots = place(memory, root_count(system), sizeof(Complex));
    result.moments = place(memory, system->mapped ? n : 0, sizeof(Complex));
    result.turned = place_parts(memory, system->mapped ? wide : 0);
    zero_placed(memory, begin);
    *evaluation = result;
}

/* --- position and velocity -------------------------------------------------------------------- */

PRBM void set_reference(Reference *reference, const System *system, const double *angle) {
    int wide = system->wide;
    if (system->mapped) {
        map_directions(system, angle, reference->theta);
    } else {
        copy(system->d, angle, reference->theta);
    }
    reference->theta[wide - 1] = system->d < wide ? 0.0 : reference->theta[wide - 1];
    unit_vectors(wide, reference->theta, reference->e);
    pad_parts(wide, reference->e, reference->e_parts);
    stretch(system, reference->theta, reference->e);
}

/* Set the arms of links that stretch, and the diagonal of M, which is proportional to |E|^2.  Set the
 * arms that float, whose part of M is constant. */
NOINLINE void stretch_links(const System *system, Kinematics *at) {
    stretch(system, at->theta, at->e);
    pad_parts(system->wide, at->e, at->e_parts);
    copy(system->d, system->own, at->own);
    for (int k = 0; k < system->stretch_count; k++) {
        int j = system->stretches[k], a = arm_of(system, j);
        double square = at->e[a].re * at->e[a].re + at->e[a].im * at->e[a].im;
        at->own[a] = at->own[j] = system->own[a] * square;
    }
}

/* Return the diagonal of the mass matrix of the directions.  It is constant unless arms stretch. */
static const double *own_inertia(const System *system, const Kinematics *at) {
    return system->stretch_count > 0 ? at->own : system->own;
}

/* Compute the directions at the angles, from those of a nearby reference if possible. */
SHARED void directions_of(int even, const System *system, const Reference *near, Kinematics *at) {
    if (near == NULL ||
        !turned_directions(even, at->theta, near->theta, near->e_parts, at->e_parts, at->e)) {
        unit_vectors(even, at->theta, at->e);
        pad_parts(even, at->e, at->e_parts);
    }
    if (has_shared_arms(system)) {
        stretch_links(system, at);
    }
}

/* Compute the directions and the arms, if the coordinates are not the directions. */
NOINLINE void mapped_directions(const System *system, const Reference *near, Kinematics *at) {
    map_motion(system, at);
    directions_of(system->wide, system, near, at);
}

/* Compute the arms at the angles. */
SHARED void arms_at(int even, const System *system, const Reference *near, Kinematics *at) {
    if (system->mapped) {
        mapped_directions(system, near, at);
    } else {
        directions_of(even, system, near, at);
    }
}

PRBM void find_directions(const System *system, const Reference *near, Kinematics *at) {
    arms_at(system->even, system, near, at);
}

/* Replace the squares of the rates by Re(w^2), with the complex rates w = theta' - i s' of arms. */
NOINLINE void stretch_squares(const System *system, double *squares) {
    for (int k = 0; k < system->stretch_count; k++) {
        int j = system->stretches[k];
        squares[arm_of(system, j)] -= squares[j];
        squares[j] = 0.0;
    }
    for (int k = 0; k < system->shift_count; k++) {
        squares[system->shifts[k]] = 0.0;
    }
}

/* Compute the loads Re(w e) + moment of the directions, and the squares of their rates. */
SIZED void find_loads(int even, const Equations *eq, Evaluation *result) {
    const double *moment = eq->moment, *v = result->at.turn;
    double *x = result->load, *squares = result->at.squares;
    Parts w = eq->w_parts, e = result->at.e_parts;
    UNROLLED_BY_LANES
    for (int j = 0; j < even; j += LANES) {
        Lanes re = lanes_at(w.re + j) * lanes_at(e.re + j);
        Lanes im = lanes_at(w.im + j) * lanes_at(e.im + j);
        set_lanes(x + j, lanes_at(moment + j) + (re - im));
        set_lanes(squares + j, lanes_at(v + j) * lanes_at(v + j));
    }
    if (has_shared_arms(eq->system)) {
        stretch_squares(eq->system, squares);
    }
}

/* --- loads and rows --------------------------------------------------------------------------- */

/* Return Im(w^2) = -2 theta' s' of an arm that stretches.  The equations without these terms give
 * the angular acceleration minus Im(w^2).  If the coordinates are the directions, add_coriolis adds
 * Im(w^2) to the solution; otherwise couple adds its loads to the right side. */
static double coriolis(const System *system, const double *turn, int stretch_direction) {
    return -2.0 * turn[arm_of(system, stretch_direction)] * turn[stretch_direction];
}

/* Subtract the forces of flexures and their damping from the loads, x -= K (q - q0 + beta v), and
 * compute the power beta v^T K v of the damping. */
SIZED void add_springs(int even, const Equations *eq, Evaluation *result) {
    const System *system = eq->system;
    const double *angle = result->at.angle, *straight = system->straight, *v = result->at.speed;
    double *turns = result->turns, *x = result->a;
    Lanes loss[SUMS] = {NO_LANES};
    UNROLLED_BY_LANES
    for (int j = 0; j < even; j += LANES) {
        Lanes speed = lanes_at(v + j), rate = lanes_at(system->grounded + j);
        Lanes turn = lanes_at(angle + j) - lanes_at(straight + j) + eq->beta * speed;
        set_lanes(turns + j, turn);
        set_lanes(x + j, lanes_at(x + j) - rate * turn);
        loss[SUM_OF(j)] += rate * (speed * speed);
    }
    double sum = total(loss);
    for (int k = 0; k < system->spring_count; k++) {
        const Spring *spring = &system->spring[k];
        int a = spring->a, b = spring->b;
        double torque = spring->rate * (turns[b] - turns[a]), swing = v[b] - v[a];
        x[a] += torque;
        x[b] -= torque;
        sum += spring->rate * (swing * swing);
    }
    result->spring_loss = eq->beta * sum;
}

/* Compute the rows -Im(b e) and, in lam, their convective terms Re(b e) v^2.  B is conj(b). */
SIZED void convect(int count, int even, Parts B, Parts e, const double *RESTRICT squares,
                   double *RESTRICT rows, double *RESTRICT lam) {
    Lanes sum[SMALL][SUMS] = {{NO_LANES}};
    UNROLLED_BY_LANES
    for (int j = 0; j < even; j += LANES) {
        Lanes e_re = lanes_at(e.re + j), e_im = lanes_at(e.im + j), square = lanes_at(squares + j);
        UNROLLED
        for (int k = 0; k < count; k++) {
            Lanes re = lanes_at(B.re + k * even + j), im = lanes_at(B.im + k * even + j);
            set_lanes(rows + k * even + j, im * e_re - re * e_im);
            sum[k][SUM_OF(j)] += (re * e_re + im * e_im) * square;
        }
    }
    UNROLLED
    for (int k = 0; k < count; k++) {
        lam[k] = total(sum[k]);
    }
}

/* Compute the rows measured relative to a body, and their convective terms without Im(w^2). */
NOINLINE void carried_rows(const Equations *eq, const Kinematics *at, double *rows,
                           double *convective) {
    const System *system = eq->system;
    for (int c = 0; c < eq->carried_count; c++) {
        int k = eq->carried[c];
        double *row = rows + k * system->wide;
        row_by_direction(&eq->active, k, at->e, row);
        convective[k] = row_convective(&eq->active, k, at->e, at->speed);
        for (int l = 0; l < system->stretch_count; l++) {
            int j = system->stretches[l];
            convective[k] -= row[arm_of(system, j)] * coriolis(system, at->turn, j);
        }
    }
}

SIZED void rows_padded(int even, const Equations *eq, const Kinematics *at, double *rows,
                          double *convective) {
    Parts B = eq->B_conjugate, e = at->e_parts;
    switch (eq->r) {
    case 1: convect(1, even, B, e, at->squares, rows, convective); break;
    case 2: convect(2, even, B, e, at->squares, rows, convective); break;
    case 3: convect(3, even, B, e, at->squares, rows, convective); break;
    default:
        for (int k = 0; k < eq->r; k++) {
            convect_intervals(&eq->intervals.directions, k, parts_from(B, k * even), e, at->squares,
                          rows + k * even, convective + k);
        }
    }
    if (eq->carried_count > 0) {
        carried_rows(eq, at, rows, convective);
    }
}

PRBM void rows_and_convection(const Equations *eq, const Kinematics *at, double *rows,
                              double *convective) {
    rows_padded(eq->system->wide, eq, at, rows, convective);
}

SHARED void rows_dispatch(int even, const Equations *eq, const Kinematics *at, double *rows,
                           double *convective) {
    if (IS_CONSTANT(even)) {
        rows_padded(even, eq, at, rows, convective);
    } else {
        rows_and_convection(eq, at, rows, convective);
    }
}

/* --- inertia ---------------------------------------------------------------------------------- */

/* Compute the upper triangle of a block of M, of a size up to SMALL, and add its quadratic velocity
 * terms Im(diag(e)^H H diag(e)) v^2 to the loads x.  M is symmetric, the matrix of these terms
 * antisymmetric. */
SIZED void small_inertia(int size, const Complex *RESTRICT H, const double *RESTRICT own, Parts e,
                         const double *RESTRICT squares, double *RESTRICT M, double *RESTRICT x) {
    UNROLLED
    for (int i = 0; i < size; i++) {
        M[i * size + i] = own[i];
        UNROLLED
        for (int j = 0; j < size; j++) {
            if (j > i) {
                double re = e.re[i] * e.re[j] + e.im[i] * e.im[j];
                double im = e.re[i] * e.im[j] - e.im[i] * e.re[j];
                double turned = H[i * size + j].re * im + H[i * size + j].im * re;
                M[i * size + j] = H[i * size + j].re * re - H[i * size + j].im * im;
                x[i] += turned * squares[j];
                x[j] -= turned * squares[i];
            }
        }
    }
}

/* The same for a block of any size, by pairs.  The last pair of a row may exceed it: H is zero there,
 * and what is stored there in M is replaced by the next row, or not used. */
static void block_inertia(int size, const int *last, Parts H, const double *own, Parts e,
                          const double *squares, double *M, double *x) {
    for (int i = 0; i < size; i++) {
        Lanes own_re = all_lanes(e.re[i]), own_im = all_lanes(e.im[i]);
        Lanes square = all_lanes(squares[i]), sum[SUMS] = {NO_LANES};
        for (int j = i + 1; j <= last[i]; j += PAIR) {
            UNROLLED
            for (int l = j; l < j + PAIR; l += LANES) {
                Lanes e_re = lanes_at(e.re + l), e_im = lanes_at(e.im + l);
                Lanes h_re = lanes_at(H.re + i * size + l), h_im = lanes_at(H.im + i * size + l);
                Lanes re = own_re * e_re + own_im * e_im, im = own_re * e_im - own_im * e_re;
                Lanes turned = h_re * im + h_im * re;
                set_lanes(M + i * size + l, h_re * re - h_im * im);
                sum[SUM_OF(l - j)] += turned * lanes_at(squares + l);
                set_lanes(x + l, lanes_at(x + l) - turned * square);
            }
        }
        M[i * size + i] = own[i];
        x[i] += total(sum);
    }
}

/* Return the number of rows to which U^-1 is applied block by block, if they are few. */
static int rows_with_blocks(const Equations *eq) {
    return eq->r <= SMALL ? eq->r : 0;
}

/* Factor a block of M into U, and apply U^-1 to loads and rows. */
NOINLINE bool factor_block(const Equations *eq, Evaluation *result, const Block *block,
                           const double *M, double *U) {
    const int start = block->start, size = block->size, *last = eq->system->last + start;
    if (!factor_any(size, last, M, U, result->factors.inverse + start)) {
        return false;
    }
    forward_block(size, last, U, 1, 0, result->a + start);
    forward_block(size, last, U, rows_with_blocks(eq), eq->system->even, result->factors.Z + start);
    return true;
}

/* Compute and factor a block of M of any size. */
static bool block_motion(const Equations *eq, Evaluation *result, const Block *block, Parts H,
                         double *U) {
    const int start = block->start, size = block->size;
    const Kinematics *at = &result->at;
    double *M = result->block;
    block_inertia(size, eq->system->last + start, H, own_inertia(eq->system, at) + start,
                  parts_from(at->e_parts, start), at->squares + start, M, result->a + start);
    return factor_block(eq, result, block, M, U);
}

/* Compute and factor a small block of M.  Blocks of tiny or huge numbers take the general path. */
SIZED bool small_block_motion(const Equations *eq, Evaluation *result, int size,
                              const Block *block, const Complex *H, double *U) {
    const int even = eq->system->even, r = rows_with_blocks(eq), start = block->start;
    const Kinematics *at = &result->at;
    double M[SMALL * SMALL], D[SMALL];
    small_inertia(size, H, own_inertia(eq->system, at) + start, parts_from(at->e_parts, start),
                  at->squares + start, M, result->a + start);
    if (!small_factor(size, M, U, D)) {
        UNROLLED
        for (int i = 0; i < size * size; i++) {
            result->block[i] = i / size <= i % size ? M[i] : 0.0;
        }
        return factor_block(eq, result, block, result->block, U);
    }
    put_block(size, start, D, result->factors.inverse);
    solve_small(size, start, U, result->a, FORWARD);
    for (int k = 0; k < r; k++) {
        solve_small(size, start, U, result->factors.Z + k * even, FORWARD);
    }
    return true;
}

/* As factor_block, for a guide on two beams. */
NOINLINE bool factor_guide_block(const Equations *eq, Evaluation *result, int start,
                                 const double *M, double *U) {
    if (!factor_guide(M, U, result->factors.inverse + start)) {
        return false;
    }
    solve_guide(U, result->a + start, FORWARD);
    for (int k = 0; k < rows_with_blocks(eq); k++) {
        solve_guide(U, result->factors.Z + k * eq->system->even + start, FORWARD);
    }
    return true;
}

/* Factor the blocks of the mass matrix in result->mass. */
NOINLINE bool mapped_blocks_motion(const Equations *eq, Evaluation *result) {
    bool regular = true;
    const double *M = result->mass;
    double *U = result->factors.U;
    for (int k = 0; k < result->factors.block_count; k++) {
        const Block *block = &result->factors.blocks[k];
        int start = block->start, size = block->size;
        regular = (block->split > 0 ? factor_guide_block(eq, result, start, M, U)
                                    : factor_block(eq, result, block, M, U)) &&
                  regular;
        M += size * size;
        U += size * size;
    }
    return regular;
}

static bool blocks_motion(const Equations *eq, Evaluation *result) {
    if (eq->system->mapped) {
        return mapped_blocks_motion(eq, result);
    }
    bool regular = true;
    int first = 0;
    double *U = result->factors.U;
    for (int k = 0; k < result->factors.block_count; k++) {
        const Block *block = &result->factors.blocks[k];
        int size = block->size;
        const Complex *H = eq->system->coupling + first;
        switch (eq->system->definite ? size : 0) {
        case 1: regular = small_block_motion(eq, result, 1, block, H, U) && regular; break;
        case 2: regular = small_block_motion(eq, result, 2, block, H, U) && regular; break;
        case 3: regular = small_block_motion(eq, result, 3, block, H, U) && regular; break;
        case 4: regular = small_block_motion(eq, result, 4, block, H, U) && regular; break;
        default:
            regular = block_motion(eq, result, block,
                                   parts_from(eq->system->coupling_parts, first), U) &&
                      regular;
        }
        first += size * size;
        U += size * size;
    }
    return regular;
}

/* --- directions that are not coordinates ------------------------------------------------------ */

/* Compute Im(w^2) of all arms. */
static void find_shift(const System *system, const Kinematics *at, double *shift) {
    zeros(system->wide, shift);
    for (int k = 0; k < system->stretch_count; k++) {
        int j = system->stretches[k];
        shift[arm_of(system, j)] = coriolis(system, at->turn, j);
    }
}

/* Compute M, add the quadratic velocity terms to the loads of the directions, and pull loads and
 * rows back to the coordinates. */
static void blocks_to_coordinates(const Equations *eq, Evaluation *result) {
    const System *system = eq->system;
    const double *own = own_inertia(system, &result->at);
    if (system->stretch_count > 0) {
        find_shift(system, &result->at, result->shift);
    }
    branch_terms(system, own, eq->dense ? eq->r : 0, result);
}

PRBM void rows_to_coordinates(const Equations *eq, const double *rows, double *out) {
    const System *system = eq->system;
    const Intervals *to = &eq->intervals.coordinates, *from = &eq->intervals.directions;
    if (eq->dense) {
        zeros(eq->r * system->even, out);
        for (int b = 0; b < system->branch_count; b++) {
            for (int k = 0; k < eq->r; k++) {
                branch_to_coordinates(&system->branches[b], rows + k * system->wide,
                                      out + k * system->even);
            }
        }
        return;
    }
    for (int k = 0; k < eq->r; k++) {
        for (int s = to->first[k]; s < to->first[k + 1]; s++) {
            zeros(to->list[s].end - to->list[s].start, out + to->list[s].start);
        }
        for (int s = from->first[k]; s < from->first[k + 1]; s++) {
            branch_to_coordinates(&system->branches[from->list[s].branch], rows, out);
        }
        rows += system->wide;
        out += system->even;
    }
}

/* Compute loads, rows and mass matrix of the directions, and pull them back to the coordinates. */
NOINLINE void mapped_terms(const Equations *eq, const Reference *near, Evaluation *result) {
    const System *system = eq->system;
    const int even = system->even, wide = system->wide;
    double *Z = result->factors.Z;
    map_motion(system, &result->at);
    directions_of(wide, system, near, &result->at);
    find_loads(wide, eq, result);
    rows_padded(wide, eq, &result->at, result->rows, result->lam);
    for (int j = 0; j < even; j += LANES) {
        set_lanes(result->a + j, all_lanes(0.0));
    }
    if (eq->dense) {
        zeros(eq->r * even, Z);
    }
    blocks_to_coordinates(eq, result);
    if (!eq->dense) {
        rows_to_coordinates(eq, result->rows, Z);
    }
    for (int k = 0; system->stretch_count > 0 && k < eq->r; k++) {
        result->lam[k] +=
            interval_product(&eq->intervals.directions, k, result->rows + k * wide, result->shift);
    }
}

/* --- energy ----------------------------------------------------------------------------------- */

/* Return the kinetic energy v^T U D U^T v / 2 at the evaluated velocities, from the factors of M. */
PRBM double kinetic_energy_of(const Evaluation *evaluation) {
    const Factors *factors = &evaluation->factors;
    const double *U = factors->U, *v = evaluation->at.speed;
    double *rates = evaluation->row, sum = 0.0;
    zeros(factors->even, rates);
    for (int k = 0; k < factors->block_count; k++) {
        int start = factors->blocks[k].start, size = factors->blocks[k].size;
        for (int i = 0; i < size; i++) {
            rates[start + i] += v[start + i];
            const int behind = factors->last[start + i] - i;
            add_scaled(behind, v[start + i], U + i * size + i + 1, rates + start + i + 1);
            sum += rates[start + i] * rates[start + i] / factors->inverse[start + i];
        }
        U += size * size;
    }
    return 0.5 * sum;
}

/* --- contacts --------------------------------------------------------------------------------- */

/* Add the forces of pressed compliant stops. */
NOINLINE void add_pressure(const Equations *eq, Evaluation *result) {
    Rows gaps = gap_rows(eq->system);
    double t = result->at.time;
    for (int k = 0; k < eq->pressed_count; k++) {
        int i = eq->pressed[k];
        const double *extra = result->at.extra;
        row_jacobian(&gaps, i, result->at.e, result->row);
        double d = -gap(eq, i, t, result->at.e, extra);
        double rate = -dot(eq->system->n, result->row, result->at.speed) -
                      wall_motion(&eq->inputs.walls[i], t).v -
                      recoil_of(eq, i, extra, EXTRA_RECOIL_RATE);
        double force = contact_force(&eq->laws[i], &eq->contacts.touching[i], d, rate);
        result->pressure[i] = force;
        result->contact_loss[i] = (force - elastic_force(&eq->laws[i], d)) * rate;
        add_scaled(eq->system->n, force, result->row, result->a);
    }
}

/* Add pressed stops and their friction, slipping friction points, and the accelerations of the
 * walls of held stops. */
NOINLINE void add_contacts_and_walls(const Equations *eq, Evaluation *result) {
    add_pressure(eq, result);
    for (int k = eq->slipping_rows; k < eq->slipping_count; k++) {
        double force = slip_force(eq, result->at.e, result, eq->slipping[k]);
        tangential_row(eq->system, eq->slipping[k], result->at.e, result->row);
        add_scaled(eq->system->n, force, result->row, result->a);
    }
    for (int k = 0; eq->walls_move && k < eq->held_count; k++) {
        const Wall *wall = &eq->inputs.walls[eq->held[k]];
        result->lam[eq->first_hold + k] -= wall_motion(wall, result->at.time).a;
    }
}

/* Set the columns of slipping stops and guides.  Coulomb's law adds a force along the wall or line to
 * the normal force, so that the column of such a contact differs from its row. */
NOINLINE void set_columns(const Equations *eq, Evaluation *result) {
    const System *system = eq->system;
    int n = system->n, even = system->even;
    result->factors.Z_columns = result->columns;
    copy(eq->r * even, result->factors.Z, result->columns);
    for (int k = 0; k < eq->slipping_rows; k++) {
        int contact = eq->slipping[k], h = normal_row(eq, contact);
        int side = is_stop(system, contact) ? 1 : eq->contacts.sides[contact - system->s];
        double share = -friction_coefficient(eq, contact) * slip_sign(eq->contacts.modes[contact]);
        double *column = result->columns + h * even;
        share *= side;
        row_jacobian(&eq->active, h, result->at.e, column);
        tangential_row(system, contact, result->at.e, result->row);
        add_scaled(n, share, result->row, column);
        forward_all(&result->factors, column);
    }
}

/* --- accelerations ---------------------------------------------------------------------------- */

/* Compute the factors from the rows in Z, and replace a by U^-1 a. */
SIZED bool factor_motion(int even, const Equations *eq, Evaluation *result) {
    result->factors.r = eq->r;
    result->factors.block_count = eq->system->mass_block_count;
    result->factors.intervals = &eq->intervals.coordinates;
    if (!blocks_motion(eq, result)) {
        return false;
    }
    if (eq->r > SMALL) {
        forward_rows(&result->factors);
    }
    result->factors.Z_columns = result->factors.Z;
    result->factors.least = eq->system->least_mobility;
    if (eq->slipping_rows > 0) {
        set_columns(eq, result);
    }
    return schur_dispatch(even, &result->factors);
}

NOINLINE void add_coriolis(const System *system, Evaluation *result) {
    for (int k = 0; k < system->stretch_count; k++) {
        int j = system->stretches[k];
        result->a[arm_of(system, j)] += coriolis(system, result->at.turn, j);
    }
}

/* Damping c M v, proportional to mass, changes the accelerations by -c v.  The other part of them
 * therefore has the right side of the rows plus c rows v. */
NOINLINE void damp_rows(const Equations *eq, Evaluation *result) {
    for (int k = 0; k < eq->r; k++) {
        const double *row = result->factors.Z + k * eq->system->even;
        result->lam[k] += eq->mass_damping * interval_product(&eq->intervals.coordinates, k, row,
                                                              result->at.speed);
    }
}

/* Solve for a and lam at the time, angles and rates of the evaluation. */
SHARED bool motion_of_length(int even, const Equations *eq, const Reference *near,
                            Evaluation *result) {
    if (eq->system->mapped) {
        mapped_terms(eq, near, result);
    } else {
        directions_of(even, eq->system, near, &result->at);
        find_loads(even, eq, result);
        rows_dispatch(even, eq, &result->at, result->rows, result->lam);
    }
    add_springs(even, eq, result);
    if (damper_count(eq->system) > 0) {
        const Kinematics *at = &result->at;
        result->spring_loss +=
            add_motion_forces(eq->system, eq->contacts.coils, eq->beta, at->angle, at->e, at->speed,
                              result->a, result->row);
    }
    if (eq->contacts_or_walls) {
        add_contacts_and_walls(eq, result);
    }
    if (eq->mass_damping != 0.0) {
        damp_rows(eq, result);
    }
    if (!factor_motion(even, eq, result)) {
        return false;
    }
    finish_dispatch(even, &result->factors, result->a, result->lam);
    if (eq->mass_damping != 0.0) {
        add_scaled(eq->system->n, -eq->mass_damping, result->at.speed, result->a);
    }
    if (eq->system->stretch_count > 0 && !eq->system->mapped) {
        add_coriolis(eq->system, result);
    }
    return true;
}

PRBM bool evaluate_equations(const Equations *equations, double t, const double *q,
                             const double *v, const double *extra, const Reference *near,
                             Evaluation *result, Problem *problem) {
    int n = equations->system->n;
    pad(n, q, result->at.angle);
    pad(n, v, result->at.speed);
    result->at.time = t;
    result->at.extra = extra;
    return motion_of_length(equations->system->even, equations, near, result) ||
           fail(problem, "%s", SINGULAR);
}

PRBM bool factor_equations(const Equations *equations, const double *q, const double *v,
                           const Reference *near, Evaluation *result, Problem *problem) {
    const System *system = equations->system;
    pad(system->n, q, result->at.angle);
    pad(system->n, v, result->at.speed);
    if (system->mapped) {
        mapped_terms(equations, near, result);
    } else {
        find_directions(system, near, &result->at);
        find_loads(system->even, equations, result);
        rows_and_convection(equations, &result->at, result->rows, result->lam);
    }
    return factor_motion(system->even, equations, result) ||
           fail(problem, "%s", SINGULAR);
}
