/* Elementary functions with the same bits on every platform, and complex numbers. */
#ifndef PRBM_NUMBERS_H
#define PRBM_NUMBERS_H

#include <math.h>
#if defined(__SSE2__)
#include <emmintrin.h>
#endif

#include "core/complex.h"
#include "core/platform.h"

/* Return the square root, rounded once.  The function sqrt of some C libraries (MinGW) computes with
 * more digits and rounds twice; without optimization a compiler calls it. */
static inline double square_root(double x) {
#if defined(__SSE2__)
    __m128d pair = _mm_set_sd(x);
    return _mm_cvtsd_f64(_mm_sqrt_sd(pair, pair));
#else
    return sqrt(x);
#endif
}

PRBM void unit_vectors(int n, const double *q, Complex *e); /* exp(i q), as np.exp(1j * q) */
PRBM double natural_log(double x);                          /* x > 0 */
PRBM double exponential(double x);
PRBM double power(double x, double y);                      /* x^y for x > 0 */
PRBM double phase(Complex z);                               /* as cmath.phase, in (-pi, pi] */
PRBM double spacing(double x); /* The distance from the next floating-point number. */
PRBM bool finite_number(double x);
PRBM double largest(int n, const double *x);                /* max |x_i|; 0 if n = 0 */
PRBM double greater(double a, double b); /* b unless a > b. */
PRBM double lesser(double a, double b);  /* b unless a < b. */
PRBM Complex unit(double degrees);       /* exp(i angle) */
PRBM Complex complex_of(double re, double im);
PRBM Complex plus(Complex a, Complex b);
PRBM Complex minus(Complex a, Complex b);
PRBM Complex product(Complex a, Complex b);
PRBM Complex conjugate(Complex a);
PRBM Complex scaled(double x, Complex a);
PRBM double modulus(Complex a);
/* Compute e = exp(i q) from e_start = exp(i start); return false unless all angles are near their
 * start. */
SHARED bool turned_directions(int even, const double *q, const double *start, Parts e_start,
                              Parts parts, Complex *e);
PRBM Parts parts_from(Parts parts, int start);

#endif
