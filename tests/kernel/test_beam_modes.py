"""Beams in the kernel: linearised at rest, it has the rows of docs/flexure-models.md."""

import math
import re

import numpy as np
import pytest

from kernel_simulation import KernelSimulation
from prbm.analysis.flexure_models import with_flexures
from prbm.mechanics.assembly import assemble
from prbm.mechanics.inputs import input_names
from prbm.mechanics.statics import free_displacement
from support import ROOT, mechanism

PAGE = (ROOT / "docs" / "flexure-models.md").read_text(encoding="utf-8")
ROW = r"\| beam, order (\d), (\d) nodes(, axial)? \| (\d+) \((\d+)\) \| (.*) \|"
ROWS = re.findall(ROW, PAGE)


def linearised(kernel, inputs):
    """Return the derivatives of the accelerations by all states but the energies, (k, 2 k)."""
    states, slots = kernel.states, [*kernel.slots]
    count = (len(states) - 2) // 2
    rates = [slots.index(f"der({name})") for name in states[count : 2 * count]]
    columns = []
    for one in np.eye(len(states))[: 2 * count]:
        kernel.exchange_set(0.0, kernel.exchange_get())
        change = kernel.directional(np.ascontiguousarray(one), np.zeros(inputs))
        columns.append(change[rates])
    return np.array(columns).T


@pytest.mark.parametrize("row", ROWS, ids=lambda row: "-".join(row[:3]))
def test_beams_in_the_kernel_have_the_rest_position_and_frequencies_of_the_page(row):
    """The rates do not change at rest, and the eigenvalues of the derivatives are +-i omega."""
    order, nodes, axial, coordinates, free, numbers = row
    guide = with_flexures(
        mechanism("GuideBeam"), "beam", order=int(order), nodes=int(nodes), axial=bool(axial)
    )
    system = assemble(guide, guide.values())
    values = {
        "release.displacement": free_displacement(system), "stop.position": 0.05,
        "damping.beta": 0.0,
    }  # fmt: skip
    kernel = KernelSimulation(guide, values, exchange=True)
    k = (len(kernel.states) - 2) // 2
    assert (system.n, k) == (int(coordinates), int(free))
    assert np.abs(kernel.derivatives()[: 2 * k]).max() < 1e-4  # rad/s2
    lower = linearised(kernel, len(input_names(guide)))
    upper = np.hstack([np.zeros((k, k)), np.eye(k)])
    omega = np.linalg.eigvals(np.vstack([upper, lower])).imag
    found = [1e3 * kernel.get("shuttle.x"), *np.sort(omega[omega > 1.0])[:5] / (2 * math.pi)]
    for x, printed in zip(found, numbers.split(" | "), strict=True):
        assert format(x, f".{len(printed.partition('.')[2])}f") == printed


def test_the_page_has_beams_that_stretch_and_beams_that_do_not():
    assert {bool(row[2]) for row in ROWS} == {True, False}
    assert len(ROWS) >= 5
