/* Factors of a saddle-point matrix, block by block, for repeated solution. */
#include <string.h>

#include "core/factors.h"
#include "core/matrix.h"
#include "core/vectors.h"

/* Return the last column of a row of U that may not be zero.  last may be NULL: no row has zeros. */
static inline int last_column(int size, const int *last, int row) {
    return last ? last[row] : size - 1;
}

/* Subtract from the elements i, from next to first, of count vectors b, stride apart, the sums of
 * U_ij b_j for j up to end. */
SIZED void forward_together(int count, int stride, int next, int first, int end, int size,
                            const int *last, const double *U, double *b) {
    for (int i = next; i >= first; i--) {
        const int column = last_column(size, last, i), stop = column < end ? column : end;
        const double *row = U + i * size;
        Lanes sum[SMALL][SUMS] = {{NO_LANES}};
        int j = i + 1;
        for (; j < stop; j += PAIR) {
            UNROLLED
            for (int l = 0; l < PAIR; l += LANES) {
                Lanes each = lanes_at(row + j + l);
                UNROLLED
                for (int k = 0; k < count; k++) {
                    sum[k][SUM_OF(l)] += each * lanes_at(b + k * stride + j + l);
                }
            }
        }
        UNROLLED
        for (int k = 0; k < count; k++) {
            double *x = b + k * stride, rest = j == stop ? row[j] * x[j] : 0.0;
            x[i] -= total(sum[k]) + rest;
        }
    }
}

/* Divide row i of U D by D, behind the column i, and compute D_i. */
static bool factor_row(int size, int i, int end, double diagonal, double *U, double *inverse) {
    double pivot = diagonal, *row = U + i * size;
    for (int j = i + 1; j <= end; j++) {
        double share = row[j] * inverse[j];
        pivot -= share * row[j];
        row[j] = share;
    }
    inverse[i] = 1.0 / pivot;
    return pivot > SINGULAR_RTOL * diagonal;
}

/* Factor M = U D U^T from its upper triangle, with ones on the diagonal of U, from the last row to
 * the first; inverse is 1/D.  The row i of U has no elements behind last[i].  Return false if M is
 * not positive definite: a pivot may not be round-off of its diagonal element. */
PRBM bool factor_any(int size, const int *last, const double *M, double *U, double *inverse) {
    bool regular = true;
    for (int next = size - 1; regular && next >= 0;) {
        const int end = last_column(size, last, next);
        int first = next;
        while (first > 0 && next - first < SMALL - 1 && last_column(size, last, first - 1) == end) {
            first--;
        }
        for (int i = first; i <= next; i++) {
            memcpy(U + i * size + i, M + i * size + i, (size_t)(end - i + 1) * sizeof *U);
        }
        double *rows = U + first * size;
        if (next - first == SMALL - 1) {
            forward_together(SMALL, size, end - 1, next + 1, end, size, last, U, rows);
        } else {
            for (int i = first; i <= next; i++) {
                forward_together(1, size, end - 1, next + 1, end, size, last, U, U + i * size);
            }
        }
        for (int i = next; i >= first && regular; i--) {
            forward_together(1, size, next, i + 1, end, size, last, U, U + i * size);
            regular = factor_row(size, i, end, M[i * size + i], U, inverse);
        }
        next = first - 1;
    }
    return regular;
}

/* Return the last column of a row of U of a guide that is not zero. */
static inline int guide_column(int row) {
    return row < GUIDE / 2 ? GUIDE / 2 : GUIDE - 1;
}

/* As factor_any, for a guide. */
SHARED bool factor_guide(const double *RESTRICT M, double *RESTRICT U, double *RESTRICT inverse) {
    UNROLLED
    for (int i = GUIDE - 1; i >= 0; i--) {
        const int end = guide_column(i);
        double pivot = M[i * GUIDE + i];
        UNROLLED
        for (int j = GUIDE - 1; j > 0; j--) {
            if (i < j && j <= end) {
                double sum = M[i * GUIDE + j];
                UNROLLED
                for (int k = 0; k < GUIDE; k++) {
                    const bool linked = j < k && k <= end && k <= guide_column(j);
                    sum = linked ? sum - U[i * GUIDE + k] * U[j * GUIDE + k] : sum;
                }
                U[i * GUIDE + j] = sum; /* U_ij D_j */
            }
        }
        UNROLLED
        for (int j = 0; j < GUIDE; j++) {
            if (i < j && j <= end) {
                double share = U[i * GUIDE + j] * inverse[j];
                pivot -= share * U[i * GUIDE + j];
                U[i * GUIDE + j] = share;
            }
        }
        if (!(pivot > SINGULAR_RTOL * M[i * GUIDE + i])) {
            return false;
        }
        inverse[i] = 1.0 / pivot;
    }
    return true;
}

/* Replace b by U^-1 b or U^-T b, for a guide. */
SHARED void solve_guide(const double *RESTRICT U, double *RESTRICT b, Substitution way) {
    UNROLLED
    for (int k = 0; k < GUIDE; k++) {
        const int i = way == FORWARD ? GUIDE - 1 - k : k;
        double sum = b[i];
        UNROLLED
        for (int j = 0; j < GUIDE; j++) {
            const bool linked = way == FORWARD ? i < j && j <= guide_column(i)
                                               : j < i && i <= guide_column(j);
            const double *row = way == FORWARD ? U + i * GUIDE + j : U + j * GUIDE + i;
            sum = linked ? sum - *row * b[j] : sum;
        }
        b[i] = sum;
    }
}

NOINLINE bool factor(int size, const double *M, double *U, double *inverse) {
    return factor_any(size, NULL, M, U, inverse);
}

/* Limits in small_factor of the products of pivots, beyond which they may underflow or overflow. */
#define LEAST_MULTIPLE 1e-280
#define LARGEST_MULTIPLE 1e280

/* Factor M, of a size up to SMALL, like factor_any, but with all divisions at the end, so that they
 * overlap in time.  Elimination without divisions computes w_k = w_z ... w_(k+1) D_k on the
 * diagonal, with w_z = D_z for the last row z, and w_k U_ik above it.  Return false if M is not
 * positive definite, or if a product may underflow or overflow; factor may then succeed.  The
 * caller knows that no pivot is round-off, or tests it. */
SHARED bool small_factor(int size, const double *RESTRICT M, double *RESTRICT U,
                         double *RESTRICT inverse) {
    double w[SMALL][SMALL], multiple = 1.0;
    bool safe;
    UNROLLED
    for (int i = 0; i < size; i++) {
        UNROLLED
        for (int j = 0; j < size; j++) {
            w[i][j] = i <= j ? M[i * size + j] : 0.0;
        }
    }
    UNROLLED
    for (int k = size - 1; k >= 0; k--) {
        UNROLLED
        for (int i = 0; i < size; i++) {
            UNROLLED
            for (int j = 0; j < size; j++) {
                if (i <= j && j < k) {
                    w[i][j] = w[k][k] * w[i][j] - w[i][k] * w[j][k];
                }
            }
        }
    }
    safe = w[0][0] < LARGEST_MULTIPLE;
    UNROLLED
    for (int k = size - 1; k >= 0; k--) {
        double share = 1.0 / w[k][k];
        safe = safe && w[k][k] > LEAST_MULTIPLE;
        safe = safe && multiple > LEAST_MULTIPLE && multiple < LARGEST_MULTIPLE;
        inverse[k] = multiple * share;
        multiple *= w[k][k];
        UNROLLED
        for (int i = 0; i < size; i++) {
            if (i < k) {
                U[i * size + k] = w[i][k] * share;
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

/* block_forward: b := U^-1 b; block_backward: b := U^-T b, within a block of a size up to SMALL. */
SHARED void block_forward(int size, const double *RESTRICT U, double *RESTRICT b) {
    UNROLLED
    for (int i = size - 2; i >= 0; i--) {
        double sum = b[i];
        UNROLLED
        for (int j = 0; j < size; j++) {
            sum = i < j ? sum - U[i * size + j] * b[j] : sum;
        }
        b[i] = sum;
    }
}

SIZED void block_backward(int size, const double *RESTRICT U, double *RESTRICT b) {
    UNROLLED
    for (int i = 1; i < size; i++) {
        double sum = b[i];
        UNROLLED
        for (int j = 0; j < size; j++) {
            sum = j < i ? sum - U[j * size + i] * b[j] : sum;
        }
        b[i] = sum;
    }
}

/* Apply block_forward or block_backward to the entries of x that belong to a block: size entries
 * from the index start, with a size up to SMALL. */
SHARED void solve_small(int size, int start, const double *RESTRICT U, double *RESTRICT x,
                        Substitution way) {
    double b[SMALL];
    UNROLLED
    for (int i = 0; i < size; i++) {
        b[i] = x[start + i];
    }
    if (way == FORWARD) {
        block_forward(size, U, b);
    } else {
        block_backward(size, U, b);
    }
    put_block(size, start, b, x);
}

/* Return the last element of count vectors b, stride apart, that is not zero in all of them. */
static int last_element(int size, int count, int stride, const double *b) {
    for (int i = size - 1; i > 0; i--) {
        for (int k = 0; k < count; k++) {
            if (b[k * stride + i] != 0.0) {
                return i;
            }
        }
    }
    return 0;
}

/* Replace count vectors b, stride apart, by U^-1 b, within a block of any size.  The rows of a loop,
 * which come in pairs, are zero in the coordinates of other loops. */
PRBM void forward_block(int size, const int *last, const double *U, int count, int stride,
                        double *b) {
    for (int k = 0; k < count; k += PAIR) {
        const bool pair = k + 1 < count;
        const int end = last_element(size, pair ? PAIR : 1, stride, b);
        if (pair) {
            forward_together(PAIR, stride, end - 1, 0, end, size, last, U, b);
        } else {
            forward_together(1, stride, end - 1, 0, end, size, last, U, b);
        }
        b += PAIR * stride;
    }
}

/* Replace b by U^-T b, within a block of any size. */
NOINLINE void backward_block(int size, const int *last, const double *U, double *b) {
    for (int i = 0; i < size - 1; i++) {
        const int end = last_column(size, last, i);
        add_scaled(end - i, -b[i], U + i * size + i + 1, b + i + 1);
    }
}

SIZED void solve_any(int size, const int *last, const double *U, double *b, Substitution way) {
    if (way == FORWARD) {
        forward_block(size, last, U, 1, 0, b);
    } else {
        backward_block(size, last, U, b);
    }
}

SIZED void solve_blocks(const Factors *factors, double *x, Substitution way) {
    const double *U = factors->U;
    for (int k = 0; k < factors->block_count; k++) {
        int start = factors->blocks[k].start, size = factors->blocks[k].size;
        switch (size) {
        case 1: solve_small(1, start, U, x, way); break;
        case 2: solve_small(2, start, U, x, way); break;
        case 3: solve_small(3, start, U, x, way); break;
        case 4: solve_small(4, start, U, x, way); break;
        default:
            if (factors->blocks[k].split > 0) {
                solve_guide(U, x + start, way);
            } else {
                solve_any(size, factors->last + start, U, x + start, way);
            }
        }
        U += size * size;
    }
}

/* Replace count rows Z with the intervals of the row k, the first one, by U^-1 Z. */
SIZED void forward_in_intervals(int count, const Factors *factors, int k) {
    const int even = factors->even;
    const Interval *first = factors->intervals->list + factors->intervals->first[k];
    const Interval *end = factors->intervals->list + factors->intervals->first[k + 1];
    double *x = factors->Z + k * even;
    for (const Interval *interval = end - 1; interval >= first; interval--) {
        const int padded = interval->end > factors->n;
        for (int i = interval->end - padded - 1; i >= interval->start; i--) {
            const FactorRow own = factors->factor_rows[i];
            Lanes sum[SMALL][SUMS] = {{NO_LANES}};
            double rest[SMALL] = {0.0};
            for (const Interval *next = interval; next < end && next->start <= own.last; next++) {
                const int stop = own.last + 1 < next->end ? own.last + 1 : next->end;
                const double *row = factors->U + own.begin;
                int j = next == interval ? i + 1 : next->start;
                for (; j + 1 < stop; j += PAIR) {
                    UNROLLED
                    for (int l = 0; l < PAIR; l += LANES) {
                        UNROLLED
                        for (int c = 0; c < count; c++) {
                            Lanes each = lanes_at(x + c * even + j + l);
                            sum[c][SUM_OF(l)] += lanes_at(row + j + l) * each;
                        }
                    }
                }
                if (j < stop) {
                    UNROLLED
                    for (int c = 0; c < count; c++) {
                        rest[c] += row[j] * x[c * even + j];
                    }
                }
            }
            UNROLLED
            for (int c = 0; c < count; c++) {
                x[c * even + i] -= total(sum[c]) + rest[c];
            }
        }
    }
}

PRBM void forward_rows(const Factors *factors) {
    for (int k = 0, next; k < factors->r; k = next) {
        const bool pair = k + 1 < factors->r && factors->intervals->repeats[k + 1];
        next = k + 1 + pair;
        if (pair) {
            forward_in_intervals(PAIR, factors, k);
        } else {
            forward_in_intervals(1, factors, k);
        }
    }
}

PRBM void forward_all(const Factors *factors, double *x) {
    solve_blocks(factors, x, FORWARD);
}

static void backward_all(const Factors *factors, double *x) {
    solve_blocks(factors, x, BACKWARD);
}

/* Factor a Schur complement. */
SIZED bool factor_rows(int size, const double *S, double *U, double *inverse) {
    double ratios = 0.0;
    if (small_factor(size, S, U, inverse)) {
        UNROLLED
        for (int k = 0; k < size - 1; k++) { /* The last ratio is 1. */
            ratios += inverse[k] * S[k * size + k];
        }
        if (ratios < 1.0 / SINGULAR_RTOL) {
            return true;
        }
    }
    return factor(size, S, U, inverse);
}

/* Compute the upper triangle of S = Z D^-1 Z^T, with the D of M, and factor S = U_S D_S U_S^T.
 * U_S (r, r) and 1/D_S (r,) are stored behind S.  Return false if S is singular. */
SIZED bool schur_of_size(int r, int even, Factors *factors) {
    const double *Z = factors->Z, *inverse = factors->inverse;
    double *S = factors->S, *U = S + r * r;
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
                if (i <= k) {
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
    return rows && factor_rows(r, S, U, U + r * r);
}

/* Compute the products x^T D^-1 Z_k (count,) with consecutive rows Z. */
SIZED void metric_products(int count, int even, const double *RESTRICT x,
                           const double *RESTRICT inverse, const double *RESTRICT Z,
                           double *RESTRICT products) {
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
        products[k] = total(sum[k]);
    }
}

/* Compute the products of x, in the intervals of row i, with count consecutive rows Z, in those of
 * row k, the first of them. */
SIZED void common_products(int count, const Factors *factors, int i, int k,
                           const double *RESTRICT x, double *RESTRICT products) {
    const Intervals *intervals = factors->intervals;
    const Interval *one = intervals->list + intervals->first[i];
    const Interval *other = intervals->list + intervals->first[k];
    const Interval *end = intervals->list + intervals->first[i + 1];
    const Interval *last = intervals->list + intervals->first[k + 1];
    const int even = factors->even;
    const double *Z = factors->Z + k * even;
    Lanes sum[PAIR][SUMS] = {{NO_LANES}};
    while (one < end && other < last) {
        const int start = one->start > other->start ? one->start : other->start;
        const int stop = one->end < other->end ? one->end : other->end;
        for (int j = start; j < stop; j += PAIR) {
            UNROLLED
            for (int l = j; l < j + PAIR; l += LANES) {
                UNROLLED
                for (int c = 0; c < count; c++) {
                    sum[c][SUM_OF(l)] += lanes_at(x + l) * lanes_at(Z + c * even + l);
                }
            }
        }
        one += one->end == stop;
        other += other->end == stop;
    }
    UNROLLED
    for (int c = 0; c < count; c++) {
        products[c] = total(sum[c]);
    }
}

/* As schur_of_size, for any number of rows. */
NOINLINE bool schur_of_many(Factors *factors) {
    const int r = factors->r, even = factors->even;
    const Intervals *intervals = factors->intervals;
    const double *Z = factors->Z, *inverse = factors->inverse;
    double *S = factors->S, *U = S + r * r, *scaled = factors->scaled;
    for (int i = 0; i < r; i++) {
        const double *row = Z + i * even;
        for (int s = intervals->first[i]; s < intervals->first[i + 1]; s++) {
            for (int j = intervals->list[s].start; j < intervals->list[s].end; j += LANES) {
                set_lanes(scaled + j, lanes_at(inverse + j) * lanes_at(row + j));
            }
        }
        for (int k = i, next; k < r; k = next) {
            const bool pair = k + 1 < r && intervals->repeats[k + 1];
            next = k + 1 + pair;
            if (pair) {
                common_products(PAIR, factors, i, k, scaled, S + i * r + k);
            } else {
                common_products(1, factors, i, k, scaled, S + i * r + k);
            }
        }
        if (!(S[i * r + i] > factors->least)) {
            return false;
        }
    }
    return factor(r, S, U, U + r * r);
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
    const double *U = S + r * r, *inverse = U + r * r;
    block_forward(r, U, lam);
    UNROLLED
    for (int k = 0; k < r; k++) {
        lam[k] *= inverse[k];
    }
    block_backward(r, U, lam);
}

/* The same for any number of rows. */
NOINLINE void multipliers_of_many(int r, const double *S, double *lam) {
    const double *U = S + r * r, *inverse = U + r * r;
    forward_block(r, NULL, U, 1, 0, lam);
    for (int k = 0; k < r; k++) {
        lam[k] *= inverse[k];
    }
    backward_block(r, NULL, U, lam);
}

/* Solve for the multipliers lam, and set x := D^-1 (x + Z_columns^T lam).  On entry x contains
 * U^-1 f, and lam the right side of the constraint rows. */
SIZED void constrain_of_size(int r, int even, const Factors *factors, double *RESTRICT x,
                             double *RESTRICT lam) {
    const double *RESTRICT columns = factors->Z_columns, *RESTRICT inverse = factors->inverse;
    double products[SMALL];
    metric_products(r, even, x, inverse, factors->Z, products);
    UNROLLED
    for (int k = 0; k < r; k++) {
        lam[k] -= products[k];
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

/* The same for any number of rows. */
NOINLINE void constrain_many(const Factors *factors, double *RESTRICT x, double *RESTRICT lam) {
    const int r = factors->r, even = factors->even;
    const Intervals *intervals = factors->intervals;
    const double *inverse = factors->inverse;
    for (int k = 0; k < r; k++) {
        lam[k] -= scaled_interval_product(intervals, k, inverse, x, factors->Z + k * even);
    }
    if (factors->symmetric) {
        multipliers_of_many(r, factors->S, lam);
    } else {
        unsymmetric_multipliers(factors, lam);
    }
    for (int k = 0; k < r; k++) {
        const double *column = factors->Z_columns + k * even;
        for (int s = intervals->first[k]; s < intervals->first[k + 1]; s++) {
            for (int j = intervals->list[s].start; j < intervals->list[s].end; j += LANES) {
                set_lanes(x + j, lanes_at(x + j) + lam[k] * lanes_at(column + j));
            }
        }
    }
    for (int j = 0; j < even; j += LANES) {
        set_lanes(x + j, lanes_at(x + j) * lanes_at(inverse + j));
    }
}

/* Compute the solution x and the multipliers lam.  On entry x contains U^-1 f, and lam the right
 * side of the constraint rows. */
SIZED void finish_padded(int even, const Factors *factors, double *x, double *lam) {
    switch (factors->r) {
    case 0: constrain_of_size(0, even, factors, x, lam); break;
    case 1: constrain_of_size(1, even, factors, x, lam); break;
    case 2: constrain_of_size(2, even, factors, x, lam); break;
    case 3: constrain_of_size(3, even, factors, x, lam); break;
    case 4: constrain_of_size(4, even, factors, x, lam); break;
    default: constrain_many(factors, x, lam);
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
