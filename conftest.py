"""Names that are defined in every doctest."""

import numpy as np
import pytest


@pytest.fixture(autouse=True)
def _numpy_in_doctests(doctest_namespace):
    """Define ``np``."""
    doctest_namespace["np"] = np
