"""The outline of a mechanism as a DXF file."""

import io
import re
from importlib import import_module
from typing import Any

import numpy as np
import shapely

from ..base.unit_text import length_unit
from .curves import GROUND, STOPS
from .outline import Outline

CODES = {"m": 6, "mm": 4, "µm": 13, "nm": 12}  # $INSUNITS
VERSION = "R2000"  # The oldest version with polylines of one entity.
STRAIGHT_RTOL = 1e-9  # Corners nearer to the line of their neighbours are left out.


def dxf(drawn: Outline) -> bytes:
    """Return a DXF file: closed polylines on the layer ``outline``, ground and stops as marks.

    Parameters
    ----------
    drawn : Outline
        The outline.
    """
    ezdxf: Any = import_module("ezdxf")  # The import takes 0.3 s.

    bounds = drawn.plate.bounds
    size = float(np.hypot(bounds[2] - bounds[0], bounds[3] - bounds[1]))
    factor, name = length_unit(size)
    document = ezdxf.new(VERSION, units=CODES[name])
    for layer, colour in (("outline", 7), (GROUND, 8), (STOPS, 1)):
        document.layers.add(layer, color=colour)
    space: Any = document.modelspace()
    for part in shapely.get_parts(drawn.plate):
        for ring in (part.exterior, *part.interiors):
            simple = shapely.simplify(ring, STRAIGHT_RTOL * size)
            corners = (np.array(simple.coords)[:-1] * factor).tolist()
            space.add_lwpolyline(corners, close=True, dxfattribs={"layer": "outline"})
    for z in drawn.ground:
        space.add_point((z.real * factor, z.imag * factor), dxfattribs={"layer": GROUND})
    for line in drawn.stops:
        ends = [(z.real * factor, z.imag * factor) for z in line]
        space.add_line(*ends, dxfattribs={"layer": STOPS})
    text = io.StringIO()
    document.write(text)
    return _without_dates(text.getvalue()).encode("utf-8")


def _without_dates(text: str) -> str:
    """Return a DXF file without dates and random numbers: equal outlines give equal bytes."""
    for name in ("TDCREATE", "TDUPDATE", "TDUCREATE", "TDUUPDATE"):
        text = re.sub(rf"(\${name}\n *40\n)[^\n]*", r"\g<1>2451545.0", text)
    zero = "{00000000-0000-0000-0000-000000000000}"
    for name in ("FINGERPRINTGUID", "VERSIONGUID"):
        text = re.sub(rf"(\${name}\n *2\n)[^\n]*", rf"\g<1>{zero}", text)
    return re.sub(r"(\d\.\d\.\d[^\n]* @ )[^\n]*", r"\g<1>2000-01-01", text)
