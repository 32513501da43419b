"""Errors of the flexure models: cantilevers against beam theory, a guide against finite elements.

    python benchmarks/flexure_models.py

writes the tables of ``docs/flexure-models.md`` (between their marks) and the figures
``docs/figures/flexure-models.png`` and ``docs/figures/flexure-coordinates.png``.  The tests compare
the page with the results of this script.

The tables contain model errors only: the equations of each model are solved to rounding.
"""

import math
import re
import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache
from itertools import cycle
from pathlib import Path

import matplotlib as mpl
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "fmu_src"))

from prbm import Mechanism, load
from prbm.mechanics.assembly import assemble
from prbm.mechanics.modal import modal_restitution, modes
from prbm.mechanics.sections import static_section_loads
from prbm.mechanics.statics import equilibrium, free_displacement
from prbm.mechanics.system import System
from prbm.mechanism import flexure
from prbm.mechanism.parts import Body, Flexure, FlexureType, Force, Probe, Release
from prbm.references.beams import Tip, end_force, end_moment, wavenumber

mpl.use("Agg")
import matplotlib.pyplot as plt

Real = NDArray[np.float64]
Cell = float | None

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "flexure-models.md"
FIGURE = ROOT / "docs" / "figures" / "flexure-models.png"
COORDINATES = ROOT / "docs" / "figures" / "flexure-coordinates.png"
PUBLISHED = tuple(name for name, model in flexure.MODELS.items() if model.coefficients)
CHAINS_SHOWN = ("10R", "40R")
MODELS = (*PUBLISHED, "beam", *CHAINS_SHOWN)
FORCES = (0.1, 1.0, 2.0, 4.0, 8.0)  # Scaled forces P L^2/EI.
MOMENTS = (0.1, math.pi / 4, math.pi / 2, math.pi)  # Scaled moments M L/EI.
TIPS = (
    (0.0, 0.0),
    (1.0, 0.0),
    (10.0, 0.0),
    (1.0, 0.1),
)  # Mass and inertia of the tip body, in units of m and m L^2 of the beam.
TIP_MASS_MIN = 1e-8  # Scaled mass of a missing tip body; a body must have a mass.

FE_GUIDE = (10.7206, 4.9065, 130.65, 209.85, 302.05, 327.65)
"""Rest position [mm] and frequencies at rest [Hz] of the steel guide: 64 ANCF cable elements
per flexure (Exudyn), which stretch and whose sections have no rotary inertia."""
FE_CONVERGENCE = {
    2: (10.5214217, 5.036453, 301.191922, 311.276856, 342.677328, 464.069242),
    4: (10.7032022, 4.918320, 136.300477, 217.666575, 303.495431, 329.686810),
    8: (10.7193487, 4.907394, 131.062277, 210.404663, 302.151153, 327.800176),
    16: (10.7204818, 4.906599, 130.674895, 209.883305, 302.057643, 327.658975),
    32: (10.7205548, 4.906547, 130.649144, 209.849055, 302.051642, 327.649714),
    64: (10.7205594, 4.906544, 130.647507, 209.846885, 302.051264, 327.649128),
}
"""The same figures by the number of elements per flexure."""
FE_STRAIGHT = 4.6405  # Fundamental frequency of the straight guide, no gravity, 32 elements [Hz].
FE_RESTITUTION = {
    -4: (0.4089, 0.5483, 0.4084),
    0: (0.4519, 0.5947, 0.4519),
    4: (0.4104, 0.5482, 0.4108),
}
"""Modal restitution with the same elements and the coefficient 0.6, without gravity, computed
without a simulation: one row per offset of the hit point from the centre of mass [mm], one column
per wall at -10, 0 and 10 mm."""

# --- cantilevers --------------------------------------------------------------------------------

L, THICKNESS, WIDTH, MODULUS, DENSITY = 0.1, 5e-4, 1e-2, 2e11, 7800.0
EI = MODULUS * WIDTH * THICKNESS**3 / 12
MASS = DENSITY * WIDTH * THICKNESS * L


def kind(name: str, model: str, *, axial: bool = False) -> FlexureType:
    """Return a flexure type of the steel cantilever.

    ``10R`` is a chain of ten links, ``beam 5`` a beam of the order 5 and ``beam 3/8`` one of the
    order 3 with 8 nodes.
    """
    section = FlexureType(name, model, THICKNESS, WIDTH, MODULUS, DENSITY, axial=axial)
    if model in flexure.MODELS:
        return section
    if model.startswith("beam"):
        order, *nodes = map(int, model.removeprefix("beam ").split("/"))
        return replace(section, model="beam", order=order, nodes=nodes[0] if nodes else None)
    return replace(section, model="nR", n=int(model[:-1]))


def cantilever(model: str, tip: tuple[float, float] = (0.0, 0.0), *, axial: bool = False) -> System:
    """Return a cantilever with a body at its tip: mass and inertia in units of m and m L^2."""
    mass, inertia = (max(x, TIP_MASS_MIN) for x in tip)
    mechanism = Mechanism(
        name="Cantilever",
        title="A flexure, clamped at one end",
        ground={"clamp": (0.0, 0.0)},
        bodies=(Body("tip", mass * MASS, inertia * MASS * L**2, (L, 0.0), {"end": (L, 0.0)}),),
        flexure_types=(kind("leaf", model, axial=axial),),
        flexures=(Flexure("leaf1", "leaf", "ground.clamp", "tip.end", ("clamp", "free")),),
        forces=(Force("force", "tip"),),
        probes=(Probe("end", "tip.end"),),
        release=Release("tip", direction=90.0),
    )
    return assemble(mechanism, mechanism.values())


def tip_of(system: System, force: float = 0.0, moment: float = 0.0) -> Tip:
    """Return the tip under a scaled transverse force P L^2/EI and moment M L/EI."""
    loads = {"force.y": force * EI / L**2, "force.moment": moment * EI / L}
    q = equilibrium(system, loads=loads).q
    probe = system.probes[0]
    z = complex(probe.A @ system.directions(q)) + probe.c
    return Tip(z / L, float(q[probe.j]))


def displacement_error(found: Tip, exact: Tip) -> float:
    """Return the error of the tip position, relative to the displacement of the tip [%]."""
    return 100 * abs(found.z - exact.z) / abs(exact.z - 1)


def frequency_error(system: System, tip: tuple[float, float], mode: int) -> float | None:
    """Return the relative error of a frequency [%]; None if the model has no such mode."""
    found = modes(system, equilibrium(system)).frequency
    if mode > len(found):
        return None
    b = wavenumber(mode, *(max(x, TIP_MASS_MIN) for x in tip))
    exact = b**2 * math.sqrt(EI / (MASS * L**3)) / (2 * math.pi)
    return 100 * (float(found[mode - 1]) / exact - 1)


# --- the guide ----------------------------------------------------------------------------------


@cache
def guide(model: str, *, axial: bool = False) -> Mechanism:
    """Return the steel guide of the thesis with another model of its flexures."""
    shipped_guide = load("PRBDM2R")
    section = kind("flexure", model, axial=axial)
    own = shipped_guide.flexure_types[0]
    changed = ("model", "n", "order", "nodes", "axial")
    flexure = replace(own, **{name: getattr(section, name) for name in changed})
    return replace(shipped_guide, flexure_types=(flexure,))


def coordinates(model: str, *, axial: bool = False) -> tuple[int, int]:
    """Return the number of coordinates of the guide, and without those that the loops determine."""
    mechanism = guide(model, axial=axial)
    system = assemble(mechanism, mechanism.values())
    return system.n, system.n - len(system.loops)


@cache
def guide_figures(model: str, *, axial: bool = False) -> Real:
    """Return rest position [mm], five frequencies at rest and f1 straight [Hz]; NaN if missing."""
    mechanism = guide(model, axial=axial)
    system = assemble(mechanism, mechanism.values())
    f = modes(system, equilibrium(system)).frequency[:5]
    straight = assemble(mechanism, mechanism.values({"gravity.x": 0.0}))
    f1 = modes(straight, equilibrium(straight)).frequency[0]
    missing = [math.nan] * (5 - len(f))
    return np.array([1e3 * free_displacement(system), *f, *missing, f1])


@cache
def restitution_error(model: str, *, axial: bool) -> float:
    """Return the largest difference of the modal restitution from finite elements [-]."""
    mechanism = guide(model, axial=axial)
    worst = 0.0
    for offset, row in FE_RESTITUTION.items():
        changes = {"gravity.x": 0.0, "stop.offset": 1e-3 * offset}
        system = assemble(mechanism, mechanism.values(changes))
        for x, exact in zip((-10e-3, 0.0, 10e-3), row, strict=True):
            found = modal_restitution(system, equilibrium(system, x), 0, 0.6)
            worst = max(worst, abs(found - exact))
    return worst


# --- tables -------------------------------------------------------------------------------------


def table(head: Sequence[str], rows: Sequence[tuple[str, Sequence[Cell]]], form: str) -> str:
    """Return a table in Markdown with one number format."""
    lines = ["| " + " | ".join(head) + " |", "|---" + "|---:" * (len(head) - 1) + "|"]
    for name, cells in rows:
        written = ["-" if c is None or math.isnan(c) else format(c, form) for c in cells]
        lines.append("| " + " | ".join([name, *written]) + " |")
    return "\n".join(lines)


def coefficient_table() -> str:
    """Return the table of the published coefficients."""
    lines = [
        "| model | gamma | K_theta | rate of a spring | mass | source |",
        "|---|---|---|---|---|---|",
    ]
    for name in PUBLISHED:
        model = flexure.MODELS[name]
        gamma, K_theta = (
            ", ".join(f"{c.value:g}" for c in x) for x in (model.gamma, model.K_theta)
        )
        several = "_i" if len(model.gamma) > 1 else ""
        rate = f"K_theta{several} EI/h"
        if model.rate_with_gamma:
            rate = f"gamma{several} {rate}"
        mass = "slender rods"
        if model.lumped:
            mass = "at the pivots, with an equivalent kinetic energy"
        lines.append(f"| {name} | {gamma} | {K_theta} | {rate} | {mass} | {model.source} |")
    return "\n".join(lines)


def force_table() -> str:
    """Return the table of errors of the tip position under an end force [%]."""
    systems = [cantilever(model) for model in MODELS]
    rows = [
        (
            f"{load:g}",
            [displacement_error(tip_of(s, force=load), end_force(load)) for s in systems],
        )
        for load in FORCES
    ]
    return table(["P L²/EI", *MODELS], rows, ".3f")


def moment_table() -> str:
    """Return the table of errors of tip position [%] and tip slope under an end moment."""
    systems = [cantilever(model) for model in MODELS]
    rows = [
        (
            f"{load / math.pi:g} π" if load > 0.5 else f"{load:g}",
            [displacement_error(tip_of(s, moment=load), end_moment(load)) for s in systems],
        )
        for load in MOMENTS
    ]
    slopes = [tip_of(s, moment=1.0).slope for s in systems]
    # fmt: off
    return table(["M L/EI", *MODELS], rows, ".3f") + "\n" + table(
        [], [("slope / exact", slopes)], ".3f"
    ).splitlines()[-1]
    # fmt: on


def frequency_table() -> str:
    """Return the table of errors of the first two frequencies with a body at the tip [%]."""
    rows = []
    for tip in TIPS:
        systems = [cantilever(model, tip) for model in MODELS]
        for mode in (1, 2):
            errors = [frequency_error(s, tip, mode) for s in systems]
            rows.append((f"{tip[0]:g}, {tip[1]:g}: f{mode}", errors))
    return table(["m, J of the body", *MODELS], rows, "+.2f")


def guide_table() -> str:
    """Return the table of rest positions and frequencies of the steel guide."""
    names = ("rest, mm", "f1", "f2", "f3", "f4", "f5", "f1 straight")
    columns = [guide_figures(model) for model in MODELS]
    stretching = ("2R", "beam", "40R")
    columns += [guide_figures(model, axial=True) for model in stretching]
    columns.append(np.array([*FE_GUIDE, FE_STRAIGHT]))
    head = ["", *MODELS, *(f"{model} axial" for model in stretching), "FE"]
    rows = [(name, [float(c[i]) for c in columns]) for i, name in enumerate(names)]
    return table(head, rows, "#.5g")


def restitution_table() -> str:
    """Return the table of largest differences of modal restitution from finite elements [-]."""
    rows = [
        (name, [restitution_error(model, axial=axial) for model in MODELS])
        for name, axial in (("inextensible", False), ("axial", True))
    ]
    return table(["", *MODELS], rows, ".4f")


BEAMS = (
    ("beam 3/5", False), ("beam 3/6", False), ("beam 3/8", True), ("beam 4/8", True),
    ("beam 6/8", True),
)  # fmt: skip


def beam_table() -> str:
    """Return the table of beams: coordinates, rest position [mm] and frequencies [Hz]."""
    rows = [("2R", coordinates("2R"), guide_figures("2R"))]
    for model, axial in BEAMS:
        order, nodes = model.removeprefix("beam ").split("/")
        name = f"beam, order {order}, {nodes} nodes" + (", axial" if axial else "")
        rows.append((name, coordinates(model, axial=axial), guide_figures(model, axial=axial)))
    head = ["model", "coordinates (free)", "rest [mm]", *(f"f{k} [Hz]" for k in range(1, 6))]
    lines = table(head, [], "").splitlines()
    for name, (n, free), figures in rows:
        lines.append(f"| {name} | {n} ({free}) | {_beam_cells(figures)} |")
    return "\n".join([*lines, f"| finite elements | | {_beam_cells(limit_of_elements())} |"])


def _beam_cells(figures: Sequence[float] | Real) -> str:
    """Return rest position, the first frequency and the others with 5, 4 and 3 decimals."""
    forms = (".5f", ".4f", *[".3f"] * 4)
    return " | ".join(format(x, form) for x, form in zip(figures[:6], forms, strict=True))


HEAVY_ORDERS = (3, 5, 7, 9, 12)
MATERIALS = {
    "steel": {},
    "PMMA": {
        "flexure.length": 0.2, "flexure.thickness": 2e-3, "flexure.width": 1e-2,
        "flexure.youngs_modulus": 3.21e9, "flexure.density": 1190.0, "shuttle.width": 0.2,
        "shuttle.mass": 1190 * 0.2 * 0.02 * 0.01,
    },
}  # fmt: skip
"""Changes of the parameters of the steel guide."""


def heavy_table() -> str:
    """Return the table of modal restitutions of a centred rigid impact over the order [-]."""
    rows = []
    for name, changes in MATERIALS.items():
        cells: list[Cell] = []
        for order in HEAVY_ORDERS:
            mechanism = guide(f"beam {order}", axial=True)
            system = assemble(mechanism, mechanism.values({**changes, "gravity.x": 0.0}))
            cells.append(modal_restitution(system, equilibrium(system, 0.0), 0, 0.6))
        v = system.values
        flexures = 2 * v["flexure.density"] * v["flexure.length"]
        flexures *= v["flexure.width"] * v["flexure.thickness"]
        share = flexures / v["shuttle.mass"]
        cells += [1.6 / (1.0 + 13 / 35 * share) - 1.0]
        rows.append((f"{name}, mass of the flexures {100 * share:.1f} %", cells))
    head = ["guide", *(f"order {order}" for order in HEAVY_ORDERS), "limit"]
    return table(head, rows, ".4f")


STRESS_STROKES = (0.01, 0.018)  # m


def leaf_stress(displacement: float) -> float:
    """Return the stress at the clamps of a fixed-guided leaf without axial force [Pa].

    Each half of it is a cantilever with an end force.
    """
    v = load("PRBDM2R").values()
    half, h = 0.5 * v["flexure.length"], v["flexure.thickness"]
    target = 0.5 * displacement / half
    force = float(brentq(lambda x: end_force(x).z.imag - target, 1e-3, 20.0, xtol=1e-12))
    return force * end_force(force).z.real * v["flexure.youngs_modulus"] * h / 2 / half


def held_stresses(model: str, displacement: float, height: float | None = None) -> Real:
    """Return the stress by bending at the starts of both leaves [Pa], and the tension of the left.

    The guide is held at its centre of mass, or at a height [m] above the leaves, without gravity.
    """
    mechanism = guide(model)
    changes = {"gravity.x": 0.0} | ({} if height is None else {"shuttle.com_height": height})
    system = assemble(mechanism, mechanism.values(changes))
    loads = static_section_loads(system, equilibrium(system, displacement))
    return np.array([*(-x.bending[0] / x.modulus[0] for x in loads), loads[0].tension[0]])


def unloaded_height(model: str, displacement: float) -> float:
    """Return the height at which the guide is held without axial forces in its leaves [m]."""
    return float(
        brentq(lambda y: held_stresses(model, displacement, y)[2], -0.022, -0.015, xtol=1e-9)
    )


def stress_table() -> str:
    """Return the table of errors of the stress at the clamps of leaves [%]."""
    rows = []
    for model in (*PUBLISHED, "beam 3", "beam 5", *CHAINS_SHOWN):
        cells: list[Cell] = []
        for x in STRESS_STROKES:
            free = unloaded_height(model, x)
            cells.append(100 * (float(held_stresses(model, x, free)[0]) / leaf_stress(x) - 1))
        for x in STRESS_STROKES:
            cells += list(100 * (held_stresses(model, x)[:2] / held_stresses("beam 7", x)[:2] - 1))
        rows.append((model.replace("beam ", "beam, order "), cells))
    head = ["model", "leaf, 10 mm", "18 mm", "left, 10 mm", "right", "left, 18 mm", "right"]
    return table(head, rows, ".3f")


TABLES: dict[str, Callable[[], str]] = {
    "coefficients": coefficient_table,
    "beams": beam_table,
    "end force": force_table,
    "end moment": moment_table,
    "frequencies": frequency_table,
    "guide": guide_table,
    "restitution": restitution_table,
    "heavy flexures": heavy_table,
    "stress": stress_table,
}
MARKED = r"(<!-- table: {} -->\n)(.*?)(<!-- end -->)"


def shown(page: str, name: str) -> str:
    """Return a table of the page by its name."""
    found = re.search(MARKED.format(name), page, re.DOTALL)
    assert found, f"the page has no table {name!r}"
    return found[2].strip()


# --- convergence and figure ---------------------------------------------------------------------

CHAINS = (5, 10, 20, 40, 80)


def richardson(values: Sequence[Real]) -> Real:
    """Return the limit of values at doubled n, for errors with terms in n^-2 and n^-4."""
    a, b, c = values[-3:]
    once = (4 * b - a) / 3, (4 * c - b) / 3
    return (16 * once[1] - once[0]) / 15


def order(ns: Sequence[int], errors: Sequence[float]) -> float:
    """Return the order of convergence by a least-squares line through logarithms."""
    return -float(np.polyfit(np.log(ns), np.log(errors), 1)[0])


COLOURS = {"beam": "#000000", "10R": "#009e73", "40R": "#0072b2"} | dict(
    zip(PUBLISHED, cycle(("#d55e00", "#e69f00", "#cc79a7", "#56b4e9")), strict=False)
)  # Colours that colour-blind readers can distinguish.
LOADS: dict[str, tuple[str, Callable[[float], Tip], float]] = {
    "force": ("end force, P L²/EI", end_force, 8.0),
    "moment": ("end moment, M L/EI", end_moment, math.pi),
}


def figure() -> None:
    """Draw tip paths, their errors, and the convergence of the chain."""
    fig, ((paths, chains), below) = plt.subplots(2, 2, figsize=(9.0, 7.6), layout="constrained")
    draw_paths(paths)
    draw_convergence(chains)
    for axes, loading in zip(below, LOADS, strict=True):
        draw_errors(axes, loading)
    FIGURE.parent.mkdir(exist_ok=True)
    fig.savefig(FIGURE, dpi=110, metadata={"Software": None})
    plt.close(fig)


def draw_paths(axes: plt.Axes) -> None:
    """Draw the path of the tip under both loads."""
    for loading, (_, exact, largest) in LOADS.items():
        path = np.array([exact(x).z for x in np.linspace(0.0, largest, 200)])
        axes.plot(path.real, path.imag, color="0.7", lw=4)
        marks = np.array([exact(x).z for x in np.linspace(0, largest, 5)])
        axes.plot(marks.real, marks.imag, "o", color="0.35", mfc="none", ms=10)
        for model in PUBLISHED:
            system = cantilever(model)
            z = np.array([tip_of(system, **{loading: x}).z for x in np.linspace(0.0, largest, 33)])
            axes.plot(z.real, z.imag, color=COLOURS[model], lw=1.2)
            axes.plot(z.real[::8], z.imag[::8], "o", color=COLOURS[model], ms=4)
    axes.set(xlabel="x / L", ylabel="y / L", xlim=(-0.08, 1.08), title="Tip of a cantilever")
    axes.set_aspect("equal")
    axes.annotate("end moment 0 to π", (0.02, 0.56), color="0.35")
    axes.annotate("end force\n0 to 8", (0.76, 0.68), color="0.35")
    lines = [plt.Line2D([], [], color="0.7", lw=4)]
    lines += [plt.Line2D([], [], color=COLOURS[model], marker="o", ms=4) for model in PUBLISHED]
    axes.legend(lines, ["elastica", *PUBLISHED], loc="lower left")


def draw_errors(axes: plt.Axes, loading: str) -> None:
    """Draw the errors of the tip position over a load."""
    name, exact, largest = LOADS[loading]
    loads = np.linspace(0.0, largest, 60)[1:]
    for model in MODELS:
        system = cantilever(model)
        errors = [displacement_error(tip_of(system, **{loading: x}), exact(x)) for x in loads]
        axes.semilogy(loads, errors, color=COLOURS[model], label=model)
    axes.set(
        xlabel=name,
        ylabel="error of the tip / its displacement, %",
        title=name.split(",")[0].capitalize(),
    )
    axes.set_ylim(bottom=1e-5 if loading == "force" else 1e-9)  # Smaller errors are round-off.
    axes.legend(loc=(0.5, 0.03 if loading == "force" else 0.3), ncols=2)
    axes.grid(alpha=0.3)


def draw_convergence(axes: plt.Axes) -> None:
    """Draw the convergence of chains to their limit on the steel guide."""
    chains = np.array([guide_figures(f"{n}R", axial=True) for n in CHAINS])
    limit = richardson(list(chains))
    for i, (name, mark) in enumerate((("rest position", "o"), ("f1", "s"), ("f2", "^"))):
        errors = 100 * np.abs(chains[:, i] / limit[i] - 1)
        axes.loglog(CHAINS, errors, mark + "-", ms=4, label=name)
    axes.loglog(CHAINS, 2.5e2 / np.array(CHAINS) ** 2.0, "k:", label="1/n²")
    axes.set(
        xlabel="links of a chain, n", ylabel="error, %", title="Steel guide, chains that stretch"
    )
    axes.set_xticks(CHAINS, [str(n) for n in CHAINS], minor=False)
    axes.minorticks_off()
    axes.grid(alpha=0.3)
    axes.legend()


ORDERS = (3, 4, 5, 6, 7)
PANELS = {"rest position": [0], "f2, f3": [2, 3], "f4, f5": [4, 5]}


def element_coordinates(elements: int) -> int:
    """Return the free coordinates of two cables: four per node, without those of their clamps.

    Both cables are clamped to the ground, which takes three coordinates of a node, and to the
    shuttle, which has three coordinates itself.
    """
    return 2 * (4 * (elements + 1) - 6) + 3


def limit_of_elements() -> Real:
    """Return the limit of the finite elements, whose errors are of the fourth order."""
    coarse, fine = (np.array(FE_CONVERGENCE[n]) for n in sorted(FE_CONVERGENCE)[-2:])
    return fine + (fine - coarse) / 15


def coordinates_figure() -> None:
    """Draw errors of the guide over the number of its free coordinates."""
    fig, panels = plt.subplots(1, 3, figsize=(9.6, 4.0), layout="constrained", sharey=True)
    limit = limit_of_elements()

    def errors(found: Sequence[float] | Real, columns: list[int]) -> float:
        return 100 * max(abs(found[i] / limit[i] - 1) for i in columns)

    for axes, (title, columns) in zip(panels, PANELS.items(), strict=True):
        for model in PUBLISHED:
            x, y = coordinates(model)[1], errors(guide_figures(model), columns)
            axes.loglog(x, y, "s", color=COLOURS[model], label=model)
        series = {
            "nR axial": ([f"{n}R" for n in CHAINS], True, "^-", "#0072b2"),
            "beam": ([f"beam {n}" for n in ORDERS[:3]], False, "o--", "#777777"),
            "beam axial": ([f"beam {n}" for n in ORDERS], True, "o-", "#000000"),
        }
        for name, (models, axial, line, colour) in series.items():
            x = [coordinates(model, axial=axial)[1] for model in models]
            y = [errors(guide_figures(model, axial=axial), columns) for model in models]
            axes.loglog(x, y, line, color=colour, ms=4, label=name)
        coarse = sorted(FE_CONVERGENCE)[:-1]
        x = [element_coordinates(n) for n in coarse]
        y = [errors(FE_CONVERGENCE[n], columns) for n in coarse]
        axes.loglog(x, y, "d-", color="#009e73", ms=4, label="ANCF elements")
        axes.set(title=title, xlabel="free coordinates")
        axes.set_xticks([1, 5, 10, 20, 50, 100, 200, 500])
        axes.get_xaxis().set_major_formatter(mpl.ticker.ScalarFormatter())
        axes.minorticks_off()
        axes.grid(alpha=0.3)
    panels[0].set(ylabel="error, %")
    fig.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=7)
    COORDINATES.parent.mkdir(exist_ok=True)
    fig.savefig(COORDINATES, dpi=110, metadata={"Software": None})
    plt.close(fig)


def main() -> None:
    """Update the page and its figures."""
    page = PAGE.read_text(encoding="utf-8")
    for name, make in TABLES.items():
        body = make()
        print(f"{name}\n{body}\n")
        page = re.sub(
            MARKED.format(name), lambda m, body=body: f"{m[1]}{body}\n{m[3]}", page, flags=re.DOTALL
        )
    PAGE.write_text(page, encoding="utf-8")
    figure()
    coordinates_figure()


if __name__ == "__main__":
    main()
