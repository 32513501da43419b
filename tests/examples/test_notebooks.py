"""The notebooks of the examples run, and their numbers agree with independent values."""

import json
import re
import runpy
from pathlib import Path
from typing import Any

import pytest

from support import ROOT

FOLDER = ROOT / "examples" / "notebooks"
NOTEBOOKS = sorted(FOLDER.glob("*.ipynb"))
SIZE_MAX = 300_000  # bytes; figures and films are small.


def printed(notebook: dict[str, Any]) -> str:
    """Return the printed text of a notebook."""
    outputs = [o for cell in notebook["cells"] for o in cell.get("outputs", [])]
    return "".join("".join(o["text"]) for o in outputs if o["output_type"] == "stream")


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_stored_notebooks_are_executed_in_order_without_errors(path: Path) -> None:
    notebook = json.loads(path.read_text(encoding="utf-8"))
    cells = [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]
    assert [cell["execution_count"] for cell in cells] == [*range(1, len(cells) + 1)]
    outputs = [output for cell in cells for output in cell["outputs"]]
    assert {output["output_type"] for output in outputs} <= {"execute_result", "stream"}
    assert any("text/html" in output.get("data", {}) for output in outputs)
    assert "0x" not in printed(notebook)
    assert path.stat().st_size < SIZE_MAX


def test_there_is_a_notebook_per_kind_of_user() -> None:
    assert [path.stem for path in NOTEBOOKS] == ["designer", "researcher", "system_engineer"]


@pytest.mark.slow
def test_the_notebook_for_designers_finds_the_best_position_of_the_stop(executed) -> None:
    """No sample is better than the optimum."""
    text = executed("designer")
    samples = [float(x) for x in re.findall(r"mm  ([\d.]+) s", text)]
    assert len(samples) == 7
    optimum = float(re.search(r"optimum: ([\d.]+) s", text)[1])
    assert 0.15 < optimum <= min(samples)


@pytest.mark.slow
def test_the_notebook_for_system_engineers_compares_an_fmu_with_the_engine(executed) -> None:
    """The FMU has the mean of the shock in each of 20 steps: an error of second order."""
    difference = float(
        re.search(r"relative difference ([\d.e+-]+)", executed("system_engineer"))[1]
    )
    assert difference < 5e-4


@pytest.mark.slow
def test_the_notebook_for_researchers_agrees_with_the_scalar_equation(executed) -> None:
    text = executed("researcher")
    differences = [float(x) for x in re.findall(r"([\d.e+-]+) s$", text, re.MULTILINE)]
    assert len(differences) == 5
    assert max(differences) < 1e-9
    shares = re.search(r"lost share: ([\d.]+) to ([\d.]+)", text)
    assert [float(x) for x in shares.groups()] == pytest.approx([0.64, 0.64], abs=1e-8)


@pytest.fixture
def executed(monkeypatch: pytest.MonkeyPatch):
    """Return the printed text of a notebook that is executed now, in another process."""
    pytest.importorskip("nbclient")
    pytest.importorskip("ipykernel")
    monkeypatch.setenv("PYTHONPATH", str(ROOT / "fmu_src"))
    execute = runpy.run_path(str(FOLDER / "execute.py"))["executed"]
    return lambda name: printed(execute(FOLDER / f"{name}.ipynb"))
