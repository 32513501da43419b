"""The summary of a result: frequency, free rest position, impacts, rest on a stop."""

import math
from collections.abc import Mapping

from ..base.unit_text import frequency_unit, length_unit, prefixed_unit, time_unit
from ..mechanics.assembly import assemble
from ..mechanics.modal import modes
from ..mechanics.statics import free_displacement, resting
from ..mechanics.stress import stressed
from ..mechanics.system import System
from ..mechanism.description import Mechanism
from .marks import marks, strongest_hit
from .quantities import FREQUENCY, KINETIC, SETTLED_ENERGY_RTOL, settling, settling_estimate
from .released import displacement_outputs, released_displacement
from .result import Columns, Result, column, moves, rest_time
from .struck import UNRELIABLE, first_rigid_impact, peak_before

REST = "came to rest"
SECONDS_MIN = 0.1  # Times of shorter runs are printed in ms or µs [s].
UNDAMPED = "only impacts and friction take energy: damping_zeta or damping_beta damp the motion"


def length(x: float, size: float) -> str:
    """Return a length [m] with two decimals, in mm or in the unit of a smaller mechanism.

    A negative zero is printed without its sign.

    Parameters
    ----------
    x : float
        The length [m].
    size : float
        Size of the mechanism [m].

    Examples
    --------
    >>> length(-1.8e-3, 0.08), length(-1e-9, 0.08), length(3e-6, 2e-4)
    ('-1.80 mm', '0.00 mm', '3.00 µm')
    """
    factor, unit = length_unit(min(size, 1.0))
    return f"{round(factor * x, 2) + 0.0:.2f} {unit}"


def instant(t: float, span: float, digits: int) -> str:
    """Return a time of a run as text, in seconds, or in ms or µs if the run is short.

    Parameters
    ----------
    t, span : float
        The time, and the duration of the run [s].
    digits : int
        Number of decimals.

    Examples
    --------
    >>> instant(0.0349812, 1.0, 5), instant(2.71034e-6, 1e-4, 3), instant(0.0, 1e-4, 3)
    ('0.03498 s', '2.710 µs', '0 s')
    """
    factor, unit = (1.0, "s") if span >= SECONDS_MIN else time_unit(span)
    text = f"{factor * t:.{digits}f}"
    return f"{text} {unit}" if float(text) else "0 s"


def speed_text(speed: float) -> str:
    """Return a speed [m/s] with three digits.

    Examples
    --------
    >>> speed_text(0.8067), speed_text(2.41e-5)
    ('0.807 m/s', '24.1 µm/s')
    """
    factor, unit = prefixed_unit(speed, "m/s")
    return f"{factor * speed:.3g} {unit}"


def contact_line(stop: str, force: float, indentation: float, duration: float) -> str:
    """Return the line about the hardest hit at a compliant stop.

    Parameters
    ----------
    stop : str
        Name of the stop.
    force, indentation, duration : float
        Its peak force [N], indentation [m] and duration [s].

    Examples
    --------
    >>> contact_line("stop", 25.0612, 6.2e-5, 6.12e-4)
    'force at stop        at most 25.06 N, indentation 62 µm, contact 0.612 ms'
    """
    texts = []
    for x, si, digits in ((force, "N", 4), (indentation, "m", 3), (duration, "s", 3)):
        factor, shown = prefixed_unit(x, si)
        texts.append(f"{factor * x:.{digits}g} {shown}")
    lasted = f"contact {texts[2]}" if duration else "the contact has not ended"
    return f"force at {stop:11} at most {texts[0]}, indentation {texts[1]}, {lasted}"


def headline(
    result: Result | Columns, mechanism: Mechanism, values: Mapping[str, float]
) -> list[str]:
    """Return a summary of a result, line by line.

    Parameters
    ----------
    result : Result or structured array
        Result of :func:`prbm.runs.run.simulate`, or columns of FMPy, with all outputs.
    mechanism : Mechanism
        The mechanism that was simulated.
    values : mapping
        Parameters and inputs at the start.

    Raises
    ------
    ResultError
        If a column is missing.
    """
    columns = result.columns if isinstance(result, Result) else result
    parameters = {p.name for p in mechanism.parameters}
    system = assemble(mechanism, {n: x for n, x in values.items() if n in parameters})
    time = column(columns, "time")
    span = float(time[-1] - time[0])
    lines = _free(columns, system)
    moving = moves(columns, mechanism, system.length)
    if not moving:
        lines.append(
            "motion               nothing moves: release the mechanism away from its equilibrium, "
            "or apply an input, a larger one if friction holds the mechanism"
        )
    impacts = marks(result, mechanism)
    for i, (stop, compliant) in enumerate((s.name, s.compliant) for s in mechanism.stops):
        count = int(column(columns, f"{stop}.impact_count")[-1])
        first = next((mark for mark in impacts if mark.stop == i), None)
        details = ""
        if first is not None:
            which = "the first" if first.count == 1 else f"number {first.count}"
            details = (
                f", {which} at t = {instant(first.time, span, 5)} with {speed_text(first.speed)}"
            )
        elif not count:
            nearest = float(column(columns, f"{stop}.gap").min())
            details = f", the smallest gap was {length(nearest, system.length)}"
        lines.append(f"impacts at {stop:9} {count}{details}")
        force, indentation, duration = strongest_hit(result, stop) if compliant else (0.0,) * 3
        if force > 0.0:
            lines.append(contact_line(stop, force, indentation, duration))
        since = None if compliant and _in_impact(columns, stop) else rest_time(columns, stop)
        if since is not None:
            lines.append(
                f"{REST:20} at t = {instant(since, span, 3)} on {stop}, "
                f"{_place(columns, system)}, pressed with "
                f"{column(columns, f'{stop}.force')[-1]:.4g} N"
            )
    lines += _stress(columns, mechanism, system.length)
    rests = any(line.startswith(REST) for line in lines)
    last = max((mark.time for mark in impacts), default=float(time[0]))
    return [*lines, _settled(columns, span, rests, last, _damped(values))] if moving else lines


def _in_impact(columns: Columns, stop: str) -> bool:
    """Return whether a result ends during an impact at a compliant stop, whose duration is 0."""
    counted = column(columns, f"{stop}.impact_count")[-1]
    return bool(counted and not column(columns, f"{stop}.contact_duration")[-1])


def _stress(columns: Columns, mechanism: Mechanism, size: float) -> list[str]:
    """Return lines about the largest stress of each flexure whose stress is an output.

    A stress that is larger after the first rigid impact than before has a second line.
    """
    time = column(columns, "time")
    span = float(time[-1] - time[0])
    lines = []
    hit = first_rigid_impact(columns, mechanism)
    for flexure in (mechanism.flexures[i] for i in stressed(mechanism)):
        peak, when, place = (
            float(column(columns, f"{flexure.name}.peak_stress{output}")[-1])
            for output in ("", "_time", "_position")
        )
        strength = mechanism.type_of(flexure).yield_strength
        at = f" at t = {instant(when, span, 5)}, {length(place, size)} from the start"
        if when > hit:
            before = peak_before(columns, flexure.name, hit)
            lines.append(f"{stress_text(flexure.name, before, strength)}, before the first impact")
            at += ", not reliable"
        lines.append(stress_text(flexure.name, peak, strength, at))
    return [*lines, UNRELIABLE] if lines and hit < math.inf else lines


def stress_text(flexure: str, peak: float, strength: float | None, at: str = "") -> str:
    """Return the largest stress of a flexure and its safety factor as text.

    Parameters
    ----------
    flexure : str
        Name of the flexure.
    peak : float
        The stress [Pa].
    strength : float or None
        Yield strength [Pa].
    at : str
        Phrase for time and place.

    Examples
    --------
    >>> stress_text("leaf", 1e8, 2.5e8, " at t = 2 s")
    'stress in leaf       100 MPa at t = 2 s, safety factor 2.5 (yield)'
    """
    factor = f", safety factor {strength / peak:.3g} (yield)" if strength and peak else ""
    return f"stress in {flexure:10} {1e-6 * peak:.4g} MPa{at}{factor}"


def _damped(values: Mapping[str, float]) -> bool:
    """Return whether a flexure, a joint or a spring is damped."""
    return any(x for name, x in values.items() if "damping" in name.split("."))


def _settled(columns: Columns, span: float, rests: bool, last: float, damped: bool) -> str:
    """Return the line about the end of the motion.

    Parameters
    ----------
    columns : structured array
        The result.
    span : float
        Duration of the run [s].
    rests : bool
        Whether a body rests on a stop.
    last : float
        Time of the last impact, or of the start [s].
    damped : bool
        Whether the mechanism has damping.
    """
    for name in (KINETIC, FREQUENCY):
        column(columns, name)  # Raises an error if it is missing.
    when = settling(columns)
    vibrates = bool(column(columns, FREQUENCY).any())
    estimate = settling_estimate(columns, last)
    expected = UNDAMPED if vibrates and not damped else _expected(estimate, vibrates)
    if math.isnan(when) and rests:
        return (
            "settled              not yet: a body rests on its stop, but the mechanism still "
            f"vibrates; {expected}"
        )
    if math.isnan(when):
        return f"settled              not yet, or too late to be certain; {expected}"
    share = f"{100 * SETTLED_ENERGY_RTOL:g} %"
    return (
        f"settled              at t = {instant(when, span, 3)}: the kinetic energy stays below "
        f"{share} of its largest value"
    )


def _expected(when: float, vibrates: bool) -> str:
    """Return the phrase about an estimated settling time [s], if the mechanism vibrates or not.

    Examples
    --------
    >>> print(_expected(3.456, True))
    by its present decay at about t = 3.5 s: simulate longer than that
    """
    if math.isnan(when):
        return "simulate longer" + "; prbm modes prints decay times" * vibrates
    if math.isinf(when):
        return "the energy does not fall: the damping is too small, or inputs drive the motion"
    factor, unit = (1.0, "s") if when >= SECONDS_MIN else time_unit(when)
    return (
        f"by its present decay at about t = {factor * when:.2g} {unit}: simulate longer than that"
    )


def _free(columns: Columns, system: System) -> list[str]:
    """Return the lines about the equilibrium without stops."""
    frequency = column(columns, FREQUENCY)[0]
    if frequency == 0.0:
        shape, balanced = resting(system)
        if not balanced:
            return ["fundamental          none: without stops, slow loading reaches no equilibrium"]
        found = modes(system, shape)
        if not len(found.frequency):
            return ["fundamental          none: all bodies fly freely"]
        if found.frequency[0] >= -found.rounding:
            return ["fundamental          none: without stops, a motion deforms no flexure"]
        weight = " under gravity" if system.gravity else ""
        return [f"fundamental          none: without stops, the equilibrium{weight} is unstable"]
    factor, hertz = frequency_unit(frequency)
    weight = "under gravity" if system.gravity else "without gravity"
    rest = _from_straight(free_displacement(system), system)
    return [
        f"fundamental          {factor * frequency:.4g} {hertz}",
        f"free rest position   {rest}, {weight}, without stops",
    ]


def _from_straight(amount: float, system: System) -> str:
    """Return a displacement [m] or rotation [rad] of the released body as text."""
    release = system.mechanism.release
    if release.turns:
        return f"{release.body} {round(math.degrees(amount), 2) + 0.0:.2f} deg from straight"
    along = "" if release.direction == 0.0 else f" along {release.direction:g} degrees"
    point = "" if release.point is None else " at the released point"
    return f"{release.body} {length(amount, system.length)} from straight{along}{point}"


def _place(columns: Columns, system: System) -> str:
    """Return the final position of the released body as text."""
    release = system.mechanism.release
    if release.turns:
        return _from_straight(float(column(columns, f"{release.body}.angle")[-1]), system)
    for name in displacement_outputs(release):
        column(columns, name)  # Raises an error if it is missing.
    moved = float(released_displacement(system, columns[-1:])[0])
    if release.direction == 0.0 and release.point is None:
        return f"{release.body}.x = {length(moved, system.length)}"
    return _from_straight(moved, system)
