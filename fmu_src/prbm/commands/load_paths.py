"""Shapes under a load that varies: the option --vary of ``prbm equilibrium``."""

from collections.abc import Mapping, Sequence

import numpy as np

from ..analysis.equilibrium_curve import LoadPath, PathPoint
from ..analysis.held import held_scale, held_unit
from ..analysis.load_path import load_path
from ..files.settings import UserMistake, quantity
from ..mechanics.arrays import Real
from ..mechanics.inputs import load_units
from ..mechanics.system import System
from ..mechanism.description import Mechanism
from ..plots.load_path import load_path_figure
from .output import Output, aligned
from .systems import rounded

ROWS_SHOWN = 12


def given_load(mechanism: Mechanism, option: str, text: str) -> tuple[str, str, str]:
    """Return name, value and unit of a load that an option gives as name=value.

    Raises
    ------
    UserMistake
        If there is no such load.
    """
    name, equals, number = text.partition("=")
    units = load_units(mechanism)
    if not equals or name not in units:
        known = ", ".join(units) or "none: the mechanism has no [[forces]]"
        raise UserMistake(f"{option} {text}: give name=value; the loads are {known}")
    return name, number, units[name]


def given_loads(mechanism: Mechanism, texts: Sequence[str] | None) -> dict[str, float]:
    """Return the loads of the option --load [N], [N m].

    Raises
    ------
    UserMistake
        If there is no such load, or its value is not a quantity of its unit.
    """
    loads = {}
    for text in texts or ():
        name, number, si = given_load(mechanism, "--load", text)
        loads[name] = quantity(number, si, f"--load {name}")
    return loads


def load_text(loads: Mapping[str, float]) -> str:
    """Return loads as the continuation of a description; empty without loads."""
    return "".join(f"; {name} = {x:g}" for name, x in loads.items())


def vary(
    text: str, loads: Mapping[str, float], mechanism: Mechanism, system: System, output: Output,
    branches: int = 0,
) -> None:  # fmt: skip
    """Print, write and draw the shapes while a load varies, with limit points and bifurcations."""
    name, ends, si = given_load(mechanism, "--vary", text)
    first, colon, last = ends.partition(":")
    if not colon:
        raise UserMistake(f"--vary {text}: give both ends of the range, such as {name}=0:-20{si}")
    low, high = (quantity(x, si, f"--vary {name}") for x in (first, last))
    if low == high:
        raise UserMistake(f"--vary {text}: the ends of the range are equal")
    path = load_path(system, {**loads, name: low}, {**loads, name: high}, branches)
    paths = (path, *path.branches)
    curves = [_curve(system, one, low, high) for one in paths]
    unit = held_unit(mechanism)
    label = f"{name} [{si}]"
    for number, (one, curve) in enumerate(zip(paths, curves, strict=True)):
        if number:
            print(f"branch {number}, from its bifurcation:")
        _print(one, *curve, label, system)
    output.table(
        f"{mechanism.name}-load-path.csv",
        [
            "branch",
            f"{unit.amount} [{unit.si}]",
            label,
            "unstable directions",
            "critical directions",
            "event",
        ],
        [
            [number, float(x), float(load), point.unstable, point.critical, _event(one, point)]
            for number, (one, curve) in enumerate(zip(paths, curves, strict=True))
            for x, load, point in zip(*curve, one.points, strict=True)
        ],
    )
    shown, turns = f"{name} [{si.replace('.', ' ')}]", mechanism.release.turns
    output.figure(
        f"{mechanism.name}-load-path.png",
        lambda: load_path_figure(paths, curves, shown, mechanism.title, turns),
    )


def _curve(system: System, path: LoadPath, low: float, high: float) -> tuple[Real, Real]:
    """Return the displacements and the loads of the points of a path."""
    amounts = np.array([system.amount(point.shape.q) for point in path.points])
    return amounts, np.array([low + point.share * (high - low) for point in path.points])


def _directions(point: PathPoint) -> str:
    """Return the number of unstable directions as text, with those that are critical."""
    critical = f" and {point.critical} critical" if point.critical else ""
    return f"{point.unstable}{critical}"


def _event(path: LoadPath, point: PathPoint) -> str:
    """Return the kind of the event at a point, or nothing."""
    return next((kind for kind, one in path.events if one is point), "")


def _print(
    path: LoadPath, amounts: np.ndarray, varied: np.ndarray, label: str, system: System
) -> None:
    """Print a part of the points, and all events."""
    unit = held_unit(system.mechanism)
    scale, largest = unit.factor * held_scale(system), float(np.abs(varied).max())
    count = len(path.points)
    every = -(-count // ROWS_SHOWN)
    chosen = sorted({*range(0, count, every), count - 1})
    rows = [
        [rounded(unit.factor * amounts[k], scale, ".5g"), rounded(varied[k], largest),
         _directions(path.points[k])]
        for k in chosen
    ]  # fmt: skip
    print(aligned([f"at [{unit.shown}]", label, "unstable directions"], rows))
    print(f"{len(chosen)} of {count} points; write all with --out DIR")
    for kind, point in path.events:
        k = path.points.index(point)
        at = rounded(unit.factor * amounts[k], scale)
        print(f"{kind} at {at} {unit.shown}, under {varied[k]:.5g} {label.partition('[')[2][:-1]}")
    if path.ended:
        print(f"the path ends: {path.ended}")
