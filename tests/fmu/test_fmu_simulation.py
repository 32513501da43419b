"""A Python FMU computes the same values as the engine, also beside other FMUs in its process."""

import re
import subprocess
import sys
from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from fmu_host import OK, Instance
from prbm.base.atomic import write
from prbm.fmu import python_fmu
from prbm.fmu.start import interface
from prbm.hybrid.simulation import Simulation
from support import GUIDES, ROOT, SHIPPED, SUPPORT, case, record, selected

END = 0.3  # s; the guides bounce until 0.243 s in the default run, then they rest.
COMPARISONS = 6  # Times at which all values are compared.

pytestmark = pytest.mark.fmu


def points(step: float, end: float = END) -> np.ndarray:
    return step * np.arange(round(end / step) + 1)


def uneven(end: float) -> np.ndarray:
    """Return communication points with steps over three decades, and all compared times."""
    rng = np.random.default_rng(0)
    inner = end / END * np.cumsum(10 ** rng.uniform(-4.5, -1.8, 400))
    return np.unique(np.concatenate([[0.0], inner[inner < end], points(end / COMPARISONS, end)]))


GRIDS = {"3000 steps": 3000, "300 steps": 300, "6 steps": COMPARISONS, "uneven": 0}


def grid_of(name: str, end: float) -> np.ndarray:
    return points(end / GRIDS[name], end) if GRIDS[name] else uneven(end)


@cache
def engine_run(model: str) -> tuple[dict, list[dict]]:
    """Return the declared variables, and their values in the engine at the compared times."""
    guide, end = case(model).mechanism, case(model).end
    listed = {v.name: v for v in interface(guide, {})}
    simulation = Simulation(guide)
    given = {n: v.start for n, v in listed.items() if v.start is not None}
    rows = []
    for t in points(end / COMPARISONS, end):
        simulation.advance(t)
        rows.append(given | simulation.outputs())
    return listed, rows


def assert_equal(found: dict, expected: dict, listed: dict) -> None:
    """Check that exactly the declared variables are found, within 1e-9 of the nominal values."""
    assert found.keys() == expected.keys() == listed.keys()
    for name, value in expected.items():
        scale = max(listed[name].nominal or 1.0, abs(value))
        assert abs(found[name] - value) <= 1e-9 * scale, name


LONG = ("3000 steps",)


def on_grids() -> list:
    """Return each mechanism with each grid, but slow mechanisms with the uneven grid only."""
    return [
        pytest.param(
            *getattr(p, "values", (p,)),
            grid,
            marks=[*getattr(p, "marks", ()), *([pytest.mark.slow] if grid in LONG else [])],
        )
        for p in SHIPPED
        for grid in GRIDS
        if isinstance(p, str) or grid == "uneven"
    ]


@pytest.mark.slow
@pytest.mark.parametrize(("model", "grid"), on_grids())
def test_the_fmu_equals_the_engine_for_every_communication_step(fmus, model, grid):
    it, (listed, rows) = case(model), engine_run(model)
    with Instance(fmus[model]).initialize() as instance:
        assert_equal(instance.values(), rows[0], listed)
        compared = 0
        for begin, end in pairwise(grid_of(grid, it.end)):
            assert instance.step(begin, end - begin) == OK
            k = round(COMPARISONS * end / it.end)
            if abs(end - k * it.end / COMPARISONS) < 1e-12:
                assert_equal(instance.values(), rows[k], listed)
                compared += 1
    assert compared == len(rows) - 1 == COMPARISONS
    assert it.impacts(rows[-1]) == len(record(model)) > 0
    if model in GUIDES:
        assert rows[-1]["stop.contact"]


@pytest.mark.parametrize("model", selected(lambda name: name != "PRBDM2R"))
def test_inputs_walls_and_tunable_parameters_reach_the_engine(fmus, model):
    """The start values, start time and tolerance also differ from the defaults."""
    it, listed = case(model), {v.name: v for v in interface(case(model).mechanism, {})}
    start, changes, step = it.starts(), it.changes(), it.end / 30
    simulation = Simulation(it.mechanism, start, start_time=2.0, tolerance=1e-9)
    given = {n: v.start for n, v in listed.items() if v.start is not None} | start
    with Instance(fmus[model]) as instance:
        keywords = {name.replace(".", "__"): value for name, value in start.items()}
        instance.initialize(start=2.0, tolerance=1e-9, **keywords)
        for k in range(20):
            change = changes.get(k, {})
            instance.set(change)
            simulation.set(change)
            given |= change
            assert instance.step(2.0 + k * step, step) == OK
            simulation.advance(2.0 + k * step + step)
            assert_equal(instance.values(), given | simulation.outputs(), listed)
    if model in GUIDES:
        assert simulation.outputs()["stop.impact_count"] > 0


def test_a_retreating_wall_releases_and_recaptures_a_pressed_body(fmus):
    """Gravity presses the shuttle onto the wall; in the end the shuttle moves with the wall."""
    speed, step = 0.02, 1e-3
    with Instance(fmus["PRBDM"]).initialize() as instance:
        assert instance.step(0.0, END) == OK
        for k in range(80):  # Afterwards the longest of the recent steps is 1 ms.
            assert instance.step(END + k * step, step) == OK
        rested, begin = instance.values(), END + 80 * step
        held = []
        for k in range(40):
            instance.set({"stop.displacement": speed * k * step, "stop.velocity": speed})
            assert instance.step(begin + k * step, step) == OK
            found = instance.values()
            held.append(found["stop.contact"])
    assert rested["stop.contact"]
    assert not held[0]  # The wall accelerates by 4 v / T = 40 m/s2, faster than the shuttle can.
    assert held[-1]
    assert found["stop.impact_count"] > rested["stop.impact_count"]
    assert found["shuttle.vx"] == pytest.approx(speed, rel=1e-9)  # Tolerance of the integration.
    assert found["shuttle.x"] == pytest.approx(40 * speed * step, rel=1e-9)


@pytest.mark.slow
def test_the_importers_tolerance_overrides_the_parameter(fmus):
    def last(tolerance: float | None, parameter: float) -> bytes:
        with Instance(fmus["PRBDM2R"]) as instance:
            instance.initialize(tolerance=tolerance, solver__tolerance=parameter)
            assert instance.step(0.0, 0.1) == OK
            return instance.fmu.getReal([instance.variables["shuttle.x"].valueReference])

    assert last(1e-5, 1e-8) == last(1e-5, 1e-5) == last(None, 1e-5) != last(None, 1e-8)


def test_values_in_initialization_mode_follow_the_parameters(fmus):
    with Instance(fmus["PRBDM"]) as instance:
        instance.fmu.setupExperiment(startTime=0.0)
        instance.fmu.enterInitializationMode()
        softer = instance.values()
        instance.set({"flexure.youngs_modulus": 400e9, "release.displacement": -5e-3})
        stiffer = instance.values()
        instance.fmu.exitInitializationMode()
        assert instance.values() == stiffer
    assert softer["shuttle.x"] == pytest.approx(-18e-3, abs=1e-12)  # Tolerance of the statics.
    assert stiffer["shuttle.x"] == pytest.approx(-5e-3, abs=1e-12)
    assert stiffer["mode.frequency"] > softer["mode.frequency"] > 0.0


def run_alone(fmu: Path) -> list[bytes]:
    with Instance(fmu).initialize() as instance:
        return instance.run(points(2e-3, 0.06))


ALONE = """
import sys
from test_fmu_simulation import run_alone
for row in run_alone(sys.argv[1]):
    print(row.hex())
"""


def run_in_new_process(fmu: Path) -> list[bytes]:
    paths = [str(SUPPORT), str(Path(__file__).parent), str(ROOT / "fmu_src")]
    script = f"import sys; sys.path[:0] = {paths!r}\n{ALONE}"
    done = subprocess.run(
        [sys.executable, "-c", script, str(fmu)], capture_output=True, text=True, check=True
    )
    return [bytes.fromhex(line) for line in done.stdout.split()]


@pytest.mark.slow
def test_instances_of_both_models_in_one_process_do_not_disturb_each_other(fmus):
    alone = {model: run_in_new_process(fmus[model]) for model in GUIDES}
    times = points(2e-3, 0.06)
    instances = [(m, Instance(fmus[m], f"{m} {k}").initialize()) for k in (1, 2) for m in GUIDES]
    for k, (begin, end) in enumerate(pairwise(times)):
        for model, instance in instances:
            assert instance.step(begin, end - begin) == OK
            assert instance.bytes() == alone[model][k]
    for _, instance in instances:
        instance.__exit__(None, None, None)


def test_two_builds_of_one_model_in_one_process_keep_their_own_content(fmus, mechanisms, tmp_path):
    other = tmp_path / "PRBDM.fmu"
    write(other, python_fmu.build(mechanisms["PRBDM"], {"stop.restitution": 0.1}))
    with Instance(fmus["PRBDM"]).initialize() as a, Instance(other).initialize() as b:
        for k in range(50):
            assert a.step(k * 1e-3, 1e-3) == b.step(k * 1e-3, 1e-3) == OK
        first, second = a.values(), b.values()
    assert len([name for name in sys.modules if re.fullmatch(r"prbm_PRBDM_\w+", name)]) >= 2
    for values, restitution in ((first, 0.6), (second, 0.1)):
        assert values["stop.restitution"] == restitution
        assert values["stop.impact_count"] == 1
        assert values["stop.rebound_speed"] == pytest.approx(
            restitution * values["stop.approach_speed"], rel=1e-12
        )  # round-off


@pytest.mark.slow
def test_hundreds_of_consecutive_instances_do_not_crash(fmus):
    """The wrapper library releases one reference too many per instance; the slave adds one."""
    script = f"""
import sys
sys.path[:0] = {[str(SUPPORT)]!r}
from fmu_host import Instance
for k in range(150):
    with Instance({str(fmus["PRBDM"])!r}).initialize() as instance:
        assert instance.step(0.0, 1e-3) == 0
print("survived")
"""
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stdout) == (0, "survived\n"), done.stderr
