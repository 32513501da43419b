/* Rigid impacts in contact space: Newton's law for all stops at once, Stronge's with friction.
 *
 * Sources: as in the twin, mechanics/contact.py.
 */
#include <math.h>

#include "core/constraints.h"
#include "core/contact.h"
#include "core/matrix.h"

static const double RELAXATIONS[] = SWEEP_RELAXATIONS;

PRBM bool response(int n, int r, int k, const double *M, const double *held, const double *rows,
                   double *X, Scratch *scratch, Problem *problem) {
    size_t used = scratch->used;
    int size = n + r;
    double *kkt = take_matrix(scratch, size, size), *right = take(scratch, (size_t)size);
    bool solved = true;
    for (int j = 0; solved && j < k; j++) {
        saddle(n, r, M, held, held, kkt);
        for (int i = 0; i < size; i++) {
            right[i] = i < n ? rows[j * n + i] : 0.0;
        }
        solved = solve(size, kkt, right, scratch, problem);
        for (int i = 0; i < n; i++) {
            X[i * k + j] = right[i];
        }
    }
    scratch->used = used;
    return solved;
}

/* --- without friction ------------------------------------------------------------------------- */

/* The next of the sets of so many out of k, in lexical order; false after the last. */
static bool next_set(int k, int size, int *members) {
    int i = size - 1;
    while (i >= 0 && members[i] == k - size + i) {
        i--;
    }
    if (i < 0) {
        return false;
    }
    members[i]++;
    for (int j = i + 1; j < size; j++) {
        members[j] = members[j - 1] + 1;
    }
    return true;
}

/* W_ss P_s = -b_s for the members s, none for the others */
static void impulses_of_set(int k, int size, const int *members, const double *W, const double *b,
                            double *P, Scratch *scratch) {
    size_t used = scratch->used;
    double *part = take_matrix(scratch, size, size), *right = take(scratch, (size_t)size);
    double *found = take(scratch, (size_t)size);
    for (int i = 0; i < size; i++) {
        right[i] = -b[members[i]];
        for (int j = 0; j < size; j++) {
            part[i * size + j] = W[members[i] * k + members[j]];
        }
    }
    least_squares(size, size, part, right, IMPULSE_RANK_RTOL, found, scratch);
    zeros(k, P);
    for (int i = 0; i < size; i++) {
        P[members[i]] = found[i];
    }
    scratch->used = used;
}

/* What W P + b >= 0, P >= 0, P (W P + b) = 0 is violated by, as a velocity. */
static double violation_of(int k, const double *W, const double *b, const double *P) {
    double worst = -HUGE_VAL, product = 0.0;
    for (int i = 0; i < k; i++) {
        double opening = dot(k, W + i * k, P) + b[i];
        double push = P[i] * W[i * k + i];
        worst = greater(worst, greater(-opening, -push));
        product = greater(product, fabs(push * opening));
    }
    return greater(worst, sqrt(product));
}

static void keep_positive(int k, const double *P, double *kept) {
    for (int i = 0; i < k; i++) {
        kept[i] = P[i] > 0.0 ? P[i] : 0.0;
    }
}

/* Gauss-Seidel, which lowers P.W P/2 + b.P with each step, where the sets are too many. */
static void newton_sweeps(int k, const double *W, const double *b, double *P) {
    zeros(k, P);
    for (int sweep = 0; sweep < SWEEPS_MAX; ++sweep) {
        for (int i = 0; i < k; i++) {
            double mobility = W[i * k + i];
            if (mobility > 0.0) {
                P[i] = greater(0.0, P[i] - (dot(k, W + i * k, P) + b[i]) / mobility);
            }
        }
    }
}

/* Try every set of stops that may receive an impulse; P becomes the least violating one. */
static void newton_search(int k, const double *W, const double *b, double tolerance, double *P,
                          Scratch *scratch) {
    int *members = take_integers(scratch, k);
    double *trial = take(scratch, (size_t)k), worst = HUGE_VAL;
    zeros(k, P);
    /* the largest sets first: a stop that closes nearly always receives an impulse */
    for (int size = k; size >= 0; size--) {
        for (int i = 0; i < size; i++) {
            members[i] = i;
        }
        do {
            impulses_of_set(k, size, members, W, b, trial, scratch);
            double violation = violation_of(k, W, b, trial);
            if (violation <= tolerance) {
                keep_positive(k, trial, P);
                return;
            }
            if (violation < worst) {
                worst = violation;
                keep_positive(k, trial, P);
            }
        } while (next_set(k, size, members));
    }
}

PRBM void newton(int k, const double *W, const double *u, const double *restitution, double *P,
                 Scratch *scratch) {
    size_t used = scratch->used;
    double *b = take(scratch, (size_t)k);
    for (int i = 0; i < k; i++) {
        b[i] = (1.0 + restitution[i]) * u[i];
    }
    if (k <= IMPACT_SETS_MAX) {
        newton_search(k, W, b, COMPLEMENTARITY_RTOL * largest(k, u), P, scratch);
    } else {
        newton_sweeps(k, W, b, P);
    }
    scratch->used = used;
}

/* --- one hit with friction -------------------------------------------------------------------- */

static double sign_of(double x) {
    return x < 0.0 ? -1.0 : 1.0;
}

/* The impulse after which the work of restitution is done, or opening stops. */
static double restitution_ends(double u_n, double rate_n, double left) {
    double root = u_n * u_n + 2.0 * rate_n * left;
    if (root < 0.0) {
        return -u_n / rate_n;
    }
    double total = u_n + sqrt(root);
    return total > 0.0 ? 2.0 * left / total : HUGE_VAL;
}

/* dP_t/dP_n by Coulomb's law: slipping, sticking, or starting to slip from rest. */
static double friction_ratio(double nt, double tt, double u_t, double friction) {
    if (u_t != 0.0) {
        return -friction * sign_of(u_t);
    }
    if (fabs(nt) <= friction * tt) {
        return tt > 0.0 ? -nt / tt : 0.0;
    }
    return -friction * sign_of(nt);
}

/* A hit in progress: rates, impulses, and how the rates change with the normal impulse. */
typedef struct {
    double nn, nt, tt, friction;
    double u_n, u_t, p_n, p_t;
    double ratio, rate_n, rate_t;
} Hit;

/* The normal impulse after which sliding stops, with the rates until then. */
static double stops_sliding(Hit *hit) {
    hit->ratio = friction_ratio(hit->nt, hit->tt, hit->u_t, hit->friction);
    hit->rate_n = hit->nn + hit->ratio * hit->nt;
    hit->rate_t = hit->nt + hit->ratio * hit->tt;
    return hit->u_t * hit->rate_t < 0.0 ? -hit->u_t / hit->rate_t : HUGE_VAL;
}

static double work_of(const Hit *hit, double step) {
    return hit->u_n * step + hit->rate_n * (step * step) / 2;
}

static void receive(Hit *hit, double step) {
    hit->p_n += step;
    hit->p_t += hit->ratio * step;
}

/* Returns the work of compression. */
static double compress(Hit *hit) {
    double work = 0.0;
    while (hit->u_n < 0.0) {
        double sticking = stops_sliding(hit);
        double closed = hit->rate_n > WEDGED_RTOL * hit->nn ? -hit->u_n / hit->rate_n : HUGE_VAL;
        double step = lesser(sticking, closed);
        if (step == HUGE_VAL) {
            break;
        }
        work -= work_of(hit, step);
        receive(hit, step);
        hit->u_n = step == closed ? 0.0 : hit->u_n + hit->rate_n * step;
        hit->u_t = step == sticking ? 0.0 : hit->u_t + hit->rate_t * step;
    }
    return work;
}

static void restore(Hit *hit, double left) {
    while (left > 0.0) {
        double sticking = stops_sliding(hit);
        double rate = fabs(hit->rate_n) > WEDGED_RTOL * hit->nn ? hit->rate_n : 0.0;
        double spent = restitution_ends(hit->u_n, rate, left);
        double step = lesser(sticking, spent);
        if (step == HUGE_VAL) {
            break;
        }
        left -= work_of(hit, step);
        receive(hit, step);
        if (step == spent) {
            break;
        }
        hit->u_n = greater(0.0, hit->u_n + hit->rate_n * step);
        hit->u_t = 0.0;
    }
}

PRBM void stronge(const double *W, const double *u, double friction, double restitution,
                  double *P_n, double *P_t) {
    Hit hit = {.nn = W[0], .nt = W[1], .tt = W[3], .friction = friction, .u_n = u[0], .u_t = u[1]};
    double reach = hit.nn > 0.0 ? fabs(hit.u_n) * sqrt(hit.tt / hit.nn) : 0.0;
    double small_n = ZERO_SPEED_RTOL * fabs(hit.u_n);
    double small_t = ZERO_SPEED_RTOL * (fabs(hit.u_t) + reach);
    double work = compress(&hit);
    /* with one degree of freedom both rates vanish together, up to a rounding */
    hit.u_n = hit.u_n > small_n ? hit.u_n : 0.0;
    hit.u_t = fabs(hit.u_t) > small_t ? hit.u_t : 0.0;
    restore(&hit, restitution * restitution * work);
    *P_n = hit.p_n;
    *P_t = hit.p_t;
}

/* --- several hits with friction --------------------------------------------------------------- */

static double between(double low, double x, double high) {
    return lesser(high, greater(low, x));
}

/* One Gauss-Seidel step towards u_i + (W P)_i = 0, within the limits of the impulse. */
static void relax(int size, const double *W, const double *u, double relaxation, int i, double low,
                  double high, double *P) {
    const double *row = W + i * size;
    if (row[i] > 0.0) {
        double wanted = P[i] - relaxation * (u[i] + dot(size, row, P)) / row[i];
        P[i] = between(low, wanted, high);
    }
}

/* Gauss-Seidel over contacts: P_n >= least, u_n >= 0, complementary; Coulomb's law.  last (2 k,) is
 * for its own use. */
static bool relaxed_sweeps(int k, const double *W, const double *u, const double *friction,
                           const double *least, double relaxation, double *P, double *last) {
    copy(k, least, P);
    zeros(k, P + k);
    for (int sweep = 0; sweep < SWEEPS_MAX; ++sweep) {
        copy(2 * k, P, last);
        for (int i = 0; i < k; i++) {
            relax(2 * k, W, u, relaxation, i, least[i], HUGE_VAL, P);
            double limit = friction[i] * P[i];
            relax(2 * k, W, u, relaxation, k + i, -limit, limit, P);
        }
        for (int i = 0; i < 2 * k; i++) {
            last[i] -= P[i];
        }
        if (largest(2 * k, last) <= SWEEP_RTOL * relaxation * largest(2 * k, P)) {
            return true;
        }
    }
    return false;
}

/* Strongly coupled contacts can make the sweeps run in circles; shorter steps lead out. */
static bool sweep_contacts(int k, const double *W, const double *u, const double *friction,
                           const double *least, double *P, Scratch *scratch, Problem *problem) {
    size_t used = scratch->used;
    double *last = take(scratch, 2 * (size_t)k);
    bool settled = false;
    for (int i = 0; !settled && i < (int)(sizeof RELAXATIONS / sizeof *RELAXATIONS); i++) {
        settled = relaxed_sweeps(k, W, u, friction, least, RELAXATIONS[i], P, last);
    }
    scratch->used = used;
    return settled ||
           fail(problem,
                "several stops are hit at once with friction, and no impulses were found that "
                "satisfy Coulomb's law at all of them; reduce the friction of the stops, or move "
                "them apart");
}

/* The impulses R of restitution, at least s wanted, and the work of the normal ones. */
static bool rebound(int k, const double *W, const double *after, const double *friction,
                    const double *wanted, double s, double *R, double *gain, Scratch *scratch,
                    Problem *problem) {
    size_t used = scratch->used;
    double *least = take(scratch, (size_t)k);
    for (int i = 0; i < k; i++) {
        least[i] = s * wanted[i];
    }
    bool settled = sweep_contacts(k, W, after, friction, least, R, scratch, problem);
    double work = 0.0;
    for (int i = 0; i < k; i++) {
        work += R[i] * (2 * after[i] + dot(2 * k, W + i * 2 * k, R));
    }
    *gain = work / 2;
    scratch->used = used;
    return settled;
}

/* The rebound with the largest s whose work does not exceed what compression has left. */
static bool restitution_of_several(int k, const double *W, const double *after,
                                   const double *friction, const double *wanted, double lost,
                                   double *R, Scratch *scratch, Problem *problem) {
    double gain, low = 0.0, high = 1.0;
    if (!rebound(k, W, after, friction, wanted, 1.0, R, &gain, scratch, problem)) {
        return false;
    }
    if (gain <= lost) {
        return true;
    }
    while (gain > lost && high - low > REBOUND_RTOL) {
        double s = (low + high) / 2, trial;
        if (!rebound(k, W, after, friction, wanted, s, R, &trial, scratch, problem)) {
            return false;
        }
        low = trial <= lost ? s : low;
        high = trial <= lost ? high : s;
    }
    return rebound(k, W, after, friction, wanted, low, R, &gain, scratch, problem);
}

PRBM bool several(int k, const double *W, const double *u, const double *friction,
                  const double *restitution, double *P, Scratch *scratch, Problem *problem) {
    size_t used = scratch->used;
    double *after = take(scratch, 2 * (size_t)k), *R = take(scratch, 2 * (size_t)k);
    double *wanted = take(scratch, (size_t)k), lost = 0.0;
    zeros(k, wanted);
    bool settled = sweep_contacts(k, W, u, friction, wanted, P, scratch, problem);
    for (int i = 0; i < 2 * k; i++) {
        after[i] = u[i] + dot(2 * k, W + i * 2 * k, P);
    }
    for (int i = 0; i < k; i++) {
        lost -= P[i] * (u[i] + after[i]) / 2 * (restitution[i] * restitution[i]);
        wanted[i] = restitution[i] * P[i];
    }
    settled = settled && restitution_of_several(k, W, after, friction, wanted, lost, R, scratch,
                                                problem);
    for (int i = 0; settled && i < 2 * k; i++) {
        P[i] += R[i];
    }
    scratch->used = used;
    return settled;
}
