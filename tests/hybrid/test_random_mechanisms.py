"""Laws of mechanisms, checked on random trees and loops of all flexure models and ends.

The expected values are computed from positions and their differences only.  They are compared with
the rows, matrices and convective terms of the engine.
"""

import math

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from prbm.base.errors import EquilibriumError
from prbm.hybrid.simulation import Simulation
from prbm.mechanics.assembly import assemble
from prbm.mechanics.contact_state import ContactState
from prbm.mechanics.dynamics import Equations
from prbm.mechanics.elements import Elements
from prbm.mechanics.kinetics import inertia
from prbm.mechanics.modal import modes
from prbm.mechanics.statics import equilibrium
from prbm.mechanics.system import unit
from prbm.mechanism.description import Mechanism
from prbm.mechanism.parts import (
    GROUND,
    Body,
    Release,
    Stop,
    body_of,
    value,
)
from random_mechanisms import inputs, mechanisms, seeded
from support import energy_balance

SEEDS = st.integers(0, 10**6)
STEP = 1e-3  # Step of first differences of fourth order; truncation and rounding are about 1e-13.
SECOND_STEP = np.finfo(float).eps ** 0.25  # Step of second differences.


def laws(count, *, shrink=True):
    """Return settings of hypothesis: reproducible examples, without a time limit."""
    return settings(
        phases=[Phase.generate, Phase.shrink] if shrink else [Phase.generate],
        max_examples=count,
        deadline=None,
        derandomize=True,
        suppress_health_check=[HealthCheck.filter_too_much, HealthCheck.too_slow],
    )


# --- definitions of positions -------------------------------------------------------------------


def arms(system, q):
    """Return exp(s + i theta) of every arm, or the displacement of one that floats.

    The entries of stretches and displacements are not used.
    """
    theta = system.Phi.Phi @ q
    E = np.exp(1j * theta)
    for x, y in system.shifts.reshape(-1, 2):
        E[system.arm[x]] = complex(theta[x], theta[y])
    for k in system.stretches:
        E[system.arm[k]] *= np.exp(theta[k])
    return E


def rotary(system):
    """Return the matrix of the moments of inertia of the bodies about their centres, (n, n)."""
    J = np.zeros((system.n, system.n))
    for frame in system.bodies.values():
        J[frame.j, frame.j] = system.J[frame.arm]
    return J


def mass_points(system, q):
    """Return the positions of all mass points."""
    return system.A @ arms(system, q) + system.c


def on_line(system, guide, q):
    """Return the position of a guided point from the start of its line, along and to the left."""
    at, start, end = (
        complex(*system.mechanism.point(point, ""))
        for point in (guide.point, guide.start, guide.end)
    )
    point = body_point(system, guide.body, at, q)
    line = [body_point(system, guide.on, z, q) for z in (start, end)]
    along = (line[1] - line[0]) / abs(end - start)
    return np.conj(along) * (point - line[0])


def closures(system, q):
    """Return the closures of the loops, and where guides hold, from the geometry of bodies."""
    found = (system.loops @ arms(system, q)).real + system.loops_c
    for guide, rows in zip(system.mechanism.guides, system.guided, strict=True):
        on, body = (
            0.0 if name == GROUND else q[system.bodies[name].j] for name in (guide.on, guide.body)
        )
        found[rows.across] = on_line(system, guide, q).imag
        if rows.turn is not None:
            found[rows.turn] = system.length * np.sin(body - on)
    return found


def body_point(system, body, drawn, q):
    """Return the position of a drawn point of a body, from its centre of mass and its angle."""
    if body == GROUND:
        return drawn
    frame = system.bodies[body]
    centre = complex(frame.A @ arms(system, q)) + frame.c
    return centre + np.exp(1j * q[frame.j]) * (drawn - frame.drawn)


def relative_displacement(system, stop, q):
    """Return the displacement of a hit point from the straight shape, relative to its wall's body.

    The real part is along the direction of the stop, the imaginary part to its left.
    """
    u = unit(stop.direction)
    drawn = complex(*stop.point) + value(stop, "offset", system.values) * 1j * u
    hit = body_point(system, stop.body, drawn, q)
    origin = body_point(system, stop.on, 0j, q)
    turned = 0.0 if stop.on == GROUND else q[system.bodies[stop.on].j]
    return np.conj(u) * ((hit - origin) * np.exp(-1j * turned) - drawn)


def gaps(system, q):
    """Return the gaps of all stops."""
    return np.array(
        [value(s, "position", system.values) - relative_displacement(system, s, q).real
         for s in system.mechanism.stops]
    )  # fmt: skip


def slides(system, q):
    return np.array([relative_displacement(system, s, q).imag for s in system.mechanism.stops])


def rubs(system, q):
    """Return the displacements of friction points along their directions, then along guides."""
    found = []
    for f in system.mechanism.frictions:
        body = next(b for b in system.mechanism.bodies if b.name == f.body)
        drawn = complex(*(f.point or body.centre))
        found.append(
            (np.conj(unit(f.direction)) * (body_point(system, f.body, drawn, q) - drawn)).real
        )
    rough = (guide for guide in system.mechanism.guides if guide.friction is not None)
    return np.array([*found, *(on_line(system, guide, q).real for guide in rough)])


def gradient_of(f, q):
    """Return df/dq by central differences of fourth order, (values, n)."""
    columns = [
        (8 * (f(q + d) - f(q - d)) - (f(q + 2 * d) - f(q - 2 * d))) / (12 * STEP)
        for d in STEP * np.eye(len(q))
    ]
    return np.array(columns).T.reshape(-1, len(q))


def second_derivative(f, q, v):
    """Return the second derivative of f along q + t v at t = 0."""
    h = SECOND_STEP / np.abs(v).max()
    return (f(q + h * v) - 2 * f(q) + f(q - h * v)) / h**2


def random_state(system, seed):
    """Return random coordinates away from the straight shape, and rates."""
    rng = np.random.default_rng(seed)
    size = np.where(np.isin(np.arange(system.n), system.strains), 0.05, 0.3)
    return system.q0 + size * rng.normal(size=system.n), rng.normal(size=system.n)


# --- assembly -----------------------------------------------------------------------------------


@given(mechanisms() | mechanisms(guides=2), SEEDS)
@laws(25)
def test_mass_matrix_and_quadratic_terms_follow_from_the_positions(mechanism, seed):
    """M = Re(T^H m T) + J, T = dz/dq, and the quadratic terms are Re(T^H m z'') at constant rates.

    z are the positions of the mass points m, J the moments of inertia.
    """
    system = assemble(mechanism, mechanism.values())
    q, v = random_state(system, seed)
    T = gradient_of(lambda q: mass_points(system, q), q)
    e, w = system.directions(q), system.turning(v)
    M = system.mass_matrix(e)
    expected = (T.conj().T @ (system.m[:, None] * T)).real + rotary(system)
    np.testing.assert_allclose(M, expected, atol=1e-9 * np.abs(M).max())
    w2 = w * w
    M_d, C = inertia(system.H, np.diag(0 * system.J), e)
    quadratic = system.Phi.to_coordinates(C @ w2.real - M_d @ w2.imag)  # -Im(Hq w^2)
    bent = (
        T.conj().T @ (system.m * second_derivative(lambda q: mass_points(system, q), q, v))
    ).real
    np.testing.assert_allclose(quadratic, bent, atol=2e-6 * np.abs(M).max() * v @ v)


@given(mechanisms() | mechanisms(guides=2), SEEDS)
@laws(25)
def test_rows_are_the_derivatives_of_their_scalars(mechanism, seed):
    """Values, gradients, rates and convective terms of loops, gaps, slides and friction points.

    Walls may be on bodies.
    """
    system = assemble(mechanism, mechanism.values())
    q, v = random_state(system, seed)
    e = system.directions(q)
    places = np.array([value(s, "position", system.values) for s in mechanism.stops])
    scalars = [
        (system.loop_rows, closures, 0.0),
        (system.gap_rows, gaps, places),
        (system.slide_rows, slides, None),
        (system.rub_rows, rubs, None),
    ]
    for rows, scalar, shift in scalars:
        if not len(rows):
            continue

        def f(q, scalar=scalar):
            return scalar(system, q)

        if shift is not None:
            np.testing.assert_allclose(rows.values(e) + shift, f(q), atol=1e-14)
        gradient = gradient_of(f, q)
        np.testing.assert_allclose(rows.jacobian(e), gradient, atol=1e-10)
        np.testing.assert_allclose(rows.rates(e, v), gradient @ v, atol=1e-9)
        np.testing.assert_allclose(
            rows.convective(e, v), -second_derivative(f, q, v), atol=1e-6 * v @ v
        )


@given(mechanisms() | mechanisms(guides=2), SEEDS)
@laws(20)
def test_loops_gaps_and_positions_of_the_straight_shape_are_those_of_the_drawing(mechanism, seed):
    """Loops are closed, gaps equal the stops' positions, centres of mass are those of the file.

    The moving mass is at most the mass of all bodies and flexures.
    """
    system = assemble(mechanism, mechanism.values())
    np.testing.assert_allclose(closures(system, system.q0), 0.0, atol=1e-14)
    places = [value(s, "position", system.values) for s in mechanism.stops]
    np.testing.assert_allclose(gaps(system, system.q0), places, atol=1e-14)
    for body in mechanism.bodies:
        frame = system.bodies[body.name]
        assert complex(frame.A @ arms(system, system.q0)) + frame.c == pytest.approx(frame.drawn)
    assert system.m.sum() <= sum(b.mass for b in mechanism.bodies) + leaf_mass(mechanism) + 1e-15


def leaf_mass(mechanism):
    """Return the mass of all flexures, or a bound of it for beams that are no straight leaves.

    Less moves with a lumped model (1R), or with a link that is fixed to the ground.
    """
    total = 0.0
    for flexure in mechanism.flexures:
        kind = next(k for k in mechanism.flexure_types if k.name == flexure.type)
        ends = [complex(*mechanism.point(p, "")) for p in (flexure.start, flexure.end)]
        thickest = max(kind.thickness, kind.end_thickness or 0.0)
        thickest += 2.0 * (kind.notch_radius or 0.0)
        longer = 1.0 if kind.curvature is kind.rise is None else 1.2
        total += kind.density * thickest * kind.width * abs(ends[1] - ends[0]) * longer
    return total


# --- motion -------------------------------------------------------------------------------------


def potential(sim, q):
    """Return the potential energy of elements, gravity, base acceleration and inputs [J]."""
    system, given = sim.system, sim.inputs
    V = 0.5 * (q - system.q0) @ system.K @ (q - system.q0)
    turns = {name: (q - system.q0)[frame.j] for name, frame in system.bodies.items()}
    turns[GROUND] = 0.0
    for joint in sim.mechanism.joints:
        if joint.stiffness is not None:
            start, end = (turns[body_of(point)] for point in (joint.start, joint.end))
            V += 0.5 * joint.stiffness * (end - start - (joint.free_angle or 0.0)) ** 2
    field = system.gravity - given.base
    V -= (np.conj(field) * (system.m @ mass_points(system, q))).real
    for force, F, moment in zip(sim.mechanism.forces, given.forces, given.moments, strict=True):
        body = next(b for b in sim.mechanism.bodies if b.name == force.body)
        z = body_point(system, force.body, complex(*(force.point or body.centre)), q)
        V -= (np.conj(F) * z).real + moment * q[system.bodies[force.body].j]
    return V


@pytest.mark.slow
@given(
    mechanisms(starting=True, damping=False, friction=False)
    | mechanisms(starting=True, damping=False, friction=False, guides=2),
    SEEDS,
    st.booleans(),
)
@laws(20)
def test_accelerations_satisfy_lagrange_equations(mechanism, seed, held):
    """T^H m z'' + J a = -dV/dq + R^T lam, and the constraints with rows R have no acceleration.

    z are the positions of the mass points m, T = dz/dq, J the moments of inertia, V is the
    potential energy.
    """
    sim = Simulation(mechanism, inputs(mechanism, seed))
    system = sim.system
    q, v = random_state(system, seed)
    holds = [held and i == 0 for i in range(len(mechanism.stops))]
    contacts = ContactState.free(len(holds), 0).holding(np.flatnonzero(holds).tolist())
    a, lam, *_ = Equations(system, sim.inputs, contacts, sim.configuration.omega).evaluate(
        sim.time, q, v
    )

    def scalars(q):
        return np.concatenate([closures(system, q), gaps(system, q)[holds]])

    T, rows = gradient_of(lambda q: mass_points(system, q), q), gradient_of(scalars, q)
    z2 = T @ a + second_derivative(lambda q: mass_points(system, q), q, v)
    inertial = (T.conj().T @ (system.m * z2)).real + rotary(system) @ a
    torque = -gradient_of(lambda q: np.array([potential(sim, q)]), q)[0] + rows.T @ lam
    size = np.abs(torque).max() + np.abs(rows.T @ lam).max() + np.abs(rotary(system) @ a).max()
    np.testing.assert_allclose(inertial, torque, atol=1e-5 * size)
    if len(rows):
        bend = second_derivative(scalars, q, v)
        h = SECOND_STEP / np.abs(v).max()
        rounding = 4 * np.finfo(float).eps * system.length / h**2  # Of the second difference.
        np.testing.assert_allclose(
            rows @ a, -bend, atol=1e-8 * np.abs(rows @ np.diag(a)).max() + 1e-6 + rounding
        )


@pytest.mark.slow
@given(mechanisms(starting=True) | mechanisms(starting=True, guides=2), SEEDS)
@laws(20)
def test_the_potential_energy_is_stationary_at_an_equilibrium(mechanism, seed):
    """dV/dq = rows^T lam under loads; frequencies follow from the second derivative."""
    given = {k: x / 4 for k, x in inputs(mechanism, seed).items() if not k.startswith("base")}
    sim = Simulation(mechanism, given)
    system = sim.system
    try:
        shape = equilibrium(system, loads=given)
    except EquilibriumError:
        return  # There may be no equilibrium under random loads.
    q, lam = shape.q, shape.lam

    def lagrangian(q):
        return np.array([potential(sim, q) - lam @ closures(system, q)])

    stiffest = np.abs(Elements(system).drawn).max()
    gradient = np.delete(gradient_of(lagrangian, q)[0], system.placed)  # Free bodies are placed.
    np.testing.assert_allclose(gradient, 0.0, atol=1e-9 * stiffest)
    np.testing.assert_allclose(closures(system, q), 0.0, atol=1e-13)
    found = modes(system, shape)
    for phi, f in zip(found.shape.T, found.frequency, strict=True):
        unit_phi = phi / np.abs(phi).max()
        omega2 = second_derivative(lagrangian, q, unit_phi)[0] / (unit_phi @ found.M @ unit_phi)
        scale = np.abs(found.frequency).max() ** 2
        assert omega2 / (2 * math.pi) ** 2 == pytest.approx(f * abs(f), rel=1e-4, abs=1e-6 * scale)


SPAN = 4e-3  # s
FEATURE_SEEDS = range(10)  # Seeds whose mechanisms together have all features.


@given(
    mechanisms(starting=True, damping=False) | mechanisms(starting=True, damping=False, guides=2),
    SEEDS,
)
@laws(4, shrink=False)
def test_energy_is_balanced_and_loops_remain_closed(mechanism, seed):
    check_energy(mechanism, seed)


def check_energy(mechanism, seed):
    """Check that T + V + dissipated - work is constant, through impacts, rest and friction.

    Without friction and with restitution 1, nothing is dissipated either.
    """
    sim = Simulation(mechanism, inputs(mechanism, seed), tolerance=1e-10)
    system, n = sim.system, sim.system.n
    balance, kinetic = [], []
    for t in np.linspace(0, SPAN, 9):
        sim.advance(float(t))
        out = sim.outputs()
        balance.append(energy_balance(out))
        kinetic.append(out["energy.kinetic"])
        y = sim.state()
        assert np.abs(closures(system, y[:n])).max(initial=0.0) < 1e-12
        assert gaps(system, y[:n]).min(initial=1.0) > -1e-9
    assert np.ptp(balance) < 1e-7 * max(kinetic)
    lossless = all(s.restitution == 1.0 and s.friction == 0.0 for s in mechanism.stops)
    if lossless and not mechanism.rubbing and not sim.contacts.held:
        assert abs(out["energy.dissipated"]) < 1e-7 * max(kinetic)


def momentum(sim):
    """Return the linear momentum [N s], and the angular momentum about the anchor [N m s]."""
    system, y, n = sim.system, sim.state(), sim.system.n
    q, v = y[:n], y[n : 2 * n]
    z = mass_points(system, q) - system.anchor
    p = system.m * (1j * (system.A @ system.swing(system.directions(q), v)))
    return p.sum(), float((z.conj() * p).imag.sum() + rotary(system).sum(axis=0) @ v)


@pytest.mark.slow
@given(mechanisms(starting=True) | mechanisms(starting=True, guides=2), SEEDS)
@laws(15, shrink=False)
def test_base_reactions_equal_loads_minus_the_rate_of_momentum(mechanism, seed):
    check_momentum(mechanism, seed)


def check_momentum(mechanism, seed):
    """Check base reaction = weight + inputs - d/dt momentum, linear and angular."""
    given = inputs(mechanism, seed)
    sim = Simulation(mechanism, given, tolerance=1e-10)
    # The relative error of the differences is (omega h)^2/6 for the fastest vibrations.
    system, h = sim.system, min(1e-7, 1e-2 / max(sim.fastest.rate, 1.0))
    for t in (0.6e-3, 2.1e-3, 3.9e-3):
        found, states = [], []
        for time in (t - h, t, t + h):
            sim.advance(time)
            found.append(momentum(sim))
            states.append((sim.contacts, sim.latched))
            if time == t:
                out, y = sim.outputs(), sim.state()
        if any(state != states[0] for state in states):
            continue  # An event between the three times makes the difference invalid.
        z = mass_points(system, y[: system.n]) - system.anchor
        weight = system.m * (system.gravity - sim.inputs.base)
        force, moment = weight.sum(), (z.conj() * weight).imag.sum()
        for one, F, M in zip(mechanism.forces, sim.inputs.forces, sim.inputs.moments, strict=True):
            body = next(b for b in mechanism.bodies if b.name == one.body)
            drawn = complex(*(one.point or body.centre))
            arm = body_point(system, one.body, drawn, y[: system.n]) - system.anchor
            force, moment = force + F, moment + (np.conj(arm) * F).imag + M
        rates = [(late - early) / (2 * h) for early, late in zip(found[0], found[2], strict=True)]
        size = sum(abs(x) for x in rates) + abs(force) + 1e-3
        reaction = complex(out["base.force.x"], out["base.force.y"])
        assert reaction == pytest.approx(force - rates[0], abs=5e-5 * size)
        assert out["base.moment"] == pytest.approx(moment - rates[1], abs=1e-5 * size)


# --- impacts ------------------------------------------------------------------------------------


@given(mechanisms(starting=True) | mechanisms(starting=True, guides=2), SEEDS)
@laws(4, shrink=False)
def test_impacts_satisfy_the_balance_of_momentum_and_do_not_gain_energy(mechanism, seed):
    check_impacts(mechanism, seed)


def check_impacts(mechanism, seed):
    """Check M (v+ - v-) = G^T P + T^T P_t + loops^T Lambda, P >= 0; energy is not gained.

    For one stop without friction: u+ = -eps u-, and -P (u- + u+)/2 is lost.
    """
    sim = Simulation(mechanism, inputs(mechanism, seed))
    sim.record = []
    sim.advance(SPAN)
    system = sim.system
    for impact in sim.record:
        q, jump = impact.q, impact.after - impact.before
        T = gradient_of(lambda q: mass_points(system, q), q)
        M = (T.conj().T @ (system.m[:, None] * T)).real + rotary(system)
        touching = np.flatnonzero(np.abs(gaps(system, q)) < 1e-8)
        i = next(k for k, s in enumerate(mechanism.stops) if s.name == impact.stop)
        assert i in touching
        G, loops = (
            gradient_of(lambda q: gaps(system, q), q),
            gradient_of(lambda q: closures(system, q), q),
        )
        rubbed = [k for k in touching if mechanism.stops[k].friction]
        along = gradient_of(lambda q: slides(system, q), q)[rubbed]
        rows = np.vstack([G[touching], along, loops])
        impulses = np.linalg.lstsq(rows.T, M @ jump, rcond=1e-12)[0]
        size = np.abs(M @ jump).max()
        np.testing.assert_allclose(rows.T @ impulses, M @ jump, atol=1e-7 * size)
        u = G[i] @ impact.before, G[i] @ impact.after
        kinetic = [0.5 * v @ M @ v for v in (impact.before, impact.after)]
        assert impact.impulse >= 0.0
        assert u[0] < 0.0
        parts = np.abs(G[i]) @ np.abs(impact.before)  # G is a difference: its error is 1e-8.
        assert u[1] >= -1e-7 * abs(u[0]) - 1e-8 * parts
        assert kinetic[1] <= kinetic[0] * (1 + 1e-8)
        assert impact.latched.approach_speed == pytest.approx(-u[0], rel=1e-7, abs=1e-8 * parts)
        if len(touching) == 1 and not rubbed:
            assert impact.impulse == pytest.approx(impulses[0], rel=1e-6)
            assert u[1] == pytest.approx(-mechanism.stops[i].restitution * u[0], abs=1e-7 * -u[0])
            lost = -impact.impulse * (u[0] + u[1]) / 2
            assert impact.latched.energy_lost == pytest.approx(lost, abs=1e-8 * kinetic[0])
            assert kinetic[0] - kinetic[1] == pytest.approx(lost, abs=3e-8 * kinetic[0])


@pytest.mark.slow
@pytest.mark.parametrize("free", [False, True])
@pytest.mark.parametrize("seed", range(50))
def test_the_laws_hold_for_random_mechanisms(seed, free):
    quiet = seeded(seed, damping=False, free=free)
    check_energy(quiet, seed)
    check_momentum(seeded(seed, free=free), seed)
    check_impacts(seeded(seed, free=free), seed)


@pytest.mark.slow
def test_the_random_mechanisms_have_all_features():
    """Loops, stretch, rest, friction, free bodies, impacts at walls on the ground and on bodies."""
    seen_kinds = set()
    for seed in FEATURE_SEEDS:
        mechanism = seeded(seed, free=seed % 2 == 1)
        sim = Simulation(mechanism, inputs(mechanism, seed))
        sim.record = []
        sim.advance(SPAN)
        seen_kinds |= {"loop"} if len(sim.system.loops) else set()
        seen_kinds |= {"stretch"} if len(sim.system.stretches) else set()
        seen_kinds |= {"free"} if mechanism.free_bodies else set()
        seen_kinds |= {"rest"} if sim.contacts.held else set()
        for impact in sim.record:
            stop = next(s for s in mechanism.stops if s.name == impact.stop)
            seen_kinds.add("ground" if stop.on == GROUND else "body")
            seen_kinds |= {"friction"} if stop.friction else set()
    assert seen_kinds == {"loop", "stretch", "free", "rest", "ground", "body", "friction"}


def test_a_random_mechanism_depends_on_its_seed_only():
    assert seeded(3) == seeded(3)
    assert seeded(3) != seeded(4)


def free_pair(friction):
    """Return two free bodies."""
    return Mechanism(
        name="Pair",
        title="Two free bodies that collide",
        ground={},
        bodies=(
            Body("A", 0.03, 4e-6, (0.0, 0.0)),
            Body("B", 0.05, 9e-6, (0.05, 0.002)),
        ),
        flexure_types=(),
        flexures=(),
        stops=(Stop("stop", "A", (0.01, 0.006), 20.0, 1e-3, friction=friction, on="B"),),
        release=Release("A", 10.0, velocity=0.5),
    )


@pytest.mark.parametrize("friction", [0.0, 0.2, 5.0])
@pytest.mark.parametrize("restitution", [0.0, 0.6, 1.0])
def test_an_eccentric_impact_of_two_free_bodies_conserves_momentum(friction, restitution):
    """Linear and angular momentum are the same before and after.

    Without friction, the impulse is (1 + eps) closing speed / W with
    W = sum of 1/m + (arm x n)^2/J.
    """
    pair = free_pair(friction)
    sim = Simulation(pair, {"stop.restitution": restitution, "stop.rest_speed": 0.0})
    sim.record = []
    while not sim.record:
        sim.advance(sim.time + 1e-4)
    (impact,) = sim.record
    system, q = sim.system, impact.q
    centres = {b: complex(f.A @ arms(system, q)) + f.c for b, f in system.bodies.items()}
    angles = {b: q[f.j] for b, f in system.bodies.items()}

    def motion(v):
        p, L = 0j, 0.0
        for body in pair.bodies:
            frame = system.bodies[body.name]
            u = 1j * complex(frame.A @ system.swing(system.directions(q), v))
            p += body.mass * u
            L += body.mass * (centres[body.name].conjugate() * u).imag + body.inertia * v[frame.j]
        return p, L

    (p0, L0), (p1, L1) = motion(impact.before), motion(impact.after)
    assert p1 == pytest.approx(p0, abs=1e-6 * abs(p0))
    assert abs(L1 - L0) < 1e-6 * abs(p0) * 0.05
    if friction:
        return
    n = unit(20.0) * np.exp(1j * angles["B"])
    hit = centres["A"] + np.exp(1j * angles["A"]) * (0.01 + 0.006j)
    W = sum(
        1 / b.mass + ((hit - centres[b.name]).conjugate() * n).imag ** 2 / b.inertia
        for b in pair.bodies
    )
    closing = impact.latched.approach_speed
    assert impact.impulse == pytest.approx((1 + restitution) * closing / W, rel=1e-6)
    assert impact.latched.rebound_speed == pytest.approx(restitution * closing, abs=1e-9)
