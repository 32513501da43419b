"""Time of coming to rest over the restitution, 1R model.

The result of the FMU is compared with an independent solution.  The 1R guide obeys one scalar
equation for the angle theta of its links, with the moving mass M, the stiffness k of each of its
four pivots, the flexure length L and the gravity g:

    M r^2 theta'' = -4 k theta + M g r cos(theta),      r = gamma L.

With the potential energy V, a bounce that leaves the wall (theta = 0) at the speed v lasts

    T(v) = 2 int_0^theta_max d theta / |theta'|,        M r^2 theta'^2 / 2 = M v^2 / 2 - V(theta),

and the guide rests at t_1 + T(eps v_1) + T(eps^2 v_1) + ..., where t_1 and v_1 are time and closing
speed of the first impact and eps is the restitution.
"""

import io
import math
import sys
from collections.abc import Sequence

import fmpy
import numpy as np
from matplotlib.figure import Figure
from scipy.integrate import quad
from scipy.optimize import brentq

from prbm import load
from prbm.fmu.python_fmu import build
from prbm.fmu.unpack import unpacked

RESTITUTIONS = (0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9)
REST_SPEED = 1e-5  # Slower impacts end the bouncing, at most 0.1 ms early [m/s].
OUTPUTS = [f"stop.{x}" for x in ("impact_count", "impact_time", "approach_speed", "rebound_speed")]


def study(restitutions: Sequence[float] = RESTITUTIONS) -> np.ndarray:
    """Simulate the guide once for each restitution.

    Parameters
    ----------
    restitutions : sequence of float
        Coefficients of restitution below 1 [-].

    Returns
    -------
    structured array
        ``restitution`` [-]; ``rebound``, the ratio of opening to closing speed that differs most
        from it [-]; ``impacts``; ``rest_time`` by the FMU and ``exact`` by the scalar equation [s].
    """
    with unpacked(io.BytesIO(build(load("PRBDM")))) as unzipped:
        start = {"damping.beta": 0.0, "stop.rest_speed": REST_SPEED}
        rows = []
        for restitution in restitutions:
            result = fmpy.simulate_fmu(
                unzipped,
                stop_time=1.2 * exact_rest_time(restitution),
                output_interval=2e-3,
                start_values=start | {"stop.restitution": restitution},
                output=OUTPUTS,
            )
            hit = result[result["stop.impact_count"] > 0]
            ratios = hit["stop.rebound_speed"] / hit["stop.approach_speed"]
            rows.append(
                (
                    restitution,
                    ratios[np.abs(ratios - restitution).argmax()],
                    hit["stop.impact_count"][-1],
                    hit["stop.impact_time"][-1],
                    exact_rest_time(restitution),
                )
            )
    names = ("restitution", "rebound", "impacts", "rest_time", "exact")
    return np.array(rows, [(name, float) for name in names])


def exact_rest_time(restitution: float, release: float = -0.018, K_theta: float = 2.65) -> float:
    """Return the time of coming to rest by the scalar equation, after a release at rest [s]."""
    L, h, b, E, rho = 0.04, 1e-4, 8e-3, 181.5e9, 7800.0  # Flexure.
    gamma = 0.8517
    flexure = rho * L * h * b
    M = 0.053187 + 2 * (flexure / 4 + flexure * L**2 / 12 / (gamma * L) ** 2)
    k, r, g = 2 * gamma * K_theta * E * b * h**3 / 12 / L, gamma * L, 9.81

    def V(theta: float) -> float:
        return 2 * k * theta**2 - M * g * r * math.sin(theta)

    def time_to_wall(theta_max: float) -> float:
        # The substitution theta = theta_max (1 - s^2) removes the singularity of the integrand.
        def integrand(s: float) -> float:
            kinetic = V(theta_max) - V(theta_max * (1 - s * s))
            return 2 * s * abs(theta_max) * math.sqrt(M * r**2 / 2 / kinetic)

        return quad(integrand, 0.0, 1.0, epsabs=1e-13)[0]

    start = math.asin(release / r)
    total, v = time_to_wall(start), math.sqrt(2 * V(start) / M)
    while restitution * v > 1e-2 * REST_SPEED:
        v *= restitution
        farthest = brentq(lambda x, v=v: V(x) - M * v * v / 2, start, 0.0, xtol=1e-18)
        total += 2 * time_to_wall(farthest)
    return total


def figure(table: np.ndarray) -> Figure:
    """Plot the time of coming to rest and the number of impacts over the restitution."""
    result = Figure((7.0, 4.2), dpi=120, layout="constrained")
    axes = result.subplots()
    axes.plot(table["restitution"], table["exact"], color="#8fb4d8", label="scalar equation")
    axes.plot(table["restitution"], table["rest_time"], "o", color="#1f4e79", label="FMU")
    for row in table:
        axes.annotate(
            f"{row['impacts']:.0f}", (row["restitution"], row["rest_time"]), (0, 7),
            textcoords="offset points", ha="center", fontsize=8,
        )  # fmt: skip
    axes.set_xlabel("stop.restitution [-]")
    axes.set_ylabel("time of coming to rest [s] (labels: impacts)")
    axes.set_ylim(bottom=0.0, top=1.12 * table["rest_time"].max())
    axes.grid(color="#eeeeee")
    axes.legend(frameon=False)
    return result


def main() -> None:
    """Run the study, print the table and write the figure."""
    table = study()
    print("restitution  rebound ratio  impacts  at rest from  scalar equation")
    for row in table:
        print(
            f"{row['restitution']:11.1f}  {row['rebound']:13.9f}  {row['impacts']:7.0f}  "
            f"{row['rest_time']:10.5f} s  {row['exact']:13.5f} s"
        )
    print(f"largest difference {np.abs(table['rest_time'] - table['exact']).max():.1e} s")
    try:
        figure(table).savefig("parameter_study.png")
    except OSError as error:
        sys.exit(f"cannot write {error.filename}: {error.strerror}; run this in a writable folder")
    print("figure: parameter_study.png")


if __name__ == "__main__":
    main()
