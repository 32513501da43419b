"""Native FMUs in an importer written in C (``tests/support/importer``), outside Python."""

from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from c_importer import NATIVE, TWO_STOPS, Job, described, execute, native, run, unpack
from prbm.fmu.start import interface
from prbm.hybrid.simulation import Simulation
from support import GUIDES, SHIPPED, case, each_shipped, mechanism, possible, record

pytestmark = pytest.mark.native

ROUND_OFF_RTOL = {"PRBDM": 1e-11, "PRBDM2RAxial": 1e-5, TWO_STOPS: 1e-5}
"""Tolerance of differences by round-off; mechanisms that are not listed have 1e-8.

PRBDM agrees more closely, in spite of 14 impacts.  Round-off grows by axial modes of 1.5e5 rad/s
(PRBDM2RAxial) and through 63 impacts (two stops).
"""
INTERFACES = ((2, "cs"), (3, "cs"), (3, "events"), (2, "me"), (3, "me"))
END = 0.3  # s; the guides bounce until 0.243 s in the default run, then they rest.
POINTS = 1e-3 * np.arange(round(END / 1e-3) + 1)


def points_of(model: str) -> np.ndarray:
    """Return the communication points of a mechanism."""
    return POINTS if model == TWO_STOPS else np.linspace(0.0, case(model).end, len(POINTS))


@cache
def python_engine(model: str) -> list[dict]:
    """Return the outputs of the Python engine at the communication points."""
    sim = Simulation(described(model))
    rows = []
    for t in points_of(model):
        sim.advance(t)
        rows.append(dict(sim.outputs()))
    return rows


def nominals(model: str) -> dict[str, float]:
    """Return typical magnitudes of the variables that Python and native FMUs have in common."""
    return {v.name: v.nominal or 1.0 for v in interface(described(model), {})}


def assert_close(rows: np.ndarray, expected: list[dict], model: str, tolerance: float) -> None:
    """Compare the outputs of an FMU with those of the Python engine.

    The error of an output is at most the tolerance times the larger of its nominal value and its
    largest magnitude.
    """
    scales = nominals(model)
    for name in expected[0]:
        wanted = np.array([float(row[name]) for row in expected])
        scale = np.maximum(scales[name], np.abs(wanted))
        assert np.abs(rows[name] - wanted).max() <= (tolerance * scale).max(), name


@pytest.mark.slow
@pytest.mark.parametrize(("fmi", "kind"), INTERFACES[:3])
@pytest.mark.parametrize("model", [*SHIPPED, TWO_STOPS])
def test_a_c_importer_reads_the_values_of_the_python_engine(model, fmi, kind):
    """Equations and step control are the same; impacts amplify differences of round-off."""
    expected, points = python_engine(model), points_of(model)
    done = run(Job(native(model, fmi), kind, points))
    rows = done.rows()
    assert (rows["at"] == points).all()
    assert_close(rows, expected, model, ROUND_OFF_RTOL.get(model, 1e-8))
    if model in (*GUIDES, TWO_STOPS):
        assert sum(rows[f"{stop.name}.contact"][-1] for stop in described(model).stops) == 1.0


@each_shipped
def test_co_simulation_of_both_versions_gives_identical_bytes(model):
    def rows(fmi: int, kind: str) -> np.ndarray:
        names = [v for v in nominals(model)]
        return run(Job(native(model, fmi), kind, points_of(model), records=names)).rows()

    first = rows(2, "cs")
    assert first.tobytes() == rows(3, "cs").tobytes()


@each_shipped
def test_event_mode_records_values_before_and_after_each_impact(model):
    it, expected = case(model), record(model)
    done = run(Job(native(model, 3), "events", points_of(model)))
    before, after = done.rows("b"), done.rows("a")
    counts = it.at_stops("impact_count")
    grown = sum(after[name] - before[name] for name in counts)
    hits = np.flatnonzero(grown > 0)
    assert len(hits) == len(expected) > 0
    assert (before["at"] == after["at"]).all()
    for k, impact in zip(hits, expected, strict=True):
        gap_rate = f"{impact.stop}.gap_rate"
        assert after["at"][k] == pytest.approx(impact.time, abs=1e-9)  # s
        assert after[f"{impact.stop}.impact_time"][k] == after["at"][k]
        assert before[gap_rate][k] < 0.0 < after[gap_rate][k]
        assert after[f"{impact.stop}.approach_speed"][k] == pytest.approx(
            -before[gap_rate][k], rel=1e-9
        )


@pytest.mark.parametrize("fmi", [2, 3])
@each_shipped
def test_a_runge_kutta_importer_of_model_exchange_computes_the_same_motion(model, fmi):
    """The steps are at most 20 us, events are located by bisection; the error is below 1e-6 m."""
    it, expected, points = case(model), python_engine(model), points_of(model)
    rows = run(Job(native(model, fmi), "me", points, substep=it.substep(2e-5))).rows()
    wanted = np.array([row[it.released] for row in expected])
    assert np.abs(rows[it.released] - wanted).max() < 1e-6  # m
    assert it.impacts({name: rows[name][-1] for name in rows.dtype.names}) == len(record(model))
    if model in GUIDES:
        assert rows["stop.contact"][-1] == 1.0


@pytest.mark.slow
def test_a_runge_kutta_importer_converges_at_fourth_order_across_impacts():
    """The classical Runge-Kutta method has order 4, also across impacts with friction."""
    points, steps = POINTS[:61], 2e-5 / 2 ** np.arange(4)
    folder = native(TWO_STOPS, 2)
    exact = run(Job(folder, "cs", points, tolerance=1e-12)).rows()["shuttle.x"]
    errors = []
    for step in steps:
        rows = run(Job(folder, "me", points, substep=step)).rows()
        errors.append(np.abs(rows["shuttle.x"] - exact).max())
    assert rows["high.impact_count"][-1] > 0
    slope = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert slope == pytest.approx(4.0, abs=0.2), errors


@pytest.mark.parametrize("how", ["save", "serialize"])
@pytest.mark.parametrize(("fmi", "kind"), INTERFACES)
def test_a_restored_state_continues_bit_for_bit(fmi, kind, how):
    """The state is saved at the start, in flight and at rest.

    It is restored in the same instance or, from its bytes, in another one.
    """
    points = 2e-3 * np.arange(141)
    job = Job(native("PRBDM", fmi), kind, points)
    whole = run(job).output
    for k in (0, 33, 130):
        assert run(job, "interrupt", k, how).output == whole


@pytest.mark.parametrize(("fmi", "kind"), INTERFACES)
def test_instances_in_threads_equal_one_alone(fmi, kind):
    job = Job(native("PRBDM2R", fmi), kind, POINTS[:101])
    assert run(job, "threads", 8).output == run(job).output


@pytest.mark.parametrize("fmi", [2, 3])
def test_the_library_can_be_unloaded_and_loaded_again(fmi):
    run(Job(native("PRBDM", fmi), "cs", POINTS), "reload", 100, 5)


@pytest.mark.parametrize("fmi", [2, 3])
def test_inputs_and_tunable_parameters_have_the_same_effect_as_in_the_python_engine(fmi):
    points = 2.0 + 0.01 * np.arange(21)
    start = {"release.displacement": -0.01, "stop.position": 2e-3, "force.x": 0.05}
    changes = {
        3: {"force.x": 0.3, "base.acceleration.y": 2.0},
        5: {"stop.displacement": 1e-3},
        8: {"stop.restitution": 0.9, "damping.zeta": 0.05},
        12: {"stop.displacement": -1e-3, "force.moment": 1e-3},
    }
    sim = Simulation(mechanism("PRBDM"), start, start_time=2.0, tolerance=1e-9)
    expected = [dict(sim.outputs())]
    for k, (_, end) in enumerate(pairwise(points)):
        sim.set(changes.get(k, {}))
        sim.advance(end)
        expected.append(dict(sim.outputs()))
    job = Job(native("PRBDM", fmi), "cs", points, sets=start, changes=changes, tolerance=1e-9)
    assert_close(run(job).rows(), expected, "PRBDM", 1e-8)
    assert expected[-1]["stop.impact_count"] > 0


# -- the path of the unpacked FMU --

LONG = "x" * 150 + "/" + "y" * 150
PLACES = ("with spaces", "Prüfstand µ", "a#b", "a+b", "100%20 %", "q?x=1&y", LONG)


@pytest.mark.parametrize("place", PLACES, ids=lambda place: place[:12])
@pytest.mark.parametrize("fmi", [2, 3])
def test_an_fmu_runs_wherever_it_is_unpacked(tmp_path, fmi, place):
    folder = unpack(native("PRBDM", fmi).with_suffix(".fmu"), possible(tmp_path / place))
    kind = "cs"
    expected = run(Job(native("PRBDM", fmi), kind)).output
    assert run(Job(folder, kind)).output == expected


def locations(resources: Path) -> dict[str, str]:
    """Return the forms in which importers of FMI 2.0 pass the folder of the resources."""
    uri = NATIVE.uri(resources)
    path = uri.removeprefix("file://")
    return {
        "three slashes": uri,
        "one slash": f"file:{path}",
        "localhost": f"file://localhost{path}",
        "slash at the end": f"{uri}/",
        "not encoded": f"file://{resources}",
        "all encoded": "file:///" + "".join(f"%{b:02x}" for b in str(resources)[1:].encode()),
    }


@pytest.mark.parametrize("form", locations(Path("/")))
def test_every_form_of_the_resource_location_is_accepted(tmp_path, form):
    folder = unpack(native("PRBDM", 2).with_suffix(".fmu"), possible(tmp_path / "Über #1 %20%00"))
    location = locations(folder / "resources")[form]
    expected = run(Job(folder)).output
    assert run(Job(folder, resources=location)).output == expected


@pytest.mark.parametrize(("fmi", "slash"), [(3, ""), (3, "/")])
def test_the_path_of_the_resources_may_end_in_a_slash(fmi, slash):
    folder = native("PRBDM", fmi)
    assert run(Job(folder, resources=str(folder / "resources") + slash)).output


@pytest.mark.parametrize("fmi", [2, 3])
def test_the_error_about_missing_resources_names_the_path(tmp_path, fmi):
    place = str(tmp_path) if fmi == 3 else NATIVE.uri(tmp_path)
    done = execute(Job(native("PRBDM", fmi), resources=place))
    assert done.status == 1
    assert "instantiation failed" in done.errors
    assert "mechanism.bin" in done.errors
    assert str(tmp_path) in done.errors
