"""Comparison of a mechanism with finite elements and measurements."""

import csv
import io
import math
from dataclasses import replace

import numpy as np
import pytest

from prbm.analysis.comparison import Comparison, Row, compare
from prbm.base.errors import ParameterError
from prbm.data.uncertainty import Estimate
from prbm.drawing.style import png
from prbm.mechanics.assembly import assemble
from prbm.mechanics.modal import modes
from prbm.mechanics.statics import equilibrium
from prbm.plots.comparison import comparison_figure
from prbm.references.finite_elements import FiniteElementError
from support import mechanism

MEASURED = {"frequency 1 at rest": Estimate(4.82, 0.06, "Hz")}


@pytest.fixture(scope="module")
def guide():
    pytest.importorskip("exudyn", reason="finite elements need exudyn: pip install exudyn")
    return compare(mechanism("PRBDM2R"), elements=8, measured=MEASURED)


@pytest.mark.slow
def test_a_chain_of_40_links_agrees_with_finite_elements():
    """Every quantity is within 0.9 %."""
    pytest.importorskip("exudyn", reason="finite elements need exudyn: pip install exudyn")
    base = mechanism("PRBDM2R")
    kind = replace(base.flexure_types[0], model="nR", n=40, axial=True, coefficients={})
    found = compare(replace(base, flexure_types=(kind,)), elements=16)
    assert len(found.rows) == 10
    for row in found.rows:
        assert abs(row.relative) < 0.009, row.name
    assert abs(found["modal restitution, stop"].error) < 5e-4


@pytest.mark.slow
def test_chains_of_links_converge_with_order_two():
    """Twice the links give a quarter of the error of rest position and fundamental frequency."""
    pytest.importorskip("exudyn", reason="finite elements need exudyn: pip install exudyn")
    base, errors = mechanism("PRBDM2R"), []
    for n in (8, 16):
        kind = replace(base.flexure_types[0], model="nR", n=n, axial=True, coefficients={})
        found = compare(replace(base, flexure_types=(kind,)), elements=32)
        errors.append([found[name].relative for name in ("rest position", "frequency 1 at rest")])
    np.testing.assert_allclose(np.divide(*errors), 4.0, rtol=0.1)


def test_the_holding_force_of_the_straight_guide_is_the_weight(guide):
    """Straight flexures carry no transverse force."""
    values = mechanism("PRBDM2R").values()
    leaf = math.prod(values[f"flexure.{x}"] for x in ("density", "length", "width", "thickness"))
    weight = -9.81 * (values["shuttle.mass"] + leaf)  # The ground carries half of each flexure.
    row = guide["holding force, straight"]
    assert row.model == pytest.approx(weight, rel=1e-4)
    assert row.elements == pytest.approx(weight, rel=1e-4)


def test_the_stiffness_of_the_straight_guide_is_that_of_two_beams(guide):
    """The stiffness is 24 EI/L^3; the elements agree to 2e-4 and the 2R to 0.8 %."""
    exact = 24 * (181.5e9 * 8e-3 * 1e-12 / 12) / 40e-3**3
    assert guide["stiffness, straight"].elements == pytest.approx(exact, rel=2e-4)
    assert guide["stiffness, straight"].model == pytest.approx(exact, rel=0.008)


def test_model_frequencies_equal_those_of_the_engine(guide):
    m = mechanism("PRBDM2R")
    system = assemble(m, m.values())
    f = modes(system, equilibrium(system)).frequency
    for i in (1, 2, 3):
        assert guide[f"frequency {i} at rest"].model == pytest.approx(f[i - 1], rel=1e-12)


def test_differences_from_measurements_are_in_units_of_their_uncertainty(guide):
    row = guide["frequency 1 at rest"]
    assert row.away(row.model) == pytest.approx((row.model - 4.82) / 0.06, rel=1e-12)
    assert math.isnan(guide["rest position"].away(1.0))
    exact = Row("x", "m", 1.0, 1.0, Estimate(2.0, 0.0))
    assert math.isnan(exact.away(1.0))


def test_a_comparison_can_be_printed_written_and_drawn(guide, tmp_path):
    text = str(guide)
    assert "4.820 ± 0.060 Hz" in text
    assert len(text.splitlines()) == 3 + len(guide.rows)
    rows = list(csv.reader(io.StringIO(guide.write(tmp_path / "c.csv").read_text("utf-8"))))
    assert {len(row) for row in rows} == {9}
    assert [row[0] for row in rows[1:]] == [row.name for row in guide.rows]
    by_name = {row[0]: row for row in rows}
    assert float(by_name["rest position"][2]) == guide["rest position"].model
    assert float(by_name["frequency 1 at rest"][5]) == 4.82
    assert png(comparison_figure(guide)).startswith(b"\x89PNG")


def test_an_unmovable_wall_gives_a_note_and_round_off_is_zero():
    """The wall's position is an expression; without gravity the holding force at rest is 0."""
    pytest.importorskip("exudyn", reason="finite elements need exudyn: pip install exudyn")
    fractions: list[float] = []
    found = compare(mechanism("ImpactOscillator"), elements=2, progress=fractions.append)
    assert found["rest position"].elements == found["rest position"].model == 0.0
    assert math.isnan(found["rest position"].relative)
    assert any("impact" in note for note in found.notes)
    assert fractions[-1] == 1.0
    assert fractions == sorted(fractions)


def test_friction_and_mass_proportional_damping_have_no_effect():
    """The comparison sets them to zero, since the elements do not have them."""
    pytest.importorskip("exudyn", reason="finite elements need exudyn: pip install exudyn")
    rubbed = {"friction.coefficient": 0.3, "friction.normal_force": 1.0, "damping.zeta": 0.1}
    plain, with_friction = (
        compare(mechanism("PRBDM"), values, elements=2) for values in ({}, rubbed)
    )
    assert str(plain) == str(with_friction)


def test_unknown_quantities_are_rejected(guide):
    with pytest.raises(ParameterError, match="'frequency' was measured but is not compared"):
        compare(mechanism("PRBDM"), elements=2, measured={"frequency": Estimate(4.8, 0.1)})
    with pytest.raises(
        ParameterError, match="was not compared; the compared quantities are rest position"
    ):
        guide["frequency"]


def test_without_exudyn_the_error_names_the_installation(monkeypatch):
    def missing(name):
        raise ImportError(f"No module named {name!r}")

    guide = mechanism("PRBDM")
    monkeypatch.setattr("importlib.import_module", missing)
    with pytest.raises(FiniteElementError, match="pip install"):
        compare(guide)


@pytest.mark.parametrize(
    ("row", "last"),
    [
        (Row("frequency 1 at rest", "Hz", 5.05, 5.0), "+1.00 %"),
        (Row("modal restitution, stop", "", 0.5, -0.05), "+0.55"),
        (Row("modal restitution, stop", "", 0.6, 0.5), "+0.1"),
        (Row("rest position", "m", 3e-6, 1e-6), "+200.00 %"),
        (Row("stiffness, straight", "N/m", 3310.0, 100.0), "+3210 %"),
        (Row("rest position", "m", 2e-6, 0.0), "+2e-06 m"),
        (Row("rest position", "m", 0.0, 0.0), " 0"),
    ],
)
def test_differences_have_a_percent_sign_or_a_unit_except_for_ratios(row, last):
    assert str(Comparison("some", 8, (row,))).endswith(last)
    assert png(comparison_figure(Comparison("some", 8, (row,)))).startswith(b"\x89PNG")


def test_high_frequencies_are_printed_in_khz():
    row = Row("frequency 3 at rest", "Hz", 12400.0, 12300.0)
    line = str(Comparison("some", 8, (row,))).splitlines()[-1]
    assert line.split() == ["frequency", "3", "at", "rest", "[kHz]", "12.4", "12.3", "+0.81", "%"]
