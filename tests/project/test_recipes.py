"""Recipes in CONTRIBUTING.md, followed on a copy of the tree."""

import os
import re
import shlex
import shutil
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

from support import ROOT

CODE, COMMANDS = r"```python\n(.*?)```", r"```sh\n(.*?)```"


def copied(folder: Path) -> Path:
    """Return a copy of the sources, tests and pages."""
    root = folder / "tree"
    unwanted = shutil.ignore_patterns("__pycache__", ".*", "build", "dist")
    for name in ("fmu_src", "tests", "docs", "benchmarks", "examples"):
        shutil.copytree(ROOT / name, root / name, ignore=unwanted)
    for path in ROOT.iterdir():
        if path.is_file():
            shutil.copy(path, root / path.name)
    return root


def recipe(title: str) -> str:
    """Return a recipe by its title."""
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    return text.partition(f"### {title}\n")[2].partition("\n### ")[0]


def changed(path: Path, place: str, *, before: str) -> None:
    """Insert lines before a place that occurs once."""
    text = path.read_text(encoding="utf-8")
    assert text.count(place) == 1, (path.name, place)
    path.write_text(text.replace(place, before + place), encoding="utf-8")


def run(root: Path, command: str) -> str:
    """Run a command of a recipe in the copy; return its output."""
    words = [sys.executable if word == "python" else word for word in shlex.split(command)]
    environment = {**os.environ, "PYTHONPATH": str(root / "fmu_src")}
    done = subprocess.run(
        words, cwd=root, env=environment, capture_output=True, text=True, check=False,
        encoding="utf-8", errors="replace",
    )  # fmt: skip
    assert done.returncode == 0, done.stdout[-4000:] + done.stderr[-4000:]
    return done.stdout


@pytest.mark.slow
def test_a_flexure_model_is_added_by_its_recipe(tmp_path):
    """Its tests pass, and a model without limits of its errors makes them fail."""
    root, text = copied(tmp_path), recipe("A flexure model")
    (code,) = re.findall(CODE, text, re.DOTALL)
    entry = textwrap.indent(code.removeprefix("model = ").rstrip() + ",\n", 8 * " ")
    source = root / "fmu_src" / "prbm" / "mechanism" / "flexure.py"
    changed(source, "        FlexureModel(\n            CHAIN,", before=entry)
    (block,) = re.findall(COMMANDS, text, re.DOTALL)
    *writers, check = block.strip().splitlines()
    for command in writers:
        run(root, command)
    page = (root / "docs" / "flexure-models.md").read_text(encoding="utf-8")
    assert "| P L²/EI | 1R | 2R | 3R | 4R | beam |" in page
    assert "| 4R | 0.24, 0.24, 0.24, 0.24 | 4, 4, 4, 4 |" in page
    assert "`4R`" in (root / "docs" / "mechanism-files.md").read_text(encoding="utf-8")
    limits = root / "tests" / "mechanism" / "test_flexure_models.py"
    with pytest.raises(AssertionError, match="test_every_model_has_limits_of_its_errors"):
        run(root, f"{check} -k limits_of_its_errors")
    table = page.partition("<!-- table: guide -->")[2].partition("<!-- end -->")[0]
    rows = [line.split("|")[1:-1] for line in table.strip().splitlines()]
    column = [cell.strip() for cell in rows[0]].index("4R")
    figures = [float(row[column]) for row in rows[2:]]
    guide = ", ".join(map(repr, (*figures[:4], figures[-1])))
    changed(limits, '    "1R": 3.8,', before='    "4R": 100.0,\n')
    changed(limits, '    "1R": (5.9, None),', before='    "4R": (100.0, 100.0),\n')
    changed(limits, '    "1R": (10.42,', before=f'    "4R": ({guide}),\n')
    assert " passed" in run(root, check)


BODY_TEST = """
import prbm

guide = prbm.load("PRBDM2R")
light = {name: 1.0 for name in guide.values() if name.endswith(".density")}
result = prbm.simulate(guide, light, stop_time=0.02, engine=ENGINE)
total, own = result["energy.kinetic"], result["shuttle.kinetic"]
print(abs(total - own).max() < 1e-3 * total.max(), own.max() > 0.99 * total.max())
"""


@pytest.mark.slow
def test_an_output_is_added_by_its_recipe(tmp_path):
    """Engines, derivatives and FMUs agree, and the energy of the body is that of the motion."""
    root, text = copied(tmp_path), recipe("An output")
    blocks = [
        textwrap.indent(textwrap.dedent(block), (len(block) - len(block.lstrip()) - 3) * " ")
        for block in re.findall(r"   ```(?:python|c)\n(.*?)   ```", text, re.DOTALL)
    ]
    described, depends, computed, in_c, changes = blocks
    package = root / "fmu_src" / "prbm"
    variables = package / "interface" / "variables.py"
    changed(variables, ')\nPROBE_OUTPUTS = ("x"', before=', "kinetic"')
    changed(variables, "\n\ndef _stop(", before=described)
    structure = package / "interface" / "structure.py"
    changed(structure, "    for probe in (p.name for p in mech", before=depends)
    outputs = package / "hybrid" / "outputs.py"
    changed(outputs, "    for frame in system.probes:\n        place,", before=computed)
    kernel = package / "kernel"
    changed(kernel / "hybrid" / "outputs.c", "    }\n}\n\nstatic void output_probes", before=in_c)
    changed(kernel / "tangent.c", "    }\n}\n\nstatic void probe_changes", before=changes)
    names = root / "tests" / "fmu" / "test_fmu_interface.py"
    changed(names, 'omega "\n    "stop.gap stop.gap_rate', before="kinetic shuttle.")
    (commands,) = re.findall(COMMANDS, text, re.DOTALL)
    header, *checks = commands.strip().splitlines()
    run(root, header)
    for engine in ("python", "kernel"):
        script = BODY_TEST.replace("ENGINE", repr(engine))
        assert run(root, f"python -c {shlex.quote(script)}").split() == ["True", "True"]
    for check in checks:
        assert " passed" in run(root, check)
