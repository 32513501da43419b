"""How sure is the time of coming to rest?  Monte Carlo over restitution and wall, 2R model.

A wall is never quite where it should be, and a coefficient of restitution is known to a few per
cent.  A thousand runs of one FMU say what that makes of the time of the last impact, T.  Beside it
stands the propagation of uncertainty to first order (GUM, 5.1.2, independent inputs),

    s_T^2 = (dT/de)^2 s_e^2 + (dT/dx)^2 s_x^2,

with derivatives from four runs more.  It knows no skewness: T grows faster and faster with e.
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

from prbm import load
from prbm.base.errors import PrbmError
from prbm.base.progress import reporter
from prbm.fmu.native_fmu import build
from prbm.sweeps.sweep import samples, sweep

MEAN = {"stop.restitution": 0.6, "stop.position": 0.0}  # -, m
SPREAD = {"stop.restitution": 0.03, "stop.position": 0.3e-3}  # standard deviations
OUTPUTS = {"T": "stop.impact_time", "rests": "stop.contact"}
STOP_TIME = 0.8  # s, beyond the slowest of all runs


def distribution(fmu: Path, runs: int, out: Path) -> pd.DataFrame:
    """Run the guide with restitutions and walls drawn at random.

    Parameters
    ----------
    fmu : Path
        Of the guide.
    runs : int
        How many.
    out : Path
        Where the results go; if some are there, the rest is done.

    Returns
    -------
    DataFrame
        A row for each run, with T [s] and whether the guide rests in the end.
    """
    law = {name: stats.norm(MEAN[name], SPREAD[name]) for name in MEAN}
    table = samples(law, runs, method="latin")
    return sweep(fmu, table, out, outputs=OUTPUTS, stop_time=STOP_TIME, progress=reporter())


def propagated(fmu: Path, out: Path) -> float:
    """Return the standard deviation of T by propagation to first order [s]."""
    signs = ((1, 0), (-1, 0), (0, 1), (0, -1))
    rows = [
        {name: MEAN[name] + sign * SPREAD[name] for name, sign in zip(MEAN, pair, strict=True)}
        for pair in signs
    ]
    T = sweep(fmu, pd.DataFrame(rows), out, outputs=OUTPUTS, stop_time=STOP_TIME)["T"]
    return float(np.hypot(T[0] - T[1], T[2] - T[3])) / 2


def figure(results: pd.DataFrame, spread: float) -> Figure:
    """Plot the distribution of T beside the normal one, and T over the restitution."""
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
    """Run the sweep, or the rest of it; print the spread; write the figure."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--runs", type=int, default=1000, help="rows of the table (1000)")
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
        sys.exit(f"cannot write {error.filename}: {error.strerror}; run this in a folder of yours")
    T = 1e3 * results["T"]
    low, middle, high = np.quantile(T, [0.025, 0.5, 0.975])
    print(f"last impact at {middle:.1f} ms, 95 % of {runs} runs within {low:.1f} and {high:.1f} ms")
    print(f"at rest in the end: {results['rests'].sum():.0f} of {runs}")
    print(f"standard deviation {T.std():.2f} ms, to first order {1e3 * spread:.2f} ms")
    print(f"skewness {T.skew():.2f}, to first order 0")
    print("figure: settling.png; results: settling.parquet")


if __name__ == "__main__":
    main()
