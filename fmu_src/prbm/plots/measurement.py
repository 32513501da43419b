"""Figures of evaluated measurements: a bent beam, a calibrated sensor, a free vibration."""

import numpy as np
from matplotlib.figure import Figure

from ..analysis.spectrum import spectrum
from ..base.unit_text import length_unit, time_unit
from ..data.measurement import Calibration, YoungsModulus
from ..data.series import Series
from ..data.vibration import FreeVibration
from ..drawing.style import IMPACT, LINK, PAST, own_style
from ..mechanics.arrays import Real
from .figures import WIDTH, panels

HEIGHT = 3.6  # Inches.
HARMONICS = 8.0  # Upper end of a spectrum, in multiples of the frequency of the vibration.


@own_style()
def bending_figure(result: YoungsModulus) -> Figure:
    """Plot the averaged force over the deflection with the fitted line."""
    figure, (axes,) = panels(1, 1, (WIDTH, HEIGHT))
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
def calibration_figure(sensor: Calibration, quantity: Real, reading: Real) -> Figure:
    """Plot readings over the quantity with the fitted line, and the residuals below.

    Parameters
    ----------
    sensor : Calibration
        Calibration by these data.
    quantity, reading : (n,)
        The data in their units.
    """
    figure, (upper, lower) = panels(2, 1, (WIDTH, 1.5 * HEIGHT))
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
    residual = sensor(reading) - quantity
    small, name = length_unit(float(np.abs(residual).max()) or 1.0) if sensor.unit == "m" else (
        1.0, sensor.unit,
    )  # fmt: skip
    lower.plot(x, small * residual, ".", color=LINK, markersize=4)
    lower.set_ylabel(f"calibrated - true [{name}]")
    lower.set_xlabel(f"quantity [{unit}]")
    return figure


@own_style()
def vibration_figure(series: Series, found: FreeVibration) -> Figure:
    """Plot a free vibration with the fitted envelope, and its spectrum below."""
    figure, (upper, lower) = panels(2, 1, (WIDTH, 1.5 * HEIGHT))
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
    upper.margins(y=0.2)  # Room for the legend.
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
