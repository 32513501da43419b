"""Results with figures and films, for notebooks.

Notebooks show the value of a cell: a result as a summary with a small figure, a figure as a PNG, a
film as a GIF.  No window is opened.
"""

import base64
import functools
import html
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, ParamSpec

from ..base.atomic import write
from ..runs import result as results
from ..runs import run
from ..runs.headline import headline
from ..runs.result import ResultError

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PREVIEW_DPI = 60.0  # Resolution of the figure of a result in a notebook.
P = ParamSpec("P")


@dataclass(frozen=True)
class Picture:
    """A figure that notebooks show.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
        The figure, for changes.
    """

    figure: "Figure"

    def _repr_png_(self) -> bytes:
        from ..drawing.style import png  # imported here: it takes a second

        return png(self.figure)

    def save(self, path: str | Path) -> Path:
        """Write the figure to a PNG file; return its path."""
        from .figures import save  # imported here: it takes a second

        return save(self.figure, path)


@dataclass(frozen=True, repr=False)
class Film:
    """A film that notebooks show.

    Parameters
    ----------
    content : bytes
        The GIF file.
    """

    content: bytes

    def __repr__(self) -> str:
        return f"<Film of {len(self.content)} bytes>"

    def _repr_html_(self) -> str:
        return f'<img alt="film" src="data:image/gif;base64,{_base64(self.content)}"/>'

    def save(self, path: str | Path) -> Path:
        """Write the film to a GIF file; return its path."""
        path = Path(path)
        write(path, self.content)
        return path


class Result(results.Result):
    """The result of a simulation, with figures and films."""

    def plot(self, *, ax: "Axes | Sequence[Axes] | None" = None) -> Picture:
        """Plot motion, impact speeds and energies over time.

        Parameters
        ----------
        ax : Axes, sequence of Axes, or None
            Axes of an own figure for the first panels, one each, for example for the displacements
            of several results; None: a new figure.

        Raises
        ------
        ResultError
            As :func:`prbm.plots.figures.response`.
        """
        from .figures import response  # imported here: Matplotlib takes half a second

        return Picture(response(self, ax=ax))

    def animate(
        self,
        *,
        slow: float | None = None,
        fps: float = 15.0,
        start: float | None = None,
        stop: float | None = None,
    ) -> Film:
        """Make a film of the motion.

        Parameters
        ----------
        slow : float or None
            Factor of slow motion; None: a round factor for a film of about ten seconds.
        fps : float
            Frames per second.
        start, stop : float or None
            First and last time [s]; None: from the release to shortly after the motion ends.

        Raises
        ------
        ResultError, ParameterError
            As :func:`prbm.plots.animation.animate`, which also writes MP4 files.
        """
        from .animation import animate  # imported here: Matplotlib takes half a second

        with tempfile.TemporaryDirectory() as folder:
            path = animate(
                self, Path(folder) / "film.gif", slow=slow, fps=fps, start=start, stop=stop
            )
            return Film(path.read_bytes())

    def _repr_html_(self) -> str:
        """Return the summary and a small figure for a notebook."""
        text = "\n".join([repr(self), *headline(self, self.mechanism, self.start_values)])
        return f"<pre>{html.escape(text)}</pre>{self._preview()}"

    def _preview(self) -> str:
        """Return a small figure as HTML; an empty text if the result has nothing to plot."""
        from ..drawing.style import png  # imported here: Matplotlib takes half a second

        try:
            figure = self.plot().figure
        except ResultError:
            return ""
        content = _base64(png(figure, PREVIEW_DPI))
        return f'<img alt="motion" src="data:image/png;base64,{content}"/>'


def _base64(content: bytes) -> str:
    return base64.b64encode(content).decode("ascii")


def _shown(function: Callable[P, results.Result]) -> Callable[P, Result]:
    """Return a function whose result has figures and films."""

    @functools.wraps(function)
    def wrapped(*arguments: P.args, **options: P.kwargs) -> Result:
        found = function(*arguments, **options)
        return Result(**{field.name: getattr(found, field.name) for field in fields(found)})

    return wrapped


simulate = _shown(run.simulate)
