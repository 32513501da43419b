"""The list of further mechanisms, with which tests are slow."""

import re

from prbm.files.mechanism_file import shipped
from support import ROOT, SUPPORT

OWN = {"Beams", "Elastic", "Mixed", "Profiles", "Rich"}  # Mechanisms of the tests of the kernel.


def test_every_line_names_a_test_and_mechanisms():
    lines = (SUPPORT / "further_mechanisms.txt").read_text("utf-8").splitlines()[1:]
    assert lines == sorted(set(lines))
    for line in lines:
        path, function, names = re.fullmatch(r"(tests/\S+\.py)::(\w+): (.+)", line).groups()
        assert f"def {function}(" in (ROOT / path).read_text("utf-8"), line
        assert {*names.split()} <= {*shipped(), *OWN}, line
