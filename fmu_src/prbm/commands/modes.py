"""``prbm modes``: frequencies, and the distribution of the kinetic energy in each mode."""

import argparse
import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from ..analysis.adequacy import Impact, Shape, Vibration, notes
from ..analysis.held import check_held, held_scale, held_unit
from ..base.unit_text import mode_text, prefixed_unit
from ..files.settings import UserMistake, quantity
from ..mechanics.arrays import Complex, Real
from ..mechanics.modal import damping, modes
from ..mechanics.statics import Equilibrium, equilibrium
from ..mechanics.system import System
from ..mechanism.description import Mechanism
from ..mechanism.parts import value
from ..runs.released import released_label
from .load_paths import given_loads, load_text
from .output import Output, aligned
from .systems import assembled, rounded

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def frequencies(options: argparse.Namespace) -> None:
    """Print frequencies and the share of each motion in the kinetic energy of a mode."""
    mechanism, values, system = assembled(options)
    output = Output(options.out)
    at = _checked(options, system)
    loads = given_loads(mechanism, options.load)
    shape = equilibrium(system, at, loads)
    found = modes(system, shape)
    if not len(found.frequency):
        raise UserMistake(
            f"{mechanism.name} has no modes: all bodies fly freely; connect them to the ground by "
            "flexures, joints, springs or guides, or simulate the motion"
        )
    count = min(options.count, len(found.frequency))
    motions = [(body.name, m) for body in mechanism.bodies for m in ("x", "y", "turning")]
    e = system.directions(shape.q)
    shares = np.array([_shares(system, e, found.shape[:, k]) for k in range(count)])
    print(_where(system, shape, at, loads))
    ratios, times = damping(system, found, shape.q)
    head = [
        "mode",
        "frequency",
        "damping ratio",
        "decay time",
        *(f"{body} {m}" for body, m in motions),
        "flexures",
    ]
    rows = [
        [
            str(k + 1),
            mode_text(float(found.frequency[k]), found.rounding, 5),
            _ratio(ratios[k]),
            _seconds(times[k]),
            *(f"{100 * x:.1f} %" for x in shares[k]),
        ]
        for k in range(count)
    ]
    print(aligned(head, rows))
    print(
        "percentages: shares of the kinetic energy of the mode; decay time: the amplitude falls to "
        "37 %"
    )
    _print_omitted(mechanism, len(found.frequency) - count)
    _print_notes(mechanism, values, at, loads)
    output.table(
        f"{mechanism.name}-modes.csv",
        ["mode", "frequency [Hz]", "damping ratio [-]", "decay time [s]",
         *(f"share of {body} {m} [-]" for body, m in motions), "share of flexures [-]"],
        [
            [
                k + 1,
                *(float(x[k]) for x in (found.frequency, ratios, times)),
                *map(float, shares[k]),
            ]
            for k in range(count)
        ],
    )  # fmt: skip
    output.figure(
        f"{mechanism.name}-modes.png", lambda: _figure(mechanism, values, count, at, loads)
    )
    output.write()


def _print_omitted(mechanism: Mechanism, higher: int) -> None:
    """Print how many higher modes are not shown, and which bodies take no part in modes."""
    if higher:
        print(f"{higher} higher modes are not shown; show more with --count N")
    if mechanism.free_bodies:
        names = ", ".join(mechanism.free_bodies)
        print(f"bodies that fly freely are fixed in these modes: {names}")


def _checked(options: argparse.Namespace, system: System) -> float | None:
    """Return the amount of --held [m], [rad]; reject a count without modes."""
    if options.count < 1:
        raise UserMistake(f"--count {options.count}: must be at least 1")
    if options.held is None:
        return None
    held = held_unit(system.mechanism)
    return check_held(quantity(options.held, held.si, "--held"), system, "--held")


def _print_notes(
    mechanism: Mechanism, values: Mapping[str, float], at: float | None, loads: Mapping[str, float]
) -> None:
    """Print what a better model changes about the shape and, without loads, about impacts."""
    shapes: list[Shape] = [Vibration(at, tuple(loads.items()))]
    if not loads:
        shapes += map(Impact, range(len(mechanism.stops)))
    for sentence in notes(mechanism, values, shapes):
        print(sentence)


def _figure(
    mechanism: Mechanism, values: Mapping[str, float], count: int, at: float | None,
    loads: Mapping[str, float],
) -> "Figure":  # fmt: skip
    from ..plots.picture import MODES_MAX, picture  # imported here: it takes a second

    return picture(mechanism, values, min(count, MODES_MAX), at, loads)


def _shares(system: System, e: Complex, phi: Real) -> list[float]:
    """Return shares of the kinetic energy of a mode: x, y, turning of each body; flexures."""
    shares = []
    for body in system.mechanism.bodies:
        frame = system.bodies[body.name]
        _, velocity = system.motion(frame, e, phi)
        m, J = (value(body, name, system.values) for name in ("mass", "inertia"))
        shares += [m * velocity.real**2, m * velocity.imag**2, J * float(phi[frame.j]) ** 2]
    return [*shares, max(0.0, 1.0 - sum(shares))]  # The modal masses are 1.


def _ratio(ratio: float) -> str:
    return "-" if math.isnan(ratio) else f"{ratio:.3g}"


def _seconds(time: float) -> str:
    """Return a decay time [s] as text; a dash if the amplitude does not fall."""
    if not math.isfinite(time):
        return "-"
    factor, unit = prefixed_unit(time, "s")
    return f"{factor * time:.3g} {unit}"


def _where(system: System, shape: Equilibrium, at: float | None, loads: Mapping[str, float]) -> str:
    """Return a description of the shape about which the mechanism vibrates."""
    name, release = system.mechanism.name, system.mechanism.release
    held, moved = held_unit(system.mechanism), released_label(release)
    straight = release.direction == 0.0 or release.turns
    along = "" if straight else f" along {release.direction:g} degrees"
    if at is not None:
        effort = held.si_effort.replace(".", " ")
        return (
            f"{name}, {moved} held at {held.factor * at:.6g} {held.shown} from straight"
            f"{along} by {shape.force:.5g} {effort}{load_text(loads)}"
        )
    at_rest = "at rest under gravity" if system.gravity else "at rest without gravity"
    place = rounded(held.factor * system.amount(shape.q), held.factor * held_scale(system))
    return f"{name} {at_rest}, {moved} {place} {held.shown} from straight{along}{load_text(loads)}"
