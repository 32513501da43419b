/* Complex numbers, one by one and by their parts. */
#ifndef PRBM_COMPLEX_H
#define PRBM_COMPLEX_H

typedef struct {
    double re, im;
} Complex;

/* Complex vectors with separate real and imaginary parts, padded with zeros to an even length for
 * operations on pairs. */
typedef struct {
    double *re, *im;
} Parts;

#endif
