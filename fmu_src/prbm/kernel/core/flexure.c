/* Flexures as rigid segments, torsion and axial springs: the twin of mechanism/flexure.py. */
#include "core/flexure.h"

PRBM bool stub(int pivots, const double *gamma, double *gamma0, Problem *problem) {
    double sum = 0.0;
    for (int i = 0; i < pivots; i++) {
        sum += gamma[i];
    }
    *gamma0 = 1.0 - sum;
    if (*gamma0 < -STUB_RTOL) {
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

PRBM void reversed(Segments *pieces) {
    int n = pieces->n;
    reverse(n + 2, pieces->lengths);
    reverse(n + 1, pieces->rates);
    reverse(n + 2, pieces->rods);
    reverse(n + 1, pieces->lumps);
    reverse(n, pieces->axial);
}

/* Two mirrored halves share the middle link.  At a free end the last link is part of the body. */
PRBM int links_of(const FlexureType *model, int type_at_start, int type_at_end) {
    if (model->links > 0) {
        return model->links;
    }
    if (type_at_start == PIN && type_at_end == PIN) {
        return 1;
    }
    if (type_at_start == CLAMP && type_at_end == CLAMP) {
        return 2 * model->pivots - 1;
    }
    return type_at_start == FREE || type_at_end == FREE ? model->pivots - 1 : model->pivots;
}

/* Every link of a chain stretches; of other flexures, link n / 2 from a clamp, rounded down: the
 * middle one, or the one after the middle. */
PRBM bool stretches(const FlexureType *model, int type_at_start, int i, int n) {
    int middle = type_at_start == CLAMP ? n / 2 : n - 1 - n / 2;
    return model->axial && (model->links > 0 || i == middle);
}

/* Set the segments of a chain of equal links. */
static void cut_chain(const FlexureType *model, int type_at_start, int type_at_end, double L,
                      double EI, Segments *result) {
    int n = model->links;
    double rate = n * EI / L;
    for (int i = 0; i <= n; i++) {
        result->lengths[i] = i == 0 ? 0.0 : L / n;
        result->rates[i] = rate;
    }
    result->lengths[n + 1] = 0.0;
    result->rates[0] = type_at_start == PIN ? 0.0 : 2 * rate;
    result->rates[n] = type_at_end == PIN ? 0.0 : 2 * rate;
}

/* Set the segments of a flexure between two pins: one link. */
static void cut_bar(double L, Segments *result) {
    result->lengths[0] = result->lengths[2] = 0.0;
    result->lengths[1] = L;
    result->rates[0] = result->rates[1] = 0.0;
}

/* Set the segments of one cantilever of length h, or of two mirrored ones. */
static bool cut_cantilevers(const FlexureType *model, const double *gamma, const double *K_theta,
                            int type_at_start, int type_at_end, double L, double EI,
                            Segments *result, Problem *problem) {
    bool mirrored = type_at_start == CLAMP && type_at_end == CLAMP;
    int pivots = model->pivots, n = result->n;
    double h = mirrored ? L / 2 : L, gamma0;
    if (!stub(pivots, gamma, &gamma0, problem)) {
        return false;
    }
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
    } else if (n == pivots) { /* The tip is a pin. */
        result->lengths[n + 1] = 0.0;
        result->rates[n] = 0.0;
    }
    if (type_at_start != CLAMP) {
        reverse(n + 2, result->lengths);
        reverse(n + 1, result->rates);
    }
    return true;
}

PRBM bool segments(const FlexureType *model, const double *gamma, const double *K_theta,
                   int type_at_start, int type_at_end, double L, double EI, double mass, double EA,
                   Segments *result, Problem *problem) {
    int n = result->n = links_of(model, type_at_start, type_at_end);
    bool clamped = type_at_start == CLAMP || type_at_end == CLAMP;
    bool freed = type_at_start == FREE || type_at_end == FREE;
    if (model->links > 0) {
        cut_chain(model, type_at_start, type_at_end, L, EI, result);
    } else if (type_at_start == PIN && type_at_end == PIN) {
        cut_bar(L, result);
    } else if (!cut_cantilevers(model, gamma, K_theta, type_at_start, type_at_end, L, EI, result,
                                problem)) {
        return false;
    }
    bool lumped = model->lumped && clamped && !freed;
    double r = lumped ? largest(n, result->lengths + 1) : 1.0;
    for (int i = 0; i < n + 1; i++) {
        result->lumps[i] = lumped ? mass / 4 + (mass * (L * L) / 12) / (r * r) : 0.0;
    }
    for (int i = 0; i < n + 2; i++) {
        result->rods[i] = lumped ? 0.0 : mass * result->lengths[i] / L;
    }
    for (int i = 0; i < n; i++) {
        double stiffness = (model->links > 0 ? model->links : 1) * EA / L;
        result->axial[i] = stretches(model, type_at_start, i, n) ? stiffness : 0.0;
    }
    return true;
}
