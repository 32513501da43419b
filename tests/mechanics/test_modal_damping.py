"""Damping ratios and decay times of modes beside the motion, and beside oscillators."""

import math

import numpy as np
import pytest

from prbm.files.mechanism_file import load
from prbm.mechanics.assembly import assemble
from prbm.mechanics.modal import Modes, damping, modes
from prbm.mechanics.statics import equilibrium
from prbm.mechanics.system import System
from prbm.runs.run import simulate

# A small vibration about the straight shape, far from the stop.
SMALL = {"gravity.x": 0.0, "release.displacement": 1e-5, "stop.position": 0.02}


def found(name: str, **changes: float) -> tuple[System, Modes]:
    guide = load(name)
    system = assemble(guide, guide.values(SMALL | changes))
    return system, modes(system, equilibrium(system))


@pytest.mark.parametrize("law", [{"damping.zeta": 0.02}, {"damping.beta": 1e-3}])
def test_the_amplitude_falls_to_the_inverse_of_e_in_the_decay_time(law):
    """The peaks of the motion of the 1R guide, which has one mode."""
    changes = {"damping.zeta": 0.0, "damping.beta": 0.0} | law
    system, one = found("PRBDM", **changes)
    (_,), (time,) = damping(system, one, system.q0)
    period = 1.0 / float(one.frequency[0])
    whole = round(time / period) * period
    result = simulate(load("PRBDM"), SMALL | changes, stop_time=1.2 * whole, step=period / 200)
    x, t = np.abs(result["shuttle.x"]), result["time"]
    first, last = (x[np.abs(t - at) <= period / 4].max() for at in (period, whole))
    assert math.log(first / last) == pytest.approx((whole - period) / time, rel=2e-3)


def test_the_slower_of_two_motions_counts_above_the_critical_damping():
    changes = {"damping.zeta": 2.0, "damping.beta": 0.0}
    system, one = found("PRBDM", **changes)
    (ratio,), (time,) = damping(system, one, system.q0)
    assert ratio == pytest.approx(2.0)
    result = simulate(load("PRBDM"), SMALL | changes, stop_time=4 * time, step=time)
    assert result["shuttle.x"][3] / result["shuttle.x"][2] == pytest.approx(1 / math.e, rel=1e-3)


def test_the_ratios_are_those_of_uncoupled_oscillators():
    """With damping by M or by K alone; the times are those of the roots of the oscillators."""
    for zeta, beta in ((0.01, 0.0), (0.0, 1e-6)):
        system, several = found("PRBDM2R", **{"damping.zeta": zeta, "damping.beta": beta})
        ratios, times = damping(system, several, system.q0)
        omega = 2 * math.pi * several.frequency
        # Without loads, K of the springs is the tangent stiffness: the modes are uncoupled.
        expected = zeta * omega[0] / omega + beta * omega / 2
        np.testing.assert_allclose(ratios, expected, rtol=1e-6)
        for k, w in enumerate(omega):
            roots = np.roots([1.0, 2 * float(expected[k]) * w, w**2])
            np.testing.assert_allclose(times[k], -1.0 / roots.real.max(), rtol=1e-5)


def test_modes_without_damping_do_not_decay():
    system, one = found("PRBDM", **{"damping.zeta": 0.0, "damping.beta": 0.0})
    ratios, times = damping(system, one, system.q0)
    assert (ratios[0], times[0]) == (0.0, math.inf)


def test_unstable_modes_have_no_decay_time():
    system, one = found("PRBDM", **{"flexure.K_theta": 1.0, "gravity.y": -400.0})
    unstable = one.frequency < 0.0
    assert unstable.any()
    assert np.isnan(np.array(damping(system, one, system.q0))[:, unstable]).all()
