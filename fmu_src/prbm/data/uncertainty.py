"""Values with standard uncertainties according to the GUM, and straight lines through data.

Source
------
.. [1] JCGM 100:2008, Guide to the expression of uncertainty in measurement (GUM).
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy import stats

from ..base.errors import PrbmError
from ..mechanics.arrays import Real

CORRELATION_FACTOR = 3.0  # Smallest r that counts, over 1/sqrt(n), its scatter without correlation.
CONFIDENCE_LEVEL = 0.95  # Default level of confidence.
POINTS_MIN = 3  # Points of a line with an uncertainty.


class EvaluationError(PrbmError, ValueError):
    """The quantity cannot be evaluated from the data."""


@dataclass(frozen=True)
class Estimate:
    """A value and its standard uncertainty.

    Parameters
    ----------
    value : float
        Best estimate.
    uncertainty : float
        Standard uncertainty, in the same unit; infinite if the value is not determined.
    unit : str
        SI unit; empty if dimensionless.
    freedom : float
        Degrees of freedom of the uncertainty (GUM, G.3).

    Raises
    ------
    EvaluationError
        If the value is not finite, or the uncertainty negative or not a number.

    Examples
    --------
    >>> print(Estimate(181.53e9, 0.36e9, "Pa"))
    (181.53 ± 0.36)e9 Pa
    >>> print(Estimate(4.90714, 0.0123, "Hz"))
    4.907 ± 0.012 Hz
    """

    value: float
    uncertainty: float
    unit: str = ""
    freedom: float = math.inf

    def __post_init__(self) -> None:
        if not math.isfinite(self.value) or math.isnan(self.uncertainty) or self.uncertainty < 0.0:
            raise EvaluationError(
                f"invalid estimate {self.value:g} with the standard uncertainty "
                f"{self.uncertainty:g}: give a finite value and an uncertainty of at least 0"
            )

    @property
    def relative(self) -> float:
        """Relative standard uncertainty, u/|value| [-]."""
        return self.uncertainty / abs(self.value) if self.value else math.inf

    def interval(self, level: float = CONFIDENCE_LEVEL) -> tuple[float, float]:
        """Return the confidence interval value -+ t u, with t of Student's distribution.

        Examples
        --------
        >>> low, high = Estimate(10.0, 1.0).interval(0.95)
        >>> round(low, 2), round(high, 2)
        (8.04, 11.96)
        """
        reach = _student(level, self.freedom) * self.uncertainty
        return self.value - reach, self.value + reach

    def includes_zero(self, level: float = CONFIDENCE_LEVEL) -> bool:
        """Return whether the confidence interval includes zero."""
        low, high = self.interval(level)
        return low <= 0.0 <= high

    def __str__(self) -> str:
        unit = f" {self.unit}" if self.unit else ""
        if not math.isfinite(self.uncertainty):
            return f"{self.value:.6g}{unit} (not determined)"
        size = max(abs(self.value), self.uncertainty)
        thousands = 3 * math.floor(math.log10(size) / 3) if size > 0.0 else 0
        scale = 0 if -3 <= thousands <= 0 and size >= 1e-2 else thousands
        value, u = (x / 10.0**scale for x in (self.value, self.uncertainty))
        digits = max(0, 1 - math.floor(math.log10(u))) if u > 0.0 else 6
        body = f"{value:.{digits}f} ± {u:.{digits}f}"
        return f"({body})e{scale}{unit}" if scale else f"{body}{unit}"


def _student(level: float, freedom: float) -> float:
    """Return the coverage factor t of a two-sided confidence interval."""
    p = 0.5 + level / 2.0
    return float(stats.norm.ppf(p) if math.isinf(freedom) else stats.t.ppf(p, freedom))


def power_law(
    powers: Mapping[str, tuple[Estimate, float]], factor: float = 1.0, unit: str = ""
) -> tuple[Estimate, dict[str, float]]:
    """Return y = factor prod x_i^p_i with its uncertainty, and the uncertainty budget.

        (u(y)/y)^2 = sum (p_i u(x_i)/x_i)^2                              (GUM, eq. 12)

    with the effective degrees of freedom of Welch and Satterthwaite (GUM, eq. G.2b).

    Parameters
    ----------
    powers : mapping
        Independent quantities and their powers, by name.
    factor : float
        Exact factor.
    unit : str
        Unit of the result.

    Returns
    -------
    Estimate
    budget : dict
        Contributions |p_i| u(x_i)/|x_i|, by name [-].

    Examples
    --------
    >>> y, budget = power_law({"l": (Estimate(2.0, 0.02), 3.0), "h": (Estimate(1.0, 0.04), -1.0)})
    >>> y.value, round(y.relative, 12), budget
    (8.0, 0.05, {'l': 0.03, 'h': 0.04})
    """
    value = factor * math.prod(x.value**p for x, p in powers.values())
    budget = {name: abs(p) * x.relative for name, (x, p) in powers.items()}
    total = math.hypot(*budget.values())
    parts = [(budget[name] ** 4, x.freedom) for name, (x, _) in powers.items()]
    shared = sum(part / freedom for part, freedom in parts if part)
    freedom = total**4 / shared if shared > 0.0 else math.inf
    return Estimate(value, total * abs(value), unit, freedom), budget


@dataclass(frozen=True)
class Line:
    """Straight line y = centre_y + slope (x - centre_x) of least squares.

    Parameters
    ----------
    slope : Estimate
        Slope, with the uncertainty from the scatter of the data about the line.
    centre_x, centre_y : float
        Mean of the data.  The errors of the line there and of the slope are independent.
    centre_u : float
        Standard uncertainty of the line at the centre.
    residual : float
        Standard deviation of the data about the line, with n - 2 degrees of freedom.
    largest : float
        Largest distance of the data from the line.
    serial : float
        Correlation of neighbouring residuals [-]: about 0 if they are independent, nearly 1 if
        the data follow a curve.
    n : int
        Number of points.
    """

    slope: Estimate
    centre_x: float
    centre_y: float
    centre_u: float
    residual: float
    largest: float
    serial: float
    n: int

    def at(self, x: float) -> float:
        """Return the value of the line at x."""
        return self.centre_y + self.slope.value * (x - self.centre_x)

    @property
    def intercept(self) -> float:
        """Value of the line at x = 0."""
        return self.at(0.0)


def line(x: Real, y: Real) -> Line:
    """Return the straight line of least squares through ordered points.

    If the correlation r of neighbouring residuals exceeds 3/sqrt(n), the uncertainties are
    multiplied by sqrt((1 + r)/(1 - r)).

    Parameters
    ----------
    x, y : (n,)
        Points, ordered along x or in time, with errors in y.

    Raises
    ------
    EvaluationError
        If there are fewer than three points, or all have one x.

    Examples
    --------
    >>> found = line(np.array([0.0, 1.0, 2.0]), np.array([1.0, 3.0, 5.0]))
    >>> found.slope.value, found.intercept, found.residual
    (2.0, 1.0, 0.0)
    """
    n = len(x)
    if n < POINTS_MIN:
        raise EvaluationError(
            f"a line with an uncertainty needs {POINTS_MIN} points or more, but there are {n}: "
            "record more, or widen the fit range"
        )
    centre_x, centre_y = float(x.mean()), float(y.mean())
    spread = float(((x - centre_x) ** 2).sum())
    if float(np.ptp(x)) == 0.0:  # round-off can make the spread of equal numbers positive
        raise EvaluationError(
            f"all {n} points are at x = {centre_x:.6g}: give points of different x"
        )
    slope = float((x - centre_x) @ (y - centre_y)) / spread
    rest = y - centre_y - slope * (x - centre_x)
    residual = math.sqrt(float(rest @ rest) / (n - 2))
    serial = serial_correlation(rest)
    wider = widening(serial, n)
    u_slope, u_centre = (wider * residual / math.sqrt(w) for w in (spread, n))
    return Line(
        Estimate(slope, u_slope, freedom=n - 2), centre_x, centre_y, u_centre, residual,
        float(np.abs(rest).max()), serial, n,
    )  # fmt: skip


def serial_correlation(residuals: Real) -> float:
    """Return the correlation of neighbouring residuals, between -1 and 1 [-].

    Examples
    --------
    >>> serial_correlation(np.array([1.0, -1.0, 1.0, -1.0]))
    -0.75
    """
    power = float(residuals @ residuals)
    return float(residuals[1:] @ residuals[:-1]) / power if power > 0.0 else 0.0


def widening(serial: float, n: int) -> float:
    """Return the factor of an uncertainty due to correlated residuals, 1 or more [-].

    It is sqrt((1 + r)/(1 - r)), as for an autoregressive process of first order, if the
    correlation r exceeds 3/sqrt(n), and 1 otherwise.

    Examples
    --------
    >>> widening(0.01, 100), round(widening(0.6, 100), 12)
    (1.0, 2.0)
    """
    if serial * math.sqrt(n) <= CORRELATION_FACTOR:
        return 1.0
    return math.sqrt((1.0 + serial) / max(1.0 - serial, 1.0 / n))
