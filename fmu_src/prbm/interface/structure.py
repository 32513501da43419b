"""What each variable of a native FMU depends on at an instant of model exchange.

All that moves follows from the independent angles, strains and their rates, the inputs and the
discrete state; nothing depends on time itself.  A dependency is listed where the equations have
one for some mechanism of this kind or in some discrete state, even if it vanishes in another.
"""

from collections.abc import Mapping

from ..mechanics.inputs import MOBILITY, impulse_names, input_names
from ..mechanism.description import Mechanism
from .native import NativeInterface
from .variables import BASE_OUTPUTS, INDICATORS, LATCHED, STORED

Dependencies = Mapping[str, tuple[str, ...]]


def dependencies(mechanism: Mechanism, interface: NativeInterface) -> Dependencies:
    """Return the states and inputs that each output, derivative and indicator depends on.

    Returns
    -------
    mapping of str to tuple of str
        Names in the order of the interface.
    """
    count = len(interface.independent)
    shape, rates = interface.states[:count], interface.states[count : 2 * count]
    moving = shape + rates
    # impulses and mobilities act at events alone
    acting = tuple(name for name in input_names(mechanism) if not _at_events(mechanism, name))
    everything = moving + acting
    found: dict[str, tuple[str, ...]] = {name: everything for name in BASE_OUTPUTS}
    for body in (b.name for b in mechanism.bodies):
        found |= {f"{body}.{what}": shape for what in ("x", "y", "angle")}
        found |= {f"{body}.{what}": moving for what in ("vx", "vy", "omega")}
    for probe in (p.name for p in mechanism.probes):
        found |= {f"{probe}.{what}": shape for what in ("x", "y")}
        found |= {f"{probe}.{what}": moving for what in ("vx", "vy")}
    for stop in (s.name for s in mechanism.stops):
        walls = (f"{stop}.displacement", f"{stop}.velocity")
        found |= {f"{stop}.{what}": () for what in LATCHED}
        found |= {f"{stop}.{what}_indicator": everything for what in INDICATORS}
        found[f"{stop}.gap"] = shape + walls[:1]
        found[f"{stop}.gap_rate"] = moving + walls[1:]
        found[f"{stop}.force"] = everything
        found |= {f"{stop}.point.{what}": shape for what in ("displacement", "mobility")}
        found[f"{stop}.point.velocity"] = moving
        found[f"{stop}.impact"] = moving + walls
    found |= {name: everything for name in interface.indicators}
    found |= {"energy.kinetic": moving, "energy.elastic": shape, "energy.gravitational": shape}
    found |= {name: everything for name in interface.derivatives}
    found |= {name: (name,) for name in (*moving, *STORED)}  # a state is what it is
    order = {v.name: i for i, v in enumerate(interface.variables)}
    return {name: tuple(sorted(known, key=order.__getitem__)) for name, known in found.items()}


def _at_events(mechanism: Mechanism, name: str) -> bool:
    return name in impulse_names(mechanism) or name.endswith(f".{MOBILITY}")
