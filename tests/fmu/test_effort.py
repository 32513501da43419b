"""FMUs reject starts that would take minutes, and log tolerances that they replace."""

import pytest

import fmu_host
from native_host import ERROR, INTERFACES, OK, Instance

pytestmark = [pytest.mark.fmu, pytest.mark.native]
interfaces = pytest.mark.parametrize(("fmi", "kind"), INTERFACES)

TOO_THICK = (
    "flexure.thickness = 0.04 m is not less than the length of the flexure left_flexure, 0.04 m: "
    "check the units of both"
)
TOO_STIFF = "integration steps, more than 1000; check the units"
REPLACED = "tolerance = 0.001 is replaced by 1e-05"


@interfaces
def test_a_stiff_mechanism_is_rejected_at_initialization(native, fmi, kind):
    """In model exchange the importer chooses the steps; the start succeeds."""
    with Instance(native["PRBDM2R", fmi], kind) as instance:
        assert instance.set({"flexure.thickness": 0.03}) == OK
        instance.enter()
        status = instance.call("ExitInitializationMode")
        if instance.exchanges:
            assert status == OK
            return
        assert status == ERROR
        assert instance.logged(TOO_STIFF)
        assert instance.set({"flexure.thickness": 1e-4}) == OK
        instance.begin()
        instance.advance(1e-3)


def test_a_python_fmu_rejects_a_stiff_mechanism(fmus):
    with fmu_host.Instance(fmus["PRBDM2R"]) as instance:
        instance.set({"flexure.thickness": 0.03})
        instance.initialize()
        assert any(TOO_STIFF in message for message in instance.messages)
        assert instance.step(0.0, 1e-3) != OK


@interfaces
def test_a_flexure_as_thick_as_long_is_rejected_at_initialization(native, fmi, kind):
    with Instance(native["PRBDM2R", fmi], kind) as instance:
        assert instance.set({"flexure.thickness": 0.04}) == OK
        instance.enter()
        assert instance.call("ExitInitializationMode") == ERROR
        assert instance.logged(TOO_THICK)


def test_a_python_fmu_rejects_a_flexure_as_thick_as_long(fmus):
    with fmu_host.Instance(fmus["PRBDM2R"]) as instance:
        instance.set({"flexure.thickness": 0.04})
        instance.initialize()
        assert any(TOO_THICK in message for message in instance.messages)


@interfaces
@pytest.mark.parametrize("given", [{"tolerance": 1e-3}, {"values": {"solver.tolerance": 1e-3}}])
def test_a_replaced_tolerance_is_logged(native, fmi, kind, given):
    """In model exchange the importer's solver uses its own tolerance."""
    with Instance(native["PRBDM", fmi], kind).initialize(**given) as instance:
        assert instance.logged(REPLACED) == (not instance.exchanges)


@pytest.mark.parametrize("tolerance", [1e-3, 1e-5])
def test_a_python_fmu_logs_a_replaced_tolerance(fmus, tolerance):
    with fmu_host.Instance(fmus["PRBDM"]).initialize(tolerance=tolerance) as instance:
        assert instance.step(0.0, 1e-3) == OK
        assert any(REPLACED in message for message in instance.messages) == (tolerance > 1e-5)
