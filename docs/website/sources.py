"""The source folder of the site: pages of the repository, and pages that are made from files."""

import re
import shutil
from collections.abc import Iterator
from pathlib import Path, PurePosixPath

import links

ROOT_PAGES = ("README.md", "CONTRIBUTING.md", "CHANGELOG.md")
FOLDERS = ("docs", "examples")
TITLES = {"README.md": "Installation and first run"}  # The front page has the name of the package.
LANGUAGES = {".py": "python", ".toml": "toml", ".c": "c", ".h": "c", ".sh": "sh", ".json": "json"}
TITLE = re.compile(r"^# .+$", re.MULTILINE)
HEADING = re.compile(r"^## (.+)$", re.MULTILINE)
KIND = re.compile(r"^\| ([^|:]+): [^|]+ \|(.+)\|$", re.MULTILINE)
HIDDEN = "```{toctree}\n:hidden:\n"


def pages(root: Path) -> list[PurePosixPath]:
    """Return the Markdown pages and notebooks of the repository that the site shows."""
    found = [root / name for name in ROOT_PAGES]
    found += sorted((root / "docs").glob("*.md"))
    found += sorted(path for kind in links.PAGES for path in (root / "examples").rglob(f"*{kind}"))
    return [PurePosixPath(path.relative_to(root).as_posix()) for path in found]


def listings(root: Path) -> list[PurePosixPath]:
    """Return the programs and mechanism files of the examples, which get a page each."""
    found = (path for kind in (".py", ".toml") for path in (root / "examples").rglob(f"*{kind}"))
    return sorted(PurePosixPath(path.relative_to(root).as_posix()) for path in found)


def readers(index: str) -> dict[str, list[str]]:
    r"""Return the pages for each kind of reader, in reading order, each page once.

    Parameters
    ----------
    index : str
        The page that lists all pages, with a heading for each kind of reader.

    Examples
    --------
    >>> readers("## A\n1. [x](x.md)\n2. [y](../y.md)\n## B\n1. [x](x.md)\n")
    {'A': ['x.md', '../y.md'], 'B': []}
    """
    parts = HEADING.split(index)[1:]
    seen: set[str] = set()
    result = {}
    for reader, text in zip(parts[::2], parts[1::2], strict=True):
        listed = [link.partition("#")[0] for link in links.linked(text)]
        result[reader] = [link for link in dict.fromkeys(listed) if link not in seen]
        seen.update(listed)
    return result


def kinds(index: str) -> dict[str, list[str]]:
    r"""Return the pages of each kind: tutorials, how-to guides, reference and explanation.

    Parameters
    ----------
    index : str
        The page that lists all pages, with a table of the kinds.

    Examples
    --------
    >>> kinds("| kind | pages |\n|---|---|\n| A: learn | [x](x.md), [y](y.md) |\n")
    {'A': ['x.md', 'y.md']}
    """
    return {found[1]: list(links.linked(found[2])) for found in KIND.finditer(index)}


class Sources:
    """The source folder of the site.

    Parameters
    ----------
    root : Path
        The repository.
    folder : Path
        The source folder, which is created.
    """

    def __init__(self, root: Path, folder: Path) -> None:
        self.root, self.folder = root, folder
        self.pages = pages(root)
        self.listings = listings(root)

    def write(self) -> None:
        """Write all pages, pictures and listings.

        Raises
        ------
        LinkError
            If a link of a page leads to nothing.
        """
        for page in self.pages:
            self.put(page, self._page(page))
        self._linked_files()
        for listing in self.listings:
            self.put(links.site_page(self.root, listing), self._listing(listing))
        for path in self._pictures():
            target = self.folder / path.relative_to(self.root)
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(path, target)

    def put(self, page: PurePosixPath, text: str) -> None:
        """Write a page of the site."""
        path = self.folder / page
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")

    def _pictures(self) -> Iterator[Path]:
        for folder in FOLDERS:
            for kind in links.IMAGES:
                yield from (self.root / folder).rglob(f"*{kind}")

    def _page(self, page: PurePosixPath) -> str:
        text = (self.root / page).read_text(encoding="utf-8")
        if page.suffix != ".md":
            return text
        text = links.for_site(self.root, page, text)
        if title := TITLES.get(str(page)):
            text = TITLE.sub(f"# {title}", text, count=1)
        return text + self._contents(page) if page.name == "README.md" else text

    def _contents(self, page: PurePosixPath) -> str:
        """Return the end of the page of a folder: links to its programs and pages."""
        if page.parent.parts[:1] != ("examples",):
            return ""
        files = [path for path in self.listings if path.parent == page.parent]
        below = [p for p in self.pages if p.parent.parent == page.parent and p.suffix == ".md"]
        names = [f"{path.name}.md" for path in files]
        names += [str(p.relative_to(page.parent)) for p in below]
        entries = [f"- [`{path.name}`]({path.name}.md)" for path in files]
        shown = ["", "## Files", "", *entries] if files else []
        return "\n".join([*shown, "", HIDDEN + "\n".join(names), "```", ""])

    def _listing(self, path: PurePosixPath) -> str:
        language = LANGUAGES.get(path.suffix, "text")
        text = (self.root / path).read_text(encoding="utf-8")
        fence = "`" * 4
        head = f"---\norphan: true\nhide-toc: true\n---\n\n# {path}\n\n"
        return f"{head}::::::{{container}} listing\n{fence}{language}\n{text}{fence}\n::::::\n"

    def _linked_files(self) -> None:
        """Add listings of the files and folders that pages link, if they have no page yet."""
        for page in self.pages:
            if page.suffix != ".md":
                continue
            text = (self.root / page).read_text(encoding="utf-8")
            for link in links.linked(text):
                self._linked(page, link)

    def _linked(self, page: PurePosixPath, link: str) -> None:
        file = link.partition("#")[0]
        if not file or "://" in link:
            return
        target = links.repository_path(page, file)
        path = self.root / target
        if path.is_dir() and not (path / "README.md").exists():
            self.put(target / "files.md", self._folder(target))
        elif path.suffix not in (*links.PAGES, *links.IMAGES) and path.is_file():
            self.listings += [target] if target not in self.listings else []

    def _folder(self, folder: PurePosixPath) -> str:
        """Return the page of a folder without a README: its pages and programs."""
        inside = [p for p in (*self.pages, *self.listings) if p.parent == folder]
        entries = [
            f"- [{'' if p.suffix in links.PAGES else f'`{p.name}`'}]"
            f"({links.site_page(self.root, p).name})"
            for p in inside
        ]
        names = [links.site_page(self.root, p).name for p in inside]
        head = ["---", "orphan: true", "---", "", f"# {folder}", ""]
        return "\n".join([*head, *entries, "", HIDDEN + "\n".join(names), "```", ""])
