/* The Runge-Kutta pair and its interpolant: the data of hybrid/runge_kutta.py. */
#include <math.h>

#include "core/dynamics.h"
#include "core/runge_kutta.h"
#include "core/vectors.h"

static const double STAGE_TIME[STAGES] = STAGE_TIMES;
static const double STAGE[STAGES][STAGES] = STAGE_WEIGHTS;
static const double ERROR_WEIGHT[STAGES] = ERROR_WEIGHTS;
static const double COARSE_ERROR_WEIGHT[STAGES] = COARSE_ERROR_WEIGHTS;
static const double DENSE_WEIGHT[STAGES][DENSE] = DENSE_WEIGHTS;
static const double LARGEST_WEIGHT[STAGES] = LARGEST_WEIGHTS;

/* Compute y + h sum(a_i k_i) for all stages.  The length n is even: y contains angles, as many
 * rates, and two energies. */
static void combine(int n, double h, const double *a, const double *k, const double *y,
                    double *result) {
    Lanes weight[STAGES];
    UNROLLED
    for (int i = 0; i < STAGES; i++) {
        weight[i] = all_lanes(a[i]);
    }
    for (int j = 0; j < n; j += LANES) {
        Lanes sum = weight[0] * lanes_at(k + j);
        UNROLLED
        for (int i = 1; i < STAGES; i++) {
            sum += weight[i] * lanes_at(k + i * n + j);
        }
        set_lanes(result + j, lanes_at(y + j) + h * sum);
    }
}

/* Compute the sum of the stages times the weights of a row of the tableau, which the compiler
 * knows.  Weights of zero take no time. */
SIZED Lanes weighted(int count, const double *a, int n, const double *k) {
    Lanes sum = a[0] * lanes_at(k);
    UNROLLED
    for (int i = 1; i < count; i++) {
        if (a[i] != 0.0) {
            sum += a[i] * lanes_at(k + i * n);
        }
    }
    return sum;
}

/* Compute the state of a stage. */
SIZED void stage_of(int row, int n, double h, const double *k, const double *y, double *result) {
    UNROLLED_BY_LANES
    for (int j = 0; j < n; j += LANES) {
        set_lanes(result + j, lanes_at(y + j) + h * weighted(row, STAGE[row], n, k + j));
    }
}

SIZED void stage_length(int n, int row, double h, const double *k, const double *y,
                        double *result) {
    switch (row) {
    case 1: stage_of(1, n, h, k, y, result); break;
    case 2: stage_of(2, n, h, k, y, result); break;
    case 3: stage_of(3, n, h, k, y, result); break;
    case 4: stage_of(4, n, h, k, y, result); break;
    case 5: stage_of(5, n, h, k, y, result); break;
    case 6: stage_of(6, n, h, k, y, result); break;
    case 7: stage_of(7, n, h, k, y, result); break;
    case 8: stage_of(8, n, h, k, y, result); break;
    default: stage_of(STAGES - 1, n, h, k, y, result);
    }
}

static void stage_state(int n, int row, double h, const double *k, const double *y,
                        double *result) {
    switch (n) {
    case 8: stage_length(8, row, h, k, y, result); break;
    case 16: stage_length(16, row, h, k, y, result); break;
    default: stage_length(n, row, h, k, y, result);
    }
}

static void add_to_range(const Equations *eq, const Evaluation *evaluation, ForceRange *range) {
    const double *force = evaluation->lam + eq->first_hold;
    for (int k = 0; k < eq->held_count; k++) {
        range->least[k] = lesser(force[k], range->least[k]);
        range->largest[k] = greater(force[k], range->largest[k]);
    }
}

PRBM bool stages(const Equations *equations, double t, int n, const double *y, double h,
                 double *k, double *y1, Reference *reference, Evaluation *evaluation,
                 ForceRange *forces, Problem *problem) {
    for (int i = 0; i < equations->held_count; i++) {
        forces->least[i] = HUGE_VAL;
        forces->largest[i] = -HUGE_VAL;
    }
    set_reference(reference, equations->system, y);
    evaluation->at.extra = y1 + equations->system->mechanism->first_extra;
    for (int i = 1; i < STAGES; i++) {
        stage_state(n, i, h, k, y, y1);
        if (equations->walls_move) {
            evaluation->at.time = t + STAGE_TIME[i] * h;
        }
        if (!rate_at_time(equations, y1, reference, evaluation, k + i * n, problem)) {
            return false;
        }
        add_to_range(equations, evaluation, forces);
    }
    return true;
}

PRBM void errors_of(int n, const double *k, double h, double *fine, double *coarse) {
    for (int j = 0; j < n; j += LANES) {
        set_lanes(fine + j, h * weighted(STAGES, ERROR_WEIGHT, n, k + j));
        set_lanes(coarse + j, h * weighted(STAGES, COARSE_ERROR_WEIGHT, n, k + j));
    }
}

PRBM void fine_error_of(int n, const double *k, double h, double *fine) {
    for (int j = 0; j < n; j += LANES) {
        set_lanes(fine + j, h * weighted(STAGES, ERROR_WEIGHT, n, k + j));
    }
}

/* Bound the distance of the first n components of the dense output from their values at the start
 * of the step. */
PRBM void furthest(int n, int ny, const double *k, double h, double *distance) {
    for (int j = 0; j < n; j += LANES) {
        Lanes sum = NO_LANES;
        UNROLLED
        for (int i = 0; i < STAGES; i++) {
            if (LARGEST_WEIGHT[i] > 0.0) {
                sum += LARGEST_WEIGHT[i] * magnitudes(lanes_at(k + i * ny + j));
            }
        }
        set_lanes(distance + j, h * sum);
    }
}

/* Compute the weights b of the stages in the dense output at a fraction theta of a step. */
PRBM void weights(double theta, double *b) {
    for (int i = 0; i < STAGES; i++) {
        const double *d = DENSE_WEIGHT[i];
        b[i] = theta * (d[0] + theta * (d[1] + theta * (d[2] + theta * (d[3] + theta * d[4]))));
    }
}

PRBM void interpolate(int n, const double *y, const double *k, double h, double theta,
                      double *result) {
    double b[STAGES];
    weights(theta, b);
    combine(n, h, b, k, y, result);
}

PRBM void step_end(int n, const double *y, const double *k, double h, double *end) {
    stage_state(n, STAGES - 1, h, k, y, end);
}

PRBM void hermite_weights(const double *nodes, double t, double *value, double *rate) {
    for (int i = 0; i < NODES; i++) {
        double node = nodes[i], a = nodes[(i + 1) % NODES], b = nodes[(i + 2) % NODES];
        double product = (node - a) * (node - b), x = t - node;
        /* With u = (t - a) (t - b)/product, the polynomials of the node are u^3 times the first
         * three terms of 1/u^3 (1, x, x^2/2) = (1 - c x + d x^2) (1, x, x^2/2). */
        double u = (t - a) * (t - b) / product, slope = ((t - a) + (t - b)) / product;
        double cube = u * u * u, cube_slope = 3.0 * u * u * slope;
        double sum = 1.0 / (node - a) + 1.0 / (node - b);
        double c = 3.0 * sum, d = 6.0 * sum * sum - 3.0 / product;
        double basis[NODES] = {1.0 - c * x + d * x * x, x - c * x * x, 0.5 * x * x};
        double slopes[NODES] = {2.0 * d * x - c, 1.0 - 2.0 * c * x, x};
        for (int k = 0; k < NODES; k++) {
            value[i * NODES + k] = cube * basis[k];
            rate[i * NODES + k] = cube_slope * basis[k] + cube * slopes[k];
        }
    }
}
