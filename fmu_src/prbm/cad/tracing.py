"""Thin parts of a plate, traced along their centre lines from a chord in both directions.

At each step the walls on both sides are met by a ray across the centre line.  A thin part ends
where a wall turns away by a corner, or where it becomes as thick as its surroundings.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import Enum

import numpy as np

from ..mechanics.arrays import Complex, Real
from .walls import Hit, Walls

FIRST_STEP = 0.25  # First step over the thickness.
STEP_GROWTH = 1.6  # Growth of a step after a smooth one.
STEP_MAX = 20.0  # Largest step over the thickness.
STEP_MIN = 2e-4  # Smallest step over the thickness: the resolution of an end.
SMOOTH = 0.1  # Largest change of a wall's advance over a step, for steps of a thickness and more.
WALL_MAX = 4.0  # Largest advance of a wall over a step, unless the step is the smallest.
STEEP_WALL = 0.1  # Largest advance of a steep wall in a step, over the thickness.
CORNER = 40.0  # Largest advance of a wall over the smallest step; more is a corner.
KINK = math.cos(math.radians(30.0))  # Of the largest turn of a smooth wall in a step.
STEEP = 0.35  # Change of the thickness over a step, from which the line continues straight.
FLAT = 0.1  # Change below which a part is uniform again after a steep one.
WIDTH_CHANGE_MAX = 0.1  # Largest change of the thickness in a step, as a share.
BEYOND = 0.01  # Where the width beyond an end is measured, over the thickness.
LATE_MAX = 2.0  # Farthest end of the second wall behind that of the first, over the thickness.
STEPS_MAX = 4000  # Steps of a trace in one direction,
STEPS_TOTAL_MAX = 150_000  # and of all traces of a plate.
CENTRINGS = 4  # Iterations that place the first chord across the walls.
CHORD_ANGLE = math.radians(3.0)  # Between the chords that are compared.
LINED = math.cos(math.radians(5.0))  # Of the largest turn of a line that counts as straight.
BASELINE = 2.0  # Length of a line over its thickness, from which it has a direction.


class End(Enum):
    """Why a thin part ends."""

    CORNER = "a corner"
    THICK = "a uniform thicker part"
    NARROWS = "a thinner part"
    TIP = "a free tip"
    LONG = "too many steps"


@dataclass
class Half:
    """A trace in one direction."""

    z: list[complex] = field(default_factory=list)
    width: list[float] = field(default_factory=list)
    left: list[Hit] = field(default_factory=list)
    right: list[Hit] = field(default_factory=list)
    tangent: complex = 1.0
    end: End = End.LONG
    late: float = 0.0  # How much later the second wall ends [m].


@dataclass(frozen=True)
class Trace:
    """A thin part of a plate.

    Parameters
    ----------
    z : (n,) complex
        Points of the centre line in order [m].
    width : (n,)
        Thickness at these points [m].
    left, right : list of Hit
        Where its walls are met, seen from the start to the end.
    tangents : pair of complex
        Directions out of the part at its start and its end.
    ends : pair of End
        Why it ends.
    late : pair of float
        How far one wall reaches beyond the end of the other one: the end is oblique [m].
    """

    z: Complex
    width: Real
    left: list[Hit]
    right: list[Hit]
    tangents: tuple[complex, complex]
    ends: tuple[End, End]
    late: tuple[float, float] = (0.0, 0.0)

    @property
    def length(self) -> float:
        """Length of the centre line [m]."""
        return float(np.abs(np.diff(self.z)).sum())

    @property
    def thinnest(self) -> float:
        """Smallest thickness [m]."""
        return float(self.width.min())

    @property
    def compliance(self) -> float:
        """Rotation of one end about the other under a moment, times E b/12 [1/m^2]."""
        ds = np.abs(np.diff(self.z))
        inverse = self.width**-3
        return float((0.5 * (inverse[1:] + inverse[:-1])) @ ds)

    def edges(self, walls: Walls) -> tuple[Complex, Complex]:
        """Return the left and the right wall with all their corners, in order [m]."""
        return (
            _wall(walls, self.left[-1], self.left[0])[::-1],
            _wall(walls, self.right[0], self.right[-1]),
        )


def _wall(walls: Walls, first: Hit, last: Hit) -> Complex:
    """Return the points of a ring from one hit to another, along its direction."""
    ring = walls.ring[first.side]
    whole = float(walls.perimeter[ring])
    mine = np.flatnonzero(walls.ring == ring)
    reach = (last.place - first.place) % whole
    ahead = (walls.start[mine] - first.place) % whole
    order = np.argsort(ahead)
    inside = order[(ahead[order] > 0.0) & (ahead[order] < reach)]
    points = walls.a[mine][inside]
    return np.concatenate([[_point(walls, first)], points, [_point(walls, last)]])


def _point(walls: Walls, hit: Hit) -> complex:
    share = (hit.place - walls.start[hit.side]) / walls.length[hit.side]
    return complex(walls.a[hit.side] + share * (walls.b[hit.side] - walls.a[hit.side]))


class Tracer:
    """Traces thin parts of a plate.

    Parameters
    ----------
    walls : Walls
        The walls of the plate.
    """

    def __init__(self, walls: Walls) -> None:
        self.walls = walls
        self.steps = 0  # Of all traces.
        self._reach = 0.1 * walls.size
        self.taken: dict[int, list[tuple[float, float]]] = {}

    def parts(self, longest: float) -> Iterator[Trace]:
        """Yield the thin parts, the thinnest first, each once.

        Parameters
        ----------
        longest : float
            Largest thickness of a part at its thinnest place [m].
        """
        chords = self.walls.chords(longest)
        for k in range(len(chords.z)):
            if self.steps > STEPS_TOTAL_MAX:
                return
            if self.is_taken(int(chords.ring[k]), float(chords.place[k])):
                continue
            self._reach = 4.0 * float(chords.length[k])
            middle = complex(chords.z[k] + 0.5 * chords.length[k] * chords.normal[k])
            trace = self.trace(middle, complex(-1j * chords.normal[k]))
            if trace is not None:
                self.take(trace)
                yield trace

    def is_taken(self, ring: int, place: float) -> bool:
        """Return whether a place of a wall belongs to a part that was traced."""
        whole = float(self.walls.perimeter[ring])
        return any((place - a) % whole <= (b - a) % whole for a, b in self.taken.get(ring, ()))

    def take(self, trace: Trace) -> None:
        """Mark the walls of a part."""
        for first, last in ((trace.left[-1], trace.left[0]), (trace.right[0], trace.right[-1])):
            ring = int(self.walls.ring[first.side])
            self.taken.setdefault(ring, []).append((first.place, last.place))

    def trace(self, z: complex, tangent: complex) -> Trace | None:
        """Return the thin part around a point; None if the walls there are not opposite."""
        for _ in range(CENTRINGS):
            pair = self._across(z, tangent)
            if pair is None:
                return None
            left, right = pair
            z += 0.5j * tangent * (left.distance - right.distance)
            tangent = self._along(left, right, tangent)
        tangent = self._shortest(z, tangent)
        if self._across(z, tangent) is None:
            return None
        ahead, behind = (self._half(z, sign * tangent) for sign in (1.0, -1.0))
        return (
            Trace(
                np.array([*behind.z[:0:-1], *ahead.z]),
                np.array([*behind.width[:0:-1], *ahead.width]),
                [*behind.right[:0:-1], *ahead.left],
                [*behind.left[:0:-1], *ahead.right],
                (behind.tangent, ahead.tangent),
                (behind.end, ahead.end),
                (behind.late, ahead.late),
            )
            if len(ahead.z) + len(behind.z) > 2
            else None
        )

    def _shortest(self, z: complex, tangent: complex) -> complex:
        """Return the direction across the shortest chord, which walls of short sides hide.

        A parabola through the lengths of three chords has its minimum there.
        """
        for _ in range(CENTRINGS):
            lengths = []
            for angle in (-CHORD_ANGLE, 0.0, CHORD_ANGLE):
                pair = self._across(z, tangent * np.exp(1j * angle))
                if pair is None:
                    return tangent
                lengths.append(pair[0].distance + pair[1].distance)
            curved = lengths[0] - 2.0 * lengths[1] + lengths[2]
            if not curved > 0.0:
                return tangent
            angle = 0.5 * CHORD_ANGLE * (lengths[0] - lengths[2]) / curved
            tangent *= complex(np.exp(1j * np.clip(angle, -CHORD_ANGLE, CHORD_ANGLE)))
        return tangent

    def _across(self, z: complex, tangent: complex) -> tuple[Hit, Hit] | None:
        """Return where the walls on the left and on the right are met."""
        left = self.walls.hit(z, 1j * tangent, self._reach)
        right = self.walls.hit(z, -1j * tangent, self._reach)
        return None if left is None or right is None else (left, right)

    def _along(self, left: Hit, right: Hit, tangent: complex) -> complex:
        """Return the direction between those of the walls."""
        normals = self.walls.normal
        along = complex(-1j * (normals[right.side] - normals[left.side]))
        return along / abs(along) if abs(along) > 1.0 else tangent

    def _half(self, z: complex, tangent: complex) -> Half:
        """Return the trace in one direction."""
        left, right = self._across(z, tangent) or (Hit(0, 0, 0), Hit(0, 0, 0))
        width = left.distance + right.distance
        half = Half([z], [width], [left], [right], tangent)
        thinnest, steep = width, False
        step = FIRST_STEP * width
        for _ in range(STEPS_MAX):
            self.steps += 1
            smallest = step <= STEP_MIN * thinnest
            found = self._step(half, step, thinnest, smallest=smallest, steep=steep)
            if found is None:
                if not smallest:
                    step *= 0.5
                    continue
                self._finish(half, step)
                return half
            z, left, right = found
            new = left.distance + right.distance
            slope = (new - half.width[-1]) / step
            if steep and new > thinnest and slope < FLAT and step < thinnest:
                half.end = End.THICK if slope > -STEEP else End.NARROWS
                return half
            if slope < -STEEP or self._entered(left, right):
                half.end = End.NARROWS
                return half
            if slope > STEEP and not steep:
                steep = True
                half.tangent = self._straight(half, tangent)
            if not steep:
                shift = 0.5 * (left.distance - right.distance)
                z += 1j * half.tangent * shift
                left = Hit(left.distance - shift, left.side, left.place)
                right = Hit(right.distance + shift, right.side, right.place)
                half.tangent = self._along(left, right, half.tangent)
            half.z.append(z)
            half.width.append(new)
            half.left.append(left)
            half.right.append(right)
            thinnest = min(thinnest, new)
            step = min(step * STEP_GROWTH, STEP_MAX * thinnest, self.walls.size / 20)
        return half

    def _straight(self, half: Half, first: complex) -> complex:
        """Return the direction in which a line goes on straight where its walls turn away."""
        line = half.z[-1] - half.z[0]
        if abs(line) < BASELINE * min(half.width):
            return first
        along = line / abs(line)
        return along if (np.conj(along) * first).real > LINED else half.tangent

    def _step(
        self, half: Half, step: float, thinnest: float, *, smallest: bool, steep: bool
    ) -> tuple[complex, Hit, Hit] | None:
        """Return the next point and where its walls are met; None if a wall is not smooth."""
        z = half.z[-1] + step * half.tangent
        pair = self._across(z, half.tangent)
        if pair is None:
            return None
        left, right = pair
        # The material is on the left of the walls: the left wall runs backwards.
        advances = (
            -self.walls.advance(half.left[-1], left),
            self.walls.advance(half.right[-1], right),
        )
        new = left.distance + right.distance
        if smallest:
            limits = 0.0, CORNER
        elif step > 0.5 * thinnest:
            limits = 1.0 - SMOOTH, 1.0 + SMOOTH
        else:
            limits = 0.0, WALL_MAX
        most = limits[1] * step
        if steep:
            most = max(most, STEEP_WALL * thinnest)
        smooth = all(limits[0] * step <= x <= most for x in advances)
        smooth = smooth and not any(map(self._kinked, (half.left[-1], half.right[-1]), pair))
        slow = smallest or abs(new - half.width[-1]) <= WIDTH_CHANGE_MAX * half.width[-1]
        return (z, left, right) if smooth and slow else None

    def _kinked(self, before: Hit, after: Hit) -> bool:
        """Return whether a wall turns by a corner between two hits."""
        one, other = self.walls.normal[before.side], self.walls.normal[after.side]
        return bool((np.conj(one) * other).real < KINK)

    def _entered(self, left: Hit, right: Hit) -> bool:
        """Return whether a wall belongs to another part already."""
        return any(self.is_taken(int(self.walls.ring[h.side]), h.place) for h in (left, right))

    def _finish(self, half: Half, step: float) -> None:
        """Set why a trace ends at a corner, and how much later its second wall ends."""
        pair = self._across(half.z[-1] + step * half.tangent, half.tangent)
        half.end = End.CORNER if pair is not None else End.TIP
        if pair is None:
            return
        beyond = self._across(half.z[-1] + BEYOND * min(half.width) * half.tangent, half.tangent)
        if beyond is not None and sum(hit.distance for hit in beyond) < half.width[-1]:
            half.end = End.NARROWS
            return
        left, right = pair
        goes_on = (
            abs(self.walls.advance(half.left[-1], left)) <= CORNER * step,
            abs(self.walls.advance(half.right[-1], right)) <= CORNER * step,
        )
        if sum(goes_on) == 1:
            half.late = self._late(half, left=goes_on[0])

    def _late(self, half: Half, *, left: bool) -> float:
        """Return how far the wall that goes on reaches beyond the other one; 0 if it is far."""
        turn = 1j * half.tangent if left else -1j * half.tangent
        before = half.left[-1] if left else half.right[-1]
        step, reach, limit = 0.05 * half.width[-1], 0.0, LATE_MAX * half.width[-1]
        while reach < limit and step > STEP_MIN * half.width[-1]:
            after = self.walls.hit(half.z[-1] + (reach + step) * half.tangent, turn, self._reach)
            if after is None:
                return 0.0
            advance = abs(self.walls.advance(before, after))
            if advance <= (1.0 + SMOOTH) * step:
                reach, before = reach + step, after
            else:
                step *= 0.5
        return reach if reach < limit else 0.0
