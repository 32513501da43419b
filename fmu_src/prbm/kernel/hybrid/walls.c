/* Moving walls: the twin of hybrid/walls.py. */
#include <math.h>
#include <string.h>

#include "hybrid/configuration.h"
#include "hybrid/contact_modes.h"
#include "hybrid/impacts.h"
#include "hybrid/simulation.h"
#include "hybrid/walls.h"

/* Displacement and velocity of a wall, as they were given. */
static const double *told(const Simulation *sim, int i) {
    return wall_inputs(sim->configuration.mechanism, sim->state.given, i);
}

/* Put all walls on their references, with the velocities of these. */
PRBM void start_walls(Simulation *sim) {
    State *state = &sim->state;
    for (int i = 0; i < system_of(sim)->s; i++) {
        const double *d = told(sim, i), v = d[1];
        double drawn = evaluate(sim->configuration.mechanism->stops[i].position, state->values);
        Wall wall = {drawn + d[0], v, state->time, 0.0, 0.0, 0.0};
        state->walls[i] = wall;
        state->displacements[i] = d[0];
        state->driven[i] = v != 0.0;
    }
}

/* Whether stop.velocity has been set to another value since it acted. */
PRBM bool new_velocity(const Simulation *sim, int i) {
    return told(sim, i)[1] != wall_inputs(sim->configuration.mechanism, sim->state.acting_given, i)[1];
}

/* A wall in event mode: it takes the velocity that has been set, and so does its reference. */
PRBM Wall wall_at_event(const Simulation *sim, int i) {
    const Wall *wall = &sim->state.walls[i];
    double t = sim->state.time, r = wall->position + wall->rate * (t - wall->since);
    Wall next = {r, told(sim, i)[1], t, wall_motion(wall, t).x - r, 0.0, wall->span};
    return new_velocity(sim, i) ? next : *wall;
}

/* Whether the inputs of the walls are those of the last communication point. */
PRBM bool same_walls(const Simulation *sim) {
    bool same = true;
    for (int i = 0; i < system_of(sim)->s; i++) {
        same = same && told(sim, i)[0] == sim->state.displacements[i] &&
               !new_velocity(sim, i);
    }
    return same;
}

/* The velocity of a reference whose displacement has changed in the last step: the mean over the
 * recent longest step.  In a step that is longer the reference goes less far than that. */
static double difference_quotient(double velocity, double change, double last, double longest,
                                  double following) {
    double share = lesser(last / longest, 1.0), most = greater(longest, last) / following;
    velocity += share > 0.0 ? share * (change / last - velocity) : 0.0;
    return velocity * (most < 1.0 ? most * most : 1.0);
}

/* The walls from a communication point on, to which a step to a time follows; returns whether a
 * reference has changed.  Before any step the velocity of a wall is that of its reference. */
PRBM bool join_walls(Simulation *sim, double time, Wall *joined) {
    State *state = &sim->state;
    double now = state->time, last = now - state->point, following = time - now;
    double longest = greater(last > 0.0 ? last : following,
                             state->longest - WALL_FADING_FACTOR * last);
    longest = lesser(longest, WALL_LONGEST_RTOL * sim->configuration.scales.time);
    bool changed = false;
    for (int i = 0; i < system_of(sim)->s; i++) {
        const Wall *wall = &state->walls[i];
        const double *d = told(sim, i);
        double v = d[1], T = 2.0 * longest;
        double r = evaluate(sim->configuration.mechanism->stops[i].position, state->values) + d[0];
        double due = wall->position + wall->rate * (now - wall->since);
        state->driven[i] = state->driven[i] || v != 0.0;
        if (!state->driven[i]) {
            double change = d[0] - state->displacements[i];
            v = difference_quotient(wall->rate, change, last, longest, following);
        }
        joined[i] = *wall;
        if (fabs(r - due) + fabs(v - wall->rate) * T > WALL_PATH_RTOL * system_of(sim)->length) {
            WallMotion here = wall_motion(wall, now);
            Wall next = {r, v, now, here.x - r, last > 0.0 ? here.v - v : 0.0, T};
            joined[i] = next;
            changed = true;
        }
        state->displacements[i] = d[0];
    }
    state->point = now;
    state->longest = longest;
    return changed;
}

/* The jump of a wall's velocity with which a stop that holds keeps holding. */
PRBM double jump_allowed(const Simulation *sim, int i) {
    const Stop *stop = &sim->configuration.mechanism->stops[i];
    return greater(stop_field(sim, stop->rest_speed),
                   REST_SPEED_MIN_FACTOR * zero_speed(&sim->configuration));
}

/* A wall after a change of its velocity and that of its reference. */
PRBM Wall pushed_wall(const Wall *wall, double t, double change) {
    double r = wall->position + wall->rate * (t - wall->since);
    WallMotion here = wall_motion(wall, t);
    Wall pushed = {r, wall->rate + change, t, here.x - r, here.v - wall->rate, wall->span};
    return change != 0.0 ? pushed : *wall;
}

/* How far a wall may move in a step. */
PRBM double wall_reach(const Wall *wall, double h) {
    return fabs(wall->rate) * h + 2.0 * fabs(wall->offset) + fabs(wall->excess) * wall->span;
}

/* The longest step from the front: a fraction of a cubic, and none beyond its end. */
PRBM double longest_wall_step(const Simulation *sim) {
    double result = HUGE_VAL;
    for (int i = 0; i < system_of(sim)->s; i++) {
        const Wall *wall = &sim->state.walls[i];
        if (wall->span > 0.0) {
            double left = wall->since + wall->span - sim->state.front_time;
            result = lesser(result, lesser(WALL_STEP_RTOL * wall->span, left));
        }
    }
    return result;
}

/* Replace the walls whose cubics end at the front by their references. */
PRBM void arrive_walls(Simulation *sim) {
    bool arrived = false;
    for (int i = 0; i < system_of(sim)->s; i++) {
        Wall *wall = &sim->state.walls[i];
        double left = wall->since + wall->span - sim->state.front_time;
        if (wall->span > 0.0 && left <= EVENT_TIME_ATOL) {
            wall->offset = wall->excess = wall->span = 0.0;
            arrived = true;
        }
    }
    if (arrived) {
        sim->state.has_k1 = false;
        set_inputs(sim);
    }
}

/* Keep held stops on walls whose velocities have jumped by less than rest_speed; others open or are
 * struck.  The impulses P = -x on the stops are booked as captures.  They may pull, but no more
 * than the present forces press within a time. */
PRBM bool follow_walls(Simulation *sim, bool drifted, double time, Problem *problem) {
    size_t mark = sim->scratch.used;
    const Equations *q = &sim->equations;
    Evaluation *at = &sim->at_front;
    int n = system_of(sim)->n, size = n + q->r, h = q->first_hold;
    double *y = sim->state.front, t = sim->state.front_time, lost = 0.0, work = 0.0;
    double *kkt = take_matrix(&sim->scratch, size, size), *x = take(&sim->scratch, (size_t)size);
    double *rows = take_matrix(&sim->scratch, q->r, n);
    Inertia inertia = inertia_at(sim, y);
    bool moved = drifted, follows = true, right = true;
    jacobian(&q->active, inertia.e, rows);
    saddle(n, q->r, inertia.M, rows, rows, kkt);
    zeros(n, x);
    for (int k = 0; k < q->r; k++) {
        x[n + k] = -(dot(n, rows + k * n, y + n) + prescribed(q, k, t));
        bool holds = k >= h && k < q->first_stick;
        moved = moved || (holds && fabs(x[n + k]) > zero_speed(&sim->configuration));
        follows = follows && !(holds && fabs(x[n + k]) > jump_allowed(sim, q->held[k - h]));
    }
    if (moved && follows) {
        right = evaluate_equations(q, t, y, y + n, NULL, at, problem) &&
                solve(size, kkt, x, &sim->scratch, problem);
        for (int k = h; right && k < q->first_stick; k++) {
            double w = wall_motion(&sim->state.walls[q->held[k - h]], t).v, P = -x[n + k];
            lost -= P * (dot(n, rows + k * n, y + n) + w) / 2;
            work -= P * w;
            bool still = fabs(dot(n, rows + k * n, y + n) + w) <= zero_speed(&sim->configuration);
            follows = follows && (still || P >= -greater(at->lam[k], 0.0) * time);
        }
    }
    if (right && moved && follows) {
        add_scaled(n, 1.0, x, y + n);
        y[2 * n] += lost;
        y[2 * n + 1] += work;
    }
    sim->scratch.used = mark;
    return right && (!moved || (follows ? project(q, t, y, &sim->scratch, problem)
                                        : settle_moved(sim, problem)));
}
