"""Responses of a mechanism at given times, and parameters fitted to computed responses."""

from collections.abc import Mapping, Sequence

import numpy as np

from ...data.series import Series
from ...mechanics.arrays import Real
from ...mechanism.description import Mechanism
from ..fit import DISPLACEMENT, Fit, Response, fit

SIMULATION_RTOL = 1e-7  # Tolerance in a fit, whose finite differences are about 1e-4.


def response(
    mechanism: Mechanism,
    values: Mapping[str, float],
    times: Real,
    tolerance: float = SIMULATION_RTOL,
    engine: str | None = None,
) -> Real:
    """Return the displacement of the released body along its release at times, (m,) [m]."""
    seen = Response(Series(times, np.zeros(len(times))), DISPLACEMENT, None, tolerance, engine)
    return seen.model(mechanism, values)


def fit_response(
    mechanism: Mechanism,
    names: Sequence[str],
    times: Real,
    wanted: Real,
    values: Mapping[str, float] | None = None,
    *,
    engine: str | None = None,
) -> Fit:
    """Fit parameters of a mechanism to a computed response, starting from their values.

    Parameters
    ----------
    mechanism : Mechanism
        The model, for instance a 1R guide.
    names : sequence of str
        Parameters to fit.
    times : (m,)
        Increasing times since the release [s].
    wanted : (m,)
        Displacement of the released body along the direction of its release [m].
    values : mapping
        Parameters that differ from their defaults.
    engine : str or None
        As for :func:`prbm.simulate`.

    Raises
    ------
    ParameterError
        If a name is unknown.
    RecordError
        If the times have gaps or are fewer than 16.
    """
    series = Series(times, wanted, DISPLACEMENT)
    target = Response(series, DISPLACEMENT, None, SIMULATION_RTOL, engine)
    return fit(mechanism, names, target, values, starts=1)
