/* The engine in C: the twin of the Python package prbm.
 *
 * Each file here is the twin of the Python module of the same name: the same functions with the
 * same arguments in the same order.  Plain C99; after a simulation is opened nothing is allocated;
 * no global state; of libm only sqrt, fabs, floor, frexp and ldexp, all of which are exact or
 * correctly rounded, so that the same input gives the same bytes on every platform.
 *
 * Matrices are stored row by row.  A function that can fail returns false and leaves a sentence
 * in a Problem.  SI units and radians everywhere; docs/conventions.md has the signs and symbols.
 */
#ifndef PRBM_KERNEL_H
#define PRBM_KERNEL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* All functions are local to the one file that the library is compiled from.  A test that looks
 * at them one by one defines PRBM as nothing. */
#ifndef PRBM
#if defined(__GNUC__)
#define PRBM static __attribute__((unused))
#else
#define PRBM static
#endif
#endif

/* Of a pointer: the only one to its array within the function. */
#if defined(_MSC_VER)
#define ALONE __restrict
#else
#define ALONE restrict
#endif

/* Loops over a part of the mechanism are written once and compiled for each small size. */
#if defined(__GNUC__)
#define SIZED static inline __attribute__((always_inline))
#else
#define SIZED static
#endif
/* What few mechanisms need stays out of the way of what all do. */
#if defined(__GNUC__)
#define RARE static __attribute__((noinline))
#else
#define RARE static
#endif
#if defined(__GNUC__) && !defined(__clang__) /* which needs to be told */
#define UNROLLED _Pragma("GCC unroll 8")
#define UNROLLED_BY_LANES _Pragma("GCC unroll 4")
#else
#define UNROLLED
#define UNROLLED_BY_LANES
#endif
/* Vectors of the compiler: two numbers at a time, with the same operations on each, so that all
 * bits are those of the loops without them (-DPRBM_PLAIN). */
#if defined(__GNUC__) && !defined(PRBM_PLAIN)
#define VECTORS 1
#else
#define VECTORS 0
#endif
/* Whether the compiler knows a length where a function is inlined; loops over unknown ones are
 * compiled once. */
#if defined(__GNUC__)
#define KNOWN(length) __builtin_constant_p(length)
#else
#define KNOWN(length) false
#endif
enum { SMALL = 4 }; /* the largest such size; loops to a constant are the ones that unroll */

/* --- errors and memory ------------------------------------------------------------------------ */

enum { PROBLEM_LENGTH = 640 };

typedef struct {
    char text[PROBLEM_LENGTH];
} Problem;

/* Write a sentence; returns false, so that "return fail(problem, ...)" reads well. */
#if defined(__GNUC__)
PRBM bool fail(Problem *problem, const char *format, ...) __attribute__((format(printf, 2, 3)));
#else
PRBM bool fail(Problem *problem, const char *format, ...);
#endif

/* A block that is laid out once: first with base NULL to count, then to place. */
typedef struct {
    char *base;
    size_t used;
} Memory;

PRBM void *place(Memory *memory, size_t count, size_t size);

/* Working memory for one call: taken in order, given back by setting used to what it was.
 * Asking for more than there is yields the spare block, which is as large as any single request
 * may be, and sets exceeded: results are then worthless, but nothing is overwritten. */
typedef struct {
    double *base, *spare;
    size_t used, size, most;
    bool exceeded;
} Scratch;

PRBM double *take(Scratch *scratch, size_t count);

typedef struct {
    double re, im;
} Complex;

/* Complex numbers with their parts apart, in vectors that are padded with zeros to an even length,
 * so that they are worked on by pairs. */
typedef struct {
    double *re, *im;
} Parts;

PRBM double *take_matrix(Scratch *scratch, int rows, int columns);
PRBM Complex *take_complex(Scratch *scratch, int rows, int columns);
PRBM int *take_integers(Scratch *scratch, int count);

/* --- numbers.c: elementary functions, the same bits on every platform --------------------------- */

PRBM void unit_vectors(int n, const double *q, Complex *e); /* exp(i q), as np.exp(1j * q) */
PRBM double natural_log(double x);                          /* x > 0 */
PRBM double exponential(double x);
PRBM double power(double x, double y);                      /* x^y for x > 0 */
PRBM double phase(Complex z);                               /* as cmath.phase, in (-pi, pi] */
PRBM bool finite_number(double x);
PRBM double largest(int n, const double *x);                /* max |x_i|, 0 for none */
PRBM double greater(double a, double b); /* b unless a > b */
PRBM double lesser(double a, double b);  /* b unless a < b */

/* --- matrix.c: linear algebra ------------------------------------------------------------------- */

PRBM double dot(int n, const double *a, const double *b);
PRBM void copy(int n, const double *from, double *to);
PRBM void zeros(int n, double *x);
PRBM void add_scaled(int n, double a, const double *x, double *y); /* y += a x */
/* LU with partial pivoting, in place; false if a pivot is zero or not a number. */
PRBM bool lu_factor(int n, double *a, int *pivot);
PRBM void lu_solve(int n, const double *a, const int *pivot, double *b);
/* Cholesky L L^T of a symmetric matrix, of which the lower triangle is read and overwritten; the
 * diagonal is left inverted; false if a pivot is not positive. */
PRBM bool cholesky(int n, double *a);
PRBM void forward(int n, const double *a, double *b);  /* b := L^-1 b */
PRBM void backward(int n, const double *a, double *b); /* b := L^-T b */
/* The x of least norm among those that minimise |a x - b|, as np.linalg.lstsq: singular values
 * below rcond times the largest count as zero.  a is (m, n). */
PRBM void least_squares(int m, int n, const double *a, const double *b, double rcond, double *x,
                        Scratch *scratch);
/* Eigenvalues w in rising order and, unless NULL, orthonormal eigenvectors as columns of z, of a
 * symmetric matrix, which is destroyed (cyclic Jacobi). */
PRBM void symmetric_eigen(int n, double *a, double *w, double *z);
/* An orthonormal basis z (n, n - r) of what the rows (r, n), of full rank, send to zero. */
PRBM void null_space(int r, int n, const double *rows, double *z, Scratch *scratch);

/* --- mechanism.c: the tables ---------------------------------------------------------------------- */

enum { GROUND = 0 }; /* bodies are counted from 1 */

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
} Body;

typedef struct {
    const char *name;
    bool lumped, rate_with_gamma, axial;
    int pivots; /* of a cantilever; 0: a chain */
    int links;  /* of a chain; 0: a set of coefficients */
    Expression thickness, width, youngs_modulus, density;
    const Expression *gamma, *K_theta; /* (pivots,) */
} FlexureType;

/* Two points of different bodies, GROUND or 1 ... */
typedef struct {
    int start, end;
    Point start_point, end_point;
} Connection;

enum { CLAMP, PIN, FREE };

typedef struct {
    const char *name;
    int type;
    Connection between;
    int start_end, end_end; /* CLAMP, PIN or FREE */
} Flexure;

typedef struct {
    const char *name;
    Connection between;
} Joint;

typedef struct {
    const char *name;
    int body, on; /* 1 ...; what its wall is fixed to, GROUND or 1 ... */
    Point point;
    double direction; /* deg */
    Expression position, offset, restitution, friction, rest_speed;
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
    int body; /* GROUND or 1 ... */
    Point point;
} Probe;

typedef struct {
    int body;
    double direction;
    Expression displacement, velocity;
} Release;

/* A field of a part that is an expression, with the bounds of the parameter it stands for. */
typedef struct {
    const char *name, *unit;
    Expression expression;
    double minimum, maximum;
} Bound;

enum { REAL, INTEGER, BOOLEAN, CLOCK }; /* a clock has the slot of the impact_count of its stop */

typedef struct {
    uint32_t reference;
    int type; /* REAL, INTEGER, BOOLEAN, CLOCK */
    int slot; /* in the vector of all values, see Slots */
    const char *name;
} Variable;

/* The vector of all values: where each group begins. */
typedef struct {
    int parameters, inputs, bodies, stops, base, energies, latched, links, stretches, probes,
        frequency, calculated, derivatives, indicators, time, count;
} Slots;

enum {
    PER_BODY = 6,    /* x, y, angle, vx, vy, omega */
    PER_STOP = 6,    /* gap, gap_rate, force, point.displacement, point.velocity, point.mobility */
    PER_BASE = 3,    /* force.x, force.y, moment */
    PER_ENERGY = 5,  /* kinetic, elastic, gravitational, dissipated, work */
    PER_LATCHED = 9, /* contact, impact_count, impact_time, approach_speed, rebound_speed, impulse,
                        energy_lost, modal_restitution, impulse_sum */
    LOADS = 3,       /* of a force, and of an impulse: x, y, moment */
    PER_WALL = 2,    /* displacement, velocity */
    AXES = 2,        /* of the base's acceleration: x, y */
    PER_LINK = 2,    /* angle, omega */
    PER_STRETCH = 2, /* strain, strain_rate */
    PER_PROBE = 4,   /* x, y, vx, vy */
    STOP_INDICATORS = 3, /* impact, release, slip; then one slip for each friction point */
};

/* Where the groups of inputs begin; the forces are the first. */
typedef struct {
    int walls, impulses, mobilities, base;
} InputGroups;

/* A part that the assembly walks along, from what is held already. */
typedef struct {
    const char *name;
    const Connection *between;
    const Flexure *flexure; /* NULL: a joint */
    bool backwards;         /* from its end to its start */
    bool closes;            /* a loop: what it leads to is held, too */
    int first;              /* of the coordinates that it adds */
} Step;

/* What a coordinate is: the angle of a link, its stretch, or the angle of a body. */
typedef struct {
    int link, body; /* 0 ... or -1; 1 ... or 0 */
    int arm;        /* whose arm it turns or stretches: its own, or that of a link */
} Coordinate;

typedef struct {
    const char *token, *name;
    int parameter_count, body_count, type_count, flexure_count, joint_count, stop_count,
        friction_count, force_count, probe_count, ground_count, bound_count, variable_count,
        independent_count, input_count;
    const Parameter *parameters;
    const Body *bodies; /* (body_count,): body k is bodies[k - 1] */
    const FlexureType *types;
    const Flexure *flexures;
    const Joint *joints;
    const Stop *stops;
    const Friction *frictions;
    const Force *forces;
    const Probe *probes;
    const Point *ground;
    const Bound *bounds;
    const Variable *variables; /* in rising order of their references */
    const char *const *input_names;
    const double *input_starts; /* (input_count,) */
    InputGroups input;
    const Step *steps;             /* flexures and joints in the order of the assembly */
    const Coordinate *coordinates; /* (coordinate_count,) */
    const int *links, *stretches;  /* coordinates that are angles and stretches of links */
    const int *independent; /* coordinates that are states, with their rates, in model exchange */
    Release release;
    int gravity[2], tolerance, damping_zeta, damping_beta; /* parameters */
    /* of the assembled system */
    int coordinate_count, loop_count, link_count, stretch_count, mass_count, spring_count;
    int longest; /* links of a flexure at most */
    Slots slots;
} Mechanism;

/* Read tables that anybody may have tampered with; NULL and a sentence if they are not sound.
 * The result is one block and keeps nothing of the bytes. */
PRBM Mechanism *mechanism_open(const unsigned char *bytes, size_t size, Problem *problem);
PRBM void mechanism_close(Mechanism *mechanism);
PRBM double evaluate(Expression quantity, const double *values); /* twin: mechanism.Affine */
PRBM bool check_parameter(const Parameter *parameter, double x, Problem *problem);
/* Check all values and the fields that are expressions (Mechanism.values of the twin). */
PRBM bool check_values(const Mechanism *mechanism, const double *values, Problem *problem);
PRBM const Variable *find_variable(const Mechanism *mechanism, uint32_t reference);

/* --- flexure.c ------------------------------------------------------------------------------------ */

/* A flexure cut into segments: n + 2 lengths and rods, n + 1 rates and lumps, n axial. */
typedef struct {
    int n;
    double *lengths, *rates, *rods, *lumps, *axial;
} Segments;

PRBM bool stub(int pivots, const double *gamma, double *gamma0, Problem *problem);
PRBM void reverse(int count, double *x);
/* How many links stand for a flexure, and whether the i-th of n stretches. */
PRBM int links_of(const FlexureType *model, int start_end, int end_end);
PRBM bool stretches(const FlexureType *model, int i, int n);
PRBM bool segments(const FlexureType *model, const double *gamma, const double *K_theta,
                   int start_end, int end_end, double L, double EI, double mass, double EA,
                   Segments *result, Problem *problem);
/* The same flexure from its end to its start. */
PRBM void reversed(Segments *pieces);

/* --- assembly.c ----------------------------------------------------------------------------------- */

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
PRBM bool assemble(System *system, const double *values, Scratch *scratch, Problem *problem);
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
PRBM Complex unit(double degrees);
PRBM Complex complex_of(double re, double im);
PRBM Complex plus(Complex a, Complex b);
PRBM Complex minus(Complex a, Complex b);
PRBM Complex product(Complex a, Complex b);
PRBM Complex conjugate(Complex a);
PRBM Complex scaled(double x, Complex a);
PRBM double modulus(Complex a);

/* --- kinetics.c ----------------------------------------------------------------------------------- */

PRBM void inertia(int n, const Complex *H, const double *J, const Complex *e, double *M, double *C);
PRBM double kinetic_energy(int n, const double *M, const double *v);

/* --- constraints.c --------------------------------------------------------------------------------- */

/* Scalars s = Re(f (B E + z)) + c: f = 1, or conj(E) of the body that they are seen from. */
typedef struct {
    const System *system;
    int count;
    const Complex *B;       /* (count, n) */
    const double *c;        /* (count,) */
    const Complex *z;       /* (count,) */
    const int *on;          /* (count,) coordinates, FIXED: f = 1, z = 0; or NULL: all of them */
} Rows;

PRBM Rows plain_rows(const System *system, int count, const Complex *B, const double *c);
PRBM Rows gap_rows(const System *system);
PRBM Rows slide_rows(const System *system);
PRBM Rows rub_rows(const System *system);
PRBM double row_value(const Rows *rows, int i, const Complex *e); /* without c */
PRBM double row_rate(const Rows *rows, int i, const Complex *e, const double *v);
PRBM void row_jacobian(const Rows *rows, int i, const Complex *e, double *row);
PRBM double row_convective(const Rows *rows, int i, const Complex *e, const double *v);
PRBM void scalars(const Rows *rows, const Complex *e, double *s);
PRBM void jacobian(const Rows *rows, const Complex *e, double *result); /* (count, n) */
PRBM void saddle(int n, int r, const double *M, const double *columns, const double *rows,
                 double *kkt);
/* Solve a saddle-point system by LU; right (n + r,) becomes the solution. */
PRBM bool solve(int size, double *kkt, double *right, Scratch *scratch, Problem *problem);
/* q (n,) moves onto the rows, of which c (count,) are the constants now; e: its directions. */
PRBM bool project_positions(const System *system, const Rows *rows, double *q, const double *c,
                            Complex *e, Scratch *scratch, Problem *problem);
PRBM bool project_velocities(int n, int r, const double *M, const double *rows,
                             const double *rates, double *v, Scratch *scratch, Problem *problem);

/* M = L D L^T block by block, Z = L^-1 rows^T and the Schur complement S of a saddle-point matrix
 * [[M, columns^T], [rows, 0]]: what to solve with, again and again.  Vectors are padded to an even
 * length. */
typedef struct {
    int even, r, block_count;
    const Block *blocks;
    double *L;                  /* its blocks, one behind the other, below their diagonals */
    double *inverse;            /* (even,) 1/D */
    double *Z, *Z_columns;      /* (r, even); of the columns as of the rows, or the same array */
    double *S;                  /* (r, r), and room for its factor */
    int *pivots;                /* (r,) */
    bool symmetric;             /* S is, and small: its factor is L D L^T, else LU */
} Factors;

/* S from Z and Y_columns, factored. */
PRBM bool factor_schur(Factors *factors);
/* x (even,) and lam (r,): in, the right side; out, the solution a and the multipliers. */
PRBM void solve_again(const Factors *factors, double *x, double *lam);

/* --- forces.c --------------------------------------------------------------------------------------- */

PRBM void springs(int n, const double *K, const double *deflection, double *torque);
PRBM double elastic_energy(int n, const double *K, const double *deflection);
PRBM void field_row(int n, const Complex *S, Complex acceleration, Complex *w);
PRBM void force_row(int n, const Complex *A, Complex force, Complex *w);
/* The generalised forces (3, n) of a unit force along x, along y and of a unit moment. */
PRBM void load_rows(const System *system, const BodyFrame *frame, const Complex *e, double *rows,
                    Scratch *scratch);
PRBM void generalised(int n, const Complex *w, const Complex *e, double *Q);
PRBM double gravitational_energy(const System *system, const Complex *e);
PRBM double normal_force(double lift, double preload, double stiffness);

/* --- dynamics.c -------------------------------------------------------------------------------------- */

enum { SLIDES_BACK = -1, STICKS = 0, SLIDES = 1, IDLE = 2 };

/* What holds (1 or 0), slides along its wall and rubs. */
typedef struct {
    int *holds, *slides, *rubs; /* (s,), (s,), (f,) */
} Discrete;

/* A wall in uniform motion: its position along the direction of the stop. */
typedef struct {
    double position, rate, since;
} Wall;

typedef struct {
    const double *forces;  /* (3 b,): x, y, moment of each force */
    Complex base;          /* acceleration */
    const Wall *walls;     /* (s,) */
    const double *mobilities; /* (s,) inverse effective masses of the walls; 0: immovable */
} Inputs;

/* Accelerations, multipliers and powers of a system in one discrete state. */
typedef struct {
    const System *system;
    Inputs inputs;
    Discrete discrete;
    double omega, beta, mass_damping;
    int r, first_hold, first_stick, first_rub;
    int held_count, stuck_count, rubbing_count, sliding_count, rub_slide_count;
    int *held, *stuck, *rubbing, *sliding, *rub_slides; /* stops, stops, frictions, stops, ... */
    double *stop_friction;  /* (s,) */
    double *rub_law;        /* (f, 3): coefficient, normal force, normal stiffness */
    Complex *B, *z;         /* (r, n), (r,) of the active rows */
    double *c;              /* (r,) */
    int *on, *carried;      /* (r,), (carried_count,) those that are seen from a body */
    int carried_count;
    Rows active;
    Complex *w, *w_input;   /* (n,) */
    double *moment;         /* (even,) */
    bool driven, walls_push;
    Parts B_conjugate;      /* (r, even) */
    Parts w_parts;          /* (even,) */
    double *own;            /* (n,) the diagonal of M now */
    /* where the present step began, or something else that others are near */
    double *start;          /* (even,) its angles */
    Complex *e_at_start;    /* (even,) */
    Parts e_start;          /* (even,) the same */
    /* at the state that was evaluated last; of the coordinates and, behind them, of the ground */
    double *angle, *speed, *squares, *turns; /* (even + 2,) */
    Complex *e;                              /* (n,) */
    Parts e_parts;                           /* (even,) */
    double *rows, *columns;                  /* (r, even) */
    double *x, *lam;                         /* (even + 2,) accelerations; (r,) */
    double *block;                           /* of M, below its diagonal */
    double spring_loss;                      /* the power that the springs' damping takes */
    double *least, *most;                    /* (held,) extremes of the forces since the trace */
    Factors factors;
} Equations;

PRBM void equations_place(Equations *equations, const System *system, Memory *memory);
/* Set up the rows and loads of a discrete state. */
PRBM void set_equations(Equations *equations, const Inputs *inputs, const Discrete *discrete,
                        double omega);
/* Accelerations a (n,) and multipliers lam (r,): loops, held stops (> 0 pushes), what sticks. */
PRBM bool accelerations(Equations *equations, const double *q, const double *v, double *a,
                        double *lam, Problem *problem);
PRBM bool rate(Equations *equations, double t, const double *y, double *dy, Problem *problem);
PRBM void begin_trace(Equations *equations);
PRBM double energy_here(const Equations *equations, const double *v); /* kinetic, of what was
                                                                         evaluated last */
PRBM double rub_limit(const Equations *equations, int i, const Complex *e);
PRBM bool project(Equations *equations, double t, double *y, Scratch *scratch, Problem *problem);
PRBM bool project_from_here(Equations *equations, double t, double *y, Scratch *scratch,
                            Problem *problem);
PRBM double wall_at(const Wall *wall, double t);
PRBM double gap(const Equations *equations, int i, double t, const Complex *e);
PRBM double gap_rate(const Equations *equations, int i, const Complex *e, const double *v);
PRBM void base_reaction(const Equations *equations, const Complex *e, const double *v,
                        const double *a, Complex *force, double *moment, Scratch *scratch);

/* --- runge_kutta.c ------------------------------------------------------------------------------------ */

enum { STAGES = 8, ORDER = 5, DENSE = 4 };

PRBM bool stages(Equations *equations, int n, double t, const double *y, double h, double *k,
                 double *y1, Problem *problem);
PRBM void error_of(int n, const double *k, double h, double *error);
PRBM void weights(double theta, double *b);
PRBM void interpolate(int n, const double *y, const double *k, double h, double theta,
                      double *result);

/* --- contact.c -------------------------------------------------------------------------------------- */

/* Changes of velocity X (n, k) by unit impulses along the rows (k, n), while held (r, n) keep. */
PRBM bool response(int n, int r, int k, const double *M, const double *held, const double *rows,
                   double *X, Scratch *scratch, Problem *problem);
PRBM void newton(int k, const double *W, const double *u, const double *restitution, double *P,
                 Scratch *scratch);
PRBM void stronge(const double *W, const double *u, double friction, double restitution,
                  double *P_n, double *P_t);
PRBM bool several(int k, const double *W, const double *u, const double *friction,
                  const double *restitution, double *P, Scratch *scratch, Problem *problem);

/* --- statics.c -------------------------------------------------------------------------------------- */

typedef struct {
    double *q, *lam; /* (n,), (r,) */
    double force;
} Equilibrium;

/* B (r + 1, n), c (r + 1,): the loops and, below them, the row of the released body. */
PRBM void stack_release(const System *system, Complex *B, double *c);
/* w is spread, B is not. */
PRBM void tangent_stiffness(const System *system, int r, const Complex *w, const Complex *B,
                            const double *lam, const Complex *e, double *K_t);
/* held: whether the released body is held at the displacement. */
PRBM bool equilibrium(const System *system, bool held, double displacement, Equilibrium *shape,
                      Scratch *scratch, Problem *problem);
PRBM bool release_velocity(const System *system, const double *q, double speed, double *v,
                           Scratch *scratch, Problem *problem);

/* --- modal.c ---------------------------------------------------------------------------------------- */

/* Frequencies [Hz] (k,) and mass-normalised modes (n, k), k = n - r. */
PRBM bool modes(const System *system, const Equilibrium *shape, double *frequency, double *phi,
                Scratch *scratch, Problem *problem);
PRBM bool fundamental_frequency(const System *system, double *frequency, Scratch *scratch,
                                Problem *problem);
/* The fundamental mode phi (n,) at a shape and M (n, n) there. */
PRBM bool fundamental_at(const System *system, const double *q, double *phi, double *M,
                         Scratch *scratch, Problem *problem);
PRBM double simulated_restitution(int n, const double *phi, const double *M, const double *before,
                                  const double *after);

/* --- hybrid.c: see simulation.h ----------------------------------------------------------------------- */

#endif
