"""Parameters of the shipped mechanisms drawn over their declared bounds.

Half of the draws change one to three parameters, the others change all.  A parameter whose bounds
span decades is drawn by its logarithm.  Each draw runs in a process of its own:

- *rejected*: an error with a message, at initialization or in a step;
- *slow*: stopped after a limit of CPU time;
- *wrong*: a violation of the oracles of ``calls``, a crash, or a failure without a message;
- *coarse*: the energy balance exceeds its bound at the drawn tolerance, but not at a tighter one;
- *ran*: all others.
"""

import re
from collections import Counter
from dataclasses import dataclass, field

from .driver import Counts, drive, models
from .report import Part

STEPS = 50  # Communication steps of the default experiment.
CPU_SECONDS = 0.1  # Of one draw.
TIGHT = (1e-11, 1e-13)  # Relative tolerances at which coarse draws are repeated.
TIGHT_CPU_SECONDS = 20.0
SEED = re.compile(r": seed (\d+)")
CHUNK = 100  # Draws of one process.


@dataclass
class Drawn:
    """The classes of the draws of a mechanism, and the details of wrong ones."""

    classes: Counter[str] = field(default_factory=Counter)
    wrong: list[str] = field(default_factory=list)


def _draw(
    model: str, count: int, seed: int, seconds: float, tolerance: float | None = None
) -> Counts:
    return drive(
        model, 2, "cs", "draws", count=count, size=STEPS, seed=seed, tolerance=tolerance,
        call_seconds=1e3, process_seconds=seconds,
    )  # fmt: skip


def _is_coarse(model: str, seed: int) -> bool:
    """Return whether a tighter tolerance brings the energy balance within its bound.

    The motion with this tolerance may end with an error, for instance by chatter.
    """
    for tolerance in TIGHT:
        found = _draw(model, 1, seed, TIGHT_CPU_SECONDS, tolerance)
        if (found["ran"] or found["rejected_later"]) and not found.violations():
            return True
    return False


def drawn(model: str, count: int, seed: int = 0) -> Drawn:
    """Classify draws of a mechanism."""
    result = Drawn()
    counts = Counts()
    for first in range(seed, seed + count, CHUNK):
        chunk = min(CHUNK, seed + count - first)
        counts.add(_draw(model, chunk, first, CPU_SECONDS))
    bad: dict[int, list[str]] = {}
    for line in counts.details:
        found = SEED.search(line)
        if found and "slow" not in line:
            bad.setdefault(int(found[1]), []).append(line)
    for number, lines in bad.items():
        energy_only = all("energy" in line for line in lines)
        name = "coarse" if energy_only and _is_coarse(model, number) else "wrong"
        result.classes[name] += 1
        result.wrong += lines[:1] if name == "wrong" else []
    result.classes["slow"] = counts["slow"]
    result.classes["rejected"] = counts["rejected_at_start"] + counts["rejected_later"]
    result.classes["ran"] = count - sum(result.classes.values())
    return result


def run(count: int, seed: int = 0, names: list[str] | None = None) -> Part:
    """Draw parameters of each shipped mechanism."""
    kinds = ("ran", "rejected", "slow", "coarse", "wrong")
    part = Part(
        "Parameters drawn over their bounds",
        ("mechanism", "draws", *kinds),
    )
    for model in names or models():
        result = drawn(model, count, seed)
        part.add(model, count, *(result.classes[kind] for kind in kinds))
        part.failures += result.wrong
    part.total()
    return part
