/* Projection of a state onto the active constraints. */
#ifndef PRBM_PROJECTION_H
#define PRBM_PROJECTION_H

#include "core/evaluation.h"

/* Working memory of a projection near an evaluated state. */
typedef struct {
    Kinematics at;                   /* of the corrected state */
    double *rows, *convective;       /* (r, even), (r,) */
    double *by_direction;            /* (r, wide) the rows by the directions, if mapped */
    double *residual, *change;       /* (r,), (even + 2,) */
} Correction;

PRBM void correction_place(Correction *correction, const System *system, Memory *memory);
/* Project y onto the constraints at time t. */
PRBM bool project(const Equations *equations, double t, double *y, Scratch scratch,
                  Problem *problem);
/* Project y, and compute the impulses (r,) along the active rows that change the velocities;
 * impulses may be NULL. */
PRBM bool project_with_impulses(const Equations *equations, double t, double *y, double *impulses,
                                Scratch scratch, Problem *problem);
/* Project y by one correction with the factors of its evaluation; call project if that fails.  Then
 * correction->at has the arms at y. */
PRBM bool project_near(const Equations *equations, const Evaluation *evaluation,
                       const Reference *near, double t, double *y, Correction *correction,
                       Scratch scratch, Problem *problem);
PRBM double prescribed(const Equations *eq, int k, double t);

#endif
