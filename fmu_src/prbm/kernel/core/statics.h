/* Static equilibrium under gravity and a holding force. */
#ifndef PRBM_STATICS_H
#define PRBM_STATICS_H

#include "core/system.h"

typedef struct {
    double *q, *lam; /* (n,), (r,) */
    double force; /* N, or N m if the release is by an angle */
} Equilibrium;

/* Set B (r + 1, n) and c (r + 1,): the loops, then the displacement of the released point. */
PRBM void stack_release(const System *system, Complex *B, double *c);
/* The same; the last row holds the released body at a displacement, or at an angle if the release
 * is by one.  It is then the sine of the remaining angle times the size. */
PRBM void stack_holding(const System *system, double amount, Complex *B, double *c);
/* The same at the displacement or the angle of a shape q (n,). */
PRBM void stack_holding_at(const System *system, const double *q, Complex *B, double *c);
/* Compute the tangent stiffness; w is spread, B is not. */
PRBM void tangent_stiffness(const System *system, int r, const Complex *w, const Complex *B,
                            const double *lam, const Complex *e, double *K_t);
/* Compute the equilibrium; held: whether the released body is held at the displacement or angle. */
PRBM bool equilibrium(const System *system, bool held, double displacement, Equilibrium *shape,
                      Scratch *scratch, Problem *problem);
PRBM bool release_velocity(const System *system, const double *q, double speed, double *v,
                           Scratch *scratch, Problem *problem);

#endif
