"""The command ``prbm``: its arguments, and the function that runs each command.

Text goes to standard output; tables and figures into a folder, if ``--out`` names one, all at
once when everything is computed; progress and mistakes to standard error.  The status is 0, 1 if
a computation fails, 2 if the user made a mistake, 130 after Ctrl-C.
"""

import argparse
import importlib
import os
import re
import sys
import textwrap
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NoReturn

from ..base.errors import EquilibriumError, PrbmError, SimulationError
from ..mechanism.flexure import MODELS
from .arguments import (
    ANIMATION_USAGE,
    animation_arguments,
    picture_arguments,
    set_argument,
    stop_time_argument,
)
from .program import FAILED, INTERRUPTED, MISTAKE, OK
from .remedies import in_options

WIDTH = 79  # columns of a description
NEGATIVE = re.compile(r"-\.?\d")
MECHANISM = "name of a shipped mechanism (prbm list), or a mechanism file, FILE.toml"
QUANTITIES = 'quantities are in SI, or have a unit: 0.01, 10mm, "-10 mm"; lists also -10 0 10 mm'


class _ArgumentError(Exception):
    """Invalid command line."""


class _Parser(argparse.ArgumentParser):
    """A parser that reports a mistake in one sentence."""

    def error(self, message: str) -> NoReturn:
        raise _ArgumentError(f"{self.prog}: {message}; see {self.prog} --help")


Commands = Any  # argparse does not name the type of add_subparsers()


def _command(
    commands: Commands, name: str, run: str, summary: str, example: str, **more: Any
) -> argparse.ArgumentParser:
    """Add a command; ``run`` is module:function, imported when it is needed."""
    parser: argparse.ArgumentParser = commands.add_parser(
        name,
        help=summary,
        description=textwrap.fill(f"{summary[0].upper()}{summary[1:]}.", WIDTH),
        epilog=f"{example}\n\n{QUANTITIES}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
        **more,
    )
    parser.set_defaults(run=run, prog=parser.prog)
    return parser


def _examples(*lines: str) -> str:
    return "\n  ".join(["example:" if len(lines) == 1 else "examples:", *lines])


def parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    p = _Parser(
        prog="prbm",
        description="What a compliant mechanism does: its modes, places of rest, motion through "
        "impacts,\nand its parameters from measured data.",
        epilog=_examples(
            "prbm list",
            "prbm modes PRBDM2R",
            "prbm simulate PRBDM2R --set stop.restitution=0.5 --out results",
            "prbm simulate my_mechanism.toml",
        )
        + "\n\nText is printed; --out DIR also writes tables (CSV) and figures (PNG) into a "
        "folder.\nprbm-build-fmu makes FMUs of the same mechanisms.",
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    commands = p.add_subparsers(title="commands", metavar="COMMAND", parser_class=_Parser)
    _list(commands)
    _modes(commands)
    _equilibrium(commands)
    _simulate(commands)
    _fit(commands)
    _impact_map(commands)
    _sweep(commands)
    _measure(commands)
    _picture(commands)
    _animate(commands)
    _validate(commands)
    return p


# --- arguments --------------------------------------------------------------------------------


def _mechanism(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("mechanism", metavar="MECHANISM", help=MECHANISM)


def _out(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--out", type=Path, metavar="DIR",
        help="folder for tables and figures; default: print only",
    )  # fmt: skip


def _list(commands: Commands) -> None:
    _command(
        commands, "list", "shipped:listed", "the shipped mechanisms, a line each",
        _examples("prbm list"),
    )  # fmt: skip


def _modes(commands: Commands) -> None:
    parser = _command(
        commands, "modes", "modes:frequencies",
        "natural frequencies and modes, at rest under gravity or held at a displacement",
        _examples("prbm modes PRBDM2R", "prbm modes PRBDM2R --held -10mm --out modes"),
    )  # fmt: skip
    _mechanism(parser)
    parser.add_argument("--count", type=int, default=6, metavar="N", help="how many; %(default)s")
    parser.add_argument(
        "--held", metavar="X", help="displacement at which a force holds the released body [m]"
    )
    set_argument(parser)
    _out(parser)


def _equilibrium(commands: Commands) -> None:
    parser = _command(
        commands, "equilibrium", "rest:equilibria",
        "places of rest under gravity, the force that holds the released body elsewhere, where "
        "it snaps through",
        _examples(
            "prbm equilibrium PRBDM2R",
            "prbm equilibrium PRBDM2R --held -10 -5 5 10 mm",
            "prbm equilibrium Bistable --from -14mm --to 14mm --out curve",
        ),
    )  # fmt: skip
    _mechanism(parser)
    add = parser.add_argument
    add("--held", nargs="+", metavar="X", help="displacements at which it is held [m]")
    add("--from", dest="start", metavar="A", help="first displacement of a curve [m]")
    add("--to", dest="end", metavar="B", help="last displacement of the curve [m]")
    add("--points", type=int, default=41, metavar="N", help="of the curve; %(default)s")
    set_argument(parser)
    _out(parser)


def _simulate(commands: Commands) -> None:
    parser = _command(
        commands, "simulate", "simulation:simulated",
        "the motion from the release through impacts to rest",
        _examples(
            "prbm simulate PRBDM2R --set stop.restitution=0.5 --out results",
            "prbm simulate PRBDM2R --spectrum first --out results",
        ),
    )  # fmt: skip
    _mechanism(parser)
    add = parser.add_argument
    stop_time_argument(parser)
    add("--step", metavar="T", help="between rows of the table [s]; mostly 0.001")
    add("--tolerance", metavar="X", help="relative, of the integration; default: solver.tolerance")
    set_argument(parser, "a parameter or an input")
    add(
        "--spectrum", nargs="?", const="first", choices=("first", "last"),
        help="frequencies after the first impact, simulated without the wall from there on, or "
        "after the last one of the simulation; default: first",
    )  # fmt: skip
    add(
        "--spectrum-time", default="0.2", metavar="T",
        help="how long to listen after the first impact [s]; %(default)s",
    )  # fmt: skip
    _out(parser)


def _record(parser: argparse.ArgumentParser) -> None:
    """Add what a record needs whose head says too little."""
    group = parser.add_argument_group("how to read a file")
    group.add_argument(
        "--unit", action="append", default=[], metavar="NAME=UNIT",
        help="unit of a column that has none, or a wrong one; may be repeated",
    )  # fmt: skip
    group.add_argument(
        "--columns", nargs="+", metavar="HEAD",
        help='heads of all columns of a file without any, --columns "t [s]" "x [mm]"',
    )  # fmt: skip


def _signal(parser: argparse.ArgumentParser) -> None:
    """Add which part of a record is the signal."""
    group = parser.add_argument_group("which part of the record")
    group.add_argument(
        "--column", metavar="NAME", help="of the signal; default: the only one that can be it"
    )
    group.add_argument("--from", dest="start", metavar="T", help="leave out what is before [s]")
    group.add_argument("--to", dest="end", metavar="T", help="leave out what is after [s]")
    group.add_argument(
        "--calibration", metavar="FILE.csv",
        help="record of a sensor beside a reference, by which to convert the signal",
    )  # fmt: skip


def _response(parser: argparse.ArgumentParser) -> None:
    """Add what a response is besides a signal."""
    add = parser.add_argument
    add("--release", metavar="T", help="time of the release in the record [s]; 0")
    add(
        "--output", metavar="NAME",
        help="output of the mechanism that was recorded, as shuttle.x; default: the displacement "
        "of the released body along its release",
    )  # fmt: skip
    add("--uncertainty", metavar="U", help="standard, of a sample; default: from the residuals")


def _fit(commands: Commands) -> None:
    parser = _command(
        commands, "fit", "fitting:fitted",
        "parameters of a mechanism fitted to frequencies, a response, a force curve",
        _examples(
            'prbm fit PRBDM --free flexure.K_theta --frequency "4.82 Hz +- 0.06"',
            "prbm fit PRBDM2R --free flexure.youngs_modulus=100:250GPa \\\n"
            "      --force-deflection force.csv --out fit",
            "prbm fit PRBDM --free stop.restitution --free record.shift=-5:5ms \\\n"
            "      --response bounce.csv --column x",
        ),
    )  # fmt: skip
    _mechanism(parser)
    add = parser.add_argument
    add(
        "--free", action="append", required=True, metavar="NAME[=LOW:HIGH]",
        help="a parameter to fit, with bounds; may be repeated.  record.shift is the time [s] and "
        "record.zero the reading at which the record begins",
    )  # fmt: skip
    set_argument(parser)
    targets = parser.add_argument_group("what to fit to (one or more)")
    targets.add_argument(
        "--frequency", action="append", default=[], metavar="F",
        help='"4.82 Hz +- 0.06", a natural frequency at rest with its standard uncertainty; "130 '
        'Hz +- 1 mode 2 at -10 mm" of another mode, held; may be repeated',
    )  # fmt: skip
    targets.add_argument(
        "--response", metavar="FILE.csv", help="motion over time, from the release"
    )
    targets.add_argument(
        "--force-deflection", metavar="FILE.csv", help="holding forces over displacements"
    )
    add("--deflection", metavar="NAME", help="column of the displacements")
    add("--force", metavar="NAME", help="column of the forces")
    add("--force-uncertainty", metavar="U", help="standard, of a force [N]")
    _response(parser)
    _signal(parser)
    _record(parser)
    _out(parser)


def _impact_map(commands: Commands) -> None:
    parser = _command(
        commands, "impact-map", "maps:mapped",
        "how much of the fundamental mode an impact gives back, over walls and offsets of the hit",
        _examples(
            "prbm impact-map PRBDM2R --model 2R --axial",
            "prbm impact-map PRBDM2R --way algebraic simulated --heights -10 0 10 mm \\\n"
            "      --offsets -4 0 4 mm --out map",
        ),
    )  # fmt: skip
    _mechanism(parser)
    add = parser.add_argument
    add(
        "--heights", nargs="+", metavar="H",
        help="positions of the wall [m]; default: five, to 5/9 of the release on both sides",
    )  # fmt: skip
    add(
        "--offsets", nargs="+", metavar="D",
        help="offsets of the hit [m]; default: five, to 1/20 of the size on both sides",
    )  # fmt: skip
    add(
        "--way", nargs="+", default=["algebraic"], metavar="WAY",
        choices=("algebraic", "simulated", "fitted", "elements", "closed-form"),
        help="algebraic: a pure mode arrives; simulated: the first impact after the release; "
        "fitted: the restitution of a 1R model with the same motion, minutes; elements: finite "
        "elements; closed-form: a free body on the same path, of a mechanism in which one body "
        "moves and does not turn.  Default: algebraic",
    )  # fmt: skip
    add(
        "--model", nargs="+", default=[], metavar="M", choices=tuple(MODELS),
        help=f"models of the flexures: {', '.join(MODELS)} (default: the mechanism's own)",
    )  # fmt: skip
    add("--axial", action="store_true", help="flexures of --model stretch")
    add("--links", type=int, default=12, metavar="N", help="of nR; %(default)s")
    add("--elements", type=int, default=16, metavar="N", help="a flexure; %(default)s")
    add("--stop", metavar="NAME", help="which stop is hit; default: the first")
    set_argument(parser)
    _out(parser)


def _sweep(commands: Commands) -> None:
    parser = _command(
        commands, "sweep", "sweeps:swept",
        "one run of an FMU for each row of a table: parameter studies, Monte Carlo",
        _examples(
            "prbm sweep dist/fmi2/PRBDM2R.fmu table.csv --output stop.impact_count \\\n"
            '      --output "max(shuttle.x)" --stop-time 500ms --out settling.parquet'
        ),
    )  # fmt: skip
    add = parser.add_argument
    add("fmu", metavar="FMU", help="of FMI 2.0 or 3.0, with co-simulation")
    add("table", metavar="TABLE", help="CSV or Parquet: a column a variable, a row a run; in SI")
    add("--out", default="results.parquet", metavar="DIR", help="of the results; %(default)s")
    add(
        "--output", action="append", metavar="OUTPUT",
        help="a variable, for its final value, or max, min, mean, first or since of one, as "
        "'max(shuttle.x)', 'first(shuttle.x > 0)'; may be repeated; default: all outputs",
    )  # fmt: skip
    set_argument(parser, "start value of all runs")
    add("--stop-time", metavar="T", help="end of the runs [s]; default: the FMU's")
    add("--step", metavar="T", help="communication step [s]; default: the FMU's")
    add("--tolerance", metavar="X", help="relative, of the integration; default: the FMU's")
    add("--workers", type=int, metavar="N", help="runs at a time; default: one a core")
    add("--scheduler", metavar="ADDRESS", help="Dask scheduler, tcp://host:8786, for its workers")
    add(
        "--retries", type=int, default=1, metavar="N",
        help="how often a run that crashed is tried again; %(default)s",
    )  # fmt: skip
    add("--timeout", metavar="T", help="give a run up after so long [s]; default: never")
    add("--anew", action="store_true", help="forget what is in the results")
    add("--failed", action="store_true", help="do again what failed before")


def _picture(commands: Commands) -> None:
    parser = _command(
        commands, "picture", "pictures:drawn",
        "a drawing of a mechanism with the names of its parts, and modes, as PNG",
        _examples("prbm picture FoldedSuspension --modes 3 --out folded.png"),
    )  # fmt: skip
    picture_arguments(parser)


def _animate(commands: Commands) -> None:
    parser = _command(
        commands, "animate", "pictures:animated",
        "a GIF or MP4 film of a result, or of a mechanism simulated now",
        _examples(
            "prbm animate PRBDM2R motion.gif --stop-time 0.3",
            "prbm animate results/PRBDM2R.csv motion.mp4",
        ),
        usage=f"%(prog)s {ANIMATION_USAGE}",
    )  # fmt: skip
    animation_arguments(parser)


def _validate(commands: Commands) -> None:
    parser = _command(
        commands, "validate", "validation:validated",
        "the source's results reproduced, or one mechanism beside finite elements and "
        "measurements",
        _examples(
            "prbm validate --out validation",
            'prbm validate my_mechanism.toml --measured "frequency 1 at rest=4.82 Hz +- 0.06"',
        ),
    )  # fmt: skip
    add = parser.add_argument
    add("mechanism", nargs="?", metavar="MECHANISM", help=f"{MECHANISM}; default: the source's")
    add("--only", nargs="+", default=[], metavar="NAME", help="some of the source's results")
    add("--list", action="store_true", help="list the names of the source's results")
    add("--elements", type=int, metavar="N", help="a flexure of MECHANISM; 32")
    add(
        "--measured", action="append", default=[], metavar="NAME=VALUE+-U",
        help="a measured value with its standard uncertainty; may be repeated",
    )  # fmt: skip
    set_argument(parser)
    _out(parser)


# --- measure ----------------------------------------------------------------------------------


def _measure(commands: Commands) -> None:
    parser = _command(
        commands, "measure", "", "one quantity from measured data, with its uncertainty",
        _examples("prbm measure frequency free.csv"),
    )  # fmt: skip
    kinds = parser.add_subparsers(
        title="quantities", metavar="QUANTITY", parser_class=_Parser, required=True
    )
    _modulus(kinds)
    _calibration(kinds)
    _frequency(kinds)
    _restitution(kinds)


def _modulus(kinds: Commands) -> None:
    parser = _command(
        kinds, "youngs-modulus", "measure:modulus",
        "Young's modulus from cantilevers bent by a force, a file a beam",
        _examples(
            'prbm measure youngs-modulus bending.csv --length "40 mm +- 0.05" \\\n'
            '      --width "8 mm +- 0.02" --thickness "0.1 mm +- 0.5 %"'
        ),
    )  # fmt: skip
    add = parser.add_argument
    add("files", nargs="+", metavar="FILE.csv", help="deflections and forces in order of time")
    for what, means in (
        ("length", "from the clamp to the force"), ("width", "of the beam"),
        ("thickness", "in the direction of bending"),
    ):  # fmt: skip
        add(
            f"--{what}", action="append", required=True, metavar="X+-U",
            help=f"{means} [m], with its standard uncertainty; once for all, or once for each file",
        )  # fmt: skip
    add("--deflection", metavar="NAME", help="column; default: the only length")
    add("--force", metavar="NAME", help="column; default: the only force")
    add(
        "--fit-range", nargs=2, type=float, default=(0.25, 0.9), metavar=("LOW", "HIGH"),
        help="fractions of the deflection between which the line is fitted; 0.25 0.9",
    )  # fmt: skip
    add("--window", type=int, default=1, metavar="N", help="samples to average; %(default)s")
    add(
        "--sensor-angle", default="0", metavar="A+-U",
        help="between the sensor and the force [deg]; %(default)s",
    )  # fmt: skip
    add(
        "--force-gain", default="1", metavar="G+-U",
        help="factor on the force, with the uncertainty of its calibration; %(default)s",
    )  # fmt: skip
    _record(parser)
    _out(parser)


def _calibration(kinds: Commands) -> None:
    parser = _command(
        kinds, "calibration", "measure:calibration",
        "the sensitivity of a sensor beside a reference",
        _examples("prbm measure calibration stage.csv --quantity position --reading laser"),
    )  # fmt: skip
    add = parser.add_argument
    add("file", metavar="FILE.csv", help="the reference and the reading, in two columns")
    add("--quantity", metavar="NAME", help="column of the reference; default: the only length")
    add("--reading", metavar="NAME", help="column of the reading; default: the only other one")
    _record(parser)
    _out(parser)


def _frequency(kinds: Commands) -> None:
    parser = _command(
        kinds, "frequency", "measure:frequency", "frequency and damping of a free vibration",
        _examples("prbm measure frequency free.csv --column laser --from 0.5 --to 5.5"),
    )  # fmt: skip
    parser.add_argument("file", metavar="FILE.csv", help="a signal over time")
    _signal(parser)
    _record(parser)
    _out(parser)


def _restitution(kinds: Commands) -> None:
    parser = _command(
        kinds, "restitution", "measure:restitution",
        "the restitution of a stop that fits a bouncing response; of a 1R guide it is that of "
        "the fundamental mode",
        _examples(
            'prbm measure restitution bounce.csv --set "release.displacement=-10 mm" \\\n'
            "      --free record.shift=-2:2ms --calibration stage.csv"
        ),
    )  # fmt: skip
    add = parser.add_argument
    add("file", metavar="FILE.csv", help="motion over time, from the release")
    add("--mechanism", default="PRBDM", metavar="MECHANISM", help=f"{MECHANISM}; %(default)s")
    add("--stop", metavar="NAME", help="which stop; default: the first")
    add(
        "--free", action="append", default=[], metavar="NAME[=LOW:HIGH]",
        help="a further parameter to fit, as stop.position=-1:1mm; may be repeated",
    )  # fmt: skip
    set_argument(parser)
    _response(parser)
    _signal(parser)
    _record(parser)
    _out(parser)


# --- run --------------------------------------------------------------------------------------


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit status."""
    try:
        status = _run([*(sys.argv[1:] if arguments is None else arguments)])
        sys.stdout.flush()
    except BrokenPipeError:  # whoever read the text has seen enough of it
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return FAILED
    return status


def _run(words: Sequence[str]) -> int:
    if not words:
        parser().print_help(sys.stderr)
        return MISTAKE
    name = "prbm"
    try:
        options = parser().parse_args(protected(words))
        name = options.prog
        _function(options.run)(options)
        return OK
    except SystemExit:  # after the help
        return OK
    except _ArgumentError as error:
        return _told(str(error), MISTAKE)
    except KeyboardInterrupt as stop:
        return _told(f"{name}: {str(stop) or 'interrupted'}", INTERRUPTED)
    except Exception as error:
        status = _status(error)
        if status is None:
            raise
        return _told(f"{name}: {in_options(str(error))}", status)


def protected(words: Sequence[str]) -> list[str]:
    """Return the words of a command line with negative quantities kept from looking like options.

    Examples
    --------
    >>> protected(["modes", "PRBDM", "--held", "-1e-2"])
    ['modes', 'PRBDM', '--held', ' -1e-2']
    """
    return [f" {word}" if NEGATIVE.match(word) else word for word in words]


def _function(run: str) -> Callable[[argparse.Namespace], None]:
    module, _, function = run.partition(":")
    found: Callable[[argparse.Namespace], None] = getattr(
        importlib.import_module(f".{module}", __package__), function
    )
    return found


def _status(error: Exception) -> int | None:
    """Return the status of a mistake or a failed computation; None if it is an error of ours."""
    if isinstance(error, EquilibriumError | SimulationError):
        return FAILED
    return MISTAKE if isinstance(error, PrbmError) else None


def _told(sentence: str, status: int) -> int:
    if sys.stderr.isatty():
        print("\r", end="", file=sys.stderr)  # over what is written of the progress
    print(sentence, file=sys.stderr)
    return status
