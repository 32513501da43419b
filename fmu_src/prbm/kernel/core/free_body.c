/* Flexures as free bodies: the twin of mechanics/free_body.py. */
#include <math.h>
#include <string.h>

#include "core/collection.h"
#include "core/free_body.h"
#include "core/matrix.h"

static FreeBody *body_of(const System *system, const Step *step) {
    return &system->free_bodies[step->flexure - system->mechanism->flexures];
}

/* Place the arrays of a flexure with up to m sections, p mass points and k arms. */
static void place_arrays(FreeBody *body, size_t m, size_t p, size_t k, size_t P, Memory *memory) {
    FreeBody result = {0};
    result.position = place(memory, m, sizeof(double));
    result.area = place(memory, m, sizeof(double));
    result.modulus = place(memory, m, sizeof(double));
    result.ranks = place(memory, p, sizeof(double));
    result.section_ranks = place(memory, m, sizeof(double));
    result.tangents = place(memory, 2 * m, sizeof(int));
    result.drawn = place(memory, 2 * m, sizeof(Complex));
    result.arms = place(memory, k, sizeof(int));
    result.levers = place(memory, (p + 1) * k, sizeof(Complex));
    result.turning = place(memory, 2 * k, sizeof(double));
    result.angles = place(memory, m, sizeof(int));
    result.rates = place(memory, m, sizeof(double));
    result.moments = place(memory, P, sizeof(double));
    if (memory->base) {
        *body = result;
    }
}

PRBM void place_free_bodies(System *system, Memory *memory) {
    const Mechanism *m = system->mechanism;
    bool any = m->stressed_count > 0;
    size_t count = any ? (size_t)m->flexure_count : 0;
    system->free_bodies = place(memory, count, sizeof(FreeBody));
    system->body_masses = place(memory, any ? (size_t)m->body_count : 0, sizeof(int));
    for (size_t i = 0; i < count; i++) {
        const Flexure *flexure = &m->flexures[i];
        const FlexureType *kind = kind_of(m, flexure);
        FreeBody none, *body = memory->base ? &system->free_bodies[i] : &none;
        if (kind->order > 0) {
            size_t N = (size_t)node_count(kind), cuts = N + CUTS_BESIDE_NODES;
            size_t masses = kind->profile == PROFILE_NOTCH ? 2 * N : N;
            place_arrays(body, cuts, masses, N, cuts * ((size_t)kind->order + 1), memory);
        } else {
            size_t links = (size_t)links_of(kind, flexure->type_at_start, flexure->type_at_end);
            place_arrays(body, links + 3, 3 * links + 5, 2, 0, memory);
        }
    }
}

PRBM FreeBody *begin_free_body(System *system, const Step *step) {
    if (system->mechanism->stressed_count == 0) {
        return NULL;
    }
    FreeBody *body = body_of(system, step);
    body->first = system->p;
    body->count = body->stub = 0;
    body->forwards = !step->backwards;
    return body;
}

PRBM void rank_points(FreeBody *body, const System *system, int rank) {
    while (body && body->first + body->count < system->p) {
        body->ranks[body->count++] = rank;
    }
}

/* Set area and section modulus of all sections. */
static void set_section(const System *system, const FlexureType *kind, FreeBody *body) {
    double h = evaluate(kind->thickness, system->values);
    double b = evaluate(kind->width, system->values);
    for (int i = 0; i < body->sections; i++) {
        body->area[i] = b * h;
        body->modulus[i] = b * (h * h) / 6;
    }
}

/* Set the rank of a section among the mass points, and its position. */
static void set_place(FreeBody *body, int i, double rank, double position) {
    body->section_ranks[i] = rank;
    body->position[i] = position;
}

/* Set the two arms of the tangent of a section, and their drawn directions times their shares. */
static void set_tangent(FreeBody *body, int i, int a, int b, Complex drawn_a, Complex drawn_b) {
    body->tangents[2 * i] = a;
    body->tangents[2 * i + 1] = b;
    body->drawn[2 * i] = drawn_a;
    body->drawn[2 * i + 1] = drawn_b;
}

/* --- links ------------------------------------------------------------------------------------ */

/* Set the levers of the mass points and of the far end along both stubs. */
static void set_stubs(FreeBody *body, const Segments *pieces, Complex direction) {
    int last = 2 * (pieces->n + 1), pair = 0;
    double near = pieces->lengths[0], far = pieces->lengths[pieces->n + 1];
    for (int i = 0; i < body->count; i++) {
        int rank = (int)body->ranks[i];
        pair = i > 0 && body->ranks[i - 1] == body->ranks[i] ? 1 : 0;
        double fraction = rod_point(pair);
        body->levers[2 * i] = scaled(rank == 0 ? near * fraction : near, direction);
        body->levers[2 * i + 1] = scaled(rank == last ? far * fraction : 0.0, direction);
        body->stub += rank == last;
    }
    body->levers[2 * body->count] = scaled(near, direction);
    body->levers[2 * body->count + 1] = scaled(far, direction);
}

/* Set the sections: both ends, and the pivots. */
static void set_pivots(FreeBody *body, const Segments *pieces, Complex direction,
                       const int *owners) {
    int n = pieces->n;
    double length = 0.0, s = 0.0;
    Complex along = complex_of(1.0, 0.0);
    for (int i = 0; i < n + 2; i++) {
        length += pieces->lengths[i];
    }
    /* The section at a pin turns with the link there. */
    int near = pieces->rates[0] != 0.0 ? 0 : 1, far = pieces->rates[n] != 0.0 ? n + 1 : n;
    for (int i = 0; i < n + 3; i++) {
        int a = i == 0 ? near : i == n + 2 ? far : i - 1;
        int b = i == 0 ? near : i == n + 2 ? far : i;
        bool on_body_a = a == 0 || a == n + 1, on_body_b = b == 0 || b == n + 1;
        double rank = i == 0 ? -1.0 : i == n + 2 ? HUGE_VAL : 2.0 * (i - 1) + 1.0;
        set_place(body, i, rank, body->forwards ? s : length - s);
        set_tangent(body, i, owners[a], owners[b], on_body_a ? direction : along,
                    on_body_b ? direction : along);
        s = i < n + 1 ? s + pieces->lengths[i] : length;
    }
}

PRBM void keep_links(System *system, const Step *step, const Segments *pieces, Complex direction,
                     const int *owners) {
    if (system->mechanism->stressed_count == 0) {
        return;
    }
    FreeBody *body = body_of(system, step);
    int n = pieces->n;
    const double identity[4] = {1.0, 0.0, 0.0, 1.0};
    body->order = 0;
    body->sections = n + 3;
    body->smooth = body->smooth_count = 0;
    body->arm_count = 2;
    body->arms[0] = owners[0];
    body->arms[1] = owners[n + 1];
    memcpy(body->turning, identity, sizeof identity);
    copy(n + 1, pieces->rates, body->rates);
    for (int i = 0; i < n + 2; i++) {
        body->angles[i] = owners[i] == FIXED ? FIXED : angle_of(system, owners[i]);
    }
    set_stubs(body, pieces, direction);
    set_pivots(body, pieces, direction, owners);
    set_section(system, kind_of(system->mechanism, step->flexure), body);
}

/* --- beams ------------------------------------------------------------------------------------ */

/* Set the levers of the mass points of a beam, from its ranks, in the direction of the chord.  The
 * two mass points of a thick node are at its right and at its left. */
static void set_levers(FreeBody *body, const Beam *beam, Complex direction, bool thick) {
    int N = beam->nodes;
    for (int i = 0; i <= body->count; i++) {
        int node = i < body->count ? (int)body->ranks[i] : N;
        Complex *lever = body->levers + i * N;
        for (int j = 0; j < N; j++) {
            Complex none = {0.0, 0.0}, end = body->forwards ? beam->whole[j] : none;
            lever[j] = node < N ? beam->A[node * N + j] : end;
            lever[j] = body->forwards ? lever[j] : minus(lever[j], beam->whole[j]);
        }
        if (node < N && thick) {
            bool second = i > 0 && body->ranks[i - 1] == node;
            lever[node].im += second ? beam->radii[node] : -beam->radii[node];
        }
        for (int j = 0; j < N; j++) {
            lever[j] = product(lever[j], direction);
        }
    }
}

/* Rank the mass points of a beam that is added from its end to its start. */
static void rank_backwards(FreeBody *body, int nodes) {
    for (int i = 0; i < body->count; i++) {
        body->ranks[i] = nodes - 1 - body->ranks[i];
    }
}

/* Return the arm at a cut of the given rank. */
static int tangent_arm_at(const FreeBody *body, const int *ends, int nodes, int rank) {
    if (rank >= 0 && rank < nodes) {
        return body->arms[rank];
    }
    int end = ends[rank < 0 ? 0 : 1];
    return end == FIXED ? FIXED : TURNED - end;
}

/* Set section i from cut k.  The tangent between two nodes is interpolated. */
static void set_cut(FreeBody *body, int i, const Beam *beam, int k, Complex direction,
                    const int *ends) {
    const Cut *cut = &beam->cuts[k];
    int N = beam->nodes, before = (int)floor(cut->rank), after = (int)ceil(cut->rank);
    double share = 0.5;
    if (before < after) {
        double start = beam->cuts[k - 1].position, end = beam->cuts[k + 1].position;
        share = (cut->position - start) / (end - start);
    }
    Complex along = product(cut->tangent, body->forwards ? direction : scaled(-1.0, direction));
    set_place(body, i, body->forwards ? cut->rank : N - 1 - cut->rank, cut->position);
    set_tangent(body, i, tangent_arm_at(body, ends, N, before),
                tangent_arm_at(body, ends, N, after),
                scaled(1.0 - share, along), scaled(share, along));
    body->area[i] = cut->area;
    body->modulus[i] = cut->modulus;
}

PRBM void keep_beam(System *system, const Step *step, const Beam *beam, Complex direction,
                    const int *ends, int first) {
    if (system->mechanism->stressed_count == 0) {
        return;
    }
    FreeBody *body = body_of(system, step);
    const FlexureType *kind = kind_of(system->mechanism, step->flexure);
    int N = beam->nodes, terms = beam->order + 1, stride = kind->axial ? 2 : 1;
    body->order = beam->order;
    body->sections = beam->cut_count;
    body->smooth = beam->smooth;
    body->smooth_count = beam->smooth_count;
    body->arm_count = N;
    body->angles[0] = ends[0];
    body->angles[1] = ends[1];
    body->angles[2] = first;
    body->rates[0] = beam->rates[0];
    for (int j = 0; j < N; j++) {
        const double *S = beam->S + j * terms;
        body->arms[j] = step->first_direction + j * stride;
        body->turning[body->forwards ? j : N + j] = 1.0 - S[0];
        body->turning[body->forwards ? N + j : j] = S[0];
    }
    set_levers(body, beam, direction, kind->profile == PROFILE_NOTCH);
    if (!body->forwards) {
        rank_backwards(body, N);
    }
    copy(beam->cut_count * terms, beam->moments, body->moments);
    for (int i = 0; i < beam->cut_count; i++) {
        set_cut(body, i, beam, body->forwards ? i : beam->cut_count - 1 - i, direction, ends);
    }
}
