"""Calls of the FMI functions of native FMUs, legal and illegal, with value oracles.

A sequence instantiates an FMU, sets parameters, initializes it and makes random actions: steps of
different sizes, changes of inputs and tunable parameters, saved and restored states, resets, and
illegal calls.  In model exchange a small integrator locates events.  Each OK must be true:

- all outputs, derivatives and event indicators are finite;
- no rigid stop is penetrated by more than ``GAP_ATOL``; in model exchange, by more than
  ``EXCHANGE_GAP_ATOL`` in every other sequence, in which no wall moves;
- the energy balance stays within its bound: over the run in co-simulation, from before a saved
  state to after it is restored, and across each event in model exchange;
- counts of impacts do not fall;
- no call takes more than ``CALL_SECONDS`` of CPU time.

An illegal call must be rejected with a message, and neither it nor a failed step changes a value.
"""

from collections.abc import Iterator

from c_importer import ANVIL, COMPLIANT, TWO_STOPS
from support import case

from .driver import VIOLATIONS, Counts, drive, models
from .report import Part

INTERFACES = ((2, "cs"), (3, "cs"), (3, "events"), (2, "me"), (3, "me"))
WITH_CLOCK = (*INTERFACES, (3, "clock"))
OWN = (ANVIL, TWO_STOPS, COMPLIANT)  # The mechanisms of the tests.
EXCHANGE_GAP_ATOL = 1e-6  # m; the error of the integration in model exchange is larger.
ACTIONS = 200  # Actions of a sequence.
SEQUENCES = {
    "cs": 20,
    "events": 20,
    "clock": 20,
    "me": 4,
}  # Sequences of one process, of similar length.
SUBSTEP_MAX = 2e-4  # s; steps of the integration in model exchange.
SUBSTEP_OTHER = 2e-5  # s; of the mechanisms of the tests.
SANITIZED_SHARE = 50  # One call in 50 runs with sanitizers, too.
NAMES = {
    "cs": "co-simulation", "events": "co-simulation, events", "clock": "co-simulation, clock",
    "me": "model exchange",
}  # fmt: skip


def substep(model: str) -> float:
    """Return a stable step of the classical Runge-Kutta method [s]."""
    return SUBSTEP_OTHER if model in OWN else case(model).substep(SUBSTEP_MAX)


def called(model: str, fmi: int, kind: str, calls: int, seed: int, sanitize: bool) -> Counts:
    """Return the counts of sequences with at least a number of calls."""
    counts = Counts()
    limits = {"gap_atol": EXCHANGE_GAP_ATOL} if kind == "me" else {}
    while counts["calls"] < calls:
        counts.add(
            drive(
                model, fmi, kind, "calls", count=SEQUENCES[kind], size=ACTIONS,
                seed=seed + counts["sequences"], sanitize=sanitize, substep=substep(model),
                call_seconds=20.0 if sanitize else 1.0, **limits,
            )
        )  # fmt: skip
    return counts


def searched(
    total: int, seed: int, sanitize: bool, names: list[str]
) -> Iterator[tuple[int, str, Counts]]:
    """Yield the counts of all interfaces, with about a total number of calls."""
    share = total // (len(names) * len(WITH_CLOCK)) + 1
    for fmi, kind in WITH_CLOCK:
        counts = Counts()
        for model in names:
            counts.add(called(model, fmi, kind, share, seed, sanitize))
        yield fmi, kind, counts


def run(total: int, seed: int = 0, names: list[str] | None = None) -> Part:
    """Make about a total number of calls with all mechanisms, some of them with sanitizers."""
    every = names or [*models(), *OWN]
    part = Part(
        "Calls of native FMUs",
        ("interface", "calls", "illegal", "steps", "events", "rejected", "violations",
         "longest call"),
    )  # fmt: skip
    for sanitize in (False, True):
        share, chosen = (total // SANITIZED_SHARE, [ANVIL]) if sanitize else (total, every)
        for fmi, kind, counts in searched(share, seed, sanitize, chosen):
            rejected = sum(counts[f"status_{i}"] for i in (2, 3, 4, 5))
            part.add(
                f"FMI {fmi}.0 {NAMES[kind]}{', sanitizers' if sanitize else ''}",
                counts["calls"], counts["illegal"], counts["steps"], counts["events"], rejected,
                sum(counts[name] for name in VIOLATIONS),
                f"{1e3 * counts.largest['worst_call']:.0f} ms",
            )  # fmt: skip
            part.failures += counts.details
    part.total()
    return part
