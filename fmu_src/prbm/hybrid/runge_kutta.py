r"""Explicit Runge-Kutta pairs as data, one step, its error and its dense output.

Sources
-------
.. [1] Ch. Tsitouras, S. N. Papakostas, SIAM J. Sci. Comput. 20 (1999) 2067 (the pair NEW7(5)).
.. [2] E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, II.4-II.6.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..base.tolerances import TABLEAU_ATOL
from ..mechanics.arrays import Real

Rate = Callable[[float, Real], Real]


@dataclass(frozen=True)
class Tableau:
    """The coefficients of an embedded pair whose last stage is the first of the next step.

    Parameters
    ----------
    a : (s, s)
        Stages; strictly lower triangular, the last row equal to the weights.
    error : (s,)
        Weights of the difference between the two solutions; their sum is zero.
    dense : (s, d)
        Weights of the dense output, y(theta) = y0 + h sum_i k_i sum_j dense_ij theta^(j+1).
    order : int
        Order of the solution that is continued.
    error_order : int
        Order of the solution that estimates the error.
    coarse_order : int
        Order of the last stage but one, which is a third solution at the end of the step.

    Raises
    ------
    ValueError
        If the coefficients are inconsistent.
    """

    a: Real
    error: Real
    dense: Real
    order: int
    error_order: int
    coarse_order: int

    def __post_init__(self) -> None:
        if np.any(np.triu(self.a)):
            raise ValueError("the stages of an explicit method depend on earlier stages only")
        if max(abs(self.weights.sum() - 1), abs(self.error.sum())) > TABLEAU_ATOL:
            raise ValueError("the weights must add up to one, those of the error to zero")
        if abs(self.a[-2].sum() - 1) > TABLEAU_ATOL:
            raise ValueError("the last stage but one must be at the end of the step")
        if not np.allclose(self.dense.sum(axis=1), self.weights, rtol=0, atol=TABLEAU_ATOL):
            raise ValueError("the dense output must end at the solution")

    @cached_property
    def c(self) -> Real:
        """Nodes, the row sums of a."""
        result: Real = self.a.sum(axis=1)
        return result

    @cached_property
    def weights(self) -> Real:
        """Weights of the solution, the last row of a."""
        result: Real = self.a[-1]
        return result

    @cached_property
    def coarse_error(self) -> Real:
        """Weights of the difference between the solution and the last stage but one."""
        result: Real = self.a[-1] - self.a[-2]
        return result

    @property
    def step_order(self) -> int:
        """Power of the step size to which :func:`prbm.hybrid.stepping.step_error` falls."""
        return 2 * (self.error_order + 1) - (self.coarse_order + 1)


def _lower(*rows: tuple[float, ...]) -> Real:
    a = np.zeros((len(rows), len(rows)))
    for i, row in enumerate(rows):
        a[i, : len(row)] = row
    return a


TSITOURAS_PAPAKOSTAS = Tableau(
    a=_lower(
        (),
        (1 / 18,),
        (0, 1 / 9),
        (1 / 24, 0, 1 / 8),
        (2183971 / 4000000, 0, -8340813 / 4000000, 3968421 / 2000000),
        (695768212 / 7463744411, 0, -1803549175 / 7007942496, 3474507053 / 6790877290,
         2188198899 / 15264927763),
        (-11894934857 / 8390623634, 0, 53094780276 / 9800512003, -8415376229 / 2277049503,
         -18647567697 / 10138317907, 27551494893 / 11905950217),
        (30828057951 / 7654644085, 0, -4511704 / 324729, 16217851618 / 1651177175,
         282768186839 / 40694064384, -104400780537 / 15869257619, 5409241639 / 9600177208),
        (-133775720546 / 36753383835, 0, 49608695511 / 4066590848, -59896475201 / 7901259813,
         -48035527651 / 5727379426, 86266718551 / 10188951048, -7751618114 / 23575802495,
         2289274942 / 8464405725),
        (597988726 / 12374436915, 0, 0, 3138312158 / 11968408119, 480882843 / 7850665645,
         988558885 / 3512253271, 5302636961 / 26425940286, 1259489433 / 12163586030,
         1016647712 / 23899101975),
    ),
    error=np.array(
        (597988726 / 12374436915 - 1421940313 / 46193547077, 0, 0,
         3138312158 / 11968408119 - 1943068601 / 5911217046,
         480882843 / 7850665645 + 3807140880 / 8205366359,
         988558885 / 3512253271 - 9377220888 / 11577671635,
         5302636961 / 26425940286 - 586186883 / 5187186385,
         1259489433 / 12163586030 - 1114095023 / 8014791121, 0, 0),
    ),
    # The interpolant is ours: with a continuous derivative and order 5 on these stages, all weights
    # follow from two of them, -0.8 and 4.35, chosen so that the conditions of order 6 are violated
    # least over the step.
    dense=np.array(
        (
            (1, -5.11657953235126, 10.410498418563574, -9.229635639341074, 2.984041273275219),
            (0, 0, 0, 0, 0),
            (0, 0, 0, 0, 0),
            (0, 6.8347608878910915, -19.51500396092625, 19.83680695208382, -6.894347540267742),
            (0, -0.8, 4.35, -5.9937311657730135, 2.5049849326184113),
            (0, -1.5452268423412143, 8.812576891922602, -11.582173143867948, 4.596283116877283),
            (0, 0.014515356580194623, -1.3539176815097294, 3.6675907659249103,
             -2.1275281464661684),
            (0, 1.3363553437415805, -6.748671331145359, 10.006006118855854, -4.4901442338941),
            (0, 1.2761747864796078, -5.955482336904836, 8.29513611211745, -3.573289402142902),
            (0, -2, 10, -15, 7),
        )
    ),
    order=7,
    error_order=5,
    coarse_order=3,
)  # fmt: skip
"""The pair of the engine, chosen by ``benchmarks/work_precision.py``: of the pairs compared there,
it needs the fewest right-hand sides at the accuracy of the default run, and its interpolant needs
no further stage."""


def stages(tableau: Tableau, f: Rate, t: float, y: Real, h: float, k1: Real) -> tuple[Real, Real]:
    """Return the stages k (s, n) and the new state y1 (n,) of a step of size h from t, y.

    Examples
    --------
    y' = 7 t^6 is integrated exactly by a method of order seven:

    >>> f = lambda t, y: np.array([7.0 * t**6])
    >>> k, y1 = stages(TSITOURAS_PAPAKOSTAS, f, 0.0, np.zeros(1), 1.0, np.zeros(1))
    >>> round(y1.item(), 12)
    1.0
    """
    k = np.zeros((len(tableau.c), len(y)))
    k[0] = k1
    y1 = y
    for i, (a, c) in enumerate(zip(h * tableau.a[1:], tableau.c.tolist()[1:], strict=True), 1):
        y1 = y + a.dot(k)  # Stages from i on are zero.
        k[i] = f(t + c * h, y1)
    return k, y1


def powers(tableau: Tableau, theta: Real) -> Real:
    """Return the weights of the stages at fractions theta of a step, (len(theta), s)."""
    d = tableau.dense.shape[1]
    result: Real = theta[:, None] ** np.arange(1, d + 1) @ tableau.dense.T
    return result


def interpolate(tableau: Tableau, y: Real, k: Real, h: float, theta: float) -> Real:
    """Return the state at the fraction theta of a step."""
    b = tableau.dense @ theta ** np.arange(1, tableau.dense.shape[1] + 1)
    result: Real = y + h * (b @ k)
    return result


def hermite_weights(nodes: Sequence[float], t: float) -> tuple[Real, Real]:
    """Return the weights of the data at three nodes in a polynomial of degree eight at t.

    Parameters
    ----------
    nodes : (3,)
        Different times [s].
    t : float
        Time [s].

    Returns
    -------
    value : (3, 3)
        Weights of value, first and second derivative at each node in the value at t.
    rate : (3, 3)
        Their weights in the first derivative at t.

    Examples
    --------
    t^8 is reproduced, here at 3, where it is 6561 and its derivative 17496:

    >>> t = np.array([0.0, 1.0, 2.0])
    >>> data = np.array([t**8, 8 * t**7, 56 * t**6]).T
    >>> [float(round((w * data).sum(), 6)) for w in hermite_weights([0.0, 1.0, 2.0], 3.0)]
    [6561.0, 17496.0]
    """
    value, rate = np.empty((3, 3)), np.empty((3, 3))
    for i, node in enumerate(nodes):
        a, b = nodes[(i + 1) % 3], nodes[(i + 2) % 3]
        product, x = (node - a) * (node - b), t - node
        # With u = (t - a) (t - b)/product, the polynomials of the node are u^3 times the first
        # three terms of 1/u^3 (1, x, x^2/2) = (1 - c x + d x^2) (1, x, x^2/2).
        u, slope = (t - a) * (t - b) / product, ((t - a) + (t - b)) / product
        cube, cube_slope = u * u * u, 3.0 * u * u * slope
        sum_ = 1.0 / (node - a) + 1.0 / (node - b)
        c, d = 3.0 * sum_, 6.0 * sum_ * sum_ - 3.0 / product
        basis = (1.0 - c * x + d * x * x, x - c * x * x, 0.5 * x * x)
        slopes = (2.0 * d * x - c, 1.0 - 2.0 * c * x, x)
        for k in range(3):
            value[i, k] = cube * basis[k]
            rate[i, k] = cube_slope * basis[k] + cube * slopes[k]
    return value, rate


def rk4(f: Rate, t: float, y: Real, h: float) -> Real:
    """Return the state after a step of the classical method of order four (thesis 3.6 to 3.11).

    Examples
    --------
    >>> rk4(lambda t, y: np.array([4 * t**3]), 0.0, np.zeros(1), 1.0).item()
    1.0
    """
    k1 = f(t, y)
    k2 = f(t + h / 2, y + h / 2 * k1)
    k3 = f(t + h / 2, y + h / 2 * k2)
    k4 = f(t + h, y + h * k3)
    return y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
