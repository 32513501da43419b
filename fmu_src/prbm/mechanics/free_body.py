"""Flexures as free bodies between the bodies that they connect.

:mod:`prbm.mechanics.sections` computes the forces on the ends.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ..mechanism.flexure import Segments
from .arrays import Complex, Real, Whole
from .beam import Beam


class SectionLoads(NamedTuple):
    """Forces and moments of one flexure.

    Parameters
    ----------
    name : str
        Name of the flexure.
    forces : pair of complex
        Forces on the flexure at its start and its end [N].
    moments : pair of float
        Moments on the flexure at its start and its end, counter-clockwise [N m].
    position : (m,)
        Positions of the sections along the flexure, from its start to its end [m].
    tension : (m,)
        Normal force in each section, positive in tension [N].
    bending : (m,)
        Bending moment in each section, positive if the flexure turns counter-clockwise from its
        start to its end [N m].
    """

    name: str
    forces: tuple[complex, complex]
    moments: tuple[float, float]
    position: Real
    tension: Real
    bending: Real


@dataclass(frozen=True)
class FreeBody:
    """A flexure as a free body between its near end and its far end.

    It has p mass points, m sections including both ends, and c coordinates.  Arrays are in the
    order from the near end to the far end.

    Parameters
    ----------
    name : str
        Name of the flexure.
    forwards : bool
        Whether the near end is the start of the flexure.
    masses : slice
        Its mass points among those of the system.
    stub : int
        Number of mass points, the last ones, between the point at which the flexure closes a loop
        and its far end.
    arms : (k,) int
        Directions that turn with its ends; -1: the ground.
    levers : (p + 1, k) complex
        Positions of the mass points, then of the far end, relative to the near end [m]; only the
        parts along these arms.
    turning : (2, k)
        Virtual rotations of the arms with the near end and with the far end [-].
    coordinates : (c,) int
        Coordinates of its springs and sections.
    end_rates : (2, c)
        Gradients of its elastic energy by the rotations of both ends, per change of the coordinates
        [N m/rad].
    bends : (m - 2, c)
        Bending moments between the ends, per change of the coordinates [N m/rad], positive if the
        flexure turns counter-clockwise from its start to its end.
    position : (m,)
        Positions of the sections, measured from the start of the flexure [m].
    turns : (m, c)
        Rotations of the sections with the coordinates [-].
    direction : complex
        Direction of the flexure as drawn, from the near end to the far end.
    beyond : (m, p)
        Share of each mass point that lies beyond a section, seen from the near end [-].
    """

    name: str
    forwards: bool
    masses: slice
    stub: int
    arms: Whole
    levers: Complex
    turning: Real
    coordinates: Whole
    end_rates: Real
    bends: Real
    position: Real
    turns: Real
    direction: complex
    beyond: Real

    def section_loads(
        self, e: Complex, deflection: Real, strained: Real, loads: Complex, far: complex
    ) -> SectionLoads:
        """Return the forces and moments of the flexure.

        Parameters
        ----------
        e : (d,) complex
            Directions.
        deflection, strained : (n,)
            q - q0, and q - q0 + beta v [rad].
        loads : (p,) complex
            Loads of the mass points [N].
        far : complex
            Force on the far end [N].
        """
        arms = np.append(e, 1.0)[self.arms]  # The ground has the index -1.
        moved = 1j * (self.levers * arms) @ self.turning.T
        work = (np.append(loads, far).conj() @ moved).real
        strain = strained[self.coordinates]
        near_moment, far_moment = (self.end_rates @ strain - work).tolist()
        near = -far - complex(loads.sum())
        through = far + self.beyond @ loads
        tangents = self.direction * np.exp(1j * (self.turns @ deflection[self.coordinates]))
        tension = (through.conj() * tangents).real
        forces, moments, order = (near, far), (near_moment, far_moment), slice(None)
        if not self.forwards:
            forces, moments, order = (far, near), (far_moment, near_moment), slice(None, None, -1)
        bending = np.concatenate([[-moments[0]], (self.bends @ strain)[order], [moments[1]]])
        return SectionLoads(
            self.name, forces, moments, self.position[order], tension[order], bending
        )


@dataclass(frozen=True)
class Connection:
    """A flexure or a joint, in the order of the assembly.

    Parameters
    ----------
    near, far : str
        Bodies that it connects.  It reaches the far body, unless it closes a loop.
    loop : int or None
        Index of the loop that it closes; None: it closes none.
    flexure : FreeBody or None
        The flexure; None for a joint.
    """

    near: str
    far: str
    loop: int | None
    flexure: FreeBody | None = None


def rows(coordinates: Sequence[int], *changes: Sequence[tuple[int | None, float]]) -> Real:
    """Return a row for each list of coordinates and factors; None: the ground, without a column."""
    result = np.zeros((len(changes), len(coordinates)))
    for row, change in zip(result, changes, strict=True):
        for j, factor in change:
            if j is not None:
                row[coordinates.index(j)] += factor
    return result


def shares_beyond(ranks: Real, sections: Real) -> Real:
    """Return the shares of masses beyond sections, (m, p), by their order along the flexure.

    Half of a mass at a section is beyond it.

    Examples
    --------
    >>> shares_beyond(np.array([0.0, 1.0]), np.array([-1.0, 0.0])).tolist()
    [[1.0, 1.0], [0.5, 1.0]]
    """
    apart = ranks[None, :] - sections[:, None]
    return np.heaviside(apart, 0.5)


def of_links(
    name: str,
    forwards: bool,
    pieces: Segments,
    direction: complex,
    ends: tuple[int | None, int | None],
    angles: Sequence[int | None],
    masses: slice,
    points: Sequence[tuple[int, float, float]],
) -> FreeBody:
    """Return a flexure of n links.

    Parameters
    ----------
    name, forwards, masses
        As in :class:`FreeBody`.
    pieces : Segments
        Segments, from the near end to the far end.
    direction : complex
        Direction as drawn, from the near end to the far end.
    ends : pair of int or None
        Directions of the bodies at the near end and the far end; None: the ground.
    angles : (n + 2,) sequence of int or None
        Coordinates of the segments, stubs included; None: the ground.
    points : sequence of (int, float, float)
        For each mass point: twice the number of its segment, or of its pivot plus 1; its distance
        from the start of the near stub, and of the far stub [m].
    """
    n, rates = len(pieces.rates) - 1, pieces.rates
    known = list(dict.fromkeys(j for j in angles if j is not None))
    sign = 1.0 if forwards else -1.0
    torques = [[(angles[i], -rates[i]), (angles[i + 1], rates[i])] for i in range(n + 1)]
    turned = [[(a, 0.5), (b, 0.5)] for a, b in pairwise(angles)]
    # The section at a pin turns with the link there.
    near, far = angles[0 if rates[0] else 1], angles[-1 if rates[-1] else -2]
    place = np.concatenate([[0.0], np.cumsum(pieces.lengths)[:-1], [sum(pieces.lengths)]])
    ranks = np.array([point[0] for point in points], float)
    levers = np.array([*(point[1:] for point in points), (pieces.lengths[0], pieces.lengths[-1])])
    return FreeBody(
        name=name,
        forwards=forwards,
        masses=masses,
        stub=sum(point[0] == 2 * (n + 1) for point in points),
        arms=np.array([-1 if j is None else j for j in ends]),
        levers=levers.reshape(-1, 2) * direction,
        turning=np.eye(2),
        coordinates=np.array(known, int),
        end_rates=np.vstack([-rows(known, torques[0]), rows(known, torques[-1])]),
        bends=sign * rows(known, *torques),
        position=place if forwards else place[-1] - place,
        turns=rows(known, [(near, 1.0)], *turned, [(far, 1.0)]),
        direction=direction,
        beyond=shares_beyond(
            ranks, np.array([-1.0, *(2.0 * i + 1.0 for i in range(n + 1)), np.inf])
        ),
    )


def of_beam(
    name: str,
    forwards: bool,
    beam: Beam,
    direction: complex,
    coordinates: tuple[Sequence[int | None], Sequence[int]],
    arms: Sequence[int],
    masses: slice,
) -> FreeBody:
    """Return a beam.

    Parameters
    ----------
    name, forwards, masses
        As in :class:`FreeBody`.
    beam : Beam
        The beam.
    direction : complex
        Direction as drawn, from the start to the end.
    coordinates : pair of sequences
        Coordinates of the rotations of start and end (None: the ground), and of the coefficients.
    arms : (N,) sequence of int
        Directions of the nodes.
    """
    (start, end), bends = coordinates
    known = list(dict.fromkeys(j for j in (start, end, *bends) if j is not None))
    order = slice(None) if forwards else slice(None, None, -1)
    whole, nodes = beam.positions(np.array([1.0])), beam.nodes
    levers: Real = np.vstack([beam.node_positions, whole if forwards else 0.0 * whole])
    rate = float(beam.rates[0])
    turning = [
        [(j, float(turn)) for j, turn in zip((start, end, *bends), row, strict=True)]
        for row in beam.turns
    ]
    bending = [
        [
            (start, -rate),
            (end, rate),
            *((j, rate * float(P)) for j, P in zip(bends, row, strict=True)),
        ]
        for row in beam.moments[:, 1:]
    ]
    twist = rows(known, [(start, -rate), (end, rate)])
    section = rows(known, [(start, 1.0)], *turning, [(end, 1.0)])
    ranks = np.arange(float(nodes))[order]
    if not forwards:
        levers -= whole
    return FreeBody(
        name=name,
        forwards=forwards,
        masses=masses,
        stub=0,
        arms=np.array(arms),
        levers=(levers * direction).astype(complex),
        turning=beam.turns[:, :2].T[order],
        coordinates=np.array(known, int),
        end_rates=np.vstack([-twist, twist])[order],
        bends=rows(known, *bending)[order],
        position=np.concatenate([[0.0], beam.places, [beam.L]])[order],
        turns=section[order],
        direction=direction if forwards else -direction,
        beyond=shares_beyond(ranks, np.array([-1.0, *range(nodes), np.inf])),
    )
