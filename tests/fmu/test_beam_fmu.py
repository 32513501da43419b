"""FMUs of a guide on beams: all versions and interfaces equal the engine."""

import math
from dataclasses import replace

import numpy as np
import pytest
from fmpy import read_model_description
from fmpy.fmi1 import FMICallException
from fmpy.validation import validate_fmu

from fmu_host import simulate_fmu
from native_host import Instance, Integrator
from prbm.hybrid.simulation import Simulation
from prbm.mechanics.assembly import assemble
from prbm.mechanics.statics import free_displacement
from support import mechanism, own_fmu

GUIDE = mechanism("GuideBeam")
END, STEP = 0.06, 2e-3
OUTPUTS = ("shuttle.x", "shuttle.vx", "stop.impact_count", "left_flexure.bend[1].angle")
AT_REST = (10.7205, 4.9066, 130.98, 210.30, 303.37, 328.30)
"""Rest position [mm] and frequencies [Hz] of the guide, docs/flexure-models.md."""

pytestmark = [pytest.mark.fmu, pytest.mark.native]


@pytest.fixture(scope="module")
def expected():
    """Return the rows of the engine, over the first impact."""
    simulation, rows = Simulation(GUIDE), []
    for k in range(round(END / STEP) + 1):
        simulation.advance(k * STEP)
        rows.append([simulation.outputs()[name] for name in OUTPUTS])
    return np.array(rows, float)


@pytest.fixture(params=["python", 2, 3])
def fmu(request, fmus, native):
    return fmus[GUIDE.name] if request.param == "python" else native[GUIDE.name, request.param]


@pytest.mark.slow
def test_fmus_of_beams_are_valid_and_simulate_like_the_engine(fmu, expected):
    """The angles of the coefficients, the motion and the count of impacts are compared."""
    assert not validate_fmu(str(fmu))
    found = simulate_fmu(
        str(fmu), fmi_type="CoSimulation", stop_time=END, output_interval=STEP,
        output=list(OUTPUTS),
    )  # fmt: skip
    for k, name in enumerate(OUTPUTS):
        values = np.asarray(found[name], float)
        size = np.abs(expected[:, k]).max()
        np.testing.assert_allclose(values, expected[:, k], rtol=0.0, atol=1e-6 * size)


@pytest.mark.slow
@pytest.mark.parametrize("version", [2, 3])
def test_model_exchange_of_beams_equals_the_engine(version, expected, native):
    found = simulate_fmu(
        str(native[GUIDE.name, version]), fmi_type="ModelExchange", stop_time=END,
        output_interval=1e-3, relative_tolerance=1e-8, output=list(OUTPUTS),
    )  # fmt: skip
    assert found["stop.impact_count"][-1] == expected[-1, 2]
    for k, name in enumerate(OUTPUTS[:2]):
        at_end = float(found[name][-1])
        assert at_end == pytest.approx(expected[-1, k], abs=1e-5 * np.abs(expected[:, k]).max())


@pytest.mark.slow
@pytest.mark.parametrize("version", [2, 3])
def test_an_fmu_linearised_at_rest_has_the_frequencies_of_the_page(version, native):
    """The directional derivatives of the state derivatives have the eigenvalues +-i omega."""
    rest = free_displacement(assemble(GUIDE, GUIDE.values()))
    values = {"release.displacement": rest, "stop.position": 0.05, "damping.beta": 0.0}
    with Instance(native[GUIDE.name, version], "me") as instance:
        instance.initialize(values=values)
        names = [u.variable.name for u in instance.description.derivatives]
        states = [u.variable.derivative.name for u in instance.description.derivatives]
        x = Integrator(instance).x()
        assert np.abs(instance.get(*names)).max() < 1e-6  # At rest nothing accelerates [rad/s2].
        unknown, known = ([instance.references[n] for n in part] for part in (names, states))
        columns = [
            instance.fmu.getDirectionalDerivative(unknown, known, list(one))
            for one in np.eye(len(x))
        ]
        found = [1e3 * instance.get("shuttle.x")[0]]
        omega = np.linalg.eigvals(np.array(columns).T).imag
        found += sorted(omega[omega > 1.0] / (2 * math.pi))
    digits = (4, 4, 2, 2, 2, 2)
    assert [round(x, d) for x, d in zip(found, digits, strict=True)] == list(AT_REST)


def notched():
    """Return the guide with fillets at the ends of thin flexures."""
    thesis = mechanism("PRBDM2R")
    kinds = (
        replace(
            kind, model="beam", coefficients={}, profile="notch", notch_radius=1e-3,
            waist_length=0.03,
        )
        for kind in thesis.flexure_types
    )  # fmt: skip
    return replace(thesis, name="NotchedGuide", flexure_types=tuple(kinds))


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["python", "fmi2", "fmi3"])
def test_dimensions_of_a_notch_are_parameters_of_fmus(kind, tmp_path):
    """They have units and bounds; the motion with other dimensions is that of the engine."""
    path, values = tmp_path / "NotchedGuide.fmu", {"flexure.notch_radius": 2e-3}
    values["flexure.waist_length"] = 0.025
    path.write_bytes(own_fmu(kind, notched()))
    assert not validate_fmu(str(path))
    variables = {v.name: v for v in read_model_description(str(path)).modelVariables}
    for name in values:
        assert (variables[name].unit, float(variables[name].min)) == ("m", 1e-9)
        assert variables[name].variability == "fixed"
    found = simulate_fmu(
        str(path), fmi_type="CoSimulation", stop_time=0.02, output_interval=STEP,
        start_values=values, output=["shuttle.x"],
    )  # fmt: skip
    simulation = Simulation(notched(), values)
    simulation.advance(0.02)
    exact = simulation.outputs()["shuttle.x"]
    assert float(found["shuttle.x"][-1]) == pytest.approx(exact, abs=1e-8)
    plain = Simulation(notched())
    plain.advance(0.02)
    assert abs(plain.outputs()["shuttle.x"] - exact) > 1e-5


@pytest.mark.slow
def test_an_fmu_rejects_a_notch_that_is_longer_than_its_flexure(tmp_path, capfd):
    path = tmp_path / "NotchedGuide.fmu"
    path.write_bytes(own_fmu("fmi3", notched()))
    with pytest.raises(FMICallException):
        simulate_fmu(str(path), stop_time=0.01, start_values={"flexure.waist_length": 0.05})
