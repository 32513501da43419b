/* Scalars s = Re(B e) + c of the position: the twin of prbm/constraints.py. */
#include <math.h>
#include <string.h>

#include "kernel.h"

#define CLOSED 1e-14        /* of the size of the mechanism: a few roundings of its coordinates */
#define BARELY_CLOSED 1e-12 /* of that size: accepted if the iteration can do no better */

enum { ITERATIONS = 20 }; /* Gauss-Newton converges quadratically: twenty are hopeless */

static const char SINGULAR[] =
    "the equations of motion are singular here: two constraints repeat each other, or a part that "
    "can move has no mass";

PRBM void scalars(int r, int n, const Complex *B, const double *c, const Complex *e, double *s) {
    for (int i = 0; i < r; i++) {
        s[i] = row_value(n, B + i * n, e) + c[i];
    }
}

PRBM void jacobian(int r, int n, const Complex *B, const Complex *e, double *rows) {
    for (int i = 0; i < r * n; i++) {
        rows[i] = -product(B[i], e[i % n]).im;
    }
}

PRBM void convective(int r, int n, const Complex *B, const Complex *e, const double *v,
                     double *x) {
    for (int i = 0; i < r; i++) {
        x[i] = 0.0;
        for (int j = 0; j < n; j++) {
            x[i] += product(B[i * n + j], e[j]).re * (v[j] * v[j]);
        }
    }
}

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

/* M = L D L^T of the lower triangle of M, L with ones on its diagonal, where 1/D is kept; false if M
 * is not positive definite. */
SIZED bool block_factor(int size, int n, const double *ALONE M, double *ALONE L) {
    UNROLLED
    for (int i = 0; i < size; i++) {
        double pivot = M[i * n + i];
        const int columns = size <= SMALL ? size : i;
        UNROLLED
        for (int j = 0; j < columns; j++) {
            if (j < i) {
                double sum = M[i * n + j];
                const int before = size <= SMALL ? size : j;
                UNROLLED
                for (int k = 0; k < before; k++) {
                    sum = k < j ? sum - L[i * n + k] * L[j * n + k] : sum;
                }
                L[i * n + j] = sum; /* L_ij D_j so far */
            }
        }
        UNROLLED
        for (int j = 0; j < columns; j++) {
            if (j < i) {
                double share = L[i * n + j] * L[j * n + j];
                pivot -= share * L[i * n + j];
                L[i * n + j] = share;
            }
        }
        if (!(pivot > 0.0)) {
            return false;
        }
        L[i * n + i] = 1.0 / pivot;
    }
    return true;
}

/* b := L^-1 b and b := L^-T b within a block; L has the stride n. */
SIZED void block_forward(int size, int n, const double *ALONE L, double *ALONE b) {
    UNROLLED
    for (int i = 1; i < size; i++) {
        double sum = b[i];
        const int columns = size <= SMALL ? size : i;
        UNROLLED
        for (int j = 0; j < columns; j++) {
            sum = j < i ? sum - L[i * n + j] * b[j] : sum;
        }
        b[i] = sum;
    }
}

SIZED void block_backward(int size, int n, const double *ALONE L, double *ALONE b) {
    UNROLLED
    for (int k = 1; k < size; k++) {
        int i = size - 1 - k;
        double sum = b[i];
        const int from = size <= SMALL ? 0 : i + 1;
        UNROLLED
        for (int j = from; j < size; j++) {
            sum = j > i ? sum - L[j * n + i] * b[j] : sum;
        }
        b[i] = sum;
    }
}

/* y := D^-1 z */
SIZED void block_scale(int size, int n, const double *ALONE L, const double *z, double *y) {
    UNROLLED
    for (int i = 0; i < size; i++) {
        y[i] = z[i] * L[i * n + i];
    }
}

static void forward_all(const Factors *factors, double *b) {
    int n = factors->n;
    for (int k = 0; k < factors->block_count; k++) {
        int o = factors->blocks[k].start;
        const double *L = factors->L + o * n + o;
        switch (factors->blocks[k].size) {
        case 1: block_forward(1, n, L, b + o); break;
        case 2: block_forward(2, n, L, b + o); break;
        case 3: block_forward(3, n, L, b + o); break;
        case 4: block_forward(4, n, L, b + o); break;
        default: block_forward(factors->blocks[k].size, n, L, b + o);
        }
    }
}

static void backward_all(const Factors *factors, double *b) {
    int n = factors->n;
    for (int k = 0; k < factors->block_count; k++) {
        int o = factors->blocks[k].start;
        const double *L = factors->L + o * n + o;
        switch (factors->blocks[k].size) {
        case 1: block_backward(1, n, L, b + o); break;
        case 2: block_backward(2, n, L, b + o); break;
        case 3: block_backward(3, n, L, b + o); break;
        case 4: block_backward(4, n, L, b + o); break;
        default: block_backward(factors->blocks[k].size, n, L, b + o);
        }
    }
}

/* S = Z Y_columns^T.  It is symmetric, unless a stop slides, whose column is not its row. */
SIZED bool schur_of_size(int r, Factors *factors) {
    int n = factors->n;
    double *S = factors->S;
    for (int i = 0; i < r; i++) {
        for (int k = 0; k <= i; k++) {
            S[i * r + k] = dot(n, factors->Z + i * n, factors->Y + k * n);
        }
    }
    return block_factor(r, r, S, S + r * r); /* behind it */
}

PRBM bool factor_schur(Factors *factors) {
    int n = factors->n, r = factors->r;
    factors->symmetric = factors->Y_columns == factors->Y && r <= SMALL;
    if (factors->symmetric) {
        switch (r) {
        case 0: return true;
        case 1: return schur_of_size(1, factors);
        case 2: return schur_of_size(2, factors);
        case 3: return schur_of_size(3, factors);
        default: return schur_of_size(4, factors);
        }
    }
    for (int i = 0; i < r; i++) {
        for (int k = 0; k < r; k++) {
            factors->S[i * r + k] = dot(n, factors->Z + i * n, factors->Y_columns + k * n);
        }
    }
    return lu_factor(r, factors->S, factors->pivots);
}

SIZED void multipliers_of_size(int r, const double *S, double *lam) {
    const double *L = S + r * r;
    block_forward(r, r, L, lam);
    block_scale(r, r, L, lam, lam);
    block_backward(r, r, L, lam);
}

static void multipliers(const Factors *factors, double *lam) {
    if (!factors->symmetric) {
        lu_solve(factors->r, factors->S, factors->pivots, lam);
        return;
    }
    switch (factors->r) {
    case 0: break;
    case 1: multipliers_of_size(1, factors->S, lam); break;
    case 2: multipliers_of_size(2, factors->S, lam); break;
    case 3: multipliers_of_size(3, factors->S, lam); break;
    default: multipliers_of_size(4, factors->S, lam);
    }
}

/* x := a from x = D^-1 L^-1 f and the multipliers behind it, which change their sign. */
static void add_multipliers(const Factors *factors, double *x) {
    int n = factors->n;
    double *lam = x + n;
    for (int k = 0; k < factors->r; k++) {
        add_scaled(n, lam[k], factors->Y_columns + k * n, x);
        lam[k] = -lam[k];
    }
    backward_all(factors, x);
}

/* Multipliers from x = L^-1 f and what the rows ask for, then x := a. */
static void finish(const Factors *factors, double *x) {
    int n = factors->n;
    double *lam = x + n;
    for (int k = 0; k < factors->r; k++) {
        lam[k] -= dot(n, factors->Y + k * n, x);
    }
    multipliers(factors, lam);
    block_scale(n, n, factors->L, x, x);
    add_multipliers(factors, x);
}

/* The same without loads: x (n + r,) begins with zeros. */
static void solve_rows(const Factors *factors, double *x) {
    multipliers(factors, x + factors->n);
    add_multipliers(factors, x);
}

PRBM void solve_again(const Factors *factors, double *x) {
    forward_all(factors, x);
    finish(factors, x);
}

PRBM bool project_positions(const System *system, int r, const Complex *B, const double *c,
                            double *q, Complex *e, Scratch *scratch, Problem *problem) {
    size_t mark = scratch->used, n = (size_t)system->n, size = n + (size_t)r;
    double *s = take(scratch, (size_t)r), *rows = take(scratch, (size_t)r * n);
    double *M = take(scratch, n * n), *C = take(scratch, n * n);
    double *kkt = take(scratch, size * size), *right = take(scratch, size);
    double best = INFINITY;
    bool right_way = true, closed = false;
    for (int step = 0; step < ITERATIONS && right_way && !closed; step++) {
        directions(system, q, e);
        scalars(r, system->n, B, c, e, s);
        double error = largest(r, s), length = system->length;
        closed = error <= CLOSED * length || (BARELY_CLOSED * length >= best && best <= error);
        best = error < best ? error : best;
        if (!closed) {
            jacobian(r, system->n, B, e, rows);
            inertia(system->n, system->H, system->J, e, M, C);
            saddle(system->n, r, M, rows, rows, kkt);
            memset(right, 0, n * sizeof *right);
            for (int k = 0; k < r; k++) {
                right[n + (size_t)k] = -s[k];
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
