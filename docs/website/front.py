"""The front page: a mechanism that moves, and an entrance for each kind of reader."""

import html
import json
import re
from collections.abc import Sequence
from pathlib import Path, PurePosixPath

import gallery
import links
from sources import HEADING, HIDDEN, Sources, kinds, readers

TEXT = Path(__file__).with_name("front.md")
INDEX = PurePosixPath("docs/index.md")
ENTRIES = 4  # Links of an entrance.
FIRST = ("README.md", "gallery/index.md")
FOR_ALL = ("examples/README.md", "api/index.md", "docs/glossary.md", "All pages <docs/index.md>")
ELSEWHERE = ("README.md", "examples/README.md", "docs/glossary.md")  # Not in the lists of readers.


def title(text: str) -> str:
    r"""Return the title of a page in Markdown.

    Examples
    --------
    >>> title("(here)=\n# A page\n\nText")
    'A page'
    """
    found = re.search(r"^# (.+)$", text, re.MULTILINE)
    assert found is not None
    return found[1]


def listed_pages(listed: Sequence[str]) -> list[str]:
    """Return the pages of the site for links of the index, without those that have other places."""
    found = (str(links.repository_path(INDEX, link)) for link in listed)
    return [page for page in found if page not in ELSEWHERE]


def contents(sources: Sources, index: str) -> str:
    """Return the contents of the site: a tree for each kind of pages, and those beside them."""
    trees = [_tree("", FIRST)]
    for kind, listed in kinds(index).items():
        more = [f for r in readers(index) for f in notebooks(sources, r)] if len(trees) == 1 else []
        trees.append(_tree(kind, [*listed_pages(listed), *more]))
    return "\n".join([*trees, _tree("Everything", FOR_ALL)])


def notebooks(sources: Sources, reader: str) -> list[str]:
    """Return the notebooks for a kind of reader; their names are the last words of the reader."""
    words = reader.lower().replace(" ", "_")
    found = (page for page in sources.pages if page.suffix == ".ipynb")
    chosen = (page for page in found if words.endswith(page.stem))
    return [f"Notebook: {_notebook_title(sources.root / page)} <{page}>" for page in chosen]


def _notebook_title(path: Path) -> str:
    first = json.loads(path.read_text(encoding="utf-8"))["cells"][0]
    return title("".join(first["source"]))


def _tree(caption: str, entries: Sequence[str]) -> str:
    option = f":caption: {caption}\n" if caption else ""
    return HIDDEN + option + "\n" + "\n".join(entries) + "\n```\n"


def entrances(sources: Sources, index: str) -> str:
    """Return the entrances of the kinds of readers, as HTML."""
    parts = HEADING.split(index)[1:]
    texts = (text.strip().split("\n\n")[0] for text in parts[1::2])
    about = dict(zip(parts[::2], texts, strict=True))
    cards = []
    for reader, listed in readers(index).items():
        entries = "\n".join(_entry(sources, page) for page in listed_pages(listed)[:ENTRIES])
        anchor = reader.lower().replace(" ", "-")
        cards.append(
            f'<section class="reader">\n<h3><a href="docs/index.html#{anchor}">'
            f"{html.escape(reader)}</a></h3>\n<p>{html.escape(about[reader])}</p>\n"
            f"<ul>\n{entries}\n</ul>\n</section>"
        )
    return '<div class="readers">\n' + "\n".join(cards) + "\n</div>\n"


def _entry(sources: Sources, page: str) -> str:
    text = html.escape(title((sources.root / page).read_text(encoding="utf-8")))
    return f'<li><a href="{page.removesuffix(".md")}.html">{text}</a></li>'


def write(sources: Sources) -> None:
    """Write the front page; the gallery has been written before."""
    index = (sources.root / INDEX).read_text(encoding="utf-8")
    live = sources.folder / gallery.FOLDER / f"{gallery.FRONT}.part.html"
    film = f'<div class="film">\n{live.read_text(encoding="utf-8")}</div>\n'
    sources.put(PurePosixPath("front.part.html"), film)
    sources.put(PurePosixPath("readers.part.html"), entrances(sources, index))
    text = TEXT.read_text(encoding="utf-8") + "\n" + contents(sources, index)
    sources.put(PurePosixPath("index.md"), text)
