"""Named quantities of a motion: settling time, impacts, speeds, forces, stress, lost energy.

They are computed from the outputs at the communication points, so that results of the engine and of
FMUs give the same numbers.  The engine also records every impact; the largest speed and force of an
impact are then those of all impacts, also of several between two communication points.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import inf, nan
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..hybrid.records import Impact

SETTLED_ENERGY_RTOL = 1e-4
"""A motion has settled if its kinetic energy stays below this share of its largest value."""
STILL_ENERGY_RTOL = 1e-12  # Below this share of its largest kinetic energy nothing moves.
ESTIMATE_PERIODS = 4.0  # Least time without impacts for an estimate, in fundamental periods.
SETTLED_PERIODS = 0.5  # Least time without motion, in periods of the fundamental mode.

KINETIC, FREQUENCY = "energy.kinetic", "mode.frequency"
Table = Mapping[str, NDArray[Any]] | NDArray[Any]


@dataclass(frozen=True)
class Quantity:
    """A number that describes a motion.

    Parameters
    ----------
    unit : str
        SI unit; empty if dimensionless.
    description : str
        Phrase for help texts and axes.
    suffixes : tuple of str
        Variables with these names or with these ends of names are needed.
    compute : callable
        Returns the number from the columns by name, with ``time``.
    latched : str
        Latched output whose value after a recorded impact the number is not below; or empty.
    remedy : str
        How a mechanism gets the needed variables if it lacks them; or empty.
    history : bool
        Whether it is computed from all communication points, and not only from the last one and
        the recorded impacts.
    """

    unit: str
    description: str
    suffixes: tuple[str, ...]
    compute: Callable[[Table], float]
    latched: str = ""
    remedy: str = ""
    history: bool = False

    def value(self, columns: Table, impacts: Sequence[Impact] = ()) -> float:
        """Return the number from the columns and from the recorded impacts, if there are any."""
        own = impacts if self.latched else ()
        latched: list[float] = [getattr(x.latched, self.latched) for x in own]
        return max([self.compute(columns), *latched])

    def variables(self, names: Iterable[str]) -> list[str]:
        """Return the variables among names that are needed.

        Examples
        --------
        >>> QUANTITIES["impacts"].variables(["stop.impact_count", "stop.gap"])
        ['stop.impact_count']
        """
        return [name for name in names if name in self.suffixes or name.endswith(self.suffixes)]

    def lacking(self, names: Iterable[str]) -> str:
        """Return a needed variable that is not among names, or an empty text.

        Variables of stops and bodies are needed only if no complete name is.

        Examples
        --------
        >>> QUANTITIES["settling"].lacking(["stop.gap"]), QUANTITIES["impacts"].lacking(["y"])
        ('energy.kinetic', '*.impact_count')
        """
        known = set(names)
        complete = [name for name in self.suffixes if not name.startswith(".")]
        if complete:
            return next((name for name in complete if name not in known), "")
        return "" if self.variables(known) else f"*{self.suffixes[0]}"


def settling(columns: Table) -> float:
    """Return the time from which on the kinetic energy stays small [s].

    It is the last time at which the kinetic energy falls below :data:`SETTLED_ENERGY_RTOL` times
    the largest kinetic energy of the run, interpolated between two communication points.  The
    kinetic energy is that of all bodies of the mechanism, whether they rest on a stop or not, and
    not that of a partner that is coupled by ``stop.mobility``.

    At the end of the run it must have been small for half a period of the fundamental mode, because
    it is also small where a vibration turns back.  Stops that hold only raise the frequencies of
    the rest of the mechanism.  If nothing moves at the last two times, any time suffices.

    Parameters
    ----------
    columns : mapping
        ``time``, ``energy.kinetic`` and ``mode.frequency``, (m,) each.

    Returns
    -------
    float
        The time; NaN if the motion has not settled; the first time if nothing moves.

    Examples
    --------
    >>> t, moving = np.arange(5.0), np.array([0.0, 1.0, 2e-4, 0.0, 0.0])
    >>> settling({"time": t, "energy.kinetic": moving, "mode.frequency": np.ones(5)})
    2.5
    """
    t, energy = np.asarray(columns["time"], float), np.asarray(columns[KINETIC], float)
    largest = float(energy.max())
    limit = SETTLED_ENERGY_RTOL * largest
    moving = np.flatnonzero(energy > limit)
    if not len(moving):
        return float(t[0])
    k = int(moving[-1])
    if k == len(t) - 1:
        return nan
    share = (energy[k] - limit) / (energy[k] - energy[k + 1])
    settled = float(t[k] + share * (t[k + 1] - t[k]))
    frequency = float(np.max(columns[FREQUENCY][-1]))
    still = float(energy[-2:].max()) <= STILL_ENERGY_RTOL * largest
    wait = 0.0 if still or not frequency > 0.0 else SETTLED_PERIODS / frequency
    return settled if float(t[-1]) - settled >= wait else nan


def settling_estimate(columns: Table, since: float) -> float:
    """Return an estimate of the settling time of a motion that has not settled [s].

    The kinetic energy falls exponentially, with the rate from the first to the second half of the
    time since the last impact.

    Parameters
    ----------
    columns : mapping
        ``time``, ``energy.kinetic`` and ``mode.frequency``, (m,) each.
    since : float
        Time of the last impact, or of the start [s].

    Returns
    -------
    float
        The time; infinite if the energy does not fall; NaN if the time since the last impact is too
        short.

    Examples
    --------
    >>> t = np.linspace(0.0, 4.0, 4001)
    >>> moving = np.exp(-t) * np.sin(30.0 * t) ** 2
    >>> found = settling_estimate(
    ...     {"time": t, "energy.kinetic": moving, "mode.frequency": 5.0 + 0.0 * t}, 0.0
    ... )
    >>> bool(abs(found / -np.log(SETTLED_ENERGY_RTOL) - 1.0) < 0.02)  # exact: exp(-t) is 1e-4
    True
    """
    t, energy = np.asarray(columns["time"], float), np.asarray(columns[KINETIC], float)
    frequency = float(np.max(columns[FREQUENCY][-1]))
    if not (t[-1] - since) * frequency > ESTIMATE_PERIODS:
        return nan
    first = (t > since) & (t <= 0.5 * (since + t[-1]))
    last = t > 0.5 * (since + t[-1])
    if not (first.any() and last.any()):
        return nan
    at = [int(np.flatnonzero(half)[np.argmax(energy[half])]) for half in (first, last)]
    before, after = energy[at]
    if not 0.0 < after < before:
        return inf
    rate = np.log(before / after) / (t[at[1]] - t[at[0]])
    return float(t[at[1]] + np.log(after / (SETTLED_ENERGY_RTOL * energy.max())) / rate)


def settling_or_estimate(columns: Table) -> float:
    """Return the settling time, or its estimate if the motion has not settled [s].

    The estimate (:func:`settling_estimate`) begins at the last impact that the latched outputs
    name; it is NaN or infinite if the motion gives none.
    """
    found = settling(columns)
    since = last_impact(columns)
    return (
        settling_estimate(columns, 0.0 if np.isnan(since) else since) if np.isnan(found) else found
    )


def last_impact(columns: Table) -> float:
    """Return the time of the last impact at all stops [s]; NaN without impacts."""
    hits = [
        float(columns[name][-1])
        for name in _named(columns, ".impact_time")
        if columns[name.replace(".impact_time", ".impact_count")][-1] > 0
    ]
    return max(hits, default=nan)


def largest_impulse(columns: Table) -> float:
    """Return the largest impulse of an impact [N s], 0 without impacts."""
    return _largest(columns, ".impulse")


def impacts(columns: Table) -> float:
    """Return the number of impacts at all stops."""
    return float(sum(columns[name][-1] for name in _named(columns, ".impact_count")))


def impact_speed(columns: Table) -> float:
    """Return the largest closing speed of an impact [m/s], 0 without impacts.

    Of several impacts between two communication points only the last one counts.
    """
    return _largest(columns, ".approach_speed")


def peak_force(columns: Table) -> float:
    """Return the largest contact force of all impacts at compliant stops [N], 0 without impacts.

    The latched ``STOP.peak_force`` is that of the last impact.  Of several impacts between two
    communication points only the last one counts.
    """
    return _largest(columns, ".peak_force")


def peak_stress(columns: Table) -> float:
    """Return the largest magnitude of the stress of all flexures [Pa], that of the integration."""
    return _largest(columns, ".peak_stress")


def peak_speed(columns: Table) -> float:
    """Return the largest speed of a centre of mass at the communication points [m/s]."""
    bodies = [name.removesuffix(".omega") for name in _named(columns, ".omega")]
    moving = [body for body in bodies if f"{body}.vx" in _names(columns)]
    return max(
        (float(np.hypot(columns[f"{b}.vx"], columns[f"{b}.vy"]).max()) for b in moving), default=0.0
    )


def energy_lost(columns: Table) -> float:
    """Return the energy dissipated by impacts, friction and damping [J]."""
    return float(columns["energy.dissipated"][-1])


def _names(columns: Table) -> list[str]:
    """Return the names of columns of a mapping or a structured array."""
    dtype = getattr(columns, "dtype", None)
    return list(columns) if dtype is None else list(dtype.names)


def _named(columns: Table, suffix: str) -> list[str]:
    return [name for name in _names(columns) if name.endswith(suffix)]


def _largest(columns: Table, suffix: str) -> float:
    """Return the largest value of all variables with an end of their names, 0 without one."""
    return max((float(columns[name].max()) for name in _named(columns, suffix)), default=0.0)


QUANTITIES: dict[str, Quantity] = {
    "settling": Quantity("s", "settling time", (KINETIC, FREQUENCY), settling, history=True),
    "settling_estimate": Quantity(
        "s",
        "settling time, estimated if it is not reached",
        (KINETIC, FREQUENCY, ".impact_time", ".impact_count"),
        settling_or_estimate,
        history=True,
    ),
    "last_impact": Quantity(
        "s", "time of the last impact", (".impact_time", ".impact_count"), last_impact
    ),
    "impulse": Quantity(
        "N s", "largest impulse of an impact", (".impulse",), largest_impulse, "impulse"
    ),
    "impacts": Quantity("", "number of impacts", (".impact_count",), impacts),
    "impact_speed": Quantity(
        "m/s",
        "largest closing speed of an impact",
        (".approach_speed",),
        impact_speed,
        "approach_speed",
    ),
    "peak_force": Quantity(
        "N",
        "largest contact force of all impacts",
        (".peak_force",),
        peak_force,
        "peak_force",
        'it needs a stop with law = "compliant", because a rigid impact has no largest force',
    ),
    "peak_stress": Quantity(
        "Pa",
        "largest stress of all flexures",
        (".peak_stress",),
        peak_stress,
        remedy="it needs a flexure type with stress = true",
    ),
    "peak_speed": Quantity(
        "m/s", "largest speed of a body", (".vx", ".vy", ".omega"), peak_speed, history=True
    ),
    "energy_lost": Quantity("J", "dissipated energy", ("energy.dissipated",), energy_lost),
}
