"""Damaged saved states of native FMUs: truncated, with flipped bits, of another version, forged.

The first three must be rejected.  A forged state has changed content and a valid checksum.  It may
be accepted, but the FMU must then give finite values or an error.  After each attempt the undamaged
state must continue as before, bit by bit in co-simulation.
"""

from .calls import INTERFACES, NAMES, OWN
from .driver import VIOLATIONS, Counts, drive, models
from .report import Part

TRIALS = 40  # Damaged states of one instance.


def run(total: int, seed: int = 0, names: list[str] | None = None) -> Part:
    """Damage about a total number of states of all mechanisms."""
    every = names or [*models(), *OWN]
    part = Part(
        "Damaged saved states of native FMUs",
        ("interface", "states", "rejected", "forged and accepted", "violations"),
    )
    instances = total // (len(INTERFACES) * len(every) * TRIALS) + 1
    for fmi, kind in INTERFACES:
        counts = Counts()
        for model in every:
            counts.add(drive(model, fmi, kind, "states", count=instances, size=TRIALS, seed=seed))
        part.add(
            f"FMI {fmi}.0 {NAMES[kind]}", counts["restored"] + counts["undone"], counts["undone"],
            counts["restored"], sum(counts[name] for name in VIOLATIONS),
        )  # fmt: skip
        part.failures += counts.details
    part.total()
    return part
