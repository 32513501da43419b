"""Finite elements compared with beam theory, conservation laws and results for the guides."""

import math
from dataclasses import replace

import numpy as np
import pytest

from free_bodies import pendulum, with_start
from prbm.base.errors import SimulationError
from prbm.files.mechanism_file import shipped
from prbm.hybrid.simulation import Simulation
from prbm.mechanics.assembly import assemble
from prbm.mechanics.modal import modes
from prbm.mechanics.statics import equilibrium
from prbm.mechanism.description import Mechanism
from prbm.mechanism.parts import Body, Flexure, FlexureType, Force, Joint, Release, Stop
from prbm.references.finite_elements import FiniteElementError, FiniteElements
from prbm.references.finite_elements.transient import StepError, Transient
from support import PMMA, mechanism

pytest.importorskip("exudyn", reason="finite elements need exudyn: python -m pip install exudyn")

WEIGHTLESS = {"gravity.x": 0.0}


def guide(values=None, elements=16):
    return FiniteElements(mechanism("PRBDM2R"), values, elements=elements)


L, THICKNESS, WIDTH, E, RHO = 0.1, 5e-4, 1e-2, 2e11, 7800.0
EI = E * WIDTH * THICKNESS**3 / 12


def beam(ends=("clamp", "free"), mass=1e-9, **options):
    """Return a flexure along x from the ground to a small body at its end."""
    return Mechanism(
        name="beam",
        title="A beam",
        ground={"root": (0.0, 0.0)},
        bodies=(Body("tip", mass, 1e-12, (L, 0.0), {"end": (L, 0.0)}),),
        flexure_types=(FlexureType("leaf", "2R", THICKNESS, WIDTH, E, RHO),),
        flexures=(Flexure("blade", "leaf", "ground.root", "tip.end", ends),),
        forces=(Force("push", "tip"),),
        release=Release("tip", direction=90.0),
        **options,
    )


@pytest.mark.parametrize("load", [0.5, 2.0, 5.0])
def test_a_loaded_cantilever_has_the_shape_of_the_elastica(load):
    """The transverse tip force is P = load EI/L^2 (Bisshopp and Drucker 1945).

    The slope theta satisfies L theta' = sqrt(2 load (sin t - sin theta)), with t the slope at the
    tip.  The substitution theta = t - s^2 removes the singularity.
    """
    from scipy.integrate import quad
    from scipy.optimize import brentq

    def along(t, function):
        def integrand(s):  # sin t - sin theta = 2 cos((t + theta)/2) sin((t - theta)/2)
            half = np.sinc(s * s / (2 * math.pi))
            return 2 * function(t - s * s) / math.sqrt(math.cos(t - s * s / 2) * half)

        return quad(integrand, 0.0, math.sqrt(t), epsabs=1e-12)[0] / math.sqrt(2 * load)

    t = brentq(lambda t: along(t, lambda _: 1.0) - 1.0, 1e-6, math.pi / 2 - 1e-6)
    x, y = along(t, math.cos) * L, along(t, math.sin) * L
    found = FiniteElements(beam(), {"push.y": load * EI / L**2}, elements=32)
    moved, angle = found.body("tip", found.equilibrium().q)
    assert [L + moved.real, moved.imag] == pytest.approx([x, y], abs=2e-4 * L)
    assert angle == pytest.approx(t, abs=2e-4)


def test_a_moment_at_the_tip_bends_a_cantilever_into_a_circle():
    """The curvature is M/EI; the tip turns by M L/EI and lies on the circle."""
    turn = 1.2
    found = FiniteElements(beam(), {"push.moment": turn * EI / L}, elements=32)
    moved, angle = found.body("tip", found.equilibrium().q)
    assert angle == pytest.approx(turn, rel=1e-4)
    radius = L / turn
    assert L + moved.real == pytest.approx(radius * math.sin(turn), rel=2e-4)
    assert moved.imag == pytest.approx(radius * (1 - math.cos(turn)), rel=2e-4)


def test_modes_of_a_cantilever_match_euler_bernoulli_theory():
    """The theory is cos(b) cosh(b) = -1 and omega = b^2 sqrt(EI/(rho A L^4))."""
    found = FiniteElements(beam(), elements=32)
    b = np.array([1.8751040687, 4.6940911330, 7.8547574382])
    wanted = b**2 * math.sqrt(EI / (RHO * WIDTH * THICKNESS * L**4)) / (2 * math.pi)
    frequency = found.modes(found.equilibrium()).frequency[:3]
    np.testing.assert_allclose(frequency, wanted, rtol=3e-4)


def test_the_rest_position_converges_with_order_two_or_more():
    """Twice the elements give at most a quarter of the change."""
    at_rest = []
    for elements in (4, 8, 16, 32):
        fe = guide(elements=elements)
        at_rest.append(fe.displacement(fe.equilibrium().q))
    change = np.abs(np.diff(at_rest))
    assert np.all(change[1:] <= change[:-1] / 4), change


def test_the_holding_force_vanishes_at_the_rest_position():
    fe = guide(elements=8)
    free = fe.equilibrium()
    held = fe.equilibrium(fe.displacement(free.q))
    assert held.force == pytest.approx(0.0, abs=1e-6)
    np.testing.assert_allclose(held.q, free.q, atol=1e-7)


def test_a_shape_does_not_depend_on_the_start_of_the_iteration():
    fe = guide(elements=8)
    direct = fe.equilibrium(-0.01)
    onward = fe.equilibrium(-0.01, near=fe.equilibrium(-0.008))
    np.testing.assert_allclose(onward.q, direct.q, atol=1e-9)
    assert onward.force == pytest.approx(direct.force, rel=1e-6)


def test_tangents_match_central_differences():
    """The tangents are C of the constraints, G of the gap and d(C mu)/dq of the reactions."""
    fe = guide({"stop.offset": 3e-3, "stop.position": 0.02}, elements=4)
    shape = fe.equilibrium(-0.01)
    rng, h = np.random.default_rng(0), 1e-6
    d = rng.standard_normal(fe.n)
    more, less = shape.q + h * d, shape.q - h * d

    def slope(function):
        return (function(more) - function(less)) / (2 * h)

    equations = fe.equations
    np.testing.assert_allclose(
        slope(equations.constraint_values), d @ equations.constraint_columns(shape.q), atol=1e-8
    )
    assert slope(lambda q: fe.gap(0, q)) == pytest.approx(fe.gap_row(0, shape.q) @ d, abs=1e-9)
    reactions = slope(lambda q: equations.constraint_columns(q) @ shape.mu)
    assert np.abs(reactions).max() > 1e-3  # Reactions of zero would prove nothing.
    stiffness = equations.constraint_stiffness(shape.q, shape.mu)
    np.testing.assert_allclose(-stiffness @ d, reactions, atol=1e-5)


def test_the_gap_of_a_wall_on_a_body_follows_its_motion():
    """The derivatives of the gap match central differences when both bodies move and turn."""
    two = Mechanism(
        name="two",
        title="Two bodies",
        ground={"a": (0.0, 0.0), "b": (0.0, 0.05)},
        bodies=(
            Body("one", 0.1, 1e-4, (0.1, 0.02), {"end": (0.1, 0.0)}),
            Body("other", 0.1, 1e-4, (0.12, 0.06), {"end": (0.1, 0.05)}),
        ),
        flexure_types=(FlexureType("leaf", "2R", THICKNESS, WIDTH, E, RHO),),
        flexures=(
            Flexure("lower", "leaf", "ground.a", "one.end"),
            Flexure("upper", "leaf", "ground.b", "other.end"),
        ),
        stops=(Stop("stop", "one", (0.11, 0.03), direction=90.0, position=0.01, on="other"),),
        release=Release("one", direction=90.0),
    )
    fe = FiniteElements(two, elements=2)
    rng, h = np.random.default_rng(1), 1e-6
    q, d = 0.1 * rng.standard_normal(fe.n), rng.standard_normal(fe.n)
    slope = (fe.gap(0, q + h * d) - fe.gap(0, q - h * d)) / (2 * h)
    assert slope == pytest.approx(fe.gap_row(0, q) @ d, abs=1e-8)
    assert fe.gap(0, np.zeros(fe.n)) == pytest.approx(0.01)


def test_gaps_of_elements_and_engine_agree_for_the_same_motion():
    fe = guide({"stop.offset": -2e-3, "stop.position": 5e-3}, elements=2)
    sim = Simulation(
        mechanism("PRBDM2R"), {"stop.offset": -2e-3, "stop.position": 5e-3}, tolerance=1e-6
    )
    out = sim.outputs()
    q = np.zeros(fe.n)
    first = fe.model.rigid["shuttle"].first
    q[first : first + 3] = out["shuttle.x"], out["shuttle.y"], out["shuttle.angle"]
    assert fe.gap(0, q) == pytest.approx(out["stop.gap"], abs=1e-12)


def test_pins_transmit_no_moment():
    """Two pinned rods form a pendulum with the frequency sqrt(g/L)/(2 pi)."""
    hung = Mechanism(
        name="hung",
        title="A body on two rods",
        ground={"a": (0.0, 0.0), "b": (0.1, 0.0)},
        bodies=(
            Body("load", 1.0, 1e-3, (0.05, -0.1), {"a": (0.0, -0.1), "b": (0.1, -0.1)}),
        ),
        flexure_types=(FlexureType("rod", "2R", 1e-3, WIDTH, E, 1.0),),
        flexures=(
            Flexure("left", "rod", "ground.a", "load.a", ("pin", "pin")),
            Flexure("right", "rod", "ground.b", "load.b", ("pin", "pin")),
        ),
        gravity=(0.0, -9.81),
        release=Release("load"),
    )  # fmt: skip
    fe = FiniteElements(hung, elements=2)
    f = fe.modes(fe.equilibrium()).frequency[0]
    assert f == pytest.approx(math.sqrt(9.81 / 0.1) / (2 * math.pi), rel=1e-5)


def test_a_joint_is_a_free_hinge():
    """A body hung by a joint from a stiff leaf has the frequency of a physical pendulum."""
    m, J, r = 0.3, 2e-4, 0.05
    hung = Mechanism(
        name="pendulum",
        title="A pendulum",
        ground={"root": (0.0, 0.0)},
        bodies=(
            Body("block", 50.0, 1e-2, (0.02, 0.0), {"end": (0.02, 0.0)}),
            Body("bob", m, J, (0.02, -r), {"pin": (0.02, 0.0)}),
        ),
        flexure_types=(FlexureType("leaf", "2R", 1e-2, WIDTH, E, RHO),),
        flexures=(Flexure("arm", "leaf", "ground.root", "block.end"),),
        joints=(Joint("pin", "block.end", "bob.pin"),),
        gravity=(0.0, -9.81),
        release=Release("block", direction=90.0),
    )
    fe = FiniteElements(hung, elements=2)
    f = fe.modes(fe.equilibrium()).frequency[0]
    assert f == pytest.approx(math.sqrt(m * 9.81 * r / (J + m * r * r)) / (2 * math.pi), rel=1e-3)


def test_an_impact_obeys_newton_and_carnot():
    """The gap opens at -eps times its rate; the energy lost is (1 - eps^2) gap'^2/(2 G W G^T)."""
    fe = guide({"stop.offset": 3e-3, "stop.position": -5e-3, "stop.restitution": 0.6}, elements=8)
    q = fe.equilibrium(-5e-3).q
    v = fe.modes(fe.equilibrium(-5e-3)).shape[:, :4] @ np.array([1.0, 0.2, -0.1, 0.05])
    v = v if fe.gap_row(0, q) @ v < 0 else -v
    after, P = fe.impact(q, v, 0, 0.6)
    G = fe.gap_row(0, q)
    assert P > 0
    assert G @ after == pytest.approx(-0.6 * (G @ v), rel=1e-9)
    assert np.abs(after @ fe.equations.constraint_columns(q)).max() < 1e-9 * np.abs(after).max()
    lost = (v @ fe.M @ v - after @ fe.M @ after) / 2
    # The effective mass is computed independently, from all modes.
    modes = fe.modes(fe.equilibrium(-5e-3)).shape
    mobility = float(((G @ modes) ** 2).sum())
    assert lost == pytest.approx((1 - 0.6**2) * (G @ v) ** 2 / (2 * mobility), rel=1e-6)


def test_friction_and_moving_walls_are_rejected():
    for values, name in (
        ({"stop.friction": 0.1}, "stop.friction"),
        ({"friction.coefficient": 0.1}, "friction.coefficient"),
        ({"damping.zeta": 0.01}, "damping.zeta"),
        ({"base.acceleration.x": 1.0}, "base.acceleration.x"),
        ({"stop.velocity": 1.0}, "stop.velocity"),
    ):
        with pytest.raises(FiniteElementError, match=name):
            guide(values, elements=2)
    with pytest.raises(FiniteElementError, match="elements = 0"):
        guide(elements=0)


def test_without_exudyn_the_error_names_the_installation(monkeypatch):
    def missing(name):
        raise ImportError(f"No module named {name!r}")

    monkeypatch.setattr("importlib.import_module", missing)
    with pytest.raises(FiniteElementError, match="pip install"):
        guide()


# --- reference numbers of the guides ----------------------------------------------------------


def test_the_steel_guide_has_the_reference_rest_position_and_frequencies():
    """The reference is 10.720 mm and 4.907, 130.7, 209.8 Hz; there are 32 elements per flexure."""
    fe = guide(elements=32)
    rest = fe.equilibrium()
    assert fe.displacement(rest.q) == pytest.approx(10.720e-3, abs=2e-6)
    frequency = fe.modes(rest).frequency[:3]
    assert frequency[0] == pytest.approx(4.907, abs=1e-3)
    np.testing.assert_allclose(frequency[1:], [130.7, 209.8], atol=0.06)


def test_the_straight_steel_guide_has_the_reference_frequency():
    fe = guide(WEIGHTLESS, elements=32)
    assert fe.modes(fe.equilibrium()).frequency[0] == pytest.approx(4.6405, abs=1e-4)


MODAL_RESTITUTION = {  # Key: offset [m].  Values: walls at -10, 0, 10 mm, for restitution 0.6.
    -4e-3: (0.4089, 0.5483, 0.4084),
    0.0: (0.4519, 0.5947, 0.4519),
    4e-3: (0.4104, 0.5482, 0.4108),
}


@pytest.mark.slow
@pytest.mark.parametrize("offset", MODAL_RESTITUTION)
def test_the_steel_guide_has_the_reference_modal_restitution(offset):
    fe = guide(WEIGHTLESS | {"stop.offset": offset})
    found = [fe.modal_restitution(fe.equilibrium(h), 0, 0.6) for h in (-0.01, 0.0, 0.01)]
    np.testing.assert_allclose(found, MODAL_RESTITUTION[offset], atol=3e-4)


@pytest.mark.slow
def test_the_free_pmma_guide_has_the_reference_frequency_and_amplitude():
    """The guide starts straight at 1 m/s; the frequency is measured between zero crossings."""
    response = guide(PMMA, elements=16).transient(0.4, 2e-4)
    t, x = response["time"], response["shuttle.x"]
    upward = (x[:-1] < 0) & (x[1:] >= 0)
    i = np.flatnonzero(upward & (t[:-1] > 0.1))  # The first samples are round-off.
    crossings = np.append(0.0, t[i] - x[i] * (t[i + 1] - t[i]) / (x[i + 1] - x[i]))
    assert 1 / np.diff(crossings).mean() == pytest.approx(5.6375, abs=5e-3)
    assert 26.2e-3 < x.max() < 28.1e-3


RIGID = {"SliderCrank", "ToggleLatch"}  # Without flexures.
PROFILED = ("CurvedBistable", "NotchGuide")


@pytest.mark.parametrize("name", PROFILED)
def test_beams_that_are_curved_or_have_a_profile_are_rejected(name):
    with pytest.raises(FiniteElementError, match="not straight and uniform"):
        FiniteElements(mechanism(name), elements=2)


@pytest.mark.parametrize("name", sorted(set(shipped()) - set(PROFILED) - RIGID))
def test_elements_and_model_agree_for_every_shipped_mechanism(name):
    """The fundamental frequencies at rest agree to 2.5 %."""
    parts = mechanism(name)
    system = assemble(parts, parts.values())
    model = modes(system, equilibrium(system)).frequency[0]
    without = {f"{friction.name}.coefficient": 0.0 for friction in parts.frictions}
    without |= {f"{stop.name}.friction": 0.0 for stop in parts.stops} | {"damping.zeta": 0.0}
    fe = FiniteElements(parts, without, elements=8)
    assert fe.modes(fe.equilibrium()).frequency[0] == pytest.approx(model, rel=0.025)


# --- transients with impact -------------------------------------------------------------------


@pytest.fixture(scope="module")
def default_run():
    return guide(elements=8).transient(0.3, 1e-4)


@pytest.mark.slow
def test_bounces_of_the_default_run_match_those_of_a_chain_of_links(default_run):
    """Times and closing speeds of the first five impacts equal those of a chain of 12 links."""
    base = mechanism("PRBDM2R")
    chain = replace(
        base, flexure_types=(replace(base.flexure_types[0], model="nR", n=12, coefficients={}),)
    )
    sim = Simulation(chain, tolerance=1e-7)
    sim.record = []
    sim.advance(0.215)
    ours = [(i.time, i.latched.approach_speed) for i in default_run.impacts[:5]]
    theirs = [(i.time, i.latched.approach_speed) for i in sim.record if i.latched.approach_speed > 0.09][:5]  # fmt: skip  # noqa: E501
    np.testing.assert_allclose(np.array(ours), np.array(theirs), atol=5e-3, rtol=0.02)


@pytest.mark.slow
def test_the_default_run_comes_to_rest_on_the_wall(default_run):
    assert default_run["stop.contact"][-1]
    held = np.flatnonzero(default_run["stop.contact"])
    assert default_run["time"][held[0]] == pytest.approx(0.240, abs=3e-3)
    assert default_run["stop.gap"].min() > -1e-8
    rebounds = [i.latched.rebound_speed / i.latched.approach_speed for i in default_run.impacts]
    np.testing.assert_allclose(rebounds, 0.6, rtol=1e-9)


def test_a_held_stop_is_released_when_its_force_would_pull():
    """The flexures pull the captured body away from the wall."""
    fe = guide(
        WEIGHTLESS
        | {"release.displacement": -5.012e-3, "stop.position": 5e-3, "stop.rest_speed": 0.05},
        elements=4,
    )
    response = fe.transient(0.2, 1e-4)
    assert not response.impacts
    assert response["stop.contact"].any()
    assert not response["stop.contact"][-1]
    assert response["shuttle.x"][-1] < 0.0


@pytest.mark.slow
def test_first_impact_converges_with_the_step():
    """The modal restitution of an off-centre impact changes by less than 1e-3."""
    found = [
        guide({"stop.offset": 4e-3, "stop.position": -5e-3}, elements=8)
        .transient(0.1, step, impacts=1)
        .impacts[0]
        for step in (1e-4, 5e-5)
    ]
    assert found[0].time == pytest.approx(found[1].time, abs=1e-6)
    restitution = [i.latched.modal_restitution for i in found]
    assert restitution[0] == pytest.approx(restitution[1], abs=1e-3)


def test_an_impact_that_cannot_be_located_is_rejected_with_its_stop(monkeypatch):
    """One iteration leaves the gap open by more than its tolerance."""
    monkeypatch.setattr("prbm.references.finite_elements.transient.LOCATIONS_MAX", 1)
    message = r"impact at stop could not be located .* 1 iterations left a gap of .* shorten the st"
    with pytest.raises(SimulationError, match=message):
        guide(elements=4).transient(0.1, 1e-3, impacts=1)


def test_a_failed_step_is_divided_to_locate_an_impact(monkeypatch):
    """Undivided steps to the wall fail here; shorter ones locate the impact."""
    values = {"stop.position": -5e-3}
    plain = guide(values, elements=4).transient(0.1, 1e-4, impacts=1).impacts[0]
    integrate, failed = Transient._integrate, []

    def sometimes(self, t, q, v, end, steps, look):
        if steps == 1 and end - t < 0.9999e-4:
            failed.append(t)
            raise StepError("did not converge")
        return integrate(self, t, q, v, end, steps, look)

    monkeypatch.setattr(Transient, "_integrate", sometimes)
    divided = guide(values, elements=4).transient(0.1, 1e-4, impacts=1).impacts[0]
    assert failed
    assert divided.time == pytest.approx(plain.time, abs=1e-7)  # Shorter steps have smaller errors.


@pytest.mark.parametrize("end", [0.0028, 0.0123, 0.0201, 0.0283])
def test_a_transient_ends_at_its_stop_time(end):
    """Rounding may leave a tiny last step, which is skipped."""
    fe = guide({"stop.position": 0.03}, elements=2)
    run = fe.transient(end, 1e-4)
    assert run["time"][-1] == pytest.approx(end, abs=1e-9)
    interrupted = Transient(fe, 1e-4, 0.9)
    q, v = fe.release()
    t, *_ = interrupted._fly(end * (1 - 1e-13), q, v, end)  # Only round-off is left.
    assert t == pytest.approx(end, rel=1e-12)


@pytest.mark.parametrize("given", [{"stiffness": 0.3}, {"damping": 0.1}])
def test_torsion_at_joints_is_rejected_by_name(given):
    swing = pendulum(0.0)
    with pytest.raises(FiniteElementError, match=rf"pin\.{next(iter(given))} is not 0"):
        FiniteElements(replace(swing, joints=(replace(swing.joints[0], **given),)))


def test_velocities_of_bodies_at_the_start_are_rejected_by_name():
    model = with_start(mechanism("PRBDM2R"), "shuttle", start_vx=0.3)
    with pytest.raises(
        FiniteElementError, match=r"start from the release: remove shuttle\.start_vx"
    ):
        FiniteElements(model, elements=2).release()
