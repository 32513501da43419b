"""The bistable shuttle, compared with the closed form of four struts of axial stiffness EA."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from prbm.analysis import holding
from prbm.mechanics.assembly import assemble
from prbm.mechanics.statics import equilibrium
from prbm.plots.holding import holding_figure
from support import mechanism, run

BISTABLE = mechanism("Bistable")
SYSTEM = assemble(BISTABLE, BISTABLE.values())
V = SYSTEM.values
SPAN, RISE, MASS = V["strut.span"], V["strut.rise"], V["shuttle.mass"]
LENGTH = math.hypot(SPAN, RISE)
EA = V["polyurethane.youngs_modulus"] * V["strut.thickness"] * V["strut.width"]


def energy(d: float) -> float:
    """Return the elastic energy of the struts, 4 EA L s^2 / 2 with s = ln(l / L) [J]."""
    return 2 * EA * LENGTH * math.log(math.hypot(SPAN, RISE - d) / LENGTH) ** 2


def force(d: float) -> float:
    """Return the force dU/dd that holds the shuttle at a displacement d downwards [N]."""
    length = math.hypot(SPAN, RISE - d)
    return -4 * EA * LENGTH * math.log(length / LENGTH) * (RISE - d) / length**2


def speed(start: float, d: float) -> float:
    """Return the speed at d after a release from rest, undamped [m/s].

    A strut rotates and stretches about its pin as a rod: a third of its mass adds to the shuttle.
    """
    strut = V["polyurethane.density"] * V["strut.thickness"] * V["strut.width"] * LENGTH
    return math.sqrt(2 * (energy(start) - energy(d)) / (MASS + 4 * strut / 3))


def test_holding_force_is_that_of_four_struts() -> None:
    d = np.linspace(-0.3, 2.4, 28) * RISE
    found = holding.curve(SYSTEM, d).points
    np.testing.assert_array_equal([point.displacement for point in found], d)
    np.testing.assert_allclose([point.force for point in found], [force(x) for x in d], atol=1e-9)
    one_by_one = [equilibrium(SYSTEM, x).force for x in d]
    np.testing.assert_allclose(one_by_one, [force(x) for x in d], atol=1e-9)


def test_there_are_two_stable_equilibria_and_an_unstable_one_between_them() -> None:
    """The shapes are the straight one, its mirror image, and that with the shortest struts."""
    found = holding.curve(SYSTEM, np.array([-0.3, 2.3]) * RISE).rests
    assert [rest.stable for rest in found] == [True, False, True]
    np.testing.assert_allclose([r.displacement for r in found], [0, RISE, 2 * RISE], atol=1e-12)


@pytest.mark.parametrize("ends", [(0.0, 2.0), (-0.5, 1.0), (0.0, 1.0)])
def test_rest_positions_at_the_ends_of_a_range_are_found(ends) -> None:
    found = holding.curve(SYSTEM, np.array(ends) * RISE).rests
    places = [k * RISE for k in (0, 1, 2) if ends[0] <= k <= ends[1]]
    np.testing.assert_allclose([r.displacement for r in found], places, atol=1e-9)


def test_snap_force_is_the_extremum_of_the_closed_form() -> None:
    options = {"xatol": 1e-10}
    minimum = minimize_scalar(
        lambda d: -force(d), bounds=(0, RISE), method="bounded", options=options
    )
    (d, largest), back = holding.curve(SYSTEM, np.array([-0.1, 2.1]) * RISE).snaps
    assert largest == pytest.approx(-minimum.fun, rel=1e-12)
    assert d == pytest.approx(minimum.x, abs=1e-7)  # The extremum is flat.
    assert back[1] == pytest.approx(-largest, rel=1e-9)


def test_clamping_the_struts_to_the_ground_adds_their_bending_stiffness() -> None:
    """The additional stiffness is that of four cantilevers, 3 EI/L^3 across their length.

    The displacements are small; the 2R model is 0.7 % too soft.
    """
    values = {"strut.thickness": 2e-3, "strut.width": 5e-2}  # EA is unchanged.
    kind = replace(BISTABLE.flexure_types[0], model="2R")
    clamped = replace(
        BISTABLE,
        flexure_types=(kind,),
        flexures=tuple(replace(f, ends=("clamp", "pin")) for f in BISTABLE.flexures),
    )
    system = assemble(clamped, clamped.values(values))
    EI = EA * values["strut.thickness"] ** 2 / 12
    across = 4 * 3 * EI / LENGTH**3 * (SPAN / LENGTH) ** 2
    additional = (equilibrium(system, 1e-6).force - force(1e-6)) / 1e-6
    assert additional == pytest.approx(across, rel=0.01)


@pytest.mark.slow
def test_the_shuttle_comes_to_rest_on_the_far_stop_after_the_snap() -> None:
    result = run(BISTABLE, stop_time=0.5)
    y = result.column("shuttle.y")
    assert y[0] == pytest.approx(-0.0125)
    first = result.simulation.record[0]
    assert {impact.stop for impact in result.simulation.record} == {"far_stop"}
    assert 0.0 < first.latched.approach_speed < speed(0.0125, 0.022)
    assert y[-1] == pytest.approx(-0.022, abs=1e-12)
    assert result.outputs[-1]["far_stop.contact"]
    # The struts press it against the stop, towards the second stable rest position.
    assert result.outputs[-1]["far_stop.force"] == pytest.approx(-force(0.022), rel=1e-8)
    assert result.outputs[-1]["energy.elastic"] == pytest.approx(energy(0.022), rel=1e-8)


def test_without_damping_the_elastic_energy_becomes_kinetic() -> None:
    """The speed is exact at all points of the path and at the stop.

    The tolerance is relative to the energy of a unit stretch, EA L = 122 J.
    """
    result = run(BISTABLE, {"damping.beta": 0.0}, stop_time=0.04, step=2e-3, tolerance=1e-11)
    impact = result.simulation.record[0]
    assert impact.latched.approach_speed == pytest.approx(speed(0.0125, 0.022), rel=1e-7)
    before = [row for k, row in enumerate(result.outputs) if k * 2e-3 < impact.time]
    assert len(before) > 10
    for row in before:
        exact = speed(0.0125, max(0.0125, -row["shuttle.y"]))
        assert row["shuttle.vy"] ** 2 == pytest.approx(exact**2, abs=2e-11 * EA * LENGTH / MASS)
        assert abs(row["shuttle.vx"]) < 1e-9


@pytest.mark.slow
def test_a_shuttle_released_before_the_unstable_equilibrium_returns_to_the_drawn_shape() -> None:
    result = run(BISTABLE, {"release.displacement": 0.0115, "damping.beta": 2e-3}, stop_time=0.5)
    assert abs(result.outputs[-1]["shuttle.y"]) < 1e-4
    assert result.outputs[-1]["far_stop.impact_count"] == 0


def test_the_figure_contains_the_curve_of_the_fundamental() -> None:
    """The first range has a nearly constant frequency, the second no stable shape."""
    for low, high in ((-1e-3, 1e-3), (10e-3, 14e-3)):
        force = holding.curve(SYSTEM, np.linspace(low, high, 5))
        panel = holding_figure(force, "").axes[-1]
        bottom, top = panel.get_ylim()
        assert bottom == 0.0 < top
        assert not any(point.frequency > 0.9 * top for point in force.points)


def test_the_drawn_curve_passes_through_its_events_and_the_shading_ends_there() -> None:
    """Between the two limit points the released shuttle is unstable."""
    force = holding.curve(SYSTEM, np.linspace(-1e-3, 25e-3, 5))
    assert (np.diff(force.displacements) >= 0.0).all()
    for place in (*force.events, *force.points):
        (k, *_) = np.flatnonzero(force.displacements == place.displacement)
        assert force.forces[k] == pytest.approx(place.force)
    limits = [event.displacement for event in force.events if event.kind == "limit point"]
    for panel in holding_figure(force, "").axes:
        (shade,) = panel.patches
        left, right = shade.get_x(), shade.get_x() + shade.get_width()
        assert [left, right] == pytest.approx([1e3 * x for x in limits])
