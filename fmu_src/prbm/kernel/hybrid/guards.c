/* Guards, which are scalars whose fall through zero is an event, and the location of their zeros in
 * a step: the twin of hybrid/guards.py. */
#include <math.h>

#include "core/friction.h"
#include "core/gaps.h"
#include "hybrid/access.h"
#include "hybrid/arc.h"
#include "hybrid/configuration.h"
#include "hybrid/contact_names.h"
#include "hybrid/guards.h"

/* --- guards ----------------------------------------------------------------------------------- */

PRBM double gap_guard(const Equations *equations, const Instant *at, int contact) {
    return gap(equations, contact, at->time, at->e, at->extra);
}

PRBM double gap_rate_guard(const Equations *equations, const Instant *at, int contact) {
    return gap_rate(equations, contact, at->time, at->e, at->v, at->extra);
}

PRBM double indentation_guard(const Equations *equations, const Instant *at, int contact) {
    return -gap_guard(equations, at, contact);
}

PRBM double indentation_rate_guard(const Equations *equations, const Instant *at, int contact) {
    return -gap_rate_guard(equations, at, contact);
}

/* The margin of the phase of a contact.  It begins to rise when its rate exceeds the reference
 * speed; it becomes free when its damping exceeds the elastic force. */
PRBM double switching_guard(const Equations *equations, const Instant *at, int contact) {
    const ContactPhase *touching = &equations->contacts.touching[contact];
    double rate = -gap_rate_guard(equations, at, contact);
    double ratio = damping_ratio(&equations->laws[contact], touching, rate);
    if (touching->phase == PHASE_FREE) {
        return PHASE_RTOL - ratio;
    }
    return lesser(PHASE_RTOL + ratio,
                  1.0 + REFERENCE_SPEED_RTOL - rate / touching->reference_speed);
}

/* The second derivative of the indentation, with which the reference speed rises. */
PRBM double rising_guard(const Equations *equations, const Instant *at, int contact) {
    return -gap_acceleration(equations, contact, at->time, at->e, at->v, at->found);
}

PRBM double release_guard(const Equations *equations, const Instant *at, int contact) {
    const ContactPhase *touching = &equations->contacts.touching[contact];
    double force = stop_force(equations, at->found->lam, contact);
    if (touching->phase != PHASE_FROZEN) {
        return force;
    }
    double elastic = elastic_force(&equations->laws[contact], touching->depth);
    return FROZEN_FORCE_RTOL * elastic - fabs(force - elastic);
}

PRBM double slip_guard(const Equations *equations, const Instant *at, int contact) {
    double friction = fabs(stick_force(equations, at->found->lam, contact));
    double limit = friction_limit(equations, at->e, at->found, contact);
    return (1.0 + FRICTION_EXCESS_RTOL) * limit - friction;
}

PRBM double side_guard(const Equations *equations, const Instant *at, int contact) {
    return side_force(equations, at->found->lam, contact);
}

PRBM double reversal_guard(const Equations *equations, const Instant *at, int contact) {
    int sign = slip_sign(equations->contacts.modes[contact]);
    return sign * sliding_velocity(equations->system, contact, at->e, at->v);
}

/* --- contacts and steps in which events may occur --------------------------------------------- */

PRBM bool sticking_contact(const Equations *equations, int contact) {
    return equations->contacts.modes[contact] == CONTACT_STICK;
}

PRBM bool slipping_contact(const Equations *equations, int contact) {
    return slip_sign(equations->contacts.modes[contact]) != 0 &&
           (held_stop(equations, contact) || is_guide(equations->system, contact) ||
            friction_coefficient(equations, contact) > 0.0);
}

PRBM bool slipping_guide(const Equations *equations, int contact) {
    return is_guide(equations->system, contact) &&
           slip_sign(equations->contacts.modes[contact]) != 0;
}

PRBM bool open_stop(const Equations *equations, int contact) {
    return is_stop(equations->system, contact) &&
           equations->contacts.modes[contact] == CONTACT_OPEN;
}

PRBM bool pressed_stop(const Equations *equations, int contact) {
    return is_stop(equations->system, contact) &&
           is_pressed(&equations->contacts.touching[contact]);
}

PRBM bool pressed_near(Simulation *sim) {
    return sim->equations.pressed_count > 0;
}

PRBM bool release_near(Simulation *sim) {
    const Equations *eq = &sim->equations;
    const ForceRange *forces = &sim->stepping.forces;
    if (eq->sticking_count > 0) {
        return true;
    }
    for (int k = 0; k < eq->held_count; k++) {
        if (eq->contacts.touching[eq->held[k]].phase == PHASE_FROZEN ||
            forces->least[k] <= RELEASE_WATCH_FACTOR * forces->largest[k]) {
            return true;
        }
    }
    return false;
}

PRBM bool slip_near(Simulation *sim) {
    return sim->equations.sticking_count > 0;
}

PRBM bool side_near(Simulation *sim) {
    return sim->equations.slipping_guides > 0;
}

PRBM bool reversal_near(Simulation *sim) {
    return sim->equations.slipping_count > 0;
}

/* Bound the changes of the directions by those of the coordinates. */
static void bound_directions(const System *system, const double *coordinates, double *reach) {
    const DirectionMap *map = &system->mechanism->map;
    for (int j = 0; j < system->d; j++) {
        reach[j] = 0.0;
        for (int k = map->first[j]; k < map->first[j + 1]; k++) {
            reach[j] += fabs(system->factors[k]) * coordinates[map->coordinate[k]];
        }
    }
}

/* Bound the changes |dE| of the arms within the step.  The dense output bounds the changes of the
 * coordinates, and hence dtheta of angles and ds of stretches; then
 * |dE| <= |E| exp(|ds|) (|dtheta| + |ds|).  For arms that float, |dE| <= |du_x| + |du_y|. */
static void bound_arms(const Simulation *sim, double *reach) {
    const System *system = system_of(sim);
    double *coordinates = system->mapped ? reach + system->d : reach;
    furthest(system->n, state_size(sim), sim->state.arc.k, sim->state.arc.h, coordinates);
    if (system->mapped) {
        bound_directions(system, coordinates, reach);
    }
    for (int k = 0; k < system->stretch_count; k++) {
        int j = system->stretches[k], a = arm_of(system, j);
        double longest = modulus(sim->stepping.reference.e[a]) * exponential(reach[j]);
        reach[a] = longest * (reach[a] + reach[j]);
    }
    for (int k = 0; k < system->shift_count; k++) {
        int j = system->shifts[k];
        reach[arm_of(system, j)] += reach[j];
    }
}

/* Bound the change of a gap within the step [m]: by the motion of the wall and of the arms, and by
 * the rotation of the body that carries the wall. */
static double gap_reach(const Simulation *sim, int stop, const Complex *e, const double *arms) {
    const System *system = system_of(sim);
    const Complex *row = system->gaps + stop * system->d;
    const Wall *wall = &sim->state.walls[stop];
    const double *extra = extra_states(sim, sim->state.arc.y);
    double recoil = recoil_of(&sim->equations, stop, extra, EXTRA_RECOIL_RATE);
    double reach = (fabs(wall->rate) + fabs(recoil)) * sim->state.arc.h +
                   2.0 * fabs(wall->offset) + fabs(wall->excess) * wall->span;
    for (int j = 0; j < system->d; j++) {
        reach += (fabs(row[j].re) + fabs(row[j].im)) * arms[j];
    }
    if (system->on[stop] != FIXED) {
        Rows gaps = gap_rows(system);
        reach += modulus(seen_value(&gaps, stop, e)) * arms[system->on[stop]];
    }
    return reach;
}

/* Whether an open stop may be reached within the step. */
PRBM bool impact_near(Simulation *sim) {
    const System *system = system_of(sim);
    const Complex *e = sim->stepping.reference.e;
    double *arms = sim->stepping.reach;
    if (sim->equations.held_count == system->s) {
        return false;
    }
    bound_arms(sim, arms);
    double near = TOUCHING_RTOL * system->length, start = sim->state.arc.start;
    const double *extra = extra_states(sim, sim->state.arc.y);
    for (int s = 0; s < system->s; s++) {
        if (sim->state.modes[s] == CONTACT_OPEN &&
            !(gap(&sim->equations, s, start, e, extra) > near + gap_reach(sim, s, e, arms))) {
            return true;
        }
    }
    return false;
}

/* Whether a contact may end within the step. */
PRBM bool separation_near(Simulation *sim) {
    const Equations *eq = &sim->equations;
    const Complex *e = sim->stepping.reference.e;
    double start = sim->state.arc.start, *arms = sim->stepping.reach;
    const double *extra = extra_states(sim, sim->state.arc.y);
    if (eq->pressed_count == 0 || eq->walls_recoil) {
        return eq->pressed_count > 0;
    }
    bound_arms(sim, arms);
    for (int k = 0; k < eq->pressed_count; k++) {
        int s = eq->pressed[k];
        if (!(-gap(eq, s, start, e, extra) > gap_reach(sim, s, e, arms))) {
            return true;
        }
    }
    return false;
}

/* --- location --------------------------------------------------------------------------------- */

/* The search for the event of a guard at a contact. */
typedef struct {
    Simulation *sim;
    const Guard *guard;
    int contact;
    bool failed;
    Problem *problem;
} Search;

/* A function of the time within the step: sign * value + offset. */
typedef struct {
    Search *search;
    GuardValue *value;
    bool forces;
    double sign, offset;
} ArcGuard;

static ArcGuard arc_guard(Search *search) {
    ArcGuard result = {search, search->guard->value, search->guard->forces, 1.0, 0.0};
    return result;
}

/* Report that a search has failed, and return a positive value, which is not an event. */
static double no_guard(Search *search, const char *cause) {
    const Simulation *sim = search->sim;
    const Arc *arc = &sim->state.arc;
    if (!search->failed) {
        (void)fail(search->problem,
                   "no %s of %s could be located within %.3g s from t = %.9g s: %s",
                   search->guard->event,
                   contact_name(sim->configuration.mechanism, search->contact), arc->h, arc->start,
                   cause);
    }
    search->failed = true;
    return 1.0;
}

static double guard_at(const ArcGuard *guard, double t) {
    Search *search = guard->search;
    Simulation *sim = search->sim;
    const System *system = system_of(sim);
    Located *located = &sim->stepping.located;
    double *y = located->y;
    Instant at = {t, y, y + system->n, extra_states(sim, y), located->e, NULL};
    arc_at(sim, t, y);
    if (guard->forces) {
        Problem problem;
        Evaluation *evaluation = &located->evaluation;
        if (!evaluate_equations(&sim->equations, t, y, at.v, at.extra, NULL, evaluation,
                                &problem)) {
            return no_guard(search, problem.text);
        }
        at.e = evaluation->at.e;
        at.found = evaluation;
    } else {
        directions(system, y, located->e);
    }
    return guard->sign * guard->value(&sim->equations, &at, search->contact) + guard->offset;
}

static const char NOT_CONVERGED[] =
    "the search did not converge; check the inputs and parameters";

/* The next point of Brent's search, by inverse interpolation or bisection. */
typedef struct {
    double a, b, other; /* previous point, best point, point of the opposite sign */
    double fa, fb, f_other;
    double step, last;
} Bracket;

static void interpolate_bracket(Bracket *x, double close, double half) {
    if (!(fabs(x->last) >= close && fabs(x->fa) > fabs(x->fb))) {
        x->step = x->last = half;
        return;
    }
    double s = x->fb / x->fa, p, q;
    if (x->a == x->other) { /* secant */
        p = 2.0 * half * s;
        q = 1.0 - s;
    } else { /* inverse quadratic interpolation */
        double u = x->fa / x->f_other, w = x->fb / x->f_other;
        p = s * (2.0 * half * u * (u - w) - (x->b - x->a) * (w - 1.0));
        q = (u - 1.0) * (w - 1.0) * (s - 1.0);
    }
    q = p > 0.0 ? -q : q;
    p = fabs(p);
    bool accepted = 2.0 * p < lesser(3.0 * half * q - fabs(close * q), fabs(x->last * q));
    x->last = accepted ? x->step : half;
    x->step = accepted ? p / q : half;
}

/* Brent's search for the fall of a guard between a, where it is positive, and b, where it is not
 * (R. P. Brent, Algorithms for Minimization without Derivatives, 1973, chapter 4). */
static double locate(const ArcGuard *guard, double a, double b) {
    double fa = guard_at(guard, a);
    if (fa <= 0.0) {
        return a;
    }
    double fb = guard_at(guard, b);
    if (fb > 0.0) {
        return b;
    }
    Bracket x = {a, b, a, fa, fb, fa, b - a, b - a};
    const double tolerance = EVENT_TIME_RTOL * guard->search->sim->state.arc.h;
    int iterations = 0;
    for (; iterations < LOCATION_ITERATIONS_MAX && x.fb != 0.0; iterations++) {
        if ((x.fb > 0.0) == (x.f_other > 0.0)) {
            x.other = x.a;
            x.f_other = x.fa;
            x.step = x.last = x.b - x.a;
        }
        if (fabs(x.f_other) < fabs(x.fb)) {
            x.a = x.b, x.b = x.other, x.other = x.a;
            x.fa = x.fb, x.fb = x.f_other, x.f_other = x.fa;
        }
        double close = 0.5 * tolerance + 4.5e-16 * fabs(x.b);
        double half = 0.5 * (x.other - x.b);
        if (fabs(half) <= close) {
            break;
        }
        interpolate_bracket(&x, close, half);
        x.a = x.b;
        x.fa = x.fb;
        x.b += fabs(x.step) > close ? x.step : (half > 0.0 ? close : -close);
        x.fb = guard_at(guard, x.b);
    }
    if (iterations == LOCATION_ITERATIONS_MAX) {
        (void)no_guard(guard->search, NOT_CONVERGED);
    }
    return x.b;
}

/* Correct the time of an impact, so that the gap of the projected state is zero.  The time is never
 * before the apex: the gap is opening there, so that the impact would have no effect and be located
 * again and again. */
static bool polish_impact(const Search *search, double apex, double *time) {
    Simulation *sim = search->sim;
    int n = system_of(sim)->n, stop = search->contact;
    Located *located = &sim->stepping.located;
    double t = *time, *y = located->y;
    Complex *e = located->e;
    if (t <= sim->state.arc.start) {
        return true;
    }
    located->h = t - sim->state.arc.start;
    located->stop = stop;
    if (!arc_cut(sim, t, located->k, y, search->problem)) {
        return false;
    }
    for (int step = 0; step < EVENT_CORRECTIONS_MAX; step++) {
        arc_located(sim, t, y);
        if (!project(&sim->equations, t, y, sim->scratch, search->problem)) {
            return false;
        }
        directions(system_of(sim), y, e);
        Instant at = {t, y, y + n, extra_states(sim, y), e, NULL};
        double distance = search->guard->value(&sim->equations, &at, stop);
        double speed = search->guard->rate(&sim->equations, &at, stop);
        double change = -distance / speed;
        if (speed >= 0.0 || fabs(distance) <= EVENT_TIME_RTOL * located->h * fabs(speed) ||
            fabs(change) > EVENT_CORRECTION_RTOL * located->h) {
            break; /* Converged, or grazing, where the time by the dense output is better. */
        }
        t = greater(apex, t + change);
    }
    *time = t;
    return true;
}

/* --- samples of the step ---------------------------------------------------------------------- */

static double sample_time(const Simulation *sim, int k) {
    return sim->state.arc.start + sim->state.arc.h * ((double)k / (double)GUARD_INTERVALS);
}

/* The number of states that are computed at a sample: positions, rates and, with compliant stops,
 * all others. */
static int sample_size(const Simulation *sim) {
    bool compliant = system_of(sim)->mechanism->compliant_count > 0;
    return compliant ? state_size(sim) : 2 * system_of(sim)->n;
}

/* Compute states and directions at the samples of the step. */
PRBM void sample_arc(Simulation *sim) {
    const Arc *arc = &sim->state.arc;
    Stepping *stepping = &sim->stepping;
    int size = sample_size(sim), ny = state_size(sim);
    for (int k = 0; k <= GUARD_INTERVALS; k++) {
        double *y = stepping->sample_y + k * size;
        zeros(size, y);
        for (int i = 0; i < STAGES; i++) {
            add_scaled(size, stepping->weights[k][i], arc->k + i * ny, y);
        }
        for (int j = 0; j < size; j++) {
            y[j] = arc->y[j] + arc->h * y[j];
        }
        directions(system_of(sim), y, stepping->sample_e + k * system_of(sim)->d);
    }
}

static Instant sample(const Simulation *sim, int k) {
    int n = system_of(sim)->n;
    const double *y = sim->stepping.sample_y + k * sample_size(sim);
    const Complex *e = sim->stepping.sample_e + k * system_of(sim)->d;
    Instant at = {sample_time(sim, k), y, y + n, extra_states(sim, y), e, NULL};
    return at;
}

/* --- impacts ---------------------------------------------------------------------------------- */

/* Where a gap closes: at a, or between a and b. */
typedef struct {
    double a, b;
    bool at_a;    /* closed at a */
    bool pressed; /* a contact that was released too early is pressed again */
} Closing;

/* Detect whether a gap closes within one interval of the samples.  A gap that is opening at the
 * start of the interval can close only after its apex.  Therefore the last impact, after which the
 * gap is round-off of either sign, is not found again.  The rates show a dip below zero between
 * samples. */
static bool detect_closing(Search *search, const double *gaps, const double *rates, int k,
                           Closing *closing) {
    Simulation *sim = search->sim;
    double round_off = CONSTRAINT_RTOL * system_of(sim)->length;
    double depth = closing_depth(&sim->configuration);
    ArcGuard guard = arc_guard(search), rate = {search, search->guard->rate, false, 1.0, 0.0};
    bool dips = rates[0] < 0.0 && 0.0 < rates[1];
    closing->a = sample_time(sim, k);
    closing->b = sample_time(sim, k + 1);
    closing->at_a = closing->pressed = false;
    if (gaps[1] > 0.0 && !dips) {
        return false;
    }
    if (fabs(rates[0]) <= zero_speed(&sim->configuration) && gaps[0] <= round_off) {
        closing->pressed = true;
        return gaps[1] < lesser(gaps[0] - round_off, -depth);
    }
    if (rates[0] > 0.0) {
        if (rates[1] >= 0.0) {
            return false; /* The gap opens throughout the interval. */
        }
        closing->a = locate(&rate, closing->a, closing->b);
        closing->at_a = guard_at(&guard, closing->a) <= 0.0; /* too short a flight */
        if (closing->at_a) {
            return true;
        }
    } else if (gaps[0] <= 0.0) {
        /* An impact only if the penetration increases, at once or over several intervals. */
        closing->at_a = gaps[1] < gaps[0] - depth;
        closing->pressed = !closing->at_a;
        return closing->at_a || gaps[1] < lesser(gaps[0], -depth);
    }
    if (dips) {
        rate.sign = -1.0;
        closing->b = locate(&rate, closing->a, closing->b);
        return guard_at(&guard, closing->b) <= 0.0;
    }
    return true;
}

static bool locate_closing(Search *search, const Closing *closing, double *time) {
    ArcGuard guard = arc_guard(search);
    if (closing->at_a) {
        *time = closing->a;
        return true;
    }
    if (closing->pressed) {
        guard.offset = closing_depth(&search->sim->configuration);
        *time = locate(&guard, closing->a, closing->b);
        return true;
    }
    *time = locate(&guard, closing->a, closing->b);
    return polish_impact(search, closing->a, time);
}

/* Find the first time within the step at which a gap closes. */
PRBM bool closing_time(Simulation *sim, const Guard *guard, int stop, Fall *fall,
                       Problem *problem) {
    Search search = {sim, guard, stop, false, problem};
    double gaps[GUARD_INTERVALS + 1], rates[GUARD_INTERVALS + 1];
    for (int k = 0; k <= GUARD_INTERVALS; k++) {
        Instant at = sample(sim, k);
        gaps[k] = guard->value(&sim->equations, &at, stop);
        rates[k] = guard->rate(&sim->equations, &at, stop);
    }
    for (int k = 0; !fall->found && k < GUARD_INTERVALS; k++) {
        Closing closing;
        fall->found = detect_closing(&search, gaps + k, rates + k, k, &closing);
        if (fall->found && !locate_closing(&search, &closing, &fall->time)) {
            return false;
        }
    }
    return !search.failed;
}

/* Compute a guard at sample k, projected onto the constraints. */
static bool projected_guard(const Search *search, int k, double *z) {
    Simulation *sim = search->sim;
    Scratch scratch = sim->scratch;
    Instant at = sample(sim, k);
    int n = system_of(sim)->n;
    double *y = take(&scratch, (size_t)state_size(sim));
    Complex *e = take_complex(&scratch, 1, system_of(sim)->d);
    zeros(state_size(sim), y);
    copy(sample_size(sim), at.q, y);
    if (!project(&sim->equations, at.time, y, scratch, search->problem)) {
        return false;
    }
    directions(system_of(sim), y, e);
    Instant projected = {at.time, y, y + n, extra_states(sim, y), e, NULL};
    *z = search->guard->value(&sim->equations, &projected, search->contact);
    return true;
}

/* Find the first time within the step at which a guard falls to zero, from its values at the
 * samples.  If it begins at most at zero_level, only a fall from above the noise counts, or a value
 * below it at the end: that of the start, and what an acceleration of round-off adds in the step.  If
 * projects, a fall counts on projected states only, as the interpolation changes constant lengths. */
static bool fall_in_samples(Simulation *sim, const Guard *guard, int contact, double zero_level,
                            double acceleration, bool projects, Fall *fall, Problem *problem) {
    Search search = {sim, guard, contact, false, problem};
    ArcGuard on_arc = arc_guard(&search);
    double z[GUARD_INTERVALS + 1];
    for (int k = 0; k <= GUARD_INTERVALS; k++) {
        Instant at = sample(sim, k);
        z[k] = guard->value(&sim->equations, &at, contact);
    }
    bool begins = z[0] <= zero_level;
    double residual = lesser(fabs(z[0]), zero_level); /* Until the end of the step is projected. */
    double noise = begins ? residual + acceleration * sim->state.arc.h : 0.0;
    for (int k = begins; !fall->found && k < GUARD_INTERVALS; k++) {
        bool falls = z[k] > noise && z[k + 1] <= 0.0;
        if (falls && projects && !projected_guard(&search, k + 1, &z[k + 1])) {
            return false;
        }
        if (falls && z[k + 1] <= 0.0) {
            fall->found = true;
            fall->time = locate(&on_arc, sample_time(sim, k), sample_time(sim, k + 1));
        }
    }
    if (!fall->found && begins && z[GUARD_INTERVALS] < -noise) {
        fall->found = true;
        fall->time = sample_time(sim, 1);
        if (zero_level > 0.0 && z[0] >= -zero_level) {
            on_arc.offset = 2.0 * zero_level;
            fall->time = locate(&on_arc, sample_time(sim, 0), fall->time);
        }
    }
    return !search.failed;
}

PRBM bool sampled_time(Simulation *sim, const Guard *guard, int contact, Fall *fall,
                       Problem *problem) {
    return fall_in_samples(sim, guard, contact, 0.0, 0.0, true, fall, problem);
}

/* --- friction and releases -------------------------------------------------------------------- */

/* Find the time at which a sliding velocity changes its sign.  When sliding begins, and while
 * contacts that stick hold this one, the velocity is round-off of either sign.  Then it counts only
 * if it exceeds that at the start and what an acceleration of round-off adds within the step: as soon
 * as it is no round-off, or else after the first interval. */
PRBM bool reversal_time(Simulation *sim, const Guard *guard, int contact, Fall *fall,
                        Problem *problem) {
    double zero = zero_speed(&sim->configuration);
    return fall_in_samples(sim, guard, contact, zero, zero_acceleration(&sim->configuration), false,
                           fall, problem);
}

/* Find the time at which a guard falls below -offset, from its values at the start, the middle and
 * the end of the step.  If ignored, a guard that has fallen at the start counts only if it has in the
 * middle, too. */
static bool fall_in_halves(Simulation *sim, const Guard *guard, int contact, double offset,
                           bool ignored, Fall *fall, Problem *problem) {
    Search search = {sim, guard, contact, false, problem};
    ArcGuard on_arc = arc_guard(&search);
    const Arc *arc = &sim->state.arc;
    double times[3] = {arc->start, arc->start + arc->h / 2, arc->start + arc->h};
    on_arc.offset = offset;
    bool begins = ignored && guard_at(&on_arc, times[0]) <= 0.0;
    for (int part = 0; !fall->found && part < 2; part++) {
        double a = times[part], b = times[part + 1];
        if (guard_at(&on_arc, b) <= 0.0) {
            fall->found = true;
            fall->time = begins && part == 0 ? b : locate(&on_arc, a, b);
        }
    }
    return !search.failed;
}

/* Find the time at which a guard falls to zero: at the start if it has fallen there. */
PRBM bool yield_time(Simulation *sim, const Guard *guard, int contact, Fall *fall,
                     Problem *problem) {
    return fall_in_halves(sim, guard, contact, 0.0, false, fall, problem);
}

/* Find the time at which the force of a slipping guide changes its side by more than round-off.  Directly
 * after a change it may be round-off of either sign, which counts only if it persists. */
PRBM bool side_time(Simulation *sim, const Guard *guard, int contact, Fall *fall, Problem *problem) {
    return fall_in_halves(sim, guard, contact, zero_force(&sim->configuration), true, fall, problem);
}

/* Find the time at which the phase of a pressed contact changes. */
PRBM bool switching_time(Simulation *sim, const Guard *guard, int contact, Fall *fall,
                         Problem *problem) {
    const Guard rising = {guard->event, rising_guard, true, NULL};
    bool rises = sim->equations.contacts.touching[contact].phase == PHASE_RISING;
    return yield_time(sim, rises ? &rising : guard, contact, fall, problem);
}

PRBM bool balance_time(Simulation *sim, int stop, double depth, Fall *fall, Problem *problem) {
    const Guard guard = {"balance", indentation_guard, false, NULL};
    const Arc *arc = &sim->state.arc;
    Search search = {sim, &guard, stop, false, problem};
    ArcGuard on_arc = arc_guard(&search);
    double end = arc->start + arc->h;
    on_arc.sign = guard_at(&on_arc, arc->start) > depth ? 1.0 : -1.0;
    on_arc.offset = -on_arc.sign * depth;
    fall->found = guard_at(&on_arc, end) < 0.0;
    fall->time = fall->found ? locate(&on_arc, arc->start, end) : 0.0;
    return !search.failed;
}
