"""Motions of FMUs beside that of the Python engine."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import pytest
from fmpy import read_model_description

from fmu_host import simulate_fmu
from prbm.hybrid.simulation import Simulation
from prbm.mechanism.description import Mechanism

KINDS = ["fmi3", *(pytest.param(x, marks=pytest.mark.slow) for x in ("fmi2", "python"))]
"""FMUs of a mechanism, for :func:`support.own_fmu`."""
STEPS = 100  # Communication steps of a motion.


@dataclass(frozen=True)
class Motion:
    """A motion until an end [s], with other start values than the defaults."""

    model: Mechanism
    starts: Mapping[str, float]
    outputs: Sequence[str]
    end: float

    @cached_property
    def expected(self) -> list[dict[str, float]]:
        """The outputs of the engine at the communication points."""
        simulation, rows = Simulation(self.model, self.starts), []
        for t in np.linspace(0.0, self.end, STEPS + 1):
            simulation.advance(float(t))
            rows.append(simulation.outputs())
        return rows

    def simulated(self, fmu: Path, kind: str, **options: float) -> np.ndarray:
        """Return the results of FMPy."""
        return simulate_fmu(
            fmu, fmi_type=kind, stop_time=self.end, output_interval=self.end / STEPS,
            output=self.outputs, start_values=self.starts, **options,
        )  # fmt: skip

    def check_co_simulation(self, fmu: Path) -> None:
        """Compare an FMU with the engine at each communication point."""
        result = self.simulated(fmu, "CoSimulation")
        for name in self.outputs:
            wanted = np.array([row[name] for row in self.expected])
            bound = 0.0 if name.endswith("_count") else 1e-5 * max(1e-3, np.abs(wanted).max())
            assert np.abs(result[name] - wanted).max() <= bound, name

    def check_model_exchange(self, fmu: Path) -> None:
        """Compare an FMU with the engine at the end; skip the test if it is for co-simulation."""
        if read_model_description(str(fmu)).modelExchange is None:
            pytest.skip("co-simulation only")
        result = self.simulated(fmu, "ModelExchange", relative_tolerance=1e-9)
        for name in self.outputs:
            wanted = self.expected[-1][name]
            if name.endswith("_count"):
                assert result[name][-1] == wanted, name
            else:
                assert result[name][-1] == pytest.approx(wanted, rel=1e-4, abs=1e-5), name
