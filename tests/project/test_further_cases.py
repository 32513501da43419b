"""The list of further cases, with which tests are slow."""

import re

from support import ROOT, SUPPORT

LINE = r"(tests/\S+\.py)::(\w+): (.+)"


def test_every_line_names_a_test_and_its_cases():
    lines = (SUPPORT / "further_cases.txt").read_text("utf-8").splitlines()[1:]
    found = [re.fullmatch(LINE, line).groups() for line in lines]
    assert lines == sorted(lines)
    assert len({(path, function) for path, function, _ in found}) == len(lines)
    for path, function, cases in found:
        assert f"def {function}(" in (ROOT / path).read_text("utf-8"), function
        assert cases.split(" | ") == sorted({*cases.split(" | ")}), function
