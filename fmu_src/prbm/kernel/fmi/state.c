/* Saved states.
 *
 * The format is little-endian:
 *   8 bytes   "PRBMSTAT"
 *   u32       version of the format, total size, CRC-32 of the bytes after it
 *   u32       version of FMI, kind, whether Event Mode is used, length of the token
 *   bytes     the token
 *   u32       mode, flags, status of the last step, unknown value reference
 *   f64       start time, stop time, tolerance
 *   bytes     one per slot: whether the last set of the variable was rejected
 *   f64       one per stop: acknowledged impacts
 *   f64       the state of the simulation
 * A copy in memory has the same bytes, with 0 for the checksum. */
#include <stdlib.h>
#include <string.h>

#include "fmi/fmu.h"

enum { STATE_VERSION = 2, STATE_CHECKED_FROM = 20, STATE_HEAD = 36, STATE_FIXED = 16 + 24 };
static const char STATE_MAGIC[8] = {'P', 'R', 'B', 'M', 'S', 'T', 'A', 'T'};

enum {
    FLAG_EXPERIMENT = 1,
    FLAG_EXPERIMENT_REFUSED = 2,
    FLAG_STOP_DEFINED = 4,
    FLAG_TOLERANCE_DEFINED = 8,
    FLAG_EVENT_DUE = 16,
    FLAG_UPDATED = 32,
    FLAG_UNKNOWN_REFUSED = 64,
    FLAGS = 127
};

static void put_u32(unsigned char **at, uint32_t x) {
    for (int i = 0; i < 4; i++) {
        *(*at)++ = (unsigned char)(x >> 8 * i);
    }
}

static void put_f64(unsigned char **at, double x) {
    uint64_t bits;
    memcpy(&bits, &x, sizeof bits);
    put_u32(at, (uint32_t)bits);
    put_u32(at, (uint32_t)(bits >> 32));
}

static uint32_t get_u32(const unsigned char **at) {
    uint32_t x = 0;
    for (int i = 0; i < 4; i++) {
        x |= (uint32_t)*(*at)++ << 8 * i;
    }
    return x;
}

static double get_f64(const unsigned char **at) {
    uint64_t low = get_u32(at), bits = low | (uint64_t)get_u32(at) << 32;
    double x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

static uint32_t u32_at(const unsigned char *bytes) {
    return get_u32(&bytes);
}

static size_t saved_size(const Instance *instance) {
    const Mechanism *mechanism = instance->mechanism;
    size_t numbers = (size_t)mechanism->stop_count + simulation_state_count(instance->simulation);
    return STATE_HEAD + strlen(mechanism->token) + STATE_FIXED + (size_t)mechanism->slots.count +
           numbers * sizeof(double);
}

static uint32_t flags_of(const Instance *it) {
    return (it->experiment ? FLAG_EXPERIMENT : 0u) |
           (it->experiment_refused ? FLAG_EXPERIMENT_REFUSED : 0u) |
           (it->stop_defined ? FLAG_STOP_DEFINED : 0u) |
           (it->tolerance_defined ? FLAG_TOLERANCE_DEFINED : 0u) |
           (it->event_due ? FLAG_EVENT_DUE : 0u) | (it->updated ? FLAG_UPDATED : 0u) |
           (it->unknown_refused ? FLAG_UNKNOWN_REFUSED : 0u);
}

static void put_state(const Instance *instance, unsigned char *bytes, size_t size) {
    const Mechanism *mechanism = instance->mechanism;
    size_t length = strlen(mechanism->token), slots = (size_t)mechanism->slots.count;
    unsigned char *at = bytes;
    memcpy(at, STATE_MAGIC, sizeof STATE_MAGIC);
    at += sizeof STATE_MAGIC;
    put_u32(&at, STATE_VERSION);
    put_u32(&at, (uint32_t)size);
    put_u32(&at, 0);
    put_u32(&at, (uint32_t)instance->standard->version);
    put_u32(&at, (uint32_t)instance->kind);
    put_u32(&at, instance->event_mode);
    put_u32(&at, (uint32_t)length);
    memcpy(at, mechanism->token, length);
    at += length;
    put_u32(&at, (uint32_t)instance->mode);
    put_u32(&at, flags_of(instance));
    put_u32(&at, (uint32_t)instance->last_step);
    put_u32(&at, instance->unknown);
    put_f64(&at, instance->start_time);
    put_f64(&at, instance->stop_time);
    put_f64(&at, instance->tolerance);
    memcpy(at, instance->refused, slots);
    at += slots;
    for (int i = 0; i < mechanism->stop_count; i++) {
        put_f64(&at, instance->acknowledged[i]);
    }
    simulation_save(instance->simulation, instance->before);
    for (size_t i = 0; i < simulation_state_count(instance->simulation); i++) {
        put_f64(&at, instance->before[i]);
    }
}

/* Check by the header whether saved bytes are from this FMU and an instance of the same kind. */
static bool check_head(const Instance *instance, const unsigned char *bytes, size_t size,
                      Problem *problem) {
    const char *token = instance->mechanism->token;
    size_t length = strlen(token);
    if (size < STATE_HEAD || memcmp(bytes, STATE_MAGIC, sizeof STATE_MAGIC) != 0) {
        return fail(problem, "the bytes are not a saved state");
    }
    if (u32_at(bytes + 8) != STATE_VERSION) {
        return fail(problem, "the state was saved by another version of this FMU");
    }
    if (u32_at(bytes + 12) != size) {
        return fail(problem, "the saved state is damaged: it has another size than when saved");
    }
    if (u32_at(bytes + 32) != length || size - STATE_HEAD < length ||
        memcmp(bytes + STATE_HEAD, token, length) != 0) {
        return fail(problem, "the state was saved by another model, or another version of this "
                             "one");
    }
    if (u32_at(bytes + 20) != (uint32_t)instance->standard->version ||
        u32_at(bytes + 24) != (uint32_t)instance->kind ||
        u32_at(bytes + 28) != (uint32_t)instance->event_mode) {
        return fail(problem, "the state was saved by an instance of another kind: FMI version, "
                             "interface type and eventModeUsed must be the same");
    }
    if (size != saved_size(instance)) {
        return fail(problem, "the state was saved by another version of this FMU");
    }
    return true;
}

/* Return whether an instance of this kind can be in a mode between calls. */
static bool possible_mode(const Instance *instance, uint32_t mode) {
    unsigned modes = IN_INSTANTIATED | IN_INITIALIZATION | IN_TERMINATED;
    if (instance->kind == MODEL_EXCHANGE) {
        modes |= IN_EVENT | IN_CONTINUOUS;
    } else {
        modes |= instance->event_mode ? IN_EVENT | IN_STEP : IN_STEP;
    }
    return mode < MODES && modes >> mode & 1u;
}

/* Read everything but the arrays into a scratch instance. */
static bool read_fields(const Instance *instance, const unsigned char **at, Instance *it,
                       Problem *problem) {
    const Mechanism *mechanism = instance->mechanism;
    uint32_t mode = get_u32(at), flags = get_u32(at), last_step = get_u32(at);
    it->unknown = get_u32(at);
    it->start_time = get_f64(at);
    it->stop_time = get_f64(at);
    it->tolerance = get_f64(at);
    if (!possible_mode(instance, mode) || flags > FLAGS || last_step > FMU_ERROR ||
        !finite_number(it->start_time) || it->stop_time != it->stop_time) {
        return fail(problem, "the saved state is damaged");
    }
    it->mode = (Mode)mode;
    it->last_step = (int)last_step;
    it->experiment = flags & FLAG_EXPERIMENT;
    it->experiment_refused = flags & FLAG_EXPERIMENT_REFUSED;
    it->stop_defined = flags & FLAG_STOP_DEFINED;
    it->tolerance_defined = flags & FLAG_TOLERANCE_DEFINED;
    it->event_due = flags & FLAG_EVENT_DUE;
    it->updated = flags & FLAG_UPDATED;
    it->unknown_refused = flags & FLAG_UNKNOWN_REFUSED;
    const Parameter *bounds = &mechanism->parameters[mechanism->tolerance];
    return it->tolerance_defined ? check_parameter(bounds, it->tolerance, problem)
                                 : it->tolerance == 0.0 || fail(problem, "the saved state is "
                                                                         "damaged");
}

/* Return whether the mode is possible for a simulation that has started, or has not started. */
static bool is_consistent(const Simulation *simulation, Mode mode) {
    bool begun = simulation_started(simulation);
    return mode == MODE_INITIALIZATION || mode == MODE_TERMINATED ||
           begun == (mode != MODE_INSTANTIATED);
}

/* Restore the simulation, or leave it unchanged. */
static bool restore_simulation(Instance *instance, const unsigned char *at, Mode mode,
                           Problem *problem) {
    Simulation *simulation = instance->simulation;
    size_t count = simulation_state_count(simulation);
    for (size_t i = 0; i < count; i++) {
        instance->after[i] = get_f64(&at);
    }
    keep(instance);
    if (!simulation_restore(simulation, instance->after, problem)) {
        return false;
    }
    if (!is_consistent(simulation, mode)) {
        go_back(instance);
        return fail(problem, "the saved state is damaged");
    }
    return true;
}

/* Restore an instance from the bytes of a state, or leave it unchanged. */
static bool restore_bytes(Instance *instance, const unsigned char *bytes, size_t size,
                      Problem *problem) {
    const Mechanism *mechanism = instance->mechanism;
    size_t slots = (size_t)mechanism->slots.count;
    if (!check_head(instance, bytes, size, problem)) {
        return false;
    }
    const unsigned char *at = bytes + STATE_HEAD + strlen(mechanism->token);
    Instance read = *instance;
    if (!read_fields(instance, &at, &read, problem)) {
        return false;
    }
    const unsigned char *refused = at, *acknowledged = at + slots;
    at = acknowledged + (size_t)mechanism->stop_count * sizeof(double);
    if (!restore_simulation(instance, at, read.mode, problem)) {
        return false;
    }
    *instance = read;
    for (size_t i = 0; i < slots; i++) {
        instance->refused[i] = refused[i] != 0;
    }
    for (int i = 0; i < mechanism->stop_count; i++) {
        instance->acknowledged[i] = get_f64(&acknowledged);
    }
    return true;
}

static Saved *new_saved(size_t size) {
    Saved *saved = malloc(sizeof *saved + size);
    if (saved) {
        saved->size = size;
        saved->bytes = (unsigned char *)(saved + 1);
    }
    return saved;
}

PRBM int save_state(const Instance *instance, void **state) {
    size_t size = saved_size(instance);
    Saved *saved = *state;
    if (saved && saved->size != size) {
        free_state(state);
        saved = NULL;
    }
    saved = saved ? saved : new_saved(size);
    if (!saved) {
        return refuse(instance, FMU_ERROR, "there is not enough memory to save the state");
    }
    put_state(instance, saved->bytes, size);
    *state = saved;
    return FMU_OK;
}

PRBM int restore_state(Instance *instance, const void *state) {
    const Saved *saved = state;
    Problem problem;
    if (!restore_bytes(instance, saved->bytes, saved->size, &problem)) {
        return refuse(instance, FMU_ERROR, "%s", problem.text);
    }
    return FMU_OK;
}

PRBM void free_state(void **state) {
    free(*state);
    *state = NULL;
}

PRBM int serialize(const Instance *instance, const void *state, unsigned char *bytes, size_t size) {
    const Saved *saved = state;
    if (size < saved->size) {
        return refuse(instance, FMU_ERROR, "a saved state needs %lu bytes, not %lu",
                      (unsigned long)saved->size, (unsigned long)size);
    }
    memcpy(bytes, saved->bytes, saved->size);
    unsigned char *at = bytes + STATE_CHECKED_FROM - 4;
    put_u32(&at, checksum(bytes + STATE_CHECKED_FROM, saved->size - STATE_CHECKED_FROM));
    return FMU_OK;
}

PRBM int deserialize(const Instance *instance, const unsigned char *bytes, size_t size,
                     void **state) {
    Problem problem;
    /* The buffer may be larger than the state. */
    size_t declared = size < STATE_HEAD ? 0 : u32_at(bytes + 12);
    size = declared >= STATE_HEAD && declared < size ? declared : size;
    if (!check_head(instance, bytes, size, &problem)) {
        return refuse(instance, FMU_ERROR, "%s", problem.text);
    }
    if (u32_at(bytes + STATE_CHECKED_FROM - 4) !=
        checksum(bytes + STATE_CHECKED_FROM, size - STATE_CHECKED_FROM)) {
        return refuse(instance, FMU_ERROR, "the saved state is damaged: its checksum is wrong");
    }
    Saved *saved = new_saved(size);
    if (!saved) {
        return refuse(instance, FMU_ERROR, "there is not enough memory to restore a state");
    }
    memcpy(saved->bytes, bytes, size);
    *state = saved;
    return FMU_OK;
}
