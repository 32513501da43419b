"""Pages that simulate their mechanism, in Chromium from a file."""

import json
import os
import zipfile
from dataclasses import replace
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from fmpy import simulate_fmu

from browser import NARROW, WIDE, chromium
from prbm.files.mechanism_file import load, shipped
from prbm.fmu.explorer import explorer
from prbm.fmu.native_fmu import build
from prbm.kernel.simulation import KernelSimulation
from prbm.mechanics.stress import with_stress
from prbm.runs.experiment import experiment
from support import ROOT, SUPPORT, mechanism

pytestmark = [pytest.mark.native, pytest.mark.slow]

HOSTILE = "</script><script>document.title='taken'</script><img src=x onerror=\"document.title=1\">"
RUNS = 200
GROWTH_MAX = 2e6  # Bytes of memory after so many runs: some text of the page, but no run.


@pytest.fixture(scope="module")
def browser():
    pytest.importorskip("ziglang")
    with chromium() as started:
        yield started


def written(folder: Path, chosen) -> Path:
    path = folder / f"{chosen.name}.html"
    path.write_text(explorer(chosen), encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def guide(tmp_path_factory) -> Path:
    return written(tmp_path_factory.mktemp("page"), mechanism("PRBDM"))


def enter(browser, name: str, text: str) -> None:
    """Enter a number in the field of a quantity."""
    field = browser.find(f'input[data-name="{name}"]')
    browser.run("arguments[0].closest('details').open = true", field)
    field.clear()
    field.send_keys(text + "\n")


@pytest.mark.parametrize("model", shipped())
def test_the_page_of_an_fmu_gives_the_impacts_of_the_fmu_to_the_bit(browser, model, tmp_path):
    content = build(mechanism(model))
    (tmp_path / "model.fmu").write_bytes(content)
    with zipfile.ZipFile(BytesIO(content)) as archive:
        archive.extract("documentation/index.html", tmp_path)
    page = tmp_path / "documentation" / "index.html"
    data = browser.open(page)
    stops = [stop.name for stop in mechanism(model).stops]
    outputs = [f"{stop}.{name}" for stop in stops for name in ("impact_count", "impact_time")]
    result = simulate_fmu(str(tmp_path / "model.fmu"), output=outputs)
    assert data["state"] == "done"
    assert int(data["impacts"]) == sum(result[f"{stop}.impact_count"][-1] for stop in stops)
    assert json.loads(data["last"]) == {s: result[f"{s}.impact_time"][-1] for s in stops}
    assert {*browser.requests()} == {page.as_uri()}
    assert browser.errors() == []


def lever() -> str:
    """Return the mechanism file of the page that describes a lever."""
    blocks = (ROOT / "docs" / "describe-your-mechanism.md").read_text().split("```")
    return "".join(block.removeprefix("toml\n") for block in blocks if block.startswith("toml\n"))


OTHERS = {
    "finger": SUPPORT / "finger.toml",
    "pivot": SUPPORT / "pivot.toml",
    "accelerometer": ROOT / "benchmarks" / "accelerometer.toml",
}


@pytest.mark.parametrize("name", ["lever", *OTHERS])
def test_mechanisms_that_are_not_shipped_can_be_explored(browser, name, tmp_path):
    path = tmp_path / f"{name}.toml"
    path.write_text(OTHERS[name].read_text() if name in OTHERS else lever())
    data = browser.open(written(tmp_path, load(str(path))))
    assert data["state"] == "done"
    assert browser.errors() == []


def test_dragging_a_wall_shows_new_impacts(browser, guide):
    actions = pytest.importorskip("selenium.webdriver").ActionChains
    first = browser.open(guide)

    def drag() -> None:
        grip = browser.find(".wall-handle .grip")
        moves = actions(browser.driver).move_to_element(grip).click_and_hold()
        moves.move_by_offset(-30, 0).release().perform()

    assert browser.changed(drag)["last"] != first["last"]
    position = browser.run("return location.hash")
    assert position.startswith("#stop.position=-0.0")
    again = browser.open(guide, position)
    assert again["impacts"] == browser.run("return document.documentElement.dataset.impacts")
    assert "stop.position" in browser.run("return location.hash")


def test_the_keyboard_changes_walls_views_and_the_film(browser, guide):
    keys = pytest.importorskip("selenium.webdriver").Keys
    first = browser.open(guide)
    moved = browser.changed(lambda: browser.find(".wall-handle").send_keys(keys.ARROW_LEFT))
    assert moved["last"] != first["last"]
    browser.find("#tab-motion").send_keys(keys.ARROW_RIGHT)
    assert browser.find("#modes").is_displayed()
    assert browser.run("return document.activeElement.id") == "tab-modes"
    browser.find("#tab-modes").send_keys(keys.ARROW_LEFT)
    browser.find("#scrub").send_keys(keys.HOME)
    assert browser.find("#clock").text.startswith("0")


def test_the_space_key_starts_the_film_only_if_it_has_the_focus(browser, guide):
    actions = pytest.importorskip("selenium.webdriver").ActionChains
    browser.open(guide, prefers_reduced_motion="reduce")
    browser.find("body").send_keys(" ")
    assert browser.find("#play").text == "Play"
    browser.run("document.getElementById('stage').focus()")
    actions(browser.driver).send_keys(" ").perform()
    assert browser.find("#play").text == "Pause"


def test_the_handle_of_a_wall_is_beside_the_body_that_touches_the_wall(browser, guide):
    browser.open(guide, prefers_reduced_motion="reduce")
    browser.run(
        "const scrub = document.getElementById('scrub'); scrub.value = scrub.max;"
        "scrub.dispatchEvent(new Event('input'))"
    )
    side = "return document.querySelector(arguments[0]).getBoundingClientRect()[arguments[1]]"
    body = browser.run(side, "#stage .body", "right")
    assert browser.run(side, ".wall-handle .grip", "left") > body


def test_the_head_of_the_parameters_shows_impacts_beside_the_changed_field(browser, guide):
    browser.open(guide, size=NARROW, prefers_reduced_motion="reduce")
    data = browser.changed(lambda: enter(browser, "flexure.length", "35"))
    assert browser.find("#brief").text.startswith(f"Impacts: {data['impacts']} ")
    place = "const box = document.getElementById('brief').getBoundingClientRect();"
    assert browser.run(f"{place} return box.top >= 0 && box.bottom < innerHeight")


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("stop.restitution", "2", "stop.restitution = 2 must be at most 1"),
        ("stop.restitution", "much", "stop.restitution = nan must be a finite number"),
        ("flexure.thickness", "-1", "flexure.thickness"),
        ("stop.position", "-25", "the wall stop is penetrated"),
    ],
)
def test_an_invalid_number_gives_the_message_of_the_kernel(browser, guide, name, text, words):
    first = browser.open(guide)
    enter(browser, name, text)
    assert words in browser.message()
    assert browser.run("return document.documentElement.dataset.last") == first["last"]
    data = browser.changed(lambda: browser.find("#reset").click())
    assert (browser.message(), data["last"]) == ("", first["last"])


@pytest.mark.parametrize(
    ("fragment", "words"),
    [
        ("#stop.restitution=9", "must be at most 1"),
        ("#stop.position=NaN", "must be a finite number"),
        ("#<img src=x>=1&wrong=2", "unknown parameter"),
        ("#%zz=%&stop.restitution=", "must be a finite number"),
    ],
)
def test_a_wrong_link_gives_a_message_and_the_default_run(browser, guide, fragment, words):
    default = browser.open(guide)
    data = browser.open(guide, fragment)
    assert words in browser.message()
    assert data["last"] == default["last"]


def test_the_saved_table_has_the_values_of_the_native_library(browser, guide, tmp_path):
    folder = {"behavior": "allow", "downloadPath": str(tmp_path)}
    browser.open(guide)
    browser.driver.execute_cdp_cmd("Browser.setDownloadBehavior", folder)
    browser.find("#download").click()
    browser.wait(lambda data: (tmp_path / "PRBDM.csv").exists())
    found = np.genfromtxt(tmp_path / "PRBDM.csv", delimiter=",", names=True, deletechars="")
    simulation = KernelSimulation(mechanism("PRBDM"))
    names = ["shuttle.x", "energy.elastic", "stop.impact_count"]
    expected = np.array(simulation.sample(found["time"][1:], names))
    assert np.array_equal(np.array([found[name][1:] for name in names]).T, expected)


def test_the_saved_table_has_the_stress_and_its_peaks(browser, tmp_path):
    chosen = with_stress(mechanism("GuideBeam"))
    page, folder = written(tmp_path, chosen), {"behavior": "allow", "downloadPath": str(tmp_path)}
    assert browser.open(page)["state"] == "done"
    browser.driver.execute_cdp_cmd("Browser.setDownloadBehavior", folder)
    browser.find("#download").click()
    browser.wait(lambda data: (tmp_path / "GuideBeam.csv").exists())
    found = np.genfromtxt(tmp_path / "GuideBeam.csv", delimiter=",", names=True, deletechars="")
    outputs = ("stress_start", "stress_end", "stress", "peak_stress", "peak_stress_position")
    names = [f"left_flexure.{name}" for name in outputs]
    expected = np.array(KernelSimulation(chosen).sample(found["time"][1:], names))
    assert np.array_equal(np.array([found[name][1:] for name in names]).T, expected)
    assert expected[:, 3].max() > 1e8
    assert "cut off" not in browser.find(".plot:last-of-type .keys").text
    assert browser.errors() == []


def peak_before_impact(chosen, changes: dict[str, float]) -> float:
    """Return the largest stress at the last communication point before the first impact [Pa]."""
    names = [f"{flexure.name}.peak_stress" for flexure in chosen.flexures]
    simulation, step, k = KernelSimulation(with_stress(chosen), changes), experiment(chosen).step, 0
    simulation.record = []
    while not simulation.record:
        outputs, k = simulation.outputs(), k + 1
        simulation.advance(k * step)
    return max(outputs[name] for name in names)


def headline(browser) -> dict[str, str]:
    """Return the entries of the headline."""
    script = "return [...document.querySelectorAll('#headline div')].map((d) => d.innerText)"
    return dict(entry.split("\n") for entry in browser.run(script))


def test_the_page_shows_stress_yield_strength_and_contact_force_of_any_mechanism(browser, tmp_path):
    """The wall is near the release: the stress of the 2R is much larger after the first impact."""
    plain, changes = mechanism("PRBDM2R"), {"stop.position": -0.0117}
    kinds = tuple(replace(kind, yield_strength=1e9) for kind in plain.flexure_types)
    chosen = replace(plain, flexure_types=kinds)
    path = tmp_path / "page.html"
    path.write_text(explorer(chosen, changes), encoding="utf-8")
    assert browser.open(path)["state"] == "done"
    titles = browser.run(
        "return [...document.querySelectorAll('.plot h3')].map((h) => h.innerText)"
    )
    assert titles[-2:] == ["Contact force at rest", "Stress"]
    keys = browser.find(".plot:last-of-type .keys").text.split("\n")
    assert keys[:-1] == ["left flexure", "right flexure", "yield strength 1000\u202fMPa"]
    flexures = [f"{flexure.name}.stress" for flexure in chosen.flexures]
    run = experiment(chosen)
    times = run.step * np.arange(1, round(run.stop_time / run.step) + 1)
    stress = np.array(KernelSimulation(with_stress(chosen), changes).sample(times, flexures))
    cut = keys[-1].removeprefix("peaks to ").removesuffix("\u202fMPa cut off")
    assert float(cut) == pytest.approx(1e-6 * stress.max(), rel=5e-3)
    peak = peak_before_impact(chosen, changes)
    shown, factor = headline(browser)["Peak stress before impact"].split(", safety factor ")
    assert float(shown.removesuffix("\u202fMPa")) == pytest.approx(1e-6 * peak, rel=5e-3)
    assert float(factor) == pytest.approx(1e9 / peak, rel=5e-3)
    assert browser.errors() == []


def test_texts_with_markup_are_shown_as_text(browser, tmp_path):
    chosen = mechanism("PRBDM")
    geometry = tuple(replace(p, description=HOSTILE) for p in chosen.geometry)
    data = browser.open(
        written(tmp_path, replace(chosen, title=HOSTILE, description=HOSTILE, geometry=geometry))
    )
    assert data["state"] == "done"
    assert browser.run("return document.title") == chosen.name
    assert browser.run("return document.images.length") == 0
    assert HOSTILE in browser.run("return document.getElementById('fields').textContent")


def test_memory_does_not_grow_over_many_runs(browser, guide):
    browser.open(guide, prefers_reduced_motion="reduce")
    used = "gc(); return performance.memory.usedJSHeapSize"

    def runs(count: int) -> None:
        for k in range(count):
            text = str(0.3 + 0.3 * (k % 7) / 7)
            browser.changed(lambda text=text: enter(browser, "stop.restitution", text))

    runs(5)
    before = browser.run(used)
    runs(RUNS)
    assert browser.run(used) - before < GROWTH_MAX


def test_without_motion_the_film_does_not_start(browser, guide):
    browser.open(guide, prefers_reduced_motion="reduce")
    assert browser.find("#play").text == "Play"


@pytest.mark.parametrize("size", [WIDE, NARROW])
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_accessibility_rules_find_nothing_serious(browser, guide, size, scheme):
    """The rules are those of axe-core, whose script the environment variable AXE names."""
    script = os.environ.get("AXE")
    if script is None:
        pytest.skip("the environment variable AXE does not name the file axe.min.js")
    browser.open(guide, size=size, prefers_color_scheme=scheme)
    browser.run(Path(script).read_text(encoding="utf-8"))
    found = browser.driver.execute_async_script("axe.run().then(arguments[0])")
    serious = [v for v in found["violations"] if v["impact"] in ("serious", "critical")]
    assert [(v["id"], [n["target"] for n in v["nodes"]]) for v in serious] == []
    width = browser.run("return document.documentElement.scrollWidth - window.innerWidth")
    assert width <= 0
