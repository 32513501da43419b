/* Elementary functions, computed by sums, products and quotients only.  IEEE 754 defines their
 * rounding, so that the results have the same bits on every platform.  Those of C libraries differ.
 *
 * The polynomials of sine and cosine are minimax polynomials on [-pi/4, pi/4], from a Remez
 * exchange in multiple precision; the others are Taylor polynomials.  Source of the argument
 * reduction: W. J. Cody, W. Waite, Software Manual for the Elementary Functions, Prentice-Hall,
 * 1980.
 */
#include <float.h>
#include <math.h>
#include <string.h>

#include "core/numbers.h"
#include "core/vectors.h"

/* --- exp(i q) --------------------------------------------------------------------------------- */

#define LARGEST_ANGLE UINT64_C(0x40f86a0000000000) /* The bits of 1e5 rad. */
#define QUARTERS_PER_RADIAN 0.6366197723675814 /* 2/pi */
/* pi/2 is the sum of three parts.  The first two have 36 bits, so that their multiples by integers
 * up to 2^17 are exact. */
#define QUARTER_HIGH 1.5707963267923333
#define QUARTER_MIDDLE 2.5633441515839558e-12
#define QUARTER_LOW 1.0562999066987428e-23
/* A sum with ROUNDER is rounded to an integer, which is then in the last bits of the sum. */
#define ROUNDER 6755399441055744.0 /* 1.5 2^52 */

/* Return the angle, or NaN (all bits set) if its magnitude is not below LARGEST_ANGLE. */
static Lanes valid_angle(Lanes q) {
    LaneBits magnitude = bits_of(q) & (UINT64_MAX >> 1);
    LaneBits invalid = ((magnitude - LARGEST_ANGLE) >> 63) - UINT64_C(1);
    return from_bits(bits_of(q) | invalid);
}

/* Compute the angle y + rest = q - k pi/2 in [-pi/4, pi/4], and k in the last bits of quarters. */
static void reduce_angle(Lanes q, Lanes *y, Lanes *rest, LaneBits *quarters) {
    Lanes shifted = q * QUARTERS_PER_RADIAN + ROUNDER;
    Lanes k = shifted - ROUNDER;
    Lanes high = q - k * QUARTER_HIGH; /* exact */
    Lanes middle = k * QUARTER_MIDDLE; /* exact */
    *y = high - middle;
    *rest = ((high - *y) - middle) - k * QUARTER_LOW;
    *quarters = bits_of(shifted);
}

/* sin(y + rest) = y + y^3 S(y^2) + rest cos y.  A sum by pairs is faster than Horner's scheme. */
static Lanes sine(Lanes y, Lanes rest) {
    Lanes z = y * y, zz = z * z;
    Lanes low = 0.008333333333322116 * z - 0.1666666666666663;
    Lanes middle = 2.755731362087903e-06 * z - 0.0001984126982958813;
    Lanes high = 1.5896225261958841e-10 * z - 2.505074768089428e-08;
    Lanes S = low + zz * (middle + zz * high);
    return y + (y * z * S + rest * (1.0 - 0.5 * z));
}

/* cos(y + rest) = 1 - y^2/2 + y^4 C(y^2) - y rest; the rounding error of 1 - y^2/2 is corrected. */
static Lanes cosine(Lanes y, Lanes rest) {
    Lanes z = y * y, zz = z * z;
    Lanes half = 0.5 * z;
    Lanes most = 1.0 - half;
    Lanes low = 0.041666666666666595 - 0.0013888888888873054 * z;
    Lanes middle = 2.480158728885014e-05 - 2.755731417883291e-07 * z;
    Lanes high = 2.087570077737947e-09 - 1.1358533099463368e-11 * z;
    Lanes C = low + zz * (middle + zz * high);
    return most + (((1.0 - most) - half) + (zz * C - y * rest));
}

/* Select sine or cosine and the sign by the number of quarter turns, without a branch. */
static void turn_quarters(LaneBits quarters, LaneBits s, LaneBits c, Lanes *re, Lanes *im) {
    LaneBits swap = UINT64_C(0) - (quarters & UINT64_C(1)); /* All bits 1 or all bits 0. */
    LaneBits exchange = (s ^ c) & swap;
    LaneBits s_sign = (quarters & UINT64_C(2)) << 62;
    LaneBits c_sign = ((quarters + UINT64_C(1)) & UINT64_C(2)) << 62;
    *re = from_bits(c ^ exchange ^ c_sign);
    *im = from_bits(s ^ exchange ^ s_sign);
}

static void direction_parts(Lanes q, Lanes *re, Lanes *im) {
    Lanes y, rest;
    LaneBits quarters;
    reduce_angle(valid_angle(q), &y, &rest, &quarters);
    turn_quarters(quarters, bits_of(sine(y, rest)), bits_of(cosine(y, rest)), re, im);
}

static void lane_directions(const double *q, Complex *e) {
    Lanes re, im;
    direction_parts(lanes_at(q), &re, &im);
    set_complex(e, re, im);
}

/* The last group of lanes overlaps the one before it; the overlap is computed twice. */
PRBM void unit_vectors(int n, const double *q, Complex *e) {
    int i = 0;
    for (; i + LANES <= n; i += LANES) {
        lane_directions(q + i, e + i);
    }
    if (i < n && n >= LANES) {
        lane_directions(q + n - LANES, e + n - LANES);
    } else if (i < n) {
        double padded[LANES] = {0.0};
        Complex found[LANES];
        padded[0] = q[0];
        lane_directions(padded, found);
        e[0] = found[0];
    }
}

#define SMALL_TURN_MAX 0.0625 /* rad; up to it, four Taylor terms suffice. */

/* sin d = d - d^3/6 + ..., cos d - 1 = -d^2/2 + ... */
SIZED void small_turn(Lanes d, Lanes *s, Lanes *c_less_1) {
    Lanes z = d * d, zz = z * z;
    Lanes odd = (-1.0 / 6 + z * (1.0 / 120)) + zz * (-1.0 / 5040 + z * (1.0 / 362880));
    Lanes even = (-1.0 / 2 + z * (1.0 / 24)) + zz * (-1.0 / 720 + z * (1.0 / 40320));
    *s = d + d * z * odd;
    *c_less_1 = z * even;
}

/* The directions are e = e_start exp(i (q - start)). */
SHARED bool turned_directions(int even, const double *q, const double *start, Parts e_start,
                              Parts parts, Complex *e) {
    LaneBits near = ~(bits_of(lanes_at(q)) & 0);
    UNROLLED_BY_LANES
    for (int i = 0; i < even; i += LANES) {
        Lanes d = lanes_at(q + i) - lanes_at(start + i), s, c_less_1;
        Lanes re = lanes_at(e_start.re + i), im = lanes_at(e_start.im + i);
        small_turn(d, &s, &c_less_1);
        near &= bits_of(d * d - SMALL_TURN_MAX * SMALL_TURN_MAX); /* Sign bit set if small. */
        Lanes turned_re = re + (re * c_less_1 - im * s), turned_im = im + (im * c_less_1 + re * s);
        set_lanes(parts.re + i, turned_re);
        set_lanes(parts.im + i, turned_im);
        set_complex(e + i, turned_re, turned_im);
    }
    return (LANE(near, 0) & LANE(near, LANES - 1)) >> 63 != 0;
}

/* --- logarithm, exponential ------------------------------------------------------------------- */

#define LN2_HIGH 0.6931471805592082 /* 40 bits */
#define LN2_LOW 7.371002565167799e-13
#define BINARY_DIGITS_PER_E 1.4426950408889634 /* 1/ln 2 */
#define SQUARE_ROOT_OF_HALF 0.7071067811865476
#define EXPONENT_MAX 710.0  /* Above, exp is infinite. */
#define EXPONENT_MIN -746.0 /* Below, exp is zero. */
#define POWER_EXPONENT_MAX 512.0

/* Return c_0 + c_1 z + c_2 z^2 + ... */
static double series(int count, const double *c, double z) {
    double sum = c[count - 1];
    for (int k = count - 2; k >= 0; k--) {
        sum = sum * z + c[k];
    }
    return sum;
}

/* Q(z) = 2/3 + 2 z/5 + 2 z^2/7 ..., |z| < 0.0295 */
static double atanh_series(double z) {
    static const double c[] = {2.0 / 3,  2.0 / 5,  2.0 / 7,  2.0 / 9,  2.0 / 11,
                               2.0 / 13, 2.0 / 15, 2.0 / 17, 2.0 / 19, 2.0 / 21};
    return series(10, c, z);
}

/* Return m of x = 2^k m > 0, between the square roots of 1/2 and of 2, and store k. */
static double mantissa(double x, int *k) {
    double m = frexp(x, k);
    if (m < SQUARE_ROOT_OF_HALF) {
        m *= 2.0;
        *k -= 1;
    }
    return m;
}

/* Return ln(2^k m).  With m = 1 + f and s = f/(2 + f),
   ln(1 + f) = 2 atanh s = f - s (f - s^2 Q(s^2)). */
static double log_of(double m, int k) {
    double f = m - 1.0, s = f / (2.0 + f), z = s * s;
    double correction = s * (f - z * atanh_series(z));
    return k * LN2_HIGH + (f - (correction - k * LN2_LOW));
}

PRBM double natural_log(double x) {
    if (!(x > 0.0) || x > DBL_MAX) {
        return x == 0.0 ? -HUGE_VAL : x < 0.0 ? (double)NAN : x;
    }
    int k;
    double m = mantissa(x, &k);
    return log_of(m, k);
}

/* 1/2! + r/3! + r^2/4! + ..., |r| < 0.35 */
static double exponential_series(double r) {
    static const double c[] = {1.0 / 2,        1.0 / 6,         1.0 / 24,        1.0 / 120,
                               1.0 / 720,      1.0 / 5040,      1.0 / 40320,     1.0 / 362880,
                               1.0 / 3628800,  1.0 / 39916800,  1.0 / 479001600, 1.0 / 6227020800.0,
                               1.0 / 87178291200.0};
    return series(13, c, r);
}

/* Return 2^shift exp x.  With x = k ln 2 + r, exp x = 2^k (1 + r + r^2 (1/2 + ...)). */
static double shifted_exponential(double x, double shift) {
    double k = floor(x * BINARY_DIGITS_PER_E + 0.5);
    double high = x - k * LN2_HIGH; /* exact */
    double r = high - k * LN2_LOW;
    double rest = (high - r) - k * LN2_LOW;
    return ldexp(1.0 + (r + (rest + r * r * exponential_series(r))), (int)(k + shift));
}

PRBM double exponential(double x) {
    if (!(x < EXPONENT_MAX)) {
        return x >= EXPONENT_MAX ? HUGE_VAL : x;
    }
    return x < EXPONENT_MIN ? 0.0 : shifted_exponential(x, 0.0);
}

/* With x = 2^k m, x^y = 2^(k y) m^y: a factor 2^j of x is exactly the factor 2^(j y) of x^y if j y is
   an integer.  The relative error is at most |y ln x| times the rounding error of a double. */
PRBM double power(double x, double y) {
    if (!(x > 0.0) || x > DBL_MAX || !(fabs(y) < POWER_EXPONENT_MAX)) {
        return y == 0.0 ? 1.0 : exponential(y * natural_log(x));
    }
    int k;
    double m = mantissa(x, &k), turns = k * y, whole = floor(turns + 0.5);
    return shifted_exponential(y * log_of(m, 0) + (turns - whole) * (LN2_HIGH + LN2_LOW), whole);
}

/* --- phase ------------------------------------------------------------------------------------ */

#define HALF_TURN_HIGH 3.141592653589793
#define HALF_TURN_LOW 1.2246467991473532e-16
#define QUARTER_TURN_HIGH 1.5707963267948966
#define QUARTER_TURN_LOW 6.123233995736766e-17

/* atan u - u = -u^3/3 + u^5/5 ..., |u| <= 1/8 */
static double atan_series(double u) {
    static const double c[] = {-1.0 / 3, 1.0 / 5,  -1.0 / 7, 1.0 / 9,  -1.0 / 11,
                               1.0 / 13, -1.0 / 15, 1.0 / 17, -1.0 / 19};
    double z = u * u;
    return u * z * series(9, c, z);
}

/* Return the angle atan(y/x) of (x, y) for 0 <= y <= x, x > 0.  It is atan t + atan((y - t x)/(x +
 * t y)), with the multiple t of 1/4 that is nearest to y/x; the values of atan t are tabulated. */
static double first_octant(double x, double y) {
    static const double high[] = {0.0, 0.24497866312686414, 0.4636476090008061,
                                  0.6435011087932844, 0.7853981633974483};
    static const double low[] = {0.0, 1.0698755618734451e-17, 2.2698777452961687e-17,
                                 1.5834785051444286e-17, 3.061616997868383e-17};
    int nearest = (int)floor(4.0 * (y / x) + 0.5);
    double t = 0.25 * nearest;
    double u = (y - t * x) / (x + t * y);
    return high[nearest] + (u + (atan_series(u) + low[nearest]));
}

PRBM double phase(Complex z) {
    double x = fabs(z.re), y = fabs(z.im);
    if (!(x < HUGE_VAL && y < HUGE_VAL)) {
        return (double)NAN;
    }
    double angle;
    if (y <= x) {
        angle = x > 0.0 ? first_octant(x, y) : 0.0;
    } else {
        angle = QUARTER_TURN_HIGH - (first_octant(y, x) - QUARTER_TURN_LOW);
    }
    if (z.re < 0.0) {
        angle = HALF_TURN_HIGH - (angle - HALF_TURN_LOW);
    }
    return z.im < 0.0 ? -angle : angle;
}

/* --- checks ----------------------------------------------------------------------------------- */

PRBM double spacing(double x) {
    int exponent;
    (void)frexp(x, &exponent);
    return x != 0.0 ? ldexp(1.0, exponent - 53) : ldexp(1.0, -1074);
}

PRBM bool finite_number(double x) {
    return x - x == 0.0;
}

PRBM double greater(double a, double b) {
    return a > b ? a : b;
}

PRBM double lesser(double a, double b) {
    return a < b ? a : b;
}

/* The result is NaN if an element is NaN. */
PRBM double largest(int n, const double *x) {
    double top = 0.0;
    for (int i = 0; i < n; i++) {
        double magnitude = fabs(x[i]);
        if (magnitude > top || magnitude != magnitude) {
            top = magnitude;
        }
    }
    return top;
}

/* --- complex numbers -------------------------------------------------------------------------- */

PRBM Complex complex_of(double re, double im) {
    Complex z = {re, im};
    return z;
}

PRBM Complex plus(Complex a, Complex b) {
    return complex_of(a.re + b.re, a.im + b.im);
}

PRBM Complex minus(Complex a, Complex b) {
    return complex_of(a.re - b.re, a.im - b.im);
}

PRBM Complex product(Complex a, Complex b) {
    return complex_of(a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re);
}

PRBM Complex conjugate(Complex a) {
    return complex_of(a.re, -a.im);
}

PRBM Complex scaled(double x, Complex a) {
    return complex_of(x * a.re, x * a.im);
}

PRBM double modulus(Complex a) {
    return square_root(a.re * a.re + a.im * a.im);
}

PRBM Complex unit(double degrees) {
    static const double RADIANS = 0.017453292519943295; /* pi / 180 */
    double quarters = floor(degrees / 90.0), rest = degrees - 90.0 * quarters;
    int quarter = (int)(quarters - 4.0 * floor(quarters / 4.0));
    double angle = rest * RADIANS;
    Complex e = {1.0, 0.0};
    if (rest != 0.0) {
        unit_vectors(1, &angle, &e);
    }
    for (int i = 0; i < quarter; i++) {
        e = complex_of(-e.im, e.re);
    }
    return e;
}

PRBM Parts parts_from(Parts parts, int start) {
    parts.re += start;
    parts.im += start;
    return parts;
}
