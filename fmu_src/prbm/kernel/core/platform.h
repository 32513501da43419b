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

/* RESTRICT (restrict in C99) marks a pointer that is the only one to its array in a function. */
#if defined(_MSC_VER)
#define RESTRICT __restrict
#else
#define RESTRICT restrict
#endif

/* SIZED functions are compiled once for each small size, so that their loops unroll. */
#if defined(__GNUC__)
#define SIZED static inline __attribute__((always_inline))
#else
#define SIZED static
#endif
/* SHARED functions are SIZED functions that other files inline.  A test that compiles each file
 * alone defines SHARED as nothing. */
#ifndef SHARED
#define SHARED SIZED
#endif
/* NOINLINE functions, which few mechanisms need, are not inlined. */
#if defined(__GNUC__)
#define NOINLINE static __attribute__((noinline))
#else
#define NOINLINE static
#endif
#if defined(__GNUC__) && !defined(__clang__) /* Clang unrolls without a pragma. */
#define UNROLLED _Pragma("GCC unroll 10")
#define UNROLLED_BY_LANES _Pragma("GCC unroll 4")
#else
#define UNROLLED
#define UNROLLED_BY_LANES
#endif
/* Whether the vector types of the compiler are used, which compute with two numbers at a time.  The
 * results are bit for bit those of loops without vectors (-DPRBM_PLAIN). */
#if defined(__GNUC__) && !defined(PRBM_PLAIN)
#define VECTORS 1
#else
#define VECTORS 0
#endif
/* Whether a length is a compile-time constant.  Functions for other lengths are compiled once. */
#if defined(__GNUC__)
#define IS_CONSTANT(length) __builtin_constant_p(length)
#else
#define IS_CONSTANT(length) false
#endif
/* Sizes that are compiled separately: up to SMALL, and the mass matrix of a guide on two beams with
 * three coordinates each beside the rotation of the body. */
enum { SMALL = 4, GUIDE = 7 };

#endif
