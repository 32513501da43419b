/* Flexures as rigid segments and torsion springs: the twin of prbm/flexure.py. */
#include <math.h>

#include "kernel.h"

PRBM bool stub(int pivots, const double *gamma, double *gamma0, Problem *problem) {
    double sum = 0.0;
    for (int i = 0; i < pivots; i++) {
        sum += gamma[i];
    }
    *gamma0 = 1.0 - sum;
    if (*gamma0 < -1e-12) {
        return fail(problem,
                    "the links of a flexure are longer than the flexure: the sum of its gammas is "
                    "%.6g, so that gamma0 = %.6g < 0; choose gammas that add up to at most 1",
                    sum, *gamma0);
    }
    *gamma0 = *gamma0 > 0.0 ? *gamma0 : 0.0;
    return true;
}

PRBM void reverse(int count, double *x) {
    for (int i = 0; i < count / 2; i++) {
        double kept_one = x[i];
        x[i] = x[count - 1 - i];
        x[count - 1 - i] = kept_one;
    }
}

/* The segments of one cantilever, from the clamp to the tip, mirrored at its tip or not. */
static void cut(const FlexureType *model, double gamma0, const double *gamma,
                const double *K_theta, bool mirrored, double h, double EI, Segments *result) {
    int pivots = model->pivots, n = mirrored ? 2 * pivots - 1 : pivots;
    result->n = n;
    for (int i = 0; i <= pivots; i++) {
        result->lengths[i] = h * (i == 0 ? gamma0 : gamma[i - 1]);
    }
    for (int i = 0; i < pivots; i++) {
        result->rates[i] = (model->rate_with_gamma ? gamma[i] : 1.0) * K_theta[i] * EI / h;
    }
    if (mirrored) {
        result->lengths[pivots] *= 2.0;
        for (int i = 0; i < pivots; i++) {
            result->lengths[n + 1 - i] = result->lengths[i];
            result->rates[n - i] = result->rates[i];
        }
    } else {
        result->lengths[n + 1] = 0.0;
        result->rates[n] = 0.0;
    }
}

PRBM bool segments(const FlexureType *model, const double *gamma, const double *K_theta,
                   bool clamped_start, bool clamped_end, double L, double EI, double mass,
                   Segments *result, Problem *problem) {
    bool mirrored = clamped_start && clamped_end;
    double gamma0;
    if (!stub(model->pivots, gamma, &gamma0, problem)) {
        return false;
    }
    cut(model, gamma0, gamma, K_theta, mirrored, mirrored ? L / 2 : L, EI, result);
    int n = result->n;
    if (!clamped_start) {
        reverse(n + 2, result->lengths);
        reverse(n + 1, result->rates);
    }
    double r = 0.0;
    for (int i = 1; i <= n; i++) {
        r = result->lengths[i] > r ? result->lengths[i] : r;
    }
    double lump = model->lumped ? mass / 4 + (mass * (L * L) / 12) / (r * r) : 0.0;
    for (int i = 0; i < n + 1; i++) {
        result->lumps[i] = lump;
    }
    for (int i = 0; i < n + 2; i++) {
        result->rods[i] = model->lumped ? 0.0 : mass * result->lengths[i] / L;
    }
    return true;
}
