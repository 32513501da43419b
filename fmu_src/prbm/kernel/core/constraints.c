/* Scalars s = Re(f (B E + z)) + c of the position: the twin of prbm/constraints.py. */
#include <math.h>
#include <string.h>

#include "kernel.h"

#define CLOSED 1e-14        /* of the size of the mechanism: a few roundings of its coordinates */
#define BARELY_CLOSED 1e-12 /* of that size: accepted if the iteration can do no better */

enum { ITERATIONS = 20 }; /* Gauss-Newton converges quadratically: twenty are hopeless */

static const char SINGULAR[] =
    "the equations of motion are singular here: two constraints repeat each other, or a part that "
    "can move has no mass";

/* --- rows ------------------------------------------------------------------------------------- */

PRBM Rows plain_rows(const System *system, int count, const Complex *B, const double *c) {
    Rows rows = {system, count, B, c, NULL, NULL};
    return rows;
}

PRBM Rows gap_rows(const System *system) {
    Rows rows = {system, system->s, system->gaps, system->gaps_c, system->gaps_z, system->on};
    return rows;
}

PRBM Rows slide_rows(const System *system) {
    Rows rows = {system, system->s, system->slides, NULL, system->slides_z, system->on};
    return rows;
}

PRBM Rows rub_rows(const System *system) {
    return plain_rows(system, system->f, system->rubs, NULL);
}

static int seen_from(const Rows *rows, int i) {
    return rows->on == NULL ? FIXED : rows->on[i];
}

/* f (B E + z) of a row that is seen from a body. */
static Complex seen_value(const Rows *rows, int i, const Complex *e) {
    int n = rows->system->n;
    const Complex *B = rows->B + i * n;
    Complex sum = rows->z[i];
    for (int j = 0; j < n; j++) {
        sum = plus(sum, product(B[j], e[j]));
    }
    return product(conjugate(e[rows->on[i]]), sum);
}

PRBM double row_value(const Rows *rows, int i, const Complex *e) {
    int n = rows->system->n;
    const Complex *B = rows->B + i * n;
    if (seen_from(rows, i) != FIXED) {
        return seen_value(rows, i, e).re;
    }
    double sum = 0.0;
    for (int j = 0; j < n; j++) {
        sum += B[j].re * e[j].re - B[j].im * e[j].im;
    }
    return sum;
}

/* B E w */
static Complex swing(const Rows *rows, int i, const Complex *e, const double *v) {
    const System *system = rows->system;
    const Complex *B = rows->B + i * system->n;
    Complex sum = {0.0, 0.0};
    for (int j = 0; j < system->n; j++) {
        sum = plus(sum, scaled(v[j], product(B[j], e[j])));
    }
    for (int k = 0; k < system->stretch_count; k++) {
        int j = system->stretches[k];
        sum = plus(sum, scaled(v[j], product(B[arm_of(system, j)], e[j])));
    }
    return sum;
}

PRBM double row_rate(const Rows *rows, int i, const Complex *e, const double *v) {
    int on = seen_from(rows, i);
    Complex speed = swing(rows, i, e, v);
    if (on == FIXED) {
        return -speed.im;
    }
    return v[on] * seen_value(rows, i, e).im - product(conjugate(e[on]), speed).im;
}

PRBM void row_jacobian(const Rows *rows, int i, const Complex *e, double *row) {
    const System *system = rows->system;
    const Complex *B = rows->B + i * system->n;
    int on = seen_from(rows, i);
    Complex f = on == FIXED ? complex_of(1.0, 0.0) : conjugate(e[on]);
    for (int j = 0; j < system->n; j++) {
        row[j] = -product(f, product(B[j], e[j])).im;
    }
    for (int k = 0; k < system->stretch_count; k++) {
        int j = system->stretches[k];
        row[j] = -product(f, product(B[arm_of(system, j)], e[j])).im;
    }
    if (on != FIXED) {
        row[on] += seen_value(rows, i, e).im;
    }
}

/* Re(f (B E (w - w_b)^2 + z w_b^2)), w_b of the body that a row is seen from */
PRBM double row_convective(const Rows *rows, int i, const Complex *e, const double *v) {
    const System *system = rows->system;
    const Complex *B = rows->B + i * system->n;
    int on = seen_from(rows, i);
    double turn = on == FIXED ? 0.0 : v[on];
    Complex sum = on == FIXED ? complex_of(0.0, 0.0) : scaled(turn * turn, rows->z[i]);
    for (int j = 0; j < system->n; j++) {
        sum = plus(sum, scaled((v[j] - turn) * (v[j] - turn), product(B[j], e[j])));
    }
    for (int k = 0; k < system->stretch_count; k++) {
        int j = system->stretches[k], a = arm_of(system, j);
        Complex more = complex_of(-v[j] * v[j], -2.0 * (v[a] - turn) * v[j]);
        sum = plus(sum, product(more, product(B[a], e[a])));
    }
    return on == FIXED ? sum.re : product(conjugate(e[on]), sum).re;
}

PRBM void scalars(const Rows *rows, const Complex *e, double *s) {
    for (int i = 0; i < rows->count; i++) {
        s[i] = row_value(rows, i, e) + rows->c[i];
    }
}

PRBM void jacobian(const Rows *rows, const Complex *e, double *result) {
    for (int i = 0; i < rows->count; i++) {
        row_jacobian(rows, i, e, result + i * rows->system->n);
    }
}

/* --- saddle points ---------------------------------------------------------------------------- */

PRBM void saddle(int n, int r, const double *M, const double *columns, const double *rows,
                 double *kkt) {
    int size = n + r;
    memset(kkt, 0, (size_t)size * (size_t)size * sizeof *kkt);
    for (int i = 0; i < n; i++) {
        for (int j = 0; j < n; j++) {
            kkt[i * size + j] = M[i * n + j];
        }
        for (int k = 0; k < r; k++) {
            kkt[i * size + n + k] = columns[k * n + i];
            kkt[(n + k) * size + i] = rows[k * n + i];
        }
    }
}

PRBM bool solve(int size, double *kkt, double *right, Scratch *scratch, Problem *problem) {
    size_t mark = scratch->used;
    int *pivot = (int *)take(scratch, (size_t)size);
    bool regular = lu_factor(size, kkt, pivot);
    if (regular) {
        lu_solve(size, kkt, pivot, right);
    }
    scratch->used = mark;
    return regular || fail(problem, "%s", SINGULAR);
}

/* --- the same again and again ----------------------------------------------------------------- */

/* M = L D L^T of the lower triangle of M, L with ones on its diagonal, and the inverse of D; false
 * if M is not positive definite. */
SIZED bool factor_any(int size, const double *ALONE M, double *ALONE L, double *ALONE inverse) {
    for (int i = 0; i < size; i++) {
        double pivot = M[i * size + i];
        for (int j = 0; j < i; j++) {
            double sum = M[i * size + j];
            UNROLLED
            for (int k = 0; k < j; k++) {
                sum -= L[i * size + k] * L[j * size + k];
            }
            L[i * size + j] = sum; /* L_ij D_j so far */
        }
        UNROLLED
        for (int j = 0; j < i; j++) {
            double share = L[i * size + j] * inverse[j];
            pivot -= share * L[i * size + j];
            L[i * size + j] = share;
        }
        if (!(pivot > 0.0)) {
            return false;
        }
        inverse[i] = 1.0 / pivot;
    }
    return true;
}

RARE bool factor(int size, const double *M, double *L, double *inverse) {
    return factor_any(size, M, L, inverse);
}

#define LEAST_MULTIPLE 1e-280 /* below and above, it is near what doubles can hold */
#define LARGEST_MULTIPLE 1e280

/* The same of a small M without waiting for one division after the other: elimination without
 * divisions leaves w_0 = M_00, w_1 = M_00 D_1, w_2 = w_0 w_1 D_2, ..., and all w_k L_ik.  False,
 * too, where doubles hardly hold these multiples: factor may still succeed, then. */
SIZED bool small_factor(int size, const double *ALONE M, double *ALONE L, double *ALONE inverse) {
    double w[SMALL][SMALL], multiple = 1.0;
    bool safe;
    UNROLLED
    for (int i = 0; i < size; i++) {
        UNROLLED
        for (int j = 0; j < size; j++) {
            w[i][j] = j <= i ? M[i * size + j] : 0.0;
        }
    }
    UNROLLED
    for (int k = 0; k < size; k++) {
        UNROLLED
        for (int i = 0; i < size; i++) {
            UNROLLED
            for (int j = 0; j < size; j++) {
                if (k < j && j <= i) {
                    w[i][j] = w[k][k] * w[i][j] - w[i][k] * w[j][k];
                }
            }
        }
    }
    safe = w[size - 1][size - 1] < LARGEST_MULTIPLE;
    UNROLLED
    for (int k = 0; k < size; k++) {
        double share = 1.0 / w[k][k];
        safe = safe && w[k][k] > LEAST_MULTIPLE;
        safe = safe && multiple > LEAST_MULTIPLE && multiple < LARGEST_MULTIPLE;
        inverse[k] = multiple * share;
        multiple *= w[k][k];
        UNROLLED
        for (int i = 0; i < size; i++) {
            if (i > k) {
                L[i * size + k] = w[i][k] * share;
            }
        }
    }
    return safe;
}

/* Put what belongs to a block, by pairs if it begins at an even place. */
SIZED void put_block(int size, int start, const double *from, double *to) {
    to += start;
    if (start % PAIR != 0) {
        UNROLLED
        for (int i = 0; i < size; i++) {
            to[i] = from[i];
        }
        return;
    }
    UNROLLED
    for (int i = 0; i + 1 < size; i += PAIR) {
        put_pair(to + i, from[i], from[i + 1]);
    }
    if (size % PAIR != 0) {
        put_pair(to + size - 1, from[size - 1], to[size]);
    }
}

/* b := L^-1 b and b := L^-T b within a block. */
SIZED void block_forward(int size, const double *ALONE L, double *ALONE b) {
    UNROLLED
    for (int i = 1; i < size; i++) {
        double sum = b[i];
        const int columns = size <= SMALL ? size : i;
        UNROLLED
        for (int j = 0; j < columns; j++) {
            sum = j < i ? sum - L[i * size + j] * b[j] : sum;
        }
        b[i] = sum;
    }
}

SIZED void block_backward(int size, const double *ALONE L, double *ALONE b) {
    UNROLLED
    for (int k = 1; k < size; k++) {
        int i = size - 1 - k;
        double sum = b[i];
        const int from = size <= SMALL ? 0 : i + 1;
        UNROLLED
        for (int j = from; j < size; j++) {
            sum = j > i ? sum - L[j * size + i] * b[j] : sum;
        }
        b[i] = sum;
    }
}

typedef enum { BACKWARD, FORWARD } Substitution;

SIZED void block_solve(int size, const double *ALONE L, double *ALONE b, Substitution way) {
    if (way == FORWARD) {
        block_forward(size, L, b);
    } else {
        block_backward(size, L, b);
    }
}

/* The same with a small block, of the coordinates from start. */
SIZED void solve_small(int size, int start, const double *ALONE L, double *ALONE x,
                       Substitution way) {
    double b[SMALL];
    UNROLLED
    for (int i = 0; i < size; i++) {
        b[i] = x[start + i];
    }
    block_solve(size, L, b, way);
    put_block(size, start, b, x);
}

SIZED void solve_blocks(const Factors *factors, double *x, Substitution way) {
    const double *L = factors->L;
    for (int k = 0; k < factors->block_count; k++) {
        int start = factors->blocks[k].start, size = factors->blocks[k].size;
        switch (size) {
        case 1: solve_small(1, start, L, x, way); break;
        case 2: solve_small(2, start, L, x, way); break;
        case 3: solve_small(3, start, L, x, way); break;
        case 4: solve_small(4, start, L, x, way); break;
        default: block_solve(size, L, x + start, way);
        }
        L += size * size;
    }
}

static void forward_all(const Factors *factors, double *x) {
    solve_blocks(factors, x, FORWARD);
}

static void backward_all(const Factors *factors, double *x) {
    solve_blocks(factors, x, BACKWARD);
}

/* The lower triangle of S = Z D^-1 Z^T, and its factor with the inverse of its D behind it. */
SIZED bool schur_of_size(int r, int even, Factors *factors) {
    const double *Z = factors->Z, *inverse = factors->inverse;
    double *S = factors->S, *L = S + r * r;
    Lanes sum[SMALL * SMALL][SUMS] = {{NO_LANES}};
    UNROLLED_BY_LANES
    for (int j = 0; j < even; j += LANES) {
        Lanes share = lanes_at(inverse + j);
        UNROLLED
        for (int i = 0; i < r; i++) {
            Lanes Y = share * lanes_at(Z + i * even + j);
            UNROLLED
            for (int k = 0; k < r; k++) {
                if (k <= i) {
                    sum[i * r + k][SUM_OF(j)] += Y * lanes_at(Z + k * even + j);
                }
            }
        }
    }
    UNROLLED
    for (int i = 0; i < r * r; i++) {
        S[i] = total(sum[i]);
    }
    return small_factor(r, S, L, L + r * r) || factor(r, S, L, L + r * r);
}

/* A stop that slides has a column that is not its row. */
static bool factor_unsymmetric(Factors *factors) {
    int even = factors->even, r = factors->r;
    for (int i = 0; i < r; i++) {
        for (int k = 0; k < r; k++) {
            const double *row = factors->Z + i * even, *column = factors->Z_columns + k * even;
            double sum = 0.0;
            for (int j = 0; j < even; j++) {
                sum += row[j] * factors->inverse[j] * column[j];
            }
            factors->S[i * r + k] = sum;
        }
    }
    return lu_factor(r, factors->S, factors->pivots);
}

SIZED bool schur_to_length(int even, Factors *factors) {
    factors->symmetric = factors->Z_columns == factors->Z && factors->r <= SMALL;
    if (!factors->symmetric) {
        return factor_unsymmetric(factors);
    }
    switch (factors->r) {
    case 0: return true;
    case 1: return schur_of_size(1, even, factors);
    case 2: return schur_of_size(2, even, factors);
    case 3: return schur_of_size(3, even, factors);
    default: return schur_of_size(4, even, factors);
    }
}

PRBM bool factor_schur(Factors *factors) {
    return schur_to_length(factors->even, factors);
}

SIZED bool schur_of_length(int even, Factors *factors) {
    return KNOWN(even) ? schur_to_length(even, factors) : factor_schur(factors);
}

/* The multipliers lam from what the rows ask for. */
SIZED void multipliers_of_size(int r, const double *S, double *lam) {
    const double *L = S + r * r, *inverse = L + r * r;
    block_forward(r, L, lam);
    UNROLLED
    for (int k = 0; k < r; k++) {
        lam[k] *= inverse[k];
    }
    block_backward(r, L, lam);
}

/* lam -= Z D^-1 x */
SIZED void ask_multipliers(int count, int even, const double *ALONE Z, const double *ALONE x,
                           const double *ALONE inverse, double *ALONE lam) {
    Lanes sum[SMALL][SUMS] = {{NO_LANES}};
    UNROLLED_BY_LANES
    for (int j = 0; j < even; j += LANES) {
        Lanes share = lanes_at(x + j) * lanes_at(inverse + j);
        UNROLLED
        for (int k = 0; k < count; k++) {
            sum[k][SUM_OF(j)] += lanes_at(Z + k * even + j) * share;
        }
    }
    UNROLLED
    for (int k = 0; k < count; k++) {
        lam[k] -= total(sum[k]);
    }
}

/* From x = L^-1 f and what the rows ask for: lam and x := D^-1 (x + Z^T lam). */
SIZED void constrain_of_size(int r, int even, const Factors *factors, double *ALONE x,
                             double *ALONE lam) {
    const double *ALONE Z = factors->Z, *ALONE columns = factors->Z_columns;
    const double *ALONE inverse = factors->inverse;
    const int together = r <= SMALL ? r : 1;
    for (int k = 0; k < r; k += together) {
        ask_multipliers(together, even, Z + k * even, x, inverse, lam + k);
    }
    if (factors->symmetric) {
        multipliers_of_size(r, factors->S, lam);
    } else {
        lu_solve(r, factors->S, factors->pivots, lam);
    }
    UNROLLED_BY_LANES
    for (int j = 0; j < even; j += LANES) {
        Lanes sum = lanes_at(x + j);
        UNROLLED
        for (int k = 0; k < r; k++) {
            sum += lam[k] * lanes_at(columns + k * even + j);
        }
        set_lanes(x + j, sum * lanes_at(inverse + j));
    }
}

/* The solution from x = L^-1 f and what the rows ask for. */
SIZED void finish_to_length(int even, const Factors *factors, double *x, double *lam) {
    switch (factors->r) {
    case 0: constrain_of_size(0, even, factors, x, lam); break;
    case 1: constrain_of_size(1, even, factors, x, lam); break;
    case 2: constrain_of_size(2, even, factors, x, lam); break;
    case 3: constrain_of_size(3, even, factors, x, lam); break;
    case 4: constrain_of_size(4, even, factors, x, lam); break;
    default: constrain_of_size(factors->r, even, factors, x, lam);
    }
    backward_all(factors, x);
}

static void finish(const Factors *factors, double *x, double *lam) {
    finish_to_length(factors->even, factors, x, lam);
}

SIZED void finish_of_length(int even, const Factors *factors, double *x, double *lam) {
    if (KNOWN(even)) {
        finish_to_length(even, factors, x, lam);
    } else {
        finish(factors, x, lam);
    }
}

PRBM void solve_again(const Factors *factors, double *x, double *lam) {
    forward_all(factors, x);
    finish(factors, x, lam);
}

PRBM bool project_positions(const System *system, const Rows *rows, double *q, const double *c,
                            Complex *e, Scratch *scratch, Problem *problem) {
    size_t mark = scratch->used, n = (size_t)system->n, r = (size_t)rows->count, size = n + r;
    double *s = take(scratch, r), *G = take(scratch, r * n);
    double *M = take(scratch, n * n), *C = take(scratch, n * n);
    double *kkt = take(scratch, size * size), *right = take(scratch, size);
    double best = INFINITY;
    bool right_way = true, closed = false;
    Rows now = *rows;
    now.c = c;
    for (int step = 0; step < ITERATIONS && right_way && !closed; step++) {
        directions(system, q, e);
        scalars(&now, e, s);
        double error = largest(rows->count, s), length = system->length;
        closed = error <= CLOSED * length || (BARELY_CLOSED * length >= best && best <= error);
        best = error < best ? error : best;
        if (!closed) {
            jacobian(rows, e, G);
            inertia(system->n, system->H, system->J, e, M, C);
            saddle(system->n, rows->count, M, G, G, kkt);
            zeros(system->n, right);
            for (size_t k = 0; k < r; k++) {
                right[n + k] = -s[k];
            }
            right_way = solve((int)size, kkt, right, scratch, problem);
            for (size_t i = 0; right_way && i < n; i++) {
                q[i] += right[i];
            }
        }
    }
    scratch->used = mark;
    if (right_way && !closed) {
        return fail(problem,
                    "the loops of the mechanism cannot be closed here (by %.3g m): the parts do "
                    "not reach each other",
                    best);
    }
    return right_way;
}

PRBM bool project_velocities(int n, int r, const double *M, const double *rows,
                             const double *rates, double *v, Scratch *scratch, Problem *problem) {
    size_t mark = scratch->used, size = (size_t)(n + r);
    double *kkt = take(scratch, size * size), *right = take(scratch, size);
    memset(right, 0, (size_t)n * sizeof *right);
    for (int k = 0; k < r; k++) {
        right[n + k] = -(dot(n, rows + k * n, v) + rates[k]);
    }
    saddle(n, r, M, rows, rows, kkt);
    bool regular = solve((int)size, kkt, right, scratch, problem);
    for (int i = 0; regular && i < n; i++) {
        v[i] += right[i];
    }
    scratch->used = mark;
    return regular;
}
