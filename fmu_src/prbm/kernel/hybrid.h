/* What a simulation consists of; hybrid.c moves it, exchange.c lets somebody else integrate. */
#ifndef PRBM_HYBRID_H
#define PRBM_HYBRID_H

#include "simulation.h"

enum { WATCHED = 8 }; /* parts of a step at which the guards are looked at, at eighths of it */

enum { NO_EVENT, IMPACT, RELEASE, SLIP_SLIDE, SLIP_RUB, SLIDE, RUB };

/* Numbers of the state; all of them doubles, so that the state is one array. */
typedef struct {
    double started, exchange, time, tolerance, frequency;
    double h, log_of_error, has_k1; /* error: of the last step, to what the tolerance allows */
    double front_time;
    double window_since, window_count; /* of the events that are counted against chatter */
    double has_arc, arc_start, arc_h, arc_end;
    double event_kind, event_index, event_time;
    double underway, underway_until; /* a communication step that was left in its middle */
    double planned, due; /* when the motions of the walls were, and by when they are to be there */
    double adrift; /* inputs came in an event in its middle: the walls go on to its end */
} Scalars;

typedef struct {
    double count, time, approach_speed, rebound_speed, impulse, energy_lost, modal_restitution;
    double impulse_sum; /* of all impulses so far, those that were captured too */
} Latched;

typedef struct {
    int kind, index;
    double time;
} Event;

enum { NOTHING = 0, PLACES = 1, MOTION = 2, BASE = 4, ENERGIES = 8, MOBILITIES = 16 }; /* outputs */

struct Simulation {
    const Mechanism *mechanism;
    Hear *hear;
    void *listener;
    size_t bytes;
    System system;
    Equations equations, trial;
    Scratch scratch;
    /* the state, one array of doubles, and where its parts are */
    double *state, *backup;
    size_t state_count;
    Scalars *now;
    double *values, *given;               /* as they were set */
    double *acting_values, *acting_given; /* since the last restart */
    double *received;                     /* (3 b,): impulses that have acted */
    double *swift;                        /* (s,): 1 for a wall that was given a velocity */
    Wall *walls;                          /* (s,) */
    double *holds, *slides, *rubs;        /* the discrete state */
    Latched *latched;                     /* (s,) */
    double *front, *k1;                   /* (ny,): the end of the last step, its rates */
    double *arc_y, *arc_k;                /* (ny,), (STAGES, ny): the last step */
    double *states;                       /* model exchange: as they were set */
    double *floors;                       /* (s,): below which a gap closes */
    double *held_rates, *held_times;      /* (s,): of the walls at the last event, and its time */
    /* not state: what can be computed again */
    Discrete discrete, other;
    double omega, energy_scale, spring_rate;
    double *forces; /* (3 b,) acting inputs */
    double grid[WATCHED + 1][STAGES]; /* weights of the stages at the looks */
    double *look_y, *look_gap, *look_rate, *y1, *error;
    Complex *look_e, *e;
    double *outputs, *y, *rates, *a, *lam;
    const double *at;  /* the state at which indicators and derivatives are evaluated */
    int fresh;         /* the groups of outputs that are up to date */
    bool assembled;    /* whether the system is that of the acting values */
    bool stale;        /* model exchange: states, time or inputs have changed */
    bool evaluated;    /* model exchange: the equations and rates are those of the front */
};

PRBM int state_size(const Simulation *sim); /* ny = 2 n + 2 */
PRBM double omega_scale(const Simulation *sim);
PRBM double still(const Simulation *sim);
PRBM double period(const Simulation *sim);
PRBM double wall_target(const Simulation *sim, int i, double h);
PRBM void read_discrete(Simulation *sim);
PRBM void set_discrete(Simulation *sim, const Discrete *discrete);
PRBM void set_inputs(Simulation *sim);
PRBM bool take_values(Simulation *sim, Problem *problem);
PRBM bool settle(Simulation *sim, const int *resting, int resting_count, const Event *event,
                 Problem *problem);
PRBM bool impact(Simulation *sim, int hit, Problem *problem);
PRBM bool count_event(Simulation *sim, double time, int kind, Problem *problem);
PRBM void without_hold(Simulation *sim, int stop);
PRBM bool impulses_changed(const Simulation *sim);
PRBM bool receive_impulses(Simulation *sim, Problem *problem);
PRBM int unsettled(Simulation *sim);
PRBM bool update_outputs(Simulation *sim, int groups, Problem *problem);
PRBM double margin_release(const Simulation *sim, int k);
PRBM double margin_stick(const Simulation *sim, int k);
PRBM double margin_rub(const Simulation *sim, int k);
/* exchange.c */
PRBM bool exchange_refresh(Simulation *sim, Problem *problem);
PRBM void exchange_begin(Simulation *sim);
PRBM bool exchange_value(Simulation *sim, int slot, double *x, Problem *problem);

#endif
