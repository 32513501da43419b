"""Settings of the documentation site, which ``python docs/build_site.py`` builds with Sphinx."""

import os
import sys
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE / "website"), str(HERE.parent / "fmu_src")]

from prbm.base.version import __version__  # noqa: E402  The folder of the package is set above.

project = "prbm-impact"
version = release = __version__
author = "The authors of prbm-impact"
extensions = [
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.napoleon",
    "myst_nb",
    "formulas",
]
exclude_patterns = ["static", "**/*.part.html"]

# Pages in Markdown and notebooks with their stored outputs, which tests compare.
nb_execution_mode = "off"
nb_merge_streams = True
myst_enable_extensions = ["colon_fence", "dollarmath"]
myst_fence_as_directive = ["math"]
myst_heading_anchors = 4

autodoc_typehints = "none"
autodoc_preserve_defaults = True
autodoc_member_order = "bysource"
napoleon_google_docstring = False
napoleon_use_rtype = False
python_use_unqualified_type_names = True
toc_object_entries_show_parents = "hide"

html_theme = "furo"
html_title = f"prbm-impact {version}"
html_math_renderer = "mathml"
html_show_sourcelink = html_copy_source = False
html_show_sphinx = html_show_copyright = False
html_favicon = str(HERE / "website" / "static" / "logo.svg")
html_css_files = ["live.css", "site.css"]
html_js_files = ["site.js"]
html_theme_options = {
    "light_logo": "logo.svg",
    "dark_logo": "logo.svg",
    "light_css_variables": {
        "color-brand-primary": "#1c5f9f",
        "color-brand-content": "#1c5f9f",
    },
    "dark_css_variables": {
        "color-brand-primary": "#7fbcf5",
        "color-brand-content": "#7fbcf5",
    },
}

# Links to edit a page, if the address of the repository is known (see hatch_build.py).
server, repository = (os.environ.get(f"GITHUB_{name}", "") for name in ("SERVER_URL", "REPOSITORY"))
address = os.environ.get("PRBM_REPOSITORY") or (f"{server}/{repository}" if repository else "")
if address:
    html_theme_options |= {"source_repository": f"{address}/", "source_branch": "main"}


def without_edit_link(
    app: Any, page: str, template: str, context: dict[str, Any], tree: Any
) -> None:
    """Omit the link of a page that is made from other files."""
    suffix = context.get("page_source_suffix") or ""
    if page == "index" or not (HERE.parent / f"{page}{suffix}").is_file():
        context.pop("page_source_suffix", None)


def setup(app: Any) -> None:
    """Connect the function above."""
    app.connect("html-page-context", without_edit_link)
