/* The shape from which a mechanism is released: the twin of mechanics/start.py. */
#include <math.h>

#include "core/constraints.h"
#include "core/modal.h"
#include "core/positions.h"
#include "core/start.h"

/* Displace the rest shape q along a mode, column k of phi (n, count), by which the released point
 * moves by moved.  Then close the loops with the displacement amplitude of this point. */
static bool displace(const System *system, const double *phi, int k, double moved,
                     double amplitude, double *q, Scratch scratch, Problem *problem) {
    int n = system->n, r = system->r, count = mode_count(system);
    Complex *B = take_complex(&scratch, r + 1, system->d);
    Complex *e = take_complex(&scratch, 1, system->d);
    double *c = take(&scratch, (size_t)r + 1);
    stack_release(system, B, c);
    Rows rows = rows_beside_loops(system, r + 1, B, c, &scratch);
    directions(system, q, e);
    c[r] = -row_value(&rows, r, e) - amplitude;
    for (int j = 0; j < n; j++) {
        q[j] += phi[j * count + k] * (amplitude / moved);
    }
    Problem ignored;
    bool closed = project_positions(system, &rows, q, c, e, scratch, &ignored);
    return closed || fail(problem,
                          "release.amplitude = %g m: no shape along mode %d has this amplitude; "
                          "reduce it, or choose another mode, release.point or direction",
                          amplitude, k + 1);
}

/* Whether another mode has the frequency of a mode, from 0: its shape is not unique. */
static bool repeated(int count, const double *frequency, int mode) {
    double largest = 0.0;
    int same = 0;
    for (int k = 0; k < count; k++) {
        largest = greater(largest, frequency[k] * frequency[k]);
    }
    double square = frequency[mode] * fabs(frequency[mode]);
    for (int k = 0; k < count; k++) {
        double difference = frequency[k] * fabs(frequency[k]) - square;
        same += fabs(difference) <= REPEATED_MODE_RTOL * largest;
    }
    return same > 1;
}

/* Displace the rest shape under gravity along the mode of the release. */
static bool mode_shape(const System *system, double amplitude, double *q, Scratch scratch,
                       Problem *problem) {
    int n = system->n, count = mode_count(system), mode = system->mechanism->release.mode;
    Equilibrium rest = {q, take(&scratch, (size_t)system->r + 1), 0.0};
    double *frequency = take(&scratch, (size_t)count), *phi = take_matrix(&scratch, n, count);
    double *moved = take(&scratch, (size_t)count);
    bool found = equilibrium(system, false, 0.0, &rest, scratch, problem) &&
                 modes(system, &rest, frequency, phi, scratch, problem);
    if (found && mode > count) {
        found = fail(problem,
                     "release.mode = %d: the mechanism has %d modes; choose one of them, or a "
                     "flexure model with more pivots",
                     mode, count);
    }
    if (found && repeated(count, frequency, mode - 1)) {
        found = fail(problem,
                     "release.mode = %d: another mode has the same frequency, so that its shape is "
                     "not unique; choose another mode, or release by a displacement or an angle",
                     mode);
    }
    if (found) {
        moved_by(system, q, phi, moved, scratch);
        if (moved[mode - 1] == 0.0) {
            const Body *body = &system->mechanism->bodies[system->mechanism->release.body - 1];
            found = fail(problem,
                         "release.mode = %d: this mode does not move the released point of %s "
                         "along the direction of the release; choose another mode, release.point "
                         "or direction",
                         mode, body->name);
        } else if (amplitude != 0.0) {
            double by = moved[mode - 1];
            found = displace(system, phi, mode - 1, by, amplitude, q, scratch, problem);
        }
    }
    return found;
}

/* Move bodies that were placed beside the lines of their guides onto them, with the amount of the
 * release. */
static bool place_on_guides(const System *system, double amount, double *q, Scratch scratch,
                            Problem *problem) {
    int r = system->r + 1;
    Complex *B = take_complex(&scratch, r, system->d), *e = take_complex(&scratch, 1, system->d);
    double *c = take(&scratch, (size_t)r), *open_by = take(&scratch, (size_t)r);
    stack_holding(system, amount, B, c);
    Rows rows = rows_beside_loops(system, r, B, c, &scratch), loops = loop_rows(system);
    directions(system, q, e);
    scalars(&loops, e, open_by);
    Problem ignored;
    bool closed = largest(system->r, open_by) <= STATICS_CONSTRAINT_RTOL * system->length ||
                  project_positions(system, &rows, q, c, e, scratch, &ignored);
    bool turns = system->mechanism->release.start == START_ANGLE;
    return closed || fail(problem,
                          "release.%s = %g %s: the guides do not let the body %s move there; reduce "
                          "it, or choose another release.point or direction",
                          turns ? "angle" : "displacement", amount, turns ? "rad" : "m",
                          system->mechanism->bodies[system->mechanism->release.body - 1].name);
}

PRBM bool start_shape(const System *system, const double *values, double *q, Scratch scratch,
                      Problem *problem) {
    const Release *release = &system->mechanism->release;
    double amount = evaluate(release->amount, values);
    if (has_positions(system)) {
        return positioned(system, values, q, scratch, problem);
    }
    if (release->start == START_AMPLITUDE) {
        return mode_shape(system, amount, q, scratch, problem);
    }
    Equilibrium shape = {q, take(&scratch, (size_t)system->r + 1), 0.0};
    System placed = with_bodies_placed(system);
    return equilibrium(&placed, true, amount, &shape, scratch, problem) &&
           place_on_guides(system, amount, q, scratch, problem);
}

/* Count the unstable directions of the shape under gravity that is held at an amount, or free.  There
 * are none if the shape is not balanced. */
static bool unstable_shape(const System *system, bool held, double amount, int *count,
                           Scratch scratch, Problem *problem) {
    int n = system->n, k = mode_count(system);
    Equilibrium shape = {take(&scratch, (size_t)n), take(&scratch, (size_t)system->r + 1), 0.0};
    double *frequency = take(&scratch, (size_t)k), *phi = take_matrix(&scratch, n, k);
    double *moved = take(&scratch, (size_t)k);
    bool balanced = true;
    bool found = (held ? equilibrium(system, true, amount, &shape, scratch, problem)
                       : resting(system, &shape, &balanced, scratch, problem)) &&
                 modes(system, &shape, frequency, phi, scratch, problem);
    if (found) {
        moved_by(system, shape.q, phi, moved, scratch);
        *count = balanced ? unstable_directions(k, frequency, held ? moved : NULL) : 0;
    }
    return found;
}

PRBM bool instability(const System *system, const double *values, int *rest, int *release,
                      Scratch scratch, Problem *problem) {
    const Release *given = &system->mechanism->release;
    bool held = given->start != START_AMPLITUDE && !has_positions(system);
    System placed = with_bodies_placed(system);
    *release = 0;
    return unstable_shape(system, false, 0.0, rest, scratch, problem) &&
           (!held || unstable_shape(&placed, true, evaluate(given->amount, values), release, scratch,
                                    problem));
}
