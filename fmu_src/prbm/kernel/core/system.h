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

/* Torsion between the bodies with the coordinates a and b: stiffness [N m/rad], coefficient of viscous
 * damping [N m s/rad] and rotation of b relative to a without a moment [rad]. */
typedef struct {
    double stiffness, damping, free_angle;
    int a, b; /* FIXED: the ground */
} Torsion;

/* The law of a coil spring: stiffness [N/m], coefficient of the cube of the elongation [N/m^3], damping
 * [N s/m], its length without a force and as drawn [m], and the sign of its forces if it acts on one side; 0:
 * both. */
typedef struct {
    double stiffness, cubic_stiffness, damping, free_length, drawn_length;
    int side;
} SpringLaw;

/* The rows of a guide among those of the loops: across the line and, if the body keeps its angle, of the
 * sine of its angle times the size, otherwise FIXED.  normal: the unit vector to the left of the line
 * as drawn. */
typedef struct {
    int across, turn;
    Complex normal;
} GuideRows;

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
 * closes a loop.  For a guide on two beams, split is the row of the body: the rows before it are zero
 * in the columns behind it.  Otherwise it is 0. */
typedef struct {
    int start, size, split;
} Block;

/* Branches with code of their own: beams with LEAF_COORDINATES, as clamped ones of the order 3, without
 * stretch, with 5 or 6 nodes, alone or with the body that they reach, whose rotation is their last
 * coordinate.  Of the masses of all pairs of these coordinates, the last ones are the body's. */
typedef enum { ANY_BRANCH, LEAF_5, LEAF_5_BODY, LEAF_6, LEAF_6_BODY } BranchCode;
enum { LEAF_COORDINATES = 4, LEAF_MASSES = 10, LEAF_BODY_MASSES = 4 };

/* What a step of the assembly adds: the directions of a flexure and of the body that it reaches,
 * behind a root on another branch or on the ground. */
typedef struct {
    int step;              /* of the assembly */
    int start, size, even; /* The directions: the first, their number, its padded length. */
    int count;             /* The number of coordinates that they depend on. */
    int *coordinate;       /* (count,) in ascending order */
    double *change;        /* (count, even) changes of the directions with these coordinates */
    Parts H;               /* (size, even) below the diagonal, and zero elsewhere */
    Parts S;               /* (even,) first moments of mass of what moves with the directions */
    int real;              /* The number of rows of H, the first ones, that are real. */
    bool identity;         /* Whether the directions are the coordinates. */
    BranchCode code;       /* The code that is compiled for it. */
    int *own;              /* (count (count + 1) / 2,) indices of the masses of the coordinates */
    int pairs;             /* The padded number of pairs of directions. */
    double *products;      /* (masses, pairs) changes of each mass with that of each pair; for leaves
                            * (pairs, masses) without padding between the pairs */
    int parent;            /* The branch that carries the root; FIXED: the ground. */
    Parts lever;           /* (even of the parent,) displacement of the root with its directions */
    int reach, *path;      /* The coordinates that move the root. */
    int *slot;             /* (count of the parent,) their indices in the path */
    int *coupled;          /* (reach, count) indices of the masses of path and coordinates */
    int *both;             /* (reach,) index of the same coordinate among those of the branch */
    int root;              /* Index of the motion of the root among those of all branches. */
} Branch;

/* A row of the factor U of the mass matrix: its element in column j is U[begin + j], and it has none
 * behind the column last. */
typedef struct {
    int begin, last;
} FactorRow;

/* The constant arrays of a mechanism, as in the twin.  There are n coordinates, d directions, r
 * loop rows, p mass points, s stops, f friction points and guides with friction, and b bodies.
 * Columns of A and of the rows are zero at stretches, see repeat_columns.  Vectors with the shape
 * (even,) or (wide,) have n or d elements, and are padded to an even length. */
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
    Complex *loops;           /* (r, d) loop closures, then guides */
    double *loops_c;          /* (r,) */
    Complex *loops_z;         /* (r,) */
    int *loops_on;            /* (r,) direction of the body that carries a guide, or FIXED */
    GuideRows *guided;        /* (guides,) */
    int tied;                 /* Rows before those of guides that only bodies that float move. */
    int placed_count;         /* Coordinates that no balance determines: those of the mechanism, or, */
    const int *placed;        /* where a motion begins, of all bodies that float. */
    int torsion_count;
    Torsion *torsions;        /* of joints */
    int coil_count;
    Complex *spans, *spans_c; /* (coils, d), (coils,) vectors from start to end of the springs */
    SpringLaw *laws;          /* (coils,) */
    double *stiffness;        /* (n, n) of all elements as drawn, without negative parts: K, if there
                               * are flexures only */
    Complex *gaps, *slides;   /* (s, d) */
    double *gaps_c;           /* (s,) */
    Complex *gaps_z, *slides_z; /* (s,) */
    int *on;                  /* (s,) direction of the body that carries a wall, or FIXED */
    Complex *rubs, *rubs_z;   /* (f, d), (f,) along friction points, then along guides with friction */
    int *rubs_on;             /* (f,) direction of the body that carries a guide, or FIXED */
    int *normals;             /* (f,) row of a guide, whose multiplier is the normal force, or FIXED */
    Complex *lifts;           /* (points, d) */
    double *lifts_c;          /* (points,) */
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
    int shift_count;
    const int *shifts;        /* displacements of arms that float, along x and y in turn */
    int corner_count;
    Complex *corners, *corners_c; /* (corners, d), (corners,): flexures, for drawings */
    int spring_count;
    Spring *spring;           /* the springs between two coordinates of flexures */
    double *grounded;         /* (even,) rates of the springs between a coordinate and the ground;
                               * K is the sum of both */
    int block_count;
    Block *blocks;            /* of the mass matrix of the directions */
    int branch_count;         /* The branches, if mapped. */
    Branch *branches;
    int *branch_of;           /* (b + 1,) the branches of the bodies */
    Memory branch_memory;     /* of their arrays */
    size_t mass_size;         /* The number of elements of all mass blocks. */
    double *constant_mass;    /* Their constant part, if mapped. */
    int mass_block_count;
    Block *mass_blocks;       /* of M: the same, unless mapped */
    int *last;                /* (n,) the last columns of the rows of M that may not be zero, counted
                               * in their blocks */
    FactorRow *factor_rows;   /* (n,) */
    Complex *coupling;        /* the blocks of H, one after the other */
    double *block;            /* (wide, wide) working memory of all evaluations, one at a time */
    Parts coupling_parts;     /* their upper triangles, and zero elsewhere */
    double *own;              /* (d,) the diagonal of the mass matrix of the directions */
    double *straight;         /* (even,) rest */
    double *calculated;       /* gamma0 of the flexure types with several pivots */
    Complex anchor, gravity;
    int assembly;             /* the number of assemblies so far */
    double length;
    bool definite;            /* M is not singular in any configuration; false if mapped */
    double least_mobility;    /* of the shortest row that is not round-off [1/kg] */
} System;

/* Return whether directions have no arm of their own: stretches and displacements. */
PRBM bool has_shared_arms(const System *system);
/* Return the arm that a direction turns, stretches or displaces. */
PRBM int arm_of(const System *system, int j);
/* Return whether a direction is a displacement of an arm that floats. */
PRBM bool is_shift(const System *system, int j);
/* Return whether a direction stands for an arm that floats. */
PRBM bool is_float(const System *system, int j);
/* Return direction j of coordinates x (n,), or its rate if x are rates. */
PRBM double direction_of(const System *system, const double *x, int j);
/* Add x times the change of direction j with the coordinates to sum (n,). */
PRBM void to_coordinates(const System *system, int j, double x, double *sum);
/* Add x times the changes of the directions i and j with the coordinates to sum (n, n). */
PRBM void both_to_coordinates(const System *system, int i, int j, double x, double *sum);
/* Return the coordinate that is the direction of a body or a link. */
PRBM int angle_of(const System *system, int j);
/* Return what the variable of a coordinate is for each unit of the coordinate: the size for a
 * displacement [m], otherwise 1. */
PRBM double coordinate_unit(const System *system, int j);
/* Compute e (d,): the arms exp(s + i theta), and -i times the arm for stretches.  The arms that float
 * are displacements u_x + i u_y, for which e is -i and 1. */
PRBM void directions(const System *system, const double *q, Complex *e);
/* Compute w (d,): the complex rates theta' - i s' of the arms, zero for stretches, displacements and
 * arms that float. */
PRBM void turning(const System *system, const double *v, Complex *w);
/* Compute the velocities i p (d,) of the arms that float; others do not change.  Accelerations a in
 * place of v give second derivatives. */
PRBM void float_velocities(const System *system, const double *v, Complex *velocity);
/* Compute p (d,) of the arms, whose velocities are E' = i p. */
PRBM void swings(const System *system, const Complex *e, const double *v, Complex *p);
/* Compute the displacement of a point from the straight shape, and its velocity. */
PRBM void motion(const System *system, const BodyFrame *frame, const Complex *e, const double *v,
                 Complex *displacement, Complex *velocity);
/* Copy B (r, d) to rows, and repeat the column of each arm for its stretch or displacements.  rows
 * may be B. */
PRBM void repeat_columns(const System *system, int r, const Complex *B, Complex *rows);
/* Replace the unit vectors e by the arms, and by what belongs to stretches and displacements, see
 * directions.  theta (d,) are the directions. */
PRBM void stretch(const System *system, const double *theta, Complex *e);
/* Compute the mass matrix M (n, n). */
PRBM void mass_matrix(const System *system, const Complex *e, double *M, Scratch scratch);

#endif
