/* The parts of a simulation; the event loop that co-simulation and model exchange share. */
#ifndef PRBM_HYBRID_H
#define PRBM_HYBRID_H

#include "generated.h"
#include "simulation.h"

#define TWO_PI 6.283185307179586

/* --- configuration.c -------------------------------------------------------------------------- */

/* Units of the motion: the size, the fundamental frequency, one radian against the stiffest spring
 * and the period. */
typedef struct {
    double length, rate, energy, time;
} Scales;

/* The assembled mechanism; constant between two changes of parameters. */
typedef struct {
    const Mechanism *mechanism;
    System system;
    double omega; /* of the fundamental mode; 0 without one */
    Scales scales;
    bool assembled; /* whether the system is that of the acting values */
} Configuration;

PRBM void set_scales(Configuration *configuration, double frequency);
PRBM bool take_values(Simulation *sim, Problem *problem); /* the values set become acting ones */
PRBM bool values_changed(const Simulation *sim);
PRBM bool inputs_changed(const Simulation *sim); /* but those that move walls */
PRBM double zero_speed(const Configuration *configuration); /* lower speeds are round-off */
PRBM double zero_acceleration(const Configuration *configuration); /* the same of accelerations */
PRBM double stop_field(const Simulation *sim, Expression field);

/* --- events.c --------------------------------------------------------------------------------- */

typedef struct {
    EventKind kind;
    int contact;
    double time;
} Event;

/* A state at which guards are evaluated; lam may be NULL for guards without forces. */
typedef struct {
    double time;
    const double *q, *v;
    const Complex *e;
    const double *lam;
} Instant;

/* --- guards.c --------------------------------------------------------------------------------- */

typedef double GuardValue(const Equations *equations, const Instant *at, int contact);

/* The scalar z of a kind of event, positive before it: the event is the fall z > 0 -> z <= 0. */
typedef struct {
    const char *event;
    GuardValue *value;
    bool forces; /* whether it needs multipliers */
} Guard;

/* Whether and when a guard falls in the latest step. */
typedef struct {
    bool found;
    double time;
} Fall;

PRBM double release_guard(const Equations *equations, const Instant *at, int contact);
PRBM double slip_guard(const Equations *equations, const Instant *at, int contact);
PRBM double reversal_guard(const Equations *equations, const Instant *at, int contact);
PRBM double gap_guard(const Equations *equations, const Instant *at, int contact);
/* The contacts at which events may occur. */
PRBM bool held_stop(const Equations *equations, int contact);
PRBM bool sticking_contact(const Equations *equations, int contact);
PRBM bool slipping_contact(const Equations *equations, int contact);
PRBM bool open_stop(const Equations *equations, int contact);
/* Whether events may occur in the latest step at any contact. */
PRBM bool release_near(Simulation *sim);
PRBM bool slip_near(Simulation *sim);
PRBM bool reversal_near(Simulation *sim);
PRBM bool impact_near(Simulation *sim);
/* When the guard of a contact falls first in the latest step; a fall that has not been found is
 * given. */
PRBM bool yield_time(Simulation *sim, const Guard *guard, int contact, Fall *fall,
                     Problem *problem);
PRBM bool reversal_time(Simulation *sim, const Guard *guard, int contact, Fall *fall,
                        Problem *problem);
PRBM bool closing_time(Simulation *sim, const Guard *guard, int stop, Fall *fall,
                       Problem *problem);
PRBM void sample_arc(Simulation *sim); /* for reversal_time and closing_time */

/* --- events.c --------------------------------------------------------------------------------- */

typedef bool Watched(const Equations *equations, int contact);
typedef bool Near(Simulation *sim);
typedef bool Detect(Simulation *sim, const Guard *guard, int contact, Fall *fall,
                    Problem *problem);
typedef bool Reset(Simulation *sim, const Event *event, Problem *problem);

/* A row of the table of events. */
typedef struct {
    Guard guard;
    Watched *watched; /* whether the event may occur at a contact */
    Near *near;       /* whether it may occur in the latest step */
    bool samples;     /* whether its detection needs the samples of the step */
    Detect *detect;
    Reset *reset;     /* the change of state at the event */
} Transition;

/* The rows are in the order of the kinds, in which events of one time are applied. */
PRBM const Transition *transition(EventKind kind);
/* The first event within the latest step, of kind EVENT_NONE without one. */
PRBM bool first_event(Simulation *sim, Event *first, Problem *problem);
PRBM bool apply_event(Simulation *sim, const Event *event, Problem *problem);

/* --- simulation.c: state and parts ------------------------------------------------------------ */

/* Values of the latest impact at a stop, and sums over all impacts. */
typedef struct {
    int count;
    double time, approach_speed, rebound_speed, impulse, energy_lost, modal_restitution;
    double impulse_sum; /* of all impulses so far, captures included */
} Latched;

/* The latest step with its dense output. */
typedef struct {
    bool valid;
    double start, h;
    double *y, *k; /* (ny,), (STAGES, ny) */
} Arc;

/* The step sizes and errors that the controller remembers. */
typedef struct {
    double h, log_of_error; /* of the next step; of the latest, relative to the allowed one */
    double growth_max;      /* 1 after a rejected step */
} StepSizeController;

/* The mode of a simulation, and the height of a bounce that it cannot resolve, of the size. */
typedef struct {
    bool exchange; /* model exchange: an importer integrates */
    double lowest_bounce;
} SimulationMode;

/* Everything that a simulation continues from. */
typedef struct {
    bool started;
    SimulationMode mode;
    double time, tolerance, frequency;
    double step_size, log_of_error; /* of the step size controller */
    double front_time;
    bool has_k1;          /* whether k1 holds the rates of the front */
    Arc arc;
    Event pending;        /* located, but not yet applied */
    double window_since;  /* start of the window in which events are counted */
    int window_count;
    bool interrupted;     /* the communication step was left before its end */
    double point;         /* the last communication point; in model exchange the last event */
    double longest;       /* the recent longest communication step */
    int *modes;           /* (s + f,) of the contacts */
    bool *driven;         /* (s,): whether stop.velocity has ever been non-zero */
    Latched *latched;     /* (s,) */
    Wall *walls;          /* (s,) */
    double *numbers;      /* the arrays below, one behind the other */
    size_t number_count;
    double *values, *given;               /* as they were set */
    double *acting_values, *acting_given; /* since the last restart */
    double *received;                     /* (3 b,): impulses that have acted */
    double *front, *k1;                   /* (ny,): the end of the last step, its rates */
    double *floors;                       /* (s,): gaps close this far below zero */
    double *displacements;                /* (s,): stop.displacement at the last point */
    double *accepted;                     /* model exchange: (n,) angles of the last step */
    double *states;                       /* model exchange: as they were set */
} State;

/* Equations in a contact state that is being tried, and their evaluation. */
typedef struct {
    Equations equations;
    ContactState contacts;
    Evaluation evaluation;
} Trial;

/* The state at which a guard is evaluated in the search for its fall. */
typedef struct {
    double *y;             /* (ny,) */
    Complex *e;            /* (n,) */
    Evaluation evaluation; /* of guards that need forces */
} Located;

/* Working memory of a step and of the location of events in it. */
typedef struct {
    Evaluation evaluation; /* at the last stage */
    Reference reference;   /* at the start */
    ForceRange forces;
    double *end, *error;   /* (ny,) */
    double weights[GUARD_INTERVALS + 1][STAGES]; /* of the dense output at the samples */
    double *sample_y;      /* (2 n,), (n,) of each */
    Complex *sample_e;
    Located located;
    double *reach;         /* (n,) largest changes of the arms */
} Stepping;

/* Groups of present quantities: outputs, the rates and, in model exchange, the front itself. */
enum {
    NOTHING = 0, PLACES = 1, MOTION = 2, BASE = 4, ENERGIES = 8, MOBILITIES = 16, RATES = 32,
    FRONT = 64
};

/* The present state, its outputs and rates, as far as they are up to date: read them by
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
    double *backup; /* the state before an attempt, as numbers */
    Equations equations;
    double *forces; /* (3 b,) acting inputs */
    Trial trial;
    Stepping stepping;
    Present present;
    Evaluation at_front;   /* of the present equations at the front, while contacts change there */
    Correction correction; /* working memory of projections */
    Scratch scratch;
    Hear *hear;
    void *listener;
    size_t bytes;
};

PRBM int state_size(const Simulation *sim); /* ny = 2 n + 2 */
PRBM const System *system_of(const Simulation *sim);
PRBM int contact_count(const Simulation *sim);
PRBM Complex *directions_at(Simulation *sim, const double *q); /* in working memory */
PRBM void set_inputs(Simulation *sim); /* the equations of the present contacts and inputs */
PRBM void set_contacts(Simulation *sim, const int *modes);
PRBM void set_mode(Simulation *sim, int contact, int mode);
/* Start the motion; the caller keeps a backup for the case of failure. */
PRBM bool start_motion(Simulation *sim, double start_time, double tolerance, SimulationMode mode,
                       Problem *problem);

/* --- arc.c ------------------------------------------------------------------------------------ */

PRBM void arc_at(const Simulation *sim, double t, double *y);
/* The state at the present time, on the constraints; near becomes a reference near it, and the
 * evaluation is working memory. */
PRBM bool arc_state(Simulation *sim, double *y, Reference *near, Evaluation *evaluation,
                    Problem *problem);

/* --- walls.c ---------------------------------------------------------------------------------- */

PRBM void start_walls(Simulation *sim);
PRBM bool same_walls(const Simulation *sim);
PRBM bool join_walls(Simulation *sim, double time, Wall *joined);
PRBM double jump_allowed(const Simulation *sim, int i);
PRBM bool new_velocity(const Simulation *sim, int i);
PRBM Wall wall_at_event(const Simulation *sim, int i);
PRBM Wall pushed_wall(const Wall *wall, double t, double change);
PRBM double wall_reach(const Wall *wall, double h);
PRBM double longest_wall_step(const Simulation *sim);
PRBM void arrive_walls(Simulation *sim);
PRBM bool follow_walls(Simulation *sim, bool drifted, double time, Problem *problem);

/* --- impacts.c -------------------------------------------------------------------------------- */

/* Directions, mass matrix and Jacobian of the loops at a position, in working memory. */
typedef struct {
    Complex *e;
    double *M, *loops;
} Inertia;

PRBM Inertia inertia_at(Simulation *sim, const double *q);
PRBM bool mobility(Simulation *sim, const Inertia *at, int r, const double *held,
                   const double *row, double *result, Problem *problem);
PRBM bool impact(Simulation *sim, int hit, Problem *problem);
PRBM bool impulses_changed(const Simulation *sim);
PRBM const double *given_impulses(const Simulation *sim);
PRBM bool receive_impulses(Simulation *sim, Problem *problem);

PRBM void contact_mobility(int k, int n, const double *rows, const double *X, double *W);

/* --- rest.c ----------------------------------------------------------------------------------- */

enum { CONTACTS_MAX = 2 * STOPS_MAX, NAMES_LENGTH = PROBLEM_LENGTH / 2 };

/* Stops that touch, with the signs of their sliding velocities; contacts with friction and without
 * a sliding velocity: some of the stops, and points. */
typedef struct {
    int stop_count, stops[STOPS_MAX], slips[STOPS_MAX];
    int count, contacts[CONTACTS_MAX];
} RestContacts;

/* Their forces and accelerations: the acceleration that each normal force alone gives its gap;
 * friction, its limits and the accelerations of sliding. */
typedef struct {
    bool solved;
    double normal[STOPS_MAX];
    double friction[CONTACTS_MAX], limit[CONTACTS_MAX], slide[CONTACTS_MAX];
} RestForces;

typedef struct {
    char text[NAMES_LENGTH];
} ContactNames;

/* The forces that satisfy the laws of all contacts.  In the trial equations all stops are open, and
 * friction points at rest have no friction. */
PRBM bool rest_forces(Simulation *sim, const double *q, const double *v,
                      const RestContacts *rest, RestForces *found, Problem *problem);
PRBM const char *contact_name(const Mechanism *m, int contact);
PRBM bool has_contact(int count, const int *contacts, int contact);
/* The names of contacts, or as many of them as there is room for. */
PRBM void list_contacts(const Mechanism *m, int count, const int *contacts, ContactNames *names);
PRBM bool contacts_jammed(const Simulation *sim, int count, const int *contacts, Problem *problem);

/* --- contact_modes.c -------------------------------------------------------------------------- */

/* The stops that stay closed, and the acceleration at which the others open; whether there are any
 * that are pressed while the others open. */
typedef struct {
    int count, stops[STOPS_MAX];
    double opening;
    bool found;
} HoldingSet;

PRBM bool find_holding_stops(Simulation *sim, int count, const int *candidates, const double *q,
                             const double *v, HoldingSet *resting, Problem *problem);
PRBM bool holding_stops(Simulation *sim, int count, const int *candidates, const double *q,
                       const double *v, HoldingSet *resting, Problem *problem);
/* The trial equations in which a set of stops is closed; what slides has friction. */
PRBM const Equations *equations_holding(Simulation *sim, const HoldingSet *resting,
                                        const double *q, const double *v);
PRBM bool settle(Simulation *sim, const int *touching, int touching_count, const Event *event,
                 Problem *problem);
PRBM bool settle_moved(Simulation *sim, Problem *problem); /* after velocities have jumped */

/* --- stepping.c ------------------------------------------------------------------------------- */

PRBM double longest_step(const Simulation *sim);
PRBM bool take_step(Simulation *sim, Problem *problem);

/* --- snapshot.c ------------------------------------------------------------------------------- */

PRBM void keep_backup(Simulation *sim);
PRBM bool attempt(Simulation *sim, bool right, Problem *problem); /* back to the backup, or right */

/* --- outputs.c -------------------------------------------------------------------------------- */

PRBM int output_groups(const Simulation *sim, int slot);
PRBM bool compute_outputs(Simulation *sim, int groups, bool near, Problem *problem);

/* --- present.c -------------------------------------------------------------------------------- */

/* A state, its rates (ny,) and the evaluation that they come from. */
typedef struct {
    Instant at;
    const double *rates;
    const Evaluation *evaluation;
} Moment;

PRBM void forget_present(Simulation *sim); /* time, states, inputs or parameters have been set */
PRBM void forget_outputs(Simulation *sim); /* the front or its equations have changed */
/* The present moment at the present state y. */
PRBM bool moment_at(Simulation *sim, const double *y, Moment *now, Problem *problem);

/* --- dependents.c ----------------------------------------------------------------------------- */

/* The loops in the dependent coordinates, in working memory. */
typedef struct {
    int *dependent, *pivot; /* (r,) */
    double *rows, *a, *s;   /* (r, n), (r, r) factored, (r,) residuals */
} Loops;

PRBM Loops take_loops(Simulation *sim);
/* The loops' Jacobian in the dependent coordinates, from all rows. */
PRBM bool factor_dependents(const Simulation *sim, Loops *loops);
PRBM bool singular_choice(const Simulation *sim, const int *dependent, Problem *problem);
PRBM bool complete(Simulation *sim, double *q, double *v, Problem *problem);
PRBM void states_of(const Simulation *sim, const double *y, double *x);

/* --- indicators.c ----------------------------------------------------------------------------- */

PRBM int indicator_place(const Simulation *sim, EventKind kind, int contact);
PRBM double guard_scale(const Simulation *sim, EventKind kind);
PRBM double lifted_guard(const Simulation *sim, const Instant *at, EventKind kind, int contact);
PRBM double leaving_rate(const Simulation *sim, const Instant *at, int i);
PRBM double release_indicator(const Simulation *sim, const Instant *at, int i);
PRBM void event_indicators(const Simulation *sim, const Instant *at, double *z);

/* --- model_exchange.c ------------------------------------------------------------------------- */

PRBM void exchange_begin(Simulation *sim);
PRBM bool exchange_refresh(Simulation *sim, Problem *problem);
PRBM bool exchange_moment(Simulation *sim, Moment *now, Problem *problem);

/* --- values.c --------------------------------------------------------------------------------- */

/* The vector of outputs with these groups up to date; NULL if they cannot be computed. */
PRBM const double *present_outputs(Simulation *sim, int groups, Problem *problem);
PRBM bool present_moment(Simulation *sim, Moment *now, Problem *problem);

#endif
