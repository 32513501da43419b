r"""Impact efficiency: what an impact leaves in the fundamental mode, over walls and offsets.

The source measures it at 5 x 5 walls and offsets and fits the restitution of a 1R model to each
response.  Here a map has three routes for any mechanism with a stop, and a fourth beside them:

* **algebraic**: a pure fundamental mode arrives at the shape that a force holds at the wall,

      C = (1 + eps) mu_1 - 1,    mu_1 = G_1^2 / sum_i G_i^2,    G_i = (d gap/dq) phi_i,

  of a pseudo-rigid-body model (:func:`algebraic`) or of finite elements (:func:`by_elements`);
* **simulated**: the first impact after a release (:func:`simulated`).  What arrives is never the
  pure mode, which is why it differs; the phase in which the small ringing of the other modes
  arrives matters, and a model of few pivots, whose second frequency is 10 % off, gets it wrong:
  the steel guide's C at -10 mm is 0.43 (2R), 0.47 and 0.478 (chains of 16, 32), 0.479 (elements);
* **fitted**: the restitution of a 1R model whose motion is nearest to the simulated one
  (:func:`fitted`);
* **closed form** for a free body that follows the guide's path y(x) without turning
  (:func:`closed_form`), d the offset of the hit from the centre of mass; of a mechanism in which
  the body turns, or does not carry nearly all of the fundamental, it is refused:

      C = (1 + eps) / ((1 + y'^2) (1 + m d^2/J)) - 1.

Energy goes to the modes that were still, and into the contact.  Of a pure arriving mode, in units
of its energy,

    after_1 = C^2,    after_i = (1 + eps)^2 mu_1 mu_i,    lost = (1 - eps^2) mu_1.
"""

import csv
import io
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ..base.errors import EquilibriumError, ParameterError
from ..base.progress import Progress
from ..data.records import Series
from ..hybrid.simulation import Impact, Simulation
from ..mechanics.arrays import Real
from ..mechanics.assembly import assemble
from ..mechanics.constraints import gap_rows
from ..mechanics.modal import Modes, modes, modes_at
from ..mechanics.statics import Equilibrium, equilibrium
from ..mechanics.system import System, unit
from ..mechanism.description import Mechanism
from ..mechanism.parts import GROUND, value
from ..references.finite_elements import FiniteElements, Shape
from .fit import DISPLACEMENT, Fit, Response, fit
from .touching import impact_shape, lever, stop_index, touching

HEIGHTS = (-10e-3, -5e-3, 0.0, 5e-3, 10e-3)  # m; the source's walls
OFFSETS = (-4e-3, -2e-3, 0.0, 2e-3, 4e-3)  # m; and offsets
PATIENCE = 1.5  # periods of the fundamental mode in which a wall must be reached
SAMPLES = 200  # of a response that is fitted
REBOUND = 0.4  # periods after the first impact that a fit looks at
STANDS = 1e-9  # of the step: a shorter path is what rounding leaves of none
PATH_STEP = 1e-4  # of the size: half the step along a body's path
TURNS = 0.02  # of the path: turning, where it is hit, of a body in the closed form, at most
CARRIED = 0.95  # of the fundamental's kinetic energy: what such a body carries at least
LOOSE = 1e-7  # tolerance of simulations for a fit; its differences are of 1e-4
MODELS = (("1R", 0), ("2R", 0), ("3R", 0), ("nR", 12))
_UNFIT = "the closed form is that of"
_OTHER_WAYS = "choose another way: algebraic, simulated or elements"


@dataclass(frozen=True)
class Hit:
    """One impact of a map.

    Parameters
    ----------
    height, offset : float
        Position of the wall, distance of the hit point from the point of the stop [m].
    restitution : float
        Modal restitution: velocity of the fundamental mode after over before, reversed [-].
    frequency : (k,)
        Of the modes at the impact shape [Hz].
    before, after : (k,)
        Kinetic energy of each mode, in units of all that arrives [-].
    lost : float
        Energy lost in the contact, in the same units [-].
    """

    height: float
    offset: float
    restitution: float
    frequency: Real
    before: Real
    after: Real
    lost: float

    def table(self) -> str:
        """Return a table of where the energy goes, mode by mode."""
        lines = [f"{'mode':>6}{'Hz':>12}{'before':>10}{'after':>10}"]
        rows = zip(self.frequency, self.before, self.after, strict=True)
        for i, (f, a, b) in enumerate(rows, start=1):
            if max(a, b) >= 5e-5:
                lines.append(f"{i:6d}{f:12.4g}{a:10.4f}{b:10.4f}")
        lines.append(f"{'contact':>18}{'':>10}{self.lost:10.4f}")
        return "\n".join(lines)


@dataclass(frozen=True)
class ImpactMap:
    """Modal restitution over offsets (rows) and walls (columns).

    Parameters
    ----------
    label : str
        Which model, and by which route.
    heights, offsets : (k,), (l,)
        Positions of the wall, offsets [m].
    restitution : (l, k)
        Modal restitution [-].
    hits : tuple of tuple of Hit
        The same points with their energies, in rows and columns; empty where a route gives none.
    """

    label: str
    heights: Real
    offsets: Real
    restitution: Real
    hits: tuple[tuple[Hit, ...], ...] = ()

    def csv(self) -> str:
        """Return the map as CSV: a line for every point, the energies where they are known."""
        out = io.StringIO()
        writer = csv.writer(out, lineterminator="\n")
        energies = ["left in mode 1 [-]", "in mode 2 [-]", "in mode 3 [-]", "in others [-]"]
        head = ["route", "wall position [m]", "offset [m]", "modal restitution [-]"]
        writer.writerow([*head, *energies, "lost in contact [-]"])
        for i, d in enumerate(self.offsets):
            for j, h in enumerate(self.heights):
                known: list[str] = [""] * 5
                if self.hits:
                    hit = self.hits[i][j]
                    shares = [*grouped(hit.after), hit.lost]
                    known = [f"{x:.6f}" for x in shares]
                c = f"{self.restitution[i, j]:.6f}"
                writer.writerow([self.label, f"{h:.6g}", f"{d:.6g}", c, *known])
        return out.getvalue()

    def write(self, path: str | Path) -> Path:
        """Write the map to a CSV file; return its path."""
        path = Path(path)
        path.write_text(self.csv(), encoding="utf-8")
        return path

    def __str__(self) -> str:
        head = "".join(f"{1e3 * h:9.3g}" for h in self.heights)
        lines = [self.label, f"d \\ h, mm{head}"]
        for d, row in zip(self.offsets, self.restitution, strict=True):
            lines.append(f"{1e3 * d:9.3g}" + "".join(f"{c:9.4f}" for c in row))
        return "\n".join(lines)


def grouped(after: Real) -> list[float]:
    """Return the energies of the first three modes, and of all others together."""
    first = [float(x) for x in after[:3]] + [0.0] * max(0, 3 - len(after))
    return [*first, float(after[3:].sum())]


# --- which mechanism --------------------------------------------------------------------------


def with_flexures(
    mechanism: Mechanism, model: str, *, axial: bool = False, n: int = 0
) -> Mechanism:
    """Return a mechanism with another model of its flexures.

    Parameters
    ----------
    model : {"1R", "2R", "3R", "nR"}
        For all flexures, with the published coefficients (own ones stay where the model does).
    axial : bool
        Whether the flexures stretch.
    n : int
        Number of links, of nR alone.
    """
    kinds = tuple(
        replace(
            kind, model=model, axial=axial, n=n,
            coefficients=kind.coefficients if kind.model == model else {},
        )
        for kind in mechanism.flexure_types
    )  # fmt: skip
    return replace(mechanism, flexure_types=kinds)


def variants(
    mechanism: Mechanism, models: Sequence[tuple[str, int]] = MODELS
) -> dict[str, Mechanism]:
    """Return a mechanism with every model of its flexures, inextensible and not, by label.

    Examples
    --------
    >>> from prbm.files.mechanism_file import load, shipped
    >>> list(variants(load(shipped()["PRBDM"]), (("1R", 0), ("nR", 8))))
    ['1R', '1R axial', '8R', '8R axial']
    """
    return {
        (f"{n}R" if n else model) + (" axial" if axial else ""): with_flexures(
            mechanism, model, axial=axial, n=n
        )
        for model, n in models
        for axial in (False, True)
    }


@dataclass(frozen=True)
class _Stop:
    """The stop that a map is about."""

    index: int
    name: str

    @classmethod
    def of(cls, mechanism: Mechanism, name: str | None) -> "_Stop":
        index = stop_index(mechanism, name)
        found = cls(index, mechanism.stops[index].name)
        for what in ("position", "offset"):
            if f"{found.name}.{what}" not in mechanism.values():
                raise ParameterError(
                    f"{mechanism.name}: the {what} of {found.name} is an expression in other "
                    f"parameters, and a map moves it: write a number there"
                )
        return found

    def at(
        self, values: Mapping[str, float] | None, height: float, offset: float
    ) -> dict[str, float]:
        """Return values with the wall and the hit point somewhere."""
        return {**(values or {}), f"{self.name}.position": height, f"{self.name}.offset": offset}


# --- algebraic --------------------------------------------------------------------------------


def shares(G: Real, restitution: float) -> tuple[float, Real, float]:
    """Return modal restitution, energies after, energy lost, of a pure arriving first mode.

    Parameters
    ----------
    G : (k,)
        Rates of the gap by the mass-normalised modes, d(gap)/dq phi_i.
    restitution : float
        Newton's coefficient eps [-].

    Returns
    -------
    C, after, lost : float, (k,), float
        Energies in units of the arriving one; their sum is 1 [-].

    Examples
    --------
    Two equal modes and a plastic hit: half of the velocity stays with the first, half goes on:

    >>> C, after, lost = shares(np.array([1.0, 1.0]), 0.0)
    >>> C, after.tolist(), lost
    (-0.5, [0.25, 0.25], 0.5)
    """
    mu = G**2 / float(G @ G)
    C = (1.0 + restitution) * float(mu[0]) - 1.0
    after: Real = (1.0 + restitution) ** 2 * mu[0] * mu
    after[0] = C**2
    return C, after, (1.0 - restitution**2) * float(mu[0])


def _hit(height: float, offset: float, found: Modes, G: Real, restitution: float) -> Hit:
    C, after, lost = shares(G @ found.shape, restitution)
    before = np.zeros(len(after))
    before[0] = 1.0
    return Hit(height, offset, C, found.frequency, before, after, lost)


def _map(label: str, rows: Sequence[Sequence[Hit]]) -> ImpactMap:
    return ImpactMap(
        label,
        np.array([hit.height for hit in rows[0]]),
        np.array([row[0].offset for row in rows]),
        np.array([[hit.restitution for hit in row] for row in rows]),
        tuple(tuple(row) for row in rows),
    )


def _counted(progress: Progress | None, count: int) -> Callable[[], None]:
    """Return what tells, when it is called for one of so many points, which fraction is done."""
    done = 0

    def told() -> None:
        nonlocal done
        done += 1
        if progress is not None:
            progress(done / count)

    return told


def algebraic(
    mechanism: Mechanism,
    heights: Sequence[float] = HEIGHTS,
    offsets: Sequence[float] = OFFSETS,
    values: Mapping[str, float] | None = None,
    *,
    stop: str | None = None,
    label: str = "algebraic",
    progress: Progress | None = None,
) -> ImpactMap:
    """Return the map of a pure fundamental mode that arrives at the held shape.

    Parameters
    ----------
    mechanism : Mechanism
        With any model of its flexures.
    heights, offsets : sequences of float
        Positions of the wall, offsets of the hit point [m].
    values : mapping
        Parameters that differ from their defaults; the restitution is ``stop.restitution``.
    stop : str or None
        Which stop; None: the first.
    label : str
        What to call it.
    progress : callable or None
        Told the fraction that is done, from 0 to 1.

    Raises
    ------
    ParameterError
        If there is no such stop, or a value is out of bounds.
    EquilibriumError
        If a wall cannot be reached by a force on the released body.
    """
    which = _Stop.of(mechanism, stop)

    told = _counted(progress, len(heights) * len(offsets))

    def hits(offset: float) -> Iterator[Hit]:
        system = assemble(mechanism, mechanism.values(which.at(values, 0.0, offset)))
        eps = value(mechanism.stops[which.index], "restitution", system.values)
        for h in heights:
            shape = impact_shape(system, which.index, h)
            G = gap_rows(system).jacobian(system.directions(shape.q))[which.index]
            yield _hit(h, offset, modes(system, shape), G, eps)
            told()

    return _map(label, [list(hits(d)) for d in offsets])


def by_elements(
    mechanism: Mechanism,
    heights: Sequence[float] = HEIGHTS,
    offsets: Sequence[float] = OFFSETS,
    values: Mapping[str, float] | None = None,
    *,
    stop: str | None = None,
    elements: int = 16,
    label: str = "finite elements",
    progress: Progress | None = None,
) -> ImpactMap:
    """Return the algebraic map of finite elements; parameters as :func:`algebraic` has them.

    Parameters
    ----------
    elements : int
        A flexure.

    Raises
    ------
    FiniteElementError
        If Exudyn is not installed.
    """
    which = _Stop.of(mechanism, stop)

    told = _counted(progress, len(heights) * len(offsets))

    def hits(offset: float) -> Iterator[Hit]:
        fe = FiniteElements(mechanism, which.at(values, 0.0, offset), elements=elements)
        eps = value(mechanism.stops[which.index], "restitution", fe.values)
        size = fe.model.size
        shape: Shape | None = None
        for h in heights:

            def gap(shape: Shape, h: float = h) -> float:
                return fe.gap(which.index, shape.q) + h

            shape = touching(fe.equilibrium, gap, h, size, shape)
            yield _hit(h, offset, fe.modes(shape), fe.gap_row(which.index, shape.q), eps)
            told()

    return _map(label, [list(hits(d)) for d in offsets])


def closed_form(
    mechanism: Mechanism,
    heights: Sequence[float] = HEIGHTS,
    offsets: Sequence[float] = OFFSETS,
    values: Mapping[str, float] | None = None,
    *,
    stop: str | None = None,
    label: str = "closed form",
    progress: Progress | None = None,
) -> ImpactMap:
    """Return (1 + eps)/((1 + y'^2)(1 + m d^2/J)) - 1, y(x) the path of the body that hits.

    The path is that of its centre of mass along the held shapes, x along the direction of the
    stop; d is the distance from the centre of mass to the line of the impact in the drawn shape.
    The formula is that of one free body that does not turn on its path.  Parameters as
    :func:`algebraic` has them.

    Raises
    ------
    ParameterError
        If the formula does not fit: the stop is on another body that moves; the body turns, on its
        path, by so much that a point as far from its centre of mass as the hit or its radius of
        gyration moves by more than :data:`TURNS` of its path; or less than :data:`CARRIED` of the
        fundamental's kinetic energy is that of the body along the path.
    """
    which = _Stop.of(mechanism, stop)
    s = mechanism.stops[which.index]
    if s.on != GROUND:
        raise ParameterError(
            f"{_UNFIT} a stop on the ground, but {s.name} is on {s.on}, which moves; {_OTHER_WAYS}"
        )
    result = np.zeros((len(offsets), len(heights)))
    system = assemble(mechanism, mechanism.values(which.at(values, 0.0, 0.0)))
    eps = value(s, "restitution", system.values)
    body = next(b for b in mechanism.bodies if b.name == s.body)
    m, J = (value(body, name, system.values) for name in ("mass", "inertia"))
    levers = lever(system, which.index) + np.array(offsets)
    reach = max(float(np.abs(levers).max()), math.sqrt(J / m))
    told = _counted(progress, len(heights))
    for j, h in enumerate(heights):
        shape = impact_shape(system, which.index, h)
        path, turning = _path(system, s.body, shape)
        _check_alone(system, s.body, shape, path, turning * reach, h)
        slope = math.tan(np.angle(path * unit(s.direction).conjugate()))
        result[:, j] = (1 + eps) / ((1 + slope**2) * (1 + m * levers**2 / J)) - 1
        told()
    return ImpactMap(label, np.array(heights), np.array(offsets), result)


def _path(system: System, body: str, shape: Equilibrium) -> tuple[complex, float]:
    """Return direction of a body's path along the held shapes, and its turning on it [rad/m]."""
    frame, step = system.bodies[body], PATH_STEP * system.length
    held = float((system.release @ system.directions(shape.q)).real) + system.release_c
    behind, ahead = (equilibrium(system, held + k * step).q for k in (-1, 1))
    moved = complex(frame.A @ (system.directions(ahead) - system.directions(behind)))
    if abs(moved) <= STANDS * step:
        raise ParameterError(
            f"{_UNFIT} a body that moves along a path, but {body} stands, or turns on the spot; "
            f"{_OTHER_WAYS}"
        )
    return moved / abs(moved), float(ahead[frame.j] - behind[frame.j]) / abs(moved)


def _check_alone(
    system: System, body: str, shape: Equilibrium, path: complex, turns: float, height: float
) -> None:
    """Refuse a body that turns on its path, or that is not nearly all that the fundamental moves.

    ``turns`` is what it turns by where it is hit, over its path [-].
    """
    where = f"with the wall at {1e3 * height:g} mm"
    if abs(turns) > TURNS:
        raise ParameterError(
            f"{_UNFIT} a body that does not turn, but {where} {body} turns: where it is hit, or at "
            f"its radius of gyration, by {100 * abs(turns):.3g} % of its path (at most "
            f"{100 * TURNS:g} %); {_OTHER_WAYS}"
        )
    _, velocity = system.motion(
        system.bodies[body], system.directions(shape.q), modes(system, shape).shape[:, 0]
    )
    mass = next(value(b, "mass", system.values) for b in system.mechanism.bodies if b.name == body)
    share = mass * (velocity * path.conjugate()).real ** 2  # modes have the mass 1
    if share < CARRIED:
        raise ParameterError(
            f"{_UNFIT} a body that moves alone, but {where} the motion of {body} along its path is "
            f"{100 * share:.3g} % of the fundamental's kinetic energy (at least "
            f"{100 * CARRIED:g} %): other bodies or the flexures move with it; {_OTHER_WAYS}"
        )


# --- simulated --------------------------------------------------------------------------------


def first_impact(simulation: Simulation, stop: int) -> Impact:
    """Advance a simulation to its first impact at a stop and return it.

    Raises
    ------
    EquilibriumError
        If the wall is not reached in :data:`PATIENCE` periods of the fundamental mode.
    """
    name = simulation.mechanism.stops[stop].name
    simulation.record = []
    period = 1.0 / simulation.frequency
    end = simulation.time + PATIENCE * period
    while simulation.time < end:
        simulation.advance(min(end, simulation.time + period / 50))
        for impact in simulation.record:
            if impact.stop == name:
                return impact
    raise EquilibriumError(
        f"the wall {name} is not reached in {PATIENCE:g} periods from "
        f"release.displacement = {simulation.values.get('release.displacement', 0.0):g} m: release "
        "further away"
    )


def mode_energies(system: System, impact: Impact) -> Hit:
    """Return what an impact did to every mode at its shape, in units of the arriving energy.

    Parameters
    ----------
    system : System
        The mechanism that was simulated.
    impact : Impact
        As :class:`prbm.Simulation` records it.

    Returns
    -------
    Hit
        Position and offset of the wall as the parameters have them.
    """
    found = modes_at(system, impact.q)
    rates = [found.shape.T @ (found.M @ v) for v in (impact.before, impact.after)]
    before, after = (rate**2 / 2 for rate in rates)
    arriving = float(before.sum())
    values = system.values
    height, offset = (
        value(next(s for s in system.mechanism.stops if s.name == impact.stop), name, values)
        for name in ("position", "offset")
    )
    return Hit(
        height, offset, impact.latched.modal_restitution, found.frequency,
        before / arriving, after / arriving, impact.latched.energy_lost / arriving,
    )  # fmt: skip


def simulated(
    mechanism: Mechanism,
    heights: Sequence[float] = HEIGHTS,
    offsets: Sequence[float] = OFFSETS,
    values: Mapping[str, float] | None = None,
    *,
    stop: str | None = None,
    tolerance: float = 1e-7,
    label: str = "simulated",
    progress: Progress | None = None,
) -> ImpactMap:
    """Return the map of the first impacts after the release; parameters as :func:`algebraic`.

    Parameters
    ----------
    tolerance : float
        Of the integration.
    progress : callable or None
        Told the fraction that is done, from 0 to 1.

    Raises
    ------
    EquilibriumError
        If a wall is not reached: release further away.
    """
    which = _Stop.of(mechanism, stop)
    told = _counted(progress, len(heights) * len(offsets))

    def hits(offset: float) -> Iterator[Hit]:
        for h in heights:
            simulation = Simulation(mechanism, which.at(values, h, offset), tolerance=tolerance)
            impact = first_impact(simulation, which.index)
            yield mode_energies(simulation.system, impact)
            told()

    return _map(label, [list(hits(d)) for d in offsets])


# --- fitted -----------------------------------------------------------------------------------


def response(
    mechanism: Mechanism, values: Mapping[str, float], times: Real, tolerance: float = LOOSE
) -> Real:
    """Return the displacement of the released body along its release at times, (m,) [m]."""
    seen = Response(Series(times, np.zeros(len(times))), DISPLACEMENT, tolerance=tolerance)
    return seen.model(mechanism, values)


def fit_response(
    mechanism: Mechanism,
    names: Sequence[str],
    times: Real,
    wanted: Real,
    values: Mapping[str, float] | None = None,
) -> Fit:
    """Fit parameters of a mechanism to a computed response, from their values on.

    Parameters
    ----------
    mechanism : Mechanism
        The model, a 1R say.
    names : sequence of str
        Of the parameters to fit; they start from their values.
    times : (m,)
        Increasing, from the release on [s].
    wanted : (m,)
        Displacement of the released body along the direction of its release [m].
    values : mapping
        Parameters that differ from their defaults.

    Raises
    ------
    ParameterError
        If a name is unknown.
    RecordError
        If the times have gaps or are fewer than 16.
    """
    target = Response(Series(times, wanted, DISPLACEMENT), DISPLACEMENT, tolerance=LOOSE)
    return fit(mechanism, names, target, values, starts=1)


def fitted(
    mechanism: Mechanism,
    heights: Sequence[float] = HEIGHTS,
    offsets: Sequence[float] = OFFSETS,
    values: Mapping[str, float] | None = None,
    *,
    stop: str | None = None,
    label: str = "fitted",
    progress: Progress | None = None,
) -> ImpactMap:
    """Return the restitution of an inextensible 1R model fitted to simulated responses.

    As the source does with its measurements: the 1R has the same wall and release, a centred hit
    and one restitution, which takes the place of the modal one.  Its stiffness is fitted with
    it, because its period is its own.  The response is that of the released body from the release
    to :data:`REBOUND` periods after the first impact, further impacts included.  A 1R cannot
    follow through the wall: a negative modal restitution is fitted by 0.

    A fit sees the whole rebound, not the instant of the impact.  Where the frequencies of the
    modes that were hit change on the way, their energy does so with them: a guide that rebounds
    towards straight, where they rise, gives some of its motion away, one that rebounds outwards
    gets some back.  The map of fits is not symmetric for that reason alone.

    Parameters as :func:`simulated` has them.
    """
    which = _Stop.of(mechanism, stop)
    model = with_flexures(mechanism, "1R")
    eps = f"{which.name}.restitution"
    result = np.zeros((len(offsets), len(heights)))
    told = _counted(progress, result.size)
    known = model.values()
    shared = {name: x for name, x in (values or {}).items() if name in known}
    kinds = (f"{kind.name}.K_theta" for kind in model.flexure_types)
    stiffness = [name for name in kinds if name in known]
    for i, d in enumerate(offsets):
        for j, h in enumerate(heights):
            simulation = Simulation(mechanism, which.at(values, h, d), tolerance=1e-6)
            hit = first_impact(simulation, which.index).time
            end = hit + REBOUND / simulation.frequency
            times = np.linspace(0.0, end, SAMPLES)
            wanted = response(mechanism, which.at(values, h, d), times)
            found = fit_response(model, [eps, *stiffness], times, wanted, which.at(shared, h, 0.0))
            result[i, j] = found.values[eps]
            told()
    return ImpactMap(label, np.array(heights), np.array(offsets), result)
