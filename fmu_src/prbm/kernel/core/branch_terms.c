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

/* Store the pair i of the directions of a branch; a last one alone, because the next number belongs
 * to the next branch. */
SIZED void set_pair(int size, int i, Lanes pair, double *out) {
    if (i + LANES <= size) {
        set_lanes(out + i, pair);
    } else {
        out[i] = LANE(pair, 0);
    }
}

/* Compute the directions theta of the coordinates x, and their rates turn from the rates v. */
SIZED void map_branch(int size, int count, const Branch *branch, const double *RESTRICT x,
                      const double *RESTRICT v, double *RESTRICT theta, double *RESTRICT turn) {
    const int even = even_length(size), *coordinate = branch->coordinate;
    UNROLLED
    for (int i = 0; i < size; i += LANES) {
        Lanes each = aligned_lanes(branch->change + i);
        Lanes angle = x[coordinate[0]] * each, rate = v[coordinate[0]] * each;
        UNROLLED
        for (int c = 1; c < count; c++) {
            each = aligned_lanes(branch->change + c * even + i);
            angle += x[coordinate[c]] * each;
            rate += v[coordinate[c]] * each;
        }
        set_pair(size, i, angle, theta + branch->start);
        set_pair(size, i, rate, turn + branch->start);
    }
}

PRBM void map_motion(const System *system, Kinematics *at) {
    const double *x = at->angle, *v = at->speed;
    double *theta = at->theta, *turn = at->turn;
    for (int k = 0; k < system->branch_count; k++) {
        const Branch *branch = &system->branches[k];
        switch (branch->code) {
        case LEAF_5: map_branch(5, LEAF_COORDINATES, branch, x, v, theta, turn); break;
        case LEAF_5_BODY:
        case LEAF_6: map_branch(6, LEAF_COORDINATES, branch, x, v, theta, turn); break;
        case LEAF_6_BODY: map_branch(7, LEAF_COORDINATES, branch, x, v, theta, turn); break;
        case ANY_BRANCH: map_branch(branch->size, branch->count, branch, x, v, theta, turn);
        }
    }
}

PRBM void map_directions(const System *system, const double *x, double *theta) {
    for (int j = 0; j < system->d; j++) {
        theta[j] = direction_of(system, x, j);
    }
}

/* Add derivatives x by the directions of a branch, pulled back to the coordinates, to out. */
SIZED void pull_back(int size, int count, const Branch *branch, const double *RESTRICT x,
                     double *RESTRICT out) {
    const int even = even_length(size), paired = size - size % PAIR;
    x += branch->start;
    UNROLLED
    for (int c = 0; c < count; c++) {
        const double *change = branch->change + c * even;
        Lanes sum[SUMS] = {NO_LANES};
        UNROLLED
        for (int i = 0; i < paired; i += LANES) {
            sum[SUM_OF(i)] += lanes_at(x + i) * aligned_lanes(change + i);
        }
        double *to = &out[branch->coordinate[c]];
        *to += paired < size ? total(sum) + x[paired] * change[paired] : total(sum);
    }
}

PRBM void branch_to_coordinates(const Branch *branch, const double *x, double *out) {
    pull_back(branch->size, branch->count, branch, x, out);
}

/* --- mass ------------------------------------------------------------------------------------- */

/* Compute the masses M of the pairs of directions of a branch, in padded rows, and add the
 * quadratic velocity terms to the loads x.  shift: Im(w^2) of the arms, if they stretch. */
SIZED void couple(int size, int real, bool stretching, Parts H, Parts e,
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
                if (i >= real) {
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

/* The same for a leaf, all masses at once.  The pairs of a body, in the row behind the real ones,
 * change the masses of its coordinate only, the last ones. */
SIZED void pull_leaf_pairs(int size, int real, const Branch *branch, const double *RESTRICT M,
                           double *RESTRICT mass) {
    const double *product = branch->products;
    Lanes sum[LEAF_MASSES] = {NO_LANES};
    UNROLLED
    for (int i = 1; i < size; i++) {
        UNROLLED
        for (int j = 0; j < size; j++) {
            if (j < i) {
                UNROLLED
                for (int k = 0; k < LEAF_MASSES; k += LANES) {
                    if (i < real || k >= LEAF_MASSES - LEAF_BODY_MASSES) {
                        sum[k] += M[j] * aligned_lanes(product + k);
                    }
                }
                product += LEAF_MASSES;
            }
        }
        M += even_length(i);
    }
    UNROLLED
    for (int k = 0; k < LEAF_MASSES; k++) {
        mass[branch->own[k]] += LANE(sum[k - k % LANES], k % LANES);
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

/* Add the terms of the pairs of directions of a branch, and pull the loads and r rows back. */
SIZED void own_terms(int size, int real, int count, bool stretching, const System *system,
                     const Branch *branch, const double *own, int r, Evaluation *result) {
    const Kinematics *at = &result->at;
    const int start = branch->start;
    double *M = result->block;
    couple(size, real, stretching, branch->H, parts_from(at->e_parts, start), at->squares + start,
           result->shift + start, M, result->load + start);
    for (int i = 0; stretching && i < size; i++) {
        result->load[start + i] += own[start + i] * result->shift[start + i];
    }
    if (branch->code != ANY_BRANCH) {
        pull_leaf_pairs(size, real, branch, M, result->mass);
    } else if (branch->identity) {
        add_pairs(branch, M, own + start, result->mass);
    } else {
        if (stretching) {
            pad(size, own + start, M + branch->pairs - even_length(size));
        }
        pull_pairs(branch->pairs, count, branch, M, result->mass);
    }
    pull_back(size, count, branch, result->load, result->a);
    for (int k = 0; k < r; k++) {
        pull_back(size, count, branch, result->rows + k * system->wide,
                  result->factors.Z + k * system->even);
    }
}

/* Compute the vectors along the arms of a branch, turned (even,), and return the sum of their
 * products with -i w^2. */
static Complex turned_vectors(const System *system, const Branch *branch, Parts vectors,
                              const Evaluation *result, Parts turned) {
    const int even = branch->even;
    const Parts e = parts_from(result->at.e_parts, branch->start);
    const double *squares = result->at.squares + branch->start;
    for (int i = 0; i < even; i += LANES) {
        Lanes re = aligned_lanes(vectors.re + i), im = aligned_lanes(vectors.im + i);
        Lanes e_re = lanes_at(e.re + i), e_im = lanes_at(e.im + i);
        set_lanes(turned.re + i, re * e_re - im * e_im);
        set_lanes(turned.im + i, re * e_im + im * e_re);
    }
    Complex bent = {even_dot(even, turned.im, squares), -even_dot(even, turned.re, squares)};
    if (system->stretch_count > 0) {
        const double *shift = result->shift + branch->start;
        bent.re += even_dot(even, turned.re, shift);
        bent.im += even_dot(even, turned.im, shift);
    }
    return bent;
}

/* Return the sum of vectors along the arms of a branch, changed by one of its coordinates. */
static Complex changed(const Branch *branch, Parts turned, int c) {
    const double *change = branch->change + c * branch->even;
    return complex_of(even_dot(branch->even, turned.re, change),
                      even_dot(branch->even, turned.im, change));
}

/* Compute the motion of the root of a branch: P and, at last, the additional column. */
static void move_root(const System *system, const Branch *branch, Evaluation *result) {
    const Branch *carrier = &system->branches[branch->parent];
    const Complex *before = result->roots + carrier->root;
    Complex *P = result->roots + branch->root;
    Complex bent = turned_vectors(system, carrier, branch->lever, result, result->turned);
    memcpy(P, before, (size_t)carrier->reach * sizeof *P);
    zeros(2 * (branch->reach - carrier->reach), (double *)(P + carrier->reach));
    P[branch->reach] = plus(before[carrier->reach], bent);
    for (int c = 0; c < carrier->count; c++) {
        Complex *moved = &P[branch->slot[c]];
        *moved = plus(*moved, changed(carrier, result->turned, c));
    }
}

/* Add the terms of a branch with the motion of its root. */
static void root_terms(const System *system, const Branch *branch, Evaluation *result) {
    const Complex *P = result->roots + branch->root, bent = P[branch->reach];
    Complex *V = result->moments;
    Complex turned = turned_vectors(system, branch, branch->S, result, result->turned);
    double *mass = result->mass, *a = result->a;
    for (int c = 0; c < branch->count; c++) {
        V[c] = changed(branch, result->turned, c);
        a[branch->coordinate[c]] += V[c].re * bent.re + V[c].im * bent.im;
    }
    for (int k = 0; k < branch->reach; k++) {
        const Complex moved = P[k];
        const int *index = branch->coupled + k * branch->count, both = branch->both[k];
        a[branch->path[k]] += moved.re * turned.re + moved.im * turned.im;
        for (int c = 0; c < branch->count; c++) {
            mass[index[c]] += moved.re * V[c].re + moved.im * V[c].im;
        }
        if (both != FIXED) {
            mass[index[both]] += moved.re * V[both].re + moved.im * V[both].im;
        }
    }
}

/* Add the terms of the pairs of directions, by code for this branch if the compiler knows it. */
static void add_own_terms(const System *s, const Branch *branch, const double *own, int r,
                          Evaluation *result) {
    switch (branch->code) {
    case LEAF_5: own_terms(5, 5, LEAF_COORDINATES, false, s, branch, own, r, result); break;
    case LEAF_5_BODY: own_terms(6, 5, LEAF_COORDINATES, false, s, branch, own, r, result); break;
    case LEAF_6: own_terms(6, 6, LEAF_COORDINATES, false, s, branch, own, r, result); break;
    case LEAF_6_BODY: own_terms(7, 6, LEAF_COORDINATES, false, s, branch, own, r, result); break;
    case ANY_BRANCH:
        own_terms(branch->size, branch->real, branch->count, s->stretch_count > 0, s, branch, own,
                  r, result);
    }
}

PRBM void branch_terms(const System *system, const double *own, int r, Evaluation *result) {
    memcpy(result->mass, system->constant_mass, system->mass_size * sizeof *result->mass);
    for (int k = 0; k < system->branch_count; k++) {
        const Branch *branch = &system->branches[k];
        if (branch->parent != FIXED) { /* Roots on the ground do not move: zeros. */
            move_root(system, branch, result);
            root_terms(system, branch, result);
        }
        add_own_terms(system, branch, own, r, result);
    }
}
