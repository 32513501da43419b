"""Paths of equilibria under loads that vary."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.special import ellipk

from prbm.analysis.holding import curve
from prbm.analysis.load_path import held_path, load_path
from prbm.analysis.path_following import CLOSED, POLE, REACH, REST_SHARE
from prbm.base.errors import EquilibriumError
from prbm.files.mechanism_file import load
from prbm.mechanics.assembly import assemble
from prbm.mechanics.forces import elastic_energy
from prbm.mechanics.statics import holding_stiffness
from prbm.mechanism.parts import Force
from prbm.plots.load_path import load_path_figure
from random_equilibria import free_of_contacts
from random_mechanisms import seeded
from support import ROOT, mechanism

CASES = ROOT / "tests" / "cases"


def pushed(given, **values):
    """Return the system of a mechanism with a force on its released body."""
    body = given.release.body
    return assemble(
        replace(given, forces=(Force("push", body),)),
        replace(given, forces=(Force("push", body),)).values(values),
    )


def amounts(system, path):
    return np.array([system.amount(point.shape.q) for point in path.points])


def test_the_limit_points_of_a_truss_are_those_of_its_closed_form():
    """Four struts with the energy EA L s^2 / 2, s = ln(l / L), carry dU/dd."""
    system = pushed(mechanism("Bistable"), **{"gravity.x": 0.0, "gravity.y": 0.0})
    V = system.values
    span, rise = V["strut.span"], V["strut.rise"]
    EA = V["polyurethane.youngs_modulus"] * V["strut.thickness"] * V["strut.width"]
    length = math.hypot(span, rise)

    def carried(d):
        now = np.hypot(span, rise - d)
        return -4 * EA * length * np.log(now / length) * (rise - d) / now**2

    path = load_path(system, {}, {"push.y": -30.0})
    assert path.ended is None
    d, force = amounts(system, path), np.array([30.0 * point.share for point in path.points])
    np.testing.assert_allclose(force, carried(d), atol=1e-7)
    grid = carried(np.linspace(0.0, 2 * rise, 200_001))
    events = [(kind, 30.0 * point.share) for kind, point in path.events if kind == "limit point"]
    assert [kind for kind, _ in events] == 2 * ["limit point"]
    np.testing.assert_allclose([x for _, x in events], [grid.max(), grid.min()], rtol=1e-6)
    stable = np.array([point.unstable == 0 for point in path.points])
    assert stable[0]
    assert stable[-1]
    assert not stable.all()


def test_the_energy_along_a_path_is_the_work_of_the_load():
    """DU = P du, also where the load falls and the displacement turns back."""
    system = assemble(load(CASES / "lee.toml"), load(CASES / "lee.toml").values())
    path = load_path(system, {}, {"P.y": -25e3})
    (frame,) = system.pushed
    y = np.array(
        [(frame.c + frame.A @ system.directions(point.shape.q)).imag for point in path.points]
    )
    P = np.array([-25e3 * point.share for point in path.points])
    U = np.array([elastic_energy(system.K, point.shape.q - system.q0) for point in path.points])
    work = np.cumsum(0.5 * (P[1:] + P[:-1]) * np.diff(y))
    assert np.abs(U[1:] - work).max() < 2e-3 * U.max()
    (kind, first), *_ = path.events
    assert kind == "limit point"
    assert -25e3 * first.share == pytest.approx(-18.55e3, rel=1e-3)  # Finite elements.
    assert system.amount(first.shape.q) == pytest.approx(0.487, abs=1e-3)


@pytest.mark.parametrize(("order", "error"), [(3, 3e-4), (5, 1e-6)])
def test_a_symmetric_column_bifurcates_at_the_load_of_euler(order, error):
    """Two clamped and guided leaves buckle sideways under pi^2 EI / L^2 each."""
    frame = load(CASES / "buckle.toml")
    leaves = tuple(replace(kind, order=order) for kind in frame.flexure_types)
    straight = replace(frame, flexure_types=leaves)
    system = pushed(straight, **{"gravity.x": 0.0, "gravity.y": 0.0})
    critical = 2 * math.pi**2 * 2e11 * 8e-3 * 2e-4**3 / 12 / 0.05**2
    path = load_path(system, {}, {"push.y": -1.5 * critical})
    assert np.abs(amounts(system, path)).max() < 1e-9
    (kind, point), *_ = path.events
    assert kind == "bifurcation"
    assert point.share == pytest.approx(1 / 1.5, rel=error)


def test_the_slope_of_a_path_is_the_stiffness():
    system = pushed(mechanism("CurvedBistable"), **{"gravity.y": 0.0})
    path = load_path(system, {}, {"push.y": -15.0})
    for point in path.points[::3]:
        t, n = point.tangent, system.n
        along = float(system.gradient(system.release, system.directions(point.shape.q)) @ t[:n])
        assert 15.0 * t[-1] / along == pytest.approx(
            holding_stiffness(system, point.shape), rel=1e-7
        )


def test_a_path_that_begins_without_stiffness_is_refused():
    arm = mechanism("Cantilever")
    (leaf,) = arm.flexures
    hinged = replace(arm, flexures=(replace(leaf, ends=("pin", "pin")),))
    system = pushed(hinged, **{"gravity.x": 0.0, "gravity.y": 0.0})
    with pytest.raises(EquilibriumError, match="no stiffness"):
        load_path(system, {}, {"push.y": 1.0})


def test_the_figure_shows_events_and_unstable_shapes():
    system = pushed(mechanism("CurvedBistable"), **{"gravity.y": 0.0})
    path = load_path(system, {}, {"push.y": -40.0})
    loads = np.array([-40.0 * point.share for point in path.points])
    drawn = load_path_figure([path], [(amounts(system, path), loads)], "push.y [N]", "Curved")
    lines = {line.get_label(): line for line in drawn.axes[0].get_lines()}
    for kind in ("limit point", "bifurcation"):
        expected = [-40.0 * point.share for name, point in path.events if name == kind]
        np.testing.assert_array_equal(lines[kind].get_ydata(), expected)
    unstable = [point.unstable > 0 for point in path.points]
    np.testing.assert_array_equal(np.isnan(lines["stable"].get_ydata()), unstable)


def test_the_branch_of_a_buckled_leaf_is_the_elastica():
    """P / P_cr = (2 K(k) / pi)^2 with k = sin(alpha / 2) and the tip's rotation alpha."""
    column = load(CASES / "column.toml")
    leaf = tuple(replace(kind, order=7) for kind in column.flexure_types)
    guide = replace(column, flexure_types=leaf)
    system = pushed(guide, **{"gravity.y": 0.0})
    critical = math.pi**2 * 200e9 * 20e-3 * 1e-3**3 / 12 / (4 * 0.3**2)
    path = load_path(system, {}, {"push.y": -1.6 * critical}, branches=1)
    (branch,) = path.branches  # The other one is its mirror image.
    assert branch.ended is None
    assert branch.points[0].share * 1.6 == pytest.approx(1.0, rel=1e-6)
    tip = system.bodies["tip"].j
    for point in branch.points[2:]:
        alpha = abs(point.shape.q[tip] - system.q0[tip])
        expected = (2 * ellipk(math.sin(alpha / 2) ** 2) / math.pi) ** 2
        assert 1.6 * point.share == pytest.approx(expected, rel=1e-5)
        assert point.unstable == 0
    assert alpha > 1.5


@pytest.mark.slow
def test_a_bistable_mechanism_rests_again_where_the_load_has_gone():
    """The path of CurvedBistable passes its rest positions; those of a held path are the same."""
    system = pushed(mechanism("CurvedBistable"), **{"gravity.y": 0.0})
    path = load_path(system, {}, {"push.y": -40.0}, branches=1)
    rests = [(point, system.amount(point.shape.q)) for kind, point in path.events if kind == "rest"]
    expected = curve(system, [3e-3, 6.5e-3]).rests
    assert [place for _, place in rests] == pytest.approx([x.displacement for x in expected])
    assert [point.unstable == 0 for point, _ in rests] == [x.stable for x in expected]
    (snap,) = (x for x in path.branches if x.points[0].unstable == 0)
    assert snap.ended == CLOSED
    # A motion is neutral where the branch leaves the path, and where it meets it again.
    crossings = [point.share for kind, point in path.events if kind == "bifurcation"]
    apart = [x for x in snap.points if min(abs(x.share - share) for share in crossings) > 1e-4]
    assert len(apart) > 100
    assert all(point.unstable for point in apart)
    largest = max(-40.0 * -point.share for point in snap.points)
    assert largest == pytest.approx(17.37, abs=0.02)  # No shape of the branch carries more.


@pytest.mark.parametrize("seed", [5, 12])
def test_a_part_without_a_spring_of_its_own_does_not_end_the_path(seed):
    """In these random mechanisms loops alone keep a part in place; its stiffness is round-off."""
    guide = seeded(seed)
    system = pushed(guide)
    stiffness = system.K.diagonal()
    force = 0.1 * float(np.median(stiffness[stiffness > 0.0])) / system.length
    path = load_path(system, {}, {"push.x": force})
    assert path.ended is None
    assert path.points[-1].share == pytest.approx(1.0)


@pytest.mark.slow
def test_a_nearly_symmetric_double_beam_snaps_to_a_second_stable_position():
    """One of four half beams of Qiu's double beam is thicker by 0.2 % (Qiu, Lang, Slocum, 2004).

    The path follows the bifurcated branch of the symmetric mechanism.  It snaps below the force of
    its bifurcation, 737.3 EI h/l^3 for each beam.  A second stable position exists.
    """
    double = load(CASES / "qiu10.toml")
    kinds = tuple(replace(kind, order=5) for kind in double.flexure_types)
    thick = 6e-6 * 1.002
    odd = next(replace(k, name="odd", thickness=thick) for k in kinds if k.name == "left")
    flexures = tuple(replace(f, type="odd") if f.name == "f1" else f for f in double.flexures)
    system = pushed(replace(double, flexure_types=(*kinds, odd), flexures=flexures))
    h, unit = 60e-6, 2 * 169e9 * 0.49e-3 * 6e-6**3 / 12 * 60e-6 / 3e-3**3
    path = load_path(system, {}, {"push.y": -800 * unit}, step=0.02)
    assert path.ended is None
    found = [(kind, 800 * p.share, system.amount(p.shape.q) / h) for kind, p in path.events]
    assert [kind for kind, *_ in found] == ["limit point", "rest", "limit point", "rest"]
    snap, _, back, second = found
    assert 730 < snap[1] < 737.3
    assert back[1] < 0.0
    assert 1.9 < second[2] < 2.0
    rests = [point.unstable for kind, point in path.events if kind == "rest"]
    assert rests == [1, 0]


@pytest.mark.slow
def test_a_held_path_ends_at_the_reach_of_rigid_links() -> None:
    """The links of PRBDM are straight at a displacement of gamma times the length."""
    guide = mechanism("PRBDM")
    system = assemble(guide, guide.values({"gravity.x": 0.0}))
    reach = guide.values()["flexure.gamma"] * guide.values()["flexure.length"]
    found = held_path(system, -2.0 * reach, 2.0 * reach)
    assert found.path.ended == REACH
    ends = [found.amount(found.path.points[k]) for k in (0, -1)]
    assert ends == pytest.approx([-reach, reach], rel=4e-3)


def test_a_path_that_jumps_over_an_infinite_force_ends_there() -> None:
    """A pendulum, whose weight is small beside the springs, is held at a dead centre."""
    guide = free_of_contacts(1881)
    system = assemble(guide, guide.values())
    found = held_path(system, -0.2 * system.length, 0.2 * system.length)
    assert POLE in found.path.ended
    rests = [point for kind, point in found.path.events if kind == "rest"]
    assert rests
    assert all(abs(point.share) <= REST_SHARE for point in rests)
