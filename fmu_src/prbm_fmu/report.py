"""Simulate an FMU with FMPy, tell what happened and plot it: ``python -m prbm_fmu.report``."""

import io
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import fmpy  # type: ignore[import-untyped]
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

import prbm
from prbm import Mechanism, assemble, equilibrium

from .archive import write
from .slaves.resolved import read

FREQUENCY = "mode.frequency"
ENERGIES = ("kinetic", "elastic", "gravitational", "dissipated", "work")
BLUE, RED, GREEN, ORANGE, GREY = "#1f4e79", "#c0392b", "#2e8b57", "#d98200", "#7f7f7f"


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


@dataclass(frozen=True)
class Impacts:
    """The impacts at a stop that a record shows: the last one of each communication step."""

    time: NDArray[np.float64]
    impulse: NDArray[np.float64]
    approach_speed: NDArray[np.float64]


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


def simulate(fmu: Path) -> Run:
    """Run the default experiment of an FMU with FMPy."""
    with unpacked(fmu) as folder:
        description = fmpy.read_model_description(str(folder))
        outputs = [v.name for v in description.modelVariables if v.causality == "output"]
        model = read(folder / "resources", prbm)
        begin = time.perf_counter()
        record = fmpy.simulate_fmu(
            str(folder), model_description=description, output=[*outputs, FREQUENCY]
        )
        seconds = time.perf_counter() - begin
    stop_time = float(description.defaultExperiment.stopTime)
    return Run(
        description.modelName, model.mechanism, dict(model.given), record, stop_time, seconds
    )


def rest_position(run: Run, body: str) -> complex:
    """Return where a body rests under gravity, free of stops: displacement from straight [m]."""
    parameters = {p.name for p in run.mechanism.parameters}
    values = {name: x for name, x in run.values.items() if name in parameters}
    system = assemble(run.mechanism, values)
    shape = equilibrium(system)
    frame = system.bodies[body]
    return complex(frame.A @ np.exp(1j * shape.q)) + frame.c - frame.drawn


def impacts(record: NDArray[Any], stop: str) -> Impacts:
    """Return the impacts at a stop that a record shows."""
    new = np.flatnonzero(np.diff(record[f"{stop}.impact_count"])) + 1
    return Impacts(
        *(record[f"{stop}.{what}"][new] for what in ("impact_time", "impulse", "approach_speed"))
    )


def came_to_rest(time: NDArray[np.float64], contact: NDArray[np.bool_]) -> float | None:
    """Return the first time from which a stop holds to the end, None if it does not [s].

    Examples
    --------
    >>> contact = np.array([False, True, False, True, True])
    >>> float(came_to_rest(np.arange(5.0), contact))
    3.0
    """
    if not contact[-1]:
        return None
    open_at = np.flatnonzero(~contact)
    return float(time[open_at[-1] + 1 if len(open_at) else 0])


def millimetres(x: float) -> str:
    """Return a length in mm to a hundredth, without a negative zero.

    Examples
    --------
    >>> millimetres(-1.8e-3), millimetres(-1e-9)
    ('-1.80 mm', '0.00 mm')
    """
    return f"{round(1e3 * x, 2) + 0.0:.2f} mm"


def headline(run: Run) -> list[str]:
    """Return what happened, line by line."""
    record, body = run.record, run.mechanism.release.body
    rest = rest_position(run, body)
    lines = [
        f"simulated            {record['time'][-1]:g} s in {run.seconds:.2f} s",
        f"fundamental          {record[FREQUENCY][0]:.4g} Hz",
        f"free rest position   {body}.x = {millimetres(rest.real)}, {body}.y = "
        f"{millimetres(rest.imag)} (under gravity, without stops)",
    ]
    for stop in (s.name for s in run.mechanism.stops):
        count = int(record[f"{stop}.impact_count"][-1])
        seen = impacts(record, stop)
        first = (
            f", the first at t = {seen.time[0]:.5f} s with {seen.approach_speed[0]:.3f} m/s"
            if count
            else ""
        )
        lines.append(f"impacts at {stop:9} {count}{first}")
        since = came_to_rest(record["time"], record[f"{stop}.contact"])
        if since is not None:
            lines.append(
                f"came to rest         at t = {since:.3f} s on {stop}, {body}.x = "
                f"{millimetres(record[f'{body}.x'][-1])}, pressed with "
                f"{record[f'{stop}.force'][-1]:.4g} N"
            )
    if not run.finished:
        lines.append(
            f"ended early          at t = {record['time'][-1]:g} s instead of {run.stop_time:g} s"
        )
    return lines


def figure(run: Run) -> Figure:
    """Return the motion with its impacts, the force of the stops, and the energies."""
    result = Figure(figsize=(8.0, 8.4), dpi=120, layout="constrained")
    motion, force, energy = result.subplots(3, 1, sharex=True)
    motion.set_title(run.mechanism.title, fontsize=11, loc="left")
    _plot_motion(motion, run)
    _plot_force(force, run)
    _plot_energies(energy, run)
    for axes in (motion, force, energy):
        axes.grid(color="#e6e6e6", linewidth=0.7)
        axes.set_axisbelow(True)
        axes.spines[["top"]].set_visible(False)
        axes.margins(x=0.0)
    energy.set_xlabel("time [s]")
    return result


def _plot_motion(axes: Axes, run: Run) -> None:
    record, body = run.record, run.mechanism.release.body
    t, x = record["time"], 1e3 * record[f"{body}.x"]
    axes.plot(t, x, color=BLUE, label=f"{body}.x")
    for stop in run.mechanism.stops:
        seen = impacts(record, stop.name)
        axes.plot(
            seen.time, np.interp(seen.time, t, x), "v", color=RED, markersize=5,
            label=f"impacts at {stop.name} ({record[f'{stop.name}.impact_count'][-1]})",
        )  # fmt: skip
        since = came_to_rest(t, record[f"{stop.name}.contact"])
        if since is not None:
            axes.axvspan(since, t[-1], color="#f0f0f0", label=f"rests on {stop.name}")
    axes.set_ylabel("displacement [mm]")
    axes.legend(loc="lower right", fontsize=9)


def _plot_force(axes: Axes, run: Run) -> None:
    """Plot contact forces, and impulses, which are no forces, on an axis of their own."""
    if not run.mechanism.stops:
        axes.set_visible(False)
        return
    impulse_axes = axes.twinx()
    for stop in (s.name for s in run.mechanism.stops):
        axes.plot(run.record["time"], run.record[f"{stop}.force"], color=GREEN, label=stop)
        seen = impacts(run.record, stop)
        impulse_axes.vlines(seen.time, 0.0, 1e3 * seen.impulse, color=RED, linewidth=1.2)
        impulse_axes.plot(seen.time, 1e3 * seen.impulse, "o", color=RED, markersize=3.5)
    if len(run.mechanism.stops) > 1:
        axes.legend(loc="upper right", fontsize=9)
    axes.set_ylabel("force while it holds [N]", color=GREEN)
    impulse_axes.set_ylabel("impulse of an impact [mN·s]", color=RED)
    impulse_axes.spines[["top"]].set_visible(False)
    axes.set_ylim(bottom=0.0)
    impulse_axes.set_ylim(bottom=0.0)


def _plot_energies(axes: Axes, run: Run) -> None:
    record = run.record
    for name, color in zip(ENERGIES, (BLUE, ORANGE, GREEN, RED, GREY), strict=True):
        energy = 1e3 * record[f"energy.{name}"]
        if np.any(energy):
            axes.plot(record["time"], energy, color=color, label=name, linewidth=1.3)
    total = sum(record[f"energy.{name}"] for name in ENERGIES[:-1]) - record["energy.work"]
    axes.plot(record["time"], 1e3 * total, "--", color="black", linewidth=1.0, label="sum - work")
    axes.set_ylabel("energy [mJ]")
    axes.legend(loc="center right", fontsize=9)


def png(run: Run) -> bytes:
    """Return the figure as PNG."""
    buffer = io.BytesIO()
    figure(run).savefig(buffer, format="png", metadata={"Software": None})
    return buffer.getvalue()


def main(arguments: Sequence[str]) -> int:
    """Simulate the FMU given first, plot into the file given second."""
    fmu, picture = Path(arguments[0]), Path(arguments[1])
    try:
        run = simulate(fmu)
    except Exception as error:
        print(f"{fmu}: {error}", file=sys.stderr)
        return 1
    for line in headline(run):
        print(f"  {line}")
    write(picture, png(run))
    print(f"  figure               {picture}", flush=True)
    return 0 if run.finished else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
