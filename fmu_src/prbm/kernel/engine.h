/* The library of the Python package: the functions that kernel/library.py calls with ctypes.
 *
 * A function that can fail returns false, or -1, and writes a sentence to its argument message,
 * which has PROBLEM_LENGTH bytes.  An engine is used by one thread at a time.
 */
#ifndef PRBM_ENGINE_H
#define PRBM_ENGINE_H

#include "motion.h"

#if defined(_WIN32)
#define EXPORTED __declspec(dllexport)
#elif defined(__GNUC__)
#define EXPORTED __attribute__((visibility("default")))
#else
#define EXPORTED
#endif

typedef struct Engine Engine;

/* Read the tables of a mechanism; NULL on failure.  Engines refer to the result. */
EXPORTED Mechanism *prbm_mechanism_open(const unsigned char *tables, size_t size, char *message);
EXPORTED void prbm_mechanism_close(Mechanism *mechanism);

/* Allocate a simulation; NULL if there is no memory. */
EXPORTED Engine *prbm_open(const Mechanism *mechanism);
EXPORTED void prbm_close(Engine *engine);
/* Set parameters and inputs: count values from a slot on. */
EXPORTED bool prbm_set(Engine *engine, int first, int count, const double *values, char *message);
/* Start the motion.  If the tolerance is 0, solver.tolerance is used. */
EXPORTED bool prbm_start(Engine *engine, double start_time, double tolerance, char *message);
/* Count the unstable directions of the equilibrium under gravity, and of the held shape at release,
 * into counts (2,). */
EXPORTED bool prbm_instability(Engine *engine, int *counts, char *message);
EXPORTED bool prbm_check_step(const Engine *engine, double step, char *message);
/* Simulate to a time.  Return the number of recorded impacts, -1 on failure.  A failure, also one
 * of memory for the record, leaves the simulation and the record unchanged.  A call returns after
 * some milliseconds, so that the caller can be interrupted: after ENGINE_UNFINISHED, call the
 * function again with the same time, or prbm_abandon. */
EXPORTED int prbm_advance(Engine *engine, double time, char *message);
enum { ENGINE_UNFINISHED = -2 };
/* Restore simulation and record as before an advance that is unfinished, if there is one. */
EXPORTED void prbm_abandon(Engine *engine);
/* Get the values of slots (count,) at the present time. */
EXPORTED bool prbm_values(Engine *engine, int count, const int *slots, double *values,
                          char *message);
/* Simulate to each of several times, and get the values of slots (samples, count) there.  Return
 * the number of recorded impacts, -1 on failure at a time; the times before have been reached.
 * *done: number of times that have been reached, 0 at first.  After ENGINE_UNFINISHED, call the
 * function again with the same arguments, or prbm_abandon. */
EXPORTED int prbm_sample(Engine *engine, int samples, const double *times, int count,
                         const int *slots, double *values, int *done, char *message);
/* Get the present state (2 n + 2,): angles, rates, dissipated energy and work. */
EXPORTED bool prbm_state(Engine *engine, double *y, char *message);
/* Get the present stress of the flexures whose stress is an output [Pa]: of each flexure, that of the
 * left face in all sections from its start, then that of the right face. */
EXPORTED int prbm_section_count(const Engine *engine); /* sections of all these flexures */
EXPORTED bool prbm_sections(Engine *engine, double *faces, char *message);
EXPORTED double prbm_time(const Engine *engine);  /* present time [s] */
EXPORTED double prbm_steps(const Engine *engine); /* integration steps so far */
EXPORTED int prbm_coordinates(const Engine *engine); /* n */

/* The points of a drawing: the corners of the flexures in the order of the assembly, then the
 * centre and the arm of each body.  A beam has its nodes only as corners. */
EXPORTED int prbm_point_count(const Engine *engine);
/* Compute the points (point_count, 2) at coordinates q (n,) for the parameters of the start. */
EXPORTED void prbm_points(Engine *engine, const double *q, double *points);
/* Compute the modes about the equilibrium under gravity: its coordinates q (n,), frequencies [Hz]
 * in ascending order, negative if unstable, and the coordinates of each mode (modes, n).  Return
 * the number of modes, -1 on failure. */
EXPORTED int prbm_mode_count(const Engine *engine);
EXPORTED int prbm_modes(Engine *engine, double *q, double *frequencies, double *shapes,
                        char *message);

/* Keep the values of slots (count,) directly before and after each event from now on; NULL: no longer,
 * which does not fail. */
EXPORTED bool prbm_observe(Engine *engine, int count, const int *slots, char *message);
/* The number of rows that have been kept.  Move them out: time and values, (rows, 1 + count).  Before
 * an event, the time is the largest number below that of the event. */
EXPORTED int prbm_observed_count(const Engine *engine);
EXPORTED void prbm_observed(Engine *engine, double *rows);

/* Record the impacts from now on, or no longer. */
EXPORTED void prbm_record(Engine *engine, bool record);
/* The count of numbers of a recorded impact; the last 3 n are its coordinates, the rates before and
 * the rates after it. */
EXPORTED int prbm_impact_size(const Engine *engine);
/* Move the recorded impacts out, prbm_impact_size numbers each: index of the stop, count, time,
 * approach speed, rebound speed, impulse, energy lost, modal restitution, sum of impulses, peak
 * force, indentation, contact duration, coordinates, rates before, rates after. */
EXPORTED void prbm_impacts(Engine *engine, double *numbers);

/* The complete state as numbers, as simulation_save writes it. */
EXPORTED size_t prbm_saved_count(const Engine *engine);
EXPORTED void prbm_save(const Engine *engine, double *numbers);
EXPORTED bool prbm_restore(Engine *engine, const double *numbers, char *message);

#endif
