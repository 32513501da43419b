"""Text without control characters."""


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
