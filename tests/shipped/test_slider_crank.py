"""The slider-crank: its reduced equations with one degree of freedom."""

import math

import pytest

from support import mechanism, run

GUIDE = mechanism("SliderCrank")
VALUES = GUIDE.values()
R, LENGTH = VALUES["crank.radius"], math.hypot(VALUES["crank.radius"], VALUES["slider.distance"])
WEIGHT = -VALUES["gravity.y"]


def crank(x: float) -> tuple[float, float, float, float]:
    """Return the crank's angle and that of the rod, and their derivatives by the slider's place.

    ``x`` is the distance of the slider's pin from the pivot; angles are from +x.
    """
    above = math.acos((R**2 + x**2 - LENGTH**2) / (2.0 * R * x))
    below = math.asin(R * math.sin(above) / LENGTH)
    # x = R cos(above) + L cos(below), R sin(above) = L sin(below)
    rate = -1.0 / (R * math.sin(above) + R * math.cos(above) * math.tan(below))
    return above, below, rate, rate * R * math.cos(above) / (LENGTH * math.cos(below))


def potential(x: float) -> float:
    """Return the energy of gravity and the spring, with the slider's pin at x [J]."""
    above, *_ = crank(x)
    height = VALUES["crank.mass"] * R / 4.0 + VALUES["rod.mass"] * R / 2.0
    tip = VALUES["coil.distance"] - x - 8e-3
    stretch = tip - VALUES["coil.free_length"]
    return WEIGHT * height * math.sin(above) + 0.5 * VALUES["coil.stiffness"] * stretch**2


def inertia(x: float) -> float:
    """Return the mass that the slider's speed moves [kg]."""
    above, below, a, b = crank(x)
    rod_x = -R * math.sin(above) * a - 0.5 * LENGTH * math.sin(below) * b
    rod_y = 0.5 * R * math.cos(above) * a
    return (
        VALUES["slider.mass"]
        + (VALUES["crank.inertia"] + VALUES["crank.mass"] * (R / 4.0) ** 2) * a**2
        + VALUES["rod.mass"] * (rod_x**2 + rod_y**2)
        + VALUES["rod.inertia"] * b**2
    )


def slope(x: float) -> float:
    step = 1e-6
    return (potential(x + step) - potential(x - step)) / (2.0 * step)


def test_the_first_impact_has_the_energy_of_the_released_shape() -> None:
    """Without the damper of the spring, the kinetic energy is the loss of the potential."""
    result = run(GUIDE, {"coil.damping": 0.0}, stop_time=0.05)
    impact = result.simulation.record[0]
    start, stop = (VALUES["slider.distance"] + d for d in (-15e-3, 5e-3))
    speed = math.sqrt(2.0 * (potential(start) - potential(stop)) / inertia(stop))
    assert impact.latched.approach_speed == pytest.approx(speed, rel=1e-7)
    assert impact.latched.impulse == pytest.approx(1.5 * inertia(stop) * speed, rel=1e-7)


@pytest.mark.slow
def test_the_slider_rests_on_its_stop_with_the_force_of_virtual_work() -> None:
    last = run(GUIDE).outputs[-1]
    assert last["stop.contact"]
    assert last["slider.x"] == pytest.approx(5e-3, abs=1e-9)
    assert last["stop.force"] == pytest.approx(-slope(VALUES["slider.distance"] + 5e-3), rel=1e-6)


def test_a_moment_of_the_motor_holds_the_slider() -> None:
    """Before the stop, with the moment of virtual work, the released mechanism does not move."""
    x = VALUES["slider.distance"] - 15e-3
    moment = slope(x) / crank(x)[2]
    result = run(GUIDE, {"motor.moment": moment}, stop_time=0.02)
    assert abs(result.outputs[-1]["slider.x"] + 15e-3) < 1e-8
