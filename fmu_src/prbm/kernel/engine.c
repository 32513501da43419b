/* The library of the Python package: simulations with a record of their impacts and events. */
#include <float.h>
#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/modal.h"
#include "core/sections.h"
#include "core/tables.h"
#include "engine.h"
#include "values.h"
#include "hybrid/access.h"

enum { FIRST_ROWS = 16 }; /* number of rows of a record for which there is memory at first */
enum { CALL_STEPS = 50, CALL_COORDINATES = 30 }; /* steps of a call, up to so many coordinates */

/* Rows of numbers, which grow. */
typedef struct {
    double *numbers; /* (room, size of a row) */
    int count, room;
    int before; /* count before an advance that is unfinished */
} Record;

struct Engine {
    Simulation *simulation;
    int n;           /* number of coordinates */
    Record impacts;  /* prbm_impact_size numbers each */
    bool incomplete; /* an impact could not be recorded */
    Record events;   /* time and values of the slots, before and after each event */
    int *slots, slot_count;
    Effort effort;   /* of an advance that is unfinished; no steps: none is */
};

static bool succeed(bool ok, const Problem *problem, char *message) {
    if (!ok) {
        memcpy(message, problem->text, sizeof problem->text);
    }
    return ok;
}

/* --- mechanisms ------------------------------------------------------------------------------- */

EXPORTED Mechanism *prbm_mechanism_open(const unsigned char *tables, size_t size, char *message) {
    Problem problem = {""};
    Mechanism *mechanism = mechanism_open(tables, size, &problem);
    succeed(mechanism != NULL, &problem, message);
    return mechanism;
}

EXPORTED void prbm_mechanism_close(Mechanism *mechanism) {
    mechanism_close(mechanism);
}

EXPORTED Engine *prbm_open(const Mechanism *mechanism) {
    Engine *engine = calloc(1, sizeof *engine);
    if (!engine) {
        return NULL;
    }
    engine->simulation = simulation_open(mechanism);
    engine->n = mechanism->coordinate_count;
    if (!engine->simulation) {
        free(engine);
        return NULL;
    }
    return engine;
}

EXPORTED void prbm_close(Engine *engine) {
    simulation_close(engine->simulation);
    free(engine->impacts.numbers);
    free(engine->events.numbers);
    free(engine->slots);
    free(engine);
}

/* --- the records of impacts and events -------------------------------------------------------- */

enum { IMPACT_NUMBERS = 12 }; /* before the coordinates and rates */

EXPORTED int prbm_impact_size(const Engine *engine) {
    return IMPACT_NUMBERS + 3 * engine->n;
}

static size_t impact_size(const Engine *engine) {
    return (size_t)prbm_impact_size(engine);
}

/* Return one more row of a record; NULL if there is no memory. */
static double *new_row(Record *record, size_t size) {
    if (record->count == record->room) {
        if (record->room > INT_MAX / 2) {
            return NULL;
        }
        int room = record->room ? 2 * record->room : FIRST_ROWS;
        size_t bytes = size * sizeof(double);
        bool fits = (size_t)room < SIZE_MAX / bytes;
        double *numbers = fits ? realloc(record->numbers, (size_t)room * bytes) : NULL;
        if (!numbers) {
            return NULL;
        }
        record->numbers = numbers;
        record->room = room;
    }
    return record->numbers + (size_t)record->count++ * size;
}

/* Move the rows of a record out. */
static void move_rows(Record *record, size_t size, double *numbers) {
    size_t count = (size_t)record->count * size;
    if (count > 0) {
        memcpy(numbers, record->numbers, count * sizeof *numbers);
    }
    record->count = 0;
}

static void record_impact(void *listener, const Impact *impact) {
    Engine *engine = listener;
    double *to = new_row(&engine->impacts, impact_size(engine));
    if (!to) {
        engine->incomplete = true;
        return;
    }
    int n = engine->n;
    const double numbers[IMPACT_NUMBERS] = {
        impact->index,         impact->count,   impact->time,
        impact->approach_speed, impact->rebound_speed, impact->impulse,
        impact->energy_lost,   impact->modal_restitution, impact->impulse_sum,
        impact->peak_force,    impact->indentation, impact->contact_duration,
    };
    memcpy(to, numbers, sizeof numbers);
    copy(n, impact->q, to + IMPACT_NUMBERS);
    copy(n, impact->before, to + IMPACT_NUMBERS + n);
    copy(n, impact->after, to + IMPACT_NUMBERS + 2 * n);
}

EXPORTED void prbm_record(Engine *engine, bool record) {
    simulation_listen(engine->simulation, record ? record_impact : NULL, engine);
    engine->impacts.count = 0;
}

EXPORTED void prbm_impacts(Engine *engine, double *numbers) {
    move_rows(&engine->impacts, impact_size(engine), numbers);
}

static bool record_event(void *observer, double time, bool after, Problem *problem) {
    Engine *engine = observer;
    double *row = new_row(&engine->events, 1 + (size_t)engine->slot_count);
    bool ok = row || fail(problem, "there is not enough memory to record the events up to "
                                   "t = %.9g s: simulate in shorter parts", time);
    if (ok) {
        row[0] = after ? time : nextafter(time, -DBL_MAX);
    }
    for (int i = 0; ok && i < engine->slot_count; i++) {
        ok = simulation_get(engine->simulation, engine->slots[i], &row[1 + i], problem);
    }
    return ok;
}

EXPORTED bool prbm_observe(Engine *engine, int count, const int *slots, char *message) {
    Problem problem = {""};
    if (!slots) {
        simulation_observe(engine->simulation, NULL, NULL);
        return true;
    }
    int *kept = realloc(engine->slots, ((size_t)count + 1) * sizeof *slots);
    if (!succeed(kept || fail(&problem, "there is not enough memory to record events"), &problem,
                 message)) {
        return false;
    }
    memcpy(kept, slots, (size_t)count * sizeof *slots);
    free(engine->events.numbers);
    engine->events = (Record){NULL, 0, 0, 0}; /* Its rows have another length. */
    engine->slots = kept;
    engine->slot_count = count;
    simulation_observe(engine->simulation, record_event, engine);
    return true;
}

EXPORTED int prbm_observed_count(const Engine *engine) {
    return engine->events.count;
}

EXPORTED void prbm_observed(Engine *engine, double *rows) {
    move_rows(&engine->events, 1 + (size_t)engine->slot_count, rows);
}

/* --- simulation ------------------------------------------------------------------------------- */

EXPORTED bool prbm_set(Engine *engine, int first, int count, const double *values,
                       char *message) {
    Problem problem = {""};
    bool ok = true;
    for (int i = 0; ok && i < count; i++) {
        ok = simulation_set(engine->simulation, first + i, values[i], &problem);
    }
    return succeed(ok, &problem, message);
}

EXPORTED bool prbm_start(Engine *engine, double start_time, double tolerance, char *message) {
    Problem problem = {""};
    bool ok = simulation_start(engine->simulation, start_time, tolerance, false, &problem);
    return succeed(ok, &problem, message);
}

EXPORTED bool prbm_instability(Engine *engine, int *counts, char *message) {
    Problem problem = {""};
    return succeed(simulation_instability(engine->simulation, counts, counts + 1, &problem),
                   &problem, message);
}

EXPORTED bool prbm_check_step(const Engine *engine, double step, char *message) {
    Problem problem = {""};
    return succeed(simulation_check_step(engine->simulation, step, &problem), &problem, message);
}

/* Integration steps in one call.  The time of a step grows with n^3. */
static int steps_of_call(int n) {
    double ratio = n / (double)CALL_COORDINATES;
    return ratio > 1.0 ? 1 + (int)(CALL_STEPS / (ratio * ratio * ratio)) : CALL_STEPS;
}

/* Remove the rows of an advance that has failed. */
static void forget_rows(Engine *engine) {
    engine->impacts.count = engine->impacts.before;
    engine->events.count = engine->events.before;
}

EXPORTED int prbm_advance(Engine *engine, double time, char *message) {
    Problem problem = {""};
    Simulation *sim = engine->simulation;
    bool reached;
    if (engine->effort.steps == 0) {
        engine->impacts.before = engine->impacts.count;
        engine->events.before = engine->events.count;
        engine->incomplete = false;
    }
    bool ok = simulation_advance_part(sim, time, steps_of_call(engine->n), &engine->effort,
                                      &reached, &problem);
    if (ok && engine->incomplete) {
        simulation_abandon(sim);
        ok = fail(&problem, "there is not enough memory to record the impacts up to "
                            "t = %.9g s: simulate in shorter parts", time);
    }
    if (ok && !reached) {
        return ENGINE_UNFINISHED;
    }
    engine->effort.steps = 0;
    if (!succeed(ok, &problem, message)) {
        forget_rows(engine);
        return -1;
    }
    return engine->impacts.count;
}

EXPORTED void prbm_abandon(Engine *engine) {
    if (engine->effort.steps > 0) {
        simulation_abandon(engine->simulation);
        forget_rows(engine);
        engine->effort.steps = 0;
    }
}

EXPORTED bool prbm_values(Engine *engine, int count, const int *slots, double *values,
                          char *message) {
    Problem problem = {""};
    bool ok = true;
    for (int i = 0; ok && i < count; i++) {
        ok = simulation_get(engine->simulation, slots[i], &values[i], &problem);
    }
    return succeed(ok, &problem, message);
}

EXPORTED int prbm_sample(Engine *engine, int samples, const double *times, int count,
                         const int *slots, double *values, int *done, char *message) {
    double first = simulation_steps(engine->simulation) + *done;
    int most = steps_of_call(engine->n);
    while (*done < samples) {
        if (simulation_steps(engine->simulation) + *done - first >= most) {
            return ENGINE_UNFINISHED;
        }
        int impacts = prbm_advance(engine, times[*done], message);
        if (impacts < 0) {
            return impacts;
        }
        double *row = values + (size_t)*done * (size_t)count;
        if (!prbm_values(engine, count, slots, row, message)) {
            return -1;
        }
        ++*done;
    }
    return engine->impacts.count;
}

EXPORTED bool prbm_state(Engine *engine, double *y, char *message) {
    Problem problem = {""};
    Simulation *sim = engine->simulation;
    bool ok = present_outputs(sim, PLACES, &problem) != NULL;
    if (ok) {
        copy(state_size(sim), sim->present.y, y);
    }
    return succeed(ok, &problem, message);
}

EXPORTED int prbm_section_count(const Engine *engine) {
    const System *system = system_of(engine->simulation);
    int count = 0;
    for (int i = 0; i < system->mechanism->flexure_count; i++) {
        count += has_stress(system->mechanism, i) ? system->free_bodies[i].sections : 0;
    }
    return count;
}

EXPORTED bool prbm_sections(Engine *engine, double *faces, char *message) {
    Problem problem = {""};
    Simulation *sim = engine->simulation;
    const System *system = system_of(sim);
    bool ok = present_outputs(sim, PLACES | MOTION, &problem) != NULL;
    if (ok) {
        Scratch scratch = sim->scratch;
        const Present *present = &sim->present;
        SectionState at = section_state(&sim->equations, present->e, present->y,
                                        present->y + system->n, &present->evaluation,
                                        &scratch);
        for (int i = 0; i < system->mechanism->flexure_count; i++) {
            const FreeBody *body = &system->free_bodies[i];
            if (has_stress(system->mechanism, i)) {
                face_stresses(system, body, &at, faces, faces + body->sections);
                faces += 2 * body->sections;
            }
        }
    }
    return succeed(ok, &problem, message);
}

EXPORTED double prbm_time(const Engine *engine) {
    return simulation_time(engine->simulation);
}

EXPORTED double prbm_steps(const Engine *engine) {
    return simulation_steps(engine->simulation);
}

EXPORTED int prbm_coordinates(const Engine *engine) {
    return engine->n;
}

/* --- drawings --------------------------------------------------------------------------------- */

EXPORTED int prbm_point_count(const Engine *engine) {
    const System *system = system_of(engine->simulation);
    return system->corner_count + 2 * system->b;
}

/* Write the point c + A e, and return the next address. */
static double *write_point(Complex c, int d, const Complex *A, const Complex *e, double *to) {
    for (int j = 0; j < d; j++) {
        c = plus(c, product(A[j], e[j]));
    }
    to[0] = c.re;
    to[1] = c.im;
    return to + 2;
}

EXPORTED void prbm_points(Engine *engine, const double *q, double *points) {
    Simulation *sim = engine->simulation;
    const System *system = system_of(sim);
    Scratch scratch = sim->scratch;
    int d = system->d;
    Complex *e = take_complex(&scratch, d, 1);
    directions(system, q, e);
    for (int i = 0; i < system->corner_count; i++) {
        points = write_point(system->corners_c[i], d, system->corners + i * d, e, points);
    }
    for (int i = 0; i < system->b; i++) {
        const BodyFrame *frame = &system->bodies[i];
        points = write_point(frame->c, d, frame->A, e, points);
        *points++ = e[frame->arm].re;
        *points++ = e[frame->arm].im;
    }
}

EXPORTED int prbm_mode_count(const Engine *engine) {
    return mode_count(system_of(engine->simulation));
}

EXPORTED int prbm_modes(Engine *engine, double *q, double *frequencies, double *shapes,
                        char *message) {
    Problem problem = {""};
    Simulation *sim = engine->simulation;
    const System *system = system_of(sim);
    Scratch scratch = sim->scratch;
    int n = system->n, count = prbm_mode_count(engine);
    Equilibrium shape = {q, take(&scratch, (size_t)system->r), 0.0};
    double *phi = take_matrix(&scratch, n, count);
    bool ok = equilibrium(system, false, 0.0, &shape, scratch, &problem) &&
              modes(system, &shape, frequencies, phi, scratch, &problem);
    for (int i = 0; ok && i < n * count; i++) {
        shapes[i % count * n + i / count] = phi[i];
    }
    return succeed(ok, &problem, message) ? count : -1;
}

/* --- saving and restoring --------------------------------------------------------------------- */

EXPORTED size_t prbm_saved_count(const Engine *engine) {
    return simulation_state_count(engine->simulation);
}

EXPORTED void prbm_save(const Engine *engine, double *numbers) {
    simulation_save(engine->simulation, numbers);
}

EXPORTED bool prbm_restore(Engine *engine, const double *numbers, char *message) {
    Problem problem = {""};
    return succeed(simulation_restore(engine->simulation, numbers, &problem), &problem, message);
}
