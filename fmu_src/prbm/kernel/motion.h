/* A mechanism in motion, as the FMI wrappers and the tests see it. */
#ifndef PRBM_MOTION_H
#define PRBM_MOTION_H

#include "kernel.h"

typedef struct Simulation Simulation;

/* An impact for a listener.  The arrays are valid during the call only. */
typedef struct {
    int index; /* of the stop */
    const char *stop;
    double time, approach_speed, rebound_speed, impulse, energy_lost, modal_restitution,
        impulse_sum, peak_force, indentation, contact_duration;
    int count;
    const double *q, *before, *after; /* (n,): angles, and rates before and after the impact */
} Impact;

typedef void ImpactListener(void *listener, const Impact *impact);

/* Allocate a simulation in one block, with the start values of the tables; NULL if there is no
 * memory.  simulation_start starts the motion. */
PRBM Simulation *simulation_open(const Mechanism *mechanism);
PRBM void simulation_close(Simulation *simulation);
/* Call on_impact(listener, impact) at each impact. */
PRBM void simulation_listen(Simulation *simulation, ImpactListener *on_impact, void *listener);

/* An observer of events, called at the time of an event before it and after it.  If it returns false,
 * the simulation to the given time fails. */
typedef bool EventObserver(void *observer, double time, bool after, Problem *problem);
/* Call observe(observer, ...) at each event of co-simulation, changes of phase of compliant stops
 * apart; NULL: no longer.  simulation_get then returns the values at that moment. */
PRBM void simulation_observe(Simulation *simulation, EventObserver *observe, void *observer);
PRBM const Mechanism *simulation_mechanism(const Simulation *simulation);
PRBM size_t simulation_bytes(const Simulation *simulation); /* size of its block */
/* Restore the state after simulation_open. */
PRBM void simulation_reset(Simulation *simulation);

/* The complete state as numbers: a simulation that restores them continues bit for bit. */
PRBM size_t simulation_state_count(const Simulation *simulation);
PRBM void simulation_save(const Simulation *simulation, double *state);
/* Fails and changes nothing if the numbers are not a state of this mechanism. */
PRBM bool simulation_restore(Simulation *simulation, const double *state, Problem *problem);

/* Set a parameter or an input by its slot.  The value acts from the present time on; a rejected
 * value changes nothing.  After the start, fixed parameters are rejected. */
PRBM bool simulation_set(Simulation *simulation, int slot, double x, Problem *problem);
/* Compute any value by its slot, at the present time.  Before the start only parameters and inputs
 * have values. */
PRBM bool simulation_get(Simulation *simulation, int slot, double *x, Problem *problem);
/* Undo the start but keep all values, so that fixed parameters may be set again. */
PRBM void simulation_unstart(Simulation *simulation);
PRBM bool simulation_started(const Simulation *simulation);
PRBM double simulation_time(const Simulation *simulation);

/* Start the motion.  If the tolerance is 0, solver.tolerance is used.  exchange: true for model
 * exchange, in which the importer integrates. */
PRBM bool simulation_start(Simulation *simulation, double start_time, double tolerance,
                           bool exchange, Problem *problem);

/* Count the unstable directions of the equilibrium under gravity, and of the held shape at release. */
PRBM bool simulation_instability(Simulation *simulation, int *rest, int *release,
                                 Problem *problem);

/* Reject a start whose communication step of the default experiment, in co-simulation, needs too
 * many integration steps. */
PRBM bool simulation_check_effort(const Simulation *simulation, Problem *problem);
/* The same for a given communication step [s]. */
PRBM bool simulation_check_step(const Simulation *simulation, double step, Problem *problem);
/* Number of integration steps since simulation_open. */
PRBM double simulation_steps(const Simulation *simulation);
/* Return the importer's tolerance, or solver.tolerance if the importer's is 0. */
PRBM double simulation_requested(const Simulation *simulation, double tolerance);

/* --- co-simulation --- */

/* Simulate to a time, and apply the events before it. */
PRBM bool simulation_advance(Simulation *simulation, double time, Problem *problem);
/* Integration steps of a communication step. */
typedef struct {
    int steps;    /* number so far */
    int before;   /* number of them before the present span of time */
    double since; /* begin of that span [s] */
} Effort;
/* The same in parts of at most so many integration steps, with the same result.  effort->steps must
 * be 0 at the first part.  *reached: the time has been reached.  Until then only this function and
 * simulation_abandon may be called. */
PRBM bool simulation_advance_part(Simulation *simulation, double time, int steps, Effort *effort,
                                  bool *reached, Problem *problem);
/* Restore the state before the first part. */
PRBM void simulation_abandon(Simulation *simulation);
/* Simulate to a time, but return early at the first event, or after an internal step if each is
 * true.  simulation_time returns the time reached.  *event: whether an event is pending, which
 * simulation_handle_event applies.  The walls move as in a step to the given time.  effort->steps must
 * be 0 at the first call of a communication step. */
PRBM bool simulation_advance_some(Simulation *simulation, double time, bool each, Effort *effort,
                                  bool *event, Problem *problem);
/* Event mode: apply the pending event, if any, changed impulses and changed velocities of walls. */
PRBM bool simulation_handle_event(Simulation *simulation, Problem *problem);

/* --- model exchange --- */

/* Number of states: independent angles, their rates, dissipated energy, work. */
PRBM int exchange_states(const Simulation *simulation);
/* The slot of the k-th state in the vector of all values. */
PRBM int exchange_slot(const Simulation *simulation, int k);
PRBM int exchange_indicators(const Simulation *simulation);
PRBM void exchange_set_time(Simulation *simulation, double time);
PRBM void exchange_set(Simulation *simulation, const double *x);
PRBM void exchange_get(const Simulation *simulation, double *x);
PRBM void exchange_nominals(const Simulation *simulation, double *x);
PRBM bool exchange_derivatives(Simulation *simulation, double *dx, Problem *problem);
PRBM bool exchange_event_indicators(Simulation *simulation, double *z, Problem *problem);
/* Accept a step of the importer.  *event: whether a contact has drifted, so that event mode is
 * needed. */
PRBM bool exchange_completed_step(Simulation *simulation, bool *event, Problem *problem);
/* Event mode: apply the inputs and all events that are due.  *changed: whether the states have
 * changed. */
PRBM bool exchange_event(Simulation *simulation, bool *changed, Problem *problem);
/* Whether exchange_event would apply an event or an impulse here. */
PRBM bool exchange_pending(Simulation *simulation, bool *pending, Problem *problem);
/* The stop with the deepest penetration and its depth [m]; NULL if no penetration exceeds a
 * solver's errors. */
PRBM const char *exchange_deepest(Simulation *simulation, double *depth);
/* Compute the exact directional derivatives of all values (slots.count,) along the change dx of the
 * states and du of the inputs, at the present time.  Those of discrete and constant values are
 * 0. */
PRBM bool exchange_directional(Simulation *simulation, const double *dx, const double *du,
                               double *dvalues, Problem *problem);

#endif
