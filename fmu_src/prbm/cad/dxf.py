"""The curves of a DXF file."""

import io
import logging
import math
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ..base import reading
from ..mechanics.arrays import Complex
from .curves import (
    CONSTRUCTION,
    FILE_SIZE_MAX,
    FLATTENING_RTOL,
    GROUND,
    NESTING_MAX,
    STOPS,
    Curves,
    DrawingError,
    diagonal,
    sagitta,
)

UNITS = {  # Length of a unit [m] by $INSUNITS.
    1: 0.0254, 2: 0.3048, 3: 1609.344, 4: 1e-3, 5: 1e-2, 6: 1.0, 7: 1e3, 8: 2.54e-8, 9: 2.54e-5,
    10: 0.9144, 11: 1e-10, 12: 1e-9, 13: 1e-6, 14: 0.1,
}  # fmt: skip
DWG = b"AC10"  # Beginning of a DWG file,
BINARY = b"AutoCAD Binary DXF\r\n\x1a\0"  # and of a binary DXF file.
COPIES_MAX = 1000  # Copies of a block in one array.
SPLINE_SEGMENTS_MIN = 8  # Of each part of a spline between two knots.


def read_dxf(path: Path, unit: float | None, tolerance: float | None) -> Curves:
    """Return the curves in the model space of a DXF file.

    Parameters
    ----------
    path : Path
        The file, of any version from R12.
    unit : float or None
        Length of a unit of the drawing [m]; None: that of the file, millimetres if it has none.
    tolerance : float or None
        Largest distance of curves from their polylines [m]; None: 1e-5 of the diagonal.

    Raises
    ------
    DrawingError
        If the file is not a DXF file, or exceeds a limit.
    """
    content = reading.content(path, FILE_SIZE_MAX, DrawingError)
    document = _document(path, content)
    curves = Curves(str(path))
    code = document.header.get("$INSUNITS", 0)
    if unit is not None:
        curves.unit = unit
    elif code in UNITS:
        curves.unit = UNITS[code]
    else:
        curves.notes.append("the drawing has no unit: millimetres are assumed")
    hidden = {
        layer.dxf.name.lower() for layer in document.layers if layer.is_off() or layer.is_frozen()
    }
    try:
        if tolerance is None:  # The size of the drawing is not known yet.
            draft = replace(curves, found=[], skipped=Counter(), notes=[])
            _Reader(draft, math.inf, hidden).read(document.modelspace(), 0, "0")
            tolerance = FLATTENING_RTOL * diagonal(draft.found)
        _Reader(curves, tolerance / curves.unit, hidden).read(document.modelspace(), 0, "0")
    except DrawingError:
        raise
    except Exception as error:  # ezdxf raises errors of many types for inconsistent entities.
        raise DrawingError(
            f"{path}: an entity is inconsistent ({type(error).__name__}: {error}); save the file "
            "again with a CAD program"
        ) from None
    return curves


def _document(path: Path, content: bytes) -> Any:
    """Return the document of a file; a text is repaired if needed."""
    if content.startswith(DWG):
        raise DrawingError(f"{path}: it is a DWG file; export the drawing as DXF")
    import ezdxf.recover  # imported here because the import takes 0.3 s
    from ezdxf.document import Drawing
    from ezdxf.lldxf.tagger import binary_tags_loader

    logging.getLogger("ezdxf").setLevel(logging.CRITICAL)  # Repairs of the file.
    try:
        if content.startswith(BINARY):
            return Drawing.load(binary_tags_loader(content))
        return ezdxf.recover.read(io.BytesIO(content))[0]
    except Exception as error:  # Among them DXFError, ValueError, IndexError, RecursionError.
        raise DrawingError(
            f"{path}: not a DXF file ({type(error).__name__}: {error}); export the drawing as DXF"
        ) from None


class _Reader:
    """Reads entities, and those of blocks."""

    def __init__(self, curves: Curves, tolerance: float, hidden: set[str]) -> None:
        self.curves, self.tolerance, self.hidden = curves, tolerance, hidden

    def read(self, entities: Iterable[Any], depth: int, layer: str) -> None:
        """Read entities of a layout, or of a block on a layer."""
        for entity in entities:
            self.curves.count()
            name = entity.dxf.get("layer", "0")
            name = layer if name == "0" else name
            if name.lower() in self.hidden:
                self.curves.skipped[f"{entity.dxftype()} on a hidden layer"] += 1
            else:
                self._entity(entity, depth, name)

    def _entity(self, entity: Any, depth: int, layer: str) -> None:
        kind = entity.dxftype()
        if kind == "INSERT":
            self._block(entity, depth, layer)
        elif kind in ("LWPOLYLINE", "POLYLINE"):
            if kind == "POLYLINE" and not (entity.is_2d_polyline or entity.is_3d_polyline):
                self.curves.skipped[kind] += 1
            else:
                self._polyline(entity, layer)
        elif kind == "POINT":
            if layer.lower() in (GROUND, STOPS):
                self._add(layer, _complex([entity.dxf.location]))
        else:
            z = self._points(entity, kind)
            if z is not None:
                self._add(layer, z)
            elif layer.lower() != CONSTRUCTION:
                self.curves.skipped[kind] += 1

    def _points(self, entity: Any, kind: str) -> Complex | None:
        """Return the points of a line or curve; None for other entities."""
        if kind == "LINE":
            return _complex([entity.dxf.start, entity.dxf.end])
        if kind in ("ARC", "CIRCLE"):
            radius = abs(entity.dxf.radius)
            if not radius > 0.0:
                return np.zeros(0, complex)
            return _complex(entity.flattening(sagitta(radius, self.tolerance)))
        if kind == "ELLIPSE":
            return _complex(entity.flattening(self._least(entity), 8))
        if kind == "SPLINE":
            return _complex(entity.flattening(self.tolerance, SPLINE_SEGMENTS_MIN))
        return None

    def _least(self, ellipse: Any) -> float:
        """Return the tolerance of an ellipse, that of its largest curvature radius at most."""
        major = float(ellipse.dxf.major_axis.magnitude)
        return sagitta(major * float(ellipse.dxf.ratio), self.tolerance)

    def _polyline(self, entity: Any, layer: str) -> None:
        """Read a polyline, whose sides may be arcs (bulges)."""
        sides = [self._points(side, side.dxftype()) for side in entity.virtual_entities()]
        self._add(layer, joined([z for z in sides if z is not None and len(z)]))

    def _block(self, entity: Any, depth: int, layer: str) -> None:
        """Read the entities of a block, and of its copies in an array."""
        if depth >= NESTING_MAX:
            raise DrawingError(
                f"{self.curves.source}: blocks are nested more than {NESTING_MAX} deep; explode "
                "them"
            )
        if entity.mcount > COPIES_MAX:
            raise DrawingError(
                f"{self.curves.source}: a block has {entity.mcount} copies in an array; the limit "
                f"is {COPIES_MAX}"
            )
        if entity.dxf.get("zscale", 1.0) == 0.0:  # Flat blocks, which ezdxf cannot place.
            entity.dxf.zscale = 1.0
        for one in entity.multi_insert() if entity.mcount > 1 else [entity]:
            self.read(one.virtual_entities(), depth + 1, layer)

    def _add(self, layer: str, z: Complex) -> None:
        if len(z):
            self.curves.add(layer, z)


def _complex(points: Iterable[Any]) -> Complex:
    """Return points in the plane as complex numbers."""
    return np.array([complex(point[0], point[1]) for point in points], complex)


def joined(sides: Sequence[Complex]) -> Complex:
    """Return one line through sides in order, each of which may have either direction.

    Examples
    --------
    >>> joined([np.array([1.0, 0.0]), np.array([1.0, 2.0])]).real.tolist()
    [0.0, 1.0, 2.0]
    """
    if not sides or not np.isfinite(np.concatenate(sides)).all():  # Curves rejects NaN later.
        return np.concatenate([np.zeros(0, complex), *sides])
    first = sides[0]
    if len(sides) > 1:
        start, end = (float(np.abs(sides[1][[0, -1]] - z).min()) for z in (first[0], first[-1]))
        first = first[::-1] if start < end else first
    parts, last = [first], first[-1]
    for z in sides[1:]:
        z = z[::-1] if abs(z[-1] - last) < abs(z[0] - last) else z
        parts.append(z[1:])
        last = z[-1]
    return np.concatenate(parts)
