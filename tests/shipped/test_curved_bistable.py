"""Curved bistable: its snap-through forces against a boundary value problem."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.optimize import root

from kernel_simulation import KernelSimulation
from prbm.analysis.holding import curve
from prbm.files.mechanism_file import load
from prbm.mechanics.assembly import assemble
from prbm.mechanics.statics import equilibrium
from support import CASES, mechanism

BISTABLE = mechanism("CurvedBistable")
RISE = 3.2e-3


def of_order(order, nodes=None, **values):
    kinds = tuple(replace(k, order=order, nodes=nodes) for k in BISTABLE.flexure_types)
    other = replace(BISTABLE, flexure_types=kinds)
    return assemble(other, other.values({"gravity.y": 0.0, "pom.density": 1.0, **values}))


def snap_forces(displacements, thickness):
    """Return the forces that hold four halves of guided cosine beams at displacements [N].

    A half is clamped at the ground.  By symmetry, its other end moves down without rotation.  The
    unknowns are force and moment at the clamp; each displacement starts from the last solution.
    """
    span, E, width = 0.04, 2.8e9, 0.01
    EI, EA = E * width * thickness**3 / 12, E * width * thickness
    scale = EI / span**2

    def end(loads):
        force = complex(*loads[:2]) * scale

        def change(x, y):
            slope = 0.5 * math.pi * RISE / span * math.sin(math.pi * x / span)
            ds, angle = math.hypot(1.0, slope), math.atan(slope) + y[0]
            M = loads[2] * scale * span - (complex(y[1], -y[2]) * force).imag
            strain = (complex(math.cos(angle), -math.sin(angle)) * force).real / EA
            longer = ds * math.exp(strain)
            return [ds * M / EI, longer * math.cos(angle), longer * math.sin(angle)]

        found = solve_ivp(change, (0.0, span), np.zeros(3), method="DOP853", rtol=1e-10, atol=1e-13)
        return found.y[:, -1]

    result, loads = [], np.zeros(3)
    for d in displacements:

        def miss(loads, d=d):
            return (end(loads) - [0.0, span, RISE - d]) / [0.1, 1e-2 * span, 1e-2 * span]

        found = root(miss, loads, tol=1e-10)
        assert found.success
        loads = found.x
        result.append(-4 * loads[1] * scale)
    return np.array(result)


@pytest.mark.slow
@pytest.mark.parametrize(("thickness", "last"), [(1e-3, 5.4e-3), (1.4e-3, 6.0e-3)])
def test_snap_through_forces_are_those_of_the_boundary_value_problem(thickness, last):
    """The second stable shape exists for the thin beams only, whose force becomes negative.

    The force of beams of the order 5 is 0.2 % too large, because their strain is uniform.
    """
    displacements = np.linspace(0.2e-3, last, 27)
    exact = snap_forces(displacements, thickness)
    peak = exact.max()
    assert (exact.min() < 0.0) == (thickness < RISE / 2.31)
    for order, limit, of_peak in ((3, 0.06, 0.02), (5, 4e-3, 2.5e-3)):
        system = of_order(order, **{"beam.thickness": thickness})
        found = np.array([equilibrium(system, d).force for d in displacements])
        assert np.abs(found - exact).max() < limit * peak
        assert found.max() == pytest.approx(peak, rel=of_peak)
        assert found.min() == pytest.approx(exact.min(), abs=of_peak * peak)


def test_the_second_stable_shape_is_twice_the_rise_away():
    """Flat beams with a large rise over thickness have their second shape at 1.99 rises [1].

    [1] J. Qiu, J. H. Lang, A. H. Slocum, J. Microelectromech. Syst. 13 (2004) 137.
    """
    system = of_order(5)
    near, far = 1.6 * RISE, 1.99 * RISE
    forces = [equilibrium(system, d).force for d in np.linspace(near, far, 5)]
    assert forces[0] < 0.0
    assert min(forces) < -0.3 * max(abs(f) for f in forces)


@pytest.mark.slow
def test_tall_beams_need_the_order_5():
    """The rise is 15 times the thickness.  The limits are those of the page on flexure models."""
    thickness = RISE / 15
    displacements = np.linspace(0.05e-3, 1.6e-3, 32)
    peak = snap_forces(displacements, thickness).max()
    excess = []
    for order in (3, 5):
        system = of_order(order, **{"beam.thickness": thickness})
        found = [equilibrium(system, d).force for d in displacements]
        excess.append(max(found) / peak - 1.0)
    assert 0.05 < excess[0] < 0.095
    assert abs(excess[1]) < 2e-3


@pytest.mark.slow
@pytest.mark.parametrize("order", [3, 5])
def test_a_force_that_grows_snaps_the_mechanism_where_its_shape_becomes_unstable(order):
    """Under 0.5 % less than the force the shuttle stays, under 0.5 % more it snaps.

    A moment breaks the symmetry: the beams buckle before the force has its largest value.
    """
    kinds = tuple(replace(kind, order=order, nodes=None) for kind in BISTABLE.flexure_types)
    guide = replace(BISTABLE, flexure_types=kinds)
    held = curve(assemble(guide, guide.values({"gravity.y": 0.0})), np.linspace(-2e-4, 6.5e-3, 41))
    near, middle, far = (rest.displacement for rest in held.rests)
    (place, force), back = held.snaps
    assert near < place < middle < back[0] < far
    assert force < 0.97 * max(point.force for point in held.points)
    for share, snaps in ((0.995, False), (1.005, True)):
        sim = KernelSimulation(
            guide, {"gravity.y": 0.0, "release.velocity": 0.0, "damping.zeta": 0.3}
        )
        snapped = False
        for k in range(1, 201):
            load = share * force * min(1.0, k / 50)
            sim.set({"force.y": -load, "force.moment": 1e-5})
            sim.advance(2e-3 * k)
            snapped = sim.outputs()["shuttle.y"] < -1.5 * place
            if snapped:
                break
        assert snapped is snaps


RISE_OF_QIU, SPAN_OF_QIU = 60e-6, 3e-3


def double_beam(folder, Q, order, rise=RISE_OF_QIU):
    """Return the double curved beam with a rise Q times its thickness, and its unit of force."""
    thickness = rise / Q
    text = (CASES / "qiu10.toml").read_text(encoding="utf-8")
    for old, new in (
        ("rise = 6e-05", f"rise = {rise!r}"), ("rise = -6e-05", f"rise = {-rise!r}"),
        ("[0, 0.00016]", f"[0, {1e-4 + rise!r}]"), ("[0, -4e-05]", f"[0, {rise - 1e-4!r}]"),
        ("[0, 6e-05]", f"[0, {rise!r}]"), ("6e-06", repr(thickness)),
        ("order = 7", f"order = {order}"),
    ):  # fmt: skip
        assert old in text
        text = text.replace(old, new)
    path = folder / "double.toml"
    path.write_text(text, encoding="utf-8")
    beams = load(path)
    EI = 169e9 * 0.49e-3 * thickness**3 / 12
    return assemble(beams, beams.values()), 2 * EI * rise / SPAN_OF_QIU**3


def shallow_arch(Q):
    """Return displacement [rise] and force [EI h/l^3] of a clamped arch that buckles sideways.

    Under the axial force N^2 EI/l^2 the shape is a (1 - cos 2 pi x) / 2 - F y(x) with
    a = 4 pi^2 / (4 pi^2 - N^2) and the shape y of a clamped beam-column under a unit force.  It
    buckles at N = 4 pi, where y' = (1 - cos N x) / (2 N^2) in the first half.  The beam is shorter
    by N^2 / (12 Q^2) in units of h^2/l [1].

    [1] J. Qiu, J. H. Lang, A. H. Slocum, J. Microelectromech. Syst. 13 (2004) 137.
    """
    N = 4 * math.pi
    a = 4 * math.pi**2 / (4 * math.pi**2 - N**2)

    def slope(x):
        return (1 - math.cos(N * x)) / (2 * N**2)

    def arch(x):
        return math.pi * math.sin(2 * math.pi * x)

    deflection = quad(slope, 0, 0.5)[0]
    mixed, square = (
        2 * quad(f, 0, 0.5)[0] for f in (lambda x: arch(x) * slope(x), lambda x: slope(x) ** 2)
    )
    shortening = 0.5 * (1 - a * a) * math.pi**2 / 2 - N**2 / (12 * Q**2)
    force = min(np.roots([-0.5 * square, a * mixed, shortening]).real)
    return 1 - (a - force * deflection), -force


@pytest.mark.parametrize("Q", [3, 6, 10, 15])
def test_a_double_curved_beam_buckles_at_the_force_of_shallow_arches(Q, tmp_path):
    """The force of Q = 10 is 743.2 EI h/l^3 for each beam, at 0.157 h [1].

    A first direction becomes unstable up to 0.9 % before: the shuttle turns.  Three more follow, in
    each of the four half beams one.  In the steep beams, h/l = 0.02, theory is 0.3 % too large; in
    beams with a rise of a twentieth, all directions meet in the theory.

    [1] J. Qiu, J. H. Lang, A. H. Slocum, J. Microelectromech. Syst. 13 (2004) 137.
    """
    place, force = shallow_arch(Q)
    if Q == 10:
        assert force == pytest.approx(743.2, abs=0.05)
        assert place == pytest.approx(0.157, abs=5e-4)
    found = []
    for order, rise in ((5, RISE_OF_QIU), (7, RISE_OF_QIU), (7, RISE_OF_QIU / 20)):
        system, unit = double_beam(tmp_path, Q, order, rise)
        held = curve(system, [0.0, 0.6 * rise])
        buckled = [event for event in held.events if event.kind == "bifurcation"]
        assert sum(event.critical for event in buckled) == 4
        found.append([(event.force / unit, event.displacement / rise) for event in buckled])
        assert held.ended is None
    coarse, fine, flat = found
    assert coarse[0][0] == pytest.approx(fine[0][0], rel=1e-3)
    assert coarse[-1][0] == pytest.approx(fine[-1][0], rel=1e-3)
    assert -0.01 < fine[0][0] / force - 1 < 0.0
    assert -0.003 < fine[-1][0] / force - 1 < 0.0
    assert fine[-1][1] == pytest.approx(place, rel=4e-3)
    assert flat[-1] == pytest.approx((force, place), rel=2e-4)
    if Q == 10:
        assert 734 < fine[0][0] < 737.5
        assert 741 < fine[-1][0] < 744


@pytest.mark.slow
def test_a_double_curved_beam_has_a_second_stable_position_beyond_its_buckled_branch(tmp_path):
    """The symmetric shapes turn back in force and displacement many times on the way.

    The branch from the first bifurcation returns near it.  On the way it carries at most 2 % more
    than the force of the bifurcation, and none of its shapes under a smaller force is stable.
    """
    system, unit = double_beam(tmp_path, 10, 5)
    held = curve(system, np.linspace(0.0, 0.13e-3, 14), branches=1)
    assert held.ended is None
    assert held.rests[0].stable
    assert held.rests[-1].stable
    assert 1.95 < held.rests[-1].displacement / RISE_OF_QIU < 2.0
    assert not any(rest.stable for rest in held.rests[1:-1])
    assert {"limit point", "displacement limit"} <= {event.kind for event in held.events}
    branch, first = held.branches[0], held.events[0]
    assert branch.displacements[0] == first.displacement
    assert branch.forces.max() < 1.02 * first.force
    ahead = branch.displacements > 1.1 * first.displacement
    assert ahead.any()
    assert np.all(branch.unstable[ahead] > 0)
    assert unit > 0.0
