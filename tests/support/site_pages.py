"""Pages of a built site: their addresses and anchors."""

from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

LOADED = {"script": "src", "img": "src", "link": "href", "iframe": "src", "source": "src"}
OUTSIDE = ("http", "https", "mailto")


class Page(HTMLParser):
    """A page of HTML.

    Parameters
    ----------
    path : Path
        The file.
    """

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.path = path
        self.anchors: set[str] = set()
        self.links: list[str] = []
        self.loaded: list[str] = []
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Record the anchors and addresses of an element."""
        found = {name: value for name, value in attrs if value is not None}
        self.anchors |= {found[name] for name in ("id", "name") if name in found}
        if tag == "a" and "href" in found:
            self.links.append(found["href"])
        if tag in LOADED and LOADED[tag] in found:
            self.loaded.append(found[LOADED[tag]])


def pages(folder: Path) -> dict[Path, Page]:
    """Return all pages of a site by file."""
    return {path.resolve(): Page(path) for path in sorted(folder.rglob("*.html"))}


def outside(address: str) -> bool:
    """Return whether an address is not one of the site."""
    return urlsplit(address).scheme in OUTSIDE or address.startswith("//")


def broken(site: dict[Path, Page]) -> Iterator[str]:
    """Yield the addresses inside a site that lead to no file or to no anchor."""
    for path, page in site.items():
        for address in (*page.links, *page.loaded):
            parts = urlsplit(address)
            if parts.scheme:
                continue
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            exists = target in site or target.is_file()
            anchor = unquote(parts.fragment)
            named = not anchor or target not in site or anchor in site[target].anchors
            if not (exists and named):
                yield f"{path.name}: {address}"
