"""``prbm contact``: contact stiffness of a compliant stop, and force and duration of a hit."""

import argparse
import math

from ..analysis.contact_hit import first_hit, hertz_stiffness, plate_stiffness
from ..base.unit_text import stiffness_unit
from ..files.settings import UserMistake, quantity, stiffness

STRONG_DAMPING = 0.3  # Restitution below which the damping makes the largest force.


def contact(options: argparse.Namespace) -> None:
    """Print the stiffness of a contact and, with mass and speed, its first hit."""
    k, exponent = _stiffness(options)
    size = f"{k:.6g} {stiffness_unit(exponent)}"
    rows = [*_parts(options), ("stiffness", size), ("exponent", f"{exponent:g}")]
    if (options.mass is None) != (options.speed is None):
        raise UserMistake("--mass and --speed: give both for a hit")
    if options.mass is not None:
        rows += _hit(options, k, exponent)
    for name, text in rows:
        print(f"{name:17} {text}")
    print("keys of the stop in a mechanism file:")
    restitution = quantity(options.restitution, "", "--restitution")
    for line in (
        'law = "compliant"', f'stiffness = "{size}"', f"exponent = {exponent:g}",
        f"restitution = {restitution:g}",
    ):  # fmt: skip
        print(f"  {line}")


def _parts(options: argparse.Namespace) -> list[tuple[str, str]]:
    """Return the rows with the given sizes and materials in SI, which show a wrong unit."""
    if options.stiffness:
        return []
    modulus = quantity(options.youngs_modulus, "Pa", "--youngs-modulus")
    if options.thickness:
        area, thick = (
            quantity(getattr(options, name), unit, f"--{name}")
            for name, unit in (("area", "m2"), ("thickness", "m"))
        )
        return [("pad", f"{area:g} m2, {thick:g} m thick, {modulus:g} Pa")]
    radius = quantity(options.radius, "m", "--radius")
    wall = f"radius {options.wall_radius.strip()}" if options.wall_radius else "plane"
    stiff = options.wall_modulus or f"{modulus:g} Pa"
    return [("sphere", f"radius {radius:g} m, {modulus:g} Pa"), ("wall", f"{wall}, {stiff}")]


def _stiffness(options: argparse.Namespace) -> tuple[float, float]:
    """Return the stiffness in SI units, and the exponent."""
    ways = [name for name in ("radius", "thickness", "stiffness") if getattr(options, name)]
    if len(ways) != 1:
        raise UserMistake(
            "give one of --radius (spheres), --thickness (a pad) and --stiffness (its value)"
        )
    if options.stiffness:
        exponent = quantity(options.exponent, "", "--exponent")
        return stiffness(options.stiffness, exponent, "--stiffness"), exponent
    if not options.youngs_modulus:
        raise UserMistake("--youngs-modulus is missing: give Young's modulus of the body")
    modulus = quantity(options.youngs_modulus, "Pa", "--youngs-modulus")
    if options.thickness:
        if not options.area:
            raise UserMistake("--area is missing: give the area of the pad")
        area = quantity(options.area, "m2", "--area")
        return plate_stiffness(modulus, area, quantity(options.thickness, "m", "--thickness")), 1.0
    poisson = quantity(options.poisson, "", "--poisson")
    other = (
        quantity(options.wall_modulus, "Pa", "--wall-modulus") if options.wall_modulus else modulus
    )
    ratio = (
        quantity(options.wall_poisson, "", "--wall-poisson") if options.wall_poisson else poisson
    )
    radius = quantity(options.radius, "m", "--radius")
    if radius <= 0.0:
        raise UserMistake(
            f"--radius {options.radius.strip()} must be positive; a hollow has a negative "
            "--wall-radius"
        )
    wall = quantity(options.wall_radius, "m", "--wall-radius") if options.wall_radius else math.inf
    return hertz_stiffness(radius, wall, modulus, poisson, (other, ratio)), 1.5


def _hit(options: argparse.Namespace, stiffness: float, exponent: float) -> list[tuple[str, str]]:
    """Return the rows of the first hit."""
    mass = quantity(options.mass, "kg", "--mass")
    speed = quantity(options.speed, "m/s", "--speed")
    restitution = quantity(options.restitution, "", "--restitution")
    hit = first_hit(stiffness, exponent, restitution, mass, speed)
    rows = [
        ("peak force", f"{hit.force:.5g} N, {hit.force / hit.elastic_force:.3f} of an elastic hit"),
        ("indentation", f"{hit.indentation * 1e6:.5g} um"),
        ("contact duration", f"{hit.duration * 1e6:.5g} us"),
    ]
    if restitution < STRONG_DAMPING:
        rows.append(("note", "the damping makes the peak, at the begin of the contact"))
    return rows
