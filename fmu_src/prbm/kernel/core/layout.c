/* The order of the assembly, the coordinates, and the positions of inputs and values. */
#include <string.h>

#include "core/beam.h"
#include "core/flexure.h"
#include "core/layout.h"

static int link_count(const Mechanism *m, const Flexure *flexure) {
    return links_of(kind_of(m, flexure), flexure->type_at_start, flexure->type_at_end);
}

/* The numbers that a flexure adds. */
typedef struct {
    int links, strains;       /* coordinates */
    int arms, stretches;      /* directions */
    int springs, masses, map; /* map: changes of directions with coordinates */
} Addition;

static int pin_count(const Flexure *flexure) {
    return (flexure->type_at_start == PIN) + (flexure->type_at_end == PIN);
}

/* The largest number of corners of a flexure in addition to its links or nodes. */
enum { CORNERS_BESIDE_ARMS = 3 };

static size_t size_of_beam(const FlexureType *kind) {
    return beam_size(kind->order, node_count(kind), panel_count(kind));
}

static Addition beam_addition(const FlexureType *kind, const Flexure *flexure) {
    int nodes = node_count(kind), stretches = kind->axial ? nodes : 0;
    int masses = kind->profile == PROFILE_NOTCH ? 2 * nodes : nodes;
    Addition result = {kind->order + pin_count(flexure), kind->axial, nodes, stretches,
                       1 + kind->order + kind->axial, masses,
                       nodes * (kind->order + 2) + stretches};
    return result;
}

static Addition links_addition(const Mechanism *m, const Flexure *flexure) {
    int links = link_count(m, flexure), strains = 0;
    for (int k = 0; k < links; k++) {
        strains += stretches(kind_of(m, flexure), flexure->type_at_start, k, links);
    }
    Addition result = {links, strains, links, strains, links + strains + 1, 2 * links + 4,
                       links + strains};
    return result;
}

static Addition addition_of(const Mechanism *m, const Flexure *flexure) {
    const FlexureType *kind = kind_of(m, flexure);
    return kind->order > 0 ? beam_addition(kind, flexure) : links_addition(m, flexure);
}

static const Connection *connection(const Mechanism *m, int i) {
    return i < m->flexure_count ? &m->flexures[i].between : &m->joints[i - m->flexure_count].between;
}

/* Return what part i connects: the flexures come first, then joints, coil springs and guides. */
static const Connection *attachment(const Mechanism *m, int i) {
    int parts = m->flexure_count + m->joint_count, coils = parts + m->coil_count;
    return i < parts   ? connection(m, i)
           : i < coils ? &m->coils[i - parts].between
                       : &m->guides[i - coils].between;
}

/* Mark what the first parts connect to a marked body. */
static void mark_connected(const Mechanism *m, int parts, bool *marked) {
    for (bool more = true; more;) {
        more = false;
        for (int i = 0; i < parts; i++) {
            const Connection *c = attachment(m, i);
            if (marked[c->start] != marked[c->end]) {
                more = marked[c->start] = marked[c->end] = true;
            }
        }
    }
}

/* Return the number of bodies that are free: the first one of each group of bodies that parts
 * connect to each other, but not to the ground. */
static int free_count(Reader *reader, const Mechanism *m) {
    const int parts = m->flexure_count + m->joint_count;
    size_t b = (size_t)m->body_count;
    bool *marked = kept(reader, b + 1, sizeof *marked);
    int count = 0;
    if (reader->wrong) {
        return 0;
    }
    memset(marked, 0, (b + 1) * sizeof *marked);
    marked[GROUND] = true;
    mark_connected(m, parts, marked);
    for (int body = 1; body <= m->body_count; body++) {
        if (!marked[body]) {
            count++;
            marked[body] = true;
            mark_connected(m, parts, marked);
        }
    }
    return count;
}

static bool too_many_places(const Mechanism *m) {
    return m->coil_count > PLACES_MAX || m->guide_count > PLACES_MAX || m->stop_count > STOPS_MAX ||
           m->rubbing_count > STOPS_MAX || m->force_count > PLACES_MAX ||
           m->probe_count > PLACES_MAX || m->ground_count > GROUND_POINTS_MAX;
}

PRBM void count_coordinates(Reader *reader, Mechanism *m) {
    long long b = m->body_count, links = 0, strains = 0, springs = 0;
    long long arms = b, stretching = 0, masses = b, map = b, corners = 0;
    for (int i = 0; i < m->flexure_count && !reader->wrong; i++) {
        Addition more = addition_of(m, &m->flexures[i]);
        links += more.links;
        strains += more.strains;
        arms += more.arms;
        stretching += more.stretches;
        springs += more.springs;
        masses += more.masses;
        map += more.map;
        corners += more.arms + CORNERS_BESIDE_ARMS;
        m->stressed_count += kind_of(m, &m->flexures[i])->stress;
        m->longest = more.arms > m->longest ? more.arms : m->longest;
        size_t size = kind_of(m, &m->flexures[i])->order > 0
                          ? size_of_beam(kind_of(m, &m->flexures[i]))
                          : 0;
        m->beam_size = size > m->beam_size ? size : m->beam_size;
    }
    long long parts = (long long)m->flexure_count + m->joint_count;
    long long n = links + strains + b, r = 2 * (parts - b), shifts = 0, floats = 0;
    bool few = n <= COORDINATES_MAX && r < n; /* Otherwise, do not search. */
    if (!reader->wrong && few) {
        floats = free_count(reader, m);
        shifts = SHIFTS_EACH * floats;
        n += shifts;
        r += 2 * floats + m->guided_count;
        arms += floats;
        map += shifts;
    }
    if (!reader->wrong &&
        (!few || n > COORDINATES_MAX || arms + stretching + shifts > DIRECTIONS_MAX ||
         map > DIRECTION_MAP_MAX || r >= n || too_many_places(m))) {
        reader->wrong = "more parts than the kernel supports, or loops that leave no degree of "
                        "freedom";
    } else if (!reader->wrong && b < 1) {
        reader->wrong = "no body";
    }
    if (!reader->wrong) {
        m->link_count = (int)links;
        m->strain_count = (int)strains;
        m->stretch_count = (int)stretching;
        m->coordinate_count = (int)n;
        m->shift_count = (int)shifts;
        m->placed_count = PLACED_EACH * (int)floats;
        m->step_count = (int)(parts + floats);
        m->direction_count = (int)(arms + stretching + shifts);
        m->map.count = (int)map; /* An upper bound. */
        m->loop_count = (int)r;
        m->spring_count = (int)springs;
        m->mass_count = (int)masses;
        m->corner_count = (int)corners;
    }
}

/* State of the assembly: connected bodies with their coordinates, visited parts, coordinates and
 * directions added so far. */
typedef struct {
    bool *held, *walked;
    bool *hung; /* (b + 1,) whether parts, coil springs or guides connect a body to the ground */
    int *body; /* (b + 1,) coordinates of the bodies */
    int *depth; /* (b + 1,) numbers of parts between the bodies and the ground */
    Coordinate *coordinates;
    int *links, *strains, *arms, *stretches, *shifts, *placed, *floating;
    DirectionMap map;
    int added, link_count, strain_count, directed, stretch_count, shift_count, placed_count,
        floating_count;
} Walk;

static int add_angle(Walk *walk) {
    Coordinate coordinate = {walk->link_count, -1, 0, -1};
    walk->links[walk->link_count++] = walk->added;
    walk->coordinates[walk->added] = coordinate;
    return walk->added++;
}

static int add_strain(Walk *walk) {
    Coordinate coordinate = {-1, walk->strain_count, 0, -1};
    walk->strains[walk->strain_count++] = walk->added;
    walk->coordinates[walk->added] = coordinate;
    return walk->added++;
}

static int add_body_angle(Walk *walk, int body) {
    Coordinate coordinate = {-1, -1, body, -1};
    walk->held[body] = true;
    walk->body[body] = walk->added;
    walk->coordinates[walk->added] = coordinate;
    return walk->added++;
}

/* Add a dependence of the last direction on a coordinate; FIXED: none. */
static void depend(Walk *walk, int coordinate) {
    DirectionMap *map = &walk->map;
    if (coordinate != FIXED) {
        map->mapped = map->mapped || map->count != walk->directed - 1 ||
                      coordinate != walk->directed - 1;
        map->coordinate[map->count++] = coordinate;
        map->first[walk->directed] = map->count;
    }
}

/* Add a direction that depends on no coordinate yet: an angle, or a change of an arm. */
static int add_direction(Walk *walk, int arm) {
    int j = walk->directed++;
    walk->map.first[j + 1] = walk->map.count;
    walk->arms[j] = arm == FIXED ? j : arm;
    return j;
}

/* Add the stretch of an arm, which depends on no coordinate yet. */
static void add_stretch(Walk *walk, int arm) {
    walk->stretches[walk->stretch_count++] = add_direction(walk, arm);
}

/* Add a link: its angle and, if it stretches, its strain. */
static void add_link(Walk *walk, bool stretching) {
    int angle = add_angle(walk), arm = add_direction(walk, FIXED);
    depend(walk, angle);
    if (stretching) {
        add_stretch(walk, arm);
        depend(walk, add_strain(walk));
    }
}

/* Add a body and its direction. */
static void add_body_direction(Walk *walk, int coordinate) {
    add_direction(walk, FIXED);
    depend(walk, coordinate);
}

/* List a coordinate of a body without flexures and joints to the ground, which springs may hold. */
static void list_free(Walk *walk, int body, int coordinate) {
    walk->floating[walk->floating_count++] = coordinate;
    if (!walk->hung[body]) {
        walk->placed[walk->placed_count++] = coordinate;
    }
}

/* Add a displacement of a free body. */
static int add_shift(Walk *walk, int body, int axis) {
    Coordinate coordinate = {-1, -1, body, axis};
    list_free(walk, body, walk->added);
    walk->coordinates[walk->added] = coordinate;
    return walk->added++;
}

/* Add a free body: its displacements, its arm that floats, and its rotation. */
static void add_free_body(Walk *walk, int body) {
    int shifts[SHIFTS_EACH] = {add_shift(walk, body, AXIS_X), add_shift(walk, body, AXIS_Y)};
    int arm = add_direction(walk, FIXED);
    for (int k = 0; k < SHIFTS_EACH; k++) {
        walk->shifts[walk->shift_count++] = add_direction(walk, arm);
        depend(walk, shifts[k]);
    }
    int turn = add_body_angle(walk, body);
    list_free(walk, body, turn);
    add_body_direction(walk, turn);
}

/* Return the coordinate that rotates an end of a beam. */
static int end_angle(const Walk *walk, int type, int pin, int body) {
    return type == PIN ? pin : body == GROUND ? FIXED : walk->body[body];
}

/* Add a beam: pins, coefficients, strain, the body at its far end, and the directions of nodes. */
static void add_beam(const FlexureType *kind, const Flexure *flexure, Walk *walk, int reached) {
    int start_pin = flexure->type_at_start == PIN ? add_angle(walk) : FIXED;
    int end_pin = flexure->type_at_end == PIN ? add_angle(walk) : FIXED;
    int first = walk->added;
    for (int k = 0; k < kind->order; k++) {
        add_angle(walk);
    }
    int strain = kind->axial ? add_strain(walk) : FIXED;
    int body = reached != GROUND ? add_body_angle(walk, reached) : FIXED;
    int start = end_angle(walk, flexure->type_at_start, start_pin, flexure->between.start);
    int end = end_angle(walk, flexure->type_at_end, end_pin, flexure->between.end);
    for (int i = 0; i < node_count(kind); i++) {
        int arm = add_direction(walk, FIXED);
        depend(walk, start);
        depend(walk, end);
        for (int k = 0; k < kind->order; k++) {
            depend(walk, first + k);
        }
        if (strain != FIXED) {
            add_stretch(walk, arm);
            depend(walk, strain);
        }
    }
    if (body != FIXED) {
        add_body_direction(walk, body);
    }
}

/* Return part i: the flexures come first, then the joints. */
static Step part(const Mechanism *m, int i) {
    Step step = {NULL, connection(m, i), NULL, NULL, 0, false, false, 0, 0};
    if (i < m->flexure_count) {
        step.name = m->flexures[i].name;
        step.flexure = &m->flexures[i];
    } else {
        step.joint = &m->joints[i - m->flexure_count];
        step.name = step.joint->name;
    }
    return step;
}

/* Whether a part is added from its end to its start.  A beam that closes a loop is added from the
 * body that is nearer to the ground, which leaves fewer arms to move its masses. */
static bool laid_backwards(const Mechanism *m, const Walk *walk, const Step *step) {
    int start = step->between->start, end = step->between->end;
    bool beam = step->flexure && kind_of(m, step->flexure)->order > 0;
    if (!walk->held[start] || !walk->held[end]) {
        return !walk->held[start];
    }
    return beam && walk->depth[end] < walk->depth[start];
}

/* Visit the first body that has not been reached, which is free. */
static void walk_free(const Mechanism *m, Walk *walk, Step *step) {
    Step result = {NULL, NULL, NULL, NULL, 1, false, false, walk->added, walk->directed};
    while (walk->held[result.body]) {
        result.body++;
    }
    result.name = m->bodies[result.body - 1].name;
    *step = result;
    walk->depth[result.body] = 0;
    add_free_body(walk, result.body);
}

/* Visit the first unvisited part with an end on a connected body; false if there is none. */
static bool walk_on(const Mechanism *m, Walk *walk, Step *step) {
    for (int i = 0; i < m->flexure_count + m->joint_count; i++) {
        *step = part(m, i);
        const bool *held = walk->held;
        if (!walk->walked[i] && (held[step->between->start] || held[step->between->end])) {
            walk->walked[i] = true;
            step->backwards = laid_backwards(m, walk, step);
            step->first = walk->added;
            step->first_direction = walk->directed;
            return true;
        }
    }
    return false;
}

static void add_coordinates(const Mechanism *m, Walk *walk, Step *step) {
    const Flexure *flexure = step->flexure;
    int far = step->backwards ? step->between->start : step->between->end;
    step->closes = walk->held[far];
    if (!step->closes) {
        int near = step->backwards ? step->between->end : step->between->start;
        walk->depth[far] = walk->depth[near] + 1;
    }
    if (flexure && kind_of(m, flexure)->order > 0) {
        add_beam(kind_of(m, flexure), flexure, walk, step->closes ? GROUND : far);
        return;
    }
    int count = flexure ? link_count(m, flexure) : 0;
    for (int k = 0; k < count; k++) {
        int i = step->backwards ? count - 1 - k : k;
        add_link(walk, stretches(kind_of(m, flexure), flexure->type_at_start, i, count));
    }
    if (!step->closes) {
        add_body_direction(walk, add_body_angle(walk, far));
    }
}

/* Set the order of the assembly, and the link or body of each coordinate. */
PRBM void lay_out_coordinates(Reader *reader, Mechanism *m) {
    size_t parts = (size_t)m->flexure_count + (size_t)m->joint_count;
    size_t n = (size_t)m->coordinate_count, b = (size_t)m->body_count;
    size_t d = (size_t)m->direction_count, all = (size_t)m->step_count;
    DirectionMap map = {false, kept(reader, d + 1, sizeof(int)),
                        kept(reader, (size_t)m->map.count, sizeof(int)), 0};
    Walk walk = {kept(reader, b + 1, sizeof(bool)), kept(reader, parts, sizeof(bool)),
                 kept(reader, b + 1, sizeof(bool)),
                 kept(reader, b + 1, sizeof(int)), kept(reader, b + 1, sizeof(int)),
                 kept(reader, n, sizeof(Coordinate)),
                 kept(reader, n, sizeof(int)), kept(reader, n, sizeof(int)),
                 kept(reader, d, sizeof(int)), kept(reader, d, sizeof(int)),
                 kept(reader, (size_t)m->shift_count, sizeof(int)),
                 kept(reader, (size_t)m->placed_count, sizeof(int)),
                 kept(reader, (size_t)m->placed_count, sizeof(int)), map, 0, 0, 0, 0, 0, 0, 0, 0};
    Step *steps = kept(reader, all, sizeof *steps);
    if (reader->wrong) {
        return;
    }
    memset(walk.held, 0, (b + 1) * sizeof *walk.held);
    memset(walk.walked, 0, parts * sizeof *walk.walked);
    memset(walk.hung, 0, (b + 1) * sizeof *walk.hung);
    walk.held[GROUND] = walk.hung[GROUND] = true;
    mark_connected(m, m->flexure_count + m->joint_count + m->coil_count + m->guide_count,
                   walk.hung);
    walk.depth[GROUND] = 0;
    walk.map.first[0] = 0;
    for (size_t i = 0; i < all; i++) {
        if (walk_on(m, &walk, &steps[i])) {
            add_coordinates(m, &walk, &steps[i]);
        } else {
            walk_free(m, &walk, &steps[i]);
        }
    }
    m->steps = steps;
    m->coordinates = walk.coordinates;
    m->links = walk.links;
    m->strains = walk.strains;
    m->arms = walk.arms;
    m->stretches = walk.stretches;
    m->shifts = walk.shifts;
    m->placed = walk.placed;
    m->placed_count = walk.placed_count;
    m->floating = walk.floating;
    m->floating_count = walk.floating_count;
    walk.map.mapped = walk.map.mapped || walk.directed != walk.added;
    m->map = walk.map;
}

/* Set the index of the first element of each group, for consecutive groups. */
static void begin_groups(int groups, const int *counts, int *begins) {
    int next_one = 0;
    for (int i = 0; i < groups; i++) {
        begins[i] = next_one;
        next_one += counts[i];
    }
}

PRBM void lay_out_inputs(Mechanism *m) {
    const int counts[INPUTS_GROUPS] = {
        [INPUTS_FORCES] = LOADS * m->force_count,
        [INPUTS_WALLS] = PER_WALL * m->stop_count,
        [INPUTS_IMPULSES] = LOADS * m->force_count,
        [INPUTS_MOBILITIES] = m->stop_count,
        [INPUTS_BASE] = AXES,
    };
    int begins[INPUTS_GROUPS];
    begin_groups(INPUTS_GROUPS, counts, begins);
    m->input.walls = begins[INPUTS_WALLS];
    m->input.impulses = begins[INPUTS_IMPULSES];
    m->input.mobilities = begins[INPUTS_MOBILITIES];
    m->input.base = begins[INPUTS_BASE];
}

/* Return the number of flexure types whose gamma0 is a calculated parameter. */
static int calculated_count(const Mechanism *m) {
    int count = 0;
    for (int i = 0; i < m->type_count; i++) {
        count += m->types[i].pivots > 1;
    }
    return count;
}

PRBM void lay_out_slots(Mechanism *m) {
    const int counts[SLOTS_GROUPS] = {
        [SLOTS_PARAMETERS] = m->parameter_count,
        [SLOTS_INPUTS] = m->input_count,
        [SLOTS_BODIES] = PER_BODY * m->body_count,
        [SLOTS_STOPS] = PER_STOP * m->stop_count,
        [SLOTS_SPRINGS] = PER_SPRING * m->coil_count,
        [SLOTS_GUIDES] = m->guided_count,
        [SLOTS_BASE] = PER_BASE,
        [SLOTS_ENERGIES] = PER_ENERGY,
        [SLOTS_LATCHED] = PER_LATCHED * m->stop_count,
        [SLOTS_COMPLIANT] = PER_COMPLIANT * m->compliant_count,
        [SLOTS_LINKS] = PER_LINK * m->link_count,
        [SLOTS_STRETCHES] = PER_STRETCH * m->strain_count,
        [SLOTS_PROBES] = PER_PROBE * m->probe_count,
        [SLOTS_STRESSES] = PER_STRESS * m->stressed_count,
        [SLOTS_FREQUENCY] = 1,
        [SLOTS_CALCULATED] = calculated_count(m),
        [SLOTS_DERIVATIVES] = m->independent_count + 2 + EXCHANGED_STATES * m->compliant_count,
        [SLOTS_INDICATORS] = indicator_count(m),
        [SLOTS_TIME] = 1,
    };
    int at[SLOTS_GROUPS];
    begin_groups(SLOTS_GROUPS, counts, at);
    const Slots slots = {
        .parameters = at[SLOTS_PARAMETERS],
        .inputs = at[SLOTS_INPUTS],
        .bodies = at[SLOTS_BODIES],
        .stops = at[SLOTS_STOPS],
        .springs = at[SLOTS_SPRINGS],
        .guides = at[SLOTS_GUIDES],
        .base = at[SLOTS_BASE],
        .energies = at[SLOTS_ENERGIES],
        .latched = at[SLOTS_LATCHED],
        .compliant = at[SLOTS_COMPLIANT],
        .links = at[SLOTS_LINKS],
        .stretches = at[SLOTS_STRETCHES],
        .probes = at[SLOTS_PROBES],
        .stresses = at[SLOTS_STRESSES],
        .frequency = at[SLOTS_FREQUENCY],
        .calculated = at[SLOTS_CALCULATED],
        .derivatives = at[SLOTS_DERIVATIVES],
        .indicators = at[SLOTS_INDICATORS],
        .time = at[SLOTS_TIME],
        .count = at[SLOTS_GROUPS - 1] + counts[SLOTS_GROUPS - 1],
    };
    m->slots = slots;
    m->first_extra = 2 * m->coordinate_count + 2;
    m->state_count = m->first_extra + EXTRA_STATES * m->compliant_count;
}
