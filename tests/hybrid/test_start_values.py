"""Positions and velocities of bodies at the start: closed forms, contradictions, both engines."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

from free_bodies import ball, double_pendulum, pendulum, with_start
from guides import CRANK, ROD, incline, slider_crank, trammel
from moved_drawings import moved
from prbm.base.errors import EquilibriumError, ParameterError
from prbm.hybrid.simulation import Simulation
from prbm.mechanism.description import Mechanism
from prbm.mechanism.parts import Body, Flexure, FlexureType, Release, Stop
from prbm.runs.engine import simulation as started
from springs import four_bar
from support import GUIDES, energy_balance, mechanism

G = 9.81
LENGTH, MASS, INERTIA = 0.3, 0.5, 2e-3 + 0.5 * 0.3**2  # Of the pendulum.
engines = pytest.mark.parametrize(
    "engine", ["python", pytest.param("kernel", marks=pytest.mark.native)]
)


@engines
def test_a_projectile_flies_on_a_parabola_and_turns_evenly(engine):
    start = {"start_x": 0.2, "start_y": 0.5, "start_angle": 1.0}
    start |= {"start_vx": 2.0, "start_vy": 3.0, "start_omega": -4.0}
    sim = started(with_start(ball(stops=()), "ball", **start), {}, engine=engine)
    for t in (0.0, 0.2, 1.3):
        sim.advance(t)
        out = sim.outputs()
        assert out["ball.x"] == pytest.approx(0.2 + 2.0 * t, rel=1e-9)
        assert out["ball.y"] == pytest.approx(0.5 + 3.0 * t - 0.5 * G * t**2, rel=1e-9)
        assert out["ball.angle"] == pytest.approx(1.0 - 4.0 * t, rel=1e-9)
        assert out["ball.vy"] == pytest.approx(3.0 - G * t, rel=1e-9)


@engines
def test_what_is_not_given_of_a_free_body_is_as_drawn_and_at_rest(engine):
    sim = started(with_start(ball(), "ball", start_x=0.2, start_omega=3.0), {}, engine=engine)
    out = sim.outputs()
    found = [out[f"ball.{name}"] for name in ("x", "y", "angle", "vx", "vy", "omega")]
    assert found == pytest.approx([0.2, 0.0, 0.0, 0.0, 0.0, 3.0], abs=1e-15)


@engines
@pytest.mark.parametrize("angle", [0.4, 2.5, -3.0])
def test_a_pendulum_starts_at_an_angle_with_a_rate_and_reaches_another_in_the_time(engine, angle):
    """J q'^2/2 - m g l cos q is constant, so that the time is the integral of 1/q'."""
    model = with_start(pendulum(0.0), "bob", start_angle=angle, start_omega=9.0)
    sim = started(model, {}, engine=engine, tolerance=1e-11)
    out = sim.outputs()
    assert (out["bob.angle"], out["bob.omega"]) == pytest.approx((angle, 9.0), rel=1e-12)
    assert out["bob.x"] == pytest.approx(LENGTH * math.sin(angle), abs=1e-12)
    assert out["bob.vx"] == pytest.approx(9.0 * LENGTH * math.cos(angle), rel=1e-9)

    def rate(q):
        fall = math.cos(q) - math.cos(angle)
        return math.sqrt(81.0 + 2.0 * MASS * G * LENGTH * fall / INERTIA)

    time = quad(lambda q: 1.0 / rate(q), angle, angle + 1.5, epsabs=1e-12)[0]
    sim.advance(time)
    assert sim.outputs()["bob.angle"] == pytest.approx(angle + 1.5, abs=1e-7)
    assert sim.outputs()["bob.omega"] == pytest.approx(rate(angle + 1.5), rel=1e-7)


def slider_at(turned, omega):
    """Return the displacement and the velocity of the slider drawn at 90 degrees of the crank."""
    q = math.pi / 2.0 + turned
    root = math.sqrt(ROD**2 - (CRANK * math.sin(q)) ** 2)
    x = CRANK * math.cos(q) + root - math.sqrt(ROD**2 - CRANK**2)
    slope = -CRANK * math.sin(q) - CRANK**2 * math.sin(q) * math.cos(q) / root
    return x, omega * slope


@engines
@pytest.mark.parametrize("turned", [-0.7, 0.3, 1.2])
def test_a_slider_crank_starts_at_an_angle_and_a_rate_of_the_crank(engine, turned):
    model = slider_crank(velocity=0.0)
    model = with_start(model, "crank", start_angle=turned, start_omega=5.0)
    sim = started(model, {}, engine=engine, tolerance=1e-11)
    out, (x, speed) = sim.outputs(), slider_at(turned, 5.0)
    assert out["crank.angle"] == pytest.approx(turned, rel=1e-12)
    assert out["slider.x"] == pytest.approx(x, abs=1e-12)
    assert out["slider.vx"] == pytest.approx(speed, rel=1e-12)
    whole = energy_balance(out)
    sim.advance(0.4)
    assert energy_balance(sim.outputs()) == pytest.approx(whole, rel=1e-8)


@engines
def test_values_that_follow_from_others_are_accepted_if_they_agree(engine):
    x, speed = slider_at(0.3, 5.0)
    model = with_start(slider_crank(velocity=0.0), "crank", start_angle=0.3, start_omega=5.0)
    both = with_start(model, "slider", start_x=x, start_y=0.0, start_vx=speed, start_angle=0.0)
    found, expected = (started(one, {}, engine=engine).outputs() for one in (both, model))
    assert found == pytest.approx(expected, rel=1e-9, abs=1e-9)


@engines
@pytest.mark.parametrize(
    ("name", "given", "unit"),
    [("start_x", 0.01, "m"), ("start_y", 1e-3, "m"), ("start_vx", 1.0, "m/s"),
     ("start_omega", 2.0, "rad/s")],
)  # fmt: skip
def test_values_that_contradict_the_constraints_are_rejected_with_the_deviation(
    engine, name, given, unit
):
    x, speed = slider_at(0.3, 5.0)
    right = {"start_x": x, "start_vx": speed}.get(name, 0.0)
    model = with_start(slider_crank(velocity=0.0), "crank", start_angle=0.3, start_omega=5.0)
    with pytest.raises(ParameterError) as caught:
        started(with_start(model, "slider", **{name: given}), {}, engine=engine)
    message = str(caught.value)
    assert message.startswith(f"slider.{name} = {given:g} {unit} deviates by {given - right:.6g} ")
    assert message.endswith("; change it to that, or leave it out")


@engines
def test_a_position_out_of_reach_is_rejected_with_what_is_reached(engine):
    """The slider moves to x = 0.4 m at most, which is 0.117 m from its drawn place."""
    model = with_start(slider_crank(velocity=0.0), "slider", start_x=0.2)
    with pytest.raises(EquilibriumError, match=r"slider\.start_x = 0\.2 m cannot be .* 0\.117. m"):
        started(model, {}, engine=engine)


def strut(**start):
    """Return a body on the pin of an inextensible strut, which is straight as drawn."""
    leaf = FlexureType("leaf", "2R", 5e-4, 1e-2, 3e9, 1200.0)
    body = Body("block", 0.05, 2e-5, (0.06, 0.01), {"pin": (0.05, 0.0)}, **start)
    return Mechanism(
        name="Strut", title="A body on a strut", ground={"foot": (0.0, 0.0)}, bodies=(body,),
        flexure_types=(leaf,),
        flexures=(Flexure("strut", "leaf", "ground.foot", "block.pin", ends=("clamp", "pin")),),
        release=Release("block", 90.0), gravity=(0.0, 0.0),
    )  # fmt: skip


@engines
def test_a_strut_that_is_straight_as_drawn_is_not_shortened_to_either_side(engine):
    """Only the position that it has in equilibrium is unique beside the others."""
    model = strut(start_angle=0.0, start_y=4e-3)
    out = started(model, {}, engine=engine).outputs()
    assert out["block.x"] < -5e-5
    given = strut(start_angle=0.0, start_y=4e-3, start_x=out["block.x"])
    again = started(given, {}, engine=engine).outputs()
    assert again["block.y"] == pytest.approx(4e-3, abs=1e-12)
    assert again["energy.elastic"] == pytest.approx(out["energy.elastic"], rel=1e-6)
    for other in (1.5 * out["block.x"], 0.5 * out["block.x"]):
        words = rf"block\.start_x = {other:g} m: .* dead centre, .* has {out['block.x']:.5g}"
        with pytest.raises(ParameterError, match=words):
            started(strut(start_angle=0.0, start_y=4e-3, start_x=other), {}, engine=engine)


def double_pendulum_motion(angles, rates, t):
    """Return the angles of two rods after a time, by Lagrange's equations."""
    m, J, half, whole = 0.4, 3e-3, 0.1, 0.2

    def slope(_, y):
        a, b, va, vb = y
        c, s = math.cos(a - b), math.sin(a - b)
        M = np.array([
            [J + m * half**2 + m * whole**2, m * whole * half * c],
            [m * whole * half * c, J + m * half**2],
        ])  # fmt: skip
        Q = [
            -m * whole * half * s * vb**2 - G * (m * half + m * whole) * math.sin(a),
            m * whole * half * s * va**2 - G * m * half * math.sin(b),
        ]
        return [va, vb, *np.linalg.solve(M, Q)]

    found = solve_ivp(slope, (0.0, t), [*angles, *rates], rtol=1e-11, atol=1e-12)
    return found.y[:2, -1]


@engines
def test_a_double_pendulum_starts_at_two_angles_with_two_rates(engine):
    model = double_pendulum(
        {"start_angle": 1.0, "start_omega": 2.0}, {"start_angle": -2.2, "start_omega": -1.0}
    )
    sim = started(model, {}, engine=engine, tolerance=1e-11)
    out = sim.outputs()
    assert out["lower.angle"] == pytest.approx(-2.2, rel=1e-12)
    assert out["lower.omega"] == pytest.approx(-1.0, rel=1e-12)
    sim.advance(0.5)
    out = sim.outputs()
    expected = double_pendulum_motion((1.0, -2.2), (2.0, -1.0), 0.5)
    assert [out["upper.angle"], out["lower.angle"]] == pytest.approx(expected, abs=1e-7)


@engines
def test_a_body_that_is_not_given_hangs_in_equilibrium(engine):
    out = started(double_pendulum({"start_angle": 1.0}), {}, engine=engine).outputs()
    assert (out["upper.angle"], out["lower.angle"]) == pytest.approx((1.0, 0.0), abs=1e-9)
    assert out["lower.x"] == pytest.approx(0.2 * math.sin(1.0), rel=1e-9)


@engines
def test_a_velocity_that_is_not_given_is_that_after_an_impulse(engine):
    """The impulse at the hip leaves the angular momentum of the lower rod about the knee zero."""
    out = started(double_pendulum({"start_omega": 2.0}), {}, engine=engine).outputs()
    momentum = 3e-3 * out["lower.omega"] + 0.4 * 0.1 * out["lower.vx"]
    assert out["upper.omega"] == pytest.approx(2.0, rel=1e-12)
    assert momentum == pytest.approx(0.0, abs=1e-12)


@engines
def test_a_block_is_placed_on_its_incline(engine):
    model = with_start(incline(30.0), "block", start_x=0.05, start_vx=0.3)
    out = started(model, {}, engine=engine).outputs()
    slope = math.tan(math.radians(30.0))
    assert (out["block.x"], out["block.vx"]) == pytest.approx((0.05, 0.3), rel=1e-12)
    assert (out["block.y"], out["block.vy"]) == pytest.approx((0.05 * slope, 0.3 * slope))


@engines
@pytest.mark.parametrize("model", GUIDES)
def test_a_position_of_a_body_in_flexures_is_that_of_the_release(engine, model):
    """The displacement of the centre of mass along x, or the angle, with the same velocity."""
    guide = mechanism(model)
    body = guide.release.body
    released = started(replace(guide, release=Release(body, 0.0, -4e-3, 0.2)), {}, engine=engine)
    given = with_start(replace(guide, release=Release(body)), body, start_x=-4e-3, start_vx=0.2)
    expected, found = released.outputs(), started(given, {}, engine=engine).outputs()
    assert found == pytest.approx(expected, rel=1e-8, abs=1e-10)


@pytest.mark.parametrize("turn", [0.0, 77.0])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_start_values_turn_and_mirror_with_the_drawing(turn, sign):
    u = np.exp(1j * math.radians(turn))

    def place(z):
        return u * (z if sign > 0.0 else z.conjugate())

    start = {"start_x": 0.02, "start_y": -0.01, "start_angle": 0.3}
    start |= {"start_vx": 0.4, "start_vy": 0.2, "start_omega": -3.0}
    model = with_start(ball(stops=()), "ball", **start)
    one, two = Simulation(model), Simulation(moved(model, place, turn=turn, sign=sign))
    for t in (0.0, 0.3):
        one.advance(t)
        two.advance(t)
        a, b = one.outputs(), two.outputs()
        assert complex(b["ball.x"], b["ball.y"]) == pytest.approx(
            place(complex(a["ball.x"], a["ball.y"])), abs=1e-12
        )
        assert b["ball.angle"] == pytest.approx(sign * a["ball.angle"], rel=1e-12)


@engines
def test_values_at_the_start_are_parameters(engine):
    model = with_start(pendulum(0.0), "bob", start_angle=0.2, start_omega=0.0)
    given = {"bob.start_angle": -0.4, "bob.start_omega": 1.0}
    assert given.keys() <= model.values().keys()
    assert "bob.start_x" not in model.values()
    out = started(model, given, engine=engine).outputs()
    assert (out["bob.angle"], out["bob.omega"]) == pytest.approx((-0.4, 1.0), rel=1e-12)


@engines
@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"release.angle": 0.1}, r"release\.angle = 0\.1 rad: bob\.start_angle gives the start"),
        ({"release.velocity": 2.0}, r"release\.velocity = 2 m/s: bob\.start_omega gives the start"),
    ],
)
def test_a_release_beside_values_of_bodies_is_rejected(engine, values, message):
    model = with_start(pendulum(0.0), "bob", start_angle=0.2, start_omega=1.0)
    with pytest.raises(ParameterError, match=f"{message}; set release"):
        started(model, values, engine=engine)


@engines
def test_a_wall_that_is_penetrated_at_the_start_is_rejected(engine):
    wall = Stop("wall", "bob", (0.0, -LENGTH), 0.0, 0.1)
    model = replace(with_start(pendulum(0.0), "bob", start_angle=0.8), stops=(wall,))
    with pytest.raises(ParameterError, match=r"the wall wall is penetrated by 0\.115207 m at"):
        started(model, {}, engine=engine)


@engines
@pytest.mark.parametrize(
    "model",
    [
        slider_crank(),
        four_bar(stiffness=0.04, free_angle=0.5, damping=1e-4),
        double_pendulum({"start_angle": 1.0}, {"start_angle": 2.0}),
        trammel(velocity=0.5),
    ],
    ids=lambda model: model.name,
)
def test_a_motion_that_is_started_from_all_its_values_continues(engine, model):
    """More values than degrees of freedom, which agree within round-off."""
    sim = started(model, {}, engine=engine, tolerance=1e-11)
    sim.advance(0.1)
    out, again = sim.outputs(), replace(model, release=Release(model.release.body))
    for body in model.bodies:
        names = ("angle", "x", "y", "omega", "vx", "vy")
        start = {f"start_{name}": out[f"{body.name}.{name}"] for name in names}
        again = with_start(again, body.name, **start)
    new = started(again, {}, engine=engine, tolerance=1e-11)
    for t in (0.0, 0.15):
        sim.advance(0.1 + t)
        new.advance(t)
        expected, found = sim.outputs(), new.outputs()
        for name in (f"{b.name}.{key}" for b in model.bodies for key in ("x", "angle", "vy")):
            assert found[name] == pytest.approx(expected[name], abs=1e-6), (name, t)
