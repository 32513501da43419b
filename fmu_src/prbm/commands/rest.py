"""``prbm equilibrium``: rest positions, holding forces and snap-through."""

import argparse
import math
from collections.abc import Sequence

import numpy as np

from ..analysis import holding
from ..analysis.held import POINTS_MAX, HeldUnit, check_held, held_scale, held_unit
from ..analysis.static_shape import StaticShape
from ..base.progress import reporter
from ..base.tolerances import RIGID_RTOL
from ..files.settings import UserMistake, quantities, quantity
from ..mechanics.body_compliance import stiffness_matrix
from ..mechanics.statics import equilibrium, immobile
from ..mechanics.system import System
from ..mechanism.description import Mechanism
from ..plots.holding import holding_figure
from ..runs.released import released_label
from .load_paths import given_loads, load_text, vary
from .output import Output, aligned
from .systems import ZERO_RTOL, assembled, rounded

MATRIX_UNITS = {  # Heads of the columns and of the rows.
    "compliance": (("1 N along x", "1 N along y", "1 N m"), ("x [m]", "y [m]", "angle [rad]")),
    "stiffness": (("1 m along x", "1 m along y", "1 rad"), ("x [N]", "y [N]", "moment [N m]")),
}


def rest_positions(options: argparse.Namespace) -> None:
    """Print the rest positions, or the forces that hold the released body at displacements."""
    mechanism, _, system = assembled(options)
    output = Output(options.out)
    _check_options(options)
    unit = held_unit(mechanism)
    head = f"{mechanism.name}: {unit.amount} of {_held(mechanism)}, from straight; " + (
        "gravity acts" if system.gravity else "no gravity acts"
    )
    if options.start is not None:
        _range(options, mechanism, system, output, head)
    elif options.vary:
        print(head)
        loads = given_loads(mechanism, options.load)
        vary(options.vary, loads, mechanism, system, output, options.branches)
    else:
        _shapes(options, mechanism, system, output, head)
    output.write()


def _shapes(
    options: argparse.Namespace, mechanism: Mechanism, system: System, output: Output, head: str
) -> None:
    """Print single shapes under loads, held or free, with the places of all bodies and probes."""
    unit, loads = held_unit(mechanism), given_loads(mechanism, options.load)
    held: list[float | None] = [None]
    if options.held:
        given = quantities(options.held, unit.si, "--held")
        held = [check_held(x, system, "--held") for x in given]
    shapes = [
        StaticShape(system, equilibrium(system, x, loads), x is not None, loads) for x in held
    ]
    points = [
        holding.described(system, shape.displacement if x is None else x, shape.shape)
        for x, shape in zip(held, shapes, strict=True)
    ]
    _print(head + load_text(loads), points, system)
    if not options.held and not math.isnan(points[0].frequency):
        _print_rest(points[0].displacement, points[0].unstable == 0, system)
    output.table(f"{mechanism.name}-equilibrium.csv", _csv_head(unit), _rows(points))
    places = [
        [point.displacement, name, *place]
        for point, shape in zip(points, shapes, strict=True)
        for name, place in shape.positions.items()
    ]
    output.table(
        f"{mechanism.name}-positions.csv",
        [f"{unit.amount} [{unit.si}]", "name", "x [m]", "y [m]", "angle [rad]"], places,
    )  # fmt: skip
    if options.stiffness:
        _stiffness(options, mechanism, system, shapes, output)


def _stiffness(
    options: argparse.Namespace, mechanism: Mechanism, system: System,
    shapes: Sequence[StaticShape], output: Output,
) -> None:  # fmt: skip
    """Print the compliance and the stiffness matrix of a body, and write them as a table."""
    name = options.stiffness
    rows: list[list[object]] = []
    for shape in shapes:
        C = shape.compliance(name, options.at)
        K = stiffness_matrix(C, system.length)
        print(
            f"\nsmall loads on {name} at {options.at or 'its centre of mass'}"
            + (f", {_held(mechanism)} held" if shape.held else "")
        )
        for title, matrix in (("compliance", C), ("stiffness", K)):
            if matrix is None:
                print("no stiffness matrix: the body is rigid in a direction")
                continue
            columns, names = MATRIX_UNITS[title]
            size = np.sqrt(np.abs(np.outer(matrix.diagonal(), matrix.diagonal())).max())
            cells = [
                [what, *(rounded(float(x), RIGID_RTOL * size / ZERO_RTOL, ".5g") for x in row)]
                for what, row in zip(names, matrix, strict=True)
            ]
            print(aligned([title, *columns], cells))
            rows += [[shape.displacement, title, *map(float, row)] for row in matrix]
    unit = held_unit(mechanism)
    head = [f"{unit.amount} [{unit.si}]", "matrix", "x", "y", "angle"]
    output.table(f"{mechanism.name}-stiffness.csv", head, rows)


def _check_options(options: argparse.Namespace) -> None:
    """Reject options that exclude each other."""
    if (options.start is None) != (options.end is None):
        raise UserMistake("--from and --to: give both ends of the range")
    ranged = options.start is not None
    if ranged and options.held:
        raise UserMistake("--held excludes --from and --to: give one or the other")
    if ranged and (options.load or options.stiffness):
        raise UserMistake("--load and --stiffness exclude --from and --to: give one or the other")
    if options.vary and (ranged or options.held or options.stiffness):
        raise UserMistake("--vary excludes --held, --stiffness, --from and --to")
    if options.branches < 0:
        raise UserMistake(f"--branches {options.branches}: must be at least 0")
    if options.branches and not (options.vary or ranged):
        raise UserMistake("--branches are those of --vary NAME=A:B, or of --from and --to")
    if options.at and not options.stiffness:
        raise UserMistake("--at is the point of --stiffness BODY: give both")


def _range(
    options: argparse.Namespace, mechanism: Mechanism, system: System, output: Output, head: str
) -> None:
    """Print rest positions and snap-through in a range of displacements; write the force curve."""
    unit = held_unit(mechanism)
    low, high = (
        check_held(quantity(text, unit.si, option), system, option)
        for text, option in ((options.start, "--from"), (options.end, "--to"))
    )
    if not low < high:
        raise UserMistake(f"--from {low:g} {unit.si} must be below --to {high:g} {unit.si}")
    if not 3 <= options.points <= POINTS_MAX:
        raise UserMistake(f"--points {options.points}: must lie between 3 and {POINTS_MAX}")
    amounts = np.linspace(low, high, options.points)
    curve = holding.curve(system, amounts, reporter(), options.branches)
    every = -(-len(curve.points) // 11)
    _print(head, curve.points[::every], system)
    if every > 1:
        print(f"every {every}th of {len(curve.points)} points; write all with --out DIR")
    if any(point.unstable_held for point in curve.points):
        print("*: unstable also while it is held, or beyond a displacement limit")
    if curve.ended:
        print(f"the curve ends: {curve.ended}")
    _print_events(curve.rests, curve.events, system)
    if not curve.rests:
        print("no rest position in this range")
    effort = unit.si_effort.replace(".", " ")
    for x, force in curve.snaps:
        print(f"snap-through at {unit.factor * x:.6g} {unit.shown}, under {force:.5g} {effort}")
    for number, branch in enumerate(curve.branches, 1):
        _print_branch(number, branch, system)
    output.table(f"{mechanism.name}-equilibrium.csv", _csv_head(unit), _rows(curve.points))
    output.table(
        f"{mechanism.name}-stability.csv",
        ["kind", f"{unit.amount} [{unit.si}]", f"{unit.effort} [{unit.si_effort}]"],
        [
            *([f"{_stability(x.stable)} rest position", x.displacement, 0.0]
              for x in curve.rests),
            *([event.kind, event.displacement, event.force] for event in curve.events),
            *(["snap-through", x, force] for x, force in curve.snaps),
        ],
    )  # fmt: skip
    if curve.branches:
        output.table(
            f"{mechanism.name}-branches.csv",
            ["branch", f"{unit.amount} [{unit.si}]", f"{unit.effort} [{unit.si_effort}]",
             "unstable directions"],
            [
                [number, float(x), float(force), int(count)]
                for number, branch in enumerate(curve.branches, 1)
                for x, force, count in zip(
                    branch.displacements, branch.forces, branch.unstable, strict=True
                )
            ],
        )  # fmt: skip
    turns = mechanism.release.turns
    output.figure(
        f"{mechanism.name}-equilibrium.png",
        lambda: holding_figure(curve, mechanism.title, turns),
    )


def _print_branch(number: int, branch: holding.Branch, system: System) -> None:
    """Print where a branch begins, its stable part and its largest force."""
    unit = held_unit(system.mechanism)
    effort = unit.si_effort.replace(".", " ")
    largest = branch.forces[np.abs(branch.forces).argmax()]
    stable = branch.displacements[1:][branch.unstable[1:] == 0]
    part = (
        f"stable from {unit.factor * stable.min():.6g} to {unit.factor * stable.max():.6g} "
        f"{unit.shown}"
        if len(stable)
        else "unstable"
    )
    print(
        f"branch {number} from {unit.factor * branch.displacements[0]:.6g} {unit.shown}, under "
        f"{branch.forces[0]:.5g} {effort}: {part}; largest force {largest:.5g} {effort}; "
        f"{branch.ended or 'it leaves the range'}"
    )
    for rest in branch.rests:
        if rest.stable:
            _print_rest(rest.displacement, rest.stable, system)


def _print_events(
    rests: Sequence[holding.RestPosition], events: Sequence[holding.Event], system: System
) -> None:
    """Print rest positions, and limit points and bifurcations with their forces."""
    unit = held_unit(system.mechanism)
    for rest in rests:
        _print_rest(rest.displacement, rest.stable, system)
    for event in events:
        several = f" of {event.critical} directions" if event.critical > 1 else ""
        print(
            f"{event.kind}{several} at {unit.factor * event.displacement:.6g} {unit.shown}, under "
            f"{event.force:.5g} {unit.si_effort.replace('.', ' ')}"
        )


def _stability(stable: bool) -> str:
    return "stable" if stable else "unstable"


def _frequency(point: holding.Held) -> str:
    """Return the frequency as text; a star marks shapes that are unstable while they are held."""
    if math.isnan(point.frequency):  # No body is held.
        return "-"
    free = "unstable" if point.unstable else "free"
    text = f"{point.frequency:.5g}" if point.frequency > 0.0 else free
    return f"{text}*" if point.unstable_held else text


def _print_rest(displacement: float, stable: bool, system: System) -> None:
    unit = held_unit(system.mechanism)
    at = rounded(unit.factor * displacement, unit.factor * held_scale(system))
    print(f"rest position at {at} {unit.shown}: {_stability(stable)}")


def _held(mechanism: Mechanism) -> str:
    """Return what is held, with the direction of a displacement."""
    release = mechanism.release
    if release.turns:
        return release.body
    along = "x" if release.direction == 0.0 else f"{release.direction:g} degrees"
    return f"{released_label(release)} along {along}"


def _csv_head(unit: HeldUnit) -> list[str]:
    """Return the names of the columns of held shapes, in SI units."""
    return [
        f"{unit.amount} [{unit.si}]", f"holding {unit.effort} [{unit.si_effort}]",
        f"stiffness [{unit.si_stiffness}]", "across [m]", "angle [rad]",
        "fundamental frequency [Hz]", "unstable directions", "unstable directions, held",
    ]  # fmt: skip


def _rows(points: Sequence[holding.Held]) -> list[list[float]]:
    """Return the rows of the table of held shapes, in SI units."""
    return [
        [p.displacement, p.force, p.stiffness, p.across, p.angle, p.frequency, p.unstable,
         p.unstable_held]
        for p in points
    ]  # fmt: skip


def _print(head: str, points: Sequence[holding.Held], system: System) -> None:
    """Print held shapes, and the reason for a missing stiffness."""
    print(head)
    print(_table(points, system))
    if any(math.isnan(p.stiffness) for p in points):
        print(f"no stiffness: {immobile(system)}")


def _table(points: Sequence[holding.Held], system: System) -> str:
    """Return the printed table of held shapes."""
    unit, scale = held_unit(system.mechanism), held_scale(system)
    largest = max(abs(p.force) for p in points)
    rows = [
        [
            rounded(unit.factor * p.displacement, unit.factor * scale, ".5g"),
            rounded(p.force, largest),
            "-" if math.isnan(p.stiffness) else f"{p.stiffness:.5g}",
            rounded(1e6 * p.across, 1e3), rounded(1e3 * p.angle, 1e3),
            _frequency(p),
        ]
        for p in points
    ]  # fmt: skip
    head = (
        f"at [{unit.shown}]", f"{unit.effort} [{unit.si_effort}]",
        f"stiffness [{unit.si_stiffness}]", "across [µm]", "angle [mrad]", "f [Hz]",
    )  # fmt: skip
    return aligned(head, rows)
