/* The constant arrays of a mechanism, and the kinematics of its arms: the twin of
 * mechanics/system.py.
 *
 * Each link and body has an arm E = exp(s + i theta).  Its derivative is E' = i w E, with the
 * complex rate w = theta' - i s'.  A point is at z = c + A E.  A coordinate is an angle theta or a
 * stretch s. The elements of e are E for angles and -i E for stretches, so that dE/dq = i e for
 * both.
 */
#include "core/system.h"
#include "core/vectors.h"

static BodyFrame *place_frames(Memory *memory, size_t count, size_t n) {
    BodyFrame *frames = place(memory, count, sizeof *frames);
    Complex *rows = place(memory, count * n, sizeof *rows);
    for (size_t i = 0; memory->base && i < count; i++) {
        frames[i].A = rows + i * n;
    }
    return frames;
}

static Place *place_origins(Memory *memory, size_t count, size_t n) {
    Place *origins = place(memory, count, sizeof *origins);
    Complex *rows = place(memory, count * n, sizeof *rows);
    for (size_t i = 0; memory->base && i < count; i++) {
        origins[i].A = rows + i * n;
    }
    return origins;
}

PRBM void system_place(System *system, const Mechanism *mechanism, Memory *memory) {
    const Mechanism *m = mechanism;
    size_t n = (size_t)m->coordinate_count, r = (size_t)m->loop_count;
    size_t p = (size_t)m->mass_count, s = (size_t)m->stop_count, f = (size_t)m->friction_count;
    size_t b = (size_t)m->body_count;
    System result = {0};
    result.mechanism = mechanism;
    result.n = (int)n;
    result.even = even_length((int)n);
    result.r = (int)r;
    result.s = (int)s;
    result.f = (int)f;
    result.b = (int)b;
    result.q0 = place(memory, n, sizeof(double));
    result.e0 = place(memory, n, sizeof(Complex));
    result.J = place(memory, n, sizeof(double));
    result.K = place(memory, n * n, sizeof(double));
    result.H = place(memory, n * n, sizeof(Complex));
    result.A = place(memory, p * n, sizeof(Complex));
    result.c = place(memory, p, sizeof(Complex));
    result.m = place(memory, p, sizeof(double));
    result.S = place(memory, n, sizeof(Complex));
    result.loops = place(memory, r * n, sizeof(Complex));
    result.loops_c = place(memory, r, sizeof(double));
    result.gaps = place(memory, s * n, sizeof(Complex));
    result.slides = place(memory, s * n, sizeof(Complex));
    result.gaps_c = place(memory, s, sizeof(double));
    result.gaps_z = place(memory, s, sizeof(Complex));
    result.slides_z = place(memory, s, sizeof(Complex));
    result.on = place(memory, s, sizeof(int));
    result.rubs = place(memory, f * n, sizeof(Complex));
    result.lifts = place(memory, f * n, sizeof(Complex));
    result.lifts_c = place(memory, f, sizeof(double));
    result.release = place(memory, n, sizeof(Complex));
    result.released.A = place(memory, n, sizeof(Complex));
    result.bodies = place_frames(memory, b, n);
    result.pushed = place_frames(memory, (size_t)m->force_count, n);
    result.probes = place_frames(memory, (size_t)m->probe_count, n);
    result.origins = place_origins(memory, b + 1, n);
    result.stretch_count = m->stretch_count;
    result.stretches = m->stretches;
    result.spring = place(memory, (size_t)m->spring_count, sizeof(Spring));
    result.blocks = place(memory, n, sizeof(Block));
    result.coupling = place(memory, n * n, sizeof(Complex));
    result.own = place(memory, n, sizeof(double));
    result.straight = place(memory, (size_t)result.even, sizeof(double));
    result.calculated = place(memory, (size_t)m->type_count, sizeof(double));
    *system = result;
}

/* --- arms ------------------------------------------------------------------------------------- */

PRBM int arm_of(const System *system, int j) {
    return system->mechanism->coordinates[j].arm;
}

PRBM void stretch(const System *system, const double *q, Complex *e) {
    for (int k = 0; k < system->stretch_count; k++) {
        int j = system->stretches[k], a = arm_of(system, j);
        e[a] = scaled(exponential(q[j]), e[a]);
        e[j] = complex_of(e[a].im, -e[a].re);
    }
}

PRBM void directions(const System *system, const double *q, Complex *e) {
    unit_vectors(system->n, q, e);
    stretch(system, q, e);
}

PRBM void turning(const System *system, const double *v, Complex *w) {
    for (int j = 0; j < system->n; j++) {
        w[j] = complex_of(v[j], 0.0);
    }
    for (int k = 0; k < system->stretch_count; k++) {
        int j = system->stretches[k];
        w[arm_of(system, j)].im = -v[j];
        w[j] = complex_of(0.0, 0.0);
    }
}

PRBM void motion(const System *system, const BodyFrame *frame, const Complex *e, const double *v,
                 Complex *displacement, Complex *velocity) {
    Complex at = minus(frame->c, frame->drawn), speed = {0.0, 0.0};
    for (int j = 0; j < system->n; j++) {
        Complex arm = product(frame->A[j], e[j]);
        at = plus(at, arm);
        speed.re -= arm.im * v[j];
        speed.im += arm.re * v[j];
    }
    for (int k = 0; k < system->stretch_count; k++) {
        int j = system->stretches[k];
        Complex along_arm = product(frame->A[arm_of(system, j)], e[j]);
        speed.re -= along_arm.im * v[j];
        speed.im += along_arm.re * v[j];
    }
    *displacement = at;
    *velocity = speed;
}

PRBM void spread(const System *system, int r, const Complex *B, Complex *rows) {
    int n = system->n;
    for (int i = 0; i < r * n; i += n) {
        for (int j = 0; j < n; j++) {
            rows[i + j] = B[i + arm_of(system, j)];
        }
    }
}
