/* Contacts after the walls or the velocities have changed. */
#include <math.h>

#include "hybrid/access.h"
#include "hybrid/configuration.h"
#include "hybrid/contact_modes.h"
#include "hybrid/impacts.h"
#include "hybrid/moved.h"
#include "hybrid/phases.h"
#include "hybrid/walls.h"

/* Open the closed stops whose gaps have a rate after a change of a wall's velocity or an impulse.
 * Return a stop that is struck, or -1: a stop whose body touches the wall and moves towards it. */
static int release_moving(Simulation *sim) {
    const System *system = system_of(sim);
    int struck = -1;
    double gaps[STOPS_MAX], rates[STOPS_MAX], bound = zero_speed(&sim->configuration);
    gaps_and_rates(sim, gaps, rates);
    for (int i = 0; i < system->s; i++) {
        bool closed = held_stop(&sim->equations, i);
        bool compliant = system->mechanism->stops[i].compliant;
        if (closed && fabs(rates[i]) > bound) {
            set_mode(sim, i, CONTACT_OPEN);
            (void)press_released(sim);
        } else if (compliant || closed || gaps[i] > TOUCHING_RTOL * system->length) {
            continue;
        }
        struck = rates[i] < -bound && !compliant ? i : struck;
    }
    return struck;
}

/* Choose the contact state after changes of the walls' velocities or impulses. */
PRBM bool choose_moved_modes(Simulation *sim, Problem *problem) {
    int struck = release_moving(sim);
    if (!rephase(sim, problem)) {
        return false;
    }
    if (struck >= 0) {
        return impact(sim, struck, problem);
    }
    return project(&sim->equations, sim->state.time, sim->state.front, sim->scratch, problem) &&
           choose_modes(sim, NULL, 0, NULL, problem);
}

/* Keep held stops on walls whose velocities have jumped by less than rest_speed; otherwise the
 * stops open or are struck.  Impulses may pull, but not more than the forces lam (r,) press within
 * the given time; NULL: without limit. */
static bool keep_held_closed(Simulation *sim, const double *lam, double time, bool *follows,
                          Problem *problem) {
    const Equations *eq = &sim->equations;
    int ny = state_size(sim), n = system_of(sim)->n, h = eq->first_hold;
    double gaps[STOPS_MAX], rates[STOPS_MAX], *y = sim->state.front, t = sim->state.front_time;
    gaps_and_rates(sim, gaps, rates);
    Scratch scratch = sim->scratch;
    double *P = take(&scratch, (size_t)eq->r), *after = take(&scratch, (size_t)ny);
    copy(ny, y, after);
    bool ok = project_with_impulses(eq, t, after, P, scratch, problem);
    *follows = ok;
    for (int k = 0; *follows && k < eq->held_count; k++) {
        double pull = lam ? greater(lam[h + k], 0.0) * time : HUGE_VAL;
        *follows = fabs(rates[eq->held[k]]) <= jump_allowed(sim, eq->held[k]) && P[h + k] >= -pull;
    }
    for (int k = 0; *follows && k < eq->held_count; k++) {
        after[2 * n] -= P[h + k] * rates[eq->held[k]] / 2;
        after[2 * n + 1] += push_wall(sim, eq->held[k], P[h + k]);
    }
    copy(*follows ? ny : 0, after, y);
    return ok;
}

PRBM bool follow_walls(Simulation *sim, const double *lam, double time, Problem *problem) {
    bool follows = false;
    return keep_held_closed(sim, lam, time, &follows, problem) &&
           (follows || choose_moved_modes(sim, problem));
}
