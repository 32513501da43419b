/* Phases of the contacts at compliant stops. */
#include "core/gaps.h"
#include "hybrid/access.h"
#include "hybrid/phases.h"

PRBM void set_phase(Simulation *sim, int stop, Phase phase, double speed, double depth) {
    ContactPhase touching = {phase, speed, depth}, *now = &sim->state.touching[stop];
    ContactMode *mode = &sim->state.modes[stop];
    if (*mode != CONTACT_OPEN && now->phase == phase && now->reference_speed == speed &&
        now->depth == depth) {
        return;
    }
    *now = touching;
    if (phase == PHASE_NONE) {
        *mode = CONTACT_OPEN;
    } else if (phase == PHASE_FREE || *mode == CONTACT_OPEN) {
        *mode = CONTACT_FRICTIONLESS;
    }
    sim->state.has_k1 = false;
    set_inputs(sim);
}

PRBM bool indentation_acceleration(Simulation *sim, int stop, double *result,
                                     Problem *problem) {
    Scratch scratch = sim->scratch;
    const double *q = sim->state.front, *v = q + system_of(sim)->n;
    double t = sim->state.front_time;
    bool ok = evaluate_equations(&sim->equations, t, q, v, extra_states(sim, q), NULL,
                                 &sim->at_front, problem);
    *result = ok ? -gap_acceleration(&sim->equations, stop, t, directions_at(sim, q, &scratch), v,
                                     &sim->at_front)
                 : 0.0;
    return ok;
}

static bool rephase_one(Simulation *sim, int stop, double rate, Problem *problem) {
    ContactPhase touching = sim->state.touching[stop];
    double speed = greater(touching.reference_speed, rate), acceleration = 0.0;
    set_phase(sim, stop, PHASE_PRESSED, speed, 0.0);
    if (rate >= touching.reference_speed) {
        set_phase(sim, stop, PHASE_RISING, speed, 0.0);
        if (!indentation_acceleration(sim, stop, &acceleration, problem)) {
            return false;
        }
        if (!(acceleration > 0.0)) {
            set_phase(sim, stop, PHASE_PRESSED, speed, 0.0);
        }
    } else if (damping_ratio(&sim->equations.laws[stop], &sim->state.touching[stop], rate) < 0.0) {
        set_phase(sim, stop, PHASE_FREE, speed, 0.0);
    }
    return true;
}

PRBM bool rephase(Simulation *sim, Problem *problem) {
    double gaps[STOPS_MAX], rates[STOPS_MAX];
    bool ok = true;
    if (sim->equations.pressed_count == 0) {
        return true;
    }
    gaps_and_rates(sim, gaps, rates);
    for (int i = 0; ok && i < system_of(sim)->s; i++) {
        if (is_pressed(&sim->state.touching[i])) {
            ok = rephase_one(sim, i, -rates[i], problem);
        }
    }
    return ok;
}

PRBM void unfreeze(Simulation *sim) {
    for (int i = 0; i < system_of(sim)->s; i++) {
        const ContactPhase *touching = &sim->state.touching[i];
        if (touching->phase == PHASE_FROZEN) {
            set_phase(sim, i, PHASE_PRESSED, touching->reference_speed, 0.0);
        }
    }
}

PRBM bool press_released(Simulation *sim) {
    bool any = false;
    for (int i = 0; i < system_of(sim)->s; i++) {
        ContactPhase *touching = &sim->state.touching[i];
        if (touching->phase == PHASE_FROZEN && sim->state.modes[i] == CONTACT_OPEN) {
            set_phase(sim, i, PHASE_PRESSED, touching->reference_speed, 0.0);
            any = true;
        }
    }
    return any;
}
