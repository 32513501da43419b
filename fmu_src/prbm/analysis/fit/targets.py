"""Targets of a fit: frequencies, responses and forces with their uncertainties."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from ...base.names import unknown
from ...data.series import Series
from ...data.uncertainty import Estimate, EvaluationError
from ...mechanics.arrays import Real
from ...mechanics.assembly import assemble
from ...mechanics.modal import modes
from ...mechanics.statics import equilibrium
from ...mechanism.description import Mechanism
from ...runs.engine import Engine, simulation
from ...runs.released import displacement_outputs, released_displacement

RECORD_SHIFT, RECORD_ZERO = "record.shift", "record.zero"
RECORD_UNITS = {RECORD_SHIFT: "s", RECORD_ZERO: "m"}  # Parameters of a record, not of a mechanism.
DISPLACEMENT = "displacement"  # Output: displacement of the released point along its release.


class Target(Protocol):
    """Data with an uncertainty, and the corresponding values of a model.

    An ``uncertainty`` of None is estimated from the residuals.
    """

    @property
    def label(self) -> str:
        """Label for people."""

    @property
    def unit(self) -> str:
        """Unit of the data."""

    @property
    def data(self) -> Real:
        """The data, (m,)."""

    @property
    def uncertainty(self) -> float | None:
        """Standard uncertainty of one value; None: estimated from the residuals."""

    def model(self, mechanism: Mechanism, values: Mapping[str, float]) -> Real:
        """Return the values of a mechanism with these parameters, (m,)."""


@dataclass(frozen=True)
class Frequency:
    """A natural frequency, measured or computed by finite elements.

    Parameters
    ----------
    frequency : Estimate
        Frequency with a standard uncertainty above zero [Hz].
    mode : int
        Number of the mode, 1 for the fundamental.
    displacement : float or None
        Displacement at which a force holds the released body [m]; None: the equilibrium under
        gravity.
    """

    frequency: Estimate
    mode: int = 1
    displacement: float | None = None
    unit: str = field(default="Hz", init=False)

    def __post_init__(self) -> None:
        if not isinstance(self.frequency, Estimate):
            raise EvaluationError(
                f"frequency = {self.frequency!r} has no uncertainty, the weight of a target: give "
                "Frequency(Estimate(value, standard uncertainty)), both in Hz"
            )
        if not 0.0 < self.frequency.uncertainty < math.inf or self.frequency.value <= 0.0:
            raise EvaluationError(
                f"frequency {self.frequency}: give a positive value and its standard uncertainty, "
                "for a computed frequency half of its last digit"
            )
        if self.mode < 1:
            raise EvaluationError(f"mode = {self.mode}: the fundamental is 1")

    @property
    def label(self) -> str:
        """Label for people."""
        where = "rest" if self.displacement is None else f"{1e3 * self.displacement:g} mm"
        return f"frequency {self.mode} at {where}"

    @property
    def data(self) -> Real:
        """The frequency, (1,)."""
        return np.array([self.frequency.value])

    @property
    def uncertainty(self) -> float | None:
        """Standard uncertainty [Hz]."""
        return self.frequency.uncertainty

    def model(self, mechanism: Mechanism, values: Mapping[str, float]) -> Real:
        """Return the frequency of the mechanism, (1,) [Hz]."""
        system = assemble(mechanism, mechanism.values(of_mechanism(values)))
        if self.displacement is not None:
            check_displaced(mechanism)
        found = modes(system, equilibrium(system, self.displacement)).frequency
        if self.mode > len(found):
            raise EvaluationError(
                f"{self.label}: {mechanism.name} has {len(found)} modes; choose a model with more"
            )
        return found[self.mode - 1 : self.mode]


@dataclass(frozen=True)
class Response:
    """An output over time, since the release at t = 0.

    Parameters
    ----------
    series : Series
        The record, with times since the release.
    output : str
        Name of the output, for instance ``shuttle.x``; or ``displacement``, that of the released
        point along the direction of its release.
    uncertainty : float or None
        Standard uncertainty of a sample; None: estimated from the residuals.
    tolerance : float or None
        Relative tolerance of the integration (default: ``solver.tolerance``).
    engine : str or None
        As for :func:`prbm.simulate`.
    """

    series: Series
    output: str = "shuttle.x"
    uncertainty: float | None = None
    tolerance: float | None = None
    engine: str | None = None

    def __post_init__(self) -> None:
        if self.uncertainty is not None and not 0.0 < self.uncertainty < math.inf:
            raise EvaluationError(
                f"uncertainty = {self.uncertainty:g} of {self.output}: it must be positive; give "
                "None to have it estimated"
            )

    @property
    def label(self) -> str:
        """Label for people."""
        return f"{self.output} over time"

    @property
    def unit(self) -> str:
        """Unit of the signal."""
        return self.series.unit

    @property
    def data(self) -> Real:
        """The samples, (m,)."""
        return self.series.values

    def model(self, mechanism: Mechanism, values: Mapping[str, float]) -> Real:
        """Return the output of the mechanism at the times of the record, (m,)."""
        times = self.series.time + values.get(RECORD_SHIFT, 0.0)
        motion = simulation(
            mechanism, of_mechanism(values), tolerance=self.tolerance, engine=self.engine
        )
        signal = _outputs(motion, np.maximum(times, motion.time), self.output)
        return signal + values.get(RECORD_ZERO, 0.0)


def _outputs(motion: Engine, times: Real, name: str) -> Real:
    """Return an output, or the displacement of the released point [m], at times."""
    if name == DISPLACEMENT:
        needed = displacement_outputs(motion.mechanism.release)
        columns = dict(zip(needed, motion.sample(times, needed).T, strict=True))
        return released_displacement(motion.system, columns)
    known = motion.outputs()
    if name not in known:
        raise EvaluationError(unknown(name, {DISPLACEMENT: 0.0, **known}))
    return motion.sample(times, [name])[:, 0]


@dataclass(frozen=True)
class ForceDeflection:
    """The force that holds the released body displaced along the direction of the release.

    Parameters
    ----------
    displacement, force : (m,)
        Displacements from the straight shape [m]; forces, positive along the displacement [N].
    uncertainty : float or None
        Standard uncertainty of a force [N]; None: estimated from the residuals.
    """

    displacement: Real
    force: Real
    uncertainty: float | None = None
    label: str = field(default="force over deflection", init=False)
    unit: str = field(default="N", init=False)

    def __post_init__(self) -> None:
        if len(self.displacement) != len(self.force) or not len(self.force):
            raise EvaluationError(
                f"{len(self.displacement)} displacements for {len(self.force)} forces: give pairs"
            )
        if self.uncertainty is not None and not 0.0 < self.uncertainty < math.inf:
            raise EvaluationError(f"uncertainty = {self.uncertainty:g} N must be positive, or None")

    @property
    def data(self) -> Real:
        """The forces, (m,)."""
        return self.force

    def model(self, mechanism: Mechanism, values: Mapping[str, float]) -> Real:
        """Return the forces of the mechanism, (m,) [N]."""
        check_displaced(mechanism)
        system = assemble(mechanism, mechanism.values(of_mechanism(values)))
        forces = [equilibrium(system, float(x)).force for x in self.displacement]
        return np.array(forces) + values.get(RECORD_ZERO, 0.0)


def check_displaced(mechanism: Mechanism) -> None:
    """Reject a mechanism that is held at an angle, for a quantity at a displacement.

    Raises
    ------
    EvaluationError
        If the release is by an angle.
    """
    if mechanism.release.turns:
        raise EvaluationError(
            f"{mechanism.release.body} is released by an angle: for forces and frequencies at a "
            "displacement, give release.displacement and release.point in the mechanism file"
        )


def of_mechanism(values: Mapping[str, float]) -> dict[str, float]:
    """Return the values of the mechanism, without those of a record."""
    return {name: x for name, x in values.items() if name not in RECORD_UNITS}


def check_shape(target: Target, found: Real) -> None:
    """Reject values of a model that do not have the shape of the data."""
    if np.shape(found) != np.shape(target.data):
        raise EvaluationError(
            f"{target.label}: its model returns {_counted(found)}, its data are "
            f"{_counted(target.data)}: return one value for each of the data"
        )


def _counted(x: Real) -> str:
    shape = np.shape(x)
    return f"an array of length {shape[0]}" if len(shape) == 1 else f"an array of shape {shape}"
