"""Random changes of valid texts, for tests of readers."""

import re

FRAGMENTS = (
    "", " ", "\t", "\n", "\r", "\0", "\x1a", "\ufeff", "\u2028", "\u0663", "\U0001f600", "é", "µ",
    "=", "[", "]", "[[", "]]", "{", "}", "(", ")", '"', "'", '"""', "\\", "#", ".", ",", ";", "*",
    "/", "**", "^", "-", "+", "e", "e9", "1e999", "9" * 5000, "0", "1", "nan", "inf", "true", "m)",
    "( m", "m**-", "furlong", "degC2", "km99", "m*" * 300, "name", "body", "stops", "1979-05-27",
    "***End_of_Header***", "X_Columns\t", "Channels\t-1", "Decimal_Separator\t;", "LabVIEW", "No",
    "<", ">", "</", "<!--", "&", "&lt;", "<!DOCTYPE x>", "xmlns", "NaN", "-1e300", " " * 3000,
)  # fmt: skip
"""Texts that a change inserts."""

CHANGES = 5
REMOVED_MAX = 20  # Pieces that a change removes.

_PIECES = re.compile(r"\w+|\s|.", re.DOTALL)


def pieces_of(text: str) -> list[str]:
    """Return the words, blanks and other characters of a text."""
    return _PIECES.findall(text)


def change(pieces: list[str], kind: int, i: int, j: int, count: int, fragment: str) -> None:
    """Insert, replace, remove, repeat or exchange pieces in place.

    Parameters
    ----------
    pieces : list of str
        Pieces of a text.
    kind : int
        Kind of the change, from 0 to ``CHANGES`` - 1.
    i, j : int
        Indices of pieces.
    count : int
        Number of pieces to remove.
    fragment : str
        Text to insert.
    """
    if kind == 0:
        pieces[i:i] = [fragment]
    elif kind == 1:
        pieces[i : i + 1] = [fragment]
    elif kind == 2:
        pieces[i : i + count] = []
    elif kind == 3:
        pieces[i:i] = pieces[j : j + 5]
    elif pieces:
        pieces[i], pieces[j] = pieces[j], pieces[i]
