"""FMUs of a mechanism with what the shipped ones do not have, in every flavour."""

import io
import json
import zipfile

import numpy as np
import pytest
from fmpy import read_model_description, simulate_fmu
from fmpy.validation import validate_fmu

from kernel_simulation import KernelSimulation
from many_parts import anvil, elastic
from prbm.fmu import native_fmu, python_fmu
from prbm.fmu.native_description import terminals
from prbm.fmu.slave.resolved import mechanism_from, resolved
from prbm.hybrid.simulation import Simulation
from support import energy_balance

END, STEP = 0.04, 1e-3
BLOW = {"blow.y": -0.6}
OUTPUTS = ("face.gap", "hammer.y", "tip.x", "tip.vy", "face.impact_count", "side.gap_rate")


@pytest.fixture(scope="module", params=["python", "fmi2", "fmi3"])
def fmu(request, tmp_path_factory):
    path = tmp_path_factory.mktemp("many") / "Anvil.fmu"
    if request.param == "python":
        path.write_bytes(python_fmu.build(anvil(), BLOW))
    else:
        path.write_bytes(native_fmu.build(anvil(), BLOW, int(request.param[-1])))
    return path


@pytest.fixture(scope="module")
def expected():
    simulation, rows = Simulation(anvil(), BLOW), []
    for k in range(round(END / STEP) + 1):
        simulation.advance(k * STEP)
        rows.append(simulation.outputs())
    return rows


def test_it_is_valid_and_moves_as_the_engine(fmu, expected):
    assert validate_fmu(str(fmu)) == []
    result = simulate_fmu(
        str(fmu), fmi_type="CoSimulation", stop_time=END, output_interval=STEP, output=OUTPUTS
    )
    for name in OUTPUTS:
        wanted = np.array([row[name] for row in expected])
        assert np.abs(result[name] - wanted).max() <= 1e-5 * max(1e-3, np.abs(wanted).max()), name
    assert result["face.impact_count"][-1] > 2


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


def test_descriptions_tell_what_a_wall_is_fixed_to_and_where_a_force_acts(fmu):
    listed = {v.name: v.description for v in read_model_description(str(fmu)).modelVariables}
    assert "the wall on the stage" in listed["face.displacement"]
    assert "the stage" not in listed["side.displacement"]
    assert listed["blow.x"] == "Force on a point of the hammer along x"
    assert b"Contact of the hammer with a wall on the stage" in terminals(anvil())
    with zipfile.ZipFile(io.BytesIO(fmu.read_bytes())) as archive:
        page = archive.read("documentation/index.html").decode()
    assert "do not stretch" not in page


def test_model_exchange_goes_as_co_simulation(fmu, expected):
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


def test_velocities_are_the_rates_of_displacements_where_links_stretch():
    """Of bodies and of points, which the strain rates move, too."""
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


def test_energy_is_kept_by_bodies_that_hit_rub_and_stretch(expected):
    """What the blow puts in is moved, bent, stretched, lifted or lost; to the tolerance's 1e-6."""
    kept = [energy_balance(row) for row in expected]
    moved = max(abs(row["energy.work"]) for row in expected)
    assert np.ptp(kept) <= 1e-5 * moved


def test_a_first_step_that_is_far_too_long_is_shortened():
    """With much damping, a step that is short beside the period leads to nothing but infinities."""
    simulation = Simulation(elastic(), {"damping.beta": 1e-4})
    simulation.advance(1e-7)
    assert 0.0 < simulation.controller.h < 1e-6
    kernel = KernelSimulation(elastic(), {"damping.beta": 1e-4})
    kernel.advance(1e-7)
    assert kernel.get("tip.x") == pytest.approx(simulation.outputs()["tip.x"])


def test_what_lets_go_while_it_is_pressed_again_does_not_chatter():
    """The force of a hammer that is dragged over its anvil touches zero and comes back."""
    simulation = Simulation(anvil(), {"face.friction": 0.05, "rub.coefficient": 0.0})
    for k, change in ((4, {"blow.y": -0.4}), (20, {"blow.x": 0.5, "blow.moment": 1e-3})):
        simulation.advance(k * 2.5e-3)
        simulation.set(change)
    simulation.advance(0.08)
    assert simulation.outputs()["face.impact_count"] > 0


@pytest.mark.parametrize("guide", [anvil(), elastic()], ids=lambda guide: guide.name)
def test_a_mechanism_survives_its_way_through_json(guide):
    data = json.loads(json.dumps(resolved(guide, ())["mechanism"]))
    assert mechanism_from(data) == guide
