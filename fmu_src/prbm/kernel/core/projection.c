/* Projection of a state onto the active constraints: the twin of Equations.project and
 * Equations.project_near in mechanics/dynamics.py. */
#include <math.h>

#include "core/branch_terms.h"
#include "core/matrix.h"
#include "core/projection.h"
#include "core/vectors.h"

/* The constant part of an active constraint at time t. */
static double offset(const Equations *eq, int k, double t) {
    if (eq->walls_move && k >= eq->first_hold && k < eq->first_stick) {
        int i = eq->held[k - eq->first_hold];
        const ContactPhase *touching = &eq->contacts.touching[i];
        double depth = touching->phase == PHASE_FROZEN ? touching->depth : 0.0;
        return eq->system->gaps_c[i] + wall_motion(&eq->inputs.walls[i], t).x + depth;
    }
    return eq->c[k];
}

/* The part of the rate of an active constraint that is prescribed at time t. */
PRBM double prescribed(const Equations *eq, int k, double t) {
    bool moves = eq->walls_move && k >= eq->first_hold && k < eq->first_stick;
    return moves ? wall_motion(&eq->inputs.walls[eq->held[k - eq->first_hold]], t).v : 0.0;
}

PRBM bool project_with_impulses(const Equations *equations, double t, double *y, double *impulses,
                                Scratch scratch, Problem *problem) {
    const Equations *eq = equations;
    size_t n = (size_t)eq->system->n, r = (size_t)eq->r;
    double *c = take(&scratch, r), *rates = take(&scratch, r), *rows = take(&scratch, r * n);
    double *M = take(&scratch, n * n);
    Complex *e = take_complex(&scratch, eq->system->d, 1);
    for (int k = 0; k < eq->r; k++) {
        c[k] = offset(eq, k, t);
        rates[k] = prescribed(eq, k, t);
        if (impulses) {
            bool held = k >= eq->first_hold && k < eq->first_stick;
            impulses[k] = held ? eq->inputs.mobilities[eq->held[k - eq->first_hold]] : 0.0;
        }
    }
    Rows positions = eq->active;
    positions.count = eq->first_stick;
    bool ok = project_positions(eq->system, &positions, y, c, e, scratch, problem);
    if (ok) {
        jacobian(&eq->active, e, rows);
        mass_matrix(eq->system, e, M, scratch);
        ok = project_velocities((int)n, eq->r, M, rows, rates, y + n, impulses, eq->system->length,
                                scratch, problem);
    }
    return ok;
}

PRBM bool project(const Equations *equations, double t, double *y, Scratch scratch,
                  Problem *problem) {
    return project_with_impulses(equations, t, y, NULL, scratch, problem);
}

PRBM void correction_place(Correction *correction, const System *system, Memory *memory) {
    size_t even = (size_t)system->even, begin = memory->used;
    size_t r = (size_t)system->r + 2 * (size_t)system->s + (size_t)system->f;
    correction->at = place_kinematics(system, memory);
    correction->rows = place(memory, r * even, sizeof(double));
    correction->by_direction =
        place(memory, system->mapped ? r * (size_t)system->wide : 0, sizeof(double));
    correction->convective = place(memory, r, sizeof(double));
    correction->residual = place(memory, r, sizeof(double));
    correction->change = place(memory, even + 2, sizeof(double));
    zero_placed(memory, begin);
}

/* The product of an active row with a vector, both of the padded length even. */
SIZED double product_of_row(int even, const Equations *eq, const Intervals *intervals, int k,
                            const double *row, const double *x) {
    return eq->dense ? even_dot(even, row, x) : interval_product(intervals, k, row, x);
}

/* The value of an active row without its constant. */
SIZED double active_value(int even, const Equations *eq, const Kinematics *at, int k) {
    if (has_shared_arms(eq->system) || eq->on[k] != FIXED) {
        return row_value(&eq->active, k, at->e);
    }
    const int wide = eq->system->mapped ? eq->system->wide : even;
    Parts B = parts_from(eq->B_conjugate, k * wide);
    return product_of_row(wide, eq, &eq->intervals.directions, k, B.re, at->e_parts.re) +
           product_of_row(wide, eq, &eq->intervals.directions, k, B.im, at->e_parts.im);
}

/* Compute the residuals of the positions, and return the largest magnitude. */
SIZED double position_residuals(int even, const Equations *eq, const Kinematics *at, double t,
                                double *residual) {
    double worst = 0.0;
    for (int k = 0; k < eq->r; k++) {
        bool placed = k < eq->first_stick;
        residual[k] = placed ? -(active_value(even, eq, at, k) + offset(eq, k, t)) : 0.0;
        worst = fabs(residual[k]) <= worst ? worst : fabs(residual[k]); /* a NaN stays */
    }
    return worst;
}

/* Compute the rows by the coordinates, if they are not the directions. */
NOINLINE void mapped_rows(const Equations *eq, Correction *c) {
    rows_and_convection(eq, &c->at, c->by_direction, c->convective);
    rows_to_coordinates(eq, c->by_direction, c->rows);
}

SIZED void velocity_residuals(int even, const Equations *eq, double t, Correction *c) {
    if (eq->system->mapped) {
        mapped_rows(eq, c);
    } else {
        rows_dispatch(even, eq, &c->at, c->rows, c->convective);
    }
    for (int k = 0; k < eq->r; k++) {
        double rate = product_of_row(even, eq, &eq->intervals.coordinates, k, c->rows + k * even,
                                     c->at.speed);
        c->residual[k] = -(rate + prescribed(eq, k, t));
    }
}

/* Add to y the smallest change, in the metric of the mass matrix, that removes the residuals. */
SIZED void correct(int even, const Equations *eq, const Factors *factors, Correction *c,
                   double *y) {
    UNROLLED_BY_LANES
    for (int j = 0; j < even; j += LANES) {
        set_lanes(c->change + j, all_lanes(0.0));
    }
    finish_dispatch(even, factors, c->change, c->residual);
    for (int i = 0; i < eq->system->n; i++) {
        y[i] += c->change[i];
    }
}

/* Correct y once by the factors of its evaluation; return false if a residual remains. */
SIZED bool corrected_of_length(int even, const Equations *eq, const Evaluation *evaluation,
                               const Reference *near, double t, double *y, Correction *c) {
    int n = eq->system->n;
    position_residuals(even, eq, &evaluation->at, t, c->residual);
    correct(even, eq, &evaluation->factors, c, y);
    pad_of(even, n, y, c->at.angle);
    arms_at(even, eq->system, near, &c->at);
    double worst = position_residuals(even, eq, &c->at, t, c->residual);
    if (!(worst <= CONSTRAINT_RTOL * eq->system->length)) {
        return false;
    }
    pad_second(even, n, y, c->at.speed);
    velocity_residuals(even, eq, t, c);
    correct(even, eq, &evaluation->factors, c, y + n);
    return true;
}

static bool corrected(const Equations *eq, const Evaluation *evaluation, const Reference *near,
                      double t, double *y, Correction *c) {
    int even = eq->system->even;
    switch (even) {
    case 4: return corrected_of_length(4, eq, evaluation, near, t, y, c);
    case 8: return corrected_of_length(8, eq, evaluation, near, t, y, c);
    default: return corrected_of_length(even, eq, evaluation, near, t, y, c);
    }
}

PRBM bool project_near(const Equations *equations, const Evaluation *evaluation,
                       const Reference *near, double t, double *y, Correction *correction,
                       Scratch scratch, Problem *problem) {
    const Equations *eq = equations;
    int n = eq->system->n;
    double *kept = take(&scratch, (size_t)n);
    copy(n, y, kept);
    if (eq->slipping_rows == 0 && corrected(eq, evaluation, near, t, y, correction)) {
        return true;
    }
    copy(n, kept, y); /* Undo the correction. */
    if (!project(eq, t, y, scratch, problem)) {
        return false;
    }
    pad(n, y, correction->at.angle);
    find_directions(eq->system, near, &correction->at);
    return true;
}
