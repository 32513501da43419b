/* The constant arrays of a mechanism with its parameter values: the twin of
 * mechanics/assembly.py. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "core/assembly.h"
#include "core/branches.h"
#include "core/constraints.h"
#include "core/elements.h"
#include "core/flexure.h"
#include "core/flexures.h"
#include "core/guides.h"
#include "core/matrix.h"
#include "core/vectors.h"

/* --- flexures, joints and free bodies, from the ground outwards ------------------------------- */

static bool walk_joint(System *system, const Step *step, Scratch scratch, Problem *problem) {
    Span span = span_of(system, step);
    double apart = modulus(minus(span.z_end, span.z_start));
    if (!(apart <= JOINT_DISTANCE_RTOL * system->length)) {
        return fail(problem,
                    "the joint %s joins points that are drawn %.4g m apart: draw them at the same "
                    "place",
                    step->name, apart);
    }
    Place spot = new_place(system, &scratch), other = new_place(system, &scratch);
    on_body(system, span.root, span.z_start, &spot);
    if (step->closes) {
        on_body(system, span.far, span.z_end, &other);
        close_loop(system, &spot, &other);
    } else {
        reach(system, span.far, &spot, span.z_end, step->first_direction);
    }
    return true;
}

/* Place a free body at its centre of mass, with an arm that floats. */
static void walk_free_body(System *system, const Step *step, Scratch scratch) {
    const int arm = step->first_direction, turn = arm + 1 + SHIFTS_EACH;
    const int *first = system->mechanism->map.first;
    Place spot = new_place(system, &scratch);
    Complex drawn = at_point(system, system->mechanism->bodies[step->body - 1].centre);
    for (int j = arm + 1; j < turn; j++) {
        system->factors[first[j]] = system->length;
    }
    extend(&spot, FIXED, drawn);
    extend(&spot, arm, complex_of(1.0, 0.0));
    reach(system, step->body, &spot, drawn, turn);
}

static bool walk_step(System *system, const Step *step, Scratch scratch, Problem *problem) {
    if (step->body != GROUND) {
        walk_free_body(system, step, scratch);
        return true;
    }
    return step->flexure ? walk_flexure(system, step, scratch, problem)
                         : walk_joint(system, step, scratch, problem);
}

static bool walk_all(System *system, Scratch scratch, Problem *problem) {
    const Mechanism *m = system->mechanism;
    bool ok = true;
    system->r = 0;
    clear_branches(system);
    for (int i = 0; ok && i < m->step_count; i++) {
        begin_branch(system, i);
        ok = walk_step(system, &m->steps[i], scratch, problem);
    }
    system->r = m->loop_count;
    return ok;
}

/* Set the frame of a point of a body, given by its drawn position. */
static void add_frame(System *system, int body, Complex drawn, BodyFrame *frame,
                      Scratch scratch) {
    Place spot = new_place(system, &scratch);
    on_body(system, body, drawn, &spot);
    frame->arm = system->origins[body].j;
    frame->j = frame->arm == FIXED ? FIXED : angle_of(system, frame->arm);
    frame->c = spot.c;
    frame->drawn = drawn;
    memcpy(frame->A, spot.A, (size_t)system->d * sizeof *frame->A);
}

static void add_body(System *system, int body, Scratch scratch) {
    const Body *part = &system->mechanism->bodies[body - 1];
    BodyFrame *frame = &system->bodies[body - 1];
    Complex drawn = at_point(system, part->centre);
    Place centre = new_place(system, &scratch);
    on_body(system, body, drawn, &centre);
    if (system->mechanism->stressed_count > 0) {
        system->body_masses[body - 1] = system->p;
    }
    add_mass(system, &centre, evaluate(part->mass, system->values));
    add_frame(system, body, drawn, frame, scratch);
    system->J[frame->arm] += evaluate(part->inertia, system->values);
}

static void add_pushed_and_probes(System *system, Scratch scratch) {
    const Mechanism *m = system->mechanism;
    for (int i = 0; i < m->force_count; i++) {
        const Force *force = &m->forces[i];
        add_frame(system, force->body, at_point(system, force->point), &system->pushed[i], scratch);
    }
    for (int i = 0; i < m->probe_count; i++) {
        const Probe *probe = &m->probes[i];
        add_frame(system, probe->body, at_point(system, probe->point), &system->probes[i], scratch);
    }
}

/* --- arrays ----------------------------------------------------------------------------------- */

/* Set B and return c such that Re(B E) + c is the displacement of a place along u [m]. */
static double along(int d, Complex u, const Complex *A, const Complex *e0, Complex *B) {
    double c = 0.0;
    for (int j = 0; j < d; j++) {
        B[j] = product(conjugate(u), A[j]);
        c += product(B[j], e0[j]).re;
    }
    return -c;
}

/* Set the rows of a stop, relative to the body that carries its wall: the gap without the wall's
 * position, and the displacement along the wall. */
static void add_stop(System *system, int i, const Complex *e0, Place *hit) {
    const Stop *stop = &system->mechanism->stops[i];
    const Place *origin = &system->origins[stop->on];
    int d = system->d;
    Complex u = unit(stop->direction), across = product(complex_of(0.0, 1.0), u);
    double offset = evaluate(stop->offset, system->values);
    Complex drawn = plus(at_point(system, stop->point), scaled(offset, across));
    Complex *gap = system->gaps + i * d, *slide = system->slides + i * d;
    on_body(system, stop->body, drawn, hit);
    system->on[i] = origin->j;
    system->gaps_z[i] = system->slides_z[i] = complex_of(0.0, 0.0);
    if (origin->j != FIXED) {
        for (int j = 0; j < d; j++) {
            hit->A[j] = minus(hit->A[j], origin->A[j]);
        }
        Complex apart = minus(hit->c, origin->c);
        system->gaps_z[i] = product(conjugate(scaled(-1.0, u)), apart);
        system->slides_z[i] = product(conjugate(across), apart);
    }
    double straight = along(d, scaled(-1.0, u), hit->A, e0, gap);
    along(d, across, hit->A, e0, slide);
    Complex seen_drawn = product(conjugate(u), minus(drawn, origin->drawn));
    system->gaps_c[i] = origin->j == FIXED ? straight : seen_drawn.re;
}

static void add_stops(System *system, const Complex *e0, Scratch scratch) {
    Place hit = new_place(system, &scratch);
    for (int i = 0; i < system->s; i++) {
        add_stop(system, i, e0, &hit);
    }
}

static void add_frictions(System *system, const Complex *e0, Scratch scratch) {
    int d = system->d;
    Place spot = new_place(system, &scratch);
    for (int i = 0; i < system->mechanism->friction_count; i++) {
        const Friction *friction = &system->mechanism->frictions[i];
        Complex u = unit(friction->direction), across = product(complex_of(0.0, 1.0), u);
        on_body(system, friction->body, at_point(system, friction->point), &spot);
        along(d, u, spot.A, e0, system->rubs + i * d);
        system->rubs_z[i] = complex_of(0.0, 0.0);
        system->rubs_on[i] = system->normals[i] = FIXED;
        system->lifts_c[i] = along(d, across, spot.A, e0, system->lifts + i * d);
    }
}

/* Return the end of the block of a symmetric matrix (size, size) that begins at start.  linked
 * marks the elements that are not zero.  The columns from the end on share none with the block. */
static int end_of_block(int size, const bool *linked, int start) {
    int end = start + 1;
    for (int j = start; j < end; j++) {
        for (int i = end; i < size; i++) {
            end = linked[i * size + j] ? i + 1 : end;
        }
    }
    return end;
}

static int find_blocks(int size, const bool *linked, Block *blocks) {
    int count = 0;
    for (int start = 0; start < size;) {
        int end = end_of_block(size, linked, start);
        Block block = {start, end - start, 0};
        blocks[count++] = block;
        start = end;
    }
    return count;
}

/* Return the row of the body of a guide on two beams with a certain number of coordinates; 0: it is
 * another block. */
static int guide_split(int size, const int *last) {
    int split = size == GUIDE ? size / 2 : 0;
    for (int i = 0; i < split; i++) {
        if (last[i] > split) {
            return 0;
        }
    }
    return split;
}

/* Find the last column that is linked with each row, counted in the block of the row, and the rows of
 * the factor. */
static void find_last(const System *system, const bool *linked, int *last) {
    int n = system->n, first = 0;
    for (int k = 0; k < system->mass_block_count; k++) {
        int start = system->mass_blocks[k].start, size = system->mass_blocks[k].size;
        int end = start + size;
        for (int i = start; i < end; i++) {
            last[i] = i - start;
            for (int j = i; j < end; j++) {
                last[i] = linked[i * n + j] || linked[j * n + i] ? j - start : last[i];
            }
            system->factor_rows[i].begin = first + (i - start) * size - start;
            system->factor_rows[i].last = start + last[i];
        }
        first += size * size;
        system->mass_blocks[k].split = guide_split(size, last + start);
    }
}

/* Mark the coordinates that two directions depend on. */
static void link_coordinates(const System *system, int i, int j, bool *linked) {
    const DirectionMap *map = &system->mechanism->map;
    for (int k = map->first[i]; k < map->first[i + 1]; k++) {
        for (int l = map->first[j]; l < map->first[j + 1]; l++) {
            linked[map->coordinate[k] * system->n + map->coordinate[l]] = true;
        }
    }
}

/* Find the blocks of the mass matrices of the directions and of the coordinates. */
static void find_all_blocks(System *system, Scratch scratch) {
    size_t n = (size_t)system->n, d = (size_t)system->d;
    bool *linked = (bool *)take_matrix(&scratch, (int)d, (int)d);
    bool *joined = (bool *)take_matrix(&scratch, (int)n, (int)n);
    memset(joined, 0, n * n * sizeof *joined);
    for (int i = 0; i < system->d * system->d; i++) {
        linked[i] = system->H[i].re != 0.0 || system->H[i].im != 0.0 ||
                    (i / system->d == i % system->d);
        if (linked[i]) {
            link_coordinates(system, i / system->d, i % system->d, joined);
        }
    }
    system->block_count = find_blocks(system->d, linked, system->blocks);
    system->mass_block_count = find_blocks(system->n, joined, system->mass_blocks);
    find_last(system, joined, system->last);
}

/* Copy the arrays that the equations of motion read often, in the order of reading. */
static void pack_blocks(System *system) {
    int d = system->d;
    Complex *next = system->coupling;
    for (int k = 0; k < system->block_count; k++) {
        int start = system->blocks[k].start, size = system->blocks[k].size;
        for (int i = start; i < start + size; i++) {
            memcpy(next, system->H + i * d + start, (size_t)size * sizeof *next);
            for (int j = 0; !system->mapped && j < size; j++) {
                Parts parts = parts_from(system->coupling_parts, (int)(next - system->coupling));
                parts.re[j] = j > i - start ? next[j].re : 0.0;
                parts.im[j] = j > i - start ? next[j].im : 0.0;
            }
            next += size;
            system->own[i] = system->H[i * d + i].re + system->J[i];
        }
    }
    pad(system->n, system->rest, system->straight);
}

/* Add the first and second moments of one mass point, for the directions that move it. */
static void add_moments_of(System *system, double mass, const Complex *A) {
    int d = system->d;
    for (int j = 0; j < d; j++) {
        Complex moment = scaled(mass, A[arm_of(system, j)]);
        if (moment.re == 0.0 && moment.im == 0.0) {
            continue;
        }
        for (int i = 0; i < d; i++) {
            Complex left = conjugate(A[arm_of(system, i)]), *H = &system->H[i * d + j];
            *H = plus(*H, product(left, moment));
        }
        if (arm_of(system, j) == j) {
            system->S[j] = plus(system->S[j], moment);
        }
    }
}

static void add_moments(System *system, Scratch scratch) {
    size_t d = (size_t)system->d;
    memset(system->H, 0, d * d * sizeof *system->H);
    memset(system->S, 0, d * sizeof *system->S);
    for (int k = 0; k < system->p; k++) {
        add_moments_of(system, system->m[k], system->A + (size_t)k * d);
    }
    find_all_blocks(system, scratch);
    pack_blocks(system);
    set_branches(system, scratch);
}

/* Return the largest radius of gyration of a body about its centre of mass [m]. */
static double largest_gyration(const System *system) {
    const Mechanism *m = system->mechanism;
    double largest = 0.0;
    for (int i = 0; i < m->body_count; i++) {
        double mass = evaluate(m->bodies[i].mass, system->values);
        largest = greater(square_root(evaluate(m->bodies[i].inertia, system->values) / mass), largest);
    }
    return largest;
}

/* Return the size of the drawn mechanism [m]: the largest distance between points of the ground and
 * centres of mass, but at least the length of the longest flexure.  Without flexures, hit points
 * count, too; if all points coincide, the size is the largest radius of gyration. */
static double size_of(const System *system, Scratch scratch) {
    const Mechanism *m = system->mechanism;
    int others = m->ground_count + m->body_count;
    int count = others + (m->flexure_count > 0 ? 0 : m->stop_count);
    Complex *points = take_complex(&scratch, count, 1);
    double longest = 0.0;
    for (int i = 0; i < m->flexure_count; i++) {
        const Connection *c = &m->flexures[i].between;
        Complex along = minus(at_point(system, c->end_point), at_point(system, c->start_point));
        longest = greater(modulus(along), longest);
    }
    for (int i = 0; i < count; i++) {
        points[i] = at_point(system, i < m->ground_count ? m->ground[i]
                                     : i < others ? m->bodies[i - m->ground_count].centre
                                                  : m->stops[i - others].point);
        for (int k = 0; k < i; k++) {
            longest = greater(modulus(minus(points[i], points[k])), longest);
        }
    }
    return longest > 0.0 ? longest : largest_gyration(system);
}

static Complex first_ground_end(const System *system) {
    const Mechanism *m = system->mechanism;
    for (int i = 0; i < m->flexure_count; i++) {
        const Connection *c = &m->flexures[i].between;
        if (c->start == GROUND || c->end == GROUND) {
            return at_point(system, c->start == GROUND ? c->start_point : c->end_point);
        }
    }
    return complex_of(0.0, 0.0);
}

/* --- checks ----------------------------------------------------------------------------------- */

/* The name of the body or the flexure that turns or stretches with a coordinate. */
static const char *part_of(const Mechanism *m, int j) {
    int body = m->coordinates[j].body;
    if (body != GROUND) {
        return m->bodies[body - 1].name;
    }
    int i = m->step_count - 1;
    while (m->steps[i].first > j) {
        i--;
    }
    return m->steps[i].name;
}

/* The least ratio of the inertia of a coordinate to the largest one. */
static double least_ratio(const Mechanism *m, int j) {
    return m->coordinates[j].body != GROUND ? INERTIA_RATIO_MIN : FLEXURE_INERTIA_RATIO_MIN;
}

static bool check_ratio(const System *system, const double *M, Problem *problem) {
    const Mechanism *m = system->mechanism;
    int n = system->n, light = 0, heavy = 0;
    double limit = least_ratio(m, 0);
    for (int i = 1; i < n; i++) {
        double own = least_ratio(m, i);
        heavy = M[i * n + i] > M[heavy * n + heavy] ? i : heavy;
        if (M[i * n + i] / own < M[light * n + light] / limit) {
            light = i;
            limit = own;
        }
    }
    double least = M[light * n + light], most = M[heavy * n + heavy];
    if (!(0.0 < least && least < limit * most)) {
        return true;
    }
    return fail(problem,
                "the inertia of %s %s, %.3g kg m2, is less than %g of that of %s %s, %.3g kg m2, so "
                "that round-off would change the motion: check the units of masses, inertias, "
                "densities, lengths and coordinates (numbers without a unit are in SI), or make "
                "the light part heavier",
                m->coordinates[light].body != GROUND ? "body" : "flexure", part_of(m, light), least,
                limit, m->coordinates[heavy].body != GROUND ? "body" : "flexure",
                part_of(m, heavy), most);
}

/* Return whether no pivot of M = Re(U^* G U), G = H + diag(J), is round-off in any configuration U,
 * a diagonal matrix of unit vectors.  The pivots of M are at least those of G: both are minima of
 * the same quadratic form, for M over fewer vectors. */
static bool definite_everywhere(const System *system, Scratch scratch) {
    const Complex *H = system->coupling;
    bool definite = !system->mapped;
    for (int block = 0; definite && block < system->block_count; block++) {
        int start = system->blocks[block].start, size = system->blocks[block].size;
        Scratch inner = scratch;
        Complex *G = take_complex(&inner, size, size);
        memcpy(G, H, (size_t)(size * size) * sizeof *G);
        for (int k = 0; definite && k < size; k++) {
            double diagonal = system->own[start + k];
            double pivot = G[k * size + k].re - H[k * size + k].re + diagonal;
            definite = pivot > SINGULAR_RTOL * diagonal;
            for (int i = k + 1; definite && i < size; i++) {
                Complex share = scaled(1.0 / pivot, G[i * size + k]);
                for (int j = k + 1; j <= i; j++) {
                    Complex *g = &G[i * size + j];
                    *g = minus(*g, product(share, conjugate(G[j * size + k])));
                }
            }
        }
        H += size * size;
    }
    return definite;
}

/* Check the mass matrix, and derive the least mobility of a row from it. */
static bool check_masses(System *system, const Complex *e0, Scratch scratch, Problem *problem) {
    size_t n = (size_t)system->n;
    double *M = take(&scratch, n * n), *w = take(&scratch, n);
    double *scale = take(&scratch, n);
    mass_matrix(system, e0, M, scratch);
    if (!check_ratio(system, M, problem)) {
        return false;
    }
    double row = ROW_RTOL * system->length;
    system->definite = definite_everywhere(system, scratch);
    system->least_mobility = HUGE_VAL;
    bool regular = true;
    for (size_t i = 0; i < n; i++) {
        system->least_mobility = lesser(system->least_mobility, row * row / M[i * n + i]);
        scale[i] = square_root(M[i * n + i]);
        regular = regular && scale[i] > 0.0;
    }
    for (size_t i = 0; regular && i < n * n; i++) {
        M[i] /= scale[i / n] * scale[i % n];
    }
    if (regular) {
        if (!symmetric_eigen(system->n, M, w, NULL, problem)) {
            return false;
        }
        regular = w[0] > SINGULAR_RTOL;
    }
    if (!regular) {
        return fail(problem,
                    "a part that can move has no mass: give the flexures a density and the bodies "
                    "a mass and an inertia");
    }
    return true;
}

/* Compute gamma0, the relative length of the stub, of each type with several pivots. */
static bool stubs(System *system, Scratch scratch, Problem *problem) {
    const Mechanism *m = system->mechanism;
    int count = 0;
    for (int i = 0; i < m->type_count; i++) {
        int pivots = m->types[i].pivots;
        if (pivots < 2) {
            continue;
        }
        Scratch inner = scratch;
        double *gamma = take(&inner, (size_t)pivots), gamma0;
        for (int k = 0; k < pivots; k++) {
            gamma[k] = evaluate(m->types[i].gamma[k], system->values);
        }
        if (!stub(pivots, gamma, &gamma0, problem)) {
            return false;
        }
        system->calculated[count++] = gamma0;
    }
    return true;
}

/* --- assembly --------------------------------------------------------------------------------- */

static void clear(System *system) {
    size_t n = (size_t)system->n, d = (size_t)system->d, b = (size_t)system->b;
    system->p = system->spring_count = system->corner_count = 0;
    memset(system->grounded, 0, (size_t)system->even * sizeof *system->grounded);
    memset(system->q0, 0, n * sizeof *system->q0);
    memset(system->rest, 0, n * sizeof *system->rest);
    memset(system->J, 0, d * sizeof *system->J);
    for (int k = 0; k < system->mechanism->map.count; k++) {
        system->factors[k] = 1.0; /* Beams set their own. */
    }
    memset(system->K, 0, n * n * sizeof *system->K);
    for (size_t i = 0; i <= b; i++) {
        Place *origin = &system->origins[i];
        origin->c = origin->drawn = complex_of(0.0, 0.0);
        origin->j = i == GROUND ? FIXED : NOWHERE;
        origin->moves = false;
        memset(origin->A, 0, d * sizeof *origin->A);
    }
}

/* Set the vector along a coil spring and its law. */
static bool add_coil(System *system, int k, Scratch scratch, Problem *problem) {
    const Coil *coil = &system->mechanism->coils[k];
    const Connection *c = &coil->between;
    const double *values = system->values;
    Place start = new_place(system, &scratch), end = new_place(system, &scratch);
    Complex from = at_point(system, c->start_point), to = at_point(system, c->end_point);
    double apart = modulus(minus(to, from));
    if (!(apart > SPRING_APART_RTOL * system->length)) {
        return fail(problem,
                    "spring %s has the length %.4g m, so that its direction is undefined: draw its "
                    "ends apart",
                    coil->name, apart);
    }
    on_body(system, c->start, from, &start);
    on_body(system, c->end, to, &end);
    for (int j = 0; j < system->d; j++) {
        system->spans[k * system->d + j] = minus(end.A[j], start.A[j]);
    }
    system->spans_c[k] = minus(end.c, start.c);
    SpringLaw law = {evaluate(coil->stiffness, values), evaluate(coil->cubic_stiffness, values),
                     evaluate(coil->damping, values), 0.0, 0.0, coil->side};
    system->laws[k] = law;
    law.drawn_length = spring_state(system, k, system->e0, 1.0).length;
    law.free_length =
        coil->pretensioned ? evaluate(coil->free_length, values) : law.drawn_length;
    system->laws[k] = law;
    return true;
}

/* Return the coordinate that rotates a body; FIXED: the ground. */
static int rotation_of_body(const System *system, int body) {
    int j = system->origins[body].j;
    return j == FIXED ? FIXED : angle_of(system, j);
}

/* Set the torsion at all joints. */
static void add_torsions(System *system) {
    const Mechanism *m = system->mechanism;
    Torsion *torsion = system->torsions;
    for (int i = 0; i < m->joint_count; i++) {
        const Joint *joint = &m->joints[i];
        if (joint->sprung || joint->damped) {
            torsion->stiffness = joint->sprung ? evaluate(joint->stiffness, system->values) : 0.0;
            torsion->damping = joint->damped ? evaluate(joint->damping, system->values) : 0.0;
            torsion->free_angle = joint->turned ? evaluate(joint->free_angle, system->values) : 0.0;
            torsion->a = rotation_of_body(system, joint->between.start);
            torsion->b = rotation_of_body(system, joint->between.end);
            torsion++;
        }
    }
}

/* Add torsion and coil springs, and compute the stiffness of the drawn shape. */
static bool add_elements(System *system, Scratch scratch, Problem *problem) {
    bool ok = true;
    add_torsions(system);
    for (int k = 0; ok && k < system->coil_count; k++) {
        ok = add_coil(system, k, scratch, problem);
    }
    if (ok && system->stiffness != system->K) {
        element_stiffness(system, system->e0, system->stiffness, scratch);
    }
    return ok;
}

static void add_arrays(System *system, Scratch scratch) {
    const Release *release = &system->mechanism->release;
    Complex *e0 = system->e0;
    for (int j = 0; j < system->n; j++) {
        system->rest[j] += system->q0[j]; /* The initial strains are there already. */
    }
    directions(system, system->q0, e0);
    for (int body = 1; body <= system->b; body++) {
        add_body(system, body, scratch);
    }
    add_moments(system, scratch);
    add_stops(system, e0, scratch);
    add_frictions(system, e0, scratch);
    add_pushed_and_probes(system, scratch);
    add_frame(system, release->body, at_point(system, release->point), &system->released, scratch);
    system->release_c =
        along(system->d, unit(release->direction), system->released.A, e0, system->release);
    system->anchor = first_ground_end(system);
}

PRBM bool assemble(System *system, const double *values, Scratch scratch, Problem *problem) {
    const Mechanism *m = system->mechanism;
    system->values = values;
    system->assembly += 1;
    system->gravity = complex_of(values[m->gravity[0]], values[m->gravity[1]]);
    clear(system);
    system->length = size_of(system, scratch);
    bool ok = stubs(system, scratch, problem) && walk_all(system, scratch, problem);
    if (ok) {
        add_arrays(system, scratch);
        ok = add_elements(system, scratch, problem) && add_guides(system, scratch, problem) &&
             check_loops(system, system->e0, scratch, problem) &&
             check_masses(system, system->e0, scratch, problem);
    }
    return ok;
}
