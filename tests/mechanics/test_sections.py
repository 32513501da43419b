"""Forces and moments at the ends of flexures: elastica, balances of free bodies, base reactions."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, given, settings
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, root

import prbm
from many_parts import profiles
from prbm.hybrid.simulation import Simulation
from prbm.mechanics.assembly import assemble
from prbm.mechanics.dynamics import base_reaction
from prbm.mechanics.sections import point_loads, section_loads, static_section_loads
from prbm.mechanics.statics import equilibrium
from prbm.mechanism.flexure import BEAM, PIN
from random_mechanisms import mechanisms

LENGTH, THICKNESS, WIDTH, MODULUS = 0.04, 1e-4, 8e-3, 181.5e9  # The flexures of the guide.
EI = MODULUS * WIDTH * THICKNESS**3 / 12
TO_STRESS = 6 / (WIDTH * THICKNESS**2)  # Pa/(N m)


def guide(model, **changes):
    """Return the guide with another model of its flexures, without gravity."""
    known = prbm.load("PRBDM2R")
    kinds = tuple(replace(k, model=model, **changes) for k in known.flexure_types)
    return replace(known, flexure_types=kinds, gravity=(0.0, 0.0))


def leaf_moment(displacement):
    """Return the moment at the clamp of a fixed-guided leaf without axial force [N m].

    EI theta' = M - F y is integrated over half of the leaf, up to its point of inflection.
    """

    def exact(force, moment):
        def slope(s, y):
            return [(moment - force * y[1]) / EI, np.cos(y[0]), np.sin(y[0])]

        return solve_ivp(slope, (0, LENGTH / 2), [0.0, 0.0, 0.0], rtol=1e-11, atol=1e-14).y[:, -1]

    def open_by(scaled):
        force, moment = scaled * np.array([12 * EI / LENGTH**2, 6 * EI / LENGTH])
        end = exact(force, moment)
        return [moment - force * end[1], end[2] - displacement / 2]

    guess = displacement / LENGTH
    found = root(lambda x: np.array(open_by(x)) / [EI / LENGTH, LENGTH], [guess, guess], tol=1e-12)
    return float(found.x[1] * 6 * EI / LENGTH)


def held_guide(mechanism, height, displacement):
    """Return the section loads of the guide, held at a height above the tops of the flexures."""
    system = assemble(mechanism, mechanism.values({"shuttle.com_height": height}))
    return static_section_loads(system, equilibrium(system, displacement))


def moments_without_axial_force(mechanism, displacement):
    """Return the moments at the four clamps, with the guide held where the leaves carry no load."""

    def tension(height):
        return held_guide(mechanism, height, displacement)[0].tension[0]

    height = brentq(tension, -0.022, -0.015, xtol=1e-9)
    loads = held_guide(mechanism, height, displacement)
    return np.array([x for one in loads for x in (-one.bending[0], one.bending[-1])])


@pytest.mark.parametrize(
    ("model", "changes", "error"),
    [
        ("beam", {"order": 3}, 1e-4),
        ("beam", {"order": 5}, 1e-5),
        ("beam", {"order": 3, "axial": True}, 1e-4),
        ("nR", {"n": 20}, 0.01),
        ("1R", {}, 0.04),
        ("2R", {}, 0.01),
        ("3R", {}, 0.03),
    ],
)
@pytest.mark.parametrize(("displacement", "stress"), [(10e-3, 349.96e6), (18e-3, 677.59e6)])
def test_end_moments_of_a_fixed_guided_leaf_are_those_of_the_elastica(
    model, changes, error, displacement, stress
):
    expected = leaf_moment(displacement)
    assert expected * TO_STRESS == pytest.approx(stress, rel=2e-5)
    found = moments_without_axial_force(guide(model, **changes), displacement)
    assert found == pytest.approx(np.full(4, expected), rel=error)


@pytest.mark.parametrize(
    ("displacement", "left", "right"), [(10e-3, 366.7e6, 331.8e6), (18e-3, 740.7e6, 601.2e6)]
)
def test_couple_of_the_holding_force_loads_the_leaves_of_the_guide_differently(
    displacement, left, right
):
    for model, error in ((("beam", {"order": 3}), 5e-4), (("2R", {}), 0.011)):
        loads = held_guide(guide(model[0], **model[1]), 0.01777, displacement)
        found = [-one.bending[0] * TO_STRESS for one in loads]
        assert found == pytest.approx([left, right], rel=error)
        assert loads[0].tension[0] == pytest.approx(-loads[1].tension[0], rel=1e-6)


def in_motion(mechanism, times, inputs=None):
    """Yield the equations, state and evaluation of a simulation at several times."""
    sim = Simulation(mechanism, inputs)
    for time in times:
        sim.advance(time)
        n, y = sim.system.n, sim.state()
        q, v = y[:n], y[n : 2 * n]
        yield sim, q, v, sim.equations.at(sim.time, y)


def ends_of(system, name, e):
    """Return the positions of start and end of a flexure."""
    outline = next(line for line in system.outlines if line.name == name)
    first, last = (complex(outline.A[k] @ e) + outline.c[k] for k in (0, -1))
    free = next(c.flexure for c in system.connections if c.flexure and c.flexure.name == name)
    kind = next(f.type for f in system.mechanism.flexures if f.name == name)
    model = next(k.model for k in system.mechanism.flexure_types if k.name == kind)
    # The outline of links begins at the near end, that of a beam at the start.
    return (first, last) if free.forwards or model == BEAM else (last, first)


@pytest.mark.slow
@given(mechanisms(starting=True) | mechanisms(starting=True, guides=2))
@settings(
    phases=[Phase.generate], max_examples=15, deadline=None, derandomize=True,
    suppress_health_check=[HealthCheck.filter_too_much, HealthCheck.too_slow],
)  # fmt: skip
def test_forces_and_moments_on_each_flexure_and_on_the_ground_balance(mechanism):
    check_balances(mechanism)


def check_balances(mechanism, times=(0.0, 1.1e-3, 3.3e-3)):
    """Check the balances of each flexure, and of the ground, with contacts, pins and damping."""
    for sim, q, v, found in in_motion(mechanism, times):
        system, equations = sim.system, sim.equations
        e = system.directions(q)
        loads, ground = section_loads(equations, q, v, found)
        points = point_loads(equations, e, v, found.a)
        speed = 1j * (system.A @ (e * system.turning(v)))
        damping = equations.mass_damping * complex(system.m @ speed)
        scale = float(np.abs(points).sum()) + float(np.abs(found.lam).sum()) + 1e-6
        reaction = base_reaction(equations, q, v, found.a)[0]
        assert abs(ground + damping - reaction) < 1e-8 * scale
        flexures = {c.flexure.name: c.flexure for c in system.connections if c.flexure}
        for one, flexure in zip(loads, mechanism.flexures, strict=True):
            assert one.name == flexure.name
            masses = flexures[one.name].masses
            own, z = points[masses], (system.A @ e + system.c)[masses]
            start, end = ends_of(system, one.name, e)
            assert abs(sum(one.forces) + own.sum()) < 1e-8 * scale
            moment = sum(one.moments) + (np.conj(end - start) * one.forces[1]).imag
            moment += float((np.conj(z - start) * own).imag.sum())
            assert abs(moment) < 1e-7 * scale * system.length
            for at, kind in enumerate(flexure.ends):
                if kind == PIN:
                    assert abs(one.moments[at]) < 1e-7 * scale * system.length


@pytest.mark.parametrize("inputs", [{}, {"force.x": 0.3, "force.y": -0.2, "force.moment": 1e-3}])
@pytest.mark.parametrize(("model", "changes"), [("beam", {"order": 3}), ("2R", {}), ("1R", {})])
def test_base_reactions_in_motion_are_those_of_the_flexures(model, changes, inputs):
    free = replace(guide(model, **changes), stops=(), frictions=())
    check_base_reaction(replace(free, gravity=(9.81, -3.0)), (0.0, 7e-3, 0.0211), inputs)


def check_base_reaction(mechanism, times, inputs=None):
    """Check that the flexures at the ground transmit the base reaction, without contacts."""
    checked = 0
    for sim, q, v, found in in_motion(mechanism, times, inputs):
        if any(mode.closed for mode in sim.equations.contacts.modes):
            continue
        checked += 1
        loads, _ = section_loads(sim.equations, q, v, found)
        force, moment = base_reaction(sim.equations, q, v, found.a)
        on_ground, turning = [], []
        for one, flexure in zip(loads, mechanism.flexures, strict=True):
            for at, point in enumerate((flexure.start, flexure.end)):
                if point.startswith("ground."):
                    z = ends_of(sim.system, one.name, sim.system.directions(q))[at]
                    arm = z - sim.system.anchor
                    on_ground.append(-one.forces[at])
                    turning.append((np.conj(arm) * -one.forces[at]).imag - one.moments[at])
        assert sum(on_ground) == pytest.approx(force, abs=1e-9 * max(map(abs, on_ground)))
        assert sum(turning) == pytest.approx(moment, abs=1e-9 * max(map(abs, turning)))
    assert checked


PROFILES = {
    "notches": lambda: prbm.load("NotchGuide"),
    "curved": lambda: prbm.load("CurvedBistable"),
    "mixed": lambda: replace(profiles(axial=False), stops=()),
    "elastic": lambda: replace(profiles(), stops=()),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", PROFILES)
def test_forces_and_moments_on_flexures_with_profiles_balance(name):
    mechanism = replace(PROFILES[name](), gravity=(9.81, -3.0))
    check_balances(mechanism)
    free = replace(mechanism, damping_zeta=0.0, stops=(), frictions=(), springs=())
    check_base_reaction(free, (0.0, 2.1e-3))


def turned_round(mechanism):
    """Return a mechanism with the start and the end of each flexure exchanged."""
    flexures = tuple(
        replace(f, start=f.end, end=f.start, ends=f.ends[::-1]) for f in mechanism.flexures
    )
    return replace(mechanism, flexures=flexures)


@pytest.mark.parametrize(
    ("model", "changes"),
    [
        ("beam", {"order": 3, "axial": True}),
        ("beam", {"profile": "notch", "notch_radius": 2e-3, "waist_length": 0.032}),
        ("beam", {"rise": 2e-3}),
        ("2R", {}),
        ("nR", {"n": 4}),
    ],
)
def test_exchange_of_start_and_end_exchanges_forces_and_moments(model, changes):
    one = replace(guide(model, **changes), gravity=(9.81, -3.0))
    states = zip(
        in_motion(one, (0.0, 7e-3)), in_motion(turned_round(one), (0.0, 7e-3)), strict=True
    )
    for (sim, *state), (other, *turned) in states:
        loads, _ = section_loads(sim.equations, *state)
        found, _ = section_loads(other.equations, *turned)
        for there, back in zip(loads, found, strict=True):
            scale = {"rel": 1e-5, "abs": 1e-5 * max(map(abs, there.moments))}
            assert back.moments == pytest.approx(there.moments[::-1], **scale)
            assert back.bending == pytest.approx(-there.bending[::-1], **scale)
            size = abs(there.forces[0])
            assert back.tension == pytest.approx(there.tension[::-1], abs=1e-4 * size)
            assert back.position == pytest.approx(
                there.position[-1] - there.position[::-1], abs=1e-12
            )


@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_flexures_and_a_pressed_stop_balance_the_loads_of_the_body(friction):
    own = guide("beam", order=3)
    stop = replace(own.stops[0], law="compliant", stiffness=1e6, exponent=1.0, friction=friction)
    thrown = replace(own.release, displacement=-1e-5, velocity=0.5)
    mechanism = replace(own, stops=(replace(stop, position=0.0),), release=thrown)
    times = (5e-5, 2e-4, 4e-4)
    for sim, q, v, found in in_motion(mechanism, times):
        equations, system = sim.equations, sim.system
        assert equations.pressed == [0]
        loads, _ = section_loads(equations, q, v, found)
        e, slip = system.directions(q), equations.contacts.modes[0].slip
        own_load = point_loads(equations, e, v, found.a)
        rubbing = -slip * friction * found.pressure.force[0]
        if equations.sticking:
            rubbing = equations.friction(0, e, found.lam, found.pressure)[0]
        assert bool(rubbing) == bool(friction)
        pushed = complex(-found.pressure.force[0], rubbing)
        through = sum(one.forces[1] for one in loads)
        total = own_load[system.body_masses["shuttle"]] + pushed - through
        assert abs(total) < 1e-8 * abs(pushed)
    check_balances(mechanism, times)
