/* Factors of a saddle-point matrix, for repeated solution. */
#ifndef PRBM_FACTORS_H
#define PRBM_FACTORS_H

#include "core/intervals.h"

/* M = U D U^T block by block, Z = U^-1 rows^T and the Schur complement S of a saddle-point matrix
 * [[M, columns^T], [rows, 0]], for repeated solution.  Vectors are padded to an even length. */
typedef struct {
    int n, even, r, block_count;
    const Block *blocks;
    const int *last;            /* (n,) last elements of the rows of U, counted in their blocks */
    const FactorRow *factor_rows; /* (n,) */
    const Intervals *intervals; /* of the rows Z */
    double *scaled;             /* (even,) working memory */
    double *U;                  /* upper triangles of the blocks, consecutive */
    double *inverse;            /* (even,) 1/D */
    double *Z, *Z_columns;      /* (r, even); Z_columns = U^-1 columns^T, Z itself if symmetric */
    double *S;                  /* (r, r), and memory for its factor, or its scales */
    int *pivots;                /* (r,) */
    double least;               /* square of the shortest row Z that is not round-off */
    bool symmetric;             /* S is symmetric: factor U D U^T, else LU */
} Factors;

typedef enum { BACKWARD, FORWARD } Substitution;

/* Compute S from Z and Z_columns, and factor it.  Return false if S is singular, or a row is
 * round-off. */
PRBM bool factor_schur(Factors *factors);
/* Solve with existing factors.  The right sides x (even,) and lam (r,) are replaced by the solution
 * and the multipliers. */
PRBM void solve_again(const Factors *factors, double *x, double *lam);
/* Functions that are compiled for each small size of a block or of the system. */
PRBM bool factor_any(int size, const int *last, const double *M, double *U, double *inverse);
SHARED bool factor_guide(const double *RESTRICT M, double *RESTRICT U, double *RESTRICT inverse);
SHARED void solve_guide(const double *RESTRICT U, double *RESTRICT b, Substitution way);
SHARED bool small_factor(int size, const double *RESTRICT M, double *RESTRICT U,
                         double *RESTRICT inverse);
SHARED void put_block(int size, int start, const double *from, double *to);
SHARED void block_forward(int size, const double *RESTRICT U, double *RESTRICT b);
SHARED void solve_small(int size, int start, const double *RESTRICT U, double *RESTRICT x,
                        Substitution way);
/* Replace count vectors b, stride apart, by U^-1 b, within a block of any size. */
PRBM void forward_block(int size, const int *last, const double *U, int count, int stride,
                        double *b);
SHARED bool schur_dispatch(int even, Factors *factors);
SHARED void finish_dispatch(int even, const Factors *factors, double *x, double *lam);
/* Replace the rows Z by U^-1 Z. */
PRBM void forward_rows(const Factors *factors);
PRBM void forward_all(const Factors *factors, double *x);

#endif
