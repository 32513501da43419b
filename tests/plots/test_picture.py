"""Pictures of mechanisms: positions, names, modes, icons, and the command that draws them."""

import math
import re
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from matplotlib.text import Text
from PIL import Image

from prbm.base.errors import ParameterError
from prbm.commands.command_line import main
from prbm.drawing.icon import BODY, POINTS, SVG, icon, shape, vector_icon
from prbm.drawing.shapes import Shapes, box, corners, hull
from prbm.drawing.style import png
from prbm.files.mechanism_file import load, read_mechanism, shipped
from prbm.fmu.start import start
from prbm.hybrid.simulation import Simulation
from prbm.mechanics.assembly import assemble
from prbm.mechanics.modal import modes
from prbm.mechanics.statics import equilibrium
from prbm.mechanism.description import Mechanism
from prbm.mechanism.parts import Body, Flexure, FlexureType, Joint, Probe, Release, Stop
from prbm.plots.figures import response
from prbm.plots.motion import film, motion, needed
from prbm.plots.picture import MODE_AMPLITUDE, moved, picture
from prbm.plots.scene import Scene
from prbm.runs.run import simulate
from support import SUPPORT, mechanism

LEAF = FlexureType("leaf", "2R", 2e-4, 1e-2, 2e11, 7800.0, axial=True)
CRANK = Mechanism(
    "Crank",
    "Inclined bar on pins between a lever and a guide",
    {"left": (0.0, 0.0), "right": (0.02, 0.0), "hinge": (0.1, 0.0)},
    (
        Body("stage", 0.05, 1e-5, (0.01, 0.06), {
            "left": (0.0, 0.05), "right": (0.02, 0.05), "ear": (0.02, 0.07), "top": (0.0, 0.07),
        }),
        Body("bar", 0.01, 1e-5, (0.06, 0.05), {"start": (0.02, 0.07), "end": (0.1, 0.03)}),
        Body("lever", 0.02, 1e-5, (0.1, 0.02), {"foot": (0.1, 0.0), "joint": (0.1, 0.03)}),
    ),
    (LEAF,),
    (
        Flexure("one", "leaf", "ground.left", "stage.left"),
        Flexure("two", "leaf", "ground.right", "stage.right"),
    ),
    Release("stage", displacement=-2e-3),
    joints=(
        Joint("upper", "bar.start", "stage.ear"),
        Joint("lower", "lever.joint", "bar.end"),
        Joint("pivot", "ground.hinge", "lever.foot"),
    ),
    stops=(Stop("knock", "stage", (0.02, 0.06), position=3e-3, on="lever"),),
    probes=(Probe("ear", "stage.ear"),),
)  # fmt: skip


def shapes_of(chosen: Mechanism, displacement: float | None = None) -> tuple[Shapes, np.ndarray]:
    """Return the shapes of a mechanism, and the values of its arms.

    The arms (direction and relative length of each link and body) are those of the straight shape,
    or of the body held at a displacement.
    """
    system = assemble(chosen, chosen.values())
    shapes = Shapes(system)
    if displacement is None:
        return shapes, shapes.straight
    return shapes, shapes.arms(equilibrium(system, displacement).q)


# --- shapes -----------------------------------------------------------------------------------


def test_points_move_with_their_bodies() -> None:
    """Pins, the hit point, the wall and the probe are fixed to their bodies."""
    shapes, E = shapes_of(CRANK, -4e-3)
    at = {name: shapes.centre(name, E) for name in shapes.bodies}
    turn = {name: E[shapes.system.bodies[name].arm] for name in at}
    np.testing.assert_allclose(np.abs([*turn.values()]), 1.0, rtol=1e-14)
    ear = at["stage"] + turn["stage"] * (0.01 + 0.01j)
    upper, lower, pivot = shapes.pins(E)
    assert abs(upper - ear) < 1e-12
    assert abs(upper - (at["bar"] + turn["bar"] * (-0.04 + 0.02j))) < 1e-12
    assert abs(lower - (at["lever"] + turn["lever"] * 0.01j)) < 1e-12
    assert abs(pivot - 0.1) < 1e-12
    assert abs(shapes.probes(E)[0] - ear) < 1e-12
    assert abs(shapes.hit(0, E) - (at["stage"] + turn["stage"] * 0.01)) < 1e-12
    wall = shapes.wall(0, 3e-3, E)
    middle = at["lever"] + turn["lever"] * (0.023 + 0.06j - 0.1 - 0.02j)
    assert abs(wall[:2].mean() - middle) < 1e-12
    assert abs(np.angle((wall[1] - wall[0]) / (1j * turn["lever"]))) < 1e-12


def test_the_drawn_gap_to_a_wall_on_a_body_is_that_of_the_engine() -> None:
    simulation = Simulation(CRANK)
    simulation.advance(0.003)
    shapes = Shapes(simulation.system)
    E = shapes.arms(simulation.state()[: simulation.system.n])
    wall, hit = shapes.wall(0, 3e-3, E), shapes.hit(0, E)
    along = (wall[1] - wall[0]) / abs(wall[1] - wall[0])
    apart = ((wall[0] - hit) * along.conjugate()).imag
    assert abs(apart) == pytest.approx(simulation.outputs()["knock.gap"], abs=1e-12)


def test_an_inclined_bar_is_drawn_as_an_inclined_thin_box() -> None:
    """The box around points that form a square has horizontal and vertical sides."""
    shapes, E = shapes_of(CRANK)
    z = shapes.body("bar", E)
    sides = np.diff(z, append=z[:1])
    longest = max(sides, key=abs)
    assert abs(longest) == pytest.approx(abs(0.08 - 0.04j), rel=1e-9)
    assert abs((longest * (0.08 + 0.04j)).imag) < 1e-12  # Along the bar.
    assert min(abs(side) for side in sides) < 0.1 * abs(longest)
    upright = box(np.array([1.0, 1j, -1.0]), 0.01)
    np.testing.assert_allclose(sorted(np.angle(upright, deg=True)), [-135, -45, 45, 135])


def test_a_body_is_the_hull_of_its_points_around_the_centre_of_mass() -> None:
    shapes, E = shapes_of(CRANK)
    z = shapes.body("stage", E)
    expected = {0.05j, 0.02 + 0.05j, 0.02 + 0.07j, 0.07j}
    assert {complex(round(x.real, 9), round(x.imag, 9)) for x in z} >= expected
    triangle = hull(np.array([0, 1, 1j, 0.2 + 0.2j]))  # The last point is inside.
    assert len(triangle) == 3
    area = 0.5 * abs(np.sum(triangle.real * np.roll(triangle.imag, -1)
                            - triangle.imag * np.roll(triangle.real, -1)))  # fmt: skip
    assert area == pytest.approx(0.5)


def test_the_edge_of_a_notch_is_to_scale() -> None:
    """Its area is that of the notch, and its width at the waist the thickness, in any shape."""
    shapes, _ = shapes_of(mechanism("NotchGuide"))
    length, radius, thickness = 0.01, 4e-3, 1e-3
    exact = length * (thickness + 2 * radius) - math.pi * radius**2
    for E in (shapes.straight, shapes_of(mechanism("NotchGuide"), 4e-3)[1]):
        for line in shapes.flexures:
            z = line.edge(E)
            area = 0.5 * (z.conj() * np.roll(z, -1)).imag.sum()
            assert area == pytest.approx(exact, rel=5e-3)
            across = np.abs(z - z[::-1])[: len(z) // 2]
            assert across.min() == pytest.approx(thickness, rel=1e-9)
            assert across[[0, -1]] == pytest.approx(thickness + 2 * radius, rel=1e-9)


def test_the_ground_is_normal_to_the_end_of_a_curved_flexure() -> None:
    """The ends of the beams of the bistable are horizontal, their chords are not."""
    shapes, _ = shapes_of(mechanism("CurvedBistable"))
    places = [z[:2].mean() for z in shapes.ground()]
    expected = [x + 1j * y for x in (-0.05, 0.05) for y in (-0.01, 0.01)]
    np.testing.assert_allclose(sorted(places, key=np.angle), sorted(expected, key=np.angle))
    for z in shapes.ground():
        assert abs((z[1] - z[0]).real) < 0.02 * abs(z[1] - z[0])


@pytest.mark.parametrize("name", ["PRBDM2R", "GuideBeam"])
def test_the_ground_and_the_pins_of_flexures_that_end_on_the_ground(name: str) -> None:
    """They do not depend on which end of a flexure is its start."""
    found = []
    for backwards in (False, True):
        chosen = mechanism(name)
        flexures = [replace(f, ends=("pin", "clamp")) for f in chosen.flexures]
        if backwards:
            flexures = [replace(f, start=f.end, end=f.start, ends=f.ends[::-1]) for f in flexures]
        shapes, E = shapes_of(replace(chosen, flexures=tuple(flexures)))
        found.append((np.array(shapes.ground()), shapes.pins(E)))
    for one, other in zip(*found, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-12)
    assert abs(found[0][0][:, :2].mean(axis=1) - found[0][1]).max() < 1e-12


@pytest.mark.slow
def test_stretches_follow_from_recorded_outputs() -> None:
    """Angles, loops and positions of the bodies determine the stretches of the engine."""
    for name, stop_time in (("FoldedSuspension", 0.02), ("Bistable", 0.03), ("PRBDM2RAxial", 0.01)):
        result = simulate(mechanism(name), stop_time=stop_time)
        recorded = motion(result)
        simulation = Simulation(mechanism(name))
        simulation.advance(stop_time)
        n = simulation.system.n
        exact = simulation.state()[:n]
        assert len(simulation.system.stretches)
        assert np.abs(exact[simulation.system.stretches]).max() > 1e-8
        np.testing.assert_allclose(recorded.q[-1], exact, atol=1e-12)
        assert {f"{body}.x" for body in simulation.system.bodies} <= set(needed(mechanism(name)))


# --- pictures ---------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("name", [*shipped(), "Crank"])
def test_the_picture_contains_all_parts_and_their_names(name: str) -> None:
    chosen = CRANK if name == "Crank" else mechanism(name)
    figure = picture(chosen, shown=1)
    png(figure)
    axes = figure.axes[0]
    written = {text.get_text().strip() for text in axes.findobj(Text)}
    parts = (*chosen.bodies, *chosen.flexures, *chosen.stops, *chosen.joints, *chosen.probes)
    assert {part.name for part in (*parts, *chosen.forces)} <= written
    assert chosen.title in {text.get_text() for text in axes.findobj(Text)}
    shapes, E = shapes_of(chosen)
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    scale = 1e3  # All are drawn in mm.
    for body in shapes.bodies:
        z = scale * shapes.body(body, E)
        assert left < z.real.min() < z.real.max() < right
        assert low < z.imag.min() < z.imag.max() < high


@pytest.mark.parametrize(("name", "count"), [("PRBDM2R", 4), ("GuideBeam", 0)])
def test_pivots_are_drawn_on_links_but_not_on_beams(name: str, count: int) -> None:
    """A 2R flexure between two clamps has four pivots."""
    axes = picture(mechanism(name), shown=1).axes[0]
    circles = [line for line in axes.get_lines() if line.get_markerfacecolor() == "white"]
    assert [len(line.get_xdata()) for line in circles if len(line.get_xdata())] == [count] * (
        2 if count else 0
    )


def labels(chosen: Mechanism, **options: object) -> list[str]:
    """Return the texts in the main panel of a picture, and its caption."""
    axes = picture(chosen, **options).axes[0]  # type: ignore[arg-type]
    return [text.get_text() for text in axes.findobj(Text)] + [axes.get_xlabel()]


@pytest.mark.parametrize("name", ["PRBDM2R", "Bistable", "ImpactOscillator", "Pivot"])
def test_the_picture_shows_the_gaps_at_the_start_of_the_simulation(name: str) -> None:
    chosen = read_mechanism(SUPPORT / "pivot.toml") if name == "Pivot" else mechanism(name)
    outputs = Simulation(chosen).outputs()
    found = labels(chosen)
    gaps = sorted(float(t.split()[2]) for t in found if t.startswith("start gap"))
    expected = sorted(1e3 * outputs[f"{stop.name}.gap"] for stop in chosen.stops)
    assert gaps == pytest.approx(expected, rel=5e-3)
    assert any(f"release.{chosen.release.start} = " in text for text in found)


def test_a_straight_release_is_drawn_once_and_an_impossible_one_is_explained() -> None:
    guide = mechanism("PRBDM2R")
    straight = {"release.displacement": 0.0, "gravity.x": 0.0}
    assert not any("released" in text for text in labels(guide, values=straight))
    (reason,) = {
        " ".join(text.split())
        for text in labels(guide, values={"release.displacement": -0.2})
        if "released shape is not drawn" in text
    }
    assert "release.displacement = -0.2 m cannot be reached" in reason
    behind = labels(guide, values={"stop.position": -0.019})
    assert "behind stop by 1 mm" in behind


def test_the_motion_of_a_body_that_is_released_by_an_angle_is_a_rotation() -> None:
    pivot = read_mechanism(SUPPORT / "pivot.toml")
    result = simulate(pivot, stop_time=2e-3)
    axes = response(result).axes
    assert [panel.get_ylabel() for panel in axes[:2]] == ["rotation [deg]", "rate [rad/s]"]
    drawn = np.asarray(axes[0].lines[0].get_ydata())
    assert drawn[0] == pytest.approx(-5.0, rel=1e-9)
    assert np.radians(drawn) == pytest.approx(result["wheel.angle"], rel=1e-12)


def test_modes_are_titled_with_their_frequencies() -> None:
    folded = mechanism("FoldedSuspension")
    system = assemble(folded, folded.values())
    exact = modes(system, equilibrium(system)).frequency[:3]
    titles = [axes.get_title() for axes in picture(folded, shown=3).axes[1:]]
    assert titles == [f"{f:.4g} Hz" for f in exact]


def test_the_largest_displacement_of_a_drawn_mode_is_fixed() -> None:
    """The displacement is linear in the mode, so that the loops stay closed."""
    for name in shipped():
        shapes, E = shapes_of(mechanism(name), 0.0)
        system = shapes.system
        rest = equilibrium(system)
        E = shapes.arms(rest.q)
        found = modes(system, rest)
        for k in range(min(2, len(found.frequency))):
            new = moved(shapes, E, found, k)
            places = [(corners(o.outline, new), corners(o.outline, E)) for o in shapes.flexures]
            places += [(shapes.body(b, new), shapes.body(b, E)) for b in shapes.bodies]
            largest = max(float(np.abs(a - b).max()) for a, b in places)
            assert largest == pytest.approx(MODE_AMPLITUDE * shapes.size, rel=1e-9)
            phi = (system.loops @ new).real + system.loops_c
            assert np.abs(phi).max() < 1e-9 * shapes.size if len(phi) else True


def test_an_unstable_mode_is_titled_unstable() -> None:
    """A mass stands on a leaf that is too thin to hold it upright."""
    top = replace(
        mechanism("Cantilever"), gravity=(-9.81, 0.0), stops=(), flexure_types=(
            replace(mechanism("Cantilever").flexure_types[0], thickness=6e-5),
        ),
    )  # fmt: skip
    assert [axes.get_title() for axes in picture(top, shown=1).axes[1:]] == ["unstable"]


def test_a_mechanism_with_fewer_modes_is_drawn_with_all_of_them() -> None:
    """There is no empty space for the missing third mode."""
    two, three = (picture(mechanism("ImpactOscillator"), shown=shown) for shown in (2, 3))
    titles = [[axes.get_title() for axes in one.axes] for one in (two, three)]
    assert titles[0] == titles[1]
    assert len(titles[0]) == 1 + 2
    assert tuple(two.get_size_inches()) == tuple(three.get_size_inches())


def test_too_many_modes_are_rejected() -> None:
    with pytest.raises(ParameterError, match="choose a number from 0 to"):
        picture(mechanism("ImpactOscillator"), shown=99)


@pytest.mark.parametrize("name", [*shipped(), "Crank"])
def test_films_contain_the_whole_motion_of_any_mechanism(name: str) -> None:
    chosen = CRANK if name == "Crank" else mechanism(name)
    result = simulate(chosen, stop_time=0.02)
    scene = Scene(motion(result), film(motion(result)))
    (left, right), (low, high) = scene.stage.get_xlim(), scene.stage.get_ylim()
    for k in (0, len(scene.film.times) // 2, len(scene.film.times) - 1):
        scene.frame(k)
        for artist in (*scene.links.values(), *scene.walls.values(), scene.pins):
            x, y = np.array(artist.get_data(), float)
            if x.size:
                assert left <= np.nanmin(x) <= np.nanmax(x) <= right
                assert low <= np.nanmin(y) <= np.nanmax(y) <= high


@pytest.mark.parametrize("name", list(shipped()))
def test_the_icon_shows_the_shape_at_release(name: str) -> None:
    chosen = mechanism(name)
    simulation = Simulation(chosen)
    sample = start(chosen, {}).sample
    exact = simulation.state()[: simulation.system.n]
    np.testing.assert_allclose(shape(simulation.system, sample), exact, atol=1e-9)
    first, again = icon(chosen, sample), icon(chosen, sample)
    assert first == again
    assert first.startswith(b"\x89PNG")


def bodies_of(drawing: bytes) -> list[np.ndarray]:
    """Return the corners of areas with the colour of bodies, the largest first, without holes.

    They are shares of the size of the SVG icon.
    """
    paths = ElementTree.fromstring(drawing).findall(f"{{{SVG}}}path")
    outlines = (path.get("d", "").split("Z")[0] for path in paths if path.get("fill") == BODY)
    numbers = (re.findall(r"-?\d+\.\d+", outline) for outline in outlines)
    areas = [np.array(x, float).reshape(-1, 2) / POINTS for x in numbers]
    return sorted(areas, key=lambda xy: -np.prod(np.ptp(xy, axis=0)))


@pytest.mark.parametrize("name", list(shipped()))
def test_the_svg_icon_has_the_parts_of_the_png_at_the_same_places(name: str) -> None:
    """Halfway from the middle of each body to its corners, the PNG has the colour of bodies."""
    chosen = mechanism(name)
    sample = start(chosen, {}).sample
    drawing = vector_icon(chosen, sample)
    assert drawing == vector_icon(chosen, sample)
    found = bodies_of(drawing)[: len(chosen.bodies)]
    assert len(found) == len(chosen.bodies)
    with Image.open(BytesIO(icon(chosen, sample))) as image:
        pixels = np.array(image.convert("RGB"))
    assert ElementTree.fromstring(drawing).find(f"{{{SVG}}}rect").get("fill") == "#ffffff"
    assert (pixels[0, 0] == 255).all()
    color = [int(BODY[k : k + 2], 16) for k in (1, 3, 5)]
    for corners_of_body in found:
        assert corners_of_body.min() > 0.0
        assert corners_of_body.max() < 1.0
        inside = corners_of_body.mean(axis=0) * 0.5 + corners_of_body * 0.5
        x, y = (inside * len(pixels)).astype(int).T
        matches = (np.abs(pixels[y, x].astype(int) - color).max(axis=1) < 8).mean()
        assert matches >= 0.5, (name, matches)


def test_the_title_of_an_icon_is_text() -> None:
    """Quotes, markup and control characters of a title do not change the structure of the SVG."""
    title = "</title><script>alert('a & \"b\"')</script>\x07"
    chosen = replace(mechanism("PRBDM"), title=title)
    plain = ElementTree.fromstring(vector_icon(mechanism("PRBDM"), start(chosen, {}).sample))
    named = ElementTree.fromstring(vector_icon(chosen, start(chosen, {}).sample))
    assert [element.tag for element in named.iter()] == [element.tag for element in plain.iter()]
    assert named.findtext(f"{{{SVG}}}title") == title.replace("\x07", " ")


# --- command ----------------------------------------------------------------------------------


def test_the_command_draws_a_shipped_mechanism(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["picture", "Cantilever", "--modes", "2", "--set", "leaf.length=0.05"]) == 0
    assert capsys.readouterr().out == "Cantilever.png\n"
    with Image.open("Cantilever.png") as image:
        assert image.format == "PNG"
        assert min(image.size) > 300


def test_mechanisms_are_found_by_path_and_by_name() -> None:
    path = shipped()["Bistable"]
    assert load(str(path)) == load("Bistable")


def test_a_path_without_a_suffix_is_a_folder(tmp_path: Path) -> None:
    assert main(["picture", "PRBDM", "--out", str(tmp_path / "new")]) == 0
    assert (tmp_path / "new" / "PRBDM.png").exists()


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (
            ["Bistabel"],
            "unknown mechanism 'Bistabel' (mechanism files end in .toml); did you mean Bistable "
            "or CurvedBistable?",
        ),
        (["none.toml"], "none.toml: cannot be read"),
        (["PRBDM", "--set", "shuttle.mas=1"], "did you mean shuttle.mass"),
        (["PRBDM", "--set", "shuttle.mass"], "write NAME=VALUE"),
        (["PRBDM", "--modes", "13"], "13 modes: choose a number from 0 to 12"),
        (["PRBDM", "--out", "/dev/null/a.png"], "cannot write to /dev/null: /dev/null is a file"),
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
    assert main(["picture", *arguments]) == 2
    assert sentence in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
