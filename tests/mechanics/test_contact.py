"""Impacts in contact space: Newton for several stops, Routh and Stronge with friction."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from prbm.mechanics import contact


@pytest.fixture
def rng():
    """Return random numbers that do not depend on the order of the tests."""
    return np.random.default_rng(0)


def energy_change(W, u, P):
    """Return T+ - T- = P.u + P.W P/2 for walls at rest."""
    return float(P @ u + P @ W @ P / 2)


def random_mobility(rng, size, rank):
    """Return a random Delassus matrix of a rank."""
    A = rng.normal(size=(size, rank)) * 10 ** rng.uniform(-2, 2)
    return A @ A.T


@pytest.mark.parametrize("restitution", [0.0, 0.6, 1.0])
def test_gap_rate_after_a_single_impact_is_restitution_times_closing_rate(restitution):
    """The energy changes by Carnot's loss, T+ - T- = -(1 - eps^2) m_eff u^2 / 2."""
    W, u = np.array([[2.5]]), np.array([-1.7])
    P = contact.newton(W, u, np.array([restitution]))
    assert (u + W @ P).item() == pytest.approx(-restitution * u.item(), abs=1e-15)
    assert energy_change(W, u, P) == pytest.approx(
        -0.5 * (1 - restitution**2) / 2.5 * 1.7**2, abs=1e-15
    )


def test_simultaneous_impacts_satisfy_complementarity_and_do_not_gain_energy(rng):
    """Each stop has P >= 0, s = u+ + eps u- >= 0 and P s = 0: impulse P, gap rates u- and u+."""
    for _ in range(2000):
        k = int(rng.integers(2, 5))
        W = random_mobility(rng, k, int(rng.integers(1, k + 1)))
        u = W @ rng.normal(size=k)  # In the range of W, as for every motion.
        closing = np.minimum(u, 0.0) < 0
        u, W = u[closing], W[np.ix_(closing, closing)]
        if not len(u):
            continue
        eps = rng.uniform(0, 1, len(u))
        P = contact.newton(W, u, eps)
        slack = u + W @ P + eps * u
        size = np.abs(u).max()
        assert (P >= 0).all()
        assert slack.min() >= -1e-8 * size
        assert np.abs(P * slack).max() <= 1e-8 * size * max(1.0, P.max())
        assert energy_change(W, u, P) <= 1e-9 * size * max(1.0, P.max())


def test_simultaneous_impacts_do_not_depend_on_the_order_of_the_stops(rng):
    """Exchanging the stops exchanges the impulses."""
    for _ in range(300):
        W = random_mobility(rng, 2, 2)
        u, eps = -rng.uniform(0.1, 1, 2), rng.uniform(0, 1, 2)
        swap = np.array([1, 0])
        P = contact.newton(W, u, eps)
        Q = contact.newton(W[np.ix_(swap, swap)], u[swap], eps[swap])
        np.testing.assert_allclose(P, Q[swap], rtol=1e-9, atol=1e-12 * P.max())


def test_a_bar_that_falls_flat_on_two_stops_rebounds_flat():
    """The impulse at each stop, at +-1 of a free bar (m = 2, J = 0.5), is (1 + eps) m v / 2."""
    m, J = 2.0, 0.5
    G = np.array([[1.0, 1.0], [1.0, -1.0]])  # Gap rates = G (y', phi').
    W = G @ np.diag([1 / m, 1 / J]) @ G.T
    P = contact.newton(W, np.array([-3.0, -3.0]), np.array([0.5, 0.5]))
    np.testing.assert_allclose(P, (1 + 0.5) * m * 3.0 / 2, rtol=1e-13)


def newton_with_coulomb(W, u, mu, eps):
    """Return the impulses by Newton's law with sliding friction, which can gain energy (Kane)."""
    ratio = -mu * np.sign(u[1])
    P_n = -(1 + eps) * u[0] / (W[0, 0] + ratio * W[0, 1])
    u_t = u[1] + (W[1, 0] + ratio * W[1, 1]) * P_n
    if u_t * u[1] >= 0 and P_n > 0:
        return np.array([P_n, ratio * P_n])
    return np.linalg.solve(W, np.array([-(1 + eps) * u[0], -u[1]]))  # Sticking.


@pytest.mark.slow
def test_stronge_impact_does_not_gain_energy_where_newton_with_coulomb_does(rng):
    """Random search over mobilities and directions; some of them are cases of Kane's paradox."""
    worst_ours, worst_newton, coulomb = 0.0, 0.0, 0
    for _ in range(20000):
        W = random_mobility(rng, 2, 2)
        u = np.array([-rng.uniform(0, 1), rng.normal()]) * np.sqrt(np.diag(W))
        mu, eps = rng.uniform(0, 2), rng.uniform(0, 1)
        before = u @ np.linalg.solve(W, u) / 2
        P = np.array(contact.stronge(W, u, mu, eps))
        after = u + W @ P
        assert P[0] > 0
        assert abs(P[1]) <= mu * P[0] * (1 + 1e-12)
        assert after[0] >= -1e-9 * abs(u[0])
        worst_ours = max(worst_ours, energy_change(W, u, P) / before)
        R = newton_with_coulomb(W, u, mu, eps)
        worst_newton = max(worst_newton, energy_change(W, u, R) / before)
        coulomb += after[1] == 0.0
    assert worst_ours <= 1e-12
    assert worst_newton > 0.5, "the search must include cases of the paradox"


@pytest.mark.slow
def test_work_of_restitution_is_restitution_squared_times_work_of_compression(rng):
    """The works are integrated over small increments of the normal impulse (Stronge's law)."""
    for _ in range(8):
        W = random_mobility(rng, 2, 5)
        u = np.array([-1.0, rng.normal()]) * np.sqrt(np.diag(W))
        mu, eps = rng.uniform(0, 1), rng.uniform(0.2, 1)
        P = contact.stronge(W, u, mu, eps)
        N = 20_000
        dp, v, compress, restore = P[0] / N, u.copy(), 0.0, 0.0
        for _ in range(N):
            stick = -W[0, 1] / W[1, 1]
            sliding = abs(v[1]) > 2 * np.abs(W[1]).sum() * dp
            ratio = -mu * np.sign(v[1]) if sliding else np.clip(stick, -mu, mu)
            step = W @ np.array([1.0, ratio]) * dp
            work = (v[0] + step[0] / 2) * dp
            compress, restore = compress - min(work, 0.0), restore + max(work, 0.0)
            v = v + step
        assert restore == pytest.approx(eps**2 * compress, rel=2e-2)
        np.testing.assert_allclose(v, u + W @ np.array(P), atol=3e-3 * np.abs(u).max())


@given(
    st.floats(-1.5, 1.5), st.floats(0.1, 10), st.floats(0.0, 2.0), st.floats(0.0, 1.0)
)  # fmt: skip
@settings(max_examples=300, deadline=None)
def test_impact_with_one_degree_of_freedom_and_friction_equals_its_closed_form(
    angle, mobility, mu, eps
):
    """W has rank one: normal and sliding rate are proportional; the contact jams if mu > |a/b|."""
    a, b = np.sqrt(mobility) * np.cos(angle), np.sqrt(mobility) * np.sin(angle)
    W = np.outer([a, b], [a, b])
    u = np.array([a, b]) * (-1.0 / a)
    P = np.array(contact.stronge(W, u, mu, eps))
    after = u + W @ P
    assert energy_change(W, u, P) <= 1e-12
    assert after[1] * a == pytest.approx(after[0] * b, abs=1e-9 * (1 + abs(b / a)))
    if mu * abs(b) > abs(a) * (1 + 1e-6):
        assert after[0] == pytest.approx(0.0, abs=1e-9)
    elif mu * abs(b) < abs(a) * (1 - 1e-6):
        # Friction acts against the motion in both phases; Stronge's ratio of works gives this.
        gain = abs(b / a) * mu
        assert after[0] == pytest.approx(eps * np.sqrt((1 - gain) / (1 + gain)), rel=1e-6)


def test_newton_and_stronge_agree_if_sliding_does_not_reverse():
    """The gap rate after an impact is u_n+ = -eps u_n- if the sliding keeps its direction."""
    W = np.array([[2.0, 0.3], [0.3, 1.0]])
    P = np.array(contact.stronge(W, np.array([-1.0, 5.0]), 0.2, 0.7))
    assert (np.array([-1.0, 5.0]) + W @ P)[0] == pytest.approx(0.7, rel=1e-12)


@pytest.mark.slow
def test_simultaneous_impacts_with_friction_are_symmetric_and_do_not_gain_energy(rng):
    """Impulses are in the friction cone, gaps do not close; swapped stops swap their impulses."""
    for _ in range(150):
        W = random_mobility(rng, 4, 6)
        u = np.concatenate([-rng.uniform(0.1, 1, 2), rng.normal(size=2)])
        u *= np.sqrt(np.diag(W))
        mu, eps = rng.uniform(0.05, 0.6, 2), rng.uniform(0, 1, 2)
        P = contact.several(W, u, mu, eps)
        after = u + W @ P
        assert energy_change(W, u, P) <= 1e-10 * np.abs(P @ u)
        assert (after[:2] >= -1e-7 * np.abs(u).max()).all()
        assert (np.abs(P[2:]) <= mu * P[:2] + 1e-9 * np.abs(P).max()).all()
        swap = np.array([1, 0, 3, 2])
        Q = contact.several(W[np.ix_(swap, swap)], u[swap], mu[::-1], eps[::-1])
        np.testing.assert_allclose(P, Q[swap], rtol=1e-5, atol=1e-7 * np.abs(P).max())
