"""Maps of the modal restitution: conservation of energy, closed forms, finite elements."""

import csv
import io
import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from prbm.analysis import impact_map
from prbm.analysis.touching import impact_shape, touching_shape
from prbm.base.errors import EquilibriumError, ParameterError
from prbm.data.series import RecordError
from prbm.drawing.style import png
from prbm.hybrid.simulation import Simulation
from prbm.mechanics.assembly import assemble
from prbm.mechanics.contact import response as impulse_response
from prbm.mechanics.kinetics import inertia
from prbm.mechanics.modal import modes, modes_at
from prbm.mechanism.parts import Release
from prbm.plots import impact_map as figures
from support import mechanism

WEIGHTLESS = {"gravity.x": 0.0}
TIMES = np.linspace(0.0, 0.1, 20)
CORNERS = {"walls": (-10e-3, 0.0, 10e-3), "offsets": (-4e-3, 0.0, 4e-3)}


def guide(model="2R", *, axial=False, n=0):
    return impact_map.with_flexures(mechanism("PRBDM2R"), model, axial=axial, n=n)


def test_energies_of_a_pure_mode_add_up():
    """The energies in the modes and the loss in the contact add up to the arriving energy."""
    rng = np.random.default_rng(0)
    for restitution in (0.0, 0.3, 1.0):
        G = rng.standard_normal(6)
        C, after, lost = impact_map.shares(G, restitution)
        assert after.sum() + lost == pytest.approx(1.0, rel=1e-12)
        assert after[0] == pytest.approx(C**2)


@pytest.mark.parametrize("model", ["1R", "2R", "3R"])
@pytest.mark.parametrize("axial", [False, True])
def test_algebraic_restitution_equals_that_of_an_impulse(model, axial):
    """The sum over modes equals the solution with the constrained mass matrix."""
    values = WEIGHTLESS | {"stop.offset": 3e-3, "stop.position": -7e-3}
    system = assemble(m := guide(model, axial=axial), m.values(values))
    shape = impact_shape(system, 0, -7e-3)
    e = system.directions(shape.q)
    M, _ = inertia(system.H, np.diag(system.J), e)
    loops = system.loop_rows.jacobian(e)
    G = system.gap_rows.jacobian(e)[[0]]
    assert system.gap_rows.values(e)[0] - 7e-3 == pytest.approx(0.0, abs=1e-10)
    found = modes(system, shape)
    v = found.shape[:, 0]
    X = impulse_response(M, loops, G, system.length)
    after = v - 1.6 * X[:, 0] * float(G[0] @ v) / float(G[0] @ X[:, 0])
    C = impact_map.algebraic(m, [-7e-3], [3e-3], WEIGHTLESS).restitution.item()
    assert pytest.approx(-(v @ M @ after), abs=1e-9) == C


def test_restitution_of_the_inextensible_1r_is_newtons_at_every_wall_and_offset():
    """With one degree of freedom the motion is the fundamental mode."""
    flat = impact_map.algebraic(guide("1R"), **CORNERS, values=WEIGHTLESS)
    np.testing.assert_allclose(flat.restitution, 0.6, atol=1e-12)
    hit = impact_map.simulated(guide("1R"), [-5e-3], [4e-3], WEIGHTLESS)
    np.testing.assert_allclose(hit.restitution, 0.6, atol=1e-9)


def test_the_closed_form_is_near_the_2r_with_stretching_flexures():
    """The closed form on the 2R's path and the 2R differ by at most 0.0064."""
    closed = impact_map.closed_form(guide(), values=WEIGHTLESS)
    model = impact_map.algebraic(guide(axial=True), values=WEIGHTLESS)
    np.testing.assert_allclose(closed.restitution, model.restitution, atol=0.0064)
    centre = closed.restitution[2, 2]
    assert centre == pytest.approx(0.6, abs=1e-6)  # Straight and centred, it is eps.


@pytest.mark.parametrize("name", ["PRBDM", "PRBDM2R", "PRBDM2RAxial", "PRBDM3R"])
def test_the_closed_form_applies_to_every_guide(name):
    """A straight guide hit off its centre: (1 + eps)/(1 + m d^2/J) - 1, J = m (a^2 + b^2)/12."""
    m = mechanism(name)
    known = m.values()
    ratio = known["shuttle.mass"] * 3e-3**2 / known["shuttle.inertia"]
    found = impact_map.closed_form(m, [0.0, -17e-3], [3e-3], WEIGHTLESS).restitution
    assert found[0, 0] == pytest.approx(1.6 / (1 + ratio) - 1, abs=1e-6)
    assert found[0, 1] < found[0, 0]  # The path is oblique to the stop there.


@pytest.mark.parametrize(
    ("name", "wall", "offset", "message"),
    [
        ("Cantilever", 3e-3, 0.0, "tip turns"),  # The angle is 3/2 of path over length.
        # The shuttle has 200 g; the stages at half its speed add 30 g, the flexures the rest.
        ("FoldedSuspension", 1e-7, 0.0, r"shuttle along its path has 8\d"),
    ],
)
def test_the_closed_form_is_rejected_if_the_body_turns_or_others_move(name, wall, offset, message):
    m = mechanism(name)
    with pytest.raises(ParameterError, match=message) as error:
        impact_map.closed_form(m, [wall], [offset])
    assert "choose another method" in str(error.value)


@pytest.mark.parametrize("release", [Release("tip", 90.0), Release("tip", angle=0.0)])
def test_the_path_of_a_body_is_that_of_the_shapes_that_touch_neighbouring_walls(release):
    """The rejection states its rotation per length of path, times the radius of gyration."""
    model = replace(mechanism("Cantilever"), release=release)
    wall, system = 15e-3, assemble(model, model.values())
    frame, tip = system.bodies["tip"], model.bodies[0]
    low, high = (impact_shape(system, 0, wall + change).q for change in (-1e-5, 1e-5))
    path = abs(frame.A @ (system.directions(high) - system.directions(low)))
    share = 100 * abs(high[frame.j] - low[frame.j]) * math.sqrt(tip.inertia / tip.mass) / path
    with pytest.raises(ParameterError, match=f"tip turns.* by {share:.3g} % of the path"):
        impact_map.closed_form(model, [wall], [0.0])


def test_the_closed_form_is_rejected_if_a_long_lever_amplifies_the_rotation():
    """A deflected guide turns slightly, which moves a hit point far from the centre of mass."""
    impact_map.closed_form(guide(), [-15e-3], [10e-3], WEIGHTLESS)
    with pytest.raises(ParameterError, match="shuttle turns"):
        impact_map.closed_form(guide(), [-15e-3], [0.2], WEIGHTLESS)


def test_the_closed_form_is_rejected_at_a_stop_on_a_moving_body():
    two = guide()
    other = replace(two.bodies[0], name="other")
    on = replace(two.stops[0], on="other")
    moving = replace(
        two,
        bodies=(*two.bodies, other),
        stops=(on,),
        flexures=(
            *two.flexures,
            *(
                replace(f, name=f"{f.name}_other", end=f.end.replace(two.bodies[0].name, "other"))
                for f in two.flexures
            ),
        ),
    )
    with pytest.raises(ParameterError, match="stop is on other, which moves"):
        impact_map.closed_form(moving)


@pytest.mark.slow
def test_the_2r_with_stretching_flexures_agrees_with_finite_elements():
    """The error at the 25 points of the thesis is below 0.005; without stretch it exceeds 0.03."""
    pytest.importorskip(
        "exudyn", reason="the finite elements are Exudyn's: python -m pip install exudyn"
    )
    wanted = impact_map.by_elements(guide(), values=WEIGHTLESS, elements=8).restitution
    model = impact_map.algebraic(guide(axial=True), values=WEIGHTLESS).restitution
    assert wanted.shape == (5, 5)
    assert np.abs(model - wanted).max() < 0.005
    rigid = impact_map.algebraic(guide(), values=WEIGHTLESS).restitution
    assert np.abs(rigid - wanted).max() > 0.03


@pytest.mark.slow
@pytest.mark.parametrize(
    ("model", "n", "error"),
    [("1R", 0, 0.014), ("2R", 0, 0.003), ("3R", 0, 0.006), ("nR", 40, 5e-4)],
)
def test_errors_of_models_with_stretching_flexures_are_as_documented(model, n, error):
    """The largest errors are 0.013 (1R), 0.003 (2R), 0.006 (3R) and 5e-4 (40R)."""
    pytest.importorskip(
        "exudyn", reason="the finite elements are Exudyn's: python -m pip install exudyn"
    )
    wanted = impact_map.by_elements(guide(), **CORNERS, values=WEIGHTLESS, elements=16)
    found = impact_map.algebraic(guide(model, axial=True, n=n), **CORNERS, values=WEIGHTLESS)
    assert np.abs(found.restitution - wanted.restitution).max() < error


def test_energies_of_a_simulated_impact_add_up():
    """Before the impact all energy is in the modes; afterwards a part is lost in the contact."""
    hit = impact_map.simulated(guide(), [-10e-3], [4e-3], WEIGHTLESS).hits[0][0]
    assert (hit.wall, hit.offset) == (-10e-3, 4e-3)
    assert hit.before.sum() == pytest.approx(1.0, rel=1e-12)
    assert hit.after.sum() + hit.lost == pytest.approx(1.0, rel=1e-9)
    assert hit.after[0] / hit.before[0] == pytest.approx(hit.restitution**2, rel=1e-9)
    assert hit.before[0] > 0.95  # nearly the pure mode
    assert "contact" in hit.table()


def test_modes_by_gauss_principle_equal_the_static_modes_at_a_held_shape():
    """At a held shape, the multipliers of Gauss' principle are the static ones."""
    system = assemble(m := guide(axial=True), m.values(WEIGHTLESS))
    shape = impact_shape(system, 0, -5e-3)
    np.testing.assert_allclose(
        modes_at(system, shape.q).frequency, modes(system, shape).frequency, rtol=1e-7
    )


def test_a_fit_recovers_a_1r_from_its_own_response():
    """Restitution and K_theta are found; the fitted map of a 1R has its restitution."""
    truth = {"stop.restitution": 0.47, "flexure.K_theta": 2.7}
    wall = WEIGHTLESS | {"stop.position": -2e-3}
    times = np.linspace(0.0, 0.12, 60)
    wanted = impact_map.response(guide("1R"), wall | truth, times)
    found = impact_map.fit_response(guide("1R"), [*truth], times, wanted, wall)
    assert [found.values[name] for name in truth] == pytest.approx([0.47, 2.7], rel=1e-5)
    assert found.identifiable
    start = WEIGHTLESS | truth | {"release.displacement": -8e-3}
    of_map = impact_map.fitted(guide("1R"), [-2e-3], [0.0], start).restitution
    assert of_map.item() == pytest.approx(0.47, abs=1e-4)


def test_a_response_is_the_displacement_along_the_release():
    """For a cantilever that is released upwards it is nearly the output y."""
    leaf = mechanism("Cantilever")
    start = {"release.displacement": 6e-3}
    seen = impact_map.response(leaf, start, np.linspace(0.0, 0.04, 20))
    assert seen[0] == pytest.approx(6e-3, abs=1e-9)
    simulation = Simulation(leaf, start, tolerance=1e-7)
    simulation.advance(0.04)
    assert seen[-1] == pytest.approx(simulation.outputs()["tip.y"], abs=1e-7)


def test_the_fitted_restitution_agrees_with_the_simulated_one_at_straight_flexures():
    """The method of the thesis and the velocity of the mode agree to 0.01."""
    point = {"walls": [0.0], "offsets": [0.0], "values": WEIGHTLESS}
    fit = impact_map.fitted(guide(), **point).restitution.item()
    assert fit == pytest.approx(impact_map.simulated(guide(), **point).restitution.item(), abs=0.01)


@pytest.mark.slow
def test_the_fitted_restitution_is_lower_if_the_rebound_passes_the_straight_shape():
    """Modes whose frequency rises during the rebound take energy from the fundamental mode."""
    point = {"walls": [-10e-3, 10e-3], "offsets": [0.0], "values": WEIGHTLESS}
    outwards, through = impact_map.fitted(guide(), **point).restitution[0]
    direct = impact_map.simulated(guide(), **point).restitution[0]
    assert outwards > direct[0] + 0.03
    assert through < direct[1] - 0.05


@pytest.mark.parametrize(
    ("gap", "message"),
    [
        (lambda x: 1e-3 + 0.0 * x, "does not change when the released body moves"),
        (lambda x: 1e-3 + x * x, "no shape that touches the wall at 0.002 m was found"),
    ],
)
def test_a_wall_that_no_held_shape_touches_is_an_error(gap, message):
    with pytest.raises(EquilibriumError, match=message):
        touching_shape(lambda x, _: x, gap, 2e-3, 0.1)


@pytest.mark.slow
def test_a_map_is_written_and_drawn(tmp_path):
    one = impact_map.algebraic(guide(), **CORNERS, values=WEIGHTLESS, label="2R")
    rows = list(
        csv.reader(io.StringIO(one.write(tmp_path / "map.csv").read_text(encoding="utf-8")))
    )
    assert len(rows) == 10
    assert all(len(row) == len(rows[0]) for row in rows)
    assert sum(map(float, rows[1][4:])) == pytest.approx(1.0, abs=5e-6)
    assert str(one).splitlines()[0] == "2R"
    for figure in (figures.heat_map([one, one]), figures.energies(one)):
        assert png(figure).startswith(b"\x89PNG")
    point = impact_map.algebraic(guide(), [-5e-3], [0.0], WEIGHTLESS)
    assert png(figures.heat_map([point])).startswith(b"\x89PNG")


def map_of(walls, offsets, restitution=0.5):
    shape = (len(offsets), len(walls))
    return impact_map.ImpactMap(
        "2R", np.array(walls), np.array(offsets), np.full(shape, restitution)
    )


@pytest.mark.parametrize(
    "walls",
    [np.linspace(-5.56e-7, 5.56e-7, 5), np.linspace(-9e-3, 5e-3, 15), [0.0, 1e-5, 2e-5, 0.01]],
)
def test_labels_of_the_axes_do_not_overlap(walls):
    """The positions of the wall are tiny, numerous or unequally spaced."""
    figure = figures.heat_map([map_of(walls, [-1e-3, 0.0, 1e-3])])
    figure.draw_without_rendering()
    boxes = [label.get_window_extent() for label in figure.axes[0].get_xticklabels()]
    assert len(boxes) >= 2
    for left, right in itertools.pairwise(sorted(boxes, key=lambda box: box.x0)):
        assert left.x1 < right.x0
    cells = [text.get_window_extent() for text in figure.axes[0].texts]
    rows = [[box for box in cells if abs(box.y0 - cells[0].y0) < 1.0] if cells else []]
    for left, right in itertools.pairwise(rows[0]):
        assert left.x1 < right.x0


def test_the_figure_names_the_mechanism_in_lines_that_fit():
    title = "Parallel guide with a stop, one-rotation pseudo-rigid-body dynamic model (1R PRBDM)"
    figure = figures.heat_map([map_of([-1e-3, 0.0], [0.0])], title=title)
    figure.draw_without_rendering()
    (written,) = [text for text in figure.texts if "Parallel" in text.get_text()]
    assert written.get_text().split() == title.split()
    box = written.get_window_extent()
    assert 0.0 <= box.x0 < box.x1 <= figure.bbox.width


def test_round_off_of_a_constant_map_is_not_coloured():
    one = map_of([-1e-3, 0.0], [0.0])
    one.restitution[0, 0] += 1e-5
    low, high = figures.heat_map([one]).axes[0].collections[0].get_clim()
    assert high - low == pytest.approx(0.02)


def test_a_map_of_a_small_mechanism_is_printed_in_micrometres():
    head, row = str(map_of([-4e-7, 4e-7], [1e-5])).splitlines()[1:]
    assert head.split() == ["d", "\\", "h,", "µm", "-0.4", "0.4"]
    assert row.split() == ["10", "0.5000", "0.5000"]


def test_every_method_reports_its_progress():
    for method in (impact_map.algebraic, impact_map.closed_form, impact_map.simulated):
        fractions = []
        method(guide("1R"), [-2e-3, 0.0], [0.0], WEIGHTLESS, progress=fractions.append)
        assert fractions == [0.5, 1.0]


def test_walls_out_of_reach_and_unknown_stops_are_rejected():
    with pytest.raises(EquilibriumError, match="release further from the wall"):
        impact_map.simulated(
            guide(), [17.9e-3], [0.0], WEIGHTLESS | {"release.displacement": -5e-3}
        )
    with pytest.raises(ParameterError, match="no stop bumper"):
        impact_map.algebraic(guide(), stop="bumper")
    with pytest.raises(ParameterError, match="unknown variable"):
        impact_map.fit_response(guide(), ["stop.bounce"], TIMES, TIMES)
    with pytest.raises(RecordError, match="too few"):
        impact_map.fit_response(guide(), ["stop.restitution"], TIMES[:9], TIMES[:9])
    with pytest.raises(ParameterError, match="position of impact is an expression"):
        impact_map.algebraic(mechanism("ImpactOscillator"))


def test_the_first_impact_is_that_of_the_given_stop():
    """The body hits a second stop behind it first; that impact is skipped."""
    one = guide("1R")
    behind = replace(one.stops[0], name="behind", direction=180.0, position=9e-3)
    sim = Simulation(
        replace(one, stops=(replace(one.stops[0], position=-5e-3), behind)),
        WEIGHTLESS | {"release.displacement": -8.9e-3, "release.velocity": -0.5},
    )
    assert impact_map.first_impact(sim, 0).stop == "stop"
    assert sim.record[0].stop == "behind"


def test_coefficients_are_kept_only_for_the_same_model():
    own = replace(guide("1R").flexure_types[0], coefficients={"K_theta": 2.5449})
    parts = replace(guide("1R"), flexure_types=(own,))
    assert impact_map.with_flexures(parts, "1R", axial=True).values()["flexure.K_theta"] == 2.5449
    assert impact_map.with_flexures(parts, "2R").values()["flexure.K_theta1"] == 3.4710


def test_order_and_nodes_are_kept_only_for_beams():
    beams = impact_map.with_flexures(guide(), "beam", order=5, nodes=9)
    (same,) = impact_map.with_flexures(beams, "beam", axial=True).flexure_types
    assert (same.order, same.nodes, same.axial) == (5, 9, True)
    (other,) = impact_map.with_flexures(beams, "2R").flexure_types
    assert (other.order, other.nodes) == (None, None)
