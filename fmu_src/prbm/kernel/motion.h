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
PRBM size_t simulation_bytes(const Simulation *simulation); /* of its block, for the record */
/* As new: start values, not started. */
PRBM void simulation_reset(Simulation *simulation);

/* The complete state as numbers: a simulation that restores them continues to the bit. */
PRBM size_t simulation_state_count(const Simulation *simulation);
PRBM void simulation_save(const Simulation *simulation, double *state);
/* False and a sentence, and nothing changed, if the numbers are no state of this mechanism. */
PRBM bool simulation_restore(Simulation *simulation, const double *state, Problem *problem);

/* Parameters and inputs, by their slot; a rejected value changes nothing.  Before the start fixed
 * and tunable parameters may be set, after it inputs and tunable parameters; they act from the
 * present time on. */
PRBM bool simulation_set(Simulation *simulation, int slot, double x, Problem *problem);
/* Any value by its slot, at the present time; before the start: parameters, inputs only. */
PRBM bool simulation_get(Simulation *simulation, int slot, double *x, Problem *problem);
/* Back to not started, values kept: so that fixed parameters may be set again. */
PRBM void simulation_unstart(Simulation *simulation);
PRBM bool simulation_started(const Simulation *simulation);
PRBM double simulation_time(const Simulation *simulation);

/* Start the motion.  tolerance 0: solver.tolerance.  exchange: model exchange, in which
 * the importer integrates. */
PRBM bool simulation_start(Simulation *simulation, double start_time, double tolerance,
                           bool exchange, Problem *problem);

/* --- co-simulation --- */

/* Continue to a time, events included. */
PRBM bool simulation_advance(Simulation *simulation, double time, Problem *problem);
/* Continue to a time, but stop before the first event (its values still those before it) and,
 * if each is set, after each internal step.  simulation_time returns the time reached; the
 * walls move as planned for the given time.  *event: an event is pending, see simulation_happen. */
PRBM bool simulation_advance_some(Simulation *simulation, double time, bool each, bool *event,
                                  Problem *problem);
/* Apply the pending event (event mode); without one, do nothing. */
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
/* A step was accepted; *event: enter event mode (the contact has drifted, a wall has turned). */
PRBM bool exchange_completed_step(Simulation *simulation, bool *event, Problem *problem);
/* Event mode: apply all events that are due.  *changed: the states have new values. */
PRBM bool exchange_event(Simulation *simulation, bool *changed, Problem *problem);
PRBM const char *exchange_deepest(Simulation *simulation, double *depth);
/* Derivative of all values (slots.count) along a change of states dx and of inputs du, by exact
 * differentiation, at the present time; zero for discrete and constant values. */
PRBM bool exchange_directional(Simulation *simulation, const double *dx, const double *du,
                               double *dvalues, Problem *problem);

#endif
