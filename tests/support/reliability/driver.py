"""Compile and run ``driver/``: native FMUs under legal and illegal calls, with value oracles."""

import math
import os
import subprocess
import tempfile
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

from fmpy import read_model_description

from c_importer import POSIX, SOURCES, Job, compile_c, kernel_library, native, native_clock
from fuzzing import ENVIRONMENT, SANITIZERS
from prbm.files.mechanism_file import shipped
from shared import once

DRIVER = Path(__file__).with_name("driver")
TYPES = {"Real": "r", "Float64": "r", "Integer": "i", "Int32": "i"}
ROLES = {"input": "u", "output": "o", "local": "o", "calculatedParameter": "o"}
ENDS = {
    "gap": "g", "impact_count": "n", "work": "w", "kinetic": "e", "elastic": "e",
    "gravitational": "e", "dissipated": "e", "tolerance": "a", "position": "m",
    "displacement": "m", "velocity": "m", "mobility": "m",
}  # fmt: skip
"""Tags of variables by the end of their names; the driver's oracles read them."""
UNITS = {"m": "l", "kg": "q", "m/s2": "b"}
"""Tags of parameters by their units, from which the oracles compute round-off."""

GAP_ATOL = 1e-8  # m: largest penetration of a rigid stop; times the size of larger mechanisms.
ENERGY_RTOL = 1e-5  # Of the largest energy in a run: bound of its balance at tolerance 0.
ENERGY_FACTOR = 3e3  # Of the tolerance of the integration, added to ENERGY_RTOL.
CALL_SECONDS = 1.0  # CPU time of one call.
PROCESS_SECONDS = 60.0  # CPU time of one sequence.

VIOLATIONS = (
    "not_finite", "penetrated", "energy_lost", "count_fell", "accepted", "changed", "silent",
    "over_budget", "slow", "crashed",
)  # fmt: skip
"""Counts that must be zero in a sequence of calls."""

LARGEST = ("worst_energy", "worst_penetration", "worst_call")
"""Values of which the largest is kept; the others are added."""


@dataclass
class Counts:
    """The counts of some runs of the driver by name, and the details of violations."""

    counts: Counter[str] = field(default_factory=Counter)
    largest: dict[str, float] = field(default_factory=dict)
    details: list[str] = field(default_factory=list)

    def __getitem__(self, name: str) -> int:
        return self.counts[name]

    def add(self, other: "Counts") -> "Counts":
        """Add the counts of another run; keep the largest of the values that are no counts."""
        self.counts.update(other.counts)
        for name, value in other.largest.items():
            self.largest[name] = max(value, self.largest.get(name, 0.0))
        self.details += other.details
        return self

    def violations(self, allowed: Sequence[str] = ()) -> dict[str, int]:
        """Return the numbers of violations that are not zero, except those allowed."""
        return {n: self[n] for n in VIOLATIONS if self[n] and n not in allowed}


def sanitized_flags() -> tuple[str, ...]:
    return (*SANITIZERS, "-O1")


@cache
def program(flags: tuple[str, ...] = ()) -> Path:
    """Return the compiled driver."""
    sources = [*sorted(DRIVER.glob("*.c"))]
    sources += [SOURCES / f"{name}.c" for name in ("job", "library", "instance")]
    options = [*flags, "-I", str(SOURCES), "-D_DEFAULT_SOURCE", *POSIX]
    return once(f"driver-{len(flags)}", lambda path: compile_c(path, sources, options))


def plan(folder: Path, kind: str, step: float, **limits: float) -> str:
    """Return the text of a plan: the limits, and the variables with their roles and bounds."""
    found = read_model_description(str(folder))
    numbers = {
        "gap_atol": GAP_ATOL, "energy_rtol": ENERGY_RTOL, "energy_factor": ENERGY_FACTOR,
        "call_seconds": CALL_SECONDS, "process_seconds": PROCESS_SECONDS, **limits,
    }  # fmt: skip
    lines = [" ".join(map(repr, (step, *numbers.values())))]
    variables = [v for v in found.modelVariables if v.type in TYPES and v.name != "time"]
    ends: dict[str, set[str]] = {}
    for v in variables:
        ends.setdefault(_part(v), set()).add(v.name.rpartition(".")[2])
    lines += [_line(v, kind, ends[_part(v)]) for v in variables]
    return "\n".join(lines) + "\n"


def _part(variable: Any) -> str:
    return str(variable.name.rpartition(".")[0])


def _line(variable: Any, kind: str, ends: set[str]) -> str:
    """Return the line of a plan for a variable: reference, type, role, tag, start and bounds.

    The variables of the same part end with ``ends``.  The gap of a compliant stop, which has a
    peak force, may be negative; what moves the wall of a stop has a tag: its mobility, too, since
    an impact moves a wall of finite mass.
    """
    v = variable
    role = ROLES.get(v.causality) or ("t" if v.variability == "tunable" else "p")
    end = v.name.rpartition(".")[2]
    kept = kind == "me" and role == "t" and end == "offset"
    role = "k" if kept else role
    tag = "-" if v.name.startswith("der(") else ENDS.get(end, "-")
    compliant, stop = "peak_force" in ends, "impact_count" in ends
    if (tag == "g" and compliant) or (tag == "m" and (not stop or role == "o")):
        tag = "-"
    if tag == "-" and role in "ptk":
        tag = UNITS.get(v.unit or (v.declaredType and v.declaredType.unit), "-")
    start = float(v.start or 0.0)
    nominal = float(v.nominal or (v.declaredType and v.declaredType.nominal) or 0.0)
    scale = nominal or abs(start) or 1.0
    low, high = (
        limit if value is None else float(value)
        for value, limit in ((v.min, -math.inf), (v.max, math.inf))
    )
    numbers = " ".join(repr(x) for x in (start, low, high, scale))
    return f"{v.valueReference} {TYPES[v.type]} {role} {tag} {numbers}"


def drive(
    model: str,
    fmi: int,
    kind: str,
    part: str,
    *,
    count: int,
    size: int,
    seed: int = 0,
    sanitize: bool = False,
    substep: float = 2e-5,
    tolerance: float | None = None,
    **limits: float,
) -> Counts:
    """Run sequences of the driver with a native FMU.

    Parameters
    ----------
    model : str
        Name of a mechanism.
    kind : str
        ``cs``, ``events``, ``clock`` (events of an FMU with a clock) or ``me``.
    part : str
        ``calls``, ``states`` or ``draws``.
    count, size : int
        Number of sequences, and of actions, damaged states or steps in each.
    seed : int
        Seed of the first sequence; the next ones have the next numbers.
    sanitize : bool
        Whether the driver and the library have the sanitizers of addresses and undefined
        behaviour.
    substep : float
        Step of the integration in model exchange [s].
    tolerance : float or None
        Relative tolerance that the importer gives, if any.
    limits
        Limits other than the defaults: ``gap_atol`` [m], ``energy_rtol``, ``call_seconds`` and
        ``process_seconds``.
    """
    folder = native_clock(model) if kind == "clock" else native(model, fmi)
    kind = "events" if kind == "clock" else kind
    flags = sanitized_flags() if sanitize else ()
    library = kernel_library("sanitized-fast", flags) if sanitize else None
    job = Job(folder, kind, substep=substep, library=library, tolerance=tolerance)
    experiment = read_model_description(str(folder)).defaultExperiment
    with tempfile.TemporaryDirectory(prefix="prbm_driver_") as name:
        files = [Path(name) / "job.txt", Path(name) / "plan.txt"]
        files[0].write_text(job.text(), encoding="utf-8")
        files[1].write_text(
            plan(folder, kind, float(experiment.stepSize), **limits), encoding="utf-8"
        )
        done = subprocess.run(
            [program(flags), *files, part, str(seed), str(count), str(size)],
            capture_output=True, text=True, check=False, errors="replace",
            env=os.environ | ENVIRONMENT,
        )  # fmt: skip
    assert done.returncode == 0, done.stderr[-4000:]
    return _read(f"{model}, FMI {fmi}.0, {kind}", done.stdout, done.stderr)


def _read(name: str, output: str, errors: str) -> Counts:
    counts = Counts(details=[f"{name}: {line}" for line in errors.splitlines()])
    for line in output.splitlines():
        word, number = line.split()
        if word in LARGEST:
            counts.largest[word] = float(number)
        else:
            counts.counts[word] += int(number)
    return counts


def models() -> list[str]:
    return sorted(shipped())
