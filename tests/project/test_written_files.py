"""Files that the package writes are complete or absent: one function writes them."""

import ast
from pathlib import Path

import prbm

PACKAGE = Path(prbm.__file__).parent
WRITERS = {
    "base/atomic.py": "the function itself",
    "cad/importing.py": "a temporary folder, for the reader",
    "drawing/style.py": "memory",
    "fmu/archive.py": "memory",
    "kernel/compiler.py": "a temporary folder, for the compiler",
    "kernel/header.py": "the sources of the project",
    "kernel/library.py": "a temporary folder, for the loader",
    "plots/animation.py": "a temporary folder, for the film",
    "sweeps/children.py": "standard output",
    "sweeps/journal.py": "completed rows of a study, beside its table",
    "systems/ssp.py": "memory",
    "systems/structure.py": "a temporary folder, for FMUs of packages",
}
METHODS = {"write_text", "write_bytes", "savefig", "to_csv", "to_parquet", "tofile"}


def _writes(call: ast.Call) -> bool:
    """Return whether a call writes a file at a path."""
    name = call.func.attr if isinstance(call.func, ast.Attribute) else ""
    name = call.func.id if isinstance(call.func, ast.Name) else name
    if name in METHODS:
        return True
    texts = {str(a.value) for a in ast.walk(call) if isinstance(a, ast.Constant)}
    modes = {text for text in texts if 0 < len(text) <= 3 and {*text} <= {*"wxabrt+"}}
    return name in ("open", "fdopen", "ZipFile") and any({*mode} & {*"wxa+"} for mode in modes)


def test_files_are_written_by_one_function():
    found = set()
    for path in PACKAGE.rglob("*.py"):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        if any(isinstance(node, ast.Call) and _writes(node) for node in ast.walk(tree)):
            found.add(path.relative_to(PACKAGE).as_posix())
    assert found == {*WRITERS}
