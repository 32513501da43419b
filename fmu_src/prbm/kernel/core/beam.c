/* A beam whose bending moment is a polynomial: the twin of mechanics/beam.py. */
#include <math.h>

#include "core/beam.h"
#include "core/matrix.h"

#define HALF_TURN 3.141592653589793 /* rad */

/* Compute the Legendre polynomials P_0 to P_order at x. */
static void legendre(int order, double x, double *P) {
    P[0] = 1.0;
    if (order > 0) {
        P[1] = x;
    }
    for (int k = 2; k <= order; k++) {
        P[k] = ((2 * k - 1) * x * P[k - 1] - (k - 1) * P[k - 2]) / k;
    }
}

/* Each node is a zero of P_count, found by Newton's method from an approximation. */
PRBM void gauss(int count, double *nodes, double *weights) {
    double P[NODES_MAX + 1];
    for (int i = 0; i < count; i++) {
        Complex start;
        double angle = HALF_TURN * (i + 0.75) / (count + 0.5), x, slope = 1.0;
        unit_vectors(1, &angle, &start);
        x = -start.re;
        for (int step = 0; step < GAUSS_ITERATIONS_MAX; step++) {
            legendre(count, x, P);
            slope = count * (P[count - 1] - x * P[count]) / (1.0 - x * x);
            x -= P[count] / slope;
        }
        nodes[i] = x;
        weights[i] = 2.0 / ((1.0 - x * x) * (slope * slope));
    }
}

PRBM void integrals(int order, double x, double *S) {
    double P[NODES_MAX + 2];
    legendre(order + 1, x, P);
    S[0] = 0.5 * (1.0 + x);
    for (int k = 1; k <= order; k++) {
        S[k] = 0.5 * (P[k + 1] - P[k - 1]) / (2 * k + 1);
    }
}

PRBM Beam take_beam(int order, int nodes, Scratch *scratch) {
    size_t n = (size_t)order + 1, N = (size_t)nodes;
    Beam beam = {order, nodes, take(scratch, N * n), take(scratch, N * N), take(scratch, N),
                 take(scratch, N), take(scratch, N), take(scratch, N * n), take(scratch, n)};
    return beam;
}

/* Compute the integrals (N,) of the interpolated directions from the start to x. */
static void set_positions(const Beam *beam, double L, double x, const double *nodes,
                          const double *weights, double *lengths) {
    double S[NODES_MAX + 1], P[NODES_MAX + 1];
    int N = beam->nodes;
    integrals(N - 1, x, S);
    for (int m = 0; m < N; m++) {
        legendre(N - 1, nodes[m], P);
        double sum = 0.0;
        for (int k = 0; k < N; k++) {
            sum += (2 * k + 1) * S[k] * P[k];
        }
        lengths[m] = 0.5 * L * weights[m] * sum;
    }
}

PRBM void set_beam(Beam *beam, double L, double EI, double mass, Scratch *scratch) {
    size_t mark = scratch->used;
    int N = beam->nodes;
    double *nodes = take(scratch, (size_t)N), *weights = take(scratch, (size_t)N);
    gauss(N, nodes, weights);
    for (int i = 0; i < N; i++) {
        integrals(beam->order, nodes[i], beam->S + i * (beam->order + 1));
        set_positions(beam, L, nodes[i], nodes, weights, beam->A + i * N);
        beam->masses[i] = weights[i] * (mass / 2);
        beam->places[i] = 0.5 * L * (1.0 + nodes[i]);
        legendre(beam->order, nodes[i], beam->moments + i * (beam->order + 1));
    }
    set_positions(beam, L, 1.0, nodes, weights, beam->whole);
    for (int k = 0; k <= beam->order; k++) {
        beam->rates[k] = EI / L / (2 * k + 1);
    }
    scratch->used = mark;
}
