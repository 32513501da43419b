/* The constant arrays of a mechanism, and the kinematics of its arms: the twin of
 * mechanics/system.py.
 *
 * Each link and body has an arm E = exp(s + i theta).  Its derivative is E' = i w E, with the
 * complex rate w = theta' - i s'.  A point is at z = c + A E.  A direction is an angle theta or a
 * stretch s, and a linear function of the coordinates.  The elements of e are E for angles and -i E
 * for stretches, so that the derivative of E by its direction is i e for both.  The arm of a free body
 * floats: E = u_x + i u_y, with the directions u_x and u_y, whose elements of e are -i and 1.
 */
#include "core/kinetics.h"
#include "core/matrix.h"
#include "core/system.h"
#include "core/vectors.h"

/* --- arms ------------------------------------------------------------------------------------- */

PRBM bool has_shared_arms(const System *system) {
    return system->stretch_count + system->shift_count > 0;
}

PRBM int arm_of(const System *system, int j) {
    return system->mechanism->arms[j];
}

PRBM bool is_float(const System *system, int j) {
    const int *first = system->mechanism->map.first;
    return system->shift_count > 0 && arm_of(system, j) == j && first[j] == first[j + 1];
}

PRBM bool is_shift(const System *system, int j) {
    const int a = arm_of(system, j);
    return a != j && is_float(system, a);
}

PRBM double direction_of(const System *system, const double *x, int j) {
    if (!system->mapped) {
        return x[j];
    }
    const DirectionMap *map = &system->mechanism->map;
    double sum = 0.0;
    for (int k = map->first[j]; k < map->first[j + 1]; k++) {
        sum += system->factors[k] * x[map->coordinate[k]];
    }
    return sum;
}

PRBM void to_coordinates(const System *system, int j, double x, double *sum) {
    if (!system->mapped) {
        sum[j] += x;
        return;
    }
    const DirectionMap *map = &system->mechanism->map;
    for (int k = map->first[j]; k < map->first[j + 1]; k++) {
        sum[map->coordinate[k]] += system->factors[k] * x;
    }
}

PRBM void both_to_coordinates(const System *system, int i, int j, double x, double *sum) {
    const DirectionMap *map = &system->mechanism->map;
    for (int k = map->first[i]; k < map->first[i + 1]; k++) {
        to_coordinates(system, j, system->factors[k] * x, sum + map->coordinate[k] * system->n);
    }
}

PRBM double coordinate_unit(const System *system, int j) {
    return system->mechanism->coordinates[j].axis < 0 ? 1.0 : system->length;
}

PRBM int angle_of(const System *system, int j) {
    return system->mechanism->map.coordinate[system->mechanism->map.first[j]];
}

/* Set e of an arm that floats, with the displacements x and y in the directions j and j + 1. */
static void float_arm(const System *system, int j, double x, double y, Complex *e) {
    e[arm_of(system, j)] = complex_of(x, y);
    e[j] = complex_of(0.0, -1.0);
    e[j + 1] = complex_of(1.0, 0.0);
}

PRBM void stretch(const System *system, const double *theta, Complex *e) {
    for (int k = 0; k < system->stretch_count; k++) {
        int j = system->stretches[k], a = arm_of(system, j);
        e[a] = scaled(exponential(theta[j]), e[a]);
        e[j] = complex_of(e[a].im, -e[a].re);
    }
    for (int k = 0; k < system->shift_count; k += SHIFTS_EACH) {
        int j = system->shifts[k];
        float_arm(system, j, theta[j], theta[j + 1], e);
    }
}

PRBM void directions(const System *system, const double *q, Complex *e) {
    if (!system->mapped) {
        unit_vectors(system->d, q, e);
        stretch(system, q, e);
        return;
    }
    for (int j = 0; j < system->d; j++) {
        double theta = direction_of(system, q, j);
        if (arm_of(system, j) == j) {
            unit_vectors(1, &theta, &e[j]);
        }
    }
    for (int k = 0; k < system->stretch_count; k++) {
        int j = system->stretches[k], a = arm_of(system, j);
        e[a] = scaled(exponential(direction_of(system, q, j)), e[a]);
        e[j] = complex_of(e[a].im, -e[a].re);
    }
    for (int k = 0; k < system->shift_count; k += SHIFTS_EACH) {
        int j = system->shifts[k];
        float_arm(system, j, direction_of(system, q, j), direction_of(system, q, j + 1), e);
    }
}

PRBM void turning(const System *system, const double *v, Complex *w) {
    for (int j = 0; j < system->d; j++) {
        w[j] = complex_of(direction_of(system, v, j), 0.0);
    }
    for (int k = 0; k < system->stretch_count; k++) {
        int j = system->stretches[k];
        w[arm_of(system, j)].im = -w[j].re;
        w[j] = complex_of(0.0, 0.0);
    }
    for (int k = 0; k < system->shift_count; k++) {
        w[system->shifts[k]] = complex_of(0.0, 0.0);
    }
}

PRBM void float_velocities(const System *system, const double *v, Complex *velocity) {
    for (int k = 0; k < system->shift_count; k += SHIFTS_EACH) {
        int j = system->shifts[k];
        velocity[arm_of(system, j)] =
            complex_of(direction_of(system, v, j), direction_of(system, v, j + 1));
    }
}

PRBM void swings(const System *system, const Complex *e, const double *v, Complex *p) {
    turning(system, v, p);
    for (int j = 0; j < system->d; j++) {
        p[j] = product(e[j], p[j]);
    }
    for (int k = 0; k < system->shift_count; k += SHIFTS_EACH) {
        int j = system->shifts[k];
        p[arm_of(system, j)] =
            complex_of(direction_of(system, v, j + 1), -direction_of(system, v, j));
    }
}

PRBM void motion(const System *system, const BodyFrame *frame, const Complex *e, const double *v,
                 Complex *displacement, Complex *velocity) {
    Complex at = minus(frame->c, frame->drawn), speed = {0.0, 0.0};
    for (int j = 0; j < system->d; j++) {
        Complex arm = product(frame->A[j], e[j]);
        double rate = direction_of(system, v, j);
        at = plus(at, arm);
        speed.re -= arm.im * rate;
        speed.im += arm.re * rate;
    }
    for (int k = 0; k < system->stretch_count; k++) {
        int j = system->stretches[k];
        Complex along_arm = product(frame->A[arm_of(system, j)], e[j]);
        double rate = direction_of(system, v, j);
        speed.re -= along_arm.im * rate;
        speed.im += along_arm.re * rate;
    }
    for (int k = 0; k < system->shift_count; k++) {
        int j = system->shifts[k];
        Complex along_arm = product(frame->A[arm_of(system, j)], e[j]);
        double rate = direction_of(system, v, j);
        speed.re -= along_arm.im * rate;
        speed.im += along_arm.re * rate;
    }
    *displacement = at;
    *velocity = speed;
}

PRBM void repeat_columns(const System *system, int r, const Complex *B, Complex *rows) {
    int d = system->d;
    for (int i = 0; i < r * d; i += d) {
        for (int j = 0; j < d; j++) {
            rows[i + j] = B[i + arm_of(system, j)];
        }
    }
}

/* --- mass ------------------------------------------------------------------------------------- */

PRBM void mass_matrix(const System *system, const Complex *e, double *M, Scratch scratch) {
    int n = system->n, d = system->d;
    double *C = take_matrix(&scratch, d, d);
    if (!system->mapped) {
        inertia(d, system->H, system->J, e, M, C);
    } else {
        double *own = take_matrix(&scratch, d, d);
        inertia(d, system->H, system->J, e, own, C);
        zeros(n * n, M);
        for (int i = 0; i < d * d; i++) {
            if (own[i] != 0.0) {
                both_to_coordinates(system, i / d, i % d, own[i], M);
            }
        }
    }
}
