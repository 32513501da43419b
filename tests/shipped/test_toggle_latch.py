"""The toggle latch: its energy, moments and times with one degree of freedom."""

import math

import pytest
from scipy.integrate import quad

import prbm
from support import mechanism

LATCH = mechanism("ToggleLatch")
VALUES = LATCH.values()
LENGTH, PIN, ANCHOR = (VALUES[name] for name in ("lever.length", "pin.distance", "anchor.distance"))
K, FREE = VALUES["coil.stiffness"], VALUES["coil.free_length"]
ARM, WEIGHT = 0.4 * LENGTH, -VALUES["lever.mass"] * VALUES["gravity.y"]
INERTIA = VALUES["lever.inertia"] + VALUES["lever.mass"] * ARM**2
AGAINST = math.asin(VALUES["throw"] / LENGTH)  # Angle at a stop.


def coil(angle: float) -> float:
    """Return the length of the spring at an angle from the dead centre."""
    return math.sqrt(PIN**2 + ANCHOR**2 + 2.0 * PIN * ANCHOR * math.cos(angle))


def potential(angle: float) -> float:
    """Return the energy of the spring and of gravity."""
    return 0.5 * K * (coil(angle) - FREE) ** 2 + WEIGHT * ARM * math.cos(angle)


def moment(angle: float) -> float:
    """Return the moment away from the dead centre."""
    tension = K * (coil(angle) - FREE)
    return (tension * PIN * ANCHOR / coil(angle) + WEIGHT * ARM) * math.sin(angle)


def rate(angle: float, start: float) -> float:
    """Return the rate at an angle after a release at rest."""
    return math.sqrt(2.0 * (potential(start) - potential(angle)) / INERTIA)


def test_the_first_impact_has_the_energy_and_the_time_of_the_fall():
    start = math.asin(VALUES["release.displacement"] / ARM)
    result = prbm.simulate(LATCH, {"coil.damping": 0.0}, stop_time=0.03)
    first = result.impacts[0]
    speed = LENGTH * math.cos(AGAINST) * rate(AGAINST, start)
    assert first.stop == "right"
    assert first.latched.approach_speed == pytest.approx(speed, rel=1e-6)
    # With angle = start + s^2 the integrand is smooth at the release.
    time, _ = quad(
        lambda s: 2.0 * s / rate(start + s * s, start), 0.0, math.sqrt(AGAINST - start), epsrel=1e-9
    )
    assert first.time == pytest.approx(time, rel=1e-5)


@pytest.mark.parametrize(("share", "snaps"), [(0.999, False), (1.001, True)])
def test_a_force_above_the_holding_force_makes_it_snap(share, snaps):
    """At rest the stop carries the moment of the spring and of the weight."""
    holding = moment(AGAINST) / (LENGTH * math.cos(AGAINST))
    push = f"step({-share * holding!r} N, 0.1 s)"
    result = prbm.simulate(LATCH, inputs={"push.x": push}, stop_time=0.6)
    before = result["time"].searchsorted(0.09)
    assert result["right.force"][before] == pytest.approx(holding, rel=1e-6)
    assert (result["left.impact_count"][-1] > 0) == snaps
    assert bool(result["right.contact"][-1]) != snaps


def test_the_dead_centre_is_unstable_with_its_negative_stiffness():
    shape = prbm.equilibrium(LATCH, held=0.0)
    stretch = K * (coil(0.0) - FREE)
    stiffness = -(stretch * PIN * ANCHOR / coil(0.0) + WEIGHT * ARM)
    assert shape.stiffness == pytest.approx(stiffness / ARM**2, rel=1e-9)
    assert not shape.stable


@pytest.mark.parametrize("angle", [-0.3, 0.1, 0.5])
def test_a_force_at_the_centre_holds_it_with_the_moment_on_its_arm(angle):
    """The force is horizontal, so that its arm is the height of the centre above the pivot."""
    shape = prbm.equilibrium(LATCH, held=ARM * math.sin(angle))
    assert shape.force == pytest.approx(-moment(angle) / (ARM * math.cos(angle)), rel=1e-9)
