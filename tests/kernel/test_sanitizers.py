"""The library under sanitizers and valgrind: runs, many instances, arbitrary calls and tables."""

import dataclasses

import numpy as np
import pytest

from c_importer import PLAIN, Job, described, kernel_library, native, needs, run
from fuzzing import (
    ENVIRONMENT,
    MODELS,
    fuzz_calls,
    fuzz_tables,
    sanitized_importer,
    sanitized_library,
    search_calls,
)

pytestmark = [pytest.mark.native, pytest.mark.slow]

INTERFACES = ((2, "cs"), (3, "cs"), (3, "events"), (2, "me"), (3, "me"))
POINTS = 1e-3 * np.arange(301)  # s; the default experiment bounces until 0.243 s, then rests.
VALGRIND = ("valgrind", "--quiet", "--error-exitcode=9", "--leak-check=full")


def changes(model: str) -> dict[int, dict[str, float]]:
    """Return changes of inputs and tunable parameters, by number of the communication step."""
    guide = described(model)
    stop, force, friction = (
        parts[0].name for parts in (guide.stops, guide.forces, guide.frictions)
    )
    return {
        20: {f"{force}.x": 0.3, "base.acceleration.y": 2.0},
        60: {f"{stop}.displacement": 1e-3},
        80: {f"{stop}.restitution": 0.9, "damping.zeta": 0.05, f"{friction}.coefficient": 0.3},
        90: {f"{friction}.normal_force": 0.2, f"{stop}.friction": 0.3},
    }


def sanitized(job: Job, *words: object) -> bytes:
    """Run a job with sanitizers in the importer; errors and leaks fail the test."""
    done = run(job, *words, program=sanitized_importer(), environment=ENVIRONMENT)
    assert not done.errors
    return done.output


@pytest.mark.parametrize(("fmi", "kind"), INTERFACES)
@pytest.mark.parametrize("model", MODELS)
def test_sanitizers_find_nothing_in_a_run_with_changes(model, fmi, kind):
    """The results with sanitizers equal those without bit by bit."""
    job = Job(native(model, fmi), kind, POINTS, changes=changes(model))
    checked = dataclasses.replace(job, library=sanitized_library())
    assert sanitized(checked) == run(job).output


@pytest.mark.parametrize(("fmi", "kind"), INTERFACES)
def test_sanitizers_find_nothing_when_states_are_saved_and_restored(fmi, kind):
    job = Job(native("PRBDM", fmi), kind, POINTS[:101], library=sanitized_library())
    for how in ("save", "serialize"):
        sanitized(job, "interrupt", 50, how)


@pytest.mark.parametrize("fmi", [2, 3])
def test_sanitizers_find_nothing_in_hundreds_of_instances(fmi):
    job = Job(native("PRBDM2R", fmi), "cs", POINTS, library=sanitized_library())
    sanitized(job, "cycles", 300, 1)
    sanitized(job, "threads", 4)


def test_sanitizers_find_nothing_in_ten_thousand_instances():
    for fmi in (2, 3):
        for kind in ("cs", "me"):
            job = Job(native("PRBDM", fmi), kind, POINTS, library=sanitized_library())
            sanitized(job, "cycles", 2500, 1)


@pytest.mark.parametrize(("fmi", "kind"), INTERFACES)
def test_valgrind_finds_nothing(fmi, kind):
    """A run to the first impact, a restored state, and a hundred instances.

    A leak of one instance is found; the sanitizers create ten thousand.
    """
    needs("valgrind")
    library = kernel_library(*PLAIN)
    job = Job(native("PRBDM2R", fmi), kind, POINTS[:61], library=library)
    for words in ((), ("interrupt", 30, "serialize"), ("cycles", 100, 0)):
        assert not run(job, *words, before=VALGRIND).errors


@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize("model", MODELS)
def test_arbitrary_calls_neither_crash_nor_leak(tmp_path, model, fmi):
    found = fuzz_calls(tmp_path, model, fmi, sequences=60, seed=0)
    assert found.status == 0, found.output


def test_arbitrary_tables_neither_crash_nor_leak(tmp_path):
    """A part of the changed tables is accepted and simulated; otherwise little is tested."""
    found = fuzz_tables(tmp_path, seconds=2, seed=0)
    assert found.status == 0, found.output[-8000:]
    tried, accepted, started = found.table_counts()
    assert accepted > tried / 20
    assert started > tried / 20


@pytest.mark.parametrize("fmi", [2, 3])
def test_a_search_for_calls_that_crash_finds_none(tmp_path, fmi):
    found = search_calls(tmp_path, "PRBDM", fmi, seconds=15, seed=0)
    assert found.status == 0, found.output[-8000:]


def test_a_search_for_tables_that_crash_finds_none(tmp_path):
    found = fuzz_tables(tmp_path, seconds=30, seed=1)
    assert found.status == 0, found.output[-8000:]
