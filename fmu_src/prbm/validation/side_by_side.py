"""Printed values, ours and those of an independent route side by side, with their assessment."""

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
        What it is, with its unit.
    ours : float or None
        By the model; None: only the reference has it.
    printed : str or None
        As the source prints it.
    reference : float or None
        By an independent route.
    by : str
        Which route: ``FE`` (finite elements), ``exact`` (closed form), ``put in`` (the truth of a
        synthetic record), ``law``.
    within : float or None
        How near the number should be to what it is compared with; None: that is not claimed.
    absolute : bool
        Whether differences are absolute; else they are relative.
    form : str
        How ours and the reference are written.
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
        """What is compared: ours, or the reference where it alone is there."""
        found = self.ours if self.ours is not None else self.reference
        return math.nan if found is None else found

    @property
    def target(self) -> float:
        """With what it is compared: the printed value, or else the reference."""
        if self.printed is not None:
            return float(self.printed)
        return math.nan if self.reference is None or self.ours is None else self.reference

    @property
    def difference(self) -> float:
        """Found less target, relative unless ``absolute``; NaN if there is nothing to compare."""
        off = self.found - self.target
        if self.absolute:
            return off
        return off / abs(self.target) if self.target else math.nan

    @property
    def agrees(self) -> bool | None:
        """Whether the difference is within what is claimed; None if nothing is."""
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
    """A figure of a result: its name without the extension, what it shows."""

    name: str
    caption: str
    figure: Figure


@dataclass(frozen=True)
class Result:
    """A reproduced result of the source.

    Parameters
    ----------
    key : str
        Short name, for ``only`` and for links.
    where : str
        Table, figure or section of the source.
    what : str
        What is reproduced.
    numbers : tuple of Number
        The first one heads the summary.
    because : str
        Why it agrees, or does not; a sentence or two.
    text : str
        More, in Markdown.
    drawings : tuple of Drawing
        Figures.
    """

    key: str
    where: str
    what: str
    numbers: tuple[Number, ...]
    because: str
    text: str = ""
    drawings: tuple[Drawing, ...] = field(default=(), compare=False)

    @property
    def verdict(self) -> str:
        """Whether the claims of the numbers hold."""
        claims = [number.agrees for number in self.numbers if number.agrees is not None]
        if not claims:
            return "nothing to compare with"
        if all(claims):
            return "agrees"
        return f"agrees in {sum(claims)} of {len(claims)}" if any(claims) else "does not agree"

    def row(self) -> str:
        """Return the line of the summary."""
        head = self.numbers[0].cells()
        link = f"[{self.where}](#{self.key})"
        return f"| {link} | {head[0]} | {' | '.join(head[1:5])} | {self.verdict} |"

    def section(self) -> str:
        """Return the section of the page."""
        lines = [f'<a id="{self.key}"></a>', f"## {self.where}: {self.what}", ""]
        lines += [f"**{self.verdict[0].upper()}{self.verdict[1:]}.** {self.because}", ""]
        lines += [
            "| | printed | ours | reference | difference | |",
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
    """How a result is reproduced.

    Parameters
    ----------
    key : str
        That of its result.
    run : callable
        Computes it, telling the fraction done.
    elements : bool
        Whether it needs the finite elements (Exudyn).
    seconds : float
        It takes about; weights of the progress.
    """

    key: str
    run: Callable[[Progress], Result]
    elements: bool = False
    seconds: float = 1.0
