"""Units of the axes follow the magnitudes of a mechanism."""

from dataclasses import replace

import numpy as np

from prbm.analysis import holding
from prbm.analysis.spectrum import AfterImpact, after_impact
from prbm.mechanics.assembly import assemble
from prbm.plots.holding import holding_figure
from prbm.plots.spectrum import spectrum_figure
from support import mechanism


def scaled(response: AfterImpact, factor: float) -> AfterImpact:
    """Return a vibration that is faster by a factor."""
    impact = replace(response.impact, time=response.impact.time / factor)
    modes = factor * response.modes
    return replace(response, time=response.time / factor, modes=modes, impact=impact)


def test_spectra_of_fast_mechanisms_have_an_axis_in_khz() -> None:
    slow = after_impact(mechanism("PRBDM"), duration=0.05)
    fast = scaled(slow, 100.0)
    one, other = spectrum_figure(slow), spectrum_figure(fast)
    assert one.axes[-1].get_xlabel() == "frequency [Hz]"
    assert other.axes[-1].get_xlabel() == "frequency [kHz]"
    assert "after the impact at 41.07 ms" in one.axes[0].get_title(loc="left")
    assert "after the impact at 410.7 µs" in other.axes[0].get_title(loc="left")
    (a, *_), (b, *_) = one.axes[-1].lines, other.axes[-1].lines
    np.testing.assert_allclose(b.get_xdata(), 0.1 * a.get_xdata())
    np.testing.assert_allclose(other.axes[-1].get_xlim(), 0.1 * np.array(one.axes[-1].get_xlim()))


def test_the_fundamental_of_a_fast_mechanism_is_drawn_in_khz() -> None:
    guide = mechanism("PRBDM2R")
    values = {"gravity.x": 0.0, "flexure.length": 4e-3, "flexure.thickness": 4e-4}
    values |= {"shuttle.mass": 1e-4, "release.displacement": -1e-5}
    system = assemble(guide, guide.values(values))
    curve = holding.curve(system, np.linspace(-1e-5, 1e-5, 5))
    panel = holding_figure(curve, "").axes[-1]
    assert panel.get_ylabel() == "fundamental [kHz]"
    hertz = [point.frequency for point in curve.points]
    np.testing.assert_allclose(panel.lines[0].get_ydata(), 1e-3 * np.array(hertz))
