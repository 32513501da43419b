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
    return (Wall){position, given[1], sim->state.time, 0.0, 0.0, 0.0};
}

/* Put all walls on their references, with the velocities of these. */
PRBM void start_walls(Simulation *sim) {
    for (int i = 0; i < system_of(sim)->s; i++) {
        sim->state.walls[i] = given_reference(sim, i);
        sim->state.driven[i] = sim->state.walls[i].rate != 0.0;
    }
}

/* The wall with another velocity, joining another reference from the time line.since on. */
static Wall joining(const Wall *wall, Wall line, double velocity, double span) {
    double offset = wall_motion(wall, line.since).x - line.position;
    return (Wall){line.position, line.rate, line.since, offset, velocity - line.rate, span};
}

/* The wall from a time t on, with new velocities of the wall and of its reference. */
static Wall turned_wall(const Wall *wall, double t, double velocity, double rate) {
    Wall line = {reference_at(wall, t), rate, t, 0.0, 0.0, 0.0};
    return joining(wall, line, velocity, wall->span);
}

/* Push a wall by the impulse P on the body; returns the work of the wall. */
PRBM double push_wall(Simulation *sim, int i, double P) {
    Wall *wall = &sim->state.walls[i];
    double t = sim->state.front_time, change = sim->equations.inputs.mobilities[i] * P;
    double velocity = wall_motion(wall, t).v;
    *wall = change != 0.0 ? turned_wall(wall, t, velocity + change, wall->rate + change) : *wall;
    sim->state.latched[i].impulse_sum += P;
    return -P * (velocity + change / 2);
}

/* Join the walls to their references in a communication step from the present time to another;
 * returns whether a reference has changed.
 *
 * Without stop.velocity, the velocity of a reference is the mean rate of the displacement over the
 * recent longest step; a jump of stop.position gives it no velocity.  It is reduced if the following
 * step is longer, so that a jump is not extrapolated beyond its own size.  Before the first step,
 * the velocity of a wall is that of its reference. */
PRBM bool join_walls(Simulation *sim, double time) {
    State *state = &sim->state;
    double now = state->time, last = now - state->point, following = time - now;
    double H = greater(last > 0.0 ? last : following, state->longest - WALL_FADING_FACTOR * last);
    double T = 2.0 * lesser(H, WALL_LONGEST_RTOL * sim->configuration.scales.time);
    double longest = last > 0.0 ? greater(0.5 * T, last) : HUGE_VAL;
    double share = lesser(longest / following, 1.0);
    bool changed = false;
    for (int i = 0; i < system_of(sim)->s; i++) {
        Wall *wall = &state->walls[i], line = given_reference(sim, i);
        Expression at = sim->configuration.mechanism->stops[i].position;
        double off = line.position - reference_at(wall, now);
        state->driven[i] = state->driven[i] || line.rate != 0.0;
        if (!state->driven[i]) {
            double moved = off == 0.0 ? 0.0
                                      : off - evaluate(at, state->values) +
                                            evaluate(at, state->acting_values);
            line.rate = (wall->rate + moved / longest) * share * share;
        }
        if (fabs(off) + fabs(line.rate - wall->rate) * T > WALL_PATH_RTOL * system_of(sim)->length) {
            double velocity = last > 0.0 ? wall_motion(wall, now).v : line.rate;
            *wall = joining(wall, line, velocity, T);
            changed = true;
        }
    }
    state->point = now;
    state->longest = 0.5 * T;
    return changed;
}

/* Give walls whose stop.velocity has changed in event mode this velocity, and their references. */
PRBM void turn_walls(Simulation *sim) {
    for (int i = 0; i < system_of(sim)->s; i++) {
        double v = given_reference(sim, i).rate;
        if (v != wall_inputs(sim->configuration.mechanism, sim->state.acting_given, i)[1]) {
            sim->state.walls[i] = turned_wall(&sim->state.walls[i], sim->state.time, v, v);
        }
    }
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
        double left = wall->since + wall->span - sim->state.front_time;
        if (wall->span > 0.0 && left > EVENT_TIME_ATOL) {
            longest = lesser(longest, lesser(WALL_STEP_RTOL * wall->span, left));
        } else if (wall->span > 0.0) {
            wall->offset = wall->excess = wall->span = 0.0;
            sim->state.has_k1 = false;
            set_inputs(sim);
        }
    }
    return longest;
}

/* The largest jump of a wall's velocity at which a held stop stays closed. */
PRBM double jump_allowed(const Simulation *sim, int i) {
    double rest_speed = stop_field(sim, sim->configuration.mechanism->stops[i].rest_speed);
    return greater(rest_speed, REST_SPEED_MIN_FACTOR * zero_speed(&sim->configuration));
}

/* Keep held stops on walls whose velocities have jumped by less than rest_speed; otherwise the
 * stops open or are struck.  Impulses may pull, but not more than the present forces press within
 * the given time. */
PRBM bool follow_walls(Simulation *sim, bool drifted, double time, Problem *problem) {
    size_t mark = sim->scratch.used;
    const Equations *q = &sim->equations;
    Evaluation *at = &sim->at_front;
    int n = system_of(sim)->n, count = q->held_count;
    double *y = sim->state.front, t = sim->state.front_time, speed[STOPS_MAX];
    double *P = take(&sim->scratch, (size_t)q->r);
    double *after = take(&sim->scratch, (size_t)state_size(sim));
    bool moved = drifted, follows = true;
    copy(state_size(sim), y, after);
    bool right = evaluate_equations(q, t, y, y + n, NULL, at, problem) &&
                 project_with_impulses(q, t, after, P, &sim->scratch, problem);
    const double *held_P = P + q->first_hold, *force = at->lam + q->first_hold;
    for (int k = 0; right && k < count; k++) {
        speed[k] = gap_rate(q, q->held[k], t, at->at.e, y + n);
        bool jumps = fabs(speed[k]) > zero_speed(&sim->configuration);
        moved = moved || jumps;
        follows = follows && fabs(speed[k]) <= jump_allowed(sim, q->held[k]) &&
                  (!jumps || held_P[k] >= -greater(force[k], 0.0) * time);
    }
    for (int k = 0; right && moved && follows && k < count; k++) {
        after[2 * n] -= held_P[k] * speed[k] / 2;
        after[2 * n + 1] += push_wall(sim, q->held[k], held_P[k]);
    }
    copy(right && moved && follows ? state_size(sim) : 0, after, y);
    sim->scratch.used = mark;
    return right && (!moved || follows || settle_moved(sim, problem));
}
