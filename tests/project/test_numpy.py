"""Calls of NumPy have equal results in all supported versions."""

import ast
from pathlib import Path

import prbm


def test_every_least_squares_solution_states_its_rank_tolerance():
    """Without ``rcond``, NumPy 1.26 warns and uses another default than NumPy 2."""
    found = 0
    for path in Path(prbm.__file__).parent.rglob("*.py"):
        text = path.read_text(encoding="utf-8")
        for node in ast.walk(ast.parse(text)) if "lstsq" in text else ():
            if isinstance(node, ast.Call) and ast.unparse(node.func) == "np.linalg.lstsq":
                found += 1
                assert "rcond" in [k.arg for k in node.keywords], f"{path}:{node.lineno}"
    assert found
