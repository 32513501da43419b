"""Rainflow counting, Goodman's line, Basquin's law and safety factors."""

import math
from dataclasses import replace

import numpy as np
import pytest

import prbm
from prbm.analysis.strength import (
    Cycle,
    cycles,
    cycles_to_failure,
    damage,
    loadings,
    reversed_amplitude,
    with_stress,
)
from prbm.mechanism.parts import FlexureType
from prbm.runs.run import simulate

STEEL = FlexureType(
    "leaf", "2R", 1e-4, 8e-3, 2e11, 7800.0, yield_strength=1e9, tensile_strength=1.2e9,
    fatigue_strength=4e8, fatigue_cycles=1e7,
)  # fmt: skip


def test_fully_reversed_history_gives_its_amplitude_and_zero_mean():
    t = np.linspace(0.0, 10.0, 4001)
    found = cycles(250.0 * np.sin(2 * np.pi * t))
    whole = [cycle for cycle in found if cycle.amplitude > 200.0]
    assert sum(cycle.count for cycle in whole) == pytest.approx(9.5, abs=0.51)
    for cycle in whole:
        assert cycle.amplitude == pytest.approx(250.0, rel=1e-6)
        assert cycle.mean == pytest.approx(0.0, abs=1e-6)


def test_cycles_are_those_of_the_example_of_the_standard():
    """ASTM E1049-85, example of rainflow counting: the ranges and their numbers of cycles."""
    counted: dict[float, float] = {}
    for cycle in cycles([-2.0, 1.0, -3.0, 5.0, -1.0, 3.0, -4.0, 4.0, -2.0]):
        counted[2 * cycle.amplitude] = counted.get(2 * cycle.amplitude, 0.0) + cycle.count
    assert counted == {3.0: 0.5, 4.0: 1.5, 6.0: 0.5, 8.0: 1.0, 9.0: 0.5}


def test_life_is_that_of_the_example_of_the_textbook():
    """Shigley's example of 1050 steel: 90 kpsi, endurance limit 45 kpsi, f = 0.86, at 55 kpsi."""
    life = cycles_to_failure(55.0, 90.0, 45.0, 1e6, knee=0.86)
    assert life == pytest.approx(77500.0, rel=0.01)
    assert cycles_to_failure(64.6, 90.0, 45.0, 1e6, knee=0.86) == pytest.approx(1e4, rel=0.02)


def test_life_passes_both_points_of_the_material():
    assert cycles_to_failure(0.9 * 1.2e9, 1.2e9, 4e8, 1e7) == pytest.approx(1e3)
    assert cycles_to_failure(4e8, 1.2e9, 4e8, 1e7) == pytest.approx(1e7)
    assert cycles_to_failure(0.0, 1.2e9, 4e8, 1e7) == math.inf
    assert cycles_to_failure(1e-30, 1.2e9, 4e8, 1e7) == math.inf


def test_tensile_mean_shortens_the_life_and_compressive_mean_does_not():
    assert reversed_amplitude(1e8, 6e8, 1.2e9) == pytest.approx(2e8)
    assert reversed_amplitude(1e8, -6e8, 1.2e9) == 1e8
    assert reversed_amplitude(1e8, 1.3e9, 1.2e9) == math.inf


def test_damage_of_whole_cycles_is_their_number_over_the_life():
    history = [4e8, -4e8] * 50 + [4e8]
    assert damage(history, STEEL) == pytest.approx(50 / 1e7, rel=1e-9)
    assert damage(history, replace(STEEL, fatigue_strength=None)) is None


def test_damage_of_three_blocks_is_that_of_the_problem_of_the_textbook():
    """Shigley, 8th edition, problem 6-30: steel of 76 kpsi with an endurance limit of 30 kpsi.

    It survives 4,000 reversed cycles of 48 kpsi, then 60,000 of 38 kpsi, then 209,160 of 32 kpsi.
    A hundredth of each block has a hundredth of the damage.
    """
    steel = replace(
        STEEL, yield_strength=None, tensile_strength=76.0, fatigue_strength=30.0, fatigue_cycles=1e6
    )
    for amplitude, life in ((48.0, 19_460), (38.0, 137_880), (32.0, 582_150)):
        assert cycles_to_failure(amplitude, 76.0, 30.0, 1e6) == pytest.approx(life, rel=1e-3)
    blocks = [(48.0, 40), (38.0, 600), (32.0, 2092)]
    history = [x for amplitude, count in blocks for x in [amplitude, -amplitude] * count]
    assert damage(history, steel) == pytest.approx(0.01, rel=5e-3)


def test_half_cycles_count_half():
    assert cycles([0.0, 1.0, 2.0]) == [Cycle(1.0, 1.0, 0.5)]


def test_safety_factor_is_the_yield_strength_over_the_peak():
    guide = with_stress(prbm.load("PRBDM2R"))
    strong = {"yield_strength": 1.2e9, "tensile_strength": 1.5e9}
    strong |= {"fatigue_strength": 5e8, "fatigue_cycles": 1e7}
    kinds = tuple(replace(kind, **strong) for kind in guide.flexure_types)
    result = simulate(replace(guide, flexure_types=kinds), stop_time=0.1)
    found = loadings(result.columns, result.mechanism)
    assert [one.flexure for one in found] == ["left_flexure", "right_flexure"]
    for one in found:
        assert one.peak >= result[f"{one.flexure}.stress"].max() * (1 - 1e-9)
        assert one.safety == pytest.approx(1.2e9 / one.peak)
        assert one.damage is not None
        assert 0.0 < one.damage < 1e-3
