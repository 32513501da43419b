"""Computing time of a mechanism: growth with links and loops, and real time."""

import re

import pytest

import scaling
from c_importer import needs
from prbm.hybrid.runge_kutta import TSITOURAS_PAPAKOSTAS
from prbm.kernel.simulation import KernelSimulation
from prbm.mechanics.assembly import assemble
from support import ROOT, mechanism

BENCHMARKS = ROOT / "benchmarks"
INSTRUCTIONS_PER_SECOND = 4e9  # A processor of 2 GHz with two instructions per cycle.


def test_the_mechanisms_of_the_benchmark_have_the_stated_links_and_loops():
    assert max(scaling.LINKS) == max(scaling.PARALLEL) == 50  # Two chains: a hundred links.
    for n in scaling.LINKS[:3]:
        for axial in (False, True):
            given = scaling.chains(n, axial)
            system = assemble(given, given.values())
            assert len(system.links) == 2 * n
            assert len(system.loops) == 2
            assert len(system.stretches) == axial * 2 * n
    for k in scaling.PARALLEL[:3]:
        given = scaling.leaves(k)
        system = assemble(given, given.values())
        assert len(system.links) == 3 * k
        assert len(system.loops) == 2 * (k - 1)
    for k in scaling.SERIES[:3]:
        given = scaling.column(k)
        system = assemble(given, given.values())
        assert len(system.links) == 3 * k
        assert len(system.loops) == 0


@pytest.fixture
def exponents() -> dict[str, float]:
    """Return the exponents of the page, without the Schur complement."""
    page = (BENCHMARKS.parent / "docs" / "flexure-models.md").read_text(encoding="utf-8")
    _, table = page.split("| without Schur complement |\n", 1)
    rows = [row.strip("| ").split("|") for row in table.split("\n\n", 1)[0].splitlines()[1:]]
    return {row[0].partition(":")[0].strip(): float(row[-1]) for row in rows}


@pytest.mark.slow
@pytest.mark.native
@pytest.mark.parametrize(
    ("kind", "sizes", "make"),
    [
        ("links", (8, 12, 18), scaling.chains),
        ("flexures in parallel", (4, 6, 12), scaling.leaves),
        ("flexures in series", (4, 6, 8), scaling.column),
        ("nodes per beam", (8, 12, 16), lambda n: scaling.beams(3, n, False)),
    ],
)
def test_the_cost_grows_with_the_exponents_of_the_page(kind, sizes, make, exponents):
    """The tolerance is wide: the page is for larger sizes, where the highest power dominates."""
    needs("cc", "valgrind")
    found = scaling.growth(kind, sizes, make).exponent_without_schur
    assert found == pytest.approx(exponents[kind], abs=0.6)


@pytest.mark.slow
@pytest.mark.native
def test_a_right_hand_side_on_beams_has_the_cost_of_the_page():
    """The tolerance of a twentieth is for other compilers."""
    needs("cc", "valgrind")
    page = " ".join((ROOT / "docs" / "flexure-models.md").read_text(encoding="utf-8").split())
    stated = re.search(
        r"takes ([\d.]+) times .{1,60} with 5 nodes, and ([\d.]+) times with 6", page
    )
    assert stated
    reference = scaling.instructions(mechanism("PRBDM2R"))
    for nodes, ratio in zip((5, 6), stated.groups(), strict=True):
        cost = scaling.instructions(scaling.beams(3, nodes, False))
        assert cost / reference == pytest.approx(float(ratio), rel=0.05)


@pytest.mark.slow
@pytest.mark.native
def test_the_folded_suspension_is_faster_than_real_time():
    """The suspension has eight 3R flexures that stretch, with 51 coordinates.

    The right-hand sides of a second of motion take almost all of its instructions.
    """
    needs("cc", "valgrind")
    suspension = mechanism("FoldedSuspension")
    motion = KernelSimulation(suspension, {})
    motion.advance(1.0)
    calls = motion.step_count * len(TSITOURAS_PAPAKOSTAS.weights)
    assert calls * scaling.instructions(suspension) < INSTRUCTIONS_PER_SECOND
