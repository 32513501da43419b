"""The motion in a result, and the times of the frames of a film.

The angles of links and bodies determine the shape of a mechanism without stretching links.
Stretches follow from the loops and the displacements of the bodies.  A result of FMPy with the
variables of :func:`needed` therefore gives the same motion as a result of the engine.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..base.errors import ParameterError
from ..drawing.motion import angles, closed, stretched
from ..mechanics.arrays import Complex, Real
from ..mechanics.assembly import assemble
from ..mechanics.system import System
from ..mechanism.description import Mechanism
from ..mechanism.parts import value
from ..runs.marks import Mark, marks
from ..runs.result import Columns, Result, ResultError, column, names

FILM_LENGTH = 10.0  # Length of a film without a given factor of slow motion [s].
FPS = 25.0  # Frames per second.
FPS_MAX = 50.0  # Viewers of GIF files slow down faster films.
FRAMES_MAX = 5000
MOTION_RTOL = 5e-3  # Smaller motions, relative to the largest rotation, are a pixel or two.
END_SHARE = 0.15  # Time after the end of the motion, as a share of the motion.
LOOP_OPEN_RTOL = 1e-6  # Larger openings of the loops, relative to the size: another mechanism.


@dataclass(frozen=True)
class Motion:
    """Shapes at the recorded times and at the impacts between them.

    Parameters
    ----------
    system : System
        The moving mechanism.
    time : (m,)
        Increasing times [s].
    q : (m, n)
        Angles of links and bodies [rad].
    walls : (m, s)
        Positions of the walls along the directions of their stops, from straight [m].
    holds : (m, s) bool
        Whether each stop holds (resting contact).
    marks : tuple of Mark
        The impacts, in order.
    """

    system: System
    time: Real
    q: Real
    walls: Real
    holds: NDArray[np.bool_]
    marks: tuple[Mark, ...]

    def shape(self, t: float) -> tuple[Real, Real]:
        """Return angles that close the loops, and the positions of the walls, at a time."""
        q = np.array([np.interp(t, self.time, x) for x in self.q.T])
        walls = np.array([np.interp(t, self.time, x) for x in self.walls.T])
        return closed(self.system, q), walls

    def holding(self, t: float) -> NDArray[np.bool_]:
        """Return whether each stop holds at a time."""
        row = int(np.searchsorted(self.time, t, side="right")) - 1
        held: NDArray[np.bool_] = self.holds[max(row, 0)]
        return held

    @property
    def gaps(self) -> Real:
        """Gaps of the stops, (m, s) [m]."""
        result: Real = self.walls + _gaps(self.system, self.q)
        return result


def _gaps(system: System, q: Real) -> Real:
    return system.gap_rows.values(system.directions(q))


def needed(mechanism: Mechanism) -> list[str]:
    """Return the variables for an animation of a mechanism, for FMPy's ``output``."""
    system = assemble(mechanism, mechanism.values())
    positions = [f"{name}.{axis}" for name in system.bodies for axis in "xy"]
    return (
        list(angles(system))
        + (positions if len(system.strains) else [])
        + [
            f"{stop.name}.{variable}"
            for stop in mechanism.stops
            for variable in ("gap", "contact", "impact_count", "impact_time", "approach_speed")
        ]
    )


def fmpy_command(mechanism: Mechanism) -> str:
    """Return the command with which FMPy records the variables for an animation."""
    variables = " ".join(f'"{name}"' for name in needed(mechanism))
    return (
        f"fmpy simulate {mechanism.name}.fmu --output-file result.csv "
        f"--output-variables {variables}"
    )


def motion(
    result: Result | Columns,
    mechanism: Mechanism | None = None,
    values: Mapping[str, float] | None = None,
) -> Motion:
    """Return the motion in a result.

    Parameters
    ----------
    result : Result or structured array
        Result of :func:`prbm.runs.run.simulate`, or of FMPy.
    mechanism : Mechanism or None
        The mechanism; not needed for a :class:`Result`.
    values : mapping or None
        Parameters that differed from their defaults; not needed for a :class:`Result`.

    Raises
    ------
    ResultError
        If the mechanism is not given, columns are missing, or the shapes do not fit it.
    """
    if isinstance(result, Result):
        columns, mechanism, values = result.columns, result.mechanism, result.start_values
    else:
        columns = result
    if mechanism is None:
        raise ResultError(
            "the result has no mechanism; give the mechanism: motion(result, mechanism)"
        )
    known = mechanism.values()
    system = assemble(
        mechanism, mechanism.values({k: x for k, x in (values or {}).items() if k in known})
    )
    time = np.asarray(column(columns, "time"), float)
    if len(time) < 2 or not (np.diff(time) >= 0.0).all():
        raise ResultError("the result must have at least two times, which must not decrease")
    columns_of = angles(system)
    missing = [name for name in columns_of if name not in names(columns)]
    if missing:
        raise ResultError(
            f"the result lacks {', '.join(missing)}; record the variables for an animation, in "
            "Python with simulate_fmu(..., output=prbm.plots.motion.needed(mechanism)), on the "
            f"command line with\n{fmpy_command(mechanism)}"
        )
    q = np.zeros((len(time), system.n))
    for name, j in columns_of.items():
        q[:, j] = columns[name] / system.units[j]
    if not np.isfinite(q).all():
        raise ResultError("the result has angles that are not finite numbers")
    q = stretched(system, q, _displacements(system, columns))
    _check_loops(system, q)
    stops = range(len(mechanism.stops))
    walls = np.array([_wall(system, i, columns, q) for i in stops]).reshape(-1, len(time)).T
    holds = np.array([_holds(system, i, columns) for i in stops], bool)
    holds = holds.reshape(-1, len(time)).T
    return _with_impacts(Motion(system, time, q, walls, holds, marks(result, mechanism)), result)


def _displacements(system: System, columns: Columns) -> dict[str, Complex]:
    """Return the recorded displacements of bodies [m]."""
    return {
        name: columns[f"{name}.x"] + 1j * columns[f"{name}.y"]
        for name in system.bodies
        if f"{name}.x" in names(columns) and f"{name}.y" in names(columns)
    }


def _check_loops(system: System, q: Real) -> None:
    """Reject shapes with open loops: the mechanism or its lengths are different ones."""
    opened = np.abs(system.loop_rows.values(system.directions(q)))
    if opened.size and opened.max() > LOOP_OPEN_RTOL * system.length:
        raise ResultError(
            f"the loops of {system.mechanism.name} are open by {opened.max():.3g} m in the result; "
            "give the mechanism of this result, with all lengths that differ from the defaults"
        )


def _wall(system: System, i: int, columns: Columns, q: Real) -> Real:
    """Return the positions of a wall, from the gap if it was recorded."""
    stop = system.mechanism.stops[i]
    if f"{stop.name}.gap" in names(columns):
        recorded: Real = columns[f"{stop.name}.gap"] - _gaps(system, q)[:, i]
        return recorded
    position = np.full(len(q), value(stop, "position", system.values))
    displacement = f"{stop.name}.displacement"
    return position + columns[displacement] if displacement in names(columns) else position


def _holds(system: System, i: int, columns: Columns) -> NDArray[np.bool_]:
    name = f"{system.mechanism.stops[i].name}.contact"
    if name in names(columns):
        held: NDArray[np.bool_] = np.not_equal(columns[name], 0)
        return held
    return np.zeros(len(columns), bool)


def _with_impacts(motion: Motion, result: Result | Columns) -> Motion:
    """Return the motion with additional shapes at the impacts, in which the stops touch."""
    if not motion.marks:
        return motion
    exact = {}
    if isinstance(result, Result):
        exact = {impact.time: impact.q for impact in result.impacts}
    shapes = []
    for mark in motion.marks:
        q, walls = motion.shape(mark.time)
        touching = exact.get(mark.time)
        if touching is None:
            touching = closed(motion.system, q, mark.stop, walls[mark.stop])
        shapes.append((touching, walls, motion.holding(mark.time)))
    time = np.concatenate([motion.time, [mark.time for mark in motion.marks]])
    order = np.argsort(time, kind="stable")
    q, walls, holds = (
        np.concatenate([old, [s[part] for s in shapes]])[order]
        for part, old in enumerate((motion.q, motion.walls, motion.holds))
    )
    return Motion(motion.system, time[order], q, walls, holds.astype(bool), motion.marks)


@dataclass(frozen=True)
class Film:
    """Times of the frames of a film.

    Parameters
    ----------
    times : (k,)
        Time of each frame [s]; the frame nearest to an impact is at the time of the impact.
    slow : float
        Factor of slow motion [-].
    fps : float
        Frames per second.
    hits : dict of int to Mark
        The visible impacts by frame; of several impacts in one frame, the fastest.
    """

    times: Real
    slow: float
    fps: float
    hits: Mapping[int, Mark]


def film(
    motion: Motion,
    slow: float | None = None,
    fps: float = FPS,
    start: float | None = None,
    stop: float | None = None,
) -> Film:
    """Choose the frames of a film.

    Parameters
    ----------
    motion : Motion
        The motion.
    slow : float or None
        Factor of slow motion [-]; None: a round factor for a film of about ten seconds.
    fps : float
        Frames per second.
    start, stop : float or None
        Part of the motion [s]; None: from its start, to its end or until shortly after the
        mechanism comes to rest.

    Raises
    ------
    ParameterError
        If the film has fewer than two or more than :data:`FRAMES_MAX` frames.
    """
    first, last = float(motion.time[0]), float(motion.time[-1])
    a = first if start is None else start
    b = _ending(motion, a) if stop is None else stop
    if not (first <= a < b <= last):
        raise ParameterError(
            f"start = {a:g} s, stop = {b:g} s: choose a span within {first:g} s to {last:g} s"
        )
    if not 1.0 <= fps <= FPS_MAX:
        raise ParameterError(f"fps = {fps:g} must lie between 1 and {FPS_MAX:g} per second")
    if slow is None:
        slow = round_factor(FILM_LENGTH / (b - a))
    if not (math.isfinite(slow) and slow > 0.0):
        raise ParameterError(f"slow = {slow:g} must be positive and finite")
    count = math.floor((b - a) * slow * fps * (1.0 + 1e-12)) + 1
    if not 2 <= count <= FRAMES_MAX:
        raise ParameterError(
            f"slow = {slow:g} makes a film of {count} frames; choose a factor that makes 2 to "
            f"{FRAMES_MAX}, about {round_factor(FILM_LENGTH / (b - a)):g} for ten seconds"
        )
    spacing = 1.0 / (slow * fps)
    times = a + spacing * np.arange(count, dtype=np.float64)
    hits: dict[int, Mark] = {}
    for mark in motion.marks:
        k = round((mark.time - a) / spacing)
        if 0 <= k < count and a <= mark.time <= b:
            hits[k] = max(mark, hits.get(k, mark), key=lambda m: m.speed)
    for k, mark in hits.items():
        times[k] = mark.time
    return Film(times, slow, fps, hits)


def _ending(motion: Motion, start: float) -> float:
    """Return the end of a film: shortly after the last motion [s]."""
    time, last = motion.time, float(motion.time[-1])
    places = np.hstack([motion.q, motion.walls / motion.system.length])
    least = MOTION_RTOL * float(np.ptp(motion.q, axis=0).max())
    moving = np.flatnonzero(np.abs(places - places[-1]).max(axis=1) > least)
    if not len(moving):
        return last
    end = float(time[moving[-1]])
    return min(last, end + END_SHARE * (end - start)) if end > start else last


def round_factor(x: float) -> float:
    """Return the number 1, 2 or 5 times a power of ten that is nearest in ratio.

    Examples
    --------
    >>> [round_factor(x) for x in (9.0, 0.23, 41.0)]
    [10.0, 0.2, 50.0]
    """
    power = math.floor(math.log10(x))
    choices = [float(f"{m}e{p}") for p in (power, power + 1) for m in (1, 2, 5)]
    return min(choices, key=lambda c: abs(math.log(c / x)))


def pace(slow: float) -> str:
    """Return a factor of slow motion in words.

    Examples
    --------
    >>> pace(20.0), pace(1.0), pace(0.5)
    ('20x slower', 'real time', '2x faster')
    """
    if slow == 1.0:
        return "real time"
    return f"{slow:g}x slower" if slow > 1.0 else f"{1.0 / slow:g}x faster"
