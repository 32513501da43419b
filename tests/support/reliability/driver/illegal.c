/* Illegal calls: each must be rejected with a message and must change no value. */
#include "driver.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const uint32_t UNKNOWN = 4000000007u; /* no value reference of a variable */

static double not_a_number(Subject *s) {
    static const double choices[] = {NAN, INFINITY, -INFINITY};
    return choices[below(&s->random, 3)];
}

static int step_of(Subject *s, double time, double size) {
    bool event, terminate, early;
    double reached;
    return EITHER(DoStep, (s->c, time, size, fmi2True), DoStep,
                  (s->c, time, size, true, &event, &terminate, &early, &reached));
}

static int bad_step(Subject *s) {
    static const double sizes[] = {0.0, -1e-3, NAN, INFINITY, -INFINITY};
    double size = s->plan->step;
    switch (below(&s->random, 3)) {
    case 0: return step_of(s, s->time, sizes[below(&s->random, 5)]);
    case 1: return step_of(s, s->time + 10.0 * size, size);
    default: return step_of(s, not_a_number(s), size);
    }
}

static int bad_get(Subject *s) {
    uint32_t reference = UNKNOWN;
    double x = 0.0;
    switch (below(&s->random, 4)) {
    case 0: return EITHER(GetReal, (s->c, &reference, 1, &x), GetFloat64,
                          (s->c, &reference, 1, &x, 1));
    case 1: return EITHER(GetReal, (s->c, NULL, 1, &x), GetFloat64, (s->c, NULL, 1, &x, 1));
    case 2: return EITHER(GetReal, (s->c, s->references, 1, NULL), GetFloat64,
                          (s->c, s->references, 1, NULL, 1));
    default: reference = s->references[below(&s->random, (unsigned)s->reals)];
    }
    int32_t integer;
    return EITHER(GetInteger, (s->c, &reference, 1, &integer), GetInt32,
                  (s->c, &reference, 1, &integer, 1));
}

static int bad_set(Subject *s) {
    Variable v = s->plan->variables[pick(s, "u")];
    switch (below(&s->random, 4)) {
    case 0: return subject_set(s, &v, not_a_number(s));
    case 1: v.reference = UNKNOWN; return subject_set(s, &v, 0.0);
    case 2: v.reference = s->references[0]; return subject_set(s, &v, NAN);
    default: v = s->plan->variables[pick(s, "p")];
    }
    return subject_set(s, &v, v.start * 1.1 + 0.123 * v.scale);
}

/* A function of another mode. */
static int misplaced(Subject *s) {
    bool two = s->two, exchange = s->job->kind == MODEL_EXCHANGE;
    switch (below(&s->random, 4)) {
    case 0: return EITHER(EnterInitializationMode, (s->c), EnterInitializationMode,
                          (s->c, false, 0.0, 0.0, false, 0.0));
    case 1: return BOTH(ExitInitializationMode, (s->c));
    case 2:
        if (exchange) {
            return step_of(s, s->time, s->plan->step);
        }
        return BOTH(SetTime, (s->c, s->time));
    default:
        call_begins(s);
        return call_ends(s, "EnterStepMode or SetupExperiment",
                         two ? (int)F2->SetupExperiment(s->c, false, 0.0, 0.0, false, 0.0)
                             : (int)F3->EnterStepMode(s->c));
    }
}

static int bad_state(Subject *s) {
    uint8_t bytes[64];
    void *state = NULL;
    size_t size = below(&s->random, sizeof bytes);
    for (size_t i = 0; i < sizeof bytes; i++) {
        bytes[i] = (uint8_t)below(&s->random, 256);
    }
    if (chance(&s->random, 3)) {
        return EITHER(SetFMUstate, (s->c, NULL), SetFMUState, (s->c, NULL));
    }
    return EITHER(DeSerializeFMUstate, (s->c, (const fmi2Byte *)bytes, size, &state),
                  DeserializeFMUState, (s->c, bytes, size, &state));
}

static int no_instance(Subject *s) {
    void *c = s->c;
    double x = 0.0;
    s->c = NULL; /* No message can be sent. */
    int status = chance(&s->random, 2)
                     ? EITHER(GetReal, (s->c, s->references, 1, &x), GetFloat64,
                              (s->c, s->references, 1, &x, 1))
                     : BOTH(Terminate, (s->c));
    s->c = c;
    return status;
}

static int bad_states_of_exchange(Subject *s) {
    size_t n = s->job->state_count;
    double *x = calloc(n + 1, sizeof *x);
    int status = 0;
    if (!x) {
        return 3;
    }
    switch (below(&s->random, 4)) {
    case 0: status = BOTH(SetTime, (s->c, not_a_number(s))); break;
    case 1: status = BOTH(SetContinuousStates, (s->c, x, n + 1)); break;
    case 2: status = EITHER(GetDerivatives, (s->c, x, n + 1), GetContinuousStateDerivatives,
                            (s->c, x, n + 1)); break;
    default:
        x[below(&s->random, (unsigned)n)] = not_a_number(s);
        status = BOTH(SetContinuousStates, (s->c, x, n));
    }
    free(x);
    return status;
}

/* Rejected values block steps until they are corrected: a saved state takes them back. */
void illegal_call(Subject *s) {
    typedef int Call(Subject *);
    static Call *const calls[] = {bad_step, bad_get, bad_set, misplaced, bad_state, no_instance,
                                  bad_states_of_exchange};
    static const char *const names[] = {"step", "get", "set", "mode", "state", "NULL", "exchange"};
    bool exchange = s->job->kind == MODEL_EXCHANGE;
    unsigned which = exchange ? 1 + below(&s->random, 6) : below(&s->random, 6);
    uint64_t drawn = s->random.state;
    void *state = NULL;
    int status = EITHER(GetFMUstate, (s->c, &state), GetFMUState, (s->c, &state));
    if (!FINE(status) || !FINE(subject_get_all(s, s->before))) {
        return;
    }
    s->counts->illegal++;
    status = calls[which](s);
    if (FINE(status)) {
        violated(s, ACCEPTED, "an illegal call was accepted: %s %llx", names[which],
                 (unsigned long long)drawn);
    }
    for (int undo = 0; undo < 2; undo++) {
        if (FINE(subject_get_all(s, s->values))) {
            must_be_same(s, s->values, s->before, undo ? "restored after an illegal call"
                                                       : "after an illegal call");
        }
        status = EITHER(SetFMUstate, (s->c, state), SetFMUState, (s->c, state));
        if (!FINE(status)) {
            violated(s, CHANGED, "a saved state was rejected: %s", s->log.message);
        }
    }
    (void)EITHER(FreeFMUstate, (s->c, &state), FreeFMUState, (s->c, &state));
}
