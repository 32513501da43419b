"""Materials of plates by name."""

import re
from dataclasses import dataclass

from .curves import DrawingError


@dataclass(frozen=True)
class Material:
    """A material: its name in the file, and its properties as text with units."""

    name: str
    youngs_modulus: str
    density: str


MATERIALS = {
    one.name: one
    for one in (
        Material("steel", "200 GPa", "7.85 g/cm3"),
        Material("spring_steel", "206 GPa", "7.85 g/cm3"),  # EN 13906-1
        Material("stainless", "195 GPa", "7.9 g/cm3"),
        Material("aluminium", "71 GPa", "2.8 g/cm3"),
        Material("titanium", "114 GPa", "4.43 g/cm3"),
        Material("bronze", "117 GPa", "8.8 g/cm3"),
        Material("silicon", "169 GPa", "2.33 g/cm3"),
        Material("pom", "2.8 GPa", "1.41 g/cm3"),
        Material("pmma", "3.2 GPa", "1.19 g/cm3"),
        Material("pla", "3.3 GPa", "1.24 g/cm3"),
        Material("peek", "3.6 GPa", "1.3 g/cm3"),
    )
}
"""Typical properties, which depend on treatment and direction."""


def material(name: str, youngs_modulus: str | None = None, density: str | None = None) -> Material:
    """Return a material by its name, with own properties if they are given.

    Raises
    ------
    DrawingError
        If the name is unknown and a property is missing.

    Examples
    --------
    >>> material("steel").density
    '7.85 g/cm3'
    >>> material("spring steel").name
    'spring_steel'
    """
    for key, given in (
        ("material", name),
        ("youngs_modulus", youngs_modulus),
        ("density", density),
    ):
        if not isinstance(given, str) and not (given is None and key != "material"):
            example = "200 GPa" if key == "youngs_modulus" else "7.85 g/cm3"
            example = "steel" if key == "material" else example
            raise DrawingError(f'{key} = {given!r} must be a text, for instance "{example}"')
    known = MATERIALS.get(re.sub(r"[\s-]+", "_", name.strip().lower()))
    if known is None and (youngs_modulus is None or density is None):
        raise DrawingError(
            f"the material {name!r} is unknown: choose one of {', '.join(MATERIALS)}, or give "
            "--youngs-modulus and --density"
        )
    if known is None:
        known = Material("".join(c if c.isalnum() else "_" for c in name.lower()), "", "")
    return Material(known.name, youngs_modulus or known.youngs_modulus, density or known.density)
