/* The description of a mechanism, its parameters and the vector of all values. */
#ifndef PRBM_MECHANISM_H
#define PRBM_MECHANISM_H

#include "core/memory.h"

/* Values in place of the direction of a body: not yet placed by the assembly, or the ground. */
enum { NOWHERE = -2, FIXED = -1 };

/* constant + sum(factor * parameter) */
typedef struct {
    double constant;
    int count;
    const int *parameter;
    const double *factor;
} Expression;

typedef struct {
    const char *name, *unit;
    double start, minimum, maximum;
    bool tunable;
} Parameter;

typedef struct {
    Expression x, y;
} Point;

typedef struct {
    const char *name;
    Expression mass, inertia;
    Point centre;
    uint32_t given; /* The bits of the positions and velocities that are given at the start. */
    Expression at_start[GIVEN_COUNT];
} Body;

typedef struct {
    const char *name;
    bool lumped, rate_with_gamma, axial;
    bool stress; /* Whether the stress of the flexures is an output. */
    int pivots; /* Pivots of a cantilever; 0 for a chain. */
    int links;  /* Links of a chain; 0 for a model with coefficients. */
    int order;  /* Order of the bending moment of a beam; 0 for links. */
    int nodes;  /* Nodes of a beam, or of its notch or waist. */
    int profile; /* PROFILE_... */
    uint32_t given; /* The bits of the dimensions that are given. */
    Expression thickness, width, youngs_modulus, density;
    Expression dimensions[DIMENSION_COUNT]; /* of the profile and of the line as drawn */
    const Expression *gamma, *K_theta; /* (pivots,) */
} FlexureType;

/* Two points of different bodies.  Bodies are numbered from 1; the ground has the number GROUND. */
typedef struct {
    int start, end;
    Point start_point, end_point;
} Connection;

typedef struct {
    const char *name;
    int type;
    Connection between;
    int type_at_start, type_at_end; /* CLAMP, PIN or FREE */
} Flexure;

typedef struct {
    const char *name;
    Connection between;
    bool sprung, turned, damped; /* Whether stiffness, free_angle and damping are given. */
    Expression stiffness, free_angle, damping;
} Joint;

/* A coil spring and a damper between two points. */
typedef struct {
    const char *name;
    Connection between;
    bool pretensioned; /* Whether its free length is given. */
    int side;          /* Sign of the forces of a spring that acts on one side; 0: both. */
    int one_sided;     /* Number of such springs before it. */
    Expression stiffness, free_length, cubic_stiffness, damping;
} Coil;

/* A line through the end of a connection and another point of the same body, on which its start
 * stays. */
typedef struct {
    const char *name;
    Connection between; /* from the guided point to a point of the line */
    Point along;        /* Another point of the line. */
    bool keeps_angle;   /* Whether the guided body keeps its angle relative to the line. */
    bool rubs;          /* Whether it has friction. */
    Expression friction;
} Guide;

typedef struct {
    const char *name;
    int body, on; /* The stopped body, and the body or GROUND that carries the wall. */
    Point point;
    double direction; /* deg */
    Expression position, offset, restitution, friction, rest_speed;
    bool compliant;
    Expression stiffness, exponent; /* of a compliant stop */
    int extra; /* Index of the first state of a compliant stop behind the energies. */
} Stop;

typedef struct {
    const char *name;
    int body;
    Point point;
    double direction;
    Expression coefficient, normal_force, normal_stiffness;
} Friction;

typedef struct {
    const char *name;
    int body;
    Point point;
} Force;

typedef struct {
    const char *name;
    int body; /* A body, or GROUND. */
    Point point;
} Probe;

typedef struct {
    int body;
    double direction; /* deg */
    Point point;
    int start, mode; /* START_..., and the number of the mode of START_AMPLITUDE, from 1 */
    Expression amount, velocity;
} Release;

/* A field of a part that is an expression instead of a parameter, with its bounds. */
typedef struct {
    const char *name, *unit;
    Expression expression;
    double minimum, maximum;
} Bound;

typedef struct {
    uint32_t reference;
    int type; /* REAL, INTEGER, BOOLEAN or CLOCK; a clock has the slot of impact_count */
    int slot; /* Index in the vector of all values, see Slots. */
    const char *name;
} Variable;

/* The first slot of each group in the vector of all values. */
typedef struct {
    int parameters, inputs, bodies, stops, springs, guides, base, energies, latched, compliant, links, stretches,
        probes, stresses, frequency, calculated, derivatives, indicators, time, count;
} Slots;

/* The first index of each group of inputs; the forces begin at 0. */
typedef struct {
    int walls, impulses, mobilities, base;
} InputGroups;

/* A step of the assembly: a flexure or joint, from a body that is already placed, or a body that
 * nothing connects to the ground. */
typedef struct {
    const char *name;
    const Connection *between; /* NULL for a free body. */
    const Flexure *flexure;    /* NULL for a joint and a free body. */
    const Joint *joint;        /* NULL for a flexure and a free body. */
    int body;                  /* The free body, counted from 1, or 0. */
    bool backwards;         /* The part is added from its end to its start. */
    bool closes;            /* The part closes a loop: both its bodies are already placed. */
    int first;              /* The first coordinate that the part adds. */
    int first_direction;    /* The first direction that the part adds. */
} Step;

/* A coordinate: an angle or a strain of a flexure, the angle of a body, or the displacement of a free
 * body over the size.  Two of the first three numbers are -1, -1 and 0. */
typedef struct {
    int link;   /* Index among the angles of the flexures, or -1. */
    int strain; /* Index among the strains, or -1. */
    int body;   /* The body, counted from 1, or 0. */
    int axis;   /* Of a displacement: AXIS_X or AXIS_Y, otherwise -1. */
} Coordinate;

enum { AXIS_X, AXIS_Y };
/* The coordinates, directions without an arm of their own, and changes, of a free body. */
enum { PLACED_EACH = 3, SHIFTS_EACH = 2, FREE_CHANGES = 3 };

/* The map from coordinates to directions, row by row: direction j depends on the coordinates with
 * the indices first[j] to first[j + 1] - 1 in the list.  It is the identity unless mapped. */
typedef struct {
    bool mapped;
    int *first, *coordinate; /* (d + 1,), (count,) */
    int count;
} DirectionMap;

typedef struct {
    const char *token, *name;
    int parameter_count, body_count, type_count, flexure_count, joint_count, coil_count, guide_count,
        stop_count, friction_count, force_count, probe_count, ground_count, bound_count, variable_count,
        independent_count, input_count;
    const Parameter *parameters;
    const Body *bodies; /* (body_count,): body k is bodies[k - 1] */
    const FlexureType *types;
    const Flexure *flexures;
    const Joint *joints;
    const Coil *coils;
    const Guide *guides;
    const Stop *stops;
    const Friction *frictions;
    int rubbing_count; /* Friction points, then the guides with friction. */
    const Force *forces;
    const Probe *probes;
    const Point *ground;
    const Bound *bounds;
    const Variable *variables; /* In ascending order of their references. */
    const char *const *input_names;
    const double *input_starts; /* (input_count,) */
    InputGroups input;
    const Step *steps;             /* Flexures, joints, free bodies in the order of the assembly. */
    const Coordinate *coordinates; /* (coordinate_count,) */
    const int *links, *strains;    /* Coordinates that are angles and strains of flexures. */
    const int *floating;           /* Coordinates of bodies without flexures and joints to the ground:
                                    * along x and y, rotation. */
    const int *placed;             /* Those of bodies that springs do not hold, either. */
    const int *arms;               /* (direction_count,) arm that a direction turns, stretches or
                                    * displaces */
    const int *stretches;          /* Directions that are stretches. */
    const int *shifts;             /* Displacements of arms that float, along x and y in turn. */
    DirectionMap map;
    const int *independent; /* Coordinates that are states of model exchange. */
    Release release;
    int gravity[2], tolerance, damping_zeta, damping_beta; /* Indices of parameters. */
    double default_step; /* Step of the default experiment [s]; 0: unknown. */
    /* Sizes of the assembled system. */
    int coordinate_count, direction_count, loop_count, guided_count, given_count, link_count, strain_count, stretch_count,
        shift_count, placed_count, floating_count, step_count, mass_count, spring_count, corner_count;
    int one_sided_count; /* Number of springs that act on one side. */
    int compliant_count; /* Number of compliant stops. */
    int first_extra;     /* 2 n + 2: position of the states of compliant stops in a state. */
    int state_count;     /* Size of a state: 2 n + 2, and 4 of each compliant stop. */
    int stressed_count;  /* Number of flexures whose stress is an output. */
    int longest; /* Largest number of links or nodes of a flexure. */
    size_t beam_size; /* Largest number of doubles that a beam needs. */
    Slots slots;
} Mechanism;

/* The number of the event indicators. */
PRBM int indicator_count(const Mechanism *mechanism);
PRBM bool has_dimension(const FlexureType *kind, int dimension);
/* Whether a flexure has a notch without a waist, which bends like a hinge. */
PRBM bool is_hinge(const FlexureType *kind);
/* The type of a flexure. */
PRBM const FlexureType *kind_of(const Mechanism *mechanism, const Flexure *flexure);
/* Whether the stress of the i-th flexure is an output. */
PRBM bool has_stress(const Mechanism *mechanism, int i);
/* The panels of a notch with a waist. */
enum { PANELS_MAX = 5 };
PRBM int panel_count(const FlexureType *kind);
/* Return the number of nodes in all panels of a beam. */
PRBM int node_count(const FlexureType *kind);
/* Return the number of springs whose phases are states: none, or all if one acts on one side. */
PRBM int phased_coils(const Mechanism *mechanism);
PRBM double evaluate(Expression quantity, const double *values); /* Twin: Affine in mechanism/. */
PRBM bool check_parameter(const Parameter *parameter, double x, Problem *problem);
/* Check all values and the fields that are expressions (Mechanism.values of the twin). */
PRBM bool check_values(const Mechanism *mechanism, const double *values, Problem *problem);
PRBM const Variable *find_variable(const Mechanism *mechanism, uint32_t reference);
PRBM const double *wall_inputs(const Mechanism *mechanism, const double *inputs, int stop);

#endif
