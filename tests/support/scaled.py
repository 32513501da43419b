"""The same mechanism in other units: each quantity times powers of three factors.

Factors of length, mass and time that are powers of four are exact in all products, quotients and
square roots of floating-point numbers.  A computation that does not depend on the units then has
the same digits.
"""

import math
from contextlib import contextmanager
from dataclasses import fields, replace

from prbm.interface.units import UNITS
from prbm.mechanism import parts
from prbm.mechanism.description import Mechanism
from prbm.mechanism.expressions import Affine, affine
from prbm.mechanism.fields import FIELDS, fields_of
from prbm.mechanism.parameters import Parameter

STRENGTHS = ("yield_strength", "tensile_strength", "fatigue_strength")
POINTS = ("centre", "point")


@contextmanager
def unbounded(monkeypatch):
    """Create parameters without bounds, which exclude many scales."""
    bounds = {"minimum": -math.inf, "maximum": math.inf}

    def freed(one):
        for name, bound in bounds.items():
            object.__setattr__(one, name, bound)

    with monkeypatch.context() as patch:
        patch.setattr(Parameter, "__post_init__", freed)
        patch.setattr(parts, "LENGTH_MIN", 0.0)
        for kind, metas in FIELDS.items():
            free = {n: m._replace(minimum=-math.inf, maximum=math.inf) for n, m in metas.items()}
            patch.setitem(FIELDS, kind, free)
        yield


class Units:
    """Factors of length, mass and time."""

    def __init__(self, length: float = 1.0, mass: float = 1.0, time: float = 1.0) -> None:
        self.factors = {"m": length, "kg": mass, "s": time}

    def of(self, unit: str) -> float:
        """Return the factor of a unit of the interface; empty: dimensionless."""
        base = UNITS[unit].base if unit else {}
        return math.prod(self.factors.get(name, 1.0) ** power for name, power in base.items())

    def _expression(self, quantity, unit: str, known: dict[str, str]):
        """Return a quantity in the new units; ``known`` has the units of the parameters."""
        if not isinstance(quantity, str):
            return quantity * self.of(unit)
        given = affine(quantity)
        terms = {name: c * self.of(unit) / self.of(known[name]) for name, c in given.terms.items()}
        scaled = Affine(given.constant * self.of(unit), terms)
        return " + ".join([repr(scaled.constant), *(f"{c!r}*{n}" for n, c in terms.items())])

    def _part(self, part, known: dict[str, str]):
        """Return a part of a mechanism in the new units."""
        changed = {}
        for name, (unit, *_) in fields_of(part).items() if type(part) in FIELDS else ():
            if getattr(part, name) is not None:
                changed[name] = self._expression(getattr(part, name), unit, known)
        if isinstance(part, parts.Stop) and part.stiffness is not None:
            exponent = float(part.exponent)
            factor = self.of("N") * self.factors["m"] ** -exponent
            changed["stiffness"] = part.stiffness * factor
        names = {field.name for field in fields(part)}
        for name in names & set(STRENGTHS):
            if getattr(part, name) is not None:
                changed[name] = getattr(part, name) * self.of("Pa")
        for name in names & set(POINTS):
            if getattr(part, name) is not None:
                changed[name] = self._point(getattr(part, name), known)
        if "points" in names:
            changed["points"] = {n: self._point(z, known) for n, z in part.points.items()}
            changed |= {"outline": (), "holes": ()}
        return replace(part, **changed)

    def _point(self, point, known: dict[str, str]):
        return tuple(self._expression(x, "m", known) for x in point)

    def mechanism(self, given: Mechanism) -> Mechanism:
        """Return a mechanism in the new units; parameters must be unbounded."""
        known = {p.name: p.unit for p in given.parameters}
        kinds = ("bodies", "flexure_types", "joints", "springs", "stops", "frictions", "forces")
        changed = {
            kind: tuple(self._part(part, known) for part in getattr(given, kind)) for kind in kinds
        }
        geometry = tuple(replace(p, value=p.value * self.of(p.unit)) for p in given.geometry)
        return replace(
            given, **changed, geometry=geometry, release=self._part(given.release, known),
            ground={name: self._point(z, known) for name, z in given.ground.items()},
            gravity=tuple(g * self.of("m/s2") for g in given.gravity),
            damping_beta=given.damping_beta * self.of("s"),
        )  # fmt: skip

    def values(self, given: dict[str, float], units: dict[str, str]) -> dict[str, float]:
        """Return values of variables in the new units."""
        return {name: x * self.of(units[name]) for name, x in given.items()}
