/* Differences of compilers: attributes, vectors, and the linkage of the functions. */
#ifndef PRBM_PLATFORM_H
#define PRBM_PLATFORM_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "generated.h"

/* All functions are static in the one file from which the library is compiled.  Tests that call
 * single functions define PRBM as empty. */
#ifndef PRBM
#if defined(__GNUC__)
#define PRBM static __attribute__((unused))
#else
#define PRBM static
#endif
#endif

/* restrict: qualifier of a pointer that is the only one to its array within the function. */
#if defined(_MSC_VER)
#define ALONE __restrict
#else
#define ALONE restrict
#endif

/* Functions with loops over parts of the mechanism are compiled separately for each small size. */
#if defined(__GNUC__)
#define SIZED static inline __attribute__((always_inline))
#else
#define SIZED static
#endif
/* A SIZED function that functions of other files consist of.  A test that compiles each file alone
 * defines SHARED as nothing. */
#ifndef SHARED
#define SHARED SIZED
#endif
/* Functions that few mechanisms need are not inlined. */
#if defined(__GNUC__)
#define RARE static __attribute__((noinline))
#else
#define RARE static
#endif
#if defined(__GNUC__) && !defined(__clang__) /* Clang unrolls without a pragma. */
#define UNROLLED _Pragma("GCC unroll 10")
#define UNROLLED_BY_LANES _Pragma("GCC unroll 4")
#else
#define UNROLLED
#define UNROLLED_BY_LANES
#endif
/* Vectors of the compiler: two numbers at a time, with the same operations on each.  The results
 * are bit for bit those of loops without vectors (-DPRBM_PLAIN). */
#if defined(__GNUC__) && !defined(PRBM_PLAIN)
#define VECTORS 1
#else
#define VECTORS 0
#endif
/* Whether a length is a constant after inlining; functions for other lengths are compiled once. */
#if defined(__GNUC__)
#define KNOWN(length) __builtin_constant_p(length)
#else
#define KNOWN(length) false
#endif
enum { SMALL = 4 }; /* The largest size that is compiled separately. */

#endif
