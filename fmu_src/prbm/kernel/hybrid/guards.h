/* Guards, which are scalars whose fall through zero is an event, and the location of their
 * zeros. */
#ifndef PRBM_GUARDS_H
#define PRBM_GUARDS_H

#include "hybrid/state.h"

/* A state at which guards are evaluated.  found: the evaluation there; NULL for guards without
 * forces. */
typedef struct {
    double time;
    const double *q, *v, *extra;
    const Complex *e;
    const Evaluation *found;
} Instant;

typedef double GuardValue(const Equations *equations, const Instant *at, int contact);

/* The scalar z of a kind of event.  The event is the change from z > 0 to z <= 0. */
typedef struct {
    const char *event;
    GuardValue *value;
    bool forces; /* whether the value needs multipliers */
    GuardValue *rate; /* its rate, for closing_time; else NULL */
} Guard;

/* Whether and when a guard falls in the latest step. */
typedef struct {
    bool found;
    double time;
} Fall;

PRBM double release_guard(const Equations *equations, const Instant *at, int contact);
PRBM double side_guard(const Equations *equations, const Instant *at, int contact);
PRBM double slip_guard(const Equations *equations, const Instant *at, int contact);
PRBM double reversal_guard(const Equations *equations, const Instant *at, int contact);
PRBM double gap_guard(const Equations *equations, const Instant *at, int contact);
PRBM double gap_rate_guard(const Equations *equations, const Instant *at, int contact);
PRBM double indentation_rate_guard(const Equations *equations, const Instant *at, int contact);
PRBM double indentation_guard(const Equations *equations, const Instant *at, int contact);
PRBM double switching_guard(const Equations *equations, const Instant *at, int contact);
PRBM double rising_guard(const Equations *equations, const Instant *at, int contact);
PRBM bool sticking_contact(const Equations *equations, int contact);
PRBM bool slipping_guide(const Equations *equations, int contact);
PRBM bool slipping_contact(const Equations *equations, int contact);
PRBM bool pressed_stop(const Equations *equations, int contact);
PRBM bool open_stop(const Equations *equations, int contact);
/* Whether events may occur in the latest step at any contact. */
PRBM bool release_near(Simulation *sim);
PRBM bool side_near(Simulation *sim);
PRBM bool slip_near(Simulation *sim);
PRBM bool reversal_near(Simulation *sim);
PRBM bool pressed_near(Simulation *sim);
PRBM bool separation_near(Simulation *sim);
PRBM bool impact_near(Simulation *sim);
/* Find the first time in the latest step at which the guard of a contact falls to zero.  The caller
 * sets fall->found to false.  Return false on failure. */
PRBM bool side_time(Simulation *sim, const Guard *guard, int contact, Fall *fall, Problem *problem);
PRBM bool yield_time(Simulation *sim, const Guard *guard, int contact, Fall *fall,
                     Problem *problem);
PRBM bool switching_time(Simulation *sim, const Guard *guard, int contact, Fall *fall,
                         Problem *problem);
PRBM bool reversal_time(Simulation *sim, const Guard *guard, int contact, Fall *fall,
                        Problem *problem);
PRBM bool closing_time(Simulation *sim, const Guard *guard, int stop, Fall *fall,
                       Problem *problem);
/* The same from the samples of the step.  At its start a guard may be round-off of either sign, which
 * counts only if it persists. */
PRBM bool sampled_time(Simulation *sim, const Guard *guard, int contact, Fall *fall,
                       Problem *problem);
/* Find the first time in the latest step at which an indentation passes a depth [m]. */
PRBM bool balance_time(Simulation *sim, int stop, double depth, Fall *fall, Problem *problem);
PRBM void sample_arc(Simulation *sim); /* for reversal_time and closing_time */

#endif
