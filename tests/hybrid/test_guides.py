"""Guides: closed forms, independent integrations, reactions, energy, both engines."""

import cmath
import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

from exchange import assert_directional, integrate
from guides import CRANK, ROD, cart, energy, incline, slider_crank, slotted_arm, start, trammel
from kernel_simulation import KernelSimulation
from moved_drawings import moved
from prbm.base.errors import PrbmError
from prbm.hybrid.simulation import Simulation
from prbm.mechanics.inputs import input_names
from prbm.mechanism.parts import Body, Guide, Joint, Spring, Stop

G = 9.81
engines = pytest.mark.parametrize(
    "engine", ["python", pytest.param("kernel", marks=pytest.mark.native)]
)


@engines
@pytest.mark.parametrize("angle", [0.0, 30.0, 90.0, -120.0])
@pytest.mark.parametrize("turning", [False, True])
def test_a_block_slides_down_a_line_with_g_sin_a(engine, angle, turning):
    a = math.radians(angle)
    sim = start(incline(angle, turning=turning), engine)
    for t in (0.1, 0.4):
        sim.advance(t)
        out = sim.outputs()
        s = -G * math.sin(a) * t**2 / 2
        assert out["block.x"] == pytest.approx(s * math.cos(a), abs=1e-10)
        assert out["block.y"] == pytest.approx(s * math.sin(a), abs=1e-10)
        assert out["block.angle"] == pytest.approx(0.0, abs=1e-12)
        assert out["way.force"] == pytest.approx(2.0 * G * math.cos(a), abs=1e-9)
        assert out.get("way.moment", 0.0) == pytest.approx(0.0, abs=1e-12)
        assert out["base.force.x"] == pytest.approx(2.0 * G * math.cos(a) * math.sin(a), abs=1e-9)
        assert energy(out) == pytest.approx(0.0, abs=1e-9)


@engines
def test_a_force_beside_the_line_loads_a_slider_with_a_moment(engine):
    sim = start(incline(0.0), engine)
    sim.set({"push.y": 3.0, "push.moment": 0.4, "push.x": 1.0})
    sim.advance(0.2)
    out = sim.outputs()
    assert out["way.force"] == pytest.approx(2.0 * G - 3.0)
    assert out["way.moment"] == pytest.approx(-0.4)
    assert out["block.vx"] == pytest.approx(0.1)


@engines
def test_a_block_on_an_inclined_line_and_a_spring_vibrates_about_its_rest(engine):
    """Along the line: 2 s'' + 50 s = -2 g sin a, with the spring of 0.2 m up the line."""
    spring = Spring("coil", "block.c", "ground.up", 50.0)
    sim = start(incline(30.0, (spring,), displacement=0.01), engine)
    rest, omega = -2.0 * G * 0.5 / 50.0, 5.0
    assert sim.outputs()["mode.frequency"] == pytest.approx(omega / (2.0 * math.pi))
    for t in (0.3, 1.0):
        sim.advance(t)
        s = rest + (0.01 - rest) * math.cos(omega * t)
        assert sim.outputs()["block.x"] == pytest.approx(s * math.cos(math.pi / 6), abs=1e-8)


def crank_motion(velocity, times, gravity=-G):
    """Return the angle of the crank and its first two rates, from the one equation of motion.

    With the kinetic energy J(theta) theta'^2 / 2 and the potential V(theta),
    J theta'' = -J' theta'^2 / 2 - V'.
    """
    h = 1e-5

    def places(theta):
        p = CRANK * cmath.exp(1j * theta)
        q = p.real + math.sqrt(ROD**2 - p.imag**2)
        return p, q

    def J(theta):
        p, _ = places(theta)
        dp, dq = 1j * p, -p.imag - p.imag * p.real / math.sqrt(ROD**2 - p.imag**2)
        turn = -p.real / math.sqrt(ROD**2 - p.imag**2)  # Of the rod, for one of the crank.
        rod = 0.5 * (dp + dq)
        own = 4e-4 + 0.3 * CRANK**2 / 4 + 0.2 * abs(rod) ** 2 + 1.5e-3 * turn**2
        return own + 0.5 * dq**2

    def V(theta):
        p, _ = places(theta)
        return -gravity * (0.3 + 0.2) * 0.5 * p.imag

    def slope(f, theta):
        return (8 * (f(theta + h) - f(theta - h)) - f(theta + 2 * h) + f(theta - 2 * h)) / (12 * h)

    def acceleration(theta, rate):
        return (-0.5 * slope(J, theta) * rate**2 - slope(V, theta)) / J(theta)

    found = solve_ivp(
        lambda _, y: (y[1], acceleration(*y)), (0.0, times[-1]), (0.5 * math.pi, velocity / CRANK),
        "DOP853", times, rtol=1e-11, atol=1e-11,
    )  # fmt: skip
    return [(th, w, acceleration(th, w)) for th, w in found.y.T]


@engines
def test_a_slider_crank_makes_full_turns(engine):
    """Positions and forces by hand; the motion from one equation for the angle of the crank."""
    times = np.linspace(0.05, 0.9, 9)
    sim = start(slider_crank(), engine)
    for t, (theta, rate, bend) in zip(times, crank_motion(2.0, times), strict=True):
        sim.advance(t)
        out = sim.outputs()
        assert out["crank.angle"] + 0.5 * math.pi == pytest.approx(theta, abs=2e-7)
        theta = out["crank.angle"] + 0.5 * math.pi
        p = CRANK * cmath.exp(1j * theta)
        q = p.real + math.sqrt(ROD**2 - p.imag**2)
        drawn = math.sqrt(ROD**2 - CRANK**2)
        assert out["slider.x"] == pytest.approx(q - drawn, abs=1e-12)
        assert (out["slider.y"], out["slider.angle"]) == pytest.approx((0.0, 0.0), abs=1e-12)
        assert energy(out) == pytest.approx(energy(start(slider_crank(), engine).outputs()))
        # Newton and Euler, for the rod and the slider about the crank pin, and the slider alone.
        rod = q - p
        turn = -rate * p.real / rod.real
        pp = (1j * bend - rate**2) * p
        twist = (-pp.imag + turn**2 * rod.imag) / rod.real
        qq = pp + (1j * twist - turn**2) * rod
        assert qq.imag == pytest.approx(0.0, abs=1e-9)
        inertia = 0.5 * (qq - 1j * -G)
        moment = ((0.01 - 0.02j) * inertia).imag
        about = (rod.conjugate() / 2 * 0.2 * ((pp + qq) / 2 + 1j * G)).imag + 1.5e-3 * twist
        about += ((rod + 0.01 + 0.02j).conjugate() * inertia).imag
        assert out["way.moment"] == pytest.approx(moment, abs=2e-6)
        assert out["way.force"] == pytest.approx((about - moment) / rod.real, abs=2e-5)
    assert theta > 2.0 * math.pi


@engines
def test_a_trammel_draws_an_ellipse(engine):
    """Energy gives the rate, a quadrature the time; Newton's law the forces of both lines."""
    a, b, m, J = 0.2, 0.3, 0.7, 5e-3
    sim = start(trammel(a, b, velocity=0.4, direction=180.0), engine)
    phi0 = math.radians(40.0)

    def inertia(phi):
        return m * ((b * math.sin(phi)) ** 2 + (a * math.cos(phi)) ** 2) + J

    first = sim.outputs()["rod.omega"]
    level = inertia(phi0) * first**2
    for turn in (1.0, 2.5, 4.0):
        phi = phi0 + turn * math.copysign(1.0, -first)
        t = quad(lambda x: math.sqrt(inertia(x) / level), *sorted((phi0, phi)), epsabs=1e-13)[0]
        sim.advance(t)
        out = sim.outputs()
        assert out["rod.angle"] == pytest.approx(-(phi - phi0), abs=1e-8)
        x = b * math.cos(phi), a * math.sin(phi)
        drawn = b * math.cos(phi0), a * math.sin(phi0)
        assert out["pen.x"] + drawn[0] == pytest.approx(x[0], abs=1e-9)
        assert out["pen.y"] + drawn[1] == pytest.approx(x[1], abs=1e-9)
        rate = math.sqrt(level / inertia(phi))
        bend = -m * (b**2 - a**2) * math.sin(phi) * math.cos(phi) * rate**2 / inertia(phi)
        xx = -b * (math.cos(phi) * rate**2 + math.sin(phi) * bend)
        yy = -a * (math.sin(phi) * rate**2 - math.cos(phi) * bend)
        assert out["upright.force"] == pytest.approx(-m * xx, abs=1e-6)
        assert out["level.force"] == pytest.approx(m * yy, abs=1e-6)


@engines
def test_a_pin_in_a_rotating_slot_feels_coriolis_forces(engine):
    """In the frame of the arm, s'' - h alpha'' - s alpha'^2 = 0 and J alpha'' = -s N.

    N = m (2 alpha' s' + s alpha'' - h alpha'^2); the energy is conserved.
    """
    sim, (m, J, h) = start(slotted_arm(), engine), (0.4, 0.03, 0.02)

    def rates(_, y):
        _, s, w, u = y
        bend = -s * m * (2 * w * u - h * w**2) / (J + m * s**2)
        return w, u, bend, h * bend + s * w**2

    times = (0.05, 0.15, 0.3)
    out = sim.outputs()
    w = out["arm.omega"]
    s = 0.12
    begin = 0.0, s, w, out["pin.vx"] + h * w
    found = solve_ivp(rates, (0.0, 0.3), begin, "DOP853", times, rtol=1e-11, atol=1e-12).y.T
    kinetic = energy(out)
    for t, (alpha, s, w, u) in zip(times, found, strict=True):
        sim.advance(t)
        out = sim.outputs()
        z = (s + 1j * h) * cmath.exp(1j * alpha)
        assert out["arm.angle"] == pytest.approx(alpha, abs=1e-8)
        assert out["pin.x"] + 0.12 == pytest.approx(z.real, abs=1e-8)
        assert out["pin.y"] + h == pytest.approx(z.imag, abs=1e-8)
        bend = rates(t, (alpha, s, w, u))[2]
        force = m * (2 * w * u + s * bend - h * w**2)
        assert out["slot.force"] == pytest.approx(force, abs=1e-6)
        assert energy(out) == pytest.approx(kinetic, rel=1e-9)


@engines
def test_a_pin_that_keeps_its_angle_passes_its_moment_on_to_the_arm(engine):
    """The angular momentum about the pivot is conserved, with the rotation of the pin."""
    model = slotted_arm()
    model = replace(model, guides=(replace(model.guides[0], turning=False),))
    sim = start(model, engine)

    def momentum(out):
        z, v = (0.12 + out["pin.x"], 0.02 + out["pin.y"]), (out["pin.vx"], out["pin.vy"])
        own = 0.03 * out["arm.omega"] + 1e-4 * out["pin.omega"]
        return own + 0.4 * (z[0] * v[1] - z[1] * v[0])

    first = sim.outputs()
    for t in (0.1, 0.3):
        sim.advance(t)
        out = sim.outputs()
        assert out["pin.angle"] == pytest.approx(out["arm.angle"], abs=1e-11)
        assert momentum(out) == pytest.approx(momentum(first), rel=1e-9)
        assert energy(out) == pytest.approx(energy(first), rel=1e-9)
    assert abs(out["slot.moment"]) > 1e-6


@engines
def test_a_cart_with_a_tray_keeps_its_energy(engine):
    sim = start(cart(), engine)
    first = energy(sim.outputs())
    for t in (0.1, 0.5):
        sim.advance(t)
        assert energy(sim.outputs()) == pytest.approx(first, abs=1e-9)
    out = sim.outputs()
    assert out["energy.dissipated"] > 1e-4
    # The base feels the weight and the inertia of both bodies.
    assert abs(out["rail.force"] - out["ramp.force"]) > 0.1


@engines
def test_a_released_body_is_displaced_along_its_guides(engine):
    """A trammel at a displacement of its pen along x; a block displaced along x on a line."""
    drawn = 0.3 * math.cos(math.radians(40.0))
    out = start(trammel(displacement=0.02), engine).outputs()
    angle = math.acos((drawn + 0.02) / 0.3)
    assert out["rod.angle"] == pytest.approx(math.radians(40.0) - angle, abs=1e-11)
    block = incline(30.0)
    block = replace(block, release=replace(block.release, direction=0.0, displacement=0.03))
    out = start(block, engine).outputs()
    assert out["block.x"] == pytest.approx(0.03)
    assert out["block.y"] == pytest.approx(0.03 * math.tan(math.pi / 6))
    with pytest.raises(PrbmError, match="guides do not let the body rod move there"):
        start(trammel(displacement=1.0), engine)


@engines
def test_a_slider_at_a_stop_passes_its_impulse_through_the_linkage(engine):
    """The kinetic energy after is that of the same motion reversed, times the restitution^2."""
    stop = Stop("wall", "slider", (0.35, 0.0), 0.0, position=0.03, restitution=0.5)
    sim = start(slider_crank(gravity=(0.0, 0.0), velocity=-2.0, stops=(stop,)), engine)
    before = sim.outputs()["energy.kinetic"]
    sim.advance(0.2)
    out = sim.outputs()
    assert out["wall.impact_count"] == 1
    assert out["energy.kinetic"] == pytest.approx(0.25 * before, rel=1e-8)


@pytest.mark.native
@pytest.mark.parametrize("model", [slider_crank, trammel, slotted_arm, cart, incline])
def test_both_engines_have_the_same_outputs(model):
    given = {"velocity": 0.3} if model in (trammel, incline) else {}
    sims = [sim(model(**given)) for sim in (Simulation, KernelSimulation)]
    for t in (0.0, 0.05, 0.3):
        ours, theirs = (sim.advance(t) or sim.outputs() for sim in sims)
        for name, value in ours.items():
            assert theirs[name] == pytest.approx(value, rel=1e-7, abs=1e-9), (name, t)


@pytest.mark.native
@pytest.mark.parametrize("model", [slider_crank, slotted_arm, cart])
def test_directional_derivatives_are_those_of_differences(model):
    given = model()
    assert_directional(given, {}, dict.fromkeys(input_names(given), 0.1), ())


@pytest.mark.native
@pytest.mark.parametrize("model", [slider_crank, trammel, slotted_arm, cart])
def test_model_exchange_moves_guided_mechanisms_as_co_simulation(model):
    """The crank and the rod of the trammel make full turns."""
    given, end = (model(velocity=4.0) if model in (slider_crank, trammel) else model()), 0.5
    exchange = KernelSimulation(given, {}, exchange=True)
    assert not [*integrate(exchange, end, h=2.0**-12)]
    direct = start(given, "kernel")
    direct.advance(end)
    found, expected = exchange.outputs(), direct.outputs()
    turned = max(abs(expected[f"{body.name}.angle"]) for body in given.bodies)
    assert turned > 2.0 * math.pi or model in (slotted_arm, cart)
    for body in given.bodies:
        for name in (f"{body.name}.x", f"{body.name}.vy", f"{body.name}.angle"):
            assert found[name] == pytest.approx(expected[name], rel=1e-5, abs=1e-7), name
    for guide in given.guides:
        name = f"{guide.name}.force"
        assert found[name] == pytest.approx(expected[name], rel=1e-4, abs=1e-6), name


PLACES = {
    "turned and shifted": (lambda z: z * cmath.exp(0.7j) + (0.3 - 0.2j), math.degrees(0.7), 1.0),
    "mirrored": (lambda z: z.conjugate(), 0.0, -1.0),
}


@engines
@pytest.mark.parametrize("model", [slotted_arm, cart, slider_crank])
@pytest.mark.parametrize("place", PLACES)
def test_results_turn_shift_and_mirror_with_the_drawing(engine, model, place):
    """The left of a line is the right of its mirror image."""
    how, turn, sign = PLACES[place]
    other = moved(model(), how, turn=turn, sign=sign)
    first, other = start(model(), engine), start(other, engine)
    for t in (0.1, 0.3):
        one, two = (sim.advance(t) or sim.outputs() for sim in (first, other))
        for guide in model().guides:
            for name in (f"{guide.name}.force", f"{guide.name}.moment"):
                if name in one:
                    assert two[name] == pytest.approx(sign * one[name], abs=2e-6)


def test_results_scale_with_the_lengths():
    """Lengths times 10, masses times 10^3, inertias times 10^5, times times sqrt(10)."""
    small = slider_crank()
    large = moved(small, lambda z: 10.0 * z)
    bodies = [replace(b, mass=1e3 * b.mass, inertia=1e5 * b.inertia) for b in large.bodies]
    release = replace(large.release, velocity=math.sqrt(10.0) * small.release.velocity)
    large = replace(large, bodies=tuple(bodies), release=release, gravity=small.gravity)
    first, other = start(small, "python"), start(large, "python")
    for t in (0.1, 0.3):
        first.advance(t)
        other.advance(math.sqrt(10.0) * t)
        one, two = first.outputs(), other.outputs()
        assert two["crank.angle"] == pytest.approx(one["crank.angle"], rel=1e-8)
        assert two["way.force"] == pytest.approx(1e3 * one["way.force"], rel=1e-6)
        assert two["way.moment"] == pytest.approx(1e4 * one["way.moment"], rel=1e-6)


def broken(model, *guides, **changes):
    return replace(model, **{"guides": (*model.guides, *guides)} | changes)


@engines
def test_dependent_guides_are_named(engine):
    """Two points of one body on one line, with a slider that keeps its angle already."""
    model = incline(0.0)
    (block,) = model.bodies
    block = replace(block, points={"c": (0.0, 0.0), "d": (0.1, 0.0)})
    twice = broken(model, Guide("again", "block.d", "ground.o", "ground.up"), bodies=(block,))
    with pytest.raises(PrbmError, match=r"constraints of again, way depend on each other"):
        start(twice, engine)
    cross = Guide("cross", "block.c", "ground.o", "ground.side")
    stuck = broken(model, cross, ground={**model.ground, "side": (0.0, 0.1)})
    with pytest.raises(PrbmError, match="prevent every motion"):
        start(stuck, engine)


def test_a_guide_between_bodies_that_fly_freely_is_rejected():
    with pytest.raises(PrbmError, match="slot guides pin along arm, and both fly freely"):
        Simulation(replace(slotted_arm(), joints=()))


@engines
def test_a_guide_to_a_body_on_a_body_that_flies_freely_is_rejected(engine):
    """The arm is joined to a block, and nothing joins arm, block and pin to the ground."""
    model, block = slotted_arm(), Body("block", 1.0, 0.01, (0.0, 0.0), {"o": (0.0, 0.0)})
    model = replace(
        model, bodies=(block, *model.bodies), joints=(Joint("pivot", "block.o", "arm.o"),)
    )
    with pytest.raises(PrbmError, match=r"slot.*fly freely"):
        start(model, engine)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"point": "block.x"}, "way refers to the point 'block.x'"),
        ({"point": "ground.o"}, "choose a point of another body|guides a point of the ground"),
        ({"end": "block.c"}, "points of two bodies"),
        ({"start": "block.c", "end": "block.c"}, "guides block along itself"),
        ({"end": "ground.o"}, "undefined: draw these points apart"),
        ({"start": "ground.side"}, "block.c is drawn 0.08944 m to the right of the line"),
    ],
)
def test_mistakes_are_rejected_with_a_remedy(change, message):
    model = incline(0.0)
    wrong = (replace(model.guides[0], **change),)
    with pytest.raises(PrbmError, match=message):
        Simulation(broken(model, guides=wrong, ground={**model.ground, "side": (0.1, 0.05)}))
