/* Guides, and the independence of loops and guides: the twin of their parts in mechanics/collection.py and
 * mechanics/assembly.py. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "core/collection.h"
#include "core/constraints.h"
#include "core/guides.h"
#include "core/matrix.h"

/* --- rows of guides --------------------------------------------------------------------------- */

/* Set row k: the change of a vector apart, drawn as drawn, along a normal, seen from a carrier. */
static void set_guide_row(System *system, int k, int carrier, Complex normal, const Place *apart,
                          Complex drawn) {
    Complex along = conjugate(normal), *B = system->loops + k * system->d;
    for (int j = 0; j < system->d; j++) {
        B[j] = product(along, apart->A[j]);
    }
    int on = system->origins[carrier].j;
    system->loops_on[k] = on;
    system->loops_z[k] = product(along, apart->c);
    double fixed = on == FIXED ? system->loops_z[k].re : 0.0;
    system->loops_c[k] = -product(along, drawn).re + fixed;
}

/* Add the rows of a guide from row k, and return the number of the rows. */
static int add_guide(System *system, const Guide *guide, int k, GuideRows *rows, Scratch scratch) {
    const Connection *c = &guide->between;
    const Place *origin = &system->origins[c->end];
    Complex at = at_point(system, c->start_point), start = at_point(system, c->end_point);
    Complex line = minus(at_point(system, guide->along), start);
    Complex along = scaled(1.0 / modulus(line), line);
    Place apart = new_place(system, &scratch);
    on_body(system, c->start, at, &apart);
    for (int j = 0; j < system->d; j++) {
        apart.A[j] = minus(apart.A[j], origin->A[j]);
    }
    apart.c = minus(apart.c, origin->c);
    rows->across = k;
    rows->turn = guide->keeps_angle ? k + 1 : FIXED;
    rows->normal = complex_of(-along.im, along.re);
    set_guide_row(system, k, c->end, rows->normal, &apart, minus(at, origin->drawn));
    if (guide->keeps_angle) {
        Complex size = {system->length, 0.0};
        memset(apart.A, 0, (size_t)system->d * sizeof *apart.A);
        apart.c = complex_of(0.0, 0.0);
        apart.A[system->origins[c->start].j] = size;
        set_guide_row(system, k + 1, c->end, complex_of(0.0, 1.0), &apart, size);
    }
    return 1 + guide->keeps_angle;
}

/* Set the rows of the displacements along the guides with friction, which are across those that the
 * guides do not permit. */
static void add_rubbing_guides(System *system) {
    const Mechanism *m = system->mechanism;
    int d = system->d, k = m->friction_count;
    Complex across = {0.0, 1.0};
    for (int i = 0; i < m->guide_count; i++) {
        int row = system->guided[i].across;
        if (!m->guides[i].rubs) {
            continue;
        }
        for (int j = 0; j < d; j++) {
            system->rubs[k * d + j] = product(across, system->loops[row * d + j]);
        }
        system->rubs_z[k] = product(across, system->loops_z[row]);
        system->rubs_on[k] = system->loops_on[row];
        system->normals[k++] = row;
    }
}

/* Reject a guide without a direction, or with a point beside its line. */
static bool check_guide(const System *system, const Guide *guide, Problem *problem) {
    const Connection *c = &guide->between;
    Complex at = at_point(system, c->start_point), start = at_point(system, c->end_point);
    Complex line = minus(at_point(system, guide->along), start);
    double length = modulus(line);
    if (!(length > SPRING_APART_RTOL * system->length)) {
        return fail(problem,
                    "guide %s has the length %.4g m, so that its direction is undefined: draw the "
                    "points of its line apart",
                    guide->name, length);
    }
    double apart = product(conjugate(scaled(1.0 / length, line)), minus(at, start)).im;
    return fabs(apart) <= JOINT_DISTANCE_RTOL * system->length ||
           fail(problem, "guide %s: its point is drawn %.4g m to the %s of its line; draw it on the line",
                guide->name, fabs(apart), apart > 0.0 ? "left" : "right");
}

/* Return the body that floats, or the ground, to which flexures and joints connect a body. */
static int root_of(const Mechanism *m, int body) {
    for (int i = m->step_count - 1; i >= 0 && body != GROUND; i--) {
        const Step *step = &m->steps[i];
        if (step->body == body) {
            return body;
        }
        if (step->body == GROUND && !step->closes) {
            int start = step->between->start, end = step->between->end;
            int far = step->backwards ? start : end;
            body = far == body ? start + end - far : body;
        }
    }
    return body;
}

/* Reject a guide between bodies that fly freely, unless flexures and joints connect them. */
static bool check_held(const System *system, const Guide *guide, Problem *problem) {
    const Mechanism *m = system->mechanism;
    int root = root_of(m, guide->between.start);
    if (root == GROUND || root == root_of(m, guide->between.end)) {
        return true;
    }
    int turn = angle_of(system, system->origins[root].j);
    for (int k = 0; k < m->placed_count; k++) {
        if (m->placed[k] == turn) {
            return fail(problem,
                        "guide %s is between bodies that fly freely: connect one of them to the ground",
                        guide->name);
        }
    }
    return true;
}

/* Return whether a body floats, or is the ground. */
static bool floats_alone(const Mechanism *m, int body) {
    bool found = body == GROUND;
    for (int i = 0; i < m->step_count; i++) {
        found = found || m->steps[i].body == body;
    }
    return found;
}

PRBM bool add_guides(System *system, Scratch scratch, Problem *problem) {
    const Mechanism *m = system->mechanism;
    int k = system->r - m->guided_count;
    for (int floating = 0; floating < 2; floating++) {
        for (int i = 0; i < m->guide_count; i++) {
            const Guide *guide = &m->guides[i];
            bool alone = floats_alone(m, guide->between.start) && floats_alone(m, guide->between.end);
            if (!check_guide(system, guide, problem) || !check_held(system, guide, problem)) {
                return false;
            }
            if (alone == (floating == 1)) {
                k += add_guide(system, guide, k, &system->guided[i], scratch);
            }
        }
        system->tied = floating == 0 ? k : system->tied;
    }
    add_rubbing_guides(system);
    return true;
}

/* --- independence ------------------------------------------------------------------------------ */

/* Find the longest of the rows k to r - 1, exchange it with row k, and return its length.  The shares
 * (r, r) of both rows are exchanged, too. */
static double choose_row(int k, int r, int n, double *rows, double *shares) {
    int best = k;
    double most = dot(n, rows + k * n, rows + k * n);
    for (int i = k + 1; i < r; i++) {
        double square = dot(n, rows + i * n, rows + i * n);
        best = square > most ? i : best;
        most = greater(square, most);
    }
    exchange(r, shares + k * r, shares + best * r);
    exchange(n, rows + k * n, rows + best * n);
    return square_root(most);
}

/* Find the loops whose rows take part in linear dependences, by Gram-Schmidt orthogonalisation with
 * pivoting.  Each remainder is a sum of shares (r, r) of the rows. */
static bool repeated_loops(int r, int n, double *rows, double *shares, const int *loop,
                           double tolerance, bool *repeated) {
    bool any = false;
    for (int k = 0; k < r; k++) {
        double length = choose_row(k, r, n, rows, shares), *row = rows + k * n;
        bool depends = !(length > tolerance);
        for (int i = 0; depends && i < r; i++) {
            bool takes = fabs(shares[k * r + i]) > DEPENDENT_LOOP_RTOL;
            repeated[loop[i]] = repeated[loop[i]] || takes;
            any = true;
        }
        for (int i = k + 1; !depends && i < r; i++) {
            double share = dot(n, row, rows + i * n) / (length * length);
            add_scaled(n, -share, row, rows + i * n);
            add_scaled(r, -share, shares + k * r, shares + i * r);
        }
    }
    return any;
}

/* Set the names of the parts that close each loop, and of the guides behind them. */
static void loop_names(const Mechanism *m, const char **names) {
    for (int i = 0; i < m->step_count; i++) {
        if (m->steps[i].closes) {
            *names++ = m->steps[i].name;
        }
    }
    for (int i = 0; i < m->guide_count; i++) {
        *names++ = m->guides[i].name;
    }
}

/* List the names of the repeated loops and guides, in alphabetical order. */
static void name_loops(int count, const char *const *names, bool *repeated, char *text, size_t size) {
    text[0] = '\0';
    for (size_t used = 0;;) {
        const char *next = NULL;
        int which = 0;
        for (int i = 0; i < count; i++) {
            if (repeated[i] && (!next || strcmp(names[i], next) < 0)) {
                next = names[i];
                which = i;
            }
        }
        if (!next || used + strlen(next) + 3 > size) {
            return;
        }
        repeated[which] = false;
        used += (size_t)snprintf(text + used, size - used, "%s%s", used ? ", " : "", next);
    }
}

PRBM bool check_loops(const System *system, const Complex *e0, Scratch scratch,
                        Problem *problem) {
    const Mechanism *m = system->mechanism;
    int r = system->r, n = system->n, closures = (r - m->guided_count) / 2;
    double *rows = take_matrix(&scratch, r, n), *shares = take_matrix(&scratch, r, r);
    int *loop = take_integers(&scratch, r);
    bool *repeated = (bool *)take_integers(&scratch, r);
    const char **every = (const char **)take_matrix(&scratch, r, 1);
    char names[PROBLEM_LENGTH / 2];
    for (int i = 0; i < r; i++) {
        loop[i] = i / 2;
        repeated[i] = false;
    }
    for (int i = 0; i < m->guide_count; i++) {
        const GuideRows *guide = &system->guided[i];
        loop[guide->across] = closures + i;
        if (guide->turn != FIXED) {
            loop[guide->turn] = closures + i;
        }
    }
    loop_names(m, every);
    Rows loops = loop_rows(system);
    jacobian(&loops, e0, rows);
    double scale = largest(r * n, rows);
    zeros(r * r, shares);
    for (int i = 0; i < r; i++) {
        shares[i * r + i] = 1.0;
    }
    double tolerance = DEPENDENT_LOOP_RTOL * scale;
    bool any = repeated_loops(r, n, rows, shares, loop, tolerance, repeated);
    name_loops(closures + m->guide_count, every, repeated, names, sizeof names);
    return !any || fail(problem,
                        "the constraints of %s depend on each other at the straight shape: rigid "
                        "links are over-constrained there; remove a part, move it out of line, or "
                        "let flexures stretch (axial = true) or bodies turn in their guides (turning "
                        "= true)",
                        names);
}
