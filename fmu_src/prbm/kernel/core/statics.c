/* Static equilibrium under gravity and a holding force: the twin of mechanics/statics.py.
 *
 * At rest the forces P of the elements, gravity, loops and the holding force F balance:
 * P + Re(w e) + J^T lam + r^T F = 0, with the row r of the released body.
 */
#include <math.h>

#include "core/constraints.h"
#include "core/elements.h"
#include "core/forces.h"
#include "core/matrix.h"
#include "core/statics.h"

PRBM void stack_release(const System *system, Complex *B, double *c) {
    int d = system->d, r = system->r;
    for (int i = 0; i < r * d; i++) {
        B[i] = system->loops[i];
    }
    for (int j = 0; j < d; j++) {
        B[r * d + j] = system->release[j];
    }
    copy(r, system->loops_c, c);
    c[r] = system->release_c;
}

static bool turns(const System *system) {
    return system->mechanism->release.start == START_ANGLE;
}

PRBM void stack_holding(const System *system, double amount, Complex *B, double *c) {
    int d = system->d, r = system->r, arm = system->released.arm;
    stack_release(system, B, c);
    c[r] -= amount;
    if (turns(system)) {
        for (int k = 0; k < d; k++) {
            B[r * d + k] = complex_of(0.0, 0.0);
        }
        double angle = system->q0[system->released.j] + amount;
        Complex e;
        unit_vectors(1, &angle, &e);
        B[r * d + arm] = complex_of(-system->length * e.im, -system->length * e.re);
        c[r] = 0.0;
    }
}

PRBM void stack_holding_at(const System *system, const double *q, Complex *B, double *c) {
    int j = system->released.j;
    stack_holding(system, turns(system) ? q[j] - system->q0[j] : 0.0, B, c);
}

/* --- free bodies ------------------------------------------------------------------------------ */

PRBM bool released_free(const System *system) {
    bool found = false;
    for (int k = 0; k < system->placed_count; k++) {
        found = found || system->placed[k] == system->released.j;
    }
    return found;
}

PRBM System with_bodies_placed(const System *system) {
    System result = *system;
    result.placed_count = system->mechanism->floating_count;
    result.placed = system->mechanism->floating;
    if (result.placed_count > system->placed_count) {
        result.r = system->tied;
    }
    return result;
}

PRBM void place_bodies(const System *system, double amount, double *q) {
    const Mechanism *m = system->mechanism;
    for (int k = 0; k < system->placed_count; k += PLACED_EACH) {
        const int *place = system->placed + k, turn = place[SHIFTS_EACH];
        for (int i = 0; i < PLACED_EACH; i++) {
            q[place[i]] = system->q0[place[i]];
        }
        if (turn == system->released.j && turns(system)) {
            q[turn] += amount;
        } else if (turn == system->released.j) {
            Complex shift = scaled(amount, unit(m->release.direction));
            q[place[AXIS_X]] += shift.re / system->length;
            q[place[AXIS_Y]] += shift.im / system->length;
        }
    }
}

/* --- positions at the start ------------------------------------------------------------------- */

PRBM const char *start_name(const StartValue *x) {
    static const char *const names[GIVEN_COUNT] = {"start_angle", "start_x",  "start_y",
                                                   "start_omega", "start_vx", "start_vy"};
    return names[x->field];
}

PRBM const char *start_unit(const StartValue *x) {
    static const char *const units[GIVEN_COUNT] = {"rad", "m", "m", "rad/s", "m/s", "m/s"};
    return units[x->field];
}

PRBM bool rotates(const StartValue *x) {
    return x->field == GIVEN_ANGLE || x->field == GIVEN_OMEGA;
}

static Complex start_axis(const StartValue *x) {
    bool along_x = x->field == GIVEN_X || x->field == GIVEN_VX;
    return complex_of(along_x, !along_x);
}

PRBM double start_row(const System *system, const StartValue *x, double share, Complex *B) {
    const BodyFrame *frame = x->frame;
    double amount = share * x->value;
    Complex u = conjugate(start_axis(x));
    for (int j = 0; j < system->d; j++) {
        B[j] = rotates(x) ? complex_of(0.0, 0.0) : product(u, frame->A[j]);
    }
    if (!rotates(x)) {
        return product(u, minus(frame->c, frame->drawn)).re - amount;
    }
    double angle = system->q0[frame->j] + amount;
    Complex e;
    unit_vectors(1, &angle, &e);
    B[frame->arm] = complex_of(-system->length * e.im, -system->length * e.re);
    return 0.0;
}

/* Return the number of rows of what holds a mechanism. */
static int rows_of(const Hold *hold) {
    int rows = hold->held;
    for (int k = 0; k < hold->count; k++) {
        rows += hold->values[k].held;
    }
    return rows;
}

/* Stack the loops and the rows of what holds a mechanism, at a share of its amounts. */
static void stack_hold(const System *system, const Hold *hold, double share, Complex *B, double *c) {
    int row = system->r;
    stack_holding(system, share * hold->amount, B, c);
    for (int k = 0; k < hold->count; k++) {
        if (hold->values[k].held) {
            c[row] = start_row(system, &hold->values[k], share, B + row * system->d);
            row++;
        }
    }
}

/* Set the coordinates that are placed, at a share of the amounts. */
static void place_held(const System *system, const Hold *hold, double share, double *q) {
    place_bodies(system, share * hold->amount, q);
    for (int i = 0; i < hold->count; i++) {
        const StartValue *x = &hold->values[i];
        for (int k = 0; k < system->placed_count; k += PLACED_EACH) {
            const int *place = system->placed + k;
            if (place[SHIFTS_EACH] == x->frame->j && rotates(x)) {
                q[x->frame->j] += share * x->value;
            } else if (place[SHIFTS_EACH] == x->frame->j) {
                q[place[x->field == GIVEN_X ? AXIS_X : AXIS_Y]] += share * x->value / system->length;
            }
        }
    }
}

/* Set the elements of the coordinates that are placed to zero. */
static void clear_placed(const System *system, double *x) {
    for (int k = 0; k < system->placed_count; k++) {
        x[system->placed[k]] = 0.0;
    }
}

/* Remove the coordinates that are placed from a balance (size, size): their changes are zero. */
static void remove_placed(const System *system, int size, double *kkt) {
    double scale = 0.0;
    for (int i = 0; system->placed_count > 0 && i < system->n; i++) {
        scale = greater(scale, largest(system->n, kkt + i * size));
    }
    for (int k = 0; k < system->placed_count; k++) {
        int j = system->placed[k];
        for (int i = 0; i < size; i++) {
            kkt[i * size + j] = kkt[j * size + i] = 0.0;
        }
        kkt[j * size + j] = scale > 0.0 ? scale : 1.0;
    }
}

/* --- stiffness -------------------------------------------------------------------------------- */

/* Add what the rotation of the body that carries row i adds to -lam d^2x/dq^2: its direction has the
 * second derivatives -Re(f (B E + z)), and Re(f B e) with all others. */
static void add_carrier_stiffness(const Rows *rows, int i, double lam, const Complex *e, double *K_t) {
    const System *system = rows->system;
    const int on = rows->on[i];
    const Complex f = scaled(lam, carrier_arm(rows, i, e)), *B = rows->B + i * system->d;
    for (int j = 0; j < system->d; j++) {
        double across = product(f, product(B[arm_of(system, j)], e[j])).re;
        stiffen(system, on, j, -across, K_t);
        stiffen(system, j, on, -across, K_t);
    }
    stiffen(system, on, on, lam * seen_value(rows, i, e).re, K_t);
}

/* K_t is that of the elements plus Phi^T diag(Re(p)) Phi, with the pull p = (lam^T f B - i w) e of each
 * arm, plus that of the bodies that carry rows. */
PRBM void tangent_stiffness(const Rows *rows, double share, const Complex *w, const double *lam,
                            const Complex *e, double *K_t, Scratch scratch) {
    const System *system = rows->system;
    int d = system->d;
    Complex *pulled = take_complex(&scratch, d, 1);
    element_tangent(system, e, share, K_t, scratch);
    for (int j = 0; j < d; j++) {
        pulled[j] = complex_of(w[j].im, -w[j].re);
    }
    for (int i = 0; i < rows->count; i++) {
        Complex f = scaled(lam[i], carrier_arm(rows, i, e));
        for (int j = 0; j < d; j++) {
            pulled[j] = plus(pulled[j], product(f, rows->B[i * d + j]));
        }
        if (seen_from(rows, i) != FIXED) {
            add_carrier_stiffness(rows, i, lam[i], e, K_t);
        }
    }
    for (int j = 0; j < d; j++) {
        pulled[j] = product(pulled[j], e[j]);
    }
    add_geometric_stiffness(system, pulled, K_t);
}

static double largest_modulus(int count, const Complex *x) {
    double top = 0.0;
    for (int j = 0; j < count; j++) {
        top = greater(top, modulus(x[j]));
    }
    return top;
}

/* The equations at a fraction of the load: constraints Re(B e) + c = 0 and dead loads Re(w e). */
typedef struct {
    const System *system;
    Rows rows;
    Complex *w; /* (d,) with repeated columns */
    double fraction; /* of the initial strains and of the pretension of springs */
} Balance;

/* Compute the residual torques and constraints at (q, lam), and the constraint rows. */
static void unbalanced(const Balance *balance, const double *state, const Complex *e,
                       double *torque, double *open_by, double *rows, Scratch scratch) {
    const System *system = balance->system;
    int n = system->n, r = balance->rows.count;
    element_forces(system, state, e, balance->fraction, torque, scratch);
    add_loads(system, balance->w, e, torque);
    jacobian(&balance->rows, e, rows);
    for (int j = 0; j < n; j++) {
        for (int i = 0; i < r; i++) {
            torque[j] += state[n + i] * rows[i * n + j];
        }
    }
    clear_placed(system, torque);
    scalars(&balance->rows, e, open_by);
}

/* Add a stiffness that is round-off beside that of the springs, or the loads w, to the coordinates of
 * bodies that only springs and guides hold, which have motions without stiffness and load. */
static void hold_idle(const System *system, const Complex *w, double *K_t) {
    const Mechanism *m = system->mechanism;
    int n = system->n;
    bool sprung = m->floating_count > system->placed_count;
    double stiffest = sprung ? largest(n * n, system->stiffness) : 0.0;
    stiffest = sprung && stiffest == 0.0 ? largest_modulus(system->d, w) : stiffest;
    double least = SPRING_IDLE_RTOL * (stiffest > 0.0 ? stiffest : 1.0);
    for (int k = 0; sprung && k < m->floating_count; k++) {
        K_t[m->floating[k] * n + m->floating[k]] += least;
    }
}

/* Make one Newton step, limited to STATICS_TURN_MAX [rad]; false if the system is singular. */
static bool newton_step(const Balance *balance, const Complex *e, double *torque, double *open_by,
                        const double *rows, double *state, double *turned, Scratch scratch) {
    const System *system = balance->system;
    int n = system->n, r = balance->rows.count, size = n + r;
    double *K_t = take_matrix(&scratch, n, n), *kkt = take_matrix(&scratch, size, size);
    double *change = take(&scratch, (size_t)size);
    Problem ignored;
    tangent_stiffness(&balance->rows, balance->fraction, balance->w, state + n, e, K_t, scratch);
    hold_idle(system, balance->w, K_t);
    saddle(n, r, K_t, rows, rows, kkt);
    remove_placed(system, size, kkt);
    copy(n, torque, change);
    for (int i = 0; i < r; i++) {
        change[n + i] = -open_by[i];
    }
    bool solved = solve(n, r, kkt, change, system->length, scratch, &ignored);
    double turn = solved ? largest(n, change) : HUGE_VAL;
    double share = lesser(1.0, STATICS_TURN_MAX / greater(turn, STATICS_TURN_MIN));
    for (int i = 0; solved && i < size; i++) {
        state[i] += (i < n ? share : -share) * change[i];
    }
    *turned = turn;
    return finite_number(turn);
}

/* Return the size of the torques of loads and constraints, before they cancel. */
static double added_torques(const Balance *balance, const double *lam) {
    int d = balance->system->d;
    double sum = largest_modulus(d, balance->w);
    for (int i = 0; i < balance->rows.count; i++) {
        sum += fabs(lam[i]) * largest_modulus(d, balance->rows.B + i * d);
    }
    return sum;
}

/* Solve the balance from a state (q, lam), which is overwritten; false if it does not converge. */
static bool balance_out(const Balance *balance, double *state, Scratch scratch) {
    const System *system = balance->system;
    int n = system->n, r = balance->rows.count;
    Complex *e = take_complex(&scratch, 1, system->d);
    double *torque = take(&scratch, (size_t)n), *open_by = take(&scratch, (size_t)r);
    double *rows = take_matrix(&scratch, r, n);
    double springs_scale = STATICS_FORCE_RTOL * largest(n * n, system->stiffness);
    double turn = HUGE_VAL;
    bool going = true, balanced = false, done = false;
    for (int step = 0; step < STATICS_ITERATIONS_MAX && going && !done; step++) {
        directions(system, state, e);
        unbalanced(balance, state, e, torque, open_by, rows, scratch);
        bool closed = largest(r, open_by) <= STATICS_CONSTRAINT_RTOL * system->length;
        double rounded = STATICS_ROUNDING_RTOL * added_torques(balance, state + n);
        balanced = closed && largest(n, torque) <= greater(springs_scale, rounded);
        done = balanced && turn <= STATICS_STEP_ATOL;
        going = done || newton_step(balance, e, torque, open_by, rows, state, &turn, scratch);
    }
    return done || (balanced && !going);
}

/* Return the balance at a fraction of gravity and of what holds the mechanism. */
static Balance balance_at(const System *system, const Hold *hold, double fraction,
                          Scratch *scratch) {
    int d = system->d, r = system->r, held = rows_of(hold);
    Complex *B = take_complex(scratch, r + held + 1, d);
    double *c = take(scratch, (size_t)(r + held) + 1);
    Balance balance = {system, rows_beside_loops(system, r + held, B, c, scratch),
                       take_complex(scratch, 1, d), fraction};
    stack_hold(system, hold, fraction, B, c);
    field_row(d, system->S, scaled(fraction, system->gravity), balance.w);
    repeat_columns(system, 1, balance.w, balance.w);
    return balance;
}

/* Find the equilibrium at a fraction of the load, from a state that is overwritten. */
static bool loaded(const System *system, const Hold *hold, double fraction, double *state,
                   Scratch scratch) {
    Balance balance = balance_at(system, hold, fraction, &scratch);
    place_held(system, hold, fraction, state);
    return balance_out(&balance, state, scratch);
}

/* Return the sign of the determinant at an equilibrium at a fraction of the load; 0 if singular. */
static int sign_at(const System *system, const Hold *hold, double fraction, const double *state,
                   Scratch scratch) {
    Balance balance = balance_at(system, hold, fraction, &scratch);
    int n = system->n, r = balance.rows.count, size = n + r;
    Complex *e = take_complex(&scratch, 1, system->d);
    double *K_t = take_matrix(&scratch, n, n), *kkt = take_matrix(&scratch, size, size);
    double *rows = take_matrix(&scratch, r, n);
    directions(system, state, e);
    jacobian(&balance.rows, e, rows);
    tangent_stiffness(&balance.rows, fraction, balance.w, state + n, e, K_t, scratch);
    saddle(n, r, K_t, rows, rows, kkt);
    remove_placed(system, size, kkt);
    int sign = determinant_sign(n, r, kkt, system->length, scratch);
    return sign;
}

/* Return the largest change of a coordinate between two states [rad].  Bodies without springs are
 * left out, because they may turn freely. */
static double jump(const System *system, const double *from, const double *to) {
    double top = 0.0;
    for (int j = 0; j < system->n; j++) {
        double turn = to[j] - from[j];
        bool link = system->mechanism->coordinates[j].link >= 0;
        bool bends = link || system->stiffness[j * system->n + j] > 0.0;
        top = bends ? greater(top, largest(1, &turn)) : top;
    }
    return top;
}

/* Return whether a small force on the released point, as drawn, turns the body about it. */
static bool turns_about_point(const System *system, Scratch scratch) {
    int n = system->n, r = system->r, size = n + r;
    Complex *B = take_complex(&scratch, r + 1, system->d);
    double *rows = take_matrix(&scratch, r + 1, n), *kkt = take_matrix(&scratch, size, size);
    double *response = take(&scratch, (size_t)size + 1);
    stack_release(system, B, response);
    Rows held = rows_beside_loops(system, r + 1, B, NULL, &scratch);
    jacobian(&held, system->e0, rows);
    saddle(n, r, system->stiffness, rows, rows, kkt);
    remove_placed(system, size, kkt);
    clear_placed(system, rows + r * n);
    zeros(size, response);
    copy(n, rows + r * n, response);
    Problem ignored; /* A body without a spring, for instance on a pin. */
    bool solved = solve(n, r, kkt, response, system->length, scratch, &ignored);
    double lever = RELEASE_LEVER_RTOL * system->length * fabs(response[system->released.j]);
    return solved && fabs(dot(n, rows + r * n, response)) < lever;
}

/* Reject a displacement of a point that a body turns about. */
static bool displaceable(const System *system, double displacement, Scratch scratch,
                         Problem *problem) {
    if (turns(system) || displacement == 0.0 || !turns_about_point(system, scratch)) {
        return true;
    }
    const Mechanism *m = system->mechanism;
    return fail(problem,
                "release.displacement = %g m: a force along the direction of the release turns the "
                "body %s about its released point, and hardly displaces that point; give "
                "release.angle instead, or another release.point or direction",
                displacement, m->bodies[m->release.body - 1].name);
}

static bool heavy(const System *system) {
    return system->gravity.re != 0.0 || system->gravity.im != 0.0;
}

/* Return whether the weight is far beyond what the springs can carry. */
static bool limp(const System *system) {
    double weight = modulus(system->gravity) * largest_modulus(system->d, system->S);
    return weight > STATICS_LIMP_RATIO * largest(system->n * system->n, system->stiffness);
}

static bool unreachable(const System *system, bool held, double displacement, double done,
                        Problem *problem) {
    const char *slack = system->mechanism->one_sided_count > 0
                            ? "; springs that act on one side carry no load while they are slack"
                            : "";
    if (!held) {
        return fail(problem,
                    "no static equilibrium under gravity was found: the flexures are too weak for "
                    "this load; reduce gravity or the masses, or stiffen the flexures%s",
                    slack);
    }
    const char *name = turns(system) ? "angle" : "displacement";
    const char *unit_name = turns(system) ? "rad" : "m";
    const char *hint =
        limp(system) ? "; or check the units of youngs_modulus and thickness"
        : !heavy(system) && !(done > STATICS_HINT_SHARE)
            ? "; if a body or a flexure turns freely on pins, nothing holds it without gravity: clamp an "
              "end of it, or add gravity"
            : "";
    return fail(problem,
                "release.%s = %g %s cannot be reached: no equilibrium was found beyond %.4g %s%s; "
                "release closer to the straight shape%s%s%s",
                name, displacement, unit_name, done * displacement + 0.0, unit_name,
                heavy(system) ? " (gravity raised in proportion)" : "",
                heavy(system) ? ", or reduce gravity across the motion" : "",
                hint, slack);
}

static bool unreachable_start(const Hold *hold, double done, Problem *problem) {
    const StartValue *x = hold->values;
    return fail(problem,
                "%s.%s = %g %s cannot be reached%s: no equilibrium was found beyond %.4g %s, in "
                "proportion; start closer to the drawn shape, or give the positions of further bodies",
                x->body->name, start_name(x), x->value, start_unit(x),
                hold->count > 1 ? " together with the other positions" : "", done * x->value + 0.0,
                start_unit(x));
}

/* Return whether a shape is held at a share of the amounts, and not half a turn or more away.  The sine
 * that holds a rotation vanishes there, too. */
static bool holds(const System *system, const Hold *hold, double share, const double *state) {
    bool near = true;
    int j = system->released.j;
    if (hold->held && turns(system)) {
        near = fabs(state[j] - system->q0[j] - share * hold->amount) < STATICS_TURN_MAX;
    }
    for (int k = 0; k < hold->count; k++) {
        const StartValue *x = &hold->values[k];
        double turned = state[x->frame->j] - system->q0[x->frame->j];
        bool held = x->held && rotates(x);
        near = near && (!held || fabs(turned - share * x->value) < STATICS_TURN_MAX);
    }
    return near;
}

/* Set the state (q, lam, force) of the straight, unloaded shape. */
static void straighten(const System *system, const Hold *hold, double *state) {
    zeros(system->n + system->r + rows_of(hold), state);
    copy(system->n, system->q0, state);
}

/* Increase the load and the displacement together from the straight, unloaded shape, so that the
 * result is the equilibrium that slow loading reaches.  The turn in a load step determines the size of
 * the next one, which does not grow after a rejected step.  A long step may jump to an unstable branch
 * beside the path.  Closely, the steps turn little, and only the smallest of them may change the sign
 * of the determinant.  Returns the share of the load that is reached, with its state. */
static double load_slowly(const System *system, const Hold *hold, bool closely, double *state,
                          Scratch scratch) {
    int size = system->n + system->r + rows_of(hold);
    double part = closely ? STATICS_CLOSE_SHARE : 1.0;
    double *trial = take(&scratch, (size_t)size), done = 0.0, step = 1.0;
    double growth = STATICS_GROWTH_MAX;
    bool going = true;
    straighten(system, hold, state);
    int sign = closely ? sign_at(system, hold, 0.0, state, scratch) : 0;
    for (int k = 0; k < STATICS_LOAD_STEPS_MAX && done < 1.0 && going; k++) {
        double target = lesser(1.0, done + step), turn = HUGE_VAL, ratio = STATICS_SHRINK;
        int crossed = 0;
        /* The difference of target and done may be rounded to more than the smallest step. */
        step = lesser(step, 1.0 - done);
        bool smallest = step <= STATICS_LOAD_STEP_MIN;
        copy(size, state, trial);
        if (loaded(system, hold, target, trial, scratch) && holds(system, hold, target, trial)) {
            crossed = closely ? sign_at(system, hold, target, trial, scratch) : 0;
            if (smallest || sign * crossed >= 0) {
                turn = jump(system, state, trial);
                ratio = part * STATICS_TURN_AIM / greater(turn, STATICS_TURN_MIN);
            }
        }
        if (turn <= part * STATICS_TURN_MAX) {
            copy(size, trial, state);
            done = target;
            sign = crossed;
            ratio = lesser(growth, ratio);
            growth = STATICS_GROWTH_MAX;
        } else { /* If a link jumps, slow loading does not reach this equilibrium. */
            going = !smallest;
            ratio = greater(STATICS_SHRINK_MIN, ratio);
            growth = 1.0;
        }
        step = greater(STATICS_LOAD_STEP_MIN, ratio * step);
    }
    return done;
}

/* Load the mechanism slowly.  If a direction has become unstable, the search may have jumped, and the
 * path is followed closely; if that does not reach the load, the mechanism snaps. */
static bool load_fully(const System *system, const Hold *hold, double *state, Scratch scratch,
                       Problem *problem) {
    double done = load_slowly(system, hold, false, state, scratch);
    if (!(done >= 1.0)) {
        return hold->count > 0 ? unreachable_start(hold, done, problem)
                               : unreachable(system, hold->held, hold->amount, done, problem);
    }
    int size = system->n + system->r + rows_of(hold);
    double *close = take(&scratch, (size_t)size);
    straighten(system, hold, close);
    int before = sign_at(system, hold, 0.0, close, scratch);
    int after = sign_at(system, hold, 1.0, state, scratch);
    if (before * after < 0 &&
        load_slowly(system, hold, true, close, scratch) >= 1.0) {
        copy(size, close, state);
    }
    return true;
}

/* Return whether the loops are closed in the shape as drawn. */
static bool drawn_closed(const System *system, Scratch scratch) {
    double *open_by = take(&scratch, (size_t)system->r);
    Rows loops = loop_rows(system);
    scalars(&loops, system->e0, open_by);
    return largest(system->r, open_by) <= STATICS_CONSTRAINT_RTOL * system->length;
}

PRBM bool equilibrium(const System *system, bool held, double displacement, Equilibrium *shape,
                      Scratch scratch, Problem *problem) {
    int n = system->n, r = system->r;
    double *state = take(&scratch, (size_t)n + (size_t)r + 1);
    bool straight = !heavy(system) && !element_strained(system) && !(held && displacement != 0.0) &&
                    drawn_closed(system, scratch);
    Hold hold = {held && !released_free(system), held ? displacement : 0.0, 0, NULL};
    zeros(n + r + 1, state);
    copy(n, system->q0, state);
    bool found = straight ||
                 ((!hold.held || displaceable(system, displacement, scratch, problem)) &&
                  load_fully(system, &hold, state, scratch, problem));
    copy(n, state, shape->q);
    copy(r, state + n, shape->lam);
    /* The constraint of an angle is the rotation times the size. */
    shape->force = turns(system) ? system->length * state[n + r] : state[n + r];
    return found;
}

PRBM bool held_at_start(const System *system, const StartValue *values, int count, double *q,
                      Scratch scratch, Problem *problem) {
    Hold hold = {false, 0.0, count, values};
    double *state = take(&scratch, (size_t)(system->n + system->r + rows_of(&hold)));
    bool found = load_fully(system, &hold, state, scratch, problem);
    copy(system->n, state, q);
    return found;
}

PRBM bool resting(const System *system, Equilibrium *shape, bool *balanced, Scratch scratch,
                  Problem *problem) {
    bool sprung = system->placed_count < system->mechanism->floating_count;
    Problem ignored;
    *balanced = equilibrium(system, false, 0.0, shape, scratch, sprung ? &ignored : problem);
    if (*balanced || !sprung) {
        return *balanced;
    }
    System placed = with_bodies_placed(system);
    zeros(system->r, shape->lam); /* That of the placed system may have fewer rows. */
    return equilibrium(&placed, false, 0.0, shape, scratch, problem);
}
