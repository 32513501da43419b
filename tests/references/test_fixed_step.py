"""The integration of the thesis: fourth order on a smooth arc, impacts up to a step late."""

import numpy as np
import pytest

from prbm.base.errors import ParameterError
from prbm.hybrid.simulation import Simulation
from prbm.references.fixed_step import march
from support import ScalarGuide, mechanism

FREE = {"stop.position": 0.05, "damping.beta": 0.0}


@pytest.mark.slow
def test_rk4_with_projection_is_of_fourth_order():
    """The slope of the error over five halvings; the reference is the engine at 1e-13."""
    exact = Simulation(mechanism("PRBDM"), FREE, tolerance=1e-13)
    exact.advance(0.128)
    steps = 0.008 / 2.0 ** np.arange(6)
    errors = [
        np.abs(march(mechanism("PRBDM"), FREE, stop_time=0.128, step=h).q[-1] - exact.state()[:3])
        for h in steps
    ]
    slope = np.polyfit(np.log(steps), np.log(np.max(errors, axis=1)), 1)[0]
    assert slope == pytest.approx(4.0, abs=0.1)


@pytest.mark.parametrize("step", [2**-9, 2**-11, 2**-13])
def test_first_impact_is_detected_up_to_a_step_late(step):
    values = {"release.displacement": -0.01}
    guide = ScalarGuide.of(mechanism("PRBDM").values(values))
    (exact,), _ = guide.bounces(-0.01, 0.6, 1)
    found = march(mechanism("PRBDM"), values, stop_time=0.05, step=step)
    late = found.impacts[0][0] - exact
    assert -1e-6 <= late <= step * (1 + 1e-6)


def test_an_invalid_step_is_rejected():
    for step in (0.0, -1e-3, 2.0):
        with pytest.raises(ParameterError, match="step = "):
            march(mechanism("PRBDM"), stop_time=1.0, step=step)
