"""An importer of Python FMUs for the tests: FMPy's slave with names instead of references."""

import shutil
import tempfile
from ctypes import byref
from itertools import pairwise
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import fmpy
import numpy as np
from fmpy import extract, read_model_description
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave, calloc, fmi2CallbackFunctions, free
from fmpy.fmi2 import fmi2CallbackAllocateMemoryTYPE as Allocate
from fmpy.fmi2 import fmi2CallbackFreeMemoryTYPE as Free
from fmpy.fmi2 import fmi2CallbackLoggerTYPE as Logger
from fmpy.logging import addLoggerProxy

from prbm.fmu.unpack import plain_folder, unpacked

OK, DISCARD = 0, 2

_kept: list[fmi2CallbackFunctions] = []  # FMPy's proxy calls the last logger, freed or not.


def simulate_fmu(fmu: str | Path, **options: Any) -> np.ndarray:
    """Simulate an FMU with FMPy in a folder that pythonfmu can read."""
    with unpacked(Path(fmu)) as folder:
        return fmpy.simulate_fmu(str(folder), **options)


class Instance:
    """An instance of an FMU, freed and removed at the end of a ``with`` block."""

    def __init__(self, fmu: str | Path, name: str = "instance") -> None:
        self.description = read_model_description(str(fmu))
        self.variables = {v.name: v for v in self.description.modelVariables}
        self.messages: list[str] = []
        self.folder = extract(str(fmu), tempfile.mkdtemp(dir=plain_folder()))
        self.fmu = FMU2Slave(
            guid=self.description.guid,
            unzipDirectory=self.folder,
            modelIdentifier=self.description.coSimulation.modelIdentifier,
            instanceName=name,
        )
        callbacks = fmi2CallbackFunctions()
        callbacks.logger = Logger(self._log)
        callbacks.allocateMemory = Allocate(calloc)
        callbacks.freeMemory = Free(free)
        addLoggerProxy(byref(callbacks))
        _kept.append(callbacks)
        try:
            self.fmu.instantiate(callbacks=callbacks, loggingOn=True)
        except BaseException:
            shutil.rmtree(self.folder)
            raise

    def _log(self, _: Any, __: bytes, status: int, category: bytes, message: bytes) -> None:
        self.messages.append((message or b"").decode())

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        place: TracebackType | None,
    ) -> None:
        self.fmu.terminate()
        self.fmu.freeInstance()
        shutil.rmtree(self.folder)

    def initialize(
        self, *, start: float = 0.0, tolerance: float | None = None, **values: float
    ) -> Self:
        """Go through initialization with start values, given as ``stop__position=...``."""
        self.fmu.setupExperiment(startTime=start, tolerance=tolerance)
        self.set({name.replace("__", "."): value for name, value in values.items()})
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()
        return self

    def set(self, values: dict[str, float]) -> None:
        """Set Real variables."""
        self.fmu.setReal(
            [self.variables[name].valueReference for name in values], [*values.values()]
        )

    def step(self, time: float, size: float) -> int:
        """Make a step; return the status."""
        try:
            self.fmu.doStep(time, size)
        except FMICallException as error:
            return int(error.status)
        return OK

    def values(self) -> dict[str, float]:
        """Return all declared variables by name."""
        result = {}
        getters = {
            "Real": self.fmu.getReal,
            "Integer": self.fmu.getInteger,
            "Boolean": self.fmu.getBoolean,
        }
        for kind, getter in getters.items():
            names = [name for name, v in self.variables.items() if v.type == kind]
            read = getter([self.variables[name].valueReference for name in names])
            result |= dict(zip(names, read, strict=True))
        return result

    def bytes(self) -> bytes:
        """Return the values of all declared variables as bytes."""
        return np.array([*self.values().values()], dtype=float).tobytes()

    def run(self, times: np.ndarray) -> list[bytes]:
        """Step through communication points; return the bytes at each after the first."""
        result = []
        for begin, end in pairwise(times):
            assert self.step(begin, end - begin) == OK
            result.append(self.bytes())
        return result
