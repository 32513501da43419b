/* Arbitrary calls.  Most of them are those of a correct importer, the others are random.  Arguments
 * are valid, invalid, missing or absurd.  The process must survive; it runs under sanitizers or
 * valgrind.
 *
 * Arrays have exactly the length that is passed, so that an access beyond the end is detected.
 * Invalid pointers are never passed, nor an instance that was freed: no library can detect them.
 */
#include "importer.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { STATES = 3, LONGEST = 6 };

/* The mode as the importer expects it; the mode of the FMU may differ after a rejected call. */
typedef enum { NEW, INITIALIZING, EVENTS, RUNNING, ENDED } Mode;

typedef struct {
    const Library *library;
    const Job *job;
    Source *source;
    Instance instance; /* receives the messages */
    void *component;
    bool exchange, with_events;
    bool wild; /* random values were accepted: the steps are tiny */
    Mode mode;
    double time;
    void *states[STATES];
    uint8_t *bytes; /* of the last serialized state */
    size_t byte_count;
} Fuzz;

/* --- choices --- */

/* The generator is splitmix64 (Steele, Lea, Flood 2014). */
static uint64_t bits(Source *source) {
    uint64_t result = 0;
    if (source->bytes) {
        for (int i = 0; i < 8 && source->used < source->size; i++) {
            result = result << 8 | source->bytes[source->used++];
        }
        return result;
    }
    source->seed += 0x9E3779B97F4A7C15u;
    result = source->seed;
    result = (result ^ result >> 30) * 0xBF58476D1CE4E5B9u;
    result = (result ^ result >> 27) * 0x94D049BB133111EBu;
    return result ^ result >> 31;
}

/* A whole number from 0 to count - 1.  If there are bytes, it uses one of them. */
static unsigned below(Fuzz *fuzz, unsigned count) {
    Source *source = fuzz->source;
    if (source->bytes) {
        return source->used < source->size ? source->bytes[source->used++] % count : 0;
    }
    return (unsigned)(bits(source) >> 33) % count;
}

static bool once_in(Fuzz *fuzz, unsigned count) {
    return below(fuzz, count) == count - 1;
}

static bool spent(const Source *source) {
    return source->bytes && source->used >= source->size;
}

/* A number from 0 to 1. */
static double share(Fuzz *fuzz) {
    return below(fuzz, 251) / 250.0;
}

static double absurd(Fuzz *fuzz) {
    static const double choices[] = {0.0,   -0.0,  1.0,    -1.0,  1e-300, 5e-324, 1e300,
                                     -1e30, 1e-12, -1e-12, 1e9,   0.5};
    unsigned count = sizeof choices / sizeof *choices, choice = below(fuzz, count + 4);
    if (choice < count) {
        return choices[choice];
    }
    return choice == count       ? bits_to_number(bits(fuzz->source))
           : choice == count + 1 ? INFINITY
           : choice == count + 2 ? -INFINITY
                                 : NAN;
}

/* A number of the magnitude of displacements, speeds and forces of the shipped mechanisms. */
static double plausible(Fuzz *fuzz) {
    return (share(fuzz) - 0.5) * (once_in(fuzz, 3) ? 1.0 : 0.02);
}

static double number(Fuzz *fuzz) {
    return once_in(fuzz, 8) ? absurd(fuzz) : plausible(fuzz);
}

static const Item *some_item(Fuzz *fuzz) {
    const Job *job = fuzz->job;
    size_t total = job->record_count;
    unsigned index = below(fuzz, 251) + (once_in(fuzz, 2) ? 251 : 0);
    return job->records + index % total;
}

static uint32_t reference(Fuzz *fuzz) {
    if (!once_in(fuzz, 30)) {
        return some_item(fuzz)->reference;
    }
    return once_in(fuzz, 2) ? (uint32_t)bits(fuzz->source) : below(fuzz, 20);
}

/* A value reference, usually of a variable of the type. */
static uint32_t reference_of(Fuzz *fuzz, char type) {
    for (int tries = 0; tries < 4; tries++) {
        const Item *item = some_item(fuzz);
        if (item->type == type) {
            return item->reference;
        }
    }
    return reference(fuzz);
}

/* --- arguments --- */

static void *component(Fuzz *fuzz) {
    return once_in(fuzz, 80) ? NULL : fuzz->component;
}

/* An array of exactly count elements, or sometimes NULL. */
static void *array(Fuzz *fuzz, size_t count, size_t size) {
    return once_in(fuzz, 60) ? NULL : calloc(count ? count : 1, size);
}

typedef struct {
    size_t count;
    uint32_t *references;
    double *numbers;
} Values;

static Values values(Fuzz *fuzz, char type) {
    Values v;
    v.count = once_in(fuzz, 12) ? 0 : 1 + below(fuzz, LONGEST);
    v.references = array(fuzz, v.count, sizeof *v.references);
    v.numbers = array(fuzz, v.count, sizeof *v.numbers);
    for (size_t i = 0; i < v.count; i++) {
        if (v.references) {
            v.references[i] = reference_of(fuzz, type);
        }
        if (v.numbers) {
            v.numbers[i] = number(fuzz);
        }
    }
    return v;
}

static void drop(Values *v) {
    free(v->references);
    free(v->numbers);
}

/* The right count, or sometimes a wrong one. */
static size_t around(Fuzz *fuzz, size_t count) {
    unsigned choice = below(fuzz, 24);
    return choice == 0 ? count + 1 : choice == 1 && count ? count - 1 : choice == 2 ? 0 : count;
}

/* A step size; tiny if random values were accepted, because the motion may be very fast then. */
static double step_size(Fuzz *fuzz) {
    if (once_in(fuzz, 25)) {
        static const double choices[] = {0.0, -1e-3, 1e-300, NAN, INFINITY, -INFINITY};
        return choices[below(fuzz, sizeof choices / sizeof *choices)];
    }
    if (fuzz->wild) {
        return 1e-9;
    }
    return once_in(fuzz, 4) ? 0.02 * share(fuzz) : 1e-3;
}

/* --- FMI 2.0 --- */

#define F2 (&fuzz->library->f2)
#define F3 (&fuzz->library->f3)

static void messages_switch(Fuzz *fuzz) {
    static const char *const names[] = {"logEvents", "logStatusError", "logAll", "", "nonsense",
                                        NULL};
    const char *given[LONGEST];
    size_t count = below(fuzz, LONGEST);
    bool on = once_in(fuzz, 2);
    for (size_t i = 0; i < count; i++) {
        given[i] = names[below(fuzz, 6)];
    }
    const char *const *list = once_in(fuzz, 10) ? NULL : given;
    if (fuzz->job->version == 2) {
        (void)F2->SetDebugLogging(component(fuzz), on, count, list);
    } else {
        (void)F3->SetDebugLogging(component(fuzz), on, count, list);
    }
}

static void update3(fmi3InstanceEnvironment environment, fmi3Float64 time, fmi3Boolean set,
                    fmi3Boolean get, fmi3Boolean finished, fmi3Boolean may_return,
                    fmi3Boolean *requested, fmi3Float64 *at) {
    (void)environment, (void)set, (void)get, (void)finished;
    if (requested && at) {
        *requested = may_return && fmod(time * 1e5, 2.0) < 1.0;
        *at = time;
    }
}

static const char *text(Fuzz *fuzz, const char *right) {
    static const char *const wrong[] = {NULL, "",   "%s%n",      "file:",      "file:///",
                                        "/",  "{}", "file:///%", "file:///%4", "file://localhost",
                                        "\xff\xfe"};
    return once_in(fuzz, 20) ? wrong[below(fuzz, sizeof wrong / sizeof *wrong)] : right;
}

static void instantiate(Fuzz *fuzz) {
    const Job *job = fuzz->job;
    const char *name = text(fuzz, job->name), *token = text(fuzz, job->token);
    const char *resources = text(fuzz, job->resources);
    bool logging = once_in(fuzz, 2);
    fuzz->exchange = once_in(fuzz, 2);
    fuzz->with_events = once_in(fuzz, 2);
    fuzz->mode = NEW;
    fuzz->wild = false;
    fuzz->time = job->start;
    if (job->version == 2) {
        const fmi2CallbackFunctions *callbacks = &fuzz->instance.callbacks;
        fuzz->component =
            F2->Instantiate(name, fuzz->exchange ? fmi2ModelExchange : fmi2CoSimulation, token,
                            resources, once_in(fuzz, 60) ? NULL : callbacks, fmi2False, logging);
    } else if (fuzz->exchange) {
        fuzz->component = F3->InstantiateModelExchange(name, token, resources, false, logging,
                                                       &fuzz->instance,
                                                       once_in(fuzz, 20) ? NULL : logger3);
    } else {
        fuzz->component = F3->InstantiateCoSimulation(
            name, token, resources, false, logging, fuzz->with_events, once_in(fuzz, 2), NULL, 0,
            &fuzz->instance, once_in(fuzz, 20) ? NULL : logger3,
            once_in(fuzz, 2) ? NULL : update3);
    }
}

static void forget_states(Fuzz *fuzz) {
    for (int i = 0; i < STATES; i++) {
        if (fuzz->states[i] && fuzz->job->version == 2) {
            (void)F2->FreeFMUstate(fuzz->component, fuzz->states + i);
        } else if (fuzz->states[i]) {
            (void)F3->FreeFMUState(fuzz->component, fuzz->states + i);
        }
        fuzz->states[i] = NULL;
    }
}

static void free_instance(Fuzz *fuzz) {
    forget_states(fuzz);
    if (fuzz->job->version == 2) {
        F2->FreeInstance(fuzz->component);
    } else {
        F3->FreeInstance(fuzz->component);
    }
    fuzz->component = NULL;
}

static double time_argument(Fuzz *fuzz) {
    return once_in(fuzz, 25) ? absurd(fuzz) : fuzz->time;
}

static double tolerance(Fuzz *fuzz) {
    return once_in(fuzz, 5) ? absurd(fuzz) : 1e-6;
}

/* With a very small tolerance, the steps are tiny too: the simulation would take too long. */
static void enter_initialization(Fuzz *fuzz) {
    bool tolerant = once_in(fuzz, 2), stops = once_in(fuzz, 2);
    double wanted = tolerance(fuzz), start = fuzz->time, stop = number(fuzz);
    int status = 0;
    fuzz->wild = fuzz->wild || (tolerant && wanted < 1e-9);
    if (once_in(fuzz, 25)) {
        start = absurd(fuzz);
    }
    if (fuzz->job->version == 2) {
        if (!once_in(fuzz, 10)) {
            status = (int)F2->SetupExperiment(component(fuzz), tolerant, wanted, start, stops,
                                              stop);
        }
        status |= (int)F2->EnterInitializationMode(component(fuzz));
    } else {
        status = (int)F3->EnterInitializationMode(component(fuzz), tolerant, wanted, start, stops,
                                                  stop);
    }
    if (status == 0) {
        fuzz->time = start;
        fuzz->mode = INITIALIZING;
    }
}

static void exit_initialization(Fuzz *fuzz) {
    int status = fuzz->job->version == 2 ? (int)F2->ExitInitializationMode(component(fuzz))
                                         : (int)F3->ExitInitializationMode(component(fuzz));
    if (status == 0) {
        bool events = fuzz->exchange || (fuzz->job->version == 3 && fuzz->with_events);
        fuzz->mode = events ? EVENTS : RUNNING;
    }
}

static void do_step(Fuzz *fuzz) {
    double time = time_argument(fuzz), size = step_size(fuzz), reached = time + size;
    if (fuzz->job->version == 2) {
        if (F2->DoStep(component(fuzz), time, size, once_in(fuzz, 2)) == 0) {
            fuzz->time = reached;
        }
        return;
    }
    bool event = false, terminate = false, early = false, missing = once_in(fuzz, 60);
    if (F3->DoStep(component(fuzz), time, size, once_in(fuzz, 2), missing ? NULL : &event,
                   &terminate, &early, missing ? NULL : &reached) == 0) {
        fuzz->time = reached;
    }
}

static void enter_events(Fuzz *fuzz) {
    int status = fuzz->job->version == 2 ? (int)F2->EnterEventMode(component(fuzz))
                                         : (int)F3->EnterEventMode(component(fuzz));
    if (status == 0) {
        fuzz->mode = EVENTS;
    }
}

static void update(Fuzz *fuzz) {
    bool missing = once_in(fuzz, 40), flags[5];
    double next;
    if (fuzz->job->version == 2) {
        fmi2EventInfo info;
        (void)F2->NewDiscreteStates(component(fuzz), missing ? NULL : &info);
        return;
    }
    (void)F3->UpdateDiscreteStates(component(fuzz), missing ? NULL : flags, flags + 1, flags + 2,
                                   flags + 3, flags + 4, missing ? NULL : &next);
}

static void leave_events(Fuzz *fuzz) {
    int status;
    if (fuzz->job->version == 2) {
        status = (int)F2->EnterContinuousTimeMode(component(fuzz));
    } else if (fuzz->exchange != once_in(fuzz, 20)) {
        status = (int)F3->EnterContinuousTimeMode(component(fuzz));
    } else {
        status = (int)F3->EnterStepMode(component(fuzz));
    }
    if (status == 0) {
        fuzz->mode = RUNNING;
    }
}

static void terminate(Fuzz *fuzz) {
    int status = fuzz->job->version == 2 ? (int)F2->Terminate(component(fuzz))
                                         : (int)F3->Terminate(component(fuzz));
    if (status == 0) {
        fuzz->mode = ENDED;
    }
}

static void reset(Fuzz *fuzz) {
    int status = fuzz->job->version == 2 ? (int)F2->Reset(component(fuzz))
                                         : (int)F3->Reset(component(fuzz));
    if (status == 0) {
        fuzz->mode = NEW;
        fuzz->time = fuzz->job->start;
    }
}

static void get_reals(Fuzz *fuzz) {
    Values v = values(fuzz, REAL_ITEM);
    if (fuzz->job->version == 2) {
        (void)F2->GetReal(component(fuzz), v.references, v.count, v.numbers);
    } else {
        size_t count = v.numbers ? around(fuzz, v.count) : v.count;
        double *room = calloc(count ? count : 1, sizeof *room);
        (void)F3->GetFloat64(component(fuzz), v.references, v.count, v.numbers ? room : NULL,
                             count);
        free(room);
    }
    drop(&v);
}

static void set_reals(Fuzz *fuzz) {
    Values v = values(fuzz, REAL_ITEM);
    size_t count = once_in(fuzz, 3) ? v.count : v.count > 1 ? 1 : v.count;
    int status = fuzz->job->version == 2
                     ? (int)F2->SetReal(component(fuzz), v.references, count, v.numbers)
                     : (int)F3->SetFloat64(component(fuzz), v.references, count, v.numbers,
                                           once_in(fuzz, 30) ? 0 : count);
    fuzz->wild = fuzz->wild || (status == 0 && count > 0);
    drop(&v);
}

/* Multiply a value by a factor near one: the motion stays realistic. */
static void set_near(Fuzz *fuzz) {
    const Item *item = some_item(fuzz);
    double x = 0.0;
    if (item->type != REAL_ITEM || !fuzz->component) {
        return;
    }
    if (fuzz->job->version == 2) {
        if (F2->GetReal(fuzz->component, &item->reference, 1, &x) == 0) {
            x = x != 0.0 ? x * (0.8 + 0.4 * share(fuzz)) : 0.0;
            (void)F2->SetReal(fuzz->component, &item->reference, 1, &x);
        }
    } else if (F3->GetFloat64(fuzz->component, &item->reference, 1, &x, 1) == 0) {
        x = x != 0.0 ? x * (0.8 + 0.4 * share(fuzz)) : 0.0;
        (void)F3->SetFloat64(fuzz->component, &item->reference, 1, &x, 1);
    }
}

static void others2(Fuzz *fuzz) {
    Values v = values(fuzz, once_in(fuzz, 2) ? INTEGER_ITEM : BOOLEAN_ITEM);
    int *integers = array(fuzz, v.count, sizeof *integers);
    const char **strings = array(fuzz, v.count, sizeof *strings);
    void *c = component(fuzz);
    switch (below(fuzz, 10)) {
    case 0: case 1: (void)F2->GetInteger(c, v.references, v.count, integers); break;
    case 2: (void)F2->SetInteger(c, v.references, v.count, integers); break;
    case 3: case 4: (void)F2->GetBoolean(c, v.references, v.count, integers); break;
    case 5: (void)F2->SetBoolean(c, v.references, v.count, integers); break;
    case 6: (void)F2->GetString(c, v.references, v.count, strings); break;
    case 7: (void)F2->SetString(c, v.references, v.count, strings); break;
    case 8: (void)F2->SetRealInputDerivatives(c, v.references, v.count, integers, v.numbers); break;
    default: (void)F2->GetRealOutputDerivatives(c, v.references, v.count, integers, v.numbers);
    }
    free(integers);
    free(strings);
    drop(&v);
}

static void status2(Fuzz *fuzz) {
    void *c = component(fuzz);
    fmi2StatusKind kind = (fmi2StatusKind)below(fuzz, 5);
    fmi2Status status;
    double x;
    int i;
    const char *string;
    switch (below(fuzz, 8)) {
    case 0: (void)F2->GetStatus(c, kind, once_in(fuzz, 8) ? NULL : &status); break;
    case 1: (void)F2->GetRealStatus(c, kind, once_in(fuzz, 8) ? NULL : &x); break;
    case 2: (void)F2->GetIntegerStatus(c, kind, once_in(fuzz, 8) ? NULL : &i); break;
    case 3: (void)F2->GetBooleanStatus(c, kind, once_in(fuzz, 8) ? NULL : &i); break;
    case 4: (void)F2->GetStringStatus(c, kind, once_in(fuzz, 8) ? NULL : &string); break;
    case 5: (void)F2->CancelStep(c); break;
    case 6: (void)F2->GetVersion(); break;
    default: (void)F2->GetTypesPlatform();
    }
}

/* --- FMI 3.0: functions without a counterpart --- */

static void typed3(Fuzz *fuzz) {
    Values v = values(fuzz, once_in(fuzz, 2) ? INTEGER_ITEM : BOOLEAN_ITEM);
    size_t count = around(fuzz, v.count);
    bool setting = once_in(fuzz, 2);
    void *c = component(fuzz);
    unsigned index = 0, choice = below(fuzz, 12);
#define TYPE(name)                                                                                 \
    if (index++ == choice) {                                                                       \
        fmi3##name *room = array(fuzz, count, sizeof *room);                                       \
        if (setting) {                                                                             \
            (void)F3->Set##name(c, v.references, v.count, room, count);                            \
        } else {                                                                                   \
            (void)F3->Get##name(c, v.references, v.count, room, count);                            \
        }                                                                                          \
        free(room);                                                                                \
    }
    FMI3_TYPES(TYPE)
#undef TYPE
    drop(&v);
}

static void clocks3(Fuzz *fuzz) {
    Values v = values(fuzz, REAL_ITEM);
    void *c = component(fuzz);
    bool *clocks = array(fuzz, v.count, sizeof *clocks);
    uint64_t *counters = array(fuzz, v.count, sizeof *counters);
    uint64_t *resolutions = array(fuzz, v.count, sizeof *resolutions);
    fmi3IntervalQualifier *qualifiers = array(fuzz, v.count, sizeof *qualifiers);
    const uint32_t *r = v.references;
    size_t n = v.count;
    switch (below(fuzz, 11)) {
    case 0: (void)F3->GetClock(c, r, n, clocks); break;
    case 1: (void)F3->SetClock(c, r, n, clocks); break;
    case 2: (void)F3->GetIntervalDecimal(c, r, n, v.numbers, qualifiers); break;
    case 3: (void)F3->GetIntervalFraction(c, r, n, counters, resolutions, qualifiers); break;
    case 4: (void)F3->GetShiftDecimal(c, r, n, v.numbers); break;
    case 5: (void)F3->GetShiftFraction(c, r, n, counters, resolutions); break;
    case 6: (void)F3->SetIntervalDecimal(c, r, n, v.numbers); break;
    case 7: (void)F3->SetIntervalFraction(c, r, n, counters, resolutions); break;
    case 8: (void)F3->SetShiftDecimal(c, r, n, v.numbers); break;
    case 9: (void)F3->SetShiftFraction(c, r, n, counters, resolutions); break;
    default: (void)F3->ActivateModelPartition(c, r ? r[0] : 0, time_argument(fuzz));
    }
    free(clocks);
    free(counters);
    free(resolutions);
    free(qualifiers);
    drop(&v);
}

static void dependencies3(Fuzz *fuzz) {
    size_t count = 0;
    uint32_t of = reference(fuzz);
    (void)F3->GetNumberOfVariableDependencies(component(fuzz), of,
                                              once_in(fuzz, 20) ? NULL : &count);
    size_t given = around(fuzz, count < 1000 ? count : 0), room = given ? given : 1;
    size_t *elements = calloc(room, sizeof *elements);
    size_t *of_independents = calloc(room, sizeof *of_independents);
    uint32_t *independents = calloc(room, sizeof *independents);
    fmi3DependencyKind *kinds = calloc(room, sizeof *kinds);
    (void)F3->GetVariableDependencies(component(fuzz), of, elements, independents, of_independents,
                                      kinds, given);
    free(elements);
    free(of_independents);
    free(independents);
    free(kinds);
}

static void rare3(Fuzz *fuzz) {
    Values v = values(fuzz, REAL_ITEM);
    void *c = component(fuzz);
    size_t count = v.count, *sizes = array(fuzz, count, sizeof *sizes);
    int32_t *orders = array(fuzz, count, sizeof *orders);
    const uint8_t **binaries = array(fuzz, count, sizeof *binaries);
    switch (below(fuzz, 10)) {
    case 0: (void)F3->GetBinary(c, v.references, count, sizes, binaries, count); break;
    case 1: (void)F3->SetBinary(c, v.references, count, sizes, binaries, count); break;
    case 2: (void)F3->GetOutputDerivatives(c, v.references, count, orders, v.numbers, count); break;
    case 3: (void)F3->EnterConfigurationMode(c); break;
    case 4: (void)F3->ExitConfigurationMode(c); break;
    case 5: (void)F3->EvaluateDiscreteStates(c); break;
    case 6: (void)F3->GetNumberOfContinuousStates(c, once_in(fuzz, 8) ? NULL : &count); break;
    case 7: (void)F3->GetNumberOfEventIndicators(c, once_in(fuzz, 8) ? NULL : &count); break;
    case 8: (void)F3->GetVersion(); break;
    default:
        c = F3->InstantiateScheduledExecution(fuzz->job->name, fuzz->job->token,
                                              fuzz->job->resources, false, true, &fuzz->instance,
                                              logger3, NULL, NULL, NULL);
        if (c) {
            F3->FreeInstance(c);
        }
    }
    free(sizes);
    free(orders);
    free(binaries);
    drop(&v);
}

static void others(Fuzz *fuzz) {
    if (fuzz->job->version == 2) {
        once_in(fuzz, 3) ? status2(fuzz) : others2(fuzz);
        return;
    }
    switch (below(fuzz, 5)) {
    case 0: clocks3(fuzz); break;
    case 1: dependencies3(fuzz); break;
    case 2: rare3(fuzz); break;
    default: typed3(fuzz);
    }
}

/* --- both: derivatives, model exchange, states --- */

static void directional(Fuzz *fuzz) {
    Values unknown = values(fuzz, REAL_ITEM), known = values(fuzz, REAL_ITEM);
    void *c = component(fuzz);
    if (fuzz->job->version == 2) {
        (void)F2->GetDirectionalDerivative(c, unknown.references, unknown.count, known.references,
                                           known.count, known.numbers, unknown.numbers);
    } else if (once_in(fuzz, 4)) {
        (void)F3->GetAdjointDerivative(c, unknown.references, unknown.count, known.references,
                                       known.count, unknown.numbers, unknown.count, known.numbers,
                                       known.count);
    } else {
        size_t seeds = once_in(fuzz, 20) ? 0 : known.count;
        size_t room = once_in(fuzz, 20) ? 0 : unknown.count;
        (void)F3->GetDirectionalDerivative(c, unknown.references, unknown.count, known.references,
                                           known.count, known.numbers, seeds, unknown.numbers,
                                           room);
    }
    drop(&unknown);
    drop(&known);
}

static void integrator(Fuzz *fuzz) {
    size_t count = around(fuzz, fuzz->job->state_count);
    size_t indicators = around(fuzz, fuzz->job->indicator_count);
    double *x = array(fuzz, count, sizeof *x), *z = array(fuzz, indicators, sizeof *z);
    void *c = component(fuzz);
    bool two = fuzz->job->version == 2, event, ends;
    int event2, ends2;
    switch (below(fuzz, 9)) {
    case 0:
        fuzz->time += step_size(fuzz) > 0.0 ? 1e-5 : 0.0;
        (void)(two ? (int)F2->SetTime(c, time_argument(fuzz))
                   : (int)F3->SetTime(c, time_argument(fuzz)));
        break;
    case 1: case 2:
        (void)(two ? (int)F2->GetContinuousStates(c, x, count)
                   : (int)F3->GetContinuousStates(c, x, count));
        for (size_t i = 0; x && i < count; i++) {
            x[i] += once_in(fuzz, 20) ? absurd(fuzz) : 0.01 * plausible(fuzz);
        }
        (void)(two ? (int)F2->SetContinuousStates(c, x, count)
                   : (int)F3->SetContinuousStates(c, x, count));
        break;
    case 3: case 4:
        (void)(two ? (int)F2->GetDerivatives(c, x, count)
                   : (int)F3->GetContinuousStateDerivatives(c, x, count));
        break;
    case 5:
        (void)(two ? (int)F2->GetEventIndicators(c, z, indicators)
                   : (int)F3->GetEventIndicators(c, z, indicators));
        break;
    case 6:
        (void)(two ? (int)F2->GetNominalsOfContinuousStates(c, x, count)
                   : (int)F3->GetNominalsOfContinuousStates(c, x, count));
        break;
    case 7:
        (void)(two ? (int)F2->CompletedIntegratorStep(c, once_in(fuzz, 2), &event2, &ends2)
                   : (int)F3->CompletedIntegratorStep(c, once_in(fuzz, 2), &event, &ends));
        break;
    default:
        (void)(two ? (int)F2->CompletedIntegratorStep(c, fmi2False, NULL, NULL)
                   : (int)F3->CompletedIntegratorStep(c, false, NULL, NULL));
    }
    free(x);
    free(z);
}

static void save(Fuzz *fuzz) {
    void *c = component(fuzz), **state = fuzz->states + below(fuzz, STATES);
    if (once_in(fuzz, 30)) {
        state = NULL;
    }
    (void)(fuzz->job->version == 2 ? (int)F2->GetFMUstate(c, state)
                                   : (int)F3->GetFMUState(c, state));
}

static void restore(Fuzz *fuzz) {
    void *c = component(fuzz), *state = fuzz->states[below(fuzz, STATES)];
    (void)(fuzz->job->version == 2 ? (int)F2->SetFMUstate(c, state)
                                   : (int)F3->SetFMUState(c, state));
}

static void forget(Fuzz *fuzz) {
    void *c = component(fuzz), **state = fuzz->states + below(fuzz, STATES);
    if (once_in(fuzz, 30)) {
        state = NULL;
    }
    (void)(fuzz->job->version == 2 ? (int)F2->FreeFMUstate(c, state)
                                   : (int)F3->FreeFMUState(c, state));
}

static void serialize(Fuzz *fuzz) {
    void *c = component(fuzz), *state = fuzz->states[below(fuzz, STATES)];
    size_t size = 0, *address = once_in(fuzz, 30) ? NULL : &size;
    (void)(fuzz->job->version == 2 ? (int)F2->SerializedFMUstateSize(c, state, address)
                                   : (int)F3->SerializedFMUStateSize(c, state, address));
    size = around(fuzz, size < 1 << 24 ? size : 0);
    free(fuzz->bytes);
    fuzz->byte_count = size;
    fuzz->bytes = calloc(size ? size : 1, 1);
    (void)(fuzz->job->version == 2
               ? (int)F2->SerializeFMUstate(c, state, (fmi2Byte *)fuzz->bytes, size)
               : (int)F3->SerializeFMUState(c, state, fuzz->bytes, size));
}

/* Deserialize a state, sometimes after changes of its bytes. */
static void deserialize(Fuzz *fuzz) {
    void *c = component(fuzz), **state = fuzz->states + below(fuzz, STATES);
    size_t size = fuzz->bytes ? around(fuzz, fuzz->byte_count) : 0;
    uint8_t *bytes = calloc(size ? size : 1, 1);
    if (fuzz->bytes) {
        memcpy(bytes, fuzz->bytes, size < fuzz->byte_count ? size : fuzz->byte_count);
    }
    bool changed = size && once_in(fuzz, 2);
    for (unsigned i = changed ? 1 + below(fuzz, 8) : 0; i > 0; i--) {
        size_t place = (size_t)(bits(fuzz->source) % size);
        double x = absurd(fuzz);
        if (once_in(fuzz, 2) && place / 8 * 8 + 8 <= size) {
            memcpy(bytes + place / 8 * 8, &x, sizeof x);
        } else {
            bytes[place] = (uint8_t)below(fuzz, 256);
        }
    }
    if (*state) { /* free the previous state, or its memory would leak */
        (void)(fuzz->job->version == 2 ? (int)F2->FreeFMUstate(fuzz->component, state)
                                       : (int)F3->FreeFMUState(fuzz->component, state));
    }
    int status = fuzz->job->version == 2
                     ? (int)F2->DeSerializeFMUstate(c, (const fmi2Byte *)bytes, size, state)
                     : (int)F3->DeserializeFMUState(c, bytes, size, state);
    fuzz->wild = fuzz->wild || (changed && status == 0);
    free(bytes);
}

/* --- choice of the next call --- */

typedef void Call(Fuzz *fuzz);

/* Choose a call that is valid in the mode.  Repeated entries are more frequent. */
static Call *sensible(Fuzz *fuzz) {
    static Call *const new_calls[] = {set_near, enter_initialization, enter_initialization};
    static Call *const initializing[] = {set_near, get_reals, exit_initialization,
                                         exit_initialization};
    static Call *const events[] = {update, update, leave_events, leave_events, get_reals};
    static Call *const stepping[] = {do_step, do_step, do_step, get_reals, set_near, save, restore};
    static Call *const integrating[] = {integrator, integrator, integrator, get_reals,
                                        enter_events};
    static Call *const with_events[] = {do_step, do_step, get_reals, enter_events};
    static Call *const ended[] = {get_reals, reset};
#define ONE_OF(list) list[below(fuzz, sizeof list / sizeof *list)]
    switch (fuzz->mode) {
    case NEW: return ONE_OF(new_calls);
    case INITIALIZING: return ONE_OF(initializing);
    case EVENTS: return ONE_OF(events);
    case ENDED: return ONE_OF(ended);
    default: break;
    }
    return fuzz->exchange                                  ? ONE_OF(integrating)
           : fuzz->with_events && fuzz->job->version == 3 ? ONE_OF(with_events)
                                                           : ONE_OF(stepping);
}

static Call *anything(Fuzz *fuzz) {
    static Call *const all[] = {
        messages_switch, enter_initialization, exit_initialization, do_step, enter_events, update,
        leave_events, terminate, reset, get_reals, set_reals, set_near, others, others, others,
        directional, directional, integrator, integrator, save, restore, forget, serialize,
        deserialize,
    };
    return ONE_OF(all);
}

void arbitrary_calls(const Library *library, const Job *job, Source *source, size_t count) {
    Fuzz state, *fuzz = &state;
    fmi2CallbackFunctions callbacks = {logger2, calloc, free, NULL, &state.instance};
    memset(fuzz, 0, sizeof *fuzz);
    fuzz->library = library;
    fuzz->job = job;
    fuzz->source = source;
    fuzz->instance.callbacks = callbacks;
    for (size_t i = 0; i < count && !spent(source); i++) {
        if (!fuzz->component) {
            instantiate(fuzz);
        } else if (once_in(fuzz, 100)) {
            free_instance(fuzz);
        } else {
            (once_in(fuzz, 4) ? anything(fuzz) : sensible(fuzz))(fuzz);
        }
    }
    if (fuzz->component) {
        free_instance(fuzz);
    }
    free(fuzz->bytes);
}
