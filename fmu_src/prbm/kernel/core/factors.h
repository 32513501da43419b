/* Factors of a saddle-point matrix, for repeated solution. */
#ifndef PRBM_FACTORS_H
#define PRBM_FACTORS_H

#include "core/system.h"

/* M = L D L^T block by block, Z = L^-1 rows^T and the Schur complement S of a saddle-point matrix
 * [[M, columns^T], [rows, 0]], for repeated solution.  Vectors are padded to an even length. */
typedef struct {
    int even, r, block_count;
    const Block *blocks;
    double *L;                  /* its blocks, one behind the other, below their diagonals */
    double *inverse;            /* (even,) 1/D */
    double *Z, *Z_columns;      /* (r, even); of the columns as of the rows, or the same array */
    double *S;                  /* (r, r), and room for its factor */
    int *pivots;                /* (r,) */
    bool symmetric;             /* S is, and small: its factor is L D L^T, else LU */
} Factors;

typedef enum { BACKWARD, FORWARD } Substitution;

/* Compute S from Z and Z_columns, and factor it. */
PRBM bool factor_schur(Factors *factors);
/* x (even,) and lam (r,): in, the right side; out, the solution a and the multipliers. */
PRBM void solve_again(const Factors *factors, double *x, double *lam);
/* For each small size: of blocks, and of the whole. */
SHARED bool factor_any(int size, const double *ALONE M, double *ALONE L, double *ALONE inverse);
SHARED bool small_factor(int size, const double *ALONE M, double *ALONE L, double *ALONE inverse);
SHARED void put_block(int size, int start, const double *from, double *to);
SHARED void block_forward(int size, const double *ALONE L, double *ALONE b);
SHARED void solve_small(int size, int start, const double *ALONE L, double *ALONE x,
                        Substitution way);
SHARED bool schur_of_length(int even, Factors *factors);
SHARED void finish_of_length(int even, const Factors *factors, double *x, double *lam);
PRBM void forward_all(const Factors *factors, double *x);

#endif
