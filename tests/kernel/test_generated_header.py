"""The constants of the C kernel are generated from those of the Python package."""

import ast
import re
from ctypes import c_double
from functools import cache

import numpy as np
import pytest

from kernel_library import KERNEL, compiled, constants
from prbm.base import tolerances
from prbm.hybrid.runge_kutta import TSITOURAS_PAPAKOSTAS, powers
from prbm.interface import tables
from prbm.kernel import header

PLAIN = {"0.0", "0.25", "0.5", "1.0", "2.0", "3.0", "4.0", "6.0"}  # Coefficients of formulas.
PLAIN_INTEGER = 16
WHOLE_FILES = {
    "generated.h": "it is generated",
    "core/numbers.c": "coefficients of series, and parts of pi and ln 2",
}
ALLOWED = {
    "core/beam.c": {"0.75": "first approximation of the zeros of Legendre polynomials"},
    "core/collection.c": {
        "0.21132486540518708": "1/2 - 1/(2 sqrt 3): points of a rod with its mass and moments",
        "0.7886751345948129": "1/2 + 1/(2 sqrt 3): the second of these points",
    },
    "core/factors.c": {
        "1e-280": "smallest product of pivots that doubles hold with all digits, with a margin",
        "1e280": "largest product of pivots, with a margin",
    },
    "core/matrix.c": {"60": "sweeps of Jacobi's rotations, for which Python calls NumPy"},
    "core/memory.h": {"640": "length of a message"},
    "core/modal.c": {"6.283185307179586": "2 pi"},
    "core/profile.h": {"3.141592653589793": "pi"},
    "core/reader.c": {"32": "bits of a word, and bytes by which a block may be rounded up"},
    "core/tables.c": {
        "40": "bytes of memory for a coordinate", "32": "bits of a word",
        "38": "smallest number of bytes of a parameter",
    },
    "fmi/fmu.h": {"31": "all bits of the categories"},
    "fmi/journal.c": {"2048": "length of a message"},
    "fmi/resources.c": {
        "64": "kB a block", "248": "length of paths on Windows", "1024": "bytes a kB",
    },
    "hybrid/state.h": {"6.283185307179586": "2 pi", "32": "flag", "64": "flag", "128": "flag"},
    "hybrid/guards.c": {"4.5e-16": "spacing of doubles, by R. P. Brent"},
    "hybrid/contact_modes.c": {"53": "binary digits of doubles"},
    "hybrid/simulation.c": {"60": "working memory", "64": "working memory"},
    "model_exchange.c": {"10.0": "base of powers of ten"},
    "dependents.c": {"80": "length of a name"},
    "engine.c": {"30": "coordinates", "50": "integration steps of a call of this library"},
    "hybrid/snapshot.c": {"26": "scalars of the state"},
    "fmi/state.c": {
        "20": "offset", "24": "offset", "28": "offset",
        "32": "offset or flag", "36": "offset", "64": "flag", "127": "all flags",
    },
}  # fmt: skip


@cache
def sources():
    """Return the C files by their path, without comments, texts and preprocessor conditions."""
    found = {}
    for path in sorted(KERNEL.rglob("*.[ch]")):
        text = re.sub(r"/\*.*?\*/", "", path.read_text(encoding="utf-8"), flags=re.DOTALL)
        text = re.sub(r'"(?:\\.|[^"\\])*"|' + r"'(?:\\.|[^'\\])+'", '""', text)
        found[path.relative_to(KERNEL).as_posix()] = re.sub(r"(?m)^\s*#\s*if.*$", "", text)
    return found


def numbers(text):
    """Return the numbers in a C text, except plain coefficients and small integers."""
    floats = re.findall(r"(?<![\w.])(?:\d+\.\d*(?:[eE][+-]?\d+)?|\d+[eE][+-]?\d+)(?![\w.])", text)
    integers = re.findall(r"(?<![\w.+-])\d+(?![\w.])", re.sub(r"\d[eE][+-]\d+", "", text))
    return {x for x in floats if x not in PLAIN} | {x for x in integers if int(x) > PLAIN_INTEGER}


def test_the_header_is_up_to_date():
    assert header.main(["--check"]) == 0, "run python -m prbm.kernel.header"


def test_a_stale_header_fails_the_check(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(header, "PATH", tmp_path / "generated.h")
    assert header.main(["--check"]) == 1
    assert "is stale" in capsys.readouterr().err
    assert header.main() == 0
    assert header.main(["--check"]) == 0
    assert header.PATH.read_text(encoding="utf-8") == header.header()


@pytest.mark.parametrize("file", sources())
def test_c_contains_no_literal_of_a_python_constant(file):
    if file not in WHOLE_FILES:
        assert numbers(sources()[file]) <= ALLOWED.get(file, {}).keys()


ENGINE_PLAIN = {0.0, 0.25, 0.5, 1.0, 2.0, 3.0, 4.0, 6.0}
ENGINE_ALLOWED = {
    "mechanics/system.py": {90.0: "degrees of a quarter turn"},
    "mechanics/assembly.py": {90.0: "degrees of a quarter turn"},
}
ENGINE_DATA = {"hybrid/runge_kutta.py": "the tableau, which is generated into C"}
ENGINE = [
    path.relative_to(KERNEL.parent).as_posix()
    for package in ("mechanics", "hybrid")
    for path in sorted((KERNEL.parent / package).glob("*.py"))
]


def literals(text):
    """Return the floating-point numbers of a Python text."""
    constants = (node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Constant))
    return {node.value for node in constants if isinstance(node.value, float)}


@pytest.mark.parametrize("file", ENGINE)
def test_the_engine_contains_no_literal_tolerance(file):
    found = literals((KERNEL.parent / file).read_text(encoding="utf-8")) - ENGINE_PLAIN
    assert found <= ENGINE_ALLOWED.get(file, {}).keys() or file in ENGINE_DATA


def test_every_exception_of_the_engine_is_needed():
    for file, allowed in ENGINE_ALLOWED.items():
        assert allowed.keys() <= literals((KERNEL.parent / file).read_text(encoding="utf-8"))


def test_the_checks_find_a_literal_tolerance_in_python_and_c():
    assert literals("x = 2.0 * y + 1e-7  # 0.3") - ENGINE_PLAIN == {1e-7}
    assert numbers("x = 2.0 * y + 1e-7 + 0.75;") == {"1e-7", "0.75"}


def test_c_does_not_redefine_names_of_the_generated_header():
    names = "|".join([*re.findall(r"#define (\w+) ", header.header()), *enumerators()])
    again = re.compile(rf"#define ({names})\b|\b({names})\s*=[^=]")
    for file, text in sources().items():
        assert file == "generated.h" or not again.search(text)


def enumerators():
    """Return the integers of the header by name."""
    return {
        name: int(value) for name, value in re.findall(r"\b([A-Z]\w*) = (\d+)\b", header.header())
    }


def test_integer_constants_of_c_equal_those_of_python():
    found = constants()
    for name, value in enumerators().items():
        assert found[name] == value
    for name, value in vars(tolerances).items():
        if name.isupper() and isinstance(value, int):
            assert found[name] == value
    assert found["COORDINATES_MAX"] == tables.COORDINATES_MAX


@pytest.fixture(scope="module")
def exported():
    """Return a library with the macros of the header as numbers, and their names in C."""
    macros = re.findall(r"#define (\w+) [\d.]", header.header())
    lines = [f"const double value_{name} = {name};" for name in macros]
    arrays = {
        "STAGE_WEIGHTS": TSITOURAS_PAPAKOSTAS.a,
        "ERROR_WEIGHTS": TSITOURAS_PAPAKOSTAS.error,
        "DENSE_WEIGHTS": TSITOURAS_PAPAKOSTAS.dense,
        "LARGEST_WEIGHTS": header.largest_weights(TSITOURAS_PAPAKOSTAS),
    }
    for name, expected in arrays.items():
        shape = "".join(f"[{count}]" for count in expected.shape)
        lines.append(f"const double value_{name}{shape} = {name};")
    return compiled(flags=("-O0",), text="\n".join(lines)), macros, arrays


@pytest.mark.slow
def test_tolerances_of_c_equal_those_of_python_bit_by_bit(exported):
    library, macros, _ = exported
    for name, value in vars(tolerances).items():
        if name.isupper() and isinstance(value, float):
            assert name in macros
            assert c_double.in_dll(library, f"value_{name}").value == value


@pytest.mark.slow
def test_the_runge_kutta_tableau_of_c_equals_that_of_python_bit_by_bit(exported):
    library, _, arrays = exported
    for name, expected in arrays.items():
        found = (c_double * expected.size).in_dll(library, f"value_{name}")
        assert [*found] == expected.ravel().tolist()


def test_the_bounds_of_the_dense_weights_hold_and_are_close():
    found = np.abs(powers(TSITOURAS_PAPAKOSTAS, np.linspace(0.0, 1.0, 7001))).max(axis=0)
    bounds = header.largest_weights(TSITOURAS_PAPAKOSTAS)
    assert (found <= bounds).all()
    assert (bounds <= found + 1.1e-3).all()
