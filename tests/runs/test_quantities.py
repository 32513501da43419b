"""Named quantities of motions: settling time, impacts, speeds, lost energy."""

import math
import re

import numpy as np
import pytest
from scipy.optimize import brentq

from prbm.files.mechanism_file import load
from prbm.runs.headline import headline
from prbm.runs.quantities import QUANTITIES, SETTLED_ENERGY_RTOL, settling, settling_estimate
from prbm.runs.run import simulate

DECAY, OMEGA = 4.0, 30.0  # 1/s, rad/s


def vibration(end: float, decay: float = DECAY, step: float = 1e-4) -> dict[str, np.ndarray]:
    """Return the columns of x = exp(-decay t) cos(omega t) with the kinetic energy x'^2 / 2."""
    t = np.arange(0.0, end + 0.5 * step, step)
    v = -np.exp(-decay * t) * (decay * np.cos(OMEGA * t) + OMEGA * np.sin(OMEGA * t))
    frequency = np.full(len(t), OMEGA / (2 * math.pi))
    return {"time": t, "energy.kinetic": v**2 / 2, "mode.frequency": frequency}


@pytest.mark.slow
def test_settling_of_a_damped_vibration_is_the_last_crossing_of_the_threshold():
    columns = vibration(3.0)

    def excess(t: float) -> float:
        v = math.exp(-DECAY * t) * (DECAY * math.cos(OMEGA * t) + OMEGA * math.sin(OMEGA * t))
        return v**2 / 2 - SETTLED_ENERGY_RTOL * float(columns["energy.kinetic"].max())

    above = [t for t in np.arange(0.0, 3.0, 1e-4) if excess(t) > 0.0]
    exact = brentq(excess, above[-1], above[-1] + 2e-4, xtol=1e-12)
    assert settling(columns) == pytest.approx(exact, abs=1e-6)
    assert all(excess(t) <= 0.0 for t in np.arange(exact + 1e-6, 3.0, 1e-5))


def test_a_vibration_that_turns_back_at_the_end_has_not_settled():
    """The kinetic energy is zero there, but not for half a period."""
    period = 2 * math.pi / OMEGA
    for end in (3 * period, 3.25 * period, 3.5 * period):
        assert math.isnan(settling(vibration(end, decay=0.0, step=period / 1000)))


def test_a_mechanism_in_which_nothing_moves_has_settled_at_once():
    columns = vibration(0.1)
    columns["energy.kinetic"] = np.where(columns["time"] < 0.05, 1.0, 0.0)
    assert settling(columns) == pytest.approx(0.05, abs=1e-4)
    columns["energy.kinetic"][-1] = 1e-6
    assert math.isnan(settling(columns))


def test_a_mechanism_has_not_settled_while_one_body_rests_and_another_vibrates():
    """The vibrating body turns back at the end; its energy adds to that of the resting body."""
    period = 2 * math.pi / OMEGA
    columns = vibration(3 * period, decay=0.0, step=period / 1000)
    columns["energy.kinetic"] += np.where(columns["time"] < 0.05, 1.0, 0.0)
    columns["stop.contact"] = columns["time"] > 0.05
    assert columns["energy.kinetic"][-1] < 1e-9
    assert math.isnan(settling(columns))


@pytest.mark.parametrize(
    ("name", "values"),
    [("ImpactOscillator", {"damping.zeta": 0.2}), ("PRBDM", {}), ("PRBDM2R", {})],
)
def test_a_run_that_ends_later_has_settled_at_the_same_time(mechanisms, name, values):
    """One and several bodies; the ends include turning points of all of them."""
    columns = simulate(mechanisms[name], values).columns
    energy = columns["energy.kinetic"]
    after = int(np.argmax(energy)) + 1
    found = [settling(columns[:k]) for k in range(after + 1, len(columns) + 1)]
    assert not math.isnan(found[-1])
    assert {x for x in found if not math.isnan(x)} == {found[-1]}


def test_settling_does_not_depend_on_the_rows_of_a_smooth_motion():
    assert settling(vibration(3.0, step=1e-3)) == pytest.approx(settling(vibration(3.0)), abs=1e-4)


def test_a_mechanism_at_rest_settles_at_the_start():
    still = vibration(1.0)
    still["energy.kinetic"] = np.zeros_like(still["time"])
    assert settling(still) == 0.0


def test_quantities_of_a_simulation_agree_with_its_impacts(mechanisms):
    result = simulate(mechanisms["PRBDM"], stop_time=0.3)
    found = {name: quantity.compute(result.columns) for name, quantity in QUANTITIES.items()}
    speeds = [impact.latched.approach_speed for impact in result.impacts]
    assert found["impacts"] == len(result.impacts)
    assert found["impact_speed"] == pytest.approx(max(speeds), rel=1e-12)
    assert found["peak_speed"] == pytest.approx(
        np.hypot(result["shuttle.vx"], result["shuttle.vy"]).max(), rel=1e-12
    )
    start, end = (
        sum(result[f"energy.{name}"][row] for name in ("kinetic", "elastic", "gravitational"))
        for row in (0, -1)
    )
    assert found["energy_lost"] == pytest.approx(start - end, abs=1e-7 * start)
    # The energy of the guide is proportional to the square of its speed.  The speed at an impact
    # exceeds that in the rows by up to the acceleration times the step, 0.01 m/s.
    slow = math.sqrt(SETTLED_ENERGY_RTOL) * found["peak_speed"] + 0.01
    fast = [impact.time for impact in result.impacts if impact.latched.approach_speed > slow]
    held = result["time"][np.flatnonzero(result["stop.contact"])[0]]
    assert fast[-1] < found["settling"] < held


@pytest.mark.parametrize(("stop_time", "words"), [(0.3, r"at t = 0\.2\d\d s"), (0.1, "not yet")])
def test_the_headline_states_whether_the_motion_has_settled(mechanisms, stop_time, words):
    result = simulate(mechanisms["PRBDM"], stop_time=stop_time)
    (line,) = (
        line for line in headline(result.columns, result.mechanism, result.start_values)
        if line.startswith("settled")
    )  # fmt: skip
    assert re.search(words, line)


@pytest.mark.slow
def test_a_vibration_beside_a_body_at_rest_is_explained(mechanisms):
    result = simulate(mechanisms["FoldedSuspension"], stop_time=1.0)
    lines = headline(result, result.mechanism, result.start_values)
    assert [line for line in lines if line.startswith("came to rest")]
    (line,) = (line for line in lines if line.startswith("settled"))
    assert "not yet: a body rests on its stop, but the mechanism still vibrates" in line


def test_needed_variables_are_reported():
    assert QUANTITIES["settling"].lacking(["energy.kinetic"]) == "mode.frequency"
    assert QUANTITIES["impacts"].lacking(["stop.impact_count"]) == ""


@pytest.mark.slow
@pytest.mark.parametrize("zeta", [0.01, 0.02])
def test_the_settling_time_is_estimated_from_a_part_of_the_decay(zeta):
    """A longer run of the same vibration settles at the estimated time."""
    guide = load("PRBDM")
    values = {"damping.zeta": zeta, "stop.position": 0.05, "gravity.x": 0.0}
    short = simulate(guide, values, stop_time=2.0, step=2e-3).columns
    long = simulate(guide, values, stop_time=40.0, step=2e-3).columns
    assert np.isnan(settling(short))
    assert settling_estimate(short, 0.0) == pytest.approx(settling(long), rel=0.03)


def test_without_damping_or_time_there_is_no_estimate():
    guide = load("PRBDM")
    values = {"damping.beta": 0.0, "stop.position": 0.05}
    free = simulate(guide, values, stop_time=3.0, step=1e-3).columns
    assert settling_estimate(free, 0.0) > 1e3
    assert np.isnan(settling_estimate(free, 2.9))
