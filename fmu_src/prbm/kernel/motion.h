/* A mechanism in motion, as the FMI wrappers and the tests see it. */
#ifndef PRBM_MOTION_H
#define PRBM_MOTION_H

#include "kernel.h"

typedef struct Simulation Simulation;

/* An impact, for the log. */
typedef struct {
    const char *stop;
    double time, approach_speed, rebound_speed, impulse, energy_lost;
    int count;
} Impact;

typedef void Hear(void *listener, const Impact *impact);

/* Allocate a simulation in one block; NULL if there is no memory.  Its values are the start values
 * of the tables; it has not started. */
PRBM Simulation *simulation_open(const Mechanism *mechanism);
PRBM void simulation_close(Simulation *simulation);
PRBM void simulation_listen(Simulation *simulation, Hear *hear, void *listener);
PRBM const Mechanism *simulation_mechanism(const Simulation *simulation);
PRBM size_t simulation_bytes(const Simulation *simulation); /* size of its block */
/* Back to the state after simulation_open. */
PRBM void simulation_reset(Simulation *simulation);

/* The complete state as numbers: a simulation that restores them continues bit for bit. */
PRBM size_t simulation_state_count(const Simulation *simulation);
PRBM void simulation_save(const Simulation *simulation, double *state);
/* Fails and changes nothing if the numbers are not a state of this mechanism. */
PRBM bool simulation_restore(Simulation *simulation, const double *state, Problem *problem);

/* Parameters and inputs, by their slot; a rejected value changes nothing.  Before the start fixed
 * and tunable parameters may be set, after it inputs and tunable parameters; they act from the
 * present time on. */
PRBM bool simulation_set(Simulation *simulation, int slot, double x, Problem *problem);
/* Any value by its slot, at the present time; before the start only parameters and inputs. */
PRBM bool simulation_get(Simulation *simulation, int slot, double *x, Problem *problem);
/* Undo the start but keep all values, so that fixed parameters may be set again. */
PRBM void simulation_unstart(Simulation *simulation);
PRBM bool simulation_started(const Simulation *simulation);
PRBM double simulation_time(const Simulation *simulation);

/* Start the motion.  A tolerance of 0 stands for solver.tolerance; exchange: the importer
 * integrates (model exchange). */
PRBM bool simulation_start(Simulation *simulation, double start_time, double tolerance,
                           bool exchange, Problem *problem);

/* Reject a start whose communication step of the default experiment, in co-simulation, needs too
 * many integration steps. */
PRBM bool simulation_check_effort(const Simulation *simulation, Problem *problem);
/* The tolerance that solver.tolerance or an importer's tolerance (not 0) requests. */
PRBM double simulation_requested(const Simulation *simulation, double tolerance);

/* --- co-simulation --- */

/* Continue to a time, events included. */
PRBM bool simulation_advance(Simulation *simulation, double time, Problem *problem);
/* Continue to a time, but stop at the first event, before it is applied, and also after an internal
 * step if each is set.  simulation_time returns the time reached; the walls move as in a step to
 * the given time.  *event: an event is pending, see simulation_happen. */
PRBM bool simulation_advance_some(Simulation *simulation, double time, bool each, bool *event,
                                  Problem *problem);
/* Event mode: apply the pending event, if any, changed impulses and changed velocities of walls. */
PRBM bool simulation_happen(Simulation *simulation, Problem *problem);

/* --- model exchange --- */

/* Number of states: independent angles, their rates, dissipated energy, work. */
PRBM int exchange_states(const Simulation *simulation);
/* The slot, in the vector of all values, of the k-th state. */
PRBM int exchange_slot(const Simulation *simulation, int k);
PRBM int exchange_indicators(const Simulation *simulation);
PRBM void exchange_set_time(Simulation *simulation, double time);
PRBM void exchange_set(Simulation *simulation, const double *x);
PRBM void exchange_get(const Simulation *simulation, double *x);
PRBM void exchange_nominals(const Simulation *simulation, double *x);
PRBM bool exchange_derivatives(Simulation *simulation, double *dx, Problem *problem);
PRBM bool exchange_event_indicators(Simulation *simulation, double *z, Problem *problem);
/* Accept a step of the importer; *event: event mode is needed, because a contact has drifted. */
PRBM bool exchange_completed_step(Simulation *simulation, bool *event, Problem *problem);
/* Event mode: apply the inputs and all events that are due.  *changed: whether the states have
 * changed. */
PRBM bool exchange_event(Simulation *simulation, bool *changed, Problem *problem);
/* The stop that is penetrated most, if deeper than a solver's errors explain; else NULL. */
PRBM const char *exchange_deepest(Simulation *simulation, double *depth);
/* Derivative of all values (slots.count) along a change of states dx and of inputs du, by exact
 * differentiation, at the present time; zero for discrete and constant values. */
PRBM bool exchange_directional(Simulation *simulation, const double *dx, const double *du,
                               double *dvalues, Problem *problem);

#endif
