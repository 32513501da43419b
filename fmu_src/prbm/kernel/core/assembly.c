/* The constant arrays of a mechanism with its parameter values: the twin of
 * mechanics/assembly.py. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "core/assembly.h"
#include "core/constraints.h"
#include "core/flexure.h"
#include "core/kinetics.h"
#include "core/matrix.h"
#include "core/vectors.h"

/* --- values, points and masses ---------------------------------------------------------------- */

static Complex at_point(const System *system, Point point) {
    return complex_of(evaluate(point.x, system->values), evaluate(point.y, system->values));
}

/* Add a vector that turns with coordinate j to a place. */
static void extend(Place *spot, int j, Complex vector) {
    if (j == FIXED) {
        spot->c = plus(spot->c, vector);
    } else {
        spot->A[j] = plus(spot->A[j], vector);
        spot->moves = true;
    }
}

static void copy_place(int n, Place *to, const Place *from) {
    to->c = from->c;
    to->moves = from->moves;
    memcpy(to->A, from->A, (size_t)n * sizeof *to->A);
}

/* Set the place of a point of a body, given by its drawn position. */
static void on_body(const System *system, int body, Complex drawn, Place *result) {
    const Place *origin = &system->origins[body];
    copy_place(system->n, result, origin);
    extend(result, origin->j, minus(drawn, origin->drawn));
}

/* Add a point mass, unless it is fixed to the ground. */
static void add_mass(System *system, const Place *spot, double mass) {
    if (mass > 0.0 && spot->moves) {
        int n = system->n, i = system->p++;
        memcpy(system->A + i * n, spot->A, (size_t)n * sizeof *spot->A);
        system->c[i] = spot->c;
        system->m[i] = mass;
    }
}

/* Add a uniform rod that turns with coordinate j, as two points with the same moments of mass. */
static void add_rod(System *system, double mass, const Place *start, int j, Complex vector,
                    Place *spare) {
    static const double FRACTIONS[2] = {0.21132486540518708, 0.7886751345948129};
    for (int i = 0; i < 2; i++) { /* At the fractions 1/2 -+ 1/(2 sqrt 3). */
        copy_place(system->n, spare, start);
        extend(spare, j, scaled(FRACTIONS[i], vector));
        add_mass(system, spare, mass / 2);
    }
}

static void add_spring(System *system, double rate, int a, int b) {
    int n = system->n;
    Spring spring = {rate, a == FIXED ? n : a, b == FIXED ? n : b};
    system->spring[system->spring_count++] = spring;
    if (a != FIXED) {
        system->K[a * n + a] += rate;
    }
    if (b != FIXED) {
        system->K[b * n + b] += rate;
    }
    if (a != FIXED && b != FIXED) {
        system->K[a * n + b] -= rate;
        system->K[b * n + a] -= rate;
    }
}

static Place new_place(int n, Scratch *scratch) {
    Place result = {{0.0, 0.0}, {0.0, 0.0}, NULL, FIXED, false};
    result.A = (Complex *)take(scratch, 2 * (size_t)n);
    memset(result.A, 0, (size_t)n * sizeof *result.A);
    return result;
}

/* --- flexures and joints, from the ground outwards -------------------------------------------- */

static void take_segments(Segments *pieces, int longest, Scratch *scratch) {
    size_t most = (size_t)longest + 2;
    pieces->lengths = take(scratch, most);
    pieces->rates = take(scratch, most);
    pieces->rods = take(scratch, most);
    pieces->lumps = take(scratch, most);
    pieces->axial = take(scratch, most);
}

static bool cut_flexure(const System *system, const Flexure *flexure, Segments *pieces,
                        Scratch *scratch, Problem *problem) {
    const FlexureType *kind = &system->mechanism->types[flexure->type];
    const Connection *between = &flexure->between;
    double L = modulus(minus(at_point(system, between->end_point),
                             at_point(system, between->start_point)));
    if (!(L >= LENGTH_MIN)) {
        return fail(problem, "flexure %s has the length %g m: move its ends apart", flexure->name,
                    L);
    }
    size_t pivots = (size_t)kind->pivots;
    double *gamma = take(scratch, pivots), *K_theta = take(scratch, pivots);
    for (size_t i = 0; i < pivots; i++) {
        gamma[i] = evaluate(kind->gamma[i], system->values);
        K_theta[i] = evaluate(kind->K_theta[i], system->values);
    }
    double h = evaluate(kind->thickness, system->values);
    double b = evaluate(kind->width, system->values);
    double E = evaluate(kind->youngs_modulus, system->values);
    double rho = evaluate(kind->density, system->values);
    double EI = E * b * (h * h * h) / 12, EA = E * b * h, mass = rho * b * h * L;
    take_segments(pieces, system->mechanism->longest, scratch);
    return segments(kind, gamma, K_theta, flexure->type_at_start, flexure->type_at_end, L, EI,
                    mass, EA, pieces, problem);
}

/* Add the loop constraint that two places coincide. */
static void close_loop(System *system, const Place *spot, const Place *other) {
    int n = system->n;
    Complex *x = system->loops + system->r * n, *y = x + n;
    for (int j = 0; j < n; j++) {
        x[j] = minus(spot->A[j], other->A[j]);
        y[j] = complex_of(x[j].im, -x[j].re);
    }
    Complex c = minus(spot->c, other->c);
    system->loops_c[system->r] = c.re;
    system->loops_c[system->r + 1] = c.im;
    system->r += 2;
}

/* Set the origin of a body: a place, its drawn position and the coordinate of the body. */
static void reach(System *system, int body, const Place *spot, Complex drawn, int j) {
    Place *origin = &system->origins[body];
    copy_place(system->n, origin, spot);
    origin->drawn = drawn;
    origin->j = j;
}

/* The bodies at the ends of a step, root first, and the drawn positions of both ends. */
typedef struct {
    int root, far;
    Complex z_start, z_end;
} Span;

static Span span_of(const System *system, const Step *step) {
    const Connection *c = step->between;
    Complex start = at_point(system, c->start_point), end = at_point(system, c->end_point);
    Span forwards = {c->start, c->end, start, end}, backwards = {c->end, c->start, end, start};
    return step->backwards ? backwards : forwards;
}

static bool walk_joint(System *system, const Step *step, Scratch *scratch, Problem *problem) {
    Span span = span_of(system, step);
    double apart = modulus(minus(span.z_end, span.z_start));
    if (!(apart <= JOINT_DISTANCE_RTOL * system->length)) {
        return fail(problem,
                    "the joint %s joins points that are drawn %.4g m apart: draw them at the same "
                    "place",
                    step->name, apart);
    }
    Place spot = new_place(system->n, scratch), other = new_place(system->n, scratch);
    on_body(system, span.root, span.z_start, &spot);
    if (step->closes) {
        on_body(system, span.far, span.z_end, &other);
        close_loop(system, &spot, &other);
    } else {
        reach(system, span.far, &spot, span.z_end, step->first);
    }
    return true;
}

/* Set the angle of a link and, if it stretches, its axial spring; return the next coordinate. */
static int lay_link(System *system, Complex direction, double length, double axial, bool stretching,
                    int j) {
    system->q0[j] = phase(direction);
    if (stretching) {
        add_spring(system, axial * (length * length), FIXED, j + 1);
    }
    return stretching ? j + 2 : j + 1;
}

static bool is_stretch(const System *system, int j) {
    return j < system->n && arm_of(system, j) != j;
}

static bool walk_flexure(System *system, const Step *step, Scratch *scratch, Problem *problem) {
    int n = system->n;
    Segments pieces = {0, NULL, NULL, NULL, NULL, NULL};
    if (!cut_flexure(system, step->flexure, &pieces, scratch, problem)) {
        return false;
    }
    if (step->backwards) {
        reversed(&pieces);
    }
    Span span = span_of(system, step);
    Complex vector_to_end = minus(span.z_end, span.z_start);
    Complex direction = scaled(1.0 / modulus(vector_to_end), vector_to_end);
    Place spot = new_place(n, scratch), spare = new_place(n, scratch);
    on_body(system, span.root, span.z_start, &spot);
    int *owners = take_integers(scratch, pieces.n + 2), next = step->first;
    owners[0] = system->origins[span.root].j;
    for (int i = 1; i <= pieces.n; i++) {
        owners[i] = next;
        next = lay_link(system, direction, pieces.lengths[i], pieces.axial[i - 1],
                        is_stretch(system, next + 1), next);
    }
    int far = owners[pieces.n + 1] = step->closes ? system->origins[span.far].j : next;
    for (int i = 0; i <= pieces.n; i++) {
        /* In the drawing the angle of a body is 0, that of a link its direction. */
        Complex vector = i == 0 ? scaled(pieces.lengths[i], direction)
                                : complex_of(pieces.lengths[i], 0.0);
        add_rod(system, pieces.rods[i], &spot, owners[i], vector, &spare);
        extend(&spot, owners[i], vector);
        add_mass(system, &spot, pieces.lumps[i]);
        add_spring(system, pieces.rates[i], owners[i], owners[i + 1]);
    }
    Complex last = scaled(pieces.lengths[pieces.n + 1], direction);
    if (step->closes) {
        on_body(system, span.far, minus(span.z_end, last), &spare);
        close_loop(system, &spot, &spare);
        copy_place(n, &spot, &spare); /* The last stub is part of the far body. */
    } else {
        reach(system, span.far, &spot, minus(span.z_end, last), far);
    }
    add_rod(system, pieces.rods[pieces.n + 1], &spot, far, last, &spare);
    return true;
}

static bool walk_all(System *system, Scratch *scratch, Problem *problem) {
    const Mechanism *m = system->mechanism;
    bool ok = true;
    system->r = 0;
    for (int i = 0; ok && i < m->flexure_count + m->joint_count; i++) {
        size_t mark = scratch->used;
        const Step *step = &m->steps[i];
        ok = step->flexure ? walk_flexure(system, step, scratch, problem)
                           : walk_joint(system, step, scratch, problem);
        scratch->used = mark;
    }
    system->r = m->loop_count;
    return ok;
}

/* Set the frame of a point of a body, given by its drawn position. */
static void add_frame(System *system, int body, Complex drawn, BodyFrame *frame,
                      Scratch *scratch) {
    size_t mark = scratch->used;
    Place spot = new_place(system->n, scratch);
    on_body(system, body, drawn, &spot);
    frame->j = system->origins[body].j;
    frame->c = spot.c;
    frame->drawn = drawn;
    memcpy(frame->A, spot.A, (size_t)system->n * sizeof *frame->A);
    scratch->used = mark;
}

static void add_body(System *system, int body, Scratch *scratch) {
    size_t mark = scratch->used;
    const Body *part = &system->mechanism->bodies[body - 1];
    BodyFrame *frame = &system->bodies[body - 1];
    Complex drawn = at_point(system, part->centre);
    Place centre = new_place(system->n, scratch);
    on_body(system, body, drawn, &centre);
    add_mass(system, &centre, evaluate(part->mass, system->values));
    add_frame(system, body, drawn, frame, scratch);
    system->J[frame->j] += evaluate(part->inertia, system->values);
    scratch->used = mark;
}

static void add_pushed_and_probes(System *system, Scratch *scratch) {
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
static double along(int n, Complex u, const Complex *A, const Complex *e0, Complex *B) {
    double c = 0.0;
    for (int j = 0; j < n; j++) {
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
    int n = system->n;
    Complex u = unit(stop->direction), across = product(complex_of(0.0, 1.0), u);
    double offset = evaluate(stop->offset, system->values);
    Complex drawn = plus(at_point(system, stop->point), scaled(offset, across));
    Complex *gap = system->gaps + i * n, *slide = system->slides + i * n;
    on_body(system, stop->body, drawn, hit);
    system->on[i] = origin->j;
    system->gaps_z[i] = system->slides_z[i] = complex_of(0.0, 0.0);
    if (origin->j != FIXED) {
        for (int j = 0; j < n; j++) {
            hit->A[j] = minus(hit->A[j], origin->A[j]);
        }
        Complex apart = minus(hit->c, origin->c);
        system->gaps_z[i] = product(conjugate(scaled(-1.0, u)), apart);
        system->slides_z[i] = product(conjugate(across), apart);
    }
    double straight = along(n, scaled(-1.0, u), hit->A, e0, gap);
    along(n, across, hit->A, e0, slide);
    Complex seen_drawn = product(conjugate(u), minus(drawn, origin->drawn));
    system->gaps_c[i] = origin->j == FIXED ? straight : seen_drawn.re;
}

static void add_stops(System *system, const Complex *e0, Scratch *scratch) {
    size_t mark = scratch->used;
    Place hit = new_place(system->n, scratch);
    for (int i = 0; i < system->s; i++) {
        add_stop(system, i, e0, &hit);
    }
    scratch->used = mark;
}

static void add_frictions(System *system, const Complex *e0, Scratch *scratch) {
    size_t mark = scratch->used;
    int n = system->n;
    Place spot = new_place(n, scratch);
    for (int i = 0; i < system->f; i++) {
        const Friction *friction = &system->mechanism->frictions[i];
        Complex u = unit(friction->direction), across = product(complex_of(0.0, 1.0), u);
        on_body(system, friction->body, at_point(system, friction->point), &spot);
        along(n, u, spot.A, e0, system->rubs + i * n);
        system->lifts_c[i] = along(n, across, spot.A, e0, system->lifts + i * n);
    }
    scratch->used = mark;
}

/* Return the end of the block of the mass matrix that begins at start.  The coordinates from this
 * end on share no mass with the block. */
static int end_of_block(const System *system, int start) {
    int n = system->n, end = start + 1;
    for (int j = start; j < end; j++) {
        for (int i = end; i < n; i++) {
            Complex shared = system->H[i * n + j];
            end = shared.re != 0.0 || shared.im != 0.0 ? i + 1 : end;
        }
    }
    return end;
}

static void find_blocks(System *system) {
    system->block_count = 0;
    for (int start = 0; start < system->n;) {
        int end = end_of_block(system, start);
        Block block = {start, end - start};
        system->blocks[system->block_count++] = block;
        start = end;
    }
}

/* Copy the arrays that the equations of motion read often, in the order of reading. */
static void pack_blocks(System *system) {
    int n = system->n;
    Complex *next = system->coupling;
    for (int k = 0; k < system->block_count; k++) {
        int start = system->blocks[k].start, size = system->blocks[k].size;
        for (int i = start; i < start + size; i++) {
            memcpy(next, system->H + i * n + start, (size_t)size * sizeof *next);
            next += size;
            system->own[i] = system->H[i * n + i].re + system->J[i];
        }
    }
    pad(n, system->q0, system->straight);
}

/* Add the first and second moments of one mass point, for the coordinates that move it. */
static void add_moments_of(System *system, double mass, const Complex *A) {
    int n = system->n;
    for (int j = 0; j < n; j++) {
        Complex moment = scaled(mass, A[arm_of(system, j)]);
        if (moment.re == 0.0 && moment.im == 0.0) {
            continue;
        }
        for (int i = 0; i < n; i++) {
            Complex left = conjugate(A[arm_of(system, i)]), *H = &system->H[i * n + j];
            *H = plus(*H, product(left, moment));
        }
        if (arm_of(system, j) == j) {
            system->S[j] = plus(system->S[j], moment);
        }
    }
}

static void add_moments(System *system) {
    size_t n = (size_t)system->n;
    memset(system->H, 0, n * n * sizeof *system->H);
    memset(system->S, 0, n * sizeof *system->S);
    for (int k = 0; k < system->p; k++) {
        add_moments_of(system, system->m[k], system->A + (size_t)k * n);
    }
    find_blocks(system);
    pack_blocks(system);
}

/* Return the size of the drawn mechanism [m]: the largest distance between points of the ground and
 * centres of mass, but at least the length of the longest flexure. */
static double size_of(const System *system, Scratch *scratch) {
    const Mechanism *m = system->mechanism;
    size_t mark = scratch->used;
    int count = m->ground_count + m->body_count;
    Complex *points = take_complex(scratch, count, 1);
    double longest = 0.0;
    for (int i = 0; i < m->flexure_count; i++) {
        const Connection *c = &m->flexures[i].between;
        Complex along = minus(at_point(system, c->end_point), at_point(system, c->start_point));
        longest = greater(modulus(along), longest);
    }
    for (int i = 0; i < count; i++) {
        points[i] = at_point(system, i < m->ground_count ? m->ground[i]
                                                         : m->bodies[i - m->ground_count].centre);
        for (int k = 0; k < i; k++) {
            longest = greater(modulus(minus(points[i], points[k])), longest);
        }
    }
    scratch->used = mark;
    return longest;
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

/* The name of the part that turns or stretches with a coordinate. */
static const char *part_of(const System *system, int j) {
    for (int body = 1; body <= system->b; body++) {
        if (system->origins[body].j == j) {
            return system->mechanism->bodies[body - 1].name;
        }
    }
    return NULL;
}

static bool check_ratio(const System *system, const double *M, Problem *problem) {
    int n = system->n, light = 0, heavy = 0;
    for (int i = 1; i < n; i++) {
        light = M[i * n + i] < M[light * n + light] ? i : light;
        heavy = M[i * n + i] > M[heavy * n + heavy] ? i : heavy;
    }
    double least = M[light * n + light], most = M[heavy * n + heavy];
    if (!(0.0 < least && least < INERTIA_RATIO_MIN * most)) {
        return true;
    }
    const char *first = part_of(system, light), *second = part_of(system, heavy);
    return fail(problem,
                "the inertia of %s%s, %.3g kg m2, is less than %g of that of %s%s, %.3g kg m2, so "
                "that round-off would change the motion: check the units of masses, inertias, "
                "densities and lengths, and make the light part heavier",
                first ? "body " : "a flexure link", first ? first : "", least, INERTIA_RATIO_MIN,
                second ? "body " : "a flexure link", second ? second : "", most);
}

static bool check_masses(const System *system, const Complex *e0, Scratch *scratch,
                         Problem *problem) {
    size_t mark = scratch->used, n = (size_t)system->n;
    double *M = take(scratch, n * n), *C = take(scratch, n * n), *w = take(scratch, n);
    double *scale = take(scratch, n);
    inertia(system->n, system->H, system->J, e0, M, C);
    if (!check_ratio(system, M, problem)) {
        scratch->used = mark;
        return false;
    }
    bool regular = true;
    for (size_t i = 0; i < n; i++) {
        scale[i] = sqrt(M[i * n + i]);
        regular = regular && scale[i] > 0.0;
    }
    for (size_t i = 0; regular && i < n * n; i++) {
        M[i] /= scale[i / n] * scale[i % n];
    }
    if (regular) {
        if (!symmetric_eigen(system->n, M, w, NULL, problem)) {
            scratch->used = mark;
            return false;
        }
        regular = w[0] > MASSLESS_RTOL;
    }
    scratch->used = mark;
    if (!regular) {
        return fail(problem,
                    "a part that can move has no mass: give the flexures a density and the bodies "
                    "a mass and an inertia");
    }
    return true;
}

/* Find the longest of the rows k to r - 1, exchange it with row k, and return its length.  The loop
 * numbers of both rows are exchanged, too. */
static double choose_row(int k, int r, int n, double *rows, int *loop) {
    int best = k;
    double most = dot(n, rows + k * n, rows + k * n);
    for (int i = k + 1; i < r; i++) {
        double square = dot(n, rows + i * n, rows + i * n);
        best = square > most ? i : best;
        most = greater(square, most);
    }
    int chosen = loop[best];
    loop[best] = loop[k];
    loop[k] = chosen;
    exchange(n, rows + k * n, rows + best * n);
    return sqrt(most);
}

/* Find the loops with linearly dependent rows by Gram-Schmidt orthogonalisation with pivoting. */
static bool repeated_loops(int r, int n, double *rows, int *loop, double tolerance,
                           bool *repeated) {
    bool any = false;
    for (int k = 0; k < r; k++) {
        double length = choose_row(k, r, n, rows, loop), *row = rows + k * n;
        if (!(length > tolerance)) {
            repeated[loop[k]] = any = true;
            continue;
        }
        for (int i = k + 1; i < r; i++) {
            double share = dot(n, row, rows + i * n) / (length * length);
            add_scaled(n, -share, row, rows + i * n);
        }
    }
    return any;
}

/* List the names of the flexures and joints that close these loops, in alphabetical order. */
static void name_loops(const Mechanism *m, bool *repeated, char *text, size_t size) {
    text[0] = '\0';
    for (size_t used = 0;;) {
        const char *next = NULL;
        int which = 0;
        for (int i = 0, loop = 0; i < m->flexure_count + m->joint_count; i++) {
            const Step *step = &m->steps[i];
            if (step->closes && repeated[loop] && (!next || strcmp(step->name, next) < 0)) {
                next = step->name;
                which = loop;
            }
            loop += step->closes;
        }
        if (!next || used + strlen(next) + 3 > size) {
            return;
        }
        repeated[which] = false;
        used += (size_t)snprintf(text + used, size - used, "%s%s", used ? ", " : "", next);
    }
}

static bool check_loops(const System *system, const Complex *e0, Scratch *scratch,
                        Problem *problem) {
    size_t mark = scratch->used;
    int r = system->r, n = system->n;
    double *rows = take_matrix(scratch, r, n);
    int *loop = take_integers(scratch, r);
    bool *repeated = (bool *)take_integers(scratch, r);
    char names[PROBLEM_LENGTH / 2];
    for (int i = 0; i < r; i++) {
        loop[i] = i / 2;
        repeated[i] = false;
    }
    Rows loops = plain_rows(system, r, system->loops, system->loops_c);
    jacobian(&loops, e0, rows);
    double scale = largest(r * n, rows);
    bool any = repeated_loops(r, n, rows, loop, DEPENDENT_LOOP_RTOL * scale, repeated);
    name_loops(system->mechanism, repeated, names, sizeof names);
    scratch->used = mark;
    return !any || fail(problem,
                        "the constraints of the loops closed by %s depend on those of other loops "
                        "at the straight shape: rigid links are over-constrained there; remove a "
                        "part, move it out of line, or let flexures stretch (axial = true)",
                        names);
}

/* Compute gamma0, the relative length of the stub, of each type with several pivots. */
static bool stubs(System *system, Scratch *scratch, Problem *problem) {
    const Mechanism *m = system->mechanism;
    int count = 0;
    for (int i = 0; i < m->type_count; i++) {
        size_t mark = scratch->used;
        int pivots = m->types[i].pivots;
        if (pivots < 2) {
            continue;
        }
        double *gamma = take(scratch, (size_t)pivots), gamma0;
        for (int k = 0; k < pivots; k++) {
            gamma[k] = evaluate(m->types[i].gamma[k], system->values);
        }
        bool ok = stub(pivots, gamma, &gamma0, problem);
        scratch->used = mark;
        if (!ok) {
            return false;
        }
        system->calculated[count++] = gamma0;
    }
    return true;
}

/* --- assembly --------------------------------------------------------------------------------- */

static void clear(System *system) {
    size_t n = (size_t)system->n, b = (size_t)system->b;
    system->p = system->spring_count = 0;
    memset(system->q0, 0, n * sizeof *system->q0);
    memset(system->J, 0, n * sizeof *system->J);
    memset(system->K, 0, n * n * sizeof *system->K);
    for (size_t i = 0; i <= b; i++) {
        Place *origin = &system->origins[i];
        origin->c = origin->drawn = complex_of(0.0, 0.0);
        origin->j = i == GROUND ? FIXED : NOWHERE;
        origin->moves = false;
        memset(origin->A, 0, n * sizeof *origin->A);
    }
}

static void add_arrays(System *system, Scratch *scratch) {
    const Release *release = &system->mechanism->release;
    Complex *e0 = system->e0;
    directions(system, system->q0, e0);
    for (int body = 1; body <= system->b; body++) {
        add_body(system, body, scratch);
    }
    add_moments(system);
    add_stops(system, e0, scratch);
    add_frictions(system, e0, scratch);
    add_pushed_and_probes(system, scratch);
    add_frame(system, release->body, at_point(system, release->point), &system->released, scratch);
    system->release_c =
        along(system->n, unit(release->direction), system->released.A, e0, system->release);
    system->anchor = first_ground_end(system);
}

PRBM bool assemble(System *system, const double *values, Scratch *scratch, Problem *problem) {
    const Mechanism *m = system->mechanism;
    size_t mark = scratch->used;
    system->values = values;
    system->gravity = complex_of(values[m->gravity[0]], values[m->gravity[1]]);
    clear(system);
    system->length = size_of(system, scratch);
    bool ok = stubs(system, scratch, problem) && walk_all(system, scratch, problem);
    if (ok) {
        add_arrays(system, scratch);
        ok = check_loops(system, system->e0, scratch, problem) &&
             check_masses(system, system->e0, scratch, problem);
    }
    scratch->used = mark;
    return ok;
}
