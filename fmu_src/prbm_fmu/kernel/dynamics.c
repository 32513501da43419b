/* The equations of motion in one discrete state: the twin of prbm/dynamics.py. */
#include <math.h>
#include <string.h>

#include "kernel.h"

PRBM void equations_place(Equations *equations, const System *system, Memory *memory) {
    size_t n = (size_t)system->n, s = (size_t)system->s, f = (size_t)system->f;
    size_t r = (size_t)system->r + 2 * s + f;
    Equations q = {0};
    q.system = system;
    q.discrete.holds = place(memory, s, sizeof(int));
    q.discrete.slides = place(memory, s, sizeof(int));
    q.discrete.rubs = place(memory, f, sizeof(int));
    q.held = place(memory, s, sizeof(int));
    q.stuck = place(memory, s, sizeof(int));
    q.rubbing = place(memory, f, sizeof(int));
    q.sliding = place(memory, s, sizeof(int));
    q.rub_slides = place(memory, f, sizeof(int));
    q.stop_friction = place(memory, s, sizeof(double));
    q.rub_law = place(memory, 3 * f, sizeof(double));
    q.B = place(memory, r * n, sizeof(Complex));
    q.c = place(memory, r, sizeof(double));
    q.w = place(memory, n, sizeof(Complex));
    q.w_input = place(memory, n, sizeof(Complex));
    q.moment = place(memory, n, sizeof(double));
    q.e = place(memory, n, sizeof(Complex));
    q.M = place(memory, n * n, sizeof(double));
    q.rows = place(memory, r * n, sizeof(double));
    q.columns = place(memory, r * n, sizeof(double));
    q.x = place(memory, n + r + 1, sizeof(double));
    q.turns = place(memory, n + 1, sizeof(double));
    q.squares = place(memory, n, sizeof(double));
    q.least = place(memory, s, sizeof(double));
    q.most = place(memory, s, sizeof(double));
    q.factors.n = (int)n;
    q.factors.blocks = system->blocks;
    q.factors.L = place(memory, n * n, sizeof(double));
    q.factors.Z = place(memory, r * n, sizeof(double));
    q.factors.Y = place(memory, r * n, sizeof(double));
    q.factors.S = place(memory, 2 * r * r, sizeof(double));
    q.factors.pivots = place(memory, r, sizeof(int));
    *equations = q;
}

/* --- what holds, sticks and slides ------------------------------------------------------------ */

static void add_row(Equations *q, const Complex *row, double c) {
    int n = q->system->n;
    memcpy(q->B + q->r * n, row, (size_t)n * sizeof *row);
    q->c[q->r++] = c;
}

static void set_rows(Equations *q) {
    const System *system = q->system;
    int n = system->n;
    q->r = 0;
    for (int k = 0; k < system->r; k++) {
        add_row(q, system->loops + k * n, system->loops_c[k]);
    }
    q->first_hold = q->r;
    q->held_count = q->stuck_count = q->rubbing_count = q->sliding_count = 0;
    for (int i = 0; i < system->s; i++) {
        if (q->discrete.holds[i]) {
            q->held[q->held_count++] = i;
            add_row(q, system->gaps + i * n, system->gaps_c[i] + q->inputs.walls[i].position);
        }
    }
    q->first_stick = q->r;
    for (int k = 0; k < q->held_count; k++) {
        int i = q->held[k], slides = q->discrete.slides[i];
        if (slides == STICKS) {
            q->stuck[q->stuck_count++] = i;
            add_row(q, system->slides + i * n, 0.0);
        } else if (slides != IDLE) {
            q->sliding[q->sliding_count++] = i;
        }
    }
    q->first_rub = q->r;
    q->rub_slide_count = 0;
    for (int i = 0; i < system->f; i++) {
        int rubs = q->discrete.rubs[i];
        if (rubs == STICKS) {
            q->rubbing[q->rubbing_count++] = i;
            add_row(q, system->rubs + i * n, 0.0);
        } else if (rubs != IDLE && q->rub_law[3 * i] > 0.0) {
            q->rub_slides[q->rub_slide_count++] = i;
        }
    }
}

/* Where an index stands in a list that has it. */
static int place_in(const int *list, int index) {
    int k = 0;
    while (list[k] != index) {
        k++;
    }
    return k;
}

/* The place of a held stop among those that hold. */
static int held_at(const Equations *q, int stop) {
    return place_in(q->held, stop);
}

static void set_laws(Equations *q) {
    const Mechanism *m = q->system->mechanism;
    const double *values = q->system->values;
    q->beta = values[m->damping_beta];
    q->mass_damping = 2.0 * values[m->damping_zeta] * q->omega;
    for (int i = 0; i < m->stop_count; i++) {
        q->stop_friction[i] = evaluate(m->stops[i].friction, values);
    }
    for (int i = 0; i < m->friction_count; i++) {
        q->rub_law[3 * i] = evaluate(m->frictions[i].coefficient, values);
        q->rub_law[3 * i + 1] = evaluate(m->frictions[i].normal_force, values);
        q->rub_law[3 * i + 2] = evaluate(m->frictions[i].normal_stiffness, values);
    }
}

static void set_loads(Equations *q) {
    const System *system = q->system;
    const Mechanism *m = system->mechanism;
    int n = system->n;
    memset(q->moment, 0, (size_t)n * sizeof *q->moment);
    field_row(n, system->S, scaled(-1.0, q->inputs.base), q->w_input);
    for (int i = 0; i < m->force_count; i++) {
        const BodyFrame *frame = &system->bodies[m->forces[i].body - 1];
        const double *given = q->inputs.forces + 3 * i;
        force_row(n, frame->A, complex_of(given[0], given[1]), q->w);
        for (int j = 0; j < n; j++) {
            q->w_input[j] = plus(q->w_input[j], q->w[j]);
        }
        q->moment[frame->j] += given[2];
    }
    field_row(n, system->S, system->gravity, q->w);
    q->driven = false;
    for (int j = 0; j < n; j++) {
        q->w[j] = plus(q->w_input[j], q->w[j]);
        q->driven = q->driven || q->w_input[j].re != 0.0 || q->w_input[j].im != 0.0 ||
                    q->moment[j] != 0.0;
    }
    q->walls_push = false;
    for (int k = 0; k < q->held_count; k++) {
        q->walls_push = q->walls_push || q->inputs.walls[q->held[k]].rate != 0.0;
    }
}

PRBM void set_equations(Equations *equations, const Inputs *inputs, const Discrete *discrete,
                        double omega) {
    Equations *q = equations;
    size_t s = (size_t)q->system->s, f = (size_t)q->system->f;
    q->inputs = *inputs;
    q->omega = omega;
    memmove(q->discrete.holds, discrete->holds, s * sizeof(int));
    memmove(q->discrete.slides, discrete->slides, s * sizeof(int));
    memmove(q->discrete.rubs, discrete->rubs, f * sizeof(int));
    set_laws(q);
    set_rows(q);
    set_loads(q);
}

/* --- motion ----------------------------------------------------------------------------------- */

/* x -= c M v within a block. */
static void damp_mass(Equations *q, int start, int size, const double *v) {
    int n = q->system->n;
    const double *M = q->M + start * n + start;
    double *x = q->x + start, c = q->mass_damping;
    for (int i = 0; i < size; i++) {
        x[i] -= c * M[i * n + i] * v[start + i];
        for (int j = 0; j < i; j++) {
            x[i] -= c * M[i * n + j] * v[start + j];
            x[j] -= c * M[i * n + j] * v[start + i];
        }
    }
}

/* One block of M, and what its inertia adds to the loads x: Im(diag(e)^H H diag(e)) v^2, as the
 * mass matrix is symmetric and the quadratic velocities are antisymmetric. */
SIZED void block_inertia(int size, int n, const Complex *ALONE H, const double *ALONE J,
                         const Complex *ALONE e, const double *ALONE squares,
                         double *ALONE M, double *ALONE x) {
    UNROLLED
    for (int i = 0; i < size; i++) {
        const int columns = size <= SMALL ? size : i;
        UNROLLED
        for (int j = 0; j < columns; j++) {
            if (j < i) {
                double re = e[i].re * e[j].re + e[i].im * e[j].im;
                double im = e[i].re * e[j].im - e[i].im * e[j].re;
                double turned = H[i * n + j].re * im + H[i * n + j].im * re;
                M[i * n + j] = H[i * n + j].re * re - H[i * n + j].im * im;
                x[i] += turned * squares[j];
                x[j] -= turned * squares[i];
            }
        }
        M[i * n + i] = H[i * n + i].re + J[i];
    }
}

SIZED bool block_motion(Equations *q, int start, int size, const double *v) {
    int n = q->system->n, corner = start * n + start;
    double *L = q->factors.L + corner;
    block_inertia(size, n, q->system->H + corner, q->system->J + start, q->e + start,
                  q->squares + start, q->M + corner, q->x + start);
    if (q->mass_damping != 0.0) {
        damp_mass(q, start, size, v);
    }
    if (!block_factor(size, n, q->M + corner, L)) {
        return false;
    }
    block_forward(size, n, L, q->x + start);
    for (int k = 0; k < q->r; k++) {
        double *Z = q->factors.Z + k * n + start;
        const double *row = q->rows + k * n + start;
        UNROLLED
        for (int i = 0; i < size; i++) {
            Z[i] = row[i];
        }
        block_forward(size, n, L, Z);
        block_scale(size, n, L, Z, q->factors.Y + k * n + start);
    }
    return true;
}

static bool blocks_motion(Equations *q, const double *v) {
    bool regular = true;
    for (int k = 0; k < q->factors.block_count; k++) {
        int start = q->factors.blocks[k].start, size = q->factors.blocks[k].size;
        switch (size) {
        case 1: regular = block_motion(q, start, 1, v) && regular; break;
        case 2: regular = block_motion(q, start, 2, v) && regular; break;
        case 3: regular = block_motion(q, start, 3, v) && regular; break;
        case 4: regular = block_motion(q, start, 4, v) && regular; break;
        default: regular = block_motion(q, start, size, v) && regular;
        }
    }
    return regular;
}

/* What springs and their damping take up: x -= K (q - q0 + beta v), spring by spring. */
static void add_springs(Equations *q, const double *angle, const double *v) {
    const System *system = q->system;
    int n = system->n;
    double *turns = q->turns, *x = q->x, ground = x[n]; /* x has room for the ground's share */
    for (int j = 0; j < n; j++) {
        turns[j] = angle[j] - system->q0[j] + q->beta * v[j];
    }
    turns[n] = 0.0;
    for (int k = 0; k < system->spring_count; k++) {
        const Spring *spring = &system->spring[k];
        double torque = spring->rate * (turns[spring->b] - turns[spring->a]);
        x[spring->a] += torque;
        x[spring->b] -= torque;
    }
    x[n] = ground;
}

/* beta v^T K v */
static double spring_loss(Equations *q, const double *v) {
    const System *system = q->system;
    int n = system->n;
    double *turns = q->turns, sum = 0.0;
    copy(n, v, turns); /* and none of the ground */
    for (int k = 0; k < system->spring_count; k++) {
        const Spring *spring = &system->spring[k];
        double turn = turns[spring->b] - turns[spring->a];
        sum += spring->rate * (turn * turn);
    }
    return q->beta * sum;
}

PRBM double energy_here(const Equations *equations, const double *v) {
    const System *system = equations->system;
    double sum = 0.0;
    for (int k = 0; k < system->block_count; k++) {
        int start = system->blocks[k].start, end = start + system->blocks[k].size;
        for (int i = start; i < end; i++) {
            const double *M = equations->M + i * system->n;
            double row = 0.5 * M[i] * v[i];
            for (int j = start; j < i; j++) {
                row += M[j] * v[j];
            }
            sum += row * v[i];
        }
    }
    return sum;
}

PRBM double rub_limit(const Equations *equations, int i, const Complex *e) {
    const System *system = equations->system;
    const double *law = equations->rub_law + 3 * i;
    double lift = row_value(system->n, system->lifts + i * system->n, e) + system->lifts_c[i];
    return law[0] * normal_force(lift, law[1], law[2]);
}

/* The friction force of a sliding friction point along its direction. */
static double rub_force(const Equations *q, int i) {
    return -q->discrete.rubs[i] * rub_limit(q, i, q->e);
}

static void add_rubs(Equations *q) {
    const System *system = q->system;
    int n = system->n;
    for (int k = 0; k < q->rub_slide_count; k++) {
        int i = q->rub_slides[k];
        double force = rub_force(q, i);
        for (int j = 0; j < n; j++) {
            q->x[j] -= force * product(system->rubs[i * n + j], q->e[j]).im;
        }
    }
}

/* A stop that slides pushes along its gap and, by Coulomb's law, along its wall: its column differs
 * from its row. */
static void set_columns(Equations *q) {
    const System *system = q->system;
    int n = system->n;
    q->factors.Y_columns = q->factors.Y;
    if (q->sliding_count == 0) {
        return;
    }
    q->factors.Y_columns = q->columns;
    copy(q->r * n, q->factors.Y, q->columns);
    for (int k = 0; k < q->sliding_count; k++) {
        int i = q->sliding[k], h = q->first_hold + held_at(q, i);
        double share = -q->stop_friction[i] * q->discrete.slides[i];
        double *column = q->columns + h * n;
        for (int j = 0; j < n; j++) {
            column[j] = q->rows[h * n + j] -
                        share * product(system->slides[i * n + j], q->e[j]).im;
        }
        forward_all(&q->factors, column);
        block_scale(n, n, q->factors.L, column, column);
    }
}

/* The rows, and their convective terms Re(B e) v^2 behind the loads in x. */
static void rows_and_convection(Equations *q) {
    int n = q->system->n;
    for (int k = 0; k < q->r; k++) {
        const Complex *B = q->B + k * n;
        double *row = q->rows + k * n, sum = 0.0;
        for (int j = 0; j < n; j++) {
            double re = B[j].re * q->e[j].re - B[j].im * q->e[j].im;
            row[j] = -(B[j].re * q->e[j].im + B[j].im * q->e[j].re);
            sum += re * q->squares[j];
        }
        q->x[n + k] = sum;
    }
}

/* Solve for x = (a, -lam). */
static bool solve_motion(Equations *q, const double *angle, const double *v) {
    const System *system = q->system;
    int n = system->n;
    directions(system, angle, q->e);
    for (int j = 0; j < n; j++) {
        q->squares[j] = v[j] * v[j];
        q->x[j] = q->w[j].re * q->e[j].re - q->w[j].im * q->e[j].im;
    }
    add_springs(q, angle, v);
    rows_and_convection(q);
    if (q->driven) {
        for (int j = 0; j < n; j++) {
            q->x[j] += q->moment[j];
        }
    }
    add_rubs(q);
    q->factors.r = q->r;
    q->factors.block_count = system->block_count;
    if (!blocks_motion(q, v)) {
        return false;
    }
    set_columns(q);
    if (!factor_schur(&q->factors)) {
        return false;
    }
    finish(&q->factors, q->x);
    return true;
}

PRBM bool accelerations(Equations *equations, const double *q, const double *v, double *a,
                        double *lam, Problem *problem) {
    int n = equations->system->n;
    if (!solve_motion(equations, q, v)) {
        return fail(problem, "%s", SINGULAR);
    }
    memcpy(a, equations->x, (size_t)n * sizeof *a);
    for (int k = 0; k < equations->r; k++) {
        lam[k] = -equations->x[n + k];
    }
    return true;
}

/* The power that friction takes out. */
static double rubbing_power(const Equations *q, const double *v) {
    const System *system = q->system;
    int n = system->n;
    double power = 0.0;
    for (int k = 0; k < q->rub_slide_count; k++) {
        int i = q->rub_slides[k];
        power -= rub_force(q, i) * row_rate(n, system->rubs + i * n, q->e, v);
    }
    for (int k = 0; k < q->sliding_count; k++) {
        int i = q->sliding[k];
        double force = -q->x[n + q->first_hold + held_at(q, i)];
        double speed = row_rate(n, system->slides + i * n, q->e, v);
        power += q->stop_friction[i] * force * q->discrete.slides[i] * speed;
    }
    return power;
}

/* The power of the inputs and of the moving walls that hold. */
static double input_power(const Equations *q, const double *v) {
    int n = q->system->n;
    double power = 0.0;
    for (int j = 0; q->driven && j < n; j++) {
        power += (product(q->w_input[j], q->e[j]).re + q->moment[j]) * v[j];
    }
    for (int k = 0; k < q->held_count; k++) {
        power += q->x[n + q->first_hold + k] * q->inputs.walls[q->held[k]].rate;
    }
    return power;
}

static void trace_forces(Equations *q) {
    const double *x = q->x + q->system->n + q->first_hold;
    for (int k = 0; k < q->held_count; k++) {
        q->least[k] = -x[k] < q->least[k] ? -x[k] : q->least[k];
        q->most[k] = -x[k] > q->most[k] ? -x[k] : q->most[k];
    }
}

PRBM void begin_trace(Equations *q) {
    for (int k = 0; k < q->held_count; k++) {
        q->least[k] = INFINITY;
        q->most[k] = -INFINITY;
    }
}

PRBM bool rate(Equations *equations, double t, const double *y, double *dy, Problem *problem) {
    Equations *q = equations;
    int n = q->system->n;
    const double *v = y + n;
    (void)t; /* the loads do not depend on it; a moving wall is a matter of the constraints */
    if (!solve_motion(q, y, v)) {
        return fail(problem, "%s", SINGULAR);
    }
    trace_forces(q);
    memcpy(dy, v, (size_t)n * sizeof *dy);
    memcpy(dy + n, q->x, (size_t)n * sizeof *dy);
    dy[2 * n] = spring_loss(q, v);
    dy[2 * n + 1] = 0.0;
    if (q->mass_damping != 0.0) {
        dy[2 * n] += 2.0 * q->mass_damping * energy_here(q, v);
    }
    if (q->rub_slide_count > 0 || q->sliding_count > 0) {
        dy[2 * n] += rubbing_power(q, v);
    }
    if (q->driven || q->walls_push) {
        dy[2 * n + 1] = input_power(q, v);
    }
    return true;
}

/* --- constraints ------------------------------------------------------------------------------ */

PRBM double wall_at(const Wall *wall, double t) {
    return wall->position + wall->rate * (t - wall->since);
}

/* The constant part of an active constraint at time t. */
static double offset(const Equations *q, int k, double t) {
    if (k >= q->first_hold && k < q->first_stick) {
        int i = q->held[k - q->first_hold];
        return q->system->gaps_c[i] + wall_at(&q->inputs.walls[i], t);
    }
    return q->c[k];
}

/* The part of the rate of an active constraint that is prescribed. */
static double prescribed(const Equations *q, int k) {
    bool holds = k >= q->first_hold && k < q->first_stick;
    return holds ? q->inputs.walls[q->held[k - q->first_hold]].rate : 0.0;
}

PRBM bool project(Equations *equations, double t, double *y, Scratch *scratch, Problem *problem) {
    Equations *q = equations;
    size_t mark = scratch->used, n = (size_t)q->system->n, r = (size_t)q->r;
    double *c = take(scratch, r), *rates = take(scratch, r), *rows = take(scratch, r * n);
    double *M = take(scratch, n * n), *C = take(scratch, n * n);
    Complex *e = (Complex *)take(scratch, 2 * n);
    for (int k = 0; k < q->r; k++) {
        c[k] = offset(q, k, t);
        rates[k] = prescribed(q, k);
    }
    bool right = project_positions(q->system, q->first_stick, q->B, c, y, e, scratch, problem);
    if (right) {
        jacobian(q->r, (int)n, q->B, e, rows);
        inertia((int)n, q->system->H, q->system->J, e, M, C);
        right = project_velocities((int)n, q->r, M, rows, rates, y + n, scratch, problem);
    }
    scratch->used = mark;
    return right;
}

PRBM bool project_from_here(Equations *equations, double t, double *y, Scratch *scratch,
                            Problem *problem) {
    Equations *q = equations;
    int n = q->system->n, active = q->first_stick;
    double *x = q->x, *v = y + n, worst = 0.0;
    if (q->sliding_count > 0) {
        return project(q, t, y, scratch, problem);
    }
    size_t mark = scratch->used;
    double *kept = take(scratch, (size_t)n);
    copy(n, y, kept);
    scratch->used = mark;
    memset(x, 0, (size_t)(n + q->r) * sizeof *x); /* e is that of y: evaluated last */
    for (int k = 0; k < active; k++) {
        x[n + k] = -(row_value(n, q->B + k * n, q->e) + offset(q, k, t));
    }
    solve_rows(&q->factors, x);
    for (int i = 0; i < n; i++) {
        y[i] += x[i];
    }
    directions(q->system, y, q->e);
    for (int k = 0; k < active; k++) {
        double open_by = fabs(row_value(n, q->B + k * n, q->e) + offset(q, k, t));
        worst = open_by <= worst ? worst : open_by; /* a NaN stays */
    }
    if (!(worst <= CLOSED * q->system->length)) {
        copy(n, kept, y); /* as if nothing had been tried */
        return project(q, t, y, scratch, problem);
    }
    memset(x, 0, (size_t)n * sizeof *x);
    for (int k = 0; k < q->r; k++) {
        x[n + k] = -(row_rate(n, q->B + k * n, q->e, v) + prescribed(q, k));
    }
    solve_rows(&q->factors, x);
    for (int i = 0; i < n; i++) {
        v[i] += x[i];
    }
    return true;
}

/* --- stops ------------------------------------------------------------------------------------ */

PRBM double row_value(int n, const Complex *row, const Complex *e) {
    double sum = 0.0;
    for (int j = 0; j < n; j++) {
        sum += row[j].re * e[j].re - row[j].im * e[j].im;
    }
    return sum;
}

PRBM double row_rate(int n, const Complex *row, const Complex *e, const double *v) {
    double sum = 0.0;
    for (int j = 0; j < n; j++) {
        sum -= (row[j].re * e[j].im + row[j].im * e[j].re) * v[j];
    }
    return sum;
}

PRBM double gap(const Equations *equations, int i, double t, const Complex *e) {
    const System *system = equations->system;
    return row_value(system->n, system->gaps + i * system->n, e) + system->gaps_c[i] +
           wall_at(&equations->inputs.walls[i], t);
}

PRBM double gap_rate(const Equations *equations, int i, const Complex *e, const double *v) {
    const System *system = equations->system;
    return row_rate(system->n, system->gaps + i * system->n, e, v) +
           equations->inputs.walls[i].rate;
}

/* --- reactions -------------------------------------------------------------------------------- */

PRBM void base_reaction(const Equations *equations, const Complex *e, const double *v,
                        const double *a, Complex *force, double *moment) {
    const System *system = equations->system;
    const Mechanism *m = system->mechanism;
    int n = system->n;
    Complex field = minus(system->gravity, equations->inputs.base);
    *force = complex_of(0.0, 0.0);
    *moment = 0.0;
    for (int i = 0; i < system->p; i++) {
        Complex z = minus(system->c[i], system->anchor), bend = {0.0, 0.0};
        for (int j = 0; j < n; j++) {
            Complex arm = product(system->A[i * n + j], e[j]);
            z = plus(z, arm);
            bend.re -= arm.im * a[j] + arm.re * (v[j] * v[j]);
            bend.im += arm.re * a[j] - arm.im * (v[j] * v[j]);
        }
        Complex load = scaled(system->m[i], minus(field, bend));
        *force = plus(*force, load);
        *moment += product(conjugate(z), load).im;
    }
    for (int j = 0; j < n; j++) {
        *moment -= system->J[j] * a[j];
    }
    for (int i = 0; i < m->force_count; i++) {
        const BodyFrame *frame = &system->bodies[m->forces[i].body - 1];
        const double *given = equations->inputs.forces + 3 * i;
        Complex centre = minus(frame->c, system->anchor), f = complex_of(given[0], given[1]);
        for (int j = 0; j < n; j++) {
            centre = plus(centre, product(frame->A[j], e[j]));
        }
        *force = plus(*force, f);
        *moment += product(conjugate(centre), f).im + given[2];
    }
}
