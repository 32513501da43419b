"""Motions of random mechanisms with parts of all kinds, judged by laws.

- Both engines have the same events (kind, part, time) and outputs, or end with the same error.
- Kinetic, elastic, potential and dissipated energy, minus the work of inputs, are constant.
- Linear and angular momentum of a mechanism that nothing joins to the ground are constant.
- A drawing that is turned, mirrored, shifted, reordered or in other units moves alike: the events
  have the same times.

A motion that differs is chaotic, not wrong, if a change of the release, of its velocity by
``NUDGE`` and of its displacement by the share ``NUDGE_RTOL``, grows in one engine to a difference
of ``GROWN``, too, or makes the shape unreachable.  Forces of contacts with friction that can stick
only together are not compared: the laws of friction permit several.

``python tests/support/random_motions.py --count 2000`` prints the number of each result and all
failures.
"""

import argparse
import cmath
import ctypes
import math
import re
import signal
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pytest

if __name__ == "__main__":  # Tests have these folders already.
    ROOT = Path(__file__).resolve().parent.parent.parent
    sys.path[:0] = [str(ROOT / "fmu_src")]

import kernel_simulation
from kernel_simulation import KernelMistake, KernelSimulation
from moved_drawings import moved
from prbm.base.errors import PrbmError
from prbm.hybrid.events import EventKind
from prbm.hybrid.simulation import Simulation
from prbm.interface.variables import Variable, variables
from prbm.mechanism.description import Mechanism
from random_mechanisms import inputs, moves, varied_attempts
from scaled import Units, unbounded
from support import energy_balance

END, SAMPLES = 3e-3, 3  # Duration [s] and number of compared samples.
TOLERANCE = 1e-10
EXACT = 1e-12  # An imbalance of the integration falls with the tolerance, a wrong law's does not.
DEVIATION_MAX = 1e-4  # Of the nominal value; impacts amplify rounding errors.
TIME_MAX = 1e-4  # Of the duration: difference of the times of an event.
BALANCE_MAX = 1e-6  # Of the largest energy or momentum; contacts have 100 times the tolerance.
NUDGE, NUDGE_RTOL = 1e-9, 1e-8  # m/s, and of the displacement
GROWN = 1e-5  # Of nominal values, or of the duration: 10,000 times as much as its cause.
PEAK_RTOL = 1e-2  # Largest of the samples at the ends of steps, whose lengths vary by round-off.
Nominals = Mapping[str, float]
PEAKS = ("peak_stress", "peak_stress_time", "peak_stress_position")
START_SHARE = 1e-3  # Of the duration.
COUNTED = ("impact_count", "contact")
LOCKED = "the release is almost locked"
PRESSED = "a compliant stop is pressed deeply at the release"
PRESSED_MAX = 1e-3  # m; deeper than hits.  The damping of a contact rises with its elastic force.
UNSEEN = EventKind.SWITCH  # A change of the phase of a compliant stop is no event of a step.
SECONDS_MAX = 12  # Computing time of a draw; searches for equilibria may take longer.
PROGRESS = 20  # Draws between printed lines.
MOTIONS = ("x", "y", "angle", "vx", "vy", "omega", "gap", "gap_rate", "strain", "strain_rate")
"""Outputs that the motion determines, however contacts share a load; energies, too."""
COMPARED = ("gap", "gap_rate", "force", "impact_count", "approach_speed")
"""Outputs of stops that do not depend on the place of a drawing."""


@dataclass
class Motion:
    """A motion: its events by kind, part and time, samples of its outputs, and its end.

    ``error`` is the message that ended it, empty if it reached the end.  In the samples ``shared``,
    contacts with friction share their load.
    """

    events: list[tuple[str, str, float]] = field(default_factory=list)
    samples: list[dict[str, float]] = field(default_factory=list)
    momenta: list[tuple[complex, float]] = field(default_factory=list)
    shared: set[int] = field(default_factory=set)
    error: str = ""

    @property
    def cause(self) -> str:
        """The error without its numbers and parts, which depend on the last digits."""
        return re.sub(r"[-+.e\d]*\d", "", self.error.partition(" at t")[0].partition(" within")[0])


class _Recorded(Simulation):
    """A simulation that records the events that it applies."""

    def __init__(self, *given, **options) -> None:
        self.events: list[tuple[EventKind, int, float]] = []
        super().__init__(*given, **options)

    def _apply(self, event) -> None:
        self.events.append((event.kind, event.contact, event.time))
        super()._apply(event)


def part_names(model: Mechanism) -> list[str]:
    """Return the names of contacts and springs in the order of events."""
    return [part.name for part in (*model.stops, *model.rubbing, *model.springs)]


def engine_motion(
    model: Mechanism, values: dict[str, float], end: float = END, tolerance: float = TOLERANCE
) -> Motion:
    """Return the motion in the Python engine."""
    found, names = Motion(), part_names(model)
    sim = None
    try:
        sim = _Recorded(model, values, tolerance=tolerance)
        if not moves(sim):
            return Motion(error=LOCKED)
        gaps, _ = sim.front.gaps_and_rates()
        if min(gaps, default=0.0) < -PRESSED_MAX:
            return Motion(error=PRESSED)
        for k, t in enumerate(np.linspace(0.0, end, SAMPLES + 1)):
            sim.advance(float(t))
            if shares(sim):
                found.shared.add(k)
            found.samples.append(sim.outputs())
            found.momenta.append(momentum(sim))
    except PrbmError as error:
        found.error = str(error)
    for kind, contact, t in sim.events if sim else ():
        if kind is not UNSEEN:
            found.events.append((kind.name, names[contact], t))
    return found


def kernel_motion(model: Mechanism, values: dict[str, float], end: float = END) -> Motion:
    """Return the motion in the kernel."""
    found, names = Motion(), part_names(model)
    event, effort = ctypes.c_bool(), (ctypes.c_double * 2)()
    try:
        sim = KernelSimulation(model, values, tolerance=TOLERANCE, described=False)
        for t in np.linspace(0.0, end, SAMPLES + 1):
            effort[:] = (0.0, 0.0)
            while True:
                at = ctypes.byref(event)
                sim.call("simulation_advance_some", float(t), False, effort, at)
                if not event.value:
                    break
                kind, contact, when = sim.pending()
                found.events.append((EventKind(kind).name, names[contact], when))
                sim.call("simulation_handle_event")
            found.samples.append(sim.outputs())
    except (KernelMistake, PrbmError) as error:
        found.error = str(error)
    return found


def shares(sim: Simulation) -> bool:
    """Return whether contacts with friction, of which some stick, can stick only together."""
    front, scales = sim.front, sim.configuration.scales
    equations, contacts = front.equations, front.contacts
    rubbing = [
        c
        for c, mode in enumerate(contacts.modes)
        if (mode.closed or c in contacts.pressed) and equations.friction_coefficient(c) > 0.0
    ]
    if not equations.sticking:
        return False
    held = equations.with_contacts(contacts.without_friction()).rows.jacobian(front.e)
    for c in rubbing:
        row = equations.slip_row(c, front.e)[None]
        if abs(float((row @ front.v).item())) > scales.zero_speed or not front.at.moves(row):
            continue
        if not front.at.independent(held, row):
            return True
        held = np.vstack([held, row])
    return False


def momentum(sim: Simulation) -> tuple[complex, float]:
    """Return the linear momentum [N s], and the angular momentum about the origin [N m s]."""
    system, y, n = sim.system, sim.state(), sim.system.n
    e, v = system.directions(y[:n]), y[n : 2 * n]
    z = system.A @ e + system.c
    p = system.m * (1j * (system.A @ system.swing(e, v)))
    turning = sum(system.J[frame.arm] * v[frame.j] for frame in system.bodies.values())
    return p.sum(), float((z.conj() * p).imag.sum() + turning)


# --- drawings that move alike -------------------------------------------------------------------


def turned(model: Mechanism, values: dict[str, float]) -> tuple[Mechanism, dict[str, float]]:
    """Return a drawing and inputs that are turned by 77 degrees."""
    u = cmath.exp(1j * math.radians(77.0))
    return moved(model, lambda z: u * z, turn=77.0), _moved_inputs(values, lambda z: u * z)


def mirrored(model: Mechanism, values: dict[str, float]) -> tuple[Mechanism, dict[str, float]]:
    """Return a drawing and inputs that are mirrored at the axis x."""
    return moved(model, _conjugate, sign=-1.0), _moved_inputs(values, _conjugate, -1.0)


def shifted(model: Mechanism, values: dict[str, float]) -> tuple[Mechanism, dict[str, float]]:
    """Return a drawing that is shifted."""
    return moved(model, lambda z: z + 0.37 - 0.21j), values


def reordered(model: Mechanism, values: dict[str, float]) -> tuple[Mechanism, dict[str, float]]:
    """Return a mechanism whose parts are in the opposite order."""
    kinds = (
        "bodies", "flexure_types", "flexures", "joints", "springs", "guides", "stops", "frictions",
        "forces",
    )  # fmt: skip
    return replace(model, **{kind: getattr(model, kind)[::-1] for kind in kinds}), values


CHANGES = (turned, mirrored, shifted, reordered)


def _conjugate(z: complex) -> complex:
    return z.conjugate()


def _moved_inputs(
    values: dict[str, float], turn: Callable[[complex], complex], sign: float = 1.0
) -> dict[str, float]:
    found = {name: sign * x for name, x in values.items() if name.endswith(".moment")}
    for name in values:
        if name.endswith(".x"):
            part = name.removesuffix(".x")
            z = turn(complex(values[name], values[f"{part}.y"]))
            found |= {f"{part}.x": z.real, f"{part}.y": z.imag}
    return found


# --- laws ---------------------------------------------------------------------------------------


def event_difference(one: Motion, other: Motion, end: float = END, factor: float = 1.0) -> str:
    """Return how the events of two motions differ by more than a factor; empty if they do not.

    Events at one time may have another order.  Directly after another event of a contact, the
    direction of its sliding may be round-off, which one of the motions then reverses.  A spring
    that starts at its free length, at rest, changes its phase within the first steps.
    """
    for first, second in ((one, other), (other, one)):
        left = list(second.events)
        for kind, part, t in first.events:
            near = [x for x in left if x[:2] == (kind, part) and abs(x[2] - t) <= factor * end]
            begins = kind == EventKind.REVERSAL.name and any(
                x[1] == part and 0.0 < t - x[2] <= factor * end for x in first.events
            )
            begins = begins or (kind == EventKind.ACTION.name and t <= START_SHARE * end)
            if not near and not begins:
                return f"{kind} of {part} at {t:.9g} s"
            if near:
                left.remove(near[0])
    return ""


def output_difference(
    nominal: Nominals, one: Motion, other: Motion, limit: float, names: Iterable[str] | None = None
) -> str:
    """Return an output that differs by more than a limit over its nominal; empty: none."""
    for k, (expected, found) in enumerate(zip(one.samples, other.samples, strict=False)):
        for name in nominal.keys() & expected.keys() if names is None else names:
            x, y = expected[name], found[name]
            if name.endswith("modal_restitution") and expected["mode.frequency"] == 0.0:
                continue  # A body that swings without a spring has no unique fundamental mode.
            if k in one.shared and not (name.startswith("energy") or name.endswith(MOTIONS)):
                continue
            if name.endswith(PEAKS):
                if name.endswith(PEAKS[0]) and abs(y - x) > PEAK_RTOL * abs(x) + 1e-3:
                    return f"{name} = {x:.9g}, {y:.9g} in sample {k}"
                continue
            if abs(y - x) > limit * scale_of(name, nominal[name], x):
                return f"{name} = {x:.9g}, {y:.9g} in sample {k}"
    return ""


def scale_of(name: str, nominal: float, x: float) -> float:
    """Return the size of an output x, of which a limit is a share.

    A share of the speed changes the velocity of a mode, a with the share p in the kinetic energy,
    by the same share of a/sqrt(p).  The modal restitution R changes by (1 + |R|)/sqrt(p) times it,
    and |R| <= 1/sqrt(p).
    """
    if name.endswith(COUNTED):
        return 0.0
    size = max(nominal, abs(x))
    return size * max(1.0, abs(x)) if name.endswith("modal_restitution") else size


def difference(nominal: Nominals, one: Motion, other: Motion, names: Iterable[str] | None = None,
               time_limit: float = TIME_MAX, limit: float = DEVIATION_MAX) -> str:  # fmt: skip
    """Return how two motions differ; empty if they do not."""
    if one.cause != other.cause:
        return f"{one.error or 'no error'} | {other.error or 'no error'}"
    return event_difference(one, other, factor=time_limit) or output_difference(
        nominal, one, other, limit, names
    )


def placeless(model: Mechanism) -> list[str]:
    """Return the names of outputs that do not depend on the place of a drawing."""
    names = [f"energy.{name}" for name in ("kinetic", "elastic", "dissipated", "work")]
    names += [f"{stop.name}.{name}" for stop in model.stops for name in COMPARED]
    names += [f"{spring.name}.force" for spring in model.springs]
    return names


def imbalance(model: Mechanism, motion: Motion, *, adrift: bool) -> str:
    """Return what the balances of energy and momentum lack; empty: nothing."""
    if len(motion.samples) < 2:
        return ""
    balances = [energy_balance(out) for out in motion.samples]
    size = max(
        max(abs(out[f"energy.{name}"]) for out in motion.samples)
        for name in ("kinetic", "work", "elastic")
    )
    if np.ptp(balances) > BALANCE_MAX * size + 1e-15:
        return f"energy changes by {np.ptp(balances):.3g} J of {size:.3g} J"
    if adrift:
        linear = np.array([p for p, _ in motion.momenta])
        angular = np.array([turn for _, turn in motion.momenta])
        mass = sum(float(body.mass) for body in model.bodies)
        fast = mass * math.sqrt(2.0 * motion.samples[0]["energy.kinetic"] / mass) + 1e-9
        if np.abs(linear - linear[0]).max() > BALANCE_MAX * fast:
            return f"momentum changes by {np.abs(linear - linear[0]).max():.3g} N s"
        if np.ptp(angular) > BALANCE_MAX * fast * 0.1:
            return f"angular momentum changes by {np.ptp(angular):.3g} N m s"
    return ""


def nudged(model: Mechanism, values: dict[str, float]) -> dict[str, float]:
    """Return values with a slightly changed position and velocity of the release."""
    held = {
        name: x * (1.0 + NUDGE_RTOL)
        for name, x in model.values().items()
        if name in ("release.displacement", "release.angle")
    }
    return {**values, **held, "release.velocity": values["release.velocity"] + NUDGE}


@dataclass
class Findings:
    """The results of draws: numbers by result, failures with their seeds, events by kind."""

    results: Counter = field(default_factory=Counter)
    events: Counter = field(default_factory=Counter)
    failures: list[str] = field(default_factory=list)

    def failed(self, seed: int, law: str, words: str) -> None:
        """Record a violation of a law."""
        self.results[f"failed: {law}"] += 1
        self.failures.append(f"seed {seed}: {law}: {words}")


def given(model: Mechanism, seed: int, *, adrift: bool) -> dict[str, float]:
    """Return inputs of a draw, and the velocity of its release."""
    found = {} if adrift else inputs(model, seed)
    return {**found, "release.velocity": float(model.release.velocity)}


def judge(seed: int, findings: Findings) -> None:
    """Draw a mechanism, and check the laws; refusals at the start are counted by their names."""
    for model in varied_attempts(seed):
        adrift = not any("ground" in name for name in joined(model))
        values = given(model, seed, adrift=adrift)
        expected = engine_motion(model, values)
        if expected.samples:
            break
        refused(seed, model, values, expected, findings)
    findings.events.update(kind for kind, *_ in expected.events)
    words = imbalance(model, expected, adrift=adrift)
    if words:  # The scales of the tolerance may be larger than the energy of a slow motion.
        exact = engine_motion(model, values, tolerance=EXACT)
        words = imbalance(model, exact, adrift=adrift)
    if words:
        findings.failed(seed, "balance", words)
        return
    result = compared(seed, model, values, expected)
    if result.startswith("failed"):
        findings.failed(seed, *result.split(": ", 2)[1:])
    elif result or not expected.error:
        findings.results[result or "agreed"] += 1
    else:
        findings.results[f"agreed: ended, {expected.cause}"] += 1


def compared(seed: int, model: Mechanism, values: dict[str, float], expected: Motion) -> str:
    """Compare a motion in the engine with that in the kernel, and this one with its symmetries.

    Return "failed", the law and the difference, another result, or nothing.
    """
    found = kernel_motion(model, values)
    found.shared = expected.shared
    described = variables(model, expected.samples[0])
    nominal = {v.name: v.nominal or 1.0 for v in described}
    curved = {f"{stop.name}.stiffness" for stop in model.stops if stop.exponent != 1.0}
    change, all_names = CHANGES[seed % len(CHANGES)], nominal.keys() & expected.samples[0].keys()
    pairs: tuple[tuple[str, Callable[[], Motion], Motion, Iterable[str]], ...] = (
        ("engines", lambda: found, expected, all_names),
        (change.__name__, lambda: kernel_motion(*change(model, values)), found, placeless(model)),
        ("scaled", lambda: scaled_motion(model, values, described, seed), found,
         all_names - curved),
    )  # fmt: skip
    for law, again, reference, names in pairs:
        motion = again()
        if words := difference(nominal, reference, motion, names):
            loose = law == "reordered" or slack(model, reference)
            if loose and starts_elsewhere(nominal, reference, motion, names):
                return "released in another shape"
            grown = any(
                difference(
                    nominal, usual, motion_of(model, nudged(model, values)), None, GROWN, GROWN
                )
                for usual, motion_of in ((found, kernel_motion), (expected, engine_motion))
            )
            return "chaotic" if grown else f"failed: {law}: {words}"
    return ""


def starts_elsewhere(nominal: Nominals, one: Motion, other: Motion, names: Iterable[str]) -> bool:
    """Return whether two motions have other starts.

    Of bodies that fly freely and that flexures or joints connect, the first one is as drawn.  A
    slack mechanism has many held shapes.
    """
    begins = (Motion(samples=motion.samples[:1]) for motion in (one, other))
    names = [*names, "mode.frequency"]
    return not other.samples or bool(output_difference(nominal, *begins, GROWN * 0.1, names))


def slack(model: Mechanism, motion: Motion) -> bool:
    """Return whether a spring that acts on one side is slack at the start of a motion."""
    start = motion.samples[0] if motion.samples else {}
    return any(spring.side and not start.get(f"{spring.name}.force") for spring in model.springs)


def joined(model: Mechanism) -> list[str]:
    """Return what joins parts: points of flexures, joints, springs and guides, and walls."""
    pairs = (*model.flexures, *model.joints, *model.springs, *model.guides)
    ends = [end for part in pairs for end in (part.start, part.end)]
    return [*ends, *(stop.on for stop in model.stops), *("ground" for _ in model.frictions)]


def refused(
    seed: int, model: Mechanism, values: dict[str, float], motion: Motion, findings: Findings
) -> None:
    """Count a refusal at the start; the kernel refuses, too, but checks in another order."""
    if motion.error not in (LOCKED, PRESSED):
        try:
            KernelSimulation(model, values, described=False)
            findings.failed(seed, "refusal", motion.error)
        except (KernelMistake, PrbmError):
            pass
    words = re.sub(r"\b[a-z]+\d|[a-z]+\.\w+", "...", motion.error)
    cause = Motion(error=words.partition(":")[0].partition(" at t")[0]).cause
    findings.results[f"refused at the start: {cause}"] += 1


def scaled_motion(
    model: Mechanism, values: dict[str, float], described: Sequence[Variable], seed: int
) -> Motion:
    """Return the motion of a mechanism in other units, in the present units."""
    dimension = ("length", "mass", "time")[seed // len(CHANGES) % 3]
    units = Units(**{dimension: 4.0 ** (-10, 5)[seed // 12 % 2]})
    of = {v.name: units.of(v.unit) for v in described}
    with unbounded(pytest.MonkeyPatch()):
        own = {name: x * of[name] for name, x in values.items()}
        later = units.factors["s"]
        found = kernel_motion(units.mechanism(model), own, END * later)
    found.events = [(kind, part, t / later) for kind, part, t in found.events]
    found.samples = [{name: out[name] / of[name] for name in of if name in out}
                     for out in found.samples]  # fmt: skip
    return found


def _abandon(*_) -> None:
    raise TimeoutError


def main(seeds: Iterable[int]) -> Findings:
    """Judge draws, and print what has been found."""
    findings, begun, done = Findings(), time.process_time(), 0
    signal.signal(signal.SIGVTALRM, _abandon)
    for done, seed in enumerate(seeds, 1):
        before = len(findings.failures)
        signal.setitimer(signal.ITIMER_VIRTUAL, SECONDS_MAX)
        try:
            judge(seed, findings)
        except TimeoutError:
            findings.results[f"abandoned after {SECONDS_MAX} s"] += 1
            print(f"seed {seed}: abandoned", flush=True)
        except Exception as error:  # Each draw is independent of the others.
            findings.failed(seed, "exception", f"{type(error).__name__}: {error}")
        for failure in findings.failures[before:]:
            print(failure, flush=True)
        if done % PROGRESS == 0:
            print(f"{done} draws, {time.process_time() - begun:.0f} s", flush=True)
    signal.setitimer(signal.ITIMER_VIRTUAL, 0)
    for result, count in findings.results.most_common():
        print(f"{count:6d}  {result}")
    print(f"{done:6d}  draws in {time.process_time() - begun:.0f} s; events:", end=" ")
    print(", ".join(f"{count} {kind}" for kind, count in findings.events.most_common()))
    return findings


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=2000, help="draws (default: 2000)")
    parser.add_argument("--first", type=int, default=0, help="first seed (default: 0)")
    options = parser.parse_args()
    kernel_simulation.FLAGS = tuple("-O2" if f == "-O0" else f for f in kernel_simulation.FLAGS)
    raise SystemExit(bool(main(range(options.first, options.first + options.count)).failures))
