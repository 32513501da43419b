"""From the drawing of a plate to impacts: a stage on four leaves in a frame.

The script draws the outline of the plate as DXF, as CAD would export it: lines of the frame, the
stage and the leaves, and a line on the layer ``stops``.  It imports the drawing, compares the
fundamental frequency with the formula of four leaves between clamps, and simulates the first
impact.  It writes ``stage.dxf``, ``stage.toml`` and ``stage.png``, the picture to check.
"""

import math
from pathlib import Path

import ezdxf
import numpy as np

import prbm
from prbm.cad.importing import Imported, Options, fundamental, import_drawing
from prbm.plots.drawing_check import check_picture

L, T, DEPTH = 30.0, 0.4, 8.0  # mm; length and thickness of the leaves, thickness of the plate.
WIDTH, HEIGHT = 40.0, 20.0  # mm; of the stage.
LEAVES = (32.0, 68.0)  # mm; positions of the leaves.
GAP = 0.5  # mm; between the stage and its stop.
E, RHO = 200e9, 7850.0  # Pa, kg/m3; of steel.


def outlines() -> list[list[tuple[float, float]]]:
    """Return the outlines of the plate: the frame, and its four windows around the stage [mm]."""
    left = (100 - WIDTH) / 2
    low, high = L, L + HEIGHT
    top = high + L
    a, b = LEAVES
    h = T / 2
    side = [  # The window on the left of the leaves, counter-clockwise.
        (0.0, 0.0), (a - h, 0.0), (a - h, low), (left, low), (left, high), (a - h, high),
        (a - h, top), (0.0, top),
    ]  # fmt: skip
    return [
        [(-10.0, -10.0), (110.0, -10.0), (110.0, top + 10), (-10.0, top + 10)],
        side,
        [(a + b - x, y) for x, y in side],
        [(a + h, 0.0), (b - h, 0.0), (b - h, low), (a + h, low)],
        [(a + h, high), (b - h, high), (b - h, top), (a + h, top)],
    ]


def draw(path: str = "stage.dxf") -> None:
    """Write the drawing."""
    document = ezdxf.new("R2000", units=4)
    space = document.modelspace()
    for ring in outlines():
        for start, end in zip(ring, [*ring[1:], ring[0]], strict=True):
            space.add_line(start, end)
    wall = (100 + WIDTH) / 2 + GAP
    space.add_line((wall, L), (wall, L + HEIGHT), dxfattribs={"layer": "stops"})
    document.saveas(path)


def imported(path: str = "stage.dxf") -> Imported:
    """Return the imported drawing; write its file and its picture."""
    result = import_drawing(path, Options(1e-3 * DEPTH, "steel", ground=(-5, -5)))
    Path("stage.toml").write_text(result.text, encoding="utf-8")
    Path("stage.png").write_bytes(check_picture(result))
    return result


def formula() -> float:
    """Return the frequency of a stage on four leaves of 12 EI/L^3 each, with 13/35 of their mass.

    The mass of a leaf that counts is that of its cubic shape.
    """
    L_, T_, b = 1e-3 * L, 1e-3 * T, 1e-3 * DEPTH
    stiffness = 4 * 12 * E * (b * T_**3 / 12) / L_**3
    mass = RHO * b * (1e-6 * WIDTH * HEIGHT + 4 * 13 / 35 * T_ * L_)
    return math.sqrt(stiffness / mass) / (2 * math.pi)


def main() -> None:
    """Draw, import and simulate; print the frequency beside the formula."""
    draw()
    result = imported()
    found = fundamental(result.mechanism)
    print(f"fundamental frequency {found:.2f} Hz, by the formula {formula():.2f} Hz")
    motion = prbm.simulate(prbm.load("stage.toml"), stop_time=0.02)
    first = motion["time"][np.argmax(motion["stop.impact_count"] > 0)]
    print(f"first impact at {1e3 * first:.2f} ms")
    print(*(str(Path(name)) for name in ("stage.dxf", "stage.toml", "stage.png")))


if __name__ == "__main__":
    main()
