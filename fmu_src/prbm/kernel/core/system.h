/* The constant arrays of an assembled mechanism, and the kinematics of its arms. */
#ifndef PRBM_SYSTEM_H
#define PRBM_SYSTEM_H

#include "core/mechanism.h"

/* Values in place of the coordinate of a body: not yet placed by the assembly, or the ground. */
enum { NOWHERE = -2, FIXED = -1 };

/* A point of a body, z = c + A E, with the coordinate of the body and the drawn position. */
typedef struct {
    int j;
    Complex c, drawn;
    Complex *A; /* (n,) */
} BodyFrame;

/* A point of the mechanism, z = c + A E.  The origin of a body also has the coordinate j of the
 * body and the drawn position. */
typedef struct {
    Complex c, drawn;
    Complex *A; /* (n,) */
    int j;
    bool moves;
} Place;

/* A spring between two coordinates; n is the ground. */
typedef struct {
    double rate; /* N m/rad, N m */
    int a, b;
} Spring;

/* A dense block on the diagonal of the mass matrix, for example that of the links of a flexure that
 * closes a loop. */
typedef struct {
    int start, size;
} Block;

/* The constant arrays of a mechanism, as in the twin.  There are n coordinates, r loop rows, p mass
 * points, s stops, f friction points and b bodies.  Columns of A and of the rows are zero at
 * stretches, see spread.  Vectors with the shape (even,) are padded to an even length. */
typedef struct {
    const Mechanism *mechanism;
    const double *values;
    int n, even, r, p, s, f, b;
    double *q0, *J, *K;       /* (n,), (n,), (n, n) */
    Complex *e0;              /* (n,) directions of the straight shape */
    Complex *H, *A, *c;       /* (n, n), (p, n), (p,) */
    double *m;                /* (p,) */
    Complex *S;               /* (n,) first mass moments */
    Complex *loops;           /* (r, n) */
    double *loops_c;          /* (r,) */
    Complex *gaps, *slides;   /* (s, n) */
    double *gaps_c;           /* (s,) */
    Complex *gaps_z, *slides_z; /* (s,) */
    int *on;                  /* (s,) coordinate of the body that carries a wall, or FIXED */
    Complex *rubs, *lifts;    /* (f, n) */
    double *lifts_c;          /* (f,) */
    BodyFrame released;       /* the released point */
    Complex *release;         /* (n,) */
    double release_c;
    BodyFrame *bodies;        /* (b,) */
    BodyFrame *pushed;        /* points of the forces */
    BodyFrame *probes;        /* points of the probes */
    Place *origins;           /* (b + 1,), the ground's first */
    int stretch_count;
    const int *stretches;     /* coordinates that are stretches */
    int spring_count;
    Spring *spring;           /* the springs whose rates make up K */
    int block_count;
    Block *blocks;            /* of M */
    Complex *coupling;        /* the blocks of H, one after the other */
    double *own;              /* (n,) the diagonal of M */
    double *straight;         /* (even,) q0 */
    double *calculated;       /* gamma0 of the flexure types with several pivots */
    Complex anchor, gravity;
    double length;
} System;

PRBM void system_place(System *system, const Mechanism *mechanism, Memory *memory);
/* Return the index of the arm that the coordinate j turns or stretches. */
PRBM int arm_of(const System *system, int j);
/* Compute e (n,): the arms exp(s + i theta), and -i times the arm for stretches. */
PRBM void directions(const System *system, const double *q, Complex *e);
/* Compute w (n,): the complex rates theta' - i s' of the arms, zero for stretches. */
PRBM void turning(const System *system, const double *v, Complex *w);
/* Compute the displacement of a point from the straight shape, and its velocity. */
PRBM void motion(const System *system, const BodyFrame *frame, const Complex *e, const double *v,
                 Complex *displacement, Complex *velocity);
/* Copy B (r, n) to rows, and repeat the column of each arm for its stretch.  rows may be B. */
PRBM void spread(const System *system, int r, const Complex *B, Complex *rows);
/* Replace the unit vectors e (n,) by the directions of the coordinates. */
PRBM void stretch(const System *system, const double *q, Complex *e);

#endif
