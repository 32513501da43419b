"""The command that builds FMUs: selection, identical bytes, complete files, error messages."""

import importlib
import io
import itertools
import os
import re
import shutil
import signal
import subprocess
import sys
import time
import zipfile
from importlib import metadata
from pathlib import Path, PurePosixPath

import matplotlib
import pytest
from fmpy import read_model_description
from fmpy.validation import validate_fmu

from fmu_host import simulate_fmu
from prbm import __main__ as entry
from prbm.base import atomic
from prbm.base.errors import MechanismError
from prbm.commands import building as cli
from prbm.commands import fmu_report as report
from prbm.commands import program
from prbm.commands.command_line import main, parser
from prbm.commands.program import FAILED, INTERRUPTED, MISTAKE, OK
from prbm.drawing.icon import icon
from prbm.files.mechanism_file import read_mechanism, shipped
from prbm.files.settings import UserMistake
from prbm.fmu import python_fmu
from prbm.fmu.description import Heading, model_description
from prbm.fmu.start import interface, start
from prbm.kernel import compiler
from prbm.kernel.sources import kernel
from signals import interruptible
from support import ROOT, possible

BUILD = ROOT / "build_fmu.py"
GUIDES = ("--model", "PRBDM", "--model", "PRBDM2R")

pytestmark = pytest.mark.fmu


def build(folder: Path, *options: str, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, str(BUILD), *options], cwd=folder, capture_output=True, text=True,
        check=False, env=os.environ | environment,
    )  # fmt: skip


def run(*words: str) -> int:
    """Run the command in this process; return its status."""
    return main(["build", *words])


@pytest.mark.native
@pytest.mark.slow
def test_fmus_are_built_simulated_and_plotted_in_an_empty_folder(tmp_path):
    """Rest positions are 10.42 and 10.78 mm, fundamental frequencies 4.957 and 4.889 Hz."""
    done = build(tmp_path, *GUIDES, "--simulate")
    assert done.returncode == 0, done.stderr
    frequencies = {"PRBDM": ("10.42", "4.957"), "PRBDM2R": ("10.78", "4.889")}
    for folder, model in itertools.product(("python", "fmi2", "fmi3"), frequencies):
        rest, frequency = frequencies[model]
        fmu = tmp_path / "dist" / folder / f"{model}.fmu"
        assert validate_fmu(str(fmu)) == []
        assert fmu.with_suffix(".png").read_bytes().startswith(b"\x89PNG")
        printed = done.stdout.partition(f"{folder}/{model}: simulating")[2]
        summary = printed.partition("figure ")[0]
        assert re.search(rf"free rest position +shuttle {rest} mm from straight", summary)
        assert re.search(rf"fundamental +{frequency} Hz", summary)
        assert re.search(r"impacts at stop +14, the first at t = 0\.04", summary)
        assert re.search(r"came to rest +at t = 0\.24", summary)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["dist"]
    assert {p.name for p in (tmp_path / "dist").iterdir()} == {"python", "fmi2", "fmi3"}


@pytest.mark.native
@pytest.mark.slow
def test_the_same_input_gives_the_same_bytes_in_every_process(tmp_path):
    for seed in ("1", "2"):
        done = build(tmp_path, "--model", "PRBDM2R", "--out", seed, PYTHONHASHSEED=seed)
        assert done.returncode == 0, done.stderr
    for folder in ("python", "fmi2", "fmi3"):
        first, second = (tmp_path / seed / folder / "PRBDM2R.fmu" for seed in ("1", "2"))
        assert first.read_bytes() == second.read_bytes()


SELECTED = {
    "--flavour native": {"fmi2", "fmi3"},
    "--flavour native --fmi 2": {"fmi2"},
    "--fmi 3": {"fmi3"},
    "--fmi 2": {"python", "fmi2"},
    "--flavour python": {"python"},
    "--clock": {"fmi3-clock"},
    "--flavour native --fmi 3 --clock": {"fmi3-clock"},
    "--platform host": {"python", "fmi2", "fmi3"},
}


@pytest.mark.slow
@pytest.mark.native
@pytest.mark.parametrize("options", SELECTED)
def test_options_select_the_kinds_of_fmus(options, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert run(*options.split(), "--model", "PRBDM") == OK
    assert {p.name for p in (tmp_path / "dist").iterdir()} == SELECTED[options]


@pytest.mark.slow
@pytest.mark.native
def test_the_variant_with_a_clock_is_simulated_in_event_mode(tmp_path):
    done = build(tmp_path, "--model", "PRBDM", "--clock", "--simulate")
    assert done.returncode == 0, done.stderr
    assert re.search(r"impacts at stop +14, the first at t = 0\.04107 s", done.stdout)
    assert re.search(r"came to rest +at t = 0\.243", done.stdout)


@pytest.fixture
def _no_compiler(monkeypatch) -> None:
    """Hide all compilers."""
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setenv("PATH", "")
    monkeypatch.setattr(compiler.importlib.util, "find_spec", lambda name: None)


@pytest.mark.usefixtures("_no_compiler")
def test_without_a_compiler_only_the_python_fmus_are_built(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert run("--model", "PRBDM") == FAILED
    printed = capsys.readouterr()
    assert [p.name for p in (tmp_path / "dist").rglob("*.fmu")] == ["PRBDM.fmu"]
    assert printed.err.startswith("prbm build: only the Python FMUs were built: the kernel needs")
    assert "pip install ziglang" in printed.err
    assert printed.err.count("\n") == 1


@pytest.mark.slow
@pytest.mark.native
def test_the_reason_for_a_page_without_simulation_is_a_sentence(tmp_path, monkeypatch, capsys):
    found = compiler.importlib.util.find_spec
    monkeypatch.setattr(
        compiler.importlib.util,
        "find_spec",
        lambda name: None if name == "ziglang" else found(name),
    )
    monkeypatch.setattr(compiler, "prebuilt", lambda *arguments: None)
    assert run("--model", "PRBDM", "--fmi", "3", "--out", str(tmp_path)) == OK
    *stages, written = capsys.readouterr().out.splitlines()
    (reason,) = [line for line in stages if not line.endswith(" ...")]
    assert reason.startswith("fmi3/PRBDM: the documentation has no simulation: a page that")
    assert reason.endswith(": install it with 'python -m pip install ziglang'.")
    assert written.endswith(" kB)")


@pytest.mark.usefixtures("_no_compiler")
@pytest.mark.parametrize("options", ["--flavour native", "--fmi 2", "--clock", "--platform host"])
def test_selecting_native_fmus_without_a_compiler_fails(options, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert run(*options.split(), "--model", "PRBDM") == MISTAKE
    assert "pip install ziglang" in capsys.readouterr().err
    assert [*tmp_path.iterdir()] == []


def test_fmus_for_another_platform_cannot_be_simulated(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    here = compiler.this_platform().name
    other = next(name for name in compiler.PLATFORMS if name != here)
    assert run("--platform", other, "--simulate") == MISTAKE
    assert f"FMUs for {other} do not run on this machine" in capsys.readouterr().err
    assert [*tmp_path.iterdir()] == []


@pytest.mark.slow
@pytest.mark.native
def test_an_installed_wheel_has_the_kernel(tmp_path):
    """FMUs are built in an isolated process, which imports installed packages only."""
    try:
        installed = metadata.distribution("prbm-impact").files or []
    except metadata.PackageNotFoundError:
        installed = []
    folder = PurePosixPath("prbm/kernel")
    packed = {
        f.relative_to(folder).as_posix(): f.locate()
        for f in installed
        if folder in f.parents and f.suffix in (".c", ".h")
    }
    if not packed:
        pytest.skip("no wheel of this package is installed")
    if {name: Path(path).read_bytes() for name, path in packed.items()} != kernel():
        pytest.skip("another version is installed")
    command = [
        sys.executable,
        "-I",
        "-m",
        "prbm",
        "build",
        "--flavour",
        "native",
        "--model",
        "PRBDM",
    ]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    for folder in ("fmi2", "fmi3"):
        assert validate_fmu(str(tmp_path / "dist" / folder / "PRBDM.fmu")) == []


def test_platforms_have_the_names_of_fmi_2_and_3():
    def named(*texts: str) -> tuple[str, ...]:
        arguments = [part for text in texts for part in ("--platform", text)]
        return cli.selected_platforms(parser().parse_args(["build", *arguments]))

    assert named() == ("host",)
    assert named("win64,x86_64-windows", "aarch64-darwin", "darwin64") == (
        "x86_64-windows", "aarch64-darwin", "x86_64-darwin"
    )  # fmt: skip


def test_guid_and_module_names_depend_on_the_content(mechanisms, tmp_path):
    names = []
    for changes in ({}, {"stop.restitution": 0.5}):
        path = tmp_path / "fmu"
        atomic.write(path, python_fmu.build(mechanisms["PRBDM"], changes))
        with zipfile.ZipFile(path) as fmu:
            xml = fmu.read("modelDescription.xml").decode()
            guid = re.search(r'guid="([^"]+)"', xml).group(1)
            names.append({guid, fmu.read("resources/slavemodule.txt")})
    assert names[0].isdisjoint(names[1])


def test_archives_have_sorted_names_and_a_fixed_date(fmus):
    with zipfile.ZipFile(fmus["PRBDM"]) as fmu:
        entries = fmu.infolist()
    assert [e.filename for e in entries] == sorted(e.filename for e in entries)
    assert {e.date_time for e in entries} == {(1980, 1, 1, 0, 0, 0)}


@pytest.mark.parametrize("failure", [OSError("disk full"), KeyboardInterrupt()])
def test_files_are_written_completely_or_not_at_all(tmp_path, monkeypatch, failure):
    path = tmp_path / "model.fmu"
    atomic.write(path, b"old")

    def fails(*_: object) -> None:
        raise failure

    monkeypatch.setattr(os, "replace", fails)
    with pytest.raises(type(failure)):
        atomic.write(path, b"new")
    assert path.read_bytes() == b"old"
    assert [*tmp_path.iterdir()] == [path]


@pytest.mark.slow
def test_no_file_is_written_if_one_mechanism_fails(tmp_path, monkeypatch, capfd):
    """The 2R guide, the second mechanism, has no equilibrium under a weight that buckles it."""
    monkeypatch.chdir(tmp_path)
    options = ["--set", "gravity.x=0", "--set", "gravity.y=-100"]
    assert run(*GUIDES, *options) == MISTAKE
    printed = capfd.readouterr()
    assert "python/PRBDM: packing" in printed.out
    (error,) = [line for line in printed.err.splitlines() if line.startswith("prbm build: ")]
    assert "PRBDM2R: release.displacement = -0.018 m cannot be reached" in error
    assert "Traceback" not in printed.err
    assert [*tmp_path.iterdir()] == []


def test_the_copy_of_pythonfmu_in_an_fmu_that_ran_before_is_not_packed(
    fmus, mechanisms, tmp_path, monkeypatch
):
    """Its folder is removed after the run, and it has no libraries."""
    with zipfile.ZipFile(fmus["PRBDM"]) as fmu:
        fmu.extractall(tmp_path)
    for name in [name for name in sys.modules if name.partition(".")[0] == "pythonfmu"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.syspath_prepend(tmp_path / "resources")
    copy = importlib.import_module("pythonfmu")
    assert tmp_path in Path(copy.__file__).parents
    shutil.rmtree(tmp_path / "resources")
    assert python_fmu.build(mechanisms["PRBDM"]) == fmus["PRBDM"].read_bytes()


def test_a_parameter_of_one_mechanism_is_rejected_before_the_build(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert run(*GUIDES, "--set", "flexure.gamma=0.8") == MISTAKE
    printed = capsys.readouterr()
    assert printed.out == ""
    assert (
        "no such parameter or input in PRBDM2R; name only mechanisms that have it: PRBDM\n"
        in printed.err
    )


def test_ctrl_c_during_the_build_leaves_no_file(tmp_path, monkeypatch, capsys):
    def interrupted(*_: object) -> bytes:
        raise KeyboardInterrupt

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(python_fmu, "zipped", interrupted)
    assert run("--model", "PRBDM") == INTERRUPTED
    assert capsys.readouterr().err == "prbm build: interrupted\n"
    assert [*tmp_path.iterdir()] == []


MISTAKES = {
    "--model PRBDM --set stop.restitutoin=0.5": "did you mean stop.restitution",
    "--model PRBDM --set stop.restitution=nan": "a finite number",
    "--model PRBDM --set stop.restitution=high": "write a number",
    "--model PRBDM --set stop.restitution": "write NAME=VALUE",
    "--model PRBDM --set stop.restitution=1.5": "stop.restitution = 1.5 must be at most 1",
    "--model PRBDM --set shuttle.x=0.1": "unknown variable 'shuttle.x'",
    "--model PRBDM --set stop.position=1kg": "the unit 'kg' has another dimension",
    "--model PRBDM --set release.displacement=0.02": "penetrated",
    "--model PRBDM --set release.displacement=-0.2": "cannot be reached",
    "--model PRBDM3": "the shipped ones are Bistable, Cantilever",
    "--mechanism nowhere.toml": "nowhere.toml: cannot be read",
    "--model PRBDM --mechanism x.toml": "not allowed with",
    "--out file/deeper": "file is a file",
    "--flavour python --fmi 3": "Python FMUs are FMI 2.0",
    "--flavour python --clock": "only native FMUs of FMI 3.0 have clocks",
    "--fmi 2 --clock": "only native FMUs of FMI 3.0 have clocks",
    "--flavour python --platform all": "Python FMUs run on Linux and Windows",
    "--platform amiga": "unknown platform; choose host, all or some of x86_64-linux",
    "--platform x86_64-linux,": "unknown platform",
    "--fmi 1": "invalid choice",
    "--flavour wood": "invalid choice",
    "--nonsense": "unrecognized arguments: --nonsense",
    "--flavor python": "did you mean --flavour?",
    "--flavour pyton": "did you mean python?",
}
EPOCHS = {"999999999999999999": None, "soon": None, "86400": "1970-01-02T00:00:00Z"}


@pytest.mark.parametrize("command", MISTAKES)
def test_mistakes_are_one_sentence_and_status_2(command, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").write_text("a file where a folder is needed", encoding="utf-8")
    assert run(*command.split()) == MISTAKE
    error = capsys.readouterr().err
    assert MISTAKES[command] in error
    assert error.startswith("prbm build: ")
    assert error.count("\n") == 1
    assert [*tmp_path.iterdir()] == [tmp_path / "file"]


def test_start_values_may_have_units():
    options = parser().parse_args(["build", "--model", "PRBDM", "--set", "stop.position=-2 mm"])
    assert cli.start_values([*cli.mechanisms(options).values()], options.changes) == {
        "stop.position": -0.002
    }


def test_list_prints_the_shipped_mechanisms(capsys):
    assert run("--list") == OK
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == [*shipped()]
    assert all(len(line) < 120 for line in lines)


@pytest.mark.slow
def test_fmus_of_a_mechanism_file_have_the_name_of_the_mechanism(tmp_path):
    text = (ROOT / "fmu_src" / "prbm" / "shipped" / "PRBDM.toml").read_text(encoding="utf-8")
    (tmp_path / "mine.toml").write_text(
        text.replace('name = "PRBDM"', 'name = "Mine"'), encoding="utf-8"
    )
    done = build(tmp_path, "--mechanism", "mine.toml", "--set", "stop.position=1e-3")
    assert done.returncode == 0, done.stderr
    for folder in ("python", "fmi2", "fmi3"):
        fmu = tmp_path / "dist" / folder / "Mine.fmu"
        assert validate_fmu(str(fmu)) == []


@pytest.mark.slow
def test_simulation_works_in_folders_that_pythonfmu_cannot_read(tmp_path):
    """The FMU is unpacked elsewhere: pythonfmu crashes on percent-encoded paths."""
    awkward = possible(tmp_path / "modèle 100%")
    awkward.mkdir()
    done = build(awkward, "--model", "PRBDM", "--simulate", TMPDIR=str(awkward))
    assert done.returncode == 0, done.stderr
    assert (awkward / "dist" / "python" / "PRBDM.png").exists()
    assert (awkward / "dist" / "fmi3" / "PRBDM.png").exists()


@pytest.mark.parametrize("epoch", EPOCHS)
def test_source_date_epoch_sets_the_date(epoch, mechanisms, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("SOURCE_DATE_EPOCH", epoch)
    if EPOCHS[epoch] is None:
        assert run() == MISTAKE
        assert f"SOURCE_DATE_EPOCH = {epoch!r} must be a number" in capsys.readouterr().err
        assert [*tmp_path.iterdir()] == []
    else:
        listed = interface(mechanisms["PRBDM"], {})
        xml = model_description(Heading("X", "", "", {}), listed).decode()
        assert f'generationDateAndTime="{EPOCHS[epoch]}"' in xml


def test_the_icon_does_not_depend_on_matplotlibrc(mechanisms):
    mechanism = mechanisms["PRBDM"]
    sample = start(mechanism, {}).sample
    plain = icon(mechanism, sample)
    settings = {"lines.linewidth": 5.0, "savefig.transparent": True, "lines.markersize": 20.0}
    with matplotlib.rc_context(settings):
        assert icon(mechanism, sample) == plain


@pytest.mark.slow
def test_the_module_name_depends_on_the_script(mechanisms, monkeypatch):
    """FMUs in one process share all modules, and pythonfmu loads the script by its name."""

    def name() -> bytes:
        with zipfile.ZipFile(io.BytesIO(python_fmu.build(mechanisms["PRBDM"]))) as fmu:
            return fmu.read("resources/slavemodule.txt")

    before = name()
    monkeypatch.setattr(python_fmu, "SCRIPT", python_fmu.SCRIPT + "# changed\n")
    assert name() != before


@pytest.mark.parametrize("name", ["PRBDM.fmu", "PRBDM.png"])
def test_a_folder_with_the_name_of_an_output_file_is_reported(name, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "dist" / "python" / name).mkdir(parents=True)
    assert run("--model", "PRBDM", "--simulate") == MISTAKE
    printed = capsys.readouterr()
    assert printed.out == ""
    assert f"{name}: it is a folder" in printed.err


@pytest.mark.slow
def test_an_unwritable_figure_is_reported_after_the_summary(fmus, tmp_path, capsys):
    assert report.main([str(fmus["PRBDM"]), str(tmp_path)]) == MISTAKE
    printed = capsys.readouterr()
    assert "impacts at stop" in printed.out
    assert f"cannot write the figure {tmp_path}: " in printed.err


@pytest.mark.parametrize("option", ["--list", "--schema", "--version"])
def test_the_former_name_is_the_same_command(option, monkeypatch, capsys):
    printed = []
    for entry_point, words in ((entry.main, ["prbm", "build"]), (entry.build, ["prbm-build-fmu"])):
        monkeypatch.setattr(sys, "argv", [*words, option])
        assert entry_point() == OK
        printed.append(capsys.readouterr().out)
    assert printed[0] == printed[1] != ""


def test_names_files_and_options_select_mechanisms_once(tmp_path):
    path = tmp_path / "mine.toml"
    text = shipped()["PRBDM"].read_text(encoding="utf-8")
    path.write_text(text.replace('name = "PRBDM"', 'name = "Mine"'), encoding="utf-8")

    def names(*words: str) -> list[str]:
        return [m.name for m in cli.mechanisms(parser().parse_args(["build", *words])).values()]

    assert names("PRBDM2R", str(path), "PRBDM2R", "--model", "PRBDM") == [
        "PRBDM2R",
        "Mine",
        "PRBDM",
    ]
    assert names("--mechanism", str(path)) == ["Mine"]
    assert names() == [*shipped()]
    path.write_text(text, encoding="utf-8")
    with pytest.raises(UserMistake, match="two mechanisms have the name PRBDM"):
        names("PRBDM", str(path))


def summary_of(mechanisms, tmp_path, **changes: float) -> str:
    """Return the printed summary for other start values, ``stop__position=...``."""
    fmu = tmp_path / "PRBDM.fmu"
    values = {name.replace("__", "."): value for name, value in changes.items()}
    atomic.write(fmu, python_fmu.build(mechanisms["PRBDM"], values))
    return "\n".join(report.summary(report.simulate(fmu, lambda fraction: None)))


@pytest.mark.slow
def test_an_impact_at_the_start_is_counted(mechanisms, tmp_path):
    summary = summary_of(
        mechanisms, tmp_path,
        release__displacement=0.0, release__velocity=0.5, stop__restitution=0.0,
    )  # fmt: skip
    assert re.search(r"impacts at stop +1, the first at t = 0 s with 0\.5 m/s", summary)
    assert "came to rest         at t = 0 s on stop" in summary


@pytest.mark.slow
def test_an_unstable_equilibrium_is_reported_without_a_rest_position(mechanisms, tmp_path):
    """The flexures buckle under the weight of the shuttle."""
    summary = summary_of(
        mechanisms, tmp_path, gravity__x=0.0, gravity__y=-200.0, release__displacement=-1e-3
    )
    assert "the equilibrium under gravity is unstable" in summary
    assert "rest position" not in summary
    assert "Hz" not in summary


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="sends a signal to a group of processes")
@pytest.mark.parametrize("moment", [0.3, 1.3], ids=["importing", "simulating"])
def test_ctrl_c_ends_a_simulation_without_a_summary(fmus, tmp_path, moment):
    """The summary of an interrupted simulation would be wrong."""
    fmu = tmp_path / "PRBDM2R.fmu"
    fmu.write_bytes(fmus["PRBDM2R"].read_bytes())
    code = (
        "import sys; from pathlib import Path; from prbm.commands import building as cli\n"
        "try: cli._simulate([Path(sys.stdin.read())], 'prbm build')\n"
        "except KeyboardInterrupt: print('interrupted')"
    )
    with subprocess.Popen(
        [sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
        stderr=subprocess.PIPE, text=True, process_group=0, preexec_fn=interruptible,
        env=os.environ | {"PYTHONPATH": str(ROOT / "fmu_src")},
    ) as process:  # fmt: skip
        process.stdin.write(str(fmu))
        process.stdin.close()
        assert "simulating" in process.stdout.readline()
        time.sleep(moment)
        os.killpg(process.pid, signal.SIGINT)
        printed, errors = process.stdout.read(), process.stderr.read()
    assert printed == "interrupted\n"
    assert "Traceback" not in errors


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="sends a signal to a group of processes")
@pytest.mark.parametrize("moment", [0.0, 0.2, 1.0])
def test_ctrl_c_ends_the_processes_of_a_build(tmp_path, moment):
    """The processes start together with the first of them, whose line is read."""
    with subprocess.Popen(
        [sys.executable, str(BUILD), "--flavour", "python"], cwd=tmp_path, stdout=subprocess.PIPE,
        stderr=subprocess.PIPE, text=True, process_group=0, preexec_fn=interruptible,
    ) as process:  # fmt: skip
        assert "checking the start" in process.stdout.readline()
        time.sleep(moment)
        os.killpg(process.pid, signal.SIGINT)
        errors = process.stderr.read()
    assert process.returncode == INTERRUPTED
    assert errors == "prbm build: interrupted\n"
    assert list(tmp_path.rglob("*.fmu")) == []


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ('unit = "m"', 'unit = "furlong"', r"flexure\.length has the unit 'furlong'"),
        ("nominal = 1e-2", "nominal = inf", r"flexure\.length: nominal = inf must be positive"),
        (
            'name = "stop"',
            'name = "wänd"',
            r"wänd\.position: variable names of FMI .* rename the part",
        ),
        ('name = "PRBDM"', 'name = "__debug__"', "'__debug__': not a valid name of a Python class"),
    ],
)
def test_names_and_values_that_fmi_forbids_are_reported(tmp_path, old, new, sentence):
    text = (ROOT / "fmu_src" / "prbm" / "shipped" / "PRBDM.toml").read_text(encoding="utf-8")
    path = tmp_path / "mine.toml"
    path.write_text(text.replace(old, new, 1), "utf-8")
    with pytest.raises(MechanismError, match=sentence):
        python_fmu.build(read_mechanism(path))


@pytest.mark.slow
def test_a_mechanism_may_have_the_name_of_a_python_function(tmp_path):
    """The script runs twice, the second time beside a class of that name."""
    text = (ROOT / "fmu_src" / "prbm" / "shipped" / "PRBDM.toml").read_text(encoding="utf-8")
    path = tmp_path / "mine.toml"
    path.write_text(text.replace('name = "PRBDM"', 'name = "globals"'), "utf-8")
    fmu = tmp_path / "globals.fmu"
    atomic.write(fmu, python_fmu.build(read_mechanism(path)))
    assert len(simulate_fmu(str(fmu), stop_time=0.01)) > 1


@pytest.mark.slow
def test_titles_are_escaped_in_script_and_xml(tmp_path):
    """Quotes do not end the docstring of the script; control characters do not break the XML."""
    text = (ROOT / "fmu_src" / "prbm" / "shipped" / "PRBDM.toml").read_text(encoding="utf-8")
    odd = 'title = "{a} \\"\\"\\" \\\\ \\u0007 <b> %s é"'
    path = tmp_path / "mine.toml"
    path.write_text(re.sub(r"^title = .*$", lambda _: odd, text, flags=re.MULTILINE), "utf-8")
    fmu = tmp_path / "PRBDM.fmu"
    atomic.write(fmu, python_fmu.build(read_mechanism(path)))
    assert validate_fmu(str(fmu)) == []
    assert read_model_description(str(fmu)).description == '{a} """ \\   <b> %s é'


@pytest.mark.parametrize("wrong", ["999999999999999999", "soon"])
def test_an_invalid_date_is_reported_before_scipy_is_imported(tmp_path, wrong):
    done = build(tmp_path, "--list", SOURCE_DATE_EPOCH=wrong)
    assert done.returncode == MISTAKE
    assert done.stderr.count("\n") == 1
    assert f"SOURCE_DATE_EPOCH = {wrong!r}" in done.stderr


def test_ctrl_c_during_the_imports_has_no_traceback(monkeypatch, capsys):
    def interrupted() -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(program, "limit_threads", interrupted)
    assert entry.build() == INTERRUPTED
    assert capsys.readouterr().err == "prbm: interrupted\n"


def test_a_missing_package_is_named(monkeypatch, capsys):
    monkeypatch.delitem(sys.modules, "prbm.commands.building")
    monkeypatch.delattr(sys.modules["prbm.commands"], "building")
    monkeypatch.setitem(sys.modules, "prbm.base.atomic", None)
    monkeypatch.setattr(sys, "argv", ["prbm-build-fmu"])
    assert entry.build() == MISTAKE
    assert "the Python package prbm is missing; install it with" in capsys.readouterr().err


FILE_MISTAKES = {
    ("title =", "titel ="): "unknown key titel; did you mean title?",
    ("mass = 0.053187", "mass = [1]"): "bodies.0.mass (of shuttle) = [1]: write a number, or an",
    ("mass = 0.053187", ""): "shuttle.mass is missing: add the key, or outline",
    (
        'point = ["shuttle.width"',
        'bounce = 1\npoint = ["shuttle.width"',
    ): "unknown key stops.0.bounce (of stop)",
    ("gravity = [9.81, 0.0]", "gravity = [9.81]"): "gravity = [9.81]: a number is missing; add it",
    ("centre = [", "centre = [[1], "): "bodies.0.centre",
    ("left = [0.0, 0.0]", "left = [0.0]"): "ground.left = [0.0]: a number is missing; add it",
    ("[[stops]]", "[stops]"): "stops is a table: write [[stops]] for each part",
    ("value = 0.04", "value = -1.0"): "flexure.length = -1 m must be at least",
}


@pytest.mark.parametrize("change", FILE_MISTAKES, ids=lambda change: change[1] or "nothing")
def test_a_mistake_in_a_mechanism_file_names_file_key_and_remedy(tmp_path, change):
    text = (ROOT / "fmu_src" / "prbm" / "shipped" / "PRBDM.toml").read_text(encoding="utf-8")
    assert change[0] in text
    path = tmp_path / "mine.toml"
    path.write_text(text.replace(*change, 1), encoding="utf-8")
    with pytest.raises(MechanismError) as error:
        read_mechanism(path)
    assert FILE_MISTAKES[change] in str(error.value)
    for line in str(error.value).splitlines():
        assert line.startswith(f"{path}: ")
        assert "Value error" not in line
        assert "Input should" not in line


def test_a_byte_order_mark_in_a_mechanism_file_is_ignored(mechanisms, tmp_path):
    """Editors on Windows write byte order marks."""
    text = (ROOT / "fmu_src" / "prbm" / "shipped" / "PRBDM.toml").read_text(encoding="utf-8")
    path = tmp_path / "mine.toml"
    path.write_text(text, encoding="utf-8-sig")
    assert read_mechanism(path) == mechanisms["PRBDM"]
