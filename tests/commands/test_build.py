"""The command that builds FMUs: the same bytes, whole files, one sentence for a mistake."""

import io
import itertools
import os
import re
import signal
import subprocess
import sys
import time
import zipfile
from importlib import metadata
from pathlib import Path, PurePosixPath

import matplotlib
import pytest
from fmpy import read_model_description, simulate_fmu
from fmpy.validation import validate_fmu

from prbm.base import atomic
from prbm.base.errors import MechanismError
from prbm.commands import build_fmu as command
from prbm.commands import building as cli
from prbm.commands import fmu_report as report
from prbm.drawing import icon as picture
from prbm.files.mechanism_file import read_mechanism, shipped
from prbm.fmu import python_fmu
from prbm.fmu.description import Heading, model_description
from prbm.kernel import compiler
from prbm.kernel.sources import kernel
from support import ROOT

BUILD = ROOT / "build_fmu.py"
GUIDES = ("--model", "PRBDM", "--model", "PRBDM2R")

pytestmark = pytest.mark.fmu


def build(folder: Path, *options: str, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, str(BUILD), *options], cwd=folder, capture_output=True, text=True,
        check=False, env=os.environ | environment,
    )  # fmt: skip


@pytest.fixture(autouse=True)
def _typed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "argv", ["build_fmu.py"])


@pytest.mark.native
@pytest.mark.slow
def test_from_an_empty_folder_it_builds_simulates_tells_and_plots(tmp_path):
    """Free rest 10.42 and 10.78 mm, 4.957 and 4.889 Hz: the table of the design document."""
    done = build(tmp_path, *GUIDES, "--simulate")
    assert done.returncode == 0, done.stderr
    frequencies = {"PRBDM": ("10.42", "4.957"), "PRBDM2R": ("10.78", "4.889")}
    for folder, model in itertools.product(("python", "fmi2", "fmi3"), frequencies):
        rest, frequency = frequencies[model]
        fmu = tmp_path / "dist" / folder / f"{model}.fmu"
        assert validate_fmu(str(fmu)) == []
        assert fmu.with_suffix(".png").read_bytes().startswith(b"\x89PNG")
        told = done.stdout.partition(f"{folder}/{model}: simulating")[2].partition("figure ")[0]
        assert re.search(rf"free rest position +shuttle {rest} mm from straight", told)
        assert re.search(rf"fundamental +{frequency} Hz", told)
        assert re.search(r"impacts at stop +14, the first at t = 0\.04", told)
        assert re.search(r"came to rest +at t = 0\.24", told)
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


NATIVE = {
    "--flavour native": {"fmi2", "fmi3"},
    "--flavour native --fmi 2": {"fmi2"},
    "--fmi 3": {"fmi3"},
    "--fmi 2": {"python", "fmi2"},
    "--flavour python": {"python"},
    "--clock": {"fmi3-clock"},
    "--flavour native --fmi 3 --clock": {"fmi3-clock"},
    "--platform host": {"python", "fmi2", "fmi3"},
}


@pytest.mark.native
@pytest.mark.parametrize("options", NATIVE)
def test_what_is_asked_for_is_built_and_nothing_else(options, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert cli.main([*options.split(), "--model", "PRBDM"]) == cli.OK
    assert {p.name for p in (tmp_path / "dist").iterdir()} == NATIVE[options]


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
def test_without_a_compiler_the_python_fmus_are_built_and_the_others_missed(
    tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    assert cli.main(["--model", "PRBDM"]) == cli.FAILED
    told = capsys.readouterr()
    assert [p.name for p in (tmp_path / "dist").rglob("*.fmu")] == ["PRBDM.fmu"]
    assert told.err.startswith("build_fmu.py: only the Python FMUs were built: native FMUs need")
    assert "pip install ziglang" in told.err
    assert told.err.count("\n") == 1


@pytest.mark.usefixtures("_no_compiler")
@pytest.mark.parametrize("asked", ["--flavour native", "--fmi 2", "--clock", "--platform host"])
def test_who_asks_for_native_fmus_gets_them_or_an_error(asked, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert cli.main(asked.split()) == cli.MISTAKE
    assert "pip install ziglang" in capsys.readouterr().err
    assert [*tmp_path.iterdir()] == []


def test_what_does_not_run_here_is_not_simulated_here(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    here = compiler.this_platform().name
    other = next(name for name in compiler.PLATFORMS if name != here)
    assert cli.main(["--platform", other, "--simulate"]) == cli.MISTAKE
    assert f"{other} does not run on this machine" in capsys.readouterr().err
    assert [*tmp_path.iterdir()] == []


@pytest.mark.native
def test_what_is_installed_has_the_kernel_too(tmp_path):
    """From a wheel, without the clone: in a process that sees nothing but what is installed."""
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
        "prbm.commands.build_fmu",
        "--flavour",
        "native",
        "--model",
        "PRBDM",
    ]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    for folder in ("fmi2", "fmi3"):
        assert validate_fmu(str(tmp_path / "dist" / folder / "PRBDM.fmu")) == []


def test_platforms_go_by_the_names_of_both_standards():
    def named(*texts: str) -> tuple[str, ...]:
        arguments = [part for text in texts for part in ("--platform", text)]
        return cli.asked_platforms(cli.parser().parse_args(arguments))

    assert named() == ("host",)
    assert named("win64,x86_64-windows", "aarch64-darwin", "darwin64") == (
        "x86_64-windows", "aarch64-darwin", "x86_64-darwin"
    )  # fmt: skip


def test_another_content_has_another_guid_and_other_module_names(mechanisms, tmp_path):
    names = []
    for changes in ({}, {"stop.restitution": 0.5}):
        path = tmp_path / "fmu"
        atomic.write(path, python_fmu.build(mechanisms["PRBDM"], changes))
        with zipfile.ZipFile(path) as fmu:
            xml = fmu.read("modelDescription.xml").decode()
            guid = re.search(r'guid="([^"]+)"', xml).group(1)
            names.append({guid, fmu.read("resources/slavemodule.txt")})
    assert names[0].isdisjoint(names[1])


def test_an_archive_has_sorted_names_and_the_date_of_no_build(fmus):
    with zipfile.ZipFile(fmus["PRBDM"]) as fmu:
        entries = fmu.infolist()
    assert [e.filename for e in entries] == sorted(e.filename for e in entries)
    assert {e.date_time for e in entries} == {(1980, 1, 1, 0, 0, 0)}


@pytest.mark.parametrize("failure", [OSError("disk full"), KeyboardInterrupt()])
def test_a_file_is_written_whole_or_not_at_all(tmp_path, monkeypatch, failure):
    path = tmp_path / "model.fmu"
    atomic.write(path, b"old")

    def fails(*_: object) -> None:
        raise failure

    monkeypatch.setattr(os, "replace", fails)
    with pytest.raises(type(failure)):
        atomic.write(path, b"new")
    assert path.read_bytes() == b"old"
    assert [*tmp_path.iterdir()] == [path]


def test_nothing_is_written_if_one_of_the_models_fails(tmp_path, monkeypatch, capsys):
    """The 2R guide, which comes second, finds no shape under a weight that buckles it."""
    monkeypatch.chdir(tmp_path)
    options = ["--set", "gravity.x=0", "--set", "gravity.y=-100"]
    assert cli.main([*GUIDES, *options]) == cli.MISTAKE
    told = capsys.readouterr()
    assert "python/PRBDM: packing" in told.out
    assert "PRBDM2R: release.displacement = -0.018 m cannot be reached" in told.err
    assert [*tmp_path.iterdir()] == []


def test_a_parameter_of_one_model_is_refused_before_any_is_built(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert cli.main([*GUIDES, "--set", "flexure.gamma=0.8"]) == cli.MISTAKE
    told = capsys.readouterr()
    assert told.out == ""
    assert "PRBDM2R has no such parameter or input; add --model PRBDM " in told.err


def test_ctrl_c_leaves_nothing_behind(tmp_path, monkeypatch, capsys):
    def interrupted(*_: object) -> bytes:
        raise KeyboardInterrupt

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(python_fmu, "zipped", interrupted)
    assert cli.main([*GUIDES]) == cli.INTERRUPTED
    assert capsys.readouterr().err == "build_fmu.py: interrupted\n"
    assert [*tmp_path.iterdir()] == []


MISTAKES = {
    "--model PRBDM --set stop.restitutoin=0.5": "did you mean stop.restitution",
    "--model PRBDM --set stop.restitution=nan": "a finite number",
    "--model PRBDM --set stop.restitution=high": "a finite number",
    "--model PRBDM --set stop.restitution": "write NAME=VALUE",
    "--model PRBDM --set stop.restitution=1.5": "stop.restitution = 1.5 must be at most 1",
    "--model PRBDM --set shuttle.x=0.1": "shuttle.x is computed by the model",
    "--model PRBDM --set release.displacement=0.02": "penetrated",
    "--model PRBDM --set release.displacement=-0.2": "cannot be reached",
    "--model PRBDM3": "shipped are Bistable, Cantilever",
    "--mechanism nowhere.toml": "nowhere.toml: cannot be read",
    "--model PRBDM --mechanism x.toml": "not allowed with",
    "--out file/deeper": "file is a file",
    "--flavour python --fmi 3": "Python FMUs are FMI 2.0",
    "--flavour python --clock": "only native FMUs of FMI 3.0 have clocks",
    "--fmi 2 --clock": "only native FMUs of FMI 3.0 have clocks",
    "--flavour python --platform all": "Python FMUs run on Linux and Windows",
    "--platform amiga": "there is no such platform; choose host, all or some of x86_64-linux",
    "--platform x86_64-linux,": "there is no such platform",
    "--fmi 1": "invalid choice",
    "--flavour wood": "invalid choice",
    "--nonsense": "unrecognized arguments: --nonsense",
}
FROM_1970 = {"999999999999999999": None, "soon": None, "86400": "1970-01-02T00:00:00Z"}


@pytest.mark.parametrize("command", MISTAKES)
def test_a_mistake_is_answered_with_a_sentence_and_status_2(command, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").write_text("in the way")
    assert cli.main(command.split()) == cli.MISTAKE
    error = capsys.readouterr().err
    assert MISTAKES[command] in error
    assert error.startswith("build_fmu.py: ")
    assert error.count("\n") == 1
    assert [*tmp_path.iterdir()] == [tmp_path / "file"]


def test_the_list_names_what_is_shipped(capsys):
    assert cli.main(["--list"]) == cli.OK
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == [*shipped()]
    assert all(len(line) < 120 for line in lines)  # one each


def test_a_mechanism_of_ones_own_is_built_under_its_own_name(tmp_path):
    text = (ROOT / "fmu_src" / "prbm" / "shipped" / "PRBDM.toml").read_text()
    (tmp_path / "mine.toml").write_text(text.replace('name = "PRBDM"', 'name = "Mine"'))
    done = build(tmp_path, "--mechanism", "mine.toml", "--set", "stop.position=1e-3")
    assert done.returncode == 0, done.stderr
    for folder in ("python", "fmi2", "fmi3"):
        fmu = tmp_path / "dist" / folder / "Mine.fmu"
        assert validate_fmu(str(fmu)) == []


@pytest.mark.slow
def test_a_path_that_pythonfmu_cannot_read_is_no_obstacle_to_our_own_simulation(tmp_path):
    """It crashes on percent-encoded paths; the temporary folder is chosen around them."""
    awkward = tmp_path / "modèle 100%"
    awkward.mkdir()
    done = build(awkward, "--model", "PRBDM", "--simulate", TMPDIR=str(awkward))
    assert done.returncode == 0, done.stderr
    assert (awkward / "dist" / "python" / "PRBDM.png").exists()
    assert (awkward / "dist" / "fmi3" / "PRBDM.png").exists()


@pytest.mark.parametrize("epoch", FROM_1970)
def test_the_date_is_that_of_source_date_epoch(epoch, mechanisms, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("SOURCE_DATE_EPOCH", epoch)
    if FROM_1970[epoch] is None:
        assert command.main() == cli.MISTAKE
        assert f"SOURCE_DATE_EPOCH = {epoch!r} must be a number" in capsys.readouterr().err
        assert [*tmp_path.iterdir()] == []
    else:
        listed = python_fmu.interface(mechanisms["PRBDM"], {})
        xml = model_description(Heading("X", "", "", {}), listed).decode()
        assert f'generationDateAndTime="{FROM_1970[epoch]}"' in xml


def test_the_icon_does_not_depend_on_the_users_taste(mechanisms):
    mechanism = mechanisms["PRBDM"]
    sample = python_fmu.start_sample(mechanism, {})
    plain = picture.icon(mechanism, sample)
    taste = {"lines.linewidth": 5.0, "savefig.transparent": True, "lines.markersize": 20.0}
    with matplotlib.rc_context(taste):
        assert picture.icon(mechanism, sample) == plain


def test_another_script_is_another_module(mechanisms, monkeypatch):
    """FMUs in one process share modules, of which pythonfmu loads the script by its name."""

    def name() -> bytes:
        with zipfile.ZipFile(io.BytesIO(python_fmu.build(mechanisms["PRBDM"]))) as fmu:
            return fmu.read("resources/slavemodule.txt")

    before = name()
    monkeypatch.setattr(python_fmu, "SCRIPT", python_fmu.SCRIPT + "# changed\n")
    assert name() != before


@pytest.mark.parametrize("name", ["PRBDM.fmu", "PRBDM.png"])
def test_a_folder_where_a_file_is_to_be_is_named(name, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "dist" / "python" / name).mkdir(parents=True)
    assert cli.main(["--model", "PRBDM", "--simulate"]) == cli.MISTAKE
    told = capsys.readouterr()
    assert told.out == ""
    assert f"{name}: it is a folder" in told.err


def test_a_figure_that_cannot_be_written_is_a_sentence(fmus, tmp_path, capsys):
    assert report.main([str(fmus["PRBDM"]), str(tmp_path)]) == cli.MISTAKE
    told = capsys.readouterr()
    assert "impacts at stop" in told.out
    assert f"cannot write the figure {tmp_path}: " in told.err


@pytest.mark.parametrize(
    ("typed", "named"),
    [
        ("/clone/build_fmu.py", "build_fmu.py"),
        ("/venv/bin/prbm-build-fmu", "prbm-build-fmu"),
        ("prbm-build-fmu.exe", "prbm-build-fmu"),
        (command.__file__, "python -m prbm.commands.build_fmu"),
    ],
)
def test_the_command_answers_by_the_name_that_was_typed(typed, named, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", [typed])
    assert cli.main(["--bogus"]) == cli.MISTAKE
    assert capsys.readouterr().err.startswith(f"{named}: unrecognized arguments: --bogus")


def test_the_version_is_told(capsys):
    with pytest.raises(SystemExit) as end:
        cli.main(["--version"])
    assert end.value.code == 0
    assert re.fullmatch(r"prbm-impact \d+\.\d+\.\d+\n", capsys.readouterr().out)


def headline(mechanisms, tmp_path, **changes: float) -> str:
    """Return what is told about a run with other start values, ``stop__position=...``."""
    fmu = tmp_path / "PRBDM.fmu"
    values = {name.replace("__", "."): value for name, value in changes.items()}
    atomic.write(fmu, python_fmu.build(mechanisms["PRBDM"], values))
    return "\n".join(report.headline(report.simulate(fmu, lambda fraction: None)))


def test_an_impact_at_the_start_is_the_first_one(mechanisms, tmp_path):
    told = headline(
        mechanisms, tmp_path,
        release__displacement=0.0, release__velocity=0.5, stop__restitution=0.0,
    )  # fmt: skip
    assert re.search(r"impacts at stop +1, the first at t = 0\.00000 s with 0\.500 m/s", told)
    assert "came to rest         at t = 0.000 s" in told


def test_an_unstable_equilibrium_is_no_place_to_rest(mechanisms, tmp_path):
    """A column under the shuttle's weight buckles."""
    told = headline(
        mechanisms, tmp_path, gravity__x=0.0, gravity__y=-200.0, release__displacement=-1e-3
    )
    assert "the equilibrium under gravity is unstable" in told
    assert "rest position" not in told
    assert "Hz" not in told


@pytest.mark.skipif(os.name != "posix", reason="sends a signal to a group of processes")
@pytest.mark.parametrize("moment", [0.3, 1.3], ids=["importing", "simulating"])
def test_ctrl_c_ends_a_simulation_without_a_headline(fmus, tmp_path, moment):
    """What is told of a simulation that was broken off would be wrong."""
    fmu = tmp_path / "PRBDM2R.fmu"
    fmu.write_bytes(fmus["PRBDM2R"].read_bytes())
    code = (
        "import sys; from pathlib import Path; from prbm.commands import building as cli\n"
        "sys.argv = ['build_fmu.py']\n"
        "try: cli._simulate([Path(sys.stdin.read())])\n"
        "except KeyboardInterrupt: print('interrupted')"
    )
    with subprocess.Popen(
        [sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
        stderr=subprocess.PIPE, text=True, process_group=0,
        env=os.environ | {"PYTHONPATH": str(ROOT / "fmu_src")},
    ) as process:  # fmt: skip
        process.stdin.write(str(fmu))
        process.stdin.close()
        assert "simulating" in process.stdout.readline()
        time.sleep(moment)
        os.killpg(process.pid, signal.SIGINT)
        told, complaints = process.stdout.read(), process.stderr.read()
    assert told == "interrupted\n"
    assert "Traceback" not in complaints


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ('unit = "m"', 'unit = "furlong"', r"flexure\.length has the unit 'furlong'"),
        ("nominal = 1e-2", "nominal = inf", r"flexure\.length: nominal = inf must be positive"),
        ('name = "stop"', 'name = "wänd"', r"wänd\.position: names of FMI .* rename the part"),
        ('name = "PRBDM"', 'name = "__debug__"', "'__debug__': Python cannot give it to a class"),
    ],
)
def test_what_no_fmu_can_have_is_a_sentence(tmp_path, old, new, sentence):
    text = (ROOT / "fmu_src" / "prbm" / "shipped" / "PRBDM.toml").read_text()
    path = tmp_path / "mine.toml"
    path.write_text(text.replace(old, new, 1), "utf-8")
    with pytest.raises(MechanismError, match=sentence):
        python_fmu.build(read_mechanism(path))


def test_a_name_of_pythons_own_is_one_like_others(tmp_path):
    """The script is run twice, the second time beside the class of that name."""
    text = (ROOT / "fmu_src" / "prbm" / "shipped" / "PRBDM.toml").read_text()
    path = tmp_path / "mine.toml"
    path.write_text(text.replace('name = "PRBDM"', 'name = "globals"'), "utf-8")
    fmu = tmp_path / "globals.fmu"
    atomic.write(fmu, python_fmu.build(read_mechanism(path)))
    assert len(simulate_fmu(str(fmu), stop_time=0.01)) > 1


def test_odd_texts_do_no_harm(tmp_path):
    """A title cannot leave the script's docstring, nor can control characters break the XML."""
    text = (ROOT / "fmu_src" / "prbm" / "shipped" / "PRBDM.toml").read_text()
    odd = 'title = "{a} \\"\\"\\" \\\\ \\u0007 <b> %s é"'
    path = tmp_path / "mine.toml"
    path.write_text(re.sub(r"^title = .*$", lambda _: odd, text, flags=re.MULTILINE), "utf-8")
    fmu = tmp_path / "PRBDM.fmu"
    atomic.write(fmu, python_fmu.build(read_mechanism(path)))
    assert validate_fmu(str(fmu)) == []
    assert read_model_description(str(fmu)).description == '{a} """ \\   <b> %s é'


@pytest.mark.parametrize("wrong", ["999999999999999999", "soon"])
def test_a_wrong_date_is_a_sentence_though_it_keeps_scipy_from_being_imported(tmp_path, wrong):
    done = build(tmp_path, "--list", SOURCE_DATE_EPOCH=wrong)
    assert done.returncode == cli.MISTAKE
    assert done.stderr.count("\n") == 1
    assert f"SOURCE_DATE_EPOCH = {wrong!r}" in done.stderr


def test_ctrl_c_while_it_imports_is_no_traceback(monkeypatch, capsys):
    def interrupted() -> str:
        raise KeyboardInterrupt

    monkeypatch.setattr(command, "date", interrupted)
    assert command.main() == cli.INTERRUPTED
    assert capsys.readouterr().err == "build_fmu.py: interrupted\n"


def test_a_package_that_is_missing_is_named(monkeypatch, capsys):
    monkeypatch.delitem(sys.modules, "prbm.commands.building")
    monkeypatch.delattr(sys.modules["prbm.commands"], "building")
    monkeypatch.setitem(sys.modules, "prbm.mechanics.inputs", None)
    assert command.main() == cli.MISTAKE
    assert "needs the Python package prbm.mechanics.inputs" in capsys.readouterr().err


FILES = {
    ("title =", "titel ="): "unknown key titel; did you mean title?",
    ("mass = 0.053187", "mass = [1]"): "bodies.0.mass (of shuttle) = [1]: write a number, or an",
    ("mass = 0.053187", ""): "bodies.0.mass (of shuttle) is missing: add the key",
    (
        'point = ["shuttle.width"',
        'bounce = 1\npoint = ["shuttle.width"',
    ): "unknown key stops.0.bounce (of stop)",
    ("gravity = [9.81, 0.0]", "gravity = [9.81]"): "gravity = [9.81]: a number is missing; add it",
    ("centre = [", "centre = [[1], "): "bodies.0.centre",
    ("left = [0.0, 0.0]", "left = [0.0]"): "ground.left = [0.0]: a number is missing; add it",
    ("[[stops]]", "[stops]"): "write a list, [...], or one table [[...]]",
    ("value = 0.04", "value = -1.0"): "flexure.length = -1 m must be at least",
}


@pytest.mark.parametrize("change", FILES, ids=lambda change: change[1] or "nothing")
def test_a_mistake_in_a_mechanism_file_names_file_key_and_remedy(tmp_path, change):
    text = (ROOT / "fmu_src" / "prbm" / "shipped" / "PRBDM.toml").read_text()
    assert change[0] in text
    path = tmp_path / "mine.toml"
    path.write_text(text.replace(*change, 1))
    with pytest.raises(MechanismError) as error:
        read_mechanism(path)
    assert FILES[change] in str(error.value)
    for line in str(error.value).splitlines():
        assert line.startswith(f"{path}: ")
        assert "Value error" not in line
        assert "Input should" not in line


def test_a_byte_order_mark_is_no_part_of_a_mechanism_file(mechanisms, tmp_path):
    """Editors on Windows write one."""
    text = (ROOT / "fmu_src" / "prbm" / "shipped" / "PRBDM.toml").read_text()
    path = tmp_path / "mine.toml"
    path.write_text(text, encoding="utf-8-sig")
    assert read_mechanism(path) == mechanisms["PRBDM"]
