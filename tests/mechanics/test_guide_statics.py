"""Guides in statics and modes: closed forms, and second derivatives of rows that bodies carry."""

import math
from dataclasses import replace

import numpy as np
import pytest

from guides import cart, incline, slotted_arm, trammel
from many_parts import anvil, elastic, rich
from prbm.drawing.shapes import Shapes
from prbm.mechanics.assembly import assemble
from prbm.mechanics.elements import Elements
from prbm.mechanics.linear import state_space
from prbm.mechanics.modal import fundamental_frequency, modes
from prbm.mechanics.resting import RestingShape, resting_shape
from prbm.mechanics.statics import equilibrium, resting, tangent_stiffness
from prbm.mechanism.parts import Joint, Release, Spring

G = 9.81


def assembled(model):
    return assemble(model, model.values())


@pytest.mark.parametrize("model", [cart, slotted_arm, anvil, elastic, rich])
def test_the_stiffness_of_forces_along_rows_is_their_second_derivative(model):
    """Rows on the ground and on bodies, with arms that stretch and bodies that float."""
    system, rng = assembled(model()), np.random.default_rng(0)
    q = system.q0 + 0.2 * rng.normal(size=system.n)
    none = np.zeros((system.n, system.n)), np.zeros(system.d, complex)
    for rows in (system.loop_rows, system.gap_rows, system.slide_rows):
        lam, h = rng.normal(size=len(rows)), 1e-3

        def force(q, rows=rows, lam=lam):
            return lam @ rows.jacobian(system.directions(q))

        turns = h * np.eye(system.n)
        found = tangent_stiffness(*none, rows, lam, system.directions(q))
        expected = -np.array([
            (8 * (force(q + d) - force(q - d)) - force(q + 2 * d) + force(q - 2 * d)) / (12 * h)
            for d in turns
        ])  # fmt: skip
        assert found == pytest.approx(expected, abs=1e-9 * (1.0 + np.abs(expected).max()))


def test_a_weight_in_a_slot_of_a_pendulum_swings_with_it():
    """Along the slot sqrt(k/m); across it, the frequency of the compound pendulum.

    The slot carries the weight of the pin across it as the arm turns: the row of the guide has
    second derivatives.
    """
    m, k, s = 0.4, 120.0, 0.15
    arm, pin = slotted_arm().bodies
    arm = replace(arm, centre=(0.0, -0.1), points={"o": (0.0, 0.0), "a": (0.0, -0.05),
                                                    "b": (0.0, -0.3)})  # fmt: skip
    pin = replace(pin, centre=(0.0, -s), points={"c": (0.0, -s)})
    hung = replace(
        slotted_arm(), bodies=(arm, pin), forces=(), gravity=(0.0, -G),
        springs=(Spring("coil", "arm.o", "pin.c", k, s - m * G / k),),
        guides=(replace(slotted_arm().guides[0], turning=False),),
        release=Release("arm", displacement=0.0),
    )  # fmt: skip
    system = assembled(hung)
    shape = equilibrium(system)
    assert shape.q == pytest.approx(system.q0, abs=1e-12)
    J = 0.02 + 1.0 * 0.1**2 + m * s**2 + 1e-4
    swing = math.sqrt((1.0 * 0.1 + m * s) * G / J)
    found = 2.0 * math.pi * modes(system, shape).frequency
    assert found == pytest.approx(sorted([swing, math.sqrt(k / m)]), rel=1e-9)
    assert fundamental_frequency(system) == pytest.approx(swing / (2.0 * math.pi))


def test_a_trammel_hangs_and_swings_about_its_lowest_shape():
    """It is m g a (1 - cos x) below, with the inertia m b^2 + J there."""
    a, b, m, J = 0.2, 0.3, 0.7, 5e-3
    system = assembled(replace(trammel(a, b), gravity=(0.0, -G)))
    shape, balanced = resting(system)
    assert balanced
    assert system.amount(shape.q) == pytest.approx(-b * math.cos(math.radians(40.0)))
    swing = math.sqrt(m * G * a / (m * b**2 + J)) / (2.0 * math.pi)
    assert fundamental_frequency(system) == pytest.approx(swing, rel=1e-12)


def test_a_tilted_arm_balances_a_pin_on_a_spring():
    """The shape minimises the potential energy of the arm, the pin and the springs."""
    springs = (
        Spring("coil", "arm.o", "pin.c", 60.0, 0.12),
        Spring("stay", "ground.stay", "arm.b", 30.0, 0.2),
    )
    model = slotted_arm(springs, gravity=(0.0, -G), velocity=0.0, displacement=0.0)
    system = assembled(model)
    shape = equilibrium(system)

    def potential(alpha, s):
        turn = complex(math.cos(alpha), math.sin(alpha))
        pin, end = (s + 0.02j) * turn, (0.3 + 0.02j) * turn
        coil, stay = abs(pin) - 0.12, abs(end - (0.25 + 0.3j)) - 0.2
        return G * (0.1 * turn.imag + 0.4 * pin.imag) + 30.0 * coil**2 + 15.0 * stay**2

    out = system.directions(shape.q)
    alpha = float(shape.q[system.bodies["arm"].j])
    pin = complex(system.bodies["pin"].A @ out) + system.bodies["pin"].c
    z = pin * complex(math.cos(alpha), -math.sin(alpha))
    assert z.imag == pytest.approx(0.02, abs=1e-12)
    h = 1e-5
    for d in ((h, 0.0), (0.0, h)):
        up, down = (potential(alpha + x * d[0], z.real + x * d[1]) for x in (1, -1))
        assert (up - down) / (2 * h) == pytest.approx(0.0, abs=1e-7)
    # The stiffness is the second derivative along the two motions, with the masses of both.
    H = np.array([
        [
            sum(
                a * b * potential(alpha + a * p[0] + b * r[0], z.real + a * p[1] + b * r[1])
                for a in (h, -h) for b in (h, -h)
            ) / (4 * h**4)
            for r in ((1.0, 0.0), (0.0, 1.0))
        ]
        for p in ((1.0, 0.0), (0.0, 1.0))
    ])  # fmt: skip
    M = np.array([[0.03 + 0.4 * (z.real**2 + 0.02**2), -0.4 * 0.02], [-0.4 * 0.02, 0.4]])
    omega2 = np.linalg.eigvals(np.linalg.solve(M, H))
    found = (2.0 * math.pi * modes(system, shape).frequency) ** 2
    assert found[np.abs(found) > 1e-3] == pytest.approx(np.sort(omega2.real), rel=1e-4)


def test_a_block_on_an_inclined_line_has_no_rest_and_a_level_one_has():
    system = assembled(incline(30.0))
    shape, balanced = resting(system)
    assert (balanced, len(shape.lam)) == (False, len(system.loops))
    assert fundamental_frequency(system) == 0.0
    shape, balanced = resting(assembled(incline(0.0)))
    assert balanced
    held = equilibrium(system, 0.01)
    assert held.force == pytest.approx(2.0 * G * 0.5)
    assert held.lam == pytest.approx([2.0 * G * math.cos(math.pi / 6), 0.0], abs=1e-9)


def test_a_linear_model_has_the_modes_of_the_guided_mechanism():
    model = cart((0.0, 0.0))
    system = assembled(model)
    shape = equilibrium(system)
    rest = RestingShape(shape.q, system.loop_rows, shape.lam, shape.load)
    found = state_space(system, rest, {}, [], ["push.x"], ["cart.x"])
    frequency = modes(system, shape).frequency
    poles = np.linalg.eigvals(found.A)
    assert np.sort(np.abs(poles))[::2] == pytest.approx(2.0 * np.pi * frequency, rel=1e-3)


def test_a_hammer_rests_on_the_stage_that_carries_it():
    """The Lagrangian V - lam gap is stationary, and its second derivative is that of the model."""
    face, side = anvil().stops
    face = replace(face, position=-1e-4, friction=0.0)
    model = replace(anvil(), stops=(face, side), frictions=())
    system = assembled(model)
    free = equilibrium(system)
    rest = resting_shape(system, free, np.zeros(system.n), [0])
    wall = np.append(np.zeros(len(system.loops)), -1e-4)
    assert rest.rows.values(system.directions(rest.q)) + wall == pytest.approx(0.0, abs=1e-14)
    assert rest.lam[-1] > 1e-3

    def lagrangian(q):
        e = system.directions(q)
        height = float((system.m @ (system.A @ e + system.c)).imag)
        x = rest.rows.values(e) + wall
        return Elements(system).energy(q, e) + 1.0 * height - float(rest.lam @ x)

    h = 1e-4
    turns = h * np.eye(system.n)
    slopes = [(lagrangian(rest.q + d) - lagrangian(rest.q - d)) / (2 * h) for d in turns]
    assert np.abs(slopes).max() < 1e-10
    found = state_space(system, rest, {}, [0], [], [])
    for frequency, phi in zip(found.modes.frequency, found.modes.shape.T, strict=True):
        d = h * phi / np.abs(phi).max()
        bend = lagrangian(rest.q + d) - 2 * lagrangian(rest.q) + lagrangian(rest.q - d)
        omega2 = bend / (d @ found.modes.M @ d)
        assert omega2 == pytest.approx((2 * math.pi * frequency) ** 2, rel=1e-3)


def test_a_joint_is_two_guides():
    """A pin on two crossed lines moves as in a joint."""
    arm = slotted_arm((Spring("stay", "ground.stay", "arm.b", 30.0),), gravity=(0.0, -G))
    (body, _), ground = arm.bodies, {"o": (0.0, 0.0), "u": (0.3, 0.1), "v": (-0.1, 0.4),
                                     "stay": (0.2, 0.3)}  # fmt: skip
    common = {
        "bodies": (body,), "ground": ground, "forces": (), "release": Release("arm", 90.0),
    }  # fmt: skip
    pinned = replace(arm, guides=(), joints=(Joint("pivot", "ground.o", "arm.o"),), **common)
    one = replace(arm.guides[0], name="one", point="arm.o", start="ground.o", end="ground.u")
    other = replace(one, name="other", end="ground.v")
    crossed = replace(arm, guides=(one, other), joints=(), **common)
    first, second = (assembled(model) for model in (pinned, crossed))
    assert fundamental_frequency(second) == pytest.approx(fundamental_frequency(first), rel=1e-9)
    angles = [equilibrium(s).q[s.bodies["arm"].j] for s in (first, second)]
    assert angles[0] == pytest.approx(angles[1], abs=1e-10)


def test_the_slot_of_a_guide_moves_with_its_carrier_and_the_pin_in_it():
    system = assembled(slotted_arm())
    shapes, q = Shapes(system), system.q0.copy()
    q[system.bodies["arm"].j] = 0.5 * math.pi
    (slot,) = shapes.slots(shapes.arms(q))
    assert slot[:4].mean() == pytest.approx(1j * complex(0.175, 0.02))
    pin = system.guided_points[0]
    assert shapes.pins(shapes.straight)[-1] == pytest.approx(pin.drawn)
