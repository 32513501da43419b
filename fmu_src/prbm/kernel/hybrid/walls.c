/* Moving walls: the twin of hybrid/walls.py. */
#include <math.h>

#include "hybrid/access.h"
#include "hybrid/configuration.h"
#include "hybrid/walls.h"

/* The reference that the inputs of a stop define at the present time.  In model exchange, where
 * walls follow no cubic, the excess is the change of the wall's velocity by impulses.  It remains
 * until stop.velocity is set. */
static Wall given_reference(const Simulation *sim, int i) {
    const Mechanism *m = sim->configuration.mechanism;
    const double *given = wall_inputs(m, sim->state.given, i);
    double position = evaluate(m->stops[i].position, sim->state.values) + given[0];
    double kick = sim->state.mode.exchange ? sim->state.walls[i].excess : 0.0;
    return (Wall){position, given[1] + kick, sim->state.time, 0.0, kick, 0.0};
}

PRBM void place_walls(Simulation *sim) {
    for (int i = 0; i < system_of(sim)->s; i++) {
        sim->state.walls[i] = given_reference(sim, i);
        sim->state.driven[i] = sim->state.walls[i].rate != 0.0;
    }
}

/* Push a wall by the impulse P on the body; returns the work of the wall.  The velocities of the
 * wall and of its reference change. */
PRBM double push_wall(Simulation *sim, int i, double P) {
    Wall *wall = &sim->state.walls[i];
    double t = sim->state.front_time, change = sim->equations.inputs.mobilities[i] * P;
    wall->position -= change * (t - wall->since);
    wall->rate += change;
    wall->excess += sim->state.mode.exchange ? change : 0.0;
    sim->state.latched[i].impulse_sum += P;
    return -P * (wall_motion(wall, t).v - change / 2);
}

/* Join the walls to their references in a communication step from the present time to another.
 *
 * Without stop.velocity, the velocity of a reference is the mean rate of the displacement over the
 * recent longest step; a change of stop.position gives it no velocity.  It is reduced if the
 * following step is longer, so that a jump is not extrapolated beyond its own size.  Before the
 * first step, the velocity of a wall is that of its reference.  A wall whose hit point moves by a
 * change of stop.offset joins its reference anew.  set: whether parameters have been set. */
PRBM void join_walls(Simulation *sim, double time, bool set, const Wall *present, Wall *joined) {
    State *state = &sim->state;
    double now = state->time, last = now - state->point, following = time - now;
    double H = pass_point(sim, time);
    double share = lesser(H / following, 1.0), least = WALL_PATH_RTOL * system_of(sim)->length;
    for (int i = 0; i < system_of(sim)->s; i++) {
        const Stop *stop = &sim->configuration.mechanism->stops[i];
        Wall wall = present[i], line = given_reference(sim, i);
        WallMotion here = wall_motion(&wall, now);
        double off = line.position - wall.position - wall.rate * (now - wall.since);
        double moved = off - (set ? field_change(sim, stop->position) : 0.0);
        state->driven[i] = state->driven[i] || line.rate != 0.0;
        double mean = (wall.rate + (last > 0.0 ? moved / H : 0.0)) * share * share;
        line.rate = state->driven[i] ? line.rate : mean;
        line.span = 2.0 * state->longest;
        line.offset = here.x - line.position;
        line.excess = last > 0.0 ? here.v - line.rate : 0.0;
        bool same = fabs(off) + fabs(line.rate - wall.rate) * line.span <= least;
        joined[i] = same && !(set && field_change(sim, stop->offset) != 0.0) ? wall : line;
    }
}

/* Let changed parameters act.  Walls that join their references take up the jumps of their gaps. */
PRBM bool keep_gaps(Simulation *sim, Wall *joined, Problem *problem) {
    double gaps[STOPS_MAX], rates[STOPS_MAX], after[STOPS_MAX], rates_after[STOPS_MAX];
    gaps_and_rates(sim, gaps, rates);
    bool ok = take_values(sim, problem);
    gaps_and_rates(sim, after, rates_after);
    for (int i = 0; i < system_of(sim)->s; i++) {
        joined[i].offset += gaps[i] - after[i];
        joined[i].excess += rates[i] - rates_after[i];
    }
    return ok;
}

/* Give walls whose stop.velocity has changed in event mode this velocity, in their places. */
PRBM void turn_walls(Simulation *sim) {
    for (int i = 0; i < system_of(sim)->s; i++) {
        Wall *wall = &sim->state.walls[i], line = given_reference(sim, i);
        double before = wall_inputs(sim->configuration.mechanism, sim->state.acting_given, i)[1];
        line.position = wall_motion(wall, line.since).x;
        *wall = line.rate == before ? *wall : line;
    }
}

/* Put walls whose cubics end at the front on their references.  Return the longest step from there:
 * a fraction of each other cubic, not beyond the end of that cubic. */
PRBM double follow_cubics(Simulation *sim) {
    double longest = HUGE_VAL;
    for (int i = 0; i < system_of(sim)->s; i++) {
        Wall *wall = &sim->state.walls[i];
        double left = wall->since + wall->span - sim->state.front_time;
        double round_off = EVENT_TIME_ULPS * spacing(sim->state.front_time);
        if (wall->span > 0.0 && left <= EVENT_TIME_RTOL * wall->span + round_off) {
            wall->offset = wall->excess = wall->span = 0.0;
            set_contacts(sim, sim->state.modes); /* The acceleration of the wall has changed. */
        }
        double most = lesser(WALL_STEP_RTOL * wall->span, left);
        longest = wall->span > 0.0 ? lesser(longest, most) : longest;
    }
    return longest;
}

/* The largest jump of a wall's velocity at which a held stop stays closed. */
PRBM double jump_allowed(const Simulation *sim, int i) {
    return greater(field_value(sim, sim->configuration.mechanism->stops[i].rest_speed),
                   REST_SPEED_MIN_FACTOR * zero_speed(&sim->configuration));
}
