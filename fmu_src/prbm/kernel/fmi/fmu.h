/* An instance of an FMU: the common part of FMI 2.0 and FMI 3.0.
 *
 * fmi2.c and fmi3.c translate the functions of the two standards to the ones declared here.  An
 * instance is a simulation, a state of the standard's state machine, and the rejected values that
 * the importer has not yet corrected.
 */
#ifndef PRBM_FMU_H
#define PRBM_FMU_H

#include "motion.h"

/* The status of a call, with the same numbers in both standards. */
enum { FMU_OK, FMU_WARNING, FMU_DISCARD, FMU_ERROR, FMU_FATAL };

enum { NO_TYPE = -1 }; /* A type of the standard that no variable of these FMUs has. */

typedef enum { MODEL_EXCHANGE, CO_SIMULATION, KINDS } Kind;

typedef enum {
    MODE_INSTANTIATED,
    MODE_INITIALIZATION,
    MODE_EVENT,
    MODE_CONTINUOUS,
    MODE_STEP,
    MODE_INTERMEDIATE,
    MODE_TERMINATED,
    MODES
} Mode;

/* Sets of modes. */
enum {
    IN_INSTANTIATED = 1 << MODE_INSTANTIATED,
    IN_INITIALIZATION = 1 << MODE_INITIALIZATION,
    IN_EVENT = 1 << MODE_EVENT,
    IN_CONTINUOUS = 1 << MODE_CONTINUOUS,
    IN_STEP = 1 << MODE_STEP,
    IN_INTERMEDIATE = 1 << MODE_INTERMEDIATE,
    IN_TERMINATED = 1 << MODE_TERMINATED,
    IN_NONE = 0,
    IN_ANY_BUT_UPDATE = (1 << MODES) - 1 - IN_INTERMEDIATE,
    IN_ANY = (1 << MODES) - 1
};

/* A function of a standard and the modes in which it may be called. */
typedef struct {
    const char *function;
    unsigned modes[KINDS];
} Rule;

/* The function that leads from a mode to the next one, NULL if no function does. */
typedef struct {
    const char *function;
    Mode next;
} ModeTransition;

/* The names that a version of the standard gives to functions, types and modes. */
typedef struct {
    int version;
    const char *prefix; /* The first part of the names of functions. */
    const char *types[CLOCK + 1];
    const char *modes[MODES];
    ModeTransition transitions[KINDS][MODES];
} Standard;

/* The destination of messages.  send casts the importer's callback to its type and calls it. */
typedef void Callback(void);
typedef struct Journal Journal;
typedef void Send(const Journal *journal, int status, const char *category, const char *text);

struct Journal {
    const char *instance; /* Name of the instance. */
    void *environment;
    Callback *callback; /* NULL if the importer has no logger. */
    Send *send;
    const char *special; /* Characters that are doubled in a message, as % in a format. */
    unsigned categories; /* Bits of the categories that are logged. */
};

enum {
    LOG_EVENTS = 1,
    LOG_WARNING = 2,
    LOG_DISCARD = 4,
    LOG_ERROR = 8,
    LOG_FATAL = 16,
    LOG_NOTHING = 0,
    LOG_EVERYTHING = 31
};

typedef struct Instance Instance;

/* An intermediate update; returns whether the importer requests the end of the step. */
typedef bool Update(Instance *instance);

/* The arguments of an instantiation. */
typedef struct {
    const Standard *standard;
    Kind kind;
    Journal journal;
    const char *token, *resources;
    bool event_mode, early_return; /* Co-simulation of FMI 3.0. */
    Update *update;                /* NULL if there are no intermediate updates. */
    Callback *intermediate;        /* The importer's callback for intermediate updates. */
    const uint32_t *required;      /* References of variables that this callback may get. */
    size_t required_count;
} Request;

struct Instance {
    const Standard *standard;
    Kind kind;
    Journal journal;
    bool event_mode, early_return;
    Update *update;
    Callback *intermediate;
    uint32_t *required;
    size_t required_count;
    bool clocks; /* Whether the FMU has clocks. */
    Mechanism *mechanism;
    Simulation *simulation;
    int states, indicators; /* Numbers of states and event indicators in model exchange. */

    Mode mode;
    bool experiment;         /* Whether fmi2SetupExperiment was called. */
    bool experiment_refused; /* Whether the last call of fmi2SetupExperiment was rejected. */
    bool stop_defined, tolerance_defined;
    double start_time, stop_time, tolerance;
    bool event_due;      /* An event is to be handled in Event Mode before the next step. */
    bool updated;        /* The discrete states are up to date since Event Mode was entered. */
    int last_step;       /* Status of the last step. */
    double depth_logged; /* Penetration of a wall at the last warning [m]. */
    bool unknown_refused;
    uint32_t unknown;       /* Value reference of a rejected set that is not in the model. */
    unsigned char *refused; /* (slots.count,): 1 for variables whose last set was rejected. */
    double *acknowledged;   /* (stops,): impacts for which the clock of a stop has ticked. */

    int *state_of;          /* (slots.count,): index of the state in a slot, or -1. */
    double *before, *after; /* Saved states of the simulation: before a call, and to restore. */
    double *x, *dx, *du;    /* (states,), (states,), (inputs,) */
    double *dp;             /* (parameters,) */
    double *dvalues;        /* (slots.count,) */
    double *shifted;        /* (slots.count,): values at other parameters */
};

/* A copy of an instance's state as bytes, in the same format on every platform. */
typedef struct {
    size_t size;
    unsigned char *bytes;
} Saved;

/* The result of a step: whether it has an event, whether it returns early, and its end time [s]. */
typedef struct {
    bool event, early;
    double time;
} Outcome;

/* --- resources.c ------------------------------------------------------------------------------ */

/* Read the tables; the caller frees the result. */
PRBM Mechanism *tables_read(const char *resources, Problem *problem);

/* --- journal.c -------------------------------------------------------------------------------- */

#if defined(__GNUC__)
PRBM void report(const Journal *journal, int status, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
PRBM int refuse(const Instance *instance, int status, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
#else
PRBM void report(const Journal *journal, int status, const char *format, ...);
PRBM int refuse(const Instance *instance, int status, const char *format, ...);
#endif
PRBM int choose_categories(Instance *instance, const Rule *rule, bool on, size_t count,
                           const char *const *names);
PRBM void log_impact(void *listener, const Impact *impact);

#define TO_RESET "reset the instance to start again"

/* --- instance.c ------------------------------------------------------------------------------- */

PRBM Instance *instance_open(const Request *request);
PRBM void instance_close(Instance *instance);
/* Return the instance of a handle if the rule allows the call; otherwise log the reason and return
 * NULL. */
PRBM Instance *allowed(void *handle, const Rule *rule);
/* Reject a NULL pointer to count elements; NULL is valid if count is 0. */
PRBM bool given(const Instance *instance, const Rule *rule, size_t count, const void *pointer);
PRBM int set_up(Instance *instance, bool tolerance_defined, double tolerance, double start_time,
                bool stop_defined, double stop_time);
PRBM int exit_initialization(Instance *instance);
PRBM int end_run(Instance *instance);
PRBM int reset(Instance *instance);
PRBM bool is_parameter(const Mechanism *mechanism, int slot);
PRBM bool is_input(const Mechanism *mechanism, int slot);
PRBM bool settable(const Mechanism *mechanism, int slot);
PRBM const char *name_of(const Mechanism *mechanism, int slot);
PRBM bool has_rejected(const Instance *instance, int status);
PRBM double impact_count(const Instance *instance, int stop);
PRBM void acknowledge(Instance *instance);
PRBM bool started(Instance *instance);
/* Start co-simulation or model exchange. */
PRBM bool start_instance(Instance *instance, Problem *problem);

/* --- values.c --------------------------------------------------------------------------------- */

PRBM int read_value(Instance *instance, uint32_t reference, int type, double *x);
PRBM int write_value(Instance *instance, uint32_t reference, int type, double x);
PRBM int read_clock(Instance *instance, uint32_t reference, bool *active);
PRBM bool ticks(const Instance *instance, const Variable *clock);

/* --- step.c ----------------------------------------------------------------------------------- */

PRBM int make_step(Instance *instance, double time, double size, Outcome *outcome);
PRBM int enter_event_mode(Instance *instance);
PRBM int update_discrete_states(Instance *instance, bool *again, bool *changed);
PRBM int leave_event_mode(Instance *instance, const Rule *rule, Mode next);
PRBM void keep(Instance *instance);
PRBM void go_back(Instance *instance);

/* --- exchange.c ------------------------------------------------------------------------------- */

PRBM int set_time(Instance *instance, double time);
PRBM int set_states(Instance *instance, const double *x, size_t count);
PRBM int get_states(Instance *instance, double *x, size_t count);
PRBM int get_nominals(Instance *instance, double *x, size_t count);
PRBM int get_derivatives(Instance *instance, double *dx, size_t count);
PRBM int get_indicators(Instance *instance, double *z, size_t count);
PRBM int completed_step(Instance *instance, bool *event);
PRBM int directional_derivative(Instance *instance, const uint32_t *unknowns, size_t unknown_count,
                                const uint32_t *knowns, size_t known_count, const double *seed,
                                double *sensitivity);

/* --- state.c ---------------------------------------------------------------------------------- */

PRBM int save_state(const Instance *instance, void **state);
PRBM int restore_state(Instance *instance, const void *state);
PRBM void free_state(void **state);
PRBM int serialize(const Instance *instance, const void *state, unsigned char *bytes, size_t size);
PRBM int deserialize(const Instance *instance, const unsigned char *bytes, size_t size,
                     void **state);

#endif
