/* Motion of the walls between and at communication points: the twin of hybrid/walls.py. */
#include <math.h>
#include <string.h>

#include "hybrid/hybrid.h"

PRBM double given_velocity(const Simulation *sim, int i) {
    return wall_inputs(sim->configuration.mechanism, sim->state.given, i)[1];
}

PRBM double *acting_velocity(const Simulation *sim, int i) {
    return sim->state.acting_given + sim->configuration.mechanism->input.walls + PER_WALL * i + 1;
}

/* The position that the inputs prescribe now. */
PRBM double wall_target(const Simulation *sim, int i) {
    const Mechanism *m = sim->configuration.mechanism;
    const double *wall = wall_inputs(m, sim->state.given, i);
    return evaluate(m->stops[i].position, sim->state.values) + wall[0];
}

/* Put all walls where the inputs prescribe, at rest or with the velocities of the inputs. */
PRBM void place_walls(Simulation *sim, bool moving) {
    for (int i = 0; i < system_of(sim)->s; i++) {
        Wall wall = {wall_target(sim, i), moving ? given_velocity(sim, i) : 0.0,
                     moving ? sim->state.time : 0.0};
        sim->state.walls[i] = wall;
    }
}

/* Whether a wall is given another velocity than the acting one, beyond what its stop counts as
 * rest. */
static bool velocity_changed(const Simulation *sim, int i, double acting) {
    double velocity = given_velocity(sim, i);
    double least = stop_field(sim, sim->configuration.mechanism->stops[i].rest_speed);
    return velocity != acting && fabs(velocity - sim->state.walls[i].rate) >= least;
}

/* --- communication steps ---------------------------------------------------------------------- */

/* Whether a time is within a communication step that an event or the importer has interrupted. */
PRBM bool within_step(const Simulation *sim, double time) {
    const State *state = &sim->state;
    double rounding = TIME_SUM_RTOL * (fabs(time) + fabs(state->time));
    return (state->walls_continue || state->interrupted) && time <= state->step_end + rounding;
}

/* The time at which the walls complete their planned motions: as long as the last step took. */
PRBM double due_walls(const Simulation *sim) {
    return greater(sim->state.due, 2.0 * sim->state.time - sim->state.planned);
}

/* The rate of a wall in a step.  It reaches the prescribed position within the step.  A wall that
 * has been given a velocity does not hurry in a step that is shorter than the one before: its
 * rate is limited to that of the longer step, to the change of its velocity or to half of
 * rest_speed. */
static double wall_rate(const Simulation *sim, int i, double time) {
    double now = sim->state.time, due = due_walls(sim), velocity = given_velocity(sim, i);
    double off = wall_target(sim, i) - wall_at(&sim->state.walls[i], now);
    double correction = off / (time - now);
    if ((velocity != 0.0 || sim->state.swift[i]) && due > time) {
        const Stop *stop = &sim->configuration.mechanism->stops[i];
        double rest_speed = evaluate(stop->rest_speed, sim->state.values);
        double most = greater(fabs(off) / (due - now), fabs(velocity - *acting_velocity(sim, i)));
        most = greater(most, 0.5 * rest_speed);
        correction = lesser(greater(correction, -most), most);
    }
    return velocity + correction;
}

/* Plan uniform motions of the walls up to a time; returns whether one changes.  In the rest of a
 * step after an event a wall continues unless its velocity has changed. */
PRBM bool plan_walls(const Simulation *sim, double time, Wall *planned) {
    bool changed = false, rest = within_step(sim, time);
    double now = sim->state.time, span = time - now;
    for (int i = 0; i < system_of(sim)->s; i++) {
        const Wall *wall = &sim->state.walls[i];
        double here = wall_at(wall, now);
        double rate = rest ? given_velocity(sim, i) : wall_rate(sim, i, time);
        double off = fabs(wall_at(wall, time) - here - rate * span);
        bool other = rest ? velocity_changed(sim, i, *acting_velocity(sim, i))
                          : off > WALL_PATH_RTOL * system_of(sim)->length;
        planned[i] = *wall;
        if (other) {
            Wall next = {here, rate, now};
            planned[i] = next;
            changed = true;
        }
    }
    return changed;
}

/* --- events ----------------------------------------------------------------------------------- */

/* The change of a wall's velocity by an impulse, until the next plan. */
PRBM void push_wall(Simulation *sim, int i, double P) {
    Wall *wall = &sim->state.walls[i];
    double change = sim->equations.inputs.mobilities[i] * P, t = sim->state.front_time;
    if (change != 0.0) {
        Wall pushed = {wall_at(wall, t), wall->rate + change, t};
        *wall = pushed;
    }
}

/* Inputs that are set while an event is pending act in it: a wall hits with the velocity that it
 * has there, not with its mean over the communication step.  If the closing speed is below
 * rest_speed, the wall keeps its mean velocity, and the body rests on it.  The velocity of a wall
 * that carries a closed stop changes after the event, as at the start of any step.  acted: acting
 * velocities. */
PRBM void walls_at_event(Simulation *sim, double *acted) {
    size_t mark = sim->scratch.used;
    const System *system = system_of(sim);
    const double *front = sim->state.front;
    double t = sim->state.time;
    Complex *e = directions_at(sim, front);
    for (int i = 0; i < system->s; i++) {
        double speed = -gap_rate(&sim->equations, i, e, front + system->n);
        double distance = gap(&sim->equations, i, t, e);
        bool hits = distance <= TOUCHING_RTOL * system->length &&
                    speed >= stop_field(sim, sim->configuration.mechanism->stops[i].rest_speed);
        if (watched(&sim->equations, EVENT_IMPACT, i) &&
            (hits || velocity_changed(sim, i, acted[i]))) {
            Wall wall = {wall_at(&sim->state.walls[i], t), given_velocity(sim, i), t};
            if (acted[i] != wall.rate) {
                sim->state.walls[i] = wall;
            }
            acted[i] = wall.rate;
        }
    }
    sim->scratch.used = mark;
}

/* Reject a penetrated wall at the start, and begin with the impact if one is hit at once. */
PRBM bool check_walls(Simulation *sim, Problem *problem) {
    size_t mark = sim->scratch.used;
    int n = system_of(sim)->n, struck = -1;
    const double *front = sim->state.front;
    Complex *e = directions_at(sim, front);
    for (int i = 0; i < system_of(sim)->s; i++) {
        double distance = gap(&sim->equations, i, sim->state.front_time, e);
        if (distance < -RELEASE_PENETRATION_ATOL) {
            double wall = sim->state.walls[i].position;
            const char *name = sim->configuration.mechanism->stops[i].name;
            return fail(problem,
                        "the wall %s is penetrated by %.6g m at release: %s.position = %.6g m, "
                        "the hit point is at %.6g m; move the stop or release further back",
                        name, -distance, name, wall, wall - distance);
        }
        if (struck < 0 && distance <= RELEASE_PENETRATION_ATOL &&
            gap_rate(&sim->equations, i, e, front + n) < 0.0) {
            struck = i;
        }
    }
    sim->scratch.used = mark;
    return struck < 0 || impact(sim, struck, problem);
}

/* Open the closed stops whose gaps change, by a wall's velocity or an impulse: a wall that retreats
 * leaves the body; one that advances strikes, as does a body that is thrown against a wall that it
 * touches.  Returns a stop that is struck, or -1. */
static int release_moving(Simulation *sim) {
    size_t mark = sim->scratch.used;
    const System *system = system_of(sim);
    int struck = -1;
    double gaps[STOPS_MAX], rates[STOPS_MAX], bound = zero_speed(&sim->configuration);
    Complex *e = directions_at(sim, sim->state.front);
    for (int i = 0; i < system->s; i++) {
        gaps[i] = gap(&sim->equations, i, sim->state.time, e);
        rates[i] = gap_rate(&sim->equations, i, e, sim->state.front + system->n);
    }
    sim->scratch.used = mark;
    for (int i = 0; i < system->s; i++) {
        bool closed = sim->state.modes[i] != CONTACT_OPEN;
        if (closed && fabs(rates[i]) > bound) {
            set_mode(sim, i, CONTACT_OPEN);
        } else if (closed || gaps[i] > TOUCHING_RTOL * system->length) {
            continue;
        }
        struck = rates[i] < -bound ? i : struck;
    }
    return struck;
}

/* The contact state after changes of wall velocities or impulses. */
PRBM bool settle_walls(Simulation *sim, Problem *problem) {
    int struck = release_moving(sim);
    if (struck >= 0) {
        return impact(sim, struck, problem);
    }
    return project(&sim->equations, sim->state.time, sim->state.front, &sim->scratch, problem) &&
           settle(sim, NULL, 0, NULL, problem);
}
