/* Collection of the parts of a mechanism. */
#ifndef PRBM_COLLECTION_H
#define PRBM_COLLECTION_H

#include "core/system.h"

/* The bodies at the ends of a step, root first, and the drawn positions of both ends. */
typedef struct {
    int root, far;
    Complex z_start, z_end;
} Span;

PRBM Complex at_point(const System *system, Point point);
/* Add a vector that turns with direction j, or FIXED, to a place. */
PRBM void extend(Place *spot, int j, Complex vector);
PRBM void copy_place(int d, Place *to, const Place *from);
/* Set the place of a point of a body, given by its drawn position. */
PRBM void on_body(const System *system, int body, Complex drawn, Place *result);
PRBM void add_mass(System *system, const Place *spot, double mass);
/* Add a corner of the drawn line of a flexure. */
PRBM void add_corner(System *system, const Place *spot);
PRBM double rod_point(int i);
PRBM void add_rod(System *system, double mass, const Place *start, int j, Complex vector,
                  Place *spare);
/* Add a spring between two coordinates, or a coordinate and the ground, FIXED. */
PRBM void add_spring(System *system, double rate, int a, int b);
PRBM Place new_place(const System *system, Scratch *scratch);
/* Add the loop constraint that two places coincide. */
PRBM void close_loop(System *system, const Place *spot, const Place *other);
/* Set the origin of a body: a place, its drawn position and the direction of the body. */
PRBM void reach(System *system, int body, const Place *spot, Complex drawn, int j);
PRBM Span span_of(const System *system, const Step *step);

#endif
