"""Conversion of a state to plain values, which JSON stores exactly, and back."""

import math
import re
import reprlib
from collections.abc import Iterable, Mapping
from dataclasses import asdict
from typing import Any, TypeVar

import numpy as np

from ..base.errors import ParameterError
from ..base.tolerances import EVENTS_MAX, IMPACT_COUNT_MAX, TOLERANCE_MIN, TOLERANCE_USED_MAX
from ..mechanics.arrays import Real
from ..mechanics.contact_state import ContactMode, ContactPhase, ContactState, Phase, SpringPhase
from ..mechanics.inputs import Inputs, Wall
from .arc import Arc, Node
from .configuration import Configuration
from .events import Event, EventKind, EventWindow
from .front import ContactStart, Front, Latched
from .peaks import Peak, PeakRecord, Sample
from .runge_kutta import TSITOURAS_PAPAKOSTAS
from .stability import FastestMode
from .stepping import StepSizeController
from .walls import StepHistory

T = TypeVar("T")
Plain = dict[str, Any]
# Parts and numbers that may be None, and lists of samples, whose number varies.
OPTIONAL_PARTS = re.compile(r"arc|arc\.before|pending|k1|front\.(touching|touches)\[\d+\]")
OPTIONAL_NUMBERS = re.compile(r"step|.*\.calm_since")
SAMPLES = re.compile(r"peaks\.(ahead|peaks\[\d+\]\.last)")


def plain_inputs(inputs: Inputs) -> Plain:
    """Return inputs as plain values."""
    return {
        "forces": [[f.real, f.imag] for f in inputs.forces],
        "moments": list(inputs.moments),
        "base": [inputs.base.real, inputs.base.imag],
        "walls": [asdict(wall) for wall in inputs.walls],
        "mobilities": list(inputs.mobilities),
    }


def inputs_of(plain: Mapping[str, Any]) -> Inputs:
    """Return inputs from plain values, the inverse of :func:`plain_inputs`."""
    return Inputs(
        tuple(complex(*f) for f in plain["forces"]),
        tuple(plain["moments"]),
        complex(*plain["base"]),
        tuple(_made(Wall, wall) for wall in plain["walls"]),
        tuple(plain["mobilities"]),
    )


def plain_front(front: Front) -> Plain:
    """Return a front as plain values."""
    return {
        "time": front.time,
        "y": front.y.tolist(),
        "inputs": plain_inputs(front.inputs),
        "modes": [int(mode) for mode in front.contacts.modes],
        "touching": [asdict(one) if one else None for one in front.contacts.touching],
        "sides": list(front.contacts.sides),
        "springs": [int(phase) for phase in front.contacts.springs],
        "latched": [asdict(latched) for latched in front.latched],
        "touches": [asdict(touch) if touch else None for touch in front.touches],
    }


def front_of(plain: Mapping[str, Any], configuration: Configuration) -> Front:
    """Return a front from plain values, the inverse of :func:`plain_front`."""
    modes = tuple(ContactMode(mode) for mode in plain["modes"])
    touching = tuple(
        _made(ContactPhase, {**one, "phase": Phase(one["phase"])}) if one is not None else None
        for one in plain["touching"]
    )
    stops, sides = len(configuration.mechanism.stops), tuple(plain["sides"])
    springs = tuple(SpringPhase(phase) for phase in plain["springs"])
    contacts = ContactState(modes, stops, touching, sides, springs)
    return Front(
        plain["time"],
        np.array(plain["y"]),
        configuration.equations(inputs_of(plain["inputs"]), contacts),
        tuple(_made(Latched, latched) for latched in plain["latched"]),
        tuple(start_of(touch) for touch in plain["touches"]),
    )


def start_of(plain: Mapping[str, Any] | None) -> ContactStart | None:
    """Return the begin of a contact from plain values."""
    if plain is None:
        return None
    arrays = {name: tuple(plain[name]) for name in ("q", "v", "momentum")}
    return _made(ContactStart, {**plain, **arrays})


def history_of(plain: Mapping[str, Any]) -> StepHistory:
    """Return the past communication steps, on which the walls depend, from plain values."""
    return StepHistory(plain["point"], plain["longest"], tuple(plain["driven"]))


def plain_arc(arc: Arc | None) -> Plain | None:
    """Return an arc as plain values."""
    if arc is None:
        return None
    return {
        "start": arc.start, "h": arc.h, "end": arc.end, "y": arc.y.tolist(), "k": arc.k.tolist(),
        "n": arc.n, "before": plain_node(arc.before),
    }  # fmt: skip


def arc_of(plain: Mapping[str, Any] | None) -> Arc | None:
    """Return an arc from plain values, the inverse of :func:`plain_arc`."""
    if plain is None:
        return None
    start, h, end = plain["start"], plain["h"], plain["end"]
    before = plain["before"]
    node = (
        Node(before["time"], np.array(before["y"]), np.array(before["rates"]))
        if before is not None
        else None
    )
    return Arc(start, h, end, np.array(plain["y"]), np.array(plain["k"]), plain["n"], node)


def plain_node(node: Node | None) -> Plain | None:
    """Return a node of an interpolation as plain values."""
    if node is None:
        return None
    return {"time": node.time, "y": node.y.tolist(), "rates": node.rates.tolist()}


def plain_event(event: Event | None) -> list[float] | None:
    """Return an event as plain values."""
    return None if event is None else [int(event.kind), event.contact, event.time]


def event_of(plain: Any) -> Event | None:
    """Return an event from plain values, the inverse of :func:`plain_event`."""
    return None if plain is None else Event(EventKind(plain[0]), plain[1], plain[2])


def plain_fastest(mode: FastestMode) -> Plain:
    """Return the fastest mode as plain values."""
    return {"direction": mode.direction.tolist(), "rate": mode.rate, "decay": mode.decay}


def fastest_of(plain: Mapping[str, Any]) -> FastestMode:
    """Return the fastest mode from plain values, the inverse of :func:`plain_fastest`."""
    return FastestMode(np.array(plain["direction"]), plain["rate"], plain["decay"])


def plain_array(x: Real | None) -> list[float] | None:
    """Return an array as a list."""
    return None if x is None else list(x.tolist())


def array_of(plain: Any) -> Real | None:
    """Return an array from a list, the inverse of :func:`plain_array`."""
    return None if plain is None else np.array(plain)


def peaks_of(plain: Mapping[str, Any]) -> PeakRecord:
    """Return the peaks of the stress from plain values."""
    peaks = (
        Peak(p["stress"], p["time"], p["position"], _samples_of(p["last"])) for p in plain["peaks"]
    )
    return PeakRecord(tuple(peaks), _samples_of(plain["ahead"]))


def _samples_of(plain: Any) -> tuple[Sample, ...]:
    """Return samples of the stress from plain values."""
    return tuple(_made(Sample, sample) for sample in plain)


def _made(kind: type[T], plain: Mapping[str, Any]) -> T:
    """Return an object with fields of plain values.

    Raises
    ------
    ValueError
        If a text stands for a number.  Missing fields raise TypeError.
    """
    texts = [name for name, x in plain.items() if isinstance(x, str)]
    if texts:
        raise ValueError(f"{texts[0]} = {plain[texts[0]]!r} must be a number")
    return kind(**plain)


# --- checks ---------------------------------------------------------------------------------------


def check_owner(saved: Any, engine: str, names: Iterable[str]) -> None:
    """Reject a saved state of the other engine or of another mechanism.

    Parameters
    ----------
    saved : object
        The saved state; states without a name of the engine are those of the Python engine.
    engine : str
        Name of the engine that restores the state.
    names : iterable of str
        Names of the parameters of the mechanism.

    Raises
    ------
    ParameterError
        If the state is not a mapping, or belongs to another engine or mechanism.
    """
    if not isinstance(saved, Mapping):
        raise ParameterError(f"the saved state is damaged: it is a {type(saved).__name__}")
    if saved.get("engine", "python") != engine:
        other = "kernel" if engine == "python" else "Python engine"
        raise ParameterError(f"the saved state belongs to the {other}: restore it there")
    known = saved.get("values")
    if isinstance(known, Mapping) and known.keys() != {*names}:
        raise ParameterError("the saved state belongs to another mechanism")


def check_form(name: str, saved: Any, own: Any) -> None:
    """Reject plain values of another form than those of the present state.

    Parameters
    ----------
    name : str
        Name of the values in the saved state, for messages; empty for the complete state.
    saved, own : object
        The saved and the present values.

    Raises
    ------
    ValueError
        If keys, numbers of elements or types differ, or a number is not finite.
    """
    if OPTIONAL_NUMBERS.fullmatch(name) and (saved is None or own is None):
        own = None if saved is None else 0.0
    if OPTIONAL_PARTS.fullmatch(name) and (saved is None or own is None):
        own = saved  # Only its numbers are checked here.
    if isinstance(own, Mapping):
        if not isinstance(saved, Mapping) or saved.keys() != own.keys():
            raise ValueError(f"{name or 'it'} must have the keys {', '.join(own)}")
        for key, x in own.items():
            check_form(f"{name}.{key}" if name else key, saved[key], x)
    elif isinstance(own, list | tuple):
        samples = SAMPLES.fullmatch(name) is not None
        if not isinstance(saved, list | tuple) or (len(saved) != len(own) and not samples):
            raise ValueError(f"{name} must have {len(own)} elements")
        for k, x in enumerate(saved if samples else own):
            check_form(f"{name}[{k}]", saved[k], x)
    else:
        _check_scalar(name, saved, own)


def _check_scalar(name: str, saved: Any, own: Any) -> None:
    """Reject a scalar of another type than the present one; integers may stand for real numbers."""
    kind = next(one for one in (bool, int, float, object) if isinstance(own, one))
    if kind in (int, float):
        same = isinstance(saved, int | kind) and not isinstance(saved, bool)
        same = same and math.isfinite(saved)
    else:
        same = isinstance(saved, type(own)) and (name == "engine" or not isinstance(saved, str))
    if not same:
        raise ValueError(f"{name} = {reprlib.repr(saved)} must be a finite {kind.__name__}")


def restored(saved: Mapping[str, Any], configuration: Configuration) -> dict[str, Any]:
    """Return the attributes of a simulation in a saved state whose form has been checked.

    Parameters
    ----------
    saved : mapping
        The saved state.
    configuration : Configuration
        A configuration of the same mechanism.

    Raises
    ------
    ValueError
        If a number is out of its range, an array has another shape, or parts do not agree with
        each other.  The kernel makes the same checks.
    """
    for values in (saved["values"], saved["acting"]):
        configuration.mechanism.values(values)
    acting = configuration.restored(
        saved["acting"], saved["frequency"], saved["tolerance"], saved["step"]
    )
    found = {
        "configuration": acting,
        "prepared": acting.with_values(dict(saved["values"])),
        "given": dict(saved["given"]),
        "received": np.array(saved["received"]),
        "changed": saved["changed"],
        "time": saved["time"],
        "front": front_of(saved["front"], acting),
        "history": history_of(saved["history"]),
        "window": _made(EventWindow, saved["window"]),
        "controller": _made(StepSizeController, saved["controller"]),
        "fastest": fastest_of(saved["fastest"]),
        "arc": arc_of(saved["arc"]),
        "pending": event_of(saved["pending"]),
        "k1": array_of(saved["k1"]),
        "peaks": peaks_of(saved["peaks"]),
    }
    for name, holds in _conditions(found).items():
        if not holds:
            raise ValueError(f"{name}: its numbers are not a state of this mechanism")
    return found


def _conditions(found: Mapping[str, Any]) -> dict[str, bool]:
    """Return whether the parts of a restored state agree with each other, by part."""
    configuration, front, fastest = found["configuration"], found["front"], found["fastest"]
    arc, event = found["arc"], found["pending"]
    n, mechanism = configuration.system.n, configuration.mechanism
    stops, modes, sides = len(mechanism.stops), front.contacts.modes, front.contacts.sides
    points, phases = len(mechanism.frictions), front.contacts.springs
    allowed = {
        EventKind.SLIP: range(len(modes)),
        EventKind.REVERSAL: range(len(modes)),
        EventKind.SIDE: range(stops + points, len(modes)),
        EventKind.ACTION: range(len(modes), len(modes) + len(phases)),
    }
    begun = zip(mechanism.stops, front.contacts.touching, front.touches, strict=True)
    return {
        "shapes": _shaped(len(front.y), n, arc, found["k1"], fastest),
        "touching": all(stop.compliant or (one, two) == (None, None) for stop, one, two in begun),
        "modes": ContactMode.OPEN not in modes[stops:],
        "sides": all(x in (-1, 1) for x in sides) and -1 not in sides[:points],
        "latched": all(0 <= x.impact_count <= IMPACT_COUNT_MAX for x in front.latched),
        "window": 0 <= found["window"].count <= EVENTS_MAX,
        "pending": event is None or event.contact in allowed.get(event.kind, range(stops)),
        "springs": all(
            spring.side or phase is SpringPhase.ACTING
            for spring, phase in zip(mechanism.springs, phases, strict=False)
        ),
        "controller": found["controller"].h >= 0.0,
        "tolerance": TOLERANCE_MIN <= configuration.tolerance <= TOLERANCE_USED_MAX,
        "frequency": configuration.frequency >= 0.0,
        "step": configuration.step is None or configuration.step > 0.0,
        "fastest": fastest.rate >= 0.0 and fastest.decay >= 0.0,
        "arc": arc is None or (arc.h > 0.0 and arc.n == n and _before(arc) <= arc.start),
        "time": front.time >= found["time"],
    }


def _event_range(event: Event | None, contacts: ContactState) -> tuple[int, int]:
    """Return the first number of what may have an event of its kind, and the one after the last."""
    modes, kind = len(contacts.modes), event.kind if event else None
    if kind is EventKind.ACTION:
        return modes, modes + len(contacts.springs)
    return 0, modes if kind in (EventKind.SLIP, EventKind.REVERSAL) else contacts.stops


def _shaped(size: int, n: int, arc: Arc | None, k1: Real | None, fastest: FastestMode) -> bool:
    """Return whether the arrays of a state of n coordinates have their shapes."""
    shapes: list[tuple[Real, tuple[int, ...]]] = [(fastest.direction, (n,))]
    if k1 is not None:
        shapes.append((k1, (size,)))
    if arc is not None:
        shapes += [(arc.y, (size,)), (arc.k, (len(TSITOURAS_PAPAKOSTAS.weights), size))]
        before = arc.before
        shapes += [(before.y, (size,)), (before.rates, (size,))] if before is not None else []
    return all(x.shape == shape for x, shape in shapes)


def _before(arc: Arc) -> float:
    """Return the time of the node before an arc; the start of the arc without one [s]."""
    return arc.start if arc.before is None else arc.before.time
