"""Bodies that are cut from a plate: mass, inertia and centre of mass follow from the outline."""

import cmath
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch
from scipy.integrate import quad

from prbm.base.errors import MechanismError
from prbm.commands.command_line import main
from prbm.drawing.shapes import Shapes
from prbm.drawing.style import area
from prbm.files.mechanism_file import read_mechanism
from prbm.files.outlines import CORNERS_MAX, plate, polygon
from prbm.mechanics.assembly import assemble
from prbm.mechanics.modal import modes
from prbm.mechanics.statics import equilibrium
from prbm.mechanism.description import Mechanism
from prbm.mechanism.expressions import affine


def rectangle(width: float, height: float, corner: complex = 0j) -> list[complex]:
    return [corner, corner + width, corner + width + 1j * height, corner + 1j * height]


# --- second moments ---------------------------------------------------------------------------


@pytest.mark.parametrize("sense", [1, -1])
def test_a_rectangle(sense: int) -> None:
    one = polygon(rectangle(4.0, 3.0, 5 - 2j)[::sense])
    assert one.area == pytest.approx(12.0, rel=1e-14)
    assert one.centre == pytest.approx(7 - 0.5j, rel=1e-14)
    assert one.moment == pytest.approx(12.0 * (4.0**2 + 3.0**2) / 12.0, rel=1e-14)


def test_a_triangle() -> None:
    """The polar moment of a triangle about its centroid is A (a^2 + b^2 + c^2) / 36."""
    corners = [1 + 1j, 6 + 2j, 3 + 5j]
    sides = [abs(a - b) for a, b in zip(corners, corners[1:] + corners[:1], strict=True)]
    half = sum(sides) / 2
    heron = math.sqrt(half * math.prod(half - s for s in sides))
    one = polygon(corners)
    assert one.area == pytest.approx(heron, rel=1e-14)
    assert one.centre == pytest.approx(sum(corners) / 3, rel=1e-14)
    assert one.moment == pytest.approx(heron * sum(s**2 for s in sides) / 36, rel=1e-13)


def test_an_l_shape_by_parallel_axes() -> None:
    """Two rectangles; the moment of each is shifted to the common centroid."""
    corners = [0, 50, 50 + 10j, 10 + 10j, 10 + 30j, 30j]
    pieces = [(500.0, 25 + 5j, 50.0, 10.0), (200.0, 5 + 20j, 10.0, 20.0)]
    total = sum(a for a, *_ in pieces)
    centre = sum(a * z for a, z, *_ in pieces) / total
    moment = sum(a * ((b**2 + h**2) / 12 + abs(z - centre) ** 2) for a, z, b, h in pieces)
    one = polygon([z * 1e-3 for z in corners])
    assert one.area == pytest.approx(total * 1e-6, rel=1e-14)
    assert one.centre == pytest.approx(centre * 1e-3, rel=1e-14)
    assert one.moment == pytest.approx(moment * 1e-12, rel=1e-13)


@given(st.lists(st.floats(0.2, 3.0), min_size=3, max_size=12), st.floats(-1.0, 1.0))
def test_random_polygons_against_numerical_integration(radii: list[float], x: float) -> None:
    """In polar coordinates about an inner point, each side is r(t) = d / cos(t - t0)."""
    n = len(radii)
    corners = [r * cmath.exp(2j * math.pi * k / n) for k, r in enumerate(radii)]
    sums = np.zeros(4)
    for a, b in zip(corners, corners[1:] + corners[:1], strict=True):
        distance = (a.conjugate() * b).imag / abs(b - a)
        normal = cmath.phase((b - a) / 1j)
        first, last = cmath.phase(a), cmath.phase(a) + cmath.phase(b / a)

        def r(t: float, d: float = distance, t0: float = normal) -> float:
            return d / math.cos(t - t0)

        for i, rate in enumerate((
            lambda t: r(t) ** 2 / 2,
            lambda t: r(t) ** 3 / 3 * math.cos(t),
            lambda t: r(t) ** 3 / 3 * math.sin(t),
            lambda t: r(t) ** 4 / 4,
        )):  # fmt: skip
            sums[i] += quad(rate, first, last, epsabs=1e-12, epsrel=1e-12)[0]
    A, Sx, Sy, J = sums
    centre = complex(Sx, Sy) / A
    shift = complex(x, 2.0)
    one = polygon([z + shift for z in corners])
    assert one.area == pytest.approx(A, rel=1e-9)
    assert one.centre == pytest.approx(centre + shift, rel=1e-9)
    assert one.moment == pytest.approx(J - A * abs(centre) ** 2, rel=1e-8)


def test_a_regular_polygon_with_many_corners_is_a_circle() -> None:
    circle = polygon([cmath.exp(2j * math.pi * k / 900) for k in range(900)])
    assert circle.area == pytest.approx(math.pi, rel=1e-4)
    assert circle.moment == pytest.approx(math.pi / 2, rel=1e-4)


def points(corners: list[complex]) -> list[tuple[float, float]]:
    return [(z.real, z.imag) for z in corners]


def test_holes_are_subtracted() -> None:
    """A frame of four rectangles, by parallel axes, equals a rectangle with a hole."""
    outer, inner = rectangle(0.05, 0.03), rectangle(0.02, 0.01, 0.01 + 0.015j)
    found = plate("frame", points(outer), [points(inner)], 2e-3, 1000.0)
    strips = [
        (0.01, 0.03, 0.005 + 0.015j), (0.02, 0.03, 0.04 + 0.015j),
        (0.02, 0.015, 0.02 + 0.0075j), (0.02, 0.005, 0.02 + 0.0275j),
    ]  # fmt: skip
    mass = sum(2.0 * b * h for b, h, _ in strips)
    centre = sum(2.0 * b * h * z for b, h, z in strips) / mass
    inertia = sum(2.0 * b * h * ((b**2 + h**2) / 12 + abs(z - centre) ** 2) for b, h, z in strips)
    assert found["mass"] == pytest.approx(mass, rel=1e-13)
    assert complex(*found["centre"]) == pytest.approx(centre, rel=1e-13)
    assert found["inertia"] == pytest.approx(inertia, rel=1e-13)


@given(
    st.lists(st.complex_numbers(max_magnitude=1.0), min_size=3, max_size=7),
    st.floats(-3.0, 3.0),
    st.complex_numbers(max_magnitude=5.0),
)
def test_polygons_are_rejected_or_rotate_with_their_properties(
    corners: list[complex], angle: float, shift: complex
) -> None:
    """Mass and inertia do not depend on place and rotation; the centre follows."""
    try:
        one = plate("body", points(corners), [], 1.0, 1.0)
    except MechanismError:
        return
    assume(min(abs(a - b) for a in corners for b in corners if a != b) > 1e-6)
    assume(float(one["mass"]) > 1e-3)
    turn = cmath.exp(1j * angle)
    other = plate("body", points([turn * z + shift for z in corners]), [], 1.0, 1.0)
    assert other["mass"] == pytest.approx(one["mass"], rel=1e-9)
    assert other["inertia"] == pytest.approx(one["inertia"], rel=1e-6)
    moved = turn * complex(*one["centre"]) + shift
    assert complex(*other["centre"]) == pytest.approx(moved, abs=1e-7)


@pytest.mark.parametrize(
    "corners",
    [
        [0, 1, 1j, 1 + 1j],  # bow tie
        [0, 2, 2 + 2j, 1, 2j],  # a corner on a side
        [0, 2, 1, 1 + 1j],  # a side that returns
        [0, 1, 2],  # no area
        [0, 1, 1j, 0],  # a corner twice
        [0, 3, 3 + 3j, 1 + 1j, 2 + 2j, 3j],
    ],
)
def test_polygons_that_are_not_simple_are_rejected(corners: list[complex]) -> None:
    with pytest.raises(MechanismError, match=r"crosses or touches itself|twice: remove one"):
        plate("body", points(corners), [], 1.0, 1.0)


def test_corners_on_a_straight_side_are_allowed() -> None:
    found = plate("body", points([0, 1, 2, 2 + 1j, 1j]), [], 1.0, 1.0)
    assert found["mass"] == pytest.approx(2.0)


def test_the_number_of_corners_is_limited() -> None:
    circle = [cmath.exp(2j * math.pi * k / CORNERS_MAX) for k in range(CORNERS_MAX + 1)]
    with pytest.raises(MechanismError, match="has 1001 corners"):
        plate("body", points(circle), [], 1.0, 1.0)


# --- in files ---------------------------------------------------------------------------------

FILE = """
name = "Plate"
title = "Stage cut from a plate"
[[geometry]]
name = "leaf.length"
value = "40 mm"
[[materials]]
name = "pmma"
youngs_modulus = "3.2 GPa"
density = "1.19 g/cm3"
[[flexure_types]]
name = "leaf"
model = "beam"
thickness = "0.5 mm"
width = "8 mm"
material = "pmma"
[ground]
left = ["-30 mm", 0]
[[bodies]]
name = "stage"
outline = [
    "left", ["30 mm", "leaf.length"], ["30 mm", "leaf.length + 30 mm"],
    ["20 mm", "leaf.length + 30 mm"], ["20 mm", "leaf.length + 10 mm"],
    ["-30 mm", "leaf.length + 10 mm"],
]
holes = [[
    ["-5 mm", "leaf.length + 3 mm"], ["0 mm", "leaf.length + 8 mm"], ["5 mm", "leaf.length + 3 mm"],
]]
thickness = "8 mm"
material = "pmma"
points.left = ["-30 mm", "leaf.length"]
[[flexures]]
name = "left"
type = "leaf"
start = "ground.left"
end = "stage.left"
mirror = "x = 0"
[release]
body = "stage"
displacement = "-10 mm"
"""
OUTER = [-30, 30, 30 + 30j, 20 + 30j, 20 + 10j, -30 + 10j]
HOLE = [-5 + 3j, 8j, 5 + 3j]


@pytest.fixture(scope="module")
def stage(tmp_path_factory: pytest.TempPathFactory) -> Mechanism:
    return read(tmp_path_factory.mktemp("plate"), FILE)


def read(folder: Path, text: str) -> Mechanism:
    path = folder / "plate.toml"
    path.write_text(text, encoding="utf-8")
    return read_mechanism(path)


def first(chosen: Mechanism, changes: dict[str, float]) -> float:
    system = assemble(chosen, chosen.values(changes))
    return float(modes(system, equilibrium(system)).frequency[0])


def test_mass_and_inertia_follow_the_density_and_the_centre_the_parameters(
    stage: Mechanism,
) -> None:
    body = stage.bodies[0]
    outer, hole = (polygon([z * 1e-3 for z in ring]) for ring in (OUTER, HOLE))
    for changes in ({}, {"pmma.density": 2000.0, "leaf.length": 0.1}):
        known = stage.values(changes)
        mass, inertia, x, y = (affine(q)(known) for q in (body.mass, body.inertia, *body.centre))
        surface = known["pmma.density"] * 8e-3
        assert mass == pytest.approx(surface * (outer.area - hole.area), rel=1e-12)
        centre = (outer.area * outer.centre - hole.area * hole.centre) / (outer.area - hole.area)
        assert complex(x, y) == pytest.approx(centre + 1j * known["leaf.length"], rel=1e-12)
        about = [o.moment + o.area * abs(o.centre - centre) ** 2 for o in (outer, hole)]
        assert inertia == pytest.approx(surface * (about[0] - about[1]), rel=1e-12)


def test_a_plate_is_the_body_with_its_mass_inertia_and_centre(
    stage: Mechanism, tmp_path: Path
) -> None:
    """The frequencies agree, and those of a plate fall with its density."""
    body, known = stage.bodies[0], stage.values()
    values = {key: affine(getattr(body, key))(known) for key in ("mass", "inertia")}
    x, y = (affine(c)(known) for c in body.centre)
    cut = 'thickness = "8 mm"\nmaterial = "pmma"\npoints.left'
    assert FILE.count(cut) == 1
    given_values = "".join(f"{key} = {value!r}\n" for key, value in values.items())
    given_values += f"centre = [{x!r}, {y!r}]\npoints.left"
    same = read(tmp_path, FILE.replace(cut, given_values))
    assert same.bodies[0].outline == body.outline
    assert first(same, {}) == pytest.approx(first(stage, {}), rel=1e-12)
    light, heavy = (first(stage, {"pmma.density": rho}) for rho in (500.0, 2000.0))
    assert light == pytest.approx(2.0 * heavy, rel=1e-9)  # Flexures and stage have one density.


def test_the_density_of_a_plate_without_a_material_is_a_parameter(tmp_path: Path) -> None:
    """Mass, inertia and thickness of a plate are no parameters."""
    text = FILE.replace('"8 mm"\nmaterial = "pmma"\npoints', '"8 mm"\ndensity = "2 g/cm3"\npoints')
    own = read(tmp_path, text)
    known = {p.name: p for p in own.parameters}
    assert known["stage.density"].value == 2000.0
    assert (known["stage.density"].unit, known["stage.density"].minimum) == ("kg/m3", 1.0)
    assert not {"stage.mass", "stage.inertia", "stage.thickness"} & set(known)
    assert own.bodies[0].mass.endswith("*stage.density")


def test_the_picture_command_prints_the_properties_of_plates(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A plate of 60 mm x 10 mm x 8 mm with 1190 kg/m3 has 5.712 g and m (b^2 + h^2) / 12."""
    begin, end = FILE.index('"left", ["30 mm"'), FILE.index('thickness = "8 mm"')
    bar = '"left", ["30 mm", "leaf.length"], ["30 mm", "leaf.length + 10 mm"], '
    bar += '["-30 mm", "leaf.length + 10 mm"]]\n'
    (tmp_path / "plate.toml").write_text(FILE[:begin] + bar + FILE[end:], encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    assert main(["picture", "plate.toml", "--set", "leaf.length=50mm"]) == 0
    assert capsys.readouterr().out.splitlines() == [
        "Plate.png",
        f"stage: 5.712 g, {5.712 * 3700 / 12 * 1e-3:.4g} kg.mm2, centre of mass at (0, 55) mm",
    ]


# --- drawing ----------------------------------------------------------------------------------


def test_outline_and_holes_move_with_the_body(stage: Mechanism) -> None:
    """The outline is counter-clockwise and holes are clockwise, however they are written."""
    system = assemble(stage, stage.values())
    shapes = Shapes(system)
    E = shapes.arms(equilibrium(system, -0.01).q)
    outer, hole = shapes.areas("stage", E)
    moved = [shapes.carried("stage", z * 1e-3 + 0.04j, E) for z in OUTER]
    np.testing.assert_allclose(outer, moved, atol=1e-15)
    assert {*np.round(hole, 9)} == {
        *np.round([shapes.carried("stage", z * 1e-3 + 0.04j, E) for z in HOLE], 9)
    }
    rings = (outer - outer[0], hole - hole[0])
    senses = [float((z.conj() * np.roll(z, -1)).imag.sum()) for z in rings]
    assert senses[0] > 0.0 > senses[1]


def test_holes_are_not_filled() -> None:
    figure = Figure((1.0, 1.0), dpi=100)
    canvas = FigureCanvasAgg(figure)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set(xlim=(0, 4), ylim=(0, 4))
    axes.set_axis_off()
    inner = np.array(rectangle(1.0, 1.0, 1 + 1j))[::-1]
    axes.add_patch(PathPatch(area([np.array(rectangle(4.0, 4.0)), inner]), facecolor="black"))
    canvas.draw()
    pixels = np.asarray(canvas.buffer_rgba())[::-1, :, 0]
    assert pixels[37, 37] == 255
    assert (pixels[12, 12], pixels[62, 62]) == (0, 0)


@pytest.mark.parametrize("size", [1e-59, 1e-258, 5e-324])
def test_the_smallest_outlines_have_a_mass_or_are_rejected(size: float) -> None:
    """No squares of lengths are rounded to zero without a word."""
    corners = points([0, size, size * 1j])
    if size < 1e-60:
        with pytest.raises(MechanismError, match="too short for a mass"):
            plate("body", corners, [], 1.0, 1.0)
    else:
        assert plate("body", corners, [], 1.0, 1.0)["mass"] == pytest.approx(size**2 / 2)


def test_a_payload_adds_its_mass_at_the_centre_of_the_plate() -> None:
    corners = tuple((z.real, z.imag) for z in rectangle(0.04, 0.03, 0.01j))
    alone = plate("stage", corners, (), 4e-3, 7850.0)
    loaded = plate("stage", corners, (), 4e-3, 7850.0, "0.05 + 2*load.mass")
    assert loaded["centre"] == alone["centre"]
    assert loaded["inertia"] == alone["inertia"]
    mass = affine(loaded["mass"])({"load.mass": 0.1})
    assert mass == pytest.approx(affine(alone["mass"])({}) + 0.25, rel=1e-14)
