/* Legal and illegal calls of co-simulation, with and without Event Mode. */
#include "driver.h"

#include <stdlib.h>
#include <string.h>

/* A saved state with the knowledge of the importer at that time. */
typedef struct {
    void *state;
    double time, balance, largest, *counted;
} Saved;

static bool start(Subject *s) {
    if (chance(&s->random, 2)) {
        change_some(s, "pt", 3);
    }
    if (!FINE(subject_enter(s))) {
        return false;
    }
    if (chance(&s->random, 2)) {
        change_some(s, "u", 3);
    }
    if (!FINE(subject_exit(s))) {
        return false;
    }
    s->time = s->job->start;
    subject_new_reference(s);
    subject_observe(s);
    return true;
}

static bool restart(Subject *s) {
    return FINE(BOTH(Reset, (s->c))) && start(s);
}

static void save(Subject *s, Saved *saved) {
    if (!FINE(EITHER(GetFMUstate, (s->c, &saved->state), GetFMUState, (s->c, &saved->state)))) {
        return;
    }
    saved->time = s->time;
    saved->balance = s->balance;
    saved->largest = s->largest;
    memcpy(saved->counted, s->counted, s->plan->count * sizeof *saved->counted);
}

/* Replace a state by one that was serialized and deserialized. */
static void serialized(Subject *s, Saved *saved) {
    size_t size = 0;
    int status = EITHER(SerializedFMUstateSize, (s->c, saved->state, &size),
                        SerializedFMUStateSize, (s->c, saved->state, &size));
    uint8_t *bytes = malloc(size ? size : 1);
    if (!bytes || !FINE(status)) {
        free(bytes);
        return;
    }
    status = EITHER(SerializeFMUstate, (s->c, saved->state, (fmi2Byte *)bytes, size),
                    SerializeFMUState, (s->c, saved->state, bytes, size));
    void *copy = NULL;
    if (FINE(status)) {
        status = EITHER(DeSerializeFMUstate, (s->c, (const fmi2Byte *)bytes, size, &copy),
                        DeserializeFMUState, (s->c, bytes, size, &copy));
    }
    if (FINE(status)) {
        (void)EITHER(FreeFMUstate, (s->c, &saved->state), FreeFMUState, (s->c, &saved->state));
        saved->state = copy;
    } else {
        violated(s, CHANGED, "a serialized state was rejected: %s", s->log.message);
    }
    free(bytes);
}

static bool restore(Subject *s, const Saved *saved) {
    if (!saved->state ||
        !FINE(EITHER(SetFMUstate, (s->c, saved->state), SetFMUState, (s->c, saved->state)))) {
        return false;
    }
    s->time = saved->time;
    s->balance = saved->balance;
    s->largest = saved->largest;
    memcpy(s->counted, saved->counted, s->plan->count * sizeof *saved->counted);
    subject_observe(s);
    return true;
}

static double step_size(Subject *s) {
    static const double factors[] = {1e-6, 0.1, 0.5, 2.0, 5.0};
    double factor = chance(&s->random, 2) ? 1.0 : factors[below(&s->random, 5)];
    return s->plan->step * factor * (chance(&s->random, 4) ? uniform(&s->random, 0.5, 1.5) : 1.0);
}

/* Make a step.  A failed one must change nothing; go back or start again after it. */
static bool step(Subject *s, const Saved *saved) {
    if (FINE(subject_step(s, step_size(s)))) {
        subject_observe(s);
        return true;
    }
    s->counts->outcomes[REJECTED_LATER]++;
    if (s->job->kind == CO_SIMULATION && FINE(subject_get_all(s, s->before))) {
        must_be_same(s, s->before, s->values, "after a failed step");
    }
    return chance(&s->random, 2) && restore(s, saved) ? true : restart(s);
}

/* Set variables, in Event Mode if the importer uses it. */
static bool change(Subject *s, const char *roles) {
    bool events = s->job->kind == WITH_EVENTS;
    if (events && !FINE(BOTH(EnterEventMode, (s->c)))) {
        return restart(s);
    }
    change_some(s, roles, 3);
    if (events) {
        if (!FINE(subject_update(s))) {
            return restart(s);
        }
        call_begins(s);
        if (!FINE(call_ends(s, "EnterStepMode", (int)F3->EnterStepMode(s->c)))) {
            return restart(s);
        }
    }
    subject_observe(s);
    return true;
}

static bool act(Subject *s, Saved *saved) {
    switch (below(&s->random, 20)) {
    case 0: case 1: case 2: return change(s, "u");
    case 3: return change(s, "t");
    case 4: save(s, saved); return true;
    case 5:
        if (saved->state && chance(&s->random, 2)) {
            serialized(s, saved);
        }
        return !saved->state || restore(s, saved) || restart(s);
    case 6: case 7: case 8: illegal_call(s); return true;
    case 9: return chance(&s->random, 20) ? restart(s) : (subject_observe(s), true);
    default: return step(s, saved);
    }
}

void legal_and_illegal_calls(Subject *s, size_t actions) {
    Saved saved = {0};
    saved.counted = calloc(s->plan->count, sizeof *saved.counted);
    if (saved.counted && subject_instantiate(s)) {
        bool good = start(s);
        s->counts->outcomes[good ? RAN : REJECTED_AT_START]++;
        for (size_t i = 0; good && i < actions; i++) {
            good = act(s, &saved);
        }
        if (saved.state) {
            (void)EITHER(FreeFMUstate, (s->c, &saved.state), FreeFMUState, (s->c, &saved.state));
        }
        subject_free(s);
    }
    free(saved.counted);
}
