"""Contracts of imports between the packages."""

import ast
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "fmu_src" / "prbm"
SHIPPED = ("base", "mechanism", "mechanics", "hybrid", "fmu/slave")


def test_imports_keep_the_contracts_of_the_project(tmp_path):
    """The contracts are in pyproject.toml."""
    run = "from importlinter.cli import lint_imports_command; lint_imports_command()"
    done = subprocess.run(
        [sys.executable, "-c", run, "--cache-dir", str(tmp_path)],
        cwd=ROOT, capture_output=True, encoding="utf-8", check=False,
        env=os.environ | {"PYTHONPATH": str(PACKAGE.parent), "PYTHONIOENCODING": "utf-8"},
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize("package", SHIPPED)
def test_packages_inside_python_fmus_import_each_other_relatively(package):
    """The absolute name of these packages differs between FMUs."""
    files = sorted((PACKAGE / package).rglob("*.py"))
    assert files
    for path in files:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom) and node.level == 0:
                names = [node.module or ""]
            else:
                continue
            assert "prbm" not in {name.partition(".")[0] for name in names}, path
