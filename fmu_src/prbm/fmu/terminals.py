"""The terminals of native FMUs: groups of variables for connections (``terminalsAndIcons.xml``).

There is one terminal per stop, one per force, and one of the base.  Their members are signals.
Terminals inside them are physical ports, whose forces are flows: their sum is zero in a connection,
positive into the FMU (``inflow``) or out of it (``outflow``).

The file belongs to FMI 3.0.  FMI 2.0.4 has adopted it, but tools such as FMI Library report it as
an error there.
"""

from collections.abc import Iterable, Mapping
from xml.etree.ElementTree import Element, SubElement

from ..interface.variables import Variable, pushed
from ..mechanism.description import Mechanism
from ..mechanism.parts import GROUND, Force, Stop, body_of
from .description import number, serialized

STOP_MEMBERS = (
    "displacement", "velocity", "mobility", "gap", "gap_rate", "force", "contact", "impulse_sum",
    "point.displacement", "point.velocity", "point.mobility",
)  # fmt: skip
FORCE_MEMBERS = ("x", "y", "moment", "impulse.x", "impulse.y", "impulse.moment")
MOTION_MEMBERS = ("x", "y", "angle", "vx", "vy", "omega")
BASE_MEMBERS = ("acceleration.x", "acceleration.y", "force.x", "force.y", "moment")
# Kinds of terminals: the standard asks for the name of the vendor after an underscore.
STOP_KIND, FORCE_KIND, BASE_KIND = "_prbm_Stop", "_prbm_Force", "_prbm_Base"
IMPACT_KIND = "_prbm_ImpactPort"
TRANSLATION = "Modelica.Mechanics.Translational.Interfaces.Flange_a"  # Members s [m] and f [N].
ROTATION = "Modelica.Mechanics.Rotational.Interfaces.Flange_a"  # Members phi [rad], tau [N.m].
SIGNAL, INFLOW, OUTFLOW = "signal", "inflow", "outflow"
CONNECTED = ("input", "output")  # Causalities of members.


def terminals(mechanism: Mechanism, variables: Iterable[Variable]) -> bytes:
    """Return terminalsAndIcons.xml.

    Parameters
    ----------
    mechanism : Mechanism
        The mechanism.
    variables : iterable of Variable
        The variables of its FMU.  A member that is no input or output is left out; a physical port
        without one of its members is left out.
    """
    known = {v.name for v in variables if v.causality in CONNECTED}
    root = Element("fmiTerminalsAndIcons", {"fmiVersion": "3.0"})
    corners = {"x1": "-100", "y1": "-100", "x2": "100", "y2": "100"}
    scale = {"suggestedScalingFactorTo_mm": number(0.1)}
    picture = SubElement(root, "GraphicalRepresentation")
    SubElement(picture, "CoordinateSystem", corners | scale)
    SubElement(picture, "Icon", corners)
    ports = SubElement(root, "Terminals")
    for stop in mechanism.stops:
        _stop(ports, stop, known)
    for force in mechanism.forces:
        _force(ports, mechanism, force, known)
    members = {member: f"base.{member}" for member in BASE_MEMBERS}
    text = "Acceleration of the base, force and moment on it"
    _group(ports, "base", BASE_KIND, text, members, known)
    return serialized(root)


def _stop(ports: Element, stop: Stop, known: set[str]) -> None:
    """Add the terminal of a stop, with a port of its wall.

    The force of a rigid stop does not contain impacts, so that the port has the impulses, too.  A
    compliant stop, which has a peak force, also has a flange; its force contains impacts.
    """
    members = {member: f"{stop.name}.{member}" for member in STOP_MEMBERS}
    wall = "a wall that moves" if stop.on == GROUND else f"a wall on the {stop.on}"
    text = f"Contact of the {stop.body} with {wall}"
    group = _group(ports, stop.name, STOP_KIND, text, members, known)
    if stop.on != GROUND:  # The wall moves relative to a body of the FMU, which takes the force.
        return
    motion = {name: (f"{stop.name}.{name}", SIGNAL) for name in ("displacement", "velocity")}
    motion["mobility"] = (f"{stop.name}.mobility", SIGNAL)
    force = (f"{stop.name}.force", OUTFLOW)
    port = motion | {"force": force, "impulse_sum": (f"{stop.name}.impulse_sum", OUTFLOW)}
    text = "Wall, driven by a partner that takes the forces and impulses on the wall"
    _port(group, "wall", IMPACT_KIND, text, port, known)
    if f"{stop.name}.peak_force" in known:
        flange = {"s": motion["displacement"], "f": force}
        _port(
            group, "flange", TRANSLATION, "Wall as a flange, driven by its position", flange, known
        )


def _force(ports: Element, mechanism: Mechanism, force: Force, known: set[str]) -> None:
    """Add the terminal of a force, with flanges along x and y, and a rotational flange."""
    members = {f"force.{member}": f"{force.name}.{member}" for member in FORCE_MEMBERS}
    members |= {member: f"{force.body}.{member}" for member in MOTION_MEMBERS}
    text = f"Force on {pushed(force)}, and the motion of the {force.body}"
    group = _group(ports, force.name, FORCE_KIND, text, members, known)
    point = displaced(mechanism, force)
    for axis in "xy" if point else "":
        flange = {"s": (f"{point}.{axis}", SIGNAL), "f": (f"{force.name}.{axis}", INFLOW)}
        text = f"Displacement of {pushed(force)} along {axis}, and the force on it"
        _port(group, f"flange_{axis}", TRANSLATION, text, flange, known)
    turned = {"phi": (f"{force.body}.angle", SIGNAL), "tau": (f"{force.name}.moment", INFLOW)}
    text = f"Rotation of the {force.body}, and the moment on it"
    _port(group, "flange_moment", ROTATION, text, turned, known)


def displaced(mechanism: Mechanism, force: Force) -> str | None:
    """Return the prefix of the displacements of the point of a force, None if it has none.

    It is that of the body if the force acts on the centre of mass, otherwise that of a probe at the
    same point.
    """
    if force.point is None:
        return force.body
    for probe in mechanism.probes:
        at = mechanism.point(probe.point, probe.name)
        if body_of(probe.point) == force.body and tuple(at) == tuple(force.point):
            return probe.name
    return None


def _group(
    ports: Element, name: str, kind: str, text: str, members: Mapping[str, str], known: set[str]
) -> Element:
    """Add a terminal of signals, of which a connection may use some, and return it."""
    terminal = _terminal(ports, name, "bus", kind, text)
    for member, variable in members.items():
        if variable in known:
            _member(terminal, member, variable, SIGNAL)
    return terminal


def _port(
    group: Element,
    name: str,
    kind: str,
    text: str,
    members: Mapping[str, tuple[str, str]],
    known: set[str],
) -> None:
    """Add a physical port, whose members all belong to a connection: variables and their kinds."""
    if all(variable in known for variable, _ in members.values()):
        terminal = _terminal(group, name, "plug", kind, text)
        for member, (variable, role) in members.items():
            _member(terminal, member, variable, role)


def _terminal(parent: Element, name: str, rule: str, kind: str, text: str) -> Element:
    attributes = {"name": name, "matchingRule": rule, "terminalKind": kind, "description": text}
    return SubElement(parent, "Terminal", attributes)


def _member(terminal: Element, member: str, variable: str, kind: str) -> None:
    names = {"variableName": variable, "memberName": member}
    SubElement(terminal, "TerminalMemberVariable", names | {"variableKind": kind})
