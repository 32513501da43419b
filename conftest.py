"""Names that are defined in every doctest, and the garbage collection of a test run."""

import gc
from pathlib import Path

import numpy as np
import pytest

GARBAGE_THRESHOLD = (
    50_000  # Objects between two collections; Python's 700 take a third of the time.
)
SUPPORT = Path(__file__).parent / "tests" / "support"

# Assertions of modules that tests import are executed also if Python's optimization is on.
pytest.register_assert_rewrite(*(path.stem for path in SUPPORT.iterdir() if path.suffix != ".toml"))
gc.disable()  # Until all tests are collected: imported modules and tests are not garbage.


def pytest_collection_finish():
    """Enable the garbage collection for the objects of the tests only."""
    gc.freeze()
    gc.set_threshold(GARBAGE_THRESHOLD)
    gc.enable()


@pytest.fixture(autouse=True)
def _numpy_in_doctests(doctest_namespace):
    """Define ``np``."""
    doctest_namespace["np"] = np
