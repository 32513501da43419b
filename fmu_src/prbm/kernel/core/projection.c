/* Projection of a state onto the active constraints. */
#include <math.h>

#include "core/kinetics.h"
#include "core/matrix.h"
#include "core/projection.h"

/* The constant part of an active constraint at time t. */
static double offset(const Equations *q, int k, double t) {
    if (k >= q->first_hold && k < q->first_stick) {
        int i = q->held[k - q->first_hold];
        return q->system->gaps_c[i] + wall_at(&q->inputs.walls[i], t);
    }
    return q->c[k];
}

/* The part of the rate of an active constraint that is prescribed. */
static double prescribed(const Equations *q, int k) {
    bool holds = k >= q->first_hold && k < q->first_stick;
    return holds ? q->inputs.walls[q->held[k - q->first_hold]].rate : 0.0;
}

PRBM bool project(Equations *equations, double t, double *y, Scratch *scratch, Problem *problem) {
    Equations *q = equations;
    size_t mark = scratch->used, n = (size_t)q->system->n, r = (size_t)q->r;
    double *c = take(scratch, r), *rates = take(scratch, r), *rows = take(scratch, r * n);
    double *M = take(scratch, n * n), *C = take(scratch, n * n);
    Complex *e = (Complex *)take(scratch, 2 * n);
    for (int k = 0; k < q->r; k++) {
        c[k] = offset(q, k, t);
        rates[k] = prescribed(q, k);
    }
    Rows positions = q->active;
    positions.count = q->first_stick;
    bool right = project_positions(q->system, &positions, y, c, e, scratch, problem);
    if (right) {
        jacobian(&q->active, e, rows);
        inertia((int)n, q->system->H, q->system->J, e, M, C);
        right = project_velocities((int)n, q->r, M, rows, rates, y + n, scratch, problem);
    }
    scratch->used = mark;
    return right;
}

/* The value of an active row, but for its constant, at the state that was evaluated last. */
SIZED double active_value(int even, const Equations *q, int k) {
    if (q->system->stretch_count > 0 || q->on[k] != FIXED) {
        return row_value(&q->active, k, q->e);
    }
    Parts B = parts_from(q->B_conjugate, k * even), e = q->e_parts;
    Lanes sum[SUMS] = {NO_LANES};
    UNROLLED_BY_LANES
    for (int j = 0; j < even; j += LANES) {
        Lanes re = lanes_at(B.re + j) * lanes_at(e.re + j);
        Lanes im = lanes_at(B.im + j) * lanes_at(e.im + j);
        sum[SUM_OF(j)] += re + im;
    }
    return total(sum);
}

/* The worst distance from the constraints, in what lam asks for. */
SIZED double ask_positions(int even, Equations *q, double t) {
    double worst = 0.0;
    for (int k = 0; k < q->r; k++) {
        q->lam[k] = k < q->first_stick ? -(active_value(even, q, k) + offset(q, k, t)) : 0.0;
        worst = fabs(q->lam[k]) <= worst ? worst : fabs(q->lam[k]); /* a NaN stays */
    }
    return worst;
}

SIZED void ask_velocities(int even, Equations *q) {
    rows_of_length(even, q, q->rows);
    for (int k = 0; k < q->r; k++) {
        q->lam[k] = -(even_dot(even, q->rows + k * even, q->speed) + prescribed(q, k));
    }
}

/* y += what the rows ask for. */
SIZED void correct(int even, Equations *q, double *y) {
    UNROLLED_BY_LANES
    for (int j = 0; j < even; j += LANES) {
        set_lanes(q->x + j, all_lanes(0.0));
    }
    finish_of_length(even, &q->factors, q->x, q->lam);
    for (int i = 0; i < q->system->n; i++) {
        y[i] += q->x[i];
    }
}

/* One correction by the factors at hand; turned: near the start. */
SIZED bool corrected_of_length(int even, Equations *q, double t, double *y, bool turned) {
    int n = q->system->n;
    ask_positions(even, q, t); /* e is that of y: evaluated last */
    correct(even, q, y);
    pad_of(even, n, y, q->angle);
    directions_of(even, q, turned);
    if (!(ask_positions(even, q, t) <= CONSTRAINT_RTOL * q->system->length)) {
        return false;
    }
    pad_second(even, n, y, q->speed);
    ask_velocities(even, q);
    correct(even, q, y + n);
    return true;
}

static bool corrected(Equations *q, double t, double *y, bool turned) {
    int even = q->system->even;
    switch (even) {
    case 4: return corrected_of_length(4, q, t, y, turned);
    case 8: return corrected_of_length(8, q, t, y, turned);
    default: return corrected_of_length(even, q, t, y, turned);
    }
}

static bool project_near(Equations *q, double t, double *y, bool turned, Scratch *scratch,
                         Problem *problem) {
    int n = q->system->n;
    size_t mark = scratch->used;
    double *kept = take(scratch, (size_t)n);
    copy(n, y, kept);
    scratch->used = mark;
    if (q->sliding_count == 0 && corrected(q, t, y, turned)) {
        return true;
    }
    copy(n, kept, y); /* as if nothing had been tried */
    return project(q, t, y, scratch, problem);
}

/* The directions at angles near the start. */
static const Complex *directions_near(Equations *q, const double *angle) {
    pad(q->system->n, angle, q->angle);
    find_directions(q, true);
    return q->e;
}

PRBM bool project_from_here(Equations *equations, double t, double *y, Scratch *scratch,
                            Problem *problem) {
    return project_near(equations, t, y, false, scratch, problem);
}
