"""FMUs of mechanisms with parts that no shipped mechanism has, such as walls on moving bodies."""

import io
import json
import zipfile

import numpy as np
import pytest
from fmpy import read_model_description
from fmpy.validation import validate_fmu

from fmu_host import simulate_fmu
from kernel_simulation import KernelSimulation
from many_parts import anvil, beams, elastic
from prbm.fmu.slave.resolved import mechanism_from, resolved
from prbm.hybrid.simulation import Simulation
from support import energy_balance, own_fmu

END, STEP = 0.04, 1e-3
BLOW = {"blow.y": -0.6}
OUTPUTS = (
    "face.gap", "hammer.y", "tip.x", "tip.vy", "face.impact_count", "side.gap_rate",
    "one.stress_start", "one.peak_stress", "three.stress_end", "three.stress",
)  # fmt: skip


@pytest.fixture(scope="module", params=["python", "fmi2", "fmi3"])
def fmu(request, tmp_path_factory):
    path = tmp_path_factory.mktemp("many") / "Anvil.fmu"
    path.write_bytes(own_fmu(request.param, anvil(), BLOW))
    return path


@pytest.fixture(scope="module")
def expected():
    simulation, rows = Simulation(anvil(), BLOW), []
    for k in range(round(END / STEP) + 1):
        simulation.advance(k * STEP)
        rows.append(simulation.outputs())
    return rows


@pytest.mark.slow
def test_the_fmu_is_valid_and_equals_the_engine(fmu, expected):
    assert validate_fmu(str(fmu)) == []
    result = simulate_fmu(
        str(fmu), fmi_type="CoSimulation", stop_time=END, output_interval=STEP, output=OUTPUTS
    )
    for name in OUTPUTS:
        wanted = np.array([row[name] for row in expected])
        assert np.abs(result[name] - wanted).max() <= 1e-5 * max(1e-3, np.abs(wanted).max()), name
    assert result["face.impact_count"][-1] > 2


@pytest.mark.slow
def test_strains_are_locals_and_states_and_probes_are_outputs(fmu):
    description = read_model_description(str(fmu))
    listed = {v.name: v for v in description.modelVariables}
    for name, unit in (("link[1].strain", "1"), ("link[1].strain_rate", "1/s")):
        assert listed[name].causality == "local"
        assert listed[name].unit == unit
    assert listed["link[1].strain_rate"].derivative is listed["link[1].strain"]
    for what, unit in (("x", "m"), ("y", "m"), ("vx", "m/s"), ("vy", "m/s")):
        assert listed[f"tip.{what}"].causality == "output"
        assert listed[f"tip.{what}"].unit == unit
    assert listed["tip.vx"].derivative is listed["tip.x"]
    states = {u.variable.derivative.name for u in description.derivatives}
    if states:
        assert any(name.endswith(".strain") for name in states)
        assert listed["der(link[3].strain_rate)"].unit == "1/s2"


@pytest.mark.slow
def test_descriptions_name_the_body_of_a_wall_and_the_point_of_a_force(fmu):
    listed = {v.name: v.description for v in read_model_description(str(fmu)).modelVariables}
    assert "the wall on the stage" in listed["face.displacement"]
    assert "the stage" not in listed["side.displacement"]
    assert listed["blow.x"] == "Force on a point of the hammer along x"
    with zipfile.ZipFile(io.BytesIO(fmu.read_bytes())) as archive:
        page = archive.read("documentation/index.html").decode()
    assert "do not stretch" not in page


@pytest.mark.slow
def test_model_exchange_equals_co_simulation(fmu, expected):
    description = read_model_description(str(fmu))
    if description.modelExchange is None:
        pytest.skip("co-simulation only")
    result = simulate_fmu(
        str(fmu), fmi_type="ModelExchange", stop_time=END, output_interval=STEP, output=OUTPUTS,
        relative_tolerance=1e-8,
    )  # fmt: skip
    assert result["face.impact_count"][-1] == expected[-1]["face.impact_count"]
    for name in ("hammer.y", "tip.x"):
        assert result[name][-1] == pytest.approx(expected[-1][name], abs=1e-6)


def test_velocities_are_the_rates_of_displacements_with_stretching_links():
    """Strain rates contribute to the velocities of bodies and of points."""
    simulation, h = Simulation(anvil(), {"solver.tolerance": 1e-12}), 1e-6
    simulation.advance(0.01)
    before = simulation.outputs()
    simulation.advance(0.01 + h)
    now = simulation.outputs()
    simulation.advance(0.01 + 2 * h)
    after = simulation.outputs()
    for name in ("stage", "hammer", "tip"):
        for axis in "xy":
            slope = (after[f"{name}.{axis}"] - before[f"{name}.{axis}"]) / (2 * h)
            assert now[f"{name}.v{axis}"] == pytest.approx(slope, rel=1e-4, abs=1e-6)


@pytest.mark.slow
def test_energy_is_conserved_with_impacts_friction_and_stretching_links(expected):
    """The energy balance is constant within 1e-5 of the work of the blow."""
    kept = [energy_balance(row) for row in expected]
    moved = max(abs(row["energy.work"]) for row in expected)
    assert np.ptp(kept) <= 1e-5 * moved


@pytest.mark.slow
def test_a_first_step_that_is_too_long_is_shortened():
    """With strong damping, even a first step far below the period gives infinite values."""
    simulation = Simulation(elastic(), {"damping.beta": 1e-4})
    simulation.advance(1e-7)
    assert 0.0 < simulation.controller.h < 1e-6
    kernel = KernelSimulation(elastic(), {"damping.beta": 1e-4})
    kernel.advance(1e-7)
    assert kernel.get("tip.x") == pytest.approx(simulation.outputs()["tip.x"])


@pytest.mark.slow
def test_a_contact_whose_force_touches_zero_does_not_chatter():
    """The contact force of a hammer dragged over its anvil reaches zero and grows again."""
    simulation = Simulation(anvil(), {"face.friction": 0.05, "rub.coefficient": 0.0})
    for k, change in ((4, {"blow.y": -0.4}), (20, {"blow.x": 0.5, "blow.moment": 1e-3})):
        simulation.advance(k * 2.5e-3)
        simulation.set(change)
    simulation.advance(0.08)
    assert simulation.outputs()["face.impact_count"] > 0


@pytest.mark.parametrize("guide", [anvil(), elastic(), beams()], ids=["anvil", "links", "beams"])
def test_a_mechanism_is_equal_after_a_round_trip_through_json(guide):
    data = json.loads(json.dumps(resolved(guide, ())["mechanism"]))
    assert mechanism_from(data) == guide
