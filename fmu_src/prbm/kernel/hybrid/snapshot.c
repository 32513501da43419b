/* The state as numbers, to save and restore it: the twin of hybrid/snapshot.py. */
#include <math.h>
#include <string.h>

#include "hybrid/access.h"
#include "hybrid/arc.h"
#include "hybrid/configuration.h"
#include "hybrid/snapshot.h"

/* Numbers of a simulation, of a stop, and further ones of a compliant stop. */
enum { SCALARS = 26, PER_STOP_STATE = 16, PER_CONTACT_STATE = 13 };

PRBM size_t simulation_state_count(const Simulation *simulation) {
    const Mechanism *m = simulation->configuration.mechanism;
    return SCALARS + PER_STOP_STATE * (size_t)m->stop_count + 2 * (size_t)m->rubbing_count +
           PER_CONTACT_STATE * (size_t)m->compliant_count + (size_t)phased_coils(m) +
           simulation->state.number_count;
}

/* --- to numbers ------------------------------------------------------------------------------- */

static double *put_stop(const State *state, int i, double *to) {
    const Latched *last = &state->latched[i];
    const Wall *wall = &state->walls[i];
    const double stop[PER_STOP_STATE] = {
        state->modes[i],      state->driven[i],    wall->position,
        wall->rate,           wall->since,         wall->offset,
        wall->excess,         wall->span,          last->count,
        last->time,           last->approach_speed, last->rebound_speed,
        last->impulse,        last->energy_lost,   last->modal_restitution,
        last->impulse_sum,
    };
    memcpy(to, stop, sizeof stop);
    return to + PER_STOP_STATE;
}

static double *put_contact(const State *state, int i, double *to) {
    const Latched *last = &state->latched[i];
    const ContactPhase *touching = &state->touching[i];
    const ContactStart *begun = &state->touches[i];
    const double contact[PER_CONTACT_STATE] = {
        last->peak_force, last->indentation,         last->contact_duration,
        touching->phase,  touching->reference_speed, touching->depth,
        begun->time,      begun->counted,            begun->impulse,
        begun->loss,      begun->calm,               begun->calm_since,
        begun->step,
    };
    memcpy(to, contact, sizeof contact);
    return to + PER_CONTACT_STATE;
}

PRBM void simulation_save(const Simulation *simulation, double *to) {
    const State *state = &simulation->state;
    const Mechanism *m = simulation->configuration.mechanism;
    const double scalars[SCALARS] = {
        state->started,      state->mode.exchange,  state->has_k1,       state->arc.valid,
        state->interrupted,  state->pending.kind,   state->pending.contact, state->window_count,
        state->pending.time, state->time,           state->tolerance,    state->frequency,
        state->step_size,    state->log_of_error,   state->front_time,   state->arc.start,
        state->arc.h,        state->window_since,   state->point,        state->longest,
        state->mode.lowest_bounce, state->angle,     state->energy,         state->fastest_rate,
        state->arc.before.time, state->fastest_decay,
    };
    memcpy(to, scalars, sizeof scalars);
    to += SCALARS;
    for (int i = 0; i < m->stop_count; i++) {
        to = put_stop(state, i, to);
        to = m->stops[i].compliant ? put_contact(state, i, to) : to;
    }
    for (int i = 0; i < m->rubbing_count; i++) {
        *to++ = state->modes[m->stop_count + i];
        *to++ = state->sides[i];
    }
    for (int k = 0; k < phased_coils(m); k++) {
        *to++ = state->coils[k];
    }
    memcpy(to, state->numbers, state->number_count * sizeof *to);
}

/* --- from numbers ----------------------------------------------------------------------------- */

/* The next number to read, and whether all numbers read so far are valid. */
typedef struct {
    const double *at;
    bool sound;
} StateReader;

static double get_number(StateReader *reader) {
    double x = *reader->at++;
    reader->sound = reader->sound && finite_number(x);
    return x;
}

static int get_integer(StateReader *reader, int low, int high) {
    double x = *reader->at++;
    bool whole = x >= low && x <= high && x == floor(x);
    reader->sound = reader->sound && whole;
    return whole ? (int)x : low;
}

static bool get_flag(StateReader *reader) {
    return get_integer(reader, 0, 1) == 1;
}

static void get_scalars(State *state, StateReader *reader) {
    state->started = get_flag(reader);
    state->mode.exchange = get_flag(reader);
    state->has_k1 = get_flag(reader);
    state->arc.valid = get_flag(reader);
    state->interrupted = get_flag(reader);
    state->pending.kind = (EventKind)get_integer(reader, EVENT_NONE, EVENT_KINDS - 1);
    state->pending.contact = get_integer(reader, 0, 2 * STOPS_MAX + PLACES_MAX);
    state->window_count = get_integer(reader, 0, EVENTS_MAX);
    state->pending.time = get_number(reader);
    state->time = get_number(reader);
    state->tolerance = get_number(reader);
    state->frequency = get_number(reader);
    state->step_size = get_number(reader);
    state->log_of_error = get_number(reader);
    state->front_time = get_number(reader);
    state->arc.start = get_number(reader);
    state->arc.h = get_number(reader);
    state->window_since = get_number(reader);
    state->point = get_number(reader);
    state->longest = get_number(reader);
    state->mode.lowest_bounce = get_number(reader);
    state->angle = get_number(reader);
    state->energy = get_number(reader);
    state->fastest_rate = get_number(reader);
    state->arc.before.time = get_number(reader);
    state->fastest_decay = get_number(reader);
}

static void get_contact(State *state, int i, StateReader *reader) {
    Latched *last = &state->latched[i];
    ContactPhase *touching = &state->touching[i];
    ContactStart *begun = &state->touches[i];
    last->peak_force = get_number(reader);
    last->indentation = get_number(reader);
    last->contact_duration = get_number(reader);
    touching->phase = (Phase)get_integer(reader, PHASE_NONE, PHASE_FROZEN);
    touching->reference_speed = get_number(reader);
    touching->depth = get_number(reader);
    begun->time = get_number(reader);
    begun->counted = get_flag(reader);
    begun->impulse = get_number(reader);
    begun->loss = get_number(reader);
    begun->calm = get_flag(reader);
    begun->calm_since = get_number(reader);
    begun->step = get_number(reader);
}

static void get_stop(State *state, int i, StateReader *reader) {
    Latched *last = &state->latched[i];
    Wall *wall = &state->walls[i];
    state->modes[i] = (ContactMode)get_integer(reader, CONTACT_OPEN, CONTACT_SLIP_NEGATIVE);
    state->driven[i] = get_flag(reader);
    wall->position = get_number(reader);
    wall->rate = get_number(reader);
    wall->since = get_number(reader);
    wall->offset = get_number(reader);
    wall->excess = get_number(reader);
    wall->span = get_number(reader);
    last->count = get_integer(reader, 0, IMPACT_COUNT_MAX);
    last->time = get_number(reader);
    last->approach_speed = get_number(reader);
    last->rebound_speed = get_number(reader);
    last->impulse = get_number(reader);
    last->energy_lost = get_number(reader);
    last->modal_restitution = get_number(reader);
    last->impulse_sum = get_number(reader);
}

/* Read the state; return whether its numbers are valid. */
static bool read_state(Simulation *sim, const double *from) {
    State *state = &sim->state;
    const Mechanism *m = sim->configuration.mechanism;
    StateReader reader = {from, true};
    get_scalars(state, &reader);
    for (int i = 0; i < m->stop_count; i++) {
        get_stop(state, i, &reader);
        if (m->stops[i].compliant) {
            get_contact(state, i, &reader);
        }
    }
    for (int i = 0; i < m->rubbing_count; i++) {
        state->modes[m->stop_count + i] =
            (ContactMode)get_integer(&reader, CONTACT_FRICTIONLESS, CONTACT_SLIP_NEGATIVE);
        state->sides[i] = get_integer(&reader, i < m->friction_count ? 1 : -1, 1);
        reader.sound = reader.sound && state->sides[i] != 0;
    }
    for (int k = 0; k < phased_coils(m); k++) {
        bool one_sided = m->coils[k].side != 0;
        state->coils[k] = (SpringPhase)get_integer(&reader, one_sided ? COIL_SLACK : COIL_ACTING,
                                                   one_sided ? COIL_LAGGING : COIL_ACTING);
    }
    for (size_t i = 0; i < state->number_count; i++) {
        state->numbers[i] = get_number(&reader);
    }
    return reader.sound;
}

/* Whether the numbers of a state agree with each other and with the mechanism. */
static bool consistent(const Simulation *sim) {
    const State *state = &sim->state;
    const Mechanism *m = sim->configuration.mechanism;
    EventKind kind = state->pending.kind;
    bool friction = kind == EVENT_SLIP || kind == EVENT_REVERSAL || kind == EVENT_SIDE;
    ContactRange range = contacts_of(sim, kind);
    int first = kind == EVENT_SIDE ? m->stop_count + m->friction_count : range.first;
    int end = friction || kind == EVENT_ACTION ? range.end : m->stop_count;
    int contact = state->pending.contact;
    if (state->step_size < 0.0 || (kind != EVENT_NONE && (contact < first || contact >= end))) {
        return false;
    }
    return !state->started ||
           (state->tolerance >= TOLERANCE_MIN && state->tolerance <= TOLERANCE_USED_MAX &&
            state->frequency >= 0.0 && state->fastest_rate >= 0.0 &&
            state->fastest_decay >= 0.0 &&
            (!state->arc.valid ||
             (state->arc.h > 0.0 && state->arc.before.time <= state->arc.start)) &&
            state->front_time >= state->time &&
            (!state->mode.exchange ||
             (state->angle >= NOMINAL_ANGLE_MIN && state->energy > 0.0)));
}

/* --- attempts --------------------------------------------------------------------------------- */

/* Compute the configuration and the equations from a state that has been read. */
static bool rebuild(Simulation *sim, Problem *problem) {
    Configuration *configuration = &sim->configuration;
    forget_arc(sim);
    if (!sim->state.started) {
        return true;
    }
    configuration->assembled = assemble(&configuration->system, sim->state.acting_values,
                                        sim->scratch, problem);
    bool ok = configuration->assembled &&
              set_scales(configuration, sim->state.frequency, sim->scratch, problem);
    set_inputs(sim);
    return ok;
}

PRBM void keep_backup(Simulation *sim) {
    simulation_save(sim, sim->backup);
}

PRBM bool attempt(Simulation *sim, bool ok, Problem *problem) {
    if (sim->block.exceeded) {
        ok = fail(problem, "the working memory of the simulation is too small; report this");
        sim->block.exceeded = false;
    }
    if (!ok) {
        Problem ignored;
        (void)read_state(sim, sim->backup);
        forget_present(sim);
        (void)rebuild(sim, &ignored);
    }
    return ok;
}

PRBM bool simulation_restore(Simulation *simulation, const double *state, Problem *problem) {
    Simulation *sim = simulation;
    const Mechanism *m = sim->configuration.mechanism;
    Problem ignored;
    keep_backup(sim);
    bool ok = read_state(sim, state) && consistent(sim) &&
              check_values(m, sim->state.values, &ignored) &&
              (!sim->state.started || check_values(m, sim->state.acting_values, &ignored)) &&
              rebuild(sim, &ignored);
    forget_present(sim);
    if (!ok) {
        fail(problem, "the saved state is damaged: its numbers are not a state of this mechanism");
    }
    return attempt(sim, ok, problem);
}
