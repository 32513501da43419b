"""Pages that simulate their mechanism, in Chromium from a file."""

import json
import threading
import zipfile
from dataclasses import replace
from http.server import BaseHTTPRequestHandler, HTTPServer
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from fmpy import simulate_fmu

from browser import NARROW, WIDE, chromium
from guides import cart
from prbm.files.mechanism_file import load, read_mechanism, shipped
from prbm.fmu import native_fmu, python_fmu
from prbm.fmu.explorer import explorer
from prbm.fmu.native_fmu import build
from prbm.kernel.compiler import NoCompilerError
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


def test_the_policy_of_a_page_forbids_all_that_is_added_to_it(browser, guide, tmp_path):
    """A script, a handler, a style, an image, a frame and a form do nothing and request nothing."""
    asked: list[str] = []

    class Server(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            asked.append(self.path)
            self.send_error(404)

    with HTTPServer(("127.0.0.1", 0), Server) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        try:
            _try_additions(browser, guide, tmp_path, f"http://127.0.0.1:{server.server_port}")
        finally:
            server.shutdown()
    assert asked == []


def _try_additions(browser, guide, tmp_path, site) -> None:
    added = (
        "<script>document.title = 'taken'</script>"
        f"<img src='{site}/x.png' onerror=\"document.title = 'taken'\">"
        f"<script src='{site}/x.js'></script><iframe src='{site}/'></iframe>"
        "<style>body { display: none }</style><p id='shown' style='display: none'>text</p>"
        f"<form id='form' action='{site}/'></form>"
    )
    page = tmp_path / "page.html"
    text = guide.read_text(encoding="utf-8").replace("</body>", f"{added}</body>")
    page.write_text(text, encoding="utf-8")
    data = browser.open(page)
    assert data["state"] == "done"
    assert browser.run("return document.title") == "PRBDM"
    assert browser.run("return document.getElementById('shown').offsetHeight") > 0
    browser.run("document.getElementById('form').submit()")
    assert browser.run("return location.protocol") == "file:"
    assert sum("Content Security Policy" in message for message in browser.errors()) >= 6


def test_a_download_is_possible_under_the_policy(browser, guide):
    browser.open(guide)
    browser.find("#download").click()
    assert browser.errors() == []


@pytest.mark.parametrize("flavour", ["python", "without a module"])
def test_a_static_page_keeps_its_style_and_has_no_script(browser, flavour, tmp_path, monkeypatch):
    def missing(*_: object) -> bytes:
        raise NoCompilerError("no ziglang")

    monkeypatch.setattr(native_fmu, "browser_module", missing)
    chosen = mechanism("PRBDM")
    content = python_fmu.build(chosen) if flavour == "python" else build(chosen)
    with zipfile.ZipFile(BytesIO(content)) as archive:
        archive.extract("documentation/index.html", tmp_path)
    browser.view(tmp_path / "documentation" / "index.html")
    assert "script-src" not in (tmp_path / "documentation/index.html").read_text("utf-8")
    assert browser.run("return getComputedStyle(document.body).maxWidth") != "none"
    assert browser.errors() == []


@pytest.mark.parametrize("size", [(1400, 900), (400, 800)])
def test_each_entry_of_the_headline_is_one_line(browser, size, tmp_path):
    """A compliant stop adds the peak force: seven entries."""
    guide = mechanism("PRBDM2R")
    stop = replace(guide.stops[0], law="compliant", stiffness=1e6)
    browser.open(written(tmp_path, replace(guide, stops=(stop,))), size=size)
    heights = browser.run(
        "return [...document.querySelectorAll('#headline dd')].map((entry) => entry.offsetHeight)"
    )
    assert len(heights) == 7
    assert len({*heights}) == 1


def lever() -> str:
    """Return the mechanism file of the page that describes a lever."""
    blocks = (ROOT / "docs" / "describe-your-mechanism.md").read_text(encoding="utf-8").split("```")
    return "".join(block.removeprefix("toml\n") for block in blocks if block.startswith("toml\n"))


OTHERS = {
    "finger": SUPPORT / "finger.toml",
    "pivot": SUPPORT / "pivot.toml",
    "accelerometer": ROOT / "benchmarks" / "accelerometer.toml",
}


def test_springs_and_guides_are_drawn(browser, tmp_path):
    data = browser.open(written(tmp_path, cart()))
    assert data["state"] == "done"
    assert browser.errors() == []
    drawn = browser.run("return document.querySelector('#stage .spring').getAttribute('d')")
    assert drawn.count("M") == len(cart().springs) + len(cart().guides)


@pytest.mark.parametrize("name", ["lever", *OTHERS])
def test_mechanisms_that_are_not_shipped_can_be_explored(browser, name, tmp_path):
    path = tmp_path / f"{name}.toml"
    path.write_text(
        OTHERS[name].read_text(encoding="utf-8") if name in OTHERS else lever(), encoding="utf-8"
    )
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


@pytest.mark.parametrize(
    ("model", "key", "across", "down"),
    [("FoldedSuspension", "ARROW_RIGHT", 1, 0), ("Bistable", "ARROW_DOWN", 0, 1)],
)
def test_arrow_keys_move_handles_in_their_direction(browser, tmp_path, model, key, across, down):
    """The stops face right, down and up."""
    keys = pytest.importorskip("selenium.webdriver").Keys
    browser.open(written(tmp_path, mechanism(model)), prefers_reduced_motion="reduce")
    script = (
        "const box = document.querySelectorAll('.handle .grip')[arguments[0]]"
        ".getBoundingClientRect(); return [box.x, box.y]"
    )
    handles = browser.driver.find_elements("css selector", ".handle")
    for k, handle in enumerate(handles):
        before = np.array(browser.run(script, k))
        browser.changed(lambda handle=handle: handle.send_keys(getattr(keys, key)))
        moved = np.array(browser.run(script, k)) - before
        assert moved @ [across, down] > 0.1


def test_the_keyboard_moves_to_the_time_of_an_impact(browser, guide):
    keys = pytest.importorskip("selenium.webdriver").Keys
    browser.open(guide, prefers_reduced_motion="reduce")
    browser.find("#impacts tbody tr").send_keys(keys.ARROW_DOWN)
    focus = browser.driver.switch_to.active_element
    focus.send_keys(keys.ENTER)
    number, time = focus.text.split()[:2]
    assert number == "2"
    shown = browser.find("#clock").text.split("\u202f")[0]
    assert 1e3 * float(shown) == pytest.approx(float(time), rel=1e-3)


def test_impacts_that_the_table_omits_are_counted(browser, guide):
    data = browser.open(
        guide, "#stop.restitution=0.98&stop.rest_speed=1e-6&release.displacement=-1e-5"
    )
    rows = browser.find("#impacts").text.split("\n")
    assert int(data["impacts"]) > 200
    assert rows[-1] == f"The first 200 of {data['impacts']} impacts."


def test_rigid_links_are_offered_only_if_flexures_have_them(browser, guide, tmp_path):
    browser.open(guide)
    assert browser.find("#show-links").is_displayed()
    browser.open(written(tmp_path, mechanism("GuideBeam")))
    assert not browser.find("#show-links").is_displayed()


def test_notches_that_fill_their_flexures_are_drawn_with_their_ground(browser, tmp_path):
    """The flexures are 10 mm long, as two radii."""
    page = written(tmp_path, mechanism("NotchGuide"))
    browser.open(page, "#notch.notch_radius=0.005", prefers_reduced_motion="reduce")
    assert browser.message() == ""
    for tab in ("#tab-motion", "#tab-modes"):
        browser.find(tab).click()
        paths = browser.run(
            "return [...document.querySelectorAll('#stage .flexure, #stage .ground')]"
            ".map((path) => path.getAttribute('d'))"
        )
        assert len(paths) == 5
        assert all(path and "NaN" not in path for path in paths)


@pytest.mark.parametrize("size", [(1366, 640), NARROW])
def test_the_drawing_and_its_controls_are_in_view_together(browser, guide, size):
    browser.open(guide, size=size, prefers_reduced_motion="reduce")
    span = (
        "const [drawing, controls] = arguments[0].map((id) => document.querySelector(id)"
        ".getBoundingClientRect()); return [drawing.top, controls.bottom]"
    )
    for tab, controls in (("#tab-motion", "#transport"), ("#tab-modes", ".mode-list")):
        browser.find(tab).click()
        top, bottom = browser.run(span, ["#stage", controls])
        assert 0 <= top < bottom <= size[1]


def test_modes_say_how_bodies_move_and_about_which_position(browser, tmp_path):
    page = written(tmp_path, replace(mechanism("PRBDM2R"), gravity=(0.0, 0.0)))
    browser.open(page, prefers_reduced_motion="reduce")
    browser.find("#tab-modes").click()
    text = browser.find("#modes").text
    assert "shuttle 100\u202f% (x)" in text
    assert "about the rest position under gravity, without stops." in text


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


def test_a_number_may_have_the_unit_that_the_field_shows(browser, guide):
    browser.open(guide)
    browser.changed(lambda: enter(browser, "flexure.length", "35 mm"))
    assert browser.run("return location.hash") == "#flexure.length=0.035"
    enter(browser, "flexure.length", "3.5 cm")
    assert "flexure.length: \u201c3.5 cm\u201d is not a number in mm." in browser.message()


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("stop.restitution", "2", "stop.restitution = 2 must be at most 1"),
        ("stop.restitution", "1e999", "stop.restitution = inf must be a finite number"),
        ("stop.restitution", "50 %", "\u201c50 %\u201d is not a number without a unit."),
        (
            "flexure.thickness",
            "much",
            "flexure.thickness: \u201cmuch\u201d is not a number in \u00b5m.",
        ),
        ("flexure.thickness", "", "flexure.thickness: an empty field is not a number in \u00b5m."),
        ("flexure.thickness", "-1", "flexure.thickness"),
        ("stop.position", "-25", "the wall stop is penetrated"),
    ],
)
@pytest.mark.parametrize("size", [(1366, 640), NARROW])
def test_an_invalid_number_is_marked_beside_the_message(browser, guide, size, name, text, words):
    """The message about the wall does not name the parameter."""
    first = browser.open(guide, size=size, prefers_reduced_motion="reduce")
    enter(browser, name, text)
    assert words in browser.message()
    assert browser.find("#problem").text == browser.message()
    assert not browser.find("#brief").is_displayed()
    marked = browser.driver.find_elements("css selector", '[aria-invalid="true"]')
    assert [field.get_attribute("data-name") for field in marked] == [name]
    boxes = [
        browser.run("return arguments[0].getBoundingClientRect().toJSON()", node)
        for node in (browser.find("#problem"), marked[0])
    ]
    assert 0 <= boxes[0]["top"] < boxes[0]["bottom"] <= boxes[1]["top"]
    assert boxes[1]["bottom"] <= size[1]
    assert browser.run("return document.documentElement.dataset.last") == first["last"]
    data = browser.changed(lambda: browser.find("#reset").click())
    assert (browser.message(), data["last"]) == ("", first["last"])
    assert browser.find("#brief").is_displayed()
    assert browser.driver.find_elements("css selector", "[aria-invalid]") == []


def test_a_second_invalid_number_restores_the_field_of_the_first(browser, guide):
    browser.open(guide)
    enter(browser, "stop.restitution", "much")
    enter(browser, "flexure.length", "more")
    values = [
        browser.find(f'input[data-name="{name}"]').get_property("value")
        for name in ("stop.restitution", "flexure.length")
    ]
    assert values == ["0.6", "more"]


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


def test_the_headline_has_the_largest_contact_force_of_compliant_stops_only(browser, tmp_path):
    """The first contact, the hardest one, lies between two communication points."""
    plain = mechanism("GuideBeam")
    assert browser.open(written(tmp_path, plain))["state"] == "done"
    assert "Peak force" not in headline(browser)
    stop = replace(plain.stops[0], law="compliant", stiffness=6e7)
    chosen = replace(plain, name="GuidePad", stops=(stop,))
    assert browser.open(written(tmp_path, chosen))["state"] == "done"
    simulation = KernelSimulation(chosen)
    simulation.record = []
    simulation.advance(experiment(chosen).stop_time)
    expected = max(impact.latched.peak_force for impact in simulation.record)
    value, unit = headline(browser)["Peak force"].split("\u202f")
    assert float(value) * {"kN": 1e3, "N": 1.0}[unit] == pytest.approx(expected, rel=5e-4)
    titles = browser.find("#impacts thead").text
    assert all(title in titles for title in ("Peak force", "Indentation", "Duration"))
    assert browser.errors() == []


def test_the_headline_counts_a_contact_that_has_not_ended(browser, tmp_path):
    """The soft pad does not let the body go: its last contact is not in the table."""
    plain = mechanism("GuideBeam")
    stop = replace(plain.stops[0], law="compliant", stiffness=1.0)
    data = browser.open(written(tmp_path, replace(plain, name="SoftPad", stops=(stop,))))
    shown = headline(browser)
    assert shown["Impacts"] == data["impacts"]
    assert int(data["impacts"]) > int(browser.find("#impacts").text.split("\n")[-1].split()[0])
    time = 1e3 * json.loads(data["last"])["stop"]
    assert float(shown["Last impact"].split("\u202f")[0]) == pytest.approx(time, rel=1e-3)


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


# Thick flexures without damping: about ten thousand impacts in the default run.
THOUSANDS_OF_IMPACTS = (
    "flexure.thickness=0.03&damping.zeta=0&damping.beta=0&stop.restitution=0.999"
    "&solver.tolerance=1e-12"
)


def test_a_slow_run_shows_its_progress_and_can_be_replaced(browser, guide):
    browser.view(guide, f"#{THOUSANDS_OF_IMPACTS}")
    browser.wait(lambda data: browser.find("#brief").text.startswith("Computing, "))
    data = browser.wait(lambda data: data["state"] == "running")
    assert "impacts" not in data
    browser.find("#reset").click()
    assert browser.wait(lambda data: data["state"] == "done")["impacts"] == "14"
    assert browser.find("#brief").text.startswith("Impacts: 14 ")


def test_numbers_are_those_of_the_whole_simulation_at_its_end(browser, guide):
    """The film plays meanwhile, and shows its numbers less often than its pictures."""
    browser.view(guide)
    browser.run(
        "window.briefs = []; const root = document.documentElement;"
        "new MutationObserver(() => root.dataset.state === 'done' &&"
        "  briefs.push([root.dataset.impacts, document.getElementById('brief').textContent])"
        ").observe(root, {attributeFilter: ['data-state']})"
    )
    browser.wait(lambda data: data["state"] == "done")
    for speed in ("0.3", "0.6", "0.9"):
        browser.changed(lambda speed=speed: enter(browser, "release.velocity", speed))
    briefs = browser.run("return briefs")
    assert len(briefs) >= 3
    for impacts, brief in briefs:
        assert brief.startswith(f"Impacts: {impacts} "), brief


def test_a_browser_without_a_needed_function_shows_the_remedy(browser, guide):
    source = {"source": "delete globalThis.DecompressionStream"}
    command = browser.driver.execute_cdp_cmd
    script = command("Page.addScriptToEvaluateOnNewDocument", source)
    assert browser.open(guide)["state"] == "error"
    command("Page.removeScriptToEvaluateOnNewDocument", script)
    text = browser.find("p.message").text
    assert "DecompressionStream" in text
    assert "current version of Chrome" in text
    assert not browser.find("#live").is_displayed()


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
def test_accessibility_rules_find_nothing_serious(browser, guide, tmp_path, size, scheme):
    for page in (guide, written(tmp_path, load(str(OTHERS["accelerometer"])))):
        browser.open(page, size=size, prefers_color_scheme=scheme)
        browser.check_accessibility()


# --- time, the run before, and the file's own parameters ------------------------------------------


def texts(browser, selector: str) -> list[str]:
    """Return the texts of elements."""
    script = "return [...document.querySelectorAll(arguments[0])].map((node) => node.textContent)"
    return list(browser.run(script, selector))


def test_a_duration_is_simulated_and_part_of_the_link(browser, guide):
    """The impacts are those of the default run before the new end."""
    whole = browser.open(guide)

    def entered(text):
        field = browser.find("#duration")
        field.clear()
        field.send_keys(text + "\n")

    shorter = browser.changed(lambda: entered("0.1 s"))
    assert 0 < int(shorter["impacts"]) < int(whole["impacts"])
    again = browser.open(guide, "#stop-time=0.1")
    assert again["impacts"] == shorter["impacts"]
    assert browser.run("return document.getElementById('duration').value") == "0.1"
    assert browser.driver.current_url.endswith("#stop-time=0.1")
    entered("-1")
    assert "not a positive number" in browser.message()


def test_the_time_axis_is_halved_by_each_zoom_and_follows_the_film(browser, guide):
    browser.open(guide, prefers_reduced_motion="reduce")
    ends = "return document.querySelector('canvas').getBoundingClientRect()"
    box = browser.run(ends)
    move = """
        const canvas = document.querySelector('canvas');
        const x = arguments[0];
        canvas.dispatchEvent(new PointerEvent('pointerdown', {clientX: x, pointerId: 1}));
    """
    browser.run("HTMLCanvasElement.prototype.setPointerCapture = () => {}")
    right = box["x"] + box["width"] - 12
    browser.run(move, right)
    assert texts(browser, "#clock") == ["1\u202fs"]
    browser.run(move, box["x"])
    browser.find("#closer").click()
    browser.find("#closer").click()
    browser.run(move, right)
    assert texts(browser, "#clock") == ["0.25\u202fs"]
    for _ in range(2):
        browser.find("#farther").click()
    assert not browser.find("#farther").is_enabled()


def test_the_run_before_a_change_is_drawn_until_it_is_hidden(browser, guide):
    """A shape of the first run, beside the shape of the changed one."""
    browser.open(guide, prefers_reduced_motion="reduce")
    drawn = "return [...document.querySelectorAll('.before')].map((n) => n.getAttribute('d') || '')"
    assert not any(browser.run(drawn))
    body = browser.run("return document.querySelector('.body').getAttribute('d')")
    browser.changed(lambda: enter(browser, "release.displacement", "-5"))
    assert body in browser.run(drawn)
    assert browser.run("return document.querySelector('.body').getAttribute('d')") != body
    browser.find("#show-before").click()
    assert not any(browser.run(drawn))


def test_parameters_of_the_file_come_first_and_move_a_wall_of_their_own(browser, tmp_path):
    """The wall follows the pointer: its position is 2 mm minus twice the parameter."""
    guide = mechanism("PRBDM")
    own = replace(guide.geometry[0], name="clearance", value=1e-3, minimum=-1.0, maximum=1.0)
    stop = replace(guide.stops[0], position="0.002 - 2*clearance")
    changed = replace(guide, geometry=(*guide.geometry, own), stops=(stop,))
    browser.open(written(tmp_path, changed), prefers_reduced_motion="reduce")
    first = texts(browser, "#fields details:first-child label")
    assert {*first} >= {"flexure.length", "clearance"}
    handle = browser.find(".wall-handle")
    assert handle.get_attribute("aria-label").endswith("clearance")
    place = "return document.querySelector('.wall-handle').getBoundingClientRect().x"
    before = browser.run(place)
    actions = pytest.importorskip("selenium.webdriver").ActionChains(browser.driver)
    browser.changed(lambda: actions.drag_and_drop_by_offset(handle, -20, 0).perform())
    assert browser.run(place) - before == pytest.approx(-20, abs=2)


def test_modes_stay_between_walls_or_the_walls_are_pale(browser, tmp_path):
    """Without gravity the rest position is in front of a wall; with it, beyond the wall."""
    guide = mechanism("PRBDM")
    free = replace(guide, gravity=(0.0, 0.0), stops=(replace(guide.stops[0], position=2e-3),))
    for chosen, crossing in ((free, False), (guide, True)):
        browser.open(written(tmp_path, chosen), prefers_reduced_motion="reduce")
        browser.find("#tab-modes").click()
        assert ("crossing" in browser.find("#live").get_attribute("class")) == crossing
        assert ("passes walls" in texts(browser, "#modes .hint")[0]) == crossing
        hit, wall = (
            browser.run(f"return document.querySelector('{part}').getBoundingClientRect()")
            for part in (".hit", ".wall")
        )
        assert (hit["x"] + hit["width"] / 2 <= wall["x"] + 1.5) != crossing


def test_flexures_have_the_colour_of_their_stress(browser, guide):
    """It falls from the released towards the straight shape, as the bending does."""
    browser.open(guide, prefers_reduced_motion="reduce")
    share = "return document.querySelector('.flexure').style.getPropertyValue('--stress')"
    seek = """
        const field = document.getElementById('scrub');
        field.value = arguments[0];
        field.dispatchEvent(new Event('input'));
    """
    found = []
    for time in (0, 20, 38):
        browser.run(seek, time)
        found.append(int(browser.run(share)[:-1]))
    assert 100 >= found[0] > found[1] > found[2]
    assert found[2] < 0.4 * found[0]
    assert "stress 0 to" in texts(browser, "#stress-key")[0]


def test_rotations_are_in_degrees(browser, tmp_path):
    """As the angle of the release: the first value of the plot is that of the field."""
    pivot = read_mechanism(ROOT / "fmu_src" / "prbm" / "files" / "templates" / "pivot.toml")
    browser.open(written(tmp_path, pivot), prefers_reduced_motion="reduce")
    field = browser.find('input[data-name="release.angle"]').get_attribute("value")
    assert texts(browser, ".plot .reading")[0] == f"{field.replace('-', chr(0x2212))}°"
