"""Beams: the elastica, frequencies, finite elements, and rejected orders."""

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.polynomial.legendre import leggauss
from scipy.integrate import quad, solve_bvp

from prbm.base.errors import MechanismError
from prbm.hybrid.simulation import Simulation
from prbm.mechanics.assembly import assemble
from prbm.mechanics.beam import Beam, Material
from prbm.mechanics.modal import modes
from prbm.mechanics.profile import Line, Straight
from prbm.mechanics.statics import equilibrium
from prbm.mechanism.description import Mechanism
from prbm.mechanism.parts import Body, Flexure, FlexureType, Force, Release
from prbm.references.beams import end_force, end_moment
from support import mechanism

L, EI, EA = 0.1, 2e11 * 1e-2 * 5e-4**3 / 12, 2e11 * 1e-2 * 5e-4
MASS = 7800.0 * 1e-2 * 5e-4 * L


def leaf(order, nodes=None, *, axial=False):
    return FlexureType(
        "leaf", "beam", 5e-4, 1e-2, 2e11, 7800.0, order=order, nodes=nodes, axial=axial
    )


def cantilever(kind, ends=("clamp", "free"), *, backwards=False, mass=1e-8, inertia=1e-8):
    """Return a cantilever along +x with a body at its tip, in units of its mass and length."""
    points = ("ground.clamp", "tip.end")
    description = Mechanism(
        name="Cantilever",
        title="A beam, clamped at one end",
        ground={"clamp": (0.0, 0.0)},
        bodies=(Body("tip", mass * MASS, inertia * MASS * L**2, (L, 0.0), {"end": (L, 0.0)}),),
        flexure_types=(kind,),
        flexures=(
            Flexure("beam", "leaf", *(points[::-1] if backwards else points),
                    ends[::-1] if backwards else ends),
        ),
        forces=(Force("force", "tip"),),
        release=Release("tip", direction=90.0),
    )  # fmt: skip
    return assemble(description, description.values())


def tip(system, force=0j, moment=0.0):
    """Return the position [L] and the slope of the tip under scaled loads."""
    scaled = force * EI / L**2
    loads = {"force.x": scaled.real, "force.y": scaled.imag, "force.moment": moment * EI / L}
    shape = equilibrium(system, loads=loads)
    frame = system.bodies["tip"]
    z = complex(frame.A @ system.directions(shape.q)) + frame.c
    return z / L, float(shape.q[frame.j])


def elastica(force, moment):
    """Return the tip of the elastica under dead loads, theta'' = -Im(conj(e) F), by collocation."""
    s = np.linspace(0.0, 1.0, 60)
    y = np.array([0.0 * s, 0.0 * s, s, 0.0 * s])
    for fraction in np.linspace(0.1, 1.0, 10):

        def change(_, y, F=fraction * force):
            e = np.exp(1j * y[0])
            return np.array([y[1], -(F * e.conj()).imag, e.real, e.imag])

        def ends(start, end, M=fraction * moment):
            return np.array([start[0], start[2], start[3], end[1] - M])

        found = solve_bvp(change, ends, s, y, tol=1e-10, max_nodes=100_000)
        assert found.success
        y = found.sol(s)
    return complex(y[2, -1], y[3, -1]), y[0, -1]


@pytest.mark.parametrize(("load", "limit"), [(1.0, 4e-6), (8.0, 7e-4)])
def test_an_end_force_bends_a_beam_of_order_2_like_the_elastica(load, limit):
    z, slope = tip(cantilever(leaf(2, 5)), force=1j * load)
    exact = end_force(load)
    assert abs(z - exact.z) < limit * abs(exact.z - 1)
    assert slope == pytest.approx(exact.slope, rel=5 * limit)


def test_an_end_moment_bends_a_beam_into_a_circle():
    """The curvature is exact; the error is that of the interpolated directions."""
    z, slope = tip(cantilever(leaf(2, 5)), moment=math.pi)
    assert slope == pytest.approx(math.pi, abs=1e-9)
    assert abs(z - end_moment(math.pi).z) < 4e-7 * abs(z - 1)


@pytest.mark.parametrize(
    ("force", "moment"), [(20j, 0.0), (3 - 4j, 1.0), (-2 + 0.5j, 0.0), (10 + 10j, -3.0)]
)
def test_beams_converge_with_the_order_to_the_elastica(force, moment):
    exact, angle = elastica(force, moment)
    errors = []
    for order in (1, 2, 3, 4, 5, 6):
        z, slope = tip(cantilever(leaf(order, order + 6)), force, moment)
        errors.append(max(abs(z - exact), abs(slope - angle)))
    assert errors[2] < 2e-2 * errors[0] + 1e-3
    assert errors[5] < 1e-4
    assert all(later < 0.7 * earlier for earlier, later in zip(errors, errors[2:], strict=False))


def test_a_beam_is_the_same_from_either_end():
    systems = [
        cantilever(leaf(4, axial=True), backwards=backwards, mass=0.5, inertia=0.1)
        for backwards in (False, True)
    ]
    tips = [tip(system, 1j - 0.5)[0] for system in systems]
    assert tips[0] == pytest.approx(tips[1], abs=1e-12)
    load = {"force.y": EI / L**2, "force.x": -0.5 * EI / L**2}
    found = [modes(system, equilibrium(system, loads=load)).frequency for system in systems]
    np.testing.assert_allclose(*found, rtol=1e-9)


@pytest.mark.parametrize(("mode", "wavenumber"), [(0, 1.8751040687), (1, 4.6940911330)])
def test_frequencies_of_a_cantilever_are_those_of_the_beam(mode, wavenumber):
    system = cantilever(leaf(5), mass=1e-9, inertia=1e-12)
    exact = wavenumber**2 * math.sqrt(EI / (MASS * L**3)) / (2 * math.pi)
    assert modes(system, equilibrium(system)).frequency[mode] == pytest.approx(exact, rel=1e-4)


def test_positions_are_integrals_of_the_directions():
    """Polynomials up to the order nodes - 1 are interpolated exactly."""
    beam = Beam(3, (Straight(6, 0.0, 0.7, (0.1, 0.1), (2.0, 2.0)),), Line(0.7), Material(1.0, 3.0))
    x = np.linspace(-1.0, 1.0, 7)
    nodes = leggauss(6)[0]
    for power in range(6):
        found = beam.positions([x]) @ nodes**power
        exact = [0.35 * quad(lambda u, k=power: u**k, -1.0, end)[0] for end in x]
        np.testing.assert_allclose(found, exact, atol=1e-14)
    assert beam.masses.sum() == pytest.approx(0.42)


def guide(order, nodes, *, axial=False):
    thesis = mechanism("PRBDM2R")
    kinds = (
        replace(k, model="beam", order=order, nodes=nodes, axial=axial, coefficients={})
        for k in thesis.flexure_types
    )
    return replace(thesis, flexure_types=tuple(kinds))


def rest_and_frequencies(description):
    system = assemble(description, description.values())
    shape = equilibrium(system)
    return np.array([1e3 * system.amount(shape.q), *modes(system, shape).frequency[:5]])


ELEMENTS = np.array([10.72056, 4.90654, 130.647, 209.846, 302.051, 327.649])  # mm, Hz


@pytest.mark.parametrize(
    ("order", "nodes", "axial", "limits"),
    [
        (3, 5, False, (3e-5, 1e-4, 0.0055, 0.0055, 0.0042, 0.0025)),
        (3, 8, True, (2e-6, 1e-5, 6e-5, 8e-5, 0.0044, 0.002)),
        (6, 8, True, (1e-6, 2e-6, 1e-5, 1e-5, 1e-5, 1e-5)),
    ],
)
def test_the_guide_has_the_rest_position_and_frequencies_of_finite_elements(
    order, nodes, axial, limits
):
    found = rest_and_frequencies(guide(order, nodes, axial=axial))
    assert (abs(found / ELEMENTS - 1.0) <= limits).all(), abs(found / ELEMENTS - 1.0)


@pytest.mark.parametrize("axial", [False, True])
def test_energy_is_constant_through_impacts_and_gravity_stands_on_the_base(axial):
    description = guide(3, 5, axial=axial)
    stretches = {"release.displacement": -0.004} if axial else {}
    simulation = Simulation(description, {**stretches, "damping.beta": 1e-5})
    kinds = ("kinetic", "elastic", "gravitational", "dissipated")

    def total():
        out = simulation.outputs()
        return sum(out[f"energy.{kind}"] for kind in kinds) - out["energy.work"]

    start = total()
    for _ in range(4):
        simulation.advance(simulation.time + 0.02)
        assert total() == pytest.approx(start, abs=2e-6 * abs(start) + 1e-9)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"order": 0}, "leaf.order = 0 must lie between 1 and 12"),
        ({"order": 50}, "leaf.order = 50 must lie between 1 and 12"),
        ({"order": 3, "nodes": 4}, "leaf.nodes = 4 must lie between 5"),
        ({"order": 3, "n": 2}, "leaf.n = 2"),
        ({"order": 3, "model": "2R"}, "only the model beam has it"),
    ],
)
def test_orders_and_nodes_out_of_bounds_are_rejected(changes, words):
    with pytest.raises(MechanismError) as error:
        cantilever(replace(leaf(3), **changes))
    assert words in str(error.value)


def test_an_order_that_locks_between_two_clamps_is_rejected():
    with pytest.raises(MechanismError, match="too stiff with an order below 3"):
        guide(2, 5)
    guide(2, 5, axial=True)
