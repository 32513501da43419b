"""Orders of convergence: of the pair with fixed steps, of the adaptive one with its tolerance."""

import numpy as np
import pytest

from prbm.base.errors import SimulationError
from prbm.hybrid.runge_kutta import BOGACKI_SHAMPINE as PAIR
from prbm.hybrid.runge_kutta import Tableau, interpolate, stages
from prbm.hybrid.simulation import Simulation
from support import mechanism

SMOOTH = {"stop.position": 0.05}


def path(model, values, span, **options):
    """Return the states (q, v) at 41 times within a span; the integrator does not stop there."""
    sim = Simulation(mechanism(model), values, **options)
    states = []
    for t in np.linspace(*span, 41):
        sim.advance(float(t))
        states.append(sim.state()[: 2 * sim.system.n])
    return np.array(states)


def error(found, exact):
    """Return the root mean square error: angles in rad, rates relative to the largest."""
    n = exact.shape[1] // 2
    scales = np.concatenate([np.ones(n), np.full(n, np.abs(exact[:, n:]).max())])
    return float(np.sqrt(np.mean(((found - exact) / scales) ** 2)))


IMPACT_2R = {"stop.position": -0.012, "damping.beta": 1e-3}
CASES = {
    "1R, smooth": ("PRBDM", SMOOTH, (0.2, 0.4), 0.015, [-0.018]),
    "1R, impact": ("PRBDM", {}, (0.0415, 0.08), 0.024, np.linspace(-0.0185, -0.0175, 8)),
    "2R, smooth": ("PRBDM2R", SMOOTH, (0.01, 0.03), 3.95e-4, np.linspace(-0.0185, -0.0175, 6)),
    "2R, impact": ("PRBDM2R", IMPACT_2R, (0.0245, 0.03), 4e-4, np.linspace(-0.0181, -0.0179, 4)),
}


@pytest.mark.parametrize(
    "case", [c if c.startswith("1R") else pytest.param(c, marks=pytest.mark.slow) for c in CASES]
)
def test_observed_order_of_fixed_steps_is_that_of_the_method(case):
    """Least-squares slope over five halvings, errors over a span of time and some releases.

    At a single time the error depends on the positions of that time and of the impact within their
    steps.  The five halvings cover the range from the longest useful step down to rounding errors:
    the error falls by a factor of 3e7.
    """
    model, values, span, longest, releases = CASES[case]
    steps = longest / 2.0 ** np.arange(6)
    squares = np.zeros(len(steps))
    for release in releases:
        start = values | {"release.displacement": float(release)}
        exact = path(model, start, span, tolerance=1e-13)
        squares += [error(path(model, start, span, step=h), exact) ** 2 for h in steps]
    slope = np.polyfit(np.log(steps), np.log(squares) / 2, 1)[0]
    print(f"{case}: observed order {slope:.3f}")
    assert slope == pytest.approx(PAIR.order, abs=0.1)


def test_error_is_roughly_proportional_to_the_tolerance():
    """For tolerances from 1e-6 to 1e-10, over a span with an impact."""
    span = (0.045, 0.06)
    exact = path("PRBDM2R", {}, span, tolerance=1e-13)
    tolerances = 10.0 ** -np.arange(6, 11)
    errors = [error(path("PRBDM2R", {}, span, tolerance=t), exact) for t in tolerances]
    slope = np.polyfit(np.log(tolerances), np.log(errors), 1)[0]
    assert 0.8 < slope < 1.3
    assert errors[0] / errors[-1] > 2e3


def test_a_fixed_step_that_is_too_long_is_rejected():
    with pytest.raises(SimulationError, match=r"fixed step of 0\.002 s is too long"):
        path("PRBDM2R", {}, (0.05, 0.1), step=2e-3)


def trees(order):
    """Return all rooted trees of an order, as nested sorted tuples."""
    if order == 1:
        return [()]
    found = set()
    for smaller in trees(order - 1):
        found |= set(grafted(smaller))
    return sorted(found, key=repr)


def grafted(tree):
    """Yield the trees with one more leaf."""
    yield tuple(sorted((*tree, ()), key=repr))
    for i, branch in enumerate(tree):
        for new in grafted(branch):
            yield tuple(sorted((*tree[:i], new, *tree[i + 1 :]), key=repr))


def size(tree):
    return 1 + sum(size(branch) for branch in tree)


def density(tree):
    return size(tree) * int(np.prod([density(branch) for branch in tree], dtype=int))


def elementary(a, tree):
    """Return the elementary weights of the stages for a tree."""
    result = np.ones(len(a))
    for branch in tree:
        result = result * (a @ elementary(a, branch))
    return result


@pytest.mark.parametrize("order", [1, 2, 3, 4, 5])
def test_order_conditions_hold_for_every_rooted_tree(order):
    """B . Phi(t) = 1/gamma(t) [Hairer II.2]; 1, 1, 2, 4, 9 trees."""
    found = trees(order)
    assert len(found) == [1, 1, 2, 4, 9][order - 1]
    for tree in found:
        weight = float(PAIR.weights @ elementary(PAIR.a, tree))
        assert weight == pytest.approx(1 / density(tree), abs=1e-14)


@pytest.mark.parametrize("order", [1, 2, 3, 4])
@pytest.mark.parametrize("theta", [0.2, 0.5, 0.9])
def test_dense_output_has_order_four(order, theta):
    """Weights b(theta) . Phi(t) = theta^order / gamma(t) up to order four, for every theta."""
    b = PAIR.dense @ theta ** np.arange(1, 5)
    for tree in trees(order):
        weight = float(b @ elementary(PAIR.a, tree))
        assert weight == pytest.approx(theta**order / density(tree), abs=1e-13)


def test_embedded_solution_has_order_four():
    """It satisfies the conditions up to order four, not those of order five."""
    embedded = PAIR.weights - PAIR.error
    for order in (1, 2, 3, 4):
        for tree in trees(order):
            weight = float(embedded @ elementary(PAIR.a, tree))
            assert weight == pytest.approx(1 / density(tree), abs=1e-14)
    defects = [embedded @ elementary(PAIR.a, t) - 1 / density(t) for t in trees(5)]
    assert np.abs(defects).max() > 1e-5


def test_dense_output_equals_the_new_state_at_the_end_of_a_step():
    def rate(t, y):
        return np.array([y[1], -y[0]])

    y = np.array([1.0, 0.0])
    k, y1 = stages(PAIR, rate, 0.0, y, 0.1, rate(0.0, y))
    np.testing.assert_allclose(interpolate(PAIR, y, k, 0.1, 1.0), y1, atol=1e-15)
    np.testing.assert_allclose(interpolate(PAIR, y, k, 0.1, 0.5)[0], np.cos(0.05), atol=1e-8)


@pytest.mark.parametrize("field", ["a", "error", "dense"])
def test_inconsistent_coefficients_are_rejected(field):
    parts = {"a": PAIR.a.copy(), "error": PAIR.error.copy(), "dense": PAIR.dense.copy()}
    parts[field][-1, ...] += 1e-3
    with pytest.raises(ValueError, match=r"must|depend"):
        Tableau(**parts, order=5)
