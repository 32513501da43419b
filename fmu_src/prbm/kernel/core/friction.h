/* Normal forces of contacts, and the forces of friction. */
#ifndef PRBM_FRICTION_H
#define PRBM_FRICTION_H

#include "core/equations.h"
#include "core/evaluated.h"

/* The limit of friction point i. */
PRBM double rub_limit(const Equations *equations, int i, const Complex *e);
PRBM double stop_force(const Equations *eq, const double *lam, int stop);
PRBM double side_force(const Equations *eq, const double *lam, int contact);
PRBM double stick_force(const Equations *eq, const double *lam, int contact);
PRBM double friction_limit(const Equations *eq, const Complex *e, const Evaluation *found,
                           int contact);
PRBM double slip_force(const Equations *eq, const Complex *e, const Evaluation *found,
                       int contact);

#endif
