"""Guides with friction points and stops that start at rest, pressed, or in motion.

Coulomb's law has a solution for contacts at rest.  A refusal is right only if no forces at all, of
whatever friction, keep the gaps that touch from closing: linear programming decides this.
"""

import re
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import linprog

from kernel_simulation import KernelMistake, KernelSimulation
from prbm.base.errors import PrbmError
from prbm.hybrid.simulation import Simulation
from prbm.mechanism.description import Mechanism
from prbm.mechanism.parts import Body, Flexure, FlexureType, Friction, Release, Stop

END = 0.02  # s
UNSUITABLE = (
    "is penetrated by", "cannot be reached", "no static equilibrium",
    "links of a loop form a straight line",  # A stop across the only motion of a guide.
    "could not be closed near this shape",  # The same at a dead centre, not closed fully.
)  # fmt: skip


def guides(seed: int) -> Mechanism:
    """Return one to three guides side by side, with friction points and stops, some on guides."""
    rng = np.random.default_rng(seed)

    def pick(*options):
        return options[int(rng.integers(len(options)))]

    def kind(name: str) -> FlexureType:
        model = pick("beam", "1R", "2R", "3R")
        return FlexureType(
            name, model, rng.uniform(1e-4, 5e-4), rng.uniform(3e-3, 1e-2),
            10 ** rng.uniform(10, 11.3), rng.uniform(2e3, 8e3),
            axial=model != "1R" and pick(False, True),
        )  # fmt: skip

    types = (kind("one"), kind("other"))
    ground, bodies, flexures, rubs, stops = {}, [], [], [], []
    for i in range(pick(1, 2, 3)):
        x, tilt = 0.1 * i, pick(0.0, 1e-3 * rng.normal())
        width, height, name = rng.uniform(0.02, 0.04), rng.uniform(0.03, 0.05), f"body{i}"
        ground |= {f"a{i}": (x, 0.0), f"b{i}": (x + width, tilt)}
        points = {"a": (x, height), "b": (x + width, height + tilt)}
        centre = (x + width / 2, height + 0.01)
        bodies.append(Body(name, rng.uniform(0.02, 0.1), 1e-5, centre, points))
        for side in "ab":
            flexures.append(
                Flexure(f"{side}{i}", pick(*types).name, f"ground.{side}{i}", f"{name}.{side}")
            )
        for j in range(pick(0, 1, 2)):
            point = pick(None, (x + rng.uniform(0.0, width), height))
            rubs.append(
                Friction(
                    f"rub{i}{j}", name, pick(0.0, 0.0, 10.0, 180.0, 90.0, rng.uniform(0, 360)),
                    pick(0.05, 0.3, 1.0), 10 ** rng.uniform(-3, 2), pick(0.0, 10.0), point,
                )
            )  # fmt: skip
        if pick(False, True):
            stops.append(
                Stop(
                    f"stop{i}", name, (x + width, height), pick(0.0, 180.0, 90.0, 30.0),
                    pick(0.0, 1e-4, 1e-3), 0.0, 0.5, pick(0.0, 0.3, 0.8),
                    on=pick("ground", f"body{max(i - 1, 0)}") if i else "ground",
                )
            )  # fmt: skip
    return Mechanism(
        "Guides", "Guides with friction", ground, tuple(bodies), types, tuple(flexures),
        Release("body0", 0.0, pick(0.0, 0.0, 1e-3, -1e-3), velocity=pick(0.0, 0.0, 0.3)),
        frictions=tuple(rubs), stops=tuple(stops),
        gravity=pick((0.0, -9.81), (0.0, 0.0), (3.0, -9.0)),
    )  # fmt: skip


def closing_in(model: Mechanism) -> bool:
    """Return whether no forces at the stops that touch keep all their gaps from closing."""
    far = replace(model, stops=tuple(replace(s, position=s.position + 1.0) for s in model.stops))
    simulation = Simulation(far)
    front, equations, at = simulation.front, simulation.equations, simulation.front.at
    e, M, loops = at.e, at.M, at.loops
    gaps, rates = equations.gaps(0.0, e) - 1.0, equations.gap_rates(0.0, e, front.v)
    touching = np.flatnonzero((np.abs(gaps) < 1e-9) & (rates < 1e-9))
    opening = equations.gap_accelerations(0.0, e, front.v, front.evaluate().a)[touching]
    along = np.vstack([at.gaps[touching], at.slides[touching]])
    inverse = np.linalg.inv(M)
    held = loops @ inverse @ along.T
    W = along @ inverse @ along.T - held.T @ np.linalg.solve(loops @ inverse @ loops.T, held)
    W[np.abs(W) < 1e-12 * np.abs(W).max()] = 0.0
    k, tolerance = len(touching), 1e-6 * np.abs(opening).max()
    bounds = [(0.0, None)] * k + [(None, None)] * k
    scale = 1.0 / np.abs(W).max()
    found = linprog(np.zeros(2 * k), -W[:k] * scale, opening + tolerance, bounds=bounds)
    return found.status == 2


ALIKE = (4010, 4222, 4735, 6598, 6962, 7016)  # Points that can stick only together.
LIFTED = (3760, 4619, 6090)  # Points without a normal force beside others that stick.
HELD = (5855, 7024, 9552)  # Points at their limits that others hold: their speed is round-off.
BOTH_AT_LIMIT, DEAD_CENTRES = 7282, (1937, 6854)
HARD = (*ALIKE[2:], *LIFTED, *HELD[1:], BOTH_AT_LIMIT, *DEAD_CENTRES)
SEEDS = [
    *range(14), *ALIKE[:2], HELD[0],
    *(pytest.param(seed, marks=pytest.mark.slow) for seed in (*range(14, 150), *HARD)),
]  # fmt: skip


@pytest.mark.parametrize("seed", SEEDS)
def test_contacts_at_rest_jam_only_if_walls_close_in(seed):
    model = guides(seed)
    try:
        KernelSimulation(model).advance(END)
    except (PrbmError, KernelMistake) as error:
        reason = str(error)
        if any(words in reason for words in UNSUITABLE):
            return
        assert re.search(r"no forces satisfy .* at t = 0 s", reason), reason
        assert closing_in(model)


@pytest.mark.parametrize("seed", range(6))
def test_both_engines_start_alike(seed):
    model = guides(seed)
    modes = []
    for engine in (Simulation, KernelSimulation):
        try:
            simulation = engine(model)
        except (PrbmError, KernelMistake) as error:
            modes.append(str(error).partition(" m at")[0])
            continue
        state = simulation.front.contacts.modes if engine is Simulation else simulation.modes()
        modes.append([int(mode) for mode in state])
    assert modes[0] == modes[1]


def swinging(normal_force: float, release: Release, gravity: float) -> Mechanism:
    """Return a guide that carries a body on a rod that turns freely, with friction on both."""
    leaf = FlexureType("leaf", "beam", 3e-4, 8e-3, 2e11, 7800.0)
    rod = FlexureType("rod", "nR", 1e-3, 5e-3, 2e11, 2000.0, n=1)
    table = {"a": (0.0, 0.05), "b": (0.03, 0.05), "pin": (0.015, 0.06)}
    return Mechanism(
        "Swinging", "Guide with a pendulum", {"a": (0.0, 0.0), "b": (0.03, 0.0)},
        (
            Body("table", 0.05, 1e-5, (0.015, 0.055), table),
            Body("bob", 0.02, 5e-6, (0.015, 0.02), {"top": (0.015, 0.03)}),
        ),
        (leaf, rod),
        (
            Flexure("left", "leaf", "ground.a", "table.a"),
            Flexure("right", "leaf", "ground.b", "table.b"),
            Flexure("rod", "rod", "table.pin", "bob.top", ends=("pin", "clamp")),
        ),
        release,
        frictions=(
            Friction("rub", "table", 0.0, 0.3, normal_force),
            Friction("slide", "bob", 10.0, 0.3, 14 * normal_force),
        ),
        gravity=(0.0, -gravity),
    )  # fmt: skip


@pytest.mark.parametrize("engine", [Simulation, KernelSimulation])
@pytest.mark.parametrize("normal_force", [10.0, 106.0])
@pytest.mark.parametrize(("speed", "gravity"), [(1e-6, 0.0), (1.4e-3, 0.0), (0.014, 2.5e-4)])
def test_friction_points_of_constant_normal_force_never_jam(engine, normal_force, speed, gravity):
    """Their forces minimise a convex function of the accelerations, however slow the motion is."""
    simulation = engine(swinging(normal_force, Release("table", velocity=speed), gravity))
    simulation.advance(0.01)
    assert abs(simulation.outputs()["table.vx"]) <= speed
