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

enum { NO_TYPE = -1 }; /* of a variable: one that no variable here has */

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

/* The function that leads from a mode to the next one, NULL where none does. */
typedef struct {
    const char *function;
    Mode next;
} Way;

/* How a standard calls things. */
typedef struct {
    int version;
    const char *prefix;         /* of its functions */
    const char *types[CLOCK + 1];
    const char *modes[MODES];
    Way ways[KINDS][MODES];
} Standard;

/* Where messages go.  The callback is the importer's; send knows its type. */
typedef void Callback(void);
typedef struct Journal Journal;
typedef void Send(const Journal *journal, int status, const char *category, const char *text);

struct Journal {
    const char *instance; /* its name */
    void *environment;
    Callback *callback; /* NULL: nobody listens */
    Send *send;
    const char *special; /* what is doubled in a message, because it would begin something */
    unsigned categories; /* which are wanted, by their bits */
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

/* An intermediate update; true if the importer wants the step to end here. */
typedef bool Update(Instance *instance);

/* What the importer asks for when it instantiates. */
typedef struct {
    const Standard *standard;
    Kind kind;
    Journal journal;
    const char *token, *resources;
    bool event_mode, early_return; /* co-simulation of FMI 3.0 */
    Update *update;                /* NULL: no intermediate updates */
    Callback *intermediate;        /* the importer's */
    const uint32_t *required;      /* variables to get in intermediate updates */
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
    bool clocks; /* whether there are any */
    Mechanism *mechanism;
    Simulation *simulation;
    int states, indicators; /* numbers of them in model exchange */

    Mode mode;
    bool experiment;         /* whether it was set up (FMI 2.0) */
    bool experiment_refused; /* and had a mistake in it */
    bool stop_defined, tolerance_defined;
    double start_time, stop_time, tolerance;
    bool event_due; /* an event waits for the end of Event Mode */
    bool updated;   /* the discrete states were, since Event Mode was entered */
    int last_step;  /* status of the last step */
    double depth_told; /* m in a wall, of the last warning */
    bool unknown_refused;
    uint32_t unknown;       /* a reference that was set and is none */
    unsigned char *refused; /* (slots.count,): a set of it was refused and not yet put right */
    double *acknowledged;   /* (stops,): impacts that its clock has ticked for */

    int *state_of;           /* (slots.count,): which state a slot is, -1 for none */
    double *before, *after;  /* states of the simulation: to go back to, to go to */
    double *x, *dx, *du;     /* (states,), (states,), (inputs,) */
    double *dvalues;         /* (slots.count,) */
};

/* A copy of an instance's state, as bytes that mean the same on every platform. */
typedef struct {
    size_t size;
    unsigned char *bytes;
} Saved;

/* What came of a step. */
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
PRBM void hear_impact(void *listener, const Impact *impact);

#define TO_RESET "reset the instance to start again"

/* --- instance.c ------------------------------------------------------------------------------- */

PRBM Instance *instance_open(const Request *request);
PRBM void instance_close(Instance *instance);
/* The instance of a handle if the rule allows the call; otherwise NULL, and the reason is logged. */
PRBM Instance *allowed(void *handle, const Rule *rule);
/* Reject a NULL pointer to count elements; no pointer is needed for none. */
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
PRBM bool stands(const Instance *instance, int status);
PRBM double impact_count(const Instance *instance, int stop);
PRBM void acknowledge(Instance *instance);
PRBM bool started(Instance *instance);

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
