/* Linear algebra for small dense matrices. */
#ifndef PRBM_MATRIX_H
#define PRBM_MATRIX_H

#include "core/memory.h"

PRBM double dot(int n, const double *a, const double *b);
PRBM void copy(int n, const double *from, double *to);
PRBM void zeros(int n, double *x);
PRBM void add_scaled(int n, double a, const double *x, double *y); /* y += a x */
/* LU with partial pivoting, in place; false if a pivot is zero or not a number. */
PRBM bool lu_factor(int n, double *a, int *pivot);
PRBM void lu_solve(int n, const double *a, const int *pivot, double *b);
/* Cholesky L L^T of a symmetric matrix, of which the lower triangle is read and overwritten; the
 * diagonal is left inverted; false if a pivot is not positive. */
PRBM bool cholesky(int n, double *a);
PRBM void forward(int n, const double *a, double *b);  /* b := L^-1 b */
PRBM void backward(int n, const double *a, double *b); /* b := L^-T b */
/* The x of least norm among those that minimise |a x - b|, as np.linalg.lstsq: singular values
 * below rcond times the largest count as zero.  a is (m, n). */
PRBM void least_squares(int m, int n, const double *a, const double *b, double rcond, double *x,
                        Scratch *scratch);
/* Eigenvalues w in rising order and, unless NULL, orthonormal eigenvectors as columns of z, of a
 * symmetric matrix, which is destroyed (cyclic Jacobi). */
PRBM void symmetric_eigen(int n, double *a, double *w, double *z);
/* An orthonormal basis z (n, n - r) of what the rows (r, n), of full rank, send to zero. */
PRBM void null_space(int r, int n, const double *rows, double *z, Scratch *scratch);
PRBM double even_dot(int even, const double *a, const double *b);
PRBM void exchange(int n, double *a, double *b);

#endif
