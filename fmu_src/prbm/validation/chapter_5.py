"""Results of chapter 5 of the thesis: measurements of the steel guide.

The records are synthetic: known parameters, with the noise of the sensors of the thesis.
"""

from dataclasses import replace

import numpy as np
from scipy.optimize import brentq

from ..analysis.fit import Frequency, fit, fitted_restitution
from ..analysis.impact_map import response
from ..base.progress import Progress
from ..data.measurement import Beam, youngs_modulus
from ..data.series import Series
from ..data.uncertainty import Estimate
from ..data.vibration import free_vibration
from ..drawing.style import own_style
from ..mechanics.assembly import assemble
from ..mechanics.modal import modal_restitution, modes
from ..mechanics.statics import equilibrium
from ..references.finite_elements import FiniteElements
from .common import (
    BLUE,
    COVERAGE_ATOL,
    DRAWS,
    FORCE_NOISE,
    GREY,
    K_THESIS,
    LASER_NOISE,
    LASER_RATE,
    RED,
    WEIGHTLESS,
    K,
    figure_of,
    frequencies,
    guide,
    legend,
    panels,
    peak_frequency,
)
from .side_by_side import Drawing, Number, Result
from .synthetic_records import bent, vibration

E, LENGTH, WIDTH, THICKNESS = 181.5e9, 40e-3, 8e-3, 0.1e-3  # Pa, m


def covered(hits: int) -> Number:
    """Return the share of records whose error is within one standard uncertainty."""
    return Number(
        f"share of {DRAWS} records within one stated uncertainty",
        hits / DRAWS,
        None,
        0.683,
        "law",
        COVERAGE_ATOL,
        True,
        ".3f",
    )


def figure_5_1(_: Progress) -> Result:
    """Return the modal analysis of the thesis, repeated with our elements."""
    script = {
        "flexure.youngs_modulus": 180e9,
        "flexure.density": 1.0,
        "shuttle.mass": 53e-3,
        "shuttle.inertia": 1e-9,
        "gravity.x": 0.0,
    }
    two = guide("PRBDM2R")
    fe = FiniteElements(two, script, elements=8)

    def second(x: float) -> float:
        return float(fe.modes(fe.equilibrium(x)).frequency[1])

    deflected = fe.modes(fe.equilibrium(10e-3)).frequency
    under_weight = FiniteElements(two, script | {"gravity.x": 9.81}, elements=8)
    rest = under_weight.modes(under_weight.equilibrium()).frequency
    at_136 = brentq(lambda x: second(x) - 136.0, 10e-3, 10.8e-3, xtol=1e-5)
    own = frequencies(two, script, 10e-3)
    numbers = (
        Number("f1 at 10 mm, Hz (listing B.2.2)", own[0], "4.8", deflected[0], within=0.02),
        Number(
            "f1 at rest under gravity, Hz",
            frequencies(two, script | {"gravity.x": 9.81})[0],
            "4.8",
            rest[0],
            within=0.03,
        ),
        Number("f2 at 10 mm, Hz", None, "136", deflected[1], within=0.05),
        Number("f2 at rest under gravity, Hz", None, "136", rest[1], within=0.05),
        Number("deflection at which f2 is 136 Hz, mm", None, "10", 1e3 * at_136, within=0.05),
        Number("f2 at 10 mm, 2R, Hz", own[1], None, deflected[1]),
    )
    return Result(
        "figure-5-1",
        "Figure 5.1, section 5.3",
        "modal analysis of the steel structure",
        numbers,
        "With the values of listing B.2.2 (180 GPa, massless flexures, a point mass without "
        "rotary inertia) our elements have f2 = 136 Hz at 10.4 mm. The second frequency f2 falls "
        'steeply with the deflection. The 136 Hz printed for "10 mm deflected" thus agrees both '
        "with a guide held at 10 mm and with a guide at rest under gravity. The printed 4.8 Hz is "
        "rounded.",
        "The values of the figure itself are only in a picture; the text quotes 4.8 Hz and 136 Hz. "
        "The 2R underestimates f2 at all deflections.",
    )


FREE_FALL = {"release.displacement": 0.0, "stop.position": 0.03, "damping.beta": 0.0}
"""Release of the straight guide under gravity, with the wall out of reach."""


def elements_of_steel(_: Progress) -> Result:
    """Return the steel guide by the 2R and by finite elements, and the convergence of these."""
    two = guide("PRBDM2R")
    found = {}
    for count in (16, 32):
        fe = FiniteElements(two, elements=count)
        rest = fe.equilibrium()
        light = FiniteElements(two, WEIGHTLESS, elements=count)
        straight = light.modes(light.equilibrium()).frequency[0]
        found[count] = [1e3 * fe.displacement(rest.q), *fe.modes(rest).frequency[:3], straight]
    system = assemble(two, two.values())
    shape = equilibrium(system)
    own = [
        1e3 * system.amount(shape.q),
        *modes(system, shape).frequency[:3],
        frequencies(two, WEIGHTLESS)[0],
    ]
    names = (
        "rest position, mm",
        "f1 at rest, Hz",
        "f2 at rest, Hz",
        "f3 at rest, Hz",
        "f1 straight, no gravity, Hz",
    )
    limits = (0.01, 0.005, None, None, 0.005)
    numbers = [
        Number(name, float(ours), None, float(fe), within=limit, form=".6g")
        for name, ours, fe, limit in zip(names, own, found[32], limits, strict=True)
    ]
    change = max(abs(a / b - 1) for a, b in zip(found[16], found[32], strict=True))
    t = np.linspace(0.0, 1.0, 1001)
    swing = response(guide("PRBDM"), {K: K_THESIS} | FREE_FALL, t)
    elements = FiniteElements(two, FREE_FALL, elements=8).transient(1.0, 5e-4, spectral_radius=0.9)
    theirs = peak_frequency(elements["time"], elements["shuttle.x"])
    numbers += [
        Number("f1 measured, ± 0.06 Hz", None, "4.82", float(found[32][1]), within=0.0125),
        Number(
            "1R with K_Θ = 2.5449 released straight, Hz",
            peak_frequency(t, swing),
            "4.8224",
            theirs,
            within=0.001,
        ),
    ]
    return Result(
        "finite-elements",
        "Sections 3.2 and 5.5",
        "steel guide by 32 elements per flexure",
        tuple(numbers),
        "Rest position and fundamental frequency of the 2R are within 0.6 % of the elements; its "
        "second and third frequency are 11 to 13 % too low. The measured 4.82 ± 0.06 Hz is 1.8 % "
        "below that of the elements, which is 1.4 times the uncertainty, if 181.5 GPa and 0.1 mm "
        "are exact. The frequency is proportional to the thickness to the power 1.5, so that a "
        "thickness 1.2 µm below the nominal 100 µm explains the difference.",
        f"Between 16 and 32 elements no number changes by more than a fraction of {change:.1e}. "
        "The printed 4.8224 Hz of the 1R is neither its frequency at rest nor that of its free "
        "vibration with the printed parameters; the cause is unknown.",
    )


def steel_beam() -> Beam:
    """Return a flexure as a cantilever, its dimensions exact."""
    return Beam("flexure", Estimate(LENGTH, 0.0), Estimate(WIDTH, 0.0), Estimate(THICKNESS, 0.0))


@own_style()
def figure_5_4(_: Progress) -> Result:
    """Return Young's modulus from a synthetic bending test."""
    stiffness = E * WIDTH * THICKNESS**3 / (4 * LENGTH**3)
    rng = np.random.default_rng(0)
    d, F = bent(rng, 12000, 10, stiffness, 3e-3, FORCE_NOISE)
    found = youngs_modulus(d, F, steel_beam(), window=10)
    hits = 0
    for _draw in range(DRAWS):
        one = youngs_modulus(
            *bent(rng, 600, 1, stiffness, 3e-3, FORCE_NOISE), steel_beam(), window=3
        )
        hits += abs(one.modulus.value - E) < one.modulus.uncertainty
    numbers = (
        Number("E, GPa", 1e-9 * found.modulus.value, "181.5", 1e-9 * E, "true", 0.01, form=".2f"),
        Number("standard uncertainty of E, GPa", 1e-9 * found.modulus.uncertainty, form=".2f"),
        covered(hits),
    )
    (axes,) = panels(1)
    axes.plot(1e3 * d, 1e3 * F, ".", color=GREY, markersize=1, label="samples")
    x, y = found.points
    axes.plot(1e3 * x, 1e3 * y, ".", color=BLUE, markersize=3, label="averaged over 10")
    ends = np.array(found.fit_range)
    axes.plot(1e3 * ends, [1e3 * found.fit.at(end) for end in ends], color=RED, label="fitted line")
    axes.set_xlabel("deflection [mm]")
    axes.set_ylabel("force [mN]")
    legend(axes)
    return Result(
        "figure-5-4",
        "Figure 5.4",
        "Young's modulus of a flexure",
        numbers,
        "Ten cycles of a flexure bent by 17 mN, with a load cell of 0.5 N and 0.2 % of noise, "
        "determine E to a few parts in a thousand. The thickness contributes more: 1 µm changes "
        "E by 3 %. The thesis states neither uncertainty.",
        "",
        (Drawing("bending", "A synthetic bending test of a steel flexure", figure_of(axes)),),
    )


@own_style()
def figure_5_5(_: Progress) -> Result:
    """Return frequency and damping from synthetic records of a free vibration."""
    rng = np.random.default_rng(0)
    tiny = free_vibration(vibration(rng, 6.88e-9, 10.0, 10e-3))
    series = vibration(rng, 1e-3, 10.0, 10e-3)
    some = free_vibration(series)
    hits = {"frequency": 0, "zeta": 0}
    for _draw in range(DRAWS):
        one = free_vibration(vibration(rng, 2e-3, 3.0, 1e-3))
        hits["frequency"] += abs(one.frequency.value - 4.82) < one.frequency.uncertainty
        hits["zeta"] += abs(one.zeta.value - 2e-3) < one.zeta.uncertainty
    smallest = tiny.zeta.uncertainty
    numbers = (
        Number("frequency, Hz", tiny.frequency.value, "4.82", 4.82, "true", 0.01, True, ".6f"),
        Number("standard uncertainty of the frequency, Hz", tiny.frequency.uncertainty, form=".1e"),
        Number(
            "ζ, record with ζ = 6.88e-9",
            tiny.zeta.value,
            "6.88e-9",
            6.88e-9,
            "true",
            form=".1e",
        ),
        Number("standard uncertainty of this ζ", smallest, form=".1e"),
        Number("ζ, record with ζ = 1e-3", some.zeta.value, None, 1e-3, "true", 0.1, form=".4e"),
        replace(covered(hits["frequency"]), name=f"frequency: {covered(0).name}"),
        replace(covered(hits["zeta"]), name=f"ζ: {covered(0).name}"),
    )
    (axes,) = panels(1, size=(7.0, 2.6))
    part = series.time < 1.0
    axes.plot(series.time[part], 1e3 * series.values[part], ".", color=BLUE, markersize=2)
    axes.set_xlabel("time [s]")
    axes.set_ylabel("x of the shuttle [mm]")
    return Result(
        "figure-5-5",
        "Figures 5.5 and 7",
        "free vibration: frequency and damping",
        numbers,
        "A fit of a damped sine determines the frequency a hundred thousand times more accurately "
        "than the ± 0.06 Hz of the spectrum in the thesis. **The printed ζ = 6.88e-9 is too small "
        f"to be measured**: ten seconds with this laser resolve {smallest:.0e}. For a synthetic "
        f'record with this ζ the evaluation reports "{tiny.damping}".',
        "With this damping ratio the time constant 1/(ζ ω) would be 55 days. Neither "
        "interpretation of eq. 3.16 makes the number plausible; it is not a default of this "
        "package.",
        (
            Drawing(
                "vibration",
                "The first second of a synthetic record: 4.82 Hz, 4 µm at 750 Hz",
                figure_of(axes),
            ),
        ),
    )


@own_style()
def figure_5_6(progress: Progress) -> Result:
    """Return the restitution of a 1R fitted to a centred impact of a 2R that stretches."""
    one, axial = guide("PRBDM"), guide("PRBDM2RAxial")
    rng = np.random.default_rng(0)
    t = np.arange(105) / LASER_RATE
    x = response(axial, {}, t)
    progress(0.2)
    series = Series(t, x + LASER_NOISE * rng.standard_normal(len(t)))
    rest = Frequency(Estimate(float(frequencies(axial, {})[0]), 1e-4))
    values = {K: fit(one, [K], rest)[K].value, "release.displacement": -0.018}
    found = fitted_restitution(one, series, values)["stop.restitution"]
    progress(0.6)
    system = assemble(axial, axial.values())
    pure = modal_restitution(system, equilibrium(system, 0.0), 0, 0.6)
    own = response(one, values, t)
    back = fitted_restitution(
        one,
        Series(t, own + LASER_NOISE * rng.standard_normal(len(t))),
        values | {"stop.restitution": 0.5},
    )["stop.restitution"]
    numbers = (
        Number(
            "restitution of the 1R fitted to a 2R with stretching flexures",
            found.value,
            "0.6",
            pure,
            "pure mode",
            0.01,
            True,
            ".4f",
        ),
        Number("standard uncertainty of this restitution", found.uncertainty, form=".4f"),
        Number(
            "restitution of the 1R fitted to a 1R",
            back.value,
            None,
            0.6,
            "true",
            0.01,
            True,
            ".4f",
        ),
    )
    fitted = response(one, values | {"stop.restitution": found.value}, t)
    (axes,) = panels(1, size=(7.0, 2.8))
    axes.plot(t, 1e3 * series.values, ".", color=GREY, markersize=5, label="synthetic record")
    axes.plot(
        t, 1e3 * fitted, color=BLUE, linewidth=1.2, label=f"1R, restitution {found.value:.3f}"
    )
    axes.set_xlabel("time [s]")
    axes.set_ylabel("x of the shuttle [mm]")
    legend(axes)
    return Result(
        "figure-5-6",
        "Figures 5.6 and 8",
        "impact on the centre of mass: the fitted restitution",
        numbers,
        "With straight flexures the fitted restitution is slightly below that of the contact, "
        "because the impact does not stop the flexures: 0.59 to 0.60 for a contact with 0.6. The "
        "synthetic record replaces the experiment: 2R with stretching flexures, 750 Hz, 4 µm.",
        "",
        (
            Drawing(
                "restitution",
                "A synthetic record of bounces and the 1R fitted to it",
                figure_of(axes),
            ),
        ),
    )
