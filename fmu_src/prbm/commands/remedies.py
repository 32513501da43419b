"""Conversion of the remedies in error messages from Python arguments to options."""

import re

REMEDIES = (  # Arguments of Python functions, and the corresponding options.
    (re.compile(r"units=\{'([^']*)': '([^']*)'\}"), r'--unit "\1=\2"'),
    (re.compile(r"columns=\[\.\.\.\]"), "--columns"),
    (re.compile(r"columns=\[([^\]]*\][^\]]*\][^\]]*)\]"), r"--columns \1"),
    (re.compile(r"(?<=\[s\]\"), (?=\"x)"), " "),
    (re.compile(r"\(Series\.between\)"), "(--from, --to)"),
    (re.compile(r"give Free\('([^']*)', lower, upper\)"), r"give --free \1=LOW:HIGH"),
    (re.compile(r"fit_range = "), "--fit-range "),
)  # fmt: skip


def in_options(sentence: str) -> str:
    r"""Return an error message with options in place of Python arguments.

    Examples
    --------
    >>> in_options("the column 'x' has no unit: give it, units={'x': 'm'}")
    'the column \'x\' has no unit: give it, --unit "x=m"'
    >>> in_options('write a head, or give columns=["t [s]", "x [mm]"] and the like')
    'write a head, or give --columns "t [s]" "x [mm]" and the like'
    """
    for pattern, option in REMEDIES:
        sentence = pattern.sub(option, sentence)
    return sentence
