"""Springs that act on one side: closed forms, energy, phases, equilibria, both engines."""

import ctypes
import json
import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

import prbm
from exchange import assert_directional, integrate
from free_bodies import pendulum
from kernel_simulation import KernelSimulation
from moved_drawings import moved
from prbm.base.errors import EquilibriumError, MechanismError, ParameterError
from prbm.hybrid.simulation import Simulation
from prbm.mechanics.contact_state import SpringPhase
from prbm.mechanics.inputs import input_names
from prbm.mechanism.parts import Force, Release, Spring, Stop
from prbm.runs.engine import simulation as started
from random_mechanisms import seeded
from springs import one_sided, oscillator, web
from support import energy_balance

MASS, STIFFNESS, OMEGA, G = 2.0, 200.0, 10.0, 9.81
ENGINES = ["python", pytest.param("kernel", marks=pytest.mark.native)]
engines = pytest.mark.parametrize("engine", ENGINES)
SLACK, ACTING, LAGGING = SpringPhase


def events(engine, model, end):
    """Return the times at which the first spring changes its phase, and the simulation."""
    found = []
    if engine == "python":
        sim = Simulation(model, tolerance=1e-12)
        apply = sim._apply

        def applied(event):
            apply(event)
            found.append(event.time)

        sim._apply = applied
        sim.advance(end)
        return found, sim
    sim, event = KernelSimulation(model, tolerance=1e-12), ctypes.c_bool()
    effort = (ctypes.c_double * 2)()
    while sim.get("time") < end:
        sim.call("simulation_advance_some", end, False, effort, ctypes.byref(event))
        if event.value:
            found.append(sim.get("time"))
            sim.call("simulation_handle_event")
    return found, sim


def acting(x, v, c, weight):
    """Return the strain, and the force, of m x'' = weight - k x - c x' as functions of the time."""
    d, rest = c / (2.0 * MASS), weight / STIFFNESS
    w = math.sqrt(OMEGA**2 - d**2)
    a, b = x - rest, (v + d * (x - rest)) / w

    def strain(t):
        return rest + math.exp(-d * t) * (a * math.cos(w * t) + b * math.sin(w * t))

    def rate(t):
        one, other = b * w - d * a, a * w + d * b
        return math.exp(-d * t) * (one * math.cos(w * t) - other * math.sin(w * t))

    return strain, rate, lambda t: STIFFNESS * strain(t) + c * rate(t)


def first_fall(force, end=1.0):
    """Return the first time at which a force falls to zero; None: it does not."""
    grid = np.linspace(1e-9, end, 2000)
    values = np.array([force(t) for t in grid])
    falls = np.flatnonzero((values[:-1] > 0.0) & (values[1:] <= 0.0))
    return brentq(force, *grid[falls[0] : falls[0] + 2], xtol=1e-15) if falls.size else None


def thrown(c, speed=1.5, bounces=2):
    """Return the times of all changes for a mass that is thrown up from rest on its spring.

    The second value is the speed at the last one, at which the spring is at its free length.
    """
    x, v, t, up, found = MASS * G / STIFFNESS, -speed, 0.0, 0.0, []
    for _ in range(bounces):
        strain, rate, force = acting(x, v, c, MASS * G)
        hold = first_fall(force)
        if hold is None:
            break
        x, v, t = strain(hold), rate(hold), t + hold
        found.append(t)
        up = math.sqrt(v * v - 2.0 * G * max(x, 0.0))  # The speed at the free length.
        if c:
            t += (-v - up) / G
            found.append(t)
        t += 2.0 * up / G
        found.append(t)
        x, v = 0.0, up
    return found, up


def hanging(c=0.0, **release):
    model = oscillator(acts="tension", damping=c, parts={"gravity": (G, 0.0)})
    return replace(model, release=Release("block", **release))


@engines
@pytest.mark.parametrize("c", [0.0, 4.0, 8.0])
def test_a_mass_thrown_up_on_a_spring_in_tension_is_slack_in_flight(engine, c):
    """It acts, lags and is slack in turn; flights are parabolas, and times have closed forms."""
    model = hanging(c, displacement=MASS * G / STIFFNESS, velocity=-1.5)
    expected, up = thrown(c)
    found, sim = events(engine, model, expected[-1] + 0.05)
    assert found == pytest.approx(expected, abs=1e-9)
    start = 0.5 * MASS * 1.5**2 - 0.5 * (MASS * G) ** 2 / STIFFNESS
    strain, rate, force = acting(0.0, up, c, MASS * G)
    out = sim.outputs()
    assert energy_balance(out) == pytest.approx(start, abs=1e-9)
    assert out["block.x"] == pytest.approx(strain(0.05), abs=1e-9)
    assert out["block.vx"] == pytest.approx(rate(0.05), abs=1e-8)
    assert out["coil.force"] == pytest.approx(force(0.05), abs=1e-6)


def test_undamped_times_are_those_of_sines_and_parabolas():
    """The reference itself: slack after asin(w x/v)/w, and tight after 2 v/g."""
    x = MASS * G / STIFFNESS
    slack = math.asin(OMEGA * x / 1.5) / OMEGA
    up = math.sqrt(1.5**2 - (OMEGA * x) ** 2)
    held = 2.0 * (math.pi - math.atan(up / (OMEGA * x))) / OMEGA
    times = np.cumsum([slack, 2.0 * up / G, held, 2.0 * up / G])
    assert thrown(0.0)[0] == pytest.approx(times, abs=1e-12)


@engines
@pytest.mark.parametrize("zeta", [0.0, 0.2])
def test_a_bumper_throws_back_after_half_a_period(engine, zeta):
    """Without a damper the contact lasts pi sqrt(m/k).

    With one, the force ends where x'' = 0, and the speed has fallen by exp(-zeta w t).
    """
    release = {"release": Release("block", velocity=-0.5)}
    c = 2.0 * zeta * OMEGA * MASS
    bumper = oscillator(acts="compression", free_length=0.09, damping=c, parts=release)
    d, w = zeta * OMEGA, OMEGA * math.sqrt(1.0 - zeta**2)
    contact = (math.pi - math.atan2(2.0 * d * w, w * w - d * d)) / w
    found, sim = events(engine, bumper, 0.6)
    assert found[0] == pytest.approx(0.01 / 0.5, abs=1e-9)
    assert found[1] - found[0] == pytest.approx(contact, abs=1e-9)
    assert sim.outputs()["block.vx"] == pytest.approx(0.5 * math.exp(-d * contact), abs=1e-9)
    if zeta == 0.0:
        assert contact == pytest.approx(math.pi * math.sqrt(MASS / STIFFNESS))


@engines
def test_an_impact_changes_the_phase_of_a_damped_spring_at_once(engine):
    """The block lags on its way to the stop; thrown back, it strains the spring again."""
    model = oscillator(acts="tension", damping=80.0, parts={
        "stops": (Stop("stop", "block", (0.1, 0.0), 180.0, -0.01, restitution=0.8),),
        "release": Release("block", displacement=0.02, velocity=-1.0),
    })  # fmt: skip
    sim = started(model, {}, engine=engine, tolerance=1e-11)
    sim.advance(0.0099)
    assert sim.outputs()["coil.force"] == 0.0
    sim.advance(0.0101)
    out = sim.outputs()
    assert out["block.vx"] > 0.5
    force = STIFFNESS * out["block.x"] + 80.0 * out["block.vx"]
    assert out["coil.force"] == pytest.approx(force, rel=1e-9)
    sim.advance(0.3)
    assert energy_balance(sim.outputs()) == pytest.approx(0.5 * 2.0 + 0.04, abs=1e-8)


@engines
@pytest.mark.parametrize("tolerance", [1e-5, 1e-9])
def test_a_stretched_spring_never_pushes_however_its_damper_moves(engine, tolerance):
    """It lags while the damper would push, and acts again: the force is max(0, k x + c x')."""
    k, c, length = 20.0, 4.0, 0.07
    model = oscillator()
    rod = Spring("rod", *(model.springs[0].start, model.springs[0].end), k, length, damping=c,
                 acts="tension")  # fmt: skip
    model = replace(model, springs=(*model.springs, rod))
    sim = started(model, tolerance=tolerance, engine=engine)
    signs = []
    for t in np.linspace(0.0, 0.4, 17).tolist():
        sim.advance(t)
        out = sim.outputs()
        force = k * (out["rod.length"] - length) + c * out["rod.length_rate"]
        assert out["rod.length"] > length
        assert out["rod.force"] == pytest.approx(max(0.0, force), abs=1e-3 * tolerance**0.25)
        signs.append(force > 0.0)
    assert np.count_nonzero(np.diff(signs)) == 2


@engines
@pytest.mark.parametrize("c", [0.0, 5.0])
def test_a_block_at_the_free_length_stays_there_without_events(engine, c):
    found, sim = events(engine, hanging(c), 0.0)
    model = oscillator(acts="tension", damping=c, displacement=0.0)
    found, sim = events(engine, model, 2.0)
    assert found == []
    assert sim.outputs()["block.x"] == pytest.approx(0.0, abs=1e-12)


@engines
@pytest.mark.parametrize("acts", ["tension", "compression"])
def test_a_damped_spring_from_the_pin_of_a_pendulum_to_its_body_never_changes_its_phase(
    engine, acts
):
    """Its length is constant: its strain and the rate of it are round-off."""
    bob = pendulum(0.7)
    points = {**bob.bodies[0].points, "end": (0.113, -0.257)}
    coil = Spring("coil", "ground.pin", "bob.end", 17.0, damping=0.13, acts=acts)
    model = replace(bob, bodies=(replace(bob.bodies[0], points=points),), springs=(coil,))
    found, sim = events(engine, model, 0.5)
    assert found == []
    assert sim.outputs()["coil.force"] == pytest.approx(0.0, abs=1e-12)


SIDES = {
    "mixed": ("tension", "compression", "tension", "both", "compression"),
    "tension": ("tension",) * 5,
    "compression": ("compression",) * 5,
}


@pytest.mark.parametrize("name", SIDES)
@pytest.mark.native
def test_both_engines_move_a_web_alike_and_its_energy_is_kept(name):
    """Forces have the sign of their side, and the dissipated energy never decreases."""
    model = one_sided(SIDES[name])
    wall = Stop("wall", "plate", (-0.04, 0.0), 180.0, 4e-3, restitution=0.6, friction=0.2)
    model = replace(model, stops=(wall,))
    python, kernel = (
        started(model, {}, engine=engine, tolerance=1e-10) for engine in ("python", "kernel")
    )
    balance, lost = energy_balance(python.outputs()), 0.0
    for t in np.linspace(0.0, 0.5, 26):
        python.advance(float(t))
        kernel.advance(float(t))
        expected = python.outputs()
        assert kernel.outputs() == pytest.approx(expected, rel=1e-8, abs=1e-8)
        assert kernel.step_count == python.step_count
        assert energy_balance(expected) == pytest.approx(balance, abs=1e-8)
        assert expected["energy.dissipated"] >= lost - 1e-12
        lost = expected["energy.dissipated"]
        for spring in model.springs:
            assert spring.side * expected[f"{spring.name}.force"] >= -1e-9 * (spring.side != 0)


@pytest.mark.native
@pytest.mark.parametrize("phase", SpringPhase)
def test_directional_derivatives_in_each_phase_equal_differences(phase):
    model = one_sided(SIDES["mixed"])
    phases = [phase if spring.side else ACTING for spring in model.springs]
    assert_directional(model, {}, dict.fromkeys(input_names(model), 0.1), (), coils=phases)


@pytest.mark.native
@pytest.mark.parametrize("name", SIDES)
def test_model_exchange_moves_a_web_as_co_simulation(name):
    model = one_sided(SIDES[name])
    exchange = KernelSimulation(model, {}, exchange=True)
    direct = started(model, {}, engine="kernel", tolerance=1e-11)
    [*integrate(exchange, 0.3, h=2e-4)]
    direct.advance(exchange.get("time"))  # Events shift the steps of the importer.
    found, expected = exchange.outputs(), direct.outputs()
    for name in ("plate.x", "ring.y", "ring.angle", "one.force", "four.length_rate"):
        assert found[name] == pytest.approx(expected[name], rel=1e-6, abs=1e-8), name
    assert found["energy.dissipated"] == pytest.approx(expected["energy.dissipated"], rel=1e-6)


@pytest.mark.native
@pytest.mark.parametrize("c", [0.0, 4.0])
def test_model_exchange_locates_the_phases_of_a_thrown_mass(c):
    model = hanging(c, displacement=MASS * G / STIFFNESS, velocity=-1.5)
    exchange, (expected, _) = KernelSimulation(model, {}, exchange=True), thrown(c)
    times, event = [], exchange.event
    assert exchange.coils() == [ACTING]

    def counted():
        changed = event()
        times.append(exchange.get("time"))
        return changed

    exchange.event = counted
    [*integrate(exchange, expected[-1] + 1e-3, h=1e-4)]
    assert times == pytest.approx(expected, abs=1e-8)


@pytest.mark.parametrize("change", ["turned", "mirrored", "shifted"])
def test_one_sided_springs_do_not_depend_on_the_frame(change):
    """The frequency of a rest shape in which all springs are slack is left out."""
    model = replace(one_sided(SIDES["mixed"]), gravity=(0.0, 0.0))
    u = complex(math.cos(1.1), math.sin(1.1))
    other = {
        "turned": lambda: moved(model, lambda z: u * z, turn=math.degrees(1.1)),
        "mirrored": lambda: moved(model, lambda z: z.conjugate(), sign=-1.0),
        "shifted": lambda: moved(model, lambda z: z + 0.4 - 0.3j),
    }[change]()
    first, second = (Simulation(m, tolerance=1e-11) for m in (model, other))
    for sim in (first, second):
        sim.advance(0.15)
    expected, found = first.outputs(), second.outputs()
    for name in expected:
        kind = name.rpartition(".")[2]
        if name.startswith("energy.") or kind in ("force", "length", "length_rate"):
            assert found[name] == pytest.approx(expected[name], rel=1e-7, abs=1e-9), name


@engines
@pytest.mark.parametrize("c", [0.0, 4.0])
def test_a_saved_state_continues_in_its_phase_bit_for_bit(engine, c):
    model = hanging(c, displacement=MASS * G / STIFFNESS, velocity=-1.5)
    times, _ = thrown(c)
    sim = started(model, {}, engine=engine)
    for a, b in zip(times, [*times[1:], times[-1] + 0.02], strict=True):
        middle = 0.5 * (a + b)
        sim.advance(middle)
        saved = sim.snapshot()
        sim.advance(times[-1] + 0.1)
        expected = sim.outputs()
        sim.restore(json.loads(json.dumps(saved)) if engine == "python" else saved)
        sim.advance(times[-1] + 0.1)
        assert sim.outputs() == expected
        sim.restore(saved)


@pytest.mark.slow
def test_a_saved_state_with_a_wrong_phase_is_rejected():
    sim = Simulation(one_sided(SIDES["mixed"]))
    for wrong in ([1] * 4, [3, 1, 1, 1, 1], [1, 1, 1, 0, 1]):
        saved = sim.snapshot()
        saved["front"]["springs"] = wrong
        with pytest.raises(ParameterError, match="the saved state is damaged"):
            sim.restore(saved)


# --- equilibria and modes ---------------------------------------------------------------------


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("free", [0.08, 0.1, 0.13])
def test_a_weight_hangs_where_its_spring_in_tension_carries_it(engine, free):
    """The spring may be slack as drawn: the weight falls until it carries the load."""
    model = oscillator(
        displacement=0.0, acts="tension", free_length=free, parts={"gravity": (G, 0.0)}
    )
    length = free + MASS * G / STIFFNESS
    across = math.sqrt(G / length) / (2.0 * math.pi)
    sim = started(model, {}, engine=engine)
    assert sim.outputs()["mode.frequency"] == pytest.approx(across, rel=1e-9)
    if engine == "python":
        shape = prbm.equilibrium(model)
        assert shape.positions["block"].x == pytest.approx(length - 0.1, abs=1e-12)
        found = prbm.modes(model).frequency
        assert found == pytest.approx([0.0, across, OMEGA / (2.0 * math.pi)], abs=1e-9)


@pytest.mark.parametrize(("acts", "force"), [("tension", (0.0, 4.0)), ("compression", (-4.0, 0.0))])
def test_a_held_block_has_the_force_of_its_side(acts, force):
    model = oscillator(acts=acts, displacement=0.0)
    for held, expected in zip((-0.02, 0.02), force, strict=True):
        assert prbm.equilibrium(model, held=held).force == pytest.approx(expected, abs=1e-12)


def test_a_slack_spring_has_no_stiffness_and_leaves_its_block_free():
    slack = oscillator(acts="compression", free_length=0.05, displacement=0.0)
    assert prbm.modes(slack).frequency == pytest.approx(np.zeros(3), abs=1e-12)
    assert Simulation(slack).outputs()["mode.frequency"] == 0.0


def test_a_weight_that_no_spring_can_carry_is_named():
    parts = {"gravity": (G, 0.0), "forces": (Force("push", "block"),)}
    model = oscillator(acts="compression", displacement=0.0, parts=parts)
    with pytest.raises(EquilibriumError, match="carry no load while they are slack"):
        prbm.equilibrium(model)


def test_sides_and_cubic_stiffnesses_are_checked():
    with pytest.raises(MechanismError, match=r"coil\.acts = 'pull' must be both, tension"):
        Spring("coil", "ground.a", "block.b", 1.0, acts="pull")
    with pytest.raises(ParameterError, match=r"coil\.cubic_stiffness = -1 .* at least 0"):
        oscillator(acts="tension", cubic_stiffness=-1.0)
    assert Simulation(oscillator(cubic_stiffness=-1.0)).contacts.springs == ()


@pytest.mark.parametrize(
    "seed", [*range(1, 4), *(pytest.param(k, marks=pytest.mark.slow) for k in range(4, 16))]
)
def test_random_mechanisms_with_one_sided_springs_keep_their_energy(seed):
    sim = Simulation(seeded(seed, springs=3, friction=False, damping=False), tolerance=1e-10)
    start, scale = energy_balance(sim.outputs()), sim.configuration.scales.energy
    sim.advance(0.03)
    assert energy_balance(sim.outputs()) == pytest.approx(start, abs=1e-6 * scale)


def test_the_web_has_springs_of_both_sides():
    assert {s.side for s in one_sided(SIDES["mixed"]).springs} == {-1, 0, 1}
    assert {s.side for s in web().springs} == {0}
