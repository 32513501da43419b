/* Fuzz the reader of a mechanism's tables, and simulate the tables that it accepts.
 *
 * This is a target of libFuzzer (clang -fsanitize=fuzzer,...).  With -DSTANDALONE it is a program
 * that mutates files:
 *
 *     tables SECONDS SEED FILE...
 *
 * The size and the checksum of mutated tables are mostly corrected, so that the reader goes on to
 * the content behind them.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "bytes.h"
#include "generated.h"
#include "motion.h"

enum {
    HEAD = 16,
    VERSION_AT = 4,
    SIZE_AT = 8,
    CHECKSUM_AT = 12,
    SIMULATED_COORDINATES_MAX = 24, /* larger mechanisms are not simulated: it takes too long */
    STEPS_OF_ADVANCE = 200,
    ROOM_FOR_TABLES = 1 << 18,
    VALID_MAX = 16
};

int LLVMFuzzerInitialize(int *count, char ***words);
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);
size_t LLVMFuzzerMutate(uint8_t *data, size_t size, size_t most);
size_t LLVMFuzzerCustomMutator(uint8_t *data, size_t size, size_t most, unsigned seed);

/* Inputs; mechanisms that were read; simulations that started. */
static unsigned long tried, opened, started;

/* Tables that could be simulated: mutations of them often can be, too. */
static uint8_t valid[VALID_MAX][ROOM_FOR_TABLES];
static size_t valid_sizes[VALID_MAX], valid_count;

static void print_counts(void) {
    printf("%lu tables, %lu accepted, %lu started\n", tried, opened, started);
}

/* --- test of an input --- */

static void must(bool fact, const char *error) {
    if (!fact) {
        fprintf(stderr, "tables: %s\n", error);
        abort();
    }
}

static void read_all(Simulation *simulation) {
    const Mechanism *mechanism = simulation_mechanism(simulation);
    Problem problem;
    double x;
    for (int i = 0; i < mechanism->variable_count; i++) {
        (void)simulation_get(simulation, mechanism->variables[i].slot, &x, &problem);
    }
}

/* A thousandth of the period of the released mode [s], so that every input is fast. */
static double short_time(Simulation *simulation) {
    const Mechanism *mechanism = simulation_mechanism(simulation);
    Problem problem;
    double frequency = 0.0;
    bool known = simulation_get(simulation, mechanism->slots.frequency, &frequency, &problem);
    return known && frequency > 1.0 ? 1e-3 / frequency : 1e-3;
}

/* Advance to a time, and abandon a step of a stiff mechanism that takes too many steps. */
static bool advance_or_abandon(Simulation *simulation, double time, Problem *problem) {
    Effort effort = {0, 0, 0.0};
    bool reached = false;
    if (!simulation_advance_part(simulation, time, STEPS_OF_ADVANCE, &effort, &reached, problem)) {
        return false;
    }
    if (!reached) {
        simulation_abandon(simulation);
    }
    return reached;
}

static void advance(Simulation *simulation) {
    Problem problem;
    double time = short_time(simulation);
    bool event;
    Effort effort = {0, 0, 0.0};
    read_all(simulation);
    if (advance_or_abandon(simulation, time, &problem) &&
        simulation_advance_some(simulation, 2 * time, false, &effort, &event, &problem) && event) {
        (void)simulation_handle_event(simulation, &problem);
    }
    read_all(simulation);
}

static void exchange_some(Simulation *simulation) {
    Problem problem;
    int n = exchange_states(simulation), m = exchange_indicators(simulation);
    double *x = malloc(((size_t)n + 1) * sizeof *x), *dx = malloc(((size_t)n + 1) * sizeof *dx);
    double *z = malloc(((size_t)m + 1) * sizeof *z);
    bool event, changed;
    must(x && dx && z, "no memory");
    exchange_get(simulation, x);
    exchange_set(simulation, x);
    exchange_set_time(simulation, 1e-6);
    exchange_nominals(simulation, dx);
    (void)exchange_derivatives(simulation, dx, &problem);
    (void)exchange_event_indicators(simulation, z, &problem);
    (void)exchange_completed_step(simulation, &event, &problem);
    (void)exchange_event(simulation, &changed, &problem);
    read_all(simulation);
    free(x);
    free(dx);
    free(z);
}

/* Keep tables as a start of mutations: the first ones for ever, the last ones in turn. */
static void keep(const uint8_t *data, size_t size) {
    size_t place = valid_count < VALID_MAX ? valid_count : VALID_MAX / 2 + tried % (VALID_MAX / 2);
    if (size <= ROOM_FOR_TABLES) {
        memcpy(valid[place], data, size);
        valid_sizes[place] = size;
        valid_count += valid_count < VALID_MAX;
    }
}

static void start(const Mechanism *mechanism, bool for_exchange) {
    Problem problem = {{0}};
    Simulation *simulation = simulation_open(mechanism);
    if (!simulation) {
        return;
    }
    if (simulation_start(simulation, 0.0, 0.0, for_exchange, &problem)) {
        started++;
        for_exchange ? exchange_some(simulation) : advance(simulation);
    } else {
        must(problem.text[0], "the start failed without a message");
    }
    simulation_close(simulation);
}

int LLVMFuzzerInitialize(int *count, char ***words) {
    (void)count, (void)words;
    atexit(print_counts);
    return 0;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    Problem problem = {{0}};
    uint8_t *bytes = malloc(size ? size : 1); /* of the exact size: sanitizers see reads beyond */
    must(bytes, "no memory");
    tried++;
    memcpy(bytes, data, size);
    Mechanism *mechanism = mechanism_open(bytes, size, &problem);
    free(bytes);
    if (!mechanism) {
        must(problem.text[0] && memchr(problem.text, 0, sizeof problem.text),
             "the tables were rejected without a message");
        return 0;
    }
    opened++;
    unsigned long before = started;
    if (mechanism->coordinate_count <= SIMULATED_COORDINATES_MAX) {
        start(mechanism, false);
        start(mechanism, true);
    }
    if (started > before) {
        keep(data, size);
    }
    mechanism_close(mechanism);
    return 0;
}

/* --- mutations --- */

static void correct_header(uint8_t *data, size_t size) {
    if (size >= HEAD) {
        memcpy(data, "PRBM", VERSION_AT);
        put_u32(data + VERSION_AT, TABLES_VERSION);
        put_u32(data + SIZE_AT, (uint32_t)size);
        put_u32(data + CHECKSUM_AT, crc(data + HEAD, size - HEAD));
    }
}

static uint64_t generator;

static uint32_t arbitrary(uint32_t below) {
    generator = generator * 6364136223846793005u + 1442695040888963407u;
    return (uint32_t)(generator >> 33) % below;
}

static void overwrite(uint8_t *data, size_t size) {
    static const uint32_t counts[] = {0, 1, 2, 3, 7, 64, 255, 1000, 65536, 0x7FFFFFFF, 0xFFFFFFFF};
    static const double numbers[] = {0.0,   -0.0,  1.0,  -1.0, 1e-3,     1e3,       1e-9, 1e9,
                                     1e300, 5e-324, 90.0, 45.0, INFINITY, -INFINITY, NAN};
    size_t place = arbitrary((uint32_t)size);
    if (arbitrary(3) == 0) {
        data[place] = (uint8_t)(data[place] ^ 1u << arbitrary(8));
    } else if (arbitrary(2) == 0 && place + 4 <= size) {
        put_u32(data + place, counts[arbitrary(sizeof counts / sizeof *counts)]);
    } else if (place + 8 <= size) {
        double x = numbers[arbitrary(sizeof numbers / sizeof *numbers)];
        memcpy(data + place, &x, sizeof x);
    }
}

/* Multiply a number by a factor: the tables mostly stay valid, and the motion changes. */
static void scale(uint8_t *data, size_t size) {
    for (int tries = 0; tries < 64; tries++) {
        size_t place = arbitrary((uint32_t)size);
        double x;
        if (place + 8 > size) {
            continue;
        }
        memcpy(&x, data + place, sizeof x);
        if (fabs(x) > 1e-12 && fabs(x) < 1e15) {
            static const double factors[] = {0.5, 0.9, 1.1, 2.0, -1.0, 10.0, 0.1};
            x *= factors[arbitrary(sizeof factors / sizeof *factors)];
            memcpy(data + place, &x, sizeof x);
            return;
        }
    }
}

static size_t cut_or_copy(uint8_t *data, size_t size, size_t most) {
    size_t from = arbitrary((uint32_t)size), length = 1 + arbitrary(40);
    if (from + length > size) {
        length = size - from;
    }
    if (arbitrary(2) == 0) {
        memmove(data + from, data + from + length, size - from - length);
        return size - length;
    }
    if (size + length > most) {
        return size;
    }
    memmove(data + from + length, data + from, size - from);
    return size + length;
}

static size_t mutated(uint8_t *data, size_t size, size_t most) {
    for (uint32_t count = 1 + arbitrary(4); count > 0 && size > HEAD; count--) {
        switch (arbitrary(5)) {
        case 0:
            size = cut_or_copy(data, size, most);
            break;
        case 1:
            overwrite(data, size);
            break;
        default:
            scale(data, size);
        }
    }
    return size;
}

size_t LLVMFuzzerCustomMutator(uint8_t *data, size_t size, size_t most, unsigned seed) {
    generator = seed * 0x9E3779B97F4A7C15u + 1;
    size_t which = valid_count ? arbitrary((uint32_t)valid_count) : 0;
    if (valid_count && valid_sizes[which] <= most && arbitrary(2)) {
        size = valid_sizes[which];
        memcpy(data, valid[which], size);
    }
    size = arbitrary(2) && size > HEAD ? mutated(data, size, most)
                                       : LLVMFuzzerMutate(data, size, most);
    if (arbitrary(10)) {
        correct_header(data, size);
    }
    return size;
}

#if defined(STANDALONE)

enum { MOST_FILES = 16 };

size_t LLVMFuzzerMutate(uint8_t *data, size_t size, size_t most) {
    (void)most;
    if (size) {
        overwrite(data, size);
    }
    return size;
}

int main(int count, char **words) {
    static uint8_t files[MOST_FILES][ROOM_FOR_TABLES], data[ROOM_FOR_TABLES];
    size_t sizes[MOST_FILES];
    int given = 0;
    unsigned seed = count > 2 ? (unsigned)strtoul(words[2], NULL, 10) : 0;
    time_t end = time(NULL) + (count > 1 ? atol(words[1]) : 0);
    for (int i = 3; i < count && given < MOST_FILES; i++, given++) {
        FILE *file = fopen(words[i], "rb");
        must(file != NULL, "a file cannot be read");
        sizes[given] = fread(files[given], 1, ROOM_FOR_TABLES, file);
        fclose(file);
        (void)LLVMFuzzerTestOneInput(files[given], sizes[given]);
    }
    must(given && started == 2 * (unsigned long)given, "an unchanged file was rejected");
    LLVMFuzzerInitialize(&count, &words);
    while (time(NULL) < end) {
        size_t which = tried % (size_t)given, size = sizes[which];
        memcpy(data, files[which], size);
        size = LLVMFuzzerCustomMutator(data, size, ROOM_FOR_TABLES, seed + (unsigned)tried);
        if (getenv("KEEP")) { /* the last input, for inspection after a crash */
            FILE *file = fopen(getenv("KEEP"), "wb");
            must(file != NULL, "the input cannot be kept");
            fwrite(data, 1, size, file);
            fclose(file);
        }
        (void)LLVMFuzzerTestOneInput(data, size);
    }
    return 0;
}

#endif
