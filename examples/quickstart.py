"""Build an FMU, simulate it with FMPy, plot what it does.

    python -m pip install .
    python examples/quickstart.py

writes PRBDM2R.fmu and quickstart.png into the current folder; with --gif a film too.
"""

import argparse
import sys
from pathlib import Path

import fmpy
import numpy as np

from prbm import load
from prbm.base.errors import PrbmError
from prbm.fmu.python_fmu import build
from prbm.plots.animation import animate
from prbm.plots.figures import response, save
from prbm.runs.result import rest_time

MECHANISM = load("PRBDM2R")
MEASURED = 4.82, 0.06  # Hz, of the steel structure, and its uncertainty
FINITE_ELEMENTS = 4.907  # Hz, 32 ANCF elements a flexure


def simulate(folder: Path, stop_time: float = 1.0) -> np.ndarray:
    """Build the FMU into a folder and simulate it from its release.

    Parameters
    ----------
    folder : Path
        Where the FMU goes.
    stop_time : float
        [s].

    Returns
    -------
    structured array
        Outputs and link angles by name, a row every millisecond, in SI units.
    """
    fmu = folder / "PRBDM2R.fmu"
    fmu.write_bytes(build(MECHANISM))
    variables = fmpy.read_model_description(fmu).modelVariables
    record = [v.name for v in variables if v.causality in ("output", "local")]
    return fmpy.simulate_fmu(fmu, stop_time=stop_time, output_interval=1e-3, output=record)


def main(arguments: list[str] | None = None) -> None:
    """Simulate, print what happened, write the figure."""
    parser = argparse.ArgumentParser(description="Build an FMU, simulate it, plot it.")
    parser.add_argument("--gif", action="store_true", help="write quickstart.gif too")
    options = parser.parse_args(arguments)
    try:
        _tell(simulate(Path.cwd()), film=options.gif)
    except OSError as error:
        sys.exit(f"cannot write {error.filename}: {error.strerror}; run this in a folder of yours")
    except PrbmError as error:
        sys.exit(str(error))


def _tell(result: np.ndarray, *, film: bool) -> None:
    print(
        f"fundamental frequency {result['mode.frequency'][-1]:.3f} Hz; measured "
        f"{MEASURED[0]} +- {MEASURED[1]} Hz, finite elements {FINITE_ELEMENTS} Hz"
    )
    rest = rest_time(result)
    then = "not at rest yet" if rest is None else f"at rest from {rest:.3f} s on"
    print(f"{result['stop.impact_count'][-1]} impacts, {then}")
    print("figure:", save(response(result, MECHANISM), "quickstart.png"))
    if film:
        print("film:", animate(result, "quickstart.gif", MECHANISM))


if __name__ == "__main__":
    main()
