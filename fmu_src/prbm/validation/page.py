"""The results of the source, reproduced: a page with printed, computed and reference values.

``prbm validate --out docs`` computes all of :data:`prbm.validation.reproduced.RESULTS` and
writes ``validation.md`` and the figures ``figures/validation-*.png`` into a folder.  With
``--only`` some results are computed and the others stay as the existing page has them.  The random
numbers of synthetic records are seeded: all runs give the same page.

Source: S. Boersma, Modelling and Validation of the Impact Response in Compliant Mechanisms, MSc
thesis, TU Delft, 2015.
"""

import re
from collections.abc import Sequence
from pathlib import Path

from ..base.errors import PrbmError
from ..base.progress import Progress
from ..plots.figures import save
from .reproduced import RESULTS
from .side_by_side import FIGURES, Reproduction, Result, file_name

PAGE = "validation.md"


class ValidationError(PrbmError, ValueError):
    """A result is unknown, or the page cannot be written."""


# --- the page -----------------------------------------------------------------------------------

HEAD = """# The source, reproduced

What S. Boersma's thesis (*Modelling and Validation of the Impact Response in Compliant Mechanisms*,
TU Delft, 2015) prints, beside what this package computes and beside a reference that knows nothing
of pseudo-rigid bodies: finite elements (**FE**, Exudyn's ANCF cables, from the same mechanism
files), closed forms (**exact**), or what was **put in** to a synthetic record.
`prbm validate --out docs` computes every number and figure of this page in a few
minutes; the tests compute them again and compare.

The thesis' measured records are not public: where it measures, a synthetic record with its sensors'
noise (laser 4 µm at 750 Hz, load cell 0 to 0.5 N) takes their place, and shows what an evaluation
can know. Its curves exist as pictures only, so that for these its words are compared.

*Difference* is ours less the printed value, or less the reference where nothing is printed. A limit
stands beside a number only where agreement is claimed, and the verdict counts these claims; where
one does not hold, the section says why, or that we do not know. What the source got wrong is shown
on its own algorithm (`prbm.references.source_model`, derived again), with its errors as switches.
"""
SUMMARY = "| in the source | | printed | ours | reference | difference | |"
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
        Order of all results; those of ``results`` if empty.
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
    """Return the row in the summary and the section of a result; None if it is not on the page."""
    row = re.search(rf"^\| \[[^\]]*\]\(#{re.escape(key)}\) .*$", text, re.MULTILINE)
    section = re.search(SECTION.format(re.escape(key)), text, re.DOTALL)
    return (row[0], section[1]) if row and section else None


def chosen(only: Sequence[str] = ()) -> tuple[Reproduction, ...]:
    """Return the reproductions with these keys; without keys all of them.

    Raises
    ------
    ValidationError
        If a key is unknown.
    """
    known = [one.key for one in RESULTS]
    for key in only:
        if key not in known:
            raise ValidationError(f"there is no result {key!r}; there are {', '.join(known)}")
    return tuple(one for one in RESULTS if not only or one.key in only)


def reproduce(
    folder: Path, only: Sequence[str] = (), progress: Progress | None = None
) -> Sequence[Result]:
    """Compute results of the source and write them to a page with figures.

    Parameters
    ----------
    folder : Path
        Folder of ``validation.md`` and ``figures/``, created if necessary.
    only : sequence of str
        Keys of the results; empty: all.  The others stay as the existing page has them.
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
        (path.parent / FIGURES).mkdir(parents=True, exist_ok=True)
        known = path.read_text(encoding="utf-8") if only and path.exists() else ""
        for result in results:
            for drawing in result.drawings:
                save(drawing.figure, path.parent / FIGURES / file_name(drawing))
        keys = [one.key for one in chosen()]
        path.write_text(page(results, known, keys), encoding="utf-8")
    except OSError as error:
        raise ValidationError(f"{path}: cannot be written ({error.strerror})") from None
    return results


def _computed(wanted: Sequence[Reproduction], tell: Progress) -> list[Result]:
    total = sum(one.seconds for one in wanted)
    done, results = 0.0, []
    for one in wanted:
        begin = done

        def part(fraction: float, begin: float = begin, share: float = one.seconds) -> None:
            tell((begin + fraction * share) / total)

        results.append(one.run(part))
        done += one.seconds
        tell(done / total)
    return results
