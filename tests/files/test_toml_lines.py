"""Line numbers of TOML texts and lengths of keys are found in linear time."""

import pytest

from growth import grows
from prbm.files.toml_lines import key_length, lines

SIZE = 12_500  # Repetitions in the shorter text.
FACTOR = 8  # Ratio of the lengths: linear times are 8 times longer, quadratic ones 64 times.

TEXTS = {
    "blanks": lambda n: "a = 1\n" + " " * n,
    "blank lines": lambda n: "a = 1\n" + "\t\n" * n,
    "a comment": lambda n: "#" * n + "\na = 1",
    "signs in a string": lambda n: f"a = '{'= ' * n}'",
    "brackets in a string": lambda n: f'a = """{"[x]= " * n}"""',
    "a list": lambda n: "a = [" + "1, " * n + "]",
    "tables": lambda n: "[[b]]\n" * (n // 10) + "a.b = 1",
}


@pytest.mark.parametrize("kind", TEXTS)
def test_lines_of_long_texts_are_found_in_linear_time(kind):
    assert lines(TEXTS[kind](SIZE))
    assert not grows(lines, TEXTS[kind], SIZE, FACTOR, power=1)


@pytest.mark.parametrize(
    ("text", "length"),
    [
        ("a = 1.5", 2), ("a.b . 'c.d'.\"e\" = 1", 4), ("# a.b.c", 1), ("a = 'b.c.d'", 1),
        ("[a.b.c]\nd.e = { f.g.h.i = 1 }", 4),
    ],
)  # fmt: skip
def test_lengths_of_keys_are_found(text, length):
    assert key_length(text, 101) == length


LONG = {
    "parts of a key": (lambda n: '"a b".' * n + "c = 1", 101),
    "lines of a string": (lambda n: 'a = """' + "b.c\n" * n + '"""', 1),
    "quotes in a string": (lambda n: '"""\n' + '\\"""\n' * n, 1),
    "strings": (lambda n: "'''" * n, 1),
    "an unterminated string": (lambda n: '"' * (2 * (n // 2) + 1), 1),
    "signs": (lambda n: "=" * n, 1),
    "escaped quotes": (lambda n: '\\"' * n, 1),
}


@pytest.mark.parametrize("kind", LONG)
def test_lengths_of_keys_are_found_in_linear_time(kind):
    """Some texts are invalid TOML: the length of keys is limited before a text is parsed."""
    text, length = LONG[kind]
    assert key_length(text(SIZE), 101) == length
    assert not grows(lambda given: key_length(given, 101), text, SIZE, FACTOR, power=1)
