/* Complementarity problems of unilateral contacts: Lemke's method, and Coulomb's law in the plane.
 *
 * Sources: as in the twin, mechanics/complementarity.py.
 */
#include <math.h>

#include "core/complementarity.h"
#include "core/matrix.h"

/* --- Lemke's method --------------------------------------------------------------------------- */

/* The tableau.  Its columns belong to w (m), z (m), the covering variable and the constants; basis
 * (m,) contains the variable of each row. */
typedef struct {
    int m, width;
    double *rows;
    int *basis;
} Pivots;

static Pivots first_pivots(int m, const double *M, const double *q, const double *cover,
                           double size, Scratch *scratch) {
    int width = 2 * m + 2;
    Pivots pivots = {m, width, take_matrix(scratch, m, width), take_integers(scratch, m)};
    for (int i = 0; i < m; i++) {
        double *row = pivots.rows + i * width;
        zeros(width, row);
        row[i] = 1.0;
        for (int j = 0; j < m; j++) {
            row[m + j] = -M[i * m + j];
        }
        row[2 * m] = -cover[i];
        row[2 * m + 1] = q[i] / size;
        pivots.basis[i] = i;
    }
    return pivots;
}

/* Pivot on a row and a column, so that the column becomes a unit vector. */
static void pivot_at(Pivots *pivots, int row, int column) {
    int width = pivots->width;
    double *own = pivots->rows + row * width, pivot = own[column];
    for (int j = 0; j < width; j++) {
        own[j] /= pivot;
    }
    for (int i = 0; i < pivots->m; i++) {
        double *other = pivots->rows + i * width, factor = other[column];
        for (int j = 0; i != row && j < width; j++) {
            other[j] -= factor * own[j];
        }
        other[column] = i == row ? 1.0 : 0.0;
    }
}

/* List the rows in which a column is positive; return their number. */
static int falling_rows(const Pivots *pivots, int column, int *rows) {
    double top = 1.0;
    int count = 0;
    for (int i = 0; i < pivots->m; i++) {
        top = greater(top, fabs(pivots->rows[i * pivots->width + column]));
    }
    for (int i = 0; i < pivots->m; i++) {
        if (pivots->rows[i * pivots->width + column] > PIVOT_RTOL * top) {
            rows[count++] = i;
        }
    }
    return count;
}

/* Keep the rows whose ratio row[entry] / row[column] is the least. */
static int least_ratios(const Pivots *pivots, int entry, int column, int count, int *rows) {
    double low = HUGE_VAL;
    int kept = 0;
    for (int pass = 0; pass < 2; pass++) {
        for (int k = 0; k < count; k++) {
            const double *row = pivots->rows + rows[k] * pivots->width;
            double ratio = row[entry] / row[column];
            ratio = entry == 2 * pivots->m + 1 ? greater(ratio, 0.0) : ratio;
            if (pass == 0) {
                low = lesser(low, ratio);
            } else if (ratio <= low + RATIO_RTOL * greater(1.0, fabs(low))) {
                rows[kept++] = rows[k];
            }
        }
    }
    return kept;
}

/* Return the row whose variable falls to zero first, or -1.  Among rows with equal ratios, the row
 * of the covering variable comes first, then the lexicographically least row.  No basis occurs
 * twice. */
static int leaving_row(const Pivots *pivots, int column, int *rows) {
    int m = pivots->m, count = falling_rows(pivots, column, rows);
    if (count > 1) {
        count = least_ratios(pivots, 2 * m + 1, column, count, rows);
        for (int k = 0; k < count; k++) {
            if (pivots->basis[rows[k]] == 2 * m) {
                return rows[k];
            }
        }
    }
    for (int entry = 0; count > 1 && entry < m; entry++) {
        count = least_ratios(pivots, entry, column, count, rows);
    }
    return count > 0 ? rows[0] : -1;
}

static void values_of(const Pivots *pivots, double size, double *z) {
    int m = pivots->m;
    zeros(m, z);
    for (int i = 0; i < m; i++) {
        int variable = pivots->basis[i];
        if (variable >= m && variable < 2 * m) {
            z[variable - m] = size * greater(pivots->rows[i * pivots->width + 2 * m + 1], 0.0);
        }
    }
}

/* Pivot until the covering variable leaves the basis; return false if no row can leave. */
static bool follow_pivots(Pivots *pivots, int row, int *rows) {
    int m = pivots->m, entering = 2 * m;
    for (int step = 0; row >= 0 && step < PIVOTS_FACTOR * m; step++) {
        int leaving = pivots->basis[row];
        pivot_at(pivots, row, entering);
        pivots->basis[row] = entering;
        if (leaving == 2 * m) {
            return true;
        }
        entering = leaving < m ? leaving + m : leaving - m;
        row = leaving_row(pivots, entering, rows);
    }
    return false;
}

PRBM bool lemke(int m, const double *M, const double *q, const double *cover, double *z,
                Scratch scratch) {
    int last = 0, exponent;
    zeros(m, z);
    for (int i = 0; i < m; i++) {
        last = q[i] / cover[i] <= q[last] / cover[last] ? i : last; /* lexicographic order */
    }
    if (m == 0 || q[last] >= 0.0) {
        return true;
    }
    (void)frexp(largest(m, q), &exponent);
    double size = ldexp(1.0, exponent);
    Pivots pivots = first_pivots(m, M, q, cover, size, &scratch);
    bool solved = follow_pivots(&pivots, last, take_integers(&scratch, m));
    if (solved) {
        values_of(&pivots, size, z);
    }
    return solved;
}

/* --- Coulomb's law ---------------------------------------------------------------------------- */

PRBM double limit_of(int k, int size, const CoulombLaws *laws, int j, const double *P) {
    int normal = laws->normal[j], g = normal - k;
    double force = normal < 0 ? 0.0
                   : g < 0    ? P[normal]
                              : fabs(laws->b[g] + dot(size, laws->L + g * size, P));
    return laws->fixed[j] + (normal < 0 ? 0.0 : laws->friction[j] * force);
}

/* Return the index in P = (P_n, P_t) of the a-th force of (P_n, P_t+, P_t-), and set its sign. */
static int force_at(int k, int m, int a, double *sign) {
    *sign = a < k + m ? 1.0 : -1.0;
    return a < k + m ? a : a - m;
}

/* Set the row and the column of the negative part of a normal force that acts in both directions, on
 * which the limit of tangent j depends.  The force counts as positive to the side of its constant
 * part. */
static void set_side(int k, int m, const CoulombLaws *laws, int j, const double *scale, int size,
                     double *M, double *q) {
    int forces = k + 2 * m, g = laws->normal[j] - k, row = forces + j, side = forces + m + g;
    double sign, mu = laws->friction[j], unit = copysign(1.0 / scale[k + j], laws->b[g]);
    for (int a = 0; a < forces; a++) {
        int i = force_at(k, m, a, &sign);
        M[side * size + a] = sign * (laws->L[g * (k + m) + i] * scale[i] * unit);
        M[row * size + a] += mu * M[side * size + a];
    }
    M[side * size + side] = 1.0;
    M[row * size + side] = 2.0 * mu;
    q[side] = laws->b[g] * unit;
    q[row] += mu * q[side];
}

/* Set the scaled problem for z = (P_n, P_t+, P_t-, sliding speeds, negative parts of normal forces that
 * act in both directions), with P_t = P_t+ - P_t-. */
static void set_problem(int k, int m, const double *W, const double *u, const CoulombLaws *laws,
                        const double *scale, double *M, double *q) {
    int forces = k + 2 * m, size = forces + m + laws->sides;
    double sign_a, sign_b;
    zeros(size * size, M);
    for (int a = 0; a < forces; a++) {
        int i = force_at(k, m, a, &sign_a);
        for (int b = 0; b < forces; b++) {
            int j = force_at(k, m, b, &sign_b);
            M[a * size + b] = sign_a * sign_b * (scale[i] * W[i * (k + m) + j] * scale[j]);
        }
        q[a] = sign_a * (scale[i] * u[i]);
    }
    for (int j = 0; j < m; j++) {
        int row = forces + j, positive = k + j, negative = k + m + j;
        M[positive * size + row] = M[negative * size + row] = 1.0;
        M[row * size + positive] = M[row * size + negative] = -1.0;
        q[row] = laws->fixed[j] / scale[k + j];
        if (laws->normal[j] >= k) {
            set_side(k, m, laws, j, scale, size, M, q);
        } else if (laws->normal[j] >= 0) {
            int normal = laws->normal[j];
            M[row * size + normal] = laws->friction[j] * scale[normal] / scale[k + j];
        }
    }
}

PRBM double violation(int k, int m, const double *W, const double *u, const double *P,
                      const double *limit) {
    double worst = 0.0;
    for (int i = 0; i < k + m; i++) {
        double mobility = W[i * (k + m) + i], share = P[i] * mobility;
        double rate = dot(k + m, W + i * (k + m), P) + u[i];
        if (i < k) {
            worst = greater(fabs(lesser(rate, share)), worst);
        } else {
            double most = limit[i - k] * mobility;
            /* A contact that slides needs friction at the limit, opposite to the velocity. */
            double missing = rate == 0.0 ? most : most + (rate > 0.0 ? share : -share);
            worst = greater(fabs(share) - most, worst);
            worst = greater(lesser(fabs(rate), fabs(missing)), worst);
        }
    }
    return worst;
}

/* Whether a contact closes without forces. */
static bool closes(double rate, double tolerance) {
    return !(rate >= -tolerance);
}

/* Leave the contacts that do not close without forces out of a problem. */
static void leave_out(int k, int size, const double *u, double tolerance, double *M, double *q) {
    for (int i = 0; i < k; i++) {
        if (closes(u[i], tolerance)) {
            continue;
        }
        q[i] = greater(q[i], 0.0);
        for (int j = 0; j < size; j++) {
            M[i * size + j] = M[j * size + i] = 0.0;
        }
    }
}

/* Follow the path of one covering vector to forces P; false if it ends in a ray. */
static bool follow_path(int k, int m, int size, const double *M, const double *q, int heavy,
                        const double *scale, double *P, Scratch scratch) {
    double *z = take(&scratch, (size_t)size), *cover = take(&scratch, (size_t)size);
    for (int i = 0; i < size; i++) {
        cover[i] = i == heavy ? COVER_FACTOR : 1.0;
    }
    bool solved = lemke(size, M, q, cover, z, scratch);
    for (int i = 0; solved && i < k + m; i++) {
        P[i] = scale[i] * (i < k ? z[i] : z[i] - z[i + m]);
    }
    return solved;
}

/* Compute scales of the forces by their own mobilities, with which W has a unit diagonal. */
static void force_scales(int size, const double *W, double *scale) {
    for (int i = 0; i < size; i++) {
        double mobility = fabs(W[i * size + i]);
        scale[i] = mobility > 0.0 ? 1.0 / square_root(mobility) : 1.0;
    }
}

/* Set the equations of a combination of modes, scaled: a normal is open (0) or closed (1), a tangent
 * sticks (0) or has a friction force of either sign (1, 2). */
static void set_modes(int k, int m, const double *W, const double *u, const CoulombLaws *laws,
                      const double *scale, int modes, double *A, double *right) {
    int size = k + m;
    zeros(size * size, A);
    zeros(size, right);
    for (int i = 0; i < size; i++) {
        int choices = i < k ? 2 : 3, mode = modes % choices;
        double *row = A + i * size;
        modes /= choices;
        if (mode == (i < k ? 1 : 0)) {
            for (int j = 0; j < size; j++) {
                row[j] = scale[i] * W[i * size + j] * scale[j];
            }
            right[i] = -scale[i] * u[i];
            continue;
        }
        row[i] = 1.0;
        if (i >= k) {
            int normal = laws->normal[i - k], g = normal - k;
            double sign = 3 - 2 * mode, share = sign * (laws->friction[i - k] / scale[i]);
            right[i] = -sign * (laws->fixed[i - k] / scale[i]);
            if (normal >= 0 && normal < k) {
                row[normal] += share * scale[normal];
            }
            for (int j = 0; g >= 0 && j < size; j++) {
                row[j] += share * laws->L[g * size + j] * scale[j];
            }
            right[i] -= g >= 0 ? share * laws->b[g] : 0.0;
        }
    }
}

PRBM bool in_any_modes(int k, int m, const double *W, const double *u, const CoulombLaws *laws,
                       double tolerance, double *P, Scratch scratch) {
    int size = k + m, *pivot = take_integers(&scratch, size);
    double *A = take_matrix(&scratch, size, size), *limit = take(&scratch, (size_t)m);
    double *scale = take(&scratch, (size_t)size);
    bool solved = false;
    int count = 1;
    for (int i = 0; i < size && count <= MODES_TRIED_MAX; i++) {
        count *= i < k ? 2 : 3;
    }
    force_scales(size, W, scale);
    for (int modes = 0; !solved && count <= MODES_TRIED_MAX && modes < count; modes++) {
        set_modes(k, m, W, u, laws, scale, modes, A, P);
        if (!lu_factor(size, A, pivot)) {
            continue;
        }
        lu_solve(size, A, pivot, P);
        bool finite = true;
        for (int i = 0; i < size; i++) {
            P[i] *= scale[i];
            finite = finite && finite_number(P[i]);
        }
        for (int j = 0; finite && j < m; j++) {
            limit[j] = limit_of(k, size, laws, j, P);
        }
        solved = finite && violation(k, m, W, u, P, limit) <= tolerance;
    }
    return solved;
}

PRBM bool coulomb(int k, int m, const double *W, const double *u, const CoulombLaws *laws,
                  double tolerance, double *P, Scratch scratch) {
    int size = k + 3 * m + laws->sides;
    double *scale = take(&scratch, (size_t)(k + m)), *M = take_matrix(&scratch, size, size);
    double *q = take(&scratch, (size_t)size), *limit = take(&scratch, (size_t)m);
    double *rates = take(&scratch, (size_t)(k + m)); /* without round-off */
    bool solved = false;
    /* Guides that lock each other may need a path that begins at another unknown than a normal
     * force. */
    int heaviest = laws->sides > 0 ? size : k;
    int first = 1; /* The first attempt leaves contacts out, if there are any. */
    for (int i = 0; i < k; i++) {
        first = closes(u[i], tolerance) ? first : 0;
    }
    for (int i = 0; i < k + m; i++) {
        rates[i] = fabs(u[i]) <= tolerance / 2 ? 0.0 : u[i];
    }
    force_scales(k + m, W, scale);
    for (int attempt = first; !solved && attempt < 3; attempt++) {
        set_problem(k, m, W, rates, laws, scale, M, q);
        if (attempt == 0) {
            leave_out(k, size, rates, tolerance, M, q);
        }
        /* If only round-off excludes a solution: normal rates larger by half of the tolerance. */
        for (int i = 0; attempt == 2 && i < k; i++) {
            q[i] += scale[i] * (tolerance / 2);
        }
        for (int heavy = -1; !solved && heavy < heaviest; heavy++) {
            solved = follow_path(k, m, size, M, q, heavy, scale, P, scratch);
            for (int j = 0; solved && j < m; j++) {
                limit[j] = limit_of(k, k + m, laws, j, P);
            }
            solved = solved && violation(k, m, W, u, P, limit) <= tolerance;
        }
    }
    return solved || (laws->sides > 0 && in_any_modes(k, m, W, u, laws, tolerance, P, scratch));
}

/* --- impacts ---------------------------------------------------------------------------------- */

PRBM bool impulses(int k, int m, const double *W, const double *u, const double *friction,
                   const double *least, double tolerance, double *P, Scratch scratch) {
    double *given = take(&scratch, (size_t)(k + m)), *fixed = take(&scratch, (size_t)m);
    int *normal = take_integers(&scratch, m);
    for (int i = 0; i < k + m; i++) {
        given[i] = u[i] + dot(k, W + i * (k + m), least);
    }
    for (int j = 0; j < m; j++) {
        fixed[j] = friction[j] * least[j];
        normal[j] = j;
    }
    CoulombLaws laws = {friction, fixed, normal, 0, NULL, NULL};
    bool solved = coulomb(k, m, W, given, &laws, tolerance, P, scratch);
    for (int i = 0; solved && i < k; i++) {
        P[i] += least[i];
    }
    return solved;
}
