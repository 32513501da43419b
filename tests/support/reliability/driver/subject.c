/* An instance under test: calls, observations, and the laws that the observed values obey. */
#include "driver.h"

#include <float.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { SHOWN_VIOLATIONS = 40, UPDATES_MAX = 100, EVENTS_MAX = 5000 };
static const double RESTORED_RTOL = 1e-6; /* of a value or its nominal value */

/* --- counts --- */

static double cpu_seconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

void violated(Subject *s, Violation kind, const char *format, ...) {
    static const char *const names[VIOLATIONS] = {
        "not finite", "penetrated", "energy", "count fell", "accepted", "changed", "silent",
        "over budget",
    };
    unsigned long total = 0;
    va_list arguments;
    s->counts->violations[kind]++;
    for (int i = 0; i < VIOLATIONS; i++) {
        total += s->counts->violations[i];
    }
    if (total > SHOWN_VIOLATIONS) {
        return;
    }
    fprintf(stderr, "%s: seed %llu, t = %.9g s: ", names[kind], (unsigned long long)s->seed,
            s->time);
    va_start(arguments, format);
    vfprintf(stderr, format, arguments);
    va_end(arguments);
    fprintf(stderr, "\n");
}

void call_begins(Subject *s) {
    s->log.message[0] = '\0';
    s->begun = cpu_seconds();
}

int call_ends(Subject *s, const char *name, int status) {
    double spent = cpu_seconds() - s->begun;
    Counts *counts = s->counts;
    counts->calls++;
    counts->statuses[status >= 0 && status < STATUSES ? status : STATUSES - 1]++;
    counts->call = fmax(counts->call, spent);
    if (spent > s->plan->call_seconds) {
        violated(s, OVER_BUDGET, "%s took %.3g s of CPU time", name, spent);
    }
    if (!FINE(status) && !s->log.message[0] && s->c) {
        violated(s, SILENT, "%s returned %d without a message", name, status);
    }
    return status;
}

/* --- opening --- */

/* List the outputs of a type; return their number. */
static size_t list_outputs(Subject *s, char type, size_t first) {
    size_t at = first;
    for (size_t i = 0; i < s->plan->count; i++) {
        const Variable *v = s->plan->variables + i;
        if (v->role == OUTPUT && v->type == type) {
            s->references[at] = v->reference;
            s->places[at++] = i;
        }
    }
    return at - first;
}

/* Note a value on which a bound of the oracles depends: the tolerance, or the largest sizes. */
static void note_parameter(Subject *s, const Variable *variable, double value) {
    switch (variable->tag) {
    case TOLERANCE: s->tolerance = value; break;
    case LENGTH: s->length = fmax(s->length, fabs(value)); break;
    case MASS: s->mass = fmax(s->mass, fabs(value)); break;
    case ACCELERATION: s->gravity = fmax(s->gravity, fabs(value)); break;
    default: break;
    }
}

void subject_open(Subject *s, const Library *library, const Job *job, const Plan *plan,
                  Counts *counts, uint64_t seed) {
    fmi2CallbackFunctions callbacks = {logger2, calloc, free, NULL, &s->log};
    memset(s, 0, sizeof *s);
    s->library = library;
    s->job = job;
    s->plan = plan;
    s->counts = counts;
    s->seed = s->random.state = seed;
    s->two = job->version == 2;
    s->log.callbacks = callbacks;
    s->references = calloc(plan->count, sizeof *s->references);
    s->places = calloc(plan->count, sizeof *s->places);
    s->values = calloc(plan->count, sizeof *s->values);
    s->before = calloc(plan->count, sizeof *s->before);
    s->counted = calloc(plan->count, sizeof *s->counted);
    if (!s->references || !s->places || !s->values || !s->before || !s->counted) {
        abort();
    }
    s->reals = list_outputs(s, REAL_ITEM, 0);
    s->integers = list_outputs(s, INTEGER_ITEM, s->reals);
    for (size_t i = 0; i < plan->count; i++) {
        note_parameter(s, plan->variables + i, plan->variables[i].start);
    }
    s->tolerance = job->has_tolerance ? job->tolerance : s->tolerance;
    s->judges_gaps = s->judges_energy = job->kind != MODEL_EXCHANGE;
}

void subject_close(Subject *s) {
    free(s->references);
    free(s->places);
    free(s->values);
    free(s->before);
    free(s->counted);
}

bool subject_instantiate(Subject *s) {
    const Job *job = s->job;
    bool exchange = job->kind == MODEL_EXCHANGE, events = job->kind == WITH_EVENTS;
    call_begins(s);
    if (s->two) {
        s->c = F2->Instantiate(job->name, exchange ? fmi2ModelExchange : fmi2CoSimulation,
                               job->token, job->resources, &s->log.callbacks, fmi2False, fmi2True);
    } else if (exchange) {
        s->c = F3->InstantiateModelExchange(job->name, job->token, job->resources, false, true,
                                            &s->log, logger3);
    } else {
        s->c = F3->InstantiateCoSimulation(job->name, job->token, job->resources, false, true,
                                           events, events, NULL, 0, &s->log, logger3, NULL);
    }
    call_ends(s, "Instantiate", s->c ? 0 : 3);
    s->time = job->start;
    s->referenced = false;
    return s->c != NULL;
}

void subject_free(Subject *s) {
    call_begins(s);
    s->two ? F2->FreeInstance(s->c) : F3->FreeInstance(s->c);
    call_ends(s, "FreeInstance", 0);
    s->c = NULL;
}

/* --- calls of a correct importer --- */

int subject_set(Subject *s, const Variable *variable, double value) {
    const uint32_t *reference = &variable->reference;
    int status = EITHER(SetReal, (s->c, reference, 1, &value), SetFloat64,
                        (s->c, reference, 1, &value, 1));
    if (FINE(status) && (variable->tag != TOLERANCE || !s->job->has_tolerance)) {
        note_parameter(s, variable, value);
    }
    return status;
}

int subject_enter(Subject *s) {
    const Job *job = s->job;
    if (s->two) {
        call_begins(s);
        int status = call_ends(s, "SetupExperiment",
                               (int)F2->SetupExperiment(s->c, job->has_tolerance, job->tolerance,
                                                        job->start, fmi2False, 0.0));
        if (!FINE(status)) {
            return status;
        }
    }
    return EITHER(EnterInitializationMode, (s->c), EnterInitializationMode,
                  (s->c, job->has_tolerance, job->tolerance, job->start, false, 0.0));
}

int subject_exit(Subject *s) {
    int status = BOTH(ExitInitializationMode, (s->c));
    if (FINE(status) && s->job->kind != CO_SIMULATION) {
        status = subject_update(s);
        if (FINE(status)) {
            status = s->job->kind == MODEL_EXCHANGE ? BOTH(EnterContinuousTimeMode, (s->c))
                                                    : (call_begins(s), call_ends(s, "EnterStepMode",
                                                       (int)F3->EnterStepMode(s->c)));
        }
    }
    return status;
}

int subject_update(Subject *s) {
    bool again = true, terminate, nominals, states, defined;
    double next;
    fmi2EventInfo info;
    int status = 0;
    memset(&info, 0, sizeof info);
    for (int i = 0; again && i < UPDATES_MAX && FINE(status); i++) {
        status = EITHER(NewDiscreteStates, (s->c, &info), UpdateDiscreteStates,
                        (s->c, &again, &terminate, &nominals, &states, &defined, &next));
        again = s->two ? info.newDiscreteStatesNeeded : again;
    }
    return status;
}

static int one_step(Subject *s, double size, bool *event, double *reached) {
    bool terminate = false, early = false;
    *reached = s->time + size;
    *event = false;
    return EITHER(DoStep, (s->c, s->time, size, fmi2True), DoStep,
                  (s->c, s->time, size, true, event, &terminate, &early, reached));
}

int subject_step(Subject *s, double size) {
    double end = s->time + size;
    s->counts->steps++;
    for (int i = 0; s->time < end && i < EVENTS_MAX; i++) {
        bool event;
        double reached;
        int status = one_step(s, end - s->time, &event, &reached);
        if (!FINE(status)) {
            return status;
        }
        s->time = reached;
        if (!event) {
            continue;
        }
        s->counts->events++;
        status = BOTH(EnterEventMode, (s->c));
        status = FINE(status) ? subject_update(s) : status;
        if (FINE(status)) {
            call_begins(s);
            status = call_ends(s, "EnterStepMode", (int)F3->EnterStepMode(s->c));
        }
        if (!FINE(status)) {
            return status;
        }
    }
    return 0;
}

/* --- observation --- */

int subject_get_all(Subject *s, double *values) {
    static int32_t room[256];
    int status = EITHER(GetReal, (s->c, s->references, s->reals, values), GetFloat64,
                        (s->c, s->references, s->reals, values, s->reals));
    if (FINE(status) && s->integers) {
        status = EITHER(GetInteger, (s->c, s->references + s->reals, s->integers, room), GetInt32,
                        (s->c, s->references + s->reals, s->integers, room, s->integers));
        for (size_t i = 0; i < s->integers; i++) {
            values[s->reals + i] = room[i];
        }
    }
    return status;
}

static void judge_energy(Subject *s) {
    double balance = 0.0, largest = 0.0;
    for (size_t i = 0; i < s->reals; i++) {
        char tag = s->plan->variables[s->places[i]].tag;
        if (tag == ENERGY || tag == WORK) {
            balance += tag == ENERGY ? s->values[i] : -s->values[i];
            largest = fmax(largest, fabs(s->values[i]));
        }
    }
    if (!s->referenced) {
        s->balance = balance;
        s->largest = largest;
        s->referenced = true;
        return;
    }
    s->largest = fmax(s->largest, largest);
    double off = fabs(balance - s->balance), relative = off / fmax(s->largest, 1e-300);
    double bound = s->plan->energy_rtol + s->plan->energy_factor * s->tolerance;
    double rounded = 4.0 * DBL_EPSILON * s->mass * s->gravity * s->length; /* J, of m g z */
    if (s->judges_energy && off > fmax(1e-12, rounded)) { /* J; less is round-off */
        s->counts->energy = fmax(s->counts->energy, relative / bound);
        if (relative > bound) {
            violated(s, ENERGY_LOST, "the balance changed by %.3g of %.3g J at tolerance %.2g", off,
                     s->largest, s->tolerance);
            s->balance = balance; /* Report a change once. */
        }
    }
}

void subject_observe(Subject *s) {
    double *swap = s->before;
    s->before = s->values;
    s->values = swap;
    if (!FINE(subject_get_all(s, s->values))) {
        memcpy(s->values, s->before, s->plan->count * sizeof *s->values);
        return;
    }
    for (size_t i = 0; i < s->reals + s->integers; i++) {
        const Variable *v = s->plan->variables + s->places[i];
        double x = s->values[i];
        if (!isfinite(x)) {
            violated(s, NOT_FINITE, "value reference %u is %g", v->reference, x);
            return;
        }
        if (v->tag == GAP && s->judges_gaps) {
            s->counts->penetration = fmax(s->counts->penetration, -x);
            if (x < -s->plan->gap_atol * fmax(1.0, s->length)) {
                violated(s, PENETRATED, "value reference %u: gap %.3g m", v->reference, x);
            }
        }
        if (v->tag == COUNT && x < s->counted[i - s->reals]) {
            violated(s, COUNT_FELL, "value reference %u fell to %g", v->reference, x);
        }
        if (v->tag == COUNT) {
            s->counted[i - s->reals] = x;
        }
    }
    judge_energy(s);
}

void subject_new_reference(Subject *s) {
    s->referenced = false;
    memset(s->counted, 0, s->plan->count * sizeof *s->counted);
}

/* The same bits; in model exchange, where dependent coordinates are solved again, round-off. */
static bool equal(const Subject *s, size_t i, double one, double other) {
    const double *scale = &s->plan->variables[s->places[i]].scale;
    return number_to_bits(one) == number_to_bits(other) ||
           (s->job->kind == MODEL_EXCHANGE &&
            fabs(one - other) <= RESTORED_RTOL * fmax(*scale, fabs(one)));
}

static size_t first_difference(const Subject *s, const double *one, const double *other) {
    size_t i = 0, count = s->reals + s->integers;
    while (i < count && equal(s, i, one[i], other[i])) {
        i++;
    }
    return i;
}

bool same_values(const Subject *s, const double *one, const double *other) {
    return first_difference(s, one, other) == s->reals + s->integers;
}

void must_be_same(Subject *s, const double *one, const double *other, const char *when) {
    size_t i = first_difference(s, one, other);
    if (i < s->reals + s->integers) {
        violated(s, CHANGED, "%s: value reference %u is %.17g, not %.17g", when, s->references[i],
                 one[i], other[i]);
    }
}

/* --- choices --- */

size_t pick(Subject *s, const char *roles) {
    for (;;) {
        size_t i = below(&s->random, (unsigned)s->plan->count);
        const Variable *v = s->plan->variables + i;
        if (strchr(roles, v->role) && !(s->keeps_walls && v->tag == MOVING)) {
            return i;
        }
    }
}

double plausible(Subject *s, const Variable *v) {
    double x;
    if (v->role == INPUT) {
        x = chance(&s->random, 4) ? 0.0 : v->scale * uniform(&s->random, -1.0, 1.0);
        x *= chance(&s->random, 20) ? 10.0 : 1.0;
    } else if (v->start != 0.0) {
        x = v->start * exp(uniform(&s->random, -0.2, 0.2));
    } else {
        x = 0.1 * v->scale * uniform(&s->random, -1.0, 1.0);
    }
    return fmin(fmax(x, v->low), v->high);
}

void change_some(Subject *s, const char *roles, unsigned most) {
    for (unsigned i = 1 + below(&s->random, most); i > 0; i--) {
        const Variable *v = s->plan->variables + pick(s, roles);
        (void)subject_set(s, v, plausible(s, v));
    }
}
