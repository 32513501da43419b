"""Model exchange with the solver of FMPy, CVode, at usual tolerances."""

from typing import Any

import numpy as np
import pytest
from fmpy import simulate_fmu
from fmpy.fmi3 import FMU3Model

from support import case

pytestmark = [pytest.mark.fmu, pytest.mark.native]

OPTIONS = {"output_interval": 1e-3, "record_events": False}
DRIFT_MAX = 1e-8  # m; the guides are 80 mm wide.


def count_events(monkeypatch) -> list[None]:
    """Return a list that grows by one element at each event."""
    events: list[None] = []
    enter = FMU3Model.enterEventMode

    def counting(self: FMU3Model) -> Any:
        events.append(None)
        return enter(self)

    monkeypatch.setattr(FMU3Model, "enterEventMode", counting)
    return events


def exchanged(path, tolerance: float, *output: str) -> np.ndarray:
    return simulate_fmu(
        str(path), fmi_type="ModelExchange", relative_tolerance=tolerance, output=[*output],
        **OPTIONS,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("model", "impacts", "tolerance", "error"),
    [
        ("PRBDM2R", 14, 1e-6, 2e-5),
        ("ImpactOscillator", 9, 1e-4, 3e-2),
        ("ImpactOscillator", 9, 1e-6, 1e-3),
    ],
)
def test_the_default_experiment_is_reproduced(native, model, impacts, tolerance, error):
    """All impacts are found.  The error is relative to the range of the displacement."""
    it = case(model)
    output = (f"{it.body}.x", f"{it.stop}.impact_count")
    exact = simulate_fmu(
        str(native[model, 3]), relative_tolerance=1e-11, output=[*output], **OPTIONS
    )
    found = exchanged(native[model, 3], tolerance, *output)
    assert found[output[1]][-1] == exact[output[1]][-1] == impacts
    x = np.interp(exact["time"], found["time"], found[output[0]])
    assert np.abs(x - exact[output[0]]).max() < error * np.ptp(exact[output[0]])


@pytest.mark.parametrize("tolerance", [1e-4, 1e-6])
def test_a_resting_body_requests_few_events(native, monkeypatch, tolerance):
    """Each event restarts the solver.  In between, the drift off the wall is limited."""
    events = count_events(monkeypatch)
    output = ("stop.gap", "stop.contact", "stop.impact_count")
    found = exchanged(native["PRBDM2R", 3], tolerance, *output)
    rests = found["stop.contact"].astype(bool)
    assert rests[-1]
    assert found["time"][rests][0] < 0.3
    others = len(events) - found["stop.impact_count"][-1]
    assert others < 6  # The capture, and corrections of drift during 0.7 s.
    assert np.abs(found["stop.gap"][rests]).max() < DRIFT_MAX
