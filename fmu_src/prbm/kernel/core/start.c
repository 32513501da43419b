/* The shape from which a mechanism is released: the twin of mechanics/start.py. */
#include <math.h>

#include "core/constraints.h"
#include "core/modal.h"
#include "core/start.h"

/* Displace the rest shape q along a mode, column k of phi (n, count), by which the released point
 * moves by moved.  Then close the loops with the displacement amplitude of this point. */
static bool displace(const System *system, const double *phi, int k, double moved,
                     double amplitude, double *q, Scratch *scratch, Problem *problem) {
    size_t used = scratch->used;
    int n = system->n, r = system->r, count = n - r;
    Complex *B = take_complex(scratch, r + 1, system->d);
    Complex *e = take_complex(scratch, 1, system->d);
    double *c = take(scratch, (size_t)r + 1);
    stack_release(system, B, c);
    Rows rows = plain_rows(system, r + 1, B, c);
    directions(system, q, e);
    c[r] = -row_value(&rows, r, e) - amplitude;
    for (int j = 0; j < n; j++) {
        q[j] += phi[j * count + k] * (amplitude / moved);
    }
    Problem ignored;
    bool closed = project_positions(system, &rows, q, c, e, scratch, &ignored);
    scratch->used = used;
    return closed || fail(problem,
                          "release.amplitude = %g m: no shape along mode %d has this amplitude; "
                          "reduce it, or choose another mode, release.point or direction",
                          amplitude, k + 1);
}

/* Compute the displacement of the released point by a mode; false if it is round-off. */
static bool moved_by(const System *system, const double *q, const double *phi, int k,
                     double *moved, Scratch *scratch) {
    size_t used = scratch->used;
    int n = system->n, count = n - system->r;
    Complex *e = take_complex(scratch, 1, system->d);
    double *row = take(scratch, (size_t)n), turn = 0.0;
    Rows release = plain_rows(system, 1, system->release, NULL);
    directions(system, q, e);
    row_jacobian(&release, 0, e, row);
    *moved = 0.0;
    for (int j = 0; j < n; j++) {
        *moved += row[j] * phi[j * count + k];
        turn = greater(turn, fabs(phi[j * count + k]));
    }
    scratch->used = used;
    return fabs(*moved) > RELEASE_MODE_RTOL * system->length * turn;
}

/* Displace the rest shape under gravity along the mode of the release. */
static bool mode_shape(const System *system, double amplitude, double *q, Scratch *scratch,
                       Problem *problem) {
    size_t used = scratch->used;
    int n = system->n, count = n - system->r, mode = system->mechanism->release.mode;
    Equilibrium rest = {q, take(scratch, (size_t)system->r + 1), 0.0};
    double *frequency = take(scratch, (size_t)count), *phi = take_matrix(scratch, n, count);
    double moved = 0.0;
    bool found = equilibrium(system, false, 0.0, &rest, scratch, problem) &&
                 modes(system, &rest, frequency, phi, scratch, problem);
    if (found && mode > count) {
        found = fail(problem,
                     "release.mode = %d: the mechanism has %d modes; choose one of them, or a "
                     "flexure model with more pivots",
                     mode, count);
    } else if (found && !moved_by(system, q, phi, mode - 1, &moved, scratch)) {
        found = fail(problem,
                     "release.mode = %d: this mode does not move the released point of %s along "
                     "the direction of the release; choose another mode, release.point or "
                     "direction",
                     mode, system->mechanism->bodies[system->mechanism->release.body - 1].name);
    }
    if (found && amplitude != 0.0) {
        found = displace(system, phi, mode - 1, moved, amplitude, q, scratch, problem);
    }
    scratch->used = used;
    return found;
}

PRBM bool start_shape(const System *system, const double *values, double *q, Scratch *scratch,
                      Problem *problem) {
    const Release *release = &system->mechanism->release;
    double amount = evaluate(release->amount, values);
    if (release->start == START_AMPLITUDE) {
        return mode_shape(system, amount, q, scratch, problem);
    }
    size_t used = scratch->used;
    Equilibrium shape = {q, take(scratch, (size_t)system->r + 1), 0.0};
    bool found = equilibrium(system, true, amount, &shape, scratch, problem);
    scratch->used = used;
    return found;
}
