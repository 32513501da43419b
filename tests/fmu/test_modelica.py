"""The Modelica package around an FMU: compiled with stand-ins for the imported block and libraries.

The stand-ins have the classes of the Modelica Standard Library that the package uses, and a mass
that the force moves in place of the imported block.
"""

import dataclasses
import re
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pytest

from many_parts import anvil
from prbm.base.errors import MechanismError
from prbm.commands.command_line import main
from prbm.commands.program import MISTAKE, OK
from prbm.fmu.modelica import NAMES, identifier, wrapper
from prbm.fmu.start import interface
from prbm.interface.variables import Variable
from support import SUPPORT, each_shipped, mechanism

rumoca = pytest.importorskip("rumoca", reason="the Modelica compiler rumoca is not installed")

LIBRARY = (SUPPORT / "modelica_library.mo").read_text(encoding="utf-8")
TEST = """
model Test
  {wrapper}.Flanges guide;
  Modelica.Mechanics.Translational.Components.Spring spring(c={c});
equation
  connect(guide.force_flange_x, spring.flange);
end Test;
"""
MASS, OMEGA = 0.05, 20.0


RESERVED = re.findall(
    r"\w+",
    """
algorithm and annotation block break class connect connector constant constrainedby der discrete
each else elseif elsewhen encapsulated end enumeration equation expandable extends external false
final flow for function if import impure in initial inner input loop model not operator or outer
output package parameter partial protected public pure record redeclare replaceable return stream
then true type when while within
""",
)
"""The reserved words of Modelica 3.6, section 2.3.3."""


def quoted(name: str) -> str:
    """Return a name with quotes around the parts that are reserved words."""
    return ".".join(f"'{x}'" if x in RESERVED else x for x in name.split("."))


def law(v: Variable, name: str) -> str:
    """Return the equation of an output of the stand-in: a mass on which the force acts."""
    if v.name == "shuttle.x":
        return f"der({name}) = {name.replace('x', 'vx')};"
    if v.name == "shuttle.vx":
        mass, force = (name.replace("shuttle", x).replace("vx", y) for x, y in PLACES)
        return f"{mass}*der({name}) = {force};"
    return f"{name} = {dict(Real='0.0', Integer='0', Boolean='false')[v.type]};"


PLACES = (("shuttle", "mass"), ("force", "x"))


def declaration(v: Variable, name: str) -> str:
    if v.causality == "parameter":
        return f"parameter Real {name} = 0.0;"
    kind = "Input" if v.causality == "input" else "Output"
    starts = {"shuttle.x": "(start=1.0, fixed=true)", "shuttle.vx": "(start=0.0, fixed=true)"}
    return f"Modelica.Blocks.Interfaces.{v.type}{kind} {name}{starts.get(v.name, '')};"


def flat_block(block: str, variables: Iterable[Variable], names: str) -> str:
    """Return a stand-in with renamed variables."""
    renamed = NAMES[names][1]
    shown = [v for v in variables if v.causality in ("parameter", "input", "output")]
    lines = [declaration(v, quoted(renamed(v.name))) for v in shown]
    lines.append("equation")
    lines += [law(v, quoted(renamed(v.name))) for v in shown if v.causality == "output"]
    return "\n".join([f"block {block}", *lines, f"end {block};"])


def structured_block(block: str, variables: Iterable[Variable]) -> str:
    """Return a stand-in in which ``a.b`` is the member b of a component a."""
    shown = [v for v in variables if v.causality in ("parameter", "input", "output")]
    classes: list[str] = []

    def nested(prefix: str) -> list[str]:
        """Return the declarations of the members with a prefix; add the classes of their types."""
        lines, inner = [], {}
        for v in shown:
            if v.name.startswith(prefix):
                head, _, tail = v.name.removeprefix(prefix).partition(".")
                if tail:
                    inner[head] = True
                else:
                    lines.append(declaration(v, quoted(head)))
        for head in inner:
            name = "Part_" + (prefix + head).replace(".", "_")
            members = nested(f"{prefix}{head}.")
            classes.append("\n".join([f"block {name}", *members, f"end {name};"]))
            lines.append(f"{name} {quoted(head)};")
        return lines

    members = nested("")
    laws = [law(v, quoted(v.name)) for v in shown if v.causality == "output"]
    return "\n".join([*classes, f"block {block}", *members, "equation", *laws, f"end {block};"])


def compiled(text: str, model: str, folder: Path):
    path = folder / "all.mo"
    path.write_text(text.replace("within ;\n", ""), encoding="utf-8")
    return rumoca.Session().load(str(path), model=model)


def complete(chosen, names: str, further: str = "", added: Iterable[Variable] = ()) -> str:
    """Return the package with its stand-ins, for the variables of a mechanism and others."""
    variables = (*interface(chosen, {}), *added)
    block = NAMES[names][0].format(chosen.name)
    inside = (
        structured_block(block, variables)
        if names == "structured"
        else flat_block(block, variables, names)
    )
    return "\n".join([LIBRARY, inside, wrapper(chosen, variables, names), further])


@pytest.mark.parametrize("names", list(NAMES))
@each_shipped
def test_the_package_compiles_for_every_mechanism(model, names, tmp_path):
    chosen = mechanism(model)
    text = complete(chosen, names)
    for name in ("Signals", "Flanges"):
        assert compiled(text, f"{chosen.name}Wrapper.{name}", tmp_path)


@pytest.mark.parametrize("names", list(NAMES))
def test_a_spring_on_the_flange_moves_the_body_harmonically(names, tmp_path):
    """With the mass m of the FMU and the stiffness m omega^2, x = cos(omega t)."""
    chosen = dataclasses.replace(
        mechanism("PRBDM"),
        bodies=tuple(dataclasses.replace(b, mass=MASS) for b in mechanism("PRBDM").bodies),
    )
    test = TEST.format(wrapper="PRBDMWrapper", c=MASS * OMEGA**2)
    model = compiled(complete(chosen, names, test), "Test", tmp_path)
    result = model.simulate(t=(0.0, 0.4), dt=0.01).to_dataframe()
    x, t = result["guide.mechanism.shuttle_x"].to_numpy(), result.index.to_numpy()
    np.testing.assert_allclose(x, np.cos(OMEGA * t), atol=1e-3)


@pytest.mark.parametrize("names", list(NAMES))
def test_every_reserved_word_may_be_part_of_a_name(names, tmp_path):
    """A parameter, an input and an output for each word, which is the first or the last part."""
    chosen = mechanism("PRBDM")
    own = {v.causality: v for v in interface(chosen, {}) if v.type == "Real"}
    forms = {"parameter": "{}.size", "input": "own.{}", "output": "{}.place"}
    if names == "underscore":
        forms["parameter"] = "{}"
    added = [
        dataclasses.replace(own[causality], name=form.format(word))
        for word in RESERVED
        for causality, form in forms.items()
    ]
    text = complete(chosen, names, added=added)
    assert compiled(text, "PRBDMWrapper.Signals", tmp_path)


def test_an_error_of_syntax_is_found_by_the_compiler(tmp_path):
    text = complete(mechanism("PRBDM"), "underscore").replace("connect(force_x,", "connect(force_x")
    with pytest.raises(rumoca.RumocaError):
        compiled(text, "PRBDMWrapper.Signals", tmp_path)


def test_a_name_that_the_imported_block_does_not_have_is_found_by_the_compiler(tmp_path):
    text = complete(mechanism("PRBDM"), "underscore").replace("fmu.stop_gap ", "fmu.stop_gab ")
    text = text.replace("fmu.stop_gap;", "fmu.stop_gab;")
    with pytest.raises(rumoca.RumocaError):
        compiled(text, "PRBDMWrapper.Signals", tmp_path)


def test_parameters_have_the_units_bounds_and_start_values_of_the_fmu():
    chosen = mechanism("PRBDM")
    text = wrapper(chosen, interface(chosen, {"stop.position": -2e-3}))
    line = next(x for x in text.splitlines() if "Real stop_position" in x)
    assert 'unit="m", displayUnit="mm"' in line
    assert line.endswith("= -0.002")
    line = next(x for x in text.splitlines() if "Real stop_restitution" in x)
    assert 'unit="1", min=0.0, max=1.0) = 0.6' in line


def test_a_title_with_quotes_and_markup_is_a_string(tmp_path):
    title = 'a "quoted" \\ title </html> end PRBDMWrapper; \n'
    chosen = dataclasses.replace(mechanism("PRBDM"), title=title)
    assert compiled(complete(chosen, "underscore"), "PRBDMWrapper.Flanges", tmp_path)


def test_a_force_without_displacement_has_no_flange():
    text = wrapper(anvil(), interface(anvil(), {}))
    assert "blow_x" in text
    assert "blow_flange_x" not in text


def test_equal_names_and_keywords_of_modelica():
    assert identifier("der") == "'der'"
    chosen = mechanism("PRBDM")
    twice = dataclasses.replace(interface(chosen, {})[0], name="flexure_length")
    with pytest.raises(MechanismError, match=r"flexure_length and flexure\.length have the same"):
        wrapper(chosen, (*interface(chosen, {}), twice))


def test_the_command_writes_the_package(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["modelica", "PRBDM"]) == OK
    assert capsys.readouterr().out == "PRBDMWrapper.mo\n"
    chosen = mechanism("PRBDM")
    assert Path("PRBDMWrapper.mo").read_text(encoding="utf-8") == wrapper(
        chosen, interface(chosen, {})
    )
    options = ["--names", "underscore", "--fmu", "Lib.Guide", "--set", "stop.position=1mm"]
    assert main(["modelica", "PRBDM", *options, "--out", "x/y.mo"]) == OK
    text = Path("x/y.mo").read_text(encoding="utf-8")
    assert "Lib.Guide fmu(flexure_length=flexure_length," in text
    assert main(["modelica", "PRBDM", "--fmu", "a b"]) == MISTAKE
    assert "--fmu a b: write the name of a class" in capsys.readouterr().err
