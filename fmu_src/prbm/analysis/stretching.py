"""The effect of stretching flexures on an impact off the centre of mass.

Such an impact turns the body.  Inextensible flexures may leave the body a single degree of freedom,
with or without rotation, and the rebound then does not depend on the place of the hit.  Stretching
flexures permit the rotation.  :func:`note` compares the modal restitution of the mechanism with
that of the same mechanism with ``axial = true``.  Both follow Newton's law of a rigid impact; the
effect is smaller, or absent, for a contact that lasts as long as a period of the excited modes.
"""

from collections.abc import Mapping
from dataclasses import replace

from ..base.errors import PrbmError
from ..mechanics.assembly import assemble
from ..mechanics.modal import modal_restitution
from ..mechanism.description import Mechanism
from ..mechanism.parts import value
from .touching import impact_shape, lever

LEVER_MIN = 0.01  # Least lever of an impact in a note, as a share of the size.
DIFFERENCE_MIN = 0.02  # Least difference of the modal restitution in a note.


def stretching(mechanism: Mechanism) -> Mechanism:
    """Return a mechanism with axial flexures and the same models of bending."""
    kinds = tuple(replace(kind, axial=True) for kind in mechanism.flexure_types)
    return replace(mechanism, flexure_types=kinds)


def restitution(mechanism: Mechanism, values: Mapping[str, float], stop: int) -> float:
    """Return the modal restitution of a pure fundamental mode at a stop [-].

    Raises
    ------
    EquilibriumError
        If no force on the released body reaches the stop.
    """
    system = assemble(mechanism, mechanism.values(values))
    s = mechanism.stops[stop]
    shape = impact_shape(system, stop, value(s, "position", system.values))
    return modal_restitution(system, shape, stop, value(s, "restitution", system.values))


def note(mechanism: Mechanism, values: Mapping[str, float], stop: int) -> str | None:
    """Return a note if a stop hits off the centre of mass and stretching changes the impact.

    Parameters
    ----------
    mechanism : Mechanism
        The mechanism.
    values : mapping
        Parameters that differ from their defaults.
    stop : int
        Index of the stop.

    Returns
    -------
    str or None
        None without such an effect, or if a flexure is axial already or no force reaches the stop.
    """
    if not mechanism.flexures or any(kind.axial for kind in mechanism.flexure_types):
        return None
    system = assemble(mechanism, mechanism.values(values))
    off, s = lever(system, stop), mechanism.stops[stop]
    if abs(off) <= LEVER_MIN * system.length:
        return None
    try:
        inextensible = restitution(mechanism, values, stop)
        stretched = restitution(stretching(mechanism), values, stop)
    except PrbmError:
        return None
    if not abs(inextensible - stretched) > DIFFERENCE_MIN:  # Or one of them is NaN.
        return None
    place = value(s, "position", system.values)
    return (
        f"{s.name} hits {1e3 * abs(off):.3g} mm off the centre of mass of {s.body}; with the wall "
        f"at {1e3 * place:.3g} mm the modal restitution of a rigid impact is {inextensible:.3f} "
        f"with inextensible flexures and {stretched:.3f} with stretching ones (axial = true)"
    )


def notes(mechanism: Mechanism, values: Mapping[str, float]) -> list[str]:
    """Return the notes of all stops; parameters as for :func:`note`."""
    found = (note(mechanism, values, stop) for stop in range(len(mechanism.stops)))
    return [f"note: {sentence}" for sentence in found if sentence is not None]
