/* From a mechanism and parameter values to the constant arrays: the twin of prbm/assembly.py. */
#include <math.h>
#include <string.h>

#include "kernel.h"

enum { NOWHERE = -2, FIXED = -1 }; /* coordinates of a body not reached yet, of the ground */

PRBM Complex complex_of(double re, double im) {
    Complex z = {re, im};
    return z;
}

PRBM Complex plus(Complex a, Complex b) {
    return complex_of(a.re + b.re, a.im + b.im);
}

PRBM Complex minus(Complex a, Complex b) {
    return complex_of(a.re - b.re, a.im - b.im);
}

PRBM Complex product(Complex a, Complex b) {
    return complex_of(a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re);
}

PRBM Complex conjugate(Complex a) {
    return complex_of(a.re, -a.im);
}

PRBM Complex scaled(double x, Complex a) {
    return complex_of(x * a.re, x * a.im);
}

PRBM double modulus(Complex a) {
    return sqrt(a.re * a.re + a.im * a.im);
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
    result.rubs = place(memory, f * n, sizeof(Complex));
    result.lifts = place(memory, f * n, sizeof(Complex));
    result.lifts_c = place(memory, f, sizeof(double));
    result.release = place(memory, n, sizeof(Complex));
    result.bodies = place(memory, b, sizeof(BodyFrame));
    result.origins = place(memory, b + 1, sizeof(Place));
    Complex *frames = place(memory, b * n, sizeof(Complex));
    Complex *origins = place(memory, (b + 1) * n, sizeof(Complex));
    result.links = place(memory, n, sizeof(int));
    result.spring = place(memory, p, sizeof(Spring));
    result.blocks = place(memory, n, sizeof(Block));
    result.coupling = place(memory, n * n, sizeof(Complex));
    result.own = place(memory, n, sizeof(double));
    result.straight = place(memory, (size_t)result.even, sizeof(double));
    result.calculated = place(memory, (size_t)m->type_count, sizeof(double));
    if (memory->base) {
        for (size_t i = 0; i < b; i++) {
            result.bodies[i].A = frames + i * n;
        }
        for (size_t i = 0; i <= b; i++) {
            result.origins[i].A = origins + i * n;
        }
    }
    *system = result;
}

/* --- values and places ------------------------------------------------------------------------ */

static Complex at_point(const System *system, Point point) {
    return complex_of(evaluate(point.x, system->values), evaluate(point.y, system->values));
}

/* The place at the end of a vector fixed to a coordinate. */
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

/* The place of a drawn point of a body. */
static void on_body(const System *system, int body, Complex drawn, Place *result) {
    const Place *origin = &system->origins[body];
    copy_place(system->n, result, origin);
    extend(result, origin->j, minus(drawn, origin->drawn));
}

/* A point mass, unless it is part of the ground. */
static void add_mass(System *system, const Place *spot, double mass) {
    if (mass > 0.0 && spot->moves) {
        int n = system->n, i = system->p++;
        memcpy(system->A + i * n, spot->A, (size_t)n * sizeof *spot->A);
        system->c[i] = spot->c;
        system->m[i] = mass;
    }
}

/* A slender rod that is fixed to coordinate j. */
static void add_rod(System *system, double mass, const Place *start, int j, Complex vector,
                    Place *spare) {
    copy_place(system->n, spare, start);
    extend(spare, j, scaled(0.5, vector));
    add_mass(system, spare, mass);
    if (j != FIXED) {
        double length = modulus(vector);
        system->J[j] += mass * (length * length) / 12;
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

/* --- walking ---------------------------------------------------------------------------------- */

typedef struct {
    int coordinates, links, loops; /* so far */
} Walk;

static bool cut_flexure(const System *system, const Flexure *flexure, Complex z_start,
                        Complex z_end, Segments *pieces, Scratch *scratch, Problem *problem) {
    const FlexureType *kind = &system->mechanism->types[flexure->type];
    double L = modulus(minus(z_end, z_start));
    if (!(L >= 1e-9)) {
        return fail(problem, "flexure %s has the length %g m: move its ends apart", flexure->name,
                    L);
    }
    size_t pivots = (size_t)kind->pivots, most = 2 * pivots + 2;
    double *gamma = take(scratch, pivots), *K_theta = take(scratch, pivots);
    for (size_t i = 0; i < pivots; i++) {
        gamma[i] = evaluate(kind->gamma[i], system->values);
        K_theta[i] = evaluate(kind->K_theta[i], system->values);
    }
    pieces->lengths = take(scratch, most);
    pieces->rates = take(scratch, most);
    pieces->rods = take(scratch, most);
    pieces->lumps = take(scratch, most);
    double h = evaluate(kind->thickness, system->values);
    double b = evaluate(kind->width, system->values);
    double E = evaluate(kind->youngs_modulus, system->values);
    double rho = evaluate(kind->density, system->values);
    double EI = E * b * (h * h * h) / 12, mass = rho * b * h * L;
    return segments(kind, gamma, K_theta, flexure->clamped_start, flexure->clamped_end, L, EI,
                    mass, pieces, problem);
}

/* Close a loop: the end of a chain meets a body that is held already. */
static void close_loop(System *system, Walk *walk, const Place *spot, const Place *pivot) {
    int n = system->n;
    Complex *x = system->loops + walk->loops * n, *y = x + n;
    for (int j = 0; j < n; j++) {
        x[j] = minus(spot->A[j], pivot->A[j]);
        y[j] = complex_of(x[j].im, -x[j].re);
    }
    Complex c = minus(spot->c, pivot->c);
    system->loops_c[walk->loops] = c.re;
    system->loops_c[walk->loops + 1] = c.im;
    walk->loops += 2;
}

static bool walk_flexure(System *system, const Flexure *flexure, Walk *walk, Scratch *scratch,
                         Problem *problem) {
    int n = system->n, root = flexure->start, far = flexure->end;
    Complex z_start = at_point(system, flexure->start_point);
    Complex z_end = at_point(system, flexure->end_point);
    Segments pieces = {0, NULL, NULL, NULL, NULL};
    if (!cut_flexure(system, flexure, z_start, z_end, &pieces, scratch, problem)) {
        return false;
    }
    if (system->origins[root].j == NOWHERE) {
        root = flexure->end;
        far = flexure->start;
        Complex kept_one = z_start;
        z_start = z_end;
        z_end = kept_one;
        reverse(pieces.n + 2, pieces.lengths);
        reverse(pieces.n + 2, pieces.rods);
        reverse(pieces.n + 1, pieces.rates);
        reverse(pieces.n + 1, pieces.lumps);
    }
    Complex along_it = minus(z_end, z_start);
    Complex direction = scaled(1.0 / modulus(along_it), along_it);
    Place spot = new_place(n, scratch), spare = new_place(n, scratch);
    on_body(system, root, z_start, &spot);
    int first = walk->coordinates, owner = system->origins[root].j;
    for (int i = 0; i < pieces.n; i++) {
        system->q0[first + i] = phase(direction);
        system->links[walk->links++] = first + i;
    }
    walk->coordinates += pieces.n;
    bool reaches = system->origins[far].j == NOWHERE;
    int far_index = reaches ? walk->coordinates++ : system->origins[far].j;
    for (int i = 0; i <= pieces.n; i++) {
        int j = i == 0 ? owner : first + i - 1, next = i == pieces.n ? far_index : first + i;
        /* links carry their angle in q, bodies are drawn with q = 0 */
        Complex vector = i == 0 ? scaled(pieces.lengths[i], direction)
                                : complex_of(pieces.lengths[i], 0.0);
        add_rod(system, pieces.rods[i], &spot, j, vector, &spare);
        extend(&spot, j, vector);
        add_mass(system, &spot, pieces.lumps[i]);
        add_spring(system, pieces.rates[i], j, next);
    }
    Complex last = scaled(pieces.lengths[pieces.n + 1], direction);
    if (reaches) {
        Place *origin = &system->origins[far];
        copy_place(n, origin, &spot);
        origin->j = far_index;
        origin->drawn = minus(z_end, last);
    } else {
        on_body(system, far, minus(z_end, last), &spare);
        close_loop(system, walk, &spot, &spare);
        copy_place(n, &spot, &spare); /* the stub moves with its body: links share no mass with it */
    }
    add_rod(system, pieces.rods[pieces.n + 1], &spot, far_index, last, &spare);
    return true;
}

/* The flexure to go on with: the first that touches what is held and has not been walked. */
static const Flexure *next_flexure(const System *system, const bool *walked) {
    const Mechanism *m = system->mechanism;
    for (int i = 0; i < m->flexure_count; i++) {
        const Flexure *f = &m->flexures[i];
        if (!walked[i] &&
            (system->origins[f->start].j != NOWHERE || system->origins[f->end].j != NOWHERE)) {
            return f;
        }
    }
    return NULL;
}

static bool walk_all(System *system, Scratch *scratch, Problem *problem) {
    const Mechanism *m = system->mechanism;
    Walk walk = {0, 0, 0};
    size_t mark = scratch->used;
    bool *walked = (bool *)take(scratch, (size_t)m->flexure_count);
    memset(walked, 0, (size_t)m->flexure_count * sizeof *walked);
    for (int i = 0; i < m->flexure_count; i++) {
        const Flexure *flexure = next_flexure(system, walked);
        if (!flexure) {
            return fail(problem, "a flexure has no connection to the ground");
        }
        walked[flexure - m->flexures] = true;
        size_t here = scratch->used;
        if (!walk_flexure(system, flexure, &walk, scratch, problem)) {
            return false;
        }
        scratch->used = here;
    }
    scratch->used = mark;
    return true;
}

static void add_body(System *system, int body, Scratch *scratch) {
    size_t mark = scratch->used;
    const Body *part = &system->mechanism->bodies[body - 1];
    BodyFrame *frame = &system->bodies[body - 1];
    Place centre = new_place(system->n, scratch);
    frame->drawn = at_point(system, part->centre);
    on_body(system, body, frame->drawn, &centre);
    add_mass(system, &centre, evaluate(part->mass, system->values));
    frame->j = system->origins[body].j;
    frame->c = centre.c;
    memcpy(frame->A, centre.A, (size_t)system->n * sizeof *frame->A);
    system->J[frame->j] += evaluate(part->inertia, system->values);
    scratch->used = mark;
}

/* --- arrays ----------------------------------------------------------------------------------- */

/* B, c of the displacement of a place along u from the straight shape. */
static double along(int n, Complex u, const Complex *A, const Complex *e0, Complex *B) {
    double c = 0.0;
    for (int j = 0; j < n; j++) {
        B[j] = product(conjugate(u), A[j]);
        c += product(B[j], e0[j]).re;
    }
    return -c;
}

PRBM Complex unit(double degrees) {
    static const double RADIANS = 0.017453292519943295; /* pi / 180 */
    double quarters = floor(degrees / 90.0), rest = degrees - 90.0 * quarters;
    int quarter = (int)(quarters - 4.0 * floor(quarters / 4.0));
    double angle = rest * RADIANS;
    Complex e = {1.0, 0.0};
    if (rest != 0.0) {
        directions(1, &angle, &e);
    }
    for (int i = 0; i < quarter; i++) {
        e = complex_of(-e.im, e.re);
    }
    return e;
}

static void add_stops(System *system, const Complex *e0, Scratch *scratch) {
    size_t mark = scratch->used;
    int n = system->n;
    Place hit = new_place(n, scratch);
    for (int i = 0; i < system->s; i++) {
        const Stop *stop = &system->mechanism->stops[i];
        Complex u = unit(stop->direction), across = product(complex_of(0.0, 1.0), u);
        double offset = evaluate(stop->offset, system->values);
        Complex drawn = plus(at_point(system, stop->point), scaled(offset, across));
        on_body(system, stop->body, drawn, &hit);
        Complex *gap = system->gaps + i * n, *slide = system->slides + i * n;
        system->gaps_c[i] = along(n, scaled(-1.0, u), hit.A, e0, gap);
        along(n, across, hit.A, e0, slide);
    }
    scratch->used = mark;
}

static void add_frictions(System *system, const Complex *e0) {
    int n = system->n;
    for (int i = 0; i < system->f; i++) {
        const Friction *friction = &system->mechanism->frictions[i];
        const Complex *A = system->bodies[friction->body - 1].A;
        Complex u = unit(friction->direction), across = product(complex_of(0.0, 1.0), u);
        along(n, u, A, e0, system->rubs + i * n);
        system->lifts_c[i] = along(n, across, A, e0, system->lifts + i * n);
    }
}

/* The first coordinate after a start with which none before it shares mass. */
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

/* What the equations of motion read again and again, as they go along it. */
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

static void add_moments(System *system) {
    int n = system->n;
    for (int i = 0; i < n; i++) {
        for (int j = 0; j < n; j++) {
            Complex sum = {0.0, 0.0};
            for (int k = 0; k < system->p; k++) {
                Complex left = scaled(system->m[k], system->A[k * n + j]);
                sum = plus(sum, product(conjugate(system->A[k * n + i]), left));
            }
            system->H[i * n + j] = sum;
        }
        Complex sum = {0.0, 0.0};
        for (int k = 0; k < system->p; k++) {
            sum = plus(sum, scaled(system->m[k], system->A[k * n + i]));
        }
        system->S[i] = sum;
    }
    find_blocks(system);
    pack_blocks(system);
}

static double size_of(const System *system) {
    const Mechanism *m = system->mechanism;
    int count = m->ground_count + m->body_count;
    double longest = 0.0;
    for (int i = 0; i < count; i++) {
        for (int k = 0; k < i; k++) {
            Complex a = i < m->ground_count ? at_point(system, m->ground[i])
                                            : system->bodies[i - m->ground_count].drawn;
            Complex b = k < m->ground_count ? at_point(system, m->ground[k])
                                            : system->bodies[k - m->ground_count].drawn;
            double distance = modulus(minus(a, b));
            longest = distance > longest ? distance : longest;
        }
    }
    return longest;
}

static Complex first_clamp(const System *system) {
    const Mechanism *m = system->mechanism;
    for (int i = 0; i < m->flexure_count; i++) {
        const Flexure *f = &m->flexures[i];
        if (f->start == GROUND || f->end == GROUND) {
            return at_point(system, f->start == GROUND ? f->start_point : f->end_point);
        }
    }
    return complex_of(0.0, 0.0);
}

/* --- checks ----------------------------------------------------------------------------------- */

static bool check_masses(const System *system, const Complex *e0, Scratch *scratch,
                         Problem *problem) {
    size_t mark = scratch->used, n = (size_t)system->n;
    double *M = take(scratch, n * n), *C = take(scratch, n * n), *w = take(scratch, n);
    double *scale = take(scratch, n);
    inertia(system->n, system->H, system->J, e0, M, C);
    bool sound = true;
    for (size_t i = 0; i < n; i++) {
        scale[i] = sqrt(M[i * n + i]);
        sound = sound && scale[i] > 0.0;
    }
    for (size_t i = 0; sound && i < n * n; i++) {
        M[i] /= scale[i / n] * scale[i % n];
    }
    if (sound) {
        symmetric_eigen(system->n, M, w, NULL);
        sound = w[0] > 1e-13;
    }
    scratch->used = mark;
    if (!sound) {
        return fail(problem,
                    "something that can move has no mass: give the flexures a density and the "
                    "bodies a mass and an inertia");
    }
    return true;
}

static bool check_loops(const System *system, const Complex *e0, Scratch *scratch,
                        Problem *problem) {
    if (system->r == 0) {
        return true;
    }
    size_t mark = scratch->used, count = (size_t)(system->r * system->n);
    double *rows = take(scratch, count);
    jacobian(system->r, system->n, system->loops, e0, rows);
    double scale = largest((int)count, rows);
    int lost = system->r - rank(system->r, system->n, rows, 1e-9 * scale, scratch);
    scratch->used = mark;
    if (lost > 0) {
        return fail(problem,
                    "%d of the %d loop closures follow from the others at the straight shape: the "
                    "mechanism is over-constrained there; take away a flexure or move it out of "
                    "line",
                    lost, system->r);
    }
    return true;
}

static bool stubs(System *system, Scratch *scratch, Problem *problem) {
    const Mechanism *m = system->mechanism;
    int count = 0;
    for (int i = 0; i < m->type_count; i++) {
        size_t mark = scratch->used;
        int pivots = m->types[i].pivots;
        double *gamma = take(scratch, (size_t)pivots), gamma0;
        for (int k = 0; k < pivots; k++) {
            gamma[k] = evaluate(m->types[i].gamma[k], system->values);
        }
        bool right = stub(pivots, gamma, &gamma0, problem);
        scratch->used = mark;
        if (!right) {
            return false;
        }
        if (pivots > 1) {
            system->calculated[count++] = gamma0;
        }
    }
    return true;
}

/* --- the whole -------------------------------------------------------------------------------- */

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

PRBM bool assemble(System *system, const double *values, Scratch *scratch, Problem *problem) {
    const Mechanism *m = system->mechanism;
    size_t mark = scratch->used;
    system->values = values;
    system->gravity = complex_of(values[m->gravity[0]], values[m->gravity[1]]);
    clear(system);
    bool right = stubs(system, scratch, problem) && walk_all(system, scratch, problem);
    if (right) {
        Complex *e0 = system->e0;
        directions(system->n, system->q0, e0);
        for (int body = 1; body <= system->b; body++) {
            add_body(system, body, scratch);
        }
        add_moments(system);
        add_stops(system, e0, scratch);
        add_frictions(system, e0);
        const Release *release = &m->release;
        system->release_c = along(system->n, unit(release->direction),
                                  system->bodies[release->body - 1].A, e0, system->release);
        system->anchor = first_clamp(system);
        system->length = size_of(system);
        right = check_loops(system, e0, scratch, problem) &&
                check_masses(system, e0, scratch, problem);
    }
    scratch->used = mark;
    return right;
}
