"""Random mechanisms that can be cut from a plate, and their drawings as lines and arcs."""

from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import ezdxf
import numpy as np
import shapely

from prbm.cad.outline import Outline, outline
from prbm.files.schema import MechanismTable, mechanism
from prbm.mechanism.description import Mechanism
from prbm.mechanism.parts import value

THICKNESS, DENSITY, MODULUS = 8e-3, 7850.0, 200e9
NOISE = 1e-7  # m; of the ends of lines and arcs.


class Design:
    """A random mechanism, drawn upright in mm, then mirrored and turned."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.rng = rng
        self.flip = bool(rng.integers(2))
        choice = rng.integers(4)
        angle = (0.0, 90.0, float(rng.integers(-12, 13) * 15), float(rng.uniform(-180, 180)))
        self.turn = np.exp(1j * np.radians(angle[choice]))
        self.ground: dict[str, Any] = {}
        self.bodies: dict[str, Any] = {}
        self.types: list[dict[str, Any]] = []
        self.flexures: list[dict[str, Any]] = []

    def place(self, z: complex) -> list[str]:
        """Return a point as drawn."""
        z = self.turn * (z.conjugate() if self.flip else z)
        return [f"{z.real:.9f} mm", f"{z.imag:.9f} mm"]

    def body(self, name: str, x0: float, y0: float, x1: float, y1: float) -> None:
        """Add a rectangular body."""
        corners = [complex(x0, y0), complex(x1, y0), complex(x1, y1), complex(x0, y1)]
        self.bodies[name] = {
            "name": name,
            "outline": [self.place(z) for z in corners],
            "thickness": THICKNESS,
            "density": DENSITY,
            "points": {},
        }

    def kind(self, name: str, length: float, kinds: tuple[str, ...]) -> str:
        """Add a random flexure type of a length; return its name."""
        rng = self.rng
        kind = str(rng.choice(kinds))
        t = float(np.round(rng.uniform(0.1, 0.6), 2))
        table = {"name": name, "model": "beam", "axial": True, "width": THICKNESS}
        table |= {"youngs_modulus": MODULUS, "density": DENSITY, "thickness": f"{t} mm"}
        if kind == "taper":
            end = round(t * float(rng.uniform(1.3, 2.5)), 3)
            table |= {"profile": "taper", "end_thickness": f"{end} mm"}
        elif kind == "fillet":
            r = round(float(rng.uniform(0.3, 1.5)), 2)
            table |= {"profile": "notch", "notch_radius": f"{r} mm"}
            table["waist_length"] = f"{length - 2 * r} mm"
        elif kind in ("notch", "ellipse"):
            table |= {"profile": "notch", "notch_radius": f"{length / 2} mm"}
            if kind == "ellipse":
                table["notch_depth"] = f"{round(length / 2 * float(rng.uniform(0.4, 0.8)), 2)} mm"
        elif kind == "arc":
            curvature = float(rng.uniform(0.2, 0.8)) / length * 1e3 * float(rng.choice([-1, 1]))
            table["curvature"] = -curvature if self.flip else curvature
        elif kind == "rise":
            rise = length * float(rng.uniform(0.05, 0.12))
            table["rise"] = -rise / 1e3 if self.flip else rise / 1e3
            self.rise = rise
        self.types.append(table)
        return name

    def flexure(self, kind: str, start: tuple[str, complex], end: tuple[str, complex]) -> None:
        """Add a flexure of a type between points of bodies or of the ground."""
        name = f"f{len(self.flexures)}"
        for owner, z in (start, end):
            points = self.ground if owner == "ground" else self.bodies[owner]["points"]
            points[name] = self.place(z)
        self.flexures.append(
            {"name": name, "type": kind, "start": f"{start[0]}.{name}", "end": f"{end[0]}.{name}"}
        )

    def mechanism(self) -> Mechanism:
        """Return the mechanism."""
        data = {
            "name": "Random",
            "title": "Random",
            "ground": self.ground,
            "bodies": [*self.bodies.values()],
            "flexure_types": self.types,
            "flexures": self.flexures,
            "release": {"body": next(iter(self.bodies))},
        }
        return mechanism(MechanismTable.model_validate(data))


BEAMS = ("leaf", "leaf", "fillet", "taper")


def guide(d: Design) -> None:
    """Add a stage on two to four parallel flexures."""
    L = float(d.rng.integers(20, 61))
    count, pitch = int(d.rng.integers(2, 5)), float(d.rng.uniform(12, 30))
    d.body("stage", -6, L, (count - 1) * pitch + 6, L + float(d.rng.uniform(8, 20)))
    kind = d.kind("leaf", L, (*BEAMS, "arc"))
    for k in range(count):
        d.flexure(kind, ("ground", k * pitch + 0j), ("stage", complex(k * pitch, L)))


def tilted(d: Design) -> None:
    """Add a stage on two inclined flexures, a remote centre of rotation."""
    L, half = float(d.rng.integers(25, 51)), float(d.rng.uniform(12, 25))
    lean = float(d.rng.uniform(-6, 8))
    d.body("stage", -half - 15, L, half + 15, L + float(d.rng.uniform(8, 20)))
    kind = d.kind("leaf", abs(complex(lean, L)), BEAMS)
    for side in (-1, 1):
        d.flexure(
            kind, ("ground", complex(side * (half + lean), 0)), ("stage", side * half + 1j * L)
        )


def series(d: Design) -> None:
    """Add a stage on two flexures on a bar on two other flexures."""
    L1, L2 = (float(x) for x in d.rng.integers(20, 41, 2))
    half, bar = float(d.rng.uniform(12, 25)), float(d.rng.uniform(6, 10))
    d.body("stage", -half - 8, L1 + bar + L2, half + 8, L1 + bar + L2 + 14)
    d.body("bar", -half - 8, L1, half + 8, L1 + bar)
    lower, upper = d.kind("lower", L1, BEAMS), d.kind("upper", L2, BEAMS)
    inner = half * float(d.rng.uniform(0.4, 0.9))
    for side in (-1, 1):
        d.flexure(lower, ("ground", side * half + 0j), ("bar", complex(side * half, L1)))
        d.flexure(
            upper,
            ("bar", complex(side * inner, L1 + bar)),
            ("stage", complex(side * inner, L1 + bar + L2)),
        )


def folded(d: Design) -> None:
    """Add a stage below the ground, on a truss above it."""
    L1, extra = float(d.rng.integers(20, 41)), float(d.rng.integers(15, 31))
    inner, outer = float(d.rng.uniform(8, 12)), float(d.rng.uniform(22, 35))
    d.body("truss", -outer - 6, L1, outer + 6, L1 + 8)
    d.body("stage", -outer - 6, -extra - 10, outer + 6, -extra)
    short, long = d.kind("short", L1, BEAMS), d.kind("long", L1 + extra, BEAMS)
    for side in (-1, 1):
        d.flexure(short, ("ground", side * inner + 0j), ("truss", complex(side * inner, L1)))
        d.flexure(
            long, ("stage", complex(side * outer, -extra)), ("truss", complex(side * outer, L1))
        )


def notches(d: Design) -> None:
    """Add a four-bar of four notches, two legs and a stage."""
    R, leg, half = float(d.rng.uniform(2, 5)), float(d.rng.uniform(20, 50)), 30.0
    kind = d.kind("notch", 2 * R, ("notch", "ellipse"))
    w = 2 * R + 3
    d.body("stage", -half - w, 4 * R + leg, half + w, 4 * R + leg + 14)
    for name, x in (("left", -half), ("right", half)):
        d.body(name, x - w, 2 * R, x + w, 2 * R + leg)
        d.flexure(kind, ("ground", x + 0j), (name, complex(x, 2 * R)))
        d.flexure(kind, (name, complex(x, 2 * R + leg)), ("stage", complex(x, 4 * R + leg)))


def rotary(d: Design) -> None:
    """Add a square hub on four flexures around it."""
    L, half = float(d.rng.integers(20, 41)), float(d.rng.uniform(6, 12))
    d.body("hub", -half, -half, half, half)
    kind = d.kind("leaf", L, BEAMS)
    for k in range(int(d.rng.integers(3, 5))):
        out = 1j**k
        d.flexure(kind, ("ground", (half + L) * out), ("hub", half * out))


def bistable(d: Design) -> None:
    """Add a shuttle on four raised beams."""
    L, apart = float(d.rng.integers(25, 46)), float(d.rng.uniform(14, 20))
    kind = d.kind("left", L, ("rise",))
    rise = d.rise
    d.types.append(d.types[0] | {"name": "right", "rise": -d.types[0]["rise"]})
    d.body("shuttle", -8, -apart / 2 - 6 + rise, 8, apart / 2 + 6 + rise)
    for y in (-apart / 2, apart / 2):
        d.flexure(kind, ("ground", complex(-8 - L, y)), ("shuttle", complex(-8, y + rise)))
        d.flexure("right", ("ground", complex(8 + L, y)), ("shuttle", complex(8, y + rise)))


FAMILIES = (guide, tilted, series, folded, notches, rotary, bistable)


def random_mechanism(seed: int) -> tuple[str, Mechanism]:
    """Return the family and a random mechanism that can be cut from a plate."""
    design = Design(np.random.default_rng(seed))
    family = FAMILIES[seed % len(FAMILIES)]
    family(design)
    return family.__name__, design.mechanism()


# --- drawings as lines and arcs -------------------------------------------------------------------


def circles(known: Mechanism) -> Iterator[tuple[complex, float]]:
    """Yield centre and radius of the arcs of circular notches and fillets [m]."""
    values = known.values()
    for flexure in known.flexures:
        kind = known.type_of(flexure)
        if kind.notch_radius is None or kind.notch_depth is not None:
            continue
        a, b = (complex(*map(float, known.point(end, ""))) for end in (flexure.start, flexure.end))
        along = (b - a) / abs(b - a)
        r, t = value(kind, "notch_radius", values), value(kind, "thickness", values)
        waist = value(kind, "waist_length", values) if kind.waist_length is not None else 0.0
        for end in {-waist / 2, waist / 2}:
            for side in (-1, 1):
                yield (a + b) / 2 + end * along + side * 1j * along * (t / 2 + r), r


def pieces(drawn: Outline, known: Mechanism) -> Iterator[tuple[np.ndarray, complex | None]]:
    """Yield the two ends and an inner point of lines and arcs, with the centre of an arc."""
    found = [*circles(known)]
    for part in shapely.get_parts(drawn.plate):
        for ring in (part.exterior, *part.interiors):
            z = np.array(shapely.simplify(ring, 1e-10).coords) @ [1, 1j]
            on = [_circle_of(a, b, found) for a, b in pairwise(z)]
            shift = next((k for k, c in enumerate(on) if c is None), 0)
            z, on = np.append(np.roll(z[:-1], -shift), z[shift]), on[shift:] + on[:shift]
            k = 0
            while k < len(on):
                last = k
                while on[k] is not None and last + 1 < len(on) and on[last + 1] == on[k]:
                    last += 1
                yield z[[k, last + 1, (k + last + 1) // 2]], on[k]
                k = last + 1


def _circle_of(a: complex, b: complex, found: list[tuple[complex, float]]) -> complex | None:
    """Return the centre of the circle on which two neighbouring corners lie."""
    for centre, r in found:
        near = all(abs(abs(z - centre) - r) < 1e-9 for z in (a, b))
        if near and abs(b - a) < 0.3 * r:
            return centre
    return None


def draw(path: Path, known: Mechanism, seed: int) -> float:
    """Write the drawing of a mechanism: shuffled, noisy, in mm or inches; return its unit [m]."""
    rng = np.random.default_rng(seed)
    drawn = outline(known)
    inches = bool(rng.integers(2))
    factor = 1 / 0.0254 if inches else 1e3
    document = ezdxf.new(str(rng.choice(["R12", "R2000", "R2018"])))
    document.header["$INSUNITS"] = 1 if inches else 4
    space = document.modelspace()
    every = [*pieces(drawn, known)]
    for k in rng.permutation(len(every)):
        (*ends, inner), centre = every[k]
        ends = np.array(ends)
        ends = ends + NOISE * rng.uniform(-1, 1, 2) + 1j * NOISE * rng.uniform(-1, 1, 2)
        if centre is None:
            ends = factor * (ends[::-1] if rng.integers(2) else ends)
            space.add_line(*((z.real, z.imag) for z in ends))
            continue
        radius = float(np.abs(ends - centre).mean())
        start, end = np.degrees(np.angle(ends - centre))
        if (end - start) % 360.0 < (np.degrees(np.angle(inner - centre)) - start) % 360.0:
            start, end = end, start
        c = factor * centre
        space.add_arc((c.real, c.imag), factor * radius, start, end)
    for z in drawn.ground:
        space.add_point((factor * z.real, factor * z.imag), dxfattribs={"layer": "ground"})
    document.saveas(path)
    return 0.0254 if inches else 1e-3
