"""The page of reproduced results: its numbers are those of a run, its verdicts follow from them."""

import importlib
import math
import re

import pytest

from prbm.commands.command_line import main
from prbm.references import finite_elements
from prbm.validation import chapter_4
from prbm.validation import page as validation
from prbm.validation.common import K_THESIS, crossings
from prbm.validation.page import ValidationError, chosen, page, parts, reproduce
from prbm.validation.reproduced import RESULTS
from prbm.validation.side_by_side import Drawing, Number, Reproduction, Result
from support import ROOT

DOCS = ROOT / "docs"
PAGE = (DOCS / "validation.md").read_text(encoding="utf-8")
CHEAP = ("table-1", "figure-4-5", "figure-5-4", "figure-5-5", "chapter-7")
KEYS = [one.key for one in RESULTS]
NUMBER = re.compile(r"[-+]?\d+(?:\.\d*)?(?:e[-+]?\d+)?")


def rows(text):
    """Return the cells of the first table of a section, with its header."""
    table = re.search(r"(?:^\|.*\n?)+", text, re.MULTILINE)[0]
    lines = [line for line in table.splitlines() if line.startswith("| ")]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]


def same(shown, found):
    """Return whether two texts are equal but for two units of the last digits of their numbers."""
    if NUMBER.sub("#", shown) != NUMBER.sub("#", found):
        return False
    for a, b in zip(NUMBER.findall(shown), NUMBER.findall(found), strict=True):
        mantissa, _, exponent = a.partition("e")
        digits = len(mantissa.partition(".")[2])
        unit = 10.0 ** (int(exponent or 0) - digits)
        if abs(float(a) - float(b)) > 2.01 * unit:
            return False
    return True


def check(key):
    """Compute a result and compare it with the page."""
    (one,) = chosen([key])
    fractions = []
    result = one.run(fractions.append)
    assert result.key == key
    assert all(0.0 <= fraction <= 1.0 for fraction in fractions)
    known = parts(PAGE, key)
    assert known is not None, f"{key} is not on the page: prbm validate --out docs"
    row, section = known
    assert same(row, result.row()), f"{row}\n{result.row()}"
    for shown, found in zip(section.splitlines(), result.section().splitlines(), strict=True):
        assert same(shown, found), f"{shown}\n{found}"


@pytest.mark.parametrize("key", CHEAP)
def test_numbers_of_the_page_equal_computed_ones(key):
    check(key)


@pytest.mark.slow
@pytest.mark.parametrize("key", [key for key in KEYS if key not in CHEAP])
def test_all_other_numbers_of_the_page_equal_computed_ones(key):
    pytest.importorskip("exudyn", reason="finite elements need exudyn: pip install exudyn")
    check(key)


def test_the_command_prints_the_verdicts_of_the_page(capsys):
    keys = CHEAP[:2]
    assert main(["validate", "--only", *keys]) == 0
    printed = capsys.readouterr().out.splitlines()
    for key, line in zip(keys, printed, strict=True):
        (cells,) = rows(parts(PAGE, key)[0])
        where = re.search(r"\[([^\]]*)\]", cells[0])[1]
        assert line == f"{where}: {cells[-1]}"


def test_every_result_is_on_the_page_with_its_figures():
    found = re.findall(r"<!-- result: (\S+) -->", PAGE)
    assert found == KEYS
    assert len(set(KEYS)) == len(KEYS)
    for path in re.findall(r"\]\((figures/[^)]+)\)", PAGE):
        assert (DOCS / path).is_file(), path
    for anchor in re.findall(r"\]\(#([^)]+)\)", PAGE):
        assert f'<a id="{anchor}"></a>' in PAGE


def test_every_number_agrees_with_its_closed_form_law_or_true_value():
    """Only differences from printed values and from other models may exceed their limits."""
    for key in KEYS:
        for cells in rows(parts(PAGE, key)[1])[1:]:
            name, printed, _, reference, _, verdict = cells
            exact = re.search(r"\((exact|law|true)\)", reference)
            assert not (exact and not printed and "not" in verdict), name


def test_verdicts_of_the_page_follow_from_its_numbers():
    """Every "within" of the page follows from its digits; the summary counts them."""
    for key in KEYS:
        row, section = parts(PAGE, key)
        table = rows(section)[1:]
        claims = [cells[5] for cells in table if cells[5]]
        kept = sum(not claim.startswith("**not**") for claim in claims)
        for cells in table:
            if not cells[5]:
                continue
            limit = float(NUMBER.findall(cells[5])[0])
            off = abs(float(NUMBER.findall(cells[4])[0]))
            if abs(off / limit - 1) > 0.02:  # Otherwise rounding may hide the verdict.
                assert (off < limit) == (not cells[5].startswith("**not**")), cells
        verdict = rows(row)[0][-1]
        expected = "agrees" if kept == len(claims) else f"agrees in {kept} of {len(claims)}"
        assert verdict == (expected if kept else "does not agree"), key


def test_the_amplitude_of_a_1r_is_compared_with_the_closed_form_of_the_same_model():
    """The closed form is r sin(v/(r omega)) at the model's own frequency."""
    frequency, amplitude = crossings(*chapter_4.swing(K_THESIS))
    assert chapter_4.harmonic_amplitude(frequency) == pytest.approx(amplitude, rel=1e-5)
    (row,) = [cells for cells in rows(parts(PAGE, "table-4-1")[1]) if "2.5449" in cells[0]]
    assert float(row[2]) == pytest.approx(1e3 * amplitude, abs=5.1e-4)
    assert float(row[3].split()[0]) == pytest.approx(1e3 * amplitude, abs=2e-3)


def test_both_modes_of_each_pair_are_on_the_page():
    """The mode that is further from the printed value is not left out."""
    found = [float(cells[2]) for cells in rows(parts(PAGE, "figure-6-5")[1])[1:5]]
    assert found == pytest.approx([107.24, 104.96, 202.7, 198.11], abs=0.02)


# --- numbers and results ------------------------------------------------------------------------


def test_differences_are_taken_from_the_printed_value_or_else_the_reference():
    assert Number("f", 5.75, "5.00", 6.0).difference == pytest.approx(0.15)
    assert Number("f", 5.75, None, 5.0).difference == pytest.approx(0.15)
    assert Number("f", None, "5.00", 6.0).difference == pytest.approx(0.2)
    assert Number("C", 0.61, "0.6", absolute=True).difference == pytest.approx(0.01)
    assert math.isnan(Number("alone", 1.0).difference)
    assert math.isnan(Number("reference alone", None, None, 1.0).difference)


def test_a_claim_holds_if_the_difference_is_within_its_limit():
    assert Number("x", 1.01, "1", within=0.02).agrees
    assert Number("x", 1.03, "1", within=0.02).agrees is False
    assert Number("x", 1.03, "1").agrees is None
    assert Number("x", 0.97, "1", within=0.02).cells()[4:] == ["-3.00 %", "**not** within 2 %"]


def result(key="one", *numbers):
    chosen_numbers = numbers or (Number("f, Hz", 5.0, "5.0", within=0.01),)
    return Result(key, f"Figure {key}", "title", chosen_numbers, "Explanation.")


def test_verdicts_count_claims():
    good, bad = Number("a", 1.0, "1", within=0.1), Number("b", 2.0, "1", within=0.1)
    assert result("k", good, good, Number("c", 1.0)).verdict == "agrees"
    assert result("k", good, bad).verdict == "agrees in 1 of 2"
    assert result("k", bad).verdict == "does not agree"
    assert result("k", Number("c", 1.0)).verdict == "no claims"


def test_results_that_are_not_computed_stay_on_the_page():
    both = page([result("one"), result("two")])
    other = Number("f, Hz", 7.0, "5.0", within=0.01)
    again = page([result("two", other)], both, ["one", "two", "three"])
    assert parts(again, "one") == parts(both, "one")
    assert "7" in parts(again, "two")[1]
    assert parts(again, "three") is None


def test_results_without_elements_can_be_reproduced_without_exudyn(tmp_path, monkeypatch):
    found_module = importlib.import_module

    def missing(name, *rest):
        if name.startswith("exudyn"):
            raise ImportError(f"No module named {name!r}")
        return found_module(name, *rest)

    monkeypatch.setattr("importlib.import_module", missing)
    fractions = []
    (found,) = reproduce(tmp_path / "docs", ["table-1"], fractions.append)
    assert found.verdict == "agrees"
    assert fractions[-1] == 1.0
    assert parts((tmp_path / "docs" / "validation.md").read_text("utf-8"), "table-1")
    with pytest.raises(finite_elements.FiniteElementError, match="pip install"):
        reproduce(tmp_path, ["finite-elements"])


def test_the_command_writes_and_lists_results_and_rejects_errors(tmp_path, capsys, monkeypatch):
    import matplotlib.figure

    drawn = Result("quick", "Figure 1", "title", (Number("x", 1.0),), "Explanation.", "",
                   (Drawing("quick", "A figure", matplotlib.figure.Figure()),))  # fmt: skip
    monkeypatch.setattr(validation, "RESULTS", (Reproduction("quick", lambda progress: drawn),))
    assert main(["validate", "--out", str(tmp_path)]) == 0
    assert (tmp_path / "figures" / "validation-quick.png").read_bytes().startswith(b"\x89PNG")
    assert "![A figure](figures/validation-quick.png)" in (tmp_path / "validation.md").read_text(
        encoding="utf-8"
    )
    assert main(["validate", "--list"]) == 0
    assert "quick" in capsys.readouterr().out
    assert main(["validate", "--only", "figure-9"]) == 2
    assert "unknown result 'figure-9'" in capsys.readouterr().err
    (tmp_path / "file").write_text("", encoding="utf-8")
    assert main(["validate", "--out", str(tmp_path / "file")]) == 2
    assert "file is a file" in capsys.readouterr().err


def test_an_unknown_result_is_rejected_with_the_known_ones():
    with pytest.raises(ValidationError, match=r"unknown result 'figure-1'; results are table-1, "):
        chosen(["figure-1"])
