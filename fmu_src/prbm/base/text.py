"""Text without control characters."""


def printable(text: str) -> str:
    r"""Return a text with blanks for the characters that XML and HTML cannot hold.

    Examples
    --------
    >>> printable("a bell\a rings")
    'a bell  rings'
    """
    return "".join(c if c.isprintable() else " " for c in text)
