"""Simulate an FMU with FMPy, tell what happened and plot it: ``python -m prbm_fmu.report``."""

import signal
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import fmpy  # type: ignore[import-untyped]
import numpy as np
from numpy.typing import NDArray

import prbm
from prbm import Mechanism, assemble, free_displacement
from prbm.assembly import unit
from prbm_tools.figures import png, response
from prbm_tools.motion import marks
from prbm_tools.scene import frequency_unit, length_unit, time_unit
from prbm_tools.simulate import Progress, reporter, rest_time

from .archive import write
from .cli import FAILED, INTERRUPTED, MISTAKE, OK
from .slaves.resolved import read
from .variables import CLOCK, extent

FREQUENCY = "mode.frequency"
SHORT = 0.1  # s; the times of a run that is shorter are not told in seconds


@dataclass(frozen=True)
class Run:
    """What an FMU did.

    Parameters
    ----------
    name : str
        Of the model.
    mechanism : Mechanism
        What it is a model of.
    values : dict of str to float
        Its parameters and inputs at the start.
    record : structured array
        Time, all outputs and the fundamental frequency.
    stop_time : float
        Until when it was to run [s].
    seconds : float
        What that took.
    """

    name: str
    mechanism: Mechanism
    values: dict[str, float]
    record: NDArray[Any]
    stop_time: float
    seconds: float

    @property
    def finished(self) -> bool:
        """Whether the simulation came to its end."""
        return bool(np.isclose(self.record["time"][-1], self.stop_time))


@contextmanager
def unpacked(fmu: Path) -> Iterator[Path]:
    """Unpack an FMU to a folder that pythonfmu can read, and remove it afterwards.

    Raises
    ------
    RuntimeError
        If every candidate has characters that a URI encodes.
    """
    candidates = (tempfile.gettempdir(), "/tmp", "/var/tmp", r"C:\Users\Public", ".")
    for candidate in map(Path, candidates):
        if candidate.is_dir() and plain(candidate.resolve()):
            with tempfile.TemporaryDirectory(prefix="prbm_", dir=candidate.resolve()) as folder:
                fmpy.extract(str(fmu), unzipdir=folder)
                yield Path(folder)
            return
    raise RuntimeError(
        f"no folder for temporary files has a path of plain ASCII letters (tried {candidates[0]}); "
        "set the environment variable TMPDIR to one that has"
    )


def plain(path: Path) -> bool:
    """Whether pythonfmu can read a path: its URI encodes nothing but spaces.

    Examples
    --------
    >>> plain(Path("/tmp/my model")), plain(Path("/tmp/modèle")), plain(Path("/tmp/100%"))
    (True, False, False)
    """
    uri = path.absolute().as_uri().replace("%20", " ")
    return unquote(uri) == uri and "%" not in uri


def simulate(fmu: Path, progress: Progress) -> Run:
    """Run the default experiment of an FMU with FMPy.

    Raises
    ------
    KeyboardInterrupt
        If the user wants no more of it; the FMU has finished its step then, undisturbed.
    """
    with unpacked(fmu) as folder, interruptible() as wanted:
        description = fmpy.read_model_description(str(folder))
        listed = description.modelVariables
        outputs = [v.name for v in listed if v.causality == "output" and v.type != CLOCK]
        clocks = any(v.type == CLOCK for v in listed)  # which demand event mode
        model = read(folder / "resources", prbm)
        stop_time = float(description.defaultExperiment.stopTime)

        def step_finished(t: float, _: object) -> bool:
            progress(t / stop_time)
            return wanted()

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
        if not wanted():
            raise KeyboardInterrupt
    return Run(
        description.modelName, model.mechanism, dict(model.given), record, stop_time, seconds
    )


@contextmanager
def interruptible() -> Iterator[Callable[[], bool]]:
    """Have Ctrl-C noted, and the second one obeyed; give what tells whether to go on."""
    interrupted: list[int] = []

    def note(number: int, _: object) -> None:
        interrupted.append(number)
        signal.signal(signal.SIGINT, signal.default_int_handler)

    before = signal.signal(signal.SIGINT, note)
    try:
        yield lambda: not interrupted
    finally:
        signal.signal(signal.SIGINT, before)


def length(x: float, size: float) -> str:
    """Return a length in mm, or what is handy in a smaller mechanism, to a hundredth.

    There is no negative zero.

    Examples
    --------
    >>> length(-1.8e-3, 0.08), length(-1e-9, 0.08), length(3e-6, 2e-4)
    ('-1.80 mm', '0.00 mm', '3.00 µm')
    """
    factor, unit = length_unit(min(size, 1.0))
    return f"{round(factor * x, 2) + 0.0:.2f} {unit}"


def instant(t: float, span: float, digits: int) -> str:
    """Return a time of a run in seconds, or what is handy if that is short.

    Examples
    --------
    >>> instant(0.0349812, 1.0, 5), instant(2.71034e-6, 1e-4, 3)
    ('0.03498 s', '2.710 µs')
    """
    factor, unit = (1.0, "s") if span >= SHORT else time_unit(span)
    return f"{factor * t:.{digits}f} {unit}"


def headline(run: Run) -> list[str]:
    """Return what happened, line by line."""
    record = run.record
    lines = [f"simulated            {record['time'][-1]:g} s in {run.seconds:.2f} s", *_free(run)]
    seen = marks(record, run.mechanism)
    for i, stop in enumerate(s.name for s in run.mechanism.stops):
        count = int(record[f"{stop}.impact_count"][-1])
        first = next((mark for mark in seen if mark.stop == i), None)
        told = ""
        if first is not None:
            which = "the first" if first.count == 1 else f"number {first.count}"
            hit = instant(first.time, run.stop_time, 5)
            told = f", {which} at t = {hit} with {first.speed:.3f} m/s"
        lines.append(f"impacts at {stop:9} {count}{told}")
        since = rest_time(record, stop)
        if since is not None:
            lines.append(
                f"came to rest         at t = {instant(since, run.stop_time, 3)} on {stop}, "
                f"{_place(run)}, pressed with {record[f'{stop}.force'][-1]:.4g} N"
            )
    if not run.finished:
        lines.append(
            f"ended early          at t = {record['time'][-1]:g} s instead of {run.stop_time:g} s"
        )
    return lines


def _free(run: Run) -> list[str]:
    """Tell about the equilibrium without stops, if it is one that lasts."""
    frequency = run.record[FREQUENCY][0]
    if frequency == 0.0:
        return [
            "fundamental          none: without stops, the equilibrium under gravity is unstable"
        ]
    parameters = {p.name for p in run.mechanism.parameters}
    values = {name: x for name, x in run.values.items() if name in parameters}
    rest = free_displacement(assemble(run.mechanism, values))
    factor, hertz = frequency_unit(frequency)
    release = run.mechanism.release
    return [
        f"fundamental          {factor * frequency:.4g} {hertz}",
        f"free rest position   {release.body} {length(rest, extent(run.mechanism))} from straight"
        f"{_along(release.direction)}, under gravity, without stops",
    ]


def _along(direction: float) -> str:
    return "" if direction == 0.0 else f" along {direction:g} degrees"


def _place(run: Run) -> str:
    """Tell where the released body is at the end."""
    body, direction = run.mechanism.release.body, run.mechanism.release.direction
    x, y = (float(run.record[f"{body}.{axis}"][-1]) for axis in "xy")
    u, size = unit(direction), extent(run.mechanism)
    if direction == 0.0:
        return f"{body}.x = {length(x, size)}"
    return f"{body} {length(x * u.real + y * u.imag, size)} from straight{_along(direction)}"


def main(arguments: Sequence[str]) -> int:
    """Simulate the FMU given first, plot into the file given second."""
    fmu, picture = Path(arguments[0]), Path(arguments[1])
    try:
        run = simulate(fmu, reporter())
    except KeyboardInterrupt:
        return INTERRUPTED
    except Exception as error:
        print(f"{fmu}: {error}", file=sys.stderr)
        return FAILED
    for line in headline(run):
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
