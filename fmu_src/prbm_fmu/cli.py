"""The command that builds FMUs, and shows that they run."""

import argparse
import math
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import NoReturn

from prbm import Mechanism, PrbmError
from prbm.dynamics import input_names
from prbm_tools.mechanism_file import load, shipped

from . import __version__, python_fmu
from .__main__ import command_name
from .archive import write

OK, FAILED, MISTAKE, INTERRUPTED = 0, 1, 2, 130
PYTHON_FOLDER = "python"
PATIENCE = 2.0  # s for the process of a simulation to end after Ctrl-C
REPORT = f"""
import os, signal, sys
signal.signal(signal.SIGINT, lambda *_: os._exit({INTERRUPTED}))
from prbm_fmu.report import main
sys.exit(main(sys.argv[1:]))
"""  # Ctrl-C while it imports needs no traceback


class UserMistake(Exception):
    """What the user asked for cannot be done; the message says why and what to do."""


class _Parser(argparse.ArgumentParser):
    """A parser that answers a mistake with one sentence."""

    def error(self, message: str) -> NoReturn:
        raise UserMistake(f"{message}; see {self.prog} --help")


def parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    p = _Parser(
        prog=command_name(),
        description="Build FMUs of compliant mechanisms with impacts.",
        epilog="Without options, all shipped mechanisms are built into dist/.",
    )
    which = p.add_mutually_exclusive_group()
    which.add_argument(
        "--model", action="append", metavar="NAME",
        help="a shipped mechanism, may be repeated (default: all, see --list)",
    )  # fmt: skip
    which.add_argument(
        "--mechanism", type=Path, metavar="FILE.toml", help="a mechanism of your own"
    )
    p.add_argument(
        "--flavour", choices=("python", "native"),
        help="python: readable source, needs NumPy and SciPy where it runs; native: compiled",
    )  # fmt: skip
    p.add_argument("--fmi", choices=("2", "3"), help="version of FMI (Python FMUs: 2)")
    p.add_argument(
        "--platform", default="host", metavar="NAME", help="host, all, or a platform by name"
    )
    p.add_argument("--clock", action="store_true", help="the variant with an output clock (FMI 3)")
    p.add_argument("--out", type=Path, default=Path("dist"), metavar="DIR", help="default: dist")
    p.add_argument(
        "--set", action="append", default=[], dest="changes", metavar="NAME=VALUE",
        help="start value of a parameter or input, in SI units; may be repeated",
    )  # fmt: skip
    p.add_argument(
        "--simulate", action="store_true",
        help="simulate each FMU with FMPy, print what happens and plot it beside the FMU",
    )  # fmt: skip
    p.add_argument("--list", action="store_true", help="list the shipped mechanisms and stop")
    p.add_argument("--version", action="version", version=f"prbm-impact {__version__}")
    return p


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit status."""
    try:
        options = parser().parse_args(arguments)
        if options.list:
            _list()
            return OK
        _refuse_what_is_not_built(options)
        built = _build(options)
        return _simulate(built) if options.simulate else OK
    except (UserMistake, PrbmError) as error:
        print(f"{command_name()}: {error}", file=sys.stderr)
        return MISTAKE
    except KeyboardInterrupt:
        print(f"{command_name()}: interrupted", file=sys.stderr)
        return INTERRUPTED


def _list() -> None:
    files = shipped()
    width = max(map(len, files))
    for name, path in files.items():
        print(f"{name:{width}}  {load(path).title}")


def _refuse_what_is_not_built(options: argparse.Namespace) -> None:
    if options.flavour == "python" and options.fmi == "3":
        raise UserMistake("Python FMUs are FMI 2.0; leave out --fmi 3")
    asked = {
        "--flavour native": options.flavour == "native",
        "--fmi 3": options.fmi == "3",
        "--clock": options.clock,
        f"--platform {options.platform}": options.platform != "host",
    }
    for option, wanted in asked.items():
        if wanted:
            raise UserMistake(
                f"{option}: native FMUs are not built yet; leave it out for the Python FMUs, "
                "which run on Linux and Windows (x86-64)"
            )


def mechanisms(options: argparse.Namespace) -> list[Mechanism]:
    """Return the mechanisms that were asked for.

    Raises
    ------
    UserMistake
        If a name is unknown.
    MechanismError
        If a file cannot be read or does not describe a mechanism.
    """
    if options.mechanism is not None:
        return [load(options.mechanism)]
    files = shipped()
    names = list(dict.fromkeys(options.model or files))
    for name in names:
        if name not in files:
            raise UserMistake(
                f"there is no mechanism {name!r}; shipped are {', '.join(files)}, and "
                "--mechanism FILE.toml takes your own"
            )
    return [load(files[name]) for name in names]


def start_values(texts: Sequence[str]) -> dict[str, float]:
    """Read NAME=VALUE pairs.

    Raises
    ------
    UserMistake
        If a text is no such pair.

    Examples
    --------
    >>> start_values(["stop.restitution=0.5", "stop.position = 1e-3"])
    {'stop.restitution': 0.5, 'stop.position': 0.001}
    """
    changes = {}
    for text in texts:
        name, equals, value = (part.strip() for part in text.partition("="))
        try:
            number = float(value)
        except ValueError:
            number = math.nan
        if not (name and equals and math.isfinite(number)):
            raise UserMistake(
                f"--set {text}: write NAME=VALUE with a finite number in SI units, for instance "
                "--set stop.restitution=0.5"
            )
        changes[name] = number
    return changes


def _build(options: argparse.Namespace) -> list[Path]:
    """Build everything, then write everything; return the files."""
    changes = start_values(options.changes)
    chosen = mechanisms(options)
    _check_names(chosen, changes)
    folder = options.out / PYTHON_FOLDER
    paths = {m.name: folder / f"{m.name}.fmu" for m in chosen}
    _check_writable(folder)
    for path in paths.values():
        _check_no_folder(path)
        if options.simulate:
            _check_no_folder(path.with_suffix(".png"))
    built = {}
    for mechanism in chosen:
        name = mechanism.name
        try:
            built[name] = python_fmu.build(mechanism, changes, _progress(name))
        except PrbmError as error:
            raise UserMistake(f"{name}: {error}") from None
    for name, content in built.items():
        path = paths[name]
        try:
            write(path, content)
        except OSError as error:
            raise UserMistake(
                f"cannot write {path}: {error.strerror}; choose a folder with --out"
            ) from None
        print(f"{name}: {path} ({len(content) / 1000:.0f} kB)", flush=True)
    return [*paths.values()]


def _check_names(chosen: Sequence[Mechanism], changes: Mapping[str, float]) -> None:
    """Refuse start values that some of the mechanisms know and others do not."""
    known = {m.name: {*m.values(), *input_names(m)} for m in chosen}
    for name in changes:
        having = [model for model in known if name in known[model]]
        lacking = [model for model in known if name not in known[model]]
        if having and lacking:
            options = " ".join(f"--model {model}" for model in having)
            raise UserMistake(
                f"--set {name}: {', '.join(lacking)} has no such parameter or input; add {options} "
                "to build without it"
            )


def _progress(name: str) -> Callable[[str], None]:
    return lambda step: print(f"{name}: {step} ...", flush=True)


def _check_writable(folder: Path) -> None:
    """Find out before the work whether its result can be kept."""
    existing = folder
    while not existing.exists() and existing != existing.parent:
        existing = existing.parent
    if not existing.is_dir():
        raise UserMistake(
            f"cannot write to {folder}: {existing} is a file; choose a folder with --out"
        )
    if not os.access(existing, os.W_OK):
        raise UserMistake(
            f"cannot write to {folder}: no permission in {existing}; choose a folder with --out"
        )


def _check_no_folder(path: Path) -> None:
    if path.is_dir():
        raise UserMistake(
            f"cannot write {path}: it is a folder; remove it, or choose another place with --out"
        )


def _simulate(fmus: Sequence[Path]) -> int:
    """Simulate each FMU in a process of its own."""
    source = str(Path(__file__).resolve().parents[1])
    paths = os.pathsep.join(filter(None, (source, os.environ.get("PYTHONPATH"))))
    status = OK
    for fmu in fmus:
        command = [sys.executable, "-c", REPORT, str(fmu), str(fmu.with_suffix(".png"))]
        print(f"{fmu.stem}: simulating ...", flush=True)
        code = _ended(command, os.environ | {"PYTHONPATH": paths})
        if code == INTERRUPTED:
            raise KeyboardInterrupt
        if code != OK:
            ended = f"was ended by signal {-code}" if code < 0 else "failed"
            print(f"{command_name()}: the simulation of {fmu} {ended}", file=sys.stderr)
            status = max(status, code if code == MISTAKE else FAILED)
    return status


def _ended(command: Sequence[str], environment: Mapping[str, str]) -> int:
    """Run a command to its end, return its status; what Ctrl-C means to it, it decides itself."""
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)  # it inherits that until it is ready
    try:
        process = subprocess.Popen(command, env=environment)
    finally:
        signal.signal(signal.SIGINT, before)
    try:
        return process.wait()
    except KeyboardInterrupt:
        _end(process)
        raise


def _end(process: subprocess.Popen[bytes]) -> None:
    """Wait for a process that should end by itself; insist if it does not."""
    for number in (signal.SIGINT, signal.SIGTERM):
        try:
            process.wait(PATIENCE)
            return
        except subprocess.TimeoutExpired:
            os.kill(process.pid, number)
    process.wait()
