/* The memory of a simulation, and its values: the twin of hybrid/simulation.py. */
#include <stdlib.h>
#include <string.h>

#include "core/placement.h"
#include "hybrid/access.h"
#include "hybrid/release.h"

/* --- memory ----------------------------------------------------------------------------------- */

/* Place the arrays of numbers of the state one after another. */
static void place_numbers(State *state, const Mechanism *m, Memory *memory) {
    size_t n = (size_t)m->coordinate_count, s = (size_t)m->stop_count;
    size_t ny = (size_t)m->state_count;
    size_t np = (size_t)m->parameter_count, nu = (size_t)m->input_count;
    struct {
        double **array;
        size_t count;
    } parts[] = {
        {&state->values, np},        {&state->given, nu},
        {&state->acting_values, np}, {&state->acting_given, nu},
        {&state->received, LOADS * (size_t)m->force_count},
        {&state->front, ny},         {&state->k1, ny},
        {&state->arc.y, ny},         {&state->arc.k, STAGES * ny},
        {&state->arc.before.y, 2 * n}, {&state->arc.before.a, n},
        {&state->first, 3 * n * (size_t)m->compliant_count},
        {&state->dents, DENT_NUMBERS * (size_t)m->compliant_count},
        {&state->fastest, n},
        {&state->peaks, PEAK_NUMBERS * (size_t)m->stressed_count},
        {&state->floors, s},         {&state->accepted, n},
        {&state->states, 2 * (size_t)m->independent_count + 2 +
                             EXCHANGED_STATES * (size_t)m->compliant_count},
    };
    state->number_count = 0;
    for (size_t i = 0; i < sizeof parts / sizeof *parts; i++) {
        state->number_count += parts[i].count;
    }
    state->numbers = place(memory, state->number_count, sizeof(double));
    double *next_part = state->numbers;
    for (size_t i = 0; memory->base && i < sizeof parts / sizeof *parts; i++) {
        *parts[i].array = next_part;
        next_part += parts[i].count;
    }
}

static void place_state(State *state, const Mechanism *m, Memory *memory) {
    size_t s = (size_t)m->stop_count;
    place_numbers(state, m, memory);
    state->modes = place(memory, s + (size_t)m->rubbing_count, sizeof *state->modes);
    state->sides = place(memory, (size_t)m->rubbing_count, sizeof *state->sides);
    state->driven = place(memory, s, sizeof(bool));
    state->touching = place(memory, s, sizeof(ContactPhase));
    state->coils = place(memory, (size_t)phased_coils(m), sizeof(SpringPhase));
    state->touches = place(memory, s, sizeof(ContactStart));
    state->latched = place(memory, s, sizeof(Latched));
    state->walls = place(memory, s, sizeof(Wall));
}

static void place_scratch(ScratchBlock *block, const Mechanism *m, Memory *memory) {
    size_t d = (size_t)m->direction_count, s = (size_t)m->stop_count; /* d is at least n. */
    size_t size = d + (size_t)m->loop_count + 2 * s + (size_t)m->rubbing_count + 2;
    size += (size_t)m->given_count; /* Rows that hold bodies at the start. */
    size_t drawn = (size_t)m->ground_count + (size_t)m->body_count, pieces = (size_t)m->longest;
    for (int i = 0; i < m->type_count; i++) {
        size_t pivots = (size_t)m->types[i].pivots;
        pieces = pivots > pieces ? pivots : pieces;
    }
    /* The number of unknowns of a complementarity problem of all contacts. */
    size_t forces = 4 * s + 4 * (size_t)m->rubbing_count, pivots_size = forces * (2 * forces + 2);
    size_t single =
        size * size + 4 * size + 2 * drawn + 4 * pieces + 16 + pivots_size + m->beam_size;
    block->size = 12 * size * size + 60 * size + 2 * drawn + 16 * pieces + 64 + pivots_size +
                  forces * forces + 16 * forces + m->beam_size;
    block->base = place(memory, block->size, sizeof(double));
    block->spare = place(memory, single, sizeof(double));
    block->most = 0;
    block->exceeded = false;
}

static void place_stepping(Stepping *stepping, const System *system, Memory *memory) {
    size_t n = (size_t)system->n, s = (size_t)system->s, d = sizeof(double);
    size_t ny = (size_t)system->mechanism->state_count;
    size_t samples = GUARD_INTERVALS + 1;
    evaluation_place(&stepping->evaluation, system, memory);
    reference_place(&stepping->reference, system, memory);
    stepping->forces.least = place(memory, s, d);
    stepping->forces.largest = place(memory, s, d);
    stepping->end = place(memory, ny, d);
    stepping->error = place(memory, ny, d);
    stepping->coarse_error = place(memory, ny, d);
    stepping->sample_y = place(memory, samples * ny, d);
    stepping->sample_e = place(memory, samples * (size_t)system->d, sizeof(Complex));
    stepping->located.y = place(memory, ny, d);
    stepping->located.e = place(memory, (size_t)system->d, sizeof(Complex));
    evaluation_place(&stepping->located.evaluation, system, memory);
    stepping->located.forces.least = place(memory, s, d);
    stepping->located.forces.largest = place(memory, s, d);
    stepping->located.k = place(memory, STAGES * ny, d);
    stepping->middle.y = place(memory, 2 * n, d);
    stepping->middle.a = place(memory, n, d);
    stepping->reach = place(memory, (size_t)system->d + n, d);
    stepping->torques = place(memory, (size_t)system->even + 2, d);
    stepping->response = place(memory, (size_t)system->even + 2, d);
    stepping->multipliers = place(memory, (size_t)system->r + 2 * s + (size_t)system->f, d);
}

static void place_present(Simulation *sim, const System *system, Memory *memory) {
    size_t d = sizeof(double);
    size_t ny = (size_t)system->mechanism->state_count;
    Present *present = &sim->present;
    present->y = place(memory, ny, d);
    present->e = place(memory, (size_t)system->d, sizeof(Complex));
    present->outputs = place(memory, (size_t)system->mechanism->slots.count, d);
    reference_place(&present->reference, system, memory);
    evaluation_place(&present->evaluation, system, memory);
    present->rates = place(memory, ny, d);
    evaluation_place(&present->rated, system, memory);
}

static void place_all(Simulation *sim, Memory *memory) {
    const Mechanism *m = sim->configuration.mechanism;
    System *system = &sim->configuration.system;
    place_state(&sim->state, m, memory);
    sim->backup = place(memory, simulation_state_count(sim), sizeof(double));
    system_place(system, m, memory);
    sim->configuration.least = place(memory, (size_t)state_size(sim), sizeof(double));
    sim->configuration.share = place(memory, (size_t)state_size(sim), sizeof(double));
    equations_place(&sim->equations, system, memory);
    equations_place(&sim->trial.equations, system, memory);
    sim->trial.contacts.modes = place(memory, (size_t)contact_count(sim),
                                     sizeof(ContactMode));
    sim->trial.contacts.touching = place(memory, (size_t)system->mechanism->stop_count,
                                        sizeof(ContactPhase));
    sim->trial.contacts.sides = place(memory, (size_t)system->f, sizeof(int));
    evaluation_place(&sim->trial.evaluation, system, memory);
    size_t n = (size_t)system->n, at_rest = (size_t)(2 * m->stop_count + m->rubbing_count);
    sim->trial.mobility = place(memory, at_rest * at_rest, sizeof(double));
    sim->struck.q = place(memory, n, sizeof(double));
    sim->struck.v = place(memory, n, sizeof(double));
    sim->struck.after = place(memory, n, sizeof(double));
    sim->struck.soft = place(memory, n, sizeof(double));
    sim->previous = place(memory, (size_t)m->state_count, sizeof(double));
    place_stepping(&sim->stepping, system, memory);
    place_present(sim, system, memory);
    contact_problem_place(&sim->contact_problem, system, memory);
    evaluation_place(&sim->at_front, system, memory);
    correction_place(&sim->correction, system, memory);
    place_scratch(&sim->block, m, memory);
    sim->scratch.block = &sim->block;
    sim->scratch.used = 0;
    sim->forces = place(memory, LOADS * (size_t)m->force_count, sizeof(double));
}

PRBM Simulation *simulation_open(const Mechanism *mechanism) {
    Simulation counted = {0};
    counted.configuration.mechanism = mechanism;
    Memory memory = {NULL, 0};
    place(&memory, 1, sizeof(Simulation));
    place_all(&counted, &memory);
    size_t bytes = memory.used;
    memory.base = bytes < SIZE_MAX ? calloc(1, bytes) : NULL;
    memory.used = 0;
    if (!memory.base) {
        return NULL;
    }
    Simulation *sim = place(&memory, 1, sizeof(Simulation));
    sim->configuration.mechanism = mechanism;
    sim->bytes = bytes;
    place_all(sim, &memory);
    for (int i = 0; i <= GUARD_INTERVALS; i++) {
        weights((double)i / (double)GUARD_INTERVALS, sim->stepping.weights[i]);
    }
    simulation_reset(sim);
    return sim;
}

PRBM void simulation_close(Simulation *simulation) {
    free(simulation);
}

PRBM void simulation_listen(Simulation *simulation, ImpactListener *on_impact, void *listener) {
    simulation->on_impact = on_impact;
    simulation->listener = listener;
}

PRBM void simulation_observe(Simulation *simulation, EventObserver *observe, void *observer) {
    simulation->observe = observe;
    simulation->observer = observer;
}

PRBM const Mechanism *simulation_mechanism(const Simulation *simulation) {
    return simulation->configuration.mechanism;
}

PRBM size_t simulation_bytes(const Simulation *simulation) {
    return simulation->bytes;
}

PRBM void simulation_unstart(Simulation *simulation) {
    simulation->state.started = false;
    forget_present(simulation);
}

PRBM bool simulation_started(const Simulation *simulation) {
    return simulation->state.started;
}

PRBM double simulation_time(const Simulation *simulation) {
    return simulation->state.time;
}

PRBM double simulation_steps(const Simulation *simulation) {
    return simulation->steps;
}

/* --- parameters and inputs -------------------------------------------------------------------- */

PRBM void simulation_reset(Simulation *simulation) {
    Simulation *sim = simulation;
    const Mechanism *m = sim->configuration.mechanism;
    clear_progress(&sim->state, 0.0);
    clear_stops(sim);
    memset(sim->state.numbers, 0, sim->state.number_count * sizeof *sim->state.numbers);
    for (int i = 0; i < m->parameter_count; i++) {
        sim->state.values[i] = m->parameters[i].start;
    }
    for (int i = 0; i < m->input_count; i++) {
        sim->state.given[i] = m->input_starts[i];
    }
    forget_present(sim);
}

static bool set_parameter(Simulation *sim, int slot, double x, Problem *problem) {
    const Parameter *parameter = &sim->configuration.mechanism->parameters[slot];
    if (!check_parameter(parameter, x, problem)) {
        return false;
    }
    if (sim->state.started && !parameter->tunable && x != sim->state.values[slot]) {
        return fail(problem, "%s is a fixed parameter; set it before the motion starts",
                    parameter->name);
    }
    sim->state.values[slot] = x;
    return true;
}

static bool set_input(Simulation *sim, int i, double x, Problem *problem) {
    const Mechanism *m = sim->configuration.mechanism;
    if (i < 0 || i >= m->input_count) {
        return fail(problem, "a computed value cannot be set; only parameters and inputs can");
    }
    if (!finite_number(x)) {
        return fail(problem, "%s = %g must be a finite number", m->input_names[i], x);
    }
    bool mobile_wall = i >= m->input.mobilities && i < m->input.base;
    if (mobile_wall && x > WALL_MOBILITY_MAX) {
        return fail(problem, "%s = %g 1/kg must be at most %g 1/kg", m->input_names[i], x,
                    WALL_MOBILITY_MAX);
    }
    if (mobile_wall && x < 0.0) {
        return fail(problem,
                    "%s = %g 1/kg must not be negative: it is the inverse effective mass of "
                    "the wall, 0 for a wall that does not move when it is hit",
                    m->input_names[i], x);
    }
    sim->state.given[i] = x;
    /* In model exchange, a set stop.velocity contains the change by the impulses. */
    int wall = i - m->input.walls;
    bool velocity = wall >= 0 && i < m->input.impulses && wall % PER_WALL == PER_WALL - 1;
    if (sim->state.mode.exchange && velocity) {
        sim->state.walls[wall / PER_WALL].excess = 0.0;
    }
    return true;
}

PRBM bool simulation_set(Simulation *simulation, int slot, double x, Problem *problem) {
    Simulation *sim = simulation;
    const Mechanism *m = sim->configuration.mechanism;
    bool ok = slot < m->parameter_count ? set_parameter(sim, slot, x, problem)
                                        : set_input(sim, slot - m->slots.inputs, x, problem);
    forget_present(sim);
    return ok;
}
