"""Statics, modes and linear models of mechanisms with springs, in closed form."""

import math

import numpy as np
import pytest

import prbm
from prbm.analysis.holding import described
from prbm.analysis.linear_model import linearize
from prbm.analysis.load_path import load_path
from prbm.base.errors import EquilibriumError
from prbm.mechanics.assembly import assemble
from prbm.mechanics.elements import Elements
from prbm.mechanics.modal import damping, modes
from prbm.mechanics.statics import equilibrium, holding_stiffness
from prbm.sweeps.study import study
from springs import oscillator, truss, web


def truss_force(down, height=0.05, half=0.2, stiffness=1e3):
    """Return the force that holds the apex of the truss at a displacement, positive down [N]."""
    y, drawn = height - down, math.hypot(half, height)
    length = math.hypot(half, y)
    return -2.0 * stiffness * (length - drawn) * y / length


def test_the_holding_force_of_a_shallow_truss_is_its_closed_form():
    model = truss()
    system = assemble(model, model.values())
    for down in (0.01, 0.03, 0.05, 0.08, 0.11):
        shape, h = equilibrium(system, down), 1e-6
        assert shape.force == pytest.approx(truss_force(down), abs=1e-9)
        slope = (truss_force(down + h) - truss_force(down - h)) / (2.0 * h)
        assert holding_stiffness(system, shape) == pytest.approx(slope, rel=1e-5)


LENGTH = math.hypot(0.2, 0.05)
LIMIT = 2e3 * LENGTH * (1.0 - (0.2 / LENGTH) ** (2.0 / 3.0)) ** 1.5
"""Limit load 2 k L (1 - cos(a)^(2/3))^(3/2) of the truss, with the angle a of its springs [N]."""


def test_a_shallow_truss_carries_its_limit_load_and_no_more():
    model = truss()
    system = assemble(model, model.values())
    down = system.amount(equilibrium(system, loads={"push.y": -0.999 * LIMIT}).q)
    assert down < 0.05
    assert truss_force(down) == pytest.approx(0.999 * LIMIT)
    with pytest.raises(EquilibriumError, match=r"beyond 99\.9 % of the loads"):
        equilibrium(system, loads={"push.y": -1.001 * LIMIT})


def test_the_path_of_a_shallow_truss_passes_its_limit_points():
    model = truss()
    system = assemble(model, model.values())
    path = load_path(system, {}, {"push.y": -3.0})
    assert path.ended is None
    events = [3.0 * point.share for kind, point in path.events if kind == "limit point"]
    assert events == pytest.approx([LIMIT, -LIMIT], rel=1e-6)
    down = np.array([system.amount(point.shape.q) for point in path.points])
    shares = np.array([3.0 * point.share for point in path.points])
    assert shares == pytest.approx([truss_force(d) for d in down], abs=1e-7)


def test_a_hanging_block_stretches_its_spring_by_its_weight_over_its_stiffness():
    model = oscillator(parts={"gravity": (9.81, 0.0)})
    system = assemble(model, model.values())
    assert system.amount(equilibrium(system).q) == pytest.approx(2.0 * 9.81 / 200.0)


def test_a_stretched_spring_holds_a_block_across_its_axis():
    """The frequencies are sqrt(k/m) along it and sqrt(T/(m l)) across; the block turns freely."""
    model = oscillator(parts={"gravity": (9.81, 0.0)})
    system = assemble(model, model.values())
    shape = equilibrium(system)
    tension, length = 2.0 * 9.81, 0.1 + 2.0 * 9.81 / 200.0
    expected = [0.0, math.sqrt(tension / (2.0 * length)), 10.0]
    found = modes(system, shape)
    assert 2.0 * math.pi * found.frequency == pytest.approx(expected, abs=1e-6)


def test_a_damper_gives_a_mode_its_damping_ratio():
    model = oscillator(damping=6.0)
    system = assemble(model, model.values())
    shape = equilibrium(system)
    found = modes(system, shape)
    assert damping(system, found, shape.q)[0][-1] == pytest.approx(6.0 / (2.0 * 2.0 * 10.0))


def test_a_linear_model_has_the_poles_of_the_block():
    model = oscillator(damping=6.0)
    found = linearize(model, inputs=[], outputs=["block.x"])
    poles = np.linalg.eigvals(found.A)
    exact = complex(-1.5, math.sqrt(100.0 - 1.5**2))
    assert min(abs(poles - exact)) < 1e-9


def moved(model, scale, rng):
    """Return a system and a random shape near the drawn one."""
    system = assemble(model, model.values())
    return system, system.q0 + scale * rng.standard_normal(system.n)


@pytest.mark.parametrize("model", [web(), truss(cubic_stiffness=1e5), oscillator(free_length=0.07)])
@pytest.mark.parametrize("share", [1.0, 0.4])
def test_force_and_stiffness_are_derivatives_of_the_energy(model, share):
    rng = np.random.default_rng(1)
    system, q = moved(model, 0.1, rng)
    elements, h = Elements(system), 1e-6

    def force(q):
        return elements.force(q, system.directions(q), share)

    found = np.array([(force(q + h * u) - force(q - h * u)) / (2.0 * h) for u in np.eye(system.n)])
    K = elements.tangent(system.directions(q), share)
    assert pytest.approx(-found, abs=1e-7 * np.abs(K).max()) == K
    assert pytest.approx(K.T) == K
    if share == 1.0:

        def energy(q):
            return elements.energy(q, system.directions(q))

        slope = [(energy(q + h * u) - energy(q - h * u)) / (2.0 * h) for u in np.eye(system.n)]
        assert force(q) == pytest.approx(-np.array(slope), abs=1e-7 * np.abs(force(q)).max())


def test_damping_is_the_derivative_of_the_forces_by_the_rates():
    rng = np.random.default_rng(2)
    system, q = moved(web(), 0.1, rng)
    elements, e, v = Elements(system), None, rng.standard_normal(system.n)
    e = system.directions(q)
    C = elements.damping(e, 0.0)
    assert elements.motion_force(q, e, v, 0.0) - elements.force(q, e) == pytest.approx(-C @ v)
    assert elements.loss(e, v, 0.0) == pytest.approx(v @ C @ v)


def test_motions_without_stiffness_are_neither_unstable_nor_the_fundamental_mode():
    """The block of 2 kg moves freely across its spring of 200 N/m, and turns about its eye."""
    guide, expected = oscillator(), math.sqrt(200.0 / 2.0) / (2.0 * math.pi)
    shape = prbm.equilibrium(guide)
    assert shape.modes.frequency[:2] == pytest.approx([0.0, 0.0], abs=shape.modes.rounding)
    assert shape.stable
    assert shape.fundamental == pytest.approx(expected)
    assert repr(shape) == "<StaticShape of Oscillator: free at 0 m, stable>"
    point = described(shape.system, 0.0, shape.shape)
    assert point.unstable == 0
    assert point.frequency == pytest.approx(expected)
    found = study(guide, {"coil.stiffness": [200.0, 800.0]}, ["fundamental", "mode(1)"])
    assert found.outputs["fundamental"] == pytest.approx([expected, 2.0 * expected])
    assert found.outputs["mode(1)"] == pytest.approx([0.0, 0.0], abs=1e-6)


def test_a_motion_without_stiffness_does_not_make_a_shape_unstable():
    """The body at the apex turns freely; its lowest other frequency is sqrt(2 k sin(a)^2/m)."""
    model = truss()
    system = assemble(model, model.values())
    point = described(system, 0.0, equilibrium(system))
    assert point.unstable == 0
    lowest = math.sqrt(2e3) * 0.05 / LENGTH / (2.0 * math.pi)
    assert point.frequency == pytest.approx(lowest)
