r"""Methods for an impact map, for any mechanism with a stop.

* **algebraic**: a pure fundamental mode arrives at the shape that a force holds at the wall,

      C = (1 + eps) mu_1 - 1,    mu_1 = G_1^2 / sum_i G_i^2,    G_i = (d gap/dq) phi_i,

  by a pseudo-rigid-body model (:func:`algebraic`) or by finite elements (:func:`by_elements`);
* **simulated**: the first impact after a release (:func:`simulated`).  The arriving motion is never
  the pure mode, and the phase of the small vibration in the other modes changes C.  The second
  frequency of the 2R model is 10 % too low, which changes this phase.  C of the steel guide at
  -10 mm is 0.43 (2R), 0.47 and 0.478 (chains of 16 and 32 links), 0.479 (finite elements);
* **fitted**: the restitution of the 1R model whose motion is nearest to the simulated one
  (:func:`fitted`);
* **closed form**: a free body on a path, :func:`prbm.analysis.impact_map.free_body.closed_form`.

The fundamental mode loses energy to the other modes and to the contact.  For a pure arriving mode,
in units of its energy,

    after_1 = C^2,    after_i = (1 + eps)^2 mu_1 mu_i,    lost = (1 - eps^2) mu_1.
"""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from ...base.progress import Progress
from ...mechanics.arrays import Real
from ...mechanics.assembly import assemble
from ...mechanics.modal import Modes, modes
from ...mechanism.description import Mechanism
from ...mechanism.parts import value
from ...mechanism.supported import COMPLIANT_STOPS, FREE_BODIES, check_supported
from ...references.finite_elements import FiniteElements, Shape
from ...runs.engine import simulation
from ..flexure_models import with_flexures
from ..touching import impact_shape, touching_shape
from .impacts import first_impact, mode_energies
from .maps import OFFSETS, WALLS, Hit, ImpactMap, MovedStop, map_of, point_counter
from .responses import fit_response, response

SAMPLES = 200  # Samples of a fitted response.
REBOUND_PERIODS = 0.4  # Periods after the first impact in a fitted response.
RELEASE_RTOL = 1e-6  # Tolerance of the simulation that determines the time of the first impact.


def shares(G: Real, restitution: float) -> tuple[float, Real, float]:
    """Return modal restitution, energies after and energy lost for a pure arriving mode.

    Parameters
    ----------
    G : (k,)
        Rates of the gap by the mass-normalised modes, d(gap)/dq phi_i.
    restitution : float
        Newton's coefficient eps [-].

    Returns
    -------
    C, after, lost : float, (k,), float
        C, and energies in units of the arriving energy; their sum is 1 [-].

    Examples
    --------
    Two equal modes share the velocity equally after a plastic hit:

    >>> C, after, lost = shares(np.array([1.0, 1.0]), 0.0)
    >>> C, after.tolist(), lost
    (-0.5, [0.25, 0.25], 0.5)
    """
    mu = G**2 / float(G @ G)
    C = (1.0 + restitution) * float(mu[0]) - 1.0
    after: Real = (1.0 + restitution) ** 2 * mu[0] * mu
    after[0] = C**2
    return C, after, (1.0 - restitution**2) * float(mu[0])


def _hit(wall: float, offset: float, found: Modes, G: Real, restitution: float) -> Hit:
    C, after, lost = shares(G @ found.shape, restitution)
    before = np.zeros(len(after))
    before[0] = 1.0
    return Hit(wall, offset, C, found.frequency, before, after, lost)


def algebraic(
    mechanism: Mechanism,
    walls: Sequence[float] = WALLS,
    offsets: Sequence[float] = OFFSETS,
    values: Mapping[str, float] | None = None,
    *,
    stop: str | None = None,
    label: str = "algebraic",
    progress: Progress | None = None,
) -> ImpactMap:
    """Return the map of a pure fundamental mode arriving at the held shape.

    Parameters
    ----------
    mechanism : Mechanism
        A mechanism with any model of its flexures.
    walls, offsets : sequences of float
        Positions of the wall, offsets of the hit point [m].
    values : mapping
        Parameters that differ from their defaults, ``stop.restitution`` among them.
    stop : str or None
        Name of the stop; None: the first.
    label : str
        Label of the map.
    progress : callable or None
        Called with the completed fraction, from 0 to 1.

    Raises
    ------
    ParameterError
        If there is no such stop, or a value is out of bounds.
    EquilibriumError
        If a wall cannot be reached by a force on the released body.
    """
    check_supported(mechanism, "the algebraic map", COMPLIANT_STOPS, FREE_BODIES)
    which = MovedStop.of(mechanism, stop)
    count = point_counter(progress, len(walls) * len(offsets))

    def hits(offset: float) -> Iterator[Hit]:
        system = assemble(mechanism, mechanism.values(which.at(values, 0.0, offset)))
        eps = value(mechanism.stops[which.index], "restitution", system.values)
        for h in walls:
            shape = impact_shape(system, which.index, h)
            G = system.gap_rows.jacobian(system.directions(shape.q))[which.index]
            yield _hit(h, offset, modes(system, shape), G, eps)
            count()

    return map_of(label, [list(hits(d)) for d in offsets])


def by_elements(
    mechanism: Mechanism,
    walls: Sequence[float] = WALLS,
    offsets: Sequence[float] = OFFSETS,
    values: Mapping[str, float] | None = None,
    *,
    stop: str | None = None,
    elements: int = 16,
    label: str = "finite elements",
    progress: Progress | None = None,
) -> ImpactMap:
    """Return the algebraic map by finite elements; parameters as for :func:`algebraic`.

    Parameters
    ----------
    elements : int
        Number of elements per flexure.

    Raises
    ------
    FiniteElementError
        If Exudyn is not installed.
    """
    check_supported(mechanism, "the map by finite elements", COMPLIANT_STOPS, FREE_BODIES)
    which = MovedStop.of(mechanism, stop)
    count = point_counter(progress, len(walls) * len(offsets))

    def hits(offset: float) -> Iterator[Hit]:
        fe = FiniteElements(mechanism, which.at(values, 0.0, offset), elements=elements)
        eps = value(mechanism.stops[which.index], "restitution", fe.values)
        size = fe.model.size
        shape: Shape | None = None
        for h in walls:

            def gap(shape: Shape, h: float = h) -> float:
                return fe.gap(which.index, shape.q) + h

            shape = touching_shape(fe.equilibrium, gap, h, size, shape)
            yield _hit(h, offset, fe.modes(shape), fe.gap_row(which.index, shape.q), eps)
            count()

    return map_of(label, [list(hits(d)) for d in offsets])


def simulated(
    mechanism: Mechanism,
    walls: Sequence[float] = WALLS,
    offsets: Sequence[float] = OFFSETS,
    values: Mapping[str, float] | None = None,
    *,
    stop: str | None = None,
    tolerance: float = 1e-7,
    label: str = "simulated",
    progress: Progress | None = None,
    engine: str | None = None,
) -> ImpactMap:
    """Return the map of the first impacts after the release; parameters as for :func:`algebraic`.

    Parameters
    ----------
    tolerance : float
        Relative tolerance of the integration.
    progress : callable or None
        Called with the completed fraction, from 0 to 1.
    engine : str or None
        As for :func:`prbm.simulate`.

    Raises
    ------
    EquilibriumError
        If a wall is not reached after the release.
    """
    which = MovedStop.of(mechanism, stop)
    count = point_counter(progress, len(walls) * len(offsets))

    def hits(offset: float) -> Iterator[Hit]:
        for h in walls:
            changes = which.at(values, h, offset)
            motion = simulation(mechanism, changes, tolerance=tolerance, engine=engine)
            impact = first_impact(motion, which.index)
            yield mode_energies(motion.system, impact)
            count()

    return map_of(label, [list(hits(d)) for d in offsets])


def fitted(
    mechanism: Mechanism,
    walls: Sequence[float] = WALLS,
    offsets: Sequence[float] = OFFSETS,
    values: Mapping[str, float] | None = None,
    *,
    stop: str | None = None,
    label: str = "fitted",
    progress: Progress | None = None,
    engine: str | None = None,
) -> ImpactMap:
    """Return the restitution of an inextensible 1R model fitted to simulated responses.

    The thesis evaluates its measurements in this way.  The 1R model has the same wall and release
    and a centred hit; its fitted restitution replaces the modal restitution.  The stiffness of the
    1R model is fitted, too, because its period differs.  The response is the motion of the released
    body from the release to :data:`REBOUND_PERIODS` periods after the first impact, with further
    impacts.  A 1R model cannot move through the wall, so that the fit of a negative modal
    restitution is 0.

    The fit depends on the whole rebound, not on the impact alone.  If the frequencies of the
    excited modes change during the rebound, their energies change, too.  A guide that rebounds
    towards its straight shape, where these frequencies rise, loses some of its motion; a guide that
    rebounds outwards gains some.  This alone makes the map of fits asymmetric.

    Parameters as for :func:`simulated`.
    """
    which = MovedStop.of(mechanism, stop)
    model = with_flexures(mechanism, "1R")
    eps = f"{which.name}.restitution"
    result = np.zeros((len(offsets), len(walls)))
    count = point_counter(progress, result.size)
    known = model.values()
    shared = {name: x for name, x in (values or {}).items() if name in known}
    kinds = (f"{kind.name}.K_theta" for kind in model.flexure_types)
    stiffness = [name for name in kinds if name in known]
    for i, d in enumerate(offsets):
        for j, h in enumerate(walls):
            changes = which.at(values, h, d)
            motion = simulation(mechanism, changes, tolerance=RELEASE_RTOL, engine=engine)
            hit = first_impact(motion, which.index).time
            end = hit + REBOUND_PERIODS / motion.frequency
            times = np.linspace(0.0, end, SAMPLES)
            wanted = response(mechanism, changes, times, engine=engine)
            found = fit_response(
                model, [eps, *stiffness], times, wanted, which.at(shared, h, 0.0), engine=engine
            )
            result[i, j] = found.values[eps]
            count()
    return ImpactMap(label, np.array(walls), np.array(offsets), result)
