"""Calls that other importers make in model exchange, though the standard does not foresee them."""

import contextlib
from ctypes import c_double

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException

from native_host import DISCARD, ERROR, OK, Instance, Integrator, status
from support import each_shipped

pytestmark = [pytest.mark.fmu, pytest.mark.native]
versions = pytest.mark.parametrize("fmi", [2, 3])


def started(path, kind: str = "me") -> Instance:
    """Return an instance in its first Event Mode."""
    instance = Instance(path, kind).enter()
    instance.fmu.exitInitializationMode()
    return instance


# -- Event Mode --


@pytest.mark.parametrize(("fmi", "kind"), [(2, "me"), (3, "me"), (3, "events")])
def test_event_mode_may_be_left_without_an_update_if_nothing_is_pending(native, fmi, kind):
    """The motion is that of an importer that updates."""
    with Instance(native["PRBDM", fmi], kind).initialize() as usual:
        usual.advance(0.05)
        expected = usual.bytes()
    with started(native["PRBDM", fmi], kind) as instance:
        leave = "enterStepMode" if kind == "events" else "enterContinuousTimeMode"
        getattr(instance.fmu, leave)()
        instance.fmu.enterEventMode()
        getattr(instance.fmu, leave)()
        instance.advance(0.05)
        assert instance.bytes() == expected


PENDING = {
    "an impact": ({"stop.displacement": -0.02}, {}),
    "an impulse": ({"force.impulse.x": 1e-3}, {}),
    "a jump of the wall's velocity": ({"stop.velocity": 0.1}, {"release.displacement": 0.0}),
    "a pulling force": ({"force.x": -5.0}, {"release.displacement": 0.0}),
}


@pytest.mark.parametrize("case", PENDING)
@versions
def test_a_pending_event_requires_an_update_before_event_mode_is_left(native, case, fmi):
    changes, starts = PENDING[case]
    with Instance(native["PRBDM", fmi], "me").initialize(values=starts) as instance:
        instance.advance(0.01)
        instance.fmu.enterEventMode()
        assert instance.set(changes) == OK
        assert status(instance.fmu.enterContinuousTimeMode) == ERROR
        assert "the event is not finished" in instance.messages[-1]
        instance.update()


@versions
def test_a_rejected_value_cannot_be_carried_out_of_event_mode_without_an_update(native, fmi):
    with Instance(native["PRBDM", fmi], "me").initialize() as instance:
        instance.fmu.enterEventMode()
        assert instance.set({"stop.restitution": 2.0}) == ERROR
        assert status(instance.fmu.enterContinuousTimeMode) == ERROR
        assert "stop.restitution was set to a rejected value" in instance.messages[-1]


@versions
def test_the_time_may_be_set_in_event_mode(native, fmi):
    with Instance(native["PRBDM", fmi], "me").initialize() as instance:
        instance.advance(0.01)
        expected = instance.bytes()
        instance.fmu.enterEventMode()
        instance.fmu.setTime(instance.time)
        instance.update()
        assert instance.bytes() == expected
        instance.fmu.enterEventMode()
        assert status(instance.fmu.setTime, float("nan")) == ERROR


# -- states far from the motion --

FAR = {"angle": 1e7, "omega": 1e155, "both": 1e300}


def far_state(instance: Instance, case: str) -> np.ndarray:
    """Return the states with one, or all, far from the motion."""
    names = [u.variable.derivative.name for u in instance.description.derivatives]
    x = Integrator(instance).x()
    for k, name in enumerate(names):
        if case == "both" or name.endswith(f".{case}"):
            x[k] = FAR[case]
            if case != "both":
                break
    return x


def statuses(instance: Instance) -> dict[str, int]:
    """Call every function that evaluates the equations; return its status."""
    integrator, fmu = Integrator(instance), instance.fmu
    nx, nz = integrator.states, integrator.indicators
    outputs = [v.name for v in instance.description.modelVariables if v.causality == "output"
               and v.type in ("Real", "Float64")]  # fmt: skip
    unknown = [u.variable.valueReference for u in instance.description.derivatives]
    known = [u.variable.derivative.valueReference for u in instance.description.derivatives]
    results: dict[str, int] = {
        "derivatives": status(integrator.derivatives, (c_double * nx)(), nx),
        "indicators": status(fmu.getEventIndicators, (c_double * nz)(), nz),
        "directional derivatives": status(fmu.getDirectionalDerivative, unknown, known, [1.0] * nx),
        "step": status(fmu.completedIntegratorStep),
    }
    for name in outputs:
        results[name] = status(instance.get, name)
        if results[name] == OK:
            assert np.isfinite(instance.get(name)).all(), name
            del results[name]
    return results


def evaluated(instance: Instance) -> list[np.ndarray]:
    """Return the results of all evaluations whose status is OK."""
    integrator, fmu = Integrator(instance), instance.fmu
    nx, nz = integrator.states, integrator.indicators
    unknown = [u.variable.valueReference for u in instance.description.derivatives]
    known = [u.variable.derivative.valueReference for u in instance.description.derivatives]
    found, dx, z = [], np.zeros(nx), np.zeros(nz)
    if status(integrator.derivatives, np.ctypeslib.as_ctypes(dx), nx) == OK:
        found.append(dx)
    if status(fmu.getEventIndicators, np.ctypeslib.as_ctypes(z), nz) == OK:
        found.append(z)
    with contextlib.suppress(FMICallException):
        found.append(np.array(fmu.getDirectionalDerivative(unknown, known, [1.0] * nx)))
    return found


@pytest.mark.parametrize("model", ["PRBDM", "PRBDM2R"])
@pytest.mark.parametrize("kind", ["angle", "omega"])
def test_the_status_ok_means_finite_numbers_at_any_magnitude(native, model, kind):
    with Instance(native[model, 3], "me").initialize() as instance:
        names = [u.variable.derivative.name for u in instance.description.derivatives]
        x, results = Integrator(instance).x(), 0
        place = next(k for k, name in enumerate(names) if name.endswith(f".{kind}"))
        for exponent in range(0, 309, 3):
            x[place] = 10.0**exponent
            Integrator(instance).put(0.0, x)
            for values in evaluated(instance):
                assert np.isfinite(values).all(), exponent
                results += 1
        assert results > 0


@pytest.mark.parametrize("case", FAR)
@each_shipped
@versions
def test_states_without_finite_derivatives_are_discarded(native, model, case, fmi):
    """Solvers then try a shorter step; with the former states all is as before."""
    with Instance(native[model, fmi], "me").initialize() as instance:
        integrator = Integrator(instance)
        x, z, before = integrator.x(), integrator.z(), instance.bytes()
        instance.fmu.setContinuousStates((c_double * len(x))(*far_state(instance, case)), len(x))
        for name, found in statuses(instance).items():
            assert found in (DISCARD, ERROR) if name == "step" else found == DISCARD, name
        reasons = ("far from every motion", "not determine")
        assert any(reason in instance.messages[-1] for reason in reasons)
        instance.fmu.setContinuousStates((c_double * len(x))(*x), len(x))
        assert [*integrator.z()] == [*z]
        assert instance.bytes() == before
