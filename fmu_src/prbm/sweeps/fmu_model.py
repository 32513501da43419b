"""An FMU as the model of a study: its variables, times and inputs."""

import hashlib
import io
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Self

import fmpy  # type: ignore[import-untyped]
from fmpy.simulation import (  # type: ignore[import-untyped]
    settable_in_initialization_mode,
    settable_in_instantiated,
)

from ..base import reading
from ..base.archives import UNPACKED_SIZE_MAX, check_unpacked_size
from ..base.errors import ParameterError
from ..base.names import proposal
from ..files.settings import in_unit
from ..mechanism.parameters import Tolerance
from ..runs.inputs import driving, filled
from ..runs.quantities import FREQUENCY
from ..runs.run import communication_points
from .fmu import FmuJob, input_units, unit
from .outputs import FUNDAMENTAL, Output
from .runner import StudyError
from .table import BITS, number

OTHERS = (
    "; give an FMU, FILE.fmu; the command prbm study and prbm.study(prbm.load(NAME), ...) simulate "
    "a mechanism"
)
STEPS = 1000  # Communication steps for an FMU without a proposed step.
NAMES_LISTED_MAX = 10  # Messages with more settable variables refer to "fmpy info" instead.
FLOATS = ("Real", "Float32", "Float64")  # Types of variables.


def read_fmu(path: Path) -> tuple[bytes, Any]:
    """Return the bytes of an FMU and FMPy's model description.

    Raises
    ------
    StudyError
        If it cannot be read, or has no co-simulation of FMI 2.0 or 3.0.
    """
    other = OTHERS if path.suffix.lower() != ".fmu" else ""
    try:
        data = reading.content(path, UNPACKED_SIZE_MAX, StudyError)
    except StudyError as error:
        raise StudyError(f"{error}{other}") from None
    try:
        check_unpacked_size(io.BytesIO(data))
        description = fmpy.read_model_description(io.BytesIO(data), validate=False)
    except Exception as error:  # FMPy raises plain exceptions.
        reason = " ".join(str(error).split())
        raise StudyError(f"{path} is not a readable FMU: {reason}{other}") from None
    if not description.fmiVersion.startswith(("2", "3")) or description.coSimulation is None:
        raise StudyError(
            f"{path} (FMI {description.fmiVersion}): must have co-simulation of FMI 2.0 or 3.0; "
            "export such an FMU"
        )
    return data, description


class FmuModel:
    """An FMU, a :class:`prbm.sweeps.plan.Model`; errors are those of :func:`read_fmu`."""

    tolerances: Mapping[str, Tolerance] = {}

    def __init__(self, path: str | Path) -> None:
        self.content, self.description = read_fmu(Path(path))
        self.varies = self.description.coSimulation.canHandleVariableCommunicationStepSize
        self.name, self.title = Path(path).stem, self.description.modelName
        self.variables = {v.name: v for v in self.description.modelVariables}
        self.identity = {
            "FMU": hashlib.sha256(self.content).hexdigest(), "model": self.description.modelName,
        }  # fmt: skip
        self.units = {name: unit(v) for name, v in self.variables.items()}
        self.types = {
            v.name: v.type + (f" and shape {v.shape}" if v.shape else "")
            for v in self.variables.values()
            if v.type not in FLOATS or v.shape
        }
        others = {name for name, kind in self.types.items() if kind not in BITS}
        numeric = {name: v for name, v in self.variables.items() if name not in others}
        self.outputs = [name for name, v in numeric.items() if v.causality == "output"]
        # The start values of all variables that can be set; NaN for those without.
        self.values = {name: number(v.start) for name, v in numeric.items() if _settable(v)}

    def needing(self, outputs: object) -> Self:
        """Return the FMU, which has the same variables for all outputs."""
        return self

    def check(self, output: Output) -> None:
        """Reject an output that cannot be computed."""
        if output.static:
            same = output.variable == FUNDAMENTAL and FREQUENCY in self.units
            raise ParameterError(
                f"output {output.column}: needs a mechanism, and not an FMU of it; study the file "
                "of the mechanism, FILE.toml" + f", or take the variable {FREQUENCY}" * same
            )
        output.check(self.units, "the FMU")
        for name in output.variables(self.units):
            if (kind := self.types.get(name, "")) and kind not in BITS:
                raise ParameterError(
                    f"output {output.column}: {name} is of type {kind}, not one number; leave it "
                    "out"
                )

    def refusal(self, name: str) -> str:
        """Return why a variable cannot be set before a run."""
        hint = proposal(name, self.values)
        if len(self.values) > NAMES_LISTED_MAX and hint.startswith("known"):
            hint = "fmpy info lists the variables"
        if name not in self.variables:
            return f"the FMU has no variable {name!r}; {hint}"
        kind, causality = self.variables[name].type, self.variables[name].causality or "local"
        kind = f"{causality} variable of type {self.types.get(name, kind)}"
        return f"{name} ({kind}) cannot be set before a run; {hint}"

    def fixed(self, values: Mapping[str, float | str] | None) -> dict[str, float]:
        """Return start values of all runs in the units of the FMU.

        Raises
        ------
        ParameterError
            If a variable cannot be set, or a value is not a finite number.
        """
        found = {}
        for name, x in (values or {}).items():
            if name not in self.values:
                raise ParameterError(self.refusal(name))
            found[name] = in_unit(name, float(x) if isinstance(x, bool) else x, self.units[name])
            if not math.isfinite(found[name]):
                raise ParameterError(f"{name} = {x} among the values must be finite")
        return found

    def job(
        self,
        row: Mapping[str, float],
        stop_time: Any = None,
        step: Any = None,
        tolerance: Any = None,
        engine: str | None = None,
        **given: Any,
    ) -> FmuJob:
        """Return the runs with given values, inputs and outputs.

        Raises
        ------
        ParameterError
            If an option is invalid, or the signals with the numbers of the first row.
        """
        if engine is not None:
            raise ParameterError(f"engine = {engine!r}: an FMU has its own; omit it")
        inputs = given["inputs"]
        if inputs and not self.varies:
            raise ParameterError(
                "inputs over time need an FMU with variable communication steps; this one has "
                "fixed steps: leave the inputs out"
            )
        units = input_units(self.description)
        constants = {*given["values"], *row}
        driving(units, self.values.keys() - units, filled(inputs, row), constants)
        times = self._times(stop_time, step, tolerance)
        return FmuJob(*times, **given, content=self.content)

    def _times(
        self, stop_time: Any, step: Any, tolerance: Any
    ) -> tuple[float, float, float, float | None]:
        """Return start, stop, step and tolerance; None is replaced by the default experiment."""

        def proposed(name: str, otherwise: Any) -> Any:
            x = getattr(self.description.defaultExperiment, name, None)
            return otherwise if x is None else float(x)

        start = proposed("startTime", 0.0)
        if stop_time is None:
            stop = proposed("stopTime", start + 1.0)
        else:
            stop = in_unit("stop_time", stop_time, "s")
        if not (math.isfinite(stop) and stop > start):
            raise ParameterError(f"stop_time = {stop:g} s must be finite and after {start:g} s")
        if step is None:
            fixed = float(self.description.coSimulation.fixedInternalStepSize or 0.0)
            size = proposed("stepSize", fixed) or (stop - start) / STEPS
        else:
            size = in_unit("step", step, "s")
        communication_points(stop - start, size)  # Rejects steps that are too small.
        if tolerance is None:
            tolerance = proposed("tolerance", None)
        else:
            tolerance = in_unit("tolerance", tolerance, "")
        if tolerance is not None and not (math.isfinite(tolerance) and tolerance > 0.0):
            raise ParameterError(f"tolerance = {tolerance:g} must be positive and finite")
        steps = (stop - start) / size
        if abs(steps - round(steps)) > 1e-9 * steps and not self.varies:
            raise ParameterError(
                f"stop_time = {stop:g} s: must be a multiple of step = {size:g} s, since the FMU "
                "has a fixed step; choose a step that divides it"
            )
        return start, stop, size, tolerance


def _settable(variable: Any) -> bool:
    """Return whether FMPy can set a variable before or during initialization."""
    if variable.causality in ("structuralParameter", "calculatedParameter", "independent"):
        return False
    return bool(settable_in_instantiated(variable) or settable_in_initialization_mode(variable))
