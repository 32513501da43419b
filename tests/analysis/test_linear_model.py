"""Linear models beside the equations of motion, simulations and closed forms."""

import io
import math

import numpy as np
import pytest
from scipy.io import loadmat

import prbm
from fmu_host import simulate_fmu
from prbm.base.errors import EquilibriumError, ParameterError
from prbm.hybrid.simulation import Simulation
from prbm.mechanics import constraints
from prbm.mechanics.contact_state import ContactMode, ContactState
from prbm.mechanics.dynamics import Equations, base_reaction
from prbm.mechanics.inputs import Inputs, Wall
from prbm.mechanics.linear import input_units, output_units
from prbm.mechanics.modal import fundamental_frequency
from prbm.mechanism.parts import value
from support import each_shipped, mechanism

DAMPED = {"damping.zeta": 0.05, "damping.beta": 2e-5}
STICKING = {"stop.friction": 0.3, "friction.coefficient": 0.4, "friction.normal_force": 5.0}


def complete(model, values=None, **options):
    """Return the linear model with all inputs and outputs."""
    guide = mechanism(model)
    system = Simulation(guide).system
    return prbm.linearize(
        guide, values, inputs=list(input_units(system)), outputs=list(output_units(system)),
        **options,
    )  # fmt: skip


def nonlinear(found, loads, x, u):
    """Return x' and the outputs by the equations of motion at a small state."""
    system, k = found.system, len(found.A) // 2
    guide, Z = system.mechanism, found.space.modes.shape
    held = dict(found.contacts)
    stops = [stop.name in held for stop in guide.stops]
    state = ContactState(
        tuple(_mode(held.get(one.name), one in guide.frictions)
              for one in (*guide.stops, *guide.frictions)), len(stops),
    )  # fmt: skip
    given = {f"{f.name}.{what}": 0.0 for f in guide.forces for what in ("x", "y", "moment")}
    given |= {"base.acceleration.x": 0.0, "base.acceleration.y": 0.0}
    given |= {f"{stop.name}.mobility": 0.0 for stop in guide.stops} | loads
    for name, change in zip(found.inputs, u, strict=True):
        given[name] += change
    walls = tuple(Wall(value(stop, "position", system.values)) for stop in guide.stops)
    omega = 2 * math.pi * fundamental_frequency(system)
    equations = Equations(system, Inputs.of(guide, given, walls), state, omega)
    q, v = found.shape.q + Z @ x[:k], Z @ x[k:]
    r = equations.first_stick
    q, e = constraints.project_positions(system, equations.positions, q, equations.rows.c[:r])
    rows = equations.rows.jacobian(e)
    v = constraints.project_velocities(
        system.mass_matrix(e), rows, np.zeros(len(rows)), v, system.length
    )
    evaluation = equations.evaluate(0.0, q, v)
    force, moment = base_reaction(equations, q, v, evaluation.a)
    out = {"base.force.x": force.real, "base.force.y": force.imag, "base.moment": moment}
    for name, frame in [*system.bodies.items(), *((p.name, p) for p in system.probes)]:
        place, speed = system.motion(frame, e, v)
        out |= {f"{name}.x": place.real, f"{name}.y": place.imag}
        out |= {f"{name}.vx": speed.real, f"{name}.vy": speed.imag}
        if frame.j >= 0:
            out |= {f"{name}.angle": q[frame.j], f"{name}.omega": v[frame.j]}
    pressed = iter(evaluation.lam[equations.first_hold :])
    gaps, rates = system.gap_rows.values(e), system.gap_rows.rates(e, v)
    for i, stop in enumerate(guide.stops):
        out |= {f"{stop.name}.gap": gaps[i], f"{stop.name}.gap_rate": rates[i]}
        out[f"{stop.name}.force"] = next(pressed) if stops[i] else 0.0
    rates = Z.T @ found.space.modes.M @ evaluation.a
    return np.concatenate([x[k:], rates]), np.array([out[name] for name in found.outputs])


def _mode(how, rubs):
    if how == "sticking":
        return ContactMode.STICK
    return ContactMode.FRICTIONLESS if rubs or how == "held" else ContactMode.OPEN


def assert_tangent(found, loads=None):
    """Compare the matrices with central differences of the equations of motion."""
    size = len(found.A)
    columns = np.hstack([np.vstack([found.A, found.C]), np.vstack([found.B, found.D])])
    turns = np.abs(found.space.modes.shape).max(axis=0)  # rad by unit amplitude
    still, _ = nonlinear(found, loads or {}, np.zeros(size), np.zeros(len(found.inputs)))
    bent = np.abs(found.A @ np.append(1 / turns, np.zeros(size // 2)))  # By one radian.
    assert np.abs(still).max() <= 1e-8 * bent.max()
    for k in range(columns.shape[1]):
        h = 1e-5 / turns[k % (size // 2)] if k < size else 1e-3
        state = np.zeros(columns.shape[1])
        ends = []
        for sign in (1.0, -1.0):
            state[k] = sign * h
            ends.append(np.concatenate(nonlinear(found, loads or {}, state[:size], state[size:])))
        slope = (ends[0] - ends[1]) / (2 * h)
        scale = np.abs(columns[:, k]).max()
        assert slope == pytest.approx(columns[:, k], rel=1e-4, abs=1e-5 * scale), k


@each_shipped
def test_the_matrices_are_the_tangent_of_the_equations_of_motion(model):
    assert_tangent(complete(model, {"damping.zeta": 0.05}))


@pytest.mark.parametrize(
    "values", [DAMPED, DAMPED | {"stop.friction": 0.3}], ids=["frictionless", "sticking"]
)
def test_the_matrices_of_a_resting_contact_are_the_tangent(values):
    """The flexures are bent: equations of straight, inextensible ones are singular."""
    loads = {"force.x": 0.4, "force.y": -0.3}
    found = complete("PRBDM2R", values | {"stop.position": 5e-3}, loads=loads, resting=["stop"])
    assert found.contacts == (("stop", "sticking" if "stop.friction" in values else "held"),)
    assert_tangent(found, loads)


def test_the_matrices_with_a_sticking_friction_point_are_the_tangent():
    """At the stop it does not stick: the shuttle is held along its direction there."""
    found = complete("PRBDM2R", DAMPED | STICKING)
    assert found.contacts == (("friction", "sticking"),)
    assert_tangent(found)


@each_shipped
def test_the_static_limit_is_the_compliance(model):
    """The response at a hundred millionth of the first frequency equals the compliance."""
    guide = mechanism(model)
    force = guide.forces[0]
    names = [f"{force.name}.{what}" for what in ("x", "y", "moment")]
    found = prbm.linearize(
        guide, inputs=names, outputs=[f"{force.body}.{what}" for what in ("x", "y", "angle")]
    )
    at = None if force.point is None else "body"
    if at or found.space.modes.frequency[0] <= found.space.modes.rounding:
        pytest.skip("the load does not act at the centre of mass, or a motion is free")
    C = prbm.equilibrium(guide).compliance(force.body)
    G = found.response([1e-8 * found.space.modes.frequency[0]])[0]
    assert G.real == pytest.approx(C, rel=1e-6, abs=1e-9 * np.abs(C).max())


def test_peak_and_bandwidth_of_one_degree_of_freedom_are_closed_forms():
    """The 1R guide without gravity is an oscillator with damping ratio zeta."""
    zeta = 0.2
    values = {"gravity.x": 0.0, "gravity.y": 0.0, "damping.zeta": zeta, "damping.beta": 0.0}
    found = prbm.linearize(mechanism("PRBDM"), values, inputs=["force.x"], outputs=["shuttle.x"])
    natural = found.space.modes.frequency[0]
    grid = found.frequencies(*found.default_range())
    one = found.measures(grid, found.response(grid))["shuttle.x", "force.x"]
    assert one.peak == pytest.approx(one.static / (2 * zeta * math.sqrt(1 - zeta**2)), rel=1e-9)
    assert one.peak_frequency == pytest.approx(natural * math.sqrt(1 - 2 * zeta**2), rel=1e-6)
    part = 1 - 2 * zeta**2
    limit = natural * math.sqrt(part + math.sqrt(part**2 + 1))
    assert one.bandwidth == pytest.approx(limit, rel=1e-9)
    assert abs(found.poles[0]) == pytest.approx(2 * math.pi * natural)
    assert -found.poles[0].real / abs(found.poles[0]) == pytest.approx(zeta)


def test_files_and_python_control_have_the_matrices():
    found = prbm.linearize(
        mechanism("PRBDM2R"), DAMPED, inputs=["force.x"], outputs=["shuttle.x", "base.force.x"]
    )
    with np.load(io.BytesIO(found.npz())) as npz:
        assert npz["outputs"].tolist() == ["shuttle.x", "base.force.x"]
        assert npz["output_units"].tolist() == ["m", "N"]
        assert all(np.array_equal(npz[name], getattr(found, name)) for name in "ABCD")
    mat = loadmat(io.BytesIO(found.mat()), simplify_cells=True)
    assert list(mat["outputs"]) == ["shuttle.x", "base.force.x"]
    assert all(np.array_equal(np.atleast_2d(mat[x]), getattr(found, x).squeeze()[None])
               or np.array_equal(mat[x], getattr(found, x).squeeze()) for x in "ABCD")  # fmt: skip
    pytest.importorskip("control")
    model = found.control()
    assert model.input_labels == ["force_x"]
    f = 3.0
    assert np.ravel(model(2j * math.pi * f)) == pytest.approx(np.ravel(found.response([f])))


def test_unknown_names_and_impossible_contacts_are_rejected():
    guide = mechanism("PRBDM2R")
    with pytest.raises(ParameterError, match=r"did you mean force\.x"):
        prbm.linearize(guide, inputs=["forc.x"], outputs=["shuttle.x"])
    with pytest.raises(ParameterError, match="no output of a linear model: unknown variable"):
        prbm.linearize(guide, inputs=["force.x"], outputs=["energy.kinetic"])
    with pytest.raises(ParameterError, match="has no stop wall"):
        prbm.linearize(guide, inputs=["force.x"], outputs=["shuttle.x"], resting=["wall"])
    with pytest.raises(EquilibriumError, match="stop is not reached"):
        prbm.linearize(
            guide, {"stop.position": 0.015}, inputs=["force.x"], outputs=["shuttle.x"],
            resting=["stop"],
        )  # fmt: skip


@pytest.mark.fmu
@pytest.mark.slow
@pytest.mark.parametrize("ratio", [0.5, 1.0, 3.0])
def test_an_fmu_driven_by_a_sine_has_the_response_of_the_linear_model(ratio, native):
    """Amplitude and phase agree within 1 %, below, at and above resonance.

    An input is constant in a communication step; it has the value at the middle of the step.
    """
    guide, driven, seen = mechanism("GuideBeam"), "base.acceleration.x", ("shuttle.x", "shuttle.y")
    values = {"damping.zeta": 0.1, "stop.position": 0.03}
    found = prbm.linearize(guide, values, inputs=[driven], outputs=seen)
    frequency = ratio * float(found.space.modes.frequency[0])
    rest = found.system.amount(found.shape.q)
    step, periods = 1 / (400 * frequency), 12 + 12 * ratio
    times = np.arange(0.0, periods / frequency, step)
    rows = [(t, 0.02 * math.sin(2 * math.pi * frequency * (t + 0.5 * step))) for t in times]
    result = simulate_fmu(
        str(native["GuideBeam", 2]), stop_time=float(times[-1]), output_interval=step,
        start_values=values | {"release.displacement": rest}, output=seen,
        input=np.array(rows, [("time", float), (driven, float)]),
    )  # fmt: skip
    late = result["time"] > times[-1] - 4 / frequency
    wave = 2 * math.pi * frequency * result["time"][late]
    basis = np.column_stack([np.sin(wave), np.cos(wave), np.ones_like(wave)])
    for name, expected in zip(seen, found.response([frequency])[0][:, 0], strict=True):
        part = np.linalg.lstsq(basis, result[name][late], rcond=None)[0]
        assert complex(part[0], part[1]) / 0.02 == pytest.approx(expected, rel=0.01)
