"""``prbm shock``: the effect of a shock of the base, and the level at which a flexure yields."""

import argparse
import math

from ..analysis.shock import Pulse, Shock, displacement_unit, fragility, shock
from ..analysis.strength import counts_cycles
from ..base.progress import reporter
from ..base.unit_text import GRAVITY
from ..files.mechanism_file import load
from ..files.settings import UserMistake, quantities, quantity, settings
from ..mechanics.assembly import assemble
from ..mechanism.description import Mechanism
from ..runs.headline import contact_line, instant, length
from ..runs.released import released_label
from ..runs.struck import UNRELIABLE, first_rigid_impact
from .output import Output, aligned
from .stress import no_damage, struck

FIRST_PEAK = 100 * GRAVITY  # First peak of a search for the level of failure [m/s^2].


def run_shock(options: argparse.Namespace) -> None:
    """Simulate a shock and print its effect."""
    mechanism, output = load(options.mechanism), Output(options.out)
    values = settings(mechanism, options.set)
    if given := next((name for name in values if name.startswith("release.")), None):
        raise UserMistake(f"--set {given}: a shock acts on the mechanism at rest")
    stop_time = quantity(options.stop_time, "s", "--stop-time") if options.stop_time else None
    if options.record:
        _check_record(options)
        name = f"base.acceleration.{options.axis}"
        found = shock(
            mechanism, {name: f"csv({options.record})"}, values, stop_time=stop_time,
            fatigue=counts_cycles(), progress=reporter(), engine=options.engine,
        )  # fmt: skip
        _print(found, mechanism, f"record {options.record}")
    elif options.peaks or options.sweep:
        _sweep(options, mechanism, values, stop_time, output)
        return
    else:
        pulse = _pulse(options)
        found = shock(
            mechanism, {pulse.input: pulse.signal}, values, duration=pulse.duration,
            stop_time=stop_time, fatigue=counts_cycles(), progress=reporter(),
            engine=options.engine,
        )  # fmt: skip
        _print(found, mechanism, _text(pulse))
    columns = found.result.columns
    output.table(
        f"{mechanism.name}-shock.csv", columns.dtype.names or (),
        (list(row) for row in columns.tolist()),
    )  # fmt: skip
    if options.out is not None:
        from ..plots.shock import shock_figure  # imported here: it takes a second

        output.figure(f"{mechanism.name}-shock.png", lambda: shock_figure(found, options.axis))
    output.write()


def _check_record(options: argparse.Namespace) -> None:
    """Reject options of a pulse beside a record."""
    for name in ("peak", "height", "duration", "peaks", "sweep"):
        if getattr(options, name):
            raise UserMistake(f"--record excludes --{name}: the record has the acceleration")


def _pulse(options: argparse.Namespace, peak: float | None = None) -> Pulse:
    """Return the pulse of the options."""
    if options.duration is None:
        raise UserMistake('--duration is missing: give that of the pulse, for instance "0.5 ms"')
    duration = quantity(options.duration, "s", "--duration")
    if peak is not None:
        return Pulse(options.pulse, peak, duration, options.axis)
    if (options.peak is None) == (options.height is None):
        raise UserMistake('give --peak "500 g" or --height "1 m", the drop height')
    if options.peak is not None:
        given = quantity(options.peak, "m/s2", "--peak")
        return Pulse(options.pulse, given, duration, options.axis)
    height = quantity(options.height, "m", "--height")
    return Pulse.drop(options.pulse, height, duration, options.axis)


def _text(pulse: Pulse) -> str:
    return (
        f"{pulse.kind} of {pulse.peak / GRAVITY:.4g} g and {1e3 * pulse.duration:.4g} ms along "
        f"{pulse.axis}, {pulse.velocity:.4g} m/s"
    )


def _print(found: Shock, mechanism: Mechanism, about: str) -> None:
    """Print the effect of a shock."""
    size = assemble(mechanism, mechanism.values()).length
    end = float(found.result.columns["time"][-1])
    release = mechanism.release
    print(f"{mechanism.name}: {about}")
    largest = (
        f"{math.degrees(found.displacement):.3g} deg"
        if release.turns
        else length(found.displacement, size)
    )
    print(f"largest displacement {released_label(release)} {largest} from its equilibrium")
    for hits in found.hits:
        how = f", at most {hits.speed:.4g} m/s and {hits.impulse:.4g} N s" if hits.count else ""
        print(f"impacts at {hits.stop:9} {hits.count}{how}")
        if hits.force and hits.indentation is not None and hits.duration is not None:
            print(contact_line(hits.stop, hits.force, hits.indentation, hits.duration))
    hit = first_rigid_impact(found.result.columns, mechanism)
    for line in struck(found.result, found.loadings, hit):
        print(line)
    for one in found.loadings:
        safety = "" if one.safety is None else f", safety factor {one.safety:.3g} (yield)"
        damage = "" if one.damage is None else f", damage {one.damage:.3g}"
        doubtful = ", not reliable" if one.time > hit else ""
        print(
            f"stress in {one.flexure:10} {1e-6 * one.peak:.4g} MPa at t = "
            f"{instant(one.time, end, 5)}{doubtful}{safety}{damage}"
        )
    for line in no_damage(mechanism):
        print(line)
    rest = "not yet" if math.isnan(found.rest) else f"at t = {instant(found.rest, end, 4)}"
    print(f"settled              {rest}")


def _sweep(
    options: argparse.Namespace,
    mechanism: Mechanism,
    values: dict[str, float],
    stop_time: float | None,
    output: Output,
) -> None:
    """Print the effect over the peak, and the level at which a flexure yields."""
    if options.peaks and (options.peak or options.height):
        raise UserMistake("--peaks excludes --peak and --height")
    peaks = sorted(quantities(options.peaks, "m/s2", "--peaks")) if options.peaks else None
    first = peaks[0] if peaks else None if options.peak or options.height else FIRST_PEAK
    pulse = _pulse(options, first)
    found = fragility(
        mechanism, pulse, peaks, values, stop_time=stop_time, progress=reporter(),
        engine=options.engine,
    )  # fmt: skip
    level = found.level
    factor, unit = displacement_unit(mechanism)
    rows = [
        [
            f"{peak / GRAVITY:.6g}", f"{factor * one.displacement:.4g}",
            str(sum(hits.count for hits in one.hits)),
            *([] if one.force is None else [f"{one.force:.4g}"]),
            f"{1e-6 * one.peak_stress:.4g}",
            "-" if math.isinf(one.safety) else f"{one.safety:.3g}",
        ]
        for peak, one in zip(found.peaks, found.shocks, strict=True)
    ]  # fmt: skip
    print(f"{mechanism.name}: {pulse.kind} of {1e3 * pulse.duration:.4g} ms along {pulse.axis}")
    force = [] if found.shocks[0].force is None else ["force [N]"]
    heads = ["peak [g]", f"displacement [{unit}]", "hits", *force, "stress [MPa]", "safety"]
    print(aligned(heads, rows))
    if all(math.isinf(one.safety) for one in found.shocks):
        print("no safety factor without yield_strength: add it to the material")
    elif math.isnan(level):
        print("yield                at none of these peaks, or below the first")
    else:
        print(f"yield                from a peak of {level / GRAVITY:.4g} g on")
    if any(first_rigid_impact(x.result.columns, mechanism) < math.inf for x in found.shocks):
        print(UNRELIABLE)
    output.table(
        f"{mechanism.name}-fragility.csv",
        ["peak [m/s2]", "displacement", "hits", *force, "stress [Pa]", "safety factor [-]"],
        [
            [
                p,
                x.displacement,
                sum(h.count for h in x.hits),
                *([] if x.force is None else [x.force]),
                x.peak_stress,
                x.safety,
            ]
            for p, x in zip(found.peaks, found.shocks, strict=True)
        ],
    )
    if options.out is not None:
        from ..plots.shock import fragility_figure  # imported here: it takes a second

        output.figure(f"{mechanism.name}-fragility.png", lambda: fragility_figure(*found))
    output.write()
