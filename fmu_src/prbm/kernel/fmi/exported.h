/* The definition of functions that the library exports.
 *
 * EXPORTED precedes the definition of a function of FMI, and NAMED(prefix, name) is its name.  As
 * the standards require of C source code, the prefix FMI2_FUNCTION_PREFIX or FMI3_FUNCTION_PREFIX,
 * if defined, comes before all names, unless FMI2_OVERRIDE_FUNCTION_PREFIX or
 * FMI3_OVERRIDE_FUNCTION_PREFIX is defined.
 */
#ifndef PRBM_EXPORTED_H
#define PRBM_EXPORTED_H

#if defined(_WIN32) || defined(__CYGWIN__)
#define EXPORTED __declspec(dllexport)
#elif defined(__GNUC__)
#define EXPORTED __attribute__((visibility("default")))
#else
#define EXPORTED
#endif

#define NAMED(prefix, name) NAMED_EXPANDED(prefix, name)
#define NAMED_EXPANDED(prefix, name) prefix##name

#endif
