/* Linear algebra for small dense matrices.
 *
 * Sources: G. H. Golub, C. F. Van Loan, Matrix Computations, Johns Hopkins, 2013: LU 3.4, Cholesky
 * 4.2, Householder 5.1, Jacobi's eigenvalues 8.5, one-sided Jacobi 8.6.
 */
#include <float.h>
#include <math.h>

#include "core/matrix.h"
#include "core/vectors.h"

PRBM double dot(int n, const double *a, const double *b) {
    double sum = 0.0;
    for (int i = 0; i < n; i++) {
        sum += a[i] * b[i];
    }
    return sum;
}

/* Return the dot product of vectors of even length. */
PRBM double even_dot(int even, const double *a, const double *b) {
    Lanes sum[SUMS] = {NO_LANES};
    for (int i = 0; i < even; i += LANES) {
        sum[SUM_OF(i)] += lanes_at(a + i) * lanes_at(b + i);
    }
    return total(sum);
}

PRBM void zeros(int n, double *x) {
    for (int i = 0; i < n; i++) {
        x[i] = 0.0;
    }
}

PRBM void copy(int n, const double *from, double *to) {
    int i = 0;
    for (; i + LANES <= n; i += LANES) {
        set_lanes(to + i, lanes_at(from + i));
    }
    if (i < n) {
        to[i] = from[i];
    }
}

/* y += a x */
PRBM void add_scaled(int n, double a, const double *RESTRICT x, double *RESTRICT y) {
    const int paired = a != 0.0 ? n - n % PAIR : 0;
    for (int i = 0; i < paired; i += LANES) {
        set_lanes(y + i, lanes_at(y + i) + a * lanes_at(x + i));
    }
    if (a != 0.0 && paired < n) {
        y[paired] += a * x[paired];
    }
}

/* --- LU --------------------------------------------------------------------------------------- */

static int largest_below(int n, const double *a, int k) {
    int best = k;
    for (int i = k + 1; i < n; i++) {
        if (fabs(a[i * n + k]) > fabs(a[best * n + k])) {
            best = i;
        }
    }
    return best;
}

PRBM void exchange(int n, double *a, double *b) {
    for (int i = 0; i < n; i++) {
        double keep = a[i];
        a[i] = b[i];
        b[i] = keep;
    }
}

/* The diagonal of U is stored inverted, for lu_solve. */
PRBM bool lu_factor(int n, double *a, int *pivot) {
    double least = HUGE_VAL, most = 0.0;
    for (int k = 0; k < n; k++) {
        double *row = a + k * n;
        pivot[k] = largest_below(n, a, k);
        if (pivot[k] != k) {
            exchange(n, row, a + pivot[k] * n);
        }
        least = lesser(least, fabs(row[k]));
        most = greater(most, fabs(row[k]));
        if (!(least > SINGULAR_RTOL * most)) {
            return false;
        }
        row[k] = 1.0 / row[k];
        for (int i = k + 1; i < n; i++) {
            double *other = a + i * n;
            double factor = other[k] *= row[k];
            for (int j = k + 1; j < n; j++) {
                other[j] -= factor * row[j];
            }
        }
    }
    return true;
}

PRBM void lu_solve(int n, const double *a, const int *pivot, double *b) {
    for (int k = 0; k < n; k++) {
        double keep = b[k];
        b[k] = b[pivot[k]];
        b[pivot[k]] = keep;
    }
    for (int i = 1; i < n; i++) {
        b[i] -= dot(i, a + i * n, b);
    }
    for (int i = n - 1; i >= 0; i--) {
        b[i] = (b[i] - dot(n - 1 - i, a + i * n + i + 1, b + i + 1)) * a[i * n + i];
    }
}

/* --- Cholesky --------------------------------------------------------------------------------- */

/* For k < j: L_ij = (a_ij - sum_k L_ik L_jk)/L_jj, L_jj^2 = a_jj - sum_k L_jk^2. */
PRBM bool cholesky(int n, double *a) {
    for (int i = 0; i < n; i++) {
        double *row = a + i * n;
        for (int j = 0; j < i; j++) {
            row[j] = (row[j] - dot(j, row, a + j * n)) * a[j * n + j];
        }
        double square = row[i] - dot(i, row, row);
        if (!(square > SINGULAR_RTOL * row[i])) {
            return false;
        }
        row[i] = 1.0 / square_root(square);
    }
    return true;
}

PRBM void forward(int n, const double *a, double *b) {
    for (int i = 0; i < n; i++) {
        b[i] = (b[i] - dot(i, a + i * n, b)) * a[i * n + i];
    }
}

PRBM void backward(int n, const double *a, double *b) {
    for (int i = n - 1; i >= 0; i--) {
        b[i] *= a[i * n + i];
        add_scaled(i, -b[i], a + i * n, b);
    }
}

/* --- singular values -------------------------------------------------------------------------- */

/* Compute the rotation p := c p - s q, q := s p + c q that makes [[pp, pq], [pq, qq]] diagonal.  Of
 * its two solutions the smaller angle is chosen. */
static void small_rotation(double pp, double pq, double qq, double *c, double *s) {
    double slope = (qq - pp) / (2.0 * pq);
    double t = (slope >= 0.0 ? 1.0 : -1.0) / (fabs(slope) + square_root(1.0 + slope * slope));
    *c = 1.0 / square_root(1.0 + t * t);
    *s = t * *c;
}

static void rotate(int n, double c, double s, double *p, double *q, int stride) {
    for (int i = 0; i < n * stride; i += stride) {
        double keep = p[i];
        p[i] = c * keep - s * q[i];
        q[i] = s * keep + c * q[i];
    }
}

/* One-sided Jacobi method: rotate the rows of g (k, n) until they are orthogonal; their norms are
 * then the singular values.  The rows of v (k, k), unless NULL, are rotated with them.  Rows
 * shorter than the round-off of the longest count as orthogonal.  Return false without convergence,
 * or if a number is not finite. */
static bool orthogonalise(int k, int n, double *g, double *v) {
    double noise = DBL_EPSILON * largest(k * n, g);
    bool turned = finite_number(noise);
    for (int sweep = 0; turned && sweep < ROTATION_SWEEPS_MAX; ++sweep) {
        turned = false;
        for (int i = 0; i < k; i++) {
            for (int j = i + 1; j < k; j++) {
                double *p = g + i * n, *q = g + j * n;
                double pp = dot(n, p, p), pq = dot(n, p, q), qq = dot(n, q, q);
                bool small = pp <= noise * noise || qq <= noise * noise;
                if (small || !(fabs(pq) > n * DBL_EPSILON * square_root(pp) * square_root(qq))) {
                    continue;
                }
                double c, s;
                small_rotation(pp, pq, qq, &c, &s);
                rotate(n, c, s, p, q, 1);
                if (v != NULL) {
                    rotate(k, c, s, v + i * k, v + j * k, 1);
                }
                turned = true;
            }
        }
    }
    return !turned && finite_number(noise);
}

static void identity(int n, double *a) {
    for (int i = 0; i < n * n; i++) {
        a[i] = i % (n + 1) == 0 ? 1.0 : 0.0;
    }
}

/* Set g to a or its transpose, so that it has no more rows than columns. */
static void wide(int m, int n, const double *a, double *g) {
    for (int i = 0; i < m; i++) {
        for (int j = 0; j < n; j++) {
            g[m <= n ? i * n + j : j * m + i] = a[i * n + j];
        }
    }
}

static double norm(int n, const double *x) {
    return square_root(dot(n, x, x));
}

/* Compute the singular values s (k,), k = min(m, n), of a = sum s_i v_i u_i^T.  If m > n, a^T
 * replaces a.  Row i of g is s_i u_i, and row i of v (k, k), unless NULL, is v_i. */
static bool singular_values(int m, int n, const double *a, double *s, double *g, double *v) {
    int k = m < n ? m : n, length = m < n ? n : m;
    wide(m, n, a, g);
    if (v != NULL) {
        identity(k, v);
    }
    bool found = orthogonalise(k, length, g, v);
    for (int i = 0; i < k; i++) {
        s[i] = norm(length, g + i * length);
    }
    return found;
}

/* x is the sum of (left_i . b) right_i/s_i^2 over the singular values s_i above the limit.  One of
 * left_i and right_i has the norm s_i, the other the norm 1. */
PRBM bool least_squares(int m, int n, const double *a, const double *b, double rcond, double *x,
                        Scratch scratch, Problem *problem) {
    int k = m < n ? m : n;
    double *s = take(&scratch, (size_t)k), *v = take_matrix(&scratch, k, k);
    double *g = take_matrix(&scratch, m, n);
    bool found = singular_values(m, n, a, s, g, v);
    const double *left = m <= n ? v : g, *right = m <= n ? g : v;
    double least = rcond * largest(k, s);
    zeros(n, x);
    for (int i = 0; i < k; i++) {
        if (s[i] > least) {
            double share = dot(m, left + i * m, b) / s[i] / s[i];
            for (int j = 0; j < n; j++) {
                x[j] += share * right[i * n + j];
            }
        }
    }
    return found || fail(problem, "a least-squares solution did not converge: a mass, a length or "
                                  "an input is too large or too small; check the parameters");
}

/* --- eigenvalues ------------------------------------------------------------------------------ */

/* Rotate rows and columns p and q of a so that a_pq = 0. */
static void jacobi_rotation(int n, double *a, double *z, int p, int q) {
    double c, s;
    small_rotation(a[p * n + p], a[p * n + q], a[q * n + q], &c, &s);
    rotate(n, c, s, a + p * n, a + q * n, 1);
    rotate(n, c, s, a + p, a + q, n);
    a[p * n + q] = a[q * n + p] = 0.0;
    if (z != NULL) {
        rotate(n, c, s, z + p, z + q, n);
    }
}

/* Rotate until a is diagonal.  Return false without convergence, or if a number is not finite. */
static bool jacobi_sweeps(int n, double *a, double *z) {
    double negligible = 0.5 * DBL_EPSILON * DBL_EPSILON * largest(n * n, a);
    bool turned = finite_number(negligible);
    for (int sweep = 0; turned && sweep < ROTATION_SWEEPS_MAX; ++sweep) {
        turned = false;
        for (int p = 0; p < n; p++) {
            for (int q = p + 1; q < n; q++) {
                double size = square_root(fabs(a[p * n + p])) * square_root(fabs(a[q * n + q]));
                if (fabs(a[p * n + q]) > 0.25 * DBL_EPSILON * size + negligible) {
                    jacobi_rotation(n, a, z, p, q);
                    turned = true;
                }
            }
        }
    }
    return !turned && finite_number(negligible);
}

/* Sort the eigenvalues, and the columns of z with them, in ascending order. */
static void sort_eigen(int n, double *w, double *z) {
    for (int i = 0; i < n; i++) {
        int least = i;
        for (int j = i + 1; j < n; j++) {
            least = w[j] < w[least] ? j : least;
        }
        double keep = w[i];
        w[i] = w[least];
        w[least] = keep;
        for (int k = 0; z != NULL && k < n; k++) {
            keep = z[k * n + i];
            z[k * n + i] = z[k * n + least];
            z[k * n + least] = keep;
        }
    }
}

PRBM bool symmetric_eigen(int n, double *a, double *w, double *z, Problem *problem) {
    if (z != NULL) {
        identity(n, z);
    }
    if (!jacobi_sweeps(n, a, z)) {
        return fail(problem, "the eigenvalues of a matrix did not converge: a mass, a stiffness or "
                             "a length is too large or too small; check the parameters");
    }
    for (int i = 0; i < n; i++) {
        w[i] = a[i * n + i];
    }
    sort_eigen(n, w, z);
    return true;
}

/* --- null space ------------------------------------------------------------------------------- */

/* Replace x by the vector u whose Householder reflection 1 - u u^T maps x to a multiple of the
 * first unit vector. */
static void householder(int n, double *x) {
    double length = norm(n, x);
    if (!(length > 0.0)) {
        return;
    }
    for (int i = 0; i < n; i++) {
        x[i] /= length;
    }
    x[0] += x[0] >= 0.0 ? 1.0 : -1.0;
    double scale = 1.0 / square_root(fabs(x[0])); /* |x|^2 = 2 |x_0| */
    for (int i = 0; i < n; i++) {
        x[i] *= scale;
    }
}

static void reflect(int n, const double *u, double *x) {
    double share = dot(n, u, x);
    for (int i = 0; i < n; i++) {
        x[i] -= share * u[i];
    }
}

/* The basis is the last columns of the orthogonal factor of rows^T. */
PRBM void null_space(int r, int n, const double *rows, double *z, Scratch scratch) {
    double *u = take_matrix(&scratch, r, n), *column = take(&scratch, (size_t)n);
    copy(r * n, rows, u);
    for (int i = 0; i < r; i++) {
        householder(n - i, u + i * n + i);
        for (int k = i + 1; k < r; k++) {
            reflect(n - i, u + i * n + i, u + k * n + i);
        }
    }
    for (int j = r; j < n; j++) {
        for (int i = 0; i < n; i++) {
            column[i] = i == j ? 1.0 : 0.0;
        }
        for (int i = r - 1; i >= 0; i--) {
            reflect(n - i, u + i * n + i, column + i);
        }
        for (int i = 0; i < n; i++) {
            z[i * (n - r) + j - r] = column[i];
        }
    }
}
