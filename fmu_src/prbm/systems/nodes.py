"""Components, systems and connections of a system structure package, and its meaning."""

from collections.abc import Container, Iterable, Iterator
from dataclasses import dataclass, field, replace
from typing import Any

from .components import CouplingError, Value, attribute
from .signals import ENUMERATION, INTEGER, REAL, WIDENED, Linear, Signal, Table, Unit

SLASH = "/"
"""Between the names of nested systems in the name of an instance."""
NUMBERED = {*WIDENED, (ENUMERATION, INTEGER), (ENUMERATION, REAL), (INTEGER, ENUMERATION)}
"""Types that may be connected where an enumeration is its number."""


def kind_of(variable: Any) -> str:
    """Return the type of SSP of a variable of an FMU."""
    kind = str(variable.type)
    if kind.startswith(("Int", "UInt")):
        return INTEGER
    return REAL if kind.startswith("Float") else kind


def check_types(
    to: str,
    given: Any,
    source: str,
    output: Any,
    widened: Container[tuple[str, str]] = WIDENED,
) -> None:
    """Check that an input takes the values of an output as they are.

    Parameters
    ----------
    to, source : str
        Names of the input and of the output, for messages.
    given, output
        Descriptions of the input and of the output.
    widened : container of (str, str)
        Different types of SSP that may be connected.

    Raises
    ------
    CouplingError
        If the type of the input does not contain that of the output.
    """
    kinds = kind_of(output), kind_of(given)
    if kinds[0] != kinds[1] and kinds not in widened:
        raise CouplingError(
            f"{source} of type {output.type} cannot be connected to {to} of type {given.type}: "
            "connect variables of one type"
        )


def items_of(variable: Any) -> dict[int, str]:
    """Return the items of an enumeration by value."""
    items = () if variable.declaredType is None else variable.declaredType.items
    return {int(x.value): x.name for x in items}


@dataclass(frozen=True)
class Connector:
    """A connector: its kind, and its type and unit if they are given or can be deduced."""

    kind: str
    type: str | None
    unit: Unit | None
    vague: bool = False


@dataclass(frozen=True)
class Wire:
    """A connection inside a system; an element "" is the system itself."""

    source: tuple[str, str]
    sink: tuple[str, str]
    transformation: Linear | Table | None
    suppress: bool


@dataclass
class Node:
    """A component or a system.

    Parameters
    ----------
    name : str
        Name in the enclosing system.
    path : str
        Names from the outermost system to here, joined by slashes; "" is the outermost system.
    parent : Node or None
        The enclosing system.
    fmu : str or None
        Name of the file of a component; None for a system.
    """

    name: str
    path: str
    parent: "Node | None"
    fmu: str | None = None
    connectors: dict[str, Connector] = field(default_factory=dict)
    elements: "dict[str, Node]" = field(default_factory=dict)
    wires: list[Wire] = field(default_factory=list)
    bindings: list[Any] = field(default_factory=list)
    variables: dict[str, Any] = field(default_factory=dict)
    units: dict[str, Unit] = field(default_factory=dict)

    def unit(self, variable: Any) -> Unit | None:
        """Return the unit of a variable of a component."""
        name = attribute(variable, "unit")
        if not name:
            return None
        relative = bool(attribute(variable, "relativeQuantity"))
        return replace(self.units.get(name, Unit(name)), relative=relative)


@dataclass(frozen=True)
class Flat:
    """The meaning of a package.

    Parameters
    ----------
    fmus : dict of str to str
        Names of the files in the package, by the names of the instances.
    wires : dict of str to (str, Signal)
        Source and function by connected input, both as ``instance.variable``.
    outputs : dict of str to (str, Signal)
        Source and function by output of the outermost system.
    values : dict of str to value
        Start values in the units of the FMUs, ``instance.variable``.
    recorded : tuple of str
        Numeric outputs with a connector, ``instance.variable``.
    ignored : tuple of str
        Names in parameter sets that match no variable.
    stop_time : float or None
        Stop time of the default experiment [s].
    """

    fmus: dict[str, str]
    wires: dict[str, tuple[str, Signal]]
    outputs: dict[str, tuple[str, Signal]]
    values: dict[str, Value]
    recorded: tuple[str, ...]
    ignored: tuple[str, ...]
    stop_time: float | None


def place(node: Node, element: str, name: str) -> str:
    """Return the full name of a connector, for messages and results."""
    path = SLASH.join(x for x in (node.path, element) if x)
    return f"{path}.{name}" if path else name


def column(full: str) -> str:
    """Return the name of a variable in a result, ``system.component.variable``."""
    instance, dot, variable = full.partition(".")
    return instance.replace(SLASH, ".") + dot + variable


def systems(node: Node) -> Iterator[Node]:
    """Yield a system and all systems inside."""
    if node.fmu is None:
        yield node
    for element in node.elements.values():
        yield from systems(element)


def deduce_units(top: Node) -> None:
    """Give the connectors of systems the unit of what is connected inside, if it is one unit."""
    for node in systems(top):
        for name, connector in node.connectors.items():
            if connector.unit is None:
                found = _units_inside(node, name)
                unit = next(iter(found.values())) if len(found) == 1 else None
                node.connectors[name] = replace(connector, unit=unit, vague=len(found) != 1)


def _units_inside(node: Node, name: str) -> dict[object, Unit | None]:
    """Return the units of a connector or variable, by their meaning."""
    unit = node.connectors[name].unit if node.fmu is None else node.unit(node.variables[name])
    if node.fmu is not None or unit is not None:
        meaning = unit and (unit.base or unit.name, unit.factor, unit.offset, unit.relative)
        return {meaning: unit}
    inside = [wire.sink for wire in node.wires if wire.source == ("", name)]
    inside += [wire.source for wire in node.wires if wire.sink == ("", name)]
    result: dict[object, Unit | None] = {}
    for element, inner in inside:
        if element:
            result |= _units_inside(node.elements[element], inner)
    return result


def check_loops(top: Node) -> None:
    """Check that no connectors of systems are connected in a loop without an FMU.

    Raises
    ------
    CouplingError
        If there is such a loop.
    """
    sources = {
        _end(node, *wire.sink): _end(node, *wire.source)
        for node in systems(top)
        for wire in node.wires
        if not (wire.sink[0] and node.elements[wire.sink[0]].fmu)
    }
    for end in sources:
        at, seen = sources.get(end), {end}
        while at is not None and at not in seen:
            seen.add(at)
            at = sources.get(at)
        if at is not None:
            name = ".".join(x for x in at if x)
            raise CouplingError(
                f"{name}: its connections are a loop without an FMU; remove one of them"
            )


def _end(node: Node, element: str, name: str) -> tuple[str, str]:
    """Return the path of the owner of a connector, and its name: names may have dots."""
    return (node.elements[element] if element else node).path, name


def check_names(outputs: Iterable[str], recorded: Iterable[str]) -> None:
    """Check that the columns of a result have different names.

    Raises
    ------
    CouplingError
        If an output of the outermost system has the name of another column.
    """
    taken = {"time", *(column(x) for x in recorded)}
    for name in outputs:
        if name in taken:
            raise CouplingError(
                f"the output {name} of the system has the name of another column of the result; "
                "rename its connector"
            )
