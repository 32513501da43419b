"""The built documentation site: addresses, gallery, front page, search, all without a network."""

import re
import subprocess
import sys
import time
from pathlib import Path

import pytest

import site_pages
from browser import NARROW, WIDE, chromium
from prbm.files.mechanism_file import load, shipped
from prbm.fmu.explorer import explorer
from shared import once
from support import ROOT

pytestmark = pytest.mark.slow

SECONDS_MAX = 300.0


def command(folder: Path) -> "subprocess.CompletedProcess[str]":
    """Run the documented command."""
    return subprocess.run(
        [sys.executable, "docs/build_site.py", folder],
        cwd=ROOT, capture_output=True, text=True, check=False,
    )  # fmt: skip


@pytest.fixture(scope="module")
def folder() -> Path:
    """Build the site; a warning ends the command with an error."""
    for module in ("sphinx", "myst_nb", "furo", "ziglang"):
        pytest.importorskip(module)

    def make(place: Path) -> None:
        done = command(place / "html")
        assert (done.returncode, done.stderr) == (0, "")

    return once("site", make) / "html"


@pytest.fixture(scope="module")
def built(folder) -> dict[Path, site_pages.Page]:
    return site_pages.pages(folder)


def test_all_addresses_of_the_site_lead_to_files_and_anchors(built):
    assert len(built) > 60
    assert list(site_pages.broken(built)) == []


def test_no_page_loads_anything_from_elsewhere(built, folder):
    loaded = {address for page in built.values() for address in page.loaded}
    assert {address for address in loaded if site_pages.outside(address)} == set()
    for path in folder.rglob("*.css"):
        assert re.findall(r"url\([\"']?(?:https?:)?//", path.read_text("utf-8")) == [], path


@pytest.mark.parametrize("name", shipped())
def test_the_gallery_has_the_page_of_each_mechanism(folder, name):
    page = (folder / "live" / f"{name}.html").read_text(encoding="utf-8")
    assert page == explorer(load(name))
    assert f'href="{name}.html"' in (folder / "gallery" / "index.html").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def browser():
    with chromium() as started:
        yield started


def shown(browser, page: Path, **options) -> dict[str, str]:
    """Open a page of the site that simulates; check its console and its requests."""
    data = browser.open(page, **options)
    assert data["state"] == "done"
    assert browser.errors() == []
    assert {address.partition(":")[0] for address in browser.requests()} <= {"file", "data"}
    return data


@pytest.mark.parametrize("name", shipped())
def test_each_gallery_page_simulates_its_mechanism(browser, folder, name):
    data = shown(browser, folder / "gallery" / f"{name}.html")
    alone = shown(browser, folder / "live" / f"{name}.html")
    assert (data["impacts"], data["last"]) == (alone["impacts"], alone["last"])


@pytest.mark.parametrize(("width", "columns"), [(1400, 2), (1920, 2), (400, 1)])
def test_the_plots_of_the_gallery_fill_their_rows(browser, folder, width, columns):
    """The last of five plots has a row of its own."""
    shown(browser, folder / "gallery" / "PRBDM2R.html", size=(width, 900))
    plots = browser.run(
        "return [...document.querySelectorAll('.plot')].map((plot) => [plot.offsetLeft,"
        " plot.offsetWidth, plot.parentElement.clientWidth])"
    )
    assert len(plots) == 5
    assert len({left for left, _, _ in plots}) == columns
    assert plots[-1][1] == plots[-1][2]


def test_long_commands_wrap(browser, folder):
    browser.view(folder / "docs" / "command-line.html", size=(1400, 900))
    boxes = browser.run(
        "return [...document.querySelectorAll('.highlight-sh pre')].map((box) => [box.scrollWidth,"
        " box.clientWidth])"
    )
    assert len(boxes) > 10
    assert all(needed <= width for needed, width in boxes)


@pytest.mark.parametrize("size", [WIDE, NARROW])
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_the_front_page_shows_a_running_mechanism_in_the_colours_of_the_reader(
    browser, folder, size, scheme
):
    colour = "return getComputedStyle(document.getElementById('live')).getPropertyValue('--card')"
    shown(browser, folder / "index.html", size=size, prefers_color_scheme=scheme)
    assert browser.find("#stage .body").is_displayed()
    assert not browser.find("#plots").is_displayed()
    first = browser.run(colour)
    other = {"light": "dark", "dark": "light"}[scheme]
    browser.run(f"document.body.dataset.theme = '{other}'")
    assert {first, browser.run(colour)} == {"#ffffff", "#18202a"}
    assert first == {"light": "#ffffff", "dark": "#18202a"}[scheme]
    width = browser.run("return document.documentElement.scrollWidth - window.innerWidth")
    assert width <= 0


@pytest.mark.parametrize(
    ("words", "page"),
    [
        ("rainflow", "docs/strength.html"),
        ("CurvedBistable", "gallery/CurvedBistable.html"),
        ("free_vibration", "api/data.html"),
    ],
)
def test_the_search_finds_pages_without_a_server(browser, folder, words, page):
    browser.driver.get(f"{(folder / 'search.html').as_uri()}?q={words}")
    script = "return [...document.querySelectorAll('#search-results li a')].map((a) => a.href)"
    end = time.monotonic() + SECONDS_MAX
    found: set[str] = set()
    while page not in found and time.monotonic() < end:  # The list is filled one by one.
        addresses = [re.split("[?#]", address)[0] for address in browser.run(script)]
        found = {address.removeprefix(folder.as_uri() + "/") for address in addresses}
        time.sleep(0.05)
    assert page in found


def test_formulas_are_mathml(browser, folder):
    browser.driver.get((folder / "docs" / "embedding.html").as_uri())
    boxes = browser.run("return [...document.querySelectorAll('math')].map((m) => m.clientHeight)")
    assert len(boxes) > 5
    assert min(boxes) > 0


def test_a_folder_of_other_files_is_not_replaced(tmp_path):
    (tmp_path / "mine.txt").write_text("kept", encoding="utf-8")
    done = command(tmp_path)
    assert done.returncode == 2
    assert "name another folder" in done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]


@pytest.mark.parametrize(("size", "scheme"), [(WIDE, "light"), (NARROW, "dark")])
@pytest.mark.parametrize(
    "page",
    ["index", "gallery/index", "docs/embedding", "api/index", "examples/notebooks/designer"],
)
def test_accessibility_rules_find_nothing_serious(browser, folder, page, size, scheme):
    browser.view(folder / f"{page}.html", size=size, prefers_color_scheme=scheme)
    browser.check_accessibility()
