"""Write the table of the modules of the Python engine and their counterparts in the C kernel.

    python docs/write_counterparts.py

writes ``docs/counterparts.md`` from the modules of ``mechanics/`` and ``hybrid/``, the headers of
``kernel/core/`` and ``kernel/hybrid/``, and the pairs of functions that
``tests/kernel/test_kernel_twins.py`` compares.  A module and the C file of the same name are
counterparts; ``MORE`` has the files for which this is not so.
"""

import ast
import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "fmu_src" / "prbm"
KERNEL = PACKAGE / "kernel"
PAGE = ROOT / "docs" / "counterparts.md"
PAIRS = ROOT / "tests" / "kernel" / "test_kernel_twins.py"

MORE = {
    "mechanics/direction_map": ("core/system",),
    "mechanics/dynamics": (
        "core/equations",
        "core/evaluation",
        "core/friction",
        "core/gaps",
        "core/projection",
    ),
    "mechanics/stress": ("core/sections",),
    "hybrid/runge_kutta": ("core/runge_kutta",),
    "hybrid/spring_phases": ("hybrid/spring_guards",),
}
"""C files that are counterparts of a module, beside the one of the same name."""

PYTHON_ONLY = {
    "mechanics/arrays": "names of array types",
    "mechanics/body_compliance": "for the tools: the compliance of a body at a contact",
    "mechanics/compliant_stops": "in C, part of `core/gaps.c`, `dynamics.c` and `compliance.c`",
    "mechanics/independent": "in C, `kernel/dependents.c`, for model exchange only",
    "mechanics/inputs": "in C, `Inputs` of `core/system.h` and `kernel/motion.h`",
    "mechanics/linear": "for the tools: linearization",
    "mechanics/places": "in C, the structures of `core/system.h`",
    "mechanics/resting": "for the tools: shapes that rest on stops",
    "hybrid/front": "in C, the fields of `hybrid/state.h` that continue",
    "hybrid/given": "checks of Python values; FMUs check theirs in `kernel/fmi/`",
    "hybrid/records": "for the tools: the list of all impacts",
    "hybrid/rest_speed": "for the files: rest speeds of stops that state none",
}
"""Modules without a C file, and why."""

C_ONLY = {
    "core/branch_terms": "beams by branches; Python multiplies dense matrices",
    "core/branches": "beams by branches; Python multiplies dense matrices",
    "core/factors": "replaces LAPACK",
    "core/flexure": "`mechanism/flexure.py`",
    "core/guides": "in Python, part of `mechanics/collection.py` and `mechanics/assembly.py`",
    "core/intervals": "columns of rows that are not zero; Python multiplies dense matrices",
    "core/layout": "`mechanism/description.py` and `interface/variables.py`",
    "core/matrix": "replaces NumPy and LAPACK",
    "core/mechanism": "`mechanism/parameters.py` and `mechanism/expressions.py`",
    "core/memory": "memory",
    "core/numbers": "replaces elementary functions of NumPy",
    "core/placement": "memory",
    "core/reader": "reads untrusted bytes",
    "core/tables": "reads what `interface/tables.py` writes",
    "hybrid/access": "access to the fields of a simulation",
    "hybrid/contact_names": "names in messages",
    "hybrid/errors": "in Python, part of `hybrid/stepping.py`",
    "hybrid/moved": "in Python, part of `hybrid/contact_modes.py` and `hybrid/walls.py`",
    "hybrid/phases": "in Python, part of `hybrid/compliant.py`",
    "hybrid/present": "the record of the quantities that are up to date",
}
"""C files without a module of their name in ``mechanics/`` and ``hybrid/``, and why."""

HEAD = """# Counterparts in the two engines
[Index](index.md) · [Glossary](glossary.md)

`python docs/write_counterparts.py` writes this page from the code; a test fails if it is out of
date. A module of `mechanics/` and `hybrid/` and the C file of the same name in `kernel/core/` and
`kernel/hybrid/` are counterparts. The table names the other files, and lists their public
functions: those of the same name in both, those that are compared one by one under different names
(C = Python), and those of one engine only. Most functions of one engine only are methods of Python
objects, whose results the C files keep in structures, or steps of a calculation in C that NumPy
does at once.

"""


class Module(NamedTuple):
    """The public functions of a module and of its counterparts.

    Parameters
    ----------
    name : str
        Package and name.
    files : tuple of str
        The C files.
    python, c : set of str
        Names of public functions; methods without their classes.
    renamed : dict of str
        Names in Python of functions in C that are compared one by one under another name.
    """

    name: str
    files: tuple[str, ...]
    python: set[str]
    c: set[str]
    renamed: dict[str, str]

    @property
    def shared(self) -> set[str]:
        """Functions with the same name in both engines."""
        return self.python & self.c


def python_functions(path: Path) -> set[str]:
    """Return the names of the public functions and methods of a module."""

    def named(body: list[ast.stmt]) -> Iterator[str]:
        for one in body:
            if isinstance(one, ast.ClassDef) and not one.name.startswith("_"):
                yield from named(one.body)
            elif isinstance(one, ast.FunctionDef) and not one.name.startswith("_"):
                yield one.name

    return set(named(ast.parse(path.read_text(encoding="utf-8")).body))


def c_functions(name: str) -> set[str]:
    """Return the names of the functions that the header of a C file declares."""
    header = KERNEL / f"{name}.h"
    text = header.read_text(encoding="utf-8") if header.exists() else ""
    return set(re.findall(r"^PRBM [^;()]*?\b(\w+)\(", text, re.MULTILINE))


def pairs() -> dict[str, str]:
    """Return the names in Python of the functions in C that are compared one by one."""
    found = {}
    for node in ast.walk(ast.parse(PAIRS.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "twin":
            found |= {key.arg: ast.unparse(key.value).split(".")[-1] for key in node.keywords}
    return {name: other for name, other in found.items() if name}


def modules() -> list[Module]:
    """Return the modules of both packages with their counterparts."""
    compared, result = pairs(), []
    for package, folder in (("mechanics", "core"), ("hybrid", "hybrid")):
        for path in sorted((PACKAGE / package).glob("[a-z]*.py")):
            name, own = f"{package}/{path.stem}", f"{folder}/{path.stem}"
            files = (*((own,) if (KERNEL / f"{own}.c").exists() else ()), *MORE.get(name, ()))
            python = python_functions(path)
            c = set().union(*(c_functions(file) for file in files))
            renamed = {k: x for k, x in compared.items() if k in c and x in python and x != k}
            result.append(Module(name, files, python, c, renamed))
    return result


def files_of_c() -> list[str]:
    """Return the C files of the engine."""
    return [
        f"{folder}/{path.stem}"
        for folder in ("core", "hybrid")
        for path in sorted((KERNEL / folder).glob("*.c"))
    ]


def listed(names: set[str]) -> str:
    """Return names in the order of the alphabet, as code."""
    return ", ".join(f"`{name}`" for name in sorted(names)) or "none"


def page() -> str:
    """Return the text of the page."""
    every = modules()
    shared = sum(len(one.shared) for one in every)
    renamed = sum(len(one.renamed) for one in every)
    total = sum(len(one.python | one.c) - len(one.renamed) for one in every)
    text = HEAD + (
        f"Of {total} functions, {shared} have the same name in both engines, and {renamed} are "
        "compared under different names.\n"
    )
    for one in every:
        if not one.files:
            continue
        others = ", ".join(f"`{a}` = `{b}`" for a, b in sorted(one.renamed.items())) or "none"
        text += (
            f"\n## {one.name}.py: {', '.join(f'{file}.c' for file in one.files)}\n\n"
            f"- Both: {listed(one.shared)}\n"
            f"- Different names: {others}\n"
            f"- Python: {listed(one.python - one.c - set(one.renamed.values()))}\n"
            f"- C: {listed(one.c - one.python - set(one.renamed))}\n"
        )
    for title, reasons, suffix in (
        ("Modules without a C file", PYTHON_ONLY, "py"),
        ("C files without a module", C_ONLY, "c"),
    ):
        text += f"\n## {title}\n\n| file | reason |\n|---|---|\n"
        text += "".join(f"| `{name}.{suffix}` | {why} |\n" for name, why in reasons.items())
    return text


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
    print(f"wrote {PAGE.relative_to(ROOT)}")
