/* The largest forces and indentations of contacts at compliant stops, as steps go on: the twin of
 * hybrid/contact_peaks.py. */
#include <math.h>
#include <string.h>

#include "core/gaps.h"
#include "core/vectors.h"
#include "hybrid/access.h"
#include "hybrid/arc.h"
#include "hybrid/contact_modes.h"
#include "hybrid/contact_peaks.h"

PRBM bool check_depth(const Simulation *sim, int stop, double depth, double time,
                      Problem *problem) {
    if (!(depth <= sim->configuration.scales.length)) {
        return fail(problem,
                    "%s is indented by %.3g m at t = %.9g s, more than the size of the mechanism: "
                    "raise its stiffness, or move it",
                    sim->configuration.mechanism->stops[stop].name, depth, time);
    }
    return true;
}

/* An indentation and a force. */
enum { PEAK_DEPTH, PEAK_FORCE, PEAK_VALUES };

/* Compute the indentation and the force of a stop at a time and a state. */
static void contact_in(Simulation *sim, int stop, double t, const double *y,
                       double value[PEAK_VALUES]) {
    Located *located = &sim->stepping.located;
    const System *system = system_of(sim);
    const Equations *equations = &sim->equations;
    directions(system, y, located->e);
    const double *extra = extra_states(sim, y), *v = y + system->n;
    double depth = -gap(equations, stop, t, located->e, extra);
    double depth_rate = -gap_rate(equations, stop, t, located->e, v, extra);
    value[PEAK_DEPTH] = depth;
    value[PEAK_FORCE] = contact_force(&equations->laws[stop], &equations->contacts.touching[stop],
                                      depth, depth_rate);
}

/* The same at a time of the latest step. */
static void contact_at(Simulation *sim, int stop, double t, double value[PEAK_VALUES]) {
    double *y = sim->stepping.located.y;
    arc_at(sim, t, y);
    contact_in(sim, stop, t, y, value);
}

static double clipped(double x, double low, double high) {
    return lesser(greater(x, low), high);
}

/* Compute indentation and force at three times. */
static void contact_around(Simulation *sim, int stop, double t, double distance,
                           double value[3][PEAK_VALUES]) {
    for (int k = 0; k < 3; k++) {
        contact_at(sim, stop, t + (k - 1) * distance, value[k]);
    }
}

/* Return the largest value between two times, by parabolas through ever closer points; first: the
 * values at both ends and in the middle.  A step resolves the vibration of a contact.  If the
 * first parabola has no maximum in the step or close to it, the largest value is that of an end. */
static double largest_value(Simulation *sim, int stop, int which, double start, double end,
                            double first[3][PEAK_VALUES]) {
    double t = 0.5 * (start + end), distance = 0.5 * (end - start), result = -HUGE_VAL;
    double near[3][PEAK_VALUES], (*value)[PEAK_VALUES] = first;
    for (int k = 0; k < PEAK_REFINEMENTS; k++) {
        double middle = clipped(t, start + distance, end - distance);
        if (k > 0) {
            value = near;
            contact_around(sim, stop, middle, distance, near);
        }
        double before = value[0][which], at = value[1][which], after = value[2][which];
        double bend = before - 2.0 * at + after;
        result = greater(result, greater(at, greater(before, after)));
        if (!(bend < 0.0) || fabs(before - after) > -2.0 * PEAK_REACH_FACTOR * bend) {
            return result;
        }
        t = clipped(middle + 0.5 * distance * (before - after) / bend, start, end);
        distance *= PEAK_REFINEMENT_FACTOR;
    }
    contact_at(sim, stop, t, near[0]);
    return greater(result, near[0][which]);
}

PRBM void peaks_until(Simulation *sim, int stop, double time, double *depth, double *force) {
    const Arc *arc = &sim->state.arc;
    const Latched *latched = &sim->state.latched[stop];
    double start = arc->start, end = lesser(time, sim->state.front_time);
    double first[3][PEAK_VALUES];
    *depth = latched->indentation;
    *force = latched->peak_force;
    if (!is_pressed(&sim->state.touching[stop]) || sim->state.mode.exchange) {
        return;
    }
    if (!arc->valid) {
        contact_in(sim, stop, sim->state.front_time, sim->state.front, first[0]);
        *depth = greater(*depth, first[0][PEAK_DEPTH]);
        *force = greater(*force, first[0][PEAK_FORCE]);
    } else if (end > start) {
        contact_around(sim, stop, 0.5 * (start + end), 0.5 * (end - start), first);
        *depth = greater(*depth, largest_value(sim, stop, PEAK_DEPTH, start, end, first));
        *force = greater(*force, largest_value(sim, stop, PEAK_FORCE, start, end, first));
    }
}

static double *dent_of(const Simulation *sim, int stop) {
    int order = sim->configuration.mechanism->stops[stop].extra / EXTRA_STATES;
    return sim->state.dents + DENT_NUMBERS * order;
}

PRBM Dent latest_dent(const Simulation *sim, int stop) {
    Dent dent;
    memcpy(&dent, dent_of(sim, stop), sizeof dent);
    return dent;
}

PRBM void store_dent(Simulation *sim, int stop, const Dent *dent) {
    memcpy(dent_of(sim, stop), dent, sizeof *dent);
}

static Dent dent_now(Simulation *sim, int stop, double gap_now, double rate,
                     const Evaluation *at) {
    Scratch scratch = sim->scratch;
    const Equations *eq = &sim->equations;
    const ComplianceLaw *law = &eq->laws[stop];
    const ContactPhase *touching = &eq->contacts.touching[stop];
    const double *front = sim->state.front;
    double t = sim->state.front_time;
    Dent last = latest_dent(sim, stop);
    Dent dent = {1.0, t, -gap_now, rate, at->pressure[stop], 0.0, last.deepens, last.grows};
    if (touching->phase != PHASE_FREE) {
        double bend = -gap_acceleration(eq, stop, t, directions_at(sim, front, &scratch),
                                        front + system_of(sim)->n, at);
        dent.force_rate = contact_stiffness(law, dent.depth) * rate *
                              damping_ratio(law, touching, rate) +
                          elastic_force(law, dent.depth) * damping_slope(law, touching) * bend;
    }
    return dent;
}

/* Return the largest value of a cubic from (0, a) to (h, b) with the rates u and w there. */
static double largest_of_cubic(double h, double a, double u, double b, double w) {
    double c3 = 2.0 * (a - b) / h + u + w, c2 = 3.0 * (b - a) / h - 2.0 * u - w;
    double best = greater(a, b), root = c2 * c2 - 3.0 * c3 * u;
    if (root > 0.0) { /* s = t/h at the maximum: 3 c3 s^2 + 2 c2 s + u = 0. */
        double s = u / (square_root(root) - c2);
        double value = a + h * s * (u + s * (c2 + s * c3));
        best = s > 0.0 && s < 1.0 ? greater(best, value) : best;
    }
    return best;
}

PRBM bool latch_present(Simulation *sim, const Evaluation *at, bool smooth, Problem *problem) {
    double gaps[STOPS_MAX], rates[STOPS_MAX];
    bool ok = true;
    gaps_and_rates(sim, gaps, rates);
    for (int k = 0; ok && k < sim->equations.pressed_count; k++) {
        int i = sim->equations.pressed[k];
        Latched *latched = &sim->state.latched[i];
        Dent last = latest_dent(sim, i), now = dent_now(sim, i, gaps[i], -rates[i], at);
        double h = now.time - last.time;
        if (smooth && last.known > 0.0 && h > 0.0) {
            double depth = largest_of_cubic(h, last.depth, last.depth_rate, now.depth, -rates[i]);
            double force =
                largest_of_cubic(h, last.force, last.force_rate, now.force, now.force_rate);
            latched->indentation = greater(latched->indentation, depth);
            latched->peak_force = greater(latched->peak_force, force);
        }
        latched->indentation = greater(latched->indentation, now.depth);
        latched->peak_force = greater(latched->peak_force, now.force);
        store_dent(sim, i, &now);
        ok = check_depth(sim, i, now.depth, now.time, problem);
    }
    return ok;
}

PRBM bool latch_peaks(Simulation *sim, double time, Problem *problem) {
    bool ok = true;
    for (int k = 0; ok && k < sim->equations.pressed_count; k++) {
        int i = sim->equations.pressed[k];
        double depth, force;
        peaks_until(sim, i, time, &depth, &force);
        sim->state.latched[i].indentation = depth;
        sim->state.latched[i].peak_force = force;
        ok = check_depth(sim, i, depth, time, problem);
    }
    return ok;
}
