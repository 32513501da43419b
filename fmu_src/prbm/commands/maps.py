"""``prbm impact-map``: modal restitution over walls and offsets."""

import argparse
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial

import numpy as np

from ..analysis import impact_map
from ..analysis.impact_map import ImpactMap
from ..analysis.stretching import note
from ..analysis.touching import lever, stop_index
from ..base.progress import Progress, reporter
from ..files.mechanism_file import load
from ..files.settings import UserMistake, quantities, settings
from ..mechanics.assembly import assemble
from ..mechanism.description import Mechanism
from ..plots import impact_map as figures
from .output import Output
from .systems import check_length

WALLS, OFFSETS = 5 / 9, 1 / 20  # of the release, of the size: the source's, whatever the size
STEPS = (-1.0, -0.5, 0.0, 0.5, 1.0)
MOST_POINTS = 400  # points of a map; more are a mistake
OF_MODELS = {"algebraic", "simulated", "fitted"}  # ways whose maps are of models of flexures

Way = Callable[..., ImpactMap]
Job = Callable[[Progress], ImpactMap]
WAYS: Mapping[str, Way] = {
    "algebraic": impact_map.algebraic,
    "simulated": impact_map.simulated,
    "fitted": impact_map.fitted,
    "closed-form": impact_map.closed_form,
    "elements": impact_map.by_elements,
}


def mapped(options: argparse.Namespace) -> None:
    """Print the maps of all ways and models that were asked for."""
    mechanism = load(options.mechanism)
    values = settings(mechanism, options.set)
    output = Output(options.out)
    heights, offsets = _points(options, mechanism, values)
    jobs = list(_jobs(options, mechanism, values, heights, offsets))
    report = reporter()
    maps = [job(_part(report, k, len(jobs))) for k, job in enumerate(jobs)]
    print("modal restitution, over walls h and offsets d of the hit")
    for one in maps:
        print(one)
    for sentence in _notes(options, mechanism, values, heights, offsets):
        print(sentence)
    _keep(maps, output, mechanism.name)
    output.write()


def _part(report: Progress, k: int, count: int) -> Progress:
    """Return what reports the progress of the k-th of several works of like length."""
    return lambda fraction: report((k + fraction) / count)


def _points(
    options: argparse.Namespace, mechanism: Mechanism, values: Mapping[str, float]
) -> tuple[list[float], list[float]]:
    """Return walls and offsets in order, the source's in proportion where none are given."""
    known = {name for name in values if name in mechanism.values()}
    system = assemble(mechanism, mechanism.values({name: values[name] for name in known}))
    scales = {
        "heights": WALLS * abs(system.values["release.displacement"]),
        "offsets": OFFSETS * system.length,
    }
    result = []
    for name, scale in scales.items():
        texts = getattr(options, name)
        chosen = (
            quantities(texts, "m", f"--{name}") if texts
            else [float(f"{scale * step:.3g}") for step in STEPS]
        )  # fmt: skip
        if scale == 0.0 and not texts:
            raise UserMistake(
                "release.displacement is 0, so there are no default heights: give --heights"
            )
        if len(set(chosen)) < len(chosen):
            raise UserMistake(f"--{name} {' '.join(texts or [])}: a place stands there twice")
        result.append(sorted(check_length(x, system.length, f"--{name}") for x in chosen))
    heights, offsets = result
    if len(heights) * len(offsets) > MOST_POINTS:
        raise UserMistake(
            f"{len(heights)} walls and {len(offsets)} offsets are {len(heights) * len(offsets)} "
            f"points: choose {MOST_POINTS} or fewer"
        )
    return heights, offsets


def _jobs(
    options: argparse.Namespace,
    mechanism: Mechanism,
    values: Mapping[str, float],
    heights: Sequence[float],
    offsets: Sequence[float],
) -> Iterator[Job]:
    """Give what computes each map."""
    models = dict(_models(options, mechanism))
    for way in dict.fromkeys(options.way):
        for label, model in models.items():
            one = partial(WAYS[way], model, heights, offsets, values, stop=options.stop)
            if way == "elements":
                yield partial(_told, one, "finite elements", elements=options.elements)
                break  # which know nothing of the model
            yield partial(_told, one, f"{label}, {way}")


def _notes(
    options: argparse.Namespace,
    mechanism: Mechanism,
    values: Mapping[str, float],
    heights: Sequence[float],
    offsets: Sequence[float],
) -> Iterator[str]:
    """Give what models that do not stretch hide, where the hit is farthest off the centre."""
    if not OF_MODELS.intersection(options.way):
        return
    stop, nearest = stop_index(mechanism, options.stop), min(heights, key=abs)
    name = mechanism.stops[stop].name
    for label, model in _models(options, mechanism):
        known = {**values, f"{name}.position": nearest, f"{name}.offset": 0.0}
        centred = lever(assemble(model, model.values(known)), stop)
        farthest = max(offsets, key=partial(_off, centred))
        sentence = note(model, {**known, f"{name}.offset": farthest}, stop)
        if sentence is not None:
            yield f"note, {label}: {sentence}"


def _off(centred: float, offset: float) -> float:
    return abs(centred + offset)


def _told(way: Way, label: str, progress: Progress, **more: object) -> ImpactMap:
    return way(label=label, progress=progress, **more)


def _models(options: argparse.Namespace, mechanism: Mechanism) -> Iterator[tuple[str, Mechanism]]:
    """Give the mechanism with each model of its flexures, by label."""
    if options.links < 1:
        raise UserMistake(f"--links {options.links}: a chain has one link or more")
    if not options.model:
        kinds = mechanism.flexure_types
        if options.axial:
            raise UserMistake("--axial goes with --model, for instance --model 2R --axial")
        label = " ".join(dict.fromkeys(_label(k.model, k.n, k.axial) for k in kinds))
        yield label or mechanism.name, mechanism
    for model in options.model:
        n = options.links if model == "nR" else 0
        changed = impact_map.with_flexures(mechanism, model, axial=options.axial, n=n)
        yield _label(model, n, options.axial), changed


def _label(model: str, n: int, axial: bool) -> str:
    return (f"{n}R" if n else model) + (" axial" if axial else "")


def _keep(maps: Sequence[ImpactMap], output: Output, name: str) -> None:
    """Keep tables and figures of maps."""
    head, rows = maps[0].csv().split("\n", 1)
    rest = [one.csv().split("\n", 1)[1] for one in maps[1:]]
    output.text(f"{name}-impact-map.csv", head + "\n" + rows + "".join(rest))
    output.figure(f"{name}-impact-map.png", lambda: figures.heat_map(maps))
    if np.all(np.array(maps[0].restitution.shape) > 1):
        output.figure(f"{name}-impact-map-3d.png", lambda: figures.surface(maps))
    for one in maps:
        if one.hits:
            slug = re.sub(r"[^\w.]+", "-", one.label)
            output.figure(f"{name}-energies-{slug}.png", partial(figures.energies, one))
