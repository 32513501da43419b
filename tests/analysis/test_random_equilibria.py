"""Paths of equilibria of random mechanisms, and motions after a kick in their stable shapes."""

import pytest

from random_equilibria import Findings, check


@pytest.mark.slow
@pytest.mark.parametrize("first", range(0, 60, 20))
def test_paths_name_their_ends_and_stable_shapes_keep_a_kicked_motion(first):
    """``python tests/support/random_equilibria.py`` checks 2,000 mechanisms."""
    findings = Findings()
    for seed in range(first, first + 20):
        check(seed, findings)
    assert findings.failures == []
    assert findings.kicked >= 10
