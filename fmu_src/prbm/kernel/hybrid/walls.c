/* Moving walls: the twin of hybrid/walls.py. */
#include <math.h>

#include "hybrid/configuration.h"
#include "hybrid/contact_modes.h"
#include "hybrid/impacts.h"
#include "hybrid/simulation.h"
#include "hybrid/walls.h"

/* The reference that the inputs of a stop define at the present time. */
static Wall given_reference(const Simulation *sim, int i) {
    const Mechanism *m = sim->configuration.mechanism;
    const double *given = wall_inputs(m, sim->state.given, i);
    double position = evaluate(m->stops[i].position, sim->state.values) + given[0];
    Wall reference = {position, given[1], sim->state.time, 0.0, 0.0, 0.0};
    return reference;
}

/* Put all walls on their references, with the velocities of these. */
PRBM void start_walls(Simulation *sim) {
    for (int i = 0; i < system_of(sim)->s; i++) {
        sim->state.walls[i] = given_reference(sim, i);
        sim->state.driven[i] = sim->state.walls[i].rate != 0.0;
    }
}

/* The wall that joins another reference, from the time reference.since on. */
static Wall joining(const Wall *wall, Wall reference, double velocity, double span) {
    reference.offset = wall_motion(wall, reference.since).x - reference.position;
    reference.excess = velocity - reference.rate;
    reference.span = span;
    return reference;
}

/* The wall from a time t on, with new velocities of the wall and of its reference. */
PRBM Wall turned_wall(const Wall *wall, double t, double velocity, double rate) {
    Wall reference = {reference_at(wall, t), rate, t, 0.0, 0.0, 0.0};
    return joining(wall, reference, velocity, wall->span);
}

/* The change of stop.position at a communication point: a jump that gives the wall no velocity. */
static double shift(const Simulation *sim, int i) {
    Expression position = sim->configuration.mechanism->stops[i].position;
    return evaluate(position, sim->state.values) - evaluate(position, sim->state.acting_values);
}

/* The walls in a communication step from the present time to another; returns whether a reference
 * has changed.
 *
 * Without stop.velocity, the velocity of a reference is the mean rate of the displacement over the
 * recent longest step.  It is reduced if the following step is longer, so that a jump is not
 * extrapolated beyond its own size.  Before the first step, the velocity of a wall is that of its
 * reference. */
PRBM bool join_walls(Simulation *sim, double time, Wall *joined) {
    State *state = &sim->state;
    double now = state->time, last = now - state->point, following = time - now;
    double H = greater(last > 0.0 ? last : following, state->longest - WALL_FADING_FACTOR * last);
    double T = 2.0 * lesser(H, WALL_LONGEST_RTOL * sim->configuration.scales.time);
    double longest = greater(0.5 * T, last), share = lesser(longest / following, 1.0);
    bool changed = false;
    for (int i = 0; i < system_of(sim)->s; i++) {
        Wall *wall = &state->walls[i], line = given_reference(sim, i);
        double off = line.position - reference_at(wall, now);
        state->driven[i] = state->driven[i] || line.rate != 0.0;
        if (!state->driven[i]) {
            double moved = last > 0.0 && off != 0.0 ? off - shift(sim, i) : 0.0;
            line.rate = (wall->rate + moved / longest) * share * share;
        }
        bool same = fabs(off) + fabs(line.rate - wall->rate) * T <=
                    WALL_PATH_RTOL * system_of(sim)->length;
        double velocity = last > 0.0 ? wall_motion(wall, now).v : line.rate;
        joined[i] = same ? *wall : joining(wall, line, velocity, T);
        changed = changed || !same;
    }
    state->point = now;
    state->longest = 0.5 * T;
    return changed;
}

/* The walls in event mode: a wall whose stop.velocity has changed takes it, and so does its
 * reference.  Returns whether there is such a wall. */
PRBM bool turn_walls(const Simulation *sim, Wall *turned) {
    const Mechanism *m = sim->configuration.mechanism;
    const State *state = &sim->state;
    bool any = false;
    for (int i = 0; i < m->stop_count; i++) {
        double v = wall_inputs(m, state->given, i)[1];
        bool same = v == wall_inputs(m, state->acting_given, i)[1];
        turned[i] = same ? state->walls[i] : turned_wall(&state->walls[i], state->time, v, v);
        any = any || !same;
    }
    return any;
}

/* An upper bound of the distance that a wall moves in a step h. */
PRBM double wall_reach(const Wall *wall, double h) {
    return fabs(wall->rate) * h + 2.0 * fabs(wall->offset) + fabs(wall->excess) * wall->span;
}

/* Put walls whose cubics end at the front on their references; return the longest step from there:
 * a fraction of a cubic, and only up to its end. */
PRBM double follow_cubics(Simulation *sim) {
    double longest = HUGE_VAL;
    for (int i = 0; i < system_of(sim)->s; i++) {
        Wall *wall = &sim->state.walls[i];
        double end = wall->span > 0.0 ? wall->since + wall->span : HUGE_VAL;
        double left = end - sim->state.front_time;
        if (left <= EVENT_TIME_ATOL) {
            wall->offset = wall->excess = wall->span = 0.0;
            sim->state.has_k1 = false;
            set_inputs(sim);
        } else if (left < HUGE_VAL) {
            longest = lesser(longest, lesser(WALL_STEP_RTOL * wall->span, left));
        }
    }
    return longest;
}

/* The largest jump of a wall's velocity at which a held stop stays closed. */
PRBM double jump_allowed(const Simulation *sim, int i) {
    const Stop *stop = &sim->configuration.mechanism->stops[i];
    return greater(field_value(sim, stop->rest_speed),
                   REST_SPEED_MIN_FACTOR * zero_speed(&sim->configuration));
}

/* Keep held stops on walls whose velocities have jumped by less than rest_speed; otherwise the
 * stops open or are struck.  The impulses P on the held stops dissipate energy as captures do.
 * They may pull, but not more than the present forces press within the given time. */
PRBM bool follow_walls(Simulation *sim, bool drifted, double time, Problem *problem) {
    size_t mark = sim->scratch.used;
    const Equations *q = &sim->equations;
    Evaluation *at = &sim->at_front;
    int ny = state_size(sim), n = system_of(sim)->n;
    double *y = sim->state.front, t = sim->state.front_time;
    double *P = take(&sim->scratch, (size_t)q->r), *after = take(&sim->scratch, (size_t)ny);
    bool moved = drifted, follows = true;
    copy(ny, y, after);
    bool right = evaluate_equations(q, t, y, y + n, NULL, at, problem) &&
                 project_with_impulses(q, t, after, P, &sim->scratch, problem);
    for (int k = q->first_hold; right && k < q->first_stick; k++) {
        int i = q->held[k - q->first_hold];
        double speed = gap_rate(q, i, t, at->at.e, y + n);
        bool jumps = fabs(speed) > zero_speed(&sim->configuration);
        moved = moved || jumps;
        follows = follows && fabs(speed) <= jump_allowed(sim, i) &&
                  (!jumps || P[k] >= -greater(at->lam[k], 0.0) * time);
        after[2 * n] -= P[k] * speed / 2;
        after[2 * n + 1] -= P[k] * wall_motion(&q->inputs.walls[i], t).v;
    }
    if (right && moved && follows) {
        copy(ny, after, y);
    }
    sim->scratch.used = mark;
    return right && (!moved || follows || settle_moved(sim, problem));
}
