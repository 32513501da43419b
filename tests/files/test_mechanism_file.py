"""Mechanism files: values with units, defaults, messages for mistakes, schema and page."""

import contextlib
import json
import math
import os
import random
import re
import runpy
import subprocess
import sys
import tomllib
from dataclasses import fields
from functools import cache
from pathlib import Path
from types import SimpleNamespace

import jsonschema
import pytest

from mechanism_mistakes import CHANGES, CONTENTS, EXAMPLE
from prbm.base.errors import MechanismError, PrbmError
from prbm.commands.command_line import main
from prbm.commands.program import MISTAKE, OK
from prbm.files import record_units, units
from prbm.files.mechanism_file import read_mechanism, schema, shipped
from prbm.files.schema import MechanismTable
from prbm.files.toml_lines import line_of, lines
from prbm.interface.units import UNITS
from prbm.mechanism.description import Mechanism
from prbm.mechanism.fields import FIELDS
from prbm.mechanism.parts import (
    Body,
    FlexureType,
    Force,
    Friction,
    Joint,
    Probe,
    Release,
    Stop,
)
from support import ROOT, mechanism


def read(folder: Path, content: str | bytes) -> Mechanism:
    path = folder / "mine.toml"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return read_mechanism(path)


@pytest.fixture(scope="module")
def striker(tmp_path_factory) -> Mechanism:
    return read(tmp_path_factory.mktemp("striker"), EXAMPLE)


# --- values -----------------------------------------------------------------------------------


def test_numbers_with_units_are_converted_to_si_to_the_last_digit(striker):
    """The decimal is scaled before it is rounded to a double."""
    body, anvil = striker.bodies
    assert (body.mass, body.inertia, anvil.mass) == (0.053187, 2.83664e-5, 2e-3)
    assert striker.gravity == (0.0, -9.81)
    assert striker.damping_beta == 8e-6
    assert striker.geometry[0].value == 0.04
    assert striker.geometry[0].minimum == 1e-9
    assert striker.ground["side"] == (0.0, 0.01)
    assert striker.flexure_types[0].thickness == 1e-4
    assert (striker.stops[0].position, striker.stops[0].direction) == (0.002, -90.0)
    friction = striker.frictions[0]
    assert (friction.normal_force, friction.normal_stiffness) == (3e-3, 2e3)
    assert striker.release.direction == pytest.approx(90.0, rel=1e-15)  # pi/2 rounded to a double
    assert striker.release.displacement == -3e-3


def test_terms_of_expressions_may_have_units(striker):
    """The mechanism has the same expression in SI."""
    assert striker.bodies[0].centre == ("arm.length/2 + 0.003", 0.0)
    assert striker.ground["far"] == ("arm.length + 0.02", 0.05)


@pytest.mark.parametrize(
    ("written", "unit", "expected"),
    [
        ("7.8 g/cm3", "kg/m3", 7800.0),
        ("28366.4 g mm2", "kg.m2", 2.83664e-5),
        ("28366.4 g·mm²", "kg.m2", 2.83664e-5),
        ("28366.4 g*mm^2", "kg.m2", 2.83664e-5),
        ("3 mN.m/rad", "N.m/rad", 3e-3),
        ("3 mNm", "N.m", 3e-3),
        ("2 N/mm", "N/m", 2000.0),
        ("9.81 m.s-2", "m/s2", 9.81),
        ("2 kN/m/s", "N/m/s", 2000.0),
        ("5 1/s", "1/s", 5.0),
        ("5/ms", "1/s", 5000.0),
        ("50 Hz", "1/s", 50.0),
        ("3 µm", "m", 3e-6),
        ("3 μm", "m", 3e-6),
        ("3um", "m", 3e-6),
        ("-1.5e-2 mm", "m", -1.5e-5),
        ("+.5 m", "m", 0.5),
        (" 12° ", "deg", 12.0),
        ("1 deg", "rad", math.pi / 180),
        ("1 MPa", "Pa", 1e6),
        (7, "m", 7.0),
    ],
)
def test_a_number_with_a_unit_is_read_as_a_quantity(written, unit, expected):
    assert units.quantity(written, unit) == expected


@pytest.mark.parametrize(
    ("written", "expected"),
    [
        ("a.b/2", "a.b/2"),
        ("2*(a + 3 mm)", "2*(a + 0.003)"),
        ("a-3mm", "a-0.003"),
        ("3 mm/2 - a", "0.003/2 - a"),
        ("link[2].m + 1e-1 cm", "link[2].m + 0.001"),
    ],
)
def test_only_numbers_with_units_are_replaced_in_an_expression(written, expected):
    assert units.quantity(written, "m") == expected


@pytest.mark.parametrize(
    ("written", "words"),
    [
        ("3 kg", "the unit 'kg' has another dimension; write a quantity in m"),
        ("3 furlong", "the unit 'furlong' is unknown; known units are m, g, s"),
        ("3 m/kg.s", "another dimension"),
        ("a + 3 kg", "the unit 'kg' has another dimension"),
        ("a + 3 furlong", "'furlong' is unknown"),
        ("a * 3 mm", "must be a term of a sum"),
        ("3 mm*4 mm", "must be a term of a sum"),
        ("1/(3 mm)", "must be a term of a sum"),
        ("3 mm * a", "unknown"),
        ("3 12", "cannot read"),
        ("", "cannot read"),
        ("1e999 m", "finite"),
        ("1e999999999999 m", "finite"),
        ("a + 1e999 m", "finite"),
        ("3 m2", "another dimension"),
        ("3 m999999999", "is unknown"),
        ("3 if", "unknown"),
        ("3 deg", "another dimension"),
        ("a" * 2000, "at most 1000 characters"),
        (True, "write a number"),
        (math.inf, "finite"),
        (10**400, "finite"),
        ([1], "write a number"),
        (None, "write a number"),
    ],
)
def test_invalid_lengths_are_rejected(written, words):
    with pytest.raises(MechanismError, match=words):
        units.quantity(written, "m")


@pytest.mark.parametrize(
    "text", ["12", " 1e-3 ", "+12", "-(3)", "24/2", "2*6", "3 mm + 1", "2*(a + 3 mm) - 0.5"]
)
def test_numbers_in_quotes_without_a_unit_are_rejected(text):
    """The author of the file may have meant another unit than the SI unit."""
    with pytest.raises(MechanismError, match="has no unit: write a unit after each number"):
        units.quantity(text, "m")


@pytest.mark.parametrize(
    ("text", "unit"), [("0.6", ""), ("1/3", ""), ("0", "m"), ("a + 12", "m"), ("3 mm/2 - a", "m")]
)
def test_dimensionless_numbers_zero_and_terms_beside_parameters_need_no_unit(text, unit):
    units.quantity(text, unit)


HOSTILE_UNITS = (
    "m)", "( m", "m**-", "m^", "()", "m()", "1/", "/", "m\u0663", "\U0001f600", "m^0.5", "m0",
    "km999999999", "g999999999", "m" * 3000, "m*" * 3000 + "m", "m*" + "-" * 5000 + "s",
    "(" * 90 + "m", "m**9**9**9", "__import__('os')", "if", "m#", "m\n", "m\0", "degC2", "degC.m",
)  # fmt: skip


@pytest.mark.parametrize("unit", HOSTILE_UNITS)
def test_invalid_units_raise_errors_of_the_package(unit, tmp_path):
    """The units are given to all functions that read units, mechanism files or heads of records."""
    for read_unit in (
        units.check_coherent,
        lambda text: units.converted("1", text, "m"),
        lambda text: units.quantity(f"3 {text}", "m"),
        lambda text: units.si_unit(f"3 {text}"),
    ):
        with contextlib.suppress(MechanismError):
            read_unit(unit)
    if record_units.is_unit(unit):
        assert math.isfinite(math.hypot(*record_units.in_si(unit)))
        assert record_units.si_unit(unit)
    for old, new in (
        ("= 0.5", f"= 5\nunit = {json.dumps(unit)}"),
        ('"40 mm"', json.dumps(f"4 {unit}")),
    ):
        with contextlib.suppress(MechanismError):
            read(tmp_path, EXAMPLE.replace(old, new))


def test_an_angle_is_not_dimensionless():
    with pytest.raises(MechanismError, match="write a number without a unit"):
        units.quantity("12 deg", "")


def test_units_of_parameters_are_coherent_and_known_to_the_fmu():
    """Units that are not coherent SI units are rejected."""
    assert set(units.COHERENT) <= set(UNITS)
    known = {unit for part in FIELDS.values() for unit, *_ in part.values()}
    assert known <= {"", *units.COHERENT}
    for unit in units.COHERENT:
        units.check_coherent(unit.replace(".", "·"))
        if unit.startswith("1/"):
            assert units.converted("1", unit.replace("/", "/m"), unit) == 1e3
            continue
        small = f"m{unit.removeprefix('k')}"
        assert units.converted("1", small, unit) == (1e-6 if unit.startswith("k") else 1e-3)
    for unit in ("mm", "deg", "g", "kN", "g/cm3", "1/ms"):
        with pytest.raises(MechanismError, match="not an SI unit"):
            units.check_coherent(unit)


def test_a_parameter_has_the_si_unit_of_its_value(striker):
    length, ratio, *_ = striker.geometry
    assert (length.unit, ratio.unit) == ("m", "")


def test_a_material_has_two_parameters_that_flexure_types_refer_to(striker):
    """The parameters are steel.youngs_modulus [Pa] and steel.density [kg/m3], with usual bounds."""
    known = {p.name: p for p in striker.parameters}
    for name, value in (("youngs_modulus", 181.5e9), ("density", 7800.0)):
        unit, _, minimum, maximum, nominal, _ = FIELDS[FlexureType][name]
        parameter = known[f"steel.{name}"]
        assert parameter.value == value
        assert (parameter.unit, parameter.minimum, parameter.maximum) == (unit, minimum, maximum)
        assert parameter.nominal == nominal
        assert "steel" in parameter.description
        for kind in ("leaf", "right"):
            assert f"{kind}.{name}" not in known
    leaf = striker.flexure_types[0]
    assert (leaf.youngs_modulus, leaf.density) == ("steel.youngs_modulus", "steel.density")


def test_a_quantity_of_a_material_may_be_an_expression(tmp_path):
    old, new = 'youngs_modulus = "181.5 GPa"', 'youngs_modulus = "1 GPa + 1e9*ratio"'
    leaf = read(tmp_path, EXAMPLE.replace(old, new)).flexure_types[0]
    assert leaf.youngs_modulus == "1000000000.0 + 1e9*ratio"


def test_a_flexure_with_its_own_section_has_a_type_with_the_name_of_the_flexure(striker):
    leaf, right, hanger = striker.flexure_types
    assert [f.type for f in striker.flexures] == ["leaf", "right", "hanger"]
    assert (right.model, right.n, right.axial, right.thickness) == ("nR", 8, True, 5e-5)
    assert (leaf.n, leaf.axial) == (0, False)
    assert (hanger.youngs_modulus, hanger.coefficients) == (70e9, {"gamma": 0.85})
    names = {p.name for p in striker.parameters}
    assert {"right.thickness", "hanger.youngs_modulus", "hanger.gamma"} <= names


def test_one_type_of_end_applies_to_both_ends(striker):
    ends = [flexure.ends for flexure in striker.flexures]
    assert ends == [("clamp", "clamp"), ("clamp", "clamp"), ("clamp", "pin")]


def test_a_point_may_be_given_by_its_name(striker):
    tip = ("arm.length", 0.0)
    assert striker.stops[0].point == tip
    assert [force.point for force in striker.forces] == [tip, None]
    assert striker.frictions[0].point == (0.01, 0.002)
    assert striker.stops[0].on == "anvil"
    assert striker.joints[0] == Joint("hook", "arm.tip", "anvil.hook")
    assert striker.probes[0] == Probe("watch", "arm.tip")


def test_directives_to_editors_are_not_part_of_the_drawing(striker):
    assert striker.drawing == " ground --- arm --- tip"


def test_keys_have_the_defaults_of_the_fields_of_the_parts(tmp_path):
    """Each part has the same keys in a file as fields in the engine."""
    models = {Body: "bodies", Stop: "stops", Friction: "frictions", Force: "forces",
              Joint: "joints", Probe: "probes", Release: "release"}  # fmt: skip
    for part, key in models.items():
        kind = MechanismTable.model_fields[key].annotation
        table = kind if key == "release" else kind.__args__[0]
        own = {f.name: f for f in fields(part)}
        more = {"mirror", "repeat"} if part is not Release else set()
        if part is Body:
            more |= {"thickness", "material", "density", "payload"}
        assert set(table.model_fields) == set(own) | more
        for name, field in table.model_fields.items():
            computed = {Body: ("mass", "inertia", "centre"), Stop: ("rest_speed",)}
            optional = name in computed.get(part, ())
            if not field.is_required() and not optional and name not in {"points", *more}:
                assert field.default == own[name].default, (key, name)
    without_field = {"materials"}
    assert set(MechanismTable.model_fields) - without_field == {
        f.name for f in fields(Mechanism)
    } - {"drawing"}


def test_the_shipped_guides_have_the_values_of_the_experimental_structure():
    for name in ("PRBDM", "PRBDM2R", "PRBDM2RAxial", "PRBDM3R"):
        guide = mechanism(name)
        values = guide.values()
        expected = {
            "flexure.length": 0.04, "flexure.thickness": 1e-4, "flexure.width": 8e-3,
            "flexure.youngs_modulus": 181.5e9, "flexure.density": 7800.0, "shuttle.width": 0.08,
            "shuttle.mass": 0.053187, "shuttle.inertia": 2.83664e-5, "shuttle.com_height": 0.01777,
            "gravity.x": 9.81, "gravity.y": 0.0, "release.displacement": -0.018,
            "release.velocity": 0.0, "damping.beta": 8e-6, "stop.restitution": 0.6,
        }  # fmt: skip
        assert {key: values[key] for key in expected} == expected
        assert not any("material" in key or "steel" in key for key in values)


# --- mistakes ---------------------------------------------------------------------------------


def rejection(path: Path, capsys) -> str:
    """Return the message of the build command about an invalid file; check status and format."""
    folder = next(folder for folder in path.parents if folder.is_dir())
    before = [*folder.iterdir()]
    assert main(["build", "--mechanism", str(path), "--out", str(folder / "dist")]) == MISTAKE
    output = capsys.readouterr()
    assert output.out == ""
    first, *others = output.err.splitlines()
    command, _, first = first.partition(": ")
    assert command == "prbm build"
    for line in (first, *others):
        assert line.startswith(f"{path}: ")
        assert len(line) < len(str(path)) + 700
        for word in ("Traceback", "Value error", "Input should", "String should", "<text>", "None"):
            assert word not in line
    assert len(others) < 5
    if "missing: add" not in output.err and "unknown key" not in output.err:
        assert not others
    assert [*folder.iterdir()] == before
    return output.err


@pytest.mark.parametrize("mistake", CHANGES)
def test_a_mistake_is_rejected_with_a_message_and_status_2(mistake, tmp_path, capsys):
    old, new, words = CHANGES[mistake]
    assert EXAMPLE.count(old) >= 1
    path = tmp_path / "mine.toml"
    path.write_text(EXAMPLE.replace(old, new, 1), "utf-8")
    assert words in rejection(path, capsys)


@pytest.mark.parametrize("content", CONTENTS)
def test_a_file_with_other_content_is_rejected_with_a_message_and_status_2(
    content, tmp_path, capsys
):
    path = tmp_path / "mine.toml"
    path.write_bytes(CONTENTS[content][0])
    assert CONTENTS[content][1] in rejection(path, capsys)


def test_an_unreadable_path_is_rejected_with_a_message_and_status_2(tmp_path, capsys):
    assert "cannot be read (Is a directory)" in rejection(tmp_path, capsys)
    assert "cannot be read (No such file or directory)" in rejection(tmp_path / "a.toml", capsys)
    assert "cannot be read (File name too long)" in rejection(tmp_path / ("a" * 300), capsys)
    (tmp_path / "file").write_text(EXAMPLE, encoding="utf-8")
    assert "cannot be read (Not a directory)" in rejection(tmp_path / "file" / "a.toml", capsys)


@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="no such device")
def test_reading_of_an_endless_file_stops_at_the_size_limit():
    with pytest.raises(MechanismError, match="larger than"):
        read_mechanism("/dev/zero")


def test_there_are_at_least_45_mistakes():
    assert len(CHANGES) + len(CONTENTS) >= 45


TWO_LINES = (  # Mistakes of two lines that do not agree.
    "material and body of one name",
    "zero-length flexure",
    "joint of points drawn apart",
    "notch longer than its flexure",
)


@pytest.mark.parametrize("mistake", sorted({*CHANGES} - {"thousands of digits"}))
def test_the_message_gives_a_line_of_the_wrong_part(mistake, tmp_path, capsys):
    """The line is between table header and changed key, or in the other part of a conflict."""
    old, new, _ = CHANGES[mistake]
    path = tmp_path / "mine.toml"
    path.write_text(EXAMPLE.replace(old, new, 1), "utf-8")
    line = re.search(r"line (\d+)", rejection(path, capsys))
    assert line
    before = EXAMPLE[: EXAMPLE.index(old)].split("\n")
    last = len(before) + max(old.count("\n"), new.count("\n"))
    headers = [i for i, text in enumerate(before, 1) if text.startswith("[[")]
    first = max(headers, default=1)
    assert first <= int(line[1])
    assert int(line[1]) <= last or mistake in TWO_LINES


FRAGMENTS = (
    "", "=", "[", "]", "[[", "{", "}", '"', "'", '"""', "#", ".", ",", "\n", "nan", "-", "1e999",
    "true", "\\", "\0", "é", "mm", "3 mm", "/", "*", "(", "arm.length", "x" * 200, "[[bodies]]\n",
    "[release]\n", "name = 3\n", "1979-05-27",
)  # fmt: skip


@pytest.mark.slow
def test_random_edits_give_a_mechanism_or_a_message(tmp_path):
    """Only errors of the package are raised, with messages that begin with the path."""
    rng = random.Random(0)
    for _ in range(400):
        begin = rng.randrange(len(EXAMPLE))
        end = min(len(EXAMPLE), begin + rng.choice((0, 0, 1, 3, 30)))
        text = EXAMPLE[:begin] + rng.choice(FRAGMENTS) + EXAMPLE[end:]
        message = ""
        try:
            read(tmp_path, text)
        except PrbmError as error:
            message = str(error)
        assert not message or message.startswith(f"{tmp_path / 'mine.toml'}: ")


def test_lines_of_tables_and_keys_are_counted_from_1():
    text = '''\
# a = 1
title = """
[[stops]]
name = 3 # no key
"""  # a comment with " and [
raw = \'\'\'[x]\'\'\'
list = [
  1, # ]
  [2, "]"],
]
"quoted key" . inner = 'a = 3'
  [ ground ] # [comment]
left = { x = 1, y = 2 }

[[bodies]]
[bodies.points]
tip = [
0, 0]
[[bodies]]
[[bodies.deep]]
[[bodies.deep]]
a.b = 7
'''
    tomllib.loads(text)
    known = lines(text)
    assert known == {
        ("title",): 2, ("raw",): 6, ("list",): 7, ("quoted key",): 11,
        ("quoted key", "inner"): 11, ("ground",): 12, ("ground", "left"): 13, ("bodies",): 15,
        ("bodies", 0): 15, ("bodies", 0, "points"): 16, ("bodies", 0, "points", "tip"): 17,
        ("bodies", 1): 19, ("bodies", 1, "deep", 0): 20, ("bodies", 1, "deep", 1): 21,
        ("bodies", 1, "deep", 1, "a"): 22, ("bodies", 1, "deep", 1, "a", "b"): 22,
    }  # fmt: skip
    assert line_of(("bodies", 0, "points", "tip", 1), known) == 17
    assert line_of(("bodies", 1, "mass"), known) == 19
    assert line_of(("stops", 0), known) is None


def test_line_ends_of_windows_and_old_macs_are_accepted(tmp_path, striker):
    for end in ("\r\n", "\r"):
        assert read(tmp_path, EXAMPLE.replace("\n", end)) == striker
        with pytest.raises(MechanismError, match="line 3: name = 3: write a text"):
            read(tmp_path, EXAMPLE.replace('"Striker"', "3").replace("\n", end))


# --- schema and reference ---------------------------------------------------------------------


@cache
def validator() -> jsonschema.protocols.Validator:
    """Return a validator of mechanism files."""
    return jsonschema.validators.validator_for(schema())(schema())


def schema_errors(data: object) -> list[str]:
    """Return the messages of a validator of JSON schemas."""
    return [error.message for error in validator().iter_errors(data)]


def test_the_schema_is_a_valid_draft_7_schema_without_null():
    assert schema()["$schema"] == "http://json-schema.org/draft-07/schema#"
    jsonschema.Draft7Validator.check_schema(schema())
    assert "null" not in json.dumps(schema())


@pytest.mark.parametrize("name", [*shipped(), "example"])
def test_mechanisms_satisfy_the_schema(name):
    text = EXAMPLE if name == "example" else shipped()[name].read_text("utf-8")
    assert schema_errors(tomllib.loads(text)) == []


SCHEMA_MISTAKES = (
    "text as a boolean", "list as a number", "list as a value", "boolean as a number",
    "number as a name", "number as a title", "fractional number of links",
    "gravity with three numbers", "gravity with one number", "point with one number",
    "point that is a number",
    "point without a body", "array instead of table", "table instead of array",
    "ground as an array",
    "value instead of an array", "unknown key", "unknown key of the file", "unknown table",
    "key of another part", "missing key", "body without mass", "missing release",
    "mechanism named by a path", "name that is empty", "name too long",
    "part named by a path", "part with a name too long", "point with spaces",
    "both material and density", "neither material nor density", "density missing",
    "type and section", "no type and no section", "section without width", "too dense",
    "unknown model", "n too large", "n of zero", "ends wrong", "three ends", "only one end", "huge",
    "damping out of bounds", "text as a number",
    "mass and density", "plate without a thickness", "plate without an outline",
    "plate without a material", "plate with material and density", "plate without density",
    "plate of zero thickness", "mirror about an unknown axis", "mirror without a line",
    "mirror with a number", "mirror with three lines", "repeat of zero parts",
    "repeat of too many parts", "repeat with an unknown key", "repeat that is a number",
)  # fmt: skip


@pytest.mark.parametrize("mistake", SCHEMA_MISTAKES)
def test_mistakes_do_not_satisfy_the_schema(mistake):
    old, new, _ = CHANGES[mistake]
    assert schema_errors(tomllib.loads(EXAMPLE.replace(old, new, 1)))


def test_the_schema_has_unit_bounds_and_description_of_every_key():
    definitions = schema()["definitions"]
    for part, table in ((Body, "BodyTable"), (Stop, "StopTable"), (FlexureType, "FlexureTable"),
                        (Friction, "FrictionTable"), (Release, "ReleaseTable")):  # fmt: skip
        for name, (unit, description, minimum, maximum, *_) in FIELDS[part].items():
            entry = definitions[table]["properties"][name]
            assert entry["description"] == f"{description} [{unit or '-'}]"
            assert entry["anyOf"][0]["minimum"] == minimum
            assert entry["anyOf"][0]["maximum"] == maximum
    for table in (schema(), *definitions.values()):
        assert table["description"]
        assert all(entry["description"] for entry in table["properties"].values())


def test_the_command_prints_the_schema(capsys):
    assert main(["build", "--schema"]) == OK
    assert json.loads(capsys.readouterr().out) == schema()


def test_pint_is_not_imported_for_a_file_without_units(tmp_path):
    """The import of pint takes 0.3 s."""
    text = (
        (ROOT / "tests" / "interface" / "test_tables.py")
        .read_text(encoding="utf-8")
        .split('"""')[3]
    )
    (tmp_path / "plain.toml").write_text(text, encoding="utf-8")
    code = (
        "import sys; from prbm.files.mechanism_file import load; load(sys.argv[1]); "
        "sys.exit('pint' in sys.modules)"
    )
    command = [sys.executable, "-c", code, str(tmp_path / "plain.toml")]
    subprocess.run(command, check=True, env=os.environ | {"PYTHONPATH": str(ROOT / "fmu_src")})


keys = SimpleNamespace(**runpy.run_path(str(ROOT / "docs" / "write_keys.py")))


def test_the_page_has_every_key_with_unit_default_and_range():
    """``python docs/write_keys.py`` writes the tables."""
    page = keys.PAGE.read_text("utf-8")
    assert keys.page(page) == page
    assert all(f"`{symbol}`" in page for symbol in re.findall(r"(\w+)(?:,| *$)", units.KNOWN)[:9])


def test_a_page_without_a_place_for_a_table_is_not_written():
    with pytest.raises(SystemExit, match="needs one place for the keys of"):
        keys.page("")


def test_the_example_of_the_page_is_a_mechanism(tmp_path):
    page = keys.PAGE.read_text("utf-8")
    for text in re.findall(r"```toml\n(.*?)```", page, re.DOTALL):
        if "title" in text:
            assert schema_errors(tomllib.loads(text)) == []
            assert read(tmp_path, text).bodies


@pytest.mark.parametrize(
    "line", ["stress = True", "width = 0,1", "gravity = [1,, 2]", "mass = 1-2"]
)
def test_quotes_are_no_remedy_for_numbers_and_truth_values(tmp_path, line):
    path = tmp_path / "mine.toml"
    path.write_text(line, "utf-8")
    with pytest.raises(MechanismError, match="not a TOML file") as caught:
        read_mechanism(path)
    assert "in quotes" not in str(caught.value)
