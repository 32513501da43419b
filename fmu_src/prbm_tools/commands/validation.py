"""``prbm validate``: the source's results again, or one mechanism beside its referees."""

import argparse
import tempfile
from pathlib import Path

from ..files import check_writable
from ..mechanism_file import find
from ..settings import UserMistake, settings
from ..simulate import reporter
from .output import Output
from .words import measured, stem


def validated(options: argparse.Namespace) -> None:
    """Print how the models compare."""
    if options.mechanism is None:
        _source(options)
    else:
        _mechanism(options)


def _source(options: argparse.Namespace) -> None:
    """Reproduce the source's results."""
    for option in ("measured", "set"):
        if getattr(options, option):
            raise UserMistake(f"--{option} goes with a mechanism: prbm validate MECHANISM ...")
    from ..validation import reproduce  # type: ignore[import-untyped, unused-ignore]

    if options.out is not None:
        check_writable(options.out)
    with tempfile.TemporaryDirectory(prefix="prbm_") as folder:
        results = reproduce(options.out or Path(folder), options.only, reporter())
    for result in results:
        print(result)


def _mechanism(options: argparse.Namespace) -> None:
    """Compare a mechanism with finite elements and measurements."""
    if options.only:
        raise UserMistake("--only chooses among the source's results: leave MECHANISM out")
    from ..comparison import compare  # type: ignore[import-untyped, unused-ignore]

    mechanism = find(options.mechanism)
    output = Output(options.out)
    found = compare(
        mechanism, settings(mechanism, options.set), elements=options.elements,
        measured=dict(map(measured, options.measured)), progress=reporter(),
    )  # fmt: skip
    print(found)
    output.text(f"{stem(mechanism.name)}-comparison.csv", found.csv)
    output.figure(f"{stem(mechanism.name)}-comparison.png", lambda: found.figure)
    output.write()
