"""Shocks of the base: pulses, drops, their effect, and the level at which a flexure yields.

The mechanism starts at rest in its equilibrium.  The pulse is the acceleration of the base.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ..base.errors import ParameterError
from ..base.progress import Progress
from ..base.unit_text import GRAVITY, length_unit
from ..hybrid.release import PenetrationError
from ..mechanics.arrays import Real
from ..mechanics.assembly import assemble
from ..mechanics.statics import free_displacement
from ..mechanics.stress import with_stress
from ..mechanism.description import Mechanism
from ..mechanism.parts import Release
from ..runs.experiment import STEPS, experiment
from ..runs.marks import strongest_hit
from ..runs.quantities import settling
from ..runs.released import released_displacement, system_of
from ..runs.result import Result
from ..runs.run import simulate
from ..runs.signals import RAMP_SHARE, Signal, Wave, sawtooth, trapezoid
from .strength import Loading, loadings

HALF_SINE, SAWTOOTH, TRAPEZOID = "half-sine", "sawtooth", "trapezoid"
PULSES = (HALF_SINE, SAWTOOTH, TRAPEZOID)
PULSE_STEPS = 50  # Communication steps of a pulse, at least.
LEVEL_RTOL = 1e-3  # Error of the level at which a flexure yields.
PEAKS_MAX = 16  # Largest number of peaks in a search for this level.


@dataclass(frozen=True)
class Pulse:
    """A pulse of the acceleration of the base, as in IEC 60068-2-27.

    Parameters
    ----------
    kind : {"half-sine", "sawtooth", "trapezoid"}
        Shape: the sawtooth rises to its peak and ends there; the trapezoid rises and falls in a
        tenth of its duration.
    peak : float
        Largest acceleration [m/s^2].
    duration : float
        Duration [s].
    axis : {"x", "y"}
        Direction.

    Raises
    ------
    ParameterError
        If the shape or the direction is unknown, or peak or duration are not positive and finite.
    """

    kind: str
    peak: float
    duration: float
    axis: str = "x"

    def __post_init__(self) -> None:
        if self.kind not in PULSES:
            raise ParameterError(
                f"pulse = {self.kind!r} is unknown: choose one of {', '.join(PULSES)}"
            )
        if self.axis not in ("x", "y"):
            raise ParameterError(f"axis = {self.axis!r}: choose x or y")
        for name, x, si in (("peak", self.peak, "m/s2"), ("duration", self.duration, "s")):
            if not (math.isfinite(x) and x > 0.0):
                raise ParameterError(f"{name} = {x:g} {si}: must be positive and finite")

    @classmethod
    def drop(cls, kind: str, height: float, duration: float, axis: str = "x") -> "Pulse":
        """Return the pulse of a drop from a height [m] onto a pad that does not throw it back.

        The change of velocity is sqrt(2 g h).

        Examples
        --------
        >>> round(Pulse.drop("half-sine", 1.0, 1e-3).velocity, 3)
        4.429
        """
        if not (math.isfinite(height) and height > 0.0):
            raise ParameterError(f"height = {height:g} m of the drop must be positive and finite")
        one = cls(kind, 1.0, duration, axis)
        return replace(one, peak=math.sqrt(2.0 * GRAVITY * height) / one.velocity)

    @property
    def velocity(self) -> float:
        """Change of the velocity of the base [m/s]."""
        shares = {HALF_SINE: 2.0 / math.pi, SAWTOOTH: 0.5, TRAPEZOID: 1.0 - RAMP_SHARE}
        return shares[self.kind] * self.peak * self.duration

    @property
    def signal(self) -> Signal:
        """The acceleration over time [m/s^2]."""
        A, T = self.peak, self.duration
        if self.kind == HALF_SINE:
            return Wave(A, f=0.5 / T, f1=0.5 / T, start=0.0, end=T)
        return sawtooth(A, 0.0, T) if self.kind == SAWTOOTH else trapezoid(A, 0.0, T)

    @property
    def input(self) -> str:
        """Name of the input."""
        return f"base.acceleration.{self.axis}"


@dataclass(frozen=True)
class Hits:
    """Impacts at a stop: their number, the largest closing speed [m/s] and impulse [N s].

    For a compliant stop also the largest contact force [N], indentation [m] and duration of a
    contact [s]; None for a rigid stop.
    """

    stop: str
    count: int
    speed: float
    impulse: float
    force: float | None = None
    indentation: float | None = None
    duration: float | None = None


@dataclass(frozen=True)
class Shock:
    """The effect of a shock.

    Parameters
    ----------
    result : Result
        The motion.
    displacement : float
        Largest displacement of the released point along the direction of its release from its
        equilibrium, with its sign [m]; of its body's rotation [rad] if it is released by an angle.
    hits : tuple of Hits
        Impacts at the stops.
    loadings : tuple of Loading
        Stress of the flexures.
    rest : float
        Time from which on the kinetic energy stays small [s]; NaN if it does not.
    """

    result: Result
    displacement: float
    hits: tuple[Hits, ...]
    loadings: tuple[Loading, ...]
    rest: float

    @property
    def safety(self) -> float:
        """Least safety factor against yield; infinite without a yield strength."""
        return min((x.safety for x in self.loadings if x.safety is not None), default=math.inf)

    @property
    def force(self) -> float | None:
        """Largest force at a compliant stop [N]; None without compliant stops."""
        return max((x.force for x in self.hits if x.force is not None), default=None)

    @property
    def peak_stress(self) -> float:
        """Largest stress [Pa]."""
        return max(x.peak for x in self.loadings)


def at_rest(mechanism: Mechanism, values: Mapping[str, float] | None = None) -> Mechanism:
    """Return a mechanism that starts at rest in its equilibrium, with its stress as outputs."""
    given = {p.name for p in mechanism.parameters}
    known = {name: x for name, x in (values or {}).items() if name in given}
    system = assemble(mechanism, mechanism.values(known))
    amount, release = free_displacement(system), mechanism.release
    held = Release(
        release.body, release.direction, None if release.turns else amount, 0.0, release.point,
        amount if release.turns else None,
    )  # fmt: skip
    return replace(with_stress(mechanism), release=held)


def shock(
    mechanism: Mechanism,
    source: Mapping[str, Signal | str],
    values: Mapping[str, float] | None = None,
    *,
    duration: float = 0.0,
    stop_time: float | None = None,
    fatigue: bool = False,
    progress: Progress | None = None,
    engine: str | None = None,
) -> Shock:
    """Simulate a shock.

    Parameters
    ----------
    mechanism : Mechanism
        The mechanism, from its release.
    source : mapping
        Signals of the acceleration of the base, by the names of the inputs.
    values : mapping or None
        Parameters and inputs that differ from their defaults, without those of the release.
    duration : float
        Duration of the pulse [s].
    stop_time : float or None
        End of the simulation [s]; None: that of the default experiment after the pulse.
    fatigue : bool
        Whether to compute the damage.
    progress, engine
        As for :func:`prbm.simulate`.

    Raises
    ------
    ParameterError
        If a rigid wall is penetrated in the equilibrium.
    """
    resting = at_rest(mechanism, values)
    try:
        default = experiment(resting, values, engine)
    except PenetrationError as error:
        start = "in the equilibrium without stops, from which a shock starts"
        remedy = "move the stop, or change gravity"
        raise ParameterError(error.message(start, remedy)) from None
    end = duration + default.stop_time if stop_time is None else stop_time
    step = min([end / STEPS, *([duration / PULSE_STEPS] if duration else [])])
    result = simulate(
        resting, values, inputs=source, stop_time=end, step=step, progress=progress, engine=engine
    )
    moved = displacement(result)
    return Shock(
        result,
        float(moved[int(np.argmax(np.abs(moved)))]),
        tuple(_hits(result, stop.name) for stop in mechanism.stops),
        tuple(loadings(result.columns, resting, fatigue=fatigue)),
        settling(result.columns),
    )


def displacement(result: Result) -> Real:
    """Return the displacement of the released point from its start over time [m].

    If the release is by an angle, return the rotation of its body from the start [rad].
    """
    release, columns = result.mechanism.release, result.columns
    if release.turns:
        along: Real = columns[f"{release.body}.angle"]
    else:
        along = released_displacement(system_of(result), columns)
    moved: Real = along - along[0]
    return moved


def displacement_unit(mechanism: Mechanism) -> tuple[float, str]:
    """Return factor and name of the display unit of :func:`displacement`."""
    if mechanism.release.turns:
        return 180.0 / math.pi, "deg"
    return length_unit(assemble(mechanism, mechanism.values()).length)


def _hits(result: Result, stop: str) -> Hits:
    """Return the impacts at a stop."""
    own = [impact.latched for impact in result.impacts if impact.stop == stop]
    found = Hits(
        stop, len(own), max((x.approach_speed for x in own), default=0.0),
        max((x.impulse for x in own), default=0.0),
    )  # fmt: skip
    if not next(s for s in result.mechanism.stops if s.name == stop).compliant:
        return found
    force, indentation, duration = strongest_hit(result, stop)
    return replace(found, force=force, indentation=indentation, duration=duration)


class Fragility(NamedTuple):
    """Shocks over the peak of their pulse.

    Parameters
    ----------
    peaks : list of float
        Peaks, in ascending order [m/s^2].
    shocks : list of Shock
        A shock for each peak.
    level : float
        Least peak at which a flexure yields [m/s^2].  NaN if no flexure yields, or if one yields
        at the first peak.
    """

    peaks: list[float]
    shocks: list[Shock]
    level: float


def fragility(
    mechanism: Mechanism,
    pulse: Pulse,
    peaks: Sequence[float] | None = None,
    values: Mapping[str, float] | None = None,
    *,
    stop_time: float | None = None,
    progress: Progress | None = None,
    engine: str | None = None,
) -> Fragility:
    """Return shocks with several peaks, and the least peak at which a flexure yields.

    The level is found between the first of the peaks at which the safety factor is below 1, and
    the one before.

    Parameters
    ----------
    mechanism : Mechanism
        The mechanism.
    pulse : Pulse
        Shape, duration and direction of the pulse.
    peaks : sequence of float or None
        Peaks in ascending order [m/s^2].  None: that of the pulse, and its products with powers of
        2 until one flexure yields, or no flexure yields, or :data:`PEAKS_MAX` peaks are computed.
    values, stop_time, progress, engine
        As for :func:`shock`.

    Raises
    ------
    ParameterError
        If the peaks are not given, and no flexure has a yield strength.
    """

    def at(peak: float) -> Shock:
        one = replace(pulse, peak=peak)
        return shock(
            mechanism, {one.input: one.signal}, values, duration=pulse.duration,
            stop_time=stop_time, engine=engine,
        )  # fmt: skip

    report: Progress = progress or (lambda fraction: None)
    if peaks is None:
        found = _doubled(at, pulse.peak, mechanism, report)
    else:
        found = {}
        for k, peak in enumerate(peaks):
            found[peak] = at(peak)
            report((k + 1) / len(peaks))
    known, shocks = list(found), list(found.values())
    failing = next((k for k, one in enumerate(shocks) if one.safety < 1.0), 0)
    if failing == 0:
        return Fragility(known, shocks, math.nan)
    low, high = known[failing - 1], known[failing]
    while high - low > LEVEL_RTOL * high:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if at(middle).safety < 1.0 else (middle, high)
    return Fragility(known, shocks, 0.5 * (low + high))


def _doubled(
    at: Callable[[float], Shock], peak: float, mechanism: Mechanism, report: Progress
) -> dict[float, Shock]:
    """Return shocks by their peaks, from one at which no flexure yields to one at which one does.

    Neighbours differ by a factor of 2.
    """
    if all(kind.yield_strength is None for kind in mechanism.flexure_types):
        raise ParameterError(
            f"{mechanism.name} has no yield_strength: add it to the material, or give the peaks"
        )
    found = {peak: at(peak)}
    fails = found[peak].safety < 1.0
    while len(found) < PEAKS_MAX:
        peak *= 0.5 if fails else 2.0
        found[peak] = at(peak)
        report(len(found) / PEAKS_MAX)
        if (found[peak].safety < 1.0) != fails:
            break
    report(1.0)
    return dict(sorted(found.items()))
