"""Parameter studies: grids, optima, flat ranges, failed simulations, mistakes."""

import itertools
import math
import os
import re
import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest

from point_mass import point_mass
from prbm.base import processes as base_processes
from prbm.base.errors import ParameterError
from prbm.commands import study as command
from prbm.files.settings import UserMistake
from prbm.mechanics.stress import stressed, with_stress
from prbm.plots.study import behaviour_map, curves, maps
from prbm.runs.run import simulate
from prbm.sweeps import mechanism as simulations
from prbm.sweeps import optimum, runner
from prbm.sweeps import study as module
from prbm.sweeps.journal import Journal
from prbm.sweeps.optimum import FLAT_RTOL, Optimum, Search
from prbm.sweeps.outputs import Constraint
from prbm.sweeps.study import Study, study
from support import ROOT


def searched(function, *samples: np.ndarray, sign: float = 1.0, constraints=()) -> Optimum:
    """Return the optimum of the first of several functions of the parameters, sampled on a grid."""
    names = ["a", "b", "c"][: len(samples)]
    points = np.array([*itertools.product(*samples)])

    def evaluate(x: np.ndarray) -> np.ndarray:
        return np.array([np.atleast_1d(function(*point)) for point in x.tolist()])

    values = evaluate(points)
    plan = SimpleNamespace(
        varied=dict(zip(names, samples, strict=True)), points=points, whole_grid=True,
        texts=["f", "g", "h"][: values.shape[1]], output="f", sign=sign, constraints=constraints,
    )  # fmt: skip
    return Search(plan, values, evaluate).optimum()


def test_the_optimum_of_a_parabola_and_its_flat_range_are_exact():
    """2 + (x - c)^2 is within 5 % of 2 up to a distance of sqrt(0.1) from c."""
    c, width = 0.313, math.sqrt(2 * FLAT_RTOL)
    best = searched(lambda x: 2.0 + (x - c) ** 2, np.linspace(-1.0, 1.0, 11))
    assert best.point["a"] == pytest.approx(c, abs=1e-3)
    assert best.value == pytest.approx(2.0, abs=1e-6)
    assert best.flat["a"] == pytest.approx((c - width, c + width), abs=0.02 * 0.2)
    assert best.bounded["a"] == (True, True)


@pytest.mark.parametrize(
    ("function", "sign", "line"),
    [
        (lambda a: 2.0 + (a - 0.2) ** 2, 1.0,
         "f is 5 % worse with 0.316 less or 0.316 more; build 0.2 +- 0.32"),
        (lambda a: 2.0 + 100.0 * (a - 0.2) ** 2, 1.0,
         "f is 5 % worse with 0.0316 less or 0.0316 more; build 0.2 +- 0.032, which is "
         "narrower than the distance of the samples"),
        (lambda a: 2.0 + a, -1.0,
         "f is 5 % worse with 0.15 less; the best value is the end of the samples: better ones "
         "may lie beyond"),
        (lambda a: 2.0 + 1e-3 * (a - 0.2) ** 2, 1.0, "f changes by less than 5 % over all samples"),
    ],
)  # fmt: skip
def test_the_line_for_the_design_says_how_much_worse_the_output_becomes(function, sign, line):
    """Distances and limits of 2 + k (a - 0.2)^2 are sqrt(0.1/k)."""
    best = searched(function, np.linspace(-1.0, 1.0, 11), sign=sign)
    (printed,) = command._design_lines(best, {"a": "", "f": ""})
    number = r"\d+(?:\.\d+)?"
    assert re.sub(number, "", printed) == re.sub(number, "", f"design a: {line}")
    shown, expected = ([float(x) for x in re.findall(number, text)] for text in (printed, line))
    assert shown == pytest.approx(
        expected, rel=0.07
    )  # The ends are bisected to 2 % of the distance of samples.


def test_a_maximum_is_the_minimum_of_the_negative():
    best = searched(lambda x: 3.0 - x * x, np.linspace(-0.9, 1.0, 8), sign=-1.0)
    assert best.value == pytest.approx(3.0, abs=1e-5)
    width = math.sqrt(3 * FLAT_RTOL)
    assert best.flat["a"] == pytest.approx((-width, width), abs=0.02 * 0.3)


def test_an_optimum_at_the_end_of_the_samples_is_reported_as_unbounded():
    best = searched(lambda x: 10.0 + x, np.linspace(0.0, 5.0, 6))
    assert best.point["a"] == pytest.approx(0.0, abs=1e-2)
    assert best.bounded["a"] == (False, True)
    assert best.flat["a"][1] == pytest.approx(0.5, abs=0.03)


def test_the_optimum_is_never_worse_than_any_computed_value():
    """The output jumps; the search for the flat range meets values that the refinement missed."""
    computed = []

    def rough(x: float) -> float:
        computed.append(2.0 + (x - 0.2) ** 2 + 0.3 * math.sin(300.0 * x) ** 2)
        return computed[-1]

    best = searched(rough, np.linspace(-1.0, 1.0, 12))
    assert best.value == min(computed)


def test_five_neighbouring_samples_avoid_a_narrow_optimum():
    """The parabola has its minimum at 0.6; one sample at -0.5 is far below it."""
    x = np.linspace(-1.0, 1.0, 41)
    best = searched(lambda a: 0.1 if abs(a + 0.5) < 0.01 else 1.0 + (a - 0.6) ** 2, x)
    assert best.value == 0.1
    assert best.flat["a"] == pytest.approx((-0.5, -0.5), abs=0.011)
    low, high, worst = best.robust
    assert (low, high) == pytest.approx((0.5, 0.7), abs=1e-9)
    assert worst == pytest.approx(1.01, abs=1e-9)
    assert searched(lambda a: a, np.linspace(0.0, 1.0, 4)).robust is None


def test_failed_simulations_bound_the_flat_range():
    best = searched(
        lambda x: math.nan if x > 0.51 else 1.0 + 1e-3 * (x - 0.4) ** 2, np.linspace(0.0, 1.0, 11)
    )
    low, high = best.flat["a"]
    assert (low, best.bounded["a"]) == (0.0, (False, True))
    assert high == pytest.approx(0.51, abs=2e-3)


def test_the_optimum_of_two_parameters_is_refined():
    best = searched(
        lambda x, y: 1.0 + (x - 0.13) ** 2 + 4 * (y - 0.4) ** 2 + (x - 0.13) * (y - 0.4),
        np.linspace(-1.0, 1.0, 5), np.linspace(0.0, 1.0, 6),
    )  # fmt: skip
    assert [*best.point.values()] == pytest.approx([0.13, 0.4], abs=0.02)
    assert best.value == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize("scipy", [(1, 14), (1, 11)])
def test_constraints_are_active_at_the_optimum_of_a_plane(scipy, monkeypatch):
    """Minimise x + y under x y > 1 on [0.2, 3]^2: x = y = 1.  SciPy 1.11 has another method."""
    monkeypatch.setattr(optimum, "SCIPY", scipy)
    best = searched(
        lambda x, y: (x + y, x * y), np.linspace(0.2, 3.0, 6), np.linspace(0.2, 3.0, 6),
        constraints=[Constraint("g > 1", "g", ">", 1.0)],
    )  # fmt: skip
    assert best.value == pytest.approx(2.0, rel=2e-3)
    assert [*best.point.values()] == pytest.approx([1.0, 1.0], abs=0.06)
    assert best.active == ("g > 1",)
    assert best.others["g"] >= 1.0


def test_samples_that_violate_the_constraints_lead_to_those_that_do_not():
    """No sample has x > 2.9; the constraint is satisfied between the last two of them only."""
    best = searched(
        lambda x, y: (y * y + x, x * (1.0 + 0.1 * y)), np.linspace(0.0, 3.0, 3),
        np.linspace(-1.0, 1.0, 3), constraints=[Constraint("g > 3.1", "g", ">", 3.1)],
    )  # fmt: skip
    assert best.others["g"] > 3.1


# --- simulations ----------------------------------------------------------------------------------


def test_rows_are_those_of_single_simulations(mechanisms):
    guide = mechanisms["PRBDM"]
    positions = np.array([-0.03, 0.0, 2e-3])  # The first one is behind the release.
    outputs = ["settling", "impacts", "max(abs(shuttle.vx))", "shuttle.x"]
    found = study(
        guide, {"stop.position": positions}, outputs, stop_time="0.25 s", step=1e-3,
        values={"stop.restitution": 0.4}, inputs={"force.x": "step(10 mN, 50 ms)"}, workers=1,
    )  # fmt: skip
    assert "the wall stop is penetrated" in found.messages[0]
    assert all(math.isnan(x[0]) for x in found.outputs.values())
    assert found.messages[1:] == ("", "")
    for k in (1, 2):
        single = simulate(
            guide, {"stop.restitution": 0.4, "stop.position": positions[k]}, stop_time=0.25,
            step=1e-3, inputs={"force.x": "step(10 mN, 50 ms)"},
        )  # fmt: skip
        assert found.outputs["impacts"][k] == single["stop.impact_count"][-1]
        speeds = [impact.latched.approach_speed for impact in single.impacts]
        largest = max(np.abs(single["shuttle.vx"]).max(), *speeds)
        assert found.outputs["max(abs(shuttle.vx))"][k] == pytest.approx(largest, rel=1e-4)
        assert found.outputs["shuttle.x"][k] == single["shuttle.x"][-1]
    assert found.units == {
        "stop.position": "m", "settling": "s", "impacts": "", "max(abs(shuttle.vx))": "m/s",
        "shuttle.x": "m",
    }  # fmt: skip


@pytest.mark.slow
def test_peaks_of_short_contacts_do_not_depend_on_the_samples():
    """The last impact is the weakest one; fine samples of the force resolve each contact."""
    mass = with_stress(point_mass(young=1e10))
    fine = simulate(mass, stop_time=0.1, step=2e-6)
    names = ["peak_force", "peak_stress", "impact_speed", "stop.peak_force"]
    found = study(
        mass, {"stop.friction": [0.0, 1e-9]}, names, stop_time=0.1, step=0.02, workers=1
    )  # fmt: skip
    largest = max(fine[f"{leaf}.stress"].max() for leaf in "ab")
    assert found.outputs["peak_force"][0] == pytest.approx(fine["stop.force"].max(), rel=5e-3)
    assert found.outputs["peak_stress"][0] == pytest.approx(largest, rel=1e-2)
    speeds = [impact.latched.approach_speed for impact in fine.impacts]
    assert found.outputs["impact_speed"][0] == pytest.approx(max(speeds), rel=1e-5)
    assert found.outputs["stop.peak_force"][0] < 0.9 * found.outputs["peak_force"][0]
    result = simulate(mass, stop_time=0.1, step=0.02)
    assert result.quantity("peak_force") == found.outputs["peak_force"][0]


@pytest.mark.parametrize("law", ["rigid", "compliant"])
def test_extremes_of_a_stop_see_all_impacts_between_two_samples(mechanisms, law):
    """Several impacts pass between samples of 20 ms; samples of 2 us resolve the gap."""
    mass, span = (point_mass(young=1e10), 0.1) if law == "compliant" else (mechanisms["PRBDM"], 0.2)
    fine = simulate(mass, stop_time=span, step=2e-6 if law == "compliant" else 1e-3)
    names = ["max(stop.approach_speed)", "min(stop.gap)", "max(stop.impulse)"]
    found = study(
        mass, {"stop.friction": [0.0, 1e-9]}, names, stop_time=span, step=span / 2, workers=1
    )  # fmt: skip
    hits = [impact.latched for impact in fine.impacts]
    assert len(hits) >= 2
    speed, gap, impulse = (found.outputs[name][0] for name in names)
    assert speed == pytest.approx(max(hit.approach_speed for hit in hits), rel=1e-5)
    assert impulse == pytest.approx(max(hit.impulse for hit in hits), rel=1e-4)
    deepest = fine["stop.gap"].min() if law == "compliant" else 0.0
    assert gap == pytest.approx(deepest, rel=5e-3, abs=1e-12)


@pytest.mark.parametrize(
    ("output", "words"),
    [
        ("max(stop.force)", r"use peak_force, .* or max\(stop\.peak_force\)"),
        ("min(stop.force)", "use peak_force"),
        ("max(abs(a.stress_end))", "use peak_stress"),
        ("max(a.stress)", "use peak_stress"),
    ],
)
def test_an_extreme_that_samples_can_miss_is_rejected_with_the_name_of_the_peak(output, words):
    with pytest.raises(ParameterError, match=words):
        study(with_stress(point_mass()), {"stop.friction": [0.0, 0.1]}, [output], stop_time=0.01)


@pytest.mark.parametrize(
    ("output", "words"),
    [("peak_force", 'needs a stop with law = "compliant"')],
)
def test_a_peak_that_a_mechanism_does_not_compute_is_rejected_with_the_remedy(
    mechanisms, output, words
):
    with pytest.raises(ParameterError, match=words):
        study(mechanisms["PRBDM"], {"stop.position": [0.0, 1e-3]}, [output], stop_time=0.01)


def test_flexures_have_the_outputs_of_a_stress_that_is_asked_for(mechanisms):
    """Without friction and impacts, the largest stress of a held shape is that of the release."""
    guide = mechanisms["PRBDM"]
    assert not stressed(guide)
    found = study(
        guide, {"release.displacement": [-0.01, -0.005]}, ["peak_stress"],
        values={"gravity.x": 0.0, "stop.position": 0.02}, stop_time=0.01, workers=1,
    )  # fmt: skip
    large, small = found.outputs["peak_stress"]
    assert large == pytest.approx(2.0 * small, rel=0.05)


def test_flexures_have_the_stress_of_a_condition(mechanisms):
    found = study(
        mechanisms["PRBDM"], {"release.displacement": [-0.01, -0.005]},
        subject_to=["peak_stress < 100 GPa"], stop_time=1e-3, step=1e-3, workers=1,
    )  # fmt: skip
    assert found.good.all()


@pytest.mark.slow
def test_processes_and_threads_give_the_same_bits():
    """With a timeout, each worker has a process.  The second parameter varies fastest."""
    script = """
import numpy as np, prbm
from prbm.sweeps.study import study
if __name__ == "__main__":
    vary = {"stop.position": [0.0, 1e-3], "stop.restitution": [0.2, 0.3, 0.4]}
    guide = prbm.load("PRBDM")
    one, two = (study(guide, vary, ["impacts", "shuttle.vx"], stop_time=0.08, step=1e-3, workers=2,
                      timeout=limit) for limit in (None, 100.0))
    assert one.points[:, 1].tolist() == [0.2, 0.3, 0.4] * 2
    for name, x in one.outputs.items():
        assert x.tolist() == two.outputs[name].tolist()
"""
    environment = os.environ | {"PYTHONPATH": str(ROOT / "fmu_src")}
    code = subprocess.run(
        [sys.executable, "-c", script], env=environment, check=False, capture_output=True, text=True
    )
    assert code.returncode == 0, code.stderr


def test_the_impact_speed_is_greatest_where_the_guide_passes_its_equilibrium(mechanisms):
    """Without gravity the 1R guide is fastest in its straight shape."""
    found = study(
        mechanisms["PRBDM"], {"stop.position": np.linspace(-8e-3, 8e-3, 5)}, [],
        maximise="impact_speed", values={"gravity.x": 0.0}, stop_time=0.06, step=2e-3, workers=1,
    )  # fmt: skip
    assert found.optimum is not None
    assert found.optimum.point["stop.position"] == pytest.approx(0.0, abs=1e-4)


def test_numbers_in_the_texts_of_inputs_are_varied(mechanisms):
    """The speed of the guide after a short push is proportional to the height of the push."""
    found = study(
        mechanisms["PRBDM"], {"height": [1.0, 2.0, 3.0]}, ["shuttle.vx"],
        values={"release.displacement": 0.0, "gravity.x": 0.0, "stop.position": 0.02},
        inputs={"force.x": "half-sine({height} mN, 0.1 ms)"}, stop_time="0.1 ms", step=1e-4,
        workers=1,
    )  # fmt: skip
    speed = found.outputs["shuttle.vx"]
    np.testing.assert_allclose(speed / speed[0], [1.0, 2.0, 3.0], rtol=1e-5)
    assert found.units["height"] == ""


MISTAKES = [
    ({"inputs": {"force.x": "stpe(1 N)"}}, "unknown shape 'stpe'; did you mean step"),
    ({"inputs": {"force.x": "step({height} N)"}}, r"\{height\} in an input has no value; vary he"),
    ({"vary": {"stop.positon": [0, 1e-3]}}, r"unknown variable 'stop\.positon'; did you mean"),
    ({"vary": {"stop.position": [1e-3]}}, "at least two samples are needed"),
    ({"vary": {"stop.position": [1e-3, 0.0]}}, "finite and increasing, in m"),
    ({"vary": {"stop.position": ["0", "1 kg"]}}, "1 kg: the unit 'kg' has another dimension"),
    ({"vary": {"stop.position": 1e-3}}, "at least two samples are needed"),
    ({"vary": {"stop.position": [0.0, None]}}, "None must be a number in m"),
    ({"vary": {}}, "0 parameters are varied; vary at least one"),
    ({"vary": {"stop.position": np.arange(200_000)}}, "the study has 200000 simulations"),
    ({"outputs": []}, "no output is selected; name one, for instance settling"),
    (
        {"outputs": ["setling"]},
        "output setling: the mechanism has no variable 'setling'; did you mean settling",
    ),
    ({"outputs": ["first(shuttle.x > a)"]}, "bound 'a' must be a number"),
    ({"minimise": "impacts", "maximise": "impacts"}, "minimise and maximise are both given"),
    ({"values": {"stop.position": 0.0}}, "is varied and has a fixed value"),
    ({"minimise": "settling"}, "no simulation has a value of settling; simulate longer"),
    ({"workers": 0}, "workers = 0 must be 1 or more"),
    ({"workers": "2"}, "workers = '2' must be an integer"),
    ({"retries": None}, "retries = None must be an integer"),
    ({"vary": 3}, "3 is no table: give a path, a DataFrame, or a mapping"),
    ({"inputs": 3}, "inputs = 3 must be a mapping"),
    ({"executor": 3}, "executor = 3 must be an executor of concurrent.futures, or the address"),
    ({"runs": "4", "vary": {"stop.position": (0.0, 1e-3)}}, "runs = '4' must be an integer"),
    ({"runs": 0, "vary": {"stop.position": (0.0, 1e-3)}}, "runs = 0 must be 1 or more"),
    ({"runs": 4, "seed": -1, "vary": {"stop.position": (0.0, 1e-3)}}, "seed = -1 must be 0 or"),
    ({"timeout": math.inf}, "timeout = inf s must be positive and finite"),
    ({"timeout": "1 mm"}, "timeout = 1 mm: the unit 'mm' has another dimension"),
    ({"subject_to": "impacts 1"}, "constraint impacts 1: write it as in"),
    ({"workers": 2, "inputs": {"force.x": math.sin}}, "a function cannot be called by several"),
]
EVERYWHERE = [  # Mistakes at which every simulation would fail.
    ({"stop_time": "1 m"}, "another dimension"),
    ({"stop_time": -1.0}, r"stop_time = -1 s must be positive and finite"),
    ({"stop_time": math.nan}, "stop_time = nan s must be positive and finite"),
    ({"step": 0.0}, "step = 0 s must be positive and finite"),
    ({"step": 1e-12}, "choose a larger step"),
    ({"tolerance": 2.0}, "tolerance = 2 must lie between"),
    ({"tolerance": "tight"}, "write a number"),
    ({"values": {"stop.positon": 0.0}}, r"unknown variable 'stop\.positon'; did you mean"),
    ({"values": {"stop.restitution": 2.0}}, r"stop\.restitution = 2 must be at most 1"),
    ({"values": {"stop.restitution": "1 mm"}}, "another dimension"),
    ({"engine": "kernle"}, "engine = 'kernle' must be one of kernel, python"),
]


@pytest.mark.parametrize(("arguments", "sentence"), MISTAKES)
def test_mistakes_in_studies_are_reported(mechanisms, arguments, sentence):
    given = {
        "vary": {"stop.position": [0.0, 1e-3]}, "outputs": ["impacts"], "stop_time": 0.01,
        "step": 1e-3, "workers": 1,
    }  # fmt: skip
    with pytest.raises((ParameterError, ValueError), match=sentence):
        study(mechanisms["PRBDM"], **(given | arguments))


@pytest.mark.parametrize(("arguments", "sentence"), EVERYWHERE)
def test_mistakes_in_all_simulations_are_reported_before_the_first_one(
    mechanisms, arguments, sentence, monkeypatch
):
    monkeypatch.setattr(simulations, "sampled", None)
    given = {"stop_time": 0.01, "step": 1e-3, "workers": 1} | arguments
    with pytest.raises((ParameterError, UserMistake), match=sentence):
        study(mechanisms["PRBDM"], {"stop.position": [0.0, 1e-3]}, ["impacts"], **given)


def test_quantities_that_a_mechanism_does_not_have_are_rejected(mechanisms):
    with pytest.raises(ParameterError, match=r"has no variable .stop\.x."):
        study(mechanisms["PRBDM"], {"stop.position": [0.0, 1e-3]}, ["max(stop.x)"])


def test_samples_may_be_texts_with_units(mechanisms):
    found = study(
        mechanisms["PRBDM"], {"stop.position": ["-1 mm", 0, "2 mm"]}, ["impacts"],
        stop_time=0.01, step=1e-3, workers=1,
    )  # fmt: skip
    assert found.varied["stop.position"].tolist() == [-1e-3, 0.0, 2e-3]


def test_a_study_has_a_short_text():
    x = np.linspace(0.0, 1.0, 5000)
    best = Optimum("f", {"a": 0.25}, 2.0, {}, np.zeros((5000, 1)), x)
    found = Study({"a": x}, x[:, None], {"f": x}, {}, ("", "failed") * 2500, best)
    assert repr(found) == (
        "<Study of 5000 simulations over a: 2500 failed, <Optimum of f: 2 at a = 0.25>>"
    )


def test_without_a_kernel_the_processes_are_given_the_python_engine(mechanisms, monkeypatch):
    """The reason is then logged once, and not by each process."""
    monkeypatch.setattr(simulations, "kernel_available", lambda: False)
    jobs = []

    def begun(job, *_, **more):
        jobs.append(job)
        raise InterruptedError

    monkeypatch.setattr(module, "Runner", begun)
    varied = {"stop.position": [0.0, 1e-3]}
    for given, used in ((None, "python"), ("kernel", "kernel")):
        with pytest.raises(InterruptedError):
            study(mechanisms["PRBDM"], varied, ["impacts"], engine=given, stop_time=0.1, workers=2)
        assert jobs[-1].engine == used


def test_the_number_of_processes_has_a_limit(monkeypatch):
    monkeypatch.setattr(base_processes, "PROCESSES_MAX", 61)
    for workers, processes in ((100, 61), (3, 3)):
        journal = Journal(None, {}, [], [])
        with runner.Runner(None, [], journal, 70, workers=workers, timeout=1.0) as begun:
            assert begun.threads() == processes


# --- figures --------------------------------------------------------------------------------------


def test_figures_show_all_outputs_and_the_optimum():
    x = np.linspace(-2e-3, 2e-3, 5)
    y = np.array([0.3, 0.2, np.nan, 0.25, 0.3])
    units = {"a": "m", "b": "", "f": "s"}
    further = {"f": (np.array([-9e-4]), np.array([0.19]))}
    good = np.array([True, True, False, True, True])
    best = ("f", -9e-4, 0.19, (-1e-3, -8e-4))
    figure = curves("title", ("a", x), {"f": y}, units, good, further, best)
    (axes,) = figure.axes
    assert axes.get_xlabel() == "a [mm]"
    labels = [text.get_text() for text in axes.get_legend().get_texts()]
    assert labels == ["samples", "violated condition", "refinement", "within 5 %", "optimum"]
    np.testing.assert_allclose(axes.lines[1].get_xdata(), 1e3 * x[2:3])
    grid = np.arange(15.0)
    drawn = maps(
        "title", {"a": x, "b": np.arange(3.0)}, {"f": grid}, units, grid != 2 * 3 + 1,
        ("f", [0.0, 1.0], 0.0),
    )  # fmt: skip
    mesh = drawn.axes[0].collections[0].get_array()
    assert mesh.shape == (3, 5)
    assert mesh[1, 2] == grid[2 * 3 + 1]
    crosses = drawn.axes[0].lines[0]
    np.testing.assert_allclose(crosses.get_xydata(), [[1e3 * x[2], 1.0]])
    drawn.draw_without_rendering()


def test_a_map_of_behaviour_shows_both_ways():
    """Their marks differ also without colours."""
    x, strobe = np.array([1.0, 2.0]), np.array([[1e-3, 1e-3], [1e-3, -1e-3]])
    ways = {name: (x, strobe, np.ones((2, 2))) for name in ("upwards", "downwards")}
    figure = behaviour_map("Map", ("frequency", "Hz"), ("b.vx", "m/s"), ways)
    upper, lower = figure.axes
    assert [line.get_label() for line in upper.lines] == ["upwards", "downwards"]
    assert len({line.get_marker() for line in upper.lines}) == 2
    np.testing.assert_allclose(upper.lines[0].get_ydata(), [1.0, 1.0, 1.0, -1.0])  # mm/s
    np.testing.assert_allclose(lower.lines[1].get_ydata(), 1.0)
    assert lower.get_xlabel() == "frequency [Hz]"
