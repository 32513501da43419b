"""Impacts of mechanisms whose springs are so weak that a period takes hours."""

import pytest

from point_mass import point_mass
from prbm.runs.run import simulate

RESTITUTION, SPEED, ACCELERATION = 0.6, 4.4, 3500.0


@pytest.mark.parametrize("engine", ["kernel", "python"])
@pytest.mark.parametrize("mass", [1.0, 100.0])
def test_fast_impacts_bounce_at_any_frequency(engine, mass):
    """A force presses a mass on its stop: the second impact has the speed of the first rebound."""
    guide = point_mass(
        mass=mass, velocity=SPEED, displacement=-1e-6,
        law="rigid", stiffness=None, restitution=RESTITUTION,
    )  # fmt: skip
    flight = 2.0 * RESTITUTION * SPEED / ACCELERATION
    result = simulate(
        guide, inputs={"push.x": ACCELERATION * mass}, stop_time=1.1 * flight, step=0.1 * flight,
        engine=engine,
    )  # fmt: skip
    assert [impact.latched.rebound_speed for impact in result.impacts] == pytest.approx(
        [RESTITUTION * SPEED, RESTITUTION**2 * SPEED], rel=0.02
    )
