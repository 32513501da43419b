"""Sentences about unknown names."""

from collections.abc import Mapping

SIMILARITY_MIN = 0.5  # of difflib, from 0 to 1, for a name to be proposed


def unknown(name: str, known: Mapping[str, object]) -> str:
    """Return a sentence about an unknown variable that proposes the nearest names.

    Examples
    --------
    >>> unknown("stop.restitutoin", {"stop.restitution": 0.6, "gravity.x": 0.0})
    "there is no variable 'stop.restitutoin'; did you mean stop.restitution?"
    """
    return f"there is no variable {name!r}; {proposal(name, known)}"


def proposal(name: str, known: Mapping[str, object]) -> str:
    """Return a clause that proposes the known names nearest to a name, or lists all of them.

    Examples
    --------
    >>> proposal("mass", {"length": 0, "width": 0})
    'known are length, width'
    """
    import difflib  # here, because few runs need it

    near = difflib.get_close_matches(name, known, n=3, cutoff=SIMILARITY_MIN)
    return f"did you mean {' or '.join(near)}?" if near else f"known are {', '.join(known)}"
