/* Factors of a saddle-point matrix, block by block, for repeated solution. */
#include "core/factors.h"
#include "core/matrix.h"
#include "core/vectors.h"

/* Return the first column of a row of a block that may not be zero. */
static inline int first_column(int apart, int row) {
    return row > apart ? apart : 0;
}

/* Factor M = L D L^T from its lower triangle, with ones on the diagonal of L; inverse is 1/D.
 * Return false if M is not positive definite: a pivot may not be round-off of its diagonal
 * element. */
SHARED bool factor_any(int size, int apart, const double *RESTRICT M, double *RESTRICT L,
                       double *RESTRICT inverse) {
    for (int i = 0; i < size; i++) {
        const int first = first_column(apart, i);
        double pivot = M[i * size + i];
        for (int j = first; j < i; j++) {
            double sum = M[i * size + j];
            UNROLLED
            for (int k = first; k < j; k++) {
                sum -= L[i * size + k] * L[j * size + k];
            }
            L[i * size + j] = sum; /* L_ij D_j so far */
        }
        UNROLLED
        for (int j = first; j < i; j++) {
            double share = L[i * size + j] * inverse[j];
            pivot -= share * L[i * size + j];
            L[i * size + j] = share;
        }
        if (!(pivot > SINGULAR_RTOL * M[i * size + i])) {
            return false;
        }
        inverse[i] = 1.0 / pivot;
    }
    return true;
}

/* The same for numbers that the compiler knows, with a size up to UNROLLED_MAX. */
SHARED bool factor_known(int size, int apart, const double *RESTRICT M, double *RESTRICT L,
                         double *RESTRICT inverse) {
    UNROLLED
    for (int i = 0; i < size; i++) {
        const int first = first_column(apart, i);
        double pivot = M[i * size + i];
        UNROLLED
        for (int j = 0; j < size; j++) {
            if (first <= j && j < i) {
                double sum = M[i * size + j];
                UNROLLED
                for (int k = 0; k < size; k++) {
                    sum = first <= k && k < j ? sum - L[i * size + k] * L[j * size + k] : sum;
                }
                L[i * size + j] = sum; /* L_ij D_j so far */
            }
        }
        UNROLLED
        for (int j = 0; j < size; j++) {
            if (first <= j && j < i) {
                double share = L[i * size + j] * inverse[j];
                pivot -= share * L[i * size + j];
                L[i * size + j] = share;
            }
        }
        if (!(pivot > SINGULAR_RTOL * M[i * size + i])) {
            return false;
        }
        inverse[i] = 1.0 / pivot;
    }
    return true;
}

NOINLINE bool factor(int size, const double *M, double *L, double *inverse) {
    return factor_any(size, 0, M, L, inverse);
}

/* Limits in small_factor of the products of pivots, beyond which they may underflow or overflow. */
#define LEAST_MULTIPLE 1e-280
#define LARGEST_MULTIPLE 1e280

/* Factor M, of a size up to SMALL, like factor_any, but with all divisions at the end, so that they
 * overlap in time.  Elimination without divisions computes w_k = w_0 w_1 ... w_(k-1) D_k on the
 * diagonal, with w_0 = D_0, and w_k L_ik below it.  Return false if M is not positive definite, or
 * if a product may underflow or overflow; factor may then succeed.  The caller knows that no pivot
 * is round-off, or tests it. */
SHARED bool small_factor(int size, const double *RESTRICT M, double *RESTRICT L,
                         double *RESTRICT inverse) {
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

/* Copy the values of a block to its place in a vector, in pairs if start is even. */
SHARED void put_block(int size, int start, const double *from, double *to) {
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

/* block_forward: b := L^-1 b; block_backward: b := L^-T b, within a block. */
SHARED void block_forward(int size, int apart, const double *RESTRICT L, double *RESTRICT b) {
    UNROLLED
    for (int i = 1; i < size; i++) {
        double sum = b[i];
        const int first = first_column(apart, i);
        const int from = size <= UNROLLED_MAX ? 0 : first, to = size <= UNROLLED_MAX ? size : i;
        UNROLLED
        for (int j = from; j < to; j++) {
            sum = first <= j && j < i ? sum - L[i * size + j] * b[j] : sum;
        }
        b[i] = sum;
    }
}

SIZED void block_backward(int size, int apart, const double *RESTRICT L, double *RESTRICT b) {
    UNROLLED
    for (int k = 1; k < size; k++) {
        int i = size - 1 - k;
        double sum = b[i];
        const int last = i < apart ? apart + 1 : size;
        const int from = size <= UNROLLED_MAX ? 0 : i + 1, to = size <= UNROLLED_MAX ? size : last;
        UNROLLED
        for (int j = from; j < to; j++) {
            sum = i < j && j < last ? sum - L[j * size + i] * b[j] : sum;
        }
        b[i] = sum;
    }
}

SIZED void block_solve(int size, int apart, const double *RESTRICT L, double *RESTRICT b,
                       Substitution way) {
    if (way == FORWARD) {
        block_forward(size, apart, L, b);
    } else {
        block_backward(size, apart, L, b);
    }
}

/* Apply block_solve to the entries of x that belong to a block: size entries from the index start,
 * with a size up to SMALL. */
SHARED void solve_small(int size, int start, const double *RESTRICT L, double *RESTRICT x,
                        Substitution way) {
    double b[SMALL];
    UNROLLED
    for (int i = 0; i < size; i++) {
        b[i] = x[start + i];
    }
    block_solve(size, 0, L, b, way);
    put_block(size, start, b, x);
}

/* Apply block_solve to a block; that of a guide on two beams of the order 3 is compiled
 * separately. */
static void solve_block(int size, int apart, const double *L, double *b, Substitution way) {
    if (size == 7 && apart == 3) {
        block_solve(7, 3, L, b, way);
    } else {
        block_solve(size, apart, L, b, way);
    }
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
        default: solve_block(size, factors->blocks[k].apart, L, x + start, way);
        }
        L += size * size;
    }
}

PRBM void forward_all(const Factors *factors, double *x) {
    solve_blocks(factors, x, FORWARD);
}

static void backward_all(const Factors *factors, double *x) {
    solve_blocks(factors, x, BACKWARD);
}

/* Factor a Schur complement. */
SIZED bool factor_rows(int size, const double *S, double *L, double *inverse) {
    double ratios = 0.0;
    if (small_factor(size, S, L, inverse)) {
        UNROLLED
        for (int k = 1; k < size; k++) { /* The first ratio is 1. */
            ratios += inverse[k] * S[k * size + k];
        }
        if (ratios < 1.0 / SINGULAR_RTOL) {
            return true;
        }
    }
    return factor(size, S, L, inverse);
}

/* Compute the lower triangle of S = Z D^-1 Z^T, with the D of M, and factor S = L_S D_S L_S^T.
 * L_S (r, r) and 1/D_S (r,) are stored behind S.  Return false if S is singular. */
SIZED bool schur_of_size(int r, int even, Factors *factors) {
    const double *Z = factors->Z, *inverse = factors->inverse;
    double *S = factors->S, *L = S + r * r;
    bool rows = true;
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
        rows = rows && (i % (r + 1) != 0 || S[i] > factors->least);
    }
    return rows && factor_rows(r, S, L, L + r * r);
}

/* Compute count elements of a row of S, those of the row Z and of consecutive columns. */
SIZED void schur_elements(int count, int even, const double *RESTRICT Z,
                          const double *RESTRICT inverse, const double *RESTRICT columns,
                          double *RESTRICT S) {
    Lanes sum[SMALL][SUMS] = {{NO_LANES}};
    UNROLLED_BY_LANES
    for (int j = 0; j < even; j += LANES) {
        Lanes share = lanes_at(inverse + j) * lanes_at(Z + j);
        UNROLLED
        for (int k = 0; k < count; k++) {
            sum[k][SUM_OF(j)] += share * lanes_at(columns + k * even + j);
        }
    }
    UNROLLED
    for (int k = 0; k < count; k++) {
        S[k] = total(sum[k]);
    }
}

/* As schur_of_size, for any number of rows. */
static bool schur_of_many(Factors *factors) {
    const int r = factors->r, even = factors->even;
    const double *Z = factors->Z, *inverse = factors->inverse;
    double *S = factors->S, *L = S + r * r;
    for (int i = 0; i < r; i++) {
        const double *row = Z + i * even;
        int k = 0;
        for (; k + SMALL <= i + 1; k += SMALL) {
            schur_elements(SMALL, even, row, inverse, Z + k * even, S + i * r + k);
        }
        for (; k <= i; k++) {
            schur_elements(1, even, row, inverse, Z + k * even, S + i * r + k);
        }
        if (!(S[i * r + i] > factors->least)) {
            return false;
        }
    }
    return factor(r, S, L, L + r * r);
}

/* Return Z_i D^-1 column. */
static double metric_product(const Factors *factors, int i, const double *column) {
    const double *row = factors->Z + i * factors->even;
    double sum = 0.0;
    for (int j = 0; j < factors->even; j++) {
        sum += row[j] * factors->inverse[j] * column[j];
    }
    return sum;
}

/* Compute S, scale it by the lengths of the rows Z, and factor it by LU: for an S that is not
 * symmetric because a stop slides and the columns differ from the rows.  The scales (r,) are stored
 * behind S. */
static bool factor_unsymmetric(Factors *factors) {
    int even = factors->even, r = factors->r;
    double *scale = factors->S + r * r;
    bool rows = true;
    for (int i = 0; i < r; i++) {
        double square = metric_product(factors, i, factors->Z + i * even);
        rows = rows && square > factors->least;
        scale[i] = 1.0 / square_root(square);
    }
    for (int i = 0; i < r && rows; i++) {
        for (int k = 0; k < r; k++) {
            double sum = metric_product(factors, i, factors->Z_columns + k * even);
            factors->S[i * r + k] = scale[i] * sum * scale[k];
        }
    }
    return rows && lu_factor(r, factors->S, factors->pivots);
}

/* Solve S lam = b with the factors of factor_unsymmetric.  On entry lam contains b. */
static void unsymmetric_multipliers(const Factors *factors, double *lam) {
    const double *scale = factors->S + factors->r * factors->r;
    for (int k = 0; k < factors->r; k++) {
        lam[k] *= scale[k];
    }
    lu_solve(factors->r, factors->S, factors->pivots, lam);
    for (int k = 0; k < factors->r; k++) {
        lam[k] *= scale[k];
    }
}

/* Compute and factor S for vectors of the padded length even. */
SIZED bool schur_padded(int even, Factors *factors) {
    factors->symmetric = factors->Z_columns == factors->Z;
    if (!factors->symmetric) {
        return factor_unsymmetric(factors);
    }
    switch (factors->r) {
    case 0: return true;
    case 1: return schur_of_size(1, even, factors);
    case 2: return schur_of_size(2, even, factors);
    case 3: return schur_of_size(3, even, factors);
    case 4: return schur_of_size(4, even, factors);
    default: return schur_of_many(factors);
    }
}

PRBM bool factor_schur(Factors *factors) {
    return schur_padded(factors->even, factors);
}

/* Compute and factor S, by code for this padded length if the compiler knows it. */
SHARED bool schur_dispatch(int even, Factors *factors) {
    return IS_CONSTANT(even) ? schur_padded(even, factors) : factor_schur(factors);
}

/* Solve S lam = b with the factors of a symmetric S.  On entry lam contains b. */
SIZED void multipliers_of_size(int r, const double *S, double *lam) {
    const double *L = S + r * r, *inverse = L + r * r;
    block_forward(r, 0, L, lam);
    UNROLLED
    for (int k = 0; k < r; k++) {
        lam[k] *= inverse[k];
    }
    block_backward(r, 0, L, lam);
}

/* Subtract Z D^-1 x from lam, the right side of the constraint rows. */
SIZED void reduce_right_side(int count, int even, const double *RESTRICT Z,
                             const double *RESTRICT x, const double *RESTRICT inverse,
                             double *RESTRICT lam) {
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

/* Solve for the multipliers lam, and set x := D^-1 (x + Z_columns^T lam).  On entry x contains
 * L^-1 f, and lam the right side of the constraint rows. */
SIZED void constrain_of_size(int r, int even, const Factors *factors, double *RESTRICT x,
                             double *RESTRICT lam) {
    const double *RESTRICT Z = factors->Z, *RESTRICT columns = factors->Z_columns;
    const double *RESTRICT inverse = factors->inverse;
    const int together = r <= SMALL ? r : 1;
    for (int k = 0; k < r; k += together) {
        reduce_right_side(together, even, Z + k * even, x, inverse, lam + k);
    }
    if (factors->symmetric) {
        multipliers_of_size(r, factors->S, lam);
    } else {
        unsymmetric_multipliers(factors, lam);
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

/* Compute the solution x and the multipliers lam.  On entry x contains L^-1 f, and lam the right
 * side of the constraint rows. */
SIZED void finish_padded(int even, const Factors *factors, double *x, double *lam) {
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
    finish_padded(factors->even, factors, x, lam);
}

/* Finish the solution, by code for this padded length if the compiler knows it. */
SHARED void finish_dispatch(int even, const Factors *factors, double *x, double *lam) {
    if (IS_CONSTANT(even)) {
        finish_padded(even, factors, x, lam);
    } else {
        finish(factors, x, lam);
    }
}

PRBM void solve_again(const Factors *factors, double *x, double *lam) {
    forward_all(factors, x);
    finish(factors, x, lam);
}
