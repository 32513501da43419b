/* The mechanism's tables: read once, as anybody may have tampered with them. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "kernel.h"

enum {
    TABLES_VERSION = 2,
    CHECKED_FROM = 16,         /* bytes before what the checksum covers */
    MOST_COORDINATES = 512,    /* a mass matrix of 2 MB; no mechanism of this kind has as many */
    MOST_STOPS = 64,           /* and friction points */
    MOST_PLACES = 1024,        /* where forces act, that are watched */
    MOST_POINTS = 4096,        /* of the ground: every pair of them has a distance */
    MOST_PIVOTS = 256,         /* and links of a chain */
    ROOM = 8,                  /* bytes of memory for each byte of the tables, more than needed */
    ROOM_OF_COORDINATE = 32,   /* and for each coordinate */
};

typedef struct {
    const unsigned char *at;
    size_t left;
    const char *wrong; /* what is wrong with the tables, or NULL */
    Memory memory;
    size_t room;
} Reader;

/* --- numbers and texts ------------------------------------------------------------------------ */

static void *kept(Reader *reader, size_t count, size_t size) {
    size_t left = reader->room - reader->memory.used; /* place rounds up to less than 32 bytes */
    if (reader->wrong || left < 32 || count > (left - 32) / size) {
        reader->wrong = reader->wrong ? reader->wrong : "counts that its size does not bear";
        return NULL;
    }
    return place(&reader->memory, count, size);
}

static bool has(Reader *reader, size_t bytes) {
    if (!reader->wrong && reader->left < bytes) {
        reader->wrong = "an end where there should be more";
    }
    return !reader->wrong;
}

static uint32_t read_u32(Reader *reader) {
    uint32_t x = 0;
    if (has(reader, 4)) {
        for (int i = 3; i >= 0; i--) {
            x = x << 8 | reader->at[i];
        }
        reader->at += 4;
        reader->left -= 4;
    }
    return x;
}

static double read_f64(Reader *reader) {
    uint64_t low = read_u32(reader), bits = low | (uint64_t)read_u32(reader) << 32;
    double x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

static double read_bound(Reader *reader) {
    double x = read_f64(reader);
    if (x != x) {
        reader->wrong = "a bound that is not a number";
    }
    return x;
}

static double read_finite(Reader *reader) {
    double x = read_f64(reader);
    if (!finite_number(x)) {
        reader->wrong = "a number that is not finite";
    }
    return x;
}

static const char *read_text(Reader *reader) {
    size_t length = read_u32(reader);
    if (length >= reader->left || !has(reader, length + 1) || reader->at[length] != 0 ||
        memchr(reader->at, 0, length)) {
        reader->wrong = reader->wrong ? reader->wrong : "a text that does not end";
        return "";
    }
    char *text = kept(reader, length + 1, 1);
    if (text) {
        memcpy(text, reader->at, length + 1);
        reader->at += length + 1;
        reader->left -= length + 1;
    }
    return text ? text : "";
}

/* An index below a count. */
static int read_index(Reader *reader, int from, int count) {
    uint32_t x = read_u32(reader);
    if (x < (uint32_t)from || x >= (uint32_t)count) {
        reader->wrong = reader->wrong ? reader->wrong : "a reference that leads nowhere";
        return from;
    }
    return (int)x;
}

static bool read_flag(Reader *reader) {
    return read_index(reader, 0, 2) == 1;
}

/* How many records of at least so many bytes follow. */
static int read_count(Reader *reader, size_t bytes) {
    uint32_t count = read_u32(reader);
    if (count > reader->left / bytes) {
        reader->wrong = reader->wrong ? reader->wrong : "counts that its size does not bear";
        return 0;
    }
    return (int)count;
}

/* --- parts ------------------------------------------------------------------------------------ */

static Expression read_expression(Reader *reader, Mechanism *m) {
    Expression result = {read_finite(reader), 0, NULL, NULL};
    result.count = read_count(reader, 12);
    int *parameter = kept(reader, (size_t)result.count, sizeof *parameter);
    double *factor = kept(reader, (size_t)result.count, sizeof *factor);
    for (int i = 0; i < result.count && !reader->wrong; i++) {
        parameter[i] = read_index(reader, 0, m->parameter_count);
        factor[i] = read_finite(reader);
    }
    result.parameter = parameter;
    result.factor = factor;
    return result;
}

static Point read_point(Reader *reader, Mechanism *m) {
    Point result;
    result.x = read_expression(reader, m);
    result.y = read_expression(reader, m);
    return result;
}

static void read_parameters(Reader *reader, Mechanism *m) {
    Parameter *parameters = kept(reader, (size_t)m->parameter_count, sizeof *parameters);
    for (int i = 0; i < m->parameter_count && !reader->wrong; i++) {
        Parameter *p = &parameters[i];
        p->name = read_text(reader);
        p->unit = read_text(reader);
        p->start = read_finite(reader);
        p->minimum = read_bound(reader);
        p->maximum = read_bound(reader);
        p->tunable = read_flag(reader);
    }
    m->parameters = parameters;
    m->gravity[0] = read_index(reader, 0, m->parameter_count);
    m->gravity[1] = read_index(reader, 0, m->parameter_count);
    m->tolerance = read_index(reader, 0, m->parameter_count);
    m->damping_zeta = read_index(reader, 0, m->parameter_count);
    m->damping_beta = read_index(reader, 0, m->parameter_count);
}

static void read_inputs(Reader *reader, Mechanism *m) {
    const char **names = kept(reader, (size_t)m->input_count, sizeof *names);
    double *starts = kept(reader, (size_t)m->input_count, sizeof *starts);
    for (int i = 0; i < m->input_count && !reader->wrong; i++) {
        names[i] = read_text(reader);
        starts[i] = read_finite(reader);
    }
    m->input_names = names;
    m->input_starts = starts;
}

static void read_bodies(Reader *reader, Mechanism *m) {
    Body *bodies = kept(reader, (size_t)m->body_count, sizeof *bodies);
    for (int i = 0; i < m->body_count && !reader->wrong; i++) {
        bodies[i].name = read_text(reader);
        bodies[i].mass = read_expression(reader, m);
        bodies[i].inertia = read_expression(reader, m);
        bodies[i].centre = read_point(reader, m);
    }
    m->bodies = bodies;
}

static const Expression *read_expressions(Reader *reader, Mechanism *m, int count) {
    Expression *result = kept(reader, (size_t)count, sizeof *result);
    for (int i = 0; i < count && !reader->wrong; i++) {
        result[i] = read_expression(reader, m);
    }
    return result;
}

static void read_types(Reader *reader, Mechanism *m) {
    FlexureType *types = kept(reader, (size_t)m->type_count, sizeof *types);
    for (int i = 0; i < m->type_count && !reader->wrong; i++) {
        FlexureType *t = &types[i];
        t->name = read_text(reader);
        t->lumped = read_flag(reader);
        t->rate_with_gamma = read_flag(reader);
        t->axial = read_flag(reader);
        t->pivots = read_index(reader, 0, MOST_PIVOTS + 1);
        t->links = read_index(reader, 0, MOST_PIVOTS + 1);
        if ((t->pivots == 0) == (t->links == 0)) {
            reader->wrong = reader->wrong ? reader->wrong : "a flexure of no kind";
        }
        t->thickness = read_expression(reader, m);
        t->width = read_expression(reader, m);
        t->youngs_modulus = read_expression(reader, m);
        t->density = read_expression(reader, m);
        t->gamma = read_expressions(reader, m, t->pivots);
        t->K_theta = read_expressions(reader, m, t->pivots);
    }
    m->types = types;
}

static Connection read_connection(Reader *reader, Mechanism *m) {
    Connection result;
    result.start = read_index(reader, 0, m->body_count + 1);
    result.start_point = read_point(reader, m);
    result.end = read_index(reader, 0, m->body_count + 1);
    result.end_point = read_point(reader, m);
    if (result.start == result.end) {
        reader->wrong = reader->wrong ? reader->wrong : "a part that joins nothing";
    }
    return result;
}

static void read_flexures(Reader *reader, Mechanism *m) {
    Flexure *flexures = kept(reader, (size_t)m->flexure_count, sizeof *flexures);
    for (int i = 0; i < m->flexure_count && !reader->wrong; i++) {
        Flexure *f = &flexures[i];
        f->name = read_text(reader);
        f->type = read_index(reader, 0, m->type_count);
        f->between = read_connection(reader, m);
        f->start_end = read_index(reader, CLAMP, FREE + 1);
        f->end_end = read_index(reader, CLAMP, FREE + 1);
        bool freed = f->start_end == FREE || f->end_end == FREE;
        if (freed && f->start_end != CLAMP && f->end_end != CLAMP) {
            reader->wrong = reader->wrong ? reader->wrong : "a flexure that nothing clamps";
        }
    }
    m->flexures = flexures;
}

static void read_joints(Reader *reader, Mechanism *m) {
    Joint *joints = kept(reader, (size_t)m->joint_count, sizeof *joints);
    for (int i = 0; i < m->joint_count && !reader->wrong; i++) {
        joints[i].name = read_text(reader);
        joints[i].between = read_connection(reader, m);
    }
    m->joints = joints;
}

static void read_stops(Reader *reader, Mechanism *m) {
    Stop *stops = kept(reader, (size_t)m->stop_count, sizeof *stops);
    for (int i = 0; i < m->stop_count && !reader->wrong; i++) {
        Stop *s = &stops[i];
        s->name = read_text(reader);
        s->body = read_index(reader, 1, m->body_count + 1);
        s->on = read_index(reader, 0, m->body_count + 1);
        if (s->on == s->body) {
            reader->wrong = reader->wrong ? reader->wrong : "a stop that is fixed to what it stops";
        }
        s->point = read_point(reader, m);
        s->direction = read_finite(reader);
        s->position = read_expression(reader, m);
        s->offset = read_expression(reader, m);
        s->restitution = read_expression(reader, m);
        s->friction = read_expression(reader, m);
        s->rest_speed = read_expression(reader, m);
    }
    m->stops = stops;
}

static void read_frictions(Reader *reader, Mechanism *m) {
    Friction *frictions = kept(reader, (size_t)m->friction_count, sizeof *frictions);
    for (int i = 0; i < m->friction_count && !reader->wrong; i++) {
        Friction *f = &frictions[i];
        f->name = read_text(reader);
        f->body = read_index(reader, 1, m->body_count + 1);
        f->point = read_point(reader, m);
        f->direction = read_finite(reader);
        f->coefficient = read_expression(reader, m);
        f->normal_force = read_expression(reader, m);
        f->normal_stiffness = read_expression(reader, m);
    }
    m->frictions = frictions;
}

static void read_forces(Reader *reader, Mechanism *m) {
    Force *forces = kept(reader, (size_t)m->force_count, sizeof *forces);
    for (int i = 0; i < m->force_count && !reader->wrong; i++) {
        forces[i].name = read_text(reader);
        forces[i].body = read_index(reader, 1, m->body_count + 1);
        forces[i].point = read_point(reader, m);
    }
    m->forces = forces;
}

static void read_probes(Reader *reader, Mechanism *m) {
    Probe *probes = kept(reader, (size_t)m->probe_count, sizeof *probes);
    for (int i = 0; i < m->probe_count && !reader->wrong; i++) {
        probes[i].name = read_text(reader);
        probes[i].body = read_index(reader, 0, m->body_count + 1);
        probes[i].point = read_point(reader, m);
    }
    m->probes = probes;
}

static void read_release(Reader *reader, Mechanism *m) {
    m->release.body = read_index(reader, 1, m->body_count + 1);
    m->release.direction = read_finite(reader);
    m->release.displacement = read_expression(reader, m);
    m->release.velocity = read_expression(reader, m);
}

static void read_ground(Reader *reader, Mechanism *m) {
    Point *ground = kept(reader, (size_t)m->ground_count, sizeof *ground);
    for (int i = 0; i < m->ground_count && !reader->wrong; i++) {
        ground[i] = read_point(reader, m);
    }
    m->ground = ground;
}

static void read_bounds(Reader *reader, Mechanism *m) {
    Bound *bounds = kept(reader, (size_t)m->bound_count, sizeof *bounds);
    for (int i = 0; i < m->bound_count && !reader->wrong; i++) {
        bounds[i].name = read_text(reader);
        bounds[i].unit = read_text(reader);
        bounds[i].expression = read_expression(reader, m);
        bounds[i].minimum = read_bound(reader);
        bounds[i].maximum = read_bound(reader);
    }
    m->bounds = bounds;
}

/* --- sizes and order -------------------------------------------------------------------------- */

static const FlexureType *kind_of(const Mechanism *m, const Flexure *flexure) {
    return &m->types[flexure->type];
}

static int link_count(const Mechanism *m, const Flexure *flexure) {
    return links_of(kind_of(m, flexure), flexure->start_end, flexure->end_end);
}

static void count_coordinates(Reader *reader, Mechanism *m) {
    long long links = 0, stretching = 0;
    for (int i = 0; i < m->flexure_count && !reader->wrong; i++) {
        int count = link_count(m, &m->flexures[i]);
        links += count;
        m->longest = count > m->longest ? count : m->longest;
        for (int k = 0; k < count; k++) {
            stretching += stretches(kind_of(m, &m->flexures[i]), k, count);
        }
    }
    long long parts = (long long)m->flexure_count + m->joint_count, b = m->body_count;
    long long n = links + stretching + b, r = 2 * (parts - b);
    if (!reader->wrong &&
        (n > MOST_COORDINATES || r >= n || m->stop_count > MOST_STOPS ||
         m->friction_count > MOST_STOPS || m->force_count > MOST_PLACES ||
         m->probe_count > MOST_PLACES || m->ground_count > MOST_POINTS)) {
        reader->wrong = "more parts than can be computed with, or loops that leave no motion";
    } else if (!reader->wrong && (b < 1 || r < 0)) {
        reader->wrong = "a body that nothing holds";
    }
    if (!reader->wrong) {
        m->link_count = (int)links;
        m->stretch_count = (int)stretching;
        m->coordinate_count = (int)n;
        m->loop_count = (int)r;
        m->spring_count = (int)(links + stretching + m->flexure_count);
        m->mass_count = (int)(2 * links + 4LL * m->flexure_count + b);
    }
}

/* Where the assembly is: what is held, which parts it has walked along, what it has added. */
typedef struct {
    bool *held, *walked;
    Coordinate *coordinates;
    int *links, *stretches;
    int added, link_count, stretch_count;
} Walk;

static void add_coordinate(Walk *walk, int link, int body, int arm) {
    Coordinate coordinate = {link, body, arm};
    walk->coordinates[walk->added++] = coordinate;
}

/* The angle of a link, and its stretch. */
static void add_link(Walk *walk, bool stretching) {
    int j = walk->added;
    add_coordinate(walk, walk->link_count, 0, j);
    walk->links[walk->link_count++] = j;
    if (stretching) {
        add_coordinate(walk, walk->link_count - 1, 0, j);
        walk->stretches[walk->stretch_count++] = j + 1;
    }
}

/* A flexure or, behind them all, a joint. */
static Step part(const Mechanism *m, int i) {
    Step step = {NULL, NULL, NULL, false, false, 0};
    if (i < m->flexure_count) {
        step.name = m->flexures[i].name;
        step.between = &m->flexures[i].between;
        step.flexure = &m->flexures[i];
    } else {
        step.name = m->joints[i - m->flexure_count].name;
        step.between = &m->joints[i - m->flexure_count].between;
    }
    return step;
}

/* Go along the first part that touches what is held and has not been walked; false if none does. */
static bool walk_on(const Mechanism *m, Walk *walk, Step *step) {
    for (int i = 0; i < m->flexure_count + m->joint_count; i++) {
        *step = part(m, i);
        const bool *held = walk->held;
        if (!walk->walked[i] && (held[step->between->start] || held[step->between->end])) {
            walk->walked[i] = true;
            step->backwards = !held[step->between->start];
            step->first = walk->added;
            return true;
        }
    }
    return false;
}

static void add_coordinates(const Mechanism *m, Walk *walk, Step *step) {
    int count = step->flexure ? link_count(m, step->flexure) : 0;
    for (int k = 0; k < count; k++) {
        int i = step->backwards ? count - 1 - k : k;
        add_link(walk, stretches(kind_of(m, step->flexure), i, count));
    }
    int far = step->backwards ? step->between->start : step->between->end;
    step->closes = walk->held[far];
    if (!step->closes) {
        walk->held[far] = true;
        add_coordinate(walk, -1, far, walk->added);
    }
}

/* The order of the assembly, and what each coordinate is. */
static void lay_out_coordinates(Reader *reader, Mechanism *m) {
    size_t parts = (size_t)m->flexure_count + (size_t)m->joint_count;
    size_t n = (size_t)m->coordinate_count, b = (size_t)m->body_count;
    Walk walk = {kept(reader, b + 1, sizeof(bool)), kept(reader, parts, sizeof(bool)),
                 kept(reader, n, sizeof(Coordinate)), kept(reader, n, sizeof(int)),
                 kept(reader, n, sizeof(int)), 0, 0, 0};
    Step *steps = kept(reader, parts, sizeof *steps);
    if (reader->wrong) {
        return;
    }
    memset(walk.held, 0, (b + 1) * sizeof *walk.held);
    memset(walk.walked, 0, parts * sizeof *walk.walked);
    walk.held[GROUND] = true;
    size_t reached = 1;
    for (size_t i = 0; i < parts && walk_on(m, &walk, &steps[i]); i++) {
        add_coordinates(m, &walk, &steps[i]);
        reached += !steps[i].closes;
    }
    if (reached != b + 1) {
        reader->wrong = "a body that nothing holds";
    }
    m->steps = steps;
    m->coordinates = walk.coordinates;
    m->links = walk.links;
    m->stretches = walk.stretches;
}

static void read_independents(Reader *reader, Mechanism *m) {
    int *independent = kept(reader, (size_t)m->independent_count, sizeof *independent);
    for (int i = 0; i < m->independent_count && !reader->wrong; i++) {
        independent[i] = read_index(reader, i ? independent[i - 1] + 1 : 0, m->coordinate_count);
    }
    if (!reader->wrong && m->independent_count != m->coordinate_count - m->loop_count) {
        reader->wrong = "another number of independent coordinates than the mechanism has";
    }
    m->independent = independent;
}

static void lay_out_inputs(Mechanism *m) {
    InputGroups *input = &m->input;
    input->walls = LOADS * m->force_count;
    input->impulses = input->walls + PER_WALL * m->stop_count;
    input->mobilities = input->impulses + LOADS * m->force_count;
    input->base = input->mobilities + m->stop_count;
}

static void lay_out_slots(Mechanism *m) {
    Slots *s = &m->slots;
    s->parameters = 0;
    s->inputs = m->parameter_count;
    s->bodies = s->inputs + m->input_count;
    s->stops = s->bodies + PER_BODY * m->body_count;
    s->base = s->stops + PER_STOP * m->stop_count;
    s->energies = s->base + PER_BASE;
    s->latched = s->energies + PER_ENERGY;
    s->links = s->latched + PER_LATCHED * m->stop_count;
    s->stretches = s->links + PER_LINK * m->link_count;
    s->probes = s->stretches + PER_STRETCH * m->stretch_count;
    s->frequency = s->probes + PER_PROBE * m->probe_count;
    s->calculated = s->frequency + 1;
    s->derivatives = s->calculated;
    for (int i = 0; i < m->type_count; i++) {
        s->derivatives += m->types[i].pivots > 1;
    }
    s->indicators = s->derivatives + m->independent_count + 2;
    s->time = s->indicators + STOP_INDICATORS * m->stop_count + m->friction_count;
    s->count = s->time + 1;
}

static void read_variables(Reader *reader, Mechanism *m) {
    Variable *variables = kept(reader, (size_t)m->variable_count, sizeof *variables);
    for (int i = 0; i < m->variable_count && !reader->wrong; i++) {
        Variable *v = &variables[i];
        v->reference = read_u32(reader);
        v->type = read_index(reader, 0, CLOCK + 1);
        v->slot = read_index(reader, 0, m->slots.count);
        v->name = read_text(reader);
        int latched = v->slot - m->slots.latched;
        bool of_stop = latched >= 0 && v->slot < m->slots.links;
        int what = of_stop ? latched % PER_LATCHED : -1;
        bool fits = v->type == REAL ? what != 0 && what != 1 : what == (v->type != BOOLEAN);
        if (!fits || (i > 0 && v->reference <= variables[i - 1].reference)) {
            reader->wrong = reader->wrong ? reader->wrong : "variables that contradict each other";
        }
    }
    m->variables = variables;
}

/* --- the whole -------------------------------------------------------------------------------- */

static uint32_t checksum(const unsigned char *bytes, size_t size) {
    uint32_t remainder = 0xFFFFFFFFu;
    for (size_t i = 0; i < size; i++) {
        remainder ^= bytes[i];
        for (int bit = 0; bit < 8; bit++) {
            remainder = remainder >> 1 ^ (0xEDB88320u & (0u - (remainder & 1u)));
        }
    }
    return ~remainder;
}

static void read_header(Reader *reader, const unsigned char *bytes, size_t size) {
    if (size < CHECKED_FROM || memcmp(bytes, "PRBM", 4) != 0) {
        reader->wrong = "no tables of a mechanism";
        return;
    }
    reader->at += 4;
    reader->left -= 4;
    if (read_u32(reader) != TABLES_VERSION) {
        reader->wrong = "tables of another version";
    } else if (read_u32(reader) != size) {
        reader->wrong = "another size than it should have";
    } else if (read_u32(reader) != checksum(bytes + CHECKED_FROM, size - CHECKED_FROM)) {
        reader->wrong = "a wrong checksum";
    }
}

static void read_mechanism(Reader *reader, Mechanism *m) {
    m->token = read_text(reader);
    m->name = read_text(reader);
    m->parameter_count = read_count(reader, 38);
    m->body_count = read_count(reader, 4);
    m->type_count = read_count(reader, 4);
    m->flexure_count = read_count(reader, 4);
    m->joint_count = read_count(reader, 4);
    m->stop_count = read_count(reader, 4);
    m->friction_count = read_count(reader, 4);
    m->force_count = read_count(reader, 4);
    m->probe_count = read_count(reader, 4);
    m->ground_count = read_count(reader, 4);
    m->bound_count = read_count(reader, 4);
    m->variable_count = read_count(reader, 16);
    m->independent_count = read_count(reader, 4);
    m->input_count = read_count(reader, 12);
    if (!reader->wrong && m->input_count != 2LL * LOADS * m->force_count +
                                                   (PER_WALL + 1LL) * m->stop_count + AXES) {
        reader->wrong = "another number of inputs than the mechanism has";
    }
    read_parameters(reader, m);
    read_inputs(reader, m);
    read_bodies(reader, m);
    read_types(reader, m);
    read_flexures(reader, m);
    read_joints(reader, m);
    read_stops(reader, m);
    read_frictions(reader, m);
    read_forces(reader, m);
    read_probes(reader, m);
    read_release(reader, m);
    read_ground(reader, m);
    read_bounds(reader, m);
    count_coordinates(reader, m);
    lay_out_coordinates(reader, m);
    read_independents(reader, m);
    if (reader->wrong) {
        return; /* with counts of parts that may not be there */
    }
    lay_out_inputs(m);
    lay_out_slots(m);
    read_variables(reader, m);
    if (!reader->wrong && reader->left > 0) {
        reader->wrong = "more than there should be";
    }
}

PRBM Mechanism *mechanism_open(const unsigned char *bytes, size_t size, Problem *problem) {
    Reader reader = {bytes, size, NULL, {NULL, 0}, 0};
    read_header(&reader, bytes, size);
    Mechanism *m = NULL;
    if (!reader.wrong) {
        size_t room = sizeof *m + ROOM * size + MOST_COORDINATES * ROOM_OF_COORDINATE;
        m = calloc(1, room);
        if (!m) {
            fail(problem, "there is not enough memory for the tables of the mechanism");
            return NULL;
        }
        reader.memory.base = (char *)m;
        reader.room = room;
        kept(&reader, 1, sizeof *m);
        read_mechanism(&reader, m);
    }
    if (reader.wrong) {
        free(m);
        fail(problem,
             "the tables of the mechanism (resources/mechanism.bin) are damaged: the file has %s; "
             "unpack the FMU again, or export it again",
             reader.wrong);
        return NULL;
    }
    return m;
}

PRBM void mechanism_close(Mechanism *mechanism) {
    free(mechanism);
}

/* Displacement and velocity of a wall, among some inputs (input_count,). */
static const double *wall_inputs(const Mechanism *mechanism, const double *inputs, int stop) {
    return inputs + mechanism->input.walls + PER_WALL * stop;
}

/* --- values ----------------------------------------------------------------------------------- */

PRBM double evaluate(Expression quantity, const double *values) {
    double result = 0.0;
    for (int i = 0; i < quantity.count; i++) {
        result += quantity.factor[i] * values[quantity.parameter[i]];
    }
    return quantity.constant + result;
}

static bool within(const char *name, const char *unit, double minimum, double maximum, double x,
                   Problem *problem) {
    const char *space = unit[0] ? " " : "";
    if (!finite_number(x)) {
        return fail(problem, "%s = %g%s%s must be a finite number", name, x, space, unit);
    }
    if (x < minimum) {
        return fail(problem, "%s = %.10g%s%s must be at least %g%s%s", name, x, space, unit,
                    minimum, space, unit);
    }
    if (x > maximum) {
        return fail(problem, "%s = %.10g%s%s must be at most %g%s%s", name, x, space, unit,
                    maximum, space, unit);
    }
    return true;
}

PRBM bool check_parameter(const Parameter *parameter, double x, Problem *problem) {
    return within(parameter->name, parameter->unit, parameter->minimum, parameter->maximum, x,
                  problem);
}

PRBM bool check_values(const Mechanism *mechanism, const double *values, Problem *problem) {
    for (int i = 0; i < mechanism->parameter_count; i++) {
        if (!check_parameter(&mechanism->parameters[i], values[i], problem)) {
            return false;
        }
    }
    for (int i = 0; i < mechanism->bound_count; i++) {
        const Bound *b = &mechanism->bounds[i];
        double x = evaluate(b->expression, values);
        if (!within(b->name, b->unit, b->minimum, b->maximum, x, problem)) {
            return false;
        }
    }
    return true;
}

PRBM const Variable *find_variable(const Mechanism *mechanism, uint32_t reference) {
    int low = 0, high = mechanism->variable_count;
    while (low < high) {
        int middle = low + (high - low) / 2;
        if (mechanism->variables[middle].reference < reference) {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    bool found = low < mechanism->variable_count &&
                 mechanism->variables[low].reference == reference;
    return found ? &mechanism->variables[low] : NULL;
}
