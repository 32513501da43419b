/* Guards of springs that act on one side. */
#ifndef PRBM_SPRING_GUARDS_H
#define PRBM_SPRING_GUARDS_H

#include "hybrid/guards.h"

/* The guards of a spring that acts on one side, by its phase: of its strain, of its force, or both. */
typedef struct {
    const Guard *strain, *force;
} CoilGuards;
PRBM CoilGuards coil_guards(const Equations *equations, int contact);
PRBM double action_guard(const Equations *equations, const Instant *at, int contact);
PRBM double strain_guard(const Equations *equations, const Instant *at, int contact);
PRBM double strain_rate_guard(const Equations *equations, const Instant *at, int contact);
PRBM bool one_sided_coil(const Equations *equations, int contact);
PRBM bool action_near(Simulation *sim);
/* Find the first time in the latest step at which a spring begins or ceases to act. */
PRBM bool action_time(Simulation *sim, const Guard *guard, int contact, Fall *fall,
                      Problem *problem);

#endif
