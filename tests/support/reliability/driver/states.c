/* Damaged saved states: truncated, with flipped bits, of another version, forged. */
#include "bytes.h"
#include "driver.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { VERSION_AT = 8, CHECKSUM_AT = 16, CHECKED_FROM = 20, CONTENT_FROM = 72, STEPS = 3 };

typedef enum { TRUNCATED, FLIPPED, OTHER_VERSION, FORGED, DAMAGES } Damage;

static void forge(Subject *s, uint8_t *bytes, size_t size) {
    static const double choices[] = {0.0, 1.0, -1.0, 1e-300, 1e300, 1e9, -1e9, 1e-9, NAN, INFINITY};
    for (unsigned i = 1 + below(&s->random, 4); i > 0; i--) {
        size_t numbers = (size - CONTENT_FROM) / sizeof(double);
        size_t place = size - sizeof(double) * (1 + below(&s->random, (unsigned)numbers));
        double x;
        memcpy(&x, bytes + place, sizeof x);
        switch (below(&s->random, 4)) {
        case 0: x = choices[below(&s->random, 10)]; break;
        case 1: x *= uniform(&s->random, -2.0, 2.0); break;
        case 2: x += uniform(&s->random, -1.0, 1.0); break;
        default:
            bytes[CHECKED_FROM + below(&s->random, (unsigned)(size - CHECKED_FROM))] =
                (uint8_t)below(&s->random, 256);
            continue;
        }
        memcpy(bytes + place, &x, sizeof x);
    }
    put_u32(bytes + CHECKSUM_AT, crc(bytes + CHECKED_FROM, size - CHECKED_FROM));
}

static size_t damaged(Subject *s, Damage damage, uint8_t *bytes, size_t size) {
    switch (damage) {
    case TRUNCATED: return below(&s->random, (unsigned)size);
    case FLIPPED:
        for (unsigned i = 1 + below(&s->random, 3); i > 0; i--) {
            unsigned bit = below(&s->random, (unsigned)(8 * size));
            bytes[bit / 8] ^= (uint8_t)(1u << bit % 8);
        }
        return size;
    case OTHER_VERSION:
        put_u32(bytes + VERSION_AT, chance(&s->random, 2) ? 0 : 2 + below(&s->random, 1000));
        return size;
    default: forge(s, bytes, size); return size;
    }
}

/* Continue by some steps, or by evaluations in model exchange, into an array of values. */
static int continued(Subject *s, double *values) {
    size_t n = s->job->state_count;
    double *dx = calloc(n + 1, sizeof *dx);
    int status = 0;
    if (s->job->kind == MODEL_EXCHANGE) {
        status = EITHER(GetDerivatives, (s->c, dx, n), GetContinuousStateDerivatives,
                        (s->c, dx, n));
        for (size_t i = 0; FINE(status) && i < n; i++) {
            if (!isfinite(dx[i])) {
                violated(s, NOT_FINITE, "a derivative after a forged state");
            }
        }
    }
    free(dx);
    for (int i = 0; s->job->kind != MODEL_EXCHANGE && i < STEPS && FINE(status); i++) {
        status = subject_step(s, s->plan->step);
    }
    return FINE(status) ? subject_get_all(s, values) : status;
}

static void check_unchanged(Subject *s, void *state, double time, const double *expected,
                            Damage damage) {
    s->time = time;
    int status = EITHER(SetFMUstate, (s->c, state), SetFMUState, (s->c, state));
    status = FINE(status) ? continued(s, s->values) : status;
    if (!FINE(status) || !same_values(s, s->values, expected)) {
        violated(s, CHANGED, "after damage %d, the saved state continues differently: %s",
                 (int)damage, s->log.message);
    }
}

/* Restore damaged bytes; an accepted state may continue or fail, but not give NaN. */
static void try_damage(Subject *s, Damage damage, const uint8_t *bytes, size_t size) {
    uint8_t *copy = malloc(size);
    void *state = NULL;
    if (!copy) {
        return;
    }
    memcpy(copy, bytes, size);
    size_t kept = damaged(s, damage, copy, size);
    bool same = kept == size && memcmp(copy, bytes, size) == 0;
    int status = EITHER(DeSerializeFMUstate, (s->c, (const fmi2Byte *)copy, kept, &state),
                        DeserializeFMUState, (s->c, copy, kept, &state));
    if (FINE(status) && damage != FORGED && !same) {
        violated(s, ACCEPTED, "a damaged state was accepted: damage %d", (int)damage);
    }
    if (FINE(status)) {
        status = EITHER(SetFMUstate, (s->c, state), SetFMUState, (s->c, state));
        (void)EITHER(FreeFMUstate, (s->c, &state), FreeFMUState, (s->c, &state));
    }
    s->counts->outcomes[FINE(status) ? RESTORED : UNDONE]++;
    if (FINE(status) && FINE(continued(s, s->values))) {
        for (size_t i = 0; i < s->reals; i++) {
            if (!isfinite(s->values[i])) {
                violated(s, NOT_FINITE, "value reference %u after a forged state",
                         s->references[i]);
                break;
            }
        }
    }
    free(copy);
}

static void trials(Subject *s, void *state, size_t count) {
    size_t size = 0;
    double time = s->time, *expected = s->before;
    uint8_t *bytes = NULL;
    int status = EITHER(SerializedFMUstateSize, (s->c, state, &size), SerializedFMUStateSize,
                        (s->c, state, &size));
    bytes = malloc(size);
    status = bytes && FINE(status)
                 ? EITHER(SerializeFMUstate, (s->c, state, (fmi2Byte *)bytes, size),
                          SerializeFMUState, (s->c, state, bytes, size))
                 : 3;
    if (FINE(status) && FINE(continued(s, expected))) {
        for (size_t i = 0; i < count; i++) {
            Damage damage = (Damage)(i % DAMAGES);
            s->time = time;
            try_damage(s, damage, bytes, size);
            check_unchanged(s, state, time, expected, damage);
        }
    }
    free(bytes);
}

void damaged_states(Subject *s, size_t count) {
    void *state = NULL;
    s->judges_energy = s->judges_gaps = false;
    if (!subject_instantiate(s)) {
        return;
    }
    bool good = FINE(subject_enter(s)) && FINE(subject_exit(s));
    for (unsigned i = below(&s->random, 60); good && s->job->kind != MODEL_EXCHANGE && i > 0; i--) {
        good = FINE(subject_step(s, s->plan->step * uniform(&s->random, 0.1, 2.0)));
    }
    if (good && FINE(EITHER(GetFMUstate, (s->c, &state), GetFMUState, (s->c, &state)))) {
        trials(s, state, count);
        (void)EITHER(FreeFMUstate, (s->c, &state), FreeFMUState, (s->c, &state));
    }
    subject_free(s);
}
