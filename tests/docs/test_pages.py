"""The pages are reachable from the index, and their links and the film of the README exist."""

import re
import shlex
from pathlib import Path

import pytest
from PIL import Image

from prbm.commands.command_line import main
from prbm.hybrid.events import EventKind
from support import ROOT

DOCS = ROOT / "docs"
PAGES = sorted(
    [
        *ROOT.glob("*.md"), *DOCS.glob("*.md"), *(ROOT / "examples").rglob("*.md"),
    ]
)  # fmt: skip
FILM_SIZE_MAX = 1.5e6  # Bytes.
TERMS = (
    "modal restitution", "latched", "mobility", "event mode", "rest speed", "capture", "hold",
    "pseudo-rigid-body model", "coefficient of restitution", "stop", "friction point", "release",
    "snap", "communication step",
)  # fmt: skip


def prose(path: Path) -> str:
    """Return a page without its code blocks."""
    return re.sub(r"```.*?```", "", path.read_text(encoding="utf-8"), flags=re.DOTALL)


def links(path: Path) -> list[tuple[Path, str]]:
    """Return the relative links of a page: target file and anchor, either may be empty."""
    found = re.findall(r"\]\(([^)\s]+)\)", prose(path))
    split = (link.partition("#") for link in found if "://" not in link)
    return [(path.parent / file if file else path, anchor) for file, _, anchor in split]


def anchors(path: Path) -> set[str]:
    """Return the anchors of a page, from its headings and from HTML elements."""
    text = prose(path)
    headings = re.findall(r"^#+ (.*)$", text, re.MULTILINE)
    slugs = {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}
    return slugs | set(re.findall(r'<a (?:id|name)="(.*?)"', text))


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_relative_links_resolve(page):
    for target, anchor in links(page):
        assert target.exists(), target
        assert not anchor or anchor in anchors(target), f"{target}#{anchor}"


def test_every_page_is_reachable_from_the_index():
    reached: set[Path] = set()
    ahead = [DOCS / "index.md"]
    while ahead:
        page = ahead.pop().resolve()
        page = page / "README.md" if page.is_dir() else page
        if page not in reached and page.suffix == ".md" and page.exists():
            reached.add(page)
            ahead += [target for target, _ in links(page)]
    assert set(PAGES) - reached == set()


def test_the_index_links_every_other_page_of_its_folder_directly():
    listed = {target.resolve() for target, _ in links(DOCS / "index.md")}
    assert set(DOCS.glob("*.md")) - listed == {DOCS / "index.md"}


LINKING = [path for path in PAGES if path.parent == DOCS and path.stem != "index"]
"""All pages of the folder but the index."""


@pytest.mark.parametrize("page", [ROOT / "README.md", *LINKING], ids=lambda path: path.name)
def test_pages_link_the_index_and_the_glossary(page):
    linked = {target.resolve() for target, _ in links(page)}
    assert {DOCS / "index.md", DOCS / "glossary.md"} <= linked | {page}


def test_the_page_of_conventions_lists_every_kind_of_event():
    page = (ROOT / "docs" / "conventions.md").read_text("utf-8")
    section = page.partition("\n## Events\n")[2]
    items = re.findall(r"(?m)^- .*$", section.partition("\n\nRest is")[0])
    assert len(items) == len(EventKind)


def test_the_glossary_is_in_alphabetical_order_and_has_the_terms():
    text = (DOCS / "glossary.md").read_text(encoding="utf-8")
    entries = [entry.lower() for entry in re.findall(r"^\*\*(.*?)\.\*\*", text, re.MULTILINE)]
    assert entries == sorted(entries, key=lambda entry: entry.replace("-", ""))
    for term in TERMS:
        assert any(term in entry for entry in entries), term


@pytest.fixture
def film() -> Path:
    """Return the film of the README."""
    (name,) = re.findall(r"!\[.*?\]\((.*?\.gif)\)", prose(ROOT / "README.md"))
    return ROOT / name


def test_the_film_of_the_readme_is_small(film):
    assert film.stat().st_size < FILM_SIZE_MAX


@pytest.mark.slow
def test_the_command_in_the_readme_makes_the_film(film, tmp_path, monkeypatch):
    """Size and number of frames are equal; the pixels depend on the version of Matplotlib."""
    monkeypatch.chdir(tmp_path)
    (command,) = re.findall(r"`prbm (animate .*?)`", prose(ROOT / "README.md"))
    assert main(shlex.split(command)) == 0
    with Image.open(film.name) as made, Image.open(film) as shown:
        assert (made.size, made.n_frames) == (shown.size, shown.n_frames)
        assert made.n_frames > 50
