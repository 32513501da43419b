"""Outlines of plates with known mechanisms, and their drawings."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import ezdxf
import numpy as np
import shapely

Geometry = shapely.Polygon | shapely.MultiPolygon


def box(x0: float, y0: float, x1: float, y1: float) -> shapely.Polygon:
    """Return a rectangle between two corners."""
    return shapely.box(min(x0, x1), min(y0, y1), max(x0, x1), max(y0, y1))


def disc(z: complex, radius: float, height: float | None = None) -> shapely.Polygon:
    """Return a disc, or an ellipse with a height, of many corners on it."""
    angle = np.linspace(0.0, 2.0 * np.pi, 721)[:-1]
    height = radius if height is None else height
    return polygon(z + radius * np.cos(angle) + 1j * height * np.sin(angle))


def polygon(z: Sequence[complex] | np.ndarray) -> shapely.Polygon:
    """Return a polygon from its corners."""
    z = np.asarray(z, complex)
    return shapely.Polygon(np.column_stack([z.real, z.imag]))


def strip(z: np.ndarray, thickness: float) -> shapely.Polygon:
    """Return the strip of a thickness along a line of points."""
    along = np.gradient(z)
    normal = 0.5j * thickness * along / np.abs(along)
    return polygon([*(z + normal), *(z - normal)[::-1]])


def framed_stage(thickness: float = 0.4, leaves: Sequence[float] = (32.0, 68.0)) -> Geometry:
    """Return a stage on leaves of 30 mm in a frame, in mm, symmetric about x = 50 and y = 40."""
    plate = box(-10, -10, 110, 90).difference(box(0, 0, 100, 80)).union(box(30, 30, 70, 50))
    for x in leaves:
        for low, high in ((0, 30), (50, 80)):
            plate = plate.union(box(x - thickness / 2, low - 1, x + thickness / 2, high + 1))
    return plate


def between_blocks(flexure: Geometry, length: float, across: float = 20.0) -> Geometry:
    """Return a vertical flexure from y = 0 to a length, between two blocks."""
    lower, upper = box(-across, -20, across, 0), box(-across, length, across, length + 20)
    return shapely.unary_union([flexure, lower, upper])


def notched(thickness: float, radius: float, depth: float | None = None) -> Geometry:
    """Return a notch of two half ellipses from y = 0 to 2 radius between two blocks."""
    depth = radius if depth is None else depth
    edge = 0.5 * thickness + depth
    neck = box(-edge, -1, edge, 2 * radius + 1)
    for side in (-1, 1):
        neck = neck.difference(disc(complex(side * edge, radius), depth, radius))
    return between_blocks(neck, 2 * radius)


def filleted(thickness: float, length: float, radius: float) -> Geometry:
    """Return a leaf of a length between two blocks, with fillets at both ends."""
    edge = 0.5 * thickness + radius
    leaf = box(-edge, -1, edge, length + 1)
    for side in (-1, 1):
        cut = [disc(complex(side * edge, y), radius) for y in (radius, length - radius)]
        cut.append(box(side * edge, radius, side * thickness / 2, length - radius))
        leaf = leaf.difference(shapely.unary_union(cut))
    return between_blocks(leaf, length)


def write(path: Path, plate: Geometry, version: str = "R2010", unit: int = 4) -> Path:
    """Write the outline of a plate as a DXF file of closed polylines; return its path."""
    document = ezdxf.new(version, units=unit)
    space = document.modelspace()
    for part in shapely.get_parts(plate):
        for ring in (part.exterior, *part.interiors):
            space.add_polyline2d(list(ring.coords)[:-1], close=True)
    document.saveas(path)
    return path


def filleted_stage() -> Geometry:
    """Return the framed stage with fillets of 0.6 mm at the ends of its leaves, in mm."""
    plate = framed_stage(0.4)
    for x in (32, 68):
        for y, into in ((0, 1), (30, -1), (50, 1), (80, -1)):
            for side in (-1, 1):
                edge = x + side * 0.2
                corner = box(edge, y, edge + side * 0.6, y + into * 0.6)
                centre = complex(edge + side * 0.6, y + into * 0.6)
                plate = plate.union(corner.difference(disc(centre, 0.6)))
    return plate


def notch_guide(waist: float = 1.0) -> Geometry:
    """Return a stage on two legs with notches of the radius 4 mm, in mm."""
    plate = box(-20, -20, 80, -5).union(box(-8, 65, 68, 80))
    for x in (0, 60):
        half = 4 + waist / 2
        leg = box(x - half, -5, x + half, 65)
        for y in (0, 60):
            for side in (-1, 1):
                leg = leg.difference(disc(complex(x + side * half, y), 4))
        plate = plate.union(leg)
    return plate


def rings(plate: Geometry) -> Iterator[list[tuple[float, float]]]:
    """Yield the corners of all rings of a plate, the first one again at the end."""
    for part in shapely.get_parts(plate):
        for ring in (part.exterior, *part.interiors):
            yield [(float(x), float(y)) for x, y in ring.coords]


def svg(plate: Geometry, head: str, wrap: str = "{}") -> str:
    """Return the text of an SVG file with a plate, y downwards."""
    paths = "".join(
        f'<path d="M {" L ".join(f"{x:.6f},{-y:.6f}" for x, y in ring[:-1])} Z"/>'
        for ring in rings(plate)
    )
    return f'<svg xmlns="http://www.w3.org/2000/svg" {head}>{wrap.format(paths)}</svg>'
