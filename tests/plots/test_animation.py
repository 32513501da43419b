"""Films: shapes to scale at the recorded times, complete files, error messages."""

import math
import re
import shlex
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import fmpy
import fmpy.cli
import fmpy.util
import matplotlib
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from compliant_pivot import two_compliant_stops
from fmu_host import simulate_fmu
from prbm.base.errors import ParameterError
from prbm.commands.command_line import main
from prbm.drawing.shapes import CURVED_PIVOTS_MAX, curve
from prbm.mechanism.description import Mechanism
from prbm.plots import animation
from prbm.plots.animation import AnimationError, animate, show, write_film
from prbm.plots.motion import film, motion, needed
from prbm.plots.scene import Scene, pictures
from prbm.runs.marks import marks
from prbm.runs.result import Result, ResultError
from prbm.runs.run import simulate

matplotlib.use("Agg")

STOP_TIME = 0.12  # Both guides hit twice in this time [s].
POSITION_ATOL = 1e-12  # Round-off of positions [m].


@pytest.fixture(scope="module", params=["PRBDM", "PRBDM2R"])
def result(request: pytest.FixtureRequest, mechanisms: dict[str, Mechanism]) -> Result:
    return simulate(mechanisms[request.param], stop_time=STOP_TIME)


@pytest.fixture(scope="module")
def short(mechanisms: dict[str, Mechanism]) -> Result:
    return simulate(mechanisms["PRBDM"], stop_time=0.06)


def places(artist: object, scene: Scene) -> np.ndarray:
    """Return the points of an artist of a scene as complex numbers [m]."""
    xy = artist.get_xydata() if hasattr(artist, "get_xydata") else artist.get_path().vertices[:4]
    return np.asarray(xy) @ np.array([1, 1j]) / scene.factor


def scene_of(result: Result, **settings: float) -> Scene:
    moved = motion(result)
    return Scene(moved, film(moved, **settings))


# --- drawn shapes -----------------------------------------------------------------------------


def test_links_are_drawn_at_their_recorded_angles_with_their_lengths(result: Result) -> None:
    scene = scene_of(result, slow=40.0, fps=25.0)  # A frame at every communication point.
    h = result.start_values["flexure.length"] / 2
    if "flexure.gamma" in result.start_values:
        gamma = result.start_values["flexure.gamma"]
        lengths = h * np.array([1 - gamma, 2 * gamma, 1 - gamma])
    else:
        g1, g2 = result.start_values["flexure.gamma1"], result.start_values["flexure.gamma2"]
        lengths = h * np.array([1 - g1 - g2, g1, 2 * g2, g1, 1 - g1 - g2])
    per_flexure = len(lengths) - 2
    for k in (0, 17, 60, 120):
        assert k not in scene.film.hits
        scene.frame(k)
        row = result.columns[k]
        assert scene.film.times[k] == pytest.approx(row["time"], abs=1e-12)
        for number, line in enumerate(scene.links.values()):
            z = places(line, scene)
            np.testing.assert_allclose(np.abs(np.diff(z)), lengths, atol=POSITION_ATOL)
            drawn = np.angle(np.diff(z)[1:-1])
            names = [f"link[{number * per_flexure + i + 1}].angle" for i in range(per_flexure)]
            np.testing.assert_allclose(drawn, [row[name] for name in names], atol=1e-9)


def test_bodies_are_drawn_at_their_recorded_positions(result: Result) -> None:
    scene = scene_of(result, slow=40.0, fps=25.0)
    width, length = result.start_values["shuttle.width"], result.start_values["flexure.length"]
    centre = complex(width / 2, length + result.start_values["shuttle.com_height"])
    for k in (0, 30, 95):
        scene.frame(k)
        row = result.columns[k]
        corners = places(scene.bodies["shuttle"], scene)
        expected = centre + complex(row["shuttle.x"], row["shuttle.y"])
        assert abs(corners.mean() - expected) < 1e-9
        side = corners[1] - corners[0]
        assert abs(side) == pytest.approx(width, rel=1e-12)
        assert np.angle(side) == pytest.approx(row["shuttle.angle"], abs=1e-12)


def test_flexures_end_at_the_ground_and_the_body(result: Result) -> None:
    scene = scene_of(result)
    scene.frame(40)
    lower = places(scene.bodies["shuttle"], scene)[:2]
    for name, line in scene.links.items():
        z = places(line, scene)
        assert min(abs(z[-1] - corner) for corner in lower) < POSITION_ATOL
        drawn = places(scene.curves[name], scene)
        assert max(abs(drawn[0] - z[0]), abs(drawn[-1] - z[-1])) < POSITION_ATOL


@pytest.mark.parametrize("recorded", [True, False], ids=["engine", "columns"])
def test_the_hit_point_touches_the_wall_in_the_frame_of_an_impact(
    mechanisms: dict[str, Mechanism], recorded: bool
) -> None:
    """The wall moves; the impacts are known from the engine, or from latched outputs only."""
    omega = 2 * math.pi * 12

    def wall(t: float) -> dict[str, float]:
        return {
            "stop.displacement": 2e-3 * math.sin(omega * t),
            "stop.velocity": 2e-3 * omega * math.cos(omega * t),
        }

    values = {"stop.offset": -5e-3, "stop.position": 1e-3}
    result = simulate(mechanisms["PRBDM2R"], values, stop_time=0.15, source=wall)
    count = len(result.impacts)
    assert count >= 2
    scene = scene_of(result if recorded else replace(result, impacts=()), slow=20.0)
    assert 2 <= len(scene.film.hits) <= count
    for k, mark in scene.film.hits.items():
        assert scene.film.times[k] == mark.time
        scene.frame(k)
        hit, line = places(scene.hits["stop"], scene)[0], places(scene.walls["stop"], scene)
        # Between two rows the wall is drawn on a line; its cubic deviates by a h^2/8.
        assert abs(hit.real - line[0].real) < 2e-3 * omega**2 * 1e-3**2 / 8
        assert line[0].imag < hit.imag < line[1].imag or line[1].imag < hit.imag < line[0].imag
        assert scene.flashes["stop"].get_visible()
        assert scene.flashes["stop"].get_alpha() == 1.0
    scene.frame(0)
    assert not scene.flashes["stop"].get_visible()


def test_the_drawn_gap_is_the_recorded_one(result: Result) -> None:
    scene = scene_of(result, slow=40.0, fps=25.0)
    for k in (0, 20, 70):
        scene.frame(k)
        gap = places(scene.walls["stop"], scene)[0].real - places(scene.hits["stop"], scene)[0].real
        assert gap == pytest.approx(result["stop.gap"][k], abs=1e-9)


def test_loops_are_closed_between_two_rows(result: Result) -> None:
    moved = motion(result)
    for t in (0.0123456, 0.0777):
        e = np.exp(1j * moved.shape(t)[0])
        opened = (moved.system.loops @ e).real + moved.system.loops_c
        assert np.abs(opened).max() < POSITION_ATOL


@pytest.mark.slow
@pytest.mark.fmu
def test_results_of_fmpy_and_of_the_engine_give_equal_films(
    mechanisms: dict[str, Mechanism], fmus: dict[str, Path]
) -> None:
    mechanism = mechanisms["PRBDM"]
    of_engine = simulate(mechanism, {"stop.offset": 2e-3}, stop_time=STOP_TIME, engine="python")
    of_fmpy = simulate_fmu(
        fmus["PRBDM"],
        stop_time=STOP_TIME,
        output_interval=1e-3,
        start_values={"stop.offset": 2e-3},
        output=needed(mechanism),
    )
    assert of_fmpy.dtype.names == ("time", *of_fmpy.dtype.names[1:])
    one = motion(of_engine)
    other = motion(of_fmpy, mechanism, {"stop.offset": 2e-3})
    scenes = [Scene(m, film(m, slow=10.0)) for m in (one, other)]
    assert [m.count for m in one.marks] == [m.count for m in other.marks] == [1, 2]
    for k in (0, 3, *scenes[0].film.hits, 25):
        drawn = []
        for scene in scenes:
            scene.frame(k)
            artists = [*scene.links.values(), *scene.hits.values(), *scene.walls.values()]
            drawn.append(np.concatenate([places(artist, scene) for artist in artists]))
        np.testing.assert_allclose(drawn[0], drawn[1], atol=1e-9, equal_nan=True)
    one_frame, other_frame = (next(pictures(scene, [12])) for scene in scenes)
    assert (one_frame != other_frame).mean() < 1e-3  # Antialiasing may differ by rounding.


def test_shapes_at_impacts_known_from_columns_only_are_close(
    mechanisms: dict[str, Mechanism],
) -> None:
    """The shape is interpolated between two rows and moved to the wall; it errs by 0.6 pixels."""
    result = simulate(mechanisms["PRBDM2R"], stop_time=0.06)
    exact, estimated = motion(result), motion(replace(result, impacts=()))
    t = exact.marks[0].time
    assert estimated.marks == exact.marks
    outline = next(o for o in exact.system.outlines if o.name == "left_flexure")
    apart = [outline.c + outline.A @ np.exp(1j * m.shape(t)[0]) for m in (exact, estimated)]
    scene = Scene(exact, film(exact))
    scene.figure.canvas.draw()
    left, right = scene.stage.transData.transform([(0.0, 0.0), (scene.factor, 0.0)])[:, 0]
    assert np.abs(apart[0] - apart[1]).max() * (right - left) < 0.6


def test_a_clamped_flexure_is_drawn_as_the_elastic_line() -> None:
    """If both ends are clamped, y = d (3 s^2 - 2 s^3).  At a pin, the curvature is zero."""
    guided = curve(np.array([0.0, 0.1, 0.9 + 0.05j, 1.0 + 0.05j]), (True, True))
    s = np.linspace(0.0, 1.0, len(guided))
    np.testing.assert_allclose(guided.imag, 0.05 * (3 * s**2 - 2 * s**3), atol=1e-15)
    pinned = curve(np.array([0.0, 0.15, 1.0 + 0.2j, 1.0 + 0.2j]), (True, False))
    np.testing.assert_allclose(pinned.imag, 0.2 * (3 * s**2 - s**3) / 2, atol=1e-15)


def test_only_flexures_of_few_links_have_a_smooth_curve(result: Result) -> None:
    assert all(len(line.c) - 2 <= CURVED_PIVOTS_MAX for line in motion(result).system.outlines)
    assert scene_of(result).curves.keys() == {"left_flexure", "right_flexure"}


def test_a_beam_is_drawn_as_its_own_curve(mechanisms: dict[str, Mechanism]) -> None:
    scene = scene_of(simulate(mechanisms["GuideBeam"], stop_time=0.02))
    scene.frame(1)
    for name, line in scene.links.items():
        np.testing.assert_array_equal(places(scene.curves[name], scene), places(line, scene))


def test_axes_are_to_scale_and_contain_the_whole_motion(result: Result) -> None:
    scene = scene_of(result)
    FigureCanvasAgg(scene.figure).draw()
    (x0, y0), (x1, y1) = scene.stage.transData.transform([(0.0, 0.0), (1.0, 1.0)])
    assert x1 - x0 == pytest.approx(y1 - y0, rel=1e-9)
    (left, right), (low, high) = scene.stage.get_xlim(), scene.stage.get_ylim()
    for k in range(0, len(scene.film.times), 10):
        scene.frame(k)
        for artist in (*scene.links.values(), *scene.bodies.values(), *scene.hits.values()):
            z = places(artist, scene) * scene.factor
            assert left < z.real.min() <= z.real.max() < right
            assert low < z.imag.min() <= z.imag.max() < high


def test_caption_and_trace_show_impacts_and_rest(
    mechanisms: dict[str, Mechanism],
) -> None:
    result = simulate(mechanisms["PRBDM"], stop_time=0.3)
    scene = scene_of(result, slow=10.0, stop=0.3)
    scene.frame(len(scene.film.times) - 1)
    assert "t = 300.0 ms   10x slower   impacts 14   at rest" in scene.text.get_text()
    assert len(scene.ticks.get_xdata()) == 14
    scene.frame(0)
    assert "impacts  0" in scene.text.get_text()
    assert "rest" not in scene.text.get_text()


def test_the_gaps_of_several_stops_have_names() -> None:
    pivot = two_compliant_stops()
    scene = scene_of(simulate(pivot, stop_time=0.01), slow=10.0, stop=0.01)
    names = [text.get_text() for text in scene.trace.get_legend().get_texts()]
    assert names == [stop.name for stop in pivot.stops]


def test_a_film_ends_shortly_after_the_motion(mechanisms: dict[str, Mechanism]) -> None:
    """The guide comes to rest at 0.243 s.  A motion without rest is shown to its end."""
    moved = motion(simulate(mechanisms["PRBDM"], stop_time=0.6))
    assert 0.23 < film(moved).times[-1] < 0.3
    assert film(moved, start=0.3, slow=1.0).times[-1] == pytest.approx(0.6, abs=0.05)
    bouncing = motion(simulate(mechanisms["PRBDM"], stop_time=0.1))
    assert film(bouncing).times[-1] == pytest.approx(0.1, abs=1e-3)


# --- files ------------------------------------------------------------------------------------


def test_a_gif_has_a_frame_for_every_time(tmp_path: Path, short: Result) -> None:
    fractions: list[float] = []
    path = animate(short, tmp_path / "motion.gif", slow=20.0, fps=10.0, progress=fractions.append)
    with Image.open(path) as image:
        assert image.format == "GIF"
        assert image.n_frames == 0.06 * 20 * 10 + 1
        assert image.info["duration"] == 100  # ms
        assert image.info["loop"] == 0  # Repeat forever.
        image.seek(5)
        frame = np.asarray(image.convert("RGB"))
    expected = next(pictures(scene_of(short, slow=20.0, fps=10.0), [5]))
    assert frame.shape == expected.shape
    assert np.abs(frame.astype(int) - expected).mean() < 0.5  # Colours are from 0 to 255.
    assert fractions == sorted(fractions)
    assert fractions[-1] == 1.0
    assert [p.name for p in tmp_path.iterdir()] == ["motion.gif"]


@pytest.mark.slow
def test_an_mp4_has_a_frame_for_every_time(tmp_path: Path, short: Result) -> None:
    imageio_ffmpeg = pytest.importorskip("imageio_ffmpeg")
    path = animate(short, tmp_path / "motion.mp4", slow=20.0, fps=10.0)
    frames, seconds = imageio_ffmpeg.count_frames_and_secs(str(path))
    assert frames == 13
    assert seconds == pytest.approx(1.3, abs=0.01)
    assert [p.name for p in tmp_path.iterdir()] == ["motion.mp4"]


def test_a_failed_film_leaves_the_old_file(
    tmp_path: Path, short: Result, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "motion.gif"
    path.write_text("the old one", encoding="utf-8")

    def interrupt(fraction: float) -> None:
        if fraction > 0.5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        animate(short, path, slow=5.0, fps=10.0, progress=interrupt)
    assert path.read_text(encoding="utf-8") == "the old one"
    assert [p.name for p in tmp_path.iterdir()] == ["motion.gif"]


def test_messages_of_a_failed_encoder_are_quoted(
    tmp_path: Path, short: Result, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Python in place of ffmpeg rejects its options."""
    monkeypatch.setattr("shutil.which", lambda program: sys.executable)
    with pytest.raises(AnimationError, match=r"failed: .*(option|usage)"):
        animate(short, tmp_path / "motion.mp4", slow=5.0)
    assert list(tmp_path.iterdir()) == []


def test_a_window_shows_the_film(short: Result, monkeypatch: pytest.MonkeyPatch) -> None:
    figure = Figure()
    canvas = FigureCanvasAgg(figure)
    shown: list[bool] = []

    def run(block: bool) -> None:
        canvas.draw()
        shown.append(block)

    window = (SimpleNamespace(show=run), figure)
    monkeypatch.setattr(animation, "_window", lambda: window)
    show(short, slow=10.0)
    assert shown == [True]
    assert len(figure.axes) == 2


# --- errors -----------------------------------------------------------------------------------


def test_a_missing_display_is_reported_with_a_remedy(short: Result) -> None:
    with pytest.raises(AnimationError, match=r"no window can be opened: .*animate\(result"):
        show(short)


def test_columns_without_their_mechanism_are_rejected(short: Result) -> None:
    with pytest.raises(ResultError, match="give the mechanism"):
        motion(short.columns)


def test_missing_angles_are_named_with_the_variables_to_record(short: Result) -> None:
    few = short.columns[["time", "shuttle.angle", "link[1].angle"]]
    with pytest.raises(ResultError, match=r"lacks link\[2\]\.angle; record .*needed\(mechanism"):
        motion(few, short.mechanism)


def test_angles_of_another_mechanism_are_rejected(short: Result) -> None:
    columns = short.columns.copy()
    columns["link[1].angle"] += 0.1
    with pytest.raises(ResultError, match="loops of PRBDM are open"):
        motion(columns, short.mechanism)
    columns["link[1].angle"] = np.nan
    with pytest.raises(ResultError, match="not finite numbers"):
        motion(columns, short.mechanism)


def test_decreasing_times_are_rejected(short: Result) -> None:
    with pytest.raises(ResultError, match="must not decrease"):
        motion(short.columns[::-1], short.mechanism)


def test_a_result_without_latched_outputs_has_no_marks(short: Result) -> None:
    bare = short.columns[["time", "shuttle.angle", "link[1].angle", "link[2].angle"]]
    assert marks(bare, short.mechanism) == ()
    moved = motion(bare, short.mechanism)
    np.testing.assert_allclose(moved.walls, 0.0)
    assert not moved.holds.any()


@pytest.mark.parametrize(
    ("settings", "sentence"),
    [
        ({"slow": 0.0}, "slow = 0 must be positive"),
        ({"slow": 1e6}, r"makes a film of \d+ frames; .* about 200 for ten seconds"),
        ({"slow": 1e-3}, "makes a film of 1 frames"),
        ({"fps": 100.0}, "fps = 100 must lie between 1 and 50"),
        ({"start": 0.05, "stop": 0.01}, "choose a span within 0 s to 0.06 s"),
        ({"stop": 9.0}, "choose a span within 0 s to 0.06 s"),
    ],
)
def test_films_with_too_few_or_too_many_frames_are_rejected(
    short: Result, settings: dict[str, float], sentence: str
) -> None:
    with pytest.raises(ParameterError, match=sentence):
        film(motion(short), **settings)


def test_other_kinds_of_files_are_rejected(tmp_path: Path, short: Result) -> None:
    with pytest.raises(AnimationError, match=r"end the name in \.gif or \.mp4"):
        animate(short, tmp_path / "motion.avi")


def test_a_missing_folder_is_reported(tmp_path: Path, short: Result) -> None:
    with pytest.raises(AnimationError, match=r"motion\.gif: cannot be written \(No such file"):
        animate(short, tmp_path / "nowhere" / "motion.gif", slow=5.0)


def test_a_missing_ffmpeg_is_reported_with_a_remedy(
    tmp_path: Path, short: Result, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("shutil.which", lambda program: None)
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(AnimationError, match=r"pip install imageio-ffmpeg, or write a \.gif"):
        animate(short, tmp_path / "motion.mp4")


def test_a_missing_pillow_is_reported_with_a_remedy(
    tmp_path: Path, short: Result, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "PIL.Image", None)
    with pytest.raises(AnimationError, match="pip install pillow"):
        animate(short, tmp_path / "motion.gif")


# --- command ----------------------------------------------------------------------------------


@pytest.mark.slow
def test_the_command_simulates_a_mechanism_and_writes_the_film(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "motion.gif"
    arguments = ["--model", "PRBDM", "--set", "stop.restitution=0.3", "--stop-time", "0.06"]
    assert main(["animate", *arguments, "--slow", "10", "--fps", "10", str(path)]) == 0
    assert capsys.readouterr().out == f"{path}\n"
    with Image.open(path) as image:
        assert image.n_frames == 7


@pytest.mark.slow
def test_the_command_identifies_the_mechanism_of_a_result(tmp_path: Path, short: Result) -> None:
    """FMPy writes all digits, so that the films are identical."""
    fmpy.util.write_csv(tmp_path / "result.csv", short.columns)
    written = [str(tmp_path / "result.csv"), str(tmp_path / "a.gif")]
    assert main(["animate", *written, "--slow", "5", "--fps", "10"]) == 0
    columns = replace(short, impacts=())
    animate(columns, tmp_path / "b.gif", slow=5.0, fps=10.0)
    assert (tmp_path / "a.gif").read_bytes() == (tmp_path / "b.gif").read_bytes()


def test_the_command_shows_a_time_span(tmp_path: Path) -> None:
    path = tmp_path / "motion.gif"
    span = ["--from", "0.02", "--to", "0.04", "--slow", "20", "--fps", "10"]
    assert main(["animate", "--model", "PRBDM", "--stop-time", "0.05", *span, str(path)]) == 0
    with Image.open(path) as image:
        assert image.n_frames == 0.02 * 20 * 10 + 1


@pytest.mark.slow
@pytest.mark.fmu
def test_for_a_result_without_links_a_command_that_records_them_is_printed(
    tmp_path: Path,
    fmus: dict[str, Path],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    for name, path in fmus.items():
        (tmp_path / f"{name}.fmu").write_bytes(path.read_bytes())
    outputs = simulate_fmu(fmus["PRBDM"], stop_time=0.01)
    fmpy.util.write_csv("result.csv", outputs)
    commands = []
    for model in ([], ["--model", "PRBDM"]):
        assert main(["animate", *model, "result.csv", "out.gif"]) == 2
        lines = capsys.readouterr().err.splitlines()
        commands.append(next(line for line in lines if line.startswith("fmpy simulate PRBDM.fmu")))
    assert commands[0] == commands[1]
    monkeypatch.setattr(sys, "argv", [*shlex.split(commands[0]), "--stop-time", "0.02"])
    fmpy.cli.main()
    assert main(["animate", "result.csv", "out.gif", "--slow", "20", "--fps", "10"]) == 0


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["out.gif"], "nothing to show: give RESULT.csv, MECHANISM, --model or --mechanism"),
        (
            ["--model", "PRBDN", "out.gif"],
            "unknown mechanism 'PRBDN' (mechanism files end in .toml); did you mean PRBDM",
        ),
        (["--model", "PRBDM", "out.bmp"], "end the name in .gif or .mp4"),
        (["--model", "PRBDM", "--set", "stop.restitution", "out.gif"], "write NAME=VALUE"),
        (["--model", "PRBDM", "--set", "stop.restitution=2", "out.gif"], "must be at most 1"),
        (["--model", "PRBDM", "--set", "stop.restitutoin=1", "out.gif"], "did you mean stop.rest"),
        (["--model", "PRBDM", "--stop-time", "-1", "out.gif"], "stop_time = -1 s must be positive"),
        (["--mechanism", "none.toml", "out.gif"], "none.toml: cannot be read"),
        (["none.csv", "out.gif"], "none.csv: cannot be read"),
        (["a.csv", "b.csv", "out.gif"], "3 files are given"),
        (["--model", "PRBDM", "--slow", "x", "out.gif"], "invalid float value"),
    ],
)
def test_mistakes_are_reported_in_one_sentence(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    arguments: list[str],
    sentence: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["animate", *arguments]) == 2
    assert sentence in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_an_unidentified_mechanism_must_be_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "result.csv").write_text("time,crank.angle\n0,0\n1,0\n", encoding="utf-8")
    assert main(["animate", str(tmp_path / "result.csv"), str(tmp_path / "out.gif")]) == 2
    assert re.search(r"--model \(.*PRBDM, PRBDM2R", capsys.readouterr().err)


@pytest.mark.slow
def test_the_folder_has_no_part_of_a_film(short: Result, tmp_path: Path) -> None:
    seen = []

    def progress(fraction: float) -> None:
        seen.extend(tmp_path.iterdir())

    write_film(scene_of(short, slow=20.0, fps=10.0), tmp_path / "film.gif", progress)
    assert seen == []
    assert [path.name for path in tmp_path.iterdir()] == ["film.gif"]
