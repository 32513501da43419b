"""Follow held and loaded shapes of random mechanisms, and kick the stable ones.

Laws, for each mechanism:

- Both paths reach the end of their range, or end for a reason, which is counted.
- A shape that is reported to be stable under a dead load keeps a motion that begins there with a
  kick of 1e-4 of the scale of velocities, with a damping ratio of 0.3 and without stops.

``python tests/support/random_equilibria.py --count 2000`` prints a table of the reasons and all
failures.
"""

import argparse
import sys
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

if __name__ == "__main__":  # Tests have these folders already.
    ROOT = Path(__file__).resolve().parent.parent.parent
    sys.path[:0] = [str(ROOT / "fmu_src")]

from prbm.analysis.equilibrium_curve import LoadPath, PathPoint
from prbm.analysis.load_path import HeldPath, held_path, load_path
from prbm.base.errors import EquilibriumError, PrbmError
from prbm.kernel.simulation import KernelSimulation
from prbm.mechanics.assembly import assemble
from prbm.mechanics.modal import modes
from prbm.mechanics.statics import Equilibrium, holding_stiffness
from prbm.mechanics.system import System
from prbm.mechanism.description import Mechanism
from prbm.mechanism.parts import Force
from random_mechanisms import seeded

KICK = 1e-4  # Of the scale of velocities.
KEPT = 0.03  # rad: a motion that stays this close has not left its shape.
RATIO = 0.3  # Damping ratio.
PERIODS = 8  # Of the fundamental mode; the amplitude falls to exp(-15).
STEPS_MAX = 40_000  # Integration steps of a motion that is simulated.
RANGE = 0.15  # Of the size, or 3 times in radians: range of displacements.
TURN = 0.3  # rad by the largest load, if the mechanism were linear.
PROGRESS = 5  # Mechanisms between printed lines.
FREQUENCY_SLOT = 11  # Of the scalars of a saved state in the kernel: the fundamental frequency.


@dataclass
class Findings:
    """What has been found.

    Parameters
    ----------
    reasons : Counter
        Numbers of paths by their end.
    kicked, slow : int
        Numbers of stable shapes that have been simulated, and that would need too many steps.
    failures : list of str
        Violations of the laws.
    """

    reasons: Counter = field(default_factory=Counter)
    kicked: int = 0
    slow: int = 0
    failures: list[str] = field(default_factory=list)

    def ended(self, what: str, path: LoadPath) -> None:
        """Count the end of a path."""
        self.reasons[(what, path.ended or "end of the range")] += 1


def free_of_contacts(seed: int) -> Mechanism:
    """Return a random mechanism without stops and friction, with a force on its released body."""
    guide = seeded(seed)
    forces = (Force("push", guide.release.body),)
    return replace(guide, stops=(), frictions=(), forces=forces)


def check(seed: int, findings: Findings) -> None:
    """Follow the paths of a mechanism, and kick one stable shape of each."""
    guide = free_of_contacts(seed)
    values = guide.values()
    system, rng = assemble(guide, values), np.random.default_rng(seed)
    high = RANGE * (3.0 if guide.release.turns else system.length)
    try:
        held = held_path(system, -high, high)
    except EquilibriumError as error:
        findings.reasons[("held path", f"none: {reason(str(error))}")] += 1
        return
    findings.ended("held path", held.path)
    stiffness = abs(holding_stiffness(system, held.shape(middle(held, system))))
    lever = 1.0 if guide.release.turns else system.length
    force = TURN * stiffness * lever if np.isfinite(stiffness) and stiffness > 0.0 else 1.0
    load = "push.moment" if guide.release.turns else f"push.{'xy'[seed % 2]}"
    try:
        path = load_path(system, {}, {load: force})
    except EquilibriumError as error:
        findings.reasons[("load path", f"none: {reason(str(error))}")] += 1
        return
    findings.ended("load path", path)
    stable = [p for p in path.points if p.unstable == 0 and p.critical == 0]
    if stable:
        point = stable[int(rng.integers(len(stable)))]
        kick(seed, guide, system, point.shape, {load: force * point.share}, rng, findings)
    rests = [p for kind, p in held.path.events if kind == "rest" and p.unstable == 0]
    if rests:
        point = rests[int(rng.integers(len(rests)))]
        kick(seed, guide, system, held.shape(point), {}, rng, findings)


def middle(held: HeldPath, system: System) -> PathPoint:
    """Return the point of a path that is nearest to the straight shape."""
    return min(held.path.points, key=lambda p: float(np.abs(p.shape.q - system.q0).max()))


def reason(text: str) -> str:
    """Return the end of a message, which has no numbers."""
    return text.partition(";")[2].strip() or text


def kick(
    seed: int, guide: Mechanism, system: System, shape: Equilibrium, loads: dict[str, float],
    rng: np.random.Generator, findings: Findings,
) -> None:  # fmt: skip
    """Simulate a kick in a stable shape under loads, and record whether the motion leaves it."""
    n, found = system.n, modes(system, shape)
    lowest = float(found.frequency[0])
    if lowest <= found.rounding:
        return  # A motion without stiffness.
    try:
        # With a velocity, the state is found among the saved numbers, most of which are zeros.
        start = {"damping.zeta": RATIO, "release.velocity": KICK, **loads}
        sim = KernelSimulation(guide, start)
    except PrbmError:
        findings.reasons[("motion", "not started at the drawn shape")] += 1
        return
    # The kick has a random share of each mode, and the scale of the fundamental one.
    rate = 2 * np.pi * lowest
    phi = found.shape @ rng.normal(size=found.shape.shape[1])
    v = KICK * rate * phi / np.abs(phi).max()
    saved, y = sim.snapshot(), sim.state()
    numbers = np.array(saved["numbers"])
    assert y[n : 2 * n].any()
    places = range(len(numbers) - len(y) + 1)
    place = next(k for k in places if np.array_equal(numbers[k : k + len(y)], y))
    numbers[place : place + n], numbers[place + n : place + 2 * n] = shape.q, v
    numbers[FREQUENCY_SLOT] = lowest
    saved["numbers"] = numbers.tolist()
    sim.restore(saved)
    fastest = 2 * np.pi * float(found.frequency[-1])
    beta = system.values["damping.beta"]
    if PERIODS / lowest * max(fastest, beta * fastest**2) / 4.0 > STEPS_MAX:
        findings.slow += 1
        return
    findings.kicked += 1
    for k in range(1, 4 * PERIODS + 1):
        sim.advance(k / (4.0 * lowest))
        away = float(np.abs(sim.state()[:n] - shape.q).max())
        if away > KEPT:
            findings.failures.append(
                f"seed {seed}: a stable shape under {loads or 'no load'} is left by {away:.3g} rad "
                f"in {k / 4} periods of {lowest:.4g} Hz"
            )
            return


def main(seeds: Iterable[int]) -> Findings:
    """Check mechanisms, and print what has been found."""
    findings = Findings()
    for number, seed in enumerate(seeds, 1):
        before = len(findings.failures)
        check(seed, findings)
        for failure in findings.failures[before:]:
            print(failure, flush=True)
        if number % PROGRESS == 0:
            print(f"{number} mechanisms, {findings.kicked} shapes kicked", flush=True)
    for (what, why), count in sorted(findings.reasons.items(), key=lambda x: (x[0][0], -x[1])):
        print(f"{count:6d}  {what}: {why}")
    print(f"{findings.kicked:6d}  stable shapes kicked, {findings.slow} more are too fast")
    print(f"{len(findings.failures):6d}  failures")
    return findings


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=2000, help="mechanisms (default: 2000)")
    parser.add_argument("--first", type=int, default=0, help="first seed (default: 0)")
    given = parser.parse_args()
    raise SystemExit(bool(main(range(given.first, given.first + given.count)).failures))
