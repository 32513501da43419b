/* The section and the drawn line of a beam along its length: the twin of mechanics/profile.py. */
#include <math.h>

#include "core/profile.h"

static double hyperbolic_sine(double x) {
    double e = exponential(x);
    return 0.5 * (e - 1.0 / e);
}

static double hyperbolic_cosine(double x) {
    double e = exponential(x);
    return 0.5 * (e + 1.0 / e);
}

static double inverse_sine(double x) {
    return phase(complex_of(square_root(1.0 - x * x), x));
}

static double inverse_cosine(double x) {
    return phase(complex_of(x, square_root(1.0 - x * x)));
}

static double inverse_hyperbolic_sine(double x) {
    double root = square_root(1.0 + x * x);
    return x < 0.0 ? -natural_log(root - x) : natural_log(root + x);
}

/* Set tau at the start and the end of a round panel; return the factor c w. */
static double round_range(const Panel *panel, double *first, double *last) {
    double ratio = panel->thickness[0] / (4.0 * panel->axes[1]);
    double pole = 2.0 * inverse_hyperbolic_sine(square_root(ratio));
    double scale = NOTCH_PEAK_FACTOR * pole;
    *first = inverse_hyperbolic_sine(panel->angles[0] / scale);
    *last = inverse_hyperbolic_sine(panel->angles[1] / scale);
    return scale;
}

static double waist_of(const Panel *panel) {
    double first, last;
    round_range(panel, &first, &last);
    return -(first + last) / (last - first);
}

PRBM bool waist_at(const Panel *panel, double *x) {
    if (!panel->round) {
        return false;
    }
    *x = waist_of(panel);
    return *x != 0.0 || panel->nodes % 2 == 0;
}

PRBM void concentration(double thickness, double radius, double *pulled, double *bent) {
    double x = 0.5 * thickness / radius, root = square_root(x);
    double angle = phase(complex_of(1.0, root));
    *pulled = 2.0 * (x + 1.0) * root / ((x + 1.0) * angle + root);
    if (x < CONCENTRATION_SERIES_MAX) {
        *bent = 1.0 + 2.0 * x / 5;
    } else {
        *bent = 4.0 * x * root / (3.0 * (root + (x - 1.0) * angle));
    }
}

PRBM void factors_at(const Panel *panel, double x, double *pulled, double *bent) {
    *pulled = *bent = 1.0;
    if (panel->round && fabs(x - waist_of(panel)) < WAIST_ATOL) {
        concentration(panel->thickness[0], panel->axes[0] * panel->axes[0] / panel->axes[1], pulled,
                      bent);
    }
}

static Section round_section(const Panel *panel, double x) {
    double a = panel->axes[0], b = panel->axes[1], h = panel->thickness[0], first, last;
    double scale = round_range(panel, &first, &last);
    double tau = first + 0.5 * (last - first) * (1.0 + x);
    double beta = scale * hyperbolic_sine(tau), half = 0.5 * beta;
    Complex whole, halved;
    unit_vectors(1, &beta, &whole);
    unit_vectors(1, &half, &halved);
    Section result = {panel->start + a * whole.im,
                      a * whole.re * scale * hyperbolic_cosine(tau) * 0.5 * (last - first),
                      h + 4.0 * b * halved.im * halved.im, panel->width[0]};
    return result;
}

PRBM Section section_at(const Panel *panel, double x) {
    if (panel->round) {
        return round_section(panel, x);
    }
    double part = 0.5 * (1.0 + x);
    const double *h = panel->thickness, *b = panel->width;
    Section result = {panel->start + panel->length * part, 0.5 * panel->length,
                      h[0] + (h[1] - h[0]) * part, b[0] + (b[1] - b[0]) * part};
    return result;
}

PRBM Panel straight_panel(int nodes, double start, double length, double thickness, double width) {
    Panel panel = {false, nodes, start, length, {thickness, thickness}, {width, width},
                   {0.0, 0.0}, {0.0, 0.0}};
    return panel;
}

static Panel round_panel(int nodes, double waist, const Notch *notch, double first, double last) {
    Panel panel = straight_panel(nodes, waist, 0.0, notch->thickness, notch->width);
    panel.round = true;
    panel.axes[0] = notch->along;
    panel.axes[1] = notch->across;
    panel.angles[0] = first;
    panel.angles[1] = last;
    return panel;
}

PRBM double notch_angle(const Notch *notch) {
    double depth = 0.5 * (notch->end_thickness - notch->thickness);
    return inverse_cosine(greater(1.0 - depth / notch->across, 0.0));
}

PRBM double notch_length(const Notch *notch) {
    double angle = notch_angle(notch);
    Complex edge;
    unit_vectors(1, &angle, &edge);
    return 2.0 * notch->along * edge.im + (notch->waisted ? notch->waist_length : 0.0);
}

PRBM bool notch_panels(const char *name, const Notch *notch, double L, int nodes, Panel *panels,
                       Problem *problem) {
    double h = notch->thickness, H = notch->end_thickness, width = notch->width;
    if (!(h < H)) {
        return fail(problem,
                    "flexure %s: the thickness outside its notch, %g m, must be above the "
                    "thickness of its waist, %g m: increase end_thickness",
                    name, H, h);
    }
    double length = notch_length(notch), angle = notch_angle(notch);
    if (!(length <= L * (1.0 + NOTCH_LENGTH_RTOL))) {
        return fail(problem,
                    "flexure %s: its notch of the length %g m is longer than the flexure, %g m: "
                    "reduce notch_radius or waist_length, or move the ends apart",
                    name, length, L);
    }
    double rest = greater(0.5 * (L - length), 0.0), waist = notch->waist_length;
    Panel *next = panels;
    *next++ = straight_panel(THICK_NODES, 0.0, rest, H, width);
    if (notch->waisted) {
        double start = 0.5 * (L - waist), end = 0.5 * (L + waist);
        *next++ = round_panel(FILLET_NODES, start, notch, -angle, 0.0);
        *next++ = straight_panel(nodes, start, waist, h, width);
        *next++ = round_panel(FILLET_NODES, end, notch, 0.0, angle);
    } else {
        *next++ = round_panel(nodes, 0.5 * L, notch, -angle, angle);
    }
    *next = straight_panel(THICK_NODES, L - rest, rest, H, width);
    return true;
}

PRBM double line_length(Line line) {
    double half = 0.5 * line.curvature * line.chord;
    if (half != 0.0) {
        return line.chord * inverse_sine(half) / half;
    }
    return square_root(line.chord * line.chord - line.rise * line.rise);
}

PRBM Complex tangent(Line line, double v) {
    double L = line_length(line);
    Complex e;
    if (line.curvature != 0.0) {
        double angle = line.curvature * (v - 0.5 * L);
        unit_vectors(1, &angle, &e);
        return e;
    }
    double angle = HALF_TURN / L * v;
    unit_vectors(1, &angle, &e);
    return complex_of(1.0, 0.5 * HALF_TURN * line.rise / L * e.im);
}

PRBM Complex position(Line line, double v) {
    double L = line_length(line);
    Complex e;
    if (line.curvature != 0.0) {
        double half = 0.5 * line.curvature * v, turned = half - 0.5 * line.curvature * L;
        unit_vectors(1, &half, &e);
        double chord = e.im / (0.5 * line.curvature);
        unit_vectors(1, &turned, &e);
        return scaled(chord, e);
    }
    double angle = 0.5 * HALF_TURN / L * v;
    unit_vectors(1, &angle, &e);
    return complex_of(v, line.rise * (e.im * e.im));
}
