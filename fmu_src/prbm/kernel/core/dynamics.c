/* The equations of motion in one discrete state: the twin of prbm/dynamics.py. */
#include <math.h>
#include <string.h>

#include "kernel.h"

static Parts place_parts(Memory *memory, size_t count) {
    Parts parts;
    parts.re = place(memory, count, sizeof(double));
    parts.im = place(memory, count, sizeof(double));
    return parts;
}

PRBM void equations_place(Equations *equations, const System *system, Memory *memory) {
    size_t n = (size_t)system->n, s = (size_t)system->s, f = (size_t)system->f;
    size_t r = (size_t)system->r + 2 * s + f, even = (size_t)system->even;
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
    q.z = place(memory, r, sizeof(Complex));
    q.c = place(memory, r, sizeof(double));
    q.on = place(memory, r, sizeof(int));
    q.carried = place(memory, r, sizeof(int));
    q.own = place(memory, n, sizeof(double));
    q.w = place(memory, n, sizeof(Complex));
    q.w_input = place(memory, n, sizeof(Complex));
    q.moment = place(memory, even, sizeof(double));
    q.B_conjugate = place_parts(memory, r * even);
    q.w_parts = place_parts(memory, even);
    q.start = place(memory, even, sizeof(double));
    q.e_at_start = place(memory, even, sizeof(Complex));
    q.e_start = place_parts(memory, even);
    q.angle = place(memory, even, sizeof(double));
    q.speed = place(memory, even + 2, sizeof(double));
    q.squares = place(memory, even, sizeof(double));
    q.turns = place(memory, even + 2, sizeof(double));
    q.e = place(memory, even, sizeof(Complex));
    q.e_parts = place_parts(memory, even);
    q.rows = place(memory, r * even, sizeof(double));
    q.columns = place(memory, r * even, sizeof(double));
    q.x = place(memory, even + 2, sizeof(double));
    q.lam = place(memory, r, sizeof(double));
    q.block = place(memory, n * n, sizeof(double));
    q.least = place(memory, s, sizeof(double));
    q.most = place(memory, s, sizeof(double));
    q.factors.even = (int)even;
    q.factors.blocks = system->blocks;
    q.factors.L = place(memory, n * n, sizeof(double));
    q.factors.inverse = place(memory, even, sizeof(double));
    q.factors.Z = place(memory, r * even, sizeof(double));
    q.factors.S = place(memory, 2 * r * r + r, sizeof(double));
    q.factors.pivots = place(memory, r, sizeof(int));
    *equations = q;
}

/* --- what holds, sticks and slides ------------------------------------------------------------ */

/* Make the i-th of some rows the next active one, with the constant c. */
static void add_row(Equations *q, const Rows *rows, int i, double c) {
    int n = q->system->n, on = seen_from(rows, i);
    memcpy(q->B + q->r * n, rows->B + i * n, (size_t)n * sizeof *rows->B);
    q->c[q->r] = c;
    q->on[q->r] = on;
    if (on != FIXED) {
        q->z[q->r] = rows->z[i];
        q->carried[q->carried_count++] = q->r;
    }
    q->r++;
}

static void set_rows(Equations *q) {
    const System *system = q->system;
    Rows loops = plain_rows(system, system->r, system->loops, system->loops_c);
    Rows gaps = gap_rows(system), walls = slide_rows(system), rubs = rub_rows(system);
    q->r = q->carried_count = 0;
    for (int k = 0; k < system->r; k++) {
        add_row(q, &loops, k, system->loops_c[k]);
    }
    q->first_hold = q->r;
    q->held_count = q->stuck_count = q->rubbing_count = q->sliding_count = 0;
    for (int i = 0; i < system->s; i++) {
        if (q->discrete.holds[i]) {
            q->held[q->held_count++] = i;
            add_row(q, &gaps, i, system->gaps_c[i] + q->inputs.walls[i].position);
        }
    }
    q->first_stick = q->r;
    for (int k = 0; k < q->held_count; k++) {
        int i = q->held[k], slides = q->discrete.slides[i];
        if (slides == STICKS) {
            q->stuck[q->stuck_count++] = i;
            add_row(q, &walls, i, 0.0);
        } else if (slides != IDLE) {
            q->sliding[q->sliding_count++] = i;
        }
    }
    q->first_rub = q->r;
    q->rub_slide_count = 0;
    for (int i = 0; i < system->f; i++) {
        int slides = q->discrete.rubs[i];
        if (slides == STICKS) {
            q->rubbing[q->rubbing_count++] = i;
            add_row(q, &rubs, i, 0.0);
        } else if (slides != IDLE && q->rub_law[3 * i] > 0.0) {
            q->rub_slides[q->rub_slide_count++] = i;
        }
    }
    Rows active = {system, q->r, q->B, q->c, q->z, q->on};
    q->active = active;
}

static Parts parts_from(Parts parts, int start) {
    parts.re += start;
    parts.im += start;
    return parts;
}

/* What is behind the coordinates in padded vectors stays zero; the rows' parts are spread. */
static void set_padding(Equations *q) {
    int n = q->system->n, even = q->system->even;
    for (int k = 0; k < q->r; k++) {
        spread(q->system, 1, q->B + k * n, q->w); /* which the loads are put into later */
        pad_parts(n, q->w, parts_from(q->B_conjugate, k * even));
    }
    for (int i = 0; i < q->r * even; i++) {
        q->B_conjugate.im[i] = -q->B_conjugate.im[i];
    }
    copy(n, q->system->own, q->own);
    zeros(q->r * even, q->factors.Z);
    zeros(even, q->factors.inverse);
    q->speed[n] = q->turns[n] = 0.0;
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
    zeros(system->even, q->moment);
    field_row(n, system->S, scaled(-1.0, q->inputs.base), q->w_input);
    for (int i = 0; i < m->force_count; i++) {
        const BodyFrame *frame = &system->pushed[i];
        const double *given = q->inputs.forces + LOADS * i;
        force_row(n, frame->A, complex_of(given[0], given[1]), q->w);
        for (int j = 0; j < n; j++) {
            q->w_input[j] = plus(q->w_input[j], q->w[j]);
        }
        q->moment[frame->j] += given[2];
    }
    spread(system, 1, q->w_input, q->w_input);
    field_row(n, system->S, system->gravity, q->w);
    spread(system, 1, q->w, q->w);
    q->driven = false;
    for (int j = 0; j < n; j++) {
        q->w[j] = plus(q->w_input[j], q->w[j]);
        q->driven = q->driven || q->w_input[j].re != 0.0 || q->w_input[j].im != 0.0 ||
                    q->moment[j] != 0.0;
    }
    pad_parts(n, q->w, q->w_parts);
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
    set_padding(q);
    set_loads(q);
}

/* --- motion ----------------------------------------------------------------------------------- */

/* The angles from whose directions those near them are turned. */
static void start_from(Equations *q, const double *angle) {
    int even = q->system->even;
    pad(q->system->n, angle, q->start);
    unit_vectors(even, q->start, q->e_at_start);
    pad_parts(even, q->e_at_start, q->e_start);
    stretch(q->system, q->start, q->e_at_start);
}

/* The arms of links that stretch, and the diagonal of M, of which |E|^2 is a factor. */
RARE void stretch_links(Equations *q) {
    const System *system = q->system;
    stretch(system, q->angle, q->e);
    pad_parts(system->even, q->e, q->e_parts);
    for (int k = 0; k < system->stretch_count; k++) {
        int j = system->stretches[k], a = arm_of(system, j);
        double square = q->e[a].re * q->e[a].re + q->e[a].im * q->e[a].im;
        q->own[a] = q->own[j] = system->own[a] * square;
    }
}

/* The directions at the angles: from those of the start, or afresh. */
SIZED void directions_of(int even, Equations *q, bool turned) {
    if (!turned ||
        !turned_directions(even, q->angle, q->start, q->e_start, q->e_parts, q->e)) {
        unit_vectors(even, q->angle, q->e);
        pad_parts(even, q->e, q->e_parts);
    }
    if (q->system->stretch_count > 0) {
        stretch_links(q);
    }
}

static void find_directions(Equations *q, bool turned) {
    directions_of(q->system->even, q, turned);
}

/* Re(w^2) of the complex rates w = theta' - i s' of arms, for the squares of all rates. */
RARE void stretch_squares(const System *system, double *squares) {
    for (int k = 0; k < system->stretch_count; k++) {
        int j = system->stretches[k];
        squares[arm_of(system, j)] -= squares[j];
        squares[j] = 0.0;
    }
}

/* x: the loads Re(w e) + moment. */
SIZED void find_loads(int even, Equations *q) {
    const double *moment = q->moment, *v = q->speed;
    double *x = q->x, *squares = q->squares;
    Parts w = q->w_parts, e = q->e_parts;
    UNROLLED_BY_LANES
    for (int j = 0; j < even; j += LANES) {
        Lanes re = lanes_at(w.re + j) * lanes_at(e.re + j);
        Lanes im = lanes_at(w.im + j) * lanes_at(e.im + j);
        set_lanes(x + j, lanes_at(moment + j) + (re - im));
        set_lanes(squares + j, lanes_at(v + j) * lanes_at(v + j));
    }
    if (q->system->stretch_count > 0) {
        stretch_squares(q->system, squares);
    }
}

/* What the rates of stretches add to the accelerations of angles: with Im(w^2) = -2 theta' s', all
 * that w^2 enters is solved for a - Im(w^2) as it is for a without stretches. */
static double coriolis(const Equations *q, int stretch_coordinate) {
    return -2.0 * q->speed[arm_of(q->system, stretch_coordinate)] * q->speed[stretch_coordinate];
}

/* What springs and their damping take up: x -= K (q - q0 + beta v), spring by spring, and the
 * power beta v^T K v of the damping. */
SIZED void add_springs(int even, Equations *q) {
    const System *system = q->system;
    const int n = system->n;
    const double *angle = q->angle, *straight = system->straight, *v = q->speed;
    double *turns = q->turns, *x = q->x, sum = 0.0; /* x has room for the ground's share */
    UNROLLED_BY_LANES
    for (int j = 0; j < even; j += LANES) {
        Lanes turn = lanes_at(angle + j) - lanes_at(straight + j);
        set_lanes(turns + j, turn + q->beta * lanes_at(v + j));
    }
    for (int k = 0; k < system->spring_count; k++) {
        const Spring *spring = &system->spring[k];
        int a = spring->a, b = spring->b;
        double torque = spring->rate * (turns[b] - turns[a]), swing = v[b] - v[a];
        x[a] += torque;
        x[b] -= torque;
        sum += spring->rate * (swing * swing);
    }
    x[n] = 0.0;
    q->spring_loss = q->beta * sum;
}

/* Rows -Im(B e) and, in lam, their convective terms Re(B e) v^2; B is the conjugate. */
SIZED void convect(int count, int even, Parts B, Parts e, const double *ALONE squares,
                   double *ALONE rows, double *ALONE lam) {
    Lanes sum[SMALL][SUMS] = {{NO_LANES}};
    UNROLLED_BY_LANES
    for (int j = 0; j < even; j += LANES) {
        Lanes e_re = lanes_at(e.re + j), e_im = lanes_at(e.im + j), square = lanes_at(squares + j);
        UNROLLED
        for (int k = 0; k < count; k++) {
            Lanes re = lanes_at(B.re + k * even + j), im = lanes_at(B.im + k * even + j);
            set_lanes(rows + k * even + j, im * e_re - re * e_im);
            sum[k][SUM_OF(j)] += (re * e_re + im * e_im) * square;
        }
    }
    UNROLLED
    for (int k = 0; k < count; k++) {
        lam[k] = total(sum[k]);
    }
}

/* The rows that are seen from a body, and what is left of their convective terms. */
RARE void carried_rows(Equations *q, double *rows) {
    const System *system = q->system;
    for (int c = 0; c < q->carried_count; c++) {
        int k = q->carried[c];
        double *row = rows + k * system->even;
        row_jacobian(&q->active, k, q->e, row);
        q->lam[k] = row_convective(&q->active, k, q->e, q->speed);
        for (int l = 0; l < system->stretch_count; l++) {
            int j = system->stretches[l];
            q->lam[k] -= row[arm_of(system, j)] * coriolis(q, j);
        }
    }
}

SIZED void rows_to_length(int even, Equations *q, double *rows) {
    Parts B = q->B_conjugate, e = q->e_parts;
    switch (q->r) {
    case 1: convect(1, even, B, e, q->squares, rows, q->lam); break;
    case 2: convect(2, even, B, e, q->squares, rows, q->lam); break;
    case 3: convect(3, even, B, e, q->squares, rows, q->lam); break;
    default:
        for (int k = 0; k < q->r; k++) {
            convect(1, even, parts_from(B, k * even), e, q->squares, rows + k * even, q->lam + k);
        }
    }
    if (q->carried_count > 0) {
        carried_rows(q, rows);
    }
}

static void rows_and_convection(Equations *q, double *rows) {
    rows_to_length(q->system->even, q, rows);
}

SIZED void rows_of_length(int even, Equations *q, double *rows) {
    if (KNOWN(even)) {
        rows_to_length(even, q, rows);
    } else {
        rows_and_convection(q, rows);
    }
}

/* x -= c M v within a block. */
SIZED void damp_mass(int size, double c, const double *ALONE M, const double *ALONE v,
                     double *ALONE x) {
    for (int i = 0; i < size; i++) {
        x[i] -= c * M[i * size + i] * v[i];
        for (int j = 0; j < i; j++) {
            x[i] -= c * M[i * size + j] * v[j];
            x[j] -= c * M[i * size + j] * v[i];
        }
    }
}

/* One block of M, and what its inertia adds to the loads x: Im(diag(e)^H H diag(e)) v^2, as the
 * mass matrix is symmetric and the quadratic velocities are antisymmetric. */
SIZED void block_inertia(int size, const Complex *ALONE H, const double *ALONE own, Parts e,
                         const double *ALONE squares, double *ALONE M, double *ALONE x) {
    UNROLLED
    for (int i = 0; i < size; i++) {
        const int columns = size <= SMALL ? size : i;
        UNROLLED
        for (int j = 0; j < columns; j++) {
            if (j < i) {
                double re = e.re[i] * e.re[j] + e.im[i] * e.im[j];
                double im = e.re[i] * e.im[j] - e.im[i] * e.re[j];
                double turned = H[i * size + j].re * im + H[i * size + j].im * re;
                M[i * size + j] = H[i * size + j].re * re - H[i * size + j].im * im;
                x[i] += turned * squares[j];
                x[j] -= turned * squares[i];
            }
        }
        M[i * size + i] = own[i];
    }
}

/* M in its block of the coordinates from start, and what its inertia and damping add to x. */
SIZED void block_mass(Equations *q, int size, int start, const Complex *H, double *M) {
    double *x = q->x + start;
    block_inertia(size, H, q->own + start, parts_from(q->e_parts, start),
                  q->squares + start, M, x);
    if (q->mass_damping != 0.0) {
        damp_mass(size, q->mass_damping, M, q->speed + start, x);
    }
}

/* The block of M in q->block, factored into L, and L^-1 of the loads and rows. */
SIZED bool factor_any_block(Equations *q, int size, int start, double *L) {
    const Factors *factors = &q->factors;
    if (!factor_any(size, q->block, L, factors->inverse + start)) {
        return false;
    }
    block_forward(size, L, q->x + start);
    for (int k = 0; k < q->r; k++) {
        block_forward(size, L, factors->Z + k * q->system->even + start);
    }
    return true;
}

RARE bool factor_block(Equations *q, int size, int start, double *L) {
    return factor_any_block(q, size, start, L);
}

SIZED bool block_motion(Equations *q, int size, int start, const Complex *H, double *L) {
    block_mass(q, size, start, H, q->block);
    return factor_any_block(q, size, start, L);
}

/* The same of a small block; one of tiny or huge numbers takes the longer way. */
SIZED bool small_block_motion(Equations *q, int size, int start, const Complex *H, double *L) {
    const int even = q->system->even, r = q->r;
    double M[SMALL * SMALL], D[SMALL];
    block_mass(q, size, start, H, M);
    if (!small_factor(size, M, L, D)) {
        UNROLLED
        for (int i = 0; i < size * size; i++) {
            q->block[i] = i % size <= i / size ? M[i] : 0.0;
        }
        return factor_block(q, size, start, L);
    }
    put_block(size, start, D, q->factors.inverse);
    solve_small(size, start, L, q->x, FORWARD);
    for (int k = 0; k < r; k++) {
        solve_small(size, start, L, q->factors.Z + k * even, FORWARD);
    }
    return true;
}

static bool blocks_motion(Equations *q) {
    bool regular = true;
    const Complex *H = q->system->coupling;
    double *L = q->factors.L;
    for (int k = 0; k < q->factors.block_count; k++) {
        int start = q->factors.blocks[k].start, size = q->factors.blocks[k].size;
        switch (size) {
        case 1: regular = small_block_motion(q, 1, start, H, L) && regular; break;
        case 2: regular = small_block_motion(q, 2, start, H, L) && regular; break;
        case 3: regular = small_block_motion(q, 3, start, H, L) && regular; break;
        case 4: regular = small_block_motion(q, 4, start, H, L) && regular; break;
        default: regular = block_motion(q, size, start, H, L) && regular;
        }
        H += size * size;
        L += size * size;
    }
    return regular;
}

/* v^T diag(e)^H H diag(e) v / 2 */
PRBM double energy_here(const Equations *equations, const double *v) {
    const System *system = equations->system;
    const Complex *e = equations->e;
    double sum = 0.0;
    for (int k = 0; k < system->block_count; k++) {
        int start = system->blocks[k].start, end = start + system->blocks[k].size;
        for (int i = start; i < end; i++) {
            double row = 0.5 * equations->own[i] * v[i];
            for (int j = start; j < i; j++) {
                Complex h = system->H[i * system->n + j];
                row += product(product(conjugate(e[i]), h), e[j]).re * v[j];
            }
            sum += row * v[i];
        }
    }
    return sum;
}

PRBM double rub_limit(const Equations *equations, int i, const Complex *e) {
    const System *system = equations->system;
    const double *law = equations->rub_law + 3 * i;
    Rows lifts = plain_rows(system, system->f, system->lifts, system->lifts_c);
    double lift = row_value(&lifts, i, e) + lifts.c[i];
    return law[0] * normal_force(lift, law[1], law[2]);
}

/* The friction force of a sliding friction point along its direction. */
static double rub_force(const Equations *q, int i) {
    return -q->discrete.rubs[i] * rub_limit(q, i, q->e);
}

static void add_rubs(Equations *q) {
    Rows rubs = rub_rows(q->system);
    for (int k = 0; k < q->rub_slide_count; k++) {
        int i = q->rub_slides[k];
        row_jacobian(&rubs, i, q->e, q->rows);
        add_scaled(q->system->n, rub_force(q, i), q->rows, q->x);
    }
}

/* A stop that slides pushes along its gap and, by Coulomb's law, along its wall: its column differs
 * from its row. */
static void set_columns(Equations *q) {
    const System *system = q->system;
    int n = system->n, even = system->even;
    Rows walls = slide_rows(system);
    q->factors.Z_columns = q->factors.Z;
    if (q->sliding_count == 0) {
        return;
    }
    q->factors.Z_columns = q->columns;
    copy(q->r * even, q->factors.Z, q->columns);
    for (int k = 0; k < q->sliding_count; k++) {
        int i = q->sliding[k], h = q->first_hold + held_at(q, i);
        double share = -q->stop_friction[i] * q->discrete.slides[i];
        double *column = q->columns + h * even;
        row_jacobian(&q->active, h, q->e, column);
        row_jacobian(&walls, i, q->e, q->rows);
        add_scaled(n, share, q->rows, column);
        forward_all(&q->factors, column);
    }
}

/* The factors, and x := L^-1 x, from the rows in Z. */
SIZED bool factor_motion(int even, Equations *q) {
    q->factors.r = q->r;
    q->factors.block_count = q->system->block_count;
    if (!blocks_motion(q)) {
        return false;
    }
    set_columns(q);
    return schur_of_length(even, &q->factors);
}

RARE void add_coriolis(Equations *q) {
    for (int k = 0; k < q->system->stretch_count; k++) {
        int j = q->system->stretches[k];
        q->x[arm_of(q->system, j)] += coriolis(q, j);
    }
}

/* Solve for x = a and lam at angle and speed; turned: near the start. */
SIZED bool motion_of_length(int even, Equations *q, bool turned) {
    directions_of(even, q, turned);
    find_loads(even, q);
    add_springs(even, q);
    rows_of_length(even, q, q->factors.Z);
    add_rubs(q);
    if (!factor_motion(even, q)) {
        return false;
    }
    finish_of_length(even, &q->factors, q->x, q->lam);
    if (q->system->stretch_count > 0) {
        add_coriolis(q);
    }
    return true;
}

static bool solve_motion(Equations *q, const double *angle, const double *v, bool turned) {
    pad(q->system->n, angle, q->angle);
    pad(q->system->n, v, q->speed);
    return motion_of_length(q->system->even, q, turned);
}

/* Only the factors, at a state that is then a start. */
static bool factor_start(Equations *q, const double *angle, const double *v) {
    start_from(q, angle);
    pad(q->system->n, angle, q->angle);
    pad(q->system->n, v, q->speed);
    find_directions(q, true);
    find_loads(q->system->even, q);
    rows_and_convection(q, q->factors.Z);
    return factor_motion(q->system->even, q);
}

PRBM bool accelerations(Equations *equations, const double *q, const double *v, double *a,
                        double *lam, Problem *problem) {
    if (!solve_motion(equations, q, v, false)) {
        return fail(problem, "%s", SINGULAR);
    }
    copy(equations->system->n, equations->x, a);
    copy(equations->r, equations->lam, lam);
    return true;
}

/* The power that friction takes out. */
static double rubbing_power(const Equations *q, const double *v) {
    Rows rubs = rub_rows(q->system), walls = slide_rows(q->system);
    double power = 0.0;
    for (int k = 0; k < q->rub_slide_count; k++) {
        int i = q->rub_slides[k];
        power -= rub_force(q, i) * row_rate(&rubs, i, q->e, v);
    }
    for (int k = 0; k < q->sliding_count; k++) {
        int i = q->sliding[k];
        double force = q->lam[q->first_hold + held_at(q, i)];
        double speed = row_rate(&walls, i, q->e, v);
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
        power -= q->lam[q->first_hold + k] * q->inputs.walls[q->held[k]].rate;
    }
    return power;
}

static void trace_forces(Equations *q) {
    const double *force = q->lam + q->first_hold;
    for (int k = 0; k < q->held_count; k++) {
        q->least[k] = lesser(force[k], q->least[k]);
        q->most[k] = greater(force[k], q->most[k]);
    }
}

PRBM void begin_trace(Equations *q) {
    for (int k = 0; k < q->held_count; k++) {
        q->least[k] = INFINITY;
        q->most[k] = -INFINITY;
    }
}

SIZED bool rates_of_length(int even, Equations *q, const double *y, bool turned, double *dy) {
    int n = q->system->n;
    pad_of(even, n, y, q->angle);
    pad_second(even, n, y, q->speed);
    if (!motion_of_length(even, q, turned)) {
        return false;
    }
    join(even, n, q->speed, q->x, dy);
    return true;
}

/* The lengths of the guides' vectors are known where they are compiled, so that loops unroll. */
static bool rates_of_motion(Equations *q, const double *y, bool turned, double *dy) {
    int even = q->system->even;
    switch (even) {
    case 4: return rates_of_length(4, q, y, turned, dy);
    case 8: return rates_of_length(8, q, y, turned, dy);
    default: return rates_of_length(even, q, y, turned, dy);
    }
}

/* The rates of y; turned: near the start. */
static bool rates_at(Equations *q, const double *y, bool turned, double *dy, Problem *problem) {
    int n = q->system->n;
    const double *v = y + n;
    if (!rates_of_motion(q, y, turned, dy)) {
        return fail(problem, "%s", SINGULAR);
    }
    trace_forces(q);
    dy[2 * n] = q->spring_loss;
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

/* The loads do not depend on the time; a moving wall is a matter of the constraints. */
PRBM bool rate(Equations *equations, double t, const double *y, double *dy, Problem *problem) {
    (void)t;
    return rates_at(equations, y, false, dy, problem);
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
    Rows positions = q->active;
    positions.count = q->first_stick;
    bool right = project_positions(q->system, &positions, y, c, e, scratch, problem);
    if (right) {
        jacobian(&q->active, e, rows);
        inertia((int)n, q->system->H, q->system->J, e, M, C);
        right = project_velocities((int)n, q->r, M, rows, rates, y + n, scratch, problem);
    }
    scratch->used = mark;
    return right;
}

/* The value of an active row, but for its constant, at the state that was evaluated last. */
SIZED double active_value(int even, const Equations *q, int k) {
    if (q->system->stretch_count > 0 || q->on[k] != FIXED) {
        return row_value(&q->active, k, q->e);
    }
    Parts B = parts_from(q->B_conjugate, k * even), e = q->e_parts;
    Lanes sum[SUMS] = {NO_LANES};
    UNROLLED_BY_LANES
    for (int j = 0; j < even; j += LANES) {
        Lanes re = lanes_at(B.re + j) * lanes_at(e.re + j);
        Lanes im = lanes_at(B.im + j) * lanes_at(e.im + j);
        sum[SUM_OF(j)] += re + im;
    }
    return total(sum);
}

/* The worst distance from the constraints, in what lam asks for. */
SIZED double ask_positions(int even, Equations *q, double t) {
    double worst = 0.0;
    for (int k = 0; k < q->r; k++) {
        q->lam[k] = k < q->first_stick ? -(active_value(even, q, k) + offset(q, k, t)) : 0.0;
        worst = fabs(q->lam[k]) <= worst ? worst : fabs(q->lam[k]); /* a NaN stays */
    }
    return worst;
}

SIZED void ask_velocities(int even, Equations *q) {
    rows_of_length(even, q, q->rows);
    for (int k = 0; k < q->r; k++) {
        q->lam[k] = -(even_dot(even, q->rows + k * even, q->speed) + prescribed(q, k));
    }
}

/* y += what the rows ask for. */
SIZED void correct(int even, Equations *q, double *y) {
    UNROLLED_BY_LANES
    for (int j = 0; j < even; j += LANES) {
        set_lanes(q->x + j, all_lanes(0.0));
    }
    finish_of_length(even, &q->factors, q->x, q->lam);
    for (int i = 0; i < q->system->n; i++) {
        y[i] += q->x[i];
    }
}

/* One correction by the factors at hand; turned: near the start. */
SIZED bool corrected_of_length(int even, Equations *q, double t, double *y, bool turned) {
    int n = q->system->n;
    ask_positions(even, q, t); /* e is that of y: evaluated last */
    correct(even, q, y);
    pad_of(even, n, y, q->angle);
    directions_of(even, q, turned);
    if (!(ask_positions(even, q, t) <= CLOSED * q->system->length)) {
        return false;
    }
    pad_second(even, n, y, q->speed);
    ask_velocities(even, q);
    correct(even, q, y + n);
    return true;
}

static bool corrected(Equations *q, double t, double *y, bool turned) {
    int even = q->system->even;
    switch (even) {
    case 4: return corrected_of_length(4, q, t, y, turned);
    case 8: return corrected_of_length(8, q, t, y, turned);
    default: return corrected_of_length(even, q, t, y, turned);
    }
}

static bool project_near(Equations *q, double t, double *y, bool turned, Scratch *scratch,
                         Problem *problem) {
    int n = q->system->n;
    size_t mark = scratch->used;
    double *kept = take(scratch, (size_t)n);
    copy(n, y, kept);
    scratch->used = mark;
    if (q->sliding_count == 0 && corrected(q, t, y, turned)) {
        return true;
    }
    copy(n, kept, y); /* as if nothing had been tried */
    return project(q, t, y, scratch, problem);
}

/* The directions at angles near the start. */
static const Complex *directions_near(Equations *q, const double *angle) {
    pad(q->system->n, angle, q->angle);
    find_directions(q, true);
    return q->e;
}

PRBM bool project_from_here(Equations *equations, double t, double *y, Scratch *scratch,
                            Problem *problem) {
    return project_near(equations, t, y, false, scratch, problem);
}

/* --- stops ------------------------------------------------------------------------------------ */

PRBM double gap(const Equations *equations, int i, double t, const Complex *e) {
    Rows rows = gap_rows(equations->system);
    return row_value(&rows, i, e) + rows.c[i] + wall_at(&equations->inputs.walls[i], t);
}

PRBM double gap_rate(const Equations *equations, int i, const Complex *e, const double *v) {
    Rows rows = gap_rows(equations->system);
    return row_rate(&rows, i, e, v) + equations->inputs.walls[i].rate;
}

/* --- reactions -------------------------------------------------------------------------------- */

/* E (i w' - w^2) of the arms: a place accelerates by A times that. */
static void arm_accelerations(const System *system, const Complex *e, const double *v,
                              const double *a, Complex *result, Scratch *scratch) {
    size_t mark = scratch->used;
    int n = system->n;
    Complex *w = take_complex(scratch, n, 1), *dw = take_complex(scratch, n, 1);
    turning(system, v, w);
    turning(system, a, dw);
    for (int j = 0; j < n; j++) {
        Complex change = minus(complex_of(-dw[j].im, dw[j].re), product(w[j], w[j]));
        result[j] = product(e[j], change);
    }
    scratch->used = mark;
}

/* A E */
static Complex along_arms(int n, const Complex *A, const Complex *e) {
    Complex sum = {0.0, 0.0};
    for (int j = 0; j < n; j++) {
        sum = plus(sum, product(A[j], e[j]));
    }
    return sum;
}

PRBM void base_reaction(const Equations *equations, const Complex *e, const double *v,
                        const double *a, Complex *force, double *moment, Scratch *scratch) {
    const System *system = equations->system;
    size_t mark = scratch->used;
    int n = system->n;
    Complex field = minus(system->gravity, equations->inputs.base);
    Complex *bend = take_complex(scratch, n, 1);
    arm_accelerations(system, e, v, a, bend, scratch);
    *force = complex_of(0.0, 0.0);
    *moment = 0.0;
    for (int i = 0; i < system->p; i++) {
        const Complex *A = system->A + i * n;
        Complex z = plus(along_arms(n, A, e), minus(system->c[i], system->anchor));
        Complex load = scaled(system->m[i], minus(field, along_arms(n, A, bend)));
        *force = plus(*force, load);
        *moment += product(conjugate(z), load).im;
    }
    for (int j = 0; j < n; j++) {
        *moment -= system->J[j] * a[j];
    }
    for (int i = 0; i < system->mechanism->force_count; i++) {
        const BodyFrame *frame = &system->pushed[i];
        const double *given = equations->inputs.forces + LOADS * i;
        Complex f = complex_of(given[0], given[1]);
        Complex z = plus(along_arms(n, frame->A, e), minus(frame->c, system->anchor));
        *force = plus(*force, f);
        *moment += product(conjugate(z), f).im + given[2];
    }
    scratch->used = mark;
}
