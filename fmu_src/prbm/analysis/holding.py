"""A mechanism held at displacements: force, stiffness, deviation from a straight line, frequency.

The released body is held at its centre of mass or at the released point, along the direction u of
the release.  If the release is by an angle, a moment holds the body at a rotation.  At the
displacement d the holding force is F(d) and the position of the point z(d).  Then

    stiffness = dF/dd,    across = Im(conj(u) (z - z_straight)),

where ``across`` is the error of a straight-line guide.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ..base.progress import Progress
from ..mechanics.arrays import Real, Whole
from ..mechanics.modal import first_acting, modes, moved_by, unstable_directions
from ..mechanics.statics import Equilibrium, equilibrium, holding_stiffness
from ..mechanics.system import System, unit
from .equilibrium_curve import LoadPath, PathPoint
from .load_path import HeldPath, held_path
from .path_following import REST, TURN


@dataclass(frozen=True)
class Held:
    """A shape held by a force.

    Parameters
    ----------
    displacement : float
        Displacement of the released point along the direction of the release, from the straight
        shape [m]; the rotation of its body [rad] if the release is by an angle.
    force : float
        Holding force on the body along that direction [N], or moment [N m]; 0 at a rest position.
    stiffness : float
        Derivative of the force by the displacement [N/m], [N m/rad]; NaN where the loops prevent
        a further motion along that direction.
    across : float
        Displacement of the released point to the left of that direction [m].
    angle : float
        Rotation of the body, counter-clockwise [rad].
    frequency : float
        Fundamental frequency of the free body about the shape, with the force as a constant load
        [Hz]; negative if unstable, NaN if all bodies are free.
    unstable, unstable_held : int
        Numbers of unstable directions of the free body under that load, and of the held one.
    """

    displacement: float
    force: float
    stiffness: float
    across: float
    angle: float
    frequency: float
    unstable: int
    unstable_held: int


def described(system: System, displacement: float, shape: Equilibrium) -> Held:
    """Return a held shape with its stiffness and frequency.

    Parameters
    ----------
    system : System
        The mechanism.
    displacement : float
        Displacement of the released point [m], or rotation of its body [rad].
    shape : Equilibrium
        The shape.
    """
    release = system.mechanism.release
    frame, e = system.released, system.directions(shape.q)
    moved = unit(release.direction).conjugate() * complex(frame.c + frame.A @ e - frame.drawn)
    found = modes(system, shape)
    frequency = found.frequency
    along = moved_by(system, shape.q, found.shape)
    return Held(
        displacement, shape.force, holding_stiffness(system, shape), moved.imag,
        float(shape.q[frame.j]),
        float(frequency[first_acting(system, found)]) if len(frequency) else math.nan,
        unstable_directions(found.frequency), unstable_directions(found.frequency, along),
    )  # fmt: skip


def held(system: System, displacement: float) -> Held:
    """Return the shape in which the released body is held at a displacement.

    Raises
    ------
    EquilibriumError
        If no static shape with this displacement is found.
    """
    return described(system, displacement, equilibrium(system, displacement))


@dataclass(frozen=True)
class RestPosition:
    """A static shape of the mechanism without a holding force.

    Parameters
    ----------
    displacement : float
        Displacement of the released body along the direction of the release, from the straight
        shape [m]; its rotation [rad] if the release is by an angle.
    stable : bool
        Whether the shape is stable.
    shape : Equilibrium
        The shape.
    """

    displacement: float
    stable: bool
    shape: Equilibrium


@dataclass(frozen=True)
class Event:
    """A limit point or a bifurcation of the held shapes.

    Parameters
    ----------
    kind : str
        ``"limit point"``, where the holding force has an extremum; ``"bifurcation"``, where the
        mechanism buckles out of the shapes that are followed; ``"displacement limit"``, where the
        displacement turns back, so that the held mechanism snaps.
    displacement : float
        Displacement [m], or rotation [rad].
    force : float
        Holding force [N], or moment [N m].
    critical : int
        Number of directions that become unstable or stable under a dead load.
    """

    kind: str
    displacement: float
    force: float
    critical: int


@dataclass(frozen=True)
class Branch:
    """Shapes along a path, such as one that branches off at a bifurcation.

    Parameters
    ----------
    displacements, forces : (k,)
        Displacements [m] or rotations [rad], and holding forces [N] or moments [N m].
    unstable : (k,) int
        Numbers of unstable directions under dead loads.
    rests : tuple of RestPosition
        Rest positions, in the order of the path.
    events : tuple of Event
        Limit points and bifurcations, in the order of the path.
    ended : str or None
        Why the path ends within the range; None: it does not.
    """

    displacements: Real
    forces: Real
    unstable: Whole
    rests: tuple[RestPosition, ...]
    events: tuple[Event, ...]
    ended: str | None


@dataclass(frozen=True, repr=False)
class Curve(Branch):
    """The holding force over a range of displacements.

    Parameters
    ----------
    points : tuple of Held
        The points at the given displacements, in the order of the path: at a displacement there are
        several if the path turns back.  The arrays have the other points of the path, too.
    snaps : tuple of (float, float)
        Displacement [m] and holding force [N] at which a growing load that moves the mechanism
        from a stable rest position towards a neighbouring one makes it snap: the first limit point
        or bifurcation.
    branches : tuple of Branch
        The branches at the bifurcations, if they have been followed.
    """

    points: tuple[Held, ...]
    snaps: tuple[tuple[float, float], ...]
    branches: tuple[Branch, ...]

    def __repr__(self) -> str:
        return (
            f"<Curve of {len(self.displacements)} shapes: rest positions {len(self.rests)}, "
            f"events {len(self.events)}, snap-throughs {len(self.snaps)}>"
        )


def curve(
    system: System, displacements: Sequence[float] | Real, progress: Progress | None = None,
    branches: int = 0,
) -> Curve:  # fmt: skip
    """Return the holding forces at displacements, with rest positions and snap-throughs.

    Parameters
    ----------
    system : System
        The mechanism.
    displacements : (k,)
        Increasing displacements [m], or rotations [rad].  The path is followed between the first
        and the last one.
    progress : callable or None
        Called with the completed fraction, from 0 to 1.
    branches : int
        Branches to follow, see :func:`prbm.analysis.load_path.load_path`.

    Raises
    ------
    EquilibriumError
        If no static shape with the displacement at which the path begins is found, or a motion of
        it has no stiffness.
    """
    low, high = float(displacements[0]), float(displacements[-1])
    followed = held_path(system, low, high, branches)
    shapes = followed.shapes(displacements)
    points = []
    for k, (_, x, shape) in enumerate(shapes):
        points.append(described(system, x, shape))
        if progress is not None:
            progress((k + 1) / len(shapes))
    drawn, path = _branch(followed, followed.path), followed.path
    places = np.concatenate([[place for place, _, _ in shapes], np.arange(len(path.points))])
    order = np.argsort(places, kind="stable")
    return Curve(
        np.concatenate([[p.displacement for p in points], drawn.displacements])[order],
        np.concatenate([[p.force for p in points], drawn.forces])[order],
        np.concatenate([[p.unstable for p in points], drawn.unstable]).astype(int)[order],
        drawn.rests, drawn.events, drawn.ended, tuple(points), _snaps(followed),
        tuple(_branch(followed, one) for one in path.branches),
    )  # fmt: skip


def _branch(followed: HeldPath, path: LoadPath) -> Branch:
    """Return the points, rest positions and events of a path."""
    return Branch(
        np.array([followed.amount(p) for p in path.points]),
        np.array([followed.force(p) for p in path.points]),
        np.array([p.unstable for p in path.points]),
        *_events(followed, path),
        path.ended,
    )


def _events(
    followed: HeldPath, path: LoadPath
) -> tuple[tuple[RestPosition, ...], tuple[Event, ...]]:
    """Return the rest positions, and the limit points and bifurcations of a path."""
    rests = tuple(_rest(followed, p) for kind, p in path.events if kind == REST)
    return rests, tuple(
        Event(kind, followed.amount(p), followed.force(p), p.critical)
        for kind, p in path.events
        if kind != REST
    )


def _rest(followed: HeldPath, point: PathPoint) -> RestPosition:
    return RestPosition(followed.amount(point), point.unstable == 0, followed.shape(point))


def _snaps(followed: HeldPath) -> tuple[tuple[float, float], ...]:
    """Return where a growing load makes the mechanism snap, from each stable rest position.

    The load moves it towards the neighbouring rest positions.
    """
    events = [(kind, p) for kind, p in followed.path.events if kind != TURN]
    rests = [k for k, (kind, _) in enumerate(events) if kind == REST]
    found = []
    for first, last in pairwise(rests):
        between = [p for _, p in events[first + 1 : last]]
        for start, order in ((first, between), (last, between[::-1])):
            if between and events[start][1].unstable == 0:
                found.append((followed.amount(order[0]), followed.force(order[0])))
    return tuple(found)
