"""Results of chapter 4 of the thesis: the PMMA guide and its 1R model."""

import math
from functools import cache

import numpy as np
from scipy.optimize import brentq

from ..analysis.fit import Frequency, fit
from ..analysis.impact_map import algebraic, by_elements, fit_response, response, with_flexures
from ..base.progress import Progress
from ..data.uncertainty import Estimate
from ..drawing.style import own_style
from ..mechanics.arrays import Real
from ..references import source_model
from ..references.finite_elements import FiniteElements
from ..runs.run import simulate
from .common import (
    BLUE,
    GREEN,
    GREY,
    K_HOWELL,
    K_THESIS,
    PMMA,
    RED,
    K,
    crossings,
    figure_of,
    guide,
    legend,
    panels,
)
from .side_by_side import Drawing, Number, Result

SPAN = 0.5  # duration of the free vibrations [s]


@cache
def swing_of_elements() -> tuple[Real, Real, float]:
    """Return time, displacement and small-motion frequency of the PMMA guide by elements."""
    fe = FiniteElements(guide("PRBDM"), PMMA, elements=16)
    run = fe.transient(SPAN, 1e-4, spectral_radius=0.9)  # Smooth: little damping.
    return run["time"], run["shuttle.x"], float(fe.modes(fe.equilibrium()).frequency[0])


def swing(K_theta: float) -> tuple[Real, Real]:
    """Return time and displacement of the 1R model of the PMMA guide."""
    t = np.linspace(0.0, SPAN, 501)
    return t, response(guide("PRBDM"), {**PMMA, K: K_theta}, t)


def harmonic_amplitude(frequency: float) -> float:
    """Return the amplitude of the 1R model of the PMMA guide, released straight at 1 m/s [m].

    The angle of a 1R guide without gravity is harmonic with the amplitude v/(r omega), for the
    initial velocity v of the shuttle and the length r of the links.
    """
    r = source_model.GAMMA_1R * source_model.PMMA.length
    return r * math.sin(PMMA["release.velocity"] / (r * 2 * math.pi * frequency))


@own_style()
def table_4_1(_: Progress) -> Result:
    """Return the free vibration of the PMMA guide with Howell's K_theta."""
    t, x, small = swing_of_elements()
    f_fe, a_fe = crossings(t, x)
    f, a = crossings(*swing(K_HOWELL))
    ansys_f, ansys_a = 5.6348, 25.4474
    f_thesis, a_thesis = crossings(*swing(K_THESIS))
    in_mode = 1e3 * harmonic_amplitude(small)
    numbers = (
        Number(
            "1R, frequency, Hz; printed error: 2.5296 % above ANSYS",
            f,
            f"{ansys_f * 1.025296:.4f}",
            f_fe,
            within=0.01,
        ),
        Number(
            "1R, amplitude, mm; printed error: 8.2516 % above ANSYS",
            1e3 * a,
            f"{ansys_a * 1.082516:.4f}",
            1e3 * a_fe,
            within=0.01,
        ),
        Number("1R, frequency, Hz, as printed in the row", f, "5.6348", f_fe, within=0.01),
        Number(
            "1R, amplitude, mm, as printed in the row", 1e3 * a, "25.4474", 1e3 * a_fe, within=0.01
        ),
        Number("ANSYS, frequency, Hz", None, "5.6348", f_fe, within=0.001),
        Number("ANSYS, amplitude, mm", None, "25.4474", 1e3 * a_fe, within=0.01),
        Number(
            "1R with K_Θ = 2.5449, amplitude, mm",
            1e3 * a_thesis,
            None,
            1e3 * harmonic_amplitude(f_thesis),
            "exact",
            1e-4,
        ),
        Number("COMSOL 1R, frequency, Hz", f, "5.7940", f_fe, within=0.01),
        Number("COMSOL 1R, amplitude, mm", 1e3 * a, "26.0180", 1e3 * a_fe, within=0.01),
        Number(
            "COMSOL 1R, error recomputed from its row, %",
            100 * (5.7940 / ansys_f - 1),
            "3.3650",
            within=0.01,
        ),
        Number(
            "COMSOL distributed, error recomputed from its row, %",
            100 * (5.8244 / ansys_f - 1),
            "2.8260",
            within=0.01,
        ),
    )
    left, right = panels(1, 2, (8.0, 3.0))
    for axes, K_theta in ((left, K_HOWELL), (right, K_THESIS)):
        axes.plot(t, 1e3 * x, color=GREY, linewidth=4, label="finite elements")
        time, ours = swing(K_theta)
        axes.plot(time, 1e3 * ours, color=BLUE, linewidth=1.2, label=f"1R, K_Θ = {K_theta}")
        axes.set_xlabel("time [s]")
        axes.set_ylim(-32, 42)
        legend(axes, loc="upper right", ncols=2)
    left.set_ylabel("x of the shuttle [mm]")
    return Result(
        "table-4-1",
        "Figures 4.1 and 4.2, table 4.1",
        "free vibration of the PMMA guide, K_Θ = 2.65",
        numbers,
        "The MATLAB row of the table repeats the values of the ANSYS row, but its printed errors "
        "are those of other values, with which our 1R model agrees to 0.6 %. The errors of the two "
        "COMSOL "
        "rows are swapped. The frequency of the 1R is 1.9 % above that of both finite-element "
        "programs, since K_Θ = 2.65 holds for an end force without an end moment.",
        f"""The amplitude depends mostly on the initial velocities. If only the shuttle starts at
1 m/s, the finite elements reach {1e3 * a_fe:.2f} mm. The flexures of a 1R model always move with
the shuttle. The angle of the links is then harmonic, and the amplitude of the shuttle is
r sin(v/(r ω)) with the length r of the links (the exact value in the table). At the frequency of
the elements this is {in_mode:.2f} mm.
The initial velocities thus explain most of the printed 8 %, and K_Θ does not.""",
        (
            Drawing(
                "swing",
                "Free vibration of the PMMA guide: 1R models and finite elements",
                figure_of(left),
            ),
        ),
    )


def k_theta(_: Progress) -> Result:
    """Return K_theta fitted to several results of finite elements."""
    t, x, small = swing_of_elements()
    one = guide("PRBDM")
    free = crossings(t, x)[0]

    def fitted(f: float) -> float:
        return fit(one, [K], Frequency(Estimate(f, 5e-5)), PMMA)[K].value

    times = np.linspace(0.0, SPAN, 301)
    whole = fit_response(one, [K], times, np.interp(times, t, x), PMMA)
    f_source = crossings(*swing(K_THESIS))[0]
    fe = FiniteElements(guide("PRBDM2R"), elements=32)
    steel = float(fe.modes(fe.equilibrium()).frequency[0])

    def near(name: str, found: float) -> Number:
        return Number(name, found, "2.5449", within=0.01, absolute=True, form=".4f")

    numbers = (
        near(f"K_Θ fitted to FE's small-motion frequency, {small:.4f} Hz", fitted(small)),
        near(f"K_Θ fitted to FE's frequency after a start at 1 m/s, {free:.4f} Hz", fitted(free)),
        near("K_Θ fitted to the printed ANSYS frequency, 5.6348 Hz", fitted(5.6348)),
        near("K_Θ fitted to FE's vibration over 0.5 s by least squares", whole.values[K]),
        Number("K_Θ of small deflections, 3 γ", 3 * 0.8517, form=".4f"),
        Number("frequency with K_Θ = 2.5449, Hz", f_source, "5.6348", free, within=0.001),
        Number(
            f"K_Θ of the steel guide fitted to FE's frequency at rest, {steel:.4f} Hz",
            fit(one, [K], Frequency(Estimate(steel, 5e-4)))[K].value,
            form=".4f",
        ),
    )
    return Result(
        "k-theta",
        "Figure 4.3",
        "K_Θ fitted to finite elements",
        numbers,
        "The small-motion frequency, the frequency at 1 m/s and the whole response all give 2.545 "
        "± 0.01. The angle of the 1R guide without gravity is exactly harmonic, so that its "
        "frequency does not depend on the amplitude. The frequency of the elements depends on the "
        "amplitude only slightly.",
        """Two effects explain the remaining difference between 2.545 and our 2.551. First, the
beams of ANSYS have shear and rotary inertia, and our cable elements do not. Second, the
least-squares fit of the thesis is a compromise between amplitude and frequency. One K_Θ does not
fit both guides: gravity deflects the steel guide by a quarter of its length. This stiffens the
elements more than the 1R model, so that the steel guide at rest needs 2.586.""",
    )


IMPACT = {
    **PMMA,
    "release.displacement": -0.12,
    "release.velocity": 0.0,
    "stop.position": 0.02,
    "stop.restitution": 0.7,
    K: K_THESIS,
}
"""The impact of figure 4.4 with the values of listing B.1.4: release at -120 mm, wall at 20 mm."""


@own_style()
def figure_4_4(_: Progress) -> Result:
    """Return the impacts of the PMMA guide by the 1R and by finite elements."""
    one, end = guide("PRBDM"), 0.28
    ours = simulate(one, IMPACT, stop_time=end, step=1e-3)
    bare = {name: x for name, x in IMPACT.items() if name != K}
    theirs = FiniteElements(one, bare, elements=8).transient(end, 5e-5, spectral_radius=0.5)
    model = with_flexures(guide("PRBDM2R"), "2R", axial=True)
    wall = [IMPACT["stop.position"]]
    returned = [
        method(of, wall, [0.0], bare).restitution.item()
        for method, of in ((algebraic, model), (by_elements, model))
    ]
    a, b = ours.impacts, theirs.impacts
    numbers = (
        Number("first impact: time, s", a[0].time, None, b[0].time, within=0.01),
        Number(
            "first impact: closing speed, m/s",
            a[0].latched.approach_speed,
            None,
            b[0].latched.approach_speed,
            within=0.01,
        ),
        Number(
            "second impact: closing speed, m/s",
            a[1].latched.approach_speed,
            None,
            b[1].latched.approach_speed,
            within=0.05,
        ),
        Number("second impact: time, s", a[1].time, None, b[1].time, within=0.01),
        Number(
            "modal restitution, 1R",
            0.7,
            None,
            returned[1],
            within=0.01,
            absolute=True,
            form=".3f",
        ),
        Number(
            "modal restitution, 2R with stretching flexures",
            returned[0],
            None,
            returned[1],
            within=0.01,
            absolute=True,
            form=".3f",
        ),
    )
    (axes,) = panels(1)
    axes.plot(
        theirs["time"], 1e3 * theirs["shuttle.x"], color=GREY, linewidth=4, label="finite elements"
    )
    axes.plot(ours["time"], 1e3 * ours["shuttle.x"], color=BLUE, linewidth=1.2, label="1R")
    axes.axhline(1e3 * IMPACT["stop.position"], color=RED, linewidth=0.8)
    axes.set_xlabel("time [s]")
    axes.set_ylabel("x of the shuttle [mm]")
    legend(axes)
    return Result(
        "figure-4-4",
        "Figure 4.4",
        "impacts of the PMMA guide, restitution 0.7",
        numbers,
        "The thesis reports a good match of 1R and ANSYS. Here the 1R reaches the wall as the "
        "elements do, but rebounds too fast. Each PMMA flexure has a tenth of the shuttle's mass. "
        "Newton's law stops the shuttle and not the flexures, so that the modal restitution of "
        "the elements is below 0.7. The 2R has about three quarters of this effect, the 1R none "
        "of it.",
        "The thesis does not state how the contact element of ANSYS uses its coefficient; the "
        "curve of ANSYS follows the 1R. Release and wall are those of listing B.1.4, -120 mm and "
        "20 mm.",
        (
            Drawing(
                "impact",
                "Impacts of the PMMA guide by the 1R model and finite elements",
                figure_of(axes),
            ),
        ),
    )


@own_style()
def figure_4_5(progress: Progress) -> Result:
    """Return the free vibration with Coulomb friction, and the amplitudes from a work balance."""
    one, mu_N = guide("PRBDM"), 0.1  # N
    values = {
        **PMMA,
        K: K_THESIS,
        "release.displacement": -0.03,
        "release.velocity": 0.0,
        "friction.coefficient": 0.2,
        "friction.normal_force": mu_N / 0.2,
    }
    run = simulate(one, values, stop_time=1.2, step=1e-3)
    more = simulate(one, values | {"friction.normal_stiffness": 200.0}, stop_time=1.2, step=1e-3)
    x = run["shuttle.x"]
    turns = np.abs(
        x[[i for i in range(1, len(x) - 1) if (x[i] - x[i - 1]) * (x[i + 1] - x[i]) < 0]]
    )
    r, L = 0.8517 * 0.2, 0.2
    k = 2 * 0.8517 * K_THESIS * source_model.PMMA.EI / L

    def next_turn(before: float) -> float:
        a = math.asin(before / r)
        return brentq(
            lambda b: 2 * k * (a * a - b * b) - mu_N * r * (math.sin(a) + math.sin(b)), 0.0, a
        )

    progress(0.5)
    expected = [0.03]
    for _ in range(4):
        expected.append(r * math.sin(next_turn(expected[-1])))
    numbers = tuple(
        Number(
            f"amplitude after half cycle {n}, mm",
            1e3 * turns[n - 1],
            None,
            1e3 * expected[n],
            "exact",
            1e-3,
        )
        for n in (1, 2, 3, 4)
    )
    (axes,) = panels(1)
    axes.plot(run["time"], 1e3 * x, color=BLUE, label="constant normal force")
    axes.plot(
        more["time"],
        1e3 * more["shuttle.x"],
        color=GREEN,
        linewidth=1.0,
        label="normal force decreasing with the deflection",
    )
    axes.set_xlabel("time [s]")
    axes.set_ylabel("x of the shuttle [mm]")
    legend(axes)
    return Result(
        "figure-4-5",
        "Figure 4.5",
        "free vibration with Coulomb friction",
        numbers,
        "The thesis gives no numbers for its simplified friction, a force against the motion "
        "that is largest as the guide passes its neutral position. Our law is the same, with "
        "stick and slip as discrete states. Its amplitudes are compared with the work of the "
        "force, 2 k (Θ₁² - Θ₂²) = μ N (x₁ + x₂).",
        "",
        (Drawing("friction", "Free vibrations stopped by friction", figure_of(axes)),),
    )
