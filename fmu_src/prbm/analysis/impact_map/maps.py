r"""Impact maps: the modal restitution over positions of the wall and offsets of the hit.

The modal restitution is the ratio of the fundamental mode's velocities after and before an impact,
with the sign reversed.  The default points of a map are those measured in the thesis (S. Boersma,
*Modelling and Validation of the Impact Response in Compliant Mechanisms*, 2015).  The methods are
in :mod:`prbm.analysis.impact_map.routes` and :mod:`prbm.analysis.impact_map.free_body`.
"""

import csv
import io
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...base.atomic import write
from ...base.errors import ParameterError
from ...base.progress import Progress
from ...base.unit_text import length_unit
from ...mechanics.arrays import Real
from ...mechanism.description import Mechanism
from ..touching import stop_index

WALLS = (-10e-3, -5e-3, 0.0, 5e-3, 10e-3)  # Positions of the wall in the thesis [m].
OFFSETS = (-4e-3, -2e-3, 0.0, 2e-3, 4e-3)  # Offsets of the hit in the thesis [m].
ENERGY_SHOWN_MIN = 5e-5  # Least share of the energy of a mode in a table.


@dataclass(frozen=True)
class Hit:
    """One impact of a map.

    Parameters
    ----------
    wall, offset : float
        Position of the wall, distance of the hit point from the point of the stop [m].
    restitution : float
        Modal restitution [-].
    frequency : (k,)
        Frequencies of the modes at the impact shape [Hz].
    before, after : (k,)
        Kinetic energy of each mode, in units of the arriving energy [-].
    lost : float
        Energy lost in the contact, in the same units [-].
    """

    wall: float
    offset: float
    restitution: float
    frequency: Real
    before: Real
    after: Real
    lost: float

    def table(self) -> str:
        """Return a table of the energies, mode by mode."""
        lines = [f"{'mode':>6}{'Hz':>12}{'before':>10}{'after':>10}"]
        rows = zip(self.frequency, self.before, self.after, strict=True)
        for i, (f, a, b) in enumerate(rows, start=1):
            if max(a, b) >= ENERGY_SHOWN_MIN:
                lines.append(f"{i:6d}{f:12.4g}{a:10.4f}{b:10.4f}")
        lines.append(f"{'contact':>18}{'':>10}{self.lost:10.4f}")
        return "\n".join(lines)


@dataclass(frozen=True)
class ImpactMap:
    """Modal restitution over offsets (rows) and walls (columns).

    Parameters
    ----------
    label : str
        Name of the model and of the method.
    walls, offsets : (k,), (l,)
        Positions of the wall, offsets [m].
    restitution : (l, k)
        Modal restitution [-].
    hits : tuple of tuple of Hit
        The points with their energies, in rows and columns; empty for a method without energies.
    """

    label: str
    walls: Real
    offsets: Real
    restitution: Real
    hits: tuple[tuple[Hit, ...], ...] = ()

    def csv(self) -> str:
        """Return the map as CSV: one line per point, with energies if they are known."""
        out = io.StringIO()
        writer = csv.writer(out, lineterminator="\n")
        energies = ["left in mode 1 [-]", "in mode 2 [-]", "in mode 3 [-]", "in others [-]"]
        head = ["route", "wall position [m]", "offset [m]", "modal restitution [-]"]
        writer.writerow([*head, *energies, "lost in contact [-]"])
        for i, d in enumerate(self.offsets):
            for j, h in enumerate(self.walls):
                known: list[str] = [""] * 5
                if self.hits:
                    hit = self.hits[i][j]
                    shares = [*grouped(hit.after), hit.lost]
                    known = [f"{x:.6f}" for x in shares]
                c = f"{self.restitution[i, j]:.6f}"
                writer.writerow([self.label, f"{h:.6g}", f"{d:.6g}", c, *known])
        return out.getvalue()

    def write(self, path: str | Path) -> Path:
        """Write the map to a CSV file, completely or not at all; return its path.

        Raises
        ------
        OSError
            If the file cannot be written.
        """
        path = Path(path)
        write(path, self.csv().encode())
        return path

    def __str__(self) -> str:
        largest = float(max(np.abs(self.walls).max(), np.abs(self.offsets).max()))
        factor, unit = length_unit(largest or 1.0)
        head = "".join(f"{factor * h:9.3g}" for h in self.walls)
        lines = [self.label, f"d \\ h, {unit}{head}"]
        for d, row in zip(self.offsets, self.restitution, strict=True):
            lines.append(f"{factor * d:{6 + len(unit) + 1}.3g}" + "".join(f"{c:9.4f}" for c in row))
        return "\n".join(lines)


def grouped(after: Real) -> list[float]:
    """Return the energies of the first three modes, and of all others together."""
    first = [float(x) for x in after[:3]] + [0.0] * max(0, 3 - len(after))
    return [*first, float(after[3:].sum())]


@dataclass(frozen=True)
class MovedStop:
    """The stop of a map, whose position and offset are varied.

    Parameters
    ----------
    index : int
        Index of the stop.
    name : str
        Name of the stop.
    """

    index: int
    name: str

    @classmethod
    def of(cls, mechanism: Mechanism, name: str | None) -> "MovedStop":
        """Return a stop by name, or the first one.

        Raises
        ------
        ParameterError
            If there is no such stop, or its position or offset is an expression.
        """
        index = stop_index(mechanism, name)
        found = cls(index, mechanism.stops[index].name)
        for quantity in ("position", "offset"):
            if f"{found.name}.{quantity}" not in mechanism.values():
                raise ParameterError(
                    f"{mechanism.name}: the {quantity} of {found.name} is an expression in other "
                    "parameters, but a map varies it: replace the expression by a number"
                )
        return found

    def at(
        self, values: Mapping[str, float] | None, wall: float, offset: float
    ) -> dict[str, float]:
        """Return values with another position of the wall and another offset of the hit."""
        return {**(values or {}), f"{self.name}.position": wall, f"{self.name}.offset": offset}


def map_of(label: str, rows: Sequence[Sequence[Hit]]) -> ImpactMap:
    """Return the map of hits in rows (offsets) and columns (walls)."""
    return ImpactMap(
        label,
        np.array([hit.wall for hit in rows[0]]),
        np.array([row[0].offset for row in rows]),
        np.array([[hit.restitution for hit in row] for row in rows]),
        tuple(tuple(row) for row in rows),
    )


def point_counter(progress: Progress | None, count: int) -> Callable[[], None]:
    """Return a progress callback, to be called once per point."""
    done = 0

    def report() -> None:
        nonlocal done
        done += 1
        if progress is not None:
            progress(done / count)

    return report
