"""The rows of ``tests/cases/README.md`` that no other test has, with their independent values.

``dp.toml`` and ``rhombus.toml`` are in ``tests/mechanics/test_body_compliance.py``, the residual
stress of ``comsol.toml`` in ``test_initial_strain.py``, ``qiu10.toml`` in
``tests/shipped/test_curved_bistable.py``.  ``micro``, ``jam``, ``jam2023``, ``buckle``,
``shockpoint`` and ``chatter1016`` have no independent value: ``tests/hybrid/test_units.py``
simulates them.
"""

import math
from dataclasses import replace

import numpy as np
import pytest

import prbm
from kernel_simulation import KernelSimulation
from prbm.analysis.holding import curve
from prbm.analysis.load_path import load_path
from prbm.base.errors import MechanismError
from prbm.files.mechanism_file import read_mechanism
from prbm.hybrid.simulation import Simulation
from prbm.mechanics.assembly import assemble
from prbm.mechanism.parts import Force
from support import CASES

POUND = 4.4482216


def case(name, order=None, forces=None):
    """Return a public case, with another order of its beams and other forces."""
    found = read_mechanism(CASES / f"{name}.toml")
    kinds = found.flexure_types
    if order is not None:
        kinds = tuple(replace(kind, order=order) for kind in kinds)
    return replace(found, flexure_types=kinds, forces=forces or found.forces)


def events(guide, load, last):
    """Return the events of the path to a load: kind, load and displacement."""
    system = assemble(guide, guide.values())
    path = load_path(system, {}, {load: last})
    assert path.ended is None
    return [(kind, point.share * last, system.amount(point.shape.q)) for kind, point in path.events]


@pytest.mark.slow
def test_the_frame_of_lee_has_its_published_limit_load():
    """Finite elements: 18.55 kN at 487 mm; then it snaps back through a second limit point."""
    found = events(case("lee", order=5), "P.y", -22e3)
    first, second = (event for event in found if event[0] == "limit point")
    rests = [event for event in found if event[0] == "rest"]
    assert [abs(load) < 1.0 for _, load, _ in rests] == [True, True]
    assert -first[1] == pytest.approx(18.55e3, rel=2e-3)
    assert first[2] == pytest.approx(0.487, rel=5e-3)
    assert -second[1] < 0.0
    assert second[2] > first[2]


def test_the_toggle_of_williams_has_its_published_limit_load():
    """F. W. Williams, Q. J. Mech. Appl. Math. 17 (1964) 451: about 34 lb, then a minimum."""
    first, second = events(case("williams", forces=(Force("push", "apex"),)), "push.y", -250.0)
    assert first[0] == second[0] == "limit point"
    assert -first[1] / POUND == pytest.approx(34.0, abs=0.3)
    assert -second[1] / POUND < 33.0
    assert second[2] > first[2]


def test_a_mass_on_fibres_hangs_and_converges_to_its_boundary_value_problem():
    """The value is 0.64458 Hz.

    The fibres bend in boundary layers of 2 mm at their ends, which polynomials over 0.6 m resolve
    in part: the error is 3.4 % at order 3 and 0.5 % at order 12.
    """
    errors = [
        prbm.equilibrium(case("ligo_beam", order)).modes.frequency[0] / 0.64458 - 1.0
        for order in (3, 5, 9, 12)
    ]
    assert np.all(np.diff(errors) < 0.0)
    assert 0.0 < errors[-1] < 5e-3
    assert prbm.equilibrium(case("ligo_3R")).modes.frequency[0] == pytest.approx(0.64458, rel=0.06)


@pytest.mark.slow
@pytest.mark.parametrize("engine", [Simulation, KernelSimulation])
def test_a_clock_pendulum_on_a_light_spring_has_the_frequency_of_its_boundary_value_problem(engine):
    """0.497125 Hz.  The inertia of the spring's inner motion is 5e-14 of that of the pendulum."""
    sim = engine(case("clock"), {"damping.beta": 0.0})
    names = ["energy.kinetic", "energy.elastic", "energy.gravitational"]
    first = sum(sim.outputs()[name] for name in names)
    assert sim.outputs()["mode.frequency"] == pytest.approx(0.497125, rel=5e-6)
    sim.advance(5e-3)
    out = sim.outputs()
    assert out["energy.kinetic"] > 0.0
    assert sum(out[name] for name in names) == pytest.approx(first, abs=1e-9 * abs(first))


@pytest.mark.slow
def test_a_ball_falls_and_bounces_by_its_closed_form():
    """After sqrt(2 h/g) = 0.45152 s with sqrt(2 g h) = 4.4294 m/s, and back with 0.7 of it.

    The leaves of 1.8 g, of which a third moves with the ball of 1 kg, delay it by 0.03 %.
    """
    sim = KernelSimulation(case("ball4"), {"weight.y": -9.81})
    sim.advance(0.5)
    out = sim.outputs()
    assert out["floor.impact_count"] == 1
    assert out["floor.impact_time"] == pytest.approx(math.sqrt(2 / 9.81), rel=4e-4)
    assert out["floor.approach_speed"] == pytest.approx(math.sqrt(2 * 9.81), rel=4e-4)
    speed = out["floor.approach_speed"]
    assert out["floor.rebound_speed"] == pytest.approx(0.7 * speed, rel=1e-9)


@pytest.mark.parametrize("engine", [Simulation, KernelSimulation])
def test_a_ball_without_flexures_falls_and_bounces_by_its_closed_form(engine):
    """After sqrt(2 h/g) = 0.45152 s with sqrt(2 g h) = 4.4294 m/s, and back with 0.7 of it."""
    sim = engine(case("ball"))
    sim.advance(0.5)
    out = sim.outputs()
    assert out["floor.impact_time"] == pytest.approx(math.sqrt(2 / 9.81), rel=1e-9)
    assert out["floor.approach_speed"] == pytest.approx(math.sqrt(2 * 9.81), rel=1e-9)
    assert out["floor.rebound_speed"] == pytest.approx(0.7 * math.sqrt(2 * 9.81), rel=1e-9)


def rods(angles):
    """Return mass matrix (2, 2) and Jacobian of the tip (x and y; 2, 2) of rods of 1 m and 1 kg.

    The angles are measured from the vertical [rad].
    """
    couple = 0.5 * math.cos(angles[0] - angles[1])
    M = np.array([[4 / 3, couple], [couple, 1 / 3]])
    return M, np.array([np.cos(angles), np.sin(angles)])


def rubbed(M, J, rates, mu, eps, *, newton=False):
    """Return rates after an impact with a floor, by Routh's impulses and Stronge's restitution.

    The tip has velocities (t, n) = J rates.  While the normal impulse grows by dp, it slips, with
    the tangential impulse -mu sign(t) dp, or sticks.  The impact ends when the normal force has
    given back eps^2 of the work of the compression; by Newton's law, when n is -eps n at the start.
    """
    W = J @ np.linalg.solve(M, J.T)
    u, impulse, work, goal = J @ rates, np.zeros(2), 0.0, None
    rebound = -eps * u[1]
    hold = -W[0, 1] / W[0, 0]  # Ratio of the impulses that keeps the tip from slipping.
    while True:
        if u[0] != 0.0:
            f = -mu * math.copysign(1.0, u[0])
        else:
            f = hold if abs(hold) <= mu else math.copysign(mu, hold)
        slope = W @ [f, 1.0]
        ends = [-u[0] / slope[0]] if u[0] * slope[0] < 0.0 else []
        if goal is None:
            ends += [-u[1] / slope[1]] if slope[1] > 0.0 else []
        elif newton:
            ends.append((rebound - u[1]) / slope[1])
        else:
            ends.append((math.sqrt(u[1] ** 2 + 2 * slope[1] * (goal - work)) - u[1]) / slope[1])
        step = min(ends)
        stops = bool(u[0] * slope[0] < 0.0 and step == -u[0] / slope[0])
        last = goal is not None and step == ends[-1]
        work += u[1] * step + 0.5 * slope[1] * step**2
        u, impulse = u + slope * step, impulse + step * np.array([f, 1.0])
        if stops:
            u[0] = 0.0
        elif last:
            return rates + np.linalg.solve(M, J.T @ impulse)
        else:
            u[1], goal = 0.0, work - eps**2 * work


@pytest.mark.parametrize("engine", [Simulation, KernelSimulation])
@pytest.mark.parametrize("mu", [0.0, 0.2, 0.5, 1.0])
@pytest.mark.parametrize("eps", [0.0, 0.5, 1.0])
def test_a_rough_double_pendulum_does_not_gain_energy(engine, mu, eps):
    """Its rates after the impact are those of Routh's method (Stronge, 1990)."""
    model = case("kane")
    changes = {"floor.restitution": eps, "floor.friction": mu}

    def at(t):
        sim = engine(model, changes)
        sim.advance(t)
        out = sim.outputs()
        return out, np.array([out[f"{name}.omega"] for name in ("upper", "lower")])

    out, _ = at(0.02)
    assert out["floor.impact_count"] == 1
    t = out["floor.impact_time"]
    (out, before), (_, after) = at(t - 1e-10), at(t + 1e-10)
    turned = np.array([out["upper.angle"], out["lower.angle"]])
    M, J = rods(np.radians([20.0, 30.0]) + turned)
    np.testing.assert_allclose(after, rubbed(M, J, before, mu, eps), atol=1e-9)
    assert after @ M @ after <= (1 + 1e-12) * (before @ M @ before)


def test_newtons_law_of_restitution_gains_energy_at_a_rough_double_pendulum():
    M, J = rods(np.radians([20.0, 30.0]))
    before = np.array([-0.1, -0.2])
    after = rubbed(M, J, before, 0.7, 0.5, newton=True)
    assert (J @ after)[1] == pytest.approx(-0.5 * (J @ before)[1])
    assert after @ M @ after > 1.5 * (before @ M @ before)


def test_a_resonator_on_straight_beams_has_its_closed_form():
    """The stiffness is 4 12 EI/L^3; the beams add 4 (13/35) of their mass: 14842.9 Hz.

    Four beams that do not stretch are over-constrained as drawn; the message names the remedy.
    """
    with pytest.raises(MechanismError, match="let flexures stretch"):
        prbm.equilibrium(case("comsol"))
    guide = case("comsol", order=5)
    kinds = tuple(replace(kind, axial=True) for kind in guide.flexure_types)
    found = prbm.equilibrium(replace(guide, flexure_types=kinds))
    E, rho, h, b, L = 155e9, 2330.0, 2e-6, 2.25e-6, 200e-6
    k = 48 * E * b * h**3 / 12 / L**3
    mass = rho * b * (250e-6 * 120e-6 + 4 * 13 / 35 * h * L)
    expected = math.sqrt(k / mass) / (2 * math.pi)
    assert expected == pytest.approx(14842.9, rel=1e-5)
    assert found.modes.frequency[0] == pytest.approx(expected, rel=2e-5)


def test_a_column_that_buckles_under_its_weight_rests_where_its_boundary_value_problem_does():
    """134.61 mm, for a leaf without weight; the straight shape is unstable."""
    guide = case("column")
    system = assemble(guide, guide.values({"leaf.density": 1.0}))
    (rest,) = curve(system, [0.12, 0.14]).rests
    assert rest.stable
    assert rest.displacement == pytest.approx(134.61e-3, abs=1e-5)
    assert not prbm.equilibrium(guide).stable


@pytest.mark.slow
def test_a_ball_strikes_a_hinged_beam_as_in_the_series_of_timoshenko():
    """S. P. Timoshenko, Z. Math. Phys. 62 (1913) 198: 4.979 N, 156.39 us, 4.3434e-4 N s."""
    sim = KernelSimulation(case("timo"))
    sim.advance(3e-4)
    out = sim.outputs()
    assert out["hit.peak_force"] == pytest.approx(4.979, rel=1e-4)
    assert out["hit.contact_duration"] == pytest.approx(156.39e-6, rel=1e-4)
    assert out["hit.impulse"] == pytest.approx(4.3434e-4, rel=1e-4)
