/* The mechanism's tables: read once, as anybody may have tampered with them. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "kernel.h"

enum {
    TABLES_VERSION = 1,
    CHECKED_FROM = 16,         /* bytes before what the checksum covers */
    MOST_COORDINATES = 512,    /* a mass matrix of 2 MB; no mechanism of this kind has as many */
    MOST_STOPS = 64,           /* and friction points */
    MOST_POINTS = 4096,        /* of the ground: every pair of them has a distance */
    MOST_PIVOTS = 256,
    ROOM = 8,                  /* bytes of memory for each byte of the tables, more than needed */
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
        t->pivots = read_index(reader, 1, MOST_PIVOTS + 1);
        t->thickness = read_expression(reader, m);
        t->width = read_expression(reader, m);
        t->youngs_modulus = read_expression(reader, m);
        t->density = read_expression(reader, m);
        t->gamma = read_expressions(reader, m, t->pivots);
        t->K_theta = read_expressions(reader, m, t->pivots);
    }
    m->types = types;
}

static void read_flexures(Reader *reader, Mechanism *m) {
    Flexure *flexures = kept(reader, (size_t)m->flexure_count, sizeof *flexures);
    for (int i = 0; i < m->flexure_count && !reader->wrong; i++) {
        Flexure *f = &flexures[i];
        f->name = read_text(reader);
        f->type = read_index(reader, 0, m->type_count);
        f->start = read_index(reader, 0, m->body_count + 1);
        f->start_point = read_point(reader, m);
        f->end = read_index(reader, 0, m->body_count + 1);
        f->end_point = read_point(reader, m);
        f->clamped_start = read_flag(reader);
        f->clamped_end = read_flag(reader);
        if (f->start == f->end || !(f->clamped_start || f->clamped_end)) {
            reader->wrong = reader->wrong ? reader->wrong : "a flexure that joins nothing";
        }
    }
    m->flexures = flexures;
}

static void read_stops(Reader *reader, Mechanism *m) {
    Stop *stops = kept(reader, (size_t)m->stop_count, sizeof *stops);
    for (int i = 0; i < m->stop_count && !reader->wrong; i++) {
        Stop *s = &stops[i];
        s->name = read_text(reader);
        s->body = read_index(reader, 1, m->body_count + 1);
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
    }
    m->forces = forces;
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

/* The links that stand for a flexure: mirrored halves share the middle one. */
static int links_of(const Mechanism *m, const Flexure *flexure) {
    int pivots = m->types[flexure->type].pivots;
    return flexure->clamped_start && flexure->clamped_end ? 2 * pivots - 1 : pivots;
}

/* Bodies that flexures join to the ground, as the assembly walks. */
static bool all_held(Reader *reader, const Mechanism *m) {
    bool *reached = kept(reader, (size_t)m->body_count + 1, sizeof *reached);
    if (reader->wrong) {
        return false;
    }
    memset(reached, 0, ((size_t)m->body_count + 1) * sizeof *reached);
    reached[GROUND] = true;
    int held = 0;
    for (bool more = true; more;) {
        more = false;
        for (int i = 0; i < m->flexure_count; i++) {
            const Flexure *f = &m->flexures[i];
            if (reached[f->start] != reached[f->end]) {
                reached[f->start] = reached[f->end] = more = true;
                held++;
            }
        }
    }
    return held == m->body_count;
}

static void count_coordinates(Reader *reader, Mechanism *m) {
    long long links = 0;
    for (int i = 0; i < m->flexure_count && !reader->wrong; i++) {
        links += links_of(m, &m->flexures[i]);
    }
    long long n = links + m->body_count, r = 2LL * (m->flexure_count - m->body_count);
    if (!reader->wrong &&
        (n > MOST_COORDINATES || r >= n || m->stop_count > MOST_STOPS ||
         m->friction_count > MOST_STOPS || m->ground_count > MOST_POINTS)) {
        reader->wrong = "more parts than can be computed with, or loops that leave no motion";
    } else if (!reader->wrong && (m->body_count < 1 || !all_held(reader, m))) {
        reader->wrong = reader->wrong ? reader->wrong : "a body that nothing holds";
    }
    if (!reader->wrong) {
        m->link_count = (int)links;
        m->coordinate_count = (int)n;
        m->loop_count = (int)r;
        m->mass_count = (int)(2 * links + 3LL * m->flexure_count + m->body_count);
    }
}

/* Which flexure the assembly walks next: the first that touches what is held and has not been. */
static int next_to_walk(const Mechanism *m, const bool *held, const bool *walked) {
    for (int i = 0; i < m->flexure_count; i++) {
        if (!walked[i] && (held[m->flexures[i].start] || held[m->flexures[i].end])) {
            return i;
        }
    }
    return 0; /* not reached: everything is held */
}

/* Which coordinates are those of links, and which of bodies, in the order of the assembly. */
static void name_coordinates(Reader *reader, Mechanism *m) {
    int *link = kept(reader, (size_t)m->coordinate_count, sizeof *link);
    int *body = kept(reader, (size_t)m->coordinate_count, sizeof *body);
    bool *held = kept(reader, (size_t)m->body_count + 1, sizeof *held);
    bool *walked = kept(reader, (size_t)m->flexure_count, sizeof *walked);
    if (reader->wrong) {
        return;
    }
    memset(held, 0, ((size_t)m->body_count + 1) * sizeof *held);
    memset(walked, 0, (size_t)m->flexure_count * sizeof *walked);
    held[GROUND] = true;
    for (int step = 0, j = 0, links = 0; step < m->flexure_count; step++) {
        int i = next_to_walk(m, held, walked);
        const Flexure *f = &m->flexures[i];
        int far = held[f->start] ? f->end : f->start;
        walked[i] = true;
        for (int k = 0; k < links_of(m, f); k++, j++) {
            link[j] = links++;
            body[j] = 0;
        }
        if (!held[far]) {
            held[far] = true;
            link[j] = -1;
            body[j++] = far;
        }
    }
    m->link_of = link;
    m->body_of = body;
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
    s->frequency = s->links + PER_LINK * m->link_count;
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
    m->stop_count = read_count(reader, 4);
    m->friction_count = read_count(reader, 4);
    m->force_count = read_count(reader, 4);
    m->ground_count = read_count(reader, 4);
    m->bound_count = read_count(reader, 4);
    m->variable_count = read_count(reader, 16);
    m->independent_count = read_count(reader, 4);
    m->input_count = read_count(reader, 12);
    if (!reader->wrong && m->input_count != 3LL * m->force_count + 2LL * m->stop_count + 2) {
        reader->wrong = "another number of inputs than the mechanism has";
    }
    read_parameters(reader, m);
    read_inputs(reader, m);
    read_bodies(reader, m);
    read_types(reader, m);
    read_flexures(reader, m);
    read_stops(reader, m);
    read_frictions(reader, m);
    read_forces(reader, m);
    read_release(reader, m);
    read_ground(reader, m);
    read_bounds(reader, m);
    count_coordinates(reader, m);
    name_coordinates(reader, m);
    read_independents(reader, m);
    if (reader->wrong) {
        return; /* with counts of parts that may not be there */
    }
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
        size_t room = sizeof *m + 64 + ROOM * size;
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
