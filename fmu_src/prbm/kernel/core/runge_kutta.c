/* The pair 5(4) of Bogacki and Shampine with a quartic: the data of hybrid/runge_kutta.py. */
#include "core/dynamics.h"
#include "core/matrix.h"
#include "core/runge_kutta.h"

static const double STAGE[STAGES][STAGES] = {
    {0.0},
    {1.0 / 6},
    {2.0 / 27, 4.0 / 27},
    {183.0 / 1372, -162.0 / 343, 1053.0 / 1372},
    {68.0 / 297, -4.0 / 11, 42.0 / 143, 1960.0 / 3861},
    {597.0 / 22528, 81.0 / 352, 63099.0 / 585728, 58653.0 / 366080, 4617.0 / 20480},
    {174197.0 / 959244, -30942.0 / 79937, 8152137.0 / 19744439, 666106.0 / 1039181,
     -29421.0 / 29068, 482048.0 / 414219},
    {587.0 / 8064, 0.0, 4440339.0 / 15491840, 24353.0 / 124800, 387.0 / 44800, 2152.0 / 5985,
     7267.0 / 94080},
};

static const double ERROR_WEIGHT[STAGES] = {
    -3817.0 / 1959552,          0.0,
    140181.0 / 15491840,        -4224731.0 / 272937600,
    8557.0 / 403200,            -57928.0 / 4363065,
    -23930231.0 / 4366535040.0, 3293.0 / 556956,
};

static const double DENSE_WEIGHT[STAGES][DENSE] = {
    {1.0, -6409.0 / 2016, 1051.0 / 288, -11269.0 / 8064},
    {0.0, 0.0, 0.0, 0.0},
    {0.0, 12398103.0 / 3872960, -2907981.0 / 553280, 7254279.0 / 3098368},
    {0.0, 302869.0 / 280800, -386561.0 / 280800, 110789.0 / 224640},
    {0.0, -1161.0 / 11200, 387.0 / 1600, -1161.0 / 8960},
    {0.0, -28192.0 / 17955, 11744.0 / 2565, -9512.0 / 3591},
    {0.0, -7267.0 / 7840, 7267.0 / 3360, -7267.0 / 6272},
    {0.0, 3.0 / 2, -4.0, 5.0 / 2},
};

/* More than the largest magnitudes of the weights of the dense output at any fraction. */
static const double LARGEST_WEIGHT[STAGES] = {0.103, 0.0,  0.329, 0.196,
                                              0.009, 0.36, 0.078, 0.068};

/* result = y + h sum(a_i k_i) for n even, as it is with two rates for each angle and two energies. */
SIZED void combine_of(int count, int n, int stride, double h, const double *a, const double *k,
                      const double *y, double *result) {
    Lanes weight[STAGES];
    UNROLLED
    for (int i = 0; i < count; i++) {
        weight[i] = all_lanes(a[i]);
    }
    UNROLLED_BY_LANES
    for (int j = 0; j < n; j += LANES) {
        Lanes sum = weight[0] * lanes_at(k + j);
        UNROLLED
        for (int i = 1; i < count; i++) {
            sum += weight[i] * lanes_at(k + i * stride + j);
        }
        set_lanes(result + j, lanes_at(y + j) + h * sum);
    }
}

SIZED void combine_length(int n, int stride, int count, double h, const double *a,
                          const double *k, const double *y, double *result) {
    switch (count) {
    case 1: combine_of(1, n, stride, h, a, k, y, result); break;
    case 2: combine_of(2, n, stride, h, a, k, y, result); break;
    case 3: combine_of(3, n, stride, h, a, k, y, result); break;
    case 4: combine_of(4, n, stride, h, a, k, y, result); break;
    case 5: combine_of(5, n, stride, h, a, k, y, result); break;
    case 6: combine_of(6, n, stride, h, a, k, y, result); break;
    case 7: combine_of(7, n, stride, h, a, k, y, result); break;
    default: combine_of(STAGES, n, stride, h, a, k, y, result);
    }
}

static void combine(int n, int count, double h, const double *a, const double *k, const double *y,
                    double *result) {
    switch (n) {
    case 8: combine_length(8, 8, count, h, a, k, y, result); break;
    case 16: combine_length(16, 16, count, h, a, k, y, result); break;
    default: combine_length(n, n, count, h, a, k, y, result);
    }
}

/* The stages k (STAGES, n), of which the first is given, and the new state y1. */
PRBM bool stages(Equations *equations, int n, double t, const double *y, double h, double *k,
                 double *y1, Problem *problem) {
    (void)t; /* see rate */
    start_from(equations, y);
    for (int i = 1; i < STAGES; i++) {
        combine(n, i, h, STAGE[i], k, y, y1);
        if (!rates_at(equations, y1, true, k + i * n, problem)) {
            return false;
        }
    }
    return true;
}

PRBM void error_of(int n, const double *k, double h, double *error) {
    zeros(n, error);
    combine(n, STAGES, h, ERROR_WEIGHT, k, error, error);
}

/* How far the first n components of the dense output can be from the start of the step. */
static void furthest(int n, int ny, const double *k, double h, double *distance) {
    for (int j = 0; j < n; j += LANES) {
        Lanes sum = NO_LANES;
        for (int i = 0; i < STAGES; i++) {
            sum += LARGEST_WEIGHT[i] * magnitudes(lanes_at(k + i * ny + j));
        }
        set_lanes(distance + j, h * sum);
    }
}

/* The weights of the stages at a fraction of a step. */
PRBM void weights(double theta, double *b) {
    for (int i = 0; i < STAGES; i++) {
        const double *d = DENSE_WEIGHT[i];
        b[i] = theta * (d[0] + theta * (d[1] + theta * (d[2] + theta * d[3])));
    }
}

PRBM void interpolate(int n, const double *y, const double *k, double h, double theta,
                      double *result) {
    double b[STAGES];
    weights(theta, b);
    combine(n, STAGES, h, b, k, y, result);
}
