"""``prbm validate``: the thesis reproduced, or a mechanism beside finite elements."""

import argparse
import tempfile
from pathlib import Path

from ..base.atomic import check_writable
from ..base.progress import reporter
from ..files.mechanism_file import load
from ..files.settings import UserMistake, settings
from .output import Output
from .words import measured

ELEMENTS = 32  # Finite elements per flexure.


def print_validation(options: argparse.Namespace) -> None:
    """Reproduce the thesis, or compare the given mechanism with references."""
    if options.mechanism is None:
        _thesis(options)
    else:
        _mechanism(options)


def _thesis(options: argparse.Namespace) -> None:
    """Reproduce results of the thesis and print their verdicts."""
    for option in ("measured", "set", "elements"):
        if getattr(options, option) not in (None, []):
            raise UserMistake(f"--{option} needs a mechanism: prbm validate MECHANISM ...")
    from ..validation.page import PAGE, chosen, reproduce  # imported here: slow

    if options.list:
        for one in chosen(options.only):
            print(f"{one.key}{'  (finite elements)' if one.elements else ''}")
        return
    if options.out is not None:
        check_writable(options.out)
    with tempfile.TemporaryDirectory(prefix="prbm_") as folder:
        results = reproduce(options.out or Path(folder), options.only, reporter())
    for result in results:
        print(f"{result.where}: {result.verdict}")
    if options.out is not None:
        print(options.out / PAGE)


def _mechanism(options: argparse.Namespace) -> None:
    """Compare a mechanism with finite elements and measurements."""
    if options.only or options.list:
        raise UserMistake("--only and --list select results of the thesis: omit MECHANISM")
    mechanism = load(options.mechanism)
    values, output = settings(mechanism, options.set), Output(options.out)
    measurements = dict(map(measured, options.measured))
    from ..analysis.comparison import compare  # imported here: slow
    from ..plots.comparison import comparison_figure

    elements = ELEMENTS if options.elements is None else options.elements
    found = compare(
        mechanism,
        values,
        elements=elements,
        measured=measurements,
        progress=reporter(),
    )
    print(found)
    output.text(f"{mechanism.name}-comparison.csv", found.csv())
    output.figure(f"{mechanism.name}-comparison.png", lambda: comparison_figure(found))
    output.write()
