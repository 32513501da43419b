"""Links of the Markdown pages, mapped from the repository to the site.

The site has the folders of the repository, so that a relative link from page to page is the same
in both.  Other links get a page of their own: a folder leads to its README or to a list of its
files, and a text file to a page with its content.
"""

import re
from collections.abc import Iterator
from pathlib import Path, PurePosixPath

PAGES = (".md", ".ipynb")
IMAGES = (".png", ".gif", ".svg", ".jpg")
NAVIGATION = re.compile(r"^\[Index\]\(\S+\) · \[Glossary\]\(\S+\)$", re.MULTILINE)
ANCHOR = re.compile(r'^<a id="([\w-]+)"></a>$', re.MULTILINE)
CODE = re.compile(r"(^```.*?^```$|^ {4}.*?$)", re.DOTALL | re.MULTILINE)
LINK = re.compile(r"(!?)\[((?:[^\[\]]|\[[^\]]*\])*)\]\(([^)\s]+)\)")


class LinkError(ValueError):
    """A link of a page that leads nowhere."""


def site_page(root: Path, target: PurePosixPath) -> PurePosixPath:
    """Return the page of the site that shows a file or folder of the repository.

    Parameters
    ----------
    root : Path
        The repository.
    target : PurePosixPath
        The file or folder, relative to the repository.

    Raises
    ------
    LinkError
        If there is no such file or folder, or the file has no text.
    """
    path = root / target
    if path.is_dir():
        return target / ("README.md" if (path / "README.md").exists() else "files.md")
    if not path.is_file():
        raise LinkError(f"{target} does not exist")
    if path.suffix in PAGES:
        return target
    try:
        path.read_text(encoding="utf-8")
    except UnicodeDecodeError:
        raise LinkError(f"{target} is neither a page, a picture nor a text") from None
    return target.with_name(f"{target.name}.md")


def mapped(root: Path, page: PurePosixPath, link: str) -> str:
    """Return a link of a page as a link of the site.

    Parameters
    ----------
    root : Path
        The repository.
    page : PurePosixPath
        The page that has the link, relative to the repository.
    link : str
        An address, an anchor of the page, or a path relative to the page with or without an anchor.

    Raises
    ------
    LinkError
        If the link leads to nothing, or out of the repository.
    """
    file, mark, anchor = link.partition("#")
    if not file or "://" in link or link.startswith("mailto:"):
        return link
    target = repository_path(page, file)
    if target.suffix in IMAGES and (root / target).is_file():
        return link
    shown = site_page(root, target)
    up = [".."] * (len(page.parts) - 1 - common(page, shown))
    return "/".join([*up, *shown.parts[common(page, shown) :]]) + mark + anchor


def repository_path(page: PurePosixPath, file: str) -> PurePosixPath:
    """Return the path in the repository of a file that a page names relative to itself."""
    parts = list(page.parent.parts)
    for part in PurePosixPath(file).parts:
        if part != "..":
            parts.append(part)
        elif parts:
            parts.pop()
        else:
            raise LinkError(f"{page}: {file} is outside the repository")
    return PurePosixPath(*parts)


def common(page: PurePosixPath, other: PurePosixPath) -> int:
    """Return how many folders of two files are the same.

    Examples
    --------
    >>> common(PurePosixPath("docs/a.md"), PurePosixPath("docs/figures/b.png"))
    1
    """
    folders = zip(page.parts[:-1], other.parts[:-1], strict=False)
    count = 0
    for one, two in folders:
        if one != two:
            break
        count += 1
    return count


def prose(text: str) -> Iterator[tuple[bool, str]]:
    """Yield the parts of a page: whether the part is prose, not code, and its text."""
    for k, part in enumerate(CODE.split(text)):
        yield k % 2 == 0, part


def linked(text: str) -> list[str]:
    """Return the links of a page, without those in code."""
    parts = [part for is_prose, part in prose(text) if is_prose]
    return [link for part in parts for _, _, link in LINK.findall(part)]


def for_site(root: Path, page: PurePosixPath, text: str) -> str:
    """Return the text of a page for the site; the number of its lines stays the same.

    Links are mapped, the line of navigation is removed, and anchors get the notation of MyST.  The
    name of a linked page becomes its title.

    Raises
    ------
    LinkError
        If a link of the page leads to nothing.
    """

    def replaced(found: re.Match[str]) -> str:
        image, words, link = found.groups()
        try:
            target = mapped(root, page, link)
        except LinkError as error:
            raise LinkError(f"{page}: {error}") from None
        return f"{image}[{'' if names(words, link) else words}]({target})"

    def written(part: str) -> str:
        part = ANCHOR.sub(r"(\1)=", NAVIGATION.sub("", part))
        return LINK.sub(replaced, part)

    return "".join(written(part) if is_prose else part for is_prose, part in prose(text))


def names(words: str, link: str) -> bool:
    """Return whether the words of a link are only the file name of the linked page.

    Examples
    --------
    >>> names("docs/index.md", "docs/index.md"), names("architecture.md", "../docs/architecture.md")
    (True, True)
    >>> names("the index", "docs/index.md"), names("changes", "changes")
    (False, False)
    """
    path = link.partition("#")[0]
    plain = words.strip("`")
    return plain.endswith(".md") and f"/{path}".endswith(f"/{plain.removeprefix('../')}")
