/* Reliability of native FMUs: an importer that checks the values behind each OK.
 *
 * It makes legal and illegal calls, damages saved states, and draws parameters.  Each sequence runs
 * in a process of its own with a limit of CPU time; the counts are in memory that all of them
 * share.
 */
#ifndef DRIVER_H
#define DRIVER_H

#include "importer.h"

/* --- plan.c ----------------------------------------------------------------------------------- */

/* Roles and tags of variables in a plan file. */
enum { FIXED = 'p', TUNABLE = 't', GEOMETRY = 'k', INPUT = 'u', OUTPUT = 'o' };
enum { GAP = 'g', COUNT = 'n', ENERGY = 'e', WORK = 'w', TOLERANCE = 'a',
       MOVING = 'm', /* what moves the wall of a stop */
       LENGTH = 'l', MASS = 'q', ACCELERATION = 'b' };

typedef struct {
    uint32_t reference;
    char type, role, tag; /* the type as in a job */
    double start, low, high, scale;
} Variable;

typedef struct {
    Variable *variables;
    size_t count;
    double step;     /* communication step [s] */
    double gap_atol; /* largest penetration of a rigid stop [m], of a mechanism of at most 1 m */
    double energy_rtol; /* of the largest energy: bound of the balance at tolerance 0 */
    double energy_factor; /* of the tolerance, added to energy_rtol */
    double call_seconds, process_seconds; /* CPU time of a call and of a process [s] */
} Plan;

bool plan_read(Plan *plan, const char *path);

/* Random numbers: splitmix64 (Steele, Lea, Flood 2014). */
typedef struct {
    uint64_t state;
} Random;

uint64_t random_bits(Random *random);
unsigned below(Random *random, unsigned count);
bool chance(Random *random, unsigned count); /* true once in count */
double uniform(Random *random, double low, double high);
/* A value over the bounds: by its logarithm if the bounds span decades. */
double drawn_over_bounds(Random *random, const Variable *variable);

/* --- subject.c: an instance, its counts and its oracles --------------------------------------- */

enum { STATUSES = 6 };

typedef enum {
    NOT_FINITE, PENETRATED, ENERGY_LOST, COUNT_FELL, ACCEPTED, CHANGED, SILENT, OVER_BUDGET,
    VIOLATIONS
} Violation;

typedef enum {
    RAN, REJECTED_AT_START, REJECTED_LATER, RESTORED, UNDONE, OUTCOMES
} Outcome;

typedef struct {
    unsigned long calls, statuses[STATUSES], illegal, sequences, steps, events;
    unsigned long violations[VIOLATIONS], outcomes[OUTCOMES], slow, crashed;
    double energy, penetration, call; /* largest of each: of its bound, [m], CPU time [s] */
} Counts;

typedef struct {
    const Library *library;
    const Job *job;
    const Plan *plan;
    Counts *counts;
    Random random;
    uint64_t seed;
    Instance log; /* receives messages */
    void *c;      /* component */
    bool two;     /* FMI 2.0 */
    double time, begun;
    uint32_t *references;    /* of the variables of type Real, then of the Integers */
    size_t reals, integers;
    double *values, *before; /* (reals + integers,), of the last and the previous observation */
    size_t *places;          /* in the plan */
    double tolerance;        /* of the integration */
    double length, mass, gravity; /* largest absolute values of parameters [m], [kg], [m/s2] */
    double balance, largest; /* energy [J]: balance at the reference, largest part since then */
    bool referenced, judges_gaps, judges_energy, keeps_walls;
    double *counted;         /* impact counts at the last observation, (integers,) */
} Subject;

#define F2 (&s->library->f2)
#define F3 (&s->library->f3)
/* Make a call of either version; count it, measure it, and return its status. */
#define EITHER(name2, arguments2, name3, arguments3)                                               \
    (call_begins(s), s->two ? call_ends(s, #name2, (int)F2->name2 arguments2)                      \
                            : call_ends(s, #name3, (int)F3->name3 arguments3))
#define BOTH(name, arguments) EITHER(name, arguments, name, arguments)
#define FINE(status) ((status) <= 1)

void call_begins(Subject *s);
int call_ends(Subject *s, const char *name, int status);
void violated(Subject *s, Violation kind, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

void subject_open(Subject *s, const Library *library, const Job *job, const Plan *plan,
                  Counts *counts, uint64_t seed);
void subject_close(Subject *s);
bool subject_instantiate(Subject *s);
void subject_free(Subject *s);
int subject_set(Subject *s, const Variable *variable, double value);
int subject_enter(Subject *s); /* set up the experiment, enter Initialization Mode */
int subject_exit(Subject *s);  /* leave Initialization Mode and, if needed, Event Mode */
int subject_update(Subject *s); /* update discrete states until they are final */
/* Make a communication step with its events. */
int subject_step(Subject *s, double size);
int subject_get_all(Subject *s, double *values);
/* Read all outputs; check that they are finite, and the laws that apply. */
void subject_observe(Subject *s);
void subject_new_reference(Subject *s);
bool same_values(const Subject *s, const double *one, const double *other);
/* Report the first value that differs. */
void must_be_same(Subject *s, const double *one, const double *other, const char *when);
size_t pick(Subject *s, const char *roles); /* index of a random variable with one of the roles */
double plausible(Subject *s, const Variable *variable);
void change_some(Subject *s, const char *roles, unsigned most);

/* --- the parts -------------------------------------------------------------------------------- */

void legal_and_illegal_calls(Subject *s, size_t actions);   /* calls.c */
void integrated_calls(Subject *s, size_t steps);            /* exchange.c */
void illegal_call(Subject *s);                              /* illegal.c */
void damaged_states(Subject *s, size_t trials);             /* states.c */
void drawn_parameters(Subject *s, size_t steps);            /* draws.c */

#endif
