"""The choice of the engine: the C kernel, or the Python engine, which is the specification."""

import logging
from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any, Protocol

from ..base.errors import MechanismError, ParameterError, PrbmError
from ..hybrid.configuration import Configuration
from ..hybrid.outputs import Outputs
from ..hybrid.records import Impact
from ..hybrid.simulation import Simulation
from ..kernel.library import library
from ..kernel.simulation import KernelSimulation
from ..mechanics.arrays import Real
from ..mechanics.start import Instability
from ..mechanics.stress import SectionStresses
from ..mechanics.system import System
from ..mechanism.description import Mechanism

KERNEL, PYTHON = ENGINES = ("kernel", "python")

log = logging.getLogger(__name__)


class Engine(Protocol):
    """A mechanism in motion, in one of the engines.

    :class:`prbm.hybrid.simulation.Simulation` describes the attributes and methods.
    """

    engine: str
    given: dict[str, float]
    record: list[Impact] | None

    @property
    def time(self) -> float:
        """Present time [s]."""

    @property
    def mechanism(self) -> Mechanism:
        """Description of the mechanism."""

    @property
    def values(self) -> Mapping[str, float]:
        """Values of all parameters."""

    @property
    def configuration(self) -> Configuration:
        """Mechanism, parameters, tolerances and scales."""

    @property
    def system(self) -> System:
        """The constant arrays."""

    def section_stresses(self) -> SectionStresses:
        """Return the stress of both faces in all sections at the present time, by flexure [Pa]."""

    @property
    def frequency(self) -> float:
        """Fundamental frequency at the start [Hz]; 0: none."""

    @property
    def tolerance(self) -> float:
        """Relative tolerance of the integration."""

    @property
    def step_count(self) -> int:
        """Integration steps since the start."""

    def set(self, changes: Mapping[str, float]) -> None:
        """Change inputs and tunable parameters from the present time on."""

    def advance(self, time: float) -> None:
        """Continue the motion to a time [s]."""

    def instability(self) -> Instability:
        """Return the numbers of unstable directions at the start."""

    def check_effort(self, step: float) -> None:
        """Reject a communication step [s] that needs too many integration steps."""

    def state(self) -> Real:
        """Return the state (2 n + 2,) at the present time."""

    def outputs(self) -> Outputs:
        """Return all outputs by name."""

    def motions(self) -> dict[str, float]:
        """Return the positions and velocities of bodies and probes."""

    def sample(
        self,
        times: Sequence[float] | Real,
        names: Sequence[str],
        events: list[list[float]] | None = None,
    ) -> Real:
        """Advance to each of several times and return outputs there, and beside events."""

    def snapshot(self) -> dict[str, Any]:
        """Return the complete state as plain values."""

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Restore a state of :meth:`snapshot` of the same engine."""


def simulation(
    mechanism: Mechanism,
    values: Mapping[str, float] | None = None,
    *,
    start_time: float = 0.0,
    tolerance: float | None = None,
    step: float | None = None,
    engine: str | None = None,
) -> Engine:
    """Start the motion of a mechanism.

    Parameters
    ----------
    mechanism : Mechanism
        Description.
    values : mapping or None
        Parameters and inputs that differ from their defaults.
    start_time : float
        Time at the start [s].
    tolerance : float or None
        Relative tolerance of the integration; None: ``solver.tolerance``.
    step : float or None
        Fixed step size for studies of convergence [s], in the Python engine only; None: adaptive.
    engine : str or None
        ``"kernel"`` or ``"python"``.  None: the kernel; or the Python engine, with a message in the
        log, if the kernel cannot be compiled or the mechanism is too large for it.

    Raises
    ------
    ParameterError, EquilibriumError, TypeError
        As :class:`prbm.hybrid.simulation.Simulation`; or if the engine is unknown.
    CompilerError, LibraryError, DamagedLibraryError
        If the kernel is chosen and cannot be compiled or loaded.

    Examples
    --------
    >>> from prbm.files.mechanism_file import load
    >>> motion = simulation(load("PRBDM"), {"stop.restitution": 0.5}, engine="python")
    >>> motion.advance(0.05)
    >>> int(motion.outputs()["stop.impact_count"])
    1
    """
    check_engine(engine)
    if engine == KERNEL and step is not None:
        raise ParameterError(f"step = {step} s: fixed steps need engine = {PYTHON!r}")
    if engine == KERNEL or (engine is None and step is None and kernel_available()):
        try:
            return KernelSimulation(mechanism, values, start_time=start_time, tolerance=tolerance)
        except MechanismError as error:
            if engine == KERNEL:
                raise
            _warn(f"{error}; the Python engine is used, which is slower")
    return Simulation(mechanism, values, start_time=start_time, tolerance=tolerance, step=step)


def check_engine(engine: str | None) -> None:
    """Reject the name of an unknown engine.

    Raises
    ------
    ParameterError
        If the engine is neither None nor one of :data:`ENGINES`.
    """
    if engine not in (None, *ENGINES):
        raise ParameterError(f"engine = {engine!r} must be one of {', '.join(ENGINES)}")


@cache
def kernel_available() -> bool:
    """Return whether the kernel can be loaded; log the reason if it cannot."""
    try:
        library()
    except PrbmError as error:
        _warn(f"the Python engine is used, which is slower: {error}")
        return False
    return True


@cache
def _warn(text: str) -> None:
    """Log a message once."""
    log.warning(text)
