"""The command prbm: what it prints and writes is what the laws say, mistakes get a sentence."""

import csv
import io
import os
import re
import shlex
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from measurement_records import records, write
from prbm.__main__ import main as started
from prbm.base import atomic as files
from prbm.commands import command_line as cli
from prbm.commands import systems
from prbm.files.mechanism_file import load, shipped
from prbm.mechanics.assembly import assemble
from prbm.mechanics.statics import free_displacement
from support import ROOT

PAGE = (ROOT / "docs" / "command-line.md").read_text(encoding="utf-8")
COMMANDS = (
    "list", "modes", "equilibrium", "simulate", "fit", "impact-map", "sweep", "picture", "animate",
    "validate", "measure youngs-modulus", "measure calibration", "measure frequency",
    "measure restitution",
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


# --- the page and the help ----------------------------------------------------------------------


@pytest.mark.slow
def test_the_commands_of_the_page_run_in_an_empty_folder(tmp_path, capsys):
    """And print what the page says that they print."""
    records(tmp_path)
    for block in re.findall(r"```sh\n(.*?)```", PAGE, re.DOTALL):
        for line in block.splitlines():
            program, _, words = line.partition(" ")
            assert program == "prbm"
            assert run(words) == cli.OK, line
    told = capsys.readouterr()
    assert told.err == "" or re.fullmatch(r"( *\d+% done\n)+", told.err)
    for block in re.findall(r"```text\n(.*?)```", PAGE, re.DOTALL):
        assert block in told.out
    for path in Path("results").glob("*.png"):
        with Image.open(path) as image:
            assert image.format == "PNG"
    assert len([*Path("results").glob("*.png")]) >= 10
    assert not [path for path in Path("results").iterdir() if path.name.startswith(".")]


@pytest.mark.parametrize("command", COMMANDS)
def test_help_of_every_command_has_an_example_that_is_read_without_a_mistake(command, capsys):
    assert run(f"{command} --help") == cli.OK
    told = capsys.readouterr().out
    assert max(map(len, told.splitlines())) <= 100
    examples = told.split("example")[-1].split("\n\n")[0].replace("\\\n", " ")
    lines = [line.strip() for line in examples.splitlines() if line.strip().startswith("prbm")]
    assert lines
    for line in lines:
        assert line.startswith(f"prbm {command}")
        cli.parser().parse_args(cli.protected(shlex.split(line)[1:]))


def test_help_comes_before_anything_slow_is_imported():
    code = (
        "import sys; from prbm.commands import command_line; command_line.parser().format_help();"
        "sys.exit(bool({'numpy', 'scipy', 'matplotlib'} & set(sys.modules)))"
    )
    subprocess.run([sys.executable, "-c", code], check=True, env=environment())


def test_the_list_is_that_of_the_shipped_mechanisms(capsys):
    assert run("list") == cli.OK
    assert [line.split()[0] for line in capsys.readouterr().out.splitlines()] == [*shipped()]


# --- what the numbers are -----------------------------------------------------------------------


def test_the_mode_of_a_1r_guide_moves_along_its_circle(capsys):
    """Kinetic energy along x and y as cos^2 and sin^2 of the link's angle."""
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
    """F = 4 k Theta/(gamma l cos Theta), x = gamma l sin Theta, y = gamma l (cos Theta - 1)."""
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
    np.testing.assert_allclose(found["stiffness [N/m]"], stiffness, rtol=1e-6)  # h^2
    assert "rests at 0 mm: stable" in capsys.readouterr().out


def test_a_bistable_mechanism_rests_and_snaps_symmetrically(capsys):
    """The struts rise by 12 mm: places of rest at 0, 12, 24 mm, snaps mirrored about the middle."""
    assert run("equilibrium Bistable --from -1mm --to 25mm --points 20 --out .") == cli.OK
    rows = table("Bistable-rests.csv")
    assert rows["kind"] == ["stable rest", "unstable rest", "stable rest", "snap", "snap"]
    places = np.array(rows["displacement [m]"], float)
    rise = load("Bistable").values()["strut.rise"]
    np.testing.assert_allclose(places[:3], [0.0, rise, 2 * rise], atol=1e-9)
    assert places[3] + places[4] == pytest.approx(2 * rise, abs=1e-7)
    forces = np.array(rows["force [N]"], float)
    assert forces[3] == pytest.approx(-forces[4], rel=1e-9)


def test_a_simulation_is_written_as_the_engine_has_it(capsys):
    """Rows at the steps; rebound over approach is the restitution; energy lost is what is lost."""
    line = "simulate PRBDM --set stop.restitution=0.5 --stop-time 150ms --step 1ms --out new/place"
    assert run(line) == cli.OK
    told = capsys.readouterr().out
    columns, impacts = table("new/place/PRBDM.csv"), table("new/place/PRBDM-impacts.csv")
    np.testing.assert_allclose(np.array(columns["time"], float), np.linspace(0, 0.15, 151))
    assert int(columns["stop.impact_count"][-1]) == len(impacts["number"])
    assert f"impacts at stop      {len(impacts['number'])}," in told
    approach, rebound, lost = (
        np.array(impacts[name], float)
        for name in ("approach speed [m/s]", "rebound speed [m/s]", "energy lost [J]")
    )
    np.testing.assert_allclose(rebound, 0.5 * approach, rtol=1e-9)
    np.testing.assert_allclose(lost / approach**2, (lost / approach**2)[0], rtol=1e-6)  # one mass
    energy = sum(np.array(columns[f"energy.{name}"], float)
                 for name in ("kinetic", "elastic", "gravitational", "dissipated"))  # fmt: skip
    assert np.ptp(energy) < 1e-7 * abs(energy).max()


def test_what_is_heard_after_the_last_impact_is_a_mode(capsys):
    """The hammer of the oscillator vibrates freely after its last hit, at its own frequency."""
    line = "simulate ImpactOscillator --stop-time 0.35 --spectrum last --out ."
    assert run(line) == cli.OK
    rows = {key: np.array(x, float) for key, x in table("ImpactOscillator-spectrum.csv").items()}
    line_width = rows["frequency [Hz]"][1]
    top = rows["frequency [Hz]"][rows["along [m/s]"].argmax()]
    hammer = float(re.search(r"2: ([\d.]+) Hz", capsys.readouterr().out)[1])
    assert abs(top - hammer) <= line_width


def test_a_fit_finds_what_a_model_was_given(capsys):
    """Force curve of twice the modulus: twice the modulus, and next to no uncertainty."""
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


def test_two_coefficients_and_one_frequency_are_a_valley(capsys):
    line = "fit PRBDM2R --free flexure.K_theta1 --free flexure.K_theta2 --out . --frequency"
    assert run(f"{line} '4.82 Hz +- 0.06'") == cli.OK
    assert "these data cannot separate" in capsys.readouterr().out
    along = np.array(table("PRBDM2R-valley.csv")["misfit"], float)
    assert len(along) >= 11
    assert along.max() < 1e-6  # every point of the valley has the frequency
    assert Path("PRBDM2R-valley.png").exists()


def test_several_beams_are_a_table_with_their_mean(tmp_path, capsys):
    """The same record as a beam that is 1 % wider: a modulus that is 1 % lower."""
    records(tmp_path)
    Path("other.csv").write_text(Path("bending.csv").read_text())
    line = (
        "measure youngs-modulus bending.csv other.csv --length 40mm --width 8mm --width 8.08mm "
        "--thickness '0.1 mm +- 0.5 %' --window 10 --out ."
    )
    assert run(line) == cli.OK
    E = np.array(table("youngs-modulus.csv")["E [Pa]"], float)
    assert E[0] / E[1] == pytest.approx(1.01, rel=1e-9)
    assert E[2] == pytest.approx((E[0] + E[1]) / 2)
    assert E[0] == pytest.approx(181.5e9, rel=0.03)  # its uncertainty is 1.7 %
    assert {path.name for path in Path().glob("*.png")} == {
        "bending-bending.png", "other-bending.png"
    }  # fmt: skip


def test_a_calibrated_signal_has_the_frequency_of_the_raw_one(tmp_path, capsys):
    """A linear sensor changes no frequency, and puts the amplitude right: 1 mm, 4.9 Hz."""
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


def test_a_mechanism_is_put_beside_its_referees(capsys):
    """A cantilever of few elements: the table, its figure, and a measured value in it."""
    pytest.importorskip("exudyn", reason="the finite elements are Exudyn's: pip install exudyn")
    pytest.importorskip("prbm.analysis.comparison", reason="not there yet")
    measured = "'frequency 1 at rest=4.4 Hz +- 0.1'"
    assert run(f"validate Cantilever --elements 4 --measured {measured} --out .") == cli.OK
    rows = table("Cantilever-comparison.csv")
    assert rows["measured"][rows["quantity"].index("frequency 1 at rest")] == "4.4"
    assert "4.40 ± 0.10 Hz" in capsys.readouterr().out
    assert Path("Cantilever-comparison.png").exists()


def test_a_map_of_one_point_is_written_without_a_surface(capsys):
    line = "impact-map PRBDM2R --heights -5mm --offsets 2mm --way algebraic closed-form --out ."
    assert run(line) == cli.OK
    rows = table("PRBDM2R-impact-map.csv")
    assert rows["route"] == ["2R, algebraic", "2R, closed-form"]
    assert {path.name for path in Path().glob("*.png")} == {
        "PRBDM2R-impact-map.png", "PRBDM2R-energies-2R-algebraic.png"
    }  # fmt: skip


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ("impact-map PRBDM2R --heights 0 --offsets 0 3 mm", 1),
        ("impact-map PRBDM2R --heights 0 --offsets 0 3 mm --model 1R 2R", 2),
        ("impact-map PRBDM2R --heights 0 --offsets 0", 0),
        ("impact-map PRBDM2R --heights 0 --offsets 3mm --model 2R --axial", 0),
        ("impact-map PRBDM2R --heights 0 --offsets 3mm --way closed-form", 0),
        ("simulate PRBDM --stop-time 1ms --set stop.offset=3mm --set force.x=1", 1),
        ("simulate PRBDM --stop-time 1ms", 0),
    ],
)
def test_what_flexures_hide_of_an_impact_off_the_centre_is_told(line, told, capsys):
    assert run(line) == cli.OK
    assert capsys.readouterr().out.count("hits 3 mm off the centre of mass of shuttle") == told


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
def test_gravity_is_told_of_where_there_is_any(line, with_weight, without, capsys):
    assert run(line) == cli.OK
    assert with_weight in capsys.readouterr().out
    assert run(f"{line} {WEIGHTLESS}") == cli.OK
    told = capsys.readouterr().out
    assert without in told
    assert "under gravity" not in told


def test_what_cannot_be_reached_without_gravity_is_not_its_fault(capsys):
    for more, blamed in (("", True), (WEIGHTLESS, False)):
        assert run(f"modes PRBDM --held 79mm {more}") == cli.FAILED
        told = capsys.readouterr().err
        assert "cannot be reached" in told
        assert ("gravity" in told) is blamed


def test_what_rounding_leaves_of_a_place_of_rest_is_zero():
    assert systems.tiny(6.9e-15, 80.0) == systems.tiny(-6.9e-15, 80.0, ".5g") == "0"
    assert systems.tiny(-1.2345678, 80.0, ".5g") == "-1.2346"


def test_a_mechanism_of_ones_own_is_named_by_its_file(capsys):
    Path("mine.toml").write_bytes(shipped()["Bistable"].read_bytes())
    assert run("equilibrium mine.toml") == run("equilibrium Bistable") == cli.OK
    first, second = capsys.readouterr().out.split("Bistable: ")[1:]
    assert first == second
    assert run("animate mine.toml out.gif --stop-time 5ms --fps 5 --slow 100") == cli.OK
    assert Path("out.gif").exists()


# --- mistakes -----------------------------------------------------------------------------------


MISTAKES = [
    ("modes Bistabel", "unknown mechanism 'Bistabel' (mechanism files end in .toml); did you"),
    ("modes none.toml", "none.toml: cannot be read"),
    ("modes PRBDM --held 10kg", "--held 10kg: the unit 'kg' has another dimension; write a qu"),
    ("modes PRBDM --held much", "--held much: write a number in m, or a number and a unit"),
    ("modes PRBDM --held nan", "--held nan: write a finite number in m"),
    ("modes PRBDM --count 0", "--count 0: ask for one mode or more"),
    ("modes PRBDM --set shuttle.mas=1", "did you mean shuttle.mass"),
    ("modes PRBDM --set shuttle.mass", "--set shuttle.mass: write NAME=VALUE"),
    ("modes PRBDM --set shuttle.mass=1m", "the unit 'm' has another dimension; write a quant"),
    ("modes PRBDM --set shuttle.mass=-1kg", "shuttle.mass = -1 kg"),
    ("modes PRBDM --set force.x=1", "force.x: it is an input"),
    ("modes PRBDM --out taken", "taken is a file; choose a folder with --out"),
    ("modes PRBDM --sat shuttle.mass=1", "unrecognized arguments: --sat"),
    ("modes", "the following arguments are required: MECHANISM; see prbm modes --help"),
    ("mods PRBDM", "invalid choice: 'mods'"),
    ("equilibrium PRBDM --from 1mm", "--from and --to go together"),
    ("equilibrium PRBDM --from 1mm --to 0", "--from 0.001 m is not below --to 0 m"),
    ("equilibrium PRBDM --from 0 --to 1mm --held 0", "take one of them"),
    ("equilibrium PRBDM --from 0 --to 1mm --points 2", "choose a number from 3 to"),
    ("equilibrium PRBDM --held -10mm 5", "5 has no unit and others have one"),
    ("equilibrium PRBDM --held -10 5", "--held -10 m is more than the whole mechanism, 0.08 m"),
    ("equilibrium PRBDM --from -10 --to 5", "check the unit, as in --from -10mm"),
    ("modes PRBDM --held 10", "check the unit, as in --held 10mm"),
    ("impact-map PRBDM --heights -10 5", "check the unit, as in --heights -10mm"),
    ("impact-map PRBDM --offsets 4", "check the unit, as in --offsets 4mm"),
    ("simulate PRBDM --stop-time 0", "stop_time = 0 s must be positive"),
    ("simulate PRBDM --stop-time 1m", "--stop-time 1m: the unit 'm' has another dimension"),
    ("simulate PRBDM --step 1ns", "choose a larger one"),
    ("simulate PRBDM --tolerance 2", "choose a number between 0 and 1"),
    ("simulate PRBDM --stop-time 10ms --spectrum", "there is no impact in 0.01 s"),
    ("fit PRBDM --free flexure.K_theta", "there is nothing to fit to"),
    ("fit PRBDM --frequency '5 +- 1'", "required: --free"),
    ("fit PRBDM --free K_theta --frequency '5 +- 1'", "did you mean flexure.K_theta"),
    ("fit PRBDM --free flexure.K_theta=1 --frequency '5 +- 1'", "flexure.K_theta=LOW:HIGH"),
    ("fit PRBDM --free flexure.K_theta=2:1 --frequency '5 +- 1'", "lower bound is not below"),
    ("fit PRBDM --free flexure.K_theta --frequency 5Hz", "give its standard uncertainty"),
    ("fit PRBDM --free flexure.K_theta --frequency '5 Hz +- 1 mm'", "has another dimension"),
    ("fit PRBDM --free flexure.K_theta --frequency '5 +- -1'", "must not be negative"),
    ("fit PRBDM --free flexure.K_theta --frequency '5 +- 1 mode 3'", "PRBDM has 1 modes"),
    ("impact-map PRBDM --stop bumper", "no stop bumper; it has stop"),
    ("impact-map ImpactOscillator", "position of impact is an expression"),
    ("impact-map PRBDM --heights 1 1 mm", "a place stands there twice"),
    ("impact-map PRBDM --set release.displacement=0", "no default heights: give --heights"),
    ("impact-map Cantilever --heights 3mm --way closed-form", "choose another method"),
    ("impact-map PRBDM --way magic", "invalid choice: 'magic'"),
    ("impact-map PRBDM --axial", "--axial goes with --model"),
    ("impact-map PRBDM --model nR --links 0", "a chain has one link or more"),
    ("picture PRBDM --modes 13", "13 modes: choose a number from 0 to 12"),
    ("picture PRBDM --out taken/a.png", "cannot write to taken: taken is a file; choose another"),
    ("animate PRBDM taken/a.gif", "cannot write to taken: taken is a file; choose another folder"),
    ("animate PRBDM new/a.gif --slow -1", "slow = -1 must be positive"),
    ("animate out.gif", "name the source of the film"),
    ("animate PRBDM out.txt", "end the name in .gif or .mp4"),
    ("measure", "required: QUANTITY"),
    ("validate --measured f=1", "--measured goes with a mechanism"),
    ("validate --only steps --elements 4", "--elements goes with a mechanism"),
    ("validate --only steps --elements 0", "--elements goes with a mechanism"),
    ("validate PRBDM --only table", "leave MECHANISM out"),
    ("validate PRBDM --measured frequency", "write NAME=VALUE+-U"),
]  # fmt: skip


@pytest.mark.parametrize(("line", "sentence"), MISTAKES)
def test_mistakes_get_a_sentence_and_nothing_is_written(line, sentence, capsys):
    Path("taken").write_text("")
    assert run(line) == cli.MISTAKE
    told = capsys.readouterr().err
    assert sentence in told
    *progress, last = told.splitlines()
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
def test_a_folder_that_is_not_there_is_made(line, capsys):
    assert run(line) == cli.OK
    (made,) = Path("new/deep").iterdir()
    assert capsys.readouterr().out == f"{made}\n"


def test_a_film_that_cannot_be_written_is_not_simulated_first(monkeypatch):
    Path("taken").write_text("")
    monkeypatch.setattr("prbm.commands.pictures.simulate", pytest.fail)
    assert run("animate PRBDM taken/a.gif") == cli.MISTAKE


def test_a_computation_that_fails_has_another_status(capsys):
    assert run("equilibrium PRBDM --held 50mm") == cli.FAILED
    assert "release.displacement = 0.05 m cannot be reached" in capsys.readouterr().err


CROSS = """\
name = "CrossPivot"
title = "A wheel on two leaves that cross at its centre of mass"
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


def test_a_wheel_on_its_pivot_rests_where_it_is_drawn(capsys):
    """No force on its centre of mass moves it: there is a place of rest and no stiffness."""
    Path("cross.toml").write_text(CROSS)
    assert run("equilibrium cross.toml --out .") == cli.OK
    printed = capsys.readouterr().out
    assert "rests at 0 mm: stable" in printed
    assert "no stiffness: the centre of mass of the body wheel stays where it is" in printed
    assert table("CrossPivot-equilibrium.csv")["stiffness [N/m]"] == ["nan"]
    assert run("equilibrium cross.toml --held 1mm") == cli.FAILED
    told = capsys.readouterr()
    assert "= 0.001 m: the centre of mass of the body wheel stays where it is" in told.err
    assert told.out == "", "no head of a table that does not come"
    assert run("simulate cross.toml --set release.velocity=0.1") == cli.MISTAKE
    assert "put the centre of mass off it, or release another body" in capsys.readouterr().err


def test_a_mechanism_without_a_stop_is_told_to_have_one(capsys):
    Path("cross.toml").write_text(CROSS)
    Path("data.csv").write_text(text(*GOOD))
    restitution = "measure restitution data.csv --mechanism cross.toml"
    for line in (
        "impact-map cross.toml --heights 0 1 mm",
        restitution,
        f"{restitution} --stop wall",
    ):
        assert run(line) == cli.MISTAKE
        said = "has no stop wall" if "wall" in line else "has no stop to hit"
        assert f"CrossPivot {said}: describe one, [[stops]]" in capsys.readouterr().err


def test_no_command_gets_the_help(capsys):
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
        "x, y can all be the signal: say which, --column NAME",
    ),
    "no time": (text("a [m],b [N]", TIME, SWING), f"{FREQUENCY} --column a", "--unit \"a=s\""),
    "a gap": (text(*GOOD, change=without(50, 80)), FREQUENCY, "line 51: a gap of 0.155 s follows"),
    "not a number": (text(*GOOD, change=replaced(9, "0.04,nan")), FREQUENCY, "line 10, column 'x'"),
    "an empty cell": (text(*GOOD, change=replaced(9, "0.04,")), FREQUENCY, "line 10: 1 values for"),
    "a word": (text(*GOOD, change=replaced(9, "0.04,late")), FREQUENCY, "'late' is not a number"),
    "a unit in a cell": (
        text(*GOOD, change=replaced(9, "0.04,1.2 mm")), FREQUENCY, "has a unit: write"
    ),
    "time that stands still": (
        text(*GOOD, change=replaced(9, "0.035,0.1")), FREQUENCY, "equals that of the row above"
    ),
    "time that goes back": (
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
        text("t [s],x [N]", TIME, SWING), RESTITUTION, "no column in m or a multiple of it can be"
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
        "it needs one column in A, as the signal is, and one length beside it; columns are pos",
    ),
    "no impact": (text(*GOOD), RESTITUTION, "no impact in the record"),
    "no head": (
        text(*GOOD, change=without(0, 1)), FREQUENCY, 'for instance --columns "t [s]" "x [mm]"'
    ),
    "too many names": (text(*GOOD), f"{FREQUENCY} --columns 't [s]'", "1 names for 2"),
    "no force": (text("d [mm],x [mm]", TIME, SWING), MODULUS, "can all be the deflection"),
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
    "a curve without forces": (text("d [mm],t [s]", TIME, TIME), CURVE, "can be the force"),
    "an uncertainty of nothing": (
        text("d [mm],F [mN]", TIME, TIME), f"{CURVE} --force-uncertainty 0", "it must be positive"
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", MALFORMED)
def test_malformed_data_get_a_sentence(case, capsys):
    content, line, sentence = MALFORMED[case]
    if content is not None:
        Path("data.csv").write_bytes(content.encode("latin-1"))
    write(Path("stage.csv"), "position [mm],laser [V]", TIME, 2 * TIME)
    assert run(f"{line} --out results") == cli.MISTAKE
    told = capsys.readouterr()
    assert sentence in told.err
    assert told.err.count("\n") == 1
    assert told.out == ""
    assert not Path("results").exists()


# --- files, signals, pipes ----------------------------------------------------------------------


@pytest.mark.parametrize("failing", [0, 1])
def test_files_are_written_all_or_none(failing, monkeypatch):
    """Whatever fails while contents are written leaves what was there."""
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


def test_a_folder_in_the_way_of_a_file_is_named(capsys):
    Path("PRBDM-modes.csv").mkdir()
    assert run("modes PRBDM --out .") == cli.MISTAKE
    assert "PRBDM-modes.csv: it is a folder" in capsys.readouterr().err
    assert [path.name for path in Path().iterdir()] == ["PRBDM-modes.csv"]


def environment() -> dict[str, str]:
    paths = [str(ROOT / "fmu_src"), *os.environ.get("PYTHONPATH", "").split(os.pathsep)]
    return os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, paths))}


@pytest.mark.skipif(os.name == "nt", reason="Ctrl-C is another thing on Windows")
def test_ctrl_c_ends_a_simulation_without_a_traceback():
    """Once it has told its progress, so that it is under way."""
    words = [sys.executable, "-m", "prbm", "simulate", "PRBDM2R", "--stop-time", "1000"]
    with subprocess.Popen(
        [*words, "--out", "."], stderr=subprocess.PIPE, stdout=subprocess.PIPE, env=environment()
    ) as process:
        assert process.stderr is not None
        assert b"% done" in process.stderr.readline()
        process.send_signal(signal.SIGINT)
        _, told = process.communicate(timeout=60)
    assert process.returncode == cli.INTERRUPTED
    assert b"Traceback" not in told
    assert told.decode().splitlines()[-1] == "prbm simulate: interrupted"
    assert [*Path().iterdir()] == []


@pytest.mark.parametrize(
    ("raised", "sentence", "status"),
    [
        (KeyboardInterrupt(), "prbm: interrupted", cli.INTERRUPTED),
        (ModuleNotFoundError("no", name="scipy"), "prbm needs the Python package scipy", 2),
    ],
)
def test_what_happens_before_the_command_runs_has_a_sentence_too(
    raised, sentence, status, monkeypatch, capsys
):
    def ends() -> int:
        raise raised

    monkeypatch.setattr(cli, "main", ends)
    assert started() == status
    assert sentence in capsys.readouterr().err


def test_ctrl_c_names_the_command_that_it_ended(monkeypatch, capsys):
    def ends(_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(cli, "_function", lambda _: ends)
    assert run("simulate PRBDM") == cli.INTERRUPTED
    assert capsys.readouterr().err == "prbm simulate: interrupted\n"


@pytest.mark.parametrize(("command", "status"), [("--help", cli.OK), ("list", cli.FAILED)])
def test_a_reader_that_has_seen_enough_is_no_failure_to_talk_about(command, status):
    words = [sys.executable, "-m", "prbm", command]
    with subprocess.Popen(
        words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=environment()
    ) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdout.close()
        told = process.stderr.read()
    assert told == b""
    assert process.returncode == status


def test_the_page_is_named_where_users_look():
    assert "docs/command-line.md" in (ROOT / "README.md").read_text(encoding="utf-8")
    for command in COMMANDS:
        assert f"prbm {command}" in PAGE


def test_the_help_of_validate_measures_what_is_compared(capsys):
    """The rows of a comparison are named in full, "frequency 1 at rest"."""
    assert run("validate --help") == cli.OK
    assert '--measured "frequency 1 at rest=4.82 Hz +- 0.06"' in capsys.readouterr().out
