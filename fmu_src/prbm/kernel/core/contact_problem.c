/* What all contacts of a mechanism share at one position: the twin of mechanics/contact_problem.py. */
#include <string.h>

#include "core/contact.h"
#include "core/contact_problem.h"
#include "core/matrix.h"

PRBM void contact_problem_place(ContactProblem *at, const System *system, Memory *memory) {
    size_t n = (size_t)system->n, r = (size_t)system->r, size = n + r;
    at->system = system;
    at->q = place(memory, n, sizeof(double));
    at->e = place(memory, (size_t)system->d, sizeof(Complex));
    at->M = place(memory, n * n, sizeof(double));
    at->loops = place(memory, r * n, sizeof(double));
    at->factors.size = (int)size;
    at->factors.lu = place(memory, size * size, sizeof(double));
    at->factors.scale = place(memory, size, sizeof(double));
    at->factors.pivots = place(memory, size, sizeof(int));
}

PRBM void set_position(ContactProblem *at, const double *q, Scratch scratch) {
    const System *system = at->system;
    size_t bytes = (size_t)system->n * sizeof *q;
    if (at->assembly == system->assembly && memcmp(at->q, q, bytes) == 0) {
        return;
    }
    Rows loops = loop_rows(system);
    memmove(at->q, q, bytes);
    directions(system, at->q, at->e);
    mass_matrix(system, at->e, at->M, scratch);
    jacobian(&loops, at->e, at->loops);
    at->assembly = system->assembly;
    at->factored = false;
}

PRBM bool factor_contacts(ContactProblem *at, Problem *problem) {
    const System *system = at->system;
    if (!at->factored) {
        saddle(system->n, system->r, at->M, at->loops, at->loops, at->factors.lu);
        at->factored =
            factor_saddle(system->n, system->r, system->length, &at->factors, problem);
    }
    return at->factored;
}

PRBM bool loop_response(ContactProblem *at, int k, const double *rows, double *X,
                        Scratch scratch, Problem *problem) {
    if (!factor_contacts(at, problem)) {
        return false;
    }
    factored_response(&at->factors, at->system->n, k, rows, X, scratch);
    return true;
}

PRBM bool mobility(ContactProblem *at, const double *row, double *result, Scratch scratch,
                   Problem *problem) {
    double *X = take(&scratch, (size_t)at->system->n);
    bool ok = loop_response(at, 1, row, X, scratch, problem);
    *result = ok ? dot(at->system->n, row, X) : 0.0;
    return ok;
}

PRBM bool moves(ContactProblem *at, const double *row, bool *result, Scratch scratch,
                Problem *problem) {
    double own = 0.0;
    bool ok = mobility(at, row, &own, scratch, problem);
    *result = ok && own > least_mobility(at->system->n, at->M, row, at->system->length);
    return ok;
}

PRBM bool independent(ContactProblem *at, int r, const double *held, const double *row,
                      bool *result, Scratch scratch, Problem *problem) {
    const System *system = at->system;
    int n = system->n;
    double own = 0.0, *X = take(&scratch, (size_t)n);
    bool ok = moves(at, row, result, scratch, problem);
    if (ok && *result) {
        ok = mobility(at, row, &own, scratch, problem) &&
             response(n, r, 1, at->M, held, row, system->length, X, scratch, problem);
        *result = ok && dot(n, row, X) > DEPENDENT_FRICTION_RTOL * own;
    }
    return ok;
}
