"""``prbm stress``: the stress of flexures at rest, held and in motion, and their fatigue."""

import argparse
import math
from collections.abc import Sequence

from ..analysis.held import check_held, held_unit
from ..analysis.strength import Loading, counts_cycles, loadings
from ..analysis.stress_field import StressRecorder
from ..base.progress import reporter
from ..files.mechanism_file import load
from ..files.settings import UserMistake, quantities, settings
from ..mechanics.assembly import assemble
from ..mechanics.statics import equilibrium
from ..mechanics.stress import Stress, static_stresses, with_stress
from ..mechanism.description import Mechanism
from ..mechanism.parts import FlexureType
from ..runs.headline import instant, length, stress_text
from ..runs.result import Result
from ..runs.run import communication_points, simulate
from ..runs.struck import UNRELIABLE, first_rigid_impact, peak_before
from .duration import given_inputs, span
from .missing import missing_package
from .output import Output, aligned

ROWS_PER_STEP = 5  # Rows of the counted history per communication step.
HEAD = ("flexure", "peak [MPa]", "at t", "from start", "yield/peak", "damage", "runs to failure")


def print_stress(options: argparse.Namespace) -> None:
    """Print the stress of all flexures in held shapes, or in the motion after the release."""
    mechanism = with_stress(load(options.mechanism))
    if not mechanism.flexures:
        raise UserMistake(
            f"{mechanism.name} has no flexures, whose stress is computed; prbm simulate prints its "
            "impacts"
        )
    if options.held:
        _held(options, mechanism)
    else:
        _moving(options, mechanism)


def _held(options: argparse.Namespace, mechanism: Mechanism) -> None:
    """Print the stress in shapes in which the released body is held."""
    values = settings(mechanism, options.set)
    own = {p.name for p in mechanism.parameters}
    for name in values:
        if name not in own:
            raise UserMistake(f"--set {name}: inputs have no effect on held shapes")
    if options.input or options.stop_time:
        raise UserMistake("--held excludes --input and --stop-time: the mechanism does not move")
    system, unit = assemble(mechanism, mechanism.values(values)), held_unit(mechanism)
    head = (
        f"at [{unit.shown}]", "flexure", "start [MPa]", "end [MPa]", "largest [MPa]",
        "yield/largest",
    )  # fmt: skip
    rows, table, held = [], [], []
    for text in quantities(options.held, unit.si, "--held"):
        x = check_held(text, system, "--held")
        held.append(x)
        found = static_stresses(system, equilibrium(system, x))
        for flexure in mechanism.flexures:
            name, one = flexure.name, found[flexure.name]
            safety = _safety(one, mechanism.type_of(flexure))
            numbers = [1e-6 * y for y in (one.start, one.end, one.largest)]
            rows.append([f"{unit.factor * x:.5g}", name, *(f"{y:.5g}" for y in numbers), safety])
            table.append([x, name, one.start, one.end, one.largest, one.position])
    print(
        f"{mechanism.name}: stress on the left faces, seen from start to end; tension is positive"
    )
    print(aligned(head, rows))
    output = Output(options.out)
    output.table(
        f"{mechanism.name}-stress-held.csv",
        [
            f"{unit.amount} [{unit.si}]", "flexure", "start [Pa]", "end [Pa]", "largest [Pa]",
            "position [m]",
        ],
        table,
    )  # fmt: skip
    if options.out is not None:
        from ..plots.stress import stress_figure  # imported here: it takes a second

        labels = [f"held at {unit.factor * x:.4g} {unit.shown}" for x in held]
        output.figure(
            f"{mechanism.name}-stress-held.png",
            lambda: stress_figure(mechanism, values, held, labels),
        )
    output.write()


def _safety(one: Stress, kind: FlexureType) -> str:
    return "-" if not kind.yield_strength else f"{kind.yield_strength / one.largest:.3g}"


def _moving(options: argparse.Namespace, mechanism: Mechanism) -> None:
    """Print peak stress, safety factor and fatigue of the motion after the release."""
    values, output = settings(mechanism, options.set), Output(options.out)
    stop_time, step = span(mechanism, values, options.stop_time, None, options.engine)
    communication_points(stop_time, step / ROWS_PER_STEP)
    recorder = StressRecorder()
    result = simulate(
        mechanism, values, inputs=given_inputs(options), stop_time=stop_time,
        step=step / ROWS_PER_STEP, progress=reporter(), engine=options.engine, observer=recorder,
    )  # fmt: skip
    found = loadings(result.columns, mechanism, fatigue=counts_cycles(), stress=recorder.field)
    size = assemble(mechanism, mechanism.values()).length
    print(f"{mechanism.name}: largest stress in {stop_time:g} s")
    print(aligned(HEAD, [_row(one, stop_time, size) for one in found]))
    hit = first_rigid_impact(result.columns, mechanism)
    for line in [*struck(result, found, hit), *_missing(mechanism), *no_damage(mechanism)]:
        print(line)
    output.table(
        f"{mechanism.name}-stress.csv",
        ["flexure", "peak [Pa]", "time [s]", "position [m]", "yield/peak [-]", "damage [-]"],
        [[x.flexure, x.peak, x.time, x.position, x.safety, x.damage] for x in found],
    )
    output.write()


def struck(result: Result, found: Sequence[Loading], hit: float) -> list[str]:
    """Return the stress before the first rigid impact, and a caveat about the one after it."""
    if math.isinf(hit):
        return []
    kinds = {f.name: result.mechanism.type_of(f) for f in result.mechanism.flexures}
    lines = [
        stress_text(
            one.flexure, peak_before(result.columns, one.flexure, hit),
            kinds[one.flexure].yield_strength,
        ) + ", before the first impact"
        for one in found if one.time > hit
    ]  # fmt: skip
    return [*lines, UNRELIABLE]


def _row(one: Loading, stop_time: float, size: float) -> list[str]:
    """Return the printed row of a flexure."""
    return [
        one.flexure, f"{1e-6 * one.peak:.5g}", instant(one.time, stop_time, 5),
        length(one.position, size), "-" if one.safety is None else f"{one.safety:.3g}",
        "-" if one.damage is None else f"{one.damage:.3g}",
        "-" if not one.damage else f"{1.0 / one.damage:.3g}",
    ]  # fmt: skip


def _missing(mechanism: Mechanism) -> list[str]:
    """Return remedies for strengths that are not given."""
    kinds = [mechanism.type_of(flexure) for flexure in mechanism.flexures]
    lines = []
    if any(kind.yield_strength is None for kind in kinds):
        lines.append("no safety factor without yield_strength: add it to the material")
    if any(kind.fatigue_strength is None for kind in kinds):
        lines.append(
            "no damage without fatigue_strength, fatigue_cycles and tensile_strength: add them to "
            "the material"
        )
    return lines


def no_damage(mechanism: Mechanism) -> list[str]:
    """Return a line if the fatigue damage of a mechanism needs a package that is not installed."""
    if counts_cycles() or not any(kind.fatigue_strength for kind in mechanism.flexure_types):
        return []
    return [f"no damage: {missing_package(ModuleNotFoundError(name='rainflow'))}"]
