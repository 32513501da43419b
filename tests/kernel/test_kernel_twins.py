"""Functions of the C kernel and of the engine agree on random states and parameters.

Each test names the functions that it compares.  The last tests find all functions that exist in
both under one name, print the pairs, and fail if a pair is not compared.  The tolerance is 1e-12 of
the largest entry; a comment gives the reason for any other tolerance.
"""

import ctypes
import functools
import importlib
import inspect
import itertools
import math
import re
from dataclasses import astuple, replace

import numpy as np
import pytest

import prbm.interface.tables
import sizes
from free_bodies import double_pendulum, flying, with_start
from guides import beaded, incline, slider_crank
from kernel_library import (
    KERNEL,
    KernelError,
    KernelSystem,
    array,
    constants,
    coulomb_laws,
    kernel,
    placed,
    prototypes,
    structures,
)
from many_parts import beams, elastic, five_nodes, late_beam, links_and_beams, profiles, rich
from prbm.base import tolerances
from prbm.base.errors import EquilibriumError, MechanismError, ParameterError, SimulationError
from prbm.files.mechanism_file import read_mechanism
from prbm.hybrid import runge_kutta
from prbm.mechanics import (
    assembly,
    beam,
    complementarity,
    compliance,
    constraints,
    contact,
    direction_map,
    dynamics,
    elements,
    forces,
    kinetics,
    modal,
    positions,
    profile,
    statics,
    stress,
)
from prbm.mechanics import inputs as input_data
from prbm.mechanics import start as starts
from prbm.mechanics import system as system_arrays
from prbm.mechanics.contact_state import (
    ContactMode,
    ContactPhase,
    ContactState,
    Phase,
    SpringPhase,
)
from prbm.mechanism import flexure
from prbm.mechanism.description import Mechanism
from prbm.mechanism.expressions import Affine
from prbm.mechanism.parameters import Parameter
from prbm.mechanism.parts import POSITIONS, FlexureType, Release
from springs import one_sided, oscillator, web
from support import ROOT, SHIPPED, SUPPORT, mechanism

TWINS = {}


def twin(**pairs):
    """Register the pairs of functions of the kernel and of the package that a test compares."""

    def decorated(test):
        @functools.wraps(test)
        def checked(*arguments, **keywords):
            kernel().called.clear()
            test(*arguments, **keywords)
            assert pairs.keys() <= kernel().called, "a function was not called"

        assert not pairs.keys() & TWINS.keys()
        TWINS.update(pairs)
        return checked

    return decorated


def assert_same(found, expected, rel=1e-12, scale=0.0):
    """Compare arrays or numbers, relative to the largest entry."""
    found, expected = np.asarray(found), np.asarray(expected)
    assert found.shape == expected.shape
    size = max(float(np.abs(expected).max(initial=0.0)), scale)
    assert float(np.abs(found - expected).max(initial=0.0)) <= rel * size


def message_of(error, function, *arguments):
    """Return the message of the error that a function raises."""
    with pytest.raises(error) as caught:
        function(*arguments)
    return str(caught.value)


def outcome(function, *arguments):
    """Return the result of a function, or the message of its error."""
    try:
        return function(*arguments)
    except (KernelError, ParameterError) as error:
        return str(error)


def spread(condition):
    """Return the relative tolerance of a solution of equations with a condition number."""
    return max(4e-12, 50 * 2.2e-16 * condition)  # The loads are sums of up to 100 terms.


# --- mechanisms, parameters, states --------------------------------------------------------------


NAMES = ("PRBDM", "PRBDM2R", "Rich", "Elastic", "Beams", "Mixed", "Beaded")
OWN_MECHANISMS = {
    "Rich": rich, "Elastic": elastic, "Beams": beams, "Mixed": links_and_beams,
    "Profiles": profiles, "LateBeam": late_beam, "FiveNodes": five_nodes, "Beaded": beaded,
}  # fmt: skip


def soft():
    """Return a mechanism whose first stop is compliant."""
    own = rich()
    first = replace(own.stops[0], law="compliant", stiffness=1e6, exponent=1.5)
    return replace(own, stops=(first, *own.stops[1:]))


def described(name):
    if name == "Soft":
        return soft()
    if name == "Pivot":
        return read_mechanism(SUPPORT / "pivot.toml")
    return OWN_MECHANISMS[name]() if name in OWN_MECHANISMS else mechanism(name)


@functools.cache
def both(name):
    """Return a mechanism and its system in the kernel."""
    guide = described(name)
    system = assembly.assemble(guide, guide.values())
    return guide, KernelSystem(guide, system.n - len(system.loops))


def varied(guide, rng):
    """Return parameters that differ from the defaults by up to a few per cent."""
    values = guide.values()
    for p in guide.parameters:
        if p.name == "solver.tolerance":
            continue
        x = values[p.name] * (1.0 + 0.04 * rng.uniform(-1, 1))
        x += (p.name.endswith("friction") or p.name.endswith("zeta")) * 0.1 * rng.uniform()
        values[p.name] = min(max(x, p.minimum), p.maximum)
    # The sum of the gammas must not exceed one.
    return guide.values({k: v for k, v in values.items() if ".gamma" not in k or v < 0.9})


@functools.cache
def variant(name, k, seed):
    """Return the k-th parameters of a mechanism, the defaults first, and their system."""
    guide, _ = both(name)
    values = varied(guide, np.random.default_rng([seed, k])) if k else guide.values()
    return values, assembly.assemble(guide, values)


def systems(name, count=4, seed=0):
    """Yield the system of the package, that of the kernel, and a generator of random numbers."""
    rng = np.random.default_rng(seed)
    _, ours = both(name)
    for k in range(count):
        values, system = variant(name, k, seed)
        ours.assemble(values)
        yield system, ours, rng


def random_state(system, rng, turn=0.3):
    return system.q0 + turn * rng.normal(size=system.n), 3.0 * rng.normal(size=system.n)


SHAPES = {}  # System and angles by id and displacement; a kept system keeps its id.


def displaced(system, x):
    """Return the angles at a displacement, computed once for each system."""
    key = id(system), x
    if key not in SHAPES:
        SHAPES[key] = system, statics.equilibrium(system, x).q
    return SHAPES[key][1]


def bent(system, rng):
    """Return angles near a bent shape, from which the loops can be closed in every direction."""
    x = float(rng.choice([-4e-3, -2e-3, 1e-3, 3e-3]))
    return displaced(system, x) + 3e-4 * rng.normal(size=system.n)


def near_loops(system, rng):
    """Return angles at which the loops are closed."""
    loops = system.loop_rows
    return constraints.project_positions(system, loops, bent(system, rng), loops.c)[0]


each_mechanism = pytest.mark.parametrize("name", [*SHIPPED, *OWN_MECHANISMS])


# --- mechanism.c, flexure.c ----------------------------------------------------------------------


@twin(evaluate=Affine.__call__)
def test_values_of_expressions_are_the_same():
    rng = np.random.default_rng(0)
    for count in range(4):
        x, factors = rng.normal(size=8), rng.normal(size=count)
        places = rng.permutation(8)[:count].astype(np.int32)
        expression = structures()["Expression"](0.5, count, places.ctypes.data, factors.ctypes.data)
        terms = {str(i): f for i, f in zip(places, factors, strict=True)}
        expected = Affine(0.5, terms)({str(i): value for i, value in enumerate(x)})
        assert_same(kernel().evaluate(expression, x), expected)


@twin(check_parameter=Parameter.check)
def test_messages_about_invalid_parameters_are_the_same():
    for name in NAMES:
        guide, ours = both(name)
        kind = structures()["Parameter"]
        for i, p in enumerate(guide.parameters):
            parameter = ours.mechanism.parameters + i * ctypes.sizeof(kind)
            assert kernel().check_parameter(parameter, p.value)
            bad = [p.minimum - abs(p.minimum) - 1.0, 2.0 * p.maximum + 1.0, math.nan, -math.inf]
            for x in bad:
                message = message_of(KernelError, kernel().check_parameter, parameter, x)
                assert message == message_of(ParameterError, p.check, x)


@twin(check_values=Mechanism.values)
def test_checks_of_values_and_of_dependent_expressions_are_the_same():
    guide, ours = both("Rich")
    names = [p.name for p in guide.parameters]
    for name, x in (("L", 0.05), ("L", 1e9), ("L", 600.0), ("L", 1e-8), ("high.friction", -0.1)):
        values = np.array(list(guide.values().values()))
        values[names.index(name)] = x
        expected = outcome(guide.values, {name: x})
        found = outcome(kernel().check_values, ours.address, values)
        assert (found is True) or found == expected
        assert (found is True) == isinstance(expected, dict)


@twin(stub=flexure.stub)
def test_stubs_and_messages_about_too_long_links_are_the_same():
    rng = np.random.default_rng(0)
    for count in (1, 2, 3):
        for _ in range(50):
            gamma, found = rng.uniform(0.0, 2.0 / count, count), np.zeros(1)
            expected = outcome(flexure.stub, gamma.tolist())
            message = outcome(kernel().stub, count, gamma, found)
            if isinstance(expected, str):
                assert message == expected
            else:
                assert_same(found[0], expected, scale=1.0)


@twin(node_count=Mechanism.node_count)
def test_numbers_of_nodes_of_beams_are_the_same():
    found = set()
    for name in ("Beams", "Profiles"):
        guide, ours = both(name)
        for i, kind in enumerate(guide.flexure_types):
            if kind.model == flexure.BEAM:
                own = ours.mechanism.types + i * ctypes.sizeof(structures()["FlexureType"])
                assert kernel().node_count(own) == guide.node_count(kind)
                found.add((kind.profile, kind.hinge))
    assert {(flexure.LEAF, False), (flexure.NOTCH, False), (flexure.NOTCH, True)} <= found


ENDS = [
    (start, end)
    for start in flexure.ENDS
    for end in flexure.ENDS
    if flexure.CLAMP in (start, end) or flexure.FREE not in (start, end)
]


@twin(segments=flexure.segments, reversed=flexure.Segments.reversed)
@pytest.mark.parametrize("ends", ENDS)
@pytest.mark.parametrize("links", [1, 4])
@pytest.mark.parametrize("name", [name for name in flexure.MODELS if name != flexure.BEAM])
def test_segments_of_flexures_are_the_same(name, links, ends):
    rng = np.random.default_rng(0)
    model = replace(flexure.MODELS[name], links=links if name == "nR" else 0)
    pivots = len(model.gamma)
    kind = structures()["FlexureType"](
        lumped=model.lumped, rate_with_gamma=model.rate_with_gamma, pivots=pivots,
        links=model.links, axial=True,
    )  # fmt: skip
    held = [flexure.ENDS.index(end) for end in ends]
    count = kernel().links_of(kind, *held)
    for _ in range(20):
        gamma, K_theta = rng.uniform(0.05, 1.0 / max(pivots, 1), pivots), rng.uniform(1, 4, pivots)
        L, EI, mass, EA = np.exp(rng.normal(size=4))
        room = np.full((5, count + 2), np.nan)
        found = structures()["Segments"](0, *(row.ctypes.data for row in room))
        kernel().segments(kind, gamma, K_theta, *held, L, EI, mass, EA, found)
        expected = flexure.segments(model, gamma, K_theta, ends, L, EI, mass, EA)
        for same in (expected, expected.reversed()):
            assert found.n == count == len(same.lengths) - 2
            for row, wanted in zip(room, vars(same).values(), strict=True):
                assert_same(row[: len(wanted)], wanted)
            kernel().reversed(found)
        stretching = [kernel().stretches(kind, held[0], i, count) for i in range(count)]
        assert stretching == [stiffness > 0.0 for stiffness in expected.axial]
    long, rest = np.full(pivots, 1.2), (1.0, 1.0, 1.0, 0.0)
    if pivots and ends != (flexure.PIN, flexure.PIN):
        message = message_of(KernelError, kernel().segments, kind, long, long, *held, *rest, found)
        assert message == message_of(
            ParameterError, flexure.segments, model, long, long, ends, *rest
        )


# --- assembly.c ----------------------------------------------------------------------------------


@twin(unit=system_arrays.unit)
def test_unit_vectors_are_exact_along_the_axes():
    for degrees in (*range(-720, 721, 90), *np.random.default_rng(0).uniform(-720, 720, 200)):
        found, expected = kernel().unit(float(degrees)), system_arrays.unit(float(degrees))
        if degrees % 90 == 0:
            assert found == expected
        assert_same(found, expected)


@twin(
    integrals=beam.integrals,
    interpolation=beam.interpolation,
    orthogonal=beam.orthogonal,
)
def test_beams_are_the_same():
    for order, nodes in ((1, 3), (3, 6), (7, 10), (12, 24)):
        for x in (-1.0, -0.3, 0.5, 1.0):
            S = np.zeros(order + 1)
            kernel().integrals(order, x, S)
            assert_same(S, beam.integrals(order, np.array([x]))[0])
            lengths = np.zeros(nodes)
            kernel().interpolation(nodes, x, lengths)
            assert_same(lengths, beam.interpolation(nodes, np.array([x]))[0], scale=1.0)
        x, weights = np.zeros((2, nodes))
        kernel().gauss(nodes, x, weights)
        exact = np.polynomial.legendre.leggauss(nodes)
        assert_same(x, exact[0])
        assert_same(weights, exact[1])
        peak = weights / (0.02 + x * x) ** 3
        P = np.zeros((nodes, order + 1))
        kernel().orthogonal(nodes, order, x, peak / peak.sum(), P)
        assert_same(P, beam.orthogonal(order, x, peak / peak.sum()), 1e-9)


@twin(concentration=profile.concentration)
def test_factors_of_the_stress_at_waists_agree() -> None:
    pulled, bent = np.zeros(1), np.zeros(1)
    for ratio in (1e-9, 9e-4, 0.1, 1.0, 30.0):
        kernel().concentration(ratio, 1.0, pulled, bent)
        expected = profile.concentration(ratio, 1.0)
        assert (pulled[0], bent[0]) == pytest.approx(expected, rel=1e-9)  # Differences at 9e-4.


@twin(
    notch_panels=profile.notch_panels,
    tangent=profile.Line.tangent,
    position=profile.Line.position,
)
def test_panels_and_lines_are_the_same():
    shapes = [(1e-3, 8e-3, (4e-3, 2e-3), H, w) for H in (5e-3, 3e-3, 9e-3) for w in (None, 6e-3)]
    for shape in shapes:
        notch = profile.Notch(*shape)
        # As long as the flexure, apart from round-off, or shorter.
        L = math.nextafter(notch.length, 0.0) if shape[3] == 3e-3 else 0.02
        ours = structures()["Notch"](
            *shape[:2], *shape[2], shape[3], shape[4] or 0.0, bool(shape[4])
        )
        expected = profile.notch_panels("neck", notch, L, 7)
        panels = (structures()["Panel"] * len(expected))()
        kernel().notch_panels(b"neck", ours, L, 7, ctypes.addressof(panels))
        for panel, other in zip(panels, expected, strict=True):
            assert panel.nodes == other.nodes
            for x in (-1.0, -0.4, 0.0, 1.0):
                section = kernel().section_at(panel, x)
                found = [section.v, section.dv, section.thickness, section.width]
                assert_same(found, np.ravel(other.at(np.array([x]))))
    for line in (profile.Line(0.1), profile.Line(0.1, 12.0), profile.Line(0.1, 0.0, -0.02)):
        ours = structures()["Line"](line.chord, line.curvature, line.rise)
        assert kernel().line_length(ours) == pytest.approx(line.length, rel=1e-14)
        for v in (0.0, 0.3, 1.0):
            x = v * line.length
            assert_same(kernel().tangent(ours, x), line.tangent(np.array([x]))[0])
            assert_same(kernel().position(ours, x), line.position(np.array([x]))[0])


@twin(
    to_coordinates=direction_map.DirectionMap.to_coordinates,
    mass_matrix=system_arrays.System.mass_matrix,
)
@each_mechanism
def test_the_map_to_the_directions_is_the_same(name):
    for system, ours, rng in systems(name):
        n, x = system.n, rng.normal(size=system.d)
        found = np.zeros(n)
        for j in range(system.d):
            kernel().to_coordinates(ours.structure, j, x[j], found)
        assert_same(found, system.Phi.to_coordinates(x))
        q, _ = random_state(system, rng)
        e, M = system.directions(q), np.full((n, n), np.nan)
        kernel().mass_matrix(ours.structure, e, M)
        assert_same(M, system.mass_matrix(e))


REALS = ("q0", "J", "K", "loops_c", "gaps_c", "lifts_c", "release_c", "length", "m")
COMPLEXES = (
    "H", "A", "c", "S", "loops", "gaps", "gaps_z", "slides", "slides_z", "rubs", "rubs_z", "lifts",
)  # fmt: skip


def outside(blocks, matrix):
    """Return the magnitudes of the elements outside of the blocks on the diagonal."""
    result = np.abs(matrix)
    for start, size in blocks:
        result[start : start + size, start : start + size] = 0.0
    return result


@twin(assemble=assembly.assemble)
@each_mechanism
def test_the_arrays_of_a_mechanism_are_the_same(name):
    for system, ours, rng in systems(name):
        for field in (*REALS, *COMPLEXES, "release", "anchor", "gravity"):
            size = system.length if field.endswith(("_c", "c", "_z", "anchor")) else 0.0
            assert_same(getattr(ours, field), getattr(system, field), scale=size)
        assert ours.links().tolist() == list(system.links)
        assert_same(ours.map(), system.Phi.Phi)
        for field in ("arm", "on", "stretches", "strains", "rubs_on", "normals"):
            found = getattr(ours, field)
            found = found() if callable(found) else found
            assert found.tolist() == getattr(system, field).tolist()
        groups = {"bodies": system.bodies.values(), "pushed": system.pushed}
        for group, frames in (groups | {"probes": system.probes}).items():
            for i, frame in enumerate(frames):
                j, arm, c, drawn, A = ours.frame(group, i)
                assert (j, arm) == (frame.j, frame.arm)
                assert_same([c, drawn], [frame.c, frame.drawn], scale=system.length)
                assert_same(A, frame.A)
        known = assembly.calculated(system.mechanism, system.values)
        assert_same(array(ours.calculated, len(known)), list(known.values()), scale=1.0)
        assert not outside(ours.blocks(), system.H).any()
        e = system.directions(random_state(system, rng)[0])
        M = system.mass_matrix(e)
        assert not outside(ours.mass_blocks()[:, :2], M).any()
        for start, size, _split in ours.mass_blocks():
            for i in range(start, start + size):
                assert not M[i, start + ours.last()[i] + 1 :].any()


def test_the_size_of_a_mechanism_with_all_centres_at_one_point_is_the_same():
    guide = mechanism("Cantilever")
    (root,), (tip,) = guide.ground.values(), guide.bodies
    balanced = replace(guide, bodies=(replace(tip, centre=root),))
    system = assembly.assemble(balanced, balanced.values())
    ours = KernelSystem(balanced, system.n)
    ours.assemble(balanced.values())
    assert_same(ours.length, system.length)
    assert system.length > 0.0


@pytest.mark.parametrize(
    "change",
    [
        {"L": 1e-12},
        {"leaf.density": 0.0, "thin.density": 0.0},
        {"leaf.gamma1": 0.9, "leaf.gamma2": 0.9},
    ],
)
def test_messages_about_failures_of_the_assembly_are_the_same(change):
    """A length is tiny, a mass is zero, links are too long.

    The message of the kernel does not name the ends of a flexure.
    """
    guide, ours = both("Rich")
    values = guide.values() | change
    message = message_of(ParameterError, assembly.assemble, guide, values)
    assert message_of(KernelError, ours.assemble, values) == re.sub(
        " from .* to [^ ]*", "", message
    )


def refused(guide, count):
    """Return the messages of package and kernel about a mechanism that cannot be assembled."""
    with pytest.MonkeyPatch.context() as patch:  # These functions would assemble the mechanism.
        patch.setattr(prbm.interface.tables, "check_size", lambda mechanism: None)
        patch.setattr(prbm.interface.tables, "slots", lambda mechanism, independent: {})
        ours = KernelSystem(guide, count)
    message = message_of(MechanismError, assembly.assemble, guide, guide.values())
    return message, message_of(KernelError, ours.assemble, guide.values())


def test_messages_about_redundant_loops_are_the_same():
    """Two bars parallel to a flexure of the same length constrain the same motion."""
    guide = mechanism("PRBDM2R")
    one, other = guide.flexures
    bar = replace(one, type="bar", ends=("pin", "pin"))
    more = (replace(bar, name="third"), replace(bar, name="a_fourth"))
    types = (*guide.flexure_types, FlexureType("bar", "3R", 1e-3, 1e-3, 1e9, 1e3))
    guide = replace(guide, flexure_types=types, flexures=(one, other, *more))
    theirs, ours = refused(guide, 3)
    assert ours == theirs
    assert "constraints of a_fourth, third depend on each other" in ours


def test_messages_about_dependent_guides_are_the_same():
    model = beaded()
    again = replace(model.guides[1], name="again", point="rider.d")
    *others, rider = model.bodies
    rider = replace(rider, points={**rider.points, "d": (0.055, "L + 0.01 + 24e-3/4.9")})
    twice = replace(model, bodies=(*others, rider), guides=(*model.guides, again))
    drawn = assembly.assemble(model, model.values())
    theirs, ours = refused(twice, drawn.n - len(drawn.loops) - 2)
    assert ours == theirs
    assert "constraints of again, rail depend on each other" in ours


def test_messages_about_points_that_a_joint_cannot_connect_are_the_same():
    guide = elastic()
    hinge, hook = guide.joints
    theirs, ours = refused(replace(guide, joints=(replace(hinge, start="stage.top"), hook)), 15)
    assert ours == theirs.replace("stage.top and lever.pin, which", "points that")


# --- kinetics.c, constraints.c, forces.c ---------------------------------------------------------


@twin(inertia=kinetics.inertia)
@each_mechanism
def test_inertia_is_the_same(name):
    for system, ours, rng in systems(name):
        q, _ = random_state(system, rng, 2.0)
        e, n = system.directions(q), system.d
        M, C = np.full((n, n), np.nan), np.full((n, n), np.nan)
        kernel().inertia(n, ours.H, ours.J, e, M, C)
        expected = kinetics.inertia(system.H, np.diag(system.J), e)
        assert_same(M, expected[0])
        assert_same(C, expected[1], scale=np.abs(M).max())


@twin(motion=system_arrays.System.motion)
@each_mechanism
def test_displacements_and_velocities_of_points_are_the_same(name):
    kind = structures()["BodyFrame"]
    for system, ours, rng in systems(name):
        q, v = random_state(system, rng, 0.5)
        e = system.directions(q)
        groups = {"bodies": system.bodies.values(), "probes": system.probes}
        for group, frames in groups.items():
            for i, frame in enumerate(frames):
                at = getattr(ours.structure, group) + i * ctypes.sizeof(kind)
                displacement, velocity = np.zeros((2, 1), complex)
                kernel().motion(ours.structure, at, e, v, displacement, velocity)
                expected = system.motion(frame, e, v)
                assert_same(displacement[0], expected[0], scale=system.length)
                assert_same(velocity[0], expected[1], scale=system.length)


@twin(
    directions=system_arrays.System.directions, turning=system_arrays.System.turning,
    repeat_columns=system_arrays.System.repeat_columns,
)  # fmt: skip
@each_mechanism
def test_directions_and_rates_of_arms_are_the_same(name):
    for system, ours, rng in systems(name):
        q, v = random_state(system, rng, 0.5)
        e, w = np.zeros((2, system.d), complex)
        kernel().directions(ours.structure, q, e)
        assert_same(e, system.directions(q))
        kernel().turning(ours.structure, v, w)
        assert_same(w, system.turning(v))
        B = np.vstack([system.loops, system.gaps])
        rows = np.zeros(B.shape, complex)
        kernel().repeat_columns(ours.structure, len(B), B, rows)
        assert_same(rows, system.repeat_columns(B))


class KernelRows:
    """Rows of the package, converted to those of the kernel; the object owns their arrays."""

    def __init__(self, ours, rows):
        self.rows, r = rows, len(rows)
        z, on = rows.every_z.copy(), rows.every_on.astype(np.int32)
        self.arrays = [rows.B.copy(), rows.c.copy(), z, on]
        self.structure = structures()["Rows"](
            ctypes.addressof(ours.structure), r, *(part.ctypes.data for part in self.arrays)
        )


def assert_same_rows(found, expected, e, v):
    """Compare values, Jacobians, rates and convective terms of rows."""
    r, n = len(expected), expected.system.n
    size = float(np.abs(expected.B).max(initial=0.0))
    s, rows = np.zeros(r), np.zeros((r, n))
    c = found.c or expected.c.ctypes.data
    found = structures()["Rows"](found.system, found.count, found.B, c, found.z, found.on)
    assert found.count == r
    kernel().scalars(found, e, s)
    assert_same(s, expected.values(e), scale=size)
    kernel().jacobian(found, e, rows)
    assert_same(rows, expected.jacobian(e))
    for rate, name in (("row_rate", "rates"), ("row_convective", "convective")):
        one = [getattr(kernel(), rate)(found, i, e, v) for i in range(r)]
        scale = size * np.abs(v).max() ** (1 + (name == "convective"))
        assert_same(one, getattr(expected, name)(e, v), scale=scale)


@twin(
    scalars=system_arrays.Rows.values, jacobian=system_arrays.Rows.jacobian,
    row_rate=system_arrays.Rows.rates, row_convective=system_arrays.Rows.convective,
    gap_rows=system_arrays.System.gap_rows, slide_rows=system_arrays.System.slide_rows,
    rub_rows=system_arrays.System.rub_rows,
)  # fmt: skip
@each_mechanism
def test_scalars_and_their_derivatives_are_the_same(name):
    """For loops, gaps, slides and friction points, some with respect to a moving body."""
    for system, ours, rng in systems(name):
        q, v = random_state(system, rng, 0.5)
        e = system.directions(q)
        for kind in ("gap_rows", "slide_rows", "rub_rows"):
            found = getattr(kernel(), kind)(ours.structure)
            assert_same_rows(found, getattr(system, kind), e, v)
        loops = system.loop_rows
        mine = KernelRows(ours, loops)
        assert_same_rows(mine.structure, loops, e, v)


def random_saddle(rng, n, r):
    """Return a mass matrix and rows of full rank."""
    A = rng.normal(size=(n, n + 2))
    return A @ A.T, rng.normal(size=(r, n))


@twin(
    saddle=constraints.saddle,
    scales=constraints.scales,
    factor_saddle=constraints.factor_saddle,
    solve_saddle=constraints.solve_saddle,
    solve=constraints.solve,
    determinant_sign=constraints.determinant_sign,
)
def test_saddle_point_systems_and_their_solutions_are_the_same():
    rng = np.random.default_rng(0)
    for n, r in ((1, 0), (3, 2), (7, 2), (7, 5), (9, 4)):
        for _ in range(10):
            M, rows = random_saddle(rng, n, r)
            columns, right = rows + 0.2 * rng.normal(size=rows.shape), rng.normal(size=n + r)
            kkt = np.full((n + r, n + r), np.nan)
            kernel().saddle(n, r, M, columns, rows, kkt)
            expected = constraints.saddle(M, columns, rows)
            np.testing.assert_array_equal(kkt, expected)
            scale = np.full(n + r, np.nan)
            assert kernel().scales(n, r, kkt, 1.0, scale)
            assert_same(scale, constraints.scales(expected, n, 1.0))
            rel = spread(scaled_condition(expected))
            solution = constraints.solve(expected, right, n, 1.0)
            arrays = [kkt.copy(), np.zeros(n + r), np.zeros(n + r, np.int32)]
            addresses = (part.ctypes.data for part in arrays)
            factors = structures()["ScaledFactors"](n + r, *addresses)
            kernel().factor_saddle(n, r, 1.0, factors)
            ours = right.copy()
            kernel().solve_saddle(factors, ours)
            assert_same(ours, solution, rel)
            known = constraints.factor_saddle(
                expected, n, 1.0, constraints.scales(expected, n, 1.0)
            )
            assert_same(constraints.solve_saddle(known, right), solution, rel)
            x = right.copy()
            kernel().solve(n, r, kkt.copy(), x, 1.0)
            assert_same(x, ours, 0.0)
            sign = constraints.determinant_sign(expected, n, 1.0)
            assert (
                kernel().determinant_sign(n, r, kkt, 1.0) == sign == np.linalg.slogdet(expected)[0]
            )


@twin(cholesky=constraints.cholesky)
def test_cholesky_factors_and_their_rejections_are_the_same():
    """The last pivot of L diag(1, ..., 1, x) L^T is x of its diagonal element, 1 + |l|^2 + x."""
    rng = np.random.default_rng(0)
    for n in (1, 2, 5):
        for last in (1.0, 1e-6, 1e-10, 1e-13, 0.0, -1e-3):
            L = np.tril(rng.normal(size=(n, n)), -1) + np.eye(n)
            L[n - 1] *= 10.0 ** rng.uniform(-6, 6)
            M = L * np.append(np.ones(n - 1), last) @ L.T
            found = M.copy()
            try:
                expected = constraints.cholesky(M)
            except SimulationError:
                assert not kernel().cholesky(n, found)
                assert last < 1e-8
                continue
            assert kernel().cholesky(n, found)
            np.testing.assert_allclose(np.tril(found, -1), np.tril(expected, -1), rtol=1e-12)
            rtol = 1e-14 * M[-1, -1] / (expected[-1, -1] ** 2)
            np.testing.assert_allclose(1.0 / found.diagonal(), expected.diagonal(), rtol=rtol)
            assert last > 1e-14


def test_messages_about_singular_equations_are_the_same():
    kkt = np.zeros((3, 3))
    message = message_of(KernelError, kernel().solve, 2, 1, kkt, np.ones(3), 1.0)
    assert message == message_of(
        SimulationError, constraints.solve, np.zeros((3, 3)), np.ones(3), 2, 1.0
    )


def even(x):
    """Return vectors padded with a zero to an even length, as the kernel stores them."""
    padded = np.pad(x, [(0, 0)] * (x.ndim - 1) + [(0, x.shape[-1] % 2)])
    return np.ascontiguousarray(padded)


def intervals_of(Z, *, whole):
    """Return the kernel's Intervals of rows with an even length, and their arrays.

    They have the pairs of columns in which a row is not zero, or all columns.
    """
    used = np.any(Z.reshape(len(Z), Z.shape[1] // 2, 2) != 0.0, axis=2) | whole
    lists = [
        (2 * np.flatnonzero(np.diff(row, prepend=False, append=False))).reshape(-1, 2)
        for row in used
    ]
    first = np.cumsum([0, *map(len, lists)], dtype=np.int32)
    repeats = np.array([k > 0 and np.array_equal(used[k], used[k - 1]) for k in range(len(Z))])
    bounds = np.concatenate([np.zeros((0, 2), int), *lists])
    each = np.column_stack([bounds, np.full(len(bounds), system_arrays.FIXED)]).astype(np.int32)
    arrays = [first, each, repeats]
    made = structures()["Intervals"](*(part.ctypes.data for part in arrays))
    return made, [made, *arrays]


def factors_of(M, rows, columns, sizes, split=0, last=None):
    """Return the kernel's Factors of a matrix with blocks of some sizes, and their arrays.

    The rows of a block before the row ``split`` are zero in the columns behind it.  ``last``, for
    another pattern, has the last columns that are not zero, counted in the blocks.
    """
    r, n = rows.shape
    U = np.linalg.cholesky(M[::-1, ::-1])[::-1, ::-1]  # M = U U^T
    root = np.diag(U).copy()
    U = U / root
    Z, Z_columns = (even(np.linalg.solve(U, part.T).T) for part in (rows, columns))
    if np.array_equal(rows, columns):
        Z_columns = Z  # The kernel compares the pointers.
    starts = np.cumsum([0, *sizes])
    parts = np.concatenate([U[a:b, a:b].ravel() for a, b in itertools.pairwise(starts)])
    blocks = np.array(
        [starts[:-1], sizes, [split if sizes == (7,) else 0] * len(sizes)], np.int32
    ).T.copy()
    S, pivots = np.full(r * (2 * r + 1), np.nan), np.zeros(r, np.int32)
    if last is None:
        last = np.repeat(np.array(sizes) - 1, sizes)
        last[:split] = split
    start = np.repeat(starts[:-1], sizes)
    area = np.repeat(np.cumsum([0, *np.square(sizes)])[:-1], sizes)
    begin = area + (np.arange(n) - start) * np.repeat(sizes, sizes) - start
    factor_rows = np.column_stack([begin, start + last]).astype(np.int32)
    intervals, kept = intervals_of(Z, whole=r <= constants()["SMALL"] or Z_columns is not Z)
    fields = {
        "blocks": blocks, "last": last.astype(np.int32), "factor_rows": factor_rows,
        "scaled": np.zeros(n + n % 2), "U": parts, "inverse": even(1.0 / root**2), "Z": Z,
        "Z_columns": Z_columns, "S": S, "pivots": pivots,
    }  # fmt: skip
    addresses = {name: part.ctypes.data for name, part in fields.items()}
    made = structures()["Factors"](
        n=n, even=n + n % 2, r=r, block_count=len(sizes), intervals=ctypes.addressof(intervals),
        **addresses,
    )  # fmt: skip
    return made, [fields, *kept]


def solved_again(factors, right, n):
    """Return (a, -lam) for a right side."""
    x, lam = even(right[:n]), right[n:].copy()
    kernel().solve_again(factors, x, lam)
    return np.concatenate([x[:n], -lam])


@twin(factor_schur=constraints.factor_saddle, solve_again=constraints.solve_saddle)
@pytest.mark.parametrize(
    ("sizes", "split"),
    [((1,), 0), ((3,), 0), ((4, 3), 0), ((2, 1, 4), 0), ((5, 6), 0), ((7,), 3), ((8,), 5)],
)
def test_repeated_solutions_with_one_factorization_are_the_same(sizes, split):
    """With columns that differ from the rows, as for sliding friction, and with equal ones."""
    rng, n = np.random.default_rng(0), sum(sizes)
    block = np.repeat(range(len(sizes)), sizes)
    for r in range(n):
        for own in (False, True):
            M, rows = random_saddle(rng, n, r)
            M[block[:, None] != block] = 0.0
            if split:
                M += np.diag(np.abs(M).sum(axis=1))  # Definite with zeros, too.
                M[:split, split + 1 :] = 0.0
                M[split + 1 :, :split] = 0.0
            columns = rows + 0.2 * own * rng.normal(size=rows.shape)
            factors, _arrays = factors_of(M, rows, columns, sizes, split)
            assert kernel().factor_schur(factors)
            kkt = constraints.saddle(M, columns, rows)
            rel = spread(np.linalg.cond(kkt) * np.linalg.cond(M))
            right = rng.normal(size=(2, n + r))
            known = constraints.factor_saddle(kkt, n, 1.0, constraints.scales(kkt, n, 1.0))
            for one in right:
                expected = constraints.solve_saddle(known, one)
                assert_same(solved_again(factors, one, n), expected, rel)


@pytest.mark.parametrize("sizes", [(9,), (2,) * 5, (3, 1, 9, 2), (9, 9)])
def test_rows_with_structural_zeros_are_solved_as_dense_ones(sizes):
    """Blocks of 9 coordinates are a trunk of one and two branches of four, which share no mass."""
    rng, n = np.random.default_rng(0), sum(sizes)
    branches = {9: [8, *[4] * 4, *[8] * 4]}
    last = np.concatenate([branches.get(size, [size - 1] * size) for size in sizes])
    end = np.repeat(np.cumsum([0, *sizes])[:-1], sizes) + last
    columns = np.arange(n)
    for _ in range(20):
        U = np.triu(rng.normal(size=(n, n)), 1) * (columns <= end[:, None]) + np.eye(n)
        M = (U * rng.uniform(0.5, 2.0, n)) @ U.T
        pairs = rng.permutation(n // 2)[
            :2
        ]  # Two pairs of rows, as those of loops, and one of a stop.
        rows = rng.normal(size=(5, n))
        rows[:4] *= np.repeat(columns // 2 == pairs[:, None], 2, axis=0)
        factors, (fields, *_) = factors_of(M, rows, rows, sizes, last=last)
        Z, rel = fields["Z"].copy(), spread(np.linalg.cond(U))
        fields["Z"][:] = even(rows)
        kernel().forward_rows(factors)
        assert_same(fields["Z"], Z, rel)
        assert kernel().factor_schur(factors)
        kkt, right = constraints.saddle(M, rows, rows), rng.normal(size=n + len(rows))
        rel = spread(np.linalg.cond(kkt) * np.linalg.cond(M))
        assert_same(solved_again(factors, right, n), np.linalg.solve(kkt, right), rel)


@pytest.mark.parametrize("scales", [(1e30, 1e30, 1e30, 1e-75), (3e-23, 3e-23, 3e-23, 1e20)])
def test_factorization_is_exact_for_rows_of_very_different_sizes(scales):
    """Each row prescribes the acceleration 1 of one of four unit masses, with its own scale."""
    factors, _arrays = factors_of(np.eye(4), np.diag(scales), np.diag(scales), (1, 1, 1, 1))
    assert kernel().factor_schur(factors)
    found = solved_again(factors, np.concatenate([np.zeros(4), scales]), 4)
    np.testing.assert_allclose(found[:4], 1.0, rtol=1e-15)


def scaled_condition(kkt):
    """Return the condition of a saddle-point matrix with each row and column scaled."""
    scale = 1.0 / np.sqrt(np.abs(kkt).max(axis=0))
    return np.linalg.cond(scale[:, None] * kkt * scale)


def assert_same_turn(found, expected, start, system, M, rows):
    """Compare angles after projections onto the same constraints.

    The constraints are closed to 1e-14 of the size.  The corrections have rounding errors.
    """
    X = np.linalg.solve(M, rows.T)
    leverage = np.abs(X @ np.linalg.inv(rows @ X)).sum(axis=1).max(initial=0.0)
    rel = spread(scaled_condition(constraints.saddle(M, rows, rows)))
    way = float(np.abs(expected - start).max())
    open_by = 2 * tolerances.CONSTRAINT_RTOL * system.length
    assert np.abs(found - expected).max() <= 1e-12 + open_by * leverage + rel * way


@twin(
    project_positions=constraints.project_positions,
    project_velocities=constraints.project_velocities,
)
@each_mechanism
def test_projections_are_the_same(name):
    for system, ours, rng in systems(name):
        q, v = bent(system, rng), rng.normal(size=system.n)
        n, loops = system.n, system.loop_rows
        r, c = len(loops), loops.c
        rates = 0.1 * rng.normal(size=r)
        expected, e = constraints.project_positions(system, loops, q, c)
        found, e_found = q.copy(), np.zeros(system.d, complex)
        mine = KernelRows(ours, loops)
        kernel().project_positions(ours.structure, mine.structure, found, c, e_found)
        M, rows = system.mass_matrix(e), loops.jacobian(e)
        assert_same_turn(found, expected, q, system, M, rows)
        assert_same(e_found, system.directions(found))
        moved, impulses = v.copy(), np.zeros(r)
        kernel().project_velocities(n, r, M, rows, rates, moved, impulses, system.length)
        rel = spread(np.linalg.cond(constraints.saddle(M, rows, rows)))
        expected = constraints.project_velocities(M, rows, rates, v, system.length)
        assert_same(moved, expected, rel)
        momentum = M @ (moved - v)
        assert_same(rows.T @ impulses, momentum, rel, scale=np.abs(M).max() * np.abs(v).max())
        for mobility in (1e-3, 1e3, 1e12, 1e60):  # Of walls, which give way to impulses.
            pushed, impulses = v.copy(), np.full(r, mobility)
            kernel().project_velocities(n, r, M, rows, rates, pushed, impulses, system.length)
            left = rows @ pushed + rates + mobility * impulses
            size = np.abs(rows @ v + rates).max(initial=0.0)
            assert np.abs(left).max(initial=0.0) <= 1e-9 * size


def test_messages_about_loops_that_cannot_be_closed_are_the_same():
    """The length in the message is that of an iteration without a solution: its digits differ."""
    for system, ours, _ in systems("PRBDM", 1):
        loops, c = system.loop_rows, system.loops_c + 1.0
        mine = KernelRows(ours, loops)
        message = message_of(
            KernelError, kernel().project_positions, ours.structure, mine.structure,
            system.q0.copy(), c, np.zeros(system.d, complex),
        )  # fmt: skip
        expected = message_of(
            SimulationError, constraints.project_positions, system, loops, system.q0, c
        )
        length = r"-?\d[\d.e+-]*(?= m apart)"
        assert re.sub(length, "L", message) == re.sub(length, "L", expected)
        assert "parts remain L m apart" in re.sub(length, "L", expected)


@twin(
    springs=forces.springs, elastic_energy=forces.elastic_energy, field_row=forces.field_row,
    force_row=forces.force_row, generalised=forces.generalised,
    gravitational_energy=forces.gravitational_energy, normal_force=forces.normal_force,
    load_rows=forces.load_rows,
)  # fmt: skip
@each_mechanism
def test_forces_and_energies_are_the_same(name):
    for system, ours, rng in systems(name):
        q, _ = random_state(system, rng)
        n, e = system.n, system.directions(q)
        turn, torque = q - system.q0, np.zeros(n)
        kernel().springs(n, ours.K, turn, torque)
        assert_same(torque, forces.springs(system.K, turn))
        found = kernel().elastic_energy(n, ours.K, turn)
        assert_same(found, forces.elastic_energy(system.K, turn))
        F, a = (complex(*rng.normal(size=2)) for _ in range(2))
        A = next(iter(system.bodies.values())).A
        d = system.d
        w, Q = np.zeros(d, complex), np.zeros(d)
        kernel().field_row(d, ours.S, a, w)
        assert_same(w, forces.field_row(system.S, a))
        kernel().force_row(d, A, F, w)
        assert_same(w, forces.force_row(A, F))
        kernel().generalised(d, w, e, Q)
        assert_same(Q, forces.generalised(w, e))
        found = kernel().gravitational_energy(ours.structure, e)
        size = float(np.abs(system.S).sum() * abs(system.gravity))  # Size of the summed terms.
        assert_same(found, forces.gravitational_energy(system, e), scale=size)
        for lift in (-1.0, 1.0):
            found = kernel().normal_force(lift, 2.0, 3.0)
            assert found == forces.normal_force(lift, 2.0, 3.0)
        for i, frame in enumerate(system.pushed):
            rows, kind = np.zeros((3, n)), structures()["BodyFrame"]
            at = ours.structure.pushed + i * ctypes.sizeof(kind)
            kernel().load_rows(ours.structure, at, e, rows)
            assert_same(rows, forces.load_rows(system, frame, e))


@twin(
    spring_tension=elements.spring_tension, spring_slope=elements.spring_slope,
    spring_energy=elements.spring_energy,
)  # fmt: skip
def test_laws_of_springs_are_the_same():
    rng = np.random.default_rng(0)
    for k in range(12):
        law, x = elements.SpringLaw(*rng.normal(size=5), side=k % 3 - 1), float(rng.normal())
        ours = structures()["SpringLaw"](*law)
        for name in ("spring_tension", "spring_slope", "spring_energy"):
            assert getattr(kernel(), name)(ours, x) == getattr(elements, name)(law, x)


@each_mechanism
def test_elements_are_the_same(name):
    for system, ours, rng in systems(name):
        q, v = random_state(system, rng)
        e, n, own = system.directions(q), system.n, elements.Elements(system)
        K, row, found = np.zeros((n, n)), np.zeros(n), np.zeros(n)
        kernel().element_forces(ours.structure, q, e, 0.7, found)
        size = float(np.abs(own.drawn).max())
        assert_same(found, own.force(q, e, 0.7), scale=size)
        assert_same(kernel().element_energy(ours.structure, q, e), own.energy(q, e), scale=size)
        kernel().element_tangent(ours.structure, e, 0.7, K)
        assert_same(K, own.tangent(e, 0.7))
        kernel().element_stiffness(ours.structure, e, K)
        assert_same(K, own.stiffness(e))
        kernel().element_torques(ours.structure, e, v, found, row)
        assert_same(found, own.stiffness(e) @ v)
        C = np.zeros((n, n))
        for k in range(kernel().damper_count(ours.structure)):
            C += kernel().damper_row(ours.structure, k, e, row) * np.outer(row, row)
        viscous = own.viscous(e)
        assert_same(C, np.zeros((n, n)) if viscous is None else viscous)


# --- contact.c -----------------------------------------------------------------------------------


def mobility(rng, size, rank):
    A = rng.normal(size=(size, rank)) * 10 ** rng.uniform(-2, 2)
    return A @ A.T


@twin(response=contact.response)
def test_responses_are_the_same():
    rng = np.random.default_rng(0)
    for n, r, k in ((1, 0, 1), (3, 2, 2), (7, 2, 3), (9, 4, 1)):
        M, held = random_saddle(rng, n, r)
        rows, X = rng.normal(size=(k, n)), np.full((n, k), np.nan)
        kernel().response(n, r, k, M, held, rows, 1.0, X)
        rel = spread(np.linalg.cond(constraints.saddle(M, held, held)))
        assert_same(X, contact.response(M, held, rows, 1.0), rel)


@twin(newton=contact.newton)
@pytest.mark.parametrize("k", [1, 2, 3, 4, 6])
def test_frictionless_impacts_of_several_stops_are_the_same(k):
    """W has every rank; stops close, rest or get no impulse; some problems have no solution."""
    rng, solved = np.random.default_rng(k), 0
    for _ in range(200):
        rank = int(rng.integers(1, k + 1))
        W = mobility(rng, k, rank)
        u = np.minimum(W @ rng.normal(size=k), 0.0)
        u[rng.uniform(size=k) < 0.2] = 0.0
        if not u.any():
            continue
        eps, P = rng.uniform(0, 1, k), np.full(k, np.nan)
        try:
            expected = contact.newton(W, u, eps)
        except SimulationError:
            message = message_of(KernelError, kernel().newton, k, W, u, eps, 0.0, P)
            assert message == contact.CLOSING_IN
            continue
        kernel().newton(k, W, u, eps, 0.0, P)
        solved += 1
        hit = expected > 0.0
        s = np.linalg.svd(W[np.ix_(hit, hit)], compute_uv=False)
        s = s[s > 1e-13 * s.max(initial=0.0)]
        assert_same(P, expected, spread(s[0] / s[-1]) if len(s) else 0.0)
    assert solved > 30


def test_impulses_of_many_stops_satisfy_the_law_of_impact():
    """Twenty-four stops are hit at once."""
    rng = np.random.default_rng(0)
    k = 24
    W = mobility(rng, k, 40)
    u, eps, P = -rng.uniform(0, 1, k), rng.uniform(0, 1, k), np.zeros(k)
    kernel().newton(k, W, u, eps, 0.0, P)
    assert_same(contact.newton(W, u, eps), P, 1e-9)
    slack = W @ P + (1 + eps) * u
    assert (P >= 0).all()
    assert slack.min() >= -1e-9
    assert np.abs(np.minimum(P * np.diag(W), slack)).max() <= 1e-9


@twin(
    lemke=complementarity.lemke, coulomb=complementarity.coulomb,
    violation=complementarity.violation, in_any_modes=complementarity.in_any_modes,
)  # fmt: skip
@pytest.mark.parametrize(("k", "m"), [(0, 2), (3, 0), (2, 3), (8, 8)])
def test_forces_that_satisfy_the_laws_of_contact_are_the_same(k, m):
    """W has full rank; the limits of friction are fixed or proportional to a normal force."""
    rng = np.random.default_rng(10 * k + m)
    for _ in range(50):
        W, u = mobility(rng, k + m, k + m + 2), rng.normal(size=k + m)
        u *= np.sqrt(np.diag(W))
        mu, fixed = rng.uniform(0, 1, m), rng.uniform(0, 1, m)
        normal = np.array([j if j < k and rng.uniform() < 0.7 else -1 for j in range(m)], int)
        P, z = np.full(k + m, np.nan), np.full(k + m, np.nan)
        tolerance = 1e-9 * np.abs(u).max()
        carried = complementarity.TwoSided(
            0.1 * rng.normal(size=(m // 2, k + m)), rng.normal(size=m // 2)
        )
        for g in range(m // 2):  # Some limits depend on forces that act in both directions.
            normal[-1 - g] = k + g
            fixed[-1 - g] = 0.0
        laws = coulomb_laws(mu, fixed, normal, *carried)
        assert kernel().coulomb(k, m, W, u, laws, tolerance, P)
        expected = complementarity.coulomb(W, u, mu, fixed, normal, tolerance, carried)
        assert_same(P, expected, 1e-10)
        limit = complementarity.limits(P, mu, fixed, normal, carried)
        wrong = complementarity.violation(W, u, P, limit)
        assert wrong <= tolerance
        few = 2**k * 3**m <= tolerances.MODES_TRIED_MAX
        assert kernel().in_any_modes(k, m, W, u, laws, tolerance, P) == few
        found = complementarity.in_any_modes(W, u, mu, fixed, normal, tolerance, carried)
        assert (found is not None) == few
        if few:
            assert_same(P, found, 1e-10)
        Q = rng.normal(size=k + m)
        wrong = kernel().violation(k, m, W, u, Q, limit)
        assert wrong == pytest.approx(complementarity.violation(W, u, Q, limit), rel=1e-12)
        cover = rng.uniform(0.5, 2, k + m)
        assert kernel().lemke(k + m, W, u, cover, z)
        assert_same(z, complementarity.lemke(W, u, cover), 1e-10)


@twin(impulses=complementarity.impulses)
@pytest.mark.parametrize("k", [1, 3])
def test_impulses_above_a_least_impulse_are_the_same(k):
    rng = np.random.default_rng(k)
    for _ in range(50):
        W, u = mobility(rng, 2 * k, 2 * k + 2), rng.normal(size=2 * k)
        mu, least, P = rng.uniform(0, 1, k), rng.uniform(0, 1, k), np.full(2 * k, np.nan)
        tolerance = 1e-9 * np.abs(W).max()
        assert kernel().impulses(k, k, W, u, mu, least, tolerance, P)
        assert_same(P, complementarity.impulses(W, u, mu, least, tolerance), 1e-9)
        assert (P[:k] >= least).all()


def test_both_find_that_a_complementarity_problem_has_no_solution():
    M, q, z = np.array([[1.0, -1.0], [-1.0, 1.0]]), np.array([-1.0, -1.0]), np.zeros(2)
    assert complementarity.lemke(M, q, np.ones(2)) is None
    assert not kernel().lemke(2, M, q, np.ones(2), z)


@twin(stronge=contact.stronge)
def test_impacts_with_friction_are_the_same():
    """W has rank two or one; contacts slide, stick or jam; mu and eps may be at their bounds."""
    rng = np.random.default_rng(0)
    for _ in range(5000):
        W = mobility(rng, 2, int(rng.integers(1, 3)))
        u = np.array([-rng.uniform(0, 1), rng.normal()]) * np.sqrt(np.diag(W))
        if rng.uniform() < 0.2:
            u[1] = 0.0
        mu = float(rng.choice([0.0, rng.uniform(0, 2)], p=[0.1, 0.9]))
        eps = float(rng.choice([0.0, 1.0, rng.uniform()], p=[0.1, 0.1, 0.8]))
        P_n, P_t = np.zeros(1), np.zeros(1)
        try:
            expected = contact.stronge(W, u, mu, eps)
        except SimulationError:  # For rank one, some random rates are impossible.
            message = message_of(KernelError, kernel().stronge, W, u, mu, eps, 0.0, P_n, P_t)
            assert message == contact.WEDGED
            continue
        kernel().stronge(W, u, mu, eps, 0.0, P_n, P_t)
        assert_same([P_n[0], P_t[0]], expected)


@pytest.mark.slow
@twin(several=contact.several)
@pytest.mark.parametrize("k", [2, 3])
def test_simultaneous_impacts_with_friction_are_the_same(k):
    """W has full rank."""
    rng = np.random.default_rng(k)
    for _ in range(100):
        W = mobility(rng, 2 * k, 2 * k + 2)
        u = np.concatenate([-rng.uniform(0.1, 1, k), rng.normal(size=k)]) * np.sqrt(np.diag(W))
        mu, eps = rng.uniform(0.05, 0.6, k), rng.uniform(0, 1, k)
        P = np.full(2 * k, np.nan)
        kernel().several(k, W, u, mu, eps, 0.0, P)
        assert_same(P, contact.several(W, u, mu, eps), 1e-10)


def test_messages_about_impacts_without_a_solution_are_the_same():
    W = np.array([[1.0, -1.9], [-1.9, 1.0]])
    W = np.block([[np.eye(2), W], [W, np.eye(2)]])  # Invalid: W is not semidefinite.
    u, mu, eps, P = np.array([-1.0, -1.0, 1.0, 1.0]), np.full(2, 2.0), np.zeros(2), np.zeros(4)
    message = message_of(KernelError, kernel().several, 2, W, u, mu, eps, 0.0, P)
    assert message == message_of(SimulationError, contact.several, W, u, mu, eps)


# --- statics.c, modal.c --------------------------------------------------------------------------


def equilibrium_of(system):
    """Return an empty Equilibrium of the kernel, and its arrays."""
    q, lam = np.full(system.n, np.nan), np.full(len(system.loops), np.nan)
    return structures()["Equilibrium"](q.ctypes.data, lam.ctypes.data, math.nan), q, lam


def shape_of(expected):
    """Return an equilibrium of the package as one of the kernel, and its arrays."""
    q, lam = expected.q.copy(), expected.lam.copy()
    return structures()["Equilibrium"](q.ctypes.data, lam.ctypes.data, expected.force), (q, lam)


@twin(tangent_stiffness=statics.tangent_stiffness)
@each_mechanism
def test_tangent_stiffness_is_the_same(name):
    for system, ours, rng in systems(name):
        q, _ = random_state(system, rng)
        e, n = system.directions(q), system.n
        w = system.repeat_columns(rng.normal(size=(system.d, 2)).view(complex)[:, 0])
        for rows in (system.loop_rows, system.gap_rows):
            lam, K_t = rng.normal(size=len(rows)), np.full((n, n), np.nan)
            own = KernelRows(ours, rows)
            kernel().tangent_stiffness(own.structure, 0.7, w, lam, e, K_t)
            K = elements.Elements(system).tangent(e, 0.7)
            assert_same(K_t, statics.tangent_stiffness(K, w, rows, lam, e))


def stacked_release(system):
    return np.vstack([system.loops, system.release]), np.append(system.loops_c, system.release_c)


@twin(equilibrium=statics.equilibrium)
@each_mechanism
@pytest.mark.parametrize("displacement", [None, 0.0, -4e-3, 3e-3, -0.012])
def test_equilibria_are_the_same(name, displacement):
    """The shapes are free or held; they are found directly or by continuation."""
    for system, ours, _ in systems(name):
        expected = statics.equilibrium(system, displacement)
        found, q, lam = equilibrium_of(system)
        held = displacement is not None
        kernel().equilibrium(ours.structure, held, displacement or 0.0, found)
        size = np.abs(system.K).max() / system.length  # Size of the balanced forces.
        assert_same(q, expected.q, scale=1.0)  # rad; undeformed shapes have angles of rounding.
        assert_same(lam, expected.lam, scale=size)
        assert_same(found.force, expected.force, scale=size)


@pytest.mark.parametrize("across", [0.05, -0.05, 5e-4, 0.0])
def test_equilibria_beyond_buckling_are_the_same(across):
    frame = read_mechanism(ROOT / "tests" / "cases" / "buckle.toml")
    values = frame.values({"gravity.x": across})
    system = assembly.assemble(frame, values)
    ours = KernelSystem(frame, system.n - len(system.loops))
    ours.assemble(values)
    found, q, _ = equilibrium_of(system)
    kernel().equilibrium(ours.structure, False, 0.0, found)
    assert_same(q, statics.equilibrium(system).q, scale=1.0)


@pytest.mark.parametrize("displacement", [0.2, -0.06])
def test_messages_about_displacements_out_of_reach_are_the_same(displacement):
    for system, ours, _ in systems("PRBDM2R", 2):
        found, *_arrays = equilibrium_of(system)
        message = message_of(
            KernelError, kernel().equilibrium, ours.structure, True, displacement, found
        )
        assert message == message_of(EquilibriumError, statics.equilibrium, system, displacement)


def test_messages_about_buckling_under_gravity_are_the_same():
    guide, ours = both("PRBDM2R")
    values = guide.values({"gravity.x": 1e6})
    ours.assemble(values)
    found, *_arrays = equilibrium_of(system := assembly.assemble(guide, values))
    message = message_of(KernelError, kernel().equilibrium, ours.structure, False, 0.0, found)
    assert message == message_of(EquilibriumError, statics.equilibrium, system)


@twin(resting=statics.resting, with_bodies_placed=statics.with_bodies_placed)
@pytest.mark.parametrize(
    "model", [web(), oscillator(parts={"gravity": (0.0, -9.81)}), flying()], ids=lambda m: m.name
)
def test_shapes_under_gravity_of_bodies_on_springs_are_the_same(model):
    system = assembly.assemble(model, model.values())
    ours = KernelSystem(model, system.n - len(system.loops))
    ours.assemble(model.values())
    placed = kernel().with_bodies_placed(ours.structure)
    assert placed.placed_count == len(statics.with_bodies_placed(system).placed)
    shape, q, _ = equilibrium_of(system)
    expected, balanced = statics.resting(system)
    found = ctypes.c_bool()
    kernel().resting(ours.structure, shape, ctypes.addressof(found))
    assert found.value == balanced
    assert_same(q, expected.q, 1e-9, scale=1.0)
    ours.close()


@twin(release_velocity=positions.release_velocity)
@each_mechanism
@pytest.mark.parametrize("speed", [0.0, 0.7, -2.0])
def test_release_velocities_are_the_same(name, speed):
    for system, ours, rng in systems(name):
        q, _ = random_state(system, rng, 0.1)
        v = np.full(system.n, np.nan)
        kernel().release_velocity(ours.structure, q, speed, v)
        e = system.directions(q)
        rows = system.gradient(np.vstack([system.loops, system.release]), e)
        rel = spread(np.linalg.cond(constraints.saddle(system.mass_matrix(e), rows, rows)))
        assert_same(v, positions.release_velocity(system, q, speed), max(1e-11, rel))


def assert_same_modes(frequency, phi, expected, rounding):
    """Compare modes up to their signs.

    The error of every omega^2 is the rounding error of the largest one, also with LAPACK.  The
    error of a mode is this error divided by the distance of its omega^2 from the nearest other one.
    """
    omega2 = np.sign(expected.frequency) * expected.frequency**2
    size = np.abs(omega2).max()
    assert_same(np.sign(frequency) * frequency**2, omega2, rounding)
    for i, (one, other) in enumerate(zip(phi.T, expected.shape.T, strict=True)):
        others = np.delete(omega2, i)
        distance = np.abs(others - omega2[i]).min() if len(others) else size
        if distance <= rounding * size:
            continue  # Every combination of modes of the same frequency is a mode.
        sign = np.sign(one @ expected.M @ other)
        assert_same(sign * one, other, rounding * max(1.0, size / distance))


@twin(modes=modal.modes)
@each_mechanism
@pytest.mark.parametrize("displacement", [None, -3e-3])
def test_modes_are_the_same(name, displacement):
    for system, ours, _ in systems(name):
        expected = statics.equilibrium(system, displacement)
        shape, _arrays = shape_of(expected)
        k = system.n - len(system.loops)
        frequency, phi = np.full(k, np.nan), np.full((system.n, k), np.nan)
        kernel().modes(ours.structure, shape, frequency, phi)
        theirs = modal.modes(system, expected)
        assert_same_modes(frequency, phi, theirs, spread(np.linalg.cond(theirs.M)))


@twin(
    start_shape=starts.start_shape, instability=starts.instability,
    unstable_directions=modal.unstable_directions, moved_by=modal.moved_by,
)  # fmt: skip
@each_mechanism
def test_unstable_directions_are_the_same(name):
    for system, ours, _ in systems(name):
        expected = statics.equilibrium(system, 1e-3)
        found = modal.modes(system, expected)
        k, phi = len(found.frequency), np.ascontiguousarray(found.shape)
        moved = np.full(k, np.nan)
        kernel().moved_by(ours.structure, expected.q, phi, moved)
        along = modal.moved_by(system, expected.q, phi)
        assert_same(moved, along)
        for frequency in (found.frequency, np.sort(found.frequency * np.sign(0.5 - np.arange(k)))):
            for g in (None, along):
                counted = kernel().unstable_directions(k, frequency, g)
                assert counted == modal.unstable_directions(frequency, g)
        rest, release = np.zeros(1, np.intc), np.zeros(1, np.intc)
        kernel().instability(ours.structure, ours.values, rest, release)
        assert starts.instability(system, system.values) == (rest[0], release[0])
        q = np.full(system.n, np.nan)
        kernel().start_shape(ours.structure, ours.values, q)
        assert_same(q, starts.start_shape(system, system.values), 1e-9)


def at_start():
    """Yield mechanisms with positions and velocities of bodies at the start."""
    crank = {"start_angle": 0.3, "start_omega": -4.0}
    yield with_start(slider_crank(velocity=0.0), "crank", **crank)
    yield with_start(incline(20.0, turning=True), "block", start_x=0.05, start_omega=1.0)
    rods = {"start_angle": -0.7, "start_vx": 0.3}, {"start_x": -0.2, "start_omega": 2.0}
    yield double_pendulum(*rods)
    guide = mechanism("PRBDM2R")
    body = guide.release.body
    given = {"start_x": -3e-3, "start_vy": 1e-3}
    yield with_start(replace(guide, release=Release(body)), body, **given)


@twin(
    positioned=positions.positioned, start_velocity=positions.start_velocity,
    start_speed=positions.start_speed,
)  # fmt: skip
def test_positions_and_velocities_at_the_start_are_the_same():
    for model in at_start():
        system = assembly.assemble(model, model.values())
        ours = KernelSystem(model, system.n - len(system.loops))
        ours.assemble(model.values())
        given = positions.given_at_start(model, system.values, POSITIONS)
        expected = positions.positioned(system, given)
        q, v = np.full((2, system.n), np.nan)
        kernel().positioned(ours.structure, ours.values, q)
        assert_same(q, expected, 1e-9, scale=1.0)
        kernel().start_velocity(ours.structure, expected, ours.values, v)
        assert_same(v, positions.start_velocity(system, expected, system.values), 1e-9)
        assert_same(kernel().start_speed(ours.structure), positions.start_speed(system))
        ours.close()


@pytest.mark.parametrize(
    ("model", "name", "start"),
    [
        (slider_crank(velocity=0.0), "slider", {"start_x": 1.0}),
        (slider_crank(velocity=0.0), "slider", {"start_x": -0.03, "start_y": 1e-3}),
        (slider_crank(velocity=2.0), "slider", {"start_vx": 1.0}),
        (slider_crank(velocity=0.0), "slider", {"start_vx": 1.0, "start_vy": 2.0}),
        (incline(20.0, displacement=0.01), "block", {"start_x": 0.05}),
        (incline(20.0), "block", {"start_x": 0.05, "start_y": 0.3, "start_angle": 0.1}),
    ],
)
def test_messages_about_values_at_the_start_are_the_same(model, name, start):
    model = with_start(model, name, **start)
    system = assembly.assemble(model, model.values())
    ours = KernelSystem(model, system.n - len(system.loops))
    ours.assemble(model.values())
    q, v = system.q0.copy(), np.zeros(system.n)

    def theirs():
        shape = starts.start_shape(system, system.values)
        positions.start_velocity(system, shape, system.values)

    def own():
        kernel().start_shape(ours.structure, ours.values, q)
        kernel().start_velocity(ours.structure, q, ours.values, v)

    errors = (ParameterError, EquilibriumError)
    assert message_of(KernelError, own) == message_of(errors, theirs)
    ours.close()


@twin(fundamental_frequency=modal.fundamental_frequency)
@each_mechanism
def test_fundamental_frequencies_are_the_same(name):
    for system, ours, _ in systems(name):
        found = np.zeros(1)
        kernel().fundamental_frequency(ours.structure, found)
        expected = modal.modes(system, statics.equilibrium(system)).frequency
        rounding = 1e-15 * (expected[-1] / expected[0]) ** 2  # Rounding of the largest omega^2.
        assert_same(found[0], modal.fundamental_frequency(system), max(1e-10, rounding))


def test_the_fundamental_frequency_of_an_unstable_equilibrium_is_zero_in_both():
    guide, ours = both("PRBDM2R")
    values = guide.values({"gravity.x": 0.0, "gravity.y": -200.0})
    ours.assemble(values)
    found = np.ones(1)
    kernel().fundamental_frequency(ours.structure, found)
    assert found[0] == modal.fundamental_frequency(assembly.assemble(guide, values)) == 0.0


@twin(fundamental_at=modal.fundamental_at)
@each_mechanism
def test_fundamental_modes_away_from_equilibrium_are_the_same(name):
    for system, ours, rng in systems(name):
        q, n = near_loops(system, rng), system.n
        phi, M = np.full(n, np.nan), np.full((n, n), np.nan)
        kernel().fundamental_at(ours.structure, q, phi, M)
        expected, M_expected = modal.fundamental_at(system, q)
        assert_same(M, M_expected)
        # Rounding errors are those of the fastest modes, which are those of notches.
        assert_same(np.sign(phi @ M @ expected) * phi, expected, 1e-8)


@twin(least_mobility=contact.least_mobilities)
def test_least_mobilities_are_the_same():
    rng = np.random.default_rng(0)
    for n in (1, 3, 8):
        M, rows = random_saddle(rng, n, 4)
        rows *= 10.0 ** np.array([[0], [-5], [-12], [-300]])
        expected = contact.least_mobilities(M, rows, 0.1)
        for row, least in zip(rows, expected, strict=True):
            assert_same(kernel().least_mobility(n, M, row, 0.1), least)


@twin(contact_mobility=contact.contact_mobility)
def test_inverse_masses_in_contact_space_are_the_same():
    """The last row is a combination of the held ones, up to round-off."""
    rng = np.random.default_rng(0)
    for n, r, k in ((3, 1, 1), (7, 2, 3), (9, 4, 4)):
        M, held = random_saddle(rng, n, r)
        rows = np.vstack([rng.normal(size=(k, n)), rng.normal(size=(1, r)) @ held])
        X, W = contact.response(M, held, rows, 1.0), np.full((k + 1, k + 1), np.nan)
        kernel().contact_mobility(n, k + 1, M, rows, X, 1.0, W)
        expected = contact.contact_mobility(M, rows, X, 1.0)
        assert_same(W, expected)
        assert not expected[-1].any()
        assert not expected[:, -1].any()


@twin(slow_rates=modal.slow_rates)
@each_mechanism
def test_rates_without_a_fundamental_frequency_are_the_same(name):
    for system, ours, _ in systems(name, 2):
        rate, fast = np.full(1, np.nan), np.full(1, np.nan)
        kernel().slow_rates(ours.structure, rate, fast)
        assert_same(np.concatenate([rate, fast]), modal.slow_rates(system), 1e-8)


@twin(simulated_restitution=modal.simulated_restitution)
def test_simulated_restitutions_are_the_same():
    rng = np.random.default_rng(0)
    for n in (1, 3, 7):
        M, _ = random_saddle(rng, n, 0)
        phi, before, after = rng.normal(size=(3, n))
        found = kernel().simulated_restitution(n, phi, M, before, after)
        assert_same(found, modal.simulated_restitution(phi, M, before, after))
        assert kernel().simulated_restitution(n, phi, M, 0 * before, after) == 0.0


# --- dynamics.c, runge_kutta.c -------------------------------------------------------------------


class KernelEquations:
    """The kernel's equations of a system in one contact state; the object owns their arrays."""

    def __init__(self, ours, inputs, contacts, omega):
        self.ours, self.structure = ours, structures()["Equations"]()
        self.evaluation, self.reference, self.correction = (
            structures()[name]() for name in ("Evaluation", "Reference", "Correction")
        )
        self.blocks = [
            placed(lambda memory, lay_out=lay_out, part=part: lay_out(part, ours.structure, memory))
            for lay_out, part in (
                (kernel().equations_place, self.structure),
                (kernel().evaluation_place, self.evaluation),
                (kernel().reference_place, self.reference),
                (kernel().correction_place, self.correction),
            )
        ]
        given = [(f.real, f.imag, m) for f, m in zip(inputs.forces, inputs.moments, strict=True)]
        walls = [astuple(wall) for wall in inputs.walls]
        self.arrays = [np.array(part, float) for part in (given, walls, inputs.mobilities)]
        self.modes, self.sides = (np.array(x, np.int32) for x in (contacts.modes, contacts.sides))
        base = structures()["Complex"](inputs.base.real, inputs.base.imag)
        self.inputs = structures()["Inputs"](
            self.arrays[0].ctypes.data, base, *(part.ctypes.data for part in self.arrays[1:])
        )
        kind = structures()["ContactPhase"]
        self.touching = (kind * max(len(contacts.touching), 1))()
        for to, one in zip(self.touching, contacts.touching, strict=False):
            if one:
                to.phase, to.reference_speed, to.depth = astuple(one)
        self.coils = np.array(contacts.springs, np.int32)
        state = structures()["ContactState"](
            self.modes.ctypes.data,
            ctypes.addressof(self.touching),
            self.sides.ctypes.data,
            self.coils.ctypes.data,
        )
        kernel().set_equations(self.structure, self.inputs, state, omega)

    def evaluate(self, t, q, v):
        """Return accelerations and multipliers."""
        kernel().evaluate_equations(self.structure, t, q, v, None, None, self.evaluation)
        return self.multiplied(len(q))

    def multiplied(self, n):
        """Return the accelerations and multipliers of the evaluation."""
        return array(self.evaluation.a, n), array(self.evaluation.lam, self.structure.r)

    def given(self, a, lam):
        """Set the accelerations and multipliers of the evaluation, and return them as one."""
        for address, x in ((self.evaluation.a, a), (self.evaluation.lam, lam)):
            ctypes.memmove(address, np.ascontiguousarray(x).ctypes.data, 8 * len(x))
        return dynamics.Evaluation(a, lam, None, None, None, None, 0.0)

    def rate(self, t, y):
        """Return the rates of a state at a time."""
        dy = np.full(len(y), np.nan)
        kernel().rate(self.structure, t, y, None, self.evaluation, dy)
        return dy

    def project_near(self, t, y, reference=None):
        """Return a state projected with the factors of its evaluation."""
        n, near = (len(y) - 2) // 2, y.copy()
        kernel().factor_equations(self.structure, y[:n], y[n : 2 * n], None, self.evaluation)
        kernel().project_near(self.structure, self.evaluation, reference, t, near, self.correction)
        return near

    def stages(self, t, y, h, k):
        """Compute all stages after the first; return the new state and the range of forces."""
        y1, forces = np.full(len(y), np.nan), np.full((2, 8), np.nan)
        span = structures()["ForceRange"](*(row.ctypes.data for row in forces))
        kernel().stages(
            self.structure, t, len(y), y, h, k, y1, self.reference, self.evaluation, span
        )
        return y1, forces[:, : self.structure.held_count]


def contact_states(system):
    """Yield contact states in which the mechanism can still move."""
    kinds = list(ContactMode)
    stops, points = len(system.gaps), len(system.rubs)
    for first_stop in kinds:
        for first_point in kinds[1:]:
            contacts = ContactState.free(stops, points).with_mode(0, first_stop)
            contacts = contacts.with_mode(stops, first_point) if points else contacts
            for k in np.flatnonzero(system.normals != system_arrays.FIXED).tolist():
                contacts = contacts.with_side(stops + k, 1 - 2 * (first_stop % 2))
            sticking = contacts.modes.count(ContactMode.STICK)
            if len(system.loops) + len(contacts.held) + sticking < system.n:
                yield contacts


def test_accelerations_and_losses_with_one_sided_springs_are_the_same_in_every_phase():
    """Springs of both sides, acting, slack and lagging, at random states."""
    model = one_sided(("tension", "compression", "tension", "both", "compression"))
    system, rng = assembly.assemble(model, model.values()), np.random.default_rng(0)
    ours = KernelSystem(model, system.n)
    ours.assemble(model.values())
    for phases in itertools.product(SpringPhase, repeat=2):
        springs = (*phases, SpringPhase.ACTING, SpringPhase.ACTING, SpringPhase.SLACK)
        contacts = replace(ContactState.free(0, 0), springs=springs)
        inputs = input_data.Inputs((0j,), (0.0,), 0j, (), ())
        theirs = dynamics.Equations(system, inputs, contacts, 0.0)
        mine = KernelEquations(ours, inputs, contacts, 0.0)
        q, v = random_state(system, rng)
        y = np.concatenate([q, v, np.zeros(2)])
        expected = theirs.rate(0.0, y)
        assert_same(mine.rate(0.0, y), expected, scale=np.abs(expected).max())
        assert expected[2 * system.n] >= 0.0 or SpringPhase.LAGGING in phases


def random_inputs(system, e, rng, driven):
    """Return random inputs; without ``driven`` they are zero.

    The walls are within a hundredth of a millimetre of the stops' contact points.
    """
    F = driven * rng.normal(size=(len(system.mechanism.forces), 3))
    touched = -system.gap_rows.values(e)
    return input_data.Inputs(
        tuple(complex(x, y) for x, y, _ in F),
        tuple(F[:, 2] * 0.01),
        driven * complex(*rng.normal(size=2)),
        tuple(
            input_data.Wall(
                x + 1e-5 * rng.normal(),
                *(driven * 0.01 * rng.normal(size=1)),
                rng.normal(),
                *(driven * np.array([1e-6, 1e-3]) * rng.normal(size=2)),
                driven * 1e-3,
            )
            for x in touched
        ),
        tuple(driven * rng.uniform(size=len(touched))),
    )


def repeats(rows):
    """Return whether rows are nearly dependent; no simulation constrains such rows together."""
    s = np.linalg.svd(rows / np.linalg.norm(rows, axis=1)[:, None], compute_uv=False)
    return len(s) > 0 and s[-1] < 0.05 * s[0]


def equations(name, count=2):
    """Yield the equations of package and kernel, a state near the constraints and a generator."""
    for system, ours, rng in systems(name, count):
        for driven in (0.0, 1.0):
            for contacts in contact_states(system):
                q = near_loops(system, rng)
                inputs = random_inputs(system, system.directions(q), rng, driven)
                theirs = dynamics.Equations(system, inputs, contacts, 80.0)
                if repeats(theirs.rows.jacobian(system.directions(q))):
                    continue
                mine = KernelEquations(ours, inputs, contacts, 80.0)
                _, v = random_state(system, rng)
                q = q + 1e-5 * rng.normal(size=system.n)
                yield theirs, mine, np.concatenate([q, v, rng.normal(size=2)]), rng


def condition(evaluation):
    """Return the condition number of the equations of an evaluation, or of M if that is larger.

    The kernel eliminates the accelerations by the factors of M: N. J. Higham, Accuracy and
    Stability of Numerical Algorithms, section 13.3.
    """
    lu, pivots, _ = evaluation.factors
    kkt = (np.tril(lu, -1) + np.eye(len(lu))) @ np.triu(lu)
    for row, pivot in reversed(list(enumerate(pivots))):
        kkt[[row, pivot]] = kkt[[pivot, row]]
    return max(scaled_condition(kkt), scaled_condition(np.asarray(evaluation.M)))


@twin(
    set_equations=dynamics.Equations.__init__,
    evaluate_equations=dynamics.Equations.evaluate,
    rate=dynamics.Equations.rate,
)
@each_mechanism
def test_accelerations_and_rates_are_the_same_in_every_discrete_state(name):
    for theirs, mine, y, _ in equations(name):
        n, r = theirs.n, len(theirs.rows)
        t = theirs.inputs.walls[0].since + 3e-4  # The wall has not reached its reference.
        a, lam = mine.evaluate(t, y[:n], y[n : 2 * n])
        evaluation = theirs.evaluate(t, y[:n], y[n : 2 * n])
        a_expected, lam_expected, M = evaluation.a, evaluation.lam, evaluation.M
        rel = spread(condition(evaluation))
        assert mine.structure.r == r
        assert_same(a, a_expected, rel)
        # The bound of the round-off is relative to the largest of all scaled unknowns.
        scale = evaluation.factors.scale
        largest = np.abs(np.append(a_expected, lam_expected) / scale).max()
        assert_same(lam / scale[n:], lam_expected / scale[n:], rel, scale=largest)
        dy = mine.rate(t, y)
        expected = theirs.rate(t, y)
        assert_same(dy[: 2 * n], expected[: 2 * n], rel)
        power = float(np.abs(M @ a_expected) @ np.abs(y[n : 2 * n]))  # Size of the summed powers.
        assert_same(dy[2 * n :], expected[2 * n :], rel, scale=power)
        energy = kernel().kinetic_energy_of(mine.evaluation)
        assert_same(energy, kinetics.kinetic_energy(M, y[n : 2 * n]))


@each_mechanism
def test_evaluations_do_not_depend_on_the_state_evaluated_before(name):
    for theirs, mine, y, rng in equations(name):
        t = theirs.inputs.walls[0].since
        first, projected = mine.rate(t, y), mine.project_near(t, y)
        mine.rate(t, y + 0.1 * rng.normal(size=len(y)))
        assert mine.project_near(t, y).tobytes() == projected.tobytes()
        assert mine.rate(t, y).tobytes() == first.tobytes()


@each_mechanism
def test_a_reference_nearby_changes_evaluations_by_round_off(name):
    for theirs, mine, y, _ in equations(name):
        n = theirs.n
        q, v = y[:n], y[n : 2 * n]
        expected, rel = mine.evaluate(0.1, q, v), spread(condition(theirs.evaluate(0.1, q, v)))
        kernel().set_reference(mine.reference, mine.ours.structure, q + 1e-3)
        kernel().evaluate_equations(
            mine.structure, 0.1, q, v, None, mine.reference, mine.evaluation
        )
        for found, one in zip(mine.multiplied(n), expected, strict=True):
            assert_same(found, one, rel)


SCALED_PARAMETERS = ("density", "youngs_modulus", "shuttle.mass", "shuttle.inertia")


@pytest.mark.parametrize("factor", [1e-60, 1e-33, 1e30, 1e60])
def test_accelerations_do_not_depend_on_the_size_of_masses_and_stiffnesses(factor):
    """Products of eight such masses are outside the range of doubles."""
    guide, ours = both("PRBDM2R")
    found, rng = [], np.random.default_rng(3)
    values = guide.values({"release.displacement": 0.0})
    state = random_state(assembly.assemble(guide, values), rng)
    for s in (1.0, factor):
        scaled = {k: x * (s if k.endswith(SCALED_PARAMETERS) else 1.0) for k, x in values.items()}
        ours.assemble(scaled)
        inputs = input_data.Inputs((0j,), (0.0,), 0j, (input_data.Wall(1.0),), (0.0,))
        mine = KernelEquations(ours, inputs, ContactState.free(1, 1), 80.0)
        found.append(mine.evaluate(0.0, *state)[0])
    assert np.all(np.isfinite(found[0]))
    np.testing.assert_allclose(found[1], found[0], rtol=1e-9)


@twin(
    gap=dynamics.Equations.gaps, gap_rate=dynamics.Equations.gap_rates,
    gap_acceleration=dynamics.Equations.gap_accelerations,
    wall_motion=input_data.Wall.motion,
)  # fmt: skip
@each_mechanism
def test_gaps_are_the_same(name):
    for theirs, mine, y, rng in equations(name, 3):
        n, size = theirs.n, theirs.system.length
        t = theirs.inputs.walls[0].since + 1e-3 * rng.uniform(0.0, 1.5)
        e, v = theirs.system.directions(y[:n]), y[n : 2 * n]
        stops = len(theirs.system.gaps)
        gaps = [kernel().gap(mine.structure, i, t, e, None) for i in range(stops)]
        assert_same(gaps, theirs.gaps(t, e), scale=size)
        rates = [kernel().gap_rate(mine.structure, i, t, e, v, None) for i in range(stops)]
        assert_same(rates, theirs.gap_rates(t, e, v), scale=size * np.abs(v).max())
        a = rng.normal(size=n) * np.abs(v).max() ** 2
        mine.given(a, np.zeros(0))
        at = t, e, v, mine.evaluation
        found = [kernel().gap_acceleration(mine.structure, i, *at) for i in range(stops)]
        assert_same(found, theirs.gap_accelerations(t, e, v, a), scale=size * np.abs(a).max() + 10)
        wall = theirs.inputs.walls[0]
        found = kernel().wall_motion(structures()["Wall"](*astuple(wall)), t)
        scale = (size, 0.01, 10.0)
        for part, expected, one in zip((found.x, found.v, found.a), wall.motion(t), scale,
                                       strict=True):  # fmt: skip
            assert_same(part, expected, scale=one)


@twin(
    is_stop=ContactState.is_stop, stop_force=dynamics.Equations.stop_forces,
    stick_force=dynamics.Equations.friction, friction_limit=dynamics.Equations.friction,
    slip_force=dynamics.sliding_friction, is_held=ContactState.held.func,
    friction_coefficient=dynamics.Equations.friction_coefficient,
)  # fmt: skip
@pytest.mark.parametrize("name", ["PRBDM2R", "Rich", "Beaded"])
def test_contact_forces_are_the_same(name):
    """The forces of closed stops and sticking contacts are computed from random multipliers."""
    for theirs, mine, y, rng in equations(name, 3):
        e, lam = theirs.system.directions(y[: theirs.n]), rng.normal(size=len(theirs.rows))
        contacts = theirs.contacts
        given = mine.given(rng.normal(size=theirs.n), lam)
        for k in range(len(contacts.modes)):
            assert kernel().is_stop(mine.structure.system, k) == contacts.is_stop(k)
            coefficient = theirs.friction_coefficient(k)
            assert kernel().friction_coefficient(mine.structure, k) == coefficient
        for stop in range(contacts.stops):
            held = kernel().is_held(mine.structure.contacts, stop)
            assert held == (stop in contacts.held)
        for stop in theirs.held:
            force = kernel().stop_force(mine.structure, lam, stop)
            assert force == theirs.stop_forces(lam)[stop]
        for c in theirs.sticking:
            force, limit = theirs.friction(c, e, lam)
            assert kernel().stick_force(mine.structure, lam, c) == force
            found = kernel().friction_limit(mine.structure, e, mine.evaluation, c)
            assert_same(found, limit, scale=abs(force))
        for c in (*theirs.slipping_points, *theirs.slipping_rows):
            found = kernel().slip_force(mine.structure, e, mine.evaluation, c)
            force = dynamics.sliding_friction(theirs, c, e, given)
            assert_same(found, -contacts.modes[c].slip * force)


@twin(
    is_guide=dynamics.Equations.is_guide, normal_row=dynamics.Equations.normal_row,
    side_force=dynamics.Equations.side_force,
)  # fmt: skip
def test_the_normal_forces_of_guides_and_held_stops_are_the_same():
    for theirs, mine, _, rng in equations("Beaded", 3):
        lam, contacts = rng.normal(size=len(theirs.rows)), theirs.contacts
        for k in range(len(contacts.modes)):
            guide = theirs.is_guide(k)
            assert kernel().is_guide(mine.structure.system, k) == guide
            if guide or k in contacts.held:
                assert kernel().normal_row(mine.structure, k) == theirs.normal_row(k)
            if guide:
                assert kernel().side_force(mine.structure, lam, k) == theirs.side_force(k, lam)


@pytest.mark.parametrize("mode", list(ContactMode)[1:])
@pytest.mark.parametrize("phase", [Phase.PRESSED, Phase.RISING, Phase.FREE])
def test_equations_with_pressed_stops_are_the_same(phase, mode):
    """The wall gives way to the force, which has friction."""
    for system, ours, rng in systems("Soft", 3):
        stops, q, contact = len(system.gaps), near_loops(system, rng), ContactPhase(phase, 0.3)
        free = ContactState.free(stops, len(system.rubs))
        contacts = replace(free, touching=(contact,) + (None,) * (stops - 1)).with_mode(0, mode)
        inputs = random_inputs(system, system.directions(q), rng, 1.0)
        theirs = dynamics.Equations(system, inputs, contacts, 80.0)
        mine = KernelEquations(ours, inputs, contacts, 80.0)
        n, (_, v) = theirs.n, random_state(system, rng)
        y = np.concatenate([q, 0.1 * v, rng.normal(size=2), 1e-5 * rng.normal(size=4)])
        t = inputs.walls[0].since + 3e-4
        evaluation, dy, expected = theirs.at(t, y), mine.rate(t, y), theirs.rate(t, y)
        rel = spread(condition(evaluation))
        assert_same(dy[: 2 * n], expected[: 2 * n], rel)
        power = float(np.abs(evaluation.M @ evaluation.a) @ np.abs(y[n : 2 * n]))
        assert_same(dy[2 * n : 2 * n + 2], expected[2 * n : 2 * n + 2], rel, scale=power)
        assert_same(dy[2 * n + 2 :], expected[2 * n + 2 :], 1e-9)
        e, extra = system.directions(q), y[2 * n + 2 :]
        at, given = (mine.structure, 0, t, e), (mine.evaluation,)
        assert_same(kernel().gap(*at, extra), theirs.gaps(t, e, extra)[0], scale=system.length)
        speed = theirs.gap_rates(t, e, y[n : 2 * n], extra)[0]
        assert_same(kernel().gap_rate(*at, y[n : 2 * n], extra), speed, scale=1.0)
        known = (t, e, y[n : 2 * n], evaluation.a, evaluation.pressure)
        bend = theirs.gap_accelerations(*known)[0]
        found = kernel().gap_acceleration(*at, y[n : 2 * n], *given)
        assert_same(found, bend, 1e-8, scale=abs(expected[2 * n + 3]))
        pressed = float(evaluation.pressure.force[0])
        assert (pressed == 0.0) == (phase is Phase.FREE)
        limit = theirs.friction_limit(0, e, evaluation.pressure)
        found = kernel().friction_limit(mine.structure, e, *given, 0)
        assert_same(found, limit, 1e-9, scale=abs(pressed))


@twin(
    damping_factor=compliance.damping_factor,
    elastic_force=compliance.ComplianceLaw.elastic_force,
    damping_ratio=compliance.ComplianceLaw.damping_ratio,
    contact_force=compliance.ComplianceLaw.force,
    contact_energy=compliance.ComplianceLaw.energy,
    contact_tangent=compliance.ComplianceLaw.tangent,
    contact_depth=compliance.ComplianceLaw.depth,
    is_pressed=ContactState.pressed.func,
)
def test_laws_of_compliant_stops_are_the_same():
    rng = np.random.default_rng(7)
    for e in (*rng.uniform(0.01, 1.0, 40), 0.01, 1.0):
        n, phase = rng.choice([1.0, 1.5, 2.3]), Phase(int(rng.integers(1, 5)))
        a = compliance.damping_factor(e)
        assert kernel().damping_factor(e) == pytest.approx(a, rel=1e-9)
        theirs = compliance.ComplianceLaw(10 ** rng.uniform(0, 9), n, a)
        mine = structures()["ComplianceLaw"](*theirs)
        one = ContactPhase(phase, 10 ** rng.uniform(-4, 1), 1e-6)
        touching = structures()["ContactPhase"](*astuple(one))
        d, rate = rng.normal() * 1e-4, rng.normal()
        pairs = [
            (kernel().elastic_force(mine, d), theirs.elastic_force(d)),
            (kernel().damping_ratio(mine, touching, rate), theirs.damping_ratio(one, rate)),
            (kernel().contact_force(mine, touching, d, rate), theirs.force(one, d, rate)),
            (kernel().contact_energy(mine, d), theirs.energy(d)),
            (kernel().contact_tangent(mine, abs(d)), theirs.tangent(abs(d))),
            (kernel().contact_depth(mine, abs(d)), theirs.depth(abs(d))),
        ]
        for found, expected in pairs:
            assert found == pytest.approx(expected, rel=1e-12)
        state = ContactState((ContactMode.OPEN,), 1, (one,))
        assert kernel().is_pressed(touching) == bool(state.pressed)


@twin(rub_limit=dynamics.Equations.friction_limit)
@pytest.mark.parametrize("name", NAMES)
def test_limits_of_friction_are_the_same(name):
    for theirs, mine, y, _ in equations(name, 3):
        e, points = theirs.system.directions(y[: theirs.n]), range(len(theirs.friction_laws))
        limits = [kernel().rub_limit(mine.structure, i, e) for i in points]
        assert_same(limits, [theirs.friction_limit(theirs.contacts.stops + i, e) for i in points])


@twin(project=dynamics.Equations.project, project_near=dynamics.Equations.project_near)
@each_mechanism
def test_projected_states_are_the_same(name):
    """States are projected from afar, and from nearby with the factors of the evaluation."""
    for theirs, mine, y, rng in equations(name):
        n, t = theirs.n, theirs.inputs.walls[0].since + 1e-4
        projected, found = theirs.project(t, y), y.copy()
        kernel().project(mine.structure, t, found)
        evaluation = theirs.evaluate(t, projected[:n], projected[n : 2 * n])
        rel, r = spread(condition(evaluation)), theirs.first_stick
        rows = theirs.rows.jacobian(theirs.system.directions(projected[:n]))[:r]
        M = evaluation.M
        assert_same_turn(found[:n], projected[:n], y[:n], theirs.system, M, rows)
        assert_same(found[n:], projected[n:], rel, scale=np.abs(y[n:]).max())
        for distance in (1e-9, 1e-5):  # One correction is sufficient for 1e-9 only.
            start = projected.copy()
            start[: 2 * n] += distance * rng.normal(size=2 * n)
            factors = theirs.evaluate(t, start[:n], start[n : 2 * n]).factors
            expected, near = theirs.project_near(t, start, factors), mine.project_near(t, start)
            assert_same_turn(near[:n], expected[:n], start[:n], theirs.system, M, rows)
            assert_same(near[n:], expected[n:], rel, scale=np.abs(y[n:]).max())


@twin(base_reaction=dynamics.base_reaction)
@each_mechanism
def test_reactions_on_the_base_are_the_same(name):
    for theirs, mine, y, rng in equations(name):
        n = theirs.n
        q, v, a = y[:n], y[n : 2 * n], 100.0 * rng.normal(size=n)
        force, moment = np.zeros(1, complex), np.zeros(1)
        e = theirs.system.directions(q)
        kernel().base_reaction(mine.structure, e, v, a, force, moment)
        expected = dynamics.base_reaction(theirs, q, v, a)
        assert_same(force[0], expected[0])
        assert_same(moment[0], expected[1], scale=abs(expected[0]) * theirs.system.length)


@twin(stresses=stress.stresses)
@pytest.mark.parametrize("name", [*OWN_MECHANISMS])
def test_stresses_of_flexures_are_the_same(name):
    for theirs, mine, y, rng in equations(name):
        n = theirs.n
        q, v, a = y[:n], y[n : 2 * n], 100.0 * rng.normal(size=n)
        lam = rng.normal(size=len(theirs.rows))
        e = theirs.system.directions(q)
        given = mine.given(a, lam)
        expected = [tuple(x) for x in stress.stresses(theirs, q, v, given).values()]
        found = np.full((len(expected), 5), np.nan)
        kernel().stresses(mine.structure, e, q, v, mine.evaluation, found.ctypes.data)
        scale = max(one[2] for one in expected)
        assert_same(found[:, :3], [one[:3] for one in expected], 1e-11, scale=scale)
        assert_same(found[:, 3], [one[3] for one in expected])
        # Round-off of 1e-11 in the slope moves a maximum whose curvature is small.
        assert_same(found[:, 4], [one[4] for one in expected], 1e-9)


@twin(differences=stress.differences, polynomial=stress.polynomial, summit=stress.summit)
def test_maxima_of_polynomials_are_the_same():
    rng = np.random.default_rng(5)
    summits = 0
    for m in (3, 6, 24):
        for _ in range(20):
            x, f = np.cumsum(rng.uniform(0.5, 1.5, m)), rng.normal(size=m)
            expected, c = stress.differences(x, f), f.copy()
            kernel().differences(m, x, c)
            assert_same(c, expected, 1e-10, scale=np.abs(expected).max())
            jet = kernel().polynomial(m, x, c, x[0])
            value = stress.polynomial(x, c, x[0])
            assert_same([jet.value, jet.slope, jet.bend], value, scale=max(map(abs, value)))
            for sign in (1.0, -1.0):
                s, place = np.zeros(1), stress.summit(x, c, sign, x[0], x[2])
                assert kernel().summit(m, x, c, sign, x[0], x[2], s) == (place is not None)
                if place is not None:
                    assert_same(s[0], place, 1e-9)
                    summits += 1
    assert summits > 10


PAIR = runge_kutta.TSITOURAS_PAPAKOSTAS


@twin(stages=runge_kutta.stages, weights=runge_kutta.powers, interpolate=runge_kutta.interpolate)
@each_mechanism
def test_steps_of_the_integration_are_the_same(name):
    """Stages, new state, error and dense output of one step are compared."""
    count = constants()["STAGES"]
    for theirs, mine, y, _ in equations(name, 1):
        h, size = 1e-5, len(y)
        k, fine, coarse = (np.full(shape, np.nan) for shape in ((count, size), size, size))
        t = theirs.inputs.walls[0].since + 2e-4
        k[0] = theirs.rate(t, y)
        expected, y1_expected = runge_kutta.stages(PAIR, theirs.rate, t, y, h, k[0])
        n = theirs.n
        rel = 10 * spread(condition(theirs.evaluate(t, y[:n], y[n : 2 * n])))
        y1, forces = mine.stages(t, y, h, k)
        assert_same(k, expected, rel)
        assert_same(y1, y1_expected, rel)
        assert np.all(forces[0] <= forces[1])
        kernel().errors_of(size, expected, h, fine, coarse)
        assert_same(fine, h * (PAIR.error @ expected), scale=h * np.abs(expected).max())
        assert_same(coarse, h * (PAIR.coarse_error @ expected), scale=h * np.abs(expected).max())
        for theta in (0.0, 0.3, 1.0):
            b, middle = np.full(count, np.nan), np.full(size, np.nan)
            kernel().weights(theta, b)
            assert_same(b, runge_kutta.powers(PAIR, np.array([theta]))[0], scale=1.0)
            kernel().interpolate(size, y, expected, h, theta, middle)
            assert_same(middle, runge_kutta.interpolate(PAIR, y, expected, h, theta))


@twin(hermite_weights=runge_kutta.hermite_weights)
def test_weights_of_the_interpolation_through_three_states_are_the_same():
    rng = np.random.default_rng(0)
    for _ in range(50):
        nodes, t = rng.permutation([0.0, *rng.uniform([0.2, -5.0], [1.0, -0.2])]), rng.uniform()
        value, rate = np.full((3, 3), np.nan), np.full((3, 3), np.nan)
        kernel().hermite_weights(nodes, t, value, rate)
        expected = runge_kutta.hermite_weights(nodes.tolist(), t)
        assert_same(value, expected[0], scale=np.abs(expected[0]).max())
        assert_same(rate, expected[1], scale=np.abs(expected[1]).max())


# --- functions of the kernel only ----------------------------------------------------------------


def test_complex_arithmetic_equals_that_of_python():
    rng = np.random.default_rng(0)
    for _ in range(50):
        z, w = (complex(*rng.normal(size=2)) for _ in range(2))
        x = rng.normal()
        assert kernel().complex_of(z.real, z.imag) == z
        assert kernel().plus(z, w) == z + w
        assert kernel().minus(z, w) == z - w
        assert_same(kernel().product(z, w), z * w)
        assert kernel().conjugate(z) == z.conjugate()
        assert kernel().scaled(x, z) == x * z
        assert_same(kernel().modulus(z), abs(z))


def test_the_release_is_stacked_below_the_loops():
    for system, ours, _ in systems("Rich", 1):
        B, c = stacked_release(system)
        found, found_c = np.zeros(B.shape, complex), np.zeros(len(c))
        kernel().stack_release(ours.structure, found, found_c)
        assert_same(found, B)
        assert_same(found_c, c)


def test_the_row_that_holds_an_angle_has_the_bits_of_the_kernel_directions():
    """The sine and the cosine of C libraries differ between platforms in the last bit."""
    for system, ours, rng in systems("Pivot", 1):
        arm, r = system.released.arm, len(system.loops)
        for amount in rng.uniform(-np.pi, np.pi, 200):
            B, c = np.full((r + 1, system.d), np.nan, complex), np.zeros(r + 1)
            kernel().stack_holding(ours.structure, amount, B, c)
            expected, constant = system.holding(amount)
            assert_same(B, np.vstack([system.loops, expected]))
            assert (c[r], constant) == (0.0, 0.0)
            e = np.zeros(1, complex)
            kernel().unit_vectors(1, np.array([system.q0[system.released.j] + amount]), e)
            assert B[r, arm] == -system.length * (e[0].imag + 1j * e[0].real)


def test_a_list_is_reversed():
    for count in range(5):
        x = np.arange(5.0)
        kernel().reverse(count, x)
        assert x.tolist() == [*range(count - 1, -1, -1), *range(count, 5)]


ENGINE = [
    f"prbm.{package}.{path.stem}"
    for package in ("mechanism", "mechanics", "hybrid")
    for path in sorted((ROOT / "fmu_src" / "prbm" / package).glob("[a-z]*.py"))
]
OTHERS = {
    "plus": "of complex numbers",
    "minus": "of complex numbers",
    "scaled": "of a complex number",
    "reverse": "of a list",
}
"""Functions of the kernel that share only their name with a function of the engine."""


def public(module):
    """Return the public functions and methods of a module by their last names."""
    found = {}
    for name, thing in vars(importlib.import_module(module)).items():
        if name.startswith("_") or getattr(thing, "__module__", "") != module:
            continue
        members = vars(thing).items() if inspect.isclass(thing) else ((name, thing),)
        found |= {k: f for k, f in members if inspect.isfunction(f) and not k.startswith("_")}
    return found


def namesakes():
    """Return the functions of all modules of the engine by name that the kernel declares, too."""
    named = {}
    for module in ENGINE:
        for name, function in public(module).items():
            if name in prototypes():
                named.setdefault(name, []).append(function)
    return named


def path(function):
    """Return module and name of a function or a cached property."""
    function = getattr(function, "func", function)
    return f"{function.__module__}.{function.__qualname__}"


def report():
    """Return the functions that are compared, and by file how many functions are not."""
    lines = [f"{len(TWINS)} functions of the kernel are compared with the engine one by one:"]
    for file, group in itertools.groupby(prototypes().values(), lambda p: p.file):
        compared = [f"  {p.name} = {path(TWINS[p.name])}" for p in group if p.name in TWINS]
        lines += [file, *compared] if compared else []
    lines.append("Functions that are not compared one by one:")
    for file in sorted(KERNEL.rglob("*.c")):
        functions = [f.name for f in sizes.c_functions(file.read_text(encoding="utf-8"), file.name)]
        left = sum(name not in TWINS for name in functions)
        lines += [f"  {file.relative_to(KERNEL).as_posix()}: {left} of {len(functions)}"] * (
            left > 0
        )
    return lines


def test_functions_of_the_same_name_are_compared():
    """The pairs are found by name in all files; ``pytest -rP`` shows the report."""
    print("\n".join(report()))
    assert TWINS.keys() <= prototypes().keys()
    found = namesakes()
    assert OTHERS.keys() <= found.keys() - TWINS.keys()
    assert found.keys() - OTHERS.keys() <= TWINS.keys()


def test_the_report_counts_every_function_once():
    functions = [
        f.name
        for file in KERNEL.rglob("*.c")
        for f in sizes.c_functions(file.read_text(encoding="utf-8"), "")
    ]
    counts = [re.fullmatch(r"  \S+: (\d+) of (\d+)", line) for line in report()]
    others = sum(int(found[1]) for found in counts if found)
    assert others == len([name for name in functions if name not in TWINS])
    assert set(functions) >= TWINS.keys()
