"""An escape wheel hits an oscillator: two FMUs that exchange momentum in event mode.

    python examples/escapement/run.py

The tooth of the wheel hits the pallet of the oscillator.  The stop belongs to the wheel; its wall
is the pallet, which moves with the oscillator:

    wheel.tooth.displacement, .velocity   <-  oscillator.shuttle.x, .vx
    wheel.tooth.mobility                  <-  oscillator.pallet.point.mobility
    oscillator.force.impulse.x            <-  wheel.tooth.impulse_sum
    oscillator.force.x                    <-  wheel.tooth.force

With event mode a step ends when the tooth touches the pallet.  The wheel computes the impulse from
the present velocity and effective mass of the pallet, and the oscillator receives it before time
continues, so that momentum is conserved.  The result is compared with that of both parts as one
mechanism.
"""

import argparse
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

sys.path.insert(0, str(Path(__file__).parent))

from parts import both, oscillator, wheel

from prbm import PrbmError
from prbm import simulate as simulate_one
from prbm.base.progress import Progress, reporter
from prbm.fmu.native_fmu import build
from prbm.hybrid.records import Impact
from prbm.systems.cosimulation import simulate as cosimulate

MOMENT = -1e-4  # Moment on the wheel [N m].
STOP_TIME = 0.3  # [s]
TOLERANCE = 1e-9
STEPS = (4e-3, 2e-3, 1e-3, 5e-4)  # Communication steps [s].
CONNECTIONS = {
    "wheel.tooth.displacement": "oscillator.shuttle.x",
    "wheel.tooth.velocity": "oscillator.shuttle.vx",
    "wheel.tooth.mobility": "oscillator.pallet.point.mobility",
    "oscillator.force.impulse.x": "wheel.tooth.impulse_sum",
    "oscillator.force.x": "wheel.tooth.force",
}
KINDS = ("kinetic", "elastic", "gravitational", "dissipated", "work")
RECORD = (
    "wheel.tooth.impact_count", "wheel.tooth.impact_time", "wheel.tooth.approach_speed",
    "wheel.tooth.impulse", "wheel.tooth.point.displacement", "wheel.tooth.point.velocity",
    "wheel.tooth.point.mobility", "oscillator.shuttle.x", "oscillator.shuttle.vx",
    "oscillator.pallet.point.mobility",
    *(f"{part}.energy.{kind}" for part in ("wheel", "oscillator") for kind in KINDS),
)  # fmt: skip


def coupled(step: float, stop_time: float = STOP_TIME) -> np.ndarray:
    """Return the motion of the two FMUs, coupled every ``step`` [s] and at each impact.

    Returns
    -------
    structured array
        Time [s] and outputs by ``wheel.name`` and ``oscillator.name``; two rows at an impact.
    """
    with tempfile.TemporaryDirectory() as folder:
        fmus = {}
        for name, mechanism in (("oscillator", oscillator), ("wheel", wheel)):
            fmus[name] = Path(folder) / f"{name}.fmu"
            fmus[name].write_bytes(build(mechanism, fmi=3))
        values = {"wheel.drive.moment": MOMENT}
        return cosimulate(
            fmus, CONNECTIONS, stop_time, step, values, RECORD, scheme="jacobi", events=True,
            tolerance=TOLERANCE,
        )  # fmt: skip


def monolith(stop_time: float = STOP_TIME) -> tuple[Impact, ...]:
    """Return the impacts of wheel and oscillator as one mechanism."""
    given = {"drive.moment": MOMENT}
    result = simulate_one(
        both(), given, stop_time=stop_time, tolerance=TOLERANCE, engine="python"
    )  # The FMUs have the other engine.
    return result.impacts


def impacts(result: np.ndarray) -> np.ndarray:
    """Return the index of the row just after each impact; the row before it precedes the impact."""
    count = result["wheel.tooth.impact_count"]
    return np.flatnonzero(np.diff(count) > 0) + 1


def momentum_error(result: np.ndarray) -> np.ndarray:
    """Return the change of momentum at each impact, relative to its impulse.

    The change is the sum over tooth and pallet of effective mass times change of velocity.
    """
    after = impacts(result)
    error = np.zeros(len(after))
    for point, mobility in (
        ("wheel.tooth.point.velocity", "wheel.tooth.point.mobility"),
        ("oscillator.shuttle.vx", "oscillator.pallet.point.mobility"),
    ):
        change = result[point][after] - result[point][after - 1]
        error += change / result[mobility][after]
    return np.abs(error) / result["wheel.tooth.impulse"][after]


def energy(result: np.ndarray) -> np.ndarray:
    """Return energy plus dissipation of both parts, less the work of the moment [J].

    The work on the pallet cancels: it is part of ``energy.work`` of both, with opposite signs.
    """
    total = np.zeros(len(result))
    for part in ("wheel", "oscillator"):
        for kind in KINDS:
            total += (-1 if kind == "work" else 1) * result[f"{part}.energy.{kind}"]
    return total


def errors(result: np.ndarray, reference: Sequence[Impact]) -> tuple[float, float]:
    """Return the largest errors of the impacts' times [s] and closing speeds [m/s]."""
    rows = result[impacts(result)]
    if len(rows) != len(reference):
        return np.inf, np.inf
    pairs = list(zip(rows, reference, strict=True))
    return (
        max(abs(row["wheel.tooth.impact_time"] - i.time) for row, i in pairs),
        max(abs(row["wheel.tooth.approach_speed"] - i.latched.approach_speed) for row, i in pairs),
    )


def draw(
    result: np.ndarray, found: Sequence[tuple[float, float]], steps: Sequence[float]
) -> Figure:
    """Draw the motion, and the errors over the communication step."""
    figure = Figure(figsize=(8.0, 3.4), layout="constrained")
    motion, error = figure.subplots(1, 2, width_ratios=(2, 1))
    after = impacts(result)
    motion.plot(result["time"], 1e3 * result["oscillator.shuttle.x"] + 1.0, label="pallet")
    tooth = 1e3 * result["wheel.tooth.point.displacement"] + 1.0
    motion.plot(result["time"], tooth, label="tooth")
    motion.plot(result["time"][after], tooth[after], "k.", label="impacts")
    motion.set(xlabel="time [s]", ylabel="position [mm]")
    motion.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3, frameon=False)
    error.loglog(steps, [speed for _, speed in found], "o-", label="closing speed [m/s]")
    error.loglog(steps, [time for time, _ in found], "s-", label="time of impact [s]")
    slope = found[0][0] * (np.array(steps) / steps[0]) ** 2
    error.loglog(steps, slope, "k:", label="second order")
    error.set_xticks(steps, [f"{1e3 * step:g}" for step in steps])
    error.minorticks_off()
    error.set(xlabel="communication step [ms]", ylabel="largest error")
    error.legend(frameon=False, fontsize="small")
    return figure


def main(arguments: Sequence[str] | None = None, progress: Progress | None = None) -> int:
    """Print the errors of momentum, energy and impacts, and write the figure."""
    parser = argparse.ArgumentParser(description="An escape wheel hits an oscillator.")
    parser.add_argument(
        "--out", type=Path, default=Path("escapement.png"), help="figure (default: %(default)s)"
    )
    options = parser.parse_args(arguments)
    report = progress or reporter()
    try:
        reference = monolith()
        results = []
        for k, step in enumerate(STEPS):
            results.append(coupled(step))
            report((k + 1) / len(STEPS))
    except PrbmError as error:
        print(error, file=sys.stderr)
        return 1
    last, found = results[-1], [errors(result, reference) for result in results]
    total = energy(last)
    print(f"impacts              {len(impacts(last))}, as one mechanism {len(reference)}")
    print(f"momentum             conserved to {momentum_error(last).max():.1e} of each impulse")
    print(f"energy               conserved to {np.abs(total - total[0]).max() / total[0]:.1e}")
    for step, (time, speed) in zip(STEPS, found, strict=True):
        print(f"step {step:7g} s       impacts off by {time:.1e} s and {speed:.1e} m/s")
    draw(last, found, STEPS).savefig(options.out, dpi=110)
    print(f"figure               {options.out}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
