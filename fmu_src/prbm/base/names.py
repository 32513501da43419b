"""Messages about unknown names."""

from collections.abc import Mapping

SIMILARITY_MIN = 0.5  # Ratio of difflib, from 0 to 1, above which a name is proposed.


def unknown(name: str, known: Mapping[str, object]) -> str:
    """Return a message about an unknown variable that proposes similar names.

    Examples
    --------
    >>> unknown("stop.restitutoin", {"stop.restitution": 0.6, "gravity.x": 0.0})
    "unknown variable 'stop.restitutoin'; did you mean stop.restitution?"
    """
    return f"unknown variable {name!r}; {proposal(name, known)}"


def proposal(name: str, known: Mapping[str, object]) -> str:
    """Return a clause that proposes similar names, or lists all names if none is similar.

    Examples
    --------
    >>> proposal("mass", {"length": 0, "width": 0})
    'known names are length, width'
    """
    import difflib  # imported here because few runs need it

    near = difflib.get_close_matches(name, known, n=3, cutoff=SIMILARITY_MIN)
    every = ", ".join(known) or "none"
    return f"did you mean {' or '.join(near)}?" if near else f"known names are {every}"
