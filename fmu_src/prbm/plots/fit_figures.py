"""Figures of evaluated measurements: a bent beam, a sensor, a vibration, a fit, a valley."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..analysis.fit import Fit, ForceDeflection, Response, Valley
from ..analysis.spectrum import spectrum
from ..base.unit_text import length_unit, time_unit
from ..data.measurement import Calibration, YoungsModulus
from ..data.series import Series
from ..data.uncertainty import EvaluationError
from ..data.vibration import FreeVibration
from ..drawing.style import IMPACT, LINK, PAST, own_style
from ..mechanics.arrays import Real
from .figures import WIDTH, panels

HEIGHT = 3.6  # inches
TITLE = 80  # characters that fit above a figure
HARMONICS = 8.0  # times the frequency of a vibration: as far as its spectrum is drawn


def _figure(rows: int, columns: int, height: float = HEIGHT) -> tuple[Figure, list[Axes]]:
    return panels(rows, columns, (WIDTH, height))


def _title(found: Fit) -> str:
    """Return the parameters that were fitted, in lines as long as the figure is wide."""
    lines: list[str] = []
    for word in (f"{name} = {x}" for name, x in found.estimates.items()):
        if lines and len(lines[-1]) + len(word) < TITLE:
            lines[-1] += f", {word}"
        else:
            lines.append(word)
    return "\n".join(lines)


@own_style()
def bending_figure(result: YoungsModulus) -> Figure:
    """Plot the averaged force over the deflection with the line that was fitted."""
    figure, (axes,) = _figure(1, 1)
    x, y = result.points
    factor, unit = length_unit(float(np.abs(x).max()) or 1.0)
    ends = np.array(result.fit_range)
    axes.plot(factor * x, 1e3 * y, ".", color=PAST, markersize=3, label=result.beam.name)
    axes.plot(
        factor * ends, [1e3 * result.fit.at(end) for end in ends], color=IMPACT, linewidth=1.6,
        label=f"{1e-3 * result.stiffness.value:.4g} N/mm",
    )  # fmt: skip
    axes.set_xlabel(f"deflection [{unit}]")
    axes.set_ylabel("force [mN]")
    axes.set_title(f"E = {result.modulus}", fontsize=11, loc="left")
    axes.legend(fontsize=9, frameon=False)
    return figure


@own_style()
def response_figure(found: Fit) -> Figure:
    """Plot a response with the model that was fitted, and what is left, below.

    Raises
    ------
    EvaluationError
        If the fit was not to a response.
    """
    start = 0
    for target in found.problem.targets:
        if isinstance(target, Response):
            break
        start += len(target.data)
    else:
        raise EvaluationError("the fit was not to a response: there is nothing to plot over time")
    model = found.model[start : start + len(target.data)]
    figure, (upper, lower) = _figure(2, 1, 1.5 * HEIGHT)
    series = target.series
    by_time, time_name = time_unit(float(np.ptp(series.time)))
    factor, unit = length_unit(float(np.abs(series.values).max()) or 1.0)
    if series.unit != "m":
        factor, unit = 1.0, series.unit
    t = by_time * series.time
    upper.plot(t, factor * series.values, ".", color=PAST, markersize=3, label="measured")
    upper.plot(t, factor * model, color=IMPACT, linewidth=1.0, label="model")
    upper.set_ylabel(f"{target.output} [{unit}]")
    upper.set_title(_title(found), fontsize=10, loc="left")
    upper.legend(fontsize=9, frameon=False)
    lower.plot(t, factor * (model - series.values), ".", color=LINK, markersize=3)
    lower.set_ylabel(f"model - measured [{unit}]")
    lower.set_xlabel(f"time [{time_name}]")
    return figure


@own_style()
def valley_figure(valley: Valley) -> Figure:
    """Plot the other parameters along a valley, and the misfit that is left there."""
    figure, (left, right) = _figure(1, 2)
    i = valley.names.index(valley.along)
    x = valley.points[:, i]
    for j, name in enumerate(valley.names):
        if j != i:
            scale = 1.0 if len(valley.names) == 2 else valley.best[j] or 1.0
            left.plot(x, valley.points[:, j] / scale, ".-", linewidth=1.2, label=name)
    others = [name for name in valley.names if name != valley.along]
    left.set_ylabel(others[0] if len(others) == 1 else "others over their best")
    if len(others) > 1:
        left.legend(fontsize=9, frameon=False)
    right.plot(x, valley.misfit, ".-", color=IMPACT, linewidth=1.2)
    right.set_ylabel("misfit, sum of squares [-]")
    right.set_ylim(bottom=0.0, top=max(4.0, 1.05 * float(valley.misfit.max())))
    right.axhline(float(valley.misfit.min()) + 1.0, color=PAST, linewidth=0.8, linestyle="--")
    for axes in (left, right):
        axes.set_xlabel(valley.along)
        axes.axvline(valley.best[i], color=PAST, linewidth=0.8)
    return figure


@own_style()
def force_figure(found: Fit) -> Figure:
    """Plot a measured force over the deflection with the model that was fitted.

    Raises
    ------
    EvaluationError
        If the fit was not to such a curve.
    """
    start = 0
    for target in found.problem.targets:
        if isinstance(target, ForceDeflection):
            break
        start += len(target.data)
    else:
        raise EvaluationError("the fit was not to forces over deflections: nothing to plot")
    model = found.model[start : start + len(target.data)]
    figure, (upper, lower) = _figure(2, 1, 1.5 * HEIGHT)
    factor, unit = length_unit(float(np.abs(target.displacement).max()) or 1.0)
    order = np.argsort(target.displacement)
    x = factor * target.displacement[order]
    upper.plot(x, 1e3 * target.force[order], ".", color=PAST, markersize=4, label="measured")
    upper.plot(x, 1e3 * model[order], color=IMPACT, linewidth=1.2, label="model")
    upper.set_ylabel("holding force [mN]")
    upper.set_title(_title(found), fontsize=10, loc="left")
    upper.legend(fontsize=9, frameon=False)
    lower.plot(x, 1e3 * (model - target.force)[order], ".", color=LINK, markersize=4)
    lower.set_ylabel("model - measured [mN]")
    lower.set_xlabel(f"displacement [{unit}]")
    return figure


@own_style()
def calibration_figure(sensor: Calibration, quantity: Real, reading: Real) -> Figure:
    """Plot readings over the quantity with the line, and what is left, below.

    Parameters
    ----------
    sensor : Calibration
        Of these data.
    quantity, reading : (n,)
        What was calibrated, in their units.
    """
    figure, (upper, lower) = _figure(2, 1, 1.5 * HEIGHT)
    factor, unit = 1.0, sensor.unit
    if unit == "m":
        factor, unit = length_unit(float(np.abs(quantity).max()) or 1.0)
    x = factor * quantity
    ends = np.array([quantity.min(), quantity.max()])
    upper.plot(x, reading, ".", color=PAST, markersize=4, label="reading")
    upper.plot(
        factor * ends, [sensor.fit.at(end) for end in ends], color=IMPACT, linewidth=1.2,
        label=f"{sensor.sensitivity}",
    )  # fmt: skip
    upper.set_ylabel(f"reading [{sensor.reading_unit}]")
    upper.legend(fontsize=9, frameon=False)
    rest = sensor(reading) - quantity
    small, name = length_unit(float(np.abs(rest).max()) or 1.0) if sensor.unit == "m" else (
        1.0, sensor.unit,
    )  # fmt: skip
    lower.plot(x, small * rest, ".", color=LINK, markersize=4)
    lower.set_ylabel(f"calibrated - true [{name}]")
    lower.set_xlabel(f"quantity [{unit}]")
    return figure


@own_style()
def vibration_figure(series: Series, found: FreeVibration) -> Figure:
    """Plot a free vibration with the envelope that was fitted, and its spectrum, below."""
    figure, (upper, lower) = _figure(2, 1, 1.5 * HEIGHT)
    by_time, time_name = time_unit(float(np.ptp(series.time)))
    factor, unit = 1.0, series.unit
    if unit == "m":
        factor, unit = length_unit(float(np.abs(series.values - found.rest).max()) or 1.0)
    since = series.time - series.time[0]
    decay = 2.0 * np.pi * found.frequency.value * found.zeta.value
    envelope = found.amplitude * np.exp(-decay * since)
    upper.plot(by_time * series.time, factor * series.values, color=PAST, linewidth=0.8)
    for side in (-1.0, 1.0):
        upper.plot(
            by_time * series.time, factor * (found.rest + side * envelope), color=IMPACT,
            linewidth=1.2, label="envelope of the fit" if side > 0 else None,
        )  # fmt: skip
    upper.set_ylabel(f"{series.name} [{unit}]")
    upper.set_xlabel(f"time [{time_name}]")
    upper.set_title(f"{found.frequency}, damping ratio {found.damping}", fontsize=10, loc="left")
    upper.margins(y=0.2)  # room for the legend
    upper.legend(loc="upper right", fontsize=9, frameon=False)
    grid: Real = np.linspace(0.0, since[-1], len(since))
    even: Real = np.interp(grid, since, series.values)
    frequency, amplitude = spectrum(grid, even)
    shown = (frequency > 0.0) & (frequency <= HARMONICS * found.frequency.value)
    lower.semilogy(frequency[shown], factor * amplitude[shown], color=PAST, linewidth=1.0)
    lower.axvline(found.frequency.value, color=IMPACT, linewidth=1.0, linestyle="--")
    lower.set_ylabel(f"amplitude [{unit}]")
    lower.set_xlabel("frequency [Hz]")
    return figure
