/* Complementarity problems of unilateral contacts. */
#ifndef PRBM_COMPLEMENTARITY_H
#define PRBM_COMPLEMENTARITY_H

#include "core/memory.h"

/* Solve z >= 0, w = M z + q >= 0, z.w = 0 for z (m,) by Lemke's method, with the covering vector
 * cover (m,) > 0.  Return false if the method ends in a ray. */
PRBM bool lemke(int m, const double *M, const double *q, const double *cover, double *z,
                Scratch scratch);
/* Coulomb's laws of m tangents beside k normals, with forces P (k + m,).  The limit of tangent j is
 * fixed[j] + friction[j] N, with the normal force N = P[i] for i = normal[j] < k, and N = 0 for i = -1.
 * For i >= k it is the magnitude of a force that acts in both directions, N = |b[g] + L[g] P| with
 * g = i - k. */
typedef struct {
    const double *friction, *fixed; /* (m,) */
    const int *normal;              /* (m,) */
    int sides;
    const double *L, *b; /* (sides, k + m), (sides,) */
} CoulombLaws;

/* The limit of tangent j at forces P (size,). */
PRBM double limit_of(int k, int size, const CoulombLaws *laws, int j, const double *P);
/* Compute forces P (k + m,) of k normals and m tangents that satisfy the laws of contact and of
 * friction, with the rates W P + u.  Return false if there is no solution.  Violations of the laws up
 * to the tolerance, a rate, are accepted as round-off. */
PRBM bool coulomb(int k, int m, const double *W, const double *u, const CoulombLaws *laws,
                  double tolerance, double *P, Scratch scratch);
/* Compute forces as coulomb, from all combinations of modes, up to MODES_TRIED_MAX: a normal is open
 * or closed, a tangent sticks or has a friction force of either sign. */
PRBM bool in_any_modes(int k, int m, const double *W, const double *u, const CoulombLaws *laws,
                       double tolerance, double *P, Scratch scratch);
/* Compute impulses P (k + m,) of an impact by the laws of coulomb.  Tangent j belongs to normal j;
 * m is k, or 0 without friction.  The normal impulses have the lower bounds least (k,). */
PRBM bool impulses(int k, int m, const double *W, const double *u, const double *friction,
                   const double *least, double tolerance, double *P, Scratch scratch);
/* Return the largest violation of the laws, as a rate; limit (m,) are the friction limits. */
PRBM double violation(int k, int m, const double *W, const double *u, const double *P,
                      const double *limit);

#endif
