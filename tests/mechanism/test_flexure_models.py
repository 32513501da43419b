"""Flexure models, compared with beam theory and finite elements, and the page of the results."""

import math
import re
from dataclasses import replace
from itertools import chain

import numpy as np
import pytest
from scipy.integrate import solve_bvp

import finite_elements
import flexure_models as models
from prbm.base.errors import EquilibriumError, ParameterError
from prbm.mechanics.assembly import assemble
from prbm.mechanics.forces import elastic_energy
from prbm.mechanics.modal import modal_restitution, modes
from prbm.mechanics.statics import equilibrium
from prbm.mechanism.flexure import BEAM, MODELS, segments
from prbm.references.beams import end_force, end_moment, wavenumber
from prbm.references.finite_elements import FiniteElements
from support import ROOT, mechanism

PAGE = (ROOT / "docs" / "flexure-models.md").read_text(encoding="utf-8")


# --- beam theory --------------------------------------------------------------------------------


@pytest.mark.parametrize("load", [0.01, 1.0, -3.0, 8.0])
def test_elliptic_integrals_agree_with_a_boundary_value_problem_of_the_elastica(load):
    """The problem is theta'' = -alpha cos theta, theta(0) = theta'(1) = 0, z' = exp(i theta)."""

    def rate(s, y):
        return np.array([y[1], -load * np.cos(y[0]), np.cos(y[0]), np.sin(y[0])])

    def ends(a, b):
        return np.array([a[0], b[1], a[2], a[3]])

    s = np.linspace(0, 1, 41)
    guess = np.array([load * s / (1 + abs(load)), 0 * s, s, 0 * s])
    found = solve_bvp(rate, ends, s, guess, tol=1e-10, max_nodes=20000)
    assert found.success
    tip = end_force(load)
    assert tip.slope == pytest.approx(found.y[0, -1], abs=1e-8)
    assert tip.z == pytest.approx(complex(found.y[2, -1], found.y[3, -1]), abs=1e-8)


def test_a_beam_with_a_heavy_tip_has_the_frequencies_of_a_massless_beam():
    """Without inertia, omega^2 = 3 EI/(m_tip L^3); with it, omega^2 solve a 2 x 2 problem."""
    assert wavenumber(1, 1e6) ** 4 == pytest.approx(3e-6, rel=1e-6)
    stiffness = np.array([[12.0, -6.0], [-6.0, 4.0]])
    omega2 = np.linalg.eigvals(stiffness / np.array([[1e6], [3e5]]))
    found = [wavenumber(mode, 1e6, 3e5) ** 4 for mode in (1, 2)]
    np.testing.assert_allclose(found, np.sort(omega2), rtol=1e-5)


# --- cantilevers --------------------------------------------------------------------------------

FORCE_ERRORS = {  # % of the displacement
    "1R": 3.8, "2R": 1.0, "3R": 2.3, "beam": 0.003, "10R": 0.51, "40R": 0.033,
}  # fmt: skip


@pytest.mark.parametrize("model", FORCE_ERRORS)
def test_tip_displacements_under_an_end_force_are_those_of_the_elastica(model):
    """The limit is the error of the model; the opposite force gives the mirrored shape."""
    system = models.cantilever(model)
    for load in (1e-3, 0.1, 0.5, 1.0, 2.0, 4.0, 6.0, 8.0):
        tips = [models.tip_of(system, force=sign * load) for sign in (1, -1)]
        assert models.displacement_error(tips[0], end_force(load)) < FORCE_ERRORS[model]
        assert tips[1].z == pytest.approx(tips[0].z.conjugate(), abs=1e-12)
        assert tips[1].slope == pytest.approx(-tips[0].slope, abs=1e-12)


SLOPES = {name: model.end_slope for name, model in MODELS.items() if model.coefficients}
SLOPES |= {"beam": 1.0, "10R": 1.0, "40R": 1.0}


@pytest.mark.parametrize("model", SLOPES)
def test_the_tip_slope_under_an_end_moment_is_the_sum_of_the_compliances(model):
    """Every spring carries the whole moment.  The slope of chains is exact."""
    system = models.cantilever(model)
    for load in (0.1, -1.0, math.pi):
        slope = models.tip_of(system, moment=load).slope
        assert slope == pytest.approx(SLOPES[model] * load, rel=1e-9)
    if model.endswith("0R"):
        tip = models.tip_of(system, moment=math.pi)
        assert (
            models.displacement_error(tip, end_moment(math.pi)) < {"10R": 0.25, "40R": 0.02}[model]
        )


def test_a_chain_converges_to_the_elastica_at_second_order():
    """The observed order is 2.00 +- 0.05 under a force and under a moment."""
    for kind, load, exact in (("force", 8.0, end_force), ("moment", math.pi, end_moment)):
        errors = [
            models.displacement_error(models.tip_of(models.cantilever(f"{n}R"), **{kind: load}),
                                      exact(load))
            for n in (5, 10, 20, 40)
        ]  # fmt: skip
        assert models.order((5, 10, 20, 40), errors) == pytest.approx(2.0, abs=0.05)


FREQUENCY_ERRORS = {  # Largest errors of f1 and f2 [%] with tip masses (no inertia).
    "1R": (5.9, None), "2R": (1.3, 14.0), "3R": (3.1, 2.1), "beam": (0.003, 0.6),
    "10R": (0.5, 1.6), "40R": (0.03, 0.11),
}  # fmt: skip


@pytest.mark.parametrize("model", FREQUENCY_ERRORS)
def test_frequencies_with_a_body_at_the_tip_are_those_of_the_beam(model):
    """The limit of the difference is the error of the model."""
    for tip in ((0.0, 0.0), (0.3, 0.0), (1.0, 0.0), (10.0, 0.0)):
        system = models.cantilever(model, tip)
        for mode, bound in enumerate(FREQUENCY_ERRORS[model], start=1):
            error = models.frequency_error(system, tip, mode)
            assert (error is None) == (bound is None)
            assert error is None or abs(error) < bound


@pytest.mark.slow
@pytest.mark.parametrize("tip", [(0.0, 0.0), (1.0, 0.0), (1.0, 0.1), (0.2, 0.03)])
@pytest.mark.parametrize("mode", [1, 2, 3])
def test_frequencies_of_a_chain_converge_to_those_of_the_beam_at_second_order(tip, mode):
    errors = [abs(models.frequency_error(models.cantilever(f"{n}R", tip), tip, mode))
              for n in (10, 20, 40, 80)]  # fmt: skip
    assert models.order((10, 20, 40, 80), errors) == pytest.approx(2.0, abs=0.1)


def test_an_axial_force_stretches_a_flexure_by_the_elongation_of_a_bar():
    """The elongation is P L/EA: of one link of the 2R and 3R, all links of a chain, or a beam."""
    EA = models.MODULUS * models.WIDTH * models.THICKNESS
    pull = 1e-4 * EA  # The logarithmic strain is linear in the force: the error is of second order.
    for model in ("2R", "3R", "10R", "beam"):
        system = models.cantilever(model, axial=True)
        q = equilibrium(system, loads={"force.x": pull}).q
        probe = system.probes[0]
        tip = complex(probe.A @ system.directions(q)) + probe.c
        assert (tip / models.L - 1).real == pytest.approx(1e-4, rel=1e-3)


# --- statics under loads ------------------------------------------------------------------------


def test_the_work_of_loads_is_the_change_of_elastic_energy():
    """A small increase of force and moment at a large deflection does the work P dz = dV."""
    system = models.cantilever("3R")
    forces = np.array([3.0, -2.0, 0.7]) * models.EI / models.L**2 * np.array([1, 1, models.L])

    def shape(factor):
        loads = dict(zip(("force.x", "force.y", "force.moment"), factor * forces, strict=True))
        q = equilibrium(system, loads=loads).q
        tip = system.bodies["tip"]
        z = complex(tip.A @ system.directions(q))
        return np.array([z.real, z.imag, q[tip.j]]), elastic_energy(system.K, q - system.q0)

    (low, V_low), (high, V_high) = shape(1 - 1e-4), shape(1 + 1e-4)
    assert V_high - V_low == pytest.approx(forces @ (high - low), rel=1e-6)


def test_gravity_and_an_equal_force_at_the_centre_of_mass_give_one_shape():
    """The frequencies about the two shapes agree, too."""
    heavy = models.cantilever("3R", (1e4, 1e3))
    m = heavy.values["tip.mass"]
    g = 8.0 * models.EI / models.L**2 / m
    weighed = replace(heavy, values={**heavy.values, "gravity.y": g})
    shapes = equilibrium(weighed), equilibrium(heavy, loads={"force.y": m * g})
    np.testing.assert_allclose(
        shapes[0].q, shapes[1].q, atol=1e-3
    )  # Gravity acts on the flexure as well.
    f = modes(weighed, shapes[0]).frequency, modes(heavy, shapes[1]).frequency
    np.testing.assert_allclose(f[0][:2], f[1][:2], rtol=1e-3)


def test_the_holding_force_applied_as_a_load_gives_the_held_shape():
    """The frequencies about both shapes agree."""
    system = models.cantilever("2R")
    held = equilibrium(system, 0.6 * models.L)
    loaded = equilibrium(system, loads={"force.y": held.force})
    np.testing.assert_allclose(loaded.q, held.q, atol=1e-9)
    f = modes(system, held).frequency, modes(system, loaded).frequency
    np.testing.assert_allclose(f[0], f[1], rtol=1e-7)


def test_invalid_loads_are_rejected():
    system = models.cantilever("2R")
    with pytest.raises(ParameterError, match=r"'force.z'; did you mean force"):
        equilibrium(system, loads={"force.z": 1.0})
    with pytest.raises(ParameterError, match=r"force.x = nan"):
        equilibrium(system, loads={"force.x": math.nan})
    guide = mechanism("PRBDM2R")
    with pytest.raises(EquilibriumError, match=r"beyond .* % of gravity and the loads"):
        equilibrium(assemble(guide, guide.values()), 0.2, {"force.y": 1.0})


# --- the guide ----------------------------------------------------------------------------------

GUIDES = {  # Rest position [mm], f1, f2, f3 at rest, f1 straight [Hz]; by independent programs.
    "1R": (10.42, 4.957, None, None, 4.726),
    "2R": (10.78, 4.889, 115.9, 182.9, 4.624),
    "3R": (10.95, 4.854, 147.7, 233.2, 4.590),
    "40R": (10.73, 4.904, 129.9, 208.6, 4.638),
}  # fmt: skip


def test_every_model_has_limits_of_its_errors():
    """The recipe for a flexure model in CONTRIBUTING.md says where the numbers come from."""
    every = set(models.MODELS)
    assert set(FORCE_ERRORS) == set(FREQUENCY_ERRORS) == every
    assert set(GUIDES) >= set(models.PUBLISHED)


HALF_DIGITS = (5e-3, 5e-4, 0.05, 0.05, 5e-4)


@pytest.mark.parametrize("model", GUIDES)
def test_rest_position_and_frequencies_of_the_steel_guide_are_those_of_other_programs(model):
    """The values agree in all digits given."""
    found = models.guide_figures(model)[[0, 1, 2, 3, 6]]
    for x, expected, half in zip(found, GUIDES[model], HALF_DIGITS, strict=True):
        assert math.isnan(x) if expected is None else abs(x - expected) <= 1.01 * half


@pytest.mark.slow
@pytest.mark.parametrize(("axial", "ns"), [(False, (5, 10, 20, 40)), (True, (5, 10, 20, 40, 80))])
def test_a_chain_guide_converges_at_second_order(axial, ns):
    """The errors are relative to the Richardson limit of the chains.

    Bounce and pitch need more links to reach this order: their slope is 1.2 from 5 to 10 links.
    """
    figures = np.array([models.guide_figures(f"{n}R", axial=axial) for n in ns])
    errors = np.abs(figures / models.richardson(list(figures)) - 1)
    for i in (0, 1, 4, 5, 6):  # rest position, f1, modes of the flexures, f1 straight
        assert models.order(ns, errors[:, i]) == pytest.approx(2.0, abs=0.1)
    for i in (2, 3):  # bounce, pitch
        assert models.order(ns[-2:], errors[-2:, i]) == pytest.approx(2.0, abs=0.1)


@pytest.mark.slow
def test_the_limit_of_axially_compliant_chains_is_that_of_finite_elements():
    """The limit agrees to the last digit of the finite elements; bounce and pitch to 1.5e-4.

    The extrapolation from 80 links has an error of 5e-5 in bounce and pitch.
    """
    figures = [models.guide_figures(f"{n}R", axial=True) for n in (20, 40, 80)]
    limit, exact = models.richardson(figures)[:6], np.array(models.FE_GUIDE)
    last_digit = np.array([1e-4, 1e-4, np.nan, np.nan, 0.01, 0.01])
    for i in (0, 1, 4, 5):
        assert abs(limit[i] - exact[i]) <= last_digit[i]
    np.testing.assert_allclose(limit[2:4], exact[2:4], rtol=1.5e-4)
    chains = [
        [models.guide_figures(f"{n}R", axial=axial) for n in (10, 20, 40)] for axial in (0, 1)
    ]
    rigid, axial = (models.richardson(figures)[2:4] for figures in chains)
    assert rigid / axial - 1 == pytest.approx([0.0025, 0.0021], abs=1e-4)


@pytest.mark.slow
def test_the_finite_element_figures_of_the_page_are_reproduced():
    """The tolerance is 1e-4, because the Jacobians of the finite elements are differences."""
    values = mechanism("PRBDM2R").values()
    found = finite_elements.guide(values, 64)
    exact = np.array([1e3 * found.rest.real, *found.frequency[:5]])
    np.testing.assert_allclose(models.FE_GUIDE, exact, rtol=1e-4)
    straight = finite_elements.guide({**values, "gravity.x": 0.0}, 32)
    assert straight.frequency[0] == pytest.approx(models.FE_STRAIGHT, rel=1e-4)
    chains = [models.guide_figures(f"{n}R", axial=True) for n in (20, 40, 80)]
    np.testing.assert_allclose(models.richardson(chains)[:6], exact, rtol=1e-4)


@pytest.mark.parametrize("elements", [2, 4, 8])
def test_finite_elements_of_the_figure_are_reproduced(elements):
    """The figure has their number of coordinates without constraints."""
    pytest.importorskip("exudyn", reason="finite elements need exudyn: pip install exudyn")
    fe = FiniteElements(mechanism("PRBDM2R"), elements=elements)
    shape = fe.equilibrium()
    frequency = fe.modes(shape).frequency
    assert models.element_coordinates(elements) == len(frequency)
    found = [1e3 * fe.displacement(shape.q), *frequency[:5]]
    np.testing.assert_allclose(found, models.FE_CONVERGENCE[elements], rtol=1e-5)


# --- axial compliance ---------------------------------------------------------------------------


@pytest.mark.parametrize(("model", "axial", "error"), [
    ("2R", True, 0.003), ("beam", True, 0.003), ("1R", True, 0.0135),
    ("3R", True, 0.006), ("2R", False, 0.0485),
    pytest.param("40R", True, 0.0005, marks=pytest.mark.slow),
])  # fmt: skip
def test_modal_restitution_is_that_of_finite_elements(model, axial, error):
    """The limit at nine hit points is the error of the model, without tuning."""
    assert models.restitution_error(model, axial=axial) < error


def test_an_off_centre_hit_lowers_modal_restitution_only_with_axial_compliance():
    """At an offset of 4 mm and eps = 0.6 it falls from 0.596 to 0.548 with axial compliance."""
    rigid, axial = (models.guide("2R", axial=axial) for axial in (False, True))
    found = []
    for guide in (rigid, axial):
        system = assemble(guide, guide.values({"gravity.x": 0.0, "stop.offset": 4e-3}))
        found.append(modal_restitution(system, equilibrium(system, 0.0), 0, 0.6))
    assert found[0] == pytest.approx(0.6, abs=5e-3)
    assert found[1] == pytest.approx(models.FE_RESTITUTION[4][1], abs=0.004)


def test_axial_compliance_hardly_changes_bounce_and_pitch():
    """The frequencies of the 2R are 11.4 and 13.0 % below those of finite elements.

    Without axial compliance they are 11.3 and 12.8 % below.
    """
    for axial, errors in ((True, (-0.1144, -0.1299)), (False, (-0.1127, -0.1285))):
        found = models.guide_figures("2R", axial=axial)
        ratios = found[2:4] / np.array(models.FE_GUIDE[2:4]) - 1
        assert ratios == pytest.approx(errors, abs=1e-3)
    rigid, axial = (models.guide_figures("2R", axial=axial)[[0, 1, 6]] for axial in (False, True))
    np.testing.assert_allclose(axial, rigid, rtol=1e-5)


# --- masses ---


@pytest.mark.parametrize("name", [name for name in MODELS if name != BEAM])
def test_the_mass_of_the_segments_is_that_of_the_flexure_except_for_the_1R(name):
    """The 1R has 0.73 of the mass, half of it at each pivot."""
    model = replace(MODELS[name], links=4 if name == "nR" else 0)
    gamma, K_theta = ([c.value for c in part] for part in (model.gamma, model.K_theta))
    found = segments(model, gamma, K_theta, ("clamp", "clamp"), 0.2, 1.0, 1.0)
    lumped = 1 / 4 + 1 / (12 * 0.8517**2) if name == "1R" else 0.0
    assert max(found.lumps) == pytest.approx(lumped)
    assert round(lumped, 3) in (0.0, 0.365)
    assert sum(found.rods) + sum(found.lumps) == pytest.approx(2 * lumped or 1.0)


# --- the page -----------------------------------------------------------------------------------


def cells(table):
    """Return the rows of cells of a Markdown table."""
    return [[c.strip() for c in line.strip("|").split("|")] for line in table.splitlines()]


def unit_of_last_digit(number):
    return 10.0 ** -len(number.partition(".")[2])


TABLES = (
    "coefficients", "beams", "end force", "end moment", "frequencies", "guide", "restitution",
    "heavy flexures", "stress",
)  # fmt: skip


@pytest.mark.parametrize("name", TABLES)
def test_the_tables_of_the_page_are_reproduced(name):
    """Numbers agree to one unit of their last digit."""
    now, page = (cells(t) for t in (models.TABLES[name](), models.shown(PAGE, name)))
    assert [len(row) for row in now] == [len(row) for row in page]
    for new, old in zip(chain(*now), chain(*page), strict=True):
        try:
            expected = float(old)
        except ValueError:
            assert new == old
        else:
            assert abs(float(new) - expected) <= 1.01 * unit_of_last_digit(old)


def test_the_page_has_all_tables_and_figures():
    assert set(models.TABLES) == set(TABLES)
    assert PAGE.count("<!-- table:") == len(models.TABLES)
    for figure in (models.FIGURE, models.COORDINATES):
        assert figure.is_file()
        assert figure.name in PAGE


def test_the_block_of_the_page_runs(capsys):
    (block,) = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    exec(compile(block, "flexure-models.md", "exec"), {})
    assert re.fullmatch(r"f1 = \d\.\d{3} Hz, stable\n", capsys.readouterr().out)


@pytest.mark.slow
def test_the_figures_are_drawn(tmp_path, monkeypatch):
    monkeypatch.setattr(models, "FIGURE", tmp_path / "figures" / "models.png")
    monkeypatch.setattr(models, "CHAINS", (5, 10, 20))
    monkeypatch.setattr(models, "COORDINATES", tmp_path / "figures" / "coordinates.png")
    models.figure()
    models.coordinates_figure()
    assert models.FIGURE.stat().st_size > 20_000
    assert models.COORDINATES.stat().st_size > 10_000
