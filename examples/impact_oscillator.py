"""Map of behaviour of the 1R guide between springs and a wall, over the driving frequency.

The wall is in the middle of the motion.  With a sine force of rising frequency the motion with one
impact per period doubles its period, and becomes irregular.  The script prints the frequency of
the doubling beside the closed form of Shaw and Holmes, and draws the map for both ways of the
frequency.
"""

import sys
from collections.abc import Sequence

import numpy as np

from prbm import load
from prbm.base.progress import Progress, reporter
from prbm.plots.figures import save
from prbm.plots.study import behaviour_map
from prbm.references.impact_oscillator import period_doubling
from prbm.references.scalar_guide import ScalarGuide
from prbm.sweeps.behaviour import Behaviour, behaviour

RATIOS = np.arange(2.4, 3.1, 0.01)  # Driving frequencies over the natural one.
SIZE = 2e-4  # Static displacement under the amplitude of the force [m].
ZETA, RESTITUTION = 0.05, 0.5
VALUES = {
    "gravity.x": 0.0, "gravity.y": 0.0, "damping.beta": 0.0, "damping.zeta": ZETA,
    "stop.position": 0.0, "stop.restitution": RESTITUTION, "stop.rest_speed": 1e-5,
    "release.displacement": -0.5 * SIZE,
}  # fmt: skip
STROBE = "shuttle.x"
APART = 0.05  # Least distance of the positions of a doubled motion, as a share of the largest one.


def simulate(
    ratios: np.ndarray,
    transient: int = 60,
    periods: int = 24,
    progress: Progress | None = None,
) -> Behaviour:
    """Return the map over frequency ratios, with continued state."""
    guide = load("PRBDM")
    scalar = ScalarGuide.of({**guide.values(), **VALUES})
    force = SIZE * scalar.mass * (2.0 * np.pi * scalar.frequency) ** 2
    frequencies = ratios * scalar.frequency
    return behaviour(
        guide, "frequency", frequencies, [STROBE],
        {"force.x": f"sine({force} N, {{frequency}} Hz, {{start}} s)"}, 1.0 / frequencies,
        values=VALUES, transient=transient, periods=periods, progress=progress,
    )  # fmt: skip


def doubling(found: Behaviour) -> float:
    """Return the frequency at which the period doubles [Hz].

    The two positions of the doubled motion move apart with the square root of the distance from
    this frequency.  The square is extrapolated to zero from the first frequencies at which they
    are clearly apart: near the doubling the motion takes long to settle.
    """
    x, strobe = found.values, found.strobe[STROBE]
    apart = (strobe[:, ::2] - strobe[:, 1::2]).mean(axis=1)
    k = int(np.argmax(np.abs(apart) > APART * np.abs(strobe).max()))
    slope = (apart[k + 1] ** 2 - apart[k] ** 2) / (x[k + 1] - x[k])
    return float(x[k] - apart[k] ** 2 / slope)


def main(arguments: Sequence[str]) -> int:
    """Print the frequency at which the period doubles, and draw the map."""
    report = reporter()  # Writes the progress of both ways and the remaining time.
    ways = {
        "upwards": simulate(RATIOS, progress=lambda done: report(0.5 * done)),
        "downwards": simulate(RATIOS[::-1], progress=lambda done: report(0.5 + 0.5 * done)),
    }
    frequency = ways["upwards"].values[0] / RATIOS[0]
    doubled = doubling(ways["upwards"])
    closed = frequency * period_doubling(ZETA, RESTITUTION, 2.5, 3.0)
    print(f"the period doubles at {doubled:.3f} Hz; closed form: {closed:.3f} Hz")
    drawn = {way: (x.values, x.strobe[STROBE], x.impacts) for way, x in ways.items()}
    figure = behaviour_map(
        "Guide with a wall in the middle", ("frequency", "Hz"), (STROBE, "m"), drawn
    )
    print(save(figure, "impact_oscillator.png"))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
