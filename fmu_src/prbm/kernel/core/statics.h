/* Static equilibrium under gravity and a holding force. */
#ifndef PRBM_STATICS_H
#define PRBM_STATICS_H

#include "core/constraints.h"

typedef struct {
    double *q, *lam; /* (n,), (r,) */
    double force; /* N, or N m if the release is by an angle */
} Equilibrium;

/* A position or a velocity of a body at the start, in SI units. */
typedef struct {
    const Body *body;
    const BodyFrame *frame;
    int field; /* GIVEN_... */
    double value;
    bool placed; /* Whether the body is placed, not held. */
    bool held; /* Whether a row holds it; otherwise the body is placed, or it follows from others. */
} StartValue;

/* What holds a mechanism at rest: a force on the released body at a displacement or an angle, or a
 * force for each of some positions at the start, or nothing. */
typedef struct {
    bool held;
    double amount;
    int count;
    const StartValue *values; /* (count,) */
} Hold;

/* Set B (r + 1, n) and c (r + 1,): the loops, then the displacement of the released point. */
PRBM void stack_release(const System *system, Complex *B, double *c);
/* Stack the loops and a last row that holds the released body at a displacement [m], or at an angle
 * [rad] if the release is by an angle.  In that case the row is the sine of the remaining angle
 * times the size. */
PRBM void stack_holding(const System *system, double amount, Complex *B, double *c);
/* Stack the loops and the row that holds the released body at its place in a shape q (n,). */
PRBM void stack_holding_at(const System *system, const double *q, Complex *B, double *c);
/* Return whether the released body is free, so that it is placed instead of held by a force. */
PRBM bool released_free(const System *system);
/* Return a system in which bodies without flexures and joints to the ground are placed, springs and
 * guides or not.  It has no rows of guides that only such bodies move. */
PRBM System with_bodies_placed(const System *system);
/* Set the coordinates q (n,) of the free bodies: as drawn, and the released one displaced or turned. */
PRBM void place_bodies(const System *system, double amount, double *q);
/* Compute the tangent stiffness K_t (n, n) with a share of initial strains and pretension, under dead
 * loads w (d,), with columns for stretches, and forces lam (r,) along the rows. */
PRBM void tangent_stiffness(const Rows *rows, double share, const Complex *w, const double *lam,
                            const Complex *e, double *K_t, Scratch scratch);
/* Compute the equilibrium; held: whether the released body is held at the displacement or angle. */
PRBM bool equilibrium(const System *system, bool held, double displacement, Equilibrium *shape,
                      Scratch scratch, Problem *problem);
/* Compute the shape under gravity.  If slow loading reaches no equilibrium, bodies that only springs
 * connect to the ground are as drawn, and balanced is false. */
PRBM bool resting(const System *system, Equilibrium *shape, bool *balanced, Scratch scratch,
                  Problem *problem);
/* Return the name of the field, its unit, and whether it is a rotation or an angular velocity. */
PRBM const char *start_name(const StartValue *x);
PRBM const char *start_unit(const StartValue *x);
PRBM bool rotates(const StartValue *x);
/* Set a row B (d,) that holds a body at a share of a position, and return its constant.  That of a
 * rotation is the sine of the remaining angle times the size. */
PRBM double start_row(const System *system, const StartValue *x, double share, Complex *B);
/* Compute the shape q (n,) under gravity with bodies at positions (count,) at the start. */
PRBM bool held_at_start(const System *system, const StartValue *values, int count, double *q,
                      Scratch scratch, Problem *problem);

#endif
