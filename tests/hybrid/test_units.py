"""Results do not depend on the units of length, mass and time.

The factors are powers of four, which are exact in products, quotients and square roots.  All
results are therefore the same to the last bit.
"""

import re

import numpy as np
import pytest
from fmpy import simulate_fmu

from kernel_simulation import KernelMistake, KernelSimulation
from prbm.base.errors import PrbmError
from prbm.files.mechanism_file import load
from prbm.fmu.start import interface
from prbm.hybrid.simulation import Simulation
from random_mechanisms import seeded
from scaled import Units, unbounded
from springs import one_sided, web
from support import CASES, each_shipped, mechanism, own_fmu

TIMES = (0.0, 3e-3, 0.01, 0.02)
CHANGES = tuple(
    pytest.param({dimension: factor}, id=f"{dimension}*{factor:.1g}")
    for dimension in ("length", "mass", "time")
    for factor in (4.0**-10, 4.0**5)
)
ENGINES = (Simulation, KernelSimulation)
# The public cases, and the times that they are simulated [s].
DURATIONS = {
    "ball": 0.5, "ball4": 0.5, "buckle": 0.3, "chatter1016": 1e-4, "clock": 0.1, "column": 0.9,
    "comsol": 1e-4, "dp": 1e-3, "jam": 0.01, "jam2023": 0.02, "kane": 0.02, "lee": 0.01,
    "ligo_3R": 0.1, "ligo_beam": 0.4, "micro": 6e-6, "qiu10": 1e-5, "rhombus": 4e-3,
    "shockpoint": 0.01, "timo": 3e-4, "williams": 2e-3,
}  # fmt: skip
SEEDS = [*range(4), *(pytest.param(k, marks=pytest.mark.slow) for k in range(4, 44))]
each_change = pytest.mark.parametrize("factors", CHANGES)


def motion(engine, model, times):
    """Return the outputs at some times, and the message of the error that ended the motion."""
    found = []
    try:
        simulation = engine(model)
        for t in times:
            simulation.advance(t)
            found.append(dict(simulation.outputs()))
    except (PrbmError, KernelMistake) as error:
        return found, str(error)
    return found, ""


def kind(message):
    """Return a message without its numbers, which have units."""
    return re.sub(r"[-+.e\d]*\d", "", message)


def assert_same_motion(engine, given, factors, monkeypatch, times=TIMES):
    """Compare the motion of a mechanism with that in other units, or its refusal."""
    curved = {f"{s.name}.stiffness" for s in given.stops if s.exponent != 1.0}
    with unbounded(monkeypatch):
        units, model = Units(**factors), Units().mechanism(given)
        expected, error = motion(engine, model, times)
        later = [t * units.factors["s"] for t in times]
        found, other_error = motion(engine, units.mechanism(model), later)
        of = {v.name: units.of(v.unit) for v in interface(model, {})} if found else {}
    assert kind(error) == kind(other_error)
    assert len(found) == len(expected)
    for one, other in zip(expected, found, strict=True):
        for name in of.keys() & one.keys() - curved:
            assert other[name] / of[name] == one[name], name


@each_change
@each_shipped
def test_the_motion_of_a_shipped_mechanism_is_the_same_in_all_units(model, factors, monkeypatch):
    assert_same_motion(KernelSimulation, mechanism(model), factors, monkeypatch)


@each_change
@pytest.mark.parametrize("model", ["PRBDM", "ImpactOscillator"])
def test_the_motion_in_the_engine_is_the_same_in_all_units(model, factors, monkeypatch):
    assert_same_motion(Simulation, mechanism(model), factors, monkeypatch)


@each_change
def test_the_motion_of_bodies_on_springs_is_the_same_in_all_units(factors, monkeypatch):
    assert_same_motion(Simulation, web(), factors, monkeypatch)


@each_change
def test_the_motion_on_springs_in_tension_is_the_same_in_all_units(factors, monkeypatch):
    """The times are those of slack and acting springs."""
    times = (0.0, 0.03, 0.1, 0.2)
    assert_same_motion(Simulation, one_sided(("tension",) * 5), factors, monkeypatch, times)


@pytest.mark.parametrize("seed", SEEDS)
def test_the_motion_of_a_random_mechanism_is_the_same_in_all_units(seed, monkeypatch):
    model = seeded(seed)
    for change in CHANGES:
        assert_same_motion(KernelSimulation, model, change.values[0], monkeypatch)


@pytest.mark.slow
@pytest.mark.parametrize("path", sorted(CASES.glob("*.toml")), ids=lambda path: path.stem)
def test_the_motion_of_a_public_case_is_the_same_in_all_units(path, monkeypatch):
    times = [DURATIONS[path.stem] * share for share in (0.0, 0.5, 1.0)]
    for change in CHANGES[::2]:
        assert_same_motion(KernelSimulation, load(path), change.values[0], monkeypatch, times)


@pytest.mark.parametrize("kind", ["native2", "native3"])
@pytest.mark.parametrize("model", ["PRBDM", "ImpactOscillator"])
def test_the_results_of_an_fmu_are_the_same_in_all_units(model, kind, monkeypatch, tmp_path):
    """The units of its variables stay; their values are those of the other mechanism."""
    results, path, stop, step = {}, tmp_path / "model.fmu", 2.0**-5, 2.0**-10
    for change in ({}, *(change.values[0] for change in CHANGES[1::2])):
        with unbounded(monkeypatch):
            units = Units(**change)
            given = units.mechanism(mechanism(model))
            path.write_bytes(own_fmu(kind, given))
            of = {v.name: units.of(v.unit) for v in interface(given, {})}
            of["time"] = units.factors["s"]
        result = simulate_fmu(
            path, stop_time=stop * of["time"], output_interval=step * of["time"],
            step_size=step * of["time"],
        )  # fmt: skip
        results[tuple(change)] = {name: result[name] / of[name] for name in result.dtype.names}
    expected = results.pop(())
    for found in results.values():
        for name, values in expected.items():
            np.testing.assert_array_equal(found[name], values, err_msg=name)
