"""The table of the impacts of a run, a row for each, as a file or as a data frame has it."""

from collections.abc import Sequence

from ..hybrid.records import Impact
from ..mechanism.description import Mechanism

UNITS = {
    "number": "", "stop": "", "time": "s", "approach_speed": "m/s", "rebound_speed": "m/s",
    "impulse": "N.s", "energy_lost": "J", "modal_restitution": "",
}  # fmt: skip
"""SI units by column, empty if dimensionless."""
CONTACT_UNITS = {"peak_force": "N", "indentation": "m", "contact_duration": "s"}
"""Units of the further columns of mechanisms with compliant stops."""
TEXTS = ("number", "stop")  # Columns without a unit in the head of a file.


def impact_table(
    mechanism: Mechanism, impacts: Sequence[Impact]
) -> tuple[dict[str, str], list[list[object]]]:
    """Return the units of the columns by name, and a row for each impact.

    If the mechanism has compliant stops, the last three cells of impacts at rigid stops are None.

    Parameters
    ----------
    mechanism : Mechanism
        The mechanism that was simulated.
    impacts : sequence of Impact
        Its impacts.

    Returns
    -------
    units : dict
        SI unit of each column; empty if it has none.
    rows : list
        The cells of each impact.
    """
    compliant = {stop.name for stop in mechanism.stops if stop.compliant}
    units = UNITS | (CONTACT_UNITS if compliant else {})
    rows: list[list[object]] = []
    for number, impact in enumerate(impacts, start=1):
        own: dict[str, object] = {"number": number, "stop": impact.stop, "time": impact.time}
        lacking = {} if impact.stop in compliant else dict.fromkeys(CONTACT_UNITS)
        cells = {**vars(impact.latched), **own, **lacking}
        rows.append([cells[name] for name in units])
    return units, rows


def heads(units: dict[str, str]) -> list[str]:
    """Return the heads of the columns of a file, with their units.

    Examples
    --------
    >>> heads({"stop": "", "approach_speed": "m/s", "modal_restitution": ""})
    ['stop', 'approach speed [m/s]', 'modal restitution [-]']
    """
    return [
        name if name in TEXTS else f"{name.replace('_', ' ')} [{unit or '-'}]"
        for name, unit in units.items()
    ]
