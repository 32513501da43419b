/* The latest step and its dense output: the twin of hybrid/arc.py. */
#include "hybrid/hybrid.h"

PRBM void arc_at(const Simulation *sim, double t, double *y) {
    const Arc *arc = &sim->state.arc;
    interpolate(state_size(sim), arc->y, arc->k, arc->h, (t - arc->start) / arc->h, y);
}

PRBM bool arc_state(Simulation *sim, double *y, Problem *problem) {
    const State *state = &sim->state;
    const System *system = system_of(sim);
    Present *present = &sim->present;
    if (!state->arc.valid || state->time >= state->front_time) {
        copy(state_size(sim), state->front, y);
        set_reference(&present->reference, system, y);
        return true;
    }
    arc_at(sim, state->time, y);
    set_reference(&present->reference, system, y);
    return factor_equations(&sim->equations, y, y + system->n, &present->reference,
                            &present->evaluation, problem) &&
           project_near(&sim->equations, &present->evaluation, &present->reference, state->time, y,
                        &sim->stepping.correction, &sim->scratch, problem);
}
