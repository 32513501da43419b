"""The dependencies between the variables of a native FMU in model exchange.

All motion follows from the independent angles, strains and their rates, the inputs and the discrete
state; no variable depends explicitly on time.  A dependency is listed if it exists for some
mechanism or in some discrete state, even if it vanishes for others.
"""

from collections.abc import Mapping

from ..base.errors import MechanismError
from ..mechanics.inputs import MOBILITY, impulse_names, input_names
from ..mechanics.stress import stressed
from ..mechanism.description import Mechanism
from .native import NativeInterface
from .variables import (
    BASE_OUTPUTS,
    COMPLIANT_OUTPUTS,
    INDICATORS,
    LATCHED,
    PEAK_OUTPUTS,
    STORED,
    STRESS_OUTPUTS,
    compliant_states,
    guide_outputs,
)

Dependencies = Mapping[str, tuple[str, ...]]


def dependencies(mechanism: Mechanism, interface: NativeInterface) -> Dependencies:
    """Return the states and inputs that each output, derivative and indicator depends on.

    Returns
    -------
    mapping of str to tuple of str
        Names of the knowns, in the order of the interface, by the name of the unknown.

    Raises
    ------
    MechanismError
        If the dependencies of an output are not defined here.
    """
    count = len(interface.independent)
    shape, rates = interface.states[:count], interface.states[count : 2 * count]
    moving = shape + rates
    # Impulses and mobilities act at events only.
    acting = tuple(name for name in input_names(mechanism) if not _at_events(mechanism, name))
    everything = moving + acting
    found: dict[str, tuple[str, ...]] = {name: everything for name in BASE_OUTPUTS}
    for body in (b.name for b in mechanism.bodies):
        found |= {f"{body}.{output}": shape for output in ("x", "y", "angle")}
        found |= {f"{body}.{output}": moving for output in ("vx", "vy", "omega")}
    for probe in (p.name for p in mechanism.probes):
        found |= {f"{probe}.{output}": shape for output in ("x", "y")}
        found |= {f"{probe}.{output}": moving for output in ("vx", "vy")}
    for stop in (s.name for s in mechanism.stops):
        walls = (f"{stop}.displacement", f"{stop}.velocity")
        found |= {f"{stop}.{output}": () for output in LATCHED}
        found |= {f"{stop}.{kind}_indicator": everything for kind in INDICATORS}
        found[f"{stop}.gap"] = shape + walls[:1]
        found[f"{stop}.gap_rate"] = moving + walls[1:]
        found[f"{stop}.force"] = everything
        found |= {f"{stop}.point.{output}": shape for output in ("displacement", "mobility")}
        found[f"{stop}.point.velocity"] = moving
        found[f"{stop}.impact"] = moving + walls
    for spring in (s.name for s in mechanism.springs):
        found |= {f"{spring}.force": moving, f"{spring}.length": shape}
        found[f"{spring}.length_rate"] = moving
    for guide in mechanism.guides:
        found |= {f"{guide.name}.{name}": everything for name in guide_outputs(guide)}
    for stop in (s.name for s in mechanism.stops if s.compliant):
        found |= {f"{stop}.{output}": () for output in COMPLIANT_OUTPUTS}
    for flexure in (mechanism.flexures[i].name for i in stressed(mechanism)):
        found |= {f"{flexure}.{output}": everything for output in STRESS_OUTPUTS}
        found |= {f"{flexure}.{output}": () for output in PEAK_OUTPUTS}
    found |= {name: everything for name in interface.indicators}
    found |= {"energy.kinetic": moving, "energy.elastic": shape, "energy.gravitational": shape}
    if any(stop.compliant for stop in mechanism.stops):
        found["energy.elastic"] = everything  # Walls press.
    found |= {name: everything for name in interface.derivatives}
    # A state depends on itself only.
    found |= {name: (name,) for name in (*moving, *STORED, *compliant_states(mechanism))}
    outputs = (v.name for v in interface.variables if v.causality == "output")
    missing = [name for name in outputs if name not in found]
    if missing:
        raise MechanismError(
            f"no dependencies for the outputs {', '.join(missing)}: add them to the function "
            "dependencies of prbm.interface.structure"
        )
    order = {v.name: i for i, v in enumerate(interface.variables)}
    return {name: tuple(sorted(known, key=order.__getitem__)) for name, known in found.items()}


def _at_events(mechanism: Mechanism, name: str) -> bool:
    """Return whether an input acts at events only."""
    return name in impulse_names(mechanism) or name.endswith(f".{MOBILITY}")
