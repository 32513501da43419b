"""The command prbm: printed and written results, error messages, files and signals."""

import argparse
import csv
import io
import math
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from shapely.affinity import translate

from drawn_plates import framed_stage
from drawn_plates import write as draw
from measurement_records import records, write
from prbm.__main__ import main as started
from prbm.base import atomic as files
from prbm.commands import command_line as cli
from prbm.commands import systems
from prbm.files.mechanism_file import load, shipped
from prbm.mechanics.assembly import assemble
from prbm.mechanics.statics import free_displacement
from prbm.runs.run import simulate
from prbm.sweeps.journal import Journal
from signals import interruptible
from support import ROOT, SUPPORT

PAGE = (ROOT / "docs" / "command-line.md").read_text(encoding="utf-8")
COMMANDS = (
    "list", "new", "parameters", "modes", "equilibrium", "linearize", "simulate", "stress", "shock",
    "fit", "impact-map", "contact", "sweep", "study", "import", "export", "picture", "animate",
    "explore", "build", "modelica", "ssp", "validate", "measure youngs-modulus",
    "measure calibration",
    "measure frequency", "measure restitution", "completion",
)  # fmt: skip


def run(line: str) -> int:
    """Run a command line in this process; return its status."""
    return cli.main(shlex.split(line))


def table(path: str | Path) -> dict[str, list[str]]:
    """Return the columns of a CSV file by their heads."""
    rows = list(csv.reader(io.StringIO(Path(path).read_text(encoding="utf-8"))))
    return {head: [row[i] for row in rows[1:]] for i, head in enumerate(rows[0])}


@pytest.fixture(autouse=True)
def _empty_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


# --- page and help ----------------------------------------------------------------------


@pytest.mark.slow
def test_a_signal_of_the_command_line_is_that_of_python(capsys):
    shock = "half-sine(20 g, 2 ms, 3 ms)"
    line = f"simulate PRBDM --input 'base.acceleration.x = {shock}' --stop-time 8ms --out ."
    assert run(line) == cli.OK
    written = np.genfromtxt("PRBDM.csv", delimiter=",", names=True, deletechars="")
    inputs = {"base.acceleration.x": shock}
    columns = simulate(load("PRBDM"), inputs=inputs, stop_time=8e-3, step=8e-6).columns
    assert written["base.acceleration.x"].max() == pytest.approx(20 * 9.80665, rel=1e-3)
    np.testing.assert_array_equal(written["shuttle.x"], columns["shuttle.x"])


def test_a_study_writes_its_samples_and_prints_its_optimum(capsys):
    """The gap of the released shape grows with the position of the wall by the same amount."""
    line = "study PRBDM --vary 'stop.position=0:2 mm:3' --of stop.gap --maximise stop.gap"
    assert run(f"{line} --stop-time 1ms --step 1ms --workers 1 --out .") == cli.OK
    written = table("PRBDM-study.csv")
    assert written["stop.position [m]"] == ["0.0", "0.001", "0.002"]
    gaps = np.array(written["stop.gap [m]"], float)
    np.testing.assert_allclose(np.diff(gaps), 1e-3, rtol=1e-9)
    printed = capsys.readouterr().out
    assert "3 simulations, 0 failed" in printed
    found = re.search(r"largest stop\.gap: ([\d.]+) mm at stop\.position = ([\d.]+) mm", printed)
    assert float(found[2]) == pytest.approx(2.0, abs=2e-3)
    assert float(found[1]) == pytest.approx(1e3 * gaps[-1], abs=2e-3)
    assert "it reaches the end of the samples" in printed
    with Image.open("PRBDM-study.png") as image:
        assert image.format == "PNG"


@pytest.mark.parametrize("workers", [1, 2])
def test_a_study_without_an_optimum_has_written_its_rows(workers, capsys):
    line = "study PRBDM --vary 'stop.position=0:2 mm:3' --of stop.gap --minimise settling"
    line += f" --stop-time 1ms --step 1ms --workers {workers} --out ."
    assert run(line) == cli.MISTAKE
    printed = capsys.readouterr().err
    assert "no simulation has a value of settling" in printed
    assert "PRBDM-study.csv.partial has the 3 completed rows" in printed
    written = Path("PRBDM-study.csv.partial").read_text(encoding="utf-8").splitlines()
    assert sorted(line.split(",")[0] for line in written if line[0] in "01") == [
        "0.0", "0.001", "0.002",
    ]  # fmt: skip


def test_an_interrupted_study_continues_with_the_same_bytes(monkeypatch, capsys):
    """Each row is computed once; a row of which a kill has left a part is repeated."""
    add, rows = Journal.add, []

    def interrupted(self: Journal, point: tuple[float, ...], outcome: object) -> None:
        if len(rows) == 2:
            raise KeyboardInterrupt
        rows.append(point)
        add(self, point, outcome)

    line = "study PRBDM --vary 'stop.position=0:3 mm:4' --of stop.gap impacts --workers 1"
    line += " --maximise stop.gap --stop-time 1ms --step 1ms --out "
    assert run(f"{line} whole") == cli.OK
    monkeypatch.setattr(Journal, "add", interrupted)
    assert run(f"{line} .") == cli.INTERRUPTED
    partial = Path("PRBDM-study.csv.partial")
    assert f"interrupted; {partial} has the 2 completed rows" in capsys.readouterr().err
    assert not Path("PRBDM-study.csv").exists()
    with partial.open("ab") as file:
        file.write(b"0.002,0.0")

    def counted(self: Journal, point: tuple[float, ...], outcome: object) -> None:
        rows.append(point)
        add(self, point, outcome)

    monkeypatch.setattr(Journal, "add", counted)
    assert run(f"{line} .") == cli.OK
    assert len(rows) == len({*rows}) > 4
    assert not partial.exists()
    for name in ("PRBDM-study.csv", "PRBDM-best.ssv"):
        assert Path(name).read_bytes() == Path("whole", name).read_bytes()


def test_the_rows_of_another_study_are_kept_unless_they_are_overwritten(monkeypatch, capsys):
    monkeypatch.setattr(Journal, "remove", Journal._close)
    line = (
        "study PRBDM --vary 'stop.position=0:3 mm:4' --of stop.gap --workers 1 --out . --step 1ms"
    )
    assert run(f"{line} --stop-time 1ms") == cli.OK
    kept = Path("PRBDM-study.csv.partial").read_bytes()
    assert run(f"{line} --stop-time 2ms") == cli.MISTAKE
    assert "another stop time [s] (0.001, now 0.002)" in capsys.readouterr().err
    assert Path("PRBDM-study.csv.partial").read_bytes() == kept
    assert run(f"{line} --stop-time 2ms --overwrite") == cli.OK


@pytest.mark.slow
def test_commands_of_the_page_run_in_an_empty_folder(tmp_path, capsys):
    """The printed text is that of the page; the files are records and examples of the clone."""
    records(tmp_path)
    shutil.copytree(ROOT / "examples" / "shock", tmp_path / "examples" / "shock")
    draw(tmp_path / "stage.dxf", translate(framed_stage(), 10.0, 10.0))
    for block in re.findall(r"```sh\n(.*?)```", PAGE, re.DOTALL):
        for line in block.splitlines():
            program, _, words = line.partition(" ")
            assert program == "prbm"
            assert run(words) == cli.OK, line
    printed = capsys.readouterr()
    assert printed.err == "" or re.fullmatch(r"( *\d+% done(, \d+ (s|min) left)?\n)+", printed.err)
    for block in re.findall(r"```text\n(.*?)```", PAGE, re.DOTALL):
        assert block in printed.out
    for path in Path("results").glob("*.png"):
        with Image.open(path) as image:
            assert image.format == "PNG"
    assert len([*Path("results").glob("*.png")]) >= 10
    assert not [path for path in Path("results").iterdir() if path.name.startswith(".")]


def actions(parser: argparse.ArgumentParser) -> Iterator[argparse.Action]:
    """Yield the arguments of all commands of a parser."""
    for action in parser._actions:
        yield action
        if isinstance(action, argparse._SubParsersAction):
            for inner in action.choices.values():
                yield from actions(inner)


def test_an_option_with_several_values_may_be_repeated():
    options = [a for a in actions(cli.parser()) if a.option_strings and a.nargs in ("+", "*")]
    assert len(options) > 10
    lost = [a.option_strings[-1] for a in options if not isinstance(a, argparse._ExtendAction)]
    assert lost == []
    assert [a.option_strings[-1] for a in options if a.default] == []  # Values would join them.


@pytest.mark.parametrize("command", COMMANDS)
def test_help_of_every_command_has_a_valid_example(command, capsys):
    assert run(f"{command} --help") == cli.OK
    printed = capsys.readouterr().out
    assert max(map(len, printed.splitlines())) <= 100
    examples = printed.split("example")[-1].split("\n\n")[0].replace("\\\n", " ")
    lines = [line.strip() for line in examples.splitlines() if line.strip().startswith("prbm")]
    assert lines
    for line in lines:
        assert line.startswith(f"prbm {command}")
        cli.parser().parse_args(cli.protected(shlex.split(line)[1:]))


def test_help_imports_no_slow_package():
    code = (
        "import sys; from prbm.commands import command_line; command_line.parser().format_help();"
        "sys.exit(bool({'numpy', 'scipy', 'matplotlib'} & set(sys.modules)))"
    )
    subprocess.run([sys.executable, "-c", code], check=True, env=environment())


def test_simulating_in_the_kernel_imports_no_scipy(tmp_path):
    code = (
        "import sys; from prbm.commands.command_line import main; main(['simulate', 'PRBDM2R']);"
        "sys.exit(any(name.startswith('scipy') for name in sys.modules))"
    )
    subprocess.run([sys.executable, "-c", code], check=True, env=environment(), cwd=tmp_path)


def test_list_prints_the_shipped_mechanisms(capsys):
    assert run("list") == cli.OK
    assert [line.split()[0] for line in capsys.readouterr().out.splitlines()] == [*shipped()]


# --- results ------------------------------------------------------------------------------------


def test_the_mode_of_a_1r_guide_moves_along_its_circle(capsys):
    """The shares along x and y are proportional to cos^2 and sin^2 of the angle of the links."""
    guide = load("PRBDM")
    system = assemble(guide, guide.values())
    radius = system.values["flexure.gamma"] * system.values["flexure.length"]
    sine = free_displacement(system) / radius
    assert run("modes PRBDM --out .") == cli.OK
    (x,), (y,) = (table("PRBDM-modes.csv")[f"share of shuttle {axis} [-]"] for axis in "xy")
    assert float(y) / float(x) == pytest.approx(sine**2 / (1 - sine**2), rel=1e-6)
    shares = [float(v[0]) for k, v in table("PRBDM-modes.csv").items() if k.startswith("share")]
    assert sum(shares) == pytest.approx(1.0, rel=1e-12)


def test_a_held_1r_guide_is_a_crank_on_torsion_springs(capsys):
    """F = 4 k T/(r cos T), x = r sin T, y = r (cos T - 1) with the link angle T and r = gamma l."""
    assert run("equilibrium PRBDM --set gravity.x=0 --from -20mm --to 20mm --out .") == cli.OK
    p = load("PRBDM").values()
    radius = p["flexure.gamma"] * p["flexure.length"]
    I = p["flexure.width"] * p["flexure.thickness"] ** 3 / 12
    k = 2 * p["flexure.gamma"] * p["flexure.K_theta"] * p["flexure.youngs_modulus"] * I
    k /= p["flexure.length"]
    found = {key: np.array(x, float) for key, x in table("PRBDM-equilibrium.csv").items()}
    turned = np.arcsin(found["displacement [m]"] / radius)
    force = 4 * k * turned / (radius * np.cos(turned))
    np.testing.assert_allclose(found["holding force [N]"], force, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(found["across [m]"], radius * (np.cos(turned) - 1), atol=1e-12)
    stiffness = 4 * k / radius**2 * (1 / np.cos(turned) ** 2 + turned * np.tan(turned) /
                                     np.cos(turned) ** 2)  # fmt: skip
    np.testing.assert_allclose(found["stiffness [N/m]"], stiffness, rtol=1e-6)  # a difference
    assert "rest position at 0 mm: stable" in capsys.readouterr().out


def test_rest_positions_and_snap_through_of_the_bistable_mechanism_are_symmetric(capsys):
    """The struts rise by 12 mm: rest positions at 0, 12, 24 mm, snap-through around 12 mm."""
    assert run("equilibrium Bistable --from -1mm --to 25mm --points 20 --out .") == cli.OK
    rows = table("Bistable-stability.csv")
    stable, unstable, snap = "stable rest position", "unstable rest position", "snap-through"
    assert rows["kind"] == [stable, unstable, stable, "limit point", "limit point", snap, snap]
    places = np.array(rows["displacement [m]"], float)
    rise = load("Bistable").values()["strut.rise"]
    np.testing.assert_allclose(places[:3], [0.0, rise, 2 * rise], atol=1e-9)
    assert places[3] + places[4] == pytest.approx(2 * rise, abs=1e-7)
    forces = np.array(rows["force [N]"], float)
    assert forces[3] == pytest.approx(-forces[4], rel=1e-9)
    np.testing.assert_array_equal([places[5:], forces[5:]], [places[3:5], forces[3:5]])


@pytest.mark.slow
def test_a_held_curve_names_its_events_and_the_branches_at_them(capsys):
    """The curved beams buckle before the force has its extremum; all branches are unstable."""
    line = "equilibrium CurvedBistable --set gravity.y=0 --from 0 --to 2mm --points 9 --branches"
    assert run(f"{line} --out .") == cli.OK
    printed = capsys.readouterr().out
    assert "bifurcation at 1.39" in printed
    assert "bifurcation of 3 directions at 1.39" in printed
    assert "limit point at 1.74" in printed
    assert "branch 1 from 1.39" in printed
    rows = table("CurvedBistable-branches.csv")
    assert set(rows["branch"]) >= {"1", "2"}
    assert max(np.array(rows["force [N]"], float)) < 17.5
    held = table("CurvedBistable-equilibrium.csv")
    held_unstable = np.array(held["unstable directions, held"], int)
    assert np.array_equal(held_unstable > 0, np.array(held["displacement [m]"], float) > 1.391e-3)
    assert run("equilibrium CurvedBistable --from 0 --to 2mm --branches -1") == cli.MISTAKE


def test_small_loads_on_a_loaded_body_have_its_compliance_and_stiffness(capsys):
    """The stiffness along the release is that of the table of held shapes."""
    line = "equilibrium CurvedBistable --load force.y=-5N --stiffness shuttle --out ."
    assert run(line) == cli.OK
    matrices, shape = table("CurvedBistable-stiffness.csv"), table("CurvedBistable-equilibrium.csv")
    rows = np.array([matrices[x] for x in ("x", "y", "angle")], float).T
    C, K = rows[:3], rows[3:]
    assert matrices["matrix"] == 3 * ["compliance"] + 3 * ["stiffness"]
    np.testing.assert_allclose(K @ C, np.eye(3), atol=1e-9)
    stiffness = float(shape["stiffness [N/m]"][0])
    assert 1.0 / C[1, 1] == pytest.approx(stiffness, rel=1e-9)
    places = table("CurvedBistable-positions.csv")
    assert float(places["y [m]"][0]) == pytest.approx(-float(shape["displacement [m]"][0]))
    assert "small loads on shuttle at its centre of mass" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("--load force.z=1", "the loads are force.x, force.y, force.moment"),
        ("--load force.y", "give name=value"),
        ("--stiffness foo", "the bodies are shuttle"),
        ("--at shuttle.top", "give both"),
        ("--stiffness shuttle --at shuttle.foo", "the load refers to the point 'shuttle.foo'"),
        ("--stiffness shuttle --at ground.upper_left", "ground.upper_left is no point of shuttle"),
        ("--branches", "--branches are those of --vary"),
        ("--vary force.y=1", "give both ends of the range"),
        ("--vary force.y=1:1", "the ends of the range are equal"),
        ("--vary force.y=0:1 --held 1mm", "--vary excludes"),
        ("--load force.y=1 --from 0mm --to 1mm", "exclude --from and --to"),
    ],
)
def test_wrong_loads_and_bodies_are_named(line, message, capsys):
    assert run(f"equilibrium CurvedBistable {line}") != cli.OK
    assert message in capsys.readouterr().err


def test_a_load_that_varies_passes_limit_points_and_bifurcations(capsys):
    line = "equilibrium CurvedBistable --set gravity.y=0 --vary force.y=0:-40N --out ."
    assert run(line) == cli.OK
    rows = table("CurvedBistable-load-path.csv")
    printed = capsys.readouterr().out
    assert [x for x in rows["event"] if x][:3] == ["bifurcation", "bifurcation", "limit point"]
    assert float(rows["force.y [N]"][-1]) == -40.0
    assert "bifurcation at 1.39" in printed
    assert "limit point at 1.74" in printed


def test_written_simulation_obeys_the_impact_law_and_keeps_the_energy(capsys):
    """Rebound over approach speed is the restitution; the energy loss is in proportion to v^2."""
    line = "simulate PRBDM --set stop.restitution=0.5 --stop-time 150ms --step 1ms --out new/place"
    assert run(line) == cli.OK
    printed = capsys.readouterr().out
    columns, impacts = table("new/place/PRBDM.csv"), table("new/place/PRBDM-impacts.csv")
    np.testing.assert_allclose(np.array(columns["time"], float), np.linspace(0, 0.15, 151))
    assert int(columns["stop.impact_count"][-1]) == len(impacts["number"])
    assert f"impacts at stop      {len(impacts['number'])}," in printed
    approach, rebound, lost = (
        np.array(impacts[name], float)
        for name in ("approach speed [m/s]", "rebound speed [m/s]", "energy lost [J]")
    )
    np.testing.assert_allclose(rebound, 0.5 * approach, rtol=1e-9)
    np.testing.assert_allclose(lost / approach**2, (lost / approach**2)[0], rtol=1e-6)  # one mass
    energy = sum(np.array(columns[f"energy.{name}"], float)
                 for name in ("kinetic", "elastic", "gravitational", "dissipated"))  # fmt: skip
    assert np.ptp(energy) < 1e-7 * abs(energy).max()


@pytest.mark.slow
def test_spectrum_after_the_last_impact_peaks_at_a_mode(capsys):
    """The hammer vibrates freely after its last hit, at the frequency of the second mode."""
    line = "simulate ImpactOscillator --stop-time 0.45 --spectrum last --out ."
    assert run(line) == cli.OK
    rows = {key: np.array(x, float) for key, x in table("ImpactOscillator-spectrum.csv").items()}
    line_width = rows["frequency [Hz]"][1]
    top = rows["frequency [Hz]"][rows["along [m/s]"].argmax()]
    hammer = float(re.search(r"2: ([\d.]+) Hz", capsys.readouterr().out)[1])
    assert abs(top - hammer) <= line_width


def test_a_fit_recovers_the_modulus_of_a_computed_force_curve(capsys):
    """A force curve computed with twice the modulus gives twice the modulus."""
    stiff = "--set flexure.youngs_modulus=363GPa --set gravity.x=0"
    assert run(f"equilibrium PRBDM2R {stiff} --held -15 -10 -5 5 10 15 mm --out .") == cli.OK
    line = (
        "fit PRBDM2R --free flexure.youngs_modulus=100:500GPa --set gravity.x=0 --out . "
        "--force-deflection PRBDM2R-equilibrium.csv --deflection displacement "
        "--force 'holding force'"
    )
    assert run(line) == cli.OK
    found = table("PRBDM2R-fit.csv")
    assert float(found["value"][0]) == pytest.approx(363e9, rel=1e-8)
    assert float(found["standard uncertainty"][0]) < 1e-6 * 363e9
    assert Path("PRBDM2R-force.png").exists()
    assert "these data cannot separate" not in capsys.readouterr().out


@pytest.mark.slow
def test_two_coefficients_fitted_to_one_frequency_form_a_valley(capsys):
    line = "fit PRBDM2R --free flexure.K_theta1 --free flexure.K_theta2 --out . --frequency"
    assert run(f"{line} '4.82 Hz +- 0.06'") == cli.OK
    assert "these data cannot separate" in capsys.readouterr().out
    along = np.array(table("PRBDM2R-valley.csv")["misfit"], float)
    assert len(along) >= 11
    assert along.max() < 1e-6  # All points of the valley have the frequency.
    assert Path("PRBDM2R-valley.png").exists()


@pytest.mark.slow
def test_several_beams_give_a_table_with_their_mean(tmp_path, capsys):
    """The same record for a beam 1 % wider gives a modulus 1 % lower."""
    records(tmp_path)
    Path("other.csv").write_text(Path("bending.csv").read_text(encoding="utf-8"), encoding="utf-8")
    line = (
        "measure youngs-modulus bending.csv other.csv --length 40mm --width 8mm --width 8.08mm "
        "--thickness '0.1 mm +- 0.5 %' --window 10 --out ."
    )
    assert run(line) == cli.OK
    E = np.array(table("youngs-modulus.csv")["E [Pa]"], float)
    assert E[0] / E[1] == pytest.approx(1.01, rel=1e-9)
    assert E[2] == pytest.approx((E[0] + E[1]) / 2)
    assert E[0] == pytest.approx(181.5e9, rel=0.03)  # The uncertainty of E is 1.7 %.
    assert {path.name for path in Path().glob("*.png")} == {
        "bending-bending.png", "other-bending.png"
    }  # fmt: skip


def test_calibration_changes_the_amplitude_but_not_the_frequency(tmp_path, capsys):
    """The record is a vibration of 1 mm at 4.9 Hz, in volts."""
    records(tmp_path)
    assert run("measure frequency free.csv") == cli.OK
    raw = capsys.readouterr().out
    assert run("measure frequency free.csv --calibration stage.csv") == cli.OK
    calibrated = capsys.readouterr().out
    assert raw.splitlines()[0] == calibrated.splitlines()[0]
    frequency = re.match(r"frequency ([\d.]+) ± ([\d.]+) Hz", calibrated)
    assert abs(float(frequency[1]) - 4.9) < 4 * float(frequency[2]) + 1e-5
    assert re.search(r"amplitude [\d.e-]+ V, residual [\d.e-]+ V, ", raw)
    amplitude = float(re.search(r"amplitude ([\d.e-]+) m, residual [\d.e-]+ m, ", calibrated)[1])
    assert amplitude == pytest.approx(1e-3, rel=0.01)


def test_validate_compares_a_mechanism_with_elements_and_measurements(capsys):
    """The table and the figure of a cantilever of few elements have the measured value."""
    pytest.importorskip("exudyn", reason="needs Exudyn: pip install exudyn")
    measured = "'frequency 1 at rest=4.4 Hz +- 0.1'"
    assert run(f"validate Cantilever --elements 4 --measured {measured} --out .") == cli.OK
    rows = table("Cantilever-comparison.csv")
    assert rows["measured"][rows["quantity"].index("frequency 1 at rest")] == "4.4"
    assert "4.40 ± 0.10 Hz" in capsys.readouterr().out
    assert Path("Cantilever-comparison.png").exists()


@pytest.mark.slow
def test_maps_of_several_methods_share_a_table_and_a_figure(capsys):
    line = "impact-map PRBDM2R --wall-positions -5mm --offsets 2mm --method algebraic closed-form "
    line += "--out ."
    assert run(line) == cli.OK
    rows = table("PRBDM2R-impact-map.csv")
    assert rows["route"] == ["2R, algebraic", "2R, closed-form"]
    assert {path.name for path in Path().glob("*.png")} == {
        "PRBDM2R-impact-map.png", "PRBDM2R-energies-2R-algebraic.png"
    }  # fmt: skip


@pytest.mark.parametrize(
    ("line", "notes"),
    [
        ("impact-map PRBDM2R --wall-positions 0 --offsets 0 3 mm", 1),
        ("impact-map PRBDM2R --wall-positions 0 --offsets 0 3 mm --model 1R 2R", 2),
        ("impact-map PRBDM2R --wall-positions 0 --offsets 0", 0),
        ("impact-map PRBDM2R --wall-positions 0 --offsets 3mm --model 2R --axial", 0),
        ("impact-map PRBDM2R --wall-positions 0 --offsets 3mm --method closed-form", 0),
        ("simulate PRBDM --stop-time 1ms --set stop.offset=3mm --set force.x=1", 1),
        ("simulate PRBDM --stop-time 1ms", 0),
    ],
)
def test_inextensible_flexures_cause_a_note_for_hits_off_the_centre(line, notes, capsys):
    assert run(line) == cli.OK
    assert capsys.readouterr().out.count("hits 3 mm off the centre of mass of shuttle") == notes


def test_former_names_of_the_options_of_impact_maps_are_accepted_but_not_listed(capsys):
    """Scripts outside this project use them."""
    former = "impact-map PRBDM --heights 0 --offsets 0 --way closed-form"
    present = "impact-map PRBDM --wall-positions 0 --offsets 0 --method closed-form"
    assert run(former) == run(present) == cli.OK
    lines = capsys.readouterr().out.splitlines()
    assert lines[: len(lines) // 2] == lines[len(lines) // 2 :]
    assert run("impact-map --help") == cli.OK
    assert not re.search("--heights|--way", capsys.readouterr().out)


@pytest.mark.slow
@pytest.mark.parametrize(("release", "expected"), [("-18 mm", 0.01), ("-1 mm", 4e-4)])
def test_default_wall_positions_are_round_numbers(release, expected):
    assert run(f'impact-map PRBDM --set "release.displacement={release}" --offsets 0 --out .') == 0
    found = [float(x) for x in table("PRBDM-impact-map.csv")["wall position [m]"]]
    np.testing.assert_allclose(found, np.array([-1, -0.5, 0, 0.5, 1]) * expected, rtol=1e-12)


def test_frequencies_above_ten_kilohertz_are_printed_in_khz(capsys):
    assert run("modes PRBDM2RAxial --set flexure.length=4mm") == cli.OK
    assert re.search(r"\d+\.\d+ kHz", capsys.readouterr().out)


WEIGHTLESS = "--set gravity.x=0"


@pytest.mark.parametrize(
    ("line", "with_weight", "without"),
    [
        (
            "modes PRBDM",
            "at rest under gravity, shuttle 10.4",
            "at rest without gravity, shuttle 0 ",
        ),
        ("equilibrium PRBDM", "straight; gravity acts", "straight; no gravity acts"),
        (
            "simulate PRBDM --stop-time 1ms",
            "shuttle 10.42 mm from straight, under gravity, without stops",
            "shuttle 0.00 mm from straight, without gravity, without stops",
        ),
    ],
)
def test_gravity_is_mentioned_only_if_it_acts(line, with_weight, without, capsys):
    assert run(line) == cli.OK
    assert with_weight in capsys.readouterr().out
    assert run(f"{line} {WEIGHTLESS}") == cli.OK
    printed = capsys.readouterr().out
    assert without in printed
    assert "under gravity" not in printed


def test_errors_about_equilibria_mention_gravity_only_if_it_acts(capsys):
    for more, mentioned in (("", True), (WEIGHTLESS, False)):
        assert run(f"modes PRBDM --held 79mm {more}") == cli.FAILED
        printed = capsys.readouterr().err
        assert "cannot be reached" in printed
        assert ("gravity" in printed) is mentioned


def test_round_off_is_printed_as_zero():
    assert systems.rounded(6.9e-15, 80.0) == systems.rounded(-6.9e-15, 80.0, ".5g") == "0"
    assert systems.rounded(-1.2345678, 80.0, ".5g") == "-1.2346"


def test_a_mechanism_file_is_given_by_its_path(capsys):
    Path("mine.toml").write_bytes(shipped()["Bistable"].read_bytes())
    assert run("equilibrium mine.toml") == run("equilibrium Bistable") == cli.OK
    first, second = capsys.readouterr().out.split("Bistable: ")[1:]
    assert first == second
    assert run("animate mine.toml out.gif --stop-time 5ms --fps 5 --slow 100") == cli.OK
    assert Path("out.gif").exists()


# --- mistakes of the user -----------------------------------------------------------------------


MISTAKES = [
    ("modes Bistabel", "unknown mechanism 'Bistabel' (mechanism files end in .toml); did you"),
    ("modes none.toml", "none.toml: cannot be read"),
    ("modes PRBDM --held 10kg", "--held 10kg: the unit 'kg' has another dimension; write a qu"),
    ("modes PRBDM --held much", "--held much: write a number in m, or a number and a unit"),
    ("modes PRBDM --held nan", "--held nan: write a finite number in m"),
    ("modes PRBDM --count 0", "--count 0: must be at least 1"),
    ("modes PRBDM --set shuttle.mas=1", "did you mean shuttle.mass"),
    ("modes PRBDM --set shuttle.mass", "--set shuttle.mass: write NAME=VALUE"),
    ("modes PRBDM --set shuttle.mass=1m", "the unit 'm' has another dimension; write a quant"),
    ("modes PRBDM --set shuttle.mass=-1kg", "shuttle.mass = -1 kg"),
    ("modes PRBDM --set flexure.thickness=0.1", "0.1 m is not less than the length of the flexure"),
    ("modes PRBDM --set force.x=1", "force.x: inputs act only in simulations"),
    ("modes PRBDM --out taken", "taken is a file; choose a folder with --out"),
    ("modes PRBDM --sat shuttle.mass=1", "unrecognized arguments: --sat"),
    ("modes", "the following arguments are required: MECHANISM; see prbm modes --help"),
    ("mods PRBDM", "invalid choice: 'mods'"),
    ("equilibrium PRBDM --from 1mm", "--from and --to: give both ends"),
    ("equilibrium PRBDM --from 1mm --to 0", "--from 0.001 m must be below --to 0 m"),
    ("equilibrium PRBDM --from 0 --to 1mm --held 0", "--held excludes --from and --to"),
    ("equilibrium PRBDM --from 0 --to 1mm --points 2", "must lie between 3 and"),
    ("equilibrium PRBDM --held -10mm 5", "5 has no unit and others have one"),
    ("equilibrium PRBDM --held -10 5", "--held -10 m: more than the size of the mechanism, 0.08 m"),
    ("equilibrium PRBDM --from -10 --to 5", "check the unit, for instance --from -10mm"),
    ("modes PRBDM --held 10", "check the unit, for instance --held 10mm"),
    ("impact-map PRBDM --wall-positions -10 5", "for instance --wall-positions -10mm"),
    ("impact-map PRBDM --offsets 4", "check the unit, for instance --offsets 4mm"),
    ("simulate PRBDM --stop-time 0", "stop_time = 0 s must be positive"),
    ("simulate PRBDM --stop-time 1m", "--stop-time 1m: the unit 'm' has another dimension"),
    ("simulate PRBDM --step 1ns", "choose a larger step"),
    ("simulate PRBDM --tolerance 2", "must lie between 0 and 1"),
    ("simulate PRBDM --stop-time 10ms --spectrum", "no impact in 0.01 s"),
    ("simulate PRBDM --input force.x", "--input force.x: write NAME=VALUE, for instance"),
    ("simulate PRBDM --input 'forc.x=step(1 N)'", "did you mean force.x"),
    ("simulate PRBDM --input 'force.x=stpe(1 N)'", "unknown shape 'stpe'; did you mean step"),
    ("simulate PRBDM --input 'force.x=step(1 m)'", "the unit 'm' has another dimension"),
    ("simulate PRBDM --input force.x=1 --input force.x=2", "force.x is given twice"),
    ("simulate PRBDM --input force.x=1 --set force.x=1", "both as a constant and over time"),
    ("simulate PRBDM --input 'force.x=step(1 N)' --spectrum", "use --spectrum last"),
    ("study PRBDM", "give the parameters with --vary, a list"),
    ("study PRBDM --vary stop.position=0:1mm", "write LOW:HIGH:COUNT with a count of at least 2"),
    ("study PRBDM --vary stop.position=0:1mm:1", "write LOW:HIGH:COUNT"),
    ("study PRBDM --vary stop.position=1:0mm:3", "the lower end must be below the upper one"),
    ("study PRBDM --vary stop.position=0:1s:3", "stop.position= 1s: the unit 's' has another"),
    ("study PRBDM --vary stop.position=-:1mm:3", "stop.position= -: write a number in m"),
    ("study PRBDM --vary stop.positoin=0:1mm:3", "did you mean stop.position"),
    ("study PRBDM --vary stop.position=0:1mm:3", "no output is selected; name one"),
    ("study PRBDM --vary stop.position=0:1mm:3 --of setling", "did you mean settling"),
    ("study PRBDM --vary a=0:1:2 --minimise x --maximise y", "not allowed with argument"),
    ("animate a.csv a.gif --model PRBDM --input force.x=1", "--input: a result is shown"),
    ("fit PRBDM --free flexure.K_theta", "no measured data: give"),
    ("fit PRBDM --frequency '5 +- 1'", "required: --free"),
    ("fit PRBDM --free K_theta --frequency '5 +- 1'", "did you mean flexure.K_theta"),
    ("fit PRBDM --free flexure.K_theta=1 --frequency '5 +- 1'", "flexure.K_theta=LOW:HIGH"),
    ("fit PRBDM --free flexure.K_theta=2:1 --frequency '5 +- 1'", "lower bound must be below"),
    ("fit PRBDM --free flexure.K_theta --frequency 5Hz", "add the standard uncertainty"),
    ("fit PRBDM --free flexure.K_theta --frequency '5 Hz +- 1 mm'", "has another dimension"),
    ("fit PRBDM --free flexure.K_theta --frequency '5 +- -1'", "must not be negative"),
    ("fit PRBDM --free flexure.K_theta --frequency '5 +- 1 mode 3'", "PRBDM has 1 modes"),
    ("impact-map PRBDM --stop bumper", "no stop bumper; it has stop"),
    ("impact-map ImpactOscillator", "position of impact is an expression"),
    ("impact-map PRBDM --wall-positions 1 1 mm", "a value is given twice"),
    ("impact-map PRBDM --set release.displacement=0", "no default wall positions; give"),
    ("impact-map Cantilever --wall-positions 3mm --method closed-form", "choose another method"),
    ("impact-map PRBDM --method magic", "invalid choice: 'magic'"),
    ("impact-map PRBDM --axial", "--axial needs --model"),
    ("impact-map PRBDM --model nR --links 0", "--links 0: must be at least 1"),
    ("picture PRBDM --modes 13", "13 modes: choose a number from 0 to 12"),
    ("picture PRBDM --out taken/a.png", "cannot write to taken: taken is a file; choose another"),
    ("animate PRBDM taken/a.gif", "cannot write to taken: taken is a file; choose another folder"),
    ("animate PRBDM new/a.gif --slow -1", "slow = -1 must be positive"),
    ("animate PRBDM", "give the file to write, too: prbm animate PRBDM PRBDM.gif"),
    ("animate out.gif", "nothing to show: give RESULT.csv"),
    ("animate PRBDM out.txt", "end the name in .gif or .mp4"),
    ("measure", "required: QUANTITY"),
    ("validate --measured f=1", "--measured needs a mechanism"),
    ("validate --only steps --elements 4", "--elements needs a mechanism"),
    ("validate --only steps --elements 0", "--elements needs a mechanism"),
    ("validate PRBDM --only table", "omit MECHANISM"),
    ("validate PRBDM --measured frequency", "write NAME=VALUE+-U"),
]  # fmt: skip


@pytest.mark.parametrize(("line", "sentence"), MISTAKES)
def test_mistakes_are_reported_in_one_sentence_and_nothing_is_written(line, sentence, capsys):
    Path("taken").write_text("", encoding="utf-8")
    assert run(line) == cli.MISTAKE
    printed = capsys.readouterr().err
    assert sentence in printed
    *progress, last = printed.splitlines()
    assert re.match(r"prbm[\w -]*: ", last)
    assert all("%" in line for line in progress)
    assert [path.name for path in Path().iterdir()] == ["taken"]


@pytest.mark.parametrize(
    "line",
    [
        "picture PRBDM --modes 5 --out new/deep/a.png",
        "animate PRBDM new/deep/a.gif --stop-time 2ms --slow 200 --fps 10",
    ],
)
def test_missing_output_folders_are_created(line, capsys):
    assert run(line) == cli.OK
    (written,) = Path("new/deep").iterdir()
    assert capsys.readouterr().out == f"{written}\n"


def test_an_unwritable_film_is_reported_before_the_simulation(monkeypatch):
    Path("taken").write_text("", encoding="utf-8")
    monkeypatch.setattr("prbm.commands.pictures.simulate", pytest.fail)
    assert run("animate PRBDM taken/a.gif") == cli.MISTAKE


def test_a_failed_computation_has_its_own_exit_status(capsys):
    assert run("equilibrium PRBDM --held 50mm") == cli.FAILED
    assert "release.displacement = 0.05 m cannot be reached" in capsys.readouterr().err


CROSS = """\
name = "CrossPivot"
title = "Wheel on two leaves that cross at its centre of mass"
ground.left = ["-5 mm", "-5 mm"]
ground.right = ["5 mm", "-5 mm"]
release = { body = "wheel", direction = 90 }
[[flexure_types]]
name = "leaf"
model = "3R"
thickness = "0.05 mm"
width = "2 mm"
youngs_modulus = "200 GPa"
density = 7800
[[bodies]]
name = "wheel"
mass = "2 g"
inertia = "200 g.mm2"
centre = [0, 0]
points.left = ["-5 mm", "5 mm"]
points.right = ["5 mm", "5 mm"]
[[flexures]]
name = "rising"
type = "leaf"
start = "ground.left"
end = "wheel.right"
[[flexures]]
name = "falling"
type = "leaf"
start = "ground.right"
end = "wheel.left"
"""


def test_a_wheel_on_a_cross_pivot_has_a_rest_position_but_no_stiffness(capsys):
    """No force on its centre of mass moves the wheel."""
    Path("cross.toml").write_text(CROSS, encoding="utf-8")
    assert run("equilibrium cross.toml --out .") == cli.OK
    printed = capsys.readouterr().out
    assert "rest position at 0 mm: stable" in printed
    assert "no stiffness: the centre of mass of the body wheel cannot move" in printed
    assert table("CrossPivot-equilibrium.csv")["stiffness [N/m]"] == ["nan"]
    assert run("equilibrium cross.toml --held 1mm") == cli.FAILED
    failed = capsys.readouterr()
    assert "= 0.001 m: the centre of mass of the body wheel cannot move" in failed.err
    assert failed.out == "", "head of a table without rows"
    assert run("simulate cross.toml --set release.velocity=0.1") == cli.MISTAKE
    assert (
        "turns about; give another release.point, or release another body"
        in capsys.readouterr().err
    )


def test_commands_that_need_a_stop_report_a_missing_one(capsys):
    Path("cross.toml").write_text(CROSS, encoding="utf-8")
    Path("data.csv").write_text(text(*GOOD), encoding="utf-8")
    restitution = "measure restitution data.csv --mechanism cross.toml"
    for line in (
        "impact-map cross.toml --wall-positions 0 1 mm",
        restitution,
        f"{restitution} --stop wall",
    ):
        assert run(line) == cli.MISTAKE
        sentence = "has no stop wall" if "--stop" in line else "has no stop to hit"
        assert f"CrossPivot {sentence}: describe one in [[stops]]" in capsys.readouterr().err


PROPOSALS = {
    "modes PRBDM --cont 3": "unrecognized arguments: --cont; did you mean --count?",
    "simulate PRBDM --stoptime=1": "--stoptime; did you mean --stop-time?",
    "fit PRBDM --frequncy 5": "--frequncy; did you mean --frequency?",
    "modes PRBDM --set a.b=1 c.d=2": "c.d=2; repeat the option: --set 'c.d=2'",
    "modes PRBDM --colour red": "unrecognized arguments: --colour; see prbm modes --help",
    "mods PRBDM": "did you mean modes?",
    "measure frequncy a.csv": "did you mean frequency?",
    "impact-map PRBDM --method algebric": "did you mean algebraic?",
    "--verson": "did you mean --version?",
}


@pytest.mark.parametrize("line", PROPOSALS)
def test_similar_words_are_proposed_for_misspelt_options_and_commands(line, capsys):
    assert run(line) == cli.MISTAKE
    assert PROPOSALS[line] in capsys.readouterr().err


def test_version_is_printed(capsys):
    assert run("--version") == cli.OK
    assert re.fullmatch(r"prbm-impact \d+\.\d+\.\d+\n", capsys.readouterr().out)


def test_the_range_in_the_help_of_equilibrium_contains_all_rest_positions(capsys):
    assert run("equilibrium --help") == cli.OK
    line = re.search(r"prbm (equilibrium Bistable --from \S+ --to \S+)", capsys.readouterr().out)[1]
    assert run(line) == cli.OK
    found = re.findall(r"rest position at (\S+) mm: (\w+)", capsys.readouterr().out)
    assert found == [("0", "stable"), ("12", "unstable"), ("24", "stable")]


def test_without_a_command_the_help_is_printed(capsys):
    assert run("") == cli.MISTAKE
    assert "examples:" in capsys.readouterr().err


# --- malformed data -----------------------------------------------------------------------------


TIME = np.arange(400) / 200.0
SWING = 1e-3 * np.exp(-0.5 * TIME) * np.cos(2 * np.pi * 5 * TIME)
FREQUENCY = "measure frequency data.csv"
RESTITUTION = "measure restitution data.csv"
MODULUS = "measure youngs-modulus data.csv --length 40mm --width 8mm --thickness 0.1mm"
CURVE = "fit PRBDM --free flexure.youngs_modulus --force-deflection data.csv"


def text(head: str, *columns: np.ndarray, change=lambda lines: lines) -> str:
    lines = [head, *(",".join(f"{x:.9g}" for x in row) for row in zip(*columns, strict=True))]
    return "\n".join(change(lines)) + "\n"


def replaced(number: int, line: str):
    return lambda lines: [*lines[:number], line, *lines[number + 1 :]]


def without(start: int, end: int):
    return lambda lines: [*lines[:start], *lines[end:]]


GOOD = ("t [s],x [m]", TIME, SWING)
MALFORMED = {
    "no file": (None, FREQUENCY, "data.csv: cannot be read"),
    "empty": ("", FREQUENCY, "empty file: export the record again"),
    "a picture": ("\x89PNG\x00\x01", FREQUENCY, "data.csv: binary data"),
    "prose": ("what we\nmeasured\nyesterday\n", FREQUENCY, "not a table"),
    "no such column": (text(*GOOD), f"{FREQUENCY} --column y", "unknown column 'y'; columns"),
    "a misprinted column": (
        text("t [s],laser [m]", TIME, SWING), f"{FREQUENCY} --column lasr", "mean 'laser'?"
    ),
    "several signals": (
        text("t [s],x [m],y [m]", TIME, SWING, SWING), FREQUENCY,
        "the signal can be x or y; name it with --column NAME",
    ),
    "no time": (text("a [m],b [N]", TIME, SWING), f"{FREQUENCY} --column a", "--unit \"a=s\""),
    "a gap": (text(*GOOD, change=without(50, 80)), FREQUENCY, "line 51: a gap of 0.155 s follows"),
    "not a number": (text(*GOOD, change=replaced(9, "0.04,nan")), FREQUENCY, "line 10, column 'x'"),
    "an empty cell": (text(*GOOD, change=replaced(9, "0.04,")), FREQUENCY, "line 10: 1 values for"),
    "a word": (text(*GOOD, change=replaced(9, "0.04,late")), FREQUENCY, "'late' is not a number"),
    "a unit in a cell": (
        text(*GOOD, change=replaced(9, "0.04,1.2 mm")), FREQUENCY, "has a unit: write"
    ),
    "constant time": (
        text(*GOOD, change=replaced(9, "0.035,0.1")), FREQUENCY, "equals that of the row above"
    ),
    "decreasing time": (
        text(*GOOD, change=replaced(9, "0.01,0.1")), FREQUENCY, "is before that of the row above"
    ),
    "too short": (text("t [s],x [m]", TIME[:9], SWING[:9]), FREQUENCY, "are too few to evaluate"),
    "cut too short": (text(*GOOD), f"{FREQUENCY} --to 20ms", "are too few to evaluate"),
    "cut away": (
        text(*GOOD), f"{FREQUENCY} --from 20",
        "x has no samples from 20 s on: choose a start and a later end between 0 s and 1.995 s",
    ),
    "cut away before": (text(*GOOD), f"{FREQUENCY} --to -1", "x has no samples up to -1 s: "),
    "cut the wrong way": (
        text(*GOOD), f"{FREQUENCY} --from 1.5 --to 1", "no samples from 1.5 s to 1 s: choose"
    ),
    "nothing is bent": (
        text("d [mm],F [N]", 0 * TIME + 0.5, SWING), MODULUS,
        "the deflection does not change, it is 0.0005 m throughout: choose the col",
    ),
    "nothing moves": (text("t [s],x [m]", TIME, 0 * TIME + 1), FREQUENCY, "x does not change: "),
    "one swing": (text("t [s],x [m]", TIME / 40, SWING), f"{FREQUENCY} --to 8ms", "or less in"),
    "another unit": (
        text("t [s],x [N]", TIME, SWING), RESTITUTION, "no column in m or a multiple of it for the"
    ),
    "another unit, named": (
        text("t [s],x [N]", TIME, SWING), f"{RESTITUTION} --column x", "is in N, but m was expected"
    ),
    "no unit": (
        text("t [s],x", TIME, SWING), f"{RESTITUTION} --column x", 'give its unit, --unit "x=m"'
    ),
    "an unknown unit": (
        text("t [s],x [furlong]", TIME, SWING), f"{RESTITUTION} --column x", "the unknown unit"
    ),
    "an unknown unit, given": (text(*GOOD), f"{FREQUENCY} --unit x=ell", "'ell' of 'x' is"),
    "a unit of no column": (text(*GOOD), f"{FREQUENCY} --unit y=m", "the unknown column 'y'"),
    "no unit after the sign": (text(*GOOD), f"{FREQUENCY} --unit x", "--unit x: write NAME=TEXT"),
    "millimetres as metres": (
        text("t [s],x [m]", TIME, 1e3 * SWING), RESTITUTION, "check the unit of the column"
    ),
    "a calibration of another sensor": (
        text(*GOOD), f"{RESTITUTION} --calibration data.csv", "and one length"
    ),
    "a signal that needs no calibration": (
        text("t [s],x [A]", TIME, SWING), f"{RESTITUTION} --calibration stage.csv",
        "it must have one column in A, the unit of the signal, and one length; columns are pos",
    ),
    "no impact": (text(*GOOD), RESTITUTION, "no impact in the record"),
    "no head": (
        text(*GOOD, change=without(0, 1)), FREQUENCY, 'for instance --columns "t [s]" "x [mm]"'
    ),
    "too many names": (text(*GOOD), f"{FREQUENCY} --columns 't [s]'", "1 names for 2"),
    "no force": (text("d [mm],x [mm]", TIME, SWING), MODULUS, "the deflection can be d or x"),
    "volts for a force": (text("d [mm],F [V]", TIME, SWING), MODULUS, "no column in N or a multip"),
    "longer than the beam": (text("d [m],F [N]", TIME, SWING), MODULUS, "is longer than the beam"),
    "no stiffness": (
        text("d [mm],F [N]", TIME, 0 * TIME), MODULUS, "no stiffness, the force changes by"
    ),
    "a fit range of nothing": (
        text("d [mm],F [N]", TIME, TIME), f"{MODULUS} --fit-range 1 0", "--fit-range (1.0, 0.0)"
    ),
    "two lengths, one file": (
        text("d [mm],F [N]", TIME, TIME), f"{MODULUS} --length 41mm", "--length is given 2 times"
    ),
    "a beam without thickness": (
        text("d [mm],F [N]", TIME, TIME), MODULUS.replace("0.1mm", "0mm"), "must be positive"
    ),
    "a sensor that reads nothing": (
        text("d [mm],U [V]", TIME, 0 * TIME), "measure calibration data.csv", "check the wiring"
    ),
    "a curve in metres": (text("d [m],F [N]", TIME, TIME), CURVE, "check the unit of the column"),
    "a curve without forces": (text("d [mm],t [s]", TIME, TIME), CURVE, "for the force"),
    "an uncertainty of nothing": (
        text("d [mm],F [mN]", TIME, TIME), f"{CURVE} --force-uncertainty 0", "must be positive"
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", MALFORMED)
def test_malformed_data_are_reported_in_one_sentence(case, capsys):
    content, line, sentence = MALFORMED[case]
    if content is not None:
        Path("data.csv").write_bytes(content.encode("latin-1"))
    write(Path("stage.csv"), "position [mm],laser [V]", TIME, 2 * TIME)
    assert run(f"{line} --out results") == cli.MISTAKE
    printed = capsys.readouterr()
    assert sentence in printed.err
    assert printed.err.count("\n") == 1
    assert printed.out == ""
    assert not Path("results").exists()


# --- files, signals, pipes ----------------------------------------------------------------------


@pytest.mark.parametrize("failing", [0, 1])
def test_files_are_written_all_or_none(failing, monkeypatch):
    """A failure during the writing leaves the existing files unchanged."""
    Path("a").write_bytes(b"old")
    real, calls = os.fsync, []

    def fails(handle: int) -> None:
        calls.append(handle)
        if len(calls) > failing:
            raise OSError(28, "No space left on device")
        real(handle)

    monkeypatch.setattr(os, "fsync", fails)
    with pytest.raises(OSError, match="No space left") as caught:
        files.write_all({Path("a"): b"new", Path("b"): b"new"})
    assert caught.value.filename == "ab"[failing]
    assert {path.name: path.read_bytes() for path in Path().iterdir()} == {"a": b"old"}


def test_a_folder_with_the_name_of_an_output_file_is_reported(capsys):
    Path("PRBDM-modes.csv").mkdir()
    assert run("modes PRBDM --out .") == cli.MISTAKE
    assert "PRBDM-modes.csv: it is a folder" in capsys.readouterr().err
    assert [path.name for path in Path().iterdir()] == ["PRBDM-modes.csv"]


def environment() -> dict[str, str]:
    paths = [str(ROOT / "fmu_src"), *os.environ.get("PYTHONPATH", "").split(os.pathsep)]
    return os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, paths))}


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="Windows has no SIGINT for single processes")
def test_ctrl_c_ends_a_simulation_without_a_traceback():
    """The signal is sent after the first line of progress, during the simulation."""
    words = [sys.executable, "-m", "prbm", "simulate", "PRBDM2R", "--stop-time", "1000"]
    with subprocess.Popen(
        [*words, "--out", "."], stderr=subprocess.PIPE, stdout=subprocess.PIPE, env=environment(),
        preexec_fn=interruptible,
    ) as process:  # fmt: skip
        assert process.stderr is not None
        assert b"% done" in process.stderr.readline()
        process.send_signal(signal.SIGINT)
        _, printed = process.communicate(timeout=60)
    assert process.returncode == cli.INTERRUPTED
    assert b"Traceback" not in printed
    assert printed.decode().splitlines()[-1] == "prbm simulate: interrupted"
    assert [*Path().iterdir()] == []


@pytest.mark.parametrize(
    ("raised", "sentence", "status"),
    [
        (KeyboardInterrupt(), "prbm: interrupted", cli.INTERRUPTED),
        (ModuleNotFoundError("no", name="scipy"), "prbm: the Python package scipy is missing", 2),
    ],
)
def test_errors_during_the_imports_are_reported_in_one_sentence(
    raised, sentence, status, monkeypatch, capsys
):
    def ends(_: object) -> int:
        raise raised

    monkeypatch.setattr(cli, "main", ends)
    assert started() == status
    assert sentence in capsys.readouterr().err


def test_the_message_after_ctrl_c_names_the_command(monkeypatch, capsys):
    def ends(_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(cli, "_function", lambda _: ends)
    assert run("simulate PRBDM") == cli.INTERRUPTED
    assert capsys.readouterr().err == "prbm simulate: interrupted\n"


def test_a_lack_of_memory_is_reported_in_one_sentence(monkeypatch, capsys):
    def allocates(_: object) -> None:
        np.empty(2**59)

    monkeypatch.setattr(cli, "_function", lambda _: allocates)
    assert run("simulate PRBDM") == cli.FAILED
    assert capsys.readouterr().err.startswith("prbm simulate: there is not enough memory; choose ")


@pytest.mark.parametrize("unbuffered", ["", "1"])
@pytest.mark.parametrize("command", ["--help", "list"])
def test_a_closed_pipe_is_not_reported(command, unbuffered):
    """An output without a buffer fails when it is written, another one at the end."""
    words = [sys.executable, "-m", "prbm", command]
    with subprocess.Popen(
        words, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        env=environment() | {"PYTHONUNBUFFERED": unbuffered},
    ) as process:  # fmt: skip
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdout.close()
        printed = process.stderr.read()
    assert printed == b""
    assert process.returncode == cli.FAILED


def test_the_readme_names_the_page_and_the_page_all_commands():
    assert "docs/command-line.md" in (ROOT / "README.md").read_text(encoding="utf-8")
    for command in COMMANDS:
        assert f"prbm {command}" in PAGE


def test_the_help_of_validate_names_a_compared_quantity(capsys):
    """A measured value needs the full name of its row, "frequency 1 at rest"."""
    assert run("validate --help") == cli.OK
    assert '--measured "frequency 1 at rest=4.82 Hz +- 0.06"' in capsys.readouterr().out


def test_a_body_that_is_released_by_an_angle_is_held_by_a_moment(capsys):
    """Amounts are angles in all commands that hold the body."""
    pivot = shlex.quote(str(SUPPORT / "pivot.toml"))
    assert run(f"equilibrium {pivot} --held 5deg") == cli.OK
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "Pivot: rotation of wheel, from straight; no gravity acts"
    assert lines[1].split()[:4] == ["at", "[deg]", "moment", "[N.m]"]
    at, moment, stiffness = map(float, lines[2].split()[:3])
    assert at == 5.0
    assert moment == pytest.approx(stiffness * math.radians(5.0), rel=0.01)
    assert run(f"modes {pivot} --held 5deg --count 1") == cli.OK
    assert "Pivot, wheel held at 5 deg from straight by" in capsys.readouterr().out
    assert run(f"simulate {pivot} --stop-time 1ms") == cli.OK
    assert "free rest position   wheel 0.00 deg from straight" in capsys.readouterr().out
    assert run(f"equilibrium {pivot} --held 10deg --set eccentricity=1mm") == cli.OK
    assert run(f"modes {pivot} --held 400deg") == cli.MISTAKE
    assert "more than a turn; check the unit" in capsys.readouterr().err
    assert run(f"validate {pivot}") == cli.MISTAKE
    assert "give release.displacement" in capsys.readouterr().err


@pytest.mark.parametrize("name", ["modes", "simulate --stop-time 1ms", "picture --modes 2"])
def test_commands_note_a_mode_that_inextensible_flexures_suppress(name, capsys, tmp_path):
    command, *options = name.split()
    out = ["--out", str(tmp_path / "finger.png")] if command == "picture" else []
    assert cli.main([command, str(SUPPORT / "finger.toml"), *options, *out]) == cli.OK
    assert "note: finger at rest: mode 2 is at 3953 Hz" in capsys.readouterr().out


def test_an_impact_map_notes_positions_that_few_pivots_do_not_describe(capsys):
    finger = shlex.quote(str(SUPPORT / "finger.toml"))
    assert run(f"impact-map {finger} --wall-positions 0 3 mm --offsets 0") == cli.OK
    out = capsys.readouterr().out
    assert "note, 2R: finger held at the wall of stop, hit point displaced by 3 mm" in out
    assert "set axial = true" in out
