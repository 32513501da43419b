/* The library, compiled as one file: everything but the functions of FMI stays inside.
 *
 * The headers fmi2Functions.h and fmi3Functions.h are those of the standards.  With -DPRBM_FMI=2
 * or 3 it has the functions of that version only; with -DPRBM_TABLES the tables of the mechanism
 * come from mechanism_tables.h instead of the FMU's folder resources.
 */
#include "kernel.h"
#include "simulation.h"
#include "memory.c"
#include "numbers.c"
#include "matrix.c"
#include "mechanism.c"
#include "flexure.c"
#include "assembly.c"
#include "kinetics.c"
#include "constraints.c"
#include "forces.c"
#include "statics.c"
#include "modal.c"
#include "contact.c"
#include "dynamics.c"
#include "runge_kutta.c"
#include "hybrid.c"
#include "exchange.c"
#include "fmu.h"
#include "resources.c"
#include "fmu.c"
#include "fmi2.c"
#include "fmi3.c"
