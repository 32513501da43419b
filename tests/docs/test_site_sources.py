"""Sources of the documentation site: mapping of links, contents, reference."""

import doctest
import re
from importlib import import_module
from pathlib import PurePosixPath

import pytest

import drawings
import front
import gallery
import links
import prbm
import sources
from prbm.drawing.icon import STYLES
from prbm.files.mechanism_file import load, shipped
from support import ROOT

EXAMPLES = PurePosixPath("examples/README.md")
API = ROOT / "docs" / "website" / "api"


@pytest.mark.parametrize(
    ("page", "link", "expected"),
    [
        ("docs/index.md", "architecture.md", "architecture.md"),
        ("docs/index.md", "../README.md#limits", "../README.md#limits"),
        ("docs/index.md", "#researcher", "#researcher"),
        ("docs/index.md", "https://fmi-standard.org", "https://fmi-standard.org"),
        ("docs/index.md", "figures/lever.png", "figures/lever.png"),
        ("docs/embedding.md", "../examples/drop_test", "../examples/drop_test/README.md"),
        ("docs/embedding.md", "../examples/notebooks/", "../examples/notebooks/files.md"),
        ("examples/README.md", "sweep", "sweep/README.md"),
        ("examples/README.md", "quickstart.py", "quickstart.py.md"),
        ("README.md", "fmu_src/prbm/shipped/PRBDM.toml", "fmu_src/prbm/shipped/PRBDM.toml.md"),
    ],
)
def test_links_lead_to_the_pages_of_files_and_folders(page, link, expected):
    assert links.mapped(ROOT, PurePosixPath(page), link) == expected


@pytest.mark.parametrize("link", ["missing.md", "../../outside.md", "figures"])
def test_links_that_lead_nowhere_are_rejected(link):
    page = PurePosixPath("docs/index.md")
    if link == "figures":
        assert links.mapped(ROOT, page, link) == "figures/files.md"
    else:
        with pytest.raises(links.LinkError):
            links.for_site(ROOT, page, f"[x]({link})")


def test_code_is_not_changed():
    text = "```python\na[k](sweep)\n```\n\n    b[k](sweep)\n\n[c](sweep)\n"
    expected = text.replace("[c](sweep)", "[c](sweep/README.md)")
    assert links.for_site(ROOT, EXAMPLES, text) == expected


def test_anchors_and_file_names_become_those_of_the_site():
    text = "[Index](../docs/index.md) · [Glossary](../docs/glossary.md)\n"
    text += '<a id="x"></a>\n[sweep/README.md](sweep)'
    assert links.for_site(ROOT, EXAMPLES, text) == "\n(x)=\n[sweep/README.md](sweep/README.md)"
    text = "[docs/index.md](../docs/index.md) and [this](../docs/index.md)"
    expected = "[](../docs/index.md) and [this](../docs/index.md)"
    assert links.for_site(ROOT, EXAMPLES, text) == expected


@pytest.mark.parametrize("page", sources.pages(ROOT), ids=str)
def test_pages_keep_their_lines(page):
    """Sphinx then reports the lines of the repository."""
    text = (ROOT / page).read_text(encoding="utf-8")
    if page.suffix == ".md":
        assert links.for_site(ROOT, page, text).count("\n") == text.count("\n")


def test_every_page_has_one_place_in_the_contents():
    index = (ROOT / "docs" / "index.md").read_text(encoding="utf-8")
    listed = [link for pages in sources.readers(index).values() for link in pages]
    assert len(listed) == len(set(listed))
    kinds = [link for pages in sources.kinds(index).values() for link in pages]
    assert sorted(kinds) == sorted(set(listed) - {"../examples/README.md"})
    assert [*sources.kinds(index)] == ["Tutorials", "How-to guides", "Reference", "Explanation"]
    assert {f"{path.name}" for path in (ROOT / "docs").glob("*.md")} - {*listed} == {
        "index.md", "glossary.md"
    }  # fmt: skip


def test_the_pages_of_the_site_have_different_titles(tmp_path):
    """Links to the previous and the next page show titles."""
    made = sources.Sources(ROOT, tmp_path)
    made.write()
    texts = [(tmp_path / page).read_text("utf-8") for page in made.pages if page.suffix == ".md"]
    titles = [front.title(text) for text in (*texts, front.TEXT.read_text("utf-8"))]
    assert len({*titles}) == len(titles)


def named(name: str) -> object:
    """Return the object of a full name; several names may lead to one object."""
    module, _, attribute = name.rpartition(".")
    return getattr(import_module(module), attribute)


def test_the_reference_has_the_public_names_and_those_that_pages_and_examples_import():
    documented = {
        name
        for path in API.glob("*.rst")
        for name in re.findall(r"^\.\. auto\w+:: (\S+)$", path.read_text("utf-8"), re.MULTILINE)
    }
    found = {f"prbm.{name}" for name in prbm.__all__} - {"prbm.__version__"}
    texts = [path for kind in ("*.md", "*.ipynb") for path in (ROOT / "docs").glob(kind)]
    texts += [path for kind in ("*.py", "*.ipynb") for path in (ROOT / "examples").rglob(kind)]
    for path in texts:
        imports = r"from (prbm\.\w+\.[\w.]+) import ([\w, ]+)"
        for module, names in re.findall(imports, path.read_text("utf-8")):
            parts = [name.split(" as ")[0].strip() for name in names.split(",")]
            found |= {f"{module}.{name}" for name in parts}
    described = [named(name) for name in documented]
    assert [name for name in found if not any(named(name) is x for x in described)] == []


@pytest.mark.parametrize("module", ["links", "sources", "front", "gallery"])
def test_examples_of_the_docstrings_hold(module):
    failures, tests = doctest.testmod(import_module(module))
    assert (failures, tests > 0) == (0, True)


def test_all_kinds_of_parts_have_colours_on_the_site():
    """A kind without a rule would be invisible."""
    rules = (ROOT / "docs/website/static/site.css").read_text(encoding="utf-8")
    coloured = set(re.findall(r"\.mechanism \.(\w+)[^{]*\{[^}]*\b(?:stroke|fill): var", rules))
    assert {kind.split()[0] for kind in STYLES} - {"centre"} <= coloured  # It is not drawn.


@pytest.mark.slow
def test_cards_of_the_gallery_differ_and_move():
    """Mechanisms that differ by their flexure models share a card."""
    mechanisms = [load(name) for name in shipped()]
    families = gallery.families(mechanisms)
    assert sorted(m.name for family in families for m in family) == sorted(shipped())
    assert families[[family[0].name for family in families].index("GuideBeam")][1:]
    drawn = [drawings.drawing(family[0]) for family in families]
    assert len({re.sub(r"aria-label=.*|<title>.*", "", text) for text in drawn}) == len(drawn)
    assert all("<animate" in text for text in drawn)
