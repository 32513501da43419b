"""The portability run: its variants, its reasons for doubt, and its table."""

import argparse
import importlib.util
import re
import sys
from dataclasses import replace
from types import ModuleType

import pytest

from support import ROOT, SUPPORT


def runner() -> ModuleType:
    """Return the program as a module."""
    spec = importlib.util.spec_from_file_location("portability", ROOT / "tests" / "portability.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules["portability"] = module  # Dataclasses look up their module.
    spec.loader.exec_module(module)
    return module


PROGRAM = runner()
OPTIONS = argparse.Namespace(part=["--version"], processes=0)
PLAIN = PROGRAM.Variant("plain")


def test_the_page_lists_all_variants():
    page = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    table = re.split(
        r"^## ", page.partition("## Other machines")[2], maxsplit=1, flags=re.MULTILINE
    )
    rows = re.findall(r"^\| (`.*?) \|", table[0], re.MULTILINE)
    listed = sorted(re.findall(r"`([^`]+)`", " ".join(rows)))
    names = [v.name for v in PROGRAM.VARIANTS if v.name != "unchanged"]
    assert listed == sorted([*names, "combined"])


def test_the_combined_variant_has_the_variables_and_probes_of_its_parts():
    assert {v.name for v in PROGRAM.VARIANTS} >= set(PROGRAM.COMBINED)
    combined = PROGRAM.combined()
    assert "TMPDIR" in dict(combined.environment)
    assert "--random-order-seed=1" in combined.arguments
    assert combined.umask == 0o077


@pytest.mark.parametrize(
    ("expected", "doubt"),
    [
        ("1.0", ""),
        ("3.0", r"no effect: 1\.0 instead of 3\.0"),
        (None, r"no effect: 1\.0 as without it"),
    ],
)
def test_a_variant_without_effect_is_doubtful(expected, doubt, tmp_path):
    variant = replace(PLAIN, probes=(PROGRAM.Probe("math", "math.cos(0.0)", expected),))
    assert re.fullmatch(doubt, PROGRAM.Run(variant, tmp_path, OPTIONS).doubt())


def test_a_variant_with_an_effect_is_not_doubtful(tmp_path, monkeypatch):
    monkeypatch.setenv("OPENBLAS_CORETYPE", "Haswell")
    probe = PROGRAM.Probe("os", "os.environ.get('OPENBLAS_CORETYPE')", None)
    variant = replace(PLAIN, environment=(("OPENBLAS_CORETYPE", "Nehalem"),), probes=(probe,))
    run = PROGRAM.Run(variant, tmp_path, OPTIONS)
    assert run.value(probe) == "'Nehalem'"
    assert run.doubt() == ""


def test_an_impossible_variant_is_not_run():
    found = PROGRAM.outcome(replace(PLAIN, doubt=lambda: "no such machine"), OPTIONS)
    assert found == PROGRAM.Outcome("plain", "no such machine")
    assert PROGRAM.table([found]).splitlines()[-1] == "| plain | | | | | no such machine |"
    assert PROGRAM.status([found]) == 1
    assert PROGRAM.status([found, PROGRAM.Outcome("other", passed=1)]) == 0
    assert PROGRAM.status([found, PROGRAM.Outcome("other", failures=("a",))]) == 1


def test_failures_are_listed_below_the_table():
    failed = ("a::test_b: assert 1 == 2", *["c"] * 30)
    lines = PROGRAM.table([PROGRAM.Outcome("plain", "", 7, 1, 2.4, failed)]).splitlines()
    assert lines[2:4] == ["| plain | 7 | 31 | 1 | 2 | |", "plain: a::test_b: assert 1 == 2"]
    assert lines[-1] == f"plain: and {31 - PROGRAM.FAILURES_SHOWN} further failures"


@pytest.mark.slow
def test_failures_are_counted_and_a_run_without_tests_fails(tmp_path, capfd):
    path = tmp_path / "test_two.py"
    path.write_text("def test_one(): pass\ndef test_two(): assert not 2\n", encoding="utf-8")
    options = argparse.Namespace(part=[str(path)], processes=0)
    found = PROGRAM.outcome(PLAIN, options)
    assert (found.passed, found.skipped, len(found.failures)) == (1, 0, 1)
    assert "test_two: " in found.failures[0]
    path.write_text("", encoding="utf-8")
    assert PROGRAM.outcome(PLAIN, options).failures == ("pytest ended with status 5",)


def test_assertions_of_helpers_are_executed_without_those_of_python():
    """Pytest rewrites them to statements."""
    names = {path.stem for path in SUPPORT.glob("*.py")}
    helpers = {name: vars(sys.modules[name]) for name in names & set(sys.modules)}
    assert "support" in helpers
    assert all("@pytest_ar" in found for found in helpers.values())
