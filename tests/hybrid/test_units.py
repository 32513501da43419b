"""Results do not depend on the units of length, mass and time.

The factors are powers of four, which are exact in products, quotients and square roots.  All
results are therefore the same to the last bit.
"""

import pytest

from kernel_simulation import KernelMistake, KernelSimulation
from prbm.base.errors import PrbmError
from prbm.fmu.start import interface
from prbm.hybrid.simulation import Simulation
from random_mechanisms import seeded
from scaled import Units, unbounded
from support import each_shipped, mechanism

TIMES = (0.0, 3e-3, 0.01, 0.02)
CHANGES = tuple(
    pytest.param({dimension: factor}, id=f"{dimension}*{factor:.1g}")
    for dimension in ("length", "mass", "time")
    for factor in (4.0**-10, 4.0**5)
)
ENGINES = (Simulation, KernelSimulation)
SEEDS = [*range(4), *(pytest.param(k, marks=pytest.mark.slow) for k in range(4, 84))]
each_change = pytest.mark.parametrize("factors", CHANGES)


def motion(engine, model, times):
    """Return the outputs at some times, and the message of the error that ended the motion."""
    simulation, found = None, []
    try:
        simulation = engine(model)
        for t in times:
            simulation.advance(t)
            found.append(dict(simulation.outputs()))
    except (PrbmError, KernelMistake) as error:
        return found, str(error)
    return found, ""


def assert_same_motion(engine, given, factors, monkeypatch):
    """Compare the motion of a mechanism with that in other units."""
    with unbounded(monkeypatch):
        units, model = Units(**factors), Units().mechanism(given)
        of = {v.name: units.of(v.unit) for v in interface(model, {})}
        expected, error = motion(engine, model, TIMES)
        times = [t * units.factors["s"] for t in TIMES]
        found, other_error = motion(engine, units.mechanism(model), times)
    assert bool(error) == bool(other_error)
    assert len(found) == len(expected)
    for one, other in zip(expected, found, strict=True):
        for name in of.keys() & one.keys():
            assert other[name] / of[name] == one[name], name


@each_change
@each_shipped
def test_the_motion_of_a_shipped_mechanism_is_the_same_in_all_units(model, factors, monkeypatch):
    assert_same_motion(KernelSimulation, mechanism(model), factors, monkeypatch)


@each_change
@pytest.mark.parametrize("model", ["PRBDM", "ImpactOscillator"])
def test_the_motion_in_the_engine_is_the_same_in_all_units(model, factors, monkeypatch):
    assert_same_motion(Simulation, mechanism(model), factors, monkeypatch)


@pytest.mark.parametrize("seed", SEEDS)
def test_the_motion_of_a_random_mechanism_is_the_same_in_all_units(seed, monkeypatch):
    model = seeded(seed)
    for change in CHANGES:
        assert_same_motion(KernelSimulation, model, change.values[0], monkeypatch)
