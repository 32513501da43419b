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

PRBM bool factor(Factors *factors, int r, const double *columns, const double *rows) {
    int n = factors->n;
    factors->r = r;
    if (!cholesky(n, factors->first, factors->L)) {
        return false;
    }
    memcpy(factors->Y, rows, (size_t)(r * n) * sizeof *rows);
    for (int k = 0; k < r; k++) {
        forward(n, factors->first, factors->L, factors->Y + k * n);
    }
    const double *Y = factors->Y, *Y_columns = factors->Y_columns;
    memcpy(factors->Y_columns, columns ? columns : Y, (size_t)(r * n) * sizeof *rows);
    for (int k = 0; columns && k < r; k++) {
        forward(n, factors->first, factors->L, factors->Y_columns + k * n);
    }
    for (int i = 0; i < r; i++) {
        for (int k = 0; k < r; k++) {
            factors->S[i * r + k] = dot(n, Y + i * n, Y_columns + k * n);
        }
    }
    return r == 0 || lu_factor(r, factors->S, factors->pivots);
}

PRBM void solve_again(const Factors *factors, double *x) {
    int n = factors->n, r = factors->r;
    double *lam = x + n;
    forward(n, factors->first, factors->L, x);
    for (int k = 0; k < r; k++) {
        lam[k] -= dot(n, factors->Y + k * n, x);
    }
    if (r > 0) {
        lu_solve(r, factors->S, factors->pivots, lam);
    }
    for (int k = 0; k < r; k++) {
        for (int i = 0; i < n; i++) {
            x[i] += factors->Y_columns[k * n + i] * lam[k];
        }
        lam[k] = -lam[k];
    }
    backward(n, factors->first, factors->L, x);
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
        directions(system->n, q, e);
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
