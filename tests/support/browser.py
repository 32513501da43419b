"""Chromium without a window, for the tests of pages."""

import json
import os
import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

SECONDS_MAX, RULES_SECONDS_MAX = 120.0, 300.0
WIDE, NARROW = (1360, 900), (390, 800)


@contextmanager
def chromium() -> Iterator["Browser"]:
    """Start Chromium; skip the test if it, its driver or Selenium is not installed."""
    webdriver = pytest.importorskip("selenium.webdriver")
    programs = [shutil.which(name) for name in ("chromium", "chromedriver")]
    if None in programs:
        pytest.skip("chromium or its driver is not installed")
    options = webdriver.ChromeOptions()
    options.binary_location = programs[0]
    for switch in ("headless=new", "no-sandbox", "disable-dev-shm-usage", "js-flags=--expose-gc"):
        options.add_argument(f"--{switch}")
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    driver = webdriver.Chrome(options, webdriver.ChromeService(programs[1]))
    try:
        yield Browser(driver)
    finally:
        driver.quit()


class Browser:
    """A page in Chromium."""

    def __init__(self, driver: Any) -> None:
        self.driver = driver

    def open(
        self, path: Path, fragment: str = "", size: tuple[int, int] = WIDE, **features: str
    ) -> dict[str, str]:
        """Open a page and wait for its first simulation; return the data of its root element."""
        self.view(path, fragment, size, **features)
        return self.wait(lambda data: data.get("state") in ("done", "error"))

    def view(
        self, path: Path, fragment: str = "", size: tuple[int, int] = WIDE, **features: str
    ) -> None:
        """Open a page."""
        media = [{"name": name.replace("_", "-"), "value": x} for name, x in features.items()]
        screen = {"width": size[0], "height": size[1], "deviceScaleFactor": 1, "mobile": False}
        self.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": media})
        self.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", screen)
        self.driver.get("about:blank")
        for kind in ("browser", "performance"):
            self.driver.get_log(kind)
        self.driver.get(path.as_uri() + fragment)

    def run(self, script: str, *arguments: object) -> Any:
        """Run a script in the page and return its result."""
        return self.driver.execute_script(script, *arguments)

    def check_accessibility(self) -> None:
        """Assert that axe-core finds nothing serious, and that the page does not scroll sideways.

        Skip the test if the environment variable AXE does not name the script of axe-core.
        """
        script = os.environ.get("AXE")
        if script is None:
            pytest.skip("the environment variable AXE does not name the file axe.min.js")
        self.driver.set_script_timeout(RULES_SECONDS_MAX)
        self.run(Path(script).read_text(encoding="utf-8"))
        found = self.driver.execute_async_script("axe.run().then(arguments[0])")
        serious = [v for v in found["violations"] if v["impact"] in ("serious", "critical")]
        assert [(v["id"], [n["target"] for n in v["nodes"]]) for v in serious] == []
        width = self.run("return document.documentElement.scrollWidth - window.innerWidth")
        assert width <= 0

    def wait(self, ready: Any) -> dict[str, str]:
        """Wait until the data of the root element satisfy a condition; return them."""
        end = time.monotonic() + SECONDS_MAX
        while time.monotonic() < end:
            data: dict[str, str] = self.run("return {...document.documentElement.dataset}")
            if ready(data):
                return data
            time.sleep(0.02)
        raise TimeoutError(f"the page does not get ready: {data}")

    def changed(self, action: Any) -> dict[str, str]:
        """Do something that starts a simulation, and wait for its end; return the data."""
        runs = int(self.run("return document.documentElement.dataset.runs"))
        action()
        return self.wait(lambda data: data["state"] == "done" and int(data["runs"]) > runs)

    def find(self, selector: str) -> Any:
        """Return an element."""
        return self.driver.find_element("css selector", selector)

    def message(self) -> str:
        """Return the message that the page shows."""
        return str(self.run("return document.getElementById('message').textContent"))

    def requests(self) -> list[str]:
        """Return the addresses that have been requested since the page was opened."""
        events = [json.loads(e["message"])["message"] for e in self.driver.get_log("performance")]
        sent = [e["params"] for e in events if e["method"] == "Network.requestWillBeSent"]
        return [p["request"]["url"] for p in sent]

    def errors(self) -> list[str]:
        """Return the messages of the console since the page was opened."""
        return [entry["message"] for entry in self.driver.get_log("browser")]
