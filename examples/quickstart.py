"""Build an FMU, simulate it with FMPy and plot the result.

    python -m pip install .
    python examples/quickstart.py

writes PRBDM2R.fmu and quickstart.png to the current folder, with --gif also a film.
"""

import argparse
import sys
from pathlib import Path

import fmpy
import numpy as np

from prbm import PrbmError, load
from prbm.fmu.python_fmu import build
from prbm.fmu.unpack import unpacked
from prbm.plots.animation import animate
from prbm.plots.figures import response, save
from prbm.runs.result import rest_time

MECHANISM = load("PRBDM2R")
MEASURED = 4.82, 0.06  # Frequency of the steel structure and its standard uncertainty [Hz].
FINITE_ELEMENTS = 4.907  # Frequency with 32 ANCF elements per flexure [Hz].


def simulate(folder: Path, stop_time: float = 1.0) -> np.ndarray:
    """Build the FMU in a folder and simulate it from its release.

    Parameters
    ----------
    folder : Path
        Folder for the FMU.
    stop_time : float
        End of the simulation [s].

    Returns
    -------
    structured array
        Outputs and link angles by name, one row per millisecond, in SI units.
    """
    fmu = folder / "PRBDM2R.fmu"
    fmu.write_bytes(build(MECHANISM))
    variables = fmpy.read_model_description(fmu).modelVariables
    record = [v.name for v in variables if v.causality in ("output", "local")]
    with unpacked(fmu) as unzipped:
        return fmpy.simulate_fmu(unzipped, stop_time=stop_time, output_interval=1e-3, output=record)


def main(arguments: list[str] | None = None) -> None:
    """Simulate, print the frequency and the impacts, and write the figure."""
    parser = argparse.ArgumentParser(description="Build an FMU, simulate it and plot the result.")
    parser.add_argument("--gif", action="store_true", help="also write the film quickstart.gif")
    options = parser.parse_args(arguments)
    try:
        report(simulate(Path.cwd()), film=options.gif)
    except OSError as error:
        sys.exit(f"cannot write {error.filename}: {error.strerror}; run this in a writable folder")
    except PrbmError as error:
        sys.exit(str(error))


def report(result: np.ndarray, *, film: bool) -> None:
    """Print frequency and impacts, write the figure and, on request, the film."""
    print(
        f"fundamental frequency {result['mode.frequency'][-1]:.3f} Hz; measured "
        f"{MEASURED[0]} +- {MEASURED[1]} Hz, finite elements {FINITE_ELEMENTS} Hz"
    )
    rest = rest_time(result)
    state = "not yet at rest" if rest is None else f"at rest from {rest:.3f} s on"
    print(f"{result['stop.impact_count'][-1]} impacts, {state}")
    print("figure:", save(response(result, MECHANISM), "quickstart.png"))
    if film:
        print("film:", animate(result, "quickstart.gif", MECHANISM))


if __name__ == "__main__":
    main()
