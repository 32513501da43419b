"""Parts that a computation does not support, and their rejection by name."""

from collections.abc import Iterator

from ..base.errors import MechanismError
from .description import Mechanism

COMPLIANT_STOPS, FREE_BODIES, SPRINGS = "compliant stops", "free bodies", "springs"


def check_supported(mechanism: Mechanism, use: str, *refused: str) -> None:
    """Reject a mechanism with parts that a computation does not support.

    Parameters
    ----------
    mechanism : Mechanism
        Mechanism.
    use : str
        The computation, with an article.
    refused : str
        Kinds of parts: :data:`COMPLIANT_STOPS`, :data:`FREE_BODIES` or :data:`SPRINGS`, which
        includes guides.

    Raises
    ------
    MechanismError
        If the mechanism has such parts.
    """
    for kind in refused:
        for problem in _PROBLEMS[kind](mechanism, use):
            raise MechanismError(f"{problem}, or simulate the mechanism")


def _compliant(mechanism: Mechanism, use: str) -> Iterator[str]:
    for stop in mechanism.stops:
        if stop.compliant:
            yield (
                f'{stop.name}.law = "{stop.law}": {use} has rigid impacts only; choose the law '
                "rigid"
            )


def _free(mechanism: Mechanism, use: str) -> Iterator[str]:
    if mechanism.free_bodies:
        yield (
            f"{use} has no bodies that fly freely: no flexures, joints, springs or guides connect "
            f"{', '.join(mechanism.free_bodies)} to the ground; connect them"
        )


def _sprung(mechanism: Mechanism, use: str) -> Iterator[str]:
    for kind, parts in (("springs", mechanism.springs), ("guides", mechanism.guides)):
        if parts:
            yield f"{use} has no {kind}: remove {', '.join(part.name for part in parts)}"


_PROBLEMS = {COMPLIANT_STOPS: _compliant, FREE_BODIES: _free, SPRINGS: _sprung}
