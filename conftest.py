"""Names that are defined in every doctest, and the garbage collection of a test run."""

import gc

import numpy as np
import pytest

GARBAGE_THRESHOLD = (
    50_000  # Objects between two collections; Python's 700 take a third of the time.
)
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
