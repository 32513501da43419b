/* Rigid impacts in contact space: Newton's law without friction, Stronge's law with friction.
 *
 * Sources: as in the twin, mechanics/contact.py.
 */
#include <math.h>

#include "core/complementarity.h"
#include "core/constraints.h"
#include "core/contact.h"
#include "core/matrix.h"

PRBM void factored_response(const ScaledFactors *factors, int n, int k, const double *rows,
                            double *X, Scratch scratch) {
    double *right = take(&scratch, (size_t)factors->size);
    for (int j = 0; j < k; j++) {
        copy(n, rows + j * n, right);
        zeros(factors->size - n, right + n);
        solve_saddle(factors, right);
        for (int i = 0; i < n; i++) {
            X[i * k + j] = right[i];
        }
    }
}

PRBM bool response(int n, int r, int k, const double *M, const double *held, const double *rows,
                   double length, double *X, Scratch scratch, Problem *problem) {
    int size = n + r;
    ScaledFactors factors = take_factors(&scratch, size, take_matrix(&scratch, size, size));
    saddle(n, r, M, held, held, factors.lu);
    bool regular = factor_saddle(n, r, length, &factors, problem);
    if (regular) {
        factored_response(&factors, n, k, rows, X, scratch);
    }
    return regular;
}

PRBM double least_mobility(int n, const double *M, const double *row, double length) {
    double free = 0.0, heaviest = 0.0, round_off = ROW_RTOL * length;
    for (int j = 0; j < n; j++) {
        free += row[j] * row[j] / M[j * n + j];
        heaviest = greater(heaviest, M[j * n + j]);
    }
    return greater(SINGULAR_RTOL * free, round_off * round_off / heaviest);
}

PRBM void contact_mobility(int n, int k, const double *M, const double *rows, const double *X,
                           double length, double *W) {
    for (int a = 0; a < k; a++) {
        for (int b = 0; b < k; b++) {
            W[a * k + b] = 0.0;
            for (int j = 0; j < n; j++) {
                W[a * k + b] += rows[a * n + j] * X[j * k + b];
            }
        }
    }
    for (int a = 0; a < k; a++) {
        double least = least_mobility(n, M, rows + a * n, length);
        for (int b = 0; fabs(W[a * k + a]) <= least && b < k; b++) {
            W[a * k + b] = W[b * k + a] = 0.0;
        }
    }
}

/* --- without friction ------------------------------------------------------------------------- */

static bool closing_in(Problem *problem) {
    return fail(problem, "no impulses open all gaps: the walls close in on the mechanism; move "
                         "them apart, or slow them down");
}

/* Solve W P = -b for the impulses P of the stops whose indices are in members (size); all other
 * impulses are zero.  A stop with a negative impulse would pull: its impulse is set to zero, and it
 * is removed from members.  *pulling: whether a stop is removed. */
static bool least_norm_impulses(int k, int *size, int *members, const double *W, const double *b,
                           double *P, bool *pulling, Scratch scratch, Problem *problem) {
    int count = *size, pushing = 0;
    double *part = take_matrix(&scratch, count, count), *right = take(&scratch, (size_t)count);
    double *found = take(&scratch, (size_t)count);
    for (int i = 0; i < count; i++) {
        right[i] = -b[members[i]];
        for (int j = 0; j < count; j++) {
            part[i * count + j] = W[members[i] * k + members[j]];
        }
    }
    bool solved = least_squares(count, count, part, right, IMPULSE_RANK_RTOL, found, scratch,
                                problem);
    zeros(k, P);
    for (int i = 0; i < count; i++) {
        if (!(found[i] < 0.0)) {
            P[members[i]] = found[i];
            members[pushing++] = members[i];
        }
    }
    *size = pushing;
    *pulling = pushing < count;
    return solved;
}

/* Distribute the impulses P (k,) as evenly as possible between the stops that open at the rate of
 * restitution.  P does not change if the result would violate the laws. */
static bool share_evenly(int k, const double *W, const double *b, double tolerance, double *P,
                         Scratch scratch, Problem *problem) {
    double *shared = take(&scratch, (size_t)k);
    int *members = take_integers(&scratch, k), size = 0;
    for (int i = 0; i < k; i++) {
        if (fabs(dot(k, W + i * k, P) + b[i]) <= tolerance) {
            members[size++] = i;
        }
    }
    zeros(k, shared);
    bool pulling = true, solved = true;
    while (solved && pulling && size > 0) {
        solved = least_norm_impulses(k, &size, members, W, b, shared, &pulling, scratch, problem);
    }
    if (solved && violation(k, 0, W, b, shared, NULL) <= tolerance) {
        copy(k, shared, P);
    }
    return solved;
}

PRBM bool newton(int k, const double *W, const double *u, const double *restitution, double speed,
                 double *P, Scratch scratch, Problem *problem) {
    double *b = take(&scratch, (size_t)k), *least = take(&scratch, (size_t)k);
    double tolerance = COMPLEMENTARITY_RTOL * greater(largest(k, u), speed);
    zeros(k, least);
    for (int i = 0; i < k; i++) {
        b[i] = (1.0 + restitution[i]) * u[i];
    }
    bool solved = impulses(k, 0, W, b, NULL, least, tolerance, P, scratch);
    solved = solved ? share_evenly(k, W, b, tolerance, P, scratch, problem) : closing_in(problem);
    return solved;
}

/* --- one hit with friction -------------------------------------------------------------------- */

static double sign_of(double x) {
    return x < 0.0 ? -1.0 : 1.0;
}

/* Return the normal impulse that does the rest of the work of restitution, work_left.  If the gap
 * stops opening before, return the impulse at which this happens. */
static double impulse_to_end(double u_n, double du_n, double work_left) {
    double root = u_n * u_n + 2.0 * du_n * work_left;
    if (root < 0.0) {
        return -u_n / du_n;
    }
    double total = u_n + square_root(root);
    return total > 0.0 ? 2.0 * work_left / total : HUGE_VAL;
}

/* Return dP_t/dP_n by Coulomb's law for a contact that slips, sticks, or begins to slip. */
static double friction_ratio(double nt, double tt, double u_t, double friction) {
    if (u_t != 0.0) {
        return -friction * sign_of(u_t);
    }
    if (fabs(nt) <= friction * tt) {
        return tt > 0.0 ? -nt / tt : 0.0;
    }
    return -friction * sign_of(nt);
}

/* State of an impact: inverse masses nn, nt, tt, rates u, impulses p, the ratio dP_t/dP_n, and the
 * derivatives du_n and du_t of the rates by the normal impulse. */
typedef struct {
    double nn, nt, tt, friction;
    double u_n, u_t, p_n, p_t;
    double ratio, du_n, du_t;
} Hit;

/* Set the ratio of the impulses and the derivatives of the rates, which are constant until sliding
 * stops.  Return the normal impulse that stops sliding; HUGE_VAL if none does. */
static double impulse_to_stick(Hit *hit) {
    hit->ratio = friction_ratio(hit->nt, hit->tt, hit->u_t, hit->friction);
    hit->du_n = hit->nn + hit->ratio * hit->nt;
    hit->du_t = hit->nt + hit->ratio * hit->tt;
    return hit->u_t * hit->du_t < 0.0 ? -hit->u_t / hit->du_t : HUGE_VAL;
}

/* Return the work of an increment of the normal impulse. */
static double work_of(const Hit *hit, double step) {
    return hit->u_n * step + hit->du_n * (step * step) / 2;
}

/* Add an increment of the normal impulse, with its friction. */
static void receive(Hit *hit, double step) {
    hit->p_n += step;
    hit->p_t += hit->ratio * step;
}

/* Apply the impulses of compression; return the energy that they take. */
static double compress(Hit *hit) {
    double work = 0.0;
    while (hit->u_n < 0.0) {
        double to_stick = impulse_to_stick(hit);
        double to_open = hit->du_n > WEDGED_RTOL * hit->nn ? -hit->u_n / hit->du_n : HUGE_VAL;
        double step = lesser(to_stick, to_open);
        if (step == HUGE_VAL) {
            break; /* No impulse opens the gap; stronge checks the remaining rate. */
        }
        work -= work_of(hit, step);
        receive(hit, step);
        hit->u_n = step == to_open ? 0.0 : hit->u_n + hit->du_n * step;
        hit->u_t = step == to_stick ? 0.0 : hit->u_t + hit->du_t * step;
    }
    return work;
}

/* Apply the impulses of restitution that do the work work_left. */
static void restore(Hit *hit, double work_left) {
    while (work_left > 0.0) {
        double to_stick = impulse_to_stick(hit);
        double du_n = fabs(hit->du_n) > WEDGED_RTOL * hit->nn ? hit->du_n : 0.0;
        double to_end = impulse_to_end(hit->u_n, du_n, work_left);
        double step = lesser(to_stick, to_end);
        if (step == HUGE_VAL) {
            break;
        }
        work_left -= work_of(hit, step);
        receive(hit, step);
        if (step == to_end) {
            break;
        }
        hit->u_n = greater(0.0, hit->u_n + hit->du_n * step);
        hit->u_t = 0.0;
    }
}

PRBM bool stronge(const double *W, const double *u, double friction, double restitution,
                  double speed, double *P_n, double *P_t, Problem *problem) {
    Hit hit = {.nn = W[0], .nt = W[1], .tt = W[3], .friction = friction, .u_n = u[0], .u_t = u[1]};
    /* Magnitude of the sliding speed that corresponds to the closing rate. */
    double slide = hit.nn > 0.0 ? fabs(hit.u_n) * square_root(hit.tt / hit.nn) : 0.0;
    double small_n = ZERO_SPEED_RTOL * fabs(hit.u_n);
    double small_t = ZERO_SPEED_RTOL * (fabs(hit.u_t) + slide);
    double work = compress(&hit);
    if (!(hit.u_n >= -greater(small_n, COMPLEMENTARITY_RTOL * speed))) {
        return fail(problem, "the wall pushes the mechanism in a direction that friction locks; "
                             "reduce the friction of the stop, or the velocity of the wall");
    }
    /* With one degree of freedom both rates become zero at once, up to round-off. */
    hit.u_n = hit.u_n > small_n ? hit.u_n : 0.0;
    hit.u_t = fabs(hit.u_t) > small_t ? hit.u_t : 0.0;
    restore(&hit, restitution * restitution * work);
    *P_n = hit.p_n;
    *P_t = hit.p_t;
    return true;
}

/* --- several hits with friction --------------------------------------------------------------- */

/* Upper limits of the work in restitution: of the normal impulses, and of all impulses. */
typedef struct {
    double normal, all;
} WorkLimits;

/* Compute impulses R of restitution, with normal impulses of at least s times wanted.  *allowed:
 * whether their work is within the limits.  Return false if there are no such impulses. */
static bool rebound(int k, const double *W, const double *after, const double *friction,
                    const double *wanted, double s, const WorkLimits *limits, double tolerance,
                    double *R, bool *allowed, Scratch scratch) {
    double *least = take(&scratch, (size_t)k);
    for (int i = 0; i < k; i++) {
        least[i] = s * wanted[i];
    }
    bool solved = impulses(k, k, W, after, friction, least, tolerance, R, scratch);
    double normal = 0.0, all = 0.0;
    for (int i = 0; solved && i < 2 * k; i++) {
        double work = R[i] * (2 * after[i] + dot(2 * k, W + i * 2 * k, R)) / 2;
        normal += i < k ? work : 0.0;
        all += work;
    }
    *allowed = normal <= limits->normal && all <= limits->all;
    return solved;
}

/* Compute the impulses R of restitution with the largest s in [0, 1] whose work is within the
 * limits.  Return false if there are no impulses for one of the s that are tried. */
static bool restitution_of_several(int k, const double *W, const double *after,
                                   const double *friction, const double *wanted,
                                   const WorkLimits *limits, double tolerance, double *R,
                                   Scratch scratch) {
    double low = 0.0, high = 1.0;
    bool allowed, trial;
    if (!rebound(k, W, after, friction, wanted, 1.0, limits, tolerance, R, &allowed, scratch)) {
        return false;
    }
    if (allowed) {
        return true;
    }
    while (high - low > REBOUND_RTOL) {
        double s = (low + high) / 2;
        if (!rebound(k, W, after, friction, wanted, s, limits, tolerance, R, &trial, scratch)) {
            return false;
        }
        low = trial ? s : low;
        high = trial ? high : s;
    }
    return rebound(k, W, after, friction, wanted, low, limits, tolerance, R, &trial, scratch);
}

static bool friction_locks(Problem *problem) {
    return fail(problem, "the walls push the mechanism in directions that friction locks; reduce "
                         "the friction of the stops, or the velocities of the walls");
}

/* Report why no impulses of compression exist: friction is the cause if impulses without it would
 * open all gaps. */
static bool unsolved_compression(int k, const double *W, const double *u, double tolerance,
                                 Scratch scratch, Problem *problem) {
    double *normals = take_matrix(&scratch, k, k), *least = take(&scratch, (size_t)k);
    double *P = take(&scratch, (size_t)k);
    zeros(k, least);
    for (int i = 0; i < k; i++) {
        copy(k, W + i * 2 * k, normals + i * k);
    }
    bool opens = impulses(k, 0, normals, u, NULL, least, tolerance, P, scratch);
    return opens ? friction_locks(problem) : closing_in(problem);
}

PRBM bool several(int k, const double *W, const double *u, const double *friction,
                  const double *restitution, double speed, double *P, Scratch scratch,
                  Problem *problem) {
    double *after = take(&scratch, 2 * (size_t)k), *R = take(&scratch, 2 * (size_t)k);
    double *wanted = take(&scratch, (size_t)k);
    WorkLimits limits = {0.0, 0.0};
    double tolerance = COMPLEMENTARITY_RTOL * greater(largest(2 * k, u), speed);
    zeros(k, wanted);
    if (!impulses(k, k, W, u, friction, wanted, tolerance, P, scratch)) {
        return unsolved_compression(k, W, u, tolerance, scratch, problem);
    }
    for (int i = 0; i < 2 * k; i++) {
        after[i] = u[i] + dot(2 * k, W + i * 2 * k, P);
    }
    for (int i = 0; i < k; i++) {
        limits.normal -= P[i] * (u[i] + after[i]) / 2 * (restitution[i] * restitution[i]);
        wanted[i] = restitution[i] * P[i];
    }
    for (int i = 0; i < 2 * k; i++) {
        limits.all -= P[i] * (u[i] + after[i]) / 2;
    }
    limits.all += COMPLEMENTARITY_RTOL * fabs(dot(2 * k, P, u));
    bool solved = restitution_of_several(k, W, after, friction, wanted, &limits, tolerance, R,
                                          scratch);
    for (int i = 0; solved && i < 2 * k; i++) {
        P[i] += R[i];
    }
    return solved || friction_locks(problem);
}
