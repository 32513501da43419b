"""A mechanism beside finite elements and measurements.

:func:`compare` evaluates the same quantities by the pseudo-rigid-body model and by finite elements
of the same file, and compares them with measured values and their uncertainties:

* the equilibrium of the released body under gravity, and the lowest frequencies about that shape;
* the holding force in the straight shape, the stiffness and the frequencies there;
* the modal restitution of an arriving fundamental mode, for every wall that a force on the released
  body reaches.

Loads and holding forces are equal on both sides.  Friction and damping in proportion to mass are
set to zero: the elements do not have them, and no compared quantity depends on them.
"""

import csv
import io
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from ..base.atomic import write
from ..base.errors import EquilibriumError, ParameterError
from ..base.progress import Progress
from ..base.unit_text import frequency_unit
from ..data.uncertainty import Estimate
from ..mechanics.assembly import assemble
from ..mechanics.modal import Modes, modes
from ..mechanics.statics import equilibrium
from ..mechanics.system import System
from ..mechanism.description import Mechanism
from ..mechanism.parts import value
from ..references.finite_elements import FiniteElements
from .adequacy import Impact
from .adequacy import notes as adequacy_notes
from .impact_map import algebraic, by_elements

PERCENT_DECIMALS = 1e3  # Larger differences are printed without decimals [%].
FREQUENCIES = 3  # Number of the lowest frequencies that are compared.
DIFFERENCE_STEP = 1e-4  # Step of the stiffness, as a share of the size of the mechanism.
ZERO_RTOL = 1e-9  # Smaller displacements, relative to the size, and their forces are round-off.
Quantities = dict[str, float]


@dataclass(frozen=True)
class Row:
    """One quantity by every method; NaN or None if a method does not give it.

    Parameters
    ----------
    name, unit : str
        Name of the quantity; its SI unit.
    model, elements : float
        Value by the pseudo-rigid-body model, and by finite elements.
    measured : Estimate or None
        Measured value with its standard uncertainty.
    """

    name: str
    unit: str
    model: float
    elements: float
    measured: Estimate | None = None

    @property
    def error(self) -> float:
        """Model less elements, in the unit of the quantity."""
        return self.model - self.elements

    @property
    def relative(self) -> float:
        """Model less elements, divided by the elements' value [-]; NaN if that is 0."""
        return self.error / abs(self.elements) if self.elements else math.nan

    @property
    def scale(self) -> float:
        """Scale of differences: the magnitude of the elements' value; 1 for a ratio."""
        return abs(self.elements) if self.unit else 1.0

    def away(self, found: float) -> float:
        """Return the difference from the measured value, divided by its standard uncertainty."""
        if self.measured is None or not 0.0 < self.measured.uncertainty < math.inf:
            return math.nan
        return (found - self.measured.value) / self.measured.uncertainty


@dataclass(frozen=True)
class Comparison:
    """Quantities of a mechanism side by side.

    Parameters
    ----------
    title : str
        Title of the mechanism.
    elements : int
        Number of cable elements per flexure.
    rows : tuple of Row
        Quantities that both the model and the elements have.
    notes : tuple of str
        Quantities that could not be compared, with reasons; effects that the model neglects.
    """

    title: str
    elements: int
    rows: tuple[Row, ...]
    notes: tuple[str, ...] = ()

    def __getitem__(self, name: str) -> Row:
        """Return a row by name."""
        for row in self.rows:
            if row.name == name:
                return row
        known = ", ".join(row.name for row in self.rows)
        raise ParameterError(f"{name!r} was not compared; the compared quantities are {known}")

    def __str__(self) -> str:
        head = f"{'':<34}{'model':>12}{'elements':>12}{'difference':>12}"
        measured = any(row.measured for row in self.rows)
        if measured:
            head += f"  {'measured':<22}{'model':>8}{'elements':>10}"
        lines = [f"{self.title}, {self.elements} elements per flexure", head]
        lines += [_line(row, measured) for row in self.rows]
        if measured:
            lines.append(
                "last two columns: difference from the measured value / its standard uncertainty"
            )
        return "\n".join([*lines, *self.notes])

    def csv(self) -> str:
        """Return the rows as CSV, in SI units; unknown values are empty."""
        out = io.StringIO()
        writer = csv.writer(out, lineterminator="\n")
        writer.writerow(
            ["quantity", "unit", "model", "finite elements", "difference", "measured",
             "standard uncertainty", "model off [u]", "finite elements off [u]"]
        )  # fmt: skip
        for row in self.rows:
            numbers = [row.model, row.elements, row.error]
            if row.measured is not None:
                numbers += [row.measured.value, row.measured.uncertainty]
                numbers += [row.away(row.model), row.away(row.elements)]
            written = ["" if math.isnan(x) else repr(float(x)) for x in numbers]
            writer.writerow([row.name, row.unit, *written, *[""] * (7 - len(written))])
        return out.getvalue()

    def write(self, path: str | Path) -> Path:
        """Write the rows to a CSV file, completely or not at all; return its path.

        Raises
        ------
        OSError
            If the file cannot be written.
        """
        path = Path(path)
        write(path, self.csv().encode())
        return path


def _shown(x: float, form: str = ".5g") -> str:
    return "-" if math.isnan(x) else format(x, form)


def _line(row: Row, measured: bool) -> str:
    """Return a row as a line of the table; high frequencies without a measurement are in kHz."""
    factor, unit = 1.0, row.unit
    if unit == "Hz" and row.measured is None and math.isfinite(row.elements):
        factor, unit = frequency_unit(row.elements)
    name = f"{row.name} [{unit}]" if unit else row.name
    line = f"{name:<34}{_shown(factor * row.model):>12}{_shown(factor * row.elements):>12}"
    line += f"{_difference(row):>12}"
    if measured and row.measured is not None:
        line += f"  {row.measured!s:<22}{_shown(row.away(row.model), '+.1f'):>8}"
        line += f"{_shown(row.away(row.elements), '+.1f'):>10}"
    return line


def _difference(row: Row) -> str:
    """Return the difference: in percent, absolute for ratios and if the elements give 0."""
    if math.isnan(row.error):
        return "-"
    if row.unit and not math.isnan(row.relative):
        percent = 100.0 * row.relative
        return f"{percent:+.2f} %" if abs(percent) < PERCENT_DECIMALS else f"{percent:+.4g} %"
    unit = f" {row.unit}" if row.unit and row.error else ""
    return _shown(row.error, "+.3g" if row.error else "g") + unit


# --- the two sides ------------------------------------------------------------------------------


def _frequencies(found: Modes, where: str) -> Quantities:
    lowest = found.frequency[:FREQUENCIES]
    return {f"frequency {i} {where}": float(f) for i, f in enumerate(lowest, start=1)}


def _straight(hold: Callable[[float], float], step: float) -> Quantities:
    """Return holding force and stiffness in the straight shape; ``step`` is a displacement [m]."""
    slope = (hold(step) - hold(-step)) / (2 * step)
    return {"holding force, straight": hold(0.0), "stiffness, straight": slope}


def _of_model(system: System, step: float) -> Quantities:
    free = equilibrium(system)
    return {
        "rest position": system.amount(free.q),
        **_frequencies(modes(system, free), "at rest"),
        **_straight(lambda x: equilibrium(system, x).force, step),
        **_frequencies(modes(system, equilibrium(system, 0.0)), "straight"),
    }


def _of_elements(fe: FiniteElements, step: float) -> Quantities:
    free, drawn = fe.equilibrium(), fe.equilibrium(0.0)
    return {
        "rest position": fe.displacement(free.q),
        **_frequencies(fe.modes(free), "at rest"),
        **_straight(lambda x: fe.equilibrium(x, drawn).force, step),
        **_frequencies(fe.modes(drawn), "straight"),
    }


def _unit(name: str) -> str:
    units = {"rest position": "m", "frequency": "Hz", "holding force": "N", "stiffness": "N/m"}
    return next((unit for start, unit in units.items() if name.startswith(start)), "")


def compare(
    mechanism: Mechanism,
    values: Mapping[str, float] | None = None,
    *,
    elements: int = 32,
    measured: Mapping[str, Estimate] | None = None,
    progress: Progress | None = None,
) -> Comparison:
    """Compare a mechanism's model with finite elements and with measured values.

    Parameters
    ----------
    mechanism : Mechanism
        The mechanism.
    values : mapping
        Parameters that differ from their defaults.
    elements : int
        Number of cable elements per flexure.
    measured : mapping
        Measured values by the name of the quantity, in SI units: ``"frequency 1 at rest"``,
        ``"rest position"``, ``"stiffness, straight"``, ``"modal restitution, stop"``, ...
    progress : callable or None
        Called with the completed fraction, from 0 to 1.

    Returns
    -------
    Comparison
        Comparison of the quantities that the model has.  A model with one degree of freedom, for
        example, has no third frequency.

    Raises
    ------
    FiniteElementError
        If Exudyn is not installed.
    ParameterError
        If a value is out of bounds, or a measured quantity is not compared.
    EquilibriumError
        If there is no equilibrium at rest, or none in the straight shape.
    """
    report = progress or (lambda _: None)
    given = dict(values or {}) | _without(mechanism)
    system = assemble(mechanism, mechanism.values(given))
    step = DIFFERENCE_STEP * system.length
    model = _of_model(system, step)
    report(0.1)
    found = _of_elements(FiniteElements(mechanism, given, elements=elements), step)
    report(0.5)
    notes: list[str] = []
    for i, (name, pair) in enumerate(_restitutions(mechanism, given, elements, notes)):
        model[name], found[name] = pair
        report(0.5 + 0.5 * (i + 1) / len(mechanism.stops))
    stops = range(len(mechanism.stops))
    notes += adequacy_notes(mechanism, given, [Impact(stop) for stop in stops])
    known = dict(measured or {})
    for name in known:
        if name not in model:
            raise ParameterError(
                f"{name!r} was measured but is not compared; the compared quantities are "
                f"{', '.join(model)}"
            )
    least = ZERO_RTOL * system.length
    small = {"m": least, "N": least * abs(found["stiffness, straight"])}

    def row(name: str) -> Row:
        unit = _unit(name)
        ours, theirs = (
            x if abs(x) > small.get(unit, 0.0) else 0.0 for x in (model[name], found[name])
        )
        return Row(name, unit, ours, theirs, known.get(name))

    rows = [row(name) for name in model]
    report(1.0)
    return Comparison(mechanism.title, elements, tuple(rows), tuple(notes))


def _without(mechanism: Mechanism) -> dict[str, float]:
    """Return zeros for friction and for damping in proportion to mass."""
    off = {f"{f.name}.coefficient": 0.0 for f in mechanism.frictions}
    off |= {f"{g.name}.friction": 0.0 for g in mechanism.guides if g.friction is not None}
    off |= {f"{s.name}.friction": 0.0 for s in mechanism.stops}
    return off | {"damping.zeta": 0.0}


def _restitutions(
    mechanism: Mechanism, values: Mapping[str, float], elements: int, notes: list[str]
) -> Iterator[tuple[str, tuple[float, float]]]:
    """Yield each stop's modal restitution by both methods; note walls that are out of reach."""
    known = mechanism.values(values)
    for stop in mechanism.stops:
        place, d = value(stop, "position", known), value(stop, "offset", known)
        try:
            pair = (
                algebraic(mechanism, [place], [d], values, stop=stop.name),
                by_elements(mechanism, [place], [d], values, stop=stop.name, elements=elements),
            )
        except (EquilibriumError, ParameterError) as error:  # Out of reach, or an expression.
            notes.append(f"no modal restitution at {stop.name}: {error}")
            continue
        name = f"modal restitution, {stop.name}"
        yield name, (pair[0].restitution.item(), pair[1].restitution.item())
