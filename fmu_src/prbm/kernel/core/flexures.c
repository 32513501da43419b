/* Flexures as links or beams: the twin of mechanics/flexures.py. */
#include <math.h>
#include <string.h>

#include "core/beam.h"
#include "core/flexure.h"
#include "core/flexures.h"
#include "core/free_body.h"
#include "core/matrix.h"

static double length_of(const System *system, const Flexure *flexure) {
    const Connection *between = &flexure->between;
    return modulus(minus(at_point(system, between->end_point),
                         at_point(system, between->start_point)));
}

/* Bending stiffness [N m^2], axial stiffness [N] and mass per length [kg/m] of a flexure. */
typedef struct {
    double EI, EA, mass;
} Uniform;

static Uniform section_of(const System *system, const FlexureType *kind) {
    double h = evaluate(kind->thickness, system->values);
    double b = evaluate(kind->width, system->values);
    double E = evaluate(kind->youngs_modulus, system->values);
    double rho = evaluate(kind->density, system->values);
    Uniform result = {E * b * (h * h * h) / 12, E * b * h, rho * b * h};
    return result;
}

/* Return the coordinate that is a direction of a body or a link; FIXED: the ground. */
static int coordinate_of(const System *system, int j) {
    return j == FIXED ? FIXED : angle_of(system, j);
}

/* --- links ------------------------------------------------------------------------------------ */

static void take_segments(Segments *pieces, int longest, Scratch *scratch) {
    size_t most = (size_t)longest + 2;
    pieces->lengths = take(scratch, most);
    pieces->rates = take(scratch, most);
    pieces->rods = take(scratch, most);
    pieces->lumps = take(scratch, most);
    pieces->axial = take(scratch, most);
}

static bool cut_flexure(const System *system, const Flexure *flexure, Segments *pieces,
                        Scratch *scratch, Problem *problem) {
    const FlexureType *kind = kind_of(system->mechanism, flexure);
    double L = length_of(system, flexure);
    size_t pivots = (size_t)kind->pivots;
    double *gamma = take(scratch, pivots), *K_theta = take(scratch, pivots);
    for (size_t i = 0; i < pivots; i++) {
        gamma[i] = evaluate(kind->gamma[i], system->values);
        K_theta[i] = evaluate(kind->K_theta[i], system->values);
    }
    Uniform section = section_of(system, kind);
    take_segments(pieces, system->mechanism->longest, scratch);
    return segments(kind, gamma, K_theta, flexure->type_at_start, flexure->type_at_end, L,
                    section.EI, section.mass * L, section.EA, pieces, problem);
}

/* Return the strain without a force. */
static double initial_strain(const System *system, const FlexureType *kind) {
    return has_dimension(kind, DIMENSION_INITIAL_STRAIN)
               ? evaluate(kind->dimensions[DIMENSION_INITIAL_STRAIN], system->values)
               : 0.0;
}

/* Set the angle of a link and, if it stretches, its axial spring; return the next direction.
 * blocked: the pressure of the link that is kept at its drawn length [N]. */
static int lay_link(System *system, Complex direction, double length, double axial, double blocked,
                    bool stretching, int j) {
    system->q0[angle_of(system, j)] = phase(direction);
    if (stretching) {
        add_spring(system, axial * (length * length), FIXED, angle_of(system, j + 1));
        system->rest[angle_of(system, j + 1)] = blocked / (axial * length);
    }
    return stretching ? j + 2 : j + 1;
}

static bool is_stretch(const System *system, int j) {
    return j < system->d && arm_of(system, j) != j;
}

static bool walk_links(System *system, const Step *step, Scratch scratch, Problem *problem) {
    Segments pieces = {0, NULL, NULL, NULL, NULL, NULL};
    if (!cut_flexure(system, step->flexure, &pieces, &scratch, problem)) {
        return false;
    }
    if (step->backwards) {
        reversed(&pieces);
    }
    Span span = span_of(system, step);
    Complex along_it = minus(span.z_end, span.z_start);
    Complex direction = scaled(1.0 / modulus(along_it), along_it);
    Place spot = new_place(system, &scratch), spare = new_place(system, &scratch);
    on_body(system, span.root, span.z_start, &spot);
    add_corner(system, &spot);
    int *owners = take_integers(&scratch, pieces.n + 2), next = step->first_direction;
    FreeBody *free_body = begin_free_body(system, step);
    owners[0] = system->origins[span.root].j;
    const FlexureType *kind = kind_of(system->mechanism, step->flexure);
    double blocked = initial_strain(system, kind) * section_of(system, kind).EA;
    for (int i = 1; i <= pieces.n; i++) {
        owners[i] = next;
        next = lay_link(system, direction, pieces.lengths[i], pieces.axial[i - 1],
                        blocked, is_stretch(system, next + 1), next);
    }
    int last_one = owners[pieces.n + 1] = step->closes ? system->origins[span.far].j : next;
    for (int i = 0; i <= pieces.n; i++) {
        /* In the drawing the angle of a body is 0, that of a link its direction. */
        Complex vector = i == 0 ? scaled(pieces.lengths[i], direction)
                                : complex_of(pieces.lengths[i], 0.0);
        add_rod(system, pieces.rods[i], &spot, owners[i], vector, &spare);
        rank_points(free_body, system, 2 * i);
        extend(&spot, owners[i], vector);
        add_corner(system, &spot);
        add_mass(system, &spot, pieces.lumps[i]);
        rank_points(free_body, system, 2 * i + 1);
        add_spring(system, pieces.rates[i], coordinate_of(system, owners[i]),
                   coordinate_of(system, owners[i + 1]));
    }
    Complex last = scaled(pieces.lengths[pieces.n + 1], direction);
    if (step->closes) {
        on_body(system, span.far, minus(span.z_end, last), &spare);
        close_loop(system, &spot, &spare);
        copy_place(system->d, &spot, &spare); /* The last stub is part of the far body. */
    } else {
        reach(system, span.far, &spot, minus(span.z_end, last), last_one);
    }
    add_rod(system, pieces.rods[pieces.n + 1], &spot, last_one, last, &spare);
    extend(&spot, last_one, last);
    add_corner(system, &spot);
    rank_points(free_body, system, 2 * (pieces.n + 1));
    keep_links(system, step, &pieces, direction, owners);
    return true;
}

/* --- beams ------------------------------------------------------------------------------------ */

/* The coordinates of a beam, or FIXED: rotations of its ends, the first coefficient, the strain. */
typedef struct {
    int start, end, first, strain;
} BeamCoordinates;

/* Return the coordinate of the rotation of a body at an end of a beam: the next one after those of
 * the beam, if the beam reaches the body. */
static int rotation_of(const System *system, const Step *step, int body, int next) {
    const Connection *between = &step->flexure->between;
    bool far = body == (step->backwards ? between->start : between->end);
    return far && !step->closes ? next : coordinate_of(system, system->origins[body].j);
}

static BeamCoordinates beam_coordinates(const System *system, const Step *step) {
    const Flexure *flexure = step->flexure;
    const FlexureType *kind = kind_of(system->mechanism, flexure);
    bool start_pinned = flexure->type_at_start == PIN, end_pinned = flexure->type_at_end == PIN;
    BeamCoordinates at;
    at.first = step->first + start_pinned + end_pinned;
    at.strain = kind->axial ? at.first + kind->order : FIXED;
    int next = at.first + kind->order + kind->axial;
    at.start = start_pinned ? step->first
                            : rotation_of(system, step, flexure->between.start, next);
    at.end = end_pinned ? at.first - 1 : rotation_of(system, step, flexure->between.end, next);
    return at;
}

/* Set the changes of the directions of the nodes with the coordinates. */
static void turn_nodes(System *system, const Step *step, const Beam *beam,
                       const BeamCoordinates *at, bool axial) {
    const DirectionMap *map = &system->mechanism->map;
    int j = step->first_direction;
    for (int i = 0; i < beam->nodes; i++) {
        const double *S = beam->S + i * (beam->order + 1);
        int k = map->first[j++];
        if (at->start != FIXED) {
            system->factors[k++] = 1.0 - S[0];
        }
        if (at->end != FIXED) {
            system->factors[k++] = S[0];
        }
        for (int l = 1; l <= beam->order; l++) {
            system->factors[k++] = S[l];
        }
        if (axial) {
            system->factors[map->first[j++]] = beam->strains[i];
        }
    }
}

/* Set the place at the end of lengths (nodes,) along the nodes, from a root. */
static void beam_place(const System *system, const Step *step, const Beam *beam, int stride,
                       const Place *root, Complex direction, const Complex *lengths, Place *spot) {
    copy_place(system->d, spot, root);
    for (int i = 0; i < beam->nodes; i++) {
        Complex length = step->backwards ? minus(lengths[i], beam->whole[i]) : lengths[i];
        extend(spot, step->first_direction + i * stride, product(length, direction));
    }
}

/* Add two masses across the flexure with the moment of inertia of the section of a node. */
static void add_section(System *system, const Place *spot, int arm, double mass, double radius,
                        Complex direction, Place *spare) {
    for (int side = -1; side <= 1; side += 2) {
        copy_place(system->d, spare, spot);
        extend(spare, arm, product(complex_of(0.0, side * radius), direction));
        add_mass(system, spare, mass / 2);
    }
}

/* Place the masses and the far end of a beam; return its direction as drawn. */
static Complex place_beam(System *system, const Step *step, const Beam *beam,
                          const FlexureType *kind, Scratch scratch) {
    FreeBody *free_body = begin_free_body(system, step);
    Place root = new_place(system, &scratch), spot = new_place(system, &scratch);
    Place spare = new_place(system, &scratch);
    Span span = span_of(system, step);
    int stride = kind->axial ? 2 : 1, nodes = beam->nodes;
    Complex along_it = minus(span.z_end, span.z_start);
    Complex direction = scaled((step->backwards ? -1.0 : 1.0) / modulus(along_it), along_it);
    on_body(system, span.root, span.z_start, &root);
    for (int i = 0; i < nodes; i++) {
        beam_place(system, step, beam, stride, &root, direction, beam->A + i * nodes, &spot);
        if (kind->profile == PROFILE_NOTCH) {
            add_section(system, &spot, step->first_direction + i * stride, beam->masses[i],
                        beam->radii[i], direction, &spare);
        } else {
            add_mass(system, &spot, beam->masses[i]);
        }
        rank_points(free_body, system, i);
        add_corner(system, &spot);
    }
    Complex *none = take_complex(&scratch, nodes, 1);
    zeros(2 * nodes, (double *)none);
    beam_place(system, step, beam, stride, &root, direction,
               step->backwards ? none : beam->whole, &spot);
    if (step->closes) {
        on_body(system, span.far, span.z_end, &root);
        close_loop(system, &spot, &root);
    } else {
        reach(system, span.far, &spot, span.z_end, step->first_direction + nodes * stride);
    }
    return direction;
}

static double dimension(const System *system, const FlexureType *kind, int which) {
    return has_dimension(kind, which) ? evaluate(kind->dimensions[which], system->values) : 0.0;
}

/* Set the line of a beam as drawn; fail if its ends are impossible. */
static bool set_line(const System *system, const Flexure *flexure, const FlexureType *kind,
                     Line *line, Problem *problem) {
    double chord = length_of(system, flexure);
    double curvature = dimension(system, kind, DIMENSION_CURVATURE);
    double rise = dimension(system, kind, DIMENSION_RISE);
    if (!(fabs(curvature) * chord < 2.0)) {
        return fail(problem,
                    "flexure %s: %s.curvature = %g 1/m is impossible for ends at the distance %g "
                    "m: choose one below %g 1/m",
                    flexure->name, kind->name, curvature, chord, 2.0 / chord);
    }
    if (!(fabs(rise) < chord)) {
        return fail(problem,
                    "flexure %s: %s.rise = %g m is impossible for ends at the distance %g m: "
                    "choose a rise below this distance",
                    flexure->name, kind->name, rise, chord);
    }
    line->chord = chord;
    line->curvature = curvature;
    line->rise = rise;
    return true;
}

/* Set the panels of a beam of the length L [m]. */
static bool set_panels(const System *system, const Flexure *flexure, const FlexureType *kind,
                       double L, Panel *panels, Problem *problem) {
    double h = evaluate(kind->thickness, system->values);
    double b = evaluate(kind->width, system->values);
    double end_thickness = dimension(system, kind, DIMENSION_END_THICKNESS);
    if (kind->profile == PROFILE_NOTCH) {
        Notch notch = {h, b, dimension(system, kind, DIMENSION_NOTCH_RADIUS),
                       dimension(system, kind, DIMENSION_NOTCH_DEPTH), end_thickness,
                       dimension(system, kind, DIMENSION_WAIST_LENGTH), !is_hinge(kind)};
        return notch_panels(flexure->name, &notch, L, kind->nodes, panels, problem);
    }
    panels[0] = straight_panel(kind->nodes, 0.0, L, h, b);
    if (kind->profile == PROFILE_TAPER) {
        panels[0].thickness[1] = end_thickness;
        panels[0].width[1] = dimension(system, kind, DIMENSION_END_WIDTH);
    }
    return true;
}

static bool walk_beam(System *system, const Step *step, Scratch scratch, Problem *problem) {
    const Flexure *flexure = step->flexure;
    const FlexureType *kind = kind_of(system->mechanism, flexure);
    Panel panels[PANELS_MAX];
    Beam beam = {.order = kind->order,
                 .nodes = node_count(kind),
                 .panel_count = panel_count(kind),
                 .panels = panels,
                 .youngs_modulus = evaluate(kind->youngs_modulus, system->values),
                 .density = evaluate(kind->density, system->values)};
    if (!set_line(system, flexure, kind, &beam.line, problem) ||
        !set_panels(system, flexure, kind, line_length(beam.line), panels, problem)) {
        return false;
    }
    set_beam(&beam, &scratch);
    BeamCoordinates at = beam_coordinates(system, step);
    turn_nodes(system, step, &beam, &at, kind->axial);
    Complex direction = place_beam(system, step, &beam, kind, scratch);
    const int ends[2] = {at.start, at.end};
    keep_beam(system, step, &beam, direction, ends, at.first);
    add_spring(system, beam.rates[0], at.start, at.end);
    for (int k = 0; k < kind->order; k++) {
        add_spring(system, beam.rates[k + 1], FIXED, at.first + k);
    }
    if (kind->axial) {
        add_spring(system, beam.axial_rate, FIXED, at.strain);
        system->rest[at.strain] = initial_strain(system, kind);
    }
    return true;
}

/* Reject a flexure without length, or as thick as long. */
static bool check_slender(const System *system, const Flexure *flexure, const FlexureType *kind,
                          Problem *problem) {
    const char *names[2] = {"thickness", "end_thickness"};
    double L = length_of(system, flexure), thickness[2];
    thickness[0] = evaluate(kind->thickness, system->values);
    thickness[1] = dimension(system, kind, DIMENSION_END_THICKNESS);
    if (!(L > 0.0)) {
        return fail(problem, "flexure %s has the length %g m: move its ends apart", flexure->name,
                    L);
    }
    for (int i = 0; i < (kind->profile == PROFILE_TAPER ? 2 : 1); i++) {
        if (!(thickness[i] < L)) {
            return fail(problem,
                        "%s.%s = %g m is not less than the length of the flexure %s, %g m: check "
                        "the units of both",
                        kind->name, names[i], thickness[i], flexure->name, L);
        }
    }
    return true;
}

PRBM bool walk_flexure(System *system, const Step *step, Scratch scratch, Problem *problem) {
    const FlexureType *kind = kind_of(system->mechanism, step->flexure);
    if (!check_slender(system, step->flexure, kind, problem)) {
        return false;
    }
    if (kind->order == 0) {
        return walk_links(system, step, scratch, problem);
    }
    return walk_beam(system, step, scratch, problem);
}
