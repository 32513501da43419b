/* Steps of variable size: the twin of hybrid/stepping.py. */
#include <math.h>

#include "core/vectors.h"
#include "hybrid/access.h"
#include "hybrid/arc.h"
#include "hybrid/compliant.h"
#include "hybrid/errors.h"
#include "hybrid/events.h"
#include "hybrid/peaks.h"
#include "hybrid/stability.h"
#include "hybrid/stepping.h"
#include "hybrid/walls.h"

#define STEP_ERROR_EXPONENT (1.0 / (double)STEP_ORDER)
#define STEP_TREND_EXPONENT (STEP_ERROR_EXPONENT - STEP_TREND_FACTOR * STEP_MEMORY_EXPONENT)

/* --- step sizes ------------------------------------------------------------------------------- */

/* Choose the first step size by the size of the rates (Hairer, II.4). */
static double first_step(const Simulation *sim) {
    const State *state = &sim->state;
    double size = error_norm(sim, state->k1, state->front, state->front);
    double allowed = FIRST_STEP_FACTOR * power(state->tolerance, FIRST_STEP_EXPONENT);
    if (allowed >= size * longest_step(sim)) {
        return longest_step(sim);
    }
    return greater(allowed / size, FIRST_STEP_MIN_RTOL * sim->configuration.scales.time);
}

/* Choose the next step size from the error relative to the allowed error; return whether the step
 * is accepted.  The size does not grow after a step that was rejected and repeated (Hairer,
 * IV.2). */
static bool next(StepSizeController *controller, double error) {
    if (!(error <= 1.0)) {
        double factor = finite_number(error)
                            ? STEP_SAFETY_FACTOR * power(error, -STEP_ERROR_EXPONENT)
                            : STEP_SHRINK_MIN;
        controller->growth_max = 1.0;
        controller->h = rounded_step(controller->h * greater(STEP_SHRINK_MIN, factor));
        return false;
    }
    double log_of_error = natural_log(greater(error, STEP_ERROR_MIN));
    double trend =
        STEP_MEMORY_EXPONENT * controller->log_of_error - STEP_TREND_EXPONENT * log_of_error;
    double growth = lesser(controller->growth_max, STEP_SAFETY_FACTOR * exponential(trend));
    controller->h = rounded_step(controller->h * greater(STEP_SHRINK_MIN, growth));
    controller->log_of_error = log_of_error;
    return true;
}

static bool check_step_size(const Simulation *sim, double h, Problem *problem) {
    const State *state = &sim->state;
    double t = state->front_time, period = sim->configuration.scales.time;
    if (t + h != t && !(h < STEP_MIN_RTOL * period)) {
        return true;
    }
    bool late = spacing(t) > LATE_TIME_RTOL * period;
    if (!late) {
        return fail(problem,
                    "the step size fell to %.3g s at t = %.9g s: the motion is too fast for the "
                    "model, or links of a loop form a straight line, beyond which they cannot "
                    "move; check the inputs and parameters, or add damping.beta",
                    h, t);
    }
    if (t + h == t) {
        return fail(problem,
                    "at t = %.9g s a step of %.3g s is smaller than the rounding error of the "
                    "time: start the simulation at a time nearer to zero",
                    state->front_time, h);
    }
    return true;
}

/* Return the error of a step of the arc, relative to the allowed error; infinite if a stage fails.
 * The differences from solutions of orders 5 and 3 give an estimate that falls with the 8th power
 * of h (Hairer, II.10), as the error of the solution of order 7 does. */
static double step_error(Simulation *sim, double h, Problem *problem) {
    Stepping *stepping = &sim->stepping;
    const Arc *arc = &sim->state.arc;
    int ny = state_size(sim);
    if (!stages(&sim->equations, sim->state.front_time, ny, arc->y, h, arc->k, stepping->end,
                &stepping->reference, &stepping->evaluation, &stepping->forces, problem)) {
        return HUGE_VAL;
    }
    errors_of(ny, arc->k, h, stepping->error, stepping->coarse_error);
    double fine = error_norm(sim, stepping->error, arc->y, stepping->end);
    double coarse = error_norm(sim, stepping->coarse_error, arc->y, stepping->end);
    double size = square_root(fine * fine + coarse * coarse);
    double error = size > 0.0 ? fine * fine / size : size;
    if (sim->equations.pressed_count > 0) {
        error = greater(error, contact_error(sim, h) / CONTACT_ERROR_FACTOR);
    }
    return error / (STEP_ERROR_FACTOR * sim->state.tolerance);
}

/* Compute a step and project its end, which becomes the front.  Return the error relative to the
 * allowed error; infinite if a stage or the projection fails. */
static double projected_error(Simulation *sim, double h, Problem *problem) {
    State *state = &sim->state;
    Stepping *stepping = &sim->stepping;
    double error = step_error(sim, h, problem);
    if (!(error <= 1.0)) {
        return error;
    }
    copy(state_size(sim), stepping->end, state->front);
    double end = state->front_time + h;
    bool closed = project_near(&sim->equations, &stepping->evaluation, &stepping->reference, end,
                               state->front, &sim->correction, sim->scratch, problem) &&
                  check_projection(sim, end, stepping->end, state->front, sim->scratch, problem);
    return closed ? error : HUGE_VAL;
}

/* Store the start of the latest step for interpolations in the next one, if the motion is smooth
 * from there. */
static void remember_start(State *state, int n) {
    Node *before = &state->arc.before;
    bool smooth = state->arc.valid && state->has_k1;
    before->time = smooth ? state->arc.start : state->front_time;
    if (smooth) {
        copy(2 * n, state->arc.y, before->y);
        copy(n, state->arc.k + n, before->a);
    }
}

/* Compute a step within the tolerance and no longer than longest [s].  Its stages are stored in the
 * arc, its projected end in the front. */
static bool find_step(Simulation *sim, double longest, double *h, Problem *problem) {
    State *state = &sim->state;
    int ny = state_size(sim);
    double wanted = state->step_size > 0.0 ? state->step_size : first_step(sim);
    wanted = rounded_step(lesser(wanted, lesser(longest_step(sim), stable_step(sim))));
    StepSizeController controller = {lesser(wanted, longest), state->log_of_error, STEP_GROWTH_MAX};
    remember_start(state, system_of(sim)->n);
    copy(ny, state->front, state->arc.y);
    copy(ny, state->k1, state->arc.k);
    do {
        *h = controller.h;
        if (!check_step_size(sim, *h, problem)) {
            return false;
        }
    } while (!next(&controller, projected_error(sim, *h, problem)));
    state->step_size = controller.h;
    if (*h == longest && longest < wanted) { /* A wall shortened this step only. */
        state->step_size = greater(controller.h, wanted);
    }
    state->log_of_error = controller.log_of_error;
    if (state->front_time - state->arc.before.time < NODE_RATIO_MIN * *h) {
        state->arc.before.time = state->front_time;
    }
    return true;
}

/* --- steps ------------------------------------------------------------------------------------ */

/* Project the end of a step, which is the front. */
static bool project_end(Simulation *sim, Problem *problem) {
    State *state = &sim->state;
    double *y = sim->stepping.end;
    copy(state_size(sim), state->front, y);
    return project(&sim->equations, state->front_time, state->front, sim->scratch, problem) &&
           check_projection(sim, state->front_time, y, state->front, sim->scratch, problem);
}

PRBM bool end_step(Simulation *sim, double t, Problem *problem) {
    State *state = &sim->state;
    state->front_time = t;
    if (t <= state->arc.start) {
        copy(state_size(sim), state->arc.y, state->front);
        return true;
    }
    state->arc.h = t - state->arc.start;
    forget_arc(sim);
    return arc_cut(sim, t, state->arc.k, state->front, problem) && project_end(sim, problem);
}

/* End the step at a time of its dense output. */
static bool end_on_arc(Simulation *sim, double t, Problem *problem) {
    sim->state.front_time = t;
    arc_at(sim, t, sim->state.front);
    return project_end(sim, problem);
}

/* End the step at an event.  A reversal is delayed where the links of a loop form a straight line,
 * because the motion is not unique there. */
static bool cut_step(Simulation *sim, const Event *event, Problem *problem) {
    State *state = &sim->state;
    state->step_size = state->arc.h; /* The event does not shorten the next step. */
    state->pending = *event;
    state->has_k1 = false;
    bool closing = event->kind == EVENT_IMPACT || event->kind == EVENT_SEPARATION ||
                   event->kind == EVENT_ACTION;
    if (closing && event->time > state->arc.start) {
        Located *located = &sim->stepping.located;
        if (located->stop != event->contact) {
            located->h = event->time - state->arc.start;
            if (!arc_cut(sim, event->time, located->k, state->front, problem)) {
                return false;
            }
        }
        copy(STAGES * state_size(sim), located->k, state->arc.k);
        state->arc.h = located->h;
    }
    if (end_on_arc(sim, event->time, problem)) {
        return true;
    }
    state->pending.time += REVERSAL_DELAY_RTOL * state->arc.h;
    return event->kind == EVENT_REVERSAL && end_on_arc(sim, state->pending.time, problem);
}

/* End the step where the first calm contact passes its balance, if there is one. */
static bool end_at_balance(Simulation *sim, const double *balances, bool *found,
                           Problem *problem) {
    State *state = &sim->state;
    double first = HUGE_VAL;
    for (int i = 0; i < system_of(sim)->s; i++) {
        Fall fall = {false, 0.0};
        if (balances[i] > 0.0 && !balance_time(sim, i, balances[i], &fall, problem)) {
            return false;
        }
        first = fall.found ? lesser(first, fall.time) : first;
    }
    *found = first < HUGE_VAL;
    if (!*found) {
        return true;
    }
    state->step_size = state->arc.h; /* The balance does not shorten the next step. */
    state->has_k1 = false;
    return end_on_arc(sim, first, problem) && step_peaks_to_event(sim, problem);
}

/* Take one step from the front, up to its first event. */
PRBM bool take_step(Simulation *sim, Problem *problem) {
    State *state = &sim->state;
    Stepping *stepping = &sim->stepping;
    int ny = state_size(sim);
    double h = 0.0, longest = sim->equations.walls_move ? follow_cubics(sim) : HUGE_VAL;
    double balances[STOPS_MAX];
    bool pressed = sim->equations.pressed_count > 0, ended = false;
    if (pressed && !freeze_calm(sim, balances, problem)) {
        return false;
    }
    if (!state->has_k1) {
        if (!rate(&sim->equations, state->front_time, state->front, NULL, &stepping->evaluation,
                  state->k1, problem)) {
            return false;
        }
        restart_peaks_from(sim, &stepping->evaluation);
    }
    sim->steps += 1.0;
    if (!find_step(sim, longest, &h, problem)) {
        return false;
    }
    double start = state->front_time, end = start + h;
    state->arc.start = start;
    state->arc.h = h;
    forget_arc(sim);
    stepping->located.stop = -1;
    state->pending.kind = EVENT_NONE;
    if (h > STABLE_STEP_WATCH_FACTOR * stable_step(sim)) {
        refine_fastest(sim);
    }
    Event event;
    if (!first_event(sim, &event, problem)) {
        return false;
    }
    state->arc.valid = true;
    if (event.kind != EVENT_NONE) {
        return cut_step(sim, &event, problem) && step_peaks_to_event(sim, problem);
    }
    if (pressed && !end_at_balance(sim, balances, &ended, problem)) {
        return false;
    }
    if (ended) {
        return true;
    }
    state->front_time = end;
    step_peaks(sim, &stepping->evaluation);
    state->has_k1 = true;
    copy(ny, state->arc.k + (STAGES - 1) * ny, state->k1);
    return true;
}
