"""Numeric functions of the kernel, compared with multiple precision or NumPy; working memory."""

import cmath
import ctypes
import math
import sys

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kernel_library import Kernel, KernelError, compiled, kernel, structures

mpmath.mp.prec = 200


@pytest.fixture
def rng():
    """Return random numbers that do not depend on the order of the tests."""
    return np.random.default_rng(1)


def directions(q, library=None):
    e = np.zeros(len(q), complex)
    (library or kernel()).unit_vectors(len(q), np.asarray(q, float), e)
    return e


def ulp_error(found, exact):
    """Return an error in units of the last place of the exact result."""
    unit = np.spacing(abs(float(exact)))
    return float(abs(mpmath.mpf(float(found)) - exact) / mpmath.mpf(float(unit)))


def largest_ulp_error(function, exact, arguments):
    return max(ulp_error(function(x), exact(mpmath.mpf(float(x)))) for x in arguments)


# --- exp(i q) -----------------------------------------------------------------------------------


def hard_angles(rng):
    """Return angles of all magnitudes up to 1e5, and the doubles next to multiples of pi/4."""
    k = np.concatenate([np.arange(-40, 41), rng.integers(-127_000, 127_000, 500)])
    near = k * (np.pi / 4)
    return np.concatenate(
        [
            rng.uniform(-1.6, 1.6, 2000), rng.uniform(-1e5, 1e5, 1000),
            10.0 ** rng.uniform(-300, 4.9, 500), near, np.nextafter(near, 9e9),
            np.nextafter(near, -9e9), [99999.99999999999, -99999.99999999999],
        ]
    )  # fmt: skip


@pytest.mark.slow
def test_directions_are_within_one_unit_in_the_last_place(rng):
    q = hard_angles(rng)
    for x, z in zip(q, directions(q), strict=True):
        assert ulp_error(z.real, mpmath.cos(mpmath.mpf(float(x)))) < 1.0
        assert ulp_error(z.imag, mpmath.sin(mpmath.mpf(float(x)))) < 1.0


def test_directions_are_exact_at_the_angles_of_straight_models():
    """exp(0) = 1; the cosine of the double next to pi/2 is its difference from pi/2."""
    e = directions([0.0, -0.0, math.pi / 2, math.pi])
    assert e[0] == e[1] == 1.0
    assert e[2] == complex(6.123233995736766e-17, 1.0)
    assert e[3] == complex(-1.0, 1.2246467991473532e-16)


@given(st.lists(st.floats(-1e3, 1e3), min_size=1, max_size=13))
@settings(deadline=None)
def test_a_direction_does_not_depend_on_its_neighbours(q):
    alone = [directions([x])[0] for x in q]
    assert directions(q).tolist() == alone


def test_the_direction_of_a_negative_angle_is_the_conjugate(rng):
    q = hard_angles(rng)
    np.testing.assert_array_equal(directions(-q), directions(q).conj())


@pytest.mark.parametrize("q", [math.nan, math.inf, -math.inf, 1e5, -1e5, 1e300])
def test_the_direction_of_an_invalid_angle_is_nan(q):
    """A motion that diverges is then detected.  The directions of other angles are not affected."""
    e = directions([0.5, q, 0.5])
    assert math.isnan(e[1].real)
    assert math.isnan(e[1].imag)
    assert e[0] == e[2] == directions([0.5])[0]


def sample_bits(library):
    """Return results of all elementary functions as integers, for comparison bit by bit."""
    q = np.random.default_rng(2).uniform(-2e4, 2e4, 4001)
    x = np.exp(q / 40)
    parts = [directions(q, library).view(float), directions(q / 1e4, library).view(float)]
    parts += [
        np.array([function(float(a)) for a in arguments])
        for function, arguments in ((library.natural_log, x), (library.exponential, q / 40))
    ]
    parts.append(np.array([library.power(float(a), -0.2) for a in x]))
    parts.append(np.array([library.phase(complex(math.cos(a), a)) for a in q / 1e4]))
    return np.concatenate(parts).view(np.int64)


COMPILERS = {
    "cc -O0": {"flags": ("-O0",)},
    "cc -O3": {"flags": ("-O3",)},
    "zig cc": {"compiler": (sys.executable, "-m", "ziglang", "cc")},  # clang, with fused products
}


@pytest.mark.slow
@pytest.mark.parametrize(
    "how", ["cc -O0", *(pytest.param(x, marks=pytest.mark.slow) for x in ("cc -O3", "zig cc"))]
)
def test_every_compiler_gives_the_same_bits(how):
    if how == "zig cc":
        pytest.importorskip("ziglang")
    other = Kernel(compiled(**COMPILERS[how]))
    np.testing.assert_array_equal(sample_bits(other), sample_bits(kernel()))


# --- logarithm, exponential, power, phase --------------------------------------------------------


def test_natural_log_is_within_one_unit(rng):
    x = [10.0 ** rng.uniform(-300, 300, 2000), rng.uniform(0.5, 2.0, 4000)]
    x += [1.0 + rng.normal(size=500) * 1e-6, [5e-324, 2.3e-308, 1.7e308, 0.5, 2.0]]
    assert largest_ulp_error(kernel().natural_log, mpmath.log, np.concatenate(x)) < 1.0


def test_exponential_is_within_one_unit(rng):
    x = np.concatenate([rng.uniform(-700, 709, 2000), rng.normal(size=4000)])
    assert largest_ulp_error(kernel().exponential, mpmath.exp, x) < 1.0


def test_limits_of_logarithm_and_exponential_are_exact():
    k = kernel()
    assert k.natural_log(1.0) == 0.0
    assert k.natural_log(0.0) == -math.inf
    assert k.natural_log(math.inf) == math.inf
    assert math.isnan(k.natural_log(-1.0))
    assert math.isnan(k.natural_log(math.nan))
    assert k.exponential(0.0) == k.exponential(-0.0) == 1.0
    assert k.exponential(math.inf) == k.exponential(711.0) == math.inf
    assert k.exponential(-math.inf) == k.exponential(-747.0) == 0.0
    assert k.exponential(-745.0) == 5e-324
    assert math.isnan(k.exponential(math.nan))


def test_power_error_is_bounded_by_the_rounding_of_its_exponent(rng):
    """Relative error <= (1 + |y ln x|) 3e-16, which is 4e-16 for the step size control."""
    for x, y in zip(10.0 ** rng.uniform(-12, 12, 3000), rng.uniform(-2, 2, 3000), strict=True):
        exact = mpmath.mpf(x) ** mpmath.mpf(y)
        error = abs(mpmath.mpf(kernel().power(x, y)) - exact) / exact
        assert error <= (1.0 + abs(y * math.log(x))) * 3e-16
    assert kernel().power(0.0, 0.2) == 0.0
    assert kernel().power(3.0, 0.0) == 1.0


def test_a_power_scales_exactly_with_powers_of_two(rng):
    """Limits of the base and of the exponent included: 0, infinity and large exponents."""
    power = kernel().power
    for x in 10.0 ** rng.uniform(-12, 12, 1000):
        assert power(4.0 * x, 1.5) == 8.0 * power(x, 1.5)
    assert power(2.0, 500.0) == 2.0**500
    assert power(2.0, 1100.0) == power(math.inf, 0.5) == math.inf
    assert power(2.0, -1100.0) == power(math.inf, -0.5) == 0.0
    assert power(math.inf, 0.0) == power(0.0, 0.0) == 1.0
    assert math.isnan(power(-1.0, 0.5))


def test_phase_is_within_two_units_for_vectors_of_any_length(rng):
    angles = np.concatenate([rng.uniform(-np.pi, np.pi, 4000), 10.0 ** rng.uniform(-12, 0, 500)])
    for angle in angles:
        z = cmath.rect(10.0 ** rng.uniform(-3, 3), angle)
        exact = mpmath.atan2(mpmath.mpf(z.imag), mpmath.mpf(z.real))
        assert ulp_error(kernel().phase(z), exact) < 2.0


@pytest.mark.parametrize("z", [1, 1j, -1, -1j, 0, 1 + 1j, 1 - 1j, 3.5, -2e-9j])
def test_phase_is_exact_on_the_axes(z):
    assert kernel().phase(z) == cmath.phase(z)


def test_phase_of_nan_and_infinity_is_nan():
    for z in (math.nan, math.inf, complex(0, math.nan), complex(1, -math.inf)):
        assert math.isnan(kernel().phase(z))


def test_finite_number_is_false_for_nan_and_infinity():
    assert all(kernel().finite_number(x) for x in (0.0, -1e308, 5e-324))
    assert not any(kernel().finite_number(x) for x in (math.inf, -math.inf, math.nan))


@pytest.mark.parametrize("place", [0, 1, 2])
def test_the_largest_entry_fails_every_upper_bound_if_an_entry_is_not_finite(place):
    x = np.array([3.0, -4.0, 2.0])
    assert kernel().largest(3, x) == 4.0
    for bad in (math.nan, math.inf, -math.inf):
        x[place] = bad
        assert not kernel().largest(3, x) <= 1e300
    assert kernel().largest(0, x) == 0.0


def test_greater_and_lesser_return_maximum_and_minimum():
    k = kernel()
    assert (k.greater(1.0, 2.0), k.greater(2.0, 1.0)) == (2.0, 2.0)
    assert (k.lesser(1.0, 2.0), k.lesser(2.0, 1.0)) == (1.0, 1.0)


# --- matrices -------------------------------------------------------------------------------------


def rounding(n, *arrays):
    """Return a bound of the rounding error of n terms, from the largest entries of arrays."""
    size = math.prod(float(np.abs(a).max(initial=0.0)) for a in arrays)
    return 20 * n * 2.2e-16 * size


def factored(a):
    """Return whether a matrix is regular, and its LU factors and pivots."""
    n = len(a)
    lu, pivot = a.copy(), np.zeros(n, np.int32)
    return kernel().lu_factor(n, lu, pivot), lu, pivot


@pytest.mark.parametrize("n", range(1, 13))
def test_residual_of_lu_is_a_rounding_error(n, rng):
    """Some matrices have zeros on the diagonal, like those of a saddle point."""
    for _ in range(40):
        a, b = rng.normal(size=(n, n)) * 10.0 ** rng.uniform(-6, 6), rng.normal(size=n)
        a[np.arange(n) >= (n + 1) // 2 + 1, -1] = 0.0
        regular, lu, pivot = factored(a)
        x = b.copy()
        kernel().lu_solve(n, lu, pivot, x)
        assert regular
        assert np.abs(a @ x - b).max() <= rounding(n, a, x)


def test_lu_rejects_singular_matrices_and_nan():
    assert not factored(np.zeros((3, 3)))[0]
    assert not factored(np.array([[1.0, 2.0], [2.0, 4.0]]))[0]
    for i in range(3):
        a = np.eye(3) + 1.0
        a[i, i] = np.nan
        assert not factored(a)[0]


@pytest.mark.parametrize("n", range(1, 9))
def test_cholesky_factors_and_solves(n, rng):
    """L L^T = M; the upper triangle is not read."""
    for _ in range(40):
        L = np.tril(rng.normal(size=(n, n)))
        np.fill_diagonal(L, rng.uniform(0.5, 2.0, n))
        M = L @ L.T
        a = np.where(np.triu(np.ones((n, n)), 1) > 0, np.nan, M)
        assert kernel().cholesky(n, a)
        found = np.tril(a)
        np.fill_diagonal(found, 1.0 / np.diag(a))
        assert np.abs(found @ found.T - M).max() <= rounding(n, L, L)
        b = rng.normal(size=n)
        x, y = b.copy(), b.copy()
        kernel().forward(n, a, x)
        kernel().backward(n, a, y)
        assert np.abs(found @ x - b).max() <= rounding(n, found, x)
        assert np.abs(found.T @ y - b).max() <= rounding(n, found, y)


def test_cholesky_rejects_matrices_that_are_not_positive_definite():
    for entry in (1.0, 1.1, np.nan):
        assert not kernel().cholesky(2, np.array([[1.0, 0.0], [entry, 1.0]]))
    assert not kernel().cholesky(2, np.array([[0.0, 0.0], [0.0, 1.0]]))


def of_rank(rng, m, n, r):
    """Return a random matrix with r singular values between 0.1 and 10."""
    u, v = (np.linalg.qr(rng.normal(size=(k, k)))[0] for k in (m, n))
    s = np.zeros((m, n))
    s[range(r), range(r)] = 10.0 ** rng.uniform(-1, 1, r)
    return u @ s @ v


SHAPES = [(1, 1), (2, 2), (3, 5), (5, 3), (7, 2), (2, 7), (6, 6), (9, 8)]


@pytest.mark.parametrize(("m", "n"), SHAPES)
def test_least_squares_solution_of_least_norm_equals_that_of_numpy(m, n, rng):
    """The matrices have every rank; right sides are in their range or not."""
    for r in range(min(m, n) + 1):
        for _ in range(8):
            a, b, x = of_rank(rng, m, n, r), rng.normal(size=m), np.full(n, np.nan)
            kernel().least_squares(m, n, a, b, 1e-12, x)
            np.testing.assert_allclose(x, np.linalg.lstsq(a, b, rcond=1e-12)[0], atol=1e-12)


def test_singular_values_below_rcond_are_taken_as_zero(rng):
    u, v = (np.linalg.qr(rng.normal(size=(3, 3)))[0] for _ in range(2))
    a, b = u @ np.diag([1.0, 1e-3, 1e-7]) @ v, rng.normal(size=3)
    for rcond in (1e-9, 1e-5, 1e-2):
        x = np.zeros(3)
        kernel().least_squares(3, 3, a, b, rcond, x)
        exact = np.linalg.lstsq(a, b, rcond=rcond)[0]
        np.testing.assert_allclose(x, exact, rtol=1e-7, atol=1e-12 * np.abs(exact).max())


@pytest.mark.parametrize("n", [1, 2, 3, 5, 8, 13])
def test_eigenvalues_and_vectors_of_symmetric_matrices_equal_those_of_numpy(n, rng):
    """A z = w z with orthonormal z and ascending w, also for multiple and graded eigenvalues w."""
    for kind in range(20):
        a = rng.normal(size=(n, n))
        a = a + a.T
        if kind % 4 == 1:
            a = np.outer(a[0], a[0])  # Zero is a multiple eigenvalue.
        if kind % 4 == 2:
            scale = 10.0 ** rng.uniform(-6, 0, n)
            a = scale[:, None] * a * scale
        if kind % 4 == 3:
            a = np.diag(np.diag(a))
        w, z, alone = np.zeros(n), np.zeros((n, n)), np.zeros(n)
        kernel().symmetric_eigen(n, a.copy(), w, z)
        kernel().symmetric_eigen(n, a.copy(), alone, None)
        np.testing.assert_array_equal(w, alone)
        assert (np.diff(w) >= 0.0).all()
        np.testing.assert_allclose(w, np.linalg.eigvalsh(a), atol=rounding(n, a))
        assert np.abs(z.T @ z - np.eye(n)).max() <= rounding(n)
        assert np.abs(a @ z - z * w).max() <= rounding(n, a)


@pytest.mark.parametrize(("r", "n"), [(0, 1), (0, 4), (1, 2), (2, 3), (2, 7), (6, 7), (3, 9)])
def test_null_space_is_an_orthonormal_basis(r, n, rng):
    for _ in range(20):
        rows, z = of_rank(rng, r, n, r) if r else np.zeros((0, n)), np.zeros((n, n - r))
        kernel().null_space(r, n, rows, z)
        assert np.abs(z.T @ z - np.eye(n - r)).max() <= rounding(n)
        assert np.abs(rows @ z).max(initial=0.0) <= rounding(n, rows)


def test_sums_and_products_of_vectors_equal_those_of_numpy(rng):
    a, b = rng.normal(size=5), np.full(5, np.nan)
    kernel().copy(4, a, b)
    np.testing.assert_array_equal(b[:4], a[:4])
    assert math.isnan(b[4])
    assert kernel().dot(4, a, b) == pytest.approx(a[:4] @ a[:4], rel=1e-15)
    c = a.copy()
    kernel().add_scaled(4, -2.0, b, c)
    np.testing.assert_array_equal(c, [*(a - 2.0 * a)[:4], a[4]])
    kernel().zeros(5, b)
    np.testing.assert_array_equal(b, 0.0)


# --- memory ---------------------------------------------------------------------------------------


def test_placed_arrays_are_aligned_and_do_not_overlap_and_their_size_is_counted_without_memory():
    counting, placing = structures()["Memory"](None, 0), structures()["Memory"](4096, 0)
    ends = 4096
    for count, size in ((3, 1), (1, 8), (0, 8), (5, 8), (2, 24)):
        assert kernel().place(counting, count, size) is None
        start = kernel().place(placing, count, size)
        assert start % 16 == 0
        assert start >= ends
        ends = start + count * size
        assert placing.used == counting.used >= ends - 4096


def test_the_size_of_a_block_larger_than_all_memory_saturates():
    memory = structures()["Memory"](None, 0)
    kernel().place(memory, 2**61, 16)
    assert memory.used == 2**64 - 1
    assert kernel().place(memory, 1, 8) is None
    assert memory.used == 2**64 - 1


def scratch(size, room):
    block, spare = np.zeros(size), np.zeros(room)
    known = structures()["ScratchBlock"](block.ctypes.data, spare.ctypes.data, size, 0, False)
    return structures()["Scratch"](ctypes.addressof(known), 0), known, block, spare


def test_exhausted_working_memory_returns_the_spare_block():
    """Arrays in use are not overwritten, and the required size is recorded."""
    rest, known, block, spare = scratch(10, 8)
    take = kernel().library.take
    take.restype = ctypes.c_void_p
    starts = [take(ctypes.byref(rest), ctypes.c_size_t(count)) for count in (4, 6)]
    assert starts == [block.ctypes.data, block.ctypes.data + 32]
    assert not known.exceeded
    for count in (1, 8):
        assert take(ctypes.byref(rest), ctypes.c_size_t(count)) == spare.ctypes.data
    assert known.exceeded
    assert known.most == 19
    rest.used = 4
    assert take(ctypes.byref(rest), ctypes.c_size_t(6)) == starts[1]
    assert known.most == 19


def test_matrices_complex_numbers_and_integers_are_allocated_in_doubles():
    for name, given_, doubles in (
        ("take_matrix", (3, 4), 12),
        ("take_complex", (3, 4), 24),
        ("take_integers", (5,), 5),
    ):
        rest, known, block, _ = scratch(30, 1)
        function = getattr(kernel().library, name)
        function.restype = ctypes.c_void_p
        assert function(ctypes.byref(rest), *given_) == block.ctypes.data
        assert rest.used == known.most == doubles


def test_a_message_that_is_too_long_is_truncated():
    """The last byte of the buffer remains zero."""
    with pytest.raises(KernelError, match=r"^x = 0.5 m must be positive$"):
        kernel().fail(b"%s = %g m must be positive", b"x", ctypes.c_double(0.5))
    room = structures()["Problem"].text.size
    with pytest.raises(KernelError) as caught:
        kernel().fail(b"%s", b"x" * 2 * room)
    assert str(caught.value) == "x" * (room - 1)
