/* Impacts at the stops and impulses at the forces: the twin of hybrid/impacts.py. */
#include <math.h>
#include <string.h>

#include "core/friction.h"
#include "core/gaps.h"
#include "hybrid/access.h"
#include "hybrid/compliant.h"
#include "hybrid/configuration.h"
#include "hybrid/contact_modes.h"
#include "hybrid/contact_names.h"
#include "hybrid/impacts.h"
#include "hybrid/phases.h"
#include "hybrid/rest.h"
#include "hybrid/walls.h"

/* Compute the velocities after = v + X P. */
static void add_impulses(int k, int n, const double *v, const double *X, const double *P,
                         double *after) {
    copy(n, v, after);
    for (int j = 0; j < n; j++) {
        for (int a = 0; a < k; a++) {
            after[j] += X[j * k + a] * P[a];
        }
    }
}

/* --- impulses of an impact -------------------------------------------------------------------- */

/* An impact in progress: the stops struck and held, the velocities after it, the impulses. */
typedef struct {
    int struck_count, held_count, struck[STOPS_MAX], held[STOPS_MAX];
    double restitution[STOPS_MAX];
    double *after;                                     /* (n,) */
    double normal[STOPS_MAX], tangential[STOPS_MAX]; /* by stop */
    bool with_normal[STOPS_MAX];                      /* whether the stop takes part */
} Hits;

/* The state before an impact. */
typedef struct {
    ContactProblem *at;
    const double *v;
    double rates[STOPS_MAX], friction[STOPS_MAX]; /* of the gaps; of the stops struck */
} Approach;

/* The a-th of the stops that take part: first those that are struck, then those that hold. */
static int partner(const Hits *hits, int a) {
    return a < hits->struck_count ? hits->struck[a] : hits->held[a - hits->struck_count];
}

static double motion_speed(const Simulation *sim) {
    return sim->configuration.scales.rate * sim->configuration.scales.length;
}

static bool impulses_without_friction(Simulation *sim, const Approach *approach, Hits *hits,
                                      Problem *problem) {
    Scratch scratch = sim->scratch;
    const System *system = system_of(sim);
    ContactProblem *at = approach->at;
    int n = system->n, k = hits->struck_count + hits->held_count;
    double *G = take_matrix(&scratch, k, n), *X = take_matrix(&scratch, n, k);
    double *W = take_matrix(&scratch, k, k), *rates = take(&scratch, (size_t)k);
    double *eps = take(&scratch, (size_t)k), *P = take(&scratch, (size_t)k);
    Rows gaps = gap_rows(system);
    for (int a = 0; a < k; a++) {
        int i = partner(hits, a);
        row_jacobian(&gaps, i, at->e, G + a * n);
        rates[a] = lesser(approach->rates[i], 0.0);
        eps[a] = a < hits->struck_count ? hits->restitution[a] : 0.0;
    }
    if (!loop_response(at, k, G, X, scratch, problem)) {
        return false;
    }
    contact_mobility(n, k, at->M, G, X, system->length, W);
    for (int a = 0; a < k; a++) {
        W[a * k + a] += sim->equations.inputs.mobilities[partner(hits, a)];
    }
    if (!newton(k, W, rates, eps, motion_speed(sim), P, scratch, problem)) {
        return false;
    }
    add_impulses(k, n, approach->v, X, P, hits->after);
    for (int a = 0; a < k; a++) {
        int i = partner(hits, a);
        hits->normal[i] = P[a];
        hits->with_normal[i] = true;
    }
    return true;
}

/* Compute the reaction impulses along rows (r, n) from M (v+ - v-) - GT^T P = rows^T reaction, with
 * the impulses P (k,) along the rows GT (k, n). */
static bool reaction_impulses(Simulation *sim, const Approach *approach, const double *after,
                              int k, const double *GT, const double *P, int r,
                              const double *rows, double *reaction, Scratch scratch,
                              Problem *problem) {
    int n = system_of(sim)->n;
    const double *M = approach->at->M;
    double *left = take(&scratch, (size_t)n);
    double *columns = take_matrix(&scratch, n, r);
    for (int j = 0; j < n; j++) {
        left[j] = 0.0;
        for (int i = 0; i < n; i++) {
            left[j] += M[j * n + i] * (after[i] - approach->v[i]);
        }
        for (int a = 0; a < k; a++) {
            left[j] -= GT[a * n + j] * P[a];
        }
        for (int a = 0; a < r; a++) {
            columns[j * r + a] = rows[a * n + j];
        }
    }
    return r == 0 || least_squares(n, r, columns, left, REACTION_RANK_RTOL, reaction, scratch,
                                   problem);
}

/* Set the normal and tangential rows GT (2 k, n) of the stops struck, their rates before the
 * impact, and the rows (r, n) of the loops and of the kept stops. */
static void impact_rows(Simulation *sim, const Approach *approach, const Hits *hits,
                        int kept_count, const int *kept, double *rows, double *GT,
                        double *rates) {
    const System *system = system_of(sim);
    ContactProblem *at = approach->at;
    int n = system->n, k = hits->struck_count;
    Rows gaps = gap_rows(system), walls = slide_rows(system);
    copy(system->r * n, at->loops, rows);
    for (int a = 0; a < kept_count; a++) {
        row_jacobian(&gaps, kept[a], at->e, rows + (system->r + a) * n);
    }
    for (int a = 0; a < k; a++) {
        int i = hits->struck[a];
        row_jacobian(&gaps, i, at->e, GT + a * n);
        row_jacobian(&walls, i, at->e, GT + (k + a) * n);
        rates[a] = approach->rates[i];
        rates[k + a] = dot(n, GT + (k + a) * n, approach->v);
    }
}

/* Remove the kept stops that would pull; returns whether there are any. */
static bool remove_pulling(int *kept_count, int *kept, double *reaction) {
    int staying = 0;
    for (int a = 0; a < *kept_count; a++) {
        if (!(reaction[a] < 0.0)) {
            reaction[staying] = reaction[a];
            kept[staying++] = kept[a];
        }
    }
    bool pulling = staying < *kept_count;
    *kept_count = staying;
    return pulling;
}

static void set_impulses(Hits *hits, const double *P, int kept_count, const int *kept,
                         const double *reaction) {
    int k = hits->struck_count;
    for (int a = 0; a < k; a++) {
        hits->normal[hits->struck[a]] = P[a];
        hits->tangential[hits->struck[a]] = P[k + a];
        hits->with_normal[hits->struck[a]] = true;
    }
    for (int a = 0; a < kept_count; a++) {
        hits->normal[kept[a]] = reaction[a];
        hits->with_normal[kept[a]] = true;
    }
}

/* Compute impulses with friction, with the kept stops as constraints.  Kept stops that would pull
 * are removed.  *pulling: whether there were any, so that the impulses must be computed again. */
static bool impulses_with_friction(Simulation *sim, const Approach *approach, Hits *hits,
                                   int *kept_count, int *kept, bool *pulling, Problem *problem) {
    Scratch scratch = sim->scratch;
    const System *system = system_of(sim);
    ContactProblem *at = approach->at;
    int n = system->n, k = hits->struck_count, r = system->r + *kept_count;
    double *rows = take_matrix(&scratch, r, n), *GT = take_matrix(&scratch, 2 * k, n);
    double *X = take_matrix(&scratch, n, 2 * k);
    double *W = take_matrix(&scratch, 2 * k, 2 * k);
    double *rates = take(&scratch, 2 * (size_t)k), *P = take(&scratch, 2 * (size_t)k);
    double *reaction = take(&scratch, (size_t)r);
    impact_rows(sim, approach, hits, *kept_count, kept, rows, GT, rates);
    if (!response(n, r, 2 * k, at->M, rows, GT, system->length, X, scratch, problem)) {
        return false;
    }
    contact_mobility(n, 2 * k, at->M, GT, X, system->length, W);
    for (int a = 0; a < k; a++) {
        W[a * 2 * k + a] += sim->equations.inputs.mobilities[hits->struck[a]];
    }
    double speed = motion_speed(sim);
    if (k == 1 ? !stronge(W, rates, approach->friction[0], hits->restitution[0], speed, &P[0],
                          &P[1], problem)
               : !several(k, W, rates, approach->friction, hits->restitution, speed, P,
                          scratch, problem)) {
        return false;
    }
    add_impulses(2 * k, n, approach->v, X, P, hits->after);
    if (!reaction_impulses(sim, approach, hits->after, 2 * k, GT, P, r, rows, reaction, scratch,
                           problem)) {
        return false;
    }
    *pulling = remove_pulling(kept_count, kept, reaction + system->r);
    if (!*pulling) {
        set_impulses(hits, P, *kept_count, kept, reaction + system->r);
    }
    return true;
}

/* Repeat impulses_with_friction until no kept stop would pull. */
static bool rounds_with_friction(Simulation *sim, const Approach *approach, Hits *hits,
                                 int *kept_count, int *kept, Problem *problem) {
    bool pulling = true, ok = true;
    *kept_count = hits->held_count;
    memcpy(kept, hits->held, (size_t)hits->held_count * sizeof(int));
    while (ok && pulling) {
        ok = impulses_with_friction(sim, approach, hits, kept_count, kept, &pulling, problem);
    }
    return ok;
}

/* Compute impulses with friction.  If a held stop that was removed would close, all held stops are
 * treated as struck, without restitution and friction. */
static bool with_released_stops(Simulation *sim, Approach *approach, Hits *hits,
                                Problem *problem) {
    int kept_count, kept[STOPS_MAX], k = hits->struck_count, held_count = hits->held_count;
    bool closing = false;
    if (!rounds_with_friction(sim, approach, hits, &kept_count, kept, problem)) {
        return false;
    }
    for (int a = 0; a < held_count; a++) {
        int i = hits->held[a];
        double rate = gap_rate(&sim->equations, i, sim->state.front_time, approach->at->e,
                               hits->after, NULL);
        closing = closing || (!has_contact(kept_count, kept, i) &&
                              rate < -zero_speed(&sim->configuration));
    }
    if (!closing) {
        return true;
    }
    for (int a = 0; a < held_count; a++) {
        hits->struck[k + a] = hits->held[a];
        hits->restitution[k + a] = approach->friction[k + a] = 0.0;
    }
    for (int i = 0; i < system_of(sim)->s; i++) {
        hits->normal[i] = hits->tangential[i] = 0.0;
        hits->with_normal[i] = false;
    }
    hits->struck_count = k + held_count;
    hits->held_count = 0;
    bool ok = rounds_with_friction(sim, approach, hits, &kept_count, kept, problem);
    hits->struck_count = k;
    hits->held_count = held_count;
    return ok;
}

/* Name the stops that take part in an impact that has no solution. */
static bool name_partners(const Simulation *sim, const Hits *hits, Problem *problem) {
    int stops[2 * STOPS_MAX], count = hits->struck_count + hits->held_count;
    ContactNames names;
    Problem cause = *problem;
    for (int a = 0; a < count; a++) {
        stops[a] = partner(hits, a);
    }
    list_contacts(sim->configuration.mechanism, count, stops, &names);
    return fail(problem, "impact at t = %.9g s (%s): %s", sim->state.front_time, names.text,
                cause.text);
}

/* Compute the velocities after an impact, and the normal and tangential impulses by stop.  If the
 * struck stops have no friction, the impulses of held stops are unknowns of the same
 * complementarity problem.  Otherwise held stops are constraints, which are removed if they would
 * pull.  The friction of held stops and of friction points is finite and has no impulse. */
static bool impact_impulses(Simulation *sim, const double *q, const double *v, Hits *hits,
                            Problem *problem) {
    bool rough = false;
    ContactProblem *at = contact_problem_at(sim, q, sim->scratch);
    Approach approach = {at, v, {0.0}, {0.0}};
    for (int i = 0; i < system_of(sim)->s; i++) {
        approach.rates[i] = gap_rate(&sim->equations, i, sim->state.front_time, at->e, v,
                                     NULL);
        hits->normal[i] = hits->tangential[i] = 0.0;
        hits->with_normal[i] = false;
    }
    for (int a = 0; a < hits->struck_count; a++) {
        const Stop *stop = &sim->configuration.mechanism->stops[hits->struck[a]];
        approach.friction[a] = field_value(sim, stop->friction);
        rough = rough || approach.friction[a] != 0.0;
    }
    bool ok = rough ? with_released_stops(sim, &approach, hits, problem)
                    : impulses_without_friction(sim, &approach, hits, problem);
    return ok || name_partners(sim, hits, problem);
}

/* --- captures --------------------------------------------------------------------------------- */

/* Whether a resting stop is pressed so strongly that a bounce would be lower than
 * VANISHED_BOUNCE_RTOL of the size, or than the simulation mode resolves.  Such bounces might never
 * decay, because an impact detected late adds as much energy as it dissipates. */
static bool bounce_vanishes(Simulation *sim, int stop, const HoldingSet *resting, const double *q,
                            const double *v, double speed, bool *result, Problem *problem) {
    const System *system = system_of(sim);
    Evaluation *tried = &sim->trial.evaluation;
    double free;
    Rows gaps = gap_rows(system);
    const Equations *holding = equations_holding(sim, resting, q, v);
    if (!evaluate_equations(holding, sim->state.front_time, q, v,
                            extra_states(sim, sim->state.front), NULL, tried, problem)) {
        return false;
    }
    Scratch scratch = sim->scratch;
    double *G = take(&scratch, (size_t)system->n);
    ContactProblem *at = contact_problem_at(sim, q, scratch);
    row_jacobian(&gaps, stop, at->e, G);
    if (!mobility(at, G, &free, scratch, problem)) {
        return false;
    }
    double pressing = stop_force(holding, tried->lam, stop) * free;
    double lowest = greater(VANISHED_BOUNCE_RTOL, sim->state.mode.lowest_bounce) * system->length;
    *result = speed * speed < 2.0 * pressing * lowest;
    return true;
}

/* Whether a stop that is struck slowly comes to rest: it would be pressed after an impact without
 * restitution, and its speed is below rest_speed or its bounce vanishes.  A speed that is round-off
 * always ends in rest. */
static bool captured(Simulation *sim, int stop, const Hits *hits, const double *q,
                     const double *v, double speed, bool *result, Problem *problem) {
    int candidates[1 + STOPS_MAX];
    *result = speed <= zero_speed(&sim->configuration);
    if (*result) {
        return true;
    }
    Hits soft;
    soft.after = sim->struck.soft;
    soft.struck_count = 1;
    soft.struck[0] = stop;
    soft.restitution[0] = 0.0;
    soft.held_count = hits->held_count;
    memcpy(soft.held, hits->held, sizeof soft.held);
    HoldingSet resting = {0, {0}, false};
    candidates[0] = stop;
    memcpy(candidates + 1, hits->held, (size_t)hits->held_count * sizeof(int));
    bool rests = false;
    bool ok = impact_impulses(sim, q, v, &soft, problem) &&
              find_holding_stops(sim, 1 + hits->held_count, candidates, q, soft.after,
                                 &resting, problem);
    for (int k = 0; ok && resting.found && k < resting.count; k++) {
        rests = rests || resting.stops[k] == stop;
    }
    if (ok && rests) {
        *result = speed < field_value(sim, sim->configuration.mechanism->stops[stop].rest_speed);
        ok = *result || bounce_vanishes(sim, stop, &resting, q, soft.after, speed, result,
                                        problem);
    }
    return ok;
}

/* --- bookkeeping ------------------------------------------------------------------------------ */

/* Gap rates before and after an impact, and losses of energy, by stop. */
typedef struct {
    double before[STOPS_MAX], after[STOPS_MAX], lost[STOPS_MAX];
} Account;

/* Change the velocities of the walls, sum up the impulses and add the energies to the state.  A
 * normal impulse P dissipates -P (u- + u+)/2, with the rate u of the gap before and after the
 * impact. For a tangential impulse, u is the sliding velocity.  The wall does the work -P (w- +
 * w+)/2; its velocity w changes by its mobility times P. */
static void book_energies(Simulation *sim, const Hits *hits, const double *q, const double *v,
                          Account *account) {
    Scratch scratch = sim->scratch;
    const System *system = system_of(sim);
    Rows walls = slide_rows(system);
    double lost = 0.0, work = 0.0, *front = sim->state.front, t = sim->state.front_time;
    Complex *e = directions_at(sim, q, &scratch);
    for (int i = 0; i < system->s; i++) {
        double P = hits->normal[i];
        account->before[i] = gap_rate(&sim->equations, i, t, e, v, NULL);
        work += hits->with_normal[i] ? push_wall(sim, i, P) : 0.0;
        account->after[i] = gap_rate(&sim->equations, i, t, e, hits->after, NULL);
        double slid = row_rate(&walls, i, e, v) + row_rate(&walls, i, e, hits->after);
        account->lost[i] = -P * (account->before[i] + account->after[i]) / 2 -
                           hits->tangential[i] * slid / 2;
        lost += hits->with_normal[i] ? account->lost[i] : 0.0;
    }
    copy(system->n, hits->after, front + system->n);
    front[2 * system->n] += lost;
    front[2 * system->n + 1] += work;
}

/* Latch the values of the counted impacts and report them. */
static bool latch_impacts(Simulation *sim, const Hits *hits, const Account *account,
                          const bool *counted, const double *q, const double *v,
                          Problem *problem) {
    Scratch scratch = sim->scratch;
    const System *system = system_of(sim);
    int n = system->n;
    bool any = false;
    double *phi = take(&scratch, (size_t)n), *M = take_matrix(&scratch, n, n);
    double modal = 0.0;
    for (int i = 0; i < system->s; i++) {
        any = any || counted[i];
    }
    bool ok = !any || fundamental_at(system, q, phi, M, scratch, problem);
    if (any && ok) {
        modal = simulated_restitution(n, phi, M, v, hits->after);
    }
    for (int i = 0; ok && i < system->s; i++) {
        if (counted[i]) {
            Latched *latched = &sim->state.latched[i];
            latched->count += latched->count < IMPACT_COUNT_MAX;
            latched->time = sim->state.front_time;
            latched->approach_speed = -account->before[i];
            latched->rebound_speed = account->after[i];
            latched->impulse = hits->normal[i];
            latched->energy_lost = account->lost[i];
            latched->modal_restitution = modal;
            report_impact(sim, i, q, v, hits->after);
        }
    }
    return ok;
}

/* --- impacts ---------------------------------------------------------------------------------- */

/* Find whether the gap of a stop can have a rate that is not round-off.  It cannot where the body
 * moves along a wall at rest and no motion across it is possible, as at the dead centre of a guide. */
static bool can_be_struck(Simulation *sim, int stop, const double *q, bool *result,
                          Scratch scratch, Problem *problem) {
    ContactProblem *at = contact_problem_at(sim, q, scratch);
    double *row = take(&scratch, (size_t)system_of(sim)->n);
    Rows gaps = gap_rows(system_of(sim));
    row_jacobian(&gaps, stop, at->e, row);
    *result = wall_motion(&sim->equations.inputs.walls[stop], sim->state.front_time).v != 0.0;
    return *result || moves(at, row, result, scratch, problem);
}

/* List the stops that are struck together with the stop hit, and the held stops. */
static bool find_partners(Simulation *sim, int hit, const double *q, const double *v, Hits *hits,
                          double *rates, Problem *problem) {
    Scratch scratch = sim->scratch;
    double near = TOUCHING_RTOL * system_of(sim)->length, t = sim->state.front_time;
    Complex *e = directions_at(sim, q, &scratch);
    const Stop *stops = sim->configuration.mechanism->stops;
    bool ok = true;
    hits->struck_count = hits->held_count = 0;
    for (int i = 0; ok && i < system_of(sim)->s; i++) {
        double distance = gap(&sim->equations, i, t, e, NULL);
        rates[i] = gap_rate(&sim->equations, i, t, e, v, NULL);
        if (held_stop(&sim->equations, i)) {
            hits->held[hits->held_count++] = i;
        } else if (!stops[i].compliant && rates[i] < 0.0 && (i == hit || distance <= near)) {
            bool struck = false;
            ok = can_be_struck(sim, i, q, &struck, scratch, problem);
            hits->struck[hits->struck_count] = i;
            hits->struck_count += struck;
        }
    }
    return ok;
}

/* Choose the restitution of each stop struck.  If a stop comes to rest, its restitution is 0 and
 * the impact is not counted. */
static bool choose_restitutions(Simulation *sim, const double *q, const double *v,
                                const double *rates, Hits *hits, bool *counted,
                                Problem *problem) {
    bool ok = true;
    for (int i = 0; i < system_of(sim)->s; i++) {
        counted[i] = false;
    }
    for (int k = 0; ok && k < hits->struck_count; k++) {
        int i = hits->struck[k];
        const Stop *stop = &sim->configuration.mechanism->stops[i];
        bool soft = false;
        ok = captured(sim, i, hits, q, v, -rates[i], &soft, problem);
        counted[i] = !soft;
        hits->restitution[k] = soft ? 0.0 : field_value(sim, stop->restitution);
    }
    return ok;
}

/* Add the open stops that touch at rest and take part in an impact to the held stops.  Without
 * restitution, bodies that touch each other move on together.  Impacts one after the other would reach
 * this motion only in the limit of infinitely many.  Impacts with restitution do follow each other,
 * unless the speed is round-off. */
static bool join_touching(Simulation *sim, const double *q, const double *rates, Hits *hits,
                          Problem *problem) {
    Scratch scratch = sim->scratch;
    const Stop *stops = sim->configuration.mechanism->stops;
    double near = TOUCHING_RTOL * system_of(sim)->length, zero = zero_speed(&sim->configuration);
    double t = sim->state.front_time;
    bool ok = true, slow = true, elastic = false;
    Complex *e = directions_at(sim, q, &scratch);
    for (int k = 0; k < hits->struck_count; k++) {
        slow = slow && rates[hits->struck[k]] >= -zero;
        elastic = elastic || hits->restitution[k] != 0.0;
    }
    for (int i = 0; ok && !elastic && i < system_of(sim)->s; i++) {
        bool joins = !stops[i].compliant && !held_stop(&sim->equations, i) &&
                     !has_contact(hits->struck_count, hits->struck, i) && rates[i] <= zero &&
                     gap(&sim->equations, i, t, e, NULL) <= near &&
                     (slow || field_value(sim, stops[i].restitution) == 0.0);
        ok = !joins || can_be_struck(sim, i, q, &joins, scratch, problem);
        if (ok && joins) {
            hits->held[hits->held_count++] = i;
        }
    }
    return ok;
}

/* Open all held stops.  List those that took part and do not separate; return their number. */
static int open_all(Simulation *sim, const Hits *hits, int *touching) {
    Scratch scratch = sim->scratch;
    double bound = zero_speed(&sim->configuration), t = sim->state.front_time;
    int count = 0;
    Complex *e = directions_at(sim, sim->state.front, &scratch);
    for (int k = 0; k < hits->struck_count + hits->held_count; k++) {
        int i = partner(hits, k);
        if (gap_rate(&sim->equations, i, t, e, hits->after, NULL) <= bound) {
            touching[count++] = i;
        }
    }
    for (int i = 0; i < system_of(sim)->s; i++) {
        bool held = held_stop(&sim->equations, i);
        sim->state.modes[i] = held ? CONTACT_OPEN : sim->state.modes[i];
    }
    set_inputs(sim);
    return count;
}

/* Resolve the impact of a stop, and of all other stops whose gaps close at the same time. */
PRBM bool impact(Simulation *sim, int hit, Problem *problem) {
    int n = system_of(sim)->n, touching[STOPS_MAX], touching_count = 0;
    double rates[STOPS_MAX];
    bool counted[STOPS_MAX];
    double *q = sim->struck.q, *v = sim->struck.v;
    Hits hits;
    Account account;
    hits.after = sim->struck.after;
    copy(n, sim->state.front, q);
    copy(n, sim->state.front + n, v);
    if (sim->configuration.mechanism->stops[hit].compliant) {
        return touch(sim, hit, problem);
    }
    bool ok = find_partners(sim, hit, q, v, &hits, rates, problem);
    if (ok && hits.struck_count > 0) {
        unfreeze(sim);
        ok = find_partners(sim, hit, q, v, &hits, rates, problem);
    }
    if (ok && hits.struck_count == 0) {
        return choose_modes(sim, &hit, rates[hit] <= zero_speed(&sim->configuration), NULL,
                            problem);
    }
    ok = ok && choose_restitutions(sim, q, v, rates, &hits, counted, problem) &&
         join_touching(sim, q, rates, &hits, problem) &&
         impact_impulses(sim, q, v, &hits, problem);
    if (ok) {
        book_energies(sim, &hits, q, v, &account);
        ok = latch_impacts(sim, &hits, &account, counted, q, v, problem);
    }
    if (ok) {
        touching_count = open_all(sim, &hits, touching);
    }
    return ok && rephase(sim, problem) &&
           choose_modes(sim, touching, touching_count, NULL, problem);
}

/* --- impulses of the inputs ------------------------------------------------------------------- */

/* The sums of the impulses given so far: x, y and moment of each force. */
PRBM const double *given_impulses(const Simulation *sim) {
    return sim->state.given + sim->configuration.mechanism->input.impulses;
}

PRBM bool impulses_changed(const Simulation *sim) {
    size_t count = LOADS * (size_t)sim->configuration.mechanism->force_count;
    return memcmp(given_impulses(sim), sim->state.received, count * sizeof(double)) != 0;
}

static void free_sticking(Simulation *sim) {
    for (int contact = 0; contact < contact_count(sim); contact++) {
        ContactMode *mode = &sim->state.modes[contact];
        *mode = *mode == CONTACT_STICK ? CONTACT_FRICTIONLESS : *mode;
    }
    set_contacts(sim, sim->state.modes);
}

/* Apply the impulses (3,) of the i-th force.  The work of a component P is P (u- + u+)/2, with the
 * rate u along it before and after. */
static bool apply_impulses(Simulation *sim, int i, const double *P, Problem *problem) {
    Scratch scratch = sim->scratch;
    const System *system = system_of(sim);
    int n = system->n;
    double *front = sim->state.front, *v = front + n;
    double *rows = take_matrix(&scratch, LOADS, n), *X = take_matrix(&scratch, n, LOADS);
    double *after = take(&scratch, (size_t)n);
    ContactProblem *at = contact_problem_at(sim, front, scratch);
    load_rows(system, &system->pushed[i], at->e, rows, scratch);
    bool ok = loop_response(at, LOADS, rows, X, scratch, problem);
    if (ok) {
        add_impulses(LOADS, n, v, X, P, after);
        for (int k = 0; k < LOADS; k++) {
            front[2 * n + 1] += P[k] * (dot(n, rows + k * n, v) + dot(n, rows + k * n, after)) / 2;
        }
        copy(n, after, v);
    }
    return ok;
}

/* Apply the changes of the impulses since they were last received.  The loops transmit them;
 * impacts at stops follow later, in choose_moved_modes.  Friction is finite and has no impulse:
 * sticking contacts become free to slip or stick again. */
PRBM bool receive_impulses(Simulation *sim, Problem *problem) {
    int forces = sim->configuration.mechanism->force_count;
    const double *given = given_impulses(sim);
    bool ok = true;
    if (!impulses_changed(sim)) {
        return true;
    }
    for (int i = 0; ok && i < forces; i++) {
        double grown[LOADS];
        for (int k = 0; k < LOADS; k++) {
            grown[k] = given[LOADS * i + k] - sim->state.received[LOADS * i + k];
        }
        ok = apply_impulses(sim, i, grown, problem);
    }
    copy(LOADS * forces, given, sim->state.received);
    free_sticking(sim);
    return ok;
}
