"""The first impacts of a run as text, line by line."""

from ..base.unit_text import prefixed_unit
from ..hybrid.records import Impact
from .headline import instant, speed_text
from .marks import SPEED_RTOL
from .result import Result

HITS_MAX = 5  # Impacts of one run in a summary.


def hits(result: Result) -> list[str]:
    """Return a line for each of the first impacts, and one about the rest.

    An impact at a rigid stop has its impulse; one at a compliant stop its peak force, indentation
    and duration.
    """
    span = float(result["time"][-1] - result["time"][0])
    compliant = {stop.name for stop in result.mechanism.stops if stop.compliant}
    lines = []
    for number, impact in enumerate(result.impacts[:HITS_MAX], start=1):
        closing, opening = impact.latched.approach_speed, impact.latched.rebound_speed
        after = speed_text(opening) if opening > SPEED_RTOL * closing else "rest"
        speeds = f"{speed_text(closing)} to {after}"
        text = f"{instant(impact.time, span, 5)}, {speeds}, {_load(impact, compliant)}"
        lines.append(f"impact {number:<14}{impact.stop}: {text}")
    more = len(result.impacts) - HITS_MAX
    return [*lines, f"{'more impacts':21}{more}"] if more > 0 else lines


def _load(impact: Impact, compliant: set[str]) -> str:
    """Return the impulse of an impact; force, indentation and duration at a compliant stop."""
    latched = impact.latched
    if impact.stop not in compliant:
        return _quantity(latched.impulse, "N s")
    force = _quantity(latched.peak_force, "N", 4)
    depth, duration = _quantity(latched.indentation, "m"), _quantity(latched.contact_duration, "s")
    return f"{force}, indentation {depth}, contact {duration}"


def _quantity(x: float, si: str, digits: int = 3) -> str:
    """Return a value in SI with a number of digits and a prefix."""
    factor, unit = prefixed_unit(x, si)
    return f"{factor * x:.{digits}g} {unit}"
