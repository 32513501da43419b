/* The order of the assembly, the coordinates, and the positions of inputs and values. */
#include <string.h>

#include "core/flexure.h"
#include "core/layout.h"
#include "core/tables.h"

static const FlexureType *kind_of(const Mechanism *m, const Flexure *flexure) {
    return &m->types[flexure->type];
}

static int link_count(const Mechanism *m, const Flexure *flexure) {
    return links_of(kind_of(m, flexure), flexure->type_at_start, flexure->type_at_end);
}

PRBM void count_coordinates(Reader *reader, Mechanism *m) {
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
        (n > COORDINATES_MAX || r >= n || m->stop_count > STOPS_MAX ||
         m->friction_count > STOPS_MAX || m->force_count > PLACES_MAX ||
         m->probe_count > PLACES_MAX || m->ground_count > GROUND_POINTS_MAX)) {
        reader->wrong = "more parts than the kernel supports, or loops that leave no degree of "
                        "freedom";
    } else if (!reader->wrong && (b < 1 || r < 0)) {
        reader->wrong = "a body without a connection to the ground";
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

/* State of the assembly: connected bodies, visited parts, coordinates added so far. */
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

/* Add the coordinates of a link: its angle and, if it stretches, its stretch. */
static void add_link(Walk *walk, bool stretching) {
    int j = walk->added;
    add_coordinate(walk, walk->link_count, 0, j);
    walk->links[walk->link_count++] = j;
    if (stretching) {
        add_coordinate(walk, walk->link_count - 1, 0, j);
        walk->stretches[walk->stretch_count++] = j + 1;
    }
}

/* Return part i: the flexures come first, then the joints. */
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

/* Visit the first unvisited part with an end on a connected body; false if there is none. */
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

/* Set the order of the assembly, and the link or body of each coordinate. */
PRBM void lay_out_coordinates(Reader *reader, Mechanism *m) {
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
        reader->wrong = "a body without a connection to the ground";
    }
    m->steps = steps;
    m->coordinates = walk.coordinates;
    m->links = walk.links;
    m->stretches = walk.stretches;
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
        [SLOTS_BASE] = PER_BASE,
        [SLOTS_ENERGIES] = PER_ENERGY,
        [SLOTS_LATCHED] = PER_LATCHED * m->stop_count,
        [SLOTS_LINKS] = PER_LINK * m->link_count,
        [SLOTS_STRETCHES] = PER_STRETCH * m->stretch_count,
        [SLOTS_PROBES] = PER_PROBE * m->probe_count,
        [SLOTS_FREQUENCY] = 1,
        [SLOTS_CALCULATED] = calculated_count(m),
        [SLOTS_DERIVATIVES] = m->independent_count + 2,
        [SLOTS_INDICATORS] = STOP_INDICATORS * m->stop_count + m->friction_count,
        [SLOTS_TIME] = 1,
    };
    int at[SLOTS_GROUPS];
    begin_groups(SLOTS_GROUPS, counts, at);
    const Slots slots = {
        .parameters = at[SLOTS_PARAMETERS],
        .inputs = at[SLOTS_INPUTS],
        .bodies = at[SLOTS_BODIES],
        .stops = at[SLOTS_STOPS],
        .base = at[SLOTS_BASE],
        .energies = at[SLOTS_ENERGIES],
        .latched = at[SLOTS_LATCHED],
        .links = at[SLOTS_LINKS],
        .stretches = at[SLOTS_STRETCHES],
        .probes = at[SLOTS_PROBES],
        .frequency = at[SLOTS_FREQUENCY],
        .calculated = at[SLOTS_CALCULATED],
        .derivatives = at[SLOTS_DERIVATIVES],
        .indicators = at[SLOTS_INDICATORS],
        .time = at[SLOTS_TIME],
        .count = at[SLOTS_GROUPS - 1] + counts[SLOTS_GROUPS - 1],
    };
    m->slots = slots;
}
