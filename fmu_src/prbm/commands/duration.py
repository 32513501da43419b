"""Duration, communication step and inputs of a simulation, from the command line."""

import argparse
from collections.abc import Mapping
from typing import Any

from ..files.settings import optional_quantity, pairs, quantity
from ..mechanism.description import Mechanism
from ..runs.experiment import Experiment, experiment


def span(
    mechanism: Mechanism,
    values: Mapping[str, float],
    stop_time: str | None,
    step: str | None = None,
    engine: str | None = None,
) -> tuple[float, float]:
    """Return duration and communication step of a simulation [s].

    By default, they are those of the default experiment.  If only the duration is given, the step
    is at most a thousandth of it.

    Parameters
    ----------
    mechanism : Mechanism
        The mechanism to simulate.
    values : mapping
        Parameters and inputs that differ from their defaults.
    stop_time, step : str or None
        Options of the command, in seconds or with a unit.
    engine : str or None
        As for :func:`prbm.simulate`.

    Raises
    ------
    UserMistake
        If an option is not a time.
    ParameterError, EquilibriumError
        If the mechanism cannot start with these values.

    Examples
    --------
    >>> from prbm.files.mechanism_file import load
    >>> span(load("PRBDM"), {}, None), span(load("PRBDM"), {}, "200 ms", "1e-4")
    ((1.0, 0.001), (0.2, 0.0001))
    """
    duration = None if stop_time is None else quantity(stop_time, "s", "--stop-time")
    if step is not None and duration is not None:
        return duration, quantity(step, "s", "--step")
    chosen = experiment(mechanism, values, engine)
    if duration is None:
        duration, default = chosen.stop_time, chosen.step
    else:
        default = min(chosen.step, Experiment(duration).step) if duration > 0.0 else chosen.step
    return duration, default if step is None else quantity(step, "s", "--step")


def given_inputs(options: argparse.Namespace) -> dict[str, str]:
    """Return the signals that are given by --input, as texts by the names of the inputs."""
    return pairs(options.input, "--input", '--input "force.x=step(1 N, 10 ms)"')


def times(options: argparse.Namespace) -> dict[str, Any]:
    """Return stop time and step [s] and tolerance of a command; None for those not given."""
    return {
        "stop_time": optional_quantity(options.stop_time, "s", "--stop-time"),
        "step": optional_quantity(options.step, "s", "--step"),
        "tolerance": optional_quantity(options.tolerance, "", "--tolerance"),
    }
