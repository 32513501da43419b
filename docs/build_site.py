"""Build the documentation site.

    python docs/build_site.py [FOLDER]

writes the site to ``build/site``, or to another folder; open ``index.html`` there.  A warning is an
error.  It needs the extra ``docs``.
"""

import re
import shutil
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path, PurePosixPath

DOCS = Path(__file__).resolve().parent
ROOT = DOCS.parent
WEBSITE = DOCS / "website"
FOLDER = ROOT / "build" / "site"
MARK = ".buildinfo"  # A file that Sphinx writes to the folder of a site.

sys.path[:0] = [str(WEBSITE), str(ROOT / "fmu_src")]


def write_sources(folder: Path, extra: Path) -> None:
    """Write the source folder of the site, and the files that are copied to the site.

    Raises
    ------
    LinkError
        If a link of a page leads to nothing.
    PrbmError
        If there is no WebAssembly module and no compiler for it.
    """
    import front
    import gallery
    from sources import Sources

    sources = Sources(ROOT, folder)
    sources.write()
    gallery.write(folder, extra)
    front.write(sources)
    for path in sorted((WEBSITE / "api").glob("*.rst")):
        text = with_summary(path.read_text(encoding="utf-8"))
        sources.put(PurePosixPath("api") / path.name, text)


def with_summary(text: str) -> str:
    r"""Return a page of the API with a table of its names above the first section.

    Examples
    --------
    >>> print(with_summary("Page\n====\n\nA\n-\n\n.. autofunction:: prbm.load"))
    Page
    ====
    <BLANKLINE>
    .. autosummary::
    <BLANKLINE>
       ~prbm.load
    <BLANKLINE>
    A
    -
    <BLANKLINE>
    .. autofunction:: prbm.load
    """
    names = re.findall(r"^\.\. auto\w+:: (prbm\S+)", text, re.MULTILINE)
    table = ".. autosummary::\n\n" + "".join(f"   ~{name}\n" for name in names)
    return re.sub(r"^(.+\n-+\n)", rf"{table}\n\1", text, count=1, flags=re.MULTILINE)


def build(folder: Path) -> int:
    """Build the site in a folder, and return the exit status of Sphinx.

    Raises
    ------
    FileExistsError
        If the folder exists and is not that of a site.
    """
    from sphinx.cmd.build import build_main

    if folder.exists() and any(folder.iterdir()):
        if not (folder / MARK).is_file():
            raise FileExistsError(f"{folder} is not the folder of a site; name another folder")
        shutil.rmtree(folder)
    with tempfile.TemporaryDirectory(prefix="prbm_site_") as name:
        source, extra, state = (Path(name) / part for part in ("source", "extra", "state"))
        write_sources(source, extra)
        options = ["--fail-on-warning", "--keep-going", "--quiet", "-b", "html"]
        places = ["-c", str(DOCS), "-d", str(state), "-D", f"html_extra_path={extra}"]
        places += ["-D", f"html_static_path={WEBSITE / 'static'},{source / 'static'}"]
        status: int = build_main([*options, *places, str(source), str(folder)])
        return status


def main(arguments: Sequence[str]) -> int:
    """Build the site in ``build/site`` or in the given folder."""
    folder = Path(arguments[0]) if arguments else FOLDER
    try:
        status = build(folder)
    except FileExistsError as error:
        print(error, file=sys.stderr)
        return 2
    if status == 0:
        print(folder / "index.html")
    return status


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
