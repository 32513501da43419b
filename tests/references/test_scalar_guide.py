"""The scalar equation of the guide."""

import pytest

from prbm.base.errors import SimulationError
from prbm.references.scalar_guide import Monolith, ScalarGuide


def test_impacts_that_do_not_end_are_rejected():
    """Without a rest speed the bounces of a pressed body accumulate at a finite time."""
    guide = ScalarGuide(0.034, 0.03, 0.05, stops=(1e-3,), restitution=0.5, rest_speed=0.0)
    one = Monolith(guide, lambda t, x, v, z: 1.0)
    with pytest.raises(SimulationError, match=r"1000 impacts within .*rest_speed = 0 m/s .*increa"):
        one.advance(1.0)
    assert one.time < 0.1
