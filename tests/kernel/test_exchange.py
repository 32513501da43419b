"""Model exchange: states, derivatives, indicators and events of the kernel."""

import numpy as np
import pytest

from exchange import assert_directional, integrate
from free_bodies import ball, flying
from kernel_simulation import KernelMistake, KernelSimulation
from many_parts import anvil, beams, elastic, profiles, two_stops
from prbm.mechanics.assembly import assemble
from prbm.mechanics.independent import conditioning, independent
from prbm.mechanics.inputs import input_names
from prbm.mechanics.statics import equilibrium
from support import GUIDES, case, each_shipped, energy_balance, fastest, mechanism

INPUTS = {
    "force.x": 0.1, "force.y": -0.2, "force.moment": 1e-3, "stop.displacement": 1e-3,
    "stop.velocity": 0.02, "base.acceleration.x": 0.3, "base.acceleration.y": -0.4,
}  # fmt: skip
FRICTION = {
    "stop.friction": 0.3, "friction.coefficient": 0.4, "friction.normal_force": 0.5,
    "friction.normal_stiffness": 30.0, "damping.zeta": 0.05,
}  # fmt: skip


@each_shipped
def test_the_loops_determine_the_dependent_coordinates_at_every_shape(model):
    """The conditioning of the dependent columns of the Jacobian is above 1/30.

    The shapes are held at displacements up to that at release, in both directions.
    """
    guide = mechanism(model)
    system = assemble(guide, guide.values())
    chosen = independent(guide)
    dependent = tuple(j for j in range(system.n) if j not in chosen)
    assert len(chosen) == system.n - len(system.loops)
    loops = system.loop_rows
    for share in (-1.0, -0.6, -0.3, 0.0, 0.3, 0.6, 1.0) if len(system.loops) else ():
        q = equilibrium(system, share * case(model).displacement).q
        assert conditioning(loops.jacobian(system.directions(q)), dependent) > 1 / 30


def discrete_states():
    """Yield models and discrete states (closed, slide, rub).

    ``closed`` is 1 for a closed stop.  ``slide``, at the stop, and ``rub``, at the friction point,
    are 0 for stick, 1 or -1 for slip and 2 for a frictionless contact.  The 1R guide has one degree
    of freedom: its stop cannot be closed while friction sticks.
    """
    for rubs in (2, 0, 1, -1):
        for model in GUIDES:
            yield model, (0, 2, rubs)
        for slides in (2, 0, 1, -1):
            yield "PRBDM2R", (1, slides, rubs)
            if slides != 0 and rubs != 0:
                yield "PRBDM", (1, slides, rubs)


@pytest.mark.parametrize(("model", "discrete"), [*discrete_states()], ids=str)
def test_directional_derivatives_equal_differences(model, discrete):
    assert_directional(mechanism(model), FRICTION, INPUTS, discrete)


@each_shipped
def test_directional_derivatives_of_every_mechanism_without_contact_equal_differences(model):
    guide = mechanism(model)
    names = input_names(guide)
    inputs = dict(zip(names, np.linspace(-0.4, 0.3, len(names)), strict=True))
    inputs |= {name: 1e-3 for name in names if name.endswith((".moment", ".displacement"))}
    inputs |= {name: 0.02 for name in names if name.endswith(".velocity")}
    friction = FRICTION if guide.frictions else {"damping.zeta": 0.05}
    assert_directional(guide, friction, inputs, ())


HAMMER = {
    "face.friction": 0.3, "rub.coefficient": 0.4, "rub.normal_force": 0.5,
    "rub.normal_stiffness": 30.0, "damping.zeta": 0.05,
}  # fmt: skip
BLOW = {
    "blow.x": 0.1, "blow.y": -0.2, "blow.moment": 1e-3, "face.displacement": 1e-3,
    "face.velocity": 0.02, "side.displacement": -1e-3, "side.velocity": 0.01,
    "base.acceleration.x": 0.3, "base.acceleration.y": -0.4,
}  # fmt: skip


@pytest.mark.parametrize("rubs", [2, 0, 1])
@pytest.mark.parametrize("slides", [None, 2, 0, 1, -1])
@pytest.mark.parametrize("side", [0, 1])
def test_directional_derivatives_with_stretches_and_walls_on_bodies_equal_differences(
    side, slides, rubs
):
    """The stop between a hammer and its stage is open, frictionless, sticking or sliding."""
    holds = slides is not None
    if side and holds and slides == rubs == 0:
        pytest.skip("as many constraints as degrees of freedom")
    discrete = (holds, side, slides if holds else 2, 2, rubs)
    assert_directional(anvil(), HAMMER, BLOW, discrete)


@pytest.mark.parametrize(
    "guide", [elastic(), beams(), profiles()], ids=["Elastic", "Beams", "Profiles"]
)
def test_directional_derivatives_of_a_mechanism_with_all_kinds_of_parts_equal_differences(guide):
    inputs = dict.fromkeys(input_names(guide), 0.1) | {"pull.moment": 1e-3, "push.moment": -1e-3}
    inputs["tap.velocity"] = 0.04  # Away from the kink of the event indicator.
    friction = {"rub.coefficient": 0.2, "dry.coefficient": 0.1, "dry.normal_force": 0.3}
    for discrete in ((0, 0, 0, 2, 2, 2, 1, 2), (1, 1, 1, 1, 2, -1, 0, -1)):
        assert_directional(guide, friction, inputs, discrete)


@pytest.mark.parametrize("discrete", [
    (0, 0, 0, 2, 2, 2, 2), (1, 0, 0, 2, 2, 2, 1), (1, 1, 0, 1, -1, 2, -1), (1, 0, 1, 0, 2, 2, 0),
    (0, 1, 1, 2, 0, 2, 1),
])  # fmt: skip
def test_directional_derivatives_with_free_bodies_equal_differences(discrete):
    """Free bodies press on each other and on the stage; contacts stick, slip, or do not."""
    guide = flying()
    inputs = dict.fromkeys(input_names(guide), 0.1) | {"push.moment": 1e-3, "blow.moment": -1e-3}
    inputs |= {f"{stop.name}.velocity": 0.04 for stop in guide.stops}
    inputs |= {f"{stop.name}.displacement": 1e-3 for stop in guide.stops}
    assert_directional(guide, {}, inputs, discrete)


def test_a_ball_bounces_and_rests_in_model_exchange_as_in_co_simulation():
    """Its states are displacements [m], rotation, and their rates."""
    kernel, times = KernelSimulation(ball(), exchange=True), []
    assert kernel.states[:6] == [f"ball.{x}" for x in ("x", "y", "angle", "vx", "vy", "omega")]
    for t, z in integrate(kernel, 3.0, h=1e-3):
        assert (z > 0.0).all()
        if kernel.get("floor.impact_count") > len(times):
            times.append(t)
    alone = KernelSimulation(ball())
    alone.advance(3.0)
    assert len(times) == alone.get("floor.impact_count") > 10
    assert times[0] == pytest.approx((2 / 9.81) ** 0.5, abs=1e-9)
    assert times[-1] == pytest.approx(alone.get("floor.impact_time"), abs=1e-7)
    assert kernel.get("floor.contact") == alone.get("floor.contact") == 1.0
    assert kernel.get("ball.y") == pytest.approx(-1.0, abs=1e-9)


@each_shipped
def test_derivatives_equal_differences_of_co_simulation(model):
    """The differences are over a short time without events."""
    exchange = KernelSimulation(mechanism(model), {"release.velocity": 0.2}, exchange=True)
    moving = KernelSimulation(mechanism(model), {"release.velocity": 0.2}, tolerance=1e-12)
    names = [n.removeprefix("der(").removesuffix(")") for n in exchange.slots if "der(" in n][:-2]
    start, h, slopes = [moving.get(name) for name in names], min(1e-6, 0.05 / fastest(model)), []
    for time in (h, 2 * h):
        moving.advance(time)
        slopes.append([(moving.get(n) - b) / time for n, b in zip(names, start, strict=True)])
    assert names
    for name, first, second in zip(names, *slopes, strict=True):
        assert exchange.get(f"der({name})") == pytest.approx(2 * first - second, rel=1e-3, abs=1.0)


@pytest.mark.slow
def test_indicators_are_positive_after_events_and_impacts_equal_those_of_co_simulation():
    guide, values = mechanism("PRBDM"), {"stop.restitution": 0.4}
    kernel, times = KernelSimulation(guide, values, exchange=True), []
    for t, z in integrate(kernel, 0.2):
        assert (z > 0.0).all()
        if kernel.get("stop.impact_count") > len(times):
            times.append(t)
    alone = KernelSimulation(guide, values)
    alone.advance(0.2)
    assert len(times) == alone.get("stop.impact_count") > 4
    assert times[-1] == pytest.approx(alone.get("stop.impact_time"), abs=1e-7)
    assert kernel.get("stop.contact") == alone.get("stop.contact") == 1.0
    assert kernel.get("stop.force") == pytest.approx(alone.get("stop.force"), rel=1e-9)


def test_bodies_come_to_rest_on_each_other_in_model_exchange_as_in_co_simulation():
    """A hammer is pressed onto the stage that carries it, with friction."""
    guide, values = anvil(), {"blow.y": -0.6, "face.restitution": 0.3, "rub.coefficient": 0.0}
    kernel = KernelSimulation(guide, values, exchange=True)
    for _, z in integrate(kernel, 0.03):
        assert (z > 0.0).all()
    alone = KernelSimulation(guide, values)
    alone.advance(kernel.get("time"))
    assert kernel.get("face.impact_count") == alone.get("face.impact_count") > 2
    assert kernel.get("face.impact_time") == pytest.approx(alone.get("face.impact_time"), abs=1e-7)
    assert kernel.get("face.contact") == alone.get("face.contact") == 1.0
    assert abs(kernel.get("face.gap")) < 1e-9
    for name in ("hammer.x", "hammer.vy", "tip.vx", "stage.vx", "energy.dissipated"):
        assert kernel.get(name) == pytest.approx(alone.get(name), rel=1e-4, abs=1e-5)


def test_states_that_do_not_determine_the_shape_are_rejected_with_a_remedy():
    kernel = KernelSimulation(mechanism("PRBDM"), exchange=True)
    x = kernel.exchange_get()
    x[0] = 0.0  # The links are parallel to the shuttle: a flat parallelogram.
    kernel.exchange_set(0.0, x)
    with pytest.raises(KernelMistake, match=r"do not determine the other coord.* use co-sim"):
        kernel.derivatives()
    kernel.exchange_set(0.0, np.full(len(x), np.nan))
    with pytest.raises(KernelMistake):
        kernel.derivatives()


def test_a_velocity_step_of_the_wall_strikes_a_resting_body_or_releases_it():
    """In model exchange as in co-simulation, a change of the wall's velocity is an event."""
    kernel = KernelSimulation(
        mechanism("PRBDM"), {"release.displacement": 0.0, "gravity.x": 9.81}, exchange=True
    )
    kernel.event()
    assert kernel.get("stop.contact") == 1.0
    kernel.set({"stop.velocity": -0.1})
    assert kernel.indicators().min() < 0.0
    kernel.event()
    assert kernel.get("stop.impact_count") == 1.0
    assert kernel.get("stop.approach_speed") == pytest.approx(0.1)
    assert (kernel.indicators() > 0.0).all()
    kernel.exchange_set(1e-3, kernel.exchange_get())
    other = KernelSimulation(
        mechanism("PRBDM"), {"release.displacement": 0.0, "gravity.x": 9.81}, exchange=True
    )
    other.set({"stop.velocity": 0.1})
    assert other.indicators().min() < 0.0
    other.event()
    assert other.get("stop.contact") == 0.0
    assert other.get("stop.impact_count") == 0.0
    assert (other.indicators() > 0.0).all()


def test_a_body_at_rest_follows_the_smooth_motion_of_its_wall():
    """The wall's acceleration is below that of gravity, so the shuttle stays on the wall.

    Each change of the wall's velocity by half of rest_speed is an event.  Between two events the
    gap is below that speed times the time between them.  The energy balance includes the work of
    the wall; the strikes at the events lose a small part of it.
    """
    size, omega = 5e-4, 2 * np.pi * 5.0

    def wall(t):
        return {
            "stop.displacement": size * (1.0 - np.cos(omega * t)),
            "stop.velocity": size * omega * np.sin(omega * t),
        }

    values = {"release.displacement": 0.0, "gravity.x": 9.81}
    kernel = KernelSimulation(mechanism("PRBDM"), values, exchange=True)
    kernel.event()
    start = energy_balance(kernel.outputs())
    kept = []
    for _, z in integrate(kernel, 0.15, h=1e-4, inputs=wall):
        assert z.min() > 0.0
        kept.append(energy_balance(kernel.outputs()) - start)
    assert kernel.get("stop.contact") == 1.0
    assert kernel.get("stop.impact_count") == 0.0
    assert kernel.get("stop.gap") == pytest.approx(0.0, abs=1e-6)
    assert kernel.get("shuttle.x") == pytest.approx(wall(0.15)["stop.displacement"], abs=2e-6)
    work = abs(kernel.get("energy.work"))
    assert np.abs(kept).max() < 1e-4 * work
    assert 0.0 < kernel.get("energy.dissipated") < 0.05 * work


def test_infinitely_many_bounces_end_in_rest_in_model_exchange():
    """The rest speed is zero; only bounces below 1e-10 of the guide's size may be missing."""
    values = {"stop.rest_speed": 0.0, "release.displacement": -1e-3}
    kernel = KernelSimulation(mechanism("PRBDM"), values, exchange=True)
    for _, z in integrate(kernel, 0.08, h=1e-4):
        assert z.min() > 0.0
    other = KernelSimulation(mechanism("PRBDM"), values)
    other.advance(0.08)
    assert kernel.get("stop.contact") == other.get("stop.contact") == 1.0
    assert kernel.get("stop.impact_time") == pytest.approx(other.get("stop.impact_time"), abs=1e-5)
    missing = other.get("stop.impact_count") - kernel.get("stop.impact_count")
    assert 0 <= missing <= 10
    assert kernel.get("stop.force") == pytest.approx(other.get("stop.force"), rel=1e-6)


@pytest.mark.parametrize(
    "model", [anvil(), two_stops("PRBDM"), two_stops("PRBDM2R")], ids=lambda guide: guide.name
)
def test_derivatives_after_an_event_with_impulses_are_those_of_the_state_after_it(model):
    """The expected derivatives are those of a restored state, in which nothing is cached."""
    values = {name: 0.0 for name in ("release.displacement",) if name in model.values()}
    kernel = KernelSimulation(model, values, exchange=True)
    before = kernel.derivatives()
    kernel.set({f"{model.forces[0].name}.impulse.x": 1e-3})
    kernel.event()
    found = kernel.derivatives(), kernel.indicators()
    kernel.restore(kernel.state)
    expected = kernel.derivatives(), kernel.indicators()
    assert np.abs(expected[0] - before).max() > 1e-3
    for x, same in zip(found, expected, strict=True):
        np.testing.assert_allclose(x, same, rtol=1e-9, atol=1e-9 * np.abs(same).max())


def test_a_wall_keeps_its_velocity_after_an_impulse_until_its_partner_sets_it():
    """The velocity changes by mobility times impulse, and a saved state includes the change."""
    mobility = 5.0
    at_rest = {"release.displacement": 0.0, "stop.mobility": mobility}
    sim = KernelSimulation(mechanism("PRBDM"), at_rest, exchange=True)
    sim.set({"stop.velocity": -2e-2})
    assert sim.event()
    struck, state = sim.outputs(), sim.state
    wall = struck["stop.gap_rate"] + struck["stop.point.velocity"]
    assert struck["stop.impulse_sum"] > 0.0
    assert wall == pytest.approx(-2e-2 + mobility * struck["stop.impulse_sum"], rel=1e-9)
    sim.exchange_set(0.0, sim.exchange_get())  # The next evaluation.
    assert sim.get("stop.gap_rate") == pytest.approx(struck["stop.gap_rate"], rel=1e-9)
    sim.restore(state)
    assert sim.get("stop.gap_rate") == pytest.approx(struck["stop.gap_rate"], rel=1e-9)
    sim.set({"stop.velocity": wall})
    assert sim.get("stop.gap_rate") == pytest.approx(struck["stop.gap_rate"], rel=1e-9)
    sim.set({"stop.velocity": 0.0})
    assert sim.get("stop.gap_rate") == pytest.approx(-sim.get("stop.point.velocity"), rel=1e-9)
