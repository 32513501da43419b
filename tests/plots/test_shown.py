"""Results in notebooks: short texts, figures, films, tables of pandas."""

import base64
import inspect
import io
import json
import pickle
import re
import sys
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image

import prbm
from compliant_pivot import two_compliant_stops
from prbm.runs import run
from prbm.runs.result import Result as BareResult
from prbm.runs.result import ResultError

PREVIEW_SIZE_MAX = 80_000  # Characters; a notebook keeps one for each shown result.


@pytest.fixture(scope="module")
def result() -> prbm.Result:
    guide = prbm.load("PRBDM")
    return prbm.simulate(guide, {"stop.position": "-1 mm"}, stop_time="0.06 s")


def picture(content: bytes) -> Image.Image:
    return Image.open(io.BytesIO(content))


def test_the_public_function_simulates_as_the_module_does(result):
    bare = run.simulate(result.mechanism, {"stop.position": -1e-3}, stop_time=0.06)
    np.testing.assert_array_equal(result.columns, bare.columns)
    assert result.start_values == bare.start_values
    assert type(result) is prbm.Result
    assert isinstance(result, BareResult)
    assert inspect.signature(prbm.simulate) == inspect.signature(run.simulate)


def test_texts_of_objects_fit_on_a_line(result):
    text = repr(result)
    count = len(result.columns.dtype)
    assert text == f"<Result of PRBDM: 0.06 s in 61 rows, {count} columns, impacts: 1>"
    for thing in (result, result.mechanism, *result.impacts):
        assert len(repr(thing)) < 120
        assert "\n" not in repr(thing)


def test_a_notebook_shows_the_summary_and_a_small_figure(result):
    shown = result._repr_html_()
    assert len(shown) < PREVIEW_SIZE_MAX
    assert "impacts at stop      1, the first at" in shown
    assert "&lt;Result of PRBDM" in shown
    (content,) = re.findall(r"base64,([\w+/=]+)", shown)
    assert picture(base64.b64decode(content)).size[0] <= 500


@pytest.mark.slow
def test_a_figure_is_shown_changed_and_saved(result, tmp_path):
    shown = result.plot()
    shown.figure.axes[0].set_title("changed")
    assert picture(shown._repr_png_()).format == "PNG"
    assert shown.save(tmp_path / "motion.png").read_bytes() == shown._repr_png_()


@pytest.mark.slow
def test_a_film_is_shown_and_saved(result, tmp_path):
    film = result.animate(slow=20.0, fps=5.0)
    assert repr(film) == f"<Film of {len(film.content)} bytes>"
    saved = picture(film.save(tmp_path / "motion.gif").read_bytes())
    assert saved.format == "GIF"
    assert saved.n_frames == pytest.approx(0.06 * 20 * 5, abs=1)
    assert base64.b64encode(film.content).decode() in film._repr_html_()


def test_columns_are_those_of_the_data_frame(result):
    frame = result.to_pandas()
    assert frame.index.name == "time"
    assert [*frame] == [name for name in result.columns.dtype.names if name != "time"]
    for name in frame:
        np.testing.assert_array_equal(frame[name], result[name])
    np.testing.assert_array_equal(frame.index, result["time"])


def test_tables_say_how_the_result_was_made(result):
    """The changed values are those that repeat the simulation."""
    made = result.to_pandas().attrs
    assert made["mechanism"] == "PRBDM"
    assert made["version"] == prbm.__version__
    assert made["engine"] == result.engine
    assert made["changes"] == {"stop.position": -1e-3}
    again = prbm.simulate(result.mechanism, made["changes"], stop_time="0.06 s")
    np.testing.assert_array_equal(again.columns, result.columns)
    texts = result.to_xarray().attrs
    assert json.loads(texts.pop("changes")) == made["changes"]
    assert texts == {name: made[name] for name in texts}
    assert all(isinstance(x, str) for x in texts.values())


def test_inputs_at_the_start_are_among_the_changes(result):
    driven = prbm.simulate(result.mechanism, {"force.x": "1 mN"}, stop_time="1 ms")
    assert driven.to_pandas().attrs["changes"] == {"force.x": 1e-3}


def test_units_of_the_columns_are_those_of_the_interface(result):
    """A force times a velocity has the unit of a power; the rate of a quantity is per second."""
    units = result.to_pandas().attrs["units"]
    assert [*units] == [*result]
    assert units["time"] == "s"
    assert units["stop.contact"] == units["stop.impact_count"] == ""
    for name, unit in units.items():
        rate = name.replace(".x", ".vx").replace(".gap", ".gap_rate").replace(".angle", ".omega")
        if rate != name and rate in units:
            assert units[rate] == f"{unit}/s"
    assert units["stop.force"] == "N"
    assert {unit for name, unit in units.items() if name.startswith("energy.")} == {"J"}


def test_a_data_set_has_the_columns_and_their_units(result):
    data = result.to_xarray()
    assert set(data.variables) == set(result)
    for name, unit in result.units().items():
        np.testing.assert_array_equal(data[name], result[name])
        assert data[name].attrs["units"] == unit
    assert float(data["shuttle.x"].sel(time=0.0)) == result["shuttle.x"][0]


def test_the_table_of_impacts_has_the_values_of_the_impacts(result):
    """One row for each impact, with the outputs that the stop has after it."""
    frame = result.impacts_to_pandas()
    assert frame.index.name == "number"
    assert [*frame.index] == [impact.latched.impact_count for impact in result.impacts]
    assert frame.attrs["units"]["impulse"] == "N.s"
    assert [*frame.attrs["units"]] == ["number", *frame]
    for name in frame.columns.drop(["stop", "time"]):
        assert [*frame[name]] == [getattr(impact.latched, name) for impact in result.impacts]
    assert [*frame["time"]] == [impact.time for impact in result.impacts]
    assert {*frame["stop"]} == {"stop"}


def test_the_table_of_no_impacts_has_the_columns(result):
    none = replace(result, impacts=()).impacts_to_pandas()
    assert len(none) == 0
    assert [*none.dtypes] == [*result.impacts_to_pandas().dtypes]


def test_cells_of_contacts_are_empty_for_rigid_stops():
    pivot = two_compliant_stops()
    upper, lower = pivot.stops
    rigid = replace(lower, law="rigid", stiffness=None, exponent=None)
    found = prbm.simulate(pivot, stop_time=0.05)
    hits = (found.impacts[0], replace(found.impacts[0], stop=lower.name))
    mixed = replace(pivot, stops=(upper, rigid))
    frame = replace(found, mechanism=mixed, impacts=hits).impacts_to_pandas()
    assert [*frame["stop"]] == ["upper", "lower"]
    for name in ("peak_force", "indentation", "contact_duration"):
        assert [*frame[name].isna()] == [False, True]


def test_a_missing_xarray_is_reported_with_a_remedy(result, monkeypatch):
    monkeypatch.setitem(sys.modules, "xarray", None)
    with pytest.raises(ResultError, match=r"install it with: .*prbm-impact\[notebook\]"):
        result.to_xarray()


def test_a_missing_pandas_is_reported_with_a_remedy(result, monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(ResultError, match=r"install it with: .*prbm-impact\[notebook\]"):
        result.to_pandas()
    with pytest.raises(ResultError, match=r"install it with: .*prbm-impact\[notebook\]"):
        result.impacts_to_pandas()


def test_quantities_of_a_result(result):
    assert result.quantity("impacts") == len(result.impacts)
    with pytest.raises(ResultError, match="unknown quantity 'setling'; did you mean settling"):
        result.quantity("setling")


def test_a_result_is_restored_from_a_pickle(result):
    back = pickle.loads(pickle.dumps(result))
    assert type(back) is prbm.Result
    np.testing.assert_array_equal(back.columns, result.columns)


def test_given_axes_have_the_same_curves_as_a_new_figure(result):
    """One axes shows the displacement, several show the first panels; nothing else is drawn."""
    new = result.plot().figure
    own = Figure()
    left, right = own.subplots(1, 2)
    assert result.plot(ax=left).figure is own
    assert not right.has_data()
    result.plot(ax=[right])
    one = Figure()
    result.plot(ax=one.subplots(2, 1))
    for drawn, expected in ((left, 0), (right, 0), (one.axes[0], 0), (one.axes[1], 1)):
        for line, same in zip(drawn.lines, new.axes[expected].lines, strict=True):
            np.testing.assert_array_equal(line.get_xydata(), same.get_xydata())
    with pytest.raises(ResultError, match="ax has 5 axes for 4 panels"):
        result.plot(ax=Figure().subplots(5, 1))
