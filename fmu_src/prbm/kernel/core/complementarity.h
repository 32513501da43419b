/* Complementarity problems of unilateral contacts. */
#ifndef PRBM_COMPLEMENTARITY_H
#define PRBM_COMPLEMENTARITY_H

#include "core/memory.h"

/* Solve z >= 0, w = M z + q >= 0, z.w = 0, all (m,), by Lemke's method; false if the path ends in a
 * ray. */
PRBM bool lemke(int m, const double *M, const double *q, const double *cover, double *z,
                Scratch *scratch);
/* Forces P (k + m,) of k normals and m tangents that satisfy the laws of contact and of friction,
 * with the rates W P + u; false without a solution.  The limit of each tangent is fixed + friction
 * P_n, with the normal force of the given index; -1: none.  Violations of the laws up to the
 * tolerance, a rate, are round-off. */
PRBM bool coulomb(int k, int m, const double *W, const double *u, const double *friction,
                  const double *fixed, const int *normal, double tolerance, double *P,
                  Scratch *scratch);
/* Impulses of an impact by the same laws: m is k, or 0 without friction, and the tangents belong to
 * the normals in order.  No normal impulse is below the least (k,). */
PRBM bool impulses(int k, int m, const double *W, const double *u, const double *friction,
                   const double *least, double tolerance, double *P, Scratch *scratch);
/* The largest violation of the laws, as a rate; limit (m,) of the tangential forces. */
PRBM double violation(int k, int m, const double *W, const double *u, const double *P,
                      const double *limit);

#endif
