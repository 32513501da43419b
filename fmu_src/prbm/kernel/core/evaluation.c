/* Accelerations and multipliers: loads, mass matrix, rows and their factors at a state. */
#include "core/evaluation.h"
#include "core/forces.h"
#include "core/matrix.h"

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
