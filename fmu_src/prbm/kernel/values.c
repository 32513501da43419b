/* The values of a simulation, in co-simulation or model exchange. */
#include <string.h>

#include "core/vectors.h"
#include "hybrid/access.h"
#include "hybrid/arc.h"
#include "hybrid/outputs.h"
#include "hybrid/present.h"
#include "hybrid/release.h"
#include "hybrid/snapshot.h"
#include "indicators.h"
#include "model_exchange.h"
#include "values.h"

PRBM bool simulation_start(Simulation *simulation, double start_time, double tolerance,
                           bool exchange, Problem *problem) {
    Simulation *sim = simulation;
    SimulationMode mode = {exchange, exchange ? LOWEST_BOUNCE_RTOL : 0.0};
    keep_backup(sim);
    bool ok = start_motion(sim, start_time, tolerance, mode, problem);
    if (ok && exchange) {
        exchange_begin(sim);
    }
    return attempt(sim, ok, problem);
}

/* Compute y and e of the present state. */
static bool load_present(Simulation *sim, Problem *problem) {
    const System *system = system_of(sim);
    Present *present = &sim->present;
    if (sim->state.mode.exchange) {
        copy(state_size(sim), sim->state.front, present->y);
        directions(system, present->y, present->e);
        return true;
    }
    return arc_state(sim, present->y, present->e, &present->reference, &present->evaluation,
                     sim->scratch, problem);
}

PRBM const double *present_outputs(Simulation *sim, int groups, Problem *problem) {
    bool exchange = sim->state.mode.exchange;
    if (exchange && !exchange_refresh(sim, problem)) {
        return NULL;
    }
    int missing = groups & ~sim->present.fresh;
    if (((missing & PLACES) && !load_present(sim, problem)) ||
        !compute_outputs(sim, missing, !exchange, problem)) {
        return NULL;
    }
    sim->present.fresh |= groups;
    return sim->present.outputs;
}

PRBM bool present_moment(Simulation *sim, Moment *now, Problem *problem) {
    if (sim->state.mode.exchange) {
        return exchange_moment(sim, now, problem);
    }
    return present_outputs(sim, PLACES, problem) &&
           moment_at(sim, sim->present.y, now, problem);
}

static bool get_derivative(Simulation *sim, int k, double *x, Problem *problem) {
    const Mechanism *m = sim->configuration.mechanism;
    int n = m->coordinate_count, count = m->independent_count;
    Moment now;
    if (!present_moment(sim, &now, problem)) {
        return false;
    }
    int contact = k - count - 2, stored = contact % EXCHANGED_STATES;
    int extra = EXTRA_STATES * (contact / EXCHANGED_STATES) + EXTRA_IMPULSE + stored;
    *x = now.rates[k < count     ? n + m->independent[k]
                   : contact < 0 ? 2 * n + k - count
                                 : m->first_extra + extra];
    *x *= k < count ? coordinate_unit(system_of(sim), m->independent[k]) : 1.0;
    return true;
}

static bool get_indicator(Simulation *sim, int k, double *x, Problem *problem) {
    Moment now;
    if (!present_moment(sim, &now, problem)) {
        return false;
    }
    Scratch scratch = sim->scratch;
    double *z = take(&scratch, (size_t)exchange_indicators(sim));
    event_indicators(sim, &now.at, z);
    *x = z[k];
    return true;
}

static bool get_value(Simulation *sim, int slot, double *x, Problem *problem) {
    const Slots *slots = &sim->configuration.mechanism->slots;
    if (slot < slots->inputs) {
        *x = sim->state.values[slot];
        return true;
    }
    if (slot < slots->bodies) {
        *x = sim->state.given[slot - slots->inputs];
        return true;
    }
    if (!sim->state.started) {
        return fail(problem,
                    "it has no value before the model is initialized");
    }
    if (slot >= slots->derivatives && slot < slots->indicators) {
        return get_derivative(sim, slot - slots->derivatives, x, problem);
    }
    if (slot >= slots->indicators && slot < slots->time) {
        return get_indicator(sim, slot - slots->indicators, x, problem);
    }
    const double *outputs = present_outputs(sim, output_groups(sim, slot), problem);
    *x = outputs ? outputs[slot] : 0.0;
    return outputs != NULL;
}

PRBM bool simulation_get(Simulation *simulation, int slot, double *x, Problem *problem) {
    if (!get_value(simulation, slot, x, problem)) {
        return false;
    }
    return finite_number(*x) ||
           fail(problem, "its value at t = %.9g s is %g, because the states or inputs are far from "
                         "every motion of the mechanism",
                simulation->state.time, *x);
}
