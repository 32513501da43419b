r"""Explicit Runge-Kutta pairs as data, one step, its error and its dense output.

Sources
-------
.. [1] J. R. Dormand, P. J. Prince, J. Comput. Appl. Math. 6 (1980) 19 (the pair 5(4)).
.. [2] L. F. Shampine, Math. Comp. 46 (1986) 135 (its interpolant of order 4).
.. [3] E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, II.4-II.6.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .assembly import Real

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
        if abs(self.weights.sum() - 1) > 1e-14 or abs(self.error.sum()) > 1e-14:
            raise ValueError("the weights must add up to one, those of the error to zero")
        if not np.allclose(self.dense.sum(axis=1), self.weights, rtol=0, atol=1e-14):
            raise ValueError("the dense output must end at the solution")

    @property
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


DORMAND_PRINCE = Tableau(
    a=_lower(
        (),
        (1 / 5,),
        (3 / 40, 9 / 40),
        (44 / 45, -56 / 15, 32 / 9),
        (19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729),
        (9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656),
        (35 / 384, 0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84),
    ),
    error=np.array(
        (71 / 57600, 0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40),
    ),
    dense=np.array(
        (
            (1, -8048581381 / 2820520608, 8663915743 / 2820520608, -12715105075 / 11282082432),
            (0, 0, 0, 0),
            (0, 131558114200 / 32700410799, -68118460800 / 10900136933,
             87487479700 / 32700410799),
            (0, -1754552775 / 470086768, 14199869525 / 1410260304, -10690763975 / 1880347072),
            (0, 127303824393 / 49829197408, -318862633887 / 49829197408,
             701980252875 / 199316789632),
            (0, -282668133 / 205662961, 2019193451 / 616988883, -1453857185 / 822651844),
            (0, 40617522 / 29380423, -110615467 / 29380423, 69997945 / 29380423),
        )
    ),
    order=5,
)  # fmt: skip


def stages(tableau: Tableau, f: Rate, t: float, y: Real, h: float, k1: Real) -> tuple[Real, Real]:
    """Return the stages k (s, n) and the new state y1 (n,) of a step of size h from t, y.

    Examples
    --------
    y' = t^4 is integrated exactly by a method of order five:

    >>> f = lambda t, y: np.array([t**4])
    >>> k, y1 = stages(DORMAND_PRINCE, f, 0.0, np.zeros(1), 1.0, np.zeros(1))
    >>> round(y1.item(), 12)
    0.2
    """
    a, c = tableau.a * h, tableau.c * h
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
