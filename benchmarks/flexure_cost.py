"""Cost of flexure models at equal error of the second frequency: beams, chains, ANCF elements.

    python benchmarks/flexure_cost.py
    python benchmarks/flexure_cost.py --default-run

The steel guide of the thesis swings freely from its release at -18 mm: its wall is out of reach, so
that Exudyn integrates without the interruptions of impacts.  All CPU times are measured in one run
on one machine, and are those of the integration only.  Ratios are relative to the beam.

error of f2  second frequency at rest, relative to finite elements extrapolated to any number of
             elements (flexure_models.py)
integration  largest error of x at steps of 1 ms against the same model, integrated with a tolerance
             or a step size that is much smaller

Beams and chains run in the C kernel (explicit pair 7(5), adaptive steps).  Exudyn integrates ANCF
elements with its generalised-alpha method, modified Newton iterations, sparse matrices and fixed
steps.  Of several tolerances and halved step sizes, the cheapest with an error of the integration
below a target counts.

With --default-run, valgrind counts the instructions of native FMUs instead, with beams of the order
3 relative to the 2R: those of a right-hand side near the release, and those of all communication
steps of the default run, with its impacts.
"""

import argparse
import importlib
import statistics
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "fmu_src"))

from flexure_models import guide, guide_figures, limit_of_elements
from native import POINTS
from prbm.kernel.simulation import KernelSimulation
from prbm.references.finite_elements import FiniteElements
from scaling import beams, counted_in, instructions
from support import mechanism

Real = NDArray[np.float64]

FREE = {"stop.position": 1.0}  # A wall that is never reached [m].
RELEASED = "shuttle"
SAMPLE = 1e-3  # Interval of the readings of x [s].
DURATION = 0.2  # One swing [s].
CHAIN_DURATION = 0.002  # Long chains are slow [s].
TARGETS = (3e-5, 1e-6)  # Errors of the integration at which costs are compared [m].
TOLERANCES = (1e-5, 1e-6, 1e-7, 1e-8)  # Of the kernel; the last one is its default.
REFERENCE_TOLERANCE = 1e-11
STEP_MAX, HALVINGS_MAX, REFERENCE_STEP = 1e-3, 8, 2e-6  # Step sizes of Exudyn [s].
SPECTRAL_RADIUS = 0.5  # Numerical damping of Exudyn's method; 0.9 does not always converge.
LEVELS = (
    (("beam 3/6", False), ("chain", 50, False), ("elements", 8)),
    (("beam 3/8", True), ("elements", 24)),
)
"""Models with nearly the same error of f2, the beam first: names of flexure_models.py and whether
they stretch, links per flexure, or elements per flexure."""


@dataclass(frozen=True)
class Run:
    """One integration of a model.

    Parameters
    ----------
    setting : str
        Tolerance or step size.
    seconds : float
        CPU time of a simulated second [s].
    error : float
        Error of the integration [m].
    """

    setting: str
    seconds: float
    error: float


@dataclass(frozen=True)
class Found:
    """A model: its name, the relative error of its second frequency [-], and its integrations."""

    name: str
    f2: float
    runs: Sequence[Run]

    def cheapest(self, target: float) -> Run:
        """Return the cheapest integration with an error below a target [m]."""
        return min((r for r in self.runs if r.error < target), key=lambda run: run.seconds)


def error_of(f2: float) -> float:
    """Return the relative error of a second frequency [Hz]."""
    return float(f2 / limit_of_elements()[2] - 1.0)


def samples(duration: float) -> Real:
    """Return the times of the readings of x [s]."""
    return np.arange(1, round(duration / SAMPLE) + 1) * SAMPLE


def kernel_motion(model: str, axial: bool, tolerance: float, duration: float) -> tuple[Real, float]:
    """Return x at the samples [m] and the CPU time of the integration [s]."""
    simulation = KernelSimulation(guide(model, axial=axial), FREE, tolerance=tolerance)
    x, seconds = [], 0.0
    for t in samples(duration):
        started = time.process_time()
        simulation.advance(float(t))
        seconds += time.process_time() - started
        x.append(simulation.outputs()[f"{RELEASED}.x"])
    return np.array(x, float), seconds


def of_kernel(model: str, axial: bool, duration: float, repeat: int) -> Found:
    """Return the costs of beams or of a chain."""
    wanted, _ = kernel_motion(model, axial, REFERENCE_TOLERANCE, duration)
    runs = []
    for tolerance in TOLERANCES:
        found = [kernel_motion(model, axial, tolerance, duration) for _ in range(repeat)]
        seconds = statistics.median(seconds for _, seconds in found) / duration
        error = float(np.abs(found[0][0] - wanted).max())
        runs.append(Run(f"tolerance {tolerance:g}", seconds, error))
    f2 = error_of(float(guide_figures(model, axial=axial)[2]))
    return Found(f"{model}{', axial' * axial}", f2, runs)


class Elements:
    """The guide on ANCF elements in Exudyn.

    Parameters
    ----------
    count : int
        Elements per flexure.
    """

    def __init__(self, count: int) -> None:
        self.exudyn = importlib.import_module("exudyn")
        item = importlib.import_module("exudyn.itemInterface")
        self.count, self.elements = count, FiniteElements(guide("2R"), FREE, elements=count)
        rest = self.elements.equilibrium()
        self.f2 = float(self.elements.modes(rest).frequency[1])
        self.start, _ = self.elements.release()
        self.mbs = self.elements.model.mbs
        self.sensor = self.mbs.AddSensor(
            item.SensorBody(
                bodyNumber=self.elements.model.rigid[RELEASED].object,
                outputVariableType=self.exudyn.OutputVariableType.Displacement,
                storeInternal=True,
            )
        )
        self.mbs.Assemble()

    def motion(self, step: float) -> tuple[Real, float]:
        """Return x at the samples [m] and the CPU time of the solver [s]."""
        settings = self.elements.equations.settings()
        settings.timeIntegration.numberOfSteps = round(DURATION / step)
        settings.timeIntegration.endTime = DURATION
        settings.timeIntegration.newton.useModifiedNewton = True
        settings.timeIntegration.generalizedAlpha.spectralRadius = SPECTRAL_RADIUS
        settings.solution.sensors.active = True
        settings.solution.sensors.writePeriod = SAMPLE
        initial = self.exudyn.ConfigurationType.Initial
        self.mbs.systemData.SetODE2Coordinates(self.start.tolist(), initial)
        started = time.process_time()
        self.mbs.SolveDynamic(settings, solverType=self.exudyn.DynamicSolverType.GeneralizedAlpha)
        elapsed = time.process_time() - started
        data = self.mbs.GetSensorStoredData(self.sensor)
        return np.interp(samples(DURATION), data[:, 0], data[:, 1]), elapsed

    def found(self) -> Found:
        """Return the costs for step sizes that are halved until the smallest target is reached."""
        wanted, _ = self.motion(REFERENCE_STEP)
        runs: list[Run] = []
        for k in range(HALVINGS_MAX):
            step = STEP_MAX / 2**k
            x, seconds = self.motion(step)
            error = float(np.abs(x - wanted).max())
            runs.append(Run(f"step {1e6 * step:.3g} us", seconds / DURATION, error))
            if error < min(TARGETS):
                break
        return Found(f"{self.count} ANCF elements", error_of(self.f2), runs)


def found(model: tuple[Any, ...], repeat: int) -> Found:
    """Return the costs of a model of :data:`LEVELS`."""
    if model[0] == "elements":
        return Elements(model[1]).found()
    if model[0] == "chain":
        return of_kernel(f"{model[1]}R", model[2], CHAIN_DURATION, 1)
    return of_kernel(model[0], model[1], DURATION, repeat)


def print_default_runs() -> None:
    """Print the instructions of right-hand sides and default runs, relative to the 2R."""
    guides = {
        "2R": mechanism("PRBDM2R"),
        "beam, 5 nodes": beams(3, 5, False),
        "beam, 6 nodes": mechanism("GuideBeam"),
    }
    reference: tuple[float, float] | None = None
    for name, given in guides.items():
        one, run = instructions(given), counted_in(given, POINTS, ("fmi2DoStep",))[0][1]
        reference = reference or (one, run)
        print(
            f"  {name:14s} right-hand side {one:6.0f}, ratio {one / reference[0]:5.3f}; "
            f"default run {run / 1e6:6.1f} million, ratio {run / reference[1]:5.3f}",
            flush=True,
        )


def print_equal_errors(levels: Sequence[Sequence[tuple[Any, ...]]], repeat: int) -> None:
    """Print cost and errors of all models of some levels."""
    for level in levels:
        models = [found(model, repeat) for model in level]
        for target in TARGETS:
            print(f"\nerror of the integration below {target:g} m")
            beam = models[0].cheapest(target).seconds
            for model in models:
                run = model.cheapest(target)
                print(
                    f"  {model.name:20s} f2 {100 * model.f2:+8.4f} %  {run.setting:16s}"
                    f"{run.error:9.1e} m {run.seconds:9.4f} s per s, "
                    f"ratio {run.seconds / beam:7.1f}",
                    flush=True,
                )


def main() -> None:
    """Print the comparison that the command line asks for."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--runs", type=int, default=5, help="runs of a beam (default: %(default)s)")
    parser.add_argument(
        "--default-run", action="store_true", help="count the instructions of default runs"
    )
    parser.add_argument("--short", action="store_true", help="the beams of the first level alone")
    arguments = parser.parse_args()
    if arguments.default_run:
        print_default_runs()
    else:
        levels = [LEVELS[0][:1]] if arguments.short else LEVELS
        print_equal_errors(levels, arguments.runs)


if __name__ == "__main__":
    main()
