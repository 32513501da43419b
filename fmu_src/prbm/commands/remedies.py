"""Error messages of the library, with their remedies as options of the command line."""

import re

REMEDIES = (  # arguments of Python functions, and the options in their place
    (re.compile(r"units=\{'([^']*)': '([^']*)'\}"), r'--unit "\1=\2"'),
    (re.compile(r"columns=\[\.\.\.\]"), "--columns"),
    (re.compile(r"columns=\[([^\]]*\][^\]]*\][^\]]*)\]"), r"--columns \1"),
    (re.compile(r"(?<=\[s\]\"), (?=\"x)"), " "),
    (re.compile(r"\(Series\.between\)"), "(--from, --to)"),
    (re.compile(r"give Free\('([^']*)', lower, upper\)"), r"give --free \1=LOW:HIGH"),
    (re.compile(r"fit_range = "), "--fit-range "),
)  # fmt: skip


def in_options(sentence: str) -> str:
    r"""Return a sentence of the library with its remedies as options of the command.

    Examples
    --------
    >>> in_options("the column 'x' has no unit: give it, units={'x': 'm'}")
    'the column \'x\' has no unit: give it, --unit "x=m"'
    >>> in_options('write a head, or give columns=["t [s]", "x [mm]"] and the like')
    'write a head, or give --columns "t [s]" "x [mm]" and the like'
    """
    for pattern, words in REMEDIES:
        sentence = pattern.sub(words, sentence)
    return sentence
