"""Models of flexures as data: rigid segments with torsion springs, and beams.

A pseudo-rigid-body model is a set of published coefficients for a cantilever of length h.  Common
rules give the segments of a flexure of length L:

* Clamped at one end: one cantilever, h = L.  The other end is a pin, or free.  The body at a free
  end is fixed to the last link, which is the link at the tip of the model.
* Clamped at both ends: two mirrored cantilevers, h = L/2, whose last links form one link in the
  middle::

      clamp                                            clamp
      ##|--g0--o--g1--o----2 g2----o--g1--o--g0--|##          (2R, in units of h)
              K1     K2           K2     K1

* Pinned at both ends: one rigid link.

The chain of n equal links (nR, Hencky) has no coefficients, and other rules for its ends.  Its
springs are n EI/L between links.  At each end that is clamped or free, a spring 2 n EI/L connects
the last link with the body.

With axial compliance, one link of a flexure stretches with the stiffness EA/L: the middle one.  If
the number of links is even, it is the one after the middle, counted from the clamp.  In a chain all
links stretch, each with the stiffness n EA/L.

A beam has no coefficients either: its bending moment is a polynomial, see
:mod:`prbm.mechanics.beam`.  A free end of a beam is the same as a clamp.

Each model in :data:`MODELS` names its publications.
"""

import math
import reprlib
from collections.abc import Sequence
from dataclasses import dataclass

from ..base.errors import ParameterError
from ..base.tolerances import STUB_RTOL
from .parameters import number


@dataclass(frozen=True)
class Coefficient:
    """A dimensionless coefficient of a flexure model, with its bounds."""

    name: str
    value: float
    description: str
    minimum: float = 1e-3
    maximum: float = 1e3


@dataclass(frozen=True)
class FlexureModel:
    """Coefficients of a model of a cantilever.

    Parameters
    ----------
    name : str
        Number of pivots of the cantilever: 1R, 2R, 3R; nR for a chain; beam.
    gamma : tuple of Coefficient
        Lengths of the moving links, from the clamp to the tip, in units of h [-].
    K_theta : tuple of Coefficient
        Stiffness coefficients of the pivots, from the clamp to the tip [-].
    rate_with_gamma : bool
        Whether the spring rates are gamma_i K_theta_i EI/h; otherwise they are K_theta_i EI/h.
    lumped : bool
        Whether the mass is lumped at the pivots, with an equivalent kinetic energy; otherwise each
        segment is a slender rod, with a mass in proportion to its length.
    source : str
        Authors and years of the publications, for tables.
    references : tuple of str
        The publications, for the documentation of FMUs.
    links : int
        Number of equal links of a chain, set from the flexure type; 0 in :data:`MODELS`, and for
        the other models.
    order, nodes : int
        Order of the polynomial of the bending moment of a beam, and number of its nodes, or of
        those in its notch or waist, set from the flexure type; 0 in :data:`MODELS`, and for the
        other models.
    """

    name: str
    gamma: tuple[Coefficient, ...]
    K_theta: tuple[Coefficient, ...]
    rate_with_gamma: bool
    lumped: bool
    source: str
    references: tuple[str, ...]
    links: int = 0
    order: int = 0
    nodes: int = 0

    @property
    def coefficients(self) -> tuple[Coefficient, ...]:
        """All coefficients, lengths first."""
        return self.gamma + self.K_theta

    @property
    def end_slope(self) -> float:
        """Tip slope of a cantilever under an end moment, over the slope of the beam [-].

        Every spring carries the whole moment.  The value is 0 for chains and beams, whose slopes
        are exact.

        Examples
        --------
        >>> [round(MODELS[name].end_slope, 3) for name in ("1R", "2R", "3R")]
        [0.443, 0.772, 1.007]
        """
        rates = _rates(self, [c.value for c in self.gamma], [c.value for c in self.K_theta])
        return sum(1.0 / rate for rate in rates)


def _gamma(name: str, value: float, which: str) -> Coefficient:
    """Return the length coefficient of a link."""
    text = f"Length of {which} in units of the length of the cantilever"
    return Coefficient(name, value, text, maximum=1.0)


def _K_theta(name: str, value: float, which: str) -> Coefficient:
    """Return the stiffness coefficient of a pivot."""
    return Coefficient(name, value, f"Stiffness coefficient of {which}")


BEAM, CHAIN = "beam", "nR"

MODELS = {
    model.name: model
    for model in (
        FlexureModel(
            "1R",
            (Coefficient("gamma", 0.8517, "Characteristic radius factor", maximum=1.0),),
            (_K_theta("K_theta", 2.65, "the characteristic pivot"),),
            rate_with_gamma=True,
            lumped=True,
            source="Howell 2001; Yu et al. 2005",
            references=(
                "L. L. Howell, Compliant Mechanisms, Wiley, 2001 (1R).",
                "Y.-Q. Yu et al., Dynamic modeling of compliant mechanisms based on the "
                "pseudo-rigid-body model, J. Mech. Des. 127 (2005) 760 (1R, masses).",
            ),
        ),
        FlexureModel(
            "2R",
            (
                _gamma("gamma1", 0.44, "the link between the pivots"),
                _gamma("gamma2", 0.46, "the link at the tip"),
            ),
            (
                _K_theta("K_theta1", 3.4710, "the pivot next to the clamp"),
                _K_theta("K_theta2", 2.0682, "the pivot next to the tip"),
            ),
            rate_with_gamma=False,
            lumped=False,
            source="Yu, Feng, Xu 2012",
            references=(
                "Y.-Q. Yu, Z.-L. Feng, Q.-P. Xu, A pseudo-rigid-body 2R model of flexural beam in "
                "compliant mechanisms, Mech. Mach. Theory 55 (2012) 18 (2R).",
            ),
        ),
        FlexureModel(
            "3R",
            (
                _gamma("gamma1", 0.35, "the link next to the clamp"),
                _gamma("gamma2", 0.40, "the link in the middle"),
                _gamma("gamma3", 0.15, "the link at the tip"),
            ),
            (
                _K_theta("K_theta1", 3.51, "the pivot next to the clamp"),
                _K_theta("K_theta2", 2.99, "the pivot in the middle"),
                _K_theta("K_theta3", 2.58, "the pivot next to the tip"),
            ),
            rate_with_gamma=False,
            lumped=False,
            source="Su 2009",
            references=(
                "H.-J. Su, A pseudorigid-body 3R model, J. Mech. Robotics 1 (2009) 021008 (3R).",
            ),
        ),
        FlexureModel(
            CHAIN,
            (),
            (),
            rate_with_gamma=False,
            lumped=False,
            source="Hencky 1920",
            references=(
                "H. Hencky, Über die angenäherte Lösung von Stabilitätsproblemen im Raum mittels "
                "der elastischen Gelenkkette, Der Eisenbau 11 (1920) 437 (nR).",
            ),
        ),
        FlexureModel(
            BEAM,
            (),
            (),
            rate_with_gamma=False,
            lumped=False,
            source="Boyer et al. 2021",
            references=(
                "F. Boyer, V. Lebastard, F. Candelier, F. Renda, Dynamics of continuum and soft "
                "robots: a strain parameterization based approach, IEEE Trans. Robotics 37 (2021) "
                "847 (beam).",
            ),
        ),
    )
}

PUBLISHED = frozenset(MODELS)
"""Models that every process knows; others are registered by a program."""


def register_model(
    name: str, gamma: Sequence[float], K_theta: Sequence[float], *, reference: str = ""
) -> FlexureModel:
    """Add a model of flexures with pivots, for mechanism files that are loaded afterwards.

    The springs have the rates K_theta_i EI/h, unlike those of the model 1R, gamma K_theta EI/h, and
    each segment is a slender rod.  A model is known in this process only: a program registers it
    before it loads the mechanism.  Commands, FMUs and other processes do not know it.

    Parameters
    ----------
    name : str
        Name of the model in mechanism files, an identifier.
    gamma : sequence of float
        Lengths of the moving links of a cantilever of the length h, from the clamp to the tip, in
        units of h [-].  Their sum is at most 1; the rest is fixed at the clamp.
    K_theta : sequence of float
        Stiffness coefficients of the pivots, from the clamp to the tip, as many [-].
    reference : str
        The publication, for the documentation of FMUs.

    Raises
    ------
    ParameterError
        If the name is used or no identifier, or a coefficient is out of its bounds.

    Examples
    --------
    >>> model = register_model("Yu2012", (0.44, 0.46), (3.4710, 2.0682))
    >>> round(model.end_slope, 3)
    0.772
    >>> _ = MODELS.pop("Yu2012")
    """
    if not isinstance(name, str) or not name.isidentifier() or name in MODELS:
        raise ParameterError(
            f"model {name!r}: choose another name than {', '.join(MODELS)}, of letters, digits and "
            "_, that does not begin with a digit"
        )
    gamma, K_theta = _numbers("gamma", gamma), _numbers("K_theta", K_theta)
    if not 0 < len(gamma) == len(K_theta):
        raise ParameterError(
            f"model {name}: {len(gamma)} lengths gamma and {len(K_theta)} stiffnesses K_theta; "
            "give as many of each"
        )
    if not (all(0.0 < x < math.inf for x in (*gamma, *K_theta)) and sum(gamma) < 1.0 + STUB_RTOL):
        raise ParameterError(
            f"model {name}: gamma = {gamma}, K_theta = {K_theta} must be positive and finite, "
            "and the sum of gamma at most 1"
        )
    lengths = tuple(
        _gamma(f"gamma{i}", x, f"link {i} from the clamp") for i, x in enumerate(gamma, 1)
    )
    stiffnesses = tuple(
        _K_theta(f"K_theta{i}", x, f"pivot {i} from the clamp") for i, x in enumerate(K_theta, 1)
    )
    references = (f"{reference} ({name}).",) if reference else ()
    MODELS[name] = FlexureModel(name, lengths, stiffnesses, False, False, reference, references)
    return MODELS[name]


def _numbers(name: str, given: Sequence[float]) -> tuple[float, ...]:
    """Return the coefficients of a model; reject what is no sequence of numbers."""
    try:
        each = tuple(given)
    except TypeError:
        raise ParameterError(
            f"{name} = {reprlib.repr(given)} must be a sequence of numbers; write one as (0.85,)"
        ) from None
    return tuple(number(f"{name}[{i}]", x) for i, x in enumerate(each))


LEAF, TAPER, NOTCH = "leaf", "taper", "notch"
PROFILES = (LEAF, TAPER, NOTCH)
CLAMP, PIN, FREE = "clamp", "pin", "free"
ENDS = (CLAMP, PIN, FREE)
LINKS_MAX = 200  # Links of a chain.
ORDER_DEFAULT = 3  # Order of a beam.
HINGE_ORDER_DEFAULT = 1  # Order of a notch without a waist.
ORDER_MAX = 12
NODES_EXTRA = 3  # Nodes of a beam beyond its order.
NODES_EXTRA_MIN = 2  # With fewer nodes a pinned beam has a motion without mass.
NOTCH_NODES = 8  # Least default number of nodes of a notch.
NODES_MAX = 24
THICK_NODES = 2  # Nodes of each thick part beside a notch: the inertia of a rod is exact.
FILLET_NODES = 4  # Nodes of each fillet of a notch.
LOCKING_ORDER_MAX = 2  # Up to this order, an inextensible beam between two clamps is too stiff.


@dataclass(frozen=True)
class Segments:
    """Rigid segments of a flexure, from its start to its end.

    Parameters
    ----------
    lengths : tuple of float, n + 2
        Lengths [m] of the segments: a stub at the start, n links, and a stub at the end.  Each stub
        is fixed to the body at its end of the flexure.
    rates : tuple of float, n + 1
        Rates of the torsion springs between consecutive segments [N m/rad].
    rods : tuple of float, n + 2
        Masses of the segments as slender rods [kg].
    lumps : tuple of float, n + 1
        Masses at the pivots [kg].
    axial : tuple of float, n
        Axial stiffness of the links [N/m]; 0 for rigid links.
    """

    lengths: tuple[float, ...]
    rates: tuple[float, ...]
    rods: tuple[float, ...]
    lumps: tuple[float, ...]
    axial: tuple[float, ...]

    def reversed(self) -> "Segments":
        """Return the segments from the end to the start."""
        return Segments(*(tuple(reversed(part)) for part in vars(self).values()))


def stub(gamma: Sequence[float]) -> float:
    """Return the length of the stub at the clamp, gamma0 = 1 - sum(gamma), in units of h [-].

    Raises
    ------
    ParameterError
        If the links are longer than the cantilever.

    Examples
    --------
    >>> round(stub([0.44, 0.46]), 12)
    0.1
    """
    gamma0 = 1.0 - sum(gamma)
    if gamma0 < -STUB_RTOL:
        raise ParameterError(
            f"the links of a flexure are longer than the flexure: the sum of its gammas is "
            f"{sum(gamma):.6g}, so that gamma0 = {gamma0:.6g} < 0; choose gammas that add up "
            "to at most 1"
        )
    return max(gamma0, 0.0)


def segments(
    model: FlexureModel,
    gamma: Sequence[float],
    K_theta: Sequence[float],
    ends: tuple[str, str],
    L: float,
    EI: float,
    mass: float,
    EA: float = 0.0,
) -> Segments:
    """Return the rigid segments, springs and masses of a flexure.

    The spring rates are K_i = K_theta_i EI/h, or gamma_i K_theta_i EI/h with ``rate_with_gamma``.

    Each pivot of the 1R has the mass m/4 + (m L^2/12)/(gamma L)^2, with the mass m of the flexure
    (eq. 3.3 of Boersma, MSc thesis, TU Delft, 2015).  If one pivot is at rest and the other moves
    on a circle of the radius gamma L, the kinetic energy is that of a uniform rod of the length L
    whose centre moves on a circle of the radius gamma L/2.  With a free end, or two pinned ends,
    the 1R consists of rods like the other models.

    Parameters
    ----------
    model : FlexureModel
        Model that the coefficients belong to.
    gamma, K_theta : sequences of float
        Values of the coefficients, from the clamp to the tip [-].
    ends : pair of {"clamp", "pin", "free"}
        Types of the start and the end; a free end needs a clamp at the other end.
    L, EI, mass : float
        Length [m], bending stiffness [N m^2] and mass [kg] of the flexure.
    EA : float
        Axial stiffness [N]; 0 for an inextensible flexure.

    Returns
    -------
    Segments
        Segments from the start to the end of the flexure.

    Raises
    ------
    ParameterError
        If the links are longer than the flexure.

    Examples
    --------
    The 1R flexure between two clamps is a link gamma L between springs 2 gamma K_theta EI/L:

    >>> s = segments(MODELS["1R"], [0.8], [2.5], ("clamp", "clamp"), 1.0, 1.0, 0.0)
    >>> [round(l, 12) for l in s.lengths], s.rates
    ([0.1, 0.8, 0.1], (4.0, 4.0))
    """
    if model.links:
        lengths, rates = _chain(model.links, ends, L, EI)
    elif ends == (PIN, PIN):
        lengths, rates = [0.0, L, 0.0], [0.0, 0.0]
    else:
        lengths, rates = _cantilevers(model, gamma, K_theta, ends, L, EI)
    links = lengths[1:-1]
    lumps, rods = [0.0] * len(rates), [mass * length / L for length in lengths]
    if model.lumped and FREE not in ends and CLAMP in ends:
        lumps = [mass / 4 + (mass * L**2 / 12) / max(links) ** 2] * len(rates)
        rods = [0.0] * len(lengths)
    if model.links:
        axial = [model.links * EA / L] * len(links)
    else:
        from_clamp = len(links) // 2
        middle = from_clamp if ends[0] == CLAMP else len(links) - 1 - from_clamp
        axial = [EA / L if i == middle else 0.0 for i in range(len(links))]
    return Segments(tuple(lengths), tuple(rates), tuple(rods), tuple(lumps), tuple(axial))


def _chain(n: int, ends: tuple[str, str], L: float, EI: float) -> tuple[list[float], list[float]]:
    """Return lengths and rates of a chain of n equal links."""
    rate = n * EI / L
    at_start, at_end = (0.0 if end == PIN else 2 * rate for end in ends)
    return [0.0, *[L / n] * n, 0.0], [at_start, *[rate] * (n - 1), at_end]


def _rates(model: FlexureModel, gamma: Sequence[float], K_theta: Sequence[float]) -> list[float]:
    """Return the rates of the springs of a cantilever, in units of EI/h [-]."""
    if not model.rate_with_gamma:
        return [*K_theta]
    return [g * K for g, K in zip(gamma, K_theta, strict=True)]


def _cantilevers(
    model: FlexureModel,
    gamma: Sequence[float],
    K_theta: Sequence[float],
    ends: tuple[str, str],
    L: float,
    EI: float,
) -> tuple[list[float], list[float]]:
    """Return lengths and rates of one cantilever, or of two mirrored ones."""
    h = L / 2 if ends == (CLAMP, CLAMP) else L
    half = [h * g for g in (stub(gamma), *gamma)]
    stiffness = [rate * EI / h for rate in _rates(model, gamma, K_theta)]
    if ends == (CLAMP, CLAMP):
        return [*half[:-1], 2 * half[-1], *reversed(half[:-1])], [*stiffness, *stiffness[::-1]]
    if FREE in ends:  # The last link is fixed to the body.
        lengths, rates = half, stiffness
    else:
        lengths, rates = [*half, 0.0], [*stiffness, 0.0]
    if ends[0] != CLAMP:
        return lengths[::-1], rates[::-1]
    return lengths, rates
