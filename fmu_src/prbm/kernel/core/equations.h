/* The equations of motion in one discrete state: rows, loads and workspace. */
#ifndef PRBM_EQUATIONS_H
#define PRBM_EQUATIONS_H

#include "core/constraints.h"
#include "core/factors.h"

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
PRBM double wall_at(const Wall *wall, double t);

#endif
