"""Sentences about unknown names."""

from collections.abc import Mapping


def unknown(name: str, known: Mapping[str, object]) -> str:
    """Return a sentence about an unknown name that proposes the nearest ones."""
    return f"there is no variable {name!r}; {proposal(name, known)}"


def proposal(name: str, known: Mapping[str, object]) -> str:
    """Return the known names that are nearest to a name, or all, as half a sentence."""
    import difflib

    near = difflib.get_close_matches(name, known, n=3, cutoff=0.5)
    return f"did you mean {' or '.join(near)}?" if near else f"known are {', '.join(known)}"
