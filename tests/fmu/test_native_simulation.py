"""A native FMU computes the same values as the engine through every interface."""

import threading
from ctypes import c_double
from functools import cache
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest

from exchange import round_off
from fmu_host import simulate_fmu
from native_host import INTERFACES, OK, Instance, Integrator, clocked, unpacked
from prbm.base.atomic import write
from prbm.fmu import native_fmu
from prbm.fmu.export import Export
from prbm.fmu.native_fmu import described
from prbm.hybrid.simulation import Simulation
from prbm.runs.experiment import experiment
from support import (
    COSTLY_MODELS,
    GUIDES,
    QUICK_MODELS,
    SHIPPED,
    case,
    each_shipped,
    energy_balance,
    fastest,
    mechanism,
    record,
    selected,
    simulation,
)

END = 0.3  # s; the guides bounce until 0.243 s in the default run, then they rest.
COMPARISONS = 30  # Times at which all values are compared.
IMPACTS = 14  # Impacts of each guide in the default run.
interfaces = pytest.mark.parametrize(("fmi", "kind"), INTERFACES)

pytestmark = [pytest.mark.fmu, pytest.mark.native]

SNAP_ATOL = 2e-7  # m; a snap amplifies the solver's error, which depends on the processor.


def points(step: float, end: float = END) -> np.ndarray:
    return step * np.arange(round(end / step) + 1)


def uneven(end: float) -> np.ndarray:
    """Return communication points with steps over three decades, and all compared times."""
    rng = np.random.default_rng(0)
    inner = end / END * np.cumsum(10 ** rng.uniform(-4.5, -1.8, 400))
    return np.unique(np.concatenate([[0.0], inner[inner < end], points(end / COMPARISONS, end)]))


GRIDS = {"3000 steps": 3000, "300 steps": 300, "6 steps": 6, "uneven": 0}


def grid_of(name: str, end: float) -> np.ndarray:
    return points(end / GRIDS[name], end) if GRIDS[name] else uneven(end)


def slopes(sim: Simulation, listed: dict, now: dict) -> dict[str, float]:
    """Return the declared state derivatives by forward differences of the engine."""
    h, before, later = 1e-6, sim.snapshot(), []
    for step in (h, 2 * h):
        sim.advance(now["time"] + step)
        later.append(sim.outputs())
    sim.restore(before)
    ders = [name for name in listed if name.startswith("der(")]
    result = {}
    for name in ders:
        state = name.removeprefix("der(").removesuffix(")")
        one, two = (outputs[state] - now[state] for outputs in later)
        result[name] = (4 * one - two) / (2 * h)
    return result


@cache
def engine_run(model: str) -> SimpleNamespace:
    """Return the declared variables, their values in the engine, and the engine's impacts."""
    listed = {v.name: v for v in described(Export(mechanism(model)), 3).variables}
    sim, end = simulation(model), case(model).end
    given = {n: v.start for n, v in listed.items() if v.start is not None}
    rows = []
    for t in points(end / COMPARISONS, end):
        sim.advance(t)
        rows.append(given | sim.outputs() | {"time": t})
        rows[-1] |= slopes(sim, listed, rows[-1])
    return SimpleNamespace(listed=listed, rows=rows, record=record(model))


def assert_equal(instance: Instance, expected: dict, listed: dict, tolerance: float = 1e-7) -> None:
    """Check that every declared variable agrees within a fraction of its nominal value.

    Event indicators must be positive between events.  Derivatives (up to 2e5 rad/s2) are compared
    with differences of the engine's dense output, in which fast modes have an error of up to 1e-4
    rad/s that changes within 1e-3 s.  An error in a fast mode is multiplied by omega^2 in the
    acceleration, which is hence compared with a bound in proportion to omega^2.
    """
    found, omega = instance.values(), fastest(instance.description.modelName)
    noise, tolerance = 1e-9 * omega**2, tolerance * max(1.0, omega / 1e4)
    compared = set()
    for name, value in found.items():
        compared.add(name)
        if name.endswith("_indicator"):
            assert value > 0.0, name
            continue
        scale = max(listed[name].nominal or 1.0, abs(expected[name]))
        bound = max(1e-2 * scale, noise) if name.startswith("der(") else tolerance * scale
        assert abs(value - expected[name]) <= bound, (name, value, expected[name])
    assert compared == instance.references.keys()
    assert compared == set(listed) - ({"time"} if instance.version == 2 else set())


def worst(found: np.ndarray, expected: np.ndarray, name: str) -> float:
    return float(np.abs(found[name] - expected[name]).max())


def on_grids() -> list:
    """Return each mechanism with each grid, but slow mechanisms with the uneven grid only."""
    return [
        pytest.param(*getattr(p, "values", (p,)), grid, marks=getattr(p, "marks", ()))
        for p in SHIPPED
        for grid in GRIDS
        if isinstance(p, str) or grid == "uneven"
    ]


@pytest.mark.parametrize(("model", "grid"), on_grids())
@pytest.mark.parametrize("fmi", [2, 3])
def test_co_simulation_equals_the_engine_for_every_communication_step(native, model, fmi, grid):
    """Values agree within 1e-7 of their nominal values: round-off, amplified by the motion."""
    run, it = engine_run(model), case(model)
    with Instance(native[model, fmi]).initialize() as instance:
        assert_equal(instance, run.rows[0], run.listed)
        compared = 0
        for begin, end in pairwise(grid_of(grid, it.end)):
            assert instance.step(begin, end - begin) == OK
            k = round(COMPARISONS * end / it.end)
            if abs(end - k * it.end / COMPARISONS) < 1e-12:
                assert_equal(instance, run.rows[k], run.listed)
                compared += 1
    assert compared == (6 if grid == "6 steps" else COMPARISONS)
    assert it.impacts(run.rows[-1]) == len(run.record) > 0
    if model in GUIDES:
        assert run.rows[-1]["stop.contact"]
        assert len(run.record) == IMPACTS


@each_shipped
def test_results_are_independent_of_the_communication_step(native, model):
    """The bytes at a time are the same for all steps and versions of FMI.

    Steps are multiples of 2^-16 s, so that their sums are exact.
    """
    rng, found, last = np.random.default_rng(0), set(), int(case(model).end * 2**16)
    inner = np.unique(rng.integers(1, last, 100))
    for counts in ((*range(0, last, 2**4), last), (0, last), (0, *inner, last)):
        grid = np.array([*counts]) / 2**16
        for fmi, kind in ((2, "cs"), (3, "cs"), (3, "events")):
            with Instance(native[model, fmi], kind).initialize() as instance:
                for end in grid[1:]:
                    instance.advance(end)
                values = {n: v for n, v in instance.values().items() if n != "time"}
                found.add(np.array([*values.values()], dtype=float).tobytes())
    assert case(model).impacts(values) == len(record(model)) > 0
    assert len(found) == 1


@pytest.mark.parametrize("kind", ["cs", "events", "late"])
@each_shipped
def test_event_mode_computes_the_same_trajectory(native, model, kind):
    run = engine_run(model)
    with Instance(native[model, 3], kind).initialize() as instance:
        for row in run.rows[1:]:
            instance.advance(row["time"])
            assert_equal(instance, row, run.listed)


@pytest.mark.slow
@each_shipped
def test_a_native_fmu_equals_the_python_fmu(fmus, native, model):
    """Positions agree within 1e-7 m and the times of all impacts within 1e-7 s in FMPy.

    The run is the default experiment or, where the engine takes minutes for it, its beginning.
    """
    it = case(model)
    span = {"stop_time": it.end, "output_interval": it.end / 300} if it.costly else {}
    python = simulate_fmu(str(fmus[model]), **span)
    for fmi in (2, 3):
        ours = simulate_fmu(str(native[model, fmi]), **span)
        assert python.dtype.names == ours.dtype.names
        assert (python["time"] == ours["time"]).all()
        assert len(ours) == (301 if it.costly else 1001)
        for name in it.outputs("x", "y") + it.at_stops("impact_time"):
            assert worst(ours, python, name) <= 1e-7, name  # m, s
        for name in it.at_stops("impact_count", "contact"):
            assert (ours[name] == python[name]).all(), name
        assert it.impacts(ours[-1]) >= len(record(model))
        if model in GUIDES:
            assert ours["stop.impact_count"][-1] == IMPACTS
            assert ours["stop.contact"][-1]


@each_shipped
@pytest.mark.parametrize("fmi", [2, 3])
def test_the_default_experiment_in_fmpy_conserves_energy(native, model, fmi):
    """All values are finite, and energy is constant within 2e-6 of the largest elastic energy.

    The tolerance of the integration refers to angles of 1 rad and stretches of 1.
    """
    found = simulate_fmu(str(native[model, fmi]))
    assert found["time"][-1] == pytest.approx(experiment(mechanism(model)).stop_time)
    assert all(np.isfinite(found[name]).all() for name in found.dtype.names)
    balance = energy_balance(found)
    assert np.abs(balance - balance[0]).max() < 2e-6 * found["energy.elastic"].max()
    assert case(model).impacts(found[-1]) >= len(record(model)) > 0


# -- model exchange --


@pytest.mark.parametrize("fmi", [2, 3])
@each_shipped
def test_model_exchange_with_cvode_equals_co_simulation(native, model, fmi):
    """At a relative tolerance of 1e-9, positions agree and the impacts are the same.

    Positions of the guides agree within 1e-6 of the displacement at release.  The last bounces are
    slow (1 mm/s), so an error of 1e-9 m in position is an error of 1e-6 s in time.  FMPy limits
    CVode to 500 steps per communication step; communication steps are therefore small.
    """
    it = case(model)
    expected = simulate_fmu(str(native[model, fmi]), stop_time=it.end, output_interval=it.end / 300)
    found = simulate_fmu(
        str(native[model, fmi]), fmi_type="ModelExchange", relative_tolerance=1e-9,
        record_events=False, stop_time=it.end, output_interval=it.end / 600,
    )[::2]  # fmt: skip
    assert found["time"] == pytest.approx(expected["time"], abs=1e-12)
    bound = 1e-6 * 0.018 if model in GUIDES else SNAP_ATOL  # m
    for name in it.outputs("x", "y"):
        assert worst(found, expected, name) < bound, name
    for name in it.outputs("angle"):
        assert worst(found, expected, name) < 1e-6, name  # rad
    for name in it.outputs("vx"):
        assert worst(found, expected, name) < 5e-6, name  # m/s; impact times differ.
    for name in it.at_stops("impact_time"):
        assert worst(found, expected, name) < 5e-6, name  # s
    for name in it.at_stops("impact_count"):
        assert (found[name] == expected[name]).all(), name
    assert it.impacts(found[-1]) == len(record(model)) > 0
    for stop in it.at_stops("contact"):
        assert found[stop][-1] == expected[stop][-1]
    for stop in it.at_stops("force"):
        assert found[stop][-1] == pytest.approx(expected[stop][-1], rel=1e-6)


@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize("model", selected(lambda name: name not in COSTLY_MODELS))
def test_model_exchange_with_fmpys_default_settings_equals_co_simulation(native, model, fmi):
    """Positions agree within 1e-7 m at the tolerance of the default experiment, 1e-8.

    The displacement at release is 18 mm.  The guides come to rest; other mechanisms are simulated
    for a few impacts, which amplify errors.  Mechanisms with fast modes are left out, because they
    need more than the 500 steps of CVode that FMPy allows per communication step.
    """
    it, path = case(model), str(native[model, fmi])
    span = {} if model in GUIDES else {"stop_time": it.end, "output_interval": it.end / 300}
    expected = simulate_fmu(path, **span)
    found = simulate_fmu(path, fmi_type="ModelExchange", record_events=False, **span)
    same = np.isin(np.round(found["time"], 9), np.round(expected["time"], 9))
    assert same.sum() > 100
    for name in it.outputs("x"):
        x = np.interp(found["time"], expected["time"], expected[name])
        assert np.abs(found[name] - x)[same].max() < (1e-7 if model in GUIDES else 1e-6)  # m
    assert it.impacts(found[-1]) == it.impacts(expected[-1]) > 0
    for name in it.at_stops("contact"):
        assert found[name][-1] == expected[name][-1]
    for name in it.at_stops("force"):
        assert found[name][-1] == pytest.approx(expected[name][-1], rel=1e-5)


@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize(
    ("model", "tolerance"),
    [("PRBDM", 1e-10), pytest.param("PRBDM2R", 1e-9, marks=pytest.mark.slow)],
)
def test_model_exchange_with_cvode_records_values_before_and_after_each_impact(
    native, model, tolerance, fmi
):
    """The result has two rows at the time of each impact."""
    found = simulate_fmu(
        str(native[model, fmi]), fmi_type="ModelExchange", relative_tolerance=tolerance,
        stop_time=END, output=["stop.gap_rate", "stop.impact_count", "stop.impact_time"],
    )  # fmt: skip
    hits = np.flatnonzero(np.diff(found["stop.impact_count"]))
    expected = record(model)
    assert len(hits) == len(expected) == IMPACTS
    for k, impact in zip(hits, expected, strict=True):
        assert found["time"][k] == found["time"][k + 1] == found["stop.impact_time"][k + 1]
        assert found["time"][k] == pytest.approx(impact.time, abs=1e-6)
        assert found["stop.gap_rate"][k] < 0.0 < found["stop.gap_rate"][k + 1]


@pytest.mark.parametrize(("model", "h"), [("PRBDM", 2e-5), ("PRBDM2R", 4e-6)])
def test_model_exchange_with_euler_steps_converges_to_co_simulation(native, model, h):
    """The order is 1 before the first impact, which is detected up to a step late."""
    outputs = {"output": ["shuttle.x", "stop.impact_count", "stop.impact_time"]}
    expected = simulate_fmu(str(native[model, 2]), stop_time=0.05, output_interval=1e-3, **outputs)
    errors = []
    for step in (h, h / 2):
        found = simulate_fmu(
            str(native[model, 2]), fmi_type="ModelExchange", solver="Euler", step_size=step,
            output_interval=step, stop_time=0.05, record_events=False, **outputs,
        )  # fmt: skip
        stride = round(1e-3 / step)
        x = found["shuttle.x"][::stride]
        errors.append(np.abs(x[:41] - expected["shuttle.x"][:41]).max())
        assert np.abs(x - expected["shuttle.x"]).max() < 5e-5  # m; the motion covers 18 mm.
        assert found["stop.impact_count"][-1] == expected["stop.impact_count"][-1] == 1
        late = found["stop.impact_time"][-1] - expected["stop.impact_time"][-1]
        assert abs(late) < 2 * step
    assert errors[0] / errors[1] == pytest.approx(2.0, rel=0.1)  # First order.


@pytest.mark.parametrize("fmi", [2, 3])
@each_shipped
def test_model_exchange_with_runge_kutta_steps_equals_the_engine(native, model, fmi):
    """With steps of 40 us, all variables agree within 1e-6 of their nominal values.

    Near the straight shape, the truncation error excites the fast modes of the 2R guide.  It falls
    with the fourth power of the step: 8e-7 m at 0.06 s, after the first impact, then 6e-8 m.
    """
    run, it, errors = engine_run(model), case(model), []
    share = 1e-6 if model in GUIDES else max(1e-6, 1e-9 * fastest(model))
    step = it.substep(4e-5 if model in GUIDES else 1e-5)
    for h in (step, step / 2):
        with Instance(native[model, fmi], "me", substep=h).initialize() as instance:
            for row in run.rows[1:4]:
                instance.advance(row["time"])
                assert_equal(instance, row, run.listed, share)
            instance.advance(run.rows[6]["time"])
            (x,) = instance.get(it.released)
            errors.append(abs(x - run.rows[6][it.released]))
    assert errors[1] < max(errors[0] / 10, 1e-9)  # m; the error of the engine is 1e-9 m.


# -- events --


@each_shipped
def test_fmpy_records_values_before_and_after_each_impact_in_event_mode(native, model):
    """FMPy records two rows at the time of each impact, which is the engine's within 1e-9 s."""
    it = case(model)
    outputs = ("gap_rate", "gap", "impact_count", "impact_time", "approach_speed", "rebound_speed")
    found = simulate_fmu(
        str(native[model, 3]), use_event_mode=True, early_return_allowed=True, stop_time=it.end,
        output_interval=it.end / 300, output=it.at_stops(*outputs, "contact"),
    )  # fmt: skip
    expected, seen = record(model), dict.fromkeys(it.at_stops("impact_time"), 0.0)
    twice = np.flatnonzero(np.diff(found["time"]) == 0.0)
    hits = [k for k in twice if it.impacts(found[k + 1]) > it.impacts(found[k])]
    assert len(hits) == len(expected) > 0
    for n, (k, impact) in enumerate(zip(hits, expected, strict=True)):
        before, after, stop = found[k], found[k + 1], impact.stop
        assert before["time"] == after["time"] == after[f"{stop}.impact_time"]
        assert after["time"] == pytest.approx(impact.time, abs=1e-9)
        assert before[f"{stop}.gap_rate"] < 0.0 < after[f"{stop}.gap_rate"]
        assert (it.impacts(before), it.impacts(after)) == (n, n + 1)
        assert before[f"{stop}.impact_time"] == seen[f"{stop}.impact_time"]
        assert abs(before[f"{stop}.gap"]) < 1e-12  # m
        closing, opening = before[f"{stop}.gap_rate"], after[f"{stop}.gap_rate"]
        assert after[f"{stop}.approach_speed"] == pytest.approx(-closing, rel=1e-9)
        assert after[f"{stop}.rebound_speed"] == pytest.approx(opening, rel=1e-9)
        seen[f"{stop}.impact_time"] = after["time"]
    contact = np.any([found[name] for name in it.at_stops("contact")], axis=0)
    if engine_run(model).rows[-1][f"{expected[-1].stop}.contact"]:
        captured = [k for k in twice if contact[k + 1] and not contact[k]]
        assert captured[-1] > hits[-1]  # The capture is an event, but not an impact.
    assert contact[-1] or model not in GUIDES


def test_without_early_return_a_step_is_complete_and_reports_its_events(native):
    with Instance(native["PRBDM", 3], "late").initialize() as instance:
        seen = []
        for k in range(30):
            event, _, early, time = instance.fmu.doStep(k * 0.01, 0.01)
            assert (early, time) == (False, pytest.approx((k + 1) * 0.01, abs=1e-15))
            seen.append(event)
            if event:
                instance.fmu.enterEventMode()
                instance.update()
        count, contact = instance.values()["stop.impact_count"], instance.values()["stop.contact"]
    assert not any(seen[:4])
    assert seen[4]
    assert not any(seen[25:])
    assert (count, contact) == (IMPACTS, True)


@each_shipped
def test_a_pending_event_keeps_the_values_before_it_until_the_update(native, model):
    """Neither gets in Event Mode nor fmi3EvaluateDiscreteStates handle the event."""
    it, first = case(model), record(model)[0]
    with Instance(native[model, 3], "events").initialize() as instance:
        event, _, early, time = instance.fmu.doStep(0.0, it.end)
        assert (event, early) == (True, True)
        assert time == pytest.approx(first.time, abs=1e-9)
        waiting = instance.bytes()
        instance.fmu.enterEventMode()
        assert instance.call("EvaluateDiscreteStates") == OK
        assert instance.bytes() == waiting
        instance.update()
        values = instance.values()
        assert values["time"] == values[f"{first.stop}.impact_time"] == time
        assert it.impacts(values) == 1


def test_the_release_by_a_retreating_wall_is_an_event(native):
    """In event mode the step ends at the release; otherwise the release happens within the step."""
    found = {}
    for kind in ("cs", "events", "late"):
        with Instance(native["PRBDM", 3], kind).initialize() as instance:
            instance.advance(END)
            rested, held, begin = instance.values(), [], END + 0.08
            assert rested["stop.contact"]
            for k in range(80):  # Afterwards the longest of the recent steps is 1 ms.
                instance.advance(END + (k + 1) * 1e-3)
            for k in range(40):
                instance.change({"stop.displacement": 2e-5 * k, "stop.velocity": 0.02})
                instance.advance(begin + (k + 1) * 1e-3)
                held.append(instance.values()["stop.contact"])
            found[kind] = instance.values()
        assert not held[0]  # The wall accelerates by 4 v / T = 40 m/s2 or jumps.
        assert held[-1]
        assert found[kind]["shuttle.vx"] == pytest.approx(0.02, rel=1e-9)  # At the wall's velocity.
    assert found["cs"]["stop.impact_count"] > IMPACTS
    for kind in ("events", "late"):  # The wall starts with a jump of its velocity.
        assert found[kind]["shuttle.x"] == pytest.approx(found["cs"]["shuttle.x"], abs=1e-9)


# -- intermediate update --


def watched(native, required, **options):
    """Return an instance with intermediate updates, and the list of the callback's arguments."""
    seen = []

    def update(_, time, may_set, may_get, finished, may_return, early, early_time):
        references = [instance.references[name] for name in required]
        seen.append((time, may_set, may_get, finished, may_return,
                     instance.fmu.getFloat64(references)))  # fmt: skip
        if len(seen) == instance.updates_before_return:
            early[0] = True
            early_time[0] = time

    _, description = unpacked(native["PRBDM", 3])
    references = {v.name: v.valueReference for v in description.modelVariables}
    instance = Instance(
        native["PRBDM", 3], options.pop("kind", "cs"), intermediateUpdate=update,
        requiredIntermediateVariables=[references[name] for name in required], **options,
    )  # fmt: skip
    instance.updates_before_return = 0
    return instance, seen


def test_intermediate_updates_give_the_motion_within_a_step(native):
    """Updates come at increasing times, have the values at these times, and change no result."""
    instance, seen = watched(native, ["shuttle.x", "time"])
    with instance.initialize():
        instance.fmu.doStep(0.0, END)
        last = instance.values()
    times = np.array([time for time, *_ in seen])
    assert len(times) > 30
    assert (np.diff(times) >= 0.0).all()  # Two updates at an event have the same time.
    assert times[-1] == END
    with Instance(native["PRBDM", 3]).initialize() as plain:
        for time, may_set, may_get, finished, may_return, (x, t) in seen:
            assert (may_set, may_get, finished, may_return) == (False, True, True, False)
            assert t == time
            if time > plain.time:
                plain.advance(time)
            assert x == pytest.approx(plain.values()["shuttle.x"], abs=1e-12)  # round-off
        assert plain.values() == pytest.approx(last, rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("kind", ["cs", "events"])
def test_an_importer_may_end_a_step_in_an_intermediate_update(native, kind):
    instance, seen = watched(native, ["shuttle.x"], kind=kind, earlyReturnAllowed=True)
    with instance.initialize():
        instance.updates_before_return = 5
        _, _, early, time = instance.fmu.doStep(0.0, 0.03)
        assert early
        assert time == seen[-1][0] < 0.03
        assert len(seen) == 5
        assert instance.values()["time"] == time
        event, _, early, time = instance.fmu.doStep(time, 0.03 - time)
        assert (event, early, time) == (False, False, 0.03)
        found = instance.values()
    with Instance(native["PRBDM", 3]).initialize() as plain:
        plain.advance(0.03)
        assert found == pytest.approx(plain.values(), rel=1e-9, abs=1e-12)


def test_an_early_return_that_is_not_allowed_is_ignored(native):
    instance, seen = watched(native, ["shuttle.x"])
    with instance.initialize():
        instance.updates_before_return = 2
        assert instance.fmu.doStep(0.0, 0.03)[2:] == (False, 0.03)
        assert len(seen) > 2


def test_only_required_variables_can_be_read_in_an_intermediate_update(native):
    statuses = []

    def update(*_):
        if not statuses:
            statuses.append(instance.call("Reset"))
            statuses.append(instance.set({"force.x": 1.0}))
            statuses.append(instance.call("DoStep", 0.0, 1.0, True, None, None, None, None))
            statuses.append(instance.call("FreeInstance") or 3)
            try:
                instance.get("shuttle.y")
            except Exception:
                statuses.append(3)

    instance = Instance(native["PRBDM", 3], intermediateUpdate=update)
    with instance.initialize():
        instance.advance(0.01)
        assert statuses == [3] * 5
        assert instance.logged("shuttle.y is not among the requiredIntermediateVariables")
        assert instance.logged("fmi3Reset cannot be called in Intermediate Update Mode")
        assert instance.logged("return from the callback first")
        instance.advance(0.02)


# -- directional derivatives --


def in_flight_and_at_rest() -> list:
    """Return each mechanism in flight, and the guides at rest."""
    flying = [
        pytest.param(*getattr(p, "values", (p,)), 1 / 15, marks=getattr(p, "marks", ()))
        for p in SHIPPED
    ]
    return flying + [(model, 1.0) for model in GUIDES]


@pytest.mark.parametrize(("model", "share"), in_flight_and_at_rest())
@pytest.mark.parametrize("fmi", [2, 3])
def test_directional_derivatives_equal_finite_differences(native, model, fmi, share):
    """The unknowns are all outputs and derivatives; the direction is random."""
    rng, it = np.random.default_rng(fmi), case(model)
    time = share * it.end
    rubbing = {"friction.coefficient": 0.1, "friction.normal_force": 0.2}
    rough = {"damping.zeta": 0.05} | (rubbing if it.mechanism.frictions else {})
    substep = it.substep(2e-5 if share < 1.0 else 1e-4)
    with Instance(native[model, fmi], "me", substep=substep) as instance:
        instance.initialize(values=rough)
        instance.advance(time)
        d = instance.description
        states = [u.variable.derivative.name for u in d.derivatives]
        inputs = [v.name for v in d.modelVariables
                  if v.causality == "input" and v.variability == "continuous"]  # fmt: skip
        unknowns = [u.variable.name for u in (*d.outputs, *d.derivatives)
                    if u.variable.variability == "continuous"]  # fmt: skip
        integrator = Integrator(instance)
        x, u = integrator.x(), np.array(instance.get(*inputs))
        dx, du = rng.standard_normal(len(x)), rng.standard_normal(len(u))
        du[[name.endswith(".mobility") for name in inputs]] = 0.0  # Mobilities stay positive.
        dx[2 * ((len(x) - 2) // 2) :] = 0.0  # Dissipated energy and work have no effect.

        def at(step: float) -> np.ndarray:
            integrator.put(time, x + step * dx)
            assert instance.set(dict(zip(inputs, u + step * du, strict=True))) == OK
            return np.array(instance.get(*unknowns))

        references = [
            [instance.references[n] for n in names] for names in (unknowns, states + inputs)
        ]
        nominals = [float(instance.variables[name].nominal or 1.0) for name in unknowns]
        now, errors = at(0.0), np.full(len(unknowns), np.inf)
        sizes, noise = np.maximum(np.abs(now), nominals), round_off(at, now)
        found = np.array(instance.fmu.getDirectionalDerivative(*references, [*dx, *du]))
        for h in (1e-4, 3e-5, 1e-5):
            slope = (8 * (at(h) - at(-h)) - (at(2 * h) - at(-2 * h))) / (12 * h)
            error = np.abs(found - slope) - noise / h
            errors = np.minimum(errors, error / (np.abs(slope) + 1e-4 * sizes))
        assert errors.max() < 1e-6, dict(zip(unknowns, errors, strict=True))
        assert instance.values()[f"{it.stop}.contact"] == (share == 1.0)
        at(0.0)
        single = sum(
            w * np.array(instance.fmu.getDirectionalDerivative(references[0], [r], [1.0]))
            for w, r in zip([*dx, *du], references[1], strict=True)
        )
        assert single == pytest.approx(found, rel=1e-3, abs=1e-3 * np.abs(found).max())


@pytest.mark.parametrize("fmi", [2, 3])
@each_shipped
def test_declared_dependencies_are_complete(native, model, fmi):
    """A change of one input or state changes only unknowns that declare it as a dependency."""
    rng, it = np.random.default_rng(0), case(model)
    with Instance(native[model, fmi], "me", substep=it.substep(1e-4)).initialize() as instance:
        instance.advance(it.end / 15)
        d = instance.description
        unknowns = {
            u.variable.name: {k.name for k in u.dependencies}
            for u in (*d.outputs, *d.derivatives)
            if u.dependencies is not None
        }
        inputs = [v.name for v in d.modelVariables
                  if v.causality == "input" and v.variability == "continuous"]  # fmt: skip
        states = [u.variable.derivative.name for u in d.derivatives]
        listed = {u.variable.name for u in (*d.outputs, *d.derivatives)}
        assert unknowns.keys() == listed  # A body's rotation may be both output and derivative.
        before, moved = instance.values(), 0
        for name in inputs + states:
            assert instance.set({name: before[name] + 1e-3 * rng.uniform(0.5, 1.0)}) == OK
            after = instance.values()
            changed = {n for n in unknowns if after[n] != before[n]}
            assert all(name in unknowns[n] for n in changed), name
            moved += bool(changed)
            assert instance.set({name: before[name]}) == OK
            assert instance.values() == before
    assert moved >= len(states) + 4


# -- inputs, parameters, start --


@cache
def driven(model: str) -> tuple[dict, list[dict]]:
    """Return the declared variables and the engine's values in a run with changes of inputs."""
    it = case(model)
    listed = {v.name: v for v in described(Export(it.mechanism), 3).variables}
    sim = Simulation(it.mechanism, it.starts(), start_time=2.0, tolerance=1e-9)
    given = {n: v.start for n, v in listed.items() if v.start is not None} | it.starts()
    rows = []
    for k in range(20):
        time, change = 2.0 + (k + 1) * it.end / 30, it.changes().get(k, {})
        sim.set(change)
        sim.advance(time)
        given |= change
        rows.append(given | sim.outputs() | {"time": time})
        rows[-1] |= slopes(sim, listed, rows[-1])
    assert model not in GUIDES or rows[-1]["stop.impact_count"] > 0
    return listed, rows


@pytest.mark.parametrize(
    ("fmi", "kind"), [*(pair for pair in INTERFACES if pair[1] != "me"), (3, "late")]
)
@each_shipped
def test_inputs_walls_and_tunable_parameters_reach_the_equations(native, model, fmi, kind):
    """The start values, start time and tolerance also differ from the defaults."""
    it, (listed, rows) = case(model), driven(model)
    with Instance(native[model, fmi], kind) as instance:
        instance.initialize(start=2.0, tolerance=1e-9, values=it.starts())
        for k, row in enumerate(rows):
            instance.change(it.changes().get(k, {}))
            instance.advance(row["time"])
            assert_equal(instance, row, listed)


@pytest.mark.parametrize("fmi", [2, 3])
@each_shipped
def test_inputs_and_tunable_parameters_reach_model_exchange(native, model, fmi):
    """Inputs of walls are left out, because co-simulation interpolates their motion."""
    it, step = case(model), case(model).end / 30
    changes = it.changes()
    changes = {3: changes[3], 4: changes[8], 5: {f"{it.force}.moment": 1e-3}}
    sim = Simulation(it.mechanism, it.starts(), start_time=2.0, tolerance=1e-9)
    with Instance(native[model, fmi], "me", substep=it.substep(2e-5)) as instance:
        instance.initialize(start=2.0, values=it.starts())
        for k in range(7):
            change = changes.get(k, {})
            instance.change(change)
            sim.set(change)
            instance.advance(2.0 + (k + 1) * step)
            sim.advance(2.0 + (k + 1) * step)
            found, expected = instance.values(), sim.outputs()
            for name in it.outputs("x", "y", "angle"):
                # Truncation error of the steps, across an impact.
                assert found[name] == pytest.approx(expected[name], abs=1e-7), name
            assert it.impacts(found) == it.impacts(expected)


@pytest.mark.parametrize("fmi", [2, 3])
def test_model_exchange_locates_the_impact_with_a_moving_wall(native, fmi):
    """Displacement and velocity are set consistently at every step."""
    speed = -0.03
    with Instance(native["PRBDM", fmi], "me") as instance:
        instance.initialize()
        time, h = 0.0, 2e-5
        integrator = Integrator(instance)
        while not (z := integrator.z())[0] <= 0.0:
            assert instance.set({"stop.displacement": speed * time, "stop.velocity": speed}) == OK
            integrator.step(time, integrator.x(), h)
            time += h
            assert instance.set({"stop.displacement": speed * time}) == OK
            assert time < 0.1
        assert len(z) == 4
        met = instance.values()
        assert met["stop.gap"] == pytest.approx(0.0, abs=2 * h)
        assert met["shuttle.x"] == pytest.approx(speed * time, abs=2 * h)
        instance.fmu.enterEventMode()
        instance.update()
        after = instance.values()
        assert after["stop.impact_count"] == 1
        assert after["stop.gap_rate"] == pytest.approx(-0.6 * met["stop.gap_rate"], rel=1e-9)


@pytest.mark.parametrize(("fmi", "kind"), [pair for pair in INTERFACES if pair[1] != "me"])
def test_the_importers_tolerance_overrides_the_parameter(native, fmi, kind):
    def last(tolerance: float | None, parameter: float) -> float:
        with Instance(native["PRBDM2R", fmi], kind) as instance:
            instance.initialize(tolerance=tolerance, values={"solver.tolerance": parameter})
            instance.advance(0.1)
            return instance.values()["shuttle.x"]

    assert last(1e-5, 1e-8) == last(1e-5, 1e-5) == last(None, 1e-5) != last(None, 1e-8)


@interfaces
@each_shipped
def test_values_in_initialization_mode_follow_the_parameters(native, model, fmi, kind):
    it, values = case(model), mechanism(model).values()
    modulus = next(n for n in values if n.endswith((".youngs_modulus", ".stiffness")))
    change = {modulus: 2.0 * values[modulus], "release.displacement": 0.5 * it.displacement}
    with Instance(native[model, fmi], kind).enter() as instance:
        softer = instance.values()
        assert instance.set(change) == OK
        stiffer = instance.values()
        instance.begin()
        assert instance.values() == stiffer
    placed, size = it.released, abs(it.displacement)
    assert abs(softer[placed]) == pytest.approx(size, abs=1e-12)  # Tolerance of the statics.
    assert stiffer[placed] == pytest.approx(0.5 * softer[placed], abs=1e-12)
    if simulation(model).instability().rest:
        assert stiffer["mode.frequency"] == softer["mode.frequency"] == 0.0
    else:
        assert stiffer["mode.frequency"] > softer["mode.frequency"] > 0.0


@interfaces
@each_shipped
def test_another_start_time_only_shifts_the_motion(native, model, fmi, kind):
    """Differences come from the round-off of time, 1e-14 s."""
    shift, rows, it = -7.0, [], case(model)
    span, substep = it.end / 10, it.substep(1e-4)
    for start in (0.0, shift):
        with Instance(native[model, fmi], kind, substep=substep) as instance:
            instance.initialize(start=start)
            instance.advance(start + span)
            rows.append(instance.values())
    moved = {"time", *(n for n in it.at_stops("impact_time") if rows[0][n] > 0.0)}
    for ders, share in ((False, 1e-6), (True, 1e-4)):  # Axial modes dominate derivatives.
        first, second = (
            {n: v for n, v in row.items() if n not in moved and n.startswith("der(") == ders}
            for row in rows
        )
        assert second == pytest.approx(first, rel=share, abs=1e-9)
    if fmi == 3:
        assert rows[1]["time"] == pytest.approx(shift + span)


@interfaces
@each_shipped
def test_values_are_within_their_declared_bounds_through_a_run(native, model, fmi, kind):
    it = case(model)
    with Instance(native[model, fmi], kind, substep=it.substep(1e-4)).initialize() as instance:
        for k in range(30):
            instance.advance((k + 1) * it.end / 75)
            for name, value in instance.values().items():
                v = instance.variables[name]
                assert v.min is None or value >= float(v.min), name
                assert v.max is None or value <= float(v.max), name


# -- the output clock --


@each_shipped
def test_the_clock_ticks_at_impacts_only(model):
    """The clock ticks once per impact, in a super-dense instant of its own, not for a capture."""
    ticked, events, it = [], 0, case(model)
    with Instance(clocked(model), "events").initialize() as instance:
        while instance.time < it.end:
            event, _, _, instance.time = instance.fmu.doStep(instance.time, it.end - instance.time)
            if not event:
                continue
            events += 1
            instance.fmu.enterEventMode()
            count = it.impacts(instance.values())
            clock = [v.valueReference for v in instance.description.modelVariables
                     if v.type == "Clock"]  # fmt: skip
            assert not any(instance.fmu.getClock(clock))
            ticks = instance.update()
            grown = it.impacts(instance.values()) - count
            assert (sum(ticks), grown) in ((0, 0), (1, 1))
            ticked += [instance.time] * grown
    expected = [impact.time for impact in record(model)]
    assert ticked == pytest.approx(expected, abs=1e-9)
    assert events >= len(expected)
    if model in GUIDES:
        assert events > len(expected)  # The capture is an event, but not an impact.


@each_shipped
def test_the_clock_does_not_change_the_motion(model):
    """The trajectory is the same in FMPy, with event mode and in model exchange."""
    run, it = engine_run(model), case(model)
    bound = 1e-8 if model in GUIDES else SNAP_ATOL  # m
    names = [it.released, *it.at_stops("impact_count")]
    found = simulate_fmu(
        str(clocked(model)), use_event_mode=True, early_return_allowed=True, stop_time=it.end,
        output_interval=it.end / COMPARISONS, output=names,
    )  # fmt: skip
    expected = {round(row["time"], 9): row[it.released] for row in run.rows}
    rows = [(round(float(row["time"]), 9), row[it.released]) for row in found]
    compared = [(x, expected[t]) for t, x in rows if t in expected]
    assert len(compared) == len(run.rows)
    assert [x for x, _ in compared] == pytest.approx([y for _, y in compared], abs=1e-8)
    assert it.impacts(found[-1]) == len(run.record)
    exchanged = simulate_fmu(
        str(clocked(model)), fmi_type="ModelExchange", relative_tolerance=1e-9, stop_time=it.end,
        output_interval=it.end / 600, record_events=False, output=names,
    )  # fmt: skip
    assert exchanged[it.released][::20] == pytest.approx([*expected.values()], abs=bound)
    assert it.impacts(exchanged[-1]) == len(run.record)


@each_shipped
def test_the_clock_ticks_without_early_return(model):
    """At the end of a step, a clock ticks once for all impacts inside the step."""
    with Instance(clocked(model), "late").initialize() as instance:
        total, it = 0, case(model)
        for k in range(6):
            before = instance.values()
            event, *_ = instance.fmu.doStep(k * it.end / 6, it.end / 6)
            after = instance.values()
            struck = [after[n] > before[n] for n in it.at_stops("impact_count")]
            grown = it.impacts(after) - it.impacts(before)
            if event:
                instance.fmu.enterEventMode()
                clock = [v.valueReference for v in instance.description.modelVariables
                         if v.type == "Clock"]  # fmt: skip
                assert instance.fmu.getClock(clock) == struck
                instance.update()
            assert event or not grown
            total += grown
    assert total == len(record(model))


# -- several instances --

SHORT = points(2e-3, 0.06)[1:]


def alone(fmu, kind: str) -> list[bytes]:
    with Instance(fmu, kind).initialize() as instance:
        return instance.run(SHORT)


@pytest.mark.slow
def test_instances_of_all_fmus_in_one_process_do_not_disturb_each_other(native):
    everything = [(model, fmi, kind) for model in QUICK_MODELS for fmi, kind in INTERFACES]
    expected = {key: alone(native[key[:2]], key[2]) for key in everything}
    instances = [(key, Instance(native[key[:2]], key[2]).initialize()) for key in everything * 2]
    for k, time in enumerate(SHORT):
        for key, instance in instances:
            instance.advance(time)
            assert instance.bytes() == expected[key][k]
    for _, instance in instances:
        instance.free()


@interfaces
def test_instances_in_threads_do_not_disturb_each_other(native, fmi, kind):
    expected = alone(native["PRBDM2R", fmi], kind)
    found: list[list[bytes]] = []

    def work() -> None:
        found.append(alone(native["PRBDM2R", fmi], kind))

    threads = [threading.Thread(target=work) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(found) == 8
    assert all(rows == expected for rows in found)


@pytest.mark.slow
@pytest.mark.parametrize("fmi", [2, 3])
def test_hundreds_of_consecutive_and_simultaneous_instances_run(native, fmi):
    """A hundred instances load and unload the library; then two hundred exist together."""
    for k in range(100):
        kind = "cs" if k % 2 else "me"
        with Instance(native["PRBDM", fmi], kind).initialize() as instance:
            instance.advance(1e-3)
            assert instance.values()["shuttle.vx"] > 0.0
    instances = [Instance(native["PRBDM", fmi], name=f"it {k}").initialize() for k in range(200)]
    for instance in instances:
        instance.advance(0.05)
    assert len({instance.bytes() for instance in instances}) == 1
    for instance in instances:
        instance.free()


@pytest.mark.slow
def test_two_builds_of_one_model_in_one_process_keep_their_own_content(native, tmp_path):
    other = tmp_path / "PRBDM.fmu"
    write(other, native_fmu.build(mechanism("PRBDM"), {"stop.restitution": 0.1}, fmi=3))
    with Instance(native["PRBDM", 3]).initialize() as a, Instance(other).initialize() as b:
        for k in range(50):
            a.advance((k + 1) * 1e-3)
            b.advance((k + 1) * 1e-3)
        rows = {0.6: a.values(), 0.1: b.values()}
    for restitution, values in rows.items():
        assert values["stop.restitution"] == restitution
        assert values["stop.impact_count"] == 1
        assert values["stop.rebound_speed"] == pytest.approx(
            restitution * values["stop.approach_speed"], rel=1e-12
        )  # round-off


# -- states and time --


@pytest.mark.parametrize("fmi", [2, 3])
@each_shipped
def test_states_derivatives_and_indicators_equal_their_declared_variables(native, model, fmi):
    with Instance(native[model, fmi], "me").initialize() as instance:
        states = [u.variable.derivative for u in instance.description.derivatives]
        nominals = (c_double * len(states))()
        instance.fmu.getNominalsOfContinuousStates(nominals, len(states))
        assert [*nominals] == [float(state.nominal) for state in states]
        integrator = Integrator(instance)
        assert integrator.x() == pytest.approx(instance.get(*(s.name for s in states)), rel=0.0)
        names = [v.name for v in instance.description.modelVariables
                 if v.name.endswith("_indicator")]  # fmt: skip
        assert [*integrator.z()] == instance.get(*names)
        found = integrator.slope(0.0, integrator.x())
        assert [*found] == instance.get(
            *(u.variable.name for u in instance.description.derivatives)
        )


@pytest.mark.parametrize("fmi", [2, 3])
def test_time_is_a_variable_in_fmi_3_only(native, fmi):
    with Instance(native["PRBDM", fmi]) as instance:
        assert ("time" in instance.variables) == (fmi == 3)
        if fmi == 3:
            assert instance.enter(start=1.5).get("time") == [1.5]
            assert instance.begin().get("time") == [1.5]
            instance.advance(1.6)
            assert instance.get("time") == [1.6]
