/* The plan of a campaign: the variables with their roles and bounds, and the limits. */
#include "driver.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { VARIABLES_MAX = 4096 };
static const double BOUND_FACTOR = 1e4; /* of the scale, where a bound is infinite */
static const double DECADES = 100.0;    /* ratio of bounds beyond which logarithms are drawn */

bool plan_read(Plan *plan, const char *path) {
    FILE *file = fopen(path, "r");
    if (!file) {
        return false;
    }
    plan->variables = calloc(VARIABLES_MAX, sizeof *plan->variables);
    plan->count = 0;
    bool good = plan->variables &&
                fscanf(file, "%lf %lf %lf %lf %lf %lf", &plan->step, &plan->gap_atol,
                       &plan->energy_rtol, &plan->energy_factor, &plan->call_seconds,
                       &plan->process_seconds) == 6;
    while (good && plan->count < VARIABLES_MAX) {
        Variable *v = plan->variables + plan->count;
        int found = fscanf(file, "%u %c %c %c %lf %lf %lf %lf", &v->reference, &v->type, &v->role,
                           &v->tag, &v->start, &v->low, &v->high, &v->scale);
        if (found != 8) {
            good = found == EOF;
            break;
        }
        plan->count++;
    }
    fclose(file);
    return good;
}

uint64_t random_bits(Random *random) {
    uint64_t x = random->state += 0x9E3779B97F4A7C15u;
    x = (x ^ x >> 30) * 0xBF58476D1CE4E5B9u;
    x = (x ^ x >> 27) * 0x94D049BB133111EBu;
    return x ^ x >> 31;
}

unsigned below(Random *random, unsigned count) {
    return (unsigned)(random_bits(random) >> 33) % count;
}

bool chance(Random *random, unsigned count) {
    return below(random, count) == 0;
}

double uniform(Random *random, double low, double high) {
    return low + (high - low) * (double)(random_bits(random) >> 11) * 0x1p-53;
}

static double logarithmic(Random *random, double low, double high) {
    return fmin(fmax(exp(uniform(random, log(low), log(high))), low), high);
}

double drawn_over_bounds(Random *random, const Variable *v) {
    double low = fmax(v->low, -BOUND_FACTOR * v->scale);
    double high = fmin(v->high, BOUND_FACTOR * v->scale);
    if (low > 0.0 && high / low > DECADES) {
        return logarithmic(random, low, high);
    }
    if (high > DECADES * v->scale) { /* The sign, zero, and decades around the scale. */
        double size = logarithmic(random, v->scale / BOUND_FACTOR, high);
        unsigned choice = below(random, 10);
        return choice == 0 && low <= 0.0 ? 0.0 : choice < 5 && -size >= low ? -size : size;
    }
    return uniform(random, low, high);
}
