"""The results of the thesis, reproduced: a page with printed, computed and reference values.

``prbm validate --out docs`` computes all of :data:`prbm.validation.reproduced.RESULTS` and
writes ``validation.md`` and the figures ``figures/validation-*.png`` into a folder.  With
``--only`` the selected results are computed and the others copied from the existing page.  The
random numbers of synthetic records are seeded, so that all runs give the same page.

Source: S. Boersma, Modelling and Validation of the Impact Response in Compliant Mechanisms, MSc
thesis, TU Delft, 2015.
"""

import re
from collections.abc import Sequence
from pathlib import Path

from ..base import reading
from ..base.atomic import write
from ..base.errors import PrbmError
from ..base.progress import Progress
from ..plots.figures import save
from .reproduced import RESULTS
from .side_by_side import FIGURES, Reproduction, Result, file_name

PAGE = "validation.md"
PAGE_SIZE_MAX = 1 << 24  # bytes


class ValidationError(PrbmError, ValueError):
    """A result is unknown, or the page cannot be written."""


# --- the page -----------------------------------------------------------------------------------

HEAD = """# The results of the thesis, reproduced
[Index](index.md) · [Glossary](glossary.md)

This page compares results of the thesis (S. Boersma, *Modelling and Validation of the Impact
Response in Compliant Mechanisms*, MSc thesis, TU Delft, 2015) with those of this package. The
columns are:

- *printed*: the value in the thesis;
- *computed*: the value of this package;
- *reference*: an independent value. It comes from finite elements (**FE**: ANCF cables of Exudyn,
  built from the same mechanism files), a closed form (**exact**), a conservation law or statistics
  (**law**), or it is the known parameter of a synthetic record (**true**);
- *difference*: computed less printed value, or less the reference if no value is printed;
- *verdict*: the claimed limit of the difference, and whether the difference is within it. Numbers
  without a limit are for information. The summary counts the claims that hold. Each section
  explains claims that do not hold, or says that the cause is unknown.

`prbm validate --out docs` computes every number and figure of this page in a few minutes. The tests
repeat the computation and compare the numbers.

The measured records of the thesis are not public. Synthetic records with the noise of its sensors
(laser 4 µm at 750 Hz, load cell 0 to 0.5 N) replace them, and show the accuracy of each evaluation.
The curves of the thesis are available as pictures only; instead, statements of its text are
compared. Two errors of the thesis are shown with its own algorithm, derived again in
`prbm.references.source_model`: the extra factor γ of the 2R stiffness, and the missing right side
of the acceleration constraint.
"""
SUMMARY = "| in the thesis | quantity | printed | computed | reference | difference | verdict |"
RULE = "|---|---|---:|---:|---:|---:|---|"
SECTION = r"<!-- result: {} -->\n(.*?)<!-- end -->"


def page(results: Sequence[Result], known: str = "", keys: Sequence[str] = ()) -> str:
    """Return the page of results; results that were not computed are copied from a known page.

    Parameters
    ----------
    results : sequence of Result
        Computed results.
    known : str
        An earlier page, or an empty text.
    keys : sequence of str
        Keys of all results in the order of the page; empty: those of ``results``.
    """
    new = {result.key: result for result in results}
    rows, sections = [], []
    for key in keys or list(new):
        if key in new:
            row, section = new[key].row(), new[key].section()
        else:
            kept = parts(known, key)
            if kept is None:
                continue
            row, section = kept
        rows.append(row)
        sections.append(f"<!-- result: {key} -->\n{section}<!-- end -->\n")
    return "\n".join([HEAD, SUMMARY, RULE, *rows, "", *sections])


def parts(text: str, key: str) -> tuple[str, str] | None:
    """Return the summary row and the section of a result; None if it is not on the page."""
    row = re.search(rf"^\| \[[^\]]*\]\(#{re.escape(key)}\) .*$", text, re.MULTILINE)
    section = re.search(SECTION.format(re.escape(key)), text, re.DOTALL)
    return (row[0], section[1]) if row and section else None


def chosen(only: Sequence[str] = ()) -> tuple[Reproduction, ...]:
    """Return the reproductions with the given keys (default: all).

    Raises
    ------
    ValidationError
        If a key is unknown.
    """
    known = [one.key for one in RESULTS]
    for key in only:
        if key not in known:
            raise ValidationError(f"unknown result {key!r}; results are {', '.join(known)}")
    return tuple(one for one in RESULTS if not only or one.key in only)


def reproduce(
    folder: Path, only: Sequence[str] = (), progress: Progress | None = None
) -> Sequence[Result]:
    """Compute results of the thesis and write them to a page with figures.

    Parameters
    ----------
    folder : Path
        Folder of ``validation.md`` and ``figures/``, created if necessary.
    only : sequence of str
        Keys of the results; empty: all.  The others are copied from the existing page.
    progress : callable or None
        Called with the completed fraction, from 0 to 1.

    Returns
    -------
    sequence of Result
        The computed results in the order of the page.

    Raises
    ------
    ValidationError
        If a key is unknown, or the page cannot be written.
    FiniteElementError
        If a result needs finite elements and Exudyn is not installed; ``only`` selects results
        without them.
    """
    wanted = chosen(only)
    results = [one for one in _computed(wanted, progress or (lambda _: None))]
    path = Path(folder) / PAGE
    try:
        known = ""
        if only and path.exists():
            known = reading.text(path, PAGE_SIZE_MAX, ValidationError).read()
        for result in results:
            for drawing in result.drawings:
                save(drawing.figure, path.parent / FIGURES / file_name(drawing))
        keys = [one.key for one in chosen()]
        write(path, page(results, known, keys).encode())
    except OSError as error:
        raise ValidationError(f"{path}: cannot be written ({error.strerror or error})") from None
    return results


def _computed(wanted: Sequence[Reproduction], progress: Progress) -> list[Result]:
    total = sum(one.seconds for one in wanted)
    done, results = 0.0, []
    for one in wanted:
        begin = done

        def part(fraction: float, begin: float = begin, share: float = one.seconds) -> None:
            progress((begin + fraction * share) / total)

        results.append(one.run(part))
        done += one.seconds
        progress(done / total)
    return results
