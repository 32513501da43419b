"""Model and partner in one solver, compared with the scalar equation of the guide."""

import math

import numpy as np
import pytest
from fmpy.fmi2 import FMU2Model

from coupled import guide, integrator
from prbm.references.scalar_guide import Monolith, ScalarGuide
from prbm.systems.components import CouplingError
from prbm.systems.model_exchange import simulate
from support import ScalarGuide as Quadrature
from support import mechanism

START = {"gravity.x": 0.0, "release.displacement": -5e-3, "stop.restitution": 0.8}
GAIN, DAMPING, LAG, END = 20.0, 0.5, 5e-3, 0.2  # N/m, N s/m, s, s
SEEN = ("shuttle.x", "shuttle.vx")
RECORD = ("shuttle.x", "shuttle.vx", "stop.impact_count", "stop.impact_time", "stop.contact")


def rate(x, v, f):
    """Return the derivative of the partner's force."""
    return [(-GAIN * x - DAMPING * v - f) / LAG]


def partner(t, outputs, z):
    return {"force.x": float(z[0])}, rate(*(outputs[name] for name in SEEN), z[0])


def monolith(end, start=START, wall=1e-30, **options):
    """Return the scalar guide with the same partner."""
    body = ScalarGuide.of(mechanism("PRBDM").values(start), [wall])
    one = Monolith(
        body, lambda t, x, v, z: z[0], lambda t, x, v, z: rate(x, v, z[0]), [0.0],
        start["release.displacement"], **options,
    )  # fmt: skip
    one.advance(end)
    return one


@pytest.mark.native
@pytest.mark.fmu
@pytest.mark.parametrize("fmi", [2, 3])
def test_model_and_partner_move_as_the_scalar_equation(fmi):
    """There are two impacts.

    The tolerances are the error of the reference, RK4 with steps of 0.05 ms.
    """
    found = simulate(guide(fmi), partner, [0.0], END, 1e-3, START, SEEN, RECORD)
    one = monolith(END, substep=5e-5)
    last = found[-1]
    assert last["stop.impact_count"] == len(one.impacts) == 2
    assert last["stop.impact_time"] == pytest.approx(one.impacts[-1][0], abs=1e-9)
    assert last["shuttle.x"] == pytest.approx(one.x, abs=1e-9)
    assert last["shuttle.vx"] == pytest.approx(one.v, abs=1e-7)
    assert last["z[0]"] == pytest.approx(one.z[0], abs=1e-8)


@pytest.mark.native
@pytest.mark.fmu
def test_an_impact_has_two_rows_with_newtons_law_between_them():
    found = simulate(guide(3), partner, [0.0], 0.1, 1e-2, START, SEEN, RECORD)
    twice = np.flatnonzero(np.diff(found["time"]) == 0.0)
    assert len(twice) == 1
    before, after = found[twice[0]], found[twice[0] + 1]
    assert after["shuttle.vx"] == pytest.approx(-0.8 * before["shuttle.vx"], rel=1e-9)
    assert after["z[0]"] == before["z[0]"]
    assert after["time"] == pytest.approx(after["stop.impact_time"], abs=1e-12)
    rows = np.setdiff1d(np.arange(len(found)), [twice[0], twice[0] + 1])
    np.testing.assert_allclose(found["time"][rows], 1e-2 * np.arange(11), atol=1e-15)


@pytest.mark.slow
@pytest.mark.native
@pytest.mark.fmu
def test_one_solver_comes_to_rest_at_the_stop():
    """Under a constant force the FMU bounces, then rests; rest is a discrete state of the FMU."""
    start = START | {"stop.restitution": 0.5}
    found = simulate(
        guide(3), lambda t, outputs, z: ({"force.x": 0.3}, []), [], 0.3, 1e-3, start,
        record=RECORD,
    )  # fmt: skip
    body = ScalarGuide.of(mechanism("PRBDM").values(start), [1e-30])
    one = Monolith(body, lambda t, x, v, z: 0.3, x=start["release.displacement"], substep=5e-5)
    one.advance(0.3)
    assert one.held is not None
    resting = found["time"][found["stop.contact"] != 0][0]
    assert resting == pytest.approx(one.rest_time, abs=1e-6)


@pytest.mark.native
@pytest.mark.fmu
@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"record": ["nothing"]}, "has no variable 'nothing'"),
        ({"values": {"flexure.length": -1.0}}, "returned the status 3: "),
    ],
)
def test_error_messages_name_variable_and_status(changes, sentence):
    options = {"stop_time": 0.01, "step": 1e-3} | changes
    with pytest.raises(CouplingError, match=sentence):
        simulate(guide(2), lambda t, outputs, z: ({}, []), [], **options)


def test_errors_contain_the_message_of_an_fmu_of_fmi_3():
    with pytest.raises(CouplingError, match=r"flexure\.length = -1 m must be at least"):
        simulate(guide(3), lambda t, outputs, z: ({}, []), [], 0.01, 1e-3, {"flexure.length": -1.0})


@pytest.mark.parametrize(
    ("function", "answer", "sentence", "rows"),
    [
        ("completedIntegratorStep", (False, True), "terminated the simulation at 0.0", 2),
        ("newDiscreteStates", (False, True, False, False, False, 0.0), "terminated .* at 0 s", 0),
        ("newDiscreteStates", (False, False, False, False, True, 0.5), "event at 0.5 s", 0),
    ],
)
def test_the_end_by_the_fmu_is_the_reason(function, answer, sentence, rows, monkeypatch):
    """No partner at hand ends it there, so that the answer of the guide is exchanged."""
    original = getattr(FMU2Model, function)

    def replaced(own):
        given = original(own)
        started = function != "completedIntegratorStep" or own.steps > 30
        own.steps = getattr(own, "steps", 0) + 1
        return answer if started else given

    monkeypatch.setattr(FMU2Model, "steps", 0, raising=False)
    monkeypatch.setattr(FMU2Model, function, replaced)
    with pytest.raises(CouplingError, match=sentence) as caught:
        simulate(guide(2), lambda t, outputs, z: ({}, []), [], 0.1, 1e-3)
    assert rows == 0 or len(caught.value.columns) >= rows


def test_an_fmu_without_model_exchange_is_rejected():
    with pytest.raises(CouplingError, match="has no model exchange of FMI"):
        simulate(integrator(), lambda t, outputs, z: ({}, []), [], 0.01, 1e-3)


def test_scalar_guide_bounces_at_the_times_found_by_quadrature():
    """Times of impacts of the steel guide under gravity agree to 1e-8, speeds to 1e-7."""
    values = mechanism("PRBDM").values({"damping.beta": 0.0, "release.displacement": -0.01})
    body = ScalarGuide.of(values, [1e-30])
    one = Monolith(body, lambda t, x, v, z: 9.81 * body.mass, x=-0.01, substep=2e-5)
    one.advance(0.15)
    times, speeds = Quadrature.of(values).bounces(-0.01, 0.6, 4)
    found = np.array(one.impacts[:4])
    np.testing.assert_allclose(found[:, 0], times, rtol=1e-8)
    np.testing.assert_allclose(found[:, 1], speeds, rtol=1e-7)


def test_scalar_guide_converges_with_order_four_across_an_impact():
    """The order would be one if the impact were not located."""
    steps = [8e-4, 4e-4, 2e-4, 1e-4]
    exact = monolith(0.06, substep=2e-5)
    errors = [abs(monolith(0.06, substep=h).x - exact.x) for h in steps]
    order = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert order == pytest.approx(4.0, abs=0.2)


def test_scalar_guide_swings_at_its_frequency():
    """After a tenth of the period of a small vibration, x = x0 cos(w t) with w = 2 pi f."""
    values = mechanism("PRBDM").values({"damping.beta": 0.0})
    body = ScalarGuide.of(values)
    one = Monolith(body, lambda t, x, v, z: 0.0, x=1e-6, substep=1e-4)
    one.advance(0.1 / body.frequency)
    assert one.x == pytest.approx(1e-6 * math.cos(0.2 * math.pi), rel=1e-7)


def test_scalar_guide_rests_and_is_released():
    """The guide rests while the force presses it on the stop, and leaves when it reverses."""
    body = ScalarGuide.of(mechanism("PRBDM").values(START), [1e-3])
    force = 0.3
    one = Monolith(body, lambda t, x, v, z: force)
    one.advance(0.4)
    assert one.held == 1e-3
    assert one.x == pytest.approx(1e-3, rel=1e-12)
    force = -0.3
    one.advance(0.41)
    assert one.held is None
    assert one.v < 0.0
