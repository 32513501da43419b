"""What a mechanism costs: the growth with links and loops, and real time."""

import importlib
import sys
import time

import pytest
from fmpy import simulate_fmu

from c_importer import needs
from prbm.mechanics.assembly import assemble
from support import ROOT

BENCHMARKS = ROOT / "benchmarks"


@pytest.fixture
def scaling(monkeypatch):
    """Return the benchmark."""
    monkeypatch.setattr(sys, "path", [str(BENCHMARKS), *sys.path])
    return importlib.import_module("scaling")


def test_the_mechanisms_of_the_benchmark_have_the_links_and_loops_that_it_says(scaling):
    assert max(scaling.LINKS) == 50  # of two chains: a hundred links
    for n in scaling.LINKS[:3]:
        for axial in (False, True):
            given = scaling.chains(n, axial)
            system = assemble(given, given.values())
            assert len(system.links) == 2 * n
            assert len(system.loops) == 2
            assert len(system.stretches) == axial * 2 * n
    for k in scaling.LEAVES:
        given = scaling.leaves(k)
        system = assemble(given, given.values())
        assert len(system.links) == 3 * k
        assert len(system.loops) == 2 * (k - 1)


@pytest.fixture
def exponents() -> tuple[float, ...]:
    """Return what the page says of links, of links that stretch, and of loops."""
    page = (BENCHMARKS.parent / "docs" / "flexure-models.md").read_text()
    _, table = page.split("| exponent |\n", 1)
    rows = table.split("\n\n", 1)[0].splitlines()[1:]
    return tuple(float(row.split("|")[-2]) for row in rows)


def test_the_page_says_that_the_cost_grows_with_less_than_the_cube(exponents):
    links, stretching, loops = exponents
    assert 1.0 < links < stretching < loops < 3.0


@pytest.mark.slow
@pytest.mark.native
def test_the_cost_grows_as_the_page_says(scaling, exponents):
    """About: the page's are of larger sizes, where the highest power has more of the whole."""
    needs("cc", "valgrind")
    links, _, loops = exponents
    assert scaling.grows("Links", (8, 12, 18), scaling.chains) == pytest.approx(links, abs=0.6)
    assert scaling.grows("Loops", (3, 4, 6), scaling.leaves) == pytest.approx(loops, abs=0.6)


@pytest.mark.slow
@pytest.mark.native
def test_the_folded_suspension_is_faster_than_real_time(native):
    """With eight 3R flexures that stretch, 51 coordinates: the default second in less CPU time.

    FMPy's overhead of a thousand communication steps is in it.
    """
    fmu = str(native["FoldedSuspension", 3])
    costs = []
    for _ in range(3):
        begin = time.process_time()
        simulate_fmu(fmu, stop_time=1.0, output_interval=1e-3, output=["shuttle.x"])
        costs.append(time.process_time() - begin)
    assert min(costs) < 1.0
