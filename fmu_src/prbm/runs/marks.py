"""The impacts in a result, from the engine or from recorded outputs."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ..mechanism.description import Mechanism
from .result import Columns, Result, column, names

SPEED_RTOL = 1e-9  # Smaller speeds after an impact, as a share of those before it, are round-off.


@dataclass(frozen=True)
class Mark:
    """An impact, for figures and headlines.

    Parameters
    ----------
    stop : int
        Index of the stop.
    time : float
        Time of the impact [s].
    speed, rebound : float
        Closing speed before and opening speed after it [m/s]; the latter is NaN if not recorded.
    count : int
        Number of impacts at the stop, including this one.
    force : float
        Peak force of the hit [N]; 0 at a rigid stop, or if it is not recorded.
    """

    stop: int
    time: float
    speed: float
    rebound: float
    count: int
    force: float = 0.0


HIT = ("peak_force", "indentation", "contact_duration")


def strongest_hit(result: Result | Columns, stop: str) -> tuple[float, float, float]:
    """Return peak force [N], indentation [m] and duration [s] of the strongest hit of a stop.

    The stop is compliant.  The columns contain contacts that are not counted as impacts, and the
    contact at the end; the records of the engine contain impacts between two rows.
    """
    columns = result.columns if isinstance(result, Result) else result
    impacts = result.impacts if isinstance(result, Result) else ()
    hits = [
        tuple(float(getattr(impact.latched, name)) for name in HIT)
        for impact in impacts
        if impact.stop == stop
    ]
    force, *others = (np.asarray(column(columns, f"{stop}.{name}"), float) for name in HIT)
    last = len(force) - 1 - int(np.argmax(force[::-1]))  # The contact may have ended by then.
    hits.append((float(force[last]), *(float(x[last]) for x in others)))
    strongest, depth, duration = max(hits, key=lambda hit: hit[0])
    return strongest, depth, duration


def marks(result: Result | Columns, mechanism: Mechanism) -> tuple[Mark, ...]:
    """Return the impacts of a result in order.

    A result of the engine contains all impacts.  Columns of FMPy contain the last impact of each
    communication step, and none if the latched outputs were not recorded.
    """
    if isinstance(result, Result) and result.impacts:
        numbers = {stop.name: i for i, stop in enumerate(mechanism.stops)}
        return tuple(
            Mark(
                numbers[impact.stop],
                impact.time,
                impact.latched.approach_speed,
                impact.latched.rebound_speed,
                impact.latched.impact_count,
                impact.latched.peak_force,
            )
            for impact in result.impacts
        )
    columns = result.columns if isinstance(result, Result) else result
    found = (m for i in range(len(mechanism.stops)) for m in _latched(i, columns, mechanism))
    return tuple(sorted(found, key=lambda mark: mark.time))


def _latched(i: int, columns: Columns, mechanism: Mechanism) -> Iterator[Mark]:
    """Yield the impacts at a stop that are visible in its latched outputs."""
    stop = mechanism.stops[i].name
    needed = [f"{stop}.{output}" for output in ("impact_count", "impact_time", "approach_speed")]
    if any(name not in names(columns) for name in needed):
        return
    count, when, speed = (columns[name] for name in needed)
    opening = f"{stop}.rebound_speed"
    rebound = columns[opening] if opening in names(columns) else np.full(len(columns), np.nan)
    peak = f"{stop}.peak_force"
    force = columns[peak] if peak in names(columns) else np.zeros(len(columns))
    rows = np.flatnonzero(np.diff(count, prepend=0) > 0)
    for row, following in pairwise([*rows.tolist(), len(columns)]):
        if columns["time"][0] <= when[row] <= columns["time"][-1]:
            largest = float(force[row:following].max())  # The peak is after the first row.
            numbers = float(when[row]), float(speed[row]), float(rebound[row]), int(count[row])
            yield Mark(i, *numbers, largest)
