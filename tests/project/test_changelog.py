"""The table of renamed imports in the changelog names modules and names that exist."""

import importlib
import re

import prbm
from support import ROOT

CHANGELOG = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
ROWS = re.findall(r"^\| `([\w.]+)` \| `(prbm[\w.]*)` \| (.*?) ?\|$", CHANGELOG, re.MULTILINE)


def test_the_latest_section_has_the_present_version():
    assert re.findall(r"^## (.*)$", CHANGELOG, re.MULTILINE)[0] == prbm.__version__


def test_the_new_modules_and_names_of_renamed_imports_exist():
    missing = []
    for _, new, text in ROWS:
        try:
            module = importlib.import_module(new)
        except ModuleNotFoundError:
            missing.append(new)
        else:
            missing += [f"{new}.{name}" for name in listed(text) if not hasattr(module, name)]
    assert missing == []


def listed(text: str) -> list[str]:
    """Return the names of a cell, without remarks."""
    return re.findall(r"`(\w+)`", re.sub(r"\(.*?\)|, as .*|;.*", "", text))


def test_the_table_of_renamed_imports_has_the_modules_of_0_1():
    old = {old for old, _, _ in ROWS}
    assert len(old) > 80
    assert {"prbm.hybrid", "prbm_fmu.native_fmu", "prbm_tools.cli", "mechanisms"} < old
