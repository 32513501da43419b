"""Printed, computed and reference values side by side, with claims about their agreement."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field

from matplotlib.figure import Figure

from ..base.progress import Progress

FIGURES = "figures"  # folder beside a page


@dataclass(frozen=True)
class Number:
    """One number of a result.

    Parameters
    ----------
    name : str
        Name of the quantity, with its unit.
    ours : float or None
        Value of this package; None: only the reference is compared.
    printed : str or None
        Value printed in the thesis.
    reference : float or None
        Value of an independent method.
    by : str
        The method: ``FE`` (finite elements), ``exact`` (closed form), ``true`` (parameter of a
        synthetic record), ``law``.
    within : float or None
        Claimed limit of the difference; None: no claim.
    absolute : bool
        Whether the difference is absolute (default: relative).
    form : str
        Format of the value of this package and of the reference.
    """

    name: str
    ours: float | None = None
    printed: str | None = None
    reference: float | None = None
    by: str = "FE"
    within: float | None = None
    absolute: bool = False
    form: str = ".5g"

    @property
    def found(self) -> float:
        """The compared value: that of this package, or else the reference."""
        found = self.ours if self.ours is not None else self.reference
        return math.nan if found is None else found

    @property
    def target(self) -> float:
        """The value to compare with: the printed one, or else the reference."""
        if self.printed is not None:
            return float(self.printed)
        return math.nan if self.reference is None or self.ours is None else self.reference

    @property
    def difference(self) -> float:
        """Found less target, relative unless ``absolute``; NaN if one of them is missing."""
        off = self.found - self.target
        if self.absolute:
            return off
        return off / abs(self.target) if self.target else math.nan

    @property
    def agrees(self) -> bool | None:
        """Whether the difference is within the claimed limit; None without a claim."""
        if self.within is None or math.isnan(self.difference):
            return None
        return abs(self.difference) <= self.within

    def cells(self) -> list[str]:
        """Return the cells of the number's row in a table."""
        ours = "" if self.ours is None else format(self.ours, self.form)
        reference = ""
        if self.reference is not None:
            reference = f"{format(self.reference, self.form) if self.reference else 0} ({self.by})"
        return [self.name, self.printed or "", ours, reference, self._off(), self._verdict()]

    def _off(self) -> str:
        if math.isnan(self.difference):
            return ""
        if self.absolute:
            return f"{self.difference:+.2g}"
        return f"{round(100 * self.difference, 2) + 0.0:+.2f} %"

    def _verdict(self) -> str:
        if self.agrees is None:
            return ""
        limit = f"{self.within:.3g}" if self.absolute else f"{100 * (self.within or 0.0):g} %"
        return f"within {limit}" if self.agrees else f"**not** within {limit}"


@dataclass(frozen=True)
class Drawing:
    """A figure of a result: file name without extension, caption, figure."""

    name: str
    caption: str
    figure: Figure


@dataclass(frozen=True)
class Result:
    """A reproduced result of the thesis.

    Parameters
    ----------
    key : str
        Short name, for ``only`` and for links.
    where : str
        Table, figure or section of the thesis.
    title : str
        Title of the section.
    numbers : tuple of Number
        Compared numbers; the first one is in the summary.
    explanation : str
        Explanation of the agreement or disagreement, two or three sentences.
    text : str
        Further text in Markdown, after the numbers and figures.
    drawings : tuple of Drawing
        Figures.
    """

    key: str
    where: str
    title: str
    numbers: tuple[Number, ...]
    explanation: str
    text: str = ""
    drawings: tuple[Drawing, ...] = field(default=(), compare=False)

    @property
    def verdict(self) -> str:
        """The number of claims that hold, in words."""
        claims = [number.agrees for number in self.numbers if number.agrees is not None]
        if not claims:
            return "no claims"
        if all(claims):
            return "agrees"
        return f"agrees in {sum(claims)} of {len(claims)}" if any(claims) else "does not agree"

    def row(self) -> str:
        """Return the row of the summary."""
        head = self.numbers[0].cells()
        link = f"[{self.where}](#{self.key})"
        return f"| {link} | {head[0]} | {' | '.join(head[1:5])} | {self.verdict} |"

    def section(self) -> str:
        """Return the section of the page."""
        lines = [f'<a id="{self.key}"></a>', f"## {self.where}: {self.title}", ""]
        lines += [f"**{self.verdict[0].upper()}{self.verdict[1:]}.** {self.explanation}", ""]
        lines += [
            "| quantity | printed | computed | reference | difference | verdict |",
            "|---|---:|---:|---:|---:|---|",
        ]
        lines += ["| " + " | ".join(number.cells()) + " |" for number in self.numbers]
        lines.append("")
        for drawing in self.drawings:
            lines += [f"![{drawing.caption}]({FIGURES}/{file_name(drawing)})", ""]
        if self.text:
            lines += [self.text.strip(), ""]
        return "\n".join(lines)


def file_name(drawing: Drawing) -> str:
    """Return the name of a figure's file.

    Examples
    --------
    >>> file_name(Drawing("map", "", Figure()))
    'validation-map.png'
    """
    return f"validation-{drawing.name}.png"


@dataclass(frozen=True)
class Reproduction:
    """The computation of a result.

    Parameters
    ----------
    key : str
        Key of the result.
    run : callable
        Computes the result; its argument is a progress callback.
    elements : bool
        Whether the computation needs finite elements (Exudyn).
    seconds : float
        Approximate duration [s], the weight in the reported progress.
    """

    key: str
    run: Callable[[Progress], Result]
    elements: bool = False
    seconds: float = 1.0
