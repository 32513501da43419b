/* A beam whose bending moment is a polynomial: the twin of mechanics/beam.py. */
#include "core/beam.h"
#include "core/matrix.h"

/* Compute the Legendre polynomials P_0 to P_order at x. */
static void legendre(int order, double x, double *P) {
    P[0] = 1.0;
    if (order > 0) {
        P[1] = x;
    }
    for (int k = 2; k <= order; k++) {
        P[k] = ((2 * k - 1) * x * P[k - 1] - (k - 1) * P[k - 2]) / k;
    }
}

/* Each node is a zero of P_count, found by Newton's method from an approximation. */
PRBM void gauss(int count, double *nodes, double *weights) {
    double P[NODES_MAX + 1];
    for (int i = 0; i < count; i++) {
        Complex start;
        double angle = HALF_TURN * (i + 0.75) / (count + 0.5), x, slope = 1.0;
        unit_vectors(1, &angle, &start);
        x = -start.re;
        for (int step = 0; step < GAUSS_ITERATIONS_MAX; step++) {
            legendre(count, x, P);
            slope = count * (P[count - 1] - x * P[count]) / (1.0 - x * x);
            x -= P[count] / slope;
        }
        nodes[i] = x;
        weights[i] = 2.0 / ((1.0 - x * x) * (slope * slope));
    }
}

PRBM void integrals(int order, double x, double *S) {
    double P[NODES_MAX + 2];
    legendre(order + 1, x, P);
    S[0] = 0.5 * (1.0 + x);
    for (int k = 1; k <= order; k++) {
        S[k] = 0.5 * (P[k + 1] - P[k - 1]) / (2 * k + 1);
    }
}

PRBM void interpolation(int nodes, double x, double *result) {
    double S[NODES_MAX + 1], P[NODES_MAX + 1], points[NODES_MAX], weights[NODES_MAX];
    gauss(nodes, points, weights);
    integrals(nodes - 1, x, S);
    for (int m = 0; m < nodes; m++) {
        legendre(nodes - 1, points[m], P);
        double sum = 0.0;
        for (int k = 0; k < nodes; k++) {
            sum += (2 * k + 1) * S[k] * P[k];
        }
        result[m] = weights[m] * sum;
    }
}

/* The recurrence u p_k = b_(k+1) p_(k+1) + a_k p_k + b_k p_(k-1) is that of Stieltjes. */
PRBM void orthogonal(int m, int order, const double *u, const double *weights, double *P,
                     Scratch scratch) {
    double *before = take(&scratch, (size_t)m), *p = take(&scratch, (size_t)m), b = 0.0;
    for (int i = 0; i < m; i++) {
        before[i] = 0.0;
        p[i] = 1.0;
    }
    for (int k = 0; k <= order; k++) {
        double a = 0.0, square = 0.0;
        for (int i = 0; i < m; i++) {
            P[i * (order + 1) + k] = p[i] / square_root(2 * k + 1);
            a += weights[i] * (u[i] * p[i] * p[i]);
        }
        for (int i = 0; i < m; i++) {
            before[i] = (u[i] - a) * p[i] - b * before[i];
            square += weights[i] * (before[i] * before[i]);
        }
        b = square_root(square);
        for (int i = 0; i < m; i++) {
            double following = before[i] / b;
            before[i] = p[i];
            p[i] = following;
        }
    }
}

/* --- sections --------------------------------------------------------------------------------- */

/* Points between all nodes: FINE_POINTS in each interval. */
typedef struct {
    int count;
    double *ds;        /* (count,) weights times the arc length per x [m] */
    Section *sections; /* (count,) */
} Fine;

enum {
    SECTION_DOUBLES = sizeof(Section) / sizeof(double),
    CUT_DOUBLES = sizeof(Cut) / sizeof(double),
    MOMENTS = 3 /* Integrals over the beam that are exact: of dz, S_0 dz and S_1 dz. */
};

PRBM size_t beam_size(int order, int nodes, int panels) {
    size_t n = (size_t)order + 1, N = (size_t)nodes;
    size_t Q = (N + (size_t)panels) * FINE_POINTS;
    size_t cuts = N + CUTS_BESIDE_NODES;
    size_t arrays = N * (n + 2 * N + 5) + n + cuts * (CUT_DOUBLES + n);
    return arrays + N * (SECTION_DOUBLES + 6) + Q * (SECTION_DOUBLES + n + 5) + n +
           cuts * (SECTION_DOUBLES + n + 5) + 6 * MOMENTS;
}

static Section *take_sections(Scratch *scratch, int count) {
    return (Section *)(void *)take(scratch, (size_t)count * SECTION_DOUBLES);
}

/* Return the arc length per x at a section [m]. */
static double arc(const Beam *beam, Section section) {
    return section.dv * modulus(tangent(beam->line, section.v));
}

static double area_of(Section section) {
    return section.width * section.thickness;
}

static Fine fine_points(const Beam *beam, Scratch *scratch) {
    double points[FINE_POINTS], parts[FINE_POINTS], nodes[NODES_MAX], weights[NODES_MAX];
    int intervals = beam->nodes + beam->panel_count;
    Fine fine = {0, take(scratch, (size_t)(intervals * FINE_POINTS)), NULL};
    fine.sections = take_sections(scratch, intervals * FINE_POINTS);
    gauss(FINE_POINTS, points, parts);
    for (int p = 0; p < beam->panel_count; p++) {
        const Panel *panel = &beam->panels[p];
        gauss(panel->nodes, nodes, weights);
        for (int k = 0; k <= panel->nodes; k++) {
            double start = k == 0 ? -1.0 : nodes[k - 1], end = k == panel->nodes ? 1.0 : nodes[k];
            double middle = 0.5 * (end + start), half = 0.5 * (end - start);
            for (int i = 0; i < FINE_POINTS; i++) {
                Section section = section_at(panel, middle + half * points[i]);
                fine.sections[fine.count] = section;
                fine.ds[fine.count++] = half * parts[i] * arc(beam, section);
            }
        }
    }
    return fine;
}

/* --- bending and stretch ---------------------------------------------------------------------- */

/* Return the factor on the tangents of the line: their unit is the direction of the chord. */
static Complex direction_factor(Line line) {
    Complex end = position(line, line_length(line));
    return scaled(line.chord / (end.re * end.re + end.im * end.im), conjugate(end));
}

/* Compute the integrals of dz, S_0 dz and S_1 dz over the beam as drawn, by parts. */
static void set_integrals(const Beam *beam, const Fine *fine, const double *shares, const double *P,
                          Complex *sums) {
    Complex factor = direction_factor(beam->line);
    sums[0] = sums[1] = complex_of(beam->line.chord, 0.0);
    sums[2] = complex_of(0.0, 0.0);
    for (int i = 0; i < fine->count; i++) {
        Complex z = product(position(beam->line, fine->sections[i].v), factor);
        for (int k = 0; k < MOMENTS - 1; k++) {
            double share = shares[i] * P[i * (beam->order + 1) + k];
            sums[k + 1] = minus(sums[k + 1], scaled(share, z));
        }
    }
}

/* Set the integrals of the polynomials up to the nodes, the polynomials at the cuts, the rates, and
 * the integrals over the beam, moments (MOMENTS,).  The cuts follow the fine points, with the
 * weight 0. */
static void set_bending(Beam *beam, const Fine *fine, const Section *cuts, Complex *moments,
                        Scratch scratch) {
    int n = beam->order + 1, Q = fine->count, all = Q + beam->cut_count, node = 0, interval = 0;
    double *u = take(&scratch, (size_t)all), *shares = take(&scratch, (size_t)all), total = 0.0;
    double *P = take_matrix(&scratch, all, n), *sums = take(&scratch, (size_t)n);
    for (int i = 0; i < Q; i++) {
        const Section *s = &fine->sections[i];
        u[i] = 2.0 * s->v / line_length(beam->line) - 1.0;
        shares[i] = fine->ds[i] / (s->width * (s->thickness * s->thickness * s->thickness) / 12);
        total += shares[i];
    }
    for (int i = 0; i < Q; i++) {
        shares[i] /= total;
    }
    for (int i = Q; i < all; i++) {
        u[i] = 2.0 * cuts[i - Q].v / line_length(beam->line) - 1.0;
        shares[i] = 0.0;
    }
    orthogonal(all, beam->order, u, shares, P, scratch);
    copy(beam->cut_count * n, P + Q * n, beam->moments);
    set_integrals(beam, fine, shares, P, moments);
    zeros(n, sums);
    for (int p = 0; p < beam->panel_count; p++) {
        for (int k = 0; k <= beam->panels[p].nodes; k++, interval++) {
            for (int i = interval * FINE_POINTS; i < (interval + 1) * FINE_POINTS; i++) {
                add_scaled(n, shares[i], P + i * n, sums);
            }
            if (k < beam->panels[p].nodes) { /* The last interval of a panel ends at its end. */
                copy(n, sums, beam->S + node++ * n);
            }
        }
    }
    for (int k = 0; k < n; k++) {
        beam->rates[k] = 1.0 / (total / beam->youngs_modulus * (2 * k + 1));
    }
}

static void set_stretch(Beam *beam, const Fine *fine, const Section *sections) {
    double length = 0.0, flexibility = 0.0, elongation = 0.0;
    for (int i = 0; i < fine->count; i++) {
        length += fine->ds[i];
        flexibility += fine->ds[i] / area_of(fine->sections[i]);
    }
    for (int i = 0; i < beam->nodes; i++) {
        elongation += modulus(beam->whole[i]) / area_of(sections[i]);
    }
    for (int i = 0; i < beam->nodes; i++) {
        beam->strains[i] = length / area_of(sections[i]) / elongation;
    }
    beam->axial_rate = length * length / (flexibility / beam->youngs_modulus);
}

/* --- masses and positions --------------------------------------------------------------------- */

/* Change the steps dz/dx (N,) at the nodes by the least amount, weighted by |dz|, with which the
 * quadrature of dz, S_0 dz and S_1 dz gives the moments (MOMENTS,), which are overwritten. */
static void correct_steps(const Beam *beam, const double *weights, Complex *moments,
                          Complex *steps) {
    double gram[MOMENTS * MOMENTS] = {0.0}, B[MOMENTS] = {1.0}, re[MOMENTS], im[MOMENTS];
    for (int i = 0; i < beam->nodes; i++) {
        double size = weights[i] * modulus(steps[i]);
        copy(MOMENTS - 1, beam->S + i * (beam->order + 1), B + 1);
        for (int k = 0; k < MOMENTS; k++) {
            moments[k] = minus(moments[k], scaled(weights[i] * B[k], steps[i]));
            add_scaled(MOMENTS, size * B[k], B, gram + k * MOMENTS);
        }
    }
    for (int k = 0; k < MOMENTS; k++) {
        re[k] = moments[k].re;
        im[k] = moments[k].im;
    }
    cholesky(MOMENTS, gram);
    forward(MOMENTS, gram, re);
    backward(MOMENTS, gram, re);
    forward(MOMENTS, gram, im);
    backward(MOMENTS, gram, im);
    for (int i = 0; i < beam->nodes; i++) {
        double size = modulus(steps[i]);
        copy(MOMENTS - 1, beam->S + i * (beam->order + 1), B + 1);
        Complex change = {dot(MOMENTS, B, re), dot(MOMENTS, B, im)};
        steps[i] = plus(steps[i], scaled(size, change));
    }
}

/* Set the masses, the radii of gyration, and the lengths for the end and for the nodes. */
static void set_nodes(Beam *beam, const Section *sections, const double *x, const double *weights,
                      Complex *moments, Scratch scratch) {
    int N = beam->nodes, first = 0;
    Complex *steps = take_complex(&scratch, N, 1), factor = direction_factor(beam->line);
    double *lengths = take(&scratch, (size_t)N);
    for (int i = 0; i < N; i++) {
        double area = area_of(sections[i]);
        beam->masses[i] = beam->density * area * (weights[i] * arc(beam, sections[i]));
        beam->radii[i] = 0.5 * sections[i].thickness / square_root(3.0);
        Complex along = product(tangent(beam->line, sections[i].v), factor);
        steps[i] = scaled(sections[i].dv, along);
    }
    correct_steps(beam, weights, moments, steps);
    for (int i = 0; i < N; i++) {
        beam->whole[i] = scaled(weights[i], steps[i]);
    }
    for (int p = 0; p < beam->panel_count; p++) {
        int nodes = beam->panels[p].nodes;
        for (int i = first; i < first + nodes; i++) {
            interpolation(nodes, x[i], lengths);
            for (int m = 0; m < N; m++) {
                double length = m < first || m >= first + nodes ? 0.0 : lengths[m - first];
                Complex own = scaled(length, steps[m]);
                beam->A[i * N + m] = m < first ? beam->whole[m] : own;
            }
        }
        first += nodes;
    }
}

/* --- cuts ------------------------------------------------------------------------------------- */

static void add_cut(Beam *beam, Section *sections, const Panel *panel, double x, double rank) {
    Cut *cut = &beam->cuts[beam->cut_count];
    sections[beam->cut_count++] = section_at(panel, x);
    cut->rank = rank;
    factors_at(panel, x, &cut->pulled, &cut->bent);
}

/* Set the ranks of the cuts and their sections.  x (N,) are the nodes. */
static void collect_cuts(Beam *beam, const double *x, Section *sections) {
    int i = 0, last = beam->panel_count - 1;
    beam->cut_count = beam->smooth = beam->smooth_count = 0;
    add_cut(beam, sections, &beam->panels[0], -1.0, -1.0);
    for (int p = 0; p <= last; p++) {
        const Panel *panel = &beam->panels[p];
        double waist = 2.0; /* beyond the panel */
        bool ahead = waist_at(panel, &waist);
        if (!panel->round && panel->nodes >= SUMMIT_NODES_MIN) {
            beam->smooth = beam->cut_count;
            beam->smooth_count = panel->nodes;
        }
        for (int k = 0; k <= panel->nodes; k++) {
            if (ahead && (k == panel->nodes || x[i] > waist)) {
                add_cut(beam, sections, panel, waist, i - 0.5);
                ahead = false;
            }
            if (k < panel->nodes) {
                add_cut(beam, sections, panel, x[i], i);
                i++;
            }
        }
    }
    add_cut(beam, sections, &beam->panels[last], 1.0, i);
}

/* Compute the arc lengths (N,) from the start to the nodes; return that to the end [m]. */
static double arc_lengths(const Beam *beam, const Fine *fine, double *places) {
    double length = 0.0;
    int i = 0, node = 0;
    for (int p = 0; p < beam->panel_count; p++) {
        for (int k = 0; k <= beam->panels[p].nodes; k++) {
            for (int q = 0; q < FINE_POINTS; q++) {
                length += fine->ds[i++];
            }
            if (k < beam->panels[p].nodes) {
                places[node++] = length;
            }
        }
    }
    return length;
}

/* Set the cuts.  A beam with waists is straight: v is the arc length. */
static void set_cuts(Beam *beam, const Fine *fine, const Section *sections, Scratch scratch) {
    double *places = take(&scratch, (size_t)beam->nodes);
    Complex factor = direction_factor(beam->line);
    double length = arc_lengths(beam, fine, places);
    for (int k = 0; k < beam->cut_count; k++) {
        Cut *cut = &beam->cuts[k];
        int node = (int)cut->rank;
        Complex along = product(tangent(beam->line, sections[k].v), factor);
        bool at_node = cut->rank == node && node >= 0 && node < beam->nodes;
        cut->position = at_node ? places[node] : sections[k].v;
        cut->tangent = scaled(1.0 / modulus(along), along);
        double area = area_of(sections[k]);
        cut->area = area / cut->pulled;
        cut->modulus = area * sections[k].thickness / 6 / cut->bent;
    }
    beam->cuts[beam->cut_count - 1].position = length;
}

static void take_arrays(Beam *beam, Scratch *scratch) {
    size_t N = (size_t)beam->nodes;
    beam->S = take_matrix(scratch, beam->nodes, beam->order + 1);
    beam->A = take_complex(scratch, beam->nodes, beam->nodes);
    beam->whole = take_complex(scratch, beam->nodes, 1);
    beam->masses = take(scratch, N);
    beam->radii = take(scratch, N);
    beam->strains = take(scratch, N);
    beam->rates = take(scratch, (size_t)beam->order + 1);
    beam->cuts = (Cut *)(void *)take(scratch, (N + CUTS_BESIDE_NODES) * CUT_DOUBLES);
    beam->moments = take_matrix(scratch, beam->nodes + CUTS_BESIDE_NODES, beam->order + 1);
}

PRBM void set_beam(Beam *beam, Scratch *scratch) {
    take_arrays(beam, scratch);
    Scratch inner = *scratch;
    int N = beam->nodes, i = 0;
    double *x = take(&inner, (size_t)N), *weights = take(&inner, (size_t)N);
    Section *sections = take_sections(&inner, N);
    for (int p = 0; p < beam->panel_count; p++) {
        gauss(beam->panels[p].nodes, x + i, weights + i);
        for (int k = 0; k < beam->panels[p].nodes; k++, i++) {
            sections[i] = section_at(&beam->panels[p], x[i]);
        }
    }
    Fine fine = fine_points(beam, &inner);
    Section *cuts = take_sections(&inner, N + CUTS_BESIDE_NODES);
    Complex *moments = take_complex(&inner, MOMENTS, 1);
    collect_cuts(beam, x, cuts);
    set_cuts(beam, &fine, cuts, inner);
    set_bending(beam, &fine, cuts, moments, inner);
    set_nodes(beam, sections, x, weights, moments, inner);
    set_stretch(beam, &fine, sections);
}
