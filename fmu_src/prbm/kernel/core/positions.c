/* Positions and velocities that bodies are given at the start: the twin of mechanics/positions.py. */
#include <math.h>

#include "core/constraints.h"
#include "core/matrix.h"
#include "core/positions.h"

/* Positions and velocities are groups of this many fields. */
enum { FIELDS_EACH = GIVEN_COUNT / 2 };

typedef struct {
    int count;
    StartValue *values; /* (count,) */
} Starts;

/* Return the given fields of a group, that of the positions or of the velocities. */
static Starts given_at_start(const System *system, const double *values, int first,
                             Scratch *scratch) {
    const Mechanism *m = system->mechanism;
    size_t size = sizeof(StartValue) / sizeof(double) + 1;
    Starts result = {0, NULL};
    result.values = (StartValue *)(void *)take(scratch, size * (size_t)m->given_count + 1);
    for (int i = 0; i < m->body_count; i++) {
        for (int field = first; field < first + FIELDS_EACH; field++) {
            if (m->bodies[i].given >> field & 1u) {
                double value = evaluate(m->bodies[i].at_start[field], values);
                StartValue x = {&m->bodies[i], &system->bodies[i], field, value, false, false};
                result.values[result.count++] = x;
            }
        }
    }
    return result;
}

PRBM bool has_positions(const System *system) {
    const Mechanism *m = system->mechanism;
    bool found = false;
    for (int i = 0; i < m->body_count; i++) {
        found = found || (m->bodies[i].given & ((1u << GIVEN_OMEGA) - 1u)) != 0;
    }
    return found;
}

PRBM double start_speed(const System *system, Scratch scratch) {
    Starts given = given_at_start(system, system->values, GIVEN_OMEGA, &scratch);
    double top = fabs(evaluate(system->mechanism->release.velocity, system->values));
    for (int k = 0; k < given.count; k++) {
        double size = rotates(&given.values[k]) ? system->length : 1.0;
        top = greater(top, size * fabs(given.values[k].value));
    }
    return top;
}

/* Reject a value of the release beside those of bodies. */
static bool alone(const char *name, const char *unit, double amount, const StartValue *x,
                  Problem *problem) {
    return amount == 0.0 ||
           fail(problem,
                "release.%s = %g %s: %s.%s gives the start; set release.%s to 0, or remove %s", name,
                amount, unit, x->body->name, start_name(x), name, start_name(x));
}

/* Reject a value that the constraints contradict, by the largest deviation.  scale: angle [rad] or
 * angular velocity [rad/s] of which START_RTOL may be missing. */
static bool reached_all(const System *system, const Starts *given, const double *reached,
                        double scale, Problem *problem) {
    double most = 0.0;
    int worst = 0;
    for (int k = 0; k < given->count; k++) {
        double size = rotates(&given->values[k]) ? 1.0 : system->length;
        double missing = fabs(reached[k] - given->values[k].value) / size;
        worst = missing > most ? k : worst;
        most = greater(most, missing);
    }
    const StartValue *x = &given->values[worst];
    double round_off = START_DEPENDENT_RTOL * (rotates(x) ? 1.0 : system->length) * scale;
    double found = fabs(reached[worst]) < round_off ? 0.0 : reached[worst];
    return most <= START_RTOL * scale ||
           fail(problem,
                "%s.%s = %g %s deviates by %.6g %s from %.9g %s, which the constraints and the other "
                "values at the start allow; change it to that, or leave it out",
                x->body->name, start_name(x), x->value, start_unit(x), x->value - found,
                start_unit(x), found, start_unit(x));
}

/* Set row (n,) to the derivatives of a rotation or a displacement by the coordinates. */
static void start_gradient(const System *system, const StartValue *x, const Complex *e, double *row,
                           Scratch scratch) {
    Complex *B = take_complex(&scratch, 1, system->d);
    start_row(system, x, 0.0, B);
    Rows one = plain_rows(system, 1, B, NULL);
    if (rotates(x)) {
        zeros(system->n, row);
        row[x->frame->j] = 1.0;
    } else {
        row_jacobian(&one, 0, e, row);
    }
}

/* Return the mobility row.x for the motion x by a unit impulse along row (n,), with r rows held. */
static double mobility_along(const System *system, int r, const double *M, const double *held,
                             const double *row, Scratch scratch) {
    int n = system->n, size = n + r;
    double *kkt = take_matrix(&scratch, size, size), *x = take(&scratch, (size_t)size);
    Problem ignored;
    saddle(n, r, M, held, held, kkt);
    zeros(size, x);
    copy(n, row, x);
    bool found = solve(n, r, kkt, x, system->length, scratch, &ignored);
    double result = found ? dot(n, row, x) : 0.0;
    return result;
}

/* Choose the values that no constraint and no earlier value determines: held.  rows (r + count, n)
 * becomes the loops and their gradients; the number of rows is returned. */
static int choose_independent(const System *system, const Complex *e, const Starts *given,
                              double *rows, Scratch scratch) {
    int n = system->n, r = system->r;
    double *M = take_matrix(&scratch, n, n);
    Rows loops = loop_rows(system);
    jacobian(&loops, e, rows);
    mass_matrix(system, e, M, scratch);
    for (int k = 0; k < given->count; k++) {
        StartValue *x = &given->values[k];
        double *row = rows + r * n;
        if (x->held) {
            start_gradient(system, x, e, row, scratch);
            double freely = mobility_along(system, 0, M, rows, row, scratch);
            double left = mobility_along(system, r, M, rows, row, scratch);
            x->held = left > START_DEPENDENT_RTOL * freely;
            r += x->held;
        }
    }
    return r;
}

/* Move bodies that were placed beside the lines of their guides onto them, with the positions that are
 * held. */
static bool project_held(const System *system, const Starts *given, int r, double *q,
                         Scratch scratch, Problem *problem) {
    int row = system->r;
    Complex *B = take_complex(&scratch, r, system->d), *e = take_complex(&scratch, 1, system->d);
    double *c = take(&scratch, (size_t)r);
    for (int i = 0; i < row * system->d; i++) {
        B[i] = system->loops[i];
    }
    copy(row, system->loops_c, c);
    for (int k = 0; k < given->count; k++) {
        if (given->values[k].held) {
            c[row] = start_row(system, &given->values[k], 1.0, B + row * system->d);
            row++;
        }
    }
    Rows rows = rows_beside_loops(system, r, B, c, &scratch);
    Problem ignored;
    bool closed = project_positions(system, &rows, q, c, e, scratch, &ignored);
    const StartValue *x = given->values;
    return closed || fail(problem,
                          "%s.%s = %g %s: the guides do not let the body %s move there; reduce it, or "
                          "give other positions",
                          x->body->name, start_name(x), x->value, start_unit(x), x->body->name);
}

/* Return the rotation [rad] or the displacement [m] of a body in a shape. */
static double position_reached(const System *system, const StartValue *x, const double *q,
                               const Complex *e, Scratch scratch) {
    Complex *B = take_complex(&scratch, 1, system->d);
    double c = start_row(system, x, 0.0, B);
    Rows one = plain_rows(system, 1, B, NULL);
    return rotates(x) ? q[x->frame->j] - system->q0[x->frame->j] : row_value(&one, 0, e) + c;
}

/* Reject positions that a shape does not have. */
static bool positions_reached(const System *system, const Starts *given, const double *q,
                              Scratch scratch, Problem *problem) {
    Complex *e = take_complex(&scratch, 1, system->d);
    double *reached = take(&scratch, (size_t)given->count);
    directions(system, q, e);
    for (int k = 0; k < given->count; k++) {
        reached[k] = position_reached(system, &given->values[k], q, e, scratch);
    }
    return reached_all(system, given, reached, 1.0, problem);
}

/* Reject a position that the held ones determine as drawn, but not in their shape q (n,). */
static bool determined(const System *system, const Starts *given, const double *q, Scratch scratch,
                      Problem *problem) {
    int n = system->n, r = system->r;
    Complex *e = take_complex(&scratch, 1, system->d);
    double *M = take_matrix(&scratch, n, n), *rows = take_matrix(&scratch, r + given->count, n);
    double *row = take(&scratch, (size_t)n);
    Rows loops = loop_rows(system);
    directions(system, q, e);
    mass_matrix(system, e, M, scratch);
    jacobian(&loops, e, rows);
    for (int k = 0; k < given->count; k++) {
        if (given->values[k].held) {
            start_gradient(system, &given->values[k], e, rows + n * r++, scratch);
        }
    }
    for (int k = 0; k < given->count; k++) {
        const StartValue *x = &given->values[k];
        double found = position_reached(system, x, q, e, scratch);
        double missing = fabs(found - x->value) / (rotates(x) ? 1.0 : system->length);
        if (x->placed || x->held || missing <= START_RTOL) {
            continue;
        }
        start_gradient(system, x, e, row, scratch);
        double freely = mobility_along(system, 0, M, rows, row, scratch);
        if (mobility_along(system, r, M, rows, row, scratch) > START_DEPENDENT_RTOL * freely) {
            return fail(problem,
                        "%s.%s = %g %s: in the drawn shape, a dead centre, the other positions "
                        "determine this position, and the equilibrium with these has %.9g %s; change "
                        "it to that, or leave it out",
                        x->body->name, start_name(x), x->value, start_unit(x), found, start_unit(x));
        }
    }
    return true;
}

PRBM bool positioned(const System *system, const double *values, double *q, Scratch scratch,
                     Problem *problem) {
    static const char *const names[START_COUNT] = {"displacement", "angle", "amplitude"};
    const Release *release = &system->mechanism->release;
    Starts given = given_at_start(system, values, GIVEN_ANGLE, &scratch);
    System placed = with_bodies_placed(system);
    double *rows = take_matrix(&scratch, system->r + given.count, system->n);
    Complex *e = take_complex(&scratch, 1, system->d);
    for (int k = 0; k < given.count; k++) {
        StartValue *x = &given.values[k];
        for (int i = 0; i < placed.placed_count; i++) {
            x->placed = x->placed || placed.placed[i] == x->frame->j;
        }
        x->held = !x->placed;
    }
    choose_independent(&placed, system->e0, &given, rows, scratch);
    const char *unit_name = release->start == START_ANGLE ? "rad" : "m";
    bool found = alone(names[release->start], unit_name, evaluate(release->amount, values),
                       given.values, problem) &&
                 held_at_start(&placed, given.values, given.count, q, scratch, problem) &&
                 determined(&placed, &given, q, scratch, problem);
    if (found) {
        for (int k = 0; k < given.count; k++) {
            given.values[k].held = true;
        }
        directions(system, q, e);
        int r = choose_independent(system, e, &given, rows, scratch);
        found = project_held(system, &given, r, q, scratch, problem) &&
                positions_reached(system, &given, q, scratch, problem);
    }
    return found;
}

/* Compute the velocities v (n,) of least kinetic energy with those that are given to bodies. */
static bool given_velocity(const System *system, const double *q, const Starts *given, double *v,
                           Scratch scratch, Problem *problem) {
    int n = system->n, most = system->r + given->count, r = system->r;
    Complex *e = take_complex(&scratch, 1, system->d);
    double *M = take_matrix(&scratch, n, n), *rows = take_matrix(&scratch, most, n);
    double *rates = take(&scratch, (size_t)most), *reached = take(&scratch, (size_t)given->count);
    double top = 0.0;
    for (int k = 0; k < given->count; k++) {
        double size = rotates(&given->values[k]) ? 1.0 : system->length;
        top = greater(top, fabs(given->values[k].value) / size);
        given->values[k].held = true;
    }
    directions(system, q, e);
    mass_matrix(system, e, M, scratch);
    int count = choose_independent(system, e, given, rows, scratch);
    zeros(most, rates);
    for (int k = 0; k < given->count; k++) {
        if (given->values[k].held) {
            rates[r++] = -given->values[k].value;
        }
    }
    zeros(n, v);
    if (!project_velocities(n, count, M, rows, rates, v, NULL, system->length, scratch, problem)) {
        return false;
    }
    for (int k = 0; k < given->count; k++) {
        start_gradient(system, &given->values[k], e, rows, scratch);
        reached[k] = dot(n, rows, v);
    }
    return reached_all(system, given, reached, top, problem);
}

PRBM bool start_velocity(const System *system, const double *q, const double *values, double *v,
                         Scratch scratch, Problem *problem) {
    double speed = evaluate(system->mechanism->release.velocity, values);
    Starts given = given_at_start(system, values, GIVEN_OMEGA, &scratch);
    bool found = given.count == 0 ? release_velocity(system, q, speed, v, scratch, problem)
                                  : alone("velocity", "m/s", speed, given.values, problem) &&
                                        given_velocity(system, q, &given, v, scratch, problem);
    return found;
}

PRBM bool release_velocity(const System *system, const double *q, double speed, double *v,
                           Scratch scratch, Problem *problem) {
    int n = system->n, r = system->r + 1;
    zeros(n, v);
    if (speed == 0.0) {
        return true;
    }
    Complex *e = take_complex(&scratch, 1, system->d), *B = take_complex(&scratch, r, system->d);
    double *M = take_matrix(&scratch, n, n);
    double *rows = take_matrix(&scratch, r, n), *rates = take(&scratch, (size_t)r);
    directions(system, q, e);
    mass_matrix(system, e, M, scratch);
    stack_release(system, B, rates);
    Rows held = rows_beside_loops(system, r, B, NULL, &scratch);
    jacobian(&held, e, rows);
    zeros(r, rates);
    rates[r - 1] = -speed;
    Problem singular; /* The loops do not allow the released body to move. */
    bool found = project_velocities(n, r, M, rows, rates, v, NULL, system->length, scratch,
                                    &singular);
    return found || fail(problem,
                         "release.velocity = %g m/s: the body %s cannot move along the direction "
                         "of the release; choose another direction or body, or let flexures "
                         "stretch (axial = true)",
                         speed, system->mechanism->bodies[system->mechanism->release.body - 1].name);
}
