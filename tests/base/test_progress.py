"""Progress of tasks that cannot report it."""

import io
import itertools
import threading

import pytest

from prbm.base import progress
from prbm.base.progress import CLEAR, waiting


class Terminal(io.StringIO):
    """A terminal; ``written`` is set when a remaining time is shown."""

    def __init__(self) -> None:
        super().__init__()
        self.written = threading.Event()

    def isatty(self) -> bool:
        return True

    def write(self, text: str) -> int:
        if "left" in text:
            self.written.set()
        return super().write(text)


@pytest.fixture(autouse=True)
def _at_once(monkeypatch):
    monkeypatch.setattr(progress, "DELAY", 0.0)


def test_the_remaining_time_is_shown_while_a_task_waits_and_removed_at_its_end():
    terminal, threads = Terminal(), threading.active_count()
    with waiting(100.0, terminal):
        terminal.written.wait()
    assert terminal.getvalue().endswith(CLEAR)
    assert threading.active_count() == threads


def test_the_line_is_removed_if_the_task_fails():
    terminal = Terminal()
    with pytest.raises(ZeroDivisionError), waiting(100.0, terminal):
        raise ZeroDivisionError
    assert terminal.getvalue().endswith(CLEAR)


def test_nothing_is_written_to_a_file():
    file = io.StringIO()
    with waiting(1.0, file):
        pass
    assert file.getvalue() == ""


def test_the_estimated_fraction_grows_and_stays_below_one():
    times = [0.1 * k for k in range(300)]
    found = [progress.estimated(t, 10.0) for t in times]
    assert all(a < b for a, b in itertools.pairwise(found))
    assert found[-1] < 1.0
