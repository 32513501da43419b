/* Directional derivatives of the event indicators. */
#include "core/friction.h"
#include "core/gaps.h"
#include "hybrid/access.h"
#include "hybrid/events.h"
#include "indicators.h"
#include "tangent_contact.h"
#include "tangent_elements.h"
#include "tangent_indicators.h"

/* Change of |x|; at zero, the mean of both one-sided derivatives. */
static double sign_times(double x, double change) {
    return x < 0.0 ? -change : x > 0.0 ? change : 0.0;
}

static double impact_indicator_change(const Tangent *t, int i) {
    const Scales *scales = &t->sim->configuration.scales;
    bool opens = gap_rate(t->eq, i, t->at->time, t->e, t->v, t->at->extra) > 0.0;
    double ahead = opens ? INDICATOR_LEAD_RTOL * scales->time * gap_rate_change(t, i) : 0.0;
    return (gap_change(t, i) + ahead) / scales->length;
}

/* Change of the force of a held stop, or of the margin of a frozen one. */
static double margin_change(const Tangent *t, int i) {
    const ContactPhase *touching = &t->eq->contacts.touching[i];
    double change = stop_force(t->eq, t->dlam, i);
    if (touching->phase != PHASE_FROZEN) {
        return change;
    }
    double off = stop_force(t->eq, t->lam, i) - elastic_force(&t->eq->laws[i], touching->depth);
    return -sign_times(off, change);
}

static double release_indicator_change(const Tangent *t, int i) {
    const Simulation *sim = t->sim;
    double force = guard_scale(sim, EVENT_RELEASE), speed = guard_scale(sim, EVENT_REVERSAL);
    double pressed = lifted_guard(sim, t->at, EVENT_RELEASE, i) / force;
    return pressed <= release_indicator(sim, t->at, i)
               ? margin_change(t, i) / force
               : -sign_times(leaving_rate(sim, t->at, i), gap_rate_change(t, i)) / speed;
}

static double slip_indicator_change(const Tangent *t, int contact) {
    const Equations *eq = t->eq;
    int row = eq->first_stick + place_in(eq->sticking, contact);
    double friction = sign_times(t->lam[row], t->dlam[row]), limit;
    if (is_guide(eq->system, contact)) {
        int normal = normal_row(eq, contact);
        limit = friction_coefficient(eq, contact) * sign_times(t->lam[normal], t->dlam[normal]);
    } else if (is_stop(eq->system, contact) && is_held(&eq->contacts, contact)) {
        limit = eq->stop_friction[contact] * stop_force(eq, t->dlam, contact);
    } else {
        limit = limit_change(t, contact);
    }
    return ((1.0 + FRICTION_EXCESS_RTOL) * limit - friction) /
           guard_scale(t->sim, EVENT_SLIP);
}

static double reversal_indicator_change(const Tangent *t, int contact) {
    int i;
    Rows rows = tangential_rows(t->eq->system, contact, &i);
    return sliding_sign(t, contact) * rate_change(t, &rows, i) /
           guard_scale(t->sim, EVENT_REVERSAL);
}

static double action_indicator_change(const Tangent *t, int contact) {
    const Scales *scales = &t->sim->configuration.scales;
    int k = contact - contact_count(t->sim);
    SpringPhase phase = t->eq->contacts.coils[k];
    CoilIndicators now = coil_indicators(t->sim, t->at, contact);
    CoilChange change = coil_change(t, k);
    if (now.force < now.strain) {
        double sign = phase == COIL_LAGGING ? -1.0 : 1.0;
        return sign * change.force / guard_scale(t->sim, EVENT_ACTION);
    }
    double ahead = now.rate > 0.0 ? INDICATOR_LEAD_RTOL * scales->time * change.rate : 0.0;
    return (phase == COIL_SLACK ? -1.0 : 1.0) * (change.strain + ahead) / scales->length;
}

static double indicator_change(const Tangent *t, EventKind kind, int contact) {
    switch (kind) {
    case EVENT_IMPACT: return impact_indicator_change(t, contact);
    case EVENT_RELEASE: return release_indicator_change(t, contact);
    case EVENT_SWITCH: return switch_indicator_change(t, contact);
    case EVENT_SEPARATION: return separation_indicator_change(t, contact);
    case EVENT_ACTION: return action_indicator_change(t, contact);
    case EVENT_SLIP: return slip_indicator_change(t, contact);
    case EVENT_SIDE:
        return side_force(t->eq, t->dlam, contact) / guard_scale(t->sim, EVENT_SIDE);
    default: return reversal_indicator_change(t, contact);
    }
}

PRBM void indicator_changes(const Tangent *t, double *out) {
    for (EventKind kind = EVENT_NONE + 1; kind < EVENT_KINDS; kind++) {
        ContactRange range = contacts_of(t->sim, kind);
        for (int contact = range.first; contact < range.end; contact++) {
            if (transition(kind)->watched(t->eq, contact)) {
                out[indicator_place(t->sim, kind, contact)] = indicator_change(t, kind, contact);
            }
        }
    }
}
