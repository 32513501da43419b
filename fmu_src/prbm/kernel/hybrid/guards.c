/* Detection and location of events within a step: the twin of hybrid/guards.py. */
#include <math.h>

#include "hybrid/hybrid.h"

/* --- guards ----------------------------------------------------------------------------------- */

PRBM double gap_guard(const Equations *equations, const Instant *at, int contact) {
    return gap(equations, contact, at->time, at->e);
}

static double gap_rate_guard(const Equations *equations, const Instant *at, int contact) {
    return gap_rate(equations, contact, at->time, at->e, at->v);
}

PRBM double release_guard(const Equations *equations, const Instant *at, int contact) {
    return stop_force(equations, at->lam, contact);
}

PRBM double slip_guard(const Equations *equations, const Instant *at, int contact) {
    double friction = fabs(stick_force(equations, at->lam, contact));
    double limit = friction_limit(equations, at->e, at->lam, contact);
    return (1.0 + FRICTION_EXCESS_RTOL) * limit - friction;
}

PRBM double reversal_guard(const Equations *equations, const Instant *at, int contact) {
    int sign = slip_sign(equations->contacts.modes[contact]);
    return sign * sliding_velocity(equations->system, contact, at->e, at->v);
}

/* --- ordering --------------------------------------------------------------------------------- */

static void keep_earlier(Event *first, int kind, int contact, double time) {
    if (first->kind == EVENT_NONE || time < first->time) {
        first->kind = kind;
        first->contact = contact;
        first->time = time;
    }
}

/* --- location --------------------------------------------------------------------------------- */

/* A function of the time within the step: sign * guard + offset. */
typedef struct {
    Simulation *sim;
    Guard *guard;
    const char *event;
    bool forces;
    int contact;
    double sign, offset;
    Problem *problem;
} ArcGuard;

static ArcGuard arc_guard(Simulation *sim, int kind, int contact, Problem *problem) {
    const Transition *row = transition(kind);
    ArcGuard result = {sim, row->guard, row->name, row->forces, contact, 1.0, 0.0, problem};
    return result;
}

/* Fail with the name of the contact at which an event is sought; the value is no event. */
static double no_guard(const ArcGuard *guard, const char *cause) {
    Simulation *sim = guard->sim;
    const Arc *arc = &sim->state.arc;
    if (!sim->stepping.guards_fail) {
        (void)fail(guard->problem, "no %s of %s could be located within %.3g s from t = %.9g s: %s",
                   guard->event, contact_name(sim->configuration.mechanism, guard->contact), arc->h,
                   arc->start, cause);
    }
    sim->stepping.guards_fail = true;
    return 1.0;
}

static double guard_at(const ArcGuard *guard, double t) {
    Simulation *sim = guard->sim;
    const System *system = system_of(sim);
    double *y = sim->stepping.located_y;
    Evaluation *evaluation = &sim->trial.evaluation;
    Instant at = {t, y, y + system->n, sim->stepping.located_e, NULL};
    arc_at(sim, t, y);
    if (guard->forces) {
        Problem problem;
        if (!evaluate_equations(&sim->equations, t, y, y + system->n, NULL, evaluation, &problem)) {
            return no_guard(guard, problem.text);
        }
        at.e = evaluation->at.e;
        at.lam = evaluation->lam;
    } else {
        directions(system, y, sim->stepping.located_e);
    }
    return guard->sign * guard->guard(&sim->equations, &at, guard->contact) + guard->offset;
}

static const char NOT_CONVERGED[] =
    "the search did not converge; check the inputs and parameters";

/* The next point of Brent's search, by inverse interpolation or bisection. */
typedef struct {
    double a, b, other; /* previous point, best point, a point where the sign is another */
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
        double close = 0.5 * EVENT_TIME_ATOL + 4.5e-16 * fabs(x.b);
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
        (void)no_guard(guard, NOT_CONVERGED);
    }
    return x.b;
}

/* Move the time of an impact to the root of the projected state.  Never before the apex: the gap is
 * opening there, the impact would have no effect and be located forever. */
static bool polish_impact(Simulation *sim, int stop, double apex, double *time, Problem *problem) {
    int n = system_of(sim)->n;
    double t = *time, *y = sim->stepping.located_y;
    Complex *e = sim->stepping.located_e;
    for (int step = 0; step < EVENT_CORRECTIONS_MAX; step++) {
        arc_at(sim, t, y);
        if (!project(&sim->equations, t, y, &sim->scratch, problem)) {
            return false;
        }
        directions(system_of(sim), y, e);
        double distance = gap(&sim->equations, stop, t, e);
        double speed = gap_rate(&sim->equations, stop, t, e, y + n);
        double change = -distance / speed;
        if (speed >= 0.0 || fabs(distance) <= EVENT_TIME_ATOL * fabs(speed) ||
            fabs(change) > EVENT_CORRECTION_RTOL * sim->state.arc.h) {
            break; /* grazing: the dense output has the better root */
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

/* Positions, rates and directions at the samples. */
static void sample_arc(Simulation *sim) {
    const Arc *arc = &sim->state.arc;
    Stepping *stepping = &sim->stepping;
    int n = system_of(sim)->n, ny = state_size(sim);
    for (int k = 0; k <= GUARD_INTERVALS; k++) {
        double *y = stepping->sample_y + k * 2 * n;
        zeros(2 * n, y);
        for (int i = 0; i < STAGES; i++) {
            add_scaled(2 * n, stepping->weights[k][i], arc->k + i * ny, y);
        }
        for (int j = 0; j < 2 * n; j++) {
            y[j] = arc->y[j] + arc->h * y[j];
        }
        directions(system_of(sim), y, stepping->sample_e + k * n);
    }
}

static Instant sample(const Simulation *sim, int k) {
    int n = system_of(sim)->n;
    const double *y = sim->stepping.sample_y + k * 2 * n;
    Instant at = {sample_time(sim, k), y, y + n, sim->stepping.sample_e + k * n, NULL};
    return at;
}

/* --- impacts ---------------------------------------------------------------------------------- */

/* How far the arms may move within the step: coordinates change by no more than the dense output
 * can make of the stages, |dE| <= |E| exp(|ds|) (|dtheta| + |ds|). */
static void bound_arms(const Simulation *sim, double *reach) {
    const System *system = system_of(sim);
    furthest(system->n, state_size(sim), sim->state.arc.k, sim->state.arc.h, reach);
    for (int k = 0; k < system->stretch_count; k++) {
        int j = system->stretches[k], a = arm_of(system, j);
        double longest = modulus(sim->stepping.reference.e[a]) * exponential(reach[j]);
        reach[a] = longest * (reach[a] + reach[j]);
    }
}

/* Whether an open stop may be reached within the step: gaps change by no more than the arms do, and
 * by the turn of a body that carries the wall. */
static bool within_reach(Simulation *sim) {
    const System *system = system_of(sim);
    const Arc *arc = &sim->state.arc;
    const Complex *e = sim->stepping.reference.e;
    int n = system->n;
    double near = TOUCHING_RTOL * system->length, *arms = sim->stepping.reach;
    Rows gaps = gap_rows(system);
    bound_arms(sim, arms);
    for (int s = 0; s < system->s; s++) {
        if (watched(&sim->equations, EVENT_IMPACT, s)) {
            const Complex *row = gaps.B + s * n;
            double reach = near + wall_reach(&sim->state.walls[s], arc->h);
            for (int j = 0; j < n; j++) {
                reach += (fabs(row[j].re) + fabs(row[j].im)) * arms[j];
            }
            if (gaps.on[s] != FIXED) {
                reach += modulus(seen_value(&gaps, s, e)) * arms[gaps.on[s]];
            }
            if (!(gap(&sim->equations, s, arc->start, e) > reach)) {
                return true;
            }
        }
    }
    return false;
}

/* Where a gap closes: at a, or between a and b. */
typedef struct {
    double a, b;
    bool at_a;    /* closed at a */
    bool pressed; /* a resting contact that is pressed again */
} Closing;

/* Detect whether a gap closes in one interval of the samples: z > 0 -> z <= 0 at a closing rate.  A
 * gap that is opening at the start of the interval closes only after its apex: so the impact that
 * was resolved last, whose gap is zero up to round-off of either sign, is not found again.  A dip
 * below zero between two samples shows in the rates. */
static bool detect_closing(Simulation *sim, int stop, int k, Closing *closing,
                           Problem *problem) {
    const double *gaps = sim->stepping.sample_gap + k, *rates = sim->stepping.sample_rate + k;
    double length = system_of(sim)->length, near = TOUCHING_RTOL * length;
    ArcGuard guard = arc_guard(sim, EVENT_IMPACT, stop, problem), rate = guard;
    rate.guard = gap_rate_guard;
    bool dips = rates[0] < 0.0 && 0.0 < rates[1];
    closing->a = sample_time(sim, k);
    closing->b = sample_time(sim, k + 1);
    closing->at_a = closing->pressed = false;
    if (gaps[1] > 0.0 && !dips) {
        return false;
    }
    if (fabs(rates[0]) <= zero_speed(&sim->configuration) &&
        fabs(gaps[0]) <= CONSTRAINT_RTOL * length) {
        closing->pressed = true; /* released too early: a little later it is pressed again */
        return gaps[1] < -near;
    }
    if (rates[0] > 0.0) {
        if (rates[1] >= 0.0) {
            return false; /* still opening from zero */
        }
        closing->a = locate(&rate, closing->a, closing->b);
        closing->at_a = guard_at(&guard, closing->a) <= 0.0; /* an unresolved arc */
        if (closing->at_a) {
            return true;
        }
    } else if (gaps[0] <= 0.0) {
        closing->at_a = true; /* else it touches, or opens from a small penetration */
        return gaps[1] < gaps[0] - near;
    }
    if (dips) {
        rate.sign = -1.0;
        closing->b = locate(&rate, closing->a, closing->b);
        return guard_at(&guard, closing->b) <= 0.0;
    }
    return true;
}

static bool locate_closing(Simulation *sim, int stop, const Closing *closing, double *time,
                           Problem *problem) {
    ArcGuard guard = arc_guard(sim, EVENT_IMPACT, stop, problem);
    if (closing->at_a) {
        *time = closing->a;
        return true;
    }
    if (closing->pressed) {
        guard.offset = TOUCHING_RTOL * system_of(sim)->length;
        *time = locate(&guard, closing->a, closing->b);
        return true;
    }
    *time = locate(&guard, closing->a, closing->b);
    return polish_impact(sim, stop, closing->a, time, problem);
}

/* The first impact of a stop within the step. */
static bool find_impact(Simulation *sim, int stop, Event *first, Problem *problem) {
    Stepping *stepping = &sim->stepping;
    for (int k = 0; k <= GUARD_INTERVALS; k++) {
        Instant at = sample(sim, k);
        stepping->sample_gap[k] = gap_guard(&sim->equations, &at, stop);
        stepping->sample_rate[k] = gap_rate_guard(&sim->equations, &at, stop);
    }
    for (int k = 0; k < GUARD_INTERVALS; k++) {
        Closing closing;
        double time;
        if (detect_closing(sim, stop, k, &closing, problem)) {
            if (!locate_closing(sim, stop, &closing, &time, problem)) {
                return false;
            }
            keep_earlier(first, EVENT_IMPACT, stop, time);
            return true;
        }
    }
    return true;
}

/* --- friction and releases -------------------------------------------------------------------- */

/* When a sliding velocity changes its sign.  A contact that begins to slide is at rest up to
 * round-off of either sign: it slides the other way if it does so at the end of the step. */
static void find_reversal(Simulation *sim, int contact, Event *first, Problem *problem) {
    double z[GUARD_INTERVALS + 1];
    ArcGuard guard = arc_guard(sim, EVENT_REVERSAL, contact, problem);
    for (int k = 0; k <= GUARD_INTERVALS; k++) {
        Instant at = sample(sim, k);
        z[k] = guard.guard(&sim->equations, &at, contact);
    }
    bool begins = z[0] <= zero_speed(&sim->configuration);
    for (int k = begins; k < GUARD_INTERVALS; k++) {
        if (z[k] > 0.0 && z[k + 1] <= 0.0) {
            double time = locate(&guard, sample_time(sim, k), sample_time(sim, k + 1));
            keep_earlier(first, EVENT_REVERSAL, contact, time);
            return;
        }
    }
    if (begins && z[GUARD_INTERVALS] < 0.0) {
        keep_earlier(first, EVENT_REVERSAL, contact, sample_time(sim, 1));
    }
}

/* Whether the forces at the stages of the step come near to a release or slip. */
static bool may_yield(const Simulation *sim) {
    const Equations *q = &sim->equations;
    const ForceRange *forces = &sim->stepping.forces;
    if (q->sticking_count > 0) {
        return true;
    }
    for (int k = 0; k < q->held_count; k++) {
        if (forces->least[k] <= RELEASE_WATCH_FACTOR * forces->largest[k]) {
            return true;
        }
    }
    return false;
}

/* When a force is used up, from its guard at the start, the middle and the end of the step. */
static void find_yield(Simulation *sim, int kind, int contact, Event *first,
                       Problem *problem) {
    ArcGuard guard = arc_guard(sim, kind, contact, problem);
    const Arc *arc = &sim->state.arc;
    double times[3] = {arc->start, arc->start + arc->h / 2, arc->start + arc->h};
    double before = guard_at(&guard, times[0]);
    for (int part = 0; part < 2; part++) {
        double after = guard_at(&guard, times[part + 1]);
        if (after <= 0.0) {
            double a = times[part], b = times[part + 1];
            keep_earlier(first, kind, contact, before > 0.0 ? locate(&guard, a, b) : a);
            return;
        }
        before = after;
    }
}

/* --- all -------------------------------------------------------------------------------------- */

static bool find_contact_event(Simulation *sim, int kind, int contact, Event *first,
                               Problem *problem) {
    if (!watched(&sim->equations, kind, contact)) {
        return true;
    }
    switch (kind) {
    case EVENT_IMPACT:
        return find_impact(sim, contact, first, problem) && !sim->stepping.guards_fail;
    case EVENT_REVERSAL: find_reversal(sim, contact, first, problem); break;
    default: find_yield(sim, kind, contact, first, problem); break;
    }
    return !sim->stepping.guards_fail;
}

static bool find_events(Simulation *sim, int kind, Event *first, Problem *problem) {
    bool right = true;
    for (int contact = 0; right && contact < contact_count(sim); contact++) {
        right = find_contact_event(sim, kind, contact, first, problem);
    }
    return right;
}

PRBM bool first_event(Simulation *sim, Event *event, Problem *problem) {
    const Equations *q = &sim->equations;
    Event none = {EVENT_NONE, 0, 0.0};
    bool right = true, open = q->held_count < system_of(sim)->s && within_reach(sim);
    *event = none;
    sim->stepping.guards_fail = false;
    if (open || q->slipping_count > 0) {
        sample_arc(sim);
    }
    if (open) {
        right = find_events(sim, EVENT_IMPACT, event, problem);
    }
    if (right && q->slipping_count > 0) {
        right = find_events(sim, EVENT_REVERSAL, event, problem);
    }
    if (right && may_yield(sim)) {
        right = find_events(sim, EVENT_RELEASE, event, problem) &&
                find_events(sim, EVENT_SLIP, event, problem);
    }
    return right;
}
