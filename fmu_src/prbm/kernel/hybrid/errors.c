/* Errors and sizes of integration steps. */
#include <math.h>

#include "core/vectors.h"
#include "hybrid/access.h"
#include "hybrid/errors.h"

PRBM double error_norm(const Simulation *sim, const double *x, const double *y,
                       const double *y1) {
    const double *least = sim->configuration.least, *share = sim->configuration.share;
    int ny = state_size(sim);
    Lanes sum[SUMS] = {NO_LANES};
    for (int j = 0; j < ny; j += LANES) {
        Lanes size = larger(magnitudes(lanes_at(y + j)), magnitudes(lanes_at(y1 + j)));
        Lanes ratio = lanes_at(x + j) / larger(lanes_at(least + j), lanes_at(share + j) * size);
        sum[SUM_OF(j)] += ratio * ratio;
    }
    return square_root(total(sum) / sim->configuration.controlled);
}

PRBM double longest_step(const Simulation *sim) {
    return STEP_MAX_RTOL * sim->configuration.scales.time;
}

/* A step size rounded to four binary digits, so that round-off in the errors does not change it. */
PRBM double rounded_step(double h) {
    double shifted = STEP_ROUNDING_FACTOR * h;
    return shifted - (shifted - h);
}

PRBM double embedded_error(Simulation *sim) {
    Stepping *stepping = &sim->stepping;
    const Arc *arc = &sim->state.arc;
    if (stepping->embedded_error < 0.0) {
        fine_error_of(state_size(sim), arc->k, arc->h, stepping->error);
        stepping->embedded_error = error_norm(sim, stepping->error, arc->y, arc->y);
    }
    return stepping->embedded_error;
}

PRBM double difference(Simulation *sim, const double *y, const double *z, Scratch scratch) {
    int ny = state_size(sim);
    double *change = take(&scratch, (size_t)ny);
    for (int j = 0; j < ny; j += LANES) {
        set_lanes(change + j, lanes_at(z + j) - lanes_at(y + j));
    }
    double size = error_norm(sim, change, y, z);
    return size;
}

PRBM bool check_projection(Simulation *sim, double t, const double *y, const double *projected,
                           Scratch scratch, Problem *problem) {
    double size = difference(sim, y, projected, scratch);
    double most = PROJECTION_FACTOR * square_root(sim->state.tolerance);
    if (!(size <= most)) {
        return fail(problem,
                    "at t = %.9g s closing the loops would change the motion by %.3g of its size, "
                    "more than %.3g: links of a loop form a straight line, where the motion is not "
                    "unique; change the inputs, the stops or the release so that the mechanism "
                    "does not pass this shape",
                    t, size, most);
    }
    return true;
}

PRBM double contact_error(Simulation *sim, double h) {
    Scratch scratch = sim->scratch;
    const System *system = system_of(sim);
    const Stepping *stepping = &sim->stepping;
    const double *y = sim->state.arc.y, *y1 = stepping->end;
    int n = system->n;
    double worst = 0.0, *row = take(&scratch, (size_t)n);
    double *change = take(&scratch, (size_t)n);
    Complex *e = directions_at(sim, y, &scratch);
    Rows gaps = gap_rows(system);
    for (int j = 0; j < n; j++) {
        change[j] = y1[j] - y[j];
    }
    for (int k = 0; k < sim->equations.pressed_count; k++) {
        int i = sim->equations.pressed[k];
        double speed = sim->equations.contacts.touching[i].reference_speed;
        row_jacobian(&gaps, i, e, row);
        double depth = greater(greater(fabs(dot(n, row, change)), speed * h),
                               INDENTATION_MIN_RTOL * system->length);
        double squares[2];
        int recoil = system->mechanism->first_extra + stop_of(sim, i)->extra + EXTRA_RECOIL;
        for (int part = 0; part < 2; part++) {
            const double *error = part == 0 ? stepping->error : stepping->coarse_error;
            double d = (dot(n, row, error) + error[recoil]) / depth;
            double rate = (dot(n, row, error + n) + error[recoil + 1]) / speed;
            squares[part] = d * d + rate * rate;
        }
        double size = square_root(squares[0] + squares[1]);
        worst = greater(worst, size > 0.0 ? squares[0] / size : size);
    }
    return worst;
}
