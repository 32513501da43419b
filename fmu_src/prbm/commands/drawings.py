"""``prbm import`` and ``prbm export``: mechanism files from drawings, and drawings of them."""

import argparse
from dataclasses import fields
from pathlib import Path

from ..base.atomic import check_file, write, write_all
from ..base.unit_text import frequency_text
from ..cad.export import dxf
from ..cad.importing import Imported, Options, fundamental, import_drawing
from ..cad.outline import outline
from ..cad.writing import certainty
from ..files.mechanism_file import load
from ..files.settings import UserMistake, settings
from ..plots.drawing_check import check_picture, flexure_names

NOT_DRAWN = "masses, damping, strengths and contact laws are in the mechanism file only"


def import_file(options: argparse.Namespace) -> None:
    """Write the mechanism file of a drawing, and a picture to check it."""
    path = options.out or Path(options.drawing.name).with_suffix(".toml")
    _check_new(path, options.overwrite)
    if options.check is not None:
        check_file(options.check)
    chosen = _options(options)
    result = import_drawing(options.drawing, chosen)
    files = {path: result.text.encode("utf-8")}
    if options.check is not None:
        files[options.check] = check_picture(result)
    write_all(files)
    for sentence in summary(result):
        print(sentence)
    for file in files:
        print(file)


def _check_new(path: Path, overwrite: bool) -> None:
    """Check that a file that people edit can be written; an existing one only on request."""
    if path.exists() and not overwrite:
        raise UserMistake(
            f"{path} exists: choose another name by --out, or replace it by --overwrite"
        )
    check_file(path)


def export_file(options: argparse.Namespace) -> None:
    """Write the outline of a mechanism as DXF."""
    mechanism = load(options.mechanism)
    path = options.out or Path(f"{mechanism.name}.dxf")
    _check_new(path, options.overwrite)
    drawn = outline(mechanism, settings(mechanism, options.set))
    write(path, dxf(drawn))
    for note in (*drawn.notes, NOT_DRAWN):
        print(f"note: {note}")
    print(path)


def summary(result: Imported) -> list[str]:
    """Return sentences on what was recognised, assumed and not understood."""
    draft = result.draft
    found = draft.found
    count = len(draft.names)
    bodies = "1 moving body" if count == 1 else f"{count} moving bodies"
    lines = [f"{bodies}: {', '.join(draft.names.values())}"]
    every = flexure_names(draft)
    for kind in draft.kinds:
        names = [
            name
            for one in draft.flexures
            for k, name in every.items()
            if one.index in kind.members and k in draft.orbit(one)
        ]
        shape = found.flexures[kind.members[0]].shape
        lines.append(
            f"{kind.name}: {shape.profile}, thickness {1e3 * kind.dimensions['thickness']:.4g} mm, "
            f"length {1e3 * abs(shape.end - shape.start):.4g} mm: {', '.join(names)} "
            f"({certainty(shape.deviation, shape.equivalent)})"
        )
    for k, stop in enumerate(draft.stops):
        name = "stop" if len(draft.stops) == 1 else f"stop_{k + 1}"
        z = 1e3 * stop.point
        lines.append(
            f"{name}: {draft.names[stop.body]} hits it at ({z.real:.4g}, {z.imag:.4g}) mm, gap "
            f"{1e3 * stop.gap:.4g} mm"
        )
    lines += [f"note: {note}" for note in result.notes]
    lines += [
        f"warning: at ({1e3 * z.real:.4g}, {1e3 * z.imag:.4g}) mm: {text}"
        for z, text in found.doubts
    ]
    lines.append(f"fundamental frequency: {frequency_text(fundamental(result.mechanism))}")
    return lines


def _options(options: argparse.Namespace) -> Options:
    """Return the options of the import."""
    return Options(**{field.name: getattr(options, field.name) for field in fields(Options)})
