"""Uncertainty of the time of coming to rest: Monte Carlo over restitution and wall, 2R model.

The position of a wall has a tolerance, and a coefficient of restitution is known to a few per cent.
A thousand runs of one FMU give the distribution of the time T of the last impact.  It is compared
with first-order propagation of uncertainty (GUM, 5.1.2, independent inputs),

    s_T^2 = (dT/de)^2 s_e^2 + (dT/dx)^2 s_x^2,

where e is the restitution and x the position of the wall, with derivatives from four more runs.
The first order has no skewness, although T grows faster than linearly with e.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from scipy import stats

from prbm import PrbmError, load
from prbm.base.progress import reporter
from prbm.fmu.native_fmu import build
from prbm.sweeps.sweep import samples, sweep

MEAN = {"stop.restitution": 0.6, "stop.position": 0.0}  # Means [-], [m].
SPREAD = {"stop.restitution": 0.03, "stop.position": 0.3e-3}  # Standard deviations [-], [m].
OUTPUTS = {"T": "stop.impact_time", "rests": "stop.contact"}
STOP_TIME = 0.8  # Later than the last impact of every run [s].


def distribution(fmu: Path, runs: int, out: Path) -> pd.DataFrame:
    """Run the guide with random restitutions and wall positions.

    Parameters
    ----------
    fmu : Path
        FMU of the guide.
    runs : int
        Number of runs.
    out : Path
        Folder of the results; an interrupted sweep continues.

    Returns
    -------
    DataFrame
        One row per run, with T [s] and whether the guide rests at the end.
    """
    law = {name: stats.norm(MEAN[name], SPREAD[name]) for name in MEAN}
    table = samples(law, runs, method="latin")
    return sweep(fmu, table, out, outputs=OUTPUTS, stop_time=STOP_TIME, progress=reporter())


def propagated(fmu: Path, out: Path) -> float:
    """Return the standard deviation of T by first-order propagation [s]."""
    signs = ((1, 0), (-1, 0), (0, 1), (0, -1))
    rows = [
        {name: MEAN[name] + sign * SPREAD[name] for name, sign in zip(MEAN, pair, strict=True)}
        for pair in signs
    ]
    T = sweep(fmu, pd.DataFrame(rows), out, outputs=OUTPUTS, stop_time=STOP_TIME)["T"]
    return float(np.hypot(T[0] - T[1], T[2] - T[3])) / 2


def figure(results: pd.DataFrame, spread: float) -> Figure:
    """Plot the distribution of T beside a normal distribution, and T over the restitution."""
    result = Figure((9.0, 3.8), dpi=120, layout="constrained")
    left, right = result.subplots(1, 2)
    T = 1e3 * results["T"]
    left.hist(T, bins="auto", density=True, color="#8fb4d8", label=f"{len(T)} runs")
    x = np.linspace(T.min(), T.max(), 300)
    left.plot(x, stats.norm.pdf(x, T.median(), 1e3 * spread), color="#1f4e79", label="first order")
    left.set_xlabel("last impact at T [ms]")
    left.set_ylabel("density [1/ms]")
    left.legend(frameon=False)
    dots = right.scatter(
        results["stop.restitution"], T, c=1e3 * results["stop.position"], s=6, cmap="viridis"
    )
    result.colorbar(dots, label="stop.position [mm]")
    right.set_xlabel("stop.restitution [-]")
    right.set_ylabel("last impact at T [ms]")
    right.xaxis.set_major_locator(MaxNLocator(6))
    for axes in (left, right):
        axes.grid(color="#eeeeee")
        axes.set_axisbelow(True)
    return result


def main(arguments: Sequence[str] | None = None) -> None:
    """Run or continue the sweep, print the spread and write the figure."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--runs", type=int, default=1000, help="number of runs (default: 1000)")
    runs = parser.parse_args(arguments).runs
    try:
        fmu = Path("PRBDM2R.fmu")
        fmu.write_bytes(build(load("PRBDM2R")))
        results = distribution(fmu, runs, Path("settling.parquet"))
        spread = propagated(fmu, Path("derivatives.parquet"))
        figure(results, spread).savefig("settling.png")
    except PrbmError as error:
        sys.exit(str(error))
    except KeyboardInterrupt as stop:
        sys.exit(str(stop))
    except OSError as error:
        sys.exit(f"cannot write {error.filename}: {error.strerror}; run this in a writable folder")
    T = 1e3 * results["T"]
    low, middle, high = np.quantile(T, [0.025, 0.5, 0.975])
    print(f"last impact at {middle:.1f} ms, 95 % of {runs} runs within {low:.1f} and {high:.1f} ms")
    print(f"at rest at the end: {results['rests'].sum():.0f} of {runs}")
    print(f"standard deviation {T.std():.2f} ms, first order {1e3 * spread:.2f} ms")
    print(f"skewness {T.skew():.2f}, first order 0")
    print("figure: settling.png; results: settling.parquet")


if __name__ == "__main__":
    main()
