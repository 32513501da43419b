"""Mechanism files: what may be written, what it means, and a sentence for everything else."""

import copy
import json
import math
import os
import random
import re
import subprocess
import sys
import tomllib
from dataclasses import fields
from pathlib import Path

import jsonschema
import pytest

from mechanism_mistakes import CHANGES, CONTENTS, EXAMPLE
from prbm.base.errors import MechanismError, PrbmError
from prbm.commands import building as cli
from prbm.files import units
from prbm.files.mechanism_file import read_mechanism, schema, shipped
from prbm.files.schema import MechanismTable
from prbm.files.toml_lines import line_of, lines
from prbm.interface.units import UNITS
from prbm.mechanism.description import Mechanism
from prbm.mechanism.parts import (
    FIELDS,
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


# --- what is written --------------------------------------------------------------------------


def test_units_become_si_to_the_last_digit(striker):
    """A decimal with a unit is the double that the same decimal in SI is."""
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


def test_units_stand_in_expressions(striker):
    """They are terms of sums; what is stored is the same expression in SI."""
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
def test_a_quantity_is_a_number_and_a_unit(written, unit, expected):
    assert units.quantity(written, unit) == expected


@pytest.mark.parametrize(
    ("written", "expected"),
    [
        ("1e3", "1e3"),
        ("a.b/2", "a.b/2"),
        ("2*(a + 3 mm)", "2*(a + 0.003)"),
        ("a-3mm", "a-0.003"),
        ("3 mm/2 - a", "0.003/2 - a"),
        ("link[2].m + 1e-1 cm", "link[2].m + 0.001"),
    ],
)
def test_an_expression_is_kept_but_for_its_units(written, expected):
    assert units.quantity(written, "m") == expected


@pytest.mark.parametrize(
    ("written", "words"),
    [
        ("3 kg", "'kg' is the unit of something else; write a quantity in m"),
        ("3 furlong", "the unit 'furlong' is unknown; known are m, g, s"),
        ("3 m/kg.s", "something else"),
        ("a + 3 kg", "'kg' is the unit of something else"),
        ("a + 3 furlong", "'furlong' is unknown"),
        ("a * 3 mm", "'mm' is the unit|is a term of a sum"),
        ("3 mm*4 mm", "is a term of a sum"),
        ("1/(3 mm)", "is a term of a sum"),
        ("3 mm * a", "unknown"),
        ("3 12", "cannot read"),
        ("", "cannot read"),
        ("1e999 m", "finite"),
        ("1e999999999999 m", "finite"),
        ("a + 1e999 m", "finite"),
        ("3 m2", "something else"),
        ("3 m999999999", "something else"),
        ("3 if", "unknown"),
        ("3 deg", "something else"),
        ("a" * 2000, "at most 1000 characters"),
        (True, "write a number"),
        (math.inf, "finite"),
        (10**400, "finite"),
        ([1], "write a number"),
        (None, "write a number"),
    ],
)
def test_what_is_no_length_is_a_sentence(written, words):
    with pytest.raises(MechanismError, match=words):
        units.quantity(written, "m")


def test_an_angle_is_no_plain_number():
    with pytest.raises(MechanismError, match="write a number without a unit"):
        units.quantity("12 deg", "")


def test_units_are_those_that_an_fmu_can_have():
    """A parameter whose value has a unit gets one that the FMU knows; all are coherent."""
    assert set(units.COHERENT) <= set(UNITS)
    known = {unit for part in FIELDS.values() for unit, *_ in part.values()}
    assert known <= {"", *units.COHERENT}
    for unit in units.COHERENT:
        units.check_coherent(unit.replace(".", "·"))
        small = f"m{unit.removeprefix('k')}"
        assert units.converted("1", small, unit) == (1e-6 if unit.startswith("k") else 1e-3)
    for unit in ("mm", "deg", "g", "kN", "g/cm3", "1/ms"):
        with pytest.raises(MechanismError, match="parameters are in SI"):
            units.check_coherent(unit)


def test_a_parameter_has_the_unit_of_its_value(striker):
    length, ratio, *_ = striker.geometry
    assert (length.unit, ratio.unit) == ("m", "")


def test_a_material_is_two_parameters_that_types_refer_to(striker):
    """What a user sees of it: steel.youngs_modulus [Pa], steel.density [kg/m3], in bounds."""
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


def test_a_material_may_be_an_expression(tmp_path):
    old, new = 'youngs_modulus = "181.5 GPa"', 'youngs_modulus = "1 GPa + 1e9*ratio"'
    leaf = read(tmp_path, EXAMPLE.replace(old, new)).flexure_types[0]
    assert leaf.youngs_modulus == "1000000000.0 + 1e9*ratio"


def test_a_flexure_with_a_section_of_its_own_has_a_type_of_its_name(striker):
    leaf, right, hanger = striker.flexure_types
    assert [f.type for f in striker.flexures] == ["leaf", "right", "hanger"]
    assert (right.model, right.n, right.axial, right.thickness) == ("nR", 8, True, 5e-5)
    assert (leaf.n, leaf.axial) == (0, False)
    assert (hanger.youngs_modulus, hanger.coefficients) == (70e9, {"gamma": 0.85})
    names = {p.name for p in striker.parameters}
    assert {"right.thickness", "hanger.youngs_modulus", "hanger.gamma"} <= names


def test_ends_are_two_or_the_same_twice(striker):
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


def test_a_directive_to_the_editor_is_no_part_of_the_drawing(striker):
    assert striker.drawing == " ground --- arm --- tip"


def test_what_is_left_out_has_the_default_of_the_engine(tmp_path):
    """The default of every key is that of the data, and there is no key less."""
    models = {Body: "bodies", Stop: "stops", Friction: "frictions", Force: "forces",
              Joint: "joints", Probe: "probes", Release: "release"}  # fmt: skip
    for part, key in models.items():
        kind = MechanismTable.model_fields[key].annotation
        table = kind if key == "release" else kind.__args__[0]
        own = {f.name: f for f in fields(part)}
        assert set(table.model_fields) == set(own)
        for name, field in table.model_fields.items():
            if not field.is_required() and name != "points":
                assert field.default == own[name].default, (key, name)
    made = {"materials"}
    assert set(MechanismTable.model_fields) - made == {f.name for f in fields(Mechanism)} - {
        "drawing"
    }


def test_the_guides_are_what_they_were():
    """Values of the experimental structure, however they are written."""
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


def refused(path: Path, capsys) -> str:
    """Return what the command says about a file, which is status 2 and lines of a kind."""
    folder = next(folder for folder in path.parents if folder.is_dir())
    before = [*folder.iterdir()]
    assert cli.main(["--mechanism", str(path), "--out", str(folder / "dist")]) == cli.MISTAKE
    told = capsys.readouterr()
    assert told.out == ""
    first, *others = told.err.splitlines()
    command, _, first = first.partition(": ")
    assert command == "build_fmu.py"
    for line in (first, *others):
        assert line.startswith(f"{path}: ")
        assert len(line) < len(str(path)) + 700
        for word in ("Traceback", "Value error", "Input should", "String should", "<text>", "None"):
            assert word not in line
    assert len(others) < 5
    if "missing: add" not in told.err and "is no key" not in told.err:
        assert not others
    assert [*folder.iterdir()] == before
    return told.err


@pytest.fixture(autouse=True)
def _as_the_command(monkeypatch):
    monkeypatch.setattr(sys, "argv", ["build_fmu.py"])


@pytest.mark.parametrize("mistake", CHANGES)
def test_a_mistake_is_a_sentence_and_status_2(mistake, tmp_path, capsys):
    old, new, words = CHANGES[mistake]
    assert EXAMPLE.count(old) >= 1
    path = tmp_path / "mine.toml"
    path.write_text(EXAMPLE.replace(old, new, 1), "utf-8")
    assert words in refused(path, capsys)


@pytest.mark.parametrize("content", CONTENTS)
def test_a_file_of_anything_is_a_sentence_and_status_2(content, tmp_path, capsys):
    path = tmp_path / "mine.toml"
    path.write_bytes(CONTENTS[content][0])
    assert CONTENTS[content][1] in refused(path, capsys)


def test_what_is_no_file_is_a_sentence_and_status_2(tmp_path, capsys):
    assert "cannot be read (Is a directory)" in refused(tmp_path, capsys)
    assert "cannot be read (No such file or directory)" in refused(tmp_path / "a.toml", capsys)
    assert "cannot be read (File name too long)" in refused(tmp_path / ("a" * 300), capsys)
    (tmp_path / "file").write_text(EXAMPLE)
    assert "cannot be read (Not a directory)" in refused(tmp_path / "file" / "a.toml", capsys)


@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="no such device")
def test_a_file_without_an_end_is_read_no_further_than_a_mechanism_goes():
    with pytest.raises(MechanismError, match="larger than"):
        read_mechanism("/dev/zero")


def test_there_are_many_mistakes():
    assert len(CHANGES) + len(CONTENTS) >= 45


TWO_PLACES = (
    "name of a material and a body",
    "zero-length flexure",
    "joint of points drawn apart",
)


@pytest.mark.parametrize("mistake", sorted({*CHANGES} - {"thousands of digits"}))
def test_a_mistake_has_the_line_of_its_key_or_part(mistake, tmp_path, capsys):
    """Between the header of the table and the key where it was made, or at what does not fit it."""
    old, new, _ = CHANGES[mistake]
    path = tmp_path / "mine.toml"
    path.write_text(EXAMPLE.replace(old, new, 1), "utf-8")
    line = re.search(r"line (\d+)", refused(path, capsys))
    assert line
    before = EXAMPLE[: EXAMPLE.index(old)].split("\n")
    last = len(before) + max(old.count("\n"), new.count("\n"))
    headers = [i for i, text in enumerate(before, 1) if text.startswith("[[")]
    first = max(headers, default=1)
    assert first <= int(line[1])
    assert int(line[1]) <= last or mistake in TWO_PLACES


SCRAPS = (
    "", "=", "[", "]", "[[", "{", "}", '"', "'", '"""', "#", ".", ",", "\n", "nan", "-", "1e999",
    "true", "\\", "\0", "é", "mm", "3 mm", "/", "*", "(", "arm.length", "x" * 200, "[[bodies]]\n",
    "[release]\n", "name = 3\n", "1979-05-27",
)  # fmt: skip


def test_no_scrap_at_any_place_is_a_traceback(tmp_path):
    """What a slip of the keyboard makes of a file is a mechanism, or a sentence."""
    rng = random.Random(0)
    for _ in range(400):
        begin = rng.randrange(len(EXAMPLE))
        end = min(len(EXAMPLE), begin + rng.choice((0, 0, 1, 3, 30)))
        text = EXAMPLE[:begin] + rng.choice(SCRAPS) + EXAMPLE[end:]
        told = ""
        try:
            read(tmp_path, text)
        except PrbmError as error:
            told = str(error)
        assert not told or told.startswith(f"{tmp_path / 'mine.toml'}: ")


def test_lines_are_those_of_an_editor():
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


def test_line_ends_of_other_systems_are_line_ends(tmp_path, striker):
    for end in ("\r\n", "\r"):
        assert read(tmp_path, EXAMPLE.replace("\n", end)) == striker
        with pytest.raises(MechanismError, match="line 3: name = 3: write a text"):
            read(tmp_path, EXAMPLE.replace('"Striker"', "3").replace("\n", end))


# --- schema and reference ---------------------------------------------------------------------


def problems(data: object) -> list[str]:
    """Return what a validator of JSON schemas says."""
    validator = jsonschema.validators.validator_for(schema())
    return [error.message for error in validator(schema()).iter_errors(data)]


def test_the_schema_is_one():
    assert schema()["$schema"] == "http://json-schema.org/draft-07/schema#"
    jsonschema.Draft7Validator.check_schema(schema())
    assert "null" not in json.dumps(schema())


@pytest.mark.parametrize("name", [*shipped(), "example"])
def test_what_is_a_mechanism_satisfies_the_schema(name):
    text = EXAMPLE if name == "example" else shipped()[name].read_text("utf-8")
    assert problems(tomllib.loads(text)) == []


SEEN = (
    "text as a truth", "list as a number", "list as a value", "truth as a number",
    "number as a name", "number as a title", "part of a link", "gravity with three numbers",
    "gravity with one number", "point with one number", "point that is a number",
    "point without a body", "array instead of table", "table instead of array",
    "ground as an array",
    "value instead of an array", "unknown key", "unknown key of the file", "unknown table",
    "key of another part", "missing key", "body without mass", "missing release",
    "name with a path", "name that is empty", "name too long",
    "part with a path", "part with a name too long", "point with spaces",
    "both material and density", "neither material nor density", "half a material",
    "type and section", "no type and no section", "section without width", "too dense",
    "unknown model", "n too large", "n of nothing", "ends wrong", "three ends", "one end", "huge",
    "damping out of bounds", "text as a number",
)  # fmt: skip


@pytest.mark.parametrize("mistake", SEEN)
def test_what_is_none_does_not_satisfy_the_schema(mistake):
    old, new, _ = CHANGES[mistake]
    assert problems(tomllib.loads(EXAMPLE.replace(old, new, 1)))


def test_the_schema_tells_what_the_code_knows():
    """Unit, bounds and default of every quantity, and a description of every key."""
    definitions = schema()["definitions"]
    for part, table in ((Body, "BodyTable"), (Stop, "StopTable"), (FlexureType, "FlexureTable"),
                        (Friction, "FrictionTable"), (Release, "ReleaseTable")):  # fmt: skip
        for name, (unit, description, minimum, maximum, *_) in FIELDS[part].items():
            told = definitions[table]["properties"][name]
            assert told["description"] == f"{description} [{unit or '-'}]"
            assert told["anyOf"][0]["minimum"] == minimum
            assert told["anyOf"][0]["maximum"] == maximum
    for table in (schema(), *definitions.values()):
        assert table["description"]
        assert all(told["description"] for told in table["properties"].values())


def test_the_command_prints_the_schema(capsys):
    assert cli.main(["--schema"]) == cli.OK
    assert json.loads(capsys.readouterr().out) == schema()


def test_a_mechanism_without_units_needs_no_library_of_units(tmp_path):
    """It takes a third of a second to import."""
    text = (ROOT / "tests" / "interface" / "test_tables.py").read_text().split('"""')[3]
    (tmp_path / "plain.toml").write_text(text)
    code = (
        "import sys; from prbm.files.mechanism_file import load; load(sys.argv[1]); "
        "sys.exit('pint' in sys.modules)"
    )
    command = [sys.executable, "-c", code, str(tmp_path / "plain.toml")]
    subprocess.run(command, check=True, env=os.environ | {"PYTHONPATH": str(ROOT / "fmu_src")})


REFERENCE = ROOT / "docs" / "mechanism-files.md"


def keys_of(table: dict) -> str:
    """Return the keys of a table of the schema as a table of Markdown."""
    rows = ["| key | unit | default | range | meaning |", "|---|---|---|---|---|"]
    for key, told in table["properties"].items():
        meaning, _, unit = told["description"].partition(" [")
        cells = (f"`{key}`", unit.rstrip("]"), default(table, key), span(told), meaning)
        rows.append("| " + " | ".join(cells).replace("|  |", "| |") + " |")
    return "\n".join(row.replace("|  |", "| |").replace("|  |", "| |") for row in rows)


def default(table: dict, key: str) -> str:
    if key in table.get("required", ()):
        return "required"
    value = table["properties"][key].get("default", "")
    return "" if value in ("", [], {}) else f"`{json.dumps(value)}`"


def span(told: dict) -> str:
    """Return the bounds or the choices of a key."""
    choices = [told, *told.get("anyOf", ()), *told.get("oneOf", ())]
    for choice in choices:
        if "enum" in choice:
            return ", ".join(f"`{value}`" for value in choice["enum"])
        if "minimum" in choice:
            return f"{choice['minimum']:g} to {choice['maximum']:g}"
    items = told.get("items", {})
    return span(items) if items else ""


def test_the_reference_page_has_every_key_with_unit_default_and_range():
    page = REFERENCE.read_text("utf-8")
    told = schema()
    tables = {key: _definition(told, key) for key in told["properties"]}
    for key, table in {"mechanism": told, **tables}.items():
        if table is not None:
            block = re.search(rf"<!-- keys of {key} -->\n(.*?)\n<!-- end -->", page, re.DOTALL)
            assert block, f"docs/mechanism-files.md needs the keys of {key}:\n{keys_of(table)}"
            assert block[1] == keys_of(table), key
    assert all(f"`{symbol}`" in page for symbol in re.findall(r"(\w+)(?:,| *$)", units.KNOWN)[:9])


def _definition(told: dict, key: str) -> dict | None:
    """Return the table, or the table of the array, that a key of the file holds."""
    reference = re.search(r"#/definitions/(\w+)", json.dumps(told["properties"][key]))
    return copy.copy(told["definitions"][reference[1]]) if reference else None


def test_the_example_of_the_reference_page_is_a_mechanism(tmp_path):
    page = REFERENCE.read_text("utf-8")
    for text in re.findall(r"```toml\n(.*?)```", page, re.DOTALL):
        if "title" in text:
            assert problems(tomllib.loads(text)) == []
            assert read(tmp_path, text).bodies
