"""Results with the columns of FMPy, their files and figures."""

import io
import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import fmpy.util
import matplotlib
import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from PIL import Image

from compliant_pivot import two_compliant_stops
from prbm.base.errors import PrbmError
from prbm.base.progress import reporter
from prbm.drawing.style import png
from prbm.files.mechanism_file import read_mechanism, shipped
from prbm.hybrid.simulation import Simulation
from prbm.mechanism.description import Mechanism
from prbm.plots.figures import response
from prbm.runs.headline import headline
from prbm.runs.marks import strongest_hit
from prbm.runs.result import Result, ResultError, UnknownColumnError, read_csv, rest_time
from prbm.runs.run import simulate
from support import SUPPORT


@pytest.fixture(scope="module")
def result(mechanisms: dict[str, Mechanism]) -> Result:
    return simulate(mechanisms["PRBDM"], stop_time=0.3)


def test_rows_are_the_outputs_of_the_simulation(
    result: Result, mechanisms: dict[str, Mechanism]
) -> None:
    simulation = Simulation(mechanisms["PRBDM"])
    simulation.advance(0.11)
    row = result.columns[110]
    for name, x in simulation.outputs().items():
        assert row[name] == pytest.approx(x, abs=1e-12)
    assert result["time"][-1] == 0.3
    assert len(result.columns) == 301


def test_every_impact_is_recorded(result: Result) -> None:
    assert len(result.impacts) == result["stop.impact_count"][-1]
    times = [impact.time for impact in result.impacts]
    assert times == sorted(times)


def test_integers_and_booleans_have_the_types_of_fmpy(result: Result) -> None:
    assert result.columns.dtype["stop.contact"] == np.bool_
    assert result.columns.dtype["stop.impact_count"] == np.int32
    assert result.columns.dtype["shuttle.x"] == np.float64


def test_the_last_step_ends_at_the_stop_time(mechanisms: dict[str, Mechanism]) -> None:
    short = simulate(mechanisms["PRBDM"], stop_time=0.005, step=0.002)
    np.testing.assert_allclose(short["time"], [0.0, 0.002, 0.004, 0.005], rtol=1e-15)


def test_inputs_act_from_their_row_on(mechanisms: dict[str, Mechanism]) -> None:
    """The work of a force that is constant within each step is force times displacement."""
    driven = simulate(
        mechanisms["PRBDM"], stop_time=0.03, source=lambda t: {"force.x": 0.2 if t < 0.01 else -0.1}
    )
    assert driven["force.x"][0] == 0.2
    assert driven["force.x"][10] == -0.1
    work = np.cumsum(driven["force.x"][:-1] * np.diff(driven["shuttle.x"]))
    np.testing.assert_allclose(driven["energy.work"][1:], work, atol=1e-9)


def test_values_are_those_at_the_start(mechanisms: dict[str, Mechanism]) -> None:
    driven = simulate(
        mechanisms["PRBDM"],
        {"stop.offset": 1e-3, "force.y": 0.1},
        stop_time=0.002,
        source=lambda t: {},
    )
    assert driven.start_values["stop.offset"] == 1e-3
    assert driven.start_values["force.y"] == 0.1
    assert driven.start_values["stop.restitution"] == 0.6


def test_progress_ends_at_one(mechanisms: dict[str, Mechanism]) -> None:
    fractions: list[float] = []
    simulate(mechanisms["PRBDM"], stop_time=0.004, progress=fractions.append)
    np.testing.assert_allclose(fractions, [0.0, 0.25, 0.5, 0.75, 1.0])


@pytest.mark.parametrize(
    ("settings", "sentence"),
    [
        ({"stop_time": 0.0}, "stop_time = 0 s must be positive"),
        ({"stop_time": np.inf}, "stop_time = inf s must be positive and finite"),
        ({"step": -1e-3}, "step = -0.001 s must be positive"),
        ({"step": 1e-9}, "step = 1e-09 s makes 1000000000 steps"),
        ({"changes": {"stop.restitutoin": 0.5}}, "did you mean stop.restitution"),
        ({"changes": {"stop.restitutoin": "0.5"}}, "did you mean stop.restitution"),
        ({"changes": {"stop.position": "1 kg"}}, "stop.position = 1 kg: the unit 'kg' has another"),
        ({"changes": ["stop.restitution"]}, r"changes = \['stop.restitution'\] must be a mapping"),
        ({"inputs": "force.x"}, "inputs = 'force.x' must be a mapping from names to values"),
        ({"stop_time": "a"}, "stop_time = a: write a number in s, or a number and a unit"),
        ({"stop_time": [1.0]}, r"stop_time = \[1\.0\] must be a number in s, or a text"),
        ({"step": "5 mm"}, "step = 5 mm: the unit 'mm' has another dimension"),
        ({"tolerance": "fine"}, "tolerance = fine: write a number"),
        ({"tolerance": 1.0}, "tolerance = 1 must lie between"),
    ],
)
def test_invalid_arguments_are_rejected(
    mechanisms: dict[str, Mechanism], settings: dict[str, float], sentence: str
) -> None:
    with pytest.raises(PrbmError, match=sentence):
        simulate(mechanisms["PRBDM"], **settings)


@pytest.mark.parametrize(
    ("given", "logged"),
    [
        ({"tolerance": 1e-3}, True),
        ({"changes": {"solver.tolerance": 1e-3}}, True),
        ({"tolerance": 1e-5}, False),
    ],
)
def test_a_replaced_tolerance_is_logged(
    mechanisms: dict[str, Mechanism], caplog: pytest.LogCaptureFixture, given, logged: bool
) -> None:
    simulate(mechanisms["PRBDM"], stop_time=1e-3, **given)
    assert ("tolerance = 0.001 is replaced by 1e-05" in caplog.text) == logged


def test_texts_with_units_equal_numbers_in_si(mechanisms: dict[str, Mechanism]) -> None:
    guide = mechanisms["PRBDM"]
    texts = simulate(guide, {"release.displacement": "-10 mm"}, stop_time="20 ms", step="2 ms")
    numbers = simulate(guide, {"release.displacement": -0.01}, stop_time=0.02, step=0.002)
    np.testing.assert_array_equal(texts.columns, numbers.columns)
    assert texts.start_values == numbers.start_values


def test_a_missing_column_is_an_error_of_its_own_with_a_proposal(result: Result) -> None:
    with pytest.raises(
        UnknownColumnError, match=r"^the result has no column 'stop\.gapp'; did"
    ) as e:
        result["stop.gapp"]
    assert "did you mean stop.gap or" in str(e.value)
    assert isinstance(e.value, KeyError)
    with pytest.raises(
        ResultError, match=r"^stop.restitution has .* result.start_values\['stop\.re"
    ):
        result["stop.restitution"]


def test_a_result_is_a_mapping_from_names_to_columns(result: Result) -> None:
    assert isinstance(result, Mapping)
    assert tuple(result) == tuple(result.keys()) == result.columns.dtype.names
    assert len(result) == len(result.columns.dtype)
    assert "stop.gap" in result
    assert "stop.gapp" not in result
    assert 0 not in result
    assert result.get("stop.gapp") is None
    copy = dict(result)
    for (name, x), y in zip(copy.items(), result.values(), strict=True):
        np.testing.assert_array_equal(x, result.columns[name])
        np.testing.assert_array_equal(y, result.columns[name])
    assert result == result
    assert result != replace(result)


def test_rest_time_is_the_first_row_of_the_last_hold(result: Result) -> None:
    t = rest_time(result.columns)
    assert t is not None
    row = round(t / 1e-3)
    assert result["stop.contact"][row:].all()
    assert not result["stop.contact"][row - 1]
    assert rest_time(result.columns[:100]) is None


def test_a_file_of_fmpy_is_read_back_exactly(tmp_path: Path, result: Result) -> None:
    fmpy.util.write_csv(tmp_path / "result.csv", result.columns)
    back = read_csv(tmp_path / "result.csv")
    assert back.dtype.names == result.columns.dtype.names
    for name in back.dtype.names:
        np.testing.assert_array_equal(back[name], result[name])


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "not a result"),
        ("shuttle.x,time\n0,0\n0,1\n", "not a result"),
        ("time,a\n0,0\n", "at least two rows must follow"),
        ("time,a,a\n0,0,0\n1,0,0\n", "two columns are named 'a'"),
        ("time,a\n0,0\n1\n", "row 3 has 1 values for 2 columns"),
        ("time,a\n0,0\n1,x\n", "row 3 has a cell that is not a number"),
    ],
)
def test_files_of_another_layout_are_rejected(tmp_path: Path, text: str, sentence: str) -> None:
    path = tmp_path / "result.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ResultError, match=sentence):
        read_csv(path)


def test_binary_files_are_rejected(tmp_path: Path) -> None:
    (tmp_path / "result.csv").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ResultError, match="not a CSV file"):
        read_csv(tmp_path / "result.csv")


def test_a_byte_order_mark_is_ignored(tmp_path: Path) -> None:
    (tmp_path / "result.csv").write_text("time,a\n0,0\n1,2\n", encoding="utf-8-sig")
    assert read_csv(tmp_path / "result.csv").dtype.names == ("time", "a")


@pytest.mark.parametrize("terminal", [True, False])
def test_progress_is_reported_after_a_second(
    terminal: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A terminal shows one updated line; another stream gets a line every five seconds."""
    clock = iter([0.0, *np.arange(0.5, 20.5, 0.5)])
    monkeypatch.setattr(time, "monotonic", lambda: next(clock))
    stream = io.StringIO()
    monkeypatch.setattr(stream, "isatty", lambda: terminal)
    report = reporter(stream)
    for k in range(1, 41):
        report(k / 40)
    written = stream.getvalue()
    if terminal:
        texts = [text.rstrip() for text in written.split("\r")]
        assert texts[:3] == ["", "  5%, 19 s left", "  8%, 19 s left"]
        assert texts[-2:] == [" 98%, 1 s left", "100%"]
    else:
        assert written.splitlines() == [
            "  5% done, 19 s left", " 30% done, 14 s left", " 55% done, 9 s left",
            " 80% done, 4 s left",
        ]  # fmt: skip


@pytest.mark.slow
def test_figures_do_not_depend_on_matplotlibrc(result: Result) -> None:
    plain = png(response(result))
    settings = {"lines.linewidth": 5.0, "savefig.transparent": True, "xtick.direction": "in"}
    with matplotlib.rc_context(settings):
        assert png(response(result)) == plain


@pytest.mark.slow
def test_the_response_shows_all_impacts_and_a_constant_balance(
    tmp_path: Path, result: Result
) -> None:
    figure = response(result)
    displacement, _, speeds, energies = figure.axes
    assert len(displacement.lines[1].get_xdata()) == len(result.impacts)
    closing, opening = (line.get_ydata() for line in speeds.lines)
    np.testing.assert_allclose(np.divide(opening, closing), 0.6, rtol=1e-6)
    balance = energies.lines[-1].get_ydata()
    assert np.ptp(balance) < 1e-5  # [mJ], of 17 mJ, at the default tolerance
    figure.savefig(tmp_path / "response.png")
    with Image.open(tmp_path / "response.png") as image:
        assert image.format == "PNG"


@pytest.mark.slow
def test_legends_of_the_response_do_not_cover_the_curves() -> None:
    """The curves of the cantilever leave little room."""
    figure = response(simulate(read_mechanism(shipped()["Cantilever"]), stop_time=0.06, step=1e-4))
    figure.draw_without_rendering()
    displacement, _, speeds, energies = figure.axes
    for axes in (displacement, speeds, energies):
        legend = axes.get_legend().get_window_extent()
        for line in axes.lines:
            points = axes.transData.transform(line.get_xydata())
            assert legend.count_contains(points) == 0, line.get_label()


def test_the_response_has_a_panel_per_recorded_quantity(result: Result) -> None:
    few = result.columns[["time", "shuttle.x", "shuttle.y"]]
    assert len(response(few, result.mechanism).axes) == 1
    with pytest.raises(ResultError, match=r"nothing to plot: record shuttle\.x"):
        response(result.columns[["time"]], result.mechanism)
    with pytest.raises(ResultError, match="give the mechanism"):
        response(few)


STIFF = {"flexure.thickness": 1e-3, "release.displacement": -3e-3}  # 150 Hz


def test_the_time_axis_ends_shortly_after_the_motion_has_settled(
    mechanisms: dict[str, Mechanism],
) -> None:
    """The stiff guide comes to rest at 36 ms; the free guide moves to the end of the result."""
    stiff = response(simulate(mechanisms["PRBDM"], STIFF, stop_time=0.2, step=1e-3))
    assert 36.0 < stiff.axes[-1].get_xlim()[1] < 45.0
    assert stiff.axes[-1].get_xlabel() == "time [ms]"
    free = simulate(mechanisms["PRBDM"], {"stop.position": 0.03}, stop_time=0.2)
    assert response(free).axes[-1].get_xlim()[1] == pytest.approx(200.0)


def test_a_result_without_motion_is_reported_and_not_plotted(
    mechanisms: dict[str, Mechanism],
) -> None:
    """The guide is released in its equilibrium without gravity; the columns contain round-off."""
    at_rest = {"gravity.x": 0.0, "release.displacement": 0.0, "stop.position": 5e-3}
    still = simulate(mechanisms["PRBDM2R"], at_rest, stop_time=0.05)
    still.columns["shuttle.x"][::2] += 1e-16
    (axes,) = response(still).axes
    assert not axes.lines
    assert [text.get_text() for text in axes.texts] == ["nothing moves in 0.05 s"]
    lines = headline(still.columns, still.mechanism, still.start_values)
    assert any("nothing moves" in line for line in lines)
    assert "impacts at stop      0, the smallest gap was 5.00 mm" in lines
    moving = simulate(mechanisms["PRBDM2R"], at_rest | {"force.x": 1e-6}, stop_time=0.05)
    lines = headline(moving.columns, moving.mechanism, moving.start_values)
    assert not any("nothing moves" in line for line in lines)


def test_round_off_of_a_resting_body_is_not_drawn() -> None:
    """The oscillator moves; the hammer, which is the released body, stays at rest."""
    pair = read_mechanism(shipped()["ImpactOscillator"])
    start = {"release.displacement": 0.0}
    result = simulate(pair, start, stop_time=0.05)
    result.columns["oscillator.x"] += 1e-4 * np.sin(100.0 * result["time"])
    result.columns["hammer.x"] += 1e-17 * np.sin(300.0 * result["time"])
    result.columns["hammer.vx"] += 1e-15
    axes, velocity, *_ = response(result).axes
    for panel in (axes, velocity):
        np.testing.assert_array_equal(panel.lines[0].get_ydata(), 0.0)
    low, high = axes.get_ylim()
    assert low < -1.0 < 1.0 < high  # [mm]


def wall_of(figure: Figure) -> Line2D:
    """Return the line of the wall in the panel of the displacement."""
    (line,) = [line for line in figure.axes[0].lines if line.get_label() == "wall"]
    return line


def test_the_panel_of_the_displacement_shows_the_wall(mechanisms: dict[str, Mechanism]) -> None:
    """The wall is fixed and hit off the centre of mass, or it moves, or it is on another body."""
    guide = mechanisms["PRBDM2R"]
    fixed = simulate(guide, {"stop.position": -2e-3, "stop.offset": 4e-3}, stop_time=0.1)
    np.testing.assert_allclose(wall_of(response(fixed)).get_ydata(), -2.0, atol=0.05)
    moving = simulate(
        mechanisms["PRBDM"],
        stop_time=0.1,
        source=lambda t: {"stop.displacement": 1e-3 * t / 0.1, "stop.velocity": 1e-2},
    )
    assert wall_of(response(moving)).get_ydata()[-1] == pytest.approx(1.0, rel=0.02)
    pair = simulate(read_mechanism(shipped()["ImpactOscillator"]), stop_time=0.2)
    expected = 1e3 * pair["oscillator.x"] + 2.0
    np.testing.assert_allclose(wall_of(response(pair)).get_ydata(), expected, atol=1e-6)
    far = simulate(mechanisms["PRBDM"], {"stop.position": 0.079}, stop_time=0.01)
    assert "wall" not in [line.get_label() for line in response(far).axes[0].lines]


def test_forces_of_compliant_stops_have_marks_at_their_peaks() -> None:
    """A hit between two rows has a mark at its peak."""
    pivot = two_compliant_stops()
    result = simulate(pivot, stop_time=0.1, step=1e-3)
    figure = response(result)
    (panel,) = [axes for axes in figure.axes if axes.get_ylabel() == "stop force [N]"]
    names = [text.get_text() for text in panel.get_legend().get_texts()]
    assert names == [stop.name for stop in pivot.stops]
    drawn = np.concatenate([np.ravel(line.get_ydata()) for line in panel.lines])
    largest = max(impact.latched.peak_force for impact in result.impacts)
    rows = max(result[f"{name}.force"].max() for name in names)
    assert drawn.max() == pytest.approx(max(largest, rows), rel=1e-12)


def test_the_strongest_hit_has_its_own_indentation_and_duration() -> None:
    """Later contacts are weaker and last longer."""
    result = simulate(two_compliant_stops(), stop_time=0.1, step=1e-3)
    hits = [impact.latched for impact in result.impacts if impact.stop == "upper"]
    best = max(hits, key=lambda hit: hit.peak_force)
    expected = best.peak_force, best.indentation, best.contact_duration
    assert strongest_hit(result, "upper") == expected
    from_columns = strongest_hit(result.columns, "upper")
    np.testing.assert_allclose(from_columns, expected, rtol=1e-12)


def test_the_panel_of_the_rotation_shows_the_wall() -> None:
    """The wheel is at the rotation of the wall when it hits it."""
    pivot = read_mechanism(SUPPORT / "pivot.toml")
    result = simulate(pivot, stop_time=0.2)
    panel = response(result).axes[0]
    assert panel.get_ylabel() == "rotation [deg]"
    walls = {
        line.get_label(): line.get_ydata()[0]
        for line in panel.lines
        if line.get_label() not in ("wheel", "impact")
    }
    hit = result.impacts[0]
    angle = np.degrees(np.interp(hit.time, result["time"], result["wheel.angle"]))
    name = hit.stop if len(pivot.stops) > 1 else "wall"
    assert walls[name] == pytest.approx(angle, abs=0.1)


@pytest.mark.slow
@pytest.mark.parametrize("speeds", [[0.5], [0.9, 0.3], [0.3, 0.04], [0.9, 0.2, 0.03], [2.0, 1e-4]])
def test_axes_of_impact_speeds_have_several_labels(result: Result, speeds: list[float]) -> None:
    impacts = tuple(
        replace(impact, latched=replace(impact.latched, approach_speed=v, rebound_speed=0.6 * v))
        for impact, v in zip(result.impacts, speeds, strict=False)
    )
    figure = response(replace(result, impacts=impacts))
    figure.draw_without_rendering()
    axes = figure.axes[2]
    low, high = axes.get_ylim()
    labels = zip(axes.get_yticks(), axes.get_yticklabels(), strict=True)
    assert len([text for y, text in labels if low <= y <= high and text.get_text()]) >= 2


def test_units_of_the_panels_follow_the_magnitudes(mechanisms: dict[str, Mechanism]) -> None:
    small = {"release.displacement": -1e-5, "gravity.x": 0.0, "stop.rest_speed": 1e-6}
    figure = response(simulate(mechanisms["PRBDM"], small, stop_time=0.1))
    labels = [axes.get_ylabel() for axes in figure.axes]
    assert labels == ["displacement [µm]", "velocity [mm/s]", "impact speed [mm/s]", "energy [nJ]"]


def test_the_curves_of_a_figure_pass_through_the_impacts(mechanisms):
    """Between two samples the body reaches the wall, and its velocity jumps by the restitution."""
    result = simulate(mechanisms["PRBDM"], {"stop.position": 2e-3}, stop_time=0.2, step=0.01)
    figure = response(result)
    moved, speed = (axes.lines[0].get_xydata() for axes in figure.axes[:2])
    wall, e = 1e3 * result.start_values["stop.position"], result.start_values["stop.restitution"]
    assert len(result.impacts) > 2
    for hit in result.impacts:
        rows = np.flatnonzero(moved[:, 0] == 1e3 * hit.time)
        np.testing.assert_allclose(moved[rows, 1], wall, rtol=1e-9)
        before, after = speed[rows, 1]
        assert before == pytest.approx(hit.latched.approach_speed, rel=1e-6)
        assert after == pytest.approx(-e * before, rel=1e-6)
    assert (np.diff(moved[:, 0]) >= 0.0).all()
    marks = next(line for line in figure.axes[0].lines if line.get_label() == "impact")
    np.testing.assert_allclose(marks.get_ydata(), wall, rtol=1e-9)
