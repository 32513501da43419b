/* The section and the drawn line of a beam along its length, in panels. */
#ifndef PRBM_PROFILE_H
#define PRBM_PROFILE_H

#include "core/memory.h"

#define HALF_TURN 3.141592653589793 /* rad */

/* A section: position and its change with x, thickness and width [m]. */
typedef struct {
    double v, dv, thickness, width;
} Section;

/* A straight panel, or a round one: an arc of an ellipse.  Of a round panel, start is the position
 * of the waist, and the first thickness and width are those of the waist. */
typedef struct {
    bool round;
    int nodes;
    double start, length;         /* [m] */
    double thickness[2], width[2]; /* at the start and the end [m] */
    double axes[2];               /* half axes along and across the flexure [m] */
    double angles[2];             /* angles from the waist at the start and the end [rad] */
} Panel;

/* The dimensions of a notch [m]. */
typedef struct {
    double thickness, width, along, across, end_thickness, waist_length;
    bool waisted; /* It has a waist between fillets. */
} Notch;

/* The line of a beam as drawn: distance of its ends [m], curvature [1/m] and rise [m]. */
typedef struct {
    double chord, curvature, rise;
} Line;

/* Return the section of a panel at x, from -1 to 1. */
PRBM Section section_at(const Panel *panel, double x);
/* Set the point x of the waist of a round panel; false if there is none, or if it is a node. */
PRBM bool waist_at(const Panel *panel, double *x);
/* Compute the factors of the stress at a waist, under a normal force and under a moment [-], from
 * its thickness and the radius of curvature [m]. */
PRBM void concentration(double thickness, double radius, double *pulled, double *bent);
/* Compute these factors at a point x of a panel: 1 except at a waist. */
PRBM void factors_at(const Panel *panel, double x, double *pulled, double *bent);
PRBM Panel straight_panel(int nodes, double start, double length, double thickness, double width);
/* Return the largest angle from the waist, at the edges of a notch [rad]. */
PRBM double notch_angle(const Notch *notch);
/* Return the length of a notch along the flexure [m]. */
PRBM double notch_length(const Notch *notch);
/* Set the panels of a notch in the middle of a flexure of the length L [m]. */
PRBM bool notch_panels(const char *name, const Notch *notch, double L, int nodes, Panel *panels,
                       Problem *problem);
/* Return the range of the positions along a line [m]. */
PRBM double line_length(Line line);
/* Return dz/dv at a position, turned by the same angle everywhere [-]. */
PRBM Complex tangent(Line line, double v);
/* Return the integral of the tangent from the start to a position [m]. */
PRBM Complex position(Line line, double v);

#endif
