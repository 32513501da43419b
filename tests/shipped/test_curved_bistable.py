"""Curved bistable: its snap-through forces against a boundary value problem."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import root

from kernel_simulation import KernelSimulation
from prbm.analysis.holding import curve
from prbm.files.mechanism_file import load
from prbm.mechanics.assembly import assemble
from prbm.mechanics.statics import equilibrium
from support import ROOT, mechanism

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
def test_a_force_that_grows_snaps_the_mechanism_where_its_shape_becomes_unstable():
    """Under 0.5 % less than the force the shuttle stays, under 0.5 % more it snaps.

    A moment breaks the symmetry: the beams buckle before the force has its largest value.
    """
    system = of_order(3, **{"pom.density": BISTABLE.values()["pom.density"]})
    held = curve(system, np.linspace(-0.2e-3, 6.5e-3, 21))
    near, middle, far = (rest.displacement for rest in held.rests)
    (place, force), back = held.snaps
    assert near < place < middle < back[0] < far
    assert force < 0.97 * max(point.force for point in held.points)
    for share, snaps in ((0.995, False), (1.005, True)):
        sim = KernelSimulation(
            BISTABLE, {"gravity.y": 0.0, "release.velocity": 0.0, "damping.beta": 5e-4}
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


def test_a_double_curved_beam_buckles_at_the_force_of_shallow_arches():
    """Theory of shallow arches gives 743.2 EI h/l^3 for each of two beams [1].

    The model with four half beams has a first crossing at 734 to 737, at 0.153 to 0.154 h.

    [1] J. Qiu, J. H. Lang, A. H. Slocum, J. Microelectromech. Syst. 13 (2004) 137.
    """
    double = load(ROOT / "tests" / "cases" / "qiu10.toml")
    held = curve(assemble(double, double.values()), np.linspace(-5e-6, 0.13e-3, 28))
    EI, h, span = 169e9 * 0.49e-3 * 6e-6**3 / 12, 60e-6, 3e-3
    (place, force), *_ = held.snaps
    assert 734 < force / 2 / (EI * h / span**3) < 737.5
    assert 0.153 < place / h < 0.155
    # Beyond, the shapes that are followed have no neighbour; those before are kept.
    assert "cannot be reached" in str(held.ended)
    assert [rest.stable for rest in held.rests] == [True, False]
