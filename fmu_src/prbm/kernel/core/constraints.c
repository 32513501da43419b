/* Scalar functions s = Re(f (B E + z)) + c of the position: the twin of Rows in
 * mechanics/system.py. Saddle-point systems and projections: the twin of
 * mechanics/constraints.py. */
#include <math.h>
#include <string.h>

#include "core/constraints.h"
#include "core/matrix.h"

/* --- rows ------------------------------------------------------------------------------------- */

PRBM Rows plain_rows(const System *system, int count, const Complex *B, const double *c) {
    Rows rows = {system, count, B, c, NULL, NULL};
    return rows;
}

PRBM Rows loop_rows(const System *system) {
    const int *on = system->mechanism->guide_count > 0 ? system->loops_on : NULL;
    Rows rows = {system, system->r, system->loops, system->loops_c, system->loops_z, on};
    return rows;
}

PRBM Rows rows_beside_loops(const System *system, int count, const Complex *B, const double *c,
                            Scratch *scratch) {
    Rows rows = plain_rows(system, count, B, c);
    if (system->mechanism->guide_count > 0) {
        Complex *z = take_complex(scratch, count, 1);
        int *on = take_integers(scratch, count);
        for (int i = 0; i < count; i++) {
            z[i] = i < system->r ? system->loops_z[i] : complex_of(0.0, 0.0);
            on[i] = i < system->r ? system->loops_on[i] : FIXED;
        }
        rows.z = z;
        rows.on = on;
    }
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
    Rows rows = {system, system->f, system->rubs, NULL, system->rubs_z, system->rubs_on};
    return rows;
}

PRBM int seen_from(const Rows *rows, int i) {
    return rows->on == NULL ? FIXED : rows->on[i];
}

PRBM Complex carrier_arm(const Rows *rows, int i, const Complex *e) {
    int on = seen_from(rows, i);
    return on == FIXED ? complex_of(1.0, 0.0) : conjugate(e[on]);
}

/* Return f (B E + z) of row i, which is measured relative to a body. */
PRBM Complex seen_value(const Rows *rows, int i, const Complex *e) {
    int d = rows->system->d;
    const Complex *B = rows->B + i * d;
    Complex sum = rows->z[i];
    for (int j = 0; j < d; j++) {
        sum = plus(sum, product(B[j], e[j]));
    }
    return product(conjugate(e[rows->on[i]]), sum);
}

PRBM double row_value(const Rows *rows, int i, const Complex *e) {
    int d = rows->system->d;
    const Complex *B = rows->B + i * d;
    if (seen_from(rows, i) != FIXED) {
        return seen_value(rows, i, e).re;
    }
    double sum = 0.0;
    for (int j = 0; j < d; j++) {
        sum += B[j].re * e[j].re - B[j].im * e[j].im;
    }
    return sum;
}

/* Return B E w of row i, with the complex rates w of the arms. */
PRBM Complex row_swing(const Rows *rows, int i, const Complex *e, const double *v) {
    const System *system = rows->system;
    const Complex *B = rows->B + i * system->d;
    Complex sum = {0.0, 0.0};
    for (int j = 0; j < system->d; j++) {
        sum = plus(sum, scaled(direction_of(system, v, j), product(B[j], e[j])));
    }
    for (int k = 0; k < system->stretch_count; k++) {
        int j = system->stretches[k];
        Complex arm = product(B[arm_of(system, j)], e[j]);
        sum = plus(sum, scaled(direction_of(system, v, j), arm));
    }
    for (int k = 0; k < system->shift_count; k++) {
        int j = system->shifts[k];
        Complex arm = product(B[arm_of(system, j)], e[j]);
        sum = plus(sum, scaled(direction_of(system, v, j), arm));
    }
    return sum;
}

PRBM double row_rate(const Rows *rows, int i, const Complex *e, const double *v) {
    int on = seen_from(rows, i);
    Complex speed = row_swing(rows, i, e, v);
    if (on == FIXED) {
        return -speed.im;
    }
    double turn = direction_of(rows->system, v, on);
    return turn * seen_value(rows, i, e).im - product(conjugate(e[on]), speed).im;
}

/* Return the derivative of row i by direction j. */
static double slope(const Rows *rows, int i, const Complex *e, int j) {
    const System *system = rows->system;
    Complex B = rows->B[i * system->d + arm_of(system, j)];
    int on = seen_from(rows, i);
    Complex f = on == FIXED ? complex_of(1.0, 0.0) : conjugate(e[on]);
    return -product(f, product(B, e[j])).im + (j == on ? seen_value(rows, i, e).im : 0.0);
}

PRBM void row_by_direction(const Rows *rows, int i, const Complex *e, double *row) {
    for (int j = 0; j < rows->system->d; j++) {
        row[j] = slope(rows, i, e, j);
    }
}

PRBM void row_jacobian(const Rows *rows, int i, const Complex *e, double *row) {
    const System *system = rows->system;
    if (!system->mapped) {
        row_by_direction(rows, i, e, row);
        return;
    }
    zeros(system->n, row);
    for (int j = 0; j < system->d; j++) {
        to_coordinates(system, j, slope(rows, i, e, j), row);
    }
}

/* Return the convective term Re(f (B E (w - w_b)^2 + z w_b^2)) of row i, with the rate w_b of the
 * body that the row is measured relative to. */
PRBM double row_convective(const Rows *rows, int i, const Complex *e, const double *v) {
    const System *system = rows->system;
    const Complex *B = rows->B + i * system->d;
    int on = seen_from(rows, i);
    double turn = on == FIXED ? 0.0 : direction_of(system, v, on);
    Complex sum = on == FIXED ? complex_of(0.0, 0.0) : scaled(turn * turn, rows->z[i]);
    for (int j = 0; j < system->d; j++) {
        double rate = direction_of(system, v, j) - turn;
        sum = plus(sum, scaled(rate * rate, product(B[j], e[j])));
    }
    for (int k = 0; k < system->stretch_count; k++) {
        int j = system->stretches[k], a = arm_of(system, j);
        double rate = direction_of(system, v, a) - turn, strain = direction_of(system, v, j);
        Complex more = complex_of(-strain * strain, -2.0 * rate * strain);
        sum = plus(sum, product(more, product(B[a], e[a])));
    }
    for (int k = 0; on != FIXED && k < system->shift_count; k++) {
        int j = system->shifts[k];
        Complex arm = product(B[arm_of(system, j)], e[j]);
        sum = plus(sum, scaled(-2.0 * turn * direction_of(system, v, j), arm));
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

/* The scale of a coordinate is 1/sqrt(M_ii); where M is a stiffness with a smaller diagonal
 * element, max_j M_ij^2 / max |M| replaces it.  The scale of a row makes its
 * largest element one, diagonal elements included. */
PRBM bool scales(int n, int r, const double *kkt, double length, double *scale) {
    int size = n + r;
    double most = 0.0;
    for (int i = 0; i < n; i++) {
        const double *row = kkt + i * size;
        double longest = 0.0;
        for (int j = 0; j < n; j++) {
            longest = fabs(row[j]) > longest ? fabs(row[j]) : longest;
        }
        scale[i] = longest;
        most = longest > most ? longest : most;
    }
    most = most > 0.0 ? most : 1.0;
    for (int i = 0; i < n; i++) {
        double square = greater(fabs(kkt[i * size + i]), scale[i] * scale[i] / most);
        scale[i] = 1.0 / square_root(square > 0.0 ? square : most);
    }
    for (int k = n; k < size; k++) {
        const double *row = kkt + k * size;
        double longest = 0.0, scaled = 0.0;
        for (int j = 0; j < n; j++) {
            double entry = fabs(row[j]);
            longest = entry > longest ? entry : longest;
            scaled = entry * scale[j] > scaled ? entry * scale[j] : scaled;
        }
        if (!(longest > ROW_RTOL * length)) {
            return false;
        }
        scale[k] = 1.0 / greater(scaled, square_root(fabs(row[k])));
    }
    return true;
}

PRBM ScaledFactors take_factors(Scratch *scratch, int size, double *kkt) {
    ScaledFactors factors = {size, kkt, take(scratch, (size_t)size), take_integers(scratch, size)};
    return factors;
}

PRBM bool factor_saddle(int n, int r, double length, const ScaledFactors *factors,
                        Problem *problem) {
    int size = factors->size;
    double *lu = factors->lu;
    bool regular = scales(n, r, lu, length, factors->scale);
    for (int i = 0; regular && i < size; i++) {
        const double own = factors->scale[i], *RESTRICT scale = factors->scale;
        double *RESTRICT row = lu + i * size;
        for (int j = 0; j < size; j++) {
            row[j] *= own * scale[j];
        }
    }
    regular = regular && lu_factor(size, lu, factors->pivots);
    return regular || fail(problem, "%s", SINGULAR);
}

PRBM void solve_saddle(const ScaledFactors *factors, double *right) {
    for (int i = 0; i < factors->size; i++) {
        right[i] *= factors->scale[i];
    }
    lu_solve(factors->size, factors->lu, factors->pivots, right);
    for (int i = 0; i < factors->size; i++) {
        right[i] *= factors->scale[i];
    }
}

PRBM bool solve(int n, int r, double *kkt, double *right, double length, Scratch scratch,
                Problem *problem) {
    ScaledFactors factors = take_factors(&scratch, n + r, kkt);
    bool regular = factor_saddle(n, r, length, &factors, problem);
    if (regular) {
        solve_saddle(&factors, right);
    }
    return regular;
}

PRBM int determinant_sign(int n, int r, double *kkt, double length, Scratch scratch) {
    ScaledFactors factors = take_factors(&scratch, n + r, kkt);
    Problem ignored;
    bool regular = factor_saddle(n, r, length, &factors, &ignored), odd = false;
    for (int i = 0; regular && i < factors.size; i++) {
        odd ^= factors.pivots[i] != i;
        odd ^= factors.lu[i * factors.size + i] < 0.0;
    }
    return regular ? (odd ? -1 : 1) : 0;
}

/* --- projection ------------------------------------------------------------------------------- */

PRBM bool project_positions(const System *system, const Rows *rows, double *q, const double *c,
                            Complex *e, Scratch scratch, Problem *problem) {
    size_t n = (size_t)system->n, r = (size_t)rows->count, size = n + r;
    double *s = take(&scratch, r), *G = take(&scratch, r * n);
    double *M = take(&scratch, n * n);
    double *kkt = take(&scratch, size * size), *right = take(&scratch, size);
    double best = INFINITY;
    bool ok = true, closed = false;
    Rows now = *rows;
    now.c = c;
    for (int step = 0; step < CONSTRAINT_ITERATIONS_MAX && ok && !closed; step++) {
        directions(system, q, e);
        scalars(&now, e, s);
        double error = largest(rows->count, s), length = system->length;
        closed = error <= CONSTRAINT_RTOL * length ||
                 (CONSTRAINT_STALLED_RTOL * length >= best && best <= error);
        best = error < best ? error : best;
        if (!closed) {
            jacobian(rows, e, G);
            mass_matrix(system, e, M, scratch);
            saddle(system->n, rows->count, M, G, G, kkt);
            zeros(system->n, right);
            for (size_t k = 0; k < r; k++) {
                right[n + k] = -s[k];
            }
            ok = solve((int)n, (int)r, kkt, right, length, scratch, problem);
            for (size_t i = 0; ok && i < n; i++) {
                q[i] += right[i];
            }
        }
    }
    if (ok && !closed) {
        return fail(problem,
                    "the loops of the mechanism could not be closed near this shape: connected "
                    "parts remain %.3g m apart; release nearer to the straight shape, or check the "
                    "lengths",
                    best);
    }
    return ok;
}

PRBM bool project_velocities(int n, int r, const double *M, const double *rows,
                             const double *rates, double *v, double *impulses, double length,
                             Scratch scratch, Problem *problem) {
    size_t size = (size_t)(n + r);
    double *kkt = take(&scratch, size * size), *right = take(&scratch, size);
    memset(right, 0, (size_t)n * sizeof *right);
    for (int k = 0; k < r; k++) {
        right[n + k] = -(dot(n, rows + k * n, v) + rates[k]);
    }
    saddle(n, r, M, rows, rows, kkt);
    for (size_t k = (size_t)n; impulses && k < size; k++) {
        kkt[k * size + k] -= impulses[k - (size_t)n];
    }
    bool regular = solve(n, r, kkt, right, length, scratch, problem);
    for (int i = 0; regular && i < n; i++) {
        v[i] += right[i];
    }
    for (int k = 0; regular && impulses && k < r; k++) {
        impulses[k] = -right[n + k];
    }
    return regular;
}
