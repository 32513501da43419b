"""A sweep gives the same results as its runs one by one, also after crashes and interruptions."""

import io
import json
import math
import os
import shlex
import shutil
import signal
import subprocess
import sys
import time
import zipfile
from collections import Counter
from pathlib import Path

import dask
import fmpy
import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest
from distributed import LocalCluster
from pythonfmu import FmuBuilder
from scipy import stats

import prbm
from coupled import integrator
from mishap import CRASHES, CRASHES_ONCE, EXHAUSTS, EXITS, FINE, HANGS, KILLS_WORKER, RAISES
from native_host import clocked
from prbm.base.errors import ParameterError, PrbmError
from prbm.commands import study as command
from prbm.commands.command_line import main
from prbm.sweeps import runner
from prbm.sweeps.fmu import FmuJob, LoadedFmu
from prbm.sweeps.outputs import Output, evaluate, parse_output, reduce
from prbm.sweeps.results import OWN
from prbm.sweeps.results import SETTINGS as KEY
from prbm.sweeps.runner import StudyError
from prbm.sweeps.sweep import samples, sweep
from signals import interruptible
from support import SUPPORT

pytestmark = [pytest.mark.fmu, pytest.mark.native]

OUTPUTS = ["shuttle.x", "stop.impact_count", "max(shuttle.vx)", "first(stop.contact)"]
GRID = pd.DataFrame({"stop.restitution": [0.0, 0.6, 0.8], "stop.offset": [0.0, 4e-3, -2e-3]})


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


@pytest.fixture(scope="session")
def mishap(tmp_path_factory) -> Path:
    """Return an FMU that fails, crashes or hangs as its parameter ``trouble`` selects."""
    script = SUPPORT / "mishap.py"
    return FmuBuilder.build_FMU(script, dest=tmp_path_factory.mktemp("mishap"))


@pytest.fixture
def log(tmp_path, monkeypatch) -> Path:
    """Return the file to which the FMU adds one line per run."""
    monkeypatch.setenv("MISHAP_LOG", str(tmp_path / "mishap.log"))
    return tmp_path / "mishap.log"


def runs(log: Path) -> Counter[float]:
    """Return the number of runs for each value of x."""
    return (
        Counter(float(line) for line in log.read_text(encoding="utf-8").split())
        if log.exists()
        else Counter()
    )


def alone(fmu: Path, row: dict[str, float], **options) -> np.ndarray:
    """Return FMPy's result for one row, with the variables used in OUTPUTS."""
    names = ["shuttle.x", "stop.impact_count", "shuttle.vx", "stop.contact"]
    return fmpy.simulate_fmu(fmu, start_values=row, output=names, **options)


def assert_rows_are(results: pd.DataFrame, each) -> None:
    """Compare the columns OUTPUTS to the last bit with FMPy's results for the rows of GRID."""
    assert list(results["status"]) == ["ok"] * len(GRID)
    for (_, row), found in zip(GRID.iterrows(), results[OUTPUTS].to_numpy(), strict=True):
        one = each(dict(row))
        held = one["time"][one["stop.contact"] != 0]
        first = held[0] if len(held) else np.nan
        expected = [one["shuttle.x"][-1], one["stop.impact_count"][-1], one["shuttle.vx"].max()]
        np.testing.assert_array_equal(found, [*expected, first])


# --- equality with single runs ------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("fmi", [2, 3])
def test_a_row_equals_a_run_by_fmpy_to_the_last_bit(native, fmi):
    """The step does not divide the stop time; the result contains the parameters."""
    fmu = native["PRBDM2R", fmi]
    results = sweep(
        fmu, GRID, outputs=OUTPUTS, stop_time=0.1005, step=7e-4, tolerance=1e-6, workers=1
    )
    pd.testing.assert_frame_equal(results[[*GRID.columns]], GRID)
    assert_rows_are(
        results,
        lambda row: alone(
            fmu, row, stop_time=0.1005, output_interval=7e-4, relative_tolerance=1e-6
        ),
    )


def test_a_row_equals_a_run_by_fmpy_in_event_mode():
    """FMUs with a clock must run in event mode."""
    fmu = clocked("PRBDM")
    results = sweep(fmu, GRID, outputs=OUTPUTS, stop_time=0.1, step=1e-3, workers=1)
    assert_rows_are(
        results,
        lambda row: alone(fmu, row, stop_time=0.1, output_interval=1e-3, use_event_mode=True),
    )


def test_a_run_does_not_depend_on_the_runs_before(native, tmp_path):
    """A process runs the rows one by one, also after a run that has failed."""
    folder = Path(fmpy.extract(native["PRBDM", 2], tmp_path / "fmu"))
    job = FmuJob(0.0, 0.05, 1e-3, 1e-8, {}, (Output("x", "shuttle.x"), Output("v", "shuttle.vx")))
    rows = [{"release.displacement": x} for x in (-0.01, -0.012, math.nan, -0.018)]
    fresh = [LoadedFmu(folder, job).run(row).values for row in rows]
    fmu = LoadedFmu(folder, job)
    assert [fmu.run(row).values for row in rows] == fresh
    assert [bool(values) for values in fresh] == [True, True, False, True]


def test_an_fmu_with_one_instance_per_process_has_a_process_for_each_row(native):
    """The native FMU is told to have one; an FMU of Python would stay in the process of tests."""
    flagged, element = Path("once.fmu"), b"<CoSimulation"
    with zipfile.ZipFile(native["PRBDM", 2]) as source, zipfile.ZipFile(flagged, "w") as target:
        for entry in source.infolist():
            once = element + b' canBeInstantiatedOnlyOncePerProcess="true"'
            target.writestr(entry, source.read(entry).replace(element, once))
    job = FmuJob(0.0, 0.01, 1e-3, 1e-8, {}, ())
    assert LoadedFmu(fmpy.extract(flagged), job).run({}).spent
    table = pd.DataFrame({"release.displacement": [-0.01, -0.012, -0.018]})
    found = sweep(
        flagged, table, outputs=["shuttle.x"], stop_time=0.01, step=1e-3, retries=0, workers=1
    )
    assert found["status"].tolist() == ["ok"] * 3


def test_a_failing_second_instance_is_left_to_another_process(native, tmp_path):
    folder = Path(fmpy.extract(native["PRBDM", 2], tmp_path / "fmu"))
    fmu = LoadedFmu(folder, FmuJob(0.0, 0.01, 1e-3, 1e-8, {}, (Output("x", "shuttle.x"),)))
    assert fmu.run({}).status == "ok"
    fmu.fmu.fmi2Instantiate = lambda *_: None
    with pytest.raises(Exception, match="Failed to instantiate"):
        fmu.run({})


def test_defaults_without_a_default_experiment_are_one_second_and_all_outputs(mishap, log):
    """The default step is a thousandth of the run."""
    results = sweep(mishap, pd.DataFrame({"x": [2.0]}), workers=1)
    assert results.columns.tolist() == ["row", "x", "y", "status", "message"]
    assert results["y"].tolist() == [2.0]
    settings = pq.read_schema("results.parquet").metadata[KEY]
    assert json.loads(settings)["step [s]"] == 1e-3


def test_reductions_match_a_closed_form():
    """The curve x = t (2 - t) on [0, 2] has maximum 1, mean 2/3, and x > 0.75 in (0.5, 1.5)."""
    t = np.concatenate((np.linspace(0.0, 1.0, 2001), np.linspace(1.0, 2.0, 501)[1:]))
    x = t * (2.0 - t)

    def of(text):
        return reduce(parse_output(text, {"x"}), t, x)

    assert of("x") == of("final(x)") == 0.0
    assert (of("max(x)"), of("min(x)")) == (1.0, 0.0)
    assert of("mean(x)") == pytest.approx(2 / 3, abs=2e-3**2 / 6)  # error of the trapezoidal rule
    assert of("first(x > 0.75)") == pytest.approx(0.5, abs=1e-3)  # a step is 5e-4 here
    assert of("since(x < 0.75)") == pytest.approx(1.5, abs=2.5e-3)  # a step is 2e-3 here
    assert of("since(x <= 1)") == 0.0
    assert np.isnan([of("first(x > 1.5)"), of("since(x > 0.5)"), of("first(x >= 2)")]).all()


def test_absolute_values_are_reduced_as_their_variable():
    t, x = np.linspace(0.0, 1.0, 5), np.array([0.0, -3.0, 2.0, -1.0, 0.0])
    columns = {"time": t, "x": x}
    texts = ("max(abs(x))", "abs(x)", "first(abs(x) > 2.5)", "min(abs(x))")
    values = [evaluate(parse_output(text, columns), columns) for text in texts]
    assert values == [3.0, 0.0, 0.25, 0.0]
    assert parse_output("abs(x)", {"abs(x)"}).absolute is False


def test_inputs_over_time_need_variable_steps(mishap):
    with pytest.raises(ParameterError, match=r"unknown variable .force.; known names are none"):
        sweep(mishap, pd.DataFrame({"x": [1.0]}), inputs={"force": "step(1)"})


def test_a_named_quantity_of_an_fmu_without_its_variables_is_rejected(mishap):
    with pytest.raises(ParameterError, match=r"output settling: the FMU has no variable energy\.k"):
        sweep(mishap, pd.DataFrame({"x": [1.0]}), outputs=["settling"])


def test_a_variable_name_takes_precedence_over_a_reduction():
    assert parse_output("max(x)", {"max(x)"}) == Output("max(x)", "max(x)")
    assert parse_output("first(a < b)", {"a < b"}).variable == "a < b"


def test_an_output_may_be_a_text_and_a_value_a_truth_value(mishap, log):
    table = pd.DataFrame({"x": [2.0]})
    results = sweep(mishap, table, outputs="max(y)", values={"trouble": False}, workers=1)
    assert results["max(y)"].tolist() == [2.0]


def test_a_mapping_of_outputs_names_the_columns(native):
    outputs = {"end [m]": "shuttle.x", "longest [m]": "max(shuttle.x)"}
    results = sweep(native["PRBDM", 2], GRID[:1], outputs=outputs, stop_time=0.01, workers=1)
    assert [*results.columns[3:5]] == [*outputs]


# --- failed runs --------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("fmi", [2, 3])
def test_one_failure_in_a_hundred_costs_one_row(native, fmi):
    table = samples({"stop.restitution": (0.2, 0.8)}, 100)
    table.loc[41, "stop.restitution"] = 1.5
    out = sweep(native["PRBDM2R", fmi], table, outputs=["shuttle.x"], stop_time=0.005, workers=2)
    bad = out[out["status"] != "ok"]
    assert bad["row"].tolist() == [41]
    assert bad["message"].item() == "stop.restitution = 1.5 must be at most 1"
    assert bad["shuttle.x"].isna().all()
    good = out.drop(41)["shuttle.x"]
    assert good.notna().all()
    assert good.nunique() == 1  # The stop has not been reached.


@pytest.mark.slow
def test_a_crash_an_exit_a_hang_and_an_error_cost_one_row_each(mishap, log):
    trouble = [FINE, RAISES, FINE, CRASHES, EXITS, FINE, HANGS, FINE]
    table = pd.DataFrame({"x": np.arange(8.0), "trouble": trouble})
    out = sweep(mishap, table, step=0.5, workers=1, retries=0, timeout=1.0)
    assert out["status"].tolist() == [
        "ok", "failed", "ok", "crashed", "crashed", "ok", "timeout", "ok",
    ]  # fmt: skip
    assert "the spring is broken" in out["message"][1]
    assert out["message"][3] == "the process of the simulation crashed: killed by SIGSEGV"
    assert out["message"][4] == "the process of the simulation crashed: exit code 3"
    assert out["message"][6] == "not finished after 1 s"
    fine = out["status"] == "ok"
    np.testing.assert_array_equal(out["y"][fine], out["x"][fine])
    assert runs(log) == Counter(table["x"])


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="limits the memory of a process of Linux")
def test_a_run_without_memory_costs_one_row(mishap, log):
    table = pd.DataFrame({"x": np.arange(4.0), "trouble": [FINE, EXHAUSTS, FINE, FINE]})
    out = sweep(mishap, table, step=0.5, workers=1, retries=0)
    assert out["status"].tolist() == ["ok", "failed", "ok", "ok"]
    assert out["message"][1]
    assert out["y"].drop(1).tolist() == [0.0, 2.0, 3.0]


@pytest.mark.slow
def test_a_crash_that_is_not_reproduced_costs_no_row(mishap, log):
    table = pd.DataFrame({"x": [1.0, 2.0, 3.0], "trouble": [FINE, CRASHES_ONCE, CRASHES]})
    out = sweep(mishap, table, step=0.5, workers=1)
    assert out["status"].tolist() == ["ok", "ok", "crashed"]
    assert (
        out["message"][2]
        == "the process of the simulation crashed: killed by SIGSEGV, in each of 2 attempts"
    )
    assert runs(log) == {1.0: 1, 2.0: 2, 3.0: 2}


@pytest.mark.slow
def test_failed_runs_are_repeated_on_request(mishap, log):
    """Successful runs in the same part are not repeated; the files have all rows in order."""
    table = pd.DataFrame({"x": np.arange(12.0), "trouble": FINE})
    table.loc[4, "trouble"] = CRASHES_ONCE
    out = sweep(mishap, table, step=0.5, workers=1, retries=0)
    assert (out["status"] == "ok").tolist() == [row != 4 for row in range(12)]
    assert sweep(mishap, table, step=0.5).equals(out)
    out = sweep(mishap, table, step=0.5, workers=1, retry_failed=True)
    assert out["y"].tolist() == table["x"].tolist()
    assert pd.read_parquet("results.parquet")["row"].tolist() == list(range(12)), "rows in order"
    assert runs(log) == Counter([*table["x"], 4.0])


# --- continued sweeps ---------------------------------------------------------------------------

PARTIAL = Path("results.parquet.partial")
LONG = pd.DataFrame({"x": np.arange(24.0), "pause": 0.15})
SCRIPT = """
import sys
from prbm.commands.command_line import main
sys.exit(main(["sweep", {!r}, "table.csv", "--workers", "2", "--step", "0.5"]))
"""


def started(fmu: Path, wanted: int) -> subprocess.Popen[str]:
    """Start the sweep in another process; return it once ``wanted`` runs are on disk."""
    paths = [str(Path(prbm.__file__).parents[1]), os.environ.get("PYTHONPATH", "")]
    process = subprocess.Popen(
        [sys.executable, "-c", SCRIPT.format(str(fmu))],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(paths)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=interruptible,
    )
    limit = time.monotonic() + 60.0
    while time.monotonic() < limit and process.poll() is None and on_disk() < wanted:
        time.sleep(0.02)
    return process


def on_disk() -> int:
    """Return the number of stored runs."""
    return len(stored())


def stored() -> pd.DataFrame:
    """Return the stored runs, without a line that a kill has left incomplete."""
    if not PARTIAL.exists():
        return pd.DataFrame()
    lines = PARTIAL.read_text(encoding="utf-8").splitlines(keepends=True)
    rows = [line for line in lines if line.endswith("\n") and not line.startswith("#")]
    return pd.read_csv(io.StringIO("".join(rows))) if rows else pd.DataFrame()


@pytest.mark.slow
def test_a_killed_sweep_continues_with_the_remaining_rows(mishap, log):
    """No run that is on disk is repeated, and the files have all rows in order."""
    LONG.to_csv("table.csv", index=False)
    process = started(mishap, 5)
    process.kill()
    process.communicate()
    done = stored()
    assert 5 <= len(done) < 24
    log.unlink()

    fractions: list[float] = []
    results = sweep(mishap, "table.csv", step=0.5, workers=2, progress=fractions.append)
    assert runs(log) == Counter(set(LONG["x"]) - set(done["x"]))
    assert results["x"].tolist() == results["y"].tolist() == LONG["x"].tolist()
    assert fractions == sorted(fractions)
    assert (fractions[0], fractions[-1]) == (pytest.approx(len(done) / 24), 1.0)
    assert sweep(mishap, "table.csv", step=0.5).equals(results)
    assert runs(log).total() == 24 - len(done)
    assert pd.read_parquet("results.parquet")["row"].tolist() == list(range(24))


@pytest.mark.slow
def test_a_stopped_sweep_reports_the_number_of_stored_runs(mishap, log):
    """Ctrl-C ends the sweep with one sentence and ends all processes of the FMU."""
    LONG.to_csv("table.csv", index=False)
    process = started(mishap, 5)
    process.send_signal(signal.SIGINT)
    _, stderr = process.communicate(timeout=30)
    assert process.returncode == 130, stderr
    message = f"interrupted; {PARTIAL} has the {on_disk()} completed rows"
    assert message in stderr
    assert "Traceback" not in stderr
    before = runs(log)
    time.sleep(1.0)
    assert runs(log) == before
    log.unlink()
    done = stored()
    assert sweep(mishap, "table.csv", step=0.5)["y"].tolist() == LONG["x"].tolist()
    assert runs(log) == Counter(set(LONG["x"]) - set(done["x"]))


@pytest.mark.slow
def test_a_second_sweep_into_the_same_folder_is_rejected(mishap, log):
    """The second sweep repeats no run, and names the first's process."""
    LONG.to_csv("table.csv", index=False)
    process = started(mishap, 3)
    with pytest.raises(ParameterError, match=rf"in use by another study \(process {process.pid} "):
        sweep(mishap, "table.csv", step=0.5, workers=1)
    with pytest.raises(ParameterError, match="in use by another study"):
        sweep(mishap, "table.csv", step=0.5, workers=1, overwrite=True)
    assert process.poll() is None
    process.communicate(timeout=60)
    assert runs(log) == Counter(LONG["x"])
    assert len(sweep(mishap, "table.csv", step=0.5)) == len(LONG)


def test_two_sweeps_of_one_process_into_the_same_folder_are_rejected(mishap, log):
    table = pd.DataFrame({"x": [1.0, 2.0]})

    def second(fraction):
        with pytest.raises(ParameterError, match=rf"process {os.getpid()} on"):
            sweep(mishap, table, step=0.5, workers=1)

    assert len(sweep(mishap, table, step=0.5, workers=1, progress=second)) == 2
    assert runs(log).total() == 2


@pytest.mark.slow
def test_only_added_rows_are_computed(mishap, log):
    table = pd.DataFrame({"x": [1.0, 2.0, 3.0]})
    sweep(mishap, table[:2], step=0.5, workers=1)
    assert sweep(mishap, table, step=0.5, workers=1)["y"].tolist() == [1.0, 2.0, 3.0]
    assert runs(log) == {1.0: 1, 2.0: 1, 3.0: 1}


@pytest.mark.slow
def test_results_of_another_sweep_are_rejected_or_replaced(mishap, log, native):
    """The second sweep has another step, output, value, table or FMU; no result is changed."""
    table = pd.DataFrame({"x": [1.0, 2.0]})
    sweep(mishap, table, step=0.5, workers=1)
    for change, message in (
        ({"step": 0.25}, r"another step \[s\] \(0.5, now 0.25\)"),
        ({"outputs": ["max(y)"]}, "another outputs"),
        ({"values": {"pause": 0.01}}, "another values"),
        ({"table": pd.DataFrame({"x": [1.0, 3.0]})}, "another table: row 1 has changed"),
        ({"table": table[:1]}, "another table: row 1 is missing now"),
        ({"table": table.assign(pause=0.0)}, "another parameters"),
    ):
        with pytest.raises(ParameterError, match=rf"{message}.*overwrite them"):
            sweep(**({"fmu": mishap, "table": table, "step": 0.5, "workers": 1} | change))
    with pytest.raises(ParameterError, match="another FMU"):
        sweep(native["PRBDM", 2], GRID)
    assert runs(log).total() == 2
    assert sweep(mishap, table, step=0.25, workers=1, overwrite=True)["y"].tolist() == [1.0, 2.0]
    assert runs(log).total() == 4


def test_a_path_with_other_contents_is_rejected_and_unchanged(mishap):
    """A Parquet file of another program, and a folder as of version 0.2."""
    table = pd.DataFrame({"x": [1.0, 2.0]})
    table.to_parquet("results.parquet")
    before = Path("results.parquet").read_bytes()
    for overwrite in (False, True):
        with pytest.raises(ParameterError, match=r"results\.parquet exists but contains no sweep"):
            sweep(mishap, table, overwrite=overwrite)
    assert Path("results.parquet").read_bytes() == before
    Path("results").mkdir()
    for overwrite in (False, True):
        with pytest.raises(PrbmError, match=r"results: it is a folder; choose another name"):
            sweep(mishap, table, "results", overwrite=overwrite)


@pytest.mark.slow
def test_damaged_results_are_reported(mishap, log):
    table = pd.DataFrame({"x": [1.0]})
    sweep(mishap, table, step=0.5, workers=1)
    content = Path("results.parquet").read_bytes()
    Path("results.parquet").write_bytes(content[:100])
    with pytest.raises(ParameterError, match=r"results\.parquet cannot be read .*overwrite"):
        sweep(mishap, table, step=0.5, workers=1)
    sweep(mishap, table, step=0.5, workers=1, overwrite=True)
    assert Path("results.parquet").read_bytes() == content


# --- scheduler by address -----------------------------------------------------------------------


@pytest.mark.slow
def test_a_scheduler_by_address_gives_the_same_results(native, mishap, log):
    """The scheduler has a worker with two threads."""
    options = {"outputs": OUTPUTS, "stop_time": 0.05}
    here = sweep(native["PRBDM2R", 2], GRID, "here.parquet", **options)
    with cluster(threads_per_worker=2) as there:
        address = there.scheduler_address
        far = sweep(native["PRBDM2R", 2], GRID, "far.parquet", scheduler=address, **options)
        again = sweep(mishap, pd.DataFrame({"x": [3.0]}), step=0.5, scheduler=address)
    pd.testing.assert_frame_equal(here[OUTPUTS], far[OUTPUTS])
    assert again["y"].tolist() == [3.0]


@pytest.mark.slow
def test_a_run_that_kills_its_worker_costs_one_row(mishap, log):
    """The scheduler gives up after one crash, the sweep after two."""
    trouble = [FINE, FINE, KILLS_WORKER, FINE, FINE]
    table = pd.DataFrame({"x": np.arange(5.0), "trouble": trouble})
    with (
        dask.config.set({"distributed.scheduler.allowed-failures": 0}),
        cluster(threads_per_worker=1) as there,
    ):
        out = sweep(mishap, table, step=0.5, scheduler=there.scheduler_address)
    assert out["status"].tolist() == ["ok", "ok", "crashed", "ok", "ok"]
    assert out["message"][2] == "every worker that ran this row crashed"
    assert out["y"].drop(2).tolist() == [0.0, 1.0, 3.0, 4.0]


def cluster(**options) -> LocalCluster:
    """Return a scheduler with one worker process."""
    return LocalCluster(
        n_workers=1, processes=True, dashboard_address="127.0.0.1:0", silence_logs=100, **options
    )


@pytest.mark.slow
def test_a_missing_scheduler_or_worker_is_reported(mishap, log, monkeypatch):
    monkeypatch.setattr(runner, "CONNECTION_TIMEOUT", 0.5)
    table = pd.DataFrame({"x": [1.0]})
    with pytest.raises(StudyError, match=r"no scheduler responds at tcp://127.*dask scheduler"):
        sweep(mishap, table, scheduler="tcp://127.0.0.1:1")
    with pytest.raises(StudyError, match="no scheduler responds at nonsense://a"):
        sweep(mishap, table, scheduler="nonsense://a")
    with (
        LocalCluster(n_workers=0, processes=False, dashboard_address="127.0.0.1:0") as empty,
        pytest.raises(StudyError, match=r"has no workers; start one with: dask worker inproc:"),
    ):
        sweep(mishap, table, scheduler=empty.scheduler_address)


# --- invalid input ------------------------------------------------------------------------------

TABLES = {
    "an unknown parameter": ({"stop.restituton": [0.5]}, "no variable 'stop.restituton'; did you "
                             "mean stop.restitution"),
    "an output": ({"shuttle.x": [0.5]}, "shuttle.x (output variable of type Real) cannot be set "
                  "before a run"),
    "NaN": ({"stop.offset": [0.0, np.nan]}, "row 1 of the table: stop.offset = nan must be a "
            "finite number"),
    "infinity": ({"stop.offset": [np.inf]}, "row 0 of the table: stop.offset = inf must"),
    "a word": ({"stop.offset": [0.0, "wide"]}, "row 1 of the table: stop.offset = wide must"),
    "no rows": ({"stop.offset": []}, "the table has 0 rows and 1 columns; write"),
    "semicolons": ({"release.displacement;stop.offset": [0.5]}, "the table has the column "
                   "'release.displacement;stop.offset': its columns seem to be separated by semi"),
    "no columns": ({}, "the table has 0 rows and 0 columns; write"),
    "a name of the results": ({"status": [1.0]}, "the FMU has no variable 'status'"),
}  # fmt: skip


@pytest.mark.parametrize("case", TABLES)
def test_an_invalid_table_is_rejected_with_one_sentence(native, case):
    columns, sentence = TABLES[case]
    with pytest.raises(ParameterError) as refusal:
        sweep(native["PRBDM2R", 2], pd.DataFrame(columns))
    assert sentence in str(refusal.value)
    assert "\n" not in str(refusal.value)
    assert not Path("results.parquet").exists()


FILES = {
    "missing": ("no.csv", None, "no.csv does not exist; give a CSV or Parquet file"),
    "empty": ("t.csv", b"", "t.csv has 0 rows and 0 columns"),
    "only a header": ("t.csv", b"stop.offset\n", "t.csv has 0 rows and 1 columns"),
    "a missing cell": ("t.csv", b"stop.offset,gravity.x\n0,1\n0,\n", "row 1 of the table: "
                       "gravity.x =  must be a finite number"),
    "semicolons": ("t.csv", b"gravity.x;stop.offset\n1;0,5\n", "separate them by commas, and write "
                   "numbers with a decimal point"),
    "tabs": ("t.csv", b"gravity.x\tstop.offset\n1\t0\n", "seem to be separated by tabs; separate"),
    "ragged": ("t.csv", b"stop.offset\n0,1\n0,1,2\n", "t.csv cannot be read as a table"),
    "binary": ("t.csv", b"\xff\xfe\x00stop", "t.csv cannot be read as a table"),
    "text named Parquet": ("t.parquet", b"stop.offset\n0\n", "t.parquet cannot be read as a table"),
}  # fmt: skip


@pytest.mark.parametrize("case", FILES)
def test_an_invalid_file_is_rejected_with_one_sentence(native, capsys, case):
    name, content, sentence = FILES[case]
    if content is not None:
        Path(name).write_bytes(content)
    assert main(["sweep", str(native["PRBDM2R", 2]), name]) == 2
    stderr = capsys.readouterr().err
    assert sentence in stderr
    assert stderr.count("\n") == 1


@pytest.mark.parametrize("name", ["r.csv", "deep/r.XLSX", "r.json"])
def test_the_name_of_another_kind_of_file_is_rejected_for_the_results(native, capsys, name):
    """The name is checked before the FMU and the table are read; both are missing here."""
    assert main(["sweep", "none.fmu", "none.csv", "--out", name]) == 2
    stderr = capsys.readouterr().err
    assert f"out = {name}: the results are a Parquet file, not a" in stderr
    assert f"choose a name such as {Path(name).with_suffix('.parquet')}" in stderr
    assert list(Path().iterdir()) == []


def test_values_of_an_integer_variable_must_be_whole_numbers(mishap):
    with pytest.raises(ParameterError, match=r"trouble = 0\.5 must be a whole number \(Integer\)"):
        sweep(mishap, pd.DataFrame({"trouble": [0, 0.5]}))
    with pytest.raises(ParameterError, match=r"trouble = 3e\+09 must be a whole number"):
        sweep(mishap, pd.DataFrame({"trouble": [3e9]}))


def test_csv_and_parquet_keep_a_table_to_the_last_bit(mishap, log):
    table = samples({"x": stats.norm()}, 5)
    table.to_csv("t.csv", index=False)
    table.to_parquet("t.parquet")
    sweep(mishap, table, step=0.5, workers=1)
    for path in ("t.csv", "t.parquet"):
        assert sweep(mishap, path, step=0.5)["x"].equals(table["x"])
    assert runs(log).total() == 5


SETTINGS = {
    "an unknown output": ({"outputs": ["shutle.x"]}, "no variable 'shutle.x'; did you mean"),
    "no output": ({"outputs": []}, "no output is selected"),
    "no number": ({"outputs": ["first(shuttle.x > up)"]}, "bound 'up' must be a number, as in"),
    "a column twice": ({"outputs": {"row": "shuttle.x"}}, "would have the column 'row' twice"),
    "an unknown value": ({"values": {"mass": 1.0}}, "the FMU has no variable 'mass'"),
    "a value twice": ({"values": {"stop.offset": 1.0}}, "stop.offset is varied and has a"),
    "a NaN value": ({"values": {"gravity.x": np.nan}}, "gravity.x = nan among the"),
    "zero stop time": ({"stop_time": 0.0}, "stop_time = 0 s must be finite and after 0 s"),
    "zero step": ({"step": 0.0}, "step = 0 s must be positive and finite"),
    "too many steps": ({"step": 1e-9}, "step = 1e-09 s makes 1000000000 steps in 1 s"),
    "negative tolerance": ({"tolerance": -1.0}, "tolerance = -1 must be positive and finite"),
    "zero workers": ({"workers": 0}, "workers = 0 must be 1 or more"),
    "negative retries": ({"retries": -1}, "retries = -1 must be 0 or more"),
    "zero timeout": ({"timeout": 0.0}, "timeout = 0 s must be positive"),
}


@pytest.mark.parametrize("case", SETTINGS)
def test_an_invalid_setting_is_rejected_with_one_sentence(native, case):
    options, sentence = SETTINGS[case]
    with pytest.raises(ParameterError) as refusal:
        sweep(native["PRBDM2R", 2], GRID, **options)
    assert sentence in str(refusal.value)
    assert not Path("results.parquet").exists()


def test_an_unreadable_fmu_is_reported(native, tmp_path, capsys):
    GRID.to_csv("t.csv", index=False)
    Path("text.fmu").write_text("no archive", encoding="utf-8")
    for name, sentence in (
        ("none.fmu", "none.fmu: cannot be read (No such file or directory)"),
        ("text.fmu", "text.fmu is not a readable FMU"),
    ):
        assert main(["sweep", name, "t.csv"]) == 2
        assert sentence in capsys.readouterr().err


@pytest.mark.slow
def test_an_fmu_without_a_library_for_this_platform_ends_the_sweep(native, tmp_path):
    folder = Path(fmpy.extract(native["PRBDM", 2], tmp_path / "fmu"))
    shutil.rmtree(folder / "binaries")
    fmu = shutil.make_archive("bare", "zip", folder)
    with pytest.raises(
        StudyError, match="cannot run: the FMU cannot be loaded: Cannot find shared"
    ):
        sweep(fmu, GRID, workers=1)


def test_an_fmu_that_a_worker_cannot_unpack_is_reported(mishap):
    """The description can be read, but another file has a wrong checksum."""
    content = bytearray(mishap.read_bytes())
    with zipfile.ZipFile(mishap) as archive:
        entry = archive.getinfo("resources/mishap.py")
    content[entry.header_offset + 30 + len(entry.filename) + entry.compress_size // 2] ^= 0xFF
    Path("damaged.fmu").write_bytes(content)
    with pytest.raises(StudyError, match=r"a worker cannot unpack the FMU \(.*mishap\.py"):
        sweep("damaged.fmu", pd.DataFrame({"trouble": [0.0]}))


def test_a_missing_package_is_reported(mishap, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(StudyError, match=r"need the package distributed; install .*sweep"):
        sweep(mishap, GRID, scheduler="tcp://127.0.0.1:1")


@pytest.mark.parametrize("words", [[], ["--of", "value"], ["--output", "max(value)"]])
def test_the_command_runs_an_fmu_of_another_tool(words):
    """Without the outputs of this package all outputs of the FMU are recorded, or those named."""
    pd.DataFrame({"start": [0.0, 1.0]}).to_csv("t.csv", index=False)
    fmu = str(integrator())
    assert main(["sweep", fmu, "t.csv", "--out", "r", "--stop-time", "1", "--step", "0.1",
                 "--set", "rate=1", *words]) == 0  # fmt: skip
    found = pd.read_parquet("r").set_index("row").sort_index()
    name = words[-1] if words else "value"
    np.testing.assert_allclose(found[name], [1.0, 2.0], rtol=1e-12)
    assert [*found["status"]] == ["ok", "ok"]


def test_the_summary_names_outputs_without_values():
    nan = float("nan")
    found = pd.DataFrame(
        {"row": [0, 1, 2], "settling": [nan] * 3, "gap": [1.0, nan, nan], "x": [1.0, 2.0, nan],
         "status": ["ok", "ok", "failed"], "message": ["", "", "no"]}
    )  # fmt: skip
    assert command._summary(found, "out.csv").splitlines() == [
        "3 runs, 1 failed: out.csv",
        "row 2 failed: no",
        "settling: no value in 2 of 2 complete simulations; simulate longer, or choose another "
        "output",
        "gap: no value in 1 of 2 complete simulations; simulate longer, or choose another output",
    ]


@pytest.mark.slow
def test_the_command_prints_a_summary(native, capsys):
    table = pd.DataFrame({"stop.restitution": [0.5, 2.0]})
    table.to_csv("t.csv", index=False)
    assert main(["sweep", str(native["PRBDM", 2]), "t.csv", "--out", "r", "--output", "shuttle.x",
                 "--set", "release.displacement=-10 mm", "--stop-time", "10ms"]) == 0  # fmt: skip
    printed = capsys.readouterr().out.splitlines()
    assert printed == [
        "2 runs, 1 failed: r",
        "row 1 failed: stop.restitution = 2 must be at most 1",
    ]
    found = pd.read_parquet("r")
    assert len(found) == 2
    first = found.set_index("row")["shuttle.x"][0]
    alone = fmpy.simulate_fmu(
        str(native["PRBDM", 2]), stop_time=0.01, output=["shuttle.x"],
        start_values={"release.displacement": -0.01, "stop.restitution": 0.5},
    )  # fmt: skip
    assert first == alone["shuttle.x"][-1]


ARGUMENTS = {
    "text for a number": ("--set gravity.x=down", "--set gravity.x= down: "),
    "unknown variable": ("--set gravity.X=1", "--set gravity.X=1: "),
    "wrong unit": ("--set 'gravity.x=1 kg'", "the unit 'kg' has another dimension"),
    "length for a time": (
        "--stop-time 3mm",
        "--stop-time 3mm: the unit 'mm' has another dimension",
    ),
    "text for a count": ("--workers two", "argument --workers: invalid int value: 'two'"),
}


@pytest.mark.parametrize("case", ARGUMENTS)
def test_invalid_arguments_are_rejected_with_one_sentence(native, capsys, case):
    GRID.to_csv("t.csv", index=False)
    words, sentence = ARGUMENTS[case]
    assert main(["sweep", str(native["PRBDM", 2]), "t.csv", *shlex.split(words)]) == 2
    stderr = capsys.readouterr().err
    assert stderr.startswith("prbm sweep: ")
    assert sentence in stderr
    assert stderr.count("\n") == 1


# --- samples ------------------------------------------------------------------------------------


@pytest.mark.parametrize("method", ["latin", "sobol"])
def test_stratified_samples_have_one_row_in_each_stratum(method):
    """In every column F(x) has one value in each of n intervals of equal probability."""
    n = 64
    law = {"a": stats.norm(1.0, 0.1), "b": (2.0, 4.0), "c": stats.weibull_min(2.0)}
    table = samples(law, n, seed=3, method=method)
    uniform = stats.uniform(2.0, 2.0)
    for name, distribution in {**law, "b": uniform}.items():
        strata = np.floor(n * distribution.cdf(table[name])).astype(int)
        assert sorted(strata) == list(range(n)), name


def test_random_samples_follow_their_distribution_and_seed():
    law = {"a": stats.norm(1.0, 0.1), "b": stats.expon(scale=3.0)}
    table = samples(law, 4000, seed=1)
    for name, distribution in law.items():
        assert stats.kstest(table[name], distribution.cdf).pvalue > 1e-3
    assert abs(stats.spearmanr(table["a"], table["b"]).statistic) < 4 / np.sqrt(4000)  # 4 sigma
    assert samples(law, 4000, seed=1).equals(table)
    assert not samples(law, 4000, seed=2).equals(table)


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (({}, 5), "5 rows without parameters: name at least one"),
        (({"a": (0.0, 1.0)}, 0), "n = 0 must be 1 or more"),
        (({"a": 3.0}, 5), "a: 3.0 must be a distribution"),
        (({"a": stats.norm(0.0, -1.0)}, 5), "a: the quantiles of the distribution must be"),
        (
            ({"a": (0.0, 1.0)}, 5, 0, "sobol"),
            "5 rows: Sobol's sequence needs a power of two, such as 4",
        ),
        (({"a": (0.0, 1.0)}, 5, 0, "halton"), "unknown method 'halton'; methods are random"),
    ],
)
def test_invalid_samples_are_rejected(arguments, sentence):
    with pytest.raises(ParameterError, match=sentence):
        samples(*arguments)


def test_fixed_columns_differ_from_the_variables_of_the_guide(native):
    description = fmpy.read_model_description(native["PRBDM2R", 3])
    assert not {v.name for v in description.modelVariables} & set(OWN)
