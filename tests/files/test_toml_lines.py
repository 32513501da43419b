"""Line numbers of TOML texts and lengths of keys are found in linear time."""

import time

import pytest

from prbm.files.toml_lines import key_length, lines


@pytest.mark.parametrize(
    "text",
    [
        "a = 1\n" + " " * 100_000,
        "a = 1\n" + "\t\n" * 100_000,
        "#" * 100_000 + "\na = 1",
        f"a = '{'= ' * 100_000}'",
        f'a = """{"[x]= " * 100_000}"""',
        "a = [" + "1, " * 100_000 + "]",
        "[[b]]\n" * 20_000 + "a.b = 1",
    ],
)
def test_lines_of_long_texts_are_found_in_a_second(text):
    begin = time.process_time()
    assert lines(text)
    assert time.process_time() - begin < 1.0


@pytest.mark.parametrize(
    ("text", "length"),
    [
        ("a = 1.5", 2), ("a.b . 'c.d'.\"e\" = 1", 4), ("# a.b.c", 1), ("a = 'b.c.d'", 1),
        ("[a.b.c]\nd.e = { f.g.h.i = 1 }", 4), ('"a b".' * 50_000 + "c = 1", 101),
        ('a = """' + 'b.c\n' * 50_000 + '"""', 1), ('"""\n' + '\\"""\n' * 50_000, 1),
        ("'''" * 50_000, 1), ('"' * 50_001, 1), ("=" * 50_000, 1), ('\\"' * 50_000, 1),
    ],
)  # fmt: skip
def test_lengths_of_keys_are_found_in_a_second(text, length):
    """Some texts are invalid TOML: the length of keys is limited before a text is parsed."""
    begin = time.process_time()
    assert key_length(text, 101) == length
    assert time.process_time() - begin < 1.0
