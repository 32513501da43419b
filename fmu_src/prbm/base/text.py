"""Text without control characters, and numbers with a decimal comma."""

import re

_COMMA = re.compile(r"(?<=\d),(?=\d)")


def printable(text: str) -> str:
    r"""Return a text with blanks in place of the characters that XML and HTML cannot contain.

    Examples
    --------
    >>> printable("a bell\a rings")
    'a bell  rings'
    """
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() else " " for c in text)


def comma_advice(text: str) -> str:
    """Return the remedy for a number with a comma, an empty text if there is none.

    Examples
    --------
    >>> comma_advice("0,2 mm"), comma_advice("0.2 mm")
    ('write a decimal point instead of the comma: 0.2 mm', '')
    >>> comma_advice("1,234.5 mm")
    'write one decimal point, and no commas in numbers'
    """
    if not _COMMA.search(text):
        return ""
    pointed = _COMMA.sub(".", text)
    if re.search(r"\d\.\d+\.\d", pointed):
        return "write one decimal point, and no commas in numbers"
    return f"write a decimal point instead of the comma: {pointed}"
