"""Components, systems and connections of a system structure package, and its meaning."""

from dataclasses import dataclass, field
from typing import Any

from .components import Value, attribute
from .signals import INTEGER, REAL, Linear, Signal, Table, Unit


def kind_of(variable: Any) -> str:
    """Return the type of SSP of a variable of an FMU."""
    kind = str(variable.type)
    if kind.startswith(("Int", "UInt")):
        return INTEGER
    return REAL if kind.startswith("Float") else kind


@dataclass(frozen=True)
class Connector:
    """A connector: its kind, and its type and unit if they are given."""

    kind: str
    type: str | None
    unit: Unit | None


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
