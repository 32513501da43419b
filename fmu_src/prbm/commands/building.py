"""The command that builds FMUs, and shows that they run."""

import argparse
import json
import math
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn

from ..base.atomic import check_no_folder, check_writable, write
from ..base.errors import PrbmError
from ..base.version import __version__
from ..files.mechanism_file import read_mechanism, schema, shipped
from ..files.settings import UserMistake
from ..fmu import native_fmu, python_fmu
from ..kernel.compiler import ALL, HOST, PLATFORMS, CompilerError, this_platform
from ..mechanics.inputs import input_names
from ..mechanism.description import Mechanism
from .program import FAILED, INTERRUPTED, MISTAKE, OK, command_name

TERMINATION_TIMEOUT = 2.0  # s for the process of a simulation to end after Ctrl-C
REPORT = f"""
import os, signal, sys
signal.signal(signal.SIGINT, lambda *_: os._exit({INTERRUPTED}))
from prbm.commands.fmu_report import main
sys.exit(main(sys.argv[1:]))
"""  # Ctrl-C while it imports needs no traceback


@dataclass(frozen=True)
class Flavour:
    """A kind of FMU: the folder it goes to, its version of FMI, whether it has an output clock."""

    folder: str
    fmi: int = 2
    native: bool = True
    clock: bool = False


PYTHON = Flavour("python", native=False)
NATIVE = {"2": Flavour("fmi2", 2), "3": Flavour("fmi3", 3)}
CLOCKED = Flavour("fmi3-clock", 3, clock=True)


class _Parser(argparse.ArgumentParser):
    """A parser that answers a mistake with one sentence."""

    def error(self, message: str) -> NoReturn:
        raise UserMistake(f"{message}; see {self.prog} --help")


def parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    p = _Parser(
        prog=command_name(),
        description="Build FMUs of compliant mechanisms with impacts.",
        epilog="Without options, all shipped mechanisms are built into dist/: as Python FMUs, and "
        "as native FMUs of FMI 2.0 and 3.0 for this machine.",
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
        help="python: readable source, needs NumPy and SciPy where it runs; native: compiled, "
        "needs nothing (default: both)",
    )  # fmt: skip
    p.add_argument("--fmi", choices=("2", "3"), help="version of FMI (default: both)")
    p.add_argument(
        "--platform", action="append", metavar="NAME",
        help=f"where native FMUs run: {HOST}, {ALL}, or some of {', '.join(PLATFORMS)}; may be "
        f"repeated (default: {HOST}; all others take the Python package ziglang)",
    )  # fmt: skip
    p.add_argument(
        "--clock", action="store_true",
        help="build the variant of FMI 3.0 whose stops have an output clock, and nothing else",
    )  # fmt: skip
    p.add_argument("--out", type=Path, default=Path("dist"), metavar="DIR", help="default: dist")
    p.add_argument(
        "--set", action="append", default=[], dest="changes", metavar="NAME=VALUE",
        help="start value of a parameter or input, in SI units; may be repeated",
    )  # fmt: skip
    p.add_argument(
        "--simulate", action="store_true",
        help="simulate each FMU with FMPy, print what happens and plot it beside the FMU",
    )  # fmt: skip
    p.add_argument(
        "--schema", action="store_true",
        help="print the JSON schema of mechanism files, for editors, and stop",
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
        if options.schema:
            print(json.dumps(schema(), indent=2))
            return OK
        order = _order(options)
        built, missing = _build(order)
        status = _simulate(built) if options.simulate else OK
        if missing:
            print(f"{command_name()}: {missing}", file=sys.stderr)
            status = max(status, FAILED)
        return status
    except PrbmError as error:
        print(f"{command_name()}: {error}", file=sys.stderr)
        return MISTAKE
    except KeyboardInterrupt:
        print(f"{command_name()}: interrupted", file=sys.stderr)
        return INTERRUPTED


def _list() -> None:
    files = shipped()
    width = max(map(len, files))
    for name, path in files.items():
        print(f"{name:{width}}  {read_mechanism(path).title}")


def asked_flavours(options: argparse.Namespace) -> tuple[Flavour, ...]:
    """Return the kinds of FMU that were asked for.

    Raises
    ------
    UserMistake
        If there is no such kind.
    """
    python, native = options.flavour != "native", options.flavour != "python"
    if options.clock:
        if not native or options.fmi == "2":
            raise UserMistake(
                "--clock: only native FMUs of FMI 3.0 have clocks; leave out --flavour python and "
                "--fmi 2"
            )
        return (CLOCKED,)
    if not native:
        if options.fmi == "3":
            raise UserMistake("Python FMUs are FMI 2.0; leave out --fmi 3 or --flavour python")
        if options.platform:
            raise UserMistake(
                f"--platform {options.platform[0]}: Python FMUs run on Linux and Windows (x86-64) "
                "as they are; leave it out, or leave out --flavour python"
            )
    kinds = [flavour for fmi, flavour in NATIVE.items() if native and options.fmi in (None, fmi)]
    return (*([PYTHON] if python and options.fmi != "3" else []), *kinds)


def asked_platforms(options: argparse.Namespace) -> tuple[str, ...]:
    """Return the platforms that were asked for, by our names.

    Raises
    ------
    UserMistake
        If there is no such platform, or none that can simulate what is to be simulated here.
    """
    names = [name.strip() for text in options.platform or [HOST] for name in text.split(",")]
    aliases = {p.folder2: p.name for p in PLATFORMS.values()}
    chosen = tuple(dict.fromkeys(aliases.get(name, name) for name in names))
    for name in chosen:
        if name not in (HOST, ALL, *PLATFORMS):
            raise UserMistake(
                f"--platform {name}: there is no such platform; choose {HOST}, {ALL} or some of "
                f"{', '.join(PLATFORMS)}"
            )
    here = this_platform()
    if options.simulate and here and not {HOST, ALL, here.name} & {*chosen}:
        raise UserMistake(
            f"--simulate: what is built for {', '.join(chosen)} does not run on this machine; add "
            f"--platform {HOST}, or leave out --simulate"
        )
    return chosen


@dataclass(frozen=True)
class Order:
    """What to build, checked as far as that takes no time.

    ``native`` tells whether native FMUs were asked for, and not just built with all others.
    """

    mechanisms: tuple[Mechanism, ...]
    changes: Mapping[str, float]
    flavours: tuple[Flavour, ...]
    platforms: tuple[str, ...]
    native: bool
    out: Path

    def path(self, flavour: Flavour, name: str) -> Path:
        """Return where an FMU goes."""
        return self.out / flavour.folder / f"{name}.fmu"


def _order(options: argparse.Namespace) -> Order:
    order = Order(
        tuple(mechanisms(options)),
        start_values(options.changes),
        asked_flavours(options),
        asked_platforms(options),
        bool(options.flavour or options.fmi or options.platform or options.clock),
        options.out,
    )
    _check_names(order.mechanisms, order.changes)
    for flavour in order.flavours:
        check_writable(order.out / flavour.folder)
        for mechanism in order.mechanisms:
            path = order.path(flavour, mechanism.name)
            check_no_folder(path)
            if options.simulate:
                check_no_folder(path.with_suffix(".png"))
    return order


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
        return [read_mechanism(options.mechanism)]
    files = shipped()
    names = list(dict.fromkeys(options.model or files))
    for name in names:
        if name not in files:
            raise UserMistake(
                f"there is no mechanism {name!r}; shipped are {', '.join(files)}, and "
                "--mechanism FILE.toml takes your own"
            )
    return [read_mechanism(files[name]) for name in names]


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


def _build(order: Order) -> tuple[list[Path], str]:
    """Build everything, then write everything; return the files, and what is missing and why.

    Whoever asks for native FMUs gets them or an error.  Whoever asks for nothing in particular and
    has no compiler gets the Python FMUs, and is told.
    """
    built: dict[Path, bytes] = {}
    missing = ""
    try:
        for flavour in order.flavours:
            for mechanism in order.mechanisms:
                path = order.path(flavour, mechanism.name)
                built[path] = _fmu(order, flavour, mechanism)
    except CompilerError as error:
        if order.native:
            raise
        missing = f"only the Python FMUs were built: {error}"
    for path, content in built.items():
        try:
            write(path, content)
        except OSError as error:
            raise UserMistake(
                f"cannot write {path}: {error.strerror}; choose a folder with --out"
            ) from None
        print(f"{path.stem}: {path} ({len(content) / 1000:.0f} kB)", flush=True)
    return [*built], missing


def _fmu(order: Order, flavour: Flavour, mechanism: Mechanism) -> bytes:
    told = _progress(f"{flavour.folder}/{mechanism.name}")
    changes, platforms = order.changes, order.platforms
    try:
        if not flavour.native:
            return python_fmu.build(mechanism, changes, told)
        return native_fmu.build(mechanism, changes, flavour.fmi, platforms, flavour.clock, told)
    except CompilerError:
        raise  # which has nothing to do with the mechanism
    except PrbmError as error:
        raise UserMistake(f"{mechanism.name}: {error}") from None


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


def _simulate(fmus: Sequence[Path]) -> int:
    """Simulate each FMU in a process of its own."""
    source = str(Path(__file__).resolve().parents[1])
    paths = os.pathsep.join(filter(None, (source, os.environ.get("PYTHONPATH"))))
    status = OK
    for fmu in fmus:
        command = [sys.executable, "-c", REPORT, str(fmu), str(fmu.with_suffix(".png"))]
        print(f"{fmu.parent.name}/{fmu.stem}: simulating ...", flush=True)
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
            process.wait(TERMINATION_TIMEOUT)
            return
        except subprocess.TimeoutExpired:
            os.kill(process.pid, number)
    process.wait()
