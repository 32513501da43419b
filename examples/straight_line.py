"""Lateral error of a shuttle on leaf flexures, single and folded.

A shuttle on two parallel leaves moves down by 3 x^2 / (5 L) over a stroke x (Euler-Bernoulli beams
of length L).  In a folded suspension each truss moves by x/2, and the descents of its inner and
outer leaves cancel.  The remaining errors are the rotation of the truss, if there is only one, and
differences between the leaves.
"""

import sys
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from matplotlib.figure import Figure

from prbm import Mechanism, load
from prbm.mechanics.assembly import assemble
from prbm.mechanics.statics import equilibrium
from prbm.plots.figures import save

STROKES = np.linspace(0.0, 0.03, 16)  # [m]
ROUNDING_ERROR_MAX = 1e-12  # Smaller lateral errors are round-off [m].
THICKNESS_RATIO = 1.05  # Thickness of the thicker leaf, relative to the others.


def lateral(mechanism: Mechanism, strokes: np.ndarray = STROKES) -> np.ndarray:
    """Return the lateral displacement of the shuttle in static equilibrium at strokes [m].

    Parameters
    ----------
    mechanism : Mechanism
        A mechanism whose released body moves along x.
    strokes : (k,)
        Displacements of the centre of mass of this body along x [m].
    """
    system = assemble(mechanism, mechanism.values({"gravity.x": 0.0, "gravity.y": 0.0}))
    frame = system.bodies[mechanism.release.body]
    shapes = [equilibrium(system, float(x)).q for x in strokes]
    return np.array([(frame.A @ system.directions(q) + frame.c - frame.drawn).imag for q in shapes])


def single(folded: Mechanism) -> Mechanism:
    """Return the shuttle on its two upper outer leaves only, clamped to the ground."""
    leaves = [f for f in folded.flexures if f.name in ("upper_left_outer", "upper_right_outer")]
    truss = next(body for body in folded.bodies if body.name == "upper_truss")
    places = {leaf.start.rpartition(".")[2] for leaf in leaves}
    return replace(
        folded,
        ground={name: point for name, point in truss.points.items() if name in places},
        bodies=folded.bodies[:1],
        flexures=tuple(replace(f, start=f.start.replace(truss.name, "ground")) for f in leaves),
        stops=(),
    )


def half(folded: Mechanism) -> Mechanism:
    """Return the suspension with its upper truss only."""
    return replace(
        folded,
        ground={name: point for name, point in folded.ground.items() if "upper" in name},
        bodies=tuple(body for body in folded.bodies if body.name != "lower_truss"),
        flexures=tuple(f for f in folded.flexures if "upper" in f.name),
        stops=(),
    )


def uneven(folded: Mechanism) -> Mechanism:
    """Return the suspension with one thicker leaf."""
    first, kind = folded.flexures[0], folded.flexure_types[0]
    assert isinstance(kind.thickness, float)
    thick = replace(kind, name="thick", thickness=THICKNESS_RATIO * kind.thickness)
    return replace(
        folded,
        flexure_types=(kind, thick),
        flexures=(replace(first, type="thick"), *folded.flexures[1:]),
    )


def simulate(strokes: np.ndarray = STROKES) -> dict[str, np.ndarray]:
    """Return the lateral errors by name of the mechanism [m]."""
    folded = load("FoldedSuspension")
    return {
        "two leaves": lateral(single(folded), strokes),
        "folded, one leaf 5 % thicker": lateral(uneven(folded), strokes),
        "folded, one truss": lateral(half(folded), strokes),
        "folded": lateral(folded, strokes),
    }


def plot(errors: dict[str, np.ndarray], beam: np.ndarray) -> Figure:
    """Plot the lateral errors over the stroke."""
    figure = Figure((7.0, 4.2), dpi=120, layout="constrained")
    axes = figure.subplots()
    axes.plot(1e3 * STROKES[1:], 1e3 * beam[1:], "k--", linewidth=1.0, label="3 x² / (5 L)")
    for (name, error), marker in zip(errors.items(), "osd^", strict=True):
        size = np.abs(error)
        if size.max() < ROUNDING_ERROR_MAX:
            size, name = np.full(len(error), ROUNDING_ERROR_MAX), f"{name} (round-off)"
        axes.plot(1e3 * STROKES[1:], 1e3 * size[1:], marker + "-", markersize=4, label=name)
    axes.set_yscale("log")
    axes.set_xlabel("stroke [mm]")
    axes.set_ylabel("lateral error [mm]")
    axes.grid(color="#eeeeee")
    axes.legend(fontsize=8, frameon=False, loc="lower right", bbox_to_anchor=(1.0, 0.08))
    return figure


def main(arguments: Sequence[str]) -> int:
    """Print the lateral errors at full stroke beside that of beam theory, and plot them."""
    length = load("FoldedSuspension").values()["flexure.length"]
    beam = 0.6 * STROKES**2 / length
    errors = simulate()
    print(f"lateral errors at a stroke of {1e3 * STROKES[-1]:g} mm:")
    for name, error in errors.items():
        print(f"  {name}: {1e6 * abs(error[-1]):.3g} um")
    print(f"  two leaves, beam theory: {1e6 * beam[-1]:.3g} um")
    print(save(plot(errors, beam), "straight_line.png"))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
