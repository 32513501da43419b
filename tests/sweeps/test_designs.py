"""Designs of studies: lists, tolerances, yield and sensitivities with closed forms; optima."""

import math
import re
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from prbm.base.errors import ParameterError
from prbm.commands.command_line import main
from prbm.files.mechanism_file import load, shipped
from prbm.files.settings import UserMistake
from prbm.mechanism.parameters import Tolerance
from prbm.references.scalar_guide import ScalarGuide
from prbm.sweeps.design import SENSITIVITY, drawn, sensitivity, yield_of
from prbm.sweeps.study import study

FREE = {"gravity.x": 0.0, "gravity.y": 0.0, "damping.beta": 0.0}
SHORT = {"stop_time": 1e-3, "step": 1e-3, "workers": 1}


# --- sensitivities --------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_indices_of_ishigamis_function_are_within_their_confidence(seed):
    """F = sin x + a sin^2 y + b z^4 sin x on [-pi, pi]^3 with a = 7, b = 0.1.

    V = a^2/8 + b pi^4/5 + b^2 pi^8/18 + 1/2, V_x = (1 + b pi^4/5)^2 / 2, V_y = a^2/8, V_z = 0,
    V_xz = 8 b^2 pi^8 / 225 (Sobol and Levitan 1999).
    """
    a, b, pi = 7.0, 0.1, math.pi
    names = ["x", "y", "z"]
    points = drawn(dict.fromkeys(names, (-pi, pi)), 2048, seed, SENSITIVITY)
    assert points.shape == (2048 * 5, 3)
    x, y, z = points.T
    found = sensitivity(names, np.sin(x) + a * np.sin(y) ** 2 + b * z**4 * np.sin(x), seed)
    v_x, v_y, v_xz = (1 + b * pi**4 / 5) ** 2 / 2, a**2 / 8, 8 * b**2 * pi**8 / 225
    v = v_x + v_y + v_xz
    np.testing.assert_allclose(v, a**2 / 8 + b * pi**4 / 5 + b**2 * pi**8 / 18 + 0.5, rtol=1e-12)
    first, total = np.array([v_x, v_y, 0.0]) / v, np.array([v_x + v_xz, v_y, v_xz]) / v
    for exact, got, interval in (
        (first, found.first, found.first_interval), (total, found.total, found.total_interval),
    ):  # fmt: skip
        np.testing.assert_allclose(got, exact, atol=0.03)
        low, high = interval.T
        assert ((low <= exact) & (exact <= high)).all()  # Sobol's points are better than random.


@pytest.mark.slow
def test_indices_of_a_power_law_are_its_exponents(mechanisms):
    """For small changes f ~ h^1.5 b^0.5 / L^1.5 has shares 1.5^2 : 0.5^2 of the variance."""
    vary = {"flexure.thickness": "+- 1 %", "flexure.width": "+- 1 %"}
    found = study(
        mechanisms["PRBDM"], vary, ["fundamental"], runs=256, method="sensitivity",
        values={**FREE, "flexure.density": 1.0}, **SHORT,
    )  # fmt: skip
    indices = found.sensitivities["fundamental"]
    np.testing.assert_allclose(indices.first, [0.9, 0.1], atol=0.05)
    np.testing.assert_allclose(indices.total, [0.9, 0.1], atol=0.05)


def test_indices_and_their_intervals_are_those_of_their_seed():
    """The estimators are those of SciPy, whose bootstrap has no seed."""
    n = 64
    points = drawn(dict.fromkeys("xyz", (0.0, 1.0)), n, 0, SENSITIVITY)
    values = points @ [1.0, 2.0, 3.0] + points[:, 0] * points[:, 1]
    one, two, other = (sensitivity("xyz", values, seed) for seed in (1, 1, 2))
    for name in ("first", "total", "first_interval", "total_interval"):
        np.testing.assert_array_equal(getattr(one, name), getattr(two, name))
    assert (one.first_interval != other.first_interval).all()
    mixed = values[2 * n :].reshape(3, 1, n)
    runs = {"f_A": values[None, :n], "f_B": values[None, n : 2 * n], "f_AB": mixed}
    expected = stats.sobol_indices(func=runs, n=n)
    np.testing.assert_allclose(one.first, np.ravel(expected.first_order), atol=1e-13)
    np.testing.assert_allclose(one.total, np.ravel(expected.total_order), atol=1e-13)


def test_intervals_ignore_resamples_of_a_single_value():
    """The output differs in one run of A; most resamples do not contain it."""
    values = np.zeros(16)
    values[3] = 1.0
    found = sensitivity(["a", "b"], values)
    assert np.isfinite([found.first_interval, found.total_interval]).all()
    assert sensitivity(["a", "b"], np.r_[np.zeros(8), np.arange(8.0)]) is None


def test_a_parameter_without_effect_has_shares_of_zero_without_width():
    points = drawn({"a": (0.0, 1.0), "b": (0.0, 1.0)}, 64, 0, SENSITIVITY)
    found = sensitivity(["a", "b"], points[:, 0])
    assert found.first[1] == found.total[1] == 0.0
    assert found.first_interval[1].tolist() == found.total_interval[1].tolist() == [0.0, 0.0]
    assert np.isfinite(found.first_interval).all()


def test_a_parameter_without_effect_and_a_constant_output_are_sentences(tmp_path, capsys):
    line = "study PRBDM --vary stop.offset=0:1mm --vary gravity.x=0:1 --runs 4"
    words = f"{line} --method sensitivity --of rest(shuttle.x) impacts".split()
    assert main([*words, "--stop-time", "1ms", "--out", str(tmp_path)]) == 0
    printed = capsys.readouterr().out
    assert "without effect on rest(shuttle.x): stop.offset" in printed
    assert "no shares of the variance of impacts: no parameter changes it" in printed
    assert "nan" not in printed
    assert "nan" not in (tmp_path / "PRBDM-sensitivity.csv").read_text(encoding="utf-8")


def test_a_constant_or_failed_output_has_no_indices():
    assert sensitivity(["a"], np.ones(12)) is None
    assert sensitivity(["a"], 1.0 + 1e-15 * np.arange(12.0)) is None
    assert sensitivity(["a"], np.r_[math.nan, np.arange(11.0)]) is None


# --- yield ----------------------------------------------------------------------------------------


def test_the_yield_of_a_linear_case_is_that_of_the_normal_distribution(mechanisms):
    """The gap of the released shape grows with the position of the wall by the same amount."""
    guide, half, limit = mechanisms["PRBDM"], 0.3e-3, 0.05e-3
    vary = {"stop.position": f"0 m +- {half} m"}
    base = study(
        guide, {"stop.position": [0.0, 1e-9]}, ["min(stop.gap)"], values=FREE, **SHORT
    ).outputs["min(stop.gap)"][0]  # fmt: skip
    exact = stats.norm(0.0, half / 3.0).sf(-limit)
    for method, runs, spread in (("random", 400, 0.06), ("sobol", 256, 0.01), ("latin", 100, 0.02)):
        found = study(
            guide, vary, ["impacts"], runs=runs, method=method, seed=1, values=FREE,
            subject_to=[f"min(stop.gap) > {1e3 * (base - limit):.12g} mm"], **SHORT,
        )  # fmt: skip
        assert found.share.runs == runs
        assert found.share.share == pytest.approx(exact, abs=spread)
        assert found.share.low < exact < found.share.high


@pytest.mark.slow
def test_confidence_intervals_contain_the_probability_in_95_of_100_cases():
    rng, p = np.random.default_rng(5), 0.9
    found = [yield_of(rng.random(200) < p) for _ in range(1000)]
    assert sum(x.low < p < x.high for x in found) == pytest.approx(950, abs=25)


@pytest.mark.parametrize(
    ("text", "mean", "spread"),
    [
        ("0.1 mm +- 2 %", 1e-4, 2e-6 / 3),
        ("+- 3 um", 1e-4, 1e-6),
        ("100 um ± 6 um uniform", 1e-4, 6e-6 / math.sqrt(3)),
    ],
)
def test_tolerances_are_three_standard_deviations(mechanisms, text, mean, spread):
    found = study(
        mechanisms["PRBDM"], {"flexure.thickness": text}, ["fundamental"], runs=256, **SHORT
    )
    assert found.points.mean() == pytest.approx(mean, rel=1e-4)
    assert found.points.std() == pytest.approx(spread, rel=0.02)


@pytest.mark.slow
def test_yield_with_the_tolerances_of_a_file_is_that_of_the_normal_distribution(
    mechanisms, tmp_path
):
    """The frequency grows with the thickness: it is above that of 0.99 h with Phi(1.5)."""
    text = shipped()["PRBDM"].read_text(encoding="utf-8")
    path = tmp_path / "toleranced.toml"
    path.write_text(f'{text}\n[tolerances]\nflexure.thickness = "2 %"\n', encoding="utf-8")
    guide = load(path)
    assert dict(guide.tolerances) == {"flexure.thickness": Tolerance(0.02, relative=True)}
    h = guide.values()["flexure.thickness"]
    (limit,) = study(
        guide, {"flexure.thickness": [0.99 * h, h]}, ["fundamental"], **SHORT
    ).outputs["fundamental"][:1]  # fmt: skip
    found = study(
        guide, None, ["fundamental"], runs=1024, subject_to=[f"fundamental > {limit} Hz"],
        **SHORT,
    )  # fmt: skip
    assert found.share.share == pytest.approx(stats.norm.cdf(1.5), abs=2e-3)
    named = study(guide, guide.tolerances, ["fundamental"], runs=8, **SHORT)
    np.testing.assert_array_equal(named.points, found.points[:8])
    with pytest.raises(ParameterError, match="no parameter is varied"):
        study(mechanisms["PRBDM"], None, ["fundamental"], runs=8, **SHORT)


def test_the_command_prints_how_drawn_values_are_distributed(capsys):
    """A uniform distribution between 1 and 3 mm."""
    words = "study PRBDM --vary stop.position=1:3mm --runs 64 --of fundamental --workers 1"
    assert main(words.split()) == 0
    (line,) = [x for x in capsys.readouterr().out.splitlines() if x.lstrip().startswith("stop.pos")]
    mean, deviation, least, low, median, high, most = map(float, line.split("]")[1].split())
    assert (mean, median) == pytest.approx((2.0, 2.0), abs=0.02)
    assert deviation == pytest.approx(1.0 / math.sqrt(3.0), rel=0.02)
    assert 1.0 <= least < 1.03 < low < 1.1 < 2.9 < high < 2.97 < most <= 3.0


def test_failed_simulations_are_not_good_ones(mechanisms):
    found = study(
        mechanisms["PRBDM"], {"stop.position": (-0.03, 0.0)}, ["fundamental", "impacts"], runs=16,
        subject_to=["fundamental > 1 Hz"], **SHORT,
    )  # fmt: skip
    failed = sum(map(bool, found.messages))
    assert 0 < failed < 16
    assert found.share.good == 16 - failed


def test_a_count_of_samples_is_refused_for_drawn_values(capsys):
    words = "study PRBDM --vary stop.position=0:1mm:3 --runs 4 --of impacts"
    assert main(words.split()) == 2
    assert "COUNT is that of a grid, and --runs draws values" in capsys.readouterr().err


# --- lists ----------------------------------------------------------------------------------------


def test_a_list_of_simulations_has_units_in_its_heads(mechanisms, tmp_path):
    path = tmp_path / "rows of a list.csv"
    path.write_text("stop.position [mm],stop.restitution\n1.5,0.5\n-2,0.25\n", encoding="utf-8")
    found = study(mechanisms["PRBDM"], path, ["impacts"], **SHORT)
    assert found.points.tolist() == [[1.5e-3, 0.5], [-2e-3, 0.25]]
    assert not found.whole_grid


def test_the_table_of_a_study_is_a_list_for_the_next_one(mechanisms, tmp_path):
    first, second = tmp_path / "a.csv", tmp_path / "b.csv"
    vary = {"stop.position": [0.1 + 0.2e-3, 0.4]}
    study(mechanisms["PRBDM"], vary, ["impacts"], table=first, **SHORT)
    lines = first.read_text(encoding="utf-8").splitlines()
    rows = [line.split(",")[0] for line in lines]
    (tmp_path / "list.csv").write_text("\n".join(rows), encoding="utf-8")
    study(mechanisms["PRBDM"], tmp_path / "list.csv", ["impacts"], table=second, **SHORT)
    assert second.read_bytes() == first.read_bytes()


def test_rows_are_added_to_a_table_in_parquet_with_the_same_bytes(mechanisms, tmp_path):
    """The first row is not simulated again; a failed one is a row with its reason."""
    rows = pd.DataFrame({"stop.position [mm]": [0.5, -30.0, 1.0], "stop.restitution": 0.5})
    given, seen = {"table": tmp_path / "a.parquet", **SHORT}, list[float]()
    study(mechanisms["PRBDM"], rows[:1], ["impacts"], **given)
    study(mechanisms["PRBDM"], rows, ["impacts"], progress=seen.append, **given)
    assert seen[0] == pytest.approx(1.0 / 3.0)
    study(mechanisms["PRBDM"], rows, ["impacts"], **(given | {"table": tmp_path / "b.parquet"}))
    assert (tmp_path / "a.parquet").read_bytes() == (tmp_path / "b.parquet").read_bytes()
    found = pd.read_parquet(tmp_path / "a.parquet")
    assert found["stop.position"].tolist() == [0.5e-3, -30e-3, 1e-3]
    assert found["status"].tolist() == ["ok", "failed", "ok"]
    assert "penetrated" in found["message"][1]
    with pytest.raises(ParameterError, match=r"another table: row 1 has changed"):
        study(mechanisms["PRBDM"], rows[::2], ["impacts"], **given)


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        ("", "0 rows and 0 columns; write a column for each parameter"),
        ("stop.position\n", "write a column for each parameter"),
        ("stop.position,stop.position\n1,2\n", "has the column .stop.position. twice"),
        ("stop.position\n1,2\n", "row 0 has 2 cells, more than its head"),
        ("stop.position\n0\nnan\n", "row 1 of the table: stop.position = nan must be a finite"),
        ("stop.positon\n0\n", "unknown variable 'stop.positon'; did you mean"),
        ("stop.position [kg]\n0\n", "another dimension"),
    ],
)
def test_mistakes_in_lists_are_reported(mechanisms, tmp_path, content, sentence):
    path = tmp_path / "list.csv"
    path.write_text(content, encoding="utf-8")
    with pytest.raises((ParameterError, UserMistake), match=sentence):
        study(mechanisms["PRBDM"], path, ["impacts"], **SHORT)


MISTAKES = [
    ({"runs": 4, "vary": {"stop.position": "1 mm"}}, 'write a tolerance, for instance "0.1 mm'),
    ({"runs": 4, "vary": {"stop.position": "+- 0 mm"}}, "tolerance of .- 0 must be positive"),
    ({"runs": 4, "vary": {"stop.position": "+- 2 kg"}}, "another dimension"),
    ({"runs": 4, "vary": {"stop.position": "+- 2 %"}}, "the value 0 has no width"),
    ({"runs": 4, "vary": {"stop.position": [0.0, 1.0, 2.0]}}, r"give a range \(low, high\)"),
    ({"method": "sensitivity"}, r"draws its simulations; give runs \(--runs\)"),
    ({"runs": 3}, "Sobol's sequence needs a power of two"),
    ({"runs": 4, "method": "halton"}, "unknown method 'halton'"),
    ({"subject_to": ["impacts"]}, 'write it as in "fundamental > 40 Hz"'),
    ({"subject_to": ["fundamental > 40 mm"]}, "another dimension"),
    ({"subject_to": ["rest(stop.x) > 1"]}, r"write rest\(BODY.x\)"),
    ({"tolerances": {"stop.position": "1 mm"}}, "give an output to optimise and constraints"),
    ({"timeout": 0.0}, "timeout = 0 s must be positive"),
    ({"minimise": "impacts", "subject_to": ["fundamental > 1 MHz"]}, "satisfies the constraints"),
]


@pytest.mark.parametrize(("arguments", "sentence"), MISTAKES)
def test_mistakes_in_designs_are_reported(mechanisms, arguments, sentence):
    given = {"vary": {"stop.position": (0.0, 1e-3)}, "outputs": ["impacts"], **SHORT} | arguments
    with pytest.raises((ParameterError, UserMistake), match=sentence):
        study(mechanisms["PRBDM"], **given)


# --- optima ---------------------------------------------------------------------------------------


@pytest.mark.slow
def test_the_optimum_of_a_guide_with_three_parameters_and_two_constraints(mechanisms):
    """Least width b with a frequency of at least f and an impact speed of at most v.

    The speed at the straight shape is r omega asin(x / r) with r = gamma L, and omega^2 is
    proportional to b h^3 / L^3 for light flexures.  The thickest flexures need the least width.
    With omega = 2 pi f, the shortest length is the root of r asin(x / r) = v / omega.
    """
    guide = mechanisms["PRBDM"]
    values = {**FREE, "flexure.density": 1.0, "release.displacement": -18e-3}
    f, L, h = 5.0, 41.5e-3, 0.115e-3
    gamma = guide.values()["flexure.gamma"]
    v = 2.0 * math.pi * f * gamma * L * math.asin(18e-3 / (gamma * L))
    scalar = ScalarGuide.of(
        {**guide.values(), **values, "flexure.length": L, "flexure.thickness": h}
    )
    b = guide.values()["flexure.width"] * (f / scalar.frequency) ** 2
    vary = {
        "flexure.thickness": (0.09e-3, h), "flexure.width": (3e-3, 12e-3),
        "flexure.length": (35e-3, 48e-3),
    }  # fmt: skip
    found = study(
        guide, vary, ["impacts"], runs=64, minimise="flexure.width",
        subject_to=[f"fundamental > {f} Hz", f"impact_speed < {v:.12g} m/s"], values=values,
        tolerances={"flexure.width": "1 %"}, stop_time=0.1, workers=1,
    )  # fmt: skip
    best = found.optimum
    assert best.value == pytest.approx(b, rel=0.01)
    assert best.point["flexure.length"] == pytest.approx(L, rel=0.01)
    assert best.point["flexure.thickness"] == pytest.approx(h, rel=0.01)
    assert len(best.active) == 2
    assert 2 <= len(best.best) <= 10
    assert (np.diff(best.best_values) >= 0.0).all()
    assert 0.0 < found.share.share < 1.0


@pytest.mark.parametrize("given", ["mechanism", "argument"])
def test_the_yield_around_an_optimum_counts_parameters_that_are_not_varied(mechanisms, given):
    """The frequency is proportional to h^1.5 for light flexures, so 0.98 f is reached by Phi(z).

    With a standard deviation of a third of 2 % of h, z = 3 (1 - 0.98^(2/3)) / 0.02.
    """
    guide, h = mechanisms["PRBDM"], {"flexure.thickness": Tolerance(0.02, relative=True)}
    guide = replace(guide, tolerances=h) if given == "mechanism" else guide
    values = {**FREE, "flexure.density": 1.0}
    width = guide.values()["flexure.width"]
    thinner = ScalarGuide.of({**guide.values(), **values}).frequency
    found = study(
        guide, {"flexure.width": [width, 1.1 * width, 1.2 * width]}, minimise="mode(1)",
        subject_to=[f"fundamental > {0.98 * thinner:.12g} Hz"], values=values,
        tolerances={} if given == "mechanism" else {"flexure.thickness": "2 %"}, workers=1,
    )  # fmt: skip
    assert found.optimum.point["flexure.width"] == pytest.approx(width, rel=1e-9)
    assert found.toleranced == ("flexure.thickness",)
    expected = stats.norm.cdf(3.0 * (1.0 - 0.98 ** (2.0 / 3.0)) / 0.02)
    assert found.share.runs == 256
    assert found.share.low < expected < found.share.high < 1.0


def test_a_tolerance_of_an_unknown_parameter_is_rejected_before_the_simulations(mechanisms):
    arguments = {"minimise": "mode(1)", "subject_to": ["fundamental > 1 Hz"], **SHORT}
    with pytest.raises(ParameterError, match=r"tolerance of flexure\.thicknes: .*thickness"):
        study(
            mechanisms["PRBDM"], {"flexure.width": [7e-3, 8e-3]},
            tolerances={"flexure.thicknes": "1 %"}, **arguments,
        )  # fmt: skip
    with pytest.raises(ParameterError, match=r"gravity\.x: .* of the value 0 has no width"):
        study(
            mechanisms["PRBDM"], {"flexure.width": [7e-3, 8e-3]}, values={"gravity.x": 0.0},
            tolerances={"gravity.x": "1 %"}, **arguments,
        )  # fmt: skip


@pytest.mark.slow
def test_an_output_without_indices_is_named_with_its_missing_values(tmp_path, capsys):
    """Not every simulation settles; the number of impacts has indices, which are written."""
    words = ["study", "PRBDM2R", "--vary", "stop.restitution=0.3:0.8", "--runs", "8"]
    words += ["--vary", "stop.position=-4:2 mm"]
    words += ["--method", "sensitivity", "--stop-time", "0.3", "--of", "settling", "impacts"]
    assert main([*words, "--out", str(tmp_path)]) == 0
    printed = capsys.readouterr().out
    assert re.search(r"^settling: no value in \d+ of 32 complete simulations; sim", printed, re.M)
    assert "no shares of the variance of settling: they need a value of each sim" in printed
    assert "nan" not in printed
    assert "shares of the variance of impacts" in printed
    rows = (tmp_path / "PRBDM2R-sensitivity.csv").read_text(encoding="utf-8").splitlines()
    assert rows[0].startswith("output,parameter,alone")
    names = ["stop.restitution", "stop.position"]
    assert [row.split(",")[:2] for row in rows[1:]] == [["impacts", name] for name in names]


def test_indices_of_a_single_parameter_are_refused(mechanisms):
    with pytest.raises(ParameterError, match="needs two parameters"):
        study(mechanisms["PRBDM"], {"stop.restitution": (0.3, 0.8)}, ["impacts"], runs=8,
              method="sensitivity")  # fmt: skip
