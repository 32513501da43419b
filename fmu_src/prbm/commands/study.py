"""``prbm study``: simulations over one or two parameters, and the optimum of an output."""

import argparse
import re
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..base.errors import ParameterError
from ..base.names import unknown
from ..base.progress import reporter
from ..base.unit_text import prefixed_unit
from ..files.mechanism_file import load
from ..files.settings import (
    UserMistake,
    has_unit,
    optional_quantity,
    pairs,
    quantity,
    settings,
    units_of,
)
from ..mechanics.arrays import Real
from ..mechanism.description import Mechanism
from ..runs.inputs import placeholders
from ..sweeps.study import FLAT_RTOL, Optimum, Study, study
from .duration import given_inputs
from .output import Output, RowFile, aligned

if TYPE_CHECKING:
    from matplotlib.figure import Figure

EXAMPLE = '--vary "stop.position=-4:2 mm:25"'
NUMBER = re.compile(r"[+-]?[\d.]+([eE][+-]?\d+)?")
ROWS_PRINTED_MAX = 45  # Longer tables are only written.
DIGITS = 5  # Significant digits of printed numbers.


def run_study(options: argparse.Namespace) -> None:
    """Run a study, print its table and its optimum."""
    mechanism = load(options.mechanism)
    values = settings(mechanism, options.set)
    output = Output(options.out)
    inputs = given_inputs(options)
    varied = _varied(
        {**units_of(mechanism), **dict.fromkeys(placeholders(inputs), "")}, options.vary
    )
    tolerance = optional_quantity(options.tolerance, "", "--tolerance")
    table, figure = (f"{mechanism.name}-study.{suffix}" for suffix in ("csv", "png"))
    output.check(figure)
    written, rows = RowFile(options.out, table), list[Sequence[object]]()

    def keep(heads: Sequence[str], row: Sequence[object]) -> None:
        written.add(heads, row)
        rows.append(row)
        if len(rows) == 1:
            rows.insert(0, heads)

    found = _reporting(written, lambda: study(
        mechanism, varied, options.of or [], minimise=options.minimise, maximise=options.maximise,
        values=values, inputs=inputs,
        stop_time=optional_quantity(options.stop_time, "s", "--stop-time"),
        step=optional_quantity(options.step, "s", "--step"), tolerance=tolerance,
        workers=options.workers, engine=options.engine, progress=reporter(),
        rows=keep,
    ))  # fmt: skip
    columns = dict(zip(found.varied, found.points.T, strict=True)) | dict(found.outputs)
    _print_table(columns, found.units)
    failed = [message for message in found.messages if message]
    print(f"{len(found.points)} simulations, {len(failed)} failed")
    for message in dict.fromkeys(failed[:3]):
        print(f"failed: {message}")
    if found.optimum is not None:
        verb = "least" if options.maximise is None else "largest"
        for line in _optimum_lines(found.optimum, found.units, verb):
            print(line)
    output.table(table, [str(head) for head in rows[0]], rows[1:])
    output.figure(figure, lambda: _figure(mechanism, found))
    output.write()
    written.remove()


def _reporting(written: RowFile, run: Callable[[], Study]) -> Study:
    """Return a study; an error or Ctrl-C says which rows have been written."""
    try:
        return run()
    except KeyboardInterrupt:
        raise KeyboardInterrupt(f"interrupted; {written.kept}" if written.kept else "") from None
    except ParameterError as error:
        raise ParameterError(f"{error}; {written.kept}" if written.kept else str(error)) from None
    finally:
        written.close()


def _varied(units: Mapping[str, str], texts: Sequence[str]) -> dict[str, Real]:
    """Return the samples of the parameters given by --vary, from the units of all parameters."""
    found = {}
    for name, text in pairs(texts, "--vary", EXAMPLE).items():
        option = f"--vary {name}="
        if name not in units:
            raise UserMistake(f"--vary {name}: {unknown(name, units)}")
        parts = [part.strip() for part in text.split(":")]
        if len(parts) != 3 or not re.fullmatch(r"\d{1,6}", parts[2]) or int(parts[2]) < 2:
            raise UserMistake(
                f"{option}{text}: write LOW:HIGH:COUNT with a count of at least 2, for instance "
                f"{EXAMPLE}"
            )
        low, high = _ends(parts[0], parts[1], units[name], option)
        if not low < high:
            raise UserMistake(f"{option}{text}: the lower end must be below the upper one")
        found[name] = np.linspace(low, high, int(parts[2]))
    return found


def _ends(low: str, high: str, unit: str, option: str) -> tuple[float, float]:
    """Return the ends of a range; the unit of the upper one holds for both.

    Examples
    --------
    >>> _ends("-4", "2 mm", "m", "--vary")
    (-0.004, 0.002)
    """
    upper = quantity(high, unit, option)  # First: a message about its unit quotes it as written.
    if has_unit(high) and NUMBER.fullmatch(low):
        low = low + NUMBER.sub("", high, count=1)
    return quantity(low, unit, option), upper


def _text(x: float, unit: str) -> str:
    """Return a number with its display unit."""
    if not unit:
        return f"{x:.{DIGITS}g}"
    factor, shown = prefixed_unit(abs(x), unit)
    return f"{factor * x:.{DIGITS}g} {shown}"


def _print_table(columns: Mapping[str, Real], units: Mapping[str, str]) -> None:
    """Print the samples, unless there are many."""
    if len(next(iter(columns.values()))) > ROWS_PRINTED_MAX:
        return
    head, cells = [], []
    for name, x in columns.items():
        known = np.abs(x[np.isfinite(x)])
        largest = float(known.max()) if len(known) else 0.0
        factor, shown = prefixed_unit(largest, units[name]) if units[name] else (1.0, "-")
        head.append(f"{name} [{shown}]")
        cells.append([f"{factor * value:.{DIGITS}g}" for value in x])
    print(aligned(head, list(zip(*cells, strict=True))))


def _optimum_lines(optimum: Optimum, units: Mapping[str, str], verb: str) -> list[str]:
    """Return the lines about an optimum."""
    place = ", ".join(f"{name} = {_text(x, units[name])}" for name, x in optimum.point.items())
    lines = [
        f"{verb} {optimum.output}: {_text(optimum.value, units[optimum.output])} at {place}, with "
        f"{len(optimum.values)} more simulations"
    ]
    for name, (low, high) in optimum.flat.items():
        ends = "" if all(optimum.bounded[name]) else "; it reaches the end of the samples"
        lines.append(
            f"within {100 * FLAT_RTOL:g} % of it: {name} from {_text(low, units[name])} to "
            f"{_text(high, units[name])}{ends}"
        )
    if optimum.robust is not None:
        ((name, _),) = optimum.point.items()
        low, high, worst = optimum.robust
        bound = "most" if verb == "least" else "least"
        lines.append(
            f"best five neighbouring samples: at {bound} {_text(worst, units[optimum.output])} "
            f"with {name} from {_text(low, units[name])} to {_text(high, units[name])}"
        )
    return lines


def _figure(mechanism: Mechanism, found: Study) -> "Figure":
    from ..plots.study import curves, maps  # imported here: it takes a second

    best = found.optimum
    if len(found.varied) == 2:
        marked = None if best is None else (best.output, [*best.point.values()], best.value)
        return maps(mechanism.title, found.varied, found.outputs, found.units, marked)
    ((name, samples),) = found.varied.items()
    if best is None:
        return curves(mechanism.title, (name, samples), found.outputs, found.units, {}, None)
    further = {best.output: (best.points[:, 0], best.values)}
    shown = (best.output, best.point[name], best.value, best.flat[name])
    return curves(mechanism.title, (name, samples), found.outputs, found.units, further, shown)
