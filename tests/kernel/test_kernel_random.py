"""The C kernel moves random mechanisms as the engine does: loops, joints, walls on bodies."""

import numpy as np
import pytest

from kernel_simulation import KernelSimulation
from prbm.fmu.python_fmu import interface
from prbm.hybrid.simulation import Simulation
from random_mechanisms import inputs, seeded

SPAN, LOOKS = 4e-3, 4  # s; hits, rest and sticking come within it
FEW, MANY = range(12), range(12, 120)
SAME = 1e-5  # of a nominal; roundings grow on the way, and a hit turns time into speed
COUNTED = ("impact_count", "contact")


def deviations(seed):
    """Return by how much the two differ, in units of nominals; what is counted is equal."""
    mechanism = seeded(seed)
    values = inputs(mechanism, seed)
    engine, kernel = Simulation(mechanism, values), KernelSimulation(mechanism, values)
    nominal = {v.name: v.nominal or 1.0 for v in interface(mechanism, {})}
    result = {}
    for t in np.linspace(0.0, SPAN, LOOKS + 1):
        engine.advance(t)
        kernel.advance(t)
        expected, found = engine.outputs(), kernel.outputs()
        assert expected.keys() <= found.keys()
        for name, x in expected.items():
            if name.endswith(COUNTED):
                assert found[name] == x, (name, t)
            if name.endswith("modal_restitution") and expected["mode.frequency"] == 0.0:
                continue  # what swings without a spring has no fundamental mode of its own
            scale = max(nominal[name], abs(x))
            result[name] = max(result.get(name, 0.0), abs(found[name] - x) / scale)
    return result


@pytest.mark.parametrize(
    "seed", [*FEW, *(pytest.param(seed, marks=pytest.mark.slow) for seed in MANY)]
)
def test_the_kernel_moves_a_random_mechanism_as_the_engine_does(seed):
    off = deviations(seed)
    worst = max(off, key=off.__getitem__)
    assert off[worst] <= SAME, (worst, off[worst])
