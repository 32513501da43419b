"""Runs of an FMU for a study, in a process of their own, which may crash (:mod:`.children`).

The module imports only FMPy and NumPy, and so starts quickly.  The library is loaded once.  Every
run has a new instance, so that its result does not depend on the runs before.
"""

import io
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from ctypes import c_uint
from dataclasses import dataclass, field, replace
from math import isclose
from pathlib import Path
from typing import TYPE_CHECKING, Any

import fmpy  # type: ignore[import-untyped]
import numpy as np
from fmpy.fmi1 import FMICallException  # type: ignore[import-untyped]
from fmpy.simulation import (  # type: ignore[import-untyped]
    apply_start_values,
    instantiate_fmu,
    settable_in_initialization_mode,
    settable_in_instantiated,
)
from numpy.typing import NDArray

from ..runs.quantities import FREQUENCY
from .children import Job, Row
from .outputs import ENDED, FAILED, OK, Outcome, evaluate

if TYPE_CHECKING:
    from ..runs.driving import Driver

SAMPLING_TOLERANCE = 1e-6  # Of inputs over time, if the FMU proposes no tolerance.
DISCARD, FATAL = 2, 4  # Values of fmi2Status and fmi3Status.
LAST_TIME, TERMINATED = 2, 3  # Values of fmi2StatusKind.
TYPES_2 = {"Real": np.double, "Integer": np.intc, "Boolean": np.intc}
"""Types of the numbers of FMI 2.0; those of FMI 3.0 have the names of NumPy, or are Boolean."""
MESSAGES_MAX = 5  # Most messages of the FMU in the message of a failed run.


# --- one run ------------------------------------------------------------------------------------


@dataclass(frozen=True)
class FmuJob(Job):
    """Runs of an FMU: its bytes, or the folder of the unpacked FMU on a machine."""

    content: bytes = field(default=b"", repr=False)
    folder: str = ""

    @property
    def settings(self) -> dict[str, Any]:
        """Times and tolerance, for the journal."""
        return {"start time [s]": self.start, **super().settings}

    @contextmanager
    def placed(self) -> Iterator[Job]:
        """Unpack the FMU."""
        from ..fmu.unpack import unpacked  # imported here: the processes do not need it

        with unpacked(io.BytesIO(self.content)) as folder:
            yield replace(self, content=b"", folder=str(folder))

    def opened(self) -> Callable[[Row], Outcome]:
        """Load the FMU; return the function that runs it."""
        try:
            return LoadedFmu(self.folder, self).run
        except Exception as error:  # FMPy raises plain exceptions.
            raise RuntimeError(f"the FMU cannot be loaded: {error}") from None


def input_units(description: Any) -> dict[str, str]:
    """Return the units of the inputs of an FMU that can have signals, by name."""
    return {
        v.name: unit(v) for v in description.modelVariables
        if v.causality == "input" and v.type in ("Real", "Float64") and not v.shape
    }  # fmt: skip


def unit(variable: Any) -> str:
    """Return the unit of a variable, or that of its declared type; empty without one."""
    return variable.unit or getattr(variable.declaredType, "unit", None) or ""


def communication_points(start: float, stop: float, step: float) -> list[float]:
    """Return start, start + step, start + 2 step, ... [s], bit by bit as in FMPy.

    Examples
    --------
    >>> communication_points(0.0, 1.0, 0.4)
    [0.0, 0.4, 0.8, 1.0]
    >>> communication_points(0.0, 0.3, 0.1)
    [0.0, 0.1, 0.2, 0.30000000000000004]
    """
    points, t = [start], start
    while not (t > stop or isclose(t, stop)):
        t = start + len(points) * step
        if t > stop and not isclose(t, stop):
            t = stop
        points.append(t)
    return points


class LoadedFmu:
    """Runs the FMU that is unpacked in a folder repeatedly.

    Raises
    ------
    Exception
        Any exception of FMPy, if the FMU cannot be loaded or instantiated.
    """

    def __init__(self, folder: str | Path, job: FmuJob) -> None:
        self.job, self.messages = job, list[tuple[int, str]]()
        self.description = fmpy.read_model_description(str(folder), validate=False)
        # Whether the FMU is of FMI 2.0, not 3.0.
        self.two = self.description.fmiVersion.startswith("2")
        variables = self.description.modelVariables
        self.events = not self.two and any(v.type == "Clock" for v in variables)
        self.points = communication_points(job.start, job.stop, job.step)
        self.fmu = instantiate_fmu(
            str(folder),
            self.description,
            "CoSimulation",
            event_mode_used=self.events,
            debug_logging=True,
            logger=self._log,
            require_functions=False,
        )
        self.named = {variable.name: variable for variable in variables}
        self.time, self.used = job.start, False
        self.ended: float | None = None  # The time at which the FMU ended the simulation [s].
        self.history, self.final = (
            _Recorder(
                self.fmu,
                {
                    name: self.named[name]
                    for output in job.outputs
                    if (output.reduction == "final") == at_end
                    for name in output.variables(self.named)
                },
                self.two,
            )
            for at_end in (False, True)
        )

    def run(self, row: Row) -> Outcome:
        """Run once with start values; errors are returned as outcomes, not raised.

        Raises
        ------
        Exception
            Any exception of FMPy, if there is no new instance; another process may give one.
        """
        if self.used:
            self._renew()
        self.used = True
        self.messages.clear()
        spent = self.description.coSimulation.canBeInstantiatedOnlyOncePerProcess
        try:
            return Outcome(*self._simulate(*self._driven(row)), spent=spent)
        except Exception as error:
            fatal = isinstance(error, FMICallException) and error.status == FATAL
            return Outcome(FAILED, self._reason(error), spent=spent or fatal)

    def _renew(self) -> None:
        """Replace the instance; the library stays loaded."""
        if self.two:
            self.fmu.fmi2FreeInstance(self.fmu.component)
            self.fmu.instantiate(callbacks=self.fmu.callbacks, loggingOn=True)
        else:
            self.fmu.fmi3FreeInstance(self.fmu.component)
            self.fmu.instantiate(eventModeUsed=self.events, logMessage=self._log, loggingOn=True)

    def _reason(self, error: Exception) -> str:
        """Return the FMU's messages about an error, or else FMPy's message."""
        worst = [text for status, text in self.messages if status >= DISCARD]
        texts = list(dict.fromkeys(worst or [text for _, text in self.messages]))[-MESSAGES_MAX:]
        return "; ".join(texts) or str(error) or type(error).__name__

    def _log(self, *arguments: Any) -> None:
        """Keep a message; in FMI 2.0, the name of the instance is before its status."""
        status, _, text = arguments[-3:]
        if status > 0:
            self.messages.append((status, (text or b"").decode(errors="replace").strip()))
            del self.messages[: -10 * MESSAGES_MAX]

    def _driven(self, row: Row) -> tuple[dict[str, float], "Driver | None"]:
        """Return the start values of a run, and the driver of its inputs over time."""
        values, inputs = self.job.driven(row)
        if not inputs:
            return values, None
        from ..runs.driving import Driver  # imported here: few sweeps need it
        from ..runs.inputs import driving

        driver = Driver(driving(input_units(self.description), (), inputs, values), self.job.start)
        return {**values, **driver.values(self.job.start)}, driver

    def _simulate(
        self, values: dict[str, float], driver: "Driver | None"
    ) -> tuple[str, str, tuple[float, ...]]:
        self._initialize(values)
        self.time, self.ended = self.job.start, None
        if driver is not None:
            frequency = self._frequency()
            driver.sample(frequency, self.job.tolerance or SAMPLING_TOLERANCE, self.job.stop)
        times, rows = [self.points[0]], [self.history.read()]
        status, message = OK, ""
        for end in self.points[1:]:
            if driver is None:
                self.advance(end)
            else:
                driver.advance(self, end)
            times.append(end if self.ended is None else self.ended)
            rows.append(self.history.read())
            if self.ended is not None:
                status, message = ENDED, f"the FMU ended the run at t = {self.ended:.9g} s"
                break
        columns = self.final.columns([self.final.read()])
        self.fmu.terminate()
        columns |= self.history.columns(rows) | {"time": np.array(times)}
        return status, message, tuple(evaluate(output, columns) for output in self.job.outputs)

    def _initialize(self, values: dict[str, float]) -> None:
        """Set start values and pass through initialization, in FMPy's order."""
        experiment = {
            "tolerance": self.job.tolerance, "startTime": self.job.start, "stopTime": self.job.stop,
        }  # fmt: skip
        if self.two:
            self.fmu.setupExperiment(**experiment)
        rest = self._set(values, settable_in_instantiated)
        self.fmu.enterInitializationMode(**({} if self.two else experiment))
        rest = self._set(rest, settable_in_initialization_mode)
        self.fmu.exitInitializationMode()
        if rest:
            raise ValueError(f"the FMU has no start values for {', '.join(rest)}")
        if self.events:
            self._update()

    def _set(self, values: dict[str, float], when: Callable[[Any], bool]) -> dict[str, float]:
        """Set the values that can be set in the present mode; return the others."""
        return apply_start_values(self.fmu, self.description, values, settable=when)  # type: ignore[no-any-return]

    def _frequency(self) -> float:
        """Return the fundamental frequency [Hz]; 0 if the FMU has no such variable."""
        if FREQUENCY not in self.named:
            return 0.0
        get = self.fmu.getReal if self.two else self.fmu.getFloat64
        return float(get([self.named[FREQUENCY].valueReference])[0])

    def set(self, changes: Mapping[str, float]) -> None:
        """Set inputs, unless the FMU has ended the simulation."""
        if self.ended is None:
            setter = self.fmu.setReal if self.two else self.fmu.setFloat64
            setter([self.named[name].valueReference for name in changes], [*changes.values()])

    def advance(self, time: float) -> None:
        """Step to a time [s], unless the FMU has ended the simulation; ``ended`` is that time."""
        if self.ended is not None:
            return
        begin, self.time = self.time, time
        if not self.two:
            event, ended, _, last = self.fmu.doStep(begin, time - begin)
            if self.events and event and not ended:
                self.fmu.enterEventMode()
                ended = self._update()
            self.ended = float(last) if ended else None
            return
        try:
            self.fmu.doStep(begin, time - begin)
        except FMICallException as error:
            if not (error.status == DISCARD and self.fmu.getBooleanStatus(TERMINATED)):
                raise
            self.ended = float(self.fmu.getRealStatus(LAST_TIME))

    def _update(self) -> bool:
        """Update discrete states, leave event mode; return whether the FMU ended the simulation."""
        again, ended = True, False
        while again and not ended:
            again, ended = self.fmu.updateDiscreteStates()[:2]
        if not ended:
            self.fmu.enterStepMode()
        return bool(ended)


class _Recorder:
    """Reads variables into memory allocated once; FMPy's getters allocate at each call."""

    def __init__(self, fmu: Any, variables: Mapping[str, Any], two: bool) -> None:
        groups: dict[str, list[str]] = {}  # by type: one call of FMI per type
        for name, variable in variables.items():
            whole = "Integer" if two else "Int64"
            kind = whole if variable.type == "Enumeration" else variable.type
            groups.setdefault(kind, []).append(name)
        self.fmu, self.calls = fmu, list[tuple[Any, tuple[Any, ...], Any]]()
        self.names = [name for group in groups.values() for name in group]
        for kind, group in groups.items():
            n = len(group)
            kept = TYPES_2[kind] if two else np.dtype(kind.lower().replace("boolean", "bool"))
            values = np.ctypeslib.as_ctypes(np.zeros(n, kept))
            references = (c_uint * n)(*(variables[name].valueReference for name in group))
            function = getattr(fmu, f"fmi{2 if two else 3}Get{kind}")
            self.calls.append((function, (references, n, values) + (() if two else (n,)), values))

    def read(self) -> list[float]:
        """Return the values, type by type."""
        row: list[float] = []
        for function, arguments, values in self.calls:
            function(self.fmu.component, *arguments)
            row += values
        return row

    def columns(self, rows: Sequence[Sequence[float]]) -> dict[str, NDArray[np.float64]]:
        """Return the columns of rows of :meth:`read` by the names of the variables."""
        return dict(zip(self.names, np.array(rows, np.float64).T, strict=True))
