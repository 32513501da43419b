"""Orders of the integrator: observed in the step and the tolerance, and of its coefficients."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from kernel_simulation import KernelSimulation
from prbm.base.errors import SimulationError
from prbm.hybrid.arc import Arc
from prbm.hybrid.configuration import Scales
from prbm.hybrid.runge_kutta import TSITOURAS_PAPAKOSTAS as PAIR
from prbm.hybrid.runge_kutta import Tableau, interpolate, stages
from prbm.hybrid.simulation import Simulation
from prbm.hybrid.stepping import error_norm, step_error
from support import energy_balance, mechanism

SMOOTH = {"stop.position": 0.05}
DENSE_ORDER = 5  # Order of the dense output of the pair, with which events are detected.


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
    "1R, smooth": ("PRBDM", SMOOTH, (0.2, 0.4), 0.015, 2, [-0.018]),
    "1R, impact": ("PRBDM", {}, (0.0415, 0.08), 0.024, 2, np.linspace(-0.0185, -0.0175, 8)),
    "2R, smooth": ("PRBDM2R", SMOOTH, (0.01, 0.03), 3.95e-4, 2, np.linspace(-0.0185, -0.0175, 6)),
    "2R, impact": ("PRBDM2R", IMPACT_2R, (0.0245, 0.03), 4e-4, 3, np.linspace(-0.0181, -0.0179, 4)),
}


@pytest.mark.parametrize(
    "case", [c if c.startswith("1R") else pytest.param(c, marks=pytest.mark.slow) for c in CASES]
)
def test_observed_order_is_that_of_the_pair(case):
    """The slope of the error over the step length, in logarithms, is about seven.

    The states are read within steps.  The error is averaged over a span of time and several
    releases: at a single time it depends on the positions of that time and of the impact within
    their steps.  Longer steps do not resolve the motion, and the error of shorter steps is
    round-off.
    """
    model, values, span, longest, halvings, releases = CASES[case]
    steps = longest / 2.0 ** np.arange(halvings + 1)
    squares = np.zeros(len(steps))
    for release in releases:
        start = values | {"release.displacement": float(release)}
        exact = path(model, start, span, step=longest / 32)
        squares += [error(path(model, start, span, step=h), exact) ** 2 for h in steps]
    slope = np.polyfit(np.log(steps), np.log(squares) / 2, 1)[0]
    print(f"{case}: observed order {slope:.3f}")
    assert PAIR.order - 0.5 < slope < PAIR.order + 1.0


def orbit(t, y):
    """Return the rates of a Kepler orbit, (x, y, vx, vy)."""
    return np.array([*y[2:], *(-y[:2] / np.hypot(*y[:2]) ** 3)])


def orbit_error(h, theta):
    """Return the error at a fraction of one step from the periapsis."""
    e, t = 0.3, theta * h
    y = np.array([1 - e, 0.0, 0.0, np.sqrt((1 + e) / (1 - e))])
    k, _ = stages(PAIR, orbit, 0.0, y, h, orbit(0.0, y))
    anomaly = brentq(lambda x: x - e * np.sin(x) - t, 0.0, np.pi, xtol=1e-16)
    exact = [np.cos(anomaly) - e, np.sqrt(1 - e**2) * np.sin(anomaly)]
    return np.abs(interpolate(PAIR, y, k, h, theta)[:2] - exact).max()


@pytest.mark.parametrize(("theta", "order"), [(1.0, PAIR.order), (0.3, DENSE_ORDER)])
def test_error_of_a_step_on_a_kepler_orbit_has_the_claimed_order(theta, order):
    """The error is proportional to h^8 at the end of the step, and to h^6 within it."""
    steps = 0.2 / 2.0 ** np.arange(3)
    errors = [orbit_error(h, theta) for h in steps]
    slope = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert slope == pytest.approx(order + 1, abs=0.3)


def energized_orbit(t, y):
    """Return the rates of a Kepler orbit and of two energies, which are constant."""
    return np.array([*orbit(t, y[:4]), 0.0, 0.0])


@pytest.mark.parametrize("previous", [True, False])
def test_error_of_the_interpolation_through_three_states_falls_with_the_eighth_power(previous):
    """The third state is the start of the previous step, or the middle of the step.

    The error of the positions falls like that of the step.
    """
    e, steps, found = 0.3, 0.4 / 2.0 ** np.arange(3), []
    for h in steps:
        y = np.array([1 - e, 0.0, 0.0, np.sqrt((1 + e) / (1 - e)), 0.0, 0.0])
        k, end = stages(PAIR, energized_orbit, 0.0, y, h, energized_orbit(0.0, y))
        last = Arc(0.0, h, h, y, k, 2)
        k, _ = stages(PAIR, energized_orbit, h, end, h, k[-1])
        arc = Arc(h, h, 2 * h, end, k, 2, last.start_before(h))
        third = arc.before if previous else arc.middle(energized_orbit)
        t = 1.3 * h
        exact = solve_ivp(energized_orbit, (0.0, t), y, "DOP853", rtol=2.3e-14, atol=1e-15).y[:, -1]
        found.append(np.abs((arc.through(third, t) - exact)[:2]).max())
    slope = np.polyfit(np.log(steps), np.log(found), 1)[0]
    assert slope == pytest.approx(8.0, abs=0.5)


def test_a_short_previous_step_is_no_node_of_the_interpolation():
    """Two nodes close to each other amplify round-off."""
    arc = Arc(0.0, 0.1, 0.1, np.zeros(4), np.zeros((10, 4)), 1)
    assert arc.start_before(1.0) is None
    assert arc.start_before(0.1) is not None


@pytest.mark.slow
def test_error_is_roughly_proportional_to_the_tolerance():
    """The tolerances are from 1e-6 to 1e-10; the span of time includes an impact."""
    span = (0.045, 0.06)
    exact = path("PRBDM2R", {}, span, tolerance=1e-13)
    tolerances = 10.0 ** -np.arange(6, 11)
    errors = [error(path("PRBDM2R", {}, span, tolerance=t), exact) for t in tolerances]
    slope = np.polyfit(np.log(tolerances), np.log(errors), 1)[0]
    assert 0.8 < slope < 1.6
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


@pytest.mark.parametrize("order", range(1, 8))
def test_order_conditions_hold_for_every_rooted_tree(order):
    """The weights b satisfy b . Phi(t) = 1/gamma(t) for each tree t [Hairer II.2].

    Phi are the elementary weights, gamma is the density.  Orders 1 to 7 have 1, 1, 2, 4, 9, 20 and
    48 trees.
    """
    found = trees(order)
    assert len(found) == [1, 1, 2, 4, 9, 20, 48][order - 1]
    for tree in found:
        weight = float(PAIR.weights @ elementary(PAIR.a, tree))
        assert weight == pytest.approx(1 / density(tree), abs=1e-14)


@pytest.mark.parametrize("order", range(1, DENSE_ORDER + 1))
@pytest.mark.parametrize("theta", [0.2, 0.5, 0.9])
def test_dense_output_is_of_fifth_order(order, theta):
    """The weights satisfy b(theta) . Phi(t) = theta^order/gamma(t) for trees t of order 1 to 5."""
    b = PAIR.dense @ theta ** np.arange(1, PAIR.dense.shape[1] + 1)
    for tree in trees(order):
        weight = float(b @ elementary(PAIR.a, tree))
        assert weight == pytest.approx(theta**order / density(tree), abs=1e-13)


def test_dense_output_has_the_smallest_defects_of_order_six():
    """The defects are compared with those of all interpolants of the same stages.

    These have order five, and agree with the states and their rates at both ends of a step.
    """
    a, powers = PAIR.a, np.arange(1, PAIR.dense.shape[1] + 1)
    shape = PAIR.dense.shape
    equations = []
    for p in powers:  # Changes of the weights that violate no condition of order five.
        equations += [
            np.outer(elementary(a, tree), powers == p).ravel()
            for order in range(1, DENSE_ORDER + 1)
            for tree in trees(order)
        ]
    for stage in np.eye(shape[0]):
        rows = np.ones(shape[1]), powers == 1, powers
        equations += [np.outer(stage, row).ravel() for row in rows]
    _, values, rows = np.linalg.svd(np.array(equations))
    changes = rows[np.count_nonzero(values > 1e-10) :]
    assert len(changes) == 2
    thetas = np.linspace(0.05, 1.0, 20)
    conditions = [
        np.outer(elementary(a, tree), theta**powers).ravel()
        for tree in trees(DENSE_ORDER + 1)
        for theta in thetas
    ]
    wanted = [t ** (DENSE_ORDER + 1) / density(x) for x in trees(DENSE_ORDER + 1) for t in thetas]
    defect = np.array(conditions) @ PAIR.dense.ravel() - wanted
    best = np.linalg.lstsq(np.array(conditions) @ changes.T, -defect, rcond=None)[0]
    least = defect + np.array(conditions) @ changes.T @ best
    assert np.linalg.norm(defect) < 1.001 * np.linalg.norm(least)


def test_embedded_solution_has_order_five():
    """The embedded weights satisfy the conditions up to order five, but not those of order six."""
    embedded = PAIR.weights - PAIR.error
    for order in range(1, PAIR.error_order + 1):
        for tree in trees(order):
            weight = float(embedded @ elementary(PAIR.a, tree))
            assert weight == pytest.approx(1 / density(tree), abs=1e-14)
    trees_beyond = trees(PAIR.error_order + 1)
    defects = [embedded @ elementary(PAIR.a, t) - 1 / density(t) for t in trees_beyond]
    assert np.abs(defects).max() > 1e-5


def test_dense_output_equals_the_new_state_at_the_end_of_a_step():
    def rate(t, y):
        return np.array([y[1], -y[0]])

    y = np.array([1.0, 0.0])
    k, y1 = stages(PAIR, rate, 0.0, y, 0.1, rate(0.0, y))
    np.testing.assert_allclose(interpolate(PAIR, y, k, 0.1, 1.0), y1, atol=1e-15)
    np.testing.assert_allclose(interpolate(PAIR, y, k, 0.1, 0.5)[0], np.cos(0.05), atol=1e-8)


def test_last_stage_but_one_is_a_solution_of_third_order():
    """The stage satisfies the conditions up to order three, but not those of order four."""
    assert PAIR.c[-2] == pytest.approx(1.0, abs=1e-14)
    defects = {
        order: [PAIR.coarse_error @ elementary(PAIR.a, tree) for tree in trees(order)]
        for order in range(1, PAIR.coarse_order + 2)
    }
    for order in range(1, PAIR.coarse_order + 1):
        assert np.abs(defects[order]).max() < 1e-14
    assert np.abs(defects[PAIR.coarse_order + 1]).max() > 1e-3


@pytest.mark.parametrize("z", np.linspace(0.2, 4.4, 22))
def test_estimated_error_of_an_oscillation_is_close_to_its_error(z):
    """The ratio of both errors is 0.35 to 1.8 up to the limit of stability, h omega = z = 4.4."""
    scales = Scales(length=1.0, rate=1.0, energy=1e-9, time=2 * math.pi)
    turn = np.array([[0.0, 1.0, 0.0, 0.0], [-1.0, 0.0, 0.0, 0.0], [0.0] * 4, [0.0] * 4])
    estimated, actual = [], []
    for phase in np.linspace(0.0, np.pi, 8, endpoint=False):
        y = np.array([np.cos(phase), -np.sin(phase), 0.0, 0.0])
        k, y1 = stages(PAIR, lambda _, x: turn @ x, 0.0, y, z, turn @ y)
        exact = np.array([np.cos(phase + z), -np.sin(phase + z), 0.0, 0.0])
        estimated.append(step_error(scales, z, k, y, y1))
        actual.append(error_norm(scales, y1 - exact, y, y1))
    assert 0.35 < np.linalg.norm(estimated) / np.linalg.norm(actual) < 1.8


@pytest.mark.parametrize("field", ["a", "error", "dense"])
def test_inconsistent_coefficients_are_rejected(field):
    parts = {"a": PAIR.a.copy(), "error": PAIR.error.copy(), "dense": PAIR.dense.copy()}
    parts[field][-1, ...] += 1e-3
    with pytest.raises(ValueError, match=r"must|depend"):
        Tableau(**parts, order=7, error_order=5, coarse_order=3)


def energy_error(twin, acceleration, step=1.3e-3, end=0.2):
    """Return the largest error of the energy balance at steps, relative to the largest energy.

    ``acceleration(t)`` is set at the beginning of each step [m/s^2].
    """
    sim, rows = twin(mechanism("PRBDM"), SMOOTH), []
    start = energy_balance(sim.outputs())
    for k in range(round(end / step)):
        sim.set({"base.acceleration.x": acceleration(k * step)})
        sim.advance((k + 1) * step)
        out = sim.outputs()
        rows.append((energy_balance(out) - start, out["energy.kinetic"] + out["energy.elastic"]))
    errors, energies = np.abs(rows).T
    return errors.max() / energies.max()


@pytest.mark.parametrize("twin", [Simulation, KernelSimulation])
def test_inputs_that_change_within_integration_steps_cause_no_error_of_the_energy(twin):
    """The work of the inputs is the change of the energy, as exactly as without inputs.

    The integration restarts from the end of a step, not from the dense output of the pair, with
    which the error is thirty times larger.
    """
    undisturbed = energy_error(twin, lambda t: 0.0)
    assert energy_error(twin, lambda t: 3.0 * math.sin(44.0 * t)) < 2 * undisturbed
