"""What flexures that do not stretch hide of an impact off the centre of mass.

Such an impact turns the body that hits.  Flexures that cannot stretch may leave it a single way to
move, turning or not, and then it rebounds as if it had been hit there and nowhere else; those that
stretch give way.  Whether that matters is found by looking: :func:`note` compares the modal
restitution of the mechanism as it is with that of the same one with ``axial = true``.
"""

from collections.abc import Mapping
from dataclasses import replace

from ..base.errors import PrbmError
from ..mechanics.assembly import assemble
from ..mechanics.modal import modal_restitution
from ..mechanism.description import Mechanism
from ..mechanism.parts import value
from .touching import impact_shape, lever

OFF_CENTRE = 0.01  # of the size: a lever of the impact that is told of
MATTERS = 0.02  # modal restitution: less of a difference is not told


def stretching(mechanism: Mechanism) -> Mechanism:
    """Return a mechanism with flexures that stretch, their models the same."""
    kinds = tuple(replace(kind, axial=True) for kind in mechanism.flexure_types)
    return replace(mechanism, flexure_types=kinds)


def restitution(mechanism: Mechanism, values: Mapping[str, float], stop: int) -> float:
    """Return the modal restitution of a pure fundamental mode at a stop where it is [-].

    Raises
    ------
    EquilibriumError
        If a force on the released body does not bring it there.
    """
    system = assemble(mechanism, mechanism.values(values))
    s = mechanism.stops[stop]
    shape = impact_shape(system, stop, value(s, "position", system.values))
    return modal_restitution(system, shape, stop, value(s, "restitution", system.values))


def note(mechanism: Mechanism, values: Mapping[str, float], stop: int) -> str | None:
    """Return a sentence if a stop is off the centre of mass and stretching would matter there.

    Parameters
    ----------
    mechanism : Mechanism
        Any.
    values : mapping
        Parameters that differ from their defaults.
    stop : int
        Which stop.

    Returns
    -------
    str or None
        None too if a flexure stretches already, or a force cannot bring the body to the stop.
    """
    if not mechanism.flexures or any(kind.axial for kind in mechanism.flexure_types):
        return None
    system = assemble(mechanism, mechanism.values(values))
    off, s = lever(system, stop), mechanism.stops[stop]
    if abs(off) <= OFF_CENTRE * system.length:
        return None
    try:
        as_it_is = restitution(mechanism, values, stop)
        stretched = restitution(stretching(mechanism), values, stop)
    except PrbmError:
        return None
    if not abs(as_it_is - stretched) > MATTERS:  # or not a number
        return None
    place = value(s, "position", system.values)
    return (
        f"{s.name} hits {1e3 * abs(off):.3g} mm off the centre of mass of {s.body}, and no "
        f"flexure stretches: with the wall at {1e3 * place:.3g} mm the modal restitution is "
        f"{as_it_is:.3f}, and would be {stretched:.3f} if they did (axial = true)"
    )


def notes(mechanism: Mechanism, values: Mapping[str, float]) -> list[str]:
    """Return the notes of all stops; parameters as :func:`note` has them."""
    found = (note(mechanism, values, stop) for stop in range(len(mechanism.stops)))
    return [f"note: {sentence}" for sentence in found if sentence is not None]
