"""Random mechanisms with parts of all kinds obey the laws of :mod:`random_motions`."""

import pytest

from random_motions import Findings, judge

SEEDS = (9, 11, 22)
# The last ones start on a spring's free length, by a repeated mode, and on guides that might push
# to either side.  Or they have a mode of little energy, a spring of constant length, little energy
# beside the scale, contacts that stick together, a dead centre, or attempts that are left out.
FURTHER_SEEDS = (
    *range(23, 44), 299, 439, 605, 1057, 1336, 1569,
    620, 645, 623, 646, 1032, 1119, 1412, 1571, 366,
)  # fmt: skip


@pytest.mark.native
@pytest.mark.parametrize(
    "seed",
    [
        *SEEDS,
        *(pytest.param(seed, marks=pytest.mark.slow) for seed in FURTHER_SEEDS),
    ],
)
def test_a_random_mechanism_obeys_the_laws_of_motion_in_both_engines(seed):
    findings = Findings()
    judge(seed, findings)
    assert not findings.failures
    assert findings.results
