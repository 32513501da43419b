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
from .beam import Beam, Cuts


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
    area, modulus : (m,)
        Area [m^2] and section modulus [m^3] of each section, at waists divided by the factors of
        the stress (:func:`prbm.mechanics.profile.concentration`).
    smooth : range
        Sections at nodes between which the stress is a smooth function of the position.
    """

    name: str
    forces: tuple[complex, complex]
    moments: tuple[float, float]
    position: Real
    tension: Real
    bending: Real
    area: Real
    modulus: Real
    smooth: range


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
    tangents : (m, 2) int
        Two arms whose weighted sum is the tangent of a section: directions, counted from the end
        -1 for the ground, before it the arms that turn with the coordinates ``turned``.
    drawn : (m, 2) complex
        Directions of the flexure at these arms as drawn, from the near end to the far end, times
        the shares of the arms in the tangent.
    turned : (2,) int
        Coordinates of the rotations of the ends, if they are used in the tangents; else empty.
    area, modulus : (m,)
        Area [m^2] and section modulus [m^3] of the sections, as in :class:`SectionLoads`.
    beyond : (m, p)
        Share of each mass point that lies beyond a section, seen from the near end [-].
    smooth : range
        As in :class:`SectionLoads`: sections counted from the start of the flexure.
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
    tangents: Whole
    drawn: Complex
    turned: Whole
    area: Real
    modulus: Real
    beyond: Real
    smooth: range

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
        every = np.concatenate([e, np.exp(1j * deflection[self.turned]), [1.0]])
        mean = (every[self.tangents] * self.drawn).sum(axis=1)
        tension = (through.conj() * mean).real / np.abs(mean)
        forces, moments, order = (near, far), (near_moment, far_moment), slice(None)
        if not self.forwards:
            forces, moments, order = (far, near), (far_moment, near_moment), slice(None, None, -1)
        bending = np.concatenate([[-moments[0]], (self.bends @ strain)[order], [moments[1]]])
        return SectionLoads(
            self.name, forces, moments, self.position[order], tension[order], bending,
            self.area[order], self.modulus[order], self.smooth,
        )  # fmt: skip


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
    section: tuple[float, float],
    owners: Sequence[int | None],
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
    section : pair of float
        Area [m^2] and section modulus [m^3].
    owners, angles : (n + 2,) sequences of int or None
        Directions and coordinates of the segments, stubs included; None: the ground.
    points : sequence of (int, float, float)
        For each mass point: twice the number of its segment, or of its pivot plus 1; its distance
        from the start of the near stub, and of the far stub [m].
    """
    n, rates = len(pieces.rates) - 1, pieces.rates
    known = list(dict.fromkeys(j for j in angles if j is not None))
    sign = 1.0 if forwards else -1.0
    torques = [[(angles[i], -rates[i]), (angles[i + 1], rates[i])] for i in range(n + 1)]
    # The section at a pin turns with the link there.
    at_ends = (0 if rates[0] else 1, n + 1 if rates[-1] else n)
    pairs = [(at_ends[0],) * 2, *pairwise(range(n + 2)), (at_ends[1],) * 2]
    arms = [-1 if j is None else j for j in owners]
    # In the drawing the angle of a body is 0, that of a link its direction.
    drawn = [direction, *[1.0 + 0.0j] * n, direction]
    place = np.concatenate([[0.0], np.cumsum(pieces.lengths)[:-1], [sum(pieces.lengths)]])
    ranks = np.array([point[0] for point in points], float)
    levers = np.array([*(point[1:] for point in points), (pieces.lengths[0], pieces.lengths[-1])])
    return FreeBody(
        name=name,
        forwards=forwards,
        masses=masses,
        stub=sum(point[0] == 2 * (n + 1) for point in points),
        arms=np.array([arms[0], arms[-1]]),
        levers=levers.reshape(-1, 2) * direction,
        turning=np.eye(2),
        coordinates=np.array(known, int),
        end_rates=np.vstack([-rows(known, torques[0]), rows(known, torques[-1])]),
        bends=sign * rows(known, *torques),
        position=place if forwards else place[-1] - place,
        tangents=np.array([[arms[i] for i in pair] for pair in pairs]),
        drawn=np.array([[drawn[i] for i in pair] for pair in pairs]),
        turned=np.zeros(0, int),
        area=np.full(n + 3, section[0]),
        modulus=np.full(n + 3, section[1]),
        beyond=shares_beyond(
            ranks, np.array([-1.0, *(2.0 * i + 1.0 for i in range(n + 1)), np.inf])
        ),
        smooth=range(0),
    )


def of_beam(
    name: str,
    forwards: bool,
    beam: Beam,
    direction: complex,
    coordinates: tuple[Sequence[int | None], Sequence[int]],
    arms: Sequence[int],
    masses: slice,
    points: Sequence[tuple[int, float]],
) -> FreeBody:
    """Return a beam.

    Parameters
    ----------
    name, forwards, masses
        As in :class:`FreeBody`.
    beam : Beam
        The beam.
    direction : complex
        Direction of the chord as drawn, from the start to the end.
    coordinates : pair of sequences
        Coordinates of the rotations of start and end (None: the ground), and of the coefficients.
    arms : (N,) sequence of int
        Directions of the nodes.
    points : sequence of (int, float)
        For each mass point: the number of its node, and its distance to the left of the node [m].
    """
    (start, end), bends = coordinates
    known = list(dict.fromkeys(j for j in (start, end, *bends) if j is not None))
    order = slice(None) if forwards else slice(None, None, -1)
    nodes, cuts, rate = len(arms), beam.cuts, float(beam.rates[0])
    bending = [
        [
            (start, -rate),
            (end, rate),
            *((j, rate * float(P)) for j, P in zip(bends, row, strict=True)),
        ]
        for row in cuts.moments[1:-1, 1:]
    ]
    twist = rows(known, [(start, -rate), (end, rate)])
    turned = [j for j in (start, end) if j is not None]
    last = -1 - len(turned)
    at_ends = [-1 if j is None else last + turned.index(j) for j in (start, end)]
    shares = _neighbours(cuts)
    tangents = np.array([at_ends[0], *arms, at_ends[1]])[shares[0] + 1]
    drawn = shares[1] * (cuts.tangent * direction)[:, None]
    ranks = np.array([float(i) for i, _ in points])
    return FreeBody(
        name=name,
        forwards=forwards,
        masses=masses,
        stub=0,
        arms=np.array(arms),
        levers=_levers(beam, points, forwards) * direction,
        turning=beam.turns[:, :2].T[order],
        coordinates=np.array(known, int),
        end_rates=np.vstack([-twist, twist])[order],
        bends=rows(known, *bending)[order],
        position=cuts.position[order],
        tangents=tangents[order],
        drawn=(drawn if forwards else -drawn)[order],
        turned=np.array(turned, int),
        area=cuts.area[order],
        modulus=cuts.modulus[order],
        beyond=(
            shares_beyond(ranks, cuts.rank)
            if forwards
            else shares_beyond(nodes - 1 - ranks, nodes - 1 - cuts.rank[::-1])
        ),
        smooth=cuts.smooth,
    )


def _neighbours(cuts: Cuts) -> tuple[Whole, Real]:
    """Return the ranks of two nodes or ends at each cut, (m, 2), and their shares in its tangent.

    The tangent between two nodes is interpolated.
    """
    ranks = np.stack([np.floor(cuts.rank), np.ceil(cuts.rank)], axis=1).astype(int)
    shares = np.full(ranks.shape, 0.5)
    for k in np.flatnonzero(ranks[:, 0] < ranks[:, 1]):
        before, s, after = cuts.position[k - 1 : k + 2].tolist()
        shares[k] = (after - s) / (after - before), (s - before) / (after - before)
    return ranks, shares


def _levers(beam: Beam, points: Sequence[tuple[int, float]], forwards: bool) -> Complex:
    """Return the levers of the mass points and of the far end, in units of the direction."""
    whole, at_nodes = beam.whole, beam.node_positions
    levers = np.array([*(at_nodes[i] for i, _ in points), whole if forwards else 0.0 * whole])
    if not forwards:
        levers = levers - whole
    for lever, (i, across) in zip(levers, points, strict=False):
        lever[i] += 1j * across
    return levers
