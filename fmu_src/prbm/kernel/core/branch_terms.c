/* The mass matrix, the quadratic velocity terms, and the map to the directions, branch by branch.
 *
 * A flexure passes on to what is behind it nothing but the motion of its tip.  The points of a
 * branch, and those behind it, are therefore at
 *
 *     z = root + A E,
 *
 * with A for the directions of the branch, and those behind it.  Let P_a be the change of root with
 * the coordinate a, divided by i, and V_b that of the first moment of mass, sum_j S_j e_j Phi_jb,
 * over the directions j of the branch.  Then the mass matrix is the sum over the branches of
 *
 *     Phi^T Re(diag(e)^H H diag(e)) Phi + Re(P^H V) + Re(V^H P),
 *
 * with the H of the directions of the branch alone.  An additional column -i w^2 of Phi, with the
 * complex rates w of the arms, gives the quadratic velocity terms in the same way.
 */
#include <string.h>

#include "core/branch_terms.h"
#include "core/matrix.h"
#include "core/vectors.h"

/* --- directions and derivatives --------------------------------------------------------------- */

/* Compute the directions out of the coordinates x. */
SIZED void map_branch(int size, const Branch *branch, const double *RESTRICT x,
                      double *RESTRICT out) {
    const int even = even_length(size);
    UNROLLED
    for (int i = 0; i < size; i += LANES) {
        Lanes sum = NO_LANES;
        for (int c = 0; c < branch->count; c++) {
            sum += x[branch->coordinate[c]] * aligned_lanes(branch->change + c * even + i);
        }
        if (i + LANES <= size) {
            set_lanes(out + branch->start + i, sum);
        } else {
            out[branch->start + i] = LANE(sum, 0);
        }
    }
}

static void map_any(const Branch *branch, const double *x, double *out) {
    switch (branch->size) {
    case 1: out[branch->start] = x[branch->coordinate[0]]; break;
    case 5: map_branch(5, branch, x, out); break;
    case 6: map_branch(6, branch, x, out); break;
    default: map_branch(branch->size, branch, x, out);
    }
}

PRBM void map_directions(const System *system, const double *x, double *out) {
    for (int k = 0; k < system->branch_count; k++) {
        map_any(&system->branches[k], x, out);
    }
}

PRBM void map_motion(const System *system, Kinematics *at) {
    for (int k = 0; k < system->branch_count; k++) {
        map_any(&system->branches[k], at->angle, at->theta);
        map_any(&system->branches[k], at->speed, at->turn);
    }
}

/* Add the derivatives by the directions x, pulled back to the coordinates, to out. */
SIZED void pull_branch(int size, const Branch *branch, const double *RESTRICT x,
                       double *RESTRICT out) {
    const int even = even_length(size), paired = size - size % PAIR;
    x += branch->start;
    for (int c = 0; c < branch->count; c++) {
        const double *change = branch->change + c * even;
        Lanes sum[SUMS] = {NO_LANES};
        UNROLLED
        for (int i = 0; i < paired; i += LANES) {
            sum[SUM_OF(i)] += lanes_at(x + i) * aligned_lanes(change + i);
        }
        double last = paired < size ? x[paired] * change[paired] : 0.0;
        out[branch->coordinate[c]] += total(sum) + last;
    }
}

static void pull_any(const Branch *branch, const double *x, double *out) {
    switch (branch->size) {
    case 1: out[branch->coordinate[0]] += x[branch->start]; break;
    case 5: pull_branch(5, branch, x, out); break;
    case 6: pull_branch(6, branch, x, out); break;
    default: pull_branch(branch->size, branch, x, out);
    }
}

static void pull_rows(const System *system, const Branch *branch, int r, const double *x,
                      double *out) {
    for (int row = 0; row < r; row++) {
        pull_any(branch, x + row * system->wide, out + row * system->even);
    }
}

PRBM void pull_directions(const System *system, int r, const double *x, double *out) {
    for (int k = 0; k < system->branch_count; k++) {
        pull_rows(system, &system->branches[k], r, x, out);
    }
}

/* --- mass ------------------------------------------------------------------------------------- */

/* Compute the masses M of the pairs of directions of a branch, in padded rows, and add the
 * quadratic velocity terms to the loads x.  shift: Im(w^2) of the arms, if they stretch. */
SIZED void couple(int size, bool real, bool stretching, Parts H, Parts e,
                  const double *RESTRICT squares, const double *RESTRICT shift,
                  double *RESTRICT M, double *RESTRICT x) {
    const int even = even_length(size);
    UNROLLED
    for (int i = 1; i < size; i++) {
        Lanes own_re = all_lanes(e.re[i]), own_im = all_lanes(e.im[i]);
        Lanes square = all_lanes(squares[i]), sum[SUMS] = {NO_LANES};
        Lanes shifted = all_lanes(stretching ? shift[i] : 0.0);
        const int columns = IS_CONSTANT(size) ? even : even_length(i);
        UNROLLED
        for (int j = 0; j < columns; j += LANES) {
            if (j < even_length(i)) {
                Lanes e_re = lanes_at(e.re + j), e_im = lanes_at(e.im + j);
                Lanes re = own_re * e_re + own_im * e_im, im = own_re * e_im - own_im * e_re;
                Lanes h_re = aligned_lanes(H.re + i * even + j);
                Lanes mass = h_re * re, turned = h_re * im;
                if (!real) {
                    Lanes h_im = aligned_lanes(H.im + i * even + j);
                    mass -= h_im * im;
                    turned += h_im * re;
                }
                set_lanes(M + j, mass);
                Lanes term = turned * lanes_at(squares + j), load = -(turned * square);
                if (stretching) {
                    term += mass * lanes_at(shift + j);
                    load += mass * shifted;
                }
                sum[SUM_OF(j)] += term;
                set_lanes(x + j, lanes_at(x + j) + load);
            }
        }
        M += even_length(i);
        x[i] += total(sum);
    }
}

/* Add the masses of the pairs of directions, M, to the mass matrix of the coordinates. */
SIZED void pull_pairs(int pairs, int count, const Branch *branch, const double *RESTRICT M,
                      double *RESTRICT mass) {
    const double *product = branch->products;
    for (int k = 0; k < count * (count + 1) / 2; k++) {
        Lanes sum[SUMS] = {NO_LANES};
        UNROLLED
        for (int i = 0; i < pairs; i += LANES) {
            sum[SUM_OF(i)] += aligned_lanes(M + i) * aligned_lanes(product + i);
        }
        mass[branch->own[k]] += total(sum);
        product += pairs;
    }
}

/* Add the masses of the pairs of directions that are coordinates. */
static void add_pairs(const Branch *branch, const double *M, const double *own, double *mass) {
    const int *index = branch->own;
    for (int i = 0; i < branch->size; i++) {
        for (int j = 0; j < i; j++) {
            mass[*index++] += M[j];
        }
        mass[*index++] += own[i];
        M += i > 0 ? even_length(i) : 0;
    }
}

/* Add the terms of the pairs of directions of a branch. */
SIZED void own_terms(int size, int count, bool real, bool stretching, const Branch *branch,
                     const double *own, Evaluation *result) {
    const Kinematics *at = &result->at;
    const int start = branch->start;
    double *M = result->block;
    couple(size, real, stretching, branch->H, parts_from(at->e_parts, start), at->squares + start,
           result->shift + start, M, result->load + start);
    for (int i = 0; stretching && i < size; i++) {
        result->load[start + i] += own[start + i] * result->shift[start + i];
    }
    if (branch->identity) {
        add_pairs(branch, M, own + start, result->mass);
        return;
    }
    if (stretching) {
        pad(size, own + start, M + branch->pairs - even_length(size));
    }
    const int pairs = IS_CONSTANT(size) ? (size - size % PAIR) * (size / PAIR + size % PAIR)
                                        : branch->pairs;
    pull_pairs(pairs, count, branch, M, result->mass);
}

/* Compute the motion of the root of a branch: P and, at last, the additional column. */
static void move_root(const System *system, const Branch *branch, Evaluation *result) {
    const Branch *carrier = &system->branches[branch->parent];
    const Complex *before = result->roots + carrier->root;
    const double *shift = result->shift, *squares = result->at.squares;
    Complex *P = result->roots + branch->root, *bent = &P[branch->reach];
    memcpy(P, before, (size_t)carrier->reach * sizeof *P);
    zeros(2 * (branch->reach - carrier->reach), (double *)(P + carrier->reach));
    *bent = before[carrier->reach];
    for (int i = 0; i < carrier->size; i++) {
        int j = carrier->start + i;
        Complex arm = product(branch->lever[i], result->at.e[j]);
        for (int c = 0; c < carrier->count; c++) {
            Complex *moved = &P[branch->slot[c]];
            *moved = plus(*moved, scaled(carrier->change[c * carrier->even + i], arm));
        }
        *bent = plus(*bent, product(arm, complex_of(shift[j], -squares[j])));
    }
}

/* Add the terms of a branch with the motion of its root. */
static void root_terms(const System *system, const Branch *branch, Evaluation *result) {
    const Complex *P = result->roots + branch->root, bent = P[branch->reach];
    const double *shift = result->shift, *squares = result->at.squares;
    double *mass = result->mass, *a = result->a;
    Complex turned = {0.0, 0.0}, *V = result->moments;
    zeros(2 * branch->count, (double *)V);
    for (int i = 0; i < branch->size; i++) {
        int j = branch->start + i;
        Complex moment = product(system->S[arm_of(system, j)], result->at.e[j]);
        for (int c = 0; c < branch->count; c++) {
            V[c] = plus(V[c], scaled(branch->change[c * branch->even + i], moment));
        }
        turned = plus(turned, product(moment, complex_of(shift[j], -squares[j])));
    }
    for (int c = 0; c < branch->count; c++) {
        a[branch->coordinate[c]] += product(conjugate(V[c]), bent).re;
    }
    for (int k = 0; k < branch->reach; k++) {
        Complex moved = conjugate(P[k]);
        const int *index = branch->coupled + k * branch->count, both = branch->both[k];
        a[branch->path[k]] += product(moved, turned).re;
        for (int c = 0; c < branch->count; c++) {
            mass[index[c]] += product(moved, V[c]).re;
        }
        if (both != FIXED) {
            mass[index[both]] += product(moved, V[both]).re;
        }
    }
}

/* Add the terms of the pairs of directions, by code for this size if the compiler knows it. */
static void add_own_terms(const System *system, const Branch *branch, const double *own,
                          Evaluation *result) {
    enum { BEAM = 4 }; /* Coordinates of a clamped beam of the order 3. */
    const int size = branch->size, count = branch->count;
    const bool plain = branch->real && system->stretch_count == 0 && count == BEAM;
    switch (plain ? size : 0) {
    case 5: own_terms(5, BEAM, true, false, branch, own, result); break;
    case 6: own_terms(6, BEAM, true, false, branch, own, result); break;
    default:
        if (system->stretch_count > 0) {
            own_terms(size, count, false, true, branch, own, result);
        } else {
            own_terms(size, count, false, false, branch, own, result);
        }
    }
}

PRBM void branch_terms(const System *system, const double *own, int r, Evaluation *result) {
    int size = 0;
    for (int k = 0; k < system->mass_block_count; k++) {
        size += system->mass_blocks[k].size * system->mass_blocks[k].size;
    }
    copy(size, system->constant_mass, result->mass);
    for (int k = 0; k < system->branch_count; k++) {
        const Branch *branch = &system->branches[k];
        if (branch->parent == FIXED) {
            result->roots[branch->root] = complex_of(0.0, 0.0);
        } else {
            move_root(system, branch, result);
            root_terms(system, branch, result);
        }
        add_own_terms(system, branch, own, result);
        pull_any(branch, result->load, result->a);
        pull_rows(system, branch, r, result->rows, result->factors.Z);
    }
}
