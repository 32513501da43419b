/* The mechanics in C: the headers of core/.
 *
 * The first comment of a file names its counterpart in Python, if there is one: most are modules of
 * prbm.mechanics.  tests/kernel/test_kernel_twins.py compares pairs of functions with one name one
 * by one; all others are compared through the results of whole simulations.
 *
 * The language is C99.  There is no global state, and no memory is allocated after a simulation has
 * been opened.  Of libm only functions with exact results are called, such as floor and ldexp, so
 * that the same input gives the same bytes on every platform (tests/kernel/test_symbols.py).
 *
 * Matrices are stored row by row.  A function that can fail returns false and writes a message to a
 * Problem.  SI units and radians everywhere; docs/conventions.md has the signs and symbols.
 */
#ifndef PRBM_KERNEL_H
#define PRBM_KERNEL_H

#include "core/platform.h"
#include "core/complex.h"
#include "core/numbers.h"
#include "core/memory.h"
#include "core/matrix.h"
#include "core/mechanism.h"
#include "core/tables.h"
#include "core/flexure.h"
#include "core/profile.h"
#include "core/beam.h"
#include "core/system.h"
#include "core/placement.h"
#include "core/assembly.h"
#include "core/free_body.h"
#include "core/kinetics.h"
#include "core/constraints.h"
#include "core/intervals.h"
#include "core/factors.h"
#include "core/forces.h"
#include "core/elements.h"
#include "core/contact_state.h"
#include "core/compliance.h"
#include "core/equations.h"
#include "core/evaluated.h"
#include "core/friction.h"
#include "core/evaluation.h"
#include "core/gaps.h"
#include "core/dynamics.h"
#include "core/sections.h"
#include "core/projection.h"
#include "core/runge_kutta.h"
#include "core/complementarity.h"
#include "core/contact.h"
#include "core/statics.h"
#include "core/positions.h"
#include "core/modal.h"
#include "core/start.h"

#endif
