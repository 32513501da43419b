"""Arguments shared by several commands, and a parser that proposes similar words.

This module imports no slow packages, so that help appears at once.
"""

import re
import sys
import textwrap
from argparse import ArgumentParser, RawDescriptionHelpFormatter
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, NoReturn

from ..base.text import comma_advice

WIDTH = 79  # Columns of a description.
MECHANISM = "name of a shipped mechanism (see prbm list), or mechanism file FILE.toml"
QUANTITIES = 'quantities are in SI or have a unit: 0.01, 10mm, "-10 mm"; in lists also -10 0 10 mm'
ANIMATION_USAGE = "[options] (RESULT.csv | MECHANISM | --model NAME | --mechanism FILE) OUT.gif"

INVALID_CHOICE = re.compile(r"invalid choice: '(?P<word>.*?)' \(choose from (?P<choices>.*)\)")
SIMILARITY_MIN = 0.6  # Least similarity of a proposed word by difflib, from 0 to 1.


class ProposingParser(ArgumentParser):
    """A parser whose messages about unknown options and commands propose similar ones."""

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """Parse arguments; report unknown options before missing arguments."""
        self._words = [*(args or ())]
        if args is not None and not self.allow_abbrev and self._subparsers is None:
            self._check_options(args)
        return super().parse_known_args(args, namespace)

    def _print_message(self, message: str, file: Any = None) -> None:
        """Print the help or the version.

        Some versions of argparse ignore that the reader has closed the pipe.
        """
        print(message, end="", file=file or sys.stderr)

    def _check_options(self, words: Sequence[str]) -> None:
        """Report the first unknown option."""
        for word in words:
            if word == "--":
                return
            option = word.partition("=")[0]
            if option.startswith("--") and option not in self._option_string_actions:
                self.error(f"unrecognized arguments: {option}")

    def proposed(self, message: str) -> str:
        """Return a message of argparse with similar options or choices."""
        invalid = INVALID_CHOICE.search(message)
        if invalid:
            choices = re.findall(r"[\w.-]+", invalid["choices"])
            return f"{message}{_proposal(invalid['word'], choices)}"
        if "invalid float value" in message and (advice := comma_advice(message)):
            return f"{message}; {advice.partition(':')[0]}"
        prefix, _, words = message.partition("unrecognized arguments: ")
        if not prefix and words.startswith("--"):
            options = [x for x in self._option_string_actions if x.startswith("--")]
            return f"{message}{_proposal(words.split()[0], options)}"
        return message if prefix else f"{message}{self._repetition(words)}"

    def _repetition(self, unknown: str) -> str:
        """Return the remedy for several values of an option that has one."""
        for k, word in enumerate(self._words):
            if "=" in word and not word.startswith("--") and unknown.startswith(word):
                before = [x for x in self._words[:k] if x.startswith("--")]
                return f"; repeat the option: {before[-1]} {word!r}" if before else ""
        return ""


def _proposal(word: str, known: Iterable[str]) -> str:
    from difflib import get_close_matches  # imported here: needed for mistakes only

    names = {name.lstrip("-"): name for name in known}
    near = get_close_matches(word.lstrip("-"), names, n=1, cutoff=SIMILARITY_MIN)
    return f"; did you mean {names[near[0]]}?" if near else ""


class ArgumentMistake(Exception):
    """Invalid command line."""


class Parser(ProposingParser):
    """A parser that reports a mistake in one sentence."""

    def error(self, message: str) -> NoReturn:
        """Raise ArgumentMistake with the message."""
        raise ArgumentMistake(f"{self.prog}: {self.proposed(message)}; see {self.prog} --help")


Commands = Any  # argparse does not name the type of add_subparsers()


def add_command(
    commands: Commands,
    name: str,
    run: str,
    summary: str,
    example: str,
    *,
    details: str = "",
    **more: Any,
) -> ArgumentParser:
    """Add a command.

    Parameters
    ----------
    commands : subparsers of argparse
        The commands so far.
    name : str
        Name of the command.
    run : str
        Its function as module:function, imported when the command runs.
    summary, details : str
        Phrase for the list of commands; further sentences for the help of this command.
    example : str
        Examples of command lines.
    more : dict
        Further arguments of the parser.
    """
    parser: ArgumentParser = commands.add_parser(
        name,
        help=summary,
        description=textwrap.fill(f"{summary[0].upper()}{summary[1:]}.  {details}", WIDTH),
        epilog=f"{example}\n\n{QUANTITIES}",
        formatter_class=RawDescriptionHelpFormatter,
        allow_abbrev=False,
        **more,
    )
    parser.set_defaults(run=run, prog=parser.prog)
    return parser


def examples(*lines: str) -> str:
    """Return the text of examples in the help of a command."""
    return "\n  ".join(["example:" if len(lines) == 1 else "examples:", *lines])


def picture_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of ``prbm picture``."""
    add = parser.add_argument
    add("mechanism", metavar="MECHANISM", help="mechanism file, or name of a shipped mechanism")
    add("--modes", type=int, default=0, metavar="N", help="number of modes to draw (default: 0)")
    add(
        "--out", type=Path, metavar="FILE.png",
        help="file to write (default: the mechanism's name with .png)",
    )  # fmt: skip
    set_argument(parser)


def animation_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of ``prbm animate``."""
    add = parser.add_argument
    add(
        "files", nargs="+", metavar="FILE",
        help="RESULT.csv or a mechanism to show, then OUT.gif or OUT.mp4 to write",
    )  # fmt: skip
    mechanism = parser.add_mutually_exclusive_group()
    mechanism.add_argument("--model", metavar="NAME", help="name of a shipped mechanism")
    mechanism.add_argument("--mechanism", metavar="FILE.toml", help="mechanism file")
    set_argument(parser, "value of a parameter or input")
    input_argument(parser)
    stop_time_argument(parser)
    add(
        "--slow", type=float, metavar="FACTOR",
        help="factor of slow motion (default: a round factor for a film of about ten seconds)",
    )  # fmt: skip
    engine_argument(parser)
    add("--stress", action="store_true", help="draw the stress of the flexures as their colour")
    add("--fps", type=float, metavar="N", help="frames per second (default: 25)")
    add("--from", dest="start", metavar="T", help="first time shown [s] (default: the release)")
    add(
        "--to", dest="stop", metavar="T",
        help="last time shown [s] (default: shortly after the motion ends)",
    )  # fmt: skip


def sweep_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of ``prbm sweep``."""
    add = parser.add_argument
    add("fmu", metavar="FMU", help="FMU of FMI 2.0 or 3.0 with co-simulation")
    add(
        "table", metavar="TABLE",
        help="CSV or Parquet file with one column per variable and one row per run, in SI units",
    )  # fmt: skip
    add(
        "--out", default="results.parquet", metavar="FILE",
        help="Parquet file of the results (default: %(default)s)",
    )  # fmt: skip
    add(
        "--output", "--of", action="append", metavar="OUTPUT",
        help="recorded output: a variable, for its final value; 'max(shuttle.x)', or min, mean; "
        "'first(shuttle.x > 0)', the first time of a condition; 'since(stop.contact)', the time "
        "from which it holds to the end; repeatable (default: all outputs)",
    )  # fmt: skip
    set_argument(parser, "start value of all runs")
    input_argument(parser)
    add("--stop-time", metavar="T", help="end of the runs [s] (default: that of the FMU)")
    add("--step", metavar="T", help="communication step [s] (default: that of the FMU)")
    add(
        "--tolerance", metavar="X",
        help="relative tolerance of the integration (default: that of the FMU)",
    )  # fmt: skip
    _runner_arguments(parser)


def _runner_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of a study on which its results do not depend."""
    add = parser.add_argument
    add("--workers", type=int, metavar="N", help="number of parallel runs (default: one per core)")
    add(
        "--scheduler", metavar="ADDRESS",
        help="Dask scheduler for the runs, e.g. tcp://host:8786 (default: this machine)",
    )  # fmt: skip
    add(
        "--retries", type=int, default=1, metavar="N",
        help="number of repetitions of a run that crashed (default: %(default)s)",
    )  # fmt: skip
    add("--timeout", metavar="T", help="longest duration of a run [s] (default: no limit)")
    add("--overwrite", action="store_true", help="forget the rows of an earlier study")
    add("--retry-failed", action="store_true", help="repeat runs that failed earlier")


def study_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of ``prbm study``."""
    add = parser.add_argument
    add(
        "--vary", action="append", metavar="NAME=RANGE",
        help="parameter or input: LOW:HIGH:COUNT for samples, whose combinations are simulated; "
        "LOW:HIGH or 'VALUE +- 2 %%' for a range or a tolerance from which --runs are drawn; "
        "a unit of HIGH holds for both; repeatable",
    )  # fmt: skip
    add("--table", type=Path, metavar="FILE.csv", help="list of simulations, in place of --vary")
    add("--runs", type=int, metavar="N", help="number of simulations that are drawn")
    add(
        "--method", choices=("sobol", "latin", "random", "sensitivity"), default="sobol",
        help="how they are drawn; sensitivity: indices of Sobol from N (p + 2) simulations "
        "(default: %(default)s)",
    )  # fmt: skip
    add("--seed", type=int, default=0, metavar="K", help="seed of --runs (default: 0)")
    add(
        "--of", action="extend", nargs="+", metavar="OUTPUT",
        help="outputs: settling, settling_estimate, impacts, last_impact, impact_speed, impulse, "
        "peak_speed, peak_force, peak_stress, energy_lost; fundamental, mode(2), rest(shuttle.x), "
        "which need no simulation; a variable, for its final value; max(x), min(x), mean(x), "
        "first(x > 0), since(x > 0), also of abs(x)",
    )  # fmt: skip
    optimum = parser.add_mutually_exclusive_group()
    optimum.add_argument("--minimise", metavar="OUTPUT", help="output whose minimum is searched")
    optimum.add_argument("--maximise", metavar="OUTPUT", help="output whose maximum is searched")
    add(
        "--subject-to", action="extend", nargs="+", default=[], metavar="CONSTRAINT",
        help="conditions on outputs, e.g. 'fundamental > 40 Hz'; the share of drawn simulations "
        "that satisfy them is their yield",
    )  # fmt: skip
    add(
        "--tolerance-of", action="append", default=[], metavar="NAME=TOLERANCE",
        help="tolerance for the yield around the optimum, e.g. 'stop.position=0.1 mm', beside "
        "those in the mechanism file; repeatable",
    )  # fmt: skip
    add("--step", metavar="T", help="time between samples of a motion [s] (default: 1/4000 of it)")
    add(
        "--tolerance", metavar="X",
        help="relative tolerance of the integration (default: solver.tolerance)",
    )  # fmt: skip
    _runner_arguments(parser)


def stop_time_argument(parser: ArgumentParser) -> None:
    """Add --stop-time."""
    parser.add_argument(
        "--stop-time", metavar="T",
        help="duration of the simulation [s] (default: that of the mechanism's FMU, usually 1)",
    )  # fmt: skip


def engine_argument(parser: ArgumentParser) -> None:
    """Add --engine."""
    parser.add_argument(
        "--engine", metavar="ENGINE", choices=("kernel", "python"),
        help="kernel: compiled C; python: the specification, about a hundred times slower "
        "(default: kernel, or python without a C compiler)",
    )  # fmt: skip


def input_argument(parser: ArgumentParser) -> None:
    """Add --input."""
    parser.add_argument(
        "--input", action="append", default=[], metavar="NAME=SIGNAL",
        help='input over time: "force.x=step(1 N, 10 ms)", or pulse, half-sine, sine, chirp, '
        "csv(FILE, COLUMN); repeatable",
    )  # fmt: skip


def set_argument(parser: ArgumentParser, meaning: str = "value of a parameter") -> None:
    """Add --set."""
    parser.add_argument(
        "--set", action="append", default=[], metavar="NAME=VALUE",
        help=f'{meaning}, in SI or with a unit: "release.displacement=-10 mm"; repeatable',
    )  # fmt: skip


def linear_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of linear models."""
    add = parser.add_argument
    text = "inputs, such as force.x or base.acceleration.x (default: all forces and the base)"
    add("--inputs", action="extend", nargs="+", metavar="NAME", help=text)
    text = "outputs, such as shuttle.x or base.force.x (default: the motion of the released body)"
    add("--outputs", action="extend", nargs="+", metavar="NAME", help=text)
    text = "stops that the mechanism rests on (default: none)"
    add("--resting", action="extend", nargs="+", metavar="STOP", help=text)
    text = "range of the frequency response [Hz] (default: about the lowest modes)"
    add("--frequencies", metavar="A:B", help=text)


def load_argument(parser: ArgumentParser) -> None:
    """Add --load."""
    parser.add_argument(
        "--load", action="extend", nargs="+", metavar="NAME=X",
        help="dead loads, forces [N] and moments [N m], such as force.y=-5N (default: none)",
    )  # fmt: skip


def parameters_argument(parser: ArgumentParser) -> None:
    """Add --parameters."""
    parser.add_argument(
        "--parameters", metavar="FILE.ssv",
        help="parameter set (SSV), as prbm parameters --out writes; --set has priority",
    )  # fmt: skip


def stress_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of ``prbm stress``."""
    parser.add_argument(
        "--held", action="extend", nargs="+", metavar="X",
        help="displacements [m] or angles [rad] at which the body is held (default: in motion)",
    )  # fmt: skip
    stop_time_argument(parser)
    set_argument(parser, "value of a parameter or input")
    input_argument(parser)
    engine_argument(parser)


def shock_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of ``prbm shock``."""
    add = parser.add_argument
    add(
        "--pulse", default="half-sine", choices=("half-sine", "sawtooth", "trapezoid"),
        help="shape of the pulse (default: %(default)s); the sawtooth ends at its peak",
    )  # fmt: skip
    add("--peak", metavar="A", help='largest acceleration of the base [m/s2], "500 g"')
    add("--height", metavar="H", help="drop height onto a pad without rebound [m]")
    add("--duration", metavar="T", help="duration of the pulse [s]")
    add("--axis", default="x", choices=("x", "y"), help="direction (default: %(default)s)")
    add(
        "--peaks", action="extend", nargs="+", metavar="A",
        help="several peaks, for the level at which a flexure yields",
    )  # fmt: skip
    add(
        "--sweep", choices=("peak",),
        help="search for the level at which a flexure yields, from --peak on (default: 100 g)",
    )  # fmt: skip
    add("--record", metavar="FILE.csv", help="acceleration over time, in place of a pulse")
    stop_time_argument(parser)
    set_argument(parser, "value of a parameter or input")
    engine_argument(parser)


def mechanism_argument(parser: ArgumentParser) -> None:
    """Add the mechanism."""
    parser.add_argument("mechanism", metavar="MECHANISM", help=MECHANISM)


def out_argument(parser: ArgumentParser) -> None:
    """Add the folder of tables and figures."""
    parser.add_argument(
        "--out", type=Path, metavar="DIR",
        help="folder for tables and figures (default: none are written)",
    )  # fmt: skip


def record_arguments(parser: ArgumentParser) -> None:
    """Add the options for files whose head lacks names or units."""
    group = parser.add_argument_group("names and units of columns")
    group.add_argument(
        "--unit", action="append", default=[], metavar="NAME=UNIT",
        help="unit of a column without a unit, or with a wrong one; repeatable",
    )  # fmt: skip
    group.add_argument(
        "--columns", action="extend", nargs="+", metavar="HEAD",
        help='names and units of all columns of a file without a head: --columns "t [s]" "x [mm]"',
    )  # fmt: skip


def signal_arguments(parser: ArgumentParser) -> None:
    """Add the options that select the signal and its time span."""
    group = parser.add_argument_group("selection of the signal")
    group.add_argument(
        "--column", metavar="NAME",
        help="column of the signal (default: the only column with a suitable unit)",
    )  # fmt: skip
    group.add_argument("--from", dest="start", metavar="T", help="start of the time span [s]")
    group.add_argument("--to", dest="end", metavar="T", help="end of the time span [s]")
    group.add_argument(
        "--calibration", metavar="FILE.csv",
        help="readings of the sensor beside a reference; the signal is converted accordingly",
    )  # fmt: skip


def response_arguments(parser: ArgumentParser) -> None:
    """Add the options that relate a recorded signal to a simulation."""
    add = parser.add_argument
    add("--release", metavar="T", help="time of the release in the record [s] (default: 0)")
    add(
        "--output", metavar="NAME",
        help="recorded output of the mechanism, e.g. shuttle.x (default: the displacement of the "
        "released body along the direction of the release)",
    )  # fmt: skip
    add(
        "--uncertainty", metavar="U",
        help="standard uncertainty of a sample (default: estimated from the residuals)",
    )  # fmt: skip
    engine_argument(parser)
