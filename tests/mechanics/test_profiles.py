"""Beams with a profile: the boundary value problem, masses, frequencies, and rejected profiles."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.linalg import eigh
from scipy.optimize import newton

import plane_stress
from prbm.base.errors import MechanismError, ParameterError
from prbm.hybrid.simulation import Simulation
from prbm.kernel.simulation import KernelSimulation
from prbm.mechanics.assembly import assemble
from prbm.mechanics.modal import modes
from prbm.mechanics.profile import concentration
from prbm.mechanics.sections import static_section_loads
from prbm.mechanics.statics import equilibrium
from prbm.mechanics.stress import faces, stress
from prbm.mechanism.description import Mechanism
from prbm.mechanism.parts import Body, Flexure, FlexureType, Force, Release
from prbm.references.notches import paros_weisbord
from support import mechanism

L, WIDTH, E, RHO = 0.03, 0.01, 70e9, 2700.0


def kind(**given):
    return FlexureType("neck", "beam", 5e-4, WIDTH, E, RHO, **given)


KINDS = {
    "taper": kind(profile="taper", end_thickness=2e-4, order=3),
    "wide taper": kind(profile="taper", end_thickness=1e-3, end_width=4e-3, order=3),
    "circular": kind(profile="notch", notch_radius=4e-3, order=3),
    "shallow": kind(profile="notch", notch_radius=8e-3, end_thickness=4e-3, order=3),
    "elliptic": kind(profile="notch", notch_radius=8e-3, notch_depth=3e-3, order=3),
    "filleted": kind(profile="notch", notch_radius=2e-3, waist_length=0.012, order=3),
    "in a block": kind(profile="notch", notch_radius=1.5e-3, end_thickness=0.015, order=3),
}
KINKS = {
    "taper": (), "wide taper": (), "circular": (4e-3,), "elliptic": (8e-3,),
    "shallow": (math.sqrt(8e-3**2 - 6.25e-3**2),), "filleted": (6e-3, 8e-3),
    "in a block": (1.5e-3,),
}  # fmt: skip
"""Distances from the middle at which the thickness has kinks [m]."""


def thickness(name, s):
    """Return the thickness at s, from its definition [m]."""
    k, d = KINDS[name], abs(s - L / 2)
    if k.profile == "taper":
        return k.thickness + (k.end_thickness - k.thickness) * s / L
    a, d = k.notch_radius, d - (k.waist_length or 0.0) / 2
    b = k.notch_depth or a
    outside = k.end_thickness or k.thickness + 2 * b
    if d <= 0.0:
        return k.thickness
    arc = k.thickness + 2 * b * (1 - math.sqrt(1 - (d / a) ** 2)) if d < a else math.inf
    return min(arc, outside)


def width(name, s):
    k = KINDS[name]
    return k.width + ((k.end_width or k.width) - k.width) * s / L


def panels(name):
    """Return the ends of the smooth parts, from 0 to L [m]."""
    return [0.0, *(L / 2 - x for x in KINKS[name][::-1]), *(L / 2 + x for x in KINKS[name]), L]


def integral(name, f):
    """Return the integral of f over the length."""
    parts = pairwise(panels(name))
    return sum(quad(f, *part, epsabs=0.0, epsrel=1e-11, limit=400)[0] for part in parts)


def rigidity(name, s):
    return E * width(name, s) * thickness(name, s) ** 3 / 12


def cantilever(k, ends=("clamp", "free"), *, backwards=False, mass=1e-3, inertia=1e-7):
    points = ("ground.clamp", "tip.end")
    description = Mechanism(
        name="Cantilever",
        title="A beam, clamped at one end",
        ground={"clamp": (0.0, 0.0)},
        bodies=(Body("tip", mass, inertia, (L, 0.0), {"end": (L, 0.0)}),),
        flexure_types=(k,),
        flexures=(
            Flexure("beam", k.name, *(points[::-1] if backwards else points),
                    ends[::-1] if backwards else ends),
        ),
        forces=(Force("force", "tip"),),
        release=Release("tip", direction=90.0),
    )  # fmt: skip
    return assemble(description, description.values())


def tip(system, force=0j, moment=0.0):
    """Return the position [m] and the slope of the tip under loads [N], [N m]."""
    loads = {"force.x": force.real, "force.y": force.imag, "force.moment": moment}
    shape = equilibrium(system, loads=loads)
    frame = system.bodies["tip"]
    return complex(frame.A @ system.directions(shape.q)) + frame.c, float(shape.q[frame.j])


def elastica(name, force, moment):
    """Return the tip under dead loads by shooting from the tip, whose slope is sought."""

    def clamp(slope):
        y = np.array([slope, 0.0, 0.0])  # Slope, and position relative to the tip.

        def change(s, y):
            M = moment - (complex(y[1], -y[2]) * force).imag
            return [M / rigidity(name, s), math.cos(y[0]), math.sin(y[0])]

        for part in pairwise(panels(name)[::-1]):
            y = solve_ivp(change, part, y, method="DOP853", rtol=1e-11, atol=1e-14).y[:, -1]
        return y

    slope = newton(lambda angle: clamp(angle)[0], 0.5, tol=1e-10)
    return -complex(*clamp(slope)[1:]), slope


def weakness(name, lever):
    """Return the slope of the tip under a load whose moment at s is the lever [rad]."""
    return integral(name, lambda s: lever(s) / rigidity(name, s))


@pytest.mark.parametrize("load", ["moment", "force", "both"])
@pytest.mark.parametrize("name", KINDS)
def test_a_beam_of_order_3_bends_by_40_degrees_like_the_boundary_value_problem(name, load):
    slope = math.radians(40.0)
    moment = slope / weakness(name, lambda s: 1.0) if load != "force" else 0.0
    force = 1.2j * slope / weakness(name, lambda s: L - s) if load != "moment" else 0j
    if load == "both":  # Half of the slope by each load, and compression.
        moment, force = 0.5 * moment, 0.5 * force - 0.3 * abs(force)
    z, found = tip(cantilever(KINDS[name]), force, moment)
    exact, angle = elastica(name, force, moment)
    assert math.radians(38.0) < angle < math.radians(60.0)
    assert abs(z - exact) < 1e-4 * abs(exact - L)
    assert found == pytest.approx(angle, rel=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize("load", ["moment", "force", "both"])
@pytest.mark.parametrize("name", KINDS)
def test_a_beam_of_order_3_bends_by_up_to_80_degrees_with_the_errors_of_the_page(name, load):
    slope = math.radians(75.0 if load != "both" else 60.0)
    moment = slope / weakness(name, lambda s: 1.0) if load != "force" else 0.0
    force = 1.6j * slope / weakness(name, lambda s: L - s) if load != "moment" else 0j
    if load == "both":
        moment, force = 0.5 * moment, 0.5 * force - 0.3 * abs(force)
    exact, angle = elastica(name, force, moment)
    assert math.radians(58.0) < angle < math.radians(80.0)
    limit = 3e-4 if KINDS[name].profile == "notch" else 2e-4
    assert abs(tip(cantilever(KINDS[name]), force, moment)[0] - exact) < limit * abs(exact - L)


@pytest.mark.parametrize("name", KINDS)
def test_errors_fall_with_the_order_and_the_nodes(name):
    force = 1.2j * math.radians(40.0) / weakness(name, lambda s: L - s)
    exact, _ = elastica(name, force, 0.0)
    errors = [
        abs(tip(cantilever(replace(KINDS[name], order=n, nodes=nodes)), force)[0] - exact)
        for n, nodes in ((1, 5), (3, 8), (5, 12))
    ]
    assert errors[1] < 0.2 * errors[0]
    assert errors[2] < 0.5 * errors[1] or errors[2] < 1e-5 * abs(exact - L)


@pytest.mark.parametrize("name", KINDS)
def test_a_profile_is_the_same_from_either_end(name):
    systems = [
        cantilever(replace(KINDS[name], axial=True), backwards=backwards)
        for backwards in (False, True)
    ]
    if KINDS[name].profile == "taper":  # The start is the other end.
        k = KINDS[name]
        turned = {"thickness": k.end_thickness, "end_thickness": k.thickness,
                  "width": k.end_width or k.width, "end_width": k.width}  # fmt: skip
        systems[1] = cantilever(replace(k, axial=True, **turned), backwards=True)
    load = 0.3j / L / weakness(name, lambda s: 1.0)
    assert tip(systems[0], load)[0] == pytest.approx(tip(systems[1], load)[0], abs=1e-9 * L)
    found = [modes(system, equilibrium(system)).frequency[:3] for system in systems]
    np.testing.assert_allclose(*found, rtol=1e-7)


@pytest.mark.parametrize("name", KINDS)
def test_a_beam_has_one_arm_for_each_node_of_its_panels(name):
    system = cantilever(KINDS[name])
    assert system.d - 1 == system.mechanism.node_count(KINDS[name])  # One is that of the body.


@pytest.mark.parametrize("name", KINDS)
def test_mass_centre_and_inertia_of_a_beam_that_rotates_about_a_pin_are_those_of_its_solid(name):
    """A notch has the rotary inertia of its sections; that of a taper is neglected."""
    system = cantilever(KINDS[name], ("pin", "clamp"))
    e = system.directions(system.q0)
    rigid = np.zeros(system.n)  # The pin, and the body, rotate with the rate 1.
    rigid[[j for j, owner in enumerate(system.owners) if owner in ("beam.start", "tip")]] = 1.0
    tip_inertia = 1e-7 + 1e-3 * L**2

    def moment(power):
        return integral(name, lambda s: RHO * width(name, s) * thickness(name, s) * s**power)

    inertia = moment(2)
    if KINDS[name].profile == "notch":
        inertia += integral(name, lambda s: RHO * WIDTH * thickness(name, s) ** 3 / 12)
    assert system.m.sum() - 1e-3 == pytest.approx(moment(0), rel=2e-4)
    first = (system.m @ (system.c + system.A @ e)).real - 1e-3 * L
    assert first == pytest.approx(moment(1), rel=2e-4)
    found = rigid @ system.mass_matrix(e) @ rigid
    assert found == pytest.approx(inertia + tip_inertia, rel=1e-4)


def test_a_taper_between_equal_ends_is_a_leaf():
    leaf, taper = kind(order=3), kind(profile="taper", end_thickness=5e-4, order=3)
    found = [
        modes(system, equilibrium(system, loads={"force.y": 0.5})).frequency
        for system in map(cantilever, (leaf, taper))
    ]
    np.testing.assert_allclose(*found, rtol=1e-12)


@pytest.mark.parametrize("name", KINDS)
def test_a_beam_stretches_by_the_integral_of_its_axial_flexibility(name):
    system = cantilever(replace(KINDS[name], axial=True))
    flexibility = integral(name, lambda s: 1 / (E * width(name, s) * thickness(name, s)))
    z, _ = tip(system, 1e-7 * L / flexibility + 0j)
    elongation = complex(z).real / L - 1.0
    assert elongation / 1e-7 == pytest.approx(1.0, rel=1e-6)  # The strain is logarithmic.


@pytest.mark.parametrize("name", ["taper", "wide taper"])
def test_the_thin_half_of_a_taper_stretches_more(name):
    """The displacement of the middle is the integral of the flexibility of the first half."""

    def flexibility(s):
        return 1 / (E * width(name, s) * thickness(name, s))

    system = cantilever(replace(KINDS[name], axial=True, nodes=8))
    force = 1e-6 * L / integral(name, flexibility)
    q = equilibrium(system, loads={"force.x": force}).q
    line = next(one for one in system.outlines if one.kind == "flexure")
    middle = len(line.c) // 2
    moved = (line.A @ (system.directions(q) - system.directions(system.q0)))[middle].real
    assert moved == pytest.approx(force * quad(flexibility, 0.0, L / 2)[0], rel=1e-4)
    assert abs(moved / (1e-6 * L) - 0.5) > 0.02


def elements(name, mass, inertia):
    """Return the frequencies of a cantilever with a tip body, by Hermite elements [Hz]."""
    fine = L / 2 + np.linspace(-3e-3, 3e-3, 241) if KINDS[name].hinge else np.linspace(0.0, L, 301)
    edges = np.unique(np.concatenate([np.linspace(0.0, L, 61), fine, panels(name)]))
    edges = edges[np.diff(edges, append=1.0) > 1e-6]
    n = 2 * len(edges)
    K, M = np.zeros((n, n)), np.zeros((n, n))
    for i, (a, b) in enumerate(pairwise(edges)):
        h, s = b - a, 0.5 * (a + b)
        at = slice(2 * i, 2 * i + 4)
        K[at, at] += rigidity(name, s) / h**3 * np.array(
            [[12, 6 * h, -12, 6 * h], [6 * h, 4 * h**2, -6 * h, 2 * h**2],
             [-12, -6 * h, 12, -6 * h], [6 * h, 2 * h**2, -6 * h, 4 * h**2]]
        )  # fmt: skip
        area = width(name, s) * thickness(name, s)
        M[at, at] += RHO * area * h / 420 * np.array(
            [[156, 22 * h, 54, -13 * h], [22 * h, 4 * h**2, 13 * h, -3 * h**2],
             [54, 13 * h, 156, -22 * h], [-13 * h, -3 * h**2, -22 * h, 4 * h**2]]
        )  # fmt: skip
        if KINDS[name].profile == "notch":
            M[at, at] += RHO * area * thickness(name, s) ** 2 / 12 / (30 * h) * np.array(
                [[36, 3 * h, -36, 3 * h], [3 * h, 4 * h**2, -3 * h, -(h**2)],
                 [-36, -3 * h, 36, -3 * h], [3 * h, -(h**2), -3 * h, 4 * h**2]]
            )  # fmt: skip
    M[-2, -2] += mass
    M[-1, -1] += inertia
    flexibilities = eigh(M[2:, 2:], K[2:, 2:], eigvals_only=True)  # 1/omega^2, without round-off.
    return 1.0 / np.sqrt(flexibilities[:-3:-1]) / (2 * math.pi)


@pytest.mark.parametrize("name", KINDS)
def test_frequencies_with_a_body_at_the_tip_are_those_of_elements(name):
    system = cantilever(KINDS[name])
    found = modes(system, equilibrium(system)).frequency[:2]
    np.testing.assert_allclose(found, elements(name, 1e-3, 1e-7), rtol=2e-3)


REJECTED = {
    "order 0": ({"order": 0}, "neck.order = 0 must lie between 1 and 12"),
    "order 50": ({"order": 50}, "neck.order = 50 must lie between 1 and 12"),
    "few nodes": ({"order": 3, "nodes": 4}, "neck.nodes = 4 must lie between 5"),
    "unknown": ({"profile": "hole"}, "neck.profile = 'hole' is unknown: choose one of leaf, taper"),
    "no radius": ({"profile": "notch"}, "neck.notch_radius is missing"),
    "other profile": (
        {"profile": "taper", "notch_radius": 1e-3},
        "neck.notch_radius is not a dimension of the profile taper; remove it, or choose the "
        "profile notch",
    ),
    "other model": (
        {"model": "2R", "curvature": 1.0},
        "neck.curvature: only the model beam has it; remove curvature",
    ),
    "model without profile": ({"model": "2R", "profile": "taper"}, "neck.profile: only the model"),
    "curved notch": (
        {"profile": "notch", "notch_radius": 1e-3, "rise": 1e-3},
        "neck.rise is not a dimension of the profile notch",
    ),
    "arc and cosine": ({"curvature": 1.0, "rise": 1e-3}, "neck.curvature excludes neck.rise"),
    "vanishing taper": (
        {"profile": "taper", "end_thickness": 0.0},
        "neck.end_thickness = 0 m must be at least 1e-09 m",
    ),
    "inverted taper": (
        {"profile": "taper", "end_thickness": -1e-3},
        "neck.end_thickness = -0.001 m must be at least 1e-09 m",
    ),
    "inverted notch": (
        {"profile": "notch", "notch_radius": 1e-3, "end_thickness": 4e-4},
        "must be above the thickness of its waist, 0.0005 m: increase end_thickness",
    ),
    "long notch": (
        {"profile": "notch", "notch_radius": 0.016},
        "its notch of the length 0.032 m is longer than the flexure, 0.03 m: reduce notch_radius",
    ),
    "long waist": (
        {"profile": "notch", "notch_radius": 1e-3, "waist_length": 0.029},
        "its notch of the length 0.031 m is longer than the flexure",
    ),
    "steep arc": (
        {"curvature": -70.0},
        "neck.curvature = -70 1/m is impossible for ends at the distance 0.03 m: choose one below "
        "66.6667 1/m",
    ),
    "high rise": (
        {"rise": 0.04},
        "neck.rise = 0.04 m is impossible for ends at the distance 0.03 m: choose a rise below",
    ),
    "zero density": ({"density": 0.0}, "neck.density = 0 kg/m3 must be at least 1 kg/m3"),
}


@pytest.mark.parametrize("mistake", REJECTED)
def test_mistakes_in_profiles_are_rejected_with_a_remedy(mistake):
    changes, words = REJECTED[mistake]
    with pytest.raises((MechanismError, ParameterError)) as error:
        cantilever(replace(kind(), **changes))
    assert words in str(error.value)


@pytest.mark.parametrize("x", [0.0, 0.013, 0.1])
def test_a_notch_between_its_edges_has_the_stiffness_of_its_sections_wherever_it_is_drawn(x):
    """The distance of the ends is that of the edges, apart from round-off."""
    hinge = kind(profile="notch", notch_radius=4e-3)
    description = Mechanism(
        name="Hinge",
        title="A hinge",
        ground={"clamp": (x, 0.0)},
        bodies=(Body("tip", 1e-3, 1e-7, (x + 0.008, 0.0), {"end": (x + 0.008, 0.0)}),),
        flexure_types=(hinge,),
        flexures=(Flexure("beam", hinge.name, "ground.clamp", "tip.end"),),
        forces=(Force("force", "tip"),),
        release=Release("tip", direction=90.0),
    )
    _, slope = tip(assemble(description, description.values()), moment=1e-3)
    exact = paros_weisbord(4e-3, hinge.thickness, hinge.width, hinge.youngs_modulus)
    assert slope == pytest.approx(1e-3 / exact, rel=1e-6)


@pytest.mark.parametrize("engine", [Simulation, KernelSimulation])
def test_a_notch_may_be_as_long_as_its_flexure_apart_from_round_off(engine):
    """Ends at 47 and 53 mm are nearer than 6 mm by round-off."""
    guide = mechanism("NotchGuide")
    found = [
        engine(guide, {"notch.length": 8e-3 * (1.0 + change)}).outputs()["energy.elastic"]
        for change in (-1e-12, 1e-12)
    ]
    assert found[0] == pytest.approx(found[1], rel=1e-9)
    with pytest.raises(ParameterError, match="is longer than the flexure"):
        engine(guide, {"notch.length": 8e-3 * (1.0 - 1e-6)})


def test_a_low_order_between_two_clamps_is_rejected_except_for_hinges():
    for k in (kind(order=2), kind(order=2, profile="taper", end_thickness=1e-3)):
        with pytest.raises(MechanismError, match="too stiff with an order below 3"):
            cantilever(k, ("clamp", "clamp"))
    cantilever(kind(order=1, profile="notch", notch_radius=4e-3), ("clamp", "clamp"))


# --- curved beams -------------------------------------------------------------------------------


def drawn(curvature, rise, u):
    """Return the angle of the line from the chord, and ds/du, at 0 <= u <= 1 along it."""
    if curvature:
        half = math.asin(0.5 * curvature * L)
        return half * (2 * u - 1), 2 * half / curvature
    span = math.sqrt(L**2 - rise**2)
    slope = 0.5 * math.pi * rise / span * np.sin(math.pi * u)
    return np.arctan(slope) - math.asin(rise / L), span * np.sqrt(1 + slope**2)


def curved_elastica(curvature, rise, force, moment):
    """Return the tip of a curved beam under dead loads, by shooting from the tip."""
    EI = E * WIDTH * 5e-4**3 / 12

    def clamp(turn):
        def change(u, y):
            M = moment - (complex(y[1], -y[2]) * force).imag
            angle, ds = drawn(curvature, rise, u)
            return [ds * M / EI, ds * math.cos(y[0] + angle), ds * math.sin(y[0] + angle)]

        start = np.array([turn, 0.0, 0.0])
        return solve_ivp(change, (1.0, 0.0), start, method="DOP853", rtol=1e-11, atol=1e-14).y[
            :, -1
        ]

    turn = newton(lambda angle: clamp(angle)[0], 0.5, tol=1e-10)
    return -complex(*clamp(turn)[1:]), turn


CURVED = {"arc": (20.0, 0.0), "half circle": (-60.0, 0.0), "flat": (0.0, 2e-3), "s": (0.0, -0.01)}


def curved(name, **given):
    curvature, rise = CURVED[name]
    shape = {"curvature": curvature} if curvature else {"rise": rise}
    return kind(**shape, **given)


@pytest.mark.parametrize("name", CURVED)
def test_a_curved_beam_bends_by_40_degrees_like_the_boundary_value_problem(name):
    stiffness = math.radians(40.0) * E * WIDTH * 5e-4**3 / 12 / L
    force, moment = (0.8j - 0.6) * stiffness / L, 0.5 * stiffness
    exact, turn = curved_elastica(*CURVED[name], force, moment)
    assert turn > math.radians(20.0)
    for order, limit in ((3, 1e-3), (5, 1e-5)):
        z, found = tip(cantilever(curved(name, order=order, nodes=order + 5)), force, moment)
        assert abs(z - exact) < limit * abs(exact - L)
        assert found == pytest.approx(turn, rel=limit)


@pytest.mark.parametrize("name", CURVED)
def test_a_curved_beam_is_drawn_with_its_curvature_or_rise_and_is_free_of_stress(name):
    system = cantilever(curved(name, order=3))
    shape = equilibrium(system)
    np.testing.assert_allclose(shape.q, system.q0, atol=1e-12)
    line = next(one for one in system.outlines if one.kind == "flexure")
    z = line.c + line.A @ system.directions(system.q0)
    assert abs(z[0]) < 1e-15
    assert z[-1] == pytest.approx(L, abs=1e-12)
    curvature, rise = CURVED[name]
    if curvature:
        centre = 0.5 * L + 1j * math.sqrt(1 / curvature**2 - L**2 / 4) * np.sign(curvature)
        np.testing.assert_allclose(abs(z - centre), 1 / abs(curvature), rtol=1e-4)
        assert np.sign(z[len(z) // 2].imag) == -np.sign(curvature)
        length = 2 * math.asin(0.5 * abs(curvature) * L) / abs(curvature)
    else:
        along = z * np.exp(1j * math.asin(rise / L))
        span = math.sqrt(L**2 - rise**2)
        wave = 0.5 * rise * (1 - np.cos(math.pi * along.real / span))
        np.testing.assert_allclose(along.imag, wave, atol=3e-5 * L)
        length = quad(lambda u: drawn(0.0, rise, u)[1], 0.0, 1.0)[0]
    assert system.m.sum() - 1e-3 == pytest.approx(RHO * WIDTH * 5e-4 * length, rel=1e-5)


@pytest.mark.parametrize("name", CURVED)
def test_a_curved_beam_is_the_same_from_either_end(name):
    """The signs of the curvature and the rise: seen from the end, an arc turns the other way."""
    systems = []
    for backwards in (False, True):
        k = curved(name, order=3, axial=True)
        if backwards and k.curvature is not None:
            k = replace(k, curvature=-k.curvature)
        systems.append(cantilever(k, backwards=backwards))
    load = 0.3j / L * E * WIDTH * 5e-4**3 / 12 / L
    assert tip(systems[0], load)[0] == pytest.approx(tip(systems[1], load)[0], abs=1e-9 * L)


# --- forces, moments and stress in the sections -------------------------------------------------


def sections_of(system, force, moment):
    """Return the loads in the sections of a cantilever whose tip is loaded [N], [N m]."""
    loads = {"force.x": force.real, "force.y": force.imag, "force.moment": moment}
    shape = equilibrium(system, loads=loads)
    return static_section_loads(system, shape, {"force.x": force.real, "force.y": force.imag})[0]


def waist_factors(k):
    """Return the factors of the stress at the waist of a type of flexures; 1 for a taper."""
    if k.profile != "notch":
        return 1.0, 1.0
    return concentration(k.thickness, k.notch_radius**2 / (k.notch_depth or k.notch_radius))


def exact_loads(name, force, moment, position):
    """Return normal force and bending moment of a straight cantilever at positions [N], [N m]."""
    y = np.array([elastica(name, force, moment)[1], 0.0, 0.0])
    ends = np.unique([*panels(name), *position])[::-1]
    found = {}
    for start, end in [(L, L), *pairwise(ends)]:

        def change(s, y):
            M = moment - (complex(y[1], -y[2]) * force).imag
            return [M / rigidity(name, s), math.cos(y[0]), math.sin(y[0])]

        if start > end:
            y = solve_ivp(change, (start, end), y, method="DOP853", rtol=1e-10, atol=1e-14).y[:, -1]
        M = moment - (complex(y[1], -y[2]) * force).imag
        found[end] = (force.conjugate() * complex(math.cos(y[0]), math.sin(y[0]))).real, M
    return np.array([found[s] for s in position]).T


@pytest.mark.parametrize("backwards", [False, True])
@pytest.mark.parametrize("name", KINDS)
def test_sections_of_a_profile_carry_the_loads_of_the_boundary_value_problem(name, backwards):
    slope = math.radians(40.0)
    moment = 0.5 * slope / weakness(name, lambda s: 1.0)
    force = 0.6j * slope / weakness(name, lambda s: L - s)
    force -= 0.3 * abs(force)
    k = KINDS[name]
    if backwards and k.profile == "taper":  # The start is the other end.
        k = replace(k, thickness=k.end_thickness, end_thickness=k.thickness,
                    width=k.end_width or k.width, end_width=k.width)  # fmt: skip
    found = sections_of(cantilever(k, backwards=backwards), force, moment)
    order = slice(None, None, -1) if backwards else slice(None)
    position = (L - found.position if backwards else found.position)[order].clip(0.0, L)
    tension, bending = exact_loads(name, force, moment, position)
    bent = -found.bending if backwards else found.bending
    # The direction at a waist between two nodes is interpolated.
    waist = abs(abs(position - L / 2) - (k.waist_length or 0.0) / 2) < 1e-12
    bounds = np.where(waist, 5e-3, 2e-4) * abs(force)
    assert np.all(abs(found.tension[order] - tension) < bounds)
    bent, exact = bent[order] / found.modulus[order], bending / found.modulus[order]
    np.testing.assert_allclose(bent, exact, atol=1e-3 * abs(exact).max())
    h, b = (np.array([f(name, s) for s in position]) for f in (thickness, width))
    pulled, turned = np.where(waist, np.array(waist_factors(k))[:, None], 1.0)
    np.testing.assert_allclose(found.area[order], b * h / pulled, rtol=1e-6)
    np.testing.assert_allclose(found.modulus[order], b * h**2 / 6 / turned, rtol=1e-6)


@pytest.mark.parametrize("backwards", [False, True])
@pytest.mark.parametrize("name", KINDS)
def test_sections_of_a_hanging_profile_carry_the_weight_beyond_them(name, backwards):
    hanging = replace(cantilever(KINDS[name], backwards=backwards).mechanism, gravity=(9.81, 0.0))
    system = assemble(hanging, hanging.values())
    found = static_section_loads(system, equilibrium(system))[0]
    weight = 9.81 * (system.m.sum() - 1e-3)

    def density(s):
        return 9.81 * RHO * width(name, s) * thickness(name, s)

    # Seen from the start; the tip is the start of a flexure that runs backwards.
    beyond = [quad(density, 0.0, s, points=panels(name), limit=200)[0] for s in found.position]
    expected = 9.81e-3 + (np.array(beyond) if backwards else weight - np.array(beyond))
    np.testing.assert_allclose(found.tension, expected, atol=0.05 * weight)
    assert abs(found.bending).max() < 1e-9 * weight * L
    assert found.tension[-1 if backwards else 0] == pytest.approx(9.81e-3 + weight, rel=1e-9)


@pytest.mark.parametrize("nodes", [8, 9])
@pytest.mark.parametrize("name", [n for n in KINDS if KINDS[n].profile == "notch"])
def test_a_notch_under_a_moment_has_the_largest_stress_at_its_waist(name, nodes):
    k = replace(KINDS[name], nodes=nodes)
    moment = 0.3 / weakness(name, lambda s: 1.0)
    loads = sections_of(cantilever(k), 0j, moment)
    found = stress(loads)
    factor = waist_factors(k)[1]
    assert found.largest == pytest.approx(factor * 6 * moment / (WIDTH * 5e-4**2), rel=1e-9)
    assert found.position == pytest.approx(0.5 * (L - (k.waist_length or 0.0)), abs=1e-12)
    left, right = faces(loads)
    np.testing.assert_allclose(left, -right, rtol=1e-9)
    assert np.all(np.diff(loads.position) > 0.0)


@pytest.mark.parametrize(
    ("axes", "ratio", "bent", "pulled"),
    [
        ((1.0, 1.0), 0.1, 0.004, 0.004),
        ((1.0, 1.0), 0.5, 0.006, 0.015),
        ((1.0, 1.0), 2.0, 0.006, 0.035),
        ((1.0, 0.5), 0.5, 0.006, 0.015),
        ((1.0, 2.0), 0.5, 0.01, 0.015),
    ],
)
def test_factors_at_the_waist_of_a_notch_are_those_of_plane_elasticity(axes, ratio, bent, pulled):
    """The ratio is that of the waist to the half axis along the flexure."""
    factors = concentration(ratio, axes[0] ** 2 / axes[1])
    mesh = plane_stress.notched(axes, ratio)
    assert factors[1] == pytest.approx(plane_stress.concentration(mesh, bending=True), rel=bent)
    assert factors[0] == pytest.approx(plane_stress.concentration(mesh, bending=False), rel=pulled)


@pytest.mark.parametrize(("ratio", "excess"), [(0.1, 0.015), (0.5, 0.035), (1.0, 0.05)])
def test_factors_at_fillets_are_slightly_above_those_of_plane_elasticity(ratio, excess):
    mesh = plane_stress.notched((1.0, 1.0), ratio, length=2 * ratio)
    for bending, factor in zip((False, True), concentration(ratio, 1.0), strict=True):
        found = plane_stress.concentration(mesh, bending)
        assert found < factor < (1 + excess) * found


def test_factors_of_slender_and_of_sharp_notches():
    """A slender waist has none; those of a sharp one rise with the root of its sharpness."""
    assert concentration(1e-12, 1.0) == pytest.approx((1.0, 1.0), abs=1e-11)
    x = 1e8
    sharp = concentration(2 * x, 1.0)
    assert sharp == pytest.approx(
        (4 / math.pi * math.sqrt(x), 8 / (3 * math.pi) * math.sqrt(x)), rel=1e-3
    )
    below, above = concentration(2 * (1e-6 - 1e-18), 1.0), concentration(2 * (1e-6 + 1e-18), 1.0)
    assert below == pytest.approx(above, rel=1e-9)


@pytest.mark.parametrize("name", CURVED)
def test_sections_of_a_curved_beam_balance_the_loads_at_its_tip(name):
    """The moment in a section is that of the tip's loads about it, in the deflected shape."""
    stiffness = math.radians(40.0) * E * WIDTH * 5e-4**3 / 12 / L
    force, moment = (0.8j - 0.6) * stiffness / L, 0.5 * stiffness
    system = cantilever(curved(name, order=7, nodes=12))
    loads = {"force.x": force.real, "force.y": force.imag, "force.moment": moment}
    shape = equilibrium(system, loads=loads)
    e = system.directions(shape.q)
    found = static_section_loads(system, shape, {"force.x": force.real, "force.y": force.imag})[0]
    frame = system.bodies["tip"]
    end = complex(frame.A @ e) + frame.c
    nodes = (system.A @ e + system.c)[system.connections[0].flexure.masses]
    z = np.array([0.0, *nodes, end])
    expected = moment + ((end - z).conj() * force).imag
    np.testing.assert_allclose(found.bending, expected, atol=1e-4 * abs(expected).max())
    curvature, rise = CURVED[name]
    u = found.position / found.position[-1]  # along an arc
    if rise:
        assert found.position[-1] == pytest.approx(
            quad(lambda t: drawn(0.0, rise, t)[1], 0.0, 1.0)[0], rel=1e-6
        )
    else:
        turned = np.array([0.0, *np.angle(e[system.connections[0].flexure.arms]), shape.q[frame.j]])
        angle = turned + drawn(curvature, rise, u)[0]
        tension = (force.conjugate() * np.exp(1j * angle)).real
        np.testing.assert_allclose(found.tension, tension, atol=1e-9 * abs(force))
