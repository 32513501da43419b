"""The motion of the released point is that of a probe at this point, wherever it is measured."""

import math
from dataclasses import replace

import numpy as np
import pytest

from prbm.analysis.fit import DISPLACEMENT, Response
from prbm.analysis.holding import held
from prbm.analysis.shock import Pulse, shock
from prbm.data.series import Series
from prbm.files.mechanism_file import read_mechanism
from prbm.mechanics.assembly import assemble
from prbm.mechanics.system import unit
from prbm.mechanism.parts import Probe, Release
from prbm.plots.figures import response
from prbm.plots.shock import shock_figure
from prbm.runs.headline import headline
from prbm.runs.run import simulate
from support import SUPPORT

FINGER = read_mechanism(SUPPORT / "finger.toml")
DIRECTION = 30.0
FINGER = replace(
    FINGER,
    probes=(Probe("tip", "finger.tip"),),
    release=Release("finger", DIRECTION, -2e-3, point=FINGER.point("finger.tip", "release")),
)


def probed(columns, x, y):
    """Return an output vector of the probe along the direction of the release."""
    u = unit(DIRECTION).conjugate()
    return (u * (columns[f"tip.{x}"] + 1j * columns[f"tip.{y}"])).real


@pytest.fixture(scope="module")
def result():
    return simulate(FINGER, stop_time=0.02, step=2e-4)


def test_the_figure_of_a_response_shows_the_released_point(result):
    displacement, velocity = response(result).axes[:2]
    for axes, outputs in ((displacement, "xy"), (velocity, ("vx", "vy"))):
        factor = {"m": 1.0, "mm": 1e3, "µm": 1e6}[
            axes.get_ylabel().split("[")[1][:-1].split("/")[0]
        ]
        drawn = np.asarray(axes.lines[0].get_ydata())
        assert drawn == pytest.approx(factor * probed(result.columns, *outputs), rel=1e-9, abs=1e-9)


def test_the_summary_of_a_rest_has_the_place_of_the_released_point():
    pressed = {"gravity.x": 100.0, "stop.restitution": 0.0, "stop.position": -1e-3}
    result = simulate(FINGER, pressed, stop_time=0.05, step=5e-4)
    millimetres = 1e3 * float(probed(result.columns, "x", "y")[-1])
    place = f"finger {millimetres:.2f} mm from straight along 30 degrees at the released point"
    assert sum(place in line for line in headline(result, FINGER, result.start_values)) == 1


def test_a_fitted_displacement_is_that_of_the_released_point(result):
    series = Series(result["time"], np.zeros(len(result["time"])), "m")
    model = Response(series, DISPLACEMENT, None, 1e-8).model(FINGER, result.start_values)
    assert model == pytest.approx(probed(result.columns, "x", "y"), rel=1e-6, abs=1e-9)


def test_a_shock_displaces_the_released_point():
    pulse = Pulse("half-sine", 100.0, 1e-3)
    found = shock(FINGER, {pulse.input: pulse.signal}, duration=pulse.duration, stop_time=0.02)
    along = probed(found.result.columns, "x", "y")
    moved = along - along[0]
    assert found.displacement == pytest.approx(moved[np.abs(moved).argmax()], rel=1e-12)
    axes = shock_figure(found, "x").axes[1]
    assert "the released point of finger [mm]" in axes.get_ylabel()
    assert np.asarray(axes.lines[0].get_ydata()) == pytest.approx(1e3 * moved, rel=1e-9, abs=1e-12)


def test_a_held_shape_deviates_from_a_straight_line_at_the_released_point():
    """Its position is the straight one, displaced along and across the direction."""
    system = assemble(FINGER, FINGER.values())
    found = held(system, -2e-3)
    drawn = complex(*FINGER.release.point)
    centre = system.bodies["finger"]
    shape = simulate(FINGER, {"release.displacement": -2e-3}, stop_time=1e-6, step=1e-6).columns[0]
    moved = complex(shape["finger.x"], shape["finger.y"])
    turn = complex(math.cos(found.angle), math.sin(found.angle))
    moved += (drawn - centre.drawn) * (turn - 1.0)
    assert unit(DIRECTION) * complex(-2e-3, found.across) == pytest.approx(moved, rel=1e-6)
