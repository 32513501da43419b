/* The latest step and its dense output: the twin of hybrid/arc.py. */
#include "hybrid/arc.h"
#include "hybrid/simulation.h"
#include "hybrid/stepping.h"

PRBM void arc_at(const Simulation *sim, double t, double *y) {
    const Arc *arc = &sim->state.arc;
    interpolate(state_size(sim), arc->y, arc->k, arc->h, (t - arc->start) / arc->h, y);
}

PRBM bool arc_cut(Simulation *sim, double t, double *k, double *y, Problem *problem) {
    const Arc *arc = &sim->state.arc;
    Stepping *stepping = &sim->stepping;
    int ny = state_size(sim);
    if (k != arc->k) {
        copy(ny, arc->k, k);
    }
    return stages(&sim->equations, arc->start, ny, arc->y, t - arc->start, k, y,
                  &stepping->reference, &stepping->located.evaluation, &stepping->located.forces,
                  problem);
}

PRBM bool arc_state(Simulation *sim, double *y, Reference *near, Evaluation *evaluation,
                    Problem *problem) {
    const State *state = &sim->state;
    const System *system = system_of(sim);
    if (!state->arc.valid || state->time >= state->front_time) {
        copy(state_size(sim), state->front, y);
        set_reference(near, system, y);
        return true;
    }
    arc_at(sim, state->time, y);
    set_reference(near, system, y);
    size_t mark = sim->scratch.used;
    double *interpolated = take(&sim->scratch, (size_t)state_size(sim));
    copy(state_size(sim), y, interpolated);
    bool ok = factor_equations(&sim->equations, y, y + system->n, near, evaluation, problem) &&
              project_near(&sim->equations, evaluation, near, state->time, y, &sim->correction,
                           &sim->scratch, problem) &&
              check_projection(sim, state->time, interpolated, y, problem);
    sim->scratch.used = mark;
    return ok;
}
