"""``prbm study`` and ``prbm sweep``: simulations of a mechanism or an FMU over parameters."""

import argparse
import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..base.names import unknown
from ..base.progress import reporter
from ..base.unit_text import prefixed_unit
from ..files.mechanism_file import file_of, load
from ..files.settings import (
    UserMistake,
    assigned,
    has_unit,
    is_tolerance,
    optional_quantity,
    pairs,
    quantity,
)
from ..fmu.parameter_sets import parameter_set
from ..fmu.start import interface
from ..mechanics.arrays import Real
from ..mechanism.description import Mechanism
from ..runs.engine import KERNEL
from ..runs.inputs import files_of, placeholders
from ..sweeps.design import SENSITIVITY, Yield, constant
from ..sweeps.optimum import EDGE_RTOL, FLAT_RTOL, Optimum
from ..sweeps.outputs import GOOD
from ..sweeps.plan import Model
from ..sweeps.study import Study, model_of, study
from .duration import given_inputs, times
from .output import Output, aligned
from .record import Record

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

EXAMPLE = '--vary "stop.position=-4:2 mm:25"'
FILES = (
    "study.csv",
    "study.png",
    "best.ssv",
    "sensitivity.csv",
    "study-run.json",
)  # Ends of the names of the written files.
NUMBER = re.compile(r"[+-]?[\d.]+([eE][+-]?\d+)?")
ROWS_PRINTED_MAX = 45  # Longer tables are only written.
SPREAD = (0.0, 0.025, 0.5, 0.975, 1.0)  # Printed quantiles of drawn values.
DIGITS = 5  # Significant digits of printed numbers.
NOTHING = "-"  # In place of a value that a simulation does not have.
SHARES_HEAD = ["output", "parameter", "alone", "alone, low", "alone, high",
               "in total", "in total, low", "in total, high"]  # fmt: skip


def run_study(options: argparse.Namespace) -> None:
    """Run a study, print its table and its optimum."""
    path = Path(options.mechanism)
    mechanism = None if path.suffix.lower() == ".fmu" else load(path)
    model = model_of(mechanism or path)
    output = Output(options.out)
    table, figure, best, shares, run = (f"{model.name}-{end}" for end in FILES)
    output.check(table, figure, best, shares, run)
    record = Record(options.out, run, path if mechanism is None else file_of(path))
    arguments = _arguments(options, model)
    found = study(
        mechanism or path, **arguments, **_limits(options), executor=options.scheduler,
        table=None if options.out is None else options.out / table,
    )  # fmt: skip
    _print_simulations(options, found)
    if options.method == SENSITIVITY:
        rows = _shares(found)
        _print_sensitivities(found, rows)
        output.table(shares, SHARES_HEAD, rows)
    if found.optimum is not None:
        _print_optimum(found.optimum, found.units, options.maximise is not None)
        if mechanism is not None:
            output.text(best, _best_set(mechanism, found.optimum, arguments["values"]))
    if found.share is not None:
        print(_yield_line(found.share, options.subject_to, found.toleranced))
    elif options.subject_to:
        good = int(np.sum(found.good))
        print(
            f"{good} of {len(found.points)} simulations satisfy {' and '.join(options.subject_to)}"
        )
    output.figure(figure, lambda: _figure(model.title, found))
    if options.out is not None:
        print(options.out / table)
    files = files_of(arguments["inputs"]) + [str(options.table)] * (options.table is not None)
    output.text(run, record.text(model.name, arguments | _times(found), files))
    output.write()
    for sentence in record.notes():
        print(sentence)


def run_sweep(options: argparse.Namespace) -> None:
    """Run a sweep and print a summary; results are written during the sweep."""
    from ..sweeps.sweep import sweep  # imported here: an extra

    values = assigned(model_of(options.fmu).units, options.set) if options.set else {}
    found = sweep(
        options.fmu, options.table, options.out, outputs=options.output, values=values,
        inputs=given_inputs(options), **times(options), **_limits(options),
        scheduler=options.scheduler,
    )  # fmt: skip
    print(_summary(found, options.out))


def _summary(results: "pd.DataFrame", out: str) -> str:
    """Return a summary of the runs of a sweep in a few lines."""
    good = results["status"].isin(GOOD)
    lines = [f"{len(results)} runs, {int((~good).sum())} failed: {out}"]
    for row, status, message in results.loc[~good, ["row", "status", "message"]].head(3).values:
        lines.append(f"row {row} {status}: {message}")
    if (~good).sum() > 3:
        lines.append("see the columns status and message for the other failed runs")
    complete = results[good].select_dtypes("number")
    return "\n".join(lines + _without_values(dict(complete.isna().sum()), len(complete)))


def _without_values(missing: Mapping[str, int], complete: int) -> list[str]:
    """Return sentences about outputs that complete simulations lack, from their numbers."""
    return [
        f"{output}: no value in {count} of {complete} complete simulations; simulate longer, or "
        "choose another output"
        for output, count in missing.items()
        if count
    ]


def _limits(options: argparse.Namespace) -> dict[str, Any]:
    """Return the arguments of a study that its results do not depend on."""
    timeout = optional_quantity(options.timeout, "s", "--timeout")
    return {
        "workers": options.workers, "retries": options.retries, "timeout": timeout,
        "overwrite": options.overwrite, "retry_failed": options.retry_failed,
        "progress": reporter(),
    }  # fmt: skip


def _arguments(options: argparse.Namespace, model: Model) -> dict[str, Any]:
    """Return the arguments of the study that its results depend on."""
    units = {name: model.units.get(name, "").removeprefix("1") for name in model.values}
    values, inputs = assigned(units, options.set), given_inputs(options)
    names = {**units, **dict.fromkeys(placeholders(inputs), "")}
    return {
        "vary": _vary(options, names, model), "outputs": options.of or [],
        "runs": options.runs, "method": options.method, "seed": options.seed,
        "minimise": options.minimise, "maximise": options.maximise,
        "subject_to": options.subject_to,
        "tolerances": pairs(options.tolerance_of, "--tolerance-of", "stop.position=0.1mm"),
        "values": values, "inputs": inputs, **times(options), "engine": options.engine,
    }  # fmt: skip


def _times(found: Study) -> dict[str, Any]:
    """Return times, tolerance and engine of the simulations, defaults replaced by their values."""
    known = found.settings
    return {
        "stop_time": known["stop time [s]"], "step": known["step [s]"],
        "tolerance": known["tolerance"], "engine": known.get("engine", "FMU") or KERNEL,
    }  # fmt: skip


def _print_simulations(options: argparse.Namespace, found: Study) -> None:
    """Print the simulations, their spread if they are drawn, and the errors of failed ones."""
    columns = {**found.parameters, **found.outputs}
    _print_table(columns, found.units, found.satisfied)
    if options.runs is not None:
        _print_spread(columns, found.units)
    failed = [message for message in found.messages if message]
    print(f"{len(found.points)} simulations, {len(failed)} failed")
    for message in dict.fromkeys(failed[:3]):
        print(f"failed: {message}")
    missing = {of: int(np.isnan(x).sum()) - len(failed) for of, x in found.outputs.items()}
    for sentence in _without_values(missing, len(found.points) - len(failed)):
        print(sentence)


def _vary(
    options: argparse.Namespace, units: Mapping[str, str], model: Model
) -> dict[str, Any] | Path | None:
    """Return the parameters: samples, ranges, tolerances, or the path of a list."""
    if options.table is not None and options.vary is None:
        return Path(options.table)
    if options.table is None and options.vary is None and options.runs and model.tolerances:
        return None  # Drawn within the tolerances of the mechanism.
    if options.table is not None:
        raise UserMistake("the parameters are in --table and in --vary: omit one of them")
    if options.vary is None:
        raise UserMistake(
            "give the parameters with --vary, a list of them with --table, or [tolerances] in the "
            "mechanism file and --runs"
        )
    return _varied(units, options.vary, options.runs is not None)


def _varied(units: Mapping[str, str], texts: Sequence[str], drawn: bool) -> dict[str, Any]:
    """Return the samples of the parameters given by --vary, from the units of all parameters."""
    found: dict[str, Any] = {}
    for name, text in pairs(texts, "--vary", EXAMPLE).items():
        option = f"--vary {name}="
        if name not in units:
            raise UserMistake(f"--vary {name}: {unknown(name, units)}")
        if drawn and is_tolerance(text):
            found[name] = text
            continue
        parts = [part.strip() for part in text.split(":")]
        if drawn and len(parts) == 3:
            raise UserMistake(
                f"{option}{text}: COUNT is that of a grid, and --runs draws values from LOW:HIGH; "
                "omit one of them"
            )
        if drawn and len(parts) == 2:
            parts.append("2")
        elif len(parts) != 3 or not re.fullmatch(r"\d{1,6}", parts[2]) or int(parts[2]) < 2:
            raise UserMistake(
                f"{option}{text}: write LOW:HIGH:COUNT with a count of at least 2, for instance "
                f"{EXAMPLE}; or LOW:HIGH or VALUE +- TOLERANCE with --runs"
            )
        low, high = _ends(parts[0], parts[1], units[name], option)
        if not low < high:
            raise UserMistake(f"{option}{text}: the lower end must be below the upper one")
        found[name] = (low, high) if drawn else np.linspace(low, high, int(parts[2]))
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


def _text(x: float, unit: str, digits: int = DIGITS) -> str:
    """Return a number with its display unit."""
    factor, shown = prefixed_unit(abs(x), unit)
    return f"{factor * x:.{digits}g} {shown}".rstrip()


def _cells(name: str, x: Real, unit: str, values: Any) -> list[str]:
    """Return a heading and the cells of values, in the display unit of x."""
    known = np.abs(x[np.isfinite(x)])
    factor, shown = prefixed_unit(float(known.max(initial=0.0)), unit)
    cells = [NOTHING if np.isnan(v) else f"{factor * float(v):.{DIGITS}g}" for v in values]
    return [f"{name} [{shown or '-'}]", *cells]


def _print_table(
    columns: Mapping[str, Real], units: Mapping[str, str], satisfied: Any = True
) -> None:
    """Print the samples, unless there are many; a cross marks those that violate a condition."""
    if len(next(iter(columns.values()))) > ROWS_PRINTED_MAX:
        return
    shown = [_cells(name, x, units[name], x) for name, x in columns.items()]
    if not np.all(satisfied):
        shown.append(["violated", *("" if held else "x" for held in satisfied)])
    head, *rows = zip(*shown, strict=True)
    print(aligned(head, rows))


def _print_spread(columns: Mapping[str, Real], units: Mapping[str, str]) -> None:
    """Print how drawn parameters and their outputs are distributed."""
    rows = []
    for name, x in columns.items():
        if len(known := x[np.isfinite(x)]):
            numbers = [known.mean(), known.std(), *np.quantile(known, SPREAD)]
            rows.append(_cells(name, known, units[name], numbers))
    heads = ["", "mean", "deviation", *(f"{100 * share:g} %" for share in SPREAD)]
    print(aligned(heads, rows))


def _print_optimum(optimum: Optimum, units: Mapping[str, str], largest: bool) -> None:
    """Print the best points of several parameters, the best one first, and the optimum."""
    if len(optimum.point) > 1:
        print(f"best {len(optimum.best)} points:")
        columns = dict(zip(optimum.point, optimum.best.T, strict=True))
        _print_table({**columns, optimum.output: optimum.best_values}, units)
    verb = "largest" if largest else "least"
    place = ", ".join(f"{name} = {_text(x, units[name])}" for name, x in optimum.point.items())
    lines = [
        f"{verb} {optimum.output}: {_text(optimum.value, units[optimum.output])} at {place}, with "
        f"{len(optimum.values)} more simulations"
    ]
    if optimum.constraints:
        reached = [
            f"{c.text} ({_text(optimum.others[c.output], units[c.output])}"
            f"{', active' * (c.text in optimum.active)})"
            for c in optimum.constraints
        ]
        lines.append(f"constraints: {'; '.join(reached)}")
    if "impacts" in optimum.others:
        lines.append(f"impacts: {optimum.others['impacts']:g}")
    for name, (low, high) in optimum.flat.items():
        ends = "" if all(optimum.bounded[name]) else "; it reaches the end of the samples"
        lines.append(
            f"within {100 * FLAT_RTOL:g} % of it: {name} from {_text(low, units[name])} to "
            f"{_text(high, units[name])}{ends}"
        )
    lines += _design_lines(optimum, units)
    if optimum.robust is not None:
        ((name, _),) = optimum.point.items()
        low, high, worst = optimum.robust
        bound = "least" if largest else "most"
        lines.append(
            f"best five neighbouring samples: at {bound} {_text(worst, units[optimum.output])} "
            f"with {name} from {_text(low, units[name])} to {_text(high, units[name])}"
        )
    print("\n".join(lines))


def _design_lines(optimum: Optimum, units: Mapping[str, str]) -> list[str]:
    """Return for each parameter how exactly it must be built, and whether it is at an end."""
    share = f"{100 * FLAT_RTOL:g} %"
    lines = []
    for name, (low, high) in optimum.flat.items():
        least = EDGE_RTOL * optimum.spacing[name]  # The ends of the range are known so exactly.
        sides = [
            f"{_text(distance, units[name], 3) if distance > least else 'any'} {side}"
            for distance, side in zip(optimum.slack[name], ("less", "more"), strict=True)
            if math.isfinite(distance)
        ]
        what = f"{optimum.output} is {share} worse" + " or a condition fails" * bool(
            optimum.constraints
        )
        what = f"{what} with {' or '.join(sides)}" if sides else (
            f"{optimum.output} changes by less than {share} over all samples"
        )  # fmt: skip
        if name in optimum.at_ends:
            what += "; the best value is the end of the samples: better ones may lie beyond"
        elif all(optimum.bounded[name]):
            middle, half = 0.5 * (low + high), 0.5 * (high - low)
            what += f"; build {_text(middle, units[name], 4)} +- {_text(half, units[name], 2)}"
            if name in optimum.narrow:
                what += ", which is narrower than the distance of the samples"
        lines.append(f"design {name}: {what}")
    return lines


def _print_sensitivities(found: Study, shares: Sequence[Sequence[Any]]) -> None:
    """Print first-order and total indices of each output with their confidence intervals."""
    for output in found.sensitivities:
        rows, without = [], []
        for of, name, *numbers in shares:
            x, a, b, total, c, d = (f"{number:.3f}" for number in numbers)
            if of == output and (numbers[3] or numbers[4] < numbers[5]):
                rows.append([name, x, f"{a} to {b}", total, f"{c} to {d}"])
            elif of == output:
                without.append(name)
        print(f"shares of the variance of {output}:")
        print(aligned(["parameter", "alone", "95 %", "in total", "95 %"], rows))
        if without:
            print(f"without effect on {output}: {', '.join(without)}")
    for output, values in found.outputs.items():
        if output not in found.sensitivities:
            if not np.isfinite(values).all():
                reason = "they need a value of each simulation"
            elif constant(values):
                reason = "no parameter changes it"
            else:
                reason = "too few simulations change it; increase --runs"
            print(f"no shares of the variance of {output}: {reason}")


def _shares(found: Study) -> list[list[Any]]:
    """Return the rows of the table of indices."""
    return [
        [output, name, *map(float, (one.first[k], *one.first_interval[k])),
         *map(float, (one.total[k], *one.total_interval[k]))]
        for output, one in found.sensitivities.items()
        for k, name in enumerate(one.names)
    ]  # fmt: skip


def _yield_line(share: Yield, constraints: Sequence[str], toleranced: Sequence[str]) -> str:
    where = f" within the tolerances of {', '.join(toleranced)}" if toleranced else ""
    return (
        f"yield{where}: {100 * share.share:.4g} % of {share.runs} simulations satisfy "
        f"{' and '.join(constraints)}; 95 % confidence: {100 * share.low:.4g} to "
        f"{100 * share.high:.4g} %"
    )


def _best_set(mechanism: Mechanism, optimum: Optimum, values: Mapping[str, float]) -> str:
    """Return the parameters of the optimum as a parameter set for other commands and tools."""
    known = {p.name for p in mechanism.parameters}
    changes = {**values, **{n: x for n, x in optimum.point.items() if n in known}}
    return parameter_set(
        mechanism, interface(mechanism, changes), mechanism.name, changes
    ).decode()  # fmt: skip


def _figure(title: str, found: Study) -> "Figure":
    from ..plots.study import curves, maps, scatter  # imported here: it takes a second

    best = found.optimum
    if not found.whole_grid or len(found.varied) > 2:
        point = None if best is None else (best.point, best.others)
        return scatter(title, found.parameters, found.outputs, found.units, found.satisfied, point)
    if len(found.varied) == 2:
        marked = None if best is None else (best.output, [*best.point.values()], best.value)
        return maps(title, found.varied, found.outputs, found.units, found.satisfied, marked)
    ((name, samples),) = found.varied.items()
    further, shown = {}, None
    if best is not None:
        further = {best.output: (best.points[:, 0], best.values)}
        shown = (best.output, best.point[name], best.value, best.flat[name])
    return curves(
        title, (name, samples), found.outputs, found.units, found.satisfied, further,
        shown,
    )  # fmt: skip
