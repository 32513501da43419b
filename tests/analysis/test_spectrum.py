"""Spectra after an impact: amplitudes of known sines, peaks at the modes of small motions."""

import numpy as np
import pytest

from prbm.analysis.spectrum import after_impact, after_last_impact, peaks, spectrum
from prbm.base.errors import ParameterError
from prbm.drawing.style import png
from prbm.plots.spectrum import spectrum_figure
from prbm.runs.run import simulate
from support import mechanism


def test_amplitudes_and_frequencies_of_known_sines_are_found():
    """The frequencies are between lines of the transform; amplitudes are found to 15 %."""
    t = np.arange(2000) * 5e-4
    f, a = spectrum(
        t, 2.0 * np.sin(2 * np.pi * 40.37 * t) + 0.3 * np.cos(2 * np.pi * 211.6 * t) + 50 * t
    )
    np.testing.assert_allclose(peaks(f, a), [40.37, 211.6], atol=0.02)
    assert a[np.abs(f - 40.37) < 1].max() == pytest.approx(2.0, rel=0.15)  # Hann's scalloping
    assert a[np.abs(f - 211.6) < 1].max() == pytest.approx(0.3, rel=0.15)


@pytest.fixture(scope="module")
def small_motion():
    """Return the motion after a small off-centre impact near the static equilibrium."""
    values = {
        "release.displacement": 10.6e-3,
        "stop.position": 10.8e-3,
        "stop.offset": 4e-3,
        "damping.beta": 0.0,
    }
    return after_impact(mechanism("PRBDM2R"), values, 0.8, 1e-3)


def test_small_motions_ring_at_the_modes_of_the_impact_shape(small_motion):
    """Each mode has a peak within 0.2 %; the modes vary with the shape during the motion."""
    found = np.concatenate([
        peaks(*spectrum(small_motion.time, getattr(small_motion, name)), share=0.005)
        for name in ("along", "across", "turning")
    ])  # fmt: skip
    for mode in small_motion.modes[:3]:
        assert np.abs(found - mode).min() < 2e-3 * mode + 0.05


def test_the_wall_is_removed_after_the_impact(small_motion):
    """The body moves past the former position of the wall."""
    x = np.cumsum(small_motion.along) * 1e-3
    assert x.max() > 1e-5


def test_an_off_centre_impact_turns_the_guide_more_than_a_centred_one():
    """The largest angular velocity is more than 1.5 times as high."""
    turning = []
    for offset in (0.0, 4e-3):
        values = {"stop.offset": offset, "gravity.x": 0.0}
        response = after_impact(mechanism("PRBDM2R"), values, 0.05, 5e-4)
        turning.append(np.abs(response.turning).max())
    assert turning[1] > 1.5 * turning[0]


def test_too_few_or_unequal_samples_are_rejected():
    with pytest.raises(ParameterError, match="samples"):
        after_impact(mechanism("PRBDM"), duration=1e-3, step=5e-4)
    with pytest.raises(ParameterError, match="equal steps"):
        spectrum(np.arange(20.0) ** 2, np.zeros(20))


@pytest.mark.slow
def test_the_figure_is_drawn(small_motion):
    assert png(spectrum_figure(small_motion, highest=400.0)).startswith(b"\x89PNG")
    assert len(spectrum_figure(small_motion, ("along",)).axes) == 1


def test_after_the_last_impact_the_oscillator_vibrates_at_its_frequency():
    """The hammer bounces once, then vibrates at a small amplitude for 20 periods."""
    values = {"release.displacement": -3e-3, "impact.restitution": 0.5, "damping.beta": 0.0}
    result = simulate(mechanism("ImpactOscillator"), values, stop_time=1.0)
    motion = after_last_impact(result)
    assert motion.time[0] > 0.0
    assert motion.impact is result.impacts[-1]
    (hammer,) = peaks(*spectrum(motion.time, motion.along), share=0.3)
    assert hammer == pytest.approx(motion.modes[1], rel=0.01)  # nearly linear


def test_a_result_without_free_motion_after_an_impact_is_rejected():
    guide = mechanism("PRBDM")
    with pytest.raises(ParameterError, match="shuttle rests on stop"):
        after_last_impact(simulate(guide, {"stop.restitution": 0.0}, stop_time=0.2))
    with pytest.raises(ParameterError, match="has no impact"):
        after_last_impact(simulate(guide, stop_time=0.01))
    with pytest.raises(ParameterError, match="samples follow the last impact"):
        after_last_impact(simulate(guide, stop_time=0.05))
