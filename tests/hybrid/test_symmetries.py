"""Results do not depend on how a mechanism is placed, oriented and written down."""

import cmath
import math
from dataclasses import replace

import pytest

from kernel_simulation import KernelSimulation
from moved_drawings import moved
from prbm.mechanism.description import Mechanism
from random_mechanisms import seeded

SHIFT = 0.37 - 0.21j
END = 4e-3  # s; later impacts amplify differences of the coordinates in the error control.
TOLERANCE = 1e-11
COMPARED = ("gap", "gap_rate", "force", "point.mobility", "impact_count", "approach_speed")


def turned(given: Mechanism) -> Mechanism:
    u = cmath.exp(1j * math.radians(77.0))
    return moved(given, lambda z: u * z, turn=77.0)


def mirrored(given: Mechanism) -> Mechanism:
    return moved(given, lambda z: z.conjugate(), sign=-1.0)


def shifted(given: Mechanism) -> Mechanism:
    return moved(given, lambda z: z + SHIFT)


def reordered(given: Mechanism) -> Mechanism:
    kinds = ("bodies", "flexure_types", "flexures", "joints", "stops", "frictions", "forces")
    return replace(given, **{kind: getattr(given, kind)[::-1] for kind in kinds})


def reversed_flexures(given: Mechanism) -> Mechanism:
    """Return the mechanism whose flexures start where they ended.

    A path that is followed backwards turns to the other side; the distance of the tangents at its
    ends has the same sign, because both the path and its left side are reversed.
    """
    types = tuple(
        replace(kind, thickness=kind.end_thickness, end_thickness=kind.thickness)
        if kind.profile == "taper"
        else replace(kind, curvature=None if kind.curvature is None else -kind.curvature)
        for kind in given.flexure_types
    )
    flexures = tuple(
        replace(one, start=one.end, end=one.start, ends=one.ends[::-1]) for one in given.flexures
    )
    return replace(given, flexure_types=types, flexures=flexures)


def scalars(model: Mechanism) -> dict[str, float]:
    """Return outputs that do not depend on the description, at the start and a short time later."""
    simulation, found = KernelSimulation(model, tolerance=TOLERANCE), {}
    for t in (0.0, END):
        simulation.advance(t)
        outputs = simulation.outputs()
        names = {"mode.frequency", *(name for name in outputs if name.startswith("energy."))}
        names |= {f"{stop.name}.{name}" for stop in model.stops for name in COMPARED}
        found |= {f"{name} at {t:g} s": outputs[name] for name in names}
    return found


def reversed_joints(given: Mechanism) -> Mechanism:
    """Return the mechanism whose joints start where they ended: the free angle is the opposite."""
    joints = tuple(
        replace(
            one, start=one.end, end=one.start,
            free_angle=None if one.free_angle is None else -one.free_angle,
        )
        for one in given.joints
    )  # fmt: skip
    return replace(given, joints=joints)


SEEDS = [*range(6), *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(6, 40))]


@pytest.mark.parametrize("torsion", [False, True])
@pytest.mark.parametrize("seed", SEEDS)
def test_a_mechanism_moves_alike_wherever_and_however_it_is_described(seed, torsion):
    model = seeded(seed, friction=False, torsion=torsion)
    expected = scalars(model)
    scale = {"energy": max(abs(x) for name, x in expected.items() if name.startswith("energy."))}
    for change in (turned, mirrored, shifted, reordered, reversed_flexures, reversed_joints):
        found = scalars(change(model))
        for name, x in expected.items():
            size = scale.get(name.partition(".")[0], 1e-3)
            assert found[name] == pytest.approx(x, rel=1e-6, abs=1e-7 * size), (change, name)
