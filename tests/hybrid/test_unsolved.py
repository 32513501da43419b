"""A search that fails raises an error with the names of the contacts; the state is unchanged."""

import ctypes
import re
from dataclasses import replace

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException

from kernel_library import KernelError, kernel
from kernel_simulation import KernelMistake, KernelSimulation
from native_host import DISCARD, ERROR, INTERFACES, OK, Instance
from prbm.base import tolerances
from prbm.base.errors import EquilibriumError, SimulationError
from prbm.files.mechanism_file import load
from prbm.hybrid import effort, events, guards
from prbm.hybrid.simulation import Simulation
from prbm.mechanics import complementarity, constraints, contact, statics
from support import CASES, built, mechanism


def vice():
    """Return a guide between two walls."""
    guide = mechanism("PRBDM2R")
    (stop,) = guide.stops
    other = replace(stop, name="right", direction=stop.direction + 180.0, position=0.03)
    return replace(guide, name="Vice", stops=(replace(stop, name="left"), other))


@pytest.mark.slow
@pytest.mark.parametrize("k", [2, 20])
def test_walls_that_close_in_are_rejected(k):
    """Two opposite walls approach a rigid body: no impulses open both gaps."""
    row = np.resize([1.0, -1.0], k)
    W, u, eps = np.outer(row, row), np.full(k, -1.0), np.full(k, 0.5)
    with pytest.raises(SimulationError, match="the walls close in on the mechanism"):
        contact.newton(W, u, eps)
    with pytest.raises(KernelError, match="the walls close in on the mechanism"):
        kernel().newton(k, W, u, eps, 0.0, np.zeros(k))


@pytest.mark.slow
def test_a_wall_that_pushes_where_friction_locks_is_rejected():
    """The push of the wall and its friction together accelerate the point towards the wall."""
    W, u = np.array([[1.0, 2.0], [2.0, 4.0]]), np.array([-1.0, 1.0])
    with pytest.raises(SimulationError, match="friction locks; reduce the friction"):
        contact.stronge(W, u, 1.0, 0.5)
    with pytest.raises(KernelError, match="friction locks; reduce the friction"):
        kernel().stronge(W, u, 1.0, 0.5, 0.0, np.zeros(1), np.zeros(1))


@pytest.mark.slow
def test_several_walls_that_push_where_friction_locks_are_rejected():
    """Without friction, impulses open both gaps: friction is the cause."""
    row = np.array([1.0, 1.0, 2.0, 2.0])
    W, u, eps = np.outer(row, row), np.array([-1.0, -1.0, 1.0, 1.0]), np.full(2, 0.5)
    assert (W @ contact.several(W, u, np.zeros(2), eps) + u)[:2].min() >= 0.0
    with pytest.raises(SimulationError, match="friction locks; reduce the friction of the stops"):
        contact.several(W, u, np.ones(2), eps)
    with pytest.raises(KernelError, match="friction locks; reduce the friction of the stops"):
        kernel().several(2, W, u, np.ones(2), eps, 0.0, np.zeros(4))


@pytest.mark.slow
def test_walls_with_friction_that_close_in_are_rejected():
    """The gaps of opposite walls stay closed without friction too: the walls are the cause."""
    row = np.array([1.0, -1.0, 0.5, 0.5])
    W, u, mu, eps = np.outer(row, row), np.array([-1.0, -1.0, 0.0, 0.0]), np.ones(2), np.zeros(2)
    with pytest.raises(SimulationError, match="the walls close in on the mechanism"):
        contact.several(W, u, mu, eps)
    with pytest.raises(KernelError, match="the walls close in on the mechanism"):
        kernel().several(2, W, u, mu, eps, 0.0, np.zeros(4))


def test_stops_at_one_place_share_the_impulse_of_a_single_stop_evenly():
    """Each of forty stops receives a fortieth of the impulse."""
    k = 40
    W, u, eps = np.ones((k, k)) / 2.0, np.full(k, -3.0), np.full(k, 0.5)
    np.testing.assert_allclose(contact.newton(W, u, eps), 9.0 / k, rtol=1e-12)


def test_an_event_that_cannot_be_located_is_rejected_with_its_name(monkeypatch):
    sim = Simulation(mechanism("PRBDM2R"))
    before = sim.outputs()

    def failing(*_, earliest):
        raise SimulationError("the equations are singular")

    monkeypatch.setattr("prbm.hybrid.guards._corrected_time", failing)
    with pytest.raises(SimulationError, match=r"no impact of stop could be located within .* t = "):
        sim.advance(1.0)
    assert sim.outputs() == before


@pytest.mark.parametrize("engine", [Simulation, KernelSimulation])
def test_an_impact_between_closing_walls_is_rejected_without_change(engine):
    """The guide rests on the left wall, and the right wall arrives within the step."""
    sim = engine(vice(), {"release.displacement": 0.0})
    sim.set({"right.displacement": -0.05})
    before = sim.outputs()
    closing = r"impact at t = 0\.0\d+ s \(left, right\): no impulses open all gaps: the walls close"
    with pytest.raises((SimulationError, KernelMistake), match=closing):
        sim.advance(0.1)
    assert sim.outputs() == before


# -- friction that jams --


def rod():
    """Return a guide and its parameters: the end of a long arm rests on the wall.

    When the end slides to one side, friction increases the normal force (Painleve's paradox).
    """
    guide = mechanism("PRBDM2RAxial")
    (stop,) = guide.stops
    point = ("shuttle.width + 0.3", stop.point[1])
    values = {
        "release.displacement": 0.0, "stop.offset": 0.027, "stop.friction": 2.75,
        "base.acceleration.x": -6.0,
    }  # fmt: skip
    return replace(guide, name="Rod", stops=(replace(stop, point=point),)), values


SIDEWAYS_IMPULSE = {"force.impulse.y": 0.01}
JAM_MESSAGE = (
    r"no forces satisfy the laws of contact and friction at t = 0 s \(stop\): friction jams"
)


PRELOADED = pytest.mark.parametrize(
    "engine", [Simulation, pytest.param(KernelSimulation, marks=pytest.mark.slow)]
)


@pytest.mark.slow
@PRELOADED
def test_a_preload_whose_damping_is_too_fast_is_named(engine, monkeypatch):
    """Two stops are pressed at the start; changes of their phases are not counted as chatter."""
    monkeypatch.setattr(effort, "BURST_STEPS_MAX", 100)  # in the Python engine only
    given = load(CASES / "chatter1016.toml")
    sim = engine(given)
    before = sim.outputs()
    depth = -before["s0.gap"]
    assert depth > 0.0
    with pytest.raises((SimulationError, KernelMistake), match=r"s0 .*preload") as error:
        sim.advance(1e-3)
    assert sim.outputs() == before
    named = re.search(r"s0 is indented by (\S+) m, and its damping", str(error.value))
    assert named is not None
    assert float(named[1]) == pytest.approx(depth, rel=0.01)  # It moves for less than 0.1 ms.


@pytest.mark.slow
@PRELOADED
def test_a_stop_may_change_its_phase_often(engine):
    """At a tenth of the stiffness, 50 us have more switches than a window has other events."""
    sim = engine(load(CASES / "chatter1016.toml"), {"s1.stiffness": 1.067e8})
    depth = -sim.outputs()["s1.gap"]
    sim.advance(5e-5)
    assert 0.0 < -sim.outputs()["s1.gap"] <= depth


@pytest.mark.parametrize("engine", [Simulation, KernelSimulation])
def test_friction_that_jams_is_rejected(engine):
    sim = engine(*rod())
    before = sim.outputs()
    assert before["stop.force"] > 0.5
    sim.set(SIDEWAYS_IMPULSE)
    with pytest.raises((SimulationError, KernelMistake), match=JAM_MESSAGE):
        sim.advance(1e-3)
    assert sim.outputs()["stop.force"] == pytest.approx(before["stop.force"], rel=1e-12)
    sim.set({"force.impulse.y": 0.0})
    sim.advance(1e-3)
    assert sim.outputs()["stop.contact"]


@pytest.fixture(scope="module")
def rods(tmp_path_factory):
    """Return the native FMUs of the rod by version of FMI."""
    folder, (guide, _) = tmp_path_factory.mktemp("rods"), rod()
    for fmi in (2, 3):
        (folder / f"{fmi}.fmu").write_bytes(built(guide, fmi=fmi))
    return {fmi: folder / f"{fmi}.fmu" for fmi in (2, 3)}


@pytest.mark.slow
@pytest.mark.fmu
@pytest.mark.native
@pytest.mark.parametrize(("fmi", "kind"), INTERFACES)
def test_friction_that_jams_is_logged_by_fmus_which_work_after_a_reset(rods, fmi, kind):
    """A step of co-simulation is discarded; an update of discrete states is an error."""
    _, values = rod()
    with Instance(rods[fmi], kind).initialize(values=values) as instance:
        if kind == "cs":
            assert instance.set(SIDEWAYS_IMPULSE) == OK
            assert instance.step(0.0, 1e-3) == DISCARD
        else:
            with pytest.raises(FMICallException) as caught:
                instance.change(SIDEWAYS_IMPULSE)
            assert caught.value.status in (DISCARD, ERROR)
        assert any(re.search(JAM_MESSAGE, text) for text in instance.messages)
        instance.reset()
        instance.initialize(values=values).advance(2e-3)
        assert instance.values()["stop.contact"]


# -- many contacts --


def many_contacts():
    """Return a guide with 24 stops along one wall and eight points with friction."""
    guide = mechanism("PRBDM2RAxial")
    stops = tuple(replace(guide.stops[0], name=f"wall{k}") for k in range(24))
    points = tuple(replace(guide.frictions[0], name=f"point{k}") for k in range(8))
    values = {"release.displacement": 0.0, "force.y": 0.2}
    for k in range(8):
        values |= {f"point{k}.coefficient": 0.3, f"point{k}.normal_force": 0.1 + 0.01 * k}
    values |= {f"wall{k}.friction": 0.1 + 0.01 * k for k in range(12)}
    return replace(guide, name="Crowd", stops=stops, frictions=points), values


def test_many_contacts_at_rest_bear_the_force_of_one_stop():
    """In both engines, the stops share the force of one stop, and the body does not slide."""
    guide, values = many_contacts()
    twins = [engine(guide, values) for engine in (Simulation, KernelSimulation)]
    alone = Simulation(mechanism("PRBDM2RAxial"), {"release.displacement": 0.0})
    for sim in twins:
        sim.advance(1e-2)
        out = sim.outputs()
        force = sum(out[f"wall{k}.force"] for k in range(24))
        assert force == pytest.approx(alone.outputs()["stop.force"], rel=1e-3)
        # Vibrations along the flexures have decayed to the tolerance of the integration.
        assert abs(out["shuttle.vy"]) < 1e-6


@pytest.mark.slow
@pytest.mark.fmu
@pytest.mark.native
@pytest.mark.parametrize("fmi", [2, 3])
def test_many_contacts_at_rest_bear_the_same_forces_in_an_fmu(tmp_path, fmi):
    guide, values = many_contacts()
    (tmp_path / "many_contacts.fmu").write_bytes(built(guide, fmi=fmi))
    expected = KernelSimulation(guide, values)
    expected.advance(1e-2)
    with Instance(tmp_path / "many_contacts.fmu").initialize(values=values) as instance:
        assert instance.step(0.0, 1e-2) == OK
        found = instance.values()
        for k in range(24):
            force = expected.get(f"wall{k}.force")
            assert found[f"wall{k}.force"] == pytest.approx(force, abs=1e-9)


# -- limits of searches --

LIMITS = [
    ("LOCATION_ITERATIONS_MAX", guards, {}, "no impact of stop could be located within"),
    (
        "CONSTRAINT_ITERATIONS_MAX",
        constraints,
        {},
        "the loops of the mechanism could not be closed",
    ),
    ("PIVOTS_FACTOR", complementarity, {}, r"impact at t = 0\.\d+ s \(stop\): no impulses"),
    ("PIVOTS_FACTOR", complementarity, {"release.displacement": 0.0}, r"\(stop\): friction jams"),
    ("EVENTS_MAX", events, {"stop.restitution": 0.3}, r"more than 1 events \(last: \w+\)"),
    ("STATICS_ITERATIONS_MAX", statics, {}, "no static equilibrium under gravity was found"),
]


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["package", "kernel"])
@pytest.mark.parametrize(("limit", "module", "values", "message"), LIMITS)
def test_a_search_that_ends_at_its_limit_is_an_error(
    monkeypatch, engine, limit, module, values, message
):
    """The limit is lowered below the number of iterations that the search needs."""
    lowered = {"PIVOTS_FACTOR": 0, "CONSTRAINT_ITERATIONS_MAX": 0}.get(limit, 1)
    if engine == "package":
        monkeypatch.setattr(module, limit, lowered)
    old = f"enum {{ {limit} = {getattr(tolerances, limit)} }};"
    changes = (("generated.h", old, f"enum {{ {limit} = {lowered} }};"),)
    guide = mechanism("PRBDM2R")

    def run():
        if engine == "kernel":
            return KernelSimulation(guide, values, changes=changes).advance(1.0)
        return Simulation(guide, values).advance(1.0)

    with pytest.raises((SimulationError, EquilibriumError, KernelMistake), match=message):
        run()


SWEEPS = ("generated.h", "enum { ROTATION_SWEEPS_MAX = 60 };", "enum { ROTATION_SWEEPS_MAX = 1 };")
EVENTS = ("generated.h", "enum { EVENTS_AT_ONCE_MAX = 16 };", "enum { EVENTS_AT_ONCE_MAX = 0 };")
SINGULAR = (
    "hybrid/guards.c",
    """if (!evaluate_equations(&sim->equations, t, y, at.v, at.extra, NULL, evaluation,
                                &problem)) {""",
    'if (!fail(&problem, "the equations are singular")) {',
)


@pytest.mark.slow
def test_eigenvalues_without_convergence_are_rejected():
    with pytest.raises(KernelMistake, match="the eigenvalues of a matrix did not converge"):
        KernelSimulation(mechanism("PRBDM2R"), changes=(SWEEPS,))


@pytest.mark.slow
def test_a_guard_that_cannot_be_evaluated_is_an_error():
    """If the guard returned zero instead of an error, the engine would locate a release."""
    rubs = {"release.displacement": 0.0, "stop.friction": 0.5}
    sim = KernelSimulation(mechanism("PRBDM2R"), rubs, changes=(SINGULAR,))
    before = sim.outputs()
    with pytest.raises(KernelMistake, match=r"no release of stop could be .*: the equations are"):
        sim.advance(1e-3)
    assert sim.outputs() == before


@pytest.mark.slow
def test_too_many_events_at_one_time_are_rejected_in_model_exchange():
    sim = KernelSimulation(mechanism("PRBDM"), {"release.displacement": 0.0}, exchange=True,
                           changes=(EVENTS,))  # fmt: skip
    sim.set({"base.acceleration.x": 100.0})
    with pytest.raises(KernelMistake, match=r"more than 0 events \(last: release of stop\) at"):
        sim.call("exchange_event", ctypes.byref(ctypes.c_bool()))
