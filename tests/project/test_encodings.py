"""Texts are read and written with a named encoding, independently of the locale."""

import ast

import pytest

from support import ROOT

FOLDERS = ("benchmarks", "docs", "examples", "fmu_src", "tests")
TEXT_ARGUMENTS = {"read_text": 0, "write_text": 1}
"""Number of the positional argument that is the encoding, by method."""


def without_encoding(source: str) -> list[int]:
    """Return the lines of calls that read or write a text in the encoding of the locale.

    The encoding of processes is that of the locale.
    """
    return [
        node.lineno
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.Call)
        and not {"encoding", None} & {keyword.arg for keyword in node.keywords}
        and (reads_text(node) or opens_text(node))
    ]


def name_of(node: ast.Call) -> str:
    """Return the name of a function or method without its object."""
    return node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")


def reads_text(node: ast.Call) -> bool:
    """Return whether a call of a method of a path has no encoding."""
    return len(node.args) <= TEXT_ARGUMENTS.get(name_of(node), -1)


def opens_text(node: ast.Call) -> bool:
    """Return whether a call opens a file as a text: with a mode, all of it letters of a text."""
    if name_of(node) not in {"open", "fdopen"}:
        return False
    values = [*node.args, *(keyword.value for keyword in node.keywords if keyword.arg == "mode")]
    texts = [x.value for x in values if isinstance(x, ast.Constant) and isinstance(x.value, str)]
    modes = [text for text in texts if text and set(text) <= set("rwaxbt+")]
    builtin = isinstance(node.func, ast.Name) or name_of(node) == "fdopen"
    return (builtin or bool(modes)) and not any("b" in mode for mode in modes)


@pytest.mark.parametrize("folder", FOLDERS)
def test_every_text_has_an_encoding(folder):
    paths = [*(ROOT / folder).rglob("*.py")]
    assert paths
    found = {
        f"{path.relative_to(ROOT)}:{line}"
        for path in paths
        for line in without_encoding(path.read_text(encoding="utf-8"))
    }
    assert found == set()


@pytest.mark.parametrize(
    ("source", "count"),
    [
        ("path.read_text()", 1), ("path.read_text('utf-8')", 0), ("path.write_text(x)", 1),
        ("path.write_text(x, encoding='utf-8')", 0), ("open(path)", 1), ("open(path, 'rb')", 0),
        ("path.open('a')", 1), ("path.open(mode='ab')", 0), ("os.fdopen(1)", 1),
        ("browser.open(page)", 0), ("f(**options); open(p, **options)", 0),
    ],
)  # fmt: skip
def test_calls_without_an_encoding_are_found(source, count):
    assert len(without_encoding(source)) == count
