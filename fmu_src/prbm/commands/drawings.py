"""``prbm import`` and ``prbm export``: mechanism files from drawings, and drawings of them."""

import argparse
from pathlib import Path

from ..base.atomic import check_file, write, write_all
from ..base.unit_text import frequency_text
from ..cad.export import dxf
from ..cad.importing import Imported, Options, fundamental, import_drawing
from ..cad.outline import outline
from ..cad.writing import certainty
from ..files.mechanism_file import load
from ..files.settings import UserMistake, optional_quantity, quantity, settings
from ..plots.drawing_check import check_picture, flexure_names

INCH = 0.0254  # m
INCHES = ("in", "inch", "inches")


def import_file(options: argparse.Namespace) -> None:
    """Write the mechanism file of a drawing, and a picture to check it."""
    path = options.out or Path(options.drawing.name).with_suffix(".toml")
    for file in (path, options.check):
        if file is not None:
            check_file(file)
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


def export_file(options: argparse.Namespace) -> None:
    """Write the outline of a mechanism as DXF."""
    mechanism = load(options.mechanism)
    path = options.out or Path(f"{mechanism.name}.dxf")
    check_file(path)
    drawn = outline(mechanism, settings(mechanism, options.set))
    write(path, dxf(drawn))
    for note in drawn.notes:
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
    lines += [f"note: {note}" for note in result.notes]
    lines += [
        f"warning: at ({1e3 * z.real:.4g}, {1e3 * z.imag:.4g}) mm: {text}"
        for z, text in found.doubts
    ]
    lines.append(f"fundamental frequency: {frequency_text(fundamental(result.mechanism))}")
    return lines


def _options(options: argparse.Namespace) -> Options:
    """Return the options of the import."""
    metres, drawn = list[complex](), list[complex]()
    for text in options.ground:
        z, in_units = _point(text)
        (drawn if in_units else metres).append(z)
    return Options(
        _positive(options.thickness, "--thickness"),
        options.material,
        options.youngs_modulus,
        options.density,
        metres,
        drawn,
        _unit(options.unit),
        optional_quantity(options.gap, "m", "--gap"),
        optional_quantity(options.tolerance, "m", "--tolerance"),
        optional_quantity(options.flexures_below, "m", "--flexures-below"),
        options.name,
    )


def _positive(text: str, option: str) -> float:
    value = quantity(text, "m", option)
    if not value > 0.0:
        raise UserMistake(f"{option} {text}: write a positive length, for instance 8mm")
    return value


def _unit(text: str | None) -> float | None:
    """Return the length of a unit of the drawing [m]."""
    if text is None:
        return None
    return INCH if text.strip().lower() in INCHES else _positive(f"1 {text}", "--unit")


def _point(text: str) -> tuple[complex, bool]:
    """Return a point, and whether it is in units of the drawing instead of metres."""
    words = text.split(",")
    if len(words) != 2:
        raise UserMistake(f"--ground {text}: write a point x,y, for instance 5,5 or 5mm,5mm")
    try:
        return complex(*map(float, words)), True
    except ValueError:
        return complex(*(quantity(word, "m", "--ground") for word in words)), False
