/* Event indicators of model exchange: the guards of events divided by their scales. */
#include <math.h>

#include "core/gaps.h"
#include "hybrid/access.h"
#include "hybrid/configuration.h"
#include "hybrid/contact_peaks.h"
#include "hybrid/events.h"
#include "hybrid/guards.h"
#include "hybrid/spring_guards.h"
#include "hybrid/walls.h"
#include "indicators.h"

PRBM int exchange_indicators(const Simulation *simulation) {
    const Mechanism *m = simulation->configuration.mechanism;
    return indicator_count(m);
}

/* Slip and reversal share an indicator, because a contact either sticks or slips.  So do impact and
 * separation, and release and switch: a stop is open, pressed or held. */
PRBM int indicator_place(const Simulation *sim, EventKind kind, int contact) {
    static const int PLACE[EVENT_KINDS] = {
        [EVENT_RELEASE] = INDICATOR_RELEASE,
        [EVENT_SLIP] = INDICATOR_SLIP,
        [EVENT_REVERSAL] = INDICATOR_SLIP,
        [EVENT_SWITCH] = INDICATOR_RELEASE,
        [EVENT_SEPARATION] = INDICATOR_IMPACT,
        [EVENT_IMPACT] = INDICATOR_IMPACT,
    };
    const System *system = system_of(sim);
    const Mechanism *m = system->mechanism;
    int s = system->s, points = m->friction_count, slips = STOP_INDICATORS * s + system->f;
    if (kind == EVENT_SIDE) {
        return slips + contact - s - points;
    }
    if (kind == EVENT_ACTION) {
        return slips + system->f - points + m->coils[contact - contact_count(sim)].one_sided;
    }
    return contact < s ? STOP_INDICATORS * contact + PLACE[kind]
                       : STOP_INDICATORS * s + contact - s;
}

/* The scale of the guard of a kind of event. */
PRBM double guard_scale(const Simulation *sim, EventKind kind) {
    const Scales *scales = &sim->configuration.scales;
    switch (kind) {
    case EVENT_IMPACT:
    case EVENT_SEPARATION: return scales->length;
    case EVENT_REVERSAL: return scales->rate * scales->length;
    case EVENT_SWITCH: return 1.0;
    default: return scales->energy / scales->length;
    }
}

/* A guard plus a margin, so that its event occurs when the sum is zero: a gap closes a little below
 * zero, and sliding ends at a speed within round-off. */
PRBM double lifted_guard(const Simulation *sim, const Instant *at, EventKind kind, int contact) {
    if (kind == EVENT_SWITCH && sim->state.touching[contact].phase == PHASE_RISING) {
        const Scales *scales = &sim->configuration.scales;
        return rising_guard(&sim->equations, at, contact) /
               (scales->length * (scales->rate * scales->rate));
    }
    double z = transition(kind)->guard.value(&sim->equations, at, contact);
    if (kind == EVENT_IMPACT || kind == EVENT_SEPARATION) {
        return z + sim->state.floors[contact];
    }
    z += kind == EVENT_SIDE ? zero_force(&sim->configuration) : 0.0;
    return kind == EVENT_REVERSAL ? z + SLIDING_ENDS_FACTOR * zero_speed(&sim->configuration)
                                 : z;
}

/* Compute an indicator that is positive while a gap is open, or while a contact is pressed.  The
 * rate of an opening gap, or of a growing indentation, is added: the indicator is then positive
 * directly after an impact or a touch, when gap and indentation are round-off. */
static double closing_indicator(const Simulation *sim, const Instant *at, EventKind kind, int i) {
    double speed = gap_rate(&sim->equations, i, at->time, at->e, at->v, at->extra);
    speed = kind == EVENT_IMPACT ? speed : -speed;
    double ahead = INDICATOR_LEAD_RTOL * sim->configuration.scales.time * greater(speed, 0.0);
    return (lifted_guard(sim, at, kind, i) + ahead) / guard_scale(sim, kind);
}

/* The rate at which a closed stop leaves its wall. */
PRBM double leaving_rate(const Simulation *sim, const Instant *at, int i) {
    return gap_rate(&sim->equations, i, at->time, at->e, at->v, at->extra);
}

/* Compute an indicator that is positive while a closed stop is pressed and its gap rate is below
 * half of the largest jump at which the stop stays closed.  A change of the wall's velocity changes
 * this gap rate. */
PRBM double release_indicator(const Simulation *sim, const Instant *at, int i) {
    double pressed = lifted_guard(sim, at, EVENT_RELEASE, i) / guard_scale(sim, EVENT_RELEASE);
    double room = REST_JUMP_FACTOR * jump_allowed(sim, i) - fabs(leaving_rate(sim, at, i));
    double steady = room / guard_scale(sim, EVENT_REVERSAL);
    return lesser(pressed, steady);
}

/* The rate of the force F = k d^n (1 + a d'/v0) of a pressed stop, divided by k d^(n-1) v0: a number
 * of the order of 1, also at d = 0. */
static double force_growth(const Equations *eq, const Instant *at, int stop) {
    const ComplianceLaw *law = &eq->laws[stop];
    const ContactPhase *touching = &eq->contacts.touching[stop];
    double depth = -gap(eq, stop, at->time, at->e, at->extra);
    double rate = -gap_rate(eq, stop, at->time, at->e, at->v, at->extra);
    double bend = -gap_acceleration(eq, stop, at->time, at->e, at->v, at->found);
    return (law->exponent * rate * damping_ratio(law, touching, rate) +
            depth * damping_slope(law, touching) * bend) /
           touching->reference_speed;
}

PRBM void watch_turns(Simulation *sim, const Instant *at) {
    const Equations *eq = &sim->equations;
    for (int k = 0; k < eq->pressed_count; k++) {
        int i = eq->pressed[k];
        Dent dent = latest_dent(sim, i);
        double rate = -gap_rate(eq, i, at->time, at->e, at->v, at->extra);
        dent.deepens = rate < 0.0 ? -1.0 : 1.0;
        dent.grows = force_growth(eq, at, i) < 0.0 ? -1.0 : 1.0;
        store_dent(sim, i, &dent);
    }
}

PRBM Turn turn_indicator(const Simulation *sim, const Instant *at, int i) {
    const ContactPhase *touching = &sim->state.touching[i];
    Dent last = latest_dent(sim, i);
    double rate = -gap_rate(&sim->equations, i, at->time, at->e, at->v, at->extra);
    double depth = last.deepens * rate / touching->reference_speed, force = 1.0;
    if (touching->phase != PHASE_FREE) {
        force = last.grows * force_growth(&sim->equations, at, i);
    }
    Turn turn = {lesser(depth, force) + TURN_RTOL, force < depth ? last.grows : last.deepens,
                 force < depth};
    if (last.deepens == 0.0) {
        turn.value = 1.0; /* There has been no event. */
    }
    return turn;
}

static double switch_indicator(const Simulation *sim, const Instant *at, int i) {
    double phase = lifted_guard(sim, at, EVENT_SWITCH, i) / guard_scale(sim, EVENT_SWITCH);
    return lesser(phase, turn_indicator(sim, at, i).value);
}

PRBM CoilIndicators coil_indicators(const Simulation *sim, const Instant *at, int contact) {
    const Equations *eq = &sim->equations;
    const Scales *scales = &sim->configuration.scales;
    CoilGuards guards = coil_guards(eq, contact);
    CoilIndicators found = {1.0, 1.0, 0.0};
    if (guards.strain) {
        double sign = eq->contacts.coils[contact - contact_count(sim)] == COIL_SLACK ? -1.0 : 1.0;
        found.rate = sign * strain_rate_guard(eq, at, contact);
        double ahead = INDICATOR_LEAD_RTOL * scales->time * greater(found.rate, 0.0);
        double x = guards.strain->value(eq, at, contact);
        found.strain = (x + ahead) / scales->length + GAP_CLOSED_RTOL;
    }
    if (guards.force) {
        found.force = guards.force->value(eq, at, contact) / guard_scale(sim, EVENT_ACTION);
    }
    return found;
}

static double indicator(const Simulation *sim, const Instant *at, EventKind kind, int contact) {
    switch (kind) {
    case EVENT_IMPACT:
    case EVENT_SEPARATION: return closing_indicator(sim, at, kind, contact);
    case EVENT_RELEASE: return release_indicator(sim, at, contact);
    case EVENT_SWITCH: return switch_indicator(sim, at, contact);
    case EVENT_ACTION: {
        CoilIndicators coil = coil_indicators(sim, at, contact);
        return lesser(coil.strain, coil.force);
    }
    default: return lifted_guard(sim, at, kind, contact) / guard_scale(sim, kind);
    }
}

/* Compute all indicators at a state.  An indicator whose event is impossible is 1. */
PRBM void event_indicators(const Simulation *sim, const Instant *at, double *z) {
    for (int i = 0; i < exchange_indicators(sim); i++) {
        z[i] = 1.0;
    }
    for (EventKind kind = EVENT_NONE + 1; kind < EVENT_KINDS; kind++) {
        ContactRange range = contacts_of(sim, kind);
        for (int contact = range.first; contact < range.end; contact++) {
            if (transition(kind)->watched(&sim->equations, contact)) {
                z[indicator_place(sim, kind, contact)] = indicator(sim, at, kind, contact);
            }
        }
    }
}
