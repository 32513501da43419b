r"""Explicit Runge-Kutta pairs as data, one step, its error and its dense output.

Sources
-------
.. [1] P. Bogacki, L. F. Shampine, Comput. Math. Appl. 32 (1996) 15 (the pair 5(4)).
.. [2] E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, II.4-II.6.
"""

from collections.abc import Callable
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
        y(theta) = y0 + h sum_i k_i sum_j dense_ij theta^(j+1).
    order : int
        Of the solution that is continued.

    Raises
    ------
    ValueError
        If the coefficients contradict each other.
    """

    a: Real
    error: Real
    dense: Real
    order: int

    def __post_init__(self) -> None:
        if np.any(np.triu(self.a)):
            raise ValueError("the stages of an explicit method depend on earlier stages only")
        if max(abs(self.weights.sum() - 1), abs(self.error.sum())) > TABLEAU_ATOL:
            raise ValueError("the weights must add up to one, those of the error to zero")
        if not np.allclose(self.dense.sum(axis=1), self.weights, rtol=0, atol=TABLEAU_ATOL):
            raise ValueError("the dense output must end at the solution")

    @cached_property
    def c(self) -> Real:
        """Nodes, the row sums of a."""
        result: Real = self.a.sum(axis=1)
        return result

    @property
    def weights(self) -> Real:
        """Weights of the solution, the last row of a."""
        result: Real = self.a[-1]
        return result


def _lower(*rows: tuple[float, ...]) -> Real:
    a = np.zeros((len(rows), len(rows)))
    for i, row in enumerate(rows):
        a[i, : len(row)] = row
    return a


BOGACKI_SHAMPINE = Tableau(
    a=_lower(
        (),
        (1 / 6,),
        (2 / 27, 4 / 27),
        (183 / 1372, -162 / 343, 1053 / 1372),
        (68 / 297, -4 / 11, 42 / 143, 1960 / 3861),
        (597 / 22528, 81 / 352, 63099 / 585728, 58653 / 366080, 4617 / 20480),
        (174197 / 959244, -30942 / 79937, 8152137 / 19744439, 666106 / 1039181, -29421 / 29068,
         482048 / 414219),
        (587 / 8064, 0, 4440339 / 15491840, 24353 / 124800, 387 / 44800, 2152 / 5985,
         7267 / 94080),
    ),
    error=np.array(
        (-3817 / 1959552, 0, 140181 / 15491840, -4224731 / 272937600, 8557 / 403200,
         -57928 / 4363065, -23930231 / 4366535040, 3293 / 556956),
    ),
    # ours: of the interpolants of order 4 with a continuous derivative on these stages, the one
    # that violates the conditions of order 5 least over the step
    dense=np.array(
        (
            (1, -6409 / 2016, 1051 / 288, -11269 / 8064),
            (0, 0, 0, 0),
            (0, 12398103 / 3872960, -2907981 / 553280, 7254279 / 3098368),
            (0, 302869 / 280800, -386561 / 280800, 110789 / 224640),
            (0, -1161 / 11200, 387 / 1600, -1161 / 8960),
            (0, -28192 / 17955, 11744 / 2565, -9512 / 3591),
            (0, -7267 / 7840, 7267 / 3360, -7267 / 6272),
            (0, 3 / 2, -4, 5 / 2),
        )
    ),
    order=5,
)  # fmt: skip
"""The pair of the engine, chosen by ``benchmarks/work_precision.py``: at the accuracy of the
default run it needs 0.6 to 0.7 of the right-hand sides of Dormand and Prince's 5(4)."""


def stages(tableau: Tableau, f: Rate, t: float, y: Real, h: float, k1: Real) -> tuple[Real, Real]:
    """Return the stages k (s, n) and the new state y1 (n,) of a step of size h from t, y.

    Examples
    --------
    y' = t^4 is integrated exactly by a method of order five:

    >>> f = lambda t, y: np.array([t**4])
    >>> k, y1 = stages(BOGACKI_SHAMPINE, f, 0.0, np.zeros(1), 1.0, np.zeros(1))
    >>> round(y1.item(), 12)
    0.2
    """
    a, c = tableau.a * h, (tableau.c * h).tolist()
    k = np.empty((len(c), len(y)))
    k[0] = k1
    y1 = y
    for i in range(1, len(c)):
        y1 = y + a[i, :i] @ k[:i]
        k[i] = f(t + c[i], y1)
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
