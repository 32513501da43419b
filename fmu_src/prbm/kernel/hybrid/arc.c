/* The latest step and its dense output: the twin of hybrid/arc.py. */
#include <string.h>

#include "hybrid/access.h"
#include "hybrid/arc.h"
#include "hybrid/errors.h"

PRBM void forget_arc(Simulation *sim) {
    sim->stepping.has_middle = false;
    sim->stepping.embedded_error = -1.0;
}

PRBM void arc_at(const Simulation *sim, double t, double *y) {
    const Arc *arc = &sim->state.arc;
    interpolate(state_size(sim), arc->y, arc->k, arc->h, (t - arc->start) / arc->h, y);
}

PRBM void arc_located(const Simulation *sim, double t, double *y) {
    const Arc *arc = &sim->state.arc;
    const Located *located = &sim->stepping.located;
    interpolate(state_size(sim), arc->y, located->k, located->h, (t - arc->start) / located->h, y);
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

/* Compute the state at half the time of the step, by a step of that size. */
static bool find_middle(Simulation *sim, Problem *problem) {
    const Arc *arc = &sim->state.arc;
    Located *located = &sim->stepping.located;
    Node *middle = &sim->stepping.middle;
    int ny = state_size(sim), n = system_of(sim)->n;
    middle->time = arc->start + 0.5 * arc->h;
    if (!arc_cut(sim, middle->time, located->k, located->y, problem)) {
        return false;
    }
    copy(2 * n, located->y, middle->y);
    copy(n, located->k + (STAGES - 1) * ny + n, middle->a);
    sim->stepping.has_middle = true;
    return true;
}

/* Interpolate positions and rates through both ends of the step and a third node. */
static void through(Simulation *sim, const Node *third, double t, double *y) {
    const Arc *arc = &sim->state.arc;
    int ny = state_size(sim), n = system_of(sim)->n;
    double *end = sim->stepping.located.y, value[NODES * NODES], rate[NODES * NODES];
    double times[NODES] = {0.0, arc->h, third->time - arc->start};
    step_end(ny, arc->y, arc->k, arc->h, end);
    hermite_weights(times, t - arc->start, value, rate);
    const double *data[NODES * NODES] = {
        arc->y, arc->y + n, arc->k + n,
        end, end + n, arc->k + (STAGES - 1) * ny + n,
        third->y, third->y + n, third->a,
    };
    for (int j = 0; j < n; j++) {
        double position = 0.0, speed = 0.0;
        for (int i = 0; i < NODES * NODES; i++) {
            position += value[i] * data[i][j];
            speed += rate[i] * data[i][j];
        }
        y[j] = position;
        y[n + j] = speed;
    }
}

/* Compute the state y at time t in the step by a polynomial of degree eight: through both ends of
 * the step, and the start of the previous step or the middle of this one.  The energies are those
 * of the dense output, whose error is below that of the embedded solution: it is used if that is
 * small.  If the polynomial differs too much from the dense output, a step to the time replaces
 * it. */
static bool interpolated(Simulation *sim, double t, double *y, Scratch scratch,
                         Problem *problem) {
    const Arc *arc = &sim->state.arc;
    Located *located = &sim->stepping.located;
    int ny = state_size(sim);
    arc_at(sim, t, y);
    if (embedded_error(sim) <= DENSE_FACTOR * sim->state.tolerance ||
        arc->h < NODE_STEP_RTOL * sim->configuration.scales.time) {
        return true;
    }
    bool before = arc->before.time < arc->start;
    if (!before && !sim->stepping.has_middle && !find_middle(sim, problem)) {
        return false;
    }
    double *dense = take(&scratch, (size_t)ny);
    copy(ny, y, dense);
    through(sim, before ? &arc->before : &sim->stepping.middle, t, y);
    bool close = difference(sim, dense, y, scratch) <= INTERPOLATION_FACTOR * sim->state.tolerance;
    return close || arc_cut(sim, t, located->k, y, problem);
}

PRBM bool arc_state(Simulation *sim, double *y, Complex *e, Reference *near, Evaluation *evaluation,
                    Scratch scratch, Problem *problem) {
    const State *state = &sim->state;
    const System *system = system_of(sim);
    size_t bytes = (size_t)system->d * sizeof *e;
    if (!state->arc.valid || state->time >= state->front_time) {
        copy(state_size(sim), state->front, y);
        set_reference(near, system, y);
        memcpy(e, near->e, bytes);
        return true;
    }
    if (!interpolated(sim, state->time, y, scratch, problem)) {
        return false;
    }
    set_reference(near, system, y);
    double *interpolated = take(&scratch, (size_t)state_size(sim));
    copy(state_size(sim), y, interpolated);
    bool ok = factor_equations(&sim->equations, y, y + system->n, near, evaluation, problem) &&
              project_near(&sim->equations, evaluation, near, state->time, y, &sim->correction,
                           scratch, problem) &&
              check_projection(sim, state->time, interpolated, y, scratch, problem);
    memcpy(e, sim->correction.at.e, bytes);
    return ok;
}
