/* Small vibrations about a static shape, and the fundamental mode at an impact: the twin of
 * mechanics/modal.py. */
#include <math.h>

#include "core/constraints.h"
#include "core/elements.h"
#include "core/forces.h"
#include "core/matrix.h"
#include "core/modal.h"
#include "core/positions.h"

#define FULL_TURN 6.283185307179586 /* rad */

/* Compute c = a^T b a for a (n, k), b (n, n). */
static void congruent(int n, int k, const double *a, const double *b, double *c, Scratch scratch) {
    double *ba = take(&scratch, (size_t)n);
    for (int j = 0; j < k; j++) {
        for (int i = 0; i < n; i++) {
            ba[i] = 0.0;
            for (int l = 0; l < n; l++) {
                ba[i] += b[i * n + l] * a[l * k + j];
            }
        }
        for (int i = 0; i < k; i++) {
            c[i * k + j] = 0.0;
            for (int l = 0; l < n; l++) {
                c[i * k + j] += a[l * k + i] * ba[l];
            }
        }
    }
}

/* Compute A := L^-1 A L^-T for symmetric A; column (n,) is work space. */
static void divide_twice(int n, const double *L, double *A, double *column) {
    for (int i = 0; i < n; i++) {
        forward(n, L, A + i * n); /* Row i is L^-1 A e_i. */
    }
    for (int j = 0; j < n; j++) {
        for (int i = 0; i < n; i++) {
            column[i] = A[i * n + j];
        }
        forward(n, L, column);
        for (int i = 0; i < n; i++) {
            A[i * n + j] = column[i];
        }
    }
    for (int i = 0; i < n; i++) {
        for (int j = 0; j < i; j++) {
            A[i * n + j] = A[j * n + i] = 0.5 * (A[i * n + j] + A[j * n + i]);
        }
    }
}

/* Solve K y = w M y with y^T M y = 1.  The eigenvalues w are in ascending order, the y are the
 * columns of Y.  K and M are overwritten. */
static bool generalised_eigen(int n, double *K, double *M, double *w, double *Y, Scratch scratch,
                              Problem *problem) {
    double *column = take(&scratch, (size_t)n);
    if (!cholesky(n, M)) {
        return fail(problem, "the modes cannot be computed: a part that can move has no mass");
    }
    divide_twice(n, M, K, column);
    if (!symmetric_eigen(n, K, w, Y, problem)) {
        return false;
    }
    for (int j = 0; j < n; j++) {
        for (int i = 0; i < n; i++) {
            column[i] = Y[i * n + j];
        }
        backward(n, M, column);
        for (int i = 0; i < n; i++) {
            Y[i * n + j] = column[i];
        }
    }
    return true;
}

/* Set the row w (d,) of the loads of gravity, with columns for stretches. */
static void gravity_row(const System *system, Complex *w) {
    field_row(system->d, system->S, system->gravity, w);
    repeat_columns(system, 1, w, w);
}

PRBM int mode_count(const System *system) {
    return system->n - system->r - system->placed_count;
}

/* Compute a basis Z (n, k) of the motions that the loops allow, without those of free bodies.  It is orthonormal in coordinates of
 * unit inertia, so that it does not depend on how the inertias differ. */
static void tangent_space(const System *system, const Complex *e, const double *M, double *Z,
                          Scratch scratch) {
    int n = system->n, k = mode_count(system), r = n - k;
    double *rows = take_matrix(&scratch, r, n);
    Rows loops = loop_rows(system);
    jacobian(&loops, e, rows);
    zeros(system->placed_count * n, rows + system->r * n);
    for (int i = 0; i < system->placed_count; i++) {
        rows[(system->r + i) * n + system->placed[i]] = 1.0;
    }
    for (int j = 0; j < n; j++) {
        double scale = 1.0 / square_root(M[j * n + j]);
        for (int i = 0; i < r; i++) {
            rows[i * n + j] *= scale;
        }
    }
    null_space(r, n, rows, Z, scratch);
    for (int j = 0; j < n; j++) {
        double scale = 1.0 / square_root(M[j * n + j]);
        for (int i = 0; i < k; i++) {
            Z[j * k + i] *= scale;
        }
    }
}

/* Solve K_t phi = omega^2 M phi on the tangent space of the loops for the frequencies [Hz] (k,) and
 * the modes phi (n, k).  K_t includes the loads of the multipliers lam (r,) along the rows, which
 * may be one more than the loops.  e and M: the directions and the mass matrix. */
static bool modes_about(const Rows *rows, const Complex *e, const double *M, const double *lam,
                        double *frequency, double *phi, Scratch scratch, Problem *problem) {
    const System *system = rows->system;
    int n = system->n, k = mode_count(system);
    Complex *w = take_complex(&scratch, 1, system->d);
    double *K_t = take_matrix(&scratch, n, n), *Z = take_matrix(&scratch, n, k);
    double *K_z = take_matrix(&scratch, k, k), *M_z = take_matrix(&scratch, k, k);
    double *reduced = take_matrix(&scratch, k, k);
    gravity_row(system, w);
    tangent_stiffness(rows, 1.0, w, lam, e, K_t, scratch);
    tangent_space(system, e, M, Z, scratch);
    congruent(n, k, Z, K_t, K_z, scratch);
    congruent(n, k, Z, M, M_z, scratch);
    bool found = k == 0 || generalised_eigen(k, K_z, M_z, frequency, reduced, scratch, problem);
    for (int j = 0; found && j < k; j++) {
        double omega2 = frequency[j];
        frequency[j] = (omega2 < 0.0 ? -1.0 : 1.0) * square_root(fabs(omega2)) / FULL_TURN;
        for (int i = 0; i < n; i++) {
            phi[i * k + j] = 0.0;
            for (int l = 0; l < k; l++) {
                phi[i * k + j] += Z[i * k + l] * reduced[l * k + j];
            }
        }
    }
    return found;
}

/* The holding force of the shape is a dead load: its direction and size are constant. */
PRBM bool modes(const System *system, const Equilibrium *shape, double *frequency, double *phi,
                Scratch scratch, Problem *problem) {
    int n = system->n, r = system->r;
    Complex *B = take_complex(&scratch, r + 1, system->d);
    Complex *e = take_complex(&scratch, 1, system->d);
    double *lam = take(&scratch, (size_t)r + 1), *M = take_matrix(&scratch, n, n);
    directions(system, shape->q, e);
    mass_matrix(system, e, M, scratch);
    stack_holding_at(system, shape->q, B, lam);
    copy(r, shape->lam, lam);
    lam[r] = shape->force;
    r += shape->force != 0.0;
    Rows rows = rows_beside_loops(system, r, B, NULL, &scratch);
    return modes_about(&rows, e, M, lam, frequency, phi, scratch, problem);
}

PRBM int unstable_directions(int k, const double *frequency, const double *along) {
    double least = ZERO_FREQUENCY_RTOL * largest(k, frequency), response = 0.0;
    int count = 0;
    bool yields = false;
    for (int i = 0; i < k; i++) {
        double f = frequency[i], g = along != NULL ? along[i] : 0.0;
        count += f < -least;
        if (fabs(f) <= least) {
            yields = yields || g != 0.0;
        } else {
            response += (f < 0.0 ? -1.0 : 1.0) * (g * g) / (f * f);
        }
    }
    return count - (count > 0 && !yields && response < 0.0);
}

PRBM void moved_by(const System *system, const double *q, const double *phi, double *moved,
                   Scratch scratch) {
    int n = system->n, r = system->r, k = mode_count(system);
    Complex *B = take_complex(&scratch, r + 1, system->d);
    Complex *e = take_complex(&scratch, 1, system->d);
    double *c = take(&scratch, (size_t)r + 1), *row = take(&scratch, (size_t)n);
    directions(system, q, e);
    stack_holding_at(system, q, B, c);
    Rows held = plain_rows(system, r + 1, B, c);
    row_jacobian(&held, r, e, row);
    for (int i = 0; i < k; i++) {
        double turn = moved[i] = 0.0;
        for (int j = 0; j < n; j++) {
            moved[i] += row[j] * phi[j * k + i];
            turn = greater(turn, fabs(phi[j * k + i]));
        }
        if (!(fabs(moved[i]) > RELEASE_MODE_RTOL * system->length * turn)) {
            moved[i] = 0.0;
        }
    }
}

/* Return the index of the fundamental mode: if bodies that only springs connect to the ground have
 * motions that deform no element, it is the first one that round-off does not make. */
static int first_acting(const System *system, const double *frequencies) {
    int k = mode_count(system), i = 0;
    double least = ZERO_FREQUENCY_RTOL * largest(k, frequencies);
    if (system->placed_count == system->mechanism->floating_count) {
        return 0;
    }
    while (i < k && fabs(frequencies[i]) <= least) {
        i++;
    }
    return i < k ? i : 0;
}

/* Compute the frequencies (k,) about the shape under gravity, which may not be balanced. */
static bool resting_frequencies(const System *system, double *frequencies, bool *balanced,
                                Scratch scratch, Problem *problem) {
    int n = system->n, r = system->r;
    Equilibrium shape = {take(&scratch, (size_t)n), take(&scratch, (size_t)r), 0.0};
    double *phi = take_matrix(&scratch, n, mode_count(system));
    return resting(system, &shape, balanced, scratch, problem) &&
           modes(system, &shape, frequencies, phi, scratch, problem);
}

/* The frequency is 0 if the equilibrium under gravity is unstable. */
PRBM bool fundamental_frequency(const System *system, double *frequency, Scratch scratch,
                                Problem *problem) {
    int k = mode_count(system);
    double *frequencies = take(&scratch, (size_t)k);
    bool balanced, found = resting_frequencies(system, frequencies, &balanced, scratch, problem);
    if (found) {
        double lowest = balanced && k > 0 ? frequencies[first_acting(system, frequencies)] : 0.0;
        *frequency = lowest > ZERO_FREQUENCY_RTOL * largest(k, frequencies) ? lowest : 0.0;
    }
    return found;
}

/* The scale of velocities is the rate of the most unstable mode; otherwise, if a motion deforms no
 * spring and lifts no weight, that of a fall or of the motion at the release, or the lowest angular
 * frequency above 0.  The scale of times is the same, or that frequency if it is larger. */
PRBM bool slow_rates(const System *system, double *rate, double *fast, Scratch scratch,
                     Problem *problem) {
    int k = mode_count(system), j = 0;
    double *frequencies = take(&scratch, (size_t)k);
    bool balanced, found = resting_frequencies(system, frequencies, &balanced, scratch, problem);
    if (found) {
        double least = ZERO_FREQUENCY_RTOL * largest(k, frequencies);
        double speed = start_speed(system, scratch);
        double fall = square_root(modulus(system->gravity) / system->length);
        while (j < k && !(frequencies[j] > least)) {
            j++;
        }
        double lowest = j < k ? FULL_TURN * frequencies[j] : 0.0;
        *rate = greater(fall, speed / system->length);
        *rate = *rate > 0.0 ? *rate : lowest > 0.0 ? lowest : SPRINGLESS_RATE;
        *fast = greater(*rate, lowest);
        if (k > 0 && frequencies[0] < -least) {
            *rate = *fast = -FULL_TURN * frequencies[0];
        }
    }
    return found;
}

/* Compute the multipliers lam of a shape held at rest by a force on the released body.  They solve
 * [M, rows^T; rows, 0] (a, -lam) = (Q, 0) for the loads Q, so that the accelerations a that remain
 * are as small as possible. */
static bool resting_multipliers(const Rows *held, const double *q, const Complex *e,
                                const double *M, double *lam, Scratch scratch, Problem *problem) {
    const System *system = held->system;
    int n = system->n, r = held->count, size = n + r;
    Complex *w = take_complex(&scratch, 1, system->d);
    double *rows = take_matrix(&scratch, r, n), *kkt = take_matrix(&scratch, size, size);
    double *right = take(&scratch, (size_t)size);
    jacobian(held, e, rows);
    gravity_row(system, w);
    element_forces(system, q, e, 1.0, right, scratch);
    add_loads(system, w, e, right);
    zeros(r, right + n);
    saddle(n, r, M, rows, rows, kkt);
    bool found = solve(n, r, kkt, right, system->length, scratch, problem);
    for (int i = 0; i < r; i++) {
        lam[i] = -right[n + i];
    }
    return found;
}

PRBM bool fundamental_at(const System *system, const double *q, double *phi, double *M,
                         Scratch scratch, Problem *problem) {
    int n = system->n, r = system->r + 1, k = mode_count(system);
    Complex *B = take_complex(&scratch, r, system->d);
    double *lam = take(&scratch, (size_t)r), *frequency = take(&scratch, (size_t)k);
    double *all = take_matrix(&scratch, n, k);
    Complex *e = take_complex(&scratch, 1, system->d);
    directions(system, q, e);
    mass_matrix(system, e, M, scratch);
    stack_holding_at(system, q, B, lam);
    Rows held = rows_beside_loops(system, r, B, NULL, &scratch);
    bool found = resting_multipliers(&held, q, e, M, lam, scratch, problem) &&
                 modes_about(&held, e, M, lam, frequency, all, scratch, problem);
    for (int i = 0; found && i < n; i++) {
        phi[i] = k > 0 ? all[i * k + first_acting(system, frequency)] : 0.0;
    }
    return found;
}

PRBM double simulated_restitution(int n, const double *phi, const double *M, const double *before,
                                  const double *after) {
    double arriving = 0.0, leaving = 0.0, size = 0.0;
    for (int i = 0; i < n; i++) {
        double momentum = dot(n, M + i * n, phi);
        arriving += momentum * before[i];
        leaving += momentum * after[i];
        size += fabs(momentum) * (fabs(before[i]) + fabs(after[i]));
    }
    return fabs(arriving) <= ZERO_MODE_RTOL * size ? 0.0 : -leaving / arriving;
}
