/* The equations of motion in one contact state: rows and loads. */
#ifndef PRBM_EQUATIONS_H
#define PRBM_EQUATIONS_H

#include "core/intervals.h"
#include "core/compliance.h"

/* A wall that joins its reference, a uniform motion, along a cubic.  At the time since, the wall is
 * ahead of the reference by the offset [m] and faster by the excess [m/s]; after the span [s] it
 * follows the reference. */
typedef struct {
    double position, rate, since, offset, excess, span;
} Wall;

/* Position x, velocity v and acceleration a of a wall along the direction of its stop. */
typedef struct {
    double x, v, a;
} WallMotion;

typedef struct {
    const double *forces;  /* (3 b,): x, y, moment of each force */
    Complex base;          /* acceleration */
    const Wall *walls;     /* (s,) */
    const double *mobilities; /* (s,) inverse effective masses of the walls; 0: immovable */
} Inputs;

/* The equations of motion of a system in one contact state, with its inputs. */
typedef struct {
    const System *system;
    Inputs inputs;
    ContactState contacts;
    double omega, beta, mass_damping;
    int r, first_hold, first_stick;
    int held_count, sticking_count, slipping_count;
    int *held;              /* the stops that are constraints */
    int *pressed;           /* the compliant stops that are forces */
    int pressed_count;
    ComplianceLaw *laws;    /* (s,) of compliant stops */
    double *restitutions;   /* (s,) from which the factors of their damping have been computed */
    int *sticking;          /* contacts; the k-th has the row first_stick + k */
    int *slipping;          /* contacts; the normal forces of the first slipping_rows of them, held */
    int slipping_rows;      /* stops, then guides, are multipliers */
    int slipping_guides;
    double *stop_friction;  /* (s,) */
    double *rub_law;        /* (f, 3): coefficient, normal force, normal stiffness; 0 at guides */
    Complex *B, *z;         /* (r, d), (r,) of the active rows */
    double *c;              /* (r,) */
    int *on, *carried;      /* (r,), (carried_count,) rows relative to a moving body */
    int carried_count;
    Rows active;
    bool dense;             /* whether the rows are few, or contacts slip: their intervals are whole */
    RowIntervals intervals;
    Complex *w, *w_input;   /* (d,) */
    double *moment;         /* (wide,) */
    bool walls_move;
    bool walls_recoil;        /* whether forces of compliant stops may move their walls */
    bool driven;            /* inputs or walls do work, or stops are compliant */
    bool more_powers;       /* whether more than the losses of springs changes the energies */
    bool contacts_or_walls; /* whether contacts slip or are pressed, or walls move */
    Parts B_conjugate;      /* (r, wide) */
    Parts w_parts;          /* (wide,) */
} Equations;

PRBM void equations_place(Equations *equations, const System *system, Memory *memory);
/* Set up the rows and loads of a contact state. */
PRBM void set_equations(Equations *equations, const Inputs *inputs,
                        const ContactState *contacts, double omega);
PRBM WallMotion wall_motion(const Wall *wall, double t);
PRBM int place_in(const int *list, int index);
PRBM int held_at(const Equations *eq, int stop);
/* The row whose multiplier is the normal force of a held stop or of a guide. */
PRBM int normal_row(const Equations *eq, int contact);
PRBM double friction_coefficient(const Equations *eq, int contact);
/* The contacts at which events may occur. */
PRBM bool held_stop(const Equations *equations, int contact);

#endif
