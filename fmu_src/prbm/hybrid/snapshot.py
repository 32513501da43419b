"""Conversion of a state to plain values, which JSON stores exactly, and back."""

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np

from ..mechanics.arrays import Real
from ..mechanics.contact_state import ContactMode, ContactState, Phase, Touching
from ..mechanics.inputs import Inputs, Wall
from .arc import Arc, Node
from .configuration import Configuration
from .events import Event, EventKind
from .front import Front, Latched, Touch
from .peaks import Peak, PeakRecord, Sample
from .stability import FastestMode
from .walls import Course

Plain = dict[str, Any]


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
        tuple(Wall(**wall) for wall in plain["walls"]),
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
        "latched": [asdict(latched) for latched in front.latched],
        "touches": [asdict(touch) if touch else None for touch in front.touches],
    }


def front_of(plain: Mapping[str, Any], configuration: Configuration) -> Front:
    """Return a front from plain values, the inverse of :func:`plain_front`."""
    modes = tuple(ContactMode(mode) for mode in plain["modes"])
    touching = tuple(
        Touching(Phase(one["phase"]), one["reference_speed"], one["depth"]) if one else None
        for one in plain["touching"]
    )
    contacts = ContactState(modes, len(configuration.mechanism.stops), touching)
    return Front(
        plain["time"],
        np.array(plain["y"]),
        configuration.equations(inputs_of(plain["inputs"]), contacts),
        tuple(Latched(**latched) for latched in plain["latched"]),
        tuple(touch_of(touch) for touch in plain["touches"]),
    )


def touch_of(plain: Mapping[str, Any] | None) -> Touch | None:
    """Return the begin of a contact from plain values."""
    if plain is None:
        return None
    arrays = {name: tuple(plain[name]) for name in ("q", "v", "momentum")}
    return Touch(**{**plain, **arrays})


def course_of(plain: Mapping[str, Any]) -> Course:
    """Return the past communication steps, on which the walls depend, from plain values."""
    return Course(plain["point"], plain["longest"], tuple(plain["driven"]))


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
        Node(before["time"], np.array(before["y"]), np.array(before["rates"])) if before else None
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
    return {"direction": mode.direction.tolist(), "rate": mode.rate}


def fastest_of(plain: Mapping[str, Any]) -> FastestMode:
    """Return the fastest mode from plain values, the inverse of :func:`plain_fastest`."""
    return FastestMode(np.array(plain["direction"]), plain["rate"])


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
    return tuple(Sample(**sample) for sample in plain)
