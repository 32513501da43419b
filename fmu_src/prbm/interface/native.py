"""The variables of native FMUs: those of all FMUs, and those that model exchange adds."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from ..hybrid.configuration import Magnitudes
from ..mechanics.assembly import assemble
from ..mechanism.description import Mechanism
from .scales import Scales, nearest_power_of_ten, scales
from .variables import (
    CLOCK,
    INDICATORS,
    STORED,
    TIME,
    Number,
    Variable,
    check_names,
    compliant_states,
)

DERIVATIVES = {
    "energy.dissipated": "Power lost to damping and friction, without impacts",
    "energy.work": "Power of the inputs and of the moving walls, without impacts",
}
INDICATOR_DESCRIPTIONS = {
    "impact": "Event indicator of an impact at {name}",
    "release": "Event indicator of the release from rest on {name}",
    "slip": "Event indicator of the beginning and the end of sliding at {name}",
    "side": "Event indicator of the change of the side to which {name} pushes",
    "action": "Event indicator of {name}, which begins or ceases to act",
}


@dataclass(frozen=True)
class NativeInterface:
    """The variables of a native FMU, and the names of those that model exchange uses.

    Parameters
    ----------
    variables : tuple of Variable
        All variables, in the order of the interface.
    states, derivatives, indicators : tuple of str
        Names of the continuous states, their derivatives and the event indicators, in order.
    clocks : tuple of str
        Names of the output clocks.
    independent : tuple of int
        Indices of the independent coordinates, whose values and rates are states.
    """

    variables: tuple[Variable, ...]
    states: tuple[str, ...]
    derivatives: tuple[str, ...]
    indicators: tuple[str, ...]
    clocks: tuple[str, ...]
    independent: tuple[int, ...]


def native_interface(
    mechanism: Mechanism,
    plain: Sequence[Variable],
    sample: Mapping[str, Number],
    magnitudes: Magnitudes,
    independent: Sequence[int],
    *,
    time: bool = False,
    clock: bool = False,
) -> NativeInterface:
    """Return the interface of a native FMU.

    Parameters
    ----------
    mechanism : Mechanism
        The mechanism to export.
    plain : sequence of Variable
        The variables that all FMUs of the mechanism have.
    sample : mapping
        All outputs at the start.
    magnitudes : Magnitudes
        Magnitudes of the motion.  The nominal values of states are the nearest powers of ten, as
        in the C kernel.
    independent : sequence of int
        Indices of the independent coordinates, whose values and rates are states.
    time : bool
        Whether time is a variable, as FMI 3.0 requires.
    clock : bool
        Whether each stop has an output clock that ticks at its impacts (FMI 3.0).

    Raises
    ------
    MechanismError
        If two variables share a name or a value reference, or a name is not ASCII.
    """
    nominal = scales(mechanism, sample)
    system = assemble(mechanism, mechanism.values())
    names, units = system.variables, system.units
    angles, rates = (tuple(names[j][order] for j in independent) for order in (0, 1))
    contacts = compliant_states(mechanism)
    states = (*angles, *rates, *STORED, *contacts)
    sizes = {
        name: magnitudes.strain if name.endswith(".strain") else magnitudes.angle * units[j]
        for name, j in zip(angles, independent, strict=True)
    }
    sizes |= {name: magnitudes.rate * units[j] for name, j in zip(rates, independent, strict=True)}
    sizes |= dict.fromkeys(STORED, magnitudes.energy)
    for name in contacts:
        impulse = name.endswith(".impulse_sum")
        sizes[name] = magnitudes.impulse if impulse else magnitudes.energy
    nominals = {name: nearest_power_of_ten(size) for name, size in sizes.items()}
    accelerations = state_derivatives(mechanism, names, independent)
    indicators = tuple(_indicators(mechanism))
    clocks = tuple(f"{stop.name}.impact" for stop in mechanism.stops) if clock else ()
    listed = (
        *([TIME] if time else []),
        *(
            replace(v, reinit=True, nominal=nominals[v.name]) if v.name in nominals else v
            for v in plain
        ),
        *(_derivative(name, nominal) for name in accelerations),
        *indicators,
        *map(_clock, clocks),
    )
    check_names(listed)
    return NativeInterface(
        listed,
        states,
        (*rates, *accelerations),
        tuple(v.name for v in indicators),
        clocks,
        tuple(independent),
    )


def state_derivatives(
    mechanism: Mechanism, coordinates: Sequence[tuple[str, str]], independent: Sequence[int]
) -> tuple[str, ...]:
    """Return the names of the state derivatives that only model exchange has as variables."""
    return (
        *(f"der({coordinates[j][1]})" for j in independent),
        *(f"der({name})" for name in (*STORED, *compliant_states(mechanism))),
    )


def counter_of(clock: str) -> str:
    """Return the name of the variable that counts the impacts for which a clock ticks.

    Examples
    --------
    >>> counter_of("stop.impact")
    'stop.impact_count'
    """
    return f"{clock}_count"


def _derivative(name: str, nominal: Scales) -> Variable:
    state = name.removeprefix("der(").removesuffix(")")
    owner, _, rate = state.rpartition(".")
    unit, description = {
        "omega": ("rad/s2", f"Angular acceleration of {owner}"),
        "strain_rate": ("1/s2", f"Rate of the strain rate of {owner}"),
        "vx": ("m/s2", f"Acceleration of {owner} along x"),
        "vy": ("m/s2", f"Acceleration of {owner} along y"),
        "impulse_sum": ("N", f"Force of the wall at {owner}"),
        "contact_loss": ("W", f"Power lost in the contact at {owner}"),
    }.get(rate, ("W", DERIVATIVES.get(state, "")))
    return Variable(
        name, description, "local", "continuous", "calculated", unit,
        nominal=nominal(unit), derivative_of=state,
    )  # fmt: skip


def _indicators(mechanism: Mechanism) -> Iterator[Variable]:
    kinds = [(stop.name, kind) for stop in mechanism.stops for kind in INDICATORS]
    kinds += [(part.name, "slip") for part in mechanism.rubbing]
    kinds += [(guide.name, "side") for guide in mechanism.guides if guide.friction is not None]
    kinds += [(spring.name, "action") for spring in mechanism.springs if spring.side]
    for name, kind in kinds:
        yield Variable(
            f"{name}.{kind}_indicator",
            INDICATOR_DESCRIPTIONS[kind].format(name=name),
            "local", "continuous", "calculated", "1",
        )  # fmt: skip


def _clock(name: str) -> Variable:
    stop = name.removesuffix(".impact")
    return Variable(name, f"Ticks at each impact at {stop}", "output", "discrete", "", type=CLOCK)
