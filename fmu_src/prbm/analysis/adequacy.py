"""Whether the flexure models of a mechanism are adequate in the shapes where they are used.

Two simplifications can give wrong results.  Inextensible flexures suppress motions and leave a
mechanism with modes of the flexures only, at far too high frequencies.  Few pivots are accurate for
the loads that their coefficients were fitted to, and less so for others.  :func:`check` computes
the lowest frequencies and the modal restitution of a mechanism in given shapes, and again

* with stretching flexures of the same model, and
* with stretching beams of a high order, the finer model.

It returns a :class:`Finding` for a difference above a limit, with the simplest model that removes
it.  All models follow Newton's law of a rigid impact; the effect of stretching is smaller, or
absent, for a contact that lasts as long as a period of the excited modes.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from functools import cached_property

import numpy as np

from ..base.errors import ParameterError, PrbmError
from ..base.unit_text import frequency_text, length_unit
from ..mechanics.assembly import assemble
from ..mechanics.modal import modal_restitution, modes
from ..mechanics.statics import equilibrium
from ..mechanics.system import System
from ..mechanism.description import Mechanism
from ..mechanism.parts import value
from ..runs.released import released_label
from .flexure_models import stretching, with_flexures
from .touching import impact_shape, lever

FREQUENCIES = 3  # Number of the lowest frequencies that are compared at rest, or held.
FUNDAMENTAL_RTOL = 0.05  # Largest unreported difference of the fundamental frequency.
FREQUENCY_RTOL = 0.2  # Largest unreported difference of the other frequencies.
ZERO_FREQUENCY_RTOL = 1e-3  # Of the largest compared frequency: a lower one is not compared.
STRETCH_RESTITUTION_ATOL = 0.02  # Largest unreported effect of stretching on the restitution.
PIVOTS_RESTITUTION_ATOL = 0.05  # Largest unreported effect of few pivots on the restitution.
LEVER_MIN = 0.01  # Least lever of an impact that a finding names, as a share of the size.
FINE_ORDER = 7  # Order of the beams of the finer model.
FINE_LINKS = 24  # Chains of as many links are not compared with the finer model.
ORDERS = (3, 5)  # Orders of beams to propose, if they agree with the finer model.
FLEXURES_MAX = 24  # Flexures of a mechanism that is compared with the finer model.


# --- shapes and quantities ------------------------------------------------------------------------


@dataclass(frozen=True)
class Vibration:
    """Small vibrations about the rest position under gravity, or about a held shape.

    Parameters
    ----------
    held : float or None
        Displacement [m] or, if the release is by an angle, rotation [rad] of the released body,
        held by a force or a moment; None: at rest.
    loads : tuple of (str, float)
        Names and values of the dead loads [N], [N m].
    """

    held: float | None = None
    loads: tuple[tuple[str, float], ...] = ()


@dataclass(frozen=True)
class Impact:
    """An impact in the shape that a force on the released body holds at the wall of a stop.

    Parameters
    ----------
    stop : int
        Index of the stop.
    position, offset : float or None
        Position of the wall and offset of the hit point [m]; None: the values of the stop.
    """

    stop: int
    position: float | None = None
    offset: float | None = None


Shape = Vibration | Impact


class Quantity(Enum):
    """Quantities that are compared."""

    FREQUENCY = "frequency"
    RESTITUTION = "modal restitution"


class Cause(Enum):
    """Simplifications that cause a difference."""

    INEXTENSIBLE = "inextensible flexures"
    PIVOTS = "few pivots, or a low order"


@dataclass(frozen=True)
class Finding:
    """A difference between the model of a mechanism and a better one.

    Parameters
    ----------
    quantity : Quantity
        Frequency [Hz] or modal restitution [-].
    mode : int
        Number of the mode, from 1; 0 for a modal restitution.
    cause : Cause
        Simplification of the model.
    where : str
        Shape, as the beginning of a sentence.
    found, better : float
        Values by the model of the mechanism and by the better one.
    choice : str
        Keys of the better model in a mechanism file.
    """

    quantity: Quantity
    mode: int
    cause: Cause
    where: str
    found: float
    better: float
    choice: str

    @property
    def difference(self) -> float:
        """Magnitude of the difference [Hz], [-]."""
        return abs(self.found - self.better)

    def __str__(self) -> str:
        found, better = (_text(self.quantity, x) for x in (self.found, self.better))
        if self.quantity is Quantity.FREQUENCY:
            subject = f"{self.where}: mode {self.mode} is"
            found, better = (x if x in WORDS else f"at {x}" for x in (found, better))
        else:
            subject = f"{self.where}: the modal restitution of a rigid impact is"
        if self.cause is Cause.INEXTENSIBLE:
            routes = ("with inextensible flexures", "with stretching ones")
        else:
            routes = ("with this flexure model", "with a finer one")
        both = f"{found} {routes[0]} and {better} {routes[1]}"
        return f"{subject} {both}; set {self.choice} for the flexures"


@dataclass(frozen=True)
class Skipped:
    """A comparison that was not made, with the reason."""

    reason: str

    def __str__(self) -> str:
        return f"the flexure model was not compared with a finer one: {self.reason}"


WORDS = ("free", "unstable")  # Modes without a stiffness, and with a negative one.


def _text(quantity: Quantity, x: float) -> str:
    if quantity is Quantity.RESTITUTION:
        return f"{x:.3f}"
    return frequency_text(x) if x > 0.0 else WORDS[int(x < 0.0)]


# --- the comparison -------------------------------------------------------------------------------

Key = tuple[Quantity, int]
Values = dict[Key, float]  # Frequencies by the number of their mode, and the modal restitution.


def check(
    mechanism: Mechanism, values: Mapping[str, float] | None, shapes: Sequence[Shape]
) -> list[Finding | Skipped]:
    """Compare a mechanism with stretching flexures and with a finer model.

    Parameters
    ----------
    mechanism : Mechanism
        The mechanism.
    values : mapping or None
        Parameters that differ from their defaults.  The finer model has its own coefficients.
    shapes : sequence of Vibration or Impact
        Shapes of the comparison.  Those that the mechanism cannot take are left out.

    Returns
    -------
    list of Finding or Skipped
        For each shape, the lowest mode whose frequency differs and the modal restitution if it
        differs; empty if the model is adequate.
    """
    known = dict(values or {})
    own = _Model("", mechanism, known)
    taken = [shape for shape in shapes if own.values(shape)]
    if not taken:
        return []
    result: list[Finding | Skipped] = []
    try:
        fine: _Model | None = _finer(mechanism, known)
        missing = [shape for shape in taken if fine and not fine.values(shape)]
        if fine and missing:
            result.append(Skipped(f"{_where(own, missing[0])}: it does not reach this shape"))
    except PrbmError as error:
        fine, text = None, str(error)
        result.append(Skipped(text))
    models = _Models(own, _stretched(mechanism, known), fine, taken)
    for shape in taken:
        result += models.findings(shape)
    return result


def notes(
    mechanism: Mechanism, values: Mapping[str, float] | None, shapes: Sequence[Shape]
) -> list[str]:
    """Return the findings as notes to print; parameters as for :func:`check`."""
    return [f"note: {finding}" for finding in check(mechanism, values, shapes)]


def worst(found: Sequence[Finding | Skipped]) -> list[Finding | Skipped]:
    """Return the largest of the differences with the same quantity, mode and cause, and skips."""
    largest: dict[object, Finding | Skipped] = {}
    for one in found:
        key: object = one
        if isinstance(one, Finding):
            key = (one.quantity, one.mode, one.cause)
            before = largest.get(key, one)
            if isinstance(before, Finding) and before.difference > one.difference:
                continue
        largest[key] = one
    return [*largest.values()]


class _Model:
    """A mechanism with one model of its flexures, and its quantities in the shapes."""

    def __init__(self, choice: str, mechanism: Mechanism, values: Mapping[str, float]) -> None:
        self.choice, self.mechanism = choice, mechanism
        names = {p.name for p in mechanism.parameters}
        self.given = {name: x for name, x in values.items() if name in names}
        self._known: dict[Shape, Values] = {}

    def system(self, shape: Shape) -> System:
        """Return the assembled system, with the offset of an impact."""
        if not isinstance(shape, Impact) or shape.offset is None:
            return self._system
        given = {**self.given, f"{self.mechanism.stops[shape.stop].name}.offset": shape.offset}
        return assemble(self.mechanism, self.mechanism.values(given))

    @cached_property
    def _system(self) -> System:
        return assemble(self.mechanism, self.mechanism.values(self.given))

    def values(self, shape: Shape) -> Values:
        """Return the quantities in a shape; empty if the shape is not found."""
        if shape not in self._known:
            try:
                self._known[shape] = self._values(self.system(shape), shape)
            except PrbmError:
                self._known[shape] = {}
        return self._known[shape]

    def _values(self, system: System, shape: Shape) -> Values:
        result: Values = {}
        count = FREQUENCIES
        if isinstance(shape, Impact):
            count = 1  # The restitution shows the effect of the others.
            stop = self.mechanism.stops[shape.stop]
            held = impact_shape(system, shape.stop, wall(system, shape))
            restitution = value(stop, "restitution", system.values)
            C = modal_restitution(system, held, shape.stop, restitution)
            if math.isfinite(C):
                result[Quantity.RESTITUTION, 0] = C
        else:
            held = equilibrium(system, shape.held, dict(shape.loads))
        found = modes(system, held)
        acting = np.abs(found.frequency) > found.rounding
        lowest = np.where(acting, found.frequency, 0.0)[:count].tolist()
        return result | {(Quantity.FREQUENCY, k): f for k, f in enumerate(lowest, start=1)}


@dataclass(frozen=True)
class _Models:
    """A mechanism, with stretching flexures, and with the finer model, in the same shapes."""

    own: _Model
    stretched: _Model | None
    fine: _Model | None
    shapes: Sequence[Shape]

    def findings(self, shape: Shape) -> Iterator[Finding]:
        """Yield the findings in a shape, at most one frequency."""
        reported = set()
        for key, found in self.own.values(shape).items():
            quantity, mode = key
            cause = self._cause(shape, key)
            better = self.fine if cause is Cause.PIVOTS else self.stretched
            if cause is None or better is None or quantity in reported:
                continue
            reported.add(quantity)
            choice = self._choice if cause is Cause.PIVOTS else better.choice
            where = _where(self.own, shape, cause)
            yield Finding(quantity, mode, cause, where, found, better.values(shape)[key], choice)

    def _cause(self, shape: Shape, key: Key) -> Cause | None:
        """Return the simplification that changes a quantity, if any."""
        own, fine = self.own.values(shape), self.fine.values(shape) if self.fine else {}
        stretched = self.stretched.values(shape) if self.stretched else own
        if differ(own, fine, key) and differ(stretched, fine, key):
            return Cause.PIVOTS
        if differ(own, stretched, key, of_stretch=True):
            return Cause.INEXTENSIBLE
        return None

    @cached_property
    def _choice(self) -> str:
        """Return the keys of the beams of least order that agree with the finer model."""
        assert self.fine is not None
        fine, mechanism = self.fine, self.own.mechanism
        for order in ORDERS:
            model = _with_beams(mechanism, order, self.own.given)
            if all(_agree(model.values(shape), fine.values(shape)) for shape in self.shapes):
                return model.choice
        return fine.choice


def _agree(values: Values, fine: Values) -> bool:
    return bool(values) and not any(differ(values, fine, key) for key in fine)


def differ(a: Values, b: Values, key: Key, of_stretch: bool = False) -> bool:
    """Return whether a quantity differs by more than its limit; false if one does not have it.

    Parameters
    ----------
    a, b : dict
        Quantities by two models; ``b`` is the better one.
    key : tuple
        Kind of the quantity and number of the mode.
    of_stretch : bool
        Whether the limits are those of the effect of stretching.
    """
    if key not in a or key not in b:
        return False
    quantity, mode = key
    if quantity is Quantity.RESTITUTION:
        limit = STRETCH_RESTITUTION_ATOL if of_stretch else PIVOTS_RESTITUTION_ATOL
        return abs(a[key] - b[key]) > limit
    scale = max(abs(f) for (kind, _), f in b.items() if kind is Quantity.FREQUENCY)
    if max(abs(a[key]), abs(b[key])) <= ZERO_FREQUENCY_RTOL * scale:
        return False
    share = FUNDAMENTAL_RTOL if mode == 1 or of_stretch else FREQUENCY_RTOL
    return abs(a[key] - b[key]) > share * abs(b[key])


def _stretched(mechanism: Mechanism, values: Mapping[str, float]) -> _Model | None:
    """Return the mechanism with stretching flexures; None if it stretches, or cannot."""
    if all(kind.axial for kind in mechanism.flexure_types):
        return None
    try:
        return _Model("axial = true", stretching(mechanism), values)
    except PrbmError:  # A flexure of one link with a free end.
        return None


def _finer(mechanism: Mechanism, values: Mapping[str, float]) -> _Model | None:
    """Return the mechanism with stretching beams; None if its flexures are as accurate."""
    kinds = mechanism.flexure_types
    if all(kind.n >= FINE_LINKS or (kind.order or 0) >= FINE_ORDER for kind in kinds):
        return None
    if len(mechanism.flexures) > FLEXURES_MAX:
        raise ParameterError(
            f"the mechanism has {len(mechanism.flexures)} flexures, and the comparison is made for "
            f"at most {FLEXURES_MAX}; compare with finite elements, prbm validate"
        )
    return _with_beams(mechanism, FINE_ORDER, values)


def _with_beams(mechanism: Mechanism, order: int, values: Mapping[str, float]) -> _Model:
    """Return the mechanism with stretching beams of an order."""
    text = f'model = "beam", order = {order}, axial = true'
    return _Model(text, with_flexures(mechanism, "beam", axial=True, order=order), values)


# --- shapes in words ------------------------------------------------------------------------------


def wall(system: System, impact: Impact) -> float:
    """Return the position of the wall in an impact [m]."""
    if impact.position is not None:
        return impact.position
    return value(system.mechanism.stops[impact.stop], "position", system.values)


def _where(model: _Model, shape: Shape, cause: Cause = Cause.PIVOTS) -> str:
    """Return the description of a shape, the beginning of a sentence."""
    system, release = model.system(shape), model.mechanism.release
    factor, name = length_unit(system.length)
    if isinstance(shape, Vibration):
        if release.turns:
            factor, name = 180 / math.pi, "deg"
        if shape.held is None:
            return f"{release.body} at rest"
        return f"{released_label(release)} held at {factor * shape.held:.4g} {name}"
    stop = model.mechanism.stops[shape.stop]
    place = f"{factor * wall(system, shape):.4g} {name}"
    touching = f"{stop.body} held at the wall of {stop.name}, hit point displaced by {place}"
    off = lever(system, shape.stop)
    if cause is Cause.PIVOTS or abs(off) <= LEVER_MIN * system.length:
        return touching
    off_centre = f"{factor * abs(off):.3g} {name} off the centre of mass of {stop.body}"
    return f"{stop.name} hits {off_centre}; {touching}"
