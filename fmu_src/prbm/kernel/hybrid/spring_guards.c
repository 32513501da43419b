/* Guards of springs that act on one side, and the times at which they begin or cease to act: the
 * twin of the guards of hybrid/spring_phases.py. */
#include <math.h>

#include "core/elements.h"
#include "hybrid/access.h"
#include "hybrid/spring_guards.h"

/* The springs are numbered after the contacts. */
static int coil_of(const Equations *equations, int contact) {
    return contact - equations->system->s - equations->system->f;
}

PRBM double strain_guard(const Equations *equations, const Instant *at, int contact) {
    return strain_of(equations->system, coil_of(equations, contact), at->e);
}

PRBM double strain_rate_guard(const Equations *equations, const Instant *at, int contact) {
    return strain_rate_of(equations->system, coil_of(equations, contact), at->e, at->v);
}

static double slackness_guard(const Equations *equations, const Instant *at, int contact) {
    return -strain_guard(equations, at, contact);
}

static double slackness_rate_guard(const Equations *equations, const Instant *at, int contact) {
    return -strain_rate_guard(equations, at, contact);
}

/* The force with which a damped spring acts, plus its round-off. */
static double pull_guard(const Equations *equations, const Instant *at, int contact) {
    CoilPull x = coil_pull(equations->system, coil_of(equations, contact), at->e, at->v);
    return x.force + x.rounding;
}

/* Minus the force that a lagging spring would have, plus its round-off. */
static double delay_guard(const Equations *equations, const Instant *at, int contact) {
    CoilPull x = coil_pull(equations->system, coil_of(equations, contact), at->e, at->v);
    return x.rounding - x.force;
}

PRBM CoilGuards coil_guards(const Equations *equations, int contact) {
    static const Guard SLACKNESS = {"action", slackness_guard, false, slackness_rate_guard};
    static const Guard STRAIN = {"action", strain_guard, false, strain_rate_guard};
    static const Guard PULL = {"action", pull_guard, false, NULL};
    static const Guard DELAY = {"action", delay_guard, false, NULL};
    int k = coil_of(equations, contact);
    CoilGuards guards = {NULL, NULL};
    switch (equations->contacts.coils[k]) {
    case COIL_SLACK: guards.strain = &SLACKNESS; break;
    case COIL_LAGGING: guards.strain = &STRAIN, guards.force = &DELAY; break;
    default:
        if (equations->system->laws[k].damping > 0.0) {
            guards.force = &PULL;
        } else {
            guards.strain = &STRAIN;
        }
    }
    return guards;
}

/* The least of the guards of a spring in its phase. */
PRBM double action_guard(const Equations *equations, const Instant *at, int contact) {
    CoilGuards guards = coil_guards(equations, contact);
    double strain = guards.strain ? guards.strain->value(equations, at, contact) : HUGE_VAL;
    double force = guards.force ? guards.force->value(equations, at, contact) : HUGE_VAL;
    return lesser(strain, force);
}

PRBM bool one_sided_coil(const Equations *equations, int contact) {
    return equations->system->laws[coil_of(equations, contact)].side != 0;
}

PRBM bool action_near(Simulation *sim) {
    return sim->configuration.mechanism->one_sided_count > 0;
}

PRBM bool action_time(Simulation *sim, const Guard *guard, int contact, Fall *fall,
                      Problem *problem) {
    CoilGuards guards = coil_guards(&sim->equations, contact);
    Fall force = {false, 0.0};
    (void)guard; /* The least of these. */
    if ((guards.force && !sampled_time(sim, guards.force, contact, &force, problem)) ||
        (guards.strain && !closing_time(sim, guards.strain, contact, fall, problem))) {
        return false;
    }
    if (force.found && !(fall->found && fall->time <= force.time)) {
        *fall = force;
    }
    return true;
}
