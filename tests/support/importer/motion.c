/* Advance an instance between communication points and record its variables. */
#include "importer.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { STAGES = 4, UPDATES = 100 };

static const double EVENT_TIME_ATOL = 1e-13; /* s: width of the interval around an event */

/* --- rows --- */

bool rows_add(Rows *rows, Instance *instance, char mark, double time) {
    const Job *job = instance->job;
    rows->width = 2 + job->record_count;
    if (rows->count == rows->room) {
        size_t room = 2 * rows->room + 64;
        double *larger = realloc(rows->numbers, room * rows->width * sizeof *larger);
        if (!larger) {
            return false;
        }
        rows->numbers = larger;
        rows->room = room;
    }
    double *row = rows->numbers + rows->width * rows->count++;
    row[0] = mark;
    row[1] = time;
    for (size_t i = 0; i < job->record_count; i++) {
        if (!instance_get(instance, job->records + i, row + 2 + i)) {
            return false;
        }
    }
    return true;
}

void rows_print(const Rows *rows) {
    for (size_t i = 0; i < rows->count; i++) {
        const double *row = rows->numbers + rows->width * i;
        putchar((int)row[0]);
        for (size_t j = 1; j < rows->width; j++) {
            uint64_t bits = number_to_bits(row[j]);
            printf(" %08lx%08lx", (unsigned long)(bits >> 32),
                   (unsigned long)(bits & 0xFFFFFFFFu));
        }
        putchar('\n');
    }
}

void rows_free(Rows *rows) {
    free(rows->numbers);
    memset(rows, 0, sizeof *rows);
}

/* --- events --- */

static bool update(Motion *motion) {
    Update result;
    for (int count = 0; count < UPDATES; count++) {
        if (!instance_update(motion->instance, &result)) {
            return false;
        }
        if (result.terminate) {
            fprintf(stderr, "importer: the FMU terminated the simulation\n");
            return false;
        }
        if (!result.again) {
            motion->next_event_defined = result.next_event_defined;
            motion->next_event = result.next_event;
            return true;
        }
    }
    fprintf(stderr, "importer: the discrete states still change after %d updates\n", UPDATES);
    return false;
}

static bool leave_event_mode(Motion *motion) {
    Instance *instance = motion->instance;
    if (!update(motion) || !instance_leave_event_mode(instance)) {
        return false;
    }
    return instance->job->kind != MODEL_EXCHANGE ||
           (instance_get_states(instance, motion->x) &&
            instance_indicators(instance, motion->z));
}

static bool handle_event(Motion *motion) {
    return rows_add(motion->rows, motion->instance, BEFORE_EVENT, motion->time) &&
           instance_event_mode(motion->instance) && leave_event_mode(motion) &&
           rows_add(motion->rows, motion->instance, AFTER_EVENT, motion->time);
}

/* Set the changes at a communication point, in event mode unless the kind is CO_SIMULATION. */
static bool apply_changes(Motion *motion) {
    Instance *instance = motion->instance;
    const Job *job = instance->job;
    bool any = false;
    for (size_t i = 0; i < job->change_count; i++) {
        if (job->changes[i].point != motion->point) {
            continue;
        }
        if (!any && job->kind != CO_SIMULATION && !instance_event_mode(instance)) {
            return false;
        }
        any = true;
        if (!instance_set(instance, job->changes + i)) {
            return false;
        }
    }
    return !any || job->kind == CO_SIMULATION || leave_event_mode(motion);
}

/* --- co-simulation --- */

static bool step_to(Motion *motion, double end) {
    while (motion->time < end) {
        bool event;
        double reached;
        if (!instance_step(motion->instance, motion->time, end - motion->time, &reached, &event)) {
            return false;
        }
        if (!event && reached < end) {
            fprintf(stderr, "importer: a step ended early without an event\n");
            return false;
        }
        motion->time = reached;
        if (event && !handle_event(motion)) {
            return false;
        }
    }
    return true;
}

/* --- model exchange --- */

static bool evaluate_at(Motion *motion, double time, const double *x) {
    return instance_set_time(motion->instance, time) && instance_set_states(motion->instance, x);
}

static bool slope(Motion *motion, int stage, double h, double fraction, const double *from) {
    size_t n = motion->instance->job->state_count;
    for (size_t i = 0; i < n; i++) {
        motion->work[i] = motion->x[i] + fraction * h * (from ? from[i] : 0.0);
    }
    return evaluate_at(motion, motion->time + fraction * h, motion->work) &&
           instance_derivatives(motion->instance, motion->k + (size_t)stage * n);
}

/* Make a step of the classical Runge-Kutta method.  The new states are in work and in the FMU. */
static bool runge_kutta(Motion *motion, double h) {
    size_t n = motion->instance->job->state_count;
    const double *k = motion->k;
    if (!slope(motion, 0, h, 0.0, NULL) || !slope(motion, 1, h, 0.5, k) ||
        !slope(motion, 2, h, 0.5, k + n) || !slope(motion, 3, h, 1.0, k + 2 * n)) {
        return false;
    }
    for (size_t i = 0; i < n; i++) {
        motion->work[i] =
            motion->x[i] + h / 6 * (k[i] + 2 * k[n + i] + 2 * k[2 * n + i] + k[3 * n + i]);
    }
    return evaluate_at(motion, motion->time + h, motion->work);
}

/* Find whether an indicator has changed its domain (z > 0 or z <= 0) since the step started. */
static bool crossed(Motion *motion, bool *yes) {
    const Job *job = motion->instance->job;
    double *now = motion->z + job->indicator_count;
    if (!instance_indicators(motion->instance, now)) {
        return false;
    }
    *yes = false;
    for (size_t i = 0; i < job->indicator_count; i++) {
        *yes = *yes || (now[i] > 0.0) != (motion->z[i] > 0.0);
    }
    return true;
}

/* Shorten a step in which an indicator crosses zero: it then ends just after the crossing. */
static bool locate(Motion *motion, double *h) {
    double before = 0.0, after = *h;
    bool yes;
    while (after - before > EVENT_TIME_ATOL && motion->time + after > motion->time) {
        double middle = before + 0.5 * (after - before);
        if (!runge_kutta(motion, middle) || !crossed(motion, &yes)) {
            return false;
        }
        *(yes ? &after : &before) = middle;
    }
    *h = after;
    return runge_kutta(motion, after);
}

static bool integrate_to(Motion *motion, double end) {
    const Job *job = motion->instance->job;
    while (motion->time < end) {
        bool timed = motion->next_event_defined && motion->next_event <= end;
        double until = timed ? motion->next_event : end, left = until - motion->time;
        double steps = ceil(left / job->substep * (1 - 1e-9));
        double h = steps > 1.0 ? left / steps : left;
        bool last = steps <= 1.0, event, asked;
        if (!runge_kutta(motion, h) || !crossed(motion, &event) ||
            (event && !locate(motion, &h))) {
            return false;
        }
        motion->time = last && !event ? until : motion->time + h;
        memcpy(motion->x, motion->work, job->state_count * sizeof *motion->x);
        if (!instance_set_time(motion->instance, motion->time) ||
            !instance_completed(motion->instance, &asked)) {
            return false;
        }
        if (event || asked || (timed && motion->time >= motion->next_event)) {
            if (!handle_event(motion)) {
                return false;
            }
        } else if (!instance_indicators(motion->instance, motion->z)) {
            return false;
        }
    }
    return true;
}

/* --- all kinds --- */

bool motion_open(Motion *motion, Instance *instance, Rows *rows) {
    size_t n = instance->job->state_count, m = instance->job->indicator_count;
    memset(motion, 0, sizeof *motion);
    motion->instance = instance;
    motion->rows = rows;
    double *block = calloc((STAGES + 2) * n + 2 * m + 1, sizeof *block);
    if (!block) {
        return false;
    }
    motion->x = block;
    motion->work = block + n;
    motion->k = block + 2 * n;
    motion->z = block + (STAGES + 2) * n;
    return true;
}

void motion_close(Motion *motion) {
    free(motion->x);
}

bool motion_start(Motion *motion) {
    Instance *instance = motion->instance;
    const Job *job = instance->job;
    if (!instance_initialize(instance)) {
        return false;
    }
    motion->time = job->start;
    motion->point = 0;
    if (job->kind != CO_SIMULATION && !leave_event_mode(motion)) {
        return false;
    }
    return rows_add(motion->rows, instance, AT_POINT, motion->time);
}

bool motion_continue(Motion *motion, size_t point) {
    const Job *job = motion->instance->job;
    for (; motion->point < point; motion->point++) {
        double end = job->points[motion->point];
        bool good = apply_changes(motion) && (job->kind == MODEL_EXCHANGE
                                                  ? integrate_to(motion, end)
                                                  : step_to(motion, end));
        if (!good || !rows_add(motion->rows, motion->instance, AT_POINT, motion->time)) {
            return false;
        }
    }
    return true;
}
