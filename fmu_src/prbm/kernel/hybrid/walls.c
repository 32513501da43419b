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

/* Set the position and velocity of each wall to those of its reference. */
PRBM void start_walls(Simulation *sim) {
    for (int i = 0; i < system_of(sim)->s; i++) {
        sim->state.walls[i] = given_reference(sim, i);
        sim->state.driven[i] = sim->state.walls[i].rate != 0.0;
    }
}

/* Change the velocities of a wall and of its reference at a time t. */
static void turn_wall(Wall *wall, double t, double change) {
    wall->position -= change * (t - wall->since);
    wall->rate += change;
}

/* In model exchange, place the walls as their inputs define.  The changes of velocity by impulses,
 * which are the excess, remain until stop.velocity is set. */
PRBM void place_walls(Simulation *sim) {
    double kicks[STOPS_MAX];
    for (int i = 0; i < system_of(sim)->s; i++) {
        kicks[i] = sim->state.walls[i].excess;
    }
    start_walls(sim);
    for (int i = 0; i < system_of(sim)->s; i++) {
        sim->state.walls[i].rate += kicks[i];
        sim->state.walls[i].excess = kicks[i];
    }
}

/* Push a wall by the impulse P on the body; returns the work of the wall. */
PRBM double push_wall(Simulation *sim, int i, double P) {
    Wall *wall = &sim->state.walls[i];
    double t = sim->state.front_time, change = sim->equations.inputs.mobilities[i] * P;
    turn_wall(wall, t, change);
    if (sim->state.mode.exchange) {
        wall->excess += change;
    }
    sim->state.latched[i].impulse_sum += P;
    return -P * (wall_motion(wall, t).v - change / 2);
}

/* Join the walls to their references in a communication step from the present time to another;
 * returns whether a reference has changed.
 *
 * Without stop.velocity, the velocity of a reference is the mean rate of the displacement over the
 * recent longest step; a change of stop.position gives it no velocity.  It is reduced if the
 * following step is longer, so that a jump is not extrapolated beyond its own size.  Before the
 * first step, the velocity of a wall is that of its reference. */
PRBM bool join_walls(Simulation *sim, double time) {
    State *state = &sim->state;
    double now = state->time, last = now - state->point, following = time - now;
    double H = greater(last > 0.0 ? last : following, state->longest - WALL_FADING_FACTOR * last);
    state->longest = lesser(H, WALL_LONGEST_RTOL * sim->configuration.scales.time);
    state->point = now;
    double T = 2.0 * state->longest, share = lesser(H / following, 1.0);
    double least = WALL_PATH_RTOL * system_of(sim)->length;
    bool changed = false;
    for (int i = 0; i < system_of(sim)->s; i++) {
        Wall *wall = &state->walls[i], line = given_reference(sim, i);
        Expression at = sim->configuration.mechanism->stops[i].position;
        double off = line.position - wall->position - wall->rate * (now - wall->since);
        state->driven[i] = state->driven[i] || line.rate != 0.0;
        if (!state->driven[i]) {
            double shift = evaluate(at, state->values) - evaluate(at, state->acting_values);
            line.rate = (wall->rate + (last > 0.0 ? (off - shift) / H : 0.0)) * share * share;
        }
        if (fabs(off) + fabs(line.rate - wall->rate) * T > least) {
            WallMotion here = wall_motion(wall, now);
            line.offset = here.x - line.position;
            line.excess = last > 0.0 ? here.v - line.rate : 0.0;
            line.span = T;
            *wall = line;
            changed = true;
        }
    }
    return changed;
}

PRBM void gaps_and_rates(Simulation *sim, double *gaps, double *rates) {
    size_t mark = sim->scratch.used;
    const State *state = &sim->state;
    Complex *e = directions_at(sim, state->front);
    for (int i = 0; i < system_of(sim)->s; i++) {
        gaps[i] = gap(&sim->equations, i, state->time, e);
        rates[i] = gap_rate(&sim->equations, i, state->time, e, state->front + system_of(sim)->n);
    }
    sim->scratch.used = mark;
}

PRBM void keep_gaps(Simulation *sim, const double *gaps, const double *rates) {
    State *state = &sim->state;
    double now = state->time, after[STOPS_MAX], rates_after[STOPS_MAX];
    double longest = WALL_LONGEST_RTOL * sim->configuration.scales.time;
    double T = 2.0 * (state->longest > 0.0 ? state->longest : longest);
    double least = WALL_PATH_RTOL * system_of(sim)->length;
    gaps_and_rates(sim, after, rates_after);
    for (int i = 0; i < system_of(sim)->s; i++) {
        double jump = after[i] - gaps[i], turn = rates_after[i] - rates[i];
        if (fabs(jump) + fabs(turn) * T > least) {
            Wall *wall = &state->walls[i];
            WallMotion here = wall_motion(wall, now);
            wall->position += wall->rate * (now - wall->since);
            wall->since = now;
            wall->offset = here.x - jump - wall->position;
            wall->excess = here.v - turn - wall->rate;
            wall->span = T;
        }
    }
}

/* Give walls whose stop.velocity has changed in event mode this velocity. */
PRBM void turn_walls(Simulation *sim) {
    for (int i = 0; i < system_of(sim)->s; i++) {
        Wall *wall = &sim->state.walls[i], line = given_reference(sim, i);
        if (line.rate != wall_inputs(sim->configuration.mechanism, sim->state.acting_given, i)[1]) {
            turn_wall(wall, line.since, line.rate - wall_motion(wall, line.since).v);
        }
    }
}

/* Put walls whose cubics end at the front on their references.  Return the longest step from there:
 * a fraction of each other cubic, not beyond the end of that cubic. */
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
    return greater(field_value(sim, sim->configuration.mechanism->stops[i].rest_speed),
                   REST_SPEED_MIN_FACTOR * zero_speed(&sim->configuration));
}

/* Keep held stops on walls whose velocities have jumped by less than rest_speed; otherwise the
 * stops open or are struck.  Impulses may pull, but not more than the present forces press within
 * the given time. */
PRBM bool follow_walls(Simulation *sim, bool drifted, double time, Problem *problem) {
    size_t mark = sim->scratch.used;
    const Equations *q = &sim->equations;
    Evaluation *at = &sim->at_front;
    int n = system_of(sim)->n, ny = state_size(sim), h = q->first_hold;
    double *y = sim->state.front, t = sim->state.front_time, speed[STOPS_MAX];
    double *P = take(&sim->scratch, (size_t)q->r), *after = take(&sim->scratch, (size_t)ny);
    bool moved = drifted, follows = true;
    copy(ny, y, after);
    bool ok = evaluate_equations(q, t, y, y + n, NULL, at, problem) &&
              project_with_impulses(q, t, after, P, &sim->scratch, problem);
    for (int k = 0; ok && k < q->held_count; k++) {
        speed[k] = gap_rate(q, q->held[k], t, at->at.e, y + n);
        bool jumps = fabs(speed[k]) > zero_speed(&sim->configuration);
        moved = moved || jumps;
        follows = follows && fabs(speed[k]) <= jump_allowed(sim, q->held[k]) &&
                  (!jumps || P[h + k] >= -greater(at->lam[h + k], 0.0) * time);
    }
    bool captures = ok && moved && follows;
    for (int k = 0; captures && k < q->held_count; k++) {
        after[2 * n] -= P[h + k] * speed[k] / 2;
        after[2 * n + 1] += push_wall(sim, q->held[k], P[h + k]);
    }
    copy(captures ? ny : 0, after, y);
    sim->scratch.used = mark;
    return ok && (!moved || follows || settle_moved(sim, problem));
}
