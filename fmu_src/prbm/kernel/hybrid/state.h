/* The parts of a simulation: its configuration, state and working memory. */
#ifndef PRBM_HYBRID_STATE_H
#define PRBM_HYBRID_STATE_H

#include "core/contact_problem.h"
#include "core/dynamics.h"
#include "core/projection.h"
#include "core/runge_kutta.h"
#include "motion.h"

#define TWO_PI 6.283185307179586

/* Scales of the motion: the size of the mechanism [m], a rate [rad/s], an energy [J], a period
 * [s]. */
typedef struct {
    double length, rate, energy, time;
} Scales;

/* The assembled mechanism; constant between two changes of parameters. */
typedef struct {
    const Mechanism *mechanism;
    System system;
    double omega; /* of the fundamental mode; 0 without one */
    Scales scales;
    double *least, *share; /* (ny,): errors are relative to max(least, share |y|) */
    double controlled;     /* number of the states whose error is controlled */
    bool assembled; /* whether the system has been assembled from the acting values */
} Configuration;

typedef struct {
    EventKind kind;
    int contact;
    double time;
} Event;

/* Values of the latest impact at a stop, and sums over all impacts. */
typedef struct {
    int count;
    double time, approach_speed, rebound_speed, impulse, energy_lost, modal_restitution;
    double impulse_sum; /* of all impulses so far, captures included; not of compliant stops */
    double peak_force, indentation, contact_duration; /* of compliant stops */
} Latched;

/* The begin of a contact at a compliant stop. */
typedef struct {
    double time;
    bool counted;         /* whether it is an impact whose outputs are not yet latched */
    double impulse, loss; /* states of the stop before the contact */
    bool calm;            /* whether the contact is calm enough to freeze */
    double calm_since;
    double step;          /* size of the steps before the contact */
} ContactStart;

/* A state of the motion through which an interpolation passes. */
typedef struct {
    double time;
    double *y, *a; /* (2 n,) angles and rates, (n,) accelerations */
} Node;

/* Indentation and force of a stop, and their rates, at the end of a step of model exchange.  known:
 * whether there has been one; deepens, grows: signs of the rates of indentation and force after the
 * latest event, 0 before the first. */
typedef struct {
    double known, time, depth, depth_rate, force, force_rate, deepens, grows;
} Dent;

enum { DENT_NUMBERS = sizeof(Dent) / sizeof(double) };

/* The latest step with its dense output. */
typedef struct {
    bool valid;
    double start, h;
    double *y, *k; /* (ny,), (STAGES, ny) */
    Node before;   /* start of the previous step; at start if the motion is not smooth from there */
} Arc;

/* The controller of the step size. */
typedef struct {
    double h;            /* of the next step */
    double log_of_error; /* of the latest accepted step, relative to the allowed error */
    double growth_max;   /* of the step size; 1 after a rejected step */
} StepSizeController;

/* The mode of a simulation.  lowest_bounce: the height of the lowest bounce that it resolves,
 * divided by the size of the mechanism. */
typedef struct {
    bool exchange; /* model exchange: an importer integrates */
    double lowest_bounce;
} SimulationMode;

/* All values from which a simulation continues. */
typedef struct {
    bool started;
    SimulationMode mode;
    double time, tolerance, frequency;
    double angle, energy; /* model exchange: magnitudes of the motion from the start [rad], [J] */
    double step_size, log_of_error; /* of the step size controller */
    double fastest_rate;            /* angular frequency of the fastest mode */
    double fastest_decay;           /* bound of the rate of the damping of springs */
    double front_time;
    bool has_k1;          /* whether k1 has the rates of the front */
    Arc arc;
    Event pending;        /* located, but not yet applied */
    double window_since;  /* start of the window in which events are counted */
    int window_count;
    bool interrupted;     /* the communication step was left before its end */
    double point;         /* the last communication point; in model exchange the last event */
    double longest;       /* recent longest communication step, at most a tenth of the period */
    ContactMode *modes;   /* (s + f,) of the contacts */
    int *sides;           /* (f,) to which slipping guides push, see ContactState */
    bool *driven;         /* (s,): whether stop.velocity has ever been non-zero */
    ContactPhase *touching;   /* (s,) contacts at compliant stops */
    SpringPhase *coils;       /* (coils,) phases of the springs, if one acts on one side */
    ContactStart *touches;       /* (s,) */
    Latched *latched;     /* (s,) */
    Wall *walls;          /* (s,) */
    double *numbers;      /* the arrays below, one after another */
    size_t number_count;
    double *values, *given;               /* parameters and inputs as set last */
    double *acting_values, *acting_given; /* parameters and inputs of the last restart */
    double *received;                     /* (3 per force): impulses that have acted */
    double *front, *k1;                   /* (ny,): state at the end of the last step, its rates */
    double *first;                        /* (c, 3 n): q, v and M phi at first touch */
    double *dents;                        /* (c, DENT_NUMBERS): the latest samples, see Dent */
    double *fastest;                      /* (n,): shape of the fastest mode */
    double *peaks;                        /* (stressed flexures, PEAK_NUMBERS), see peaks.c */
    double *floors;                       /* (s,): depth below zero at which gaps close */
    double *accepted;                     /* model exchange: (n,) angles of the last step */
    double *states;                       /* model exchange: the states as they were set */
} State;

/* The largest stress in a flexure at one time, with the number and position of its section. */
typedef struct {
    double time, stress, place, position;
} Sample;

/* The largest stress in a flexure so far.  known: the number of the last samples of the smooth
 * motion; ahead: whether next is a sample at the front, which counts once the time reaches it. */
typedef struct {
    double stress, time, position, known, ahead;
    Sample last[2], next;
} Peak;

enum { PEAK_NUMBERS = sizeof(Peak) / sizeof(double) };

/* Equations in a contact state that is being tried, and their evaluation. */
typedef struct {
    Equations equations;
    ContactState contacts;
    Evaluation evaluation;
    double *mobility; /* of the contacts at rest, see RestForces */
} Trial;

/* The motion at an impact.  soft: velocities after an impact without restitution. */
typedef struct {
    double *q, *v, *after, *soft; /* (n,) */
} Struck;

/* The state at which a guard is evaluated while its fall is located. */
typedef struct {
    double *y;             /* (ny,) */
    Complex *e;            /* (n,) */
    Evaluation evaluation; /* of guards that need forces */
    ForceRange forces;     /* of a step that ends there */
    double *k;             /* (STAGES, ny) of that step */
    double h;              /* size of the step to the impact that was located last [s] */
    int stop;              /* the stop of this impact; -1: none in this step */
} Located;

/* Working memory of a step and of the location of events in it. */
typedef struct {
    Evaluation evaluation; /* at the last stage */
    Reference reference;   /* at the start */
    ForceRange forces;
    double *end;           /* (ny,) */
    double *error, *coarse_error; /* (ny,) */
    double weights[GUARD_INTERVALS + 1][STAGES]; /* of the dense output at the samples */
    double *sample_y;      /* (2 n,) of each sample, or (ny,) with compliant stops */
    Complex *sample_e;     /* (d,) of each sample */
    Located located;
    Node middle;           /* of the latest step */
    bool has_middle;       /* whether the middle has been computed */
    double embedded_error; /* of the latest step; negative before it is computed */
    double *reach;         /* (d,), (n,) bounds of the changes of arms and coordinates */
    double *torques;       /* (even + 2,) of the springs in the fastest mode */
    double *response;      /* (even + 2,) accelerations by these torques */
    double *multipliers;   /* (r,) of that response */
} Stepping;

/* Groups of present quantities: outputs, the rates and, in model exchange, the front itself. */
enum {
    NOTHING = 0, PLACES = 1, MOTION = 2, BASE = 4, ENERGIES = 8, MOBILITIES = 16, RATES = 32,
    FRONT = 64, STRESSES = 128
};

/* The present state, its outputs and rates.  They are valid only if they are fresh: read them by
 * present_outputs and present_moment. */
typedef struct {
    double *y;             /* (ny,) */
    Complex *e;            /* (n,) */
    Reference reference;
    Evaluation evaluation; /* of the outputs */
    double *outputs;
    double *rates;         /* (ny,) */
    Evaluation rated;      /* the evaluation that the rates come from */
    int fresh;             /* the groups that are up to date */
} Present;

struct Simulation {
    Configuration configuration;
    State state;
    double *backup; /* the state before an attempt, as simulation_save writes it */
    Equations equations;
    double *forces; /* (3 per force): acting inputs */
    Trial trial;
    Struck struck;
    double *previous; /* the exchanged states before an event */
    Stepping stepping;
    Present present;
    ContactProblem contact_problem; /* at the position that needed it last */
    Evaluation at_front;   /* at the front, while contacts change */
    Correction correction; /* working memory of projections */
    ScratchBlock block;
    Scratch scratch; /* the whole block; who takes from a copy passes that copy on */
    ImpactListener *on_impact;
    void *listener;
    EventObserver *observe;
    void *observer;
    bool untouched; /* whether nothing has been set since the last communication point */
    double steps;   /* integration steps since the simulation was opened */
    size_t bytes;
};

#endif
