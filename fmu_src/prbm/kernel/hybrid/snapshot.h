/* The state before an attempt. */
#ifndef PRBM_SNAPSHOT_H
#define PRBM_SNAPSHOT_H

#include "hybrid/state.h"

PRBM void keep_backup(Simulation *sim);
PRBM bool attempt(Simulation *sim, bool right, Problem *problem); /* back to the backup, or right */

#endif
