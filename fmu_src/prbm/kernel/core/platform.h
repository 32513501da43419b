/* Differences of compilers: attributes, vectors, and the linkage of the functions. */
#ifndef PRBM_PLATFORM_H
#define PRBM_PLATFORM_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "generated.h"

/* All functions are local to the one file that the library is compiled from.  A test that looks
 * at them one by one defines PRBM as nothing. */
#ifndef PRBM
#if defined(__GNUC__)
#define PRBM static __attribute__((unused))
#else
#define PRBM static
#endif
#endif

/* Of a pointer: the only one to its array within the function. */
#if defined(_MSC_VER)
#define ALONE __restrict
#else
#define ALONE restrict
#endif

/* Loops over a part of the mechanism are written once and compiled for each small size. */
#if defined(__GNUC__)
#define SIZED static inline __attribute__((always_inline))
#else
#define SIZED static
#endif
/* What few mechanisms need stays out of the way of what all do. */
#if defined(__GNUC__)
#define RARE static __attribute__((noinline))
#else
#define RARE static
#endif
#if defined(__GNUC__) && !defined(__clang__) /* which needs to be told */
#define UNROLLED _Pragma("GCC unroll 8")
#define UNROLLED_BY_LANES _Pragma("GCC unroll 4")
#else
#define UNROLLED
#define UNROLLED_BY_LANES
#endif
/* Vectors of the compiler: two numbers at a time, with the same operations on each, so that all
 * bits are those of the loops without them (-DPRBM_PLAIN). */
#if defined(__GNUC__) && !defined(PRBM_PLAIN)
#define VECTORS 1
#else
#define VECTORS 0
#endif
/* Whether the compiler knows a length where a function is inlined; loops over unknown ones are
 * compiled once. */
#if defined(__GNUC__)
#define KNOWN(length) __builtin_constant_p(length)
#else
#define KNOWN(length) false
#endif
enum { SMALL = 4 }; /* the largest such size; loops to a constant are the ones that unroll */

#endif
