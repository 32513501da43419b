"""The curves of an SVG file, as Inkscape and laser cutters write them."""

import math
import re
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from ..base import reading
from ..mechanics.arrays import Complex, Real
from .curves import (
    FILE_SIZE_MAX,
    FLATTENING_RTOL,
    NESTING_MAX,
    Curves,
    DrawingError,
    diagonal,
    sagitta,
)

PIXEL = 0.0254 / 96.0  # m; of CSS.
UNITS = {
    "": PIXEL, "px": PIXEL, "mm": 1e-3, "cm": 1e-2, "in": 0.0254, "pt": 0.0254 / 72.0,
    "pc": 0.0254 / 6.0,
}  # fmt: skip
INKSCAPE = "{http://www.inkscape.org/namespaces/inkscape}"
SHAPES = ("path", "line", "polyline", "polygon", "rect", "circle", "ellipse")
HIDDEN = ("defs", "symbol", "clipPath", "mask", "pattern", "metadata", "style", "title", "desc")
PIECES_MAX = 4096  # Straight pieces of one curve.
CURVE_POINTS = 9  # Points of a curve from which its size and bend are estimated.
TEXT_MAX = 1 << 20  # Characters of one path.
NUMBER = re.compile(r"[-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?")
TRANSFORM = re.compile(r"(\w+)\s*\(([^()]{0,400})\)")


def read_svg(path: Path, unit: float | None, tolerance: float | None) -> Curves:
    """Return the curves of an SVG file, with y upwards.

    Layers are groups of Inkscape, or groups with an ``id``.

    Parameters
    ----------
    path : Path
        The file.
    unit : float or None
        Length of a user unit [m]; None: that of the width and the view box, or of a pixel.
    tolerance : float or None
        Largest distance of curves from their polylines [m]; None: 1e-5 of the diagonal.

    Raises
    ------
    DrawingError
        If the file is not an SVG file, or exceeds a limit.
    """
    content = reading.content(path, FILE_SIZE_MAX, DrawingError)
    if b"<!ENTITY" in content:
        raise DrawingError(f"{path}: it defines entities; save it as plain SVG")
    try:
        root = ElementTree.fromstring(content)
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        raise DrawingError(f"{path}: not an SVG file ({error})") from None
    if _tag(root) != "svg":
        raise DrawingError(f"{path}: not an SVG file (its root is {_tag(root)})")
    curves = Curves(str(path))
    curves.unit = unit or _unit(root, curves)
    try:
        if tolerance is None:
            draft = Curves(str(path), curves.unit)
            _Reader(draft, math.inf).read(root, np.eye(3), "", 0)
            tolerance = FLATTENING_RTOL * diagonal(draft.found)
        _Reader(curves, tolerance / curves.unit).read(root, np.eye(3), "", 0)
    except DrawingError:
        raise
    except Exception as error:  # svgpathtools raises errors of many types for invalid paths.
        raise DrawingError(
            f"{path}: an element is invalid ({type(error).__name__}: {error}); save it as plain SVG"
        ) from None
    return curves


def _tag(element: ElementTree.Element) -> str:
    """Return the name of an element without its namespace."""
    return str(element.tag).rpartition("}")[2]


def _unit(root: ElementTree.Element, curves: Curves) -> float:
    """Return the length of a user unit from width and view box [m]."""
    found = re.fullmatch(rf"\s*({NUMBER.pattern})\s*+([a-z]*)\s*", root.get("width", ""))
    box = NUMBER.findall(root.get("viewBox", ""))
    if found and found[2] in UNITS:
        width = float(found[1]) * UNITS[found[2]]
        user = float(box[2]) if len(box) == 4 else float(found[1])
        if width > 0.0 and user > 0.0:
            return width / user
    curves.notes.append("the drawing has no unit: pixels of 1/96 inch are assumed")
    return PIXEL


class _Reader:
    """Reads elements and groups."""

    def __init__(self, curves: Curves, tolerance: float) -> None:
        self.curves, self.tolerance = curves, tolerance

    def read(self, parent: ElementTree.Element, matrix: Real, layer: str, depth: int) -> None:
        """Read the elements of a group on a layer, in coordinates of a matrix."""
        if depth > 8 * NESTING_MAX:
            raise DrawingError(f"{self.curves.source}: groups are nested too deeply; ungroup them")
        for element in parent:
            tag = _tag(element)
            self.curves.count()
            if tag in HIDDEN or "display:none" in element.get("style", "").replace(" ", ""):
                continue
            own = matrix @ _matrix(element.get("transform", ""))
            name = element.get(f"{INKSCAPE}label") or element.get("id") or ""
            if tag in ("g", "svg", "a"):
                inner = name if tag == "g" and name else layer
                self.read(element, own, inner if depth == 0 or not layer else layer, depth + 1)
            elif tag in SHAPES:
                for z in self._lines(tag, element):
                    placed = own @ np.array([z.real, z.imag, np.ones(len(z))])
                    self.curves.add(layer or "0", placed[0] - 1j * placed[1])
            elif "}" in str(element.tag) and tag not in ("namedview",):
                self.curves.skipped[tag] += 1

    def _lines(self, tag: str, element: ElementTree.Element) -> Iterator[Complex]:
        """Yield the lines of a shape in its own coordinates."""
        if tag == "path":
            yield from self._path(element.get("d", ""))
            return
        value = _numbers(element)
        if tag == "line":
            yield np.array([complex(value("x1"), value("y1")), complex(value("x2"), value("y2"))])
        elif tag in ("polyline", "polygon"):
            x = [float(n) for n in NUMBER.findall(element.get("points", ""))]
            z = np.array([complex(*p) for p in zip(x[::2], x[1::2], strict=False)])
            yield np.append(z, z[:1]) if tag == "polygon" else z
        elif tag == "rect":
            z0, size = complex(value("x"), value("y")), (value("width"), value("height"))
            yield z0 + np.array([0, size[0], complex(*size), 1j * size[1], 0])
            if value("rx") or value("ry"):
                self.curves.notes.append("a rectangle has round corners, which were not read")
        else:
            rx, ry = (value("r"), value("r")) if tag == "circle" else (value("rx"), value("ry"))
            yield self._ellipse(complex(value("cx"), value("cy")), rx, ry)

    def _ellipse(self, centre: complex, rx: float, ry: float) -> Complex:
        """Return a closed ellipse."""
        if not (rx > 0.0 and ry > 0.0):
            return np.zeros(0, complex)
        height = sagitta(min(rx, ry), self.tolerance)
        step = 2.0 * math.acos(max(1.0 - height / max(rx, ry), -1.0))
        count = 4 * min(PIECES_MAX, max(8, math.ceil(0.5 * math.pi / step)))
        angle = np.linspace(0.0, 2.0 * math.pi, count + 1)
        result: Complex = centre + rx * np.cos(angle) + 1j * ry * np.sin(angle)
        return result

    def _path(self, text: str) -> Iterator[Complex]:
        """Yield the parts of a path."""
        svgpathtools: Any = import_module("svgpathtools")  # The import takes 0.5 s.

        if len(text) > TEXT_MAX:
            raise DrawingError(f"{self.curves.source}: a path is too long; split it")
        for part in svgpathtools.parse_path(text).continuous_subpaths():
            lines = [self._piece(piece) for piece in part]
            if lines:
                yield np.concatenate([lines[0][:1], *(z[1:] for z in lines)])

    def _piece(self, piece: Any) -> Complex:
        """Return the points of a line, an arc or a curve."""
        if type(piece).__name__ == "Line":
            return np.array([piece.start, piece.end], complex)
        rough = np.array([piece.point(t) for t in np.linspace(0.0, 1.0, CURVE_POINTS)])
        turns = np.angle(np.diff(rough)[1:] * np.conj(np.diff(rough)[:-1]))
        angle = max(float(np.abs(turns).sum()), 1e-6)
        radius = float(np.abs(np.diff(rough)).sum()) / angle
        step = 2.0 * math.acos(max(1.0 - sagitta(radius, self.tolerance) / radius, -1.0))
        count = min(PIECES_MAX, max(2, math.ceil(1.5 * angle / max(step, 1e-4))))
        z: Complex = np.array([piece.point(t) for t in np.linspace(0.0, 1.0, count + 1)], complex)
        return z


def _numbers(element: ElementTree.Element) -> Any:
    """Return a function from the name of an attribute to its number, 0 without one."""

    def value(name: str) -> float:
        found = NUMBER.match(element.get(name, "0").strip())
        return float(found[0]) if found else 0.0

    return value


def _matrix(text: str) -> Real:
    """Return the matrix of a transformation.

    Examples
    --------
    >>> _matrix("translate(1 2) scale(3)")[:2].tolist()
    [[3.0, 0.0, 1.0], [0.0, 3.0, 2.0]]
    """
    matrix: Real = np.eye(3)
    for name, arguments in TRANSFORM.findall(text[:4000]):
        x = [float(n) for n in NUMBER.findall(arguments)]
        matrix = matrix @ _single(name, [*x, *[0.0] * 6], len(x))
    return matrix


def _single(name: str, x: list[float], given: int) -> Real:
    """Return the matrix of one transformation."""
    if name == "matrix":
        return np.array([[x[0], x[2], x[4]], [x[1], x[3], x[5]], [0.0, 0.0, 1.0]])
    if name == "translate":
        return np.array([[1.0, 0.0, x[0]], [0.0, 1.0, x[1]], [0.0, 0.0, 1.0]])
    if name == "scale":
        return np.diag([x[0], x[1] if given > 1 else x[0], 1.0])
    if name == "rotate":
        c, s = math.cos(math.radians(x[0])), math.sin(math.radians(x[0]))
        turned = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        shift = _single("translate", [x[1], x[2]], 2)
        back = _single("translate", [-x[1], -x[2]], 2)
        result: Real = shift @ turned @ back
        return result
    if name in ("skewX", "skewY"):
        slope = math.tan(math.radians(x[0]))
        skew: Real = np.eye(3)
        skew[(0, 1) if name == "skewX" else (1, 0)] = slope
        return skew
    return np.eye(3)
