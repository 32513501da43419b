"""Each C file includes the headers that it needs, and declares its functions in its own header."""

import re
import subprocess
from pathlib import Path

import pytest

from c_importer import FOLDERS, WARNINGS
from kernel_library import KERNEL

UNIT = "prbm_fmu.c"
ALONE = ("-DPRBM=", "-DSHARED=", "-Wmissing-prototypes", "-Wno-attributes")
"""Options that make functions for other files external; one without a prototype is an error."""
FILES = [
    path.relative_to(KERNEL).as_posix() for path in sorted(KERNEL.rglob("*.c")) if path.name != UNIT
]


def check(folder, file):
    """Return the messages of the compiler about a file that is compiled alone."""
    command = ["cc", "-std=c99", "-fsyntax-only", *ALONE, *WARNINGS, f"-I{folder}", *FOLDERS]
    if "\nEXPORTED " in file.read_text(
        encoding="utf-8"
    ):  # Importers have the prototypes of these functions.
        command.append("-Wno-missing-prototypes")
    return subprocess.run([*command, str(file)], capture_output=True, text=True).stderr


@pytest.mark.parametrize("file", FILES)
def test_a_file_compiles_alone(file):
    assert check(KERNEL, KERNEL / file) == ""


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ('#include "core/matrix.h"\ndouble f(void) { return 0.0; }', "no previous prototype"),
        ("double g(const double *x) { return dot(1, x, x); }", "implicit declaration"),
    ],
)
def test_the_compiler_finds_functions_without_a_header(tmp_path, text, complaint):
    file = tmp_path / "wrong.c"
    file.write_text(text, encoding="utf-8")
    assert complaint in check(tmp_path, file)


def declared(text):
    """Return the functions that a text declares for other files."""
    text = re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL)
    return set(re.findall(r"\b(?:PRBM|SHARED)\b[^;(){]*?\b(\w+)\s*\([^;{]*\)[^;{]*;", text))


def defined(text):
    """Return the functions that a text defines for other files."""
    text = re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL)
    return set(re.findall(r"\b(?:PRBM|SHARED)\b[^;(){]*?\b(\w+)\s*\([^;{]*\)\s*{", text))


@pytest.mark.parametrize("file", [f for f in FILES if not f.startswith("fmi/")])
def test_functions_are_declared_in_the_header_of_their_file(file):
    """The public functions of a simulation are in motion.h instead."""
    path = KERNEL / file
    own = path.with_suffix(".h")
    found = declared((KERNEL / "motion.h").read_text(encoding="utf-8"))
    found |= declared(own.read_text(encoding="utf-8")) if own.exists() else set()
    assert defined(path.read_text(encoding="utf-8")) <= found
    if own.exists():
        assert declared(own.read_text(encoding="utf-8")) <= defined(
            path.read_text(encoding="utf-8")
        )


def test_every_file_is_part_of_the_library():
    included = re.findall(r'#include "(.*\.c)"', (KERNEL / UNIT).read_text(encoding="utf-8"))
    assert sorted(included) == FILES
    assert all(Path(file).suffix == ".c" for file in included)
