/* Complementarity problems of unilateral contacts. */
#ifndef PRBM_COMPLEMENTARITY_H
#define PRBM_COMPLEMENTARITY_H

#include "core/memory.h"

/* z >= 0, w = M z + q >= 0, z.w = 0, all (m,), by Lemke's method; false without a solution. */
PRBM bool lemke(int m, const double *M, const double *q, const double *cover, double *z,
                Scratch *scratch);
/* Forces P (k + m,) of k normals and m tangents that satisfy the laws of contact and of friction,
 * with the rates W P + u; false without a solution.  normal: on which the limit fixed + friction
 * P_n of each tangent depends; -1: none. */
PRBM bool coulomb(int k, int m, const double *W, const double *u, const double *friction,
                  const double *fixed, const int *normal, double *P, Scratch *scratch);
/* The same of an impact, whose tangents (m of the k, or none) belong to its normals; no normal
 * impulse is below the least (k,).  Violations below the tolerance are round-off. */
PRBM bool impulses(int k, int m, const double *W, const double *u, const double *friction,
                   const double *least, double tolerance, double *P, Scratch *scratch);
/* The largest violation of the laws, as a rate; limit (m,) of the tangential forces. */
PRBM double violation(int k, int m, const double *W, const double *u, const double *P,
                      const double *limit);

#endif
