"""``prbm equilibrium``: places of rest, holding forces, snaps."""

import argparse
import math
from collections.abc import Sequence

import numpy as np

from ..analysis import holding
from ..base.progress import reporter
from ..files.settings import UserMistake, quantities, quantity
from ..mechanics.statics import immobile
from ..mechanics.system import System
from ..mechanism.description import Mechanism
from ..plots.holding import holding_figure
from .output import Output, aligned
from .systems import assembled, check_length, tiny

HELD_HEAD = (
    "displacement [m]", "holding force [N]", "stiffness [N/m]", "across [m]", "angle [rad]",
    "fundamental frequency [Hz]",
)  # fmt: skip
HELD_WORDS = ("at, mm", "force, N", "stiffness, N/m", "across, um", "angle, mrad", "f, Hz")
MOST_POINTS = 100_000


def equilibria(options: argparse.Namespace) -> None:
    """Print where the mechanism rests, what holds it elsewhere, where it snaps."""
    mechanism, _, system = assembled(options)
    output = Output(options.out)
    ranged = (options.start, options.end)
    if None in ranged and ranged != (None, None):
        raise UserMistake("--from and --to go together: give both ends of the range")
    if ranged != (None, None) and options.held:
        raise UserMistake("--held and --from, --to are two ways to say where: take one of them")
    body, direction = mechanism.release.body, mechanism.release.direction
    way = "x" if direction == 0.0 else f"{direction:g} degrees"
    weight = "gravity acts" if system.gravity else "no gravity acts"
    head = f"{mechanism.name}: displacement of {body} along {way}, from straight; {weight}"
    if ranged != (None, None):
        _range(options, mechanism, system, output, head)
    elif options.held:
        places = quantities(options.held, "m", "--held")
        points = [holding.held(system, check_length(x, system.length, "--held")) for x in places]
        _tell(head, points, system)
        output.table(f"{mechanism.name}-equilibrium.csv", HELD_HEAD, _rows(points))
    else:
        rest = holding.free(system)
        _tell(head, [rest], system)
        stable = rest.frequency > 0.0
        at = tiny(1e3 * rest.displacement, 1e3 * system.length)
        print(f"rests at {at} mm: {'stable' if stable else 'unstable'}")
        output.table(f"{mechanism.name}-equilibrium.csv", HELD_HEAD, _rows([rest]))
    output.write()


def _range(
    options: argparse.Namespace, mechanism: Mechanism, system: System, output: Output, head: str
) -> None:
    low, high = (
        check_length(quantity(text, "m", option), system.length, option)
        for text, option in ((options.start, "--from"), (options.end, "--to"))
    )
    if not low < high:
        raise UserMistake(f"--from {low:g} m is not below --to {high:g} m")
    if not 3 <= options.points <= MOST_POINTS:
        raise UserMistake(f"--points {options.points}: choose a number from 3 to {MOST_POINTS}")
    curve = holding.curve(system, np.linspace(low, high, options.points), reporter())
    every = -(-options.points // 11)
    _tell(head, curve.points[::every], system)
    if every > 1:
        print(f"every {every}th of {options.points} points; --out DIR writes all")
    for rest in curve.rests:
        at = tiny(1e3 * rest.displacement, 1e3 * system.length)
        print(f"rests at {at} mm: {'stable' if rest.stable else 'unstable'}")
    if not curve.rests:
        print("no place of rest in this range")
    for place, force in curve.snaps:
        print(f"snaps through under {force:.5g} N, at {1e3 * place:.6g} mm")
    output.table(f"{mechanism.name}-equilibrium.csv", HELD_HEAD, _rows(curve.points))
    output.table(
        f"{mechanism.name}-rests.csv",
        ["kind", "displacement [m]", "force [N]"],
        [
            *(["stable rest" if x.stable else "unstable rest", x.displacement, 0.0]
              for x in curve.rests),
            *(["snap", place, force] for place, force in curve.snaps),
        ],
    )  # fmt: skip
    output.figure(
        f"{mechanism.name}-equilibrium.png", lambda: holding_figure(curve, mechanism.title)
    )


def _rows(points: Sequence[holding.Held]) -> list[list[float]]:
    return [[p.displacement, p.force, p.stiffness, p.across, p.angle, p.frequency] for p in points]


def _tell(head: str, points: Sequence[holding.Held], system: System) -> None:
    print(head)
    print(_table(points, system.length))
    if any(math.isnan(p.stiffness) for p in points):
        print(f"no stiffness: {immobile(system)}")


def _table(points: Sequence[holding.Held], size: float) -> str:
    most = max(abs(p.force) for p in points)
    rows = [
        [
            tiny(1e3 * p.displacement, 1e3 * size, ".5g"), tiny(p.force, most),
            "-" if math.isnan(p.stiffness) else f"{p.stiffness:.5g}",
            tiny(1e6 * p.across, 1e3), tiny(1e3 * p.angle, 1e3),
            f"{p.frequency:.5g}" if p.frequency > 0.0 else "unstable",
        ]
        for p in points
    ]  # fmt: skip
    return aligned(HELD_WORDS, rows)
