/* Forces of all contacts at rest together: the twin of hybrid/rest.py. */
#include <math.h>

#include "core/friction.h"
#include "core/gaps.h"
#include "core/vectors.h"
#include "hybrid/access.h"
#include "hybrid/configuration.h"
#include "hybrid/rest.h"

/* The rows of the gaps and of the slides, and the loads of unit forces on them (pushes).  A row and
 * its load differ if a stop slides: the normal force then acts together with its friction. */
static void rest_rows(const Simulation *sim, const RestContacts *rest, const Complex *e,
                      double *rows, double *pushes, Scratch scratch) {
    const System *system = system_of(sim);
    Rows gaps = gap_rows(system);
    int n = system->n, k = rest->stop_count;
    double *slide = take(&scratch, (size_t)n);
    for (int a = 0; a < k; a++) {
        int i = rest->stops[a];
        row_jacobian(&gaps, i, e, rows + a * n);
        copy(n, rows + a * n, pushes + a * n);
        if (rest->slips[a] != 0) {
            tangential_row(system, i, e, slide);
            add_scaled(n, -sim->trial.equations.stop_friction[i] * rest->slips[a], slide,
                       pushes + a * n);
        }
    }
    for (int j = 0; j < rest->count; j++) {
        tangential_row(system, rest->contacts[j], e, rows + (k + j) * n);
        copy(n, rows + (k + j) * n, pushes + (k + j) * n);
    }
}

/* Compute the accelerations u of gaps and sliding without contact forces. */
static void rest_accelerations(const Simulation *sim, const RestContacts *rest, const Complex *e,
                               const double *v, const double *rows, double *u) {
    const System *system = system_of(sim);
    const Evaluation *found = &sim->trial.evaluation;
    const double *a = found->a;
    int n = system->n, k = rest->stop_count;
    for (int i = 0; i < k; i++) {
        u[i] = gap_acceleration(&sim->trial.equations, rest->stops[i], sim->state.front_time, e, v,
                                found);
    }
    for (int i = k; i < k + rest->count; i++) {
        u[i] = dot(n, rows + i * n, a) - tangential_convective(system, rest->contacts[i - k], e, v);
    }
}

/* Set the laws of friction of the contacts at rest.  The normal forces of guides are multipliers of the
 * trial equations, whose changes by unit forces are multipliers (size, r). */
static CoulombLaws rest_laws(const Simulation *sim, const RestContacts *rest, const Complex *e,
                             const double *multipliers, Scratch *scratch) {
    const Equations *eq = &sim->trial.equations;
    const Evaluation *found = &sim->trial.evaluation;
    int k = rest->stop_count, m = rest->count, size = k + m, r = eq->r, sides = 0;
    double *friction = take(scratch, (size_t)m), *fixed = take(scratch, (size_t)m);
    double *L = take_matrix(scratch, m, size), *b = take(scratch, (size_t)m);
    int *normal = take_integers(scratch, m);
    for (int j = 0; j < m; j++) {
        int contact = rest->contacts[j];
        normal[j] = -1;
        for (int a = 0; a < k; a++) {
            normal[j] = rest->stops[a] == contact ? a : normal[j];
        }
        if (is_guide(eq->system, contact)) {
            int row = normal_row(eq, contact);
            normal[j] = k + sides;
            b[sides] = found->lam[row];
            for (int a = 0; a < size; a++) {
                L[sides * size + a] = multipliers[a * r + row];
            }
            sides++;
        }
        friction[j] = normal[j] < 0 ? 0.0 : friction_coefficient(eq, contact);
        fixed[j] = normal[j] < 0 ? friction_limit(eq, e, found, contact) : 0.0;
    }
    return (CoulombLaws){friction, fixed, normal, sides, L, b};
}

/* Compute the changes X (n, size) of the accelerations, and multipliers (size, r), by unit forces. */
static void unit_responses(const Simulation *sim, int size, const double *pushes, double *X,
                           double *multipliers, Scratch scratch) {
    const Evaluation *found = &sim->trial.evaluation;
    const System *system = system_of(sim);
    int n = system->n, r = sim->trial.equations.r;
    double *x = take(&scratch, (size_t)system->even);
    zeros(size * r, multipliers);
    for (int a = 0; a < size; a++) {
        pad(n, pushes + a * n, x);
        solve_again(&found->factors, x, multipliers + a * r);
        for (int i = 0; i < n; i++) {
            X[i * size + a] = x[i];
        }
    }
}

/* The acceleration of gap i by its normal force, alone or together with its friction: the larger
 * one, in magnitude.  A wedge moves a gap mainly by its friction. */
static double pressing(int k, int m, int i, const double *W, const double *P, const int *normal) {
    int size = k + m;
    double alone = P[i] * W[i * size + i], together = alone;
    for (int j = 0; j < m; j++) {
        together += normal[j] == i ? W[i * size + k + j] * P[k + j] : 0.0;
    }
    return greater(alone, fabs(together));
}

/* Return the violation of the laws that is accepted: half of the acceleration that is round-off in
 * the choice of modes, and the round-off of the forces of friction.  These do not vanish with the
 * accelerations u, as in a mechanism at rest, where the limits of friction may still be large. */
static double accepted_violation(const Simulation *sim, int k, int m, const double *W,
                                 const double *u, const CoulombLaws *laws, const double *none) {
    int size = k + m;
    double pull = 0.0;
    for (int j = 0; j < m; j++) {
        pull = greater(pull, limit_of(k, size, laws, j, none) * W[(k + j) * size + k + j]);
    }
    double laws_of = greater(COMPLEMENTARITY_RTOL * largest(size, u), LIMIT_RTOL * pull);
    return greater(laws_of, zero_acceleration(&sim->configuration) / 2.0);
}

/* Set the forces of the contacts from the solution P.  Slides up to the tolerance are round-off of the
 * forces at the contacts. */
static void set_forces(int k, int m, const double *W, const double *u, const CoulombLaws *laws,
                       double tolerance, const double *P, RestForces *found) {
    int size = k + m;
    for (int i = 0; i < k; i++) {
        found->normal[i] = P[i] > 0.0 ? pressing(k, m, i, W, P, laws->normal) : 0.0;
    }
    for (int j = 0; j < m; j++) {
        int i = k + j, g = laws->normal[j] - k;
        double slide = dot(size, W + i * size, P) + u[i];
        found->friction[j] = P[i];
        found->limit[j] = limit_of(k, size, laws, j, P);
        found->pushing[j] = g < 0 ? 0.0 : laws->b[g] + dot(size, laws->L + g * size, P);
        found->mobility[j] = W[i * size + i];
        found->slide[j] = fabs(slide) <= tolerance ? 0.0 : slide;
    }
}

PRBM bool rest_forces(Simulation *sim, const double *q, const double *v,
                      const RestContacts *rest, RestForces *found, Problem *problem) {
    const System *system = system_of(sim);
    int n = system->n, k = rest->stop_count, m = rest->count, size = k + m;
    double *W = found->W = sim->trial.mobility;
    Scratch scratch = sim->scratch;
    ContactProblem *at = contact_problem_at(sim, q, scratch);
    double *rows = take_matrix(&scratch, size, n);
    double *pushes = take_matrix(&scratch, size, n);
    double *X = take_matrix(&scratch, n, size);
    double *multipliers = take_matrix(&scratch, size, sim->trial.equations.r);
    double *u = take(&scratch, (size_t)size), *P = take(&scratch, (size_t)size);
    bool ok = evaluate_equations(&sim->trial.equations, sim->state.front_time, q, v,
                                 extra_states(sim, sim->state.front), NULL,
                                 &sim->trial.evaluation, problem);
    rest_rows(sim, rest, at->e, rows, pushes, scratch);
    found->solved = false;
    if (ok) {
        unit_responses(sim, size, pushes, X, multipliers, scratch);
        contact_mobility(n, size, at->M, rows, X, system->length, W);
        rest_accelerations(sim, rest, at->e, v, rows, u);
        CoulombLaws laws = rest_laws(sim, rest, at->e, multipliers, &scratch);
        zeros(size, P);
        double tolerance = accepted_violation(sim, k, m, W, u, &laws, P);
        found->solved = coulomb(k, m, W, u, &laws, tolerance, P, scratch);
        if (found->solved) {
            set_forces(k, m, W, u, &laws, tolerance, P, found);
        }
    }
    return ok;
}

/* --- contacts that stick ---------------------------------------------------------------------- */

PRBM bool at_limit(const RestForces *found, int j, double zero) {
    return fabs(found->friction[j]) >= found->limit[j] - zero / found->mobility[j];
}

/* Exchange force and acceleration p as given and unknown; twice is the identity. */
static void sweep(int size, double *A, int p) {
    double pivot = A[p * size + p];
    for (int i = 0; i < size; i++) {
        double factor = A[i * size + p] / pivot;
        for (int j = 0; i != p && j < size; j++) {
            A[i * size + j] -= j == p ? 0.0 : factor * A[p * size + j];
        }
    }
    for (int i = 0; i < size; i++) {
        A[i * size + p] = i == p ? 1.0 / pivot : -A[i * size + p] / pivot;
        A[p * size + i] = i == p ? 1.0 / pivot : A[p * size + i] / pivot;
    }
}

/* Pass on the force of contact j to sticking contacts, until it is zero or one is at its limit.
 * Return that contact, or -1.  shares[i * stride]: the force at contact i by a unit force at j. */
static int pass_on(int m, const double *shares, int stride, RestForces *found, int j,
                   const bool *sticks) {
    int full = -1;
    double part = 1.0;
    for (int i = 0; i < m; i++) {
        double grows = shares[i * stride] * found->friction[j];
        if (sticks[i] && grows != 0.0) {
            double force = grows > 0.0 ? found->friction[i] : -found->friction[i];
            double room = greater(found->limit[i] - force, 0.0) / fabs(grows);
            full = room < part ? i : full;
            part = lesser(room, part);
        }
    }
    double passed = part * found->friction[j];
    for (int i = 0; i < m; i++) {
        found->friction[i] += sticks[i] ? shares[i * stride] * passed : 0.0;
    }
    found->friction[j] -= passed;
    return full;
}

PRBM void choose_sticking(const RestContacts *rest, RestForces *found, const bool *holds, int count,
                          const int *candidates, const bool *leaves, double zero, bool *sticks,
                          Scratch scratch) {
    int k = rest->stop_count, m = rest->count, size = k + m;
    double *A = take_matrix(&scratch, size, size);
    bool limited[CONTACTS_MAX];
    copy(size * size, found->W, A);
    for (int i = 0; i < k; i++) {
        if (holds[i]) {
            sweep(size, A, i);
        }
    }
    for (int j = 0; j < m; j++) {
        limited[j] = at_limit(found, j, zero);
        sticks[j] = false;
    }
    for (int c = 0; c < count; c++) {
        int j = candidates[c], own = k + j;
        if (A[own * size + own] * found->limit[j] > zero) {
            sweep(size, A, own);
            sticks[j] = !(limited[j] && leaves[j]);
        } else if (!limited[j]) {
            int full = pass_on(m, A + k * size + own, size, found, j, sticks);
            if (full >= 0) {
                sweep(size, A, k + full);
                sweep(size, A, own);
                sticks[full] = false;
                sticks[j] = true;
            }
        }
    }
}
