/* Largest stress of flexures so far: the twin of hybrid/peaks.py. */
#include <string.h>

#include "core/sections.h"
#include "core/vectors.h"
#include "hybrid/access.h"
#include "hybrid/peaks.h"

static int peak_count(const Simulation *sim) {
    return sim->configuration.mechanism->stressed_count;
}

static Peak peak_at(const Simulation *sim, int i) {
    Peak peak;
    memcpy(&peak, sim->state.peaks + PEAK_NUMBERS * i, sizeof peak);
    return peak;
}

static void store_peak(Simulation *sim, int i, const Peak *peak) {
    memcpy(sim->state.peaks + PEAK_NUMBERS * i, peak, sizeof *peak);
}

PRBM bool has_peaks(const Simulation *sim) {
    return peak_count(sim) > 0;
}

PRBM void clear_peaks(Simulation *sim) {
    zeros(PEAK_NUMBERS * peak_count(sim), sim->state.peaks);
}

/* Raise the peak to the maximum of the parabola through three samples, if it is between them. */
static void add_vertex(Peak *peak, const Sample *first, const Sample *middle, const Sample *last) {
    bool turns = middle->stress >= first->stress && middle->stress >= last->stress;
    if (!turns || first->place != middle->place || middle->place != last->place) {
        return;
    }
    double step = middle->time - first->time;
    double rise = (middle->stress - first->stress) / step;
    double fall = (last->stress - middle->stress) / (last->time - middle->time);
    double bend = (fall - rise) / (last->time - first->time);
    if (bend < 0.0) {
        double since = 0.5 * step - 0.5 * rise / bend;
        double value = first->stress + since * (rise + bend * (since - step));
        if (value > peak->stress) {
            peak->stress = value;
            peak->time = first->time + since;
            peak->position = last->position;
        }
    }
}

/* Count one more sample of a smooth motion. */
static void add_sample(Peak *peak, const Sample *sample) {
    if (peak->known > 0.0 && sample->time <= peak->last[peak->known >= 2.0].time) {
        peak->known = 0.0; /* An importer has repeated a time. */
    }
    if (sample->stress > peak->stress) {
        peak->stress = sample->stress;
        peak->time = sample->time;
        peak->position = sample->position;
    }
    if (peak->known >= 2.0) {
        add_vertex(peak, &peak->last[0], &peak->last[1], sample);
    }
    if (peak->known >= 1.0) {
        peak->last[0] = peak->known >= 2.0 ? peak->last[1] : peak->last[0];
    }
    peak->last[peak->known >= 1.0] = *sample;
    peak->known = peak->known >= 1.0 ? 2.0 : 1.0;
}

/* Count the sample at the front. */
static void pass_one(Peak *peak) {
    if (peak->ahead != 0.0) {
        peak->ahead = 0.0;
        add_sample(peak, &peak->next);
    }
}

PRBM void pass_peaks(Simulation *sim) {
    for (int i = 0; i < peak_count(sim); i++) {
        Peak peak = peak_at(sim, i);
        pass_one(&peak);
        store_peak(sim, i, &peak);
    }
}

PRBM void drop_peaks(Simulation *sim) {
    for (int i = 0; i < peak_count(sim); i++) {
        Peak peak = peak_at(sim, i);
        peak.ahead = 0.0;
        store_peak(sim, i, &peak);
    }
}

/* Store the samples at the front as those ahead. */
static void sample_front(Simulation *sim, const Evaluation *at) {
    Scratch scratch = sim->scratch;
    const System *system = system_of(sim);
    const double *front = sim->state.front;
    Stress *found = take_stresses(&scratch, peak_count(sim));
    stresses(&sim->equations, at->at.e, front, front + system->n, at, found, scratch);
    for (int i = 0; i < peak_count(sim); i++) {
        Peak peak = peak_at(sim, i);
        const Sample sample = {sim->state.front_time, found[i].largest, found[i].place,
                               found[i].position};
        peak.next = sample;
        peak.ahead = 1.0;
        store_peak(sim, i, &peak);
    }
}

PRBM void restart_peaks_from(Simulation *sim, const Evaluation *at) {
    if (!has_peaks(sim)) {
        return;
    }
    pass_peaks(sim);
    sample_front(sim, at);
    for (int i = 0; i < peak_count(sim); i++) {
        Peak peak = peak_at(sim, i);
        peak.known = 0.0;
        pass_one(&peak);
        store_peak(sim, i, &peak);
    }
}

/* Evaluate the equations at the front. */
static bool evaluate_front(Simulation *sim, Problem *problem) {
    const double *y = sim->state.front;
    return evaluate_equations(&sim->equations, sim->state.front_time, y, y + system_of(sim)->n,
                              extra_states(sim, y), NULL, &sim->at_front, problem);
}

PRBM bool restart_peaks(Simulation *sim, Problem *problem) {
    if (!has_peaks(sim)) {
        return true;
    }
    if (!evaluate_front(sim, problem)) {
        return false;
    }
    restart_peaks_from(sim, &sim->at_front);
    return true;
}

PRBM void step_peaks(Simulation *sim, const Evaluation *at) {
    if (has_peaks(sim)) {
        pass_peaks(sim);
        sample_front(sim, at);
    }
}

PRBM bool step_peaks_to_event(Simulation *sim, Problem *problem) {
    if (!has_peaks(sim)) {
        return true;
    }
    if (!evaluate_front(sim, problem)) {
        return false;
    }
    step_peaks(sim, &sim->at_front);
    return true;
}

/* Raise the peak within a step to the present stress, if it rises to that at the step's end. */
static void rise(Peak *peak, double time, const Stress *now) {
    if (peak->ahead != 0.0 && now->largest > peak->stress &&
        now->largest <= peak->next.stress) {
        peak->stress = now->largest;
        peak->time = time;
        peak->position = now->position;
    }
}

PRBM void peak_outputs(const Simulation *sim, int i, const Stress *now, double *out) {
    Peak peak = peak_at(sim, i);
    if (sim->state.time >= sim->state.front_time) {
        pass_one(&peak);
    }
    rise(&peak, sim->state.time, now);
    out[0] = peak.stress;
    out[1] = peak.time;
    out[2] = peak.position;
}
