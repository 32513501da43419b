"""The kernel computes the same bytes with every compiler, level of optimization and platform."""

import pytest

from builds import BUILDS, FMU_BUILD, digest
from prbm.files.mechanism_file import shipped

pytestmark = [pytest.mark.native, pytest.mark.slow]

STEPS = 250  # Most mechanisms hit a stop in these steps.  tests/compilers.py makes all steps.
LEVELS = ("x86_64-linux gcc -O0", "x86_64-linux clang -O0")
"""Builds at another level than that of FMUs; tests/compilers.py has all levels everywhere."""
CHOSEN = [name for name in BUILDS[1:] if name in LEVELS or not name.endswith(("-O0", "-O2"))]


@pytest.mark.parametrize("build", CHOSEN)
def test_every_build_computes_the_same_bytes(build):
    found = {model: digest(model, build, STEPS) for model in shipped()}
    assert found == {model: digest(model, FMU_BUILD, STEPS) for model in shipped()}
