"""A mechanism beside finite elements and measurements: what must agree does, the rest is said."""

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
    pytest.importorskip("exudyn", reason="the finite elements are Exudyn's: pip install exudyn")
    return compare(mechanism("PRBDM2R"), elements=8, measured=MEASURED)


def test_a_chain_of_many_links_is_the_beam():
    """40 links that stretch: every quantity within 0.9 % (1/n^2) of the elements."""
    pytest.importorskip("exudyn", reason="the finite elements are Exudyn's: pip install exudyn")
    base = mechanism("PRBDM2R")
    kind = replace(base.flexure_types[0], model="nR", n=40, axial=True, coefficients={})
    found = compare(replace(base, flexure_types=(kind,)), elements=16)
    assert len(found.rows) == 10
    for row in found.rows:
        assert abs(row.relative) < 0.009, row.name
    assert abs(found["modal restitution, stop"].error) < 5e-4


@pytest.mark.slow
def test_a_chain_with_twice_the_links_is_four_times_as_near():
    """Order two in the rest position and the fundamental frequency."""
    pytest.importorskip("exudyn", reason="the finite elements are Exudyn's: pip install exudyn")
    base, errors = mechanism("PRBDM2R"), []
    for n in (8, 16):
        kind = replace(base.flexure_types[0], model="nR", n=n, axial=True, coefficients={})
        found = compare(replace(base, flexure_types=(kind,)), elements=32)
        errors.append([found[name].relative for name in ("rest position", "frequency 1 at rest")])
    np.testing.assert_allclose(np.divide(*errors), 4.0, rtol=0.1)


def test_the_holding_force_is_the_weight(guide):
    """Straight flexures carry nothing across: m g of all that hangs on them, by both sides."""
    values = mechanism("PRBDM2R").values()
    leaf = math.prod(values[f"flexure.{x}"] for x in ("density", "length", "width", "thickness"))
    weight = -9.81 * (values["shuttle.mass"] + leaf)  # half of each flexure is the ground's
    row = guide["holding force, straight"]
    assert row.model == pytest.approx(weight, rel=1e-4)
    assert row.elements == pytest.approx(weight, rel=1e-4)


def test_the_stiffness_is_that_of_two_beams(guide):
    """24 EI/L^3, which the elements have to 1e-4 and the 2R to 0.7 %."""
    exact = 24 * (181.5e9 * 8e-3 * 1e-12 / 12) / 40e-3**3
    assert guide["stiffness, straight"].elements == pytest.approx(exact, rel=2e-4)
    assert guide["stiffness, straight"].model == pytest.approx(exact, rel=0.008)


def test_model_values_are_the_engines(guide):
    m = mechanism("PRBDM2R")
    system = assemble(m, m.values())
    f = modes(system, equilibrium(system)).frequency
    for i in (1, 2, 3):
        assert guide[f"frequency {i} at rest"].model == pytest.approx(f[i - 1], rel=1e-12)


def test_measurements_are_off_in_units_of_their_uncertainty(guide):
    row = guide["frequency 1 at rest"]
    assert row.away(row.model) == pytest.approx((row.model - 4.82) / 0.06, rel=1e-12)
    assert math.isnan(guide["rest position"].away(1.0))
    exact = Row("x", "m", 1.0, 1.0, Estimate(2.0, 0.0))
    assert math.isnan(exact.away(1.0))


def test_a_comparison_is_a_table_a_file_and_a_figure(guide, tmp_path):
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


def test_walls_that_cannot_be_moved_are_noted_and_zeros_are_zeros():
    """No gravity: rest and holding force are 0; the hammer's wall has a place of its own."""
    pytest.importorskip("exudyn", reason="the finite elements are Exudyn's: pip install exudyn")
    told: list[float] = []
    found = compare(mechanism("ImpactOscillator"), elements=2, progress=told.append)
    assert found["rest position"].elements == found["rest position"].model == 0.0
    assert math.isnan(found["rest position"].relative)
    assert any("impact" in note for note in found.notes)
    assert told[-1] == 1.0
    assert told == sorted(told)


def test_friction_and_damping_in_proportion_to_mass_are_left_out():
    """They change no shape and no frequency here, and the elements do not know them."""
    pytest.importorskip("exudyn", reason="the finite elements are Exudyn's: pip install exudyn")
    rubbed = {"friction.coefficient": 0.3, "friction.normal_force": 1.0, "damping.zeta": 0.1}
    plain, with_friction = (
        compare(mechanism("PRBDM"), values, elements=2) for values in ({}, rubbed)
    )
    assert str(plain) == str(with_friction)


def test_what_is_not_compared_is_refused(guide):
    with pytest.raises(ParameterError, match="'frequency' was measured but is not compared"):
        compare(mechanism("PRBDM"), elements=2, measured={"frequency": Estimate(4.8, 0.1)})
    with pytest.raises(ParameterError, match="was not compared; there are rest position"):
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
        (Row("modal restitution, stop", "", 0.5, -0.05), "+0.55"),  # A ratio: not -1100 %.
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
