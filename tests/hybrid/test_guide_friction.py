"""Friction along guides: closed forms, independent integrations, both sides, both engines."""

import cmath
import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from exchange import assert_directional, integrate
from guides import (
    CRANK,
    ROD,
    cart,
    energy,
    incline,
    mechanism,
    rough,
    slider_crank,
    slotted_arm,
    start,
    trammel,
)
from kernel_simulation import KernelMistake, KernelSimulation
from prbm.analysis.linear_model import linearize
from prbm.base.errors import PrbmError, SimulationError
from prbm.hybrid import contact_modes
from prbm.hybrid.simulation import Simulation
from prbm.mechanics.contact_state import ContactMode
from prbm.mechanics.inputs import input_names
from prbm.mechanism.parts import Body, Force, Friction, Guide, Release, Spring

G = 9.81
engines = pytest.mark.parametrize(
    "engine", ["python", pytest.param("kernel", marks=pytest.mark.native)]
)


@engines
@pytest.mark.parametrize("turning", [False, True])
@pytest.mark.parametrize("angle", [0.0, 16.0, 17.0, 60.0, 163.5, -120.0, -170.0])
def test_a_block_slides_down_a_line_above_the_angle_of_friction(engine, angle, turning):
    """tan(16.7 deg) = 0.3.  Beyond 90 degrees the guide pushes to the right of its line."""
    a, mu, t = math.radians(angle), 0.3, 0.4
    sim = start(rough(incline(angle, turning=turning), mu), engine)
    sim.advance(t)
    out = sim.outputs()
    pull = -G * math.sin(a)
    s = math.copysign(max(0.0, abs(pull) - mu * G * abs(math.cos(a))), pull) * t**2 / 2
    assert out["block.x"] == pytest.approx(s * math.cos(a), abs=1e-10)
    assert out["block.y"] == pytest.approx(s * math.sin(a), abs=1e-10)
    assert out["way.force"] == pytest.approx(2.0 * G * math.cos(a), abs=1e-9)
    lost = 2.0 * mu * G * abs(math.cos(a) * s)
    assert out["energy.dissipated"] == pytest.approx(lost, abs=1e-9)
    # Along the line, the base carries the friction: mu N in slip, the weight in stick.
    along = (out["base.force.x"] * math.cos(a)) + out["base.force.y"] * math.sin(a)
    rubbed = -2.0 * pull if s == 0.0 else -math.copysign(2.0 * mu * G * math.cos(a), pull)
    assert abs(along) == pytest.approx(abs(rubbed), abs=1e-9)


@engines
@pytest.mark.parametrize(("angle", "stays"), [(10.0, True), (30.0, False), (170.0, True)])
def test_a_block_pushed_up_stops_and_stays_or_slides_back(engine, angle, stays):
    """It stops after v0/(g (sin a + mu cos a)); the time is a state event."""
    a, mu, v0 = math.radians(angle), 0.3, 0.8
    model = rough(incline(angle, velocity=math.copysign(v0, math.sin(a))), mu)
    sim = start(model, engine)
    slows = G * (math.sin(a) + mu * abs(math.cos(a)))
    stop, top = v0 / slows, v0**2 / (2.0 * slows)
    sim.advance(stop - 1e-6)
    assert math.hypot(sim.outputs()["block.vx"], sim.outputs()["block.vy"]) > 1e-7
    t = stop + 0.2
    sim.advance(t)
    out = sim.outputs()
    back = 0.0 if stays else G * (math.sin(a) - mu * abs(math.cos(a))) * 0.2**2 / 2
    assert math.hypot(out["block.x"], out["block.y"]) == pytest.approx(abs(top - back), abs=1e-9)
    assert (math.hypot(out["block.vx"], out["block.vy"]) < 1e-9) == stays


@engines
def test_a_load_across_a_line_holds_a_block_on_either_side(engine):
    """The limit mu N follows the magnitude of the force of the guide, 2 g - push.y."""
    sim = start(rough(incline(0.0), 0.25), engine)
    for k, (along, across, slides) in enumerate(
        [(4.8, 0.0, False), (5.0, 0.0, True), (-4.8, 4.0 * G, False), (-5.0, 4.0 * G, True)]
    ):
        sim = start(rough(incline(0.0), 0.25), engine)
        sim.set({"push.x": along, "push.y": across})
        sim.advance(0.1)
        assert (abs(sim.outputs()["block.vx"]) > 1e-3) == slides, k
        assert sim.outputs()["way.force"] == pytest.approx(2.0 * G - across)


@engines
@pytest.mark.parametrize("angle", [10.0, 50.0, 170.0, -130.0])
def test_a_coefficient_above_one_holds_a_block_on_either_side(engine, angle):
    sim = start(rough(incline(angle), 1.2), engine)
    sim.advance(0.1)
    out, across = sim.outputs(), 2.0 * G * math.cos(math.radians(angle))
    assert math.hypot(out["block.x"], out["block.y"]) < 1e-12
    assert out["way.force"] == pytest.approx(across, abs=1e-9)


@engines
@pytest.mark.parametrize("mu", [0.4, 0.9, 1.1, 3.0])
def test_a_drawer_jams_if_it_is_pushed_too_far_beside_its_guides(engine, mu):
    """The guides, 0.2 m apart, balance a push 0.1 m beside them: N = F/2 each, friction mu F."""
    ends = {"front": (-0.1, 0.0), "rear": (0.1, 0.0)}
    model = mechanism(
        "Drawer", (Body("drawer", 1.0, 1e-3, (0.0, 0.0), ends),),
        tuple(Guide(end, f"drawer.{end}", "ground.o", "ground.a", friction=mu) for end in ends),
        Release("drawer"), ground={"o": (-1.0, 0.0), "a": (1.0, 0.0)},
        forces=(Force("push", "drawer", (0.0, 0.1)),),
    )  # fmt: skip
    sim = start(model, engine, changes={"push.x": 2.0})
    sim.advance(0.5)
    out = sim.outputs()
    assert out["drawer.x"] == pytest.approx(max(0.0, 2.0 - 2.0 * mu) * 0.5**2 / 2, abs=1e-10)
    assert (out["front.force"], out["rear.force"]) == pytest.approx((-1.0, 1.0), abs=1e-9)


@engines
@pytest.mark.parametrize(
    ("angle", "mu", "push"),
    [(37.66, 2.5, (-3.936, 2.901)), (39.58, 2.54, (5.332, -4.608)), (67.66, 2.72, (-1.458, 1.506))],
)
def test_a_rod_on_two_lines_locks_itself(engine, angle, mu, push):
    """It stays where two forces within the cones of friction meet on the line of the push."""
    sim = start(
        rough(trammel(angle=angle), mu), engine, changes={"push.x": push[0], "push.y": push[1]}
    )
    a = cmath.rect(1.0, math.radians(angle))
    first, second = 0.5 * a.real, 0.5j * a.imag  # Ends, and the directions in their cones.
    at, pushed = complex(0.3 * a.real, 0.2 * a.imag), complex(*push)
    slopes = np.linspace(-mu, mu, 2001)
    assert any(_meet(at, pushed, (first, complex(s, 1.0)), second, mu) for s in slopes)
    sim.advance(0.1)
    assert math.hypot(sim.outputs()["pen.x"], sim.outputs()["pen.y"]) < 1e-9


def _meet(at, pushed, one, other, mu):
    """Return whether a force at the second end within its cone completes one at the first end."""
    end, direction = one
    # Moments about the second end give the force at the first end.
    turning = ((end - other).conjugate() * direction).imag
    size = -((at - other).conjugate() * pushed).imag / turning
    rest = -pushed - size * direction
    return abs(rest.imag) <= mu * abs(rest.real)


RODS = (  # Ends, angles of their lines, coefficients, speed, its direction, push and moment.
    ((-0.064 - 0.039j, 0.065 - 0.009j), (0.87, 1.32), (0.9, 0.9), -0.5, 90.0, (-3.0 + 0j, -0.13)),
    ((-0.024 - 0.022j, 0.046 + 0.021j), (2.88, 2.89), (1.5, 0.9), -0.5, 90.0, (0j, -0.11)),
    ((0.077 + 0.022j, 0.086 + 0.024j), (2.9, 1.62), (0.9, 0.9), 0.5, 90.0, (-3.0 + 2j, 0.16)),
)


def rod(case):
    """Return a rod on two rough guides, and the loads on it."""
    ends, angles, coefficients, speed, direction, (push, moment) = case
    ways = [cmath.rect(1.0, angle) for angle in angles]
    lines = {f"{name}{k}": z + u * at for k, (z, u) in enumerate(zip(ends, ways, strict=True))
             for name, at in (("o", 0.0), ("a", 1.0))}  # fmt: skip
    points = {f"e{k}": (z.real, z.imag) for k, z in enumerate(ends)}
    model = mechanism(
        "Rod", (Body("rod", 1.0, 1e-3, (0.0, 0.0), points),),
        tuple(Guide(f"way{k}", f"rod.e{k}", f"ground.o{k}", f"ground.a{k}", friction=mu)
              for k, mu in enumerate(coefficients)),
        Release("rod", direction, velocity=speed), forces=(Force("push", "rod"),),
        ground={name: (z.real, z.imag) for name, z in lines.items()},
    )  # fmt: skip
    return model, {"push.x": push.real, "push.y": push.imag, "push.moment": moment}


@engines
@pytest.mark.parametrize("case", RODS)
def test_a_sliding_rod_has_the_forces_of_the_only_sides_that_are_possible(engine, case):
    """Changes of one side at a time do not find those of the first rod."""
    ends, angles, coefficients, _, _, (push, moment) = case
    ways = [cmath.rect(1.0, angle) for angle in angles]
    model, changes = rod(case)
    out = start(model, engine, changes=changes).outputs()
    v, w = complex(out["rod.vx"], out["rod.vy"]), out["rod.omega"]
    found = []
    for sides in itertools.product((1.0, -1.0), repeat=2):
        A, b = np.eye(5), np.array([push.real, push.imag, moment, 0.0, 0.0])
        A[2, 2] = 1e-3
        for k, (z, u, mu) in enumerate(zip(ends, ways, coefficients, strict=True)):
            sliding = ((v + 1j * w * z) * u.conjugate()).real
            f = 1j * u - mu * sides[k] * math.copysign(1.0, sliding) * u
            A[:3, 3 + k] = -f.real, -f.imag, -(z.conjugate() * f).imag
            A[3 + k] = 0.0
            A[3 + k, :3] = (1j * u).real, (1j * u).imag, (u * z.conjugate()).real
            b[3 + k] = w * w * (z * (1j * u).conjugate()).real
        N = np.linalg.solve(A, b)[3:]
        found += [N] if np.array_equal(np.sign(N), sides) else []
    assert len(found) == 1
    assert (out["way0.force"], out["way1.force"]) == pytest.approx(found[0], rel=1e-6)


def changed_start(case, engine, monkeypatch, limit=None, *, fails=False):
    """Start a rod with another limit of the sides that are tried, or with an error at first."""
    model, given = rod(case)
    if engine == "kernel":
        few = ("generated.h", "SIDES_TRIED_MAX = 64", f"SIDES_TRIED_MAX = {limit}")
        wrong = "    try_contacts(sim, modes);\n    if (eq->slipping_guides == 0) {"
        early = "    static int calls;\n    if (calls++ == 0) {\n"
        early += '        return fail(problem, "another error");\n    }\n'
        failing = ("hybrid/contact_modes.c", wrong, early + wrong)
        return KernelSimulation(model, given, changes=(failing if fails else few,))
    found = [SimulationError("another error")] if fails else []
    sides = contact_modes._guide_on_wrong_side

    def guide_on_wrong_side(*arguments):
        if found:
            raise found.pop()
        return sides(*arguments)

    if limit:
        monkeypatch.setattr(contact_modes, "SIDES_TRIED_MAX", limit)
    monkeypatch.setattr(contact_modes, "_guide_on_wrong_side", guide_on_wrong_side)
    return start(model, engine, changes=given)


@engines
def test_a_search_of_sides_that_is_given_up_names_its_limit(engine, monkeypatch):
    """The forces of the first rod are found by trying all sides."""
    words = r"jams the mechanism; .*; 2 guides have more than the 3 combinations of sides that are"
    with pytest.raises((PrbmError, KernelMistake), match=words):
        changed_start(RODS[0], engine, monkeypatch, limit=3)


@engines
def test_a_search_of_modes_that_is_given_up_names_its_limit(engine, monkeypatch):
    model = rough(incline(30.0, velocity=0.0), 0.9)
    few = ("generated.h", "MODES_TRIED_MAX = 2000", "MODES_TRIED_MAX = 2")
    solve = "found->solved = "
    unsolved = ("hybrid/rest.c", f"{solve}coulomb(", f"{solve}false && coulomb(")
    monkeypatch.setattr(contact_modes, "rest_forces", lambda *_: None)
    monkeypatch.setattr(contact_modes, "MODES_TRIED_MAX", 2)
    words = "of friction; 1 contacts at rest may have more than the 2 combinations of modes"
    with pytest.raises((PrbmError, KernelMistake), match=words):
        Simulation(model) if engine == "python" else KernelSimulation(
            model, changes=(few, unsolved), described=False
        )


@engines
def test_another_error_while_sides_are_tried_is_reported(engine, monkeypatch):
    """On other sides the search would find forces, and the error would be hidden."""
    with pytest.raises((PrbmError, KernelMistake), match="another error"):
        changed_start(RODS[1], engine, monkeypatch, fails=True)


@engines
def test_a_block_without_a_load_across_its_line_slides_freely(engine):
    """The force of the guide is round-off of either sign: it causes no events."""
    model = replace(rough(incline(30.0, velocity=0.5), 0.4), gravity=(0.0, 0.0))
    sim = start(model, engine)
    sim.advance(1.0)
    out = sim.outputs()
    assert math.hypot(out["block.x"], out["block.y"]) == pytest.approx(0.5, abs=1e-9)
    assert out["energy.dissipated"] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("share", [0.5, -0.5])
def test_a_residual_speed_of_a_contact_that_others_hold_is_no_reversal(share):
    """The speeds of contacts that begin to stick vanish with the first projection."""
    model = rough(incline(30.0, velocity=0.0), 0.9)
    model = replace(model, frictions=(Friction("rub", "block", 30.0, 0.2, 1.0),))
    sim = Simulation(model, tolerance=1e-11)
    front, n = sim.front, sim.system.n
    rub, way = front.contacts.modes
    assert ContactMode.STICK in (rub, way)
    (held,) = (c for c, mode in enumerate((rub, way)) if mode is not ContactMode.STICK)
    slips = ContactMode.slipping(-1.0)
    front = front.with_contacts(front.contacts.with_mode(held, slips))
    row, y = front.equations.slip_row(held, front.e), front.y.copy()
    y[n : 2 * n] = row * (share * sim.configuration.scales.zero_speed / (row @ row))
    sim._set_front(replace(front, y=y), [])
    applied = []
    sim._apply = applied.append
    sim.advance(0.01)
    assert applied == []


# --- independent integrations ---------------------------------------------------------------------


def pieces(rates, normal, speed, y, end):
    """Integrate a motion with Coulomb friction, one piece for each sign of force and velocity.

    Parameters
    ----------
    rates : callable
        dy/dt at y for a sign of the friction force, minus the product of both signs.
    normal : callable
        Normal force at y for a sign of the friction force.
    speed : callable
        Sliding velocity at y.
    y : sequence of float
        Initial state.
    end : float
        End of the motion.

    Returns
    -------
    y, changes
        State at the end, and the number of changes of either sign.
    """

    def piece(t, y, side, slip):
        """Integrate to the next change of a sign."""
        events = [lambda _, x: side * normal(x, -side * slip), lambda _, x: slip * speed(x)]
        for event in events:
            event.terminal, event.direction = True, -1.0
        return solve_ivp(
            lambda _, x: rates(x, -side * slip), (t, end), y, "DOP853", rtol=1e-11, atol=1e-12,
            events=events,
        )  # fmt: skip

    t, changes = 0.0, 0
    slip = math.copysign(1.0, speed(y))
    side = 1.0 if normal(y, -slip) > 0.0 else -1.0
    while t < end:
        found = piece(t, y, side, slip)
        t, y = found.t[-1], found.y[:, -1]
        if found.status == 1:
            changes += 1
            side, slip = (-side, slip) if len(found.t_events[0]) else (side, -slip)
    return y, changes


def slider_crank_laws(mu, gravity=-G):
    """Return theta'' and the normal force of the slider at (theta, theta') and a friction sign.

    Both are linear in each other: Lagrange's equation of the crank, and the balance of moments
    about the crank pin of the rod with the slider.
    """
    h = 1e-5

    def places(theta):
        p = CRANK * cmath.exp(1j * theta)
        return p, p.real + math.sqrt(ROD**2 - p.imag**2)

    def slopes(theta):
        p, _ = places(theta)
        root = math.sqrt(ROD**2 - p.imag**2)
        return 1j * p, -p.imag - p.imag * p.real / root, -p.real / root

    def inertia(theta):
        dp, dq, turn = slopes(theta)
        own = 4e-4 + 0.3 * CRANK**2 / 4 + 0.2 * abs(0.5 * (dp + dq)) ** 2 + 1.5e-3 * turn**2
        return own + 0.5 * dq**2

    def loads(theta, rate, bend):
        """Moment of inertia and weight about the crank pin, without that on the guide."""
        p, q = places(theta)
        rod, (_, _, slope) = q - p, slopes(theta)
        turn = slope * rate
        pp = (1j * bend - rate**2) * p
        twist = (-pp.imag + turn**2 * rod.imag) / rod.real
        qq = pp + (1j * twist - turn**2) * rod
        inertial = 0.5 * (qq - 1j * gravity)
        about = (rod.conjugate() / 2 * 0.2 * ((pp + qq) / 2 - 1j * gravity)).imag + 1.5e-3 * twist
        about += ((rod + 0.01 + 0.02j).conjugate() * inertial).imag
        return about - ((0.01 - 0.02j) * inertial).imag, rod

    def solve(theta, rate, sign):
        dJ = (8 * (inertia(theta + h) - inertia(theta - h))
              - inertia(theta + 2 * h) + inertia(theta - 2 * h)) / (12 * h)  # fmt: skip
        weight = gravity * 0.5 * 0.5 * CRANK * math.cos(theta)
        dq = slopes(theta)[1]
        b, rod = loads(theta, rate, 0.0)
        c = loads(theta, rate, 1.0)[0] - b
        # rod.real N - rod.imag sign mu N = b + c theta'';  J theta'' = ... + sign mu N dq.
        A = np.array([[-c, rod.real - rod.imag * sign * mu], [inertia(theta), -sign * mu * dq]])
        return np.linalg.solve(A, [b, -0.5 * dJ * rate**2 + weight])

    return solve, lambda y: slopes(y[0])[1] * y[1]


@engines
def test_a_slider_crank_with_friction_of_its_slider(engine):
    """Normal force and sliding velocity change their signs in each turn."""
    mu, end = 0.2, 0.7
    solve, speed = slider_crank_laws(mu)
    y, changes = pieces(
        lambda y, sign: (y[1], solve(*y, sign)[0]), lambda y, sign: solve(*y, sign)[1], speed,
        (0.5 * math.pi, 20.0), end,
    )  # fmt: skip
    assert changes >= 6
    sim = start(rough(slider_crank(), mu), engine)
    first = energy(sim.outputs())
    sim.advance(end)
    out = sim.outputs()
    assert out["crank.angle"] + 0.5 * math.pi == pytest.approx(y[0], abs=1e-7)
    assert out["crank.omega"] == pytest.approx(y[1], abs=1e-6)
    assert energy(out) == pytest.approx(first, abs=1e-8)


@engines
def test_a_pin_in_a_rough_slot_of_a_rotating_arm(engine):
    """In the frame of the arm: m (s'' - h alpha'' - s alpha'^2) = f, J alpha'' = h f - s N."""
    mu, m, J, h, end = 0.3, 0.4, 0.03, 0.02, 0.6
    spring = 25.0  # N/m, along the slot about s = 0.12.

    def solve(y, sign):
        _, s, w, u = y
        # Unknown: alpha'', s'', N.
        A = [
            [-m * h, m, -sign * mu],
            [J, 0.0, s - h * sign * mu],
            [m * s, 0.0, -1.0],
        ]
        pull = -spring * (s - 0.12)
        right = [m * s * w**2 + pull, h * pull, m * h * w**2 - 2.0 * m * w * u]
        return np.linalg.solve(A, right)

    # A long spring from the arm to the pin pulls along the slot up to 1e-8 of its length.
    model = rough(slotted_arm(), mu)
    far = (-2000.0, 0.02)
    arm = replace(model.bodies[0], points={**model.bodies[0].points, "far": far})
    model = replace(
        model, bodies=(arm, model.bodies[1]),
        springs=(Spring("coil", "arm.far", "pin.c", spring),),
    )  # fmt: skip
    sim = start(model, engine)
    out = sim.outputs()
    w = out["arm.omega"]
    y, changes = pieces(
        lambda y, sign: (y[2], y[3], *solve(y, sign)[:2]), lambda y, sign: solve(y, sign)[2],
        lambda y: y[3], (0.0, 0.12, w, out["pin.vx"] + h * w + 1e-9), end,
    )  # fmt: skip
    assert changes >= 2
    first = energy(out)
    sim.advance(end)
    out = sim.outputs()
    z = (y[1] + 1j * h) * cmath.exp(1j * y[0])
    assert out["arm.angle"] == pytest.approx(y[0], abs=1e-6)
    assert out["pin.x"] + 0.12 == pytest.approx(z.real, abs=1e-6)
    assert out["pin.y"] + h == pytest.approx(z.imag, abs=1e-6)
    assert energy(out) == pytest.approx(first, rel=1e-8)


# --- both engines, model exchange, derivatives ----------------------------------------------------

MODELS = {
    "slider-crank": lambda: rough(slider_crank(), 0.2),
    "trammel": lambda: rough(trammel(velocity=0.4, direction=180.0), 0.1),
    "slot": lambda: rough(slotted_arm(), 0.3),
    "cart": lambda: rough(cart(), 0.15),
    "incline": lambda: rough(incline(30.0, velocity=0.5), 0.3),
}


@pytest.mark.native
@pytest.mark.parametrize("name", MODELS)
def test_both_engines_have_the_same_outputs(name):
    sims = [sim(MODELS[name]()) for sim in (Simulation, KernelSimulation)]
    for t in (0.0, 0.05, 0.3):
        ours, theirs = (sim.advance(t) or sim.outputs() for sim in sims)
        for key, value in ours.items():
            assert theirs[key] == pytest.approx(value, rel=1e-7, abs=1e-8), (key, t)


@engines
@pytest.mark.parametrize("name", MODELS)
def test_friction_takes_the_energy_that_is_lost(engine, name):
    sim = start(MODELS[name](), engine)
    first = energy(sim.outputs())
    for t in (0.1, 0.5):
        sim.advance(t)
        assert energy(sim.outputs()) == pytest.approx(first, abs=1e-8)
    assert sim.outputs()["energy.dissipated"] > 1e-5


@pytest.mark.native
@pytest.mark.parametrize("name", MODELS)
def test_directional_derivatives_are_those_of_differences(name):
    model = MODELS[name]()
    assert_directional(model, {}, dict.fromkeys(input_names(model), 0.1), ())


@pytest.mark.native
@pytest.mark.parametrize("name", ["slider-crank", "slot", "cart", "incline"])
def test_model_exchange_moves_as_co_simulation(name):
    model, end = MODELS[name](), 0.25 if name == "slot" else 0.5
    exchange = KernelSimulation(model, {}, exchange=True)
    for _ in integrate(exchange, end, h=2.0**-12):
        pass
    direct = start(model, "kernel")
    direct.advance(exchange.get("time"))  # After events, the last step ends a little later.
    found, expected = exchange.outputs(), direct.outputs()
    for body in model.bodies:
        for key in (f"{body.name}.x", f"{body.name}.vy", f"{body.name}.angle"):
            assert found[key] == pytest.approx(expected[key], rel=1e-4, abs=1e-6), key


@engines
def test_a_saved_state_continues_with_its_sides(engine):
    sim = start(MODELS["slider-crank"](), engine)
    sim.advance(0.13)
    state = sim.snapshot()
    sim.advance(0.5)
    expected = sim.outputs()
    sim.restore(state)
    sim.advance(0.5)
    assert sim.outputs() == expected


def test_a_loaded_guide_sticks_in_small_motions():
    coil = Spring("coil", "block.c", "ground.up", 50.0)
    loaded = linearize(rough(incline(10.0, (coil,)), 0.3), inputs=["push.x"], outputs=["block.x"])
    assert ("way", "sticking") in loaded.contacts
    with pytest.raises(PrbmError, match="because friction holds the bodies at way:"):
        loaded.default_range()


def test_a_guide_changes_sides_only_while_it_slips():
    sim = Simulation(MODELS["slider-crank"]())
    seen = set()
    for t in np.linspace(0.01, 0.5, 60):
        sim.advance(t)
        contacts = sim.front.contacts
        assert contacts.modes[0] is not ContactMode.OPEN
        seen.add((contacts.modes[0].slip, contacts.sides[0]))
    assert len({side for _, side in seen}) == 2
