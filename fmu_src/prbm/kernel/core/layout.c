/* The order of the assembly, the coordinates, and where inputs and values are found. */
#include <string.h>

#include "core/flexure.h"
#include "core/layout.h"
#include "core/tables.h"

static const FlexureType *kind_of(const Mechanism *m, const Flexure *flexure) {
    return &m->types[flexure->type];
}

static int link_count(const Mechanism *m, const Flexure *flexure) {
    return links_of(kind_of(m, flexure), flexure->start_end, flexure->end_end);
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
        reader->wrong = "a body that nothing holds";
    }
    m->steps = steps;
    m->coordinates = walk.coordinates;
    m->links = walk.links;
    m->stretches = walk.stretches;
}

PRBM void lay_out_inputs(Mechanism *m) {
    InputGroups *input = &m->input;
    input->walls = LOADS * m->force_count;
    input->impulses = input->walls + PER_WALL * m->stop_count;
    input->mobilities = input->impulses + LOADS * m->force_count;
    input->base = input->mobilities + m->stop_count;
}

PRBM void lay_out_slots(Mechanism *m) {
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
