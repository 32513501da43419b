"""The branches of the kernel in trees with many of them."""

import dataclasses

import pytest

from kernel_library import KernelSystem
from many_parts import links_and_beams
from prbm.mechanics.assembly import assemble
from prbm.mechanism.parts import Body, FlexureType, Joint


def hung_bodies(count, links):
    """Return a mechanism whose last body, on a chain of links that stretch, carries many others."""
    mixed = links_and_beams()
    one, two, three = mixed.flexures
    chain = FlexureType("chain", "nR", 1e-4, 8e-3, 1.8e11, 7800.0, n=links, axial=True)
    top = mixed.bodies[-1].points["end"]
    hung = tuple(Body(f"bob_{i}", 1e-3, 1e-8, (0.04, 0.01 * i), {"top": top}) for i in range(count))
    joints = tuple(Joint(f"pin_{i}", "tip.end", f"bob_{i}.top") for i in range(count))
    return dataclasses.replace(
        mixed,
        flexure_types=(*mixed.flexure_types, chain),
        flexures=(one, two, dataclasses.replace(three, type="chain")),
        bodies=(*mixed.bodies, *hung),
        joints=(*mixed.joints, *joints),
    )


@pytest.mark.native
@pytest.mark.parametrize("links", [4, 30])
def test_the_arrays_of_all_branches_fit_into_their_memory(links):
    """The mass blocks are placed behind them."""
    mechanism = hung_bodies(20, links)
    system = assemble(mechanism, mechanism.values())
    placed = KernelSystem(mechanism, system.n - len(system.loops))
    placed.assemble(mechanism.values())
    memory = placed.structure.branch_memory
    assert placed.structure.branch_count == 23
    assert memory.base + memory.used <= placed.structure.mass_blocks
