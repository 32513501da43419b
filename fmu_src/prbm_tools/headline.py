"""What a result says, line by line: frequency, place of rest, impacts, rest on a stop."""

from collections.abc import Mapping

from prbm import Mechanism, assemble, free_displacement
from prbm.assembly import unit

from .motion import marks
from .simulate import Columns, column, rest_time

FREQUENCY = "mode.frequency"


def millimetres(x: float) -> str:
    """Return a length in mm to a hundredth, without a negative zero.

    Examples
    --------
    >>> millimetres(-1.8e-3), millimetres(-1e-9)
    ('-1.80 mm', '0.00 mm')
    """
    return f"{round(1e3 * x, 2) + 0.0:.2f} mm"


def told(columns: Columns, mechanism: Mechanism, values: Mapping[str, float]) -> list[str]:
    """Return what happened, line by line.

    Parameters
    ----------
    columns : structured array
        Of :func:`prbm_tools.simulate.simulate`, or of FMPy, with all outputs.
    mechanism : Mechanism
        What moved.
    values : mapping
        Its parameters and inputs at the start.

    Raises
    ------
    ResultError
        If a column is missing.
    """
    lines = _free(columns, mechanism, values)
    seen = marks(columns, mechanism)
    for i, stop in enumerate(s.name for s in mechanism.stops):
        count = int(column(columns, f"{stop}.impact_count")[-1])
        first = next((mark for mark in seen if mark.stop == i), None)
        more = ""
        if first is not None:
            which = "the first" if first.count == 1 else f"number {first.count}"
            more = f", {which} at t = {first.time:.5f} s with {first.speed:.3f} m/s"
        lines.append(f"impacts at {stop:9} {count}{more}")
        since = rest_time(columns, stop)
        if since is not None:
            lines.append(
                f"came to rest         at t = {since:.3f} s on {stop}, "
                f"{_place(columns, mechanism)}, pressed with "
                f"{column(columns, f'{stop}.force')[-1]:.4g} N"
            )
    return lines


def _free(columns: Columns, mechanism: Mechanism, values: Mapping[str, float]) -> list[str]:
    """Tell about the equilibrium without stops, if it is one that lasts."""
    frequency = column(columns, FREQUENCY)[0]
    if frequency == 0.0:
        return [
            "fundamental          none: without stops, the equilibrium under gravity is unstable"
        ]
    parameters = {p.name for p in mechanism.parameters}
    own = {name: x for name, x in values.items() if name in parameters}
    rest = free_displacement(assemble(mechanism, own))
    release = mechanism.release
    return [
        f"fundamental          {frequency:.4g} Hz",
        f"free rest position   {release.body} {millimetres(rest)} from straight"
        f"{_along(release.direction)}, under gravity, without stops",
    ]


def _along(direction: float) -> str:
    return "" if direction == 0.0 else f" along {direction:g} degrees"


def _place(columns: Columns, mechanism: Mechanism) -> str:
    """Tell where the released body is at the end."""
    body, direction = mechanism.release.body, mechanism.release.direction
    x, y = (float(column(columns, f"{body}.{axis}")[-1]) for axis in "xy")
    u = unit(direction)
    if direction == 0.0:
        return f"{body}.x = {millimetres(x)}"
    return f"{body} {millimetres(x * u.real + y * u.imag)} from straight{_along(direction)}"
