/* The constant arrays of an assembled mechanism, and the kinematics of its arms. */
#ifndef PRBM_SYSTEM_H
#define PRBM_SYSTEM_H

#include "core/mechanism.h"

enum { NOWHERE = -2, FIXED = -1 }; /* coordinates of a body not reached yet, of the ground */

/* Where a point of a body is, z = c + A E; its coordinate, and where it is drawn. */
typedef struct {
    int j;
    Complex c, drawn;
    Complex *A; /* (n,) */
} BodyFrame;

/* A point of the mechanism, z = c + A E; as the origin of a body: with its coordinate and where it
 * is drawn. */
typedef struct {
    Complex c, drawn;
    Complex *A; /* (n,) */
    int j;
    bool moves;
} Place;

/* A spring between two coordinates, n: the ground. */
typedef struct {
    double rate; /* N m/rad, N m */
    int a, b;
} Spring;

/* The mass matrix consists of dense blocks along its diagonal: the links of a flexure that closes a
 * loop, say, have no mass in common with the others. */
typedef struct {
    int start, size;
} Block;

/* The constant arrays of a mechanism, as in the twin; n coordinates, r loop rows, p mass points,
 * s stops, f friction points, b bodies.  Columns of A and of the rows are zero at stretches: see
 * spread.  Vectors over the coordinates are padded to an even length where that is said. */
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
    int *on;                  /* (s,) the coordinate of what a wall is fixed to, or FIXED */
    Complex *rubs, *lifts;    /* (f, n) */
    double *lifts_c;          /* (f,) */
    Complex *release;         /* (n,) */
    double release_c;
    BodyFrame *bodies;        /* (b,) */
    BodyFrame *pushed;        /* where forces act */
    BodyFrame *probes;        /* points that are watched */
    Place *origins;           /* (b + 1,): the ground's first */
    int stretch_count;
    const int *stretches;     /* coordinates that are stretches */
    int spring_count;
    Spring *spring;           /* what K is made of */
    int block_count;
    Block *blocks;            /* of M */
    Complex *coupling;        /* of H, these blocks, one behind the other */
    double *own;              /* (n,) the diagonal of M */
    double *straight;         /* (even,) q0 */
    double *calculated;       /* gamma0 of the flexure types of several pivots */
    Complex anchor, gravity;
    double length;
} System;

PRBM void system_place(System *system, const Mechanism *mechanism, Memory *memory);
PRBM int arm_of(const System *system, int j);
/* e (n,): the arms exp(s + i theta), and -i times that for stretches. */
PRBM void directions(const System *system, const double *q, Complex *e);
/* w (n,): the complex rates theta' - i s' of the arms, zero for stretches. */
PRBM void turning(const System *system, const double *v, Complex *w);
/* The displacement from the straight shape and the velocity of a point. */
PRBM void motion(const System *system, const BodyFrame *frame, const Complex *e, const double *v,
                 Complex *displacement, Complex *velocity);
/* Rows (r, n) with the column of each arm repeated for its stretch; rows may be B. */
PRBM void spread(const System *system, int r, const Complex *B, Complex *rows);
PRBM void stretch(const System *system, const double *q, Complex *e);

#endif
