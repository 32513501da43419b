"""The time of every regular expression of the package is at most quadratic in its text.

The time to match a whole text is linear in it: a cell of a table may be long.
"""

import ast
import builtins
import importlib
import itertools
import re
import signal
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import pytest

from growth import duration, grows
from support import ROOT

PACKAGE = ROOT / "fmu_src"
FUNCTIONS = {
    "compile",
    "match",
    "fullmatch",
    "search",
    "sub",
    "subn",
    "findall",
    "finditer",
    "split",
}
CLASSES = {r"\s": " ", r"\d": "1", r"\w": "a", r"\S": "a", r"\D": "a", r"\W": " ", ".": "a"}
LENGTH = 100  # Repetitions in the shorter text,
LINEAR_LENGTH = 2000  # and in that of linear times, which takes longer than the limit if quadratic.
FACTOR = 4  # Ratio of the lengths: times are 16 times longer if quadratic, 64 times if cubic.
COMPARED_TIME_MIN = 1e-3  # s; a cubic expression needs longer for the shorter text.
TIMEOUT = 5.0  # s of processor time for one text; exponential times are longer than any limit.


class _Names(dict):
    """Names of a module, with "x" for the local names of a function."""

    def __missing__(self, name: str) -> object:
        return getattr(builtins, name, "x")


def expressions() -> Iterator[tuple[str, re.Pattern]]:
    """Yield the file and line of each call of :mod:`re` with its compiled pattern."""
    for path in sorted((PACKAGE / "prbm").rglob("*.py")):
        source = path.read_text("utf-8")
        if not re.search(r"\bre\.[a-z]+\(", source):
            continue
        for node in ast.walk(ast.parse(source)):
            if not (
                isinstance(node, ast.Call)
                and isinstance(node.func, ast.Attribute)
                and isinstance(node.func.value, ast.Name)
                and node.func.value.id == "re"
                and node.func.attr in FUNCTIONS
            ):
                continue
            names = _Names(vars(_module(path)))
            values = [node.args[0], *(node.args[1:] if node.func.attr == "compile" else ())]
            if node.func.attr != "compile":
                values += [key.value for key in node.keywords if key.arg == "flags"]
            evaluated = [
                eval(compile(ast.Expression(value), str(path), "eval"), {}, names)
                for value in values
            ]
            yield f"{path.relative_to(PACKAGE)}:{node.lineno}", re.compile(*evaluated)


def _module(path: Path) -> object:
    parts = path.relative_to(PACKAGE).with_suffix("").parts
    return importlib.import_module(".".join(p for p in parts if p != "__init__"))


FOUND = [*expressions()]
EXPRESSIONS = dict(FOUND)


def test_all_calls_of_the_module_re_are_found():
    calls = sum(
        len(re.findall(rf"\bre\.(?:{'|'.join(FUNCTIONS)})\(", path.read_text("utf-8")))
        for path in (PACKAGE / "prbm").rglob("*.py")
    )
    assert len(FOUND) == calls > 30


def pumps(pattern: str) -> Iterator[Callable[[int], str]]:
    """Yield functions of n that return texts, which do not match at the end.

    The texts repeat one or two characters of a pattern n times.
    """
    letters = {c for c in re.sub(r"\\.", "", pattern, flags=re.DOTALL) if c.isprintable()}
    letters |= {letter for name, letter in CLASSES.items() if name in pattern}
    letters = sorted(letters - set("?*+^|{}") | set(re.findall(r"\\([^\w\s])", pattern)))[:10]
    repeated = [*letters, *("".join(pair) for pair in itertools.permutations(letters, 2))]
    for prefix, pump in itertools.product(("", *letters), repeated):
        yield partial(_pumped, prefix, pump)


def _pumped(prefix: str, pump: str, n: int) -> str:
    return prefix + pump * n + "\0"


def _timeout(*_: object) -> None:
    raise AssertionError(f"a text of {LENGTH} repetitions takes more than {TIMEOUT:g} s")


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="no timer on this platform")
@pytest.mark.parametrize("place", EXPRESSIONS)
def test_no_regular_expression_takes_long(place):
    expression = EXPRESSIONS[place]
    previous = signal.signal(signal.SIGVTALRM, _timeout)
    try:
        for pump in pumps(expression.pattern):
            for call in (expression.search, expression.fullmatch):
                signal.setitimer(signal.ITIMER_VIRTUAL, TIMEOUT)
                if duration(call, pump(LENGTH)) > COMPARED_TIME_MIN:
                    assert not grows(call, pump, LENGTH, FACTOR, power=2), pump(2)
            signal.setitimer(signal.ITIMER_VIRTUAL, TIMEOUT)
            if duration(expression.fullmatch, pump(LINEAR_LENGTH)) > COMPARED_TIME_MIN:
                call = expression.fullmatch
                assert not grows(call, pump, LINEAR_LENGTH, FACTOR, power=1), pump(2)
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)
        signal.signal(signal.SIGVTALRM, previous)


@pytest.mark.slow
def test_quadratic_cubic_and_exponential_time_are_detected():
    """Three such expressions are added to the list for the duration of this test."""
    EXPRESSIONS["quadratic"] = re.compile(r"\d+\.?\d*")
    EXPRESSIONS["cubic"] = re.compile(r"\s*((?:'[^']*'|[^='#])+?)\s*=")
    EXPRESSIONS["exponential"] = re.compile(r"(a+)+b")
    try:
        for place in ("quadratic", "cubic", "exponential"):
            with pytest.raises(AssertionError):
                test_no_regular_expression_takes_long(place)
    finally:
        del EXPRESSIONS["quadratic"], EXPRESSIONS["cubic"], EXPRESSIONS["exponential"]
