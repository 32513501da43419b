/* The command line:
 *
 *     importer JOB [run]                  run the job and print the recorded rows
 *     importer JOB interrupt K save       run the job twice from communication point K, from a
 *                                         saved state; fail if the rows differ
 *     importer JOB interrupt K serialize  the same, with the state serialized to a new instance
 *     importer JOB cycles N POINTS        instantiate, run to a communication point, free; N times
 *     importer JOB reload N POINTS        the same, and load and unload the library each time
 *     importer JOB threads N              run N instances at once, each in its own thread
 *     importer JOB speed N READINGS       print the CPU time [s] of all steps, with a number of
 *                                         readings after each; N times
 *     importer JOB calls SEED N COUNT     N sequences of COUNT arbitrary calls, from SEED on
 *     importer JOB replay FILE COUNT      the sequence of calls that the bytes of a file select
 */
#include "importer.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#if defined(_WIN32)
#include <fcntl.h>
#include <io.h>
#include <windows.h>

typedef HANDLE Thread;
#define THREAD_FUNCTION DWORD WINAPI
#define THREAD_RESULT 0

static bool thread_start(Thread *thread, LPTHREAD_START_ROUTINE function, void *argument) {
    *thread = CreateThread(NULL, 0, function, argument, 0, NULL);
    return *thread != NULL;
}

static void thread_join(Thread thread) {
    WaitForSingleObject(thread, INFINITE);
    CloseHandle(thread);
}

/* Return the CPU time of this process [s]. */
static double seconds(void) {
    FILETIME created, ended, kernel, user;
    GetProcessTimes(GetCurrentProcess(), &created, &ended, &kernel, &user);
    return 1e-7 * (4294967296.0 * user.dwHighDateTime + user.dwLowDateTime);
}

static void binary_output(void) {
    _setmode(_fileno(stdout), _O_BINARY);
}

#else
#include <pthread.h>
#include <time.h>

typedef pthread_t Thread;
#define THREAD_FUNCTION void *
#define THREAD_RESULT NULL

static bool thread_start(Thread *thread, void *(*function)(void *), void *argument) {
    return pthread_create(thread, NULL, function, argument) == 0;
}

static void thread_join(Thread thread) {
    pthread_join(thread, NULL);
}

/* Return the CPU time of this process [s]. */
static double seconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static void binary_output(void) {}

#endif

enum { MOST_THREADS = 64 };

/* --- runs --- */

/* Instantiate, run to a communication point, terminate, free. */
static bool run(const Library *library, const Job *job, size_t point, Rows *rows) {
    Instance instance;
    Motion motion;
    if (!instance_open(&instance, library, job)) {
        return false;
    }
    bool good = motion_open(&motion, &instance, rows) && motion_start(&motion) &&
                motion_continue(&motion, point) && instance_terminate(&instance);
    motion_close(&motion);
    instance_close(&instance);
    return good;
}

static bool run_and_print(const Library *library, const Job *job) {
    Rows rows = {NULL, 0, 0, 0};
    bool good = run(library, job, job->point_count, &rows);
    rows_print(&rows);
    rows_free(&rows);
    return good;
}

static bool cycles(const Library *library, const Job *job, long count, size_t point) {
    bool good = true;
    for (long i = 0; good && i < count; i++) {
        Rows rows = {NULL, 0, 0, 0};
        good = run(library, job, point, &rows);
        rows_free(&rows);
    }
    return good;
}

static bool reload(const Job *job, long count, size_t point) {
    bool good = true;
    for (long i = 0; good && i < count; i++) {
        Library library;
        good = library_open(&library, job->library, job->version);
        if (good) {
            good = cycles(&library, job, 1, point);
            library_close(&library);
        }
    }
    return good;
}

/* --- interrupted runs --- */

/* Serialize a state, close its instance and deserialize the state in a new instance. */
static bool transplant(Instance *from, Instance *to, void **state) {
    size_t size = 0;
    uint8_t *bytes = instance_serialize(from, *state, &size);
    bool good = bytes && instance_forget(from, state);
    instance_close(from);
    good = good && instance_open(to, from->library, from->job) && instance_initialize(to) &&
           instance_deserialize(to, bytes, size, state);
    free(bytes);
    return good;
}

static bool same_end(const Rows *rows, size_t first, size_t second) {
    size_t count = second - first, size = count * rows->width * sizeof *rows->numbers;
    if (rows->count - second != count) {
        fprintf(stderr, "importer: %zu rows, but %zu from the restored state\n", count,
                rows->count - second);
        return false;
    }
    if (memcmp(rows->numbers + first * rows->width, rows->numbers + second * rows->width, size)) {
        fprintf(stderr, "importer: the rows differ after the state is restored\n");
        return false;
    }
    return true;
}

static bool interrupted(Motion *motion, Instance *first, Instance *second, size_t point,
                        bool serialize) {
    const Job *job = first->job;
    void *state = NULL;
    if (!motion_start(motion) || !motion_continue(motion, point) ||
        !instance_save(first, &state)) {
        return false;
    }
    double time = motion->time;
    size_t saved = motion->rows->count;
    if (!motion_continue(motion, job->point_count)) {
        return false;
    }
    size_t ended = motion->rows->count;
    if (serialize) {
        if (!transplant(first, second, &state)) {
            return false;
        }
        motion->instance = second;
    }
    motion->point = point;
    motion->time = time;
    if (!instance_restore(motion->instance, state) ||
        !instance_forget(motion->instance, &state) || state) {
        return false;
    }
    if (job->kind == MODEL_EXCHANGE && (!instance_get_states(motion->instance, motion->x) ||
                                        !instance_indicators(motion->instance, motion->z))) {
        return false;
    }
    bool good = motion_continue(motion, job->point_count) && same_end(motion->rows, saved, ended);
    motion->rows->count = ended;
    return good && instance_terminate(motion->instance);
}

static bool interrupt(const Library *library, const Job *job, size_t point, bool serialize) {
    Instance first, second;
    Motion motion;
    Rows rows = {NULL, 0, 0, 0};
    memset(&second, 0, sizeof second);
    if (!instance_open(&first, library, job)) {
        return false;
    }
    bool good = motion_open(&motion, &first, &rows) &&
                interrupted(&motion, &first, &second, point, serialize);
    motion_close(&motion);
    instance_close(&first);
    instance_close(&second);
    rows_print(&rows);
    rows_free(&rows);
    return good;
}

/* --- threads --- */

typedef struct {
    const Library *library;
    const Job *job;
    Rows rows;
    bool good;
} Task;

static THREAD_FUNCTION work(void *argument) {
    Task *task = argument;
    task->good = run(task->library, task->job, task->job->point_count, &task->rows);
    return THREAD_RESULT;
}

static bool threads(const Library *library, const Job *job, long count) {
    static Task tasks[MOST_THREADS];
    Thread handles[MOST_THREADS];
    bool good = count > 0 && count <= MOST_THREADS;
    long started = 0;
    for (; good && started < count; started++) {
        tasks[started].library = library;
        tasks[started].job = job;
        good = thread_start(handles + started, work, tasks + started);
    }
    for (long i = 0; i < started; i++) {
        const Rows *rows = &tasks[i].rows, *expected = &tasks[0].rows;
        thread_join(handles[i]);
        good = good && tasks[i].good && rows->count == expected->count &&
               memcmp(rows->numbers, expected->numbers,
                      rows->count * rows->width * sizeof(double)) == 0;
    }
    if (good) {
        rows_print(&tasks[0].rows);
    }
    for (long i = 0; i < started; i++) {
        rows_free(&tasks[i].rows);
    }
    return good;
}

/* --- speed --- */

static bool stepping(Instance *instance, size_t readings, double *elapsed) {
    const Job *job = instance->job;
    double time = job->start, reached, value, begun = seconds();
    bool event;
    for (size_t i = 0; i < job->point_count; i++) {
        if (!instance_step(instance, time, job->points[i] - time, &reached, &event)) {
            return false;
        }
        time = job->points[i];
        for (size_t k = 0; k < readings; k++) {
            if (!instance_get(instance, job->records + k % job->record_count, &value)) {
                return false;
            }
        }
    }
    *elapsed = seconds() - begun;
    return true;
}

static bool speed(const Library *library, const Job *job, long count, size_t readings) {
    bool good = job->record_count > 0;
    for (long i = 0; good && i < count; i++) {
        Instance instance;
        double elapsed = 0.0;
        good = instance_open(&instance, library, job);
        if (!good) {
            break;
        }
        good = instance_initialize(&instance) && stepping(&instance, readings, &elapsed);
        instance_close(&instance);
        printf("%.9e\n", elapsed);
    }
    return good;
}

/* --- arbitrary calls --- */

static bool calls(const Library *library, const Job *job, uint64_t seed, long count, size_t size) {
    for (long i = 0; i < count; i++) {
        Source source = {NULL, 0, 0, seed + (uint64_t)i};
        arbitrary_calls(library, job, &source, size);
    }
    printf("%ld sequences of %zu calls\n", count, size);
    return true;
}

static bool replay(const Library *library, const Job *job, const char *path, size_t size) {
    static uint8_t bytes[1 << 16];
    FILE *file = fopen(path, "rb");
    if (!file) {
        return false;
    }
    Source source = {bytes, fread(bytes, 1, sizeof bytes, file), 0, 0};
    fclose(file);
    arbitrary_calls(library, job, &source, size);
    return true;
}

static bool execute(const Job *job, int count, char **words) {
    Library library;
    const char *command = count > 0 ? words[0] : "run";
    long number = count > 1 ? strtol(words[1], NULL, 10) : 0;
    size_t size = count > 2 ? strtoul(words[2], NULL, 10) : 0;
    if (strcmp(command, "reload") == 0) {
        return reload(job, number, size);
    }
    if (!library_open(&library, job->library, job->version)) {
        return false;
    }
    bool good = false;
    if (strcmp(command, "run") == 0) {
        good = run_and_print(&library, job);
    } else if (strcmp(command, "interrupt") == 0 && count > 2) {
        good = interrupt(&library, job, (size_t)number, strcmp(words[2], "serialize") == 0);
    } else if (strcmp(command, "cycles") == 0) {
        good = cycles(&library, job, number, size);
    } else if (strcmp(command, "threads") == 0) {
        good = threads(&library, job, number);
    } else if (strcmp(command, "speed") == 0) {
        good = speed(&library, job, number, size);
    } else if (strcmp(command, "calls") == 0 && count > 3) {
        good = calls(&library, job, (uint64_t)number, (long)size, strtoul(words[3], NULL, 10));
    } else if (strcmp(command, "replay") == 0 && count > 2) {
        good = replay(&library, job, words[1], size);
    } else {
        fprintf(stderr, "importer: unknown or incomplete command \"%s\"\n", command);
    }
    library_close(&library);
    return good;
}

int main(int count, char **words) {
    Job job;
    if (count < 2) {
        fprintf(stderr, "importer: give the path of a job file\n");
        return 2;
    }
    binary_output();
    bool good = job_read(&job, words[1]) && execute(&job, count - 2, words + 2);
    job_free(&job);
    return good ? 0 : 1;
}
