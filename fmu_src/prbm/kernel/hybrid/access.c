/* Access to the parts of a simulation: its system, front, contacts and inputs. */
#include <string.h>

#include "core/gaps.h"
#include "hybrid/access.h"

PRBM const System *system_of(const Simulation *sim) {
    return &sim->configuration.system;
}

PRBM int state_size(const Simulation *sim) {
    return sim->configuration.mechanism->state_count;
}

PRBM const double *extra_states(const Simulation *sim, const double *y) {
    const Mechanism *m = sim->configuration.mechanism;
    return m->compliant_count > 0 ? y + m->first_extra : NULL;
}

PRBM int contact_count(const Simulation *sim) {
    const Mechanism *m = sim->configuration.mechanism;
    return m->stop_count + m->rubbing_count;
}

PRBM ContactRange contacts_of(const Simulation *sim, EventKind kind) {
    int contacts = contact_count(sim);
    ContactRange every = {0, contacts};
    ContactRange coils = {contacts, contacts + phased_coils(sim->configuration.mechanism)};
    return kind == EVENT_ACTION ? coils : every;
}

PRBM ContactProblem *contact_problem_at(Simulation *sim, const double *q, Scratch scratch) {
    set_position(&sim->contact_problem, q, scratch);
    return &sim->contact_problem;
}

PRBM Complex *directions_at(const Simulation *sim, const double *q, Scratch *scratch) {
    Complex *e = take_complex(scratch, system_of(sim)->d, 1);
    directions(system_of(sim), q, e);
    return e;
}

PRBM double pass_point(Simulation *sim, double time) {
    State *state = &sim->state;
    double last = state->time - state->point, following = time - state->time;
    double H = greater(last > 0.0 ? last : following, state->longest - WALL_FADING_FACTOR * last);
    state->longest = lesser(H, WALL_LONGEST_RTOL * sim->configuration.scales.time);
    state->point = state->time;
    return H;
}

PRBM void set_inputs(Simulation *sim) {
    const Mechanism *m = sim->configuration.mechanism;
    const double *given = sim->state.acting_given, *base = given + m->input.base;
    Inputs inputs = {sim->forces, {base[0], base[1]}, sim->state.walls,
                     given + m->input.mobilities};
    ContactState contacts = {sim->state.modes, sim->state.touching, sim->state.sides,
                             sim->state.coils};
    copy(LOADS * m->force_count, given, sim->forces);
    set_equations(&sim->equations, &inputs, &contacts, sim->configuration.omega);
    forget_outputs(sim);
}

PRBM void set_contacts(Simulation *sim, const ContactMode *modes) {
    memmove(sim->state.modes, modes, (size_t)contact_count(sim) * sizeof *modes);
    sim->state.has_k1 = false;
    set_inputs(sim);
}

PRBM void set_mode(Simulation *sim, int contact, ContactMode mode) {
    sim->state.modes[contact] = mode;
    set_contacts(sim, sim->state.modes);
}

PRBM void forget_present(Simulation *sim) {
    sim->present.fresh = NOTHING;
    sim->untouched = false;
}

PRBM void forget_outputs(Simulation *sim) {
    sim->present.fresh &= FRONT;
}

PRBM void gaps_and_rates(Simulation *sim, double *gaps, double *rates) {
    Scratch scratch = sim->scratch;
    double *front = sim->state.front, t = sim->state.front_time;
    const double *extra = extra_states(sim, front);
    Complex *e = directions_at(sim, front, &scratch);
    for (int i = 0; i < system_of(sim)->s; i++) {
        gaps[i] = gap(&sim->equations, i, t, e, extra);
        rates[i] = gap_rate(&sim->equations, i, t, e, front + system_of(sim)->n, extra);
    }
}

PRBM const Stop *stop_of(const Simulation *sim, int stop) {
    return &sim->configuration.mechanism->stops[stop];
}

PRBM double *extra_of(const Simulation *sim, double *y, int stop) {
    return y + sim->configuration.mechanism->first_extra + stop_of(sim, stop)->extra;
}

/* Report an impact at angles q, with the rates v before and after. */
PRBM void report_impact(const Simulation *sim, int i, const double *q, const double *v,
                          const double *after) {
    const Latched *last = &sim->state.latched[i];
    Impact report = {i,
                     sim->configuration.mechanism->stops[i].name,
                     last->time,
                     last->approach_speed,
                     last->rebound_speed,
                     last->impulse,
                     last->energy_lost,
                     last->modal_restitution,
                     last->impulse_sum,
                     last->peak_force,
                     last->indentation,
                     last->contact_duration,
                     last->count,
                     q,
                     v,
                     after};
    if (sim->on_impact) {
        sim->on_impact(sim->listener, &report);
    }
}
