"""The description of a mechanism that its live page reads, as plain values for JSON."""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from ...interface.tables import slots
from ...interface.units import UNITS
from ...interface.variables import Variable
from ...mechanics.assembly import assemble
from ...mechanics.places import Outline
from ...mechanics.system import System
from ...mechanism.description import Mechanism
from ...mechanism.expressions import Quantity, affine
from ...mechanism.flexure import BEAM, LEAF, PIN
from ...mechanism.parts import (
    Flexure,
    FlexureType,
    GroundPart,
    Guide,
    Joint,
    Part,
    Point,
    Spring,
    Stop,
    body_of,
    field_of,
)
from ...runs.experiment import Experiment

Json = Any

SPAN_FACTOR = 4.0  # Range of a slider of a positive quantity, as a factor of its start value.
SHOWN_MIN = 0.1  # A smaller largest value of a slider is shown in a smaller unit.
SIGNED_FACTOR = 2.0  # Half range of other sliders, in units of the start or nominal value.


def content(
    mechanism: Mechanism,
    variables: Sequence[Variable],
    independent: Sequence[int],
    experiment: Experiment,
) -> dict[str, Json]:
    """Return the description of a mechanism for its live page.

    An expression is a number, or a list of its constant and the factors of parameters by name.  A
    point is a list of two expressions.

    Parameters
    ----------
    mechanism : Mechanism
        The mechanism.
    variables : sequence of Variable
        The variables of its FMU, with the start values of the page.
    independent : sequence of int
        Indices of the independent coordinates, which determine the slots of the values.
    experiment : Experiment
        The default experiment.
    """
    system = assemble(mechanism, mechanism.values())
    slot = slots(mechanism, independent)
    release = mechanism.release
    centres = {body.name: body.centre for body in mechanism.bodies}
    released = centres[release.body] if release.point is None else release.point
    own = {parameter.name for parameter in mechanism.geometry}
    typical = {v.unit: v.nominal for v in variables if v.causality == "output" and v.nominal}
    return {
        "name": mechanism.name,
        "title": mechanism.title,
        "stopTime": experiment.stop_time,
        "step": experiment.step,
        "quantities": [
            _quantity(v, slot[v.name], typical) | {"own": v.name in own}
            for v in variables
            if v.causality in ("parameter", "input")
        ],
        "outputs": [
            {"name": v.name, "slot": slot[v.name]}
            for v in variables
            if v.causality == "output" and v.name in slot
        ],
        "bodies": [
            {
                "name": body.name,
                "centre": _point(body.centre),
                "points": [_point(point) for point in body.points.values()],
                "outline": [_point(corner) for corner in body.outline],
                "holes": [[_point(corner) for corner in hole] for hole in body.holes],
            }
            for body in mechanism.bodies
        ],
        "groundParts": [_rings(part) for part in mechanism.ground_parts],
        "flexures": _flexures(mechanism, system),
        "joints": [
            {"name": joint.name, "ends": _ends(mechanism, joint)} for joint in mechanism.joints
        ],
        "springs": [
            {"name": spring.name, "ends": _ends(mechanism, spring)} for spring in mechanism.springs
        ],
        "guides": [_guide(mechanism, guide) for guide in mechanism.guides],
        "stops": [_stop(stop, mechanism) for stop in mechanism.stops],
        "probes": [
            {
                "name": probe.name,
                "body": body_of(probe.point),
                "point": _point(mechanism.point(probe.point, probe.name)),
            }
            for probe in mechanism.probes
        ],
        "release": {
            "body": release.body,
            "point": _point(released),
            "direction": release.direction,
            "quantity": _given(release, release.start),
            "start": release.start,
        },
    }


# --- quantities -----------------------------------------------------------------------------------


def _unit(v: Variable) -> dict[str, Json]:
    """Return the unit that is shown, and the factor of shown over SI values."""
    unit = v.unit or "1"
    shown = v.display or v.quantity.display if v.type == "Real" else None
    factor = UNITS[unit].display[shown] if shown else 1.0
    return {"description": v.description, "unit": unit, "shown": shown or unit, "factor": factor}


def _quantity(v: Variable, slot: int, typical: Mapping[str, float]) -> dict[str, Json]:
    """Return a parameter or input; ``typical`` are the magnitudes of outputs by unit."""
    group, _, label = v.name.partition(".")
    assert v.start is not None
    slider = _slider(v, typical)
    return {
        "name": v.name,
        "slot": slot,
        "group": group,
        "label": label or v.name,
        "kind": "input" if v.causality == "input" else "parameter",
        "start": float(v.start),
        "minimum": v.minimum if math.isfinite(v.minimum) else None,
        "maximum": v.maximum if math.isfinite(v.maximum) else None,
        "slider": slider,
        **_fitting(_unit(v), max(abs(slider["low"]), abs(slider["high"]))),
    }


def _fitting(unit: dict[str, Json], largest: float) -> dict[str, Json]:
    """Return a unit, or a smaller one that suits a small largest value in SI.

    Examples
    --------
    >>> mm = {"unit": "m", "shown": "mm", "factor": 1e3}
    >>> _fitting(mm, 0.01)["shown"], _fitting(mm, 4e-6)["shown"]
    ('mm', 'um')
    """
    smaller = {k: x for k, x in UNITS[unit["unit"]].display.items() if x > unit["factor"]}
    if largest * unit["factor"] >= SHOWN_MIN or not smaller:
        return unit
    shown = min(smaller, key=lambda name: smaller[name])
    return unit | {"shown": shown, "factor": smaller[shown]}


def _slider(v: Variable, magnitudes: Mapping[str, float]) -> dict[str, Json]:
    """Return the range of a slider within the bounds, and whether it is logarithmic."""
    start = float(v.start or 0.0)
    usual = magnitudes.get(v.unit) or v.nominal or 1.0
    fraction = v.unit in ("", "1") and v.maximum == 1.0
    if v.minimum > 0.0 and start > 0.0 and not fraction:
        low, high, logarithmic = start / SPAN_FACTOR, start * SPAN_FACTOR, True
    elif v.minimum >= 0.0:
        high = SPAN_FACTOR * start or SIGNED_FACTOR * (v.nominal or 1.0)
        low, high, logarithmic = max(0.0, v.minimum), high, False
    else:
        high = SIGNED_FACTOR * max(abs(start), usual)
        low, high, logarithmic = -high, high, False
    return {"low": max(low, v.minimum), "high": min(high, v.maximum), "logarithmic": logarithmic}


# --- parts ----------------------------------------------------------------------------------------


def _expression(quantity: Quantity) -> Json:
    expression = affine(quantity)
    if not expression.terms:
        return float(expression.constant)
    return [float(expression.constant), dict(expression.terms)]


def _point(point: Point) -> Json:
    return [_expression(coordinate) for coordinate in point]


def _rings(part: GroundPart) -> Json:
    return [[_point(corner) for corner in ring] for ring in (part.outline, *part.holes)]


def _given(part: Part, name: str) -> str | None:
    """Return the parameter of a field; None if the field is an expression."""
    return None if isinstance(getattr(part, name), str) else f"{part.name}.{name}"


def _field(part: Part, name: str) -> Json:
    """Return the expression of a field of a part."""
    quantity = field_of(part, name)
    return _expression(quantity) if isinstance(quantity, str) else [0.0, {f"{part.name}.{name}": 1}]


def _moved_by(stop: Stop, mechanism: Mechanism) -> tuple[str, float]:
    """Return the quantity that moves a wall, and the displacement of the wall per unit of it.

    It is the position of the stop.  If that is an expression of one parameter, it is this parameter
    or, if the parameter moves other parts too, the input of the wall.
    """
    own = _given(stop, "position")
    if own is not None:
        return own, 1.0
    terms = affine(str(stop.position)).terms
    if len(terms) == 1:
        ((name, ratio),) = dict(terms).items()
        others = replace(mechanism, stops=tuple(s for s in mechanism.stops if s != stop))
        if ratio and not re.search(rf"(?<![\w.]){re.escape(name)}(?![\w.])", _expressions(others)):
            return name, float(ratio)
    return f"{stop.name}.displacement", 1.0


def _expressions(mechanism: Mechanism) -> str:
    """Return a text with the expressions of all parts."""
    parts = (
        "bodies",
        "flexure_types",
        "joints",
        "springs",
        "guides",
        "stops",
        "frictions",
        "forces",
        "ground",
        "ground_parts",
        "release",
    )
    return " ".join(repr(getattr(mechanism, part)) for part in parts)


def _stop(stop: Stop, mechanism: Mechanism) -> dict[str, Json]:
    quantity, ratio = _moved_by(stop, mechanism)
    return {
        "name": stop.name,
        "body": stop.body,
        "on": stop.on,
        "point": _point(stop.point),
        "direction": stop.direction,
        "offset": _field(stop, "offset"),
        "position": _field(stop, "position"),
        "displacement": f"{stop.name}.displacement",
        "quantity": quantity,
        "ratio": ratio,
    }


def _guide(mechanism: Mechanism, guide: Guide) -> dict[str, Json]:
    """Return the points of the line of a guide, and the guided point."""
    point = _place(mechanism, guide.point, guide.name)
    return {"name": guide.name, "ends": _ends(mechanism, guide), "point": point}


def _ends(mechanism: Mechanism, part: Flexure | Joint | Spring | Guide) -> list[dict[str, Json]]:
    return [_place(mechanism, end, part.name) for end in (part.start, part.end)]


def _place(mechanism: Mechanism, reference: str, user: str) -> dict[str, Json]:
    """Return the body and the coordinates of a point."""
    return {"body": body_of(reference), "point": _point(mechanism.point(reference, user))}


def _flexures(mechanism: Mechanism, system: System) -> list[dict[str, Json]]:
    """Return the flexures in the order of the assembly, their corners from the start on."""
    named = {flexure.name: flexure for flexure in mechanism.flexures}
    result = []
    for outline in system.outlines:
        if outline.kind != "flexure":
            continue
        flexure = named[outline.name]
        kind = mechanism.type_of(flexure)
        beam, ends = kind.model == BEAM, _ends(mechanism, flexure)
        guided = [end != PIN for end in flexure.ends]
        if not beam and _backwards(mechanism, system, flexure, outline):
            ends.reverse()
            guided.reverse()
        result.append(
            {
                "name": flexure.name,
                "beam": beam,
                "corners": mechanism.node_count(kind) if beam else len(outline.c),
                "guided": guided,
                "ends": ends,
                "profile": _profile(kind),
                "yield": kind.yield_strength,
            }
        )
    return result


def _profile(kind: FlexureType) -> dict[str, Json] | None:
    """Return the dimensions of a taper or a notch; None for leaves."""
    if kind.profile == LEAF:
        return None
    fields = ("thickness", "end_thickness", "notch_radius", "notch_depth", "waist_length")
    return {name: _field(kind, name) for name in fields if field_of(kind, name) is not None}


def _backwards(mechanism: Mechanism, system: System, flexure: Flexure, outline: Outline) -> bool:
    """Return whether the corners of a flexure are listed from its end to its start."""
    values: Mapping[str, float] = system.values
    corners = outline.c + outline.A @ system.directions(system.q0)
    x, y = (affine(c)(values) for c in mechanism.point(flexure.start, flexure.name))
    start = complex(x, y)
    return bool(abs(corners[-1] - start) < abs(corners[0] - start))
