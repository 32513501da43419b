r"""Calibration of sensors, and Young's modulus from bending a cantilever.

A force F at the free end of a cantilever of length l deflects it by d = F l^3/(3 E I).  The slope s
of the force over the deflection gives

    E = s l^3/(3 I) = 4 s l^3/(b h^3),      I = b h^3/12                                 [1, eq. 9]

for small deflections.  For large deflections and a force of constant direction

    F = 3 E I d/l^3 (1 + k (d/l)^2 + ...),      k = :data:`STIFFENING`,

so that a line fitted up to d = l/10 is about 1 % too steep.

Sources
-------
.. [1] S. Boersma, Modelling and Validation of the Impact Response in Compliant Mechanisms, MSc
   thesis, TU Delft, 2015; chapter 7 for the sorting, averaging and the angle of the sensor.
.. [2] JCGM 100:2008 (GUM).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..mechanics.arrays import Real
from .series import Series
from .uncertainty import CORRELATION_FACTOR, Estimate, EvaluationError, Line, line, power_law

STIFFENING = 36 / 35  # Coefficient of (d/l)^2 for a force of constant direction (elastica).
STIFFENING_MAX = 0.01  # Relative error of the theory of small deflections without a note.
CYCLE_LOSS_MAX = 0.03  # Share of the work of a cycle that may be lost without a note.
DEFLECTION_MAX = 1.0  # Largest deflection over the length of a beam; more is a mistake of units.
BEAM_LENGTH_MAX = 1.0  # m: the dimensions of a longer beam are likely in mm.
MODULUS_RANGE = (1e5, 2e12)  # Pa, from gels to diamond and carbon nanotubes.
TURN_RTOL = 0.2  # Return of the deflection over its range; a smaller one is noise.
DIMENSIONS = ("length", "width", "thickness")  # Dimensions of a beam.
DEFLECTION_RTOL = 1e-12  # Change of the deflection, relative to it; a smaller one is round-off.
SENSOR_ANGLE_MAX = 85.0  # deg, between the axis of the sensor and the force.


@dataclass(frozen=True)
class Calibration:
    """Calibration of a linear sensor, reading = offset + sensitivity * quantity.

    Parameters
    ----------
    fit : Line
        Line of the reading over the quantity.
    reading_unit, unit : str
        Units of the reading and of the quantity.
    """

    fit: Line
    reading_unit: str
    unit: str

    @property
    def sensitivity(self) -> Estimate:
        """Slope of the reading over the quantity."""
        slope, per = self.fit.slope, f"{self.reading_unit}/{self.unit}"
        return Estimate(slope.value, slope.uncertainty, per, slope.freedom)

    @property
    def gain(self) -> Estimate:
        """Slope of the quantity over the reading, 1/sensitivity."""
        return power_law(
            {"sensitivity": (self.sensitivity, -1.0)}, unit=f"{self.unit}/{self.reading_unit}"
        )[0]

    @property
    def residual(self) -> float:
        """Standard deviation of a single reading, in the unit of the quantity."""
        return self.fit.residual / abs(self.fit.slope.value)

    @property
    def nonlinearity(self) -> float:
        """Largest residual of a reading, in the unit of the quantity."""
        return self.fit.largest / abs(self.fit.slope.value)

    def __call__(self, reading: Real) -> Real:
        """Return the quantities of readings."""
        fit = self.fit
        result: Real = fit.centre_x + (reading - fit.centre_y) / fit.slope.value
        return result

    def applied(self, series: Series) -> Series:
        """Return the quantity of a recorded reading.

        Raises
        ------
        EvaluationError
            If the record is not in the unit of the reading.
        """
        if series.unit != self.reading_unit:
            raise EvaluationError(
                f"{series.source}: {series.name} is in {series.unit}, but the calibration is for "
                f"readings in {self.reading_unit}: choose another column"
            )
        return replace(series, values=self(series.values), unit=self.unit)

    def uncertainty(self, reading: Real) -> Real:
        """Return the standard uncertainty of the calibration at readings, in the quantity's unit.

        The noise of a single reading, :attr:`residual`, is not included.
        """
        fit = self.fit
        along = (reading - fit.centre_y) / fit.slope.value * fit.slope.relative
        result: Real = np.hypot(fit.centre_u / fit.slope.value, along)
        return result

    def __str__(self) -> str:
        bent = "" if self.fit.serial * math.sqrt(self.fit.n) <= CORRELATION_FACTOR else (
            "; neighbouring residuals are correlated: the sensor is not linear, or drifts"
        )  # fmt: skip
        return (
            f"gain {self.gain}; noise {self.residual:.3g} {self.unit}, largest residual "
            f"{self.nonlinearity:.3g} {self.unit}, {self.fit.n} points{bent}"
        )


def calibrate(
    quantity: Real, reading: Real, unit: str = "m", reading_unit: str = "V"
) -> Calibration:
    """Return the calibration of a sensor against a much more accurate reference.

    Parameters
    ----------
    quantity : (n,)
        Values of the reference, ordered by time or size.
    reading : (n,)
        Readings of the sensor, with noise.
    unit, reading_unit : str
        Units of the quantity and of the reading.

    Raises
    ------
    EvaluationError
        If there are fewer than three points, or the reading does not change with the quantity
        beyond its noise.

    Examples
    --------
    >>> stage = np.array([0.0, 1e-3, 2e-3])
    >>> sensor = calibrate(stage, 0.5 + 200.0 * stage)
    >>> sensor(np.array([0.9])).round(12)
    array([0.002])
    """
    _check_pairs(quantity, reading, "quantity", "reading")
    fit = line(quantity, reading)
    if fit.slope.includes_zero():
        raise EvaluationError(
            f"the reading does not change with the quantity: the sensitivity is "
            f"{fit.slope.value:.3g} ± {fit.slope.uncertainty:.3g} {reading_unit}/{unit}; check the "
            "wiring, or increase the range"
        )
    return Calibration(fit, reading_unit, unit)


def _check_pairs(x: Real, y: Real, x_name: str, y_name: str) -> None:
    """Reject arrays of different shapes, and numbers that are not finite."""
    if x.shape != y.shape or x.ndim != 1:
        raise EvaluationError(f"{len(x)} values of {x_name} for {len(y)} of {y_name}: give pairs")
    for name, values in ((x_name, x), (y_name, y)):
        if not np.isfinite(values).all():
            row = int(np.flatnonzero(~np.isfinite(values))[0])
            raise EvaluationError(f"{name}[{row}] = {values[row]} must be finite: remove the row")


# --- Young's modulus ----------------------------------------------------------------------------


@dataclass(frozen=True)
class Beam:
    """A cantilever: length l up to the force, width b, thickness h in the plane of bending [m]."""

    name: str
    length: Estimate
    width: Estimate
    thickness: Estimate

    def __post_init__(self) -> None:
        for dimension in DIMENSIONS:
            x = getattr(self, dimension).value
            if x <= 0.0:
                raise EvaluationError(f"beam {self.name}: {dimension} = {x:g} m must be positive")
        if self.thickness.value >= self.length.value:
            raise EvaluationError(
                f"beam {self.name}: thickness = {self.thickness.value:g} m is not less than "
                f"length = {self.length.value:g} m: check the units of both"
            )


@dataclass(frozen=True)
class Loop:
    """Cycle of loading and unloading.

    Parameters
    ----------
    work : float
        Work of loading [J].
    loss : float
        Work of loading that unloading does not return [J].
    """

    work: float
    loss: float

    @property
    def fraction(self) -> float:
        """Ratio of the loss to the work of loading [-]."""
        return self.loss / self.work


@dataclass(frozen=True)
class YoungsModulus:
    """Young's modulus of a beam, with the fit.

    Parameters
    ----------
    beam : Beam
        Beam.
    modulus : Estimate
        Young's modulus E [Pa].
    stiffness : Estimate
        Slope of the force over the deflection [N/m].
    fit : Line
        Line through the averaged data within the fit range.
    fit_range : pair of float
        Smallest and largest deflection of the fit [m].
    deflection : float
        Largest deflection within the fit range, measured from zero force [m].
    stiffening : float
        Relative overestimate of E by the theory of small deflections, to leading order [-].
    loops : tuple of Loop
        Complete cycles in the record.
    budget : dict
        Contributions to the relative standard uncertainty, by name [-].
    points : pair of (n,)
        Sorted and averaged deflection [m] and force [N], for a figure.
    """

    beam: Beam
    modulus: Estimate
    stiffness: Estimate
    fit: Line
    fit_range: tuple[float, float]
    deflection: float
    stiffening: float
    loops: tuple[Loop, ...]
    budget: dict[str, float]
    points: tuple[Real, Real]

    @property
    def notes(self) -> tuple[str, ...]:
        """Remarks on the reliability of the modulus."""
        notes = []
        length, E = self.beam.length.value, self.modulus.value
        if length > BEAM_LENGTH_MAX:
            notes.append(
                f"the beam is {length:g} m long: if its dimensions are in mm, this E is a "
                f"thousandth of the true value; give {length:g} mm, and the others in mm"
            )
        elif not MODULUS_RANGE[0] < E < MODULUS_RANGE[1]:
            notes.append(
                f"no solid has E = {E:.2g} Pa: check the units of the beam, the deflection and "
                "the force"
            )
        if self.stiffening > STIFFENING_MAX:
            notes.append(
                f"the deflection reaches {self.deflection / self.beam.length.value:.2f} of the "
                f"length, where small-deflection theory is off by {100 * self.stiffening:.1f} %: "
                "reduce the deflection"
            )
        if self.fit.serial * math.sqrt(self.fit.n) > CORRELATION_FACTOR:
            notes.append(
                "the data deviate from a line (neighbouring residuals are correlated), which "
                "increases the uncertainty; narrow the fit range"
            )
        loss = self.loss
        if loss is not None and loss > CYCLE_LOSS_MAX:
            notes.append(
                f"{100 * loss:.0f} % of the work is lost in a cycle: E is fitted to loading and "
                "unloading together, and its uncertainty does not include their difference; "
                "evaluate each branch alone"
            )
        exact = [name for name in DIMENSIONS if getattr(self.beam, name).uncertainty == 0.0]
        if exact:
            more = [name for name, share in self.budget.items() if share > 0.0 and name != "fit"]
            notes.append(
                f"{_listed(exact)} {'have' if exact[1:] else 'has'} no uncertainty, so that the ± "
                f"includes {_listed(['the scatter of the fit', *more])} only; give an uncertainty, "
                "as in 40 mm +- 0.05 mm"
            )
        return tuple(notes)

    @property
    def loss(self) -> float | None:
        """Mean ratio of loss to work of the cycles [-]; None without a cycle."""
        return float(np.mean([loop.fraction for loop in self.loops])) if self.loops else None

    def __str__(self) -> str:
        beam = self.beam
        rows = [
            f"beam {beam.name}: E = {self.modulus}",
            f"  stiffness {self.stiffness}, {self.fit.n} points from {1e3 * self.fit_range[0]:.4g} "
            f"to {1e3 * self.fit_range[1]:.4g} mm, residual {1e3 * self.fit.residual:.3g} mN",
            "  uncertainty: " + ", ".join(f"{k} {100 * x:.2g} %" for k, x in self.budget.items()),
        ]
        if self.loops:
            rows.append(
                "  loss per cycle: " + ", ".join(f"{100 * x.fraction:.1f} %" for x in self.loops)
            )
        return "\n".join([*rows, *(f"  note: {note}" for note in self.notes)])


def _listed(words: Sequence[str]) -> str:
    """Return words joined by commas and "and".

    Examples
    --------
    >>> _listed(["length"]), _listed(["length", "width", "thickness"])
    ('length', 'length, width and thickness')
    """
    return " and ".join([", ".join(words[:-1]), words[-1]] if words[1:] else words)


def youngs_modulus(
    deflection: Real,
    force: Real,
    beam: Beam,
    *,
    fit_range: tuple[float, float] = (0.25, 0.9),
    window: int = 1,
    sensor_angle: Estimate | float = 0.0,
    force_gain: Estimate | None = None,
) -> YoungsModulus:
    """Return Young's modulus from a record of bending a cantilever.

    The pairs are sorted by deflection and averaged over windows.  The windows do not overlap, so
    that the errors are independent.  The sign of the force is arbitrary.

    Parameters
    ----------
    deflection, force : (n,)
        Deflection [m] and force [N] in the order of time, with arbitrary zeros.
    beam : Beam
        Dimensions with their standard uncertainties.
    fit_range : pair of float
        Limits of the fit, as fractions of the range of the deflection.
    window : int
        Number of samples in a window.
    sensor_angle : Estimate or float
        Angle between the axis of the force sensor and the force [deg].  The force is the reading
        divided by the cosine of this angle.
    force_gain : Estimate or None
        Factor on the force, with the uncertainty of the sensor's calibration (default: exactly 1).

    Raises
    ------
    EvaluationError
        If the data are not pairs of finite numbers, are too few, exceed the length of the beam, or
        have no significant stiffness.
    """
    _check_pairs(deflection, force, "deflection", "force")
    _check_options(beam, deflection, fit_range, window)
    angle = sensor_angle if isinstance(sensor_angle, Estimate) else Estimate(sensor_angle, 0.0)
    if not abs(angle.value) <= SENSOR_ANGLE_MAX:
        raise EvaluationError(
            f"sensor_angle = {angle.value:g} deg: a sensor does not measure a transverse force; "
            f"give an angle of at most {SENSOR_ANGLE_MAX:g} deg"
        )
    if force_gain is not None and force_gain.value <= 0.0:
        raise EvaluationError(
            f"force_gain = {force_gain.value:g} must be positive: the sign of the force is detected"
        )
    turned = math.radians(angle.value)
    force = force / math.cos(turned)
    x, y = averaged(deflection, force, window)
    low, high = (float(x[0] + share * (x[-1] - x[0])) for share in fit_range)
    used = (x >= low) & (x <= high)
    fit = line(x[used], y[used])
    if fit.slope.includes_zero():
        raise EvaluationError(
            f"beam {beam.name}: no stiffness, the force changes by {fit.slope.value:.3g} ± "
            f"{fit.slope.uncertainty:.3g} N/m: check that the beam was touched, or bend it further"
        )
    stiffness = Estimate(abs(fit.slope.value), fit.slope.uncertainty, "N/m", fit.slope.freedom)
    tilt = Estimate(1.0, abs(math.tan(turned)) * math.radians(angle.uncertainty))
    modulus, budget = power_law(
        {
            "fit": (stiffness, 1.0),
            "length": (beam.length, 3.0),
            "width": (beam.width, -1.0),
            "thickness": (beam.thickness, -3.0),
            "sensor angle": (tilt, 1.0),
            "force gain": (force_gain or Estimate(1.0, 0.0), 1.0),
        },
        4.0, "Pa",
    )  # fmt: skip
    touched = fit.centre_x - fit.centre_y / fit.slope.value if _touched(x, fit) else float(x[0])
    bent = (x[used] - touched) / beam.length.value
    return YoungsModulus(
        beam, modulus, stiffness, fit, (low, high), high - touched,
        STIFFENING * line(bent, bent**3).slope.value,
        hysteresis(deflection, force), budget, (x, y),
    )  # fmt: skip


def _touched(x: Real, fit: Line) -> bool:
    """Return whether the fitted force is zero at a deflection within the record."""
    zero = fit.centre_x - fit.centre_y / fit.slope.value
    return float(x[0]) <= zero <= float(x[-1])


def _check_options(
    beam: Beam, deflection: Real, fit_range: tuple[float, float], window: int
) -> None:
    """Reject an invalid fit range, window or deflection."""
    low, high = fit_range
    if not 0.0 <= low < high <= 1.0:
        raise EvaluationError(
            f"fit_range = {fit_range}: give two fractions of the deflection, 0 <= low < high <= 1"
        )
    if window < 1 or 3 * window > len(deflection):
        raise EvaluationError(
            f"window = {window} samples: give a number from 1 to {len(deflection) // 3}"
        )
    reach = float(np.ptp(deflection))
    if reach <= DEFLECTION_RTOL * float(np.abs(deflection).max()):
        raise EvaluationError(
            f"beam {beam.name}: the deflection does not change, it is {deflection[0]:.4g} m "
            "throughout: choose the column of the deflection, or bend the beam"
        )
    if reach > DEFLECTION_MAX * beam.length.value:
        raise EvaluationError(
            f"beam {beam.name}: a deflection of {reach:.4g} m is longer than the beam, "
            f"{beam.length.value:.4g} m: check the units of both"
        )


def averaged(x: Real, y: Real, window: int) -> tuple[Real, Real]:
    """Return pairs sorted by x and averaged over windows; an incomplete window is dropped.

    Examples
    --------
    >>> averaged(np.array([3.0, 1.0, 2.0, 4.0]), np.array([30.0, 10.0, 20.0, 40.0]), 2)
    (array([1.5, 3.5]), array([15., 35.]))
    """
    order = np.argsort(x, kind="stable")
    kept = order[: len(x) // window * window].reshape(-1, window)
    return x[kept].mean(axis=1), y[kept].mean(axis=1)


def turning_points(x: Real, least: float) -> list[int]:
    """Return the indices of turning points, between which x changes by more than ``least``.

    The first index is the extreme before the first such change.  The last one is the end of the
    record.

    Examples
    --------
    >>> turning_points(np.array([0.0, 0.1, 0.05, 1.0, 2.0, 1.9, 0.0]), 0.5)
    [0, 4, 6]
    """
    low = high = 0
    turns: list[int] = []
    rising = None
    for i, value in enumerate(x):
        low = i if value < x[low] else low
        high = i if value > x[high] else high
        if rising is not False and x[high] - value > least:
            turns.append(high)
            rising, low = False, i
        elif rising is not True and value - x[low] > least:
            turns.append(low)
            rising, high = True, i
    turns.append(len(x) - 1)
    return sorted(set(turns))


def hysteresis(deflection: Real, force: Real) -> tuple[Loop, ...]:
    """Return the complete cycles of loading and unloading in a record.

    The loss is the area between the branches over their common deflections.  The work is the area
    under the loading branch above the force at its start.

    Parameters
    ----------
    deflection, force : (n,)
        Deflection [m] and force [N] in the order of time.

    Examples
    --------
    At half the deflection the force is 0.5 in loading and 0.4 in unloading: a loss of a tenth.

    >>> d, F = np.array([0.0, 1.0, 0.5, 0.0]), np.array([0.0, 1.0, 0.4, 0.0])
    >>> [round(loop.fraction, 2) for loop in hysteresis(d, F)]
    [0.1]
    """
    if np.mean((deflection - deflection.mean()) * (force - force.mean())) < 0.0:
        force = -force
    turns = turning_points(deflection, TURN_RTOL * float(np.ptp(deflection)))
    loops = []
    for start, top, end in zip(turns, turns[1:], turns[2:], strict=False):
        if deflection[top] <= deflection[start]:
            continue
        loop = _loop(deflection, force, start, top, end)
        if loop is not None:
            loops.append(loop)
    return tuple(loops)


def _loop(deflection: Real, force: Real, start: int, top: int, end: int) -> Loop | None:
    """Return a cycle; None if its branches have few deflections in common."""
    low = max(deflection[start], deflection[end])
    high = deflection[top]
    if high - low < 0.5 * (high - deflection[start]):
        return None
    grid = np.linspace(low, high, 200)
    zero = force[start]
    branches = []
    for part in (slice(start, top + 1), slice(top, end + 1)):
        order = np.argsort(deflection[part], kind="stable")
        d, F = deflection[part][order], force[part][order] - zero
        places, first = np.unique(d, return_inverse=True)
        mean = np.bincount(first, F) / np.bincount(first)
        branches.append(float(np.trapezoid(np.interp(grid, places, mean), grid)))
    work, back = branches
    return Loop(work, work - back) if work > 0.0 else None


@dataclass(frozen=True)
class BeamTable:
    """Young's moduli of several beams.

    Parameters
    ----------
    beams : tuple of YoungsModulus
        Moduli of the beams, or of repeated measurements.
    mean : Estimate
        Mean, with the uncertainty scatter/sqrt(n) [Pa].
    scatter : float
        Standard deviation of the moduli [Pa].
    """

    beams: tuple[YoungsModulus, ...]
    mean: Estimate
    scatter: float

    @property
    def excess(self) -> float:
        """Scatter / mean stated uncertainty [-]; about 1 if this uncertainty explains it."""
        stated = np.mean([beam.modulus.uncertainty for beam in self.beams])
        return self.scatter / float(stated) if stated > 0.0 else math.inf

    def __str__(self) -> str:
        rows = [f"{'beam':<16}{'E [GPa]':>10}{'u [GPa]':>10}{'rms [mN]':>10}{'loss [%]':>10}"]
        for one in self.beams:
            loss = "-" if one.loss is None else f"{100 * one.loss:.1f}"
            rows.append(
                f"{one.beam.name:<16}{1e-9 * one.modulus.value:>10.4g}"
                f"{1e-9 * one.modulus.uncertainty:>10.2g}{1e3 * one.fit.residual:>10.3g}{loss:>10}"
            )
        rows.append(
            f"{'mean':<16}{1e-9 * self.mean.value:>10.4g}{1e-9 * self.mean.uncertainty:>10.2g}  "
            f"scatter {1e-9 * self.scatter:.2g} GPa, {self.excess:.1f} times the stated uncertainty"
        )
        return "\n".join(rows)


def beam_table(beams: Sequence[YoungsModulus]) -> BeamTable:
    """Return the moduli of several beams with their mean.

    Raises
    ------
    EvaluationError
        If there are fewer than two beams.
    """
    if len(beams) < 2:
        raise EvaluationError(
            f"a mean with a scatter needs two beams or more, but there are {len(beams)}"
        )
    values = np.array([beam.modulus.value for beam in beams])
    scatter = float(values.std(ddof=1))
    n = len(values)
    mean = Estimate(float(values.mean()), scatter / math.sqrt(n), "Pa", n - 1)
    return BeamTable(tuple(beams), mean, scatter)
