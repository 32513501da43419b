/* Collection of the parts of a mechanism: places, masses, springs and loops: the twin of
 * mechanics/collection.py. */
#include <string.h>

#include "core/collection.h"

/* --- values, points and masses ---------------------------------------------------------------- */

PRBM Complex at_point(const System *system, Point point) {
    return complex_of(evaluate(point.x, system->values), evaluate(point.y, system->values));
}

/* Add a vector that turns with direction j to a place. */
PRBM void extend(Place *spot, int j, Complex vector) {
    if (j == FIXED) {
        spot->c = plus(spot->c, vector);
    } else {
        spot->A[j] = plus(spot->A[j], vector);
        spot->moves = true;
    }
}

PRBM void copy_place(int d, Place *to, const Place *from) {
    to->c = from->c;
    to->moves = from->moves;
    memcpy(to->A, from->A, (size_t)d * sizeof *to->A);
}

/* Set the place of a point of a body, given by its drawn position. */
PRBM void on_body(const System *system, int body, Complex drawn, Place *result) {
    const Place *origin = &system->origins[body];
    copy_place(system->d, result, origin);
    extend(result, origin->j, minus(drawn, origin->drawn));
}

/* Add a point mass, unless it is fixed to the ground. */
PRBM void add_mass(System *system, const Place *spot, double mass) {
    if (mass > 0.0 && spot->moves) {
        int d = system->d, i = system->p++;
        memcpy(system->A + i * d, spot->A, (size_t)d * sizeof *spot->A);
        system->c[i] = spot->c;
        system->m[i] = mass;
    }
}

/* Add a corner of the drawn line of a flexure. */
PRBM void add_corner(System *system, const Place *spot) {
    int d = system->d, i = system->corner_count++;
    memcpy(system->corners + i * d, spot->A, (size_t)d * sizeof *spot->A);
    system->corners_c[i] = spot->c;
}

/* Return the place of point i of a rod, in units of its length: 1/2 -+ 1/(2 sqrt 3). */
PRBM double rod_point(int i) {
    return i == 0 ? 0.21132486540518708 : 0.7886751345948129;
}

/* Add a uniform rod that turns with direction j, as two points with the same moments of mass. */
PRBM void add_rod(System *system, double mass, const Place *start, int j, Complex vector,
                    Place *spare) {
    for (int i = 0; i < 2; i++) {
        copy_place(system->d, spare, start);
        extend(spare, j, scaled(rod_point(i), vector));
        add_mass(system, spare, mass / 2);
    }
}

PRBM void add_spring(System *system, double rate, int a, int b) {
    int n = system->n;
    if (a != FIXED && b != FIXED) {
        Spring spring = {rate, a, b};
        system->spring[system->spring_count++] = spring;
    } else if (a != FIXED || b != FIXED) {
        system->grounded[a != FIXED ? a : b] += rate;
    }
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

PRBM Place new_place(const System *system, Scratch *scratch) {
    Place result = {{0.0, 0.0}, {0.0, 0.0}, NULL, FIXED, false};
    result.A = take_complex(scratch, system->d, 1);
    memset(result.A, 0, (size_t)system->d * sizeof *result.A);
    return result;
}

/* Add the loop constraint that two places coincide. */
PRBM void close_loop(System *system, const Place *spot, const Place *other) {
    int d = system->d;
    Complex *x = system->loops + system->r * d, *y = x + d;
    for (int j = 0; j < d; j++) {
        x[j] = minus(spot->A[j], other->A[j]);
        y[j] = complex_of(x[j].im, -x[j].re);
    }
    Complex c = minus(spot->c, other->c);
    system->loops_c[system->r] = c.re;
    system->loops_c[system->r + 1] = c.im;
    system->loops_on[system->r] = system->loops_on[system->r + 1] = FIXED;
    system->loops_z[system->r] = system->loops_z[system->r + 1] = complex_of(0.0, 0.0);
    system->r += 2;
}

/* Set the origin of a body: a place, its drawn position and the direction of the body. */
PRBM void reach(System *system, int body, const Place *spot, Complex drawn, int j) {
    Place *origin = &system->origins[body];
    copy_place(system->d, origin, spot);
    origin->drawn = drawn;
    origin->j = j;
}

PRBM Span span_of(const System *system, const Step *step) {
    const Connection *c = step->between;
    Complex start = at_point(system, c->start_point), end = at_point(system, c->end_point);
    Span forwards = {c->start, c->end, start, end}, backwards = {c->end, c->start, end, start};
    return step->backwards ? backwards : forwards;
}
