"""``prbm fit``: parameters of a mechanism fitted to measured data."""

import argparse

from ..analysis.fit import DISPLACEMENT, Fit, ForceDeflection, Response, Target, fit, valley
from ..base.progress import reporter
from ..files.mechanism_file import load
from ..files.settings import UserMistake, quantity, settings
from ..mechanism.description import Mechanism
from ..plots import fit as figures
from .data import check_size, only, output_unit, record, series
from .output import Output
from .words import free, frequency


def run_fit(options: argparse.Namespace) -> None:
    """Print the fitted parameters and their uncertainties; write tables and figures."""
    mechanism = load(options.mechanism)
    values = settings(mechanism, options.set)
    parameters = [free(mechanism, text) for text in options.free]
    output = Output(options.out)
    found = fit(
        mechanism, parameters, _targets(options, mechanism), values, searches=options.searches,
        progress=reporter(),
    )  # fmt: skip
    report(found, output, mechanism.name)
    output.write()


def _targets(options: argparse.Namespace, mechanism: Mechanism) -> list[Target]:
    targets: list[Target] = [frequency(text) for text in options.frequency]
    if options.response is not None:
        targets.append(response(options, options.response, mechanism))
    if options.force_deflection is not None:
        targets.append(_force_deflection(options, mechanism))
    if not targets:
        raise UserMistake(
            "no measured data: give --frequency, --response FILE or --force-deflection FILE"
        )
    return targets


def response(options: argparse.Namespace, path: str, mechanism: Mechanism) -> Response:
    """Return a recorded response as a target of a fit."""
    name = options.output or DISPLACEMENT
    signal = series(path, options, output_unit(name))
    if signal.unit == "m":
        check_size(signal.values, mechanism, f"{signal.source}: {signal.name}")
    return Response(
        signal, name, uncertainty(options.uncertainty, signal.unit), engine=options.engine
    )


def uncertainty(text: str | None, unit: str) -> float | None:
    """Read a positive standard uncertainty; None if it is not given."""
    if text is None:
        return None
    found = quantity(text, unit, "--uncertainty")
    if found <= 0.0:
        raise UserMistake(
            f"--uncertainty {text}: must be positive; omit it to estimate it from the residuals"
        )
    return found


def _force_deflection(options: argparse.Namespace, mechanism: Mechanism) -> ForceDeflection:
    found = record(options.force_deflection, options)
    name = options.deflection or only(found, "m", "deflection", "--deflection")
    force = options.force or only(found, "N", "force", "--force")
    d, F = found.column(name, "m"), found.column(force, "N")
    check_size(d, mechanism, f"{found.source}: {name}")
    return ForceDeflection(d, F, uncertainty(options.force_uncertainty, "N"))


def report(found: Fit, output: Output, name: str) -> None:
    """Print a fit; add its table, its figures and, if there is one, its valley to the output."""
    print(found)
    print(
        "to use these values: "
        + " ".join(f"--set {k}={x:.6g}" for k, x in _fitted_values(found).items())
    )
    estimates, problem = found.estimates, found.problem
    output.table(
        f"{name}-fit.csv",
        ["parameter", "value", "standard uncertainty", "unit", "lower bound", "upper bound"],
        [
            [key, x.value, x.uncertainty, x.unit, float(low), float(high)]
            for (key, x), low, high in zip(
                estimates.items(), problem.lower, problem.upper, strict=True
            )
        ],
    )
    start = 0
    for target in problem.targets:
        part = slice(start, start := start + len(target.data))
        if isinstance(target, Response):
            output.table(
                f"{name}-response.csv",
                ["time [s]", f"measured [{target.unit}]", f"model [{target.unit}]"],
                zip(target.series.time, target.data, found.model[part], strict=True),
            )
            output.figure(f"{name}-response.png", lambda: figures.response_figure(found))
        if isinstance(target, ForceDeflection):
            output.table(
                f"{name}-force.csv",
                ["deflection [m]", "measured [N]", "model [N]"],
                zip(target.displacement, target.data, found.model[part], strict=True),
            )
            output.figure(f"{name}-force.png", lambda: figures.force_figure(found))
    if found.valleys and len(problem.names) > 1:
        _report_valley(found, output, name)


def _fitted_values(found: Fit) -> dict[str, float]:
    """Return the fitted parameters of the mechanism, without those of a record."""
    return {name: found.values[name] for name in found.problem.names if name in found.values}


def _report_valley(found: Fit, output: Output, name: str) -> None:
    """Print a valley, the combinations of parameters that fit about equally well."""
    along = valley(found, progress=reporter())
    print(f"other parameters with nearly the same misfit (valley along {along.along}):")
    print(along)
    output.table(
        f"{name}-valley.csv",
        [*along.names, "misfit"],
        [[*map(float, p), float(x)] for p, x in zip(along.points, along.misfit, strict=True)],
    )
    output.figure(f"{name}-valley.png", lambda: figures.valley_figure(along))
