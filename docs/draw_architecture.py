"""Draw the packages of ``prbm``, their layers and the imports between them.

    python docs/draw_architecture.py

writes ``docs/figures/architecture.png``.  The layers are those that import-linter checks
(``pyproject.toml``); the imports are read from the modules.  A panel has the layers of the kernel:
the order in which ``prbm_fmu.c`` includes its files.  The metadata of the picture contain all of
this as JSON, and a test compares them with the present files.
"""

import ast
import json
import re
import sys
import textwrap
import tomllib
from collections import Counter
from collections.abc import Iterator, Sequence
from itertools import groupby
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "fmu_src" / "prbm"
PICTURE = ROOT / "docs" / "figures" / "architecture.png"
ABOUT = {
    "commands": "the command line prbm",
    "validation": "the results of the thesis, computed again",
    "plots": "figures, pictures and films",
    "systems": "coupled FMUs: master, SSP, containers, model exchange",
    "sweeps": "studies: runner, designs, optima, sensitivities",
    "analysis": "impact maps, spectra, holding forces, fits: numbers only",
    "references": "finite elements, algorithm of the thesis, beam theory",
    "data": "measured records, uncertainty, modulus, vibration",
    "fmu": "model description, documentation, archive, Python slave",
    "runs": "experiment, simulation without an FMU, result",
    "kernel": "the engine in C, FMI 2.0 and 3.0, the compiler",
    "interface": "FMI variables, value references, binary tables",
    "cad": "DXF and SVG drawings",
    "drawing": "shapes of a mechanism, icon",
    "files": "TOML mechanism files, units, settings",
    "hybrid": "the event loop: guards, events, impacts, contact modes",
    "mechanics": "equations of motion, contact, statics, modes",
    "mechanism": "frozen description, parameters, flexures",
    "base": "errors, tolerances, atomic writing, unit text",
}
C_SUFFIXES = (".c", ".h")

# Distance of rows, indentation per row, width and height of a box [units of the axes].
ROW, INDENT, BOX, HEIGHT = 1.0, 0.72, 2.35, 0.66
INK, PALE, LINE, DOT = "#1f2a36", "#7a8794", "#9fb3c8", "#2b6ca3"
ARROW: dict[str, Any] = {"arrowstyle": "-|>,head_width=0.22,head_length=0.4", "color": LINE,
                         "linewidth": 1.0, "shrinkA": 0.0, "shrinkB": 0.0}  # fmt: skip
BLUE, GREEN, ORANGE, BAND = "#e4eef8", "#d9ecd9", "#fbe3c8", "#f5f6f8"
FILLS = {"base": GREEN, "mechanism": GREEN, "mechanics": GREEN, "hybrid": GREEN, "kernel": ORANGE}


def layers() -> list[list[str]]:
    """Return the packages of each layer of the import contract, highest layer first."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    (contract,) = (c for c in settings["tool"]["importlinter"]["contracts"] if c["id"] == "layers")
    rows = [[name.strip() for name in line.split("|")] for line in contract["layers"]]
    return [row for row in rows if row != ["__main__"]]


def imported(path: Path) -> Iterator[str]:
    """Yield, for each import of a module from prbm, the imported package."""
    here = path.relative_to(PACKAGE.parent).with_suffix("").parts[:-1]
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom):
            base = list(here[: len(here) - node.level + 1]) if node.level else []
            base += node.module.split(".") if node.module else []
            names = [[*base, alias.name] for alias in node.names][: None if len(base) == 1 else 1]
        elif isinstance(node, ast.Import):
            names = [alias.name.split(".") for alias in node.names]
        else:
            continue
        yield from (name[1] for name in names if name[0] == PACKAGE.name and len(name) > 1)


def imports() -> Counter[tuple[str, str]]:
    """Return the number of imports by (importing package, imported package)."""
    found: Counter[tuple[str, str]] = Counter()
    for path in sorted(PACKAGE.glob("*/**/*.py")):
        package = path.relative_to(PACKAGE).parts[0]
        found.update((package, other) for other in imported(path) if other != package)
    return found


def lines(package: str, suffixes: Sequence[str]) -> int:
    """Return the number of lines of a package's files with certain suffixes."""
    files = (p for p in (PACKAGE / package).rglob("*") if p.suffix in suffixes)
    return sum(len(path.read_text(encoding="utf-8").splitlines()) for path in files)


def extent(package: str) -> str:
    """Return the number of lines of a package, rounded to hundreds, as text."""
    parts = [(lines(package, (".py",)), "Python"), (lines(package, C_SUFFIXES), "C")]
    texts = [f"{max(round(n, -2), 100):,} {language}" for n, language in parts if n]
    return " + ".join(texts).replace(",", "\u202f")


def kernel_layers() -> list[list[str]]:
    """Return the C files of each folder of the kernel after its name, highest folder first."""
    source = (PACKAGE / "kernel" / "prbm_fmu.c").read_text(encoding="utf-8")
    files = re.findall(r'^#include "(?:(\w+)/)?(\w+)\.c"', source, re.MULTILINE)
    folders = groupby(files, key=lambda file: file[0])
    found = [[folder or "kernel", *(name for _, name in group)] for folder, group in folders]
    return found[::-1]


def data() -> dict[str, list[list[str]]]:
    """Return the picture as data: the layers, the arrows and the layers of the kernel."""
    arrows = [list(arrow) for arrow in sorted(imports())]
    return {"layers": layers(), "arrows": arrows, "kernel": kernel_layers()}


def draw() -> Figure:
    """Draw the packages along a diagonal; each import is a line down and then right."""
    rows = layers()
    order = [name for row in rows for name in row]
    found = imports()
    figure = Figure(figsize=(13.1, 10.6), dpi=150)
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    _bands(axes, rows, order)
    place = {name: (INDENT * k, -ROW * k) for k, name in enumerate(order)}
    _arrows(axes, place, found)
    for name, (x, y) in place.items():
        _box(axes, name, x, y)
    _key(axes)
    _kernel(axes)
    axes.set(xlim=(-0.5, 25.0), ylim=(-ROW * (len(order) - 1) - 0.75, 0.75))
    axes.set_axis_off()
    return figure


def _bands(axes: Axes, rows: Sequence[Sequence[str]], order: Sequence[str]) -> None:
    """Shade every second layer."""
    for k, row in enumerate(rows):
        top = -ROW * order.index(row[0]) + ROW / 2
        if k % 2 == 0:
            axes.axhspan(top - ROW * len(row), top, color=BAND, linewidth=0.0, zorder=0)


def _arrows(
    axes: Axes, place: dict[str, tuple[float, float]], found: Counter[tuple[str, str]]
) -> None:
    """Draw a line down from each importer, a line to each imported package, dots at crossings."""
    for name, (x, y) in place.items():
        down = [place[b][1] for a, b in found if a == name]
        if down:
            axes.plot([x + INDENT / 2] * 2, [y, min(down)], color=LINE, linewidth=1.0, zorder=1)
        into = [place[a][0] + INDENT / 2 for a, b in found if b == name]
        if into:
            axes.annotate("", (x, y), (min(into), y), arrowprops=ARROW, zorder=1)
    for (a, b), count in found.items():
        axes.scatter(place[a][0] + INDENT / 2, place[b][1], s=area(count), color=DOT, zorder=3,
                     linewidth=0.8, edgecolor="white")  # fmt: skip


def area(count: int) -> float:
    """Return the area of a dot for a number of imports [pt2]."""
    return 16.0 + 9.0 * float(count**0.8)


def _box(axes: Axes, name: str, x: float, y: float) -> None:
    box = FancyBboxPatch(
        (x, y - HEIGHT / 2), BOX, HEIGHT, boxstyle="round,pad=0,rounding_size=0.12",
        facecolor=FILLS.get(name, BLUE), edgecolor=INK, linewidth=0.9, zorder=4,
    )  # fmt: skip
    axes.add_patch(box)
    style: dict[str, Any] = {"va": "center", "zorder": 5, "color": INK}
    axes.text(x + BOX / 2, y, name, ha="center", weight="bold", size=11, **style)
    axes.text(x + BOX + 0.18, y + 0.16, ABOUT[name], size=9.5, **style)
    axes.text(x + BOX + 0.18, y - 0.2, f"{extent(name)} lines", size=8, **style | {"color": PALE})


def _key(axes: Axes) -> None:
    """Explain lines, dots and colours in the empty corner."""
    panel = FancyBboxPatch((16.6, -3.02), 8.1, 3.32, boxstyle="round,pad=0,rounding_size=0.12",
                           facecolor="white", edgecolor=LINE, linewidth=0.7)  # fmt: skip
    axes.add_patch(panel)
    x, y = 17.0, -0.22
    style: dict[str, Any] = {"va": "center", "size": 9.5, "color": INK}
    axes.plot([x + 0.2] * 2, [y + 0.35, y - 0.2], color=LINE, linewidth=1.0)
    axes.annotate("", (x + 1.0, y - 0.2), (x + 0.2, y - 0.2), arrowprops=ARROW)
    axes.scatter(x + 0.2, y - 0.2, s=area(5), color=DOT, zorder=3, linewidth=0.8, edgecolor="white")
    axes.text(x + 1.25, y, "the package above imports the one at the", **style)
    axes.text(x + 1.25, y - 0.38, "arrow; a larger dot stands for more imports", **style)
    entries = {GREEN: "the engine in Python, inside Python FMUs",
               ORANGE: "the engine in C, compiled into native FMUs",
               BLUE: "everything around the engine",
               BAND: "grey and white bands: one layer each"}  # fmt: skip
    for k, (colour, text) in enumerate(entries.items()):
        low = y - 1.1 - 0.5 * k
        patch = FancyBboxPatch((x, low), 1.0, 0.3, boxstyle="round,pad=0,rounding_size=0.08",
                               facecolor=colour, edgecolor=INK, linewidth=0.7)  # fmt: skip
        axes.add_patch(patch)
        axes.text(x + 1.25, low + 0.15, text, **style)


def _kernel(axes: Axes) -> None:
    """List the C files of the kernel, the highest layer first."""
    left, right, y, step = 17.4, 24.7, -3.42, 0.235
    style: dict[str, Any] = {"va": "top", "color": INK, "zorder": 5}
    axes.text(left + 0.15, y - 0.12, "the C kernel: a file uses those after it and below", size=9.5,
              **style)  # fmt: skip
    low = y - 0.6
    for folder, *names in kernel_layers():
        rows = textwrap.wrap(", ".join(reversed(names)), 54)
        axes.text(left + 0.15, low, folder, size=8.5, weight="bold", **style)
        axes.text(left + 1.35, low, "\n".join(rows), size=7.2, linespacing=1.25, **style)
        low -= step * len(rows) + 0.14
    panel = FancyBboxPatch((left, low), right - left, y - low, facecolor=ORANGE, edgecolor=LINE,
                           boxstyle="round,pad=0,rounding_size=0.12", linewidth=0.7)  # fmt: skip
    axes.add_patch(panel)


def main(arguments: Sequence[str]) -> int:
    """Write the picture to ``docs/figures``, or to the given path."""
    path = Path(arguments[0]) if arguments else PICTURE
    with mpl.rc_context({"font.family": "DejaVu Sans"}):
        draw().savefig(path, metadata={"Software": None, "Architecture": json.dumps(data())})
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
