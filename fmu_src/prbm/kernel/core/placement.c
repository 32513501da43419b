/* The memory of the constant arrays of a mechanism. */
#include "core/branches.h"
#include "core/free_body.h"
#include "core/placement.h"
#include "core/vectors.h"

static BodyFrame *place_frames(Memory *memory, size_t count, size_t d) {
    BodyFrame *frames = place(memory, count, sizeof *frames);
    Complex *rows = place(memory, count * d, sizeof *rows);
    for (size_t i = 0; memory->base && i < count; i++) {
        frames[i].A = rows + i * d;
    }
    return frames;
}

static Place *place_origins(Memory *memory, size_t count, size_t d) {
    Place *origins = place(memory, count, sizeof *origins);
    Complex *rows = place(memory, count * d, sizeof *rows);
    for (size_t i = 0; memory->base && i < count; i++) {
        origins[i].A = rows + i * d;
    }
    return origins;
}

/* Place the rows of stops and of points with friction. */
static void place_contacts(System *system, Memory *memory) {
    size_t d = (size_t)system->d, s = (size_t)system->s, f = (size_t)system->f;
    system->gaps = place(memory, s * d, sizeof(Complex));
    system->slides = place(memory, s * d, sizeof(Complex));
    system->gaps_c = place(memory, s, sizeof(double));
    system->gaps_z = place(memory, s, sizeof(Complex));
    system->slides_z = place(memory, s, sizeof(Complex));
    system->on = place(memory, s, sizeof(int));
    size_t points = (size_t)system->mechanism->friction_count;
    system->rubs = place(memory, f * d, sizeof(Complex));
    system->rubs_z = place(memory, f, sizeof(Complex));
    system->rubs_on = place(memory, f, sizeof(int));
    system->normals = place(memory, f, sizeof(int));
    system->lifts = place(memory, points * d, sizeof(Complex));
    system->lifts_c = place(memory, points, sizeof(double));
}

/* Place torsion at joints, the vectors along coil springs and their laws. */
static void place_elements(System *system, Memory *memory) {
    const Mechanism *m = system->mechanism;
    size_t n = (size_t)system->n, d = (size_t)system->d, coils = (size_t)m->coil_count;
    system->placed_count = m->placed_count;
    system->placed = m->placed;
    for (int i = 0; i < m->joint_count; i++) {
        system->torsion_count += m->joints[i].sprung || m->joints[i].damped;
    }
    system->torsions = place(memory, (size_t)system->torsion_count, sizeof(Torsion));
    system->coil_count = m->coil_count;
    system->spans = place(memory, coils * d, sizeof(Complex));
    system->spans_c = place(memory, coils, sizeof(Complex));
    system->laws = place(memory, coils, sizeof(SpringLaw));
    bool others = coils > 0 || system->torsion_count > 0;
    system->stiffness = others ? place(memory, n * n, sizeof(double)) : system->K;
}

PRBM void system_place(System *system, const Mechanism *mechanism, Memory *memory) {
    const Mechanism *m = mechanism;
    size_t n = (size_t)m->coordinate_count, r = (size_t)m->loop_count;
    size_t p = (size_t)m->mass_count, b = (size_t)m->body_count, d = (size_t)m->direction_count;
    System result = {0};
    result.mechanism = mechanism;
    result.n = (int)n;
    result.even = even_length((int)n);
    result.d = (int)d;
    result.wide = even_length((int)d);
    result.mapped = m->map.mapped;
    result.r = (int)r;
    result.s = m->stop_count;
    result.f = m->rubbing_count;
    result.b = (int)b;
    result.q0 = place(memory, n, sizeof(double));
    result.rest = place(memory, n, sizeof(double));
    result.e0 = place(memory, d, sizeof(Complex));
    result.J = place(memory, d, sizeof(double));
    result.K = place(memory, n * n, sizeof(double));
    result.H = place(memory, d * d, sizeof(Complex));
    result.A = place(memory, p * d, sizeof(Complex));
    result.c = place(memory, p, sizeof(Complex));
    result.m = place(memory, p, sizeof(double));
    result.S = place(memory, d, sizeof(Complex));
    result.loops = place(memory, r * d, sizeof(Complex));
    result.loops_c = place(memory, r, sizeof(double));
    result.loops_z = place(memory, r, sizeof(Complex));
    result.loops_on = place(memory, r, sizeof(int));
    result.guided = place(memory, (size_t)m->guide_count, sizeof(GuideRows));
    place_elements(&result, memory);
    place_contacts(&result, memory);
    result.release = place(memory, d, sizeof(Complex));
    result.released.A = place(memory, d, sizeof(Complex));
    result.bodies = place_frames(memory, b, d);
    result.pushed = place_frames(memory, (size_t)m->force_count, d);
    result.probes = place_frames(memory, (size_t)m->probe_count, d);
    result.origins = place_origins(memory, b + 1, d);
    result.corners = place(memory, (size_t)m->corner_count * d, sizeof(Complex));
    result.corners_c = place(memory, (size_t)m->corner_count, sizeof(Complex));
    result.stretch_count = m->stretch_count;
    result.stretches = m->stretches;
    result.shift_count = m->shift_count;
    result.shifts = m->shifts;
    result.spring = place(memory, (size_t)m->spring_count, sizeof(Spring));
    result.grounded = place(memory, (size_t)result.even, sizeof(double));
    result.factors = place(memory, (size_t)m->map.count, sizeof(double));
    result.blocks = place(memory, d, sizeof(Block));
    place_branches(&result, memory);
    result.mass_blocks = place(memory, n, sizeof(Block));
    result.last = place(memory, n, sizeof(int));
    result.factor_rows = place(memory, n, sizeof(FactorRow));
    result.coupling = place(memory, d * d, sizeof(Complex));
    result.block = place(memory, (size_t)result.wide * (size_t)result.wide, sizeof(double));
    result.coupling_parts = place_parts(memory, result.mapped ? 0 : d * d);
    result.own = place(memory, d, sizeof(double));
    result.straight = place(memory, (size_t)result.even, sizeof(double));
    result.calculated = place(memory, (size_t)m->type_count, sizeof(double));
    place_free_bodies(&result, memory);
    *system = result;
}
