"""Parameter sets (SSV): valid, exact when read back, and readable in any unit."""

import json
import re
import zipfile
from pathlib import Path

import fmpy
import pytest
from fmpy import simulate_fmu
from fmpy.ssp.ssd import read_ssv
from lxml import etree

from prbm.base.errors import ParameterError
from prbm.commands import building
from prbm.commands.command_line import main, parser
from prbm.commands.program import MISTAKE, OK
from prbm.files.mechanism_file import read_mechanism, shipped
from prbm.files.settings import units_of
from prbm.fmu import python_fmu
from prbm.fmu.parameter_sets import SSC, SSV, parameter_set, read_parameter_set
from prbm.fmu.start import interface
from prbm.runs.run import simulate
from support import each_shipped, mechanism

SCHEMA = Path(fmpy.__file__).parent / "ssp" / "schema" / "SystemStructureParameterValues.xsd"
CHANGES = {"stop.restitution": 0.1 + 0.2, "stop.position": -1e-3 / 3.0}
GUIDE = {"flexure.length": "m", "shuttle.mass": "kg", "stop.restitution": "", "turn": "rad"}


def written(folder: Path, content: str | bytes) -> Path:
    path = folder / "x.ssv"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def one(value: str, units: str = "") -> str:
    """Return a parameter set of one value and the definitions of units."""
    return (
        f'<p:ParameterSet xmlns:p="{SSV}" xmlns:c="{SSC}" version="2.0" name="x"><p:Parameters>'
        f"{value}</p:Parameters><p:Units>{units}</p:Units></p:ParameterSet>"
    )


def real(name: str, value: str, kind: str = "Real") -> str:
    return f'<p:Parameter name="{name}"><p:{kind} {value}/></p:Parameter>'


@each_shipped
def test_sets_are_valid_and_read_back_exactly(model, tmp_path):
    chosen = mechanism(model)
    variables = interface(chosen, {})
    content = parameter_set(chosen, variables)
    assert content == parameter_set(chosen, variables)
    checker = etree.XMLSchema(file=str(SCHEMA))
    assert checker.validate(etree.fromstring(content)), checker.error_log
    path = written(tmp_path, content)
    assert read_parameter_set(path, units_of(chosen)) == chosen.values()
    by_fmpy = {p.name: (float(p.value), p.unit) for p in read_ssv(str(path)).parameters}
    expected = {p.name: (p.value, p.unit or None) for p in chosen.parameters}
    assert by_fmpy == expected


@pytest.mark.parametrize(
    ("value", "units", "expected"),
    [
        (real("flexure.length", 'value="50" unit="mm"'),
         '<c:Unit name="mm"><c:BaseUnit m="1" factor="0.001"/></c:Unit>', 0.05),
        (real("flexure.length", 'value="2" unit="inch"', "Float64"),
         '<c:Unit name="inch"><c:BaseUnit m="1" factor="0.0254"/></c:Unit>', 0.0508),
        (real("turn", 'value="180" unit="deg"'),
         '<c:Unit name="deg"><c:BaseUnit rad="1" factor="0.017453292519943295"/></c:Unit>',
         3.141592653589793),
        (real("stop.restitution", 'value="50" unit="%"'),
         '<c:Unit name="%"><c:BaseUnit factor="0.01"/></c:Unit>', 0.5),
        (real("shuttle.mass", 'value="3"', "Integer"), "", 3.0),
        (real("shuttle.mass", 'value="1E-3" unit="kg"'), "", 1e-3),
    ],
)  # fmt: skip
def test_values_are_converted_to_si(value, units, expected, tmp_path):
    found = read_parameter_set(written(tmp_path, one(value, units)), GUIDE)
    assert list(found.values()) == [expected]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("time,x\n0,1\n", "not a parameter set"),
        ("<ParameterSet/>", "the root element is ParameterSet"),
        (b"\xff\xfe\x00", "not a parameter set"),
        (one(real("flexure.lenght", 'value="1"')), "did you mean flexure.length"),
        (one(real("shuttle.mass", 'value="1"') * 2), "shuttle.mass is given twice"),
        (one(real("shuttle.mass", 'value="heavy"')), "write a finite number"),
        (one(real("shuttle.mass", 'value="1 2"')), "write a finite number"),
        (one(real("shuttle.mass", 'value="INF"')), "write a finite number"),
        (one(real("shuttle.mass", 'value="1e999"')), "write a finite number"),
        (one(real("shuttle.mass", 'value="true"', "Boolean")), "a value of type Boolean"),
        (one('<p:Parameter name="shuttle.mass"/>'), "no value"),
        (one(real("shuttle.mass", 'value="1" unit="lb"')), "does not define the unit lb"),
        (one(real("shuttle.mass", 'value="1" unit="mm"'),
             '<c:Unit name="mm"><c:BaseUnit m="1" factor="0.001"/></c:Unit>'),
         "the unit mm has another dimension; write a value in kg"),
        (one(real("turn", 'value="1" unit="Nm"'),
             '<c:Unit name="Nm"><c:BaseUnit kg="1" m="2" s="-2"/></c:Unit>'), "another dimension"),
    ],
)  # fmt: skip
def test_invalid_sets_are_rejected_with_file_name_and_remedy(content, message, tmp_path):
    path = written(tmp_path, content)
    with pytest.raises(ParameterError, match=re.escape(message)) as error:
        read_parameter_set(path, GUIDE)
    assert str(path) in str(error.value)


def test_a_missing_file_is_rejected(tmp_path):
    with pytest.raises(ParameterError, match="cannot be read"):
        read_parameter_set(tmp_path / "none.ssv", GUIDE)


def test_a_title_with_markup_is_text(tmp_path):
    import dataclasses

    title = "</ssv:ParameterSet> \"quoted\" & '<script>'"
    chosen = dataclasses.replace(mechanism("PRBDM"), title=title)
    content = parameter_set(chosen, interface(chosen, {}))
    assert etree.fromstring(content).get("description") == title


@pytest.mark.slow
def test_commands_write_and_read_sets(tmp_path, capsys):
    """The motion with a set is that with its values; --set has priority over a set."""
    path = tmp_path / "sets" / "x.ssv"
    options = [f"--set={name}={x!r}" for name, x in CHANGES.items()]
    assert main(["parameters", "PRBDM", *options, "--set=force.x=0.01", "--out", str(path)]) == OK
    printed = capsys.readouterr().out
    assert re.search(r"^force\.x +0\.01 N +Force on", printed, re.MULTILINE)
    run = ["simulate", "PRBDM", "--stop-time", "0.05", "--parameters", str(path), "--out"]
    assert main([*run, str(tmp_path)]) == OK
    rows = (tmp_path / "PRBDM.csv").read_text(encoding="utf-8").splitlines()
    values = CHANGES | {"force.x": 0.01}
    expected = simulate(mechanism("PRBDM"), values, stop_time=0.05)
    names = rows[0].split(",")
    for name in ("shuttle.x", "stop.rebound_speed"):
        assert float(rows[-1].split(",")[names.index(name)]) == expected[name][-1]
    assert main(["parameters", "PRBDM", "--parameters", str(path), "--set=stop.position=1mm"]) == OK
    printed = capsys.readouterr().out
    assert re.search(r"^stop\.position +0\.001 m ", printed, re.MULTILINE)
    assert main(["simulate", "Bistable", "--parameters", str(path)]) == MISTAKE


@pytest.mark.slow
@pytest.mark.fmu
def test_fmus_contain_the_set_of_their_start_values(tmp_path):
    """A set applied with FMPy to an FMU gives the motion of an FMU that is built with it."""
    guide = read_mechanism(shipped()["PRBDM"])
    path = written(tmp_path, parameter_set(guide, interface(guide, CHANGES)))
    options = parser().parse_args(["build", "PRBDM", "--parameters", str(path)])
    changes = building.start_values(
        [*building.mechanisms(options).values()], [], options.parameters
    )
    assert {name: changes[name] for name in CHANGES} == CHANGES
    plain, changed = tmp_path / "plain.fmu", tmp_path / "changed.fmu"
    plain.write_bytes(python_fmu.build(guide))
    changed.write_bytes(python_fmu.build(guide, changes))
    with zipfile.ZipFile(changed) as archive:
        inside = archive.read("extra/org.fmi-standard.fmi-ls-ref/PRBDM.ssv")
    found = read_parameter_set(written(tmp_path, inside), units_of(guide))
    assert found == changes
    kept = {"output": ["shuttle.x"], "stop_time": 0.1}
    one_way = simulate_fmu(str(plain), start_values=json.loads(json.dumps(found)), **kept)
    assert (one_way["shuttle.x"] == simulate_fmu(str(changed), **kept)["shuttle.x"]).all()
