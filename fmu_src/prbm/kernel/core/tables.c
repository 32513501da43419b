/* Reading of the tables of a mechanism from untrusted bytes. */
#include <stdlib.h>
#include <string.h>

#include "core/layout.h"
#include "core/tables.h"

enum {
    ROOM = 8,                /* Bytes of memory per byte of the tables, an upper bound. */
    ROOM_OF_COORDINATE = 40, /* Bytes of memory per coordinate. */
    ROOM_OF_DIRECTION = 16,  /* Bytes of memory per direction. */
    ROOM_OF_CHANGE = 8,      /* Bytes of memory per element of the map to the directions. */
};

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
    m->default_step = read_finite(reader);
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
        bodies[i].given = (uint32_t)read_index(reader, 0, 1 << GIVEN_COUNT);
        bodies[i].mass = read_expression(reader, m);
        bodies[i].inertia = read_expression(reader, m);
        for (int k = 0; k < GIVEN_COUNT; k++) {
            if (bodies[i].given >> k & 1u) {
                bodies[i].at_start[k] = read_expression(reader, m);
                m->given_count++;
            }
        }
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

/* Read the profile, its dimensions and those of the line as drawn. */
static void read_profile(Reader *reader, FlexureType *t) {
    t->profile = read_index(reader, 0, PROFILE_NOTCH + 1);
    t->given = (uint32_t)read_index(reader, 0, 1 << DIMENSION_COUNT);
    const uint32_t taper = 1u << DIMENSION_END_THICKNESS | 1u << DIMENSION_END_WIDTH;
    const uint32_t notch = 1u << DIMENSION_END_THICKNESS | 1u << DIMENSION_NOTCH_RADIUS |
                           1u << DIMENSION_NOTCH_DEPTH;
    const uint32_t line = 1u << DIMENSION_CURVATURE | 1u << DIMENSION_RISE;
    const uint32_t strain = 1u << DIMENSION_INITIAL_STRAIN;
    uint32_t given = t->given & ~strain;
    uint32_t others = given & ~line, waist = 1u << DIMENSION_WAIST_LENGTH;
    bool leaf = others == 0u, notched = (given & ~waist) == notch;
    bool fits = t->profile == PROFILE_LEAF    ? leaf
                : t->profile == PROFILE_TAPER ? others == taper
                                              : notched;
    if (!fits || (given & line) == line || (t->order == 0 && given != 0u) ||
        (given != t->given && !t->axial)) {
        reader->wrong = reader->wrong ? reader->wrong : "a flexure type with wrong dimensions";
    }
}

static void read_types(Reader *reader, Mechanism *m) {
    FlexureType *types = kept(reader, (size_t)m->type_count, sizeof *types);
    for (int i = 0; i < m->type_count && !reader->wrong; i++) {
        FlexureType *t = &types[i];
        t->name = read_text(reader);
        t->lumped = read_flag(reader);
        t->rate_with_gamma = read_flag(reader);
        t->axial = read_flag(reader);
        t->stress = read_flag(reader);
        t->pivots = read_index(reader, 0, LINKS_MAX + 1);
        t->links = read_index(reader, 0, LINKS_MAX + 1);
        t->order = read_index(reader, 0, ORDER_MAX + 1);
        t->nodes = read_index(reader, 0, NODES_MAX + 1);
        bool sampled = t->order > 0 ? t->nodes >= t->order + NODES_EXTRA_MIN : t->nodes == 0;
        if ((t->pivots > 0) + (t->links > 0) + (t->order > 0) != 1 || !sampled) {
            reader->wrong = reader->wrong ? reader->wrong
                                          : "a flexure type without a model, or with several";
        }
        read_profile(reader, t);
        t->thickness = read_expression(reader, m);
        t->width = read_expression(reader, m);
        t->youngs_modulus = read_expression(reader, m);
        t->density = read_expression(reader, m);
        for (int k = 0; k < DIMENSION_COUNT; k++) {
            if (has_dimension(t, k)) {
                t->dimensions[k] = read_expression(reader, m);
            }
        }
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
        reader->wrong = reader->wrong ? reader->wrong : "a part that connects a body with itself";
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
        f->type_at_start = read_index(reader, CLAMP, FREE + 1);
        f->type_at_end = read_index(reader, CLAMP, FREE + 1);
        bool freed = f->type_at_start == FREE || f->type_at_end == FREE;
        if (freed && f->type_at_start != CLAMP && f->type_at_end != CLAMP) {
            reader->wrong = reader->wrong ? reader->wrong : "a flexure without a clamp";
        }
    }
    m->flexures = flexures;
}

static void read_joints(Reader *reader, Mechanism *m) {
    Joint *joints = kept(reader, (size_t)m->joint_count, sizeof *joints);
    for (int i = 0; i < m->joint_count && !reader->wrong; i++) {
        joints[i].name = read_text(reader);
        joints[i].between = read_connection(reader, m);
        joints[i].sprung = read_flag(reader);
        joints[i].turned = read_flag(reader);
        joints[i].damped = read_flag(reader);
        if (joints[i].sprung) {
            joints[i].stiffness = read_expression(reader, m);
        }
        if (joints[i].turned) {
            joints[i].free_angle = read_expression(reader, m);
        }
        if (joints[i].damped) {
            joints[i].damping = read_expression(reader, m);
        }
    }
    m->joints = joints;
}

static void read_coils(Reader *reader, Mechanism *m) {
    Coil *coils = kept(reader, (size_t)m->coil_count, sizeof *coils);
    for (int i = 0; i < m->coil_count && !reader->wrong; i++) {
        coils[i].name = read_text(reader);
        coils[i].between = read_connection(reader, m);
        coils[i].pretensioned = read_flag(reader);
        coils[i].side = read_index(reader, 0, 3) - 1;
        coils[i].one_sided = m->one_sided_count;
        m->one_sided_count += coils[i].side != 0;
        coils[i].stiffness = read_expression(reader, m);
        if (coils[i].pretensioned) {
            coils[i].free_length = read_expression(reader, m);
        }
        coils[i].cubic_stiffness = read_expression(reader, m);
        coils[i].damping = read_expression(reader, m);
    }
    m->coils = coils;
}

static void read_guides(Reader *reader, Mechanism *m) {
    Guide *guides = kept(reader, (size_t)m->guide_count, sizeof *guides);
    for (int i = 0; i < m->guide_count && !reader->wrong; i++) {
        guides[i].name = read_text(reader);
        guides[i].between = read_connection(reader, m);
        guides[i].along = read_point(reader, m);
        guides[i].keeps_angle = read_flag(reader);
        m->guided_count += 1 + guides[i].keeps_angle;
        guides[i].rubs = read_flag(reader);
        if (guides[i].rubs) {
            guides[i].friction = read_expression(reader, m);
            m->rubbing_count++;
        }
        if (guides[i].between.start == GROUND) {
            reader->wrong = reader->wrong ? reader->wrong : "a guide for a point of the ground";
        }
    }
    m->guides = guides;
}

static void read_stops(Reader *reader, Mechanism *m) {
    Stop *stops = kept(reader, (size_t)m->stop_count, sizeof *stops);
    for (int i = 0; i < m->stop_count && !reader->wrong; i++) {
        Stop *s = &stops[i];
        s->name = read_text(reader);
        s->body = read_index(reader, 1, m->body_count + 1);
        s->on = read_index(reader, 0, m->body_count + 1);
        if (s->on == s->body) {
            reader->wrong = reader->wrong ? reader->wrong : "a stop whose wall is on its own body";
        }
        s->point = read_point(reader, m);
        s->direction = read_finite(reader);
        s->compliant = read_index(reader, 0, 2) == 1;
        s->position = read_expression(reader, m);
        s->offset = read_expression(reader, m);
        s->restitution = read_expression(reader, m);
        s->friction = read_expression(reader, m);
        s->rest_speed = read_expression(reader, m);
        if (s->compliant) {
            s->stiffness = read_expression(reader, m);
            s->exponent = read_expression(reader, m);
            s->extra = EXTRA_STATES * m->compliant_count++;
        }
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
        m->rubbing_count++;
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
    m->release.point = read_point(reader, m);
    m->release.start = read_index(reader, 0, START_COUNT);
    m->release.mode = (int)(read_u32(reader) & INT32_MAX);
    if ((m->release.start == START_AMPLITUDE) != (m->release.mode > 0)) {
        reader->wrong = reader->wrong ? reader->wrong : "a release along no mode";
    }
    m->release.amount = read_expression(reader, m);
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

/* --- coordinates and variables ---------------------------------------------------------------- */

static void read_independents(Reader *reader, Mechanism *m) {
    int *independent = kept(reader, (size_t)m->independent_count, sizeof *independent);
    for (int i = 0; i < m->independent_count && !reader->wrong; i++) {
        independent[i] = read_index(reader, i ? independent[i - 1] + 1 : 0, m->coordinate_count);
    }
    if (!reader->wrong && m->independent_count != m->coordinate_count - m->loop_count) {
        reader->wrong = "a wrong number of independent coordinates";
    }
    m->independent = independent;
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
        bool of_stop = latched >= 0 && v->slot < m->slots.compliant;
        int output = of_stop ? latched % PER_LATCHED : -1;
        bool contact = output == LATCHED_CONTACT, counter = output == LATCHED_IMPACT_COUNT;
        bool fits = v->type == REAL ? !contact && !counter : v->type == BOOLEAN ? contact : counter;
        if (!fits || (i > 0 && v->reference <= variables[i - 1].reference)) {
            reader->wrong = reader->wrong ? reader->wrong
                                          : "variables with inconsistent types or references";
        }
    }
    m->variables = variables;
}

/* --- the file --------------------------------------------------------------------------------- */

PRBM uint32_t checksum(const unsigned char *bytes, size_t size) {
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
    if (size < TABLES_HEAD || memcmp(bytes, "PRBM", 4) != 0) {
        reader->wrong = "no tables of a mechanism";
        return;
    }
    reader->at += 4;
    reader->left -= 4;
    if (read_u32(reader) != TABLES_VERSION) {
        reader->wrong = "tables of another version";
    } else if (read_u32(reader) != size) {
        reader->wrong = "a size that differs from the size in its header";
    } else if (read_u32(reader) != checksum(bytes + TABLES_HEAD, size - TABLES_HEAD)) {
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
    m->coil_count = read_count(reader, 4);
    m->guide_count = read_count(reader, 4);
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
        reader->wrong = "a wrong number of inputs";
    }
    read_parameters(reader, m);
    read_inputs(reader, m);
    read_bodies(reader, m);
    read_types(reader, m);
    read_flexures(reader, m);
    read_joints(reader, m);
    read_coils(reader, m);
    read_guides(reader, m);
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
        return; /* Counts of invalid tables may exceed the numbers of parts. */
    }
    lay_out_inputs(m);
    lay_out_slots(m);
    read_variables(reader, m);
    if (!reader->wrong && reader->left > 0) {
        reader->wrong = "surplus bytes at its end";
    }
}

PRBM Mechanism *mechanism_open(const unsigned char *bytes, size_t size, Problem *problem) {
    Reader reader = {bytes, size, NULL, {NULL, 0}, 0};
    read_header(&reader, bytes, size);
    Mechanism *m = NULL;
    if (!reader.wrong) {
        size_t room = sizeof *m + ROOM * size + COORDINATES_MAX * ROOM_OF_COORDINATE +
                      DIRECTIONS_MAX * ROOM_OF_DIRECTION + DIRECTION_MAP_MAX * ROOM_OF_CHANGE;
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
