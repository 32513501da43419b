"""Links that stretch: what is reported about them is what moves."""

import dataclasses

import pytest

from prbm import Simulation
from support import mechanism


def test_velocities_are_the_rates_of_the_displacements():
    """Central differences over 2 us; truncation is h^2 x'''/6 < 1e-5 m/s at modes of 12 kHz."""
    guide = mechanism("PRBDM2R")
    kinds = tuple(dataclasses.replace(kind, axial=True) for kind in guide.flexure_types)
    guide = dataclasses.replace(guide, flexure_types=kinds)
    sim = Simulation(guide, {"stop.offset": 4e-3, "stop.position": -5e-3})  # a hit stretches
    h = 1e-6
    for t in (0.012, 0.02):
        sim.advance(t - h)
        before = sim.outputs()
        sim.advance(t)
        now = sim.outputs()
        sim.advance(t + h)
        after = sim.outputs()
        for axis in "xy":
            rate = (after[f"shuttle.{axis}"] - before[f"shuttle.{axis}"]) / (2 * h)
            assert now[f"shuttle.v{axis}"] == pytest.approx(rate, abs=5e-6)
