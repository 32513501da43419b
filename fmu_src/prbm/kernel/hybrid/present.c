/* The present moment, and the record of the present quantities that are up to date. */
#include "hybrid/access.h"
#include "hybrid/guards.h"
#include "hybrid/present.h"

PRBM bool moment_at(Simulation *sim, const double *y, Moment *now, Problem *problem) {
    Present *present = &sim->present;
    double time = sim->state.time;
    if (!(present->fresh & RATES)) {
        if (!rate(&sim->equations, time, y, NULL, &present->rated, present->rates, problem)) {
            return false;
        }
        present->fresh |= RATES;
    }
    Instant at = {time, y, y + system_of(sim)->n, extra_states(sim, y), present->rated.at.e,
                  &present->rated};
    now->at = at;
    now->rates = present->rates;
    now->evaluation = &present->rated;
    return true;
}
