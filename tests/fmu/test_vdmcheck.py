"""The rules of FMI in VDMCheck, a formal model by the INTO-CPS Association.

The variable ``VDMCHECK`` is the folder with its scripts ``VDMCheck2.sh`` and ``VDMCheck3.sh``.
"""

import os
import subprocess
from pathlib import Path

import pytest

from compliant_pivot import two_compliant_stops
from coupled import guide
from prbm.fmu import native_fmu
from prbm.fmu.python_fmu import build as build_python_fmu
from prbm.systems.container import container
from support import mechanism, selected

pytestmark = [
    pytest.mark.fmu, pytest.mark.native, pytest.mark.slow,
    pytest.mark.skipif("VDMCHECK" not in os.environ, reason="needs the variable VDMCHECK"),
]  # fmt: skip
SOUND = "No errors found."
fmis = pytest.mark.parametrize("fmi", [2, 3])


def verdict(fmu: Path, fmi: int) -> str:
    script = Path(os.environ["VDMCHECK"]) / f"VDMCheck{fmi}.sh"
    done = subprocess.run([script, fmu], capture_output=True, text=True, check=False)
    return done.stdout.strip() + done.stderr.strip()


@fmis
@pytest.mark.parametrize("model", selected(lambda name: True))
def test_each_mechanism_obeys_the_rules(native, model, fmi):
    assert verdict(native[model, fmi], fmi) == SOUND


@fmis
def test_stress_and_compliant_stops_obey_the_rules(fmi, tmp_path):
    fmu = tmp_path / "pivot.fmu"
    fmu.write_bytes(native_fmu.build(two_compliant_stops(), {}, fmi))
    assert verdict(fmu, fmi) == SOUND


@pytest.mark.parametrize("inner", [2, 3])
@pytest.mark.parametrize("outer", [2, 3])
def test_a_container_obeys_the_rules(outer, inner, tmp_path):
    path = tmp_path / "guides.fmu"
    shown = ["b.shuttle.x", "b.stop.impact_count", "b.stop.contact"]
    fmus = {"a": guide(inner), "b": guide(inner)}
    container(path, fmus, {"b.stop.displacement": "a.shuttle.x"}, 1e-3, {}, shown, outer, 0.1)
    assert verdict(path, outer) == SOUND


def test_output_clocks_obey_the_rules(tmp_path):
    fmu = tmp_path / "clock.fmu"
    fmu.write_bytes(native_fmu.build(mechanism("PRBDM"), {}, 3, clock=True))
    assert verdict(fmu, 3) == SOUND


def test_the_python_fmu_obeys_the_rules(tmp_path):
    fmu = tmp_path / "python.fmu"
    fmu.write_bytes(build_python_fmu(mechanism("PRBDM")))
    assert verdict(fmu, 2) == SOUND
