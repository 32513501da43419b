/* The results of an evaluation of the equations of motion. */
#ifndef PRBM_EVALUATED_H
#define PRBM_EVALUATED_H

#include "core/factors.h"

/* Directions, from which the arms at nearby directions are computed. */
typedef struct {
    double *theta; /* (wide,) */
    Complex *e;    /* (wide,) */
    Parts e_parts; /* (wide,) unit vectors, without stretch */
} Reference;

/* Position and velocity of a system.  The coordinates come first, then the ground.  Unless the map
 * to the directions is not the identity, theta is angle and turn is speed. */
typedef struct {
    double time;             /* used if the walls of held stops move */
    const double *extra;     /* states of compliant stops; NULL: zeros */
    double *angle, *speed;   /* (even,), (even + 2,) coordinates and their rates */
    double *theta, *turn;    /* (wide,) directions and their rates */
    double *squares;         /* (wide,): turn^2 */
    Complex *e;              /* (wide,) */
    Parts e_parts;           /* (wide,) */
    double *own;             /* (d,) the diagonal of the mass of the directions, if arms stretch */
} Kinematics;

/* The equations of motion, evaluated at a state. */
typedef struct {
    Kinematics at;
    double *turns;                   /* (even + 2,) deflections and damping of the springs */
    double *row, *columns;           /* (even,), (r, even) */
    double *a, *lam;                 /* (even + 2,) accelerations; (r,) */
    double *load, *rows;             /* (wide,), (r, wide) by direction: a and Z, unless mapped */
    double *mass, *shift;            /* (n, n), (wide,) blocks of M and Im(w^2), if mapped */
    Complex *roots, *moments;        /* of the branches, and (n,) of one branch, if mapped */
    Parts turned;                    /* (wide,) working memory, if mapped */
    double *block;                   /* of the system, for a block of M or pairs of a branch */
    double spring_loss;              /* the power that the springs dissipate */
    double *pressure, *contact_loss; /* (s,) forces and dissipated powers of pressed stops */
    Factors factors;
} Evaluation;

#endif
