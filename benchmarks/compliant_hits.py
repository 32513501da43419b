"""Hits of the steel guide on compliant stops: beams in the kernel, and finite elements.

    python benchmarks/compliant_hits.py

writes the table of ``docs/compliant-stops.md`` (between its marks).  A test compares the page with
the results of this script.

The guide is straight, without gravity and without damping in the flexures, which stretch.  Its
fundamental mode arrives alone, with 0.3 m/s at the hit point.  The contact force is linear in the
indentation, with the damping of a restitution of 0.6.
"""

import re
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "fmu_src"))

from prbm import Mechanism, load
from prbm.analysis.impact_map import algebraic, by_elements, with_flexures
from prbm.kernel.simulation import KernelSimulation
from prbm.mechanics.modal import modes_at, simulated_restitution
from prbm.mechanism.parts import COMPLIANT
from prbm.references.finite_elements import FiniteElements
from prbm.references.finite_elements.hit import ElementHit, compliant_hit

PAGE = Path(__file__).resolve().parents[1] / "docs" / "compliant-stops.md"
SPEED, RESTITUTION = 0.3, 0.6
STIFFNESSES = (1e6, 5e6, 1e7, 6e7, 1.2e8)  # N/m
OFFSETS = (0.0, 4e-3)  # m
ORDERS = (3, 5)
ELEMENTS, STEPS = 16, 400  # Per flexure, and per contact.
UNDAMPED = {"gravity.x": 0.0, "damping.beta": 0.0}
TOLERANCE = 1e-9
START = 1e-7  # Gap at the start of a simulation [m].
TIME_STEP, END = 2e-5, 5e-3  # s
MARKED = r"(<!-- table: hits of the guide -->\n)(.*?)(<!-- end -->)"


def guide(order: int, stiffness: float | None = None) -> Mechanism:
    """Return the steel guide with beams that stretch; without a stiffness its stop is rigid."""
    one = with_flexures(load("GuideBeam"), "beam", axial=True, order=order)
    (stop,) = one.stops
    stop = replace(stop, position=0.0, offset=0.0, restitution=RESTITUTION)
    if stiffness is not None:
        stop = replace(stop, law=COMPLIANT, stiffness=stiffness, exponent=1.0)
    return replace(one, stops=(stop,))


def start_fundamental_mode(simulation: KernelSimulation, speed: float) -> None:
    """Set the rates to those of the fundamental mode, with a closing speed at the stop [m/s]."""
    system, n = simulation.system, simulation.system.n
    y = simulation.state()
    phi = modes_at(system, y[:n]).shape[:, 0]
    G = system.gap_rows.jacobian(system.directions(y[:n]))[0]
    saved = simulation.snapshot()
    numbers = np.array(saved["numbers"])
    windows = np.lib.stride_tricks.sliding_window_view(numbers, 2 * n)
    (first,) = np.flatnonzero((windows == y[: 2 * n]).all(axis=1))  # Coordinates, then rates.
    numbers[first + n : first + 2 * n] = phi * (-speed / float(G @ phi))
    simulation.restore({**saved, "numbers": numbers.tolist()})


def by_beams(
    order: int, stiffness: float, offset: float, values: dict[str, float] | None = None
) -> ElementHit:
    """Return the hit of the guide with beams of an order, simulated by the kernel."""
    start = {"release.displacement": -START, "release.velocity": SPEED, "stop.offset": offset}
    simulation = KernelSimulation(
        guide(order, stiffness), {**UNDAMPED, **start, **(values or {})}, tolerance=TOLERANCE
    )
    start_fundamental_mode(simulation, SPEED)
    record = simulation.record = []
    while not record and simulation.time < END:
        simulation.advance(simulation.time + TIME_STEP)
    (impact,), out = record, simulation.outputs()
    found = modes_at(simulation.system, impact.q)
    restitution = simulated_restitution(found.shape[:, 0], found.M, impact.before, impact.after)
    return ElementHit(restitution, out["stop.peak_force"], out["stop.contact_duration"])


def by_finite_elements(
    stiffness: float,
    offset: float,
    elements: int = ELEMENTS,
    steps: int = STEPS,
    values: dict[str, float] | None = None,
) -> ElementHit:
    """Return the hit of the guide with ANCF elements, integrated by Exudyn."""
    changes = {**UNDAMPED, "stop.offset": offset, **(values or {})}
    fe = FiniteElements(guide(ORDERS[0], stiffness), changes, elements=elements)
    mass = fe.values["shuttle.mass"]
    return compliant_hit(fe, SPEED, np.pi * np.sqrt(mass / stiffness), steps)


def rigid() -> list[NDArray[np.float64]]:
    """Return the modal restitutions of a rigid stop at both offsets: beams, finite elements."""
    maps = [algebraic(guide(order), [0.0], OFFSETS, UNDAMPED) for order in ORDERS]
    maps.append(by_elements(guide(ORDERS[0]), [0.0], OFFSETS, UNDAMPED, elements=ELEMENTS))
    return [one.restitution[:, 0] for one in maps]


def table() -> str:
    """Return the table in Markdown."""
    names = [*(f"order {order}" for order in ORDERS), "elements"]
    head = ["k, N/m", "peak, N", "duration, µs", *names, *(f"4 mm: {name}" for name in names)]
    lines = ["| " + " | ".join(head) + " |", "|---:" * len(head) + "|"]
    for k in STIFFNESSES:
        hits = [[*(by_beams(order, k, d) for order in ORDERS), by_finite_elements(k, d)]
                for d in OFFSETS]  # fmt: skip
        first = hits[0][-1]
        cells = [
            f"{k:.2g}".replace("e+0", "e"),
            f"{first.force:.0f}",
            f"{1e6 * first.duration:.0f}",
        ]
        cells += [f"{hit.restitution:.4f}" for row in hits for hit in row]
        lines.append("| " + " | ".join(cells) + " |")
    cells = [f"{row[i]:.4f}" for i in range(len(OFFSETS)) for row in rigid()]
    return "\n".join([*lines, "| " + " | ".join(["rigid", "", "0", *cells]) + " |"])


def shown(page: str) -> str:
    """Return the table of the page."""
    found = re.search(MARKED, page, re.DOTALL)
    assert found, "the page has no table of hits"
    return found[2].strip()


def main() -> None:
    """Update the page."""
    body = table()
    print(body)
    page = PAGE.read_text(encoding="utf-8")
    page = re.sub(MARKED, lambda m: f"{m[1]}{body}\n{m[3]}", page, flags=re.DOTALL)
    PAGE.write_text(page, encoding="utf-8")


if __name__ == "__main__":
    main()
