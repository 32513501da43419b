"""A Modelica package around the FMU of a mechanism: parameters, signals, and flanges for forces.

The package contains the block that a Modelica tool makes when it imports the FMU.  Tools name the
variables of this block in different ways, see :data:`NAMES`.
"""

import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from html import escape

from ..base.errors import MechanismError
from ..base.text import printable
from ..interface.variables import Variable
from ..mechanism.description import Mechanism
from .description import number
from .terminals import displaced

KEYWORDS = re.compile(
    "algorithm|and|annotation|assert|block|break|class|connect|connector|constant|constrainedby|"
    "der|discrete|each|else|elseif|elsewhen|encapsulated|end|enumeration|equation|expandable|"
    "extends|external|false|final|flow|for|function|if|import|impure|in|initial|inner|input|loop|"
    "model|not|operator|or|outer|output|package|parameter|partial|protected|public|pure|record|"
    "redeclare|replaceable|return|stream|then|true|type|when|while|within"
)
TYPES = {"Real": "Real", "Integer": "Integer", "Boolean": "Boolean"}
INTERFACES = "Modelica.Blocks.Interfaces"
TRANSLATION, ROTATION = "Modelica.Mechanics.Translational", "Modelica.Mechanics.Rotational"
AXES = {"x": "flange_x", "y": "flange_y", "moment": "flange_moment"}


def underscored(name: str) -> str:
    """Return a name as OpenModelica writes it: dots, brackets and the like are underscores."""
    return re.sub(r"[.\[\], ()]", "_", name)


NAMES: dict[str, tuple[str, Callable[[str], str] | None]] = {
    "structured": ("{}_fmu", None),
    "underscore": ("{}_me_FMU", underscored),
}
"""Kinds of names: the usual class of the imported block, and the names of its variables.

They are ``force.x``, the member x of a component force, and ``force_x``.
"""


def wrapper(
    mechanism: Mechanism,
    variables: Iterable[Variable],
    names: str = "structured",
    imported: str | None = None,
) -> str:
    """Return the text of the package ``NAMEWrapper``.

    Its model ``Signals`` has the parameters, inputs and outputs of the FMU with units; inputs that
    are not used have their start values, usually zero.  Its model ``Flanges`` has forces as
    flanges, if the displacement of their point is an output.

    Parameters
    ----------
    mechanism : Mechanism
        The mechanism.
    variables : iterable of Variable
        The variables of its FMU, with the start values.
    names : str
        A key of :data:`NAMES`.
    imported : str or None
        Class of the imported block (default: that of :data:`NAMES`).

    Raises
    ------
    MechanismError
        If two variables have the same name in Modelica, where ``a.b`` is ``a_b``.
    """
    usual, renamed = NAMES[names]
    block = imported or usual.format(mechanism.name)
    listed = tuple(variables)
    _check_names(listed)
    body = [*_signals(listed, block, renamed), "", *_flanges(mechanism, listed)]
    package = f"{mechanism.name}Wrapper"
    title = f"Modelica interface of {mechanism.name}.fmu: {mechanism.title}"
    text = (
        f"Import {mechanism.name}.fmu in your tool first, as the block {block}. Signals has its "
        "variables. Flanges has the forces on bodies as flanges: the FMU gives the displacement "
        "and takes the force, so that a mass needs a spring between them. Impacts are inside the "
        "FMU."
    )
    return "\n".join(
        [
            "within ;",
            f"package {package} {_string(title)}",
            "  extends Modelica.Icons.Package;",
            "",
            *(f"  {line}".rstrip() for line in body),
            "",
            "  annotation (",
            '    uses(Modelica(version="4.0.0")),',
            f"    Documentation(info={_string(f'<html><p>{escape(text)}</p></html>')}));",
            f"end {package};",
            "",
        ]
    )


def identifier(name: str) -> str:
    """Return the name of a variable as an identifier of Modelica.

    Examples
    --------
    >>> identifier("force.x"), identifier("end")
    ('force_x', "'end'")
    """
    plain = underscored(name)
    return f"'{name}'" if KEYWORDS.fullmatch(plain) else plain


def _member(name: str, renamed: Callable[[str], str] | None) -> str:
    """Return the name of a variable in the imported block; reserved words are quoted."""
    parts = name.split(".") if renamed is None else [renamed(name)]
    return ".".join(map(_quoted, parts))


def _quoted(part: str) -> str:
    return f"'{part}'" if KEYWORDS.fullmatch(part) else part


def _check_names(variables: Iterable[Variable]) -> None:
    """Reject two names that are the same in Modelica."""
    found: dict[str, str] = {"fmu": "the imported block"}
    shown = [v for v in variables if v.causality in ("parameter", "input", "output")]
    inputs = [v for v in shown if v.causality == "input"]
    names = [v.name for v in shown] + [f"{v.name}.value" for v in inputs]
    for name in dict.fromkeys(names + [f"use.{_group(v)}" for v in inputs]):
        other = found.setdefault(identifier(name), name)
        if other != name:
            raise MechanismError(
                f"{name} and {other} have the same name {identifier(name)} in Modelica: rename one "
                "of them in the mechanism file"
            )


def _string(text: str) -> str:
    """Return a text as a string of Modelica."""
    plain = printable(text).replace("\\", "\\\\").replace('"', '\\"')
    return f'"{plain}"'


def _attributes(v: Variable, *, bounds: bool) -> str:
    """Return the modification of a Real's unit and, for parameters, bounds."""
    if v.type != "Real":
        return ""
    display = v.display or v.quantity.display
    found = [f'quantity="{v.quantity.name}"', f'unit="{v.unit}"']
    found += [f'displayUnit="{display}"'] if display else []
    if bounds:
        found += [f"min={number(v.minimum)}"] if math.isfinite(v.minimum) else []
        found += [f"max={number(v.maximum)}"] if math.isfinite(v.maximum) else []
    return f"({', '.join(found)})"


# --- signals --------------------------------------------------------------------------------------


def _signals(
    variables: tuple[Variable, ...], block: str, renamed: Callable[[str], str] | None
) -> Iterator[str]:
    """Yield the lines of the model with all parameters, inputs and outputs."""
    parameters = [v for v in variables if v.causality == "parameter"]
    inputs = [v for v in variables if v.causality == "input"]
    outputs = [v for v in variables if v.causality == "output"]
    yield 'model Signals "Parameters, inputs and outputs of the FMU"'
    yield "  extends Modelica.Blocks.Icons.Block;"
    for group in dict.fromkeys(map(_group, inputs)):
        use, part = identifier(f"use.{group}"), group or "input"
        yield f'  parameter Boolean {use} = false "Use the inputs of {part}"'
        yield "    annotation (Evaluate=true, choices(checkBox=true));"
    for v in parameters:
        start = f"{TYPES[v.type]} {identifier(v.name)}{_attributes(v, bounds=True)}"
        yield f"  parameter {start} = {number(float(v.start or 0.0))}"
        yield f"    {_string(v.description)};"
    for v, place in zip(inputs, _places(len(inputs), -110), strict=True):
        use = identifier(f"use.{_group(v)}")
        yield f"  {_connector(v, 'Input')} if {use}"
        yield f"    {_string(v.description)} {place};"
    for v, place in zip(outputs, _places(len(outputs), 110), strict=True):
        yield f"  {_connector(v, 'Output')}"
        yield f"    {_string(v.description)} {place};"
    given = _modification({v.name: identifier(v.name) for v in parameters}, renamed)
    yield f'  {block} fmu({given}) "Block that the import of the FMU makes";'
    yield "protected"
    for v in inputs:
        yield f'  {INTERFACES}.{v.type}Input {_inner(v)} "Value of the input";'
    yield "equation"
    for v in inputs:
        yield f"  connect({identifier(v.name)}, {_inner(v)});"
        yield f"  if not {identifier(f'use.{_group(v)}')} then"
        yield f"    {_inner(v)} = {number(float(v.start or 0.0))};"
        yield "  end if;"
        yield f"  fmu.{_member(v.name, renamed)} = {_inner(v)};"
    for v in outputs:
        yield f"  {identifier(v.name)} = fmu.{_member(v.name, renamed)};"
    yield "end Signals;"


def _group(v: Variable) -> str:
    """Return the part of an input's name that inputs used together have in common."""
    return v.name.rpartition(".")[0]


def _inner(v: Variable) -> str:
    return identifier(f"{v.name}.value")


def _connector(v: Variable, kind: str) -> str:
    declared = f"{INTERFACES}.{v.type}{kind} {identifier(v.name)}"
    return declared + _attributes(v, bounds=False)


def _places(count: int, x: int) -> Iterator[str]:
    """Yield the placements of connectors in a column of the diagram, from top to bottom."""
    size = 200.0 / max(count, 10)
    for k in range(count):
        y = 100.0 - size * (k + 0.5)
        corners = (x - size / 2, y - size / 2, x + size / 2, y + size / 2)
        a, b, c, d = (f"{corner:.4g}" for corner in corners)
        yield f"annotation (Placement(transformation(extent={{{{{a},{b}}},{{{c},{d}}}}})))"


def _modification(values: Mapping[str, str], renamed: Callable[[str], str] | None) -> str:
    """Return the modification of the parameters of a block."""
    if renamed is not None:
        return ", ".join(f"{_member(name, renamed)}={value}" for name, value in values.items())
    nested: dict[str, dict[str, str]] = {}
    found = []
    for name, value in values.items():
        head, _, tail = name.partition(".")
        if tail:
            nested.setdefault(head, {})[tail] = value
        else:
            found.append(f"{_quoted(name)}={value}")
    found += [f"{_quoted(head)}({_modification(inside, None)})" for head, inside in nested.items()]
    return ", ".join(found)


# --- flanges --------------------------------------------------------------------------------------


def _flanges(mechanism: Mechanism, variables: tuple[Variable, ...]) -> Iterator[str]:
    """Yield the lines of the model with forces as flanges."""
    known = {v.name for v in variables if v.causality == "output"}
    declared, equations, used = [], [], []
    for force in mechanism.forces:
        point = displaced(mechanism, force)
        if point is None:
            continue
        used.append(f"{identifier(f'use.{force.name}')}=true")
        motions = {axis: (f"{point}.{axis}", f"{point}.v{axis}") for axis in "xy"}
        motions["moment"] = (f"{force.body}.angle", f"{force.body}.omega")
        for axis, (position, rate) in motions.items():
            assert {position, rate} <= known
            flange = identifier(f"{force.name}.{AXES[axis]}")
            adaptor = identifier(f"{force.name}.{axis}.adaptor")
            library, component = (
                (ROTATION, "GeneralAngleToTorqueAdaptor")
                if axis == "moment"
                else (TRANSLATION, "GeneralPositionToForceAdaptor")
            )
            ends = "phi, w and tau" if axis == "moment" else "s, v and f"
            declared += [
                f"  {library}.Interfaces.Flange_b {flange}",
                f'    "Flange of {force.name}.{axis} and {position}";',
                f"  {library}.Components.{component} {adaptor}(use_pder=true, use_pder2=false)",
                f'    "Signals of {ends}";',
            ]
            equations += [
                f"  connect(mechanism.{identifier(position)}, {adaptor}.p);",
                f"  connect(mechanism.{identifier(rate)}, {adaptor}.pder);",
                f"  connect({adaptor}.f, mechanism.{identifier(f'{force.name}.{axis}')});",
                f"  connect({adaptor}.flange, {flange});",
            ]
    yield 'model Flanges "The mechanism with its forces as flanges"'
    yield f"  Signals mechanism({', '.join(used)});"
    yield from declared
    yield "equation"
    yield from equations
    yield "end Flanges;"
