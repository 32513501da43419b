"""Simulate an FMU with FMPy, print a summary and plot the result.

Usage: python -m prbm.commands.fmu_report FMU PNG
"""

import signal
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import fmpy  # type: ignore[import-untyped]
import numpy as np
from numpy.typing import NDArray

from ..base.atomic import write
from ..base.progress import Progress, reporter
from ..drawing.style import png
from ..fmu.slave.resolved import read
from ..fmu.unpack import unpacked
from ..interface.variables import CLOCK
from ..mechanism.description import Mechanism
from ..plots.figures import response
from ..runs.headline import headline
from ..runs.quantities import FREQUENCY
from .program import FAILED, INTERRUPTED, MISTAKE, OK, escape_output


@dataclass(frozen=True)
class Run:
    """A simulation of an FMU.

    Parameters
    ----------
    name : str
        Name of the model.
    mechanism : Mechanism
        The mechanism of the FMU.
    values : dict of str to float
        Parameters and inputs at the start.
    record : structured array
        Time, all outputs and the fundamental frequency.
    stop_time : float
        End of the default experiment [s].
    seconds : float
        Computing time [s].
    """

    name: str
    mechanism: Mechanism
    values: dict[str, float]
    record: NDArray[Any]
    stop_time: float
    seconds: float

    @property
    def finished(self) -> bool:
        """Whether the simulation reached its stop time."""
        return bool(np.isclose(self.record["time"][-1], self.stop_time))


def simulate(fmu: Path, progress: Progress) -> Run:
    """Run the default experiment of an FMU with FMPy.

    Raises
    ------
    KeyboardInterrupt
        After Ctrl-C, when the FMU has finished its step.
    """
    with unpacked(fmu) as folder, interruptible() as running:
        description = fmpy.read_model_description(str(folder))
        listed = description.modelVariables
        outputs = [v.name for v in listed if v.causality == "output" and v.type != CLOCK]
        clocks = any(v.type == CLOCK for v in listed)  # Clocks require event mode.
        model = read(folder / "resources")
        stop_time = float(description.defaultExperiment.stopTime)

        def step_finished(t: float, _: object) -> bool:
            progress(t / stop_time)
            return running()

        begin = time.perf_counter()
        record = fmpy.simulate_fmu(
            str(folder),
            model_description=description,
            output=[*outputs, FREQUENCY],
            use_event_mode=clocks,
            early_return_allowed=clocks,
            step_finished=step_finished,
        )
        seconds = time.perf_counter() - begin
        if not running():
            raise KeyboardInterrupt
    return Run(
        description.modelName, model.mechanism, dict(model.given), record, stop_time, seconds
    )


@contextmanager
def interruptible() -> Iterator[Callable[[], bool]]:
    """Yield a function that is false after Ctrl-C; a second Ctrl-C raises KeyboardInterrupt."""
    interrupted: list[int] = []

    def record_signal(number: int, _: object) -> None:
        interrupted.append(number)
        signal.signal(signal.SIGINT, signal.default_int_handler)

    before = signal.signal(signal.SIGINT, record_signal)
    try:
        yield lambda: not interrupted
    finally:
        signal.signal(signal.SIGINT, before)


def summary(run: Run) -> list[str]:
    """Return a summary of a simulation, line by line."""
    record = run.record
    lines = [
        f"simulated            {record['time'][-1]:g} s in {run.seconds:.2f} s",
        *headline(record, run.mechanism, run.values),
    ]
    if not run.finished:
        lines.append(
            f"ended early          at t = {record['time'][-1]:g} s instead of {run.stop_time:g} s"
        )
    return lines


def main(arguments: Sequence[str]) -> int:
    """Simulate the FMU of the first argument; write the plot to the second."""
    escape_output()
    fmu, picture = Path(arguments[0]), Path(arguments[1])
    try:
        run = simulate(fmu, reporter())
    except KeyboardInterrupt:
        return INTERRUPTED
    except Exception as error:
        print(f"{fmu}: {error}", file=sys.stderr)
        return FAILED
    for line in summary(run):
        print(f"  {line}")
    try:
        write(picture, png(response(run.record, run.mechanism)))
    except OSError as error:
        print(f"cannot write the figure {picture}: {error.strerror}", file=sys.stderr)
        return MISTAKE
    print(f"  figure               {picture}", flush=True)
    return OK if run.finished else FAILED


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
