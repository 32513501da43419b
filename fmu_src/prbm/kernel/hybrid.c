/* The one state machine: integrate, locate, impact, continue; the twin of prbm/hybrid.py. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "hybrid.h"

#define TIME_RESOLUTION 1e-13 /* s; events are located to 1e-12 s */
#define TOUCHING 1e-10        /* of the size: gaps that close together with one being resolved */
#define RELEASE_GAP 1e-9      /* m; a wall may be touched at release by no more than this */
#define SHORTEST_FLIGHT 5e-7  /* of the period: the arc of a shorter bounce is lost in rounding */
#define LOWEST_BOUNCE 1e-10   /* of the size, in model exchange: gaps close a little late there */
#define LARGEST_MOBILITY 1e100 /* 1/kg; beyond, impulses are lost to underflow */
#define DEPENDENT 1e-4        /* share of a row's mobility that the stops leave */
#define MOST_AT_REST 6        /* things with friction whose combinations are tried */
#define ALIGNED 1e-9          /* the same for stops among each other */
#define NO_SPRING TWO_PI      /* rad/s; the scale of rates of a linkage without springs */
#define STILL 1e-9            /* of the velocity scale: what rounding leaves of none */
#define SLACK 1e-6            /* of the limit of friction: excess before what sticks slips */
#define CHATTER_SPAN 5e-3     /* of a period: in which CHATTER events are too many */
#define DOUBT 0.5             /* of the largest force of a stop within a step */
#define SAFETY 0.9
#define SHRINK 0.2
#define GROW 5.0
#define MEMORY 0.04           /* exponent of the previous error */
#define RETRY_EXPONENT 0.2    /* 1 / order */
#define STEP_EXPONENT (RETRY_EXPONENT - 0.75 * MEMORY)
#define STRICTNESS 0.6        /* of the tolerance: what the dense output adds has room too */
#define LEAST_ERROR 1e-4      /* of the tolerance: what a better step is remembered as */
#define LARGEST_STEP 0.05     /* of the fundamental period */
#define SMALLEST_STEP 1e-13   /* s */
#define ROUNDED 1e-12         /* of a time: what importers lose when they add up steps */
#define MOST_STEPS 1e9        /* of the longest, to one time: more is a mistake of units */
#define MOST_IMPACTS 2147483647.0 /* that an Integer of FMI can count */
#define TWO_PI 6.283185307179586

#define CHATTER 1000
enum { MOST_HOLDING = 12 }; /* stops at rest of which every set is tried; others hold nothing */

static const char *const EVENT_NAMES[] = {"none",     "impact", "release", "slip slide",
                                          "slip rub", "slide",  "rub"};

/* --- memory ----------------------------------------------------------------------------------- */

PRBM int state_size(const Simulation *sim) {
    return 2 * sim->mechanism->coordinate_count + 2;
}

static void place_state(Simulation *sim, Memory *memory) {
    const Mechanism *m = sim->mechanism;
    size_t ny = (size_t)state_size(sim), s = (size_t)m->stop_count, d = sizeof(double);
    size_t np = (size_t)m->parameter_count, nu = (size_t)m->input_count;
    size_t nx = 2 * (size_t)m->independent_count + 2;
    size_t nf = LOADS * (size_t)m->force_count;
    size_t counts[] = {sizeof(Scalars) / d, np, nu, np, nu, 3 * s, s, s, (size_t)m->friction_count,
                       sizeof(Latched) / d * s, ny, ny, ny, STAGES * ny, nx, s, s, s, nf, s};
    enum { GROUPS = sizeof counts / sizeof counts[0] };
    double *parts[GROUPS];
    size_t count = 0;
    for (size_t i = 0; i < GROUPS; i++) {
        count += counts[i];
    }
    double *state = place(memory, count, d);
    for (size_t i = 0; memory->base && i < GROUPS; i++) {
        parts[i] = state;
        state += counts[i];
    }
    sim->state_count = count;
    sim->backup = place(memory, count, d);
    if (memory->base) {
        sim->state = parts[0];
        sim->now = (Scalars *)(void *)parts[0];
        sim->values = parts[1];
        sim->given = parts[2];
        sim->acting_values = parts[3];
        sim->acting_given = parts[4];
        sim->walls = (Wall *)(void *)parts[5];
        sim->holds = parts[6];
        sim->slides = parts[7];
        sim->rubs = parts[8];
        sim->latched = (Latched *)(void *)parts[9];
        sim->front = parts[10];
        sim->k1 = parts[11];
        sim->arc_y = parts[12];
        sim->arc_k = parts[13];
        sim->states = parts[14];
        sim->floors = parts[15];
        sim->held_rates = parts[16];
        sim->held_times = parts[17];
        sim->received = parts[18];
        sim->swift = parts[19];
    }
}

static void place_discrete(Discrete *discrete, const Mechanism *m, Memory *memory) {
    discrete->holds = place(memory, (size_t)m->stop_count, sizeof(int));
    discrete->slides = place(memory, (size_t)m->stop_count, sizeof(int));
    discrete->rubs = place(memory, (size_t)m->friction_count, sizeof(int));
}

static void place_scratch(Scratch *scratch, const Mechanism *m, Memory *memory) {
    size_t n = (size_t)m->coordinate_count, s = (size_t)m->stop_count;
    size_t size = n + (size_t)m->loop_count + 2 * s + (size_t)m->friction_count + 2;
    size_t drawn = (size_t)m->ground_count + (size_t)m->body_count, pieces = (size_t)m->longest;
    for (int i = 0; i < m->type_count; i++) {
        size_t pivots = (size_t)m->types[i].pivots;
        pieces = pivots > pieces ? pivots : pieces;
    }
    size_t single = size * size + 4 * size + 2 * drawn + 4 * pieces + 16;
    scratch->size = 12 * size * size + 60 * size + 2 * drawn + 16 * pieces + 64;
    scratch->base = place(memory, scratch->size, sizeof(double));
    scratch->spare = place(memory, single, sizeof(double));
    scratch->used = scratch->most = 0;
    scratch->exceeded = false;
}

static void place_all(Simulation *sim, Memory *memory) {
    const Mechanism *m = sim->mechanism;
    size_t n = (size_t)m->coordinate_count, s = (size_t)m->stop_count;
    size_t ny = (size_t)state_size(sim), d = sizeof(double);
    size_t rows = (size_t)m->loop_count + 2 * s + (size_t)m->friction_count;
    place_state(sim, memory);
    system_place(&sim->system, m, memory);
    equations_place(&sim->equations, &sim->system, memory);
    equations_place(&sim->trial, &sim->system, memory);
    place_scratch(&sim->scratch, m, memory);
    place_discrete(&sim->discrete, m, memory);
    place_discrete(&sim->other, m, memory);
    sim->forces = place(memory, 3 * (size_t)m->force_count, d);
    sim->look_y = place(memory, (WATCHED + 1) * 2 * n, d);
    sim->look_e = place(memory, (WATCHED + 1) * n, sizeof(Complex));
    sim->look_gap = place(memory, WATCHED + 1, d);
    sim->look_rate = place(memory, WATCHED + 1, d);
    sim->y1 = place(memory, ny, d);
    sim->error = place(memory, ny, d);
    sim->e = place(memory, n, sizeof(Complex));
    sim->outputs = place(memory, (size_t)m->slots.count, d);
    sim->y = place(memory, ny, d);
    sim->rates = place(memory, ny, d);
    sim->a = place(memory, n, d);
    sim->lam = place(memory, rows, d);
}

PRBM Simulation *simulation_open(const Mechanism *mechanism) {
    Simulation counted = {0};
    counted.mechanism = mechanism;
    Memory memory = {NULL, 0};
    place(&memory, 1, sizeof(Simulation));
    place_all(&counted, &memory);
    size_t bytes = memory.used;
    memory.base = bytes < SIZE_MAX ? calloc(1, bytes) : NULL;
    memory.used = 0;
    if (!memory.base) {
        return NULL;
    }
    Simulation *sim = place(&memory, 1, sizeof(Simulation));
    sim->mechanism = mechanism;
    sim->bytes = bytes;
    place_all(sim, &memory);
    for (int i = 0; i <= WATCHED; i++) {
        weights(i / 8.0, sim->grid[i]);
    }
    simulation_reset(sim);
    return sim;
}

PRBM void simulation_close(Simulation *simulation) {
    free(simulation);
}

PRBM void simulation_listen(Simulation *simulation, Hear *hear, void *listener) {
    simulation->hear = hear;
    simulation->listener = listener;
}

PRBM const Mechanism *simulation_mechanism(const Simulation *simulation) {
    return simulation->mechanism;
}

PRBM size_t simulation_bytes(const Simulation *simulation) {
    return simulation->bytes;
}

PRBM void simulation_reset(Simulation *simulation) {
    Simulation *sim = simulation;
    const Mechanism *m = sim->mechanism;
    memset(sim->state, 0, sim->state_count * sizeof *sim->state);
    for (int i = 0; i < m->parameter_count; i++) {
        sim->values[i] = m->parameters[i].start;
    }
    for (int i = 0; i < m->input_count; i++) {
        sim->given[i] = m->input_starts[i];
    }
    sim->fresh = NOTHING;
    sim->stale = false;
}

PRBM void simulation_unstart(Simulation *simulation) {
    simulation->now->started = 0.0;
    simulation->fresh = NOTHING;
}

PRBM bool simulation_started(const Simulation *simulation) {
    return simulation->now->started != 0.0;
}

PRBM double simulation_time(const Simulation *simulation) {
    return simulation->now->time;
}

/* --- scales ----------------------------------------------------------------------------------- */

PRBM double omega_scale(const Simulation *sim) {
    return sim->omega > 0.0 ? sim->omega : sim->spring_rate;
}

PRBM double still(const Simulation *sim) {
    return STILL * omega_scale(sim) * sim->system.length;
}

PRBM double period(const Simulation *sim) {
    return TWO_PI / omega_scale(sim);
}

/* The scales that follow from frequency and stiffness: of rates without a fundamental frequency, and
 * of energies, one radian against the stiffest torsion spring or, where nothing bends, a turn by one
 * radian in a period. */
static void set_scales(Simulation *sim) {
    const System *system = &sim->system;
    int n = system->n;
    double torsion = 0.0, stiffest = largest(n * n, system->K), heaviest = 0.0;
    for (int i = 0; i < n * n; i++) {
        bool turns = arm_of(system, i / n) == i / n && arm_of(system, i % n) == i % n;
        torsion = turns ? greater(torsion, fabs(system->K[i])) : torsion;
        heaviest = greater(heaviest, modulus(system->H[i]));
    }
    sim->omega = TWO_PI * sim->now->frequency;
    sim->spring_rate = stiffest > 0.0 ? sqrt(stiffest / heaviest) : NO_SPRING;
    double turning = omega_scale(sim);
    sim->energy_scale = torsion > 0.0 ? torsion : heaviest * (turning * turning);
}

/* --- discrete state --------------------------------------------------------------------------- */

static int to_int(double x) {
    return (int)x;
}

/* The discrete state from the array of the state. */
PRBM void read_discrete(Simulation *sim) {
    for (int i = 0; i < sim->system.s; i++) {
        sim->discrete.holds[i] = to_int(sim->holds[i]);
        sim->discrete.slides[i] = to_int(sim->slides[i]);
    }
    for (int i = 0; i < sim->system.f; i++) {
        sim->discrete.rubs[i] = to_int(sim->rubs[i]);
    }
}

static Inputs inputs_of(const Simulation *sim) {
    const Mechanism *m = sim->mechanism;
    const double *base = sim->acting_given + m->input.base;
    Inputs inputs = {sim->forces, {base[0], base[1]}, sim->walls,
                     sim->acting_given + m->input.mobilities};
    return inputs;
}

PRBM void set_inputs(Simulation *sim) {
    copy(LOADS * sim->mechanism->force_count, sim->acting_given, sim->forces);
    Inputs inputs = inputs_of(sim);
    read_discrete(sim);
    set_equations(&sim->equations, &inputs, &sim->discrete, sim->omega);
    sim->fresh = NOTHING;
}

PRBM void set_discrete(Simulation *sim, const Discrete *discrete) {
    for (int i = 0; i < sim->system.s; i++) {
        sim->holds[i] = discrete->holds[i];
        sim->slides[i] = discrete->slides[i];
    }
    for (int i = 0; i < sim->system.f; i++) {
        sim->rubs[i] = discrete->rubs[i];
    }
    sim->now->has_k1 = 0.0;
    set_inputs(sim);
}

PRBM void without_hold(Simulation *sim, int stop) {
    read_discrete(sim);
    sim->discrete.holds[stop] = 0;
    set_discrete(sim, &sim->discrete);
}

/* The equations that hold in another discrete state, in sim->trial. */
static void try_equations(Simulation *sim, const Discrete *discrete) {
    Inputs inputs = inputs_of(sim);
    set_equations(&sim->trial, &inputs, discrete, sim->omega);
}

/* The values as they were set become those that act. */
PRBM bool take_values(Simulation *sim, Problem *problem) {
    const Mechanism *m = sim->mechanism;
    copy(m->parameter_count, sim->values, sim->acting_values);
    copy(m->input_count, sim->given, sim->acting_given);
    sim->assembled = check_values(m, sim->acting_values, problem) &&
                     assemble(&sim->system, sim->acting_values, &sim->scratch, problem);
    return sim->assembled;
}

static bool values_changed(const Simulation *sim) {
    size_t np = (size_t)sim->mechanism->parameter_count * sizeof(double);
    return memcmp(sim->values, sim->acting_values, np) != 0;
}

static bool given_changed(const Simulation *sim) {
    size_t nu = (size_t)sim->mechanism->input_count * sizeof(double);
    return memcmp(sim->given, sim->acting_given, nu) != 0;
}

/* --- inputs and parameters -------------------------------------------------------------------- */

PRBM bool simulation_set(Simulation *simulation, int slot, double x, Problem *problem) {
    Simulation *sim = simulation;
    const Mechanism *m = sim->mechanism;
    if (slot < m->parameter_count) {
        const Parameter *parameter = &m->parameters[slot];
        if (!check_parameter(parameter, x, problem)) {
            return false;
        }
        if (simulation_started(sim) && !parameter->tunable && x != sim->values[slot]) {
            return fail(problem, "%s is fixed once the motion has started; set it before",
                        parameter->name);
        }
        sim->values[slot] = x;
    } else {
        int i = slot - m->slots.inputs;
        if (i < 0 || i >= m->input_count) {
            return fail(problem, "what the model computes cannot be set; parameters and inputs can");
        }
        if (!finite_number(x)) {
            return fail(problem, "%s = %g must be a finite number", m->input_names[i], x);
        }
        bool mobility = i >= m->input.mobilities && i < m->input.base;
        if (mobility && x > LARGEST_MOBILITY) {
            return fail(problem, "%s = %g 1/kg must be at most %g 1/kg", m->input_names[i], x,
                        LARGEST_MOBILITY);
        }
        if (mobility && x < 0.0) {
            return fail(problem,
                        "%s = %g 1/kg must not be negative: it is the inverse effective mass of "
                        "the wall, 0 for a wall that does not move when it is hit",
                        m->input_names[i], x);
        }
        sim->given[i] = x;
    }
    if (sim->now->exchange != 0.0) {
        sim->stale = true;
        sim->fresh = NOTHING;
    }
    return true;
}

/* The impulses so far, of each force (b, 3). */
static const double *impulses(const Simulation *sim) {
    return sim->given + sim->mechanism->input.impulses;
}

PRBM bool impulses_changed(const Simulation *sim) {
    size_t count = LOADS * (size_t)sim->mechanism->force_count;
    return memcmp(impulses(sim), sim->received, count * sizeof *sim->received) != 0;
}

PRBM double wall_target(const Simulation *sim, int i, double h) {
    const Mechanism *m = sim->mechanism;
    const double *wall = wall_inputs(m, sim->given, i);
    return evaluate(m->stops[i].position, sim->values) + wall[0] + wall[1] * h;
}

/* --- start ------------------------------------------------------------------------------------ */

static bool check_tolerance(double x, Problem *problem) {
    if (!(x >= 1e-13 && x <= 1e-2)) {
        return fail(problem, "tolerance = %g must lie between 1e-13 and 1e-2", x);
    }
    return true;
}

/* Refuse a penetrated wall, and begin with the impact if one is hit at once. */
static bool check_walls(Simulation *sim, Problem *problem) {
    int n = sim->system.n, struck = -1;
    const double *v = sim->front + n;
    directions(&sim->system, sim->front, sim->e);
    for (int i = 0; i < sim->system.s; i++) {
        double distance = gap(&sim->equations, i, sim->now->front_time, sim->e);
        if (distance < -RELEASE_GAP) {
            double wall = sim->walls[i].position;
            const char *name = sim->mechanism->stops[i].name;
            return fail(problem,
                        "the wall %s is penetrated by %.6g m at release: %s.position = %.6g m, "
                        "the hit point is at %.6g m; move the stop or release further back",
                        name, -distance, name, wall, wall - distance);
        }
        if (struck < 0 && distance <= RELEASE_GAP &&
            gap_rate(&sim->equations, i, sim->e, v) < 0.0) {
            struck = i;
        }
    }
    return struck < 0 || impact(sim, struck, problem);
}

static bool start_shape(Simulation *sim, Problem *problem) {
    const Mechanism *m = sim->mechanism;
    size_t mark = sim->scratch.used, n = (size_t)sim->system.n;
    Equilibrium shape = {take(&sim->scratch, n), take(&sim->scratch, (size_t)sim->system.r + 1),
                         0.0};
    double displacement = evaluate(m->release.displacement, sim->acting_values);
    double speed = evaluate(m->release.velocity, sim->acting_values);
    bool right = equilibrium(&sim->system, true, displacement, &shape, &sim->scratch, problem);
    if (right) {
        zeros(state_size(sim), sim->front);
        copy((int)n, shape.q, sim->front);
        right = release_velocity(&sim->system, shape.q, speed, sim->front + n, &sim->scratch,
                                 problem);
    }
    sim->scratch.used = mark;
    return right;
}

static void start_discrete(Simulation *sim) {
    for (int i = 0; i < sim->system.s; i++) {
        Wall wall = {wall_target(sim, i, 0.0), 0.0, 0.0};
        sim->walls[i] = wall;
        sim->holds[i] = 0.0;
        sim->slides[i] = IDLE;
    }
    for (int i = 0; i < sim->system.f; i++) {
        sim->rubs[i] = IDLE;
    }
    memset(sim->latched, 0, (size_t)sim->system.s * sizeof *sim->latched);
    zeros(sim->system.s, sim->swift);
    copy(LOADS * sim->mechanism->force_count, impulses(sim), sim->received);
}

static bool set_off(Simulation *sim, Problem *problem) {
    int every[STOPS_MAX];
    for (int i = 0; i < sim->system.s; i++) {
        every[i] = i;
    }
    start_discrete(sim);
    set_inputs(sim);
    return start_shape(sim, problem) &&
           project(&sim->equations, sim->now->time, sim->front, &sim->scratch, problem) &&
           check_walls(sim, problem) &&
           settle(sim, every, sim->system.s, NULL, problem);
}

/* Keep what was before if an attempt fails. */
static bool attempt(Simulation *sim, bool right, Problem *problem) {
    if (sim->scratch.exceeded) {
        right = fail(problem, "the working memory of the simulation was too small; please report");
        sim->scratch.exceeded = false;
    }
    if (!right) {
        Problem another;
        copy((int)sim->state_count, sim->backup, sim->state);
        sim->scratch.used = 0;
        sim->fresh = NOTHING;
        if (simulation_started(sim)) {
            sim->assembled =
                assemble(&sim->system, sim->acting_values, &sim->scratch, &another);
            set_scales(sim);
            set_inputs(sim);
        }
    }
    return right;
}

static void keep_backup(Simulation *sim) {
    memcpy(sim->backup, sim->state, sim->state_count * sizeof *sim->state);
}

PRBM bool simulation_start(Simulation *simulation, double start_time, double tolerance,
                           bool exchange, Problem *problem) {
    Simulation *sim = simulation;
    keep_backup(sim);
    double *values = sim->values;
    double wanted = tolerance == 0.0 ? values[sim->mechanism->tolerance] : tolerance;
    Scalars fresh = {0};
    *sim->now = fresh;
    sim->now->time = sim->now->front_time = sim->now->window_since = start_time;
    sim->now->planned = sim->now->due = start_time;
    sim->now->tolerance = wanted;
    sim->now->exchange = exchange;
    sim->now->log_of_error = natural_log(LEAST_ERROR);
    bool right = check_tolerance(wanted, problem) && take_values(sim, problem) &&
                 fundamental_frequency(&sim->system, &sim->now->frequency, &sim->scratch, problem);
    if (right) {
        set_scales(sim);
        right = set_off(sim, problem);
    }
    if (right) {
        sim->now->started = 1.0;
        if (exchange) {
            exchange_begin(sim);
        }
    }
    return attempt(sim, right, problem);
}

/* --- time ------------------------------------------------------------------------------------- */

static double stop_field(const Simulation *sim, Expression field) {
    return evaluate(field, sim->acting_values);
}

static double given_velocity(const Simulation *sim, int i) {
    return wall_inputs(sim->mechanism, sim->given, i)[1];
}

static double *acting_velocity(const Simulation *sim, int i) {
    return sim->acting_given + sim->mechanism->input.walls + PER_WALL * i + 1;
}

/* Whether a wall is given a velocity that is another one beyond what its stop calls rest. */
static bool given_another(const Simulation *sim, int i, double acting) {
    double velocity = given_velocity(sim, i);
    double least = stop_field(sim, sim->mechanism->stops[i].rest_speed);
    return velocity != acting && fabs(velocity - sim->walls[i].rate) >= least;
}

/* Whether a time is within a communication step that was left in its middle, by an event or the
 * importer. */
static bool within_step(const Simulation *sim, double time) {
    const Scalars *now = sim->now;
    double rounding = ROUNDED * (fabs(time) + fabs(now->time));
    return (now->adrift != 0.0 || now->underway != 0.0) && time <= now->underway_until + rounding;
}

/* By when the walls are to be where they are said to be: in as long as a step took before. */
static double due_walls(const Simulation *sim) {
    return greater(sim->now->due, 2.0 * sim->now->time - sim->now->planned);
}

/* The rate of a wall in a step.  If it is a little elsewhere than it is said to be it gets there within
 * the step.  One that was given a velocity does not hurry in a step that is shorter than one before:
 * it takes as long as that, or goes by what its velocity has changed, or by half of rest_speed. */
static double wall_rate(const Simulation *sim, int i, double time) {
    double now = sim->now->time, due = due_walls(sim), velocity = given_velocity(sim, i);
    double off = wall_target(sim, i, 0.0) - wall_at(&sim->walls[i], now);
    double mends = off / (time - now);
    if ((velocity != 0.0 || sim->swift[i] != 0.0) && due > time) {
        double rest_speed = evaluate(sim->mechanism->stops[i].rest_speed, sim->values);
        double most = greater(fabs(off) / (due - now), fabs(velocity - *acting_velocity(sim, i)));
        most = greater(most, 0.5 * rest_speed);
        mends = lesser(greater(mends, -most), most);
    }
    return velocity + mends;
}

/* Turn the inputs of the walls into uniform motions up to a time; whether one changes.  For the rest
 * of a step after an event the walls go on as they do, but for one whose velocity has changed at
 * once. */
static bool plan_walls(const Simulation *sim, double time, Wall *planned) {
    bool changed = false, rest = within_step(sim, time);
    double now = sim->now->time, span = time - now;
    for (int i = 0; i < sim->system.s; i++) {
        double here = wall_at(&sim->walls[i], now);
        double rate = rest ? given_velocity(sim, i) : wall_rate(sim, i, time);
        double off = fabs(wall_at(&sim->walls[i], time) - here - rate * span);
        bool other = rest ? given_another(sim, i, *acting_velocity(sim, i))
                          : off > 1e-13 * sim->system.length;
        planned[i] = sim->walls[i];
        if (other) {
            Wall wall = {here, rate, now};
            planned[i] = wall;
            changed = true;
        }
    }
    return changed;
}

/* Let go of what rested on a wall and moves, by the wall's velocity or an impulse: a wall that
 * retreats leaves the body behind; one that advances strikes, as does a body that is thrown against
 * a wall that it touches.  Such a stop is returned, or -1. */
PRBM int unsettled(Simulation *sim) {
    int n = sim->system.n, struck = -1;
    double gaps[STOPS_MAX], rates[STOPS_MAX], bound = still(sim);
    directions(&sim->system, sim->front, sim->e);
    for (int i = 0; i < sim->system.s; i++) {
        gaps[i] = gap(&sim->equations, i, sim->now->time, sim->e);
        rates[i] = gap_rate(&sim->equations, i, sim->e, sim->front + n);
    }
    for (int i = 0; i < sim->system.s; i++) {
        bool holds = sim->holds[i] != 0.0;
        if (holds && fabs(rates[i]) > bound) {
            without_hold(sim, i);
        } else if (holds || gaps[i] > TOUCHING * sim->system.length) {
            continue;
        }
        struck = rates[i] < -bound ? i : struck;
    }
    return struck;
}

/* The state y = (q, v, dissipated energy, work) at the present time, on the constraints; the start
 * of the equations is near it. */
static bool state_at(Simulation *sim, double *y, Problem *problem) {
    const Scalars *now = sim->now;
    int ny = state_size(sim), n = sim->system.n;
    if (now->has_arc == 0.0 || now->time >= now->front_time) {
        copy(ny, sim->front, y);
        start_from(&sim->equations, y);
        return true;
    }
    double theta = (now->time - now->arc_start) / now->arc_h;
    interpolate(ny, sim->arc_y, sim->arc_k, now->arc_h, theta, y);
    if (!factor_start(&sim->equations, y, y + n)) {
        return fail(problem, "%s", SINGULAR);
    }
    return project_near(&sim->equations, now->time, y, true, &sim->scratch, problem);
}

/* Go on from the present state with the present inputs and parameters. */
static bool restart(Simulation *sim, const Wall *planned, Problem *problem) {
    if (!state_at(sim, sim->y, problem)) {
        return false;
    }
    memcpy(sim->walls, planned, (size_t)sim->system.s * sizeof *planned);
    copy(state_size(sim), sim->y, sim->front);
    sim->now->front_time = sim->now->time;
    sim->now->has_arc = sim->now->has_k1 = 0.0;
    if (values_changed(sim) && !take_values(sim, problem)) {
        return false;
    }
    copy(sim->mechanism->input_count, sim->given, sim->acting_given);
    set_inputs(sim);
    if (!receive_impulses(sim, problem)) {
        return false;
    }
    int struck = unsettled(sim);
    if (struck >= 0) {
        return impact(sim, struck, problem);
    }
    return project(&sim->equations, sim->now->time, sim->front, &sim->scratch, problem) &&
           settle(sim, NULL, 0, NULL, problem);
}

/* --- steps ------------------------------------------------------------------------------------ */

/* The sum of the squares of errors x against the sizes of y and y1, which count as no less than the
 * least. */
static double squares_of(int n, const double *x, const double *y, const double *y1, double least) {
    double sum = 0.0;
    for (int i = 0; i < n; i++) {
        double ratio = x[i] / greater(least, greater(fabs(y[i]), fabs(y1[i])));
        sum += ratio * ratio;
    }
    return sum;
}

/* The root mean square of differences in units of the scales of angles, their rates, energies. */
static double relative_size(const Simulation *sim, const double *x, const double *y,
                            const double *y1) {
    int n = sim->system.n;
    double sum = dot(n, x, x) + squares_of(n, x + n, y + n, y1 + n, omega_scale(sim)) +
                 squares_of(2, x + 2 * n, y + 2 * n, y1 + 2 * n, sim->energy_scale);
    return sqrt(sum / state_size(sim));
}

static double largest_step(const Simulation *sim) {
    return LARGEST_STEP * period(sim);
}

/* A first step size from the size of the rates (Hairer, II.4). */
static double first_step(const Simulation *sim) {
    double size = greater(relative_size(sim, sim->k1, sim->front, sim->front), 1e-6);
    return lesser(largest_step(sim), 0.1 * power(sim->now->tolerance, 0.2) / size);
}

/* Find a step that keeps the tolerance: its stages in arc_k, its end in y1. */
static bool find_step(Simulation *sim, double *step, Problem *problem) {
    Scalars *now = sim->now;
    int ny = state_size(sim);
    double h = lesser(now->h > 0.0 ? now->h : first_step(sim), largest_step(sim)), growth = GROW;
    double error;
    copy(ny, sim->front, sim->arc_y);
    copy(ny, sim->k1, sim->arc_k);
    for (;;) {
        if (h < SMALLEST_STEP) {
            return fail(problem,
                        "the step size fell below %g s at t = %.9g s: the motion is too violent "
                        "for the model, or its links lie flat, where it ends; check the inputs and "
                        "parameters, or add damping.beta",
                        SMALLEST_STEP, now->front_time);
        }
        if (now->front_time + h == now->front_time) {
            return fail(problem,
                        "at t = %.9g s a step of %.3g s is lost in the rounding of the time: start "
                        "the simulation nearer to zero",
                        now->front_time, h);
        }
        begin_trace(&sim->equations);
        error = HUGE_VAL;
        if (stages(&sim->equations, ny, now->front_time, sim->arc_y, h, sim->arc_k, sim->y1,
                   problem)) {
            error_of(ny, sim->arc_k, h, sim->error);
            error = relative_size(sim, sim->error, sim->arc_y, sim->y1) /
                    (STRICTNESS * now->tolerance);
        }
        if (error <= 1.0) {
            break;
        }
        growth = 1.0; /* a step that had to be repeated is not followed by a longer one */
        double factor_h = finite_number(error) ? SAFETY * power(error, -RETRY_EXPONENT) : SHRINK;
        h *= greater(SHRINK, factor_h);
    }
    error = greater(error, LEAST_ERROR);
    double log_of_error = natural_log(error);
    double trend = MEMORY * now->log_of_error - STEP_EXPONENT * log_of_error;
    growth = lesser(growth, SAFETY * exponential(trend));
    now->h = h * greater(SHRINK, growth);
    now->log_of_error = log_of_error;
    *step = h;
    return true;
}

static bool first_event(Simulation *sim, Event *event, Problem *problem);

static void arc_at(const Simulation *sim, double t, double *y) {
    const Scalars *now = sim->now;
    interpolate(state_size(sim), sim->arc_y, sim->arc_k, now->arc_h,
                (t - now->arc_start) / now->arc_h, y);
}

/* Take one step from the front, cut it at the first event. */
static bool take_step(Simulation *sim, Problem *problem) {
    Scalars *now = sim->now;
    int ny = state_size(sim);
    double h = 0.0;
    if (now->has_k1 == 0.0 &&
        !rate(&sim->equations, now->front_time, sim->front, sim->k1, problem)) {
        return false;
    }
    if (!find_step(sim, &h, problem)) {
        return false;
    }
    now->arc_start = now->front_time;
    now->arc_h = h;
    now->arc_end = now->arc_start + h;
    now->event_kind = NO_EVENT;
    copy(ny, sim->y1, sim->front); /* the last stage was there */
    if (!project_near(&sim->equations, now->arc_end, sim->front, true, &sim->scratch, problem)) {
        return false;
    }
    Event event;
    if (!first_event(sim, &event, problem)) {
        return false;
    }
    now->has_arc = 1.0;
    if (event.kind == NO_EVENT) {
        now->front_time = now->arc_end;
        now->has_k1 = 1.0;
        copy(ny, sim->arc_k + (STAGES - 1) * ny, sim->k1);
        return true;
    }
    now->h = h; /* a step cut short says little about the next one */
    now->arc_end = now->front_time = now->event_time = event.time;
    now->event_kind = event.kind;
    now->event_index = event.index;
    now->has_k1 = 0.0;
    arc_at(sim, event.time, sim->front);
    return project(&sim->equations, event.time, sim->front, &sim->scratch, problem);
}

/* --- locating events -------------------------------------------------------------------------- */

/* A quantity whose fall to zero is an event. */
typedef struct {
    Simulation *sim;
    int kind, index;
    double sign;
    double depth; /* of a gap, at which it counts as fallen */
} Guard;

enum { GAP_FALLS, GAP_RATE_FALLS, SPEED_FALLS, MARGIN_FALLS };

/* The rows of the friction points, or of the stops along their walls. */
static Rows rows_of(const Simulation *sim, int kind) {
    bool rubs = kind == RUB || kind == SLIP_RUB;
    return rubs ? rub_rows(&sim->system) : slide_rows(&sim->system);
}

PRBM double margin_release(const Simulation *sim, int k) {
    return sim->equations.lam[sim->equations.first_hold + k];
}

/* What is left before the k-th stop that sticks slips. */
PRBM double margin_stick(const Simulation *sim, int k) {
    const Equations *q = &sim->equations;
    int i = q->stuck[k];
    double normal = q->lam[q->first_hold + held_at(q, i)];
    double friction = fabs(q->lam[q->first_stick + k]);
    return (1.0 + SLACK) * (q->stop_friction[i] * normal) - friction;
}

PRBM double margin_rub(const Simulation *sim, int k) {
    const Equations *q = &sim->equations;
    double friction = fabs(q->lam[q->first_rub + k]);
    return (1.0 + SLACK) * rub_limit(q, q->rubbing[k], q->e) - friction;
}

/* The margin of a release or slip, at the state that was evaluated last. */
static double margin(const Simulation *sim, int kind, int k) {
    if (kind == RELEASE) {
        return margin_release(sim, k);
    }
    return kind == SLIP_SLIDE ? margin_stick(sim, k) : margin_rub(sim, k);
}

static double guard_at(const Guard *guard, int what, double t) {
    Simulation *sim = guard->sim;
    int n = sim->system.n;
    double *y = sim->y1;
    arc_at(sim, t, y);
    if (what == MARGIN_FALLS) {
        Problem ignored;
        if (!accelerations(&sim->equations, y, y + n, sim->a, sim->lam, &ignored)) {
            return 0.0;
        }
        return margin(sim, guard->kind, guard->index);
    }
    directions(&sim->system, y, sim->e);
    if (what == GAP_FALLS) {
        return gap(&sim->equations, guard->index, t, sim->e) + guard->depth;
    }
    if (what == GAP_RATE_FALLS) {
        return guard->sign * gap_rate(&sim->equations, guard->index, sim->e, y + n);
    }
    Rows rows = rows_of(sim, guard->kind);
    return guard->sign * row_rate(&rows, guard->index, sim->e, y + n);
}

/* Brent's search for the fall of a guard between a, where it is positive, and b, where it is not
 * (R. P. Brent, Algorithms for Minimization without Derivatives, 1973, chapter 4). */
static double falls(const Guard *guard, int what, double a, double b) {
    double fa = guard_at(guard, what, a), fb;
    if (fa <= 0.0) {
        return a;
    }
    fb = guard_at(guard, what, b);
    if (fb > 0.0) {
        return b;
    }
    double other = a, f_other = fa, step = b - a, last = step;
    for (int i = 0; i < 100 && fb != 0.0; i++) {
        if ((fb > 0.0) == (f_other > 0.0)) {
            other = a;
            f_other = fa;
            step = last = b - a;
        }
        if (fabs(f_other) < fabs(fb)) {
            a = b, b = other, other = a;
            fa = fb, fb = f_other, f_other = fa;
        }
        double close = 0.5 * TIME_RESOLUTION + 4.5e-16 * fabs(b), half = 0.5 * (other - b);
        if (fabs(half) <= close) {
            break;
        }
        if (fabs(last) >= close && fabs(fa) > fabs(fb)) {
            double s = fb / fa, p, q;
            if (a == other) { /* secant */
                p = 2.0 * half * s;
                q = 1.0 - s;
            } else { /* inverse quadratic interpolation */
                double u = fa / f_other, w = fb / f_other;
                p = s * (2.0 * half * u * (u - w) - (b - a) * (w - 1.0));
                q = (u - 1.0) * (w - 1.0) * (s - 1.0);
            }
            q = p > 0.0 ? -q : q;
            p = fabs(p);
            bool accepted = 2.0 * p < lesser(3.0 * half * q - fabs(close * q), fabs(last * q));
            last = accepted ? step : half;
            step = accepted ? p / q : half;
        } else {
            step = last = half;
        }
        a = b;
        fa = fb;
        b += fabs(step) > close ? step : (half > 0.0 ? close : -close);
        fb = guard_at(guard, what, b);
    }
    return b;
}

static void note(Event *first, int kind, int index, double time) {
    if (first->kind == NO_EVENT || time < first->time) {
        first->kind = kind;
        first->index = index;
        first->time = time;
    }
}

/* How far the arms may move within the step: coordinates change by no more than the dense output
 * can make of the stages, |dE| <= |E| exp(|ds|) (|dtheta| + |ds|). */
static void furthest_arms(const Simulation *sim, double *turn) {
    const System *system = &sim->system;
    furthest(system->n, state_size(sim), sim->arc_k, sim->now->arc_h, turn);
    for (int k = 0; k < system->stretch_count; k++) {
        int j = system->stretches[k], a = arm_of(system, j);
        double longest = modulus(sim->equations.e_at_start[a]) * exponential(turn[j]);
        turn[a] = longest * (turn[a] + turn[j]);
    }
}

/* Whether an open stop may be reached within the step: gaps change by no more than the arms do, and
 * than what is seen by a wall that turns. */
static bool within_reach(Simulation *sim) {
    const Scalars *now = sim->now;
    const Complex *e = sim->equations.e_at_start;
    int n = sim->system.n;
    double near = TOUCHING * sim->system.length, *turn = sim->error;
    Rows gaps = gap_rows(&sim->system);
    furthest_arms(sim, turn);
    for (int s = 0; s < sim->system.s; s++) {
        if (sim->holds[s] == 0.0) {
            const Complex *row = gaps.B + s * n;
            double reach = near + fabs(sim->walls[s].rate) * now->arc_h;
            for (int j = 0; j < n; j++) {
                reach += (fabs(row[j].re) + fabs(row[j].im)) * turn[j];
            }
            if (gaps.on[s] != FIXED) {
                reach += modulus(seen_value(&gaps, s, e)) * turn[gaps.on[s]];
            }
            if (!(gap(&sim->equations, s, now->arc_start, e) > reach)) {
                return true;
            }
        }
    }
    return false;
}

/* The positions, rates and directions at the looks. */
static void look(Simulation *sim) {
    const Scalars *now = sim->now;
    int n = sim->system.n, ny = state_size(sim);
    for (int k = 0; k <= WATCHED; k++) {
        double *y = sim->look_y + k * 2 * n;
        zeros(2 * n, y);
        for (int i = 0; i < STAGES; i++) {
            add_scaled(2 * n, sim->grid[k][i], sim->arc_k + i * ny, y);
        }
        for (int j = 0; j < 2 * n; j++) {
            y[j] = sim->arc_y[j] + now->arc_h * y[j];
        }
        directions(&sim->system, y, sim->look_e + k * n);
    }
}

static double look_time(const Simulation *sim, int k) {
    return sim->now->arc_start + sim->now->arc_h * (k / 8.0);
}

/* Move the time of a closing gap to where the projected state closes it; not to where it still
 * opens: there nothing would happen, again and again. */
static bool polished(Simulation *sim, int i, double opens, double *time, Problem *problem) {
    int n = sim->system.n;
    double t = *time;
    for (int step = 0; step < 3; step++) {
        arc_at(sim, t, sim->y1);
        if (!project(&sim->equations, t, sim->y1, &sim->scratch, problem)) {
            return false;
        }
        directions(&sim->system, sim->y1, sim->e);
        double distance = gap(&sim->equations, i, t, sim->e);
        double speed = gap_rate(&sim->equations, i, sim->e, sim->y1 + n);
        double change = -distance / speed;
        if (speed >= 0.0 || fabs(distance) <= TIME_RESOLUTION * fabs(speed) ||
            fabs(change) > 1e-2 * sim->now->arc_h) {
            break; /* grazing: the dense output has the better root */
        }
        t = greater(opens, t + change);
    }
    *time = t;
    return true;
}

/* Whether and when a gap closes: z > 0 -> z <= 0 at a closing rate.  A gap that is opening at the
 * start of a part of the step closes only after its apex: so the impact that has just been
 * resolved, whose gap is zero up to a rounding of either sign, is not found again.  A dip below
 * zero between two looks shows in the rates. */
static bool closing(Simulation *sim, int i, Event *first, Problem *problem) {
    int n = sim->system.n;
    double near = TOUCHING * sim->system.length, *gaps = sim->look_gap, *rates = sim->look_rate;
    double bound = still(sim), closed = CONSTRAINT_RTOL * sim->system.length;
    Guard guard = {sim, IMPACT, i, 1.0, 0.0}, opening = {sim, IMPACT, i, -1.0, 0.0};
    Guard deeper = {sim, IMPACT, i, 1.0, near};
    for (int k = 0; k <= WATCHED; k++) {
        const Complex *e = sim->look_e + k * n;
        gaps[k] = gap(&sim->equations, i, look_time(sim, k), e);
        rates[k] = gap_rate(&sim->equations, i, e, sim->look_y + k * 2 * n + n);
    }
    for (int k = 0; k < WATCHED; k++) {
        double a = look_time(sim, k), b = look_time(sim, k + 1);
        bool dips = rates[k] < 0.0 && 0.0 < rates[k + 1];
        if (gaps[k + 1] > 0.0 && !dips) {
            continue;
        }
        if (fabs(rates[k]) <= bound && fabs(gaps[k]) <= closed) {
            if (gaps[k + 1] < -near) { /* it has let go too early: a little later it is pressed */
                note(first, IMPACT, i, falls(&deeper, GAP_FALLS, a, b));
                return true;
            }
            continue;
        }
        if (rates[k] > 0.0) {
            if (rates[k + 1] >= 0.0) {
                continue; /* still opening from zero */
            }
            a = falls(&guard, GAP_RATE_FALLS, a, b);
            if (guard_at(&guard, GAP_FALLS, a) <= 0.0) {
                note(first, IMPACT, i, a); /* an arc below the resolution of a position */
                return true;
            }
        } else if (gaps[k] <= 0.0) {
            if (gaps[k + 1] < -near) {
                note(first, IMPACT, i, a);
                return true;
            }
            continue; /* touches without a rate of its own */
        }
        if (dips) {
            b = falls(&opening, GAP_RATE_FALLS, a, b);
            if (guard_at(&guard, GAP_FALLS, b) > 0.0) {
                continue;
            }
        }
        double t = falls(&guard, GAP_FALLS, a, b);
        if (!polished(sim, i, a, &t, problem)) {
            return false;
        }
        note(first, IMPACT, i, t);
        return true;
    }
    return true;
}

/* When a sliding velocity changes its sign.  What begins to slide is at rest up to a rounding of
 * either sign: it goes the other way if it does so at the end. */
static void turning_back(Simulation *sim, int kind, int i, int sign, Event *first) {
    int n = sim->system.n;
    double z[WATCHED + 1];
    Rows rows = rows_of(sim, kind);
    Guard guard = {sim, kind, i, sign, 0.0};
    for (int k = 0; k <= WATCHED; k++) {
        z[k] = sign * row_rate(&rows, i, sim->look_e + k * n, sim->look_y + k * 2 * n + n);
    }
    bool begins = z[0] <= still(sim);
    for (int k = begins; k < WATCHED; k++) {
        if (z[k] > 0.0 && z[k + 1] <= 0.0) {
            note(first, kind, i,
                 falls(&guard, SPEED_FALLS, look_time(sim, k), look_time(sim, k + 1)));
            return;
        }
    }
    if (begins && z[WATCHED] < 0.0) {
        note(first, kind, i, look_time(sim, 1));
    }
}

/* Whether the stages of the step come near to releasing or slipping. */
static bool may_yield(const Simulation *sim) {
    const Equations *q = &sim->equations;
    if (q->stuck_count > 0 || q->rubbing_count > 0) {
        return true;
    }
    for (int k = 0; k < q->held_count; k++) {
        if (q->least[k] <= DOUBT * q->most[k]) {
            return true;
        }
    }
    return false;
}

/* When one margin is used up, from its values at the start, the middle and the end. */
static void yields_at(Simulation *sim, int kind, int k, int index, Event *first) {
    Guard guard = {sim, kind, k, 1.0, 0.0};
    const Scalars *now = sim->now;
    double times[3] = {now->arc_start, now->arc_start + now->arc_h / 2,
                       now->arc_start + now->arc_h};
    double before = guard_at(&guard, MARGIN_FALLS, times[0]);
    for (int part = 0; part < 2; part++) {
        double after = guard_at(&guard, MARGIN_FALLS, times[part + 1]);
        if (after <= 0.0) {
            double a = times[part], b = times[part + 1];
            note(first, kind, index, before > 0.0 ? falls(&guard, MARGIN_FALLS, a, b) : a);
            return;
        }
        before = after;
    }
}

/* When a hold releases or a stick slips: a margin that is used up. */
static void yielding(Simulation *sim, Event *first) {
    const Equations *q = &sim->equations;
    for (int k = 0; k < q->held_count; k++) {
        yields_at(sim, RELEASE, k, q->held[k], first);
    }
    for (int k = 0; k < q->stuck_count; k++) {
        yields_at(sim, SLIP_SLIDE, k, q->stuck[k], first);
    }
    for (int k = 0; k < q->rubbing_count; k++) {
        yields_at(sim, SLIP_RUB, k, q->rubbing[k], first);
    }
}

/* The first event within a step, of kind NO_EVENT if there is none. */
static bool first_event(Simulation *sim, Event *event, Problem *problem) {
    const Equations *q = &sim->equations;
    Event none = {NO_EVENT, 0, 0.0};
    *event = none;
    bool open = q->held_count < sim->system.s && within_reach(sim);
    if (open || q->rub_slide_count > 0 || q->sliding_count > 0) {
        look(sim);
        for (int i = 0; open && i < sim->system.s; i++) {
            if (sim->holds[i] == 0.0 && !closing(sim, i, event, problem)) {
                return false;
            }
        }
        for (int k = 0; k < q->rub_slide_count; k++) {
            int i = q->rub_slides[k];
            turning_back(sim, RUB, i, q->discrete.rubs[i], event);
        }
        for (int k = 0; k < q->sliding_count; k++) {
            int i = q->sliding[k];
            turning_back(sim, SLIDE, i, q->discrete.slides[i], event);
        }
    }
    if (may_yield(sim)) {
        yielding(sim, event);
    }
    return true;
}

/* --- events ----------------------------------------------------------------------------------- */

/* Stop a chatter that does not end. */
PRBM bool count_event(Simulation *sim, double time, int kind, Problem *problem) {
    Scalars *now = sim->now;
    if (time - now->window_since > CHATTER_SPAN * period(sim)) {
        now->window_since = time;
        now->window_count = 0.0;
    }
    now->window_count += 1.0;
    if (now->window_count > CHATTER) {
        return fail(problem,
                    "more than %d events (%s the last) within %.3g s at t = %.9g s: the contact "
                    "chatters; raise rest_speed or damping.beta, lower the restitution, or give "
                    "the body room between its walls",
                    CHATTER, EVENT_NAMES[kind], time - now->window_since, time);
    }
    return true;
}

/* Apply an event at the front and choose the discrete state that follows. */
static bool happen(Simulation *sim, const Event *event, Problem *problem) {
    if (!count_event(sim, event->time, event->kind, problem)) {
        return false;
    }
    switch (event->kind) {
    case IMPACT:
        return impact(sim, event->index, problem);
    case RELEASE:
        without_hold(sim, event->index);
        return settle(sim, NULL, 0, NULL, problem);
    default:
        return settle(sim, NULL, 0, event, problem);
    }
}

/* e, the mass matrix and the Jacobian of the loops at a position. */
typedef struct {
    Complex *e;
    double *M, *loops;
} Here;

static Here mass_and_loops(Simulation *sim, const double *q) {
    const System *system = &sim->system;
    Here here = {take_complex(&sim->scratch, system->n, 1),
                 take_matrix(&sim->scratch, system->n, system->n),
                 take_matrix(&sim->scratch, system->r, system->n)};
    double *C = take_matrix(&sim->scratch, system->n, system->n);
    directions(system, q, here.e);
    inertia(system->n, system->H, system->J, here.e, here.M, C);
    Rows loops = plain_rows(system, system->r, system->loops, system->loops_c);
    jacobian(&loops, here.e, here.loops);
    return here;
}

/* The inverse mass along a row while others are held. */
static bool mobility(Simulation *sim, const double *M, int r, const double *held,
                     const double *row, double *result, Problem *problem) {
    size_t mark = sim->scratch.used;
    int n = sim->system.n;
    double *X = take(&sim->scratch, (size_t)n);
    bool right = response(n, r, 1, M, held, row, X, &sim->scratch, problem);
    *result = right ? dot(n, row, X) : 0.0;
    sim->scratch.used = mark;
    return right;
}

/* Whether each of the rows keeps a mobility of its own beside those before it. */
static bool independent_rows(Simulation *sim, int count, const double *rows, const Here *here,
                             bool *result, Problem *problem) {
    size_t mark = sim->scratch.used;
    int n = sim->system.n, r = sim->system.r;
    double *held = take_matrix(&sim->scratch, r + count, n);
    bool right = true;
    *result = true;
    copy(r * n, here->loops, held);
    copy(count * n, rows, held + r * n);
    for (int k = 1; right && *result && k < count; k++) {
        double left, own;
        right = mobility(sim, here->M, r + k, held, rows + k * n, &left, problem) &&
                mobility(sim, here->M, r, here->loops, rows + k * n, &own, problem);
        *result = right && left > ALIGNED * own;
    }
    sim->scratch.used = mark;
    return right;
}

/* The sign of a sliding velocity, IDLE if it is none but rounding. */
static int sign_of_speed(const Simulation *sim, double speed) {
    if (fabs(speed) <= still(sim)) {
        return IDLE;
    }
    return speed > 0.0 ? 1 : -1;
}

/* The equations in which these stops hold, and what slides rubs, in sim->trial. */
static void equations_holding(Simulation *sim, int count, const int *stops, const double *q,
                              const double *v) {
    const System *system = &sim->system;
    Rows walls = slide_rows(system), rubs = rub_rows(system);
    directions(system, q, sim->e);
    for (int i = 0; i < system->s; i++) {
        bool holds = false;
        for (int k = 0; k < count; k++) {
            holds = holds || stops[k] == i;
        }
        double speed = row_rate(&walls, i, sim->e, v);
        sim->other.holds[i] = holds;
        sim->other.slides[i] = holds ? sign_of_speed(sim, speed) : IDLE;
    }
    for (int i = 0; i < system->f; i++) {
        double speed = row_rate(&rubs, i, sim->e, v);
        sim->other.rubs[i] = sign_of_speed(sim, speed);
    }
    try_equations(sim, &sim->other);
}

/* How the stops that do not hold move when these do, if all of these are pressed. */
typedef struct {
    int count, stops[MOST_HOLDING];
    double opens;
} Holding;

static bool try_holding(Simulation *sim, int count, const int *every, const Holding *tried,
                        const double *q, const double *v, const Here *here, const double *G,
                        const double *bend, bool *pressed, double *opens, Problem *problem) {
    size_t mark = sim->scratch.used;
    int n = sim->system.n, s = sim->system.s;
    double *rows = take_matrix(&sim->scratch, tried->count, n);
    double *a = take(&sim->scratch, (size_t)n);
    double *lam = take(&sim->scratch, (size_t)(sim->system.r + 2 * s + sim->system.f));
    bool apart;
    for (int k = 0; k < tried->count; k++) {
        copy(n, G + tried->stops[k] * n, rows + k * n);
    }
    *pressed = false;
    *opens = HUGE_VAL;
    bool right = independent_rows(sim, tried->count, rows, here, &apart, problem);
    if (right && apart) {
        equations_holding(sim, tried->count, tried->stops, q, v);
        right = accelerations(&sim->trial, q, v, a, lam, problem);
        *pressed = right;
        for (int k = 0; right && k < sim->trial.held_count; k++) {
            *pressed = *pressed && lam[sim->trial.first_hold + k] > 0.0;
        }
        for (int k = 0; right && k < count; k++) {
            int i = every[k];
            if (!sim->other.holds[i]) {
                *opens = lesser(*opens, dot(n, G + i * n, a) - bend[i]);
            }
        }
        *opens = tried->count == count ? 0.0 : *opens;
    }
    sim->scratch.used = mark;
    return right;
}

/* Which of the stops at rest hold: pressed together, while the others open.  What slides rubs
 * meanwhile.  Of stops that can move only together, one holds: the one that keeps the others from
 * closing. */
static bool find_holding(Simulation *sim, int count, const int *candidates, const double *q,
                         const double *v, Holding *holding, Problem *problem) {
    size_t mark = sim->scratch.used;
    const System *system = &sim->system;
    int n = system->n, every[MOST_HOLDING], members[MOST_HOLDING];
    double omega = omega_scale(sim), closes = -STILL * omega * omega * system->length;
    Holding pressed_only = {0, {0}, 0.0};
    bool right = true, found = false;
    int many = 0;
    for (int i = 0; i < system->s && many < MOST_HOLDING; i++) {
        for (int k = 0; k < count; k++) {
            if (candidates[k] == i) {
                every[many++] = i;
                break;
            }
        }
    }
    Here here = mass_and_loops(sim, q);
    double *G = take_matrix(&sim->scratch, system->s, n);
    double *bend = take(&sim->scratch, (size_t)system->s);
    Rows gaps = gap_rows(system);
    jacobian(&gaps, here.e, G);
    for (int i = 0; i < system->s; i++) {
        bend[i] = row_convective(&gaps, i, here.e, v);
    }
    holding->count = 0;
    for (int size = many; right && !found && size > 0; size--) {
        Holding best = {0, {0}, -HUGE_VAL}, tried;
        for (int k = 0; k < size; k++) {
            members[k] = k;
        }
        do {
            bool pressed;
            tried.count = size;
            for (int k = 0; k < size; k++) {
                tried.stops[k] = every[members[k]];
            }
            right = try_holding(sim, many, every, &tried, q, v, &here, G, bend, &pressed,
                                &tried.opens, problem);
            if (right && pressed && (best.count == 0 || tried.opens > best.opens)) {
                best = tried;
            }
        } while (right && next_set(many, size, members));
        if (right && best.count > 0) {
            found = best.opens >= closes;
            if (found) {
                *holding = best;
            } else if (pressed_only.count == 0) {
                pressed_only = best;
            }
        }
    }
    if (!found) {
        *holding = pressed_only;
    }
    sim->scratch.used = mark;
    return right;
}

/* --- friction --------------------------------------------------------------------------------- */

static void with_slide(Simulation *sim, int kind, int i, int state) {
    read_discrete(sim);
    memcpy(sim->other.holds, sim->discrete.holds, (size_t)sim->system.s * sizeof(int));
    memcpy(sim->other.slides, sim->discrete.slides, (size_t)sim->system.s * sizeof(int));
    memcpy(sim->other.rubs, sim->discrete.rubs, (size_t)sim->system.f * sizeof(int));
    (kind == RUB ? sim->other.rubs : sim->other.slides)[i] = state;
}

static void set_slide(Simulation *sim, int kind, int i, int state) {
    with_slide(sim, kind, i, state);
    set_discrete(sim, &sim->other);
}

/* Friction and its limit of what sticks in sim->trial. */
static void stick_force(const Simulation *sim, int kind, int i, const double *lam,
                        const Complex *e, double *friction, double *limit) {
    const Equations *q = &sim->trial;
    if (kind == RUB) {
        *friction = lam[q->first_rub + place_in(q->rubbing, i)];
        *limit = rub_limit(q, i, e);
    } else {
        *friction = lam[q->first_stick + place_in(q->stuck, i)];
        *limit = q->stop_friction[i] * lam[q->first_hold + held_at(q, i)];
    }
}

/* Whether something at rest has a mobility of its own beside what holds and sticks. */
static bool has_mobility(Simulation *sim, int kind, int i, const Here *here, const double *row,
                         bool *result, Problem *problem) {
    size_t mark = sim->scratch.used;
    int n = sim->system.n;
    double left = 0.0, own = 0.0;
    with_slide(sim, kind, i, IDLE);
    try_equations(sim, &sim->other);
    double *held = take_matrix(&sim->scratch, sim->trial.r, n);
    jacobian(&sim->trial.active, here->e, held);
    bool right = mobility(sim, here->M, sim->trial.r, held, row, &left, problem) &&
                 mobility(sim, here->M, sim->system.r, here->loops, row, &own, problem);
    *result = left > DEPENDENT * own;
    sim->scratch.used = mark;
    return right;
}

/* Whether something that is at rest and may move sticks, or which way it slides. */
static bool state_at_rest(Simulation *sim, int kind, int i, const double *q, const double *v,
                          const Here *here, const double *row, bool yields, int *state,
                          Problem *problem) {
    int n = sim->system.n;
    size_t rows = (size_t)(sim->system.r + 2 * sim->system.s + sim->system.f);
    double *a = take(&sim->scratch, (size_t)n), *lam = take(&sim->scratch, rows);
    double friction, limit, bend;
    with_slide(sim, kind, i, STICKS);
    try_equations(sim, &sim->other);
    if (!accelerations(&sim->trial, q, v, a, lam, problem)) {
        return false;
    }
    stick_force(sim, kind, i, lam, here->e, &friction, &limit);
    *state = STICKS;
    if (fabs(friction) <= limit && !yields) {
        return true;
    }
    Rows rows_here = rows_of(sim, kind);
    bend = row_convective(&rows_here, i, here->e, v);
    int gives = friction > 0.0 ? -1 : 1;
    for (int attempt_sign = 0; attempt_sign < 2; attempt_sign++) {
        int sign = attempt_sign == 0 ? gives : -gives;
        with_slide(sim, kind, i, sign);
        try_equations(sim, &sim->other);
        if (!accelerations(&sim->trial, q, v, a, lam, problem)) {
            return false;
        }
        if (sign * (dot(n, row, a) - bend) > 0.0) {
            *state = sign;
            return true;
        }
    }
    *state = yields ? IDLE : STICKS;
    return true;
}

/* Whether something slides (its sign), sticks, or is idle.  What moves, faster than slow, slides.
 * What is at rest is
 * idle where the loops and the stops that hold leave it no mobility of its own: the stop carries
 * everything and the friction nothing.  Else it sticks as far as Coulomb's law allows, and beyond
 * slides in the direction in which sliding accelerates it. */
static bool slide_state(Simulation *sim, int kind, int i, const double *q, const double *v,
                        bool yields, double slow, int *state, Problem *problem) {
    size_t mark = sim->scratch.used;
    int n = sim->system.n;
    bool mobile = false, right = true;
    Here here = mass_and_loops(sim, q);
    double *row = take(&sim->scratch, (size_t)n);
    Rows rows = rows_of(sim, kind);
    row_jacobian(&rows, i, here.e, row);
    double speed = dot(n, row, v);
    *state = fabs(speed) > slow ? sign_of_speed(sim, speed) : IDLE;
    if (*state == IDLE) {
        right = has_mobility(sim, kind, i, &here, row, &mobile, problem);
        if (right && mobile) {
            right = state_at_rest(sim, kind, i, q, v, &here, row, yields, state, problem);
        }
    }
    sim->scratch.used = mark;
    return right;
}

/* What has just happened to what slides, if anything: it has used up its friction and cannot stick,
 * or it has stopped sliding and has no more than a slow speed left. */
typedef struct {
    int kind, index;
    bool yields;
    double slow;
} Turn;

/* What has friction, and what it does. */
typedef struct {
    int kind, index, state;
} Rubbing;

static bool turns(const Turn *turn, const Rubbing *one) {
    return turn->kind == one->kind && turn->index == one->index;
}

static bool settle_one(Simulation *sim, const Rubbing *one, const Turn *turn, Problem *problem) {
    int state, n = sim->system.n;
    bool this_one = turns(turn, one), yields = this_one && turn->yields;
    double slow = this_one ? turn->slow : 0.0;
    if (!slide_state(sim, one->kind, one->index, sim->front, sim->front + n, yields, slow, &state,
                     problem)) {
        return false;
    }
    set_slide(sim, one->kind, one->index, state);
    return true;
}

static bool same_discrete(const Simulation *sim, const double *before) {
    size_t s = (size_t)sim->system.s, f = (size_t)sim->system.f;
    return memcmp(before, sim->slides, s * sizeof(double)) == 0 &&
           memcmp(before + s, sim->rubs, f * sizeof(double)) == 0;
}

static void keep_friction(const Simulation *sim, double *slides_and_rubs) {
    copy(sim->system.s, sim->slides, slides_and_rubs);
    copy(sim->system.f, sim->rubs, slides_and_rubs + sim->system.s);
}

/* Whether something at rest has a mobility of its own beside what else holds and sticks now. */
static bool is_mobile(Simulation *sim, const Rubbing *one, bool *result, Problem *problem) {
    size_t mark = sim->scratch.used;
    Here here = mass_and_loops(sim, sim->front);
    double *row = take(&sim->scratch, (size_t)sim->system.n);
    Rows rows = rows_of(sim, one->kind);
    row_jacobian(&rows, one->index, here.e, row);
    bool right = has_mobility(sim, one->kind, one->index, &here, row, result, problem);
    sim->scratch.used = mark;
    return right;
}

/* Whether the forces and accelerations of the present discrete state are what it says. */
static bool agree(Simulation *sim, int count, const Rubbing *chosen, bool *result,
                  Problem *problem) {
    size_t mark = sim->scratch.used;
    int n = sim->system.n;
    const double *q = sim->front, *v = sim->front + n;
    *result = true;
    for (int k = 0; *result && k < count; k++) {
        if (chosen[k].state == STICKS && !is_mobile(sim, &chosen[k], result, problem)) {
            return false;
        }
    }
    if (!*result) {
        return true;
    }
    Here here = mass_and_loops(sim, q);
    size_t rows = (size_t)(sim->system.r + 2 * sim->system.s + sim->system.f);
    double *a = take(&sim->scratch, (size_t)n), *lam = take(&sim->scratch, rows);
    double *row = take(&sim->scratch, (size_t)n), friction, limit;
    read_discrete(sim);
    try_equations(sim, &sim->discrete);
    bool right = accelerations(&sim->trial, q, v, a, lam, problem);
    for (int k = 0; right && *result && k < sim->trial.held_count; k++) {
        *result = lam[sim->trial.first_hold + k] > 0.0;
    }
    for (int k = 0; right && *result && k < count; k++) {
        int i = chosen[k].index, state = chosen[k].state;
        if (state == STICKS) {
            stick_force(sim, chosen[k].kind, i, lam, here.e, &friction, &limit);
            *result = fabs(friction) <= limit;
        } else {
            Rows of = rows_of(sim, chosen[k].kind);
            row_jacobian(&of, i, here.e, row);
            *result = state * (dot(n, row, a) - row_convective(&of, i, here.e, v)) > 0.0;
        }
    }
    sim->scratch.used = mark;
    return right;
}

/* Those at rest that have a mobility beside what holds; all at rest are left idle. */
static bool free_at_rest(Simulation *sim, int count, const Rubbing *rubbing, const Turn *turn,
                         int *free_count, Rubbing *free_ones, Problem *problem) {
    size_t mark = sim->scratch.used;
    int n = sim->system.n, resting = 0;
    bool right = true, mobile = false;
    double *row = take(&sim->scratch, (size_t)n);
    Rubbing at_rest[2 * STOPS_MAX];
    directions(&sim->system, sim->front, sim->e);
    for (int k = 0; k < count; k++) {
        Rows rows = rows_of(sim, rubbing[k].kind);
        row_jacobian(&rows, rubbing[k].index, sim->e, row);
        double speed = dot(n, row, sim->front + n), slow = turns(turn, &rubbing[k]) ? turn->slow : 0.0;
        if (fabs(speed) <= slow || sign_of_speed(sim, speed) == IDLE) {
            at_rest[resting++] = rubbing[k];
        }
    }
    for (int k = 0; k < resting; k++) {
        set_slide(sim, at_rest[k].kind, at_rest[k].index, IDLE);
    }
    *free_count = 0;
    for (int k = 0; right && k < resting; k++) {
        right = is_mobile(sim, &at_rest[k], &mobile, problem);
        if (right && mobile) {
            free_ones[(*free_count)++] = at_rest[k];
        }
    }
    sim->scratch.used = mark;
    return right;
}

/* Choose together what those at rest do, who one by one find no end.  It is the first combination in
 * which what sticks needs no more than its friction, what slides begins to slide in its direction,
 * and what holds is pressed.  Without one, or with too many at rest, all stays as it is. */
static bool settle_together(Simulation *sim, int count, const Rubbing *rubbing, const Turn *turn,
                            Problem *problem) {
    static const int states[3] = {STICKS, SLIDES, SLIDES_BACK};
    double kept[2 * STOPS_MAX];
    Rubbing chosen[2 * STOPS_MAX];
    int many, combinations = 1;
    bool found = false;
    keep_friction(sim, kept);
    if (!free_at_rest(sim, count, rubbing, turn, &many, chosen, problem)) {
        return false;
    }
    for (int k = 0; k < many && many <= MOST_AT_REST; k++) {
        combinations *= 3;
    }
    for (int c = 0; many <= MOST_AT_REST && !found && c < combinations; c++) {
        bool may = true;
        for (int k = many - 1, rest = c; k >= 0; k--, rest /= 3) {
            chosen[k].state = states[rest % 3];
            set_slide(sim, chosen[k].kind, chosen[k].index, chosen[k].state);
            may = may && !(turn->yields && turns(turn, &chosen[k]) && chosen[k].state == STICKS);
        }
        if (may && !agree(sim, many, chosen, &found, problem)) {
            return false;
        }
    }
    if (!found) {
        copy(sim->system.s, kept, sim->slides);
        copy(sim->system.f, kept + sim->system.s, sim->rubs);
        read_discrete(sim);
        set_discrete(sim, &sim->discrete);
    }
    return true;
}

/* Choose what sticks and slides; what one does may change what another must do. */
static bool settle_friction(Simulation *sim, const Holding *holding, const Turn *turn,
                            Problem *problem) {
    int count = 0;
    double before[2 * STOPS_MAX];
    Rubbing rubbing[2 * STOPS_MAX];
    for (int k = 0; k < holding->count; k++) {
        if (sim->equations.stop_friction[holding->stops[k]] > 0.0) {
            Rubbing one = {SLIDE, holding->stops[k], IDLE};
            rubbing[count++] = one;
        }
    }
    for (int i = 0; i < sim->system.f; i++) {
        if (sim->equations.rub_law[3 * i] > 0.0) {
            Rubbing one = {RUB, i, IDLE};
            rubbing[count++] = one;
        }
    }
    for (int round = 0; round <= count; round++) {
        keep_friction(sim, before);
        for (int k = 0; k < count; k++) {
            if (!settle_one(sim, &rubbing[k], turn, problem)) {
                return false;
            }
        }
        if (same_discrete(sim, before)) {
            return true;
        }
    }
    return settle_together(sim, count, rubbing, turn, problem);
}

/* The spacing of the numbers around x. */
static double spacing(double x) {
    int exponent;
    (void)frexp(x, &exponent);
    return ldexp(1.0, exponent - 53);
}

/* The sliding speed that the resolution of time leaves when sliding stops. */
static bool speed_left(Simulation *sim, int kind, int i, double *result, Problem *problem) {
    size_t mark = sim->scratch.used;
    int n = sim->system.n;
    const double *q = sim->front, *v = sim->front + n;
    double *row = take(&sim->scratch, (size_t)n);
    Rows rows = rows_of(sim, kind);
    bool right = accelerations(&sim->equations, q, v, sim->a, sim->lam, problem);
    directions(&sim->system, q, sim->e);
    row_jacobian(&rows, i, sim->e, row);
    double rate = dot(n, row, sim->a) - row_convective(&rows, i, sim->e, v);
    *result = fabs(rate) * (2 * TIME_RESOLUTION + 8 * spacing(sim->now->front_time));
    sim->scratch.used = mark;
    return right;
}

/* What an event, NULL for none, does to what slides. */
static bool turn_of(Simulation *sim, const Event *event, Turn *turn, Problem *problem) {
    Turn none = {NO_EVENT, 0, false, 0.0};
    *turn = none;
    if (!event) {
        return true;
    }
    turn->yields = event->kind == SLIP_SLIDE || event->kind == SLIP_RUB;
    turn->kind = event->kind == SLIDE || event->kind == SLIP_SLIDE ? SLIDE : RUB;
    turn->index = event->index;
    return turn->yields || speed_left(sim, turn->kind, turn->index, &turn->slow, problem);
}

/* Choose what holds, sticks and slides at the front, from its state alone.  resting: open stops
 * that touch without closing or opening; event: of what slides, which has just used up its friction
 * and cannot stick, or has stopped sliding or turns back; NULL for none. */
PRBM bool settle(Simulation *sim, const int *resting, int resting_count, const Event *event,
                 Problem *problem) {
    Turn turn;
    if (!turn_of(sim, event, &turn, problem)) {
        return false;
    }
    int n = sim->system.n, s = sim->system.s, candidates[2 * STOPS_MAX], count = 0;
    double near = TOUCHING * sim->system.length + RELEASE_GAP, bound = still(sim);
    const double *v = sim->front + n;
    for (int i = 0; i < s; i++) {
        if (sim->holds[i] != 0.0) {
            candidates[count++] = i;
        }
    }
    directions(&sim->system, sim->front, sim->e);
    for (int k = 0; k < resting_count; k++) {
        int i = resting[k];
        if (sim->holds[i] == 0.0 && gap(&sim->equations, i, sim->now->front_time, sim->e) <= near &&
            gap_rate(&sim->equations, i, sim->e, v) <= bound) {
            candidates[count++] = i;
        }
    }
    Holding holding;
    if (!find_holding(sim, count, candidates, sim->front, v, &holding, problem)) {
        return false;
    }
    read_discrete(sim);
    for (int i = 0; i < s; i++) {
        sim->discrete.holds[i] = 0;
        sim->discrete.slides[i] = IDLE;
    }
    for (int i = 0; i < sim->system.f; i++) {
        sim->discrete.rubs[i] = IDLE;
    }
    for (int k = 0; k < holding.count; k++) {
        sim->discrete.holds[holding.stops[k]] = 1;
    }
    set_discrete(sim, &sim->discrete);
    if (!settle_friction(sim, &holding, &turn, problem)) {
        return false;
    }
    return holding.count == 0 ||
           project(&sim->equations, sim->now->front_time, sim->front, &sim->scratch, problem);
}

/* --- impacts ---------------------------------------------------------------------------------- */

/* An impact that is being resolved: the stops struck and held, velocities after, impulses. */
typedef struct {
    int struck_count, held_count, struck[STOPS_MAX], held[STOPS_MAX];
    double restitution[STOPS_MAX];
    double *after;                          /* (n,) */
    double normal[STOPS_MAX], tangential[STOPS_MAX];      /* by stop */
    bool with_normal[STOPS_MAX];                   /* whether the stop took part */
} Hits;

/* The a-th of the stops that take part: those that are struck, then those that hold. */
static int partner(const Hits *hits, int a) {
    return a < hits->struck_count ? hits->struck[a] : hits->held[a - hits->struck_count];
}

/* The inverse mass in contact space, W = rows X (k, k), of rows (k, n) and their response X. */
static void contact_mobility(int k, int n, const double *rows, const double *X, double *W) {
    for (int a = 0; a < k; a++) {
        for (int b = 0; b < k; b++) {
            W[a * k + b] = 0.0;
            for (int j = 0; j < n; j++) {
                W[a * k + b] += rows[a * n + j] * X[j * k + b];
            }
        }
    }
}

/* after = v + X P */
static void add_impulses(int k, int n, const double *v, const double *X, const double *P,
                         double *after) {
    copy(n, v, after);
    for (int j = 0; j < n; j++) {
        for (int a = 0; a < k; a++) {
            after[j] += X[j * k + a] * P[a];
        }
    }
}

static bool hits_without_friction(Simulation *sim, const Here *here, const double *v,
                                  const double *u, Hits *hits, Problem *problem) {
    const System *system = &sim->system;
    int n = system->n, k = hits->struck_count + hits->held_count;
    double *G = take_matrix(&sim->scratch, k, n), *X = take_matrix(&sim->scratch, n, k);
    double *W = take_matrix(&sim->scratch, k, k), *rates = take(&sim->scratch, (size_t)k);
    double *eps = take(&sim->scratch, (size_t)k), *P = take(&sim->scratch, (size_t)k);
    Rows gaps = gap_rows(system);
    for (int a = 0; a < k; a++) {
        bool struck = a < hits->struck_count;
        int i = partner(hits, a);
        row_jacobian(&gaps, i, here->e, G + a * n);
        rates[a] = lesser(u[i], 0.0);
        eps[a] = struck ? hits->restitution[a] : 0.0;
    }
    if (!response(n, system->r, k, here->M, here->loops, G, X, &sim->scratch, problem)) {
        return false;
    }
    contact_mobility(k, n, G, X, W);
    for (int a = 0; a < k; a++) {
        W[a * k + a] += sim->equations.inputs.mobilities[partner(hits, a)];
    }
    newton(k, W, rates, eps, P, &sim->scratch);
    add_impulses(k, n, v, X, P, hits->after);
    for (int a = 0; a < k; a++) {
        int i = partner(hits, a);
        hits->normal[i] = P[a];
        hits->with_normal[i] = true;
    }
    return true;
}

/* What the loops and the kept stops put in, M (v+ - v-) - [G; T]^T P = rows^T reaction. */
static void reactions_of(Simulation *sim, const Here *here, const double *v, const double *after,
                         int k, const double *GT, const double *P, int r, const double *rows,
                         double *reaction) {
    size_t mark = sim->scratch.used;
    int n = sim->system.n;
    double *left = take(&sim->scratch, (size_t)n);
    double *columns = take_matrix(&sim->scratch, n, r);
    for (int j = 0; j < n; j++) {
        left[j] = 0.0;
        for (int i = 0; i < n; i++) {
            left[j] += here->M[j * n + i] * (after[i] - v[i]);
        }
        for (int a = 0; a < k; a++) {
            left[j] -= GT[a * n + j] * P[a];
        }
        for (int a = 0; a < r; a++) {
            columns[j * r + a] = rows[a * n + j];
        }
    }
    if (r > 0) {
        least_squares(n, r, columns, left, 1e-12, reaction, &sim->scratch);
    }
    sim->scratch.used = mark;
}

/* One round with friction: kept stops are constraints; *pulling tells whether one of them pulls,
 * which is then let go. */
static bool hits_with_friction(Simulation *sim, const Here *here, const double *v,
                               const double *u, const double *mu, Hits *hits, int *kept_count,
                               int *kept, bool *pulling, Problem *problem) {
    const System *system = &sim->system;
    int n = system->n, k = hits->struck_count, r = system->r + *kept_count;
    double *rows = take_matrix(&sim->scratch, r, n), *GT = take_matrix(&sim->scratch, 2 * k, n);
    double *X = take_matrix(&sim->scratch, n, 2 * k);
    double *W = take_matrix(&sim->scratch, 2 * k, 2 * k);
    double *rates = take(&sim->scratch, 2 * (size_t)k), *P = take(&sim->scratch, 2 * (size_t)k);
    Rows gaps = gap_rows(system), walls = slide_rows(system);
    copy(system->r * n, here->loops, rows);
    for (int a = 0; a < *kept_count; a++) {
        row_jacobian(&gaps, kept[a], here->e, rows + (system->r + a) * n);
    }
    for (int a = 0; a < k; a++) {
        int i = hits->struck[a];
        row_jacobian(&gaps, i, here->e, GT + a * n);
        row_jacobian(&walls, i, here->e, GT + (k + a) * n);
        rates[a] = u[i];
        rates[k + a] = dot(n, GT + (k + a) * n, v);
    }
    if (!response(n, r, 2 * k, here->M, rows, GT, X, &sim->scratch, problem)) {
        return false;
    }
    contact_mobility(2 * k, n, GT, X, W);
    for (int a = 0; a < k; a++) {
        W[a * 2 * k + a] += sim->equations.inputs.mobilities[hits->struck[a]];
    }
    if (k == 1) {
        stronge(W, rates, mu[0], hits->restitution[0], &P[0], &P[1]);
    } else if (!several(k, W, rates, mu, hits->restitution, P, &sim->scratch, problem)) {
        return false;
    }
    double *reaction = take(&sim->scratch, (size_t)r);
    add_impulses(2 * k, n, v, X, P, hits->after);
    reactions_of(sim, here, v, hits->after, 2 * k, GT, P, r, rows, reaction);
    int staying = 0;
    for (int a = 0; a < *kept_count; a++) {
        if (!(reaction[system->r + a] < 0.0)) {
            reaction[system->r + staying] = reaction[system->r + a];
            kept[staying++] = kept[a];
        }
    }
    *pulling = staying < *kept_count;
    *kept_count = staying;
    for (int a = 0; !*pulling && a < k; a++) {
        hits->normal[hits->struck[a]] = P[a];
        hits->tangential[hits->struck[a]] = P[k + a];
        hits->with_normal[hits->struck[a]] = true;
    }
    for (int a = 0; !*pulling && a < staying; a++) {
        hits->normal[kept[a]] = reaction[system->r + a];
        hits->with_normal[kept[a]] = true;
    }
    return true;
}

/* The velocities after an impact, the normal and the tangential impulses by stop.  Stops that hold
 * take part: without friction as partners of the complementarity problem, with friction as
 * constraints that are let go if they would pull.  Their own friction, and that of friction points,
 * is finite and has no impulse. */
static bool impulse(Simulation *sim, const double *q, const double *v, Hits *hits,
                    Problem *problem) {
    size_t mark = sim->scratch.used;
    int s = sim->system.s, kept_count = hits->held_count, kept[STOPS_MAX];
    double mu[STOPS_MAX], u[STOPS_MAX];
    bool rough = false, pulling = true, right = true;
    Here here = mass_and_loops(sim, q);
    for (int i = 0; i < s; i++) {
        u[i] = gap_rate(&sim->equations, i, here.e, v);
        hits->normal[i] = hits->tangential[i] = 0.0;
        hits->with_normal[i] = false;
    }
    for (int a = 0; a < hits->struck_count; a++) {
        mu[a] = stop_field(sim, sim->mechanism->stops[hits->struck[a]].friction);
        rough = rough || mu[a] != 0.0;
    }
    if (!rough) {
        right = hits_without_friction(sim, &here, v, u, hits, problem);
    } else {
        memcpy(kept, hits->held, (size_t)hits->held_count * sizeof(int));
        while (right && pulling) {
            size_t here_mark = sim->scratch.used;
            right = hits_with_friction(sim, &here, v, u, mu, hits, &kept_count, kept, &pulling,
                                       problem);
            sim->scratch.used = here_mark;
        }
    }
    sim->scratch.used = mark;
    return right;
}

/* Whether a stop that is struck slowly comes to rest: if, after an impact without restitution, it
 * is pressed, and it closes below rest_speed or comes from a bounce shorter than SHORTEST_FLIGHT or
 * lower than LOWEST_BOUNCE, which would gain by closing late what it loses by the hit.  A speed that
 * is none but rounding is neither counted nor returned. */
static bool captured(Simulation *sim, int i, const Hits *hits, const double *q, const double *v,
                     double speed, bool *result, Problem *problem) {
    size_t mark = sim->scratch.used;
    int n = sim->system.n, candidates[STOPS_MAX];
    *result = speed <= still(sim);
    if (*result) {
        return true;
    }
    Hits soft;
    soft.after = take(&sim->scratch, (size_t)n);
    soft.struck_count = 1;
    soft.struck[0] = i;
    soft.restitution[0] = 0.0;
    soft.held_count = hits->held_count;
    memcpy(soft.held, hits->held, sizeof soft.held);
    Holding holding;
    candidates[0] = i;
    memcpy(candidates + 1, hits->held, (size_t)hits->held_count * sizeof(int));
    bool right = impulse(sim, q, v, &soft, problem) &&
                 find_holding(sim, 1 + hits->held_count, candidates, q, soft.after, &holding,
                              problem);
    bool holds = false;
    for (int k = 0; right && k < holding.count; k++) {
        holds = holds || holding.stops[k] == i;
    }
    if (right && holds) {
        *result = speed < stop_field(sim, sim->mechanism->stops[i].rest_speed);
        if (!*result) {
            double *lam = take(&sim->scratch, (size_t)(sim->system.r + 2 * sim->system.s +
                                                       sim->system.f));
            double *a = take(&sim->scratch, (size_t)n), *G = take(&sim->scratch, (size_t)n), free;
            equations_holding(sim, holding.count, holding.stops, q, soft.after);
            right = accelerations(&sim->trial, q, soft.after, a, lam, problem);
            Here here = mass_and_loops(sim, q);
            Rows gaps = gap_rows(&sim->system);
            row_jacobian(&gaps, i, here.e, G);
            right = right &&
                    mobility(sim, here.M, sim->system.r, here.loops, G, &free, problem);
            double pressing =
                right ? lam[sim->trial.first_hold + held_at(&sim->trial, i)] * free : 0.0;
            double lowest = sim->now->exchange * LOWEST_BOUNCE * sim->system.length;
            *result = right && (2.0 * speed < pressing * SHORTEST_FLIGHT * period(sim) ||
                                speed * speed < 2.0 * pressing * lowest);
        }
    }
    sim->scratch.used = mark;
    return right;
}

static void report_impact(const Simulation *sim, int i) {
    const Latched *last = &sim->latched[i];
    Impact told = {sim->mechanism->stops[i].name, last->time,       last->approach_speed,
                   last->rebound_speed,           last->impulse,    last->energy_lost,
                   (int)last->count};
    if (sim->hear) {
        sim->hear(sim->listener, &told);
    }
}

/* Give a wall the velocity that an impulse leaves it with, until the next restart. */
static void push_wall(Simulation *sim, int i, double P) {
    double change = sim->equations.inputs.mobilities[i] * P, t = sim->now->front_time;
    if (change != 0.0) {
        Wall wall = {wall_at(&sim->walls[i], t), sim->walls[i].rate + change, t};
        sim->walls[i] = wall;
    }
}

/* Put an impact into the state, the energies and the latched outputs.  At each stop -P (u- + u+)/2
 * is lost, and as much along the wall; the wall does -P (w- + w+)/2, where an impulse changes the
 * velocity w of a wall by its mobility times P. */
static bool book(Simulation *sim, const Hits *hits, const bool *counted, const double *q,
                 const double *v, Problem *problem) {
    size_t mark = sim->scratch.used;
    const System *system = &sim->system;
    Rows walls = slide_rows(system);
    int n = system->n, s = system->s;
    bool any = false, right = true;
    double lost[STOPS_MAX], before[STOPS_MAX], after[STOPS_MAX], all_lost = 0.0, work = 0.0, modal = 0.0;
    directions(&sim->system, q, sim->e);
    for (int i = 0; i < s; i++) {
        double wall = sim->walls[i].rate;
        before[i] = gap_rate(&sim->equations, i, sim->e, v);
        if (hits->with_normal[i]) {
            push_wall(sim, i, hits->normal[i]);
            sim->latched[i].impulse_sum += hits->normal[i];
        }
        after[i] = gap_rate(&sim->equations, i, sim->e, hits->after);
        double slid = row_rate(&walls, i, sim->e, v) + row_rate(&walls, i, sim->e, hits->after);
        lost[i] = -hits->normal[i] * (before[i] + after[i]) / 2 - hits->tangential[i] * slid / 2;
        all_lost += hits->with_normal[i] ? lost[i] : 0.0;
        work -= hits->with_normal[i] ? hits->normal[i] * (wall + sim->walls[i].rate) / 2 : 0.0;
        any = any || counted[i];
    }
    if (any) {
        double *phi = take(&sim->scratch, (size_t)n), *M = take_matrix(&sim->scratch, n, n);
        right = fundamental_at(system, q, phi, M, &sim->scratch, problem);
        modal = right ? simulated_restitution(n, phi, M, v, hits->after) : 0.0;
    }
    for (int i = 0; right && i < s; i++) {
        if (counted[i]) {
            Latched *latched = &sim->latched[i];
            latched->count = lesser(latched->count + 1.0, MOST_IMPACTS);
            latched->time = sim->now->front_time;
            latched->approach_speed = -before[i];
            latched->rebound_speed = after[i];
            latched->impulse = hits->normal[i];
            latched->energy_lost = lost[i];
            latched->modal_restitution = modal;
            report_impact(sim, i);
        }
    }
    copy(n, hits->after, sim->front + n);
    sim->front[2 * n] += all_lost;
    sim->front[2 * n + 1] += work;
    sim->scratch.used = mark;
    return right;
}

/* Resolve the impact of a stop and of all that touch with it. */
PRBM bool impact(Simulation *sim, int hit, Problem *problem) {
    size_t mark = sim->scratch.used;
    int n = sim->system.n, s = sim->system.s, resting[STOPS_MAX], resting_count = 0;
    double near = TOUCHING * sim->system.length, bound = still(sim), rates[STOPS_MAX];
    bool counted[STOPS_MAX];
    double *q = take(&sim->scratch, (size_t)n), *v = take(&sim->scratch, (size_t)n);
    Hits hits;
    hits.after = take(&sim->scratch, (size_t)n);
    hits.struck_count = hits.held_count = 0;
    copy(n, sim->front, q);
    copy(n, sim->front + n, v);
    directions(&sim->system, q, sim->e);
    for (int i = 0; i < s; i++) {
        double distance = gap(&sim->equations, i, sim->now->front_time, sim->e);
        rates[i] = gap_rate(&sim->equations, i, sim->e, v);
        counted[i] = false;
        if (sim->holds[i] != 0.0) {
            hits.held[hits.held_count++] = i;
        } else if (rates[i] < 0.0 && (i == hit || distance <= near)) {
            hits.struck[hits.struck_count++] = i;
        }
    }
    if (hits.struck_count == 0) {
        sim->scratch.used = mark;
        return settle(sim, &hit, fabs(rates[hit]) <= bound, NULL, problem);
    }
    bool right = true;
    for (int k = 0; right && k < hits.struck_count; k++) {
        int i = hits.struck[k];
        bool soft = false;
        right = captured(sim, i, &hits, q, v, -rates[i], &soft, problem);
        counted[i] = !soft;
        hits.restitution[k] =
            soft ? 0.0 : stop_field(sim, sim->mechanism->stops[i].restitution);
    }
    right = right && impulse(sim, q, v, &hits, problem) &&
            book(sim, &hits, counted, q, v, problem);
    if (right) {
        directions(&sim->system, q, sim->e);
        for (int k = 0; k < hits.struck_count + hits.held_count; k++) {
            int i = partner(&hits, k);
            if (gap_rate(&sim->equations, i, sim->e, hits.after) <= bound) {
                resting[resting_count++] = i;
            }
        }
        zeros(s, sim->holds);
        set_inputs(sim);
    }
    sim->scratch.used = mark;
    return right && settle(sim, resting, resting_count, NULL, problem);
}

static void free_stuck(Simulation *sim) {
    read_discrete(sim);
    for (int i = 0; i < sim->system.s; i++) {
        sim->discrete.slides[i] = sim->discrete.slides[i] == STICKS ? IDLE : sim->discrete.slides[i];
    }
    for (int i = 0; i < sim->system.f; i++) {
        sim->discrete.rubs[i] = sim->discrete.rubs[i] == STICKS ? IDLE : sim->discrete.rubs[i];
    }
    set_discrete(sim, &sim->discrete);
}

/* Change the velocities by what the impulses have grown by since they were received: each component P
 * at the point of a force changes the rate u of the point along it, and its work is P (u- + u+)/2.
 * The loops take part, stops follow: see unsettled.  Friction is finite and bears no impulse: what
 * stuck is free, to slide or to stick again. */
PRBM bool receive_impulses(Simulation *sim, Problem *problem) {
    size_t mark = sim->scratch.used;
    int n = sim->system.n, count = LOADS * sim->mechanism->force_count;
    const double *given = impulses(sim);
    double grown[LOADS], *v = sim->front + n;
    if (!impulses_changed(sim)) {
        return true;
    }
    double *rows = take_matrix(&sim->scratch, LOADS, n), *X = take_matrix(&sim->scratch, n, LOADS);
    double *after = take(&sim->scratch, (size_t)n);
    Here here = mass_and_loops(sim, sim->front);
    bool right = true;
    for (int i = 0; right && i < sim->mechanism->force_count; i++) {
        load_rows(&sim->system, &sim->system.pushed[i], here.e, rows, &sim->scratch);
        right = response(n, sim->system.r, LOADS, here.M, here.loops, rows, X, &sim->scratch,
                         problem);
        for (int k = 0; k < LOADS; k++) {
            grown[k] = given[LOADS * i + k] - sim->received[LOADS * i + k];
        }
        if (right) {
            add_impulses(LOADS, n, v, X, grown, after);
            for (int k = 0; k < LOADS; k++) {
                sim->front[2 * n + 1] +=
                    grown[k] * (dot(n, rows + k * n, v) + dot(n, rows + k * n, after)) / 2;
            }
            copy(n, after, v);
        }
    }
    copy(count, given, sim->received);
    sim->scratch.used = mark;
    free_stuck(sim);
    return right;
}

/* --- going on --------------------------------------------------------------------------------- */

static bool due(const Simulation *sim, double time) {
    const Scalars *now = sim->now;
    return now->has_arc != 0.0 && to_int(now->event_kind) != NO_EVENT && now->event_time <= time;
}

static bool let_happen(Simulation *sim, Problem *problem) {
    Scalars *now = sim->now;
    Event event = {to_int(now->event_kind), to_int(now->event_index), now->event_time};
    now->has_arc = 0.0;
    now->event_kind = NO_EVENT;
    return happen(sim, &event, problem);
}

/* Whether this continues a communication step that was left in its middle, to the same end but for
 * the rounding of an importer that adds what is left of the step to the time. */
static bool continues(const Simulation *sim, double time) {
    double rounding = ROUNDED * (fabs(time) + fabs(sim->now->time));
    return sim->now->underway != 0.0 && fabs(sim->now->underway_until - time) <= rounding &&
           !values_changed(sim) && !given_changed(sim);
}

/* Stop before the end of a communication step, if it is one; the walls go on as planned until
 * then. */
static void leave_underway(Scalars *now, double time, double end) {
    now->time = time;
    now->underway = time < end;
    now->underway_until = end;
}

/* Whether a time is one to go to: not before the present one, and not after the end of days. */
static bool check_time(const Simulation *sim, double time, Problem *problem) {
    double now = sim->now->time;
    if (!finite_number(time) || time < now) {
        return fail(problem, "cannot go from t = %.12g s to t = %.12g s: time only runs on", now,
                    time);
    }
    if (time - now > MOST_STEPS * largest_step(sim)) {
        return fail(problem,
                    "cannot go from t = %.12g s to t = %.12g s at once: that is more than %g "
                    "steps; times are in seconds",
                    now, time, MOST_STEPS);
    }
    return true;
}

static bool advance(Simulation *sim, double time, bool each, bool events, bool *event,
                    Problem *problem) {
    Scalars *now = sim->now;
    *event = false;
    if (!continues(sim, time)) {
        Wall planned[STOPS_MAX];
        bool walls = plan_walls(sim, time, planned), rest = within_step(sim, time);
        double begins = now->time, due = due_walls(sim);
        if ((walls || values_changed(sim) || given_changed(sim)) &&
            !restart(sim, planned, problem)) {
            return false;
        }
        if (!rest) {
            now->due = due;
            now->planned = begins;
        }
        for (int i = 0; i < sim->system.s; i++) {
            sim->swift[i] = sim->swift[i] != 0.0 || given_velocity(sim, i) != 0.0;
        }
        now->adrift = rest && time < now->underway_until;
    }
    now->underway = 0.0;
    for (bool stepped = false;; stepped = true) {
        if (due(sim, time)) {
            if (events) {
                *event = true;
                leave_underway(now, now->event_time, time);
                return true;
            }
            if (!let_happen(sim, problem)) {
                return false;
            }
        }
        if (now->front_time >= time) {
            break;
        }
        if (each && stepped) {
            leave_underway(now, now->front_time, time);
            return true;
        }
        if (!take_step(sim, problem)) {
            return false;
        }
    }
    now->time = time;
    return true;
}

PRBM bool simulation_advance_some(Simulation *simulation, double time, bool each, bool *event,
                                  Problem *problem) {
    Simulation *sim = simulation;
    *event = false;
    if (!check_time(sim, time, problem)) {
        return false;
    }
    if (time == sim->now->time) {
        *event = due(sim, time);
        return true;
    }
    keep_backup(sim);
    sim->fresh = NOTHING;
    return attempt(sim, advance(sim, time, each, true, event, problem), problem);
}

PRBM bool simulation_advance(Simulation *simulation, double time, Problem *problem) {
    Simulation *sim = simulation;
    bool event;
    if (!check_time(sim, time, problem)) {
        return false;
    }
    if (time == sim->now->time) {
        return true;
    }
    keep_backup(sim);
    sim->fresh = NOTHING;
    return attempt(sim, advance(sim, time, false, false, &event, problem), problem);
}

/* Inputs that were set where an event waits act in it: so a wall hits with the velocity that it has
 * there, not with its mean over the communication step.  Where that is a matter of less than the
 * stop calls rest, the wall goes on with its mean, and what it carries rests on.  A wall that holds
 * something is given another velocity after the event, as at the start of any step.  acted: the
 * velocities that act. */
static void take_inputs(Simulation *sim, double *acted) {
    directions(&sim->system, sim->front, sim->e);
    for (int i = 0; i < sim->system.s; i++) {
        double speed = -gap_rate(&sim->equations, i, sim->e, sim->front + sim->system.n);
        double distance = gap(&sim->equations, i, sim->now->time, sim->e);
        bool hits = distance <= TOUCHING * sim->system.length &&
                    speed >= stop_field(sim, sim->mechanism->stops[i].rest_speed);
        if (sim->holds[i] == 0.0 && (hits || given_another(sim, i, acted[i]))) {
            double t = sim->now->time;
            Wall wall = {wall_at(&sim->walls[i], t), given_velocity(sim, i), t};
            if (acted[i] != wall.rate) {
                sim->walls[i] = wall;
            }
            acted[i] = wall.rate;
        }
    }
    copy(sim->mechanism->input_count, sim->given, sim->acting_given);
    set_inputs(sim);
}

PRBM bool simulation_happen(Simulation *simulation, Problem *problem) {
    Simulation *sim = simulation;
    Scalars *now = sim->now;
    bool event = due(sim, now->time), thrown = impulses_changed(sim);
    bool taken = event && given_changed(sim);
    if (!event && !thrown) {
        return true;
    }
    keep_backup(sim);
    sim->fresh = NOTHING;
    double acted[STOPS_MAX];
    for (int i = 0; i < sim->system.s; i++) {
        acted[i] = *acting_velocity(sim, i);
    }
    if (taken) {
        take_inputs(sim, acted);
    }
    bool right = !event || let_happen(sim, problem);
    if (right && thrown) {
        Wall walls[STOPS_MAX];
        memcpy(walls, sim->walls, (size_t)sim->system.s * sizeof *walls);
        right = restart(sim, walls, problem);
    }
    if (taken || thrown) {
        for (int i = 0; i < sim->system.s; i++) {
            *acting_velocity(sim, i) = acted[i];
        }
        now->adrift = now->adrift != 0.0 || now->underway != 0.0;
        now->underway = 0.0;
    }
    return attempt(sim, right, problem);
}

/* --- outputs ---------------------------------------------------------------------------------- */

static void output_places(Simulation *sim) {
    const System *system = &sim->system;
    const Slots *slots = &sim->mechanism->slots;
    int n = system->n;
    Rows gaps = gap_rows(system);
    double *out = sim->outputs, *v = sim->y + n;
    for (int i = 0; i < system->b; i++) {
        const BodyFrame *frame = &system->bodies[i];
        double *values = out + slots->bodies + PER_BODY * i;
        Complex at, speed;
        motion(system, frame, sim->e, v, &at, &speed);
        values[0] = at.re;
        values[1] = at.im;
        values[2] = sim->y[frame->j];
        values[3] = speed.re;
        values[4] = speed.im;
        values[5] = v[frame->j];
    }
    for (int i = 0; i < sim->mechanism->probe_count; i++) {
        double *values = out + slots->probes + PER_PROBE * i;
        Complex at, speed;
        motion(system, &system->probes[i], sim->e, v, &at, &speed);
        values[0] = at.re;
        values[1] = at.im;
        values[2] = speed.re;
        values[3] = speed.im;
    }
    for (int i = 0; i < system->s; i++) {
        double *values = out + slots->stops + PER_STOP * i;
        values[0] = gap(&sim->equations, i, sim->now->time, sim->e);
        values[1] = gap_rate(&sim->equations, i, sim->e, v);
        values[3] = -(row_value(&gaps, i, sim->e) + gaps.c[i]) -
                    stop_field(sim, sim->mechanism->stops[i].position);
        values[4] = -row_rate(&gaps, i, sim->e, v);
        double *last = out + slots->latched + PER_LATCHED * i;
        last[0] = sim->holds[i];
        memcpy(last + 1, &sim->latched[i], sizeof(Latched));
    }
    for (int k = 0; k < sim->mechanism->link_count; k++) {
        int j = sim->mechanism->links[k];
        out[slots->links + PER_LINK * k] = sim->y[j];
        out[slots->links + PER_LINK * k + 1] = v[j];
    }
    for (int k = 0; k < system->stretch_count; k++) {
        int j = system->stretches[k];
        out[slots->stretches + PER_STRETCH * k] = sim->y[j];
        out[slots->stretches + PER_STRETCH * k + 1] = v[j];
    }
    out[slots->energies + 3] = sim->y[2 * n];
    out[slots->energies + 4] = sim->y[2 * n + 1];
    out[slots->frequency] = sim->now->frequency;
    copy(slots->derivatives - slots->calculated, system->calculated, out + slots->calculated);
    out[slots->time] = sim->now->time;
}

static bool output_motion(Simulation *sim, Problem *problem) {
    const Slots *slots = &sim->mechanism->slots;
    double *out = sim->outputs, *v = sim->y + sim->system.n;
    if (!solve_motion(&sim->equations, sim->y, v, sim->now->exchange == 0.0)) {
        return fail(problem, "%s", SINGULAR);
    }
    copy(sim->system.n, sim->equations.x, sim->a);
    for (int i = 0; i < sim->system.s; i++) {
        out[slots->stops + PER_STOP * i + 2] = 0.0;
    }
    for (int k = 0; k < sim->equations.held_count; k++) {
        out[slots->stops + PER_STOP * sim->equations.held[k] + 2] =
            sim->equations.lam[sim->equations.first_hold + k];
    }
    out[slots->energies] = energy_here(&sim->equations, v);
    return true;
}

static void output_base(Simulation *sim) {
    double *out = sim->outputs + sim->mechanism->slots.base;
    Complex force;
    base_reaction(&sim->equations, sim->e, sim->y + sim->system.n, sim->a, &force, out + 2,
                  &sim->scratch);
    out[0] = force.re;
    out[1] = force.im;
}

static void output_energies(Simulation *sim) {
    const System *system = &sim->system;
    int n = system->n;
    double *out = sim->outputs + sim->mechanism->slots.energies, *deflection = sim->error;
    for (int j = 0; j < n; j++) {
        deflection[j] = sim->y[j] - system->q0[j];
    }
    out[1] = elastic_energy(n, system->K, deflection);
    out[2] = gravitational_energy(system, sim->e);
}

static bool output_mobilities(Simulation *sim, Problem *problem) {
    size_t mark = sim->scratch.used;
    double *out = sim->outputs + sim->mechanism->slots.stops;
    double *G = take(&sim->scratch, (size_t)sim->system.n);
    Here here = mass_and_loops(sim, sim->y);
    Rows gaps = gap_rows(&sim->system);
    bool right = true;
    for (int i = 0; right && i < sim->system.s; i++) {
        row_jacobian(&gaps, i, here.e, G);
        right = mobility(sim, here.M, sim->system.r, here.loops, G, out + PER_STOP * i + 5, problem);
    }
    sim->scratch.used = mark;
    return right;
}

/* y and e at the present time, and what follows from them alone. */
static bool output_state(Simulation *sim, Problem *problem) {
    int n = sim->system.n;
    if (sim->now->exchange != 0.0) {
        copy(state_size(sim), sim->front, sim->y);
        directions(&sim->system, sim->y, sim->e);
    } else if (state_at(sim, sim->y, problem)) {
        memcpy(sim->e, directions_near(&sim->equations, sim->y), (size_t)n * sizeof *sim->e);
    } else {
        return false;
    }
    output_places(sim);
    return true;
}

/* Bring groups of outputs up to date. */
PRBM bool update_outputs(Simulation *sim, int groups, Problem *problem) {
    if (sim->now->exchange != 0.0 && sim->stale) {
        if (!exchange_refresh(sim, problem)) {
            return false;
        }
        sim->fresh = NOTHING;
    }
    int missing = groups & ~sim->fresh;
    if (((missing & PLACES) && !output_state(sim, problem)) ||
        ((missing & MOTION) && !output_motion(sim, problem))) {
        return false;
    }
    if (missing & BASE) {
        output_base(sim);
    }
    if (missing & ENERGIES) {
        output_energies(sim);
    }
    if ((missing & MOBILITIES) && !output_mobilities(sim, problem)) {
        return false;
    }
    sim->fresh |= groups;
    return true;
}

/* The groups that a value is of or follows from. */
static int groups_of(const Simulation *sim, int slot) {
    const Slots *slots = &sim->mechanism->slots;
    bool of_stop = slot >= slots->stops && slot < slots->base;
    bool force = of_stop && (slot - slots->stops) % PER_STOP == 2;
    if (force || slot == slots->energies) {
        return PLACES | MOTION;
    }
    if (of_stop && (slot - slots->stops) % PER_STOP == 5) {
        return PLACES | MOBILITIES;
    }
    if (slot >= slots->base && slot < slots->energies) {
        return PLACES | MOTION | BASE;
    }
    bool potential = slot == slots->energies + 1 || slot == slots->energies + 2;
    return potential ? PLACES | ENERGIES : PLACES;
}

PRBM bool simulation_get(Simulation *simulation, int slot, double *x, Problem *problem) {
    Simulation *sim = simulation;
    const Slots *slots = &sim->mechanism->slots;
    if (slot < slots->inputs) {
        *x = sim->values[slot];
        return true;
    }
    if (slot < slots->bodies) {
        *x = sim->given[slot - slots->inputs];
        return true;
    }
    if (!simulation_started(sim)) {
        return fail(problem, "it is computed when the model is initialized, and not known before");
    }
    if (slot >= slots->derivatives && slot < slots->time) {
        return exchange_value(sim, slot, x, problem);
    }
    if (!update_outputs(sim, groups_of(sim, slot), problem)) {
        return false;
    }
    *x = sim->outputs[slot];
    return true;
}

/* --- saving and restoring --------------------------------------------------------------------- */

PRBM size_t simulation_state_count(const Simulation *simulation) {
    return simulation->state_count;
}

PRBM const double *simulation_state(const Simulation *simulation) {
    return simulation->state;
}

static bool whole_number(double x, double low, double high) {
    return x >= low && x <= high && x == floor(x);
}

/* What an importer's solver has set may be anything; all else is finite. */
static bool all_finite(const Simulation *sim) {
    const double *states = sim->states;
    for (const double *x = sim->state; x < sim->state + sim->state_count; x++) {
        bool foreign = x >= states && x < states + exchange_states(sim);
        if (!foreign && !finite_number(*x)) {
            return false;
        }
    }
    return true;
}

static bool sound_event(const Simulation *sim) {
    const Scalars *now = sim->now;
    int kind = to_int(now->event_kind);
    bool rubs = kind == SLIP_RUB || kind == RUB;
    int count = rubs ? sim->mechanism->friction_count : sim->mechanism->stop_count;
    return kind == NO_EVENT || now->event_index < count;
}

/* Whether the numbers that decide what is done, and where, are ones that the engine writes. */
static bool sound_state(const Simulation *sim) {
    const Scalars *now = sim->now;
    const Mechanism *m = sim->mechanism;
    bool sound = all_finite(sim) && whole_number(now->started, 0, 1) &&
                 whole_number(now->exchange, 0, 1) && whole_number(now->has_k1, 0, 1) &&
                 whole_number(now->has_arc, 0, 1) && whole_number(now->underway, 0, 1) &&
                 whole_number(now->adrift, 0, 1) &&
                 whole_number(now->event_kind, 0, (int)RUB) && now->h >= 0.0 &&
                 whole_number(now->event_index, 0, STOPS_MAX) && now->window_count >= 0.0 &&
                 now->window_count <= CHATTER && sound_event(sim);
    if (sound && now->started != 0.0) {
        sound = now->tolerance >= 1e-13 && now->tolerance <= 1e-2 && now->frequency >= 0.0 &&
                (now->has_arc == 0.0 || now->arc_h > 0.0) &&
                (now->exchange != 0.0 || now->front_time >= now->time);
    }
    for (int i = 0; sound && i < m->stop_count; i++) {
        sound = whole_number(sim->holds[i], 0, 1) && whole_number(sim->slides[i], -1, IDLE) &&
                whole_number(sim->latched[i].count, 0, MOST_IMPACTS);
    }
    for (int i = 0; sound && i < m->friction_count; i++) {
        sound = whole_number(sim->rubs[i], -1, IDLE);
    }
    return sound;
}

PRBM bool simulation_restore(Simulation *simulation, const double *state, Problem *problem) {
    Simulation *sim = simulation;
    keep_backup(sim);
    copy((int)sim->state_count, state, sim->state);
    Problem ignored;
    bool right = sound_state(sim) && check_values(sim->mechanism, sim->values, &ignored);
    if (right && simulation_started(sim)) {
        right = check_values(sim->mechanism, sim->acting_values, &ignored) &&
                assemble(&sim->system, sim->acting_values, &sim->scratch, &ignored);
        sim->assembled = right;
        if (right) {
            set_scales(sim);
            set_inputs(sim);
        }
    }
    sim->stale = true;
    sim->fresh = NOTHING;
    if (!right) {
        fail(problem, "the saved state is damaged: its numbers are not those of a motion");
    }
    return attempt(sim, right, problem);
}
