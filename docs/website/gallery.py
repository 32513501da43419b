"""The gallery: a page for each shipped mechanism, which simulates it in the browser."""

import html
import re
from pathlib import Path

from drawings import drawing
from prbm.files.mechanism_file import load, shipped
from prbm.fmu.documentation import STYLE
from prbm.fmu.explorer import explorer
from prbm.mechanism.description import Mechanism

FOLDER = "gallery"
ALONE = "live"  # Folder of the site with the pages of ``prbm explore``.
FRONT = "PRBDM2R"  # The mechanism of the front page.
DARK = re.compile(
    r"@media \(prefers-color-scheme: dark\) \{\s*(?P<root>[^{}]+?)\s*\{(?P<rules>[^{}]*)\}\s*\}"
)
LIGHT = re.compile(r":root \{(?P<rules>[^{}]*)\}")
PARTS = re.compile(r'<section id="live".*?</section>', re.DOTALL)
DATA = re.compile(r'<script type="application/json" id="live-content">.*</script>', re.DOTALL)


def style(page: str) -> str:
    """Return the style sheet of the live part of a page, with the colours of the theme.

    The page follows the colour scheme of the system only.  On the site the reader can choose a
    scheme, so that the rules for dark colours are written once for each way to choose.
    """
    whole = page.partition("<style>")[2].partition("</style>")[0]
    own = whole.removeprefix(STYLE)
    colours = LIGHT.search(STYLE)
    assert colours is not None
    dark = [found["rules"] for text in (STYLE, own) for found in DARK.finditer(text)]
    rules = "".join(dark)
    return (
        f".live {{{colours['rules']}}}\n{DARK.sub('', own)}\n"
        f'body[data-theme="dark"] .live {{{rules}}}\n'
        "@media (prefers-color-scheme: dark) {\n"
        f'body:not([data-theme="light"]) .live {{{rules}}}\n}}\n'
    )


def live(page: str) -> str:
    """Return the live part of a page: its markup, data and script."""
    markup, data = PARTS.search(page), DATA.search(page)
    assert markup is not None
    assert data is not None
    return f"{markup[0]}\n{data[0]}\n"


def plain(text: str) -> str:
    """Return a text as Markdown in which no character has a meaning."""
    return re.sub(r"([\\`*_{}\[\]()#+\-.!<>$~|&])", r"\\\1", " ".join(text.split()))


def families(mechanisms: list[Mechanism]) -> list[list[Mechanism]]:
    """Return mechanisms that differ by their flexure models together: the titles begin alike.

    The first mechanism of a family is the one whose title says that it is the first choice.
    """
    found: dict[str, list[Mechanism]] = {}
    for mechanism in mechanisms:
        found.setdefault(mechanism.title.partition(",")[0], []).append(mechanism)
    return [
        sorted(family, key=lambda m: "first choice" not in m.title) for family in found.values()
    ]


def family_card(family: list[Mechanism]) -> str:
    """Return the entry of mechanisms that differ by their flexure models, as HTML."""
    more = "".join(
        f'<li><a href="{other.name}.html">{other.name}</a>: '
        f"{html.escape(other.title.partition(',')[2].strip())}</li>\n"
        for other in family[1:]
    )
    variants = f'<ul class="variants">\n{more}</ul>\n' if more else ""
    return f'<div class="mechanism-family">\n{card(family[0])}\n{variants}</div>'


def card(mechanism: Mechanism) -> str:
    """Return the entry of a mechanism in the gallery, as HTML."""
    title, text = html.escape(mechanism.title), html.escape(first_sentences(mechanism.description))
    return (
        f'<a class="mechanism-card" href="{mechanism.name}.html">\n{drawing(mechanism)}\n'
        f'<span class="mechanism-name">{mechanism.name}</span>\n'
        f'<span class="mechanism-title">{title}</span>\n'
        f'<span class="mechanism-text">{text}</span>\n</a>'
    )


def first_sentences(text: str, longest: int = 190) -> str:
    """Return the first sentences of a text, at least one, up to a length.

    Examples
    --------
    >>> first_sentences("A guide. It moves.", 10)
    'A guide.'
    """
    sentences = re.split(r"(?<=[a-z0-9)]\.) (?=[A-Z])", " ".join(text.split()))
    result = sentences[0]
    for sentence in sentences[1:]:
        if len(result) + len(sentence) > longest:
            break
        result = f"{result} {sentence}"
    return result


def mechanism_page(mechanism: Mechanism, file: Path) -> str:
    """Return the page of a mechanism: description, live part, drawing and mechanism file."""
    name, fence = mechanism.name, "`" * 4
    return f"""---
hide-toc: true
---

# {name}

**{plain(mechanism.title)}.** {plain(mechanism.description)}

```{{raw}} html
:file: {name}.part.html
```

`prbm explore {name}` writes <a href="../{ALONE}/{name}.html">this page as one file</a>, with the
equations and all variables. `prbm build {name}` builds its FMUs.

## Mechanism file

{fence}toml
{file.read_text(encoding="utf-8")}{fence}
"""


def gallery_page(mechanisms: list[Mechanism]) -> str:
    """Return the page of the gallery, with an entry for each family of mechanisms."""
    cards = "\n".join(map(family_card, families(mechanisms)))
    names = "\n".join(mechanism.name for mechanism in mechanisms)
    return f"""---
hide-toc: true
---

# Gallery

The shipped mechanisms, from their release on. Each page simulates its mechanism in the browser:
drag a wall or the released body, change a parameter, look at the modes. This needs no installation
and no network.

```{{raw}} html
<div class="gallery">
{cards}
</div>
```

```{{toctree}}
:hidden:
{names}
```
"""


def write(sources: Path, extra: Path) -> None:
    """Write the gallery.

    Parameters
    ----------
    sources : Path
        Source folder of the site, which gets the pages of the gallery and the style sheet.
    extra : Path
        Folder that is copied to the site, which gets the pages of ``prbm explore``.

    Raises
    ------
    PrbmError
        If there is no WebAssembly module and no compiler for it.
    """
    folder, alone, static = sources / FOLDER, extra / ALONE, sources / "static"
    for path in (folder, alone, static):
        path.mkdir(parents=True, exist_ok=True)
    mechanisms = []
    for name, file in shipped().items():
        mechanism = load(name)
        mechanisms.append(mechanism)
        page = explorer(mechanism)
        (alone / f"{name}.html").write_text(page, encoding="utf-8")
        (folder / f"{name}.part.html").write_text(live(page), encoding="utf-8")
        text = mechanism_page(mechanism, file)
        (folder / f"{name}.md").write_text(text, encoding="utf-8")
    (folder / "index.md").write_text(gallery_page(mechanisms), encoding="utf-8")
    (static / "live.css").write_text(style(page), encoding="utf-8")
