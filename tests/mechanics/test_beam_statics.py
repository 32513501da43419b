"""Beams under end loads, compared with boundary value problems of the elastica.

Lengths are in units of the length L of a leaf, forces in EI/L^2 and moments in EI/L.
"""

import functools
import math

import numpy as np
import pytest
from scipy.linalg import eigh

from elastica import Leaf, platform
from prbm.mechanics.assembly import assemble
from prbm.mechanics.beam import integrals
from prbm.mechanics.modal import modes
from prbm.mechanics.statics import equilibrium
from prbm.mechanism.description import Mechanism
from prbm.mechanism.parts import Body, Flexure, FlexureType, Force, Release
from prbm.references.beams import wavenumber

L, THICKNESS, WIDTH, MODULUS, DENSITY = 0.1, 5e-4, 1e-2, 2e11, 7800.0
EI = MODULUS * WIDTH * THICKNESS**3 / 12
MASS = DENSITY * WIDTH * THICKNESS * L
DISTANCE = 0.8  # of the leaves of a pair
MIDDLE = 1.0 + 0.5j * DISTANCE
CLAMPED, PINNED = ("clamp", "clamp"), ("pin", "pin")
FREE, PIN_AT_END, PIN_AT_START = ("clamp", "free"), ("clamp", "pin"), ("pin", "clamp")


def single(ends, load=1.0):
    """Return one leaf and the centre of its platform, which trails behind a pinned end."""
    return (Leaf(0j, ends),), 1.0 + (0.2 * load / abs(load) if ends[1] == "pin" else 0.0)


def pair(ends, others=None):
    """Return two leaves, DISTANCE apart, and the centre of their platform."""
    return (Leaf(0j, ends), Leaf(1j * DISTANCE, others or ends)), MIDDLE


def assembled(leaves, centre, order, nodes=None, mass=1e-6, inertia=1e-6):
    """Return a platform on beams; mass and inertia are in units of those of a leaf."""
    starts = {f"g{k}": leaf.start * L for k, leaf in enumerate(leaves)}
    ends = {f"p{k}": (leaf.start + 1.0) * L for k, leaf in enumerate(leaves)}
    centre = complex(centre) * L
    points = ({k: (z.real, z.imag) for k, z in one.items()} for one in (starts, ends))
    ground, points = points
    description = Mechanism(
        name="Platform",
        title="A platform on leaves",
        ground=ground,
        bodies=(
            Body(
                "platform", mass * MASS, inertia * MASS * L**2, (centre.real, centre.imag), points
            ),
        ),
        flexure_types=(
            FlexureType(
                "leaf", "beam", THICKNESS, WIDTH, MODULUS, DENSITY, order=order, nodes=nodes
            ),
        ),
        flexures=tuple(
            Flexure(f"leaf{k}", "leaf", f"ground.g{k}", f"platform.p{k}", leaf.ends)
            for k, leaf in enumerate(leaves)
        ),
        forces=(Force("force", "platform"),),
        release=Release("platform", direction=90.0),
    )
    return assemble(description, description.values())


def loaded(system, force, moment=0.0):
    """Return the shape under a scaled load, and displacement and rotation of the platform."""
    scaled = complex(force) * EI / L**2
    loads = {"force.x": scaled.real, "force.y": scaled.imag, "force.moment": moment * EI / L}
    shape = equilibrium(system, loads=loads)
    frame = system.bodies["platform"]
    moved = complex(frame.A @ system.directions(shape.q)) + frame.c - frame.drawn
    return shape, moved / L, float(shape.q[frame.j])


def label(value):
    """Return the ends of the leaves as the name of a test; None: the default."""
    if not isinstance(value, tuple):
        return None
    return "+".join("-".join(leaf.ends) for leaf in value[0])


ORDER_ERRORS = {1: 0.1, 2: 1e-2, 3: 5e-4, 4: 5e-4, 5: 2e-5, 6: 1.5e-5}


@pytest.mark.parametrize(
    ("held", "force", "moment"),
    [
        (single(FREE), 20j, 0.0),
        (single(FREE), -1 + 10j, 4.0),
        (single(CLAMPED), 12 - 3j, -2.0),
        (single(("free", "clamp")), 12 - 3j, -2.0),
        *((single(PIN_AT_END, force), force, 0.0) for force in (20j, 3 + 8j, -2 + 8j)),
        (pair(PIN_AT_START), 15 + 10j, -1.0),
        (pair(PIN_AT_END), 20j, 0.0),
        (pair(PIN_AT_END), -3 + 10j, 2.0),
        (pair(PIN_AT_END, PIN_AT_START), 3 + 10j, 2.0),
        (pair(CLAMPED), 40j, 0.0),
        (pair(CLAMPED, PINNED), 20j, 0.0),
        (pair(CLAMPED, PINNED), -8 + 10j, 2.0),
        (pair(FREE, PINNED), -20j, 0.0),
    ],
    ids=label,
)
def test_beams_with_any_ends_converge_with_the_order_to_the_elastica(held, force, moment):
    """The error is below 5e-4 at the order 3, and falls by more than ten with every two orders.

    Orders 1 and 2 are left out where they are rejected, between two clamps.
    """
    leaves, centre = held
    z, angle = platform(leaves, centre, force, moment)
    locks = any(leaf.ends == CLAMPED for leaf in leaves)
    for order, limit in ORDER_ERRORS.items():
        if order > 2 or not locks:
            _, moved, turned = loaded(assembled(*held, order, order + 6), force, moment)
            assert abs(moved - z) < limit * abs(z)
            assert turned == pytest.approx(angle, abs=limit)


boundary_values = functools.cache(platform)


def errors(force, moment, order, nodes=None):
    """Return relative errors of displacement, shortening and rotation of a parallelogram."""
    held = pair(CLAMPED)
    z, angle = boundary_values(*held, force, moment)
    _, moved, turned = loaded(assembled(*held, order, nodes), force, moment)
    assert abs(z.imag) < 0.61
    return moved.imag / z.imag - 1.0, moved.real / z.real - 1.0, turned / angle - 1.0


@pytest.mark.parametrize(
    ("force", "moment"),
    [(6j, 0.0), (12j, 0.0), (20j, 0.0), (5 + 20j, 0.0), (10 + 20j, 0.0), (3j, 3.0), (20j, 3.0),
     (10j, -3.0), (1j, 5.0), (-10 + 3j, -2.0)],
)  # fmt: skip
def test_a_parallelogram_on_beams_moves_and_turns_like_its_two_leaves(force, moment):
    """Displacement and shortening are within 0.02 %, the rotation within 0.5 %, at the order 3."""
    displacement, shortening, rotation = map(abs, errors(force, moment, 3))
    assert max(displacement, shortening) < 2e-4
    assert rotation < 5e-3
    displacement, shortening, rotation = map(abs, errors(force, moment, 5))
    assert max(displacement, shortening) < 1e-5
    assert rotation < 1e-4


BUCKLING = -2 * math.pi**2  # Axial force at which two leaves between parallel clamps buckle.


@pytest.mark.parametrize(("share", "across"), [(0.5, 12j), (0.8, 3j), (0.85, 0.2j), (0.85, 3j)])
def test_a_compressed_parallelogram_is_as_accurate_as_without_compression(share, across):
    """The limits are those of the test without compression, up to 0.85 of the buckling load."""
    displacement, shortening, rotation = map(abs, errors(share * BUCKLING + across, 0.0, 3))
    assert max(displacement, shortening) < 2e-4
    assert rotation < 5e-3


def buckling_error(order):
    """Return the relative error of the buckling load of a leaf between parallel clamps.

    The curvature is a polynomial with odd terms only, by symmetry, and the load is the minimum of
    integral kappa^2 / integral theta^2 (Ritz).
    """
    x, weights = np.polynomial.legendre.leggauss(order + 3)
    odd = range(1, order + 1, 2)
    theta = np.array([integrals(order, x)[:, k] for k in odd])
    bending = np.diag([2.0 / (2 * k + 1) for k in odd])
    load = eigh(bending, (theta * weights) @ theta.T, eigvals_only=True)[0]
    return load / math.pi**2 - 1.0


@pytest.mark.parametrize("order", [3, 5])
def test_the_error_near_buckling_is_that_of_the_buckling_load_over_the_distance_to_it(order):
    """Small displacements are proportional to 1/(1 - P/P_b) near the buckling load P_b.

    With P_b too high by the share e, they are too small by e/(1 - P/P_b); farther from P_b by less.
    """
    across, error = 1e-6, buckling_error(order)
    for share in (0.5, 0.8, 0.9, 0.96, 0.98, 0.99):
        k = math.pi * math.sqrt(share)
        exact = across / 2 * (2 * math.tan(k / 2) - k) / k**3
        _, moved, _ = loaded(assembled(*pair(CLAMPED), order), share * BUCKLING + 1j * across)
        missing = (1.0 - moved.imag / exact) * (1.0 - share) / error
        assert missing < 1.0
        assert share < 0.9 or missing > share**7


def distance_to_cubics(share):
    """Return the squared distance of the exact small shape to its nearest cubic moment, relative.

    The leaf carries the compression k^2 and a small force across.  The norm is the energy
    integral kappa^2 - k^2 integral theta^2.
    """
    x, weights = np.polynomial.legendre.leggauss(40)
    k = math.pi * math.sqrt(share)
    theta = np.array([np.cos(k * x / 2) / math.cos(k / 2) - 1.0, *integrals(3, x)[:, 1:4].T])
    legendre = np.polynomial.legendre.legvander(x, 3)[:, 1:]
    kappa = np.array([-k * np.sin(k * x / 2) / math.cos(k / 2), *legendre.T])
    energy = (kappa * weights) @ kappa.T - k**2 * (theta * weights) @ theta.T
    nearest = np.linalg.solve(energy[1:, 1:], energy[1:, 0])
    return 1.0 - nearest @ energy[1:, 0] / energy[0, 0]


@pytest.mark.parametrize("share", [0.5, 0.85, 0.96])
def test_no_cubic_moment_is_closer_to_the_exact_one_than_that_of_the_beam(share):
    """The error of a small displacement is the squared distance to the nearest cubic moment.

    The work of the force is the energy of the shape, and equilibrium is its best approximation.
    """
    across, k = 1e-6, math.pi * math.sqrt(share)
    exact = across / 2 * (2 * math.tan(k / 2) - k) / k**3
    _, moved, _ = loaded(assembled(*pair(CLAMPED), 3, 9), share * BUCKLING + 1j * across)
    assert 1.0 - moved.imag / exact == pytest.approx(distance_to_cubics(share), rel=1e-2)


def test_the_order_and_not_the_nodes_limits_the_accuracy_near_buckling():
    """At 0.6 L and 0.85 of the buckling load, more nodes do not reach 0.02 %, more orders do."""
    force = 0.85 * BUCKLING + 5j
    few, many = (errors(force, 0.0, 3, nodes)[1] for nodes in (9, 14))
    assert few == pytest.approx(many, rel=1e-2)
    assert abs(many) > 4e-4
    assert max(map(abs, errors(force, 0.0, 5)[:2])) < 1e-4


def test_more_nodes_are_enough_at_seven_tenths_of_the_buckling_load():
    """At 0.6 L, the limits of the test without compression hold with 9 nodes at the order 3."""
    displacement, shortening, rotation = map(abs, errors(0.7 * BUCKLING + 8j, 0.0, 3, 9))
    assert max(displacement, shortening) < 2e-4
    assert rotation < 5e-3


@pytest.mark.parametrize(("share", "across"), [(0.8, 5j), (0.9, 2j), (0.96, 1j), (0.98, 0.2j)])
def test_a_compressed_parallelogram_near_buckling_deflects_like_its_two_leaves(share, across):
    """The moment is a cosine there, which an odd polynomial meets at the fifth order.

    Displacement and shortening are within 0.02 % of the length at the order 3.
    """
    force = share * BUCKLING + across
    z, _ = boundary_values(*pair(CLAMPED), force, 0.0)
    displacement, shortening, rotation = map(abs, errors(force, 0.0, 3))
    assert max(displacement * z.imag, shortening * abs(z.real)) < 2e-4
    assert displacement < 3e-4
    assert shortening < 8e-4
    assert rotation < 1e-2
    assert max(map(abs, errors(force, 0.0, 5))) < 1e-4


@pytest.mark.parametrize(
    ("ends", "number"),
    [(PINNED, math.pi), (PIN_AT_END, 3.926602312), (PIN_AT_START, 3.926602312)],
)
def test_a_beam_below_a_heavy_body_vibrates_like_a_beam_with_fixed_ends(ends, number):
    """Frequencies are b^2 sqrt(EI/(m L^3)) with tan b = tanh b, or b = pi, 2 pi for two pins.

    The heavy body is at rest; a clamped end does not turn, because its inertia is large.
    """
    numbers = [number, 2 * math.pi if ends == PINNED else 7.068582746]
    system = assembled(*single(ends), 8, mass=1e5, inertia=1e5)
    found = modes(system, loaded(system, 1e-6)[0]).frequency
    for exact in [b**2 * math.sqrt(EI / (MASS * L**3)) / (2 * math.pi) for b in numbers]:
        assert np.abs(found / exact - 1.0).min() < 2e-5


def test_tension_raises_the_frequency_of_a_pinned_beam_as_eulers_load_says():
    """A pinned beam under the axial force N has omega^2 = omega_0^2 (1 + N L^2/(pi^2 EI))."""
    share = 0.7
    system = assembled(*single(PINNED), 8, mass=1e5, inertia=1e5)
    found = modes(system, loaded(system, share * math.pi**2)[0]).frequency
    free = math.pi**2 * math.sqrt(EI / (MASS * L**3)) / (2 * math.pi)
    assert np.abs(found / (free * math.sqrt(1 + share)) - 1.0).min() < 2e-5


@pytest.mark.parametrize("tip", [(1.0, 0.0), (1.0, 0.1), (0.2, 0.03)])
def test_frequencies_with_a_body_at_the_tip_are_those_of_the_beam(tip):
    """Two frequencies are exact to 2e-3 at the order 3, and to 1e-6 at the order 6."""
    for order, limit in ((3, 2e-3), (6, 1e-6)):
        system = assembled(*single(FREE), order, mass=tip[0], inertia=max(tip[1], 1e-8))
        found = modes(system, equilibrium(system)).frequency
        for mode in (1, 2):
            exact = wavenumber(mode, *tip) ** 2 * math.sqrt(EI / (MASS * L**3)) / (2 * math.pi)
            assert found[mode - 1] == pytest.approx(exact, rel=limit)
