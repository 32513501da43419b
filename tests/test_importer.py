"""Native FMUs outside Python: what a C importer of our own gets from them."""

from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from c_importer import NATIVE, TWO_STOPS, Job, execute, given, native, run, unpack
from prbm import Simulation
from prbm_fmu.python_fmu import interface
from support import mechanism

pytestmark = pytest.mark.native

MODELS = ("PRBDM", "PRBDM2R")
ROUNDING = {"PRBDM": 1e-11, "PRBDM2R": 1e-8, TWO_STOPS: 1e-5}  # after 14, 14 and 63 impacts
WAYS = ((2, "cs"), (3, "cs"), (3, "events"), (2, "me"), (3, "me"))
END = 0.3  # s; the default run bounces until 0.243 s, then it rests
POINTS = 1e-3 * np.arange(round(END / 1e-3) + 1)


@cache
def engine(model: str) -> tuple[list[dict], list]:
    """Return what the engine says at the communication points, and its impacts."""
    sim = Simulation(given(model))
    sim.record = []
    rows = []
    for t in POINTS:
        sim.advance(t)
        rows.append(dict(sim.outputs()))
    return rows, sim.record


def nominals(model: str) -> dict[str, float]:
    """Return typical magnitudes of all variables of the common interface."""
    return {v.name: v.nominal or 1.0 for v in interface(given(model), {})}


def assert_close(rows: np.ndarray, expected: list[dict], model: str, tolerance: float) -> None:
    """Every output of the engine agrees, relative to its nominal or its own magnitude."""
    scales = nominals(model)
    for name in expected[0]:
        wanted = np.array([float(row[name]) for row in expected])
        scale = np.maximum(scales[name], np.abs(wanted))
        assert np.abs(rows[name] - wanted).max() <= (tolerance * scale).max(), name


@pytest.mark.parametrize(("fmi", "kind"), WAYS[:3])
@pytest.mark.parametrize("model", [*MODELS, TWO_STOPS])
def test_the_importer_gets_what_the_engine_computes(model, fmi, kind):
    """The same equations, the same control of steps: rounding, which impacts amplify, differs."""
    expected, _ = engine(model)
    done = run(Job(native(model, fmi), kind, POINTS))
    rows = done.rows()
    assert (rows["at"] == POINTS).all()
    assert_close(rows, expected, model, ROUNDING[model])
    assert sum(rows[f"{stop.name}.contact"][-1] for stop in given(model).stops) == 1.0


@pytest.mark.parametrize("model", MODELS)
def test_all_kinds_of_co_simulation_show_the_same_bytes(model):
    def rows(fmi: int, kind: str) -> np.ndarray:
        names = [v for v in nominals(model)]
        return run(Job(native(model, fmi), kind, POINTS, records=names)).rows()

    first = rows(2, "cs")
    assert first.tobytes() == rows(3, "cs").tobytes()


@pytest.mark.parametrize("model", MODELS)
def test_event_mode_shows_each_impact_before_and_after_at_its_time(model):
    _, record = engine(model)
    done = run(Job(native(model, 3), "events", POINTS))
    before, after = done.rows("b"), done.rows("a")
    hits = np.flatnonzero(after["stop.impact_count"] > before["stop.impact_count"])
    assert len(hits) == len(record)
    assert (before["at"] == after["at"]).all()
    for k, impact in zip(hits, record, strict=True):
        assert after["at"][k] == pytest.approx(impact.time, abs=1e-9)  # s
        assert after["stop.impact_time"][k] == after["at"][k]
        assert before["stop.gap_rate"][k] < 0.0 < after["stop.gap_rate"][k]
        assert after["stop.approach_speed"][k] == pytest.approx(
            -before["stop.gap_rate"][k], rel=1e-9
        )


@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize("model", MODELS)
def test_a_plain_integrator_in_model_exchange_finds_the_same_motion(model, fmi):
    """Runge and Kutta's method at 20 us, events by bisection: fourth order, so 1e-6 is ample."""
    expected, record = engine(model)
    rows = run(Job(native(model, fmi), "me", POINTS)).rows()
    wanted = np.array([row["shuttle.x"] for row in expected])
    assert np.abs(rows["shuttle.x"] - wanted).max() < 1e-6  # m
    assert rows["stop.impact_count"][-1] == len(record)
    assert rows["stop.contact"][-1] == 1.0


def test_a_plain_integrator_converges_to_co_simulation_at_its_order():
    """Across impacts with friction at two stops, for Runge and Kutta's method: four."""
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
@pytest.mark.parametrize(("fmi", "kind"), WAYS)
def test_a_restored_state_continues_to_the_bit(fmi, kind, how):
    """Also in another instance, from bytes; in the middle of bouncing and at rest."""
    points = 2e-3 * np.arange(141)
    job = Job(native("PRBDM", fmi), kind, points)
    whole = run(job).output
    for k in (0, 33, 130):
        assert run(job, "interrupt", k, how).output == whole


@pytest.mark.parametrize(("fmi", "kind"), WAYS)
def test_instances_in_threads_show_what_one_shows_alone(fmi, kind):
    job = Job(native("PRBDM2R", fmi), kind, POINTS[:101])
    assert run(job, "threads", 8).output == run(job).output


@pytest.mark.parametrize("fmi", [2, 3])
def test_the_library_can_be_unloaded_and_loaded_again(fmi):
    run(Job(native("PRBDM", fmi), "cs", POINTS), "reload", 100, 5)


@pytest.mark.parametrize("fmi", [2, 3])
def test_inputs_and_tunable_parameters_act_as_in_the_engine(fmi):
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


# -- where an FMU is unpacked --

LONG = "x" * 150 + "/" + "y" * 150
PLACES = ("with spaces", "Prüfstand µ", "a#b", "a+b", "100%20 %", "q?x=1&y", LONG)


@pytest.mark.parametrize("place", PLACES, ids=lambda place: place[:12])
@pytest.mark.parametrize("fmi", [2, 3])
def test_an_fmu_runs_wherever_it_is_unpacked(tmp_path, fmi, place):
    folder = unpack(native("PRBDM", fmi).with_suffix(".fmu"), tmp_path / place)
    kind = "cs"
    expected = run(Job(native("PRBDM", fmi), kind)).output
    assert run(Job(folder, kind)).output == expected


def locations(resources: Path) -> dict[str, str]:
    """Return how importers of FMI 2.0 name the folder of the resources."""
    uri = NATIVE.uri(resources)
    path = uri.removeprefix("file://")
    return {
        "three slashes": uri,
        "one slash": f"file:{path}",
        "localhost": f"file://localhost{path}",
        "slash at the end": f"{uri}/",
        "all encoded": "file:///" + "".join(f"%{b:02x}" for b in str(resources)[1:].encode()),
    }


@pytest.mark.parametrize("form", locations(Path("/")))
def test_every_form_of_the_location_is_understood(tmp_path, form):
    folder = unpack(native("PRBDM", 2).with_suffix(".fmu"), tmp_path / "Über #1")
    location = locations(folder / "resources")[form]
    expected = run(Job(folder)).output
    assert run(Job(folder, resources=location)).output == expected


@pytest.mark.parametrize(("fmi", "slash"), [(3, ""), (3, "/")])
def test_the_path_of_the_resources_may_end_in_a_slash(fmi, slash):
    folder = native("PRBDM", fmi)
    assert run(Job(folder, resources=str(folder / "resources") + slash)).output


@pytest.mark.parametrize("fmi", [2, 3])
def test_resources_that_are_not_there_are_named(tmp_path, fmi):
    place = str(tmp_path) if fmi == 3 else NATIVE.uri(tmp_path)
    done = execute(Job(native("PRBDM", fmi), resources=place))
    assert done.status == 1
    assert "no instance" in done.errors
    assert "mechanism.bin" in done.errors
    assert str(tmp_path) in done.errors
