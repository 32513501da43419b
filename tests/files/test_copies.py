"""Mirror images and repeated copies in mechanism files equal the parts written by hand."""

import cmath
import math
from dataclasses import asdict
from pathlib import Path
from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from prbm.base.errors import MechanismError
from prbm.files import copies
from prbm.files.images import Line, displaced, rotated, same, written
from prbm.files.mechanism_file import read_mechanism
from prbm.mechanics.assembly import assemble
from prbm.mechanics.statics import equilibrium
from prbm.mechanism.description import Mechanism
from prbm.mechanism.expressions import Affine, affine
from prbm.mechanism.parts import Flexure, Point
from support import mechanism

HEAD = """\
name = "Copies"
title = "Copies"
[[geometry]]
name = "span"
value = "60 mm"
[[flexure_types]]
name = "leaf"
model = "beam"
axial = true
thickness = "0.5 mm"
width = "8 mm"
youngs_modulus = "3.2 GPa"
density = "1.19 g/cm3"
"""
TAIL = """
[release]
body = "stage"
displacement = "-1 mm"
"""


def read(folder: Path, body: str, tail: str = TAIL) -> Mechanism:
    path = folder / "copies.toml"
    path.write_text(HEAD + body + tail, encoding="utf-8")
    return read_mechanism(path)


def leaf(body: str, root: str, point: str = "own") -> str:
    """Return the table of a flexure between a point of the ground and a point of a body."""
    ends = f'start = "ground.{root}"\nend = "{body}.{point}"'
    return f'[[flexures]]\nname = "own_{body}"\ntype = "leaf"\n{ends}\n'


def plain(value: object, key: str = "") -> object:
    """Return data in which equal coordinates are equal texts; the order of points is left out."""
    if isinstance(value, dict):
        named = {k: plain(v, k) for k, v in value.items()}
        return sorted(named.items()) if key in ("points", "ground") else named
    pair = isinstance(value, list | tuple) and len(value) == 2 and key != "ends"
    if pair and all(isinstance(c, float | str) for c in value):
        return [rounded(affine(c)) for c in value]
    if isinstance(value, list | tuple):
        return [plain(item, "holes" if key == "holes" else "") for item in value]
    return value


def rounded(expression: Affine) -> tuple[float, list[tuple[str, float]]]:
    terms = [(name, round(c, 12)) for name, c in expression.terms.items() if abs(c) > 1e-12]
    return round(expression.constant, 12) + 0.0, sorted(terms)


def described(chosen: Mechanism) -> object:
    kept = asdict(chosen)
    kept["flexures"] = [{**f, "ends": list(f["ends"])} for f in kept["flexures"]]
    return {key: plain(value, key) for key, value in kept.items()}


# --- copies in files --------------------------------------------------------------------------

MIRRORED = """
[ground]
left = ["-span/2", 0]
mid = [0, "5 mm"]

[[bodies]]
name = "stage"
mass = "10 g"
inertia = "5 kg.mm2"
centre = [0, "50 mm"]
points.left = ["-span/2", "40 mm"]
points.left_ear = ["-span/2", "50 mm"]
points.mid = [0, "40 mm"]

[[bodies]]
name = "left_arm"
mass = "1 g"
inertia = "0.2 kg.mm2"
centre = ["-span/2 - 20 mm", "50 mm"]
points.right_end = ["-span/2 - 10 mm", "50 mm"]
points.eye = ["-span/2", "50 mm"]
mirror = "x = 0 mm"

[[flexures]]
name = "left"
type = "leaf"
start = "ground.left"
end = "stage.left"
mirror = "x = 0"

[[flexures]]
name = "cross"
type = "leaf"
start = "ground.left"
end = "stage.mid"
ends = ["pin", "clamp"]
mirror = "x = 0"

[[joints]]
name = "left_eye"
start = "stage.left_ear"
end = "left_arm.eye"
mirror = "x = 0"

[[flexures]]
name = "left_tie"
type = "leaf"
start = "left_arm.right_end"
end = "ground.left"
mirror = "x = 0"
"""
BY_HAND = """
[ground]
left = ["-span/2", 0]
right = ["span/2", 0]
mid = [0, "5 mm"]

[[bodies]]
name = "stage"
mass = "10 g"
inertia = "5 kg.mm2"
centre = [0, "50 mm"]
points.left = ["-span/2", "40 mm"]
points.right = ["span/2", "40 mm"]
points.left_ear = ["-span/2", "50 mm"]
points.right_ear = ["span/2", "50 mm"]
points.mid = [0, "40 mm"]

[[bodies]]
name = "left_arm"
mass = "1 g"
inertia = "0.2 kg.mm2"
centre = ["-span/2 - 20 mm", "50 mm"]
points.right_end = ["-span/2 - 10 mm", "50 mm"]
points.eye = ["-span/2", "50 mm"]

[[bodies]]
name = "right_arm"
mass = "1 g"
inertia = "0.2 kg.mm2"
centre = ["span/2 + 20 mm", "50 mm"]
points.left_end = ["span/2 + 10 mm", "50 mm"]
points.eye = ["span/2", "50 mm"]

[[flexures]]
name = "left"
type = "leaf"
start = "ground.left"
end = "stage.left"

[[flexures]]
name = "right"
type = "leaf"
start = "ground.right"
end = "stage.right"

[[flexures]]
name = "cross"
type = "leaf"
start = "ground.left"
end = "stage.mid"
ends = ["pin", "clamp"]

[[flexures]]
name = "cross_mirrored_x"
type = "leaf"
start = "ground.right"
end = "stage.mid"
ends = ["pin", "clamp"]

[[joints]]
name = "left_eye"
start = "stage.left_ear"
end = "left_arm.eye"

[[joints]]
name = "right_eye"
start = "stage.right_ear"
end = "right_arm.eye"

[[flexures]]
name = "left_tie"
type = "leaf"
start = "left_arm.right_end"
end = "ground.left"

[[flexures]]
name = "right_tie"
type = "leaf"
start = "right_arm.left_end"
end = "ground.right"
"""


def test_mirror_images_equal_the_parts_written_by_hand(tmp_path: Path) -> None:
    assert described(read(tmp_path, MIRRORED)) == described(read(tmp_path, BY_HAND))


ROW = """
[ground]
root = [0, 0]

[[bodies]]
name = "stage"
mass = "10 g"
inertia = "5 kg.mm2"
centre = ["span", "50 mm"]
points.seat = [0, "40 mm"]

[[bodies]]
name = "bob"
mass = "1 g"
inertia = "0.2 kg.mm2"
centre = [0, "70 mm"]
points.foot = [0, "60 mm"]
repeat = { count = 3, step = ["span/2 + 1 mm", 0] }

[[flexures]]
name = "leg"
type = "leaf"
start = "ground.root"
end = "stage.seat"
repeat = { count = 3, step = ["span/2 + 1 mm", "0 m"] }

[[flexures]]
name = "neck"
type = "leaf"
start = "stage.seat"
end = "bob.foot"
repeat = { count = 3, step = ["0.5*span + 0.1 cm", 0] }
"""


def test_a_row_equals_the_parts_written_by_hand(tmp_path: Path) -> None:
    """The copies of the neck join copies of the bob, which exist, to new points of the stage."""
    lines = ["[ground]"]
    steps = ["", *(f" + {k}*span/2 + {k} mm" for k in (1, 2))]
    suffixes = ("", "_2", "_3")
    lines += [f'root{s} = ["0 mm{d}", 0]' for s, d in zip(suffixes, steps, strict=True)]
    stage = ROW[ROW.index("[[bodies]]") : ROW.index("points.seat")]
    lines += [stage]
    lines += [
        f'points.seat{s} = ["0 mm{d}", "40 mm"]' for s, d in zip(suffixes, steps, strict=True)
    ]
    for s, d in zip(suffixes, steps, strict=True):
        lines += ["[[bodies]]", f'name = "bob{s}"', 'mass = "1 g"', 'inertia = "0.2 kg.mm2"']
        lines += [f'centre = ["0 mm{d}", "70 mm"]', f'points.foot = ["0 mm{d}", "60 mm"]']
    for name, start, end in (
        ("leg{0}", "ground.root{0}", "stage.seat{0}"),
        ("neck{0}", "stage.seat{0}", "bob{0}.foot"),
    ):
        for s in suffixes:
            lines += ["[[flexures]]", f'name = "{name.format(s)}"', 'type = "leaf"']
            lines += [f'start = "{start.format(s)}"', f'end = "{end.format(s)}"']
    by_hand = read(tmp_path, "\n".join(lines))
    assert described(read(tmp_path, ROW)) == described(by_hand)


CIRCLE = """
[ground]
rim = ["span", "10 mm"]

[[bodies]]
name = "stage"
mass = "10 g"
inertia = "5 kg.mm2"
centre = [0, "10 mm"]
points.hub = ["10 mm", "10 mm"]

[[flexures]]
name = "spoke"
type = "leaf"
start = "stage.hub"
end = "ground.rim"
repeat = { count = 3, angle = 120, about = [0, "10 mm"] }
"""


def test_copies_on_a_circle_are_rotated_about_its_centre(tmp_path: Path) -> None:
    wheel = read(tmp_path, CIRCLE, '[release]\nbody = "stage"\nangle = "1 deg"\n')
    assert [f.name for f in wheel.flexures] == ["spoke", "spoke_2", "spoke_3"]
    for values in ({}, {"span": 0.03}):
        known = wheel.values(values)
        for k, name in enumerate(("rim", "rim_2", "rim_3")):
            x, y = (affine(c)(known) for c in wheel.ground[name])
            expected = 0.01j + known["span"] * cmath.exp(2j * math.pi * k / 3)
            assert complex(x, y) == pytest.approx(expected, abs=1e-15)
    assemble(wheel, wheel.values())  # The wheel turns.


def test_two_lines_make_four_parts_and_a_row_repeats_all_of_them(tmp_path: Path) -> None:
    body = MIRRORED[: MIRRORED.index("[[joints]]")].replace(
        'name = "left"', 'name = "lower_left"\nmirror = ["x = 0", "y = 20 mm"]\n'
        'repeat = { count = 2, step = [0, "90 mm"] }', 1
    ).replace('end = "stage.left"\nmirror = "x = 0"', 'end = "stage.left"')  # fmt: skip
    names = [f.name for f in read(tmp_path, without_arms(body)).flexures]
    four = ["lower_left", "lower_right", "upper_left", "upper_right"]
    assert names == [*four, *(f"{name}_2" for name in four), "cross", "cross_mirrored_x"]


def without_arms(text: str) -> str:
    begin = text.index('[[bodies]]\nname = "left_arm"')
    return text[:begin] + text[text.index("[[flexures]]") :]


def test_copies_share_the_section_of_their_original_and_the_material_of_its_plate(
    tmp_path: Path,
) -> None:
    """A copy of a body has its own mass; copies of a plate have one density."""
    own = 'model = "2R"\nthickness = "0.2 mm"\nwidth = "8 mm"\nyoungs_modulus = 1e9\ndensity = 900'
    body = MIRRORED.replace('name = "left"\ntype = "leaf"', f'name = "left"\n{own}')
    known = {p.name for p in read(tmp_path, body).parameters}
    assert {"left.thickness", "left_arm.mass", "right_arm.mass"} <= known
    assert "right.thickness" not in known
    outline = 'outline = [["-70 mm", 0], ["-60 mm", 0], ["-60 mm", "9 mm"]]'
    begin = body.index('mass = "1 g"')
    body = body[:begin] + f'{outline}\nthickness = "8 mm"\ndensity = 900\n' + body[
        body.index("points.right_end") :
    ]  # fmt: skip
    plates = read(tmp_path, body)
    known = {p.name for p in plates.parameters}
    assert "left_arm.density" in known
    assert not {"right_arm.density", "left_arm.mass", "right_arm.mass"} & known
    _, left, right = plates.bodies
    assert left.mass == right.mass
    assert [x for x, _ in right.outline] == [0.07, 0.06, 0.06]


def test_types_of_mirror_images_change_a_sign_and_share_all_parameters(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An image in two lines has the type of the original."""
    monkeypatch.setattr(copies, "SIGNED", ("width",))
    (kind,) = read(tmp_path, BY_HAND).flexure_types
    lines = (Line.read("x = 0"), Line.read("y = 0"))
    table = SimpleNamespace(name="upper_left", mirror=lines, repeat=None)
    names = ("upper_left", "upper_right", "lower_left", "lower_right")
    flexures = [Flexure(name, "leaf", "a.b", "c.d") for name in names]
    found, types = copies.mirrored_types([table], flexures, [kind])
    assert [f.type for f in found] == ["leaf", "leaf_mirrored", "leaf_mirrored", "leaf"]
    assert types[0] == kind
    assert len(types) == 2
    assert affine(types[1].width) == Affine(0.0, {"leaf.width": -1.0})
    for name in ("thickness", "youngs_modulus", "density"):
        assert affine(getattr(types[1], name)) == Affine(0.0, {f"leaf.{name}": 1.0})


CURVED = """
[ground]
left = ["-span/2 - 10 mm", 0]

[[bodies]]
name = "stage"
mass = "10 g"
inertia = "5 kg.mm2"
centre = [0, 0]
points.left = ["-10 mm", "2 mm"]

[[flexures]]
name = "left"
type = "leaf"
start = "ground.left"
end = "stage.left"
mirror = "x = 0"

[release]
body = "stage"
direction = 90
displacement = "-1 mm"
"""


@pytest.mark.skipif("rise" not in copies.SIGNED, reason="no curved flexures")
@pytest.mark.parametrize("shape", ['rise = "2 mm"', 'curvature = "8 1/m"'])
def test_a_symmetric_body_between_curved_flexures_does_not_turn(tmp_path: Path, shape: str) -> None:
    path = tmp_path / "curved.toml"
    path.write_text(HEAD + shape + CURVED, encoding="utf-8")
    curved = read_mechanism(path)
    system = assemble(curved, curved.values())
    q = equilibrium(system, -1e-3).q
    frame = system.bodies["stage"]
    assert abs(q[frame.j]) < 1e-9
    place = frame.c + frame.A @ system.directions(q)
    assert place == pytest.approx(-1e-3j, abs=1e-9)


@pytest.mark.parametrize(("shift", "owner"), [("20 mm", "right_arm"), ("30 mm", "left_arm")])
def test_a_copy_joins_a_body_written_by_hand_if_it_is_the_image(
    tmp_path: Path, shift: str, owner: str
) -> None:
    """A body with the name of the image at another place is not the image."""
    right = f"""
[[bodies]]
name = "right_arm"
mass = "1 g"
inertia = "0.2 kg.mm2"
centre = ["span/2 + {shift}", "50 mm"]
points.own = ["span/2", "90 mm"]
{leaf("right_arm", "mid")}"""
    body = MIRRORED.replace('mirror = "x = 0 mm"\n', right)
    joint = read(tmp_path, body).joints[1]
    assert joint.start == "stage.right_ear"
    assert joint.end.rpartition(".")[0] == owner


BEADS = """
[ground]
root = [0, 0]
foot = ["span/2", "-40 mm"]

[[bodies]]
name = "bead"
mass = "1 g"
inertia = "0.2 kg.mm2"
centre = ["10 mm", 0]
points.left = ["5 mm", 0]
points.right = ["15 mm", 0]
points.low = ["10 mm", "-5 mm"]
repeat = { count = 4, step = ["span/2", 0] }

[[flexures]]
name = "first"
type = "leaf"
start = "ground.root"
end = "bead.left"
mirror = "x = 0.75*span + 10 mm"

[[flexures]]
name = "string"
type = "leaf"
start = "bead.right"
end = "bead_2.left"
repeat = { count = 3, step = ["span/2", 0] }

[[flexures]]
name = "leg"
type = "leaf"
start = "ground.foot"
end = "bead_2.low"
repeat = { count = 2, step = ["span/2", 0] }
"""


def test_copies_join_the_bodies_at_the_image_of_the_centre_whatever_their_names(tmp_path):
    beads = read(tmp_path, BEADS, '[release]\nbody = "bead"\n')
    joined = {f.name: (f.start, f.end.rpartition(".")[0]) for f in beads.flexures}
    assert joined == {
        "first": ("ground.root", "bead"),
        "first_mirrored_x": ("ground.root_mirrored_x", "bead_4"),
        "string": ("bead.right", "bead_2"),
        "string_2": ("bead_2.right", "bead_3"),
        "string_3": ("bead_3.right", "bead_4"),
        "leg": ("ground.foot", "bead_2"),
        "leg_2": ("ground.foot_2", "bead_3"),
    }
    assert all(len(body.points) == 3 for body in beads.bodies)


def test_copies_join_the_same_body_if_two_bodies_may_be_the_image(tmp_path):
    ring = '[[bodies]]\nname = "ring"\nmass = "1 g"\ninertia = "1 kg.mm2"\n'
    start, end = (BEADS.index(f'[[flexures]]\nname = "{name}"') for name in ("string", "leg"))
    ring += 'centre = ["10 mm + span", 0]\npoints.own = ["10 mm + span", "5 mm"]\n'
    ring += leaf("ring", "root") + leaf("bead_3", "root", "low")
    beads = read(tmp_path, BEADS[:start] + BEADS[end:] + ring, '[release]\nbody = "bead"\n')
    assert [f.end for f in beads.flexures if f.name == "leg_2"] == ["bead_2.low_2"]


@pytest.mark.slow
def test_points_of_copies_can_be_used_by_other_parts(tmp_path: Path) -> None:
    stop = '\n[[stops]]\nname = "stop"\nbody = "right_arm"\npoint = "right_arm.left_end"\n'
    assert read(tmp_path, MIRRORED + stop).stops[0].point == ("0.5*span + 0.01", 0.05)


def test_copies_of_a_file_are_limited(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(copies, "COPIES_MAX", 4)
    with pytest.raises(MechanismError, match=r"line 45: neck\.repeat: .* more than 4 copies"):
        read(tmp_path, ROW)


@pytest.mark.parametrize("name", ["FoldedSuspension", "Bistable"])
def test_shipped_mechanisms_are_their_own_mirror_images(name: str) -> None:
    """With left and right exchanged, the flexures join the images of the points."""
    chosen = mechanism(name)
    image = Line.read("x = 0").image
    joined = {(f.name, f.start, f.end) for f in chosen.flexures}
    assert {tuple(map(image.words, one)) for one in joined} == joined
    for flexure in chosen.flexures:
        for end in (flexure.start, flexure.end):
            there = chosen.point(image.words(end), flexure.name)
            assert same(image.point(chosen.point(end, flexure.name)), there)


# --- images -----------------------------------------------------------------------------------

NUMBERS = st.floats(-10.0, 10.0).map(lambda x: round(x, 6))
EXPRESSIONS = st.builds(
    lambda c, a, b: written(Affine(c, {"a": a, "b.c": b})), NUMBERS, NUMBERS, NUMBERS
)
POINTS = st.tuples(EXPRESSIONS, EXPRESSIONS)
VALUES = {"a": 0.7, "b.c": -1.3}


def at(point: Point) -> complex:
    x, y = (affine(c)(VALUES) for c in point)
    return complex(x, y)


@given(POINTS, EXPRESSIONS, st.sampled_from("xy"))
def test_a_mirror_image_is_a_reflection_in_the_line(
    point: Point, line: float | str, axis: str
) -> None:
    image = Line(axis, line).image
    z, c = at(point), affine(line)(VALUES)
    reflected = complex(2 * c - z.real, z.imag) if axis == "x" else z.conjugate() + 2j * c
    assert at(image.point(point)) == pytest.approx(reflected, abs=1e-12)
    assert same(image.point(image.point(point)), point)


@given(POINTS, POINTS, st.floats(-400.0, 400.0), st.integers(2, 9))
def test_copies_of_points_are_displaced_or_rotated(
    point: Point, other: Point, angle: float, k: int
) -> None:
    z, w = at(point), at(other)
    assert at(displaced(k, other).point(point)) == pytest.approx(z + (k - 1) * w, abs=1e-11)
    turn = cmath.exp(1j * math.radians((k - 1) * angle))
    turned = at(rotated(k, angle, other).point(point))
    assert turned == pytest.approx(w + turn * (z - w), abs=1e-11)


@given(EXPRESSIONS)
def test_written_expressions_are_read_back(expression: float | str) -> None:
    assert rounded(affine(written(affine(expression)))) == rounded(affine(expression))


@pytest.mark.parametrize(
    ("name", "line", "expected"),
    [
        ("left", "x = 0", "right"),
        ("upper_left_inner", "x = 0", "upper_right_inner"),
        ("upper_left_inner", "y = 0", "lower_left_inner"),
        ("leaf.left2", "x = 0", "leaf.right2"),
        ("top", "y = 0", "bottom"),
        ("right_to_left", "x = 0", "left_to_right"),
        ("leftover", "x = 0", "leftover_mirrored_x"),
        ("copyright", "x = 0", "copyright_mirrored_x"),
        ("left", "y = 0", "left_mirrored_y"),
        ("stage", "y = 0", "stage_mirrored_y"),
    ],
)
def test_names_of_mirror_images(name: str, line: str, expected: str) -> None:
    assert Line.read(line).image.name(name) == expected


def test_coordinates_that_differ_are_not_the_same_point() -> None:
    assert same(("a/2", 0.1), ("0.5*a", 0.1 + 1e-14))
    for other in (("0.5*a", 0.1001), ("0.5*b", 0.1), ("a/2 + 0.001", 0.1), ("a/2", "0.1*a")):
        assert not same(("a/2", 0.1), other)


TOUCHED = """
[ground]
left = ["-span", 0]
right = ["span", 0]

[[bodies]]
name = "left_block"
mass = "10 g"
inertia = "5 kg.mm2"
centre = ["-span", "30 mm"]
points.left_edge = ["-span - 2 mm", "30 mm"]
mirror = "x = 0"

[[flexures]]
name = "left_leaf"
type = "leaf"
start = "ground.left"
end = "left_block.left_edge"
mirror = "x = 0"

[[stops]]
name = "left_stop"
body = "left_block"
point = "left_block.left_edge"
direction = 170
position = "1 mm"
offset = "0.2 mm"
friction = 0.1
mirror = "x = 0"

[[stops]]
name = "left_bump"
body = "left_block"
point = ["-span + 3 mm", "30 mm"]
direction = 0
position = "2 mm"
on = "right_block"
mirror = "x = 0"

[[frictions]]
name = "left_rub"
body = "left_block"
direction = 20
coefficient = 0.2
normal_force = "1 N"
normal_stiffness = "30 N/m"
mirror = "x = 0"

[[forces]]
name = "left_push"
body = "left_block"
point = "left_block.left_edge"
mirror = "x = 0"

[[probes]]
name = "left_probe"
point = "left_block.left_edge"
mirror = "x = 0"
"""


def test_mirror_images_of_stops_friction_forces_and_probes(tmp_path: Path) -> None:
    """Directions are reflected; offsets and displacements to the left change their signs."""
    mechanism = read(tmp_path, TOUCHED, '[release]\nbody = "left_block"\ndisplacement = "1 mm"\n')
    left, right, bump, other = mechanism.stops
    assert (right.name, right.body, right.direction, right.on) == (
        "right_stop", "right_block", 10.0, "ground",
    )  # fmt: skip
    known = mechanism.values()
    places = [[affine(c)(known) for c in stop.point] for stop in (left, right)]
    assert places[0] == [-places[1][0], places[1][1]]
    assert (right.position, right.offset, right.friction) == (1e-3, -2e-4, 0.1)
    assert right.rest_speed == pytest.approx(left.rest_speed)
    assert right.rest_speed > 0.0
    assert (bump.body, bump.on, other.body, other.on) == (
        "left_block", "right_block", "right_block", "left_block",
    )  # fmt: skip
    assert other.direction == 180.0
    left_rub, rub = mechanism.frictions
    assert (rub.body, rub.direction, rub.normal_force) == ("right_block", 160.0, 1.0)
    assert (rub.normal_stiffness, left_rub.normal_stiffness) == (-30.0, 30.0)
    assert [force.name for force in mechanism.forces] == ["left_push", "right_push"]
    assert mechanism.probes[1].point == "right_block.right_edge"


def test_stops_on_a_circle_are_turned_with_it(tmp_path: Path) -> None:
    more = """
[[stops]]
name = "pin"
body = "stage"
point = "stage.hub"
direction = 90
position = "1 mm"
offset = "0.1 mm"
repeat = { count = 3, angle = 120, about = [0, "10 mm"] }
"""
    wheel = read(tmp_path, CIRCLE + more, '[release]\nbody = "stage"\nangle = "1 deg"\n')
    assert [stop.direction for stop in wheel.stops] == [90.0, -150.0, -30.0]
    assert {stop.offset for stop in wheel.stops} == {1e-4}
    known = wheel.values()
    for k, stop in enumerate(wheel.stops):
        place = complex(*(affine(c)(known) for c in stop.point)) - 0.01j
        assert place == pytest.approx(0.01 * cmath.exp(2j * math.pi * k / 3), abs=1e-15)


def test_a_copy_of_a_stop_at_its_place_is_rejected(tmp_path: Path) -> None:
    again = (
        TOUCHED.replace("direction = 170\n", "direction = 90\noffset = 0.0\n")
        .replace('offset = "0.2 mm"\n', "")
        .replace('point = "left_block.left_edge"\ndirection', 'point = [0, "30 mm"]\ndirection')
    )
    again = again.replace('name = "left_stop"\nbody = "left_block"', 'name = "stop"\nbody = "mid"')
    again += '\n[[bodies]]\nname = "mid"\nmass = 1\ninertia = 1\ncentre = [0, "30 mm"]\n'
    with pytest.raises(MechanismError, match="a copy of stop is at the same place"):
        read(tmp_path, again, '[release]\nbody = "left_block"\ndisplacement = "1 mm"\n')
