"""The stress of flexures before and after the first rigid impact of a result.

A rigid impact changes velocities at once, and the wave of bending that follows needs more
coordinates than a flexure has.  The largest stress afterwards is therefore not reliable.
"""

import math

import numpy as np

from ..mechanism.description import Mechanism
from .result import Columns, column

UNRELIABLE = (
    "after rigid impacts  the stress is not reliable, up to a factor of 5: for a reliable one, use "
    'a stop with law = "compliant" (docs/strength.md)'
)


def first_rigid_impact(columns: Columns, mechanism: Mechanism) -> float:
    """Return the time of the first rigid impact [s], infinite without one.

    Of several impacts between two communication points the first of these points counts.

    Raises
    ------
    ResultError
        If a column is missing.
    """
    time, first = column(columns, "time"), math.inf
    for stop in (stop.name for stop in mechanism.stops if not stop.compliant):
        count = column(columns, f"{stop}.impact_count")
        struck = np.flatnonzero(count)
        if len(struck):
            k = int(struck[0])
            single = column(columns, f"{stop}.impact_time")[k] if count[k] == 1 else time[k - 1]
            first = min(first, float(single))
    return first


def peak_before(columns: Columns, flexure: str, limit: float) -> float:
    """Return the largest stress of a flexure until a time [Pa].

    A maximum between the last communication point before the time and the time itself counts if no
    larger one follows before the next point.

    Parameters
    ----------
    columns : structured array
        ``peak_stress`` and ``peak_stress_time`` of the flexure.
    flexure : str
        Name of the flexure.
    limit : float
        The time [s]; infinite for the whole result.

    Raises
    ------
    ResultError
        If a column is missing.
    """
    when = column(columns, f"{flexure}.peak_stress_time")
    peaks = column(columns, f"{flexure}.peak_stress")[when <= limit]
    return float(peaks.max(initial=0.0))
