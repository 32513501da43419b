/* Phases of springs that act on one side, their changes and first values: the twin of
 * hybrid/spring_phases.py, whose guards are in spring_guards.c. */
#include <math.h>

#include "core/elements.h"
#include "hybrid/access.h"
#include "hybrid/spring_phases.h"

/* The strain of a spring at the front, its rate and its force. */
typedef struct {
    double strain, rate;
    CoilPull pull;
} Strained;

static Strained strained_at(Simulation *sim, int k) {
    Scratch scratch = sim->scratch;
    const System *system = system_of(sim);
    const double *v = sim->state.front + system->n;
    Complex *e = directions_at(sim, sim->state.front, &scratch);
    return (Strained){strain_of(system, k, e), strain_rate_of(system, k, e, v),
                      coil_pull(system, k, e, v)};
}

static void set_coil(Simulation *sim, int k, SpringPhase phase) {
    if (sim->state.coils[k] != phase) {
        sim->state.coils[k] = phase;
        sim->state.has_k1 = false;
        set_inputs(sim);
    }
}

/* The force of a lagging spring is that of the damper where it is slack, and zero where it acts again.
 * The time of the event is not exact: the force that is nearer counts. */
PRBM void switch_coil(Simulation *sim, int contact) {
    int k = contact - contact_count(sim);
    Strained now = strained_at(sim, k);
    double damping = system_of(sim)->laws[k].damping;
    SpringPhase last = sim->state.coils[k], phase = COIL_ACTING;
    if (last == COIL_ACTING) {
        bool lags = damping > 0.0 && now.strain > 0.0;
        phase = lags ? COIL_LAGGING : COIL_SLACK;
    } else if (last == COIL_LAGGING && now.pull.force < 0.5 * damping * now.rate) {
        phase = COIL_SLACK;
    }
    set_coil(sim, k, phase);
}

PRBM void rephase_coils(Simulation *sim, int switched) {
    for (int k = 0; k < phased_coils(sim->configuration.mechanism); k++) {
        const SpringLaw *law = &system_of(sim)->laws[k];
        bool kept = k == switched - contact_count(sim) || sim->state.coils[k] == COIL_SLACK;
        if (law->side == 0 || !(law->damping > 0.0) || kept) {
            continue;
        }
        CoilPull pull = strained_at(sim, k).pull;
        if (fabs(pull.force) > pull.rounding) {
            set_coil(sim, k, pull.force < 0.0 ? COIL_LAGGING : COIL_ACTING);
        }
    }
}

PRBM bool begin_coils(Simulation *sim) {
    const System *system = system_of(sim);
    double near = coil_near(system), slow = coil_slow(system, sim->state.front + system->n);
    for (int k = 0; k < phased_coils(sim->configuration.mechanism); k++) {
        Strained now = strained_at(sim, k);
        bool slack = now.strain < -near || (now.strain <= near && now.rate < -slow);
        set_coil(sim, k, system_of(sim)->laws[k].side != 0 && slack ? COIL_SLACK : COIL_ACTING);
    }
    rephase_coils(sim, -1);
    return true;
}
