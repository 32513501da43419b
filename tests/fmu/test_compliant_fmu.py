"""FMUs of a mechanism with a compliant stop: Python FMUs equal the engine."""

from dataclasses import replace
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy import read_model_description
from fmpy.validation import validate_fmu

from fmu_host import simulate_fmu
from point_mass import point_mass
from prbm.fmu import mathml
from prbm.fmu.documentation import page
from prbm.fmu.start import interface
from prbm.fmu.unpack import unpacked
from prbm.hybrid.simulation import Simulation
from prbm.mechanism.parts import LAWS
from prbm.runs.experiment import Experiment
from support import mechanism, own_fmu

END, STEP = 2e-3, 5e-5
OUTPUTS = (
    "mass.x", "stop.force", "stop.contact", "stop.impact_count", "stop.peak_force",
    "stop.indentation", "stop.contact_duration", "stop.impulse_sum", "energy.elastic",
)  # fmt: skip


def mass():
    return point_mass(stiffness=1e5, restitution=0.5)


@pytest.fixture(scope="module", params=["python", "fmi2", "fmi3"])
def path(request, tmp_path_factory):
    path = tmp_path_factory.mktemp("compliant") / "PointMass.fmu"
    path.write_bytes(own_fmu(request.param, mass()))
    return str(path)


@pytest.mark.fmu
@pytest.mark.native
@pytest.mark.parametrize("events", [False, True])
def test_fmus_with_a_compliant_stop_simulate_like_the_engine(path, events):
    """With event mode (FMI 3.0), steps end at first touch and at separation."""
    description = read_model_description(path)
    if events and description.fmiVersion != "3.0":
        pytest.skip("FMI 3.0 only")
    python = description.coSimulation.needsExecutionTool
    assert (description.modelExchange is None) == bool(python)
    found = simulate_fmu(
        path, stop_time=END, output_interval=STEP, output=list(OUTPUTS),
        use_event_mode=events, early_return_allowed=events,
    )  # fmt: skip
    steps = np.asarray(found["time"]) / STEP
    rows = {round(x): k for k, x in enumerate(steps) if abs(x - round(x)) < 1e-6}
    sim = Simulation(mass())
    for k in range(round(END / STEP) + 1):
        sim.advance(k * STEP)
        out = sim.outputs()
        row = [float(found[name][rows[k]]) for name in OUTPUTS]
        np.testing.assert_allclose(row, [out[name] for name in OUTPUTS], rtol=1e-6, atol=1e-9)
    assert out["stop.impact_count"] == 1
    assert out["stop.contact_duration"] > 0.0
    if events:
        first = out["stop.impact_time"]
        for t in (first, first + out["stop.contact_duration"]):
            assert np.abs(np.asarray(found["time"]) - t).min() < 1e-12


@pytest.mark.fmu
@pytest.mark.native
def test_parameters_and_outputs_of_a_compliant_stop_have_their_units(path):
    description = read_model_description(path)
    assert not validate_fmu(path)
    found = {v.name: v for v in description.modelVariables}
    units = {name: found[f"stop.{name}"].unit for name in (
        "stiffness", "restitution", "force", "peak_force", "indentation", "contact_duration"
    )}  # fmt: skip
    assert list(units.values()) == ["N/m", "1", "N", "N", "m", "s"]
    assert found["stop.stiffness"].variability == "fixed"
    assert found["stop.restitution"].min == "0.01"
    assert found["stop.contact_duration"].variability == "discrete"


@pytest.mark.fmu
@pytest.mark.native
@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("stiffness", 0.0, "stop.stiffness = 0 N/m must be at least 1e-06 N/m"),
        ("exponent", 0.5, "stop.exponent = 0.5 must be at least 1"),
        ("restitution", 0.005, "stop.restitution = 0.005 must be at least 0.01"),
        ("restitution", 1.5, "stop.restitution = 1.5 must be at most 1"),
    ],
)
def test_invalid_parameters_of_a_compliant_stop_are_rejected_in_an_fmu(name, value, words, path):
    """Native FMUs fail; FMPy continues with Python FMUs, whose outputs are not numbers."""
    logged = []
    try:
        found = simulate_fmu(
            path, start_values={f"stop.{name}": value}, stop_time=STEP, debug_logging=True,
            logger=lambda *given: logged.append(str(given[-1])), output=["mass.x"],
        )  # fmt: skip
        assert np.isnan(found["mass.x"]).all()
    except fmpy.fmi1.FMICallException:
        pass
    assert any(words in text for text in logged), logged


@pytest.mark.fmu
@pytest.mark.native
def test_a_state_saved_in_contact_restores_in_an_fmu(path):
    description = read_model_description(path)
    if description.fmiVersion == "3.0":
        pytest.skip("the functions of FMI 2.0")
    with unpacked(Path(path)) as folder:
        fmu = fmpy.instantiate_fmu(str(folder), description)
        fmu.setupExperiment(startTime=0.0)
        fmu.enterInitializationMode()
        fmu.exitInitializationMode()
        references = [v.valueReference for v in description.modelVariables if v.name in (
            "mass.x", "stop.force", "stop.peak_force", "stop.impulse_sum"
        )]  # fmt: skip
        fmu.doStep(0.0, 1.1e-3)
        state, ends = fmu.getFMUState(), []
        for _ in range(2):
            fmu.doStep(1.1e-3, 1e-3)
            ends.append(fmu.getReal(references))
            fmu.setFMUState(state)
        assert ends[0] == ends[1]
        fmu.terminate()
        fmu.freeInstance()


@pytest.mark.fmu
@pytest.mark.native
@pytest.mark.parametrize("friction", [0.0, 0.3])
@pytest.mark.parametrize("version", [2, 3])
def test_model_exchange_with_a_compliant_stop_is_the_motion_of_the_engine(
    version, friction, tmp_path
):
    own = point_mass(stiffness=1e5, restitution=0.5, friction=friction, direction=25.0)
    path = tmp_path / "PointMass.fmu"
    path.write_bytes(own_fmu(f"fmi{version}", own))
    found = simulate_fmu(
        str(path), fmi_type="ModelExchange", solver="CVode", stop_time=END, output_interval=STEP,
        relative_tolerance=1e-8, output=list(OUTPUTS), record_events=False,
    )  # fmt: skip
    sim = Simulation(own)
    for row in found:
        sim.advance(float(row["time"]))
        expected = sim.outputs()
        for name in OUTPUTS:
            rough = name in ("stop.peak_force", "stop.indentation")
            size = max(abs(float(expected[name])), 1e-2 * float(abs(found[name]).max()), 1e-9)
            assert abs(float(row[name]) - expected[name]) < (2e-2 if rough else 1e-4) * size, (
                row,
                name,
            )
    assert expected["stop.impact_count"] == 1


@pytest.mark.parametrize("laws", [("rigid", "rigid"), ("compliant", "compliant"), LAWS])
def test_the_documentation_states_the_laws_of_the_stops(laws):
    model = mechanism("Bistable")
    stops = [
        replace(stop, law=law, stiffness=1e5 if law == "compliant" else None)
        for stop, law in zip(model.stops, laws, strict=True)
    ]
    chosen = replace(model, stops=tuple(stops))
    text = page(chosen, interface(chosen, {}), Experiment(1.0))
    for statement in ("At an impact on a rigid stop,", mathml.row("P >= 0"), "A rigid impact has"):
        assert (statement in text) == ("rigid" in laws)
    for statement in (
        mathml.row("F = max(0, k d^n (1 + alpha dot(d)/v_0))"),
        mathml.row("(1 + alpha)/(1 - epsilon alpha) = exp((1 + epsilon) alpha)"),
        mathml.row("+ G^T F").removeprefix("<mrow>"),
        "(compliant stops)",
    ):
        assert (statement in text) == ("compliant" in laws)
