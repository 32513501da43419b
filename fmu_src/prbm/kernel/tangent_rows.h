/* Changes of rows, gaps and rates along a tangent, for directional derivatives. */
#ifndef PRBM_TANGENT_ROWS_H
#define PRBM_TANGENT_ROWS_H

#include "values.h"

/* Values, and their changes d... along a change of states and inputs.  The change of an arm E =
 * exp(s + i theta) is dE = i E dphi with dphi = dtheta - i ds; dw is the change of its rate w. */
typedef struct {
    Simulation *sim;
    const Equations *eq;
    const Complex *e;
    const Factors *factors;
    const Evaluation *evaluation;
    const Instant *at;
    const double *y, *v, *a, *lam, *du;
    double *dq, *dv, *dx, *dlam;    /* (n,), (n,), (even,), (r,); dx ends as da */
    double *dpressure;              /* (s,) forces of pressed stops */
    Complex *w, *alpha, *dphi, *dw; /* (d,) of the arms: rates, accelerations, changes */
    Complex *dE;                    /* (d,) i E dphi */
    Complex *swing, *dswing;        /* (d,) E w */
    Complex *bend, *dbend;          /* (d,) E (i w' - w^2); bend_arms adds the change of w' */
    Scratch scratch;                /* the rest */
    Complex *pull;                  /* (d,) of the arms: torques, + i times forces along them */
} Tangent;

/* An arm E, its complex rate w and acceleration alpha, and its changes dphi and dw, see Tangent. */
typedef struct {
    Complex E, w, alpha, dphi, dw;
} Arm;

PRBM double rate_change(const Tangent *t, const Rows *rows, int i);
PRBM double gap_change(const Tangent *t, int i);
PRBM double gap_rate_change(const Tangent *t, int i);
/* Change of the second time derivative of a row at constant accelerations. */
PRBM double second_change(const Tangent *t, const Rows *rows, int i);
/* Add the change of the load of a constant force along row i, as the gradient of the row turns with
 * the arms.  The opposite load acts on the body that carries the wall. */
PRBM void add_pull(const Tangent *t, const Rows *rows, int i, double force);
/* Change of the friction limit of a friction point or of a pressed stop. */
PRBM double limit_change(const Tangent *t, int contact);
/* Change of the force of a slipping contact along its direction. */
PRBM double slip_force_change(const Tangent *t, int contact);
/* Sign of the sliding velocity of a contact. */
PRBM int sliding_sign(const Tangent *t, int contact);
/* Change of E w: E (i dphi w + dw) */
PRBM Complex swing_change(const Arm *arm);
/* Second derivative of an arm divided by the arm, E''/E = i w' - w^2 */
PRBM Complex bend_of(const Arm *arm);
/* Change of E'' at constant w': E (i dphi (i w' - w^2) - 2 w dw) */
PRBM Complex bend_change(const Arm *arm);
PRBM Complex times_i(Complex z);
PRBM Arm arm_at(const Tangent *t, int j);

#endif
