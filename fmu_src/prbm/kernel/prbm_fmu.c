/* The library, compiled as one file: everything but the functions of FMI stays inside.
 *
 * The headers fmi2Functions.h and fmi3Functions.h are those of the standards.  With -DPRBM_FMI=2
 * or 3 it has the functions of that version only; with -DPRBM_TABLES the tables of the mechanism
 * come from mechanism_tables.h instead of the FMU's folder resources.
 */
#include "kernel.h"
#include "simulation.h"
#include "core/memory.c"
#include "core/numbers.c"
#include "core/matrix.c"
#include "core/mechanism.c"
#include "core/flexure.c"
#include "core/assembly.c"
#include "core/kinetics.c"
#include "core/constraints.c"
#include "core/forces.c"
#include "core/statics.c"
#include "core/modal.c"
#include "core/contact.c"
#include "core/dynamics.c"
#include "core/runge_kutta.c"
#include "hybrid.c"
#include "exchange.c"
#include "fmi/fmu.h"
#include "fmi/resources.c"
#include "fmi/fmu.c"
#include "fmi/fmi2.c"
#include "fmi/fmi3.c"
