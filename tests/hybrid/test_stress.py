"""Stress of flexures and its peaks: faces, parabolas, events, causality, both engines."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import BarycentricInterpolator

import prbm
from exchange import assert_directional
from prbm.files.mechanism_file import read_mechanism
from prbm.hybrid.peaks import Peak, Sample
from prbm.hybrid.simulation import Simulation
from prbm.kernel.simulation import KernelSimulation
from prbm.mechanics.assembly import assemble
from prbm.mechanics.sections import static_section_loads
from prbm.mechanics.statics import equilibrium
from prbm.mechanics.stress import faces, section_positions, static_stresses
from support import SUPPORT

PIVOT = read_mechanism(SUPPORT / "pivot.toml")
ENGINES = pytest.mark.parametrize("engine", [Simulation, KernelSimulation])
THROWN = {"release.displacement": 0.0, "release.velocity": -0.5, "gravity.x": 0.0}


def guide(model="beam", **changes):
    """Return the guide with stress as outputs of its flexures."""
    known = prbm.load("PRBDM2R")
    kinds = tuple(replace(k, model=model, stress=True, **changes) for k in known.flexure_types)
    return replace(known, flexure_types=kinds)


def test_left_face_is_in_tension_where_the_flexure_bends_to_the_right():
    system = assemble(guide(), guide().values({"gravity.x": 0.0}))
    found = static_stresses(system, equilibrium(system, 5e-3))
    for one in found.values():
        assert one.start > 0.0 > one.end
        assert one.largest == pytest.approx(max(one.start, -one.end), rel=1e-2)


def test_tension_adds_to_both_faces():
    """A vertical load stretches the straight leaves: the stress is the force over the area."""
    straight = guide(axial=True)
    changes = {"gravity.x": 0.0, "gravity.y": 9.81}
    system = assemble(straight, straight.values(changes))
    found = static_stresses(system, equilibrium(system))
    moving = 0.053187 + 2 * 7800 * 0.04 * 8e-3 * 1e-4
    area = 8e-3 * 1e-4
    for one in found.values():
        assert one.start == pytest.approx(9.81 * moving / 2 / area, rel=1e-6)
        assert one.end == pytest.approx(9.81 * 0.053187 / 2 / area, rel=1e-6)


def pivot(**changes):
    """Return a cross-spring pivot on beams, with stress as outputs of its flexures."""
    kinds = tuple(replace(k, model="beam", stress=True, **changes) for k in PIVOT.flexure_types)
    return replace(PIVOT, flexure_types=kinds)


@pytest.mark.parametrize("order", [3, 5])
@pytest.mark.parametrize(("weight", "degrees"), [(-20.0, 20.0), (-40.0, 20.0), (-20.0, -45.0)])
def test_stress_is_the_maximum_of_the_polynomial_between_the_nodes(order, weight, degrees):
    """Beams of the same order and 24 nodes have the same moment, in sections close together.

    The weight of the wheel compresses the leaves, which bulge.  Their largest stress is not in a
    section.
    """
    between = 0
    changes = {"gravity.y": weight, "gravity.x": 0.0}
    fine, coarse = (pivot(order=order, nodes=nodes) for nodes in (24, None))
    systems = [assemble(model, model.values(changes)) for model in (fine, coarse)]
    shapes = [equilibrium(system, np.radians(degrees)) for system in systems]
    found = static_stresses(systems[1], shapes[1])
    for loads in static_section_loads(systems[0], shapes[0]):
        nodes = slice(loads.smooth.start, loads.smooth.stop)
        s = loads.position[nodes]
        x = np.linspace(s[0], s[-1], 2001)
        dense = [BarycentricInterpolator(s, face[nodes])(x) for face in faces(loads)]
        largest = max(float(np.abs(x).max()) for x in (*dense, *faces(loads)))
        assert found[loads.name].largest == pytest.approx(largest, rel=5e-5)
        positions = section_positions(systems[1])[loads.name]
        between += min(abs(positions - found[loads.name].position)) > 1e-3 * positions[-1]
    assert between


def test_derivatives_of_a_stress_between_nodes_equal_differences():
    assert_directional(pivot(order=3), {"gravity.y": -40.0}, {}, ())


@ENGINES
@pytest.mark.parametrize(("model", "changes"), [("beam", {"order": 3}), ("2R", {})])
def test_peak_is_the_maximum_of_the_stress(engine, model, changes):
    mechanism = guide(model, **changes)
    times = np.linspace(0.0, 0.12, 12001)  # Sampled by the faster engine.
    names = ("left_flexure.stress", "right_flexure.stress")
    sampled = KernelSimulation(mechanism, THROWN).sample(times, names)
    simulation = engine(mechanism, THROWN)
    simulation.advance(0.12)
    out = simulation.outputs()
    for name, column in zip(names, sampled.T, strict=True):
        flexure = name.removesuffix(".stress")
        assert out[f"{flexure}.peak_stress"] == pytest.approx(column.max(), rel=2e-3)
        assert 0.0 < out[f"{flexure}.peak_stress_time"] < 0.12


@ENGINES
def test_peak_does_not_depend_on_communication_points_and_is_known_only_afterwards(engine):
    mechanism = guide()
    fine, coarse = engine(mechanism, THROWN), engine(mechanism, THROWN)
    last = 0.0
    for t in np.linspace(0.0, 0.1, 101)[1:]:
        fine.advance(float(t))
        out = fine.outputs()
        assert out["left_flexure.peak_stress_time"] <= t
        assert out["left_flexure.peak_stress"] >= last
        last = out["left_flexure.peak_stress"]
    coarse.advance(0.1)
    same = coarse.outputs()
    for name in ("peak_stress", "peak_stress_time", "peak_stress_position"):
        assert out[f"left_flexure.{name}"] == same[f"left_flexure.{name}"]


@ENGINES
def test_peak_of_a_rising_stress_is_the_present_stress_within_a_step_too(engine):
    """The 1R guide is thrown out of its straight shape: its stress rises for 18 ms."""
    simulation = engine(guide("1R"), THROWN)
    for t in np.linspace(0.0, 0.018, 78)[1:]:
        simulation.advance(float(t))
        out = simulation.outputs()
        assert out["left_flexure.peak_stress"] == out["left_flexure.stress"]
        assert out["left_flexure.peak_stress_time"] == t


@ENGINES
def test_a_step_that_an_impulse_shortens_has_no_peak_at_its_end(engine):
    """An impulse stops the shuttle while the stress rises: the rest of the step never happens."""
    simulation = engine(guide("1R"), THROWN)
    simulation.advance(0.02)
    out = simulation.outputs()
    stopping = -2.0 * out["energy.kinetic"] / out["shuttle.vx"]
    simulation.set({"force.impulse.x": stopping})
    seen = [out["left_flexure.stress"]]
    for t in np.linspace(0.02, 0.021, 21)[1:]:
        simulation.advance(float(t))
        seen.append(simulation.outputs()["left_flexure.stress"])
    assert simulation.outputs()["left_flexure.peak_stress"] <= max(seen) * (1 + 1e-5)


@ENGINES
def test_a_saved_state_continues_with_the_same_peaks(engine):
    simulation = engine(guide(), THROWN)
    simulation.advance(0.03)
    saved = simulation.snapshot()
    simulation.advance(0.08)
    expected = simulation.outputs()
    simulation.restore(saved)
    simulation.advance(0.08)
    assert simulation.outputs() == expected


@pytest.mark.slow
def test_engines_agree_on_peaks_of_driven_motion_with_impacts():
    mechanism = guide()
    one, other = Simulation(mechanism, THROWN), KernelSimulation(mechanism, THROWN)
    for k, t in enumerate(np.linspace(0.0, 0.1, 41)[1:]):
        for simulation in (one, other):
            simulation.set({"base.acceleration.x": 3.0 * np.sin(0.3 * k)})
            simulation.advance(float(t))
        expected, found = one.outputs(), other.outputs()
        for name, x in expected.items():
            if "stress" in name:
                scale = 1.0 if name.endswith(("_time", "_position")) else 1e6
                assert found[name] == pytest.approx(x, rel=1e-5, abs=1e-5 * scale), (t, name)


def test_a_parabola_does_not_pass_an_event():
    peak = Peak()
    for t, x in ((0.0, 1.0), (1.0, 2.0)):
        peak = peak.after(Sample(t, x, 1, 0.0))
    peak = peak.restarted().after(Sample(2.0, 1.5, 1, 0.0))
    assert (peak.stress, peak.time) == (2.0, 1.0)


def test_a_parabola_joins_samples_of_one_place_only():
    peak = Peak()
    for t, x, place in ((0.0, 1.0, 1), (1.0, 2.0, -1), (2.0, 1.5, 1)):
        peak = peak.after(Sample(t, x, place, 0.0))
    assert (peak.stress, peak.time) == (2.0, 1.0)


def test_mechanisms_without_stress_have_no_outputs_of_it():
    assert not [n for n in Simulation(prbm.load("PRBDM2R")).outputs() if "stress" in n]


@ENGINES
def test_stress_in_a_hit_of_a_compliant_stop_has_a_peak(engine):
    """The stress sampled during the contact has the peak, and both engines agree."""
    own = guide("beam", order=3)
    stop = replace(own.stops[0], law="compliant", stiffness=1e6, exponent=1.0, position=0.0)
    mechanism = replace(own, stops=(stop,))
    values = {**THROWN, "release.displacement": -1e-5, "release.velocity": 0.5}
    times = np.linspace(0.0, 1.5e-3, 301)
    names = ("left_flexure.stress", "stop.force", "left_flexure.peak_stress")
    stress, force, peak = engine(mechanism, values).sample(times, names).T
    assert force.max() > 10.0
    assert np.all(np.diff(peak) >= 0.0)
    assert peak[-1] == pytest.approx(stress.max(), rel=2e-3)
    expected = Simulation(mechanism, values).sample(times[::10], names).T
    for mine, theirs in zip((stress, force, peak), expected, strict=True):
        assert mine[::10] == pytest.approx(theirs, rel=1e-5, abs=1e-5 * theirs.max())


@ENGINES
@pytest.mark.parametrize(("model", "changes"), [("beam", {"order": 3}), ("2R", {})])
def test_stress_in_the_sections_has_the_outputs_as_its_ends_and_its_maximum(engine, model, changes):
    simulation = engine(guide(model, **changes), THROWN)
    simulation.advance(0.033)
    out, found = simulation.outputs(), simulation.section_stresses()
    positions = section_positions(simulation.system)
    assert found.keys() == positions.keys() == {"left_flexure", "right_flexure"}
    for name, (left, right) in found.items():
        assert left.shape == right.shape == positions[name].shape
        assert (left[0], left[-1]) == (out[f"{name}.stress_start"], out[f"{name}.stress_end"])
        assert max(np.abs(left).max(), np.abs(right).max()) == out[f"{name}.stress"]
        assert np.all(np.diff(positions[name]) > 0.0)
        assert positions[name][[0, -1]] == pytest.approx([0.0, 0.04])


def test_engines_agree_on_the_stress_in_the_sections():
    mechanism = prbm.load("NotchGuide")
    kinds = tuple(replace(k, stress=True) for k in mechanism.flexure_types)
    mechanism = replace(mechanism, flexure_types=kinds)
    one, other = Simulation(mechanism), KernelSimulation(mechanism)
    for simulation in (one, other):
        simulation.advance(1e-3)
    found = other.section_stresses()
    for name, expected in one.section_stresses().items():
        for x, y in zip(expected, found[name], strict=True):
            assert y == pytest.approx(x, rel=1e-5, abs=1e-5 * np.abs(x).max())


def test_stress_after_one_damped_impact_converges_with_the_order():
    """The steel guide with stretching beams, struck at 0.3 m/s at -10 mm."""
    peaks = []
    for order in (3, 5):
        mechanism = guide(order=order, axial=True)
        changes = {
            "stop.position": -0.01, "release.displacement": -0.0101, "release.velocity": 0.3,
            "gravity.x": 0.0,
        }  # fmt: skip
        simulation = KernelSimulation(mechanism, changes)
        simulation.advance(3e-3)
        out = simulation.outputs()
        assert out["stop.impact_count"] == 1
        peaks.append(out["left_flexure.peak_stress"])
    assert peaks[0] == pytest.approx(peaks[1], rel=0.025)
    assert peaks[1] > 1.2 * 349.96e6  # The static stress there.
