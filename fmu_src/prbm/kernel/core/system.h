/* The constant arrays of an assembled mechanism, and the kinematics of its arms. */
#ifndef PRBM_SYSTEM_H
#define PRBM_SYSTEM_H

#include "core/mechanism.h"

/* A point of a body, z = c + A E, with the coordinate j and the direction arm of the body, and the
 * drawn position. */
typedef struct {
    int j, arm;
    Complex c, drawn;
    Complex *A; /* (d,) */
} BodyFrame;

/* A point of the mechanism, z = c + A E.  The origin of a body also has the direction j of the body
 * and the drawn position. */
typedef struct {
    Complex c, drawn;
    Complex *A; /* (d,) */
    int j;
    bool moves;
} Place;

/* A spring between two coordinates. */
typedef struct {
    double rate; /* N m/rad, N m */
    int a, b;
} Spring;

/* The index TURNED - j stands for an arm that turns with coordinate j. */
enum { TURNED = -2 };

/* A flexure as a free body between its near end and its far end, as in the twin.  Arrays are in the
 * order from the near end to the far end. */
typedef struct {
    bool forwards;          /* whether the near end is the start of the flexure */
    int order;              /* of the polynomial of a beam; links: 0 */
    int first, count, stub; /* mass points; the last ones, of the stub beyond a closed loop */
    int sections, arm_count;
    int smooth, smooth_count; /* first section from the start, and number, of nodes of a beam */
    double *position, *area, *modulus; /* (sections,) */
    double *ranks, *section_ranks;     /* (count,), (sections,) order along the flexure */
    int *tangents;          /* (sections, 2) directions, FIXED or TURNED - coordinate */
    Complex *drawn;         /* (sections, 2) */
    int *arms;              /* (arm_count,) directions that turn with the ends, or FIXED */
    Complex *levers;        /* (count + 1, arm_count) */
    double *turning;        /* (2, arm_count) */
    int *angles;            /* links: coordinates of the segments; beam: of start, end, first a_k */
    double *rates;          /* links: of the springs; beam: of the rotation between the ends */
    double *moments;        /* (sections, order + 1) polynomials of a beam, from its start */
} FreeBody;

/* A block on the diagonal of the mass matrix, for example that of the links of a flexure that
 * closes a loop.  The rows after the row apart, counted in the block, are zero in the columns
 * before it. */
typedef struct {
    int start, size, apart;
} Block;

/* Blocks whose code is compiled separately: beams of the order 3 between two clamps, with 5 or 6
 * nodes and without stretch.  The last direction of those with a body is the last coordinate, the
 * rotation of the body. */
typedef enum { NO_BEAM, BEAM_5, BEAM_5_BODY, BEAM_6, BEAM_6_BODY } BeamKind;

/* Sizes of these blocks. */
enum {
    BEAM_COORDINATES = 4,
    BEAM_ENTRIES = 10, /* of a symmetric matrix of the coordinates */
    BEAM_PAIRED = 8,   /* the first of them, which are pairs in the rows of the matrix */
    BEAM_BODY = 4,    /* the first of the entries in the row of a body */
    BEAM_DIRECTIONS_MAX = 7,
    BEAM_CHANGES = BEAM_DIRECTIONS_MAX * BEAM_COORDINATES
};

/* A block of the mass matrix of the directions, and its map from the coordinates. */
typedef struct {
    int start, size, even; /* The directions: the first, their number, its padded length. */
    int count;             /* The number of coordinates that they depend on. */
    int *coordinate;       /* (count,) in ascending order */
    double *change;        /* (count, even) changes of the directions with these coordinates */
    Parts H;               /* (size, even) below the diagonal, and zero elsewhere */
    int mass_first, mass_size; /* The mass of the coordinates i and j <= i is at the index
                                * mass_first + i mass_size + j of the mass blocks. */
    BeamKind beam;         /* The members below are used unless it is NO_BEAM. */
    bool together;         /* Whether the coordinates are consecutive. */
    int place[BEAM_ENTRIES];       /* The indices of the masses of the coordinates. */
    double constant[BEAM_ENTRIES]; /* The part of these masses that is constant. */
    double rows[BEAM_CHANGES];     /* (size, BEAM_COORDINATES) change, row by row. */
    double *products;      /* (pairs, BEAM_ENTRIES) their changes with the mass of each pair of
                            * nodes */
} BlockMap;

/* The constant arrays of a mechanism, as in the twin.  There are n coordinates, d directions, r
 * loop rows, p mass points, s stops, f friction points and b bodies.  Columns of A and of the
 * rows are zero at stretches, see spread.  Vectors with the shape (even,) or (wide,) have n or d
 * elements, and are padded to an even length. */
typedef struct {
    const Mechanism *mechanism;
    const double *values;
    int n, even, d, wide, r, p, s, f, b;
    bool mapped;              /* whether the map to the directions is not the identity */
    double *factors;          /* (count,) of the map */
    double *q0, *J, *K;       /* (n,), (d,), (n, n) */
    double *rest;             /* (n,) coordinates at which no spring has a force */
    Complex *e0;              /* (d,) directions of the straight shape */
    Complex *H, *A, *c;       /* (d, d), (p, d), (p,) */
    double *m;                /* (p,) */
    Complex *S;               /* (d,) first mass moments */
    Complex *loops;           /* (r, d) */
    double *loops_c;          /* (r,) */
    Complex *gaps, *slides;   /* (s, d) */
    double *gaps_c;           /* (s,) */
    Complex *gaps_z, *slides_z; /* (s,) */
    int *on;                  /* (s,) direction of the body that carries a wall, or FIXED */
    Complex *rubs, *lifts;    /* (f, d) */
    double *lifts_c;          /* (f,) */
    BodyFrame released;       /* the released point */
    Complex *release;         /* (d,) */
    double release_c;
    BodyFrame *bodies;        /* (b,) */
    BodyFrame *pushed;        /* points of the forces */
    BodyFrame *probes;        /* points of the probes */
    Place *origins;           /* (b + 1,), the ground's first */
    FreeBody *free_bodies;    /* of all flexures, if the stress of one is an output */
    int *body_masses;         /* (b,) mass points of the bodies, if so */
    int stretch_count;
    const int *stretches;     /* directions that are stretches */
    int corner_count;
    Complex *corners, *corners_c; /* (corners, d), (corners,): flexures, for drawings */
    int spring_count;
    Spring *spring;           /* the springs between two coordinates */
    double *grounded;         /* (even,) rates of the springs between a coordinate and the ground;
                               * K is the sum of both */
    int block_count;
    Block *blocks;            /* of the mass matrix of the directions */
    BlockMap *maps;           /* of the blocks, if mapped */
    int mass_block_count;
    Block *mass_blocks;       /* of M: the same, unless mapped */
    Complex *coupling;        /* the blocks of H, one after the other */
    double *own;              /* (d,) the diagonal of the mass matrix of the directions */
    double *straight;         /* (even,) rest */
    double *calculated;       /* gamma0 of the flexure types with several pivots */
    Complex anchor, gravity;
    int assembly;             /* the number of assemblies so far */
    double length;
    bool definite;            /* M is not singular in any configuration; false if mapped */
    double least_mobility;    /* of the shortest row that is not round-off [1/kg] */
} System;

/* Return the arm that a direction turns or stretches. */
PRBM int arm_of(const System *system, int j);
/* Return direction j of coordinates x (n,), or its rate if x are rates. */
PRBM double direction_of(const System *system, const double *x, int j);
/* Add x times the change of direction j with the coordinates to sum (n,). */
PRBM void pull(const System *system, int j, double x, double *sum);
/* Add x times the changes of the directions i and j with the coordinates to sum (n, n). */
PRBM void pull_both(const System *system, int i, int j, double x, double *sum);
/* Return the coordinate that is the direction of a body or a link. */
PRBM int angle_of(const System *system, int j);
/* Compute e (d,): the arms exp(s + i theta), and -i times the arm for stretches. */
PRBM void directions(const System *system, const double *q, Complex *e);
/* Compute w (d,): the complex rates theta' - i s' of the arms, zero for stretches. */
PRBM void turning(const System *system, const double *v, Complex *w);
/* Compute the displacement of a point from the straight shape, and its velocity. */
PRBM void motion(const System *system, const BodyFrame *frame, const Complex *e, const double *v,
                 Complex *displacement, Complex *velocity);
/* Copy B (r, d) to rows, and repeat the column of each arm for its stretch.  rows may be B. */
PRBM void spread(const System *system, int r, const Complex *B, Complex *rows);
/* Replace the unit vectors e by the arms, and by -i times the arms for stretches.  theta (d,)
 * are the directions. */
PRBM void stretch(const System *system, const double *theta, Complex *e);
/* Compute the mass matrix M (n, n). */
PRBM void mass_matrix(const System *system, const Complex *e, double *M, Scratch *scratch);

#endif
