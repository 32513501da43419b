/* Pairs of numbers, and vectors that are padded with zeros to an even length. */
#ifndef PRBM_VECTORS_H
#define PRBM_VECTORS_H

#include <string.h>

#include "core/complex.h"
#include "core/platform.h"

/* Lanes: two numbers if the compiler has vectors, else one.  An operation applies to each
 * number. */
#if VECTORS
typedef double Lanes __attribute__((vector_size(16)));
typedef uint64_t LaneBits __attribute__((vector_size(16)));
typedef double LanesInMemory __attribute__((vector_size(16), aligned(8)));
#define NO_LANES {0.0, 0.0}
#define LANE(x, i) (x)[i]
#else
typedef double Lanes;
typedef uint64_t LaneBits;
typedef double LanesInMemory;
#define NO_LANES 0.0
#define LANE(x, i) (x)
#endif
enum { LANES = sizeof(Lanes) / sizeof(double), PAIR = 2, SUMS = PAIR / LANES };

static inline Lanes lanes_at(const double *x) {
    return *(const LanesInMemory *)x;
}

/* The same for a number at an even index of an array that begins at a multiple of 16 bytes. */
static inline Lanes aligned_lanes(const double *x) {
    return *(const Lanes *)(const void *)x;
}

static inline Lanes all_lanes(double x) {
    Lanes lanes = NO_LANES;
    return x - lanes;
}

static inline void set_lanes(double *x, Lanes lanes) {
    *(LanesInMemory *)x = lanes;
}

static inline LaneBits bits_of(Lanes x) {
    LaneBits bits;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}

static inline Lanes from_bits(LaneBits bits) {
    Lanes x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

static inline Lanes magnitudes(Lanes x) {
    return from_bits(bits_of(x) & (UINT64_MAX >> 1));
}

/* The larger of two numbers; b if one of them is NaN. */
static inline Lanes larger(Lanes a, Lanes b) {
#if VECTORS
    LaneBits first = (LaneBits)(a > b);
    return from_bits((bits_of(a) & first) | (bits_of(b) & ~first));
#else
    return a > b ? a : b;
#endif
}

/* The even and the odd terms of a sum are summed separately and added at the end.  For Lanes
 * sum[SUMS], term i is added to sum[SUM_OF(i)]. */
#define SUM_OF(i) ((i) / LANES % SUMS)

static inline double total(const Lanes *sum) {
    return LANE(sum[0], 0) + LANE(sum[SUMS - 1], LANES - 1);
}

static inline int even_length(int n) {
    return n + n % PAIR;
}

/* Store two numbers as one pair at an even index.  A later load of the pair would have to wait for
 * two separate stores to reach the cache. */
SIZED void put_pair(double *x, double a, double b) {
#if VECTORS
    Lanes pair = {a, b};
    set_lanes(x, pair);
#else
    x[0] = a;
    x[1] = b;
#endif
}

SIZED void copy_pairs(int even, const double *from, double *to) {
    UNROLLED_BY_LANES
    for (int i = 0; i < even; i += LANES) {
        set_lanes(to + i, lanes_at(from + i));
    }
}

/* Copy a vector without its first number. */
SIZED void copy_shifted(int even, const double *from, double *to) {
    UNROLLED_BY_LANES
    for (int i = 0; i < even; i += LANES) {
#if VECTORS
        Lanes here = lanes_at(from + i), next = lanes_at(from + i + PAIR);
        put_pair(to + i, here[1], next[0]);
#else
        to[i] = from[i + 1];
#endif
    }
}

/* Copy a vector, padded with a zero to an even length. */
SIZED void pad_of(int even, int n, const double *x, double *padded) {
    copy_pairs(even - PAIR, x, padded);
    put_pair(padded + even - PAIR, x[even - PAIR], n == even ? x[even - 1] : 0.0);
}

/* Copy the second of two consecutive vectors of length n, padded to an even length. */
SIZED void pad_second(int even, int n, const double *both, double *padded) {
    if (n == even) {
        pad_of(even, n, both + n, padded);
    } else {
        copy_shifted(even - PAIR, both + n - 1, padded);
        put_pair(padded + even - PAIR, both[2 * n - 1], 0.0);
    }
}

/* Copy two padded vectors of length n one after the other, without padding. */
SIZED void join(int even, int n, const double *first, const double *second, double *both) {
    copy_pairs(even - PAIR, first, both);
    if (n == even) {
        copy_pairs(PAIR, first + n - PAIR, both + n - PAIR);
        copy_pairs(n, second, both + n);
    } else {
        put_pair(both + n - 1, first[n - 1], second[0]);
        copy_shifted(even - PAIR, second, both + even);
    }
}

static inline void pad(int n, const double *x, double *padded) {
    if (n > 0) {
        pad_of(even_length(n), n, x, padded);
    }
}

static inline void pad_parts(int n, const Complex *z, Parts parts) {
    parts.re[even_length(n) - 1] = parts.im[even_length(n) - 1] = 0.0;
    for (int i = 0; i < n; i++) {
        parts.re[i] = z[i].re;
        parts.im[i] = z[i].im;
    }
}

static inline void set_complex(Complex *z, Lanes re, Lanes im) {
    for (int i = 0; i < LANES; i++) {
        z[i].re = LANE(re, i);
        z[i].im = LANE(im, i);
    }
}

#endif
