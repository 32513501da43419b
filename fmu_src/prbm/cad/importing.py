"""From a drawing to a mechanism."""

import math
import re
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..base.errors import PrbmError
from ..files.mechanism_file import read_mechanism
from ..files.settings import UserMistake, quantity
from ..mechanics.assembly import assemble
from ..mechanics.modal import modes
from ..mechanics.statics import equilibrium
from ..mechanism.description import Mechanism
from ..mechanism.parameters import number
from .bolted import bolted
from .curves import Curves, DrawingError, diagonal
from .draft import Draft, draft
from .dxf import read_dxf
from .marks import find_ground
from .materials import Material, material
from .numbers import Unit, plain, roundest
from .plates import open_ends, plate
from .recognition import recognised
from .stops import find_stops
from .writing import Heading, file_text

INCH = 0.0254  # m
INCHES = ("in", "inch", "inches")
NO_POINT = "--ground {}: write a point x,y, for instance 5,5 or 5mm,5mm"
NOISE_RTOL = 5e-6  # Default accuracy of coordinates, as a share of the diagonal.
AXIAL_RTOL = 0.01  # Change of the fundamental frequency, above which flexures stretch.
AMPLITUDE_SHARE = 0.02  # Released amplitude over the size without a stop,
AMPLITUDE_GAPS = 2.0  # or over the gap.
STILL_SHARE = 0.05  # A body whose centre moves less, over its other motions, is not released so.


Ground = str | Sequence[Any]


@dataclass(frozen=True)
class Options:
    """What a drawing does not say, and tolerances.

    Lengths are numbers in metres, or texts with a unit, ``"8 mm"``.

    Parameters
    ----------
    thickness : float or str
        Thickness of the plate.
    material : str
        Name of its material.
    youngs_modulus, density : str or None
        Own properties of the material with units.
    ground : str, pair of float, or sequence of these
        Points of bodies that are fixed: ``(5, 5)`` and ``"5,5"`` in units of the drawing, or
        ``"5mm,5mm"``; empty: marks in the drawing, or the largest body.
    unit : float, str or None
        Length of a unit of the drawing, also ``"in"``; None: that of the file.
    gap : float, str or None
        Largest distance of two ends of curves that are joined.
    tolerance : float, str or None
        Accuracy of the coordinates, within which numbers are rounded.
    flexures_below : float, str or None
        Largest thickness of a flexure.
    name : str or None
        Name of the mechanism; None: that of the file.
    """

    thickness: float | str
    material: str = "steel"
    youngs_modulus: str | None = None
    density: str | None = None
    ground: Ground = ()
    unit: float | str | None = None
    gap: float | str | None = None
    tolerance: float | str | None = None
    flexures_below: float | str | None = None
    name: str | None = None

    def length(self, name: str, size: float = math.inf) -> float | None:
        """Return an option that is a length [m], None if it is not given.

        Parameters
        ----------
        name : str
            Name of the option.
        size : float
            Diagonal of the drawing [m], which it must not exceed.

        Raises
        ------
        UserMistake
            If it is not a length, not positive, or larger than the drawing.
        """
        given = getattr(self, name)
        if given is None and name != "thickness":
            return None
        if isinstance(given, str) and name == "unit" and given.strip().lower() in INCHES:
            return INCH
        option = f"--{name.replace('_', '-')}"
        if given == "":
            raise UserMistake(f'{option} "": write a length with a unit, for instance mm')
        if isinstance(given, str):
            value = quantity(f"1 {given}" if name == "unit" else given, "m", option)
        else:
            value = number(option, given, "m")
        if not 0.0 < value < math.inf:
            raise UserMistake(f"{option} {given}: write a positive length, for instance 8mm")
        if value > size:
            raise UserMistake(
                f"{option} {given}: {value:g} m is more than the diagonal of the drawing, "
                f"{size:.3g} m; check the unit, for instance {option} {value:g}mm"
            )
        return value

    def grounds(self, unit: float) -> list[complex]:
        """Return the points of the ground [m].

        Parameters
        ----------
        unit : float
            Length of a unit of the drawing [m].

        Raises
        ------
        UserMistake
            If one of them is not a point.
        """
        given = [self.ground] if isinstance(self.ground, str) else _listed(self.ground)
        if given and not any(isinstance(x, str) or np.ndim(x) for x in given):
            given = [given]  # A pair of numbers is one point.
        return [_point(x, unit) for x in given]


def _listed(given: Any) -> list[Any]:
    try:
        return [*given]
    except TypeError:
        raise UserMistake(NO_POINT.format(given)) from None


def _point(given: Any, unit: float) -> complex:
    """Return a point of a drawing [m]; numbers are in units of the drawing."""
    words = given.split(",") if isinstance(given, str) else _listed(given)
    if len(words) != 2:
        raise UserMistake(NO_POINT.format(given))
    try:
        return unit * complex(*map(float, words))
    except (TypeError, ValueError):
        return complex(*(quantity(str(word), "m", "--ground") for word in words))


@dataclass(frozen=True)
class Imported:
    """A mechanism from a drawing.

    Parameters
    ----------
    text : str
        The mechanism file.
    mechanism : Mechanism
        The mechanism that it describes.
    draft : Draft
        The recognised parts.
    notes : list of str
        What was assumed or repaired.
    """

    text: str
    mechanism: Mechanism
    draft: Draft
    notes: list[str]


def read_curves(path: Path, unit: float | None, tolerance: float | None) -> Curves:
    """Return the curves of a DXF or SVG file.

    Raises
    ------
    DrawingError
        If the file is of another kind, or cannot be read.
    """
    suffix = path.suffix.lower()
    if suffix == ".svg":
        from .svg import read_svg

        return read_svg(path, unit, tolerance)
    if suffix not in (".dxf", ".dxb", ""):
        raise DrawingError(f"{path}: drawings are read from .dxf and .svg files; export it as DXF")
    return read_dxf(path, unit, tolerance)


def import_drawing(path: str | Path, options: Options) -> Imported:
    """Return the mechanism of the plate in a drawing, and its file.

    Raises
    ------
    DrawingError
        If the drawing cannot be read, or is not the outline of a mechanism.
    """
    path = Path(path)
    made_of = material(options.material, options.youngs_modulus, options.density)
    curves = read_curves(path, options.length("unit"), options.length("tolerance"))
    outlines = curves.plates()
    if not outlines:
        raise DrawingError(f"{path}: there are no lines or curves; {_skipped(curves)}")
    size = diagonal([c for group in outlines for c in group])
    thickness, gap, tolerance, thickest = (
        options.length(name, size) for name in ("thickness", "gap", "tolerance", "flexures_below")
    )
    cut = [plate(group, gap) for group in outlines]
    noise = tolerance or NOISE_RTOL * size
    try:
        found = bolted([recognised(one, noise, thickest) for one in cut])
    except DrawingError as error:
        reasons = [open_ends(one.loose) or str(error) for one in cut]
        raise DrawingError(f"no mechanism was found: {'; '.join(dict.fromkeys(reasons))}") from None
    loose = "a free end of a line: not part of an outline"
    found.doubts += [(z, loose) for z in found.plate.loose]
    find_ground(found, curves, options.grounds(curves.unit))
    stops = find_stops(found, curves)
    notes = [*curves.notes, *found.plate.notes]
    if curves.skipped:
        notes.append(_skipped(curves))
    assert thickness is not None
    heading = _heading(path, options, thickness, made_of)
    return _written(draft(found, stops), heading, notes)


def read_drawing(
    path: str | Path,
    *,
    thickness: float | str,
    material: str = "steel",
    youngs_modulus: str | None = None,
    density: str | None = None,
    ground: Ground = (),
    unit: float | str | None = None,
    gap: float | str | None = None,
    tolerance: float | str | None = None,
    flexures_below: float | str | None = None,
    name: str | None = None,
) -> Mechanism:
    """Return the mechanism of the plate in a drawing (DXF or SVG).

    Lengths are numbers in metres, or texts with a unit, ``"8 mm"``.

    Parameters
    ----------
    path : str or Path
        The drawing.
    thickness : float or str
        Thickness of the plate.
    material : str
        Name of its material.
    youngs_modulus, density : str or None
        Own properties of the material with units.
    ground : str, pair of float, or sequence of these
        Points of bodies that are fixed: ``(5, 5)`` and ``"5,5"`` in units of the drawing, or
        ``"5mm,5mm"``; empty: marks in the drawing, or the body with the largest box.
    unit : float, str or None
        Length of a unit of the drawing, also ``"in"``; None: that of the file.
    gap, tolerance, flexures_below : float, str or None
        Largest gap of the outline that is closed, accuracy of coordinates, and largest thickness of
        a flexure.
    name : str or None
        Name of the mechanism; None: that of the file.

    Raises
    ------
    DrawingError
        If the drawing cannot be read, or is not the outline of a mechanism.
    UserMistake
        If an argument is not a quantity of the right dimension, or larger than the drawing.
    """
    chosen = Options(
        thickness, material, youngs_modulus, density, ground, unit, gap, tolerance, flexures_below,
        name,
    )  # fmt: skip
    return import_drawing(path, chosen).mechanism


def _skipped(curves: Curves) -> str:
    """Return a sentence with the entities that were not read."""
    if not curves.skipped:
        return "draw the outline of the plate in the model space"
    listed = ", ".join(f"{count} {kind}" for kind, count in sorted(curves.skipped.items()))
    return f"not read: {listed}"


def _heading(path: Path, options: Options, thickness: float, made_of: Material) -> Heading:
    words = re.findall(r"[A-Za-z0-9]+", options.name or path.stem) or ["Drawing"]
    name = "".join(word[0].upper() + word[1:] for word in words)
    name = name if not name[0].isdigit() else f"Drawing{name}"
    source = "".join(c if c.isprintable() else "?" for c in path.name)
    safe = source.replace("\\", "/").replace('"', "'")
    title = f"Mechanism from the drawing {safe}"
    return Heading(name, title, source, thickness, made_of)


# --- the file -----------------------------------------------------------------------------------


def _written(drafted: Draft, heading: Heading, notes: list[str]) -> Imported:
    """Return the mechanism of a draft: with copies if they are exact, and a release."""
    comments = _comments(drafted, heading, notes)
    mechanism = _read(file_text(drafted, heading, comments))
    if not _matches(drafted, mechanism):
        drafted = draft(drafted.found, drafted.stops, symmetric=False)
        mechanism = _read(file_text(drafted, heading, comments))
    stretching = replace(heading, axial=True)
    if _stiffened(mechanism, _read(file_text(drafted, stretching, comments))):
        heading = stretching
        mechanism = _read(file_text(drafted, heading, comments))
    heading = replace(heading, release=_release(drafted, mechanism))
    text = file_text(drafted, heading, comments)
    return Imported(text, _read(text), drafted, notes)


def _comments(drafted: Draft, heading: Heading, notes: Sequence[str]) -> list[str]:
    """Return the sentences at the top of the file."""
    found = drafted.found
    flexures = len(found.flexures)
    lines = " and ".join(f"{m.axis} = {1e3 * m.at:.4g} mm" for m in drafted.lines)
    return [
        f"From the drawing {heading.source}: {len(drafted.names)} moving "
        f"bod{'y' if len(drafted.names) == 1 else 'ies'}, {flexures} flexures"
        + (f"; symmetric about {lines}." if lines else "."),
        *notes,
        *(f"At ({1e3 * z.real:.4g}, {1e3 * z.imag:.4g}) mm: {text}." for z, text in found.doubts),
    ]


def _read(text: str) -> Mechanism:
    """Return the mechanism of the text of a file."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "drawing.toml"
        path.write_text(text, encoding="utf-8")
        try:
            return read_mechanism(path)
        except PrbmError as error:
            reason = str(error).replace(f"{path}: ", "")
            raise DrawingError(f"the parts of the drawing are no mechanism: {reason}") from None


def _matches(drafted: Draft, mechanism: Mechanism) -> bool:
    """Return whether the flexures of a mechanism are those that were recognised."""
    found = drafted.found
    bodies = {body.name for body in mechanism.bodies}
    drawn = []
    for flexure in mechanism.flexures:
        ends = [mechanism.point(end, flexure.name) for end in (flexure.start, flexure.end)]
        z = [complex(float(x), float(y)) for x, y in ends]  # The file has numbers only.
        drawn.append((z, flexure))
    if len(drawn) != len(found.flexures) or bodies != {*drafted.names.values()}:
        return False
    for one in found.flexures:
        near = 0.05 * one.shape.thickness + 10.0 * found.noise
        owners = ["ground" if b in found.ground else drafted.names[b] for b in one.bodies]
        if not any(
            _same_ends(one.shape.start, one.shape.end, owners, z, [f.start, f.end], near)
            for z, f in drawn
        ):
            return False
    return True


def _same_ends(
    start: complex, end: complex, owners: list[str], z: list[complex], at: list[str], near: float
) -> bool:
    """Return whether a written flexure joins the same bodies at the same points, in any order."""
    written = [name.rpartition(".")[0] for name in at]
    return any(
        abs(start - a) <= near and abs(end - b) <= near and owners == pair
        for (a, b), pair in (((z[0], z[1]), written), ((z[1], z[0]), written[::-1]))
    )


def fundamental(mechanism: Mechanism) -> float:
    """Return the fundamental frequency at rest [Hz]; 0 if there is none."""
    try:
        system = assemble(mechanism, mechanism.values())
        return float(modes(system, equilibrium(system)).frequency[0])
    except (PrbmError, IndexError):
        return 0.0


def _stiffened(mechanism: Mechanism, stretching: Mechanism) -> bool:
    """Return whether flexures that cannot stretch make a mechanism stiffer."""
    rigid, soft = fundamental(mechanism), fundamental(stretching)
    return soft > 0.0 and not abs(rigid - soft) <= AXIAL_RTOL * soft


def _release(drafted: Draft, mechanism: Mechanism) -> str:
    """Return the keys of a release along the lowest mode that moves the stage."""
    low, high = (complex(*drafted.found.plate.shape.bounds[k : k + 2]) for k in (0, 2))
    size = abs(high - low)
    try:
        system = assemble(mechanism, mechanism.values())
        found = modes(system, equilibrium(system))
        frame = system.bodies[drafted.names[drafted.stage]]
        w = system.turning(found.shape[:, 0])
        moved = complex(frame.A @ (1j * w * system.directions(system.q0)))
        turned = abs(complex(w[frame.arm])) * size
    except (PrbmError, IndexError):
        return "displacement = 0"
    if abs(moved) <= STILL_SHARE * turned:
        return _turned(mechanism, system.length)
    direction = moved / abs(moved)
    amplitude = AMPLITUDE_SHARE * size
    stop = next((s for s in drafted.stops if s.body == drafted.stage), None)
    if stop is not None:
        along = (np.conj(direction) * stop.direction).real
        direction = direction if along <= 0.0 else -direction  # Away from the stop.
        if stop.gap > 0.0:
            amplitude = AMPLITUDE_GAPS * stop.gap
        for other in (s for s in drafted.stops if s.body == drafted.stage):
            towards = (np.conj(direction) * other.direction).real
            if towards * amplitude > 0.5 * other.gap:
                amplitude = 0.5 * other.gap / towards
    elif direction.real < 0.0 or (abs(direction.real) < 1e-6 and direction.imag < 0.0):
        direction = -direction
    degrees = roundest(float(np.degrees(np.angle(direction))), 0.1)
    unit = Unit(size, 0.1 * amplitude)
    keys = [f"direction = {plain(degrees)}"] if degrees else []
    return "\n".join([*keys, "mode = 1", f"amplitude = {unit.text(amplitude)}"])


def _turned(mechanism: Mechanism, size: float) -> str:
    """Return a release by a rotation."""
    return 'angle = "1 deg"'
