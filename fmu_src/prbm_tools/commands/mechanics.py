"""``prbm list``, ``modes``, ``equilibrium``, ``simulate``: what a mechanism does."""

import argparse
import time
from collections.abc import Iterator, Sequence

import numpy as np

from prbm import Mechanism, assemble, equilibrium, modes
from prbm.assembly import Complex, Real, System
from prbm.mechanism import value
from prbm.statics import Equilibrium

from .. import holding, spectrum
from ..figures import response
from ..headline import told
from ..mechanism_file import find, load, shipped
from ..picture import MOST_MODES, picture
from ..settings import UserMistake, quantities, quantity, settings
from ..simulate import Result, communication_points, names, reporter, simulate
from .output import Output, aligned

IMPACT_HEAD = (
    "number", "stop", "time [s]", "approach speed [m/s]", "rebound speed [m/s]", "impulse [N.s]",
    "energy lost [J]", "modal restitution [-]",
)  # fmt: skip
HELD_HEAD = (
    "displacement [m]", "holding force [N]", "stiffness [N/m]", "across [m]", "angle [rad]",
    "fundamental frequency [Hz]",
)  # fmt: skip
HELD_WORDS = ("at, mm", "force, N", "stiffness, N/m", "across, um", "angle, mrad", "f, Hz")
PEAKS_TOLD = 6
MOST_POINTS = 100_000


def listed(options: argparse.Namespace) -> None:
    """Print the shipped mechanisms, a line each."""
    files = shipped()
    width = max(map(len, files))
    for name, path in files.items():
        print(f"{name:{width}}  {load(path).title}")


def _system(options: argparse.Namespace) -> tuple[Mechanism, dict[str, float], System]:
    mechanism = find(options.mechanism)
    values = settings(mechanism, options.set)
    own = {p.name for p in mechanism.parameters}
    for name in values:
        if name not in own:
            raise UserMistake(
                f"--set {name}: it is an input, which acts while the mechanism moves: "
                "prbm simulate takes it"
            )
    return mechanism, values, assemble(mechanism, mechanism.values(values))


# --- modes ------------------------------------------------------------------------------------


def frequencies(options: argparse.Namespace) -> None:
    """Print frequencies and what moves in each mode."""
    mechanism, values, system = _system(options)
    output = Output(options.out)
    if options.count < 1:
        raise UserMistake(f"--count {options.count}: ask for one mode or more")
    at = None if options.held is None else quantity(options.held, "m", "--held")
    shape = equilibrium(system, at)
    found = modes(system, shape)
    count = min(options.count, len(found.frequency))
    parts = [(body.name, what) for body in mechanism.bodies for what in ("x", "y", "turning")]
    e = system.directions(shape.q)
    shares = np.array([_shares(system, e, found.shape[:, k]) for k in range(count)])
    print(_where(system, shape, at))
    head = ["mode", "frequency", *(f"{body} {what}" for body, what in parts), "flexures"]
    rows = [
        [str(k + 1), _hertz(float(found.frequency[k])), *(f"{100 * x:.1f} %" for x in shares[k])]
        for k in range(count)
    ]
    print(aligned(head, rows))
    print("percentages: where the kinetic energy of the mode is")
    if count < len(found.frequency):
        print(f"{len(found.frequency) - count} higher modes are not shown; --count N shows more")
    output.table(
        f"{mechanism.name}-modes.csv",
        ["mode", "frequency [Hz]",
         *(f"share of {body} {what} [-]" for body, what in parts), "share of flexures [-]"],
        [[k + 1, float(found.frequency[k]), *map(float, shares[k])] for k in range(count)],
    )  # fmt: skip
    output.figure(
        f"{mechanism.name}-modes.png",
        lambda: picture(mechanism, values, min(count, MOST_MODES), at),
    )
    output.write()


def _shares(system: System, e: Complex, phi: Real) -> list[float]:
    """Return the shares of the kinetic energy of a mode: x, y, turning of each body; the rest."""
    shares = []
    for body in system.mechanism.bodies:
        frame = system.bodies[body.name]
        _, velocity = system.motion(frame, e, phi)
        m, J = (value(body, name, system.values) for name in ("mass", "inertia"))
        shares += [m * velocity.real**2, m * velocity.imag**2, J * float(phi[frame.j]) ** 2]
    return [*shares, max(0.0, 1.0 - sum(shares))]  # modes have the mass 1


def _hertz(frequency: float) -> str:
    return f"{frequency:#.5g} Hz" if frequency > 0.0 else "unstable"


def _where(system: System, shape: Equilibrium, at: float | None) -> str:
    """Tell about which shape it is."""
    name, release = system.mechanism.name, system.mechanism.release
    along = "" if release.direction == 0.0 else f" along {release.direction:g} degrees"
    if at is not None:
        return (
            f"{name}, {release.body} held at {1e3 * at:.6g} mm from straight{along} by "
            f"{shape.force:.5g} N"
        )
    e = system.directions(shape.q)
    rest = float((system.release @ e).real) + system.release_c
    return f"{name} at rest under gravity, {release.body} {1e3 * rest:.6g} mm from straight{along}"


# --- equilibrium ------------------------------------------------------------------------------


def equilibria(options: argparse.Namespace) -> None:
    """Print where the mechanism rests, what holds it elsewhere, where it snaps."""
    mechanism, _, system = _system(options)
    output = Output(options.out)
    ranged = (options.start, options.end)
    if None in ranged and ranged != (None, None):
        raise UserMistake("--from and --to go together: give both ends of the range")
    if ranged != (None, None) and options.held:
        raise UserMistake("--held and --from, --to are two ways to say where: take one of them")
    body, direction = mechanism.release.body, mechanism.release.direction
    way = "x" if direction == 0.0 else f"{direction:g} degrees"
    print(f"{mechanism.name}: displacement of {body} along {way}, from straight; gravity acts")
    if ranged != (None, None):
        _range(options, mechanism, system, output)
    elif options.held:
        points = [holding.held(system, x) for x in quantities(options.held, "m", "--held")]
        print(_table(points))
        output.table(f"{mechanism.name}-equilibrium.csv", HELD_HEAD, _rows(points))
    else:
        rest = holding.free(system)
        print(_table([rest]))
        stable = rest.frequency > 0.0
        at = _tiny(1e3 * rest.displacement, 1e3 * system.length)
        print(f"rests at {at} mm: {'stable' if stable else 'unstable'}")
        output.table(f"{mechanism.name}-equilibrium.csv", HELD_HEAD, _rows([rest]))
    output.write()


def _range(
    options: argparse.Namespace, mechanism: Mechanism, system: System, output: Output
) -> None:
    low, high = (
        quantity(text, "m", option)
        for text, option in ((options.start, "--from"), (options.end, "--to"))
    )
    if not low < high:
        raise UserMistake(f"--from {low:g} m is not below --to {high:g} m")
    if not 3 <= options.points <= MOST_POINTS:
        raise UserMistake(f"--points {options.points}: choose a number from 3 to {MOST_POINTS}")
    curve = holding.curve(system, np.linspace(low, high, options.points), reporter())
    every = -(-options.points // 11)
    print(_table(curve.points[::every]))
    if every > 1:
        print(f"every {every}th of {options.points} points; --out DIR writes all")
    for rest in curve.rests:
        at = _tiny(1e3 * rest.displacement, 1e3 * system.length)
        print(f"rests at {at} mm: {'stable' if rest.stable else 'unstable'}")
    if not curve.rests:
        print("no place of rest in this range")
    for place, force in curve.snaps:
        print(f"snaps through under {force:.5g} N, at {1e3 * place:.6g} mm")
    output.table(f"{mechanism.name}-equilibrium.csv", HELD_HEAD, _rows(curve.points))
    output.table(
        f"{mechanism.name}-rests.csv",
        ["kind", "displacement [m]", "force [N]"],
        [
            *(["stable rest" if x.stable else "unstable rest", x.displacement, 0.0]
              for x in curve.rests),
            *(["snap", place, force] for place, force in curve.snaps),
        ],
    )  # fmt: skip
    output.figure(
        f"{mechanism.name}-equilibrium.png", lambda: holding.figure(curve, mechanism.title)
    )


def _rows(points: Sequence[holding.Held]) -> list[list[float]]:
    return [[p.displacement, p.force, p.stiffness, p.across, p.angle, p.frequency] for p in points]


def _table(points: Sequence[holding.Held]) -> str:
    most = max(abs(p.force) for p in points)
    rows = [
        [
            f"{1e3 * p.displacement:.5g}", _tiny(p.force, most), f"{p.stiffness:.5g}",
            _tiny(1e6 * p.across, 1e3), _tiny(1e3 * p.angle, 1e3),
            f"{p.frequency:.5g}" if p.frequency > 0.0 else "unstable",
        ]
        for p in points
    ]  # fmt: skip
    return aligned(HELD_WORDS, rows)


def _tiny(x: float, scale: float) -> str:
    """Return a number, what rounding leaves of zero as zero."""
    return f"{x:.6g}" if abs(x) > holding.ROUNDING * scale else "0"


# --- simulate ---------------------------------------------------------------------------------


def simulated(options: argparse.Namespace) -> None:
    """Print what happens after the release."""
    mechanism = find(options.mechanism)
    values = settings(mechanism, options.set)
    output = Output(options.out)
    stop_time, step = (
        quantity(text, "s", option)
        for text, option in ((options.stop_time, "--stop-time"), (options.step, "--step"))
    )
    communication_points(stop_time, step)
    begin = time.perf_counter()
    result = simulate(
        mechanism, values, stop_time, step, _tolerance(options.tolerance), progress=reporter()
    )
    print(f"simulated            {stop_time:g} s in {time.perf_counter() - begin:.2f} s")
    for line in told(result.columns, mechanism, result.values):
        print(line)
    columns = names(result.columns)
    output.table(f"{mechanism.name}.csv", columns, (list(row) for row in result.columns.tolist()))
    output.table(f"{mechanism.name}-impacts.csv", IMPACT_HEAD, _impacts(result))
    output.figure(f"{mechanism.name}.png", lambda: response(result))
    output.write()
    if options.spectrum is not None:
        _spectrum(options, result, values)


def _tolerance(text: str | None) -> float | None:
    if text is None:
        return None
    tolerance = quantity(text, "", "--tolerance")
    if not 0.0 < tolerance < 1.0:
        raise UserMistake(f"--tolerance {text}: choose a number between 0 and 1, as 1e-8")
    return tolerance


def _impacts(result: Result) -> Iterator[list[object]]:
    for number, impact in enumerate(result.impacts, start=1):
        last = impact.latched
        yield [
            number, impact.stop, impact.time, last.approach_speed, last.rebound_speed,
            last.impulse, last.energy_lost, last.modal_restitution,
        ]  # fmt: skip


def _spectrum(options: argparse.Namespace, result: Result, values: dict[str, float]) -> None:
    """Tell which frequencies are heard after an impact."""
    mechanism, output = result.mechanism, Output(options.out)
    if not result.impacts:
        raise UserMistake(
            f"--spectrum: there is no impact in {result.columns['time'][-1]:g} s; simulate longer "
            "(--stop-time), or move the stop (--set)"
        )
    if options.spectrum == "first":
        stop = next(i for i, s in enumerate(mechanism.stops) if s.name == result.impacts[0].stop)
        heard = spectrum.after_impact(
            mechanism, values,
            quantity(options.spectrum_time, "s", "--spectrum-time"), stop=stop,
        )  # fmt: skip
    else:
        heard = spectrum.after_last_impact(result)
    print(
        f"after the {options.spectrum} impact, at t = {heard.impact.time:.5f} s, "
        f"{1e3 * (heard.time[-1] - heard.time[0]):.4g} ms"
        + (" without the wall" if options.spectrum == "first" else "")
    )
    shown = ", ".join(f"{i}: {f:.4g} Hz" for i, f in spectrum.numbered(heard.modes))
    print(f"modes at its shape   {shown}")
    lines = {name: spectrum.spectrum(heard.time, getattr(heard, name)) for name in spectrum.SIGNALS}
    size = assemble(mechanism, mechanism.values()).length
    loudest = float(lines["along"][1].max())
    for name, (frequency, amplitude) in lines.items():
        speed = float(amplitude.max()) * (size if name == "turning" else 1.0)
        loud = speed > holding.ROUNDING * loudest
        found = spectrum.peaks(frequency, amplitude)[:PEAKS_TOLD].tolist() if loud else []
        print(f"peaks {name:14} {', '.join(f'{f:.4g} Hz' for f in found) or 'none'}")
    frequency = next(iter(lines.values()))[0]
    output.table(
        f"{mechanism.name}-spectrum.csv",
        ["frequency [Hz]", "along [m/s]", "across [m/s]", "turning [rad/s]"],
        np.column_stack([frequency, *(amplitude for _, amplitude in lines.values())]).tolist(),
    )
    output.figure(f"{mechanism.name}-spectrum.png", lambda: spectrum.figure(heard))
    output.write()
