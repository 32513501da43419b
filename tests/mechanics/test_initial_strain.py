"""Initial strains of flexures: residual stress, buckling, and the frequency of stretched beams."""

import math
from dataclasses import replace

import numpy as np
import pytest

import prbm
from fmu_host import simulate_fmu
from kernel_simulation import KernelSimulation
from prbm.base.errors import MechanismError
from prbm.files.mechanism_file import read_mechanism
from prbm.hybrid.simulation import Simulation
from prbm.mechanics.assembly import assemble
from prbm.mechanics.modal import modes
from prbm.mechanics.statics import equilibrium
from support import CASES, own_fmu

L, H, E = 0.1, 1e-3, 200e9

BRIDGE = """
name = "Bridge"
title = "A small body between two leaves in line"
[ground]
left = [-0.1, 0]
right = [0.1, 0]
[[bodies]]
name = "body"
mass = "1 kg"
inertia = "1e-3 kg.m2"
centre = [0, 0]
points = {{ c = [0, 0] }}
[[flexure_types]]
name = "leaf"
model = "{model}"
{order}
axial = true
initial_strain = {strain}
thickness = "1 mm"
width = "10 mm"
youngs_modulus = "200 GPa"
density = 100
stress = true
[[flexures]]
name = "left"
type = "leaf"
start = "ground.left"
end = "body.c"
[[flexures]]
name = "right"
type = "leaf"
start = "body.c"
end = "ground.right"
[release]
body = "body"
direction = 90
displacement = 0.0
"""


def bridge(tmp_path, strain, model="beam", order="order = 5"):
    path = tmp_path / "bridge.toml"
    path.write_text(BRIDGE.format(model=model, order=order, strain=strain), encoding="utf-8")
    return prbm.load(str(path))


@pytest.mark.parametrize(
    ("model", "order"), [("beam", "order = 3"), ("1R", ""), ("2R", ""), ("nR", "n = 4")]
)
def test_the_stress_of_a_flexure_that_is_kept_straight_is_hookes(model, order, tmp_path):
    """The ends stay where they are drawn, so that the stress is -E times the strain."""
    shape = prbm.equilibrium(bridge(tmp_path, -2e-5, model, order))
    for stress in shape.stress.values():
        assert stress.largest == pytest.approx(2e-5 * E, rel=1e-9)


def lowest(guide, strain):
    """Return the smallest lateral stiffness of the straight shape, without the mass [Hz^2]."""
    found = prbm.equilibrium(guide, {"leaf.initial_strain": strain}).modes.frequency[0]
    return found * abs(found)


def test_two_leaves_in_line_buckle_at_the_strain_of_euler(tmp_path):
    """Between two clamps at the distance 2 L: EA strain = 4 pi^2 EI / (2 L)^2."""
    guide = bridge(tmp_path, 0.0, order="order = 7")
    critical = math.pi**2 * H**2 / (12 * L**2)
    low, high = 0.9 * critical, 1.1 * critical
    assert lowest(guide, low) > 0.0 > lowest(guide, high)
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if lowest(guide, middle) > 0.0 else (low, middle)
    assert low == pytest.approx(critical, rel=1e-6)


@pytest.mark.parametrize("strain", [-1e-5, -1e-3, -1e-2])
def test_a_stretched_beam_has_the_frequency_of_the_string_beam(strain, tmp_path):
    """Two massless leaves with the tension N: K = 2 N / (L - (2/k) tanh(k L / 2)), k^2 = N/EI."""
    found = prbm.equilibrium(bridge(tmp_path, strain, order="order = 9"))
    EI, N = E * 0.01 * H**3 / 12, -E * 0.01 * H * strain
    k = math.sqrt(N / EI)
    K = 2 * N / (L - 2 / k * math.tanh(k * L / 2))
    expected = math.sqrt(K) / (2 * math.pi)  # The mass is 1 kg.
    assert np.abs(found.modes.frequency - expected).min() < 2e-4 * expected


def test_a_free_leaf_takes_its_length_without_stress(tmp_path):
    """A guide with two equal leaves moves by the extension of the leaves, exp(strain) - 1."""
    guide = read_mechanism(CASES / "comsol.toml")
    kinds = tuple(replace(k, axial=True, order=5, initial_strain=1e-3) for k in guide.flexure_types)
    upper = tuple(f for f in guide.flexures if f.name.startswith("low"))
    free = replace(guide, flexure_types=kinds, flexures=upper)
    shape = prbm.equilibrium(free)
    assert shape.positions["plate"].y == pytest.approx(200e-6 * math.expm1(1e-3), rel=1e-9)
    assert max(abs(one.largest) for one in shape.stress.values()) < 1e-3  # Pa


def test_the_resonator_under_residual_stress_has_its_published_frequency():
    """COMSOL's thin-film resonator: 32.33 kHz with 50 MPa; boundary value problem 32333 Hz."""
    guide = read_mechanism(CASES / "comsol.toml")
    stress = -50e6 / 155e9
    kinds = tuple(
        replace(k, axial=True, order=7, initial_strain=stress) for k in guide.flexure_types
    )
    found = prbm.equilibrium(replace(guide, flexure_types=kinds))
    assert found.modes.frequency[0] == pytest.approx(32333.0, rel=3e-4)
    for one in found.stress.values():
        assert one.largest == pytest.approx(50e6, rel=1e-6)


@pytest.mark.parametrize("model", ["beam", "2R"])
def test_both_engines_start_and_move_with_an_initial_strain(model, tmp_path):
    guide = bridge(tmp_path, -1e-4, model, "order = 3" if model == "beam" else "")
    found = []
    for engine in (Simulation, KernelSimulation):
        sim = engine(guide, {"release.displacement": 1e-3})
        sim.advance(5e-4)
        found.append(dict(sim.outputs()))
        assert found[-1]["energy.elastic"] > 0.0
        saved = sim.snapshot() if engine is Simulation else None
        if saved:
            sim.restore(saved)
    for name, value in found[0].items():
        if isinstance(value, float) and not name.startswith(("base.moment", "left.peak", "right.")):
            assert found[1][name] == pytest.approx(value, rel=1e-4, abs=1e-7), name


@pytest.mark.slow
def test_the_energy_is_conserved_from_the_strained_start(tmp_path):
    sim = Simulation(bridge(tmp_path, -1e-4), {"release.displacement": 1e-3, "damping.beta": 0.0})
    start = sim.outputs()["energy.elastic"]
    sim.advance(5e-3)
    out = sim.outputs()
    assert out["energy.kinetic"] > 1e-4 * start
    assert out["energy.kinetic"] + out["energy.elastic"] == pytest.approx(start, rel=1e-6)


def test_an_initial_strain_of_flexures_that_cannot_stretch_is_rejected(tmp_path):
    path = tmp_path / "rigid.toml"
    text = BRIDGE.format(model="beam", order="order = 5", strain=1e-4)
    path.write_text(text.replace("axial = true\n", ""), encoding="utf-8")
    with pytest.raises(MechanismError, match=r"leaf\.initial_strain: the flexures cannot stretch"):
        prbm.load(str(path))


def test_modes_at_the_strained_equilibrium_are_those_of_its_static_shape(tmp_path):
    """The multipliers of Gauss' principle and those of the equilibrium agree there."""
    from prbm.mechanics.modal import modes_at

    guide = bridge(tmp_path, -1e-4)
    system = assemble(guide, guide.values())
    shape = equilibrium(system)
    expected = modes(system, shape).frequency
    assert modes_at(system, shape.q).frequency == pytest.approx(expected, rel=1e-6)


@pytest.mark.fmu
@pytest.mark.parametrize("kind", ["python", "fmi2", "fmi3"])
def test_the_initial_strain_is_a_parameter_of_fmus(kind, tmp_path):
    guide = bridge(tmp_path, 0.0, order="order = 3")
    changes = {"leaf.initial_strain": -1e-4}
    path = tmp_path / "bridge.fmu"
    path.write_bytes(own_fmu(kind, guide))
    found = simulate_fmu(
        str(path), stop_time=1e-3, output_interval=1e-3, start_values=changes,
        output=["mode.frequency"], fmi_type="CoSimulation",
    )  # fmt: skip
    expected = prbm.equilibrium(guide, changes).modes.frequency[0]
    assert found["mode.frequency"][-1] == pytest.approx(expected, rel=1e-9)
    assert expected > 1.1 * prbm.equilibrium(guide).modes.frequency[0]
