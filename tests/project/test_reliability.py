"""Short runs of the campaign in ``docs/reliability.md``."""

import re

import pytest

from c_importer import ANVIL, COMPLIANT, needs
from reliability import (
    calls,
    draws,
    faults,
    hostile,
    python_calls,
    readers,
    states,
    texts,
    threads,
    versions,
)
from reliability.driver import drive
from reliability.report import Part

pytestmark = pytest.mark.native

QUICK = [ANVIL, COMPLIANT, "PRBDM2R"]
OFFLINE = re.compile("NewConnectionError|NameResolutionError|ConnectTimeoutError|ProxyError")


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["cs", "events", "clock", "me"])
def test_arbitrary_calls_give_true_values_or_errors(kind):
    for model in QUICK:
        found = calls.called(model, 3, kind, 10_000, 0, sanitize=False)
        assert found["calls"] >= 10_000
        assert found["illegal"] > 20
        assert found.violations() == {}, found.details


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "found"),
    [("cs", {"penetrated", "energy_lost", "over_budget"}), ("me", {"penetrated", "over_budget"})],
)
def test_oracles_report_penetration_energy_and_cost(kind, found):
    """With limits that no FMU satisfies, each oracle reports violations.

    Across events of model exchange the balance changes by round-off, which is not judged.
    """
    limits = {"gap_atol": -1.0, "energy_rtol": -1.0, "energy_factor": 0.0, "call_seconds": 0.0}
    counts = drive(ANVIL, 2, kind, "calls", count=4, size=40, **limits)
    assert set(counts.violations()) == found


@pytest.mark.slow
def test_arbitrary_calls_of_a_python_fmu_give_true_values_or_errors():
    caller = python_calls.called("PRBDM2R", 60, 1)
    assert caller.wrong == []
    assert caller.steps > 10
    assert caller.rejected > 3


@pytest.mark.slow
def test_oracles_of_python_fmus_report_penetration_energy_and_values(monkeypatch):
    monkeypatch.setattr(python_calls, "GAP_ATOL", -1.0)
    monkeypatch.setattr(python_calls, "ENERGY_RTOL", -1.0)
    found = python_calls.called("PRBDM", 20, 1).wrong
    assert any("gap" in line for line in found)
    assert any("the balance changed" in line for line in found)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["cs", "me"])
def test_damaged_states_are_rejected_or_give_finite_values(kind):
    drawn = drive(ANVIL, 3, kind, "states", count=2, size=states.TRIALS)
    assert drawn["restored"] + drawn["undone"] == 2 * states.TRIALS
    assert drawn["undone"] >= 2 * states.TRIALS * 3 // 4
    assert drawn.violations() == {}, drawn.details


@pytest.mark.slow
@pytest.mark.parametrize("model", ["PRBDM2R", "Cantilever"])
def test_drawn_parameters_run_or_are_rejected(model):
    found = draws.drawn(model, 40)
    assert found.classes["wrong"] == 0, found.wrong
    assert found.classes["ran"] > 0
    assert found.classes["rejected"] > 0


@pytest.mark.parametrize("name", ["TOML", "CSV", "LVM", "units"])
def test_changed_texts_are_read_or_rejected(name):
    part = texts.run(100, seed=1, names=[name])
    assert part.failures == []


@pytest.mark.slow
@pytest.mark.parametrize("name", ["DXF", "SVG"])
def test_changed_drawings_are_read_or_rejected(name):
    assert texts.run(4000, seed=1, names=[name]).failures == []


@pytest.mark.slow
def test_changed_packages_are_read_or_rejected():
    assert texts.run(500, names=["SSP"]).failures == []


@pytest.mark.slow
@pytest.mark.skipif(not faults.available(), reason="faults are injected on Linux only")
@pytest.mark.parametrize("name", ["build", "simulate", "study", "compile"])
def test_files_are_old_or_new_after_a_fault_at_a_write(name):
    found = faults.searched(name, 3)
    assert found["failures"] == []
    assert found["faults"] >= 6


def slow_but(fast, names):
    """Return parameters that are marked as slow, but for one."""
    return [pytest.param(name, marks=[] if name == fast else pytest.mark.slow) for name in names]


@pytest.mark.slow
@pytest.mark.skipif(not faults.available(), reason="links, pipes and devices of Linux")
@pytest.mark.parametrize("name", hostile.COMMANDS)
def test_links_pipes_and_devices_lose_nothing(name):
    runs, wrong = hostile.attacked(name)
    assert wrong == []
    assert runs >= len(hostile.PLACED)


@pytest.mark.skipif(not faults.available(), reason="links and devices of Linux")
@pytest.mark.parametrize("name", slow_but("mechanism", readers.COMMANDS))
def test_devices_folders_and_broken_links_are_refused_as_files(name):
    assert readers.attacked(name) == []


@pytest.mark.slow
@pytest.mark.skipif(not faults.available(), reason="needs a compiler")
def test_several_writers_leave_one_complete_file():
    assert faults.two_writers() == []


@pytest.mark.slow
@pytest.mark.skipif(not faults.available(), reason="needs a compiler")
@pytest.mark.parametrize("case", ["no compiler", "unprivileged user", "read-only home"])
def test_commands_run_without_rights_or_explain_the_failure(case):
    assert faults.without_rights(case) == []


@pytest.mark.slow
def test_instances_in_threads_have_no_data_races():
    needs("cc")
    for fmi, kind in calls.INTERFACES:
        assert threads.races(ANVIL, fmi, kind, 4) == ""


@pytest.mark.slow
def test_lowest_versions_of_dependencies_export_and_simulate():
    """The first environment of the campaign is that of the oldest Python."""
    if versions.python(versions.ENVIRONMENTS[0][0]) is None:
        pytest.skip(f"needs Python {versions.ENVIRONMENTS[0][0]}")
    part = versions.run(1)
    if any(OFFLINE.search(line) for line in part.failures):
        pytest.skip("no connection to the index of packages")
    assert part.failures == []
    assert len(part.rows) == 1


def test_tables_have_a_row_of_sums():
    part = Part("title", ("name", "count", "text"))
    part.add("one", 1000, "x")
    part.add("two", 2, "y")
    part.total()
    assert part.table().splitlines()[-1] == "| all | 1,002 |  |"
