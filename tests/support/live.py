"""The kernel of live pages in Node, for the tests."""

import base64
import json
import shutil
import subprocess
from functools import cache
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

import pytest

import prbm.fmu.live
from prbm.fmu.export import Export
from prbm.fmu.live.content import content
from prbm.fmu.native_fmu import described
from prbm.interface.tables import slots, tables
from prbm.kernel.compiler import browser_module
from prbm.mechanism.description import Mechanism
from prbm.runs.experiment import experiment

SCRIPTS = Path(prbm.fmu.live.__file__).parent
HOST = Path(__file__).with_name("live_host.js")
SECONDS_MAX = 300  # A run of the slowest shipped mechanism takes a few seconds.


@cache
def module_file() -> Path:
    """Return a file with the WebAssembly module; skip the test without ziglang."""
    pytest.importorskip("ziglang")
    path = Path(mkdtemp(prefix="prbm_live_")) / "live.wasm"
    path.write_bytes(browser_module())
    return path


def node(*arguments: str | Path, text: str = "") -> str:
    """Run a script in Node, and return its output; skip the test without Node."""
    program = shutil.which("node")
    if program is None:
        pytest.skip("node is not installed")
    done = subprocess.run(
        [program, *arguments], input=text, capture_output=True, text=True, timeout=SECONDS_MAX
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def simulated(mechanism: Mechanism, names: list[str], **job: Any) -> dict[str, Any]:
    """Simulate the default experiment of a mechanism in Node, as a page does.

    ``names`` are the outputs of which the last values are returned.  See live_host.js for further
    items of the job and the result.
    """
    native = described(Export(mechanism), 3)
    default = experiment(mechanism)
    slot = slots(mechanism, native.independent)
    changes = [[slot[name], str(x)] for name, x in job.pop("changes", {}).items()]
    table = tables(mechanism, native.variables, "", native.independent, default.step)
    whole = {
        "tables": base64.b64encode(table).decode(),
        "slots": [slot[name] for name in names],
        "steps": round(default.stop_time / default.step),
        "step": default.step,
        "changes": changes,
        "content": content(mechanism, native.variables, native.independent, default),
    }
    text = node(HOST, SCRIPTS, module_file(), text=json.dumps(whole | job))
    result: dict[str, Any] = json.loads(text)
    return result
