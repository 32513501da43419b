/* What all contacts of a mechanism share at one position. */
#ifndef PRBM_CONTACT_PROBLEM_H
#define PRBM_CONTACT_PROBLEM_H

#include "core/constraints.h"
#include "core/system.h"

/* Directions, mass matrix, Jacobian of the loops, and the factors of both.  They are computed for a
 * position once, however many contacts, trials and impulses need them. */
typedef struct {
    const System *system;
    int assembly;          /* of the system that they belong to; 0 before the first position */
    bool factored;
    double *q;             /* (n,) the position */
    Complex *e;            /* (d,) */
    double *M, *loops;     /* (n, n), (r, n) */
    ScaledFactors factors; /* of the saddle-point matrix of M and the loops */
} ContactProblem;

PRBM void contact_problem_place(ContactProblem *at, const System *system, Memory *memory);
/* Compute the problem at the angles q (n,), unless it is already there. */
PRBM void set_position(ContactProblem *at, const double *q, Scratch scratch);
/* Factor the mass matrix with the loops, unless this has been done. */
PRBM bool factor_contacts(ContactProblem *at, Problem *problem);
/* Compute the changes of velocity X (n, k) by unit impulses along the rows (k, n). */
PRBM bool loop_response(ContactProblem *at, int k, const double *rows, double *X,
                        Scratch scratch, Problem *problem);
/* Compute the inverse mass along a row (n,) [1/kg]. */
PRBM bool mobility(ContactProblem *at, const double *row, double *result, Scratch scratch,
                   Problem *problem);
/* Find whether a motion along a row (n,) is possible: its mobility is not round-off. */
PRBM bool moves(ContactProblem *at, const double *row, bool *result, Scratch scratch,
                Problem *problem);
/* Find whether a motion along a row is possible while the rows held (r, n), loops among them, hold.
 * It is not if the row is round-off, or they leave hardly any of its mobility. */
PRBM bool independent(ContactProblem *at, int r, const double *held, const double *row,
                      bool *result, Scratch scratch, Problem *problem);

#endif
