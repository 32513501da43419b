"""``prbm build``: build FMUs and, with ``--simulate``, simulate them."""

import argparse
import importlib.util
import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import reduce
from operator import or_
from pathlib import Path

from ..base.atomic import check_no_folder, check_writable, write_all
from ..base.errors import PrbmError
from ..base.processes import executor, process_count
from ..files.mechanism_file import file_of, read_mechanism, schema, shipped
from ..files.settings import UserMistake, assigned, units_of
from ..fmu import native_fmu, python_fmu
from ..fmu.export import Export
from ..fmu.parameter_sets import read_parameter_set
from ..fmu.reference_results import steps
from ..kernel.compiler import ALL, HOST, PLATFORMS, CompilerError, this_platform
from ..mechanism.description import Mechanism
from ..runs.engine import PYTHON as PYTHON_ENGINE
from ..runs.experiment import experiment
from .missing import missing_package
from .program import FAILED, INTERRUPTED, MISTAKE, OK
from .record import Record

TERMINATION_TIMEOUT = 2.0  # Time for the process of a simulation to end after Ctrl-C [s].
REPORT_SCRIPT = f"""
import os, signal, sys
signal.signal(signal.SIGINT, lambda *_: os._exit({INTERRUPTED}))
from prbm.commands.fmu_report import main
sys.exit(main(sys.argv[1:]))
"""  # Ctrl-C during the imports ends the process without a traceback.


@dataclass(frozen=True)
class Flavour:
    """A kind of FMU: its output folder, version of FMI, and whether it has an output clock."""

    folder: str
    fmi: int = 2
    native: bool = True
    clock: bool = False


PYTHON = Flavour("python", native=False)
NATIVE = {"2": Flavour("fmi2", 2), "3": Flavour("fmi3", 3)}
CLOCKED = Flavour("fmi3-clock", 3, clock=True)


def run_build(options: argparse.Namespace) -> int:
    """Run ``prbm build``; return its exit status."""
    if options.list:
        _list()
        return OK
    if options.schema:
        print(json.dumps(schema(), indent=2))
        return OK
    plan = _plan(options)
    records = _records(plan)
    built, missing = _build(plan, records)
    for note in dict.fromkeys(x for record in records.values() for x in record.notes(plan.out)):
        print(note)
    status = _simulate(built, options.prog) if options.simulate else OK
    if missing:
        print(f"{options.prog}: {missing}", file=sys.stderr)
        status = max(status, FAILED)
    return status


def _list() -> None:
    files = shipped()
    width = max(map(len, files))
    for name, path in files.items():
        print(f"{name:{width}}  {read_mechanism(path).title}")


def selected_flavours(options: argparse.Namespace) -> tuple[Flavour, ...]:
    """Return the kinds of FMU that the options select.

    Raises
    ------
    UserMistake
        If the options exclude each other.
    """
    python, native = options.flavour != "native", options.flavour != "python"
    if options.clock:
        if not native or options.fmi == "2":
            raise UserMistake(
                "--clock: only native FMUs of FMI 3.0 have clocks; omit --flavour python and "
                "--fmi 2"
            )
        return (CLOCKED,)
    if not native:
        if options.fmi == "3":
            raise UserMistake("--fmi 3: Python FMUs are FMI 2.0; omit --fmi 3 or --flavour python")
        if options.platform:
            raise UserMistake(
                f"--platform {options.platform[0]}: Python FMUs run on Linux and Windows (x86-64) "
                "without a choice of platform; omit --platform or --flavour python"
            )
    kinds = [flavour for fmi, flavour in NATIVE.items() if native and options.fmi in (None, fmi)]
    return (*([PYTHON] if python and options.fmi != "3" else []), *kinds)


def selected_platforms(options: argparse.Namespace) -> tuple[str, ...]:
    """Return the names of the selected platforms; the names of FMI 2.0 are translated.

    Raises
    ------
    UserMistake
        If a platform is unknown, or ``--simulate`` is given and none of them is this machine or
        FMPy is not installed.
    """
    names = [name.strip() for text in options.platform or [HOST] for name in text.split(",")]
    aliases = {p.folder2: p.name for p in PLATFORMS.values()}
    chosen = tuple(dict.fromkeys(aliases.get(name, name) for name in names))
    for name in chosen:
        if name not in (HOST, ALL, *PLATFORMS):
            raise UserMistake(
                f"--platform {name}: unknown platform; choose {HOST}, {ALL} or some of "
                f"{', '.join(PLATFORMS)}"
            )
    here = this_platform()
    if options.simulate and here and not {HOST, ALL, here.name} & {*chosen}:
        raise UserMistake(
            f"--simulate: FMUs for {', '.join(chosen)} do not run on this machine; add --platform "
            f"{HOST}, or omit --simulate"
        )
    if options.simulate and importlib.util.find_spec("fmpy") is None:
        raise UserMistake(
            f"--simulate: {missing_package(ModuleNotFoundError(name='fmpy'))}, or omit --simulate"
        )
    return chosen


@dataclass(frozen=True)
class BuildPlan:
    """The FMUs to build; all checks that take no time have passed.

    Parameters
    ----------
    files : mapping of Path to Mechanism
        The mechanisms by their files.
    changes : mapping
        Start values that differ from the defaults.
    flavours : tuple of Flavour
        Kinds of FMU to build of each mechanism.
    platforms : tuple of str
        Platforms of the native FMUs.
    native_required : bool
        Whether an option selects native FMUs, so that a missing compiler is an error.
    out : Path
        Output folder.
    """

    files: Mapping[Path, Mechanism]
    changes: Mapping[str, float]
    flavours: tuple[Flavour, ...]
    platforms: tuple[str, ...]
    native_required: bool
    out: Path

    @property
    def mechanisms(self) -> tuple[Mechanism, ...]:
        """The mechanisms."""
        return tuple(self.files.values())

    def path(self, flavour: Flavour, name: str) -> Path:
        """Return the file of an FMU."""
        return self.out / flavour.folder / f"{name}.fmu"


def _plan(options: argparse.Namespace) -> BuildPlan:
    """Return the plan of a command line, after all checks that take no time."""
    chosen = mechanisms(options)
    plan = BuildPlan(
        chosen,
        start_values([*chosen.values()], options.changes, options.parameters),
        selected_flavours(options),
        selected_platforms(options),
        bool(options.flavour or options.fmi or options.platform or options.clock),
        options.out,
    )
    for flavour in plan.flavours:
        check_writable(plan.out / flavour.folder)
        for mechanism in plan.mechanisms:
            path = plan.path(flavour, mechanism.name)
            check_no_folder(path)
            if options.simulate:
                check_no_folder(path.with_suffix(".png"))
    return plan


def mechanisms(options: argparse.Namespace) -> dict[Path, Mechanism]:
    """Return the selected mechanisms by their files, all shipped ones if none is selected.

    Raises
    ------
    UserMistake
        If a name is unknown, or two mechanisms have the same name.
    MechanismError
        If a file cannot be read or does not describe a mechanism.
    """
    files = shipped()
    for name in options.model or ():
        if name not in files:
            raise UserMistake(
                f"--model {name}: unknown mechanism; the shipped ones are {', '.join(files)}; "
                "give your own as FILE.toml"
            )
    words = dict.fromkeys([*options.mechanisms, *(options.model or ())])
    paths = [file_of(word) for word in words]
    if options.mechanism is not None:
        paths.append(Path(options.mechanism))
    found: dict[Path, Mechanism] = {}
    names: set[str] = set()
    for path in paths or files.values():
        mechanism = read_mechanism(path)
        if mechanism.name in names:
            raise UserMistake(
                f"two mechanisms have the name {mechanism.name}, which is that of their FMU; build "
                "them into different folders with --out"
            )
        names.add(mechanism.name)
        found[path] = mechanism
    return found


def start_values(
    chosen: Sequence[Mechanism], texts: Sequence[str], parameters: Path | None = None
) -> dict[str, float]:
    """Read NAME=VALUE pairs of parameters and inputs of mechanisms, in SI or with a unit.

    Values in the parameter set ``parameters`` (SSV) are start values, too; the pairs have priority.

    Raises
    ------
    UserMistake
        If a text is not such a pair, or only some of the mechanisms have the variable.
    ParameterError
        If no mechanism has the variable, or the parameter set is invalid.

    Examples
    --------
    >>> guide = read_mechanism(shipped()["PRBDM"])
    >>> start_values([guide], ["stop.restitution=0.5", "stop.position = 1 mm"])
    {'stop.restitution': 0.5, 'stop.position': 0.001}
    """
    units = {mechanism.name: units_of(mechanism) for mechanism in chosen}
    known = reduce(or_, units.values())
    changes = {} if parameters is None else read_parameter_set(parameters, known)
    changes |= assigned(known, texts)
    for name in changes:
        having = [model for model in units if name in units[model]]
        lacking = [model for model in units if name not in units[model]]
        if lacking:
            options = " ".join(having)
            raise UserMistake(
                f"{name}: no such parameter or input in {', '.join(lacking)}; name only mechanisms "
                f"that have it: {options}"
            )
    return changes


def _records(plan: BuildPlan) -> dict[Path, Record]:
    """Return the records of the FMUs by the paths of the FMUs.

    Raises
    ------
    UserMistake
        If a file has the name of a record and is not one.
    """
    paths = {
        plan.path(flavour, mechanism.name): file
        for flavour in plan.flavours
        for file, mechanism in plan.files.items()
    }
    return {
        path: Record(path.parent, f"{path.stem}-build.json", file) for path, file in paths.items()
    }


def _build(plan: BuildPlan, records: Mapping[Path, Record]) -> tuple[list[Path], str]:
    """Build all FMUs, then write them; return the files, and a sentence about missing FMUs.

    Without a compiler, the native FMUs are missing.  That is an error if an option selects native
    FMUs; otherwise the Python FMUs are built.
    """
    processes = process_count(len(plan.mechanisms))
    order = plan.mechanisms
    with executor(processes) as pool:
        if processes > 1:  # The slowest are built first, so that all processes end together.
            efforts = [pool.submit(_effort, plan, mechanism) for mechanism in order]
            found = {m.name: effort.result() for m, effort in zip(order, efforts, strict=True)}
            order = tuple(sorted(order, key=lambda m: -found[m.name]))
        tasks = [pool.submit(_fmus, plan, mechanism) for mechanism in order]
        done = {m.name: task.result() for m, task in zip(order, tasks, strict=True)}
    written = []
    for flavour in plan.flavours:
        for mechanism in plan.mechanisms:
            fmus, _ = done[mechanism.name]
            if flavour in fmus:
                path = plan.path(flavour, mechanism.name)
                record, platforms = records[path], [*plan.platforms] if flavour.native else []
                arguments = {**asdict(flavour), "platforms": platforms, "values": plan.changes}
                text = record.text(mechanism.name, arguments)
                _write(path, {path: fmus[flavour], path.with_name(record.name): text.encode()})
                written.append(path)
    return written, next((missing for _, missing in done.values() if missing), "")


def _effort(plan: BuildPlan, mechanism: Mechanism) -> float:
    """Return an estimate of the time to build an FMU, of which reference results take the most."""
    changes = plan.changes
    try:
        return steps(mechanism, changes, experiment(mechanism, changes, engine=PYTHON_ENGINE))
    except PrbmError:
        return 0.0  # The build reports it.


def _write(path: Path, files: Mapping[Path, bytes]) -> None:
    """Write an FMU together with its record, and print its size."""
    try:
        write_all(files)
    except OSError as error:
        raise UserMistake(
            f"cannot write {error.filename or path}: {error.strerror}; choose another folder with "
            "--out"
        ) from None
    print(f"{path.stem}: {path} ({len(files[path]) / 1000:.0f} kB)", flush=True)


def _fmus(plan: BuildPlan, mechanism: Mechanism) -> tuple[dict[Flavour, bytes], str]:
    """Return the FMUs of a mechanism, and a sentence about missing ones.

    They are built in one process, because they have much in common.
    """
    export = Export(mechanism, plan.changes)
    fmus: dict[Flavour, bytes] = {}
    try:
        for flavour in plan.flavours:
            fmus[flavour] = _fmu(plan, flavour, export)
    except CompilerError as error:
        if plan.native_required:
            raise
        return fmus, f"only the Python FMUs were built: {error}"
    return fmus, ""


def _fmu(plan: BuildPlan, flavour: Flavour, export: Export) -> bytes:
    name, platforms = export.mechanism.name, plan.platforms
    progress = _progress(f"{flavour.folder}/{name}")
    try:
        if not flavour.native:
            return python_fmu.build_export(export, progress)
        return native_fmu.build_export(export, flavour.fmi, platforms, flavour.clock, progress)
    except CompilerError:
        raise  # The error does not depend on the mechanism.
    except PrbmError as error:
        raise UserMistake(f"{name}: {error}") from None


def _progress(name: str) -> Callable[[str], None]:
    """Return a callback that prints a stage with an ellipsis, and a sentence as it is."""
    return lambda text: print(f"{name}: {text}{'' if text.endswith('.') else ' ...'}", flush=True)


def _simulate(fmus: Sequence[Path], program: str) -> int:
    """Simulate each FMU in a separate process; return the exit status."""
    source = str(Path(__file__).resolve().parents[2])
    paths = os.pathsep.join(filter(None, (source, os.environ.get("PYTHONPATH"))))
    status = OK
    for fmu in fmus:
        command = [sys.executable, "-c", REPORT_SCRIPT, str(fmu), str(fmu.with_suffix(".png"))]
        print(f"{fmu.parent.name}/{fmu.stem}: simulating ...", flush=True)
        code = _run(command, os.environ | {"PYTHONPATH": paths})
        if code == INTERRUPTED:
            raise KeyboardInterrupt
        if code != OK:
            reason = f"was ended by signal {-code}" if code < 0 else "failed"
            print(f"{program}: the simulation of {fmu} {reason}", file=sys.stderr)
            status = max(status, code if code == MISTAKE else FAILED)
    return status


def _run(command: Sequence[str], environment: Mapping[str, str]) -> int:
    """Run a command, which handles Ctrl-C itself; return its exit status."""
    # The process inherits the ignored signal and so survives Ctrl-C until it sets its own handler.
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        process = subprocess.Popen(command, env=environment)
    finally:
        signal.signal(signal.SIGINT, before)
    try:
        return process.wait()
    except KeyboardInterrupt:
        _stop(process)
        raise


def _stop(process: subprocess.Popen[bytes]) -> None:
    """Wait for a process to end after Ctrl-C; after timeouts, interrupt it, then terminate it."""
    for number in (signal.SIGINT, signal.SIGTERM):
        try:
            process.wait(TERMINATION_TIMEOUT)
            return
        except subprocess.TimeoutExpired:
            os.kill(process.pid, number)
    process.wait()
