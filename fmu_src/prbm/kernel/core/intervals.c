/* The columns in which the rows of constraints may not be zero. */
#include <string.h>

#include "core/intervals.h"
#include "core/vectors.h"

PRBM RowIntervals place_intervals(const System *system, size_t rows, Memory *memory) {
    const size_t n = (size_t)system->n, d = (size_t)system->d;
    const size_t branches = system->mapped ? (size_t)system->mechanism->step_count : 0;
    RowIntervals result;
    result.coordinates.first = place(memory, rows + 1, sizeof(int));
    result.coordinates.repeats = place(memory, rows, sizeof(bool));
    result.coordinates.list = place(memory, rows * (n / 2 + 1), sizeof(Interval));
    result.directions = result.coordinates;
    if (system->mapped) {
        result.directions.first = place(memory, rows + 1, sizeof(int));
        result.directions.repeats = place(memory, rows, sizeof(bool));
        result.directions.list = place(memory, rows * branches, sizeof(Interval));
    }
    result.used = place(memory, n > d ? n : d, sizeof(bool));
    return result;
}

/* Mark the coordinates in which U^-1 x is not zero, if x is not zero in the marked ones: U_ij x_j
 * is subtracted from x_i for the columns j of row i of U. */
static void mark_eliminated(const System *system, bool *used) {
    int next = system->n;
    for (int i = system->n - 1; i >= 0; i--) {
        used[i] = used[i] || next <= system->factor_rows[i].last;
        next = used[i] ? i : next;
    }
}

/* Append the intervals of the marked columns as those of the row k. */
static void add_intervals(int count, const bool *used, int k, Intervals *result) {
    Interval *interval = result->list + result->first[k];
    int found = 0;
    for (int j = 0; j < count; j += PAIR) {
        if (used[j] || (j + 1 < count && used[j + 1])) {
            const bool next = found == 0 || interval[found - 1].end < j;
            interval[found] = (Interval){j, j, FIXED};
            found += next;
            interval[found - 1].end = j + PAIR;
        }
    }
    result->first[k + 1] = result->first[k] + found;
}

/* Append the branches with marked directions as the intervals of the row k, and mark their
 * coordinates instead.  Two branches may share a pair of columns; it is part of the first one. */
static void add_branches(const System *system, bool *used, int k, Intervals *result) {
    int end = 0, *next = &result->first[k + 1];
    *next = result->first[k];
    for (int b = 0; b < system->branch_count; b++) {
        const Branch *branch = &system->branches[b];
        bool found = false;
        for (int j = branch->start; j < branch->start + branch->size; j++) {
            found = found || used[j];
        }
        if (found) {
            const int start = branch->start - branch->start % PAIR;
            Interval *interval = &result->list[(*next)++];
            interval->branch = b;
            interval->start = start < end ? end : start;
            interval->end = end = even_length(branch->start + branch->size);
        }
    }
    memset(used, 0, (size_t)system->n * sizeof *used);
    for (int s = result->first[k]; s < *next; s++) {
        const Branch *branch = &system->branches[result->list[s].branch];
        for (int c = 0; c < branch->count; c++) {
            used[branch->coordinate[c]] = true;
        }
    }
}

/* Return whether row k has the intervals of the row before it, as the second row of a loop has. */
static bool repeats(const Intervals *intervals, int k) {
    const int *first = intervals->first + k, count = first[1] - first[0];
    const Interval *list = intervals->list + first[0];
    bool same = k > 0 && first[0] - first[-1] == count;
    for (int s = 0; same && s < count; s++) {
        same = list[s].start == list[s - count].start && list[s].end == list[s - count].end;
    }
    return same;
}

/* Give each row one interval, of all columns. */
static void set_whole(int count, int end, Intervals *result) {
    for (int k = 0; k < count; k++) {
        result->first[k + 1] = k + 1;
        result->list[k] = (Interval){0, end, FIXED};
        result->repeats[k] = k > 0;
    }
}

PRBM void set_intervals(const Rows *rows, bool whole, RowIntervals *intervals) {
    const System *system = rows->system;
    bool *used = intervals->used;
    intervals->directions.first[0] = intervals->coordinates.first[0] = 0;
    if (whole) {
        set_whole(rows->count, system->wide, &intervals->directions);
        set_whole(rows->count, system->even, &intervals->coordinates);
        return;
    }
    for (int k = 0; k < rows->count; k++) {
        const Complex *B = rows->B + k * system->d;
        for (int j = 0; j < system->d; j++) {
            Complex arm = B[arm_of(system, j)];
            used[j] = arm.re != 0.0 || arm.im != 0.0 || j == seen_from(rows, k);
        }
        if (system->mapped) {
            add_branches(system, used, k, &intervals->directions);
        }
        mark_eliminated(system, used);
        add_intervals(system->n, used, k, &intervals->coordinates);
        intervals->coordinates.repeats[k] = repeats(&intervals->coordinates, k);
    }
}

PRBM double interval_product(const Intervals *intervals, int k, const double *x, const double *y) {
    Lanes sum[SUMS] = {NO_LANES};
    for (int s = intervals->first[k]; s < intervals->first[k + 1]; s++) {
        for (int j = intervals->list[s].start; j < intervals->list[s].end; j += PAIR) {
            UNROLLED
            for (int l = 0; l < PAIR; l += LANES) {
                sum[SUM_OF(l)] += lanes_at(x + j + l) * lanes_at(y + j + l);
            }
        }
    }
    return total(sum);
}

PRBM double scaled_interval_product(const Intervals *intervals, int k, const double *D,
                                    const double *x, const double *y) {
    Lanes sum[SUMS] = {NO_LANES};
    for (int s = intervals->first[k]; s < intervals->first[k + 1]; s++) {
        for (int j = intervals->list[s].start; j < intervals->list[s].end; j += PAIR) {
            UNROLLED
            for (int l = 0; l < PAIR; l += LANES) {
                Lanes scaled = lanes_at(D + j + l) * lanes_at(x + j + l);
                sum[SUM_OF(l)] += scaled * lanes_at(y + j + l);
            }
        }
    }
    return total(sum);
}

PRBM void convect_intervals(const Intervals *intervals, int k, Parts B, Parts e,
                            const double *squares, double *row,
                            double *convective) {
    Lanes sum[SUMS] = {NO_LANES};
    for (int s = intervals->first[k]; s < intervals->first[k + 1]; s++) {
        for (int j = intervals->list[s].start; j < intervals->list[s].end; j += PAIR) {
            UNROLLED
            for (int l = j; l < j + PAIR; l += LANES) {
                Lanes e_re = lanes_at(e.re + l), e_im = lanes_at(e.im + l);
                Lanes re = lanes_at(B.re + l), im = lanes_at(B.im + l);
                set_lanes(row + l, im * e_re - re * e_im);
                sum[SUM_OF(l)] += (re * e_re + im * e_im) * lanes_at(squares + l);
            }
        }
    }
    *convective = total(sum);
}
