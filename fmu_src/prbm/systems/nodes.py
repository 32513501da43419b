"""Components, systems and connections of a system structure package, and its meaning."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Any

from .components import CouplingError, Value, attribute
from .signals import INTEGER, REAL, Linear, Signal, Table, Unit

SLASH = "/"
"""Between the names of nested systems in the name of an instance."""


def kind_of(variable: Any) -> str:
    """Return the type of SSP of a variable of an FMU."""
    kind = str(variable.type)
    if kind.startswith(("Int", "UInt")):
        return INTEGER
    return REAL if kind.startswith("Float") else kind


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
        return self.units.get(name, Unit(name)) if name else None


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
        return {unit and (unit.base or unit.name, unit.factor, unit.offset): unit}
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
        place(node, *wire.sink): place(node, *wire.source)
        for node in systems(top)
        for wire in node.wires
        if not (wire.sink[0] and node.elements[wire.sink[0]].fmu)
    }
    for name in sources:
        at, seen = name, {name}
        while (at := sources.get(at, "")) not in ("", *seen):
            seen.add(at)
        if at:
            raise CouplingError(
                f"{at}: its connections are a loop without an FMU; remove one of them"
            )
