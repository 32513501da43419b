/* Directional derivatives of the contacts at compliant stops. */
#include "core/friction.h"
#include "core/gaps.h"
#include "core/vectors.h"
#include "hybrid/access.h"
#include "indicators.h"
#include "tangent_contact.h"

/* The indentation of a stop, its rate, and their changes. */
typedef struct {
    double d, rate, dd, drate;
} Indentation;

static Indentation indentation_at(const Tangent *t, int stop) {
    const Instant *at = t->at;
    Indentation result = {-gap(t->eq, stop, at->time, t->e, at->extra),
                 -gap_rate(t->eq, stop, at->time, t->e, t->v, at->extra), -gap_change(t, stop),
                 -gap_rate_change(t, stop)};
    return result;
}

static const ContactPhase *touching_at(const Tangent *t, int stop) {
    return &t->eq->contacts.touching[stop];
}

static double pressure_change(const Tangent *t, int stop) {
    const ComplianceLaw *law = &t->eq->laws[stop];
    const ContactPhase *touching = touching_at(t, stop);
    Indentation x = indentation_at(t, stop);
    if (touching->phase == PHASE_FREE) {
        return 0.0;
    }
    return contact_stiffness(law, x.d) * damping_ratio(law, touching, x.rate) * x.dd +
           elastic_force(law, x.d) * damping_slope(law, touching) * x.drate;
}

PRBM void pressure_changes(const Tangent *t) {
    const Equations *eq = t->eq;
    Scratch scratch = t->scratch;
    double *row = take(&scratch, (size_t)eq->system->n);
    Rows gaps = gap_rows(eq->system);
    for (int k = 0; k < eq->pressed_count; k++) {
        int i = eq->pressed[k];
        t->dpressure[i] = pressure_change(t, i);
        row_jacobian(&gaps, i, t->e, row);
        add_scaled(eq->system->n, t->dpressure[i], row, t->dx);
        add_pull(t, &gaps, i, t->evaluation->pressure[i]);
    }
}

PRBM double stop_force_change(const Tangent *t, int stop) {
    if (is_pressed(touching_at(t, stop))) {
        return t->dpressure[stop];
    }
    return is_held(&t->eq->contacts, stop) ? stop_force(t->eq, t->dlam, stop) : 0.0;
}

PRBM double contact_loss_change(const Tangent *t, int stop) {
    const ComplianceLaw *law = &t->eq->laws[stop];
    Indentation x = indentation_at(t, stop);
    double damping = t->evaluation->pressure[stop] - elastic_force(law, x.d);
    return (t->dpressure[stop] - contact_stiffness(law, x.d) * x.dd) * x.rate + damping * x.drate;
}

PRBM double contact_energy_change(const Tangent *t) {
    double sum = 0.0;
    for (int i = 0; i < t->eq->system->s; i++) {
        if (touching_at(t, i)->phase != PHASE_NONE) {
            Indentation x = indentation_at(t, i);
            sum += elastic_force(&t->eq->laws[i], x.d) * x.dd;
        }
    }
    return sum;
}

PRBM void contact_changes(const Tangent *t, const double *dx, double *out) {
    const Mechanism *m = t->eq->system->mechanism;
    int first = 2 * m->independent_count + 2;
    double *rates = out + m->slots.derivatives + m->independent_count + 2;
    for (int i = 0; i < m->stop_count; i++) {
        if (m->stops[i].compliant) {
            int k = EXCHANGED_STATES * (m->stops[i].extra / EXTRA_STATES);
            bool pressed = is_pressed(touching_at(t, i));
            out[exchange_slot(t->sim, first + k)] = dx[first + k];
            out[exchange_slot(t->sim, first + k + 1)] = dx[first + k + 1];
            rates[k] = stop_force_change(t, i);
            rates[k + 1] = pressed ? contact_loss_change(t, i) : 0.0;
        }
    }
    for (int k = 0; k < t->eq->pressed_count; k++) {
        int i = t->eq->pressed[k];
        out[m->slots.stops + PER_STOP * i + STOP_FORCE] = t->dpressure[i];
    }
}

PRBM double separation_indicator_change(const Tangent *t, int stop) {
    const Scales *scales = &t->sim->configuration.scales;
    Indentation x = indentation_at(t, stop);
    double ahead = x.rate > 0.0 ? INDICATOR_LEAD_RTOL * scales->time * x.drate : 0.0;
    return (x.dd + ahead) / scales->length;
}

/* Change of the second derivative of the indentation. */
static double bend_change_of(const Tangent *t, int stop) {
    const System *system = t->eq->system;
    Scratch scratch = t->scratch;
    double *row = take(&scratch, (size_t)system->n);
    Rows gaps = gap_rows(system);
    row_jacobian(&gaps, stop, t->e, row);
    double change = dot(system->n, row, t->dx) + second_change(t, &gaps, stop) +
                    t->eq->inputs.mobilities[stop] * t->dpressure[stop];
    return -change;
}

/* Change of the indicator of an extremum, without its sign. */
static double turn_change(const Tangent *t, int stop, const Indentation *x, bool of_force) {
    const ComplianceLaw *law = &t->eq->laws[stop];
    const ContactPhase *touching = touching_at(t, stop);
    const Instant *at = t->at;
    if (!of_force) {
        return x->drate / touching->reference_speed;
    }
    double slope = damping_slope(law, touching), ratio = damping_ratio(law, touching, x->rate);
    double bend = -gap_acceleration(t->eq, stop, at->time, t->e, t->v, t->evaluation);
    return (law->exponent * (ratio + x->rate * slope) * x->drate +
            slope * (x->dd * bend + x->d * bend_change_of(t, stop))) /
           touching->reference_speed;
}

static double phase_indicator_change(const Tangent *t, int stop) {
    const Scales *scales = &t->sim->configuration.scales;
    const ComplianceLaw *law = &t->eq->laws[stop];
    const ContactPhase *touching = touching_at(t, stop);
    Indentation x = indentation_at(t, stop);
    double slope = damping_slope(law, touching), ratio = damping_ratio(law, touching, x.rate);
    switch (touching->phase) {
    case PHASE_RISING:
        return bend_change_of(t, stop) / (scales->length * (scales->rate * scales->rate));
    case PHASE_FREE: return -slope * x.drate;
    default:
        return ratio < 1.0 - x.rate / touching->reference_speed
                   ? slope * x.drate
                   : -x.drate / touching->reference_speed;
    }
}

PRBM double switch_indicator_change(const Tangent *t, int stop) {
    double phase = lifted_guard(t->sim, t->at, EVENT_SWITCH, stop);
    Turn turn = turn_indicator(t->sim, t->at, stop);
    if (phase <= turn.value) {
        return phase_indicator_change(t, stop);
    }
    Indentation x = indentation_at(t, stop);
    return turn.sign == 0.0 ? 0.0 : turn.sign * turn_change(t, stop, &x, turn.of_force);
}
