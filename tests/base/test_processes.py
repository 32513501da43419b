"""Work in several processes."""

import os

import pytest

from prbm.base.errors import PrbmError
from prbm.base.processes import executor, process_count


@pytest.mark.parametrize("processes", [1, 2])
def test_results_and_errors_of_tasks_return(processes):
    with executor(processes) as pool:
        tasks = [pool.submit(int, text) for text in ("1", "2", "3")]
        assert [task.result() for task in tasks] == [1, 2, 3]
    with pytest.raises(ValueError, match="invalid literal"), executor(processes) as pool:
        pool.submit(int, "x").result()


def test_a_process_that_ends_early_is_reported():
    with pytest.raises(PrbmError, match="ended early"), executor(2) as pool:
        pool.submit(os._exit, 1).result()


def test_there_are_at_most_as_many_processes_as_tasks():
    assert process_count(1) == 1
    assert process_count(3, 2) == 2


@pytest.mark.parametrize("given", [None, "3"])
def test_processes_use_one_thread_unless_the_environment_sets_another_number(monkeypatch, given):
    monkeypatch.delenv("OPENBLAS_NUM_THREADS", raising=False)
    if given:
        monkeypatch.setenv("OPENBLAS_NUM_THREADS", given)
    with executor(2) as pool:
        assert pool.submit(os.getenv, "OPENBLAS_NUM_THREADS").result() == (given or "1")
    assert os.getenv("OPENBLAS_NUM_THREADS") == given
