/* Linear algebra for small dense matrices. */
#ifndef PRBM_MATRIX_H
#define PRBM_MATRIX_H

#include "core/memory.h"

PRBM double dot(int n, const double *a, const double *b);
PRBM void copy(int n, const double *from, double *to);
PRBM void zeros(int n, double *x);
PRBM void add_scaled(int n, double a, const double *x, double *y); /* y += a x */
/* Factorise by LU with partial pivoting, in place; false if a pivot is NaN, or so small beside the
 * largest that it is round-off.  The elements of a should be scaled. */
PRBM bool lu_factor(int n, double *a, int *pivot);
PRBM void lu_solve(int n, const double *a, const int *pivot, double *b);
/* Factorise a symmetric matrix as L L^T by Cholesky's method; false if a pivot is not positive, or
 * round-off of its diagonal element.  The lower triangle is read and overwritten by L; the diagonal
 * is stored inverted. */
PRBM bool cholesky(int n, double *a);
PRBM void forward(int n, const double *a, double *b);  /* b := L^-1 b */
PRBM void backward(int n, const double *a, double *b); /* b := L^-T b */
/* Compute the x of least norm that minimises |a x - b|, as np.linalg.lstsq.  a is (m, n); singular
 * values below rcond times the largest count as zero. */
PRBM bool least_squares(int m, int n, const double *a, const double *b, double rcond, double *x,
                        Scratch scratch, Problem *problem);
/* Compute the eigenvalues w of a symmetric matrix in ascending order and, unless z is NULL, its
 * orthonormal eigenvectors, the columns of z, by cyclic Jacobi rotations; a is overwritten. */
PRBM bool symmetric_eigen(int n, double *a, double *w, double *z, Problem *problem);
/* Compute an orthonormal basis z (n, n - r) of the null space of rows (r, n) of full rank. */
PRBM void null_space(int r, int n, const double *rows, double *z, Scratch scratch);
PRBM double even_dot(int even, const double *a, const double *b);
PRBM void exchange(int n, double *a, double *b);

#endif
