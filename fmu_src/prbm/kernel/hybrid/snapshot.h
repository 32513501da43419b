/* Backup of the state before an attempt, and its restoration after a failure. */
#ifndef PRBM_SNAPSHOT_H
#define PRBM_SNAPSHOT_H

#include "hybrid/state.h"

PRBM void keep_backup(Simulation *sim);
/* End an attempt: return whether it was successful, and restore the backup if it was not. */
PRBM bool attempt(Simulation *sim, bool ok, Problem *problem);

#endif
