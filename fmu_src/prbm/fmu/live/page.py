"""The live part of a page: its markup, style, data and script, in one file without a network."""

import base64
import gzip
import json
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any

SCRIPTS = (
    "engine.js", "run.js", "geometry.js", "format.js", "stage.js", "plots.js", "controls.js",
    "tables.js", "link.js", "film.js", "modes.js", "app.js",
)  # fmt: skip
"""The files of the script, in the order in which they are joined."""
STYLE, MARKUP = "live.css", "live.html"


@dataclass(frozen=True)
class LivePart:
    """The live part of a page.

    Parameters
    ----------
    style : str
        Style sheet.
    markup : str
        Section of the page, which stays hidden without JavaScript.
    data : str
        Elements with the data, for the end of the page.
    script : str
        The script, which follows the data.
    """

    style: str
    markup: str
    data: str
    script: str


def live_part(content: dict[str, Any], tables: bytes, module: bytes) -> LivePart:
    """Return the live part of the page of a mechanism.

    Parameters
    ----------
    content : dict
        Description of the mechanism, see :func:`prbm.fmu.live.content.content`.
    tables : bytes
        Tables of the mechanism.
    module : bytes
        The kernel as a WebAssembly module.
    """
    data = (
        f'<script type="application/json" id="live-content">{embedded(content)}</script>\n'
        f'<script type="text/plain" id="live-tables">{packed(tables)}</script>\n'
        f'<script type="text/plain" id="live-module">{_packed_module(module)}</script>\n'
    )
    return LivePart(_text(STYLE), _text(MARKUP), data, f"\n{script()}\n")


@cache
def script() -> str:
    """Return the script of the live part: all files in one function, without comments and indents.

    No text of the script extends over several lines.
    """
    lines = [line.lstrip(" ") for name in SCRIPTS for line in _text(name).split("\n")]
    joined = "\n".join(line for line in lines if not line.startswith("//"))
    return f'(() => {{\n"use strict";\n{joined}\n}})();'


def embedded(content: object) -> str:
    r"""Return a value as JSON that may stand in an HTML script element.

    Examples
    --------
    >>> embedded({"name": "</script><!--"})
    '{"name":"\\u003c/script>\\u003c!--"}'
    """
    text = json.dumps(content, separators=(",", ":"), allow_nan=False)
    return text.replace("<", "\\u003c")


def packed(content: bytes) -> str:
    """Return bytes compressed by gzip, as base64; equal bytes give equal texts."""
    return base64.b64encode(gzip.compress(content, 9, mtime=0)).decode()


@cache
def _packed_module(module: bytes) -> str:
    """Return the module as :func:`packed` does; the result is kept for further pages."""
    return packed(module)


def _text(name: str) -> str:
    return files(__package__).joinpath(name).read_text(encoding="utf-8")
