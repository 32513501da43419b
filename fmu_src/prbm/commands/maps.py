"""``prbm impact-map``: modal restitution over positions of the wall and offsets of the hit."""

import argparse
import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial

from ..analysis import adequacy, impact_map
from ..analysis.held import check_length
from ..analysis.impact_map import ImpactMap
from ..analysis.touching import lever, stop_index
from ..base.progress import Progress, reporter
from ..base.unit_text import stiffness_unit
from ..files.mechanism_file import load
from ..files.settings import (
    UserMistake,
    quantities,
    quantity,
    settings,
    stiffness,
    with_shared_unit,
)
from ..mechanics.assembly import assemble
from ..mechanism.description import Mechanism
from ..mechanism.parts import value
from ..plots import impact_map as figures
from .output import Output

# The default grid has about the proportions of the grid in the thesis, in round numbers.
WALL_SHARE = 5 / 9  # Largest default wall position over the displacement at release.
OFFSET_SHARE = 1 / 20  # Largest default offset over the size of the mechanism.
ROUND_RTOL = 1e-9  # A round number may exceed its limit by this share: round-off.
GRID = (-1.0, -0.5, 0.0, 0.5, 1.0)  # Default positions and offsets, relative to the largest.
POINTS_MAX = 400  # Points of a map.
FLEXURE_METHODS = {"algebraic", "simulated", "fitted"}  # Methods with notes on flexure models.
SIMULATED_METHODS = {"simulated", "fitted"}  # Methods that simulate.

Method = Callable[..., ImpactMap]
Job = Callable[[Progress], ImpactMap]
METHODS: Mapping[str, Method] = {
    "algebraic": impact_map.algebraic,
    "simulated": impact_map.simulated,
    "fitted": impact_map.fitted,
    "compliant": impact_map.compliant,
    "closed-form": impact_map.closed_form,
    "elements": impact_map.by_elements,
}


def print_maps(options: argparse.Namespace) -> None:
    """Print the impact maps of all selected methods and flexure models."""
    options.method = options.method or ["algebraic"]
    mechanism = load(options.mechanism)
    values = settings(mechanism, options.set)
    output = Output(options.out)
    positions, offsets = _points(options, mechanism, values)
    jobs = list(_jobs(options, mechanism, values, positions, offsets))
    report = reporter()
    maps = [job(_part(report, k, len(jobs))) for k, job in enumerate(jobs)]
    name = mechanism.name
    print(f"{name}: modal restitution over wall positions h and offsets d of the hit point")
    for one in maps:
        print(one)
    for sentence in _notes(options, mechanism, values, positions, offsets):
        print(sentence)
    _add_files(maps, output, name, mechanism.title)
    output.write()


def _part(report: Progress, k: int, count: int) -> Progress:
    """Return the progress callback of the k-th of several jobs of similar duration."""
    return lambda fraction: report((k + fraction) / count)


def _points(
    options: argparse.Namespace, mechanism: Mechanism, values: Mapping[str, float]
) -> tuple[list[float], list[float]]:
    """Return wall positions and offsets in increasing order [m], from options or by default."""
    system = assemble(mechanism, _of(mechanism, values))
    release = mechanism.release
    amount = abs(value(release, release.start, system.values))
    scales = {
        "wall-positions": WALL_SHARE * amount * (system.length if release.turns else 1.0),
        "offsets": OFFSET_SHARE * system.length,
    }
    result = []
    for name, scale in scales.items():
        texts = getattr(options, name.replace("-", "_"))
        chosen = (
            quantities(texts, "m", f"--{name}") if texts
            else [rounded_down(scale) * share for share in GRID]
        )  # fmt: skip
        if scale == 0.0 and not texts:
            raise UserMistake(
                f"release.{release.start} = 0: no default wall positions; give --wall-positions"
            )
        if len(set(chosen)) < len(chosen):
            raise UserMistake(f"--{name} {' '.join(texts or [])}: a value is given twice")
        result.append(sorted(check_length(x, system.length, f"--{name}") for x in chosen))
    positions, offsets = result
    if len(positions) * len(offsets) > POINTS_MAX:
        raise UserMistake(
            f"{len(positions)} wall positions and {len(offsets)} offsets make "
            f"{len(positions) * len(offsets)} points; choose at most {POINTS_MAX}"
        )
    return positions, offsets


def rounded_down(x: float) -> float:
    """Return the largest round number that is not above x: 1, 2, 4, 6 or 8 times a power of ten.

    The result for 0 is 0.

    Examples
    --------
    >>> [rounded_down(x) for x in (0.01, 0.004, 5.56e-7, 0.0)]
    [0.01, 0.004, 4e-07, 0.0]
    """
    if x == 0.0:
        return 0.0
    power = math.floor(math.log10(x * (1.0 + ROUND_RTOL)))
    limit = x * (1.0 + ROUND_RTOL)
    return max(y for digit in (1, 2, 4, 6, 8) if (y := float(f"{digit}e{power}")) <= limit)


def _jobs(
    options: argparse.Namespace,
    mechanism: Mechanism,
    values: Mapping[str, float],
    positions: Sequence[float],
    offsets: Sequence[float],
) -> Iterator[Job]:
    """Yield a function for each map, which computes it."""
    if "compliant" not in options.method and (options.stiffness or options.speed):
        raise UserMistake("--stiffness and --speed need --method compliant")
    models = dict(_models(options, mechanism))
    for name in dict.fromkeys(options.method):
        for label, model in models.items():
            method = partial(METHODS[name], model, positions, offsets, values, stop=options.stop)
            if name == "compliant":
                yield from _compliant(options, mechanism, values, method, label)
                continue
            if name == "elements":
                yield partial(_compute, method, "finite elements", elements=options.elements)
                break  # Finite elements do not depend on the flexure model.
            if name in SIMULATED_METHODS:
                method = partial(method, engine=options.engine)
            yield partial(_compute, method, f"{label}, {name}")


def _compliant(
    options: argparse.Namespace,
    mechanism: Mechanism,
    values: Mapping[str, float],
    method: Method,
    label: str,
) -> Iterator[Job]:
    """Yield a function for the map of each contact stiffness."""
    stop = mechanism.stops[stop_index(mechanism, options.stop)]
    speed = quantity(options.speed, "m/s", "--speed") if options.speed else None
    if not options.stiffness:
        yield partial(_compute, method, f"{label}, compliant", speed=speed)
        return
    exponent = value(stop, "exponent", _of(mechanism, values)) if stop.compliant else 1.0
    for text in with_shared_unit(options.stiffness, "--stiffness"):
        k = stiffness(text, exponent, "--stiffness")
        name = f"{label}, {k:.4g} {stiffness_unit(exponent)}"
        yield partial(_compute, method, name, stiffness=k, speed=speed)


def _of(mechanism: Mechanism, values: Mapping[str, float]) -> dict[str, float]:
    """Return the values of all parameters of a mechanism, from those of parameters and inputs."""
    known = {name for name in values if name in mechanism.values()}
    return mechanism.values({name: values[name] for name in known})


def _compute(method: Method, label: str, progress: Progress, **more: object) -> ImpactMap:
    return method(label=label, progress=progress, **more)


def _notes(
    options: argparse.Namespace,
    mechanism: Mechanism,
    values: Mapping[str, float],
    positions: Sequence[float],
    offsets: Sequence[float],
) -> Iterator[str]:
    """Yield notes on the accuracy of flexure models.

    They are for the offset that is farthest from the centre of mass, at three positions of the
    wall: both ends of the map, and the position nearest to the straight shape.
    """
    if not FLEXURE_METHODS.intersection(options.method):
        return
    stop = stop_index(mechanism, options.stop)
    name = mechanism.stops[stop].name
    walls = sorted({min(positions, key=abs), positions[0], positions[-1]}, key=abs)
    for label, model in _models(options, mechanism):
        known = {**values, f"{name}.offset": 0.0}
        lever_arm = lever(assemble(model, model.values(known)), stop)
        farthest = max(offsets, key=partial(_distance, lever_arm))
        shapes = [adequacy.Impact(stop, wall, farthest) for wall in walls]
        for finding in adequacy.worst(adequacy.check(model, values, shapes)):
            yield f"note, {label}: {finding}"


def _distance(lever_arm: float, offset: float) -> float:
    return abs(lever_arm + offset)


def _models(options: argparse.Namespace, mechanism: Mechanism) -> Iterator[tuple[str, Mechanism]]:
    """Yield the label and the mechanism for each model of its flexures."""
    if options.links < 1:
        raise UserMistake(f"--links {options.links}: must be at least 1")
    if not options.model:
        kinds = mechanism.flexure_types
        if options.axial:
            raise UserMistake("--axial needs --model, for instance --model 2R --axial")
        label = " ".join(dict.fromkeys(_label(k.model, k.n, k.axial) for k in kinds))
        yield label or mechanism.name, mechanism
    for model in options.model:
        n = options.links if model == "nR" else 0
        changed = impact_map.with_flexures(mechanism, model, axial=options.axial, n=n)
        yield _label(model, n, options.axial), changed


def _label(model: str, n: int, axial: bool) -> str:
    return (f"{n}R" if n else model) + (" axial" if axial else "")


def _add_files(maps: Sequence[ImpactMap], output: Output, name: str, title: str) -> None:
    """Add tables and figures of maps to the output."""
    head, rows = maps[0].csv().split("\n", 1)
    rest = [one.csv().split("\n", 1)[1] for one in maps[1:]]
    output.text(f"{name}-impact-map.csv", head + "\n" + rows + "".join(rest))
    output.figure(f"{name}-impact-map.png", lambda: figures.heat_map(maps, title=title))
    for one in maps:
        if one.hits:
            slug = re.sub(r"[^\w.]+", "-", one.label)
            output.figure(f"{name}-energies-{slug}.png", partial(figures.energies, one, title))
