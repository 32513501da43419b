"""Random mechanisms with loops, joints and walls on bodies: the C kernel equals the engine."""

import re

import numpy as np
import pytest

from kernel_simulation import KernelMistake, KernelSimulation
from prbm.base.errors import SimulationError
from prbm.fmu.start import interface
from prbm.hybrid.simulation import Simulation
from random_mechanisms import inputs, seeded

SPAN, COMPARISONS = 4e-3, 4  # Duration [s] and number of comparisons.
SLOW_SEEDS = (4, 5, *range(12, 48))
SEEDS = [seed for seed in range(12) if seed not in SLOW_SEEDS]
DEVIATION_MAX = 1e-4  # Relative to the nominal value; impacts amplify rounding errors.
COUNTED = ("impact_count", "contact")
PEAKS = ("peak_stress", "peak_stress_time", "peak_stress_position")
PEAK_RTOL = 1e-2  # Largest of the samples at the ends of steps, whose lengths vary by round-off.


def deviations(seed, **parts):
    """Return the largest deviation of each output over its nominal; check that counts are equal."""
    mechanism = seeded(seed, **parts)
    values = inputs(mechanism, seed)
    engine, kernel = Simulation(mechanism, values), KernelSimulation(mechanism, values)
    nominal = {v.name: v.nominal or 1.0 for v in interface(mechanism, {})}
    result = {}
    for t in np.linspace(0.0, SPAN, COMPARISONS + 1):
        try:
            engine.advance(t)
        except SimulationError as error:  # Friction along guides may jam.
            with pytest.raises(KernelMistake, match=re.escape(str(error).partition(" at t")[0])):
                kernel.advance(t)
            return {"time": 0.0}
        kernel.advance(t)
        expected, found = engine.outputs(), kernel.outputs()
        assert expected.keys() <= found.keys()
        for name, x in expected.items():
            if name.endswith(COUNTED):
                assert found[name] == x, (name, t)
            if name.endswith("modal_restitution") and expected["mode.frequency"] == 0.0:
                continue  # A body that swings without a spring has no unique fundamental mode.
            if name.endswith(PEAKS):
                assert found[name] == pytest.approx(x, rel=PEAK_RTOL, abs=1e-3) or name.endswith(
                    PEAKS[1:]
                )
                continue
            scale = max(nominal[name], abs(x))
            result[name] = max(result.get(name, 0.0), abs(found[name] - x) / scale)
    return result


@pytest.mark.parametrize("free", [False, True])
@pytest.mark.parametrize(
    "seed", [*SEEDS, *(pytest.param(seed, marks=pytest.mark.slow) for seed in SLOW_SEEDS)]
)
def test_the_kernel_computes_the_motion_of_a_random_mechanism_as_the_engine_does(seed, free):
    found = deviations(seed, free=free)
    worst = max(found, key=found.__getitem__)
    assert found[worst] <= DEVIATION_MAX, (worst, found[worst])


@pytest.mark.parametrize("free", [False, True])
@pytest.mark.parametrize(
    "seed", [*range(6), *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(6, 24))]
)
def test_the_kernel_moves_random_mechanisms_with_guides_as_the_engine_does(seed, free):
    found = deviations(seed, free=free, springs=seed % 3, guides=2)
    worst = max(found, key=found.__getitem__)
    assert found[worst] <= DEVIATION_MAX, (worst, found[worst])


SPRUNG_SEEDS = [*range(4), *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(4, 12))]


@pytest.mark.parametrize("seed", SPRUNG_SEEDS)
def test_the_kernel_moves_random_mechanisms_with_torsion_as_the_engine_does(seed):
    found = deviations(seed, bodies=4, torsion=True)
    worst = max(found, key=found.__getitem__)
    assert found[worst] <= DEVIATION_MAX, (worst, found[worst])


@pytest.mark.parametrize("free", [False, True])
@pytest.mark.parametrize("seed", SPRUNG_SEEDS)
def test_the_kernel_moves_random_mechanisms_with_springs_as_the_engine_does(seed, free):
    found = deviations(seed, free=free, springs=3)
    worst = max(found, key=found.__getitem__)
    assert found[worst] <= DEVIATION_MAX, (worst, found[worst])
