"""The kernel computes the same bytes with every compiler, level of optimization and platform."""

import pytest

from builds import BUILDS, FMU_BUILD, digest
from prbm.files.mechanism_file import shipped

pytestmark = [pytest.mark.native, pytest.mark.slow]

STEPS = 250  # Most mechanisms hit a stop in these steps.  tests/compilers.py makes all steps.


@pytest.mark.parametrize("build", [name for name in BUILDS if "-O2" not in name])
def test_every_build_computes_the_same_bytes(build):
    found = {model: digest(model, build, STEPS) for model in shipped()}
    assert found == {model: digest(model, FMU_BUILD, STEPS) for model in shipped()}
