/* The outputs at the present state: the twin of hybrid/outputs.py. */
#include <string.h>

#include "core/elements.h"
#include "core/gaps.h"
#include "core/sections.h"
#include "hybrid/access.h"
#include "hybrid/configuration.h"
#include "hybrid/contact_peaks.h"
#include "hybrid/outputs.h"
#include "hybrid/peaks.h"

static void output_bodies(const Simulation *sim, double *out) {
    const System *system = system_of(sim);
    const Present *present = &sim->present;
    const double *v = present->y + system->n;
    for (int i = 0; i < system->b; i++) {
        const BodyFrame *frame = &system->bodies[i];
        double *values = out + PER_BODY * i;
        Complex at, speed;
        motion(system, frame, present->e, v, &at, &speed);
        values[BODY_X] = at.re;
        values[BODY_Y] = at.im;
        values[BODY_ANGLE] = present->y[frame->j];
        values[BODY_VX] = speed.re;
        values[BODY_VY] = speed.im;
        values[BODY_OMEGA] = v[frame->j];
    }
}

static void output_probes(const Simulation *sim, double *out) {
    const System *system = system_of(sim);
    const Present *present = &sim->present;
    for (int i = 0; i < system->mechanism->probe_count; i++) {
        double *values = out + PER_PROBE * i;
        Complex at, speed;
        motion(system, &system->probes[i], present->e, present->y + system->n, &at, &speed);
        values[PROBE_X] = at.re;
        values[PROBE_Y] = at.im;
        values[PROBE_VX] = speed.re;
        values[PROBE_VY] = speed.im;
    }
}

static void output_stops(const Simulation *sim, double *out) {
    const System *system = system_of(sim);
    const Complex *e = sim->present.e;
    const double *v = sim->present.y + system->n;
    const double *extra = extra_states(sim, sim->present.y);
    Rows gaps = gap_rows(system);
    for (int i = 0; i < system->s; i++) {
        const Stop *stop = &system->mechanism->stops[i];
        double *values = out + PER_STOP * i;
        WallMotion wall = wall_motion(&sim->state.walls[i], sim->state.time);
        double value = row_value(&gaps, i, e) + gaps.c[i], rate = row_rate(&gaps, i, e, v);
        values[STOP_GAP] = value + wall.x;
        values[STOP_GAP_RATE] = rate + wall.v;
        if (stop->compliant) {
            values[STOP_GAP] += extra[stop->extra + EXTRA_RECOIL];
            values[STOP_GAP_RATE] += extra[stop->extra + EXTRA_RECOIL_RATE];
        }
        values[STOP_POINT_DISPLACEMENT] = -value - field_value(sim, stop->position);
        values[STOP_POINT_VELOCITY] = -rate;
    }
}

NOINLINE void output_compliant(Simulation *sim, double *out, double *latched) {
    for (int i = 0; i < system_of(sim)->s; i++) {
        if (!sim->configuration.mechanism->stops[i].compliant) {
            continue;
        }
        double depth, force;
        peaks_until(sim, i, sim->state.time, &depth, &force);
        out[COMPLIANT_PEAK_FORCE] = force;
        out[COMPLIANT_INDENTATION] = depth;
        out[COMPLIANT_CONTACT_DURATION] = sim->state.latched[i].contact_duration;
        out[COMPLIANT_CONTACT_LOSS] = extra_of(sim, sim->present.y, i)[EXTRA_LOSS];
        out += PER_COMPLIANT;
        latched[PER_LATCHED * i + LATCHED_IMPULSE_SUM] =
            extra_of(sim, sim->present.y, i)[EXTRA_IMPULSE];
    }
}

static void output_latched(const Simulation *sim, double *out) {
    for (int i = 0; i < system_of(sim)->s; i++) {
        const Latched *last = &sim->state.latched[i];
        const double values[PER_LATCHED] = {
            [LATCHED_CONTACT] = sim->state.modes[i] != CONTACT_OPEN,
            [LATCHED_IMPACT_COUNT] = last->count,
            [LATCHED_IMPACT_TIME] = last->time,
            [LATCHED_APPROACH_SPEED] = last->approach_speed,
            [LATCHED_REBOUND_SPEED] = last->rebound_speed,
            [LATCHED_IMPULSE] = last->impulse,
            [LATCHED_ENERGY_LOST] = last->energy_lost,
            [LATCHED_MODAL_RESTITUTION] = last->modal_restitution,
            [LATCHED_IMPULSE_SUM] = last->impulse_sum,
        };
        memcpy(out + PER_LATCHED * i, values, sizeof values);
    }
}

static void output_links(const Simulation *sim, double *links, double *stretches) {
    const System *system = system_of(sim);
    const double *q = sim->present.y, *v = q + system->n;
    for (int k = 0; k < system->mechanism->link_count; k++) {
        int j = system->mechanism->links[k];
        links[PER_LINK * k + LINK_ANGLE] = q[j];
        links[PER_LINK * k + LINK_OMEGA] = v[j];
    }
    for (int k = 0; k < system->mechanism->strain_count; k++) {
        int j = system->mechanism->strains[k];
        stretches[PER_STRETCH * k + STRETCH_STRAIN] = q[j];
        stretches[PER_STRETCH * k + STRETCH_STRAIN_RATE] = v[j];
    }
}

static void output_springs(Simulation *sim, double *out) {
    const System *system = system_of(sim);
    Scratch scratch = sim->scratch;
    double *row = take(&scratch, (size_t)system->n);
    for (int k = 0; k < system->coil_count; k++) {
        double *values = out + PER_SPRING * k;
        SpringState now = spring_state(system, k, sim->present.e, 1.0);
        length_gradient(system, k, sim->present.e, row);
        double rate = dot(system->n, row, sim->present.y + system->n);
        values[SPRING_FORCE] = coil_force(&system->laws[k], &now, rate,
                                          coil_phase(system, sim->equations.contacts.coils, k));
        values[SPRING_LENGTH] = now.length;
        values[SPRING_LENGTH_RATE] = rate;
    }
}

static void output_places(Simulation *sim) {
    const System *system = system_of(sim);
    const Slots *slots = &system->mechanism->slots;
    double *out = sim->present.outputs;
    output_bodies(sim, out + slots->bodies);
    output_probes(sim, out + slots->probes);
    output_stops(sim, out + slots->stops);
    output_latched(sim, out + slots->latched);
    output_springs(sim, out + slots->springs);
    if (system->mechanism->compliant_count > 0) {
        output_compliant(sim, out + slots->compliant, out + slots->latched);
    }
    output_links(sim, out + slots->links, out + slots->stretches);
    out[slots->energies + ENERGY_DISSIPATED] = sim->present.y[2 * system->n];
    out[slots->energies + ENERGY_WORK] = sim->present.y[2 * system->n + 1];
    out[slots->frequency] = sim->state.frequency;
    copy(slots->derivatives - slots->calculated, system->calculated, out + slots->calculated);
    out[slots->time] = sim->state.time;
}

/* near: whether the reference is near the present state. */
static bool output_motion(Simulation *sim, bool near, Problem *problem) {
    const Slots *slots = &sim->configuration.mechanism->slots;
    const Equations *eq = &sim->equations;
    Present *present = &sim->present;
    double *out = present->outputs, *v = present->y + system_of(sim)->n;
    if (!evaluate_equations(eq, sim->state.time, present->y, v, extra_states(sim, present->y),
                            near ? &present->reference : NULL, &present->evaluation, problem)) {
        return false;
    }
    for (int i = 0; i < system_of(sim)->s; i++) {
        out[slots->stops + PER_STOP * i + STOP_FORCE] = 0.0;
    }
    for (int k = 0; k < eq->held_count; k++) {
        double force = present->evaluation.lam[eq->first_hold + k];
        out[slots->stops + PER_STOP * eq->held[k] + STOP_FORCE] = force;
    }
    for (int k = 0; k < eq->pressed_count; k++) {
        int i = eq->pressed[k];
        out[slots->stops + PER_STOP * i + STOP_FORCE] = present->evaluation.pressure[i];
    }
    guide_loads(system_of(sim), present->evaluation.lam, out + slots->guides);
    out[slots->energies + ENERGY_KINETIC] = kinetic_energy_of(&present->evaluation);
    return true;
}

static void output_base(Simulation *sim) {
    const Present *present = &sim->present;
    double *out = present->outputs + sim->configuration.mechanism->slots.base;
    Complex force;
    base_reaction(&sim->equations, present->e, present->y + system_of(sim)->n,
                  present->evaluation.a, &force, out + BASE_MOMENT, sim->scratch);
    out[BASE_FORCE_X] = force.re;
    out[BASE_FORCE_Y] = force.im;
}

static void output_stresses(Simulation *sim) {
    Scratch scratch = sim->scratch;
    const Mechanism *m = sim->configuration.mechanism;
    const Present *present = &sim->present;
    double *out = sim->present.outputs + m->slots.stresses;
    Stress *found = take_stresses(&scratch, m->stressed_count);
    stresses(&sim->equations, present->e, present->y, present->y + system_of(sim)->n,
             &present->evaluation, found, scratch);
    for (int i = 0; i < m->stressed_count; i++) {
        out[PER_STRESS * i + STRESS_STRESS_START] = found[i].start;
        out[PER_STRESS * i + STRESS_STRESS_END] = found[i].end;
        out[PER_STRESS * i + STRESS_STRESS] = found[i].largest;
        peak_outputs(sim, i, &found[i], out + PER_STRESS * i + STRESS_PEAK_STRESS);
    }
}

static void output_energies(Simulation *sim) {
    const System *system = system_of(sim);
    double *out = sim->present.outputs + system->mechanism->slots.energies;
    out[ENERGY_ELASTIC] =
        element_energy(system, sim->present.y, sim->present.e, sim->scratch);
    for (int i = 0; system->mechanism->compliant_count > 0 && i < system->s; i++) {
        if (sim->state.touching[i].phase != PHASE_NONE) {
            double distance = gap(&sim->equations, i, sim->state.time, sim->present.e,
                                  extra_states(sim, sim->present.y));
            out[ENERGY_ELASTIC] += contact_energy(&sim->equations.laws[i], distance);
        }
    }
    out[ENERGY_GRAVITATIONAL] = gravitational_energy(system, sim->present.e);
}

static bool output_mobilities(Simulation *sim, Problem *problem) {
    Scratch scratch = sim->scratch;
    const System *system = system_of(sim);
    double *out = sim->present.outputs + system->mechanism->slots.stops;
    double *G = take(&scratch, (size_t)system->n);
    ContactProblem *at = contact_problem_at(sim, sim->present.y, scratch);
    Rows gaps = gap_rows(system);
    bool ok = true;
    for (int i = 0; ok && i < system->s; i++) {
        row_jacobian(&gaps, i, at->e, G);
        ok = mobility(at, G, out + PER_STOP * i + STOP_POINT_MOBILITY, scratch, problem);
    }
    return ok;
}

/* Compute groups of outputs at the present y and e. */
PRBM bool compute_outputs(Simulation *sim, int groups, bool near, Problem *problem) {
    if (groups & PLACES) {
        output_places(sim);
    }
    if ((groups & MOTION) && !output_motion(sim, near, problem)) {
        return false;
    }
    if (groups & BASE) {
        output_base(sim);
    }
    if (groups & ENERGIES) {
        output_energies(sim);
    }
    if (groups & STRESSES) {
        output_stresses(sim);
    }
    return !(groups & MOBILITIES) || output_mobilities(sim, problem);
}

/* Return the groups of outputs that must be computed for a value. */
PRBM int output_groups(const Simulation *sim, int slot) {
    const Slots *slots = &sim->configuration.mechanism->slots;
    bool of_stop = slot >= slots->stops && slot < slots->springs;
    bool force = of_stop && (slot - slots->stops) % PER_STOP == STOP_FORCE;
    bool of_guide = slot >= slots->guides && slot < slots->base;
    if (force || of_guide || slot == slots->energies + ENERGY_KINETIC) {
        return PLACES | MOTION;
    }
    if (of_stop && (slot - slots->stops) % PER_STOP == STOP_POINT_MOBILITY) {
        return PLACES | MOBILITIES;
    }
    if (slot >= slots->base && slot < slots->energies) {
        return PLACES | MOTION | BASE;
    }
    if (slot >= slots->stresses && slot < slots->frequency) {
        return PLACES | MOTION | STRESSES;
    }
    bool potential = slot == slots->energies + ENERGY_ELASTIC ||
                     slot == slots->energies + ENERGY_GRAVITATIONAL;
    return potential ? PLACES | ENERGIES : PLACES;
}
